"""What pictures draw of an adjusted collection."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.collection.adjusted import AdjustedCollection
from photogram.collection.collection import POSE
from photogram.network.cameras import Camera
from photogram.plots.pictured import Correlated, Curve, Curves, Images, Pictured, Plan, pictured
from photogram.results.distortion import RADIAL, added_along, radial_part
from photogram.results.observed import tested_observations
from photogram.statistics.outliers import Observations

__all__ = ["PicturedCollection"]

BEYOND = 1.1
"""How far curves of distortion go on, of the largest observed radius."""
ROWS = 51
"""Radii of a curve."""
SHOWN = 60
"""Photos whose own curves are drawn at most."""


class PicturedCollection(Pictured):
    """What is drawn of an adjusted collection, whose photos have cameras of their own.

    Parameters
    ----------
    result
        The adjusted collection.
    """

    def __init__(self, result: AdjustedCollection) -> None:
        self.result = result

    @property
    def title(self) -> str:
        """Nothing: collections have no name."""
        return ""

    @cached_property
    def plan(self) -> Plan:
        """The network; a photo with P = R X + t stands at -R' t."""
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

    def covariances(self, points: Indices) -> Floats:
        """Return (k, 3, 3) covariances of points along the axes of the plan."""
        return np.asarray(self.result.point_covariances[points])

    @property
    def footprints(self) -> Floats:
        """None: nothing says which way is up."""
        return np.empty((0, 1, 3))

    @cached_property
    def images(self) -> Images:
        """The image observations that took part, in one frame for the cameras of all photos."""
        result, collection = self.result, self.result.collection
        used = result.used_images
        camera = self._camera(0)
        return Images(
            unit="px",
            photos=collection.image_photos[used],
            points=collection.image_points[used],
            xy=collection.image_xy[used],
            residuals=result.residuals[used],
            redundancy=result.redundancy[used],
            cameras=np.zeros(int(used.sum()), dtype=np.int64),
            names=[f"cameras of all {len(result.photo_parameters)} photos"],
            down=camera.image_y == "down",
        )

    @property
    def tested(self) -> list[Observations]:
        """All observations with their standardized residuals."""
        return tested_observations(self.result)

    @property
    def unit_weight(self) -> float:
        """The root of the variance of unit weight."""
        return float(np.sqrt(self.result.covariance_scale))

    @property
    def correlations(self) -> list[Correlated]:
        """Medians over all photos of the correlations of the parameters of their cameras."""
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
        remark = f"medians of the {int(good.sum())} photos"
        return [Correlated("cameras", parameters, np.median(tables[good], axis=0), remark)]

    @property
    def distortion(self) -> list[Curves]:
        """One set of curves: of some photos faintly, and that of the photo whose distortion is the middle."""
        result = self.result
        model = result.collection.camera
        terms = [k for k, name in enumerate(result.collection.parameters) if RADIAL.fullmatch(name)]
        terms = [k for k in terms if k >= len(POSE)]
        used = np.flatnonzero(result.photo_images > 0)
        if not terms or not len(used) or not result.photo_parameters[:, terms].any():
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
        band = self._band(photo, terms, radii)
        return [
            Curves(
                camera=f"{len(chosen)} of {len(used)} photos ({model}); black: photo {photo}, their middle",
                unit="px",
                radii=radii,
                observed=self._reach,
                curves=[Curve("", curves[middle], {"curve": band} if np.isfinite(band).all() else {})],
                others=curves,
            )
        ]

    @property
    def _reach(self) -> float:
        """How far images reach from the middle of the picture: the radius within which all but 1 % lie."""
        xy = self.images.xy
        middle = np.median(xy, axis=0) if self.images.down else np.zeros(2)
        return float(np.quantile(np.hypot(*(xy - middle).T), 0.99))

    def _camera(self, photo: int) -> Camera:
        collection = self.result.collection
        values = self.result.photo_parameters[photo, len(POSE) :].tolist()
        given = dict(zip(collection.parameters[len(POSE) :], values, strict=True))
        return radial_part(Camera(collection.camera, given))

    def _band(self, photo: int, terms: list[int], radii: Floats) -> Floats:
        """Return (r,) standard deviations of the curve of a photo, its focal length known."""
        camera = self._camera(photo)
        terms_by_name = [self.result.collection.parameters[k] for k in terms]
        covariance = self.result.photo_covariances[photo][np.ix_(terms, terms)]
        partials = np.empty((len(radii), len(terms)))
        for column, (name, variance) in enumerate(zip(terms_by_name, np.diag(covariance), strict=True)):
            value = camera.parameters[name]
            step = 0.01 * (np.sqrt(variance) if variance > 0 else 1.0)
            upper, lower = (
                added_along(
                    camera.replace(parameters={**camera.parameters, name: value + sign * step}), radii
                )
                for sign in (1, -1)
            )
            partials[:, column] = (upper - lower) / (2 * step)
        variances = np.einsum("ni,ij,nj->n", partials, covariance, partials)
        return np.asarray(np.sqrt(np.maximum(variances, 0.0)))


@pictured.register(AdjustedCollection)
def _pictured(result: AdjustedCollection) -> Pictured:
    return PicturedCollection(result)
