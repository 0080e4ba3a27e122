"""AICON's text files: read, adjusted, and refused where they hold something else."""

import numpy as np
import pytest
from damaged import check_damaged

from message_codes import fields_of, refused
from photogram import Camera, Distance, InnerConstraints, adjust, formats, simulate

VALUES = {"c": -28.785, "xp": 0.017, "yp": 0.057, "A1": -1.1e-4, "A2": 1.5e-7, "A3": 1e-10}
VALUES |= {"B1": 5.8e-6, "B2": -8.6e-6, "C1": -7e-5, "C2": -3e-5, "r0": 13.488}


@pytest.fixture(scope="module")
def block():
    return block_of_tests()


def block_of_tests():
    """Return a block of our own with such a camera, and a scale bar."""
    made = simulate(
        strips=2,
        photos_per_strip=3,
        points_per_photo=12,
        frame_size=24.0,
        principal_distance=-28.785,
        flying_height=1500.0,
        relief=200.0,
        cameras=[Camera("brown_forward", VALUES, name="camera 1")],
        image_sd=0.0005,
        position_error=2.0,
        check_points=0,
    )
    points = made.truth.point_positions
    bar = Distance(*made.block.point_ids[:2], float(np.linalg.norm(points[1] - points[0])), 0.01)
    return made.block.replace(point_positions=points, point_sd=np.inf, observations=[bar])


@pytest.fixture
def files(block, tmp_path):
    """Return the folder with the five files of the block."""
    return write_files(block, tmp_path)


def write_files(block, folder):
    """Write the five files of a block."""
    v = VALUES
    lines = {
        "ior": [
            f"1 -999 {v['c']} {v['xp']} {v['yp']} {v['A1']:.5e} {v['A2']} {v['r0']}",
            f"        {v['A3']}",
            f"        {v['B1']} {v['B2']}",
            f"        {v['C1']} {v['C2']}",
            "        24.0 24.0 6000 6000",
        ],
        "eor": [
            " ".join([str(row + 1), "1", *map(repr, [*position, *angles]), "0 307 3"])
            for row, (position, angles) in enumerate(
                zip(block.photo_positions.tolist(), block.photo_attitudes.tolist(), strict=True)
            )
        ],
        "obc": [
            " ".join([name, *map(repr, position), "0.003 0.003 0.003 5 1 1 0"])
            for name, position in zip(block.point_ids, block.point_positions.tolist(), strict=True)
        ],
        "phc": [
            " ".join([str(photo + 1), block.point_ids[point], *map(repr, xy), "0.0005 0.0005 0 0 1 1 1"])
            for photo, point, xy in zip(
                block.image_photos.tolist(),
                block.image_points.tolist(),
                block.image_xy.tolist(),
                strict=True,
            )
        ],
        "scale": [
            f'0 "A bar" {bar.points[0]} {bar.points[1]} {float(bar.observed[0])!r} 0.01 1'
            for bar in block.observations
        ],
    }
    for suffix, own in lines.items():
        (folder / f"job.{suffix}").write_text("\n".join(["# comment", *own]) + "\n")
    return folder


def changed(files, suffix, old, new, count=1):
    """Replace words of a file."""
    path = files / f"job.{suffix}"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, count))


def test_the_files_are_the_block_and_adjust_to_the_same(block, files):
    project = formats.read(files)
    assert project.title == "AICON block"
    assert (project.sizes, project.pixel_mm) == (((6000, 6000),), (0.004,))
    own = project.block
    assert own.cameras[0].parameters == VALUES
    np.testing.assert_array_equal(own.image_xy, block.image_xy)
    assert [each.KIND for each in own.observations] == ["distance"]
    mine, theirs = (
        adjust(
            each.replace(point_positions=np.full_like(each.point_positions, np.nan)),
            datum=InnerConstraints(),
            tolerance=1e-10,
        )
        for each in (own, block)
    )
    assert mine.degrees_of_freedom == theirs.degrees_of_freedom
    np.testing.assert_allclose(mine.sums_of_squares.total, theirs.sums_of_squares.total, rtol=1e-9)


def test_the_sign_of_c_is_told_as_the_file_has_it(files, run):
    told = run("info", files)
    assert told.exit_code == 0, told.output
    assert "c is -28.785" in " ".join(told.output.split())
    assert "the principal distance is 28.785 mm" in told.output
    changed(files, "ior", " -28.785", " 28.785")
    project = formats.read(files / "job.phc")
    assert project.block.cameras[0].parameters["c"] == -28.785
    assert fields_of(project.messages, "aicon.principal-distance")["value"] == 28.785


def test_what_is_not_active_is_left_out_and_what_is_not_new_is_control(block, files):
    name = block.point_ids[0]
    changed(files, "obc", "0.003 0.003 0.003 5 1 1 0", "0.01 0.02 0.03 5 1 0 0")
    changed(files, "eor", "0 307 3", "0 0 3")
    project = formats.read(files)
    row = project.block.point_ids.index(name)
    np.testing.assert_array_equal(project.block.point_sd[row], [0.01, 0.02, 0.03])
    assert len(project.block.photo_ids) == len(block.photo_ids) - 1
    assert any("1 photos are not active" in str(each) for each in project.messages)
    assert not project.lacks


@pytest.mark.parametrize(
    ("suffix", "old", "new", "message"),
    [
        ("ior", "24.0 24.0 6000 6000", "24.0 24.0 6000.5 6000", "aicon.camera name=1"),
        ("ior", "        24.0 24.0 6000 6000", "", "format.end name=width"),
        ("eor", "0 307 3", "1 307 3", "aicon.order"),
        ("eor", "2 1 ", "2 9 ", "format.undefined what=camera name=9"),
        ("phc", " 0.0005 0.0005", " x 0.0005", "sx"),
        ("scale", "0.01 1", "0 1", "aicon.length"),
    ],
)
def test_lines_at_fault_are_named(files, suffix, old, new, message):
    changed(files, suffix, old, new)
    with refused(message) as caught:
        formats.read(files)
    assert caught.value.file.name == f"job.{suffix}"


def test_cameras_must_lie_beside(files):
    (files / "job.ior").unlink()
    with refused("format.files name=*.ior"):
        formats.read(files)


def test_a_link_that_leads_nowhere_is_an_error_of_ours(files):
    images = files / "job.phc"
    images.unlink()
    images.symlink_to("nowhere")
    with refused("format.files name=*.phc"):
        formats.read(files)


def test_damaged_files_end_in_errors_of_ours(files, tmp_path):
    source = tmp_path / "whole"
    source.mkdir()
    for each in files.glob("job.*"):
        each.rename(source / each.name)
    assert check_damaged(source, tmp_path / "damaged", None, 60, 1) > 10
