"""Difference of two calibrations as arrays, and its test against the uncertainties.

With the rays r_a of camera a at pixels q and the motion T of the axes,  d(q) = f_b(T d r_a(q)) - q.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import one_of
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.network.hull import hull, outside
from photogram.summaries import Brief, Rows
from photogram.targets.cross_validation import DifferenceTest, squares_of
from photogram.targets.housing import transformed
from photogram.targets.lens_fit import Moved, Points
from photogram.targets.maps import at_distance, image_grid
from photogram.targets.projection import fixed_points, of_functions, point_partials, worst
from photogram.targets.sightings import nearest_rotations
from photogram.targets.vision import imaged, motion_partials, moved_by, rays, unknown_of, values_of
from photogram.words import Phrase, phrase

RANK_TOLERANCE = 1e-5  # smaller singular values, relative to the largest, are rounding errors
TEST_GRID = (12, 8)  # pixels across and down, for cameras of different models


@dataclass(frozen=True, eq=False)
class Side:
    """One of two compared calibrations."""

    name: str  # Name of the camera
    camera: Camera
    # (m, 2) observed board corners; empty if unknown
    corners: Floats = field(default_factory=lambda: np.empty((0, 2)))
    covariance: Floats | None = None  # (p, p) of its parameters; None if unknown
    # (6, p) the datum `corners` (:func:`~photogram.targets.projection.fixed_points`); None as
    # `covariance`
    rows: Floats | None = None

    def covariances(self, points: Floats, finite: bool, rows: Floats | None) -> Floats:
        """Return covariances (n, 2, 2) of projected points (n, 3), with datum rows (6, p)."""
        assert self.covariance is not None
        assert rows is not None
        return of_functions(self.partials(points, finite, rows), self.covariance)

    def partials(self, points: Floats, finite: bool, rows: Floats) -> Floats:
        """Return (n, 2, p) partials of projected points, with datum rows (6, p)."""
        found = point_partials(self.camera, points, finite)
        return np.asarray(found[:, :, :-6] + found[:, :, -6:] @ rows)

    def sees(self, pixels: Floats) -> Bools:
        """Return (n,) whether pixels are in the observed board region, if known."""
        return ~outside(pixels, hull(self.corners)) if len(self.corners) else np.ones(len(pixels), dtype=bool)


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


def compared(
    a: Side,
    b: Side,
    size: tuple[int, int],
    distances: tuple[float, ...],
    *,
    unit: str = "m",
    criterion: Criterion = "pixels",
    radius: float | None = None,
    grid: tuple[int, int] = (60, 40),
) -> CameraDifference:
    """Compare two cameras at several distances over the image of a.

    `size` is the image width and height of a. `criterion` selects the misfit minimised by the motion between
    them. `radius` limits the pixels of the fit about the centre. Without it, all weighted pixels are used if
    both covariances are known, else a sixth of the shorter side. The grid is pixels across and down.
    """
    one_of("criterion", criterion, get_args(Criterion))
    columns, rows, pixels = image_grid(size, grid)
    known = a.covariance is not None and b.covariance is not None
    reach = radius or (np.inf if known else min(size) / 6)
    near = pixels[np.hypot(*(pixels - (np.array(size) - 1) / 2).T) < reach]
    weights = _weights(a, b, near, distances, criterion) if known else None
    fitted = fitted_motion(a.camera, b.camera, near, distances, criterion, weights)
    vectors = np.stack([differences_at(a.camera, b.camera, fitted, pixels, each) for each in distances])
    expected = _Expected(a, b, fitted, near, distances) if known else None
    shape = (len(distances), len(rows), len(columns), 2)
    others, shared = set(map(tuple, b.corners.tolist())), 0.0
    if len(a.corners):
        shared = sum(each in others for each in map(tuple, a.corners.tolist())) / len(a.corners)
    return CameraDifference(
        cameras=(a.name, b.name),
        size=size,
        unit=unit,
        criterion=criterion,
        fitted=fitted,
        columns=columns,
        rows=rows,
        distances=distances,
        vectors=vectors.reshape(shape),
        covariances=None if expected is None else expected.covariances(pixels, distances).reshape(*shape, 2),
        inside=(a.sees(pixels) & b.sees(pixels + vectors[0])).reshape(shape[1:3]),
        shared=shared,
        test=None if expected is None or shared > 0 else expected.test(size, distances),
    )


def _weights(a: Side, b: Side, pixels: Floats, distances: tuple[float, ...], criterion: Criterion) -> Floats:
    """Return pixel weights at each distance from covariances in datum `corners`."""
    found = []
    for each in distances:
        finite = bool(np.isfinite(each))
        own, other = (
            side.covariances(points_at(side.camera, pixels, [each]), finite, side.rows) for side in (a, b)
        )
        found.append(
            _inverted(own + other) if criterion == "pixels" else 1 / (worst(own) * worst(other)) ** 2
        )
    return np.concatenate(found)


def _inverted(covariances: Floats) -> Floats:
    known = np.isfinite(covariances).all(axis=(1, 2))
    found = np.full_like(covariances, np.nan)
    found[known] = np.linalg.inv(covariances[known])
    return found


class _Expected:
    """Expected difference in the datum of the fit, with the motion removed from both."""

    def __init__(
        self, a: Side, b: Side, fitted: Fitted, pixels: Floats, distances: tuple[float, ...]
    ) -> None:
        self.a, self.b, self.fitted = a, b, fitted
        points = points_at(a.camera, pixels, distances)
        weights = _weights(a, b, pixels, distances, "pixels")
        moved = transformed(fitted.motion, points)
        usable = np.isfinite(weights).all(axis=(1, 2)) & np.isfinite(imaged(b.camera, moved).xy).all(axis=1)
        self.rows = [
            fixed_points(side.camera, each[usable], weights[usable], fitted.finite)
            for side, each in ((a, points), (b, moved))
        ]

    def covariances(self, pixels: Floats, distances: tuple[float, ...]) -> Floats:
        """Return (D, n, 2, 2) Q_a + Q_b."""
        found = []
        for each in distances:
            finite = bool(np.isfinite(each))
            points = points_at(self.a.camera, pixels, [each])
            own = self.a.covariances(points, finite, self.rows[0])
            moved = transformed(self.fitted.motion, points)
            found.append(own + self.b.covariances(moved, finite, self.rows[1]))
        return np.stack(found)

    def test(self, size: tuple[int, int], distances: tuple[float, ...]) -> DifferenceTest:
        """Test parameters jointly for equal models, else differences over a grid."""
        a, b = self.a, self.b
        assert a.covariance is not None
        assert b.covariance is not None
        unknown = unknown_of(a.camera)
        if a.camera.model == b.camera.model and np.array_equal(unknown, unknown_of(b.camera)):
            change = (values_of(b.camera) - values_of(a.camera))[unknown]
            chi2 = float(change @ np.linalg.solve(a.covariance + b.covariance, change))
            return DifferenceTest.of("parameters of both cameras", chi2, len(change))
        pixels = image_grid(size, TEST_GRID)[2]
        pixels = pixels[a.sees(pixels)]
        vectors, effects = [], []
        for each in distances:
            finite = bool(np.isfinite(each))
            points = points_at(a.camera, pixels, [each])
            own = [
                side.partials(places, finite, rows) @ _root(side.covariance)
                for side, places, rows in zip(
                    (a, b), (points, transformed(self.fitted.motion, points)), self.rows, strict=True
                )
            ]
            effects.append(np.concatenate(own, axis=2))
            vectors.append(differences_at(a.camera, b.camera, self.fitted, pixels, each))
        return _tested(np.concatenate(vectors), np.concatenate(effects))


def _tested(vectors: Floats, effects: Floats) -> DifferenceTest:
    """Test (n, 2) vectors with F (n, 2, r) of the covariance F F' of rank at most r."""
    known = np.isfinite(vectors).all(axis=1) & np.isfinite(effects).all(axis=(1, 2))
    u, s, _ = np.linalg.svd(effects[known].reshape(-1, effects.shape[2]), full_matrices=False)
    defined = s > RANK_TOLERANCE * s[0]
    chi2 = float((((u.T @ vectors[known].ravel())[defined] / s[defined]) ** 2).sum())
    return DifferenceTest.of("differences over the picture", chi2, int(np.count_nonzero(defined)))


