"""The sky over a station: refraction against rays and erfa, aberration, standard coordinates."""

import erfa
import numpy as np
import pytest
from scipy.integrate import quad

from photogram.stellar import ARCSEC, Air, Site, refraction

EARTH, TROPOPAUSE, TOP = 6378120.0, 11000.0, 80000.0
LAPSE, MOLAR, GAS = 0.0065, 28.9644, 8314.32
GRAVITY = 9.784


def refractivity(wavelength):
    """Return n - 1 of dry air at 0 degrees Celsius and 1013.25 hPa (IAG 1963), wavelength in micrometres."""
    return 1e-6 * (287.6155 + 1.62887 / wavelength**2 + 0.01360 / wavelength**4)


def ray(observed, temperature, pressure, wavelength):
    """Return refraction of a ray through a polytropic troposphere below an isothermal stratosphere.

    Integral of -dn/dh tan(zenith distance) / n, with n r sin(zenith distance) constant along the ray. Dry air
    at sea level, latitude 45 degrees; radians, kelvin, hPa, micrometres.
    """
    ground = refractivity(wavelength) * 273.15 / 1013.25 * pressure / temperature
    scale = GRAVITY * MOLAR / GAS
    exponent, cold = scale / LAPSE - 1, temperature - LAPSE * TROPOPAUSE

    def below(height):
        now = temperature - LAPSE * height
        thin = ground * (now / temperature) ** exponent
        return thin, -LAPSE * exponent / now * thin

    def above(height):
        thin = below(TROPOPAUSE)[0] * np.exp(-scale * (height - TROPOPAUSE) / cold)
        return thin, -scale / cold * thin

    def bend(height, air):
        thin, gradient = air(height)
        sine = (1 + ground) * EARTH * np.sin(observed) / ((1 + thin) * (EARTH + height))
        return -gradient / (1 + thin) * sine / np.sqrt(1 - sine**2)

    layers = ((0.0, TROPOPAUSE, below), (TROPOPAUSE, TOP, above))
    return sum(quad(bend, low, high, args=(air,), epsabs=1e-13)[0] for low, high, air in layers)


def fit(z, air=None):
    return refraction(np.atleast_1d(z), air, observed=True)


def test_refraction_is_that_of_rays_at_standard_conditions():
    """Rays of 0.574 um; the report does not say for which wavelength Garfinkel's tables are."""
    for z in np.radians([5.0, 30.0, 45.0, 60.0, 70.0, 74.0, 75.0]):
        assert fit(z)[0] == pytest.approx(ray(z, 273.15, 1013.25, 0.574), abs=0.02 * ARCSEC)


@pytest.mark.parametrize(("temperature", "pressure"), [(293.15, 760.0), (263.15, 760.0), (273.15, 690.0)])
def test_refraction_in_other_air_is_that_of_rays(temperature, pressure):
    """The report claims a tenth of a second to 70 degrees within 50 K and 75 mm."""
    for z in np.radians([45.0, 60.0, 70.0]):
        expected = ray(z, temperature, pressure * 1013.25 / 760.0, 0.574)
        assert fit(z, Air(temperature, pressure))[0] == pytest.approx(expected, abs=0.1 * ARCSEC)


def erfa_refraction(z, wavelength):
    a, b = erfa.refco(1013.25, 0.0, 0.0, wavelength)
    return a * np.tan(z) + b * np.tan(z) ** 3


def test_refraction_agrees_with_erfa_to_75_degrees():
    """Dry air of 0 degrees Celsius and one atmosphere; wavelengths from 0.5735 to 0.5738 um agree."""
    z = np.radians(np.arange(0.5, 75.01, 0.5))
    for wavelength in (0.5735, 0.5738):
        assert np.abs(fit(z) - erfa_refraction(z, wavelength)).max() < 0.03 * ARCSEC


