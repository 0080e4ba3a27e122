"""Initial cameras, poses and rig from board corners only, for any lens.

A nominal camera is based on its data sheet and serves to plan images of a board.
"""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.arrays import argument_error, number
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.targets.board import Board
from photogram.targets.corners import MIN_CORNERS_PER_VIEW, Corners
from photogram.targets.first_camera import (
    FAMILIES,
    MAX_VIEW_MISFIT,
    NARROW,
    adjusted_views,
    first_camera,
    picture_size,
    rays_of,
    usual_models,
)
from photogram.targets.lens_fit import KNOTS, fitted, free_names, grid_of_pixels, lens_of
from photogram.targets.regularisation import WEAK_KNOT_SD
from photogram.targets.sightings import (
    CORNER_ORDERS,
    Sightings,
    angles_apart,
    centres,
    frontal_tilts,
    nearest_rotations,
    poses,
    ray_homographies,
)
from photogram.targets.vision import composed, inverted
from photogram.words import Phrase, phrase

WIDE_FAMILY = "fisheye"  # equidistant
PRIOR_SHIFT_OF_WIDTH = 0.1  # sd of image points from each free parameter of a nominal camera, in image widths
RATIONAL_TERM = "k6"  # a term in the denominator


def nominal_camera(
    size: tuple[int, int],
    model: str | None = None,
    *,
    field: float | None = None,
    focal: float | None = None,
    knots: tuple[int, int] = KNOTS,
) -> Camera:
    """Return a nominal camera with free calibration parameters.

    Its principal point is in the image centre. Below 90 degrees of field it is a perspective lens without
    distortion, above an equidistant lens, to which the model terms are fitted. Lenses with denominator terms
    are always fitted, since these terms are not separable from the numerator without distortion.

    Parameters
    ----------
    size
        Image width and height, pixels.
    model
        Lens model as in :func:`first_values`; None: the usual one for the field of view.
    field, focal
        Horizontal field of view, degrees, or focal length, pixels: exactly one.
    knots
        Number of knots along columns and rows, for a splined lens.

    Raises
    ------
    InputError
        If neither or both of field and focal length are given, or if they are invalid. If the model is
        unknown or cannot represent the camera.
    """
    if (field is None) == (focal is None):
        raise InputError(phrase("targets.nominal", count=2 * (field is not None)))
    if field is None:
        focal = number("focal", focal, "positive")
        flat = 2 * math.atan(size[0] / (2 * focal))
        angle = flat if flat < NARROW else size[0] / focal
    else:
        angle = math.radians(number("field", field))
    if not 0 < angle <= 2 * math.pi:
        raise argument_error("field", "range", low=0, high=360, value=math.degrees(angle))
    if focal is None:
        focal = size[0] * (1 / (2 * math.tan(angle / 2)) if angle < NARROW else FAMILIES[WIDE_FAMILY](angle))
    half = math.hypot(*size) / (2 * focal)
    wanted = model or usual_models(angle, math.atan(half) if angle < NARROW else half)[0]
    centre = {"cx": (size[0] - 1) / 2, "cy": (size[1] - 1) / 2}
    source = Camera(WIDE_FAMILY, {"fx": focal, "fy": focal, **centre}, unit="px", name="camera")
    lens = lens_of(wanted, source, size, knots)
    if angle < NARROW and RATIONAL_TERM not in free_names(lens):
        source = source.replace(model="pinhole")
    return fitted(source, wanted, size, knots=knots)


def weakly_known(camera: Camera, size: tuple[int, int]) -> Camera:
    """Return a camera with weak priors that move image points by a tenth of the width.

    They represent a data sheet. They make any number of views determine the camera, and hardly affect
    parameters that views determine well. Knots have their usual weights.
    """
    if camera.knots is not None:
        return camera.replace(knot_sd=WEAK_KNOT_SD) if camera.knot_unknowns else camera
    partials = camera.partials(camera.rays(grid_of_pixels(size)))[2]
    reach = np.nanmax(np.linalg.norm(partials, axis=1), axis=0)
    sd = {
        name: PRIOR_SHIFT_OF_WIDTH * size[0] / own if math.isinf(given) else given
        for name, own, given in zip(camera.names, reach.tolist(), camera.deviations.tolist(), strict=True)
    }
    return camera.replace(sd=sd)