def _root(covariance: Floats | None) -> Floats:
    assert covariance is not None
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


Criterion = Literal["pixels", "mrcal"]  # squares of pixel differences, or mrcal 2: fourth powers of angles

STEPS = 200
TOLERANCE = 1e-11  # relative to radians and the shortest distance
MIN_PIXELS = 10
HUBER_THETA_SQUARED = np.radians(5.0) ** 2  # the criterion of mrcal increases more slowly beyond


@dataclass(frozen=True, eq=False)
class Fitted:
    """Fitted motion between the axes of two cameras."""

    motion: Floats  # (4, 4) axes of camera a -> axes of camera b; without translation unless finite
    finite: bool  # whether the translation was fitted: all distances are finite
    points: int  # number of pixels of the fit, counted at every distance


def points_at(camera: Camera, pixels: Floats, distances: Sequence[float]) -> Floats:
    """Return (D n, 3) points on pixel rays at each distance; directions at infinity."""
    towards = rays(camera, pixels)
    return np.concatenate([towards * (each if np.isfinite(each) else 1.0) for each in distances])


def differences_at(a: Camera, b: Camera, fitted: Fitted, pixels: Floats, distance: float) -> Floats:
    """Return (n, 2) d(q) at (n, 2) pixels of camera a; NaN if not visible in both."""
    points = points_at(a, pixels, [distance])
    return np.asarray(imaged(b, transformed(fitted.motion, points)).xy - pixels)


