"""`photogram certificate`, `photogram camera`: a calibration of a camera, and calibrations over years."""

from __future__ import annotations

import math
from datetime import date
from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.documents import PageAndJson
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, Reads, misuse
from photogram.words import phrase


@with_job("certificate", example=("certificate", "rc10.toml"))
def certificate(
    job: Job,
    *,
    path: Input,
    camera: str | None = None,
    documents: PageAndJson,
) -> None:
    """Check a camera's certificate: typing errors, marks from distances, lens from its table.

    The command compares distances with coordinates, adjusts marks that have only distances, and fits a lens
    to a table of distortion, all with covariance. Exit code 4: a distance differs from its coordinates by
    more than 0.010 mm. The report lists single changes of a figure that explain it.
    """
    from photogram.film import Certificate

    found = Certificate.read(path, camera)
    documents.conclude(job, found, report=False)


@with_job("camera compare", example=(), ending="-compared", example_name="camera")
def compare_certificates(
    job: Job,
    *,
    calibrations: Annotated[list[Path] | None, Reads.FILE] = None,
    day: list[str] | None = None,
    name: str = "1",
    angle: Annotated[float | None, typer.Option(min=0.1, max=89.0)] = None,
    documents: PageAndJson,
) -> None:
    """Compare calibrations of cameras over years: drift, steps, control charts.

    The command compares images of directions instead of parameters, because parameters are correlated. Exit
    code 4: a camera has changed.
    """
    from photogram.errors import InputError
    from photogram.film import Certificate
    from photogram.film.years import DatedCamera, compare_cameras, simulated_certificates
    from photogram.stellar.cameras import camera_from

    read: list[Certificate | DatedCamera] = [*simulated_certificates()] if job.is_example else []
    days = list(day or [])
    for path in calibrations or []:
        if path.suffix.lower() == ".toml":
            read.append(Certificate.read(path))
            continue
        if not days:
            raise InputError(phrase("command.no-day"), file=path)
        text = days.pop(0)
        try:
            taken = date.fromisoformat(text)
        except ValueError:
            raise misuse("--day", "form", form="a date such as 1983-05-11", value=text) from None
        read.append(DatedCamera(taken, camera_from(path, name), source=path.stem))
    if days:
        raise misuse("--day", "day-without-file", day=days[0])
    found = compare_cameras(read, angle=None if angle is None else math.radians(angle))
    documents.conclude(job, found, report=False, tables=("calibrations", "series"))
