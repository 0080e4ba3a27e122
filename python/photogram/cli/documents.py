"""The forms in which commands write a result: options and files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.markup import escape

from photogram.cli.command_classes import misuse
from photogram.cli.console import output, print_document, print_remark, print_sections
from photogram.cli.job import Job, OutputFile, OutputFolder, Without
from photogram.cli.options import PictureFormat
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.io.writing import Content
    from photogram.results.network import AdjustedNetwork
    from photogram.show.forms import TitledLines
    from photogram.show.page import Document, Drawing
    from photogram.show.sketch.plot import Plot

TEXT, HTML = "report.txt", "report.html"


@dataclass(frozen=True)
class Documents:
    """Options for the forms of a result."""

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
        """Return the path of the browser report; None without a report."""
        if self.no_html:
            if self.html is not None:
                raise misuse("--no-html", "conflict", options="--html")
            return None
        return self.html or (out / HTML if out is not None else None)

    def announce(self, job: Job, out: Path | None, *names: str, picture: str = "") -> list[Path]:
        """Declare outputs: files, browser report and one plot; return its path."""
        drawn = []
        if picture and self.plots:
            if out is None:
                raise misuse("--plots", "requires", options="--out DIR")
            drawn = [out / f"{picture}.{self.plot_format}"]
        place = self.place(out)
        job.writes(*drawn, *(out / name for name in names if out is not None), *([place] if place else []))
        return drawn

    def page(
        self, job: Job, command: str, out: Path | None, make: Callable[[], Document], mark: str = ""
    ) -> dict[Path, bytes]:
        """Return the browser report; none, with a remark, if its contours require contourpy."""
        place = self.place(out)
        if place is None:
            return {}
        from photogram.show.html import page_html
        from photogram.show.run import reproducibility

        try:
            with job.status("drawing the report"):
                page = make()
                content = page_html(page.with_sections(reproducibility(job.run(command), page.phases)))
        except ModuleNotFoundError as error:
            if self.html is not None or error.name != "contourpy":
                raise
            if not job.quiet:
                print_remark(phrase("command.no-file", name=HTML, extra="report"))
            return {}
        return {place.with_stem(place.stem + mark): content}

    def check_plots(self, job: Job, out: Path | None) -> None:
        """Declare all plots of a network as outputs, if the user wants plots."""
        if not self.plots:
            return
        if out is None:
            raise misuse("--plots", "requires", options="--out DIR")
        from photogram.plots.accessor import PLOTS
        from photogram.show.style import MATPLOTLIB, need

        if self.plot_format != "svg":
            need(*MATPLOTLIB)
        job.writes(*(out / f"{name}.{self.plot_format}" for name in PLOTS))

    def plots_of(self, result: AdjustedNetwork, out: Path | None) -> dict[Path, bytes]:
        """Return the plots of a network as files, if the user wants plots."""
        return self._plot_files(result.plot.available, out)

    def drawings(self, make: Callable[[], Sequence[Drawing]], out: Path | None) -> dict[Path, bytes]:
        """Return drawings of a page as files, if the user wants plots."""
        return self._plot_files(lambda: {drawing.name: drawing.sketch() for drawing in make()}, out)

    def _plot_files(
        self, make: Callable[[], Mapping[str, Plot | None]], out: Path | None
    ) -> dict[Path, bytes]:
        if not self.plots or out is None:
            return {}
        ending, plots = self.plot_format, make()
        return {out / f"{name}.{ending}": plot.render(ending) for name, plot in plots.items() if plot}

    def as_json(self, result: Any) -> dict[Path, bytes]:
        """Return the file of `--json FILE`; none without it."""
        return {} if self.json is None else {self.json: result.to_json()}

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
            for remark in () if quiet else remarks:
                print_remark(remark)
        if self.ply is not None:
            from photogram.formats.crs_results import placed
            from photogram.formats.maps import point_cloud

            in_crs = placed(result, self.crs) if self.crs is not None and isinstance(result, Result) else None
            files[self.ply] = point_cloud(result, in_crs, origin=self.ply_origin or (0.0, 0.0, 0.0))
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
        result: Any,
        out: Path | None,
        *,
        text: bool = True,
        more: dict[Path, bytes] | None = None,
        above: Iterable[TitledLines] = (),
        tables: Sequence[str] = (),
        code: int | None = None,
    ) -> None:
        """Write a result and further files, print its report or tables, exit by its verdict."""

        def summarize() -> None:
            print_sections(above, "the report")
            if tables:
                print_document(result.document(), "the report", *tables)
            else:
                output.print(escape(result.report().removesuffix("\n")))

        document, page = self.as_json(result), self.page(job, command, out, result.document)
        texts = {out / TEXT: result.report().encode()} if text and out is not None else {}
        files = [texts, document, page] if texts else [{**(more or {}), **page}, document]
        job.finish(*files, summary=summarize, code=result.verdict.exit if code is None else code)


OF_NETWORKS = ("xlsx", "parquet", "crs", "map", "ply", "ply_origin")
OfPrograms = Annotated[Documents, Without(*OF_NETWORKS)]
PageAndJson = Annotated[Documents, Without("plots", "plot_format", *OF_NETWORKS)]


def check_maps(chart: Path | None) -> None:
    """Reject a map that cannot be written before the adjustment."""
    if chart is None:
        return
    from photogram.formats.maps.files import check_map

    check_map(chart)
    for package in ("geopandas", "pyogrio"):
        if find_spec(package) is None:
            raise ModuleNotFoundError(f"No module named {package!r}", name=package)
