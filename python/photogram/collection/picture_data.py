"""Data for the figures of an adjusted collection."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.collection.parameters import POSE
from photogram.network.cameras import Camera
from photogram.plots.picture_data import Correlated, Curve, Curves, Plan
from photogram.results.distortion import RADIAL, added_along, curve_deviations, radial_curve, radial_part
from photogram.results.picture_data import PicturedNetwork
from photogram.show.page import about

if TYPE_CHECKING:
    from photogram.collection import AdjustedCollection

BEYOND = 1.1  # Extent of distortion curves relative to the maximum observed radius
ROWS = 51  # Number of radii of a curve
SHOWN = 60  # Maximum number of photos with individual curves


class PicturedCollection(PicturedNetwork):
    """Figure data of an adjusted collection, in which each photo has its own camera."""

    result: AdjustedCollection

    title = ""  # Collections are untitled

    @cached_property
    def plan(self) -> Plan:
        """The network; a photo with P = R X + t is at -R' t."""
        result = self.result
        rotations = _photocore.vector_rotations(np.ascontiguousarray(result.photo_parameters[:, :3]))
        used = result.used_points
        given = np.isfinite(result.point_given_sd).any(axis=1) & used
        return Plan(
            axes=("X", "Y", "Z"),
            unit="",
            photo_ids=result.given.photo_ids,
            photos=-np.einsum("pji,pj->pi", rotations, result.photo_parameters[:, 3:6]),
            point_ids=result.given.point_ids,
            points=np.where(used[:, np.newaxis], result.point_positions, np.nan),
            rays=result.point_rays,
            kinds=np.where(given, "control", "pass"),
            differences=-result.point_residuals,
        )

    @property
    def poses(self) -> Floats:
        """Cofactors of stations and rotations about the photo axes, from w and t of P = R(w) X + t.

        With w and t, a photo far from the origin would seem badly determined.
        """
        parameters, cofactors = self.result.photo_parameters, super().poses
        vectors = np.ascontiguousarray(parameters[:, :3])
        matrices, turns = _photocore.attitudes_from_numbers("rotation_vector_to_photo", vectors, np.eye(3))
        # The station is -A t; A changes to A (I + [rho]).
        partials = np.zeros(cofactors.shape)
        partials[:, :3, :3] = matrices @ np.cross(parameters[:, np.newaxis, 3:6], turns, axisb=1, axisc=1)
        partials[:, :3, 3:] = -matrices
        partials[:, 3:, :3] = turns
        return np.asarray(partials @ cofactors @ partials.transpose(0, 2, 1))

    def covariances(self, points: Indices) -> Floats:
        """Return (k, 3, 3) covariances of points along the axes of the plan."""
        return np.asarray(self.result.point_covariances[points])

    @cached_property
    def footprints(self) -> Floats:
        """No footprints, because the vertical is unknown."""
        return np.empty((0, 1, 3))

    @cached_property
    def cameras(self) -> tuple[Indices, Sequence[str], bool]:
        """One common frame for the cameras of all photos."""
        photos = len(self.result.photo_parameters)
        together = np.zeros(photos, dtype=np.int64)
        return together, [about("cameras.all", n=photos)], self._camera(0).image_y == "down"

    @cached_property
    def correlations(self) -> list[Correlated]:
        """Medians over all photos of the correlations between camera parameters."""
        result = self.result
        own = np.arange(len(POSE), len(result.collection.parameters))
        free = own[(result.photo_given_sd[:, own] > 0).all(axis=0)]
        blocks = result.photo_cofactors[:, free[:, np.newaxis], free]
        sd = np.sqrt(np.diagonal(blocks, axis1=1, axis2=2))
        with np.errstate(invalid="ignore", divide="ignore"):
            tables = blocks / (sd[:, :, np.newaxis] * sd[:, np.newaxis])
        good = np.isfinite(tables).all(axis=(1, 2))
        if len(free) < 2 or not good.any():
            return []
        parameters = [result.collection.parameters[k] for k in free]
        remark = about("cameras.medians", n=int(good.sum()))
        return [Correlated("cameras", parameters, np.median(tables[good], axis=0), remark)]

    @cached_property
    def distortion(self) -> list[Curves]:
        """Distortion curves: some photos faintly, and the photo with median distortion."""
        result = self.result
        model, values = result.collection.camera, result.photo_parameters[:, len(POSE) :]
        names = result.collection.parameters[len(POSE) :]
        terms = [k for k, name in enumerate(names) if RADIAL.fullmatch(name)]
        used = np.flatnonzero(result.photo_images > 0)
        if not terms or not len(used) or not values[:, terms].any():
            return []
        radii = np.linspace(0.0, BEYOND * self._reach, ROWS)
        chosen = used[:: -(-len(used) // SHOWN)]
        curves = np.array([added_along(self._camera(photo), radii) for photo in chosen.tolist()])
        good = np.isfinite(curves).all(axis=1)
        if not good.any():
            return []
        chosen, curves = chosen[good], curves[good]
        middle = int(np.argsort(curves[:, -1])[len(curves) // 2])
        photo = int(chosen[middle])
        own = slice(len(POSE), None)
        covariance = result.photo_covariances[photo][own, own]
        _, partials = radial_curve(self._camera(photo), terms, radii)
        band = curve_deviations(covariance, terms, partials)
        return [
            Curves(
                camera=about("cameras.curves", n=len(chosen), all=len(used), model=model, photo=photo),
                unit="px",
                radii=radii,
                observed=self._reach,
                curves=[Curve("", curves[middle], {"curve": band} if np.isfinite(band).all() else {})],
                others=curves,
            )
        ]

    @property
    def _reach(self) -> float:
        """Radius from the image centre that contains 99 % of the image points."""
        xy = self.images.xy
        middle = np.median(xy, axis=0) if self.images.down else np.zeros(2)
        return float(np.quantile(np.hypot(*(xy - middle).T), 0.99))

    def _camera(self, photo: int) -> Camera:
        collection = self.result.collection
        values = self.result.photo_parameters[photo, len(POSE) :].tolist()
        given = dict(zip(collection.parameters[len(POSE) :], values, strict=True))
        return radial_part(Camera(collection.camera, given))
