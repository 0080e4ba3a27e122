"""GROUND (units 4 and 9): ground points (GIANT guide, II.B.5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from photogram.giant.columns import Columns, deviation_fields, position_fields, texts
from photogram.giant.fields import format_name
from photogram.giant.records import Record, Source
from photogram.words import phrase

CHECK_POINT = 7  # The type code of a point with all components unheld


@dataclass(slots=True)
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
    record: Record | None = field(default=None, compare=False, repr=False)
    repeats: int = field(default=0, compare=False, repr=False)

    @property
    def held(self) -> tuple[bool, bool, bool]:
        """Held components: X, Y, Z."""
        return not self.type_code & 1, not self.type_code & 2, not self.type_code & 4


def parse_ground(source: Source, geographic: bool) -> list[GroundPoint]:
    """Read GROUND; the first record of a repeated point is used, with a remark."""
    records = source.records()
    names = source.point_names([record.number for record in records])
    columns = Columns([record.text for record in records])
    plain = columns.rows(
        columns.position(geographic),
        columns.deviations(geographic, geographic, False),
        columns.real(80, 80, 0)[:, np.newaxis],
    )
    points: dict[str, GroundPoint] = {}
    for record, name, values in zip(records, names, plain, strict=True):
        position, sd, (type_code,) = values or (
            record.position(geographic),
            record.deviations(geographic, geographic, False),
            (record.integer(80, 80),),
        )
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
    """Write GROUND."""
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
