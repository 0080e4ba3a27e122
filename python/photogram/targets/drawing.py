"""Plots of calibration uncertainty and calibration differences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import replace
from photogram.show.sketch.marks import Arrows, Line, Mark, Markers, Panel, Shades, contours
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, INK, VERMILION, round_length
from photogram.targets.grouping import CRITICAL_TEST_VALUE, group_statistics, outlying_images
from photogram.targets.uncertainty import UncertaintyCurve, UncertaintyMap, at_distance

if TYPE_CHECKING:
    from photogram.targets import Calibrated, CrossValidation
    from photogram.targets.calibration_difference import CameraDifference


MAX_DOTS = 4000  # plotted corners
ARROWS_ALONG_PICTURE = 24
WIDTH_INCHES = 7.6
COLOURS_PER_CONTOUR = 4


def steps_of_125(low: float, high: float) -> Floats:
    """Return values 1, 2, 5 times powers of ten that enclose two positive numbers."""
    start = round_length(low)
    powers = np.arange(math.floor(math.log10(start)), math.floor(math.log10(high)) + 2)
    steps = np.concatenate([np.array([1.0, 2.0, 5.0]) * 10.0**power for power in powers])
    above = np.flatnonzero(steps > high)
    return np.asarray(steps[(steps >= start * (1 - 1e-9)) & (np.arange(len(steps)) <= above[0])])


def plot_uncertainty(found: UncertaintyMap) -> Plot:
    """Plot a projection-uncertainty map with contours, corners and their hull.

    Parameters
    ----------
    found
        Uncertainty map.
    """
    marks, coverage = _known(found), found.coverage
    if len(found.corners):
        step = -(-len(found.corners) // MAX_DOTS)
        marks += [
            Markers(found.corners[::step], ".", 2.5, "white", edge=0.0, opacity=0.6),
            Line(np.vstack([coverage, coverage[:1]]), VERMILION, 1.2),
        ]
    panel = _map(found, found.sd, "px", marks)
    title = found.title + "\n" + found.model.replace("; ", "\n")
    return Plot(WIDTH_INCHES, _height(found.size), [replace(panel, title=title)])


def plot_uncertainty_curve(found: UncertaintyCurve) -> Plot:
    """Plot projection uncertainty of a pixel against distance, with its minimum.

    Parameters
    ----------
    found
        Uncertainty curve. A value at infinity is drawn as a horizontal line.
    """
    away = np.isfinite(found.distances)
    order = np.argsort(found.distances[away])
    distance, sd = found.minimum
    places = np.column_stack([found.distances[away][order], found.sd[away][order]])
    across = np.array([places[:, 0].min() / 1.1, places[:, 0].max() * 1.1])
    up = np.array([found.sd.min() / 1.1, found.sd.max() * 1.1])
    marks: list[Mark] = [Line(places, BLUE)]
    for each in found.sd[~away].tolist():
        line = np.column_stack([across, np.full(2, each)])
        marks.append(Line(line, INK, 0.9, "--", label=f"at infinity {each:.2g} px"))
    if math.isfinite(distance):
        least = f"least {sd:.2g} px {at_distance(float(f'{distance:.3g}'), found.unit)}"
        marks.append(Markers(np.array([[distance, sd]]), "o", 6.0, VERMILION, VERMILION, label=least))
    column, row = found.pixel
    title = (
        f"{found.camera}: standard deviation of projection at column {column:g}, row {row:g}"
        f" (datum {found.datum})"
    )
    panel = Panel(
        np.column_stack([across, up]),
        marks,
        title,
        f"distance from the camera, {found.unit}",
        "px",
        legend="below",
        log_across=True,
        log_up=True,
    )
    return Plot(WIDTH_INCHES, 0.6 * WIDTH_INCHES, [panel])


def plot_difference(found: CameraDifference) -> Plot:
    """Plot the difference of two calibrations as contours and vectors.

    There is one panel per distance.

    Parameters
    ----------
    found
        The difference.
    """
    names, chi2, panels = f"{found.cameras[1]} less {found.cameras[0]}", found.chi2, list[Panel]()
    for number, distance in enumerate(found.distances):
        title = f"{names} {at_distance(distance, found.unit)}, px"
        panels += _apart(found, found.vectors[number], None if chi2 is None else chi2[number], title)
    rows = len(found.distances)
    columns = len(panels) // rows
    panels[-columns] = replace(panels[-columns], notes=found.remarks)
    return Plot(WIDTH_INCHES * columns, rows * _height(found.size), panels, columns)


def plot_cross_validation(cross: CrossValidation, over: UncertaintyMap) -> Plot:
    """Plot the difference of two subsets, also relative to its covariance.

    Parameters
    ----------
    cross
        The cross-validation.
    over
        Uncertainty map that defines camera, grid and distance.
    """
    found = cross.map(cross.cameras.index(over.camera), over.pixels.reshape(-1, 2), over.distance)
    shape, away = over.sd.shape, at_distance(over.distance, over.unit)
    title = f"{over.camera}: second part of the views less the first, {away}, px"
    panels = _apart(over, found.differences.reshape(*shape, 2), found.chi2.reshape(shape) / 2, title)
    panels[0] = replace(panels[0], notes=[cross.verdict])
    return Plot(2 * WIDTH_INCHES, _height(over.size), panels, 2)


def _apart(
    over: UncertaintyMap | CameraDifference, vectors: Floats, chi2: Floats | None, title: str
) -> list[Panel]:
    """Return panels of (h, w, 2) differences over an image, and of their ratio to the covariances, if known.

    Lengths are contours, and vectors are scaled to their spacing.
    """
    lengths = np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))
    step = max(1, round(len(over.columns) / ARROWS_ALONG_PICTURE))
    every = (slice(None, None, step), slice(None, None, step))
    places = np.stack(np.meshgrid(over.columns, over.rows), axis=-1)[every].reshape(-1, 2)
    largest = float(np.fmax.reduce(lengths[over.inside], initial=0.0)) or 1.0
    known = lengths[every].ravel() <= 2 * largest
    scale = step * (over.columns[1] - over.columns[0]) / largest
    arrows = Arrows(places[known], scale * vectors[every].reshape(-1, 2)[known], BLUE, 0.002)
    panels = [replace(_map(over, lengths, "px", [arrows]), title=title)]
    if chi2 is not None:
        beside = "beside its covariance: d' Q⁻¹ d / 2, about 1 where that explains it"
        panels.append(replace(_map(over, chi2, "", lowest=0.1), title=beside))
    return panels


def _height(size: tuple[int, int]) -> float:
    return 1.1 + 0.82 * WIDTH_INCHES * size[1] / size[0]


def _map(
    over: UncertaintyMap | CameraDifference,
    values: Floats,
    unit: str,
    marks: Sequence[Mark] = (),
    lowest: float = 0.01,
) -> Panel:
    """Return filled contours at 1, 2, 5 steps below other marks."""
    panel = in_pixels(over.size)
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return replace(panel, marks=marks)
    high = float(positive.max())
    levels = steps_of_125(max(float(positive.min()), lowest * high), high)
    shades = Shades(float(levels[0]), float(levels[-1]), unit, log=True)
    shown = np.where(values > 0, values, np.nan)
    areas = contours(over.columns, over.rows, shown, levels, shades, steps=COLOURS_PER_CONTOUR)
    return replace(panel, marks=[*areas, *marks], shades=shades)


def _known(found: UncertaintyMap) -> list[Mark]:
    known = np.isfinite(found.sd)
    if known.all() or not known.any():
        return []
    half = np.array([found.columns[1] - found.columns[0], found.rows[1] - found.rows[0]]) / 2
    ends = []
    for right, up in ((1, 0), (0, 1)):
        at = np.argwhere(known[up:, right:] != known[: -up or None, : -right or None])[:, ::-1]
        middle = np.column_stack([found.columns[at[:, 0]], found.rows[at[:, 1]]]) + half * [right, up]
        along = half * [1 - right, 1 - up]
        ends.append(np.stack([middle - along, middle + along], axis=1))
    return [Line(np.concatenate(ends), INK, 0.9, "--")]


def in_pixels(size: tuple[int, int]) -> Panel:
    limits = np.array([[-0.5, size[1] - 0.5], [size[0] - 0.5, -0.5]])
    return Panel(limits, across="column, px", up="row, px", equal=True)


VIEWS_DRAWN = 3
MAX_VECTOR, OUTLIER_FACTOR = 1.5, 3.0  # in point spacings; multiple of the length limit of other vectors


def plot_board_residuals(calibrated: Calibrated) -> Plot:
    """Plot the mean residual of each board point in image axes: printing errors.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    """
    corners, places = calibrated.calibration.corners, calibrated.points
    found = group_statistics(calibrated, corners.point[corners.use], len(places))
    mean, seen = found.mean, np.isfinite(found.mean).all(axis=1)
    marked = np.asarray((np.abs(found.tests) > CRITICAL_TEST_VALUE).any(axis=1))
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
    """Plot the residuals of the images of the three views that fit worst.

    Parameters
    ----------
    calibrated
        The adjusted calibration.
    """
    corners, result = calibrated.calibration.corners, calibrated
    picture = corners.picture[corners.use]
    rms = group_statistics(result, picture, len(corners.pictures)).rms
    worst = np.argsort(-np.nan_to_num(rms), kind="stable")[:VIEWS_DRAWN].tolist()
    panels, outliers = [], outlying_images(calibrated)
    for each in worst:
        own = picture == each
        xy, residuals = result.block.image_xy[own], result.residuals[own]
        size = corners.sizes[corners.cameras[each]] or tuple((xy.max(axis=0) + 1).tolist())
        room = MAX_VECTOR * float(np.sqrt(np.prod(np.ptp(xy, axis=0)) / len(xy)))
        view = replace(in_pixels(size), title=f"{corners.pictures[each]}, rms {rms[each]:.2g} px")
        panels.append(_with_vectors(view, xy, residuals, outliers[own], room))
    return Plot(4.4 * len(worst), 4.2, panels, len(worst))


def _with_vectors(panel: Panel, places: Floats, vectors: Floats, marked: Bools, room: float) -> Panel:
    lengths = np.hypot(*vectors.T)
    # A single far longer vector must not hide the others.
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
