"""Pictures of what calibrations are worth (needs `pip install 'photogram[plots]'`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.plots.placed import placed
from photogram.show.axes import Where, handed_out, note, panels
from photogram.show.pictures import arrows, round_length
from photogram.show.style import BLUE, INK, ORDERED, VERMILION
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.cross_validation import CrossValidation
from photogram.targets.maps import UncertaintyCurve, UncertaintyMap, distance_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

__all__ = [
    "draw_cross_validation",
    "draw_difference",
    "draw_uncertainty",
    "draw_uncertainty_curve",
    "in_pixels",
    "steps_of_125",
]

DOTS = 4000
"""Corners that are drawn: of more every so many-th."""
ARROWS = 24
"""Vectors along the longer side of a picture."""
WIDTH = 7.6
"""Inches."""
ROOM = 20.0
"""Points from the middle of a label of a contour to that of the next one."""
SHADES = 4
"""Of colour from one contour to the next."""


def draw_uncertainty(found: UncertaintyMap, path: Path | None = None, ax: Where = None) -> Any:
    """Draw a map of the uncertainty of projection: contours, the corners that were seen and their hull.

    Parameters
    ----------
    found
        The map.
    path
        Of a file for the picture, in the format that its suffix names; None: none is written.
    ax
        Axes, or a figure to put them in; a new figure when None.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        A suffix that names no format.
    ModuleNotFoundError
        matplotlib is absent.
    """
    return placed(partial(_uncertainty, found), path, ax)


def draw_uncertainty_curve(found: UncertaintyCurve, path: Path | None = None, ax: Where = None) -> Any:
    """Draw the uncertainty of projection of a pixel against distance, its minimum marked.

    Parameters
    ----------
    found
        The curve; where it has a value at infinity this is a line across.
    path, ax
        As of :func:`draw_uncertainty`.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`draw_uncertainty`.
    """
    return placed(partial(_curve, found), path, ax)


def draw_difference(found: CameraDifference, path: Path | None = None, ax: Where = None) -> Any:
    """Draw the difference of two calibrations: its length as contours, its vectors; a panel each distance.

    Parameters
    ----------
    found
        The difference.
    path, ax
        As of :func:`draw_uncertainty`; as many axes as there are distances, and as many more where it is
        drawn beside what the uncertainties explain.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`draw_uncertainty`.
    """
    return placed(partial(_difference, found), path, ax)


def draw_cross_validation(
    cross: CrossValidation, over: UncertaintyMap, path: Path | None = None, ax: Where = None
) -> Any:
    """Draw how the first two parts of a cross-validation differ, and that beside its covariance.

    Parameters
    ----------
    cross
        The cross-validation.
    over
        A map of the camera, whose grid and distance it is drawn at.
    path, ax
        As of :func:`draw_uncertainty`; two axes.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError, ModuleNotFoundError
        As of :func:`draw_uncertainty`.
    """
    return placed(partial(_cross_validation, cross, over), path, ax)


def steps_of_125(low: float, high: float) -> Floats:
    """Return values 1, 2, 5 times powers of ten that enclose what lies between two positive numbers."""
    start = round_length(low)
    powers = np.arange(math.floor(math.log10(start)), math.floor(math.log10(high)) + 2)
    steps = np.concatenate([np.array([1.0, 2.0, 5.0]) * 10.0**power for power in powers])
    above = np.flatnonzero(steps > high)
    return np.asarray(steps[(steps >= start * (1 - 1e-9)) & (np.arange(len(steps)) <= above[0])])


def _uncertainty(found: UncertaintyMap, ax: Where) -> Any:
    with panels(ax, 1, 1, WIDTH, _height(found.size)) as (axes,):
        in_pixels(axes, found.size)
        _contours(axes, found.columns, found.rows, found.sd, "px")
        _known(axes, found)
        _seen(axes, found.corners, found.coverage)
        said = found.model.replace("; ", "\n")
        axes.set_title(f"{found.title}\n{said}", fontsize=9.0)
    return handed_out([axes])


def _curve(found: UncertaintyCurve, ax: Where) -> Any:
    from matplotlib.ticker import LogLocator

    away = np.isfinite(found.distances)
    order = np.argsort(found.distances[away])
    distance, sd = found.minimum
    with panels(ax, 1, 1, WIDTH, 0.6 * WIDTH) as (axes,):
        axes.loglog(found.distances[away][order], found.sd[away][order], color=BLUE)
        for each in found.sd[~away]:
            axes.axhline(
                each, color=INK, linewidth=0.9, linestyle="dashed", label=f"at infinity {each:.2g} px"
            )
        if math.isfinite(distance):
            least = f"least {sd:.2g} px {distance_text(float(f'{distance:.3g}'), found.unit)}"
            axes.plot(distance, sd, "o", color=VERMILION, label=least)
        axes.set(xlabel=f"distance from the camera, {found.unit}", ylabel="px")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("{x:g}")
        axes.legend(fontsize=8.0)
        column, row = found.pixel
        axes.set_title(
            f"{found.camera}: standard deviation of projection at column {column:g}, row {row:g}"
            f" (datum {found.datum})",
            fontsize=9.0,
        )
    return handed_out([axes])


def _known(axes: Axes, found: UncertaintyMap) -> None:
    """Draw where what is known of the lens ends, such as the knots of splines."""
    known = np.isfinite(found.sd)
    if known.any() and not known.all():
        axes.contour(
            found.columns,
            found.rows,
            known.astype(float),
            [0.5],
            colors=INK,
            linewidths=0.9,
            linestyles="dashed",
        )


def _difference(found: CameraDifference, ax: Where) -> Any:
    chi2 = found.chi2
    rows = len(found.distances)
    columns = 1 if chi2 is None else 2
    names = f"{found.cameras[1]} less {found.cameras[0]}"
    with panels(ax, rows, columns, WIDTH * columns, rows * _height(found.size)) as axes:
        for number, distance in enumerate(found.distances):
            own = _Apart(found.size, found.columns, found.rows, found.vectors[number], found.inside)
            own.draw(axes[number * columns], f"{names} {distance_text(distance, found.unit)}, px")
            if chi2 is not None:
                own.beside(axes[number * columns + 1], chi2[number])
        note(axes[-columns], found.remarks)
    return handed_out(axes)


def _cross_validation(cross: CrossValidation, over: UncertaintyMap, ax: Where) -> Any:
    found = cross.map(cross.cameras.index(over.camera), over.pixels.reshape(-1, 2), over.distance)
    shape = over.sd.shape
    own = _Apart(over.size, over.columns, over.rows, found.differences.reshape(*shape, 2), over.inside)
    with panels(ax, 1, 2, 2 * WIDTH, _height(over.size)) as (left, right):
        away = distance_text(over.distance, over.unit)
        own.draw(left, f"{over.camera}: second part of the views less the first, {away}, px")
        own.beside(right, found.chi2.reshape(shape) / 2)
        note(left, [cross.verdict])
    return handed_out([left, right])


@dataclass(frozen=True, eq=False)
class _Apart:
    """Differences over a picture: (h, w, 2) vectors, and (h, w) where their lengths set the scale."""

    size: tuple[int, int]
    columns: Floats
    rows: Floats
    vectors: Floats
    inside: Bools

    @property
    def lengths(self) -> Floats:
        return np.asarray(np.hypot(self.vectors[..., 0], self.vectors[..., 1]))

    def draw(self, axes: Axes, title: str) -> None:
        """Draw lengths as contours, and some of the vectors, the longest as long as they are apart."""
        in_pixels(axes, self.size)
        _contours(axes, self.columns, self.rows, self.lengths, "px")
        step = max(1, round(len(self.columns) / ARROWS))
        every = (slice(None, None, step), slice(None, None, step))
        places = np.stack(np.meshgrid(self.columns, self.rows), axis=-1)[every].reshape(-1, 2)
        vectors = self.vectors[every].reshape(-1, 2)
        largest = float(np.fmax.reduce(self.lengths[self.inside], initial=0.0)) or 1.0
        known = np.hypot(*vectors.T) <= 2 * largest
        spacing = step * (self.columns[1] - self.columns[0])
        arrows(axes, places[known], vectors[known], scale=largest / spacing, color=BLUE, width=0.002)
        axes.set_title(title, fontsize=9.0)

    def beside(self, axes: Axes, chi2: Floats) -> None:
        """Draw what they are beside their covariances."""
        in_pixels(axes, self.size)
        _contours(axes, self.columns, self.rows, chi2, "", lowest=0.1)
        axes.set_title("beside its covariance: d' Q⁻¹ d / 2, about 1 where that explains it", fontsize=9.0)


def _height(size: tuple[int, int]) -> float:
    return 1.1 + 0.82 * WIDTH * size[1] / size[0]


def _contours(
    axes: Axes, columns: Floats, rows: Floats, values: Floats, unit: str, lowest: float = 0.01
) -> None:
    """Draw filled contours at 1, 2, 5 steps with their values on the lines, from a share of the largest."""
    from matplotlib.colors import LogNorm
    from matplotlib.patheffects import withStroke

    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return
    high = float(positive.max())
    levels = steps_of_125(max(float(positive.min()), lowest * high), high)
    norm = LogNorm(levels[0], levels[-1])
    shown = np.ma.masked_invalid(np.where(values > 0, values, np.nan))
    places = np.arange(SHADES * (len(levels) - 1) + 1) / SHADES
    shades = np.exp(np.interp(places, np.arange(len(levels)), np.log(levels)))
    filled = axes.contourf(columns, rows, shown, shades, cmap=ORDERED, norm=norm, extend="min")
    filled.set_edgecolor("face")  # no seams between colours
    lines = axes.contour(columns, rows, shown, levels, colors="white", linewidths=0.9)
    for text in _apart(axes, axes.clabel(lines, fmt=lambda value: f"{value:g}", fontsize=8.0, inline=False)):
        text.set_color(INK)
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    bar = axes.figure.colorbar(filled, ax=axes, shrink=0.85, ticks=levels, format="%g")
    bar.ax.minorticks_off()
    bar.set_label(unit)


def _apart(axes: Axes, texts: Sequence[Text]) -> list[Text]:
    """Return labels that do not lie on each other, those of the lowest contours; take the others away."""
    kept: list[Text] = []
    places: list[Floats] = []
    for each in texts:
        place = np.asarray(axes.transData.transform(each.get_position())) * 72 / axes.figure.dpi
        if all(np.hypot(*(place - other)) > ROOM for other in places):
            kept.append(each)
            places.append(place)
        else:
            each.remove()
    return kept


def _seen(axes: Axes, corners: Floats, coverage: Floats) -> None:
    if not len(corners):
        return
    step = -(-len(corners) // DOTS)
    axes.plot(*corners[::step].T, ".", color="white", markersize=2.5, alpha=0.6, markeredgewidth=0.0)
    axes.plot(*np.vstack([coverage, coverage[:1]]).T, color=VERMILION, linewidth=1.2)


def in_pixels(axes: Axes, size: tuple[int, int]) -> None:
    """Give axes the columns and rows of a picture."""
    axes.set(xlim=(-0.5, size[0] - 0.5), ylim=(size[1] - 0.5, -0.5), aspect="equal")
    axes.set(xlabel="column, px", ylabel="row, px")


check_arguments(globals(), [name for name in __all__ if name.startswith("draw")])
