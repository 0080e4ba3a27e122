"""Statements as commands make and write them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.console import print_remark
from photogram.cli.job import InputFile, Job, Without
from photogram.cli.projects import Additions
from photogram.lazy_dataclasses import dataclass, fields

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project
    from photogram.results.statement.statement import Statement
    from photogram.words import Phrase


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

    def check_alone(self) -> None:
        """Refuse these options of a command that makes no statement."""
        given = [each.name for each in fields(self) if getattr(self, each.name) is not None]
        if given:
            raise typer.BadParameter("requires --statement", param_hint=f"--{given[0].replace('_', '-')}")

    def asked(self, project: Project | None, added: Additions, unit: str) -> dict[str, Any]:
        """Return what a statement is asked for: by these options, else by the project; checked."""
        from photogram.formats.supplements import deviations
        from photogram.results.statement.request import Asked

        declared = {} if project is None else project.statement
        own = self.options(unit)
        asked = {**declared, **own, "classes": {**declared.get("classes", {}), **own.get("classes", {})}}
        sd = deviations(added.sd or []).get("check")
        if sd is not None:
            asked["sd"] = sd
        Asked.checked(**asked)
        return asked

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


OfHead = Annotated[
    Wanted,
    Without(
        "standard", "class_3d", "area", "without", "independent", "language", "text", "budget", "coverage"
    ),
]
"""The head of the page and the classes: what a project of another program has no place for."""


def _reason(given: str) -> tuple[str, str]:
    point, equals, reason = given.partition("=")
    if not (equals and point.strip() and reason.strip()):
        raise typer.BadParameter(f'{given!r} is not POINT="reason"', param_hint="--without")
    return point.strip(), reason.strip()


def stated(
    job: Job,
    result: Result,
    asked: Mapping[str, Any],
    *,
    command: str = "statement",
    crs: str | None = None,
    strict: bool = False,
    assumed: Sequence[Phrase | str] = (),
) -> Statement:
    """Return the statement of a result, with the files it was made of; dated today where no date is given."""
    from datetime import date

    from photogram import statement as made
    from photogram.formats.crs_results import placed
    from photogram.results.statement.given_coordinates import System

    run = job.run(command)
    system = None
    if crs is not None:
        place = placed(result, crs)
        (x, y, z), (u, v, w) = place.names, place.units
        system = System(crs, ((x, u), (y, v), (z, w)), place.carried)
    given = " ".join(name if value == "True" else f"{name} {value}" for name, value in run.options.items())
    return made(
        result,
        strict=strict,
        assumed=assumed,
        system=system,
        inputs=run.inputs,
        command=f"{run.command} {given}".rstrip(),
        **{"date": date.today().isoformat(), **asked},
    )


def statement_files(job: Job, found: Statement, folder: Path) -> dict[Path, bytes]:
    """Return all files of a statement; where what makes page or PDF is absent, that is told."""
    from photogram.results.statement.sheets import files_of_statement

    files = {folder / name: content for name, content in files_of_statement(found).items()}
    files[folder / "statement.json"] = found.to_json()
    for name, extra, library, make in (
        ("statement.html", "report", "jinja2", found.to_html),
        ("statement.pdf", "pdf", "typst", found.to_pdf),
    ):
        if find_spec(library):
            files[folder / name] = make()
        elif not job.quiet:
            print_remark(f"no {name}: pip install 'photogram[{extra}]'")
    return files
