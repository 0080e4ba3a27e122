"""`photogram statement`: an accuracy statement that one may hand over."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.adjust import result_at
from photogram.cli.console import print_remark, print_sections
from photogram.cli.documents import Crs
from photogram.cli.job import InputFile, Job, OutputFolder, with_job
from photogram.cli.options import Quiet, Strict, Threads, default_out, out_option
from photogram.cli.projects import Additions, Example, ProjectPath
from photogram.cli.statement_output import stated, statement_files
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project
    from photogram.results.statement.statement import Statement
    from photogram.show.sections import Section


def _text(name: str, what: str, metavar: str = "TEXT") -> Any:
    return typer.Option(f"--{name}", metavar=metavar, help=what)


Word = str | None


@dataclass(frozen=True)
class Wanted:
    """What is asked of a statement, with the options that say it; a project may say it too."""

    standard: Annotated[
        Word, _text("standard", "plain, asprs-2023, nssda, vdi-2634, iso-19157.", "NAME,..")
    ] = None
    class_h: Annotated[Word, _text("class-h", "Horizontal accuracy class: 5cm.", "LENGTH")] = None
    class_v: Annotated[Word, _text("class-v", "Vertical accuracy class: 10cm.", "LENGTH")] = None
    class_3d: Annotated[Word, _text("class-3d", "Three-dimensional accuracy class.", "LENGTH")] = None
    area: Annotated[
        Word, _text("area", "Area of the product: 12.5km2. Default: hull of the adjusted points.", "AREA")
    ] = None
    without: Annotated[
        list[str] | None,
        _text("without", "Give figures without a check point beside, with the reason.", "POINT=REASON"),
    ] = None
    independent: Annotated[
        Literal["yes", "same-base", "no"] | None,
        typer.Option(help="Declare whether check points are independent of the block."),
    ] = None
    language: Annotated[Literal["en", "de"] | None, typer.Option(help="Of the page. Default: en.")] = None
    text: Annotated[InputFile, typer.Option(metavar="FILE", help="Sentences of a firm: TOML, by key.")] = None
    budget: Annotated[
        list[str] | None,
        _text("budget", "Take a quantity apart: 'point C08 z', 'distance C01 C30' ..", "QUANTITY"),
    ] = None
    coverage: Annotated[
        float | None,
        typer.Option(
            metavar="P", min=0.01, max=0.999999, help="Probability of expanded uncertainties. Default: 0.95."
        ),
    ] = None
    project: Annotated[Word, _text("project", "Project, for the head of the page.")] = None
    client: Annotated[Word, _text("client", "Client.")] = None
    firm: Annotated[Word, _text("firm", "Firm.")] = None
    surveyor: Annotated[Word, _text("surveyor", "Who signs.")] = None
    date: Annotated[Word, _text("date", "Date of the statement (2026-11-25). Default: today.")] = None

    def options(self, unit: str) -> dict[str, Any]:
        """Return what :meth:`photogram.Result.statement` takes of it; `unit` is that of the block."""
        from photogram.formats.plain.statement_settings import read_sentences
        from photogram.results.statement.request import length_of

        sizes = {"h": self.class_h, "v": self.class_v, "3d": self.class_3d}
        classes = {name: length_of(size, unit) for name, size in sizes.items() if size is not None}
        found: dict[str, Any] = {
            "standards": self.standard
            and tuple(each.strip() for each in self.standard.split(",") if each.strip()),
            "classes": classes or None,
            "area": None if self.area is None else length_of(self.area, unit, area=True),
            "without": dict(map(_reason, self.without)) if self.without else None,
            "independent": self.independent,
            "language": self.language,
            "text": None if self.text is None else read_sentences(self.text),
            "budgets": tuple(self.budget) if self.budget else None,
            "coverage": self.coverage,
        }
        found |= {name: getattr(self, name) for name in ("project", "client", "firm", "surveyor", "date")}
        return {name: value for name, value in found.items() if value is not None}


def _reason(given: str) -> tuple[str, str]:
    point, equals, reason = given.partition("=")
    if not (equals and point.strip() and reason.strip()):
        raise typer.BadParameter(f'{given!r} is not POINT="reason"', param_hint="--without")
    return point.strip(), reason.strip()


@with_job
def statement(
    job: Job,
    *,
    path: ProjectPath = None,
    example: Example = False,
    out: Annotated[
        OutputFolder, out_option("Directory for the page, PDF, JSON and tables. Default: PATH-statement.")
    ] = None,
    wanted: Wanted,
    crs: Crs = None,
    added: Additions,
    threads: Threads = None,
    strict: Strict = False,
    quiet: Quiet = False,
) -> None:
    """State how accurate a block is, by whose standard, found how, assuming what: a page to hand over.

    PATH is a result that `photogram adjust --parquet` has written, or a project, which is adjusted first.
    Of a result in the folder of its project, what the project asks for is taken.
    Check points need standard deviations of their survey: in the table of control, or --sd check=0.01.
    --example is that of `photogram new --kind survey`.
    """
    source = job.packaged("survey") if path is None else path
    target = out or (Path("example-statement") if example else default_out(source, "-statement"))
    with job:
        from photogram.formats.supplements import deviations

        result, project = result_at(job, source, added, threads)
        project = project or _project_beside(job, source, result)
        declared = {} if project is None else project.statement
        assumed = () if project is None else project.lacks
        own = wanted.options(result.block.linear_unit)
        classes = {**declared.get("classes", {}), **own.get("classes", {})}
        asked = {**declared, **own, "classes": classes}
        sd = deviations(added.sd or []).get("check")
        if sd is not None:
            asked["sd"] = sd
        with job.status("stating"):
            found = stated(job, result, asked, crs=crs, strict=strict, assumed=assumed)
            files = statement_files(job, found, target)
        job.finish(files, summary=lambda: print_sections(_summary(found), "statement.json"), code=found.exit)


def _summary(found: Statement) -> list[Section]:
    """Return what is told on the screen: what the page says first."""
    return [
        (found.texts("page.what"), [found.headline]),
        (found.texts("page.figures"), [text for _, text in found.judged.sentences]),
        *([(found.texts("page.remarks"), found.judged.remarks)] if found.judged.remarks else []),
    ]


def _project_beside(job: Job, folder: Path, result: Result) -> Project | None:
    """Return the plain project in whose folder a result lies that was read as data; None where there is none.

    One of another block is told, and not taken.
    """
    from photogram.formats import read

    settings = folder.resolve().with_name("project.toml")
    if not settings.is_file():
        return None
    # Of its files only this one says something of the statement: the figures are those of the result.
    job.reads(settings)
    project = read(settings.parent, "plain")
    own, block = result.block, project.block
    if set(own.photo_ids) == set(block.photo_ids) and set(own.point_ids) == set(block.point_ids):
        return project
    print_remark(f"{settings} is of another block than {folder}: what it asks for is not taken")
    return None
