"""GROUND (units 4 and 9): ground control and adjusted ground points (GIANT guide, section II.B.5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from photogram.giant.fields import format_deviations, format_name, format_position
from photogram.giant.records import Record, Source

__all__ = ["CHECK_POINT", "GroundPoint", "ground_records", "parse_ground"]

CHECK_POINT = 7
"""The type code of a point of which nothing is held."""


@dataclass
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
        Column 80: the sum of 1, 2 and 4 for components that are to be ignored (unheld); 7 is a check point.
    record
        Where the point was read.
    repeats
        How many further records of the same name were read; they do not count.
    """

    name: str
    position: tuple[float, float, float]
    sd: tuple[float, float, float] = (0.0, 0.0, 0.0)
    type_code: int = 0
    record: Record | None = field(default=None, compare=False, repr=False)
    repeats: int = field(default=0, compare=False, repr=False)

    @property
    def held(self) -> tuple[bool, bool, bool]:
        """Which components are held."""
        return not self.type_code & 1, not self.type_code & 2, not self.type_code & 4


def parse_ground(source: Source, geographic: bool) -> list[GroundPoint]:
    """Read GROUND; of a point that stands there twice the first record counts, with a remark.

    Raises
    ------
    InputError
        A field that is no number or no angle, a type code above 7, or a point without a name.
    """
    points: dict[str, GroundPoint] = {}
    spellings: dict[str, Record] = {}
    for record in source.filled():
        name = record.identification(spellings)
        if not name:
            raise record.error("columns 1-8: the point has no name")
        point = GroundPoint(
            name,
            record.position(geographic),
            record.deviations(geographic, geographic, False),
            record.integer(80, 80),
            record,
        )
        if not 0 <= point.type_code <= CHECK_POINT:
            raise record.error(f"column 80: the type code {point.type_code} is not one of 0 to 7")
        if name in points:
            points[name].repeats += 1
            record.remark(f"duplicate control point {name}: record {spellings[name].number} is kept")
            continue
        for held, first in zip(point.held, (9, 21, 33), strict=True):
            if held and record.blank(first, first + 11):
                record.remark(f"columns {first}-{first + 11}: the blank component of {name} is held at zero")
        points[name] = point
    return list(points.values())


def ground_records(points: Iterable[GroundPoint], geographic: bool) -> list[str]:
    """Write GROUND.

    Raises
    ------
    ValueError
        A name or a number does not fit its field.
    """
    records = []
    for point in points:
        record = format_name(point.name) + format_position(point.position, geographic)
        record += format_deviations(point.sd, (geographic, geographic, False))
        records.append(f"{record:79}{point.type_code}" if point.type_code else record.rstrip())
    return records
