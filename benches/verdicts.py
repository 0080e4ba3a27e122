"""Whether a green verdict means checked: python benches/verdicts.py [--blocks N] [--seed N] [--clean] ...

Further options: `--snoop` removes gross errors, `--loss huber` or `cauchy` adjusts robustly, `--strict`
counts results as accepted whose exit code is 0 with `--strict`, `--only TEXT` selects mistakes by name.

Blocks with one practical mistake each are adjusted, and the verdict is compared with the truth: a result is
wrong if the mistake has moved two other points by more than 5 standard deviations. No block may be accepted
without reserve then. The blocks come from the generator below, which uses numpy only and not the simulator
of the package; the same noise is adjusted with and without the mistake, so that the difference is the
mistake's.
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from photogram import Block, Camera, Distance, PhotogramError, Position, Result, adjust, snoop

WRONG = 5.0  # Standard deviations by which a mistake moves points of a wrong result
SIZES = 0.5, 1.0, 3.0, 10.0  # of planted errors, in minimal detectable biases
F, WIDTH, HEIGHT = 3600.0, 4000.0, 3000.0


@dataclass(frozen=True)
class Survey:
    """A simulated survey: what was observed, and what it was observed with."""

    kind: str
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
    focal: float = F
    control_sd: float = 0.02
    gnss_sd: float = 0.03
    bar_sd: float = 2e-4
    image_sd: float = 0.5
    noise: float = 0.5  # true standard deviation of images

    def block(self) -> Block:
        """Return the survey as the package adjusts it."""
        positions, sd = np.full(self.points.shape, math.nan), np.full(self.points.shape, math.inf)
        positions[self.checks] = self.points[self.checks]
        positions[self.control], sd[self.control] = self.coordinates, self.control_sd
        positions[np.isnan(positions)] = np.nan
        names = [f"p{row}" for row in range(len(self.points))]
        photos = [f"i{row}" for row in range(len(self.poses))]
        gnss = () if self.gnss is None else self.gnss
        return Block(
            photo_ids=photos,
            photo_positions=self.poses[:, :3],
            photo_attitudes=self.poses[:, 3:],
            point_ids=names,
            point_positions=positions,
            point_sd=sd,
            image_photos=self.photos,
            image_points=self.seen,
            image_xy=self.xy,
            image_sd=self.image_sd,
            cameras=[Camera("simple_pinhole", {"f": self.focal, "cx": WIDTH / 2, "cy": HEIGHT / 2})],
            observations=[
                *(Position(name, own, self.gnss_sd) for name, own in zip(photos, gnss, strict=False)),
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


def projected(pose: np.ndarray, points: np.ndarray, focal: float = F) -> np.ndarray:
    """Return (n, 2) pixels, rows downward; NaN for points behind or outside of the image."""
    u = (points - pose[:3]) @ rotation(*pose[3:]).T
    with np.errstate(all="ignore"):
        xy = np.column_stack([WIDTH / 2 - focal * u[:, 0] / u[:, 2], HEIGHT / 2 + focal * u[:, 1] / u[:, 2]])
    inside = (u[:, 2] < 0) & (xy > 0).all(axis=1) & (xy < [WIDTH, HEIGHT]).all(axis=1)
    return np.where(inside[:, np.newaxis], xy, math.nan)


def aerial(rng: np.random.Generator, strips: int, length: int, control: int, gnss: bool) -> Survey:
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
    return observed(rng, "aerial", poses, points, control, gnss=gnss)


def ring(rng: np.random.Generator, photos: int, control: int, bars: int) -> Survey:
    """Return a convergent network around an object of 2 m, photographed from 3 m."""
    poses = []
    for k in range(photos):
        angle, height = 2 * math.pi * k / photos, 1.2 if k % 2 else 2.2
        centre = np.array([3 * math.cos(angle), 3 * math.sin(angle), height])
        back = centre / np.linalg.norm(centre)
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        m = np.array([right, np.cross(back, right), back])
        phi = math.asin(np.clip(m[2, 0], -1, 1))
        omega, kappa = math.atan2(-m[2, 1], m[2, 2]), math.atan2(-m[1, 0], m[0, 0])
        poses.append([*centre, omega, phi, kappa])
    points = rng.uniform(-0.7, 0.7, (60, 3))
    survey = observed(rng, "close range", np.array(poses), points, control, control_sd=2e-4)
    pairs = rng.permutation(len(points))[: 2 * bars].reshape(-1, 2)
    lengths = [
        (int(i), int(j), float(np.linalg.norm(points[i] - points[j]) + rng.normal() * 2e-4)) for i, j in pairs
    ]
    return replace(survey, bars=lengths)


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


Mistake = Callable[[Survey, float], Survey]


def _control(rows: slice | int, offset: list[float]) -> Mistake:
    def make(survey: Survey, size: float) -> Survey:
        coordinates = survey.coordinates.copy()
        coordinates[rows] += np.array(offset) * size
        return replace(survey, coordinates=coordinates)

    return make


def _similar(change: Callable[[np.ndarray, float], np.ndarray]) -> Mistake:
    """Return a change of all control about its centre."""

    def make(survey: Survey, size: float) -> Survey:
        centre = survey.coordinates.mean(axis=0)
        return replace(survey, coordinates=centre + change(survey.coordinates - centre, size))

    return make


def _gnss(change: Callable[[Survey, float], np.ndarray]) -> Mistake:
    def make(survey: Survey, size: float) -> Survey:
        assert survey.gnss is not None
        return replace(survey, gnss=survey.gnss + change(survey, size))

    return make


def _bar(survey: Survey, size: float) -> Survey:
    (i, j, length), *others = survey.bars
    return replace(survey, bars=[(i, j, length + size), *others])


def _bars(survey: Survey, size: float) -> Survey:
    """Change the scale of all distances."""
    return replace(survey, bars=[(i, j, length * (1 + size)) for i, j, length in survey.bars])


def _twice(survey: Survey, _: float) -> Survey:
    count = len(survey.poses)
    return replace(
        survey,
        poses=np.vstack([survey.poses, survey.poses]),
        photos=np.concatenate([survey.photos, survey.photos + count]),
        seen=np.tile(survey.seen, 2),
        xy=np.tile(survey.xy, (2, 1)),
        gnss=None if survey.gnss is None else np.tile(survey.gnss, (2, 1)),
    )


def _images(change: Callable[[Survey, float], np.ndarray]) -> Mistake:
    return lambda survey, size: replace(survey, xy=survey.xy + change(survey, size))


def _velocity(survey: Survey, photo: int) -> np.ndarray:
    """Return the velocity of a photo in its strip, per exposure."""
    pose, near = survey.poses[photo], survey.poses[max(photo - 1, 0) : photo + 2]
    strip = near[(np.abs(near - pose)[:, [1, 5]] < [15, 1]).all(axis=1)]
    return np.asarray((strip[-1] - strip[0])[:3] / (len(strip) - 1))


def _readout(survey: Survey, size: float) -> np.ndarray:
    """Return changes of images with a readout time in exposures: the photo moves while it is read."""
    change = np.zeros_like(survey.xy)
    for photo, pose in enumerate(survey.poses):
        velocity = _velocity(survey, photo)
        own = survey.photos == photo
        seconds = size * (survey.xy[own, 1] / HEIGHT - 0.5)
        moved = [
            projected(np.concatenate([pose[:3] + velocity * t, pose[3:]]), survey.points[[k]])[0]
            - projected(pose, survey.points[[k]])[0]
            for k, t in zip(survey.seen[own], seconds, strict=True)
        ]
        change[own] = np.nan_to_num(moved)
    return change


def _strip(survey: Survey, size: float) -> np.ndarray:
    """Return the shift of the positions of the first strip."""
    first = np.abs(survey.poses[:, 5] - survey.poses[0, 5]) < 1
    first &= np.abs(survey.poses[:, 1] - survey.poses[0, 1]) < 15
    return first[:, np.newaxis] * np.array([0.6, 0.6, 0.5]) * size


def _by_distance(survey: Survey, size: float, photos: np.ndarray) -> np.ndarray:
    """Return changes of the images of some photos by another principal distance, `size` pixels."""
    centred = survey.xy - [WIDTH / 2, HEIGHT / 2]
    return centred * (size / survey.focal) * photos[survey.photos, np.newaxis]


def _next(survey: Survey, _: float) -> np.ndarray:
    assert survey.gnss is not None
    return np.vstack([survey.gnss[1:], survey.gnss[-1:]]) - survey.gnss


def _bent(survey: Survey, size: float) -> Survey:
    """Bend the heights of control, `size` at the edge relative to the middle."""
    plan = survey.coordinates[:, :2] - survey.coordinates[:, :2].mean(axis=0)
    coordinates = survey.coordinates.copy()
    coordinates[:, 2] += size * (plan**2).sum(axis=1) / (plan**2).sum(axis=1).max()
    return replace(survey, coordinates=coordinates)


def _radial(survey: Survey, size: float) -> np.ndarray:
    """Return changes of images by k1 r^2, r in principal distances; k1 is `size`."""
    centred = survey.xy - [WIDTH / 2, HEIGHT / 2]
    r2 = (centred**2).sum(axis=1, keepdims=True)
    return centred * r2 / survey.focal**2 * size


def _one_image(survey: Survey, size: float) -> np.ndarray:
    change = np.zeros_like(survey.xy)
    change[0, 0] = size
    return change


MISTAKES: dict[str, tuple[str, Callable[[Survey], bool], Mistake]] = {
    "one control height": ("control-point Z", lambda s: len(s.control) > 0, _control(0, [0, 0, 1])),
    "one control point in plan": ("control-point X", lambda s: len(s.control) > 0, _control(0, [1, 0, 0])),
    "all control heights": (
        "control-heights",
        lambda s: len(s.control) > 0,
        _control(slice(None), [0, 0, 1]),
    ),
    "all control shifted": (
        "control-shift",
        lambda s: len(s.control) > 0,
        _control(slice(None), [0.6, 0.6, 0.5]),
    ),
    "control scale": (
        "control-scale",
        lambda s: len(s.control) > 2,
        _similar(lambda own, d: own * (1 + d)),
    ),
    "control rotated": (
        "control-rotation",
        lambda s: len(s.control) > 2,
        _similar(lambda own, d: own @ rotation(0.5 * d, 0.5 * d, 0.7 * d).T),
    ),
    "GNSS shifted": (
        "gnss-shift",
        lambda s: s.gnss is not None,
        _gnss(lambda s, d: np.array([0.6, 0.6, 0.5]) * d),
    ),
    "GNSS heights": ("gnss-heights", lambda s: s.gnss is not None, _gnss(lambda s, d: np.array([0, 0, d]))),
    "lever arm": (
        "lever-arm",
        lambda s: s.gnss is not None,
        _gnss(lambda s, d: np.array([rotation(*pose[3:]).T @ [0.0, d, 0.0] for pose in s.poses])),
    ),
    "one distance": ("observation", lambda s: len(s.bars) > 0, _bar),
    "all distances": ("distance-scale", lambda s: len(s.bars) > 1, _bars),
    "principal distance": ("camera-f", lambda s: True, lambda s, d: replace(s, focal=s.focal + d)),
    "GNSS of one strip": (
        "gnss-set",
        lambda s: s.gnss is not None and np.ptp(s.poses[:, 1]) > 15,
        _gnss(_strip),
    ),
    "GNSS drifts": (
        "gnss-drift",
        lambda s: s.gnss is not None,
        _gnss(lambda s, d: np.linspace(-d, d, len(s.poses))[:, np.newaxis] * np.array([0.6, 0.6, 0.5])),
    ),
    "GNSS of one flight": (
        "gnss-half",
        lambda s: s.gnss is not None and not 50 < np.ptp(s.poses[:, 1]) < 100,  # Two strips are two flights
        _gnss(
            lambda s, d: (
                (np.arange(len(s.poses)) < len(s.poses) // 2)[:, np.newaxis] * np.array([0.6, 0.6, 0.5]) * d
            )
        ),
    ),
    "time of GNSS": (
        "time-offset",
        lambda s: s.gnss is not None,
        _gnss(lambda s, d: d * np.array([_velocity(s, photo) for photo in range(len(s.poses))])),
    ),
    "origin of one photo": (
        "photo",
        lambda s: True,
        _images(lambda s, d: (s.photos == len(s.poses) // 2)[:, np.newaxis] * np.array([0.7, -0.7]) * d),
    ),
    "one position": (
        "position X",
        lambda s: s.gnss is not None,
        _gnss(lambda s, d: d * (np.arange(len(s.poses)) == 1)[:, np.newaxis] * np.array([1.0, 0, 0])),
    ),
    "principal point": (
        "camera-point",
        lambda s: True,
        _images(lambda s, d: np.full(s.xy.shape, d * math.sqrt(0.5))),
    ),
    "principal point exchanged": (
        "camera-exchanged",
        lambda s: True,
        _images(lambda s, _: np.full(s.xy.shape, (WIDTH - HEIGHT) / 2) * [-1.0, 1.0]),
    ),
    "radial distortion": ("camera-radial", lambda s: True, _images(_radial)),
    "rolling shutter": ("readout-time", lambda s: s.kind == "aerial", _images(_readout)),
    "affinity": (
        "camera-affinity",
        lambda s: True,
        _images(lambda s, d: (s.xy - [WIDTH / 2, HEIGHT / 2]) * [d, 0.0]),
    ),
    "shear": (
        "camera-affinity",
        lambda s: True,
        _images(lambda s, d: (s.xy - [WIDTH / 2, HEIGHT / 2])[:, ::-1] * [d, 0.0]),
    ),
    "distance of one strip": (
        "camera-f-strip",
        lambda s: s.kind == "aerial" and np.ptp(s.poses[:, 1]) > 15,
        _images(lambda s, d: _by_distance(s, d, s.poses[:, 1] < s.poses[0, 1] + 15)),
    ),
    "distance of half of the photos": (
        "camera-f-half",
        lambda s: s.kind == "close range",
        _images(lambda s, d: _by_distance(s, d, np.arange(len(s.poses)) < len(s.poses) // 2)),
    ),
    "GNSS of the next photo": ("gnss-next", lambda s: s.gnss is not None, _gnss(_next)),
    "control bent": ("bending", lambda s: s.kind == "aerial" and len(s.control) > 4, _bent),
    "one image": ("image X", lambda s: True, _images(_one_image)),
    "GNSS more accurate": (
        "",
        lambda s: s.gnss is not None,
        lambda s, _: replace(s, gnss_sd=s.gnss_sd / 10),
    ),
    "images less accurate": ("", lambda s: True, lambda s, _: replace(s, image_sd=s.noise * 10)),
    "images more accurate": ("", lambda s: True, lambda s, _: replace(s, image_sd=s.noise / 10)),
    "all photos twice": ("", lambda s: True, _twice),
}
"""The hypothesis that has the size of a mistake, whether a survey can have it, and what it does."""


def surveys(rng: np.random.Generator, count: int) -> Iterator[Survey]:
    """Yield surveys of all kinds, small and large, controlled well and badly."""
    for k in range(count):
        if k % 3 == 2:
            yield ring(
                rng, int(rng.integers(6, 20)), int(rng.choice([3, 4, 8])), int(rng.choice([0, 1, 2, 4]))
            )
        else:
            strips, length = int(rng.integers(1, 5)), int(rng.integers(4, 12))
            yield aerial(rng, strips, length, int(rng.choice([3, 4, 5, 7, 10])), bool(k % 2))


GIVEN = {
    "control-scale": 0.002,
    "control-rotation": 0.005,
    "camera-f": 36.0,
    "camera-point": 20.0,
    "photo": 20.0,
    "camera-radial": 0.005,
    "camera-affinity": 1e-3,
    "camera-f-strip": 10.0,
    "camera-f-half": 10.0,
    "camera-exchanged": 1.0,
    "distance-scale": 0.002,
    "gnss-next": 1.0,
    "bending": 0.1,
    "readout-time": 0.05,
    "image X": 5.0,
}
"""Sizes of errors that have no minimal detectable bias, in pixels or exposures."""

ACCURACY = "images less accurate", "images more accurate", "GNSS more accurate"
"""Mistakes of given standard deviations: those of the result must not be wrong by more than 1.5."""


def size_of(result: Result, hypothesis: str) -> float:
    """Return the largest component of the MDB of a mistake; NaN if an error of any size is undetected."""
    if result.reliability_summary is None:
        return math.nan
    code, _, axis = hypothesis.partition(" ")
    every, component = result.reliability_summary.hypotheses, "XYZ".index(axis) if axis else -1
    own = (every.code == code) & (every.component == component) & np.isfinite(every.mdb[:, 0])
    return float(np.nanmax(np.abs(every.mdb[own][:1]), initial=0.0)) if own.any() else math.nan


def moved(clean: Result, wrong: Result, own: list[int]) -> float:
    """Return by how many standard deviations two points, that the mistake is not in, have moved at least."""
    with np.errstate(all="ignore"):
        ratio = np.abs(wrong.point_positions - clean.point_positions) / wrong.point_sd
    largest = np.where(np.isfinite(ratio), ratio, 0.0).max(axis=1)
    largest[own] = 0.0
    return float(np.sort(largest)[-2])


def sharpened(clean: Result, wrong: Result) -> float:
    """Return the factor by which standard deviations of points are too small, median."""
    with np.errstate(all="ignore"):
        return float(np.nanmedian(clean.point_sd / wrong.point_sd))


def is_cause(result: Result, hypothesis: str, point: str) -> bool | None:
    """Whether the headline names the true cause, or inseparable ones with it; None if the result is usable.

    A lens model includes the terms of distortion.
    """
    code = result.verdict.code
    fields = result.verdict.message.fields
    if code == "common-error" and result.reliability_summary:
        # Errors whose statistics differ by less than odds of 20 : 1 are inseparable by the data.
        true, first = hypothesis.partition(" ")[0], fields["errors"][0].fields["named"].code.partition(".")[2]
        largest: dict[str, float] = defaultdict(float)
        every = result.reliability_summary.hypotheses
        for code, statistic in zip(every.code.tolist(), every.statistic.tolist(), strict=True):
            largest[code] = max(largest[code], statistic)
        # Without observed positions, bent control is the bending of the network.
        same = true in (first, first.removeprefix("control-"))
        return same or largest[true] > largest[first] - 2 * math.log(20)
    if code == "gross-errors" and hypothesis.startswith("control-point"):
        return f"control point {point}" in str(fields["suspects"][0])
    if hypothesis.partition(" ")[0] in ("observation", "position", "image", "control-point"):
        return None  # Errors of single observations other than these are not common errors.
    return None if result.verdict.usable else code == "model" and hypothesis == "camera-radial"


def main() -> None:
    """Print how verdicts agree with the truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--blocks", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clean", action="store_true", help="only clean blocks")
    parser.add_argument("--snoop", action="store_true", help="remove gross errors")
    parser.add_argument("--strict", action="store_true", help="exit codes with warnings")
    parser.add_argument("--loss", choices=("huber", "cauchy"), help="adjust robustly")
    parser.add_argument("--only", default="", help="only mistakes with this text in their name")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    counts: dict[tuple[str, str], dict[str, int]] = defaultdict(lambda: defaultdict(int))
    causes: dict[str, list[bool]] = defaultdict(list)
    bad: list[str] = []

    def adjusted(block: Block) -> Result:
        if options.snoop:
            return snoop(block).result  # type: ignore[return-value]
        return adjust(block, loss=options.loss)

    for number, survey in enumerate(surveys(rng, options.blocks)):
        try:
            clean = adjust(survey.block())
            same = adjusted(survey.block()) if options.snoop or options.loss else clean
        except PhotogramError as error:
            print(f"block {number}, {survey.kind}: {error.code}")
            continue
        control = "7 or more control" if len(survey.control) >= 7 else "fewer control"
        counts[f"clean, {survey.kind}", control][same.verdict.code] += 1
        if options.clean:
            continue
        for name, (hypothesis, possible, mistake) in MISTAKES.items():
            if not possible(survey) or options.only not in name:
                continue
            unit = size_of(clean, hypothesis) if hypothesis else 1.0
            if math.isnan(unit):
                unit = GIVEN.get(hypothesis, 0.1 if survey.kind == "aerial" else 0.005)
            for size in SIZES if hypothesis else (1.0,):
                try:
                    result = adjusted(mistake(survey, size * unit).block())
                except PhotogramError as error:
                    counts[name, f"{size:g}"][f"error {error.code}"] += 1
                    continue
                own = survey.control[:1].tolist() if hypothesis.startswith("control-point") else []
                own = survey.seen[:1].tolist() if hypothesis.startswith("image") else own
                of = f"{survey.kind}, {len(survey.control)} control, {len(survey.bars)} bars"
                verdict = result.verdict
                counts[name, f"{size:g}"][verdict.code] += 1
                good = not verdict.exit_code(strict=True) if options.strict else verdict.code == "accepted"
                off = moved(clean, result, own) if hypothesis else math.inf
                if name in ACCURACY:
                    off = 10 if sharpened(clean, result) > 1.5 or sharpened(result, clean) > 1.5 else 0
                    good = verdict.usable
                if off > WRONG and good:
                    bad.append(f"block {number} ({of}), {name} {size:g}: {off:.1f} sd, {verdict.code}")
                if size >= 3 and hypothesis:
                    first = is_cause(result, hypothesis, f"p{survey.control[0]}")
                    causes[name] += [] if first is None else [first]

    for (name, what), found in counts.items():
        print(f"{name:28s} {what:18s}", ", ".join(f"{code} {n}" for code, n in sorted(found.items())))
    for name, found in causes.items():
        print(f"{name:28s} the true cause is named in {sum(found)} of {len(found)} messages")
    print(f"\n{len(bad)} results accepted without reserve; two points are wrong by more than {WRONG:g} sd")
    print(*bad[:60], sep="\n")


if __name__ == "__main__":
    main()
