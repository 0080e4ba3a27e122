"""`photogram adjust`: adjust a project of any format."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

from photogram.adjustment.options import Ordering
from photogram.cli.console import NOT_CONVERGED, print_sections, print_text
from photogram.cli.documents import Documents, check_maps
from photogram.cli.job import Job, adjustment_status, with_job
from photogram.cli.options import Input, OfSnooping, OutputFolder, Threads, Without, misuse
from photogram.cli.projects import EXAMPLE, Choices, Unknowns, read_project, source
from photogram.cli.statement_output import OfHead, stated, statement_files
from photogram.distributed.division import Division
from photogram.formats.read_options import ReadOptions
from photogram.lazy_dataclasses import replace
from photogram.results.snooping_options import SnoopOptions
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Block, FirstValues, Result
    from photogram.formats import Project
    from photogram.messages import Message
    from photogram.results.snooping_result import Snooped
    from photogram.show.page import Section as Chapter
    from photogram.words import Phrase


@with_job("adjust", example=EXAMPLE, ending="-adjusted")
def adjust(
    job: Job,
    *,
    path: Input,
    documents: Documents,
    reading: ReadOptions,
    choices: Choices,
    unknowns: Unknowns,
    snoop: bool = False,
    snooping: Annotated[SnoopOptions, OfSnooping],
    keep_all: bool = False,
    statement: bool = False,
    wanted: OfHead,
    division: Annotated[Division, Without("folder")],
    run: OutputFolder = None,
    plan: bool = False,
    ordering: Ordering = "auto",
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Adjust a block of any supported format: tables, COLMAP, OpenDroneMap, BlocksExchange, GIANT ...

    Photos without a pose are oriented first. --out receives the report, the tables of photos, points, images
    and all other observations (standard deviations, redundancy numbers, test values), and the adjusted
    project.
    """
    from photogram.formats.description import described
    from photogram.formats.results import project_files

    if not statement:
        wanted.check_alone()
    if snoop:
        job.alone("--snoop", DIVIDING)
    if ordering != "auto":
        job.alone("--ordering", DIVIDING)
    documents.declare(job, pictures=None)
    parts = None if run is None and division == Division() else replace(division, folder=run)
    on_disk = partial(
        adjusted_on_disk, job, path, reading, documents.folder, choices=choices, threads=threads
    )
    if parts and replace(reading, settings=(), sd={}) == ReadOptions() and on_disk(parts, is_plan=plan):
        return
    project = read_project(job, path, reading)
    check_maps(documents.map)  # now that all inputs are known, which it must not be
    project = unknowns.of(project, choices)
    asked = wanted.asked(project, reading, project.block.linear_unit) if statement else None
    description = described(project)
    if not job.quiet:
        print_sections(description, "`photogram info`")
    if documents.crs is not None:
        from photogram.formats.results import check_place
        from photogram.io.places import Place, at_place

        with at_place(Place(), "--crs"):
            check_place(project.block, documents.crs)
    block, started = started_block(project, keep_all=keep_all)
    if plan:
        from photogram.distributed import plan_in_parts

        planned = plan_in_parts(block, parts or division, project.options)
        job.conclude((), summary=lambda: print_text(planned.document()))
        planned.check()
        return
    job.remark(*(started.messages if started is not None else ()))

    def adjusted(start: Block | FirstValues) -> Result:
        return adjusted_block(job, project, start, ordering=ordering, threads=threads, division=parts)

    removed = _snooped(job, project, block, started, adjusted, threads, snooping) if snoop else None
    result = adjusted(started or block) if removed is None else cast("Result", removed.result)
    own = None
    if asked is not None and result.converged:
        with job.status("stating"):
            given: dict[str, Any] = {"crs": documents.crs, "strict": strict}
            own = stated(job, result, asked, assumed=project.lacks, **given)
    subject = removed or result
    code = result.verdict.exit_code(strict=strict)  # Releases the factor before the files are made
    in_crs, more = _in_system(job, result, documents.crs, project.control_crs)
    files, remarks = project_files(project, result)
    job.remark(*remarks)
    files |= in_crs
    if removed is not None:
        files["removed.csv"] = removed.table().to_csv(index=False).encode()
    document = subject.document().with_sections(*more)
    documents.conclude(
        job,
        subject,
        files,
        document=replace(document, details=[*document.details, *description.sections]),
        network=result,
        sizes=project.sizes if project.block.image_unit == "px" else (),
        beside={} if own is None else statement_files(job, own, documents.folder / "statement"),
        code=code or (0 if own is None else own.exit),
    )


