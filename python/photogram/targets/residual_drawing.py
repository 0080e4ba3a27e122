"""Pictures of residuals of corners: mean vectors on the board, and the views that fit worst."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Bools, Floats
from photogram.plots.placed import placed
from photogram.show.axes import Where, handed_out, panels, scale_bars
from photogram.show.pictures import arrows, round_length
from photogram.show.style import BLUE, FAINT, VERMILION
from photogram.targets.calibration_result import Calibrated
from photogram.targets.grouping import NOTABLE, mean_residuals
from photogram.targets.tables import view_rms

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_board_residuals", "draw_poorest_views"]

POOREST = 3
"""Views that are drawn."""
LONGEST, OUTLIER = 1.5, 3.0
"""Spacings of the points, of the longest vector; what one that is far longer takes of these."""


def draw_board_residuals(calibrated: Calibrated, path: Path | None = None, ax: Where = None) -> Any:
    """Draw the mean residual of each point of the board, in axes of the picture: errors of its print.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    path, ax
        As of :func:`photogram.targets.draw_uncertainty`.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`photogram.targets.draw_uncertainty`.
    """
    return placed(partial(_board, calibrated), path, ax)


def draw_poorest_views(calibrated: Calibrated, path: Path | None = None, ax: Where = None) -> Any:
    """Draw the residuals of the pictures of the three views that fit worst.

    Parameters
    ----------
    calibrated, path, ax
        As of :func:`draw_board_residuals`; three axes, fewer where there are fewer pictures.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`draw_board_residuals`.
    """
    return placed(partial(_poorest, calibrated), path, ax)


def _board(calibrated: Calibrated, ax: Where) -> Any:
    corners, places = calibrated.calibration.corners, calibrated.points
    mean, tests = mean_residuals(calibrated, corners.point[corners.use], len(places))
    seen = np.isfinite(mean).all(axis=1)
    marked = np.asarray((np.abs(tests) > NOTABLE).any(axis=1))
    unit = calibrated.calibration.board.unit
    low, high = places[seen].min(axis=0), places[seen].max(axis=0)
    extent = np.maximum(high - low, 1e-12)
    with panels(ax, 1, 1, 6.4, 1.4 + 5.2 * float(np.clip(extent[1] / extent[0], 0.4, 1.4))) as (axes,):
        axes.plot(*places[seen, :2].T, ".", color=FAINT, markersize=3.0)
        room = LONGEST * float(np.sqrt(extent[0] * extent[1] / seen.sum()))
        axes.set(xlim=(low[0] - room, high[0] + room), ylim=(high[1] + room, low[1] - room), aspect="equal")
        axes.set(xlabel=f"x of the board, {unit}", ylabel=f"y of the board, {unit}")
        title = "Mean residual of each point of the board; red: hardly by chance"
        _with_scale(axes, places[seen, :2], mean[seen], marked[seen], room, title)
    return handed_out([axes])


def _poorest(calibrated: Calibrated, ax: Where) -> Any:
    corners, result = calibrated.calibration.corners, calibrated.result
    picture = corners.picture[corners.use]
    rms = view_rms(picture, result.residuals, len(corners.pictures))
    worst = np.argsort(-np.nan_to_num(rms), kind="stable")[:POOREST].tolist()
    with panels(ax, 1, len(worst), 4.4 * len(worst), 4.2) as found:
        for axes, each in zip(found, worst, strict=True):
            own = picture == each
            xy, residuals = result.block.image_xy[own], result.residuals[own]
            size = corners.sizes[corners.cameras[each]] or tuple((xy.max(axis=0) + 1).tolist())
            axes.plot(*xy.T, ".", color=FAINT, markersize=3.0)
            axes.set(xlim=(-0.5, size[0] - 0.5), ylim=(size[1] - 0.5, -0.5), aspect="equal")
            axes.set(xlabel="column, px", ylabel="row, px")
            room = LONGEST * float(np.sqrt(np.prod(np.ptp(xy, axis=0)) / len(xy)))
            tests = np.nan_to_num(result.standardized[own]) / np.sqrt(result.covariance_scale)
            large = (np.abs(tests) > NOTABLE).any(axis=1)
            title = f"{corners.pictures[each]}, rms {rms[each]:.2g} px"
            _with_scale(axes, xy, residuals, large, room, title)
    return handed_out(found)


def _with_scale(axes: Axes, places: Floats, vectors: Floats, marked: Bools, room: float, title: str) -> None:
    """Draw vectors whose longest takes some room, those that are marked in colour, and their scale."""
    limits = axes.get_xlim(), axes.get_ylim()
    lengths = np.hypot(*vectors.T)
    # One that is far longer than the others is not to hide them.
    longest = float(max(lengths.max() / OUTLIER, min(lengths.max(), 4 * np.quantile(lengths, 0.9)))) or 1.0
    scale = longest / room
    for which, colour in ((~marked, BLUE), (marked, VERMILION)):
        if which.any():
            arrows(axes, places[which], vectors[which], scale=scale, color=colour, width=0.004)
    axes.set(xlim=limits[0], ylim=limits[1])
    length = round_length(longest)
    scale_bars(axes, [(length / scale, BLUE, f"{length:g} px")], title)


check_arguments(globals(), __all__)
