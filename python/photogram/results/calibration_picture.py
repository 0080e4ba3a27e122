"""Pictures of distortion, and of what other lens terms do (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from photogram.plots.distortion import side_by_side
from photogram.plots.placed import placed
from photogram.results.cameras import AdjustedCamera
from photogram.results.distortion import DistortionCurve, LensField, distortion_curve, lens_field
from photogram.results.picture_data import curves_of
from photogram.results.result import Result
from photogram.show.axes import Where, panels
from photogram.show.pictures import arrows, round_length
from photogram.show.sketch.declared import Sketch
from photogram.show.sketch.on_axes import on_axes
from photogram.show.style import BLUE, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_distortion(
    result: Result, camera: AdjustedCamera, path: Path | None = None, ax: Where = None
) -> NDArray[Any]:
    """Draw a camera's distortion: the curve, its balanced form, and the standard deviations of both.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.
    path, ax
        As of :func:`photogram.results.components_picture.draw_components`; axes for each panel.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`photogram.results.components_picture.draw_components`.
    ValueError
        The camera has no radial terms, or no images.
    """
    curve = distortion_curve(result, camera)
    if curve is None:
        raise ValueError(f"{camera.name} has no radial distortion to draw")
    return placed(partial(_distortion, camera, curve), path, ax)


def draw_lens_field(
    result: Result, camera: AdjustedCamera, path: Path | None = None, ax: Where = None
) -> Axes:
    """Draw what the terms beside the radial ones do, with their standard ellipses.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.
    path, ax
        As of :func:`photogram.results.components_picture.draw_components`.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`photogram.results.components_picture.draw_components`.
    ValueError
        The camera has no such terms, or no images.
    """
    field = lens_field(result, camera)
    if field is None:
        raise ValueError(f"{camera.name} has no terms beside the radial ones to draw")
    return placed(partial(_lens_field, camera, field), path, ax)


def _lens_field(camera: AdjustedCamera, field: LensField, ax: Where) -> Axes:
    from matplotlib.patches import Ellipse  # takes long to import

    unit = str(camera.camera.unit)
    factor, written = (1000.0, "µm") if unit == "mm" else (1.0, "px")
    with panels(ax, 1, 1, 7.0, 6.0) as [axes]:
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
            axes.add_patch(
                Ellipse(tuple(end), width, height, angle=angle, alpha=0.4, linewidth=0, color=BLUE)
            )
        axes.set_aspect("equal")
        axes.set_title(
            f"{', '.join(field.names)} of {camera.name}: a width of the grid is"
            f" {factor * scale * spacing:.3g} {written}"
        )
        axes.set_xlabel(f"x, {unit}")
        axes.set_ylabel(f"y, {unit}")
    return axes


def _distortion(camera: AdjustedCamera, curve: DistortionCurve, ax: Where) -> NDArray[Any]:
    curves = curves_of(camera, curve)
    sketch = Sketch(6.4, 7.5, side_by_side([curves]), shared=True)
    return np.atleast_1d(on_axes(sketch, ax))
