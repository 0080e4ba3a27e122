"""Cameras of a rig whose clocks are apart: a board that moves tells by how much."""

import math
import re

import numpy as np
import pandas
import pytest
from given_targets import rig_small
from typer.testing import CliRunner

from message_codes import refusal
from photogram import Camera, RankError, adjust, formats
from photogram.cli import app
from photogram.formats.targets import adjusted_project, calibration_of, project_of
from photogram.targets import Board, Calibrated, Calibration, Corners, cross_validate, read, simulate_corners
from photogram.targets.motion import errors_of_speeds, moving
from photogram.targets.vision import of_vectors

LATE = 0.012


def pose(time):
    turn = [0.5 * math.sin(3 * time), 0.5 * math.cos(2.3 * time), 0.7 * math.sin(1.7 * time + 1)]
    place = [
        0.1 * math.sin(4 * time) - 0.12,
        0.08 * math.cos(3 * time) - 0.08,
        0.45 + 0.1 * math.sin(2 * time),
    ]
    return of_vectors(np.array([[*turn, *place]]))[0]


def rig(seed=1, speed=1.0, views=20, every=0.05, **given):
    """Return two cameras that see a moving board; the second is `LATE` behind what its clock says."""
    board = Board(columns=9, rows=6, spacing=0.03, shape="held")
    free = dict.fromkeys(("fx", "fy", "cx", "cy", "k1"), math.inf)
    camera = Camera("opencv_pinhole", {"fx": 600.0, "fy": 600.0, "cx": 320.0, "cy": 240.0, "k1": -0.1}, free)
    sensors = np.array([np.eye(4), of_vectors(np.array([[0, 0.1, 0, -0.1, 0, 0]]))[0]])
    times = 10 + every * np.arange(views)
    random, seen = np.random.default_rng(seed), []
    for time in times:
        for sensor, late in zip(sensors, (0.0, LATE), strict=True):
            own = sensor @ pose(speed * (time + late))
            seen.append(camera.project((board.places @ own[:3, :3].T + own[:3, 3]) * [1, -1, -1]))
    corners = Corners(
        pictures=[f"{name}{view:02}" for view in range(views) for name in "ab"],
        cameras=np.tile([0, 1], views),
        views=np.repeat(np.arange(views), 2),
        times=np.repeat(times, 2),
        camera_names=["a", "b"],
        sizes=[(640, 480)] * 2,
        picture=np.repeat(np.arange(2 * views), 54),
        point=np.tile(np.arange(54), 2 * views),
        xy=np.concatenate(seen) + random.normal(0, 0.1, (108 * views, 2)),
    )
    return Calibration(
        board=board,
        corners=corners,
        cameras=[camera, camera],
        poses=np.array([pose(speed * time) for time in times]),
        sensors=sensors,
        sd0=0.1,
        sync="offset",
        **given,
    )


def test_offset_lens_and_rig_are_found_with_their_uncertainty():
    errors = []
    for seed in range(8):
        found = rig(seed).adjust()
        assert found.verdict.usable
        late = found.offsets["b"]
        errors.append((late.values[0] - LATE) / late.sd[0])
    # Of eight draws of the normal distribution; the mean has a standard deviation of 0.35.
    assert abs(np.mean(errors)) < 1.5
    assert 0.3 < np.std(errors) < 2
    assert late.sd[0] < 1e-4
    assert np.abs(found.sensors[1, :3, 3] - [-0.1, 0, 0]).max() < 1e-3
    assert cross_validate(found, "odd").explained
    names = [each.name for each in found.unknowns]
    assert len(set(names)) == len(names)


def test_a_synchronised_adjustment_of_the_same_corners_does_not_fit():
    given = rig()
    assert given.replace(sync="known", motion=None).adjust().variance_of_unit_weight > 10
    assert given.adjust().variance_of_unit_weight < 1.2


def test_pictures_at_the_ends_of_a_sequence_are_named():
    (told,) = rig().messages
    assert str(told).endswith("b00, b19")


