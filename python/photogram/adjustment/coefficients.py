"""What coefficients of trajectories are of, in words: positions and rotations, and when."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.messages import listed
from photogram.network.block import Block
from photogram.network.observations import moments
from photogram.network.trajectories import Coefficient, Spline, Trajectory
from photogram.network.unknowns import Unknown

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


def outside(block: Block, photo: int, points: Sequence[int], seconds: Sequence[float]) -> str:
    """Say what is at a time that its trajectory does not reach.

    Parameters
    ----------
    block
        The block.
    photo
        Its index; records on trajectories stand behind the photos.
    points
        The point of its image at that time; none where it is the photo itself, or a record.
    seconds
        That time, and the first and the last that the trajectory reaches, from its origin.
    """
    count = len(block.photo_ids)
    if photo < count:
        what = f"the photo {block.photo_ids[photo]}"
        if points:
            what = f"the image of point {block.point_ids[points[0]]} on {what}"
        trajectories = zip(block.timed, block.trajectories, strict=True)
        trajectory = next(on for own, on in trajectories if own.photo == block.photo_ids[photo])
    else:
        record = moments(block.observations)[photo - count]
        trajectory = record.trajectory
        what = f"what was observed of {record.name}"
    time, first, last = (trajectory.origin + each for each in seconds)
    return (
        f"{what} is at {time:.12g} s, beyond the trajectory {trajectory.name}, which reaches from {first!r}"
        f" to {last!r} s: half a record beyond its table, within its knots"
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
