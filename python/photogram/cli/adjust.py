"""`photogram adjust`: adjust whatever lies at a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from photogram.cli.components import UnitVarianceName
from photogram.cli.console import NOT_CONVERGED, ON_TOP, output, print_remark, print_sections
from photogram.cli.division import WHOLE, Parts
from photogram.cli.html import HtmlFile, NoHtml, html_files, html_place
from photogram.cli.job import Job, Writes, with_job
from photogram.cli.maps import CloudFile, CloudOrigin, Crs, MapFile, check_maps, drawn_maps, point_clouds
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
from photogram.cli.projects import (
    NOTHING,
    Additions,
    Example,
    ProjectPath,
    described,
    project_path,
    read_project,
    with_additions,
    with_options,
)

if TYPE_CHECKING:
    from photogram import Block, FirstValues, Result
    from photogram.adjustment.elsewhere import Division
    from photogram.formats import Project
    from photogram.results.snooped import Snooped

__all__ = ["adjust", "adjusted_block", "started_block"]


class DatumName(StrEnum):
    """What coordinates refer to."""

    CONTROL = "control"
    MINIMUM = "minimum"
    INNER = "inner"


class LossName(StrEnum):
    """What is minimised."""

    NONE = "none"
    HUBER = "huber"
    CAUCHY = "cauchy"


@with_job
@with_options("divided", Parts)
@with_options("snooping", Snooping)
@with_additions()
def adjust(
    job: Job,
    path: ProjectPath = None,
    example: Example = False,
    out: Annotated[
        Path | None,
        Writes.DIRECTORY,
        out_option("Directory for reports, tables, and the adjusted project. Default: PATH-adjusted."),
    ] = None,
    json: JsonFile = None,
    xlsx: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE",
            help="Write the tables of the result as an Excel workbook, a sheet each; needs openpyxl.",
            show_default=False,
        ),
    ] = None,
    html: HtmlFile = None,
    no_html: NoHtml = False,
    plots: Plots = False,
    plot_format: PlotFormat = PictureFormat.PNG,
    parquet: ParquetFolder = None,
    crs: Crs = None,
    map: MapFile = None,  # noqa: A002  # as the option is called
    ply: CloudFile = None,
    ply_origin: CloudOrigin = None,
    added: Additions = NOTHING,
    datum: Annotated[
        DatumName | None,
        typer.Option(
            help="What coordinates refer to. Default: what PATH says, else control, or minimum constraints.",
            show_default=False,
        ),
    ] = None,
    hold: Annotated[
        str | None,
        typer.Option(
            metavar="POINT=AXES,...",
            help="Held coordinates, in the place of control: A=XYZ,B=YZ,C=Z (3-2-1).",
            show_default=False,
        ),
    ] = None,
    loss: Annotated[
        LossName | None,
        typer.Option(help="Robust loss of image coordinates. Default: what PATH says.", show_default=False),
    ] = None,
    unit_variance: Annotated[
        UnitVarianceName | None,
        typer.Option(
            metavar="NAME",
            help="What the variance of unit weight is based on: `constrained` (all weighted values),"
            " `redundancy` (numbers), or `unity`: 1. Default: what PATH says, else constrained.",
            show_default=False,
        ),
    ] = None,
    self_calibrate: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME",
            help="Parameters of cameras that are unknown (f,cx,cy,k1 ...), or `all`.",
            show_default=False,
        ),
    ] = None,
    snooping: Snooping = KEPT,
    keep_all: Annotated[
        bool,
        typer.Option(
            "--keep-all",
            help="Begin with all images, those too that first values would set aside.",
        ),
    ] = False,
    divided: Parts = WHOLE,
    ordering: Ordering = OrderingName.AUTO,
    threads: Threads = None,
    strict: Strict = False,
    quiet: Quiet = False,
) -> None:
    """Adjust a block in whatever files it lies: tables, COLMAP, OpenDroneMap, BlocksExchange, GIANT ...

    Photos without a pose are oriented first. The report, the tables of photos, points, images and all other
    observations with their standard deviations, redundancy numbers and test values, and the adjusted project
    go to --out.
    """
    path = project_path(job, path)
    target = out or (Path("example-adjusted") if example else default_out(path, "-adjusted"))
    place = html_place(html, no_html, target)
    with job:
        from photogram import Result
        from photogram.formats.additions import held_points, self_calibrated
        from photogram.results.fitting import with_features
        from photogram.show.ways import page_of

        pictures = Pictures(job, plots, plot_format, target)
        if (
            divided.division.is_asked_for
            and added == NOTHING
            and _on_disk(job, path, target, divided, threads)
        ):
            return
        project = read_project(job, path, added)
        check_maps(map)  # now that all inputs are known, which it must not be
        wanted = [name.strip() for name in self_calibrate.split(",")] if self_calibrate else []
        project = self_calibrated(project, wanted)
        project = held_points(project, [each.strip() for each in hold.split(",")] if hold else [])
        if unit_variance is not None:
            project = project.replace(options=replace(project.options, unit_variance=unit_variance.value))
        sections = described(project)
        if not quiet:
            print_sections(sections, "`photogram info`")
        if crs is not None:
            from photogram.formats.placing import check_place

            check_place(project.block, crs)
        block, started = started_block(project, keep_all=keep_all)
        if divided.plan:
            from photogram.distributed.entrance import plan_in_parts

            plan = plan_in_parts(block, divided.division, unit_variance=project.options.unit_variance)
            output.print("\n".join(plan.lines()))
            plan.check()
            return
        for remark in started.messages if started is not None and not quiet else ():
            print_remark(str(remark))
        removed = None
        if snooping.snoop:
            if divided.division.is_asked_for:
                raise typer.BadParameter("goes without --cluster, --parts and --memory", param_hint="--snoop")
            if datum is not None or loss is not None or project.options.datum in ("inner", "minimum"):
                raise typer.BadParameter("goes without --datum and --loss", param_hint="--snoop")
            aside: tuple[str, ...] = ()
            if started is not None and (started.set_aside.any() or started.missing):
                first = adjusted_block(
                    job, project, started, datum, loss, ordering, threads, divided.division
                )
                block, aside = first.block, first.set_aside
            removed = _snooped(job, project, block, threads, snooping.options)
            assert isinstance(removed.result, Result)
            kept = with_features(replace(removed.result, set_aside=aside), project.features)
            removed = replace(removed, result=kept)
            result = cast("Result", removed.judged)
        else:
            result = adjusted_block(
                job, project, started or block, datum, loss, ordering, threads, divided.division
            )
        told = removed or result
        files = _files(project, result, told.report(), sections)
        if crs is not None:
            from photogram.formats.placing import placed, placed_files

            found = placed_files(placed(result, crs))
            files |= {f"in_crs/{name}": content for name, content in found.items()}
        if removed is not None:
            files["removed.csv"] = removed.table().to_csv(index=False).encode()
        taken = [] if removed is None else removed.sections()[ON_TOP:]
        sheets = {} if xlsx is None else {xlsx: _workbook(result)}
        page = html_files(job, "adjust", place, html is not None, lambda: page_of(told))
        job.finish(
            {target / name: content for name, content in files.items()} | pictures.of(result) | page | sheets,
            {} if json is None else {json: told.to_json()},
            as_data(result, parquet),
            drawn_maps(result, map, crs, _sizes(project), quiet=quiet),
            point_clouds(result, ply, ply_origin, crs),
            summary=lambda: print_sections(_summary(result, taken), "report.txt"),
            code=result.verdict.exit_code(strict=strict),
        )


def _on_disk(job: Job, path: Path, target: Path, divided: Parts, threads: int | None) -> bool:
    """Plan or adjust a project that is read batch by batch; False where it has to be read whole."""
    from photogram.formats import Wishes
    from photogram.formats.plain.streamed import streamable

    if not streamable(path):
        return False
    from photogram.formats.in_parts import adjusted_on_disk, planned_on_disk

    folder = divided.run or target / "run"
    if divided.plan:
        plan = planned_on_disk(path, Wishes(), folder, divided.division)
        output.print("\n".join(plan.lines()))
        plan.check()
        return True
    with job.status("adjusting") as status:
        told = shown(status, "weighted sum of squares", 1.0) if status is not None else None
        found = adjusted_on_disk(path, Wishes(), folder, divided.division, threads=threads, progress=told)
    lines = [*found.lines(), f"what was found of each node: {folder / 'results'}"]
    report = {target / "report.txt": ("\n".join(lines) + "\n").encode()}
    code = 0 if found.outcome.status == "converged" else NOT_CONVERGED
    job.finish(
        report, summary=lambda: print_sections([("adjusted in parts", lines)], "report.txt"), code=code
    )
    return True


def started_block(project: Project, *, keep_all: bool) -> tuple[Block, FirstValues | None]:
    """Return the block with poses for all its photos, and the first values where it needed any."""
    import numpy as np

    from photogram import first_values

    block = project.block
    if np.isfinite(block.photo_positions).all() and np.isfinite(block.photo_attitudes).all():
        return block, None
    found = first_values(block, keep_all=keep_all)
    return found.usable(), found


def _snooped(
    job: Job, project: Project, block: Block, threads: int | None, options: dict[str, Any]
) -> Snooped:
    from photogram import snoop
    from photogram.diagnosis.adjusted import diagnosed, errors_explained

    with job.status("adjusting and testing") as status, errors_explained(block):
        found = snoop(
            block,
            unit_variance=project.options.unit_variance,
            threads=threads,
            **options,
            progress=shown(status, "weighted sum of squares", 1.0) if status is not None else None,
        )
        return replace(found, result=diagnosed(cast("Result", found.result)))


def adjusted_block(
    job: Job,
    project: Project,
    block: Block | FirstValues,
    datum: DatumName | None,
    loss: LossName | None,
    ordering: OrderingName,
    threads: int | None,
    division: Division,
) -> Result:
    """Adjust a block as its project says, but for what a user chooses, with its features."""
    from photogram import FirstValues, InnerConstraints, InputError, MinimumConstraints, adjust_started
    from photogram import adjust as adjust_block
    from photogram.diagnosis.adjusted import diagnosed, errors_explained
    from photogram.formats.additions import repeated_remarks
    from photogram.results.fitting import with_features

    options = project.options
    chosen = datum.value if datum is not None else options.datum
    robust = (
        options.loss if loss is None else {"none": None, "huber": "huber", "cauchy": "cauchy"}[loss.value]
    )
    with job.status("adjusting") as status:
        how: dict[str, Any] = {
            "unit_variance": options.unit_variance,
            "loss": robust,
            "datum": {"inner": InnerConstraints(), "minimum": MinimumConstraints()}.get(chosen or ""),
            "ordering": ordering.value,
            "threads": threads,
            "progress": shown(status, "weighted sum of squares", 1.0) if status is not None else None,
            **vars(division),
            "verdict": True,
        }
        with errors_explained(block):
            if isinstance(block, FirstValues):
                result = adjust_started(block, **how)
            else:
                result = adjust_block(block, **how)
        result = diagnosed(result)
    if chosen == "control" and result.datum.is_chosen:
        raise InputError(
            "control gives no datum: --control FILE adds it, --datum inner or minimum does without it",
            file=project.path,
        )
    again = repeated_remarks(project, result) if not isinstance(block, FirstValues) else []
    told = replace(result, messages=[*project.messages, *again, *result.messages])
    return with_features(told, project.features)


def _files(
    project: Project, result: Result, report: str, sections: list[tuple[str, list[str]]]
) -> dict[str, bytes]:
    """Make everything that goes to the output directory, before anything is written."""
    from photogram.formats import FORMATS, to_files
    from photogram.formats.adjusted import adjusted, table_files

    read = "\n".join(line for title, lines in sections for line in (title, *(f"  {each}" for each in lines)))
    files = {"report.txt": f"{report}\n{read}\n".encode(), **table_files(result)}
    after = adjusted(project, result)
    files |= {f"adjusted/{name}": content for name, content in to_files(after, "plain").items()}
    own = next((name for name, each in FORMATS.items() if each.title == project.title), None)
    if own not in (None, "plain"):
        files |= {
            f"adjusted-{own}/{name}": content for name, content in _same_format(after, str(own)).items()
        }
        beside = FORMATS[str(own)].results
        if beside is not None:
            files |= {f"adjusted-{own}/{name}": content for name, content in beside(after, result).items()}
    return files


def _workbook(result: Result) -> bytes:
    from photogram.formats.adjusted import excel_file

    return excel_file(result)


def _sizes(project: Project) -> Sequence[tuple[float, float] | None]:
    """Return the sizes of pictures where images are in pixels, as they are."""
    return project.sizes if project.block.image_unit == "px" else ()


def _same_format(project: Project, name: str) -> dict[str, bytes]:
    """Return the adjusted project in the format in which it came, if that can hold it."""
    from photogram import InputError
    from photogram.formats import FORMATS, to_files

    if FORMATS[name].write is None:
        return {}
    try:
        return dict(to_files(project, name))
    except InputError as error:
        print_remark(f"not written as {FORMATS[name].title}: {error}")
        return {}


def _summary(result: Result, taken: list[tuple[str, list[str]]]) -> list[tuple[str, list[str]]]:
    from photogram.results.report import summary

    sections = summary(result)
    return [*sections[:ON_TOP], *taken, *sections[ON_TOP:]]
