"""`photogram giant`: adjust a GIANT project."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.check import EXAMPLE
from photogram.cli.components import COMPONENTS, Found
from photogram.cli.console import print_sections
from photogram.cli.documents import NONE_ASKED, Documents
from photogram.cli.giant_project import AS_TOLD, How, adjusted_project, project_and_block
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.maps import check_maps
from photogram.cli.options import KEPT, Quiet, Snooping, Strict, Threads, default_out, out_option
from photogram.cli.projects import with_options

if TYPE_CHECKING:
    from photogram import Block, Result
    from photogram.giant import Project

__all__ = ["giant"]

RESULTS = ("FRAMES", "GROUND", "RESTART", "report.txt")
"""What goes to the output directory."""


@with_job
@with_options("documents", Documents, "xlsx", "crs")
@with_options("how", How)
@with_options("snooping", Snooping)
def giant(
    job: Job,
    directory: Annotated[
        Path | None,
        Reads.PROJECT,
        typer.Argument(
            metavar="DIR",
            help="Directory of COMMON, CAMERAS, IMAGES, FRAMES, GROUND (any letter case, any extension).",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option(
            "--example", help="Adjust the packaged example instead: 20 photographs at Galveston Bay."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        Writes.DIRECTORY,
        out_option(
            "Directory for adjusted stations and points and report. Default: DIR-adjusted beside DIR."
        ),
    ] = None,
    documents: Documents = NONE_ASKED,
    listing: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE",
            help="Write the printout of the 1987 program, page by page, as COMMON asks for it.",
            show_default=False,
        ),
    ] = None,
    how: How = AS_TOLD,
    threads: Threads = None,
    snooping: Snooping = KEPT,
    limits: Annotated[
        str | None,
        typer.Option(
            metavar="N1=..,N6=..",
            help="Limits of the 1987 program: N1 stations, N2 points, N3 control, N4 photographs of a point,"
            " N5 cameras, N6 bandwidth. Default: none.",
            show_default=False,
        ),
    ] = None,
    strict: Strict = False,
    quiet: Quiet = False,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Allow --out to be a directory with another GIANT project in it."),
    ] = False,
) -> None:
    """Adjust a GIANT project: photographs, points and their covariances.

    Writes FRAMES and GROUND (adjusted, when converged), RESTART (stations of the last iteration), report.html
    and report.txt.
    """
    with job:
        from photogram.results.report import summary

        check_maps(documents.map)
        if directory is None:
            directory = job.packaged(EXAMPLE)
            job.reads(directory)
            out = out or Path(f"{EXAMPLE}-adjusted")
        out = _output_directory(directory, out, overwrite)
        place = documents.place(out)
        others = [*([out / COMPONENTS] if how.components else []), *([place] if place else [])]
        job.writes(*(out / name for name in RESULTS), *others)
        pictures = documents.pictures(job, out)
        project, block, allowed = project_and_block(job, directory, limits, how)
        if snooping.snoop and (how.as_published or project.common.intersection_only):
            refused = "not with --as-published or an intersection"
            raise typer.BadParameter(refused, param_hint="--snoop")
        found = adjusted_project(job, project, block, how, threads, snooping)
        written = _result_files(project, block, found, out, how.as_published)
        found = found.estimated(job, block, how.components, threads)
        written |= found.files(out) | pictures.of(found.result)
        asked = documents.page(job, "giant", out, found.page) | documents.as_json(found.told)
        if listing is not None:
            from photogram.giant import listing as printout

            text = printout(project, block, found.result, as_published=how.as_published, limits=allowed)
            asked[listing] = text.encode()
        job.finish(
            written,
            asked,
            documents.data(found.result),
            documents.charts(found.result, quiet=quiet),
            summary=lambda: print_sections(found.summary(summary(found.result)), "report.txt"),
            code=found.verdict.exit_code(strict=strict),
        )


def _output_directory(directory: Path, out: Path | None, overwrite: bool) -> Path:
    """Choose where results go: not over another project unless told, and then not beside its files."""
    from photogram.errors import InputError
    from photogram.giant.files import present_files

    if out is None:
        return default_out(directory, "-adjusted")
    if not out.is_dir():
        return out
    present = present_files(out)
    inputs = [path.name for name in ("COMMON", "CAMERAS", "IMAGES") for path in present[name]]
    if inputs and not overwrite:
        raise InputError(f"holds another project ({', '.join(inputs)}); --overwrite allows it", file=out)
    for name in set(RESULTS) & set(present):
        others = [path for path in present[name] if path.name != name]
        if inputs and others:
            raise InputError(f"the project there would have a second {name}", file=others[0])
    return out


def _result_files(
    project: Project, block: Block, found: Found[Result], out: Path, as_published: bool
) -> dict[Path, bytes]:
    """Make everything that goes to the output directory, before anything is written."""
    from photogram.giant.export import adjusted_records
    from photogram.giant.files import to_bytes
    from photogram.messages import Message

    result = found.result
    records = adjusted_records(
        project,
        block,
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        point_positions=result.point_positions,
        converged=result.converged,
        as_published=as_published,
    )
    if "RESTART" not in records:
        result.messages.append(
            Message("RESTART is not written: the stations are beyond what its columns hold")
        )
    made = {out / name: to_bytes(lines) for name, lines in records.items()}
    return {**made, out / "report.txt": found.told.report().encode()}
