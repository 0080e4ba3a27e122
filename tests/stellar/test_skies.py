"""Today's skies: places against pyerfa's own observer, simulated exposures from the Hipparcos catalogue."""

from dataclasses import replace

import erfa
import numpy as np
import pytest
from observer import places_of_j2000

from message_codes import coded
from photogram import AdjustmentError, InputError
from photogram.stellar import (
    ARCSEC,
    Air,
    Catalogue,
    Exposure,
    Site,
    SkyCamera,
    apparent_places,
    calibrate_exposures,
    project_sky,
    sidereal_time,
)

SITE = Site(np.radians(47.0), np.radians(-8.5), 500.0, Air(283.15, 715.0), aberration=0.3192 * ARCSEC)
FRAME = (6000.0, 4000.0)
TRUTH = SkyCamera(
    np.array([9010.0, 8995.0, 3015.0, 1988.0, -0.11, 0.09, -0.02, 4e-4, -3e-4]), np.zeros((9, 9))
)


@pytest.fixture(scope="module")
def catalogue():
    return Catalogue.hipparcos()


def expose(catalogue, utc, attitude, generator, sd=0.1, places=None):
    places = apparent_places(catalogue, utc) if places is None else places
    pixels = project_sky(TRUTH, attitude, SITE, places, sidereal_time(SITE, utc))
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(((pixels > 0) & (pixels < FRAME)).all(axis=1))
    xy = pixels[seen] + sd * generator.standard_normal((len(seen), 2))
    return Exposure(utc, xy, attitude, seen)


def test_directions_agree_with_erfa_without_air(catalogue):
    bright = catalogue.brighter(3.0)
    utc = "2024-03-01T21:03:05.25"
    site = Site(np.radians(47.0), np.radians(-8.5), air=Air(280.0, 0.0), aberration=0.3192 * ARCSEC)
    standard = site.standard_coordinates(apparent_places(bright, utc), sidereal_time(site, utc))
    j2000 = places_of_j2000(bright)
    day = erfa.dtf2d("UTC", 2024, 3, 1, 21, 3, 5.25)
    azimuth, zenith, *_ = erfa.atco13(
        *j2000, *day, 0.0, np.radians(8.5), site.latitude, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5
    )
    up = zenith < np.radians(70)
    tangent = np.tan(zenith[up])
    expected = np.column_stack([tangent * np.cos(azimuth[up]), tangent * np.sin(azimuth[up])])
    # Polar radius against latitude in the diurnal aberration, and second orders: a milliarcsecond.
    scale = 1 + tangent**2
    assert up.sum() > 50
    assert (np.abs(standard[up] - expected).max(axis=1) / scale).max() < 3e-3 * ARCSEC
    assert np.isnan(standard[zenith > np.radians(91)]).all()


def test_a_camera_comes_back_from_its_file(tmp_path):
    camera = SkyCamera(TRUTH.values, np.diag(np.arange(1.0, 10.0)))
    (tmp_path / "camera.json").write_bytes(camera.to_json())
    again = SkyCamera.read(tmp_path / "camera.json")
    assert (again.values == camera.values).all()
    assert (again.covariance == camera.covariance).all()
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(InputError, check=coded("error.at", what="error.document")):
        SkyCamera.read(tmp_path / "other.json")


def test_few_and_many_exposures_have_the_same_covariance(catalogue):
    """Attitudes in one block with the camera, or as blocks of their own with the camera as border."""
    generator = np.random.default_rng(6)
    bright = catalogue.brighter(5.5)
    attitudes = [np.array(a) for a in ((0.2, -0.1, 0.4), (-0.3, 0.2, 1.9), (0.1, 0.3, -1.0))]
    three = [expose(bright, f"2024-03-01T2{i}:10:00", a, generator) for i, a in enumerate(attitudes)]
    joint = calibrate_exposures(three, TRUTH, SITE, bright)
    # The fourth repeats the third with so few stars that only its own attitude learns from it.
    few = Exposure(three[2].utc, three[2].xy[:2], three[2].attitude, three[2].stars[:2])
    apart = calibrate_exposures([*three, few], TRUTH, SITE, bright)
    scale = (apart.mean_error / joint.mean_error) ** 2
    sd = np.sqrt(np.diag(joint.camera.covariance))
    off = (apart.camera.covariance / scale - joint.camera.covariance) / np.outer(sd, sd)
    assert np.abs(off).max() < 0.03
    own = np.sqrt(np.diag(joint.attitude_covariances[0]))
    cross = (apart.cross_covariances[0] / scale - joint.cross_covariances[0]) / np.outer(own, sd)
    assert np.abs(cross).max() < 0.03


def test_a_hundred_exposures_adjust(catalogue):
    generator = np.random.default_rng(7)
    deep = catalogue.brighter(10.0)
    # Within the two hours places change by a thousandth of a pixel.
    places = apparent_places(deep, "2024-03-01T21:00:00")
    exposures = []
    for number in range(100):
        attitude = np.concatenate([0.5 * generator.uniform(-1, 1, 2), generator.uniform(-3, 3, 1)])
        made = expose(
            deep, f"2024-03-01T{number // 60 + 20}:{number % 60:02d}:00", attitude, generator, places=places
        )
        exposures.append(replace(made, xy=made.xy[:2000], stars=made.stars[:2000]))
    result = calibrate_exposures(exposures, SkyCamera.of_field(*FRAME, 0.6435), SITE, deep)
    assert result.status == "converged"
    errors = np.sqrt(np.diag(result.camera.covariance))
    assert np.abs((result.camera.values - TRUTH.values) / errors).max() < 3.5


def test_what_the_memory_does_not_hold_is_refused(catalogue, monkeypatch):
    bright = catalogue.brighter(4.0)
    exposure = expose(bright, "2024-03-01T21:10:00", np.array([0.2, -0.1, 0.4]), np.random.default_rng(1))
    monkeypatch.setattr("photogram.stellar.sky_calibration.available_memory", lambda: 1000)
    with pytest.raises(AdjustmentError, check=coded("stars.memory", exposures=1)):
        calibrate_exposures([exposure], TRUTH, SITE, bright)


def test_times_that_are_none_are_refused():
    with pytest.raises(InputError, check=coded("stars.utc")):
        sidereal_time(SITE, "yesterday")
