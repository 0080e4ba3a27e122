"""Prior positions and attitudes of a block before its photos are oriented, in cartesian axes."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.geometry import Cartesian, photo_axes
from photogram.network.motion import on_shared, scanners
from photogram.network.observations import Attitude, Control, Position
from photogram.network.unknowns import Boresight, LeverArm


@dataclass(frozen=True, eq=False)
class Known:
    """Prior values of P photos and n points in cartesian axes; NaN if unknown.

    Given poses are (P, 3) and (P, 3, 3), photo to object, always complete. Observed poses belong to photos
    without a given pose and may be incomplete. Points (n, 3) are control; free components have infinite
    standard deviations.
    """

    positions: Floats
    attitudes: Floats
    observed_positions: Floats
    observed_attitudes: Floats
    points: Floats
    point_sd: Floats

    @classmethod
    def of(cls, block: Block, axes: Cartesian) -> Known:
        """Collect the prior values of a block."""
        positions = axes.positions(block.photo_positions)
        attitudes = axes.from_local(
            photo_axes(block.photo_attitudes, block.photo_to_ground), block.photo_positions
        )
        given = np.asarray(np.isfinite(np.column_stack([positions, attitudes.reshape(-1, 9)])).all(axis=1))
        # A photo on a shared trajectory, or of a line scanner, has several poses.
        given &= ~(on_shared(block) | scanners(block))
        observed = block.photo_positions_observed
        centres = positions.copy()
        if observed is not None:
            weighted = np.isfinite(block.photo_position_sd).all(axis=1) & np.isfinite(observed).all(axis=1)
            centres[weighted] = axes.positions(observed)[weighted]
        turned = attitudes.copy()
        if (angles := block.photo_attitudes_observed) is not None:
            weighted = np.isfinite(block.photo_attitude_sd).all(axis=1) & np.isfinite(angles).all(axis=1)
            turned[weighted] = axes.from_local(
                photo_axes(angles, block.photo_to_ground), block.photo_positions
            )[weighted]
        _take_observations(block, axes, centres, turned)
        points, sd = _control(block, axes)
        return cls(
            positions=np.where(given[:, np.newaxis], positions, np.nan),
            attitudes=np.where(given[:, np.newaxis, np.newaxis], attitudes, np.nan),
            observed_positions=centres,
            observed_attitudes=turned,
            points=points,
            point_sd=sd,
        )


def with_poses(block: Block, positions: Floats, attitudes: Floats) -> Block:
    """Return the block with initial poses of photos; fixed values and observed values do not change."""
    changes: dict[str, Floats] = {}
    for name, values in (("position", positions), ("attitude", attitudes)):
        given, sd = getattr(block, f"photo_{name}s"), getattr(block, f"photo_{name}_sd")
        changes[f"photo_{name}s"] = np.where((sd == 0) & np.isfinite(given), given, values)
        if getattr(block, f"photo_{name}s_observed") is None and np.isfinite(sd).any():
            changes[f"photo_{name}s_observed"] = np.where(np.isfinite(sd), given, np.nan)
    return block.replace(**changes)


def _take_observations(block: Block, axes: Cartesian, centres: Floats, turned: Floats) -> None:
    """Insert observed attitudes A_obs B', and observed positions minus lever arms."""
    place = block._photo_rows
    positions = [each for each in block.observations.of_type(Position) if each.moment is None]
    for antenna in positions:
        centres[place[antenna.photos[0]]] = axes.positions(antenna.observed[np.newaxis, :3])[0]
        if antenna.shift is not None and axes.spheroid is None:
            centres[place[antenna.photos[0]]] -= antenna.shift.position
    for each in block.observations.of_type(Attitude):
        if each.moment is None:
            row = place[each.photos[0]]
            given, known = each.boresight, each.observed[9:18].reshape(3, 3)
            boresight = given.attitude if isinstance(given, Boresight) else known
            own = each.observed[:9].reshape(3, 3) @ boresight.T
            at = axes.from_cartesian(centres[row : row + 1])
            turned[row] = axes.from_local(own[np.newaxis], at)[0]
    for antenna in positions:
        row = place[antenna.photos[0]]
        if np.isfinite(turned[row]).all():
            unknown = antenna.lever_arm
            arm = unknown.position if isinstance(unknown, LeverArm) else antenna.observed[3:6]
            centres[row] -= turned[row] @ arm


def _control(block: Block, axes: Cartesian) -> tuple[Floats, Floats]:
    """Return positions and standard deviations of control in cartesian axes."""
    points, sd = block.point_positions.copy(), block.point_sd.copy()
    for each in block.observations.of_type(Control):
        row = block._point_rows[each.point]
        points[row], sd[row] = each.observed, np.sqrt(np.diagonal(each.precision))
    held = np.isfinite(sd)
    points[~held.any(axis=1)] = np.nan
    if axes.spheroid is not None:
        # Only full control is usable in geocentric axes, with one standard deviation for all axes.
        full = held.all(axis=1, keepdims=True)
        metric = sd * [axes.spheroid.a, axes.spheroid.a, 1.0]
        sd = np.where(full, np.broadcast_to(metric.max(axis=1, keepdims=True), sd.shape), np.inf)
        points = np.where(full, axes.positions(points), np.nan)
    return points, sd
