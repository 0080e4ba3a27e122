"""What is known of a calibrated night: exposures with attitudes and odds, images with their stars, lenses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.angles import ARCSEC
from photogram.show.page import Fact
from photogram.show.quantity import Axis, Quantity, chosen, frame, of_each
from photogram.stellar.night_result import CalibratedNight, Night
from photogram.stellar.pointing import axis_of

if TYPE_CHECKING:
    import pandas as pd

_PIXELS = (Axis.of("x", "px", "_px"), Axis.of("y", "px", "_px"))
_PLACE = (Axis.of("ra", "arcsec"), Axis.of("dec", "arcsec"))


def exposure_table(result: CalibratedNight) -> pd.DataFrame:
    """Return one row for each exposure that takes part.

    Angles in degrees, azimuths from south, positive west; the quaternion (w, x, y, z) leads from ICRS to the
    camera (x right, y down, z along the axis), the covariance (radians squared) is that of the small turn
    about these axes, its upper triangle row by row; `by_chance` is the expected number of chance matches,
    `log_odds` a natural logarithm.
    """
    import pandas as pd

    return pd.DataFrame(frame(exposures(result)))


def exposures(result: CalibratedNight) -> list[Quantity]:
    """Return the exposures that take part: how they fit, their attitudes here and in ICRS."""
    return [*fit(result), *attitudes(result)[1:], *inertial(result)[1:]]


def fit(result: CalibratedNight) -> list[Quantity]:
    """Return how many images of each exposure have stars, how they fit, and how certain the stars are."""
    found, count = result.calibration, len(result.names)
    own = [found.exposures == i for i in range(count)]
    rms = np.array([np.sqrt(np.mean(found.residuals[rows] ** 2)) for rows in own])
    certain = [result.star_probabilities[rows] for rows in own]
    least = np.array([np.nanmin(each) if np.isfinite(each).any() else np.nan for each in certain])
    images_ = [len(each.xy) for each in result.exposures]
    return [
        _exposure(result),
        of_each(result.exposures, "utc", kind="name", name="utc", head="UTC"),
        Quantity(images_, name="images", member="images", head="Images"),
        Quantity(result.identified, name="identified", member="identified", head="Identified"),
        Quantity(result.rejected, name="left_out", member="rejected", head="Left out"),
        Quantity(rms, _PIXELS[:1], "deviation", head="rms", decimals=3),
        Quantity(result.odds, name="by_chance", member="expected_chance_matches"),
        Quantity(result.probabilities, name="probability", member="probability"),
        Quantity(result.log_odds, name="log_odds", member="log_odds", head="Log odds", decimals=1),
        Quantity(least, head="Least certain star", figures=6),
    ]


def attitudes(result: CalibratedNight) -> list[Quantity]:
    """Return the attitudes in the system of the station: axis, angles, mean errors, covariances."""
    found = result.calibration
    azimuth, elevation = np.degrees([axis_of(each) for each in found.attitudes]).T
    errors = np.sqrt(np.diagonal(found.attitude_covariances, axis1=1, axis2=2))
    angles = tuple(map(Axis.turned, ("alpha", "omega", "kappa")))
    south = "Azimuth from south, positive west"
    return [
        _exposure(result),
        _degrees(azimuth, "azimuth_south_deg", south, 5, "azimuth_deg"),
        _degrees(elevation, "elevation_deg", "Elevation", 5, "elevation_deg"),
        Quantity(found.attitudes, angles, "value", member="alpha_omega_kappa_rad"),
        Quantity(errors, angles, "deviation", head="sd {}", decimals=2),
        Quantity(found.attitude_covariances, member="covariance"),
        Quantity(found.cross_covariances, member="covariance_with_camera"),
    ]


def inertial(result: CalibratedNight) -> list[Quantity]:
    """Return the attitudes in ICRS: axis, quaternion, mean errors and covariances of turns of the camera."""
    found = result.inertial
    ra, dec = np.degrees([each.axis for each in found]).T
    covariances = np.array([each.covariance for each in found])
    turns = tuple(Axis("about " + name, "rad", small="arcsec", factor=1 / ARCSEC) for name in "xyz")
    upper = tuple(Axis(f"{a}{b}") for k, a in enumerate("xyz") for b in "xyz"[k:])
    members = [
        {
            "quaternion": each.quaternion,
            "quaternion_covariance": each.quaternion_covariance,
            "covariance": each.covariance,
            "right_ascension_deg": right_ascension,
            "declination_deg": declination,
        }
        for each, right_ascension, declination in zip(found, ra.tolist(), dec.tolist(), strict=True)
    ]
    quaternions = np.array([each.quaternion for each in found])
    return [
        _exposure(result),
        _degrees(ra, "ra_deg", "Right ascension in ICRS", 6),
        _degrees(dec, "dec_deg", "Declination in ICRS", 6),
        Quantity(quaternions, tuple(map(Axis, ("qw", "qx", "qy", "qz"))), name=""),
        Quantity(np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)), turns, "deviation"),
        Quantity(covariances[:, *np.triu_indices(3)], upper, name="cov"),
        Quantity(members, member="icrs"),
    ]


def _exposure(result: CalibratedNight) -> Quantity:
    names = np.array(result.names, dtype=object)
    return Quantity(names, kind="name", name="exposure", member="name", head="Exposure")


def _degrees(values: Floats, name: str, head: str, decimals: int, member: str = "") -> Quantity:
    axis = (Axis.of("", "deg"),)
    return Quantity(values, axis, "value", name=name, member=member, head=head, decimals=decimals)


def image_table(result: CalibratedNight) -> pd.DataFrame:
    """Return one row for each image used: pixels, measured minus computed, and how likely its star is."""
    import pandas as pd

    return pd.DataFrame(frame(images(result)))


def images(result: CalibratedNight) -> list[Quantity]:
    """Return the images used: exposures and stars, pixels, residuals, tests, how likely the stars are."""
    found, ids = result.calibration, np.array(result.night.catalogue.ids, dtype=object)
    names = np.array(result.names, dtype=object)[found.exposures]
    return [
        Quantity(names, kind="name", name="exposure", member="exposure", head="Exposure"),
        Quantity(ids[found.stars], kind="name", name="star", member="star", head="Star"),
        Quantity(found.xy, _PIXELS, "value", name="", member="xy_px", head="{}", decimals=2),
        Quantity(
            found.residuals, _PIXELS, "deviation", "residual", "residual_px", head="Residual {}", decimals=3
        ),
        Quantity(found.redundancy, _PIXELS, name="redundancy", member="redundancy"),
        Quantity(
            found.standardized,
            _PIXELS,
            name="standardized",
            member="standardized",
            head="w {}",
            decimals=2,
        ),
        Quantity(result.star_probabilities, name="probability", member="probability"),
    ]


def largest(result: CalibratedNight, most: int) -> list[Quantity]:
    """Return the images with the largest standardized residuals."""
    size = np.nanmax(np.abs(np.nan_to_num(result.calibration.standardized)), axis=1)
    return chosen(images(result), np.argsort(-size, kind="stable")[:most])


def stars(result: CalibratedNight) -> list[Quantity]:
    """Return the stars that were estimated: adjusted minus catalogue, tests."""
    found, ids = result.calibration, np.array(result.night.catalogue.ids, dtype=object)
    table = [
        Quantity(ids[found.catalogue], kind="name", member="id"),
        Quantity(found.star_residuals / ARCSEC, _PLACE, "deviation", member="residual"),
        Quantity(found.star_redundancy, _PLACE, member="redundancy"),
        Quantity(found.star_standardized, _PLACE, member="standardized"),
    ]
    return chosen(table, np.flatnonzero(np.isfinite(found.star_residuals[:, 0])))


def lens_tests(result: CalibratedNight) -> list[Quantity]:
    """Return the tests of the lens, that of its scale first."""
    found = [*([result.scale_test] if result.scale_test else []), *result.term_tests]
    degrees = [f"{each.dimension}, {each.freedom}" for each in found]
    return [
        of_each(found, "name", kind="name", head="Zero?"),
        of_each(found, "statistic", head="F", decimals=2),
        Quantity(degrees, kind="name", head="Degrees of freedom"),
        of_each(found, "probability", head="p", figures=2),
        of_each(found, "level", head="Level", figures=2),
        of_each(found, "effect", (Axis.of("", "px"),), "deviation", head="Effect", decimals=3),
        of_each(found, "verdict", kind="name", head="Outcome"),
    ]


def lenses(result: CalibratedNight) -> list[Quantity]:
    """Return the lenses that were tried, the best first, with why one was not adjusted."""
    found = result.lenses
    best = min((each.bic for each in found), default=0.0)
    over = np.array([each.bic - best for each in found])
    remarks = [f"not adjusted: {each.reason}" if each.reason else "" for each in found]
    done = np.array([not each.reason for each in found])
    return [
        of_each(found, "lens", kind="name", head="Lens"),
        of_each(found, "parameters", head="Parameters", seen=done),
        of_each(found, "images", head="Images", seen=done),
        of_each(found, "mean_error", head="Unit weight", decimals=4, seen=done),
        Quantity(over, head="BIC over the best", decimals=1, seen=done),
        Quantity(remarks, kind="name", head="Remark"),
    ]


def facts(result: CalibratedNight) -> tuple[list[Fact], list[Fact]]:
    """Return how much there is, and how good it is."""
    found, night = result.calibration, result.night
    estimated = int(np.isfinite(found.star_residuals[:, 0]).sum())
    measured = sum(len(exposure.xy) for exposure in result.exposures)
    x, y = np.sqrt(np.mean(found.residuals**2, axis=0)).tolist()
    lens = result.camera.lens + (" (fx = fy)" if result.camera.common_scale else "")
    pole = ", ".join(f"{value / ARCSEC:.4f}" for value in night.earth.pole)
    falsely = f"probability below {result.falsely_identified:.1E}"
    much = [
        Fact("Status", f"{found.status}, {found.iterations} iterations"),
        Fact("Exposures, of those given", f"{len(result.exposures)} of {len(night.exposures)}"),
        Fact("Images measured, identified, used", f"{measured}, {result.identified.sum()}, {len(found.xy)}"),
        Fact("Stars", f"{len(found.catalogue)}", note=f"{estimated} of them estimated"),
        Fact("Degrees of freedom", f"{found.degrees_of_freedom}"),
        Fact("Lens", lens),
        Fact("First attitudes", _first_attitudes(night)),
        Fact("Effects left out of places", ", ".join(night.site.effects.left_out) or "none"),
    ]
    good = [
        Fact("Mean error of unit weight", f"{found.mean_error:.4f}"),
        Fact("Global test", _global_test(result)),
        Fact("Mean error of an image coordinate", f"{found.mean_error * night.pixel_sd:.4f}", "px"),
        Fact("rms of residuals in x and y", f"{x:.4f}, {y:.4f}", "px"),
        Fact("Any exposure falsely identified", falsely),
        Fact("UT1 - UTC", f"{night.earth.dut1:.4f}", "s"),
        Fact("Pole x, y", pole, "arcsec"),
    ]
    return much, good


def _first_attitudes(night: Night) -> str:
    """Say what was known of the attitudes before."""
    if night.blind is not None:
        low, high = (math.degrees(field) for field in night.blind)
        return f"found in the whole sky, with a field of view between {low:g} and {high:g} degrees"
    if all(exposure.stars is not None for exposure in night.exposures):
        return "given, and the stars named"
    roll = "" if night.roll_known else ", but for the roll"
    return f"given within {math.degrees(night.attitude_error):g} degrees{roll}"


def _global_test(result: CalibratedNight) -> str:
    test = result.test
    if test is None:
        return "no degrees of freedom"
    low, high = test.limits
    verdict = "fails" if test.rejected_high or test.rejected_low else "holds"
    return f"{verdict}: variance {test.variance:.4f}, expected {low:.3f} to {high:.3f}"