def fitted_motion(
    a: Camera,
    b: Camera,
    pixels: Floats,
    distances: Sequence[float],
    criterion: Criterion = "pixels",
    weights: Floats | None = None,
) -> Fitted:
    """Return the motion that minimises the differences at (n, 2) pixels of camera a.

    Pixels that are not visible in both are ignored. A translation is fitted if all distances are finite; with
    one distance it is arbitrary along the rays. Weights of each pixel are ordered by distance: (D n, 2, 2) W
    of pixel differences, or (D n,) w of the mrcal criterion. NaN excludes a pixel, None means equal weights.
    """
    finite = bool(np.isfinite(distances).all())
    towards = points_at(a, pixels, distances)
    aims, places = (np.concatenate([each] * len(distances)) for each in (rays(b, pixels), pixels))
    if weights is None:
        weights = np.tile(np.eye(2), (len(towards), 1, 1)) if criterion == "pixels" else np.ones(len(towards))
    numbers = np.column_stack([towards, aims, weights.reshape(len(towards), -1)])
    usable = np.isfinite(numbers).all(axis=1)
    if (count := int(np.count_nonzero(usable))) < MIN_PIXELS:
        raise InputError(phrase("targets.few-pixels", count=count, least=MIN_PIXELS))
    towards, aims, places, weights = towards[usable], aims[usable], places[usable], weights[usable]
    motion, free = np.eye(4), slice(0 if finite else 3, 6)
    unit = towards / np.linalg.norm(towards, axis=1)[:, np.newaxis]
    motion[:3, :3] = nearest_rotations((aims.T @ unit)[np.newaxis])[0]
    if criterion == "pixels":
        known = np.isfinite(imaged(b, transformed(motion, towards)).xy).all(axis=1)
        roots = np.linalg.cholesky(weights[known]).transpose(0, 2, 1)
        shown = Points(towards[known], places[known], finite, roots)
        return Fitted(shown.least(Moved(b, motion), [], free).motion, finite, count)
    for _ in range(STEPS):
        moved = transformed(motion, towards)
        by_motion = motion_partials(moved, finite)[:, :, free]
        step = np.zeros(6)
        step[free] = np.linalg.solve(*_angle_step(moved, aims, weights**2, by_motion))
        motion = moved_by(motion, step)
        if np.abs(step[3:]).max() < TOLERANCE and np.abs(step[:3]).max() < TOLERANCE * np.min(distances):
            break
    return Fitted(motion, finite, count)


def _angle_step(moved: Floats, aims: Floats, weights: Floats, by_motion: Floats) -> tuple[Floats, Floats]:
    """Return Newton's equations of sum w^2 rho(theta^4), theta^2 = |u - v|^2.

    For unit vectors u, v with e = theta^2 and D = du, the gradient of e^2 is 4 e D' (u - v). Its second
    derivatives are 8 (D' (u - v))^2 + 4 e D' D, without the curvature of u. Huber: beyond k, e^2 becomes 2 k
    |e| - k^2.
    """
    length = np.linalg.norm(moved, axis=1)
    unit = moved / length[:, np.newaxis]
    across = (np.eye(3) - unit[:, :, np.newaxis] * unit[:, np.newaxis]) / length[:, np.newaxis, np.newaxis]
    turned = across @ by_motion
    apart = unit - aims
    e = (apart**2).sum(axis=1)
    slope = np.einsum("nij,ni->nj", turned, apart)
    inside = e < HUBER_THETA_SQUARED
    level = weights * np.where(inside, e, HUBER_THETA_SQUARED)
    normal = 2 * np.einsum("n,ni,nj->ij", weights * inside, slope, slope)
    normal += np.einsum("n,nki,nkj->ij", level, turned, turned)
    return normal, -np.einsum("n,ni->i", level, slope)