MAX_SENSOR_DIFFERENCE = 0.2  # radians, and relative to the board distance
PREFERENCE_OF_UNTURNED = 1e-3  # larger misfit in the same units accepted for an unrotated board


@dataclass(frozen=True, eq=False)
class Rig:
    sensors: Floats  # (K, 4, 4) from the reference of a camera to the camera
    references: Indices  # (K,) first camera of its group with common views
    turned: Indices  # (P,) the key of `turns` with the corner order of an image; 0: as numbered
    apart: Bools  # (P,) whether an image disagrees with the pose of its camera on the rig


def connected(poses: Floats, cameras: Indices, views: Indices, count: int, turns: dict[int, Floats]) -> Rig:
    """Return poses of cameras on their rig, connected by most common views.

    Each camera is connected to an earlier one. Poses are (P, 4, 4) board -> camera of each image, NaN if
    unknown; cameras and views are (P,), `count` is K. `turns` contains undetected board rotations by corner
    order; order 0 is the identity.
    """
    sensors, references = np.tile(np.eye(4), (count, 1, 1)), np.full(count, -1)
    found, turned = poses.copy(), np.zeros(len(poses), dtype=np.int64)
    apart = np.zeros(len(poses), dtype=bool)
    known = np.isfinite(poses).all(axis=(1, 2))
    seen = np.full((count, int(views.max(initial=-1)) + 1), -1)
    seen[cameras[known], views[known]] = np.flatnonzero(known)
    common = (seen >= 0).astype(np.int64) @ (seen >= 0).T
    while (references < 0).any():
        done, rest = np.flatnonzero(references >= 0), np.flatnonzero(references < 0)
        shared = common[np.ix_(done, rest)]
        if not shared.any():
            references[rest[0]] = rest[0]
            continue
        before, own = (int(k) for k in np.unravel_index(np.argmax(shared), shared.shape))
        before, own = int(done[before]), int(rest[own])
        both = np.flatnonzero((seen[before] >= 0) & (seen[own] >= 0))
        first, second = seen[before, both], seen[own, both]
        step, orders, away = _relation(found[first], found[second], turns)
        references[own], sensors[own] = references[before], step @ sensors[before]
        turned[second], apart[second] = orders, away
        for order, turn in turns.items():
            rows = second[orders == order]
            found[rows] = found[rows] @ inverted(turn)
    return Rig(sensors, references, turned, apart)


def mean_pose(poses: Floats) -> Floats:
    """Return the mean pose: chordal mean attitude and median translation."""
    rotation = nearest_rotations(poses[:, :3, :3].mean(axis=0)[np.newaxis])[0]
    return composed(rotation, np.median(poses[:, :3, 3], axis=0))


def _relation(first: Floats, second: Floats, turns: dict[int, Floats]) -> tuple[Floats, Indices, Bools]:
    """Return the relative pose of two cameras, (m) board rotations, and outliers."""
    orders = np.array([*turns])
    turned = second[:, np.newaxis] @ np.linalg.inv(np.array([*turns.values()]))
    poses = turned @ np.linalg.inv(first)[:, np.newaxis]
    far = float(np.median(np.linalg.norm(first[:, :3, 3], axis=1)))
    scores = np.empty(poses.shape[:2])
    for board, turn in np.ndindex(*scores.shape):
        nearest = _apart(poses, poses[board, turn], far).min(axis=1)
        scores[board, turn] = np.minimum(nearest, MAX_SENSOR_DIFFERENCE).mean()
    scores[:, 1:] += PREFERENCE_OF_UNTURNED
    best = poses[np.unravel_index(np.argmin(scores), scores.shape)]
    distances = _apart(poses, best, far)
    chosen = np.argmin(distances + PREFERENCE_OF_UNTURNED * (orders > 0), axis=1)
    rows = np.arange(len(poses))
    agree = distances[rows, chosen] < MAX_SENSOR_DIFFERENCE
    return mean_pose(poses[rows, chosen][agree]), orders[np.where(agree, chosen, 0)], ~agree


