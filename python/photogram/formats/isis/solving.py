"""Trajectories with jigsaw corrections, shared by the images of an observation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.csm.isd import Isd, Polynomials, Positions, Turns, fitted, of_angles, to_angles
from photogram.formats.csm.photos import trajectory_of
from photogram.formats.isis.settings import Settings
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.motion import given_poses
from photogram.network.trajectories import Polynomial, Trajectory
from photogram.words import phrase


@dataclass(frozen=True, eq=False)
class Solving:
    """The trajectory of an image, in metres and radians, and its initial polynomials.

    `position` and `angles` are (3, n) coefficients of the polynomials that replace the tables and receive
    corrections. Time is reduced to the centre of a table and scaled by half of its span. They are 0 if the
    tables are used. `over` is True for tables of positions, and of angles, that are used.
    """

    trajectory: Trajectory
    position: Floats
    angles: Floats
    over: tuple[bool, bool]


def solving(isd: Isd, name: str, settings: Settings, *, held: bool, first: Isd) -> Solving:
    """Return the free parameters of an image or an observation; none if it is fixed.

    `isd` contains the tables of all images of an observation. `first` is its first image, which defines time
    origin and initial polynomials, as in jigsaw.
    """
    counts = (0, 0) if held else (settings.position_coefficients, settings.angle_coefficients)
    position, isd, places = _positions(isd, first.position, settings, counts[0])
    rotation, isd, angles = _angles(isd, first.pointing, settings, counts[1])
    own = trajectory_of(isd, name, interpolation="isis", position=position)
    over = settings.over_hermite, settings.over_existing
    return Solving(replace(own, rotation=rotation, angles="zxz"), places, angles, over)


def _scaled(times: Floats) -> tuple[float, float]:
    """Return the centre and half of the span of records; 1 s for a single record."""
    return float(times[0] + times[-1]) / 2, float(times[-1] - times[0]) / 2 or 1.0


def _positions(
    isd: Isd, own: Positions, settings: Settings, count: int
) -> tuple[Polynomial | None, Isd, Floats]:
    """Return position corrections, support data they refer to, coefficients.

    The initial polynomials are fitted to the image's own records; the support data may extend beyond them.
    """
    if not count:
        return None, isd, np.zeros((3, 0))
    reference, scale = _scaled(own.times)
    sd = deviations(settings.position_sigmas, count, count - 1)
    basis = Polynomial(count - 1, reference, scale, sd=sd)
    if settings.over_hermite:
        return basis, isd, np.zeros((3, count))
    fit = _fit(own.times, own.places, settings.spk_degree, max(settings.spk_solve_degree, count - 1))
    if len(own.times) > 1:
        times, places = fit.sampled(float(isd.position.times[0]), float(isd.position.times[-1]))
        isd = replace(isd, position=Positions(times, places, None, "lagrange"))
    return basis, isd, fit.coefficients


def _angles(isd: Isd, own: Turns, settings: Settings, count: int) -> tuple[Polynomial | None, Isd, Floats]:
    """Return angle corrections, support data they refer to, coefficients.

    Polynomial angles are added to a table of one record, the attitude at the centre.
    """
    if not count:
        return None, isd, np.zeros((3, 0))
    degree = count - 1 if settings.over_existing else max(settings.ck_solve_degree, count - 1)
    reference, scale = _scaled(own.times)
    sigmas = [None if each is None else float(np.deg2rad(each)) for each in settings.angle_sigmas]
    sd = deviations(sigmas, count, degree)
    if not settings.twist:
        sd[:, 2] = 0.0
    if settings.over_existing:
        return Polynomial(degree, reference, scale, sd=sd), isd, np.zeros((3, degree + 1))
    fit = _fit(own.times, to_angles(own.matrices), settings.ck_degree, degree)
    value = fit.coefficients.T.copy()
    value[0] = 0.0
    middle = Turns(np.array([reference]), of_angles(fit.coefficients[:, :1].T), "linear")
    basis = Polynomial(degree, reference, scale, value=value, sd=sd)
    return basis, replace(isd, pointing=middle), fit.coefficients


def _fit(times: Floats, values: Floats, fitted_degree: int, degree: int) -> Polynomials:
    """Return fitted polynomials as polynomials of another degree, padded or truncated."""
    fit = fitted(times, values, min(fitted_degree, len(times) - 1))
    padded = np.pad(fit.coefficients, ((0, 0), (0, degree)))
    return fit._replace(coefficients=padded[:, : degree + 1])


def deviations(sigmas: Sequence[float | None], count: int, degree: int) -> Floats:
    """Return (degree + 1, 3) standard deviations; the first `count` are free."""
    given = [np.inf if sigma is None else sigma for sigma in sigmas]
    of_degrees = [*given, *[np.inf] * count][:count] + [0.0] * (degree + 1 - count)
    return np.repeat(of_degrees, 3).reshape(-1, 3)


_KEYWORDS: Mapping[str, int | None] = {
    r"LO[345]/[HM]RC/": 3,
    r"MRO/HIRISE/": 3,
    r"TGO/CaSSIS/": 3,
    r"JUNO/JNC/": 4,
    r"LRO/.*/NAC[LR]$": None,
    r"APOLLO1[567]/METRIC/": None,
    r"MRO/CTX/": None,
    r"MGS/MOC": None,
}
"""Start of serial numbers, and number of their keywords (between slashes) that name the observation, as in
ISIS (`ObservationKeys` of `appdata/serialnumbers`). None: all keywords, so that each image is an observation.
"""
APART = 5.0  # Largest difference (pixels) of poses of one flight between images with overlapping tables
COMPARED = 16  # Number of times for the comparison


def observation_number(serial: str) -> str:
    """Return the observation of an image from its serial number."""
    count = next((count for begin, count in _KEYWORDS.items() if re.match(begin, serial)), 0)
    if count == 0:
        raise InputError(phrase("isis.observation-rule", image=serial))
    return serial if count is None else "/".join(serial.split("/")[:count])


def observations_of(serials: Sequence[str], *, shared: bool) -> dict[str, list[str]]:
    """Return the images of each observation by number."""
    found: dict[str, list[str]] = {}
    for serial in serials:
        found.setdefault(observation_number(serial) if shared else serial, []).append(serial)
    return found


def one_flight(isds: Sequence[Isd]) -> Isd:
    """Return the first support data with the tables of all, which must agree."""
    first, *others = isds
    for each in others:
        _check(first, each)
    positions = [each.position for each in isds]
    times, rows = _once([each.times for each in positions])
    speeds = [each.velocities for each in positions if each.velocities is not None]
    return replace(
        first,
        position=Positions(
            times,
            np.concatenate([each.places for each in positions])[rows],
            np.concatenate(speeds)[rows] if len(speeds) == len(isds) else None,
            first.position.interpolation,
        ),
        pointing=_joined([each.pointing for each in isds]),
        body=_joined([each.body for each in isds]),
    )


def _once(times: Sequence[Floats]) -> tuple[Floats, Indices]:
    """Return different times in order, and the first record of each."""
    own, rows = np.unique(np.concatenate(times), return_index=True)
    return own, rows


def _joined(tables: Sequence[Turns]) -> Turns:
    """Return one table of all records, with one record per time."""
    times, rows = _once([each.times for each in tables])
    return Turns(times, np.concatenate([each.matrices for each in tables])[rows], tables[0].interpolation)


def _check(first: Isd, other: Isd) -> None:
    """Reject an image whose tables contradict the poses of the first one."""
    one, two = (trajectory_of(each, "flight", interpolation="isis") for each in (first, other))
    begin, end = max(one.reach[0], two.reach[0]), min(one.reach[1], two.reach[1])
    if not begin < end:
        return
    # Single records have equal times.
    times = np.linspace(begin, end, COMPARED) if np.isfinite(end - begin) else np.array([first.time])
    (places, axes), (others, turned) = (given_poses(each, times) for each in (one, two))
    (x, y), _ = first.detector.planes["isis"].matrix.T
    pixel = float(np.hypot(x, y)) / abs(first.focal_length)
    heights = np.linalg.norm(places, axis=1) - max(first.radii)
    shift = float((np.linalg.norm(places - others, axis=1) / heights).max()) / pixel
    turn = float(np.linalg.norm(axes - turned, axis=(1, 2)).max()) / np.sqrt(2.0) / pixel
    if not max(shift, turn) < APART:
        raise InputError(
            phrase("isis.flight", path=first.path, shift=shift, turn=turn, limit=APART), file=other.path
        )
