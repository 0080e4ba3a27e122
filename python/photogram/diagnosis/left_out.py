"""What the adjustment of a check did without by itself, and what it holds that does not fit."""

from __future__ import annotations

from collections.abc import Collection

from photogram.diagnosis.findings import Finding, Level
from photogram.results.findings import HARMFUL
from photogram.results.held import HELD
from photogram.results.result import Result
from photogram.show.ways import findings_of
from photogram.statistics.evidence import WITHHELD, Evidence

__all__ = ["disagreeing", "held_values", "points_left_out"]


def points_left_out(result: Result, named: Collection[str]) -> list[Finding]:
    """Name points that the adjustment has left out because they spoil the others, unless they are named."""
    block = result.block
    found = []
    for point, reason in result.dropped.items():
        if reason not in HARMFUL or point in named:
            continue
        rows = block.image_points == block.point_ids.index(point)
        photos = [block.photo_ids[photo] for photo in block.image_photos[rows].tolist()]
        text = (
            f"point {point} is left out: {HARMFUL[reason]}; it is misidentified or misnamed on one of the"
            f" photos {', '.join(photos)}"
        )
        found.append(Finding("point-left-out", "grave", text, photos, [point]))
    return found


def held_values(result: Result) -> list[Finding]:
    """Name the held station or point that explains more of the residuals than any observation."""
    tests = [each for each in result.verdict.tests if each.statistic in "wtTF"]
    if not tests:
        return []
    least = min(tests, key=lambda each: each.log10_p)
    if least.accepted or not least.name.startswith(f"{HELD}: "):
        return []
    name, value = least.name.removeprefix(f"{HELD}: "), least.value
    words = name.split(", ")[0].split()
    photos, points = ([words[-1]], []) if "photo" in words else ([], [words[-1]])
    text = (
        f"{name}, does not fit: were it free, the sum of squares would fall by {value:.4g}, more than"
        " by any observation; give it a standard deviation"
    )
    return [Finding("held-value", "grave", text, photos, points, {"statistic": value})]


def disagreeing(result: Result) -> list[Finding]:
    """Name check points that disagree with the adjustment, as its verdict does, where nothing explains it."""
    evidence = Evidence(findings_of(result))
    levels: tuple[tuple[Level, float], ...] = (("grave", WITHHELD), ("look", evidence.found.level))
    for level, limit in levels:
        if said := evidence.disagreement(limit):
            return [Finding("check-points", level, f"check points disagree with the adjustment: {said}")]
    return []
