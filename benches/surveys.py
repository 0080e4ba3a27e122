"""Simulated surveys of every type of datum for `verdicts.py`, without the simulator of the package."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from photogram import Block, Camera, Distance, Position
from photogram.network import Attitude

F, WIDTH, HEIGHT = 3600.0, 4000.0, 3000.0
ATTITUDE_SD = 1e-4  # Radians


@dataclass(frozen=True)
class Survey:
    """Observations of a simulated survey, and their standard deviations."""

    kind: str
    close: bool  # Close range
    poses: np.ndarray  # (P, 6) initial values
    points: np.ndarray  # (n, 3) truth
    photos: np.ndarray  # (m,) of the image observations
    seen: np.ndarray
    xy: np.ndarray
    control: np.ndarray  # rows of points
    coordinates: np.ndarray  # observed, of control
    checks: np.ndarray
    gnss: np.ndarray | None
    bars: list[tuple[int, int, float]]
    attitudes: np.ndarray | None = None  # (P, 3, 3) observed, photo to ground
    cameras: np.ndarray | None = None  # (P,) camera of each photo; None: one for all
    focal: float = F
    focal_sd: float = 0.0
    k: float | None = None  # Fixed radial term; None: a camera without it
    control_sd: float | np.ndarray = 0.02
    gnss_sd: float = 0.03
    attitude_sd: float = ATTITUDE_SD
    bar_sd: float = 2e-4
    image_sd: float = 0.5
    noise: float = 0.5  # true standard deviation of images
    weighted: bool = False  # Whether photos have standard deviations instead of observed poses

    @property
    def is_free(self) -> bool:
        """Whether inner constraints define the datum."""
        return not len(self.control) and self.gnss is None

    def block(self) -> Block:
        """Return the survey as the package adjusts it."""
        positions, sd = np.full(self.points.shape, math.nan), np.full(self.points.shape, math.inf)
        positions[self.checks] = self.points[self.checks]
        positions[self.control], sd[self.control] = self.coordinates, np.reshape(self.control_sd, (-1, 1))
        names = [f"p{row}" for row in range(len(self.points))]
        photos = [f"i{row}" for row in range(len(self.poses))]
        gnss = () if self.gnss is None or self.weighted else self.gnss
        attitudes = () if self.attitudes is None or self.weighted else self.attitudes
        camera = {"f": self.focal, "cx": WIDTH / 2, "cy": HEIGHT / 2}
        model = "simple_pinhole"
        if self.k is not None:
            camera, model = {**camera, "k": self.k}, "simple_radial"
        count = 1 if self.cameras is None else int(self.cameras.max()) + 1
        weights = {}
        if self.weighted:
            weights = {"photo_position_sd": self.gnss_sd, "photo_positions_observed": self.gnss}
            if self.attitudes is not None:
                angles = np.array([angles_of(own.T) for own in self.attitudes])
                weights |= {"photo_attitude_sd": self.attitude_sd, "photo_attitudes_observed": angles}
        return Block(
            photo_ids=photos,
            photo_cameras=self.cameras,
            photo_positions=self.poses[:, :3],
            photo_attitudes=self.poses[:, 3:],
            point_ids=names,
            point_positions=positions,
            point_sd=sd,
            image_photos=self.photos,
            image_points=self.seen,
            image_xy=self.xy,
            image_sd=self.image_sd,
            cameras=[Camera(model, camera, sd={"f": self.focal_sd}) for _ in range(count)],
            **weights,
            observations=[
                *(Position(name, own, self.gnss_sd) for name, own in zip(photos, gnss, strict=False)),
                *(
                    Attitude(name, own, self.attitude_sd)
                    for name, own in zip(photos, attitudes, strict=False)
                ),
                *(Distance(names[i], names[j], length, self.bar_sd) for i, j, length in self.bars),
            ],
        )


def rotation(omega: float, phi: float, kappa: float) -> np.ndarray:
    """Return M = M_kappa M_phi M_omega, ground to photo."""
    (so, sp, sk), (co, cp, ck) = np.sin([omega, phi, kappa]), np.cos([omega, phi, kappa])
    m1 = np.array([[1, 0, 0], [0, co, so], [0, -so, co]])
    m2 = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
    m3 = np.array([[ck, sk, 0], [-sk, ck, 0], [0, 0, 1]])
    return m3 @ m2 @ m1


def angles_of(m: np.ndarray) -> tuple[float, float, float]:
    """Return omega, phi, kappa of M."""
    phi = math.asin(np.clip(m[2, 0], -1, 1))
    return math.atan2(-m[2, 1], m[2, 2]), phi, math.atan2(-m[1, 0], m[0, 0])


def pixels(pose: np.ndarray, points: np.ndarray, focal: float = F) -> np.ndarray:
    """Return (n, 2) pixels, rows downward; NaN for points behind."""
    u = (points - pose[:3]) @ rotation(*pose[3:]).T
    with np.errstate(all="ignore"):
        xy = np.column_stack([WIDTH / 2 - focal * u[:, 0] / u[:, 2], HEIGHT / 2 + focal * u[:, 1] / u[:, 2]])
    return np.where(u[:, 2:] < 0, xy, math.nan)


def projected(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return (n, 2) pixels; NaN for points behind or outside of the image."""
    xy = pixels(pose, points)
    inside = (xy > 0).all(axis=1) & (xy < [WIDTH, HEIGHT]).all(axis=1)
    return np.where(inside[:, np.newaxis], xy, math.nan)


