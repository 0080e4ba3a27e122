"""Calibrate an all-sky camera by the stars, and let them choose its lens.

    python examples/all_sky_camera.py [LENS]

Three exposures of the whole sky from a tripod, simulated from the Hipparcos catalogue: images have errors of
0.1 pixel, a tenth of them are of no star, attitudes are given a degree wrong. Every lens is tried.
"""

import sys

import numpy as np

from photogram.stellar import (
    ARCSEC,
    LENSES,
    Air,
    Catalogue,
    Exposure,
    Night,
    Site,
    SkyCamera,
    apparent_places,
    calibrate_night,
    project_sky,
    sidereal_time,
)

SITE = Site(np.radians(46.5), np.radians(-7.5), 1000.0, Air(278.15, 680.0), aberration=0.3192 * ARCSEC)
FRAME, SD = (3000.0, 2800.0), 0.1
ATTITUDE = np.array([0.02, -0.03, 0.7])
VALUES = {
    "brown": [1400.0, 1401.0, 1510.0, 1390.0, -0.1, 0.02, 0.0, 2e-4, -1e-4],
    "equidistant": [950.0, 950.6, 1510.0, 1390.0],
    "equisolid": [950.0, 950.6, 1510.0, 1390.0, 0.0, 0.0],
    "stereographic": [800.0, 800.5, 1510.0, 1390.0, 0.0, 0.0],
    "kannala_brandt": [950.0, 950.6, 1510.0, 1390.0, 0.03, -0.01, 0.004, -6e-4],
}


def camera(lens):
    """Return the true camera of a lens."""
    values = np.array(VALUES[lens])
    return SkyCamera(values, np.zeros((len(values),) * 2), lens)


def exposures(lens, generator, count=3, faintest=3.8, false=0.1, highest=80.0):
    """Return exposures with their true attitude, and the star of every image."""
    truth, bright = camera(lens), Catalogue.hipparcos().brighter(faintest)
    made, stars = [], []
    for number in range(count):
        utc = f"2024-01-12T{18 + 2 * number:02d}:10:00"
        places, time = apparent_places(bright, utc), sidereal_time(SITE, utc)
        pixels = project_sky(truth, ATTITUDE, SITE, places, time)
        standard = SITE.standard_coordinates(places, time)
        with np.errstate(invalid="ignore"):
            zenith = np.degrees(np.arctan(np.linalg.norm(standard, axis=1)))
            seen = ((pixels > 0) & (pixels < FRAME)).all(axis=1) & (zenith < highest)
        seen = np.flatnonzero(seen)
        spurious = generator.uniform(0, 1, (round(false * len(seen)), 2)) * FRAME
        xy = np.vstack([pixels[seen] + SD * generator.standard_normal((len(seen), 2)), spurious])
        right = np.concatenate([seen, np.full(len(spurious), -1)])
        magnitude = np.concatenate([bright.magnitudes[seen], generator.uniform(2, faintest, len(spurious))])
        order = np.argsort(magnitude + 0.2 * generator.standard_normal(len(magnitude)))
        made.append(Exposure(utc, xy[order], ATTITUDE))
        stars.append(right[order])
    return made, stars, bright


def night(lens, seed, start=None, **changes):
    """Return a night of such exposures, whose attitudes are given a degree wrong."""
    generator = np.random.default_rng(seed)
    made, stars, bright = exposures(lens, generator)
    turned = [Exposure(e.utc, e.xy, e.attitude + np.radians(generator.uniform(-0.7, 0.7, 3))) for e in made]
    found = Night(
        site=SITE,
        catalogue=bright,
        frame=FRAME,
        camera=start or SkyCamera.of_field(*FRAME, field_of(lens), lens),
        exposures=turned,
        names=tuple(str(k) for k in range(len(made))),
        pixel_sd=SD,
        attitude_error=np.radians(1.0),
        **changes,
    )
    return found, stars


def field_of(lens):
    """Return the horizontal field of view of the true camera, radians."""
    truth = camera(lens)
    rays = truth.rays(np.array([[0.0, truth.values[3]], [FRAME[0], truth.values[3]]]))
    return float(np.arccos(rays[:, 2]).sum())


def main(lens: str) -> None:
    """Print the report of a night whose lens nobody has said."""
    start = SkyCamera.of_field(*FRAME, field_of(lens), "kannala_brandt")
    found, _ = night(lens, 8, start, lenses=tuple(LENSES), tripod=True)
    print(calibrate_night(found).report())


if __name__ == "__main__":
    main(*(sys.argv[1:2] or ["equisolid"]))
