"""Support data of ISIS cubes after spiceinit, and lists of images."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from dataclasses import replace
from os import SEEK_END
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError, message_of
from photogram.formats.cards import filled_lines
from photogram.formats.csm.isd import Detector, Isd, Polynomials, Positions, Turns, of_angles, of_quaternions
from photogram.formats.csm.reading import (
    constant_rotation,
    fitting,
    from_pixels,
    isd_of,
    not_zero,
    transformed,
)
from photogram.io.files import reading
from photogram.io.json import read_json
from photogram.io.places import at_place, one_word, positive
from photogram.io.pvl import Group, Quantity, Value, parsed
from photogram.io.tree import Tree
from photogram.network.lens import Lens
from photogram.network.moving_photos import Lines
from photogram.network.trajectories import Interpolation, increasing
from photogram.words import Phrase, phrase

PIECE = 1 << 16
LONGEST = 1 << 26  # Bytes of a label, at most
KM = 1000.0

_END = re.compile(rb"(?mi)^[ \t]*End[ \t]*\r?$")
_MARK = b"Object = IsisCube"
_JOINED: dict[str, Interpolation] = {"linear": "linear", "hermitespline": "hermite"}
_POLYNOMIAL = "polyfunction"
_PLACES = ("J2000X", "J2000Y", "J2000Z")
_SPEEDS = ("J2000XV", "J2000YV", "J2000ZV")
_QUATERNIONS = ("J2000Q0", "J2000Q1", "J2000Q2", "J2000Q3")
_TIME = "ET"
_POLYNOMIALS = (("J2000SVX", "J2000SVY", "J2000SVZ"), ("J2000Ang1", "J2000Ang2", "J2000Ang3"))

_LRO, _APOLLO = "LUNAR RECONNAISSANCE ORBITER", re.compile(r"APOLLO[ _]?(1[567])")
_NAC = ("NACL", "NACR")
_CHANGED = ("AlphaCube", "Mapping")
"""Groups of cubes with other samples and lines than their camera: sub-areas, and maps."""


def is_cube(path: Path) -> bool:
    with reading(path), path.open("rb") as file:
        return file.read(len(_MARK)).lower() == _MARK.lower()


def read_label(path: Path) -> Group:
    text = b""
    with reading(path), path.open("rb") as file:
        while (end := _END.search(text)) is None:
            piece = file.read(PIECE)
            if not piece or len(text) > LONGEST:
                raise InputError(phrase("csm.label"), file=path)
            text += piece
    label = parsed(text[: end.end()].decode("utf-8", "replace"), path)
    label.need("IsisCube", path)
    return label


def _members(group: Group, path: Path) -> Tree:
    """Return the values of a group by key, without units."""
    return Tree({key: _plain(value) for key, value in group.items}, path, group.name)


def _plain(value: Value) -> Any:
    if isinstance(value, Quantity):
        return _plain(value.value)
    return [_plain(each) for each in value] if isinstance(value, list) else value


class _Table:
    """A table of a cube: numbers by column name."""

    def __init__(self, label: Group, name: str, path: Path) -> None:
        own = [each for each in label.groups("Table") if each.get("Name") == name]
        if not own:
            raise InputError(phrase("csm.no-table", name=name), file=path)
        self.label, self.path, self.name = own[0], path, name
        self.keys = replace(_members(own[0], path), path=name)
        fields = [_members(each, path) for each in own[0].groups("Field")]
        self.columns = [each["Name"].text() for each in fields]
        for each in fields:
            kind, size = each["Type"].text(), each["Size"].whole()
            if kind.lower() != "double" or size != 1:
                raise self.error(phrase("csm.column", name=each["Name"].value, type=kind, size=size))
        self.rows = self._rows()

    def error(self, message: str | Phrase) -> InputError:
        message = phrase("error.at", what=phrase("csm.table", name=self.name), message=message)
        return InputError(message, file=self.path, record=self.label.line)

    def _rows(self) -> Floats:
        records, width = self.keys["Records"].whole(1), len(self.columns)
        order = one_word(self, "ByteOrder", self.keys.get("ByteOrder", "Lsb").text().lower(), ("lsb", "msb"))
        if "^Table" in self.keys:
            raise self.error(phrase("csm.elsewhere"))
        size = 8 * width * records
        if self.keys["Bytes"].whole() != size:
            raise self.error(phrase("csm.bytes", n=self.keys["Bytes"].value, size=size))
        begin = self.keys["StartByte"].whole(1, 1 << 62) - 1
        with reading(self.path), self.path.open("rb") as file:
            if begin + size > file.seek(0, SEEK_END):
                raise self.error(phrase("csm.short"))
            file.seek(begin)
            data = file.read(size)
        found = np.frombuffer(data, dtype="<f8" if order == "lsb" else ">f8").astype(float)
        if not np.isfinite(found).all():
            raise self.error(phrase("format.finite", name="the table"))
        return found.reshape(records, width)

    def has(self, columns: Sequence[str]) -> bool:
        return set(columns) <= set(self.columns)

    def of(self, columns: Sequence[str]) -> Floats:
        """Return (k, n) numbers of columns."""
        missing = [each for each in columns if each not in self.columns]
        if missing:
            raise self.error(phrase("format.member", name=missing[0]))
        return np.asarray(self.rows[:, [self.columns.index(each) for each in columns]])

    @property
    def times(self) -> Floats:
        with at_place(self):
            return increasing(_TIME, self.of([_TIME])[:, 0])

    def sampled(self, columns: Sequence[str], kernel: str) -> tuple[Floats, Floats]:
        """Return (k,) times and (k, 3) values of polynomials, sampled without loss."""
        coefficients = self.of(columns)
        (reference, scale, degree), own = coefficients[-1], coefficients[:-1]
        if len(own) != degree + 1 or not scale:
            raise self.error(phrase("csm.polynomial", n=len(own), degree=degree))
        first, last = (self.keys[f"{kernel}Table{end}Time"].number() for end in ("Start", "End"))
        if not last > first:
            raise self.error(phrase("csm.span", first=first, last=last))
        return Polynomials(own.T, float(reference), float(scale)).sampled(first, last)


def read_positions(label: Group, path: Path) -> Positions:
    """Return the table InstrumentPosition of a cube."""
    table = _Table(label, "InstrumentPosition", path)
    joined = table.keys.get("CacheType", "Linear").text().lower()
    if table.has(_POLYNOMIALS[0]) and joined in (_POLYNOMIAL, "linear"):
        times, places = table.sampled(_POLYNOMIALS[0], "Spk")
        return Positions(times, KM * places, None, "lagrange")
    if joined not in _JOINED:
        names = [*_JOINED, _POLYNOMIAL]
        raise table.error(phrase("format.unknown", what="CacheType", value=joined, names=names))
    speeds = KM * table.of(_SPEEDS) if table.has(_SPEEDS) else None
    if speeds is None and _JOINED[joined] == "hermite":
        raise table.error(phrase("csm.velocities"))
    return Positions(table.times, KM * table.of(_PLACES), speeds, _JOINED[joined])


def read_turns(label: Group, name: str, path: Path) -> Turns:
    """Return a table of rotations of a cube, InstrumentPointing or BodyRotation."""
    table = _Table(label, name, path)
    constant = constant_rotation(table.keys, "ConstantRotation")
    if table.has(_POLYNOMIALS[1]):
        times, angles = table.sampled(_POLYNOMIALS[1], "Ck")
        return Turns(times, constant @ of_angles(angles), "lagrange")
    quaternions = of_quaternions(table, table.of(_QUATERNIONS))
    return Turns(table.times, constant @ quaternions, "linear")


def _instrument(label: Group, path: Path) -> tuple[Tree, str, str]:
    """Return the values of the instrument, and the names of the spacecraft and the instrument."""
    own = _members(label.need("IsisCube", path).need("Instrument", path), path)
    return own, own["SpacecraftName"].text().upper(), own["InstrumentId"].text().upper()


def serial_number(label: Group, path: Path) -> str:
    instrument, spacecraft, name = _instrument(label, path)
    if spacecraft == _LRO and name in _NAC:
        return f"LRO/{instrument['SpacecraftClockStartCount'].text()}/{name}"
    apollo = _APOLLO.fullmatch(spacecraft)
    if apollo and name == "METRIC":
        return f"APOLLO{apollo[1]}/METRIC/{instrument['StartTime'].text()}"
    raise InputError(phrase("csm.serial", instrument=name, spacecraft=spacecraft), file=path)


def read_cube(path: Path) -> Isd:
    """Return the support data in the label and the tables of a cube of the LRO Narrow Angle Camera.

    Sub-areas, maps and other instruments are rejected. Another instrument requires an ISD.
    """
    label = read_label(path)
    cube = label.need("IsisCube", path)
    for changed in _CHANGED:
        if cube.groups(changed):
            raise InputError(phrase("csm.derived", name=changed), file=path)
    instrument, spacecraft, name = _instrument(label, path)
    if spacecraft != _LRO or name not in _NAC:
        raise InputError(phrase("csm.instrument", instrument=name, spacecraft=spacecraft), file=path)
    keywords = _members(label.need("NaifKeywords", path), path)
    code = f"INS{_members(cube.need('Kernels', path), path)['NaifFrameCode'].whole(-(2**31))}"
    size = _members(cube.need("Core", path).need("Dimensions", path), path)
    samples, count = size["Samples"].whole(1), size["Lines"].whole(1)
    radii = keywords[f"BODY{keywords['BODY_CODE'].whole()}_RADII"]
    a, other, b = KM * np.array(radii.numbers(3))
    if a != other or not 0 < b <= a:
        raise radii.error(phrase("csm.radii", a=a, b=b))
    pointing = read_turns(label, "InstrumentPointing", path)
    rate = not_zero(instrument["LineExposureDuration"]) / 1000
    lines = Lines([[0.0, _start(instrument, keywords), rate]])
    lines, remarks = fitting(lines, count, pointing.times, keywords, code)
    return Isd(
        path,
        "line",
        spacecraft,
        name,
        (samples, count),
        (float(a), float(b)),
        not_zero(keywords[f"{code}_FOCAL_LENGTH"]),
        _detector(instrument, keywords, code),
        Lens("lrolrocnac", (keywords[f"{code}_OD_K"].number(),)),
        read_positions(label, path),
        pointing,
        read_turns(label, "BodyRotation", path),
        float(lines.times([count / 2])[0]),
        lines,
        remarks=remarks,
    )


def _detector(instrument: Tree, keywords: Tree, code: str) -> Detector:
    """Return the detector of a scanner whose images are summed only along lines."""
    summing = instrument["SpatialSumming"]
    centre = [keywords[f"{code}_BORESIGHT_{axis}"].number() for axis in ("SAMPLE", "LINE")]
    return Detector(
        np.array(centre),
        np.array([instrument["SampleFirstPixel"].number(), 0.0]),
        np.array([positive(summing, "the sum of pixels", summing.number()), 1.0]),
        {
            # ITRANSS and ITRANSL of instruments are focal2pixel of an ISD.
            "csm": from_pixels(keywords[f"{code}_ITRANSS"], keywords[f"{code}_ITRANSL"]),
            "isis": transformed(keywords, code),
        },
    )


def _start(instrument: Tree, keywords: Tree) -> float:
    """Return the ephemeris time of the start of reading, from spiceinit.

    The label contains its bytes as hexadecimal digits, the least significant first.
    """
    known = re.compile(r"CLOCK_ET_.*_COMPUTED")
    names = [name for name, _ in keywords.items() if known.fullmatch(name)]
    for key in ("SpacecraftClockPrerollCount", "SpacecraftClockStartCount"):
        own = [name for name in names if key in instrument and f"_{instrument[key].text()}_" in name]
        if own:
            value = keywords[own[0]]
            try:
                return float(struct.unpack("<d", bytes.fromhex(str(value.value)))[0])
            except (ValueError, struct.error):
                raise value.error(phrase("csm.time", value=str(value.value))) from None
    raise keywords.error(phrase("csm.clock"))


def read_support(path: Path) -> Isd:
    """Read the support data of an image from an ISIS cube or an ISD.

    Raises
    ------
    InputError
        If the file is not a valid cube or ISD, or its instrument is unknown.
    """
    return read_cube(path) if is_cube(path) else isd_of(read_json(path))


def read_list(path: Path) -> dict[str, Path]:
    """Return the files of a list of images by serial number.

    Parameters
    ----------
    path
        List with one image per line: a path, or serial number, comma and path. Relative paths refer to the
        folder of the list. Empty lines and lines that begin with # are ignored.

    Raises
    ------
    InputError
        If a file is missing, an ISD lacks a serial number, a serial number is repeated, or the list is empty.
    """
    found: dict[str, Path] = {}
    for place in filled_lines(path):
        try:
            serial, file = _of_line((place.text or "").strip(), path.parent)
        except InputError as error:
            message = message_of(error)
            if error.file is not None:
                message = phrase("error.at", what=str(error.file), message=message)
            raise place.error(message) from None
        if found.setdefault(serial, file) is not file:
            raise place.error(phrase("format.repeated", what="serial number", name=serial))
    if not found:
        raise InputError(phrase("format.missing", what="images"), file=path)
    return found


def _of_line(text: str, folder: Path) -> tuple[str, Path]:
    serial, comma, rest = text.partition(",")
    is_alone = not comma or (folder / text).is_file()
    name = text if is_alone else rest.strip()
    file = folder / name
    if not file.is_file():
        raise InputError(phrase("csm.file", name=name))
    if is_alone and not is_cube(file):
        raise InputError(phrase("csm.isd-serial"))
    return serial_number(read_label(file), file) if is_alone else serial.strip(), file
