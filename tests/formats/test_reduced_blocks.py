"""PATB and BINGO: reduced photo coordinates, to the digits that their files have."""

import shutil

import numpy as np
import pytest
from block import sample, truth
from damaged import check_damaged
from test_plain_project import written

from message_codes import refused
from photogram import Attitudes, Camera, InputError, adjust, formats
from photogram.formats import ReadOptions, supplements
from photogram.network.rays import image_directions

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
    project = formats.read(sample("patb"), ReadOptions(sd={"control": (0.02, 0.02, 0.03)}))
    check(project, 1e-7, 6e-6, 2e-12)
    assert int(np.count_nonzero(np.isfinite(project.block.point_sd).all(axis=1))) == 5
    assert any("first record" in str(each) for each in project.messages)
    assert adjust(project.block.replace(image_sd=0.001)).converged
    assert "read.control" in {each.code for each in formats.read(sample("patb")).lacks}


def test_the_bingo_sample_is_the_truth(tmp_path):
    cameras = tmp_path / "cameras.csv"
    cameras.write_text("camera,c\nA,8.67\nB,9.315\n")
    project = formats.read(sample("bingo"), ReadOptions(cameras=cameras))
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
    assert any(each.code == "reduced.transposed" for each in other.messages)
    np.testing.assert_allclose(other.block.photo_attitudes, project.block.photo_attitudes, atol=1e-9)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("image.im", "8670.000", "8.670", ["image.im", "record 1", "reduced.distance"]),
        ("image.im", "-1480.7692", "-1480,7692", ["record 2", "x: error.number value=-1480,7692"]),
        (
            "orientation.ori",
            "0.998950838367",
            "0.598950838367",
            ["orientation.ori", "record 1", "format.rotation"],
        ),
        ("control.con", "-22.15520", "x", ["control.con", "record 1", "X: error.number value=x"]),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, file, old, new, words):
    for each in sample("patb").iterdir():
        text = each.read_text()
        assert each.name != file or old in text
        (tmp_path / each.name).write_text(text.replace(old, new, 1) if each.name == file else text)
    with refused(*words):
        formats.read(tmp_path)


SD = ReadOptions(sd={"control": (0.02, 0.02, 0.03)})


def pinholes():
    """Return the sample as exact pinhole cameras see it, with names that are no words and noise."""
    project = formats.read(sample("project"))
    block = project.block
    cameras = [
        Camera("pinhole", {"fx": f, "fy": f, "cx": w / 2, "cy": h / 2}, name=name)
        for name, f, w, h in (("A", 3612.5, 4000, 3000), ("B", 3105.0, 3000, 4000))
    ]
    directions = image_directions(block)
    own = block.photo_cameras[block.image_photos]
    f = np.array([3612.5, 3105.0])[own, np.newaxis]
    middle = np.array([[2000.0, 1500.0], [1500.0, 2000.0]])[own]
    noise = np.random.default_rng(4).normal(0, 0.3, block.image_xy.shape)
    xy = middle + f * directions[:, :2] / -directions[:, 2:] * [1, -1] + noise
    return project.replace(
        block=block.replace(cameras=cameras, image_xy=xy, image_sd=0.3, observations=()),
        pixel_mm=(0.0024, 0.003),
    )


def compared(one, two):
    """Return the largest difference of positions of photos and points in standard deviations."""
    photos = [two.block.photo_ids.index(name) for name in one.block.photo_ids]
    points = [two.block.point_ids.index(name) for name in one.block.point_ids]
    a = np.abs(two.photo_positions[photos] - one.photo_positions) / one.photo_sd[:, :3]
    b = np.abs(two.point_positions[points] - one.point_positions) / one.point_sd
    return max(a.max(), np.nanmax(b))


def with_own_sd(project, pixels=(0.0024, 0.003)):
    """Return a block of reduced coordinates with the standard deviations of its pixels."""
    block = project.block
    sides = np.array(pixels)[block.photo_cameras[block.image_photos]]
    return block.replace(image_sd=0.3 * np.column_stack([sides, sides]))


