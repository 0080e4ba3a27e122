"""Build the packaged example `project`, which `photogram new` writes: six photos of a drone.

python examples/make_project.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera
from photogram.io.csv_text import csv_text

EXAMPLE = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples" / "project"
SEED = 2027
SIZE = (4000, 3000)
CAMERA = Camera(
    "opencv",
    {
        "fx": 3620.0,
        "fy": 3620.0,
        "cx": 2009.3,
        "cy": 1491.6,
        "k1": -0.068,
        "k2": 0.041,
        "p1": 0.0004,
        "p2": -0.0003,
    },
)
IMAGE_SD, CONTROL_SD, GNSS_SD = 0.5, 0.01, 0.03

SETTINGS = """\
# A plain project: this file beside tables of commas (semicolons, tabs and decimal commas are read as well).
# Everything but `format` may be left out; what stands here as a comment is the default.
# `photogram adjust .` adjusts it, `photogram info .` says what is in it; docs/formats.md has all.

[project]
format = 1                          # version of the schema
name = "six photos of a quarry"

[frame]
# kind = "cartesian"                # cartesian | topocentric | geocentric | geographic
# crs = "EPSG:4979"                 # of the origin of a topocentric frame
# origin = [47.38, 8.54, 450.0]     # its latitude, longitude (degrees) and ellipsoidal height (m)

[units]
# length = "m"                      # m | mm | ft | us-ft
# angle = "deg"                     # deg | gon | rad | dms
# image = "px"                      # px | mm | um

[axes]
# image_y = "down"                  # down: rows of pixels; up: photo coordinates (the default with mm and um)
# pixel_origin = "corner"           # corner: the middle of the first pixel is 0.5, 0.5; center: it is 0, 0
# attitude = "omega_phi_kappa"      # ... | yaw_pitch_roll | quaternion | rotation_vector | matrix
# rotation = "object_to_photo"
# photo = "y_up"                    # y_up: the photo looks along -z; y_down: along +z

[sd]                                # standard deviations of tables that have no columns for them
images = 0.5                        # pixels, as [units] image
control = 0.01                      # m: one number, or three for x, y, z
gnss = 0.03
distances = 0.005

[tables]                            # by default NAME.csv, .tsv, .txt or .parquet beside this file
# images = "measurements.txt"

# [control]                         # coordinates of a table in another system than the frame; also
# crs = "EPSG:25832"                # of gnss, points, photos: they go into a topocentric frame (needs pyproj)

[adjust]
# datum = "control"                 # control | minimum | inner
# loss = "none"                     # none | huber | cauchy
# unit_variance = "constrained"     # constrained | unity | redundancy

# [check]                           # the survey of check points, for an accuracy statement
# independent = "yes"               # yes | same-base | no: of the block; a declaration

# [statement]                       # what a client is told of the accuracy; docs/formats.md has all keys
# standards = ["asprs-2023", "plain"]
# class_h = "5cm"                   # classes to be met, with their unit; also class_v, class_3d
# client = "..."                    # also title, project, firm, surveyor, date
"""

COMMENTS = {
    "cameras": [
        "One line a camera. model: docs/cameras.md; parameters by its names, fx = fy where there is one f.",
        "sd_NAME makes a parameter unknown (inf) or weighted; without it, or 0, it is held.",
    ],
    "photos": [
        "One line a photo. x, y, z and the angles are initial values: leave empty what is not known.",
        "sd_x .. make them observations; `use` = false leaves a photo out.",
    ],
    "images": ["What was measured: column to the right and row down from the upper-left corner, pixels."],
    "control": ["use: control (held by its standard deviations), check (compared only) or off."],
    "gnss": ["Positions of the antenna; a table gnss_groups adds lever arms, shifts and drifts."],
    "distances": ["Between two points that have images; standard deviations stand in project.toml."],
}


def main() -> None:
    """Write the example, with no more digits than the numbers deserve."""
    random = np.random.default_rng(SEED)
    photos = [f"DJI_{number:04d}" for number in range(101, 107)]
    centres = np.array([[x, y, 105.0] for y in (-20.0, 20.0) for x in (-25.0, 0.0, 25.0)])
    centres += random.normal(0.0, 1.5, centres.shape)
    angles = random.normal(0.0, 2.0, (6, 3)) + np.array([[0.0, 0.0, 3.0]] * 3 + [[0.0, 0.0, 176.0]] * 3)
    angles[4, 0] += 12.0
    grid = np.array(
        [[x, y] for y in (-36, -18, 0, 18, 36) for x in (-42, -28, -14, 0, 14, 28, 42)], dtype=float
    )
    ground = np.column_stack([grid + random.normal(0, 2.0, grid.shape), random.uniform(-6, 8, len(grid))])
    names = [f"t{number:02d}" for number in range(1, len(ground) + 1)]
    for place, name in zip(
        (1, 5, 29, 33, 17), ("south-1", "south-2", "north-1", "north-2", "middle"), strict=True
    ):
        names[place] = name
    matrices = Attitudes.of("omega_phi_kappa", np.radians(angles)).matrices
    rows = []
    for photo, centre, matrix in zip(photos, centres, matrices, strict=True):
        exact = CAMERA.project((ground - centre) @ matrix)
        seen = ((exact > 20) & (exact < np.array(SIZE) - 20)).all(axis=1)
        measured = exact + random.normal(0, IMAGE_SD, exact.shape)
        rows += [(photo, names[k], *np.round(measured[k], 2).tolist()) for k in np.flatnonzero(seen)]
    control = [k for k, name in enumerate(names) if not name.startswith("t")]
    given = np.round(ground[control] + random.normal(0, CONTROL_SD, (len(control), 3)), 3)
    antennas = np.round(centres + random.normal(0, GNSS_SD, centres.shape), 3)
    ends = [names.index("north-1"), names.index("south-1")]
    distance = float(np.linalg.norm(ground[ends[0]] - ground[ends[1]]) + random.normal(0, 0.005))
    tables = {
        "cameras": {
            "camera": ["drone"],
            "model": ["opencv"],
            "width": [SIZE[0]],
            "height": [SIZE[1]],
            "f": [3620.0],
            **{name: [CAMERA.parameters[name]] for name in ("cx", "cy", "k1", "k2", "p1", "p2")},
        },
        "photos": {
            "photo": photos,
            "camera": ["drone"] * 6,
            **dict(zip("xyz", np.round(centres, 1).T, strict=True)),
            **dict(zip(("omega", "phi", "kappa"), np.round(angles, 1).T, strict=True)),
        },
        "images": {
            name: [row[k] for row in rows] for k, name in enumerate(("photo", "point", "column", "row"))
        },
        "control": {
            "point": [names[k] for k in control],
            **dict(zip("xyz", given.T, strict=True)),
            "use": ["check" if names[k] == "middle" else "control" for k in control],
        },
        "gnss": {"photo": photos, **dict(zip("xyz", antennas.T, strict=True))},
        "distances": {"from": ["north-1"], "to": ["south-1"], "distance": [round(distance, 3)]},
    }
    EXAMPLE.mkdir(parents=True, exist_ok=True)
    (EXAMPLE / "project.toml").write_text(SETTINGS)
    for name, columns in tables.items():
        (EXAMPLE / f"{name}.csv").write_bytes(csv_text(columns, COMMENTS[name]))


if __name__ == "__main__":
    main()
