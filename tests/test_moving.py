"""Golden data of poses as functions of time: an independent dense program, partials by complex step.

Tolerances are those of its README unless a comment says why not.
"""

import numpy as np
import pytest

from example_scripts import load
from golden_data import golden as golden_file
from message_codes import as_check, raises
from photogram import Block, Camera, InputError, Position, Spheroid, adjust
from photogram.network import (
    Attitude,
    Boresight,
    Clock,
    Control,
    GyroBias,
    Lines,
    LineSensor,
    Polynomial,
    Rate,
    Readout,
    Sensor,
    Shutter,
    Smoothness,
    Spline,
    Table,
    Timed,
    Trajectory,
    Velocity,
    projected,
)


def golden(name):
    """Return inputs and solution of a golden network."""
    data = golden_file("moving", f"{name}.json")
    return data["inputs"], data["solution"]


def covariances(kind):
    """Return (n, r, r) of a kind of observation."""
    each = kind["covariance"].get("each")
    own = np.array(kind["covariance"]["all"] if each is None else each)
    return own if own.ndim == 3 else np.broadcast_to(own, (len(kind["observed"]), *own.shape))


def deviations(kind, shape):
    """Return standard deviations of priors, as coefficients have them."""
    return np.sqrt(covariances(kind)[:, 0, 0]).reshape(shape)


def exponential(r):
    """Return the rotation by a vector."""
    angle = np.linalg.norm(r)
    x, y, z = r
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if angle < 1e-12:
        return np.eye(3) + k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def basis(given, prior):
    """Return a basis with its priors."""
    own = {"value": np.reshape(prior["observed"], (-1, 3)), "sd": deviations(prior, (-1, 3))}
    if given["kind"] == "polynomial":
        return Polynomial(given["degree"], given["reference"], given["scale"], **own)
    return Spline(knots=given["knots"], degree=given["degree"], **own)


def trajectory(name, given, position, rotation, body=None):
    """Return a trajectory of a golden network with the priors of its coefficients."""
    table = Table(
        given["times"],
        given["positions"],
        given["attitude_times"],
        given["matrices_photo_to_object"],
        velocities=given["velocities"],
        interpolation=given["position_interpolation"],
    )
    position, rotation = basis(given["position_basis"], position), basis(given["attitude_basis"], rotation)
    return Trajectory(name, table, position=position, rotation=rotation, body=body)


def lines(given):
    """Return the times of the lines of an image."""
    return Lines(given["rows"])


def scanners(kinds, points, cameras, **more):
    """Return the block of the images of scanners, a photo for each kind of observation."""
    photos = len(kinds)
    own = {
        "photo_positions": np.zeros((photos, 3)),
        "photo_attitudes": np.zeros((photos, 3)),
        "point_positions": points,
        "image_photos": np.repeat(np.arange(photos), [len(each["point"]) for each in kinds]),
        "image_points": np.concatenate([each["point"] for each in kinds]),
        "image_xy": np.concatenate([each["observed"] for each in kinds]),
        "image_sd": np.sqrt(covariances(kinds[0])[0, 0, 0]),
        "cameras": cameras,
        "photo_cameras": np.zeros(photos, dtype=int),
    }
    return Block(**own | more)


def controls(kind):
    """Return control points with full covariances."""
    together = zip(kind["point"], kind["observed"], covariances(kind), strict=True)
    return [Control(str(point), xyz, covariance=q) for point, xyz, q in together]