def _apart(poses: Floats, other: Floats, far: float) -> Floats:
    """Return distances of (..., 4, 4) poses: attitude chords and relative shifts."""
    turns = np.linalg.norm(poses[..., :3, :3] - other[:3, :3], axis=(-2, -1)) / math.sqrt(2)
    shifts = np.linalg.norm(poses[..., :3, 3] - other[:3, 3], axis=-1) / far
    return np.asarray(turns + shifts)


MIN_TILT_RAD = math.radians(3.0)  # less tilted boards do not determine a focal length


@dataclass(frozen=True, eq=False)
class FirstCalibration:
    """Initial values of a calibration: K cameras, V views, P images.

    Attributes
    ----------
    cameras
        K cameras of the requested model; estimated parameters are free.
    sensors
        (K, 4, 4) from the reference camera to each camera, vision axes.
    references
        (K,) the reference of each camera: 0, or the first camera of its group connected by common views.
    poses
        (V, 4, 4) board -> reference of the first camera group with the view; NaN if unknown.
    picture_poses
        (P, 4, 4) board -> camera of the image; NaN if unknown.
    corners
        Corners, renumbered if they were listed in another order.
    without
        Images without a pose, and reasons.
    remarks
        Messages on corner orders, frontal views and separate cameras.
    """

    cameras: list[Camera]
    sensors: Floats
    references: Indices
    poses: Floats
    picture_poses: Floats
    corners: Corners
    without: dict[str, Phrase]
    remarks: list[Message]


def first_values(
    board: Board, corners: Corners, model: str | None = None, knots: tuple[int, int] = KNOTS
) -> FirstCalibration:
    """Compute initial cameras, rig and poses from board corners only.

    Parameters
    ----------
    board
        The board. If it is not planar, images that show only coplanar points get no pose.
    corners
        The corners of all cameras.
    model
        Requested lens: a model of `docs/cameras.md`, or `opencv4`, `opencv5`, `opencv8`, `opencv12`, i.e.
        `opencv_pinhole` with this number of terms. None: `opencv5` below 90 degrees of horizontal field,
        `opencv8` above. `opencv_fisheye` is used if corners are at the side of or behind the camera, or
        hardly determine `opencv8`. Knots of `splined_stereographic` are fitted to the default model.
    knots
        Number of knots along columns and rows, for a splined lens.

    Raises
    ------
    InputError
        If points are missing on the board, if a camera lacks usable images, or if the model is invalid.
    """
    seen = Sightings.of_corners(board, corners)
    in_a_plane, hidden_corners = phrase("targets.plane"), phrase("targets.hidden", least=MIN_CORNERS_PER_VIEW)
    without = {corners.pictures[row]: in_a_plane for row in np.flatnonzero(seen.in_a_plane()).tolist()}
    without |= corners.poor(board.places)
    usable = np.array([name not in without for name in corners.pictures], dtype=bool)
    cameras, remarks = [], list[Message]()
    for k, name in enumerate(corners.camera_names):
        own = seen.of((corners.cameras == k) & usable)
        if not len(own.xy):
            lost = [corners.pictures[row] for row in np.flatnonzero(corners.cameras == k).tolist()]
            reasons = [f"{each} ({without[each]})" for each in lost] or ["none"]
            raise InputError(phrase("targets.few-corners", camera=name, pictures=reasons))
        size = picture_size(own, corners.sizes[k])
        if corners.sizes[k] is None:
            fields = {"camera": name, "width": size[0], "height": size[1]}
            remarks.append(Message(phrase("targets.assumed-size", **fields)))
        camera, messages = first_camera(own, size, name, model, knots)
        cameras.append(camera)
        remarks += messages
    there = np.isfinite(_rays(seen, corners.cameras, cameras)).all(axis=2)
    hidden = usable & (np.count_nonzero(there, axis=1) < MIN_CORNERS_PER_VIEW)
    if (hidden == usable).all():
        raise InputError(phrase("targets.no-pose", model=cameras[0].model))
    without |= {corners.pictures[row]: hidden_corners for row in np.flatnonzero(hidden).tolist()}
    rows, orders = np.flatnonzero(usable & ~hidden), np.zeros(len(usable), dtype=np.int64)
    names = [corners.pictures[row] for row in rows.tolist()]
    pictures = Pictures(seen.of(rows), names, corners.cameras[rows], cameras)
    orders[rows], fits, of_orders = pictures.ordered()
    made = np.full((len(usable), 4, 4), np.nan)
    made[rows] = pictures.adjusted(orders[rows], fits)
    rig = connected(made, corners.cameras, corners.views, len(cameras), seen.listings.turns)
    for order, turn in seen.listings.turns.items():
        made[rig.turned == order] = made[rig.turned == order] @ inverted(turn)
    remarks += [*of_orders, *_of_rig(rig, corners)]
    frontal = np.flatnonzero(frontal_tilts(made) < MIN_TILT_RAD).tolist() if seen.is_flat else []
    if frontal:
        names = [corners.pictures[row] for row in frontal]
        remarks.append(Message(phrase("targets.frontal", n=len(frontal), names=names)))
    made, numbers = made @ seen.axes, seen.listings.points
    point = numbers[rig.turned[corners.picture], numbers[orders[corners.picture], corners.point]]
    return FirstCalibration(
        cameras=cameras,
        sensors=rig.sensors,
        references=rig.references,
        poses=_of_views(made, rig, corners),
        picture_poses=made,
        corners=corners.replace(point=point),
        without=without,
        remarks=remarks,
    )


