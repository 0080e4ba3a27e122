"""Adjusted trajectories: poses at any time, covariances, images, restarts, updates of tables.

Corrections r(t) are additive but rotations are not, so that bases suit small corrections only. Corrections of
images and records may exceed half a radian. The rotation in the middle is then applied to the table, A0
Exp(r), exactly at all times. The corrections r then restart at zero (docs/moving.md).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import freeze_fields, shaped, standard_deviations
from photogram.arguments.objects import require_name
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.geometry import geographic_to_geocentric
from photogram.network.motion import timed_images
from photogram.network.moving_photos import Timed
from photogram.network.observations import Observation, Prior, Smoothness
from photogram.network.passages import Knot
from photogram.network.projecting import camera_of, projected
from photogram.network.trajectories import Basis, Coefficient, Polynomial, RotationCoefficient, Trajectory
from photogram.results.parts import AdjustedUnknown
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.show.quantity import Table

Joint = Callable[[list[str]], Floats]  # Joint covariances of common unknowns by name


@dataclass(frozen=True, eq=False)
class TrajectoryPoses:
    """Poses of a trajectory at n times. Arrays are read-only."""

    times: Floats  # (n,) seconds
    # (n, 3) projection centres in the object space (X, Y, Z; geocentric if it is
    # geographic), and (n, 3, 3) matrices whose columns are the axes of the photo there
    positions: Floats
    attitudes: Floats
    # (n, 6, 6) of the step of a pose: its position in the same axes, then the rotation rho about the photo's
    # own axes, A Exp(rho), in radians
    covariances: Floats

    def __post_init__(self) -> None:
        freeze_fields(self)

    @property
    def sd(self) -> Floats:
        """(n, 6) standard deviations of the poses."""
        return standard_deviations(self.covariances)


@dataclass(frozen=True, eq=False)
class AdjustedTrajectory:
    """A trajectory after the adjustment. Arrays are read-only."""

    given: Trajectory
    # (K, 3) adjusted coefficients c_k in the linear unit, and r_k in radians
    position: Floats
    rotation: Floats
    position_sd: Floats  # (K, 3) standard deviations; 0 if fixed
    rotation_sd: Floats
    # (K, 3) redundancy numbers of the given values; 0 unless weighted
    position_redundancy: Floats
    rotation_redundancy: Floats
    joint: Joint  # Returns the joint covariance of common unknowns by name

    def __post_init__(self) -> None:
        freeze_fields(self)

    @property
    def name(self) -> str:
        return self.given.name

    def restarted(self, observed: Collection[int] = (), turn: Floats | None = None) -> Trajectory:
        """Return the given trajectory with adjusted values of free coefficients.

        Parameters
        ----------
        observed
            Identifiers of coefficients whose given values are also observations.
        turn
            (3,) rotation vector about the axes of the photo that is added to the table; corrections of
            rotations are then zero.
        """
        changes: dict[str, Any] = {}
        rotation = self.rotation
        if turn is not None:
            table, rotation = self.given.table, np.zeros_like(self.rotation)
            turned = table.attitudes @ Attitudes.of("rotation_vector", turn[np.newaxis]).matrices[0]
            changes["table"] = replace(table, attitudes=turned)
        for name, values, own in zip(
            ("position", "rotation"), (self.position, rotation), self.given.coefficients, strict=True
        ):
            free = np.array([np.isinf(each.deviations) & (id(each) not in observed) for each in own])
            if free.any():
                given = np.array([each.position for each in own])
                basis = getattr(self.given, name)
                changes[name] = replace(basis, value=np.where(free, values, given))
        return replace(self.given, **changes) if changes else self.given

    def poses(self, times: ArrayLike) -> TrajectoryPoses:
        """Return poses at (n,) times in seconds: Q_pose = T Q T' (docs/moving.md).

        Raises
        ------
        InputError
            If times are not finite, or outside the range of the table and the knots.
        AdjustmentError, OutOfMemoryError
            As in :meth:`photogram.Result.covariance`.
        """
        times = self._inside(times)
        positions, attitudes, axes, jacobians, of_position, of_rotation = self.given.flown(
            times, self.position, self.rotation
        )
        covariances = np.empty((len(times), 6, 6))
        shapes = axes.reshape(-1, 3, 3), jacobians.reshape(-1, 3, 3)
        for row, parts in enumerate(zip(of_position, of_rotation, strict=True)):
            names, partials = list[str](), [np.zeros((6, 0))]
            for part, ((first, values), own) in enumerate(zip(parts, shapes, strict=True)):
                by = np.zeros((6, 3, len(values)))
                by[3 * part : 3 * part + 3] = own[row][:, :, np.newaxis] * values
                names += [each.name for each in self.given.coefficients[part][first : first + len(values)]]
                partials.append(by.transpose(0, 2, 1).reshape(6, -1))
            t = np.hstack(partials)
            covariances[row] = t @ self.joint(names) @ t.T if names else 0.0
        return TrajectoryPoses(times, positions, attitudes.reshape(-1, 3, 3), covariances)

    def corrections(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Return (n, 3) position corrections and rotation vectors r(t) at times (s).

        Raises
        ------
        InputError
            As in :meth:`poses`.
        """
        times = self._inside(times)
        return corrections(self.given, times, self.position, self.rotation)

    def _inside(self, times: ArrayLike) -> Floats:
        own = np.atleast_1d(np.asarray(times, dtype=float))
        first, last = self.given.reach
        outside = ~((own >= first) & (own <= last))
        if own.ndim != 1 or outside.any():
            bad = own.ravel()[np.argmax(outside)] if outside.any() else times
            raise InputError(phrase("adjusted.time", name=self.name, first=first, last=last, time=bad))
        return own


