"""What is wrong with a deck is told with the number and the text of the card."""

import numpy as np
import pytest
from star_decks import cards, put
from typer.testing import CliRunner

from message_codes import coded, has_code
from photogram import AdjustmentError, InputError
from photogram.cli import app
from photogram.stellar import calibrate, read_deck

OPTIONS = "0 0 1 1 0 0 0 1 0 0 0 0 0 0.0"
FIRST_STAR = 17
"""Record of the first star's card, after cards 1 to 8, 13 to 18, 20 and 21."""


@pytest.fixture
def deck(plate):
    return cards(plate, OPTIONS)


@pytest.fixture
def refused(tmp_path):
    """Read a deck that cannot be read; return the error."""

    def refused(lines, code, record, **fields):
        file = tmp_path / "deck"
        file.write_text("\n".join(lines) + "\n")
        with pytest.raises(InputError) as raised:
            read_deck(file)
        error = raised.value
        assert has_code(error, code, **fields), error
        assert (error.file, error.record) == (file, record)
        assert lines[record - 1].rstrip() in str(error)

    return refused


def replaced(card, column, text):
    """Return a card with other text from a column on."""
    card = card.ljust(80)
    return card[: column - 1] + text + card[column - 1 + len(text) :]


@pytest.mark.parametrize(
    ("record", "column", "text", "message", "fields"),
    [
        (
            3,
            1,
            "-1 0 1 1 0 0 0 1 0 0 0 0 0 0.0",
            "error.at",
            {"what": "options", "message": "error.not-negative"},
        ),
        (3, 1, "x", "error.at", {"what": "options"}),
        (4, 1, "     X    ", "error.columns", {"first": 1, "last": 10}),
        (4, 21, "   -1.E+00", "stars.temperature", {"value": -1.0}),
        (4, 31, "   -1.E+00", "stars.pressure", {"value": -1.0}),
        (6, 37, " h ", "error.columns", {"first": 37, "last": 39}),
        (7, 64, "    MANY", "error.number", {"value": "MANY"}),
        (7, 72, "5X0", "error.columns", {"first": 72, "last": 74}),
        (8, 36, "091", "error.at", {"what": "latitude", "message": "error.most"}),
        (14, 2, " 3.0.0        ", "error.columns", {"first": 2, "last": 15}),
        (15, 1, "-", "stars.indefinite-card", {}),
        (16, 25, " 2.00000E+00", "stars.indefinite-card", {}),
        (17, 69, "  0", "stars.no-images", {"star": "1"}),
        (18, 61, "     9", "stars.error-1", {"star": "1"}),
        (19, 80, "1", "stars.early-flag", {"star": "1", "images": 5}),
        (23, 61, "     1", "error.repeated", {"kind": "star", "name": "1"}),
        (24, 1, "      0.0X  ", "error.columns", {"first": 1, "last": 12}),
    ],
)
def test_a_bad_card(deck, refused, record, column, text, message, fields):
    deck[record - 1] = replaced(deck[record - 1], column, text)
    refused(deck, message, record, **fields)


def test_principal_distances_that_are_not_positive(deck, refused):
    """Cards 13 to 18 are the ninth to the fourteenth here; the last of them is named."""
    deck[10] = replaced(deck[10], 2, " 0.0000000E+00")
    refused(deck, "error.positive", 14, value=0.0)


def individual(deck):
    """Give every star and image weights of their own: no cards 20 and 21."""
    deck[2] = OPTIONS.replace("0 0 1 1", "0 0 0 0", 1)
    del deck[14:16]
    for i in range(14, len(deck)):
        star = len(deck[i]) < 80
        deck[i] = replaced(deck[i], 29 if star else 25, f"{9.57 if star else 1.0:10.4f}" * 2)
    return deck


@pytest.mark.parametrize(("record", "column"), [(15, 49), (16, 45)])
def test_weights_of_a_star_and_of_an_image(deck, refused, record, column):
    deck = individual(deck)
    deck[record - 1] = replaced(deck[record - 1], column, "   20.0000")
    refused(deck, "stars.indefinite-card", record)


def test_a_weight_of_no_parameter(deck, refused):
    deck[2] = OPTIONS.replace("0 1 0 0 0 0 0 0.0", "0 1 0 1 0 0 0 0.0")
    deck.insert(14, "".join(f"{row:2}{column:2}{1.0:12.4E}" for row, column in ((1, 1), (27, 2))))
    refused(deck, "stars.no-weight", 15, row=27, column=2)


def rejecting(deck, numbers):
    """Add rejection cards; the flag of the last says that it is."""
    deck[2] = deck[2].ljust(76) + "1"
    last = len(numbers) - 1
    rejections = [put((1, f"{number:6}"), (18, int(i == last))) for i, number in enumerate(numbers)]
    return [*deck[: FIRST_STAR - 1], *rejections, *deck[FIRST_STAR - 1 :]]


