"""A project: a block with additional contents of its files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import repeated_pairs
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.frame import Frame
from photogram.network.geometry import Spheroid
from photogram.network.moving_photos import Timed
from photogram.network.observations import Control, Observation, Observations
from photogram.network.passages import Passage
from photogram.network.rigs import Mount
from photogram.results.features import Definition
from photogram.show.methods import Brief
from photogram.targets.board import Board
from photogram.words import Phrase, option_sd, phrase

__all__ = ["DatumName", "Frame", "Options", "Project", "Size", "Unused", "assembled"]

DatumName = Literal["control", "minimum", "inner"]
Size = tuple[int, int]  # Image width and height of a camera, pixels

ASSUMED_SD = {"px": 1.0, "mm": 0.010}  # Default for image coordinates


def frame_of(block: Block) -> Frame:
    """Return the frame of a block; of kind geographic if the block has a spheroid."""
    if block.spheroid is not None and block.frame.kind == "cartesian":
        return replace(block.frame, kind="geographic", ellipsoid=(block.spheroid.a, block.spheroid.b))
    return block.frame


@dataclass(frozen=True)
class Options:
    """Adjustment settings of a project; None: not specified.

    Attributes
    ----------
    datum, loss, unit_variance, max_iterations
        As in :func:`photogram.adjust`.
    max_bias_ratio
        As in :meth:`photogram.Result.with_max_bias_ratio`.
    """

    datum: DatumName | None = None
    loss: Literal["huber", "cauchy"] | None = None
    unit_variance: Literal["constrained", "unity", "redundancy"] = "constrained"
    max_iterations: int | None = None
    max_bias_ratio: float | None = None


@dataclass(frozen=True, eq=False)
class Repeated:
    """Repeated observations of points in photos; the block contains the first ones."""

    photos: tuple[str, ...] = ()  # k names of each
    points: tuple[str, ...] = ()
    # (k, 2) image coordinates, in the unit of the block
    xy: Floats = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, eq=False)
class Unused(Repeated):
    """Omitted image observations of a board (`use` = `off`)."""

    # (k, 2) standard deviations of image coordinates, in the unit of the block
    sd: Floats = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Project(Brief):
    """A block with the additional contents of its files.

    Attributes
    ----------
    block
        The block to adjust. Points that are neither control nor check points do not have a position in it.
    path
        File or folder of the project.
    title
        The format, for users.
    sizes
        Image width and height of each camera of the block, pixels; None if unknown.
    pixel_mm
        The side of a pixel of each camera in millimetres; None if unknown.
    starts
        (n, 3) positions of the points of the block in the file; NaN without.
    frame
        Reference frame of the coordinates; also in the block, and in its results.
    options
        Adjustment settings.
    lacks
        Missing or assumed data for an adjustment, with the option that adds them.
    messages
        Remarks on omitted, corrected or doubtful data.
    details
        Data for the writer of the same format; other formats ignore them.
    sd_taken
        Whether the reader has applied user-defined standard deviations of image coordinates, in the unit of
        the files.
    repeated
        Omitted repeated observations of points in photos.
    features
        Features to fit to adjusted points, as arguments of :func:`photogram.features`.
    statement
        Settings of its accuracy statement, as arguments of :meth:`photogram.Result.statement`.
    boards
        Boards whose points are the control, by name.
    unused
        Omitted image observations of the board.
    tracks
        Points whose names are numbers of tracks. A list of control points has other names.
    control_crs
        Coordinate reference system of the control, if it is not the frame.
    """

    block: Block
    path: Path
    title: str
    sizes: tuple[Size | None, ...]
    pixel_mm: tuple[float | None, ...]
    starts: Floats
    frame: Frame = field(default_factory=Frame)
    options: Options = field(default_factory=Options)
    lacks: tuple[Phrase, ...] = ()
    messages: tuple[Message, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    sd_taken: bool = False
    repeated: Repeated = field(default_factory=Repeated)
    features: Mapping[str, Definition] = field(default_factory=dict)
    statement: Mapping[str, Any] = field(default_factory=dict)
    boards: Mapping[str, Board] = field(default_factory=dict)
    unused: Unused = field(default_factory=Unused)
    tracks: frozenset[str] = frozenset()
    control_crs: str = ""

    def __post_init__(self) -> None:
        given = self.block.in_frame(self.frame)
        object.__setattr__(self, "frame", frame_of(given))
        if (self.frame.kind == "geographic") != given.geographic:
            space = "geographic" if given.geographic else "rectangular: it has no spheroid"
            raise InputError(phrase("plain.frame-of-block", frame=self.frame.kind, space=space))
        if self.block.frame != self.frame:
            object.__setattr__(self, "block", self.block.in_frame(self.frame))

    def replace(self, **changes: Any) -> Self:
        """Return a project with some members replaced."""
        return replace(self, **changes)

    @property
    def checks(self) -> list[int]:
        """Check points: points with a known position and only free coordinates."""
        block = self.block
        known = np.isfinite(block.point_positions).any(axis=1) & ~np.isfinite(block.point_sd).any(axis=1)
        return [int(row) for row in np.flatnonzero(known)]

    def positions(self) -> Floats:
        """Return (n, 3) positions of control and check points, else from the file."""
        found: Floats = np.where(
            np.isnan(self.block.point_positions), self.starts, self.block.point_positions
        )
        return found


def assembled(
    *,
    path: Path,
    title: str,
    cameras: Sequence[Camera],
    sizes: Sequence[Size | None],
    photo_ids: list[str],
    photo_cameras: ArrayLike,
    centres: Floats,
    matrices: Floats,
    point_ids: list[str],
    starts: Floats,
    image_photos: Indices,
    image_points: Indices,
    image_xy: Floats,
    image_sd: Floats | float | None = None,
    pixel_mm: Sequence[float | None] | None = None,
    point_positions: Floats | None = None,
    point_sd: Floats | None = None,
    point_check_sd: Floats | None = None,
    photo_position_sd: ArrayLike = np.inf,
    photo_attitude_sd: ArrayLike = np.inf,
    observations: Sequence[Observation | Observations[Any]] = (),
    mounts: Sequence[Mount] = (),
    timed: Sequence[Timed] = (),
    passages: Sequence[Passage] = (),
    frame: Frame | None = None,
    options: Options | None = None,
    lacks: Sequence[Phrase] = (),
    messages: Sequence[Message] = (),
    details: Mapping[str, Any] | None = None,
    linear_unit: str = "m",
    name: str = "",
    spheroid: Spheroid | None = None,
    photo_to_ground: bool = False,
) -> Project:
    """Return the project of a file from its parts.

    `centres` (P, 3) and `matrices` (P, 3, 3), photo to object, are NaN if unknown; `image_sd` is None if
    missing in the file. Errors of the block name the file.
    """
    place, found = Place(path), list(messages)
    if not photo_ids:
        raise place.error(phrase("error.empty-file", content="photos"))
    left = repeated_pairs(image_photos, image_points, len(point_ids))
    repeated = Repeated(
        tuple(photo_ids[row] for row in image_photos[left].tolist()),
        tuple(point_ids[row] for row in image_points[left].tolist()),
        np.asarray(image_xy)[left],
    )
    if len(left):
        image_photos, image_points = np.delete(image_photos, left), np.delete(image_points, left)
        image_xy = np.delete(image_xy, left, axis=0)
        if image_sd is not None and np.ndim(image_sd):
            image_sd = np.delete(image_sd, left, axis=0)
        names = [f"{point} on {photo}" for point, photo in zip(repeated.points, repeated.photos, strict=True)]
        found.append(Message.of("read.repeated", n=len(left), names=names, option=Phrase("option.repeated")))
    lacking = list(lacks)
    if image_sd is None:
        unit = cameras[0].unit or "px"
        image_sd = ASSUMED_SD[unit]
        fields = {"number": float(image_sd), "unit": unit, "option": option_sd("images")}
        lacking.append(Phrase("read.images", fields))
    for each in (image_photos, image_points, image_xy, image_sd):
        if isinstance(each, np.ndarray):
            # These arrays are complete and read-only: the block shares them.
            each.flags.writeable = False
    count = len(point_ids)
    angles = np.full((len(photo_ids), 3), np.nan)
    known = np.isfinite(matrices).all(axis=(1, 2))
    if known.any():
        angles[known] = Attitudes(matrices[known]).values(
            "omega_phi_kappa_photo_to_ground" if photo_to_ground else "omega_phi_kappa"
        )
    with _names_at(place, photo=photo_ids, point=point_ids), at_place(place):
        block = Block(
            photo_ids=photo_ids,
            photo_positions=centres,
            photo_attitudes=angles,
            photo_position_sd=np.asarray(photo_position_sd),
            photo_attitude_sd=np.asarray(photo_attitude_sd),
            cameras=list(cameras),
            photo_cameras=np.asarray(photo_cameras),
            point_ids=point_ids,
            point_positions=np.full((count, 3), np.nan) if point_positions is None else point_positions,
            point_sd=np.full((count, 3), np.inf) if point_sd is None else point_sd,
            point_check_sd=None
            if point_check_sd is None or np.isnan(point_check_sd).all()
            else point_check_sd,
            image_photos=image_photos,
            image_points=image_points,
            image_xy=image_xy,
            image_sd=image_sd,
            observations=observations,
            mounts=mounts,
            timed=timed,
            passages=passages,
            linear_unit=linear_unit,
            title=name,
            spheroid=spheroid,
            photo_to_ground=photo_to_ground,
        )
    return Project(
        block=block,
        path=path,
        title=title,
        sizes=tuple(sizes),
        pixel_mm=tuple(pixel_mm) if pixel_mm is not None else (None,) * len(cameras),
        starts=starts,
        frame=frame or Frame(),
        options=options or Options(),
        lacks=tuple(lacking),
        messages=tuple(found),
        details=details or {},
        repeated=repeated,
    )


@contextmanager
def _names_at(place: Place, **names: Sequence[str]) -> Iterator[None]:
    """Add the location to the error of a block on repeated names."""
    try:
        yield
    except InputError:
        for kind, own in names.items():
            if len(set(own)) < len(own):
                twice = next(name for name, count in Counter(own).items() if count > 1)
                raise place.error(phrase("error.repeated", kind=kind, name=twice)) from None
        raise


class PointTable:
    """A table of points to which a reader adds positions, control and check points."""

    def __init__(self, names: list[str]) -> None:
        self.names = names
        self.starts, self.positions, self.check_sd = np.full((3, len(names), 3), np.nan)
        self.sd = np.full((len(names), 3), np.inf)
        self.observations: list[Observation] = []

    def control(self, row: int, xyz: Floats, covariance: Floats) -> None:
        """Add control; with correlations it becomes an observation of the point."""
        self.starts[row] = xyz
        variances = np.diag(covariance)
        if (covariance == np.diag(variances)).all():
            self.positions[row], self.sd[row] = xyz, np.where(np.isnan(xyz), np.inf, np.sqrt(variances))
        else:
            symmetric = (covariance + covariance.T) / 2
            self.observations.append(Control(self.names[row], xyz, covariance=symmetric))

    def check(self, row: int, xyz: Floats, variances: Floats) -> None:
        """Add a check point; variances that are not positive are unknown."""
        self.starts[row] = self.positions[row] = xyz
        self.check_sd[row] = np.sqrt(np.where(variances > 0, variances, np.nan))

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `assembled` for points."""
        return {
            "point_ids": self.names,
            "starts": self.starts,
            "point_positions": self.positions,
            "point_sd": self.sd,
            "point_check_sd": self.check_sd,
        }
