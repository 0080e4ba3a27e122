"""Nights as users get them wrong: one message that names the file and what to do, and nothing written."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram.cli import app
from photogram.stellar import Catalogue, attitude_of, calibrate_night, read_night
from photogram.stellar.hints import _HOUR
from photogram.stellar.pointing import turn_between

AROUND = "no exposure shows stars of the catalogue where its attitude says they are; "


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


def refused(folder, *said):
    """Run the command; return the message of its error."""
    before = {path.name for path in folder.iterdir()}
    given = ["stellar-camera", "exposures", str(folder / "night.toml"), "--out", str(folder / "out")]
    done = CliRunner().invoke(app, [*given, "--json", str(folder / "r.json"), *said])
    assert done.exit_code == 1, done.output
    assert {path.name for path in folder.iterdir()} == before
    assert "Traceback" not in done.output
    (line,) = (each for each in done.output.splitlines() if each.startswith("error:"))
    return line


def test_a_catalogue_of_the_wrong_sky(folder):
    catalogue(folder, lambda dec: dec < -45)
    error = refused(folder)
    assert f"night.toml: {AROUND}none of the mistakes that are often made explains it" in error
    assert "compare attitudes, attitude_error_deg and field of view with the exposures, and the cat" in error
    assert "exposure 1: the catalogue has 0 stars in its field, of the 3 that are needed" in error


def test_clouds(folder):
    generator = np.random.default_rng(3)

    def false(exposure, _x, _y, magnitude):
        return exposure, *generator.uniform((0, 0), (6000, 4000)).round(3), magnitude

    images(folder, false)
    error = refused(folder)
    assert f"night.toml: {AROUND}none of the mistakes" in error
    assert re.search(r"exposure 1: only \d of 75 images have a star; chance finds as many", error)


def test_no_images(folder):
    images(folder, lambda exposure, *rest: None if exposure == "3" else (exposure, *rest))
    result = calibrate_night(read_night(folder / "night.toml"))
    assert "exposure 3 is left out: it has 0 images of the 3 that are needed" in map(str, result.messages)
    images(folder, lambda *_: None)
    assert "exposure 1: it has 0 images of the 3 that are needed" in refused(folder)


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("T20:", "T21:", "utc has to be changed by -1 h: it is the time of a clock, not UTC"),
        ("T20:", "T22:", "utc has to be changed by -2 h: it is the time of a clock, not UTC"),
        ("latitude_deg = 47", "latitude_deg = -47", "the latitude has the other sign"),
    ],
)
def test_time_and_place(folder, old, new, hint):
    spoil(folder, old, new)
    error = refused(folder)
    assert re.search(f"night.toml: {AROUND}as it seems, {hint}: stars of exposures 1, 2, 5 are found", error)


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("_west_deg = -8", "_west_deg = 8", "the longitude counts to the east, not to the west"),
        ("T20:", "T19:", r"utc has to be changed by \+1 h: it is the time of a clock, not UTC"),
    ],
)
def test_time_and_place_where_one_exposure_is_found_all_the_same(folder, old, new, hint):
    """It looks near the pole of the sky; one of five is not enough."""
    spoil(folder, old, new)
    result = calibrate_night(read_night(folder / "night.toml"))
    texts = [str(message) for message in result.messages]
    assert not result.usable
    assert result.names == ("3",)
    assert any(re.match(f"as it seems, {hint}: stars of exposures 1, 2, 5 are", text) for text in texts)
    assert any(re.match(r"exposure 3: its stars are up to \d\.\d degrees from where", text) for text in texts)


def test_one_time_that_is_an_hour_late(folder):
    """The exposure near the pole of the sky is found; that its attitude is not as said is a problem."""
    spoil(folder, "T20:19:00.25", "T21:19:00.25")
    night = read_night(folder / "night.toml")
    result = calibrate_night(night)
    assert result.names == night.names
    (text,) = (str(each) for each in result.messages if "attitude says" in str(each))
    assert text.startswith(
        "exposure 3: its stars are up to 7.5 degrees from where its attitude says, which is"
    )
    assert text.endswith("said to be wrong by 1: look at its time, its angles and the station")
    assert not any("as it seems" in str(each) for each in result.messages), "it is found without a hint"


def test_mirrored_images_found_nowhere(folder):
    pytest.importorskip("tetra3rs")
    images(folder, lambda exposure, x, *rest: (exposure, 6000 - float(x), *rest))
    error = refused(folder, "--blind", "25", "50")
    assert "night.toml: no exposure is found in the sky: its images are mirrored (x counts right" in error


def test_millimetres(folder, result):
    document = json.loads(result.camera.to_json())
    for name in ("fx", "fy", "cx", "cy"):
        document["parameters"][name] /= 250
    (folder / "camera.json").write_text(json.dumps(document))
    for key in ("start", "prior"):
        spoil(folder, "(field_of_view_deg|start) = .*", f'{key} = "camera.json"')
        error = refused(folder)
        assert "camera.json: fx is 36.0481 pixels, and the frame is 6000 x 4000 pixels: no lens sees" in error
        assert error.endswith("the principal distance may be in millimetres")


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
