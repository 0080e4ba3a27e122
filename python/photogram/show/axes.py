"""Where pictures are drawn: into given axes or a figure of their own; remarks, scales, names of places."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.show.sketch.marks import NOWHERE
from photogram.show.sketch.names import Box, free_side
from photogram.show.style import FAINT, INK, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    Where: TypeAlias = Axes | Sequence[Axes] | NDArray[Any] | Figure | SubFigure | None

if not TYPE_CHECKING:
    Where = Any
    """Axes, as many as there are panels, a figure to put them in, or None: a new one of pyplot."""


@contextmanager
def panels(
    ax: Where, rows: int, columns: int, width: float, height: float, **shared: Any
) -> Iterator[list[Axes]]:
    """Give the axes of a picture, and draw in the style of the house meanwhile.

    Parameters
    ----------
    ax
        Axes, as many as there are panels; or a figure, which gets them; None: a new figure of pyplot, which
        notebooks show.
    rows, columns
        Panels.
    width, height
        Of a figure, inches.
    shared
        For `subplots` of the figure.

    Raises
    ------
    InputError
        Another number of axes.
    ModuleNotFoundError
        matplotlib is absent.
    """
    with styled():
        from matplotlib.figure import Figure, FigureBase

        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.figure(layout="constrained")
        if isinstance(ax, FigureBase):
            if isinstance(ax, Figure):
                ax.set_size_inches(width, height)
            found = ax.subplots(rows, columns, squeeze=False, **shared).ravel().tolist()
        else:
            found = np.atleast_1d(np.asarray(ax, dtype=object)).ravel().tolist()
        if len(found) < rows * columns:
            raise InputError(f"the picture has {rows * columns} panels, but ax is {len(found)} axes")
        for axes in found[: rows * columns]:
            # Ticks are made when they are drawn, outside of this context.
            axes.tick_params(color=FAINT, labelsize=8.0, labelcolor=INK)
        yield found[: rows * columns]


def handed_out(axes: list[Axes]) -> Any:
    """Return axes as the functions of pictures do: one by itself, several as an array."""
    if len(axes) == 1:
        return axes[0]
    found = np.empty(len(axes), dtype=object)
    found[:] = axes
    return found


def note(axes: Axes, lines: Sequence[str]) -> None:
    """Write what a reader must know below the axes: what was left out, what stands for many."""
    from matplotlib.offsetbox import AnchoredText

    said = [line for line in lines if line]
    if not said:
        return
    box = AnchoredText(
        "\n".join(said),
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=_below(axes),
        prop={"size": 7.5, "color": INK},
        pad=0.0,
        borderpad=0.0,
        frameon=False,
    )
    box.set_clip_on(False)
    axes.add_artist(box)


def whole_figure(axes: Axes) -> Figure:
    """Return the figure that axes are in, also where they are in a part of one."""
    part = axes.get_figure()
    assert part is not None
    return part.canvas.figure


def _below(axes: Axes) -> Any:
    """Return a transform whose origin is under the labels of the horizontal axis."""
    from matplotlib.transforms import ScaledTranslation

    down = 34.0 / 72.0 if axes.get_xlabel() else 22.0 / 72.0
    figure = whole_figure(axes)
    return axes.transAxes + ScaledTranslation(0.0, -down, figure.dpi_scale_trans)


def scale_bars(axes: Axes, bars: Sequence[tuple[float, str, str]], title: str) -> None:
    """Draw bars above the axes, one above the other, and the title over them.

    Parameters
    ----------
    axes
        Their limits must be final.
    bars
        Length in the unit of the horizontal axis, colour, and what it stands for.
    title
        Of the picture.
    """
    from matplotlib.transforms import ScaledTranslation, blended_transform_factory

    figure = whole_figure(axes)
    left, right = axes.get_xlim()
    plain = blended_transform_factory(axes.transData, axes.transAxes)
    sign = 1.0 if right > left else -1.0
    for row, (length, colour, text) in enumerate(reversed(bars)):
        up = plain + ScaledTranslation(0.0, (8.0 + 12.0 * row) / 72.0, figure.dpi_scale_trans)
        ends = [left, left + sign * length]
        axes.plot(
            ends, [1.0, 1.0], transform=up, color=colour, linewidth=2.5, solid_capstyle="butt", clip_on=False
        )
        axes.annotate(
            text,
            (ends[1], 1.0),
            xycoords=up,
            xytext=(5.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=8.0,
            color=INK,
            annotation_clip=False,
        )
    axes.set_title(title, pad=8.0 + 12.0 * len(bars))


def labels(
    axes: Axes,
    places: Floats,
    texts: Sequence[str],
    colours: Sequence[str],
    avoid: Floats = NOWHERE,
    gap: float = 4.0,
) -> int:
    """Write names beside places where there is room, in the order given; return how many have none.

    A name stands to one of eight sides of its place, does not touch another name or place, and stays within
    the axes. The figure is laid out as far as it goes before.

    Parameters
    ----------
    axes
        Their limits must be final.
    places
        (k, 2) in the units of the axes.
    texts
        (k,) names.
    colours
        (k,) of the letters.
    avoid
        (a, 2) further places that no name covers.
    gap
        Points between place and name.
    """
    from matplotlib.text import Annotation

    figure = whole_figure(axes)
    # Where legends and scales of equal axes go is known only when the layout was made twice.
    for _ in range(2):
        lay_out(figure)
    room: Box = axes.get_window_extent().extents
    point = figure.dpi / 72.0
    own_boxes = (each.get_window_extent() for each in axes.texts if isinstance(each, Annotation))
    taken: list[Box] = [each.extents for each in own_boxes]
    at = axes.transData.transform(places)
    obstacles = np.concatenate([at, axes.transData.transform(avoid)])
    left_out = 0
    for (x, y), text, place, colour in zip(
        at.tolist(), texts, np.asarray(places).tolist(), colours, strict=True
    ):
        written = axes.annotate(
            text, place, (0.0, 0.0), textcoords="offset points", fontsize=7.0, color=colour
        )
        written.set_in_layout(False)
        written.set_bbox({"facecolor": "white", "alpha": 0.85, "linewidth": 0.0, "pad": 0.4})
        own = written.get_window_extent()
        box = free_side((own.width, own.height), (x, y), gap * point, taken, obstacles, room)
        if box is None:
            written.remove()
            left_out += 1
            continue
        written.set_position(((box[0] - x) / point, (box[1] - y) / point))
        taken.append(box)
    return left_out


def lay_out(figure: Figure) -> None:
    """Put axes and legends of a figure where they will be drawn."""
    engine = figure.get_layout_engine()
    if engine is None:
        figure.draw_without_rendering()
        return
    engine.execute(figure)
    for axes in figure.axes:
        axes.apply_aspect()
