"""`photogram comparator`: calibrate a comparator from a grid plate, and correct measurements."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.console import print_document
from photogram.cli.documents import PageAndJson
from photogram.cli.job import Job, with_job
from photogram.cli.options import Changes, OutputFile, Reads
from photogram.comparator.options import Options
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.comparator import Calibration
    from photogram.io.writing import Content


Hand = Literal["file", "left", "right"]  # Handedness of the comparator against the plate


@with_job(
    "comparator", example=("comparator", "comparator-3.txt"), ending="-calibrated", example_name="comparator"
)
def comparator(
    job: Job,
    *,
    paths: Annotated[list[Path] | None, Reads.FILE] = None,
    grid: Annotated[list[str] | None, Reads.FILE] = None,
    hand: Hand = "file",
    documents: PageAndJson,
    pdf: bool = False,
    plots: Annotated[bool, typer.Option("--plots/--no-plots")] = True,
    choices: Annotated[Mapping[str, Any], Changes(Options, "as_published", "polynomial", "estimate_grid")],
    each_case: bool = False,
    date: str | None = None,
    strict: bool = False,
) -> None:
    """Calibrate a comparator from measurements of a grid plate.

    Writes listing.txt, report.html (with plots), correction.json and the corrected grid of each plate. If the
    verdict forbids their use because of outliers, correction and grid are withheld. The exit code is 4.
    """
    from photogram.comparator import calibrate, find_grid, listing, read
    from photogram.errors import InputError
    from photogram.show.page import Fact
    from photogram.statistics.verdict import worst

    left_handed = None if hand == "file" else hand == "left"
    sessions = read(paths or [], [find_grid(name) for name in grid or []], left_handed=left_handed)
    options = Options(**choices)
    if each_case:
        sessions = [replace(session, plot_each_case=True) for session in sessions]
    calibrations = [calibrate(session, options) for session in sessions]
    if strict:
        messages = [message for calibration in calibrations for message in calibration.messages]
        if messages:
            message = messages[0]
            text = message.phrase or str(message.text)
            raise InputError(text, file=message.file, record=message.record, text=message.record_text)
    job.reads(*(grid.source for one in sessions for grid in one.grids.values() if grid.source))
    run_date, several = _run_date(date), len(calibrations) > 1
    files: dict[Path, Content] = {}
    for number, one in enumerate(calibrations, 1):
        own = replace(documents, out=documents.folder / str(number)) if several else documents
        files |= own.inside({"listing.txt": listing(one, run_date).encode()})
        reason = {"comparator": one.session.comparator, "reason": one.verdict.headline}
        withheld = phrase("command.correction-withheld", **reason)
        files |= own.unless_withheld(_corrections(one), withheld, usable=one.usable)
        if pdf and plots and find_spec("typst"):
            from photogram.show.pdf import page_pdf

            page = replace(one.document(), head=[Fact("Date of the run", run_date)])
            files |= own.inside({"report.pdf": page_pdf(page)})
        elif pdf and plots:
            job.remark(phrase("command.no-file", name="report.pdf", extra="pdf"))
        if documents.html is not None or (plots and not pdf):
            mark = f"-{number}" if documents.html is not None and several else ""
            files |= own.page(job, replace(one, messages=job.told(one.messages)).document, mark)
    code = worst(calibration.verdict for calibration in calibrations)

    def to_json() -> bytes:
        texts = [one.to_json() for one in calibrations]
        return b"[" + b",\n".join(texts) + b"]\n" if several else texts[0]

    def summarize() -> None:
        for one in calibrations:
            remarks = [message.text for message in one.messages]
            print_document(one.document(), "listing.txt", "variance", "linear", remarks=remarks)

    job.finish(files, job.as_json(to_json), summary=summarize, code=code)


def _corrections(calibration: Calibration) -> dict[str, bytes]:
    """Return the files for corrections: corrections and corrected grids."""
    made = {"correction.json": calibration.correction.to_json()}
    if calibration.joint:
        made["correction-joint.json"] = calibration.joint.correction.to_json()
    for plate in calibration.plates:
        made[f"grid-{plate}.csv"] = calibration.corrected_grid(plate).to_csv()
        if calibration.joint:
            made[f"grid-{plate}-joint.csv"] = calibration.adjusted_grid(plate).to_csv()
    return made


def _run_date(date: str | None) -> str:
    """Return the date of the run from the option, the environment, or today (UTC)."""
    from photogram.errors import InputError
    from photogram.io.numbers import whole_number

    if date is not None:
        return date if date.isprintable() else repr(date)
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    try:
        seconds = whole_number(epoch) if epoch else time.time()
        return datetime.fromtimestamp(seconds, UTC).date().isoformat()
    except (ValueError, OverflowError, OSError):
        raise InputError(phrase("command.epoch", value=epoch)) from None


@with_job("comparator correct")
def correct(
    job: Job,
    *,
    correction: Annotated[Path, Reads.FILE],
    measurements: Annotated[Path, Reads.FILE],
    corrected: OutputFile = None,
    invert: bool = False,
    extrapolate: bool = False,
) -> None:
    """Correct measurements with a calibration.

    Adds the columns corrected_x_um, corrected_y_um, sd_x_um, sd_y_um (standard deviation of the calibration),
    and in_range (no outside the calibrated range). Points far outside are rejected.
    """
    from photogram.comparator.correction import Correction, correct_table
    from photogram.comparator.grid import read_table
    from photogram.messages import coded
    from photogram.show.page import Document

    made, remarks = correct_table(
        Correction.read(correction), read_table(measurements), invert=invert, extrapolate=extrapolate
    )
    job.remark(*remarks)
    document = Document("Corrected measurements", "", members={"messages": coded(remarks)})
    if corrected is None:
        typer.echo(made.decode(), nl=False)
        job.quiet = True  # Standard output contains the table only
    job.finish({corrected: made} if corrected else {}, document=document, summary=lambda: None)


@with_job("comparator compare", example=(), ending="-compared", example_name="comparator")
def compare_calibrations(
    job: Job,
    *,
    calibrations: Annotated[list[Path] | None, Reads.FILE] = None,
    documents: PageAndJson,
) -> None:
    """Compare calibrations over years: drift, steps, control charts; adjust their grids together.

    Writes report.html and the coordinates of each plate from all calibrations. Exit code 4: a comparator or
    grid has changed. Grids that do not agree with their readings are withheld.
    """
    from photogram.comparator import compare as compared
    from photogram.comparator.simulation import simulated_years

    found = compared(simulated_years() if job.is_example else calibrations or [])
    grids = found.grids if found.usable_grids else {}
    files = {f"grid-{plate}.csv": grid.to_csv() for plate, grid in grids.items()}
    documents.conclude(job, found, files, report=False, tables=("calibrations", "series"))
