"""A drone whose camera reads its rows one after the other: readout time, motions and points.

Twelve photos of two strips flown in opposite directions, four control points, positions of GNSS 10 ms
after the first row, rates of a gyroscope. Every photo has a motion of its own, and the readout time of the
camera is free. Prints the readout time, what ignoring it would have done to the points, and the pose of a
photo in the middle of its rows.
"""

from __future__ import annotations

import numpy as np

from photogram import Block, Camera, Position, Result, adjust
from photogram.network import Polynomial, Readout, Shutter, Table, Timed, Trajectory, Velocity, projected

WIDTH, HEIGHT, F = 4000, 3000, 3650.0
READOUT = 0.031
"""Seconds for all rows, which the adjustment does not know."""
IMAGE_SD, GNSS_SD, SPEED_SD = 0.5, 0.02, 0.05
"""Pixels; metres; metres a second."""
RATE_SD = 0.02
"""Radians a second, of the gyroscope."""
AFTER = 0.01
"""Seconds from the first row to the position of the receiver."""
CAMERA = Camera("pinhole", {"fx": F, "fy": F, "cx": WIDTH / 2, "cy": HEIGHT / 2})


def moving(photo: int, random: np.random.Generator) -> tuple[Trajectory, Trajectory]:
    """Return the uniform motion of a photo, drawn anew, and what is known of it: its gyroscope's rate."""
    strip, along = divmod(photo, 6)
    sense = 1.0 - 2.0 * strip
    place = np.array([sense * (24.0 * along - 60.0), 30.0 * strip - 15.0, 80.0])
    # Rows lie across the flight; the top of the picture is ahead.
    turned = np.array([[0.0, sense, 0.0], [-sense, 0.0, 0.0], [0.0, 0.0, 1.0]])
    velocity, rate = np.array([9.0 * sense, *random.normal(0, 0.3, 2)]), random.normal(0, 0.1, 3)
    measured = rate + random.normal(0, RATE_SD, 3)

    def uniform(place: np.ndarray, velocity: np.ndarray, rate: np.ndarray) -> Trajectory:
        sd = np.repeat([[np.inf], [RATE_SD]], 3, axis=1)
        return Trajectory(
            f"photo {photo}",
            Table([0.0], place[np.newaxis], [0.0], turned[np.newaxis]),
            position=Polynomial(1, value=np.array([np.zeros(3), velocity])),
            rotation=Polynomial(1, value=np.array([np.zeros(3), rate]), sd=sd),
        )

    about = place + random.normal(0, 1.0, 3)
    return uniform(place, velocity, rate), uniform(about, np.array([9.0 * sense, 0, 0]), measured)


def measured(seed: int = 3) -> tuple[Block, np.ndarray]:
    """Return the block with its measurements, and the true points."""
    random = np.random.default_rng(seed)
    grid = np.mgrid[-80:81:16, -40:41:16].reshape(2, -1).T
    points = np.column_stack([grid, 4.0 * np.sin(0.07 * grid[:, 0]) + 3.0 * np.cos(0.09 * grid[:, 1])])
    true, known = Shutter(Readout("truth", READOUT), (0.0, HEIGHT)), Readout("camera", 0.02)
    shutter = Shutter(known, (0.0, HEIGHT))
    images: list[tuple[int, int, np.ndarray]] = []
    timed, observations = [], []
    for photo in range(12):
        truth, about = moving(photo, random)
        xy = projected(Timed(str(photo), shutter=true), truth, CAMERA, points)
        inside = ((xy > 20) & (xy < [WIDTH - 20, HEIGHT - 20])).all(axis=1)
        images += [(photo, k, xy[k] + random.normal(0, IMAGE_SD, 2)) for k in np.flatnonzero(inside)]
        c = [np.array([each.position for each in part]) for part in truth.coefficients]
        place = truth.flown(np.array([AFTER]), *c)[0][0] + random.normal(0, GNSS_SD, 3)
        speed = c[0][1] + random.normal(0, SPEED_SD, 3)
        at = {"trajectory": about, "time": AFTER}
        observations += [Position(None, place, sd=GNSS_SD, **at), Velocity(None, speed, sd=SPEED_SD, **at)]
        timed.append(Timed(str(photo), about, shutter=shutter))
    control = [0, 5, 60, 65]
    held = np.full(points.shape, np.inf)
    held[control] = 0.01
    given = np.full(points.shape, np.nan)
    given[control] = points[control] + random.normal(0, 0.01, (4, 3))
    block = Block(
        photo_positions=np.array([each.trajectory.table.positions[0] for each in timed if each.trajectory]),
        photo_attitudes=np.zeros((12, 3)),
        point_positions=given,
        point_sd=held,
        image_photos=[photo for photo, _, _ in images],
        image_points=[point for _, point, _ in images],
        image_xy=np.array([xy for _, _, xy in images]),
        image_sd=IMAGE_SD,
        cameras=[CAMERA],
        timed=timed,
        observations=observations,
        title="a drone with a rolling shutter",
    )
    return block, points


def frozen(block: Block) -> Block:
    """Return the same block as if every photo were taken at once."""
    return block.replace(
        timed=[
            Timed(each.photo, each.trajectory and at_rest(each.trajectory), time=each.time)
            for each in block.timed
        ],
        observations=[],
    )


def at_rest(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory that stands still."""
    return Trajectory(trajectory.name, trajectory.table, position=Polynomial(0), rotation=Polynomial(0))


def main() -> Result:
    """Adjust the block, and print what came of it."""
    block, truth = measured()
    result = adjust(block)
    readout = next(each for each in result.unknowns if each.kind == "readout")
    print(f"readout time {1e3 * readout.position[0]:.2f} ms, standard deviation {1e3 * readout.sd[0]:.2f} ms")
    still = adjust(frozen(block))
    for name, own in (("adjusted", result), ("as if taken at once", still)):
        errors = own.point_positions - truth
        rms = np.sqrt(np.nanmean(errors**2, axis=0))
        print(f"{name}: sigma0 {own.variance_of_unit_weight**0.5:.2f}, errors of points {rms.round(3)} m")
    pose = result.trajectories["photo 3"].poses([READOUT / 2])
    print(f"photo 3 in the middle of its rows: {pose.positions[0].round(3)} +- {pose.sd[0, :3].round(3)} m")
    return result


if __name__ == "__main__":
    main()
