"""`photogram stellar-camera`: calibrate a camera by stars, on a plate or on digital exposures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.console import output, print_document, print_withheld
from photogram.cli.documents import OfPrograms
from photogram.cli.job import Input, InputFile, Job, OutputFolder, Writes, with_job
from photogram.cli.options import Threads
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.stellar.night_calibration import CalibratedNight
    from photogram.stellar.problem import Problem
    from photogram.stellar.result import Result


Lens = Literal["auto", "brown", "equidistant", "equisolid", "stereographic", "kannala_brandt"]
"""Lenses of digital cameras; `photogram.stellar.lenses` has them."""


class Effect(StrEnum):
    """Effects on star positions."""

    ANNUAL_ABERRATION = "annual-aberration"
    LIGHT_DEFLECTION = "light-deflection"
    DIURNAL_ABERRATION = "diurnal-aberration"
    REFRACTION = "refraction"


@with_job(example=("stellar", "plate.toml"))
def stellar_camera(
    job: Job,
    *,
    deck: Input,
    out: OutputFolder = None,
    documents: OfPrograms,
    as_published: bool = False,
    strict: bool = False,
) -> None:
    """Calibrate a camera by a plate with images of stars (NOAA Technical Report NOS 55).

    If the verdict forbids the use of the result, camera.json is withheld. `photogram stellar-camera
    exposures` calibrates a digital camera by exposures of the sky.
    """
    from photogram.statistics.verdict import worst
    from photogram.stellar import calibrate
    from photogram.stellar.cameras import camera_document

    problems, inputs = _read(deck)
    job.reads(*inputs)
    pictures = documents.plot_format if documents.plots else ""
    target = out or Path(f"{deck.stem}-calibrated")
    documents.place(target)  # rejected before any computation
    written: dict[Path, bytes] = {}
    asked: dict[Path, bytes] = {}
    results = []
    for number, problem in enumerate(problems, 1):
        if as_published:
            problem = replace(problem, options=replace(problem.options, as_published=True))
        result = calibrate(problem)
        results.append(result)
        mark = f"-{number}" if len(problems) > 1 else ""
        written |= _files(result, target, mark, pictures)
        written |= _cameras(result, {target / f"camera{mark}.json": camera_document(result)})
        written |= documents.page(job, "stellar-camera", target, result.document, mark)
        if documents.json is not None:
            asked[documents.json.with_stem(documents.json.stem + mark)] = result.to_json()
    job.finish(
        written,
        asked,
        summary=lambda: _summarize(results),
        code=worst((result.verdict for result in results), strict=strict),
    )


@with_job(example=("exposures", "night.toml"))
def exposures(
    job: Job,
    *,
    night: Input,
    lens: Lens | None = None,
    common_scale: Annotated[bool | None, typer.Option("--common-scale/--two-scales")] = None,
    without: list[Effect] | None = None,
    any_roll: bool = False,
    blind: tuple[float, float] | None = None,
    out: OutputFolder = None,
    documents: OfPrograms,
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Calibrate a digital camera, also an all-sky camera, by exposures of the stars (needs pyerfa)."""
    from photogram.io.places import Place, at_place
    from photogram.stellar.night_calibration import calibrate_night
    from photogram.stellar.night_file import inputs, read_night

    job.reads(*inputs(night))
    pictures = documents.plot_format if documents.plots else ""
    said = _said(lens, common_scale, without or [], any_roll, blind)
    with at_place(Place(night)):
        result = calibrate_night(read_night(night, said), threads)
    target = out or Path(f"{night.stem}-calibrated")
    written = _night_files(result, target, pictures)
    written |= documents.page(job, "stellar-camera exposures", target, result.document)
    job.finish(
        written,
        documents.as_json(result),
        summary=lambda: _summarize([result], "parameters"),
        code=result.verdict.exit_code(strict=strict),
    )