def corrections(
    trajectory: Trajectory, times: Floats, position: Floats, rotation: Floats
) -> tuple[Floats, Floats]:
    """Return (n, 3) sums of (K, 3) position and rotation coefficients."""
    *_, of_position, of_rotation = trajectory.flown(times, position, rotation)

    def sums(active: list[tuple[int, list[float]]], own: Floats) -> Floats:
        found = np.zeros((len(times), 3))
        for row, (first, values) in enumerate(active):
            found[row] = np.asarray(values) @ own[first : first + len(values)] if values else 0.0
        return found

    return sums(of_position, position), sums(of_rotation, rotation)


def project(result: Result, photo: str, points: ArrayLike) -> Floats:
    """Return images of (n, 3) points on a photo; see :meth:`photogram.Result.project`."""
    block = result.block
    timed = {each.photo: row for row, each in enumerate(block.timed)}
    require_name("photo on a trajectory", photo, timed)
    row = timed[photo]
    adjusted = {id(each.given): (each.position, each.attitude) for each in result.unknowns}
    index = block.photo_ids.index(photo)
    if result.cameras and block.photo_cameras is not None:
        camera = result.cameras[int(block.photo_cameras[index])].camera
    else:
        camera = camera_of(block, index)
    places = shaped("points", points, (None, 3))
    if block.spheroid is not None:
        places = geographic_to_geocentric(places, block.spheroid)
    own = block.timed[row]
    if own.rate is not None:
        # Its time origin is the adjusted one.
        own = replace(own, time=own.images(block.image_xy[block.image_photos == index])[0])
    return projected(own, block.trajectories[row], camera, places, lambda each: adjusted[id(each)])


