"""Simulated nights of the Hipparcos catalogue, identified and calibrated without knowing the truth."""

import numpy as np
import pytest

from photogram.stellar import (
    ARCSEC,
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

SITE = Site(np.radians(47.0), np.radians(-8.5), 500.0, Air(283.15, 715.0), aberration=0.3192 * ARCSEC)
FRAME = (6000.0, 4000.0)
TRUTH = np.array([9010.0, 8995.0, 3015.0, 1988.0, -0.11, 0.09, -0.02, 4e-4, -3e-4])
ATTITUDES = np.array([[0.2, -0.1, 0.4], [-0.3, 0.2, 1.9], [0.1, 0.35, -1.0], [-0.1, -0.3, 2.6]])
SD = 0.1


@pytest.fixture(scope="module")
def bright():
    return Catalogue.hipparcos().brighter(6.0)


def expose(bright, number, generator):
    """Return an exposure as a detector hands it on, and the star of every image.

    A tenth of the stars is missing, a fifth of the images is none of the catalogue, the order of brightness
    is rough; the attitude is given a degree and a half wrong in direction, three in rotation.
    """
    utc = f"2024-03-01T2{number}:10:00"
    places, camera = apparent_places(bright, utc), SkyCamera(TRUTH, np.zeros((9, 9)))
    pixels = project_sky(camera, ATTITUDES[number], SITE, places, sidereal_time(SITE, utc))
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(((pixels > 0) & (pixels < FRAME)).all(axis=1))
    seen = seen[generator.uniform(size=len(seen)) > 0.1]
    xy = pixels[seen] + SD * generator.standard_normal((len(seen), 2))
    false = generator.uniform(0, 1, (len(seen) // 5, 2)) * FRAME
    magnitudes = np.concatenate(
        [bright.magnitudes[seen], generator.choice(bright.magnitudes[seen], len(false))]
    )
    order = np.argsort(magnitudes + 0.2 * generator.standard_normal(len(magnitudes)))
    angle = generator.uniform(0, 2 * np.pi)
    wrong = np.radians([1.5 * np.cos(angle), 1.5 * np.sin(angle), generator.choice([-3.0, 3.0])])
    stars = np.concatenate([seen, np.full(len(false), -1)])[order]
    return Exposure(utc, np.vstack([xy, false])[order], ATTITUDES[number] + wrong), stars


def calibrated(bright, seed):
    generator = np.random.default_rng(seed)
    exposures, stars = zip(*(expose(bright, number, generator) for number in range(4)), strict=True)
    night = Night(
        site=SITE,
        catalogue=bright,
        frame=FRAME,
        camera=SkyCamera.of_field(*FRAME, 2 * np.arctan(3000 / 9000)),
        exposures=exposures,
        names=tuple("1234"),
        pixel_sd=SD,
        attitude_error=np.radians(3.0),
    )
    return calibrate_night(night), stars


@pytest.fixture(scope="module")
def nights(bright):
    return [calibrated(bright, seed) for seed in range(10)]


def test_images_are_identified_from_a_poor_attitude(nights):
    for found, stars in nights:
        assert found.names == ("1", "2", "3", "4")
        for exposure, right in zip(found.exposures, stars, strict=True):
            taken = exposure.stars >= 0
            # No image is taken for another star, a false one only where it hides beside a true one.
            assert (exposure.stars == right)[taken & (right >= 0)].all()
            assert (taken & (right < 0)).sum() <= 1
            assert taken[right >= 0].mean() > 0.97


def test_camera_and_attitudes_come_back_as_their_covariances_say(nights):
    forms, attitudes, units = [], [], []
    for found, _ in nights:
        off = found.camera.values - TRUTH
        errors = np.sqrt(np.diag(found.camera.covariance))
        assert np.abs(off / errors).max() < 3.5
        correlation = found.camera.covariance / np.outer(errors, errors)
        forms.append(off / errors @ np.linalg.solve(correlation, off / errors))
        calibration = found.calibration
        away = calibration.attitudes - ATTITUDES
        covariances = calibration.attitude_covariances
        attitudes += [d @ np.linalg.solve(c, d) for d, c in zip(away, covariances, strict=True)]
        units.append(calibration.mean_error)
    # Chi-squared of 9 and of 3, its mean over ten nights and forty attitudes, which share a camera.
    assert np.mean(forms) == pytest.approx(9.0, abs=3 * np.sqrt(18 / 10))
    assert np.mean(attitudes) == pytest.approx(3.0, abs=3 * np.sqrt(6 / 10))
    # Images beyond four standard deviations are left out, and one in ten thousand belongs there.
    assert np.mean(units) == pytest.approx(1.0, abs=0.02)
