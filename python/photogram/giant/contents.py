"""CAMERAS (unit 1), FRAMES (units 3, 8, 20), IMAGES (unit 2), GROUND (units 4, 9) (GIANT guide, II.B)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.giant.fields import (
    Columns,
    angle_fields,
    deviation_fields,
    format_name,
    format_principal_distance,
    position_fields,
    real_fields,
    texts,
)
from photogram.giant.records import Record, Source
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase

ATTITUDE_SD = 90 * 3600 * ARCSEC  # Default standard deviation of omega, phi and kappa: 90 degrees, in radians


@dataclass
class Camera:
    """One camera system.

    Attributes
    ----------
    name
        At most 8 characters; a blank name is valid, for a single camera.
    principal_distance
        Millimetres; negative for the positive (diapositive) plane, positive for the negative plane.
    record
        Record of the camera.
    """

    name: str
    principal_distance: float
    record: Record | None = field(default=None, compare=False, repr=False)


def parse_cameras(source: Source) -> list[Camera]:
    cameras: list[Camera] = []
    spellings: dict[str, Record] = {}
    for record in source.records():
        name = record.identification(spellings)
        first = spellings[name]
        if first is not record:
            raise record.error(phrase("giant.camera-repeated", camera=name, record=first.number))
        principal_distance = record.real(11, 20)
        if principal_distance == 0:
            raise record.error(phrase("giant.principal-distance", camera=name))
        cameras.append(Camera(name, principal_distance, record))
    return cameras


def camera_records(cameras: Iterable[Camera]) -> list[str]:
    return [
        f"{format_name(camera.name)}  {format_principal_distance(camera.principal_distance)}"
        for camera in cameras
    ]


@dataclass
class Frame:
    """One camera station: two records.

    Attributes
    ----------
    name
        The frame.
    position
        X, Y, Z in linear units, or longitude and latitude in radians and height.
    attitude
        Omega, phi, kappa in radians, in the sense of COMMON column 2.
    position_sd, attitude_sd
        Standard deviations in the same units; 0 is the default of the guide.
    record
        First record of the station.
    """

    name: str
    position: tuple[float, float, float]
    attitude: tuple[float, float, float]
    position_sd: tuple[float, float, float] = (0.0, 0.0, 0.0)
    attitude_sd: tuple[float, float, float] = (0.0, 0.0, 0.0)
    record: Record | None = field(default=None, compare=False, repr=False)


def _position(fields: Any, geographic: bool) -> tuple[Any, Any]:
    """Read position and standard deviations of a record, or of columns of records."""
    return fields.position(geographic), fields.deviations(geographic, geographic, False)


def _attitude(fields: Any) -> tuple[Any, Any]:
    return fields.attitude(), fields.deviations(True, True, True)


def parse_frames(source: Source, geographic: bool) -> list[Frame]:
    """Read FRAMES in their order, which structures the normal equations."""
    records = source.records()
    positions, attitudes = (Columns([record.text for record in records[first::2]]) for first in (0, 1))
    plain_attitudes = [*attitudes.rows(*_attitude(attitudes)), None]
    plain = zip(positions.rows(*_position(positions, geographic)), plain_attitudes, strict=False)
    frames: list[Frame] = []
    spellings: dict[str, Record] = {}
    pairs = zip(records[::2], [*records[1::2], None], plain, strict=False)
    for position, attitude, (plain_position, plain_attitude) in pairs:
        name = position.identification(spellings)
        if not name:
            raise position.error(phrase("giant.no-name", subject="frame"))
        first = spellings[name]
        if first is not position:
            raise position.error(phrase("giant.frame-repeated", frame=name, record=first.number))
        if attitude is None or attitude.identification(spellings) != name:
            where = position if attitude is None else attitude
            raise where.error(phrase("giant.attitude-record", frame=name))
        station, station_sd = plain_position or _position(position, geographic)
        angles, angles_sd = plain_attitude or _attitude(attitude)
        frames.append(Frame(name, station, angles, station_sd, angles_sd, position))
    return frames


def frame_records(frames: Iterable[Frame], geographic: bool) -> list[str]:
    frames = list(frames)
    rows = zip(
        frames,
        texts(position_fields([frame.position for frame in frames], geographic)),
        texts(angle_fields(np.array([frame.attitude for frame in frames]).reshape(-1, 3), 12)),
        deviation_fields([frame.position_sd for frame in frames], (geographic, geographic, False)),
        deviation_fields([frame.attitude_sd for frame in frames], (True, True, True)),
        strict=True,
    )
    records = []
    for frame, position, attitude, position_sd, attitude_sd in rows:
        name = format_name(frame.name)
        records += [(name + position + position_sd).rstrip(), (name + attitude + attitude_sd).rstrip()]
    return records


IMAGE_SD = 0.010  # Default standard deviation of an image coordinate in millimetres

TERMINATOR = "****"


@dataclass
class ImageFrame:
    """The images of one frame: header, points, terminator.

    Attributes
    ----------
    name
        The frame.
    points
        k names.
    xy
        (k, 2) image coordinates in millimetres.
    principal_distance
        Millimetres, signed; 0: the principal distance of the camera.
    sd
        Standard deviations of x and y in millimetres; 0 is the default, 0.010.
    camera
        Name of the camera system.
    record
        Record of the header.
    numbers
        (k,) record numbers of the points, if they were read from a file.
    """

    name: str
    points: list[str]
    xy: Floats
    principal_distance: float = 0.0
    sd: tuple[float, float] = (0.0, 0.0)
    camera: str = ""
    record: Record | None = field(default=None, compare=False, repr=False)
    numbers: list[int] = field(default_factory=list, compare=False, repr=False)

    def point_record(self, row: int) -> Record | None:
        """Return the record of the image of a row."""
        return self.record.source.record(self.numbers[row]) if self.record else None


def parse_images(source: Source) -> list[ImageFrame]:
    """Read IMAGES.

    All point records are read together, column by column; records that are not plain numbers are read again
    one by one.
    """
    numbers = source.filled()
    ends = [row for row, number in enumerate(numbers) if source.lines[number - 1].startswith(TERMINATOR)]
    starts = [0, *(end + 1 for end in ends)]
    if starts[-1] != len(numbers):
        header, last = source.record(numbers[starts[-1]]), source.record(numbers[-1])
        raise last.error(
            phrase("giant.terminator", frame=header.name(1), record=header.number, text=TERMINATOR)
        )
    points = np.ones(len(numbers), dtype=bool)
    points[ends] = False
    points[starts[:-1]] = False
    point_rows = np.flatnonzero(points)
    point_numbers = [numbers[row] for row in point_rows.tolist()]
    names = source.point_names(point_numbers)
    xy = _coordinates(source, point_numbers)

    frames = []
    spellings: dict[str, Record] = {}
    headers = [source.record(numbers[start]) for start in starts[:-1]]
    columns = Columns([header.text for header in headers], 11, 40)
    plain = columns.rows(
        np.column_stack([columns.deviation(21, 30), columns.deviation(31, 40)]),
        columns.real(11, 20)[:, np.newaxis],
    )
    bounds = np.searchsorted(point_rows, starts).tolist()
    for header, values, first, last in zip(headers, plain, bounds, bounds[1:], strict=False):
        if header.text.startswith(TERMINATOR):
            raise header.error(phrase("giant.no-header"))
        name = header.identification(spellings)
        if not name:
            raise header.error(phrase("giant.no-name", subject="frame"))
        sd, (distance,) = values or (
            (header.deviation(21, 30), header.deviation(31, 40)),
            (header.real(11, 20),),
        )
        frame = ImageFrame(name, names[first:last], xy[first:last], distance, sd, header.name(41))
        frame.record, frame.numbers = header, point_numbers[first:last]
        frames.append(frame)
    return frames


def _coordinates(source: Source, numbers: list[int]) -> Floats:
    """Read columns 11-30 of all point records."""
    columns = Columns([source.lines[number - 1] for number in numbers], 11, 30)
    xy = np.column_stack([columns.real(11, 20), columns.real(21, 30)])
    plain = columns.plain & ~columns.blank(11, 20) & ~columns.blank(21, 30)
    for row in np.flatnonzero(~plain).tolist():
        record = source.record(numbers[row])
        blank = [record.blank(first, first + 9) for first in (11, 21)]
        if all(blank) or (any(blank) and not record.blank(31, 48)):
            raise record.error(phrase("giant.no-coordinates"))
        if any(blank):
            record.remark(phrase("giant.blank-coordinate"))
        xy[row] = record.real(11, 20), record.real(21, 30)
    return xy


def image_records(frames: Iterable[ImageFrame]) -> list[str]:
    frames = list(frames)
    xy = texts(real_fields(np.concatenate([np.empty((0, 2)), *(frame.xy for frame in frames)]), 10, 3))
    distances = {value: format_principal_distance(value) for value in {f.principal_distance for f in frames}}
    deviations = deviation_fields([frame.sd for frame in frames], (False, False))
    names = {name: format_name(name) for name in {name for frame in frames for name in frame.points}}
    records = []
    first = 0
    for frame, sd in zip(frames, deviations, strict=True):
        distance = distances[frame.principal_distance]
        records.append(f"{format_name(frame.name)}  {distance}{sd}{format_name(frame.camera)}".rstrip())
        last = first + len(frame.points)
        records += [f"{names[name]}  {both}" for name, both in zip(frame.points, xy[first:last], strict=True)]
        records.append(TERMINATOR * 2)
        first = last
    return records


CHECK_POINT = 7  # The type code of a point with all components unheld


@dataclasses.dataclass(slots=True)
class GroundPoint:
    """One point of GROUND.

    Attributes
    ----------
    name
        The point.
    position
        X, Y, Z in linear units, or longitude and latitude in radians and height; NaN is written as blanks.
    sd
        Standard deviations in the same units; 0 is the default of COMMON.
    type_code
        Column 80: the sum of 1, 2 and 4 for unheld (ignored) components; 7 is a check point.
    record
        Record of the point.
    repeats
        Number of further records of the same name, which are ignored.
    """

    name: str
    position: tuple[float, float, float]
    sd: tuple[float, float, float] = (0.0, 0.0, 0.0)
    type_code: int = 0
    record: Record | None = dataclasses.field(default=None, compare=False, repr=False)
    repeats: int = dataclasses.field(default=0, compare=False, repr=False)

    @property
    def held(self) -> tuple[bool, bool, bool]:
        """Held components: X, Y, Z."""
        return not self.type_code & 1, not self.type_code & 2, not self.type_code & 4


def parse_ground(source: Source, geographic: bool) -> list[GroundPoint]:
    """Read GROUND; the first record of a repeated point is used, with a remark."""
    records = source.records()
    names = source.point_names([record.number for record in records])
    columns = Columns([record.text for record in records])
    plain = columns.rows(*_position(columns, geographic), columns.real(80, 80, 0)[:, np.newaxis])
    points: dict[str, GroundPoint] = {}
    for record, name, values in zip(records, names, plain, strict=True):
        position, sd, (type_code,) = values or (*_position(record, geographic), (record.integer(80, 80),))
        point = GroundPoint(name, position, sd, int(type_code), record)
        if point.type_code > CHECK_POINT:
            raise record.error(phrase("giant.digit", column=80, largest=7, value=point.type_code))
        first = points.setdefault(name, point)
        if first is not point and first.record is not None:
            first.repeats += 1
            record.remark(phrase("giant.control-repeated", point=name, record=first.record.number))
            continue
        for held, value, column in zip(point.held, position, (9, 21, 33), strict=True):
            if held and value == 0 and record.blank(column, column + 11):
                record.remark(phrase("giant.blank-component", first=column, last=column + 11, point=name))
    return list(points.values())


def ground_records(points: Iterable[GroundPoint], geographic: bool) -> list[str]:
    points = list(points)
    rows = zip(
        points,
        texts(position_fields([point.position for point in points], geographic)),
        deviation_fields([point.sd for point in points], (geographic, geographic, False)),
        strict=True,
    )
    records = []
    for point, position, sd in rows:
        record = format_name(point.name) + position + sd
        records.append(f"{record:79}{point.type_code}" if point.type_code else record.rstrip())
    return records
