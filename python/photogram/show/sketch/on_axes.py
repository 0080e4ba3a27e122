"""Pictures on axes of matplotlib: one function a mark, and the panel around them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.axes import Where, handed_out, labels, lay_out, note, panels, scale_bars, whole_figure
from photogram.show.pictures import decimal_sign, new_figure
from photogram.show.sketch.declared import Panel, Sketch
from photogram.show.sketch.marks import (
    Arrows,
    Band,
    Contours,
    Ellipses,
    Level,
    Line,
    Mark,
    Markers,
    Mesh,
    Names,
    Polygons,
    Segments,
    Shades,
    Texts,
)
from photogram.show.style import INK, ORDERED, signed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

DOTS = 500
"""Marks beyond which vectors become dots: files are smaller, and nothing is lost that could be seen."""
LEGENDS: dict[str, dict[str, Any]] = {
    "beside": {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0},
    "below": {"loc": "upper left", "bbox_to_anchor": (0.0, 0.0), "borderaxespad": 4.5},
    "above": {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)},
    "lower right": {"loc": "lower right", "frameon": True, "framealpha": 1.0, "edgecolor": "white"},
}


ROOM = 20.0
"""Points from the middle of a level of contours to that of the next one."""
ALIGNED = {"start": "left", "middle": "center", "end": "right"}


def figure(sketch: Sketch) -> Figure:
    """Return a picture as a figure that belongs to no window."""
    found = new_figure(sketch.width, sketch.height)
    on_axes(sketch, found)
    # Where panels of equal scales go is known only when their limits are.
    lay_out(found)
    return found


def on_axes(sketch: Sketch, ax: Where) -> Any:
    """Draw a picture where it is asked for, and return its axes: one by itself, several as an array.

    Parameters
    ----------
    sketch
        The picture.
    ax
        As of :func:`photogram.show.axes.panels`.

    Raises
    ------
    InputError
        Another number of axes.
    ModuleNotFoundError
        matplotlib is absent.
    """
    given: dict[str, Any] = {"sharex": "col"} if sketch.shared else {}
    with panels(ax, sketch.rows, sketch.columns, sketch.width, sketch.height, **given) as found:
        own = [(axes, panel) for axes, panel in zip(found, sketch.panels, strict=False) if panel]
        for axes, panel in own:
            _panel(axes, panel)
        for unused in {*found} - {axes for axes, _ in own}:
            unused.set_visible(False)
        if sketch.shades is not None:
            _colour_bar([axes for axes, _ in own], sketch.shades)
        _head(found[0], sketch.title)
        for axes, panel in own:
            for mark in panel.marks:
                if isinstance(mark, Names):
                    labels(axes, mark.places, mark.texts, mark.colours, mark.avoid)
    return handed_out(found[: len(sketch.panels)])


def _head(axes: Axes, title: str) -> None:
    """Write the title of all panels above them, and align the names of their vertical axes."""
    figure = axes.get_figure()
    assert figure is not None
    figure.align_ylabels()
    if title:
        figure.suptitle(title, fontsize=11, x=0.01, horizontalalignment="left")


def _panel(axes: Axes, panel: Panel) -> None:
    if panel.equal:
        axes.set_aspect("equal", anchor="NW")
    axes.set_xlim(*panel.limits[:, 0].tolist())
    axes.set_ylim(*panel.limits[:, 1].tolist())
    axes.set_xlabel(panel.across)
    axes.set_ylabel(panel.up)
    if panel.log_across:
        axes.set_xscale("log")
        _ratios(axes.xaxis)
    if panel.log_up:
        axes.set_yscale("log")
        _ratios(axes.yaxis)
    if panel.equal:
        axes.ticklabel_format(useOffset=False, style="plain")
        axes.locator_params(nbins=6)
    if panel.across:
        axes.tick_params(labelbottom=True)
    if panel.across_names:
        places = range(len(panel.across_names))
        axes.set_xticks(places, panel.across_names, rotation=90 if panel.turned else 0)
    if panel.up_names:
        axes.set_yticks(range(len(panel.up_names)), panel.up_names)
    if panel.unnumbered:
        axes.set(xticks=[], yticks=[])
    if panel.bare:
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    for mark in panel.marks:
        draw(mark, axes)
    if panel.legend:
        _legend(axes, panel)
    scale_bars(axes, panel.bars, panel.title)
    note(axes, panel.notes)
    if panel.shades is not None:
        _colour_bar([axes], panel.shades)
    if panel.decimal != ".":
        decimal_sign(whole_figure(axes), panel.decimal)


def _ratios(axis: Any) -> None:
    """Give a logarithmic axis numbers that are 1, 2, 5 times powers of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _legend(axes: Axes, panel: Panel) -> None:
    from matplotlib.collections import PathCollection

    columns = len(axes.get_legend_handles_labels()[0]) if panel.legend == "above" else 1
    legend = axes.legend(**LEGENDS.get(panel.legend, {"loc": panel.legend}), ncols=columns)
    for handle in legend.legend_handles:
        if isinstance(handle, PathCollection):
            handle.set_sizes([16.0])


