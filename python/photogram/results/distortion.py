"""Distortion of an adjusted camera along and across the radius, with standard deviations.

A curve dr(r) of the radial terms k has the partials J = d(dr)/dk. With the cofactors Q of the terms its
standard deviation is s(r) = sigma0 sqrt(J Q J'). Measurements also depend on the principal distance c. A
forward camera maps a ray to r + dr, which changes by J dk + (r / c) dc. A backward camera maps a measured
position to the ray (r + dr) / c, which changes by (J dk - (r / c) dc) / c. Therefore the standard deviation
of the mapping uses (J, r / c) or (J, -r / c) with the cofactors of k and c. For the balanced curve a part B
r, which c can absorb, is subtracted so that the curve is zero at r0: J - r w with w = J(r0) / r0. The
principal distance is then c / (1 + B), or c (1 + B) for forward cameras.

The effect of the other terms (decentring, affinity and shear, the sets of Ebner and Gruen, thin prisms) is
computed on a grid of image positions. With the terms p, their partials J at a position and their cofactors Q,
the vector has the covariance sigma0^2 J Q J'.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.network.motion import focal_images
from photogram.results.parts import AdjustedCamera

if TYPE_CHECKING:
    from photogram import Result

DISTANCES = ("c", "f", "fx")
INTERIOR = frozenset({*DISTANCES, "fy", "xp", "yp", "cx", "cy", "beta"})
"""Principal distance and point, and the beta of `eucm`, which is never 0; all others are distortion terms."""

RADIAL = re.compile(r"[KkA]\d|k")  # Names of radial terms

BALANCED_AT = 2.0 / 3.0  # r0 as a part of the largest observed radius
BEYOND = 1.25  # End of a curve as a multiple of the largest observed radius
ROWS = 51  # Radii of a curve


@dataclass(frozen=True, eq=False)
class DistortionCurve:
    """Radial distortion at n radii, in the unit of image coordinates.

    Attributes
    ----------
    direction
        `backward`: corrections of measured coordinates, by measured radius; `forward`: corrections of ideal
        coordinates, by ideal radius.
    radii
        (n,) from 0.
    values, sd
        (n,) the curve and its standard deviations for a known principal distance.
    sd_mapping
        (n,) standard deviations of the complete mapping, including the principal distance.
    balanced, sd_balanced
        (n,) the curve that is zero at `balanced_at`, and its standard deviations.
    balanced_at
        r0.
    balanced_distance
        The signed principal distance of the balanced curve.
    observed
        The largest radius of an image; values at larger radii are extrapolated.
    """

    direction: str
    radii: Floats
    values: Floats
    sd: Floats
    sd_mapping: Floats
    balanced: Floats
    sd_balanced: Floats
    balanced_at: float
    balanced_distance: float
    observed: float


def observed_rows(curve: DistortionCurve, count: int) -> Indices:
    """Return the indices of up to `count` equidistant radii with images."""
    inside = np.flatnonzero(curve.radii <= curve.observed * (1 + 1e-9))
    return np.asarray(inside[np.unique(np.linspace(0, len(inside) - 1, count).round().astype(int))])


def rows_of_images(result: Result, camera: AdjustedCamera) -> Indices:
    block = result.block
    row = block.camera_names.index(camera.name)
    return np.flatnonzero(result.used_images & (np.asarray(block.photo_cameras) == row)[block.image_photos])


def _images(result: Result, camera: AdjustedCamera) -> Floats:
    """Return (k, 2) used images of a camera in the focal plane."""
    return np.asarray(focal_images(result.block)[rows_of_images(result, camera)])


def _largest_radius(xy: Floats, camera: Camera) -> float:
    """Return the largest distance of images from the principal point; ideal if forward."""
    if not len(xy):
        return 0.0
    if camera.direction == "backward":
        names = ("xp", "yp") if "xp" in camera.names else ("cx", "cy")
        principal_point = [camera.parameters.get(name, 0.0) for name in names]
        return float(np.hypot(*(xy - principal_point).T).max())
    rays = camera.rays(xy)
    across = np.hypot(rays[:, 0], rays[:, 1])
    # The argument of radial terms: the tangent of the angle from the axis, or the angle.
    ideal = np.arctan2(across, -rays[:, 2]) if _is_fisheye(camera) else across / -rays[:, 2]
    return camera.scale * float(np.max(ideal[np.isfinite(ideal)], initial=0.0))


def compared_places(camera: Camera, xy: Floats) -> Callable[[Camera], Floats]:
    """Return the function that computes the coordinates that a camera compares, of (n, 2) image positions.

    They are images of the rays of `camera` if forward, and corrected measurements if backward.
    """
    if camera.direction == "backward":
        return lambda changed: _photocore.camera_correct(changed.model, changed.values, xy)
    rays = camera.rays(xy)
    return lambda changed: changed.project(rays)


def partials_of(
    evaluate: Callable[[Camera], Floats], camera: Camera, names: Sequence[str], reach: float
) -> Floats:
    """Return (k, ...) central differences; steps move images within `reach` by about a millionth of it."""
    found = []
    for name in names:
        value, step = camera.parameters[name], 1e-6 * reach ** camera.powers[name]
        after, before = (
            evaluate(camera.replace(parameters={**camera.parameters, name: value + sign * step}))
            for sign in (1, -1)
        )
        found.append((after - before) / (2 * step))
    return np.array(found)


def distortion_curve(
    result: Result, camera: AdjustedCamera, radii: Floats | None = None
) -> DistortionCurve | None:
    """Return the distortion curve of a camera; None without radial terms or images.

    Parameters
    ----------
    result
        The result with the camera.
    camera
        The camera.
    radii
        (n,) in the unit of image coordinates; by default equidistant to 1.25 times the largest observed
        radius.
    """
    terms = [k for k, name in enumerate(camera.names) if RADIAL.fullmatch(name)]
    used = any(camera.values[k] != 0 or k in camera.estimated for k in terms)
    observed = _largest_radius(_images(result, camera), camera.camera)
    if not used or observed == 0:
        return None
    at = np.linspace(0.0, BEYOND * observed, ROWS) if radii is None else np.asarray(radii, dtype=np.float64)
    r0 = BALANCED_AT * observed
    both = np.append(at, r0)
    curve, partials = radial_curve(camera.camera, terms, both)
    covariance = camera.covariance
    distance = next(k for k, name in enumerate(camera.names) if name in DISTANCES)
    c = float(camera.values[distance])
    part, backward = curve[-1] / r0, camera.camera.direction == "backward"
    with_distance = np.column_stack([partials, -both / c if backward else both / c])
    balanced = partials - np.outer(both / r0, partials[-1])
    return DistortionCurve(
        direction=camera.camera.direction,
        radii=at,
        values=curve[:-1],
        sd=curve_deviations(covariance, terms, partials)[:-1],
        sd_mapping=curve_deviations(covariance, [*terms, distance], with_distance)[:-1],
        balanced=(curve - part * both)[:-1],
        sd_balanced=curve_deviations(covariance, terms, balanced)[:-1],
        balanced_at=r0,
        balanced_distance=c / (1.0 + part) if backward else c * (1.0 + part),
        observed=observed,
    )


def curve_deviations(covariance: Floats, terms: list[int], partials: Floats) -> Floats:
    """Return (r,) sd of a curve with (r, t) partials by the covariance of all parameters of the camera."""
    variances = np.einsum("ni,ij,nj->n", partials, covariance[np.ix_(terms, terms)], partials)
    return np.asarray(np.sqrt(np.maximum(variances, 0.0)))


def radial_curve(camera: Camera, terms: list[int], radii: Floats) -> tuple[Floats, Floats]:
    """Return the (r,) curve of the radial terms with some indices, and its partials by these terms."""
    own, names = radial_part(camera), [camera.names[k] for k in terms]
    partials = partials_of(lambda changed: added_along(changed, radii), own, names, float(radii.max()))
    return added_along(own, radii), partials.reshape(-1, len(radii)).T


def radial_part(camera: Camera) -> Camera:
    """Return a camera with radial terms only, without principal point."""
    keep = {"c", "f", "fx", "fy", *camera.constants, *filter(RADIAL.fullmatch, camera.names)}
    return camera.replace(
        parameters={name: value if name in keep else 0.0 for name, value in camera.parameters.items()},
        sd=0.0,
        covariance=None,
    )


def added_along(camera: Camera, radii: Floats) -> Floats:
    """Return the correction of radii along x, of measured or ideal coordinates."""
    zero = np.zeros_like(radii)
    if camera.direction == "backward":
        corrected = _photocore.camera_correct(camera.model, camera.values, np.column_stack([radii, zero]))
        return np.asarray(corrected[:, 0] - radii)
    argument = radii / camera.scale
    across = np.sin(argument) if _is_fisheye(camera) else argument
    back = -np.cos(argument) if _is_fisheye(camera) else zero - 1.0
    middle = camera.project([[0.0, 0.0, -1.0]])[0, 0]
    images = camera.project(np.column_stack([across, zero, back]))[:, 0]
    return np.asarray(np.abs(images - middle) - radii)


def _is_fisheye(camera: Camera) -> bool:
    return "fisheye" in camera.model.lower()


GRID = 9  # Positions along either side of the observed part of the image


@dataclass(frozen=True, eq=False)
class LensField:
    """Distortion vectors at n positions, in the unit of image coordinates.

    Attributes
    ----------
    names
        The terms.
    positions
        (n, 2) image positions.
    vectors
        (n, 2) corrections by the terms: of measured coordinates if backward, of ideal ones if forward.
    covariances
        (n, 2, 2) of the vectors.
    """

    names: tuple[str, ...]
    positions: Floats
    vectors: Floats
    covariances: Floats

    @property
    def largest(self) -> int:
        """The index of the longest vector."""
        return int(np.argmax(np.hypot(*self.vectors.T)))


def lens_field(result: Result, camera: AdjustedCamera) -> LensField | None:
    """Return the vectors of a camera; None without such terms or without images."""
    names = tuple(
        name
        for k, name in enumerate(camera.names)
        if name not in INTERIOR | camera.camera.constants
        and not RADIAL.fullmatch(name)
        and (camera.values[k] != 0 or k in camera.estimated)
    )
    xy = _images(result, camera)
    if not names or not len(xy):
        return None
    sides = [np.linspace(low, high, GRID) for low, high in zip(xy.min(axis=0), xy.max(axis=0), strict=True)]
    positions = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    own = camera.camera
    images = compared_places(own, positions)
    rows = [camera.names.index(name) for name in names]
    reach = float(np.abs(positions).max())
    partials, covariance = partials_of(images, own, names, reach), camera.covariance[np.ix_(rows, rows)]
    without = own.replace(parameters={**own.parameters, **dict.fromkeys(names, 0.0)})
    return LensField(
        names=names,
        positions=positions,
        vectors=images(own) - images(without),
        covariances=np.einsum("ina,ij,jnb->nab", partials, covariance, partials, optimize=True),
    )
