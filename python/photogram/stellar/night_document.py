"""Document of a camera calibrated by sky exposures, and its tables: exposures, images, stars, lenses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import replace
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import Document, Fact, Facts, Layers, Section, about, conventions
from photogram.show.quantity import Axis, Quantities, Quantity, Table, chosen, members, of_each
from photogram.stellar.camera_tables import (
    ARC_SECONDS,
    ARCSEC_OF_RAD,
    GRADS,
    PIXELS,
    column,
    correlated_members,
    correlations,
    matrix_table,
    names_column,
    night_tests,
    parameter_table,
    worst_table,
)
from photogram.stellar.comparison import DECISIVE, POSITIVE, LensTest
from photogram.stellar.identification import ACCEPTED, LOG_ODDS
from photogram.stellar.pictures import night_drawings
from photogram.stellar.places import VISION, axis_of

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight

MAX_EXPOSURES = 200


def night_document(result: CalibratedNight) -> Document:
    much, good = facts(result)
    camera = result.camera
    free = np.flatnonzero(camera.known)
    matrix = correlations(camera.covariance)[np.ix_(free, free)]
    names = [camera.names[row] for row in free]
    correlation = matrix_table("correlations", "Correlations", names, matrix, decimals=3)
    lens = "Which lens the data prefer, and which of its terms are significant."
    layers = Layers("exposure-layers", exposures(result, MAX_EXPOSURES))
    sections = [
        Section("pictures", "Stars and residuals", [night_drawings(result)]),
        Section("size", "Size and fit", [Facts("Size", much), Facts("Fit", good)]),
        Section("camera", "Camera", [parameters(result), correlation]),
        Section("exposures", "Exposures", [layers]),
        Section("lens", "Lens", [lens_tests(result), lenses(result)], lens),
        Section.of(worst_table(result.verdict, night_tests(result)[0], result.calibration.residuals, PIXELS)),
        Section.of(verdict_table(result.verdict)),
        remarks_section(result.messages),
    ]
    details = [
        exposure_table(result),
        *attitudes(result),
        stars(result),
        images(result),
    ]
    return verdict_document(
        result.verdict,
        "Calibration of a camera by exposures of the sky",
        result.night.title,
        highlights=_highlights(result),
        sections=sections,
        members=_members(result),
        details=[*map(Section.of, details)],
    )


def _members(result: CalibratedNight) -> dict[str, Any]:
    found, night, camera, test = result.calibration, result.night, result.camera, result.test
    names = {"chi_square": "statistic", "degrees_of_freedom": "dimension", "own_probability": "own"}
    standstill = result.standstill and {
        **members(result.standstill, "probability", **names),
        "turn_arcsec": result.standstill.turns / ARCSEC,
        "moved": [result.names[k] for k in result.standstill.moved],
    }
    return {
        "title": night.title,
        "conventions": conventions("night"),
        "m": found.mean_error,
        "m_unit": "standard deviation of an image coordinate",
        "sd_px": night.pixel_sd,
        **members(found, "degrees_of_freedom", "iterations", stop="status"),
        **members(result, "converged", "usable", "doubtful", "falsely_identified"),
        "global_test": test and members(test, "limits", "probability", variance_of_unit_weight="variance"),
        "lens": {
            "name": camera.lens,
            **members(camera, "common_scale", model="facts.model", formula="facts.formula"),
            "tried": [{**vars(fit), "reason": str(fit.reason)} for fit in result.lenses],
            "scale_test": result.scale_test and _test(result.scale_test),
            "term_tests": [*map(_test, result.term_tests)],
        },
        "effects": night.site.effects,
        "standstill": standstill,
        "messages": [*map(str, result.messages)],
        "covariance": {"order": camera.names, "matrix": camera.covariance},
        "correlated": correlated_members(result.correlated()),
        "significance": result.significance(),
    }


def _test(test: LensTest) -> dict[str, Any]:
    return {**vars(test), "verdict": test.verdict}


def _highlights(result: CalibratedNight) -> list[Fact]:
    found, test = result.calibration, result.test
    rms = np.sqrt(np.mean(found.residuals**2, axis=0))
    expected = test and f"{test.limits[0]:.3f} to {test.limits[1]:.3f} expected of its square"
    of = f"of {len(result.night.exposures)}; {len(found.xy)} images of {len(found.catalogue)} stars"
    return [
        Fact.of("Mean error of unit weight", found.mean_error, note=expected or "", decimals=3),
        Fact.of("rms of image residuals in x and y", rms, "px", figures=3),
        Fact.of("Exposures", len(result.exposures), note=of),
        Fact.of(
            "Any exposure falsely identified",
            result.falsely_identified,
            note="probability, at most",
            figures=1,
        ),
    ]


_PIXELS = (Axis.of("x", "px", "_px"), Axis.of("y", "px", "_px"))
_DEGREES = ("deg", "deg", 1.0)


def parameters(result: CalibratedNight) -> Table:
    camera, prior = result.camera, result.night.prior
    before = None
    if prior is not None:
        deviations = np.sqrt(np.diag(prior.covariance))
        before = np.where(prior.known, [prior.values, deviations], np.nan)
    axes = tuple(Axis(name, "pixel", small="px") if name[0] in "fc" else Axis(name) for name in camera.names)
    note = "fy is fx: there is one principal distance." if camera.common_scale else ""
    errors = np.sqrt(np.diag(camera.covariance))
    return parameter_table(axes, camera.values, errors, before, result.significance(), note=note)


def exposures(result: CalibratedNight, most: int) -> list[Table]:
    """Return tables of exposure fit, star identification and attitudes."""
    count = len(result.names)
    some = f"The first {most} of {count}; exposures.csv has all. " if count > most else ""
    odds = about("night.odds", accepted=ACCEPTED, log_odds=LOG_ODDS)
    name, azimuth, elevation, _, errors, *_ = _attitudes(result)
    _, ra, dec, *_ = _inertial(result)
    columns, shown = [name, azimuth, elevation, ra, dec, errors], np.arange(min(count, most))
    return [
        Table("fit", "Identification and fit", _fit(result), some + odds, shown=shown),
        Table("attitudes", "Attitudes", columns, some, shown=shown),
    ]


def attitudes(result: CalibratedNight) -> list[Table]:
    """Return the attitudes at the station and in ICRS with mean errors."""
    name, _, _, angles, errors, *_ = _attitudes(result)
    about = "Quaternion w, x, y, z from ICRS to the camera: x right, y down, z along the axis."
    return [
        _for_people("angles", "Attitudes at the station", [name, angles, errors]),
        _for_people("inertial", "Attitudes in ICRS", _inertial(result), about),
    ]


def exposure_table(result: CalibratedNight) -> Table:
    """Return the used exposures with all columns of `exposures`, for files.

    Angles are in degrees, azimuths from south, positive west. The quaternion (w, x, y, z) rotates ICRS to the
    camera (x right, y down, z along the axis). The covariance (radians squared) refers to small rotations
    about these axes, its upper triangle by row. `by_chance` is the expected number of chance matches,
    `log_odds` a natural logarithm.
    """
    columns = [*_fit(result), *_attitudes(result)[1:], *_inertial(result)[1:]]
    return Table("exposures", "Exposures", [replace(column, head="") for column in columns])


def _fit(result: CalibratedNight) -> list[Quantity]:
    found, count = result.calibration, len(result.names)
    rows_of = [found.exposures == i for i in range(count)]
    rms = np.array([np.sqrt(np.mean(found.residuals[rows] ** 2)) for rows in rows_of])
    likely = [result.star_probabilities[rows] for rows in rows_of]
    least = np.array([np.nanmin(values) if np.isfinite(values).any() else np.nan for values in likely])
    return [
        _exposure(result),
        of_each(result.exposures, "utc", kind="name", name="utc", head="UTC"),
        Quantity(
            [len(exposure.xy) for exposure in result.exposures], name="images", member="images", head="Images"
        ),
        Quantity(result.identified, name="identified", member="identified", head="Identified"),
        Quantity(result.rejected, name="left_out", member="rejected", head="Left out"),
        Quantity(rms, _PIXELS[:1], "deviation", head="rms", decimals=3),
        column(result.odds, None, "By chance", None, "expected_chance_matches", name="by_chance", figures=1),
        column(result.probabilities, None, "Probability", 6, "probability"),
        column(result.log_odds, None, "Log odds", 1, "log_odds"),
        column(1.0 - least, None, "Least certain star: 1 - probability", None, figures=1),
    ]


def _attitudes(result: CalibratedNight) -> list[Quantity]:
    found = result.calibration
    azimuth, elevation = np.degrees([axis_of(each) for each in found.attitudes]).T
    errors = np.sqrt(np.diagonal(found.attitude_covariances, axis1=1, axis2=2))
    south, angles = "Azimuth from south, positive west", "alpha, omega, kappa"
    return [
        _exposure(result),
        column(azimuth, _DEGREES, south, 5, "azimuth_deg", name="azimuth_south_deg"),
        column(elevation, _DEGREES, "Elevation", 5, "elevation_deg"),
        column(found.attitudes, GRADS, "{}", 6, "alpha_omega_kappa_rad", angles, name=None),
        column(errors, ARCSEC_OF_RAD, "sd {}", 2, parts=angles),
        Quantity(found.attitude_covariances, member="covariance"),
        Quantity(found.cross_covariances, member="covariance_with_camera"),
    ]


def _inertial(result: CalibratedNight) -> list[Quantity]:
    found = result.inertial
    assert found.step_covariances is not None
    x, y, z = found.values("matrix_to_vision")[:, 2].T
    ra, dec = np.degrees([np.arctan2(y, x) % (2 * np.pi), np.arctan2(z, np.hypot(x, y))])
    covariances = VISION * found.step_covariances
    upper = tuple(Axis(f"{a}{b}") for k, a in enumerate("xyz") for b in "xyz"[k:])
    quaternions = found.values("quaternion_to_vision")
    members = {
        "quaternion": quaternions,
        "quaternion_covariance": found.covariances("quaternion_to_vision"),
        "covariance": covariances,
        "right_ascension_deg": ra.tolist(),
        "declination_deg": dec.tolist(),
    }
    rows = [dict(zip(members, row, strict=True)) for row in zip(*members.values(), strict=True)]
    errors = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    return [
        _exposure(result),
        column(ra, _DEGREES, "Right ascension in ICRS", 6, name="ra_deg"),
        column(dec, _DEGREES, "Declination in ICRS", 6, name="dec_deg"),
        column(quaternions, None, "{}", 9, parts="qw, qx, qy, qz", name=""),
        column(errors, ARCSEC_OF_RAD, "sd {}", 2, parts="about x, about y, about z"),
        Quantity(covariances[:, *np.triu_indices(3)], upper, name="cov"),
        Quantity(rows, member="icrs"),
    ]


def _exposure(result: CalibratedNight) -> Quantity:
    names = np.array(result.names, dtype=object)
    return Quantity(names, kind="name", name="exposure", member="name", head="Exposure")


def images(result: CalibratedNight) -> Table:
    found, ids = result.calibration, np.array(result.night.catalogue.ids, dtype=object)
    names, likely = np.array(result.names, dtype=object)[found.exposures], result.star_probabilities
    columns = [
        Quantity(names, kind="name", name="exposure", member="exposure", head="Exposure"),
        Quantity(ids[found.stars], kind="name", name="star", member="star", head="Star"),
        Quantity(found.xy, _PIXELS, "value", name="", member="xy_px", head="{}", decimals=3),
        Quantity(
            found.residuals, _PIXELS, "deviation", "residual", "residual_px", head="Residual {}", decimals=3
        ),
        Quantity(found.redundancy, _PIXELS, name="redundancy", member="redundancy"),
        Quantity(
            found.standardized, _PIXELS, "number", "standardized", "standardized", head="w {}", decimals=2
        ),
        column(likely, None, "", None, "probability"),
        column(1.0 - likely, None, "1 - probability", None, figures=1),
    ]
    about = "Pixels right and down, measured minus computed; probability of the star of each image."
    return Table("images", "Images and their stars", columns, about=about)


def _for_people(key: str, title: str, columns: Quantities, note: str = "") -> Table:
    """Return a table that JSON documents and files omit."""
    return Table(key, title, [replace(column, member="", name=None) for column in columns], note)


def stars(result: CalibratedNight) -> Table:
    found, ids = result.calibration, np.array(result.night.catalogue.ids, dtype=object)
    columns = [
        Quantity(ids[found.catalogue], kind="name", member="id", head="Star"),
        column(found.star_residuals / ARCSEC, ARC_SECONDS, "Correction {}", 5, "residual", "ra, dec"),
        column(found.star_redundancy, None, "", None, "redundancy", "ra, dec"),
        column(found.star_standardized, None, "w {}", 2, "standardized", "ra, dec"),
    ]
    estimated = np.flatnonzero(np.isfinite(found.star_residuals[:, 0]))
    return Table("stars", "Corrections of stars", chosen(columns, estimated))


def lens_tests(result: CalibratedNight) -> Table:
    found = [*([result.scale_test] if result.scale_test else []), *result.term_tests]
    degrees = [f"{each.dimension}, {each.freedom}" for each in found]
    columns = [
        of_each(found, "name", kind="name", head="Zero?"),
        of_each(found, "statistic", head="F", decimals=2),
        Quantity(degrees, kind="name", head="Degrees of freedom"),
        of_each(found, "probability", head="p", figures=2),
        of_each(found, "level", head="Level", figures=2),
        of_each(found, "effect", (Axis.of("", "px"),), "deviation", head="Effect", decimals=3),
        of_each(found, "verdict", kind="name", head="Outcome"),
    ]
    order = "In the order in which they may be left out, each without those above it."
    return _for_people("lens-tests", "Tests of the lens", columns, order)


def lenses(result: CalibratedNight) -> Table:
    found = result.lenses
    best = min((each.bic for each in found), default=0.0)
    numbers = [(each.parameters, each.images, each.mean_error, each.bic - best) for each in found]
    done = np.array([not each.reason for each in found])
    counts = np.where(done, np.reshape(numbers, (-1, 4)).T, np.nan)
    heads = zip(
        counts, ("Parameters", "Images", "Unit weight", "BIC over the best"), (0, 0, 4, 1), strict=True
    )
    columns = [
        of_each(found, "lens", kind="name", head="Lens"),
        *(column(values, None, head, decimals) for values, head, decimals in heads),
        names_column((each.reason and f"not adjusted: {each.reason}" for each in found), "Remark"),
    ]
    note = f"The first is used; a difference above {DECISIVE:g} is decisive, above {POSITIVE:g} positive."
    return _for_people("lenses", "Lenses that were tried", columns, note)


def facts(result: CalibratedNight) -> tuple[list[Fact], list[Fact]]:
    found, night = result.calibration, result.night
    estimated = int(np.isfinite(found.star_residuals[:, 0]).sum())
    measured = sum(len(exposure.xy) for exposure in result.exposures)
    tested = about("global-test.none")
    if (test := result.test) is not None:
        verdict, (low, high) = "fails" if test.rejected_high or test.rejected_low else "holds", test.limits
        tested = about(f"global-test.{verdict}", variance=test.variance, low=low, high=high)
    roll = "" if night.roll_known else ", but for the roll"
    attitudes = f"given within {math.degrees(night.attitude_error):g} degrees{roll}"
    if night.blind is not None:
        narrow, wide = (math.degrees(field) for field in night.blind)
        attitudes = f"found in the whole sky, with a field of view between {narrow:g} and {wide:g} degrees"
    elif all(exposure.stars is not None for exposure in night.exposures):
        attitudes = "given, and the stars named"
    lens = result.camera.lens + (" (fx = fy)" if result.camera.common_scale else "")
    much = [
        Fact("Status", f"{found.status}, {found.iterations} iterations"),
        Fact("Images measured, identified, used", f"{measured}, {result.identified.sum()}, {len(found.xy)}"),
        Fact.of("Stars", len(found.catalogue), note=f"{estimated} of them estimated"),
        Fact.of("Degrees of freedom", found.degrees_of_freedom),
        Fact("Lens", lens),
        Fact("First attitudes", attitudes),
        Fact("Effects left out of places", ", ".join(night.site.effects.left_out) or "none"),
    ]
    good = [
        Fact("Global test", tested),
        Fact.of("Mean error of an image coordinate", found.mean_error * night.pixel_sd, "px", decimals=4),
        Fact.of("UT1 - UTC", night.earth.dut1, "s", decimals=4),
        Fact.of("Pole x, y", np.divide(night.earth.pole, ARCSEC), "arcsec", decimals=4),
    ]
    return much, good
