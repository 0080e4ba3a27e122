"""Error ellipses of pointings (subroutine ELIPS, figures 9 to 12): of cases, operators, all, and pooled."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.pictures.style import ACCENT, MAIN, MM, key, panels, plain
from photogram.comparator.pointing import CONFIDENCE_FACTORS
from photogram.show.pictures import new_figure, round_length
from photogram.show.style import FAINT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from photogram.arguments.types import Floats
    from photogram.comparator.calibration import Calibration
    from photogram.comparator.pointing import Ellipse, Precision

LEVELS = " / ".join(str(percent) for percent in CONFIDENCE_FACTORS)
LEAST = 39
"""Percent of the standard ellipse, which the program draws."""


def pointing_ellipses(calibration: Calibration) -> Figure:
    """Draw the 39 percent ellipses of single pointings at the measured places of each case."""
    figure, axes = panels(len(calibration.cases))
    ellipses = [
        [readings.precision.ellipse for readings in case.placed.readings] for case in calibration.cases
    ]
    largest = max((ellipse.major_um for own in ellipses for ellipse in own), default=0.0)
    scale = _scale(calibration.cases[0].placed.means_um / MM, largest)
    for panel, case, own in zip(axes, calibration.cases, ellipses, strict=True):
        _ellipses(panel, case.placed.means_um / MM, own, scale)
        sd = case.placed.precision.sd_point_um
        panel.set_title(f"case {case.number}, pooled {sd:.2f} µm", fontsize=9, loc="left")
        plain(panel, "x, mm", "y, mm")
    for panel in axes:
        panel.label_outer()
    key(axes, scale, round_length(largest))
    figure.suptitle("Error ellipses of single pointings (39 percent; * no deviation)", fontsize=11)
    return figure


def operator_ellipses(calibration: Calibration) -> Iterator[tuple[int, Figure]]:
    """Draw for each operator the ellipses of his pointings, point by point over his cases, on the grid."""
    for operator, (points, total) in calibration.pointing.operators.items():
        own = [case for case in calibration.cases if case.placed.case.operator == operator]
        title = f"Pointings of operator {operator}, {len(own)} cases"
        yield operator, _on_grid(calibration, own[0].placed.case.plate, points, total, title)


def total_ellipses(calibration: Calibration) -> Figure:
    """Draw the ellipses of all pointings, point by point, on the grid of the first plate."""
    pointing = calibration.pointing
    title = f"All pointings, {len(calibration.cases)} cases, {len(pointing.operators)} operators"
    plate = calibration.cases[0].placed.case.plate
    return _on_grid(calibration, plate, pointing.points, pointing.total, title)


def _on_grid(
    calibration: Calibration, plate: int, points: Mapping[int, Precision], total: Precision, title: str
) -> Figure:
    """Draw the ellipses of points at all levels, in the axes of the comparator."""
    grid = calibration.session.grids[plate]
    place = dict(zip(grid.points.tolist(), grid.xy_um / MM, strict=True))
    known = {point: own for point, own in points.items() if point in place and own.degrees_of_freedom > 0}
    figure = new_figure(7.2, 7.0)
    axes = figure.subplots()
    if known:
        places = np.array([place[point] for point in known])
        ellipses = [own.ellipse for own in known.values()]
        largest = max(CONFIDENCE_FACTORS.values()) * max(ellipse.major_um for ellipse in ellipses)
        scale = _scale(places, largest)
        for percent, factor in CONFIDENCE_FACTORS.items():
            _ellipses(axes, places, ellipses, factor * scale, faint=percent != LEAST)
        plain(axes, "X of the plate, mm", "Y of the plate, mm")
        axes.margins(0.12)
        key([axes], scale, round_length(largest))
    pooled = f"pooled {total.sd_point_um:.2f} µm" if total.degrees_of_freedom > 0 else "no repeated readings"
    axes.set_title(f"{title}: {pooled}\nellipses of {LEVELS} percent; * no deviation", fontsize=10)
    return figure


def pooled_ellipses(calibration: Calibration) -> Figure:
    """Draw the pooled ellipses of every case, every operator and all, each at all levels, on one scale."""
    pointing = calibration.pointing
    pooled = [
        *((f"case {case.number}", case.placed.precision) for case in calibration.cases),
        *((f"operator {operator}", total) for operator, (_, total) in pointing.operators.items()),
        ("all", pointing.total),
    ]
    known = [(name, own) for name, own in pooled if own.degrees_of_freedom > 0]
    figure, axes = panels(max(len(known), 1), side=2.6)
    largest = max((own.ellipse.major_um for _, own in known), default=1.0) or 1.0
    reach = 1.15 * largest * max(CONFIDENCE_FACTORS.values())
    for panel, (name, own) in zip(axes, known, strict=False):
        for percent, factor in CONFIDENCE_FACTORS.items():
            _ellipses(panel, np.zeros((1, 2)), [own.ellipse], factor, faint=percent != LEAST)
        panel.set_title(f"{name}: {own.sd_point_um:.3f} µm", fontsize=9, loc="left")
        plain(panel, "x, µm", "y, µm")
        panel.set_xlim(-reach, reach)
        panel.set_ylim(-reach, reach)
        panel.label_outer()
    figure.suptitle(f"Pooled error ellipses of a pointing ({LEVELS} percent, outward)", fontsize=11)
    return figure


def _scale(places_mm: Floats, largest_um: float) -> float:
    """Return millimetres of the picture a micrometre: the largest ellipse fills half the spacing."""
    extent = float(np.ptp(places_mm, axis=0).max()) or 1.0
    spacing = extent / max(math.sqrt(len(places_mm)) - 1, 1)
    return 0.5 * spacing / largest_um if largest_um > 0 else 1.0


def _ellipses(
    axes: Axes, places: Floats, ellipses: Sequence[Ellipse], scale: float, *, faint: bool = False
) -> None:
    """Draw ellipses, and a star where a point has none."""
    from matplotlib.collections import EllipseCollection

    axes.plot(*places.T, "+", color=FAINT, markersize=4)
    axes.add_collection(
        EllipseCollection(
            [2 * scale * ellipse.major_um for ellipse in ellipses],
            [2 * scale * ellipse.minor_um for ellipse in ellipses],
            [math.degrees(ellipse.angle_rad) for ellipse in ellipses],
            units="xy",
            offsets=places,
            transOffset=axes.transData,
            facecolor="none",
            edgecolor=FAINT if faint else MAIN,
            linewidth=0.7 if faint else 1.0,
        )
    )
    none = [k for k, ellipse in enumerate(ellipses) if ellipse.major_um == 0.0]
    axes.plot(*places[none].T, "*", color=ACCENT, markersize=5)
