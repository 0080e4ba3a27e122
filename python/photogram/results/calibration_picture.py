"""Pictures of distortion, and of what other lens terms do (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.io.writing import write_whole
from photogram.results.cameras import AdjustedCamera
from photogram.results.distortion import DistortionCurve, distortion_curve
from photogram.results.lens_field import LensField, lens_field
from photogram.results.result import Result
from photogram.show.pictures import arrows, drawn, new_figure, open_frame, round_length

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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


def figure_of_lens_field(camera: AdjustedCamera, field: LensField) -> Figure:
    """Return vectors on a grid of the image with their standard ellipses, all enlarged alike."""
    from matplotlib.patches import Ellipse  # takes long to import

    unit = str(camera.camera.unit)
    factor, written = (1000.0, "um") if unit == "mm" else (1.0, "px")
    figure = new_figure(7.0, 6.0)
    axes = figure.subplots()
    longest = float(np.hypot(*field.vectors.T).max())
    spacing = float(np.ptp(field.positions[:, 0])) / 8
    scale = round_length(longest) / spacing if longest > 0 else 1.0
    arrows(axes, field.positions, field.vectors, scale, color="black", width=0.003)
    for end, covariance in zip(
        field.positions + field.vectors / scale, field.covariances / scale**2, strict=True
    ):
        variances, axis = np.linalg.eigh(covariance)
        width, height = 2 * np.sqrt(np.maximum(variances, 0.0))
        angle = np.degrees(np.arctan2(axis[1, 0], axis[0, 0]))
        axes.add_patch(Ellipse(tuple(end), width, height, angle=angle, alpha=0.4, linewidth=0))
    axes.set_aspect("equal")
    axes.set_title(
        f"{', '.join(field.names)} of {camera.name}: a width of the grid is"
        f" {factor * scale * spacing:.3g} {written}",
        loc="left",
        fontsize="medium",
    )
    axes.set_xlabel(f"x, {unit}")
    axes.set_ylabel(f"y, {unit}")
    open_frame(axes)
    return figure


def figure_of_distortion(camera: AdjustedCamera, curve: DistortionCurve) -> Figure:
    """Return the curve and its balanced form, one standard deviation on either side, dashed beyond images."""
    unit = str(camera.camera.unit)
    factor, written = (1000.0, "um") if unit == "mm" else (1.0, "px")
    figure = new_figure(7.0, 8.0)
    upper, lower, bands = figure.subplots(3, 1, sharex=True)
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
    # Bands are thin on curves of hundreds of micrometres: once more by themselves.
    for name, sd in (
        ("mapping", curve.sd_mapping),
        ("curve", curve.sd),
        ("balanced curve", curve.sd_balanced),
    ):
        seen = curve.radii <= curve.observed
        [line] = bands.plot(curve.radii[seen], factor * sd[seen], label=f"sd of the {name}")
        bands.plot(curve.radii[~seen], factor * sd[~seen], color=line.get_color(), linestyle="--")
    bands.set_ylim(bottom=0.0)
    bands.set_xlabel(f"radius, {unit}")
    for axes in (upper, lower, bands):
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
