"""Nights as users get them wrong: one message that names the file and what to do, and nothing written."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import codes, fields_of, has_code
from photogram import InputError
from photogram.cli import app
from photogram.stellar import Catalogue, attitude_of, calibrate_night, read_night
from photogram.stellar.night_run import _HOUR
from photogram.stellar.places import turn_between


def spoil(folder, old, new, count=0):
    file = folder / "night.toml"
    text = re.sub(old, new, file.read_text(), count=count)
    assert text != file.read_text()
    file.write_text(text)


def images(folder, change):
    """Write the table of images anew; `change` takes and returns exposure, x, y, magnitude."""
    head, *rows = (folder / "images.csv").read_text().splitlines()
    changed = [change(*row.split(",")) for row in rows]
    (folder / "images.csv").write_text(
        "\n".join([head, *(",".join(map(str, row)) for row in changed if row)])
    )


def catalogue(folder, chosen):
    """Name a catalogue of some stars of Hipparcos."""
    stars = Catalogue.hipparcos().brighter(6.0)
    rows = [
        f"{stars.ids[k]},{ra},{dec},0,0,0,{stars.magnitudes[k]}"
        for k, (ra, dec) in enumerate(np.degrees(stars.places))
        if chosen(dec)
    ]
    head = "id,ra_deg,dec_deg,pm_ra_mas,pm_dec_mas,parallax_mas,magnitude"
    (folder / "stars.csv").write_text("\n".join([head, *rows]))
    spoil(folder, r"\[catalogue\].*", '[catalogue]\nfile = "stars.csv"')


def refused(folder, *said, **values):
    """Run the command; return its error, which is that of the functions with values of the file."""
    before = {path.name for path in folder.iterdir()}
    given = ["stellar-camera", "exposures", str(folder / "night.toml"), "--out", str(folder / "out")]
    done = CliRunner().invoke(app, [*given, "--json", str(folder / "r.json"), *said])
    assert done.exit_code == 1, done.output
    assert {path.name for path in folder.iterdir()} == before
    assert "Traceback" not in done.output
    (line,) = (each for each in done.output.splitlines() if each.startswith("error:"))
    with pytest.raises(InputError) as raised:
        calibrate_night(read_night(folder / "night.toml", values))
    assert raised.value.message in line
    assert ".toml: " in line or raised.value.file is not None
    return raised.value


def test_a_catalogue_of_the_wrong_sky(folder):
    catalogue(folder, lambda dec: dec < -45)
    error = refused(folder)
    assert has_code(error, "stars.no-exposure", cause="stars.unexplained")
    assert has_code(error, "stars.exposure", name="1", reason="stars.few-stars")
    assert has_code(error, "stars.few-stars", n=0, least=3)


def test_clouds(folder):
    generator = np.random.default_rng(3)

    def false(exposure, _x, _y, magnitude):
        return exposure, *generator.uniform((0, 0), (6000, 4000)).round(3), magnitude

    images(folder, false)
    error = refused(folder)
    assert has_code(error, "stars.no-exposure", cause="stars.unexplained")
    assert has_code(error, "stars.exposure", name="1", reason="stars.by-chance")
    assert has_code(error, "stars.by-chance", images=75)


def test_no_images(folder):
    images(folder, lambda exposure, *rest: None if exposure == "3" else (exposure, *rest))
    result = calibrate_night(read_night(folder / "night.toml"))
    assert fields_of(result.messages, "stars.rejected")["name"] == "3"
    assert fields_of(result.messages, "stars.few-images") == {"n": 0, "least": 3}
    images(folder, lambda *_: None)
    assert has_code(refused(folder), "stars.exposure", name="1", reason="stars.few-images")


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("T20:", "T21:", {"hours": -1}),
        ("T20:", "T22:", {"hours": -2}),
        ("latitude_deg = 47", "latitude_deg = -47", {}),
    ],
)
def test_time_and_place(folder, old, new, hint):
    spoil(folder, old, new)
    error = refused(folder)
    code = "stars.hint.utc" if hint else "stars.hint.latitude-sign"
    assert has_code(error, code, **hint)
    assert has_code(error, "stars.cause", mistake=code, names=("1", "2", "5"))


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("_west_deg = -8", "_west_deg = 8", {}),
        ("T20:", "T19:", {"hours": 1}),
    ],
)
def test_time_and_place_where_one_exposure_is_found_all_the_same(folder, old, new, hint):
    """It looks near the pole of the sky; one of five is not enough."""
    spoil(folder, old, new)
    result = calibrate_night(read_night(folder / "night.toml"))
    assert not result.usable
    assert result.names == ("3",)
    code = "stars.hint.utc" if hint else "stars.hint.longitude-east"
    assert fields_of(result.messages, code).items() >= hint.items()
    assert fields_of(result.messages, "stars.cause")["names"] == ("1", "2", "5")
    assert fields_of(result.messages, "stars.far")["name"] == "3"


def test_one_time_that_is_an_hour_late(folder):
    """The exposure near the pole of the sky is found; that its attitude is not as said is a problem."""
    spoil(folder, "T20:19:00.25", "T21:19:00.25")
    night = read_night(folder / "night.toml")
    result = calibrate_night(night)
    assert result.names == night.names
    assert codes(result.messages).count("stars.far") == 1
    far = fields_of(result.messages, "stars.far")
    assert (far["name"], far["turn"], far["error"]) == ("3", pytest.approx(7.5, abs=0.05), pytest.approx(1.0))
    assert "stars.cause" not in codes(result.messages), "it is found without a hint"


def test_mirrored_images_found_nowhere(folder):
    pytest.importorskip("tetra3rs")
    images(folder, lambda exposure, x, *rest: (exposure, 6000 - float(x), *rest))
    error = refused(folder, "--blind", "25", "50", matching={"blind_field_deg": (25.0, 50.0)})
    assert has_code(error, "stars.not-located")
    assert has_code(error, "stars.mirrored")


def test_millimetres(folder, result):
    document = json.loads(result.camera.to_json())
    for name in ("fx", "fy", "cx", "cy"):
        document["parameters"][name] /= 250
    (folder / "camera.json").write_text(json.dumps(document))
    for key in ("start", "prior"):
        spoil(folder, "(field_of_view_deg|start) = .*", f'{key} = "camera.json"')
        error = refused(folder)
        assert has_code(error, "stars.short-distance", f=pytest.approx(36.0481, abs=5e-5), width=6000.0)


def test_an_hour_is_a_turn_of_the_earth():
    assert np.degrees(_HOUR) == pytest.approx(15.04107, abs=5e-6)


def test_turns_between_attitudes():
    first, second = attitude_of(0.3, 0.9, 0.1), attitude_of(0.3, 0.9, 0.35)
    axis, beside = np.array([[0.0, 0.0, 1.0]]), np.array([[np.sin(0.2), 0.0, np.cos(0.2)]])
    assert turn_between(first, second, axis) == pytest.approx(0, abs=1e-9)
    # A turn by 0.25 on a circle of the radius 0.2: haversines.
    expected = 2 * np.arcsin(np.sin(0.125) * np.sin(0.2))
    assert turn_between(first, second, beside) == pytest.approx(expected)
    assert turn_between(first, attitude_of(0.3, 0.7, 0.1), axis) == pytest.approx(0.2)
    assert turn_between(first, second, np.full((2, 3), np.nan)) == 0.0
