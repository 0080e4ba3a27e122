"""`photogram giant`: adjust a GIANT project."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from photogram.cli.check import EXAMPLE
from photogram.cli.components import (
    COMPONENTS,
    Components,
    UnitVarianceName,
    cleaned,
    estimated,
    with_components,
    with_components_page,
    with_weights,
)
from photogram.cli.console import ON_TOP, SHOWN, errors, print_sections
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.maps import CloudFile, CloudOrigin, MapFile, check_maps, drawn_maps, point_clouds
from photogram.cli.options import (
    KEPT,
    JsonFile,
    Ordering,
    OrderingName,
    ParquetFolder,
    PictureFormat,
    PlotFormat,
    Plots,
    Quiet,
    Snooping,
    Strict,
    Threads,
    as_data,
    default_out,
    out_option,
)
from photogram.cli.pictures import Pictures
from photogram.cli.progress import shown
from photogram.cli.projects import with_options
from photogram.cli.refraction import AirModel, WaterModel

if TYPE_CHECKING:
    from photogram import Block, Result, Snooped
    from photogram.adjustment.cleaning import Cleaned
    from photogram.giant import Project
    from photogram.giant.common import Common

__all__ = ["giant"]

RESULTS = ("FRAMES", "GROUND", "RESTART", "report.txt")
"""What goes to the output directory."""


@with_job
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
    json: JsonFile = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    plots: Plots = False,
    plot_format: PlotFormat = PictureFormat.PNG,
    parquet: ParquetFolder = None,
    map: MapFile = None,  # noqa: A002  # as the option is called
    ply: CloudFile = None,
    ply_origin: CloudOrigin = None,
    listing: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE",
            help="Write the printout of the 1987 program, page by page, as COMMON asks for it.",
            show_default=False,
        ),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published",
            help="Stop by the percent criterion and the limit of iterations of COMMON; list as in 1987.",
        ),
    ] = False,
    unit_variance: Annotated[
        UnitVarianceName | None,
        typer.Option(
            metavar="NAME",
            help="What the variance of unit weight is based on: all weighted values (`constrained`),"
            " redundancy numbers, or 1. Default: as COMMON says, with redundancy numbers for cameras that are"
            " free; with --as-published the rule of 1987 for these.",
            show_default=False,
        ),
    ] = None,
    components: Components = None,
    ordering: Ordering = OrderingName.AUTO,
    air_refraction: Annotated[
        AirModel | None,
        typer.Option(
            help="Refraction in air by the guide (to 9,000 m), by a standard atmosphere, or none, whatever"
            " COMMON asks for. Default where it does: giant.",
            show_default=False,
        ),
    ] = None,
    water_refraction: Annotated[
        WaterModel | None,
        typer.Option(
            help="Refraction in water by the guide or by Snell's law, below the level in COMMON, or none,"
            " whatever COMMON asks for. Default where it does: giant.",
            show_default=False,
        ),
    ] = None,
    water_index: Annotated[
        float | None,
        typer.Option(min=1, help="Refractive index of the water. Default: 1.340.", show_default=False),
    ] = None,
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
        from photogram.errors import AdjustmentError
        from photogram.formats.planes import plane_remarks
        from photogram.giant import Limits, read_project
        from photogram.results.report import summary
        from photogram.show.ways import page_of

        check_maps(map)
        if directory is None:
            directory = job.packaged(EXAMPLE)
            job.reads(directory)
            out = out or Path(f"{EXAMPLE}-adjusted")
        out = _output_directory(directory, out, overwrite)
        place = html_place(html, no_html, out)
        others = [*([out / COMPONENTS] if components else []), *([place] if place else [])]
        job.writes(*(out / name for name in RESULTS), *others)
        pictures = Pictures(job, plots, plot_format, out)
        project = read_project(directory)
        allowed = Limits.parse(limits) if limits else None
        block = _refracted(
            project.to_block(allowed), project.common, air_refraction, water_refraction, water_index
        )
        remarks = job.told([*project.messages, *plane_remarks(block, directory)])
        project = replace(project, messages=remarks)
        if snooping.snoop and (as_published or project.common.intersection_only):
            refused = "not with --as-published or an intersection"
            raise typer.BadParameter(refused, param_hint="--snoop")
        options = snooping.options if snooping.snoop else None
        try:
            result, log, made = _adjust(
                job, project, block, as_published, unit_variance, ordering, threads, options, components
            )
        except AdjustmentError:
            # What was remarked on while reading is often the reason.
            for message in project.messages[:SHOWN]:
                errors.print(escape(str(message)))
            raise
        written = _result_files(project, block, result, log, out, as_published)
        found = None if made else estimated(job, block, components, threads)
        weights = made or found
        if weights is not None:
            written[out / COMPONENTS] = weights.report().encode()
        written |= pictures.of(result)
        documents = html_files(
            job,
            "giant",
            place,
            html is not None,
            lambda: with_components_page(page_of(log or result), found, made),
        )
        if json is not None:
            documents[json] = (log or result).to_json()
        if listing is not None:
            from photogram.giant import listing as printout

            text = printout(project, block, result, as_published=as_published, limits=allowed)
            documents[listing] = text.encode()
        job.finish(
            written,
            documents,
            as_data(result, parquet),
            drawn_maps(result, map, None, quiet=quiet),
            point_clouds(result, ply, ply_origin),
            summary=lambda: print_sections(
                [
                    *with_weights(log.sections() if log else [], made),
                    *with_components(summary(result), found)[ON_TOP if log else 0 :],
                ],
                "report.txt",
            ),
            code=(found or log or result).verdict.exit_code(strict=strict),
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


def _refracted(
    block: Block, common: Common, air: AirModel | None, water: WaterModel | None, index: float | None
) -> Block:
    """Give the block of a project the refraction of COMMON and the options."""
    from photogram.giant.assembly import job_refraction

    refraction = job_refraction(
        common, air=air.value if air else None, water=water.value if water else None, index=index
    )
    if index is not None and (refraction is None or refraction.water is None):
        raise typer.BadParameter("there is no refraction in water", param_hint="--water-index")
    return block.replace(refraction=refraction)


def _adjust(
    job: Job,
    project: Project,
    block: Block,
    as_published: bool,
    unit_variance: UnitVarianceName | None,
    ordering: OrderingName,
    threads: int | None,
    snooping: dict[str, Any] | None,
    components: Components,
) -> tuple[Result, Snooped | None, Cleaned | None]:
    """Adjust the block as COMMON asks, or snoop it, with the progress on standard error."""
    from photogram import AsPublished, Result, adjust, snoop
    from photogram.diagnosis.adjusted import diagnosed, errors_explained

    common = project.common
    said = common.unit_variance if as_published else common.unbiased_variance
    basis = unit_variance.value if unit_variance else said
    with job.status("adjusting") as status, errors_explained(block):
        progress = shown(status, "weighted sum of squares", 1.0) if status is not None else None
        if snooping is not None:
            snooping["unit_variance"] = basis
            snooping["progress"] = progress
            made = cleaned(block, components, threads, snooping) if components else None
            log = made.snooped if made else snoop(block, threads=threads, **snooping)
            if not isinstance(log.result, Result):
                raise TypeError("a block gives the result of a block")
            result = diagnosed(log.result)
            result = replace(result, messages=[*project.messages, *result.messages])
            return result, replace(log, result=result), made
        result = adjust(
            block,
            unit_variance=basis,
            ordering=ordering.value,
            as_published=AsPublished(common.convergence_percent, common.max_iterations)
            if as_published
            else None,
            fix_photos=common.intersection_only,
            progress=progress,
            threads=threads,
            verdict=True,
        )
        result = diagnosed(result)
    return replace(result, messages=[*project.messages, *result.messages]), None, None


def _result_files(
    project: Project,
    block: Block,
    result: Result,
    log: Snooped | None,
    out: Path,
    as_published: bool,
) -> dict[Path, bytes]:
    """Make everything that goes to the output directory, before anything is written."""
    from photogram.giant.export import adjusted_records
    from photogram.giant.files import to_bytes
    from photogram.messages import Message

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
    return {**made, out / "report.txt": (log or result).report().encode()}
