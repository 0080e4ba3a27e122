"""Unknowns that observations have in common, and rigs: examples, results, coverage, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest

from example_scripts import load
from message_codes import as_check, raises
from photogram import (
    Attitudes,
    Distance,
    InputError,
    LeverArm,
    Position,
    RankError,
    Spheroid,
    adjust,
    predict,
    simulate,
)
from photogram.network import (
    Attitude,
    Base,
    Boresight,
    Drift,
    Instrument,
    Level,
    Line,
    Mount,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Plane,
    PlumbLine,
    Prior,
    Sensor,
    Shift,
    geocentric_to_geographic,
    geographic_to_geocentric,
    local_frames,
    rotation_matrix,
    with_gnss,
)

EXAMPLES = ("direct_georeferencing", "stereo_rig", "facade")
REALISATIONS = 60


@pytest.fixture(scope="module")
def scripts():
    return {name: load(name) for name in EXAMPLES}


def rotation_vector(matrix):
    return Attitudes(matrix[np.newaxis]).values("rotation_vector")[0]


def errors(name, script, result):
    """Return adjusted minus true values of unknowns, with their cofactors: a pair for each."""
    found = {(each.kind, each.name): each for each in result.unknowns}
    pairs = []
    if name == "direct_georeferencing":
        truth = script.TRUTH
        lever_arm, boresight = found["lever arm", "antenna"], found["boresight", "unit"]
        pairs.append((lever_arm.position - truth["lever arm"], lever_arm.cofactors))
        true = Attitudes.of("rotation_vector", truth["boresight"][np.newaxis]).matrices[0]
        pairs.append((rotation_vector(true.T @ boresight.attitude), boresight.cofactors))
        for k in range(4):
            for kind, values in (("shift", script.SHIFTS), ("drift", script.DRIFTS)):
                each = found[kind, f"strip {k + 1}"]
                pairs.append((each.position - values[k], each.cofactors))
    elif name == "stereo_rig":
        sensor = found["sensor", "right"]
        true = Attitudes.of("rotation_vector", script.TURN[np.newaxis]).matrices[0]
        turned = rotation_vector(true.T @ sensor.attitude)
        pairs.append((np.concatenate([sensor.position - script.POSITION, turned]), sensor.cofactors))
    else:
        instrument, plinth = found["instrument", "rangefinder"], found["level", "plinth"]
        pairs.append((instrument.position[:2] - [script.SCALE, script.CONSTANT], instrument.cofactors))
        edge, wall = found["plumb line", "edge"], found["plane", "wall"]
        pairs.append((edge.position[:2] - [4.0, -0.1], edge.cofactors))
        # The wall is Y = 0: n.p0 = d, n without turns about the axes in it.
        normal = wall.attitude[:, 2]
        turns = wall.attitude.T @ np.cross(normal, [0.0, -1.0, 0.0])
        distance = normal @ wall.position
        leaning = np.array([-distance, *-turns[:2]])
        assert np.abs(leaning[1:]).max() < 0.01
        pairs.append((leaning[1:], wall.cofactors[1:, 1:]))
        pairs.append((plinth.position[2:] - 0.3, plinth.cofactors))
        gutter = found["line", "gutter"]
        direction = np.array([1.0, 0.0, -0.01]) / np.hypot(1.0, 0.01)
        turns = gutter.attitude.T @ np.cross(gutter.attitude[:, 2], direction)
        pairs.append((-turns[:2], gutter.cofactors[2:, 2:]))
    return pairs


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_truth_lies_within_what_the_cofactors_say(name, scripts):
    """The mean of e' Q^-1 e over realisations is the number of unknowns, within four standard deviations."""
    script = scripts[name]
    forms, sizes, variances = [], [], []
    for seed in range(REALISATIONS):
        result = adjust(script.measured(seed))
        assert result.converged
        variances.append(result.variance_of_unit_weight)
        pairs = errors(name, script, result)
        forms.append([error @ np.linalg.solve(matrix, error) for error, matrix in pairs])
        sizes = [len(error) for error, _ in pairs]
    freedom = result.degrees_of_freedom
    assert abs(np.mean(variances) - 1) < 4 * np.sqrt(2 / freedom / REALISATIONS)
    for mean, size in zip(np.mean(forms, axis=0), sizes, strict=True):
        assert abs(mean / size - 1) < 4 * np.sqrt(2 / size / REALISATIONS), (mean, size)


