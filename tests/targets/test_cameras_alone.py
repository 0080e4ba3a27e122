"""Cameras of any project, and nothing else of it, for OpenCV, ROS, Kalibr and mrcal."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from given_targets import rig_small
from typer.testing import CliRunner

from message_codes import refused
from photogram import Camera, InputError, formats
from photogram.cli import app
from photogram.formats.format import FORMATS_OF_CAMERAS
from photogram.formats.targets import adjusted_project, rig_of_project
from photogram.targets import camera_files
from photogram.targets.camera_formats import CAMERA_FORMATS

PROJECT = Path(str(files("photogram.examples") / "project"))


@pytest.fixture(scope="module")
def found():
    return rig_small().adjust()


@pytest.mark.parametrize("name", ["opencv_yaml", "mrcal"])
def test_cameras_of_an_adjusted_project_are_those_of_the_calibration(found, name):
    written = formats.to_files(adjusted_project(found), name)
    expected = camera_files(found, name)
    assert set(written) == set(expected)
    for file, content in written.items():
        told, own = (each.decode().splitlines() for each in (expected[file], content))
        # Without errors, standard deviations and the inputs of an optimization; 1 / 2 px there and back.
        numbers = [line for line in own if "data:" in line or "intrinsics" in line]
        others = [line for line in told if "data:" in line or "intrinsics" in line]
        near = [any(_close(line, other) for other in others) for line in numbers]
        assert numbers
        assert all(near), numbers


def _close(line, other):
    values = [
        np.array([float(each) for each in text.partition("[")[2].rstrip("],").split(",")])
        for text in (line, other)
        if text.rstrip(",").endswith("]")
    ]
    return (
        len(values) == 2 and len(values[0]) == len(values[1]) and np.allclose(*values, rtol=1e-9, atol=1e-9)
    )


def test_a_rig_is_known_where_each_camera_is_one_sensor(found):
    project = adjusted_project(found)
    assert np.abs(rig_of_project(project).sensors - found.sensors).max() < 1e-12
    alone = project.replace(block=project.block.replace(mounts=[]))
    assert np.isnan(rig_of_project(alone).sensors[1]).all()
    assert not any(
        line.startswith(("R:", "T:"))
        for line in formats.to_files(alone, "opencv_yaml")["right.yaml"].decode().splitlines()
    )
    assert any("right" in line for line in formats.cannot_hold(alone, "opencv_yaml"))


def test_a_lens_that_the_format_has_not_is_refused_with_the_command_that_fits_one(found):
    project = adjusted_project(found)
    core = {name: found.cameras[0].value(name) for name in ("fx", "fy", "cx", "cy")}
    other = project.replace(block=project.block.replace(cameras=[Camera("stereographic", core)] * 2))
    with pytest.raises(InputError, match="convert-lens IN --to opencv5"):
        formats.to_files(other, "opencv_yaml")
    written = formats.to_files(other, "mrcal")
    assert all(b"LENSMODEL_STEREOGRAPHIC" in content for content in written.values())


def test_the_command_writes_them_and_says_what_is_left_behind(found, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    for name, content in formats.to_files(adjusted_project(found), "plain").items():
        (folder / name).write_bytes(content)
    done = CliRunner().invoke(app, ["convert", str(folder), str(tmp_path / "out"), "--to", "opencv_yaml"])
    assert done.exit_code == 0, done.output
    assert "standard deviations and errors" in " ".join(done.output.split())
    assert sorted(each.name for each in (tmp_path / "out").iterdir()) == ["left.yaml", "right.yaml"]
    done = CliRunner().invoke(app, ["info", str(tmp_path / "out" / "left.yaml"), "--format", "opencv_yaml"])
    assert done.exit_code != 0


def test_they_are_no_formats_of_projects():
    assert set(FORMATS_OF_CAMERAS) == set(CAMERA_FORMATS)
    assert not set(FORMATS_OF_CAMERAS) & set(formats.FORMATS)
    with refused("format.unknown what=format value=mrcal"):
        formats.read(PROJECT, file_format="mrcal")
