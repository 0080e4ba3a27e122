"""Files of cameras for other programs, read again by code that knows nothing of how they were written."""

import ast
import base64
import io
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml
from golden_boards import left, rig

from message_codes import refusal
from photogram import InputError
from photogram.targets import Calibration, camera_files, first_values, projection_uncertainty, uncertainty_map
from photogram.targets.camera_formats import CAMERA_FORMATS, cameras_covariance
from photogram.targets.housing import worst
from photogram.targets.mrcal import read_model


def calibrated(given, model):
    board, corners = given
    first = first_values(board, corners, model=model)
    calibration = Calibration(
        board=replace(board, shape="held"),
        corners=corners,
        cameras=first.cameras,
        poses=first.poses,
        sensors=first.sensors if len(first.cameras) > 1 else None,
    )
    return calibration.adjust()


@pytest.fixture(scope="module")
def one():
    return calibrated(left(), "opencv5")


@pytest.fixture(scope="module")
def pair():
    return calibrated(rig(), "opencv4")


def parsed(content):
    """Return YAML with the tags of OpenCV."""

    class Loader(yaml.SafeLoader):
        pass

    def matrix(loader, node):
        given = loader.construct_mapping(node, deep=True)
        return np.reshape(given["data"], (given["rows"], given["cols"]))

    Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", matrix)
    return yaml.load(content.decode().replace("%YAML:1.0\n", ""), Loader=Loader)


def pinhole(k, terms, points):
    """Return images by the formula of OpenCV, 5 terms."""
    x, y = (points[:, :2] / points[:, 2:]).T
    k1, k2, p1, p2, k3 = [*terms, 0.0][:5]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    a = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    b = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([a, b, np.ones_like(a)], axis=1) @ np.asarray(k)[:2].T


def test_opencv_reads_the_camera_and_its_errors(one):
    found = parsed(camera_files(one, "opencv_yaml")["left.yaml"])
    assert (found["image_width"], found["image_height"]) == (640, 480)
    points = np.array([[0.3, -0.2, 1.0], [-0.4, 0.25, 1.1]])
    images = pinhole(found["camera_matrix"], found["distortion_coefficients"].ravel(), points)
    np.testing.assert_allclose(images, one.cameras[0].camera.project(points * [1, -1, -1]), atol=1e-10)
    # The figures of OpenCV itself for these corners.
    assert found["avg_reprojection_error"] == pytest.approx(0.40877429730, abs=1e-8)
    sd = found["std_deviations_intrinsics"].ravel()
    assert len(sd) == 18
    np.testing.assert_allclose(sd[:9], one.cameras[0].sd[:9])
    assert len(found["per_view_reprojection_errors"]) == 13


def test_a_pair_has_its_pose_and_what_follows_from_it(pair):
    first, second = (parsed(each) for each in camera_files(pair, "opencv_yaml").values())
    assert "R" not in first
    np.testing.assert_allclose(second["R"], pair.sensors[1, :3, :3])
    np.testing.assert_allclose(second["T"].ravel(), pair.sensors[1, :3, 3])
    # x1' F x0 = 0 of images without distortion.
    points = np.array([[0.1, 0.2, 1.5], [-0.3, 0.1, 2.0], [0.2, -0.2, 1.2]])
    moved = points @ second["R"].T + second["T"].ravel()
    x0, x1 = (
        p @ np.asarray(k).T / p[:, 2:]
        for p, k in ((points, first["camera_matrix"]), (moved, second["camera_matrix"]))
    )
    apart = np.einsum("ni,ij,nj->n", x1, second["F"], x0)
    np.testing.assert_allclose(apart, 0, atol=1e-9 * np.abs(second["F"]).max() * 1e6)
    rays = [p / p[:, 2:] for p in (points, moved)]
    np.testing.assert_allclose(np.einsum("ni,ij,nj->n", rays[1], second["E"], rays[0]), 0, atol=1e-15)


def test_ros_has_equal_rows_and_the_base(pair):
    infos = [yaml.safe_load(each) for each in camera_files(pair, "ros_camera_info").values()]

    def array(info, name):
        return np.reshape(info[name]["data"], (info[name]["rows"], info[name]["cols"]))

    assert [each["distortion_model"] for each in infos] == ["plumb_bob", "plumb_bob"]
    points = np.array([[0.1, 0.2, 1.5], [-0.3, 0.1, 2.0], [0.2, -0.2, 1.2]])
    moved = points @ pair.sensors[1, :3, :3].T + pair.sensors[1, :3, 3]
    places = []
    for info, seen in zip(infos, (points, moved), strict=True):
        turn, projection = array(info, "rectification_matrix"), array(info, "projection_matrix")
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14)
        turned = seen @ turn.T
        # Each camera's own image is that of its K part; the fourth column takes points of the first to it.
        places.append(turned @ projection[:, :3].T / turned[:, 2:])
    np.testing.assert_allclose(places[0][:, 1], places[1][:, 1], atol=1e-9)
    from_first = np.column_stack([points @ array(infos[0], "rectification_matrix").T, np.ones(3)])
    through = from_first @ array(infos[1], "projection_matrix").T
    np.testing.assert_allclose(through[:, :2] / through[:, 2:], places[1][:, :2], atol=1e-9)
    base = np.linalg.norm(pair.sensors[1, :3, 3])
    shift = array(infos[1], "projection_matrix")[0, 3]
    assert abs(shift) == pytest.approx(array(infos[1], "projection_matrix")[0, 0] * base)