def adjusted_trajectories(result: Result) -> dict[str, AdjustedTrajectory]:
    found = {id(each.given): each for each in result.unknowns}
    once = cache(result.covariances)

    def joint(names: list[str]) -> Floats:
        return once().covariance([("unknown", name) for name in names])

    def adjusted(own: Trajectory) -> AdjustedTrajectory:
        values = {
            f"{name}{suffix}": np.array([getattr(found[id(each)], what) for each in part]).reshape(-1, 3)
            for suffix, what in (("", "position"), ("_sd", "sd"), ("_redundancy", "redundancy"))
            for name, part in zip(("position", "rotation"), own.coefficients, strict=True)
        }
        return AdjustedTrajectory(own, **values, joint=joint)

    return {each.name: adjusted(each) for each in result.block.all_trajectories}


def restarted_motion(
    block: Block, adjusted: Iterable[AdjustedTrajectory], turns: Mapping[str, Floats] | None = None
) -> Block:
    turns = turns or {}
    found = {id(each.given): each for each in adjusted}
    # A prior observes the given value of its unknown.
    observed = {id(each.unknown) for each in block.observations.of_type(Prior)}
    moved = {key: each.restarted(observed, turns.get(each.name)) for key, each in found.items()}
    coefficients: dict[int, Coefficient] = {}
    for key, each in found.items():
        for before, after in zip(each.given.coefficients, moved[key].coefficients, strict=True):
            coefficients |= {id(one): other for one, other in zip(before, after, strict=True)}

    def flown(own: Timed, trajectory: Trajectory) -> Timed:
        if own.trajectory is not None:
            return replace(own, trajectory=moved[id(own.trajectory)])
        each = found[id(trajectory)]
        return replace(
            own,
            velocity=np.where(np.isinf(own.sd_velocity), each.position[1], own.velocity),
            rotation_rate=np.where(np.isinf(own.sd_rate), each.rotation[1], own.rotation_rate),
        )

    def changed(own: Observation) -> Observation:
        changes: dict[str, Any] = {}
        if isinstance(own, Smoothness):
            changes["coefficients"] = [coefficients[id(each)] for each in own.coefficients]
        elif isinstance(own, Prior) and isinstance(own.unknown, Coefficient):
            changes["unknown"] = coefficients[id(own.unknown)]
        elif own.moment is not None:
            changes["trajectory"] = moved[id(own.moment.trajectory)]
        return replace(own, **changes) if changes else own

    return block.replace(
        timed=[*map(flown, block.timed, block.trajectories)],
        observations=[*map(changed, block.observations)],
    )


STEPS = 8  # Positions in each interval of knots, or for each coefficient of a polynomial
COEFFICIENTS = 24  # Number up to which all coefficients are listed
NOTABLE = 3.0  # Test value from which coefficients of longer lists are listed
LISTED = 20  # Rows of longer lists of coefficients and trajectories


def trajectories_table(result: Result) -> Table:
    """Return trajectories with their largest corrections and tests; of many, the notable ones."""
    from photogram.show.page import about  # only required for tables
    from photogram.show.quantity import Axis, Quantity, Table

    # By name: photos with their own trajectories are recreated with their block.
    adjusted = {(each.kind, each.name): each for each in result.unknowns}
    rows = [
        (each.name, part, *_correction(each, part, basis, [adjusted[one.KIND, one.name] for one in own]))
        for each in result.block.all_trajectories
        for part, (basis, own) in enumerate(
            zip((each.position, each.rotation), each.coefficients, strict=True)
        )
        if basis is not None
    ]
    note = about("trajectories")
    if len(rows) > LISTED:
        note = about("trajectories.chosen", n=LISTED, all=len(rows))
        order = sorted(range(len(rows)), key=lambda row: -np.nan_to_num(rows[row][-1]))[:LISTED]
        rows = [rows[row] for row in sorted(order)]
    names, parts, bases, count, first, last, largest, at, tests = (
        zip(*rows, strict=True) if rows else ((),) * 9
    )
    axes = (Axis.of("position", result.block.linear_unit), Axis.turned("rotation"))
    of = np.array(parts, dtype=np.int64)
    columns = [
        Quantity(names, kind="name", head="Trajectory"),
        Quantity([axes[k].name for k in parts], axes, "name", head="Of", of=of),
        Quantity(bases, kind="name", head="Basis"),
        Quantity(count, head="Coefficients", decimals=0),
        Quantity(first, head="From s", decimals=3),
        Quantity(last, head="To s", decimals=3),
        Quantity(largest, axes, "deviation", head="Largest correction", figures=4, of=of),
        Quantity(at, head="At s", decimals=3),
        Quantity(tests, head="Largest |w|", decimals=2),
    ]
    return Table("trajectories", "Trajectories", columns, note)


