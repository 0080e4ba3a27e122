"""Exposures against each other, and what a night says of itself when they do not fit."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import has_code
from photogram import _photocore
from photogram.cli import app
from photogram.stellar import (
    Catalogue,
    SkyCamera,
    apparent_places,
    calibrate_exposures,
    calibrate_night,
    read_night,
    sidereal_time,
)
from photogram.stellar.comparison import LEVEL, NOTABLE, held_out


@pytest.fixture(scope="module")
def night(night):
    """Return the night without a pole: exposures held out are compared in the frame of the adjustment."""
    return replace(night, earth=replace(night.earth, pole=(0.0, 0.0)))


def test_an_exposure_held_out_is_what_an_adjustment_without_it_says(night, result):
    """T is the difference of the sums of squares of the adjustments with and without the exposure."""
    exposures = [
        replace(e, attitude=a) for e, a in zip(result.exposures, result.calibration.attitudes, strict=True)
    ]
    factors, probabilities = held_out(exposures, result.calibration, replace(night, pixel_sd=0.1))
    found = result.calibration
    total = found.mean_error**2 * found.degrees_of_freedom
    for number, factor in enumerate(factors):
        others = [e for k, e in enumerate(exposures) if k != number]
        without = calibrate_exposures(
            others, found.camera, night.site, night.catalogue, pixel_sd=0.1, earth=night.earth
        )
        left = without.mean_error**2 * without.degrees_of_freedom
        rank = found.degrees_of_freedom - without.degrees_of_freedom
        expected = np.sqrt((total - left) / rank) / without.mean_error
        assert factor == pytest.approx(expected, rel=1e-4)
        assert factor < NOTABLE or probabilities[number] > LEVEL / 5


def test_an_exposure_of_wrong_names_is_taken_out(night, result):
    """Every image is called the star of its neighbour in brightness: nothing but the comparison can tell."""
    named = [replace(e, stars=s.stars) for e, s in zip(night.exposures, result.exposures, strict=True)]
    wrong = np.where(named[0].stars >= 0, np.roll(named[0].stars, 7), -1)
    spoilt = calibrate_night(replace(night, exposures=[replace(named[0], stars=wrong), *named[1:]]))
    assert spoilt.names == ("2", "3", "4", "5")
    assert has_code(spoilt.messages[0], "stars.rejected", name="1")
    assert spoilt.usable
    assert spoilt.calibration.mean_error == pytest.approx(1.0, abs=0.1)


def test_a_catalogue_three_magnitudes_deeper_gives_the_same_camera(night, result):
    deep = replace(night, catalogue=Catalogue.hipparcos().brighter(9.0), tolerance=8.0)
    again = calibrate_night(deep)
    assert again.names == night.names
    errors = np.sqrt(np.diag(result.camera.covariance))
    assert np.abs((again.camera.values - result.camera.values) / errors).max() < 1
    assert again.calibration.mean_error == pytest.approx(result.calibration.mean_error, abs=0.05)


def test_attitudes_eight_degrees_wrong_are_found(night):
    generator = np.random.default_rng(3)
    turn = [np.append(np.radians(4 * generator.uniform(-1, 1, 2)), 0.05) for _ in night.exposures]
    exposures = [replace(e, attitude=e.attitude + t) for e, t in zip(night.exposures, turn, strict=True)]
    result = calibrate_night(replace(night, exposures=exposures, attitude_error=np.radians(8.0)))
    assert result.usable
    assert result.calibration.mean_error == pytest.approx(1.0, abs=0.1)


def test_the_failed_global_test_comes_first_and_the_camera_is_not_usable(folder):
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("sd_px = 0.1", "sd_px = 0.01"))
    run = CliRunner().invoke(app, ["stellar-camera", "exposures", str(file), "--out", str(folder / "out")])
    assert run.exit_code == 4
    text = (folder / "out" / "report.txt").read_text()
    assert "Weights too optimistic: standard deviations are too small by about 10.2" in text
    remarks = " ".join(text.split("Remarks\n-------\n")[1].split())
    assert remarks.startswith("the global test fails: residuals are 10.2 times larger")
    assert "do not use this camera" in remarks
    assert "sd_px is too small" in remarks


def test_a_fisheye_under_the_terms_of_brown_is_not_usable(night):
    """An equidistant lens of more than 100 degrees, its stars named."""
    camera = SkyCamera.of_field(*night.frame, np.radians(130))
    exposures = []
    for given in night.exposures[:3]:
        bright = night.catalogue.brighter(5.0)
        standard = night.site.standard_coordinates(
            apparent_places(bright, given.utc), sidereal_time(night.site, given.utc, night.earth.dut1)
        )
        seen = _photocore.plate_images(standard, given.attitude, _unit(), (1.0, True, False))
        radius = np.linalg.norm(seen, axis=1, keepdims=True)
        xy = camera.values[2:4] + camera.values[0] * seen * np.arctan(radius) / radius
        with np.errstate(invalid="ignore"):
            inside = np.flatnonzero(((xy > 0) & (xy < night.frame)).all(axis=1) & (radius[:, 0] < 2.2))
        exposures.append(replace(given, xy=xy[inside], stars=inside))
    result = calibrate_night(replace(night, exposures=exposures, names=("1", "2", "3"), camera=camera))
    assert not result.usable
    assert result.messages[0].code in ("stars.residuals", "stars.do-not-use")


def _unit():
    """Return the interior of an ideal camera of principal distance 1."""
    interior = np.zeros(13)
    interior[3:5] = 1.0
    return interior


def test_a_star_that_is_named_is_used_though_it_is_too_faint(folder, result):
    ids, lines = result.night.catalogue.ids, ["exposure,x_px,y_px,star"]
    for name, exposure in zip(result.names, result.exposures, strict=True):
        lines += [
            f"{name},{x:.3f},{y:.3f},{ids[star] if star >= 0 else ''}"
            for (x, y), star in zip(exposure.xy, exposure.stars, strict=True)
        ]
    (folder / "images.csv").write_text("\n".join(lines))
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("faintest = 6.0", "faintest = 4.0"))
    night = read_night(file)
    assert night.catalogue.magnitudes.max() > 5.5
    again = calibrate_night(night)
    errors = np.sqrt(np.diag(result.camera.covariance))
    assert np.abs((again.camera.values - result.camera.values) / errors).max() < 1e-2