def agree(result, solution, images, *, sums=1e-8, redundancy=1e-8, residuals=1e-8):
    """Assert degrees of freedom, sums of squares, redundancy numbers and residuals of images."""
    assert result.degrees_of_freedom == solution["degrees_of_freedom"]
    assert result.sums_of_squares.total == pytest.approx(solution["sum_of_squares"], rel=sums)
    truth = [solution["kinds"][name] for name in images]
    expected = np.concatenate([each["redundancy"] for each in truth])
    np.testing.assert_allclose(result.redundancy, expected, rtol=0, atol=redundancy)
    expected = np.concatenate([each["residuals"] for each in truth])
    np.testing.assert_allclose(
        result.residuals, expected, rtol=0, atol=residuals * result.block.image_sd.max()
    )
    parts = result.redundancy.sum() + sum(each.redundancy.sum() for each in result.unknowns)
    parts += sum(each.redundancy.sum() for each in result.kinds.values()) + np.nansum(result.point_redundancy)
    assert parts == pytest.approx(solution["degrees_of_freedom"], abs=1e-6)


def coefficients(result, trajectory, which):
    """Return (K, 3) adjusted coefficients, and their (3 K, 3 K) cofactors."""
    own = trajectory.coefficients[which]
    found = {id(each.given): each for each in result.unknowns}
    values = np.array([found[id(each)].position for each in own])
    q = result.covariance([("unknown", each.name) for each in own]) / result.covariance_scale
    return values, q


def solved(result, solution, name, trajectory, which, *, unknowns=1e-6, cofactors=1e-8):
    """Assert the coefficients of a trajectory, and their cofactors among each other."""
    truth, q = solution["unknowns_solved"][name], np.array(solution["cofactors"][name])
    value, sd = np.array(truth["value"]), np.array(truth["sd"])
    ours, own = coefficients(result, trajectory, which)
    assert (np.abs(ours - value) < unknowns * sd).all(), np.abs((ours - value) / sd).max()
    scale = np.sqrt(np.outer(np.diag(q), np.diag(q)))
    np.testing.assert_allclose(own / scale, q / scale, rtol=0, atol=cofactors)


def solved_points(result, solution, *, unknowns=1e-6, cofactors=1e-8):
    """Assert points and their standard deviations."""
    truth = solution["unknowns_solved"]["points"]
    value, sd = np.array(truth["value"]), np.array(truth["sd"])
    assert (np.abs(result.point_positions - value) < unknowns * sd).all()
    own = np.sqrt(np.einsum("nkk->nk", result.point_cofactors))
    np.testing.assert_allclose(own, sd, rtol=cofactors)


def test_rolling_shutter():
    inputs, solution = golden("rolling_shutter")
    camera, given, initial = inputs["camera"], inputs["observations"], inputs["initial"]
    images, gnss, velocity, rate = (given[k] for k in ("image", "gnss", "gnss_velocity", "rate_given"))
    shutter = Shutter(Readout("readout", initial["readout"]["value"][0]), (0.0, camera["height"]))
    free = [np.inf] * 3

    def uniform(known, k):
        own = np.sqrt(np.diag(covariances(known)[k]))
        return {"sd": [free, own]}, known["observed"][k]

    def moving(k):
        (sd, v), (turning, w) = uniform(velocity, k), uniform(rate, k)
        matrix = inputs["photos"]["matrix_photo_to_object"][k]
        position = Polynomial(1, value=[initial["position"]["value"][k], v], **sd)
        rotation = Polynomial(1, value=[[0.0] * 3, w], **turning)
        return Trajectory(
            f"photo {k}", Table([0.0], [np.zeros(3)], [0.0], [matrix]), position=position, rotation=rotation
        )

    own = [moving(k) for k in range(len(initial["position"]["value"]))]
    together = enumerate(zip(gnss["observed"], covariances(gnss), strict=True))
    arm, after = gnss["lever_arm"], gnss["seconds_after_first_row"]
    block = Block(
        photo_positions=np.array(initial["position"]["value"]),
        photo_attitudes=np.zeros((len(own), 3)),
        cameras=[
            Camera("pinhole", {"fx": camera["f"], "fy": camera["f"], "cx": camera["cx"], "cy": camera["cy"]})
        ],
        point_positions=np.array(initial["points"]["value"]),
        image_photos=images["photo"],
        image_points=images["point"],
        image_xy=images["observed"],
        image_sd=0.5,
        timed=[Timed(str(k), each, shutter=shutter) for k, each in enumerate(own)],
        observations=[
            *(
                Position(None, xyz, covariance=q, lever_arm=arm, trajectory=own[k], time=after)
                for k, (xyz, q) in together
            ),
            *controls(given["control"]),
        ],
    )
    result = adjust(block, tolerance=1e-10)
    agree(result, solution, ["image"])
    solved_points(result, solution)
    truth = solution["unknowns_solved"]
    for k, each in enumerate(own):
        for which, names in enumerate((("position", "velocity"), ("rotation", "rate"))):
            values, q = coefficients(result, each, which)
            for row, name in enumerate(names):
                expected, sd = (np.array(truth[name][what][k]) for what in ("value", "sd"))
                assert (np.abs(values[row] - expected) < 1e-6 * sd).all()
                np.testing.assert_allclose(np.sqrt(np.diag(q))[3 * row : 3 * row + 3], sd, rtol=1e-8)
    found = next(each for each in result.unknowns if each.kind == "readout")
    assert found.position[0] == pytest.approx(
        truth["readout"]["value"][0], abs=1e-6 * truth["readout"]["sd"][0]
    )
    assert found.cofactors[0, 0] == pytest.approx(solution["cofactors"]["readout"][0][0], rel=1e-8)


