"""What the terms of a lens beside the radial ones do to image positions, on a grid.

Decentring, affinity and shear, the sets of Ebner and Gruen, thin prisms: with the terms p, their partials J
at a position and the block Q of their cofactors, the vector there has the covariance sigma0^2 J Q J'.
"""

from __future__ import annotations

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.results.cameras import AdjustedCamera
from photogram.results.distortion import INTERIOR, RADIAL, own_images
from photogram.results.result import Result

__all__ = ["LensField", "lens_field"]

GRID = 9
"""Positions along either side of the observed part of the image."""


@dataclass(frozen=True, eq=False)
class LensField:
    """Vectors at n positions, in the unit of image coordinates.

    Attributes
    ----------
    names
        The terms.
    positions
        (n, 2) image positions.
    vectors
        (n, 2) what the terms add: to measured coordinates where the lens is backward, else to ideal ones.
    covariances
        (n, 2, 2) of the vectors.
    """

    names: tuple[str, ...]
    positions: Floats
    vectors: Floats
    covariances: Floats

    @property
    def largest(self) -> int:
        """Where the longest vector is."""
        return int(np.argmax(np.hypot(*self.vectors.T)))


def lens_field(result: Result, camera: AdjustedCamera) -> LensField | None:
    """Return the vectors of a camera; None without such terms, or without images."""
    names = tuple(
        name
        for k, name in enumerate(camera.names)
        if name not in INTERIOR | camera.camera.constants
        and not RADIAL.fullmatch(name)
        and (camera.values[k] != 0 or k in camera.estimated)
    )
    xy = own_images(result, camera)
    if not names or not len(xy):
        return None
    sides = [np.linspace(low, high, GRID) for low, high in zip(xy.min(axis=0), xy.max(axis=0), strict=True)]
    positions = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    own = camera.camera
    rays = None if own.direction == "backward" else own.rays(positions)

    def at(changes: dict[str, float]) -> Floats:
        return _places(own.replace(parameters={**own.parameters, **changes}), positions, rays)

    partials = np.empty((len(positions), 2, len(names)))
    rows = [camera.names.index(name) for name in names]
    for column, (name, k) in enumerate(zip(names, rows, strict=True)):
        step = 0.01 * (camera.sd[k] or abs(camera.values[k]))
        value = own.parameters[name]
        partials[:, :, column] = (at({name: value + step}) - at({name: value - step})) / (2 * step)
    return LensField(
        names=names,
        positions=positions,
        vectors=at({}) - at(dict.fromkeys(names, 0.0)),
        covariances=np.einsum(
            "nai,ij,nbj->nab", partials, camera.covariance[np.ix_(rows, rows)], partials, optimize=True
        ),
    )


def _places(camera: Camera, positions: Floats, rays: Floats | None) -> Floats:
    """Return corrected positions, or the images of rays."""
    if rays is None:
        return _photocore.camera_correct(camera.model, camera.values, positions)
    return camera.project(rays)
