"""Cameras as YAML of OpenCV and ROS, written, read, and refused; a library reads the same."""

import cv2
import numpy as np
import pytest

from message_codes import as_check, coded
from photogram import InputError
from photogram.io.yaml_text import read_yaml_text
from photogram.stellar import SkyCamera, read_night, read_yaml, to_yaml

FRAME = (6000.0, 4000.0)
BROWN = SkyCamera(
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
        ("image_width: 640", "image_width: none", coded("error.at", what="/image_width")),
        ("image_width: 640", "image_width: 0", coded("error.at", what="/image_width")),
        ("image_height: 480\n", "", coded("error.at", what="error.document")),
        ("camera_matrix", "matrix", coded("error.at", what="error.document")),
        ("distortion_coefficients", "lens", coded("error.at", what="error.document")),
        ("0., 0., 1. ]", "0., 0., 1., 3. ]", coded("error.at", what="/camera_matrix/data")),
        (
            "[ 6.5e+02, 0.,",
            "[ 6.5e+02, 2.,",
            coded("error.at", what="/camera_matrix", message="stars.camera-matrix"),
        ),
        ("       0. ]", "       0., 0.1, 0.2 ]", coded("stars.more-terms")),
        ("flags: 0", "distortion_model: fov", coded("error.choice", names=["plumb_bob", "equidistant"])),
        ("flags: 0", "flags", coded("error.parse")),
        ("flags: 0", "image_width: 3", coded("error.repeated", kind="key", name="image_width")),
        ("-2.8e-01", "nan", coded("error.at", what="/distortion_coefficients/data/0")),
    ],
)
def test_files_that_are_refused(old, new, message, tmp_path):
    assert old in OPENCV
    file = tmp_path / "camera.yaml"
    file.write_text(OPENCV.replace(old, new))
    with pytest.raises(InputError, check=as_check(message)) as caught:
        read_yaml(file)
    assert caught.value.file == file


def test_lenses_without_a_form_and_names_with_quotation_marks(tmp_path):
    camera = SkyCamera.of_field(100, 100, 1.0, "stereographic")
    with pytest.raises(InputError, check=coded("stars.no-yaml", lens="stereographic")):
        to_yaml(camera, (100, 100), "ros")
    file = tmp_path / "camera.yaml"
    file.write_bytes(to_yaml(BROWN, FRAME, "ros", 'a: "b"'))
    assert read_yaml_text(file)["camera_name"] == 'a: "b"'


def test_a_night_begins_with_such_a_file(folder):
    """A camera of YAML is where the adjustment starts from; it is no prior, as it has no covariance."""
    (folder / "camera.yaml").write_bytes(to_yaml(BROWN, FRAME, "opencv"))
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("field_of_view_deg = 36.9", 'start = "camera.yaml"'))
    night = read_night(file)
    assert night.camera.values.tolist() == BROWN.values.tolist()
    assert night.prior is None
