"""Check points: differences and joint covariance in east, north, up.

For n check points d_i = adjusted - given; their joint covariance is C = s2 Q + S. Q are the joint cofactors
of the adjusted points, including cross blocks. S is the covariance of the survey, which the variance of unit
weight does not scale. In geographic and geocentric space both are transformed to east, north, up at the given
positions: d_i -> J_i d_i, C_ij -> J_i C_ij J_j'.

Control points are also check points: each is predicted by all other observations. With R_g the cofactors of
the residuals ~v of a control point, both divided by its standard deviations (statistics: 2.3), survey -
predicted = sd R_g^- ~v. Its covariance is sd R_g^- sd s2, including the survey's own variance, and T = ~v'
R_g^- ~v / s2 is chi-square with the rank. These checks are not independent: common errors of all control
remain undetected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import natural_order
from photogram.arguments.objects import require_name
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import unknown_name
from photogram.network.block import Block
from photogram.network.geometry import Spheroid, geocentric_to_geographic, lengths_of_units, local_frames
from photogram.network.observations import Control
from photogram.network.point_sets import hull, outside
from photogram.network.rays import local_axes
from photogram.results.covariance import Covariances
from photogram.results.datum import given_control
from photogram.results.network_tables import point_axes
from photogram.results.result import NOT_PHOTOGRAPHED
from photogram.results.statement.request import METRES, Asked
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

PARTS = {"e": (0,), "n": (1,), "h": (2,), "plan": (0, 1), "all": (0, 1, 2)}
"""Components that are tested jointly."""
LEVEL = 0.05  # Significance level of the tests of check points and control
MOST = 5000  # Check points with a joint covariance; of more points every second, third ... is used
SAME_PLACE = 0.01  # Distance of identical check and control points, metres


@dataclass(frozen=True, eq=False)
class Compared:
    """The n check points of a block, in the linear unit, along east, north, up."""

    names: tuple[str, ...]  # Names of the points
    vegetated: Bools  # (n,) whether in vegetation
    given: Floats  # (n, 3) given coordinates in the axes of the block
    # (n, 3) given and adjusted coordinates as east, north, height
    given_places: Floats
    places: Floats
    differences: Floats  # (n, 3) adjusted minus given; NaN if not given
    # (3 n, 3 n) s2 Q of the adjusted points, and S of the survey; rows of S are zero if not given
    product: Floats
    survey: Floats
    # (n, 3) standard deviations of the survey without its common error, (3,) of the common error
    survey_sd: Floats
    common_sd: Floats
    # s2 and its degrees of freedom: infinite if the unit weight is known
    scale: float
    second: float
    not_usable: tuple[tuple[str, str], ...] = ()  # Unusable points and the codes of the reasons
    # Number of all check points; every `step`th is used, because the joint covariance is dense
    known: int = 0
    step: int = 1

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def covariance(self) -> Floats:
        """(3 n, 3 n) C, the covariance of the differences."""
        return np.asarray(self.product + self.survey)

    @property
    def counted(self) -> Bools:
        """(n, 3) used differences: heights in vegetation are separate."""
        rows = np.isfinite(self.differences)
        rows[self.vegetated, 2] = False
        return rows

    def rows(self, part: str) -> Indices:
        """Return the rows of a part among 3 n: those of points with all its components."""
        components = list(PARTS[part])
        whole = self.counted[:, components].all(axis=1)
        points = np.flatnonzero(whole)
        return np.asarray((3 * points[:, np.newaxis] + components).ravel())

    def of(self, part: str) -> tuple[Floats, Floats]:
        rows = self.rows(part)
        return self.differences.ravel()[rows], self.covariance[np.ix_(rows, rows)]

    def blocks(self, matrix: Floats) -> Floats:
        """Return the (n, 3, 3) blocks of points of a (3 n, 3 n) matrix."""
        n = len(self)
        return np.asarray(matrix.reshape(n, 3, n, 3)[range(n), :, range(n), :])

    def some(self, keep: Bools) -> Compared:
        rows = np.repeat(keep, 3)
        grid = np.ix_(rows, rows)
        return replace(
            self,
            names=tuple(name for name, own in zip(self.names, keep.tolist(), strict=True) if own),
            product=self.product[grid],
            survey=self.survey[grid],
            **{
                each: getattr(self, each)[keep]
                for each in ("vegetated", "given", "given_places", "places", "differences", "survey_sd")
            },
        )

    def without(self, names: Sequence[str]) -> Compared:
        """Return all other points; refuse names that are not check points."""
        for name in names:
            require_name("check point", name, self.names)
        return self.some(~np.isin(np.array(self.names, dtype=object), list(names)))

    def in_vegetation(self) -> Compared:
        """Return the points in vegetation; their heights count here."""
        found = self.some(self.vegetated)
        return replace(found, vegetated=np.zeros(len(found), dtype=bool))


def compared(result: Result, asked: Asked, covariances: Covariances) -> Compared:
    """Return the check points of a result with its covariances.

    It refuses a chosen datum, because coordinates are not comparable. It also refuses points that are
    control, have only one plan axis, or lack standard deviations of their survey.
    """
    block, checks = result.block, result.check_points
    rows = in_order(block, checks.rows)
    step = max(-(-len(rows) // MOST), 1)
    rows = rows[::step]
    names = tuple(block.point_ids[row] for row in rows.tolist())
    if len(rows) and result.datum.is_chosen:
        raise InputError(phrase("request.datum", datum=result.datum.phrase))
    _check_apart(block, rows)
    given = block.point_positions[rows]
    turn = turned_to_east(block, given)
    # Components that J does not use may be missing.
    differences = result.point_differences[rows]
    missing = np.einsum("iab,ib->ia", (turn != 0).astype(float), np.isnan(differences).astype(float)) > 0
    differences = np.where(missing, np.nan, np.einsum("iab,ib->ia", turn, np.nan_to_num(differences)))
    sd = _survey(block, rows, differences, names, asked.sd)
    survey = np.diag(np.nan_to_num(sd).ravel() ** 2)
    if not asked.survey_common_in_control:  # The common error cancels otherwise
        for k, common in enumerate((np.isfinite(sd) * np.array(asked.survey_common_sd)).T):
            survey[k::3, k::3] += np.outer(common, common)
    joint = covariances.covariance(("point", names)) if names else np.zeros((0, 0))
    if block.geographic or block.frame.kind == "geocentric":
        joint = turned_jointly(turn, joint)
    for name in asked.vegetated:
        if name not in block.point_ids:
            raise InputError(unknown_name("check point", name, names))
    unused = (result.point_kinds == "check") & ~result.used_points
    return Compared(
        names=names,
        vegetated=np.array([name in asked.vegetated for name in names], dtype=bool),
        given=given,
        given_places=plan_positions(block, given),
        places=plan_positions(block, result.point_positions[rows]),
        differences=differences,
        product=joint,
        survey=survey,
        survey_sd=sd,
        common_sd=np.array(asked.survey_common_sd),
        scale=result.covariance_scale,
        second=result.freedom_of_scale,
        not_usable=tuple(
            (name, "no-images" if (why := result.dropped.get(name, "left-out")) == NOT_PHOTOGRAPHED else why)
            for name in np.array(block.point_ids, dtype=object)[unused]
        ),
        known=len(checks.rows),
        step=step,
    )


def in_order(block: Block, rows: Indices) -> Indices:
    """Return points in natural order of their names."""
    return np.array(sorted(rows.tolist(), key=lambda row: natural_order(block.point_ids[row])), np.int64)


def turned_to_east(block: Block, positions: Floats) -> Floats:
    """Return (n, 3, 3) J: transformation at (n, 3) positions to east, north, up."""
    if block.spheroid is not None:
        return np.asarray(np.eye(3) * lengths_of_units(_finite(positions), block.spheroid)[:, :, np.newaxis])
    if block.frame.kind == "geocentric":
        a, b = block.frame.ellipsoid
        return local_frames(geocentric_to_geographic(_finite(positions), Spheroid(a, b)))
    return np.broadcast_to(np.eye(3), (len(positions), 3, 3))


def turned_jointly(turn: Floats, joint: Floats) -> Floats:
    """Return J C J' of a (3 n, 3 n) covariance, J from :func:`turned_to_east`."""
    n = len(turn)
    blocks = np.einsum("iab,ibjc,jdc->iajd", turn, joint.reshape(n, 3, n, 3), turn, optimize=True)
    return np.asarray(blocks.reshape(3 * n, 3 * n))


