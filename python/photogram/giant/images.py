"""IMAGES (unit 2): the image coordinates, frame by frame (GIANT guide, section II.B.3)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from photogram.giant.fields import format_deviations, format_name, format_real, parse_name
from photogram.giant.records import Record, Source

__all__ = ["IMAGE_SD", "ImageFrame", "image_records", "parse_images"]

IMAGE_SD = 0.010
"""Default standard deviation of an image coordinate in millimetres."""

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
        Millimetres, signed; 0 takes that of the camera.
    sd
        Standard deviations of x and y in millimetres; 0 is the default, 0.010.
    camera
        Name of the camera system.
    record
        Where the header was read.
    numbers
        (k,) numbers of the points' records, where they were read from a file.
    """

    name: str
    points: list[str]
    xy: NDArray[np.float64]
    principal_distance: float = 0.0
    sd: tuple[float, float] = (0.0, 0.0)
    camera: str = ""
    record: Record | None = field(default=None, compare=False, repr=False)
    numbers: list[int] = field(default_factory=list, compare=False, repr=False)

    def point_record(self, row: int) -> Record | None:
        """Return where the image of a row was read."""
        return self.record.source.record(self.numbers[row]) if self.record else None


def parse_images(source: Source) -> list[ImageFrame]:
    """Read IMAGES.

    All point records are read at once, column by column; those that are not plain numbers are read again one
    by one.

    Raises
    ------
    InputError
        A field that is no number, a point without a name or coordinates, or a frame without its terminator.
    """
    numbers = [number for number, line in enumerate(source.lines, 1) if line.strip(" ")]
    ends = [row for row, number in enumerate(numbers) if source.lines[number - 1].startswith(TERMINATOR)]
    starts = [0, *(end + 1 for end in ends)]
    if starts[-1] != len(numbers):
        header, last = source.record(numbers[starts[-1]]), source.record(numbers[-1])
        raise last.error(
            f"the frame {header.name(1)!r} (record {header.number}) has no terminator {TERMINATOR}"
        )
    points = np.ones(len(numbers), dtype=bool)
    points[ends] = False
    points[starts[:-1]] = False
    point_rows = np.flatnonzero(points)
    point_numbers = [numbers[row] for row in point_rows]
    names = _point_names(source, point_numbers)
    xy = _coordinates(source, point_numbers)

    frames = []
    spellings: dict[str, Record] = {}
    firsts = np.searchsorted(point_rows, starts[:-1]).tolist()
    for start, first, last in zip(starts, firsts, [*firsts[1:], len(point_numbers)], strict=False):
        header = source.record(numbers[start])
        if header.text.startswith(TERMINATOR):
            raise header.error("a terminator without the header of a frame before it")
        name = header.identification(spellings)
        if not name:
            raise header.error("columns 1-8: the frame has no name")
        sd = header.deviation(21, 30), header.deviation(31, 40)
        frame = ImageFrame(name, names[first:last], xy[first:last], header.real(11, 20), sd, header.name(41))
        frame.record, frame.numbers = header, point_numbers[first:last]
        frames.append(frame)
    return frames


def _point_names(source: Source, numbers: list[int]) -> list[str]:
    fields = [source.lines[number - 1][:8].rstrip(" ") for number in numbers]
    names = {text: parse_name(text, source.strip) for text in set(fields)}
    if len(set(names.values())) < len(names) or "" in names:
        spellings: dict[str, Record] = {}
        for number in numbers:
            if not source.record(number).identification(spellings):
                raise source.record(number).error("columns 1-8: the point has no name")
    return [names[text] for text in fields]


def _coordinates(source: Source, numbers: list[int]) -> NDArray[np.float64]:
    """Read columns 11-30 of all point records."""
    lines = [source.lines[number - 1] for number in numbers]
    table = np.frombuffer(
        "".join([f"{line[10:30]:20}" for line in lines]).encode("ascii", "replace"), dtype=np.uint8
    )
    fields = table.reshape(-1, 10)
    filled = fields != ord(" ")
    point = fields == ord(".")
    # Plain: digits with at most one decimal point and a sign in front only, together, not blank.
    digit = (fields >= ord("0")) & (fields <= ord("9"))
    sign = (fields == ord("-")) | (fields == ord("+"))
    first = filled.argmax(axis=1)
    count = filled.sum(axis=1)
    front = np.take_along_axis(sign, first[:, None], axis=1)[:, 0]
    digits = digit.sum(axis=1)
    together = count == fields.shape[1] - filled[:, ::-1].argmax(axis=1) - first
    plain = together & (digits > 0) & (point.sum(axis=1) <= 1) & (count == digits + point.sum(axis=1) + front)

    text = np.where(plain[:, None], fields, ord("0"))
    values = np.ascontiguousarray(text).view("S10")[:, 0].astype(np.float64)
    values[plain & ~point.any(axis=1)] /= 1000.0
    xy = values.reshape(-1, 2)
    for row in np.flatnonzero(~plain.reshape(-1, 2).all(axis=1)):
        xy[row] = _careful_coordinates(source.record(numbers[row]))
    return xy


def _careful_coordinates(record: Record) -> tuple[float, float]:
    blank = [record.blank(first, first + 9) for first in (11, 21)]
    if all(blank) or (any(blank) and not record.blank(31, 48)):
        raise record.error(
            "a point without coordinates; if it is a header, the terminator **** before it is missing"
        )
    if any(blank):
        record.remark("a blank image coordinate is read as zero")
    return record.real(11, 20), record.real(21, 30)


def image_records(frames: Iterable[ImageFrame]) -> list[str]:
    """Write IMAGES.

    Raises
    ------
    ValueError
        A name or a number does not fit its field.
    """
    records = []
    for frame in frames:
        distance = format_real(frame.principal_distance, 10, 3) if frame.principal_distance else " " * 10
        sd = format_deviations(frame.sd, (False, False))
        records.append(f"{format_name(frame.name)}  {distance}{sd}{format_name(frame.camera)}".rstrip())
        for name, (x, y) in zip(frame.points, frame.xy.tolist(), strict=True):
            records.append(f"{format_name(name)}  {format_real(x, 10, 3)}{format_real(y, 10, 3)}")
        records.append(TERMINATOR * 2)
    return records
