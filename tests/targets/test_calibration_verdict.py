"""The verdict on a calibration speaks of a board: where it was, how tilted, what other views say."""

import json

import numpy as np
import pytest
from seen_boards import seen

from photogram import Camera
from photogram.targets import Board, Calibration, WorthOptions, appraise
from photogram.targets.findings import showings

BOARD = Board(columns=9, rows=7, spacing=0.03, shape="held")
TRUTH = Camera(
    "opencv",
    {"fx": 900.0, "fy": 900.0, "cx": 511.5, "cy": 383.5, "k1": -0.2, "k2": 0.1, "p1": 0.0, "p2": 0.0},
)
SIZE = (1024, 768)


def calibrated(keep=lambda corners, poses: np.ones(len(poses), dtype=bool), camera=TRUTH, sd=0.2, **how):
    """Return a calibration of the views that are kept."""
    corners, poses = seen(BOARD, TRUTH, SIZE, views=14, seed=3, sd=sd)
    own = keep(corners, poses)
    free = camera.replace(sd=np.inf)
    found = Calibration(
        board=BOARD, corners=corners.of_pictures(own), cameras=[free], poses=poses[own], sd0=sd, **how
    )
    return found.adjust()


def test_the_verdict_says_how_the_board_was_shown():
    found = calibrated()
    (shown,) = showings(found)
    normals = np.abs(found.poses[:, 2, 2])
    assert shown.tilts.max() == pytest.approx(np.degrees(np.arccos(normals.min())))
    assert len(shown.distances) == 14
    assert found.verdict.code == "accepted"
    (line,) = (each for each in found.verdict.lines if each.code == "line.board")
    assert (line.fields["camera"], line.fields["n"]) == ("camera", 14)
    assert (line.fields["flat"], line.fields["steep"]) == (shown.tilts.min(), shown.tilts.max())
    parts = line.fields["corners"].fields
    assert (parts["reached"], parts["all"]) == (20 - len(shown.empty), 20)


def test_parts_without_corners_are_named_and_asked_for():
    corners, _ = seen(BOARD, TRUTH, SIZE, views=14, seed=3)
    right = np.array([corners.xy[corners.picture == k, 0].min() > SIZE[0] / 5 for k in range(14)])
    assert 3 < right.sum() < 14
    found = calibrated(lambda *_: right)
    (shown,) = showings(found)
    assert {"upper left corner", "left edge above the middle", "lower left corner"} <= set(shown.empty)
    (step,) = (each for each in found.verdict.next if each.code == "advice.board-parts")
    assert step.fields["parts"] == list(shown.empty)


def test_views_from_the_front_alone_are_not_enough():
    def upright(_, poses):
        return np.degrees(np.arccos(np.abs(poses[:, 2, 2]))) < 16

    found = calibrated(upright)
    (shown,) = showings(found)
    assert len(shown.tilts) >= 3
    assert np.count_nonzero(shown.tilts >= 15) < 3
    assert "advice.tilt" in steps(found)
    assert "advice.tilt" not in steps(calibrated())


def steps(found):
    """Return the codes of the next steps."""
    return {each.code for each in found.verdict.next}


def test_check_points_are_no_word_of_calibrations():
    found = calibrated()
    assert not steps(found) & {"advice.check-points", "advice.two-rays"}


def test_other_views_judge_and_all_say_the_same():
    found = calibrated()
    whole = found.with_worth(appraise(found, WorthOptions(grid=(6, 4))))
    assert any("cross-validation explained" in str(each) for each in whole.verdict.lines)
    assert whole.verdict.headline.encode() in whole.to_html()
    assert json.loads(whole.to_json())["verdict"]["headline"] == whole.verdict.headline
    assert whole.document().judgements[0].headline == whole.verdict.headline
    # What was there before has not changed.
    assert not any("cross-validation" in str(each) for each in found.verdict.lines)


def test_a_lens_that_is_too_stiff_is_named():
    plain = Camera("opencv", TRUTH.parameters | {"k1": 0.0, "k2": 0.0})
    held = plain.replace(sd={"fx": np.inf, "fy": np.inf, "cx": np.inf, "cy": np.inf})
    corners, poses = seen(BOARD, TRUTH, SIZE, views=14, seed=3, sd=0.2)
    found = Calibration(board=BOARD, corners=corners, cameras=[held], poses=poses, sd0=0.2).adjust()
    whole = found.with_worth(appraise(found, WorthOptions(grid=(6, 4))))
    assert not whole.verdict.usable
    assert "opencv8" in models_of(whole)
    assert any(each.name == "cross-validation of camera" for each in whole.verdict.tests)
    # A fixed term of distortion is the cause.
    assert whole.verdict.code == "common-error"
    assert "fixed k1 of camera" in str(whole.verdict.headline)


def test_what_to_try_is_freer_than_what_was_tried():
    stiff = Camera("simple_radial", {"f": 900.0, "cx": 511.5, "cy": 383.5, "k": -0.2})
    assert models_of(calibrated(camera=stiff)) == ["opencv8", "opencv12", "splined_stereographic"]
    assert "advice.try" not in steps(calibrated())


def models_of(found):
    """Return the lenses that the verdict advises to try, before a board with more freedom."""
    (step,) = (each for each in found.verdict.next if each.code == "advice.try")
    lenses, board = step.fields["ways"]
    assert board.code == "part.free-board"
    return lenses.fields["models"]


def test_snooping_has_the_same_words():
    corners, poses = seen(BOARD, TRUTH, SIZE, views=8, seed=3, sd=0.2)
    xy = corners.xy.copy()
    xy[40] += [9.0, -6.0]
    start = Calibration(
        board=BOARD, corners=corners.replace(xy=xy), cameras=[TRUTH.replace(sd=np.inf)], poses=poses, sd0=0.2
    )
    found = start.snoop()
    assert found.verdict.code == "usable-after-removal"
    assert ("line.board", 8) in {(each.code, each.fields.get("n")) for each in found.verdict.lines}
    assert found.verdict == found.result.verdict
    assert start.replace(sd0=None).snoop().result.known_weight  # the tests of data snooping assume it
