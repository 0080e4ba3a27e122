"""Plots of plates and nights: stars, residuals, histogram, distortion, refraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.angles import ARCSEC
from photogram.show.sketch.marks import (
    Arrows,
    Line,
    Mark,
    Markers,
    Panel,
    Polygons,
    ScaleBar,
    around,
    boxes,
    horizontal_line,
    spread,
)
from photogram.show.sketch.marks import band as area
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, FAINT, INK, MARKED, SKY
from photogram.stellar.curves import distortion_curves, histogram, refraction_curves, residual_classes
from photogram.stellar.parameters import GROUPS

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight, Result


def plate_sketches(result: Result) -> dict[str, Plot]:
    """Return the requested plots by name, always with stars and residuals."""
    problem = result.problem
    count = np.bincount(problem.image_stars, minlength=len(problem.star_ids))
    sums = np.zeros((len(problem.star_ids), 2))
    np.add.at(sums, problem.image_stars, problem.image_xy)
    means = 1e3 * sums / np.maximum(count, 1)[:, None]
    marks: list[Mark] = []
    for known, shape, label in ((True, "*", "known"), (False, "o", "unknown")):
        if (chosen := problem.known == known).any():
            text = f"{label} ({int(chosen.sum())})"
            face = "" if known else "none"
            marks.append(Markers(means[chosen], shape, 6.8, COLOURS[0 if known else 1], face, label=text))
    made = {"stars": _plate(means, "Stars on the plate", marks), "residuals": _residuals(result)}
    if result.problem.options.histogram:
        every = {name: 1e6 * values for name, values in residual_classes(result).items()}
        made["histogram"] = bells(every, "µm")
    if result.problem.options.curves:
        made["distortion"] = _distortion(result)
    if result.problem.options.refraction:
        made["refraction"] = _refraction(result)
    return made


def _plate(places: Floats, title: str, marks: Sequence[Mark], bars: Sequence[ScaleBar] = ()) -> Plot:
    limits = around(places)
    lines = [
        Line(np.where(axis, limits, 0.0), FAINT, 0.5, opacity=0.5, layer=0.0)
        for axis in ([True, False], [False, True])
    ]
    panel = Panel(limits, [*lines, *marks], title, "x, mm", "y, mm", equal=True, legend="beside", bars=bars)
    return Plot(8.2, 6.6, [panel])


def _residuals(result: Result) -> Plot:
    problem = result.problem
    groups = [(name, problem.image_groups == group) for group, name in enumerate(GROUPS)]
    shown = [(name, chosen) for name, chosen in groups if chosen.any()]
    places = 1e3 * problem.image_xy
    arrows, bar = vectors(places, 1e6 * result.solved.residuals, shown, "µm")
    ends = [each.places + each.vectors for each in arrows]
    return _plate(np.vstack([places, *ends]), "Residuals (computed minus measured)", arrows, [bar])


def _distortion(result: Result) -> Plot:
    # Finer than the table, for smooth curves.
    problem = result.problem
    fine = replace(problem.options, interval=(problem.options.extent or 0.1) / 200)
    found = distortion_curves(replace(result, problem=replace(problem, options=fine)))
    d = 1e3 * found.distance
    marks = [
        horizontal_line(0.0, FAINT, 0.8),
        *band(d, 1e6 * found.radial, 1e6 * found.radial_error, COLOURS[0], "radial"),
        *band(d, 1e6 * found.transformed, 1e6 * found.transformed_error, COLOURS[1], "radial, transformed"),
        *band(d, 1e6 * found.decentering, 1e6 * found.decentering_error, COLOURS[2], "decentering"),
    ]
    panel = curves(
        marks,
        "distance from the centre of distortion, mm",
        "distortion with its mean error, µm",
        f"Distortion; calibrated principal distance {1e3 * found.calibrated:.4f} mm",
    )
    return Plot(7.5, 4.8, [panel])


def _refraction(result: Result) -> Plot:
    groups = [group for group in range(3) if result.solved.free[3 * group]]
    every = {group: refraction_curves(result, group) for group in groups}
    z = np.concatenate([found.zenith_distance for found in every.values()])
    change = np.concatenate([found.corrected - found.given for found in every.values()]) / ARCSEC
    error = np.concatenate([found.error for found in every.values()]) / ARCSEC
    order = np.argsort(z)
    marks = band(np.degrees(z[order]), change[order], error[order], COLOURS[3], "change and its mean error")
    low, high = spread(change - error, change + error)
    for k, (group, found) in enumerate(every.items()):
        ends = np.degrees(found.zenith_distance[[0, -1]])
        height = np.full(2, low - 0.06 * (k + 1) * (high - low))
        line = np.column_stack([ends, height])
        marks.append(Line(line, COLOURS[group], 5.0, label=f"field of {GROUPS[group]}"))
    panel = curves(
        [*marks, horizontal_line(0.0, FAINT, 0.8)],
        "observed zenith distance, degrees",
        "corrected minus given refraction, arcsec",
        "Refraction",
    )
    return Plot(7.5, 4.8, [panel])


_MAX_COLOURS = len(COLOURS)  # Further exposures have the same colour


def night_sketches(result: CalibratedNight) -> dict[str, Plot]:
    """Return all plots by name."""
    x, y = result.calibration.residuals.T
    arrows, bar = vectors(result.calibration.xy, result.calibration.residuals, _groups(result), "px")
    marks: list[Mark] = [
        Markers(
            result.calibration.xy[chosen],
            "*",
            4.5,
            COLOURS[k],
            edge=0.0,
            label=f"{label} ({int(chosen.sum())})",
        )
        for k, (label, chosen) in enumerate(_groups(result))
    ]
    return {
        "stars": _frame(result, "Stars in the frame, and the principal point", marks),
        "residuals": _frame(result, "Residuals (measured minus computed)", arrows, [bar]),
        "histogram": bells({"x": x, "y": y, "x and y": np.concatenate([x, y])}, "px"),
        "distortion": _of_brown(result) if result.camera.lens == "brown" else _of_angle(result),
    }


def _frame(result: CalibratedNight, title: str, marks: Sequence[Mark], bars: Sequence[ScaleBar] = ()) -> Plot:
    """Return a plot of marks on the frame with y downward."""
    width, height = result.night.frame
    outline = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]], float)
    ends = [each.places + each.vectors for each in marks if isinstance(each, Arrows)]
    (left, top), (right, low) = around(np.vstack([outline, *ends]), 0.05)
    every = [Line(outline, FAINT, 0.8), Markers(result.camera.values[None, 2:4], "+", 12.0), *marks]
    limits = np.array([[left, low], [right, top]])
    panel = Panel(limits, every, title, "x, px", "y, px", equal=True, legend="beside", bars=bars)
    return Plot(8.7, 1.8 + 6.5 * height / width, [panel])


def _groups(result: CalibratedNight) -> list[tuple[str, Any]]:
    of = result.calibration.exposures
    if len(result.names) > _MAX_COLOURS:
        return [(f"{len(result.names)} exposures", np.ones(len(of), bool))]
    return [(f"exposure {name}", of == k) for k, name in enumerate(result.names)]


def _of_angle(result: CalibratedNight) -> Plot:
    """Draw the principal point distance against the angle, and the effect of terms."""
    camera, frame = result.camera, result.night.frame
    theta = np.linspace(0, min(camera.largest_angle(frame), np.radians(110)), 200)
    along = np.column_stack([np.sin(theta), np.zeros(len(theta)), np.cos(theta)])
    free = replace(camera, values=np.where(np.arange(len(camera.values)) < 4, camera.values, 0.0))
    seen, straight = (each.images(along)[:, 0] - camera.values[2] for each in (camera, free))
    partials = camera.partials(along)[:, 0, 4:]
    variance = np.einsum("ni,ij,nj->n", partials, camera.covariance[4:, 4:], partials)
    angle, across = np.degrees(theta), "angle from the axis, degrees"
    line = Line(np.column_stack([angle, seen]), COLOURS[0], label=camera.lens)
    terms = band(angle, seen - straight, np.sqrt(np.maximum(variance, 0)), COLOURS[0], "terms")
    panels = [
        curves([line], across, "distance from the principal point, px"),
        curves(terms, across, "change by the terms of the lens, px"),
    ]
    return Plot(11.0, 4.4, panels, 2)


def _of_brown(result: CalibratedNight) -> Plot:
    """Draw radial distortion and decentring profile, to the corners of the frame."""
    camera = result.camera
    f = float(np.mean(camera.values[:2]))
    corners = np.array([[x, y] for x in (0, result.night.frame[0]) for y in (0, result.night.frame[1])])
    r = np.linspace(0, float(np.linalg.norm(corners - camera.values[2:4], axis=1).max()) / f, 200)
    radial = f * np.column_stack([r**3, r**5, r**7])
    covariance = camera.covariance[4:7, 4:7]
    error = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", radial, covariance, radial), 0))
    p = camera.values[7:9]
    size = float(np.hypot(*p))
    along = p / size if size else np.array([1.0, 0.0])
    size_error = float(np.sqrt(along @ camera.covariance[7:9, 7:9] @ along))
    found = (
        ("radial", radial @ camera.values[4:7], error),
        ("decentering", f * r**2 * size, f * r**2 * size_error),
    )
    distortion, errors = list[Mark]([horizontal_line(0.0, FAINT, 0.8)]), list[Mark]()
    for colour, (label, value, own) in zip(COLOURS, found, strict=False):
        distortion += band(f * r, value, own, colour, label)
        errors.append(Line(np.column_stack([f * r, own]), colour, label=label))
    across = "distance from the principal point, px"
    panels = [
        curves(distortion, across, "px", "Distortion, with its mean error"),
        curves(errors, across, "px", "Its mean error"),
    ]
    used = float(np.linalg.norm(result.calibration.xy - camera.values[2:4], axis=1).max())
    for row, panel in enumerate(panels):
        places = np.column_stack([np.full(2, used), panel.limits[:, 1]])
        line = Line(places, FAINT, 1.0, ":", label="outermost star")
        panels[row] = replace(panel, marks=[line, *panel.marks])
    return Plot(11.0, 4.4, panels, 2)


_MEAN_RESIDUAL = 0.05  # Length in the plot, relative to its extent


def band(x: Floats, y: Floats, error: Floats, colour: str, label: str) -> list[Mark]:
    """Return a curve with its mean error."""
    return [area(x, y - error, y + error, colour, 0.2), Line(np.column_stack([x, y]), colour, label=label)]


def curves(marks: Sequence[Mark], across: str, up: str, title: str = "") -> Panel:
    """Return a panel that contains all given lines and bands."""
    lines = [line for mark in marks if isinstance(mark, Line) for line in mark.lines]
    x, y = np.concatenate(lines).T
    bands = [outline[:, 1] for mark in marks if isinstance(mark, Polygons) for outline in mark.places]
    limits = np.column_stack([spread(x), spread(y, *bands)])
    return Panel(limits, marks, title, across, up, legend="below")


def vectors(
    places: Floats, residuals: Floats, groups: list[tuple[str, Any]], unit: str
) -> tuple[list[Arrows], ScaleBar]:
    """Return residual vectors (m, 2) in a unit, and their scale.

    Positions have the unit of the axes; groups are names and the residuals of each, with one colour.
    """
    extent = float(np.ptp(places, axis=0).max()) or 1.0
    size = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))) or 1.0
    scale = _MEAN_RESIDUAL * extent / size
    marks = [
        Arrows(places[chosen], scale * residuals[chosen], COLOURS[k % len(COLOURS)], 0.0022, label=label)
        for k, (label, chosen) in enumerate(groups)
    ]
    bar = float(f"{2 * size:.0e}")
    return marks, (scale * bar, INK, f"{bar:g} {unit}")


def bells(every: dict[str, Floats], unit: str) -> Plot:
    """Return named histograms of residuals with normal curves."""
    panels = [_bell(values, f"residuals in {name}", unit) for name, values in every.items()]
    return Plot(11.0, 3.8, panels, len(panels))


def _bell(values: Floats, title: str, unit: str) -> Panel:
    found = histogram(values)
    edges, counts = found.edges, np.asarray(found.counts, float)
    bars = boxes(np.column_stack([edges[:-1], 0 * counts]), np.column_stack([edges[1:], counts]))
    x = np.linspace(edges[0], edges[-1], 200)
    density = np.exp(-0.5 * ((x - found.mean) / found.sd) ** 2) / (found.sd * np.sqrt(2 * np.pi))
    curve = len(values) * (edges[1] - edges[0]) * density
    marks = [Polygons(bars, SKY, 0.6, "white", 1.0, 1.0), Line(np.column_stack([x, curve]), MARKED)]
    (left, right), (_, top) = spread(edges), spread(0.0, counts, curve)
    limits = np.array([[left, 0.0], [right, top]])
    return Panel(limits, marks, f"{title}: sd {found.sd:.3g} {unit}", unit, "number")
