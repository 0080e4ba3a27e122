"""Principal distances in tables of cameras: millimetres by `pixel_mm`, and those that are too small."""

import numpy as np
import pytest

from photogram import InputError, formats
from photogram.formats import ReadOptions


def read(folder, reader, cameras, image="px"):
    """Read a table of cameras as part of a project, or by `--camera` beside a table of pixels."""
    (folder / "cameras.csv").write_text(cameras)
    if reader == "pixels":
        (folder / "measured.csv").write_text("photo,point,column,row\na,1,100,200\nb,1,120,210\n")
        return formats.read(folder / "measured.csv", ReadOptions(cameras=folder / "cameras.csv"))
    (folder / "project.toml").write_text(f'[project]\nformat = 1\n[units]\nimage = "{image}"\n')
    (folder / "photos.csv").write_text("photo\na\nb\n")
    (folder / "images.csv").write_text("photo,point,x,y\na,1,100,200\nb,1,120,210\n")
    return formats.read(folder)


BOTH = pytest.mark.parametrize("reader", ["plain", "pixels"])


@BOTH
def test_millimetres_are_converted_by_the_pixel(tmp_path, reader):
    head = "camera,width,height,pixel_mm,c,xp,K1,sd_c\n"
    project = read(tmp_path, reader, f"{head}A,5472,3648,0.0024,8.8,0.024,1e-5,0.012\n")
    [camera] = project.block.cameras
    assert camera.unit == "px"
    assert camera.parameters["c"] == pytest.approx(-8.8 / 0.0024)
    assert camera.parameters["xp"] == pytest.approx(10.0)
    assert camera.parameters["K1"] == pytest.approx(1e-5 * 0.0024**2)
    assert dict(zip(camera.names, camera.deviations, strict=True))["c"] == pytest.approx(5.0)
    [said] = [each for each in project.messages if "pixel_mm" in each.text]
    assert said.file == tmp_path / "cameras.csv"


@BOTH
def test_pixels_with_the_side_of_a_pixel_stay_pixels(tmp_path, reader):
    table = "camera,width,height,pixel_mm,c\nA,5472,3648,0.0024,3700\n"
    project = read(tmp_path, reader, table)
    assert project.block.cameras[0].parameters["c"] == -3700.0
    assert not any("pixel_mm" in each.text for each in project.messages)


@BOTH
@pytest.mark.parametrize("model", ["opencv_fisheye", "radial_fisheye"])
def test_a_tenth_of_the_width_is_large_enough(tmp_path, reader, model):
    project = read(tmp_path, reader, f"camera,model,width,height,f\nA,{model},4000,3000,400\n")
    values = project.block.cameras[0].parameters
    assert values.get("f", values.get("fx")) == 400.0


@BOTH
@pytest.mark.parametrize(
    ("columns", "row", "column", "words"),
    [
        ("width,height,c", "5472,3648,8.8", "c", ["8.8 px", "547.2 px", "pixel_mm"]),
        ("width,height,f", "5472,3648,-8.8", "f", ["-8.8 px", "547.2 px", "pixel_mm"]),
        ("width,height,fx,fy", "5472,3648,3600,36", "fy", ["36 px"]),
        ("width,height,pixel_mm,c", "5472,3648,0.0024,0.0088", "c", ["0.0088 px"]),
        ("width,height,pixel_mm,f,cx,cy", "5472,3648,0.0022,8.8,2736,1824", "f", ["8.8 px", "4000 px"]),
    ],
)
def test_a_small_principal_distance_is_rejected(tmp_path, reader, columns, row, column, words):
    with pytest.raises(InputError) as refused:
        read(tmp_path, reader, f"camera,{columns}\nA,{row}\n")
    assert refused.value.file == tmp_path / "cameras.csv"
    assert refused.value.record == 2
    for word in (f"column {column}:", *words):
        assert word in refused.value.message


def test_lengths_in_millimetres_have_no_covariances(tmp_path):
    (tmp_path / "covariances.csv").write_text(
        "kind,name,first,second,covariance\ncamera,A,c,c,4\ncamera,A,K1,K1,1e-12\n"
    )
    with pytest.raises(InputError, match="camera A has lengths in mm, but its covariances must be in px"):
        read(tmp_path, "plain", "camera,width,height,pixel_mm,c,K1\nA,5472,3648,0.0024,8.8,1e-5\n")


@pytest.mark.parametrize(("image", "c"), [("mm", "0.0088"), ("um", "8.8")])
def test_it_is_rejected_in_the_unit_of_images(tmp_path, image, c):
    table = "camera,width,height,pixel_mm,c\nA,5472,3648,0.0024,{}\n"
    with pytest.raises(InputError, match=rf"column c: .* {image} must be at least"):
        read(tmp_path, "plain", table.format(c), image)
    found = read(tmp_path, "plain", table.format(float(c) * 1000), image)
    np.testing.assert_allclose(found.block.cameras[0].parameters["c"], -8.8)
