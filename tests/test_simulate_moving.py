"""Simulated blocks that move: rolling shutters and line scanners, their truth, their plans, their files."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from message_codes import raises
from photogram import (
    Attitudes,
    Block,
    Camera,
    Distance,
    InputError,
    Position,
    Refraction,
    Result,
    Simulation,
    Spheroid,
    adjust,
    formats,
    plan,
    predict,
    simulate,
)
from photogram.adjustment.prediction import at_adjusted
from photogram.formats.description import agreement
from photogram.network import LineScanner, Polynomial, RollingShutter, Spline, Trajectory
from photogram.network.projecting import projected_images

DRONE: dict[str, Any] = {
    "strips": 3,
    "photos_per_strip": 5,
    "principal_distance": -8.8,
    "frame_size": 10.0,
    "flying_height": 80.0,
    "relief": 6.0,
    "points_per_photo": 50,
    "image_sd": 0.002,
    "control_sd": 0.01,
    "position_error": 0.5,
    "position_sd": 0.03,
}
AIRCRAFT: dict[str, Any] = {
    "strips": 2,
    "photos_per_strip": 5,
    "points_per_photo": 40,
    "control_sd": 0.05,
    "position_error": 1.0,
    "attitude_error": 1e-3,
    "position_sd": 0.05,
    "attitude_sd": 1e-4,
}
SLOW = {"every": 5.0, "position": Spline(every=20.0), "rotation": Spline(every=10.0)}
SEEDS = 12


def drone(seed: int = 0, readout: float = 0.03, **motion: Any) -> Simulation:
    return simulate(**DRONE, seed=seed, motion=RollingShutter(readout, **motion))


def aircraft(seed: int = 0, **motion: Any) -> Simulation:
    return simulate(**AIRCRAFT, seed=seed, motion=LineScanner(**{**SLOW, **motion}))


def squares(result: Result, truth: Block) -> float:
    """Mean of squared errors of coordinates of points that are not fixed, divided by their variances."""
    free = (result.point_sd > 0) & result.used_points[:, np.newaxis]
    return float((((result.point_positions - truth.point_positions) / result.point_sd)[free] ** 2).mean())


# Rolling shutters


@pytest.mark.parametrize(
    ("direction", "axis", "edges"),
    [("down", 1, (5, -5)), ("up", 1, (-5, 5)), ("right", 0, (-5, 5)), ("left", 0, (5, -5))],
)
def test_images_are_those_of_the_pose_at_the_time_of_their_own_row(direction, axis, edges):
    truth = drone(direction=direction).truth
    shutter = truth.timed[0].shutter
    assert shutter.edges == edges
    photos = truth.image_photos
    times = 0.03 * (truth.image_xy[:, axis] - edges[0]) / (edges[1] - edges[0])
    assert ((times > 0) & (times < 0.03)).all()
    velocities, rates = (
        np.array([getattr(each, name) for each in truth.timed])[photos] * times[:, np.newaxis]
        for name in ("velocity", "rotation_rate")
    )
    axes = Attitudes.of("omega_phi_kappa", truth.photo_attitudes).matrices[photos]
    axes = axes @ Attitudes.of("rotation_vector", rates).matrices
    seen = truth.point_positions[truth.image_points] - truth.photo_positions[photos] - velocities
    u = np.einsum("nji,nj->ni", axes, seen)
    np.testing.assert_allclose(-8.8 * u[:, :2] / u[:, 2:], truth.image_xy, atol=1e-9)


def test_photos_fly_along_their_strips_and_back():
    truth = drone().truth
    velocities = np.array([each.velocity for each in truth.timed])
    assert np.abs(velocities[:5] - [9, 0, 0]).max() < 1.5
    assert np.abs(velocities[5:10] - [-9, 0, 0]).max() < 1.5
    times = np.array([each.time for each in truth.timed])
    assert (np.diff(times[:5]) > 0).all()
    assert (np.diff(times[5:10]) < 0).all()
    assert times[9] > times[4]


def test_what_is_given_of_motion_has_its_standard_deviations():
    simulation = drone(speed_sd=0.2, rate_sd=0.05, readout_sd=0.004)
    for name, sd in (("velocity", 0.2), ("rotation_rate", 0.05)):
        given, true = (
            np.array([getattr(each, name) for each in block.timed])
            for block in (simulation.block, simulation.truth)
        )
        assert (given - true).std() == pytest.approx(sd, rel=0.4)
    readout = simulation.block.timed[0].readout
    assert readout.deviations[0] == 0.004
    assert 0 < abs(readout.value - 0.03) < 0.016
    free = drone(speed_sd=np.inf, rate_sd=0.05).block.timed
    assert free[0].readout.value == 0.015
    np.testing.assert_array_equal([each.velocity for each in free[:5]], np.tile([9.0, 0.0, 0.0], (5, 1)))


@pytest.mark.parametrize(
    "motion", [{}, {"direction": "left", "rate_sd": 0.01}, {"readout_sd": 0.002, "speed_sd": 0.5}]
)
def test_errors_of_rolling_blocks_agree_with_their_covariance(motion):
    points, variances, readouts, velocities = [], [], [], []
    for seed in range(SEEDS):
        simulation = drone(seed, **motion)
        result = adjust(simulation.block)
        assert result.converged
        variances.append(result.variance_of_unit_weight)
        points.append(squares(result, simulation.truth) * result.variance_of_unit_weight)
        readout = next(each for each in result.unknowns if each.kind == "readout")
        readouts.append((readout.position[0] - 0.03) ** 2 / readout.cofactors[0, 0])
        for each in simulation.truth.timed:
            own = result.trajectories[each.photo]
            velocities.append(((own.position[1] - each.velocity) / own.position_sd[1]) ** 2)
    assert np.mean(variances) == pytest.approx(1, abs=0.04)
    assert np.mean(points) == pytest.approx(1, abs=0.12)
    assert 0.2 < np.mean(readouts) < 2.5
    assert np.mean(velocities) == pytest.approx(1, abs=0.15)


def test_a_block_taken_to_stand_still_does_not_fit():
    block = drone().block
    still = adjust(block.replace(timed=()))
    assert still.variance_of_unit_weight > 5
    assert adjust(block).variance_of_unit_weight < 1.3


def test_cameras_with_distortion_in_pixels():
    camera = Camera("simple_radial", {"f": 3600.0, "cx": 2050.0, "cy": 2040.0, "k": -0.03}, name="drone")
    simulation = simulate(**DRONE, motion=RollingShutter(0.03), cameras=[camera])
    shutter = simulation.truth.timed[0].shutter
    assert shutter.edges == pytest.approx((2040 - 3600 * 5 / 8.8, 2040 + 3600 * 5 / 8.8))
    np.testing.assert_allclose(projected_images(simulation.truth), simulation.truth.image_xy, atol=1e-9)
    result = adjust(simulation.block)
    assert result.variance_of_unit_weight == pytest.approx(1, abs=0.15)


def test_edges_of_pictures_are_known_where_cameras_are_not():
    cameras = [
        Camera("simple_radial", {"f": f, "cx": 2050.0, "cy": 2040.0, "k": -0.03}, name=name)
        for f, name in ((3600.0, "one"), (3700.0, "two"))
    ]
    start = [each.replace(parameters={**each.parameters, "f": 3650.0, "cy": 2000.0}) for each in cameras]
    simulation = simulate(**DRONE, motion=RollingShutter(0.03), cameras=cameras, start_cameras=start)
    for true, given in zip(simulation.truth.timed, simulation.block.timed, strict=True):
        assert true.shutter.edges == given.shutter.edges
    shutters = {id(each.shutter) for each in simulation.block.timed}
    assert len(shutters) == 2
    assert simulation.block.timed[0].shutter.edges[1] < simulation.block.timed[1].shutter.edges[1]


def test_attitudes_of_photos_that_move_are_observed():
    simulation = simulate(**DRONE, attitude_sd=2e-3, motion=RollingShutter(0.03))
    assert len(simulation.block.observations) == 15
    assert np.isinf(simulation.block.photo_attitude_sd).all()
    assert adjust(simulation.block).variance_of_unit_weight == pytest.approx(1, abs=0.15)
    assert predict(simulation.truth).converged


# Line scanners


def test_points_are_on_the_line_of_sensors_when_they_are_seen():
    truth = aircraft().truth
    assert len(truth.photo_ids) == 6
    assert truth.photo_ids[:3] == ["01 forward", "01 nadir", "01 backward"]
    ahead = 152.74 * np.tan(0.35)
    for row, (own, place) in enumerate(zip(truth.timed, [ahead, 0.0, -ahead] * 2, strict=True)):
        images = truth.image_photos == row
        xy = truth.image_xy[images]
        assert ((xy >= 0) & (xy <= [23000, np.inf])).all()
        times = own.lines.times(xy[:, 1])
        given = (np.array([each.position for each in part]) for part in own.trajectory.coefficients)
        places, matrices, *_ = own.trajectory.flown(times, *given)
        seen = truth.point_positions[truth.image_points[images]] - places
        u = np.einsum("nji,nj->ni", matrices.reshape(-1, 3, 3), seen)
        focal = -152.74 * u[:, :2] / u[:, 2:]
        np.testing.assert_allclose(focal[:, 1], place, atol=1e-7)
        np.testing.assert_allclose(focal[:, 0], 0.01 * (xy[:, 0] - 11500), atol=1e-7)


@pytest.mark.parametrize("motion", [{}, {"lines": 2}, {"lines": 1, "view_angle": 0.0}])
def test_errors_of_scanned_blocks_agree_with_their_covariance(motion):
    points, variances, coefficients = [], [], []
    for seed in range(SEEDS):
        simulation = aircraft(seed, **motion)
        result = adjust(simulation.block)
        assert result.converged
        variances.append(result.variance_of_unit_weight)
        points.append(squares(result, simulation.truth) * result.variance_of_unit_weight)
        for true in simulation.truth.all_trajectories:
            own = result.trajectories[true.name]
            for part, values, sd in zip(
                true.coefficients,
                (own.position, own.rotation),
                (own.position_sd, own.rotation_sd),
                strict=True,
            ):
                errors = (values - np.array([each.position for each in part])) / sd
                coefficients.append((errors**2).mean())
    assert np.mean(variances) == pytest.approx(1, abs=0.03)
    assert np.mean(points) == pytest.approx(1, abs=0.15)
    assert np.mean(coefficients) == pytest.approx(1, abs=0.1)


def test_scenes_are_photos_with_trajectories_of_their_own():
    motion = LineScanner(lines=1, scenes=True, position=Polynomial(0), rotation=Polynomial(2))
    simulation = simulate(
        **{**AIRCRAFT, "position_sd": np.inf, "attitude_sd": np.inf}, side_overlap=0.55, motion=motion
    )
    block = simulation.block
    assert block.photo_ids[:2] == ["0101", "0102"]
    assert len(block.photo_ids) == len(block.all_trajectories) == 10
    assert not block.observations
    assert [each.rotation.count for each in block.all_trajectories] == [3] * 10
    result = adjust(block)
    assert result.variance_of_unit_weight == pytest.approx(1, abs=0.25)


def test_what_is_known_has_no_corrections():
    motion = LineScanner(**SLOW)
    known = simulate(**{**AIRCRAFT, "position_sd": 0.0, "attitude_error": 0.0}, motion=motion).block
    for each in known.all_trajectories:
        assert each.position is None
        assert each.rotation is None
    assert {each.KIND for each in known.observations} == {"attitude"}


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (5e5, 5.3e6, 140.0)])
@pytest.mark.parametrize("make", ["rolling", "scanner"])
def test_images_are_found_in_few_steps(make, origin, monkeypatch):
    """Images of scenes went on for the most steps there are, their last digits being rounded."""
    steps: list[int] = []
    flown = Trajectory.flown

    def counted(self, times, *coefficients):
        steps.append(len(times))
        return flown(self, times, *coefficients)

    monkeypatch.setattr(Trajectory, "flown", counted)
    if make == "rolling":
        truth = simulate(**DRONE, origin=origin, motion=RollingShutter(0.03)).truth
    else:
        bases = {"position": Polynomial(0), "rotation": Polynomial(2)}
        motion = LineScanner(lines=1, scenes=True, **bases)
        truth = simulate(**AIRCRAFT, side_overlap=0.55, origin=origin, motion=motion).truth
    assert len(steps) < 16 * len(truth.photo_ids)
    monkeypatch.undo()
    np.testing.assert_allclose(projected_images(truth), truth.image_xy, atol=1e-8)


# What is refused


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"readout": -0.01}, "error.range"),
        ({"readout": 0.03, "speed_sd": -1.0}, "error.not-negative"),
        ({"readout": 0.03, "direction": "sideways"}, "direction"),
        ({"lines": 4}, "error.whole-range"),
        ({"pitch": 0.0}, "error.range"),
        ({"position": 3}, "error.kind"),
        ({"rotation": Spline(every=4.0, smooth=(2, 1e-3))}, "error.not-applicable"),
    ],
)
def test_motions_that_cannot_be(arguments, words):
    with raises(InputError, words):
        RollingShutter(**arguments) if "readout" in arguments else LineScanner(**arguments)


def test_motion_is_of_rectangular_space_and_straight_rays():
    for more in ({"spheroid": Spheroid.wgs84()}, {"refraction": Refraction("standard")}):
        with raises(InputError, "error.not-applicable"):
            simulate(motion=RollingShutter(0.03), **more)
    with raises(InputError, "error.not-applicable"):
        simulate(motion=LineScanner(), cameras=[Camera("perspective", {"c": -150.0})])
    with raises(InputError, "error.kind"):
        simulate(motion="fast")
    with raises(InputError, "simulation.readout"):
        simulate(**DRONE, motion=RollingShutter(3.0))


# Plans


@pytest.mark.parametrize("make", [drone, aircraft])
def test_a_prediction_has_the_covariances_of_the_adjustment(make):
    simulation = make()
    predicted = predict(simulation.truth)
    assert predicted.formations == 1
    adjusted = adjust(simulation.block, unit_variance="unity")
    shared = predicted.used_points & (predicted.point_sd > 0).all(axis=1)
    np.testing.assert_allclose(predicted.point_sd[shared], adjusted.point_sd[shared], rtol=0.05)
    for name, own in predicted.trajectories.items():
        other = adjusted.trajectories[name]
        np.testing.assert_allclose(own.position_sd, other.position_sd, rtol=0.05)
        np.testing.assert_allclose(own.rotation_sd, other.rotation_sd, rtol=0.05)


def test_a_plan_says_what_points_would_be_were_the_readout_time_known():
    open_, known = (drone(readout_sd=sd, speed_sd=1.0).truth for sd in (np.inf, 0.0))
    made = plan({"open": open_, "known": known})
    first, second = made.patterns
    assert first.known_rms_sd == pytest.approx(second.points[-1].rms_sd, rel=1e-6)
    assert second.known_rms_sd is None
    assert all(own < sd for own, sd in zip(first.known_rms_sd, first.points[-1].rms_sd, strict=True))
    readout = first.motion[0]
    assert (readout.unknown, readout.unit) == ("readout time, camera 1", "s")
    assert readout.rms_sd == next(e.sd[0] for e in first.result.unknowns if e.kind == "readout")
    assert [each.unknown for each in second.motion] == ["velocity", "rate"]
    assert "readout time, camera 1, ms" in made.report()
    document = json.loads(made.to_json())
    assert document["patterns"][0]["rms_sd_known_readout"] == list(first.known_rms_sd)
    assert document["patterns"][0]["motion"][0]["rms_sd"] == readout.rms_sd
    # What is given of positions of photos that move is checked as that of photos that stand still.
    assert 0.05 < first.photos[0].redundancy < 0.95


def test_a_plan_of_a_scanner_has_the_poses_of_its_trajectories():
    made = plan({"three": aircraft().truth, "one": aircraft(lines=2).truth})
    position, rotation = made.patterns[0].motion
    assert (position.unit, rotation.unit) == ("m", "rad")
    assert position.rms_sd < position.max_sd < 0.2
    assert "position of trajectories, m" in made.report()
    groups = {each.group: each.points for each in made.patterns[0].points}
    assert groups["interior"] > 50
    assert b"Motion" in made.to_html()


def test_predictions_refuse_what_does_not_agree():
    simulation = aircraft()
    moved = [
        replace(each, position=np.asarray(each.position) + 1.0) for each in simulation.truth.observations[:1]
    ]
    with raises(InputError, "predict.disagrees"):
        predict(simulation.truth.replace(observations=moved))
    far = Distance(*simulation.truth.point_ids[:2], 100.0, 0.01)
    with raises(InputError, "predict.observation"):
        predict(simulation.truth.replace(observations=[far]))
    places = simulation.truth.point_positions.copy()
    places[0, 2] = 9000.0
    with raises(InputError, "predict.unseen"):
        predict(simulation.truth.replace(point_positions=places))
    with pytest.raises(InputError, match="the plan of an adjusted block"):
        at_adjusted(adjust(simulation.block))


# Files and commands


FLIGHT = shlex.split(
    "--strips 3 --photos-per-strip 5 --principal-distance -8.8 --frame-size 10 --flying-height 80 --relief 6"
    " --points-per-photo 50 --image-sd 0.002 --control-sd 0.01 --position-error 0.5 --position-sd 0.03"
)
PLANE = shlex.split(
    "--strips 2 --photos-per-strip 5 --points-per-photo 40 --position-error 1 --attitude-error 0.001"
    " --position-sd 0.05 --attitude-sd 1e-4"
)


@pytest.mark.parametrize(
    ("options", "expected", "members"),
    [
        ([*FLIGHT, "--readout", "0.03"], drone, {"readouts", "motions"}),
        ([*PLANE, "--scanner", "3", "--every", "5"], None, {"trajectories"}),
    ],
    ids=["rolling", "scanner"],
)
def test_simulate_writes_tables_that_are_adjusted(run, options, expected, members):
    assert run("simulate", "made", *options).exit_code == 0
    result = adjust(formats.read(Path("made")).block)
    assert result.converged
    truth = json.loads(Path("made", "truth.json").read_bytes())
    assert members <= truth.keys()
    true = {each["id"]: each["position"] for each in truth["points"]}
    errors = (result.point_positions - [true[name] for name in result.block.point_ids]) / result.point_sd
    free = result.point_sd > 0
    assert (errors[free] ** 2).mean() == pytest.approx(1, abs=0.35)
    if expected is not None:
        direct = adjust(expected().block)
        rows = [result.block.point_ids.index(name) for name in direct.block.point_ids]
        apart = (result.point_positions[rows] - direct.point_positions) / np.where(
            free, result.point_sd, 1.0
        )[rows]
        assert np.abs(apart).max() < 1e-3
    adjusted = run("adjust", "made", "--quiet")
    assert adjusted.exit_code == 0, adjusted.output
    again = run("simulate", "made", *options)
    assert again.exit_code == 1
    assert "--overwrite" in again.stderr
    assert run("simulate", "made", *options, "--overwrite").exit_code == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--knots", "3"], "--knots"),
        (["--readout", "0.03", "--scanner", "1"], "--readout"),
        (["--readout", "0.03", "--pitch", "1"], "must not be combined with --readout"),
        (["--scanner", "3", "--rate", "1"], "must not be combined with --scanner"),
    ],
)
def test_options_of_motion_that_go_with_nothing(run, options, words):
    done = run("simulate", "made", *options)
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())


def test_plan_takes_motion(run):
    done = run("plan", *FLIGHT, "--readout", "0.03", "--against", "none")
    assert done.exit_code == 0, done.output
    assert "readout time, camera 1, ms" in done.output
    assert "if the readout time is known" in done.output
    done = run("plan", *PLANE, "--scanner", "3", "--every", "5")
    assert done.exit_code == 0, done.output
    assert "rotation of trajectories, arcsec" in done.output


@pytest.mark.parametrize("make", [drone, aircraft])
def test_what_lies_at_a_path_is_measured_with_its_motion(make):
    truth = make().truth
    project = formats.Project(
        block=truth,
        path=Path("made"),
        title="made",
        sizes=(None,) * max(1, len(truth.cameras)),
        pixel_mm=(None,) * max(1, len(truth.cameras)),
        starts=truth.point_positions,
    )
    found = agreement(project)
    assert len(found.xy) > 100
    assert found.median < 1e-7
    moved = project.replace(
        block=truth.replace(timed=[replace(each, shutter=None) for each in truth.timed])
        if make is drone
        else truth.replace(timed=())
    )
    assert agreement(moved).median > 0.01


def test_records_are_at_times_of_their_own():
    block = aircraft().block
    times = [each.time for each in block.observations if isinstance(each, Position)]
    assert len(times) == len(set(times)) > 50
