"""The forms in which commands write a result: options and files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from rich.markup import escape

from photogram.cli.console import SUMMARY, errors, print_document, print_remark, print_text
from photogram.cli.job import Job
from photogram.cli.options import OutputFile, OutputFolder, Without, misuse
from photogram.extras import need
from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.io.writing import Content
    from photogram.results.network import AdjustedNetwork
    from photogram.show.page import Document
    from photogram.show.sketch.plot import Plot

TEXT, HTML = "report.txt", "report.html"
PictureFormat = Literal["png", "pdf", "svg"]


@dataclass(frozen=True)
class Documents:
    """Options for the forms of a result."""

    out: OutputFolder = None
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

    def __post_init__(self) -> None:
        if self.no_html and self.html is not None:
            raise misuse("--no-html", "conflict", options="--html")

    @property
    def folder(self) -> Path:
        """The output folder of a command that has one always."""
        assert self.out is not None
        return self.out

    @property
    def place(self) -> Path | None:
        """The path of the browser report; None without a report."""
        if self.no_html:
            return None
        return self.html or (self.out / HTML if self.out is not None else None)

    def inside(self, files: Mapping[str, Content]) -> dict[Path, Content]:
        """Return files of the output folder by their paths; none without a folder."""
        return {} if self.out is None else {self.out / name: each for name, each in files.items()}

    def unless_withheld(
        self, files: Mapping[str, Content], message: Phrase, *, usable: bool
    ) -> dict[Path, Content]:
        """Return files of the output folder; none, with a message, if the verdict forbids their use."""
        paths = self.inside(files)
        if usable:
            return paths
        errors.print(f"[bold red]error:[/] {escape(str(message))}")
        for path in filter(Path.exists, paths):
            print_remark(phrase("command.earlier-run", file=path))
        return {}

    def declare(self, job: Job, *names: str, pictures: Iterable[str] | None = ()) -> None:
        """Declare outputs: files, browser report, and requested plots; None: the plots of networks."""
        if self.plots:
            if self.out is None:
                raise misuse("--plots", "requires", options="--out DIR")
            from photogram.plots.accessor import PLOTS

            if self.plot_format != "svg":
                need("matplotlib")
            drawn = PLOTS if pictures is None else pictures
            names = (*names, *(f"{name}.{self.plot_format}" for name in drawn))
        place = self.place
        job.writes(*self.inside(dict.fromkeys(names, b"")), *([place] if place else []))

    def page(self, job: Job, make: Callable[[], Document], mark: str = "") -> dict[Path, bytes]:
        """Return the browser report; none, with a remark, if its contours require contourpy."""
        if self.place is None:
            return {}
        from photogram.show.html import page_html

        try:
            with job.status("drawing the report"):
                page = make()
                content = page_html(page.with_sections(job.reproducibility(page.phases)))
        except ModuleNotFoundError as error:
            if self.html is not None or error.name != "contourpy":
                raise
            job.remark(phrase("command.no-file", name=HTML, extra="report"))
            return {}
        return {self.place.with_stem(self.place.stem + mark): content}

    def pictures(self, make: Callable[[], Mapping[str, Plot | None]], mark: str = "") -> dict[Path, Content]:
        """Return plots by name as files, if the user wants plots."""
        if not self.plots:
            return {}
        drawn = {name: plot for name, plot in make().items() if plot is not None}
        ending = self.plot_format
        return self.inside({f"{name}{mark}.{ending}": plot.render(ending) for name, plot in drawn.items()})

    def of_network(
        self, job: Job, result: AdjustedNetwork, sizes: Sequence[tuple[float, float] | None]
    ) -> dict[Path, Content]:
        """Return the files of `--parquet`, `--xlsx`, `--map` and `--ply`, if the user wants them."""
        from photogram import Result

        files: dict[Path, Content] = {}
        if self.parquet is not None:
            files |= {self.parquet / name: content for name, content in result._files().items()}
        if self.xlsx is not None and isinstance(result, Result):
            from photogram.formats.results import excel_file

            files[self.xlsx] = excel_file(result)
        if self.map is not None and isinstance(result, Result):
            from photogram.formats.maps import map_files

            charts, remarks = map_files(result, self.map, self.crs, sizes=sizes)
            files |= charts
            job.remark(*remarks)
        if self.ply is not None:
            from photogram.formats.maps import point_cloud
            from photogram.formats.results import placed

            in_crs = placed(result, self.crs) if self.crs is not None and isinstance(result, Result) else None
            files[self.ply] = point_cloud(result, in_crs, origin=self.ply_origin or (0.0, 0.0, 0.0))
        return files

    def conclude(
        self,
        job: Job,
        result: Any,
        files: Mapping[str, Content] | None = None,
        *,
        document: Document | None = None,
        network: AdjustedNetwork | None = None,
        sizes: Sequence[tuple[float, float] | None] = (),
        plots: Callable[[], Mapping[str, Plot | None]] = dict,
        report: bool = True,
        beside: Mapping[Path, Content] | None = None,
        tables: Sequence[str] | None = None,
        remarks: Iterable[object] = (),
        code: int | None = None,
    ) -> None:
        """Write a result, print a summary, and exit by the verdict.

        Parameters
        ----------
        files, beside
            Further files of the output folder by name, and files in other places.
        document
            Document of the result; None: its own.
        network, sizes
            Adjusted network with plots, Parquet files and maps, and pixels of its photos.
        plots
            Further plots by name, in addition to the plots of a network.
        report
            Whether the text of the document is a file of the output folder.
        tables, remarks
            Tables or sections of the summary, and remarks below. None: the whole report of a result that is
            no network.
        code
            Exit code; None: of the verdict.
        """
        from photogram.show.forms import formatted, text

        made = document or result.document()
        made = made if network is None else formatted(made)
        texts = {TEXT: text(made).encode()} if report else {}

        def summarize() -> None:
            if network is None and tables is None:
                print_text(made)
                return
            keys = (*(SUMMARY if network is not None else ()), *(tables or ()))
            print_document(made, TEXT if report else "the report", *keys, remarks=remarks)

        job.finish(
            self.inside(texts | dict(files or {})),
            beside or {},
            lambda: self.page(job, lambda: made),
            lambda: self.pictures(
                lambda: {**({} if network is None else network.plot.available()), **plots()}
            ),
            lambda: job.as_json(result.to_json),
            lambda: {} if network is None else self.of_network(job, network, sizes),
            summary=summarize,
            code=result.verdict.exit if code is None else code,
        )


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
        need(package)
