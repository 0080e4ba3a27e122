"""`photogram info`, `convert`, `metadata` and `new`: projects and their files without adjustment."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, OutputFile, Reads, Writes
from photogram.cli.projects import EXAMPLE, read_project
from photogram.formats.read_options import ReadOptions
from photogram.messages import coded, listed
from photogram.words import phrase

CLASSES = {"h": "horizontal", "v": "vertical", "3d": "3D"}


@with_job("info", example=EXAMPLE)
def info(job: Job, *, path: Input, reading: ReadOptions) -> None:
    """Describe a project without adjustment: sizes, cameras, rays, units, frame, missing data.

    If the project requests an accuracy statement, the command describes the subject of the statement.
    """
    from photogram.formats.description import described
    from photogram.results.statement.request import Asked
    from photogram.results.statement.texts import Texts
    from photogram.show.page import Fact, Facts, Section

    project = read_project(job, path, reading)
    document = described(project)
    if project.statement:
        asked, texts = Asked.checked(**project.statement), Texts(unit=project.block.linear_unit)
        classes = [f"{CLASSES[name]} {texts.size(size)}" for name, size in asked.classes.items()]
        budgets = "three that are chosen" if asked.budgets is None else listed(list(asked.budgets)) or "none"
        facts = [
            Fact("Standards", ", ".join(asked.standards)),
            Fact("Classes", ", ".join(classes) or "none"),
            Fact.of("Check points", len(project.checks)),
            *([Fact.of("Calibrated lengths", len(asked.lengths))] if asked.lengths else []),
            Fact("Budgets", budgets),
        ]
        members = {
            "standards": list(asked.standards),
            "classes": dict(asked.classes),
            "check_points": len(project.checks),
            "calibrated_lengths": len(asked.lengths),
            "budgets": asked.budgets,
        }
        document = document.with_sections(Section("statement", "Accuracy statement", [Facts("", facts)]))
        document = document.with_members(lambda: {"statement": members})
    job.finish(document=document)


@with_job("convert", example=EXAMPLE)
def convert(
    job: Job,
    *,
    path: Input,
    out: Annotated[Path, Writes.EITHER],
    to: str | None = None,
    reading: ReadOptions,
) -> None:
    """Write a project in another format and list the data that the format cannot contain."""
    from photogram.formats import target
    from photogram.formats.description import described
    from photogram.formats.registry import losses
    from photogram.show.page import Remarks, Section, Text

    chosen = target(out, to)
    project = read_project(job, path, reading)
    lost = losses(project, chosen.format.name)
    sentences = [*map(str, lost)] or ["nothing"]
    document = described(project).with_sections(
        Section("written", "Written", [Text(f"{out}: {chosen.format.title} (--to {chosen.format.name})")]),
        Section("lost", "Lost, as the format has no place for it", [Remarks(sentences)]),
    )
    written = {"path": str(out), "format": chosen.format.name}
    document = document.with_members(lambda: {"written": written, "lost": coded(lost)})
    job.finish(chosen.files(project), document=document)


@with_job("metadata")
def metadata(
    job: Job,
    path: Annotated[Path, Reads.FILE],
    out: OutputFile = None,
    photos_crs: str | None = None,
    mrk_antenna: bool = False,
    sd: list[str] | None = None,
) -> None:
    """List positions of photographs from their files: EXIF, XMP, .MRK, geo.txt ...; write a table.

    Only metadata are read. Sources in order of priority: table geo.txt or of references, .MRK, XMP, EXIF. The
    order holds for positions and standard deviations separately.
    """
    from photogram.formats import read_metadata
    from photogram.formats.metadata.adding import gnss_files
    from photogram.formats.read_options import deviations

    given = deviations(sd or [])
    found = read_metadata(path, mrk_antenna=mrk_antenna)
    job.reads(*found.tables)
    files = {} if out is None else gnss_files(found, out, photos_crs, given.get("gnss"))
    job.finish(files, document=found.document())


Kind = Literal["block", "metrology", "survey", "rolling", "archive", "night", "board"]

SOURCES = {
    "block": EXAMPLE,
    "metrology": ("flange",),
    "survey": ("survey",),
    "rolling": ("rolling",),
    "archive": ("archive",),
    "night": ("exposures",),
    "board": ("board",),
}
"""Packaged examples, directories of photogram.examples."""


@with_job("new", json=False)
def new(
    job: Job,
    out: Annotated[Path, Writes.DIRECTORY],
    kind: Kind = "block",
    overwrite: bool = False,
) -> None:
    """Write a small real project as tables with comments on their contents.

    Replace the tables by your own. `photogram adjust DIR` adjusts the project, `photogram stellar-camera
    exposures DIR/night.toml` a night, `photogram calibrate DIR` views of a board.

    Kinds: block: photos of a drone with control. metrology: targets and scale bars without control. survey:
    enough check points for an accuracy statement. rolling: photos of a drone with a rolling shutter. archive:
    scanned film with fiducial marks. night: exposures of stars. board: corners of a chessboard.
    """
    from photogram.errors import InputError

    own = ("project.toml", "night.toml", "board.toml")
    if any((out / name).exists() for name in own) and not overwrite:
        raise InputError(phrase("command.project-exists"), file=out)
    source = job.packaged(*SOURCES[kind])
    files = {out / each.name: each.read_bytes() for each in sorted(source.iterdir()) if each.is_file()}
    job.finish(files)