def _finite(positions: Floats) -> Floats:
    """Return positions with the mean of the others for missing ones."""
    middle = np.array(
        [np.median(own[np.isfinite(own)]) if np.isfinite(own).any() else 0.0 for own in positions.T]
    )
    return np.where(np.isfinite(positions), positions, middle)


def plan_positions(block: Block, positions: Floats) -> Floats:
    """Return (n, 3) positions as east, north, height about the station centre."""
    if block.spheroid is not None:
        return local_axes(block).positions(positions)
    if block.frame.kind != "geocentric":
        return positions
    a, b = block.frame.ellipsoid
    middle = np.median(block.photo_positions, axis=0)
    frame = local_frames(geocentric_to_geographic(middle[np.newaxis], Spheroid(a, b)))[0]
    return np.asarray((positions - middle) @ frame.T)


def _survey(
    block: Block, rows: Indices, differences: Floats, names: Sequence[str], asked: tuple[float, ...] | None
) -> Floats:
    """Return (n, 3) survey standard deviations, angles in geographic blocks."""
    own = np.full((len(rows), 3), np.nan)
    if block.point_check_sd is not None:
        units = lengths_of_units(_finite(block.point_positions[rows]), block.spheroid)
        own = block.point_check_sd[rows] * units
    known = np.isfinite(differences)
    halved = known[:, :2].all(axis=1) & (np.isfinite(own[:, 0]) != np.isfinite(own[:, 1]))
    if halved.any():
        name = names[int(np.argmax(halved))]
        raise InputError(phrase("request.single-axis", point=name))
    if asked is not None:
        own = np.where(np.isnan(own), asked, own)
    lacking = (known & np.isnan(own)).any(axis=1)
    if lacking.any():
        without = [name for name, lacks in zip(names, lacking.tolist(), strict=True) if lacks]
        raise InputError(phrase("request.survey", points=without))
    return np.where(known, own, np.nan)