def aerial(
    rng: np.random.Generator, strips: int, length: int, control: int, gnss: bool, *, attitudes: bool = False
) -> Survey:
    """Return a block of strips over hilly terrain: 80 % forward and 40 % side overlap, 100 m above ground."""
    step, across = 0.2 * 100 * HEIGHT / F, 0.6 * 100 * WIDTH / F
    poses = []
    for strip in range(strips):
        for k in range(length):
            along = k if strip % 2 == 0 else length - 1 - k
            kappa = 0.0 if strip % 2 == 0 else math.pi
            place = [along * step, strip * across, 100.0]
            poses.append([*place, 0, 0, math.pi / 2 + kappa])
    poses = np.array(poses, dtype=float)
    poses += rng.normal(size=poses.shape) * [1, 1, 1, 0.02, 0.02, 0.02]
    low, high = poses[:, :2].min(axis=0) - 30, poses[:, :2].max(axis=0) + 30
    count = max(40, 12 * len(poses))
    points = np.column_stack([rng.uniform(low, high, (count, 2)), rng.uniform(-8, 8, count)])
    survey = observed(rng, "aerial", poses, points, control, gnss=gnss)
    return with_attitudes(rng, survey, poses) if attitudes else survey


def ring(rng: np.random.Generator, photos: int, control: int, bars: int, *, common: bool = False) -> Survey:
    """Return a convergent network around an object of 2 m, photographed from 3 m.

    `common`: whether all bars start at the first control point, or at one other point.
    """
    poses = []
    for k in range(photos):
        angle, height = 2 * math.pi * k / photos, 1.2 if k % 2 else 2.2
        centre = np.array([3 * math.cos(angle), 3 * math.sin(angle), height])
        back = centre / np.linalg.norm(centre)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        m = np.array([right, np.cross(back, right), back])
        poses.append([*centre, *angles_of(m)])
    points = rng.uniform(-0.7, 0.7, (60, 3))
    survey = observed(rng, "close range", np.array(poses), points, control, control_sd=2e-4)
    pairs = rng.permutation(len(points))[: 2 * bars].reshape(-1, 2)
    if common:
        first = survey.control[0] if control else pairs[0, 0]
        pairs[:, 0] = first
        pairs = pairs[pairs[:, 1] != first]
    return with_bars(rng, survey, pairs, 2e-4)


def with_bars(rng: np.random.Generator, survey: Survey, pairs: np.ndarray, sd: float) -> Survey:
    """Return a survey with distances between pairs of points."""
    lengths = np.linalg.norm(survey.points[pairs[:, 0]] - survey.points[pairs[:, 1]], axis=1)
    bars = [
        (int(i), int(j), float(length + rng.normal() * sd))
        for (i, j), length in zip(pairs, lengths, strict=True)
    ]
    return replace(survey, bars=bars, bar_sd=sd)


