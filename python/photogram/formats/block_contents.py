"""Contents of a block for writers: poses, control, trajectories."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.formats.project import Project
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


class KnownPoints(NamedTuple):
    """Control and check points of a project.

    `rows` are the k points of the block; `positions` and `sd` are (k, 3), NaN and infinite if unknown;
    `covariances` are (k, 3, 3), 0 if free; `checks` are (k,) the check points.
    """

    rows: list[int]
    positions: Floats
    sd: Floats
    covariances: Floats
    checks: Bools


def known_points(project: Project) -> KnownPoints:
    """Return control points, also correlated ones, and check points."""
    block, full = project.block, correlated_control(project.block)
    correlated = np.array([name in full for name in block.point_ids], dtype=bool)
    held = np.isfinite(block.point_sd).any(axis=1) | np.isfinite(block.point_positions).any(axis=1)
    rows = np.flatnonzero(correlated | held).tolist()
    checks = np.isin(rows, project.checks)
    positions, sd = block.point_positions[rows].copy(), block.point_sd[rows].copy()
    if block.point_check_sd is not None:
        given = block.point_check_sd[rows]
        sd = np.where(checks[:, np.newaxis] & np.isfinite(given), given, sd)
    covariances = np.where(np.isfinite(sd), sd, 0.0)[:, :, np.newaxis] ** 2 * np.eye(3)
    for k, row in enumerate(rows):
        if (each := full.get(block.point_ids[row])) is not None:
            positions[k], covariances[k], checks[k] = each.observed, each.precision, False
            sd[k] = np.sqrt(np.diag(each.precision))
    return KnownPoints(rows, positions, sd, covariances, checks)


def check_images(block: Block, title: str) -> None:
    """Reject image coordinates of films or line scanners."""
    scanned = [each.photo for each in block.passages if isinstance(each, Scan)]
    if scanned:
        raise InputError(phrase("format.film", title=title, photo=scanned[0]))
    lines = [each.photo for each in block.timed if each.lines is not None]
    if lines:
        raise InputError(phrase("format.scanner", photo=lines[0]))
