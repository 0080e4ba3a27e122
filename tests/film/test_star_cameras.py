"""Cameras that stars have calibrated, in projects on film: with their covariance, in their own frame."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import InputError, adjust, camera_from
from photogram.film import Certificate
from photogram.formats import read
from photogram.stellar import PlateCamera

ARCHIVE = files("photogram") / "examples" / "archive"
INTERIOR = ("epsilon", "xp", "yp", "cx", "cy", "dx", "dy", "K1", "K2", "K3", "K4", "K5", "phi_T")
SAME = {"c": ("cx", -1e-3), "A1": ("K1", 1e6), "xp": ("xp", 1e-3), "yp": ("yp", -1e-3)}
"""A plate counts y down, in metres, and its principal distance is positive for the positive."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the archive with its camera as if stars had calibrated it, and marks in its frame."""
    for each in ARCHIVE.iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    own = Certificate.read(tmp_path / "rc10-2345.toml")
    camera, marks = own.camera("brown_forward"), own.fiducials()
    assert camera.covariance is not None
    names, covariance = camera.covariance
    values, change = np.zeros(13), np.zeros((13, len(names)))
    for k, name in enumerate(names):
        to, factor = SAME[name]
        change[INTERIOR.index(to), k] = factor
        values[INTERIOR.index(to)] = factor * camera.parameters[name]
    values[INTERIOR.index("cy")] = values[INTERIOR.index("cx")]
    plate = PlateCamera(values, change @ covariance @ change.T, 1.0, 100, common_scale=True)
    (tmp_path / "camera.json").write_bytes(plate.to_json())
    (tmp_path / "cameras.csv").write_text("camera,calibration\nrc10-2345,camera.json\n")
    rows = [
        f"rc10-2345,{name},{x!r},{-y!r}" for name, (x, y) in zip(marks.names, marks.xy.tolist(), strict=True)
    ]
    (tmp_path / "fiducials.csv").write_text("\n".join(["camera,fiducial,x,y", *rows]) + "\n")
    settings = (tmp_path / "project.toml").read_text().replace("certificate =", "#").replace("flown", "#")
    (tmp_path / "project.toml").write_text(settings)
    photos = (tmp_path / "photos.csv").read_text().replace(",true,", ",,").replace(",false,", ",,")
    (tmp_path / "photos.csv").write_text(photos)
    return tmp_path


def test_a_camera_of_stars_is_that_of_a_certificate(folder: Path) -> None:
    """The same camera, said otherwise, has the same results; its frame is mirrored, and films lie so."""
    project = read(folder)
    assert project.messages == ()
    (camera,) = project.block.cameras
    assert camera == camera_from(folder / "camera.json", "rc10-2345")
    assert [scan.film.mirrored for scan in project.block.passages] == [True] * 5 + [False]
    one = adjust(read(ARCHIVE).block, unit_variance="unity")
    two = adjust(project.block, unit_variance="unity")
    assert two.sum_and_freedom == pytest.approx(one.sum_and_freedom, rel=1e-9)
    np.testing.assert_allclose(two.point_positions, one.point_positions, rtol=0, atol=1e-8)
    np.testing.assert_allclose(two.point_sd, one.point_sd, rtol=1e-8)
    np.testing.assert_allclose(two.film[:, 3:5], one.film[:, 3:5], rtol=0, atol=1e-11)
    np.testing.assert_allclose(two.film[:, 5], -one.film[:, 5], rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("camera,calibration,c\nrc10-2345,camera.json,152\n", "must be in its calibration only"),
        ("camera,calibration\nrc10-2345,scanners.csv\n", "scanners.csv"),
        ("camera,calibration\nrc10-2345,none.json\n", "none.json: the file must be readable"),
    ],
)
def test_calibrations_that_cannot_be_are_refused(folder: Path, table: str, said: str) -> None:
    (folder / "cameras.csv").write_text(table)
    with pytest.raises(InputError, match=said):
        read(folder)


def test_a_plate_is_no_camera_of_pixels(folder: Path) -> None:
    settings = (folder / "project.toml").read_text().replace('image = "mm"', 'image = "px"')
    (folder / "project.toml").write_text(settings)
    with pytest.raises(InputError, match=r"\[units\] image must be mm"):
        read(folder)
