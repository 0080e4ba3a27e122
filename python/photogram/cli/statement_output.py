"""Creation and output of accuracy statements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.arguments.fields import option
from photogram.cli.job import Job
from photogram.cli.options import InputFile, Without, misuse, words_of
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import asdict, dataclass
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.formats import Project
    from photogram.results.statement.statement import Statement
    from photogram.words import Phrase


def _reasons(texts: Sequence[str]) -> dict[str, str]:
    reasons = [text.partition("=") for text in texts]
    if not all(equals and point.strip() and reason.strip() for point, equals, reason in reasons):
        raise ValueError('POINT="reason"')
    return {point.strip(): reason.strip() for point, _, reason in reasons}


def _figures(text: str) -> tuple[float, ...]:
    try:
        return tuple(map(float, text.split(",")))
    except ValueError:
        raise ValueError("NUMBER,..") from None


@dataclass(frozen=True)
class StatementOptions:
    """Options of an accuracy statement; a project can define them, too."""

    standards: tuple[str, ...] | None = option(None, kind=str, parse=words_of, name="--standard")
    class_h: str | None = None
    class_v: str | None = None
    class_3d: str | None = None
    area: str | None = None
    without: Mapping[str, str] | None = option(None, kind=list[str], parse=_reasons)
    independent: Literal["yes", "same-base", "no"] | None = None
    survey_common_sd: tuple[float, ...] | None = option(None, kind=str, parse=_figures)
    survey_common_in_control: bool | None = None
    language: Literal["en", "de"] | None = None
    text: InputFile = None
    budgets: tuple[str, ...] | None = option(None, kind=list[str], parse=tuple, name="--budget")
    coverage: Annotated[float | None, typer.Option(min=0.01, max=0.999999)] = None
    limit: tuple[float, ...] | None = option(None, kind=str, parse=_figures, name="--length-limit")
    expansion: float | None = None
    title: str | None = None
    project: str | None = None
    client: str | None = None
    firm: str | None = None
    surveyor: str | None = None
    date: str | None = None

    @property
    def given(self) -> dict[str, Any]:
        """Options of the user by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    def check_alone(self) -> None:
        """Reject these options for a command without a statement."""
        if names := list(self.given):
            raise misuse(f"--{names[0].replace('_', '-')}", "requires", options="--statement")

    def asked(self, project: Project | None, reading: ReadOptions, unit: str) -> dict[str, Any]:
        """Return checked settings of a statement from options or project; lengths are in a unit."""
        from photogram.formats.plain.settings import read_sentences
        from photogram.results.statement.request import Asked, length_of

        declared = {} if project is None else project.statement
        own = self.given
        names = [name for name in own if name.startswith("class_")]
        classes = {name.removeprefix("class_"): length_of(own.pop(name), unit) for name in names}
        asked = {**declared, **own, "classes": {**declared.get("classes", {}), **classes}}
        if self.area is not None:
            asked["area"] = length_of(self.area, unit, area=True)
        if self.text is not None:
            asked["text"] = read_sentences(self.text)
        sd = reading.sd.get("check")
        if sd is not None:
            asked["sd"] = sd
        Asked.checked(**asked)
        return asked


OfHead = Annotated[
    StatementOptions,
    Without(
        *("standards", "class_3d", "area", "without", "independent", "language", "text", "budgets"),
        *("coverage", "survey_common_sd", "survey_common_in_control", "limit", "expansion"),
    ),
]
"""Options for the head of the page and the classes, for projects of other programs."""


def stated(
    job: Job,
    result: Result,
    asked: Mapping[str, Any],
    *,
    crs: str | None = None,
    strict: bool = False,
    assumed: Sequence[Phrase | str] = (),
) -> Statement:
    """Return the statement of a result with input files and date."""
    from datetime import date

    from photogram import statement as made
    from photogram.formats.results import placed
    from photogram.results.statement.comparison import System

    system = None
    if crs is not None:
        place = placed(result, crs)
        (x, y, z), (u, v, w) = place.names, place.units
        system = System(crs, ((x, u), (y, v), (z, w)), place.carried)
    given = " ".join(name if value == "True" else f"{name} {value}" for name, value in job.given.items())
    return made(
        result,
        strict=strict,
        assumed=assumed,
        system=system,
        inputs=job.input_files()[0],
        command=f"photogram {job.name} {given}".rstrip(),
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
    else:
        job.remark(phrase("command.no-file", name="statement.pdf", extra="pdf"))
    return files
