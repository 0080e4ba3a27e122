"""Vector plots: residuals of each case in both systems, averages, grid corrections."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.case import exchanged
from photogram.comparator.pointing import Ellipse
from photogram.errors import InputError
from photogram.show.sketch.marks import Arrows, Ellipses, Mark, Markers, Names, Panel, around
from photogram.show.sketch.plot import Plot, side_by_side
from photogram.show.style import BLUE, FAINT, SOFT, VERMILION, round_length
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator import Calibration


def comparator_vectors(calibration: Calibration) -> Plot:
    """Draw the final residuals of each case in the comparator system."""
    residuals = [fit.residuals for fit in calibration.last_fits]
    return _by_case(
        calibration,
        [own.xy_um for own in residuals],
        [own.comparator_um for own in residuals],
        OF_COMPARATOR,
        "Residuals in the comparator system (to be added to the measurement)",
    )


def grid_vectors(calibration: Calibration) -> Plot:
    """Draw the final residuals of each case in the plate system."""
    hands = [case.placed.orientation.left_handed for case in calibration.cases]
    return _by_case(
        calibration,
        [exchanged(case.placed.grid_um, hand) for case, hand in zip(calibration.cases, hands, strict=True)],
        [
            exchanged(fit.residuals.grid_um, hand)
            for fit, hand in zip(calibration.last_fits, hands, strict=True)
        ],
        OF_PLATE,
        "Residuals in the grid system (to be added to the grid)",
    )


def _by_case(
    calibration: Calibration,
    places: Sequence[Floats],
    vectors: Sequence[Floats],
    axes: tuple[str, str],
    title: str,
) -> Plot:
    every = np.vstack(vectors)
    scale = magnification(places[0] / MM, every)
    # The longest residual of all panels defines their common scale.
    key = scale, round_length(float(np.hypot(*every.T).max()))
    limits = limits_of(np.vstack(places), every, scale)
    panels = [
        plan(
            limits,
            arrows(own, vector, scale),
            f"case {case.number}, point {case.placed.orientation.nearest_point} nearest zero",
            axes,
            key,
        )
        for case, own, vector in zip(calibration.cases, places, vectors, strict=True)
    ]
    return side_by_side(panels, PANELS_ACROSS, 3.4, title)


def average_vectors(calibration: Calibration, plate: int) -> Plot:
    """Draw average residuals by comparator location and by grid point, on one scale."""
    result = calibration.plates[plate]
    averages = result.averages
    grid = calibration.session.grids[plate]
    own = grid.xy_um[grid.rows_of(averages.points)]
    corrections = averages.corrections_um
    together = np.vstack([corrections, averages.location_um])
    scale = magnification(own / MM, together)
    key = scale, round_length(float(np.hypot(*together.T).max()))
    panels = [
        plan(
            limits_of(place.xy_um, place.residuals_um, scale),
            arrows(place.xy_um, place.residuals_um, scale),
            f"by comparator location, cases {', '.join(map(str, place.cases))}",
            OF_COMPARATOR,
            key,
        )
        for place in averages.by_location
    ]
    marks, title = arrows(own, corrections, scale, ACCENT), "by grid point: correction of the grid"
    panels.append(plan(limits_of(own, corrections, scale), marks, title, OF_PLATE, key))
    return side_by_side(
        panels, PANELS_ACROSS, 4.2, f"Average residuals of {len(averages.cases)} cases, plate {plate}"
    )


def joint_grid(calibration: Calibration, plate: int) -> Plot:
    """Draw the grid corrections of the joint adjustment with standard ellipses."""
    joint = calibration.joint
    if joint is None:
        raise InputError(phrase("comparators.no-joint"))
    own = joint.plates[plate]
    grid = calibration.session.grids[plate]
    places = grid.xy_um[grid.rows_of(own.points)]
    ellipses = [Ellipse.of(c[0, 0], c[1, 1], c[0, 1]) for c in own.covariance_um2]
    largest = max(ellipse.major_um for ellipse in ellipses)
    # Space for an arrow and the ellipse at its end.
    scale = magnification(places / MM, own.corrections_um * (1 + largest / np.abs(own.corrections_um).max()))
    ends = places / MM + own.corrections_um * scale
    semi_axes = scale * np.array([[each.major_um, each.minor_um] for each in ellipses])
    turns = np.degrees([each.angle_rad for each in ellipses])
    marks = [
        *arrows(places, own.corrections_um, scale, ACCENT),
        Ellipses(ends, semi_axes, turns, FAINT, 0.9, layer=1.5),
        Names(places / MM, [str(point) for point in own.points.tolist()], [SOFT] * len(places), ends),
    ]
    reach = scale * largest
    limits = around(np.vstack([places / MM, ends - reach, ends + reach]))
    key = scale, round_length(float(np.hypot(*own.corrections_um.T).max()))
    title = f"Corrections of grid {plate} by the joint adjustment, standard ellipses"
    return Plot(6.2, 5.8, [plan(limits, marks, title, OF_PLATE, key)])


MAIN, ACCENT = BLUE, VERMILION
MM = 1000.0
PANELS_ACROSS = 4
OF_PLATE = ("X of the plate, mm", "Y of the plate, mm")
OF_COMPARATOR = ("x, mm", "y, mm")


def plan(
    limits: Floats,
    marks: Sequence[Mark],
    title: str,
    axes: tuple[str, str],
    key: tuple[float, float] | None = None,
) -> Panel:
    """Return a map of equal scales; `key`: mm per micrometre, micrometres of the bar."""
    bars = [(key[0] * key[1], ACCENT, f"{key[1]:g} µm")] if key else []
    return Panel(limits, marks, title, *axes, equal=True, bars=bars)


def magnification(places_mm: Floats, vectors_um: Floats) -> float:
    """Return plot millimetres per micrometre for vectors within 0.9 times the spacing."""
    longest = float(np.hypot(*vectors_um.T).max(initial=0.0))
    return 0.9 * spacing(places_mm) / longest if longest > 0 else 1.0


def spacing(places: Floats) -> float:
    """Return the mean spacing of points that fill a square."""
    extent = float(np.ptp(places, axis=0).max()) or 1.0
    return extent / max(math.sqrt(len(places)) - 1, 1)


def arrows(places_um: Floats, vectors_um: Floats, scale: float, colour: str = MAIN) -> list[Mark]:
    """Return vectors at points, `scale` plot millimetres per micrometre."""
    places = places_um / MM
    dots = Markers(places, ".", 5.0, FAINT, layer=1.0)
    return [dots, Arrows(places, vectors_um * scale, colour, 0.006)]


def limits_of(places_um: Floats, vectors_um: Floats, scale: float) -> Floats:
    """Return the limits of a map of vectors."""
    return around(np.vstack([places_um / MM, places_um / MM + vectors_um * scale]))
