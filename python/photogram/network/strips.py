"""Strips of photos, detected from their positions."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats, Indices


def strips_of(positions: Floats) -> list[Indices]:
    """Divide photos at (P, 3) in metric axes, in order, into strips at curves and gaps."""
    steps = np.linalg.norm(np.diff(positions[:, :2], axis=0), axis=1)
    usual = float(np.median(steps)) if steps.size else 0.0
    plan = [complex(x, y) for x, y in positions[:, :2].tolist()]

    def follows(before: int, start: int, next_: int, gaps: int) -> bool:
        step = plan[next_] - plan[before]
        if abs(step) > 2.5 * gaps * usual:
            return False
        course = plan[before] - plan[start]
        # Within 45 degrees of the course so far.
        along = (step * course.conjugate()).real
        return before == start or along > math.sqrt(0.5) * abs(step) * abs(course)

    strips: list[list[int]] = []
    last = 0
    for photo in range(len(plan)):
        if strips and follows(last, strips[-1][0], photo, photo - last):
            strips[-1].append(photo)
            last = photo
        # A single deviating photo does not end a strip if the next one is on course.
        elif (
            strips
            and len(strips[-1]) > 1
            and last == photo - 1
            and photo + 1 < len(plan)
            and follows(last, strips[-1][0], photo + 1, 2)
        ):
            strips[-1].append(photo)
        else:
            strips.append([photo])
            last = photo
    return [np.array(strip, dtype=np.int64) for strip in strips]
