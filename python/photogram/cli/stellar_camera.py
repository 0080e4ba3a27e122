"""`photogram stellar-camera`: calibrate a camera by stars, on a plate or on digital exposures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.console import output, print_document
from photogram.cli.documents import OfPrograms
from photogram.cli.job import Job, with_job
from photogram.cli.options import Input, InputFile, Threads, Writes
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.io.writing import Content


Lens = Literal["auto", "brown", "equidistant", "equisolid", "stereographic", "kannala_brandt"]
"""Lenses of digital cameras; `photogram.stellar.sky_cameras` has them."""
Effect = Literal["annual-aberration", "light-deflection", "diurnal-aberration", "refraction"]
"""Effects on star positions."""


@with_job("stellar-camera", example=("stellar", "plate.toml"))
def stellar_camera(
    job: Job,
    *,
    deck: Input,
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
    from photogram.stellar.deck import read_deck
    from photogram.stellar.plain import inputs, read_plain
    from photogram.stellar.printout import plate_list, printout

    is_toml = deck.suffix.lower() == ".toml"
    problems = [read_plain(deck)] if is_toml else read_deck(deck)
    job.reads(*(inputs(deck) if is_toml else [deck]))
    documents = replace(documents, out=documents.out or Path(f"{deck.stem}-calibrated"))
    documents.declare(job)
    files: dict[Path, Content] = {}
    asked: dict[Path, bytes] = {}
    results = []
    for number, problem in enumerate(problems, 1):
        if as_published:
            problem = replace(problem, options=replace(problem.options, as_published=True))
        result = calibrate(problem)
        document = result.document()
        results.append((result, document))
        mark = f"-{number}" if len(problems) > 1 else ""
        cameras = {f"camera{mark}.json": camera_document(result)}
        files |= documents.inside({f"listing{mark}.txt": result.report().encode()})
        if problem.options.as_published:
            files |= documents.inside({f"printout{mark}.txt": printout(result).encode()})
        if problem.options.plate_list:
            files |= documents.inside({f"plate{mark}.txt": plate_list(result)})
        withheld = phrase("command.camera-withheld", names=list(cameras))
        files |= documents.unless_withheld(cameras, withheld, usable=result.verdict.usable)
        files |= documents.pictures(document.plots, mark)
        files |= documents.page(job, result.document, mark)
        asked |= job.as_json(result.to_json, mark)
    code = worst((result.verdict for result, _ in results), strict=strict)

    def summarize() -> None:
        for result, document in results:
            print_document(document, "the report", remarks=result.messages)

    job.finish(files, asked, summary=summarize, code=code)


@with_job("stellar-camera exposures", example=("exposures", "night.toml"))
def exposures(
    job: Job,
    *,
    night: Input,
    lens: Lens | None = None,
    common_scale: Annotated[bool | None, typer.Option("--common-scale/--two-scales")] = None,
    without: list[Effect] | None = None,
    any_roll: bool = False,
    blind: tuple[float, float] | None = None,
    documents: OfPrograms,
    threads: Threads = None,
    strict: bool = False,
) -> None:
    """Calibrate a digital camera, also an all-sky camera, by exposures of the stars (needs pyerfa)."""
    from photogram.io.places import Place, at_place
    from photogram.stellar.night_calibration import calibrate_night
    from photogram.stellar.night_file import read_night
    from photogram.stellar.plain import inputs
    from photogram.stellar.sky_cameras import WITH_YAML, to_yaml

    job.reads(*inputs(night))
    documents = replace(documents, out=documents.out or Path(f"{night.stem}-calibrated"))
    documents.declare(job)
    said: dict[str, dict[str, Any]] = {
        "camera": {"lens": lens, "common_scale": common_scale},
        "matching": {"roll_known": False if any_roll else None, "blind_field_deg": blind},
        "places": {effect.replace("-", "_"): False for effect in without or []},
    }
    given = {
        table: {key: value for key, value in values.items() if value is not None}
        for table, values in said.items()
    }
    with at_place(Place(night)):
        result = calibrate_night(read_night(night, given), threads)
    document = result.document()
    tables = {
        f"{name}.csv": document.table(key).frame().to_csv(index=False).encode()
        for name, key in (("exposures", "exposures"), ("star-images", "images"))
    }
    cameras = {"camera.json": result.camera.to_json()}
    if result.camera.lens in WITH_YAML:
        cameras["camera.yaml"] = to_yaml(result.camera, result.night.frame, "opencv")
        cameras["camera-ros.yaml"] = to_yaml(result.camera, result.night.frame, "ros")
    withheld = phrase("command.camera-withheld", names=list(cameras))
    documents.conclude(
        job,
        result,
        tables,
        document=document,
        plots=document.plots,
        beside=documents.unless_withheld(cameras, withheld, usable=result.verdict.usable),
        tables=("parameters",),
        remarks=result.messages,
        code=result.verdict.exit_code(strict=strict),
    )


@with_job("stellar-camera places")
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
    from photogram.show.page import Document
    from photogram.stellar.catalogue import Catalogue
    from photogram.stellar.places import apparent_places

    found = Catalogue.read(catalogue, epoch) if catalogue else Catalogue.hipparcos()
    stars = found.brighter(faintest)
    right, declination = apparent_places(stars, utc).T
    names, count = list(stars.ids), len(stars.ids)
    columns = {"star": names, "ra_rad": right, "dec_rad": declination, "magnitude": stars.magnitudes}
    made = Document("Apparent places", "", members={"utc": utc, "stars": count})
    summary = f"{count} stars at {utc}"
    job.finish({out: csv_text(columns)}, document=made, summary=lambda: output.print(summary))
