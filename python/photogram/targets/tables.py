"""Tables of a calibration for text, page, JSON and CSV.

For splined lenses, they include knots determined by priors, and pixels beyond the knots.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.knots import Knot, beyond_knots
from photogram.network.observations.unknowns import Prior
from photogram.show.page import Fact, Tone, fixed, significant
from photogram.show.quantity import Axis, Quantity
from photogram.targets.lens_fit import field_of, grid_of_pixels
from photogram.targets.vision import TURNED
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

MAX_POINTS_LISTED = 10
NOTABLE_STRETCH = 3.0  # standard deviations of the spacing of a board
_PIXELS = (Axis.of("px", "px"),)


def views(calibrated: Calibrated) -> list[Quantity]:
    """Return the views with images, corners, rms, redundancy, chi2, largest residual."""
    corners, result = calibrated.calibration.corners, calibrated.result
    count, of_picture = corners.view_count, corners.views
    use = corners.use
    view = of_picture[corners.picture[use]]
    weighted = (result.residuals / result.image_given_sd) ** 2
    used = np.bincount(view, minlength=count)
    rms = view_rms(view, result.residuals, count)
    largest = np.zeros(count)
    np.maximum.at(largest, view, np.nan_to_num(np.abs(result.standardized)).max(axis=1, initial=0.0))
    left_out = np.bincount(of_picture[corners.picture[~use]], minlength=count)
    marked = np.bincount(view[outlying_images(calibrated)], minlength=count) > 0
    names = np.array(corners.view_names(), dtype=object)
    return [
        Quantity(names, (), "name", "view", "name", "first picture of the view", head="View"),
        _of_views("pictures", np.bincount(of_picture, minlength=count), "Pictures"),
        _of_views("corners", used, "Corners"),
        _of_views("left_out", left_out, "Left out"),
        _of_views("rms_px", rms, "rms", axes=_PIXELS, kind="value"),
        _of_views("redundancy", _sums(view, result.redundancy, count), "Redundancy"),
        _of_views("chi2", _sums(view, weighted, count), "chi²", figures=4),
        _of_views("largest_standardized", largest, "Largest standardized", marked=marked),
    ]


def outlying_images(calibrated: Calibrated) -> Bools:
    """Return (m,) the images that are outliers of the verdict."""
    codes = {"test.images", "test.image_coordinates"}
    return _outlying(calibrated, codes, len(calibrated.result.residuals))


def _outlying(calibrated: Calibrated, codes: Collection[str], count: int) -> Bools:
    outliers = np.zeros(count, dtype=bool)
    for kind, places in calibrated.verdict.outlying.items():
        if isinstance(kind, Phrase) and kind.code in codes:
            outliers[[place[0] for place in places]] = True
    return outliers


def _of_views(name: str, values: Floats | Indices, head: str, **how: Any) -> Quantity:
    return Quantity(values, name=name, member=name, head=head, **how)


def view_rms(view: Indices, residuals: Floats, count: int) -> Floats:
    """Return the root mean squares of (m, 2) residuals of each view or image."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt(_sums(view, residuals**2, count) / (2 * np.bincount(view, minlength=count)))


def _sums(view: Indices, values: Floats, count: int) -> Floats:
    return np.asarray(np.bincount(view, weights=values.sum(axis=1), minlength=count).astype(float))


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


def worst_points(calibrated: Calibrated) -> list[str]:
    """Return the board points that are outliers of the verdict, largest first."""
    result = calibrated.result
    if calibrated.calibration.shape != "points":
        return []
    tests = np.nan_to_num(np.abs(result.point_standardized)).max(axis=1)
    codes = {"test.control", "test.components_of_control"}
    rows = np.flatnonzero(_outlying(calibrated, codes, len(tests)))
    unit, lines = calibrated.calibration.board.unit, []
    for row in rows[np.argsort(-tests[rows], kind="stable")][:MAX_POINTS_LISTED].tolist():
        x, y, z = result.point_differences[row].tolist()
        fields = {"x": x, "y": y, "z": z, "unit": unit, "test": float(tests[row])}
        lines.append(str(phrase("board.point", point=result.block.point_ids[row], **fields)))
    return lines


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