@pytest.mark.parametrize("name", EXAMPLES)
def test_redundancy_numbers_sum_to_the_degrees_of_freedom(name, scripts):
    result = adjust(scripts[name].measured())
    total = np.nansum(result.redundancy) + sum(each.redundancy.sum() for each in result.kinds.values())
    total += sum(each.redundancy.sum() for each in result.unknowns)
    assert total == pytest.approx(result.degrees_of_freedom, abs=1e-7)
    sums = result.sums_of_squares
    assert sum(each.sum_of_squares for each in result.kinds.values()) == pytest.approx(sums.observations)


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_print_what_was_found(name, scripts, capsys):
    result = scripts[name].main()
    printed = capsys.readouterr().out
    for each in result.unknowns:
        assert each.name in printed


def test_report_table_and_document_tell_of_unknowns(scripts):
    result = adjust(scripts["direct_georeferencing"].measured())
    lever_arm = result.unknowns[0]
    rows = result.document().table("common-unknowns").frame()
    first = rows[rows["unknown"] == "antenna"].iloc[0]
    assert (first["component"], first["unit"], first["sd_given"]) == ("x", "m", 0.02)
    assert first["value"] == lever_arm.position[0]
    assert {"rad", "m/s"} < set(rows["unit"])
    table = result.unknown_table()
    assert len(table) == sum(len(each.components) for each in result.unknowns)
    assert table["sd"].tolist() == np.concatenate([each.sd for each in result.unknowns]).tolist()
    document = json.loads(result.to_json())
    assert [each["name"] for each in document["unknowns"]] == [each.name for each in result.unknowns]
    assert document["unknowns"][0]["covariance"] == lever_arm.covariance.tolist()
    assert lever_arm.redundancy[0] > 0
    expected = (lever_arm.given.position[0] - lever_arm.position[0]) / (
        0.02 * np.sqrt(lever_arm.redundancy[0])
    )
    assert lever_arm.standardized[0] == pytest.approx(expected)
    assert lever_arm.observations == 20
    with pytest.raises(ValueError, match="read-only"):
        lever_arm.change[0] = 0.0


def test_a_prior_with_full_covariance_is_what_weights_are(scripts):
    block = scripts["direct_georeferencing"].measured()
    weighted = adjust(block)
    lever_arm = LeverArm("antenna", weighted.unknowns[0].given.position)
    changed = [
        Position(
            each.photo,
            each.position,
            sd=each.sd,
            lever_arm=lever_arm,
            shift=each.shift,
            drift=each.drift,
            time=each.time,
        )
        if isinstance(each, Position)
        else each
        for each in block.observations
    ]
    prior = Prior(lever_arm, covariance=0.02**2 * np.eye(3))
    result = adjust(block.replace(observations=[*changed, prior]))
    np.testing.assert_allclose(result.unknowns[0].position, weighted.unknowns[0].position, atol=1e-9)
    np.testing.assert_allclose(result.unknowns[0].cofactors, weighted.unknowns[0].cofactors, rtol=1e-6)
    own = result.kinds["prior, lever arm"]
    assert own.components == ("x", "y", "z")
    np.testing.assert_allclose(own.redundancy[0], weighted.unknowns[0].redundancy, rtol=1e-6)
    assert result.degrees_of_freedom == weighted.degrees_of_freedom


def test_a_drift_counts_from_its_epoch():
    """What a shift is at the mean time, it is less the drift of the time between at another one."""
    simulated = simulate(strips=2, photos_per_strip=8, seed=3)
    block = with_gnss(simulated, shift_sd=0.5, drift_sd=0.01, seed=1).block
    drifts = {id(each): each for each in block.unknowns if isinstance(each, Drift)}
    dated = {key: each.replace(epoch=0.0) for key, each in drifts.items()}
    observations = [replace(each, drift=dated[id(each.drift)]) for each in block.observations]
    one, other = adjust(block), adjust(block.replace(observations=observations))
    np.testing.assert_allclose(other.photo_positions, one.photo_positions, atol=1e-6)
    for drift in drifts.values():
        mean = np.mean([each.time for each in block.observations if each.drift is drift])
        assert mean > 1
        found = [{(u.kind, u.name): u.position for u in r.unknowns} for r in (one, other)]
        moved = found[0]["shift", drift.name] - mean * found[0]["drift", drift.name]
        np.testing.assert_allclose(found[1]["shift", drift.name], moved, atol=1e-7)
        np.testing.assert_allclose(found[1]["drift", drift.name], found[0]["drift", drift.name], atol=1e-9)


