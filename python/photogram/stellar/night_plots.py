"""Plots of a calibrated night: stars, residuals, histogram, distortion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.show.sketch.marks import Arrows, Line, Mark, Markers, Panel, ScaleBar, around, horizontal_line
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, FAINT
from photogram.stellar.drawing import band, bells, curves, vectors

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight

_MAX_COLOURS = len(COLOURS)  # Further exposures have the same colour


def sketches(result: CalibratedNight) -> dict[str, Plot]:
    """Return all plots by name."""
    x, y = result.calibration.residuals.T
    arrows, bar = vectors(result.calibration.xy, result.calibration.residuals, _groups(result), "px")
    return {
        "stars": _stars(result),
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


def _stars(result: CalibratedNight) -> Plot:
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
    return _frame(result, "Stars in the frame, and the principal point", marks)


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