def _correction(
    trajectory: Trajectory, part: int, basis: Basis, own: Sequence[AdjustedUnknown]
) -> tuple[str, int, float, float, float, float, float]:
    """Return basis, coefficients, span, largest correction and time, largest test."""
    first, last = trajectory.table.span
    if isinstance(basis, Polynomial):  # Some times for each coefficient
        times = np.linspace(first, last, STEPS * basis.count + 1) if last > first else np.array([first])
    else:  # Some times in each interval of knots
        knots, p = np.asarray(basis.knots, dtype=float), basis.degree
        inner = np.clip(np.unique(knots[p : len(knots) - p]), first, last)
        parts = (np.arange(STEPS) / STEPS)[:, np.newaxis]
        times = np.unique(np.append(((1 - parts) * inner[:-1] + parts * inner[1:]).ravel(), inner[-1]))
    values = np.array([each.position for each in own])
    # The others do not count.
    none = [np.zeros((len(each), 3)) for each in trajectory.coefficients]
    none[part] = values
    sizes = np.linalg.norm(corrections(trajectory, times, *none)[part], axis=1)
    worst = int(np.argmax(np.nan_to_num(sizes, nan=-1.0)))
    tests = np.abs(np.concatenate([each.standardized for each in own]))
    largest = float(np.nanmax(tests)) if np.isfinite(tests).any() else float("nan")
    name = phrase(f"about.basis.{type(basis).__name__.lower()}", degree=basis.degree)
    return str(name), len(own), first, last, float(sizes[worst]), float(times[worst]), largest


_MANY = (Coefficient, Knot)  # Types with thousands of unknowns


def notable(every: Sequence[AdjustedUnknown]) -> tuple[list[AdjustedUnknown], str]:
    """Return the common unknowns in reports, and a note on those that are not listed."""
    own = [each for each in every if isinstance(each.given, _MANY)]
    if len(own) <= COEFFICIENTS:
        return list(every), ""
    sizes = np.array([np.nan_to_num(np.abs(each.standardized)).max(initial=0.0) for each in own])
    order = np.argsort(-sizes, kind="stable")[:LISTED]
    kept = {id(own[row]) for row in order.tolist() if sizes[row] > NOTABLE}
    shown = [each for each in every if not isinstance(each.given, _MANY) or id(each) in kept]
    both = dict.fromkeys("knots" if isinstance(each.given, Knot) else "coefficients" for each in own)
    kinds = [phrase(f"about.unknowns.{kind}") for kind in both]
    code = f"about.unknowns.{'notable' if kept else 'unlisted'}"
    return shown, str(phrase(code, n=len(kept), all=len(own), kinds=kinds, limit=NOTABLE))


LARGE = 0.5  # Radians
TIMES = 1000  # Maximum number of times at which a trajectory is evaluated


def large_turns(result: Result) -> dict[str, Floats]:
    """Return the rotations that update tables, by trajectory name.

    (3,) rotation vectors about the axes of the photo, in radians.
    """
    block, large = result.block, _large(result)
    return {
        own.name: turn
        for own, turn in large
        if np.linalg.norm(turn) > LARGE / 2 and _is_open(block, own.given)
    }


def taken_over(turns: dict[str, Floats]) -> Message:
    """Return the note on tables that were updated by rotations."""
    parts = [
        phrase("adjust.rotations.table", name=name, angle=float(np.linalg.norm(turn)))
        for name, turn in turns.items()
    ]
    return Message(phrase("adjust.rotations.tables", tables=parts))


