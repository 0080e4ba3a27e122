"""Measures that are rejected by the rule of jigsaw."""

from dataclasses import replace

import numpy as np
import pytest
import support_data
from test_frames import moved, network
from typer.testing import CliRunner

from message_codes import fields_of
from photogram import adjust, formats
from photogram.cli import app
from photogram.formats import ReadOptions
from photogram.formats.csm import SupportedImage, read_support
from photogram.formats.isis import network_text, read_network
from photogram.formats.isis.outcome import flagged, rejection_limit

WORDS = "CAMSOLVE=angles OVEREXISTING=yes CAMERA_ANGLES_SIGMA=1 OUTLIER_REJECTION=yes"
BAD = (4, 31)
"""Measures, of two points."""


def test_the_limit_is_the_median_and_some_deviations():
    lengths = np.array([1.0, 2.0, 3.0, 4.0, 100.0, np.nan])
    assert rejection_limit(lengths, 3.0) == pytest.approx(3.0 + 3.0 * 1.4826 * 1.0)


@pytest.mark.parametrize(
    ("lengths", "out", "found"),
    [
        # The longest of a point, and no other.
        ([9.0, 8.0, 1.0, 1.0], "", "0"),
        # Two measures stay.
        ([9.0, 8.0], "", ""),
        ([9.0, 8.0, 1.0], "0", "0"),
        ([9.0, 8.0, 1.0, 1.0], "0", "01"),
        # What has become short comes back, and counts among those that stay.
        ([2.0, 9.0, 1.0], "0", "1"),
        ([2.0, 9.0, 1.0], "01", "1"),
        # What took no part counts for nothing.
        ([9.0, np.nan, 1.0], "", ""),
    ],
)
def test_what_is_rejected_of_a_point(lengths, out, found):
    before = np.array([str(k) in out for k in range(len(lengths))])
    now = flagged(np.array(lengths), before, np.zeros(len(lengths), dtype=np.int64), 5.0)
    assert "".join(map(str, np.flatnonzero(now))) == found
    # Beside it another point, on which it has no bearing.
    beside = np.append(np.zeros(len(lengths), dtype=np.int64), [1, 1, 1])
    more = flagged(np.append(lengths, [1.0, 1.0, 7.0]), np.append(before, [False] * 3), beside, 5.0)
    assert now.tolist() == more[: len(now)].tolist()
    assert more[len(now) :].tolist() == [False, False, True]


@pytest.fixture
def three(tmp_path):
    """Return a folder with a network of three images, two measures of which are wrong by some pixels."""
    documents = [moved(support_data.document("FRAME"), kilometres) for kilometres in (0.0, 0.3, 0.6)]
    paths = [support_data.written(tmp_path, each, f"{k}.json") for k, each in enumerate(documents)]
    images = [
        SupportedImage(read_support(path), f"image {k}", "isis", "isis") for k, path in enumerate(paths)
    ]
    lines, samples = (each.ravel() for each in np.mgrid[120:300:5j, 60:221:5j])
    path = network(tmp_path, images, images[1].to_ground(lines, samples, 50.0))
    own = read_network(path)
    random = np.random.default_rng(8)
    line = own.measures.line + random.normal(0.0, 0.3, len(own.measures))
    sample = own.measures.sample + random.normal(0.0, 0.3, len(own.measures))
    line[list(BAD)] += 12.0
    path.write_bytes(network_text(replace(own, measures=replace(own.measures, line=line, sample=sample))))
    (tmp_path / "images.lis").write_text("".join(f"image {k}, {k}.json\n" for k in range(3)))
    return tmp_path


def test_wrong_measures_are_rejected(three):
    project = formats.read(three / "own.net", ReadOptions(cubes=three / "images.lis", jigsaw=WORDS))
    assert any(each.code == "error.at" or each.code == "isis.rejection" for each in project.messages)
    own = read_network(three / "own.net")
    assert np.bincount(own.point_of_measure).min() == 3
    before = adjust(project.block)
    result = formats.adjusting(project, adjust)(project.block)
    counts = fields_of(result.messages, "isis.rejected")
    assert (counts["n"], counts["total"]) == (len(BAD), len(own.measures))
    assert result.degrees_of_freedom == before.degrees_of_freedom - 2 * len(BAD)
    kept = {(photo, point) for photo, point in zip(*_names(result.block), strict=True)}
    gone = [each for each in zip(*_names(before.block), strict=True) if each not in kept]
    serials = [own.measures.serials[k] for k in own.measures.serial[list(BAD)]]
    points = [own.points.ids[k] for k in own.point_of_measure[list(BAD)]]
    assert sorted(gone) == sorted(zip(serials, points, strict=True))
    # As without them from the first.
    assert result.sums_of_squares.total < 0.2 * before.sums_of_squares.total


def _names(block):
    return [block.photo_ids[k] for k in block.image_photos], [block.point_ids[k] for k in block.image_points]


def test_a_multiplier_that_rejects_nothing_changes_nothing(three):
    words = f"{WORDS} REJECTION_MULTIPLIER=1e6"
    project = formats.read(three / "own.net", ReadOptions(cubes=three / "images.lis", jigsaw=words))
    result = formats.adjusting(project, adjust)(project.block)
    np.testing.assert_array_equal(result.residuals, adjust(project.block).residuals)
    assert fields_of(result.messages, "isis.rejected")["n"] == 0


def test_the_command_rejects_and_says_so(three):
    where = ("adjust", three / "own.net", "--cubes", three / "images.lis", "--jigsaw", WORDS)
    done = CliRunner().invoke(app, [*map(str, where), "--out", str(three / "out")])
    assert done.exit_code in (0, 3), done.output
    assert "OUTLIER_REJECTION: 2 of" in (three / "out" / "report.txt").read_text()
    rows = (three / "out" / "adjusted-isis" / "residuals.csv").read_text().splitlines()
    assert sum(row.endswith("*") for row in rows) == len(BAD)
    assert "REJECTION_MULTIPLIER: 3.0" in (three / "out" / "adjusted-isis" / "bundleout.txt").read_text()
    done = CliRunner().invoke(app, [*map(str, where), "--out", str(three / "other"), "--snoop"])
    assert done.exit_code in (0, 3, 4), done.output
    report = (three / "other" / "report.txt").read_text()
    assert "OUTLIER_REJECTION: 2 measures of" not in report
    assert "OUTLIER_REJECTION=yes is ignored" in report