def test_a_board_that_does_not_move_is_that_of_a_synchronised_rig():
    """Steps of views, sensors and cameras are the same whether views are frames or trajectories."""
    known = rig_small()
    corners = known.corners.replace(times=0.1 * known.corners.views)
    views = corners.view_count
    still = known.replace(corners=corners, sync="offset", sd_offsets=0.0, motion=np.zeros((views, 4, 6)))
    first, second = (Calibrated.of(adjust(each.block()), each) for each in (known, still))
    parts = ("cameras", "sensors", "board", "views")
    (names, a), (others, b) = first.cofactors(parts), second.cofactors(parts)
    assert names == others
    scale = np.sqrt(np.diag(a))
    assert np.abs((a - b) / np.outer(scale, scale)).max() < 1e-6
    assert np.abs(first.poses - second.poses).max() < 1e-7


def test_what_hardly_moves_tells_no_offset():
    slow = rig(speed=0.03)
    with pytest.raises(RankError, match="the offset of b is not determined"):
        slow.adjust()
    weighted = slow.replace(sd_offsets=1e-4, offsets=[0, LATE]).adjust()
    assert weighted.offsets["b"].sd[0] <= 1.01e-4
    assert "targets.offset.small" in [each.code for each in weighted.messages]


def test_motion_is_that_of_polynomials_through_neighbours():
    times = np.array([0.0, 0.1, 0.25, 0.3, 0.6, 0.7])
    vectors = np.zeros((6, 6))
    vectors[:, 3:] = np.stack([1 + times, times**2, 2 * times**2 - times], axis=1)
    found = moving(of_vectors(vectors), times, np.zeros(6, dtype=int))
    # C = -t of a board that is not turned; views 0, 3, 4 and 5 have no neighbour on one side.
    assert np.isnan(found[[0, 3, 4, 5]]).all()
    at = times[1]
    expected = [[-1, -2 * at, 1 - 4 * at], [0, -1, -2]]
    np.testing.assert_allclose(found[1, :2, :3], expected, atol=1e-12)
    assert not found[1, 2:].any()
    even = errors_of_speeds(0.1 * np.arange(3), np.zeros(3, dtype=int))
    assert even[1] == pytest.approx(2 / 0.2**2)


def test_a_project_goes_on_where_it_ended(tmp_path):
    found = rig().adjust()
    for name, content in formats.to_files(adjusted_project(found), "plain").items():
        (tmp_path / name).write_bytes(content)
    again = calibration_of(formats.read(tmp_path))
    assert again.sync == "offset"
    second = again.adjust()
    assert second.offsets["b"].values[0] == pytest.approx(found.offsets["b"].values[0], abs=1e-8)
    assert np.abs(second.sensors - found.sensors).max() < 1e-6


def test_an_offset_is_weighed_in_the_table_of_rigs(tmp_path):
    for name, content in formats.to_files(adjusted_project(rig().adjust()), "plain").items():
        (tmp_path / name).write_bytes(content)
    assert "time_offset" not in (tmp_path / "photos.csv").read_text()
    rigs = tmp_path / "rigs.csv"
    table = pandas.read_csv(rigs)
    assert table.time_offset[1] == pytest.approx(LATE, abs=1e-4)
    table.assign(time_offset=[None, 0.0121], sd_time_offset=[None, 1e-5]).to_csv(rigs, index=False)
    again = calibration_of(formats.read(tmp_path))
    assert again.offsets.tolist() == [0.0, 0.0121]
    assert again.sd_offsets.tolist() == [np.inf, 1e-5]
    assert again.adjust().offsets["b"].sd[0] < 1e-5
    frames = pandas.DataFrame({"frame": ["a01"], "rig": ["rig"], "photo": ["b01"], "sensor": ["b"]})
    frames.to_csv(tmp_path / "frames.csv", index=False)
    with refusal("plain.frame-offset rig=rig sensor=b"):
        formats.read(tmp_path)


def test_what_is_known_of_an_offset_is_written(tmp_path):
    found = rig().with_offsets({"b": (0.0119, 1e-5)}).adjust()
    for name, content in formats.to_files(adjusted_project(found), "plain").items():
        (tmp_path / name).write_bytes(content)
    again = calibration_of(formats.read(tmp_path))
    assert (again.offsets[1], again.sd_offsets[1]) == (0.0119, 1e-5)
    second = again.adjust().offsets["b"]
    assert second.values[0] == pytest.approx(found.offsets["b"].values[0], abs=1e-8)
    assert second.sd[0] == pytest.approx(found.offsets["b"].sd[0], rel=1e-3)


