"""Plots on axes of matplotlib, an extra (`pip install 'photogram[plots]'`): one function for each mark."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.errors import InputError
from photogram.show.pictures import new_figure
from photogram.show.sketch import marks
from photogram.show.sketch.declared import Panel, Sketch
from photogram.show.sketch.layout import NAME, NOTE
from photogram.show.sketch.letters import width
from photogram.show.sketch.names import Box, free_side
from photogram.show.style import FAINT, INK, ORDERED, signed, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_VECTOR_MARKS = 500  # More markers than these are drawn as pixels in PDF and SVG files
LEGENDS: dict[str, dict[str, Any]] = {
    "beside": {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0},
    "below": {"loc": "upper left", "bbox_to_anchor": (0.0, 0.0), "borderaxespad": 4.5},
    "above": {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)},
    "lower right": {"loc": "lower right", "frameon": True, "framealpha": 1.0, "edgecolor": "white"},
}
ALIGNED = {"start": "left", "middle": "center", "end": "right"}


def figure(sketch: Sketch) -> Figure:
    """Return a plot as a figure that belongs to no window."""
    made = new_figure(sketch.width, sketch.height)
    on_axes(sketch, made)
    _lay_out(made)
    return made


def on_axes(sketch: Sketch, ax: Any) -> None:
    """Draw a plot on axes, as many as it has panels, or in a figure or subfigure, which gets the axes.

    Raises
    ------
    InputError
        The number of axes differs from the number of panels.
    ModuleNotFoundError
        matplotlib is absent.
    """
    with styled():
        from matplotlib.figure import FigureBase

        if isinstance(ax, FigureBase):
            shared: Any = {"sharex": "col"} if sketch.shared else {}
            ax = ax.subplots(sketch.rows, sketch.columns, squeeze=False, **shared)
            for empty in ax.flat[len(sketch.panels) :]:
                empty.set_visible(False)
            ax = ax.flat[: len(sketch.panels)]
        every: list[Axes] = np.atleast_1d(np.asarray(ax, dtype=object)).ravel().tolist()
        if len(every) != len(sketch.panels):
            raise InputError(
                f"the plot has {len(sketch.panels)} panels and needs as many axes, got {len(every)}"
            )
        drawn = [(axes, panel) for axes, panel in zip(every, sketch.panels, strict=True) if panel is not None]
        for axes, panel in zip(every, sketch.panels, strict=True):
            if panel is None:
                axes.set_visible(False)
            else:
                _panel(axes, panel)
        whole: Any = every[0].get_figure()
        whole.align_ylabels()
        if sketch.shades is not None:
            _colour_bar([axes for axes, _ in drawn], sketch.shades)
        if sketch.title:
            whole.suptitle(sketch.title, fontsize=11, x=0.01, horizontalalignment="left")
        _names(drawn)


def _panel(axes: Axes, panel: Panel) -> None:
    # Ticks are created when the figure is drawn, outside the context of the style.
    axes.tick_params(color=FAINT, labelsize=8.0, labelcolor=INK)
    (left, low), (right, top) = panel.limits.tolist()
    axes.set(xlim=(left, right), ylim=(low, top), xlabel=panel.across, ylabel=panel.up)
    if panel.equal:
        axes.set_aspect("equal", anchor="NW")
        axes.ticklabel_format(useOffset=False, style="plain")
        axes.locator_params(nbins=6)
    if panel.across:
        axes.tick_params(labelbottom=True)
    for axis, log, names in (
        (axes.xaxis, panel.log_across, panel.across_names),
        (axes.yaxis, panel.log_up, panel.up_names),
    ):
        if log:
            axis.axes.set(**{f"{axis.axis_name}scale": "log"})
            _ratios(axis)
        elif panel.decimal != ".":
            axis.set_major_formatter(lambda value, _: f"{value:.10g}".replace(".", panel.decimal))
        if names:
            turn = 90 if panel.turned and axis is axes.xaxis else 0
            axis.set_ticks(range(len(names)), names, rotation=turn)
    if panel.unnumbered:
        axes.set(xticks=[], yticks=[])
    if panel.bare:
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    for mark in panel.marks:
        draw(mark, axes)
    _around(axes, panel)
    if panel.shades is not None:
        _colour_bar([axes], panel.shades)


def _around(axes: Axes, panel: Panel) -> None:
    """Add the legend, the scale bars above the axes with the title over them, and the notes below."""
    from matplotlib.collections import PathCollection
    from matplotlib.transforms import ScaledTranslation

    if panel.legend:
        columns = len(axes.get_legend_handles_labels()[0]) if panel.legend == "above" else 1
        legend = axes.legend(**LEGENDS.get(panel.legend, {"loc": panel.legend}), ncols=columns)
        for handle in legend.legend_handles:
            if isinstance(handle, PathCollection):
                handle.set_sizes([16.0])
    left, right = axes.get_xlim()
    whole: Any = axes.figure
    for row, (length, colour, text) in enumerate(reversed(panel.bars)):
        up = ScaledTranslation(0.0, (8.0 + 12.0 * row) / 72.0, whole.dpi_scale_trans)
        place, end = axes.get_xaxis_transform() + up, left + np.copysign(length, right - left)
        look: Any = {"color": colour, "linewidth": 2.5, "solid_capstyle": "butt", "clip_on": False}
        axes.plot([left, end], [1.0, 1.0], transform=place, **look)
        _written(axes, text, (end, 1.0), place, (5.0, 0.0), va="center", fontsize=8.0)
    axes.set_title(panel.title, pad=8.0 + 12.0 * len(panel.bars))
    if notes := "\n".join(filter(None, panel.notes)):
        down = -34.0 if panel.across else -22.0
        _written(axes, notes, (0.0, 0.0), "axes fraction", (0.0, down), va="top", fontsize=NOTE)


def _written(
    axes: Axes, text: str, at: tuple[float, float], coords: Any, shift: tuple[float, float], **look: Any
) -> None:
    """Write a text outside the panel, points away from a place."""
    axes.annotate(text, at, shift, coords, "offset points", color=INK, annotation_clip=False, **look)


def _ratios(axis: Any) -> None:
    """Write 1, 2, 5 times powers of ten along a logarithmic axis."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _colour_bar(axes: list[Axes], shades: marks.Shades) -> None:
    from matplotlib.cm import ScalarMappable

    whole: Any = axes[0].get_figure()
    bar = whole.colorbar(
        ScalarMappable(**_colours(shades)), ax=axes, label=shades.label, aspect=30, shrink=0.85
    )
    if shades.log:
        _ratios(bar.ax.yaxis)


