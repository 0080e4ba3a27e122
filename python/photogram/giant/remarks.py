"""Remarks on a block that the guide has no message for, but a user wants to read."""

from __future__ import annotations

import numpy as np

from photogram.giant.frames import Frame
from photogram.giant.records import message_at
from photogram.messages import Message, listed
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.ties import FEWEST_TIES, ties

__all__ = ["plain_name", "remarks"]

EARTH_RADIUS = 6.371e6
"""Metres."""
FALSE_ORIGIN = 1e5
"""Map projections count from an origin farther off than this; local systems seldom do."""
UPRIGHT = 0.97
"""Vertical component of the axis of a near-vertical photo, at least."""


def remarks(block: Block, frames: list[Frame]) -> list[Message]:
    """Return remarks on stations without enough rays, names that are alike, and coordinates of a map.

    Parameters
    ----------
    block
        The block.
    frames
        The frames of its photos.
    """
    messages = []
    for frame, count in zip(frames, ties(block).tolist(), strict=True):
        loose = not (all(frame.position_sd) and all(frame.attitude_sd))
        if count < FEWEST_TIES and loose:
            text = (
                f"the frame {frame.name} has {count} points that other frames or control tie: its station"
                " rests on its weights, which are the weak defaults"
            )
            messages.append(message_at(frame.record, text))
    return messages + _alike(block) + _map_projection(block)


def plain_name(name: str) -> str:
    """Return a name without blanks and case."""
    return "".join(name.split()).casefold()


def _alike(block: Block) -> list[Message]:
    """Name the photos and points whose names differ by case or blanks inside only.

    The program compared names exactly (2A4), so they are different ones; few users mean that.
    """
    messages = []
    for what, names in (("photos", block.photo_ids), ("points", block.point_ids)):
        plain = [*map(plain_name, names)]
        if len(set(plain)) == len(names):
            continue
        groups: dict[str, list[str]] = {}
        for alike, name in zip(plain, names, strict=True):
            groups.setdefault(alike, []).append(name)
        pairs = [" and ".join(map(repr, group)) for group in groups.values() if len(group) > 1]
        if pairs:
            messages.append(
                Message(
                    f"{what} whose names differ by case or blanks only are different {what}: {listed(pairs)}"
                )
            )
    return messages


def _map_projection(block: Block) -> list[Message]:
    """Tell State Plane or UTM coordinates by their size; the earth is curved, a map is not.

    A level surface drops by d^2/2R at the distance d. Seen from the height H that moves the image of a point,
    at the radius r, by H r^3 / 2 R c^2.
    """
    if block.geographic:
        return []
    east, north, height = np.median(np.abs(block.photo_positions), axis=0).tolist()
    vertical = np.abs(geometry.rotation_matrix(block.photo_attitudes)[:, 2, 2])
    if max(east, north) < max(FALSE_ORIGIN, 20 * height) or np.median(vertical) < UPRIGHT:
        return []
    known = block.point_positions[:, 2]
    ground = float(np.median(known[np.isfinite(known)])) if np.isfinite(known).any() else 0.0
    distances = block.known_distances("GIANT files")[block.image_photos]
    radii = np.hypot(block.image_xy[:, 0], block.image_xy[:, 1])
    shifts = abs(height - ground) * radii**3 / (2 * EARTH_RADIUS * distances**2)
    shift = float(np.quantile(shifts, 0.95))
    if shift < np.median(block.image_sd):
        return []
    return [
        Message(
            "the coordinates look like those of a map projection (State Plane, UTM): the earth's curvature"
            f" is not modelled, which moves images by up to {1000 * shift:.0f} um (heights in metres);"
            " geographic coordinates (COMMON column 1) or a local tangent system have no such error"
        )
    ]