def control_places(block: Block) -> Floats:
    """Return (k, 3) given positions of control points with both plan coordinates."""
    positions, sd = given_control(block)
    places = plan_positions(block, positions[np.isfinite(sd).any(axis=1)])
    return places[np.isfinite(places[:, :2]).all(axis=1)]


def _check_apart(block: Block, rows: Indices) -> None:
    """Refuse check points that are control points with other names."""
    apart = SAME_PLACE / METRES.get(block.linear_unit, 1.0)
    positions, sd = given_control(block)
    control = np.flatnonzero(np.isfinite(sd).any(axis=1))
    held = plan_positions(block, positions[control])
    checks = plan_positions(block, block.point_positions[rows])
    for place, row in zip(checks, rows.tolist(), strict=True):
        near = np.linalg.norm(held - place, axis=1) < apart  # missing coordinates are not near any point
        if near.any():
            same = {"point": block.point_ids[row], "control": block.point_ids[control[near.argmax()]]}
            raise InputError(phrase("request.same-place", **same))


@dataclass(frozen=True)
class System:
    crs: str  # Name; empty for the system of the block
    axes: tuple[tuple[str, str], tuple[str, str], tuple[str, str]]  # Names and units of its three coordinates
    carried: Callable[[Floats], Floats]  # Transforms (n, 3) positions of the block; angles in degrees


@dataclass(frozen=True, eq=False)
class Survey:
    # n names; `control` or `check`
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    # (n, 3) in the system; standard deviations along the axes of the block
    positions: Floats
    sd: Floats
    checks: Floats  # (k, 3) positions of the check points of the statement in the system
    system: System


