"""How each program is run on an input, in this process, and what it leaves behind."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from io import StringIO
from pathlib import Path
from pkgutil import iter_modules
from random import Random
from typing import Any, get_args

import numpy as np

import photogram
from photogram import cli
from photogram.adjustment.options import Ordering
from photogram.cli import (
    absolute_orientation,
    check,
    collection,
    comparator,
    giant,
    perspective_center,
    stellar_camera,
)
from photogram.cli.console import errors, output

from .boards import board_run
from .projects import PROJECTS, project_run

__all__ = ["PROGRAMS", "Watch"]

PAGES = 0.0
"""Part of the cases that have a report for the browser: it takes a hundred times as long as all else."""

Run = Callable[[Path, Random, bool], list[str]]
"""Runs a command in a directory with the input; returns the names of the outputs that must be there."""


class Watch:
    """What the programs do, seen from inside: whether they come to compute, and with what result."""

    COMPUTATIONS = (
        ("photogram", "adjust"),
        ("photogram", "adjust_in_parts"),
        ("photogram", "adjust_started"),
        ("photogram", "snoop"),
        ("photogram", "orient"),
        ("photogram.giant.checking", "check"),
        ("photogram.collection", "adjust"),
        ("photogram.perspective_center.deck", "determine"),
        ("photogram.comparator", "calibrate"),
        ("photogram.stellar", "calibrate"),
        ("photogram.stellar.night_calibration", "calibrate_night"),
    )
    METHODS = (
        ("photogram.targets.calibration", "Calibration", "adjust"),
        ("photogram.targets.calibration", "Calibration", "snoop"),
        ("photogram.absolute_orientation.similarity", "Similarity", "transform"),
        ("photogram.comparator.correction", "Correction", "apply"),
        ("photogram.comparator.correction", "Correction", "invert"),
    )

    def __init__(self) -> None:
        self.reached = False
        self.results: list[Any] = []
        for module, name in self.COMPUTATIONS:
            self._watch(import_module(module), name)
        for module, holder, name in self.METHODS:
            self._watch(getattr(import_module(module), holder), name)
        # The commands turn errors into messages and exit codes; the fuzzer wants the errors themselves.
        for module in (found.name for found in iter_modules(cli.__path__)):
            if module not in ("console", "__main__"):
                vars(import_module(f"photogram.cli.{module}")).update(failures=_as_they_are)
        errors.file = output.file = StringIO()

    def begin(self) -> None:
        """Forget the input before."""
        self.reached = False
        self.results.clear()
        output.file.seek(0)
        output.file.truncate()

    def _watch(self, holder: Any, name: str) -> None:
        compute = getattr(holder, name)

        def computed(*arguments: Any, **options: Any) -> Any:
            self.reached = True
            result = compute(*arguments, **options)
            self.results.append(result)
            return result

        setattr(holder, name, computed)


@contextmanager
def _as_they_are() -> Iterator[None]:
    yield


def _without_page(rng: Random) -> bool:
    """Return whether no report for the browser is made."""
    return rng.random() >= PAGES


def _giant(place: Path, rng: Random, quiet: bool) -> list[str]:
    listing = place / "listing.txt" if rng.random() < 0.2 else None
    giant.giant(
        directory=place / "in",
        out=place / "out",
        json=place / "result.json",
        listing=listing,
        as_published=rng.random() < 0.25,
        ordering=rng.choice(get_args(Ordering)),
        threads=1,
        no_html=_without_page(rng),
        quiet=quiet,
    )
    return ["out/report.txt", "result.json", *(["listing.txt"] if listing else [])]


def _check(place: Path, rng: Random, quiet: bool) -> list[str]:
    check.check(directory=place / "in", json=place / "result.json", threads=1, quiet=quiet)
    return ["result.json"]


def _collection(place: Path, rng: Random, quiet: bool) -> list[str]:
    collection.collection(
        problem=place / "in" / "input",
        out=place / "out",
        json=place / "result.json",
        loss=rng.choice(("squares", "huber", "cauchy")),
        sd=rng.choice((1.0, 0.1)),
        max_iterations=60,
        covariance=rng.random() < 0.8,
        threads=1,
        no_html=_without_page(rng),
        quiet=quiet,
    )
    # A damaged Bundle file may be taken for the other format.
    adjusted = next((place / "out").glob("adjusted.*")).name
    return [f"out/{adjusted}", "out/report.txt", "result.json"]


def _orientation(place: Path, rng: Random, quiet: bool) -> list[str]:
    absolute_orientation.absolute_orientation(
        file=place / "in" / "input",
        json=place / "result.json",
        out=place / "out",
        reject=["S1"] if rng.random() < 0.1 else None,
        method=rng.choices(("rigorous", "report", "fill-in"), (6, 1, 1))[0],
        start=rng.choice((None, None, "auto", "report", "closed-form")),
        unit_variance=rng.choice(("estimated", "unity")),
        zero_missing=rng.random() < 0.2,
        no_html=_without_page(rng),
        quiet=quiet,
    )
    return ["result.json", "out/report.txt"]


def _transform(place: Path, rng: Random, quiet: bool) -> list[str]:
    absolute_orientation.transform(
        result=place / "in" / "result",
        points=place / "in" / "points",
        out=place / "transformed.csv",
        point_sd=rng.choice((0.0, 0.001)),
        decimals=rng.randrange(16),
        quiet=quiet,
    )
    return ["transformed.csv"]


def _perspective(place: Path, rng: Random, quiet: bool) -> list[str]:
    perspective_center.perspective_center(
        deck=place / "in" / "grid.deck",
        json=place / "result.json",
        out=place / "out",
        as_published=rng.random() < 0.3,
        weights=rng.choice(("equal", "readings", "deviations")),
        no_html=_without_page(rng),
        quiet=quiet,
    )
    return ["result.json", "out/listing.txt"]


def _tables(place: Path, rng: Random, quiet: bool) -> list[str]:
    comparator.comparator(
        paths=[place / "in" / "readings.csv"],
        grid=[str(place / "in" / "grid.csv")],
        out=place / "out",
        json=place / "result.json",
        plots=False,
        as_published=rng.random() < 0.3,
        polynomial=False,
        estimate_grid=rng.random() < 0.2,
        quiet=quiet,
    )
    return ["out/listing.txt", "out/correction.json", "result.json"]


def _cards(place: Path, rng: Random, quiet: bool) -> list[str]:
    comparator.comparator(
        paths=[place / "in" / "deck.txt"],
        out=place / "out",
        json=place / "result.json",
        plots=False,
        as_published=rng.random() < 0.3,
        polynomial=rng.random() < 0.3,
        quiet=quiet,
    )
    return ["result.json"]


def _correct(place: Path, rng: Random, quiet: bool) -> list[str]:
    source = place / "in"
    comparator.correct(
        correction=source / "correction.json",
        measurements=source / "points.csv",
        corrected=place / "out.csv",
        invert=rng.random() < 0.5,
    )
    return ["out.csv"]


def _plate(name: str) -> Run:
    def run(place: Path, rng: Random, quiet: bool) -> list[str]:
        stellar_camera.stellar_camera(
            deck=place / "in" / name,
            out=place / "out",
            json=place / "result.json",
            as_published=rng.random() < 0.3,
            no_html=_without_page(rng),
            quiet=quiet,
        )
        return []

    return run


def _exposures(place: Path, rng: Random, quiet: bool) -> list[str]:
    stellar_camera.exposures(
        night=place / "in" / "input.toml",
        out=place / "out",
        json=place / "result.json",
        threads=1,
        no_html=_without_page(rng),
        quiet=quiet,
    )
    return ["out/report.txt", "out/camera.json", "result.json"]


def _simulate(place: Path, rng: Random, quiet: bool) -> list[str]:
    """Simulate and adjust by the Python interface, with values as a program would have them."""
    try:
        values = json.loads((place / "in" / "options").read_text())
        if not isinstance(values, dict):
            return []
    except (OSError, ValueError, RecursionError):
        return []
    if values.keys() - _SIMULATED:
        return []
    made = photogram.simulate(**values, check_points=1)
    if len(made.block.image_xy) < 500:
        result = photogram.adjust(made.block, threads=1)
        (place / "report.txt").write_text(result.report())
        (place / "result.json").write_bytes(result.to_json())
    return []


_SIMULATED = {
    "strips",
    "photos_per_strip",
    "forward_overlap",
    "side_overlap",
    "principal_distance",
    "frame_size",
}
_SIMULATED |= {"flying_height", "relief", "points_per_photo", "crab", "tilt", "control_spacing", "control_sd"}
_SIMULATED |= {"image_sd", "position_sd", "attitude_sd", "origin", "seed"}

PROGRAMS: dict[str, tuple[Run, int]] = {
    "GIANT project": (_giant, 8),
    "GIANT project, check": (_check, 2),
    "BAL collection": (_collection, 20),
    "Bundle file": (_collection, 6),
    "orientation: stations": (_orientation, 40),
    "orientation: transform": (_transform, 30),
    "perspective-center deck": (_perspective, 14),
    "comparator: tables": (_tables, 2),
    "comparator: cards": (_cards, 2),
    "comparator: correction": (_correct, 16),
    "stellar camera: plain form": (_plate("input.toml"), 1),
    "stellar camera: deck": (_plate("input.deck"), 2),
    "exposures": (_exposures, 1),
    "simulate": (_simulate, 4),
    "calibration with a board": (board_run, 2),
}
PROGRAMS |= {f"project: {name}": (project_run(main), often) for name, (main, often) in PROJECTS.items()}
"""How each program is run, and how often among all inputs: what is quick is tried more often."""


def unsound(result: Any) -> str | None:
    """Name what is not finite in a result that converged without a remark; None where all is well."""
    if not getattr(result, "converged", False) or getattr(result, "messages", None):
        return None
    values = {
        name: getattr(result, name, None)
        for name in ("photo_positions", "photo_attitudes", "photo_parameters")
    }
    for name in ("photo_positions", "photo_attitudes", "photo_parameters"):
        if values[name] is not None and hasattr(result, "photo_images"):
            values[name] = values[name][np.asarray(result.photo_images) > 0]
    if hasattr(result, "used_points"):
        values["point_positions"] = result.point_positions[result.used_points]
        values["residuals"] = result.residuals[result.used_images]
    for name in ("position", "attitude", "weighted_sum_of_squares", "variance_of_unit_weight", "rms"):
        values[name] = getattr(result, name, None)
    for name, holder, attribute in (
        ("similarity", "similarity", "scale"),
        ("camera", "camera", "values"),
        ("parameters", "solved", "parameters"),
    ):
        values[name] = getattr(getattr(result, holder, None), attribute, None)
    for name, value in values.items():
        if value is not None and not callable(value) and not np.isfinite(np.asarray(value, float)).all():
            return name
    return None
