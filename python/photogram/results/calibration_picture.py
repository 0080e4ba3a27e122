"""Plots of the distortion of a camera, and of its other lens terms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import InputError
from photogram.plots.distortion import side_by_side
from photogram.results.cameras import AdjustedCamera
from photogram.results.distortion import distortion_curve, lens_field
from photogram.results.picture_data import curves_of
from photogram.show.sketch.marks import Arrows, Ellipses, Panel, around, ellipse_axes
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, INK, round_length
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result


def plot_distortion(result: Result, camera: AdjustedCamera) -> Plot:
    """Plot a camera's distortion: the curve, its balanced form, and the standard deviations of both.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.

    Raises
    ------
    InputError
        The camera has no radial terms, or no images.
    """
    curve = distortion_curve(result, camera)
    if curve is None:
        raise InputError(phrase("plot.distortion"))
    return Plot(6.4, 7.5, side_by_side([curves_of(camera, curve)]), shared=True)


def plot_lens_field(result: Result, camera: AdjustedCamera) -> Plot:
    """Plot the displacements by all lens terms except the radial ones, with their standard ellipses.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.

    Raises
    ------
    InputError
        The camera has no such terms, or no images.
    """
    field = lens_field(result, camera)
    if field is None:
        raise InputError(phrase("plot.lens-field", camera=camera.name))
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
    return Plot(7.0, 6.0, [Panel(limits, marks, title, f"x, {unit}", f"y, {unit}", equal=True)])
