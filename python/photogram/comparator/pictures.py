"""Plots of a calibration by name: vectors, corrections, error ellipses, statistics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.case import exchanged
from photogram.comparator.listing import table_nodes
from photogram.comparator.readings import CONFIDENCE_FACTORS
from photogram.errors import InputError
from photogram.plots.picture_data import VectorField
from photogram.plots.residuals import vector_panel
from photogram.show.quantity import Axis
from photogram.show.sketch.marks import (
    Arrows,
    Ellipses,
    Line,
    Mark,
    Markers,
    Names,
    Panel,
    Polygons,
    Shades,
    Texts,
    around,
    boxes,
    contours,
    ellipse_axes,
)
from photogram.show.sketch.plot import Plot, side_by_side
from photogram.show.style import BLUE, FAINT, INK, SOFT, VERMILION, round_length
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator import Calibration
    from photogram.comparator.fits import Polynomial
    from photogram.comparator.readings import Precision

__all__ = ["sketches"]


def sketches(calibration: Calibration) -> dict[str, Plot]:
    """Return all plots of a calibration, by short names."""
    return {name: plotter() for name, plotter in plotters(calibration).items()}


def plotters(calibration: Calibration) -> dict[str, Callable[[], Plot]]:
    nonlinear, joint = calibration.nonlinear, calibration.joint
    made: dict[str, Callable[[], Plot]] = {
        "variance": partial(variance_bars, calibration),
        "comparator-residuals": partial(residual_vectors, calibration, in_grid=False),
        "grid-residuals": partial(residual_vectors, calibration, in_grid=True),
    }
    for plate in calibration.plates:
        made[f"average-residuals-{plate}"] = partial(average_vectors, calibration, plate)
        if joint and joint.plates[plate].sigma_um > 0:
            made[f"grid-corrections-{plate}"] = partial(joint_grid, calibration, plate)
    polynomials = [("", "", nonlinear.polynomial)] if nonlinear else []
    polynomials += [
        (f"-case-{case.number}", f", case {case.number} alone", case.polynomial.polynomial)
        for case in calibration.cases
        if calibration.session.plot_each_case and case.polynomial
    ]
    for ending, whose, polynomial in polynomials:
        made[f"correction{ending}"] = partial(correction_surface, calibration, polynomial, whose)
        made[f"distorted-grid{ending}"] = partial(distorted_grid, calibration, polynomial, whose)
    made["pointing-ellipses"] = partial(pointing_ellipses, calibration)
    for operator in calibration.pointing.operators:
        made[f"pointing-ellipses-operator-{operator}"] = partial(grid_ellipses, calibration, operator)
    return made | {
        "pointing-ellipses-total": partial(grid_ellipses, calibration),
        "pooled-ellipses": partial(pooled_ellipses, calibration),
        "residual-histogram": partial(residual_histogram, calibration),
    }


MAIN, ACCENT = BLUE, VERMILION
MM = 1000.0
PANELS_ACROSS = 4
PLATE = tuple(Axis(f"{name} of the plate", "mm", small="µm", factor=MM) for name in "XY")
OF_PLATE = ("X of the plate, mm", "Y of the plate, mm")
OF_COMPARATOR = ("x, mm", "y, mm")


def vector_plot(fields: Sequence[VectorField], side: float, title: str) -> Plot:
    """Draw vector fields side by side; the longest vector of all defines their scale."""
    longest = max(float(np.hypot(*field.vectors.T).max(initial=0.0)) for field in fields)
    return side_by_side([vector_panel(field, longest) for field in fields], PANELS_ACROSS, side, title)


def residual_vectors(calibration: Calibration, *, in_grid: bool) -> Plot:
    fields = []
    for case, fit in zip(calibration.cases, calibration.last_fits, strict=True):
        title = f"case {case.number}, point {case.placed.orientation.nearest_point} nearest zero"
        own, hand = fit.residuals, case.placed.orientation.left_handed
        if in_grid:
            places, vectors = (exchanged(each, hand) / MM for each in (case.placed.grid_um, own.grid_um))
            fields.append(VectorField(title, places, vectors, axes=PLATE))
        else:
            fields.append(VectorField(title, own.xy_um / MM, own.comparator_um / MM))
    system, target = ("grid", "grid") if in_grid else ("comparator", "measurement")
    title = f"Residuals in the {system} system (to be added to the {target})"
    return vector_plot(fields, 3.4, title)


def average_vectors(calibration: Calibration, plate: int) -> Plot:
    averages = calibration.plates[plate].averages
    grid = calibration.session.grids[plate]
    title, places = "by grid point: correction of the grid", grid.xy_um[grid.rows_of(averages.points)] / MM
    fields = [VectorField(title, places, averages.corrections_um / MM, axes=PLATE)]
    for place in averages.by_location:
        title = f"by comparator location, cases {', '.join(map(str, place.cases))}"
        fields.append(VectorField(title, place.xy_um / MM, place.residuals_um / MM))
    return vector_plot(fields, 4.2, f"Average residuals of {len(averages.cases)} cases, plate {plate}")


def joint_grid(calibration: Calibration, plate: int) -> Plot:
    joint = calibration.joint
    if joint is None:
        raise InputError(phrase("comparators.no-joint"))
    own, grid = joint.plates[plate], calibration.session.grids[plate]
    places = grid.xy_um[grid.rows_of(own.points)] / MM
    semi_axes, turns = ellipse_axes(own.covariance_um2)
    largest, longest = float(semi_axes.max()), float(np.hypot(*own.corrections_um.T).max())
    # Space for an arrow and the ellipse at its end
    scale = scale_of(places, longest * (1 + largest / float(np.abs(own.corrections_um).max())), 0.9)
    ends = places + own.corrections_um * scale
    marks = [
        Markers(places, ".", 5.0, FAINT, layer=1.0),
        Arrows(places, own.corrections_um * scale, ACCENT, 0.006),
        Ellipses(ends, scale * semi_axes, turns, FAINT, 0.9, layer=1.5),
        Names(places, [str(point) for point in own.points.tolist()], [SOFT] * len(places), ends),
    ]
    limits = around(np.vstack([places, ends - scale * largest, ends + scale * largest]))
    title = f"Corrections of grid {plate} by the joint adjustment, standard ellipses"
    return Plot(6.2, 5.8, [plan(limits, marks, title, OF_PLATE, (scale, round_length(longest)))])


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


def scale_of(places_mm: Floats, largest_um: float, part: float) -> float:
    """Return plot millimetres per micrometre for a largest size within a part of the spacing.

    The points fill a square.
    """
    extent = float(np.ptp(places_mm, axis=0).max()) or 1.0
    spacing = extent / max(math.sqrt(len(places_mm)) - 1, 1)
    return part * spacing / largest_um if largest_um > 0 else 1.0


FINE = 121
MAGNIFICATION = 10_000  # of the net: a micrometre is drawn as 10 mm


def correction_surface(calibration: Calibration, polynomial: Polynomial, whose: str = "") -> Plot:
    centre, half = np.array(polynomial.frame.centre_um), np.array(polynomial.frame.half_range_um)
    x, y = np.linspace(centre - half, centre + half, FINE).T
    places = np.stack(np.meshgrid(x, y), axis=-1)
    values = polynomial.evaluate(places.reshape(-1, 2)).reshape(places.shape)
    measured = np.vstack([fit.residuals.xy_um for fit in calibration.last_fits]) / MM
    largest = float(np.abs(values).max()) or 1.0
    step = round_length(largest / 5)
    levels = step * np.arange(-np.ceil(largest / step), np.ceil(largest / step) + 1)
    shades = Shades(levels[0], levels[-1], "µm", "signed")
    panels = [
        Panel(
            np.array([centre - half, centre + half]) / MM,
            [
                *contours(x / MM, y / MM, values[..., axis], levels, shades, "black", 0.4),
                Markers(measured, ".", 3.0, INK, opacity=0.7),
            ],
            f"correction in {'xy'[axis]}",
            *OF_COMPARATOR,
            equal=True,
            shades=shades if axis else None,
        )
        for axis in range(2)
    ]
    title = f"Nonlinear correction{whose}; dots are the places measured"
    return Plot(10.5, 4.9, panels, 2, title=title)


def distorted_grid(calibration: Calibration, polynomial: Polynomial, whose: str = "") -> Plot:
    """Draw the program's 5 x 5 net, displaced by 10,000 times the correction.

    Nodes and magnification are constant, for comparisons over the years.
    """
    nodes = np.array(table_nodes(calibration.session.centre_um)[::2])[:, ::2]
    corners = nodes[0, 0], nodes[-1, -1]
    along = np.linspace(0.0, 1.0, FINE)
    lines: list[Floats] = []
    for part in np.linspace(0.0, 1.0, len(nodes)):
        for line in (np.column_stack([along, along * 0 + part]), np.column_stack([along * 0 + part, along])):
            places = corners[1] + line * (corners[0] - corners[1])
            lines.append(places / MM + polynomial.evaluate(places) * (MAGNIFICATION / MM))
    stars = Markers(nodes.reshape(-1, 2) / MM, "*", 5.0, FAINT, layer=1.0)
    marks: list[Mark] = [stars, *(Line(line, MAIN, 1.2) for line in lines)]
    limits = around(np.vstack([stars.places, *lines]))
    title = f"Net displaced by the nonlinear correction{whose}, {MAGNIFICATION:,} times magnified"
    return Plot(6.2, 6.0, [plan(limits, marks, title, OF_COMPARATOR, (MAGNIFICATION / MM, 1.0))])


LEVELS = " / ".join(str(percent) for percent in CONFIDENCE_FACTORS)
STANDARD_PERCENT = 39  # Confidence of the standard ellipse, which the program draws


def pointing_ellipses(calibration: Calibration) -> Plot:
    places = [case.placed.means_um / MM for case in calibration.cases]
    axes = [_axes([own.precision for own in case.placed.readings]) for case in calibration.cases]
    largest = max(float(semi_axes.max()) for semi_axes, _ in axes)
    scale, limits = scale_of(places[0], largest, 0.5), around(np.vstack(places))
    panels = [
        plan(
            limits,
            _ellipses(at, *own, {STANDARD_PERCENT: scale}),
            f"case {case.number}, pooled {case.placed.precision.sd_point_um:.2f} µm",
            OF_COMPARATOR,
            (scale, round_length(largest)),
        )
        for at, case, own in zip(places, calibration.cases, axes, strict=True)
    ]
    return side_by_side(
        panels, PANELS_ACROSS, 3.4, "Error ellipses of single pointings (39 percent; * no deviation)"
    )


def grid_ellipses(calibration: Calibration, operator: int | None = None) -> Plot:
    """Draw the pointing ellipses of an operator, or of all, by point on the grid at all levels."""
    pointing, cases = calibration.pointing, calibration.cases
    if operator is None:
        points, total = pointing.points, pointing.total
        title = f"All pointings, {len(cases)} cases, {len(pointing.operators)} operators"
    else:
        points, total = pointing.operators[operator]
        cases = tuple(case for case in cases if case.placed.case.operator == operator)
        title = f"Pointings of operator {operator}, {len(cases)} cases"
    grid = calibration.session.grids[cases[0].placed.case.plate]
    place = dict(zip(grid.points.tolist(), grid.xy_um / MM, strict=True))
    known = {point: own for point, own in points.items() if point in place and own.degrees_of_freedom > 0}
    pooled = f"pooled {total.sd_point_um:.2f} µm" if total.degrees_of_freedom > 0 else "no repeated readings"
    title = f"{title}: {pooled}\nellipses of {LEVELS} percent; * no deviation"
    if not known:
        return Plot(7.2, 7.0, [plan(around(np.array([*place.values()])), (), title, OF_PLATE)])
    places = np.array([place[point] for point in known])
    axes = _axes([*known.values()])
    largest = max(CONFIDENCE_FACTORS.values()) * float(axes[0].max())
    scale = scale_of(places, largest, 0.5)
    scales = {percent: factor * scale for percent, factor in CONFIDENCE_FACTORS.items()}
    marks, key = _ellipses(places, *axes, scales), (scale, round_length(largest))
    return Plot(7.2, 7.0, [plan(around(places, 0.12), marks, title, OF_PLATE, key)])


def pooled_ellipses(calibration: Calibration) -> Plot:
    pointing = calibration.pointing
    pooled = {
        **{f"case {case.number}": case.placed.precision for case in calibration.cases},
        **{f"operator {operator}": total for operator, (_, total) in pointing.operators.items()},
        "all": pointing.total,
    }
    known = {name: own for name, own in pooled.items() if own.degrees_of_freedom > 0}
    axes = {name: _axes([own]) for name, own in known.items()}
    largest = max((float(semi_axes.max()) for semi_axes, _ in axes.values()), default=1.0) or 1.0
    reach = 1.15 * largest * max(CONFIDENCE_FACTORS.values())
    limits = np.array([[-reach, -reach], [reach, reach]])
    panels = [
        plan(
            limits,
            _ellipses(np.zeros((1, 2)), *axes[name], CONFIDENCE_FACTORS),
            f"{name}: {own.sd_point_um:.3f} µm",
            ("x, µm", "y, µm"),
        )
        for name, own in known.items()
    ]
    title = f"Pooled error ellipses of a pointing ({LEVELS} percent, outward)"
    return side_by_side(panels or [Panel(limits)], PANELS_ACROSS, 2.6, title)


def _axes(precisions: Sequence[Precision]) -> tuple[Floats, Floats]:
    """Return semi-axes (n, 2), um, and directions (n,), degrees, of pointings."""
    ellipses = [own.ellipse for own in precisions]
    return (
        np.array([[each.major_um, each.minor_um] for each in ellipses]),
        np.degrees([each.angle_rad for each in ellipses]),
    )


def _ellipses(places: Floats, semi_axes: Floats, turns: Floats, scales: Mapping[int, float]) -> list[Mark]:
    """Return ellipses of several percentages, and a star for each missing one."""
    marks: list[Mark] = [Markers(places, "+", 4.0, FAINT)]
    for percent, scale in scales.items():
        colour, width = (MAIN, 1.0) if percent == STANDARD_PERCENT else (FAINT, 0.7)
        marks.append(Ellipses(places, scale * semi_axes, turns, colour, width))
    none = places[semi_axes[:, 0] == 0.0]
    return [*marks, Markers(none, "*", 5.0, ACCENT)] if len(none) else marks


def residual_histogram(calibration: Calibration) -> Plot:
    residuals = np.vstack([fit.residuals.comparator_um for fit in calibration.last_fits])
    limit = float(np.abs(residuals).max()) * 1.1 or 1.0
    bins = 2 * round(math.sqrt(len(residuals)) * 0.75) + 1  # Odd
    edges = np.linspace(-limit, limit, bins + 1)
    counts = [np.histogram(own, edges)[0] for own in residuals.T]
    sigmas = [math.sqrt(float((own**2).mean())) or 1.0 for own in residuals.T]
    scale = len(residuals) * (edges[1] - edges[0]) / math.sqrt(2 * math.pi)
    top = 1.05 * max(*(float(own.max()) for own in counts), *(scale / sigma for sigma in sigmas))
    limits = np.array([[-limit, 0.0], [limit, top]])
    panels = []
    for axis, (own, count, sigma) in enumerate(zip(residuals.T, counts, sigmas, strict=True)):
        x = np.linspace(-limit, limit, 301)
        curve = np.column_stack([x, scale / sigma * np.exp(-((x / sigma) ** 2) / 2)])
        bars = boxes(np.column_stack([edges[:-1], 0 * count]), np.column_stack([edges[1:], count]))
        beyond = 100 * float((np.abs(own) > 2 * sigma).mean())
        title = (
            f"{'xy'[axis]}: {len(own)} residuals, rms {sigma:.3f} µm,\n"
            f"{beyond:.1f} % beyond twice that (normal: 4.6 %)"
        )
        marks = [Polygons(bars, MAIN, 0.35, MAIN, 1.0, 0.8), Line(curve, ACCENT, 1.8)]
        panels.append(Panel(limits, marks, title, "residual, µm", "" if axis else "number"))
    title = "Final residuals in the comparator system and the normal curve"
    return Plot(10.0, 3.9, panels, 2, title=title)


def variance_bars(calibration: Calibration) -> Plot:
    components = calibration.variance.components_um
    total = components["total"] ** 2
    names = [name for name in components if name != "total"][::-1]
    values = np.array([components[name] ** 2 for name in names])
    right, places = 1.25 * (float(values.max()) or 1.0), np.arange(len(names), dtype=float)
    shares = 100 * values / total if total else 0 * values
    every = zip(names, shares.tolist(), strict=True)
    texts = [f"{components[name]:.3f} µm, {share:.0f} %" for name, share in every]
    bars = boxes(np.column_stack([0 * values, places - 0.3]), np.column_stack([values, places + 0.3]))
    marks = [
        Polygons(bars, MAIN, 0.75, MAIN, 0.0, 0.0),
        Texts(np.column_stack([values + 0.01 * right, places]), texts, 8.0),
    ]
    title = f"Components of the error: {components['total']:.3f} µm before calibration"
    limits = np.array([[0.0, -0.5], [right, len(names) - 0.5]])
    return Plot(8.0, 2.9, [Panel(limits, marks, title, "variance, µm²", up_names=names)])
