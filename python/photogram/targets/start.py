"""Adjustment input of board images: a block of photos with the board as object space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, shaped, value_field
from photogram.arguments.equality import Valued
from photogram.arguments.fields import array, check_arrays, check_fields, option
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.cameras import Camera, images_of
from photogram.network.moving_photos import Timed
from photogram.network.passages import Bend, Figure
from photogram.network.rigs import Mount
from photogram.network.trajectories import Clock
from photogram.network.unknowns import Sensor
from photogram.summaries import Brief, Rows, few
from photogram.targets.board import Board
from photogram.targets.corners import Corners
from photogram.targets.motion import MAX_GAP_SECONDS, POWERS, dated, moved, moving, pictures_in_motion
from photogram.targets.options import Regularisation, Shape, Synchronisation
from photogram.targets.vision import FLIP, photo_poses
from photogram.words import phrase

BOARD = "board"  # name of the bend among the common unknowns
CLOCK = "of "  # prefix of the camera in the name of its clock offset


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Start(Valued, Brief):
    """Fields of :class:`photogram.targets.Calibration`, without adjustment methods."""

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
        over = np.flatnonzero(self.corners.point >= len(self.board.places))
        if len(over):
            fields = {"count": len(self.board.places), "board": self.board.described}
            corner = self.corners.title(int(over[0]))
            raise InputError(phrase("targets.corner-beyond", corner=corner, **fields))
        self._leave_out(np.asarray(self.poses))
        for name in ("sd_sensors", "sd_bend"):
            values = np.asarray(getattr(self, name))
            for value in values[~(values > 0)].tolist():
                raise InputError(phrase("targets.free-sd", name=name, value=value))
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
        use, mounts = corners.use, []
        if self.sync == "known":
            sensors = self._sensors()
            mounts = [
                Mount(names[row], names[photo[corners.views[row]]], sensors[corners.cameras[row]])
                for row in np.flatnonzero(self.tied[corners.cameras]).tolist()
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
            timed=self._timed() if self.sync == "offset" else [],
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

    def _sensors(self) -> list[Sensor]:
        names, sensors, sd = self.corners.camera_names, np.asarray(self.sensors), np.asarray(self.sd_sensors)
        return [
            Sensor.from_colmap(name, pose[:3, :3], pose[:3, 3], own)
            for name, pose, own in zip(names, sensors, sd, strict=True)
        ]

    def _timed(self) -> list[Timed]:
        offsets, sd = np.asarray(self.offsets).tolist(), np.asarray(self.sd_offsets).tolist()
        clocks = [
            Clock(CLOCK + name, offsets[k], sd[k]) if tied else None
            for k, (name, tied) in enumerate(zip(self.corners.camera_names, self.tied.tolist(), strict=True))
        ]
        times, poses = dated(self.corners, self.tied), np.asarray(self.poses)
        return pictures_in_motion(
            self.corners, poses, np.asarray(self.motion), times, self._sensors(), clocks
        )

    def residuals(self) -> Floats:
        """Return (n, 2) observed minus computed corners with the given values, pixels."""
        corners, poses = self.corners, self.picture_poses()
        places = self.places()[corners.point]
        own = poses[corners.picture]
        seen = (own[:, :3, :3] @ places[:, :, np.newaxis])[..., 0] + own[:, :3, 3]
        return corners.xy - images_of(self.cameras, corners.cameras[corners.picture], seen @ FLIP)

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
