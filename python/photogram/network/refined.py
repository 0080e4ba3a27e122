"""Scanned films as their cameras saw them: readings brought back to the frame of the camera."""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.network.block import Block
from photogram.network.films import FilmNumbers, Scan

__all__ = ["as_seen", "camera_images", "camera_unit", "is_scanned"]


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


def as_seen(block: Block) -> Block:
    """Return a block whose images are those of its cameras, films as they are given: without films and marks.

    What looks at rays alone takes it: errors of films are small against what it looks for.
    """
    if not is_scanned(block):
        return block
    pitches = np.ones(len(block.photo_ids))
    rows = {name: row for row, name in enumerate(block.photo_ids)}
    for scan in (each for each in block.passages if isinstance(each, Scan)):
        pitches[rows[scan.photo]] = scan.film.readings.pitch
    return block.replace(
        image_xy=camera_images(block),
        image_sd=block.image_sd * pitches[block.image_photos, np.newaxis],
        passages=[each for each in block.passages if not isinstance(each, Scan)],
        observations=[
            each
            for each in block.observations
            if not any(isinstance(own, FilmNumbers) for own in each.unknowns)
        ],
    )
