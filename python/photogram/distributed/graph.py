"""Graph of a block: vertices of photos and shared unknowns, and edges between them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogram.arguments.types import Indices
from photogram.distributed.cut import Incidence, joined
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block, flown_by
from photogram.network.films import Scan
from photogram.network.observations import Observation


@dataclass(frozen=True, eq=False)
class Homes:
    """Home nodes of points, images and other observations, and (P,) `owners` of photos.

    A photo on a frame or trajectory belongs to the node of its representing photo.
    """

    owners: Indices
    points: Indices
    images: Indices
    observations: Indices


def vertices_of(block: Block) -> Indices:
    """Return (P,) representing photos: the frame, or the first photo on the trajectory."""
    moves = bool(block.mounts or block.timed)
    rows = {name: row for row, name in enumerate(block.photo_ids)} if moves else {}
    found = np.arange(len(block.photo_ids), dtype=np.int64)
    for each in block.mounts:
        found[rows[each.photo]] = rows[each.frame]
    first: dict[int, int] = {}
    for timed, trajectory in zip(block.timed, block.trajectories, strict=True):
        row = rows[timed.photo]
        found[row] = first.setdefault(id(trajectory), row)
    return found


def photos_of_unknowns(block: Block) -> dict[int, str]:
    """Return photos whose unknowns include shared unknowns, by object identity.

    Unknowns of a film belong to its photo, coefficients of a trajectory to its first photo. Unknowns of films
    of several photos remain shared unknowns. The same applies to all films if there are photos on frames
    (halves of joined scans) or trajectories.
    """
    found: dict[int, set[str]] = {}
    for each in () if block.mounts or flown_by(block) else block.passages:
        if isinstance(each, Scan):
            for own in (each.film.placement, each.film.size, each.film.bend):
                found.setdefault(id(own), set()).add(each.photo)
    found.pop(id(None), None)
    alone = {own: photos.pop() for own, photos in found.items() if len(photos) == 1}
    for timed, trajectory in zip(block.timed, block.trajectories, strict=True):
        for part in trajectory.coefficients:
            for coefficient in part:
                alone.setdefault(id(coefficient), timed.photo)
    return alone


def alone_of(block: Block) -> dict[int, str]:
    """Return the photos of unknowns that only they use, including reseau nodes.

    A reseau node is a separate block that images in its cells touch; it belongs to its photo.
    """
    found: dict[int, set[str]] = {}
    for each in block.passages:
        if isinstance(each, Scan) and each.film.pattern is not None:
            for own in each.film.pattern.weights:
                found.setdefault(id(own), set()).add(each.photo)
    alone = {own: photos.pop() for own, photos in found.items() if len(photos) == 1}
    return photos_of_unknowns(block) | alone


def photos_of(observation: Observation, alone: Mapping[int, str]) -> list[str]:
    """Return the photos that an observation touches, by pose or by unknowns of a single photo."""
    moment, photos, unknowns = observation.moment, observation.photos, observation.unknowns
    if moment is not None:
        # One coefficient represents all.
        photos, own = (), [part[0] for part in moment.trajectory.coefficients if part]
        unknowns = (*unknowns, *own)
    others = [alone[id(each)] for each in unknowns if id(each) in alone]
    return [*dict.fromkeys([*photos, *others])]


def incidence_of(block: Block) -> tuple[Incidence, Indices, Indices]:
    """Return the incidence of points and observations, and the edge of each of them.

    Points that are observed together are one edge, and remain in one node.
    """
    vertices = vertices_of(block)
    points = {name: row for row, name in enumerate(block.point_ids)} if block.observations else {}
    photos = {name: row for row, name in enumerate(block.photo_ids)} if block.observations else {}
    tied = [tuple(points[name] for name in each.points) for each in block.observations]
    edges = joined(len(block.point_ids), (each for each in tied if len(each) > 1))
    own_edges, others, of_observations, alone = [], [], [], alone_of(block)
    count = len(block.point_ids)
    for each, members in zip(block.observations, tied, strict=True):
        edge = int(edges[members[0]]) if members else count
        count += not members
        of_observations.append(edge)
        for name in photos_of(each, alone):
            own_edges.append(edge)
            others.append(int(vertices[photos[name]]))
    incidence = Incidence(
        np.concatenate([vertices[block.image_photos], np.array(others, dtype=np.int64)]),
        np.concatenate([edges[block.image_points], np.array(own_edges, dtype=np.int64)]),
        count,
    )
    return incidence, edges, np.array(of_observations, dtype=np.int64)


def shared_cameras(block: Block) -> Indices:
    """Return cameras with free or weighted parameters and several photos; they belong to the root.

    Cameras of photos on frames and trajectories also belong to the root.
    """
    if block.photo_cameras is None:
        return np.zeros(0, dtype=np.int64)
    photos = np.bincount(block.photo_cameras, minlength=len(block.cameras))
    mounted = {each.photo for each in block.mounts} | {each.photo for each in block.timed}
    rows = [row for row, name in enumerate(block.photo_ids) if name in mounted] if mounted else []
    photos[block.photo_cameras[rows]] += 1
    own = [row for row, each in enumerate(block.cameras) if photos[row] > 1 and not each.is_held]
    return np.array(own, dtype=np.int64)
