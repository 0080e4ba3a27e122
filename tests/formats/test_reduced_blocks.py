"""PATB and BINGO: reduced photo coordinates, to the digits that their files have."""

import shutil

import numpy as np
import pytest
from block import sample, truth
from damaged import check_damaged

from photogram import Attitudes, InputError, adjust, formats
from photogram.formats import Wishes

FOCAL = {"A": 8.67, "B": 9.315}


def reduced(name):
    """Return the true photo coordinates of a photo's points in millimetres."""
    each = truth()["photos"][name]
    centre, matrix = np.array(each["centre"]), np.array(each["rotation"])
    points = {
        own["point"]: matrix @ (np.array(truth()["points"][own["point"]]["position"]) - centre)
        for own in truth()["observations"]
        if own["photo"] == name
    }
    c = FOCAL[each["camera"]]
    return {point: c * u[:2] / -u[2] for point, u in points.items()}


def check(project, image, position, attitude):
    block = project.block
    known = truth()["photos"]
    assert set(block.photo_ids) == set(known)
    matrices = Attitudes.of("omega_phi_kappa", block.photo_attitudes).values("matrix_to_photo")
    own = {name: reduced(name) for name in known}
    for row, name in enumerate(block.photo_ids):
        np.testing.assert_allclose(block.photo_positions[row], known[name]["centre"], atol=position)
        np.testing.assert_allclose(matrices[row], known[name]["rotation"], atol=attitude)
    for photo, point, xy in zip(block.image_photos, block.image_points, block.image_xy, strict=True):
        np.testing.assert_allclose(xy, own[block.photo_ids[photo]][block.point_ids[point]], atol=image)


def test_the_patb_sample_is_the_truth():
    project = formats.read(sample("patb"), None, Wishes(sd={"control": (0.02, 0.02, 0.03)}))
    check(project, 1e-7, 6e-6, 2e-12)
    assert int(np.count_nonzero(np.isfinite(project.block.point_sd).all(axis=1))) == 5
    assert any("first record" in str(each) for each in project.messages)
    assert adjust(project.block.replace(image_sd=0.001)).converged
    assert "only compared" in " ".join(formats.read(sample("patb")).lacks)


def test_the_bingo_sample_is_the_truth(tmp_path):
    cameras = tmp_path / "cameras.csv"
    cameras.write_text("camera,c\nA,8.67\nB,9.315\n")
    project = formats.read(sample("bingo"), None, Wishes(cameras=cameras))
    names = {str(101 + row): name for row, name in enumerate(truth()["photos"])}
    project = project.replace(
        block=project.block.replace(photo_ids=[names[name] for name in project.block.photo_ids])
    )
    check(project, 6e-8, 1e-6, 2e-10)
    with pytest.raises(InputError, match="--camera FILE"):
        formats.read(sample("bingo"))


def test_rotations_that_are_the_other_way_round_are_found(tmp_path):
    for each in sample("patb").iterdir():
        shutil.copy(each, tmp_path)
    project = formats.read(sample("patb"))
    lines = [" ".join(["101", "0", "0", "0"])]
    lines = []
    for row, name in enumerate(project.block.photo_ids):
        centre = project.block.photo_positions[row]
        matrix = Attitudes.of("omega_phi_kappa", project.block.photo_attitudes[[row]]).values(
            "matrix_to_photo"
        )[0]
        lines += [f"{name.replace(' ', '_')} {centre[0]} {centre[1]} {centre[2]}"]
        lines += [
            " ".join(map(repr, matrix.ravel()[:5].tolist())),
            " ".join(map(repr, matrix.ravel()[5:].tolist())),
        ]
    names = (tmp_path / "names.csv").read_text().replace(" ", "_")
    (tmp_path / "names.csv").write_text(names)
    (tmp_path / "orientation.ori").write_text("\n".join(lines) + "\n")
    other = formats.read(tmp_path)
    assert any("transposed" in str(each) for each in other.messages)
    np.testing.assert_allclose(other.block.photo_attitudes, project.block.photo_attitudes, atol=1e-9)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("image.im", "8670.000", "8.670", ["image.im", "record 1", "is the unit another one"]),
        ("image.im", "-1480.7692", "-1480,7692", ["record 2", "x: '-1480,7692' is not a number"]),
        (
            "orientation.ori",
            "0.998950838367",
            "0.598950838367",
            ["orientation.ori", "record 1", "no rotation matrix"],
        ),
        ("control.con", "-22.15520", "x", ["control.con", "record 1", "X: 'x'"]),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, file, old, new, words):
    for each in sample("patb").iterdir():
        text = each.read_text()
        assert each.name != file or old in text
        (tmp_path / each.name).write_text(text.replace(old, new, 1) if each.name == file else text)
    with pytest.raises(InputError) as refused:
        formats.read(tmp_path)
    for word in words:
        assert word in str(refused.value)


@pytest.mark.parametrize("seed", range(2))
def test_damaged_blocks_end_in_a_message(tmp_path, seed):
    assert check_damaged(sample("patb"), tmp_path, "patb", 150, seed) > 20
