"""Tables as text of commas."""

import csv
import io

import numpy as np
import pytest

from photogram import _photocore
from photogram.io.csv_text import csv_text


def rows(text):
    return list(csv.reader(io.StringIO(text.decode())))


def test_numbers_are_read_back_to_the_last_bit():
    random = np.random.default_rng(20261122)
    numbers = np.frombuffer(random.bytes(8 * 30_000))
    numbers = np.concatenate([numbers[np.isfinite(numbers)], [0.0, -0.0, np.inf, -np.inf, 5e-324]])
    found = rows(csv_text({"x": numbers}))
    assert found[0] == ["x"]
    again = np.array([float(cell) for (cell,) in found[1:]])
    assert again.tobytes() == numbers.tobytes()


def test_cells_of_every_kind():
    columns = {
        "float": np.array([1.5, np.nan, 1e-7]),
        "single": np.array([0.5, 1, 2], dtype=np.float32),
        "strided": np.arange(6.0)[::2],
        "count": np.array([1, -2, 3], dtype=np.int32),
        "truth": np.array([True, False, True]),
        "mixed": [None, True, 0.25],
        "text": ["a", None, "b"],
    }
    found = rows(csv_text(columns, ["of a test"]))
    assert found == [
        ["# of a test"],
        list(columns),
        ["1.5", "0.5", "0.0", "1", "true", "", "a"],
        ["", "1.0", "2.0", "-2", "false", "true", ""],
        ["1e-7", "2.0", "4.0", "3", "true", "0.25", "b"],
    ]


@pytest.mark.parametrize("text", ["a,b", 'say "x"', "a;b", "#1", " a", "a ", "tab\there", "a|b"])
def test_texts_that_might_be_taken_apart_are_in_quotation_marks(text):
    line = csv_text({"name": [text], "x": [1]}).decode().splitlines()[1]
    assert line.startswith('"')
    assert next(csv.reader([line])) == [text, "1"]


def test_line_ends_become_blanks():
    assert rows(csv_text({"name": ["a\nb"]}))[1] == ["a b"]


def test_many_rows_keep_their_order():
    count = 50_000
    found = csv_text({"row": np.arange(count), "half": np.arange(count) / 2}).decode().splitlines()
    assert found[1:] == [f"{row},{row / 2}" for row in range(count)]


def test_columns_that_differ_in_length_are_refused():
    with pytest.raises(ValueError, match="differ in length"):
        _photocore.csv_rows(b"", [np.zeros(2), np.zeros(3)])


def test_no_rows():
    assert csv_text({"a": [], "b": np.zeros(0)}) == b"a,b\n"
