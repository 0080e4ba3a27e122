"""In which forms commands write a result for whoever asks: options, and the files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from photogram.cli.console import output, print_remark, print_sections
from photogram.cli.job import Job, OutputFile, OutputFolder, Without
from photogram.cli.options import PictureFormat
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.io.writing import Content
    from photogram.results.network import AdjustedNetwork
    from photogram.show.page import Document, Drawing
    from photogram.show.sections import Section
    from photogram.show.sketch.plot import Plot

TEXT, HTML = "report.txt", "report.html"
"""The reports, in a directory of results."""
NEEDED = ("jinja2", "contourpy")
"""What makes that for the browser: the extra `report`."""


@dataclass(frozen=True)
class Documents:
    """In which forms a user wants a result, with the options that say it."""

    json: OutputFile = None
    xlsx: OutputFile = None
    html: OutputFile = None
    no_html: bool = False
    plots: bool = False
    plot_format: PictureFormat = "png"
    parquet: OutputFolder = None
    crs: str | None = None
    map: OutputFile = None
    ply: OutputFile = None
    ply_origin: tuple[float, float, float] | None = None

    def place(self, out: Path | None) -> Path | None:
        """Return where the report for the browser goes, of results in a directory; None where to none."""
        if self.no_html:
            if self.html is not None:
                raise typer.BadParameter("goes without --html", param_hint="--no-html")
            return None
        return self.html or (out / HTML if out is not None else None)

    def announce(self, job: Job, out: Path | None, *names: str, picture: str = "") -> list[Path]:
        """Name the files that are going to be written: in a directory of results, the page, one picture.

        Returns where that picture goes: to the results, or nowhere.
        """
        drawn = []
        if picture and self.plots:
            if out is None:
                raise typer.BadParameter("goes with --out DIR", param_hint="--plots")
            drawn = [out / f"{picture}.{self.plot_format}"]
        place = self.place(out)
        job.writes(*drawn, *(out / name for name in names if out is not None), *([place] if place else []))
        return drawn

    def page(
        self, job: Job, command: str, out: Path | None, make: Callable[[], Document], mark: str = ""
    ) -> dict[Path, bytes]:
        """Return the report for the browser; see :func:`html_files`."""
        return html_files(job, command, self.place(out), self.html is not None, make, mark)

    def pictures(self, job: Job, out: Path | None) -> Pictures:
        """Return the pictures that are to be drawn."""
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

        files: dict[Path, bytes] = {}
        if self.map is not None and isinstance(result, Result):
            from photogram.formats.maps import map_files

            files, remarks = map_files(result, self.map, self.crs, sizes=sizes)
            for each in () if quiet else remarks:
                print_remark(each)
        if self.ply is not None:
            from photogram.formats.crs_results import placed
            from photogram.formats.maps import point_cloud

            found = placed(result, self.crs) if self.crs is not None and isinstance(result, Result) else None
            origin = self.ply_origin or (0.0, 0.0, 0.0)
            files |= {self.ply: point_cloud(result, found, origin=origin)}
        return files

    def data(self, result: AdjustedNetwork) -> dict[Path, Content]:
        """Return the files of `--parquet DIR`; none without it."""
        if self.parquet is None:
            return {}
        return {self.parquet / name: content for name, content in result._files().items()}

    def conclude(
        self,
        job: Job,
        command: str,
        found: Any,
        out: Path | None,
        *,
        text: bool = True,
        more: dict[Path, bytes] | None = None,
        above: Iterable[Section] = (),
        tables: Sequence[str] = (),
        code: int | None = None,
    ) -> None:
        """Write and print a result that has a report, a page and a document, and end by its verdict.

        Parameters
        ----------
        job, command, found, out
            The run, its name after `photogram`, the result, and the directory for its files.
        text
            Whether the report goes there as text, too.
        more
            Further files.
        above
            What is printed above the report.
        tables
            Keys of tables: a summary with these tables is printed instead of the report.
        code
            The exit code, where it is not that of the verdict.
        """
        from photogram.show.forms import summary

        def summarize() -> None:
            print_sections(above, "the report")
            lines = summary(found.document(), *tables) if tables else found.report().splitlines()
            for line in lines:
                output.print(escape(line))

        document, page = self.as_json(found), self.page(job, command, out, found.document)
        texts = {out / TEXT: found.report().encode()} if text and out is not None else {}
        files = [texts, document, page] if texts else [{**(more or {}), **page}, document]
        job.finish(*files, summary=summarize, code=found.verdict.exit if code is None else code)


OF_NETWORKS = ("xlsx", "parquet", "crs", "map", "ply", "ply_origin")
OfPrograms = Annotated[Documents, Without(*OF_NETWORKS)]
"""Of programs without a network."""
PageAndJson = Annotated[Documents, Without("plots", "plot_format", *OF_NETWORKS)]
"""Of results without pictures of their own."""


def html_files(
    job: Job, command: str, place: Path | None, asked: bool, make: Callable[[], Document], mark: str = ""
) -> dict[Path, bytes]:
    """Return the report of a run; nothing, with a remark, where what makes it is absent and nobody asked.

    Parameters
    ----------
    job, command
        The run, and its name after `photogram`.
    place
        Where it goes; None: nowhere.
    asked
        Whether the user named the place: then what is absent is an error.
    make
        Makes what it says, without its last section.
    mark
        Stands in the name of the file, before its ending.

    Raises
    ------
    ModuleNotFoundError
        jinja2, or contourpy of a page that takes it, is absent, and the report was asked for.
    """
    if place is None:
        return {}
    from photogram.show.html import page_html
    from photogram.show.run import reproducibility

    try:
        with job.status("drawing the report"):
            page = make()
            content = page_html(page.with_sections(reproducibility(job.run(command), page.phases)))
    except ModuleNotFoundError as error:
        # Most pages have no picture that takes contourpy: which do is known when they are drawn.
        if asked or error.name not in NEEDED:
            raise
        if not job.quiet:
            print_remark(f"no {HTML}: pip install 'photogram[report]'")
        return {}
    return {place.with_stem(place.stem + mark): content}


def check_maps(chart: Path | None) -> None:
    """Refuse, before anything is adjusted, a map that cannot be written."""
    if chart is None:
        return
    from photogram.formats.maps.files import check_map

    check_map(chart)
    for package in ("geopandas", "pyogrio"):
        if find_spec(package) is None:
            raise ModuleNotFoundError(f"No module named {package!r}", name=package)


class Pictures:
    """All pictures of a network that a command has to draw, beside the report, or none.

    Parameters
    ----------
    job
        Learns which files there may be.
    plots, ending
        Whether, and in which format.
    out
        The directory of the results.

    Raises
    ------
    BadParameter
        Pictures, but no directory.
    ModuleNotFoundError
        matplotlib is absent, and the format is not SVG: raised before anything is computed.
    """

    def __init__(self, job: Job, plots: bool, ending: PictureFormat, out: Path | None) -> None:
        self._out = out if plots else None
        self._ending = ending
        if not plots:
            return
        if out is None:
            raise typer.BadParameter("goes with --out DIR", param_hint="--plots")
        from photogram.plots.accessor import PLOTS
        from photogram.show.style import need_matplotlib

        if ending != "svg":
            need_matplotlib()
        job.writes(*(out / f"{name}.{ending}" for name in PLOTS))

    def of(self, result: AdjustedNetwork) -> dict[Path, bytes]:
        """Return the pictures of a result as files."""
        if self._out is None:
            return {}
        return self._files(result.plot.available())

    def of_drawings(self, make: Callable[[], Sequence[Drawing]]) -> dict[Path, bytes]:
        """Return pictures that a page has, too, as files."""
        if self._out is None:
            return {}
        plots = {each.name: each.sketch() for each in make()}
        return self._files({name: plot for name, plot in plots.items() if plot is not None})

    def _files(self, plots: Mapping[str, Plot]) -> dict[Path, bytes]:
        assert self._out is not None
        paths = {self._out / f"{name}.{self._ending}": plot for name, plot in plots.items()}
        return {path: plot.render(self._ending) for path, plot in paths.items()}