def test_pushbroom_strips():
    inputs, solution = golden("pushbroom_strips")
    given, initial = inputs["observations"], inputs["initial"]
    clock = Clock("receiver", given["clock_given"]["observed"][0][0], sd=deviations(given["clock_given"], ()))
    boresight, arm = Boresight("imu"), initial["lever_arm"]["value"]
    own, observations = [], controls(given["control"])
    for k in (1, 2):
        strip = trajectory(
            f"strip {k}",
            inputs["trajectories"][k - 1],
            given[f"position{k}_given"],
            given[f"rotation{k}_given"],
        )
        own.append(strip)
        at = {"trajectory": strip, "clock": clock}
        gnss, imu = given[f"gnss{k}"], given[f"imu{k}"]
        for time, xyz, q in zip(gnss["time"], gnss["observed"], covariances(gnss), strict=True):
            observations.append(Position(None, xyz, covariance=q, lever_arm=arm, time=time, **at))
        together = (imu["time"], imu["reference_matrices"], imu["observed"], covariances(imu))
        for time, reference, turn, q in zip(*together, strict=True):
            attitude = np.array(reference) @ exponential(turn)
            observations.append(Attitude(None, attitude, covariance=q, boresight=boresight, time=time, **at))
    kinds = [given["image1"], given["image2"]]
    sensor = LineSensor((inputs["camera"]["pitch_mm"], 0.0), inputs["camera"]["samples"] / 2)
    timed = [Timed(str(k), own[k], lines=lines(inputs["line_rates"][k]), line_sensor=sensor) for k in (0, 1)]
    camera = Camera("perspective", {"c": inputs["camera"]["c_mm"]})
    block = scanners(kinds, initial["points"]["value"], [camera], timed=timed, observations=observations)
    result = adjust(block, tolerance=1e-10)
    agree(result, solution, ["image1", "image2"])
    solved_points(result, solution)
    for k in (0, 1):
        solved(result, solution, f"position{k + 1}", own[k], 0)
        solved(result, solution, f"rotation{k + 1}", own[k], 1)
    found = next(each for each in result.unknowns if each.kind == "clock")
    truth = solution["unknowns_solved"]["clock"]
    assert found.position[0] == pytest.approx(truth["value"][0], abs=1e-6 * truth["sd"][0])
    assert found.cofactors[0, 0] == pytest.approx(solution["cofactors"]["clock"][0][0], rel=1e-8)