def test_too_many_rejections(deck, refused):
    """A hundred stars and two hundred plate points at the most; here all are there, but one."""
    refused(rejecting(deck, range(1, 200)), "stars.too-many-rejected", FIRST_STAR + 100)
    points = range(10001, 10400)
    refused(rejecting(deck, points), "stars.too-many-rejected", FIRST_STAR + 200)


def test_rejections_of_what_is_not_there(deck, refused):
    refused(rejecting(deck, [2, 777]), "stars.rejected-star", FIRST_STAR + 1, names=["777"])
    refused(rejecting(deck, [10777]), "stars.rejected-point", FIRST_STAR, names=["10777"])


def test_a_star_whose_images_are_all_rejected_is_eliminated(deck, tmp_path):
    for i in range(FIRST_STAR, FIRST_STAR + 5):
        deck[i] = replaced(deck[i], 55, f"{10101 + i - FIRST_STAR:6}")
    (tmp_path / "deck").write_text("\n".join(rejecting(deck, range(10101, 10106))) + "\n")
    (problem,) = read_deck(tmp_path / "deck")
    assert len(problem.star_ids) == 74
    assert "1" not in problem.star_ids
    assert problem.labels["stars eliminated, all images rejected"] == "1"


def minimum(deck, numbers, options="0 0 1 1 0 {} 0 1 0 0 0 0 0 0.0"):
    lines = ["".join(f"{n:4}" for n in numbers[i : i + 20]) for i in range(0, len(numbers), 20)]
    deck[2] = options.format(len(numbers))
    return [*deck[: FIRST_STAR - 1], *lines, *deck[FIRST_STAR - 1 :]]


def test_stars_of_the_minimum_solution_that_are_not_there(deck, refused):
    code = "stars.minimum-unknown"
    refused(minimum(deck[:], [3, 999]), code, FIRST_STAR, names=["999"])
    refused(minimum(deck[:], [3, 0, 5]), code, FIRST_STAR, names=["0"])
    refused(minimum(deck[:], [*range(1, 22), 500]), code, FIRST_STAR + 1, names=["500"])


def test_an_unknown_direction_is_no_star_of_the_minimum_solution(deck, tmp_path):
    deck = minimum(deck, [1, 30])
    for i in range(FIRST_STAR, FIRST_STAR + 6):
        deck[i] = replaced(deck[i], 61, "    -1")
    (tmp_path / "deck").write_text("\n".join(deck) + "\n")
    (problem,) = read_deck(tmp_path / "deck")
    with pytest.raises(InputError, check=coded("stars.minimum-direction")):
        calibrate(problem)


def test_a_pre_run_needs_a_minimum_solution(deck, refused):
    deck[2] = OPTIONS.replace("0 0 1 1 0 0 0", "0 0 1 1 0 0 1", 1)
    refused(deck, "error.requires", 3, name="pre_run", other="minimum_stars")


@pytest.mark.parametrize(
    ("left", "what"),
    [
        (0, "card 1 (problem number)"),
        (7, "card 8 (station)"),
        (13, "card 18 (initial parameters)"),
        (15, "card 21 (weight of the plate)"),
        (16, "a star card"),
        (30, "an image of star 3"),
    ],
)
def test_a_deck_that_ends_early(deck, tmp_path, left, what):
    (tmp_path / "deck").write_text("".join(f"{card}\n" for card in deck[:left]))
    with pytest.raises(InputError, check=coded("stars.deck-ends", card=what)) as raised:
        read_deck(tmp_path / "deck")
    assert raised.value.record == left + 1


def test_a_deck_that_cannot_be_adjusted(deck, tmp_path):
    """Error 3: two stars of the event with an image each."""
    file = tmp_path / "deck"
    few = [*deck[:18], *deck[22:24]]
    for star, image in ((16, 17), (18, 19)):
        few[star] = replaced(few[star], 69, "  1")
        few[image] = replaced(few[image], 55, "   901")
    few[-1] = replaced(few[-1], 80, "1")
    file.write_text("\n".join(few) + "\n")
    (problem,) = read_deck(file)
    with pytest.raises(AdjustmentError, check=coded("stars.error-3", observations=8, unknowns=20)):
        calibrate(problem)
    run = CliRunner().invoke(app, ["stellar-camera", str(file)])
    assert run.exit_code == 3
    assert "ERROR 3" in run.output
    assert [path.name for path in tmp_path.iterdir()] == ["deck"]


def test_a_minus_sign_in_the_degrees_is_ignored_and_any_flag_means_south(deck, tmp_path):
    for flag, sign in (("0", 1), ("1", -1), ("7", -1)):
        deck[7] = replaced(deck[7], 33, f"{flag}  -30")
        (tmp_path / "deck").write_text("\n".join(deck) + "\n")
        assert read_deck(tmp_path / "deck")[0].site.latitude == pytest.approx(sign * np.radians(30.0))
