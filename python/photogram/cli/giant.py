"""`photogram giant`: adjust a GIANT project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.markup import escape

from photogram.adjustment.options import AdjustOptions
from photogram.cli.check import GALVESTON
from photogram.cli.components import Basis, outcome
from photogram.cli.console import SHOWN, errors
from photogram.cli.documents import TEXT, Documents, check_maps
from photogram.cli.job import Job, with_job
from photogram.cli.options import Changes, OfSnooping, OutputFile, Reads, Threads, Without, misuse
from photogram.lazy_dataclasses import replace
from photogram.network.refraction import Refraction
from photogram.results.snooping_options import SnoopOptions
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

RESULTS = ("FRAMES", "GROUND", "RESTART", TEXT)


@with_job("giant", example=(GALVESTON,), ending="-adjusted", example_name=GALVESTON)
def giant(
    job: Job,
    *,
    directory: Annotated[Path, Reads.PROJECT],
    documents: Annotated[Documents, Without("xlsx", "crs")],
    listing: OutputFile = None,
    as_published: bool = False,
    components: list[Basis] | None = None,
    choices: Annotated[
        Mapping[str, Any], Changes(AdjustOptions, "unit_variance", "ordering", "max_bias_ratio")
    ],
    bent: Annotated[Mapping[str, Any], Changes(Refraction, "air", "water", "refractive_index")],
    threads: Threads = None,
    snoop: bool = False,
    snooping: Annotated[SnoopOptions, OfSnooping],
    limits: str | None = None,
    strict: bool = False,
    overwrite: bool = False,
) -> None:
    """Adjust a GIANT project: photographs, points and their covariances.

    Writes FRAMES and GROUND (adjusted, if converged), RESTART (stations of the last iteration), report.html
    and report.txt.
    """
    from photogram import AsPublished, adjust
    from photogram.diagnosis.after_adjustment import diagnosed, errors_explained
    from photogram.errors import AdjustmentError
    from photogram.formats.crs import plane_remarks
    from photogram.giant import Limits, read_project
    from photogram.giant import listing as printout
    from photogram.giant.assembly import job_refraction
    from photogram.giant.export import adjusted_records
    from photogram.giant.files import to_bytes
    from photogram.messages import Message

    check_maps(documents.map)
    _check_output(documents.folder, overwrite)
    documents.declare(job, *RESULTS, pictures=None)
    project = read_project(directory)
    common, allowed = project.common, Limits.parse(limits) if limits else None
    refraction = job_refraction(common, **bent)
    if "refractive_index" in bent and (refraction is None or refraction.water is None):
        raise misuse("--water-index", "requires", options="--water-refraction")
    block = project.to_block(allowed).replace(refraction=refraction)
    messages = job.told([*project.messages, *plane_remarks(block, directory)])
    project = replace(project, messages=messages)
    if snoop:
        job.alone("--snoop", ("--as-published",))
        if common.intersection_only:
            raise misuse("--snoop", "intersection-only")
    said = common.unit_variance if as_published else common.unbiased_variance
    options = {"unit_variance": choices.get("unit_variance", said)}
    rules: dict[str, Any] = {"ordering": choices.get("ordering", "auto")}
    if as_published:  # the rules of 1987
        rules["tolerance"] = AsPublished(common.convergence_percent)
        rules["max_iterations"] = common.max_iterations

    def adjusted(**given: Any) -> Result:
        free = block.with_fixed_photos() if common.intersection_only else block
        return adjust(free, covariance="verdict", **rules, **options, **given)

    def complete(result: Result) -> Result:
        result = diagnosed(result)
        return replace(result, messages=[*messages, *result.messages])

    try:
        with errors_explained(block):
            found = outcome(
                job,
                block,
                adjusted,
                complete,
                snooping=snooping if snoop else None,
                bases=components or (),
                threads=threads,
                options=options,
                max_bias_ratio=choices.get("max_bias_ratio"),
            )
    except AdjustmentError:
        # Remarks on the input are often the reason.
        for message in messages[:SHOWN]:
            errors.print(escape(str(message)))
        raise
    records = adjusted_records(project, block, found.result, as_published=as_published)
    if "RESTART" not in records:
        found.result.messages.append(Message.of("giant.no-restart"))
    files = {name: to_bytes(lines) for name, lines in records.items()}
    pages = {}
    if listing is not None:
        printed = printout(project, block, found.result, as_published=as_published, limits=allowed)
        pages = {listing: printed.encode()}
    documents.conclude(
        job,
        found.subject,
        files | found.files,
        document=found.document,
        network=found.result,
        beside=pages,
        code=found.verdict.exit_code(strict=strict),
    )


def _check_output(out: Path, overwrite: bool) -> None:
    """Reject the folder of another project as output folder."""
    from photogram.errors import InputError
    from photogram.giant.files import present_files

    if not out.is_dir():
        return
    present = present_files(out)
    inputs = [path.name for name in ("COMMON", "CAMERAS", "IMAGES") for path in present[name]]
    if inputs and not overwrite:
        raise InputError(phrase("command.other-project", names=inputs), file=out)
    for name in set(RESULTS) & set(present):
        others = [path for path in present[name] if path.name != name]
        if inputs and others:
            raise InputError(phrase("command.second-file", name=name), file=others[0])