def test_jitter():
    inputs, solution = golden("jitter")
    given, initial = inputs["observations"], inputs["initial"]
    strip = trajectory("orbit", inputs["trajectories"][0], given["position_given"], given["rotation_given"])
    smooth, turns = given["smoothness"], strip.coefficients[1]
    observations = [
        Smoothness(turns[k : k + 3], [1.0, -2.0, 1.0], observed, covariance=q)
        for k, (observed, q) in enumerate(zip(smooth["observed"], covariances(smooth), strict=True))
    ]
    points, sd = np.array(initial["points"]["value"]), np.full((150, 3), np.inf)
    control, plan, heights = (given[name] for name in ("control", "given_points", "heights"))
    for kind, columns in ((control, slice(0, 3)), (plan, slice(0, 2)), (heights, slice(2, 3))):
        points[kind["point"], columns] = kind["observed"]
        sd[kind["point"], columns] = np.sqrt(np.diagonal(covariances(kind), axis1=1, axis2=2))
    sensor = LineSensor((inputs["camera"]["pitch_mm"], 0.0), inputs["camera"]["samples"] / 2)
    mounts = [None, Sensor("forward", np.zeros(3), inputs["mounts"]["forward"], sd=0.0)]
    names = ["image_nadir", "image_forward"]
    timed = [
        Timed(str(k), strip, lines=lines(inputs["line_rates"][0]), line_sensor=sensor, sensor=mounts[k])
        for k in (0, 1)
    ]
    camera = Camera("perspective", {"c": inputs["camera"]["c_mm"]})
    kinds = [given[name] for name in names]
    block = scanners(kinds, points, [camera], timed=timed, observations=observations, point_sd=sd)
    result = adjust(block, tolerance=1e-10)
    agree(result, solution, names)
    solved_points(result, solution)
    solved(result, solution, "position", strip, 0)
    solved(result, solution, "rotation", strip, 1)


def test_three_line():
    inputs, solution = golden("three_line")
    given, initial = inputs["observations"], inputs["initial"]
    strip = trajectory("strip", inputs["trajectories"][0], given["position_given"], given["rotation_given"])
    names = ["image_forward", "image_nadir", "image_backward"]
    mounts = {}
    for name in ("forward", "backward"):
        prior = given[f"mount_{name}_given"]
        matrix = np.array(inputs["mounts"][name]) @ exponential(np.ravel(prior["observed"]))
        sd = [0.0] * 3 + deviations(prior, (3,)).tolist()
        mounts[name] = Sensor(name, np.zeros(3), matrix, sd=sd)
    gnss = given["gnss"]
    together = zip(gnss["time"], gnss["observed"], covariances(gnss), strict=True)
    observations = [
        Position(None, xyz, covariance=q, trajectory=strip, time=time) for time, xyz, q in together
    ] + controls(given["control"])
    camera = inputs["camera"]
    sensor = LineSensor((camera["pitch_mm"], 0.0), camera["samples"] / 2)
    timed = [
        Timed(
            str(k),
            strip,
            lines=lines(inputs["line_rates"][0]),
            line_sensor=sensor,
            sensor=mounts.get(name.removeprefix("image_")),
        )
        for k, name in enumerate(names)
    ]
    lens = Camera("brown", {"c": camera["c_mm"], "K1": camera["k1"]})
    kinds = [given[name] for name in names]
    block = scanners(kinds, initial["points"]["value"], [lens], timed=timed, observations=observations)
    result = adjust(block, tolerance=1e-10)
    # A weighted mount is a rotation from the given one on; the golden program weighs the components of its
    # rotation vector from the nominal mount, which is the same to the size of that vector, 2e-3.
    agree(result, solution, names, sums=1e-6, redundancy=1e-6, residuals=1e-5)
    solved_points(result, solution, unknowns=1e-4, cofactors=1e-6)
    solved(result, solution, "position", strip, 0, unknowns=1e-4, cofactors=1e-6)
    solved(result, solution, "rotation", strip, 1, unknowns=1e-4, cofactors=1e-6)


