"""Control networks for tests: made of messages, of text, of columns, and compared."""

import struct
from dataclasses import fields

import numpy as np

from photogram.formats.isis import ControlMeasures, ControlNetwork, ControlPoints, read_network

LABEL = 65536


def same(one, other):
    """Return whether two arrays, texts or groups are the same, NaN where NaN is."""
    if isinstance(one, tuple):
        return all(same(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    return one == other


def differing(one, other, but=()):
    """Return the names of what differs in two networks, apart from the version that they were read from."""
    parts = {
        "": (one, other),
        "points.": (one.points, other.points),
        "measures.": (one.measures, other.measures),
    }
    found = {
        f"{kind}{each.name}"
        for kind, (a, b) in parts.items()
        for each in fields(a)
        if each.name not in ("version", "points", "measures")
        and not same(getattr(a, each.name), getattr(b, each.name))
    }
    return sorted(found - set(but))


def read_again(content, tmp_path):
    """Return what a file holds that has this content."""
    file = tmp_path / "again.net"
    file.write_bytes(content)
    return read_network(file)


def varint(value):
    """Return a whole number as messages have it."""
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def packed(number, value):
    """Return a field of a message: a whole number, a number, a text or bytes, by the type of the value."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    if isinstance(value, float):
        return varint(number << 3 | 1) + struct.pack("<d", value)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


MEASURE = packed(1, "S/1") + packed(2, 3) + packed(3, 10.5) + packed(4, 20.25)
POINT = packed(1, "P1") + packed(2, 2)


def binary(*points, header=b"", version=5, info="", lengths=None):
    """Return a binary network of messages of points."""
    header = packed(1, "net") + packed(2, "MOON") + header
    body = b"".join((b"" if lengths else struct.pack("<I", len(each))) + each for each in points)
    label = f"""Object = ProtoBuffer
  Object = Core
    HeaderStartByte = {LABEL}
    HeaderBytes = {len(header)}
    PointsStartByte = {LABEL + len(header)}
    PointsBytes = {len(body)}
  End_Object
  Group = ControlNetworkInfo
    Version = {version}
    {info}
  End_Group
End_Object
End
"""
    return label.encode().ljust(LABEL, b"\0") + header + body


def in_text(points, head="Version = 5"):
    """Return a network in text."""
    return f"Object = ControlNetwork\n  NetworkId = net\n  {head}\n{points}\nEnd_Object\nEnd\n".encode()


MEASURE_TEXT = """
    Group = ControlMeasure
      SerialNumber = S/1
      MeasureType  = Manual
      Sample       = 1.5
      Line         = 2.5
    End_Group
"""
POINT_TEXT = f"""
  Object = ControlPoint
    PointType = Free
    PointId   = P1
{MEASURE_TEXT}
  End_Object
"""


def full_message():
    """Return a point with everything that a point and its measures can have, and what nobody knows."""
    six = struct.pack("<6d", 4, 0.5, 0.25, 9, -0.5, 16)
    log = packed(17, packed(1, 2) + packed(2, 0.75))
    measure = MEASURE + b"".join(
        [
            *(packed(5, 0.125), packed(6, -0.25), packed(7, "someone"), packed(8, "2020-01-01T00:00:00")),
            *(
                packed(9, 1),
                packed(10, 0),
                packed(11, 1),
                packed(12, 3.5),
                packed(13, 10.0),
                packed(14, 20.0),
            ),
            *(
                packed(15, 0.5),
                packed(16, 0.75),
                log,
                packed(40, "unknown"),
                packed(4000, 7),
                packed(41, 1.0),
            ),
            b"\xd5\x02abcd",
        ]
    )
    return POINT + b"".join(
        [
            *(packed(3, "who"), packed(4, "when"), packed(5, 1), packed(6, 1), packed(7, 0), packed(8, 1)),
            *(packed(9, 6), packed(10, "a.cub"), packed(11, 5), packed(12, "dem.cub"), packed(13, 1)),
            *(
                packed(14, 0),
                packed(15, 1),
                packed(16, 1.0),
                packed(17, 2.0),
                packed(18, 3.0),
                packed(19, six),
            ),
            *(packed(20, 1.5), packed(21, 2.5), packed(22, 3.5), packed(23, six), packed(24, b"\x08\x01")),
            *(packed(25, MEASURE), packed(25, measure), packed(26, "more"), packed(99, 3.5)),
        ]
    )


def small():
    """Return a network made of nothing but columns."""
    adjusted = np.array([[1.0, np.nan, np.nan], [2.0, np.nan, np.nan]])
    points = ControlPoints(["A", "B"], np.array([2, 4], np.int8), adjusted=adjusted)
    measures = ControlMeasures(["S"], np.zeros(3, np.int32), np.ones(3, np.int8))
    return ControlNetwork(points, measures, np.array([0, 1, 3]))
