"""Cameras as YAML of OpenCV and ROS, written, read, and refused; a library reads the same."""

import cv2
import numpy as np
import pytest

from photogram import InputError
from photogram.stellar import BrownCamera, SkyCamera, read_night, read_yaml, to_yaml

FRAME = (6000.0, 4000.0)
BROWN = BrownCamera(
    np.array([9012.25, 9009.5, 3018.0, 1987.0, -0.105, 0.092, -0.02, 4e-4, -3e-4]),
    np.diag([0.15, 0.15, 0.5, 0.35, 1e-3, 0.01, 0.04, 1e-5, 1e-5]) ** 2,
)
FISHEYE = SkyCamera(
    np.array([950.0, 950.6, 1510.0, 1390.0, 0.03, -0.01, 0.004, -6e-4]), np.zeros((8, 8)), "kannala_brandt"
)
# As OpenCV's calibration writes it: other indents, numbers without decimals, lists over several lines.
OPENCV = """%YAML:1.0
---
calibration_time: "Sun Nov 22 12:00:00 2026"
image_width: 640
image_height: 480
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 6.5e+02, 0., 320., 0.,
       651., 240., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.8e-01, 1.1e-01, 1e-3, -5.e-04,
       0. ]
avg_reprojection_error: 0.3
"""


@pytest.mark.parametrize("form", ["opencv", "ros"])
@pytest.mark.parametrize("camera", [BROWN, FISHEYE], ids=["brown", "fisheye"])
def test_a_camera_comes_back(form, camera, tmp_path):
    file = tmp_path / "camera.yaml"
    file.write_bytes(to_yaml(camera, FRAME, form))
    again, frame = read_yaml(file)
    assert (again.lens, frame) == (camera.lens, FRAME)
    assert again.values.tolist() == camera.values.tolist()
    assert not again.covariance.any()


@pytest.mark.parametrize("camera", [BROWN, FISHEYE], ids=["brown", "fisheye"])
def test_a_library_of_yaml_reads_the_same(camera):
    """Where PyYAML is installed: tag and directive of OpenCV aside, both files are YAML 1.1."""
    yaml = pytest.importorskip("yaml")
    ros = yaml.safe_load(to_yaml(camera, FRAME, "ros", "sky-1"))
    assert (ros["image_width"], ros["image_height"], ros["camera_name"]) == (6000, 4000, "sky-1")
    assert ros["distortion_model"] == ("plumb_bob" if camera is BROWN else "equidistant")
    assert ros["camera_matrix"]["data"][:3] == [camera.values[0], 0.0, camera.values[2]]
    k = ros["distortion_coefficients"]
    assert len(k["data"]) == k["rows"] * k["cols"]
    opencv = (
        to_yaml(camera, FRAME, "opencv").decode().replace("%YAML:1.0\n", "").replace("!!opencv-matrix", "")
    )
    found = yaml.safe_load(opencv)
    assert found["distortion_coefficients"]["data"] == k["data"]
    deviations = found["standard_deviations"]["data"]
    assert deviations[:4] == pytest.approx(np.sqrt(np.diag(camera.covariance))[:4].tolist())


@pytest.mark.parametrize("camera", [BROWN, FISHEYE], ids=["brown", "fisheye"])
def test_opencv_reads_the_same_and_projects_the_same(camera, tmp_path):
    """It reads our file, its lens is the same, and we read its file."""
    file = tmp_path / "camera.yaml"
    file.write_bytes(to_yaml(camera, FRAME, "opencv"))
    storage = cv2.FileStorage(str(file), cv2.FILE_STORAGE_READ)
    matrix = storage.getNode("camera_matrix").mat()
    terms = storage.getNode("distortion_coefficients").mat().ravel()
    size = [int(storage.getNode(name).real()) for name in ("image_width", "image_height")]
    assert size == [6000, 4000]
    directions = np.random.default_rng(5).uniform([-0.3, -0.3, 0.7], [0.3, 0.3, 1.3], (50, 3))
    project = cv2.projectPoints if camera is BROWN else cv2.fisheye.projectPoints
    given = directions if camera is BROWN else directions[:, np.newaxis]
    of_opencv = project(given, np.zeros(3), np.zeros(3), matrix, terms)[0].reshape(-1, 2)
    np.testing.assert_allclose(camera.images(directions), of_opencv, rtol=0, atol=1e-9)

    own = cv2.FileStorage(str(tmp_path / "own.yaml"), cv2.FILE_STORAGE_WRITE)
    own.write("image_width", 6000)
    own.write("image_height", 4000)
    own.write("fisheye_model", int(camera is FISHEYE))
    own.write("camera_matrix", matrix)
    own.write("distortion_coefficients", terms)
    own.release()
    again, frame = read_yaml(tmp_path / "own.yaml")
    assert frame == FRAME
    np.testing.assert_allclose(again.values, camera.values, rtol=1e-15)


def test_a_file_of_opencv(tmp_path):
    file = tmp_path / "out_camera_data.yml"
    file.write_text(OPENCV)
    camera, frame = read_yaml(file)
    assert frame == (640.0, 480.0)
    assert camera.values.tolist() == [650, 651, 320, 240, -0.28, 0.11, 0, 1e-3, -5e-4]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("image_width: 640", "image_width: none", "/image_width: must be a number"),
        ("image_width: 640", "image_width: 0", "/image_width: must be an integer from 1"),
        ("image_height: 480\n", "", "image_height is missing"),
        ("camera_matrix", "matrix", "camera_matrix is missing"),
        ("distortion_coefficients", "lens", "distortion_coefficients is missing"),
        ("0., 0., 1. ]", "0., 0., 1., 3. ]", "must have 9 values, got 10"),
        ("[ 6.5e+02, 0.,", "[ 6.5e+02, 2.,", "/camera_matrix: must be a camera matrix without skew"),
        ("       0. ]", "       0., 0.1, 0.2 ]", "has more terms than k1, k2, p1, p2, k3"),
        ("flags: 0", "distortion_model: fov", "choose one of plumb_bob, equidistant"),
        ("flags: 0", "flags", "record 6: the line must have the form `key: value`"),
        ("flags: 0", "image_width: 3", "the key 'image_width' occurs more than once"),
        ("-2.8e-01", "nan", "must be a finite number"),
    ],
)
def test_files_that_are_refused(old, new, message, tmp_path):
    assert old in OPENCV
    file = tmp_path / "camera.yaml"
    file.write_text(OPENCV.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        read_yaml(file)
    assert caught.value.file == file


def test_lenses_without_a_form():
    camera = SkyCamera.of_field(100, 100, 1.0, "stereographic")
    with pytest.raises(InputError, match="stereographic has no YAML form; lenses that have are brown"):
        to_yaml(camera, (100, 100), "ros")
    with pytest.raises(InputError, match="letters, digits, dots and hyphens"):
        to_yaml(BROWN, FRAME, "ros", "a: b")


def test_a_night_begins_with_such_a_file(folder):
    """A camera of YAML is where the adjustment starts from; it is no prior, as it has no covariance."""
    (folder / "camera.yaml").write_bytes(to_yaml(BROWN, FRAME, "opencv"))
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("field_of_view_deg = 36.9", 'start = "camera.yaml"'))
    night = read_night(file)
    assert night.camera.values.tolist() == BROWN.values.tolist()
    assert night.prior is None
