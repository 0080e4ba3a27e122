"""Board descriptions: `board.toml`, and Kalibr target files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from photogram.io.delimited import read_columns
from photogram.io.files import read_beginning
from photogram.io.places import Place, at_place
from photogram.io.toml import read_toml
from photogram.io.tree import Tree
from photogram.io.yaml_text import read_yaml_text
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
    if path.suffix.lower() != ".toml" or "picture_size" not in (file := read_toml(path)):
        return None
    value = file["picture_size"].value
    if not (isinstance(value, list) and len(value) == 2 and all(type(each) is int for each in value)):
        raise file["picture_size"].error(phrase("targets.picture-size", value=str(value)))
    return value[0], value[1]


def _of_toml(path: Path) -> Board:
    file = read_toml(path)
    file.only(_KEYS)
    fields: dict[str, Any] = {key: file[key].text() for key in _WORDS if key in file}
    fields |= {key: file[key].whole() for key in _COUNTS if key in file}
    fields |= {key: file[key].number() for key in _LENGTHS if key in file}
    both = [key for key in ("spacing_x", "spacing_y") if key in file]
    if both and ("spacing" in file or len(both) == 1):
        raise file.source.error(both[0], phrase("targets.spacings", names=both))
    if both:
        fields["spacing"] = file["spacing_x"].number(), file["spacing_y"].number()
    elif "spacing" in file:
        fields["spacing"] = file["spacing"].number()
    if "points" in file:
        fields |= _points(file["points"])
    with at_place(Place(path)):
        return Board(**fields)


def _points(file: Tree) -> dict[str, Any]:
    """Return points of a table: point, x, y, z; sd, or sd_x, sd_y, sd_z."""
    path = file.file.parent / file.text()
    if not path.is_file():
        raise file.error(phrase("targets.no-table", name=path.name))
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


_KINDS_OF_KALIBR = {"aprilgrid": "aprilgrid", "checkerboard": "chessboard", "circlegrid": "circles"}


def _of_kalibr(path: Path) -> Board:
    content = Tree(read_yaml_text(path), path)
    kind = content["target_type"].choice(_KINDS_OF_KALIBR)
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
        skewed = content.get("asymmetricGrid", False).switch()
        fields |= {"spacing": content["spacingMeters"].number()}
        fields |= {"kind": "asymmetric_circles"} if skewed else {}
    with at_place(Place(path)):
        return Board(**fields)
