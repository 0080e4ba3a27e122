"""COLMAP models: text and binary, rigs and frames, against the package itself where it is installed."""

import json
import struct

import numpy as np
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

from message_codes import refused
from photogram import Attitudes, Camera, InnerConstraints, adjust, formats
from photogram.formats.colmap.files import MODELS
from photogram.formats.description import agreement


@pytest.mark.parametrize("dress", ["text", "text_legacy", "binary"])
def test_the_sample_is_the_truth_and_comes_out_as_the_dense_adjustment(dress):
    project = formats.read(sample("colmap", dress))
    check_poses(project.block, truth()["photos"])
    names = names_by_position(project)
    known = {(each["photo"].replace(" ", "_"), each["point"]): each for each in truth()["observations"]}
    block = project.block
    for photo, point, xy in zip(block.image_photos, block.image_points, block.image_xy, strict=True):
        own = known[block.photo_ids[photo].replace(" ", "_"), names[block.point_ids[point]]]
        np.testing.assert_allclose(xy, [own["column"], own["row"]], rtol=0, atol=1e-9)
    assert agreement(project).median < 1e-9
    assert [each.model for each in block.cameras] == ["full_opencv", "radial"]
    assert ("colmap.pointless", 13) in [(each.code, each.phrase.fields.get("n")) for each in project.messages]
    check_adjustment(with_control(with_noise(project, names), names), names)


@pytest.mark.parametrize("dress", ["rig_text", "rig_binary"])
def test_the_sample_with_a_rig_has_its_frames(dress):
    project = formats.read(sample("colmap", dress))
    known = truth("colmap", "truth_rig.json")
    check_poses(project.block, known["photos"])
    assert len(project.block.mounts) == 3
    assert len({id(each.sensor) for each in project.block.mounts}) == 1
    assert agreement(project).median < 1e-9
    free = adjust(project.block.replace(image_sd=1.0), datum=InnerConstraints())
    assert free.converged
    assert free.unknowns[0].kind == "sensor"


@pytest.mark.parametrize("dress", ["text", "binary", "rig_text", "rig_binary"])
@pytest.mark.parametrize("target", ["colmap", "colmap_text"])
def test_a_round_trip_keeps_all_but_features_without_point(tmp_path, dress, target):
    project = formats.read(sample("colmap", dress))
    other = formats.read(written(project, tmp_path / "there", target))
    if target == "colmap_text":
        other = (
            other.replace(
                block=other.block.replace(
                    photo_ids=[
                        next(name for name in project.block.photo_ids if "_".join(name.split()) == own)
                        for own in other.block.photo_ids
                    ]
                )
            )
            if not other.block.mounts
            else other
        )
    same_blocks(project.block, other.block, 1e-12)
    np.testing.assert_array_equal(other.starts, project.starts)
    assert other.details["colours"] == project.details["colours"]
    assert [each.parameters for each in other.block.cameras] == [
        each.parameters for each in project.block.cameras
    ]
    if project.block.mounts:
        mine, own = project.block.mounts[0].sensor, other.block.mounts[0].sensor
        np.testing.assert_allclose(own.position, mine.position, atol=1e-15)


def test_what_is_written_of_the_plain_project_adjusts_to_the_same(tmp_path):
    project = formats.read(EXAMPLE)
    lost = " ".join(formats.cannot_hold(project, "colmap"))
    for word in ("standard deviations", "4 control and 1 check points", "7 observations other than images"):
        assert word in lost
    other = formats.read(written(project, tmp_path / "there", "colmap"))
    # names.csv beside the model keeps the names of points.
    assert set(other.block.point_ids) == set(project.block.point_ids)
    order = [other.block.point_ids.index(name) for name in project.block.point_ids]
    block = other.block.replace(
        image_sd=0.5,
        point_ids=other.block.point_ids,
        point_positions=project.block.point_positions[np.argsort(order)],
        point_sd=project.block.point_sd[np.argsort(order)],
        observations=project.block.observations,
    )
    one, two = adjust(project.block, tolerance=1e-9), adjust(block, tolerance=1e-9)
    assert (np.abs(two.point_positions[order] - one.point_positions) < 1e-9 * one.point_sd).all()
    np.testing.assert_allclose(two.point_sd[order], one.point_sd, rtol=1e-7)


