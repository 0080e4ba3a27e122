"""Cards and decks: FORMATs, blanks, sets, flags, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from photogram import InputError
from photogram.io.records import Source
from photogram.perspective_center import read_deck, run_deck
from photogram.perspective_center.deck import CardFormat

PLATE = [(-90, -90), (0, -90), (90, -90), (-90, 90), (0, 0), (90, 90)]


def record(*lines):
    return Source(Path("deck"), list(lines)).record(1)


def read(text, line, reals=2):
    return CardFormat(text, reals=reals).read(record(line))


# FORMATs


@pytest.mark.parametrize(
    ("text", "line", "values"),
    [
        ("(I4,2F10.0)", "  12      1.5      -2.5", [12, 1.5, -2.5]),
        ("(I4,2F10.3)", "  12      1500     -2500", [12, 1.5, -2.5]),
        ("( I4, 2F10.3 )  grid", "  12      1500     -2.25", [12, 1.5, -2.25]),
        ("(I4,2D12.4)", "  12     1.5D+01    -25.0E-1", [12, 15.0, -2.5]),
        ("(I4,2E12.4)", "  12       1.5+1      1500D0", [12, 15.0, 0.15]),
        ("(T5,I3,2(1X,F6.2))", "xxxx 12  12.50  -0.25", [12, 12.5, -0.25]),
        ("(2X,I3,3X,F5.1,5X,F5.1)", "ab 12 c  12.5     -3.25", [12, 12.5, -3.25]),
        ("(I4,3F5.1)", "   7  1.0  2.0  3.0", [7, 1.0, 2.0]),
        ("(I4,2F10.0)", "", [0, 0.0, 0.0]),
        ("(I4,2F10.0)", "   5", [5, 0.0, 0.0]),
        ("(i4,2f10.0)", "   5       1.0       2.0", [5, 1.0, 2.0]),
    ],
)
def test_numbers_by_a_format(text, line, values):
    assert read(text, line) == pytest.approx(values)


def test_blanks_in_a_field_count_as_zeros():
    card = record("1 2      15        -2 5.")
    assert CardFormat("(I4,2F10.1)", reals=2).read(card) == [1020, 1500.0, -205.0]
    remarks = [message.text for message in card.source.messages]
    assert len(remarks) == 2
    assert "columns 1-4" in remarks[0]
    assert "value is 1020" in remarks[0]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("I4,2F10.0", "parentheses"),
        ("(I4,2F10.0", "parentheses"),
        ("", "parentheses"),
        ("(I4,A4,F10.0)", "descriptors"),
        ("(I4/2F10.0)", "descriptors"),
        ("(I4,2PF10.0)", "descriptors"),
        ("(2F10.0,I4)", "must give"),
        ("(I4,F10.0)", "must give"),
        ("(I4,70X,2F10.0)", "exceed column 80"),
        ("(I4,2F999999999.0)", "beyond the 80 columns"),
        ("(I4,2F10.99999999999)", "beyond the 80 columns"),
        ("(999999999I4,2F10.0)", "beyond the 80 columns"),
        ("(I4,80(80(80(80(80(F1.0))))))", "beyond the 80 columns"),
    ],
)
def test_formats_that_do_not_serve(text, why):
    with pytest.raises(ValueError, match=why):
        CardFormat(text, reals=2)


@pytest.mark.parametrize("field", ["1.2.3", "NaN", "1_0", "0x10", "1.5D", "twelve", "1,5"])
def test_fields_that_are_no_numbers(field):
    with pytest.raises(InputError, match=r"columns 5-14: must be a number"):
        read("(I4,2F10.0)", f"   1{field:>10}       2.0")
    with pytest.raises(InputError, match=r"columns 1-4: must be a whole number"):
        read("(I4,2F10.0)", " 1.5       1.0       2.0")


# Decks


def cards(sets=1, readings=2, flag="  0", z=0.0):
    """Make a deck of six points."""
    lines = ["A SMALL DECK", "(I3,2F9.3)", "(I3,3F11.4)", f"    6{sets:5d}    0   150.000    0.0010"]
    lines += [f"{i:3d}{x:9.3f}{y:9.3f}" for i, (x, y) in enumerate(PLATE, 1)]
    for number in range(sets):
        lines.append("     0.000     0.000     0.000   250.000   250.000   300.000")
        for i, (x, y) in enumerate(PLATE, 1):
            height = z + 10 * number
            scale = (300.0 - height) / 150.0
            shift = 0.001 * i
            lines += [
                f"{i:3d}{250 + scale * x + shift:11.4f}{250 + scale * y:11.4f}{height:11.4f}"
            ] * readings
        lines.append(flag)
    return lines


@pytest.fixture
def write(tmp_path):
    """Return a function that writes cards as a deck."""

    def write(lines, end="\n"):
        path = tmp_path / "deck.txt"
        path.write_text("\n".join(lines) + end)
        return path

    return write


def test_a_deck_is_read(write):
    (grid,) = read_deck(write(cards()))
    assert (grid.title, grid.number, list(grid.ids)) == ("A SMALL DECK", 1, [1, 2, 3, 4, 5, 6])
    assert grid.readings.tolist() == [2] * 6
    np.testing.assert_allclose(grid.plate_xy, PLATE)
    np.testing.assert_allclose(grid.initial, [250.0, 250.0, 300.0, 0.0, 0.0, 0.0])
    assert (grid.principal_distance, grid.tolerance, grid.corrected) == (150.0, 0.001, False)


@pytest.mark.parametrize("end", ["", "\n", "\n\n\n", "\n      \n"])
@pytest.mark.parametrize("flag", ["", "  0", "   ", "  0     0.0"])
def test_any_flag_and_any_end(write, flag, end):
    grids = read_deck(write(cards(sets=2, flag=flag), end))
    assert [grid.number for grid in grids] == [1, 2]
    assert grids[1].model[0, 2] == 10.0


def test_a_missing_last_flag_is_remarked(write):
    run = run_deck(write(cards()[:-1]))
    assert len(run.results) == 1
    assert "must end with a flag card" in str(run.messages[0])


def test_icalf_zero_is_one_set(write):
    lines = cards()
    lines[3] = "    6    0    0   150.000    0.0010"
    assert len(read_deck(write(lines))) == 1


def replaced(index, line):
    lines = cards()
    lines[index] = line
    return lines


@pytest.mark.parametrize(
    ("lines", "message", "number"),
    [
        (replaced(1, "(I3,2F9.3"), "parentheses", 2),
        (replaced(3, "    0    1    0   150.000    0.0010"), "number of points must be positive", 4),
        (replaced(3, "    6    1    0    -1.000    0.0010"), "principal distance must be positive", 4),
        (replaced(5, "  1    0.000  -90.000"), "point 1 occurs twice", 6),
        (replaced(5, "       0.000  -90.000"), "must not have the number 0", 6),
        (replaced(7, "  4   90.0.0  -90.000"), "must be a", 8),
        (replaced(10, "zero"), "must be a", 11),
        ([*cards()[:-1], "  7    1.0        1.0        0.0"], "a flag card .* is required .* point 6", 24),
        (cards()[:16], "ends after point 3", None),
        (cards()[:8], "must contain a card of the plate grid", None),
        ([*cards()[:15], "  0", *cards()[17:]], "CARDS ARE OUT OF ORDER AT POINT NO. 3", 16),
        ([*cards()[:13], *cards()[15:]], "CARDS ARE OUT OF ORDER AT POINT NO. 2", 14),
    ],
)  # fmt: skip
def test_faults_are_named_with_their_card(write, lines, message, number):
    with pytest.raises(InputError, match=message) as caught:
        read_deck(write(lines))
    assert caught.value.record == number


def test_what_was_solved_before_a_fault_is_kept(write):
    good, bad = cards(sets=2), cards(sets=2)
    bad[11], bad[13] = bad[13], bad[11]
    bad[0] = "A BAD DECK"
    run = run_deck(write([*good, *bad, *good]))
    assert [result.grid.title for result in run.results] == ["A SMALL DECK"] * 2
    assert (run.stop.title, run.stop.number, run.stop.grid) == ("A BAD DECK", 1, None)
    assert not run.converged


def test_more_readings_and_points_than_the_program_held(write):
    (grid,) = read_deck(write(cards(readings=70)))
    assert grid.readings.tolist() == [70] * 6


def test_a_file_that_is_no_deck(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_deck(tmp_path / "nowhere")
    (tmp_path / "empty").write_text("")
    assert read_deck(tmp_path / "empty") == []
