"""Attitudes in ICRS against pyerfa's own observer, and effects that are left out."""

from dataclasses import replace

import erfa
import numpy as np
import pytest
from observer import places_of_j2000

from photogram import _photocore
from photogram.stellar import ARCSEC, Air, Catalogue, Earth, Effects, Site, apparent_places, sidereal_time
from photogram.stellar.places import VISION, inertial_attitudes

UTC = "2024-03-01T21:03:05.25"
SITE = Site(np.radians(47.0), np.radians(-8.5), 500.0, Air(283.15, 715.0))
ANGLES = np.array([0.31, -0.42, 1.3])


def inertial(angles, covariance, site=SITE, utc=UTC, earth=None):
    """Return the attitude of one exposure, and its matrix from ICRS to x right, y down, z along the axis."""
    found = inertial_attitudes(angles[None], covariance[None], site, [utc], earth)
    return found, found.values("matrix_to_vision")[0]


def test_a_star_is_where_the_attitude_says_it_is():
    """Bare places (no aberration, no refraction) through the local matrix, and ICRS directions through R."""
    site = replace(SITE, effects=Effects(False, False, False, False))
    earth = Earth(0.21, (0.3 * ARCSEC, 25 * ARCSEC))
    stars = Catalogue.hipparcos().brighter(4.0)
    still = replace(stars, parallaxes=0 * stars.parallaxes, proper_motions=0 * stars.proper_motions)
    _, matrix = inertial(ANGLES, np.eye(3), site, earth=Earth(earth.dut1))
    local = site.standard_coordinates(
        apparent_places(still, UTC, site.effects), sidereal_time(site, UTC, earth.dut1)
    )
    up = np.isfinite(local).all(axis=1)
    local = np.column_stack([local[up], np.ones(up.sum())])
    seen = local / np.linalg.norm(local, axis=1, keepdims=True) @ _photocore.pointing_matrix(ANGLES).T
    # Places of 1991.25 that do not move are those of 2000.
    expected = erfa.s2c(*still.places[up].T) @ matrix.T
    assert seen == pytest.approx(expected, abs=1e-9)
    assert np.linalg.det(matrix) == pytest.approx(1.0, abs=1e-12)


def test_apparent_places_differ_by_the_effects_that_are_left_out():
    """All of them against erfa's bare precession; one by one by what they are."""
    stars = Catalogue.hipparcos().brighter(3.0)
    with_all = apparent_places(stars, UTC)
    steps = apparent_places(stars, UTC, Effects(diurnal_aberration=False, refraction=False))
    assert steps.tolist() == with_all.tolist()

    def moved(effects):
        off = erfa.s2c(*apparent_places(stars, UTC, effects).T) - erfa.s2c(*with_all.T)
        return np.linalg.norm(off, axis=1) / ARCSEC

    aberration, deflection = moved(Effects(annual_aberration=False)), moved(Effects(light_deflection=False))
    # 20.5 on the mean, 1.7 % more near perihelion.
    assert 20.0 < aberration.max() < 20.9
    # A few hundredths of an arcsecond near the Sun, 0.004 opposite to it.
    assert 0 < np.median(deflection) < 0.01
    right, declination, *_ = places_of_j2000(stars)
    tt = erfa.taitt(*erfa.utctai(*erfa.dtf2d("UTC", 2024, 3, 1, 21, 3, 5.25)))
    bare = erfa.rxp(erfa.pnm06a(*tt), erfa.s2c(right, declination))
    none = erfa.s2c(*apparent_places(stars, UTC, Effects(False, False)).T)
    # Proper motion from 2000 to 2024 and parallaxes are what is left: up to some arcseconds a year.
    left = np.linalg.norm(none - bare, axis=1) / ARCSEC
    assert np.median(left) < 3
    assert Effects(False, True, False, True).left_out == ("annual aberration", "diurnal aberration")


def test_the_steps_together_are_those_of_erfa():
    """The branch that leaves nothing out is erfa's; the one that takes its steps gives the same."""
    from photogram.stellar.places import _reduced

    stars = Catalogue.hipparcos().brighter(3.0)
    tt = erfa.taitt(*erfa.utctai(*erfa.dtf2d("UTC", 2024, 3, 1, 21, 3, 5.25)))
    astrometry, origins = erfa.apci13(*tt)
    right, declination = _reduced(places_of_j2000(stars), astrometry, Effects())
    found = np.column_stack([erfa.anp(right - origins), erfa.anpm(declination)])
    assert found == pytest.approx(apparent_places(stars, UTC), abs=1e-13)


def test_a_site_without_refraction_and_diurnal_aberration():
    places, time = np.array([[1.0, 0.5]]), 1.3
    bare = replace(SITE, effects=Effects(diurnal_aberration=False, refraction=False))
    vacuum = replace(SITE, aberration=0.0, air=Air(283.15, 0.0))
    assert (
        bare.standard_coordinates(places, time).tolist() == vacuum.standard_coordinates(places, time).tolist()
    )
    refracted = replace(SITE, effects=Effects(diurnal_aberration=False))
    zenith = [np.arctan(np.hypot(*s.standard_coordinates(places, time)[0])) for s in (bare, refracted)]
    assert (zenith[0] - zenith[1]) / ARCSEC == pytest.approx(
        60.2 * np.tan(zenith[0]) * 715 / 760 * 273.15 / 283.15, rel=0.01
    )


@pytest.mark.parametrize("angles", [ANGLES, [0.0, 0.0, 0.0], [1.2, 1.4, -2.0], [-0.3, 0.2, 3.1]])
def test_quaternion_and_covariance(angles):
    """Q turns as R does; the covariance is that of small turns about the camera's axes, by differences."""
    generator = np.random.default_rng(5)
    root = generator.normal(size=(3, 3)) * 1e-5
    covariance, angles = root @ root.T, np.array(angles)
    found, matrix = inertial(angles, covariance)
    w, x, y, z = quaternion = found.values("quaternion_to_vision")[0]
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-14)
    assert w >= 0
    by_quaternion = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    assert by_quaternion == pytest.approx(matrix, abs=1e-12)
    turns, changes = [], []
    for k in range(3):
        step = np.eye(3)[k] * 1e-6
        (first, after), (second, before) = (inertial(angles + sign * step, covariance) for sign in (1, -1))
        turns.append(_photocore.rotation_vectors((after @ before.T)[None])[0] / 2e-6)
        ends = [each.values("quaternion_to_vision")[0] for each in (first, second)]
        changes.append((ends[0] - ends[1]) / 2e-6)
    expected = np.array(turns).T @ covariance @ np.array(turns)
    assert VISION * found.step_covariances[0] == pytest.approx(expected, rel=1e-6, abs=1e-18)
    expected = np.array(changes).T @ covariance @ np.array(changes)
    assert found.covariances("quaternion_to_vision")[0] == pytest.approx(expected, rel=1e-6, abs=1e-18)


def test_the_axis_is_where_the_camera_points():
    """The zenith camera sees the declination of its latitude, and local sidereal time as right ascension."""
    _, (_, _, (x, y, z)) = inertial(np.zeros(3), np.eye(3), utc="2000-01-01T12:00:00")
    ra, dec = np.arctan2(y, x) % (2 * np.pi), np.arcsin(z)
    time = sidereal_time(SITE, "2000-01-01T12:00:00")
    # J2000 within nutation.
    assert ra == pytest.approx(time, abs=1e-4)
    assert dec == pytest.approx(SITE.latitude, abs=1e-4)
