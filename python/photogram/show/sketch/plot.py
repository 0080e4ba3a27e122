"""A plot for users: in notebooks, in files, or on matplotlib axes."""

from __future__ import annotations

import io
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from photogram.errors import InputError
from photogram.extras import need
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch import marks
from photogram.show.sketch.layout import NAME, NOTE, NUMBER, free_names
from photogram.show.sketch.marks import Panel, Sketch
from photogram.show.sketch.svg import svg_of
from photogram.show.style import FAINT, INK, SETTINGS, new_figure
from photogram.words import phrase

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure
    from numpy.typing import NDArray

    Where: TypeAlias = Axes | Sequence[Axes] | NDArray[Any] | Figure | SubFigure

# Metadata without version and time: equal plots give equal files
TIMELESS: dict[str, Any] = {"png": {"Software": None}, "pdf": {"CreationDate": None}}


@dataclass(frozen=True, eq=False, repr=False)
class Plot(Sketch):
    """A plot with panels of marks, drawn on demand. Notebooks display it as SVG.

    Examples
    --------
    >>> import photogram
    >>> result = photogram.adjust(photogram.simulate(strips=2, photos_per_strip=4, seed=5).block)
    >>> plot = result.plot.network()
    >>> plot.render("svg")[:4]
    b'<svg'
    >>> plot.save("network.svg")  # doctest: +SKIP
    """

    def __repr__(self) -> str:
        count = sum(panel is not None for panel in self.panels)
        size = f"{self.width:.3g} x {self.height:.3g} in"
        return f"Plot({self._name!r}, {count} panel{'s' * (count != 1)}, {size})"

    @property
    def _name(self) -> str:
        titles = [self.title, *(panel.title for panel in self.panels if panel is not None)]
        return next((title.partition("\n")[0] for title in titles if title), "")

    def _repr_svg_(self) -> str:
        # A page that shows several plots needs a different identifier for each.
        return self._svg(f"plot{zlib.crc32(self.render()):08x}")

    def _svg(self, name: str) -> str:
        """Return the plot as SVG on a white background, for dark pages."""
        head, sign, content = svg_of(self, name, self._name).partition(">")
        return f'{head}{sign}<rect width="100%" height="100%" fill="white"/>{content}' if content else head

    def render(self, ending: str = "svg") -> bytes:
        """Return the plot as the content of a file.

        Parameters
        ----------
        ending
            `svg`, or a format of matplotlib: `png`, `pdf` ...

        Raises
        ------
        InputError
            If matplotlib does not support the format.
        ModuleNotFoundError
            If matplotlib is not installed (`pip install 'photogram[plots]'`; not needed for `svg`), or
            contourpy for contours (`pip install 'photogram[report]'`).
        """
        if ending == "svg":
            return self._svg("plot").encode()
        drawn, content = self.figure(), io.BytesIO()
        if ending not in drawn.canvas.get_supported_filetypes():
            raise InputError(phrase("plot.format", ending=ending))
        from matplotlib import rc_context

        with rc_context(SETTINGS):
            drawn.savefig(content, format=ending, metadata=TIMELESS.get(ending))
        return content.getvalue()

    def save(self, path: Path | str) -> None:
        """Write the plot to a file, in the format of the suffix: `.svg`, `.png`, `.pdf`.

        Parameters
        ----------
        path
            Name of the file; without a suffix the format is PNG.

        Raises
        ------
        InputError
            If the suffix is not a supported format.
        ModuleNotFoundError
            As in :meth:`render`.
        """
        from photogram.io.writing import write_whole

        path = Path(path)
        write_whole({path: self.render(path.suffix.lower().removeprefix(".") or "png")})

    def figure(self) -> Figure:
        """Return the plot as a matplotlib figure without a window.

        Raises
        ------
        ModuleNotFoundError
            If matplotlib is not installed (`pip install 'photogram[plots]'`).
        """
        figure = new_figure(self.width, self.height)
        on_axes(self, figure)
        lay_out(figure)
        return figure

    def on(self, ax: Where) -> None:
        """Draw the plot on axes of matplotlib.

        Parameters
        ----------
        ax
            Axes; a sequence of them, one for each panel, if the plot has several panels; or a figure or
            subfigure, in which the plot creates its axes.

        Raises
        ------
        InputError
            If the numbers of axes and panels differ.
        ModuleNotFoundError
            If matplotlib is not installed (`pip install 'photogram[plots]'`).
        """
        on_axes(self, ax)


