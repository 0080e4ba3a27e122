"""Scans that were joined of two parts: readings of one half are shifted against those of the other."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.robust import critical
from photogram.messages import Message
from photogram.results.result import Result

__all__ = ["seam_hints"]

FEWEST = 12
"""Images of a photo."""
EXPLAINED = 0.4
"""Of the sum of squares of a photo's residuals that a shift of one half explains at least."""
BEYOND = 2.0
"""Standard deviations of a reading by which halves are shifted at least."""


def seam_hints(result: Result) -> list[Message]:
    """Name the photo whose residuals have the largest step amid the scan, beside what is affine.

    Marks say little of it: a film of its own takes theirs up. Photos that overlap it show a part of it.
    """
    block, forms, found = result.block, result.film_forms, []
    used = np.isfinite(result.residuals).all(axis=1)
    for row, film in result.films:
        own = np.flatnonzero((block.image_photos == row) & used)
        if len(own) >= FEWEST:
            # Both parts meet where the middle of the photo is read.
            given = block.image_xy[own] - forms[block.photo_ids[row]].matrix[:, 0], result.residuals[own]
            found += [
                (*_step(*given, block.image_sd[own], axis), axis, row, film.readings.pitch) for axis in (0, 1)
            ]
    value, step, axis, row, pitch = max(found, default=(0.0, 0.0, 0, 0, 1.0))
    if not value > critical(4 * len(result.films)):
        return []
    halves, seam = (("left and right", "seam_column"), ("upper and lower", "seam_row"))[axis]
    unit = "mm" if pitch == 1.0 else "px"
    return [
        Message(
            f"the {halves} halves of the scan of {block.photo_ids[row]} are shifted against each other,"
            f" residuals show {step:.2g} {unit}: was the film scanned in two parts that were joined? Then"
            f" {seam} of the table photos, the line where they meet, gives each its own film"
        )
    ]


def _step(away: Floats, residuals: Floats, sd: Floats, axis: int) -> tuple[float, float]:
    """Return the test value of a step amid an axis, and the step: of x or y, the larger; 0 without.

    `away`: (n, 2) readings from the middle of the photo.
    """
    design = np.column_stack([np.ones(len(away)), away / np.abs(away).max(), np.sign(away[:, axis]) / 2])
    best = 0.0, 0.0
    for k in (0, 1):
        own = residuals[:, k] / sd[:, k]
        basis, triangle = np.linalg.qr(design / sd[:, k : k + 1])
        if abs(triangle[3, 3]) < 1e-9 * abs(triangle[0, 0]):
            continue
        gain = float(basis[:, 3] @ own)
        step = abs(gain / triangle[3, 3])
        if step > BEYOND * float(np.median(sd[:, k])) and gain**2 > EXPLAINED * float(own @ own):
            best = max(best, (abs(gain), step))
    return best
