"""`photogram adjust`: adjust a project of any format."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from photogram.cli.choices import Choices
from photogram.cli.command_classes import misuse
from photogram.cli.console import OF_NETWORKS, print_document, print_remark, print_sections
from photogram.cli.documents import Documents, check_maps
from photogram.cli.in_parts import DIVIDING, adjusted_on_disk, print_plan
from photogram.cli.job import (
    Folder,
    Input,
    Job,
    OutputFolder,
    Without,
    adjustment_status,
    with_job,
)
from photogram.cli.options import OrderingName, Snooping, Threads, check_alone
from photogram.cli.projects import EXAMPLE, described, read_project
from photogram.cli.statement_output import OfHead, stated, statement_files
from photogram.distributed.division import Division
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import replace
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Block, FirstValues, Result
    from photogram.formats import Project
    from photogram.results.snooping_options import SnoopOptions
    from photogram.results.snooping_result import Snooped
    from photogram.results.statement.statement import Statement
    from photogram.show.forms import TitledLines
    from photogram.show.page import Section as Chapter
    from photogram.words import Phrase


@with_job(example=EXAMPLE, ending="-adjusted")
def adjust(
    job: Job,
    *,
    path: Input,
    out: Folder,
    documents: Documents,
    reading: ReadOptions,
    choices: Choices,
    snoop: bool = False,
    snooping: Snooping,
    keep_all: bool = False,
    statement: bool = False,
    wanted: OfHead,
    division: Annotated[Division, Without("folder")],
    run: OutputFolder = None,
    plan: bool = False,
    ordering: OrderingName = "auto",
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Adjust a block of any supported format: tables, COLMAP, OpenDroneMap, BlocksExchange, GIANT ...

    Photos without a pose are oriented first. --out receives the report, the tables of photos, points, images
    and all other observations (standard deviations, redundancy numbers, test values), and the adjusted
    project.
    """
    documents.place(out)  # rejected before any input is read
    if not statement:
        wanted.check_alone()
    if snoop:
        check_alone(job, "--snoop", DIVIDING)
    if ordering != "auto":
        check_alone(job, "--ordering", DIVIDING)
    documents.check_plots(job, out)
    parts = None if run is None and division == Division() else replace(division, folder=run)
    on_disk = partial(adjusted_on_disk, job, path, out, choices=choices, threads=threads, is_plan=plan)
    if parts and reading == ReadOptions() and on_disk(parts):
        return
    project = read_project(job, path, reading)
    check_maps(documents.map)  # now that all inputs are known, which it must not be
    project = choices.of(project)
    asked = wanted.asked(project, reading, project.block.linear_unit) if statement else None
    sections = described(project)
    if not job.quiet:
        print_sections(sections, "`photogram info`")
    if documents.crs is not None:
        from photogram.formats.crs_results import check_place

        check_place(project.block, documents.crs)
    block, started = started_block(project, keep_all=keep_all)
    if plan:
        from photogram.distributed import plan_in_parts

        print_plan(plan_in_parts(block, parts or division, project.options))
        return
    for remark in started.messages if started is not None and not job.quiet else ():
        print_remark(str(remark))

    def adjusted(start: Block | FirstValues) -> Result:
        how: dict[str, Any] = {"choices": choices, "threads": threads, "division": parts}
        return adjusted_block(job, project, start, ordering=ordering, **how)

    if snoop:
        removed = _snooped(job, project, block, started, adjusted, choices, threads, snooping)
        result = cast("Result", removed.result)
    else:
        removed, result = None, adjusted(started or block)
    own = None
    if asked is not None and result.converged:
        with job.status("stating"):
            given: dict[str, Any] = {"command": "adjust", "crs": documents.crs, "strict": strict}
            own = stated(job, result, asked, assumed=project.lacks, **given)
    _finish(job, project, result, removed, out, documents, sections, own, strict=strict)