def test_planetary_pair():
    inputs, solution = golden("planetary_pair")
    given, initial = inputs["observations"], inputs["initial"]
    w = inputs["body"]["w"]

    def body(time):
        c, s = np.cos(w * time), np.sin(w * time)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    orbits = []
    for k, own in enumerate(inputs["trajectories"], 1):
        ends = [own["times"][0], own["times"][-1]]
        priors = given[f"position{k}_given"], given[f"rotation{k}_given"]
        orbits.append(trajectory(f"orbit {k}", own, *priors, body=(ends, [body(t) for t in ends])))
    # Latitude, longitude, radius to longitude, latitude, height above a sphere.
    radius = 3390.0

    def placed(places):
        latitude, longitude, r = np.asarray(places).T
        return np.column_stack([longitude, latitude, r - radius])

    points = placed(initial["points"]["value"])
    sd = np.full(points.shape, np.inf)
    known, control = given["points_given"], given["control"]
    points[known["point"]] = placed(known["observed"])
    variances = np.diagonal(covariances(known), axis1=1, axis2=2)
    sd[known["point"]] = np.sqrt(variances)[:, [1, 0, 2]]
    observations = []
    for point, (latitude, longitude, r), q in zip(
        control["point"], control["observed"], covariances(control), strict=True
    ):
        turn = np.array([[0, r * np.cos(latitude), 0], [r, 0, 0], [0, 0, 1.0]])
        place = placed([[latitude, longitude, r]])[0]
        observations.append(Control(str(point), place, covariance=turn @ q @ turn.T))
    camera = inputs["camera"]
    sensor = LineSensor((camera["pitch_mm"], 0.0), camera["samples"] / 2, y0=camera["detector_y_mm"])
    timed = [
        Timed(str(k), orbits[k], lines=lines(inputs["line_rates"][k]), line_sensor=sensor) for k in (0, 1)
    ]
    lens = Camera("brown", {"c": camera["c_mm"], "K1": -camera["k0"]})
    names = ["image1", "image2"]
    block = scanners(
        [given[name] for name in names],
        points,
        [lens],
        timed=timed,
        observations=observations,
        point_sd=sd,
        spheroid=Spheroid(radius, radius),
        linear_unit="km",
    )
    result = adjust(block, tolerance=1e-10)
    # Errors of control are told here along east, north and up, there in latitude and longitude.
    agree(result, solution, names, sums=1e-6, redundancy=1e-6, residuals=2e-5)
    for k in (0, 1):
        solved(result, solution, f"position{k + 1}", orbits[k], 0, unknowns=1e-4, cofactors=5e-6)
        solved(result, solution, f"rotation{k + 1}", orbits[k], 1, unknowns=1e-4, cofactors=5e-6)


@pytest.mark.parametrize("case", ["pushbroom_strips", "rolling_shutter"])
def test_residuals_are_measured_less_projected(case, monkeypatch):
    found = {}

    def keep(result, *_, **__):
        found["result"] = result
        raise InterruptedError

    monkeypatch.setattr(f"{__name__}.agree", keep)
    with pytest.raises(InterruptedError):
        globals()[f"test_{case}"]()
    result = found["result"]
    for row, own in enumerate(result.block.timed):
        images = np.flatnonzero(result.block.image_photos == row)
        places = result.point_positions[result.block.image_points[images]]
        apart = result.block.image_xy[images] - result.project(own.photo, places)
        if own.lines is None:
            # v = (I - df/dt T/h e_row') apart: half a percent of a pixel.
            np.testing.assert_allclose(apart, result.residuals[images], rtol=0, atol=0.02)
        else:
            # Across the flight, but for what a line is turned against it.
            np.testing.assert_allclose(apart[:, 0] * 0.01, result.residuals[images, 0], rtol=0, atol=5e-4)


