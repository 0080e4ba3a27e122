"""OpenSfM and OpenDroneMap: reconstructions, tracks of all versions, lists of control."""

import shutil

import numpy as np
import orjson
import pytest
from block import (
    check_adjustment,
    check_poses,
    names_by_position,
    same_blocks,
    sample,
    truth,
    with_control,
    with_noise,
)
from damaged import check_damaged
from test_plain_project import EXAMPLE, written

from photogram import InputError, Position, adjust, formats
from photogram.formats import supplements
from photogram.formats.self_check import agreement


def only(place, tracks="tracks.csv"):
    """Copy the files of the reconstruction, with one of the tables of tracks."""
    place.mkdir()
    shutil.copy(sample("opensfm", "reconstruction.json"), place)
    shutil.copy(sample("opensfm", tracks), place / "tracks.csv")
    return place


@pytest.mark.parametrize("tracks", ["tracks.csv", "tracks_v0.csv", "tracks_v1.csv"])
def test_the_sample_is_the_truth_and_comes_out_as_the_dense_adjustment(tmp_path, tracks):
    project = formats.read(only(tmp_path / "model", tracks))
    check_poses(project.block, truth()["photos"])
    assert agreement(project).median < 1e-9
    assert [each.model for each in project.block.cameras] == ["full_opencv", "full_opencv"]
    positions = [each for each in project.block.observations if isinstance(each, Position)]
    assert len(positions) == 6
    np.testing.assert_allclose(positions[0].precision, np.eye(3) * 0.05**2)
    assert project.frame.origin == (47.38, 8.54, 450.0)
    names = names_by_position(project)
    check_adjustment(with_control(with_noise(project, names), names), names)


def test_a_round_trip_keeps_all_but_deviations(tmp_path):
    project = formats.read(only(tmp_path / "model"))
    other = formats.read(written(project, tmp_path / "there", "opensfm"))
    same_blocks(project.block, other.block, 1e-9)
    np.testing.assert_array_equal(other.starts, project.starts)
    assert other.frame == project.frame
    example = formats.read(EXAMPLE)
    again = formats.read(written(example, tmp_path / "example", "opensfm"))
    block = (
        again.block.replace(
            image_sd=0.5,
            point_positions=example.block.point_positions,
            point_sd=example.block.point_sd,
            observations=example.block.observations,
        )
        if again.block.point_ids == example.block.point_ids
        else None
    )
    assert block is not None
    one, two = adjust(example.block, tolerance=1e-9), adjust(block, tolerance=1e-9)
    assert (np.abs(two.point_positions - one.point_positions) < 1e-8 * one.point_sd).all()
    lost = " ".join(formats.cannot_hold(example, "opensfm"))
    for word in (
        "standard deviations",
        "what control is",
        "1 observations beside images and GPS",
        "the frame",
    ):
        assert word in lost


@pytest.mark.parametrize("file", ["gcp_list.txt", "gcp_list_wgs84.txt", "ground_control_points.json"])
def test_lists_of_control_come_with_their_measurements(tmp_path, file):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    project = formats.read(only(tmp_path / "model"))
    found = supplements.with_control(project, sample("opensfm", file), {"control": (0.02,)}, None)
    block = found.block
    known = truth()
    rows = {name: row for row, name in enumerate(block.point_ids)}
    seen = {
        (block.photo_ids[photo], block.point_ids[point]): xy
        for photo, point, xy in zip(block.image_photos, block.image_points, block.image_xy, strict=True)
    }
    control = [name for name, each in known["points"].items() if each["role"] != "tie" and name in rows]
    assert len(control) >= 5
    for name in control:
        np.testing.assert_allclose(
            block.point_positions[rows[name]], known["points"][name]["position"], atol=2e-8
        )
        for each in known["observations"]:
            if each["point"] == name:
                own = seen[each["photo"], name]
                np.testing.assert_allclose(own, [each["column"], each["row"]], atol=1e-9)
    # Standard deviations that differ are along the axes of the list's system: full covariances in the frame.
    turned = supplements.with_control(
        project, sample("opensfm", file), {"control": (0.02, 0.02, 0.03)}, None
    ).block
    full = [each for each in turned.observations if each.KIND == "control"]
    assert len(full) == len(control)
    np.testing.assert_allclose(full[0].precision, np.diag([4e-4, 4e-4, 9e-4]), atol=1e-7)
    assert adjust(turned.replace(observations=full)).converged


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda d: d[0]["shots"]["DJI_0001.JPG"].pop("rotation"),
            ["shots/DJI_0001.JPG", "rotation is missing"],
        ),
        (
            lambda d: d[0]["shots"]["DJI_0001.JPG"].update(camera="x"),
            ["DJI_0001.JPG/camera", "no camera 'x'"],
        ),
        (
            lambda d: next(iter(d[0]["cameras"].values())).update(projection_type="dual"),
            ["projection type 'dual'"],
        ),
        (lambda d: next(iter(d[0]["cameras"].values())).update(width="x"), ["width", "is no number"]),
        (lambda d: d.clear(), ["holds no reconstruction"]),
        (
            lambda d: d[0]["points"]["0"].update(coordinates=[1, 2]),
            ["points/0/coordinates", "2 numbers, not 3"],
        ),
    ],
)
def test_a_fault_is_named_with_its_path(tmp_path, change, words):
    place = only(tmp_path / "model")
    document = orjson.loads((place / "reconstruction.json").read_bytes())
    change(document)
    (place / "reconstruction.json").write_bytes(orjson.dumps(document))
    with pytest.raises(InputError) as refused:
        formats.read(place)
    for word in ("reconstruction.json", *words):
        assert word in str(refused.value)


