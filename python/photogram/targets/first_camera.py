"""Initial values of one camera: best lens family, adjusted and converted.

Families and fields of view are tested without initial values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.arguments.types import Floats, Indices
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message, Undetermined
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.passages import KNOTTED
from photogram.targets.lens_fit import KNOTS, fitted, is_perspective, lens_of
from photogram.targets.sightings import (
    Sightings,
    angles_apart,
    focal_lengths,
    homographies,
    poses,
    ray_homographies,
)
from photogram.targets.vision import photo_poses, vision_poses
from photogram.words import phrase

ROUGH_TOLERANCE = 1e-3  # convergence limit of initial values, in standard deviations


@dataclass(frozen=True, eq=False)
class Adjusted:
    camera: Camera  # The camera with its estimated parameters free
    poses: Floats  # (P, 4, 4) board -> camera
    variance: float  # The variance of unit weight, px^2
    is_whole: bool  # Whether all free parameters were adjusted, converged, and are well determined


def adjusted_views(
    camera: Camera, seen: Sightings, poses: Floats, tolerance: float = ROUGH_TOLERANCE
) -> Adjusted | None:
    """Adjust a camera and view poses, with fewer free parameters if underdetermined.

    Unknown camera parameters are free; without any, only the poses are adjusted. Corners are in point order,
    poses (P, 4, 4) board -> camera are initial values. `tolerance` is defined in :func:`photogram.adjust`.
    None if all adjustments fail.
    """
    view, point = np.nonzero(np.isfinite(seen.xy[..., 0]))
    positions, attitudes = photo_poses(poses)
    block = Block(
        photo_positions=positions,
        photo_attitudes=attitudes.values("omega_phi_kappa"),
        point_positions=seen.places,
        point_sd=0.0,
        image_photos=view,
        image_points=point,
        image_xy=seen.xy[view, point],
        image_sd=np.repeat(seen.sd[view, point, np.newaxis], 2, axis=1),
        cameras=[camera],
        photo_cameras=0,
    )
    # All free parameters, then without the lens terms, then without the principal point
    names = [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd > 0]
    attempts: list[list[str]] = []
    for kept in ({*names}, {"f", "fx", "fy", "cx", "cy"}, {"f", "fx", "fy"}):
        free = [name for name in names if name in kept]
        if free not in attempts and (free or not names):
            attempts.append(free)
    for free in attempts:
        own = camera.replace(sd=dict.fromkeys(free, math.inf))
        try:
            result = adjust(block.replace(cameras=[own]), covariance=False, tolerance=tolerance)
        except AdjustmentError:
            continue
        if result.status == "diverged":
            continue
        turned = Attitudes.of("omega_phi_kappa", result.photo_attitudes)
        found = vision_poses(result.photo_positions, turned)
        adjusted = result.cameras[0].camera.replace(sd=camera.sd)
        squares, freedom = result.sum_and_freedom
        weak = any(isinstance(each, Undetermined) for each in result.messages)
        whole = free == attempts[0] and result.converged and not weak
        return Adjusted(adjusted, found, squares / max(freedom, 1.0), whole)
    return None


FIELDS_DEG = np.linspace(60.0, 200.0, 15)  # horizontal fields tested first
MAX_TRIAL_PICTURES = 24
FIELD_TOLERANCE_DEG = 0.5
RIVAL_MISFIT_RATIO = 1.5  # all families with misfits below this ratio are adjusted
MAX_VIEW_MISFIT = 5.0  # ratio of view misfit and median
DEFAULT_FOCAL_LENGTH = 1.2  # in image widths

# Wide families: focal length in image widths, by the horizontal field in radians
FAMILIES: Mapping[str, Callable[[float], float]] = MappingProxyType(
    {"fisheye": lambda field: 1 / field, "stereographic": lambda field: 1 / (4 * math.tan(field / 4))}
)


@dataclass(frozen=True, eq=False)
class Trial:
    camera: Camera  # Its free focal length and principal point
    orders: Indices  # (P,) the best corner order of each image
    misfits: Floats  # (P,) median angles (rad) between rays and board of each image

    @property
    def angle(self) -> float:
        """Median over the images, radians."""
        return float(np.median(self.misfits))

    @property
    def pixels(self) -> float:
        """Median near the axis, pixels, for the comparison of families."""
        return self.angle * self.camera.scale


def rays_of(camera: Camera, xy: Floats) -> Floats:
    """Return (P, n, 3) rays, vision axes, of (P, n, 2) pixels; NaN if undefined."""
    return np.asarray((camera.rays(xy.reshape(-1, 2)) * [1.0, -1.0, -1.0]).reshape(*xy.shape[:2], 3))


def misfits(seen: Sightings, rays: Floats) -> Floats:
    """Return (P,) median angles (rad) between the rays of images and board."""
    found = ray_homographies(seen.coordinates, rays)
    angles = angles_apart(seen.coordinates, rays, found)
    angles[np.isnan(angles).all(axis=1)] = np.inf
    return np.asarray(np.nanmedian(angles, axis=1))


def _tried(seen: Sightings, camera: Camera) -> Trial:
    own = []
    for order in seen.listings.shapes:
        listed = seen.listed(np.full(len(seen.xy), order))
        rays = rays_of(camera, listed.xy)
        if np.isnan(rays[np.isfinite(listed.xy).all(axis=2)]).any():
            return Trial(camera, np.zeros(len(seen.xy), dtype=np.int64), np.full(len(seen.xy), np.inf))
        own.append(misfits(listed, rays))
    best = np.argmin(own, axis=0)
    return Trial(camera, np.array(seen.listings.shapes)[best], np.min(own, axis=0))


def _camera(family: str, fx: float, fy: float, size: tuple[int, int]) -> Camera:
    parameters = {"fx": fx, "fy": fy, "cx": (size[0] - 1) / 2, "cy": (size[1] - 1) / 2}
    return Camera(family, parameters, dict.fromkeys(parameters, math.inf), unit="px")


def perspective(seen: Sightings, size: tuple[int, int]) -> Trial:
    """Return the perspective lens from homographies, with a default focal length."""
    first = _tried(seen, _camera("pinhole", size[0], size[0], size))
    found = homographies(seen.coordinates, seen.listed(first.orders).xy)
    fx, fy, f = focal_lengths(found, (np.array(size) - 1) / 2)
    if not (fx > 0 and fy > 0):
        fx = fy = f if f > 0 else DEFAULT_FOCAL_LENGTH * size[0]
    return _tried(seen, _camera("pinhole", fx, fy, size))


def wide(seen: Sightings, size: tuple[int, int], family: str) -> Trial:
    """Return the best lens of a wide family: fields of 60 to 200 degrees, then halved."""

    def tried(field: float) -> Trial:
        f = FAMILIES[family](math.radians(field)) * size[0]
        return _tried(seen, _camera(family, f, f, size))

    fields: dict[float, Trial] = {field: tried(field) for field in FIELDS_DEG.tolist()}
    step = float(FIELDS_DEG[1] - FIELDS_DEG[0])
    while step > FIELD_TOLERANCE_DEG:
        step /= 2
        best = min(fields, key=lambda field: fields[field].angle)
        fields |= {field: tried(field) for field in (best - step, best + step)}
    return min(fields.values(), key=lambda trial: trial.angle)


def trials(seen: Sightings, size: tuple[int, int]) -> list[Trial]:
    some = seen.of(np.arange(0, len(seen.xy), math.ceil(len(seen.xy) / MAX_TRIAL_PICTURES)))
    few = [perspective(some, size), *(wide(some, size, family) for family in FAMILIES)]
    found = [_tried(seen, trial.camera) for trial in few]
    found.sort(key=lambda trial: trial.pixels)
    return [trial for trial in found if trial.pixels <= RIVAL_MISFIT_RATIO * found[0].pixels]


def adjusted_family(seen: Sightings, found: list[Trial]) -> tuple[Trial, Adjusted | None]:
    """Return the family with the smallest adjusted variance; else the first."""
    ended = []
    for trial in found:
        fit = trial.misfits <= MAX_VIEW_MISFIT * trial.angle
        own = seen.of(fit).listed(trial.orders[fit])
        start = poses(ray_homographies(own.coordinates, rays_of(trial.camera, own.xy)))
        adjusted = adjusted_views(trial.camera, own, start)
        if adjusted is not None:
            ended.append((trial, adjusted))
    if not ended:
        return found[0], None
    return min(ended, key=lambda each: each[1].variance)


MAX_PICTURES = 62  # in an adjustment of initial values
NARROW, WIDEST = math.radians(90.0), math.radians(88.0)  # field of `opencv5`, axis angle of `opencv8`
TOLERANCE = 1e-5  # convergence limit of the adjustment, in standard deviations
MAX_VARIANCE_RATIO = 4.0  # ratio of lens variance and the simplest lens of its family
MAX_MISFIT_GROWTH = 1.5  # by one additional view
RADIUS_MARGIN = 1.05  # ratio of fit radius and the farthest corner


def picture_size(seen: Sightings, given: tuple[int, int] | None) -> tuple[int, int]:
    """Return image width and height: given, or centred on the corners."""
    if given is not None:
        return given
    low, high = np.nanmin(seen.xy, axis=(0, 1)), np.nanmax(seen.xy, axis=(0, 1))
    width, height = (max(math.ceil(a + b), math.ceil(b)) + 1 for a, b in zip(low, high, strict=True))
    return width, height


def first_camera(
    seen: Sightings, size: tuple[int, int], name: str, model: str | None, knots: tuple[int, int] = KNOTS
) -> tuple[Camera, list[Message]]:
    """Return a camera of the requested model with free parameters, and warnings.

    `seen` contains its images, `size` is their width and height in pixels. Without a model, the usual one for
    the field of view is used. The `knots` of a splined model, along columns and rows, are fitted to the usual
    one, since many are outside the corners.
    """
    used = seen.of(np.arange(0, len(seen.xy), math.ceil(len(seen.xy) / MAX_PICTURES)))
    trial, adjusted = adjusted_family(used, trials(used, size))
    family = (trial.camera if adjusted is None else adjusted.camera).replace(name=name)
    remarks = []
    if adjusted is None:
        remarks.append(Message(phrase("targets.rough", camera=name)))
    reach = RADIUS_MARGIN * float(np.nanmax(np.linalg.norm(seen.xy - (np.array(size) - 1) / 2, axis=2)))
    own = used.listed(trial.orders)
    splined = model == KNOTTED
    farthest = from_axis(family, seen.xy.reshape(-1, 2))
    if model is None or splined:
        ends = np.array([[0.0, (size[1] - 1) / 2], [size[0] - 1.0, (size[1] - 1) / 2]])
        field = float(np.arccos(np.clip(np.prod(family.rays(ends), axis=0).sum(), -1, 1)))
        models = usual_models(field, farthest)
    elif farthest >= math.pi / 2 and is_perspective(lens_of(model, family, size)):
        angle = math.degrees(farthest)
        raise InputError(phrase("targets.wide", camera=family.name, angle=angle, model=model))
    else:
        models = [model]
    for wanted in models:
        camera = fitted(family, wanted, size, radius=reach)
        done = _adjusted(own, trial, family, camera)
        if (
            done is not None
            and adjusted is not None
            and done.variance > MAX_VARIANCE_RATIO * adjusted.variance
        ):
            factor = math.sqrt(done.variance / adjusted.variance)
            fields = {"camera": name, "model": wanted, "factor": factor, "family": family.model}
            remarks.append(Message(phrase("targets.poor-lens", **fields)))
        if done is not None and done.is_whole:
            break
        remarks.append(Message(phrase("targets.weak-lens", camera=name, model=wanted)))
    found = camera if done is None else done.camera
    return (fitted(found, KNOTTED, size, knots=knots) if splined else found), remarks


def _adjusted(seen: Sightings, trial: Trial, family: Camera, camera: Camera) -> Adjusted | None:
    """Adjust a camera with the views that fit the family, and add further views.

    A two-parameter family may fit badly in the image corners. A view there is accepted if the lens, adjusted
    with it, fits it, and the misfit of the others does not increase.
    """
    start = poses(ray_homographies(seen.coordinates, rays_of(family, seen.xy)))
    fits = trial.misfits <= MAX_VIEW_MISFIT * trial.angle
    done = adjusted_views(camera, seen.of(fits), start[fits], TOLERANCE)
    if done is None:
        return None
    for row in np.argsort(trial.misfits)[np.count_nonzero(fits) :].tolist():
        before = float(np.median(misfits(seen.of(fits), rays_of(done.camera, seen.of(fits).xy))))
        more = fits | (np.arange(len(fits)) == row)
        wider = adjusted_views(done.camera, seen.of(more), start[more], TOLERANCE)
        if wider is None:
            break
        after = misfits(seen, rays_of(wider.camera, seen.xy))
        if not (
            after[row] <= MAX_VIEW_MISFIT * before
            and float(np.median(after[fits])) <= MAX_MISFIT_GROWTH * before
        ):
            break
        fits, done = more, wider
    return done


def usual_models(field: float, farthest: float) -> list[str]:
    """Return the usual models for a horizontal field and largest axis angle (rad)."""
    if farthest >= WIDEST:
        return ["opencv_fisheye"]
    return ["opencv5"] if field < NARROW else ["opencv8", "opencv_fisheye"]


def from_axis(camera: Camera, xy: Floats) -> float:
    """Return the largest angle (rad) of pixels from the camera axis, ignoring NaN."""
    rays = camera.rays(xy)
    return float(np.nanmax(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), -rays[:, 2])))
