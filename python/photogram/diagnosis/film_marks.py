"""Misfitting fiducial marks of all photos, a photo, or a reading, with the cause.

Films that have changed along one axis but are modelled as conformal leave a pattern at the marks. Let d be
the mark readings of a photo, transformed to the camera frame, minus their certificate positions, with the
covariance of both. d is fitted by a shift, a rotation and a scale, and then also by

    d = (b1 x + b2 y, b2 x - b1 y)

Along the axis at atan2(b2, b1)/2 the film is longer by h = sqrt(b1^2 + b2^2), and shorter across. The
decrease of the weighted sum of squares is chi-square (2) if there is no such change.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.robust import critical
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.films import Film, Mark
from photogram.network.observations import Fiducial, KnownTogether
from photogram.network.unknowns import Unknown
from photogram.results.film_report import mark_residuals
from photogram.results.parts import ObservedKind
from photogram.results.result import Result
from photogram.statistics.distributions import critical_chi_square
from photogram.words import phrase

CERTIFICATE = "certificate"
ALIKE = 0.7  # Comparable test values, as a part of the largest
FEWEST_FAILING = 3  # Marks of a photo that all fail


@dataclass(frozen=True)
class _Tested:
    """The largest test value of a reading, or of a mark in its certificate."""

    value: float
    mark: str
    photo: str = ""


def mark_hints(result: Result) -> list[Message]:
    """Return the probable mistake in fiducial marks.

    If a mark fails on all photos, its certificate is wrong. If all marks of a photo fail, their names, the
    side of the film or the camera are wrong. A single reading may refer to a wrong location. The largest test
    value decides.
    """
    readings, marks = list(_readings(result)), list(_marks(result))
    tested = [*readings, *marks]
    largest = max((each.value for each in tested), default=0.0)
    limit = critical(2 * len(tested))
    if not largest > limit:
        return []
    whole = _photos(readings, limit)
    if any(each.value == largest and each.photo in whole for each in readings):
        return [Message(phrase("film-check.marks.all", photos=whole))]
    limit = max(limit, ALIKE * largest)
    order = sorted((each for each in tested if each.value >= limit), key=lambda each: -each.value)
    if order[0].photo:
        named = [
            phrase("film-check.marks.reading", mark=each.mark, photo=each.photo, test=each.value)
            for each in order
            if each.photo
        ]
        return [Message(phrase("film-check.marks.readings", readings=named))]
    named = [
        phrase(
            "film-check.marks.mark",
            mark=each.mark,
            test=each.value,
            n=sum(own.mark == each.mark for own in readings),
        )
        for each in order
        if not each.photo
    ]
    several = len(named) >= FEWEST_FAILING and all(film.pattern is None for _, film in result.films)
    return [Message(phrase(f"film-check.marks.{'pattern' if several else 'certificate'}", marks=named))]


def _photos(readings: list[_Tested], limit: float) -> list[str]:
    """Return the worst photos on which at least three marks, and more than half, fail."""
    found: dict[str, list[float]] = {}
    for each in readings:
        found.setdefault(each.photo, []).append(each.value)
    size = {photo: float(np.sqrt(np.mean(np.square(values)))) for photo, values in found.items()}
    worst = ALIKE * max(size.values(), default=0.0)
    return [
        photo
        for photo, values in found.items()
        if sum(each > limit for each in values) >= max(FEWEST_FAILING, len(values) / 2 + 0.5)
        and size[photo] >= worst
    ]


def _readings(result: Result) -> Iterator[_Tested]:
    kind = result.kinds.get(Fiducial.KIND)
    for row, values in _rows(kind):
        photo, mark = result.block.observations[row].of
        yield _Tested(float(values.max()), mark, photo)


def _marks(result: Result) -> Iterator[_Tested]:
    for row, values in _rows(result.kinds.get(CERTIFICATE)):
        own = result.block.observations[row]
        assert isinstance(own, KnownTogether)
        if all(isinstance(each, Mark) for each in own.joined):
            pairs = values.reshape(-1, 2).max(axis=1).tolist()
            yield from (_Tested(value, each.name) for value, each in zip(pairs, own.joined, strict=True))


def _rows(kind: ObservedKind | None) -> Iterator[tuple[int, np.ndarray]]:
    if kind is not None:
        yield from zip(kind.rows.tolist(), np.abs(np.nan_to_num(kind.standardized)), strict=True)


FEWEST = 4  # Marks of a photo: three fit any axis
CHANCE = 1e-3  # Probability of a hint in correct data
EXPLAINED = 0.7  # Least explained part of the weighted sum of squares of a photo
ALONE = 1e-6  # Least part of the largest column that is independent of the others


@dataclass(frozen=True)
class _Axis:
    """Relative film elongation of a photo along an axis, and its angle, degrees."""

    photo: str
    longer: float
    angle: float
    far: float


def axis_hints(result: Result) -> list[Message]:
    """Report photos with unmodelled film changes along one axis."""
    held = {
        row: film
        for row, film in result.films
        if not film.placement.is_held and (film.size.deviations[1:] == 0).all()
    }
    found = list(_axes(result, held))
    if not found:
        return []
    found.sort(key=lambda each: -each.longer)
    most = found[0]
    message = phrase(
        "film-check.axis",
        photos=[each.photo for each in found],
        photo=most.photo,
        longer=most.longer,
        angle=most.angle,
        at_marks=1e3 * most.far,
    )
    return [Message(message)]


def _axes(result: Result, films: dict[int, Film]) -> Iterator[_Axis]:
    """Yield photos with significant elongations that explain most of their misfit."""
    if not films:
        return
    residuals, marks = mark_residuals(result), result.fiducials
    kind = result.kinds.get(Fiducial.KIND)
    read = [] if kind is None else [result.block.observations[row] for row in kind.rows.tolist()]
    every = result.block.observations.of_type(KnownTogether)
    known = [each for each in every if all(isinstance(own, Mark) for own in each.joined)]
    limit = critical_chi_square(CHANCE / len(films), 2)
    for photo, film in films.items():
        own = np.flatnonzero(residuals.photos == photo).tolist()
        if len(own) < FEWEST:
            continue
        adjusted = [marks[residuals.marks[k]] for k in own]
        variances = film.readings.pitch**2 * np.concatenate([np.diag(read[k].precision) for k in own])
        covariance = _certificate(known, [each.given for each in adjusted]) + np.diag(variances)
        places = np.array([each.given.position[:2] for each in adjusted])
        away = residuals.xy[own] + np.array([each.position[:2] for each in adjusted]) - places
        whole, gain, b = _fitted(places, away.ravel(), covariance)
        if gain > limit and gain > EXPLAINED * whole:
            longer, far = 2.0 * float(np.hypot(*b)), float(np.linalg.norm(places, axis=1).max())
            angle = float(np.degrees(np.arctan2(b[1], b[0]) / 2))
            yield _Axis(result.block.photo_ids[photo], longer, angle, longer * far)


def _certificate(known: list[KnownTogether], marks: list[Unknown]) -> Floats:
    """Return the (2 n, 2 n) prior covariance of marks; 0 for errorless marks."""
    first = {id(mark): 2 * k for k, mark in enumerate(marks)}
    found = np.zeros((2 * len(marks),) * 2)
    for each in known:
        rows = [(k, first[id(mark)]) for k, mark in enumerate(each.joined) if id(mark) in first]
        here = [at + axis for _, at in rows for axis in (0, 1)]
        there = [2 * k + axis for k, _ in rows for axis in (0, 1)]
        found[np.ix_(here, here)] = each.precision[np.ix_(there, there)]
    return found


def _fitted(places: Floats, away: Floats, covariance: Floats) -> tuple[float, float, Floats]:
    """Return the sum of squares of a conformal fit, its decrease by b1 and b2, and these.

    Marks in one line cannot determine b1 and b2, which are then 0.
    """
    x, y = places.T
    one, none = np.ones_like(x), np.zeros_like(x)
    columns = [(one, none), (none, one), (x, y), (-y, x), (x, -y), (y, x)]
    design = np.array([np.column_stack(each).ravel() for each in columns]).T
    root = np.linalg.cholesky(covariance)
    basis, triangle = np.linalg.qr(np.linalg.solve(root, design))
    right = np.linalg.solve(root, away)
    parts = basis.T @ right
    size = np.abs(np.diag(triangle))
    if size.min() < ALONE * size.max():
        return 0.0, 0.0, np.zeros(2)
    whole = float(right @ right - parts[:4] @ parts[:4])
    b: Floats = np.linalg.solve(triangle[4:, 4:], parts[4:])
    return whole, float(parts[4:] @ parts[4:]), b
