"""Options of `photogram stellar-camera exposures`: they count instead of the file, and are reported."""

import json
import re
from dataclasses import fields
from typing import get_args

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import coded
from photogram import InputError
from photogram.cli import app
from photogram.cli.stellar_camera import Effect, Lens
from photogram.stellar import LENSES, Effects, read_night
from photogram.stellar.night_file import AUTO


def run(folder, *said):
    """Run the command on the example; return its report and its document."""
    out, document = folder / "out", folder / "r.json"
    given = ["stellar-camera", "exposures", str(folder / "night.toml"), "--out", str(out), "--no-html"]
    done = CliRunner().invoke(app, [*given, "--json", str(document), "--quiet", *said])
    assert done.exit_code == 0, done.output
    return (out / "report.txt").read_text(), json.loads(document.read_text())


def line(text, name):
    """Return what the report says of something."""
    return next(each[36:] for each in text.splitlines() if each.startswith(f"{name:<36}"))


def test_the_words_of_the_options_are_those_of_the_package():
    assert {*get_args(Lens)} == {*LENSES, AUTO}
    assert {effect.replace("-", "_") for effect in get_args(Effect)} == {one.name for one in fields(Effects)}


def test_one_principal_distance(folder):
    text, document = run(folder, "--common-scale")
    assert line(text, "lens") == "brown (fx = fy)"
    assert document["lens"]["scale_test"]["verdict"] == "needed"
    assert document["lens"]["common_scale"] is True
    values = {name: each["value"] for name, each in document["parameters"].items()}
    assert values["fx"] == values["fy"]


def test_two_principal_distances_where_the_file_has_one(folder):
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("[camera]", "[camera]\ncommon_scale = true"))
    text, document = run(folder, "--two-scales")
    assert line(text, "lens") == "brown"
    assert document["lens"]["common_scale"] is False


@pytest.mark.parametrize("effect", get_args(Effect))
def test_effects_are_left_out_of_places(folder, effect):
    night = read_night(folder / "night.toml", {"places": {effect.replace("-", "_"): False}})
    named = effect.replace("-", " ")
    assert night.site.effects.left_out == (named,)
    text, document = run(folder, "--without", effect)
    assert line(text, "effects left out of places") == named
    assert document["effects"][effect.replace("-", "_")] is False


def test_a_failed_test_names_the_effects_that_are_left_out(folder):
    text, document = run(folder, "--without", "refraction", "--without", "annual-aberration")
    assert line(text, "effects left out of places") == "annual aberration, refraction"
    assert any("annual aberration, refraction" in message for message in document["messages"])


def test_the_lens_is_chosen(folder):
    text, document = run(folder, "--lens", "auto")
    assert line(text, "lens") == "brown"
    assert "Lenses that were tried" in text
    assert len(document["lens"]["tried"]) == len(LENSES)


def test_neither_attitudes_nor_field_of_view(folder):
    pytest.importorskip("tetra3rs")
    usual, _ = run(folder)
    assert line(usual, "first attitudes") == "given within 1 degrees"
    file = folder / "night.toml"
    keys = ("azimuth", "elevation_deg", "roll", "field_of_view")
    kept = [each for each in file.read_text().splitlines() if not each.startswith(keys)]
    file.write_text("\n".join(kept))
    text, _ = run(folder, "--blind", "25", "50")
    assert "in the whole sky, with a field of view between 25 and 50 degrees" in line(text, "first attitudes")
    assert line(text, "exposures").startswith("5 (of 5; ")


def test_longitude_to_the_east_azimuth_from_north_and_hectopascals(folder):
    file = folder / "night.toml"
    text, before = file.read_text(), read_night(file)
    for old, factor, new in (
        ("longitude_west_deg", lambda each: -each, "longitude_east_deg"),
        ("pressure_mmHg", lambda each: each * 1013.25 / 760.0, "pressure_hPa"),
        ("azimuth_deg", lambda each: (each + 180.0) % 360.0, "azimuth_north_deg"),
    ):
        said = re.compile(rf"^{old} = (\S+)", re.MULTILINE)
        assert said.search(text)
        text = said.sub(lambda found, f=factor, n=new: f"{n} = {f(float(found[1]))!r}", text)
    file.write_text(text)
    after = read_night(file)
    assert after.site.longitude_west == pytest.approx(before.site.longitude_west, rel=1e-15)
    assert after.site.air.pressure == pytest.approx(before.site.air.pressure, rel=1e-14)
    for one, other in zip(before.exposures, after.exposures, strict=True):
        turns = (np.exp(1j * each.attitude) for each in (one, other))
        np.testing.assert_allclose(*turns, rtol=0, atol=1e-12)
    file.write_text(text.replace("longitude_east_deg", "longitude_west_deg = 8.0\nlongitude_east_deg"))
    with pytest.raises(InputError, check=coded("error.key", key="longitude_east_deg")):
        read_night(file)


def test_rolls_that_are_not_to_be_relied_on(folder):
    file = folder / "night.toml"
    file.write_text(file.read_text().replace("roll_deg = 91.0", "roll_deg = 0.0"))
    text, _ = run(folder, "--any-roll")
    assert line(text, "first attitudes") == "given within 1 degrees, but for the roll"
    assert line(text, "exposures").startswith("5 (of 5; ")


def test_every_image_has_its_probability_in_the_report(result):
    own = result.report().split("Images and their stars\n")[1]
    rows = [each.split() for each in own.splitlines()[4:] if each.strip()]
    assert len(rows) == len(result.calibration.xy)
    names = np.array(result.night.catalogue.ids)[result.calibration.stars]
    assert [row[1] for row in rows] == list(names)
    for row, probability in zip(rows, result.star_probabilities, strict=True):
        assert 1 - float(row[-1]) == pytest.approx(probability, abs=1e-6 + 0.5 * (1 - probability))


def test_values_besides_the_file_are_checked_as_those_in_it(folder):
    with pytest.raises(InputError, check=coded("error.key", table="matching", key="roll_known")):
        read_night(folder / "night.toml", {"matching": {"roll_known": "no"}})
    with pytest.raises(
        InputError, check=coded("error.key", table="camera", key="lens", message="error.choice")
    ):
        read_night(folder / "night.toml", {"camera": {"lens": "fish"}})
    with pytest.raises(InputError, check=coded("error.unknown", kind="key", name="wind")):
        read_night(folder / "night.toml", {"places": {"wind": False}})
