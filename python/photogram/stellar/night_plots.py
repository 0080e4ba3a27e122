"""Pictures of a calibrated night (extra `plots`): stars, residuals, histogram, distortion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.show.style import COLOURS, FAINT, INK, in_style
from photogram.stellar.drawing import band, bell, panels, vectors

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.stellar.night_result import CalibratedNight

_NAMED = len(COLOURS)
"""Exposures that have a colour of their own; more are drawn alike."""


@in_style
def figures(result: CalibratedNight) -> dict[str, Figure]:
    """Return all pictures by name."""
    return {
        "stars": _stars(result),
        "residuals": _residuals(result),
        "histogram": _histogram(result),
        "distortion": _distortion(result),
    }


def _frame(result: CalibratedNight, title: str) -> tuple[Figure, Any]:
    """Draw the frame as the picture is seen: y downward."""
    width, height = result.night.frame
    figure, axes = panels(7.5, 1.8 + 6.5 * height / width)
    axes.set(xlabel="x, px", ylabel="y, px", aspect="equal")
    axes.set_title(title)
    axes.plot([0, width, width, 0, 0], [0, 0, height, height, 0], color=FAINT, linewidth=0.8)
    axes.plot(*result.camera.values[2:4], marker="+", color=INK, markersize=12)
    return figure, axes


def _groups(result: CalibratedNight) -> list[tuple[str, Any]]:
    of = result.calibration.exposures
    if len(result.names) > _NAMED:
        return [(f"{len(result.names)} exposures", np.ones(len(of), bool))]
    return [(f"exposure {name}", of == k) for k, name in enumerate(result.names)]


def _stars(result: CalibratedNight) -> Figure:
    figure, axes = _frame(result, "Stars in the frame, and the principal point")
    for k, (label, chosen) in enumerate(_groups(result)):
        places = result.calibration.xy[chosen].T
        text = f"{label} ({int(chosen.sum())})"
        axes.scatter(*places, marker="*", s=20, color=COLOURS[k], label=text, linewidths=0)
    axes.invert_yaxis()
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def _residuals(result: CalibratedNight) -> Figure:
    figure, axes = _frame(result, "Residuals (measured minus computed)")
    found = result.calibration
    vectors(figure, axes, found.xy, found.residuals, _groups(result), "px")
    axes.invert_yaxis()
    return figure


def _histogram(result: CalibratedNight) -> Figure:
    figure, every = panels(11.0, 3.8, 3)
    x, y = result.calibration.residuals.T
    for axes, (name, values) in zip(
        every, {"x": x, "y": y, "x and y": np.concatenate([x, y])}.items(), strict=True
    ):
        bell(axes, values, f"residuals in {name}", "px")
    return figure


def _distortion(result: CalibratedNight) -> Figure:
    """Draw what the terms of the lens do."""
    return _of_brown(result) if result.camera.lens == "brown" else _of_angle(result)


def _of_angle(result: CalibratedNight) -> Figure:
    """Draw the distance from the principal point over the angle, and what the terms change in it."""
    camera, frame = result.camera, result.night.frame
    theta = np.linspace(0, min(camera.largest_angle(frame), np.radians(110)), 200)
    along = np.column_stack([np.sin(theta), np.zeros(len(theta)), np.cos(theta)])
    free = replace(camera, values=np.where(np.arange(len(camera.values)) < 4, camera.values, 0.0))
    seen, straight = (each.images(along)[:, 0] - camera.values[2] for each in (camera, free))
    partials = camera.partials(along)[:, 0, 4:]
    variance = np.einsum("ni,ij,nj->n", partials, camera.covariance[4:, 4:], partials)
    figure, (axes, errors) = panels(11.0, 4.4, 2)
    axes.plot(np.degrees(theta), seen, color=COLOURS[0], label=camera.lens)
    band(errors, np.degrees(theta), seen - straight, np.sqrt(np.maximum(variance, 0)), COLOURS[0], "terms")
    axes.set(ylabel="distance from the principal point, px")
    errors.set(ylabel="change by the terms of the lens, px")
    for panel in (axes, errors):
        panel.set_xlabel("angle from the axis, degrees")
        panel.legend()
    return figure


def _of_brown(result: CalibratedNight) -> Figure:
    """Draw radial distortion and the profile of the decentering one, to the corners of the frame."""
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
    figure, (axes, errors) = panels(11.0, 4.4, 2)
    used = np.linalg.norm(result.calibration.xy - camera.values[2:4], axis=1).max()
    for panel in (axes, errors):
        panel.axvline(used, color=FAINT, linestyle=":", linewidth=1, label="outermost star")
        panel.set_xlabel("distance from the principal point, px")
    axes.axhline(0, color=FAINT, linewidth=0.8)
    curves = (
        ("radial", radial @ camera.values[4:7], error),
        ("decentering", f * r**2 * size, f * r**2 * size_error),
    )
    for colour, (label, value, own) in zip(COLOURS, curves, strict=False):
        band(axes, f * r, value, own, colour, label)
        errors.plot(f * r, own, color=colour, label=label)
    axes.set(ylabel="px", title="Distortion, with its mean error")
    errors.set(ylabel="px", title="Its mean error")
    axes.legend()
    return figure
