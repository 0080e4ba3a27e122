"""Contents of projects for writers: cameras, poses, control, intersected points, and lost parts."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.project import Frame, Project
from photogram.io.places import Failing
from photogram.messages import Message
from photogram.network.attitudes import angles_form, known_angles, known_matrices
from photogram.network.block import Block
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.directions import image_directions
from photogram.network.films import Scan
from photogram.network.motion import on_shared
from photogram.network.observations import Control, Position
from photogram.network.rays import meet_rays
from photogram.network.subset import kept_images
from photogram.words import Phrase, phrase


def known_cameras(block: Block) -> tuple[list[Camera], list[int]]:
    """Return cameras (also for principal distances), and the one of each photo."""
    if block.cameras:
        assert block.photo_cameras is not None
        cameras = [
            each if each.name else each.replace(name=name)
            for each, name in zip(block.cameras, block.camera_names, strict=True)
        ]
        return cameras, block.photo_cameras.tolist()
    distances = block.known_distances("the file").tolist()
    places = {each: row for row, each in enumerate(dict.fromkeys(distances))}
    cameras = [Camera("perspective", {"c": c}, name=f"camera {row}") for row, c in enumerate(places, 1)]
    return cameras, [places[each] for each in distances]


def attitude_matrices(block: Block) -> Floats:
    """Return (P, 3, 3) attitudes A of photos, photo to object; NaN if unknown."""
    return known_matrices(angles_form(block.photo_to_ground), block.photo_attitudes)


def correlated_control(block: Block) -> dict[str, Control]:
    """Return control with correlated coordinates by point name."""
    return {each.point: each for each in block.observations.of_type(Control)}


class KnownPoints(NamedTuple):
    """Control and check points of a project.

    `rows` are the k points of the block; `positions` and `sd` are (k, 3), NaN and infinite if unknown;
    `covariances` are (k, 3, 3), 0 if free; `checks` are (k,) the check points.
    """

    rows: list[int]
    positions: Floats
    sd: Floats
    covariances: Floats
    checks: Bools


def known_points(project: Project) -> KnownPoints:
    """Return control points, also correlated ones, and check points."""
    block, full = project.block, correlated_control(project.block)
    correlated = np.array([name in full for name in block.point_ids], dtype=bool)
    held = np.isfinite(block.point_sd).any(axis=1) | np.isfinite(block.point_positions).any(axis=1)
    rows = np.flatnonzero(correlated | held).tolist()
    checks = np.isin(rows, project.checks)
    positions, sd = block.point_positions[rows].copy(), block.point_sd[rows].copy()
    if block.point_check_sd is not None:
        given = block.point_check_sd[rows]
        sd = np.where(checks[:, np.newaxis] & np.isfinite(given), given, sd)
    covariances = np.where(np.isfinite(sd), sd, 0.0)[:, :, np.newaxis] ** 2 * np.eye(3)
    for k, row in enumerate(rows):
        if (each := full.get(block.point_ids[row])) is not None:
            positions[k], covariances[k], checks[k] = each.observed, each.precision, False
            sd[k] = np.sqrt(np.diag(each.precision))
    return KnownPoints(rows, positions, sd, covariances, checks)


def check_images(block: Block, title: str) -> None:
    """Reject image coordinates of films or line scanners."""
    scanned = [each.photo for each in block.passages if isinstance(each, Scan)]
    if scanned:
        raise InputError(phrase("format.film", title=title, photo=scanned[0]))
    lines = [each.photo for each in block.timed if each.lines is not None]
    if lines:
        raise InputError(phrase("format.scanner", photo=lines[0]))


def intersected(project: Project, points: Indices) -> Floats:
    """Return (k, 3) intersections of the rays of points; NaN without."""
    block = project.block
    if not len(points) or block.geographic:
        return np.full((len(points), 3), np.nan)
    places = np.full(len(block.point_ids), -1, dtype=np.int64)
    places[points] = np.arange(len(points))
    # The pose of a photo on a trajectory is only approximate.
    placed = ~on_shared(block)[block.image_photos]
    own = kept_images(block, np.flatnonzero((places[block.image_points] >= 0) & placed))
    rays = np.einsum("nij,nj->ni", attitude_matrices(block)[own.image_photos], image_directions(own))
    centres = block.photo_positions[own.image_photos]
    good: Bools = np.asarray(np.isfinite(np.hstack([rays, centres])).all(axis=1))
    return meet_rays(places[own.image_points[good]], len(points), centres[good], rays[good])


def complete_positions(project: Project) -> Floats:
    """Return (n, 3) known, approximate or intersected positions, else NaN."""
    found = project.positions()
    missing = np.flatnonzero(~np.isfinite(found).all(axis=1))
    found[missing] = intersected(project, missing)
    return found


def is_free(project: Project) -> bool:
    """Return whether only initial values define the datum of a project.

    Trajectories define it: their prior values refer to the frame of the project.
    """
    block = project.block
    return not (block.observations or block.timed or np.isfinite(block.photo_position_sd).any())


def carried(project: Project, by: tuple[float, Floats, Floats], frame: Frame, message: Message) -> Project:
    """Return a project transformed by scale, (3, 3) rotation, (3,) translation."""
    block = project.block
    scale, turn, shift = by
    return project.replace(
        block=block.replace(
            photo_positions=scale * block.photo_positions @ turn.T + shift,
            photo_attitudes=known_angles("omega_phi_kappa", turn @ attitude_matrices(block)),
            photo_to_ground=False,
        ),
        starts=scale * project.starts @ turn.T + shift,
        frame=frame,
        messages=(*project.messages, message),
    )


def chosen_model(
    place: Failing, names: Sequence[str], wanted: int | None, default: int, messages: list[Message]
) -> int:
    """Return the model of a file that the user requests, or a default; a message lists several models."""
    model = default if wanted is None else wanted
    if model >= len(names):
        raise place.error(phrase("format.models", n=len(names), model=model))
    if len(names) > 1:
        messages.append(Message(phrase("format.model-chosen", n=len(names), names=list(names), model=model)))
    return model


Count = Callable[[Project], int | np.integer | bool]


def _held(project: Project) -> int:
    return int(np.count_nonzero(np.isfinite(project.block.point_sd).any(axis=1)))


def _always(project: Project) -> bool:
    del project
    return True


_ABSENT: Mapping[str, Count] = {
    "names": _always,
    "deviations": _always,
    "points": _always,
    "frame": _always,
    "lenses": lambda project: any(each.model != "perspective" for each in known_cameras(project.block)[0]),
    "shared-cameras": _always,
    "unknowns": lambda project: any(each.deviations.any() for each in known_cameras(project.block)[0]),
    "control": lambda project: _held(project) + len(project.checks),
    "rigs": lambda project: len(project.block.mounts),
    "boards": lambda project: len(project.block.passages),
    "unposed": lambda project: np.count_nonzero(~known_poses(project.block)),
}
"""Functions that count the parts of a project that formats without a capability cannot contain."""
_PARTIAL: Mapping[str, tuple[str, Count]] = {
    "place": ("topocentric", lambda project: project.frame.kind != "topocentric"),
    "correlations": ("control", lambda project: len(correlated_control(project.block))),
    "gnss": ("gnss", lambda project: any(isinstance(each, Position) for each in project.block.observations)),
}
"""Capabilities with parts that no format with them can contain, and functions that count these parts."""


def lost(project: Project, holds: Collection[str]) -> list[Phrase]:
    """Return the parts of a project that a format with these capabilities cannot contain."""
    counts = {part: count(project) for part, count in _ABSENT.items() if part not in holds}
    counts |= {part: count(project) for part, (whole, count) in _PARTIAL.items() if whole in holds}
    kinds = {name: kind for name, kind in (("control", Control), ("GNSS", Position)) if name.lower() in holds}
    others = [each for each in project.block.observations if not isinstance(each, tuple(kinds.values()))]
    counts["observations"] = len(others)
    fields = {"frame": project.frame.phrase, "held": _held(project), "checks": len(project.checks)}
    fields["names"] = ["images", *kinds]
    return [phrase(f"lost.{part}", n=int(count), **fields) for part, count in counts.items() if count]
