"""What is known of a certificate, quantity by quantity."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.film.certificate import CalibratedMarks, Certificate
from photogram.film.distances import AdjustedMarks
from photogram.film.lens_table import Curve
from photogram.network.cameras import Camera
from photogram.show.page import Fact, significant
from photogram.show.quantity import Axis, Kind, Quantity, of_each

MM = (Axis("", "mm", small="um", factor=1e3),)
XY = tuple(Axis(name, "mm", small="um", factor=1e3) for name in "xy")
OBSERVED = (Axis("length", "mm", small="um", factor=1e3), Axis.turned("angle", "deg"))
RADII = 8
"""Along the curve of a table."""


def marks(found: CalibratedMarks) -> list[Quantity]:
    """Return the marks with their places and standard deviations."""
    sd = np.sqrt(np.diag(found.covariance)).reshape(-1, 2)
    return [
        Quantity([*found.names], kind="name", member="mark", head="Mark"),
        Quantity(found.xy, XY, "value", member="xy_mm", head="{}", decimals=4),
        Quantity(sd, XY, "deviation", member="sd_mm", head="sd {}", decimals=1),
    ]


def compared(certificate: Certificate) -> list[Quantity]:
    """Return distances beside those from coordinates, and what single changes explain the difference."""
    found = certificate.check()
    beyond = np.array([each.beyond for each in found], dtype=bool)
    said = ["; ".join(map(str, each.explanations)) or ("nothing" if each.beyond else "") for each in found]
    explanations = [[vars(one) for one in each.explanations] for each in found]
    given, computed, apart = (
        np.array([getattr(each, name) for each in found])
        for name in ("distance", "from_coordinates", "difference")
    )
    return [
        of_each(found, "name", kind="name", member="distance", head="Distance"),
        _mm(given, "value", "distance", "Given", 3),
        _mm(computed, "value", "from_coordinates", "From coordinates", 4),
        _mm(apart, "deviation", "difference", "Difference", 1, marked=beyond),
        of_each(found, "beyond", member="beyond"),
        Quantity(said, kind="name", head="Single changes that explain it"),
        Quantity(explanations, member="explanations"),
    ]


def _mm(
    values: Floats, kind: Kind, member: str, head: str, decimals: int, marked: Bools | None = None
) -> Quantity:
    """Return lengths, which people read in mm, or as small ones in um."""
    return Quantity(values, MM, kind, member=f"{member}_mm", head=head, decimals=decimals, marked=marked)


def observed(found: AdjustedMarks, limit: float) -> list[Quantity]:
    """Return what was adjusted: residuals, redundancy, w, and by how much each would be wrong alone."""
    of = np.array([int(name.startswith("angle ")) for name in found.rows])
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(np.isnan(found.standardized), math.nan, found.residuals / found.redundancy)
    marked = np.abs(found.standardized) > limit
    return [
        Quantity([*found.rows], kind="name", member="observed", head="Observed"),
        Quantity(found.observed, OBSERVED, "value", member="value", head="Value", decimals=3, of=of),
        Quantity(found.sd, OBSERVED, "deviation", member="sd", head="sd", figures=2, of=of),
        Quantity(found.residuals, OBSERVED, "deviation", member="residual", head="Residual", of=of),
        Quantity(found.redundancy, member="redundancy", head="Redundancy", decimals=3),
        Quantity(found.standardized, member="w", head="w", decimals=2, marked=marked),
        Quantity(error, OBSERVED, "deviation", member="estimated_error", head="Error if it alone is", of=of),
    ]


def distortion(certificate: Certificate, found: Curve) -> list[Quantity]:
    """Return the table of distortion with the residuals of the chosen curve."""
    assert certificate.radial is not None
    table, angle = certificate.radial, (Axis.turned("", "deg"),)
    return [
        Quantity(table.angle, angle, "value", member="angle_rad", head="Angle", decimals=2),
        _mm(found.radius, "value", "radius", "Radius", 3),
        _mm(table.distortion, "deviation", "distortion", "Distortion", 1),
        _mm(found.residuals, "deviation", "residual", "Residual", 2),
        Quantity(found.redundancy, member="redundancy", head="Redundancy", decimals=3),
        Quantity(found.standardized, member="w", head="w", decimals=2),
    ]


def curve(found: Curve) -> list[Quantity]:
    """Return the curve at radii within the table, and at one beyond it."""
    radius = np.linspace(0.0, float(found.radius.max()), RADII + 1)[1:]
    radius = np.append(radius, radius[-1] + radius[0])
    return [
        _mm(radius, "value", "radius", "Radius", 1),
        _mm(found.at(radius), "deviation", "distortion", "Distortion", 2),
        _mm(found.sd_at(radius), "deviation", "sd", "sd", 2),
    ]


def terms(curves: tuple[Curve, ...], taken: int) -> list[Quantity]:
    """Return how well one odd term, two, three fit; `taken` is the number that was chosen."""
    omega = [each.omega for each in curves]
    p = [each.test.probability_above if each.test else None for each in curves]
    freedom = [len(each.radius) - each.terms - 1 for each in curves]
    said = ["chosen" if each.terms == taken else "" for each in curves]
    gain = np.array([math.nan, *-np.diff(omega)])
    return [
        of_each(curves, "terms", head="Odd terms"),
        Quantity(omega, member="omega", head="Omega", decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="f"),
        Quantity(p, member="probability", head="p", figures=2),
        Quantity(gain, member="gain", head="Gain", decimals=2),
        Quantity(said, kind="name", head="Taken"),
        Quantity([each.coefficients for each in curves], member="coefficients"),
        Quantity([each.covariance for each in curves], member="covariance"),
    ]


def parameters(camera: Camera) -> list[Quantity]:
    """Return the parameters of a camera with their standard deviations, each in a row."""
    assert camera.covariance is not None
    names, matrix = camera.covariance
    sd = np.sqrt(np.diag(np.asarray(matrix)))
    return [
        Quantity([*names], kind="name", head="Parameter"),
        Quantity(np.array([camera.parameters[name] for name in names]), head="Value", figures=8),
        Quantity(sd, head="sd", figures=3),
        Quantity([camera.unit_of(name) or "1" for name in names], kind="name", head="Unit"),
    ]


def cameras(certificate: Certificate) -> list[Camera]:
    """Return the camera forward and, where decentring allows, backward; none without a focal length."""
    if certificate.c is None:
        return []
    if certificate.radial is None or certificate.tangential is not None:
        return [certificate.camera()]
    return [certificate.camera("brown_forward"), certificate.camera("brown")]


def facts(certificate: Certificate) -> list[Fact]:
    """Return what it is of, and how it was taken."""
    (xp, yp), sd, what = certificate.principal_point
    found = [
        Fact("Camera", certificate.name, note=certificate.camera_type),
        Fact("Date", certificate.day.isoformat() if certificate.day else "not given"),
    ]
    if certificate.c is not None:
        found += [
            Fact("Calibrated focal length", f"{certificate.c:.3f}", "mm"),
            Fact("Principal point", f"{xp:.4f}, {yp:.4f}", "mm", f"{what}, sd {sd:g} mm"),
        ]
    if certificate.radial is not None:
        apart = certificate.lens("brown").apart
        found.append(Fact("Conversion to brown", significant(1e3 * apart, 2), "um", "differs by at most"))
    return found
