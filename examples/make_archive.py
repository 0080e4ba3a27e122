"""Build the packaged example `archive`, which `photogram new --kind archive` writes.

    python examples/make_archive.py [DIRECTORY]

Six photographs on one roll of film, two strips in opposite directions, scanned on one scanner: readings of
images and of eight fiducial marks, a camera and its marks as a certificate has them, twelve points of a
triangulation. The last film was scanned from its other side, and one photo has lost a corner. docs/film.md
says how a reading comes about; here the camera, its marks, the films and the scanner are drawn from what the
tables say of them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera
from photogram.film import Certificate
from photogram.io.csv_text import csv_text

SEED = 1983
EXAMPLES = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples"
EXAMPLE, CERTIFICATE = EXAMPLES / "archive", EXAMPLES / "certificate" / "rc10.toml"
PITCH, ORIGIN, HALF = 0.02, 6000.0, 113.0
"""mm a pixel, the pixel amid a scan, half the format in mm."""
IMAGE_SD, MARK_SD = 0.25, 0.2
"""Pixels."""
ROLL_SD, SIZE_SD, PATTERN_SD = 5e-4, 1e-4, 0.006
"""Of m of a roll, of m, b1 and b2 of its photos, of the weights of its pattern in mm."""
SCANNER = np.array([1.00001, 0.99998, 2e-5])
SCANNER_SD = np.array([4e-6, 4e-6, 6e-6])
"""Sx, Sy and alpha as the calibration of the scanner has them."""
CONTROL_SD = np.array([0.05, 0.05, 0.08])
"""Metres."""
HEIGHT, BASE, APART = 1600.0, 850.0, 1300.0
"""Above the datum, between photos, between strips, in metres."""
PROJECT = """\
# Six photographs of 1983 on film, from the readings of a scan to the ground. `photogram adjust .` adjusts
# films, marks, scanner and lens with the block; `photogram certificate rc10-2345.toml` checks what the
# laboratory printed. Replace the tables by your own; docs/formats.md has all columns, docs/film.md says what
# is adjusted, docs/tutorials/archive.md goes through it.
[project]
format = 1
name = "an archive of 1983"
[units]
image = "mm"                        # of cameras; images of photos with a film are readings
[film]
model = "affine"                    # conformal | affine | bilinear | projective
interior = "inside"                 # or before: fitted photo by photo, then errorless
certificate = "rc10-2345.toml"      # the camera and its marks; of a list, what is valid at the flight
flown = 1983-07-02
[sd]                                # standard deviations of tables that have no columns for them
images = 0.25                       # pixels of the scan
fiducial_images = 0.2
[adjust]
unit_variance = "unity"             # the standard deviations are taken as given
"""
COMMENTS = {
    "cameras": [
        "Without values: the camera, its marks and their covariance are those of its certificate.",
    ],
    "covariances": ["Of the scanner, from its calibration; what is not listed is zero."],
    "fiducial_images": ["Readings of the marks, pixels of the scan. A mark that is not there was lost."],
    "films": [
        "What films of a roll have in common: m, the change of size, and a pattern with weights in mm.",
        "sd_photo_m, sd_b1, sd_b2: of single photos. docs/film.md.",
    ],
    "scanners": [
        "pitch_mm: of a pixel; origin: the pixel from which the correction counts. Sx, Sy, alpha_rad turn",
        "readings into true places: `photogram comparator` calibrates them.",
    ],
    "photos": [
        "x .. kappa: initial values, all unknown. mirrored: scanned from the other side of the film.",
    ],
    "control": ["use: control (held by its standard deviations) or check (compared only)."],
    "images": ["What was measured: pixels of the scan, rows count down."],
}


def photos(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return (6, 3) positions and (6, 3) angles of two strips, the second flown back."""
    rows = []
    for number in range(6):
        strip, along = divmod(number, 3)
        sense = 1.0 - 2.0 * strip
        rows.append(
            [sense * (BASE * along - BASE), APART * strip - APART / 2, HEIGHT, 0.0, 0.0, 180.0 * strip]
        )
    scatter = np.array([25.0, 25.0, 15.0, 0.5, 0.5, 0.8])
    drawn = np.array(rows) + random.normal(0.0, 1.0, (6, 6)) * scatter
    return drawn[:, :3], np.radians(drawn[:, 3:])


