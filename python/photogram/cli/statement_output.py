"""Creation and output of accuracy statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.console import print_remark
from photogram.cli.job import InputFile, Job, Without
from photogram.cli.projects import Additions
from photogram.lazy_dataclasses import dataclass, fields
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project
    from photogram.results.statement.statement import Statement
    from photogram.words import Phrase


@dataclass(frozen=True)
class StatementOptions:
    """Options of an accuracy statement; a project can define them, too."""

    standard: str | None = None
    class_h: str | None = None
    class_v: str | None = None
    class_3d: str | None = None
    area: str | None = None
    without: list[str] | None = None
    independent: Literal["yes", "same-base", "no"] | None = None
    language: Literal["en", "de"] | None = None
    text: InputFile = None
    budget: list[str] | None = None
    coverage: Annotated[float | None, typer.Option(min=0.01, max=0.999999)] = None
    project: str | None = None
    client: str | None = None
    firm: str | None = None
    surveyor: str | None = None
    date: str | None = None

    def check_alone(self) -> None:
        """Reject these options for a command without a statement."""
        given = [each.name for each in fields(self) if getattr(self, each.name) is not None]
        if given:
            raise misuse(f"--{given[0].replace('_', '-')}", "requires", options="--statement")

    def asked(self, project: Project | None, added: Additions, unit: str) -> dict[str, Any]:
        """Return checked settings of a statement from options or project."""
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
        """Return arguments of :meth:`photogram.Result.statement` for a unit."""
        from photogram.formats.plain.keys import read_sentences
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
    StatementOptions,
    Without(
        "standard", "class_3d", "area", "without", "independent", "language", "text", "budget", "coverage"
    ),
]
"""Options for the head of the page and the classes, for projects of other programs."""


def _reason(given: str) -> tuple[str, str]:
    point, equals, reason = given.partition("=")
    if not (equals and point.strip() and reason.strip()):
        raise misuse("--without", "form", form='POINT="reason"', value=given)
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
    """Return the statement of a result with input files and date."""
    from datetime import date

    from photogram import statement as made
    from photogram.formats.crs_results import placed
    from photogram.results.statement.comparison import System

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
    """Return all files of a statement, with a remark if the package for PDF is missing."""
    from photogram.results.statement.tables import files_of_statement

    files = {folder / name: content for name, content in files_of_statement(found).items()}
    files[folder / "statement.json"] = found.to_json()
    files[folder / "statement.html"] = found.to_html()
    if find_spec("typst"):
        files[folder / "statement.pdf"] = found.to_pdf()
    elif not job.quiet:
        print_remark(phrase("command.no-file", name="statement.pdf", extra="pdf"))
    return files
