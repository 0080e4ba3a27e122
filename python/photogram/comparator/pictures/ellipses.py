"""Error ellipses of pointings (subroutine ELIPS, figures 9 to 12)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.pictures.vectors import (
    ACCENT,
    MAIN,
    MM,
    OF_COMPARATOR,
    OF_PLATE,
    PANELS_ACROSS,
    plan,
    spacing,
)
from photogram.comparator.pointing import CONFIDENCE_FACTORS
from photogram.show.sketch.marks import Ellipses, Mark, Markers, Panel, around
from photogram.show.sketch.plot import Plot, side_by_side
from photogram.show.style import FAINT, round_length

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator import Calibration
    from photogram.comparator.pointing import Ellipse, Precision

LEVELS = " / ".join(str(percent) for percent in CONFIDENCE_FACTORS)
STANDARD_PERCENT = 39  # Confidence of the standard ellipse, which the program draws


def pointing_ellipses(calibration: Calibration) -> Plot:
    """Draw the 39 percent ellipses of pointings at the measured points of each case."""
    places = [case.placed.means_um / MM for case in calibration.cases]
    ellipses = [
        [readings.precision.ellipse for readings in case.placed.readings] for case in calibration.cases
    ]
    largest = max((ellipse.major_um for own in ellipses for ellipse in own), default=0.0)
    scale, limits = _scale(places[0], largest), around(np.vstack(places))
    panels = [
        plan(
            limits,
            _ellipses(at, own, {STANDARD_PERCENT: scale}),
            f"case {case.number}, pooled {case.placed.precision.sd_point_um:.2f} µm",
            OF_COMPARATOR,
            (scale, round_length(largest)),
        )
        for at, case, own in zip(places, calibration.cases, ellipses, strict=True)
    ]
    return side_by_side(
        panels, PANELS_ACROSS, 3.4, "Error ellipses of single pointings (39 percent; * no deviation)"
    )


def operator_ellipses(calibration: Calibration, operator: int) -> Plot:
    """Draw the pointing ellipses of an operator, by point, on the grid."""
    points, total = calibration.pointing.operators[operator]
    own = [case for case in calibration.cases if case.placed.case.operator == operator]
    title = f"Pointings of operator {operator}, {len(own)} cases"
    return _on_grid(calibration, own[0].placed.case.plate, points, total, title)


def total_ellipses(calibration: Calibration) -> Plot:
    """Draw the ellipses of all pointings, by point, on the grid of the first plate."""
    pointing = calibration.pointing
    title = f"All pointings, {len(calibration.cases)} cases, {len(pointing.operators)} operators"
    plate = calibration.cases[0].placed.case.plate
    return _on_grid(calibration, plate, pointing.points, pointing.total, title)


def _on_grid(
    calibration: Calibration, plate: int, points: Mapping[int, Precision], total: Precision, title: str
) -> Plot:
    """Draw the ellipses of points at all levels, in the axes of the comparator."""
    grid = calibration.session.grids[plate]
    place = dict(zip(grid.points.tolist(), grid.xy_um / MM, strict=True))
    known = {point: own for point, own in points.items() if point in place and own.degrees_of_freedom > 0}
    pooled = f"pooled {total.sd_point_um:.2f} µm" if total.degrees_of_freedom > 0 else "no repeated readings"
    title = f"{title}: {pooled}\nellipses of {LEVELS} percent; * no deviation"
    if not known:
        return Plot(7.2, 7.0, [plan(around(np.array([*place.values()])), (), title, OF_PLATE)])
    places = np.array([place[point] for point in known])
    ellipses = [own.ellipse for own in known.values()]
    largest = max(CONFIDENCE_FACTORS.values()) * max(ellipse.major_um for ellipse in ellipses)
    scale = _scale(places, largest)
    scales = {percent: factor * scale for percent, factor in CONFIDENCE_FACTORS.items()}
    marks, key = _ellipses(places, ellipses, scales), (scale, round_length(largest))
    return Plot(7.2, 7.0, [plan(around(places, 0.12), marks, title, OF_PLATE, key)])


def pooled_ellipses(calibration: Calibration) -> Plot:
    """Draw the pooled ellipses of cases, operators and all pointings at all levels."""
    pointing = calibration.pointing
    pooled = [
        *((f"case {case.number}", case.placed.precision) for case in calibration.cases),
        *((f"operator {operator}", total) for operator, (_, total) in pointing.operators.items()),
        ("all", pointing.total),
    ]
    known = [(name, own) for name, own in pooled if own.degrees_of_freedom > 0]
    largest = max((own.ellipse.major_um for _, own in known), default=1.0) or 1.0
    reach = 1.15 * largest * max(CONFIDENCE_FACTORS.values())
    limits = np.array([[-reach, -reach], [reach, reach]])
    panels = [
        Panel(
            limits,
            _ellipses(np.zeros((1, 2)), [own.ellipse], CONFIDENCE_FACTORS),
            f"{name}: {own.sd_point_um:.3f} µm",
            "x, µm",
            "y, µm",
            equal=True,
        )
        for name, own in known
    ]
    title = f"Pooled error ellipses of a pointing ({LEVELS} percent, outward)"
    return side_by_side(panels or [Panel(limits)], PANELS_ACROSS, 2.6, title)


def _scale(places_mm: Floats, largest_um: float) -> float:
    """Return plot millimetres per micrometre for ellipses within half the spacing."""
    return 0.5 * spacing(places_mm) / largest_um if largest_um > 0 else 1.0


def _ellipses(places: Floats, ellipses: Sequence[Ellipse], scales: Mapping[int, float]) -> list[Mark]:
    """Return ellipses of several percentages, and a star for each missing one."""
    semi_axes = np.array([[each.major_um, each.minor_um] for each in ellipses])
    turns = np.degrees([each.angle_rad for each in ellipses])
    marks: list[Mark] = [Markers(places, "+", 4.0, FAINT)]
    for percent, scale in scales.items():
        colour, width = (MAIN, 1.0) if percent == STANDARD_PERCENT else (FAINT, 0.7)
        marks.append(Ellipses(places, scale * semi_axes, turns, colour, width))
    none = places[semi_axes[:, 0] == 0.0]
    return [*marks, Markers(none, "*", 5.0, ACCENT)] if len(none) else marks
