"""A corpus of damaged projects: each ends in a result, a warning or an error that says where."""

import re
from collections import Counter
from pathlib import Path

import pytest
from damage import DAMAGES, damaged
from typer.testing import CliRunner

from photogram import Spheroid, simulate
from photogram.cli import app
from photogram.giant import Common, Project
from photogram.giant.files import NAMES, to_bytes
from photogram.io.files import read_text
from photogram.io.writing import write_whole

PROJECTS = 600
RUNS = 5
ERROR_AT = re.compile(r"error: (?P<file>.+?)(, record (?P<record>\d+))?: ")
WRITTEN = {"RESTART", "report.txt"}
NOT_CONVERGED = "Not converged"


@pytest.fixture(scope="module")
def sound():
    """Return the files of three small projects that are in order."""
    size = {"strips": 2, "photos_per_strip": 3, "points_per_photo": 12, "check_points": 3}
    rectangular = simulate(**size, seed=1).block
    geographic = simulate(
        **size, spheroid=Spheroid.clarke_1866(), origin=(-1.6, 0.5, 10.0), photo_to_ground=True, seed=2
    ).block
    projects = [
        Project.from_block(rectangular),
        Project.from_block(geographic),
        Project.from_block(rectangular, Common(intersection_only=True, unit_variance="constrained")),
    ]
    return [{name: to_bytes(lines) for name, lines in project.records().items()} for project in projects]


@pytest.mark.parametrize("run", range(RUNS))
def test_damaged_projects_end_in_good_order(run, sound, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "500")
    monkeypatch.setenv("NO_COLOR", "1")
    counts = Counter()
    for seed in range(run, PROJECTS, RUNS):
        files, kinds = damaged(sound[seed % len(sound)], seed)
        place = tmp_path / str(seed)
        (place / "in").mkdir(parents=True)
        write_whole({place / "in" / name: content for name, content in files.items() if content is not None})
        # Pictures take longer than all else.
        options = [*(["--as-published"] if seed % 2 else []), *(["--no-html"] if seed % 25 else [])]
        arguments = ["giant", str(place / "in"), "--out", str(place / "out"), "--threads", "1", *options]
        result = CliRunner().invoke(app, arguments)
        told = f"seed {seed}, {', '.join(kinds)}: {result.output}"
        assert result.exception is None or isinstance(result.exception, SystemExit), (told, result.exc_info)
        counts[outcome(result, place, told)] += 1
    print(dict(counts))
    assert counts["error at a record"] > 10
    assert counts["converged"] > 10


def outcome(result, place, told):
    """Check what a run left behind and said; return how it ended."""
    left = {path.name for path in (place / "out").iterdir()} if (place / "out").exists() else None
    if left is not None:
        left.discard("report.html")
    assert "Traceback" not in result.output, told
    assert {path.name for path in place.iterdir()} <= {"in", "out"}, told
    if "error: " not in result.stderr:
        assert result.exit_code in (0, 3, 4), told
        # Unknowns that are hardly determined end with 3, too, though the adjustment has converged.
        converged = NOT_CONVERGED not in result.output
        assert converged or result.exit_code == 3, told
        assert left is not None, told
        assert left >= WRITTEN or "RESTART is not written" in result.output, told
        assert left <= (WRITTEN | {"FRAMES", "GROUND"} if converged else WRITTEN), told
        return "converged" if converged else "not converged"
    assert left is None, told
    if result.exit_code == 3:
        return "adjustment refused"
    assert result.exit_code == 1, told
    assert str(place / "in") in result.stderr or "cannot be written" in result.stderr, told
    at = ERROR_AT.search(result.stderr)
    if at is None or at["record"] is None:
        return "error of a file"
    assert f"|{record_text(Path(at['file']), int(at['record']))}|" in result.stderr, told
    return "error at a record"


def record_text(path, number):
    """Return a record as an error shows it."""
    text = read_text(path)
    record = text.removesuffix("\x1a").split("\n")[number - 1][:80]
    return "".join(character if character.isprintable() else "\ufffd" for character in record)


def test_every_kind_of_damage_stands_in_the_corpus(sound):
    seen = Counter(kind for seed in range(PROJECTS) for kind in damaged(sound[0], seed)[1])
    assert PROJECTS >= 500
    assert set(seen) == set(DAMAGES)
    assert min(seen.values()) >= 15
    assert set(NAMES) == set(sound[0])


def test_the_corpus_is_the_same_every_time(sound):
    assert all(damaged(sound[0], seed) == damaged(sound[0], seed) for seed in range(0, PROJECTS, 37))
