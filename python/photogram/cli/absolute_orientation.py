"""`photogram absolute-orientation`: orient a model, and transform its points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from enum import StrEnum
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from photogram.cli.console import NOT_CONVERGED, errors, output, print_sections, print_written
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import JsonFile, Quiet

if TYPE_CHECKING:
    from photogram.absolute_orientation import Orientation, Similarity, Stations
    from photogram.io.writing import OutputSet
    from photogram.messages import Message

__all__ = ["absolute_orientation", "transform"]

SHOWN = 40
"""Lines of a section that the summary shows at most."""
EXAMPLE = "absolute_orientation"
"""The packaged example, a directory of photogram.examples."""


class Format(StrEnum):
    """How a file of stations is written."""

    AUTO = "auto"
    CSV = "csv"
    CARDS = "cards"


class Method(StrEnum):
    """How the iteration is carried out."""

    RIGOROUS = "rigorous"
    REPORT = "report"
    FILL_IN = "fill-in"


class Start(StrEnum):
    """Where the iteration starts."""

    AUTO = "auto"
    REPORT = "report"
    CLOSED_FORM = "closed-form"


class UnitVariance(StrEnum):
    """What covariances are scaled by."""

    ESTIMATED = "estimated"
    UNITY = "unity"


@with_job
def absolute_orientation(
    job: Job,
    file: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(
            metavar="FILE",
            help="Stations: CSV (id,X,Y,Z,x,y,z; empty where unknown) or the cards of part I.",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Orient the packaged example instead, with its points.")
    ] = False,
    points: Annotated[
        Path | None,
        Reads.FILE,
        typer.Option(
            metavar="FILE",
            help="Model points to transform as well: CSV (id,x,y,z) or lines x y z number.",
            show_default=False,
        ),
    ] = None,
    points_out: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE",
            help="Where they go, as CSV. Default: POINTS-transformed.csv beside them.",
            show_default=False,
        ),
    ] = None,
    json: JsonFile = None,
    listing: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(metavar="FILE", help="Write the listing as text.", show_default=False),
    ] = None,
    plot: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(metavar="FILE", help="Draw the residuals of the control (PNG).", show_default=False),
    ] = None,
    trace: Annotated[
        Path | None,
        Writes.FILE,
        typer.Option(
            metavar="FILE",
            help="Write the bulletin's eight prints under sense switches, cycle by cycle (--method report or"
            " fill-in).",
            show_default=False,
        ),
    ] = None,
    reject: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID", help="Station whose control takes no part; may be repeated.", show_default=False
        ),
    ] = None,
    restart: Annotated[
        Path | None,
        Reads.FILE,
        typer.Option(metavar="JSON", help="Start from a former result (its --json).", show_default=False),
    ] = None,
    start: Annotated[
        Start | None,
        typer.Option(
            help="Initial values. Default: auto, or report with the report's methods.", show_default=False
        ),
    ] = None,
    method: Annotated[
        Method, typer.Option(help="Least squares by the engine, or the cycles of the report.")
    ] = Method.RIGOROUS,
    unit_variance: Annotated[
        UnitVariance,
        typer.Option(help="Scale covariances by sigma0 squared, or not (with standard deviations)."),
    ] = UnitVariance.ESTIMATED,
    point_sd: Annotated[
        float, typer.Option(min=0.0, help="Standard deviation of the points' own coordinates, model units.")
    ] = 0.0,
    decimals: Annotated[
        int | None, typer.Option(min=0, max=15, help="Decimals of transformed points.", show_default=False)
    ] = None,
    format: Annotated[  # noqa: A002  # the name of the option
        Format, typer.Option(help="Format of FILE; auto looks for a header.")
    ] = Format.AUTO,
    zero_missing: Annotated[
        bool,
        typer.Option(
            "--zero-missing", help="In cards a control coordinate of 0 is missing, as in the report."
        ),
    ] = False,
    ground_unit: Annotated[str, typer.Option(help="Name of the unit of the control.")] = "ground unit",
    model_unit: Annotated[str, typer.Option(help="Name of the unit of the model.")] = "model unit",
    quiet: Quiet = False,
) -> None:
    """Orient a model absolutely: s, A, B of x = s A X + B from full, horizontal and height control.

    Prints problems, figures, parameters and residuals; writes what is asked for, whole or not at all.
    Stations without control are transformed too. Exit code 3: not converged, or control that does not fit.
    """
    if example == (file is not None):
        raise typer.BadParameter("give a file, or --example", param_hint="FILE")
    if trace and method is Method.RIGOROUS:
        raise typer.BadParameter("goes with --method report or fill-in", param_hint="--trace")
    with job, ExitStack() as resources:
        from photogram import orient
        from photogram.absolute_orientation.document import read_similarity
        from photogram.absolute_orientation.report import summary
        from photogram.messages import Message

        target = points_out
        if file is None:
            directory = resources.enter_context(as_file(files("photogram") / "examples" / EXAMPLE))
            file, ground_unit, model_unit = directory / "stations.csv", "m", "mm"
            if points is None:
                points, target = directory / "points.csv", target or Path("points-transformed.csv")
            job.reads(file, points)
        if points and not target:
            target = points.with_name(f"{points.stem}-transformed.csv")
        if target and target is not points_out:
            job.writes(target)
        stations, former, messages = _read(file, format, zero_missing, ground_unit, model_unit)
        result = orient(
            stations,
            method=method.value,
            start=start.value if start else None,
            former=read_similarity(restart) if restart else former,
            reject=reject or (),
            unit_variance=unit_variance.value,
            trace=trace is not None,
        )
        result.messages[:0] = messages
        if points and not result.usable:
            result.messages.append(Message("no points were transformed: the orientation is not to be used"))
            points = None
        made = _small_files(result, listing, plot, trace, None if points else json)
        written = list(made)
        with job.outputs() as outputs:
            if points and target:
                _stream(outputs, result, points, target, json, point_sd, decimals, quiet)
                written = [target, *([json] if json else []), *written]
            for path, content in made.items():
                outputs.write(path, content)
        if not quiet:
            print_sections(summary(result), "the listing", SHOWN)
            print_written(written)
    if not result.usable:
        raise typer.Exit(NOT_CONVERGED)


@with_job
def transform(
    job: Job,
    result: Annotated[
        Path,
        Reads.FILE,
        typer.Argument(metavar="RESULT", help="The --json of an orientation, or the two records of part II."),
    ],
    points: Annotated[
        Path,
        Reads.FILE,
        typer.Argument(metavar="POINTS", help="Model points: CSV (id,x,y,z) or lines x y z number."),
    ],
    out: Annotated[Path, Writes.FILE, typer.Argument(metavar="OUT", help="CSV: id,X,Y,Z,sd_X,sd_Y,sd_Z.")],
    point_sd: Annotated[
        float, typer.Option(min=0.0, help="Standard deviation of the points' own coordinates, model units.")
    ] = 0.0,
    decimals: Annotated[int, typer.Option(min=0, max=15, help="Decimals of transformed points.")] = 6,
    quiet: Quiet = False,
) -> None:
    """Transform any number of model points by a former orientation (part II)."""
    with job:
        from photogram.absolute_orientation import transform_file

        similarity = _former(result)
        with job.outputs() as outputs, _progress(points, quiet) as progress:
            count = transform_file(
                similarity,
                points,
                out,
                decimals=decimals,
                point_sd=point_sd,
                outputs=outputs,
                progress=progress,
            )
        if not quiet:
            output.print(f"{count} points written: {escape(str(out))}")


def _former(path: Path) -> Similarity:
    """Read a former result in either of its forms."""
    from photogram.absolute_orientation.cards import read_transformation
    from photogram.absolute_orientation.document import read_similarity
    from photogram.io.files import read_lines

    document = any(line.lstrip().startswith("{") for line in read_lines(path)[:1])
    return read_similarity(path, usable=True) if document else read_transformation(path)


def _read(
    file: Path, format_: Format, zero_missing: bool, ground_unit: str, model_unit: str
) -> tuple[Stations, Similarity | None, list[Message]]:
    from photogram.absolute_orientation import read_cards, read_csv
    from photogram.absolute_orientation.csv_files import is_csv

    if format_ is Format.CSV or (format_ is Format.AUTO and is_csv(file)):
        return read_csv(file, ground_unit=ground_unit, model_unit=model_unit), None, []
    deck = read_cards(file, zero_missing=zero_missing, ground_unit=ground_unit, model_unit=model_unit)
    return deck.stations, deck.former, deck.messages


def _small_files(
    result: Orientation, listing: Path | None, plot: Path | None, trace: Path | None, json: Path | None
) -> dict[Path, bytes]:
    """Make everything that is small, before anything is written."""
    made: dict[Path, bytes] = {}
    if listing:
        made[listing] = result.report().encode()
    if plot:
        made[plot] = result.plot()
    if trace:
        from photogram.absolute_orientation.trace import trace_text

        made[trace] = trace_text(result).encode()
    if json:
        made[json] = result.to_json()
    return made


def _stream(
    outputs: OutputSet,
    result: Orientation,
    points: Path,
    target: Path,
    json: Path | None,
    point_sd: float,
    decimals: int | None,
    quiet: bool,
) -> None:
    """Transform a file of points, into the JSON document too."""
    from photogram.absolute_orientation.document import point_rows, without_points
    from photogram.absolute_orientation.stream import Document, decimals_for, transform_file

    if decimals is None:
        decimals = decimals_for((result.rms or 0.0) / result.similarity.scale)
    document = None
    if json:
        document = Document(json, b"".join(without_points(result)), point_rows(*result.transform_points()))
    with _progress(points, quiet) as progress:
        transform_file(
            result.similarity,
            points,
            target,
            decimals=decimals,
            point_sd=point_sd,
            document=document,
            outputs=outputs,
            progress=progress,
        )


@contextmanager
def _progress(points: Path, quiet: bool) -> Iterator[Callable[[int], None] | None]:
    """Show on standard error how many points are done."""
    if quiet:
        yield None
        return
    with errors.status(f"transforming {escape(points.name)}", spinner="line") as status:
        yield lambda done: status.update(f"transforming {escape(points.name)}: {done} points")
