"""Files of corners, boards and camera models: recognition and reading.

Corner tables are CSV with all usual column names, mrcal text (`.vnl`) and Kalibr tables.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import read_columns, read_rows
from photogram.io.files import read_beginning, reading
from photogram.io.numbers import finite_number
from photogram.lazy_dataclasses import dataclass
from photogram.targets.board import Board, is_board
from photogram.targets.corners import Measured
from photogram.targets.opencv_corners import BEGIN_BYTES, is_npz, is_storage, read_npz, read_storage
from photogram.words import phrase

_SYNONYMS: Mapping[str, str] = {
    **dict.fromkeys(("photo", "picture", "file", "filename", "img", "image_name"), "image"),
    **dict.fromkeys(("corner", "corner_id", "id", "target", "marker", "point_id"), "point"),
    **dict.fromkeys(("u", "column", "col", "x_px"), "x"),
    **dict.fromkeys(("v", "row", "y_px"), "y"),
    **dict.fromkeys(("cam", "camera_id"), "camera"),
    **dict.fromkeys(("frame",), "view"),
    **dict.fromkeys(("timestamp", "t", "stamp"), "time"),
    **dict.fromkeys(("tag_id",), "tag"),
    "sigma": "sd",
}
_NUMBERS = {"x", "y", "sd", "level", "weight", "time"}
MIN_NANOSECONDS = 1e12  # larger times are in nanoseconds
HEADLESS = ("time", "point", "x", "y")
MISSING = "-"  # in the text format of mrcal


def _spelled(names: Sequence[str]) -> list[str]:
    """Return standard column names; with `tag`, `corner` is the corner of a tag."""
    own = {"corner": "corner"} if {"tag", "tag_id"} & {*names} else {}
    return [own.get(name) or _SYNONYMS.get(name, name) for name in names]


def _first_line(path: Path) -> str:
    lines = (line.strip() for line in read_beginning(path).splitlines())
    return next((line for line in lines if line and line[0] != "#"), "")


def is_table(path: Path) -> bool:
    if path.suffix.lower() not in (".csv", ".tsv", ".txt"):
        return False
    cells = _first_line(path).replace(";", ",").split(",")
    found = {*_spelled([cell.strip('" ').lower() for cell in cells])}
    return {"x", "y"} <= found and bool(found & {"image", "time"}) and bool(found & {"point", "i", "tag"})


def is_headless(path: Path) -> bool:
    """Return whether a file has rows of time, corner, x and y without a header."""
    if path.suffix.lower() not in (".csv", ".txt"):
        return False
    cells = _first_line(path).replace(",", " ").split()
    try:
        return len(cells) == len(HEADLESS) and all(finite_number(cell) >= 0 for cell in cells[:2])
    except ValueError:
        return False


def is_vnl(path: Path) -> bool:
    """Return whether a file is mrcal text: a comment with its column names."""
    heads = [line[1:].split() for line in read_beginning(path).splitlines() if line.startswith("#")]
    return any(head[:3] == ["filename", "x", "y"] for head in heads)


def read_vnl(path: Path, board: Board | None) -> Measured:
    """Read mrcal text: all corners of an image by row, with `-` for missing values."""
    table = read_columns(path, known=("filename",), spelling=lambda names: names[:4])
    table.require("filename", "x", "y")
    images = table.names("filename")
    counts = np.bincount(images.rows, minlength=len(images.names))
    order = np.argsort(images.rows, kind="stable")
    within = np.empty(len(order), dtype=np.int64)  # row number within its image
    within[order] = np.arange(len(order)) - (np.cumsum(counts) - counts)[images.rows[order]]
    missing = np.array([cell == MISSING for cell in table.texts("x")], dtype=bool)
    none = np.bincount(images.rows[~missing], minlength=len(counts)) == 0
    points = counts if board is None else len(board.places)
    wrong = np.flatnonzero((counts != points) & ~none)
    if len(wrong):
        row = int(np.flatnonzero(images.rows == wrong[0])[0])
        rows = int(counts[wrong[0]])
        raise table.error(row, phrase("targets.rows-of-image", rows=rows, points=int(np.max(points))))
    there = ~missing
    xy = table.vectors(("x", "y"), read=_dashed)
    table.check_given(np.where(there[:, np.newaxis], xy, 0.0), ("x", "y"))
    sd, use = _of_levels(table)
    return Measured(path, images.names, images.rows[there], within[there], xy[there], sd[there], use[there])


def _dashed(cell: str) -> float:
    return np.nan if cell == MISSING else finite_number(cell)


def _of_levels(table: ColumnTable) -> tuple[Floats, Bools]:
    if "level" in table:
        level = table.numbers("level", np.nan, read=_dashed)
        use = level >= 0
        return np.where(use, 2.0 ** np.where(use, level, 0.0), 1.0), use
    if "weight" in table:
        weight = table.numbers("weight", np.nan, read=_dashed)
        use = weight > 0
        return np.where(use, 1 / np.where(use, weight, 1.0), 1.0), use
    if "sd" in table:
        sd = table.numbers("sd", 1.0)
        bad = np.flatnonzero(~(sd > 0))
        if len(bad):
            row = int(bad[0])
            raise table.cell_error(row, "sd", "error.positive", value=float(sd[row]))
        return sd, np.ones(table.count, dtype=bool)
    return np.ones(table.count), np.ones(table.count, dtype=bool)


def read_table(path: Path, board: Board | None) -> Measured:
    """Read a table with columns image or time; point, or i, j, or tag, corner; x, y."""
    table = read_columns(path, known=("image", "time"), numbers=_NUMBERS, spelling=_spelled)
    return _of_table(table, board)


def read_headless(path: Path, board: Board | None) -> Measured:
    """Read rows of time, corner, x and y; the file name is the camera name."""
    found = _of_table(read_rows(path, HEADLESS, numbers=("time", "x", "y")), board)
    return replace(found, cameras=[path.stem] * len(found.images))


def _of_table(table: ColumnTable, board: Board | None) -> Measured:
    table.require("x", "y")
    xy = table.given(("x", "y"))
    sd, use = _of_levels(table)
    own = "image" if "image" in table else "time"
    table.require(own)
    cameras = table.texts("camera") if "camera" in table else None
    keys = table.texts(own)
    if own == "image":
        table.names(own)  # rejects similar ones
    # Image names may be repeated for different cameras.
    whole = (
        keys if cameras is None else [f"{camera}\0{key}" for camera, key in zip(cameras, keys, strict=True)]
    )
    place: dict[str, int] = {}
    image = np.array([place.setdefault(key, len(place)) for key in whole], dtype=np.int64)
    first = np.unique(image, return_index=True)[1].tolist()
    times = None
    if "time" in table:
        times = table.numbers("time")[first]
        missing = np.flatnonzero(np.isnan(times))
        if len(missing):
            raise table.cell_error(first[int(missing[0])], "time", "error.empty")
        times = times * (1e-9 if times.max(initial=0.0) > MIN_NANOSECONDS else 1.0)
    views = None
    if "view" in table:
        of_rows = np.array(table.texts("view"), dtype=object)
        if wrong := np.flatnonzero(of_rows != of_rows[first][image]).tolist():
            raise table.cell_error(wrong[0], "view", "targets.other-view")
        views = of_rows[first].tolist()
    return Measured(
        path=table.path,
        images=[keys[row] for row in first],
        image=image,
        point=_points(table, board),
        xy=xy,
        sd=sd,
        use=use & table.flags("use"),
        cameras=None if cameras is None else [cameras[row] for row in first],
        views=views,
        times=times,
    )


def _points(table: ColumnTable, board: Board | None) -> Indices:
    if "point" in table:
        names = {name: k for k, name in enumerate(board.names)} if board is not None else None
        cells = table.texts("point")
        numbers = (int(cell) if cell.isdecimal() else -1 for cell in cells)
        known = numbers if names is None else (names.get(cell, -1) for cell in cells)
        found = np.fromiter(known, np.int64, len(cells))
        if wrong := np.flatnonzero(found < 0).tolist():
            raise table.cell_error(wrong[0], "point", "targets.no-point", point=cells[wrong[0]])
        return found
    if board is None:
        raise table.head.error(phrase("targets.needs-board"))
    if "tag" in table:
        return _of_tags(table, board)
    table.require("i", "j")
    columns, rows = board.grid
    i, j = (_whole(table, name, count) for name, count in (("i", columns), ("j", rows)))
    return j * columns + i


def _whole(table: ColumnTable, name: str, count: int) -> Indices:
    values = table.numbers(name)
    bad = np.flatnonzero(~((values == np.floor(values)) & (values >= 0) & (values < count)))
    if len(bad):
        row = int(bad[0])
        raise table.cell_error(
            row, name, "error.whole-range", low=0, high=count - 1, value=float(values[row])
        )
    return values.astype(np.int64)


def _of_tags(table: ColumnTable, board: Board) -> Indices:
    """Return points of an AprilGrid, numbered from the lower left."""
    if board.kind != "aprilgrid":
        raise table.head.error(phrase("targets.tags", board=board.described))
    table.require("corner")
    tag = _whole(table, "tag", board.columns * board.rows)
    corner = _whole(table, "corner", 4)
    right, up = np.array([0, 1, 1, 0])[corner], np.array([0, 0, 1, 1])[corner]
    row, column = np.divmod(tag, board.columns)
    return np.asarray((2 * row + up) * (2 * board.columns) + 2 * column + right)


MODEL = ".cameramodel"
KEY = "optimization_inputs"  # key in mrcal camera models with corners
PICTURES = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".tif", ".tiff", ".webp"})
ENDINGS = frozenset(
    {*(".vnl", ".csv", ".tsv", ".txt", ".yml", ".yaml", ".xml", ".json", ".npz", ".toml"), MODEL}
)
MAX_FILES_EXAMINED = 2000


@dataclass(frozen=True)
class Form:
    title: str
    knows: Callable[[Path], bool]
    read: Callable[[Path, Board | None], Measured]
    clear: bool = True


_FORMS = (
    Form("corners of mrcal", is_vnl, read_vnl),
    Form("storage of OpenCV", is_storage, read_storage),
    Form("table of corners", is_table, read_table, clear=False),
    Form("rows of corners", is_headless, read_headless, clear=False),
    Form("arrays of OpenCV", is_npz, read_npz, clear=False),
)


def is_picture(path: Path) -> bool:
    return path.suffix.lower() in PICTURES


def files_at(path: Path) -> list[Path]:
    """Return a file, or the files of a folder and its direct subfolders."""
    with reading(path):
        if not path.is_dir():
            path.stat()
            return [path]
        inside = sorted(path.iterdir())[:MAX_FILES_EXAMINED]
        below = [
            file for each in inside if each.is_dir() for file in sorted(each.iterdir())[:MAX_FILES_EXAMINED]
        ]
        return [each for each in [*inside, *below] if each.is_file()]


def sorted_files(path: Path) -> tuple[list[Path], list[Path], dict[Form, list[Path]]]:
    models, boards = [], []
    corners: dict[Form, list[Path]] = {}
    for each in files_at(path):
        if each.suffix.lower() not in ENDINGS:
            continue
        if is_board(each):
            boards.append(each)
        elif each.suffix == MODEL or (each.suffix == ".txt" and KEY in read_beginning(each, BEGIN_BYTES)):
            models.append(each)
        elif (form := next((own for own in _FORMS if own.knows(each)), None)) is not None:
            corners.setdefault(form, []).append(each)
    return models, boards, corners


def holds_targets(path: Path) -> bool:
    """Return whether a path contains board corners, or a board and corner files."""
    with reading(path):
        models, boards, corners = sorted_files(path)
    if boards and not path.is_dir():
        return False
    seen = corners or (boards and any(map(is_picture, files_at(path))))
    return bool(models or (boards and seen) or any(form.clear for form in corners))
