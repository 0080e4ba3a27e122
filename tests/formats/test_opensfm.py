"""OpenSfM and OpenDroneMap: reconstructions, tracks of all versions, lists of control."""

import re
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

from message_codes import fields_of, raises, refused
from photogram import InputError, Position, adjust, formats
from photogram.formats import supplements
from photogram.formats.description import agreement
from photogram.formats.names import with_names


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
        "the use of control",
        "1 observations other than images, GNSS",
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


@pytest.mark.parametrize("file", ["gcp_list.txt", "ground_control_points.json"])
def test_control_points_have_names_of_their_own(tmp_path, file):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    project = formats.read(only(tmp_path / "model"))
    numbers = [name for name, own in names_by_position(project).items() if own.startswith("T")]
    text = sample("opensfm", file).read_text()
    control = sorted(set(re.findall(r"\b(?:GCP|CHK)-\d+\b", text)), key=len, reverse=True)
    new = dict(zip(control, numbers, strict=False))
    assert len(control) >= 5
    assert len(new) == len(control)
    (tmp_path / file).write_text(re.sub(r"\b(?:GCP|CHK)-\d+\b", lambda match: new[match[0]], text))
    named, alike = (
        supplements.with_control(project, path, {"control": (0.02,)}, None)
        for path in (sample("opensfm", file), tmp_path / file)
    )
    # The tracks with these numbers are other points, and all else is the same.
    tracks = {number: f"track {number}" for number in new.values()}
    assert alike.block.point_ids == [new.get(name, tracks.get(name, name)) for name in named.block.point_ids]
    np.testing.assert_array_equal(alike.block.image_points, named.block.image_points)
    np.testing.assert_array_equal(alike.block.point_positions, named.block.point_positions)
    np.testing.assert_array_equal(alike.starts, named.starts)
    [said] = [each for each in alike.messages if f"{len(new)} tracks" in each.text]
    assert said.file == tmp_path / file


def test_two_control_points_of_one_id_are_refused(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    text = sample("opensfm", "ground_control_points.json").read_text()
    (tmp_path / "gcp.json").write_text(text.replace("GCP-2", "GCP-1"))
    with pytest.raises(InputError, match="GCP-1"):
        supplements.with_control(
            formats.read(only(tmp_path / "model")), tmp_path / "gcp.json", {"control": (0.02,)}, None
        )


def test_a_control_point_that_was_measured_as_a_track_is_the_track(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    project = formats.read(only(tmp_path / "model"))
    number = next(name for name, own in names_by_position(project).items() if own == "GCP-1")
    text = sample("opensfm", "gcp_list.txt").read_text()
    (tmp_path / "gcp_list.txt").write_text(re.sub(r"\bGCP-1\b", number, text))
    found = supplements.with_control(project, tmp_path / "gcp_list.txt", {"control": (0.02,)}, None)
    row = project.block.point_ids.index(number)
    assert found.block.point_ids[row] == number
    assert (found.block.point_sd[row] == 0.02).all()


def test_a_track_that_a_user_names_is_the_control_point_of_this_name(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    place = only(tmp_path / "model")
    names = names_by_position(formats.read(place))
    number = next(name for name, own in names.items() if own == "GCP-1")
    first = "DJI_0001.JPG"
    # The track is measured in the first photo, the control point in the others.
    lines = (place / "tracks.csv").read_text().splitlines()
    rows = [line for line in lines if line.split("\t")[1:2] != [number] or line.startswith(first)]
    (place / "tracks.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "names.csv").write_text(f"point,name\n{number},GCP-1\n")
    head, *rest = sample("opensfm", "gcp_list.txt").read_text().splitlines()
    rest = [line for line in rest if line.endswith("GCP-1") and first not in line]
    (tmp_path / "gcp_list.txt").write_text("\n".join([head, *rest]) + "\n")
    named = with_names(formats.read(place), tmp_path / "names.csv")
    found = supplements.with_control(named, tmp_path / "gcp_list.txt", {"control": (0.02,)}, None)
    assert found.block.point_ids == named.block.point_ids
    assert len(found.block.image_xy) == len(named.block.image_xy) + len(rest)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda d: d[0]["shots"]["DJI_0001.JPG"].pop("rotation"),
            ["shots/DJI_0001.JPG: error.missing name=rotation"],
        ),
        (
            lambda d: d[0]["shots"]["DJI_0001.JPG"].update(camera="x"),
            ["DJI_0001.JPG/camera", "format.undefined what=camera name=x"],
        ),
        (
            lambda d: next(iter(d[0]["cameras"].values())).update(projection_type="dual"),
            ["projection_type: error.unknown.close kind=projection type name=dual"],
        ),
        (lambda d: next(iter(d[0]["cameras"].values())).update(width="x"), ["width: error.number value=x"]),
        (lambda d: d.clear(), ["format.missing what=a reconstruction"]),
        (
            lambda d: d[0]["points"]["0"].update(coordinates=[1, 2]),
            ["points/0/coordinates: error.count count=3 actual=2"],
        ),
    ],
)
def test_a_fault_is_named_with_its_path(tmp_path, change, words):
    place = only(tmp_path / "model")
    document = orjson.loads((place / "reconstruction.json").read_bytes())
    change(document)
    (place / "reconstruction.json").write_bytes(orjson.dumps(document))
    with refused("reconstruction.json", *words):
        formats.read(place)


def test_the_largest_of_several_models_is_taken(tmp_path):
    place = only(tmp_path / "opensfm")
    document = orjson.loads((place / "reconstruction.json").read_bytes())
    small = {**document[0], "shots": dict(list(document[0]["shots"].items())[:2])}
    (place / "reconstruction.json").write_bytes(orjson.dumps([small, document[0]]))
    project = formats.read(tmp_path)
    assert len(project.block.photo_ids) == 6
    names = ["2 photos", "6 photos"]
    assert fields_of(project.messages, "format.model-chosen") == {"n": 2, "names": names, "model": 1}
    one = formats.read(tmp_path, formats.ReadOptions(model=0))
    assert len(one.block.photo_ids) == 2
    assert any(each.code == "format.unknown-images" for each in one.messages)


@pytest.mark.parametrize("seed", range(3))
def test_damaged_models_end_in_a_message(tmp_path, seed):
    assert check_damaged(only(tmp_path / "model"), tmp_path / "damaged", "opensfm", 170, seed) > 20


def test_control_is_written_with_its_measurements(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    project = formats.read(sample("project"))
    assert "gcp_list.txt" in " ".join(formats.cannot_hold(project, "opensfm"))
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
    with raises(InputError, "block.repeated-image"):
        supplements.with_control(other, place / "gcp_list.txt", sd, None)


@pytest.mark.parametrize("command", ["info", "check"])
def test_a_reconstruction_without_tracks_is_told(run, tmp_path, command):
    assert run("convert", "--example", "opensfm").exit_code == 0
    (tmp_path / "opensfm" / "tracks.csv").unlink()
    done = run(command, "opensfm")
    assert "tracks.csv" in done.output.partition("Lacking")[2]
    assert re.search(r"photos +6 \(6 with a position\)\s+images +0", done.output)
    assert done.exit_code == (0 if command == "info" else 1)
    assert command == "info" or "block: must have image observations" in done.stderr
