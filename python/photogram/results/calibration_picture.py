"""The picture of a distortion curve; matplotlib is an extra (`pip install 'photogram[plots]'`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.results.cameras import AdjustedCamera
from photogram.results.distortion import DistortionCurve, distortion_curve
from photogram.results.result import Result
from photogram.show.pictures import drawn, new_figure, open_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_distortion", "figure_of_distortion"]


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
    path.write_bytes(drawn(figure_of_distortion(camera, curve), path))


def figure_of_distortion(camera: AdjustedCamera, curve: DistortionCurve) -> Figure:
    """Return the curve and its balanced form, one standard deviation on either side, dashed beyond images."""
    unit = str(camera.camera.unit)
    factor, written = (1000.0, "um") if unit == "mm" else (1.0, "px")
    figure = new_figure(7.0, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    _draw(upper, curve, factor, curve.values, {"mapping": curve.sd_mapping, "curve": curve.sd})
    _draw(lower, curve, factor, curve.balanced, {"balanced curve": curve.sd_balanced})
    upper.set_title(
        f"Radial distortion of {camera.name} ({camera.camera.model}, {curve.direction})", loc="left"
    )
    lower.set_title(
        f"balanced at {curve.balanced_at:.4g} {unit}: principal distance"
        f" {curve.balanced_distance:.6g} {unit}",
        loc="left",
        fontsize="medium",
    )
    lower.set_xlabel(f"radius, {unit}")
    for axes in (upper, lower):
        axes.set_ylabel(written)
        axes.legend(frameon=False)
        open_frame(axes)
    return figure


def _draw(
    axes: Axes,
    curve: DistortionCurve,
    factor: float,
    values: np.ndarray[tuple[int], np.dtype[np.float64]],
    bands: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]],
) -> None:
    seen = curve.radii <= curve.observed
    for name, sd in bands.items():
        low, high = factor * (values - sd), factor * (values + sd)
        axes.fill_between(curve.radii, low, high, alpha=0.3, label=f"+-sd of the {name}", linewidth=0)
    axes.plot(curve.radii[seen], factor * values[seen], color="black")
    axes.plot(curve.radii[~seen], factor * values[~seen], color="black", linestyle="--")
    axes.axhline(0.0, color="grey", linewidth=0.5)
