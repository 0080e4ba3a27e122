"""Simulated nights that are hard to identify: how many end right, refused, or wrong.

    python benches/star_nights.py [EXPOSURES] [FIRST_SEED] [PROCESSES] [MINUTES]

Every night has two to six exposures of stars to magnitude 6 of the Hipparcos catalogue; nights are made
until there are so many exposures, or so many minutes are over. The catalogue that is given is zero to three
magnitudes deeper, every third field of view is up to 10 % wrong (half of these nights say so), 30 % of the
images are of no star, a tenth of the stars is missing, attitudes are up to 1.5 degrees wrong or, in every
fifth night, up to 8. The roll of every second night is unknown, and it says so, but for every tenth of them.
Some exposures are of another part of the sky than is said. A night ends

    right       every exposure that takes part has its own stars, and the camera is that of the night
    named       an error, or a message that the camera must not be used: nothing that could be taken for one
    wrong       anything else
"""

from __future__ import annotations

import itertools
import multiprocessing
import sys
import time
from collections import Counter
from dataclasses import dataclass

import numpy as np

from photogram import AdjustmentError, InputError
from photogram.io.numbers import ARCSEC
from photogram.stellar import Air, Site
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.identification import STRETCH
from photogram.stellar.night_calibration import calibrate_night
from photogram.stellar.night_result import CalibratedNight, Night
from photogram.stellar.places import apparent_places, attitude_of, sidereal_time
from photogram.stellar.sky_calibration import Exposure, project_sky
from photogram.stellar.sky_cameras import SkyCamera

FAINTEST, FALSE, MISSED, SD = 6.0, 0.30, 0.10, 0.1
WIDTH, HEIGHT = 6000.0, 4000.0
SITE = Site(np.radians(47.05), np.radians(-8.31), 480.0, Air(278.15, 718.0), aberration=0.3192 * ARCSEC)
TOLD = 0.13
"""Share by which nights say their principal distance may be wrong: 10 % of an angle are more."""
FAR = 6.0
"""Mean errors by which a right camera may be off at most, of nine parameters in thousands of nights."""
AWAY = 0.15
"""Probability that an exposure is of another part of the sky."""


@dataclass(frozen=True)
class Sky:
    """A night and the truth about it."""

    night: Night
    camera: np.ndarray
    stars: dict[str, np.ndarray]
    depth: float
    field_error: float
    roll: str


def make(seed: int) -> Sky:
    """Return a simulated night."""
    generator = np.random.default_rng(seed)
    depth = float(generator.uniform(0, 3))
    catalogue = Catalogue.hipparcos().brighter(FAINTEST + depth)
    bright = catalogue.brighter(FAINTEST)
    focal = float(generator.uniform(5500, 11000))
    values = np.array(
        [focal, focal * generator.normal(1, 1e-3), *generator.normal((3000, 2000), 15), 0, 0, 0, 0, 0]
    )
    values[4:] = generator.normal((-0.08, 0.05, 0.0, 0, 0), (0.03, 0.03, 0.01, 3e-4, 3e-4))
    truth = SkyCamera(values, np.zeros((9, 9)))
    largest = 8.0 if seed % 5 == 4 else 1.5
    roll = "known" if seed % 2 == 0 else "unknown, not said" if seed % 20 == 19 else "unknown"
    exposures, stars = [], {}
    for number in range(int(generator.integers(2, 7))):
        utc = f"2024-{generator.integers(1, 13):02d}-05T2{generator.integers(0, 4)}:{10 + number}:00"
        angles = generator.uniform((0, 30, -180), (360, 80, 180))
        exposure, right = _expose(truth, bright, utc, np.radians(angles), generator)
        shown = angles + generator.uniform(-0.7, 0.7, 3) * largest / [np.cos(np.radians(angles[1])), 1, 1]
        if generator.uniform() < AWAY:
            shown[0] += generator.uniform(60, 300)
        if roll != "known":
            shown[2] = generator.uniform(-180, 180)
        exposures.append(Exposure(exposure.utc, exposure.xy, attitude_of(*np.radians(shown))))
        stars[f"{number}"] = right
    # The share of the field of view; every second of these nights says that it may be as much.
    error = float(generator.uniform(-0.1, 0.1)) if seed % 3 == 2 else float(generator.normal(0, 2e-3))
    night = Night(
        site=SITE,
        catalogue=catalogue,
        frame=(WIDTH, HEIGHT),
        camera=SkyCamera.of_field(WIDTH, HEIGHT, 2 * np.arctan(WIDTH / 2 / focal) * (1 + error)),
        exposures=exposures,
        names=tuple(stars),
        pixel_sd=SD,
        attitude_error=np.radians(largest),
        roll_known=roll != "unknown",
        field_error=TOLD if seed % 6 == 5 else STRETCH,
    )
    return Sky(night, values, stars, depth, error, roll)


