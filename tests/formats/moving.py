"""Blocks with photos on trajectories that need no shared data, and what it takes to compare two of them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from photogram import Attitudes, Block, Camera, LeverArm, Position, formats
from photogram.network import (
    Attitude,
    Boresight,
    Clock,
    GyroBias,
    Lines,
    LineSensor,
    Polynomial,
    Prior,
    Rate,
    Readout,
    Sensor,
    Shift,
    Shutter,
    Spline,
    Table,
    Timed,
    Trajectory,
    Velocity,
)
from photogram.network.motion import about

SPEED, LINE = 60.0, 0.002
"""Metres a second, seconds a line."""


def turned(x: float, y: float, z: float) -> np.ndarray:
    """Return the attitude of three angles in radians."""
    return Attitudes.of("omega_phi_kappa", [[x, y, z]]).matrices[0]


def rolling(unit: str = "px", direction: str = "down") -> Block:
    """Return six photos of a drone that reads its rows one after the other; the middle four points are held.

    `mm`: image coordinates from the middle of the picture, y up, in pixels of 0.004 mm.
    """
    random = np.random.default_rng(3)
    points = np.column_stack([random.uniform(-40, 40, (40, 2)), random.uniform(0, 8, 40)])
    if unit == "px":
        camera = Camera(
            "opencv", {"fx": 2400.0, "fy": 2400.0, "cx": 1500.0, "cy": 1000.0, "k1": -0.02}, name="drone"
        )
        edges = {"down": (0.0, 2000.0), "up": (2000.0, 0.0), "right": (0.0, 3000.0), "left": (3000.0, 0.0)}
        middle, half = [1500.0, 1000.0], [1500.0, 1000.0]
    else:
        camera = Camera("brown", {"c": -9.6, "K1": 1e-4}, name="drone")
        edges = {"down": (4.0, -4.0), "up": (-4.0, 4.0), "right": (-6.0, 6.0), "left": (6.0, -6.0)}
        middle, half = [0.0, 0.0], [6.0, 4.0]
    shutter = Shutter(Readout("rows", 0.02, sd=np.inf), edges[direction], direction)
    readout = 0.025
    centres, angles, velocities, rates, rows = [], [], [], [], []
    for photo in range(6):
        centres.append(random.normal([-20.0 + 20.0 * (photo % 3), -10.0 + 20.0 * (photo // 3), 60.0], 1.0))
        angles.append(random.normal([0.0, 0.0, np.pi * (photo // 3)], 0.03))
        velocities.append(np.array([8.0 - 16.0 * (photo // 3), 0.0, 0.0]) + random.normal(0, 0.3, 3))
        rates.append(random.normal(0, 0.1, 3))
        matrix = turned(*angles[-1])
        for point, place in enumerate(points):
            time = 0.5 * readout
            for _ in range(30):
                turn = Attitudes.of("rotation_vector", [rates[-1] * time]).matrices[0]
                xy = camera.project([(matrix @ turn).T @ (place - centres[-1] - velocities[-1] * time)])
                before, time = time, float(shutter.times(xy)[0]) * readout
                if time == before:
                    break
            if (np.abs(xy[0] - middle) < half).all():
                rows.append((photo, point, *xy[0]))
    photos, seen, x, y = (np.array(column) for column in zip(*rows, strict=True))
    size = 1.0 if unit == "px" else 0.004
    xy = np.column_stack([x, y]) + random.normal(0, 0.2 * size, (len(rows), 2))
    sd = np.where(np.arange(40)[:, np.newaxis] < 6, 0.01, np.inf) * np.ones(3)
    names = [f"DJI_{photo}" for photo in range(6)]
    return Block(
        photo_ids=names,
        photo_positions=np.array(centres) + random.normal(0, 0.05, (6, 3)),
        photo_attitudes=np.array(angles) + random.normal(0, 0.002, (6, 3)),
        cameras=[camera],
        photo_cameras=[0] * 6,
        point_ids=[f"P{k}" for k in range(40)],
        point_positions=np.where(np.isfinite(sd), points + random.normal(0, 0.01, points.shape), np.nan),
        point_sd=sd,
        image_photos=photos.astype(int),
        image_points=seen.astype(int),
        image_xy=xy,
        image_sd=0.2 * size,
        timed=[
            Timed(
                name,
                shutter=shutter,
                velocity=v,
                rotation_rate=w,
                sd_velocity=0.3,
                sd_rate=[0.2, 0.2, np.inf],
            )
            for name, v, w in zip(names, velocities, rates, strict=True)
        ],
        observations=[Velocity(name, v, sd=0.5) for name, v in zip(names[:2], velocities, strict=False)],
        title="rolling shutter",
    )


def _strip() -> Trajectory:
    """Return the trajectory of a pass: records with velocities, a polynomial and a smooth spline."""
    times, tilts = np.arange(200.0, 211.5, 1.0), np.arange(199.75, 211.5, 0.5)
    places = np.column_stack([SPEED * (times - 205.0), 2 * np.sin(times), 800 + np.cos(times)])
    speeds = np.column_stack([np.full(len(times), SPEED), 2 * np.cos(times), -np.sin(times)])
    angles = [(0.01 * np.sin(t), 0.01 * np.cos(t), -np.pi / 2 + 0.005 * t % 0.1) for t in tilts]
    drift = [[0.2, -0.1, 0.3], [0.01, 0.02, -0.05]]
    return Trajectory(
        "strip 7",
        Table(
            times,
            places,
            tilts,
            np.array([turned(*each) for each in angles]),
            velocities=speeds,
            interpolation="hermite",
        ),
        position=Polynomial(1, value=drift, sd=[[0.3, 0.3, 0.2], [0.1, np.inf, 0.1]]),
        rotation=Spline(every=2.0, sd=0.02, smooth=(2, 1e-3)),
    )


def _scans(strip: Trajectory) -> list[Timed]:
    """Return two scans: of a line that looks down, and of one that looks ahead."""
    mount_sd = [0, 0, 0, 1e-3, 1e-3, 1e-3]
    ahead = Sensor("ahead", [0.1, 0.0, -0.02], turned(np.radians(18.0), 0.001, -0.002), sd=mount_sd)
    oscillator = Readout("oscillator", 1.0, sd=1e-5)
    return [
        Timed(
            "L1",
            strip,
            lines=Lines([[0, 202.0, LINE], [1000, 204.0, LINE]]),
            line_sensor=LineSensor((0.01, 0.0), 3000.0),
            rate=oscillator,
            time=205.0,
            offset=Clock("lines", 0.0, sd=1e-4),
        ),
        Timed(
            "L2",
            strip,
            lines=Lines([[0, 200.5, LINE]]),
            line_sensor=LineSensor((-0.01, 0.0), 3000.0, x0=0.05),
            sensor=ahead,
            rate=oscillator,
        ),
    ]


def _images(
    timed: list[Timed], cameras: list[Camera], points: np.ndarray
) -> list[tuple[int, int, float, float]]:
    """Return photo, point, sample and line of each image."""
    rows = []
    for photo, (own, camera) in enumerate(zip(timed, cameras, strict=True)):
        line, begin = own.line_sensor, own.lines.table[0, 1]
        for point, ground in enumerate(points):
            found = _line_of(own.trajectory, own.sensor, camera, ground, begin)
            if found is not None:
                time, xy = found
                rows.append(
                    (photo, point, (xy[0] - line.x0) / line.pitch[0] + line.s0, (time - begin) / LINE)
                )
    return rows


def two_lines() -> Block:
    """Return a strip of a scanner with a line that looks down and one that looks ahead.

    Everything that tables may say is there: a table with velocities, a polynomial with given coefficients, a
    spline that is smooth, mounts, factors of line rates, clocks, records of GNSS and of an inertial unit.
    """
    random, strip = np.random.default_rng(5), _strip()
    lens = {"c": -120.0, "xp": 0.01, "K1": 2e-7}
    cameras = [Camera("brown", lens, {"K1": 1e-8}, name="down"), Camera("brown", lens, name="ahead")]
    timed = _scans(strip)
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-120, 120, 6), np.linspace(-160, 160, 5)))
    points = np.column_stack([x, y, random.uniform(0, 60, len(x))])
    rows = _images(timed, cameras, points)
    photos, seen, *xy = (np.array(column) for column in zip(*rows, strict=True))
    held = np.arange(len(points))[:, np.newaxis] % 5 == 0
    return Block(
        photo_ids=["L1", "L2"],
        photo_positions=[[0.0, 0.0, 800.0]] * 2,
        photo_attitudes=np.zeros((2, 3)),
        cameras=cameras,
        photo_cameras=[0, 1],
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=np.where(held, points + random.normal(0, 0.02, points.shape), np.nan),
        point_sd=np.where(held, 0.02, np.inf) * np.ones(3),
        image_photos=photos.astype(int),
        image_points=seen.astype(int),
        image_xy=np.column_stack(xy) + random.normal(0, 0.3, (len(rows), 2)),
        image_sd=np.tile([0.004, 0.005], (len(rows), 1)),
        timed=timed,
        observations=[
            *_records(strip, random),
            Prior(strip.coefficients[1][0], covariance=np.eye(3) * 1e-4 + 2e-5),
        ],
        title="two lines",
    )


def _line_of(strip, mount, camera, ground, begin):
    """Return the time at which a point is on a line of sensors, and where there; None where it never is."""
    lower, upper = begin, begin + 8.0

    def at(time):
        centre, matrix = about(strip, time)
        if mount is not None:
            centre, matrix = centre + matrix @ mount.position, matrix @ mount.attitude
        return matrix.T @ (ground - centre)

    if at(lower)[1] * at(upper)[1] >= 0:
        return None
    for _ in range(60):
        middle = (lower + upper) / 2
        if middle in (lower, upper):
            break
        lower, upper = (middle, upper) if at(middle)[1] * at(lower)[1] > 0 else (lower, middle)
    return middle, camera.project([at(middle)])[0]


def _records(strip, random):
    """Return records of a receiver and of an inertial unit, both with the clock of the receiver."""
    clock, arm = Clock("receiver", 0.001, sd=0.01), LeverArm("antenna", [0.2, 0.1, 1.0], sd=0.05)
    shift, imu, bias = (
        Shift("flight", sd=0.5),
        Boresight("imu", turned(0.0, 0.0, 0.1), sd=0.02),
        GyroBias("gyro", sd=1e-3),
    )
    covariance = np.array([[4.0, 1.0, 0.5], [1.0, 5.0, -0.3], [0.5, -0.3, 9.0]]) * 1e-4
    found = []
    for time in np.arange(201.0, 210.0, 0.75):
        at = {"trajectory": strip, "time": float(time), "clock": clock}
        centre, matrix = about(strip, time)
        velocity = (about(strip, time + 1e-3)[0] - about(strip, time - 1e-3)[0]) / 2e-3
        noise = random.normal(0, 1, (3, 3))
        place = centre + matrix @ [0.2, 0.1, 1.0] + 0.02 * noise[0]
        found.append(Position(None, place, covariance=covariance, lever_arm=arm, shift=shift, **at))
        found.append(Velocity(None, velocity + 0.05 * noise[1], sd=[0.05, 0.05, 0.1], lever_arm=arm, **at))
        found.append(
            Attitude(None, matrix @ turned(0.0, 0.0, 0.1), covariance=covariance / 500, boresight=imu, **at)
        )
        found.append(Rate(None, 2e-3 * noise[2], covariance=covariance / 10, boresight=imu, bias=bias, **at))
    return found


def project_of(block, place, sizes=None, pixel_mm=None):
    """Return a project of a block that somebody has made."""
    count = len(block.cameras)
    return formats.Project(
        block=block,
        path=place,
        title="made",
        sizes=sizes or (None,) * count,
        pixel_mm=pixel_mm or (None,) * count,
        starts=block.point_positions,
    )


def edited(path, edit):
    """Change a table; columns of numbers as they are written."""
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    edit(table).to_csv(path, index=False)


def same(one: Block, other: Block) -> None:
    """Assert that all of two blocks that moves is the same, to the last bit but for angles."""
    _same_names(one, other)
    ours, theirs = ({each.photo: each for each in block.timed} for block in (one, other))
    assert ours.keys() == theirs.keys()
    for photo, own in ours.items():
        read = theirs[photo]
        assert (own.trajectory is None) == (read.trajectory is None)
        assert own.time == read.time
        assert own.line_sensor == read.line_sensor
        if own.lines is not None:
            np.testing.assert_array_equal(read.lines.table, own.lines.table)
        if own.shutter is not None:
            assert read.shutter.edges == own.shutter.edges
            assert read.shutter.direction == own.shutter.direction
        for name in ("offset", "rate", "readout", "sensor"):
            same_unknown(getattr(own, name), getattr(read, name))
        if own.trajectory is None:
            for name in ("velocity", "rotation_rate", "sd_velocity", "sd_rate"):
                mine = np.broadcast_to(getattr(own, name), 3)
                np.testing.assert_array_equal(np.broadcast_to(getattr(read, name), 3), mine)
        else:
            same_trajectory(own.trajectory, read.trajectory)
    _same_observations(one, other)


def _same_names(one: Block, other: Block) -> None:
    """Assert that the same things are shared."""
    shared = [
        sorted(each.title for each in block.unknowns if each.KIND != "lever arm" or not each.is_held)
        for block in (one, other)
    ]
    assert shared[0] == shared[1]


def same_unknown(own, read) -> None:
    """Assert that two common unknowns are the same."""
    assert (own is None) == (read is None)
    if own is not None:
        assert read.title == own.title
        np.testing.assert_allclose(
            read.position, own.position, rtol=4e-16 * (own.KIND == "rotation coefficient")
        )
        # Angles are written as short decimals if these are within the rounding of a matrix (1.8e-15 rad).
        np.testing.assert_allclose(read.attitude, own.attitude, rtol=0, atol=4e-15)
        np.testing.assert_allclose(read.deviations, own.deviations, rtol=4e-16)


def same_trajectory(own: Trajectory, read: Trajectory) -> None:
    """Assert that two trajectories are the same."""
    assert read.name == own.name
    for name in ("times", "positions", "attitude_times"):
        np.testing.assert_array_equal(getattr(read.table, name), getattr(own.table, name))
    np.testing.assert_allclose(read.table.attitudes, own.table.attitudes, rtol=0, atol=4e-15)
    assert (read.table.velocities is None) == (own.table.velocities is None)
    if own.table.velocities is not None:
        np.testing.assert_array_equal(read.table.velocities, own.table.velocities)
    for name in ("interpolation", "attitude_interpolation"):
        assert getattr(read.table, name) == getattr(own.table, name)
    for what in ("position", "rotation"):
        mine, basis = getattr(own, what), getattr(read, what)
        assert type(mine) is type(basis)
        names = ("degree", "reference", "scale") if isinstance(mine, Polynomial) else ("degree",)
        for name in names if mine is not None else ():
            assert getattr(mine, name) == getattr(basis, name)
        if isinstance(mine, Spline):
            np.testing.assert_array_equal(basis.knots, mine.knots)
            for name in ("smooth", "correlation"):
                pairs = getattr(basis, name) or 0.0, getattr(mine, name) or 0.0
                np.testing.assert_allclose(*pairs, rtol=4e-16)
    for first, second in zip(own.coefficients, read.coefficients, strict=True):
        for mine, each in zip(first, second, strict=True):
            assert each.title == mine.title
            np.testing.assert_allclose(each.position, mine.position, rtol=4e-16)
            np.testing.assert_allclose(each.deviations, mine.deviations, rtol=4e-16)
    assert (read.body is None) == (own.body is None)
    if own.body is not None:
        np.testing.assert_array_equal(read.body[0], own.body[0])
        np.testing.assert_allclose(read.body[1], own.body[1], rtol=0, atol=4e-15)


def _same_observations(one: Block, other: Block) -> None:
    """Assert that records, and sums of coefficients, are the same."""
    by_kind = [{}, {}]
    for own, block in zip(by_kind, (one, other), strict=True):
        for each in block.observations:
            # Control without correlations is that of points.
            if each.KIND != "control":
                own.setdefault(each.label, []).append(each)
    assert by_kind[0].keys() == by_kind[1].keys()
    for kind, ours in by_kind[0].items():
        assert len(ours) == len(by_kind[1][kind])
        for own, read in zip(ours, by_kind[1][kind], strict=True):
            assert own.of == read.of
            exact = own.KIND not in ("attitude", "smoothness")
            given = 3 if exact and own.KIND in ("position", "velocity", "rate") else len(own.observed)
            tolerance = {"rtol": 0 if exact else 1e-15, "atol": 0 if exact else 4e-15}
            if own.KIND != "position" or not one.geographic:
                np.testing.assert_allclose(read.observed[:given], own.observed[:given], **tolerance)
            np.testing.assert_allclose(read.precision, own.precision, rtol=2e-15)
            if own.moment is not None:
                assert read.moment.time == own.moment.time
                assert read.moment.trajectory.name == own.moment.trajectory.name
                same_unknown(own.moment.clock, read.moment.clock)
            for mine, each in zip(own.unknowns, read.unknowns, strict=True):
                if mine is not None and not mine.is_held:
                    same_unknown(mine, each)
