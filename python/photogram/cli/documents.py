"""What commands write of a result for whoever asks: options, and their files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Writes
from photogram.cli.maps import CloudFile, CloudOrigin, Crs, MapFile, drawn_maps, point_clouds
from photogram.cli.options import JsonFile, ParquetFolder, PictureFormat, PlotFormat, Plots, as_data
from photogram.cli.pictures import Pictures
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.io.writing import Content
    from photogram.results.network import AdjustedNetwork
    from photogram.show.page import Page

__all__ = ["NONE_ASKED", "OF_NETWORKS", "Documents"]

Workbook = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(
        metavar="FILE",
        help="Write the tables of the result as an Excel workbook, a sheet each; needs openpyxl.",
        show_default=False,
    ),
]


OF_NETWORKS = ("xlsx", "parquet", "crs", "map", "ply", "ply_origin")
"""Options that programs without a network do without."""


@dataclass(frozen=True)
class Documents:
    """In which forms a user wants a result, with the options that say it."""

    json: JsonFile = None
    xlsx: Workbook = None
    html: HtmlFile = None
    no_html: NoHtml = False
    plots: Plots = False
    plot_format: PlotFormat = PictureFormat.PNG
    parquet: ParquetFolder = None
    crs: Crs = None
    map: MapFile = None
    ply: CloudFile = None
    ply_origin: CloudOrigin = None

    def place(self, out: Path | None) -> Path | None:
        """Return where the report for the browser goes, of results in a directory."""
        return html_place(self.html, self.no_html, out)

    def page(
        self, job: Job, command: str, out: Path | None, make: Callable[[], Page], mark: str = ""
    ) -> dict[Path, bytes]:
        """Return the report for the browser; see :func:`photogram.cli.html.html_files`."""
        return html_files(job, command, self.place(out), self.html is not None, make, mark)

    def pictures(self, job: Job, out: Path | None) -> Pictures:
        """Return the pictures that are to be drawn; see :class:`photogram.cli.pictures.Pictures`."""
        return Pictures(job, self.plots, self.plot_format, out)

    def as_json(self, told: Any) -> dict[Path, bytes]:
        """Return the file of `--json FILE` of what has that form; none without it."""
        return {} if self.json is None else {self.json: told.to_json()}

    def charts(
        self,
        result: AdjustedNetwork,
        sizes: Sequence[tuple[float, float] | None] = (),
        *,
        quiet: bool = False,
    ) -> dict[Path, bytes]:
        """Return the files of `--map FILE` and `--ply FILE`; none without them."""
        from photogram import Result

        maps = (
            drawn_maps(result, self.map, self.crs, sizes, quiet=quiet) if isinstance(result, Result) else {}
        )
        return maps | point_clouds(result, self.ply, self.ply_origin, self.crs)

    def data(self, result: AdjustedNetwork) -> dict[Path, Content]:
        """Return the files of `--parquet DIR`; none without it."""
        return as_data(result, self.parquet)


NONE_ASKED = Documents()
"""The report for the browser, where there is a place for it; nothing else."""