def _of_rig(rig: Rig, corners: Corners) -> list[Message]:
    messages = []
    for row in np.flatnonzero(rig.turned).tolist():
        fields = {"picture": corners.pictures[row], "order": CORNER_ORDERS[rig.turned[row]]}
        messages.append(Message(phrase("targets.relisted", **fields)))
    if apart := [corners.pictures[row] for row in np.flatnonzero(rig.apart).tolist()]:
        messages.append(Message(phrase("targets.moved", names=apart)))
    alone = [name for k, name in enumerate(corners.camera_names) if k and rig.references[k] == k]
    return messages + [Message(phrase("targets.alone", camera=name)) for name in alone]


def _of_views(made: Floats, rig: Rig, corners: Corners) -> Floats:
    found = np.full((corners.view_count, 4, 4), np.nan)
    known = np.isfinite(made).all(axis=(1, 2))
    to_reference = np.linalg.inv(rig.sensors[corners.cameras]) @ made
    of = rig.references[corners.cameras]
    for view in range(corners.view_count):
        own = known & (corners.views == view)
        if own.any():
            agreeing = own & ~rig.apart if (own & ~rig.apart).any() else own
            found[view] = mean_pose(to_reference[agreeing & (of == of[agreeing].min())])
    return found


MIN_MISFIT_RAD = 1e-6
EQUAL_MISFIT_RATIO = 1.5  # largest misfit ratio of an order equivalent to the best


def _rays(seen: Sightings, of_cameras: Indices, cameras: list[Camera]) -> Floats:
    found = np.full((*seen.xy.shape[:2], 3), np.nan)
    for k, camera in enumerate(cameras):
        own = of_cameras == k
        found[own] = rays_of(camera, seen.xy[own])
    return found


def _limit(misfit: Floats) -> float:
    return max(MAX_VIEW_MISFIT * float(np.median(misfit.min(axis=1))), MIN_MISFIT_RAD)