def test_at_75_degrees_and_0574_half_of_the_difference_is_erfa_s():
    """There 0.0325 seconds lie between the two, and rays 0.0137 above the two terms of erfa."""
    z = np.radians(75.0)
    rays, terms = ray(z, 273.15, 1013.25, 0.574), erfa_refraction(z, 0.574)
    assert fit(z)[0] - terms == pytest.approx(0.0325 * ARCSEC, abs=0.0005 * ARCSEC)
    assert rays - terms == pytest.approx(0.0137 * ARCSEC, abs=0.0005 * ARCSEC)
    below = np.radians(np.arange(0.5, 74.6, 0.5))
    assert np.abs(fit(below) - erfa_refraction(below, 0.574)).max() < 0.03 * ARCSEC


def test_refraction_of_a_true_zenith_distance_undoes_that_of_the_observed_one():
    true = np.radians(np.linspace(0.0, 89.0, 90))
    observed = true - refraction(true)
    assert observed + fit(observed) == pytest.approx(true, abs=1e-14)


def test_refraction_in_hour_angle_and_declination_keeps_the_azimuth():
    """Equations 10 and 12 to 14, by the parallactic angle."""
    site = Site(np.radians(40.0), air=Air(285.0, 740.0), aberration=0.0)
    hour, dec = (grid.ravel() for grid in np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(-0.2, 1.4, 9)))
    sp, cp = np.sin(site.latitude), np.cos(site.latitude)
    cosine = np.sin(dec) * sp + np.cos(dec) * np.cos(hour) * cp
    sine = np.sqrt(1 - cosine**2)
    r = refraction(np.arccos(cosine), site.air)
    cos_q, sin_q = (sp - np.sin(dec) * cosine) / (np.cos(dec) * sine), np.sin(hour) * cp / sine
    sin_dec = np.sin(dec) * np.cos(r) + np.cos(dec) * np.sin(r) * cos_q
    cos_dec = np.sqrt(1 - sin_dec**2)
    refracted = hour - np.arcsin(sin_q * np.sin(r) / cos_dec)
    zenith = sp * sin_dec + cp * cos_dec * np.cos(refracted)
    expected = np.column_stack(
        [(cp * sin_dec - sp * cos_dec * np.cos(refracted)) / zenith, -cos_dec * np.sin(refracted) / zenith]
    )
    found = site.standard_coordinates(np.column_stack([-hour, dec]), 0.0)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-13)


def test_diurnal_aberration_moves_a_star_of_the_meridian_east():
    """By 0.320 seconds of arc times the cosine of the latitude; in the west also in declination."""
    latitude = np.radians(35.0)
    here = Site(latitude, air=Air(280.0, 0.0))
    still = Site(latitude, air=Air(280.0, 0.0), aberration=0.0)
    k = 0.320 * ARCSEC * np.cos(latitude)
    zenith = np.array([[0.0, latitude]])
    xi, eta = (here.standard_coordinates(zenith, 0.0) - still.standard_coordinates(zenith, 0.0))[0]
    assert (xi, eta) == (pytest.approx(0.0, abs=1e-11), pytest.approx(k, rel=1e-6))
    west = np.array([[-1.2, 0.5]])
    moved = still.places(here.standard_coordinates(west, 0.0), 0.0) - west
    assert moved[0, 1] == pytest.approx(k * np.sin(1.2) * np.sin(0.5), rel=1e-6)
    assert moved[0, 0] == pytest.approx(k * np.cos(1.2) / np.cos(0.5), rel=1e-6)


def test_standard_coordinates_come_back():
    """Equations 1 to 5, both ways, and with refraction and aberration."""
    generator = np.random.default_rng(1)
    places = np.column_stack([generator.uniform(-1, 1, 200), generator.uniform(-0.3, 1.5, 200)])
    for site, limit in ((Site(0.7, air=Air(280.0, 0.0), aberration=0.0), 1e-14), (Site(0.7), 1e-13)):
        again = site.places(site.standard_coordinates(places, 0.0), 0.0)
        assert again == pytest.approx(places, rel=0, abs=limit)


def test_azimuths_count_from_south_positive_west():
    """A star that sets in the west of the equator has the azimuth of 90 degrees: eta negative, xi zero."""
    site = Site(0.0, air=Air(280.0, 0.0), aberration=0.0)
    xi, eta = site.standard_coordinates(np.array([[-1.0, 0.0]]), 0.0)[0]
    assert (xi, eta) == (pytest.approx(0.0, abs=1e-16), pytest.approx(-np.tan(1.0)))
