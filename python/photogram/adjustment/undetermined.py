"""Combinations of unknowns that the observations leave undetermined, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.errors import RankError
from photogram.messages import listed
from photogram.network.block import Block
from photogram.network.geometry import viewing_directions

if TYPE_CHECKING:
    from photogram import _photocore

__all__ = ["in_words", "undetermined_combinations", "weak_in_words"]

_DISTANCES = frozenset({"c", "f", "fx", "fy"})
_POINTS = frozenset({"xp", "yp", "cx", "cy"})
_DECENTRING = frozenset({"P1", "P2", "p1", "p2", "B1", "B2"})
_ALONG = 0.8
"""Cosine of the angle between the view and an axis that is moved along it."""
_PARTS = {
    "along": "flying heights (positions along the view)",
    "across": "positions across the view",
    "tilt": "tilts",
    "swing": "turns about the view",
}


def undetermined_combinations(block: Block, combinations: list[_photocore.CombinationRow]) -> RankError:
    """Name the photos, points and cameras of undetermined combinations, and what they are."""
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
    for each in sorted(set(rows)):
        of, by, others, moved, poses = each
        lines.append(f"  {rows.count(each)} moving {_moved(block, of, by, others)}")
        if moved:
            lines.append(f"    {_said(block, moved, poses)}")
    if not np.isfinite(block.point_sd).any():
        weighted = np.isfinite(block.photo_position_sd).any()
        remedy = (
            "the standard deviations of the photos are too large to give a datum in double precision"
            if weighted
            else "standard deviations for the positions and attitudes of photos would give a datum"
        )
        lines.append(f"  there is no control; {remedy}")
    return RankError("\n".join(lines), names, point_names, camera_names)


def _moved(block: Block, photos: tuple[int, ...], cameras: tuple[int, ...], unknowns: tuple[int, ...]) -> str:
    """Say which photos, cameras and common unknowns a combination moves."""
    of_cameras = listed([block.camera_names[camera] for camera in cameras])
    others = listed([block.unknowns[row].title for row in unknowns])
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


def _said(block: Block, moved: tuple[tuple[int, int], ...], poses: tuple[str, ...]) -> str:
    """Name parameters and parts of poses, then what that is."""
    by_camera: dict[int, list[str]] = {}
    for camera, k in moved:
        by_camera.setdefault(camera, []).append(block.cameras[camera].names[k])
    parts = [f"{', '.join(names)} of {block.camera_names[camera]}" for camera, names in by_camera.items()]
    parts += [_PARTS[part] for part in poses]
    words = in_words({name for names in by_camera.values() for name in names}, set(poses))
    return " with ".join(parts) + (f": {words}" if words else "")


def weak_in_words(block: Block, solution: _photocore.BlockSolution) -> str:
    """Say what the combination is that no step could follow to its end; see :func:`in_words`."""
    names = {block.cameras[camera].names[k] for camera, k in solution.weak_cameras}
    if block.photo_cameras is not None:
        cameras = block.photo_cameras.tolist()
        own = [(cameras[photo], unknown - 6) for photo, unknown in solution.weak if unknown >= 6]
        names |= {block.cameras[camera].names[k] for camera, k in own}
    if not names:
        return ""
    views = viewing_directions(
        solution.photo_positions, solution.photo_attitudes, photo_to_ground=block.photo_to_ground
    )
    poses = set()
    for photo, unknown in solution.weak:
        if unknown < 3:
            poses.add("along" if abs(views[photo, unknown]) > _ALONG else "across")
        elif unknown < 6:
            poses.add("swing" if unknown == 5 else "tilt")
    return in_words(names, poses)


def in_words(names: set[str], poses: set[str]) -> str:
    """Return what parameters of cameras and parts of poses cannot be told apart, and what would help.

    Parameters
    ----------
    names
        The parameters.
    poses
        `along`, `across`, `tilt`, `swing`.

    Returns
    -------
    Nothing for what has no name.
    """
    radial = {name for name in names if name[0] in "KkA" and name[1:].isdigit()}
    if radial and radial == names and not poses:
        return "radial terms among each other, which is harmless: the curve is determined; fewer terms do"
    if names <= _DISTANCES and poses == {"along"}:
        return (
            "principal distance and flying height of all photos: convergent photos, relief, observed"
            " positions or a second flying height tell them apart"
        )
    if names <= _DISTANCES and poses >= {"along", "across"}:
        return "principal distance and scale of the network: a distance or control tells them apart"
    if names <= _POINTS and poses & {"across", "tilt"}:
        return (
            "principal point and position or tilt of all photos: relief, convergent photos or, where points"
            " are unknown, photos turned by 90 or 180 degrees about their axes tell them apart"
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
