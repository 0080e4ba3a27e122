"""Reports of large networks list what is least certain, and say where the rest is."""

import numpy as np
import pytest

from photogram import adjust, simulate
from photogram.collection import adjust as adjust_collection
from photogram.collection import simulate as simulate_collection
from photogram.results import observation_rows


@pytest.fixture(scope="module")
def result():
    return adjust(simulate(strips=3, photos_per_strip=5, seed=2).block)


def listed(report, title):
    """Return the lines of a section."""
    lines = report.split("\n")
    first = lines.index(title) + 2
    return lines[first : lines.index("", first)]


def test_a_report_lists_the_points_of_the_largest_standard_deviations(result, monkeypatch):
    whole = listed(result.report(), "Points")
    monkeypatch.setattr(observation_rows, "LISTED", 7)
    report = result.report()
    part = listed(report, "Points")
    count = int(result.used_points.sum())
    assert part[-1] == (
        f"and {count - 7} more, of smaller standard deviations; the JSON document and the tables have all"
    )
    size = np.linalg.norm(result.point_sd, axis=1)
    worst = np.sort(np.argsort(-size, kind="stable")[:7])
    names = [result.given.point_ids[row] for row in worst.tolist()]
    assert [line.split()[0] for line in part[:-1] if line[0].strip()][-7:] == names
    assert set(part[:-1]) <= set(whole)
    assert f"and {len(result.given.photo_ids) - 7} more" in listed(report, "Photos")[-1]


def test_a_report_of_a_collection_lists_the_photos_whose_translations_are_the_least_certain(monkeypatch):
    collection = simulate_collection(photos=12, points=60, seed=1).collection
    result = adjust_collection(collection)
    monkeypatch.setattr(observation_rows, "LISTED", 7)
    part = listed(result.report(), "Photos: values and standard deviations")
    assert part[-1].startswith("and 5 more, of smaller standard deviations")
    worst = np.sort(np.argsort(-np.linalg.norm(result.photo_sd[:, 3:6], axis=1))[:7])
    names = [line.split()[0] for line in part[:-1] if line.split()[0].isdigit()]
    assert names == [str(row) for row in worst.tolist()]