def test_control_by_names_carries_a_model_in_a_frame_of_its_own(run, tmp_path):
    project = formats.read(EXAMPLE)
    written(project, tmp_path / "model", "colmap")
    # The model turned, shifted and shrunk, as a reconstruction without control is.
    other = formats.read(tmp_path / "model")
    turn = Attitudes.of("omega_phi_kappa", [[0.4, -0.3, 2.0]]).matrices[0]
    block = other.block
    angles = Attitudes(turn @ Attitudes.of("omega_phi_kappa", block.photo_attitudes).matrices)
    moved = other.replace(
        block=block.replace(
            photo_positions=0.1 * block.photo_positions @ turn.T + [3.0, -2.0, 1.0],
            photo_attitudes=angles.values("omega_phi_kappa"),
        ),
        starts=0.1 * other.starts @ turn.T + [3.0, -2.0, 1.0],
    )
    written(moved, tmp_path / "moved", "colmap")
    done = run(
        "adjust", "moved", "--control", EXAMPLE / "control.csv", "--sd", "control=0.01", "--sd", "images=0.5"
    )
    assert done.exit_code == 0, done.output
    assert "the model is transformed to" in done.output
    place = tmp_path / "moved-adjusted"
    assert {"covariances.json", "images.bin", "photo_covariances.bin"} <= {
        each.name for each in (place / "adjusted-colmap").iterdir()
    }
    result = adjust(project.block.replace(observations=()), unit_variance="free")
    again = formats.read(place / "adjusted-colmap")
    rows = [again.block.photo_ids.index(name) for name in project.block.photo_ids]
    # The check point of the example is one more unknown there and here.
    np.testing.assert_allclose(again.block.photo_positions[rows], result.photo_positions, atol=1e-4)
    content = (place / "adjusted-colmap" / "photo_covariances.bin").read_bytes()
    (count,) = struct.unpack_from("<Q", content)
    table = np.frombuffer(content, [("id", "<u4"), ("c", "<f8", 21)], count, 8)
    about = json.loads((place / "adjusted-colmap" / "covariances.json").read_text())
    assert count == 6
    np.testing.assert_allclose(
        table["c"][:, 0],
        result.photo_covariances[[project.block.photo_ids.index(n) for n in again.block.photo_ids], 0, 0],
        rtol=1e-3,
    )
    assert about["datum"] == "given by the observations"


