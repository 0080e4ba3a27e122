"""Target calibration: board corners with initial values, its block, adjustment and simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram.adjustment.adjustment import Progress, adjust, adjusted
from photogram.adjustment.robust import Loss
from photogram.adjustment.snooping import snoop
from photogram.arguments.arrays import argument_error, one_of, shaped, value_field
from photogram.arguments.equality import Valued
from photogram.arguments.fields import array, check_arrays, check_fields, option
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.cameras import Camera, images_of
from photogram.network.moving_photos import Mount
from photogram.network.passages import Bend, Figure
from photogram.network.unknowns import Sensor
from photogram.results.result import Result
from photogram.results.snooping_options import SnoopOptions
from photogram.results.snooping_result import Snooped
from photogram.summaries import Brief, Rows, few
from photogram.targets.board import Board
from photogram.targets.calibration_result import Calibrated
from photogram.targets.corners import Corners, check_points
from photogram.targets.motion import MAX_GAP_SECONDS, POWERS, dated, moved, moving, pictures_in_motion
from photogram.targets.options import Regularisation, Shape, Synchronisation
from photogram.targets.regularisation import weighted_block
from photogram.targets.rounds import better_start, checked_clocks, marked_as_mrcal
from photogram.targets.vision import FLIP, photo_poses, transformed
from photogram.words import phrase

BOARD = "board"  # name of the bend among the common unknowns
SPLINE_TOLERANCE = 1e-6  # convergence limit of splined lenses, in standard deviations
MAX_ROUNDS = 8  # of better corner sd or board motion


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Calibration(Valued, Brief):
    """Board corners in images of K cameras with initial values: the adjustment input.

    Parameters
    ----------
    board
        The board.
    corners
        Its corners in P images and V views. Images with fewer than 6 corners, or with collinear ones, are
        omitted and listed in `messages`.
    cameras
        K cameras in pixels, with origin at the centre of the first. Free parameters have initial values.
    poses
        (V, 4, 4) of the views: board -> reference of the cameras that took the images of the view. Vision
        axes: x right, y down, z forward.
    sensors
        (K, 4, 4) reference -> camera k; None: one camera, or independent cameras.
    references
        (K,) the reference camera of each sensor. None: camera 0. For unsynchronised images, each camera is
        its own reference.
    sd0
        Standard deviation of a corner of level 0, pixels. None: unknown; the adjustment estimates it, and
        global tests are omitted.
    sync
        `known`: images of one view are simultaneous. `none`: every image has its own pose. `offset`: corners
        have times by the clock of each camera. An image of camera k with time t shows the board pose at t +
        tau_k by the clock of its reference (docs/targets.md).
    regularise
        `mrcal`: the weak priors of mrcal 2.2 on lens terms and centres. None: no priors.
    bend
        Initial centre deflections of the board along x and y for the shape `bend`, and fixed ones for the
        shape `held`.
    messages
        Warnings of the reader.
    assumed
        If `sd0` is None: standard deviation of a corner, pixels, relative to weighted board points. The
        adjustment estimates it.
    offsets, sd_offsets
        (K,) for `offset`: prior values of tau_k and their standard deviations, seconds; infinite: free.
    motion
        (V, 4, 6) for `offset`: motion of reference photos at the time of each view, as coefficients of powers
        1 to 4 of time. Positions are in the board axes, rotation vectors in the photo axes. None:
        interpolated from the poses of the views before and after.
    sd_sensors, sd_bend
        (K, 6) and (2,) standard deviations of `sensors` and `bend`; infinite: free. The sensor components
        follow :class:`photogram.network.Sensor`: position in the axes of the reference, rotations about its
        own axes in radians.

    Raises
    ------
    InputError
        If arrays have other shapes, if points are missing on the board, or if images lack used corners. If
        several cameras of a rig lack sensors. For `offset`, if image times are missing, or if all views lack
        neighbours within 0.2 s.
    """

    board: Board
    corners: Corners
    cameras: Sequence[Camera]
    poses: ArrayLike = field(metadata=array("views", 4, 4, missing=True))
    sensors: ArrayLike | None = field(default=None, metadata=array("cameras", 4, 4))
    references: ArrayLike | None = field(default=None, metadata=array("cameras", index="cameras"))
    sd0: float | None = option(None, 0, is_open=True)
    sync: Synchronisation = "known"
    regularise: Regularisation | None = None
    bend: tuple[float, float] = (0.0, 0.0)
    messages: Sequence[Message] = field(default=())
    assumed: float = 1.0
    offsets: ArrayLike = field(default=0.0, metadata=array("cameras"))
    sd_offsets: ArrayLike = field(default=np.inf, metadata=array("cameras"))
    motion: ArrayLike | None = None
    sd_sensors: ArrayLike = field(default=np.inf, metadata=array("cameras", 6))
    sd_bend: ArrayLike = field(default=np.inf, metadata=array(2))

    def __post_init__(self) -> None:
        check_fields(self)
        count = len(self.corners.camera_names)
        cameras = [each for each in self.cameras if isinstance(each, Camera) and each.unit == "px"]
        if len(cameras) != count or len(self.cameras) != count:
            value = value_field(self.cameras)
            raise InputError(phrase("targets.cameras", count=count, value=value))
        names = self.corners.camera_names
        named = [camera.replace(name=name) for camera, name in zip(cameras, names, strict=True)]
        self._set("cameras", tuple(named))
        if self.sensors is None and count > 1 and self.sync != "none":
            raise argument_error("sensors", "empty")
        if self.sensors is None:
            self._set("sensors", np.tile(np.eye(4), (count, 1, 1)))
        if self.sync == "none" or self.references is None:
            self._set("references", np.arange(count) if self.sync == "none" else np.zeros(count, np.int64))
        check_arrays(self, cameras=count, views=self.corners.view_count)
        check_points(self.corners, self.board)
        self._leave_out(np.asarray(self.poses))
        for name in ("sd_sensors", "sd_bend"):
            values = np.asarray(getattr(self, name))
            if wrong := values[~(values > 0)].tolist():
                raise InputError(phrase("targets.free-sd", name=name, value=wrong[0]))
        if self.sync == "offset":
            self._set_motion()

    def _set_motion(self) -> None:
        """Compute the board motion about each view; omit images with unknown motion."""
        corners, tied = self.corners, self.tied[self.corners.cameras]
        times = dated(corners, self.tied)
        if self.motion is None:
            found = moving(np.asarray(self.poses), times, self.references_of_views())
        else:
            found = shaped("motion", self.motion, (corners.view_count, POWERS, 6), missing=True)
        self._set("motion", found)
        lost = tied & ~(np.isfinite(found).all(axis=(1, 2)) & np.isfinite(times))[corners.views]
        if not (tied & ~lost).any():
            raise InputError(phrase("targets.no-offset", seconds=MAX_GAP_SECONDS))
        if lost.any():
            names = [corners.pictures[row] for row in np.flatnonzero(lost).tolist()]
            self._keep(~lost)
            self._set("messages", (*self.messages, Message(phrase("targets.no-motion", names=names))))

    def _keep(self, pictures: Bools) -> None:
        views = np.unique(self.corners.views[pictures])
        for name in ("poses", "motion"):
            if (own := getattr(self, name)) is not None:
                self._set(name, np.asarray(own)[views])
        self._set("corners", self.corners.of_pictures(pictures))

    def _leave_out(self, poses: Floats) -> None:
        poor = self.corners.poor(self.board.places)
        keep = np.array([name not in poor for name in self.corners.pictures], dtype=bool)
        unposed = keep & ~np.isfinite(poses[self.corners.views]).all(axis=(1, 2))
        keep &= ~unposed
        remarks = [phrase("targets.left-out", picture=name, reason=why) for name, why in poor.items()]
        if unposed.any():
            names = [self.corners.pictures[row] for row in np.flatnonzero(unposed).tolist()]
            remarks.append(phrase("targets.unposed", names=names))
        if not keep.any():
            raise InputError(phrase("targets.no-pictures", reasons=remarks))
        if not keep.all():
            self._keep(keep)
        self._set("messages", (*self.messages, *map(Message, remarks)))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the input."""
        return "Calibration", [
            ("board", self.board.described),
            ("shape", self.shape),
            ("cameras", few([each.title for each in self.cameras])),
            ("views", str(self.corners.view_count)),
            ("corners", f"{np.count_nonzero(self.corners.use):,}"),
        ]

    def replace(self, **changes: Any) -> Self:
        """Return the calibration with some fields replaced and validated."""
        return replace(self, **changes)

    def with_offsets(self, known: Mapping[str, tuple[float, float]]) -> Self:
        """Return the calibration with prior clock offsets of some cameras.

        Parameters
        ----------
        known
            Offsets and their standard deviations by camera name, seconds: 0 fixes an offset, infinite frees
            it.

        Raises
        ------
        InputError
            If a camera is unknown, is a reference, or has synchronised images.
        """
        places = {each.name: row for row, each in enumerate(self.cameras)}
        there = [name for name, row in places.items() if self.tied[row] and self.sync == "offset"]
        if strange := [name for name in known if name not in there]:
            if not there:
                raise InputError(phrase("targets.no-offsets", camera=strange[0]))
            raise InputError(phrase("targets.no-offset-of", camera=strange[0], names=there))
        offsets, sd = np.array(self.offsets), np.array(self.sd_offsets)
        for name, own in known.items():
            offsets[places[name]], sd[places[name]] = own
        return self.replace(offsets=offsets, sd_offsets=sd)

    @property
    def tied(self) -> Bools:
        """(K,) whether a camera is tied to another, its reference."""
        return np.asarray(np.asarray(self.references) != np.arange(len(self.cameras)))

    def picture_poses(self) -> Floats:
        """Return (P, 4, 4) the pose of each image: board -> its camera."""
        corners, sensors = self.corners, np.asarray(self.sensors)
        poses = np.asarray(self.poses)[corners.views]
        if self.sync == "offset" and corners.times is not None:
            late = np.asarray(self.offsets)[corners.cameras]
            steps = corners.times + late - dated(corners, self.tied)[corners.views]
            steps = np.where(self.tied[corners.cameras], steps, 0.0)
            poses = moved(poses, np.nan_to_num(np.asarray(self.motion))[corners.views], steps)
        return np.asarray(sensors[corners.cameras] @ poses)

    @property
    def shape(self) -> Shape:
        """Estimated shape of the board."""
        return self.board.shape_of(self.corners.view_count)

    def places(self) -> Floats:
        """Return (n, 3) the initial board points."""
        bent = any(self.bend) and self.shape != "points"
        return self.board.bent(*self.bend) if bent else self.board.places

    def frames(self) -> tuple[list[str], Indices]:
        """Return names of views without a reference image, and (V,) photos of views.

        Photos are the images, followed by one without image observations for each of these views: its frame.
        """
        corners = self.corners
        photo = np.full(corners.view_count, -1)
        first = ~self.tied[corners.cameras]
        photo[corners.views[first]] = np.flatnonzero(first)
        alone = np.flatnonzero(photo < 0)
        photo[alone] = len(corners.pictures) + np.arange(len(alone))
        names = corners.view_names()
        return [f"frame of {names[view]}" for view in alone.tolist()], photo

    def block(self, cameras: Sequence[Camera] | None = None) -> Block:
        """Return the block with images as photos and fixed or weighted board points.

        Parameters
        ----------
        cameras
            Cameras that replace the given ones.
        """
        corners, poses = self.corners, np.asarray(self.poses)
        frames, photo = self.frames()
        names = [*corners.pictures, *frames]
        alone = photo >= len(corners.pictures)
        centres, attitudes = photo_poses(np.concatenate([self.picture_poses(), poses[alone]]))
        use, tied = corners.use, zip(np.asarray(self.sensors), np.asarray(self.sd_sensors), strict=True)
        sensors = [
            Sensor.from_colmap(name, pose[:3, :3], pose[:3, 3], own)
            for name, (pose, own) in zip(corners.camera_names, tied, strict=True)
        ]
        mounts = [
            Mount(names[row], names[photo[corners.views[row]]], sensors[corners.cameras[row]])
            for row in np.flatnonzero(self.tied[corners.cameras] & (self.sync == "known")).tolist()
        ]
        return Block(
            photo_ids=names,
            photo_positions=centres,
            photo_attitudes=attitudes.values("omega_phi_kappa"),
            cameras=self.cameras if cameras is None else cameras,
            photo_cameras=np.concatenate([corners.cameras, self.references_of_views()[alone]]),
            point_ids=self.board.names,
            point_positions=self.board.places if self.shape == "bend" else self.places(),
            point_sd=self.board.deviations(corners.view_count),
            image_photos=corners.picture[use],
            image_points=corners.point[use],
            image_xy=corners.xy[use],
            image_sd=np.repeat(corners.sd[use, np.newaxis] * (self.sd0 or self.assumed), 2, axis=1),
            mounts=mounts,
            timed=pictures_in_motion(self, sensors) if self.sync == "offset" else [],
            linear_unit=self.board.unit,
            passages=[Figure(Bend(BOARD, self.bend, self.sd_bend), self.board.names, self.board.shifts())]
            if self.shape == "bend"
            else [],
        )

    def references_of_views(self) -> Indices:
        """Return (V,) the camera to which the pose of each view refers."""
        corners = self.corners
        reference = np.empty(corners.view_count, dtype=np.int64)
        reference[corners.views] = np.asarray(self.references)[corners.cameras]
        return reference

    def residuals(self) -> Floats:
        """Return (n, 2) observed minus computed corners with the given values, pixels."""
        return self.corners.xy - self._computed(self.places())

    def _computed(self, places: Floats) -> Floats:
        """Return (n, 2) the corners of board points (b, 3) with the given values, pixels."""
        corners = self.corners
        seen = transformed(self.picture_poses()[corners.picture], places[corners.point])
        return images_of(self.cameras, corners.cameras[corners.picture], seen @ FLIP)

    def without(self, images: Bools) -> Self:
        """Return the calibration without some images (m,) of its block."""
        use = self.corners.use.copy()
        use[np.flatnonzero(use)[images]] = False
        remark = Message(phrase("targets.removed", n=int(np.count_nonzero(images))))
        return self.replace(corners=self.corners.replace(use=use), messages=(*self.messages, remark))

    def with_images_of(self, block: Block) -> Self:
        """Return the calibration with the remaining corners of a block."""
        corners, points = self.corners, len(self.board.places)
        kept = np.isin(
            corners.picture * points + corners.point, block.image_photos * points + block.image_points
        )
        return self.replace(corners=corners.replace(use=corners.use & kept))

    def adjust(
        self,
        *,
        loss: Loss | None = None,
        outliers: Literal["mrcal"] | None = None,
        threads: int | None = None,
        progress: Callable[[Progress], None] | None = None,
    ) -> Calibrated:
        """Adjust cameras, sensors, views and the board together.

        Parameters
        ----------
        loss, threads, progress
            As in :func:`photogram.adjust`.
        outliers
            `mrcal`: remove outlying corners and readjust as in mrcal (docs/targets.md).

        Raises
        ------
        RankError
            If the corners do not determine all unknowns, which the message names. With offsets, if the board
            hardly moves.
        AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As in :func:`photogram.adjust`.
        InputError
            If priors require an unknown image size.
        """
        if outliers is not None:
            one_of("outliers", outliers, ("mrcal",))
        solve = partial(adjust, loss=loss, threads=threads, progress=progress, covariance="verdict")
        start, rounds = self, 0
        while True:
            # Only priors determine knots without image observations.
            free = None if any(each.knot_unknowns for each in start.cameras) else solve(start.block())
            if free is None:
                result = solve(weighted_block(start), tolerance=SPLINE_TOLERANCE)
            elif start.regularise is None:
                result = free
            else:
                result = adjusted(weighted_block(start), free.options, start=free.state, threads=threads)
            worse = marked_as_mrcal(result) if outliers else np.zeros(len(result.residuals), dtype=bool)
            if worse.any() and result.converged:
                start = start.without(worse)
            elif rounds < MAX_ROUNDS and (better := better_start(start, result)) is not None:
                start, rounds = better, rounds + 1
            else:
                break
        result = replace(result, messages=[*start.messages, *result.messages])
        found = Calibrated.of(result, start, free if start.regularise else None)
        if start.sync == "offset":
            found = replace(found, messages=[*result.messages, *checked_clocks(found)])
        return found

    def snoop(self, options: SnoopOptions | None = None, **changes: Any) -> Snooped:
        """Remove gross errors one by one by data snooping, and adjust the rest.

        The `result` is :class:`Calibrated`.

        Parameters
        ----------
        options, changes
            As in :func:`photogram.snoop`.

        Raises
        ------
        InputError
            If cameras have priors, which data snooping does not support.
        RankError, AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As in :func:`photogram.snoop`.
        """
        if self.regularise is not None and not any(each.knot_unknowns for each in self.cameras):
            raise InputError(phrase("targets.priors"))
        start = self.adjust().calibration if self.sync == "offset" else self
        snooped = snoop(weighted_block(start), options, **changes)
        result = snooped.result
        assert isinstance(result, Result)
        rest = start.with_images_of(result.block)
        result = replace(result, messages=[*rest.messages, *result.messages])
        return replace(snooped, result=Calibrated.of(result, rest))


def simulate_corners(calibration: Calibration, seed: int = 1) -> Calibration:
    """Simulate corners from the values of a calibration, with random errors.

    For the shape `points`, board points are drawn about their nominal positions, once for all views.

    Parameters
    ----------
    calibration
        True cameras, poses and sensors. The set of corners is unchanged.
    seed
        The same seed gives the same errors.

    Raises
    ------
    InputError
        If the corner standard deviation is unknown, or if a corner is not imaged with these values.
    """
    if calibration.sd0 is None:
        raise argument_error("sd0", "empty")
    random = np.random.default_rng(seed)
    corners = calibration.corners
    places = calibration.places().copy()
    if calibration.shape == "points":
        places += calibration.board.deviations(corners.view_count) * random.standard_normal(places.shape)
    xy = calibration._computed(places)
    if not np.isfinite(xy).all():
        row = int(np.argmin(np.isfinite(xy).all(axis=1)))
        raise InputError(phrase("targets.no-image", corner=corners.title(row)))
    errors = calibration.sd0 * corners.sd[:, np.newaxis] * random.standard_normal(xy.shape)
    return calibration.replace(corners=corners.replace(xy=xy + errors))
