"""From corners alone to adjusted calibrations: golden figures, without any start value."""

import numpy as np
import pytest
from given_targets import golden
from golden_boards import left, rig, wide
from relisted import relisted

from photogram.targets import Calibration, first_values


def calibration(board, first, **others):
    return Calibration(
        board=board,
        corners=first.corners,
        cameras=first.cameras,
        poses=first.poses,
        sensors=first.sensors,
        **others,
    )


def adjusted_left(corners):
    board, _ = left()
    return calibration(board.replace(shape="held"), first_values(board, corners, "opencv5")).adjust()


def cost(found):
    return found.sum_and_freedom[0]


def test_the_left_pictures_end_where_they_should():
    known = golden("opencv_left")["left"]["solution"]
    found = adjusted_left(left()[1])
    assert found.converged
    assert cost(found) == pytest.approx(known["cost"], rel=1e-9)
    values = [found.cameras[0].camera.parameters[name] for name in known["order"].split()]
    np.testing.assert_allclose((np.array(values) - known["parameters"]) / known["sd"], 0, atol=1e-4)


@pytest.mark.parametrize(
    "orders", [{0: 3, 4: 3}, {1: 5, 2: 6, 7: 5}, dict.fromkeys(range(13), 6), {3: 1, 5: 2}]
)
def test_the_left_pictures_end_there_wherever_their_corners_begin(orders):
    board, corners = left()
    found = adjusted_left(relisted(board, corners, orders))
    known = golden("opencv_left")["left"]["solution"]
    assert cost(found) == pytest.approx(known["cost"], rel=1e-9)


def test_the_left_pictures_need_no_size():
    board, corners = left()
    first = first_values(board, corners.replace(sizes=[None]), "opencv5")
    assert first.remarks[0].code == "targets.assumed-size"
    found = calibration(board.replace(shape="held"), first).adjust()
    assert cost(found) == pytest.approx(golden("opencv_left")["left"]["solution"]["cost"], rel=1e-9)


def adjusted_rig(corners):
    board, _ = rig()
    first = first_values(board, corners, "opencv4")
    weighted = board.replace(shape="points", sd_spacing=5e-5, sd_plane=2e-4)
    return first, calibration(weighted, first, sd0=0.3).adjust()


def test_the_rig_ends_where_it_should():
    known = golden("rig_small")["points"]
    first, found = adjusted_rig(rig()[1])
    assert cost(found) == pytest.approx(known["cost"], rel=1e-9)
    np.testing.assert_allclose(first.sensors[1, :3, :3], known["sensor1"]["R"], atol=5e-3)
    np.testing.assert_allclose(first.sensors[1, :3, 3], known["sensor1"]["t"], atol=3e-3)
    assert first.references.tolist() == [0, 0]


def test_the_rig_ends_there_wherever_corners_of_its_second_camera_begin():
    """Turned by half, a board fits as well: only the rig shows it."""
    board, corners = rig()
    second = np.flatnonzero(corners.cameras == 1)[[0, 3, 11]].tolist()
    first, found = adjusted_rig(relisted(board, corners, dict.fromkeys(second, 3) | {13: 5, 20: 1}))
    assert cost(found) == pytest.approx(golden("rig_small")["points"]["cost"], rel=1e-9)
    said = [str(each) for each in first.remarks if "begin at another corner" in str(each)]
    assert {corners.pictures[row] for row in second} <= {each.split()[1].rstrip(":") for each in said}


def test_the_rig_converges_where_boards_of_both_cameras_are_turned():
    """Nothing but the shape of the board could tell how these were turned."""
    board, corners = rig()
    first, found = adjusted_rig(relisted(board, corners, dict.fromkeys(np.flatnonzero(corners.views < 4), 3)))
    assert found.converged
    assert np.isfinite(first.poses).all()


def test_a_lens_of_150_degrees_ends_where_it_should():
    known = golden("mrcal_opencv8")["without_regularisation"]
    board, corners = wide()
    first = first_values(board, corners)
    held = board.replace(shape="held")
    found = calibration(held, first, bend=tuple(known["board_bend"])).adjust()
    assert cost(found) == pytest.approx(known["cost"], rel=1e-9)
    values, sd = found.cameras[0].camera.parameters, known["sd_a_priori"]
    for name, value in known["intrinsics"].items():
        assert abs(values[name] - value) < 1e-3 * sd[name]


def test_knots_begin_as_the_lens_that_needs_none():
    board, corners = wide(step=6)
    plain, splined = (first_values(board, corners, model) for model in (None, "splined_stereographic"))
    knotted = splined.cameras[0]
    assert knotted.model == "splined_stereographic"
    assert np.isinf(knotted.knot_sd).all()
    own = knotted.project(plain.cameras[0].rays(corners.xy))
    assert np.abs(own - corners.xy).max() < 1.0
    np.testing.assert_allclose(splined.poses, plain.poses, atol=1e-3)


def test_every_third_picture_of_it_is_enough():
    board, corners = wide(step=3)
    found = calibration(board, first_values(board, corners)).adjust()
    assert found.converged
    squares, freedom = found.sum_and_freedom
    # Of residuals in pixels.
    assert found.calibration.assumed**2 * squares / freedom < 0.35
