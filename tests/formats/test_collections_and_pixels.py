"""Bundler, BAL, tables of pixels and GIANT as projects."""

import numpy as np
import pytest
from block import check_poses, same_blocks, sample, truth
from damaged import check_damaged
from test_plain_project import EXAMPLE, written

from message_codes import has_code, refused
from photogram import InputError, adjust, formats
from photogram.formats import ReadOptions
from photogram.formats.description import agreement

GALVESTON = EXAMPLE.parent / "galveston"


@pytest.mark.parametrize("name", ["bundler", "bal"])
def test_the_samples_are_the_truth(name):
    project = formats.read(sample("bundler") if name == "bundler" else sample("bal", "problem-6-40.txt"))
    assert agreement(project).median < 1e-9
    if name == "bundler":
        check_poses(project.block, truth()["photos"])
    centres = [each["centre"] for each in truth()["photos"].values()]
    np.testing.assert_allclose(project.block.photo_positions, centres, atol=1e-10)
    positions = [each["position"] for each in truth()["points"].values()]
    np.testing.assert_allclose(project.starts, positions, atol=1e-10)


@pytest.mark.parametrize("name", ["bundler", "bal"])
def test_a_round_trip_keeps_the_geometry(tmp_path, name):
    project = formats.read(EXAMPLE)
    assert "reduced to a camera without distortion" in " ".join(formats.cannot_hold(project, name))
    place = written(project, tmp_path / "there", name)
    other = formats.read(place if name == "bundler" else place / "problem.txt")
    np.testing.assert_allclose(other.block.photo_positions, project.block.photo_positions, atol=1e-10)
    assert agreement(other).median == pytest.approx(agreement_of_all(project), rel=0.1)
    again = written(other, tmp_path / "again", name)
    same_blocks(other.block, formats.read(again if name == "bundler" else again / "problem.txt").block, 1e-11)


def agreement_of_all(project):
    """Return the median residual with all points intersected."""
    from photogram.formats.models import complete_positions

    return agreement(project.replace(starts=complete_positions(project))).median


@pytest.mark.parametrize(("file", "origin"), [("images.csv", None), ("images_variant.txt", "center")])
def test_tables_of_pixels_are_the_truth(tmp_path, file, origin):
    cameras = sample("project", "cameras.csv")
    table = sample("pixels", file)
    one = tmp_path / "camera.csv"
    lines = cameras.read_text().splitlines()
    one.write_text("\n".join(lines[:2]) + "\n")
    project = formats.read(table, ReadOptions(cameras=one, pixel_origin=origin))
    known = {(each["photo"], each["point"]): each for each in truth()["observations"]}
    block = project.block
    assert len(block.image_xy) == len(known)
    for photo, point, xy in zip(block.image_photos, block.image_points, block.image_xy, strict=True):
        own = known[block.photo_ids[photo], block.point_ids[point]]
        np.testing.assert_allclose(xy, [own["column"], own["row"]], atol=1e-9)
    with refused("format.cameras"):
        formats.read(table)


def test_a_table_of_pixels_says_what_is_not_used(tmp_path):
    lines = sample("pixels", "images.csv").read_text().splitlines()
    first = next(row for row, line in enumerate(lines) if not line.startswith("#"))
    marked = [f"{line},{'no' if row == 3 else ''}" for row, line in enumerate(lines[first + 1 :])]
    path = tmp_path / "images.csv"
    path.write_text("\n".join([f"{lines[first]},use", *marked]) + "\n")
    (tmp_path / "camera.csv").write_text("camera,width,height,f\nA,4000,3000,3600\n")
    project = formats.read(path, ReadOptions(cameras=tmp_path / "camera.csv"))
    assert len(project.block.image_xy) == len(marked) - 1
    assert any(has_code(each, "pixels.unused", n=1) for each in project.messages)


def test_pixels_and_control_alone_make_a_block(run, tmp_path):
    written(formats.read(EXAMPLE), tmp_path / "table", "pixels")
    words = [
        "--camera",
        EXAMPLE / "cameras.csv",
        "--control",
        EXAMPLE / "control.csv",
        "--sd",
        "control=0.01",
    ]
    done = run("adjust", "table/images.csv", *words)
    assert done.exit_code == 0, done.output
    assert "table of pixels" in done.output
    assert "no control" not in done.output
    assert "oriented" in done.output or "resected" in done.output
    after = formats.read(tmp_path / "table" / "images-adjusted" / "adjusted")
    project = formats.read(EXAMPLE)
    rows = [after.block.photo_ids.index(name) for name in project.block.photo_ids]
    np.testing.assert_allclose(after.block.photo_positions[rows], project.block.photo_positions, atol=0.3)


def test_giant_projects_come_in_and_go_out(run, tmp_path):
    project = formats.read(GALVESTON)
    assert project.title == "GIANT project"
    place = written(project, tmp_path / "there", "giant")
    other = formats.read(place)
    np.testing.assert_allclose(other.block.image_xy, project.block.image_xy, atol=1e-5)
    project = project.replace(block=project.block.replace(refraction=None))
    plain = formats.read(written(project, tmp_path / "plain"))
    one, two = adjust(project.block, tolerance=1e-9), adjust(plain.block, tolerance=1e-9)
    order = [plain.block.point_ids.index(name) for name in project.block.point_ids]
    np.testing.assert_allclose(two.point_positions[order], one.point_positions, rtol=1e-13, atol=1e-6)
    assert two.variance_of_unit_weight == pytest.approx(one.variance_of_unit_weight, rel=1e-9)
    with pytest.raises(InputError):
        formats.to_files(formats.read(EXAMPLE), "giant")
    assert "the project:" in formats.cannot_hold(formats.read(EXAMPLE), "giant")[0]


@pytest.mark.parametrize(
    ("name", "source"), [("bundler", ("bundler",)), ("bal", ("bal", "problem-6-40.txt"))]
)
def test_damaged_collections_end_in_a_message(tmp_path, name, source):
    assert check_damaged(sample(*source), tmp_path, name, 500, 1) > 100


def test_damaged_tables_of_pixels_end_in_a_message(tmp_path):
    lines = sample("project", "cameras.csv").read_text().splitlines()
    (tmp_path / "camera.csv").write_text("\n".join(lines[:2]) + "\n")
    options = ReadOptions(cameras=tmp_path / "camera.csv")
    assert check_damaged(sample("pixels", "images.csv"), tmp_path, "pixels", 500, 2, options) > 50


def test_damaged_giant_projects_end_in_a_message(tmp_path):
    assert check_damaged(GALVESTON, tmp_path, "giant", 500, 3) > 50
