"""The camera of JPL beside mrcal: what `cahvor_of_mrcal.py` prints with mrcal 2.2."""

import math

import numpy as np
import pytest
from golden_boards import left
from typer.testing import CliRunner

from photogram import Camera, InputError
from photogram.cli import app
from photogram.targets import Calibration, camera_files, convert_lens, difference, first_values
from photogram.targets.mrcal import mrcal_models, read_lens, read_model

NAMES = ("fx", "fy", "cx", "cy", "axis_x", "axis_y", "r0", "r1", "r2")
VALUES = (520.0, 521.0, 318.0, 236.0, 0.05, -0.04, 0.01, -0.2, 0.05)
CAMERA = Camera("cahvor", dict(zip(NAMES, VALUES, strict=True)), name="jpl")
SIZE = (640, 480)
VISION = np.array([1.0, -1.0, -1.0])
POINTS = np.array([[0.3, -0.2, 1.0], [-0.5, 0.4, 1.2], [0.0, 0.0, 1.0], [0.7, 0.6, 1.0]])
IMAGES = [
    [473.1427498415808, 132.34954147017345],
    [115.19899653429198, 398.5516714245505],
    [317.7621369684857, 236.19083762259004],
    [641.1716337317446, 508.3153742715363],
]
BY_THE_LAST_POINT = [
    [407.37891815520686, -51.72742080028283, -254.12879022847505],
    [-49.14090204117988, 407.0237665681993, -209.8156285120936],
]
BY_PARAMETERS_THERE = [
    [
        0.6214839110225858,
        0,
        1,
        0,
        135.57689954802404,
        68.52175419703258,
        339.73390917984756,
        277.71537953703694,
        227.01835156105,
    ],
    [
        0,
        0.5226782615576513,
        0,
        1,
        71.50958591656803,
        130.72659282660103,
        335.2094298521843,
        274.01684530263316,
        223.9949858890222,
    ],
]
COST = 117.4331272306157
OPTIMUM = [545.159638326302, 545.1242773681087, 342.3586905633623, 235.54395731578634, -0.0013700279462339367]
OPTIMUM += [0.00680730586582358, -0.015907235977748957, -0.2744765959305895, 0.0673581396080529]
"""The camera of the 13 pictures of OpenCV, its board plane and without unknowns, priors of mrcal."""


def test_images_and_partials_are_those_of_mrcal():
    images, by_u, by_parameters = CAMERA.partials(POINTS * VISION)
    np.testing.assert_allclose(images, IMAGES, atol=1e-10)
    np.testing.assert_allclose(by_u[3] * VISION, BY_THE_LAST_POINT, rtol=1e-12)
    np.testing.assert_allclose(by_parameters[3], BY_PARAMETERS_THERE, rtol=1e-12)
    rays = POINTS * VISION / np.linalg.norm(POINTS, axis=1)[:, np.newaxis]
    np.testing.assert_allclose(CAMERA.rays(IMAGES), rays, atol=1e-14)


def started(model, **given):
    board, corners = left()
    first = first_values(board, corners, model=model)
    own = {"cameras": first.cameras, "poses": first.poses, "board": board.replace(shape="held")}
    return Calibration(corners=first.corners, **(own | given))


def test_the_optimum_with_the_priors_of_mrcal_is_its_own(tmp_path):
    start = started("cahvor", regularise="mrcal")
    free = start.cameras[0].replace(sd=dict.fromkeys(NAMES, math.inf))
    near = start.replace(cameras=[free]).adjust()
    assert "fx of left; fy of left; r0 of left" in str(near.messages[0])
    # Along these three the sum of squares stands still before its last digits: once more from the priors.
    found = near.restarted_calibration().replace(cameras=[near.cameras[0].restarted()]).adjust()
    assert found.sums_of_squares.total == pytest.approx(COST, rel=1e-11)
    camera = found.cameras[0]
    np.testing.assert_allclose((camera.values - OPTIMUM) / camera.sd, 0, atol=1e-4)
    # What goes to mrcal is read again as the same calibration.
    path = tmp_path / "left.cameramodel"
    path.write_bytes(camera_files(found, "mrcal")["left.cameramodel"])
    again = read_model(path)
    assert again.regularise == "mrcal"
    np.testing.assert_array_equal(again.cameras[0].values, camera.values)
    assert np.isinf(again.cameras[0].deviations).all()
    assert again.adjust().sums_of_squares.total == pytest.approx(COST, rel=1e-11)


def test_first_values_are_found_and_the_lens_agrees_with_another():
    found, other = started("cahvor").adjust(), started("opencv5").adjust()
    assert found.cameras[0].values[6] == 0, "fx and fy do what r0 does"
    sigmas = [np.sqrt(each.variance_of_unit_weight) for each in (found, other)]
    assert sigmas[0] == pytest.approx(sigmas[1], rel=1e-3)
    assert difference(found, other, (400.0, 4000.0)).rms < 0.05
    # mrcal has no term that is held alone: its tools are told the camera, but not how it was found.
    content = camera_files(found, "mrcal")["left.cameramodel"]
    assert b"LENSMODEL_CAHVOR'" in content
    assert b"optimization_inputs" not in content


def test_it_converts_to_others_and_back():
    near = {"radius": 200.0}
    other = convert_lens(CAMERA, "opencv12", SIZE, **near)
    assert other.largest < 0.05
    back = convert_lens(other.camera, "cahvor", SIZE, **near)
    assert back.largest < 0.05
    assert back.camera.parameters["r0"] == 0, "fx and fy do the same"
    np.testing.assert_allclose(back.camera.values[4:6], VALUES[4:6], atol=1e-3)
    known = convert_lens(
        CAMERA, "opencv12", SIZE, covariance=(["fx", "axis_x"], np.diag([1.0, 1e-6])), **near
    )
    assert np.sqrt(known.covariance[0, 0]) == pytest.approx(1, abs=0.1)


def test_the_command_reads_and_writes_its_files(tmp_path):
    path, out = tmp_path / "jpl.cameramodel", tmp_path / "out"
    path.write_bytes(mrcal_models(convert_lens(CAMERA, "cahvor", SIZE).rig())["jpl.cameramodel"])
    command = ["convert-lens", str(path), "--to", "cahvor", "--intrinsics-only", "--out", str(out)]
    done = CliRunner().invoke(app, [*command, "--tolerance", "1e-6"])
    assert done.exit_code == 0, done.output
    camera, size = read_lens(out / "mrcal" / "jpl.cameramodel")
    assert (camera.model, size) == ("cahvor", SIZE)
    assert not (out / "opencv_yaml").exists()


def test_its_extension_is_refused_with_a_way_out(tmp_path):
    path = tmp_path / "jpl.cameramodel"
    path.write_text(
        "{'lensmodel': 'LENSMODEL_CAHVORE_linearity=0.37', 'imagersize': [640, 480],"
        f" 'intrinsics': {[*VALUES, 0, 0, 0]}}}"
    )
    with pytest.raises(
        InputError, match="mrcal-convert-lensmodel --sampled --intrinsics-only LENSMODEL_OPENC"
    ):
        read_lens(path)
