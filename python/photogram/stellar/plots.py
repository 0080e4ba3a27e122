"""Plots of a plate calibration: stars, residuals, histogram, distortion, refraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.angles import ARCSEC
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, ScaleBar, around, horizontal_line, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, FAINT
from photogram.stellar.curves import distortion_curves, refraction_curves, residual_classes
from photogram.stellar.drawing import band, bells, curves, vectors
from photogram.stellar.parameters import GROUPS

if TYPE_CHECKING:
    from photogram.stellar import Result


def sketches(result: Result) -> dict[str, Plot]:
    """Return the requested plots by name, always with stars and residuals."""
    made = {"stars": _stars(result), "residuals": _residuals(result)}
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


def _stars(result: Result) -> Plot:
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
    return _plate(means, "Stars on the plate", marks)


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