@with_job()
def places(
    job: Job,
    out: Annotated[Path, Writes.FILE],
    utc: str,
    catalogue: InputFile = None,
    epoch: float = 2000.0,
    faintest: float = 6.0,
) -> None:
    """Compute apparent positions of stars for a plate (needs pyerfa).

    Positions are geocentric, true equator and equinox of date: proper motion, parallax, light deflection,
    annual aberration, precession and nutation (IAU 2006/2000A). OUT has star, ra_rad, dec_rad, magnitude.
    """
    from photogram.io.csv_text import csv_text
    from photogram.stellar.catalogue import Catalogue
    from photogram.stellar.places import apparent_places

    found = Catalogue.read(catalogue, epoch) if catalogue else Catalogue.hipparcos()
    stars = found.brighter(faintest)
    right, declination = apparent_places(stars, utc).T
    columns = {
        "star": list(stars.ids),
        "ra_rad": right,
        "dec_rad": declination,
        "magnitude": stars.magnitudes,
    }
    job.finish({out: csv_text(columns)}, summary=lambda: output.print(f"{len(stars.ids)} stars at {utc}"))


def _said(
    lens: Lens | None,
    common_scale: bool | None,
    without: list[Effect],
    any_roll: bool,
    blind: tuple[float, float] | None,
) -> dict[str, dict[str, Any]]:
    """Return the settings of the options by tables and keys of the file."""
    said: dict[str, dict[str, Any]] = {
        "camera": {"lens": lens, "common_scale": common_scale},
        "matching": {"roll_known": False if any_roll else None, "blind_field_deg": blind},
        "places": {effect.replace("-", "_"): False for effect in without},
    }
    return {
        table: {key: value for key, value in values.items() if value is not None}
        for table, values in said.items()
    }


def _summarize(results: Sequence[Result | CalibratedNight], *tables: str) -> None:
    for result in results:
        print_document(result.document(), "the report", *tables, remarks=result.messages)


def _read(deck: Path) -> tuple[list[Problem], list[Path]]:
    """Return the problems, and the files that they are read from."""
    from photogram.stellar.deck import read_deck
    from photogram.stellar.plain import inputs, read_plain

    return ([read_plain(deck)], inputs(deck)) if deck.suffix.lower() == ".toml" else (read_deck(deck), [deck])


def _cameras(result: Result | CalibratedNight, files: dict[Path, bytes]) -> dict[Path, bytes]:
    """Return the files of a camera; print a message if the verdict withholds them."""
    if result.verdict.usable:
        return files
    print_withheld(phrase("command.camera-withheld", names=[path.name for path in files]), files)
    return {}


def _files(result: Result, out: Path, mark: str, pictures: str) -> dict[Path, bytes]:
    """Create all files of one problem."""
    from photogram.stellar.plots import sketches
    from photogram.stellar.printout import plate_list, printout

    made = {out / f"listing{mark}.txt": result.report().encode()}
    if result.problem.options.as_published:
        made[out / f"printout{mark}.txt"] = printout(result).encode()
    if result.problem.options.plate_list:
        made[out / f"plate{mark}.txt"] = plate_list(result)
    if pictures:
        from photogram.stellar.plots import sketches

        plots = sketches(result).items()
        made |= {out / f"{name}{mark}.{pictures}": plot.render(pictures) for name, plot in plots}
    return made


def _night_files(result: CalibratedNight, out: Path, pictures: str) -> dict[Path, bytes]:
    """Create all files of a night."""
    from photogram.stellar.camera_yaml import WITH_YAML, to_yaml
    from photogram.stellar.night_plots import sketches

    document = result.document()
    made = {out / "report.txt": result.report().encode()}
    for name, key in (("exposures.csv", "exposures"), ("star-images.csv", "images")):
        made[out / name] = document.table(key).frame().to_csv(index=False).encode()
    cameras = {out / "camera.json": result.camera.to_json()}
    if result.camera.lens in WITH_YAML:
        cameras[out / "camera.yaml"] = to_yaml(result.camera, result.night.frame, "opencv")
        cameras[out / "camera-ros.yaml"] = to_yaml(result.camera, result.night.frame, "ros")
    made |= _cameras(result, cameras)
    if pictures:
        from photogram.stellar.night_plots import sketches

        plots = sketches(result).items()
        made |= {out / f"{name}.{pictures}": plot.render(pictures) for name, plot in plots}
    return made
