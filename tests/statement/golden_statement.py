"""The golden data of the accuracy statement."""

from functools import cache

import numpy as np

import golden_data
from golden_data import DATA

BLOCK = DATA / "statement" / "block"


@cache
def golden(name):
    """Return the content of a file of the golden data."""
    return golden_data.golden("statement", name)


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
    rows = [line.split(",") for line in (BLOCK / "control.csv").read_text(encoding="utf-8").split()[1:]]
    return {
        use: (
            [row[0] for row in rows if row[7] == use],
            np.array([row[1:4] for row in rows if row[7] == use], dtype=float),
            np.array([row[4:7] for row in rows if row[7] == use], dtype=float),
        )
        for use in ("control", "check")
    }


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
