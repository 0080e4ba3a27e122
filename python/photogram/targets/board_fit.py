"""What an adjustment found of a board: its plane, how far it is bent, how far its spacing is off."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.targets.calibration_result import Calibrated

__all__ = ["BoardFit", "board_fit"]

STRETCHES = ("scale x", "scale y", "shear")
"""The affine part of the spacing."""


@dataclass(frozen=True, eq=False)
class BoardFit:
    """The adjusted points of a board against their nominal places.

    Attributes
    ----------
    plane
        (3,) a, b, c of z = a + b x + c y, fitted to the adjusted points.
    rms_out_of_plane
        Of z about it, in the unit of the board.
    stretch, sd
        (3,) in ppm, with standard deviations: by how much the spacing along x and along y is longer than it
        should be, and the sine of what the angle between columns and rows lacks of 90 degrees.
    """

    plane: Floats
    rms_out_of_plane: float
    stretch: Floats
    sd: Floats


def board_fit(calibrated: Calibrated) -> BoardFit | None:
    """Return what was found of the board; None where its points were held, or fewer than four were seen.

    The adjusted places are fitted to the nominal ones, (x, y) = t + M (X, Y), all points alike. With columns
    m, n of M the stretches are |m| - 1, |n| - 1 and m'n.
    """
    result, board = calibrated.result, calibrated.calibration.board
    seen = np.flatnonzero(result.used_points)
    if calibrated.calibration.shape != "points" or len(seen) < 4:
        return None
    nominal, found = board.places[seen], result.point_positions[seen]
    design = np.column_stack([np.ones(len(seen)), nominal[:, :2]])
    solve = np.linalg.pinv(design)
    plane = solve @ found[:, 2]
    away = found[:, 2] - design @ plane
    fitted = (solve @ found[:, :2])[1:]  # rows m and n
    lengths = np.linalg.norm(fitted, axis=1)
    stretch = np.array([*(lengths - 1), fitted[0] @ fitted[1]])
    # Partials of |m|, |n| and m'n by m and n, which are linear in the points.
    units = fitted / lengths[:, np.newaxis]
    by_rows = np.zeros((3, 2, 2))
    by_rows[0, 0], by_rows[1, 1] = units
    by_rows[2] = fitted[::-1]
    by_points = np.einsum("rij,in->rnj", by_rows, solve[1:])
    partials = np.concatenate([by_points, np.zeros((3, len(seen), 1))], axis=2).reshape(3, -1)
    covariance = result.covariance(("point", [result.block.point_ids[row] for row in seen.tolist()]))
    sd = np.sqrt(np.einsum("ri,ij,rj->r", partials, covariance, partials))
    return BoardFit(plane, float(np.sqrt(np.mean(away**2))), 1e6 * stretch, 1e6 * sd)