def observed(
    rng: np.random.Generator,
    kind: str,
    poses: np.ndarray,
    points: np.ndarray,
    control: int,
    *,
    gnss: bool = False,
    control_sd: float = 0.02,
) -> Survey:
    """Observe points from poses, with noise; those on fewer than three photos are left out."""
    images = np.array([projected(pose, points) for pose in poses])
    rays = np.isfinite(images[:, :, 0]).sum(axis=0)
    images, points = images[:, rays >= 3], points[rays >= 3]
    photos, seen = np.nonzero(np.isfinite(images[:, :, 0]))
    xy = images[photos, seen] + rng.normal(size=(len(photos), 2)) * 0.5
    # Control at the corners and the edges first, as surveyors place it.
    middle = points[:, :2].mean(axis=0)
    order: list[int] = []
    for angle in np.arange(max(control, 1)) * 2.4:
        toward = (points[:, :2] - middle) @ [math.cos(angle), math.sin(angle)]
        order.append(next(int(row) for row in np.argsort(-toward) if row not in order))
    rows = np.array(order[:control], dtype=int)
    others = np.setdiff1d(np.arange(len(points)), rows)
    start = poses + rng.normal(size=poses.shape) * [0.3, 0.3, 0.3, 0.005, 0.005, 0.005] * (
        0.1 if control_sd < 0.01 else 1
    )
    return Survey(
        kind,
        control_sd < 0.01,
        start,
        points,
        photos,
        seen,
        xy,
        rows,
        points[rows] + rng.normal(size=(control, 3)) * control_sd,
        rng.choice(others, 3, replace=False),
        poses[:, :3] + rng.normal(size=(len(poses), 3)) * 0.03 if gnss else None,
        [],
        control_sd=control_sd,
    )


def with_attitudes(rng: np.random.Generator, survey: Survey, poses: np.ndarray) -> Survey:
    """Return a survey with attitudes observed about the axes of the photo."""
    noise = rng.normal(size=(len(poses), 3)) * ATTITUDE_SD
    attitudes = [rotation(*pose[3:]).T @ rotation(*turn).T for pose, turn in zip(poses, noise, strict=True)]
    return replace(survey, attitudes=np.array(attitudes))


def surveys(rng: np.random.Generator, count: int) -> Iterator[Survey]:
    """Yield surveys controlled by points or positions, small and large; after each, one of another datum."""
    for k in range(count):
        if k % 3 == 2:
            yield ring(
                rng, int(rng.integers(6, 20)), int(rng.choice([3, 4, 8])), int(rng.choice([0, 1, 2, 4]))
            )
        else:
            strips, length = int(rng.integers(1, 5)), int(rng.integers(4, 12))
            yield aerial(rng, strips, length, int(rng.choice([3, 4, 5, 7, 10])), bool(k % 2))
        (other,) = rng.spawn(1)  # Does not change the surveys above
        yield DATUMS[k % len(DATUMS)](other)


def free(rng: np.random.Generator) -> Survey:
    """Return a free network with one to four distances from a point."""
    survey = ring(rng, int(rng.integers(8, 20)), 0, int(rng.choice([1, 2, 4])), common=True)
    return replace(survey, kind="free network")


def navigated(rng: np.random.Generator) -> Survey:
    """Return a flight with observed positions and attitudes, without control or with little of it."""
    survey = flight(rng, int(rng.choice([0, 3, 5])), gnss=True)
    return replace(survey, kind="positions and attitudes")


def positioned(rng: np.random.Generator) -> Survey:
    """Return a flight with observed positions and two distances, without control."""
    survey = flight(rng, 0, gnss=True)
    pairs = rng.permutation(len(survey.points))[:4].reshape(-1, 2)
    return replace(with_bars(rng, survey, pairs, 0.01), kind="positions, no control", attitudes=None)


def weighted(rng: np.random.Generator) -> Survey:
    """Return a flight whose photos have weighted positions and attitudes."""
    return replace(flight(rng, 4, gnss=True), kind="weighted photos", weighted=True)


def grouped(rng: np.random.Generator) -> Survey:
    """Return a flight with two cameras with a term of distortion, and two sets of control."""
    survey = replace(flight(rng, 8, gnss=False), kind="two cameras", k=0.0, attitudes=None)
    sd = np.where(np.arange(8) % 2, 0.05, 0.02)
    noise = rng.normal(size=(8, 3)) * sd[:, np.newaxis]
    return replace(
        survey,
        control_sd=sd,
        coordinates=survey.points[survey.control] + noise,
        cameras=np.arange(len(survey.poses)) % 2,
    )


def fixed(rng: np.random.Generator) -> Survey:
    """Return a close-range network with fixed control, distances from one point and a weighted camera."""
    survey = ring(rng, int(rng.integers(8, 20)), int(rng.choice([4, 8])), 4, common=True)
    focal = F + 2.0 * rng.normal()
    coordinates = survey.points[survey.control]
    return replace(
        survey, kind="fixed control", control_sd=0.0, coordinates=coordinates, focal=focal, focal_sd=2.0
    )


DATUMS = free, navigated, positioned, weighted, grouped, fixed


def flight(rng: np.random.Generator, control: int, *, gnss: bool) -> Survey:
    """Return a flight of two to four strips with observed attitudes."""
    strips, length = int(rng.integers(2, 5)), int(rng.integers(4, 12))
    return aerial(rng, strips, length, control, gnss, attitudes=True)
