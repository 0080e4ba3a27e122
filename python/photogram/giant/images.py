"""IMAGES (unit 2): image coordinates (GIANT guide, II.B.3)."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from photogram.arguments.types import Floats
from photogram.giant.columns import Columns, deviation_fields, real_fields, texts
from photogram.giant.fields import format_name, format_principal_distance
from photogram.giant.records import Record, Source
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase

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
    """Write IMAGES."""
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