def _finish(
    job: Job,
    project: Project,
    result: Result,
    removed: Snooped | None,
    target: Path,
    documents: Documents,
    sections: list[TitledLines],
    stated: Statement | None,
    *,
    strict: bool,
) -> None:
    """Write the results, print a summary, and end by the verdict."""
    from photogram.formats.adjusted import excel_file
    from photogram.show.cells import formatted
    from photogram.show.forms import text

    told = removed or result
    in_crs, more = _in_system(result, documents.crs, project.control_crs)
    document = formatted(told.document().with_sections(*more))
    files = _files(project, result, text(document), sections) | in_crs
    if removed is not None:
        files["removed.csv"] = removed.table().to_csv(index=False).encode()
    sheets = {} if documents.xlsx is None else {documents.xlsx: excel_file(result)}
    beside = {} if stated is None else statement_files(job, stated, target / "statement")
    sizes = project.sizes if project.block.image_unit == "px" else ()
    code = result.verdict.exit_code(strict=strict)
    job.finish(
        {target / name: content for name, content in files.items()} | sheets | beside,
        lambda: documents.page(job, "adjust", target, lambda: document),
        documents.plots_of(result, target),
        documents.as_json(told),
        documents.data(result),
        documents.charts(result, sizes, quiet=job.quiet),
        summary=lambda: print_document(document, "report.txt", *OF_NETWORKS),
        code=code or (0 if stated is None else stated.exit),
    )


def _in_system(result: Result, crs: str | None, of_control: str) -> tuple[dict[str, bytes], list[Chapter]]:
    """Return tables and sections of a result in a CRS, or in the control CRS."""
    if not (crs or of_control):
        return {}, []
    from photogram import InputError
    from photogram.formats.crs_results import placed, placed_files, placed_section

    try:
        found = placed(result, crs or of_control)
    except InputError as error:
        if crs:
            raise
        print_remark(phrase("command.no-crs-results", crs=of_control, error=error))
        return {}, []
    files = {f"in_crs/{name}": each for name, each in placed_files(found).items()}
    return files, [placed_section(found)]


def started_block(project: Project, *, keep_all: bool) -> tuple[Block, FirstValues | None]:
    """Return the block with poses for all photos, and initial values if needed."""
    import numpy as np

    from photogram import first_values

    block = project.block
    if np.isfinite(block.photo_positions).all() and np.isfinite(block.photo_attitudes).all():
        return block, None
    found = first_values(block, keep_all=keep_all)
    return found.usable(), found


def _snooped(
    job: Job,
    project: Project,
    block: Block,
    started: FirstValues | None,
    run: Callable[[FirstValues], Result],
    choices: Choices,
    threads: int | None,
    snooping: SnoopOptions,
) -> Snooped:
    """Remove gross errors of a block without images excluded by initial values."""
    from photogram import Result, adjust, snoop
    from photogram.diagnosis.after_adjustment import diagnosed, errors_explained
    from photogram.formats import adjusting
    from photogram.messages import Message
    from photogram.results.features import with_features

    aside: tuple[Phrase | str, ...] = ()
    if started is not None and (started.set_aside.any() or started.missing):
        first = run(started)
        block, aside = first.block, first.set_aside
    with adjustment_status(job, "adjusting and testing") as progress, errors_explained(block):
        found = snoop(
            block,
            snooping,
            datum=project.options.constraints,
            robust=None if project.options.loss is None else True,
            unit_variance=project.options.unit_variance,
            max_iterations=project.options.max_iterations,
            threads=threads,
            progress=progress,
        )
        result = cast("Result", found.result).with_max_bias_ratio(project.options.max_bias_ratio)
        result = diagnosed(result)
    assert isinstance(result, Result)
    _check_control(job, project, choices, result)
    messages = []
    if project.options.loss is not None:
        messages.append(Message.of("command.robust-start", source=choices.source(job, project, "loss")))
    if adjusting(project, adjust) is not adjust:
        messages.append(Message.of("command.no-rejection"))
    result = replace(result, set_aside=aside, messages=[*messages, *result.messages])
    return replace(found, result=with_features(result, project.features))


