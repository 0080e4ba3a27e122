"""Geographic projects as formats of rectangular coordinates hold them: east, north and up of one place."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.intersection import intersected
from photogram.formats.plain.writing import attitude_matrices
from photogram.formats.project import Frame, Project
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block, refuse_passages, refuse_trajectories
from photogram.network.geometry import (
    Spheroid,
    geocentric_to_geographic,
    geographic_to_geocentric,
    lengths_of_units,
    local_frames,
)

__all__ = ["in_topocentric", "topocentric_remarks"]

ROUND = 1e-4
"""Degrees to which the origin is rounded; its height is 0."""


def in_topocentric(project: Project) -> Project:
    """Return a geographic project in the axes east, north and up of a place amid its photos.

    The rays are the same. Standard deviations stay along the local axes, which differ from those of the
    frame by the angle between the verticals; where a point is known in part, it is where its rays meet with
    the components that are known. Observations beside images stay behind.

    Raises
    ------
    InputError
        Photos on trajectories, whose tables are geocentric.
    """
    block = project.block
    if block.spheroid is None:
        return project
    refuse_trajectories(block, "a topocentric frame")
    refuse_passages(block, "a topocentric frame")
    origin, spheroid = _origin(block), block.spheroid
    axes = local_frames(origin)[0]
    middle = geographic_to_geocentric(origin, spheroid)[0]

    def carried(positions: Floats) -> Floats:
        found: Floats = (geographic_to_geocentric(positions, spheroid) - middle) @ axes.T
        return found

    def turned(positions: Floats, attitudes: Floats) -> Floats:
        local = axes @ local_frames(positions).transpose(0, 2, 1)
        matrices = local @ attitude_matrices(block.replace(photo_attitudes=attitudes))
        known = np.isfinite(matrices).all(axis=(1, 2))
        found = np.full_like(attitudes, np.nan)
        kind = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
        found[known] = Attitudes(matrices[known]).values(kind)  # type: ignore[arg-type]
        return found

    photos = block.photo_positions
    observed, angles = block.photo_positions_observed, block.photo_attitudes_observed
    made = block.replace(
        spheroid=None,
        observations=(),
        photo_positions=carried(photos),
        photo_attitudes=turned(photos, block.photo_attitudes),
        photo_positions_observed=None if observed is None else carried(observed),
        photo_attitudes_observed=None if angles is None else turned(photos, angles),
        photo_position_sd=block.photo_position_sd * lengths_of_units(photos, spheroid),
        point_positions=np.full_like(block.point_positions, np.nan),
        point_sd=np.full_like(block.point_sd, np.inf),
    )
    degrees = (float(np.degrees(origin[0, 1])), float(np.degrees(origin[0, 0])), 0.0)
    known = spheroid == Spheroid.wgs84() and block.linear_unit == "m"
    frame = Frame("topocentric", origin=degrees) if known else Frame()
    rectangular = project.replace(block=made.replace(frame=frame), frame=frame)
    given = np.isfinite(block.point_positions)
    some = np.flatnonzero(given.any(axis=1))
    whole = block.point_positions[some]
    partly = np.flatnonzero(~given[some].all(axis=1))
    if len(partly):
        meet = intersected(rectangular, some[partly]) @ axes + middle
        near = geocentric_to_geographic(np.where(np.isfinite(meet), meet, middle), spheroid)
        whole[partly] = np.where(given[some[partly]], whole[partly], near)
    positions, sd = made.point_positions.copy(), made.point_sd.copy()
    positions[some] = np.where(given[some], carried(whole), np.nan)
    sd[some] = block.point_sd[some] * lengths_of_units(whole, spheroid)
    starts = np.array(project.starts)
    there = np.isfinite(starts).all(axis=1)
    starts[there] = carried(starts[there])
    starts[~there] = np.nan
    block_made = rectangular.block.replace(point_positions=positions, point_sd=sd)
    return rectangular.replace(block=block_made, starts=starts)


def topocentric_remarks(project: Project) -> list[str]:
    """Return what is to be said of a geographic project that is written in rectangular coordinates."""
    block = project.block
    if block.spheroid is None:
        return []
    origin, unit = _origin(block), block.linear_unit
    up = local_frames(np.vstack([origin, block.photo_positions]))[:, 2]
    angle = math.degrees(float(np.arccos(np.clip(up[1:] @ up[0], -1, 1)).max())) * 60
    longitude, latitude = np.degrees(origin[0, :2])
    found = [
        f"longitude, latitude and height: written as {unit} east, north and up of latitude {latitude:.4f},"
        f" longitude {longitude:.4f}, height 0 on the ellipsoid {block.spheroid.a:.12g},"
        f" {block.spheroid.b:.12g}; verticals differ by up to {angle:.2g} minutes of arc from that, and"
        " standard deviations stay along them"
    ]
    return found + (["observations beside images"] if block.observations else [])


def _origin(block: Block) -> Floats:
    """Return (1, 3) the place amid the photos, on the ellipsoid."""
    middle = np.degrees(np.median(block.photo_positions[:, :2], axis=0))
    return np.array([[*np.radians(np.round(middle / ROUND) * ROUND), 0.0]])
