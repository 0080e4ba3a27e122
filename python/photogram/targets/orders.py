"""In which order the corners of each picture are listed, by how they fit the board and from which side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.messages import Message, listed
from photogram.network.cameras import Camera
from photogram.targets.families import POOR, misfits, rays_of
from photogram.targets.homographies import centres, poses, ray_homographies
from photogram.targets.sightings import LISTED, Sightings

__all__ = ["Pictures"]

ROUNDING = 1e-6
"""Radians: pictures that fit to this fit."""
CLEAR = 1.5
"""What the misfit of an order may be over that of the best, to be taken for as good."""


@dataclass(frozen=True, eq=False)
class Pictures:
    """P pictures with the cameras that took them.

    Attributes
    ----------
    seen
        What they show.
    names
        P names.
    of_cameras
        (P,) which camera took each.
    cameras
        The cameras, with their first values.
    usable
        (P,) whether a picture has corners enough; others have no rays.
    """

    seen: Sightings
    names: list[str]
    of_cameras: Indices
    cameras: list[Camera]
    usable: Bools

    def poses(self, orders: Indices) -> Floats:
        """Return (P, 4, 4) poses board -> camera with corners listed in (P,) orders; NaN where unknown."""
        own = self.seen.listed(orders)
        found = np.full((len(orders), 4, 4), np.nan)
        found[self.usable] = poses(ray_homographies(own.coordinates, self._rays(own)[self.usable]))
        return found

    def ordered(self) -> tuple[Indices, list[Message]]:
        """Return (P,) in which order the corners of each picture are listed, and what is to be said of it.

        That of their numbers is kept where a picture fits as well as most do, and sees the board from the
        side that most see: the front, x to the right and y down, where none says it. Else the first order
        is taken of which both is true.
        """
        misfit, front = self._tried()
        best = misfit.min(axis=1, keepdims=True)
        limit = max(POOR * float(np.median(best)), ROUNDING)
        fits = (misfit <= limit) & (misfit <= np.maximum(CLEAR * best, ROUNDING))
        fits[:, 0] |= misfit[:, 0] <= limit
        side = 1.0 if front[fits[:, 0], 0].sum() > 0 else -1.0
        right = fits & (front == side)
        orders = np.zeros(len(self.usable), dtype=np.int64)
        orders[self.usable] = np.argmax(right, axis=1)
        return orders, self._told(orders, fits, right)

    def _rays(self, seen: Sightings) -> Floats:
        """Return (P, n, 3) rays, those of each picture by its camera."""
        found = np.full((*seen.xy.shape[:2], 3), np.nan)
        for k, camera in enumerate(self.cameras):
            own = (self.of_cameras == k) & self.usable
            found[own] = rays_of(camera, seen.xy[own])
        return found

    def _tried(self) -> tuple[Floats, Floats]:
        """Return how usable pictures fit in each order, radians, and then the sign of z of its camera."""
        count = len(self.seen.listings.points)
        misfit, front = (np.full((int(self.usable.sum()), count), -1.0) for _ in range(2))
        for order in range(count):
            own = self.seen.listed(np.full(len(self.usable), order))
            rays = self._rays(own)[self.usable]
            misfit[:, order] = misfits(own, rays)
            if self.seen.listings.one_sided:
                made = poses(ray_homographies(own.coordinates, rays))
                front[:, order] = np.sign(centres(made)[:, 2])
        return misfit, front

    def _told(self, orders: Indices, fits: Bools, right: Bools) -> list[Message]:
        """Return what is to be said of pictures whose corners are not listed as the board's are."""
        names = np.array(self.names)[self.usable]
        own = orders[self.usable]
        mirrored = fits.any(axis=1) & (~right.any(axis=1) | (fits[:, 0] & (own > 0)))
        other = right.any(axis=1) & ~mirrored
        told = []
        if (bad := ~fits.any(axis=1)).any():
            told.append(
                f"corners of {listed(names[bad].tolist())} fit the board more than {POOR:g} times worse than"
                " those of most pictures, in whatever order: some are probably not where they should be"
            )
        for order in np.unique(own[mirrored]).tolist():
            those = listed(names[mirrored & (own == order)].tolist())
            told.append(
                f"corners of {those} are mirrored, which those of a board that is seen cannot be; their rows"
                " or columns stand in a wrong order"
                + (f": taken for listed {LISTED[order]}" if order else "")
            )
        for order in np.unique(own[other & (own > 0)]).tolist():
            those = listed(names[other & (own == order)].tolist())
            told.append(f"corners of {those} were listed in another order: {LISTED[order]}")
        if len(own) > 1 and other.all() and (own > 0).all():
            told.append("no picture lists its corners as the board does: are its columns its rows?")
        return [Message(each) for each in told]