def _colour_bar(axes: list[Axes], shades: Shades) -> None:
    from matplotlib.cm import ScalarMappable

    figure = axes[0].get_figure()
    assert figure is not None
    colours = ScalarMappable(_norm(shades), _map(shades))
    bar = figure.colorbar(colours, ax=axes, label=shades.label, aspect=30, shrink=0.85)
    if shades.log:
        _ratios(bar.ax.yaxis)


def _map(shades: Shades) -> Any:
    return signed() if shades.map == "signed" else ORDERED


def _norm(shades: Shades) -> Any:
    from matplotlib.colors import LogNorm, Normalize

    return (LogNorm if shades.log else Normalize)(shades.low, shades.high)


@singledispatch
def draw(mark: Mark, axes: Axes) -> None:
    """Draw a mark into axes whose limits are final."""
    raise TypeError(f"there is no way to draw {type(mark).__name__}")


@draw.register(Markers)
def _markers(mark: Markers, axes: Axes) -> None:
    given: dict[str, Any] = {
        "label": mark.label or None,
        "zorder": mark.layer,
        "alpha": mark.opacity,
        "rasterized": len(mark.places) > DOTS,
    }
    if mark.values is not None and mark.shades is not None:
        sign, shades = (1.0 if mark.rising else -1.0), mark.shades
        order = np.argsort(sign * mark.values, kind="stable")
        given |= {"c": mark.values[order], "cmap": _map(shades), "norm": _norm(shades)}
        x, y = mark.places[order].T
        axes.scatter(x, y, mark.size**2, marker=mark.shape, linewidths=0, **given)
    elif mark.shape == "o" and not mark.face:
        x, y = mark.places.T
        axes.scatter(x, y, mark.size**2, color=mark.colour, linewidths=0, **given)
    else:
        given |= {"markersize": mark.size, "markeredgewidth": mark.edge, "markeredgecolor": mark.colour}
        given["markerfacecolor"] = mark.face or mark.colour
        axes.plot(*mark.places.T, mark.shape, **given)


@draw.register(Line)
def _line(mark: Line, axes: Axes) -> None:
    axes.plot(
        *mark.places.T,
        color=mark.colour,
        linewidth=mark.width,
        linestyle=mark.dash or "-",
        alpha=mark.opacity,
        label=mark.label or None,
        zorder=mark.layer,
    )


@draw.register(Level)
def _level(mark: Level, axes: Axes) -> None:
    axes.axhline(
        mark.height, color=mark.colour, linewidth=mark.width, linestyle=mark.dash or "-", zorder=mark.layer
    )