@dataclass(frozen=True, eq=False)
class Pictures:
    seen: Sightings  # Board observations in the images
    names: list[str]  # P names
    of_cameras: Indices  # (P,) camera of each image
    cameras: list[Camera]  # The cameras, with their initial values

    def adjusted(self, orders: Indices, fits: Bools) -> Floats:
        """Return (P, 4, 4) poses board -> camera for corner orders (P,), adjusted if they fit (P,)."""
        seen = self.seen.listed(orders)
        found = poses(ray_homographies(seen.coordinates, _rays(seen, self.of_cameras, self.cameras)))
        for k, camera in enumerate(self.cameras):
            own = (self.of_cameras == k) & fits
            held = camera.replace(sd=0.0, knot_sd=None)
            done = adjusted_views(held, seen.of(own), found[own]) if own.any() else None
            if done is not None:
                found[own] = done.poses
        return found

    def ordered(self) -> tuple[Indices, Bools, list[Message]]:
        """Return (P,) corner order of each image, whether it fits, and warnings.

        The numbered order is used if an image fits as well as most images do, and shows the same side as
        most. By default this is the front, x to the right and y down. Otherwise, the first order with both
        properties is used.
        """
        listings, rows = self.seen.listings, np.arange(len(self.names))
        # Misfits (rad) by order, and z signs of the cameras
        misfit = np.full((len(rows), len(listings.points)), np.inf)
        front = np.full(misfit.shape, -1.0)
        for order in listings.shapes:
            misfit[:, order], front[:, order] = self._in_order(order, rows)
        odd = misfit[:, 0] > _limit(misfit)
        odd |= front[:, 0] != (1.0 if front[~odd, 0].sum() > 0 else -1.0)
        for order in {*range(len(listings.points))} - {*listings.shapes} if odd.any() else ():
            misfit[odd, order], front[odd, order] = self._in_order(order, rows[odd])
        best, limit = misfit.min(axis=1, keepdims=True), _limit(misfit)
        fits = (misfit <= limit) & (misfit <= np.maximum(EQUAL_MISFIT_RATIO * best, MIN_MISFIT_RAD))
        fits[:, 0] |= misfit[:, 0] <= limit
        side = 1.0 if front[fits[:, 0], 0].sum() > 0 else -1.0
        right = fits & (front == side)
        orders = np.argmax(right, axis=1)
        return orders, fits.any(axis=1), self._told(orders, fits, right)

    def _in_order(self, order: int, rows: Indices) -> tuple[Floats, Floats]:
        seen = self.seen.of(rows).listed(np.full(len(rows), order))
        rays = _rays(seen, self.of_cameras[rows], self.cameras)
        found = ray_homographies(seen.coordinates, rays)
        misfit = np.nanmedian(angles_apart(seen.coordinates, rays, found), axis=1)
        if not seen.listings.one_sided:
            return misfit, np.full(len(rows), -1.0)
        return misfit, np.sign(centres(poses(found))[:, 2])

    def _told(self, own: Indices, fits: Bools, right: Bools) -> list[Message]:
        names = np.array(self.names)
        mirrored = fits.any(axis=1) & (~right.any(axis=1) | (fits[:, 0] & (own > 0)))
        other = right.any(axis=1) & ~mirrored
        remarks = []
        if (bad := ~fits.any(axis=1)).any():
            fields = {"names": names[bad].tolist(), "factor": MAX_VIEW_MISFIT}
            remarks.append(phrase("targets.odd-orders", **fields))
        for which, code in ((mirrored, "targets.mirrored-order"), (other & (own > 0), "targets.other-order")):
            for order in np.unique(own[which]).tolist():
                fields = {"names": names[which & (own == order)].tolist(), "order": CORNER_ORDERS[order]}
                remarks.append(phrase(code if order else "targets.mirrored", **fields))
        if len(own) > 1 and other.all() and (own > 0).all():
            remarks.append(phrase("targets.all-orders"))
        return [Message(remark) for remark in remarks]
