"""Statements as commands make and write them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from photogram.cli.console import print_remark
from photogram.cli.job import Job

if TYPE_CHECKING:
    from photogram import Result
    from photogram.results.statement.statement import Statement


def stated(
    job: Job,
    result: Result,
    asked: Mapping[str, Any],
    *,
    command: str = "statement",
    crs: str | None = None,
    strict: bool = False,
    assumed: Sequence[str] = (),
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
    for name, needed, make in (
        ("statement.html", ("jinja2",), found.to_html),
        ("statement.pdf", ("reportlab", "matplotlib"), found.to_pdf),
    ):
        if all(map(find_spec, needed)):
            files[folder / name] = make()
        elif not job.quiet:
            extra = "pdf" if name.endswith(".pdf") else "report"
            print_remark(f"no {name}: pip install 'photogram[{extra}]'")
    return files