def flight(**bases):
    """Return a strip along X, 500 m above the ground, that bends and turns."""
    times = np.arange(0.0, 21.0)
    positions = np.column_stack([40.0 * times, 3.0 * np.sin(0.3 * times), 500.0 + np.cos(0.2 * times)])
    # Samples across the flight, lines along it.
    turned = [exponential([0.004 * np.sin(t), 0.003 * np.cos(t), -np.pi / 2 + 0.002 * t]) for t in times]
    return Trajectory("strip", Table(times, positions, times, turned), **bases)


SENSOR = LineSensor((0.01, 0.0), 3000.0, y0=0.2)
LENS = Camera("brown", {"c": -60.0, "K1": 1e-6, "xp": 0.02})
GROUND = np.array(
    [[x, y, 10.0 * np.sin(x)] for x in np.arange(200.0, 600.0, 60.0) for y in (-150.0, 0.0, 140.0)]
)


def test_points_project_to_where_they_are_measured():
    two = [flight(), flight()]
    object.__setattr__(two[1], "name", "back")
    forward = Sensor("forward", [0.1, 0.2, -0.3], exponential([0.3, 0.0, 0.01]), sd=0.0)
    clock = Clock("clock", 0.02, sd=0.0)
    rows = Lines([[0.0, 0.5, 0.004], [2000.0, 8.5, 0.0041]])
    timed = [
        Timed("0", two[0], lines=rows, line_sensor=SENSOR, offset=clock),
        Timed("1", two[1], lines=rows, line_sensor=SENSOR, sensor=forward),
    ]
    images = [projected(own, each, LENS, GROUND) for own, each in zip(timed, two, strict=True)]
    assert np.isfinite(images).all()
    own = {
        "photo_positions": np.zeros((2, 3)),
        "photo_attitudes": np.zeros((2, 3)),
        "point_positions": GROUND + 3.0,
        "point_sd": np.full(GROUND.shape, np.inf),
        "image_photos": np.repeat([0, 1], len(GROUND)),
        "image_points": np.tile(np.arange(len(GROUND)), 2),
        "image_xy": np.concatenate(images),
        "image_sd": 0.003,
        "cameras": [LENS],
        "photo_cameras": [0, 0],
        "timed": timed,
    }
    result = adjust(Block(**own))
    np.testing.assert_allclose(result.residuals, 0.0, atol=1e-8)
    np.testing.assert_allclose(result.point_positions, GROUND, atol=1e-6)
    again = [result.project(str(k), result.point_positions) for k in (0, 1)]
    np.testing.assert_allclose(again, images, rtol=0, atol=1e-5)


def test_a_pose_at_any_time_has_the_covariance_of_the_photo_there():
    strip = flight(position=Spline(every=5.0, sd=1.0), rotation=Spline(every=4.0, sd=1e-3, smooth=(2, 1e-4)))
    timed = Timed("0", strip, time=7.3)
    observations = [
        Position(None, strip.table.positions[k] + 0.1, sd=0.05, trajectory=strip, time=float(k))
        for k in range(2, 18)
    ]
    observations += [
        Velocity(None, [40.0, 0.5, 0.0], sd=0.1, trajectory=strip, time=9.25, lever_arm=[0.1, 1.0, -0.4]),
        Rate(None, [0.001, 0.002, 0.003], sd=1e-3, trajectory=strip, time=9.25),
    ]
    u = np.array([[0.1, 0.2, -1.0], [-0.3, 0.1, -1.0], [0.2, -0.2, -1.0], [-0.1, -0.25, -1.0]])
    camera = Camera("perspective", {"c": -60.0})
    block = Block(
        photo_positions=np.zeros((1, 3)),
        photo_attitudes=np.zeros((1, 3)),
        point_positions=GROUND[:4],
        point_sd=0.05,
        image_photos=np.zeros(4, dtype=int),
        image_points=np.arange(4),
        image_xy=projected(timed, strip, camera, GROUND[:4]) + 0.01 * u[:, :2],
        image_sd=0.01,
        cameras=[camera],
        photo_cameras=[0],
        timed=[timed],
        observations=observations,
    )
    result = adjust(block)
    pose = result.trajectories["strip"].poses([7.3])
    np.testing.assert_allclose(pose.positions, result.photo_positions, atol=1e-9)
    np.testing.assert_allclose(pose.sd[0, :3], result.photo_sd[0, :3], rtol=1e-9)
    total = result.redundancy.sum() + sum(each.redundancy.sum() for each in result.kinds.values())
    total += sum(each.redundancy.sum() for each in result.unknowns) + np.nansum(result.point_redundancy)
    assert total == pytest.approx(result.degrees_of_freedom, abs=1e-8)