@draw.register(Segments)
def _segments(mark: Segments, axes: Axes) -> None:
    from matplotlib.collections import LineCollection

    lines: Any = list(mark.ends)
    given: dict[str, Any] = {"label": mark.label or None, "zorder": mark.layer}
    look: Any = {"colors": mark.colour, "linewidths": mark.width, "linestyles": mark.dash or "-"}
    drawn = LineCollection(lines, **look, **given)
    axes.add_collection(drawn, autolim=False)


@draw.register(Arrows)
def _arrows(mark: Arrows, axes: Axes) -> None:
    axes.quiver(
        *mark.places.T,
        *mark.vectors.T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        color=mark.colours,
        width=mark.width,
        headwidth=3.5,
        headlength=4.5,
        label=mark.label or None,
        zorder=mark.layer,
    )


@draw.register(Polygons)
def _polygons(mark: Polygons, axes: Axes) -> None:
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgba

    drawn = PolyCollection(
        list(mark.outlines),
        facecolors=to_rgba(mark.face, mark.face_opacity),
        edgecolors=to_rgba(mark.edge, mark.edge_opacity),
        linewidths=mark.width,
        label=mark.label or None,
        zorder=mark.layer,
        rasterized=len(mark.outlines) > DOTS / 5,
    )
    axes.add_collection(drawn, autolim=False)


@draw.register(Ellipses)
def _ellipses(mark: Ellipses, axes: Axes) -> None:
    from matplotlib.collections import EllipseCollection

    drawn = EllipseCollection(
        2 * mark.semi_axes[:, 0],
        2 * mark.semi_axes[:, 1],
        mark.angles,
        units="xy",
        offsets=mark.places,
        transOffset=axes.transData,
        facecolors=(mark.colour, mark.fill),
        edgecolors="none" if mark.fill else mark.colour,
        linewidths=mark.width,
        zorder=mark.layer,
    )
    axes.add_collection(drawn, autolim=False)


@draw.register(Mesh)
def _mesh(mark: Mesh, axes: Axes) -> None:
    (left, low), (right, high) = mark.corners
    rows, columns = mark.values.shape
    axes.pcolormesh(
        np.linspace(left, right, columns + 1),
        np.linspace(low, high, rows + 1),
        np.ma.masked_invalid(mark.values),
        cmap=_map(mark.shades),
        norm=_norm(mark.shades),
        zorder=mark.layer,
        rasterized=True,
    )


@draw.register(Contours)
def _contours(mark: Contours, axes: Axes) -> None:
    from matplotlib.patheffects import withStroke

    values = np.ma.masked_invalid(mark.values)
    look: dict[str, Any] = {"cmap": _map(mark.shades), "norm": _norm(mark.shades), "zorder": mark.layer}
    filled = axes.contourf(mark.across, mark.up, values, mark.bounds, extend="min", **look)
    filled.set_edgecolor("face")  # no seams between colours
    look = {"colors": mark.colour, "linewidths": mark.width, "linestyles": "solid"}
    lines = axes.contour(mark.across, mark.up, values, mark.levels, **look)
    written = axes.clabel(lines, fmt=lambda value: f"{value:g}", fontsize=8.0, inline=False)
    for text in _apart(axes, written):
        text.set_color(INK)
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])


def _apart(axes: Axes, texts: Sequence[Text]) -> list[Text]:
    """Return words that do not lie on each other, those of the lowest contours; take the others away."""
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


@draw.register(Band)
def _band(mark: Band, axes: Axes) -> None:
    axes.fill_between(
        mark.across,
        mark.low,
        mark.high,
        color=mark.colour,
        alpha=mark.opacity,
        linewidth=0,
        label=mark.label or None,
        zorder=mark.layer,
    )


@draw.register(Texts)
def _texts(mark: Texts, axes: Axes) -> None:
    for (x, y), text, colour in zip(mark.places.tolist(), mark.texts, mark.colours, strict=True):
        axes.text(x, y, text, ha=ALIGNED[mark.anchor], va="center", fontsize=mark.size, color=colour)


@draw.register(Names)
def _later(mark: Names, axes: Axes) -> None:
    """Names are drawn when the layout of all panels is known."""