def test_the_largest_of_several_models_is_taken(tmp_path):
    place = only(tmp_path / "opensfm")
    document = orjson.loads((place / "reconstruction.json").read_bytes())
    small = {**document[0], "shots": dict(list(document[0]["shots"].items())[:2])}
    (place / "reconstruction.json").write_bytes(orjson.dumps([small, document[0]]))
    project = formats.read(tmp_path)
    assert len(project.block.photo_ids) == 6
    assert any("2 reconstructions: 0 with 2 photos, 1 with 6" in str(each) for each in project.messages)
    one = formats.read(tmp_path, None, formats.Wishes(model=0))
    assert len(one.block.photo_ids) == 2
    assert any("observations are of photos or points" in str(each) for each in one.messages)


@pytest.mark.parametrize("seed", range(3))
def test_damaged_models_end_in_a_message(tmp_path, seed):
    assert check_damaged(only(tmp_path / "model"), tmp_path / "damaged", "opensfm", 170, seed) > 20


def test_control_is_written_with_its_measurements(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    project = formats.read(sample("project"))
    assert "gcp_list.txt beside it" in " ".join(formats.cannot_hold(project, "opensfm"))
    place = written(project, tmp_path, "opensfm")
    lines = (place / "gcp_list.txt").read_text().splitlines()
    assert lines[0] == "WGS84"
    other = formats.read(place)
    count = len(other.block.image_xy)
    sd = {"control": (0.02, 0.02, 0.03)}
    found = supplements.with_control(other, place / "gcp_list.txt", sd, None).block
    # Its measurements are those of the tracks.
    assert len(found.image_xy) == count
    control = {each.point: each for each in found.observations if each.KIND == "control"}
    known = truth()["points"]
    assert set(control) == {name for name, each in known.items() if each["role"] in ("control", "check")}
    for name, each in control.items():
        np.testing.assert_allclose(each.observed, known[name]["position"], rtol=0, atol=2e-8)
    first = lines[1].split()
    moved = [*first[:3], repr(float(first[3]) + 1.0), *first[4:]]
    (tmp_path / "gcp_list.txt").write_text("\n".join([lines[0], " ".join(moved), *lines[2:]]) + "\n")
    with pytest.raises(InputError, match="has two images on the photo"):
        supplements.with_control(other, place / "gcp_list.txt", sd, None)


@pytest.mark.parametrize("command", ["info", "check"])
def test_a_reconstruction_without_tracks_is_told(run, tmp_path, command):
    assert run("convert", "--example", "opensfm").exit_code == 0
    (tmp_path / "opensfm" / "tracks.csv").unlink()
    done = run(command, "opensfm")
    assert "no tracks.csv beside it: no image measurements" in done.output
    assert "6 photos, 6 with a position; 0 images" in done.output
    assert done.exit_code == (0 if command == "info" else 1)
    assert command == "info" or "the block has no images: there is nothing to check" in done.stderr