def test_rotations_of_the_sidecar_are_those_of_the_cameras_axes():
    project = formats.read(EXAMPLE)
    result = adjust(project.block)
    content = formats.FORMATS["colmap"].results(project, result)["photo_covariances.bin"]
    table = np.frombuffer(content, [("id", "<u4"), ("c", "<f8", 21)], offset=8)
    assert table["id"].tolist() == list(range(1, len(project.block.photo_ids) + 1))
    covariances, (rows, columns) = np.zeros((len(table), 6, 6)), np.tril_indices(6)
    covariances[:, rows, columns] = covariances[:, columns, rows] = table["c"]
    flip = np.diag([1.0, -1.0, -1.0])

    def small(angles, base):
        turned = flip @ Attitudes.of("omega_phi_kappa", angles).matrices.transpose(0, 2, 1) @ base
        return np.array([[m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]] for m in turned]) / 2

    angles = result.photo_attitudes
    base = (flip @ Attitudes.of("omega_phi_kappa", angles).matrices.transpose(0, 2, 1)).transpose(0, 2, 1)
    step = 1e-6
    rates = np.stack(
        [
            (small(angles + step * axis, base) - small(angles - step * axis, base)) / (2 * step)
            for axis in np.eye(3)
        ],
        axis=2,
    )
    own = result.photo_covariances
    np.testing.assert_allclose(
        covariances[:, 3:, 3:], rates @ own[:, 3:, 3:] @ rates.transpose(0, 2, 1), rtol=1e-6
    )
    np.testing.assert_allclose(covariances[:, 3:, :3], rates @ own[:, 3:, :3], rtol=1e-6, atol=1e-16)


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        ("cameras.bin", lambda b: b[:-3], ["cameras.bin", "record 2", "colmap.bytes", "n=3"]),
        (
            "cameras.bin",
            lambda b: b[:12] + struct.pack("<i", 99) + b[16:],
            ["cameras.bin", "record 1", "colmap.model", "model=99"],
        ),
        ("images.bin", lambda b: struct.pack("<Q", 2**60) + b[8:], ["images.bin", "colmap.count"]),
        ("images.bin", lambda b: b[:-24], ["images.bin", "colmap."]),
        ("points3D.bin", lambda b: b + b"\0", ["points3D.bin", "colmap.beyond", "words=1 bytes"]),
        ("points3D.bin", lambda b: b[:-1], ["points3D.bin", "record 40", "colmap.bytes", "n=1"]),
        ("frames.bin", lambda b: b[:-8], ["frames.bin", "colmap.bytes", "n=8"]),
    ],
)
def test_a_damaged_binary_file_is_named_with_the_record(tmp_path, file, change, words):
    source = sample("colmap", "binary")
    for each in source.iterdir():
        (tmp_path / each.name).write_bytes(
            change(each.read_bytes()) if each.name == file else each.read_bytes()
        )
    with refused(*words):
        formats.read(tmp_path)


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (
            "cameras.txt",
            "FULL_OPENCV",
            "FULL_OPENCW",
            ["cameras.txt", "record 2", "colmap.model", "model=FULL_OPENCW"],
        ),
        (
            "cameras.txt",
            " 3612.5 3612.5",
            " 3612,5 3612.5",
            ["cameras.txt record 2", "parameter 1 of 12: error.number value=3612,5"],
        ),
        (
            "images.txt",
            "1395.3837490217622 ",
            "x ",
            ["images.txt", "record 4", "colmap.number", "feature=1", "value=x"],
        ),
        ("images.txt", "10 0.0103", "10 0.9103", ["images.txt", "record 3", "format.length"]),
        (
            "images.txt",
            " 1 DJI_0002.JPG",
            " 2 DJI_0002.JPG",
            ["images.txt", "record 5", "format.undefined", "what=camera name=2"],
        ),
        (
            "points3D.txt",
            "100 -51.7594",
            "107 -51.7594",
            ["points3D.txt", "record 3", "format.repeated", "what=point name=107"],
        ),
        ("frames.txt", "10 1 0.0103", "10 9 0.0103", ["frames.txt", "format.undefined", "what=rig name=9"]),
    ],
)
def test_a_fault_of_a_text_file_is_named_with_its_line(tmp_path, file, old, new, words):
    source = sample("colmap", "text")
    for each in source.iterdir():
        text = each.read_text()
        if each.name == file:
            assert old in text
            text = text.replace(old, new, 1)
        (tmp_path / each.name).write_text(text)
    with refused(*words):
        formats.read(tmp_path)


@pytest.mark.parametrize("dress", ["text", "binary", "rig_binary"])
@pytest.mark.parametrize("seed", range(3))
def test_damaged_models_end_in_a_message(tmp_path, dress, seed):
    assert check_damaged(sample("colmap", dress), tmp_path, "colmap", 60, seed) > 10


def test_a_camera_that_colmap_does_not_have_is_refused(tmp_path):
    project = formats.read(EXAMPLE)
    camera = Camera("brown", {"c": 3600.0, "K1": 1e-9}, unit="px", name="drone")
    other = project.replace(block=project.block.replace(cameras=[camera]))
    with refused("format.model", "model=brown title=COLMAP"):
        formats.to_files(other, "colmap")


