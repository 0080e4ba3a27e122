"""What benches/minima.py calls a minimum is one: by its own equations, which are none of the package's."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from photogram import collection

minima = runpy.run_path(str(Path(__file__).parents[2] / "benches" / "minima.py"))


@pytest.fixture(scope="module")
def result():
    problem = collection.simulate(photos=6, points=60, seed=3).collection
    return collection.adjust(problem, tolerance=1e-15)


def test_an_adjusted_collection_is_a_minimum(result):
    found = minima["judged"](result.adjusted())
    assert found.proven
    assert found.cost == pytest.approx(result.cost, rel=1e-12)
    assert abs(found.gauge) < 1e-9 < found.least


def test_what_is_a_standard_deviation_from_it_is_none(result):
    minimum = result.adjusted()
    positions = minimum.point_positions.copy()
    positions[7, 2] += result.point_sd[7, 2]
    found = minima["judged"](minimum.replace(point_positions=positions))
    assert not found.proven
    rise = found.cost - result.cost
    assert found.left == pytest.approx(rise, rel=0.1), "what is left is what the cost has risen by"


def test_a_saddle_is_none(result):
    """Photos that all stand where one does see no depth: points' blocks are singular there."""
    minimum = result.adjusted()
    photos = minimum.photo_parameters.copy()
    photos[:, :6] = photos[0, :6]
    assert not minima["judged"](minimum.replace(photo_parameters=photos)).proven


def test_files_of_minima_keep_every_digit(result, tmp_path):
    path = tmp_path / "minimum.txt"
    path.write_bytes(collection.to_bytes(result.adjusted(), "bal"))
    cells, proven = minima["cells_of"]("minimum", collection.read(path))
    assert proven
    [sd] = np.unique(result.collection.image_sd)
    assert float(cells[4]) == pytest.approx(result.cost * sd**2, rel=1e-11), (
        "files have no standard deviations"
    )
    np.testing.assert_array_equal(collection.read(path).photo_parameters, result.photo_parameters)