def test_kalibr_has_the_chain(pair):
    found = yaml.safe_load(camera_files(pair, "kalibr_camchain")["camchain.yaml"])
    assert list(found) == ["cam0", "cam1"]
    assert "T_cn_cnm1" not in found["cam0"]
    np.testing.assert_allclose(found["cam1"]["T_cn_cnm1"], pair.sensors[1])
    for own, camera in zip(found.values(), pair.cameras, strict=True):
        assert (own["camera_model"], own["distortion_model"]) == ("pinhole", "radtan")
        np.testing.assert_array_equal(own["intrinsics"], camera.values[:4])
        np.testing.assert_array_equal(own["distortion_coeffs"], camera.values[4:8])


def test_mrcal_has_the_whole_calibration(pair, tmp_path):
    files = camera_files(pair, "mrcal")
    models = [ast.literal_eval(each.decode()) for each in files.values()]
    assert [each["icam_intrinsics"] for each in models] == [0, 1]
    assert models[0]["extrinsics"] == [0.0] * 6
    packed = np.load(io.BytesIO(base64.b85decode(models[1]["optimization_inputs"])))
    assert str(packed["lensmodel"]) == "LENSMODEL_OPENCV4"
    np.testing.assert_array_equal(packed["intrinsics"][1], pair.cameras[1].values[:8])
    indices = packed["indices_frame_camintrinsics_camextrinsics"]
    assert (np.diff(indices[:, 0]) >= 0).all()
    np.testing.assert_array_equal(indices[:, 2], indices[:, 1] - 1)
    # What is read again is adjusted to the same.
    name = next(iter(files))
    (tmp_path / name).write_bytes(files[name])
    again = read_model(tmp_path / name).adjust()
    assert again.sum_and_freedom[0] == pytest.approx(
        pair.sum_and_freedom[0] * (pair.calibration.sd0 or 1.0) ** 2, rel=1e-9
    )


def test_what_a_format_cannot_hold_is_refused_with_what_can(one):
    with refusal("targets.refused-terms title=camchain.yaml of Kalibr camera=left"):
        camera_files(one, "kalibr_camchain")
    wide = calibrated(left(), "stereographic")
    for name in ("opencv_yaml", "ros_camera_info"):
        with refusal("targets.refused", "camera=left model=stereographic to=opencv5"):
            camera_files(wide, name)
    with pytest.raises(InputError, match="format of cameras"):
        camera_files(one, "json")
    assert set(CAMERA_FORMATS) == {"opencv_yaml", "ros_camera_info", "kalibr_camchain", "mrcal"}


def test_covariances_are_joint(pair):
    found = json.loads(cameras_covariance(pair))
    names, cofactors = pair.cofactors(("cameras", "sensors"))
    assert found["names"] == names
    np.testing.assert_allclose(found["covariance"], cofactors * found["sigma0"] ** 2)
    assert found["datum"] == "axes"


def test_the_valid_region_is_where_the_camera_is_known(pair):
    need = 1.1 * np.nanmin(uncertainty_map(pair, 1).sd)
    models = [ast.literal_eval(each.decode()) for each in camera_files(pair, "mrcal", need).values()]
    outline = np.array(models[1]["valid_intrinsics_region"])
    np.testing.assert_array_equal(outline[0], outline[-1])
    assert worst(projection_uncertainty(pair, 1, outline)).max() < 1.01 * need
    assert worst(projection_uncertainty(pair, 1, [outline.mean(axis=0)])) < need
    # A little farther out it is known less well, but where the picture ends.
    size = np.array(pair.calibration.corners.sizes[1])
    ends = ((outline < 2) | (outline > size - 3)).any(axis=1)
    farther = outline.mean(axis=0) + 1.1 * (outline - outline.mean(axis=0))
    assert (worst(projection_uncertainty(pair, 1, farther[~ends])) > need).mean() > 0.95
    with refusal("targets.no-region camera=a need=1e-06 best=0.07191855949761519"):
        camera_files(pair, "mrcal", 1e-6)
    with refusal("error.not-applicable name=need other=opencv_yaml"):
        camera_files(pair, "opencv_yaml", need)