def _colours(shades: marks.Shades) -> dict[str, Any]:
    from matplotlib.colors import LogNorm, Normalize

    norm = (LogNorm if shades.log else Normalize)(shades.low, shades.high)
    return {"cmap": signed() if shades.map == "signed" else ORDERED, "norm": norm}


def _names(drawn: Sequence[tuple[Axes, Panel]]) -> None:
    """Write names beside their places: none covers another name or place."""
    named = [(axes, mark) for axes, panel in drawn for mark in panel.marks if isinstance(mark, marks.Names)]
    # Legends and axes of equal scales get their final places in the second layout.
    for axes, _ in named[:1] * 2:
        _lay_out(axes.figure)
    for axes, mark in named:
        point = axes.figure.dpi / 72.0
        room: Box = axes.get_window_extent().extents
        taken: list[Box] = []
        at = axes.transData.transform(mark.places)
        obstacles = np.concatenate([at, axes.transData.transform(mark.avoid)])
        for place, (x, y), text, colour in zip(
            mark.places.tolist(), at.tolist(), mark.texts, mark.colours, strict=True
        ):
            size = point * (width(text, NAME) + 2.0), point * (NAME + 2.0)
            if box := free_side(size, (x, y), 4.0 * point, taken, obstacles, room):
                taken.append(box)
                shift = (box[0] - x) / point + 1.0, (box[1] - y) / point + 2.0
                name = axes.annotate(
                    text, place, shift, textcoords="offset points", fontsize=NAME, color=colour
                )
                name.set_in_layout(False)
                name.set_bbox({"facecolor": "white", "alpha": 0.85, "linewidth": 0.0, "pad": 0.4})


def _lay_out(whole: Any) -> None:
    whole = whole.canvas.figure
    if (engine := whole.get_layout_engine()) is not None:
        engine.execute(whole)
    for axes in whole.axes:
        axes.apply_aspect()


@singledispatch
def draw(mark: marks.Mark, axes: Axes) -> None:
    """Draw a mark into axes whose limits are final; `Names` are drawn after the layout of all panels."""
    if not isinstance(mark, marks.Names):
        raise TypeError(f"the renderer for matplotlib has no function for {type(mark).__name__}")


def _given(mark: Any) -> dict[str, Any]:
    return {"zorder": mark.layer, "label": getattr(mark, "label", "") or None}


