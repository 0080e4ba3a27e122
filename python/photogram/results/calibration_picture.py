"""Pictures of distortion, and of what other lens terms do (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.io.writing import write_whole
from photogram.plots.distortion import draw_curves, rows_of
from photogram.results.cameras import AdjustedCamera
from photogram.results.distortion import DistortionCurve, distortion_curve
from photogram.results.lens_field import LensField, lens_field
from photogram.results.pictured import curves_of
from photogram.results.result import Result
from photogram.show.pictures import arrows, drawn, new_figure, round_length
from photogram.show.style import BLUE, INK, in_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_distortion", "draw_lens_field", "figure_of_distortion", "figure_of_lens_field"]


def draw_distortion(result: Result, camera: AdjustedCamera, path: Path) -> None:
    """Write the picture of a camera's distortion curve, in the format that the name of the file asks for.

    Raises
    ------
    InputError
        A suffix that names no format.
    ValueError
        The camera has no radial terms, or no images.
    """
    curve = distortion_curve(result, camera)
    if curve is None:
        raise ValueError(f"{camera.name} has no radial distortion to draw")
    write_whole({path: drawn(figure_of_distortion(camera, curve), path)})


def draw_lens_field(result: Result, camera: AdjustedCamera, path: Path) -> None:
    """Write the picture of what the terms beside the radial ones do, in the format that the name asks for.

    Raises
    ------
    InputError
        A suffix that names no format.
    ValueError
        The camera has no such terms, or no images.
    """
    field = lens_field(result, camera)
    if field is None:
        raise ValueError(f"{camera.name} has no terms beside the radial ones to draw")
    write_whole({path: drawn(figure_of_lens_field(camera, field), path)})


@in_style
def figure_of_lens_field(camera: AdjustedCamera, field: LensField) -> Figure:
    """Return vectors on a grid of the image with their standard ellipses, all enlarged alike."""
    from matplotlib.patches import Ellipse  # takes long to import

    unit = str(camera.camera.unit)
    factor, written = (1000.0, "µm") if unit == "mm" else (1.0, "px")
    figure = new_figure(7.0, 6.0)
    axes = figure.subplots()
    longest = float(np.hypot(*field.vectors.T).max())
    spacing = float(np.ptp(field.positions[:, 0])) / 8
    scale = round_length(longest) / spacing if longest > 0 else 1.0
    arrows(axes, field.positions, field.vectors, scale, color=INK, width=0.003)
    for end, covariance in zip(
        field.positions + field.vectors / scale, field.covariances / scale**2, strict=True
    ):
        variances, axis = np.linalg.eigh(covariance)
        width, height = 2 * np.sqrt(np.maximum(variances, 0.0))
        angle = np.degrees(np.arctan2(axis[1, 0], axis[0, 0]))
        axes.add_patch(Ellipse(tuple(end), width, height, angle=angle, alpha=0.4, linewidth=0, color=BLUE))
    axes.set_aspect("equal")
    axes.set_title(
        f"{', '.join(field.names)} of {camera.name}: a width of the grid is"
        f" {factor * scale * spacing:.3g} {written}"
    )
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    return figure


@in_style
def figure_of_distortion(camera: AdjustedCamera, curve: DistortionCurve) -> Figure:
    """Return the curve and its balanced form, one standard deviation on either side, dashed beyond images."""
    curves = curves_of(camera, curve)
    figure = new_figure(6.4, 7.5)
    panels = figure.subplots(rows_of(curves), 1, sharex=True)
    draw_curves(panels.tolist(), curves)
    return figure