def test_times_of_a_synchronised_rig_are_written_for_whoever_doubts_it(tmp_path):
    known = rig().replace(sync="known", motion=None)
    for name, content in formats.to_files(project_of(known), "plain").items():
        (tmp_path / name).write_bytes(content)
    assert (tmp_path / "frames.csv").read_text().startswith("frame,rig,photo,time\n")
    again = calibration_of(formats.read(tmp_path))
    assert again.corners.times == pytest.approx(known.corners.times)
    found = again.replace(sync="offset").adjust()
    assert found.offsets["b"].values[0] == pytest.approx(LATE, abs=5e-4)
    done = CliRunner().invoke(
        app,
        ["calibrate", str(tmp_path), "--sync", "offset", "--out", str(tmp_path / "out"), "--no-html"],
    )
    assert done.exit_code in (0, 4), done.output
    assert re.search(r"clock +of b", (tmp_path / "out" / "report.txt").read_text())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return corners and a board as users have them."""
    found, corners = tmp_path_factory.mktemp("clocks"), rig().corners
    table = {
        "image": np.array(corners.pictures)[corners.picture],
        "camera": np.array(["a", "b"])[corners.cameras[corners.picture]],
        "view": corners.views[corners.picture],
        "time": corners.times[corners.picture],
        "point": corners.point,
        "x": corners.xy[:, 0],
        "y": corners.xy[:, 1],
    }
    pandas.DataFrame(table).to_csv(found / "corners.csv", index=False)
    (found / "board.toml").write_text(
        'kind = "chessboard"\ncolumns = 9\nrows = 6\nspacing = 0.03\nshape = "held"\n'
        "picture_size = [640, 480]\n"
    )
    return found


def test_what_is_known_of_an_offset_weighs_it(folder):
    known = {"sd0": 0.1, "sync": "offset", "model": "opencv4"}
    free = read(folder, **known).adjust().offsets["b"]
    weighed = read(folder, **known, offsets={"b": (LATE, 1e-5)}).adjust().offsets["b"]
    assert 2e-5 < free.sd[0] < 1e-4
    assert weighed.sd[0] == pytest.approx((1e10 + free.sd[0] ** -2) ** -0.5, rel=0.02)
    assert abs(weighed.values[0] - LATE) < 2e-5
    with refusal("targets.no-offset-of camera=a names=['b']"):
        read(folder, **known, offsets={"a": (0.0, 0.0)})
    with refusal("targets.no-offsets camera=b"):
        read(folder, sd0=0.1, model="opencv4", offsets={"b": (0.0, 0.0)})


def test_it_is_an_option_of_the_command(folder, tmp_path):
    def run(*words):
        out = ("--out", tmp_path / "out", "--no-html", "--cross-validate", "none")
        return CliRunner().invoke(app, ["calibrate", *map(str, (folder, *words, *out))])

    done = run("--sync", "offset", "--offset", "b=0.0119,1e-6", "--sd", "images=0.1")
    assert done.exit_code in (0, 4), done.output
    report = (tmp_path / "out" / "report.txt").read_text()
    (clock,) = [line.split() for line in report.splitlines() if re.match(r"clock +of b", line)]
    assert float(clock[-4]) == pytest.approx(0, abs=1e-6), clock
    assert float(clock[-6]) == 1e-6
    assert "54 points are fixed and not listed" in " ".join(report.split())
    for words, said in (
        (["--offset", "b=0"], "the camera b requires --sync offset"),
        (["--sync", "offset", "--offset", "b=x"], "must be CAMERA=S or CAMERA=S,SD"),
        (["--sync", "offset", "--offset", "b=1,-1"], "must be CAMERA=S or CAMERA=S,SD"),
    ):
        assert said in " ".join(run(*words).output.split()), words


def test_corners_are_drawn_where_the_board_is_at_their_time():
    given = rig(offsets=[0.0, LATE])
    drawn = simulate_corners(given, seed=3)
    assert np.sqrt((drawn.residuals() ** 2).mean()) == pytest.approx(0.1, rel=0.05)


def test_what_cannot_be_synchronised_is_refused():
    given = rig()
    with refusal("targets.no-shown-times"):
        given.replace(corners=given.corners.replace(times=None), motion=None)
    with refusal("targets.no-offset seconds=0.2"):
        rig(every=0.3)
    twice = given.corners.times.copy()
    twice[2:4] = twice[0]
    with refusal("targets.equal-times time=10.0"):
        given.replace(corners=given.corners.replace(times=twice), motion=None)
