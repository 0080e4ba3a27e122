"""Combinations of unknowns that the observations leave undetermined, in words; names of common unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import RankError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import listed
from photogram.network.block import Block, flown_by
from photogram.network.geometry import photo_axes, viewing_directions
from photogram.network.motion import on_shared, scanners
from photogram.network.observations import moments
from photogram.network.trajectories import Coefficient, Spline, Trajectory
from photogram.network.unknowns import Unknown

if TYPE_CHECKING:
    from photogram import _photocore

_Combination = tuple[
    tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[tuple[int, int], ...], tuple[str, ...]
]
"""Photos, cameras, common unknowns, parameters of cameras and parts of poses that move together."""

_DISTANCES = frozenset({"c", "f", "fx", "fy"})
_POINTS = frozenset({"xp", "yp", "cx", "cy"})
_DECENTRING = frozenset({"P1", "P2", "p1", "p2", "B1", "B2"})
_AFFINITY = frozenset({"b1", "b2"})
_OF_RING = frozenset({"b1", "yp", "cy", "fx", "fy"})
"""What photos on a ring that are not turned about their axes leave open, with c or each other."""
_ALONG = 0.8  # Cosine of the angle between the view and an axis that is moved along it
_PARTS = {
    "along": "flying heights (positions along the view)",
    "across": "positions across the view",
    "tilt": "tilts",
    "swing": "turns about the view",
}


_PARALLEL = 0.99  # Cosine of the angle between views that are about parallel
_UPRIGHT = 0.05  # Photos whose x axes are across one direction to this sine are not turned about their axes
MOST = 40  # Lines of a message
_ONE_PLACE = 1e-9  # Stations that differ by less than this part of their coordinates are one
_ON_LINE = 1e-3  # Places whose spread across a line is less than this part of that along it are on it


@dataclass(frozen=True)
class Setting:
    """How the photos of a block stand, as far as their words depend on it.

    They are `parallel` where all look in about the same direction, `upright` where none is turned about its
    axis: the x axes, or the y axes, of all are across one direction. `control` is known of points, `heights`
    of a point or photo; `on_line` are all known places, of points and photos, on one straight line.
    """

    photos: int = 0
    parallel: bool = False
    upright: bool = False
    control: bool = False
    heights: bool = True
    on_line: bool = False


def setting_of(block: Block) -> Setting:
    """Return how the photos of a block stand at their initial values."""
    photos = len(block.photo_ids)
    control = bool(np.isfinite(block.point_sd).any())
    moving = on_shared(block) | scanners(block)
    if photos < 2 or block.geographic or moving.any() or not np.isfinite(block.photo_attitudes).all():
        return Setting(photos, control=control)
    axes = photo_axes(block.photo_attitudes, block.photo_to_ground).transpose(0, 2, 1)
    across = [float(np.linalg.svd(axes[:, k], compute_uv=False)[-1]) for k in (0, 1)]
    known = np.concatenate(
        [
            block.point_positions[np.isfinite(block.point_sd).all(axis=1)],
            block.photo_positions[np.isfinite(block.photo_position_sd).all(axis=1)],
        ]
    )
    spread = np.linalg.svd(known - known.mean(axis=0), compute_uv=False) if len(known) > 1 else np.zeros(2)
    return Setting(
        photos,
        parallel=bool((axes[:, 2] @ axes[0, 2]).min() > _PARALLEL),
        upright=min(across) < _UPRIGHT * photos**0.5,
        control=control,
        heights=bool(
            np.isfinite(block.point_sd[:, 2]).any() or np.isfinite(block.photo_position_sd[:, 2]).any()
        ),
        on_line=bool(spread[0] > 0 and spread[1] < _ON_LINE * spread[0]),
    )


def one_place(block: Block, photos: Sequence[int]) -> str:
    """Return what it means that photos were all taken from one place; nothing where they were not."""
    stations = block.photo_positions[list(photos)]
    if (on_shared(block) | scanners(block))[list(photos)].any():
        return ""
    if len(stations) < 2 or np.ptp(stations, axis=0).max() > _ONE_PLACE * max(1.0, np.abs(stations).max()):
        return ""
    return (
        ": all photos were taken from one place, directions are determined, distances of points are not; a"
        " base between the photos, or depths from control or distances, point by point, would determine them;"
        " if only the camera is asked for, points at infinity do, which are directions only (stars: photogram"
        " stellar-camera)"
    )


def undetermined_combinations(
    block: Block,
    combinations: list[_photocore.CombinationRow],
    unknowns: Sequence[Unknown] | None = None,
) -> RankError:
    """Name the photos, points and cameras of undetermined combinations, and what they are.

    `unknowns` are the common ones that the combinations count, where they are not those of the block alone.
    """
    common = unknowns or block.unknowns
    rows = [
        (tuple(of), tuple(by), tuple(others), tuple(moved), tuple(poses))
        for of, by, others, moved, poses in combinations
    ]
    concerned = sorted({photo for of, *_ in rows for photo in of})
    names = [block.photo_ids[photo] for photo in concerned]
    cameras = {camera for _, by, _, moved, _ in rows for camera in (*by, *(each for each, _ in moved))}
    camera_names = [block.camera_names[row] for row in sorted(cameras)]
    points = np.unique(block.image_points[np.isin(block.image_photos, concerned)])
    point_names = [block.point_ids[point] for point in points]
    lines = [f"the observations leave {len(rows)} combinations of unknowns undetermined:"]
    at = setting_of(block)
    words = [_said(block, each, at, common) for each in sorted(set(rows))]
    moving = [
        _moved(block, of, by, named_unknowns(block, [common[row] for row in others]))
        for of, by, others, *_ in sorted(set(rows))
    ]
    for each, said, moved in zip(sorted(set(rows)), words, moving, strict=True):
        line = f"  {rows.count(each)} moving {moved}"
        lines += [line, f"    {said}"] if said else [line]
    if len(lines) > MOST:
        lines = [*lines[:MOST], f"  and {len(lines) - MOST} lines more"]
    if not np.isfinite(block.point_sd).any() and not any(words):
        weighted = np.isfinite(block.photo_position_sd).any()
        remedy = (
            "the standard deviations of the photos are too large to give a datum in double precision"
            if weighted
            else "standard deviations for the positions and attitudes of photos would give a datum"
            if not flown_by(block)
            else "records of GNSS, or standard deviations of coefficients, would give a datum"
        )
        lines.append(f"  there is no control; {remedy}")
    what = "; ".join(dict.fromkeys(said or moved for said, moved in zip(words, moving, strict=True)))
    return RankError("\n".join(lines), names, point_names, camera_names, what)


def _moved(block: Block, photos: tuple[int, ...], cameras: tuple[int, ...], unknowns: list[str]) -> str:
    """Say which photos, cameras and common unknowns a combination moves."""
    of_cameras = listed([block.camera_names[camera] for camera in cameras])
    others = listed(unknowns)
    if not photos:
        parts = [f"the parameters of {of_cameras}"] if cameras else []
        return " and ".join([*parts, *([others] if unknowns else [])])
    on = np.unique(block.image_points[np.isin(block.image_photos, photos)])
    moved = (
        f"all {len(photos)} photos together"
        if len(photos) == len(block.photo_ids) > 1
        else f"photos {listed([block.photo_ids[photo] for photo in photos])}"
    )
    if cameras:
        moved += f" with the parameters of {of_cameras}"
    if unknowns:
        moved += f" with {others}"
    held = f"hold the points {listed([block.point_ids[p] for p in on])}" if on.size else "have no images"
    return f"{moved}, which {held}"


def _said(block: Block, combination: _Combination, at: Setting, common: Sequence[Unknown]) -> str:
    """Name parameters and parts of poses, then what that is; nothing where it has no name."""
    photos, cameras, others, moved, poses = combination
    if not moved:
        return "" if cameras else _of_unknowns(block, {common[row].KIND for row in others}, len(photos), at)
    by_camera: dict[int, list[str]] = {}
    for camera, k in moved:
        by_camera.setdefault(camera, []).append(block.cameras[camera].names[k])
    parts = [f"{', '.join(names)} of {block.camera_names[camera]}" for camera, names in by_camera.items()]
    parts += [_PARTS[part] for part in poses]
    words = in_words({name for names in by_camera.values() for name in names}, set(poses), at)
    return " with ".join(parts) + (f": {words}" if words else "")


def _of_unknowns(block: Block, kinds: set[str], photos: int, at: Setting) -> str:
    """Say what positions with shifts and drifts, motions, or control on a line, leave open."""
    if said := of_motion(kinds, placed=at.control or bool(block.observations)):
        return said
    if kinds == {"lever arm", "shift"}:
        return (
            "lever arm and shift move together, all photos having the same attitude: the lever arm measured"
            " (to 1 or 2 cm), the shift held where base and datum are sure, strips in opposite headings (for"
            " its parts along and across them) or tilted photos"
        )
    if "drift" in kinds:
        return (
            "the drift of a strip takes whatever scale and turn control does not fix: control at both ends,"
            " two points each, no free drift for short strips, or one shift and drift for the whole flight"
            " and a cross strip"
        )
    if photos == at.photos > 0 and not kinds and at.control and not at.heights:
        return "height and tilts of the whole: no height is known; heights of control, or positions of photos"
    if photos == at.photos > 0 and at.on_line:
        return (
            "roll of the strip about the line of its control: heights beside the line are not determined; one"
            " height aside of it, GNSS and control whose lines do not coincide, roll from an IMU with a known"
            " boresight, or a second strip with control of its own (one that is only tied to the first rolls"
            " with it)"
        )
    return ""


def weak_parameters(block: Block, solution: _photocore.BlockSolution) -> list[tuple[int, int]]:
    """Return the cameras and parameters of the combination that no step could follow to its end."""
    if block.photo_cameras is None:
        return list(solution.weak_cameras)
    cameras = block.photo_cameras.tolist()
    own = [(cameras[photo], unknown - 6) for photo, unknown in solution.weak if unknown >= 6]
    return [*own, *solution.weak_cameras]


def weak_in_words(block: Block, solution: _photocore.BlockSolution) -> str:
    """Say what the combination is that no step could follow to its end; see :func:`in_words`."""
    names = {block.cameras[camera].names[k] for camera, k in weak_parameters(block, solution)}
    at = setting_of(block)
    if not names:
        kinds = {block.unknowns[row].KIND for row, _ in solution.weak_unknowns}
        return _of_unknowns(block, kinds, len({photo for photo, _ in solution.weak}), at)
    views = viewing_directions(
        solution.photo_positions, solution.photo_attitudes, photo_to_ground=block.photo_to_ground
    )
    poses = set()
    for photo, unknown in solution.weak:
        if unknown < 3:
            poses.add("along" if abs(views[photo, unknown]) > _ALONG else "across")
        elif unknown < 6:
            poses.add("swing" if unknown == 5 else "tilt")
    # Far along it others hardly move: what is free and fits it belongs to it.
    named = [camera for camera in block.cameras if names & set(camera.names)]
    free = {
        name
        for each in named
        for name, sd in zip(each.names, each.deviations, strict=True)
        if np.isinf(sd) and name in _OF_RING
    }
    return _of_setting(names | free, at) or in_words(names, poses, at) or _of_distances(names, poses)


def in_words(names: set[str], poses: set[str], setting: Setting | None = None) -> str:
    """Return what parameters of cameras and parts of poses cannot be told apart, and what would help.

    Parts are `along`, `across`, `tilt`, `swing`; None stands for a setting that is not known. Nothing for
    what has no name.
    """
    at = setting or Setting()
    radial = {name for name in names if name[0] in "KkA" and name[1:].isdigit()}
    if radial and radial == names and not poses:
        return "radial terms among each other, which is harmless: the curve is determined; fewer terms do"
    if names and names <= _DISTANCES | _POINTS | _AFFINITY and (words := _of_setting(names, at)):
        return words
    if names <= _DISTANCES and (poses == {"along"} or (at.parallel and at.control)):
        return (
            "principal distance and flying height of all photos: a longer camera higher up gives the same"
            " pictures of a flat field; the principal distance given, convergent photos, observed heights of"
            " the photos (GNSS without a free shift) or relief with known heights tell them apart"
        )
    if names <= _DISTANCES and poses >= {"along", "across"}:
        return "principal distance and scale of the network: a distance or control tells them apart"
    if names <= _POINTS and poses & {"across", "tilt"}:
        turned = "" if at.parallel and at.control else ", photos turned by 90 or 180 degrees about their axes"
        return (
            "principal point and position or tilt of all photos: the principal point given, convergent"
            f" photos, relief of known heights{turned} or positions observed without a free shift tell them"
            " apart"
        )
    if names <= _POINTS | _DECENTRING and names & _DECENTRING and names & _POINTS:
        return "decentring and principal point, as with long lenses: leave the decentring out"
    if names <= _DISTANCES | radial and radial and names & _DISTANCES:
        return "radial terms and principal distance: balanced terms (r0) are hardly correlated with it"
    if "b1" in names and not names - _DISTANCES - {"b1"}:
        return "affinity and scale: photos turned by 90 degrees tell them apart"
    if names == {"b2"} and "swing" in poses:
        return "shear and kappa of all photos: photos turned by 90 degrees tell them apart"
    return ""


def _of_distances(names: set[str], poses: set[str]) -> str:
    """Return what helps if principal distances are weak together with positions; nothing for others."""
    if not (names and names <= _DISTANCES and poses):
        return ""
    return (
        "principal distance and distances from the photos to the points: control at different depths,"
        " convergent photos, or a fixed principal distance separate them"
    )


def _of_setting(names: set[str], at: Setting) -> str:
    """Return what the way the photos stand leaves open of their camera."""
    if at.photos == 2:
        return (
            "two photos determine at most two numbers of the camera, and not even the principal distance"
            " when their axes are parallel or meet at equal distances, or the object is flat: the camera"
            " given, a third photo from aside, inclined and turned, or three control points at different"
            " depths, not on a line"
        )
    if at.parallel and not at.control:
        return (
            "all photos look in the same direction, and the pictures fit an object stretched along the view"
            " or sheared across it: a photo that is tilted, the camera given, or four control points not on a"
            " plane; a photo turned by 90 degrees about its axis settles the principal point, not the"
            " principal distance"
        )
    if at.upright and not at.parallel and names & _OF_RING:
        return (
            "no photo is turned about its axis: the ratio of the two image scales cannot be separated from a"
            " stretch of the object along the axis of the ring, nor yp from its growing towards one end:"
            " every second photo turned by 90 degrees, b1 held at 0 and yp or c given, two rings of different"
            " height (weaker), or distances along and across the axis"
        )
    return ""


def named_unknowns(block: Block, unknowns: Sequence[Unknown]) -> list[str]:
    """Name common unknowns, each once; coefficients by their trajectories and, of splines, times."""
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

    Records on trajectories stand behind the photos; `points` has the point of the image, none where it is the
    photo itself, or a record. `seconds` are that time, and the first and the last that the trajectory
    reaches, from its origin.
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
    """Say what unknowns of motion of such kinds cannot be told apart, and what would help; else nothing.

    `placed`: there is control, or anything beside images, so that it may not be the datum that is open.
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
