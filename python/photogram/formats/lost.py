"""What of the observations of a block formats with control and GNSS have no place for, in sentences."""

from __future__ import annotations

from photogram.network.block import Block
from photogram.network.observations import Control, Position

__all__ = ["lost_observations"]


def lost_observations(block: Block, gnss: str) -> list[str]:
    """Return what a format with control and GNSS loses; `gnss` says what of GNSS itself."""
    found = []
    if any(isinstance(each, Control) for each in block.observations):
        found.append("correlations between coordinates of control")
    others = sum(not isinstance(each, Position | Control) for each in block.observations)
    if others:
        found.append(f"{others} observations beside images, control and GNSS")
    if any(isinstance(each, Position) for each in block.observations):
        found.append(f"{gnss} of GNSS, lever arms, shifts and drifts")
    if block.mounts:
        found.append("rigs: photos have their poses")
    return found
