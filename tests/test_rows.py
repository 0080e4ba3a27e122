"""Comma-separated tables of all programs: what a damaged file may hold ends in an error that names it."""

import csv
from pathlib import Path

import numpy as np
import pytest

from photogram import InputError, Message
from photogram.comparator import Place
from photogram.io.delimited import LONGEST_RECORD, cells, read_records
from photogram.io.numbers import finite_number, is_whole_number, whole_number
from photogram.messages import MOST_CHARACTERS
from photogram.words import quoted


def written(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_rows_hold_cells_and_places(tmp_path):
    path = written(tmp_path, '# a remark\nID,x\n\n,,\n"a, b", 1.5\nc,\n')
    table = read_records(path, spelling=lambda names: [name.lower() for name in names])
    assert (table.columns, table.head, table.path) == (("id", "x"), Place(path, 2, "ID,x"), path)
    assert [place.text for place in table.comments] == ["# a remark"]
    assert table.texts("id") == ["a, b", "c"]
    np.testing.assert_array_equal(table.numbers("x"), [1.5, np.nan])
    assert [table.place(row).record for row in range(table.count)] == [5, 6]


def read_numbers(path):
    """Read the column x of a table."""
    table = read_records(path)
    table.require("id", "x")
    return table.given(["x"])


@pytest.mark.parametrize(
    ("text", "record", "words"),
    [
        ("", None, "must contain a table"),
        (",,\n", None, "must contain a table"),
        ("id,x,id\n1,2,3\n", 1, "the column 'id' occurs more than once"),
        ("id,y\n1,2\n", 1, "the column x is missing"),
        ("id,x\n1,2,3\n", 2, "must have 2 cells, one for each column, got 3"),
        ("id,x\n1\n", 2, "must have 2 cells, one for each column, got 1"),
        (f"id,x\n1,{'9' * 140_000}\n", 2, f"must have at most {LONGEST_RECORD} characters, got 140002"),
        (f"id,x\n1,{'9' * 90_000}\n", 2, r"column x: must be a number, got '9999.*'... \(90000 characters\)"),
        (f"id,x{',' * 420_000}\n1,2\n", 1, "the record must have at most 100000 characters, got 420004"),
        (f"id,x{',' * 90_000}\n1,2\n", 2, "must have 90002 cells, one for each column, got 2"),
    ],
)
def test_damaged_tables_name_file_and_record(tmp_path, text, record, words):
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=words) as caught:
        read_numbers(path)
    assert (caught.value.file, caught.value.record) == (path, record)
    assert len(str(caught.value)) < len(str(path)) + 2 * MOST_CHARACTERS


def test_cells_may_be_missing_at_the_end_of_a_ragged_table(tmp_path):
    table = read_records(written(tmp_path, "id,x,y\n1,2\n3\n"), ragged=True)
    np.testing.assert_array_equal(table.numbers("x"), [2.0, np.nan])
    with pytest.raises(InputError, match=r"record 3: column x: must have a value"):
        table.given(["x"])


def test_columns_of_integers(tmp_path):
    table = read_records(written(tmp_path, "id,n,m\n1,7,\n2,,3\n3,1.5,\n"))
    assert table.some([0, 1]).wholes("n", 0).tolist() == [7, 0]
    with pytest.raises(InputError, match=r"record 3: column n: must have a value"):
        table.some([0, 1]).wholes("n")
    with pytest.raises(InputError, match=r"record 4: column n: must be an integer"):
        table.wholes("n", 0)


def test_a_limit_of_the_host_is_an_error_of_the_record():
    before = csv.field_size_limit(10)
    try:
        with pytest.raises(
            InputError, match=r"record 7: the file must be valid CSV; correct this error: field larger than"
        ):
            cells(Place(Path("a.csv"), 7, '"12345678901",2'))
    finally:
        csv.field_size_limit(before)


@pytest.mark.parametrize(
    "text",
    ["", "²", "-1", "1.0", "1e3", "1_000", "١٢", "9223372036854775808", "9" * 5000, "0" * 5000],
)
def test_what_is_no_whole_number(text):
    with pytest.raises(ValueError, match=r"must be an integer") as caught:
        whole_number(text)
    assert len(str(caught.value)) < 100


def test_whole_numbers():
    assert [whole_number(text) for text in ("0", "007", "+5", "9223372036854775807")] == [0, 7, 5, 2**63 - 1]
    assert whole_number("20", highest=20) == 20
    with pytest.raises(ValueError, match="must be an integer from 1 to 20, got '21'"):
        whole_number("21", 1, 20)
    assert is_whole_number("12")
    assert not any(map(is_whole_number, ("", "²", "+1", "1.", "١")))


@pytest.mark.parametrize(
    "text",
    ["", "x", "nan", "inf", "-Infinity", "1_000", "١٢", "1e999", "1 2", "1e", ".", "9" * 1001],
)
def test_what_is_no_number(text):
    with pytest.raises(ValueError, match="must be a number"):
        finite_number(text)


def test_numbers():
    texts = ("1", "-1.", "+.5", "1.5e3", "2E-3", "9" * 300, "1e-999")
    assert [finite_number(text) for text in texts] == [1.0, -1.0, 0.5, 1500.0, 0.002, float("9" * 300), 0.0]


def test_messages_show_the_beginning_of_a_long_record():
    text = "a" * 1000
    shown = str(Message("wrong", Path("f"), 3, text))
    assert shown == f"f, record 3: wrong\n    |{'a' * MOST_CHARACTERS}... (1000 characters)|"
    assert str(InputError("wrong", file=Path("f"), record=3, text=text)) == shown
    assert str(Message("wrong", None, None, "a" * 80)) == f"wrong\n    |{'a' * 80}|"
    assert quoted("a\x1b") == r"'a\x1b'"