def ground(random: np.random.Generator) -> tuple[list[str], np.ndarray]:
    """Return names and places of points: those of the triangulation first, then what was matched."""
    known = [[x, y] for y in (-1250.0, 0.0, 1250.0) for x in (-1300.0, -450.0, 450.0, 1300.0)]
    plan = np.concatenate([np.array(known), random.uniform([-1600, -1500], [1600, 1500], (60, 2))])
    plan += random.normal(0.0, 40.0, plan.shape)
    heights = 90.0 + 60.0 * np.sin(plan[:, 0] / 700.0) * np.cos(plan[:, 1] / 900.0)
    names = [f"trig-{k + 1:02d}" for k in range(12)] + [f"t{k + 1:02d}" for k in range(60)]
    return names, np.column_stack([plan, heights + random.normal(0.0, 6.0, len(plan))])


class Films:
    """One roll and one scanner, as they are: what becomes of places in the frame of the camera.

    Parameters
    ----------
    random
        Draws them from what the tables say.
    """

    def __init__(self, random: np.random.Generator) -> None:
        roll = random.normal(0.0, ROLL_SD)
        self.pattern = random.normal(0.0, PATTERN_SD, 2)
        self.size = random.normal([roll, 0.0, 0.0], SIZE_SD, (6, 3))
        self.placement = random.normal(0.0, [0.6, 0.6, 0.002], (6, 3))
        sx, sy, alpha = random.normal(SCANNER, SCANNER_SD)
        self.to_true = np.array([[sx, sy * np.sin(alpha)], [0.0, sy * np.cos(alpha)]])
        self.mirrored = np.arange(6) == 5

    def readings(self, photo: int, q: np.ndarray) -> np.ndarray:
        """Return (n, 2) columns and rows of places (n, 2) in mm: of marks, or of images behind the lens."""
        x, y = q.T
        m, b1, b2 = self.size[photo]
        w1, w2 = self.pattern / HALF**2
        e = q + q @ np.array([[m + b1, b2], [b2, m - b1]]) + np.column_stack([w1 * x * y, w2 * (x**2 - y**2)])
        e[:, 0] *= -1.0 if self.mirrored[photo] else 1.0
        t1, t2, theta = self.placement[photo]
        turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
        right, up = np.linalg.solve(self.to_true, (e @ turn.T + [t1, t2]).T) / PITCH
        return np.column_stack([ORIGIN + right, ORIGIN - up])


def drawn(random: np.random.Generator, camera: Camera) -> Camera:
    """Return a camera as its certificate allows it to be."""
    names, covariance = camera.covariance
    values = random.multivariate_normal([camera.parameters[name] for name in names], covariance, method="svd")
    parameters = {**camera.parameters, **dict(zip(names, values.tolist(), strict=True))}
    return camera.replace(parameters=parameters, covariance=None)


def listed(kind: str, name: str, components: list[str], matrix: np.ndarray) -> list[tuple[object, ...]]:
    """Return the rows of a covariance matrix, the lower triangle."""
    return [
        (kind, name, components[i], components[j], float(matrix[i, j]))
        for i in range(len(components))
        for j in range(i + 1)
    ]


def columns(names: str, rows: list[tuple[object, ...]]) -> dict[str, list[object]]:
    """Return rows as columns by their names."""
    return {name: [row[k] for row in rows] for k, name in enumerate(names.split())}