def surveyed(result: Result, found: Compared, system: System | None) -> Survey:
    """Return control and check points in a system or in the block's axes."""
    block = result.block
    if system is None:  # The axes of the block, longitudes and latitudes in degrees
        axes = point_axes(block)
        factors = np.array([np.degrees(1.0) if axis.angle else 1.0 for axis in axes])
        x, y, z = ((axis.name, "deg" if axis.angle else axis.unit) for axis in axes)
        system = System("", (x, y, z), lambda positions: positions * factors)
    kinds, (positions, sd) = result.point_kinds, given_control(block)
    places = {name: row for row, name in enumerate(block.point_ids)}
    sd[[places[name] for name in found.names]] = found.survey_sd
    rows = in_order(block, np.flatnonzero(kinds != "pass"))
    return Survey(
        names=tuple(block.point_ids[row] for row in rows.tolist()),
        kinds=tuple(str(kinds[row]) for row in rows.tolist()),
        positions=_carried(system, positions[rows]),
        sd=np.where(np.isfinite(sd[rows]), sd[rows], np.nan),
        checks=_carried(system, found.given),
        system=system,
    )


def _carried(system: System, positions: Floats) -> Floats:
    """Return positions in a system; only block axes allow missing coordinates."""
    if not system.crs:
        return system.carried(positions)
    found = np.full(positions.shape, np.nan)
    whole = np.isfinite(positions).all(axis=1)
    if whole.any():
        found[whole] = system.carried(positions[whole])
    return found


PREDICTABLE = 0.01  # Least eigenvalue of R_g of a predictable direction


@dataclass(frozen=True, eq=False)
class LeftOut:
    point: str  # Its name
    # (3,) predicted minus survey, east, north, up; linear unit; NaN if free or hardly predictable
    difference: Floats
    sd: Floats  # (3,) its standard deviations
    covariance: Floats  # (3, 3); zero if missing
    # Test, number of predictable directions, upper probability
    T: float
    rank: int
    p: float
    # Redundancy numbers of the k weighted components; eigenvalues of R_g, ascending
    redundancy: Floats
    eigenvalues: Floats


def leave_one_out(result: Result) -> list[LeftOut]:
    """Return used control points predicted by the others, in order of names."""
    block, found = result.block, []
    observed = {each.point: each for each in block.observations.of_type(Control)}
    control = np.flatnonzero(result.used_points & (result.point_kinds == "control"))
    residuals = result.point_residuals
    for row in in_order(block, control).tolist():
        name, axes = block.point_ids[row], turned_to_east(block, result.point_positions[row : row + 1])[0]
        if (own := observed.get(name)) is not None:
            held, v = np.arange(3), np.asarray(own.position, dtype=float) - result.point_positions[row]
            root = np.asarray(np.linalg.cholesky(own.precision), dtype=np.float64)
        else:
            held = np.flatnonzero(np.isfinite(block.point_sd[row]) & (block.point_sd[row] > 0))
            v, root = residuals[row, held], np.diag(block.point_sd[row, held])
            if len(held) < 3:  # Weighted along the axes of the block, which is not geocentric
                axes = np.diag(np.diag(axes)[held])
        if len(held):
            # In geographic blocks, observed covariances are along east, north, up already.
            factor = root if own is not None and block.geographic else axes @ root
            q = axes @ result.point_cofactors[row][np.ix_(held, held)] @ axes.T
            found.append(_predicted(name, held, axes @ v, factor, q, result))
    return found


def limit_of(found: Sequence[LeftOut]) -> float:
    """Return the probability limit for disagreeing control (Bonferroni)."""
    return LEVEL / max(len(found), 1)