@pytest.mark.parametrize("kind", ["velocity", "rate"])
def test_motions_that_were_observed_exactly_are_found(kind):
    # A coefficient that only the motion shows, at a time between records, with a clock that is behind.
    truth = np.array([0.3, -0.2, 0.1]) * (1.0 if kind == "velocity" else 1e-3)
    known = {"value": [[0.0] * 3, truth], "sd": 0.0}
    line = {"degree": 1, "reference": 10.0, "scale": 10.0}
    free = {"sd": [[0.0] * 3, [np.inf] * 3]}
    clock = Clock("clock", 0.3, sd=0.0)
    names = ("position", "rotation") if kind == "velocity" else ("rotation", "position")
    given = {names[0]: Polynomial(**line, **known), names[1]: Polynomial(**line, sd=0.0)}
    moved, unknown = flight(**given), flight(**given | {names[0]: Polynomial(**line, **free)})
    arm = np.array([0.5, -1.0, 2.0])
    bias = GyroBias("gyro", [1e-3, 2e-3, -1e-3], sd=0.0)

    def at(time):
        c = [np.array([each.position for each in part]) for part in moved.coefficients]
        places, turned, *_ = moved.flown(np.array([time + 0.3]), *c)
        return places[0], turned[0].reshape(3, 3)

    def observed(time):
        # Differences of the fourth order: of antennas, of attitudes.
        h = 1e-3
        after, before, far, back = (at(time + k * h) for k in (1, -1, 2, -2))
        place = lambda pose: pose[0] + pose[1] @ arm  # noqa: E731
        speed = (8 * (place(after) - place(before)) - (place(far) - place(back))) / (12 * h)
        a = at(time)[1].T @ ((8 * (after[1] - before[1]) - (far[1] - back[1])) / (12 * h))
        return speed, np.array([a[2, 1], a[0, 2], a[1, 0]])

    of = {"trajectory": unknown, "clock": clock}
    observations = []
    for time in (3.4, 9.1, 14.6):
        speed, rate = observed(time)
        if kind == "velocity":
            observations.append(Velocity(None, speed, sd=0.01, lever_arm=arm, time=time, **of))
        else:
            observations.append(Rate(None, rate + bias.position, sd=1e-4, bias=bias, time=time, **of))
    camera = Camera("perspective", {"c": -60.0})
    timed = Timed("0", unknown, time=5.0)
    block = Block(
        photo_positions=np.zeros((1, 3)),
        photo_attitudes=np.zeros((1, 3)),
        point_positions=GROUND[:3],
        point_sd=0.0,
        image_photos=[0, 0, 0],
        image_points=[0, 1, 2],
        image_xy=projected(timed, moved, camera, GROUND[:3]),
        image_sd=1e3,
        cameras=[camera],
        photo_cameras=[0],
        timed=[timed],
        observations=observations,
    )
    result = adjust(block, tolerance=1e-10)
    found = getattr(result.trajectories["strip"], names[0])[1]
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-7 * np.abs(truth).max() + 1e-10)


