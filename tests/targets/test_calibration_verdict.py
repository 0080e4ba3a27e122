"""The verdict on a calibration speaks of a board: where it was, how tilted, what other views say."""

import numpy as np
import pytest
from seen_boards import seen

from photogram import Camera
from photogram.targets import Board, Calibration, WorthOptions, appraise
from photogram.targets.document import calibration_document
from photogram.targets.findings import judged, showings

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
    line = next(each for each in found.verdict.lines if each.startswith("camera: 14 views"))
    assert f"tilted by {shown.tilts.min():.0f} to {shown.tilts.max():.0f} degrees" in line
    assert f"corners in {20 - len(shown.empty)} of 20 parts of the picture" in line


def test_parts_without_corners_are_named_and_asked_for():
    corners, _ = seen(BOARD, TRUTH, SIZE, views=14, seed=3)
    right = np.array([corners.xy[corners.picture == k, 0].min() > SIZE[0] / 5 for k in range(14)])
    assert 3 < right.sum() < 14
    found = calibrated(lambda *_: right)
    (shown,) = showings(found)
    assert {"upper left corner", "left edge above the middle", "lower left corner"} <= set(shown.empty)
    assert any("show the board here: upper left corner" in each for each in found.verdict.next)


def test_views_from_the_front_alone_are_not_enough():
    def upright(_, poses):
        return np.degrees(np.arccos(np.abs(poses[:, 2, 2]))) < 16

    found = calibrated(upright)
    (shown,) = showings(found)
    assert len(shown.tilts) >= 3
    assert np.count_nonzero(shown.tilts >= 15) < 3
    assert any(each.startswith("Tilt the board") for each in found.verdict.next)
    assert not any(each.startswith("Tilt the board") for each in calibrated().verdict.next)


def test_check_points_are_no_word_of_calibrations():
    found = calibrated()
    assert not any("check points" in each or "two rays" in each for each in found.verdict.next)


def test_other_views_judge_and_all_say_the_same():
    found = calibrated()
    whole = judged(found, appraise(found, WorthOptions(grid=(6, 4))))
    assert any("cross-validation explained" in each for each in whole.verdict.lines)
    assert whole.result.verdict == whole.verdict
    assert whole.verdict.headline.encode() in whole.to_html()
    assert calibration_document(whole)["verdict"] == whole.verdict.document()
    assert whole.verdict.headline in whole.report()
    # What was there before has not changed.
    assert not any("cross-validation" in each for each in found.verdict.lines)


def test_a_lens_that_is_too_stiff_is_named():
    plain = Camera("opencv", TRUTH.parameters | {"k1": 0.0, "k2": 0.0})
    held = plain.replace(sd={"fx": np.inf, "fy": np.inf, "cx": np.inf, "cy": np.inf})
    corners, poses = seen(BOARD, TRUTH, SIZE, views=14, seed=3, sd=0.2)
    found = Calibration(board=BOARD, corners=corners, cameras=[held], poses=poses, sd0=0.2).adjust()
    whole = judged(found, appraise(found, WorthOptions(grid=(6, 4))))
    assert not whole.verdict.usable
    assert any("--model opencv8" in each for each in whole.verdict.next)
    assert any(each.name == "cross-validation of camera" for each in whole.verdict.tests)
    assert any(
        "maps are too small by about" in each for each in (whole.verdict.headline, *whole.verdict.lines)
    )


def test_what_to_try_is_freer_than_what_was_tried():
    stiff = Camera("simple_radial", {"f": 900.0, "cx": 511.5, "cy": 383.5, "k": -0.2})
    (told,) = [line for line in calibrated(camera=stiff).verdict.next if line.startswith("Try ")]
    assert "`--model opencv8`, `opencv12` or `splined_stereographic`, or a board" in told
    assert not [line for line in calibrated().verdict.next if line.startswith("Try ")]


def test_snooping_has_the_same_words():
    corners, poses = seen(BOARD, TRUTH, SIZE, views=8, seed=3, sd=0.2)
    xy = corners.xy.copy()
    xy[40] += [9.0, -6.0]
    start = Calibration(
        board=BOARD, corners=corners.replace(xy=xy), cameras=[TRUTH.replace(sd=np.inf)], poses=poses, sd0=0.2
    )
    found = start.snoop()
    assert found.verdict.code == "usable-after-removal"
    assert any(each.startswith("camera: 8 views") for each in found.verdict.lines)
    assert found.snooped.verdict == found.verdict == found.snooped.result.verdict
