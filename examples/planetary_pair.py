"""Two orbital line scanner images of the Moon: support data, a control network, settings of jigsaw.

The second image was taken an orbit later, rolled towards the strip of the first. What support data say of
positions is wrong by some tens of metres, and of pointing by hundredths of a degree and its drift. Writes
`left.json`, `right.json`, `images.lis`, `pair.net` and `settings.txt` into a folder, adjusts them, and prints
how well points are known.

    python examples/planetary_pair.py pair
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from photogram import Attitudes, Result, Spheroid, adjust, formats
from photogram.formats import ReadOptions
from photogram.formats.csm import SupportedImage, read_support
from photogram.formats.isis import POINT_TYPES, ControlMeasures, ControlNetwork, ControlPoints, network_text
from photogram.network import geocentric_to_geographic, geographic_to_geocentric

RADIUS, HEIGHT, SPEED = 1737.4, 50.0, 1.66
"""Kilometres; kilometres a second."""
TURN = 2.66e-6
"""Radians a second by which the Moon turns."""
LINES, SAMPLES, RATE, PITCH, FOCAL_LENGTH = 8000, 4000, 3.2e-4, 0.007, 700.0
"""Seconds a line; millimetres."""
MEASURED, CONTROL = 0.4, 5.0
"""Standard deviations: pixels of measures, metres of control."""
SIDES = {"left": (0.0, 1000.0), "right": (np.deg2rad(25.0), 8000.0)}
"""Roll, and the time of the first line in seconds."""
PLACE, POINTING = 30.0, (0.02, 0.004, 0.001)
"""Standard deviations of support data: metres; degrees, of coefficients by powers of scaled time."""
SETTINGS = f"""
camsolve = accelerations    # angles, their drift and its change
twist = yes
camera_angles_sigma = {POINTING[0]}
camera_angular_velocity_sigma = {POINTING[1]}
camera_angular_acceleration_sigma = {POINTING[2]}
spsolve = position
spacecraft_position_sigma = {PLACE}
radius = yes
"""


def tables(side: str, shift: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return times, places and velocities (km), and matrices inertial to camera, with errors of both.

    `shift` are metres along the axes, `turn` degrees about those of the camera, by powers of scaled time.
    """
    roll, first = SIDES[side]
    times = first + np.linspace(-0.01, LINES * RATE + 0.01, 60)
    since, distance = times - times.mean(), RADIUS + HEIGHT
    angle = SPEED / distance * since
    c, s, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    # Over where the image looks: as far beside it as its roll asks for, and under what the Moon has turned.
    aside = roll - np.arcsin(np.sin(roll) * distance / RADIUS)
    plane = Attitudes.of("rotation_vector", [[0.0, 0.0, TURN * times.mean()]]).matrices[0]
    plane = plane @ Attitudes.of("rotation_vector", [[0.0, 0.0, aside]]).matrices[0]
    up, along = np.stack([c, zero, s], 1) @ plane.T, np.stack([-s, zero, c], 1) @ plane.T
    across = np.cross(up, along)
    down = -np.cos(roll) * up - np.sin(roll) * across
    matrices = np.stack([along, np.cross(down, along), down], axis=1)
    scaled = since / (times[-1] - times.mean())
    errors = np.deg2rad(np.column_stack([np.ones_like(scaled), scaled, scaled**2]) @ turn)
    matrices = Attitudes.of("rotation_vector", errors).matrices @ matrices
    return times, distance * up + 1e-3 * shift, distance * SPEED / distance * along, matrices


def support(side: str, shift: Any = (0.0, 0.0, 0.0), turn: Any = ((0.0, 0.0, 0.0),) * 3) -> dict[str, Any]:
    """Return support data as ALE writes them for the Community Sensor Model."""
    times, places, velocities, matrices = tables(side, np.array(shift), np.array(turn))
    bodies = Attitudes.of("rotation_vector", np.outer(-TURN * times, [0.0, 0.0, 1.0])).matrices
    own = {"ephemeris_times": times.tolist(), "reference_frame": 1}
    middle = SIDES[side][1] + LINES * RATE / 2
    return {
        "name_model": "USGS_ASTRO_LINE_SCANNER_SENSOR_MODEL",
        "name_platform": "ORBITER",
        "name_sensor": "NAC",
        "image_lines": LINES,
        "image_samples": SAMPLES,
        "radii": {"semimajor": RADIUS, "semiminor": RADIUS, "unit": "km"},
        "starting_ephemeris_time": SIDES[side][1],
        "center_ephemeris_time": middle,
        "line_scan_rate": [[0.5, -LINES * RATE / 2, RATE]],
        "detector_center": {"line": 0.0, "sample": SAMPLES / 2},
        "starting_detector_line": 0,
        "starting_detector_sample": 0,
        "detector_line_summing": 1,
        "detector_sample_summing": 1,
        "focal2pixel_lines": [0.0, 1 / PITCH, 0.0],
        "focal2pixel_samples": [0.0, 0.0, 1 / PITCH],
        "focal_length_model": {"focal_length": FOCAL_LENGTH},
        "optical_distortion": {"radial": {"coefficients": [0.0, 2e-6, 0.0]}},
        "instrument_position": own
        | {"positions": places.tolist(), "velocities": velocities.tolist(), "unit": "km"},
        "instrument_pointing": own | {"quaternions": Attitudes(matrices).values("quaternion").tolist()},
        "body_rotation": own | {"quaternions": Attitudes(bodies).values("quaternion").tolist()},
    }


