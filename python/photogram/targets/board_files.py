"""Board descriptions: `board.toml`, and Kalibr target files."""

from __future__ import annotations

from pathlib import Path
from types import UnionType
from typing import Any

import numpy as np

from photogram.arguments.arrays import value_field
from photogram.io.delimited import read_columns
from photogram.io.files import read_beginning
from photogram.io.json import Tree
from photogram.io.places import Place, at_place
from photogram.io.toml import TomlFile, float_of
from photogram.io.yaml_text import read_yaml_text
from photogram.messages import unknown_name
from photogram.targets.board import Board
from photogram.words import phrase

BOARD_FILE = "board.toml"
_WORDS = ("kind", "unit", "shape")
_COUNTS = ("columns", "rows")
_LENGTHS = ("tag_size", "tag_spacing", "sd_plane", "sd_spacing")
_KEYS = (*_WORDS, *_COUNTS, "spacing", "spacing_x", "spacing_y", *_LENGTHS, "points", "picture_size")
_SD = ("sd_x", "sd_y", "sd_z")


def is_board(path: Path) -> bool:
    """Return whether a file describes a board, by its name or Kalibr target type."""
    if path.name == BOARD_FILE:
        return True
    return path.suffix.lower() in (".yaml", ".yml") and "target_type" in read_beginning(path)


def read_board(path: Path) -> Board:
    """Read a `board.toml` or a Kalibr target."""
    return _of_toml(path) if path.suffix.lower() == ".toml" else _of_kalibr(path)


def picture_size(path: Path) -> tuple[int, int] | None:
    """Return width and height of the images given in a `board.toml`, if any."""
    if path.suffix.lower() != ".toml" or "picture_size" not in (file := TomlFile(path)).content:
        return None
    value = file.content["picture_size"]
    if not (isinstance(value, list) and len(value) == 2 and all(type(each) is int for each in value)):
        size = phrase("targets.picture-size", value=str(value))
        raise file.error("picture_size", phrase("error.at", what="picture_size", message=size))
    return value[0], value[1]


def _of_toml(path: Path) -> Board:
    file = TomlFile(path)
    content = file.content
    for key in content:
        if key not in _KEYS:
            raise file.error(key, unknown_name("key", key, _KEYS))
    fields: dict[str, Any] = {key: _value(file, key, str, "error.text") for key in _WORDS if key in content}
    fields |= {key: _value(file, key, int, "error.whole") for key in _COUNTS if key in content}
    fields |= {key: _number(file, key) for key in _LENGTHS if key in content}
    both = [key for key in ("spacing_x", "spacing_y") if key in content]
    if both and ("spacing" in content or len(both) == 1):
        raise file.error(both[0], phrase("targets.spacings", names=both))
    if both:
        fields["spacing"] = (_number(file, "spacing_x"), _number(file, "spacing_y"))
    elif "spacing" in content:
        fields["spacing"] = _number(file, "spacing")
    if "points" in content:
        fields |= _points(file, path.parent / _value(file, "points", str, "error.text"))
    with at_place(Place(path)):
        return Board(**fields)


def _points(file: TomlFile, path: Path) -> dict[str, Any]:
    """Return points of a table: point, x, y, z; sd, or sd_x, sd_y, sd_z."""
    if not path.is_file():
        raise file.error("points", phrase("targets.no-table", name=path.name))
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


def _value(file: TomlFile, key: str, kind: type | UnionType, code: str) -> Any:
    """Return a value of a type, excluding Booleans."""
    value = file.content[key]
    if isinstance(value, bool) or not isinstance(value, kind):
        message = phrase(code, value=value_field(value))
        raise file.error(key, phrase("error.at", what=key, message=message))
    return value


def _number(file: TomlFile, key: str) -> float:
    return float_of(_value(file, key, int | float, "error.number"))


_KINDS_OF_KALIBR = {"aprilgrid": "aprilgrid", "checkerboard": "chessboard", "circlegrid": "circles"}


def _of_kalibr(path: Path) -> Board:
    content = Tree(read_yaml_text(path), path)
    kind = content["target_type"].text()
    if kind not in _KINDS_OF_KALIBR:
        raise content["target_type"].error(phrase("error.choice", value=kind, names=[*_KINDS_OF_KALIBR]))
    what = "tag" if kind == "aprilgrid" else "target"
    fields: dict[str, Any] = {
        "kind": _KINDS_OF_KALIBR[kind],
        "columns": content[f"{what}Cols"].whole(1),
        "rows": content[f"{what}Rows"].whole(1),
    }
    if kind == "aprilgrid":
        fields |= {"tag_size": content["tagSize"].number(), "tag_spacing": content["tagSpacing"].number()}
    elif kind == "checkerboard":
        fields["spacing"] = content["colSpacingMeters"].number(), content["rowSpacingMeters"].number()
    else:
        skewed = content.get("asymmetricGrid", False).value
        if not isinstance(skewed, bool):
            raise content["asymmetricGrid"].error(phrase("error.flag", value=value_field(skewed)))
        fields |= {"spacing": content["spacingMeters"].number()}
        fields |= {"kind": "asymmetric_circles"} if skewed else {}
    with at_place(Place(path)):
        return Board(**fields)
