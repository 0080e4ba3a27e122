"""What coefficients of trajectories are of, in words: positions and rotations, and when."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.messages import counted, listed
from photogram.network.block import Block
from photogram.network.flown import timed_images
from photogram.network.observations import moments
from photogram.network.trajectories import Coefficient, Spline, Trajectory
from photogram.network.unknowns import Unknown
from photogram.network.whereabouts import reach

__all__ = ["named_unknowns", "of_motion", "outside"]


def named_unknowns(block: Block, unknowns: Sequence[Unknown]) -> list[str]:
    """Name common unknowns; coefficients not one by one, but by their trajectories and, of splines, times.

    Parameters
    ----------
    block
        Which has them.
    unknowns
        Each once or more often.
    """
    found = list(dict.fromkeys(each.title for each in unknowns if not isinstance(each, Coefficient)))
    wanted = {id(each) for each in unknowns if isinstance(each, Coefficient)}
    if not wanted:
        return found
    every = block.all_trajectories
    for part, what in enumerate(("positions", "rotations")):
        names = [name for each in every if (name := _named(each, part, wanted))]
        found += [f"{what} of {listed(names)}"] if names else []
    known = {id(each) for own in every for each in (*own.coefficients[0], *own.coefficients[1])}
    others = [each.title for each in unknowns if isinstance(each, Coefficient) and id(each) not in known]
    return [*found, *dict.fromkeys(others)]


def _named(trajectory: Trajectory, part: int, wanted: set[int]) -> str:
    """Return the name of a trajectory, with the times that its coefficients are of; nothing of others."""
    own = [k for k, each in enumerate(trajectory.coefficients[part]) if id(each) in wanted]
    basis = (trajectory.position, trajectory.rotation)[part]
    if not own:
        return ""
    if not isinstance(basis, Spline):
        return trajectory.name
    knots = np.asarray(basis.knots, dtype=float)
    first, last = trajectory.table.span
    begin, end = max(knots[own[0]], first), min(knots[own[-1] + basis.degree + 1], last)
    return f"{trajectory.name} between {begin:.10g} and {end:.10g} s"


def outside(block: Block) -> str:
    """Say which photo, or record, is at a time that its trajectory does not reach; nothing where none is."""
    for own, trajectory, _, rows in timed_images(block):
        times = own.times(block.image_xy[rows])
        begin = own.images(block.image_xy[rows])[0] + own.delay
        first, last = reach(trajectory)
        bad = np.flatnonzero((times < first) | (times > last))
        if bad.size or not first <= begin <= last:
            at = float(times[bad[0]]) if bad.size else begin
            what = f"the photo {own.photo}"
            if bad.size:
                what = f"the image of point {block.point_ids[block.image_points[rows[bad[0]]]]} on {what}"
            return f"{what} is at {at:.12g} s, {_beyond(trajectory, first, last)}"
    for each in moments(block.observations):
        first, last = reach(each.trajectory)
        at = each.time + (0.0 if each.clock is None else float(each.clock.position[0]))
        if not first <= at <= last:
            count = sum(one.moment is not None and one.moment.name == each.name for one in block.observations)
            what = f"{counted(count, 'observation')} of {each.name}"
            return f"{what}: it is {_beyond(each.trajectory, first, last)}"
    return ""


def _beyond(trajectory: Trajectory, first: float, last: float) -> str:
    return (
        f"beyond the trajectory {trajectory.name}, which reaches from {first!r} to {last!r} s: half a record"
        " beyond its table, within its knots"
    )


def of_motion(kinds: set[str], *, placed: bool) -> str:
    """Say what unknowns of motion cannot be told apart, and what would help; nothing for others.

    Parameters
    ----------
    kinds
        The types of the unknowns that move together.
    placed
        Whether there is control, or anything beside images, so that it may not be the datum that is open.
    """
    coefficients = kinds & {"position coefficient", "rotation coefficient"}
    if "readout" in kinds and coefficients:
        return (
            "readout time and motion of the photos, of which only the products are seen: the readout time"
            " given or weighted, velocities of GNSS, rates that are weighted, or a trajectory that several"
            " exposures share"
        )
    if "clock" in kinds and coefficients:
        return (
            "clock offset and position along the track: strips in opposite directions, control, or an offset"
            " that is given or weighted"
        )
    if not placed or not coefficients or coefficients != kinds:
        return ""
    if len(coefficients) == 2:
        return (
            "position and attitude of the trajectory: along the track and pitch, or across and roll: weights,"
            " a second line that looks elsewhere, or control"
        )
    return "nothing there tells them: weights or smoothness of coefficients, a lower degree, or fewer knots"
