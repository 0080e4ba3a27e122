"""Construction of the project of a file from cameras, photos, points and observations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.arrays import matrix_fault, repeated_pairs
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.crs import amid, to_frame, turn_to_frame
from photogram.formats.project import Project, Repeated, Size
from photogram.io.places import Failing, Place, at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.attitudes import angles_form, known_angles
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.geometry import Frame
from photogram.network.moving_photos import Mount
from photogram.network.observations import Control, Observation, Observations, Position
from photogram.network.trajectories import Clock
from photogram.network.unknowns import Sensor
from photogram.words import Phrase, option_sd, phrase


@dataclass(frozen=True)
class Rig:
    """Sensors on one frame."""

    name: str
    reference: str  # Sensor whose axes are the axes of the frame
    sensors: dict[str, Sensor]  # Poses of the other sensors
    # Clocks of sensors on trajectories
    clocks: dict[str, Clock] = field(default_factory=dict)


@dataclass(frozen=True)
class FrameOf:
    """Photos taken simultaneously: their indices by sensor name."""

    name: str
    rig: Rig
    photos: Mapping[str, int]


ASSUMED_SD = {"px": 1.0, "mm": 0.010}  # Default for image coordinates


class _Located(NamedTuple):
    """A position with standard deviations in a system, which is empty for the frame."""

    place: Failing
    xyz: Floats
    sd: Floats
    crs: str


class BlockBuilder:
    """Contents of a file, from which :meth:`project` creates a project.

    Keys are names or numbers of the file. Cameras, photos and points are added one by one, or as arrays.
    Points without :meth:`point` are created for images, then for control and check points. Poses and initial
    positions of other photos and points are ignored. Positions in a coordinate reference system are
    transformed into `frame` at the end.
    """

    def __init__(self, path: Path, title: str) -> None:
        self.path, self.place, self.title, self.frame = path, Place(path), title, Frame()
        self.messages, self.lacks = list[Message](), list[Phrase]()
        self.observations: list[Observation | Observations[Any]] = []
        self.mounts: list[Mount] = []
        self.cameras: list[Camera] = []
        self.sizes: list[Size | None] = []
        self.pixel_mm: list[float | None] = []
        self.photo_ids: list[str] = []
        self.photo_cameras: list[int] = []
        self.position_sd: ArrayLike = np.inf
        self.attitude_sd: ArrayLike = np.inf
        self.point_ids: list[str] = []
        self.camera_rows: dict[Hashable, int] = {}
        self.photo_rows: dict[Hashable, int] = {}
        self.point_rows: dict[Hashable, int] = {}
        self.photo_names, self.point_names = set[str](), set[str]()
        self.poses: dict[Hashable, tuple[Floats, Floats, str]] = {}
        self.remarks_on_systems = True  # Whether assumptions on heights of systems are reported
        self.crs: str | None = ""  # System of the coordinates of the frame; None: another
        self._poses: tuple[Floats, Floats] | None = None
        self._points: dict[str, Any] = {}
        self._starts: dict[Hashable, _Located] = {}
        self._control: dict[Hashable, _Located] = {}
        self._checks: dict[Hashable, _Located] = {}
        self._gnss: dict[Hashable, _Located] = {}
        self._images: tuple[Indices, Indices, Floats, Floats | float | None] | None = None
        self.image_keys: list[tuple[Hashable, Hashable]] = []
        self.image_xy: list[tuple[float, float]] = []
        self.image_sd: list[ArrayLike] = []  # NaN if unknown

    def camera(
        self,
        camera: Camera,
        size: Size | None = None,
        pixel_mm: float | None = None,
        *,
        key: Hashable = None,
        place: Failing | None = None,
    ) -> None:
        """Add a camera; its key is its name by default."""
        _add(self.camera_rows, camera.name if key is None else key, "camera", place or self.place)
        self.cameras.append(camera)
        self.sizes.append(size)
        self.pixel_mm.append(pixel_mm)

    def photo(
        self, key: Hashable, camera: Hashable, place: Failing | None = None, *, name: str | None = None
    ) -> None:
        """Add a photo of a camera."""
        place, name = place or self.place, str(key) if name is None else name
        _check_name("photo", name, self.photo_names, place)
        if camera not in self.camera_rows:
            raise place.error(phrase("format.undefined", what="camera", name=str(camera)))
        _add(self.photo_rows, key, "photo", place)
        self.photo_ids.append(name)
        self.photo_cameras.append(self.camera_rows[camera])

    def pose(
        self, key: Hashable, centre: Floats, matrix: Floats, place: Failing | None = None, *, crs: str = ""
    ) -> None:
        """Set the centre and the rotation, photo to object, of a photo."""
        if key in self.poses:
            raise (place or self.place).error(phrase("format.repeated", what="photo", name=str(key)))
        self.poses[key] = centre, matrix, crs

    def photos(
        self,
        names: Sequence[str],
        cameras: Sequence[int] | Indices,
        centres: Floats | None = None,
        matrices: Floats | None = None,
    ) -> None:
        """Set all photos: their cameras as rows, and their poses as :meth:`pose`."""
        self.photo_ids, self.photo_cameras = list(names), np.asarray(cameras).tolist()
        if centres is not None and matrices is not None:
            self._poses = centres, matrices

    def rigs(self, frames: Sequence[FrameOf], cameras: Mapping[str, int] | None = None) -> None:
        """Mount photos on frames, after :meth:`photos`; photos without images represent missing frames.

        `cameras` are rows by sensor name; the default are names of cameras.
        """
        assert self._poses is not None
        centres, matrices = self._poses
        owners = {each.name: row for row, each in enumerate(self.cameras)} if cameras is None else cameras
        taken, stands = set(self.photo_ids), list[tuple[Floats, Floats]]()
        for frame in frames:
            first, reference = frame.photos.get(frame.rig.reference), frame.rig.reference
            if first is not None:
                name = self.photo_ids[first]
            else:
                camera, row = next(iter(frame.photos.items()))
                sensor = frame.rig.sensors[camera]
                # For an unknown sensor the photo's own pose is a sufficient initial value.
                turn = np.eye(3) if sensor.matrix is None else np.asarray(sensor.matrix)
                matrix = matrices[row] @ turn.T
                name = f"frame {frame.name}"
                while name in taken:
                    name += "'"
                taken.add(name)
                self.photo_ids.append(name)
                self.photo_cameras.append(owners.get(reference, self.photo_cameras[row]))
                stands.append((centres[row] - matrix @ sensor.position, matrix))
            for camera, row in frame.photos.items():
                if camera != reference:
                    self.mounts.append(Mount(self.photo_ids[row], name, frame.rig.sensors[camera]))
        centres = np.vstack([centres, *(centre for centre, _ in stands)])
        self._poses = centres, np.concatenate([matrices, *(matrix[np.newaxis] for _, matrix in stands)])
        free = np.full((len(stands), 3), np.inf)
        if np.ndim(self.position_sd):
            self.position_sd = np.vstack([self.position_sd, free])
        if np.ndim(self.attitude_sd):
            self.attitude_sd = np.vstack([self.attitude_sd, free])

    def point(self, key: Hashable, place: Failing | None = None, *, name: str | None = None) -> None:
        """Add a point."""
        place, name = place or self.place, str(key) if name is None else name
        _check_name("point", name, self.point_names, place)
        _add(self.point_rows, key, "point", place)
        self.point_ids.append(name)

    def points(self, names: list[str], starts: Floats | None = None, **fields: Floats | None) -> None:
        """Set all points: their names, (n, 3) initial positions, and other fields of the block."""
        self.point_ids, self._points = names, {"starts": starts, **fields}

    def start(self, key: Hashable, xyz: Floats, place: Failing | None = None, *, crs: str = "") -> None:
        """Set the initial position of a point."""
        if key in self._starts:
            raise (place or self.place).error(phrase("format.repeated", what="point", name=str(key)))
        self._starts[key] = _Located(place or self.place, xyz, np.zeros(3), crs)

    def control(
        self,
        key: Hashable,
        xyz: Floats,
        sd: ArrayLike,
        place: Failing | None = None,
        *,
        crs: str = "",
        check: bool = False,
    ) -> None:
        """Add control or a check point: unknown coordinates are NaN.

        Standard deviations are infinite if free, those of check points NaN if unknown.
        """
        place = place or self.place
        if key in self._control or key in self._checks:
            raise place.error(phrase("format.repeated", what="control point", name=str(key)))
        points = self._checks if check else self._control
        points[key] = _Located(place, xyz, np.where(np.isnan(xyz), np.inf, sd), crs)

    def gnss(
        self, photo: Hashable, xyz: Floats, sd: ArrayLike, place: Failing | None = None, *, crs: str = ""
    ) -> None:
        """Add an observed position of a photo."""
        self._gnss[photo] = _Located(place or self.place, xyz, np.broadcast_to(sd, 3), crs)

    def image(
        self,
        photo: Hashable,
        point: Hashable,
        x: float,
        y: float,
        place: Failing | None = None,
        *,
        sd: ArrayLike = np.nan,
    ) -> None:
        if photo not in self.photo_rows:
            raise (place or self.place).error(phrase("format.undefined", what="photo", name=str(photo)))
        if point not in self.point_rows:
            self.point(point)
        self.image_keys.append((photo, point))
        self.image_xy.append((x, y))
        self.image_sd.append(sd)

    def images(self, photos: Indices, points: Indices, xy: Floats, sd: Floats | float | None = None) -> None:
        """Set all image observations: rows of photos and points, coordinates; `sd` is None if missing."""
        self._images = photos, points, xy, sd

    def image_rows(self) -> tuple[Indices, Indices, Floats]:
        """Return photos, points and coordinates of the image observations that were added one by one."""
        rows = [(self.photo_rows[photo], self.point_rows[point]) for photo, point in self.image_keys]
        photos, points = np.array(rows, dtype=np.int64).reshape(-1, 2).T.copy()
        return photos, points, np.array(self.image_xy, dtype=float).reshape(-1, 2)

    @property
    def controls(self) -> int:
        return len(self._control)

    def define_systems(self, system: Callable[[str], str]) -> None:
        """Replace identifiers of systems, in which positions were added, by their definitions."""
        self.poses = {key: (centre, own, system(crs)) for key, (centre, own, crs) in self.poses.items()}
        for located in (self._starts, self._control, self._checks, self._gnss):
            for key, each in located.items():
                located[key] = each._replace(crs=system(each.crs))

    def frame_amid(self, crs: str) -> None:
        centres = np.array([centre for centre, _, own in self.poses.values() if own == crs]).reshape(-1, 3)
        known = centres[np.isfinite(centres).all(axis=1)]
        if not len(known):
            raise self.place.error(phrase("blocks-exchange.centres", crs=crs))
        self.frame, self.crs = Frame("topocentric", "EPSG:4979", amid(crs, known)), None
        self.messages.append(Message(phrase("format.frame", crs=crs, frame=self.frame.phrase)))

    def project(
        self, *, options: AdjustOptions | None = None, details: Mapping[str, Any] | None = None, **fields: Any
    ) -> Project:
        """Return the project; `fields` are other fields of the block.

        Errors of the block name the file.
        """
        if not self.photo_ids:
            raise self.place.error(phrase("error.empty-file", content="photos"))
        centres, matrices = self._photo_poses()
        starts, points = self._point_fields()
        self._add_gnss()
        images, repeated = self._image_fields()
        form = angles_form(fields.get("photo_to_ground", False))
        try:
            with at_place(self.place):
                block = Block(
                    photo_ids=self.photo_ids,
                    photo_positions=centres,
                    photo_attitudes=known_angles(form, matrices),
                    photo_position_sd=np.asarray(self.position_sd),
                    photo_attitude_sd=np.asarray(self.attitude_sd),
                    cameras=self.cameras,
                    photo_cameras=np.asarray(self.photo_cameras),
                    point_ids=self.point_ids,
                    observations=self.observations,
                    mounts=self.mounts,
                    **points,
                    **images,
                    **fields,
                )
        except InputError:
            for kind, names in (("photo", self.photo_ids), ("point", self.point_ids)):
                for name, count in Counter(names).items():
                    if count > 1 or not name.isprintable():
                        code = "error.repeated" if count > 1 else "format.name"
                        raise self.place.error(phrase(code, kind=kind, what=kind, name=name)) from None
            raise
        return Project(
            block=block,
            path=self.path,
            title=self.title,
            sizes=tuple(self.sizes),
            pixel_mm=tuple(self.pixel_mm),
            starts=starts,
            frame=self.frame,
            options=options or AdjustOptions(),
            lacks=tuple(self.lacks),
            messages=tuple(self.messages),
            details=details or {},
            repeated=repeated,
        )

    def _photo_poses(self) -> tuple[Floats, Floats]:
        if self._poses is not None:
            return self._poses
        count, systems = len(self.photo_ids), dict[str, list[int]]()
        centres, matrices = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
        for key, row in self.photo_rows.items():
            if key in self.poses:
                centres[row], matrices[row], crs = self.poses[key]
                systems.setdefault(crs, []).append(row)
        for crs, rows in systems.items():
            own = [row for row in rows if np.isfinite(centres[row]).all()]
            if own and crs != self.crs:
                given = centres[own]
                centres[own], _ = self._in_frame(crs, given, np.zeros((len(own), 3, 3)))
                matrices[own] = turn_to_frame(crs, given, self.frame) @ matrices[own]
        return centres, matrices

    def _in_frame(self, crs: str, xyz: Floats, covariances: Floats) -> tuple[Floats, Floats]:
        if crs == self.crs:
            return xyz, covariances
        if not crs or self.crs == "":
            fields = {"crs": crs or "local", "frame": str(self.frame)}
            raise self.place.error(phrase("blocks-exchange.systems", **fields))
        xyz, covariances, remarks = to_frame(crs, xyz, covariances, self.frame)
        known = {message.phrase for message in self.messages}
        if self.remarks_on_systems:
            self.messages += [Message(remark) for remark in remarks if remark not in known]
        return xyz, covariances

    def _located(self, located: Mapping[Any, _Located]) -> Iterator[tuple[Any, _Located, Floats, Floats]]:
        """Yield the key, the record, and the position and covariance in the frame."""
        for crs in dict.fromkeys(each.crs for each in located.values()):
            own = {key: each for key, each in located.items() if each.crs == crs}
            if part := [each for each in own.values() if crs != self.crs and np.isnan(each.xyz).any()]:
                raise part[0].place.error(phrase("blocks-exchange.part"))
            sd = np.array([each.sd for each in own.values()])
            variances = np.where(np.isfinite(sd), sd, 0.0) ** 2
            xyz = np.array([each.xyz for each in own.values()])
            xyz, covariances = self._in_frame(crs, xyz, variances[:, :, np.newaxis] * np.eye(3))
            yield from zip(own, own.values(), xyz, covariances, strict=True)

    def _point_fields(self) -> tuple[Floats, dict[str, Any]]:
        for key in (*self._control, *self._checks):
            if key not in self.point_rows:
                self.point(key)
        fields, rows = dict(self._points), self.point_rows
        unknown = {"starts": np.nan, "point_positions": np.nan, "point_sd": np.inf}
        unknown |= {"point_check_sd": np.nan} if self._checks else {}
        for name, value in unknown.items():
            if fields.get(name) is None:
                fields[name] = np.full((len(self.point_ids), 3), value)
        starts, positions, sd = fields.pop("starts"), fields["point_positions"], fields["point_sd"]
        for key, _, xyz, _ in self._located({key: self._starts[key] for key in self._starts if key in rows}):
            starts[rows[key]] = xyz
        for key, each, xyz, covariance in self._located(self._control):
            row, variances = rows[key], np.diag(covariance)
            starts[row] = xyz
            if (covariance == np.diag(variances)).all():
                positions[row] = xyz
                sd[row] = each.sd if each.crs == self.crs else np.sqrt(variances)
                continue
            covariance = (covariance + covariance.T) / 2
            if fault := matrix_fault(covariance):
                raise each.place.error(fault)
            self.observations.append(Control(self.point_ids[row], xyz, covariance=covariance))
        for key, each, xyz, covariance in self._located(self._checks):
            row = rows[key]
            starts[row] = positions[row] = xyz
            fields["point_check_sd"][row] = np.where(each.sd > 0, np.sqrt(np.diag(covariance)), np.nan)
        if (check_sd := fields.get("point_check_sd")) is not None and np.isnan(check_sd).all():
            del fields["point_check_sd"]
        return starts, fields

    def _add_gnss(self) -> None:
        """Add observed positions of photos; omit positions that cannot be transformed."""
        found, lost = list[tuple[Any, _Located, Floats, Floats]](), list[str]()
        names = {key: self.photo_ids[row] for key, row in self.photo_rows.items()}
        try:
            found += self._located(self._gnss)
        except InputError:
            for photo, each in self._gnss.items():
                try:
                    found += self._located({photo: each})
                except InputError:
                    lost.append(names[photo])
        for photo, _, xyz, covariance in found:
            position = Position(names[photo], xyz, covariance=(covariance + covariance.T) / 2)
            self.observations.append(position)
        if lost:
            self.messages.append(Message(phrase("blocks-exchange.gnss", n=len(lost), names=lost)))

    def _image_fields(self) -> tuple[dict[str, Any], Repeated]:
        """Return the fields of the block for images, and repeated observations, which are omitted."""
        photos, points, xy, sd = (*self.image_rows(), None) if self._images is None else self._images
        left = repeated_pairs(photos, points, len(self.point_ids))
        photo_names = tuple(self.photo_ids[row] for row in photos[left].tolist())
        point_names = tuple(self.point_ids[row] for row in points[left].tolist())
        repeated = Repeated(photo_names, point_names, np.asarray(xy)[left])
        if len(left):
            photos, points = np.delete(photos, left), np.delete(points, left)
            xy = np.delete(xy, left, axis=0)
            if sd is not None and np.ndim(sd):
                sd = np.delete(sd, left, axis=0)
            names = [f"{point} on {photo}" for point, photo in zip(point_names, photo_names, strict=True)]
            remark = Message.of("read.repeated", n=len(left), names=names, option=Phrase("option.repeated"))
            self.messages.append(remark)
        if sd is None:
            unit = self.cameras[0].unit or "px"
            sd = ASSUMED_SD[unit]
            fields = {"number": float(sd), "unit": unit, "option": option_sd("images")}
            self.lacks.append(Phrase("read.images", fields))
        for each in (photos, points, xy, sd):
            if isinstance(each, np.ndarray):
                # These arrays are complete and read-only: the block shares them.
                each.flags.writeable = False
        return {"image_photos": photos, "image_points": points, "image_xy": xy, "image_sd": sd}, repeated


def _add(rows: dict[Hashable, int], key: Hashable, what: str, place: Failing) -> None:
    if key in rows:
        raise place.error(phrase("format.repeated", what=what, name=str(key)))
    rows[key] = len(rows)


def _check_name(what: str, name: str, names: set[str], place: Failing) -> None:
    """Reject a repeated name, or one without printable characters; add it to the others."""
    if name in names or not name.strip() or not name.isprintable():
        raise place.error(phrase("format.name", what=what, name=name))
    names.add(name)
