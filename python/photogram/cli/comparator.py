"""`photogram comparator`: calibrate a comparator from a grid plate, and correct measurements."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from photogram.cli.console import print_document, print_remark, print_withheld
from photogram.cli.documents import Documents, PageAndJson
from photogram.cli.job import Folder, Job, OutputFile, Reads, Without, with_job
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.comparator import Calibration


Hand = Literal["file", "left", "right"]  # Handedness of the comparator against the plate


@with_job(example=("comparator", "comparator-3.txt"), ending="-calibrated", name="comparator")
def comparator(
    job: Job,
    *,
    paths: Annotated[list[Path] | None, Reads.FILE] = None,
    grid: Annotated[list[str] | None, Reads.FILE] = None,
    hand: Hand = "file",
    out: Folder,
    json: OutputFile = None,
    documents: Annotated[PageAndJson, Without("json")],
    pdf: bool = False,
    plots: Annotated[bool, typer.Option("--plots/--no-plots")] = True,
    as_published: bool = False,
    polynomial: Annotated[bool, typer.Option("--polynomial/--linear-only")] = True,
    estimate_grid: bool = False,
    each_case: bool = False,
    date: str | None = None,
    strict: bool = False,
) -> None:
    """Calibrate a comparator from measurements of a grid plate.

    Writes listing.txt, report.html (with plots), correction.json and the corrected grid of each plate. If the
    verdict forbids their use because of outliers, correction and grid are withheld. The exit code is 4.
    """
    from photogram.comparator import Options, calibrate, find_grid, read
    from photogram.errors import InputError
    from photogram.statistics.verdict import worst

    left_handed = None if hand == "file" else hand == "left"
    sessions = read(paths or [], [find_grid(name) for name in grid or []], left_handed=left_handed)
    options = Options.as_published() if as_published else Options()
    options = replace(options, polynomial=polynomial, estimate_grid=estimate_grid)
    if each_case:
        sessions = [replace(session, plot_each_case=True) for session in sessions]
    calibrations = [calibrate(session, options) for session in sessions]
    if strict:
        for message in (message for one in calibrations for message in one.messages):
            text = message.phrase or str(message.text)
            raise InputError(text, file=message.file, record=message.record, text=message.record_text)
    job.reads(*(grid.source for one in sessions for grid in one.grids.values() if grid.source))
    several = len(calibrations) > 1
    placed = {out / str(k) if several else out: one for k, one in enumerate(calibrations, 1)}
    written = _results(job, placed, _run_date(date), pdf=pdf and plots)
    if documents.html is not None or (plots and not pdf):
        written |= _pages(job, placed, documents)
    asked = {json: _document(calibrations)} if json is not None else {}
    job.write(written, asked)
    for place, one in placed.items():
        if not one.usable:
            fields = {"comparator": one.session.comparator, "reason": one.verdict.headline}
            print_withheld(phrase("command.correction-withheld", **fields), _corrections(one, place))
    code = worst(calibration.verdict for calibration in calibrations)
    job.conclude([*written, *asked], summary=lambda: _summarize(calibrations), code=code)


def _corrections(calibration: Calibration, place: Path) -> dict[Path, bytes]:
    """Return the files for corrections: corrections and corrected grids."""
    from photogram.comparator.calibration import adjusted_grid, corrected_grid

    made = {place / "correction.json": calibration.correction.to_json()}
    if calibration.joint:
        made[place / "correction-joint.json"] = calibration.joint.correction.to_json()
    for plate in calibration.plates:
        made[place / f"grid-{plate}.csv"] = corrected_grid(calibration, plate).to_csv()
        if calibration.joint:
            made[place / f"grid-{plate}-joint.csv"] = adjusted_grid(calibration, plate).to_csv()
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


def _results(job: Job, placed: dict[Path, Calibration], run_date: str, *, pdf: bool) -> dict[Path, bytes]:
    """Return all files of the output folder except pages."""
    from photogram.comparator import listing

    written: dict[Path, bytes] = {}
    for place, calibration in placed.items():
        written[place / "listing.txt"] = listing(calibration, run_date).encode()
        if calibration.usable:
            written |= _corrections(calibration, place)
    if pdf:
        try:
            written |= {place / "report.pdf": _pdf(one, run_date) for place, one in placed.items()}
        except ModuleNotFoundError:
            if not job.quiet:
                print_remark(phrase("command.no-file", name="report.pdf", extra="pdf"))
    return written


def _pdf(calibration: Calibration, run_date: str) -> bytes:
    from photogram.show.page import Fact
    from photogram.show.pdf import page_pdf

    return page_pdf(replace(calibration.document(), head=[Fact("Date of the run", run_date)]))


def _pages(job: Job, placed: dict[Path, Calibration], documents: Documents) -> dict[Path, bytes]:
    """Make the reports for the browser, one for each calibration."""
    written: dict[Path, bytes] = {}
    for number, (place, calibration) in enumerate(placed.items(), 1):
        mark = f"-{number}" if documents.html is not None and len(placed) > 1 else ""
        make = replace(calibration, messages=job.told(calibration.messages)).document
        written |= documents.page(job, "comparator", place, make, mark)
    return written


def _document(calibrations: list[Calibration]) -> bytes:
    documents = [calibration.to_json() for calibration in calibrations]
    return documents[0] if len(documents) == 1 else b"[" + b",\n".join(documents) + b"]\n"


def _summarize(calibrations: list[Calibration]) -> None:
    """Print verdict, analysis of variance, linear parameters and problems of each."""
    for calibration in calibrations:
        remarks = [message.text for message in calibration.messages]
        print_document(calibration.document(), "listing.txt", "variance", "linear", remarks=remarks)


@with_job()
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
    from photogram.comparator.apply import correct_table
    from photogram.comparator.correction import Correction
    from photogram.comparator.csvfile import read_table

    made, remarks = correct_table(
        Correction.read(correction), read_table(measurements), invert=invert, extrapolate=extrapolate
    )
    if not job.quiet:
        for remark in remarks:
            print_remark(remark)
    if corrected is None:
        typer.echo(made.decode(), nl=False)
    job.finish({corrected: made} if corrected else {})


@with_job(example=(), ending="-compared", name="comparator")
def compare_calibrations(
    job: Job,
    *,
    calibrations: Annotated[list[Path] | None, Reads.FILE] = None,
    out: Folder,
    documents: PageAndJson,
) -> None:
    """Compare calibrations over years: drift, steps, control charts; adjust their grids together.

    Writes report.html and the coordinates of each plate from all calibrations. Exit code 4: a comparator or
    grid has changed. Grids that do not agree with their readings are withheld.
    """
    from photogram.comparator import compare as compared

    if job.is_example:
        from photogram.comparator.simulation import simulated_years

        found = compared(simulated_years())
    else:
        found = compared(calibrations or [])
    grids = found.grids if found.usable_grids else {}
    documents.conclude(
        job,
        "comparator compare",
        found,
        out,
        text=False,
        more={out / f"grid-{plate}.csv": grid.to_csv() for plate, grid in grids.items()},
        tables=("calibrations", "series"),
    )
