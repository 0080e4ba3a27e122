"""The card deck, its messages, the plain form, and the command line."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram import InputError
from photogram.cli import app
from photogram.stellar import calibrate
from photogram.stellar.deck import read_deck
from photogram.stellar.parameters import GRAD
from photogram.stellar.plain import read_plain

EXAMPLE = Path(str(files("photogram") / "examples" / "stellar" / "plate.toml"))


def put(*fields):
    """Make a card of fields that start at given columns."""
    card = ""
    for column, text in fields:
        card = card.ljust(column - 1) + str(text)
        assert len(card) <= 80
    return card


def e(value, width=14, decimals=8):
    return f"{value:{width}.{decimals}E}" if value else "0".rjust(width)


def cards(problem, options="0 0 1 1 0 0 0 1 0 0 0 0 0 0.0"):
    """Write the example as a deck: all groups begin at the event's attitude, as the deck has it."""
    p = problem.initial
    values = [*(p[6:9] / GRAD), p[9] / GRAD, *p[10:21], p[21] / GRAD, 0.0, 0.0]
    deck = [
        put((1, "7"), (7, "18 JULY 1967"), (80, "1")),
        "A PLATE",
        options,
        "".join(e(v, 10, 3) for v in (1e-10, 1e-6, 293.0, 760.0, 0.065, 0.005, 0.1, 1e-12)),
        put((1, "E1"), (7, "19 JULY 1967")),
        put((1, "P1"), (26, " 1.50000000"), (37, "  0  0  0.0000")),
        put((1, "MANN"), (9, "N.N."), (64, "    3.00"), (72, "500900")),
        put((1, "1"), (7, "SOMEWHERE"), (36, " 30"), (40, " 0"), (43, " 0.0000"), (53, " 80"), (57, " 0")),
    ]
    deck += ["".join(f" {v:14.7E}" for v in values[i : i + 3]) for i in range(0, 18, 3)]
    deck += [
        "".join(e(v, 12, 5) for v in (9.57266, 9.57266, 0.0)),
        "".join(e(v, 12, 5) for v in (1.0, 1.0, 0.0)),
    ]
    for i, star in enumerate(problem.star_ids):
        images = np.flatnonzero(problem.image_stars == i)
        ra, dec = problem.star_places[i]
        deck.append(
            put((1, f"{ra:14.11f}"), (15, f"{dec:14.11f}"), (61, f"{star:>6}"), (69, f"{len(images):3}"))
        )
        for k in images:
            x, y = problem.image_xy[k]
            last = "1" if k == len(problem.image_points) - 1 else "0"
            point, time = problem.image_points[k], problem.image_times[k]
            deck.append(
                put(
                    (1, f"{x:12.8f}"),
                    (13, f"{y:12.8f}"),
                    (55, f"{point:>6}{star:>6}{time:11.8f}"),
                    (80, last),
                )
            )
    return deck


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
            "ERROR 1: star numbers disagree",
            18,
        ),
        (lambda d: d.__setitem__(3, "X" + d[3][1:]), "is not a number", 4),
        (lambda d: d.__setitem__(14, "-" + d[14][1:]), "is not positive definite", 15),
        (lambda d: d.__delitem__(slice(30, None)), "the deck ends where", 31),
        (lambda d: d.__setitem__(2, "0 0 1 1 0 0 0 1 0 x 0 0 0 0.0"), "options", 3),
    ],
)
def test_bad_decks_name_the_card(example, read, change, message, number):
    deck = cards(example)
    star = next(i for i, card in enumerate(deck[17:], 17) if card[60:66].strip() == "1")
    assert star == 17
    change(deck)
    with pytest.raises(InputError, match=message) as raised:
        read(deck)
    assert raised.value.record == number


def test_a_rejected_star_that_is_not_there(example, read):
    deck = cards(example)
    deck[2] = deck[2].ljust(76) + "1"
    deck.insert(16, put((1, "  9999"), (18, "1")))
    with pytest.raises(InputError, match="rejected but not there: 9999"):
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
    assert {"listing.txt", "camera.json", "stars.png", "residuals.png", "distortion.png"} <= written
    missing = CliRunner().invoke(app, ["stellar-camera", "nowhere"])
    assert missing.exit_code == 1
