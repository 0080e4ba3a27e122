"""Support data of images over a small body, made up: a scanner, a frame, a push frame camera in orbit."""

import json

import numpy as np

RADIUS = 1700.0
"""Kilometres, of a sphere."""
PERIOD = 7200.0
START = 1000.0


def quaternion(matrix):
    """Return w, x, y, z of a matrix C, with C v as the usual matrix has it."""
    m = matrix
    w = np.sqrt(max(0.0, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    if w > 0.1:
        x, y, z = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]) / (4 * w)
        return [w, x, y, z]
    _, vectors = np.linalg.eigh((m + m.T) / 2)
    axis = vectors[:, -1]
    s = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    sine, cosine = s @ axis / 2, (np.trace(m) - 1) / 2
    half = np.arctan2(sine, cosine) / 2
    return [np.cos(half), *(np.sin(half) * axis)]


def orbit(times):
    """Return places, velocities (km, km/s) and matrices inertial to camera: x along track, z down."""
    turn = 2 * np.pi * (times - START) / PERIOD
    c, s, zero = np.cos(turn), np.sin(turn), np.zeros_like(turn)
    up, along = np.stack([c, zero, s], axis=1), np.stack([-s, zero, c], axis=1)
    down = -up
    matrices = np.stack([along, np.cross(down, along), down], axis=1)
    height = RADIUS + 100.0
    return height * up, height * 2 * np.pi / PERIOD * along, matrices


def body(times):
    """Return matrices inertial to body."""
    turn = 2e-5 * (times - START) + 0.3
    c, s, zero, one = np.cos(turn), np.sin(turn), np.zeros_like(turn), np.ones_like(turn)
    rows = [[c, s, zero], [-s, c, zero], [zero, zero, one]]
    return np.moveaxis(np.array(rows), 2, 0)


def document(kind="LINE_SCANNER", *, lines=400, samples=300, records=21):
    """Return an ISD of 4 s."""
    times = START + np.linspace(0.0, 4.0, records)
    places, velocities, matrices = orbit(times)
    table = {"ephemeris_times": times.tolist(), "reference_frame": 1}
    found = {
        "name_model": f"USGS_ASTRO_{kind}_SENSOR_MODEL",
        "name_platform": "ORBITER",
        "name_sensor": "CAMERA",
        "image_lines": lines,
        "image_samples": samples,
        "radii": {"semimajor": RADIUS, "semiminor": RADIUS, "unit": "km"},
        "center_ephemeris_time": START + 2.0,
        "starting_ephemeris_time": START,
        "line_scan_rate": [[0.5, -2.0, 4.0 / lines]],
        "detector_center": {"line": 2.5, "sample": 160.0},
        "starting_detector_line": 3,
        "starting_detector_sample": 4,
        "detector_line_summing": 1,
        "detector_sample_summing": 1,
        "focal2pixel_lines": [0.1, 50.0, 0.2],
        "focal2pixel_samples": [0.2, -0.1, 50.0],
        "focal_length_model": {"focal_length": 300.0},
        "optical_distortion": {"radial": {"coefficients": [1e-3, 2e-5, 0.0]}},
        "instrument_position": table
        | {"positions": places.tolist(), "velocities": velocities.tolist(), "unit": "km"},
        "instrument_pointing": table | {"quaternions": [quaternion(m) for m in matrices]},
        "body_rotation": table | {"quaternions": [quaternion(m) for m in body(times)]},
    }
    if kind == "PUSH_FRAME":
        found |= {"framelet_height": 16, "interframe_delay": 4.0 / (lines / 16), "exposure_duration": 0.01}
    return found


def unmirrored(document):
    """Return a frame whose focal plane is not mirrored if it looks along +z."""
    found = json.loads(json.dumps(document))
    for name in ("focal2pixel_samples", "focal2pixel_lines"):
        found[name][1] *= -1
    return found


def along_minus_z(document):
    """Return the same frame with axes of the camera that are turned by 180 degrees about y."""
    found = unmirrored(document)
    w, x, y, z = np.array(found["instrument_pointing"]["quaternions"]).T
    found["instrument_pointing"]["quaternions"] = np.column_stack([-y, z, w, -x]).tolist()
    return found


def written(folder, data, name="image.json"):
    """Return the path of an ISD."""
    path = folder / name
    path.write_text(json.dumps(data))
    return path
