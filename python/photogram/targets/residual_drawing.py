"""Pictures of residuals of corners: mean vectors on the board, and the views that fit worst."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import replace
from photogram.show.pictures import round_length
from photogram.show.sketch.declared import Panel
from photogram.show.sketch.marks import Arrows, Mark, Markers
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, VERMILION
from photogram.targets.drawing import in_pixels
from photogram.targets.grouping import CRITICAL_TEST_VALUE, mean_residuals
from photogram.targets.tables import view_rms

if TYPE_CHECKING:
    from photogram.targets import Calibrated

__all__ = ["plot_board_residuals", "plot_poorest_views"]

VIEWS_DRAWN = 3
MAX_VECTOR, OUTLIER_FACTOR = 1.5, 3.0  # spacings of the points; times that of a vector far longer than others


def plot_board_residuals(calibrated: Calibrated) -> Plot:
    """Plot the mean residual of each point of the board, in axes of the picture: errors of its print.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    """
    corners, places = calibrated.calibration.corners, calibrated.points
    mean, tests = mean_residuals(calibrated, corners.point[corners.use], len(places))
    seen = np.isfinite(mean).all(axis=1)
    marked = np.asarray((np.abs(tests) > CRITICAL_TEST_VALUE).any(axis=1))
    unit = calibrated.calibration.board.unit
    low, high = places[seen, :2].min(axis=0), places[seen, :2].max(axis=0)
    extent = np.maximum(high - low, 1e-12)
    room = MAX_VECTOR * float(np.sqrt(extent[0] * extent[1] / seen.sum()))
    limits = np.array([[low[0] - room, high[1] + room], [high[0] + room, low[1] - room]])
    title = "Mean residual of each point of the board; red: hardly by chance"
    plan = Panel(limits, (), title, f"x of the board, {unit}", f"y of the board, {unit}", equal=True)
    height = 1.4 + 5.2 * float(np.clip(extent[1] / extent[0], 0.4, 1.4))
    return Plot(6.4, height, [_with_vectors(plan, places[seen, :2], mean[seen], marked[seen], room)])


def plot_poorest_views(calibrated: Calibrated) -> Plot:
    """Plot the residuals of the pictures of the three views that fit worst.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    """
    corners, result = calibrated.calibration.corners, calibrated.result
    picture = corners.picture[corners.use]
    rms = view_rms(picture, result.residuals, len(corners.pictures))
    worst = np.argsort(-np.nan_to_num(rms), kind="stable")[:VIEWS_DRAWN].tolist()
    panels = []
    for each in worst:
        own = picture == each
        xy, residuals = result.block.image_xy[own], result.residuals[own]
        size = corners.sizes[corners.cameras[each]] or tuple((xy.max(axis=0) + 1).tolist())
        room = MAX_VECTOR * float(np.sqrt(np.prod(np.ptp(xy, axis=0)) / len(xy)))
        tests = np.nan_to_num(result.standardized[own]) / np.sqrt(result.covariance_scale)
        large = (np.abs(tests) > CRITICAL_TEST_VALUE).any(axis=1)
        view = replace(in_pixels(size), title=f"{corners.pictures[each]}, rms {rms[each]:.2g} px")
        panels.append(_with_vectors(view, xy, residuals, large, room))
    return Plot(4.4 * len(worst), 4.2, panels, len(worst))


def _with_vectors(panel: Panel, places: Floats, vectors: Floats, marked: Bools, room: float) -> Panel:
    """Return a panel with vectors whose longest takes some room, in colour where marked, and their scale."""
    lengths = np.hypot(*vectors.T)
    # One that is far longer than the others is not to hide them.
    longest = (
        float(max(lengths.max() / OUTLIER_FACTOR, min(lengths.max(), 4 * np.quantile(lengths, 0.9)))) or 1.0
    )
    scale, length = room / longest, round_length(longest)
    arrows: list[Mark] = [
        Arrows(places[which], scale * vectors[which], colour, 0.004)
        for which, colour in ((~marked, BLUE), (marked, VERMILION))
        if which.any()
    ]
    dots = Markers(places, ".", 3.0, FAINT)
    return replace(panel, marks=[dots, *arrows], bars=[(scale * length, BLUE, f"{length:g} px")])


check_arguments(globals(), __all__)
