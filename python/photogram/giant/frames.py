"""CAMERAS (unit 1) and FRAMES (units 3, 8, 20) (GIANT guide, II.B)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from photogram.giant.columns import Columns, angle_fields, deviation_fields, position_fields, texts
from photogram.giant.fields import format_name, format_principal_distance
from photogram.giant.records import Record, Source
from photogram.io.angles import ARCSEC
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
    """Read CAMERAS."""
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
    """Write CAMERAS."""
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


def parse_frames(source: Source, geographic: bool) -> list[Frame]:
    """Read FRAMES in their order, which structures the normal equations."""
    records = source.records()
    positions = Columns([record.text for record in records[::2]])
    attitudes = Columns([record.text for record in records[1::2]])
    plain = zip(
        positions.rows(positions.position(geographic), positions.deviations(geographic, geographic, False)),
        [*attitudes.rows(attitudes.attitude(), attitudes.deviations(True, True, True)), None],
        strict=False,
    )
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
        station, station_sd = plain_position or (
            position.position(geographic),
            position.deviations(geographic, geographic, False),
        )
        angles, angles_sd = plain_attitude or (
            attitude.attitude(),
            attitude.deviations(True, True, True),
        )
        frames.append(Frame(name, station, angles, station_sd, angles_sd, position))
    return frames


def frame_records(frames: Iterable[Frame], geographic: bool) -> list[str]:
    """Write FRAMES."""
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