def ground(image: SupportedImage) -> np.ndarray:
    """Return X, Y, Z of points all over an image, on hills of 150 m."""
    lines, samples = (each.ravel() for each in np.mgrid[300 : LINES - 299 : 8j, 200 : SAMPLES - 199 : 6j])
    sphere = Spheroid(1e3 * RADIUS, 1e3 * RADIUS)
    places = geocentric_to_geographic(image.to_ground(lines, samples), sphere)
    places[:, 2] += 150.0 * np.sin(6e3 * places[:, 0]) * np.cos(5e3 * places[:, 1])
    return geographic_to_geocentric(places, sphere)


def simulate(folder: Path, seed: int = 7) -> np.ndarray:
    """Write the files of the pair, and return the true points."""
    random = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    images = []
    for side in SIDES:
        path = folder / f"{side}.json"
        path.write_text(json.dumps(support(side)))
        images.append(SupportedImage(read_support(path), side, "isis", "isis"))
        turn = random.normal(0.0, 1.0, (3, 3)) * np.array(POINTING)[:, np.newaxis]
        path.write_text(json.dumps(support(side, random.normal(0.0, PLACE, 3), turn)))
    points = ground(images[0])
    seen = np.stack([image.to_image(points) for image in images], axis=1)
    lines, samples = (seen + random.normal(0.0, MEASURED, seen.shape)).reshape(-1, 2).T
    control = np.isin(np.arange(len(points)), [0, 5, 27, 42, 47])
    known = points + random.normal(0.0, CONTROL, points.shape)
    square = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0]) * CONTROL**2
    types = np.where(control, POINT_TYPES.index("Constrained"), POINT_TYPES.index("Free"))
    count, held = len(points), control[:, np.newaxis]
    network = ControlNetwork(
        ControlPoints(
            [f"point_{k:02d}" for k in range(count)],
            types.astype(np.int8),
            apriori=np.where(held, known, np.nan),
            apriori_covariance=np.where(held, square, np.nan),
            constrained=np.repeat(held, 3, axis=1),
        ),
        ControlMeasures(
            [f"SIM/{side}" for side in SIDES],
            np.tile(np.arange(2, dtype=np.int32), count),
            np.full(2 * count, 3, dtype=np.int8),
            samples,
            lines,
        ),
        2 * np.arange(count + 1),
        network_id="simulated_pair",
        target="Moon",
    )
    (folder / "pair.net").write_bytes(network_text(network))
    (folder / "images.lis").write_text("".join(f"SIM/{side}, {side}.json\n" for side in SIDES))
    (folder / "settings.txt").write_text(SETTINGS.lstrip())
    return points


def main(folder: str = "pair") -> Result:
    """Write the pair, adjust it, and print what came of it."""
    place = Path(folder)
    truth = simulate(place)
    options = ReadOptions(cubes=place / "images.lis", jigsaw=str(place / "settings.txt"))
    project = formats.read(place / "pair.net", options)
    result = adjust(project.block)
    sphere = project.block.spheroid
    assert sphere is not None
    errors = geographic_to_geocentric(np.array(result.point_positions), sphere) - truth
    heights = result.point_positions[:, 2] - geocentric_to_geographic(truth, sphere)[:, 2]
    print(f"{result.status}, sigma0 {np.sqrt(result.covariance_scale):.3f}")
    print(f"points: errors {np.sqrt((errors**2).sum(axis=1).mean()):.1f} m, of them in radius", end=" ")
    print(f"{np.sqrt((heights**2).mean()):.1f} m, standard deviation", end=" ")
    print(f"{np.sqrt(result.point_covariances[:, 2, 2].mean()):.1f} m")
    for name, own in result.trajectories.items():
        print(f"{name}: pointing known to {np.rad2deg(own.rotation_sd[0]).round(5)} degrees")
    return result


if __name__ == "__main__":
    main(*sys.argv[1:])
