"""Small vectors over the frame of a film camera: residuals of marks, and patterns of films."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.films import Film, FilmPlacement, FilmSize, Pattern, Readings, Scanner
from photogram.network.observations import Fiducial
from photogram.plots.picture_data import VectorField
from photogram.results.films import numbers_of_film
from photogram.results.network_trial import OBSERVATION
from photogram.results.suspects import observations_of_core

if TYPE_CHECKING:
    from photogram import Result

STEPS = 9  # Places of a pattern along a side of the format


@dataclass(frozen=True, eq=False)
class MarkResiduals:
    """The residuals of k readings of marks, brought back to the frame of the camera, and their tests."""

    photos: Indices  # (k,) row of the photo of each reading
    marks: tuple[str, ...]  # (k,) the name of its mark
    # (k, 2) observed minus computed, mm in the camera's frame: so those of turned and mirrored films
    # are alike
    xy: Floats
    tests: Floats  # (k,) T of both coordinates together; NaN where it was not tested


def mark_residuals(result: Result) -> MarkResiduals:
    """Return the residuals of all readings of marks, in the order of the block."""
    kind = result.kinds.get(Fiducial.KIND)
    rows = [] if kind is None else kind.rows.tolist()
    read = [each for each in (result.block.observations[row] for row in rows) if isinstance(each, Fiducial)]
    photos = {name: row for row, name in enumerate(result.block.photo_ids)}
    marks = result.fiducials
    xy = np.zeros((len(read), 2))
    for k, each in enumerate(read):
        assert kind is not None
        numbers = np.array(numbers_of_film(result, each.film))
        place = marks[each.mark.name].position[np.newaxis, :2]
        _, partials = _photocore.film_readings(each.film.numbers(), numbers, place)
        xy[k] = np.linalg.solve(partials[0, :, :2], kind.residuals[k])
    return MarkResiduals(
        np.array([photos[each.photo] for each in read], dtype=np.int64),
        tuple(each.mark.name for each in read),
        xy,
        _tests(result, read),
    )


def _tests(result: Result, read: list[Fiducial]) -> Floats:
    """Return T of readings; NaN where they were not tested."""
    summary, found = result.reliability_summary, np.full(len(read), np.nan)
    if summary is None or not read:
        return found
    place = {id(each): k for k, each in enumerate(read)}
    core, testable = observations_of_core(result.block), summary.testable
    for group in np.flatnonzero(summary.suspects.kinds == OBSERVATION).tolist():
        k = place.get(id(core[summary.suspects.subjects[group]]))
        if k is not None and testable[group]:
            found[k] = summary.tests.statistic[group]
    return found


def mean_mark_residuals(result: Result) -> list[VectorField]:
    """Return residuals of marks, mean over the photos of each camera, where these were read."""
    residuals, block, marks = mark_residuals(result), result.block, result.fiducials
    of = np.zeros(len(block.photo_ids), dtype=np.int64)
    if block.photo_cameras is not None:
        of = block.photo_cameras
    found = []
    for camera in np.unique(of[residuals.photos]).tolist():
        sums: dict[str, list[Floats]] = {}
        for photo, mark, xy in zip(residuals.photos.tolist(), residuals.marks, residuals.xy, strict=True):
            if of[photo] == camera:
                sums.setdefault(mark, []).append(xy)
        name = block.camera_names[camera] if block.camera_names else ""
        count = np.unique(residuals.photos[of[residuals.photos] == camera]).size
        found.append(
            VectorField(
                f"{name}: residuals of marks, mean of {count} photos",
                np.array([marks[mark].position[:2] for mark in sums]),
                np.array([np.mean(own, axis=0) for own in sums.values()]),
                tuple(mark.removeprefix(f"{name} ") for mark in sums),
            )
        )
    return found


def film_patterns(result: Result) -> list[VectorField]:
    """Return the systematic deformation of each film that has a pattern, over its format."""
    found: dict[int, VectorField] = {}
    for _, film in result.films:
        pattern = film.pattern
        if pattern is not None and id(pattern) not in found:
            found[id(pattern)] = _deformation(result, pattern)
    return list(found.values())


def _deformation(result: Result, pattern: Pattern) -> VectorField:
    """Return D(q) over the format: what a film that has changed in no other way reads, less q."""
    own = {id(each.given): each.position for each in result.unknowns}
    numbers = np.asarray(pattern.numbers)
    low, high = np.full(2, -numbers[0]), np.full(2, numbers[0])
    if pattern.kind == "grid":
        low, high = numbers[:2], numbers[:2] + (numbers[4:] - 1) * numbers[2:4]
    across, up = np.linspace(low, high, STEPS).T
    places = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
    still = Film(FilmPlacement("still"), FilmSize("still"), Scanner("still"), Readings(), pattern=pattern)
    vectors = np.array([own.get(id(each), each.position) for each in still.unknowns])
    readings, _ = _photocore.film_readings(still.numbers(), vectors, places)
    name = pattern.weights[0].name
    return VectorField(f"{name}: pattern {pattern.kind}", places, readings - places)
