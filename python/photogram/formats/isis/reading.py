"""Reader of control networks: binary versions 2 and 5, text 3 to 5."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.isis.network import HEADER, MESSAGE, ControlNetwork, measures_of, points_of
from photogram.io.files import read_bytes, reading
from photogram.io.pvl import Group, Quantity, Value, parsed
from photogram.words import phrase

LABEL_BYTES = 65536  # Bytes of the label of a binary network, padded with zeros
_FIRST_OBJECT = re.compile(rb"\s*(?:(?:#|/\*)[^\n]*\n\s*)*object\s*=\s*(\w+)", re.IGNORECASE)
_BINARY, _TEXT = "protobuffer", "controlnetwork"
_BINARY_VERSIONS = ("2", "5")
_TEXT_VERSIONS = ("3", "4", "5")
_OLDEST = "1"  # Version of a network without a version
_HEADER = {key.lower(): name for key, name in HEADER.items()}


def _kind(data: bytes) -> str:
    """Return the name of the first object of a label in small letters; empty without."""
    found = _FIRST_OBJECT.match(data[:LABEL_BYTES].removeprefix(b"\xef\xbb\xbf"))
    return found[1].decode().lower() if found else ""


def is_network(head: bytes) -> bool:
    """Return whether this is the start of a control network."""
    return _kind(head) in (_BINARY, _TEXT)


def is_binary(path: Path) -> bool:
    """Return whether a control network is binary."""
    with reading(path), path.open("rb") as file:
        return _kind(file.read(LABEL_BYTES)) == _BINARY


def read_network(path: Path) -> ControlNetwork:
    """Read a control network.

    Comments of text are ignored: ISIS writes derived values there.

    Raises
    ------
    InputError
        If the file cannot be read, is not a control network, has an unknown version, or is damaged. The error
        contains the number of the point (binary networks) or the line (text).
    """
    data = read_bytes(path)
    kind = _kind(data)
    if kind == _BINARY:
        network = _binary(data, path)
    elif kind == _TEXT:
        network = _text(data, path)
    else:
        raise InputError(phrase("isis.network", value=str(kind)), file=path)
    ids = network.points.ids
    if len(set(ids)) < len(ids):
        first: dict[str, int] = {}
        for number, name in enumerate(ids, 1):
            if first.setdefault(name, number) != number:
                raise InputError(phrase("format.repeated", what="point", name=name), file=path, record=number)
    return network


def _check_version(version: str, known: tuple[str, ...], what: str, path: Path) -> None:
    if version not in known:
        raise InputError(phrase("isis.version", kind=what, version=version, names=list(known)), file=path)


def _whole(group: Group, key: str, path: Path, *, required: bool = False) -> int | None:
    """Return an integer that is not negative; None if the key is missing."""
    value = group.get(key)
    if value is None:
        if required:
            raise InputError(phrase("format.member", name=key), file=path, record=group.line)
        return None
    if not isinstance(value, str) or re.fullmatch(r"\d{1,18}", value) is None:
        raise InputError(phrase("format.whole", name=key, value=value), file=path, record=group.line)
    return int(value)


def _binary(data: bytes, path: Path) -> ControlNetwork:
    head = data[:LABEL_BYTES].split(b"\0", 1)[0]
    try:
        text = head.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = head.decode("latin-1")
    label = parsed(text, path, numbers=False)
    buffer = label.need("ProtoBuffer", path)
    core, info = (buffer.need(name, path) for name in ("Core", "ControlNetworkInfo"))
    version = str(info.get("Version") or _OLDEST)
    _check_version(version, _BINARY_VERSIONS, "binary", path)
    keys = ("HeaderStartByte", "HeaderBytes", "PointsStartByte", "PointsBytes")
    start, size, points, points_size = (int(_whole(core, key, path, required=True) or 0) for key in keys)
    texts, count, lengths, radii, rest = _photocore.control_header(data, start, start + size, path)
    listed = lengths if version == "2" else None
    columns, measures, firsts = _photocore.control_points(data, points, points + points_size, listed, path)
    known = {*_HEADER, "numberofpoints", "numberofmeasures", "version"}
    others = Group("", "label", items=[item for item in info.items if item[0].lower() not in known])
    others.items += label.items + buffer.items
    read = {id(buffer), id(core), id(info)}
    others.inside = [each for each in label.inside + buffer.inside if id(each) not in read]
    header: dict[str, Any] = dict(zip(MESSAGE, texts, strict=True))
    header |= {"radii": np.array(radii), "header_rest": rest, "version": int(version), "others": others}
    network = ControlNetwork(points_of(columns), measures_of(measures), firsts, **header)
    for said, found, what in (
        (count, len(network.points), "points"),
        (_whole(info, "NumberOfPoints", path), len(network.points), "points"),
        (_whole(info, "NumberOfMeasures", path), len(network.measures), "measures"),
    ):
        if said is not None and said != found:
            raise InputError(phrase("isis.count", count=said, what=what, n=found), file=path)
    return network


def _text(data: bytes, path: Path) -> ControlNetwork:
    (points, measures, firsts), around = _photocore.control_points_of_text(
        data.removeprefix(b"\xef\xbb\xbf"), path
    )
    label = parsed(around, path, numbers=False)
    network = label.need("ControlNetwork", path)
    _check_version(str(network.get("Version") or _OLDEST), _TEXT_VERSIONS, "text", path)
    header: dict[str, Any] = {}
    others = Group("", "label", items=[*label.items])
    others.inside = network.inside + [each for each in label.inside if each is not network]
    for key, value in network.items:
        if (name := _HEADER.get(key.lower())) is not None:
            if not isinstance(value, str):
                raise InputError(phrase("format.text", name=key, value=value), file=path, record=network.line)
            header[name] = value
        elif key.lower() == "targetradii":
            header["radii"] = _radii(value, network, path)
        elif key.lower() != "version":
            others.items.append((key, value))
    header |= {"version": int(str(network.get("Version"))), "others": others}
    return ControlNetwork(points_of(points), measures_of(measures), firsts, **header)


def _radii(value: Value, network: Group, path: Path) -> Floats:
    try:
        if isinstance(value, Quantity):
            if value.unit.lower() != "meters":
                raise ValueError
            value = value.value
        radii = np.array([float(str(each)) for each in (value if isinstance(value, list) else [value])])
        if not np.isfinite(radii).all():
            raise ValueError
    except ValueError:
        raise InputError(phrase("isis.radii", value=str(value)), file=path, record=network.line) from None
    return radii
