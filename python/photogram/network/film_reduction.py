"""Scanned films as their cameras saw them: readings brought back to the frame of the camera."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.network.block import Block
from photogram.network.films import FilmNumbers, Scan
from photogram.network.observations import Fiducial

__all__ = ["as_seen", "camera_images", "camera_unit", "is_scanned"]

FEWEST = 4
"""Marks of an affine fit that has something to be judged by."""
FIT = 5e-4
"""Parts of their extent to which marks fit: 0.1 mm of a film of 23 cm; others are wrong."""


def is_scanned(block: Block) -> bool:
    """Whether images of a block are readings of scanned films or plates."""
    return any(isinstance(each, Scan) for each in block.passages)


def camera_unit(block: Block) -> str:
    """Return the unit of images in the frame of their cameras: that of films is mm, whatever readings are."""
    return "mm" if is_scanned(block) else block.image_unit


def camera_images(block: Block) -> Floats:
    """Return (m, 2) images in the frame of their cameras, films as they are given; of others as they are.

    NaN where a film has no place for a reading.
    """
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    found = block.image_xy
    for scan in (each for each in block.passages if isinstance(each, Scan)):
        found = found.copy() if found is block.image_xy else found
        own = block.image_photos == rows[scan.photo]
        vectors = np.array([each.position for each in scan.film.unknowns])
        found[own] = _photocore.film_places(scan.film.numbers(), vectors, block.image_xy[own])
    return found


def _to_marks(block: Block, images: Floats) -> Floats:
    """Return (m, 2) images, those of each photo changed as an affine map changes its marks."""
    read: dict[str, list[Fiducial]] = {}
    for each in block.observations:
        if isinstance(each, Fiducial):
            read.setdefault(each.photo, []).append(each)
    rows = {name: row for row, name in enumerate(block.photo_ids)}
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
            of_photo = block.image_photos == rows[photo]
            images[of_photo] = _with_one(images[of_photo]) @ affine
    return images


def _with_one(xy: Floats) -> Floats:
    return np.column_stack([np.ones(len(xy)), xy])


def as_seen(block: Block) -> Block:
    """Return a block whose images are those of its cameras: without films and marks.

    Films are as they are given, but for an affine change that brings four marks or more of a photo to their
    places. What looks at rays alone takes it: other errors of films are small against what it looks for.
    """
    if not is_scanned(block):
        return block
    pitches = np.ones(len(block.photo_ids))
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    for scan in (each for each in block.passages if isinstance(each, Scan)):
        pitches[rows[scan.photo]] = scan.film.readings.pitch
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
