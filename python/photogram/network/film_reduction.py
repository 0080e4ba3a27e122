"""Reduction of film readings to the camera frame, and the affine form of films."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import by_key, frozen
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.films import Film, FilmNumbers, Readings, Scan
from photogram.network.observations import Fiducial

FEWEST = 4  # Minimum number of marks for an affine fit with redundancy
FIT = 5e-4  # Maximum misfit of marks relative to their extent: 0.1 mm of a film of 23 cm
_PLACES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])  # Readings here determine an affine map
_DIFFERENCES = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])


def is_scanned(block: Block) -> bool:
    return any(isinstance(each, Scan) for each in block.passages)


def camera_unit(block: Block) -> str:
    """Return the unit of image coordinates in the camera frame: mm for films."""
    return "mm" if is_scanned(block) else block.image_unit


def camera_images(block: Block) -> Floats:
    """Return (m, 2) images in the camera frame, with the given parameters of films.

    NaN for a reading outside the film model. Images of other photos are unchanged.
    """
    found = block.image_xy
    for scan in (each for each in block.passages if isinstance(each, Scan)):
        found = found.copy() if found is block.image_xy else found
        own = block.image_photos == block._photo_rows[scan.photo]
        vectors = np.array([each.position for each in scan.film.unknowns])
        found[own] = _photocore.film_places(scan.film.numbers(), vectors, block.image_xy[own])
    return found


def _to_marks(block: Block, images: Floats) -> Floats:
    """Correct the images of each photo by an affine map fitted to its marks; (m, 2)."""
    read = by_key((each.photo, each) for each in block.observations.of_type(Fiducial))
    for photo, own in read.items():
        film = own[0].film
        vectors = np.array([each.position for each in film.unknowns])
        readings = np.array([each.reading for each in own], dtype=float)
        found = _photocore.film_places(film.numbers(), vectors, readings)
        places = np.array([each.mark.position[:2] for each in own])
        if len(own) < FEWEST or not np.isfinite(found).all():
            continue
        affine, *_ = np.linalg.lstsq(_with_one(found), places, rcond=None)
        away = np.abs(_with_one(found) @ affine - places).max()
        if away < FIT * np.ptp(places, axis=0).max():
            of_photo = block.image_photos == block._photo_rows[photo]
            images[of_photo] = _with_one(images[of_photo]) @ affine
    return images


def _with_one(xy: Floats) -> Floats:
    return np.column_stack([np.ones(len(xy)), xy])


def as_seen(block: Block) -> Block:
    """Convert a block with films to images in the camera frame, without films and marks.

    The given film parameters are used, and an affine correction if a photo has four marks or more. Other film
    errors are negligible for functions that use rays only.
    """
    if not is_scanned(block):
        return block
    pitches = np.ones(len(block.photo_ids))
    for scan in (each for each in block.passages if isinstance(each, Scan)):
        pitches[block._photo_rows[scan.photo]] = scan.film.readings.pitch
    return block.replace(
        image_xy=_to_marks(block, camera_images(block)),
        image_sd=block.image_sd * pitches[block.image_photos, np.newaxis],
        passages=[each for each in block.passages if not isinstance(each, Scan)],
        observations=[
            each
            for each in block.observations
            if not any(isinstance(own, FilmNumbers) for own in each.unknowns)
        ],
    )


@dataclass(frozen=True)
class Affine:
    """Affine form of a film: reading = a0 + a1 x + a2 y, x and y in the camera frame.

    Attributes
    ----------
    matrix
        (2, 3) coefficients a0, a1, a2 of both reading coordinates.
    scale_x, scale_y
        Millimetres of the reading per millimetre of the camera along each axis.
    between_axes
        Angle between the images of the axes minus 90 degrees (radians).
    rotation
        Angle of the image of the x axis (radians).
    sd
        (4,) standard deviations of the preceding four attributes.
    matrix_sd
        (2, 3) standard deviations of `matrix`, assuming an errorless scanner.
    """

    matrix: Floats
    scale_x: float
    scale_y: float
    between_axes: float
    rotation: float
    sd: Floats
    matrix_sd: Floats


def affine_form(film: Film, vectors: Sequence[Floats], cofactors: Floats) -> Affine:
    """Compute the affine form of a film; bends, patterns and curves are ignored.

    `vectors` are the (3,) values of each unknown, in the order of the film. `cofactors` (6, 6) are of t1, t2,
    theta, m, b1, b2; m includes the roll.
    """
    own = dict(zip(map(id, film.unknowns), vectors, strict=True))
    parts = [film.placement, film.size, *([] if film.roll is None else [film.roll]), film.scanner]
    plain = Film(
        film.placement, film.size, film.scanner, film.readings, roll=film.roll, mirrored=film.mirrored
    )
    numbers = np.array([own[id(each)] for each in parts])
    readings, by_film = _affine(plain, numbers)
    theta, side = float(numbers[0, 2]), -1.0 if film.mirrored else 1.0
    # The columns of J (I + S), without placement and scanner, are the images of the axes.
    numbers[0], numbers[-1] = 0.0, (1.0, 1.0, 0.0)
    (_, x, y), (_, by_x, by_y) = _affine(replace(plain, readings=Readings()), numbers)
    lengths, turns = (np.hypot(*x), np.hypot(*y)), (np.arctan2(x[1], x[0]), np.arctan2(y[1], y[0]))
    of_x, of_y = (
        np.array([-each[1], each[0]]) @ by / length**2
        for each, by, length in zip((x, y), (by_x, by_y), lengths, strict=True)
    )
    between = side * (turns[1] - turns[0]) - np.pi / 2
    between = (between + np.pi) % (2 * np.pi) - np.pi
    partials = np.array([x @ by_x / lengths[0], y @ by_y / lengths[1], side * (of_y - of_x), of_x])
    with np.errstate(invalid="ignore"):
        sd = np.sqrt(np.einsum("ik,kl,il->i", partials, cofactors, partials))
        matrix_sd = np.sqrt(np.einsum("ijk,kl,ijl->ji", by_film, cofactors, by_film))
    (scale_x, scale_y), rotation = map(float, lengths), float(turns[0] + theta)
    matrix = frozen(readings.T)
    return Affine(matrix, scale_x, scale_y, float(between), rotation, frozen(sd), frozen(matrix_sd))


def _affine(film: Film, vectors: Floats) -> tuple[Floats, Floats]:
    """Return (3, 2) a0, a1, a2 of both readings, and their (3, 2, 6) partials by t1 to b2."""
    readings, partials = _photocore.film_readings(film.numbers(), vectors, _PLACES)
    return _DIFFERENCES @ readings, np.einsum("ij,jkl->ikl", _DIFFERENCES, partials[:, :, 2:8])
