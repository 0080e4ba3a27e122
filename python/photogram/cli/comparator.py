"""`photogram comparator`: calibrate a comparator from a grid plate, and correct measurements."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.markup import escape

from photogram.cli.console import output, print_remark, print_withheld
from photogram.cli.documents import Documents, PageAndJson
from photogram.cli.job import Job, OutputFile, OutputFolder, Reads, Without, with_job
from photogram.cli.options import Quiet, default_out, out_option

if TYPE_CHECKING:
    from photogram.comparator import Calibration

EXAMPLE = ("comparator", "comparator-3.txt")
"""The packaged example, a deck in photogram.examples."""


Hand = Literal["file", "left", "right"]
"""Handedness of the comparator against the plate."""


@with_job
def comparator(
    job: Job,
    *,
    paths: Annotated[
        list[Path] | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE...",
            help="Tables (*.csv) of one calibration; or files of decks of cards, one calibration a deck.",
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option("--example", help="Calibrate the packaged example instead: four cases on grid 1320."),
    ] = False,
    grid: Annotated[
        list[str] | None,
        Reads.FILE,
        typer.Option(
            metavar="GRID",
            help="Grid plate: 773, 1320, 778 or a file (point, x_um, y_um); again for more plates."
            " Default: as the files say.",
        ),
    ] = None,
    hand: Annotated[
        Hand, typer.Option(help="Handedness of the comparator against the plate; the data must agree.")
    ] = "file",
    out: Annotated[
        OutputFolder,
        out_option(
            "Directory for listing, report, correction and grids. Default: FILE-calibrated beside the first"
            " FILE."
        ),
    ] = None,
    json: Annotated[
        OutputFile,
        typer.Option(
            metavar="FILE", help="Write everything as one JSON document (a list of them for several decks)."
        ),
    ] = None,
    documents: Annotated[PageAndJson, Without("json")],
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Write report.pdf instead of report.html (needs the extra `pdf`).")
    ] = False,
    plots: Annotated[
        bool,
        typer.Option(
            "--plots/--no-plots", help="Make the report, with its pictures (needs the extra `report`)."
        ),
    ] = True,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published", help="Compute as the program of 1971 where it departs from its report."
        ),
    ] = False,
    polynomial: Annotated[
        bool, typer.Option("--polynomial/--linear-only", help="Fit correction polynomials of fourth degree.")
    ] = True,
    estimate_grid: Annotated[
        bool,
        typer.Option("--estimate-grid", help="Estimate the accuracy of the grid in the joint adjustment."),
    ] = False,
    each_case: Annotated[
        bool, typer.Option("--each-case", help="Tables and pictures of the polynomials of every case, too.")
    ] = False,
    date: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help="Date of the run for title page and report. Default: that of SOURCE_DATE_EPOCH, or today.",
        ),
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Remarks on the measurements are errors.")] = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate a comparator from measurements of a grid plate.

    Writes listing.txt, report.html (pictures), correction.json and the corrected grid of each plate. Where
    the verdict forbids the use (outliers), correction and grid are withheld, and the exit code is 4.
    """
    with job:
        from photogram.comparator import Options, calibrate, find_grid, read
        from photogram.errors import InputError
        from photogram.statistics.verdict import worst

        if example:
            paths = [job.packaged(*EXAMPLE)]
            job.reads(*paths)
            out = out or Path("comparator-calibrated")
        left_handed = None if hand == "file" else hand == "left"
        sessions = read(paths or [], [find_grid(name) for name in grid or []], left_handed=left_handed)
        options = Options.as_published() if as_published else Options()
        options = replace(options, polynomial=polynomial, estimate_grid=estimate_grid)
        if each_case:
            sessions = [replace(session, plot_each_case=True) for session in sessions]
        calibrations = [calibrate(session, options) for session in sessions]
        if strict:
            for message in (message for one in calibrations for message in one.messages):
                raise InputError(
                    message.text, file=message.file, record=message.record, text=message.record_text
                )
        folder = out or default_out((paths or [])[0], "-calibrated")
        job.reads(*(grid.source for one in sessions for grid in one.grids.values() if grid.source))
        several = len(calibrations) > 1
        placed = {folder / str(k) if several else folder: one for k, one in enumerate(calibrations, 1)}
        written = _results(placed, _run_date(date), pdf=pdf and plots, quiet=quiet)
        if documents.html is not None or (plots and not pdf):
            written |= _pages(job, placed, documents)
        asked = {json: _document(calibrations)} if json is not None else {}
        job.write(written, asked)
        _print_withheld(placed)
        code = worst(calibration.verdict for calibration in calibrations)
        job.conclude([*written, *asked], summary=lambda: _summarize(calibrations), code=code)


