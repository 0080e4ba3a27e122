"""The golden data of absolute orientation, and stations made from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from photogram.absolute_orientation import Stations

DATA = Path(__file__).parents[3] / "shared" / "data" / "absolute_orientation"


def load(name: str) -> Any:
    """Read a file of the golden data; None where they are absent."""
    path = DATA / name
    return json.loads(path.read_text()) if path.is_file() else None


def cases(*names: str) -> list[Any]:
    """Return the cases, or those of some names, as parameters; one that is skipped where they are absent."""
    document = load("cases.json")
    if document is None:
        return [pytest.param(None, marks=pytest.mark.skip(reason=f"{DATA} is not there"))]
    chosen = [case for case in document["cases"] if not names or case["id"] in names]
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