def measured(random: np.random.Generator, camera: Camera, marks: dict[str, np.ndarray]) -> dict[str, object]:
    """Return the tables of the flight: photos, readings of marks and images, control."""
    (positions, angles), (names, points), films = photos(random), ground(random), Films(random)
    matrices = Attitudes.of("omega_phi_kappa", angles).matrices
    places = np.array(list(marks.values()))
    fiducials, images = [], []
    for k in range(6):
        read = films.readings(k, places) + random.normal(0.0, MARK_SD, places.shape)
        own = zip(marks, np.round(read, 2).tolist(), strict=True)
        fiducials += [(f"83-{k + 1}", name, *xy) for name, xy in own if (k, name) != (3, "ul")]
        seen = camera.project((points - positions[k]) @ matrices[k])
        inside = np.flatnonzero((np.abs(seen) < 108.0).all(axis=1))
        read = films.readings(k, seen[inside]) + random.normal(0.0, IMAGE_SD, (len(inside), 2))
        own = zip(inside.tolist(), np.round(read, 2).tolist(), strict=True)
        images += [(f"83-{k + 1}", names[point], *xy) for point, xy in own]
    start = positions + random.normal(0.0, 20.0, positions.shape)
    turned = np.degrees(angles + random.normal(0.0, 0.01, angles.shape))
    control = np.round(points[:12] + random.normal(0.0, CONTROL_SD, (12, 3)), 3)
    counts = {name: sum(row[1] == name for row in images) for name in names}
    once = {name for name, count in counts.items() if count == 1 and not name.startswith("trig")}
    return {
        "photos": {
            "photo": [f"83-{k + 1}" for k in range(6)],
            "film": ["roll-7"] * 6,
            "scanner": ["scanner"] * 6,
            "mirrored": ["true" if each else "false" for each in films.mirrored],
            **dict(zip("xyz", np.round(start, 1).T, strict=True)),
            **dict(zip(("omega", "phi", "kappa"), np.round(turned, 2).T, strict=True)),
        },
        "fiducial_images": columns("photo fiducial column row", fiducials),
        "images": columns("photo point column row", [row for row in images if row[1] not in once]),
        "control": {
            "point": names[:12],
            **dict(zip("xyz", control.T, strict=True)),
            **{f"sd_{axis}": [sd] * 12 for axis, sd in zip("xyz", CONTROL_SD.tolist(), strict=True)},
            "use": ["check" if k in (1, 5, 6, 10) else "control" for k in range(12)],
        },
    }


def main(arguments: list[str]) -> None:
    """Write the tables, and the certificate beside them."""
    folder = Path(arguments[0]) if arguments else EXAMPLE
    random = np.random.default_rng(SEED)
    certificate = Certificate.read(CERTIFICATE)
    camera, marks = certificate.camera("brown_forward"), certificate.fiducials()
    sd = np.sqrt(np.diag(marks.covariance)).reshape(-1, 2)
    true = random.normal(marks.xy, sd)
    rows = listed("scanner", "scanner", ["Sx", "Sy", "alpha"], np.diag(SCANNER_SD**2))
    tables = {
        "cameras": columns("camera model", [("rc10-2345", "brown_forward")]),
        "covariances": columns("kind name first second covariance", rows),
        "films": columns(
            "film m sd_m sd_photo_m sd_b1 sd_b2 pattern sd_w1 sd_w2 half_format_mm",
            [("roll-7", 0.0, ROLL_SD, *[SIZE_SD] * 3, "w1 w2", PATTERN_SD, PATTERN_SD, HALF)],
        ),
        "scanners": columns(
            "scanner pitch_mm origin_column origin_row Sx Sy alpha_rad",
            [("scanner", PITCH, ORIGIN, ORIGIN, *SCANNER.tolist())],
        ),
        **measured(random, drawn(random, camera), dict(zip(marks.names, true, strict=True))),
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "project.toml").write_text(PROJECT, encoding="utf-8")
    (folder / "rc10-2345.toml").write_bytes(CERTIFICATE.read_bytes())
    for name, own in tables.items():
        (folder / f"{name}.csv").write_bytes(csv_text(own, COMMENTS[name]))


if __name__ == "__main__":
    main(sys.argv[1:])