def _in_system(
    job: Job, result: Result, crs: str | None, of_control: str
) -> tuple[dict[str, bytes], list[Chapter]]:
    """Return tables and sections of a result in a CRS, or in the control CRS."""
    if not (crs or of_control):
        return {}, []
    from photogram import InputError
    from photogram.formats.results import placed, placed_files, placed_section

    try:
        found = placed(result, crs or of_control)
    except InputError as error:
        if crs:
            raise
        job.remark(phrase("command.no-crs-results", crs=of_control, error=error))
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
    threads: int | None,
    snooping: SnoopOptions,
) -> Snooped:
    """Remove gross errors of a block without images excluded by initial values."""
    from photogram import adjust, snoop
    from photogram.diagnosis.after_adjustment import errors_explained
    from photogram.formats import adjusting
    from photogram.messages import Message

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
        messages = []
        if project.options.loss is not None:
            messages.append(Message.of("command.robust-start", source=source(job, project, "loss")))
        if adjusting(project, adjust) is not adjust:
            messages.append(Message.of("command.no-rejection"))
        result = cast("Result", found.result).with_max_bias_ratio(project.options.max_bias_ratio)
        result = _completed(job, project, replace(result, set_aside=aside), messages)
    return replace(found, result=result)


def _completed(job: Job, project: Project, result: Result, messages: Sequence[Message]) -> Result:
    """Return a result with explanations, messages and features; reject one without a required datum."""
    from photogram import InputError
    from photogram.diagnosis.after_adjustment import diagnosed
    from photogram.results.features import with_features

    result = diagnosed(result)
    if project.options.datum == "control" and result.datum.is_chosen:
        raise InputError(phrase("command.no-datum", source=source(job, project, "datum")))
    return with_features(replace(result, messages=[*messages, *result.messages]), project.features)


def adjusted_block(
    job: Job,
    project: Project,
    block: Block | FirstValues,
    *,
    ordering: Ordering = "auto",
    threads: int | None = None,
    division: Division | None = None,
) -> Result:
    from photogram import FirstValues, adjust, adjust_started
    from photogram.diagnosis.after_adjustment import errors_explained
    from photogram.formats import adjusting
    from photogram.formats.supplements import repeated_remarks

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
        again = repeated_remarks(project, result) if not isinstance(block, FirstValues) else []
        return _completed(job, project, result, [*project.messages, *again])


def result_at(
    job: Job,
    path: Path,
    reading: ReadOptions,
    threads: int | None,
    *,
    choices: Mapping[str, Any] | None = None,
    unknowns: Unknowns = Unknowns(),  # noqa: B008  # frozen
    keep_all: bool = False,
    fitted: bool = True,
) -> tuple[Result, Project | None]:
    from photogram import Result, read_result
    from photogram.formats.recognition import results as is_result

    if is_result(path):
        if replace(reading, sd={}) != ReadOptions() or choices or unknowns != Unknowns() or keep_all:
            raise misuse("PATH", "saved-result")
        job.reads(path)
        result = read_result(path)
        if not isinstance(result, Result):
            raise misuse("PATH", "collection")
        return result, None
    project = unknowns.of(read_project(job, path, reading), choices or {})
    block, started = started_block(project, keep_all=keep_all)
    whole = project if fitted else project.replace(features={})
    return adjusted_block(job, whole, started or block, threads=threads), project


DIVIDING = ("--cluster", "--workers", "--parts", "--memory", "--run")
"""Options that divide an adjustment into parts."""
TAKEN = frozenset(
    (
        *("PATH", "--out", "--no-html", "--quiet", "--threads", "--unit-variance", "--loss", "--keep-all"),
        *(*DIVIDING, "--iterations", "--plan", "--set", "--sd"),
    )
)
"""Options for a project on disk; any other option is rejected."""


def adjusted_on_disk(
    job: Job,
    path: Path,
    reading: ReadOptions,
    target: Path,
    division: Division,
    choices: Mapping[str, Any],
    threads: int | None,
    *,
    is_plan: bool,
) -> bool:
    """Plan or adjust a project batch by batch; False if this is impossible."""
    from photogram.formats.in_parts import streamable

    if not streamable(path, None if division.cluster else division.memory_bytes, reading):
        return False
    job.only(TAKEN, "in-batches", options=[each for each in job.given if each in DIVIDING])
    from photogram.formats import in_parts
    from photogram.show.forms import text
    from photogram.show.page import Section, Text

    folder = Path(division.folder or target / "run")
    change = partial(replace, **choices)
    threads = None if is_plan else threads
    opened = in_parts.on_disk(path, reading, folder, division, change=change, threads=threads)
    if is_plan:
        with opened as run:
            planned = run.plan()
            job.conclude((), summary=lambda: print_text(planned.document()))
            planned.check()
        return True
    with adjustment_status(job) as progress, opened as run:
        outcome = run.adjust(progress)
        document = in_parts.document(run, outcome)
    place = Text(str(phrase("command.node-results", folder=folder / "results")))
    document = document.with_sections(Section("files", "Files", [place]))
    job.finish(
        {target / "report.txt": text(document).encode()},
        summary=lambda: print_text(document),
        code=0 if outcome.status == "converged" else NOT_CONVERGED,
    )
    return True