def _print_withheld(placed: dict[Path, Calibration]) -> None:
    """Say which corrections must not be used, and which files of earlier runs are not of this one."""
    for place, calibration in placed.items():
        if not calibration.usable:
            print_withheld(
                f"comparator {calibration.session.comparator}: the correction is withheld:"
                f" {calibration.verdict.headline}",
                _corrections(calibration, place),
            )


def _corrections(calibration: Calibration, place: Path) -> dict[Path, bytes]:
    """Make what measurements are corrected by: corrections and corrected grids."""
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
    """Return the date of the run: as it is said, as the environment says, or today (UTC)."""
    from photogram.errors import InputError
    from photogram.io.numbers import whole_number
    from photogram.messages import quoted

    if date is not None:
        return date if date.isprintable() else repr(date)
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    try:
        seconds = whole_number(epoch) if epoch else time.time()
        return datetime.fromtimestamp(seconds, UTC).date().isoformat()
    except (ValueError, OverflowError, OSError):
        raise InputError(f"SOURCE_DATE_EPOCH is {quoted(epoch)}: no seconds since 1970") from None


def _results(placed: dict[Path, Calibration], run_date: str, *, pdf: bool, quiet: bool) -> dict[Path, bytes]:
    """Make everything that goes to the output directory, before anything is written."""
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
            if not quiet:
                print_remark("no report.pdf: pip install 'photogram[pdf]'")
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
    from photogram.show.forms import summary

    for calibration in calibrations:
        for line in summary(calibration.document(), "variance", "linear"):
            output.print(escape(line))
        for message in calibration.messages:
            print_remark(message.text)


@with_job
def correct(
    job: Job,
    *,
    correction: Annotated[
        Path,
        Reads.FILE,
        typer.Argument(metavar="CORRECTION", help="correction.json, or the JSON document of a calibration."),
    ],
    measurements: Annotated[
        Path,
        Reads.FILE,
        typer.Argument(metavar="FILE", help="Table with columns x_um, y_um (or x_mm, y_mm)."),
    ],
    corrected: Annotated[
        OutputFile, typer.Argument(metavar="OUT", help="Table to write. Default: standard output.")
    ] = None,
    invert: Annotated[
        bool, typer.Option("--invert", help="Turn corrected coordinates back into readings.")
    ] = False,
    extrapolate: Annotated[
        bool, typer.Option("--extrapolate", help="Correct points far outside the calibrated range, too.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Correct measurements by a calibration.

    Adds the columns corrected_x_um, corrected_y_um, sd_x_um, sd_y_um (what the calibration contributes), and
    in_range: no where nothing was calibrated. Points far outside are refused.
    """
    with job:
        from photogram.comparator.apply import correct_table
        from photogram.comparator.correction import Correction
        from photogram.comparator.csvfile import read_table

        made, remarks = correct_table(
            Correction.read(correction), read_table(measurements), invert=invert, extrapolate=extrapolate
        )
        if not quiet:
            for remark in remarks:
                print_remark(remark)
        if corrected is None:
            typer.echo(made.decode(), nl=False)
        job.finish({corrected: made} if corrected else {})


@with_job
def compare(
    job: Job,
    *,
    calibrations: Annotated[
        list[Path] | None,
        Reads.FILE,
        typer.Argument(metavar="JSON...", help="Documents of calibrations: what `--json` writes."),
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Compare six simulated calibrations instead: a scale steps.")
    ] = False,
    out: Annotated[
        OutputFolder,
        out_option("Directory for report and grids. Default: FILE-compared beside the first FILE."),
    ] = None,
    documents: PageAndJson,
    quiet: Quiet = False,
) -> None:
    """Compare calibrations over years: drift, steps, control charts; adjust their grids together.

    Writes report.html and each plate with the coordinates that all calibrations give it. What has changed is
    named, and the exit code is 4. Grids with which readings do not agree are withheld.
    """
    with job:
        from photogram.comparator import compare as compared

        if example:
            from photogram.comparator.simulation import simulated_years

            found = compared(simulated_years())
            folder = out or Path("comparator-compared")
        else:
            paths = calibrations or []
            found = compared(paths)
            folder = out or default_out(paths[0], "-compared")
        grids = found.grids if found.usable_grids else {}
        documents.conclude(
            job,
            "comparator compare",
            found,
            folder,
            text=False,
            more={folder / f"grid-{plate}.csv": grid.to_csv() for plate, grid in grids.items()},
            tables=("calibrations", "series"),
        )
