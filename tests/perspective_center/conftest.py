"""Golden data of program W5344, and a small deck of our own."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from photogram.network import rotation_matrix
from photogram.perspective_center import Grid

DATA = Path(__file__).parents[1] / "data" / "perspective_center"


@pytest.fixture(scope="session")
def golden() -> Path:
    """Directory of the golden data."""
    return DATA


@pytest.fixture(scope="session")
def expected(golden: Path) -> Callable[[str], Any]:
    """Return a function that loads an expected result by name."""
    return lambda name: json.loads((golden / "expected" / f"{name}.json").read_text())


def project_grid(
    plate: np.ndarray,
    heights: np.ndarray,
    position: np.ndarray,
    minutes: np.ndarray,
    principal_distance: float,
) -> np.ndarray:
    """Model coordinates (n, 3) of plate points at given heights."""
    to_photo = rotation_matrix(np.radians(minutes / 60.0)[np.newaxis])[0]
    direction = np.column_stack([plate, np.full(len(plate), -principal_distance)]) @ to_photo
    reach = (heights - position[2]) / direction[:, 2]
    return position + reach[:, np.newaxis] * direction


@pytest.fixture
def make_grid() -> Callable[..., Grid]:
    """Return a function that makes a grid with errors in the model, of any kappa and heights."""

    def make(
        *,
        across: int = 5,
        sd: float = 0.0,
        seed: int = 0,
        kappa: float = 20.0,
        relief: float = 0.0,
        weights: np.ndarray | None = None,
        initial: np.ndarray | None = None,
    ) -> Grid:
        axis = np.linspace(-80.0, 80.0, across)
        plate = np.array([(x, y) for y in axis for x in axis])
        random = np.random.default_rng(seed)
        heights = relief * random.uniform(-1.0, 1.0, len(plate))
        model = project_grid(
            plate, heights, np.array([250.4, 249.7, 310.25]), np.array([12.0, -7.0, kappa]), 150.0
        )
        scale = sd if weights is None else sd / np.sqrt(weights)[:, np.newaxis]
        model[:, :2] += scale * random.normal(size=(len(plate), 2))
        return Grid(list(range(1, len(plate) + 1)), plate, model, 150.0, initial=initial)

    return make
