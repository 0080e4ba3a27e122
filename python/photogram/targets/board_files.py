"""Descriptions of boards: `board.toml`, and the target files of Kalibr."""

from __future__ import annotations

from pathlib import Path
from types import UnionType
from typing import Any

import numpy as np

from photogram.errors import InputError
from photogram.io.delimited import read_columns
from photogram.io.files import read_beginning
from photogram.io.json import Tree
from photogram.io.toml import TomlFile, float_of
from photogram.io.yaml_text import read_yaml_text
from photogram.messages import nearest
from photogram.targets.board import Board

BOARD_FILE = "board.toml"
_WORDS = ("kind", "unit", "shape")
_COUNTS = ("columns", "rows")
_LENGTHS = ("tag_size", "tag_spacing", "sd_plane", "sd_spacing")
_KEYS = (*_WORDS, *_COUNTS, "spacing", "spacing_x", "spacing_y", *_LENGTHS, "points", "picture_size")
_SD = ("sd_x", "sd_y", "sd_z")


def is_board(path: Path) -> bool:
    """Return whether a file describes a board: by its name, or by the type of a target of Kalibr."""
    if path.name == BOARD_FILE:
        return True
    return path.suffix.lower() in (".yaml", ".yml") and "target_type" in read_beginning(path)


def read_board(path: Path) -> Board:
    """Read a `board.toml`, or a target of Kalibr."""
    return _of_toml(path) if path.suffix.lower() == ".toml" else _of_kalibr(path)


def picture_size(path: Path) -> tuple[int, int] | None:
    """Return width and height of the pictures that a `board.toml` was seen in, where it says them."""
    if path.suffix.lower() != ".toml" or "picture_size" not in (file := TomlFile(path)).content:
        return None
    value = file.content["picture_size"]
    if not (isinstance(value, list) and len(value) == 2 and all(type(each) is int for each in value)):
        raise file.error("picture_size", "picture_size is a width and a height: [640, 480]")
    return value[0], value[1]


def _of_toml(path: Path) -> Board:
    file = TomlFile(path)
    content = file.content
    for key in content:
        if key not in _KEYS:
            raise file.error(key, f"a board has no {key}{nearest(key, _KEYS)}")
    given: dict[str, Any] = {key: _value(file, key, str, _TEXT) for key in _WORDS if key in content}
    given |= {key: _value(file, key, int, "a whole number") for key in _COUNTS if key in content}
    given |= {key: _number(file, key) for key in _LENGTHS if key in content}
    both = [key for key in ("spacing_x", "spacing_y") if key in content]
    if both and ("spacing" in content or len(both) == 1):
        raise file.error(both[0], "spacing, or spacing_x and spacing_y, say what a board has")
    if both:
        given["spacing"] = (_number(file, "spacing_x"), _number(file, "spacing_y"))
    elif "spacing" in content:
        given["spacing"] = _number(file, "spacing")
    if "points" in content:
        given |= _points(file, path.parent / _value(file, "points", str, _TEXT))
    return _made(given, path)


def _points(file: TomlFile, path: Path) -> dict[str, Any]:
    """Return points of a table: point, x, y, z; sd, or sd_x, sd_y, sd_z."""
    if not path.is_file():
        raise file.error("points", f"points: there is no file {path.name}")
    table = read_columns(path, known=("point",), numbers=("x", "y", "z", "sd", *_SD))
    table.require("point", "x", "y", "z")
    places = table.vectors(("x", "y", "z"))
    table.check_given(places, ("x", "y", "z"))
    found: dict[str, Any] = {"points": places, "point_names": table.names_once("point")}
    if "sd" in table or set(_SD) & {*table.columns}:
        sd = table.vectors(_SD)
        sd = np.where(np.isnan(sd), table.numbers("sd")[:, np.newaxis], sd)
        table.check_given(sd, _SD)
        found["point_sd"] = sd
    return found


_TEXT = "text between quotation marks"


def _value(file: TomlFile, key: str, kind: type | UnionType, what: str) -> Any:
    """Return a value of a kind, of which true and false are none."""
    value = file.content[key]
    if isinstance(value, bool) or not isinstance(value, kind):
        raise file.error(key, f"{key} is {what}")
    return value


def _number(file: TomlFile, key: str) -> float:
    return float_of(_value(file, key, int | float, "a number"))


_KINDS_OF_KALIBR = {"aprilgrid": "aprilgrid", "checkerboard": "chessboard", "circlegrid": "circles"}


def _of_kalibr(path: Path) -> Board:
    """Read a target of Kalibr, in metres."""
    content = Tree(read_yaml_text(path), path)
    kind = content["target_type"].text()
    if kind not in _KINDS_OF_KALIBR:
        raise content["target_type"].error(f"{kind} is none of {', '.join(_KINDS_OF_KALIBR)}")
    what = "tag" if kind == "aprilgrid" else "target"
    given: dict[str, Any] = {
        "kind": _KINDS_OF_KALIBR[kind],
        "columns": content[f"{what}Cols"].whole(1),
        "rows": content[f"{what}Rows"].whole(1),
    }
    if kind == "aprilgrid":
        given |= {"tag_size": content["tagSize"].number(), "tag_spacing": content["tagSpacing"].number()}
    elif kind == "checkerboard":
        given["spacing"] = content["colSpacingMeters"].number(), content["rowSpacingMeters"].number()
    else:
        skewed = content.get("asymmetricGrid", False).value
        if not isinstance(skewed, bool):
            raise content["asymmetricGrid"].error("is true or false")
        given |= {"spacing": content["spacingMeters"].number()}
        given |= {"kind": "asymmetric_circles"} if skewed else {}
    return _made(given, path)


def _made(given: dict[str, Any], path: Path) -> Board:
    try:
        return Board(**given)
    except InputError as error:
        raise InputError(error.message, file=path) from None
