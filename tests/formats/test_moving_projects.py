"""Photos on trajectories in the tables of the plain project."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given, settings
from hypothesis.strategies import integers, sampled_from
from moving import edited, project_of, rolling, same, two_lines
from test_plain_project import change, written

import test_moving
from message_codes import rejected
from photogram import Attitudes, InputError, adjust, formats
from photogram.distributed.cut import vertices_of
from photogram.formats import ReadOptions
from photogram.formats.description import described
from photogram.formats.in_parts import Streamed, streamable
from photogram.network import Lens, Polynomial, Smoothness, Spline, Table, Timed, Trajectory
from photogram.network.motion import about
from photogram.show.forms import text as text_of
from photogram.show.page import Document

GOLDEN = ("rolling_shutter", "pushbroom_strips", "jitter", "three_line", "planetary_pair")


def again(block, place, **more):
    """Return a block that was written and read."""
    project = project_of(block, place, **more)
    assert formats.cannot_hold(project, "plain") == []
    read = formats.read(written(project, place))
    assert read.messages == ()
    return read.block


def golden_block(name, monkeypatch):
    """Return the block that a test of golden data adjusts."""

    class FoundError(Exception):
        pass

    def caught(block, **options):
        raise FoundError(block)

    monkeypatch.setattr(test_moving, "adjust", caught)
    with pytest.raises(FoundError) as found:
        getattr(test_moving, f"test_{name}")()
    return found.value.args[0]


def check_adjusted(one, two, tolerance=1e-7):
    """Assert that two blocks have the same answer."""
    first, second = (adjust(each, tolerance=1e-10) for each in (one, two))
    assert first.degrees_of_freedom == second.degrees_of_freedom
    assert second.sums_of_squares.total == pytest.approx(first.sums_of_squares.total, rel=1e-9)
    theirs = {(each.kind, each.name): each for each in second.unknowns}
    for each in first.unknowns:
        read = theirs.get((each.kind, each.name))
        assert read is not None or each.given.is_held
        if read is not None:
            sd = np.sqrt(np.diag(each.cofactors))
            apart = np.abs(read.position - each.position)[: len(sd)]
            assert (apart <= tolerance * sd[: len(apart)]).all()


@pytest.mark.parametrize("name", GOLDEN)
def test_golden_networks_come_back(name, monkeypatch, tmp_path):
    block = golden_block(name, monkeypatch)
    sizes = ((4000, 3000),) if name == "rolling_shutter" else None
    found = again(block, tmp_path / name, sizes=sizes)
    same(block, found)
    check_adjusted(block, found, 1e-5)


@pytest.mark.parametrize("unit", ["px", "mm"])
@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_a_rolling_shutter_comes_back(unit, direction, tmp_path):
    block = rolling(unit, direction)
    pixel_mm = (None,) if unit == "px" else (0.004,)
    found = again(block, tmp_path / "there", sizes=((3000, 2000),), pixel_mm=pixel_mm)
    same(block, found)
    assert len({id(each.shutter) for each in found.timed}) == 1
    assert "readout_begin" not in (tmp_path / "there" / "cameras.csv").read_text()
    # Where the size is not known the edges stand there.
    found = again(block, tmp_path / "other")
    same(block, found)
    assert "readout_begin" in (tmp_path / "other" / "cameras.csv").read_text()
    check_adjusted(block, found)


def test_two_lines_on_one_trajectory_come_back(tmp_path):
    block = two_lines()
    found = again(block, tmp_path / "there")
    same(block, found)
    one, two = found.timed
    assert one.trajectory is two.trajectory
    assert one.rate is two.rate
    assert one.sensor is None
    assert {id(each.moment.trajectory) for each in found.observations if each.moment} == {id(one.trajectory)}
    check_adjusted(block, found)
    other = block.replace(photo_to_ground=True)
    same(other, again(other, tmp_path / "other"))


BASES = (
    None,
    Polynomial(0, sd=0.0),
    Polynomial(3, value=[[0.1, 0.2, -1e-3]] * 4, sd=[1.0, np.inf, 0.0]),
    Polynomial(2, reference=1.5, scale=0.25, sd=0.02),
    Spline(every=2.5, sd=0.3, correlation=(4.0, 0.1)),
    Spline(every=1.0, degree=1, smooth=(1, 2e-3), correlation=(0.1, 0.2)),
    Spline(
        knots=[-9, -7, -4, 0, 0.5, 1, 10 / 3, 5, 7, 10, 14, 20, 30],
        degree=3,
        value=[[1e-3, 0, 0]] * 9,
        sd=0.5,
    ),
    Spline(knots=[-3, -2, -1, 0, 4, 4, 8, 12, 13, 14], degree=2, smooth=(3, 1e-4)),
)


@settings(max_examples=40, deadline=None)
@given(
    position=sampled_from(BASES),
    rotation=sampled_from(BASES),
    table=sampled_from(["linear", "hermite", "lagrange"]),
    name=sampled_from(["strip", "a, b", 'the "second"', "12", "Überflug 3", "none"]),
    seed=integers(0, 2**31),
)
def test_any_trajectory_comes_back(tmp_path_factory, position, rotation, table, name, seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(2, 9))
    times = np.linspace(0.0, 10.0, count) + np.append(0.0, random.uniform(0, 0.3, count - 1))
    turns = np.sort(random.uniform(0.0, 10.0, 5))
    known = Table(
        times,
        random.normal(0, 1e5, (count, 3)),
        turns,
        Attitudes.of("rotation_vector", random.normal(0, 2, (5, 3))).matrices,
        velocities=random.normal(0, 50, (count, 3)) if table == "hermite" else None,
        interpolation=table,
        attitude_interpolation=random.choice(["linear", "lagrange"]),
    )
    body = None
    if seed % 2:
        body = [0.0, 7.0], Attitudes.of("rotation_vector", random.normal(0, 2, (2, 3))).matrices
    try:
        own = Trajectory(name, known, position, rotation, body)
    except InputError:
        assume(False)
    block = rolling()
    timed = [
        Timed(each.photo, own, time=float(random.uniform(1, 9)), shutter=each.shutter) for each in block.timed
    ]
    block = block.replace(timed=timed, observations=())
    same(block, again(block, tmp_path_factory.mktemp("any")))


def test_photos_on_a_trajectory_need_no_pose(moving_projects):
    lines = moving_projects / "lines"
    edited(lines / "photos.csv", lambda table: table[["photo", "camera", "trajectory", "rig", "sensor"]])
    found = formats.read(lines).block
    assert np.isfinite(found.photo_positions).all()
    own = found.timed[1].trajectory
    place, matrix = about(own, 200.5)
    np.testing.assert_allclose(found.photo_positions[1], place, atol=1e-9)
    read = Attitudes.of("omega_phi_kappa", found.photo_attitudes[1:]).matrices[0]
    np.testing.assert_allclose(read, matrix, atol=1e-12)
    assert found.timed[0].time is None
    check_adjusted(found, found.replace(photo_positions=np.zeros((2, 3))))


def test_deviations_of_coefficients_may_stand_in_the_settings(moving_projects):
    lines = moving_projects / "lines"
    (lines / "trajectory_coefficients.csv").unlink()
    (lines / "trajectory_knots.csv").unlink()
    (lines / "covariances.csv").unlink()
    columns = ["trajectory", "position", "rotation", "position_degree", "interpolation"]
    edited(lines / "trajectories.csv", lambda table: table[columns].assign(rotation_every="3"))
    change(lines / "project.toml", "[adjust]", "[sd]\ntrajectories = [0.25, 0.5]\n\n[adjust]")
    own = formats.read(lines).block.timed[0].trajectory
    assert own.position.reference == pytest.approx(205.5)
    assert own.position.scale == pytest.approx(5.5)
    assert own.rotation.count == 4 + 3
    np.testing.assert_array_equal([each.deviations for each in own.coefficients[0]], np.full((2, 3), 0.25))
    np.testing.assert_allclose(
        [each.deviations for each in own.coefficients[1]], np.radians(np.full((7, 3), 0.5))
    )


def test_the_camera_tells_the_sensor_of_a_rig(moving_projects):
    lines = moving_projects / "lines"
    plain = formats.read(lines).block
    edited(lines / "photos.csv", lambda table: table.assign(rig="pair").drop(columns="sensor"))
    edited(
        lines / "rigs.csv",
        lambda table: table.assign(rig="pair", camera=["down", "ahead"]).drop(columns="sensor"),
    )
    found = formats.read(lines).block
    assert found.timed[0].sensor is None
    assert found.timed[1].sensor.name == "pair/ahead"
    np.testing.assert_array_equal(found.timed[1].sensor.matrix, plain.timed[1].sensor.matrix)
    edited(lines / "rigs.csv", lambda table: table.assign(camera=["down", "down"]))
    with rejected("plain.sensor-twice pair down"):
        formats.read(lines)
    edited(lines / "rigs.csv", lambda table: table[:1])
    with rejected("photos.csv, record 3: plain.no-sensor-of-rig pair ahead"):
        formats.read(lines)


def test_cameras_for_each_photo_have_one_shutter(moving_projects):
    drone = moving_projects / "drone"
    edited(drone / "cameras.csv", lambda table: table.assign(for_each="photo").drop(columns="shutter"))
    found = formats.read(drone).block
    assert len(found.cameras) == 6
    assert len({id(each.readout) for each in found.timed}) == 1
    assert found.timed[0].readout.name == "drone"
    same(found, again(found, moving_projects / "again", sizes=((3000, 2000),) * 6))


def test_tables_of_parquet(moving_projects):
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    lines = moving_projects / "lines"
    plain = formats.read(lines).block
    for path in sorted(lines.glob("*.csv")):
        pd.read_csv(path).to_parquet(path.with_suffix(".parquet"))
        path.unlink()
    same(plain, formats.read(lines).block)


def test_trajectories_need_a_frame_that_is_known(moving_projects):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    lines = moving_projects / "lines"
    change(lines / "project.toml", "[adjust]", '[control]\ncrs = "EPSG:25832"\n\n[adjust]')

    def placed(table):
        moved = {"x": 5e5, "y": 5.2e6}
        return table.assign(
            **{name: (table[name].astype(float) + by).map(repr) for name, by in moved.items()}
        )

    edited(lines / "control.csv", placed)
    with rejected("project.toml: plain.trajectory-frame topocentric at latitude 46.9533,"):
        formats.read(lines)


GON = 10 / 9
SD = [f"sd_rotation_{axis}" for axis in "xyz"]
OTHER_NUMBERS = (
    *((name, SD, GON) for name in ("attitudes", "attitude_groups", "rigs")),
    ("attitudes", ["cov_rotation_y_rotation_z"], GON**2),
    ("attitudes", ["cov_rotation_x_rotation_y", "cov_rotation_x_rotation_z"], -(GON**2)),
    ("rates", ["rate_y", "rate_z", "cov_rate_x_rate_y", "cov_rate_x_rate_z"], -1.0),
    ("attitude_groups", ["bias_y", "bias_z"], -1.0),
    ("rigs", ["y", "z"], -1.0),
    ("gnss_groups", ["lever_y", "lever_z"], -1.0),
    ("trajectories", ["sd_rotation", "sd_rotation_smooth"], GON),
    ("photos", ["rate_y", "rate_z"], -1.0),
)
"""What gon, and axes of photos whose y points down, change of numbers: table, columns, factor."""


def scaled(table, columns, factor):
    """Return a table with other numbers in some of its columns, those that it has."""
    own = table[[name for name in columns if name in table]].replace("", "nan").astype(float) * factor
    return table.assign(**own.map(repr).replace("nan", "").to_dict("list"))


def in_other_axes(place):
    """Write tables in gon, with matrices of photos whose y points down."""
    flip = np.diag([1.0, -1.0, -1.0])
    angles, elements = ["omega", "phi", "kappa"], [f"m{i}{j}" for i in "123" for j in "123"]

    def turned(table, after):
        given = table[angles].replace("", "nan").astype(float)
        matrices = Attitudes.of("omega_phi_kappa", np.radians(given)).matrices
        own = flip @ matrices.transpose(0, 2, 1) @ after
        text = pd.DataFrame(own.reshape(-1, 9), columns=elements, index=table.index).map(repr)
        return table.drop(columns=angles).join(text.replace("nan", ""))

    def covariances(table):
        signs = (table["first"] + table["second"]).map(lambda pair: -1.0 if pair in ("yx", "zx") else 1.0)
        return table.assign(covariance=(table["covariance"].astype(float) * signs * GON**2).map(repr))

    # Of sensors and boresights both sides are axes of photos, or of what moves as they do.
    sides = dict.fromkeys(("photos", "trajectory_attitudes", "attitudes"), np.eye(3))
    for name, after in (sides | dict.fromkeys(("attitude_groups", "rigs"), flip)).items():
        if (place / f"{name}.csv").exists():
            edited(place / f"{name}.csv", lambda table, after=after: turned(table, after))
    for name, columns, factor in OTHER_NUMBERS:
        if (place / f"{name}.csv").exists():
            edited(place / f"{name}.csv", lambda table, own=columns, by=factor: scaled(table, own, by))
    if (place / "covariances.csv").exists():
        edited(place / "covariances.csv", covariances)
    change(place / "project.toml", 'angle = "deg"', 'angle = "gon"')
    change(place / "project.toml", "[axes]", '[axes]\nattitude = "matrix"\nphoto = "y_down"')


@pytest.mark.parametrize("name", ["drone", "lines"])
def test_other_axes_and_units_of_angles(moving_projects, name):
    plain = formats.read(moving_projects / name).block
    in_other_axes(moving_projects / name)
    other = formats.read(moving_projects / name).block
    check_adjusted(plain, other, 1e-5)


def test_pixels_from_the_middle_of_the_first_and_lengths_in_micrometres(moving_projects):
    lines = moving_projects / "lines"
    plain = formats.read(lines).block

    def shifted(table):
        return table.assign(
            **{name: (table[name].astype(float) - 0.5).map(repr) for name in ("column", "row")},
            **{name: (table[name].astype(float) * 1e3).map(repr) for name in ("sd_column", "sd_row")},
        )

    edited(lines / "images.csv", shifted)
    powers = {"c": 1, "xp": 1, "K1": -2, "sd_K1": -2, "x0": 1, "y0": 1, "pitch_x": 1, "pitch_y": 1}
    edited(
        lines / "cameras.csv",
        lambda table: table.assign(
            **{name: (table[name].astype(float) * 1e3**power).map(repr) for name, power in powers.items()}
        ),
    )
    change(lines / "project.toml", 'image = "mm"', 'image = "um"')
    change(lines / "project.toml", "[axes]", '[axes]\npixel_origin = "center"')
    other = formats.read(lines).block
    np.testing.assert_allclose(other.image_xy, plain.image_xy, rtol=0, atol=1e-12)
    np.testing.assert_allclose(other.image_sd, plain.image_sd, rtol=1e-15)
    assert other.timed[1].line_sensor.pitch == pytest.approx(plain.timed[1].line_sensor.pitch)
    check_adjusted(plain, other, 1e-5)


def test_records_that_a_trajectory_does_not_reach_are_left_out(moving_projects):
    lines = moving_projects / "lines"
    plain = formats.read(lines).block
    for number, table in enumerate(("gnss", "rates"), 1):
        text = (lines / f"{table}.csv").read_text().splitlines()
        more = [text[1].replace(",201.0,", f",{time},") for time in (198.0, 212.5, 1e6)[:number]]
        assert more[0] != text[1]
        (lines / f"{table}.csv").write_text("\n".join([*text, *more, ""]))
    found = formats.read(lines)
    told = [str(each) for each in found.messages]
    assert len(told) == 2
    assert "gnss.csv: 1 record outside the time of its trajectory" in told[0]
    assert "rates.csv: 2 records outside the time" in told[1]
    assert len(found.block.observations) == len(plain.observations)


def test_photos_without_a_shutter_may_move_and_words_of_camera_lines(moving_projects):
    drone = moving_projects / "drone"
    edited(
        drone / "cameras.csv",
        lambda table: table.drop(columns=[c for c in table if "readout" in c or c == "shutter"]),
    )
    found = formats.read(drone).block
    assert len(found.timed) == 6
    assert found.timed[0].shutter is None
    edited(
        drone / "photos.csv",
        lambda table: table.drop(columns=[c for c in table if c.endswith(("vx", "vy", "vz"))]),
    )
    edited(drone / "photos.csv", lambda table: table.drop(columns=[c for c in table if "rate" in c]))
    (drone / "velocities.csv").unlink()
    assert formats.read(drone).block.timed == ()
    lines = moving_projects / "lines"
    plain = formats.read(lines).block
    edited(lines / "cameras.csv", lambda table: table.assign(model="line", width="6000", height="", s0=""))
    found = formats.read(lines).block
    assert [each.model for each in found.cameras] == ["brown", "brown"]
    assert found.timed[0].line_sensor == plain.timed[0].line_sensor


def test_what_tables_cannot_hold(tmp_path):
    block = rolling()
    others = block.timed[1:]
    with rejected("plain.several-exposures drone"):
        formats.to_files(project_of(block.replace(timed=others, observations=()), tmp_path), "plain")
    lines = two_lines()
    turns = lines.timed[0].trajectory.coefficients[1]
    more = Smoothness([turns[0], turns[2]], [1.0, -1.0], sd=0.1)
    own = project_of(lines.replace(observations=[*lines.observations, more]), tmp_path)
    assert formats.cannot_hold(own, "plain") == ["1 sums of coefficients that are no neighbours, or too many"]
    assert "smoothness.csv" not in formats.to_files(own, "plain")
    lensed = replace(lines.timed[0].line_sensor, lens=Lens("lrolrocnac", (1e-5,)))
    curved = lines.replace(timed=[replace(each, line_sensor=lensed) for each in lines.timed])
    with rejected("plain.bent-line down"):
        formats.to_files(project_of(curved, tmp_path), "plain")
    with rejected("format.scanner L1"):
        formats.to_files(own, "colmap")
    drone = project_of(block, tmp_path, sizes=((3000, 2000),))
    lost = formats.cannot_hold(drone, "colmap")
    assert "trajectories: 6 photos with their approximate poses" in lost


def motions(project):
    (section,) = [each for each in described(project).sections if each.key == "given-trajectories"]
    return " ".join(text_of(Document("", "", sections=[section])).split())


def test_what_counts_from_where_is_kept(moving_projects):
    lines = moving_projects / "lines"
    for origin, told in (
        ("2026-05-01T10:30:00Z", "2026-05-01T10:30:00+00:00"),
        ('"2026-05-01"', "2026-05-01T00:00:00"),
        ("86400", "86400.0"),
    ):
        text = (lines / "project.toml").read_text().split("\n[time]")[0]
        (lines / "project.toml").write_text(f'{text}\n[time]\norigin = {origin}\nscale = "gps"\n')
        read = formats.read(lines)
        assert f"times seconds from {told}, gps" in motions(read)
        files = formats.to_files(read, "plain")
        again_read = formats.read(written(read, moving_projects / "again"))
        assert motions(again_read) == motions(read)
        assert b"[time]" in files["project.toml"]
        shutil.rmtree(moving_projects / "again")
    for origin in ('"yesterday"', "07:32:00", "[1, 2]", "nan", "true"):
        (lines / "project.toml").write_text(f"{text}\n[time]\norigin = {origin}\n")
        with rejected("project.toml, record 21: error.key time origin:"):
            formats.read(lines)


def test_adjust_and_info_on_the_command_line(run, moving_projects, tmp_path):
    told = run("info", moving_projects / "lines")
    assert told.exit_code == 0, told.output
    text = " ".join(told.output.split())
    assert "photos on trajectories 2 photos of a line scanner 2" in text
    table = described(formats.read(moving_projects / "lines")).table("trajectories").frame()
    first = table.set_index("name").loc["strip 7"]
    assert first[["positions", "attitudes", "start_s", "end_s"]].tolist() == [12, 24, 200.0, 211.0]
    assert (first.position, first.rotation) == (
        "polynomial of degree 1, 2 coefficients",
        "spline of degree 3, 9 coefficients",
    )
    assert "observations, velocity 12" in text
    assert (
        "photos on trajectories 6 photos with a rolling shutter 6 photos with a motion of their own 6"
        in " ".join(run("info", moving_projects / "drone").output.split())
    )
    edited(moving_projects / "lines" / "trajectories.csv", lambda table: table.assign(colour="red"))
    for name in ("drone", "lines"):
        done = run("adjust", moving_projects / name, "--out", name, "--no-html")
        assert done.exit_code in (0, 4), done.output
        if name == "lines":
            assert "columns unknown to the table trajectories are not read: colour" in " ".join(
                done.output.split()
            )
        result = adjust(formats.read(moving_projects / name).block)
        table = pd.read_csv(tmp_path / name / "unknowns.csv", comment="#")
        expected = result.unknown_table()
        assert list(table["unknown"]) == list(expected["unknown"])
        np.testing.assert_allclose(table["value"], expected["value"], rtol=1e-12, atol=1e-14)
        assert (tmp_path / name / "report.txt").read_text()
        same(result.restarted(), formats.read(tmp_path / name / "adjusted").block)


@pytest.mark.parametrize("name", ["drone", "lines"])
def test_photos_that_move_are_read_in_batches(moving_projects, name):
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    place = moving_projects / name
    table = pd.read_csv(place / "images.csv")
    table.to_parquet(place / "images.parquet")
    (place / "images.csv").unlink()
    assert streamable(place)
    if name == "lines":
        with rejected("plain.parts-moving L2"):
            Streamed(place, ReadOptions(), moving_projects / "run")
        edited(place / "photos.csv", lambda table: table.assign(time="205.0"))
    own = Streamed(place, ReadOptions(), moving_projects / "run")
    block = formats.read(place).block
    images = np.bincount(vertices_of(block)[block.image_photos], minlength=len(block.photo_ids))
    np.testing.assert_array_equal(own.images, images)


def test_a_drone_that_is_taken_to_stand_still_does_not_fit(tmp_path):
    example = Path(formats.__file__).parents[1] / "examples" / "rolling"
    moving = adjust(formats.read(example).block)
    assert 0.8 < moving.variance_of_unit_weight < 1.2
    assert np.abs(moving.check_points.differences).max() < 0.05
    place = Path(shutil.copytree(example, tmp_path / "still"))
    for name, more in (("cameras", ["readout"]), ("photos", ["v", "rate"])):
        path = place / f"{name}.csv"
        table = pd.read_csv(path, comment="#", dtype=str)
        there = [column for column in table if column.removeprefix("sd_").startswith(tuple(more))]
        table.drop(columns=there).to_csv(path, index=False)
    still = formats.read(place).block
    assert still.timed == ()
    assert adjust(still).variance_of_unit_weight > 20.0
