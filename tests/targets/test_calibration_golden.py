"""Calibrations as blocks against an independent program, mrcal and OpenCV (../shared/data/targets)."""

from functools import cache

import numpy as np
import pytest
from given_targets import golden, left_table, poses_of, rig_cofactors, rig_small

from golden_data import shared
from photogram.targets import read
from photogram.targets.page import prior_shift
from photogram.targets.regularisation import regularised

REGULARISED = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "cx", "cy")


@cache
def rig_adjusted():
    return rig_small().adjust()


def test_rig_values():
    found, expected = rig_adjusted(), golden("rig_small")["points"]
    squares = found.sums_of_squares
    assert found.converged
    assert squares.total == pytest.approx(expected["cost"], rel=1e-10)
    assert squares.plates == pytest.approx(expected["image_sum"], rel=1e-10)
    assert found.degrees_of_freedom == expected["dof"]
    for camera, values in zip(found.cameras, expected["cameras"], strict=True):
        assert np.abs((camera.values - values) / camera.sd).max() < 1e-6
    assert np.abs(found.sensors[1] - poses_of(expected["sensor1"])).max() < 1e-10
    assert np.abs(found.poses - poses_of(expected)).max() < 1e-9
    assert np.abs(found.points - expected["board"]).max() < 1e-10


