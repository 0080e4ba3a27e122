"""What is adjusted of cameras that see a board: photos of a block whose object space is the board."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram.adjustment.adjustment import Progress, adjust, adjusted_again
from photogram.adjustment.robust import Loss
from photogram.adjustment.snooping import snoop
from photogram.arguments.arrays import indices, one_of, shaped, shown
from photogram.arguments.equality import Valued
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.messages import Message, listed
from photogram.network.block import Block
from photogram.network.cameras import Camera, images_of
from photogram.network.rigs import Mount
from photogram.network.unknowns import Sensor
from photogram.results.result import Result
from photogram.show.brief import Brief, Rows, few
from photogram.targets.board import Board, Shape
from photogram.targets.calibrated import Calibrated, with_unknown_weight
from photogram.targets.corners import Corners
from photogram.targets.outliers import marked_as_mrcal
from photogram.targets.regularisation import regularised
from photogram.targets.vision import FLIP, photo_poses

__all__ = ["Calibration", "Regularisation", "Synchronisation"]

Synchronisation = Literal["known", "none"]
Regularisation = Literal["mrcal"]

BEND = (
    "the shape `bend` of a board cannot be adjusted yet: `points` sees every shape, `held` takes the board"
    " for plane"
)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Calibration(Valued, Brief):
    """Corners of a board in pictures of K cameras, with values to start from: what is adjusted.

    Parameters
    ----------
    board
        The board.
    corners
        Its corners in P pictures, in V views. Pictures with fewer than 6, or whose corners lie on one line,
        are left out; `messages` name them.
    cameras
        K cameras in pixels, counted from 0 at the centre of the first; free parameters start where they are.
    poses
        (V, 4, 4) of the views: board -> reference of the cameras that took the pictures of the view. Vision
        axes: x right, y down, z forward.
    sensors
        (K, 4, 4) reference -> camera k; None: one camera, or none that is tied to another.
    references
        (K,) the camera that each one's sensor counts from. None: camera 0. Where images are not synchronised,
        each itself.
    sd0
        Standard deviation of a corner of level 0, pixels. None: it is not known; the adjustment estimates it,
        and nothing tests it.
    sync
        `known`: pictures of one view were taken at one time. `none`: every picture has a pose of its own.
    regularise
        `mrcal`: the weak priors that mrcal 2.2 gives lens terms and centres. None: no priors.
    bend
        Deflections in the middle of the board along x and y that `bend` starts from, and with which a board
        of the shape `held` is held.
    messages
        Remarks of whoever read it.

    Raises
    ------
    InputError
        Arrays of other shapes, points that the board does not have, pictures without corners that count,
        several cameras that are synchronised without sensors.
    """

    board: Board
    corners: Corners
    cameras: Sequence[Camera]
    poses: ArrayLike
    sensors: ArrayLike | None = None
    references: ArrayLike | None = None
    sd0: float | None = None
    sync: Synchronisation = "known"
    regularise: Regularisation | None = None
    bend: tuple[float, float] = (0.0, 0.0)
    messages: Sequence[Message] = field(default=())

    def __post_init__(self) -> None:
        one_of("sync", self.sync, get_args(Synchronisation))
        if self.regularise is not None:
            one_of("regularise", self.regularise, get_args(Regularisation))
        if self.sd0 is not None and not 0 < self.sd0 < np.inf:
            raise InputError(f"the standard deviation of a corner is a positive number, not {self.sd0:g}")
        count = len(self.corners.camera_names)
        given = [each for each in self.cameras if isinstance(each, Camera) and each.unit == "px"]
        if len(given) != count or len(self.cameras) != count:
            raise InputError(f"cameras are {count} cameras in pixels, not {shown(self.cameras)}")
        named = [each.replace(name=name) for each, name in zip(given, self.corners.camera_names, strict=True)]
        self._set("cameras", tuple(named))
        if self.sensors is None and count > 1 and self.sync == "known":
            raise InputError("several cameras that are synchronised have sensors: camera 0 -> camera k")
        sensors = np.tile(np.eye(4), (count, 1, 1)) if self.sensors is None else self.sensors
        self._set("sensors", shaped("sensors", sensors, (count, 4, 4)))
        references = np.zeros(count, dtype=np.int64) if self.references is None else self.references
        if self.sync == "none":
            references = np.arange(count)
        self._set("references", indices("references", references, count, count))
        poses = shaped("poses", self.poses, (self.corners.view_count, 4, 4), missing=True)
        self._set("poses", poses)
        over = np.flatnonzero(self.corners.point >= len(self.board.places))
        if len(over):
            raise InputError(
                f"{self.corners.title(int(over[0]))}: the board has {len(self.board.places)} points, from 0"
            )
        self._leave_out(poses)

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _leave_out(self, poses: Floats) -> None:
        """Leave out pictures that say nothing, or whose pose nobody knows, and name them."""
        poor = self.corners.poor()
        keep = np.array([name not in poor for name in self.corners.pictures], dtype=bool)
        unposed = keep & ~np.isfinite(poses[self.corners.views]).all(axis=(1, 2))
        keep &= ~unposed
        found = [Message(f"{name} is left out: {why}") for name, why in poor.items()]
        if unposed.any():
            names = [self.corners.pictures[row] for row in np.flatnonzero(unposed).tolist()]
            found.append(Message(f"left out, no pose was found: {listed(names)}"))
        if not keep.any():
            raise InputError("; ".join(["no picture is left", *map(str, found)]))
        if not keep.all():
            self._set("poses", poses[np.unique(self.corners.views[keep])])
            self._set("corners", self.corners.of_pictures(keep))
        self._set("messages", (*self.messages, *found))

    def brief(self) -> tuple[str, Rows]:
        """Return what is adjusted in a few lines."""
        return "Calibration", [
            ("board", self.board.described),
            ("shape", self.shape),
            ("cameras", few([each.title for each in self.cameras])),
            ("views", str(self.corners.view_count)),
            ("corners", f"{np.count_nonzero(self.corners.use):,}"),
        ]

    def replace(self, **changes: Any) -> Self:
        """Return the calibration with some fields replaced, checked anew."""
        return replace(self, **changes)

    @property
    def tied(self) -> Bools:
        """(K,) whether a camera is tied to another, its reference."""
        found: Bools = np.asarray(self.references) != np.arange(len(self.cameras))
        return found

    def picture_poses(self) -> Floats:
        """Return (P, 4, 4) the pose of each picture: board -> its camera."""
        sensors, poses = np.asarray(self.sensors), np.asarray(self.poses)
        found: Floats = sensors[self.corners.cameras] @ poses[self.corners.views]
        return found

    @property
    def shape(self) -> Shape:
        """What of the board is unknown."""
        return self.board.shape_of(self.corners.view_count)

    def places(self) -> Floats:
        """Return (n, 3) the points of the board as they are given: bent, unless each is an unknown."""
        bent = any(self.bend) and self.shape != "points"
        return self.board.bent(*self.bend) if bent else self.board.places

    def frames(self) -> tuple[list[str], Indices]:
        """Return the names of views without a picture of their reference, and (V,) the photo of each view.

        Photos are the pictures, and behind them one without images for each of these views: its frame.
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
        """Return the block: pictures are photos, points of the board are control, held or weighted.

        Parameters
        ----------
        cameras
            In the place of those that are given.

        Raises
        ------
        InputError
            The shape `bend`.
        """
        if self.shape == "bend":
            raise InputError(BEND)
        corners, poses = self.corners, np.asarray(self.poses)
        frames, photo = self.frames()
        names = [*corners.pictures, *frames]
        of_frames = poses[photo >= len(corners.pictures)]
        centres, attitudes = photo_poses(np.concatenate([self.picture_poses(), of_frames]))
        use = corners.use
        return Block(
            photo_ids=names,
            photo_positions=centres,
            photo_attitudes=attitudes.values("omega_phi_kappa"),
            cameras=self.cameras if cameras is None else cameras,
            photo_cameras=np.concatenate([corners.cameras, self._cameras_of_frames(photo)]),
            point_ids=self.board.names,
            point_positions=self.places(),
            point_sd=self.board.deviations(corners.view_count),
            image_photos=corners.picture[use],
            image_points=corners.point[use],
            image_xy=corners.xy[use],
            image_sd=np.repeat(corners.sd[use, np.newaxis] * (self.sd0 or 1.0), 2, axis=1),
            mounts=self._mounts(names, photo),
            linear_unit=self.board.unit,
        )

    def _cameras_of_frames(self, photo: Indices) -> Indices:
        """Return the references of views that have no picture of them."""
        corners = self.corners
        reference = np.empty(corners.view_count, dtype=np.int64)
        reference[corners.views] = np.asarray(self.references)[corners.cameras]
        return reference[photo >= len(corners.pictures)]

    def _mounts(self, names: Sequence[str], photo: Indices) -> list[Mount]:
        corners = self.corners
        sensors = [
            Sensor.from_colmap(name, pose[:3, :3], pose[:3, 3])
            for name, pose in zip(corners.camera_names, np.asarray(self.sensors), strict=True)
        ]
        return [
            Mount(names[row], names[photo[corners.views[row]]], sensors[corners.cameras[row]])
            for row in np.flatnonzero(self.tied[corners.cameras]).tolist()
        ]

    def residuals(self) -> Floats:
        """Return (n, 2) observed less computed with the values that are given, pixels; no adjustment."""
        corners, poses = self.corners, self.picture_poses()
        places = self.places()[corners.point]
        own = poses[corners.picture]
        seen = (own[:, :3, :3] @ places[:, :, np.newaxis])[..., 0] + own[:, :3, 3]
        return corners.xy - images_of(self.cameras, corners.cameras[corners.picture], seen @ FLIP)

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
            As of :func:`photogram.adjust`.
        outliers
            `mrcal`: corners are taken out, and all is adjusted again, as mrcal does it (docs/targets.md).

        Raises
        ------
        RankError
            The corners do not determine all unknowns: names them.
        AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As of :func:`photogram.adjust`.
        InputError
            The shape `bend`; priors without the size of pictures.
        """
        if outliers is not None:
            one_of("outliers", outliers, ("mrcal",))
        own = self
        while True:
            free = adjust(own.block(), loss=loss, threads=threads, progress=progress, verdict=True)
            result = own._with_priors(free, threads)
            worse = marked_as_mrcal(result) if outliers else np.zeros(len(result.residuals), dtype=bool)
            if not (worse.any() and result.converged):
                break
            own = own.without(worse)
        told = replace(result, messages=[*own.messages, *result.messages])
        if own.sd0 is None:
            told = with_unknown_weight(told)
        return Calibrated(calibration=own, result=told, unregularised=free if own.regularise else None)

    def snoop(self, **options: Any) -> Calibrated:
        """Take gross errors out one after the other, and adjust what is left.

        Parameters
        ----------
        options
            Those of :func:`photogram.snoop`.

        Raises
        ------
        InputError
            Priors of cameras, which snooping does not take; what :meth:`block` refuses.
        RankError, AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As of :func:`photogram.snoop`.
        """
        if self.regularise is not None:
            raise InputError("gross errors are taken out without priors of cameras: regularise is None")
        found = snoop(self.block(), **options)
        result = found.judged
        assert isinstance(result, Result)
        own = self._kept(result.block)
        told = replace(result, messages=[*own.messages, *result.messages])
        vars(told)["verdict"] = found.verdict
        return Calibrated(calibration=own, result=told, snooped=found)

    def _kept(self, block: Block) -> Calibration:
        """Return the calibration with the corners that a block still has."""
        corners, points = self.corners, len(self.board.places)
        kept = np.isin(
            corners.picture * points + corners.point, block.image_photos * points + block.image_points
        )
        return self.replace(corners=corners.replace(use=corners.use & kept))

    def without(self, images: Bools) -> Calibration:
        """Return the calibration without some images (m,) of its block."""
        use = self.corners.use.copy()
        use[np.flatnonzero(use)[images]] = False
        found = Message(f"{np.count_nonzero(images)} corners are taken out, as mrcal would")
        return self.replace(corners=self.corners.replace(use=use), messages=(*self.messages, found))

    def _with_priors(self, free: Result, threads: int | None) -> Result:
        """Return the adjustment with the priors of cameras, from where that without them has ended."""
        if self.regularise is None:
            return free
        observed = 2 * len(self.board.places) * len(self.corners.pictures)
        cameras = regularised(self.cameras, self.corners.sizes, observed)
        found = adjusted_again(self.block(cameras), free.options, free.state, threads=threads)
        assert isinstance(found, Result)
        return found
