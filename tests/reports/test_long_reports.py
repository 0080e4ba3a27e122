"""Reports of large networks list what is least certain, and say where the rest is."""

import numpy as np
import pytest

from photogram import adjust, simulate
from photogram.collection import adjust as adjust_collection
from photogram.collection import simulate as simulate_collection
from photogram.results import network_sections


@pytest.fixture(scope="module")
def result():
    return adjust(simulate(strips=3, photos_per_strip=5, seed=2).block)


def test_the_points_of_the_largest_standard_deviations_are_listed(result, monkeypatch):
    monkeypatch.setattr(network_sections, "ALL", 7)
    monkeypatch.setattr(network_sections, "SOME", 7)
    table = result.document().table("points")
    names = table.columns[0].values
    size = np.linalg.norm(result.point_sd[result.used_points], axis=1)
    assert set(np.argsort(-size, kind="stable")[:7]) <= set(table.shown.tolist())
    assert len(table.shown) < len(table.frame()) == len(names)
    assert table.note.startswith(f"{len(table.shown)} of {len(names)}: ")


def test_the_photos_of_a_collection_with_the_largest_residuals_are_listed(monkeypatch):
    collection = simulate_collection(photos=12, points=60, seed=1).collection
    result = adjust_collection(collection)
    monkeypatch.setattr(network_sections, "ALL", 7)
    table = result.document().table("photos-fit")
    (largest,) = (column for column in table.columns if column.head.startswith("Largest residual"))
    assert int(np.nanargmax(largest.values)) in table.shown
    assert table.note.startswith(f"{len(table.shown)} of 12: ")
