"""FRAMES (units 3, 8 and 20): position and attitude of the camera stations (GIANT guide, section II.B.4)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from photogram.giant.fields import ARCSEC, format_angle, format_deviations, format_name, format_position
from photogram.giant.records import Record, Source

__all__ = ["ATTITUDE_SD", "Frame", "frame_records", "parse_frames"]

ATTITUDE_SD = 90 * 3600 * ARCSEC
"""Default standard deviation of omega, phi and kappa: 90 degrees, in radians."""


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
        Where the station was read: its first record.
    """

    name: str
    position: tuple[float, float, float]
    attitude: tuple[float, float, float]
    position_sd: tuple[float, float, float] = (0.0, 0.0, 0.0)
    attitude_sd: tuple[float, float, float] = (0.0, 0.0, 0.0)
    record: Record | None = field(default=None, compare=False, repr=False)


def parse_frames(source: Source, geographic: bool) -> list[Frame]:
    """Read FRAMES; the order of the frames is kept, for it structures the normal equations.

    Raises
    ------
    InputError
        A field that is no number or no angle, a record without its partner, or a frame that stands there
        twice.
    """
    records = source.filled()
    frames: list[Frame] = []
    spellings: dict[str, Record] = {}
    for position, attitude in zip(records[::2], [*records[1::2], None], strict=False):
        name = position.identification(spellings)
        if not name:
            raise position.error("columns 1-8: the frame has no name")
        first = spellings[name]
        if first is not position:
            raise position.error(f"the frame {name!r} is already listed in record {first.number}")
        if attitude is None or attitude.identification(spellings) != name:
            where = position if attitude is None else attitude
            raise where.error(f"the second record (attitude) of the frame {name!r} was expected")
        frames.append(
            Frame(
                name,
                position.position(geographic),
                (attitude.angle(9, 20), attitude.angle(21, 32), attitude.angle(33, 44)),
                position.deviations(geographic, geographic, False),
                attitude.deviations(True, True, True),
                position,
            )
        )
    return frames


def frame_records(frames: Iterable[Frame], geographic: bool) -> list[str]:
    """Write FRAMES.

    Raises
    ------
    ValueError
        A name or a number does not fit its field.
    """
    records = []
    for frame in frames:
        name = format_name(frame.name)
        position = format_position(frame.position, geographic)
        attitude = "".join(format_angle(angle, 12) for angle in frame.attitude)
        position += format_deviations(frame.position_sd, (geographic, geographic, False))
        attitude += format_deviations(frame.attitude_sd, (True, True, True))
        records += [(name + position).rstrip(), (name + attitude).rstrip()]
    return records