def test_bingo_keeps_all_digits(tmp_path):
    project = pinholes()
    lost = " ".join(formats.cannot_hold(project, "bingo"))
    for word in ("standard deviations", "underscores", "control.csv"):
        assert word in lost
    place = written(project, tmp_path, "bingo")
    other = formats.read(place)
    names = {name.replace(" ", "_"): name for name in project.block.photo_ids}
    other = supplements.with_control(other, place / "control.csv", {}, None)
    block = with_own_sd(other).replace(photo_ids=[names[name] for name in other.block.photo_ids])
    one, two = adjust(project.block, tolerance=1e-10), adjust(block, tolerance=1e-10)
    assert compared(one, two) < 1e-9
    np.testing.assert_allclose(two.photo_sd, one.photo_sd, rtol=1e-8)


def test_patb_keeps_the_digits_that_are_stated(tmp_path):
    project = pinholes()
    lost = " ".join(formats.cannot_hold(project, "patb"))
    assert "image coordinates have 1e-4 micrometres, positions 1e-5" in lost
    place = written(project, tmp_path, "patb")
    assert [len(line) for line in (place / "block.ori").read_text().splitlines()[:3]] == [80, 80, 64]
    other = formats.read(place, SD)
    assert other.block.photo_ids == project.block.photo_ids
    assert sorted(other.block.point_ids) == sorted(project.block.point_ids)
    assert len(other.checks) == len(project.checks) == 2
    one, two = adjust(project.block, tolerance=1e-10), adjust(with_own_sd(other), tolerance=1e-10)
    # 1e-4 micrometres are 1.4e-4 of the standard deviations of these images.
    assert 1e-9 < compared(one, two) < 5e-4


@pytest.mark.parametrize("file_format", ["patb", "bingo"])
def test_distorted_cameras_are_written_as_their_rays(tmp_path, file_format):
    project = formats.read(sample("project"))
    assert "lenses" in " ".join(formats.cannot_hold(project, file_format))
    other = formats.read(written(project, tmp_path, file_format)).block
    block = project.block
    assert len(other.image_xy) == len(block.image_xy)
    np.testing.assert_array_equal(other.image_photos, block.image_photos)
    # Half of the last digit over the principal distance.
    limit = 1e-14 if file_format == "bingo" else 0.6e-7 / 8.67
    np.testing.assert_allclose(image_directions(other), image_directions(block), rtol=0, atol=limit)


def test_pixels_without_a_size_have_a_principal_distance_of_their_own(tmp_path):
    project = pinholes().replace(pixel_mm=(None, 0.003))
    assert "the principal distance is 100 mm" in " ".join(formats.cannot_hold(project, "patb"))
    other = formats.read(written(project, tmp_path, "patb")).block
    assert [each.parameters["c"] for each in other.cameras] == [-100.0, -9.315]


def test_heights_alone_are_control_of_patb(tmp_path):
    project = pinholes()
    block = project.block
    held = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[:2]
    positions, sd = block.point_positions.copy(), block.point_sd.copy()
    positions[held, :2], sd[held, :2] = np.nan, np.inf
    partly = project.replace(block=block.replace(point_positions=positions, point_sd=sd))
    other = formats.read(written(partly, tmp_path, "patb"), SD)
    for row in held:
        own = other.block.point_ids.index(block.point_ids[row])
        np.testing.assert_array_equal(np.isfinite(other.block.point_sd[own]), [False, False, True])
        np.testing.assert_array_equal(np.isfinite(other.block.point_positions[own]), [False, False, True])


def test_names_that_are_no_words_of_bingo_are_refused():
    project = pinholes()
    names = list(project.block.photo_ids)
    twins = [names[0], names[0].replace("_", " "), *names[2:]]
    with refused("bingo.blanks"):
        formats.to_files(project.replace(block=project.block.replace(photo_ids=twins)), "bingo")
    with refused("bingo.reserved name=-99"):
        formats.to_files(project.replace(block=project.block.replace(photo_ids=["-99", *names[1:]])), "bingo")


@pytest.mark.parametrize("seed", range(2))
def test_damaged_blocks_end_in_a_message(tmp_path, seed):
    assert check_damaged(sample("patb"), tmp_path, "patb", 250, seed) > 20


def test_damaged_bingo_blocks_end_in_a_message(tmp_path):
    cameras = tmp_path / "cameras.csv"
    cameras.write_text("camera,c\nA,8.67\nB,9.315\n")
    assert check_damaged(sample("bingo"), tmp_path, "bingo", 500, 4, ReadOptions(cameras=cameras)) > 50
