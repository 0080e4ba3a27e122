"""Effect of a map projection on a block that is adjusted in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.refraction import METRES_PER_UNIT
from photogram.words import Phrase, phrase

RADIUS = 6_371_000.0  # Radius of the earth, metres
LIKE_A_PLANE = 1e5  # Metres: if both coordinates are larger, they are map coordinates, not local ones
STEP = 100.0  # Metres, for the computation of scales


def bend(xyz: Floats, crs: str = "") -> Phrase:
    """Return the effect of a map projection on (n, 3) positions, metres.

    `extent` is the distance from the centre of the block to its edge, `curvature` the height of the plane
    above a level surface at the edge, d^2 / 2R. If the projection is known, `least` and `largest` are the
    relative excess (ppm) of horizontal lengths in the plane over lengths in space; heights have scale 1.
    """
    middle = (xyz.min(axis=0) + xyz.max(axis=0)) / 2
    extent = float(np.hypot(*(xyz - middle)[:, :2].T).max())
    sizes = {"curvature": extent**2 / (2 * RADIUS), "extent": extent}
    if not crs:
        return phrase("planes.heights", **sizes)
    from photogram.formats.crs import geocentric

    corners = np.array([middle, *xyz[xyz[:, :2].argmin(axis=0)], *xyz[xyz[:, :2].argmax(axis=0)]])
    east = np.array([STEP / 2, 0.0, 0.0])
    steps = geocentric(crs, corners + east) - geocentric(crs, corners - east)
    found = 1e6 * (STEP / np.linalg.norm(steps, axis=1) - 1)
    return phrase("planes.scales", **sizes, least=float(found.min()), largest=float(found.max()))


def plane_remarks(block: Block, path: Path, starts: Floats | None = None) -> list[Message]:
    """Return remarks on the effect if a block seems to be in a map projection.

    `starts`: (n, 3) approximate positions of its points; NaN if unknown.
    """
    frame = block.frame
    if frame.kind != "cartesian" or block.geographic:
        return []
    known = np.vstack([block.photo_positions, block.point_positions, *([] if starts is None else [starts])])
    known = known[np.isfinite(known).all(axis=1)] * METRES_PER_UNIT.get(block.linear_unit, 1.0)
    if len(known) < 2:
        return []
    if frame.crs:
        from photogram.formats.crs import is_projected

        if not is_projected(frame.crs):
            return []
        return [Message(phrase("planes.projected", crs=frame.crs, bend=bend(known, frame.crs)), path)]
    like_a_map = (np.abs(np.median(known[:, :2], axis=0)) > LIKE_A_PLANE).all()
    if not like_a_map or np.abs(known[:, 2]).max() > LIKE_A_PLANE:
        return []
    return [Message(phrase("planes.map", bend=bend(known)), path)]
