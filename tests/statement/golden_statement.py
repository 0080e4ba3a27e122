"""The golden data of the accuracy statement; tests that need them are skipped where they are absent."""

import json
from functools import cache

import numpy as np
import pytest

from shared_data import SHARED


@cache
def golden(name):
    """Return what a file of the golden data holds."""
    path = SHARED / "statement" / name
    if not path.exists():
        pytest.skip(f"{path} is not here")
    return json.loads(path.read_text(encoding="utf-8"))


def cofactors():
    """Return (90, 90) joint cofactors of the check points."""
    found = np.zeros((90, 90))
    adjusted = golden("statement.json")["adjustment"]
    found[np.tril_indices(90)] = adjusted["check_points_cofactors_lower_triangle"]
    return found + np.tril(found, -1).T


def differences():
    """Return (30, 3) adjusted minus given coordinates of the check points."""
    return np.array([row["difference"] for row in golden("statement.json")["statement_unity"]["points"]])


def control():
    """Return the rows of `control.csv` of the golden block by their use: names, coordinates, deviations."""
    path = SHARED / "statement" / "block" / "control.csv"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    rows = [line.split(",") for line in path.read_text(encoding="utf-8").split()[1:]]
    return {
        use: (
            [row[0] for row in rows if row[7] == use],
            np.array([row[1:4] for row in rows if row[7] == use], dtype=float),
            np.array([row[4:7] for row in rows if row[7] == use], dtype=float),
        )
        for use in ("control", "check")
    }
