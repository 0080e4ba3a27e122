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


def block_path():
    """Return where the golden block lies."""
    path = SHARED / "statement" / "block"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    return path


def compare(found, expected, path, tolerance):
    """Compare all that a golden member has, names and numbers, with what was found; probabilities to 1e-6."""
    if isinstance(expected, dict):
        for key, value in expected.items():
            compare(found[key], value, f"{path}.{key}", tolerance)
    elif isinstance(expected, list):
        assert len(found) == len(expected), path
        for k, (one, other) in enumerate(zip(found, expected, strict=True)):
            compare(one, other, f"{path}[{k}]", tolerance)
    elif isinstance(expected, float):
        if path.endswith((".p", ".p_high")):
            assert abs(found - expected) < 1e-6, path
        else:
            assert abs(found - expected) <= tolerance * abs(expected), (path, found, expected)
    else:
        assert found == expected, path
