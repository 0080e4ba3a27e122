"""What the core has refused of a collection, in words."""

from __future__ import annotations

from photogram import _photocore
from photogram.adjustment.remarks import too_coarse
from photogram.errors import AdjustmentError, InputError, OutOfMemoryError, RankError
from photogram.messages import listed

__all__ = ["named"]


def named(
    kind: str,
    message: str,
    combinations: list[_photocore.CombinationRow],
    points: list[int],
    _seconds: list[float],
) -> AdjustmentError | InputError:
    """Put a failure of the core into words; photos and points have no names but their numbers, from 0."""
    if kind == "undetermined points":
        names = [str(point) for point in points]
        return RankError(f"their rays do not determine {len(names)} points: {listed(names)}", [], names)
    if kind == "undetermined photos":
        names = [str(photo) for photo in sorted({photo for each in combinations for photo in each[0]})]
        text = (
            f"the observations leave {len(combinations)} combinations of unknowns undetermined, moving photos"
        )
        return RankError(f"{text} {listed(names)}", names, [])
    if kind == "coarse":
        return too_coarse([str(photo) for photo in combinations[0][0]], [str(point) for point in points])
    if kind == "left out":
        return InputError(f"the point {points[0]} was left out of the adjustment")
    if kind == "memory":
        return OutOfMemoryError(message)
    return AdjustmentError(message)
