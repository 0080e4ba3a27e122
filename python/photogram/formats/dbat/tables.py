"""Tables of DBAT: commas, `#` comments, columns by comment or script."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import message_of
from photogram.formats.dbat.content import DbatBuilder
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import NAMELESS, read_columns, read_rows
from photogram.io.numbers import whole_number
from photogram.io.places import one_word, positive
from photogram.network.attitudes import Attitudes
from photogram.words import Phrase, option_sd, phrase

_KNOWN = {
    "image": "im",
    "photo": "im",
    "frame": "im",
    "point": "id",
    "name": "label",
    "camera": "cam",
    "sigmax": "sx",
    "sigmay": "sy",
    "sigmaz": "sz",
}
_COLUMNS = ("id", "im", "cam", "path", "label", "x", "y", "z", "omega", "phi", "kappa")
_DEVIATIONS = ("sx", "sy", "sz", "sxy", "sxyz")
_NUMBERS = frozenset({"x", "y", "z", "omega", "phi", "kappa", *_DEVIATIONS})
_RADIANS = {"degrees": math.pi / 180, "deg": math.pi / 180, "radians": 1.0, "rad": 1.0, "gon": math.pi / 200}


def _spelled(columns: Sequence[str]) -> list[str]:
    own = [column.partition("(")[0].strip() for column in columns]
    return [_KNOWN.get(column, column) for column in own]


def titled(path: Path) -> ColumnTable:
    """Read a table with a header in a comment, `# id, image, x, y`."""
    table = read_columns(path, known=(*_COLUMNS, *_DEVIATIONS), numbers=_NUMBERS, spelling=_spelled)
    return table.renamed({NAMELESS: "id"}) if NAMELESS in table and "id" not in table else table


def untitled(path: Path, columns: Sequence[str]) -> ColumnTable:
    """Read a table whose columns are defined by a script."""
    return read_rows(path, _spelled([column.strip().lower() for column in columns]), numbers=_NUMBERS)


def _whole(table: ColumnTable, column: str) -> list[int]:
    found, known = [], dict[str, int]()
    for row, text in enumerate(table.texts(column)):
        if text not in known:
            try:
                known[text] = whole_number(text, highest=2**53)
            except ValueError as error:
                raise table.error(row, phrase("error.at", what=column, message=message_of(error))) from None
        found.append(known[text])
    return found


def take_photos(table: ColumnTable, content: DbatBuilder) -> None:
    """Add photos: numbers, paths and cameras; without camera column the only camera."""
    table.require("id", "path")
    known = list(content.sensors)
    if "cam" not in table and len(known) > 1:
        raise table.head.error(phrase("format.camera-column", n=len(known)))
    cameras = table.texts("cam", known[0] if len(known) == 1 else "")
    rows = zip(_whole(table, "id"), table.texts("path"), cameras, strict=True)
    for row, (number, path, camera) in enumerate(rows):
        content.numbered_photo(number, path, camera, table.at(row))


def take_poses(table: ColumnTable, content: DbatBuilder, unit: str = "degrees") -> None:
    """Add centres and angles omega, phi, kappa."""
    one_word(table.head, "unit of angles", unit, _RADIANS)
    table.require("id", "x", "y", "z", "omega", "phi", "kappa")
    angles = table.given(("omega", "phi", "kappa")) * _RADIANS[unit]
    matrices = Attitudes.of("omega_phi_kappa", angles).matrices
    poses = zip(_whole(table, "id"), table.given(("x", "y", "z")), matrices, strict=True)
    for row, (number, centre, matrix) in enumerate(poses):
        content.check_photo(number, table.at(row))
        content.pose(number, centre, matrix, table.at(row))


def take_points(
    table: ColumnTable,
    content: DbatBuilder,
    sd: Sequence[float] | None,
    *,
    check: bool = False,
    wanted: Callable[[int], bool] = lambda _: True,
) -> None:
    """Add control or check points; `sd` replaces their standard deviations."""
    table.require("id", "x", "y", "z")
    numbers, positions = _whole(table, "id"), table.given(("x", "y", "z"))
    deviations = _deviations(table, ("sx", "sy", "sz"), "sxyz")
    if sd is not None:
        deviations = np.broadcast_to(sd, deviations.shape)
    elif np.isnan(deviations).all() and not check:
        fields = {"file": table.path.name, "option": option_sd("control")}
        content.lacks.append(Phrase("read.held", fields))
    for row, number in enumerate(numbers):
        if wanted(number):
            if check:
                content.check(number, positions[row], deviations[row], table.at(row))
            else:
                content.control(number, positions[row], np.nan_to_num(deviations[row]), table.at(row))


def _deviations(table: ColumnTable, columns: Sequence[str], common: str) -> Floats:
    """Return (rows, k) standard deviations; NaN without."""
    whole = table.numbers(common) if common in table else np.full(table.count, math.nan)
    flat = table.numbers("sxy") if "sxy" in table else whole
    defaults = (flat, flat, whole)
    own = [table.numbers(column) for column in columns]
    found = np.column_stack(
        [np.where(np.isnan(each), default, each) for each, default in zip(own, defaults, strict=False)]
    )
    if (found < 0).any():
        raise table.error(int(np.argwhere(found < 0)[0][0]), phrase("format.negative"))
    return found


def take_images(table: ColumnTable, content: DbatBuilder, sd: float = math.nan) -> None:
    """Add observations; `sd` is their default standard deviation, pixels."""
    table.require("id", "im", "x", "y")
    photos = _whole(table, "im")
    for row, number in enumerate(photos):
        content.check_photo(number, table.at(row))
    own = _deviations(table, ("sx", "sy"), "sxy")
    own = np.where(np.isnan(own), sd, own)
    for row in np.argwhere(own == 0)[:, 0].tolist():
        positive(table.at(row), "the standard deviation", 0)
    for image in zip(photos, _whole(table, "id"), table.given(("x", "y")), own, strict=True):
        content.pixel(*image)
