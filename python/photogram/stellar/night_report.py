"""The report of a calibrated night as text: problems first, then how good it is, then the camera."""

from __future__ import annotations

import math

import numpy as np

from photogram.show.angles import ARCSEC
from photogram.show.sections import Section, composed, headline, verdict_section
from photogram.stellar.cameras import BrownCamera
from photogram.stellar.night import SIGNIFICANT, CalibratedNight
from photogram.stellar.parameters import GRAD
from photogram.stellar.pointing import axis_of

__all__ = ["report", "summary"]

_LARGEST = 10


def report(result: CalibratedNight) -> str:
    """Return the report of a calibration."""
    sections = [
        *summary(result),
        ("Exposures", _exposures(result)),
        ("Correlations of the camera", _correlations(result)),
        ("Largest standardized residuals", _largest(result)),
        ("Largest corrections of stars", _stars(result)),
    ]
    return composed(headline("stellar camera, exposures", result.night.title), sections)


def summary(result: CalibratedNight) -> list[Section]:
    """Return what a reader wants first: verdict, problems, figures, the camera."""
    return [
        verdict_section(result.verdict),
        ("Problems", [str(message) for message in result.messages] or ["none"]),
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
        ("pole x, y", ", ".join(f"{value / ARCSEC:.4f}" for value in night.earth.pole) + " arcsec"),
    ]
    return [f"{name:<36}{value}" for name, value in rows]


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
    for i, name in enumerate(BrownCamera.NAMES):
        after = f"{errors[i]:16.4G}" if errors[i] > 0 else f"{'held':>16}"
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
        f"{'alpha':>13}{'omega':>13}{'kappa':>13}{'mean errors arcsec':>26}{'rms px':>8}{'by chance':>11}"
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
            + f"{errors[0]:10.2f}{errors[1]:8.2f}{errors[2]:8.2f}{rms:8.3f}{_odds(result.odds[i]):>11}"
        )
    return [
        *lines,
        "azimuth from south, positive west, and elevation in degrees; alpha, omega, kappa in grads",
        "by chance: expected number of wrong attitudes under which as many images have a star",
    ]


def _odds(expected: float) -> str:
    return "named" if math.isnan(expected) else "<1E-99" if expected < 1e-99 else f"{expected:.0E}"


def _correlations(result: CalibratedNight) -> list[str]:
    sd = np.sqrt(np.diag(result.camera.covariance))
    free = np.flatnonzero(sd > 0)
    names = BrownCamera.NAMES
    lines = [f"{'':<6}" + "".join(f"{names[j]:>8}" for j in free)]
    for i in free:
        values = [result.camera.covariance[i, j] / (sd[i] * sd[j]) for j in free[free <= i]]
        lines.append(f"{names[i]:<6}" + "".join(f"{value:8.3f}" for value in values))
    return lines


def _largest(result: CalibratedNight) -> list[str]:
    found, ids = result.calibration, result.night.catalogue.ids
    size = np.nanmax(np.abs(np.nan_to_num(found.standardized)), axis=1)
    lines = [
        f"{'exposure':<10}{'star':>10}{'x px':>11}{'y px':>11}{'vx px':>9}{'vy px':>9}{'w x':>8}{'w y':>8}"
    ]
    for k in np.argsort(-size, kind="stable")[:_LARGEST]:
        (x, y), (vx, vy), (wx, wy) = found.xy[k], found.residuals[k], found.standardized[k]
        lines.append(
            f"{result.names[found.exposures[k]]:<10}{ids[found.stars[k]]:>10}{x:11.3f}{y:11.3f}"
            f"{vx:9.3f}{vy:9.3f}{wx:8.2f}{wy:8.2f}"
        )
    return lines


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
