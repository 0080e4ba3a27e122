"""Mistakes of every row of the catalogue of hypotheses, which `verdicts.py` plants in simulated surveys."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from surveys import HEIGHT, WIDTH, Survey, angles_of, pixels, rotation

Mistake = Callable[[Survey, float], Survey]
Condition = Callable[[Survey], bool]


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
        attitudes=None if survey.attitudes is None else np.tile(survey.attitudes, (2, 1, 1)),
        cameras=None if survey.cameras is None else np.tile(survey.cameras, 2),
    )


def _points_twice(survey: Survey, _: float) -> Survey:
    count = len(survey.points)
    return replace(
        survey,
        points=np.vstack([survey.points, survey.points]),
        photos=np.tile(survey.photos, 2),
        seen=np.concatenate([survey.seen, survey.seen + count]),
        xy=np.tile(survey.xy, (2, 1)),
    )


def _plain_points(survey: Survey) -> np.ndarray:
    """Return points without control, distances and known coordinates, those with the most images first."""
    ends = [end for bar in survey.bars for end in bar[:2]]
    others = np.setdiff1d(np.arange(len(survey.points)), [*survey.control, *survey.checks, *ends])
    return others[np.argsort(-np.bincount(survey.seen, minlength=len(survey.points))[others], kind="stable")]


def _exchanged(survey: Survey, _: float) -> Survey:
    """Exchange the names of two images of the photo in the middle."""
    own = np.flatnonzero(survey.photos == len(survey.poses) // 2)
    first, second = own[0], own[np.argmax(np.abs(survey.xy[own] - survey.xy[own[0]]).sum(axis=1))]
    seen = survey.seen.copy()
    seen[[first, second]] = seen[[second, first]]
    return replace(survey, seen=seen)


def _merged(survey: Survey, _: float) -> Survey:
    """Measure another point instead of the first one on every second photo."""
    first, second = _plain_points(survey)[:2]
    odd = survey.photos % 2 == 1
    seen = np.where(odd & (survey.seen == second), first, survey.seen)
    kept = ~(odd & (survey.seen == first))
    return replace(survey, photos=survey.photos[kept], seen=seen[kept], xy=survey.xy[kept])


def _split(survey: Survey, _: float) -> Survey:
    """Give every second image of a point another name."""
    own = np.flatnonzero(survey.seen == _plain_points(survey)[0])[::2]
    seen = survey.seen.copy()
    seen[own] = len(survey.points)
    return replace(survey, points=np.vstack([survey.points, survey.points[survey.seen[own[:1]]]]), seen=seen)


def _scaled(survey: Survey, size: float) -> Survey:
    """Change the scale of control and positions about their common centre."""
    assert survey.gnss is not None
    centre = np.vstack([survey.coordinates, survey.gnss]).mean(axis=0)
    return replace(
        survey,
        coordinates=centre + (survey.coordinates - centre) * (1 + size),
        gnss=centre + (survey.gnss - centre) * (1 + size),
    )


def _misaligned(photos: slice) -> Mistake:
    def make(survey: Survey, size: float) -> Survey:
        assert survey.attitudes is not None
        attitudes = survey.attitudes.copy()
        one = [1.0, 0.0, 0.0] if photos.stop is not None else [0.6, 0.6, 0.5]
        attitudes[photos] = attitudes[photos] @ rotation(*(size * np.array(one))).T
        return replace(survey, attitudes=attitudes)

    return make


def _attitudes(change: Callable[[np.ndarray], np.ndarray]) -> Mistake:
    """Return a mistake that reads the angles of observed attitudes as others."""

    def make(survey: Survey, _: float) -> Survey:
        assert survey.attitudes is not None
        return replace(survey, attitudes=np.array([change(own) for own in survey.attitudes]))

    return make


def target(survey: Survey) -> int:
    """Return the first end of the first distance, a target that several observations have in common."""
    return survey.bars[0][0]


def _displaced(survey: Survey, size: float) -> np.ndarray:
    """Return changes of the images of a target whose place is wrong by a length."""
    change = np.zeros_like(survey.xy)
    place = survey.points[[target(survey)]]
    for row in np.flatnonzero(survey.seen == target(survey)):
        pose = survey.poses[survey.photos[row]]
        change[row] = pixels(pose, place + size * np.array([0.6, 0.6, 0.5])) - pixels(pose, place)
    return np.nan_to_num(change)


def _of_set(survey: Survey, size: float) -> Survey:
    """Shift the control points with the smallest standard deviation."""
    own = survey.control_sd == np.min(survey.control_sd)
    return replace(
        survey, coordinates=survey.coordinates + own[:, np.newaxis] * np.array([0.6, 0.6, 0.5]) * size
    )


def _resized(survey: Survey, size: float) -> np.ndarray:
    """Return changes of images that were resized by a share `size`."""
    return survey.xy * size


def _images(change: Callable[[Survey, float], np.ndarray]) -> Mistake:
    return lambda survey, size: replace(survey, xy=survey.xy + change(survey, size))


def _velocity(survey: Survey, photo: int) -> np.ndarray:
    """Return the velocity of a photo in its strip, per exposure."""
    pose, near = survey.poses[photo], survey.poses[max(photo - 1, 0) : photo + 2]
    strip = near[(np.abs(near - pose)[:, [1, 5]] < [15, 1]).all(axis=1)]
    return np.asarray((strip[-1] - strip[0])[:3] / (len(strip) - 1))


def _readout(survey: Survey, size: float, axis: int = 1) -> np.ndarray:
    """Return changes of images with a readout time in exposures: the photo moves while it is read.

    Rows are read one after the other, with axis 0 columns.
    """
    change = np.zeros_like(survey.xy)
    for photo, pose in enumerate(survey.poses):
        velocity = _velocity(survey, photo)
        own = survey.photos == photo
        seconds = size * (survey.xy[own, axis] / (WIDTH, HEIGHT)[axis] - 0.5)
        moved = [
            pixels(np.concatenate([pose[:3] + velocity * t, pose[3:]]), survey.points[[k]])[0]
            - pixels(pose, survey.points[[k]])[0]
            for k, t in zip(survey.seen[own], seconds, strict=True)
        ]
        change[own] = np.nan_to_num(moved).reshape(-1, 2)
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


def _assigned(survey: Survey, step: int) -> np.ndarray:
    """Return changes of positions of photos to those of the next photo, or of the one before (-1)."""
    assert survey.gnss is not None
    count = len(survey.gnss)
    return survey.gnss[np.clip(np.arange(count) + step, 0, count - 1)] - survey.gnss


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


def _surface(survey: Survey, size: float) -> Survey:
    """Raise the heights of control by a geoid that is inclined by a fifth of its height over the block."""
    x = survey.coordinates[:, 0]
    coordinates = survey.coordinates.copy()
    coordinates[:, 2] += size * (1 + 0.2 * (x - x.mean()) / max(np.ptp(x), 1.0))
    return replace(survey, coordinates=coordinates)


def _phi_omega_kappa(omega: float, phi: float, kappa: float) -> np.ndarray:
    """Return M_kappa M_omega M_phi."""
    return rotation(0, 0, kappa) @ rotation(omega, 0, 0) @ rotation(0, phi, 0)


def _coordinates(change: Callable[[np.ndarray], np.ndarray]) -> Mistake:
    return lambda survey, _: replace(survey, coordinates=change(survey.coordinates))


def _has_control(survey: Survey) -> bool:
    return len(survey.control) > 0


def _has_positions(survey: Survey) -> bool:
    return survey.gnss is not None


def _has_attitudes(survey: Survey) -> bool:
    return survey.attitudes is not None


def _has_target(survey: Survey) -> bool:
    """Whether the first end has three or more observations; of two, the errors are inseparable."""
    if not survey.bars:
        return False
    ends = [end for bar in survey.bars for end in bar[:2]]
    return ends.count(target(survey)) + (target(survey) in survey.control) > 2


MISTAKES: dict[str, tuple[str, Condition, Mistake]] = {
    "one control height": ("control-point Z", _has_control, _control(0, [0, 0, 1])),
    "one control point in plan": ("control-point X", _has_control, _control(0, [1, 0, 0])),
    "all control heights": (
        "control-heights",
        _has_control,
        _control(slice(None), [0, 0, 1]),
    ),
    "all control shifted": (
        "control-shift",
        _has_control,
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
        _has_positions,
        _gnss(lambda s, d: np.array([0.6, 0.6, 0.5]) * d),
    ),
    "GNSS heights": ("gnss-heights", _has_positions, _gnss(lambda s, d: np.array([0, 0, d]))),
    "lever arm": (
        "lever-arm",
        _has_positions,
        _gnss(lambda s, d: np.array([rotation(*pose[3:]).T @ [0.0, d, 0.0] for pose in s.poses])),
    ),
    "one distance": ("distance", lambda s: len(s.bars) > 0, _bar),
    # Without other observations, the distances are the datum: the result names this assumption.
    "all distances": ("distance-scale", lambda s: len(s.bars) > 1 and not s.is_free, _bars),
    "principal distance": ("camera-f", lambda s: not s.focal_sd, lambda s, d: replace(s, focal=s.focal + d)),
    "GNSS of one strip": (
        "gnss-set",
        lambda s: s.gnss is not None and np.ptp(s.poses[:, 1]) > 15,
        _gnss(_strip),
    ),
    "GNSS drifts": (
        "gnss-drift",
        _has_positions,
        _gnss(lambda s, d: np.linspace(-d, d, len(s.poses))[:, np.newaxis] * np.array([0.6, 0.6, 0.5])),
    ),
    "GNSS of one flight": (
        "gnss-half",
        # Two strips are two flights.
        lambda s: s.gnss is not None and len(s.poses) > 5 and not 50 < np.ptp(s.poses[:, 1]) < 100,
        _gnss(
            lambda s, d: (
                (np.arange(len(s.poses)) < len(s.poses) // 2)[:, np.newaxis] * np.array([0.6, 0.6, 0.5]) * d
            )
        ),
    ),
    "time of GNSS": (
        "time-offset",
        _has_positions,
        _gnss(lambda s, d: d * np.array([_velocity(s, photo) for photo in range(len(s.poses))])),
    ),
    "origin of one photo": (
        "photo",
        lambda s: True,
        _images(lambda s, d: (s.photos == len(s.poses) // 2)[:, np.newaxis] * np.array([0.7, -0.7]) * d),
    ),
    "one position": (
        "position X",
        _has_positions,
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
    "radial distortion": ("camera-radial", lambda s: s.k is None, _images(_radial)),
    "term of distortion": (
        "camera-term",
        lambda s: s.k is not None,
        lambda s, d: replace(s, k=(s.k or 0.0) + d),
    ),
    "resized images": ("camera-size", lambda s: True, _images(_resized)),
    "rolling shutter by columns": (
        "readout-time-columns",
        lambda s: not s.close,
        _images(lambda s, d: _readout(s, d, axis=0)),
    ),
    "rolling shutter": ("readout-time", lambda s: not s.close, _images(_readout)),
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
        lambda s: not s.close and np.ptp(s.poses[:, 1]) > 15,
        _images(lambda s, d: _by_distance(s, d, s.poses[:, 1] < s.poses[0, 1] + 15)),
    ),
    "distance of half of the photos": (
        "camera-f-half",
        lambda s: s.close,
        _images(lambda s, d: _by_distance(s, d, np.arange(len(s.poses)) < len(s.poses) // 2)),
    ),
    "distance of one camera": (
        "camera-f-single",
        lambda s: s.cameras is not None,
        _images(lambda s, d: _by_distance(s, d, s.cameras == 0)),
    ),
    "weighted principal distance": (
        "camera",
        lambda s: s.focal_sd > 0,
        lambda s, d: replace(s, focal=s.focal + d),
    ),
    "control of one accuracy": ("control-set", lambda s: np.ndim(s.control_sd) > 0, _of_set),
    "surface of heights": (
        "control-heights",
        lambda s: not s.close and len(s.control) > 0,
        _surface,
    ),
    "boresight": ("boresight", _has_attitudes, _misaligned(slice(None))),
    "one attitude": ("attitude X", _has_attitudes, _misaligned(slice(1, 2))),
    "scale of the network": ("scale", lambda s: s.gnss is not None and len(s.bars) > 0, _scaled),
    "target of a point": ("object-point", _has_target, _images(_displaced)),
    "GNSS of the next photo": ("gnss-next", _has_positions, _gnss(lambda s, _: _assigned(s, 1))),
    "GNSS of the photo before": ("gnss-previous", _has_positions, _gnss(lambda s, _: _assigned(s, -1))),
    "control bent": (
        "bending",
        lambda s: not s.close and len(s.control) > 4 and s.gnss is None,
        _bent,
    ),
    "control bent against GNSS": (
        "control-bending",
        lambda s: not s.close and len(s.control) > 4 and s.gnss is not None,
        _bent,
    ),
    "one image": ("image X", lambda s: True, _images(_one_image)),
    "order of angles": (
        "",
        _has_attitudes,
        _attitudes(lambda own: _phi_omega_kappa(*angles_of(own.T)).T),
    ),
    "angles in gon": (
        "",
        _has_attitudes,
        _attitudes(lambda own: rotation(*(0.9 * np.array(angles_of(own.T)))).T),
    ),
    "control heights in feet": ("", _has_control, _coordinates(lambda own: own / [1, 1, 0.3048])),
    "control in feet": ("", _has_control, _coordinates(lambda own: own / 0.3048)),
    "control axes exchanged": ("", _has_control, _coordinates(lambda own: own[:, [1, 0, 2]])),
    "names exchanged": ("", lambda s: True, _exchanged),
    "one name for two points": ("", lambda s: True, _merged),
    "two names for one point": ("", lambda s: True, _split),
    "control more accurate": (
        "",
        lambda s: len(s.control) > 0 and np.max(s.control_sd) > 0,
        lambda s, _: replace(s, control_sd=s.control_sd / 10),
    ),
    "attitudes more accurate": ("", _has_attitudes, lambda s, _: replace(s, attitude_sd=s.attitude_sd / 10)),
    "distances more accurate": ("", lambda s: len(s.bars) > 0, lambda s, _: replace(s, bar_sd=s.bar_sd / 10)),
    "GNSS more accurate": (
        "",
        _has_positions,
        lambda s, _: replace(s, gnss_sd=s.gnss_sd / 10),
    ),
    "images less accurate": ("", lambda s: True, lambda s, _: replace(s, image_sd=s.noise * 10)),
    "images more accurate": ("", lambda s: True, lambda s, _: replace(s, image_sd=s.noise / 10)),
    "all photos twice": ("", lambda s: True, _twice),
    "all points twice": ("", lambda s: True, _points_twice),
    "all distances twice": ("", lambda s: len(s.bars) > 0, lambda s, _: replace(s, bars=[*s.bars, *s.bars])),
}
"""The hypothesis that has the size of a mistake, whether a survey can have it, and what it does."""


GIVEN = {
    "control-scale": 0.002,
    "control-rotation": 0.005,
    "camera-f": 36.0,
    "camera-point": 20.0,
    "camera-size": 0.005,
    "photo": 20.0,
    "camera-radial": 0.005,
    "camera-affinity": 1e-3,
    "camera-f-strip": 10.0,
    "camera-f-half": 10.0,
    "camera-exchanged": 1.0,
    "distance-scale": 0.002,
    "gnss-next": 1.0,
    "readout-time": 0.05,
    "readout-time-columns": 0.05,
    "gnss-previous": 1.0,
    "boresight": 1e-3,
    "attitude X": 1e-3,
    "camera-term": 0.005,
    "camera-f-single": 10.0,
    "camera": 20.0,
    "scale": 0.002,
    "image X": 5.0,
}
"""Sizes of errors that have no minimal detectable bias, in pixels or exposures."""

LARGEST = {"readout-time": 0.5, "readout-time-columns": 0.5}
"""Sizes in exposures that errors do not exceed: a readout ends before the next one."""

ACCURACY = frozenset(
    {
        *("images less accurate", "images more accurate", "GNSS more accurate"),
        *("control more accurate", "attitudes more accurate", "distances more accurate"),
    }
)
"""Mistakes of given standard deviations: those of the result must not be wrong by more than 1.5."""

TWICE = frozenset({"all photos twice", "all points twice", "all distances twice"})
"""Mistakes that make standard deviations too small, and are never to be accepted."""
