"""Tables of a certificate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.film.certificate_check import DistanceDifference, Explanation
from photogram.film.distances import AdjustedMarks
from photogram.film.lens_table import Curve, RadialTable
from photogram.network.cameras import Camera
from photogram.show.quantity import Axis, Kind, Quantity, Table, of_each

if TYPE_CHECKING:
    from photogram.film import CalibratedMarks

MM = (Axis("", "mm", small="um", factor=1e3),)
XY = tuple(Axis(name, "mm", small="um", factor=1e3) for name in "xy")
OBSERVED = (Axis("length", "mm", small="um", factor=1e3), Axis.turned("angle", "deg"))
RADII = 8  # points of the printed distortion curve


def marks(found: CalibratedMarks) -> Table:
    """Return the marks with their coordinates and standard deviations."""
    sd = np.sqrt(np.diag(found.covariance)).reshape(-1, 2)
    columns = [
        Quantity([*found.names], kind="name", member="mark", head="Mark"),
        Quantity(found.xy, XY, "value", member="xy_mm", head="{}", decimals=4),
        Quantity(sd, XY, "deviation", member="sd_mm", head="sd {}", decimals=1),
    ]
    return Table("marks.places", "Places of the marks", columns)


def compared(differences: Sequence[DistanceDifference]) -> Table:
    """Return given and computed distances, and corrections that explain differences."""
    given, computed, apart = (
        np.array([getattr(each, name) for each in differences])
        for name in ("distance", "from_coordinates", "difference")
    )
    beyond = np.array([each.beyond for each in differences], bool)
    columns = [
        of_each(differences, "name", kind="name", member="distance", head="Distance"),
        _mm(given, "value", "distance", "Given", 3),
        _mm(computed, "value", "from_coordinates", "From coordinates", 4),
        _mm(apart, "deviation", "difference", "Difference", 1, beyond),
        of_each(differences, "beyond"),
        Quantity([[vars(one) for one in each.explanations] for each in differences], member="explanations"),
    ]
    about = (
        "Beyond 0.010 mm a distance and its coordinates contradict each other. Single changes of a typed"
        " figure that would explain it are guesses: no figure was changed."
    )
    return Table("distances", "Distances beside coordinates", columns, "", about)


def explanations(differences: Sequence[DistanceDifference]) -> Table:
    """Return the single corrections that explain differences, and the remaining ones."""
    pairs: list[tuple[str, Explanation | None]] = [
        (each.name, one)
        for each in differences
        for one in each.explanations or ((None,) if each.beyond else ())
    ]
    remaining = np.array([one and one.remaining for _, one in pairs], dtype=float)
    moved = np.array([one and one.from_usual for _, one in pairs], dtype=float)
    columns = [
        Quantity([name for name, _ in pairs], kind="name", head="Distance"),
        Quantity([str(one or "none") for _, one in pairs], kind="name", head="Single change of a figure"),
        Quantity(remaining, MM, "deviation", head="Leaves", decimals=1),
        Quantity(moved, MM, "value", head="From its usual place", decimals=3),
    ]
    return Table("explanations", "Explained by a single change", columns)


def _mm(
    values: Floats, kind: Kind, member: str, head: str, decimals: int, marked: Bools | None = None
) -> Quantity:
    return Quantity(values, MM, kind, member=f"{member}_mm", head=head, decimals=decimals, marked=marked)


def observed(found: AdjustedMarks, marked: Bools) -> Table:
    """Return the adjusted observations with residuals, redundancy, w and error size."""
    of = np.array([int(name.startswith("angle ")) for name in found.rows])
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(np.isnan(found.standardized), math.nan, found.residuals / found.redundancy)
    columns = [
        Quantity([*found.rows], kind="name", member="observed", head="Observed"),
        Quantity(found.observed, OBSERVED, "value", member="value", head="Value", decimals=3, of=of),
        Quantity(found.sd, OBSERVED, "deviation", member="sd", head="sd", figures=2, of=of),
        Quantity(found.residuals, OBSERVED, "deviation", member="residual", head="Residual", of=of),
        Quantity(found.redundancy, member="redundancy", head="Redundancy", decimals=3),
        Quantity(found.standardized, member="w", head="w", decimals=2, marked=marked),
        Quantity(error, OBSERVED, "deviation", member="estimated_error", head="Error if it alone is", of=of),
    ]
    return Table("marks.adjustment.observed", "Adjustment of distances", columns)


def distortion(table: RadialTable, found: Curve) -> Table:
    """Return the distortion table with the residuals of the chosen curve."""
    angle = (Axis.turned("", "deg"),)
    columns = [
        Quantity(table.angle, angle, "value", member="angle_rad", head="Angle", decimals=2),
        _mm(found.radius, "value", "radius", "Radius", 3),
        _mm(table.distortion, "deviation", "distortion", "Distortion", 1),
        _mm(found.residuals, "deviation", "residual", "Residual", 2),
        Quantity(found.redundancy, member="redundancy", head="Redundancy", decimals=3),
        Quantity(found.standardized, member="w", head="w", decimals=2),
    ]
    return Table("lens.table", "Table of radial distortion", columns)


def curve(found: Curve) -> Table:
    """Return the curve at radii within the table, and at one beyond it."""
    radius = np.linspace(0.0, float(found.radius.max()), RADII + 1)[1:]
    radius = np.append(radius, radius[-1] + radius[0])
    columns = [
        _mm(radius, "value", "radius", "Radius", 1),
        _mm(found.at(radius), "deviation", "distortion", "Distortion", 2),
        _mm(found.sd_at(radius), "deviation", "sd", "sd", 2),
    ]
    return Table("lens.curve", "Curve, the last radius beyond the table", columns)


def terms(curves: tuple[Curve, ...], taken: int) -> Table:
    """Return the fits with one to three odd terms; `taken` is the chosen number."""
    omega = [each.omega for each in curves]
    p = [each.test.probability_above if each.test else None for each in curves]
    freedom = [len(each.radius) - each.terms - 1 for each in curves]
    choice = ["chosen" if each.terms == taken else "" for each in curves]
    gain = np.array([math.nan, *-np.diff(omega)])
    columns = [
        of_each(curves, "terms", head="Odd terms"),
        Quantity(omega, member="omega", head="Omega", decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="f"),
        Quantity(p, member="probability", head="p", figures=2),
        Quantity(gain, member="gain", head="Gain", decimals=2),
        Quantity(choice, kind="name", head="Taken"),
        Quantity([each.coefficients for each in curves], member="coefficients"),
        Quantity([each.covariance for each in curves], member="covariance"),
    ]
    return Table("lens.fits", "Odd terms beside k0", columns)


def parameters(camera: Camera) -> Table:
    """Return the parameters of a camera with their standard deviations, one per row."""
    assert camera.covariance is not None
    names, matrix = camera.covariance
    sd = np.sqrt(np.diag(np.asarray(matrix)))
    columns = [
        Quantity([*names], kind="name", head="Parameter"),
        Quantity(np.array([camera.parameters[name] for name in names]), head="Value", figures=8),
        Quantity(sd, head="sd", figures=3),
        Quantity([camera.unit_of(name) or "1" for name in names], kind="name", head="Unit"),
    ]
    return Table(f"parameters_{camera.model}", f"Camera {camera.model}", columns)