def test_rigs_that_cameras_do_not_tell_are_written_as_photos(tmp_path):
    project = formats.read(sample("colmap", "rig_binary"))
    block = project.block
    one = block.replace(photo_cameras=[0] * len(block.photo_ids))
    lost = " ".join(formats.cannot_hold(project.replace(block=one), "colmap"))
    assert "rigs: photos have their own poses" in lost
    assert "rigs" not in " ".join(formats.cannot_hold(project, "colmap"))
    other = formats.read(written(project.replace(block=one), tmp_path, "colmap")).block
    assert not other.mounts
    rows = [other.photo_ids.index(name) for name in block.photo_ids]
    np.testing.assert_allclose(other.photo_positions[rows], block.photo_positions, rtol=0, atol=1e-12)


# Against the package


@pytest.fixture
def pycolmap():
    return pytest.importorskip("pycolmap", reason="pycolmap is not installed")


def test_the_package_has_the_models_in_this_order(pycolmap):
    own = {str(name): int(model) for name, model in pycolmap.CameraModelId.__members__.items()}
    for number, (name, parameters) in enumerate(MODELS.items()):
        assert own[name] == number
        assert len(pycolmap.Camera.create_from_model_name(1, name, 500.0, 1000, 800).params) == len(
            parameters
        )


@pytest.mark.parametrize("target", ["colmap", "colmap_text"])
def test_the_package_reads_what_is_written(pycolmap, tmp_path, target):
    project = formats.read(EXAMPLE)
    place = written(project, tmp_path / "there", target)
    theirs = pycolmap.Reconstruction(str(place))
    assert theirs.num_reg_images() == 6
    for image in theirs.images.values():
        row = project.block.photo_ids.index(image.name)
        np.testing.assert_allclose(image.projection_center(), project.block.photo_positions[row], atol=1e-10)
        flip = np.diag([1.0, -1.0, -1.0])
        matrix = Attitudes.of("omega_phi_kappa", project.block.photo_attitudes[[row]]).matrices[0]
        np.testing.assert_allclose(image.cam_from_world().rotation.matrix(), flip @ matrix.T, atol=1e-12)
    assert theirs.compute_num_observations() == len(project.block.image_xy)


@pytest.mark.parametrize("dress", ["rig_text", "rig_binary"])
def test_the_package_reads_rigs_that_are_written(pycolmap, tmp_path, dress):
    project = formats.read(sample("colmap", dress))
    theirs = pycolmap.Reconstruction(str(written(project, tmp_path, "colmap")))
    assert [len(rig.non_ref_sensors) for rig in theirs.rigs.values()] == [1]
    for image in theirs.images.values():
        row = project.block.photo_ids.index(image.name)
        np.testing.assert_allclose(image.projection_center(), project.block.photo_positions[row], atol=1e-10)


def cost_of(model):
    """Return the sum of squared residuals of a model of the package, pixels."""
    return sum(
        float(np.sum((image.project_point(model.points3D[own.point3D_id].xyz) - own.xy) ** 2))
        for image in model.images.values()
        for own in image.points2D
        if own.has_point3D()
    )