def side_by_side(panels: Sequence[Panel], most: int, side: float, title: str = "") -> Plot:
    """Return a plot of square panels, `side` inches, at most `most` in a row."""
    columns = min(len(panels), most)
    height = side * -(-len(panels) // columns) + (0.3 if title else 0.0)
    return Plot(max(side * columns, 5.0), height, panels, columns, title=title)


MAX_VECTOR_MARKS = 500  # More markers than these are drawn as pixels in PDF and SVG files
LEGENDS: dict[str, dict[str, Any]] = {
    "beside": {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0},
    "below": {"loc": "upper left", "bbox_to_anchor": (0.0, 0.0), "borderaxespad": 4.5},
}
TICKS: dict[str, Any] = {"color": FAINT, "labelsize": NUMBER, "labelcolor": INK}
ALIGNED = {"start": "left", "middle": "center", "end": "right"}


def on_axes(sketch: Sketch, ax: Any) -> None:
    """Draw a plot on one axes object per panel, or in a figure or subfigure."""
    need("matplotlib")
    from matplotlib import rc_context
    from matplotlib.figure import FigureBase

    with rc_context(SETTINGS):
        panels = list(sketch.panels)
        if isinstance(ax, FigureBase):
            shared: Any = "col" if sketch.shared else False
            ax = ax.subplots(sketch.rows, sketch.columns, squeeze=False, sharex=shared)
            panels += [None] * (ax.size - len(panels))
        every: list[Any] = np.atleast_1d(np.asarray(ax, dtype=object)).ravel().tolist()
        if len(every) != len(panels):
            raise InputError(phrase("plot.axes", panels=len(panels), axes=len(every)))
        names = []
        for axes, panel in zip(every, panels, strict=True):
            axes.set_visible(panel is not None)
            if panel is not None:
                _panel(axes, panel)
                names += [(axes, mark) for mark in panel.marks if isinstance(mark, marks.Names)]
        whole = every[0].get_figure()
        whole.align_ylabels()
        if sketch.title:
            whole.suptitle(sketch.title, fontsize=11, x=0.01, horizontalalignment="left")
        # Legends and axes with equal scales have their final positions in the second layout.
        for axes, _ in names[:1] * 2:
            lay_out(axes.figure)
        for axes, mark in names:
            _names(axes, mark)


def _panel(axes: Any, panel: Panel) -> None:
    # Ticks are created when the figure is drawn, outside the context of the style.
    axes.tick_params(**TICKS)
    axes.set(xlim=panel.limits[:, 0], ylim=panel.limits[:, 1], xlabel=panel.across, ylabel=panel.up)
    if panel.equal:
        axes.set_aspect("equal", anchor="NW")
        axes.ticklabel_format(useOffset=False, style="plain")
        axes.locator_params(nbins=6)
    if panel.across:
        axes.tick_params(labelbottom=True)
    sides = (panel.log_across, panel.across_names), (panel.log_up, panel.up_names)
    for axis, (log, names) in zip((axes.xaxis, axes.yaxis), sides, strict=True):
        if log:
            axes.set(**{f"{axis.axis_name}scale": "log"})
            _ratios(axis)
        elif panel.decimal != ".":
            axis.set_major_formatter(lambda value, _: f"{value:.10g}".replace(".", panel.decimal))
        if names or panel.bare:
            axis.set_ticks(range(len(names)), names, rotation=90 * (panel.turned and axis is axes.xaxis))
    if panel.bare:
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
    for mark in panel.marks:
        draw(mark, axes)
    _around(axes, panel)


def _around(axes: Any, panel: Panel) -> None:
    """Add the legend, the scale bars and title above the axes, the colour bar, and the notes below."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.transforms import ScaledTranslation

    if panel.legend:
        legend = axes.legend(**LEGENDS[panel.legend])
        for handle in legend.legend_handles:
            if hasattr(handle, "set_sizes"):
                handle.set_sizes(np.maximum(handle.get_sizes(), 16.0))
    left, right = axes.get_xlim()
    outside = {"textcoords": "offset points", "color": INK, "annotation_clip": False, "fontsize": NOTE}
    for row, (length, colour, text) in enumerate(reversed(panel.bars)):
        up = ScaledTranslation(0.0, (8.0 + 12.0 * row) / 72.0, axes.figure.dpi_scale_trans)
        place, end = axes.get_xaxis_transform() + up, left + np.copysign(length, right - left)
        look = {"color": colour, "linewidth": 2.5, "solid_capstyle": "butt", "clip_on": False}
        axes.plot([left, end], [1.0, 1.0], transform=place, **look)
        axes.annotate(text, (end, 1.0), (5.0, 0.0), place, va="center", **outside)
    axes.set_title(panel.title, pad=8.0 + 12.0 * len(panel.bars))
    if notes := "\n".join(filter(None, panel.notes)):
        axes.annotate(notes, (0, 0), (0, -34 if panel.across else -22), "axes fraction", va="top", **outside)
    if panel.shades:
        colours, look = ScalarMappable(**_colours(panel.shades)), {"aspect": 30, "shrink": 0.85}
        bar = axes.get_figure().colorbar(colours, ax=axes, label=panel.shades.label, **look)
        bar.ax.tick_params(**TICKS)
        if panel.shades.log:
            _ratios(bar.ax.yaxis)


def _ratios(axis: Any) -> None:
    """Write 1, 2, 5 times powers of ten along a logarithmic axis."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def _colours(shades: marks.Shades) -> dict[str, Any]:
    from matplotlib.colors import ListedColormap, LogNorm, Normalize

    colours = marks.rgb(shades, shades.values(np.linspace(0.0, 1.0, 256))) / 255.0
    return {
        "cmap": ListedColormap(colours),
        "norm": (LogNorm if shades.log else Normalize)(shades.low, shades.high),
    }


def _names(axes: Any, mark: marks.Names) -> None:
    point, at = axes.figure.dpi / 72.0, axes.transData.transform(mark.places)
    room, avoid = axes.get_window_extent().extents, axes.transData.transform(mark.avoid)
    # The boxes that matplotlib draws are wider than the words.
    for row, box in free_names(mark, at, avoid, 1.1 * NAME * point, room, []):
        shift = (box[0] - at[row, 0]) / point + 0.4, (box[1] - at[row, 1]) / point + 1.8
        look = {"textcoords": "offset points", "fontsize": NAME, "color": mark.colours[row]}
        name = axes.annotate(mark.texts[row], mark.places[row], shift, **look)
        name.set_in_layout(False)
        name.set_bbox({"facecolor": "white", "alpha": 0.85, "linewidth": 0.0, "pad": 0.4})


def lay_out(whole: Any) -> None:
    whole = whole.canvas.figure
    if (engine := whole.get_layout_engine()) is not None:
        engine.execute(whole)
    for axes in whole.axes:
        axes.apply_aspect()


def draw(mark: marks.Mark, axes: Any) -> None:
    """Draw a mark on axes with final limits; `Names` after the layout."""
    from matplotlib.collections import EllipseCollection, PolyCollection

    given: dict[str, Any] = {"zorder": mark.layer, "label": mark.label or None}
    match mark:
        case marks.Markers():
            _markers(mark, axes, given)
        case marks.Line():
            ends = axes.get_xlim()
            gap = np.full((1, 2), np.nan)  # Lines are not connected
            places = np.concatenate([part for line in mark.lines for part in (line, gap)])
            places = np.nan_to_num(places, nan=np.nan, neginf=min(ends), posinf=max(ends))
            given |= {"color": mark.colour, "linewidth": mark.width, "linestyle": mark.dash or "-"}
            axes.plot(*places.T, alpha=mark.opacity, solid_capstyle="butt", **given)
        case marks.Arrows():
            given |= {"color": mark.colours, "width": mark.width, "headwidth": 3.5, "headlength": 4.5}
            plain = {"angles": "xy", "scale_units": "xy", "scale": 1.0}
            axes.quiver(*mark.places.T, *mark.vectors.T, **plain, **given)
        case marks.Polygons():
            edge = (mark.edge, mark.edge_opacity) if mark.edge else "none"
            known = [outline[np.isfinite(outline).all(axis=1)] for outline in mark.places]
            given |= {
                "facecolors": (mark.face, mark.face_opacity),
                "edgecolors": edge,
                "linewidths": mark.width,
            }
            given["rasterized"] = len(known) > MAX_VECTOR_MARKS / 5
            axes.add_collection(PolyCollection(known, **given), autolim=False)
        case marks.Ellipses():
            edge = "none" if mark.fill else mark.colour
            given |= {"facecolors": (mark.colour, mark.fill), "edgecolors": edge, "linewidths": mark.width}
            given |= {"units": "xy", "offsets": mark.places, "offset_transform": axes.transData}
            wide, high = 2 * mark.semi_axes.T
            axes.add_collection(EllipseCollection(wide, high, mark.angles, **given), autolim=False)
        case marks.Mesh():
            given |= _colours(mark.shades)
            axes.pcolorfast(*mark.corners.T, np.ma.masked_invalid(mark.values), **given)
        case marks.Texts():
            look = {"ha": ALIGNED[mark.anchor], "va": "center", "fontsize": mark.size}
            colours = np.broadcast_to(mark.colours, len(mark.texts))
            for (x, y), text, colour in zip(mark.places.tolist(), mark.texts, colours, strict=True):
                axes.text(x, y, text, color=colour, **look)
        case _ if not isinstance(mark, marks.Names):
            raise TypeError(f"the renderer for matplotlib does not draw {type(mark).__name__}")


def _markers(mark: marks.Markers, axes: Any, given: dict[str, Any]) -> None:
    given |= {"alpha": mark.opacity, "rasterized": len(mark.places) > MAX_VECTOR_MARKS, "marker": mark.shape}
    places, edge = mark.places, 0 if mark.shape == "o" and not mark.face else mark.edge
    given |= {"s": mark.size**2, "linewidths": edge}
    if mark.values is not None and mark.shades is not None:
        order = np.argsort((1.0 if mark.rising else -1.0) * mark.values, kind="stable")
        places, given = places[order], given | {"c": mark.values[order], **_colours(mark.shades)}
    elif mark.face:
        given |= {"facecolors": mark.face, "edgecolors": mark.colour}
    else:
        given["color"] = mark.colour
    axes.scatter(*places.T, **given)