def test_poses_on_frames_follow_from_these(scripts):
    result = adjust(scripts["stereo_rig"].measured())
    assert any(message.code == "free.minimum" for message in result.messages)
    matrices = Attitudes.of("omega_phi_kappa", result.photo_attitudes).matrices
    sensor = result.unknowns[0]
    for k in range(6):
        np.testing.assert_allclose(matrices[6 + k], matrices[k] @ sensor.attitude, atol=1e-12)
        arm = matrices[k] @ sensor.position
        np.testing.assert_allclose(result.photo_positions[6 + k], result.photo_positions[k] + arm, atol=1e-12)
    assert np.isfinite(result.photo_sd).all()
    # The first photo is held: the second camera there is known as well as its pose on the frame.
    frame = int(np.flatnonzero((result.photo_sd[:6, :3] == 0).all(axis=1))[0])
    rotated = matrices[frame] @ sensor.covariance[:3, :3] @ matrices[frame].T
    np.testing.assert_allclose(
        result.photo_covariances[6 + frame][:3, :3], rotated, atol=1e-9 * rotated.max()
    )
    # A known sensor, given as COLMAP has it.
    flip = np.diag([1.0, -1.0, -1.0])
    turned = (flip @ sensor.attitude @ flip).T
    translation = -turned @ flip @ sensor.position
    known = Sensor.from_colmap("right", turned, translation, sd=0.0)
    block = result.block
    mounts = [Mount(each.photo, each.frame, known) for each in block.mounts]
    again = adjust(block.replace(mounts=mounts, observations=()))
    np.testing.assert_allclose(again.unknowns[0].position, sensor.position, atol=1e-12)
    assert again.unknowns[0].sd.tolist() == [0.0] * 6
    assert len(again.block.unknowns) == 1
    with pytest.raises(InputError, check=as_check("error.at predict: error.value: block.unsupported.mounts")):
        predict(block.replace(observations=()))


def test_what_is_not_determined_is_named(scripts):
    block = scripts["direct_georeferencing"].measured()
    own = [each for each in block.observations if isinstance(each, Position)][:5]
    lever_arm, shift = LeverArm("antenna"), Shift("strip 1")
    positions = [
        Position(each.photo, each.position, sd=0.05, lever_arm=lever_arm, shift=shift) for each in own
    ]
    fixed = {"photo_position_sd": 0.0, "photo_attitude_sd": 0.0}
    angles = np.zeros_like(block.photo_attitudes)
    with raises(RankError, "adjust.undetermined"):
        adjust(block.replace(observations=positions, photo_attitudes=angles, **fixed))


