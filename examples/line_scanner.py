"""An airborne line scanner: two lines on one trajectory, GNSS and an inertial unit at their own times.

The true flight is wavier than its table; splines take up the difference, kept smooth by their second
differences. Positions come at 1 Hz and attitudes at 2 Hz, by a clock that is behind by some milliseconds.
Prints the clock offset, the pose in the middle of the strip with its standard deviations, and how well
points are known.
"""

from __future__ import annotations

import numpy as np

from photogram import Attitudes, Block, Camera, Position, Result, adjust
from photogram.network import (
    Attitude,
    Clock,
    Lines,
    LineSensor,
    Sensor,
    Spline,
    Table,
    Timed,
    Trajectory,
    projected,
)

SPEED, HEIGHT, SECONDS = 70.0, 1500.0, 40.0
"""Metres a second, metres, seconds."""
IMAGE_SD, GNSS_SD, ATTITUDE_SD, CONTROL_SD = 0.005, 0.05, 1e-4, 0.03
"""Millimetres; metres; radians; metres."""
OFFSET = 0.012
"""Seconds by which the clock of GNSS and inertial unit is behind, which the adjustment does not know."""
CAMERA = Camera("perspective", {"c": -60.0})
DETECTOR = LineSensor((0.01, 0.0), s0=3000.0)
LINES = Lines([[0.0, 3.0, 0.005], [4000.0, 23.0, 0.0048]])


def table(every: float, bent: float) -> Table:
    """Return records of the flight; the true one is bent, the table is not."""
    times = np.arange(-2.0, SECONDS + 2.0 + 1e-9, every)
    positions = np.column_stack(
        [SPEED * times, bent * 0.8 * np.sin(0.35 * times), HEIGHT + bent * 0.5 * np.cos(0.27 * times)]
    )
    # Samples across the flight, lines along it.
    angles = np.column_stack(
        [
            bent * 3e-3 * np.sin(0.4 * times),
            bent * 2e-3 * np.cos(0.5 * times),
            np.full(len(times), -np.pi / 2),
        ]
    )
    attitudes = Attitudes.of("rotation_vector", angles).matrices
    return Table(times, positions, times, attitudes)


def measured(seed: int = 5) -> tuple[Block, np.ndarray]:
    """Return the block with its measurements, and the true points."""
    random = np.random.default_rng(seed)
    truth = Trajectory("truth", table(0.05, 1.0))
    strip = Trajectory(
        "strip",
        table(1.0, 0.0),
        position=Spline(every=4.0, sd=2.0, smooth=(2, 0.9)),
        rotation=Spline(every=2.0, sd=0.01, smooth=(2, 1.5e-3)),
    )
    grid = np.mgrid[300:2500:100, -600:601:150].reshape(2, -1).T
    points = np.column_stack([grid, 20.0 * np.sin(0.004 * grid[:, 0]) * np.cos(0.005 * grid[:, 1])])
    forward = Sensor(
        "forward", np.zeros(3), Attitudes.of("rotation_vector", [[0.35, 0, 0]]).matrices[0], sd=0.0
    )
    clock = Clock("receiver", 0.0, sd=0.02)
    images: list[tuple[int, int, np.ndarray]] = []
    timed = []
    for photo, sensor in enumerate((None, forward)):
        own = {"lines": LINES, "line_sensor": DETECTOR, "sensor": sensor}
        exact = projected(Timed(str(photo), truth, **own), truth, CAMERA, points)
        seen = (exact[:, 0] > 0) & (exact[:, 0] < 6000) & (exact[:, 1] > 0) & (exact[:, 1] < 7200)
        # Half a pixel each way: what is measured of a line also says when.
        images += [(photo, k, exact[k] + random.normal(0, 0.5, 2)) for k in np.flatnonzero(seen)]
        timed.append(Timed(str(photo), strip, **own))
    observations = []
    none = [np.zeros((0, 3))] * 2
    for times, every in ((np.arange(1.25, 39.0), True), (np.arange(1.1, 39.0, 0.5), False)):
        places, turned, *_ = truth.flown(times + OFFSET, *none)
        for time, place, a in zip(times.tolist(), places, turned.reshape(-1, 3, 3), strict=True):
            of = {"trajectory": strip, "time": time, "clock": clock}
            if every:
                observations.append(Position(None, place + random.normal(0, GNSS_SD, 3), sd=GNSS_SD, **of))
            else:
                error = Attitudes.of("rotation_vector", random.normal(0, ATTITUDE_SD, (1, 3))).matrices[0]
                observations.append(Attitude(None, a @ error, sd=ATTITUDE_SD, **of))
    control = [0, 8, 90, 189, 197]
    held, given = np.full(points.shape, np.inf), np.full(points.shape, np.nan)
    held[control] = CONTROL_SD
    given[control] = points[control] + random.normal(0, CONTROL_SD, (5, 3))
    block = Block(
        photo_positions=np.tile([SPEED * SECONDS / 2, 0.0, HEIGHT], (2, 1)),
        photo_attitudes=np.zeros((2, 3)),
        point_positions=given,
        point_sd=held,
        image_photos=[photo for photo, _, _ in images],
        image_points=[point for _, point, _ in images],
        image_xy=np.array([xy for _, _, xy in images]),
        image_sd=IMAGE_SD,
        cameras=[CAMERA],
        photo_cameras=[0, 0],
        timed=timed,
        observations=observations,
        title="an airborne line scanner",
    )
    return block, points


def main() -> Result:
    """Adjust the block, and print what came of it."""
    block, truth = measured()
    result = adjust(block)
    clock = next(each for each in result.unknowns if each.kind == "clock")
    print(f"clock offset {1e3 * clock.position[0]:.2f} ms, standard deviation {1e3 * clock.sd[0]:.2f} ms")
    pose = result.trajectories["strip"].poses([20.0])
    print(f"pose at 20 s: {pose.positions[0].round(3)} +- {pose.sd[0, :3].round(3)} m")
    print(f"its attitude: +- {(1e6 * pose.sd[0, 3:]).round(0)} urad")
    errors = result.point_positions - truth
    sizes = np.sqrt(np.nanmean(errors**2, axis=0)), np.sqrt(np.nanmean(result.point_sd**2, axis=0))
    print(f"points: errors {sizes[0].round(3)} m, standard deviations {sizes[1].round(3)} m")
    return result


if __name__ == "__main__":
    main()
