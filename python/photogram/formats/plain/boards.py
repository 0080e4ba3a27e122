"""The table of boards: geometry of the calibration targets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from photogram.formats.plain.schema import BENDS, PITCHES, deviation_columns
from photogram.formats.plain.tables import Tables, columns_of, columns_of_records, made
from photogram.io.column_table import ColumnTable
from photogram.network.block import Block
from photogram.network.passages import Bend, Figure
from photogram.targets.board import Board
from photogram.words import phrase

ASSUMED = "sd of corners assumed"
"""Key of a detail: default standard deviations of corners; levels are ratios."""
REGULARISED = "regularise"  # Detail and column of the weak camera priors of a calibration
TIMES = "times of photos on frames"
"""Key of a detail: clock times in seconds, by names of board photos."""


def read_boards(tables: Tables) -> dict[str, Board]:
    """Read boards of columns and rows; others use control points."""
    table = tables.rows("boards")
    if table.count > 1:
        raise table.error(1, phrase("plain.several-boards", count=table.count))
    return {name: _board(table, row, tables) for row, name in enumerate(table.names_once("board"))}


def _board(table: ColumnTable, row: int, tables: Tables) -> Board:
    cells = tables.records("boards")[row]
    given: dict[str, Any] = {name: cells[name] for name in ("kind", "shape") if name in cells}
    given["unit"] = tables.settings.length
    if given.get("kind") == "points":
        # Their positions are control points, which are read later.
        given["points"] = np.zeros((0, 3))
        return Board(**given)
    given |= {name: int(cells.get(name, 0)) for name in ("columns", "rows")}
    given |= {name: cells[name] for name in PITCHES[2:] if name in cells}
    if "tag_size" not in given:
        given["spacing"] = tuple(cells.get(name, np.nan) for name in PITCHES[:2])
    return made(table, row, Board, **given)


def read_regularised(tables: Tables) -> str | None:
    """Return the source of weak camera priors; None without."""
    return next((cells.get(REGULARISED) for cells in tables.records("boards")), None)


def read_bends(tables: Tables, boards: Mapping[str, Board]) -> list[Figure]:
    """Return the deflection of boards with free deflection."""
    table = tables.rows("boards")
    if all(each.shape != "bend" for each in boards.values()):
        return []
    values = np.nan_to_num(table.vectors(BENDS))
    sd = table.vectors(deviation_columns(BENDS), np.inf, infinite=True)
    return [
        Figure(Bend(name, values[row], sd[row]), own.names, own.shifts())
        for row, (name, own) in enumerate(boards.items())
        if own.shape == "bend"
    ]


def boards_table(boards: Mapping[str, Board], block: Block, regularise: str | None) -> dict[str, Any]:
    """Return columns of boards, deflections and camera priors."""
    bends = {own.bend.name: own.bend for own in block.passages if isinstance(own, Figure)}
    rows = []
    for name, own in boards.items():
        cells: dict[str, Any] = {"board": name, "kind": own.kind}
        if own.kind != "points":
            cells |= {"columns": own.columns, "rows": own.rows}
            cells |= {} if own.tag_size else columns_of(PITCHES[:2], np.array(own.pitch))
        cells |= {"tag_size": own.tag_size, "tag_spacing": own.tag_spacing, "shape": own.shape}
        cells[REGULARISED] = regularise
        if name in bends:
            cells |= columns_of(BENDS, bends[name].position[:2])
            cells |= columns_of(deviation_columns(BENDS), bends[name].deviations[:2])
        rows.append(cells)
    return columns_of_records(rows)


def levels(image_sd: np.ndarray, *, assumed: bool) -> np.ndarray | None:
    """Return (m,) levels l of standard deviations 2^l; None if given."""
    if not assumed:
        return None
    found = np.log2(image_sd[:, 0])
    whole = np.round(found)
    return whole if np.array_equal(2.0**whole, image_sd[:, 0]) else None
