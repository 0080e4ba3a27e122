"""Explanation of undetermined combinations of unknowns, and names of shared unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import by_key
from photogram.errors import RankError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import listed
from photogram.network.block import Block, flown_by
from photogram.network.geometry import photo_axes, viewing_directions
from photogram.network.motion import on_shared, scanners
from photogram.network.observations import moments
from photogram.network.trajectories import Coefficient, Spline, Trajectory
from photogram.network.unknowns import Unknown
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import _photocore

_Combination = tuple[
    tuple[int, ...], tuple[int, ...], tuple[int, ...], tuple[tuple[int, int], ...], tuple[str, ...]
]
"""Photos, cameras, shared unknowns, camera parameters and pose components that vary together."""

_DISTANCES = frozenset({"c", "f", "fx", "fy"})
_POINTS = frozenset({"xp", "yp", "cx", "cy"})
_DECENTRING = frozenset({"P1", "P2", "p1", "p2", "B1", "B2"})
_AFFINITY = frozenset({"b1", "b2"})
_OF_RING = frozenset({"b1", "yp", "cy", "fx", "fy"})
"""Parameters that photos on a ring, not rotated about their axes, cannot separate from c or each other."""
_ALONG = 0.8  # Minimum cosine of the angle between the view and a translation along it
_PARALLEL = 0.99  # Minimum cosine of the angle between parallel views
_UPRIGHT = 0.05  # Maximum sine for which the x axes of all photos are perpendicular to one direction
MOST = 40  # Maximum number of lines of a message
_ONE_PLACE = 1e-9  # Stations with a smaller difference relative to their coordinates coincide
_ON_LINE = 1e-3  # Points with a smaller ratio of spreads across and along a line are collinear


@dataclass(frozen=True)
class Setting:
    """Geometry of the photos of a block, to explain undetermined unknowns."""

    photos: int = 0
    parallel: bool = False  # Whether the views of all photos are about parallel
    upright: bool = False  # Whether the x or the y axes of all photos are perpendicular to one direction
    control: bool = False  # Whether any coordinate of a point is control
    heights: bool = True  # Whether any height of a point or photo is known
    on_line: bool = False  # Whether all known points and photos are on one straight line


def setting_of(block: Block) -> Setting:
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


def in_one_place(block: Block, photos: Sequence[int]) -> bool:
    """Return whether photos were all taken from one position."""
    stations = block.photo_positions[list(photos)]
    if len(stations) < 2 or (on_shared(block) | scanners(block))[list(photos)].any():
        return False
    return bool(np.ptp(stations, axis=0).max() <= _ONE_PLACE * max(1.0, np.abs(stations).max()))


def undetermined_combinations(
    block: Block,
    combinations: list[_photocore.CombinationRow],
    unknowns: Sequence[Unknown] | None = None,
) -> RankError:
    """Return the error that names and explains undetermined combinations.

    `unknowns` are the shared unknowns of the combinations, if they are not the unknowns of the block.
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
    distinct, at = sorted(set(rows)), setting_of(block)
    lines, causes, whats = list[str](), list[Phrase | None](), dict[str, None]()
    for combination in distinct:
        of, by, others, *_ = combination
        cause = _cause(block, combination, at, common)
        moved = _moved(block, of, by, named_unknowns(block, [common[row] for row in others]))
        lines.append(f"  {rows.count(combination)}: {moved}")
        lines += [f"    {cause}"] if cause else []
        causes.append(cause)
        whats[str(cause or moved)] = None
    if len(lines) >= MOST:
        lines = [*lines[: MOST - 1], f"  ... ({len(lines) - MOST + 1})"]
    if not np.isfinite(block.point_sd).any() and not any(causes):
        weighted = bool(np.isfinite(block.photo_position_sd).any())
        remedy = "large-sd" if weighted else "trajectories" if flown_by(block) else "photos"
        lines.append(f"  {phrase(f'adjust.no-datum.{remedy}')}")
    message = phrase("adjust.undetermined", n=len(rows), lines="\n".join(["", *lines]))
    return RankError(message, names, point_names, camera_names, "; ".join(whats))


def _moved(block: Block, photos: tuple[int, ...], cameras: tuple[int, ...], unknowns: list[str]) -> Phrase:
    """Return the photos, cameras and shared unknowns of a combination."""
    parts = [phrase("moved.cameras", cameras=[block.camera_names[row] for row in cameras])] if cameras else []
    if unknowns:
        parts.append(phrase("moved.unknowns", names=unknowns))
    if not photos:
        return phrase("moved", parts=parts)
    on = np.unique(block.image_points[np.isin(block.image_photos, photos)])
    whole = len(photos) == len(block.photo_ids) > 1
    return phrase(
        f"moved.{'all' if whole else 'photos'}",
        n=len(photos),
        photos=[block.photo_ids[photo] for photo in photos],
        points=phrase("moved.points", points=[block.point_ids[p] for p in on])
        if on.size
        else phrase("moved.none"),
        parts=parts,
    )


def _cause(block: Block, combination: _Combination, at: Setting, common: Sequence[Unknown]) -> Phrase | None:
    """Return parameters and pose components with cause and remedy; None if the cause is unknown."""
    photos, cameras, others, moved, poses = combination
    if not moved:
        kinds = {common[row].KIND for row in others}
        return None if cameras else _of_unknowns(block, kinds, len(photos), at)
    by_camera = by_key((camera, block.cameras[camera].names[k]) for camera, k in moved)
    parts = [
        phrase("moved.parameters", names=names, camera=block.camera_names[camera])
        for camera, names in by_camera.items()
    ]
    parts += [phrase(f"moved.{part}") for part in poses]
    cause = in_words({name for names in by_camera.values() for name in names}, set(poses), at)
    return phrase("weak.cause" if cause else "weak.parts", parts=parts, cause=cause)