def stays(result: Result) -> list[Message]:
    """Return the note on large rotations that cannot be applied to tables."""
    large = [own.name for own, _ in _large(result) if own.given.angles == "vector"]
    return [Message(phrase("adjust.rotations.large", trajectories=large, limit=LARGE))] if large else []


def _large(result: Result) -> list[tuple[AdjustedTrajectory, Floats]]:
    """Return trajectories with a large attitude correction, and the correction in the middle.

    Empty without convergence, because the steps are then unreliable.
    """
    values = {each.name: each.position for each in result.unknowns if each.kind == RotationCoefficient.KIND}
    of_photos = _of_photos(result.block)
    large = [
        each.name
        for each in result.block.all_trajectories
        if _may_be_large(each, values, alone=each.name in of_photos)
    ]
    if not large or not result.converged:
        return []
    found, adjusted, seen = [], result.trajectories, _seen(result.block)
    for own in (adjusted[name] for name in large if name in seen):
        turns = own.corrections(np.clip(seen[own.name], *own.given.reach))[1]
        if np.linalg.norm(turns, axis=1).max() > LARGE:
            found.append((own, turns[len(turns) // 2]))
    return found


def _may_be_large(trajectory: Trajectory, values: dict[str, Floats], *, alone: bool) -> bool:
    """Return whether coefficients allow a large correction.

    `alone`: only the first coefficient counts, for the motion of a single photo.
    """
    basis, own = trajectory.rotation, trajectory.coefficients[1]
    sizes = np.array([np.linalg.norm(values[each.name]) for each in (own[:1] if alone else own)])
    if isinstance(basis, Polynomial):
        first, last = trajectory.table.span
        reference, scale = basis.reference or 0.0, basis.scale or 1.0
        beyond = max(1.0, abs(first - reference) / scale, abs(last - reference) / scale)
        return bool((sizes * beyond ** np.arange(len(sizes))).sum() > LARGE)
    # B-splines are positive and their sum is 1.
    return bool((sizes > LARGE).any())


def _of_photos(block: Block) -> set[str]:
    """Return the names of trajectories that belong to single photos."""
    return {each.photo for each in block.timed if each.trajectory is None}


def _seen(block: Block) -> dict[str, Floats]:
    """Return some ascending times of images and records, by trajectory name."""
    times: dict[str, list[Floats]] = {}
    for own, trajectory, _, images in timed_images(block):
        times.setdefault(trajectory.name, []).append(own.times(block.image_xy[images]))
    for each in block.observations:
        if each.moment is not None:
            times.setdefault(each.moment.trajectory.name, []).append(np.array([each.moment.time]))
    joined = {name: np.sort(np.concatenate(own)) for name, own in times.items()}
    some = {
        name: np.linspace(0, len(own) - 1, min(len(own), TIMES)).astype(int) for name, own in joined.items()
    }
    return {name: own[some[name]] for name, own in joined.items() if len(own)}


def _is_open(block: Block, trajectory: Trajectory) -> bool:
    """Return whether a common rotation of all rotation coefficients is free.

    Rates of a photo's own motion refer to its axes and do not restrict it.
    """
    own = trajectory.coefficients[1]
    if trajectory.name in _of_photos(block):
        own = own[:1]
    ids = {id(each) for each in own}

    def tells(each: object) -> bool:
        if isinstance(each, Prior):
            return id(each.unknown) in ids
        if isinstance(each, Smoothness):
            on: tuple[Coefficient, ...] = tuple(each.coefficients)
            return id(on[0]) in ids and abs(np.sum(each.factors)) > 1e-9 * np.abs(each.factors).sum()
        return False

    free = all(np.isinf(each.deviations).all() for each in own)
    return trajectory.angles == "vector" and free and not any(map(tells, block.observations))
