"""The golden data of absolute orientation, and stations made from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from photogram.absolute_orientation import Stations

DATA = Path(__file__).parents[1] / "data" / "absolute_orientation"


def load(name: str) -> Any:
    """Read a file of the golden data."""
    return json.loads((DATA / name).read_text())


def cases(*names: str) -> list[Any]:
    """Return the cases, or those of some names, as parameters."""
    chosen = [case for case in load("cases.json")["cases"] if not names or case["id"] in names]
    return [pytest.param(case, id=case["id"]) for case in chosen]


def stations(rows: list[dict[str, Any]]) -> Stations:
    """Make stations from those of a case."""
    control = [[np.nan if value is None else value for value in row["control"]] for row in rows]
    return Stations([row["id"] for row in rows], control, [row["model"] for row in rows])


def array(values: Any) -> np.ndarray:
    """Make an array; null is NaN."""
    return np.array(values, dtype=np.float64)


def csv_of(rows: list[dict[str, Any]]) -> str:
    """Write the stations of a case as CSV, to the last digit."""
    lines = ["id,X,Y,Z,x,y,z"]
    for row in rows:
        control = ["" if value is None else repr(value) for value in row["control"]]
        lines.append(",".join([str(row["id"]), *control, *map(repr, row["model"])]))
    return "\n".join(lines) + "\n"


def cards_of(rows: list[dict[str, Any]], *, zeros: bool = False) -> str:
    """Write the stations of a case as the cards of part I, without approximations."""
    missing = "0" if zeros else "-"
    pairs = sum(row["control"][0] is not None for row in rows)
    elevations = sum(row["control"][2] is not None for row in rows)
    lines = ["0 0 0 0 0 0 0 7", f"{len(rows)} {elevations} {pairs} 7"]
    for row in rows:
        control = [missing if value is None else repr(value) for value in row["control"]]
        lines.append(" ".join([*control, *map(repr, row["model"]), str(row["id"])]))
    return "\n".join(lines) + "\n"
