"""What writers ask of a block: photos with a pose, control with correlations, what has no place."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.films import Scan
from photogram.network.observations import Control, Position

__all__ = ["check_films", "correlated_control", "lost_observations", "posed"]


def posed(block: Block) -> Bools:
    """Return (P,) which photos have a position and an attitude."""
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def correlated_control(block: Block) -> dict[str, Control]:
    """Return control that is observed with correlations, by the names of its points."""
    return {each.point: each for each in block.observations if isinstance(each, Control)}


def lost_observations(block: Block, gnss: str) -> list[str]:
    """Return what a format with control and GNSS loses, in sentences; `gnss` says what of GNSS itself."""
    found = []
    if correlated_control(block):
        found.append("correlations between coordinates of control")
    others = sum(not isinstance(each, Position | Control) for each in block.observations)
    if others:
        found.append(f"{others} observations beside images, control and GNSS")
    if any(isinstance(each, Position) for each in block.observations):
        found.append(f"{gnss} of GNSS, lever arms, shifts and drifts")
    if block.mounts:
        found.append("rigs: photos have their poses")
    if block.passages:
        found.append("what images pass: boards are flat")
    return found


def check_films(block: Block, title: str) -> None:
    """Refuse to write images that are readings of scanned films: a file would have them for images.

    Raises
    ------
    InputError
        Scanned films, or plates.
    """
    scanned = [each.photo for each in block.passages if isinstance(each, Scan)]
    if scanned:
        raise InputError(
            f"{title}: the images of the photo {scanned[0]} are readings of a scanned film, which are not"
            " written; `photogram adjust` writes refined.csv, images in mm in the frame of the camera"
        )