def _predicted(name: str, held: np.ndarray, v: Floats, factor: Floats, q: Floats, result: Result) -> LeftOut:
    """Return a point from residuals v, a root F of their covariance, cofactors q."""
    inverse = np.linalg.inv(factor)
    residual, redundancy = inverse @ v, np.eye(len(v)) - inverse @ q @ inverse.T
    values, vectors = np.linalg.eigh((redundancy + redundancy.T) / 2)
    shown = values > PREDICTABLE
    pseudo = (vectors[:, shown] / values[shown]) @ vectors[:, shown].T
    statistic = float(residual @ pseudo @ residual) / result.covariance_scale
    rank = int(shown.sum())
    # Components that are mostly along directions that the rest does not predict.
    blind = (vectors[:, ~shown] ** 2).sum(axis=1) > 0.5
    difference, sd, covariance = np.full(3, np.nan), np.full(3, np.nan), np.zeros((3, 3))
    own = factor @ pseudo @ factor.T * result.covariance_scale
    difference[held] = np.where(blind, np.nan, -(factor @ pseudo @ residual))
    sd[held] = np.where(blind, np.nan, np.sqrt(np.diag(own)))
    covariance[np.ix_(held, held)] = own
    p = _photocore.chi_square(statistic, rank, upper=True) if rank else float("nan")
    return LeftOut(name, difference, sd, covariance, statistic, rank, p, np.diag(redundancy), values)


SHARE_ASKED, SPACING_ASKED = 0.2, 0.1
FAR = 1 / 3  # Distance from check points relative to the diagonal
CELLS = 200  # Grid for the area far from check points, along each side


@dataclass(frozen=True)
class Layout:
    """Distribution of n check points in a block."""

    count: int  # n
    diagonal: float  # Diagonal of the block's bounding box in plan, linear unit
    # Shares of the points: x and y low, x high and y low, x low and y high, both high. Points on a middle
    # line count as low.
    share_in_quadrants: tuple[float, float, float, float]
    least_spacing_over_diagonal: float  # Spacing of two points relative to the diagonal; NaN for one point
    # Share of the block's area that is farther from all points than a third of the diagonal; NaN if the block
    # is a line
    share_of_area_far: float
    # Range of the heights of the points over that of the block; NaN if the block is level
    share_of_heights: float
    outside_control: int  # The number of points outside the hull of the control points in plan

    @property
    def even(self) -> bool:
        """Whether each quadrant has the required share of points."""
        return min(self.share_in_quadrants) >= SHARE_ASKED

    @property
    def apart(self) -> bool:
        """Whether all points have the required spacing."""
        return not self.least_spacing_over_diagonal < SPACING_ASKED


def layout(points: Floats, extent: Floats, control: Floats) -> Layout | None:
    """Return the distribution of check points; None for equal plan positions.

    `points` are (n, 3) east, north, height of the check points, n at least 1, NaN for unknown heights;
    `extent` (m, 3) are the positions of the block, which define its box and hull; `control` (k, 3).
    """
    own, block = points[:, :2], extent[:, :2]
    low, high = block.min(axis=0), block.max(axis=0)
    diagonal = math.hypot(*(high - low))
    if not diagonal > 0:
        return None
    above = own > (low + high) / 2
    heights, known = (each[np.isfinite(each)] for each in (extent[:, 2], points[:, 2]))
    span = np.ptp(heights) if heights.size else 0.0
    quadrants = np.bincount(above[:, 0] + 2 * above[:, 1], minlength=4) / len(own)
    middles = (np.arange(CELLS) + 0.5) / CELLS
    grid = low + (high - low) * np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    inside = grid[~outside(grid, hull(block))]
    far = _photocore.nearest_points(inside, own, FAR * diagonal) < 0
    spacing, reach = math.nan, 1.001 * float(np.linalg.norm(np.ptp(own, axis=0)))
    if len(own) > 1:
        neighbours = _photocore.nearest_points(own, own, reach, np.arange(len(own))) if reach > 0 else 0
        spacing = float(np.hypot(*(own - own[neighbours]).T).min())
    return Layout(
        len(own),
        diagonal,
        (float(quadrants[0]), float(quadrants[1]), float(quadrants[2]), float(quadrants[3])),
        spacing / diagonal,
        float(np.mean(far)) if len(inside) else math.nan,
        float(np.ptp(known) / span) if known.size and span > 0 else math.nan,
        int(outside(own, hull(control[:, :2])).sum()) if len(control) else len(own),
    )
