"""Model of a project: intersection of rays, transformation, parts that a format cannot contain."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.block_contents import posed
from photogram.formats.plain.writing import attitude_matrices, known_cameras
from photogram.formats.project import Frame, Project
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.directions import image_directions
from photogram.network.motion import on_shared
from photogram.network.observations import Control, Observation, Position
from photogram.network.subset import kept_images
from photogram.words import Phrase, phrase

STEEPEST = 1e12  # Largest condition number of the normal equations of a point; larger ones mean parallel rays


def intersected(project: Project, points: Indices) -> Floats:
    """Return (k, 3) intersections of the rays of points; NaN without."""
    block = project.block
    found = np.full((len(points), 3), np.nan)
    if not len(points) or block.geographic:
        return found
    places = np.full(len(block.point_ids), -1, dtype=np.int64)
    places[points] = np.arange(len(points))
    # The pose of a photo on a trajectory is only approximate.
    placed = ~on_shared(block)[block.image_photos]
    rows = np.flatnonzero((places[block.image_points] >= 0) & placed)
    own = kept_images(block, rows)
    photos = own.image_photos
    rays = np.einsum("nij,nj->ni", attitude_matrices(block)[photos], image_directions(own))
    centres = block.photo_positions[photos]
    good: Bools = np.asarray(np.isfinite(np.hstack([rays, centres])).all(axis=1))
    across = np.eye(3) - rays[good, :, np.newaxis] * rays[good, np.newaxis, :]
    owner = places[own.image_points[good]]
    normal, right = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3))
    np.add.at(normal, owner, across)
    np.add.at(right, owner, np.einsum("nij,nj->ni", across, centres[good]))
    counts = np.bincount(owner, minlength=len(points))
    firm = np.flatnonzero(counts >= 2)
    firm = firm[np.linalg.cond(normal[firm]) < STEEPEST]
    found[firm] = np.linalg.solve(normal[firm], right[firm][..., np.newaxis])[..., 0]
    return found


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
    matrices = attitude_matrices(block)
    posed = np.isfinite(matrices).all(axis=(1, 2))
    angles = block.photo_attitudes.copy()
    angles[posed] = Attitudes(turn @ matrices[posed]).values("omega_phi_kappa")
    return project.replace(
        block=block.replace(
            photo_positions=scale * block.photo_positions @ turn.T + shift,
            photo_attitudes=angles,
            photo_to_ground=False,
        ),
        starts=scale * project.starts @ turn.T + shift,
        frame=frame,
        messages=(*project.messages, message),
    )


Count = Callable[[Project], int | np.integer | bool]


def _other_than(*kinds: type[Observation]) -> Count:
    return lambda project: sum(not isinstance(each, kinds) for each in project.block.observations)


def _kind(kind: type[Observation]) -> Count:
    return lambda project: sum(isinstance(each, kind) for each in project.block.observations)


_COUNTS: Mapping[str, Count] = {
    "control": lambda project: _held(project) + len(project.checks),
    "control-list": lambda project: _held(project) + len(project.checks),
    "correlations": _kind(Control),
    "gnss": _kind(Position),
    "all-observations": _other_than(),
    "observations": _other_than(Control, Position),
    "observations-and-gnss": _other_than(Control),
    "observations-and-control": _other_than(Position),
    "rigs": lambda project: len(project.block.mounts),
    "boards": lambda project: len(project.block.passages),
    "unposed": lambda project: np.count_nonzero(~posed(project.block)),
    "unplaced": lambda project: np.count_nonzero(~np.isfinite(complete_positions(project)).all(axis=1)),
    "unknowns": lambda project: any(each.deviations.any() for each in known_cameras(project.block)[0]),
    "lenses": lambda project: any(each.model != "perspective" for each in known_cameras(project.block)[0]),
    "place": lambda project: project.frame.kind != "topocentric",
    "features": lambda project: len(project.features),
    "trajectories": lambda project: len(project.block.timed),
    "moments": lambda project: sum(each.moment is not None for each in project.block.observations),
}
"""Functions that count parts of a project by type; other types apply to every project."""


def _held(project: Project) -> int:
    return int(np.count_nonzero(np.isfinite(project.block.point_sd).any(axis=1)))


def losses(project: Project, *kinds: str) -> list[Phrase]:
    """Return the types of parts of a project, with counts."""
    counts = {kind: int(_COUNTS[kind](project)) if kind in _COUNTS else 1 for kind in kinds}
    fields = {"frame": project.frame.phrase, "held": _held(project), "checks": len(project.checks)}
    return [phrase(f"lost.{kind}", n=count, **fields) for kind, count in counts.items() if count]
