"""What further views add to a calibration, against an independent program and against adjusting with them."""

from itertools import pairwise

import numpy as np
import pytest
from given_targets import golden
from golden_calibrations import rig_small

from photogram.lazy_dataclasses import replace
from photogram.targets import Candidate
from photogram.targets.housing import common_partials, datum_rows, worst
from photogram.targets.new_views import added_by, best_views, placed_cofactors
from photogram.targets.vision import composed

SIZES = np.array([[1280, 960]] * 2)
SD = 0.3


@pytest.fixture(scope="module")
def functions():
    pixels = np.array(golden("rig_small")["uncertainty"]["pixels"])
    return common_partials(rig_small(), 0, pixels, np.inf, datum_rows(rig_small(), 0, "corners"))


def test_before(functions):
    common = rig_small().cofactors[: rig_small().common, : rig_small().common]
    before = worst(functions @ common @ functions.transpose(0, 2, 1))
    assert before == pytest.approx(golden("rig_small")["new_views"]["before"]["worst_sd"], rel=1e-6)


@pytest.mark.parametrize("number", range(6))
def test_a_view_alone(functions, number):
    each = golden("rig_small")["new_views"]["candidates"][number]
    (found,) = best_views(
        rig_small(), functions, [Candidate(each["name"], composed(each["R"], each["t"]))], SIZES, SD, 1
    )
    assert found.corners.tolist() == each["corners"]
    assert found.sd == pytest.approx(each["worst_sd_after"], rel=1e-6)
    assert (found.largest, found.rms) == pytest.approx((each["largest"], each["rms"]), rel=1e-6)


def test_the_best_view_is_first_and_the_next_counts_on_it(functions):
    data = golden("rig_small")["new_views"]["candidates"]
    candidates = [Candidate(each["name"], composed(each["R"], each["t"])) for each in data]
    found = best_views(rig_small(), functions, candidates, SIZES, SD, 6)
    assert found[0].candidate.name == min(data, key=lambda each: each["largest"])["name"]
    assert len({each.candidate.name for each in found}) == 6
    assert all((later.sd <= earlier.sd + 1e-12).all() for earlier, later in pairwise(found))


def test_a_view_of_a_fixed_board_adds_to_the_cameras_alone():
    whole = rig_small()
    count = whole.board.start
    kept = np.r_[:count, whole.common : len(whole.cofactors)]
    fixed = replace(
        whole,
        cofactors=whole.cofactors[np.ix_(kept, kept)],
        points_by_board=whole.points_by_board[:, :, :0],
        weights=whole.weights[:count, :count],
    )
    each = golden("rig_small")["new_views"]["candidates"][0]
    added = added_by(fixed, composed(each["R"], each["t"]), SIZES, SD)
    own = fixed.cofactors[:count, :count]
    cofactors = placed_cofactors(fixed)
    assert cofactors.shape == (count + 3, count + 3)
    rows, pose = np.zeros((len(added.by_pose), count)), added.by_pose
    rows[:, added.touched] = added.by_cameras
    across = pose.T @ rows
    more = rows.T @ rows - across.T @ np.linalg.solve(pose.T @ pose, across)
    expected = own - np.linalg.inv(np.linalg.inv(own) + more)
    gain = added.gain(cofactors, slice(None))[:count, :count]
    np.testing.assert_allclose(gain, expected, rtol=0, atol=1e-6 * np.abs(expected).max())
