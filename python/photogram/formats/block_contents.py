"""Contents of a block for writers: poses, control, trajectories."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.network.block import Block
from photogram.network.films import Scan
from photogram.network.observations import Control
from photogram.words import phrase


def posed(block: Block) -> Bools:
    """Return (P,) which photos have a position and an attitude."""
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def correlated_control(block: Block) -> dict[str, Control]:
    """Return control with correlated coordinates by point name."""
    return {each.point: each for each in block.observations.of_type(Control)}


def check_images(block: Block, title: str) -> None:
    """Reject image coordinates of films or line scanners."""
    scanned = [each.photo for each in block.passages if isinstance(each, Scan)]
    if scanned:
        raise InputError(phrase("format.film", title=title, photo=scanned[0]))
    lines = [each.photo for each in block.timed if each.lines is not None]
    if lines:
        raise InputError(phrase("format.scanner", photo=lines[0]))