@draw.register(marks.Markers)
def _markers(mark: marks.Markers, axes: Axes) -> None:
    given = _given(mark) | {"alpha": mark.opacity, "rasterized": len(mark.places) > MAX_VECTOR_MARKS}
    dots: dict[str, Any] = {"s": mark.size**2, "marker": mark.shape, "linewidths": 0}
    places = mark.places
    if mark.values is not None and mark.shades is not None:
        order = np.argsort((1.0 if mark.rising else -1.0) * mark.values, kind="stable")
        given |= {**dots, "c": mark.values[order], **_colours(mark.shades)}
        axes.scatter(places[order, 0], places[order, 1], **given)
    elif mark.shape == "o" and not mark.face:
        axes.scatter(places[:, 0], places[:, 1], color=mark.colour, **dots, **given)
    else:
        given |= {"markersize": mark.size, "markeredgewidth": mark.edge, "markeredgecolor": mark.colour}
        axes.plot(*places.T, mark.shape, markerfacecolor=mark.face or mark.colour, **given)


@draw.register(marks.Line)
def _line(mark: marks.Line, axes: Axes) -> None:
    look: Any = {"color": mark.colour, "linewidth": mark.width, "linestyle": mark.dash or "-"}
    axes.plot(*mark.places.T, alpha=mark.opacity, **look, **_given(mark))


@draw.register(marks.Level)
def _level(mark: marks.Level, axes: Axes) -> None:
    look: Any = {"color": mark.colour, "linewidth": mark.width, "linestyle": mark.dash or "-"}
    axes.axhline(mark.height, **look, zorder=mark.layer)


@draw.register(marks.Segments)
def _segments(mark: marks.Segments, axes: Axes) -> None:
    look = {"colors": mark.colour, "linewidths": mark.width, "linestyles": mark.dash or "-"}
    _collection("LineCollection", axes, list(mark.ends), **look, **_given(mark))


@draw.register(marks.Arrows)
def _arrows(mark: marks.Arrows, axes: Axes) -> None:
    look: Any = {"color": mark.colours, "width": mark.width, "headwidth": 3.5, "headlength": 4.5}
    plain: Any = {"angles": "xy", "scale_units": "xy", "scale": 1.0}
    axes.quiver(*mark.places.T, *mark.vectors.T, **plain, **look, **_given(mark))


@draw.register(marks.Polygons)
def _polygons(mark: marks.Polygons, axes: Axes) -> None:
    look = {"facecolors": (mark.face, mark.face_opacity), "edgecolors": (mark.edge, mark.edge_opacity)}
    pixels = len(mark.outlines) > MAX_VECTOR_MARKS / 5
    given = {"linewidths": mark.width, "rasterized": pixels, **_given(mark)}
    _collection("PolyCollection", axes, list(mark.outlines), **look, **given)


@draw.register(marks.Ellipses)
def _ellipses(mark: marks.Ellipses, axes: Axes) -> None:
    look = {"facecolors": (mark.colour, mark.fill), "edgecolors": "none" if mark.fill else mark.colour}
    place = {"units": "xy", "offsets": mark.places, "offset_transform": axes.transData}
    sizes = (*(2 * mark.semi_axes.T), mark.angles)
    _collection("EllipseCollection", axes, *sizes, **place, **look, linewidths=mark.width, zorder=mark.layer)


def _collection(kind: str, axes: Axes, *what: Any, **look: Any) -> None:
    from matplotlib import collections

    axes.add_collection(getattr(collections, kind)(*what, **look), autolim=False)


@draw.register(marks.Mesh)
def _mesh(mark: marks.Mesh, axes: Axes) -> None:
    (left, low), (right, high) = mark.corners
    rows, columns = mark.values.shape
    x, y = np.linspace(left, right, columns + 1), np.linspace(low, high, rows + 1)
    values = np.ma.masked_invalid(mark.values)
    axes.pcolormesh(x, y, values, zorder=mark.layer, rasterized=True, **_colours(mark.shades))


@draw.register(marks.Contours)
def _contours(mark: marks.Contours, axes: Axes) -> None:
    grid = mark.across, mark.up, np.ma.masked_invalid(mark.values)
    areas = axes.contourf(*grid, mark.bounds, extend="min", zorder=mark.layer, **_colours(mark.shades))
    areas.set_edgecolor("face")  # No seams between colours
    look: Any = {"colors": mark.colour, "linewidths": mark.width, "linestyles": "solid"}
    lines = axes.contour(*grid, mark.levels, **look)
    axes.clabel(lines, fmt="%g", fontsize=8.0)


@draw.register(marks.Band)
def _band(mark: marks.Band, axes: Axes) -> None:
    look: Any = {"color": mark.colour, "alpha": mark.opacity, "linewidth": 0}
    axes.fill_between(mark.across, mark.low, mark.high, **look, **_given(mark))


@draw.register(marks.Texts)
def _texts(mark: marks.Texts, axes: Axes) -> None:
    look: Any = {"ha": ALIGNED[mark.anchor], "va": "center", "fontsize": mark.size}
    for (x, y), text, colour in zip(mark.places.tolist(), mark.texts, mark.colours, strict=True):
        axes.text(x, y, text, color=colour, **look)
