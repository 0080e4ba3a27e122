"""The report of a calibrated night as text: problems first, then how good it is, then the camera."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from photogram.show.angles import ARCSEC
from photogram.show.sections import Section, composed, headline, problems_or_none, verdict_sections
from photogram.stellar.lens_choice import DECISIVE, POSITIVE
from photogram.stellar.nights import SIGNIFICANT, CalibratedNight, Night
from photogram.stellar.odds import ACCEPTED, LOG_ODDS
from photogram.stellar.parameters import GRAD
from photogram.stellar.pointing import axis_of

__all__ = ["report", "summary"]

_LARGEST = 10


def report(result: CalibratedNight) -> str:
    """Return the report of a calibration."""
    sections = [
        *summary(result),
        ("Exposures", _exposures(result)),
        ("Identification", _identification(result)),
        ("Attitudes in ICRS", _inertial(result)),
        ("Tests of the lens", _lens_tests(result)),
        ("Lenses that were tried", _lenses(result)),
        ("Correlations of the camera", _correlations(result)),
        ("Largest standardized residuals", _largest(result)),
        ("Largest corrections of stars", _stars(result)),
        ("Images and their stars", _images(result, range(len(result.calibration.xy)))),
    ]
    return composed(headline("stellar camera, exposures", result.night.title), sections)


def summary(result: CalibratedNight) -> list[Section]:
    """Return what a reader wants first: verdict, problems, figures, the camera."""
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(result.messages, result.verdict)),
        ("Adjustment", _adjustment(result)),
        ("Camera", _camera(result)),
    ]


def _adjustment(result: CalibratedNight) -> list[str]:
    found, night = result.calibration, result.night
    estimated = int(np.isfinite(found.star_residuals[:, 0]).sum())
    rms = np.sqrt(np.mean(found.residuals**2, axis=0))
    measured = sum(len(exposure.xy) for exposure in result.exposures)
    rows = [
        ("status", f"{found.status}, {found.iterations} iterations"),
        ("exposures, of those given", f"{len(result.exposures)} of {len(night.exposures)}"),
        (
            "images measured, identified, used",
            f"{measured}, {result.identified.sum()}, {len(found.xy)}",
        ),
        ("stars, of them estimated", f"{len(found.catalogue)}, {estimated}"),
        ("degrees of freedom", f"{found.degrees_of_freedom}"),
        ("mean error of unit weight", f"{found.mean_error:.4f}"),
        ("global test", _global_test(result)),
        ("mean error of an image coordinate", f"{found.mean_error * night.pixel_sd:.4f} px"),
        ("root mean square residual x, y", f"{rms[0]:.4f}, {rms[1]:.4f} px"),
        ("UT1 - UTC", f"{night.earth.dut1:.4f} s"),
        ("lens", result.camera.lens + (" (fx = fy)" if result.camera.common_scale else "")),
        ("first attitudes", _first_attitudes(night)),
        ("effects left out of places", ", ".join(night.site.effects.left_out) or "none"),
        ("any exposure falsely identified", f"probability below {result.falsely_identified:.1E}"),
        ("pole x, y", ", ".join(f"{value / ARCSEC:.4f}" for value in night.earth.pole) + " arcsec"),
    ]
    return [f"{name:<36}{value}" for name, value in rows]


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


def _camera(result: CalibratedNight) -> list[str]:
    camera, prior = result.camera, result.night.prior
    errors, significance = np.sqrt(np.diag(camera.covariance)), result.significance()
    lines = [f"{'':<8}{'value':>18}{'mean error':>16}{'over it':>10}"]
    if prior is not None:
        lines[0] += f"{'prior':>18}{'mean error':>16}"
    for i, name in enumerate(result.camera.names):
        held = "as fx" if camera.common_scale and name == "fy" and errors[0] > 0 else "held"
        after = f"{errors[i]:16.4G}" if errors[i] > 0 else f"{held:>16}"
        ratio = f"{significance[name]:10.1f}" if name in significance else f"{'':10}"
        before = ""
        if prior is not None and prior.known[i]:
            sd = math.sqrt(prior.covariance[i, i])
            before = _shown(prior.values[i], sd) + f"{sd:16.4G}"
        lines.append(f"{name:<8}{_shown(camera.values[i], errors[i])}{after}{ratio}{before}".rstrip())
    return [*lines, f"fx, fy, cx, cy in pixels; terms are significant from {SIGNIFICANT} mean errors"]


def _shown(value: float, error: float) -> str:
    """Write a value to the second digit of its mean error."""
    return f"{value:18.{max(0, 1 - math.floor(math.log10(error)))}f}" if error > 0 else f"{value:18.9G}"


def _exposures(result: CalibratedNight) -> list[str]:
    found = result.calibration
    lines = [
        f"{'name':<10}{'utc':<26}{'images':>7}{'found':>7}{'left out':>9}{'azimuth':>11}{'elevation':>11}"
        f"{'alpha':>13}{'omega':>13}{'kappa':>13}{'mean errors arcsec':>26}{'rms px':>8}"
    ]
    for i, (name, exposure) in enumerate(zip(result.names, result.exposures, strict=True)):
        attitude = found.attitudes[i]
        azimuth, elevation = (math.degrees(angle) for angle in axis_of(attitude))
        errors = np.sqrt(np.diag(found.attitude_covariances[i])) / ARCSEC
        rms = math.sqrt(float(np.mean(found.residuals[found.exposures == i] ** 2)))
        lines.append(
            f"{name:<10}{exposure.utc:<26}{len(exposure.xy):7d}{result.identified[i]:7d}{result.rejected[i]:9d}"
            f"{azimuth:11.5f}{elevation:11.5f}"
            + "".join(f"{angle / GRAD:13.6f}" for angle in attitude)
            + f"{errors[0]:10.2f}{errors[1]:8.2f}{errors[2]:8.2f}{rms:8.3f}"
        )
    return [
        *lines,
        "azimuth from south, positive west, and elevation in degrees; alpha, omega, kappa in grads",
    ]


def _identification(result: CalibratedNight) -> list[str]:
    """List the odds of exposures, and of the stars that are least certain."""
    lines = [
        f"{'exposure':<10}{'by chance':>12}{'probability':>16}{'log odds':>11}{'least certain star':>20}"
    ]
    of = result.calibration.exposures
    for i, name in enumerate(result.names):
        own = result.star_probabilities[of == i]
        named = math.isnan(result.odds[i])
        least = "" if named else _probability(float(np.nanmin(own)))
        odds = "" if named else f"{result.log_odds[i]:.1f}"
        probability = "" if named else _probability(float(result.probabilities[i]))
        lines.append(f"{name:<10}{_odds(result.odds[i]):>12}{probability:>16}{odds:>11}{least:>20}")
    lines += [
        f"{name:<10}{_odds(expected):>12}{'doubtful':>16}" for name, expected in result.doubtful.items()
    ]
    return [
        *lines,
        "by chance: expected number of wrong attitudes under which as many images have a star; accepted below"
        f" {ACCEPTED:.0E}",
        f"log odds: natural logarithm, by the distances of images and stars; accepted above {LOG_ODDS:.1f}",
    ]


def _probability(value: float) -> str:
    """Write a probability near 1 by what it misses."""
    return f"1 - {1 - value:.0E}" if 1e-15 < 1 - value < 0.01 else f"{value:.6f}"


def _inertial(result: CalibratedNight) -> list[str]:
    lines = [
        f"{'exposure':<10}{'ra deg':>12}{'dec deg':>12}{'w':>14}{'x':>14}{'y':>14}{'z':>14}"
        f"{'mean errors arcsec, about x, y, z':>36}"
    ]
    for name, attitude in zip(result.names, result.inertial, strict=True):
        ra, dec = (math.degrees(angle) for angle in attitude.axis)
        errors = np.sqrt(np.diag(attitude.covariance)) / ARCSEC
        lines.append(
            f"{name:<10}{ra:12.6f}{dec:12.6f}"
            + "".join(f"{value:14.9f}" for value in attitude.quaternion)
            + f"{errors[0]:16.2f}{errors[1]:10.2f}{errors[2]:10.2f}"
        )
    return [
        *lines,
        "quaternion w, x, y, z from ICRS to the camera: x right, y down, z along the axis",
    ]


def _lens_tests(result: CalibratedNight) -> list[str]:
    tests = [*([result.scale_test] if result.scale_test else []), *result.term_tests]
    if not tests:
        return []
    lines = [
        f"{'zero?':<10}{'F':>12}{'degrees':>12}{'probability':>14}{'level':>10}{'effect px':>11}  verdict"
    ]
    for test in tests:
        degrees = f"{test.dimension}, {test.freedom}"
        lines.append(
            f"{test.name:<10}{test.statistic:12.2f}{degrees:>12}{test.probability:14.2G}{test.level:10.2G}"
            f"{test.effect:11.3f}  {test.verdict}"
        )
    return [*lines, "terms in the order in which they may be left out, each without those above it"]


def _lenses(result: CalibratedNight) -> list[str]:
    if not result.lenses:
        return []
    best = min(fit.bic for fit in result.lenses)
    lines = [f"{'lens':<16}{'parameters':>11}{'images':>8}{'unit weight':>13}{'BIC - best':>12}"]
    for fit in result.lenses:
        if fit.reason:
            lines.append(f"{fit.lens:<16}not adjusted: {fit.reason}")
        else:
            lines.append(
                f"{fit.lens:<16}{fit.parameters:11d}{fit.images:8d}{fit.mean_error:13.4f}"
                f"{fit.bic - best:12.1f}"
            )
    return [
        *lines,
        f"the first is taken; a difference above {DECISIVE:g} is decisive, above {POSITIVE:g} positive",
    ]


def _odds(expected: float) -> str:
    return "named" if math.isnan(expected) else "<1E-99" if expected < 1e-99 else f"{expected:.0E}"


def _correlations(result: CalibratedNight) -> list[str]:
    sd = np.sqrt(np.diag(result.camera.covariance))
    free = np.flatnonzero(sd > 0)
    names = result.camera.names
    lines = [f"{'':<6}" + "".join(f"{names[j]:>8}" for j in free)]
    for i in free:
        values = [result.camera.covariance[i, j] / (sd[i] * sd[j]) for j in free[free <= i]]
        lines.append(f"{names[i]:<6}" + "".join(f"{value:8.3f}" for value in values))
    return lines


def _largest(result: CalibratedNight) -> list[str]:
    size = np.nanmax(np.abs(np.nan_to_num(result.calibration.standardized)), axis=1)
    return _images(result, np.argsort(-size, kind="stable")[:_LARGEST])


def _images(result: CalibratedNight, chosen: Iterable[int]) -> list[str]:
    found, ids = result.calibration, result.night.catalogue.ids
    lines = [
        f"{'exposure':<10}{'star':>10}{'x px':>11}{'y px':>11}{'vx px':>9}{'vy px':>9}{'w x':>8}{'w y':>8}"
        f"{'probability':>14}"
    ]
    for k in chosen:
        (x, y), (vx, vy), (wx, wy) = found.xy[k], found.residuals[k], found.standardized[k]
        lines.append(
            f"{result.names[found.exposures[k]]:<10}{ids[found.stars[k]]:>10}{x:11.3f}{y:11.3f}"
            f"{vx:9.3f}{vy:9.3f}{wx:8.2f}{wy:8.2f}{_star(result.star_probabilities[k]):>14}"
        )
    return lines


def _star(probability: float) -> str:
    return "named" if math.isnan(probability) else _probability(probability)


def _stars(result: CalibratedNight) -> list[str]:
    found, ids = result.calibration, result.night.catalogue.ids
    size = np.nan_to_num(np.abs(found.star_standardized)).max(axis=1)
    chosen = [
        k for k in np.argsort(-size, kind="stable")[:_LARGEST] if np.isfinite(found.star_residuals[k, 0])
    ]
    lines = [f"{'star':>10}{'ra arcsec':>12}{'dec arcsec':>12}{'w ra':>8}{'w dec':>8}"]
    for k in chosen:
        (ra, dec), (w_ra, w_dec) = found.star_residuals[k] / ARCSEC, found.star_standardized[k]
        lines.append(f"{ids[found.catalogue[k]]:>10}{ra:12.5f}{dec:12.5f}{w_ra:8.2f}{w_dec:8.2f}")
    return lines if chosen else []
