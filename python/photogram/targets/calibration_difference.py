"""Difference of two calibrations as arrays, and its test against the uncertainties.

With the rays r_a of camera a at pixels q and the motion T of the axes,  d(q) = f_b(T d r_a(q)) - q.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Self, get_args

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import argument_error, one_of, value_field
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.network.point_sets import hull, outside
from photogram.statistics.distributions import log_chi_square, log_fisher
from photogram.summaries import Brief, Rows
from photogram.targets.housing import (
    camera_number,
    datum_rows,
    fixed_points,
    housing_of,
    of_functions,
    point_partials,
    size_of,
    worst,
)
from photogram.targets.lens_fit import Criterion, Fitted, fitted_motion
from photogram.targets.uncertainty import at_distance, checked_distance, image_grid
from photogram.targets.vision import imaged, points_at, transformed, unknown_of, values_of
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated

RANK_TOLERANCE = 1e-5  # smaller singular values, relative to the largest, are rounding errors
TEST_GRID = (12, 8)  # pixels across and down, for cameras of different models
MIN_PROBABILITY = 0.01  # calibrations with a larger p agree


@dataclass(frozen=True)
class DifferenceTest:
    name: str  # name of the difference
    chi2: float  # dk' cov(dk)^-1 dk over the variance of unit weight
    dof: int
    probability: float  # probability of an equal or larger difference

    @classmethod
    def of(cls, name: str, chi2: float, dof: int, freedom: float = math.inf) -> Self:
        """Return the test; `freedom` is the redundancy of unit weight, infinite if known."""
        known = math.isinf(freedom)
        logarithm = log_chi_square(chi2, dof) if known else log_fisher(chi2 / dof, dof, freedom)
        return cls(name, chi2, dof, float(np.exp(logarithm)))

    @property
    def explained(self) -> bool:
        return self.probability > MIN_PROBABILITY

    @property
    def factor(self) -> float:
        """Mean ratio of the differences to their standard deviations."""
        return math.sqrt(self.chi2 / self.dof)


def squares_of(vectors: Floats, covariances: Floats) -> Floats:
    """Return (n,) d' Q^-1 d of (n, 2) vectors."""
    solved = np.linalg.solve(covariances, vectors[:, :, np.newaxis])[:, :, 0]
    return np.asarray((vectors * solved).sum(axis=1))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CameraDifference(Brief):
    """Difference of the projections of the same points by two calibrated cameras.

    Attributes
    ----------
    cameras, size, unit
        Names of a and b, image width and height of a, and the unit of lengths.
    criterion, fitted
        Criterion for the motion between their axes, and the fitted motion.
    columns, rows
        (w,) and (h,) grid coordinates in the image of camera a.
    distances
        D distances from the centre of camera a.
    vectors
        (D, h, w, 2) d: projections by b without the motion minus projections by a, pixels.
    covariances
        (D, h, w, 2, 2) expected covariances for independent a and b; None if one is unknown.
    inside
        (h, w) whether both observed the board there, as far as known.
    shared
        Fraction of the corners of a used by b as well: above 0, a and b are correlated.
    test
        Joint test of both, independent of the motion; None if a covariance is unknown, or if a and b share
        corners.
    """

    cameras: tuple[str, str]
    size: tuple[int, int]
    unit: str
    criterion: Criterion
    fitted: Fitted
    columns: Floats
    rows: Floats
    distances: tuple[float, ...]
    vectors: Floats
    covariances: Floats | None
    inside: Bools
    shared: float
    test: DifferenceTest | None

    @property
    def rotation(self) -> float:
        """Angle of the motion, degrees."""
        return float(
            np.degrees(np.linalg.norm(_photocore.rotation_vectors(self.fitted.motion[np.newaxis, :3, :3])))
        )

    @property
    def translation(self) -> Floats:
        """(3,) translation in axes of camera b; zero at infinity."""
        return self.fitted.motion[:3, 3]

    @property
    def lengths(self) -> Floats:
        """(D, h, w) lengths of the vectors."""
        return np.asarray(np.hypot(self.vectors[..., 0], self.vectors[..., 1]))

    @property
    def rms(self) -> float:
        """Root mean square of the lengths in the observed board region, pixels."""
        return float(np.sqrt(np.nanmean(self.lengths[:, self.inside] ** 2)))

    @property
    def largest(self) -> float:
        """Largest length in the observed board region, pixels."""
        return float(np.nanmax(self.lengths[:, self.inside]))

    @property
    def chi2(self) -> Floats | None:
        """(D, h, w) d' (Q_a + Q_b)^-1 d / 2: about 1 if explained by the uncertainties."""
        if self.covariances is None:
            return None
        with np.errstate(invalid="ignore"):
            known = np.isfinite(self.covariances).all(axis=(-2, -1)) & np.isfinite(self.vectors).all(axis=-1)
        found = np.full(known.shape, np.nan)
        found[known] = squares_of(self.vectors[known], self.covariances[known])
        return found / 2

    @property
    def title(self) -> str:
        """Title with the compared cameras and distances."""
        first, second = self.cameras
        at = [at_distance(each, self.unit) for each in self.distances]
        return str(phrase("difference.title", first=first, second=second, at=at))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the difference."""
        rows = [
            ("motion", str(motion_of(self))),
            ("difference", str(phrase("difference.sizes", rms=self.rms, largest=self.largest))),
        ]
        return self.title, rows + [("", each) for each in self.remarks]

    @property
    def sentences(self) -> list[str]:
        """Difference as lines of text."""
        title, rows = self.brief()
        return [title, *(f"{name}: {said}" if name else said for name, said in rows)]

    @property
    def remarks(self) -> list[str]:
        """Limitations of the comparison, and the result of its test."""
        said = []
        if self.fitted.finite and len(self.distances) == 1:
            said.append(phrase("difference.one-distance"))
        if self.shared > 0:
            said.append(phrase("difference.shared", percent=100 * self.shared))
        if (test := self.test) is not None:
            code = f"difference.{'explained' if test.explained else 'unexplained'}"
            said.append(phrase(code, name=test.name, factor=test.factor, p=test.probability))
        if self.covariances is None:
            said.append(phrase("difference.untested"))
        return [*map(str, said)]


def motion_of(found: CameraDifference) -> Phrase:
    """Return the rotation in degrees, and the translation unless all points are infinitely far."""
    x, y, z = (float(each) for each in found.translation)
    fields = {"degrees": float(found.rotation), "x": x, "y": y, "z": z, "unit": found.unit}
    return Phrase(f"difference.{'motion' if found.fitted.finite else 'rotation'}", fields)


def difference(
    a: Calibrated | Camera,
    b: Calibrated | Camera,
    distance: float | Sequence[float] = np.inf,
    *,
    camera: int | str = 0,
    size: tuple[int, int] | None = None,
    criterion: Criterion = "pixels",
    radius: float | None = None,
    grid: tuple[int, int] = (60, 40),
) -> CameraDifference:
    """Compare the projections of two calibrations without the motion of their axes.

    Parameters
    ----------
    a, b
        Adjusted calibrations, or cameras without uncertainty.
    distance
        Distances of comparison, one or several, from the centre of camera a in the unit of its board. At
        infinity, only a rotation is fitted. One finite distance leaves the translation arbitrary.
    camera
        Camera of calibrations: number or name.
    size
        Image width and height of a; None: from its calibration.
    criterion
        `pixels`: least squares of the differences, weighted by the uncertainties if both are known. `mrcal`:
        least fourth powers of angles between rays.
    radius
        Radius about the image centre of the pixels for the motion fit. None: all, weighted, or a sixth of the
        shorter side if uncertainties are unknown.
    grid
        Number of pixels across and down.

    Raises
    ------
    InputError
        If an argument is neither a calibration nor a camera, or if the image size is unknown. If a distance
        is not positive, or if the cameras have too few common pixels.
    """
    distances = [distance] if isinstance(distance, float | int) else list(distance)
    if not distances:
        raise argument_error("distance", "empty")
    first, second = _side(a, camera, "a"), _side(b, camera, "b")
    if size is None:
        if isinstance(a, Camera):
            raise argument_error("size", "empty")
        size = size_of(a, camera_number(a, camera))
    away = tuple(checked_distance(each) for each in distances)
    one_of("criterion", criterion, get_args(Criterion))
    columns, rows, pixels = image_grid(size, grid)
    known = first.covariance is not None and second.covariance is not None
    reach = radius or (np.inf if known else min(size) / 6)
    near = pixels[np.hypot(*(pixels - (np.array(size) - 1) / 2).T) < reach]
    weights, inverse = None, np.empty(0)
    if known:
        own, other = (
            side.covariances(points_at(side.camera, near, away), _finite(away, near), side.rows)
            for side in (first, second)
        )
        inverse = np.full_like(own, np.nan)
        certain = np.isfinite(own + other).all(axis=(1, 2))
        inverse[certain] = np.linalg.inv((own + other)[certain])
        weights = inverse if criterion == "pixels" else 1 / (worst(own) * worst(other)) ** 2
    fitted = fitted_motion(first.camera, second.camera, near, away, criterion, weights)
    vectors = differences_at(first.camera, second.camera, fitted, pixels, away)
    shape, covariances, test = (len(away), len(rows), len(columns), 2), None, None
    others = set(map(tuple, second.corners.tolist()))
    shared = sum(each in others for each in map(tuple, first.corners.tolist())) / (len(first.corners) or 1)
    if known:
        # The datum of the fit, with the motion removed from both
        points = points_at(first.camera, near, away)
        moved = transformed(fitted.motion, points)
        usable = np.isfinite(inverse).all(axis=(1, 2)) & np.isfinite(imaged(second.camera, moved).xy).all(
            axis=1
        )
        datums = [
            fixed_points(side.camera, each[usable], inverse[usable], fitted.finite)
            for side, each in ((first, points), (second, moved))
        ]
        points = points_at(first.camera, pixels, away)
        own, other = (
            side.covariances(each, _finite(away, pixels), datum)
            for side, each, datum in zip(
                (first, second), (points, transformed(fitted.motion, points)), datums, strict=True
            )
        )
        covariances = (own + other).reshape(*shape, 2)
        test = None if shared > 0 else _test(first, second, size, away, fitted, datums)
    return CameraDifference(
        cameras=(first.name, second.name),
        size=size,
        unit=next((each.calibration.board.unit for each in (a, b) if not isinstance(each, Camera)), "m"),
        criterion=criterion,
        fitted=fitted,
        columns=columns,
        rows=rows,
        distances=away,
        vectors=vectors.reshape(shape),
        covariances=covariances,
        inside=(first.sees(pixels) & second.sees(pixels + vectors[: len(pixels)])).reshape(shape[1:3]),
        shared=shared,
        test=test,
    )


@dataclass(frozen=True, eq=False)
class Side:
    name: str  # Name of the camera
    camera: Camera
    # (m, 2) observed board corners; empty if unknown
    corners: Floats = field(default_factory=lambda: np.empty((0, 2)))
    covariance: Floats | None = None  # (p, p) of its parameters; None if unknown
    # (6, p) the datum `corners` (:func:`~photogram.targets.housing.fixed_points`); None as `covariance`
    rows: Floats | None = None

    def covariances(self, points: Floats, finite: Bools, rows: Floats | None) -> Floats:
        """Return covariances (n, 2, 2) of projected points (n, 3), with datum rows (6, p)."""
        assert self.covariance is not None
        return of_functions(self.partials(points, finite, rows), self.covariance)

    def partials(self, points: Floats, finite: Bools, rows: Floats | None) -> Floats:
        """Return (n, 2, p) partials of projected points, with datum rows (6, p)."""
        assert rows is not None
        found = point_partials(self.camera, points, finite)
        return np.asarray(found[:, :, :-6] + found[:, :, -6:] @ rows)

    def sees(self, pixels: Floats) -> Bools:
        """Return (n,) whether pixels are in the observed board region, if known."""
        return ~outside(pixels, hull(self.corners)) if len(self.corners) else np.ones(len(pixels), dtype=bool)


def _side(given: Calibrated | Camera, camera: int | str, name: str) -> Side:
    if isinstance(given, Camera):
        return Side(given.name or name, given)
    if not hasattr(given, "calibration"):
        raise InputError(phrase("targets.no-calibration", name=name, value=value_field(given)))
    number = camera_number(given, camera)
    housing, own = housing_of(given, number)
    columns = housing.parameters(own)
    return Side(
        name=f"{given.cameras[number].name} of {name}",
        camera=housing.cameras[own],
        corners=housing.seen.xy[housing.seen.cameras == own],
        covariance=housing.variance * housing.cofactors[columns, columns],
        rows=datum_rows(housing, own, "corners")[:, columns],
    )


def _finite(distances: Sequence[float], pixels: Floats) -> Bools:
    """Return (D n,) whether the points of :func:`points_at` are at finite distances."""
    return np.repeat(np.isfinite(distances), len(pixels))


def differences_at(
    a: Camera, b: Camera, fitted: Fitted, pixels: Floats, distances: Sequence[float]
) -> Floats:
    """Return (D n, 2) d(q) at (n, 2) pixels of camera a; NaN if not visible in both."""
    points = transformed(fitted.motion, points_at(a, pixels, distances))
    return np.asarray(imaged(b, points).xy - np.tile(pixels, (len(distances), 1)))


def _test(
    a: Side, b: Side, size: tuple[int, int], distances: Sequence[float], fitted: Fitted, datums: list[Floats]
) -> DifferenceTest:
    assert a.covariance is not None
    assert b.covariance is not None
    unknown = unknown_of(a.camera)
    if a.camera.model == b.camera.model and np.array_equal(unknown, unknown_of(b.camera)):
        change = (values_of(b.camera) - values_of(a.camera))[unknown]
        chi2 = float(change @ np.linalg.solve(a.covariance + b.covariance, change))
        return DifferenceTest.of("parameters of both cameras", chi2, len(change))
    pixels = image_grid(size, TEST_GRID)[2]
    pixels = pixels[a.sees(pixels)]
    points = points_at(a.camera, pixels, distances)
    # F (n, 2, r) of the covariance F F' of rank at most r
    effects = []
    for side, each, datum in zip((a, b), (points, transformed(fitted.motion, points)), datums, strict=True):
        assert side.covariance is not None
        values, axes = np.linalg.eigh(side.covariance)
        root = axes * np.sqrt(np.maximum(values, 0.0))
        effects.append(side.partials(each, _finite(distances, pixels), datum) @ root)
    both = np.concatenate(effects, axis=2)
    vectors = differences_at(a.camera, b.camera, fitted, pixels, distances)
    known = np.isfinite(vectors).all(axis=1) & np.isfinite(both).all(axis=(1, 2))
    u, s, _ = np.linalg.svd(both[known].reshape(-1, both.shape[2]), full_matrices=False)
    defined = s > RANK_TOLERANCE * s[0]
    chi2 = float((((u.T @ vectors[known].ravel())[defined] / s[defined]) ** 2).sum())
    return DifferenceTest.of("differences over the picture", chi2, int(np.count_nonzero(defined)))