def _expose(
    camera: SkyCamera, bright: Catalogue, utc: str, angles: np.ndarray, generator: np.random.Generator
) -> tuple[Exposure, np.ndarray]:
    """Return an exposure, and the star of every image: -1 for the false ones."""
    attitude = attitude_of(*angles)
    pixels = project_sky(camera, attitude, SITE, apparent_places(bright, utc), sidereal_time(SITE, utc))
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(((pixels > 0) & (pixels < (WIDTH, HEIGHT))).all(axis=1))
    seen = seen[generator.uniform(size=len(seen)) > MISSED]
    false = round(FALSE / (1 - FALSE) * len(seen))
    xy = pixels[seen] + SD * generator.standard_normal((len(seen), 2))
    xy = np.vstack([xy, generator.uniform(0, (WIDTH, HEIGHT), (false, 2))])
    magnitudes = np.concatenate([bright.magnitudes[seen], generator.uniform(2, FAINTEST, false)])
    order = np.argsort(magnitudes + 0.2 * generator.standard_normal(len(magnitudes)))
    right = np.concatenate([seen, np.full(false, -1)])[order]
    return Exposure(utc, xy[order], attitude), right


def verdict(sky: Sky) -> tuple[str, str, int]:
    """Calibrate a night; return how it ends, more about it, and how many exposures take part."""
    try:
        result = calibrate_night(sky.night)
    except (InputError, AdjustmentError) as error:
        return "named", str(error), 0
    falsely = [name for name, share in _shares(sky, result).items() if share < 0.9]
    off = (result.camera.values - sky.camera) / np.sqrt(np.diag(result.camera.covariance))
    about = (
        f"{len(result.names)} of {len(sky.night.names)} exposures, unit weight"
        f" {result.calibration.mean_error:.3f}, camera within {np.abs(off).max():.1f} mean errors"
    )
    if not result.usable:
        return "named", f"{about}; {result.messages[0]}", len(result.names)
    if falsely or np.abs(off).max() > FAR:
        return "wrong", f"{about}; false: {falsely}", len(result.names)
    return "right", about, len(result.names)


def _shares(sky: Sky, result: CalibratedNight) -> dict[str, float]:
    """Return of every exposure which share of its identified images has the right star."""
    shares = {}
    for name, exposure in zip(result.names, result.exposures, strict=True):
        taken = exposure.stars >= 0
        shares[name] = float((exposure.stars == sky.stars[name])[taken].mean())
    return shares


def one(seed: int) -> tuple[int, str, str, int, str, int]:
    """Return how the night of a seed ends."""
    sky = make(seed)
    end, about, taken = verdict(sky)
    given_as = (
        f"catalogue {sky.depth:.1f} mag deeper, field {100 * sky.field_error:+.1f} %, roll {sky.roll},"
        f" attitudes within {np.degrees(sky.night.attitude_error):.1f} degrees"
    )
    return seed, end, about, taken, given_as, len(sky.night.names)


def main(exposures: int, first: int, processes: int, minutes: float) -> None:
    """Print how the nights end, those that do not end right one by one."""
    ends: Counter[str] = Counter()
    taken = given = nights = 0
    until = time.monotonic() + 60 * minutes
    with multiprocessing.Pool(processes) as pool:
        for seed, end, about, used, given_as, count in pool.imap(one, itertools.count(first)):
            ends[end] += 1
            taken, given, nights = taken + used * (end == "right"), given + count, nights + 1
            if end != "right":
                print(f"night {seed}: {end}; {given_as}: {about}", flush=True)
            if given >= exposures or time.monotonic() > until:
                pool.terminate()
                break
    print(
        f"{given} exposures, {nights} nights: "
        + ", ".join(f"{ends[end]} {end}" for end in ("right", "named", "wrong"))
    )
    print(f"exposures in the nights that end right, of all given: {taken} of {given}")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:5]]
    main(*(numbers + [400, 0, 1, 10**6][len(numbers) :]))
