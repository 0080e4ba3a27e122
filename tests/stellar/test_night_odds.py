"""Odds of exposures and stars in the result, doubtful exposures, and what a night may leave unknown."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from nights import MAKER
from typer.testing import CliRunner

from example_scripts import load
from message_codes import coded, fields_of, has_code
from photogram import InputError
from photogram.cli import app
from photogram.stellar import Catalogue, Exposure, calibrate_night, read_night
from photogram.stellar.comparison import fewer_stars
from photogram.stellar.identification import LOG_ODDS, binomial_tail, log_odds, star_probabilities

allsky = load("all_sky_camera")
TRUTH = MAKER["CAMERA"].values


def test_every_exposure_and_every_star_has_its_probability(result):
    assert (result.odds < 1e-6).all()
    assert (result.log_odds > LOG_ODDS).all()
    assert result.falsely_identified == pytest.approx(result.odds.sum())
    assert (result.probabilities == 1 / (1 + result.odds)).all()
    assert len(result.star_probabilities) == len(result.calibration.xy)
    assert (result.star_probabilities >= 0.95).all()
    document = json.loads(result.to_json())
    assert document["images"][3]["probability"] == result.star_probabilities[3]
    first = document["exposures"][0]
    assert (first["probability"], first["log_odds"]) == (result.probabilities[0], result.log_odds[0])
    quaternions = result.inertial.values("quaternion_to_vision")
    assert first["icrs"]["quaternion"] == quaternions[0].tolist()
    text = result.report().split("Identification and fit\n")[1]
    assert f"{result.log_odds[0]:.1f}" in text
    table = result.document().table("exposures").frame()
    assert table["by_chance"].tolist() == result.odds.tolist()
    assert table[["qw", "qx", "qy", "qz"]].iloc[2].tolist() == quaternions[2].tolist()
    assert table["cov_xy"][1] == -result.inertial.step_covariances[1, 0, 1]
    images = result.document().table("images").frame()
    assert images["probability"].tolist() == result.star_probabilities.tolist()
    assert images["residual_x_px"].tolist() == result.calibration.residuals[:, 0].tolist()


def test_the_probability_of_a_star_by_hand():
    """Off by 0.1 and 0.3 with the standard deviation 0.1, another star at 0.4, and one alone."""
    images, stars = np.array([[0.0, 0.0], [50.0, 50.0]]), np.array([[0.1, 0.0], [-0.4, 0.0], [50.0, 50.3]])
    found = star_probabilities(images, stars, np.array([0, 2]), 0.1, 1e-4)

    def density(off):
        return math.exp(-0.5 * (off / 0.1) ** 2) / (2 * math.pi * 0.01)

    by_chance = 0.1 / 0.9 * 1e-4
    expected = density(0.1) / (density(0.1) + density(0.4) + by_chance)
    assert found[0] == pytest.approx(expected, rel=1e-12)
    assert found[1] == pytest.approx(density(0.3) / (density(0.3) + by_chance), rel=1e-12)
    assert np.isnan(star_probabilities(images, stars, np.array([-1, -1]), 0.1, 1e-4)).all()


def test_log_odds_by_hand():
    one = math.log(0.75 / (2 * math.pi * 0.01) / 1e-4 + 0.25)
    assert log_odds(np.zeros(3), 5, 0.1, 1e-4) == pytest.approx(3 * one + 2 * math.log(0.25), rel=1e-12)


def test_a_binomial_tail():
    assert binomial_tail(4, 0.5, 3) == pytest.approx(5 / 16)
    assert (binomial_tail(4, 1.0, 4), binomial_tail(4, 0.3, 0), binomial_tail(4, 0.3, 5)) == (1.0, 1.0, 0.0)


def test_exposures_with_few_stars_are_named():
    """Half of the share of the others, beyond chance; a few images prove nothing."""
    assert fewer_stars(np.array([100, 100, 100, 100]), np.array([90, 88, 30, 91])) == [2]
    assert fewer_stars(np.array([100, 100, 100]), np.array([90, 88, 60])) == []
    assert fewer_stars(np.array([100, 100, 3]), np.array([90, 88, 1])) == []
    assert fewer_stars(np.array([100]), np.array([10])) == []


def test_two_stars_in_the_tolerance_of_an_image_wait_for_the_camera(night, result):
    """A second star a pixel beside each: no image is taken for it; those between the two are left out."""
    catalogue, f = night.catalogue, TRUTH[0]
    beside = catalogue.places + np.array([0.0, 1.0 / f])
    count = len(catalogue.ids)
    twins = Catalogue(
        ids=(*catalogue.ids, *(f"twin {name}" for name in catalogue.ids)),
        places=np.vstack([catalogue.places, beside]),
        proper_motions=np.vstack([catalogue.proper_motions] * 2),
        parallaxes=np.concatenate([catalogue.parallaxes] * 2),
        magnitudes=np.concatenate([catalogue.magnitudes, catalogue.magnitudes + 3]),
        epoch=catalogue.epoch,
    )
    again = calibrate_night(replace(night, catalogue=twins, camera=result.camera))
    assert again.usable
    assert (again.calibration.stars < count).all()
    assert (again.star_probabilities >= 0.95).all()
    off = (again.camera.values - TRUTH) / np.sqrt(np.diag(again.camera.covariance))
    assert np.abs(off).max() < 4


@pytest.fixture(scope="module")
def doubtful(night):
    """Return the night with an exposure of which a few true images are left among many false ones."""
    generator = np.random.default_rng(4)
    for few in range(5, 20):
        given = night.exposures[0]
        xy = np.vstack([given.xy[:few], generator.uniform((0, 0), night.frame, (15, 2))])
        spoilt = replace(night, exposures=[replace(given, xy=xy), *night.exposures[1:]])
        result = calibrate_night(spoilt)
        if result.doubtful:
            return spoilt, result
    raise AssertionError("no exposure is doubtful")


def test_a_doubtful_exposure_is_named_and_the_result_is_not_usable(doubtful):
    night, result = doubtful
    assert list(result.doubtful) == ["1"]
    assert 1e-6 <= result.doubtful["1"] <= 1e-2
    assert not result.usable
    assert (result.verdict.code, result.verdict.exit) == ("identification", 4)
    assert "The identification of stars is doubtful: exposure 1" in result.report()
    assert fields_of(result.messages, "stars.doubtful")["name"] == "1"
    assert json.loads(result.to_json())["doubtful"] == result.doubtful
    # Its user says that it is right.
    confirmed = calibrate_night(replace(night, confirmed=("1",)))
    assert confirmed.names == ("1", "2", "3", "4", "5")
    assert confirmed.usable
    with pytest.raises(InputError, check=coded("error.at", what="confirmed", message="error.unknown")):
        replace(night, confirmed=("nine",))


def test_a_camera_turned_by_any_angle_and_a_field_of_view_a_tenth_wrong(night, result):
    generator = np.random.default_rng(6)
    turned = [
        replace(e, attitude=e.attitude + np.array([0, 0, generator.uniform(-np.pi, np.pi)]))
        for e in night.exposures
    ]
    wrong = type(night.camera).of_field(*night.frame, np.radians(36.9 * 1.09))
    again = calibrate_night(
        replace(night, exposures=turned, camera=wrong, roll_known=False, field_error=0.12)
    )
    assert again.names == night.names
    assert again.camera.values == pytest.approx(result.camera.values, rel=1e-6)
    with pytest.raises(InputError, check=coded("error.range", low=0, high=0.5, value=0.7)):
        replace(night, field_error=0.7)


def test_a_camera_that_stood_still_and_one_that_did_not():
    """Three exposures of one attitude; then the third is turned by a minute of arc."""
    night, _ = allsky.night("equisolid", 3, tripod=True)
    result = calibrate_night(night)
    assert result.standstill.probability > 0.01
    assert result.standstill.moved == ()
    assert result.standstill.dimension == 6
    generator = np.random.default_rng(9)
    attitude, allsky.ATTITUDE = allsky.ATTITUDE, allsky.ATTITUDE + np.array([0.0, 3e-4, 0.0])
    try:
        other, _, _ = allsky.exposures("equisolid", generator)
    finally:
        allsky.ATTITUDE = attitude
    moved = calibrate_night(replace(night, exposures=[*night.exposures[:2], other[2]]))
    assert moved.standstill.moved == (2,)
    assert moved.standstill.turns[2] == pytest.approx(3e-4, rel=0.15)
    assert fields_of(moved.messages, "stars.moved")["name"] == "2"
    assert json.loads(moved.to_json())["standstill"]["moved"] == ["2"]


def test_standstill_holds_its_level():
    """Chi-squared of 6 over thirty nights."""
    values = [calibrate_night(allsky.night("equidistant", seed, tripod=True)[0]) for seed in range(20, 32)]
    mean = np.mean([result.standstill.statistic for result in values])
    assert mean == pytest.approx(6.0, abs=3 * np.sqrt(12 / len(values)))


def test_a_file_with_all_of_this(folder):
    file = folder / "night.toml"
    text = file.read_text().replace(
        "[matching]", '[matching]\nroll_known = false\nfield_of_view_error = 0.1\nconfirmed = ["2"]'
    )
    if "[matching]" not in text:
        text += '\n[matching]\nroll_known = false\nfield_of_view_error = 0.1\nconfirmed = ["2"]\n'
    text = text.replace("[camera]", '[camera]\nlens = "auto"\ncommon_scale = true\ntripod = true')
    text = text.replace("[station]", "[places]\nlight_deflection = false\nrefraction = false\n\n[station]")
    file.write_text(text)
    night = read_night(file)
    assert (night.roll_known, night.field_error, night.confirmed) == (False, 0.1, ("2",))
    assert (night.common_scale, night.tripod) == (True, True)
    assert night.lenses == ("brown", "equidistant", "equisolid", "stereographic", "kannala_brandt")
    assert night.site.effects.left_out == ("light deflection", "refraction")
    file.write_text(text.replace('lens = "auto"', 'lens = "fish"'))
    with pytest.raises(InputError, check=coded("error.key", key="lens", message="error.choice")):
        read_night(file)


def test_the_command_writes_tables_and_yaml(folder):
    out = folder / "out"
    run = CliRunner().invoke(
        app, ["stellar-camera", "exposures", str(folder / "night.toml"), "--out", str(out), "--quiet"]
    )
    assert run.exit_code == 0, run.output
    assert {path.name for path in out.iterdir()} == {
        "report.html",
        "report.txt",
        "camera.json",
        "camera.yaml",
        "camera-ros.yaml",
        "exposures.csv",
        "star-images.csv",
    }
    assert (
        (out / "exposures.csv").read_text().startswith("exposure,utc,images,identified,left_out,by_chance,")
    )


def test_stars_found_in_the_whole_sky(night, result):
    """Neither attitudes nor the field of view, and an exposure of nothing."""
    pytest.importorskip("tetra3rs")
    generator = np.random.default_rng(2)
    nothing = Exposure("2024-03-01T22:00:00", generator.uniform((0, 0), night.frame, (60, 2)), np.zeros(3))
    exposures = [*(replace(e, attitude=np.zeros(3)) for e in night.exposures), nothing]
    blind = replace(
        night,
        exposures=exposures,
        names=(*night.names, "nothing"),
        blind=(np.radians(25), np.radians(50)),
    )
    found = calibrate_night(blind)
    assert found.names == night.names
    assert found.usable
    assert found.camera.values == pytest.approx(result.camera.values, rel=1e-6)
    assert has_code(found.messages[0], "stars.rejected", name="nothing", reason="stars.nowhere")
    mirrored = [replace(e, xy=e.xy * [-1, 1] + [night.frame[0], 0]) for e in exposures[:2]]
    with pytest.raises(InputError, check=coded("stars.mirrored")):
        calibrate_night(replace(blind, exposures=mirrored, names=("1", "2")))
    with pytest.raises(InputError, check=coded("stars.blind-fields")):
        calibrate_night(replace(blind, blind=(np.radians(0.1), np.radians(50))))
