"""Tables of a calibration for text, page, JSON and CSV.

For splined lenses, they include knots determined by priors, and pixels beyond the knots.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.knots import Knot, beyond_knots
from photogram.network.observations.unknowns import Prior
from photogram.show.page import Fact, Tone, fixed, significant
from photogram.show.quantity import Axis, Quantity, column
from photogram.targets.lens_fit import field_of, grid_of_pixels
from photogram.targets.vision import TURNED

if TYPE_CHECKING:
    from photogram.targets import Calibrated

NOTABLE_STRETCH = 3.0  # standard deviations of the spacing of a board


def board_facts(calibrated: Calibrated) -> list[Fact]:
    """Return facts on the board."""
    calibration = calibrated.calibration
    board, unit = calibration.board, calibration.board.unit
    found = [
        Fact("Board", board.described),
        Fact("Shape", _SHAPES[calibration.shape]),
        Fact(
            "Scale", "from the spacing", note="nothing checks it: its relative error is that of every length"
        ),
    ]
    where = "cx, cy and pixels count from 0 at the centre of the first; COLMAP has 0.5 more"
    found.append(Fact("Pixels", "centre is 0", note=where))
    if (bend := calibrated.bend) is not None:
        for name, value, sd in zip(_BENDS, bend.position.tolist(), bend.sd.tolist(), strict=False):
            found.append(Fact.of(name, value, unit, f"sd {significant(sd, 2)} {unit}", figures=4))
    fit = board_fit(calibrated)
    if fit is None:
        return found
    found.append(Fact.of("Out of its plane, rms", fit.rms_out_of_plane, unit, figures=3))
    for name, value, sd in zip(STRETCHES, fit.stretch.tolist(), fit.sd.tolist(), strict=True):
        tone: Tone = "look" if abs(value) > NOTABLE_STRETCH * sd else ""
        found.append(Fact.of(f"Spacing, {name}", value, "ppm", f"sd {fixed(sd, 0)} ppm", tone, decimals=0))
    return found


_BENDS = ("Deflection along x (bend_x)", "Deflection along y (bend_y)")
_SHAPES = {
    "held": "held: every point is taken for where it should be",
    "bend": "two parabolas, whose deflections in the middle are unknowns",
    "points": "every point is an unknown, observed with its nominal place",
}


STRETCHES = ("scale x", "scale y", "shear")


@dataclass(frozen=True, eq=False)
class BoardFit:
    """Adjusted points of a board relative to their nominal coordinates."""

    plane: Floats  # (3,) a, b, c of z = a + b x + c y, fitted to the adjusted points
    rms_out_of_plane: float  # Root mean square of z about the plane, in the unit of the board
    # (3,) in ppm, with standard deviations: relative excess of the spacing along x and y. The third is the
    # sine of the angle deficit of columns and rows to 90 degrees
    stretch: Floats
    sd: Floats


def board_fit(calibrated: Calibrated) -> BoardFit | None:
    """Return the fit of a board with at least four estimated points, or None.

    The adjusted coordinates are fitted to the nominal ones, (x, y) = t + M (X, Y), with equal weights. With
    columns m, n of M the stretches are |m| - 1, |n| - 1 and m'n.
    """
    result, board = calibrated, calibrated.calibration.board
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


def prior_shift(calibrated: Calibrated) -> list[Quantity]:
    """Return parameter changes by priors, absolute and relative to the sd."""
    before = calibrated.unregularised
    rows = [
        (own, k, float(own.values[k] - free.values[k]))
        for own, free in zip(calibrated.cameras, () if before is None else before.cameras, strict=False)
        for k in own.estimated
    ]
    names = [f"{own.name} {own.names[k]}" for own, k, _ in rows]
    axes = tuple(Axis.of(own.names[k], own.camera.unit_of(own.names[k])) for own, k, _ in rows)
    changes = np.array([change for _, _, change in rows])
    of_sd = changes / np.array([own.sd[k] for own, k, _ in rows])
    return [
        column("parameter", np.array(names, dtype=object), "Parameter", kind="name"),
        Quantity(changes, axes, "value", None, "change", head="Moved", of=np.arange(len(rows))),
        Quantity(of_sd, member="over_sd", head="Over its sd"),
    ]


MIN_PRIOR_REDUNDANCY = 0.05  # a knot with less redundancy is determined by its prior


def splines(calibrated: Calibrated) -> list[Quantity]:
    """Return statistics of the knots of each splined lens.

    `from_prior` are the unknown knots whose values are determined by their priors, `untouched` those without
    an image. `beyond` is the fraction of the image beyond the knots, NaN for an unknown image size;
    `fov_x_deg` the field with all pixels within the knots, NaN if this already holds.
    """
    rows = []
    for number, each in enumerate(calibrated.cameras):
        if each.camera.knots is not None:
            knots = len(each.given.knot_unknowns)
            untouched = knots - _touched(calibrated, number) if knots else 0
            rows.append(
                (each.name, knots, _from_prior(calibrated, number), untouched, *_beyond(calibrated, number))
            )
    return [
        column(name, [row[k] for row in rows], head, kind="name" if name == "camera" else "number")
        for k, (name, head) in enumerate(_SPLINES.items())
    ]


_SPLINES = {
    "camera": "Camera",
    "knots": "Estimated knots",
    "from_prior": "From priors",
    "untouched": "Without images",
    "beyond": "Image beyond the knots",
    "fov_x_deg": "Sufficient fov_x_deg",
}


def _from_prior(calibrated: Calibrated, number: int) -> int:
    of_knots = {id(each) for each in calibrated.cameras[number].given.knot_unknowns}
    hang = 0
    block = calibrated.block
    for kind in calibrated.kinds.values():
        for row, own in zip(kind.rows.tolist(), kind.redundancy, strict=True):
            observation = block.observations[row]
            if not (isinstance(observation, Prior) and isinstance(observation.unknown, Knot)):
                continue
            if id(observation.unknown) in of_knots:
                hang += bool(np.nansum(own) / 2 < MIN_PRIOR_REDUNDANCY)
    return hang


def _touched(calibrated: Calibrated, number: int) -> int:
    camera = calibrated.cameras[number].camera
    corners = calibrated.calibration.corners
    poses = calibrated.picture_poses[corners.picture]
    own = corners.use & (corners.cameras[corners.picture] == number)
    points = calibrated.points[corners.point[own]]
    seen = np.einsum("nij,nj->ni", poses[own, :3, :3], points) + poses[own, :3, 3]
    patches, _ = _photocore.camera_patches(camera.model, camera.values, seen * TURNED)
    return len(np.unique(patches))


def _beyond(calibrated: Calibrated, number: int) -> tuple[float, float]:
    """Return the image fraction beyond the knots, and a sufficient field."""
    size = calibrated.calibration.corners.sizes[number]
    if size is None:
        return math.nan, math.nan
    camera = calibrated.cameras[number].camera
    rays = camera.rays(grid_of_pixels(size))
    share = float(beyond_knots(camera.parameters, rays).mean())
    if not share:
        return share, math.nan
    count = (int(camera.parameters["nx"]), int(camera.parameters["ny"]))
    return share, math.ceil(field_of(rays, count, camera.parameters["order"]))