@pytest.mark.parametrize("calibrated", [False, True])
def test_one_command_finds_the_cost_of_the_package_and_all_covariances(pycolmap, run, tmp_path, calibrated):
    pycolmap.set_random_seed(5)
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig = 2, 1, 7
    options.num_points3D = 120
    model = pycolmap.synthesize_dataset(options)
    noise = pycolmap.SyntheticNoiseOptions()
    noise.point2D_stddev, noise.point3D_stddev = 0.6, 0.01
    pycolmap.synthesize_noise(noise, model)
    (tmp_path / "model").mkdir()
    model.write_binary(str(tmp_path / "model"))
    more = ("--self-calibrate", "all") if calibrated else ()
    done = run("adjust", "model", "--datum", "inner", "--sd", "images=0.6", *more, "--json", "result.json")
    assert done.exit_code in (0, 4), done.output
    chosen = pycolmap.BundleAdjustmentOptions()
    chosen.refine_focal_length = chosen.refine_principal_point = chosen.refine_extra_params = calibrated
    pycolmap.bundle_adjustment(model, chosen)
    again = pycolmap.Reconstruction(str(tmp_path / "model-adjusted" / "adjusted-colmap"))
    np.testing.assert_allclose(cost_of(again), cost_of(model), rtol=1e-3)
    assert cost_of(again) < cost_of(model) * (1 + 1e-6)
    place = tmp_path / "model-adjusted" / "adjusted-colmap"
    counts = {"photo": len(again.images), "point": len(again.points3D), "camera": len(again.cameras)}
    for kind, count in counts.items():
        content = (place / f"{kind}_covariances.bin").read_bytes()
        assert struct.unpack_from("<Q", content) == (count,)
    photos = np.frombuffer(
        (place / "photo_covariances.bin").read_bytes(), [("id", "<u4"), ("c", "<f8", 21)], counts["photo"], 8
    )
    points = np.frombuffer(
        (place / "point_covariances.bin").read_bytes(), [("id", "<u8"), ("c", "<f8", 6)], counts["point"], 8
    )
    for table, diagonal in ((photos, [0, 2, 5, 9, 14, 20]), (points, [0, 2, 5])):
        assert np.isfinite(table["c"]).all()
        assert (table["c"][:, diagonal] > 0).all()
    assert set(photos["id"].tolist()) == set(again.images)
    assert set(points["id"].tolist()) == set(again.points3D)
    quality = np.frombuffer(
        (place / "observation_quality.bin").read_bytes(),
        [("image", "<u4"), ("feature", "<u4"), ("values", "<f4", 6)],
        offset=8,
    )
    assert len(quality) == sum(len(image.points2D) for image in again.images.values())
    for number, feature, values in quality.tolist()[::17]:
        image = again.images[number]
        own = image.points2D[feature]
        residual = own.xy - image.project_point(again.points3D[own.point3D_id].xyz)
        np.testing.assert_allclose(values[:2], residual, atol=1e-4)
        assert (np.array(values[2:4]) > 0).all()
        np.testing.assert_allclose(values[4:], residual / (0.6 * np.sqrt(values[2:4])), rtol=1e-3, atol=1e-3)
    deviations = json.loads((tmp_path / "result.json").read_text())["cameras"]
    assert len(deviations) == counts["camera"]


def test_a_model_of_the_package_adjusts_to_the_cost_of_its_own_adjustment(pycolmap, tmp_path):
    pycolmap.set_random_seed(3)
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig, options.num_points3D = (
        2,
        1,
        6,
        150,
    )
    model = pycolmap.synthesize_dataset(options)
    noise = pycolmap.SyntheticNoiseOptions()
    noise.point2D_stddev = 0.6
    pycolmap.synthesize_noise(noise, model)
    (tmp_path / "before").mkdir()
    model.write_binary(str(tmp_path / "before"))
    project = formats.read(tmp_path / "before")
    assert len(project.block.image_xy) == model.compute_num_observations()
    assert agreement(project).median < 2.0
    result = adjust(project.block, datum=InnerConstraints(), tolerance=1e-8)
    assert result.converged
    chosen = pycolmap.BundleAdjustmentOptions()
    chosen.refine_focal_length = chosen.refine_principal_point = chosen.refine_extra_params = False
    chosen.refine_sensor_from_rig = False
    pycolmap.bundle_adjustment(model, chosen)
    residuals = [
        np.sum((image.project_point(model.points3D[own.point3D_id].xyz) - own.xy) ** 2)
        for image in model.images.values()
        for own in image.points2D
        if own.has_point3D()
    ]
    np.testing.assert_allclose(result.sums_of_squares.plates, np.sum(residuals), rtol=1e-4)
    assert np.isfinite(result.photo_covariances).all()
    assert np.isfinite(result.point_covariances[result.used_points]).all()