def prior_shift(calibrated: Calibrated) -> list[Quantity]:
    """Return parameter changes by priors, absolute and relative to the sd."""
    before = calibrated.unregularised
    if before is None:
        return []
    names, changes, axes = list[str](), list[float](), list[Axis]()
    of_sd = list[float]()
    for own, free in zip(calibrated.cameras, before.cameras, strict=True):
        for k in own.estimated:
            names.append(f"{own.name} {own.names[k]}")
            axes.append(Axis.of(own.names[k], own.camera.unit_of(own.names[k])))
            changes.append(float(own.values[k] - free.values[k]))
            of_sd.append(changes[-1] / float(own.sd[k]))
    return [
        Quantity(np.array(names, dtype=object), (), "name", "parameter", "parameter", head="Parameter"),
        Quantity(
            np.array(changes), tuple(axes), "value", None, "change", head="Moved", of=np.arange(len(names))
        ),
        Quantity(np.array(of_sd), (), "number", None, "over_sd", head="Over its sd"),
    ]


MIN_PRIOR_REDUNDANCY = 0.05  # a knot with less redundancy is determined by its prior


@dataclass(frozen=True)
class Spline:
    """Statistics of the knots of a splined lens."""

    camera: str
    knots: int  # number of unknown knots
    from_prior: int  # number of unknown knots whose values are determined by their priors
    untouched: int  # number of unknown knots without an image
    beyond: float | None  # fraction of the image beyond the knots; None if the image size is unknown
    fov_x_deg: int | None  # the field with all pixels within the knots; None if this already holds

    @property
    def lines(self) -> list[str]:
        """The statistics as sentences."""
        found = [
            f"{self.camera}: {self.from_prior} of {self.knots} knots are from their prior (redundancy below"
            f" {MIN_PRIOR_REDUNDANCY:g}); {self.untouched} of them no image touches"
            if self.knots
            else f"{self.camera}: its knots are held"
        ]
        if self.fov_x_deg is not None:
            found.append(
                f"{self.camera}: {self.beyond:.1%} of the picture is beyond its knots, where nothing is said"
                f" of its uncertainty; fov_x_deg = {self.fov_x_deg} would do"
            )
        elif self.beyond is not None:
            found.append(f"{self.camera}: the whole picture is within its knots")
        return found


def splines(calibrated: Calibrated) -> list[Spline]:
    """Return the knot statistics of each splined lens."""
    found = []
    for number, each in enumerate(calibrated.cameras):
        if each.camera.knots is None:
            continue
        knots = len(each.given.knot_unknowns)
        untouched = knots - _touched(calibrated, number) if knots else 0
        hang = _from_prior(calibrated, number)
        found.append(Spline(each.name, knots, hang, untouched, *_beyond(calibrated, number)))
    return found


def spline_lines(calibrated: Calibrated) -> list[str]:
    """Return sentences on the knots of each splined lens."""
    return [line for each in splines(calibrated) for line in each.lines]


def _from_prior(calibrated: Calibrated, number: int) -> int:
    of_knots = {id(each) for each in calibrated.cameras[number].given.knot_unknowns}
    hang = 0
    block = calibrated.result.block
    for kind in calibrated.result.kinds.values():
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


def _beyond(calibrated: Calibrated, number: int) -> tuple[float | None, int | None]:
    """Return the image fraction beyond the knots, and a sufficient field."""
    size = calibrated.calibration.corners.sizes[number]
    if size is None:
        return None, None
    camera = calibrated.cameras[number].camera
    rays = camera.rays(grid_of_pixels(size))
    share = float(beyond_knots(camera.parameters, rays).mean())
    if not share:
        return share, None
    count = (int(camera.parameters["nx"]), int(camera.parameters["ny"]))
    return share, math.ceil(field_of(rays, count, camera.parameters["order"]))