def _of_unknowns(block: Block, kinds: set[str], photos: int, at: Setting) -> Phrase | None:
    """Return the cause if shifts, drifts, motions or collinear control leave unknowns free."""
    coefficients = kinds & {"position coefficient", "rotation coefficient"}
    if coefficients and kinds & {"readout", "clock"}:
        return phrase("weak.readout" if "readout" in kinds else "weak.clock")
    # Control or additional observations may determine the datum.
    if coefficients and coefficients == kinds and (at.control or block.observations):
        return phrase("weak.motion" if len(coefficients) == 2 else "weak.coefficients")
    if kinds == {"lever arm", "shift"}:
        return phrase("weak.lever-arm")
    if "drift" in kinds:
        return phrase("weak.drift")
    whole = photos == at.photos > 0
    if whole and not kinds and at.control and not at.heights:
        return phrase("weak.heights")
    return phrase("weak.roll") if whole and at.on_line else None


def weak_parameters(block: Block, solution: _photocore.BlockSolution) -> list[tuple[int, int]]:
    """Return the cameras and parameters of the weakest combination."""
    if block.photo_cameras is None:
        return list(solution.weak_cameras)
    cameras = block.photo_cameras.tolist()
    own = [(cameras[photo], unknown - 6) for photo, unknown in solution.weak if unknown >= 6]
    return [*own, *solution.weak_cameras]


def weak_in_words(block: Block, solution: _photocore.BlockSolution) -> Phrase | None:
    """Return the cause of the weakest combination; see :func:`in_words`."""
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
    # Far along this direction others hardly move; free parameters that fit it belong to it.
    named = [camera for camera in block.cameras if names & set(camera.names)]
    free = {
        name
        for each in named
        for name, sd in zip(each.names, each.deviations, strict=True)
        if np.isinf(sd) and name in _OF_RING
    }
    depths = phrase("weak.depths") if names <= _DISTANCES and poses else None
    return _of_setting(names | free, at) or in_words(names, poses, at) or depths


def in_words(names: set[str], poses: set[str], setting: Setting | None = None) -> Phrase | None:
    """Explain why camera parameters and pose components cannot be separated, with a remedy.

    `poses` contains `along`, `across`, `tilt`, `swing`. `setting` is None if it is unknown.
    """
    at = setting or Setting()
    radial = {name for name in names if name[0] in "KkA" and name[1:].isdigit()}
    if radial and radial == names and not poses:
        return phrase("weak.radial")
    if names and names <= _DISTANCES | _POINTS | _AFFINITY and (cause := _of_setting(names, at)):
        return cause
    vertical = at.parallel and at.control
    cases = {
        "weak.height": names <= _DISTANCES and (poses == {"along"} or vertical),
        "weak.scale": names <= _DISTANCES and poses >= {"along", "across"},
        f"weak.point{'.parallel' if vertical else ''}": names <= _POINTS and poses & {"across", "tilt"},
        "weak.decentring": names <= _POINTS | _DECENTRING and names & _DECENTRING and names & _POINTS,
        "weak.distance-terms": names <= _DISTANCES | radial and radial and names & _DISTANCES,
        "weak.affinity": "b1" in names and not names - _DISTANCES - {"b1"},
        "weak.shear": names == {"b2"} and "swing" in poses,
    }
    return next((phrase(code) for code, holds in cases.items() if holds), None)


def _of_setting(names: set[str], at: Setting) -> Phrase | None:
    """Return the cause if viewing directions leave camera parameters free."""
    if at.photos == 2:
        return phrase("weak.two-photos")
    if at.parallel and not at.control:
        return phrase("weak.parallel")
    ring = at.upright and not at.parallel and names & _OF_RING
    return phrase("weak.ring") if ring else None


def named_unknowns(block: Block, unknowns: Sequence[Unknown]) -> list[str]:
    """Name shared unknowns once; coefficients by trajectory and, for splines, by time."""
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
    """Return the name of a trajectory with the times of its coefficients; empty if not concerned."""
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


def beyond_trajectory(block: Block, photo: int, points: Sequence[int], seconds: Sequence[float]) -> Phrase:
    """Return the message on a time beyond the reach of its trajectory.

    Records on trajectories follow the photos. `points` contains the point of the image, if any. `seconds` are
    the time and the reach of the trajectory, from its origin.
    """
    if photo < len(block.photo_ids):
        name = block.photo_ids[photo]
        trajectories = zip(block.timed, block.trajectories, strict=True)
        trajectory = next(on for own, on in trajectories if own.photo == name)
        subject = phrase("named.photo", photo=name)
        if points:
            subject = phrase("named.image", point=block.point_ids[points[0]], photo=name)
    else:
        record = moments(block.observations)[photo - len(block.photo_ids)]
        trajectory = record.trajectory
        subject = phrase("adjust.record", name=record.name)
    time, first, last = (trajectory.origin + second for second in seconds)
    fields = {"subject": subject, "trajectory": trajectory.name, "time": time, "first": first, "last": last}
    return phrase("adjust.beyond-trajectory", **fields)