@pytest.mark.parametrize("spheroid", [None, Spheroid.clarke_1866()], ids=["rectangular", "geographic"])
def test_unknowns_in_every_space(spheroid):
    """Exact observations of all kinds: the truth comes out."""
    simulation = simulate(
        strips=2, photos_per_strip=3, points_per_photo=15, check_points=0, spheroid=spheroid, seed=5
    )
    truth = simulation.truth
    stations = truth.photo_positions
    local = rotation_matrix(truth.photo_attitudes).transpose(0, 2, 1)
    rays = np.bincount(truth.image_points)
    chosen = np.flatnonzero(rays >= 4)[:4].tolist()
    plane = truth.point_positions
    if spheroid is None:
        frames = np.broadcast_to(np.eye(3), (len(stations), 3, 3))
        centres, points, place_frames = stations, plane, np.broadcast_to(np.eye(3), (len(plane), 3, 3))
        middle = np.eye(3)
    else:
        frames, place_frames = local_frames(stations), local_frames(plane)
        centres = geographic_to_geocentric(stations, spheroid)
        points = geographic_to_geocentric(plane, spheroid)
        middle = local_frames(np.median(stations, axis=0)[np.newaxis])[0]
    turned = frames.transpose(0, 2, 1) @ local
    arm, shift = np.array([0.3, -0.2, 1.1]), np.array([0.4, -0.3, 0.2])
    antennas = centres + turned @ arm + middle.T @ shift
    observed = antennas if spheroid is None else geocentric_to_geographic(antennas, spheroid)
    matrix = Attitudes.of("rotation_vector", [[0.02, -0.03, 0.05]]).matrices[0]
    lever_arm, offset, boresight = LeverArm("a", sd=1.0), Shift("s"), Boresight("b")
    level, tape = Level("l", float(plane[chosen[0], 2]) - 3.0), Instrument("i")
    through = plane[chosen[1]]
    line = PlumbLine("p", through)
    wall = Plane("w", [0.1, 0.2, 1.0], through)
    path = Line("t", [1.0, 0.1, 0.0], through)
    photos, names = truth.photo_ids, truth.point_ids
    observations = [
        *(Position(photos[k], observed[k], sd=0.01, lever_arm=lever_arm, shift=offset) for k in range(6)),
        *(Attitude(photos[k], local[k] @ matrix, sd=1e-4, boresight=boresight) for k in range(6)),
        *(
            OnLevel(names[p], level, 0.01, difference=float(plane[p, 2] - plane[chosen[0], 2] + 1.0))
            for p in chosen
        ),
        OnPlumbLine(names[chosen[1]], line, sd=0.01),
        *(OnPlane(names[p], wall, 0.01) for p in chosen[:3]),
        *(OnLine(names[p], path, sd=[0.01, 0.02]) for p in chosen[:2]),
        *(
            Distance(
                names[p], names[q], 1.001 * float(np.linalg.norm(points[p] - points[q])) + 0.5, 0.01, tape
            )
            for p, q in zip(chosen, [*chosen[1:], chosen[0]], strict=True)
        ),
    ]
    block = simulation.block.replace(image_xy=truth.image_xy, observations=observations)
    result = adjust(block)
    assert result.converged
    found = {each.name: each for each in result.unknowns}
    sd = {name: np.maximum(each.sd, 1e-12) for name, each in found.items()}
    # Control carries errors of its own, so that the truth is only within a few standard deviations a priori.
    scale = np.sqrt(result.covariance_scale)

    def near(name, error):
        assert (np.abs(error) < 4 * sd[name] / scale + 1e-9).all(), (name, error, sd[name])

    near("a", found["a"].position - arm)
    near("s", found["s"].position - shift)
    near("b", rotation_vector(matrix.T @ found["b"].attitude))
    near("i", found["i"].position[:2] - [1.001, 0.5])
    near("l", found["l"].position[2] - (plane[chosen[0], 2] - 1.0))
    # The plane goes through its three points, the line through its two.
    frame = place_frames[chosen[1]]
    at = (
        geographic_to_geocentric(found["w"].position[np.newaxis], spheroid)[0]
        if spheroid
        else found["w"].position
    )
    xyz = geographic_to_geocentric(result.point_positions, spheroid) if spheroid else result.point_positions
    off = (xyz[chosen[:3]] - at) @ frame.T @ found["w"].attitude[:, 2]
    assert np.abs(off).max() < 1e-6
    at = (
        geographic_to_geocentric(found["t"].position[np.newaxis], spheroid)[0]
        if spheroid
        else found["t"].position
    )
    off = (xyz[chosen[:2]] - at) @ frame.T @ found["t"].attitude[:, :2]
    assert np.abs(off).max() < 1e-6
    assert result.kinds["on plane"].redundancy.sum() == pytest.approx(0.0, abs=1e-8)
    names = ("east", "north") if spheroid else ("X", "Y")
    assert result.kinds["on plumb line"].components == names


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LeverArm("", 0.0), "name of a lever arm"),
        (lambda: LeverArm("a", [0, 0]), "value of lever arm a"),
        (lambda: LeverArm("a", [0, np.nan, 0]), "lever arm a"),
        (lambda: Shift("s", sd=-1.0), "error.not-negative"),
        (lambda: Drift("d", sd=[1.0, 1.0]), "sd of drift d"),
        (lambda: Drift("d", epoch=np.nan), "epoch of drift d"),
        (lambda: Boresight("b", 2 * np.eye(3)), "error.kind"),
        (lambda: Sensor("s", [0, 0, 0], -np.eye(3)), "error.kind"),
        (lambda: Plane("p", [0, 0, 0], [0, 0, 0]), "error.kind"),
        (lambda: Line("l", [0, np.inf, 0], [0, 0, 0]), "direction of line l"),
        (lambda: Level("h", "high"), "height of level h: must be a number"),
        (lambda: Instrument("i", np.nan), "error.finite"),
        (lambda: OnPlane("1", Level("h", 0.0), 1.0), "error.kind"),
        (lambda: OnLevel("1", None, 1.0), "error.kind"),
        (lambda: Position("1", [0, 0, 0], 1.0, lever_arm=Shift("s")), "error.kind"),
        (
            lambda: Attitude("1", np.eye(3), 1.0, boresight=Shift("s")),
            "error.kind",
        ),
        (lambda: Prior("lever arm", sd=1.0), "error.kind"),
        (lambda: Mount("1", "2", "sensor"), "error.kind"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with raises(InputError, message):
        make()


def test_a_block_refuses_mounts_and_names_that_contradict_it(scripts):
    block = scripts["stereo_rig"].measured()
    first = block.mounts[0]
    sensor = first.sensor
    with raises(InputError, "error.absent"):
        block.replace(mounts=[Mount("left 1", "left 9", sensor)])
    with raises(InputError, "error.repeated"):
        block.replace(mounts=[first, first])
    with raises(InputError, "block.mounted-frame"):
        block.replace(mounts=[first, Mount("left 1", "left 2", sensor)])
    with raises(InputError, "error.kind"):
        block.replace(mounts=["right 1"])
    with raises(InputError, "block.value.mounted"):
        block.replace(photo_position_sd=1.0)
    other = Sensor("right", [0.5, 0, 0])
    with raises(InputError, "block.repeated-object"):
        block.replace(observations=[Base(None, other, 0.5, 0.1)])
    with raises(InputError, "error.repeated"):
        Base(sensor, sensor, 0.5, 0.1)
