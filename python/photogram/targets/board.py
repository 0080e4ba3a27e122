"""Calibration boards: planar targets in a known order, or arbitrary points on a rigid body.

Points of a board are numbered row by row, x fastest, from 0. The origin is point 0; x runs along the columns,
y along the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, frozen, names, number, shaped, text
from photogram.arguments.equality import Valued
from photogram.arguments.fields import check_fields, option
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.delimited import read_columns
from photogram.io.files import read_beginning
from photogram.io.places import Place, at_place
from photogram.io.toml import read_toml
from photogram.io.tree import Tree
from photogram.io.yaml_text import read_yaml_text
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.summaries import Brief, Rows
from photogram.targets.options import Shape
from photogram.words import phrase

BoardKind = Literal["chessboard", "charuco", "aprilgrid", "circles", "asymmetric_circles", "points"]

MAX_POINTS = 100_000
MAX_LENGTH = 1e50  # in the unit of the board; fourth powers of lengths remain finite
MIN_VIEWS_OF_FREE_POINTS = 8  # the default shape is `points` from this number
_FIELDS_OF_OTHERS = {
    "points": ("tag_size", "tag_spacing", "spacing"),
    "aprilgrid": ("points", "point_names"),
}
PLANE_SDS_PER_SPACING, PLACE_SDS_PER_SPACING = 200.0, 500.0


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Board(Valued, Brief):
    """Calibration board with its targets.

    Parameters
    ----------
    kind
        `chessboard`, `charuco` (chessboard corners), `aprilgrid`, `circles`, `asymmetric_circles`, or
        arbitrary `points`.
    columns, rows
        Number of corners along x and y (not squares), circles, or AprilGrid tags; not used for `points`.
    spacing
        Distance of adjacent corners along x and y (one number for both), in `unit`. For asymmetric circles,
        distance of adjacent rows. An AprilGrid has `tag_size` and `tag_spacing` instead.
    unit
        Unit of all lengths.
    tag_size, tag_spacing
        For an AprilGrid: tag edge length, and ratio of gap and edge length.
    points, point_names
        For `points`: (n, 3) nominal positions, and names; None: numbers from 0.
    shape
        `held` (fixed), `bend` (two parabolas: :meth:`bent`), or `points` (each coordinate is weighted about
        its nominal value). None: `points` for 8 or more views, else `held`.
    sd_plane, sd_spacing
        For `points`: standard deviations of z, and of x and y, of each point. None: 1/200 and 1/500 of the
        spacing.
    point_sd
        (n, 3) standard deviations instead of `sd_plane` and `sd_spacing`.

    Raises
    ------
    InputError
        If the kind or shape is unknown, or if a field does not belong to the kind. If there are fewer than 2
        columns or rows or more than 100,000 points. If lengths are not positive, or if arbitrary points have
        the shape `bend`.
    """

    kind: BoardKind = "chessboard"
    columns: int = 0
    rows: int = 0
    spacing: tuple[float, float] | float | None = None
    unit: str = field(default="m", metadata={"check": text})
    tag_size: float | None = option(None, 1 / MAX_LENGTH, MAX_LENGTH)
    tag_spacing: float | None = option(None, 1 / MAX_LENGTH, MAX_LENGTH)
    points: ArrayLike | None = None
    point_names: Sequence[str] | None = None
    shape: Shape | None = None
    sd_plane: float | None = option(None, 1 / MAX_LENGTH, MAX_LENGTH)
    sd_spacing: float | None = option(None, 1 / MAX_LENGTH, MAX_LENGTH)
    point_sd: ArrayLike | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        for name in _FIELDS_OF_OTHERS.get(self.kind, ("points", "point_names", "tag_size", "tag_spacing")):
            if getattr(self, name) is not None:
                kind = phrase("targets.kind", kind=self.kind)
                raise InputError(phrase("error.not-applicable", name=name, other=kind))
        if self.kind == "points":
            self._check_points()
        else:
            self._check_grid()
        if self.point_sd is not None:
            self._set("point_sd", shaped("point_sd", self.point_sd, (len(self.places), 3), "not-negative"))

    def _check_points(self) -> None:
        if self.points is None:
            raise argument_error("points", "empty")
        if self.shape == "bend":
            raise InputError(phrase("targets.bend"))
        points = shaped("points", self.points, (None, 3))
        self._set("points", points)
        if wrong := points[~(np.abs(points) <= MAX_LENGTH)].tolist():
            raise argument_error("points", "range", low=-MAX_LENGTH, high=MAX_LENGTH, value=wrong[0])
        if self.point_names is not None:
            point_names = names("point_names", self.point_names)
            if not len(point_names) == len(set(point_names)) == len(points):
                raise InputError(phrase("targets.names", count=len(points), given=len(set(point_names))))
            self._set("point_names", tuple(point_names))

    def _check_grid(self) -> None:
        least = 1 if self.kind == "aprilgrid" else 2
        for name in ("columns", "rows"):
            if (count := getattr(self, name)) < least:
                raise argument_error(name, "least", low=least, value=count)
        columns, rows = self.grid
        if columns * rows > MAX_POINTS:
            raise argument_error("columns x rows", "most", high=MAX_POINTS, value=columns * rows)
        for name in ("tag_size", "tag_spacing") if self.kind == "aprilgrid" else ("spacing",):
            if getattr(self, name) is None:
                raise argument_error(name, "empty")
        if self.tag_size is not None and self.tag_spacing is not None:
            pitch = self.tag_size * (1 + self.tag_spacing)
            if self.spacing not in (None, pitch, (pitch, pitch)):
                raise InputError(phrase("targets.april-spacing", pitch=pitch, value=str(self.spacing)))
            self._set("spacing", (pitch, pitch))
            return
        both = self.spacing if isinstance(self.spacing, Sequence) else (self.spacing, self.spacing)
        if len(both) != 2:
            raise argument_error("spacing", "count", count=2, actual=len(both))
        self._set("spacing", (_length("spacing", both[0]), _length("spacing", both[1])))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the board."""
        return f"Board: {self.described}", [
            ("points", str(len(self.places))),
            ("shape", self.shape or "points with 8 views or more, else held"),
        ]

    @property
    def described(self) -> str:
        """Short description: kind, columns and rows, spacing."""
        if self.kind == "points":
            return f"{len(self.places)} points, {self.unit}"
        size = f"{self.columns} x {self.rows}"
        if self.kind == "aprilgrid":
            return f"aprilgrid, {size} tags of {self.tag_size:g} {self.unit}, gap {self.tag_spacing:g}"
        x, y = self.pitch
        apart = f"{x:g}" if x == y else f"{x:g} x {y:g}"
        return f"{self.kind}, {size} points, spacing {apart} {self.unit}"

    @property
    def found_whole(self) -> bool:
        """Whether detection requires all points because they are not numbered."""
        return self.kind in ("chessboard", "circles", "asymmetric_circles")

    @property
    def grid(self) -> tuple[int, int]:
        """Number of points along x and y.

        An AprilGrid has twice its tags; arbitrary points have their number and 1.
        """
        if self.kind == "points":
            return len(self.places), 1
        return (2 * self.columns, 2 * self.rows) if self.kind == "aprilgrid" else (self.columns, self.rows)

    @property
    def pitch(self) -> tuple[float, float]:
        """Distance of adjacent columns and of adjacent rows; typical for `points`."""
        if isinstance(self.spacing, tuple):
            return self.spacing
        places = self.places
        extent = float(np.linalg.norm(np.ptp(places, axis=0)))
        typical = extent / max(np.sqrt(len(places)) - 1, 1.0)
        return typical, typical

    @property
    def places(self) -> Floats:
        """(n, 3) nominal positions of the points."""
        if self.points is not None:
            return np.asarray(self.points)
        x, y = self.pitch
        columns, rows = self.grid
        i, j = np.tile(np.arange(columns), rows), np.repeat(np.arange(rows), columns)
        if self.kind == "aprilgrid":
            assert self.tag_size is not None
            plane = [each // 2 * x + each % 2 * self.tag_size for each in (i, j)]
        elif self.kind == "asymmetric_circles":
            plane = [(2 * i + j % 2) * x, j * y]
        else:
            plane = [i * x, j * y]
        return frozen(np.stack([*plane, np.zeros(len(i))], axis=1))

    @property
    def names(self) -> list[str]:
        """N names of the points, by default their numbers."""
        return [str(k) for k in range(len(self.places))] if self.point_names is None else [*self.point_names]

    def bent(self, x: float, y: float) -> Floats:
        """Return (n, 3) positions for two parabolas: z = 4 x a (1 - a) + 4 y b (1 - b).

        Parameters
        ----------
        x, y
            Centre deflections along columns and rows. The coordinates a and b run from 0 to 1.
        """
        return np.asarray(self.places + np.einsum("nki,k->ni", self.shifts(), [x, y]))

    def shifts(self) -> Floats:
        """Return (n, 2, 3) point movements for unit deflections along columns and rows."""
        places = self.places
        a, b = (places[:, :2] / places[:, :2].max(axis=0)).T
        found = np.zeros((len(places), 2, 3))
        found[:, 0, 2], found[:, 1, 2] = 4 * a * (1 - a), 4 * b * (1 - b)
        return found

    def shape_of(self, views: int) -> Shape:
        """Return the estimated shape of the board for a number of views."""
        return self.shape or ("points" if views >= MIN_VIEWS_OF_FREE_POINTS else "held")

    def deviations(self, views: int) -> Floats:
        """Return (n, 3) standard deviations of the points, 0 for fixed ones."""
        count = len(self.places)
        if self.shape_of(views) != "points":
            return np.zeros((count, 3))
        if self.point_sd is not None:
            return np.asarray(self.point_sd)
        typical = min(self.pitch)
        plane = typical / PLANE_SDS_PER_SPACING if self.sd_plane is None else self.sd_plane
        spacing = typical / PLACE_SDS_PER_SPACING if self.sd_spacing is None else self.sd_spacing
        return np.tile([spacing, spacing, plane], (count, 1))

    def replace(self, **changes: Any) -> Self:
        """Return the board with some fields replaced and validated."""
        if self.kind == "aprilgrid":
            changes = {"spacing": None} | changes
        return replace(self, **changes)


def _length(name: str, value: object) -> float:
    length = number(name, value)
    if not 1 / MAX_LENGTH <= length <= MAX_LENGTH:
        raise argument_error(name, "range", low=1 / MAX_LENGTH, high=MAX_LENGTH, value=length)
    return length


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
    with at_place(file):
        return Board(**fields)


def _points(file: Tree) -> dict[str, Any]:
    """Return points of a table: point, x, y, z; sd, or sd_x, sd_y, sd_z."""
    path = file.file.parent / file.text()
    if not path.is_file():
        raise file.error(phrase("targets.no-table", name=path.name))
    table = read_columns(path, known=("point",), numbers=("x", "y", "z", "sd", *_SD))
    table.require("point", "x", "y", "z")
    found: dict[str, Any] = {"points": table.given(("x", "y", "z")), "point_names": table.names_once("point")}
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
