"""The card deck, its messages, the plain form, and the command line."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from star_decks import cards, put
from typer.testing import CliRunner

from message_codes import coded
from photogram import InputError
from photogram.cli import app
from photogram.stellar import calibrate, read_deck, read_plain

EXAMPLE = Path(str(files("photogram") / "examples" / "stellar" / "plate.toml"))


@pytest.fixture(scope="module")
def example():
    return read_plain(EXAMPLE)


@pytest.fixture
def read(tmp_path):
    def read(lines):
        (tmp_path / "deck").write_text("\n".join(lines) + "\n")
        return read_deck(tmp_path / "deck")

    return read


def test_deck_and_plain_form_agree(example, read):
    (problem,) = read(cards(example))
    assert problem.image_xy == pytest.approx(example.image_xy, abs=1e-9)
    assert (problem.image_groups == example.image_groups).all()
    assert problem.initial[6:22] == pytest.approx(example.initial[6:22], rel=1e-6)
    assert problem.options.movement_factor == 3.0
    assert problem.site.longitude_west == pytest.approx(np.radians(80))
    started = problem.initial.copy()
    started[:6] = example.initial[:6]
    found = calibrate(type(problem)(**{**problem.__dict__, "initial": started}))
    expected = calibrate(example)
    errors = np.sqrt(np.diag(expected.covariance)[:22])
    assert np.abs((found.solved.parameters - expected.solved.parameters)[:22] / errors).max() < 0.02


def test_options_without_blanks(example, read):
    packed = "00110" + " 0" + "010" + " 0" + "0" + " 0" + " 9" + "3.00000000E-06"
    options = read(cards(example, options=packed))[0].options
    assert options.mean_error == 3e-6
    assert options.curves
    assert (options.max_iterations_minimum, options.max_iterations) == (0, 9)


@pytest.mark.parametrize(
    ("change", "message", "number"),
    [
        (
            lambda d: d.__setitem__(17, d[17].replace("     1 ", "     9 ", 1)),
            coded("stars.error-1", star="1"),
            18,
        ),
        (lambda d: d.__setitem__(3, "X" + d[3][1:]), coded("error.columns"), 4),
        (lambda d: d.__setitem__(14, "-" + d[14][1:]), coded("stars.indefinite-card"), 15),
        (lambda d: d.__delitem__(slice(30, None)), coded("stars.deck-ends"), 31),
        (lambda d: d.__setitem__(2, "0 0 1 1 0 0 0 1 0 x 0 0 0 0.0"), coded("error.at", what="options"), 3),
    ],
)
def test_bad_decks_name_the_card(example, read, change, message, number):
    deck = cards(example)
    star = next(i for i, card in enumerate(deck[17:], 17) if card[60:66].strip() == "1")
    assert star == 17
    change(deck)
    with pytest.raises(InputError, check=message) as raised:
        read(deck)
    assert raised.value.record == number


def test_a_rejected_star_that_is_not_there(example, read):
    deck = cards(example)
    deck[2] = deck[2].ljust(76) + "1"
    deck.insert(16, put((1, "  9999"), (18, "1")))
    with pytest.raises(InputError, check=coded("stars.rejected-star", names=["9999"])):
        read(deck)
    deck[16] = put((1, "     2"), (18, "1"))
    assert len(read(deck)[0].star_ids) == 74


def test_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(app, ["stellar-camera", "--example", "--json", "r.json", "--plots"])
    assert run.exit_code == 0, run.output
    document = json.loads((tmp_path / "r.json").read_text())
    assert document["degrees_of_freedom"] == 728
    assert len(document["parameters"]) == 22
    assert document["covariance"]["order"] == list(document["parameters"])
    assert {"point", "star", "residual_um", "redundancy", "standardized"} <= set(document["images"][0])
    redundancy = sum(sum(image["redundancy"]) for image in document["images"])
    redundancy += sum(sum(star["redundancy"]) for star in document["stars"])
    assert redundancy == pytest.approx(728, abs=1e-6)
    written = {path.name for path in (tmp_path / "plate-calibrated").iterdir()}
    assert {"listing.txt", "camera.json", "residuals.png", "tests.png", "distortion.png"} <= written
    missing = CliRunner().invoke(app, ["stellar-camera", "nowhere"])
    assert missing.exit_code == 1