def _check_control(job: Job, project: Project, choices: Choices, result: Result) -> None:
    """Reject a result without a required datum of control."""
    from photogram import InputError

    if project.options.datum == "control" and result.datum.is_chosen:
        raise InputError(phrase("command.no-datum", source=choices.source(job, project, "datum")))


def adjusted_block(
    job: Job,
    project: Project,
    block: Block | FirstValues,
    *,
    choices: Choices = Choices(),  # noqa: B008  # frozen
    ordering: OrderingName = "auto",
    threads: int | None = None,
    division: Division | None = None,
) -> Result:
    """Adjust a block by settings of its project and options of the user."""
    from photogram import FirstValues, adjust, adjust_started
    from photogram.diagnosis.after_adjustment import diagnosed, errors_explained
    from photogram.formats import adjusting
    from photogram.formats.supplements import repeated_remarks
    from photogram.results.features import with_features

    if division is None:
        options = replace(project.options, ordering=ordering, covariance="verdict")
        adjust_once: Callable[..., Result] = partial(adjust, options=options)
    else:
        from photogram import adjust_in_parts

        adjust_once = partial(adjust_in_parts, division=division, options=project.options)
    with adjustment_status(job) as progress:
        with errors_explained(block):
            call = partial(adjusting(project, adjust_once), threads=threads, progress=progress)
            result = adjust_started(block, by=call) if isinstance(block, FirstValues) else call(block)
        result = diagnosed(result)
    _check_control(job, project, choices, result)
    again = repeated_remarks(project, result) if not isinstance(block, FirstValues) else []
    told = replace(result, messages=[*project.messages, *again, *result.messages])
    return with_features(told, project.features)


def result_at(
    job: Job,
    path: Path,
    reading: ReadOptions,
    threads: int | None,
    *,
    choices: Choices = Choices(),  # noqa: B008  # frozen
    keep_all: bool = False,
    fitted: bool = True,
) -> tuple[Result, Project | None]:
    """Return a saved result, or the adjusted project of a path."""
    from photogram import Result, read_result
    from photogram.formats.results import is_result

    if is_result(path):
        if replace(reading, sd={}) != ReadOptions() or choices != Choices() or keep_all:
            raise misuse("PATH", "saved-result")
        job.reads(path)
        result = read_result(path)
        if not isinstance(result, Result):
            raise misuse("PATH", "collection")
        return result, None
    project = choices.of(read_project(job, path, reading))
    block, started = started_block(project, keep_all=keep_all)
    whole = project if fitted else project.replace(features={})
    return adjusted_block(job, whole, started or block, choices=choices, threads=threads), project


def _files(project: Project, result: Result, report: str, sections: list[TitledLines]) -> dict[str, bytes]:
    """Return all files of the output folder."""
    from photogram.formats import FORMATS, to_files
    from photogram.formats.adjusted import adjusted, table_files
    from photogram.network.film_reduction import is_scanned

    read = "\n".join(line for title, lines in sections for line in (title, *(f"  {each}" for each in lines)))
    files = {"report.txt": f"{report}\n{read}\n".encode(), **table_files(result)}
    after = adjusted(project, result)
    own = next((name for name, each in FORMATS.items() if each.title == project.title), None)
    whole = own in (None, "plain") and not is_scanned(after.block)
    plain = to_files(after, "plain") if whole else _in_format(after, "plain")
    files |= {f"adjusted/{name}": content for name, content in plain.items()}
    if own not in (None, "plain"):
        files |= {f"adjusted-{own}/{name}": content for name, content in _in_format(after, str(own)).items()}
        beside = FORMATS[str(own)].results
        if beside is not None:
            files |= {f"adjusted-{own}/{name}": content for name, content in beside(after, result).items()}
    return files


def _in_format(project: Project, name: str) -> dict[str, bytes]:
    """Return the adjusted project in a format, if the format supports it."""
    from photogram import InputError
    from photogram.formats import FORMATS, to_files

    if FORMATS[name].write is None:
        return {}
    try:
        return dict(to_files(project, name))
    except InputError as error:
        print_remark(phrase("command.not-written", format=FORMATS[name].title, error=error))
        return {}