def test_rig_cofactors():
    expected = rig_cofactors()
    names, found = rig_adjusted().cofactors(("cameras", "sensors", "board", "views"))
    assert names[:9] == [
        *(f"left {each}" for each in ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")),
        "right fx",
    ]
    assert names[16] == "right tx"
    assert names[22:24] == ["0.x", "0.y"]
    assert names[-1] == "view 19 wz"
    scale = np.sqrt(np.diag(expected))
    assert np.abs((found - expected) / np.outer(scale, scale)).max() < 1e-6


def test_rig_standard_deviations():
    names, found = rig_adjusted().cofactors()
    expected = golden("rig_small")["points"]["sd_camera_sensor"]
    assert np.sqrt(np.diag(found)) == pytest.approx(list(expected.values()), rel=1e-6)
    assert len(names) == len(expected)


def test_rig_residuals_and_redundancy():
    found, expected = rig_adjusted(), golden("rig_small")["points"]
    assert np.abs(found.residuals - expected["residuals"]).max() < 1e-5
    assert np.abs(found.redundancy - expected["redundancy"]).max() < 1e-7
    assert np.abs(found.point_redundancy.ravel() - expected["redundancy_points"]).max() < 1e-7
    assert found.redundancies.plates == pytest.approx(expected["redundancy_images"], rel=1e-8)
    assert found.redundancies.total == pytest.approx(expected["dof"], rel=1e-8)
    assert found.verdict.code == "accepted"


def test_views_need_not_show_the_board_to_the_first_camera():
    given = rig_small()
    keep = ~((given.corners.cameras == 0) & (given.corners.views < 5))
    part = given.replace(corners=given.corners.of_pictures(keep))
    found = part.adjust()
    assert found.block.photo_ids[-1] == "frame of view04-1"
    assert np.abs(found.poses - rig_adjusted().poses).max() < 0.01
    names, cofactors = found.cofactors(("views",))
    assert len(names) == len(cofactors) == 120
    assert (np.diag(cofactors) > 0).all()


def test_pictures_that_are_not_synchronised_have_poses_of_their_own():
    given = rig_small()
    poses = given.picture_poses()
    views = np.arange(len(given.corners.pictures))
    apart = given.replace(corners=given.corners.replace(views=views), poses=poses, sensors=None, sync="none")
    found = apart.adjust()
    assert not found.unknowns
    assert found.degrees_of_freedom == golden("rig_small")["points"]["dof"] + 6 - 6 * 19


def test_state_of_mrcal():
    """What mrcal stored, evaluated as it is, costs what it said; its priors are in it."""
    given = read(shared("targets", "opencv8-0.cameramodel"))
    corners = given.corners
    weighted = (given.residuals() / corners.sd[:, np.newaxis])[corners.use]
    priors = regularised(given.cameras, corners.sizes, 2 * 18_600)[0]
    sd = priors.deviations
    observed = (sd > 0) & np.isfinite(sd)
    of_priors = (priors.values - given.cameras[0].values)[observed] / sd[observed]
    cost = (weighted**2).sum() + (of_priors**2).sum()
    assert cost == pytest.approx(golden("mrcal_opencv8")["stored"]["cost"], rel=1e-11)
    scale = golden("mrcal_opencv8")["with_regularisation"]["regularisation_scale"]
    own = dict(zip(priors.names, 1 / np.where(sd > 0, sd, 1), strict=True))
    assert own["k1"] == pytest.approx(scale["lens"], rel=1e-12)
    assert own["k4"] == pytest.approx(scale["denominator"], rel=1e-12)
    assert own["cx"] == pytest.approx(scale["centre"], rel=1e-12)


def test_left_pictures_of_opencv_from_corners_alone(tmp_path):
    found = read(left_table(tmp_path)).adjust()
    expected, opencv = golden("opencv_left")["left"]["solution"], golden("opencv_left")["left"]["opencv"]
    camera = found.cameras[0]
    names = expected["order"].split()
    values = np.array([camera.value(name) for name in names])
    sd = np.array([camera.deviation(name) for name in names])
    assert np.abs((values - expected["parameters"]) / expected["sd"]).max() < 1e-5
    assert sd == pytest.approx(expected["sd"], rel=1e-4)
    assert sd == pytest.approx(opencv["sd_intrinsics"][:9], rel=1e-4)
    assert found.sums_of_squares.total == pytest.approx(expected["cost"], rel=1e-10)
    rms = np.sqrt((found.residuals**2).sum(axis=1).mean())
    assert rms == pytest.approx(opencv["rms"], rel=1e-9)
    assert found.global_test is None  # nobody has said how well corners are measured


def test_rig_with_a_board_of_two_parabolas():
    found, expected = rig_small("bend").adjust(), golden("rig_small")["two_parabolas"]
    assert found.sums_of_squares.total == pytest.approx(expected["cost"], rel=1e-10)
    assert found.degrees_of_freedom == expected["dof"]
    names, cofactors = found.cofactors(("cameras", "sensors", "board"))
    assert names[-2:] == ["bend_x", "bend_y"]
    wanted = np.array(expected["cofactors_camera_sensor_bend"])
    scale = np.sqrt(np.diag(wanted))
    assert np.abs((cofactors - wanted) / np.outer(scale, scale)).max() < 1e-6
    assert np.abs((found.bend.position[:2] - expected["bend"]) / scale[-2:]).max() < 1e-6
    for camera, values in zip(found.cameras, expected["cameras"], strict=True):
        assert np.abs((camera.values - values) / camera.sd).max() < 1e-6
    assert np.abs(found.sensors[1] - poses_of(expected["sensor1"])).max() < 1e-9
    assert found.points[31, 2] == pytest.approx(sum(expected["bend"]), rel=1e-6)


@cache
def opencv8(regularise):
    given = read(shared("targets", "opencv8-0.cameramodel"))
    return given.replace(regularise=regularise).adjust()


@pytest.mark.parametrize(
    ("regularise", "key"), [("mrcal", "with_regularisation"), (None, "without_regularisation")]
)
def test_optimum_of_mrcal(regularise, key):
    found, expected = opencv8(regularise), golden("mrcal_opencv8")[key]
    squares = found.sums_of_squares
    assert squares.total == pytest.approx(expected["cost"], rel=1e-10)
    assert squares.plates == pytest.approx(expected["image_sum"], rel=1e-9)
    assert found.degrees_of_freedom == expected["dof"]
    names, cofactors = found.cofactors(("cameras", "board"))
    order = [*(f"camera 0 {name}" for name in expected["intrinsics"]), "bend_x", "bend_y"]
    rows = [names.index(name) for name in order]
    wanted = np.array(expected["cofactors_common"])
    scale = np.sqrt(np.diag(wanted))
    assert np.abs((cofactors[np.ix_(rows, rows)] - wanted) / np.outer(scale, scale)).max() < 1e-6
    assert np.sqrt(np.diag(cofactors))[rows] == pytest.approx(
        list(expected["sd_a_priori"].values()), rel=1e-6
    )
    values = [found.cameras[0].value(name) for name in expected["intrinsics"]]
    bend = found.bend.position[:2] - expected["board_bend"]
    off = np.array([*(np.array(values) - list(expected["intrinsics"].values())), *bend])
    assert np.abs(off / scale).max() < 1e-4


def test_views_and_corners_at_the_optimum_of_mrcal():
    found, expected = opencv8("mrcal"), golden("mrcal_opencv8")["with_regularisation"]
    result = found
    assert np.abs(result.redundancy[:100] - expected["redundancy_first_view"]).max() < 1e-7
    assert np.abs(result.residuals[:100] - expected["residuals_first_view"]).max() < 1e-5
    assert result.redundancies.plates == pytest.approx(expected["redundancy_images"], rel=1e-8)
    camera = found.cameras[0]
    own = [camera.redundancy[camera.names.index(name)] for name in REGULARISED]
    assert np.abs(np.array(own) - expected["redundancy_regularisation"]).max() < 1e-6
    weighted = result.residuals / result.image_given_sd
    rms = np.sqrt((weighted**2).mean())
    assert rms == pytest.approx(expected["weighted_rms_per_coordinate"], rel=1e-9)
    assert weighted.std() == pytest.approx(expected["sigma_mrcal"], rel=1e-9)
    names, cofactors = found.cofactors(("views",))
    for pose in expected["poses"]:
        view = pose["view"]
        assert np.abs(found.poses[view][:3, :3] - pose["R"]).max() < 1e-6
        wanted = np.array(pose["cofactors"])
        scale = np.sqrt(np.diag(wanted))
        rows = [names.index(f"view {view} {step}") for step in ("tx", "ty", "tz", "wx", "wy", "wz")]
        assert np.abs((cofactors[np.ix_(rows, rows)] - wanted) / np.outer(scale, scale)).max() < 1e-6


def test_what_the_priors_of_mrcal_have_moved():
    """All intrinsics move by less than 0.2 of their standard deviations: the report says so."""
    moved = {
        name: over
        for name, _, over in zip(*(each.values for each in prior_shift(opencv8("mrcal"))), strict=True)
    }
    expected = golden("mrcal_opencv8")
    free, priors = expected["without_regularisation"], expected["with_regularisation"]
    sigma = np.sqrt(priors["variance_of_unit_weight"])
    for name, value in priors["intrinsics"].items():
        wanted = (value - free["intrinsics"][name]) / (sigma * priors["sd_a_priori"][name])
        assert moved[f"camera 0 {name}"] == pytest.approx(wanted, abs=1e-3)
    assert opencv8("mrcal").document().sections[0]
