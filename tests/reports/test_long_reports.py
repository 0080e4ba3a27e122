"""Reports of large networks list what is least certain, and say where the rest is."""

import numpy as np
import pytest

from photogram import adjust, simulate
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
