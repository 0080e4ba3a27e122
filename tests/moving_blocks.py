"""Small blocks with photos on trajectories, simulated: a rolling shutter, line scanners, frames of a pass."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from photogram import Attitudes, Block, Camera, LeverArm, Position
from photogram.network import (
    Attitude,
    Boresight,
    Clock,
    GyroBias,
    Lines,
    LineSensor,
    Rate,
    Readout,
    Shutter,
    Spline,
    Table,
    Timed,
    Trajectory,
    Velocity,
)

Floats = np.ndarray

F, WIDTH, HEIGHT = 3000.0, 4000.0, 3000.0
"""Of the camera with a rolling shutter, in pixels."""
READOUT = 0.03
C, PITCH, SAMPLES = -60.0, 0.01, 6000
"""Of the scanner, in millimetres, which looks down."""
SPEED, ALTITUDE, LINE = 50.0, 600.0, 0.002
"""Metres a second, metres, seconds per line."""


def exponential(r: Floats) -> Floats:
    """Return the rotation by a vector."""
    angle, (x, y, z) = np.linalg.norm(r), r
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if angle < 1e-12:
        return np.eye(3) + k
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * k @ k


def heading(turn: float) -> Floats:
    """Return the axes of a photo that looks down, turned from east."""
    cos, sin = np.cos(turn), np.sin(turn)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _read(
    points: Floats, motions: Iterable[tuple[Floats, ...]], readout: float, direction: str = "down"
) -> tuple[list[int], list[int], Floats]:
    """Return photos, points and places of the images that a shutter reads from uniform motions."""
    photos, seen, xy = [], [], []
    for photo, (centre, matrix, v, w) in enumerate(motions):
        for point, place in enumerate(points):
            column, row = WIDTH / 2, HEIGHT / 2
            for _ in range(20):
                share = {"down": row / HEIGHT, "up": 1 - row / HEIGHT, "right": column / WIDTH}[direction]
                time, before = share * readout, (column, row)
                u = (matrix @ exponential(w * time)).T @ (place - centre - v * time)
                column, row = WIDTH / 2 - F * u[0] / u[2], HEIGHT / 2 + F * u[1] / u[2]
                if (column, row) == before:
                    break
            if 0 < column < WIDTH and 0 < row < HEIGHT:
                photos.append(photo)
                seen.append(point)
                xy.append([column, row])
    return photos, seen, np.array(xy)


def flown_frames(
    *,
    readout: float = READOUT,
    direction: str = "down",
    turned: bool = False,
    strips: int = 2,
    millimetres: bool = False,
    relief: float = 15.0,
    seed: int = 5,
) -> Block:
    """Return strips of a drone, eight photos each that are frames, 18 m and 2 s apart; nine points held.

    The shutter rolls for `readout` seconds. `turned`: the camera turns with the drone, and is always moved
    the same way in its axes; else it is moved the other way on every second strip. `millimetres`: the same
    of a camera without lens, of 0.004 mm a pixel.
    """
    random = np.random.default_rng(seed)
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-110, 110, 17), np.linspace(-75, 75, 11)))
    points = np.column_stack([x, y, random.uniform(-relief, relief, len(x))])
    points[:, :2] += random.uniform(-3, 3, (len(x), 2))
    motions = []
    for strip in range(strips):
        sense = -1.0 if strip % 2 else 1.0
        for photo in range(8):
            centre = [sense * (-63.0 + 18.0 * photo), 50.0 * (strip - (strips - 1) / 2), 100.0]
            turn = heading((np.pi if strip % 2 and turned else 0.0) - np.pi / 2)
            motions.append(
                (
                    np.array(centre) + random.normal(0, 0.5, 3),
                    turn @ exponential(random.normal(0, 0.03, 3)),
                    np.array([9.0 * sense, 0.0, 0.0]) + random.normal(0, 0.2, 3),
                    random.normal(0, 0.02, 3),
                )
            )
    photos, seen, xy = _read(points, motions, readout, direction)
    xy += 0.3 * random.standard_normal(xy.shape)
    held = np.zeros(len(points), dtype=bool)
    held[:: len(points) // 8] = True
    count = len(motions)
    camera = {"fx": F, "fy": F, "cx": WIDTH / 2, "cy": HEIGHT / 2}
    own = (
        {
            "principal_distances": np.full(count, -0.004 * F),
            "image_xy": (xy - [WIDTH / 2, HEIGHT / 2]) * [0.004, -0.004],
            "image_sd": 0.0012,
        }
        if millimetres
        else {
            "cameras": [Camera("pinhole", camera)],
            "photo_cameras": [0] * count,
            "image_xy": xy,
            "image_sd": 0.3,
        }
    )
    angles = Attitudes(np.array([matrix for _, matrix, *_ in motions]))
    return Block(
        photo_ids=[f"IMG_{k + 1}" for k in range(count)],
        photo_positions=np.array([centre for centre, *_ in motions]) + random.normal(0, 0.05, (count, 3)),
        photo_attitudes=angles.values("omega_phi_kappa"),
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=np.where(held[:, np.newaxis], points + random.normal(0, 0.01, points.shape), np.nan),
        point_sd=np.where(held[:, np.newaxis], 0.01, np.inf) * np.ones(3),
        image_photos=photos,
        image_points=seen,
        title="frames of a drone",
        **own,
    )


def rolling(*, readout: Readout | float | None = None, noise: float = 0.3, gross: bool = False) -> Block:
    """Return eight photos in two strips of a drone, each with its own uniform motion, and nine points held.

    `gross` moves the first image by 12 pixels.
    """
    random = np.random.default_rng(8)
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-70, 70, 8), np.linspace(-60, 60, 7)))
    points = np.column_stack([x, y, random.uniform(-6, 6, len(x))])
    points[:, :2] += random.uniform(-3, 3, (len(x), 2))
    centres, matrices, velocities, rates = [], [], [], []
    for strip, turn in enumerate((0.0, np.pi)):
        for photo in range(4):
            about = np.array([-45.0 + 30.0 * photo, -25.0 + 50.0 * strip, 100.0])
            centres.append(about + random.normal(0, 1, 3))
            matrices.append(heading(turn) @ exponential(random.normal(0, 0.03, 3)))
            along = [0.0, 9.0, 0.0] if photo % 2 else [9.0 * np.cos(turn), 0.0, 0.0]
            velocities.append(along + random.normal(0, 0.3, 3))
            rates.append(random.normal(0, 0.15, 3))
    photos, seen, xy = _read(points, zip(centres, matrices, velocities, rates, strict=True), READOUT)
    xy += noise * random.standard_normal(xy.shape)
    xy[0, 0] += 12.0 * gross
    kept = np.bincount(seen, minlength=len(points)) > 0
    number = np.cumsum(kept) - 1
    points = points[kept]
    held = np.zeros(len(points), dtype=bool)
    held[:: len(points) // 8] = True
    names = [f"IMG_{k}" for k in range(1, 9)]
    shutter = Shutter(Readout("drone", 0.02) if readout is None else readout, (0.0, HEIGHT))
    angles = Attitudes(np.array([m @ exponential(random.normal(0, 0.002, 3)) for m in matrices]))
    return Block(
        photo_ids=names,
        photo_positions=np.array(centres) + random.normal(0, 0.05, (8, 3)),
        photo_attitudes=angles.values("omega_phi_kappa"),
        cameras=[Camera("pinhole", {"fx": F, "fy": F, "cx": WIDTH / 2, "cy": HEIGHT / 2})],
        photo_cameras=[0] * 8,
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=np.where(held[:, np.newaxis], points + random.normal(0, 0.01, points.shape), np.nan),
        point_sd=np.where(held[:, np.newaxis], 0.01, np.inf) * np.ones(3),
        image_photos=photos,
        image_points=number[seen],
        image_xy=xy,
        image_sd=0.3,
        timed=[
            Timed(
                name, shutter=shutter, velocity=v + random.normal(0, 0.05, 3), sd_velocity=0.05, sd_rate=0.3
            )
            for name, v in zip(names, velocities, strict=True)
        ],
        title="rolling shutter",
    )


def course(strip: int) -> tuple[float, Floats]:
    """Return when a strip begins, and how it is flown: one from west to east, one back."""
    return (100.0, 300.0)[strip], heading((0.0, np.pi)[strip])


def place(strip: int, time: float) -> tuple[Floats, Floats]:
    """Return the true pose on a strip, at a time from its middle; y of the photo is forward."""
    _, turned = course(strip)
    wave = np.array([0.4 * np.sin(time), 0.3 * np.cos(0.7 * time), 0.2 * np.sin(0.5 * time)])
    centre = turned @ [SPEED * time, (-60.0, -60.0)[strip], 0.0] + [0, 0, ALTITUDE] + wave
    forward = turned @ heading(-np.pi / 2)
    turns = np.array([0.01 * np.sin(1.3 * time), 0.008 * np.cos(time), 0.006 * np.sin(0.8 * time)])
    return centre, forward @ exponential(turns)


def scanned(
    *, photos: bool = False, records: bool = True, noise: float = 1.0, smooth: bool = False, seed: int = 2
) -> Block:
    """Return two opposite strips of a line scanner, with records of GNSS and an inertial unit; 5 points held.

    `photos` adds frames of a second camera on the first strip, whose names are F0, F1, F2.
    """
    random = np.random.default_rng(seed)
    half = 4.0
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-150, 150, 7), np.linspace(-150, 150, 6)))
    points = np.column_stack([x, y, random.uniform(0, 30, len(x))])
    points[:, :2] += random.uniform(-8, 8, (len(x), 2))
    strips, kinds, timed, observations, xy = [], [], [], [], []
    clock, boresight, bias = Clock("receiver", sd=0.01), Boresight("imu"), GyroBias("gyro", sd=1e-3)
    arm, true_clock, true_boresight, true_bias = (
        LeverArm("antenna", [0.1, -0.4, 1.2], sd=0.0),
        0.004,
        (exponential(np.array([0.01, -0.02, 0.015]))),
        np.array([2e-4, -3e-4, 1e-4]),
    )
    for strip in (0, 1):
        begin, _ = course(strip)
        middle = begin + half
        times = begin - 1.0 + np.arange(0, 2 * half + 2.0, 0.1)
        poses = [place(strip, time - middle) for time in times]
        off, drift, turn = random.normal(0, 0.3, 3), random.normal(0, 0.02, 3), random.normal(0, 2e-3, 3)
        table = Table(
            times,
            np.array([c + off + drift * (t - middle) for t, (c, _) in zip(times, poses, strict=True)]),
            times,
            np.array([a @ exponential(turn) for _, a in poses]),
            interpolation="lagrange",
            attitude_interpolation="lagrange",
        )
        own = Trajectory(
            f"strip {strip + 1}",
            table,
            position=Spline(2.0, sd=1.0, smooth=(2, 0.1) if smooth else None),
            rotation=Spline(2.0, sd=0.01),
        )
        strips.append(own)
        for point, ground in enumerate(points):
            time = 0.0
            for _ in range(100):
                centre, turned = place(strip, time)
                u = turned.T @ (ground - centre)
                before, time = time, time + u[1] / SPEED
                if time == before:
                    break
            sample, line = C * u[0] / u[2] / PITCH + SAMPLES / 2, (time + half) / LINE
            if 0 < sample < SAMPLES and 0 < line < 2 * half / LINE:
                kinds.append((strip, point))
                xy.append([sample, line])
        at = {"trajectory": own, "clock": clock}
        for time in begin + 0.25 + np.arange(0, 2 * half - 1, 0.5) if records else ():
            moment = time + true_clock - middle
            centre, turned = place(strip, moment)
            step = 1e-4
            (before, a), (after, b) = place(strip, moment - step), place(strip, moment + step)
            rate = _vector(a.T @ b) / (2 * step)
            lever = np.array([0.1, -0.4, 1.2])
            v = (after - before) / (2 * step) + turned @ np.cross(rate, lever)
            own_time = {"time": float(time), **at}
            xyz = centre + turned @ lever + random.normal(0, 0.03, 3)
            observations.append(Position(None, xyz, sd=0.03, lever_arm=arm, **own_time))
            matrix = turned @ true_boresight @ exponential(random.normal(0, 2e-4, 3))
            observations.append(Attitude(None, matrix, sd=2e-4, boresight=boresight, **own_time))
            v = v + random.normal(0, 0.05, 3)
            observations.append(Velocity(None, v, sd=0.05, lever_arm=arm, **own_time))
            w = true_boresight.T @ rate + true_bias + random.normal(0, 1e-3, 3)
            observations.append(Rate(None, w, sd=1e-3, boresight=boresight, bias=bias, **own_time))
    sensor = LineSensor((PITCH, 0.0), SAMPLES / 2)
    names = ["S1", "S2"]
    timed = [
        Timed(name, own, lines=Lines([[0, course(k)[0], LINE]]), line_sensor=sensor)
        for k, (name, own) in enumerate(zip(names, strips, strict=True))
    ]
    if photos:
        frames = []
        for k, moment in enumerate((-1.0, 0.0, 1.0)):
            begin, _ = course(0)
            name = f"F{k}"
            names.append(name)
            timed.append(Timed(name, strips[0], time=begin + half + moment))
            centre, turned = place(0, moment)
            for point, ground in enumerate(points):
                u = turned.T @ (ground - centre)
                frames.append([C * u[0] / u[2], C * u[1] / u[2]])
                kinds.append((2 + k, point))
                xy.append(None)
    of_lines = np.array([each for each in xy if each is not None])
    errors = noise * 0.003 * random.standard_normal((len(xy), 2))
    all_xy = []
    for k, own in enumerate(xy):
        if own is None:
            all_xy.append(np.array(frames[k - len(of_lines)]) + errors[k])
        else:
            ground = ALTITUDE / abs(C)
            all_xy.append(np.array(own) + errors[k] / [PITCH, LINE * SPEED / ground])
    held = np.zeros(len(points), dtype=bool)
    held[[0, 6, 20, 35, 41]] = True
    count = len(names)
    return Block(
        photo_ids=names,
        photo_positions=np.tile([0.0, 0.0, ALTITUDE], (count, 1)),
        photo_attitudes=np.zeros((count, 3)),
        cameras=[Camera("perspective", {"c": C})],
        photo_cameras=[0] * count,
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=np.where(held[:, np.newaxis], points + random.normal(0, 0.02, points.shape), np.nan),
        point_sd=np.where(held[:, np.newaxis], 0.02, np.inf) * np.ones(3),
        image_photos=[photo for photo, _ in kinds],
        image_points=[point for _, point in kinds],
        image_xy=np.array(all_xy),
        image_sd=0.003,
        timed=timed,
        observations=observations,
        title="line scanner",
    )


def _vector(matrix: Floats) -> Floats:
    """Return the rotation vector of a small rotation."""
    k = (matrix - matrix.T) / 2
    return np.array([k[2, 1], k[0, 2], k[1, 0]])