def test_the_example_of_a_rolling_shutter(capsys):
    result = load("rolling_shutter").main()
    readout = next(each for each in result.unknowns if each.kind == "readout")
    assert abs(readout.position[0] - 0.031) < 3 * readout.sd[0]
    told = capsys.readouterr().out
    assert told.startswith("readout time 3")
    assert "as if taken at once: sigma0" in told


def test_the_example_of_a_line_scanner(capsys):
    result = load("line_scanner").main()
    clock = next(each for each in result.unknowns if each.kind == "clock")
    assert abs(clock.position[0] - 0.012) < 3 * clock.sd[0]
    assert capsys.readouterr().out.count("\n") == 4
    assert [panel.up for panel in result.plot.trajectory().panels] == ["position, m", "rotation, rad"]
    with pytest.raises(InputError, check=as_check("error.unknown trajectory nowhere strip")):
        result.plot.trajectory(name="nowhere")
    with pytest.raises(InputError, match="must be in the span"):
        result.trajectories["strip"].poses([1e3])
    with pytest.raises(InputError, check=as_check("error.unknown photo on a trajectory none")):
        result.project("none", [[0.0, 0.0, 0.0]])


def test_known_readout_times_of_one_length_are_one():
    first, second, other = (Shutter(seconds, (0.0, 100.0)) for seconds in (0.02, 0.02, 0.03))
    assert first.readout is second.readout
    assert first.readout is not other.readout
    assert (first.readout.value, first.readout.is_held) == (0.02, True)


def test_a_scanner_without_a_trajectory_needs_the_time_of_its_pose():
    with pytest.raises(InputError, check=as_check("error.at photo A: error.requires lines")):
        Timed("A", lines=Lines([[0.0, 0.0, 0.01]]), line_sensor=SENSOR)


def test_a_factor_of_line_rates_counts_from_the_middle_of_the_images():
    strip, rows = flight(), Lines([[0.0, 0.5, 0.004], [2000.0, 8.5, 0.0041]])
    own = {"lines": rows, "line_sensor": SENSOR, "rate": Readout("rates", 1.002, sd=0.0)}
    with raises(InputError, "error.requires"):
        projected(Timed("0", strip, **own), strip, LENS, GROUND)
    time = 10.0
    for _ in range(20):
        images = projected(Timed("0", strip, time=time, **own), strip, LENS, GROUND)
        time = float(rows.times(images[:, 1]).mean())
    block = Block(
        photo_positions=np.zeros((1, 3)),
        photo_attitudes=np.zeros((1, 3)),
        point_positions=GROUND,
        point_sd=1.0,
        image_photos=np.zeros(len(GROUND), dtype=int),
        image_points=np.arange(len(GROUND)),
        image_xy=images,
        image_sd=0.003,
        cameras=[LENS],
        photo_cameras=[0],
        timed=[Timed("0", strip, **own)],
    )
    result = adjust(block)
    np.testing.assert_allclose(result.residuals, 0.0, atol=1e-8)
    np.testing.assert_allclose(result.project("0", GROUND), images, rtol=0, atol=1e-5)


def test_two_clocks_of_one_name_are_refused_at_one_time_too():
    strip = flight(position=Polynomial(0))
    records = [
        Position(None, [0.0, 0.0, 500.0], sd=0.1, trajectory=strip, time=3.0, clock=Clock("receiver"))
        for _ in range(2)
    ]
    empty = {"image_photos": [], "image_points": [], "image_xy": np.zeros((0, 2)), "image_sd": 1.0}
    with pytest.raises(InputError, check=as_check("block.repeated-object unknown clock receiver")):
        Block(
            photo_positions=np.zeros((0, 3)),
            photo_attitudes=np.zeros((0, 3)),
            principal_distances=np.zeros(0),
            point_positions=np.zeros((0, 3)),
            observations=records,
            **empty,
        )
