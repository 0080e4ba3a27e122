"""What the functions of all networks need of an adjusted block."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.network.geometry import geographic_to_geocentric, lengths_of_units
from photogram.network.motion import scanners
from photogram.results.axes import TURNS, Determined, Terms, image_axes, point_axes
from photogram.show.quantity import Quantity

if TYPE_CHECKING:
    from photogram import Result


def block_terms(result: Result) -> Terms:
    """Return names and components of photos, points and images of a block."""
    block, axes = result.block, point_axes(result.block)
    lengths = None
    if block.geographic and len(result.photo_positions):
        lengths = lengths_of_units(result.photo_positions.mean(axis=0, keepdims=True), block.spheroid)[0]
    return Terms(
        photos=np.array(block.photo_ids, dtype=object),
        points=np.array(block.point_ids, dtype=object),
        photo_axes=(*axes, *TURNS),
        point_axes=axes,
        image_axes=image_axes(block.image_unit),
        photo_values=np.hstack([result.photo_positions, result.photo_attitudes]),
        layers={"Positions": slice(0, 3), "Attitudes": slice(3, 6)},
        parts={"position": slice(0, 3), "attitude_rad": slice(3, 6)},
        of_points=(
            Quantity(
                result.point_kinds[result.used_points],
                kind="name",
                name="kind",
                member="kind",
                about="what it is",
                head="Kind",
            ),
        ),
        kinds=result.kinds.values(),
        observation_rows=np.array(
            [row for rows, _ in block.observation_groups for row in rows], dtype=np.int64
        ),
        lengths=lengths,
        linear_unit=block.linear_unit,
        split=True,
    )


def determined(result: Result) -> Determined:
    """Return positions and poses of a block with their cofactors, geocentric if it is geographic."""
    block, points, stations = result.block, result.point_positions, result.photo_positions
    cofactors = result.point_cofactors
    if block.spheroid is not None:
        units = lengths_of_units(points, block.spheroid)
        cofactors = cofactors * units[:, :, np.newaxis] * units[:, np.newaxis, :]
        points, stations = (
            geographic_to_geocentric(np.array(each), block.spheroid) for each in (points, stations)
        )
    poses = result.photo_cofactors[:, :6, :6]
    ranks = (np.diagonal(poses, axis1=1, axis2=2) > 0).sum(axis=1)
    return Determined(stations, points, poses, ranks, cofactors, scanners(block))
