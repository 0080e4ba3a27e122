"""Pictures of distortion, and of what other lens terms do (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

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
from photogram.show.axes import Where
from photogram.show.pictures import round_length
from photogram.show.sketch.declared import Panel, Sketch, around
from photogram.show.sketch.marks import Arrows, Ellipses, ellipse_axes
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
        As of :func:`photogram.results.draw_components`; axes for each panel.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`photogram.results.draw_components`.
    ValueError
        The camera has no radial terms, or no images.
    """
    curve = distortion_curve(result, camera)
    if curve is None:
        raise ValueError(f"{camera.name} has no radial distortion to draw")
    return np.atleast_1d(placed(_distortion(camera, curve), path, ax))


def draw_lens_field(
    result: Result, camera: AdjustedCamera, path: Path | None = None, ax: Where = None
) -> Axes:
    """Draw what the terms beside the radial ones do, with their standard ellipses.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.
    path, ax
        As of :func:`photogram.results.draw_components`.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`photogram.results.draw_components`.
    ValueError
        The camera has no such terms, or no images.
    """
    field = lens_field(result, camera)
    if field is None:
        raise ValueError(f"{camera.name} has no terms beside the radial ones to draw")
    axes: Axes = placed(_lens_field(camera, field), path, ax)
    return axes


def _lens_field(camera: AdjustedCamera, field: LensField) -> Sketch:
    unit = str(camera.camera.unit)
    factor, written = (1000.0, "µm") if unit == "mm" else (1.0, "px")
    longest = float(np.hypot(*field.vectors.T).max())
    spacing = float(np.ptp(field.positions[:, 0])) / 8
    scale = round_length(longest) / spacing if longest > 0 else 1.0
    ends = field.positions + field.vectors / scale
    semi_axes, angles = ellipse_axes(field.covariances / scale**2)
    marks = [
        Ellipses(ends, semi_axes, angles, BLUE, 0.0, 0.4, layer=1.0),
        Arrows(field.positions, field.vectors / scale, INK, 0.003),
    ]
    reach = float(semi_axes.max(initial=0.0))
    limits = around(np.vstack([field.positions, ends - reach, ends + reach]), 0.05)
    title = (
        f"{', '.join(field.names)} of {camera.name}: a width of the grid is"
        f" {factor * scale * spacing:.3g} {written}"
    )
    return Sketch(7.0, 6.0, [Panel(limits, marks, title, f"x, {unit}", f"y, {unit}", equal=True)])


def _distortion(camera: AdjustedCamera, curve: DistortionCurve) -> Sketch:
    return Sketch(6.4, 7.5, side_by_side([curves_of(camera, curve)]), shared=True)
