"""In which order the corners of each picture are listed, by how they fit the board and from which side."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.targets.first_camera import MAX_VIEW_MISFIT, adjusted_views, rays_of
from photogram.targets.sightings import (
    CORNER_ORDERS,
    Sightings,
    angles_apart,
    centres,
    poses,
    ray_homographies,
)
from photogram.words import phrase

MIN_MISFIT_RAD = 1e-6
EQUAL_MISFIT_RATIO = 1.5  # misfit over the best misfit of an order that is as good


def rays_shown(seen: Sightings, of_cameras: Indices, cameras: list[Camera]) -> Indices:
    """Return (P,) how many corners of each picture have rays in its camera, which is one of `cameras`."""
    there = np.isfinite(_rays(seen, of_cameras, cameras)).all(axis=2)
    return np.asarray(np.count_nonzero(there, axis=1))


def _rays(seen: Sightings, of_cameras: Indices, cameras: list[Camera]) -> Floats:
    """Return (P, n, 3) rays of pictures, those of each by its camera."""
    found = np.full((*seen.xy.shape[:2], 3), np.nan)
    for k, camera in enumerate(cameras):
        own = of_cameras == k
        found[own] = rays_of(camera, seen.xy[own])
    return found


@dataclass(frozen=True, eq=False)
class Pictures:
    """P pictures with the cameras that took them."""

    seen: Sightings  # What they show
    names: list[str]  # P names
    of_cameras: Indices  # (P,) which camera took each
    cameras: list[Camera]  # The cameras, with their first values
    usable: Bools  # (P,) whether a picture has corners enough; others have no rays

    def poses(self, orders: Indices) -> Floats:
        """Return (P, 4, 4) poses board -> camera with corners listed in (P,) orders; NaN where unknown."""
        rows = np.flatnonzero(self.usable)
        seen = self.seen.of(rows).listed(orders[rows])
        found = np.full((len(orders), 4, 4), np.nan)
        rays = _rays(seen, self.of_cameras[rows], self.cameras)
        found[rows] = poses(ray_homographies(seen.coordinates, rays))
        return found

    def adjusted(self, orders: Indices, fits: Bools) -> Floats:
        """Return these poses adjusted with the cameras held, of (P,) pictures that fit."""
        found, seen = self.poses(orders), self.seen.listed(orders)
        for k, camera in enumerate(self.cameras):
            own = (self.of_cameras == k) & fits
            held = camera.replace(sd=0.0, knot_sd=None)
            done = adjusted_views(held, seen.of(own), found[own]) if own.any() else None
            if done is not None:
                found[own] = done.poses
        return found

    def ordered(self) -> tuple[Indices, Bools, list[Message]]:
        """Return (P,) in which order the corners of each picture are listed, whether they fit, and remarks.

        That of their numbers is kept where a picture fits as well as most do, and sees the board from the
        side that most see: the front, x to the right and y down, where none says it. Else the first order
        is taken of which both is true.
        """
        misfit, front = self._tried()
        best = misfit.min(axis=1, keepdims=True)
        limit = self._limit(misfit)
        fits = (misfit <= limit) & (misfit <= np.maximum(EQUAL_MISFIT_RATIO * best, MIN_MISFIT_RAD))
        fits[:, 0] |= misfit[:, 0] <= limit
        side = 1.0 if front[fits[:, 0], 0].sum() > 0 else -1.0
        right = fits & (front == side)
        orders = np.zeros(len(self.usable), dtype=np.int64)
        orders[self.usable] = np.argmax(right, axis=1)
        fit = np.zeros(len(self.usable), dtype=bool)
        fit[self.usable] = fits.any(axis=1)
        return orders, fit, self._told(orders, fits, right)

    def _tried(self) -> tuple[Floats, Floats]:
        """Return how usable pictures fit in each order, radians, and then the sign of z of its camera."""
        rows, listings = np.flatnonzero(self.usable), self.seen.listings
        misfit = np.full((len(rows), len(listings.points)), np.inf)
        front = np.full(misfit.shape, -1.0)
        for order in listings.shapes:
            misfit[:, order], front[:, order] = self._in_order(order, rows)
        odd = misfit[:, 0] > self._limit(misfit)
        odd |= front[:, 0] != (1.0 if front[~odd, 0].sum() > 0 else -1.0)
        others = {*range(len(listings.points))} - {*listings.shapes} if odd.any() else ()
        for order in others:
            misfit[odd, order], front[odd, order] = self._in_order(order, rows[odd])
        return misfit, front

    def _in_order(self, order: int, rows: Indices) -> tuple[Floats, Floats]:
        """Return the same of some pictures in one order."""
        seen = self.seen.of(rows).listed(np.full(len(rows), order))
        rays = _rays(seen, self.of_cameras[rows], self.cameras)
        found = ray_homographies(seen.coordinates, rays)
        misfit = np.nanmedian(angles_apart(seen.coordinates, rays, found), axis=1)
        if not seen.listings.one_sided:
            return misfit, np.full(len(rows), -1.0)
        return misfit, np.sign(centres(poses(found))[:, 2])

    @staticmethod
    def _limit(misfit: Floats) -> float:
        return max(MAX_VIEW_MISFIT * float(np.median(misfit.min(axis=1))), MIN_MISFIT_RAD)

    def _told(self, orders: Indices, fits: Bools, right: Bools) -> list[Message]:
        """Return remarks on pictures whose corners are not listed in the order of the board."""
        names = np.array(self.names)[self.usable]
        own = orders[self.usable]
        mirrored = fits.any(axis=1) & (~right.any(axis=1) | (fits[:, 0] & (own > 0)))
        other = right.any(axis=1) & ~mirrored
        remarks = []
        if (bad := ~fits.any(axis=1)).any():
            fields = {"names": names[bad].tolist(), "factor": MAX_VIEW_MISFIT}
            remarks.append(phrase("targets.odd-orders", **fields))
        for which, code in ((mirrored, "targets.mirrored-order"), (other & (own > 0), "targets.other-order")):
            for order in np.unique(own[which]).tolist():
                fields = {"names": names[which & (own == order)].tolist(), "order": CORNER_ORDERS[order]}
                remarks.append(phrase(code if order else "targets.mirrored", **fields))
        if len(own) > 1 and other.all() and (own > 0).all():
            remarks.append(phrase("targets.all-orders"))
        return [Message(remark) for remark in remarks]
