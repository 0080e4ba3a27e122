"""Order of the corners of each image, from the fit to the board and its visible side."""

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
EQUAL_MISFIT_RATIO = 1.5  # largest misfit ratio of an order equivalent to the best


def rays_shown(seen: Sightings, of_cameras: Indices, cameras: list[Camera]) -> Indices:
    """Return (P,) numbers of corners of each image with rays in its camera."""
    there = np.isfinite(_rays(seen, of_cameras, cameras)).all(axis=2)
    return np.asarray(np.count_nonzero(there, axis=1))


def _rays(seen: Sightings, of_cameras: Indices, cameras: list[Camera]) -> Floats:
    found = np.full((*seen.xy.shape[:2], 3), np.nan)
    for k, camera in enumerate(cameras):
        own = of_cameras == k
        found[own] = rays_of(camera, seen.xy[own])
    return found


@dataclass(frozen=True, eq=False)
class Pictures:
    """P images with their cameras."""

    seen: Sightings  # Board observations in the images
    names: list[str]  # P names
    of_cameras: Indices  # (P,) camera of each image
    cameras: list[Camera]  # The cameras, with their initial values
    usable: Bools  # (P,) whether an image has enough corners; rays are computed only for these

    def poses(self, orders: Indices) -> Floats:
        """Return (P, 4, 4) poses board -> camera for corner orders (P,); NaN if unknown."""
        rows = np.flatnonzero(self.usable)
        seen = self.seen.of(rows).listed(orders[rows])
        found = np.full((len(orders), 4, 4), np.nan)
        rays = _rays(seen, self.of_cameras[rows], self.cameras)
        found[rows] = poses(ray_homographies(seen.coordinates, rays))
        return found

    def adjusted(self, orders: Indices, fits: Bools) -> Floats:
        """Return poses of images that fit (P,), adjusted with fixed cameras."""
        found, seen = self.poses(orders), self.seen.listed(orders)
        for k, camera in enumerate(self.cameras):
            own = (self.of_cameras == k) & fits
            held = camera.replace(sd=0.0, knot_sd=None)
            done = adjusted_views(held, seen.of(own), found[own]) if own.any() else None
            if done is not None:
                found[own] = done.poses
        return found

    def ordered(self) -> tuple[Indices, Bools, list[Message]]:
        """Return (P,) corner order of each image, whether it fits, and warnings.

        The numbered order is used if an image fits as well as most images do, and shows the same side as
        most. By default this is the front, x to the right and y down. Otherwise, the first order with both
        properties is used.
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
        """Return misfits (rad) of usable images by order, and z signs of their cameras."""
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
