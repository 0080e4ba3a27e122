"""Make the packaged example of absolute orientation: a simulated model with control of every kind.

    python examples/make_absolute_orientation.py

writes stations.csv and points.csv into python/photogram/examples/absolute_orientation. The model, of an area
of 1.5 by 1 km, is at 1 : 6000 in millimetres, turned by kappa = 203 degrees and tilted a little, with errors
of 0.008 mm in each coordinate.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.absolute_orientation import Similarity
from photogram.network import rotation_matrix

TARGET = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples" / "absolute_orientation"
ANGLES_DEG = (0.8, -1.3, 203.0)
SCALE = 1000 / 6000
TRANSLATION = (412.5, 255.0, 118.0)
ORIGIN = np.array([512_000.0, 3_286_000.0, 30.0])
MODEL_SD = 0.008

# Place in the model area (m east, north of the origin, height above it), and what is known of it.
STATIONS = {
    "H101": ((60, 80, 12), "XYZ"),
    "H102": ((1440, 930, 25), "XYZ"),
    "H103": ((1380, 90, 8), "XY"),
    "H104": ((110, 900, 31), "XY"),
    "V201": ((720, 60, 5), "Z"),
    "V202": ((90, 480, 22), "Z"),
    "V203": ((1420, 520, 18), "Z"),
    "V204": ((760, 950, 40), "Z"),
    "V205": ((740, 500, 15), "Z"),
    "P301": ((400, 300, 14), ""),
    "P302": ((1100, 700, 27), ""),
}
POINTS = 12


def main() -> None:
    """Write the two files."""
    generator = np.random.default_rng(1962)
    rotation = rotation_matrix(np.radians([ANGLES_DEG]))[0]
    truth = Similarity.from_parameters(SCALE, rotation, TRANSLATION - SCALE * rotation @ ORIGIN)

    def measured(ground: np.ndarray) -> np.ndarray:
        return truth.to_model(ground) + MODEL_SD * generator.standard_normal(ground.shape)

    places = np.array([place for place, _ in STATIONS.values()]) + ORIGIN
    places += np.round(generator.uniform(-9, 9, places.shape), 3)
    rows = ["id,X,Y,Z,x,y,z"]
    for (name, (_, known)), ground, model in zip(STATIONS.items(), places, measured(places), strict=True):
        control = [f"{value:.3f}" if axis in known else "" for axis, value in zip("XYZ", ground, strict=True)]
        rows.append(",".join([name, *control, *(f"{value:.4f}" for value in model)]))
    (TARGET / "stations.csv").write_text("\n".join(rows) + "\n")

    places = ORIGIN + generator.uniform([50, 50, 0], [1450, 950, 40], (POINTS, 3))
    rows = ["id,x,y,z"]
    for number, model in enumerate(measured(places), 401):
        rows.append(",".join([f"P{number}", *(f"{value:.4f}" for value in model)]))
    (TARGET / "points.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
