"""A plot for users: in notebooks, in files, or on matplotlib axes."""

from __future__ import annotations

import io
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.show.sketch.marks import Panel, Sketch
from photogram.show.sketch.svg import svg_of
from photogram.show.style import SETTINGS, new_figure
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
        from photogram.show.sketch.on_axes import lay_out, on_axes

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
        from photogram.show.sketch.on_axes import on_axes

        on_axes(self, ax)


def side_by_side(panels: Sequence[Panel], most: int, side: float, title: str = "") -> Plot:
    """Return a plot of square panels, `side` inches, at most `most` in a row."""
    columns = min(len(panels), most)
    height = side * -(-len(panels) // columns) + (0.3 if title else 0.0)
    return Plot(max(side * columns, 5.0), height, panels, columns, title=title)
