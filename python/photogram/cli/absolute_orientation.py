"""`photogram absolute-orientation`: orient a model, transform its points; join models of pairs to a strip."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.markup import escape

from photogram.cli.console import NOT_CONVERGED, NOT_USABLE, output, print_document
from photogram.cli.documents import TEXT, OfPrograms
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, InputFile, OutputFile, Reads, Writes, misuse
from photogram.cli.projects import EXAMPLE, read_project
from photogram.formats.read_options import ReadOptions

if TYPE_CHECKING:
    from photogram.absolute_orientation import Similarity


ModelPointSd = Annotated[float, typer.Option(min=0.0)]


@with_job("absolute-orientation", example=("absolute_orientation", "stations.csv"), ending="-oriented")
def absolute_orientation(
    job: Job,
    *,
    file: Input,
    points: InputFile = None,
    points_out: OutputFile = None,
    documents: OfPrograms,
    trace: OutputFile = None,
    reject: list[str] | None = None,
    restart: InputFile = None,
    part_two: OutputFile = None,
    restart_out: OutputFile = None,
    ident: str | None = None,
    start: Literal["auto", "report", "closed-form"] | None = None,
    scale: float | None = None,
    method: Literal["rigorous", "report", "fill-in"] = "rigorous",
    unit_variance: Literal["estimated", "unity"] = "estimated",
    point_sd: ModelPointSd = 0.0,
    decimals: Annotated[int | None, typer.Option(min=0, max=15)] = None,
    format: Literal["auto", "csv", "cards"] = "auto",  # noqa: A002  # the name of the option
    zero_missing: bool = False,
    ground_unit: str = "ground unit",
    model_unit: str = "model unit",
    strict: bool = False,
) -> None:
    """Orient a model absolutely: s, A, B of x = s A X + B from full, horizontal and height control.

    Prints problems, key figures, parameters and residuals; writes reports and transformed points to --out.
    Stations without control are transformed, too. Exit code 3: no convergence, or control that does not fit.
    """
    if trace and method == "rigorous":
        raise misuse("--trace", "requires", options="--method report or fill-in")
    from photogram import orient
    from photogram.absolute_orientation import read_cards, read_csv, read_similarity
    from photogram.absolute_orientation.document import point_rows, without_points
    from photogram.absolute_orientation.orientation import trace_text
    from photogram.absolute_orientation.stations import (
        Deck,
        is_csv,
        read_restart,
        restart_record,
        transformation_records,
    )
    from photogram.absolute_orientation.stream import decimals_for
    from photogram.arguments.arrays import number
    from photogram.io.places import Place, at_place
    from photogram.messages import Message

    if job.is_example:
        ground_unit, model_unit = "m", "mm"
        points = points or file.with_name("points.csv")
        job.reads(points)
    target = points_out or (documents.folder / f"{points.stem}-transformed.csv" if points else None)
    documents.declare(job, TEXT, pictures=["residuals"])
    job.writes(*([target] if target else []))
    units = {"ground_unit": ground_unit, "model_unit": model_unit}
    if format == "csv" or (format == "auto" and is_csv(file)):
        deck = Deck(read_csv(file, **units), None, "")
    else:
        deck = read_cards(file, zero_missing=zero_missing, **units)
    former, ident = deck.former, deck.identification if ident is None else ident
    if restart:
        own = _is_document(restart)
        former = read_similarity(restart) if own else read_restart(restart, deck.stations, deck.messages)
    if scale is not None:
        number("--scale", scale, "positive")
    with at_place(Place(file)):
        result = orient(
            deck.stations,
            method=method,
            start=start,
            former=former,
            reject=reject or (),
            unit_variance=unit_variance,
            trace=trace is not None,
            scale=scale,
        )
    result.messages[:0] = deck.messages
    if points and not result.usable:
        result.messages.append(Message.of("orientation.no-points"))
        points = None
    document = replace(result.document(), title=file.name)
    made = documents.inside({TEXT: result.report().encode()})
    made |= documents.pictures(lambda: {"residuals": result.plot()})
    made |= {trace: trace_text(result).encode()} if trace else {}
    made |= {} if points else job.as_json(result.to_json)
    if part_two and result.usable:
        made[part_two] = "\n".join([*transformation_records(result.similarity, ident), ""]).encode()
    if restart_out:
        made[restart_out] = f"{restart_record(result.similarity, ident)}\n".encode()
    made |= documents.page(job, lambda: document)
    written = list(made)
    with job.outputs() as outputs:
        if points and target:
            if decimals is None:
                decimals = decimals_for((result.rms or 0.0) / result.similarity.scale)
            sizes = {"point_sd": point_sd, "decimals": decimals}
            head = (without_points(result), point_rows(*result.transform_points())) if job.json else ()
            _transform_file(job, result.similarity, points, target, head, outputs=outputs, **sizes)
            written = [*filter(None, (target, job.json)), *written]
        for path, content in made.items():
            outputs.write(path, content)
    job.conclude(
        written,
        summary=lambda: print_document(document, TEXT, "parameters", "control", remarks=result.problems),
        code=result.verdict.exit_code(strict=strict),
    )


@with_job("absolute-orientation transform")
def transform(
    job: Job,
    *,
    result: Annotated[Path, Reads.FILE],
    points: Annotated[Path, Reads.FILE],
    out: Annotated[Path, Writes.FILE],
    point_sd: ModelPointSd = 0.0,
    decimals: Annotated[int, typer.Option(min=0, max=15)] = 6,
) -> None:
    """Transform any number of model points with an earlier orientation (part II)."""
    from photogram import _photocore
    from photogram.absolute_orientation import read_similarity
    from photogram.absolute_orientation.stations import read_transformation
    from photogram.io.json import opened

    similarity = read_similarity(result, usable=True) if _is_document(result) else read_transformation(result)
    with job.outputs() as outputs:
        sizes = {"point_sd": point_sd, "decimals": decimals}
        head = opened({"program": f"photogram {_photocore.__version__}"}, "points")
        count = _transform_file(job, similarity, points, out, (head,), outputs=outputs, **sizes)
    job.conclude(filter(None, (out, job.json)), summary=lambda: output.print(f"{count} points"))


@with_job("absolute-orientation relative", example=EXAMPLE)
def relative(
    job: Job,
    *,
    path: Input,
    out: Annotated[Path, Writes.FILE],
    photos: str | None = None,
    reading: ReadOptions,
) -> None:
    """Orient pairs of photos relatively and join their models to a strip.

    Each pair of neighbours is adjusted in a minimum datum. Similarities over common points and the common
    projection centre join the models. The table contains the control of the project and the model points.
    Exit code 3: a model did not converge. Exit code 4: a model without redundancy.
    """
    import numpy as np

    from photogram.absolute_orientation.models import strip_of
    from photogram.formats.reduced_coordinates import given_control
    from photogram.io.csv_text import csv_text

    project = read_project(job, path, reading)
    names = project.block.photo_ids if photos is None else [each.strip() for each in photos.split(",")]
    strip = strip_of(project.block, names)
    control = given_control(project)
    unknown = np.full(3, np.nan), np.zeros(3, dtype=bool)
    ground = [np.where(held, at, np.nan) for at, held in (control.get(each, unknown) for each in strip.ids)]
    columns = {"id": list(strip.ids)} | dict(zip("XYZ", np.array(ground).T, strict=True))
    columns |= dict(zip("xyz", strip.positions.T, strict=True))
    job.finish(
        {out: csv_text(columns)},
        document=strip.document(),
        code=NOT_USABLE if strip.unchecked else 0 if strip.converged else NOT_CONVERGED,
    )


def _is_document(path: Path) -> bool:
    from photogram.io.files import read_lines

    return any(line.lstrip().startswith("{") for line in read_lines(path)[:1])


def _transform_file(
    job: Job, similarity: Similarity, points: Path, target: Path, head: tuple[bytes, ...], **options: Any
) -> int:
    """Transform points with a status line, return their number; `head` begins the JSON document."""
    from photogram.absolute_orientation import transform_file
    from photogram.absolute_orientation.stream import Document

    options["document"] = Document(job.json, *head) if job.json else None
    text = f"transforming {escape(points.name)}"
    with job.status(text) as update:
        progress = None if update is None else lambda done: update(f"{text}: {done} points")
        return transform_file(similarity, points, target, progress=progress, **options)
