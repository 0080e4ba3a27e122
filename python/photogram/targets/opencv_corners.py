"""OpenCV corner files: `image_points` in YAML, XML or JSON, or arrays `objpoints` and `imgpoints`.

Archives of NumPy arrays (`.npz`) from other programs are read as numbers and text without unpickling.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import shaped, text, truth_value
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_beginning, read_bytes
from photogram.io.json import read_json
from photogram.io.numbers import number_or_text
from photogram.io.places import Place, at_place
from photogram.io.sheets import UNPACKABLE, check_unpacked_size
from photogram.io.tree import Tree
from photogram.io.yaml_text import read_yaml_text
from photogram.memory import require
from photogram.targets.board import Board
from photogram.targets.corners import Measured
from photogram.words import phrase

POINTS = "image_points"
BEGIN_BYTES = 1 << 20  # of a file, which contain a name that identifies the format
MAX_GRID_ERROR = 1e-6  # of points of a grid, in spacings


def is_storage(path: Path) -> bool:
    if path.suffix.lower() not in (".yml", ".yaml", ".xml", ".json"):
        return False
    return POINTS in read_beginning(path, BEGIN_BYTES)


def is_npz(path: Path) -> bool:
    return path.suffix.lower() == ".npz"


def read_storage(path: Path, board: Board | None) -> Measured:
    """Read `image_points` (views x corners x 2) and the board (`board_width` ...)."""
    suffix = path.suffix.lower()
    if suffix == ".json":
        content = read_json(path)
    else:
        content = Tree(_xml(path) if suffix == ".xml" else read_yaml_text(path), path)
    xy = _matrix(content[POINTS])
    if xy.ndim != 3 or xy.shape[2] != 2:
        raise content[POINTS].error(phrase("targets.matrix", what="views by corners of x and y"))
    sizes = {}
    if "image_width" in content and "image_height" in content:
        sizes[""] = content["image_width"].whole(1), content["image_height"].whole(1)
    grid = _matrix(content["grid_points"]) if "grid_points" in content else None
    if board is None and all(key in content for key in ("board_width", "board_height", "square_size")):
        columns, rows = content["board_width"].whole(), content["board_height"].whole()
        with at_place(Place(path)):
            board = Board(columns=columns, rows=rows, spacing=content["square_size"].number())
        if grid is not None:
            places, points = grid.reshape(-1, grid.shape[-1]), content["grid_points"]
            if places.shape != board.places.shape:
                raise points.error(phrase("targets.other-points", board=board.described))
            if _distance(places, board) > MAX_GRID_ERROR:
                raise points.error(phrase("targets.other-places", board=board.described))
    return _measured(path, xy, board, sizes)


def _measured(path: Path, xy: Floats, board: Board | None, sizes: dict[str, tuple[int, int]]) -> Measured:
    views, points = xy.shape[:2]
    if board is not None and len(board.places) != points:
        fields = {"points": points, "count": len(board.places), "board": board.described}
        raise InputError(phrase("targets.corner-count", **fields), file=path)
    rows = xy.reshape(-1, 2)
    detected = np.isfinite(rows).all(axis=1)  # others are NaN
    image, point = np.repeat(np.arange(views), points), np.tile(np.arange(points), views)
    return Measured(
        path=path,
        images=[f"view{view:03d}" for view in range(views)],
        image=image[detected],
        point=point[detected],
        xy=rows[detected],
        sizes=sizes,
        board=board,
    )


def _matrix(tree: Tree) -> Floats:
    """Return an OpenCV matrix: rows x cols x channels, without a single channel axis."""
    rows, cols = tree["rows"].whole(), tree["cols"].whole()
    kind = tree["dt"].text() if isinstance(tree["dt"].value, str) else str(tree["dt"].value)
    match = re.fullmatch(r"\"?(\d*)([fd])\"?", kind.strip())
    if match is None:
        raise tree["dt"].error(phrase("targets.matrix", what="floating-point numbers"))
    channels = int(match[1] or 1)
    data = tree["data"]
    given = data.value if isinstance(data.value, list) else None
    if given is None or len(given) != rows * cols * channels:
        raise data.error(phrase("targets.matrix", what=f"{rows} x {cols} x {channels} numbers"))
    numbers = [np.nan if str(each.value).lower() in (".nan", "nan") else each.number() for each in data]
    return np.reshape(numbers, (rows, cols, channels) if channels > 1 else (rows, cols))


def _xml(path: Path) -> dict[str, Any]:
    """Return the content of an XML storage: matrices, and plain values."""
    try:
        root = ElementTree.fromstring(read_bytes(path))
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        record = error.position[0] if isinstance(error, ElementTree.ParseError) else None
        message = phrase("error.parse", format="XML (UTF-8)", reason=str(error))
        raise InputError(message, file=path, record=record) from None
    return {each.tag: _element(each) for each in root}


def _element(element: ElementTree.Element) -> Any:
    if len(element):
        return {
            each.tag: [number_or_text(word) for word in (each.text or "").split()]
            if each.tag == "data"
            else _element(each)
            for each in element
        }
    return number_or_text((element.text or "").strip())


def read_npz(path: Path, board: Board | None) -> Measured:
    """Read `imgpoints` (views x corners x 2), and the grid `objpoints` if needed."""
    arrays = read_arrays(path, read_bytes(path))
    name = arrays.first("imgpoints", "image_points")
    shape = arrays.arrays[name].shape
    if len(shape) == 4 and shape[2] == 1:
        xy = arrays.numbers(name, None, None, 1, 2)[:, :, 0]
    else:
        xy = arrays.numbers(name, None, None, 2)
    sizes = {}
    for key in ("image_size", "imgsize"):
        if key in arrays:
            width, height = arrays.numbers(key, 2).astype(int).tolist()
            sizes[""] = width, height
    own = board
    if own is None:
        own = _gridded(
            path, arrays.numbers(arrays.first("objpoints", "object_points"), len(xy), xy.shape[1], 3)
        )
    return _measured(path, xy, own, sizes)


def _gridded(path: Path, places: Floats) -> Board:
    first = places[0]
    columns = int(np.argmax(first[:, 1] != first[0, 1])) or len(first)
    spacing = (float(first[1, 0] - first[0, 0]), float(first[min(columns, len(first) - 1), 1] - first[0, 1]))
    try:
        board = Board(columns=columns, rows=len(first) // columns, spacing=spacing)
    except InputError:
        board = None
    if board is None or not _distance(places - first[0], board) <= MAX_GRID_ERROR:
        raise InputError(phrase("targets.no-grid"), file=path)
    return board


def _distance(places: Floats, board: Board) -> float:
    """Return the largest distance of points from those of a board, in spacings."""
    if places.shape[-2:] != board.places.shape:
        return np.inf
    return float(np.abs(places - board.places).max() / min(board.pitch))


class Arrays:
    def __init__(self, path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.path, self.arrays = path, arrays

    def __contains__(self, name: str) -> bool:
        # In mrcal files, empty text means None.
        return name in self.arrays and not (self.arrays[name].dtype.kind == "U" and self.text(name) == "")

    def refusal(self, code: str, name: str, **fields: object) -> InputError:
        return InputError(phrase(code, name=name, **fields), file=self.path)

    def first(self, *names: str) -> str:
        """Return the first existing name; versions of a program write different names."""
        existing = next((name for name in names if name in self), None)
        if existing is None:
            raise InputError(phrase("error.missing", name=" or ".join(names)), file=self.path)
        return existing

    def text(self, name: str) -> str:
        with at_place(Place(self.path)):
            return text(name, self.arrays[name].tolist())

    def says(self, name: str) -> bool:
        """Return whether an array is true; False if it is missing."""
        if name not in self:
            return False
        value = self.arrays[name].tolist()
        with at_place(Place(self.path)):
            return truth_value(name, bool(value) if type(value) is int else value)

    def numbers(self, name: str, *shape: int | None) -> Floats:
        """Return an array of finite numbers; None in the shape permits any length."""
        array = self.arrays[name]
        if array.ndim == len(shape):
            shape = tuple(n if own is None else own for own, n in zip(shape, array.shape, strict=True))
        with at_place(Place(self.path)):
            return shaped(name, array, shape, "finite")


def read_arrays(path: Path, data: bytes) -> Arrays:
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            check_unpacked_size(path, members)
            require(sum(each.file_size for each in members), f"{path}: arrays")
            for member in members:
                name, content = member.filename.removesuffix(".npy"), io.BytesIO(archive.read(member))
                try:
                    arrays[name] = np.lib.format.read_array(content, allow_pickle=False)
                except Exception as error:  # any error of the parser for a damaged header
                    message = phrase("targets.array-damaged", name=name, reason=str(error))
                    raise InputError(message, file=path) from None
    except UNPACKABLE as error:
        message = phrase("error.parse", format="as an archive of arrays (npz)", reason=str(error))
        raise InputError(message, file=path) from None
    return Arrays(path, arrays)
