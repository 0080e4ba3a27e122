"""The text format of "Bundle Adjustment in the Large": read, written, refused."""

from __future__ import annotations

import bz2
import gzip
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from photogram import InputError
from photogram.collection import Collection, read, simulate, to_bytes

SMALL = simulate(photos=3, points=4, seed=1).collection


@pytest.mark.parametrize("suffix", ["", ".bz2", ".gz"])
def test_what_is_written_reads_back_to_the_last_bit(tmp_path, suffix):
    path = tmp_path / f"problem.txt{suffix}"
    path.write_bytes(to_bytes(SMALL, suffix))
    again = read(path)
    for name in ("photo_parameters", "point_positions", "image_photos", "image_points", "image_xy"):
        np.testing.assert_array_equal(getattr(again, name), getattr(SMALL, name))
    assert (again.image_sd == 1).all()
    assert np.isinf(again.photo_sd).all()


def test_packed_files_are_known_by_what_they_begin_with(tmp_path):
    for name, pack in (("a.txt", bz2.compress), ("b", gzip.compress)):
        (tmp_path / name).write_bytes(pack(to_bytes(SMALL)))
        np.testing.assert_array_equal(read(tmp_path / name).image_xy, SMALL.image_xy)


def test_white_space_does_not_matter(tmp_path):
    path = tmp_path / "problem.txt"
    path.write_bytes(b"\r\n\t ".join(to_bytes(SMALL).split()))
    np.testing.assert_array_equal(read(path).image_xy, SMALL.image_xy)


def spoilt(tmp_path: Path, change) -> InputError:
    """Read the small problem with lines changed; return the error."""
    lines = to_bytes(SMALL).decode().splitlines()
    path = tmp_path / "problem.txt"
    path.write_text("\n".join(change(lines)) + "\n")
    with pytest.raises(InputError) as raised:
        read(path)
    assert raised.value.file == path
    return raised.value


def with_line(number: int, text: str):
    return lambda lines: [*lines[: number - 1], text, *lines[number:]]


@pytest.mark.parametrize(
    ("number", "text", "message"),
    [
        (1, "3 4 x", "the numbers of photos, points and images"),
        (1, "3 4.5 9", "must contain the numbers of photos, points and images"),
        (1, "-3 4 9", "must contain the numbers of photos, points and images"),
        (3, "0 0 1.5 1.5.5", "must be a finite number"),
        (3, "0 0 nan 1.5", "must be a finite number"),
        (3, "3 0 1.5 1.5", "a photo must be 0 to 2, got 3"),
        (3, "1.5 0 1.5 1.5", "a photo must be 0 to 2, got 1.5"),
        (3, "0 -1 1.5 1.5", "a point must be 0 to 3, got -1"),
    ],
)
def test_a_bad_line_is_named_and_shown(tmp_path, number, text, message):
    error = spoilt(tmp_path, with_line(number, text))
    assert message in str(error)
    assert (error.record, error.text) == (number, text)


def test_a_file_that_ends_early_or_late_is_refused(tmp_path):
    assert "ends before" in str(spoilt(tmp_path, lambda lines: lines[:-1]))
    late = spoilt(tmp_path, lambda lines: [*lines, "7.5"])
    assert "must end after" in str(late)
    assert late.text == "7.5"
    assert "ends before" in str(spoilt(tmp_path, lambda lines: []))


def test_files_that_cannot_be_read_or_unpacked_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "none.txt")
    for name, packed in (("a.bz2", bz2.compress(to_bytes(SMALL))), ("b.gz", gzip.compress(to_bytes(SMALL)))):
        (tmp_path / name).write_bytes(packed[:-9])
        with pytest.raises(InputError, match="cannot be unpacked"):
            read(tmp_path / name)
        (tmp_path / name).write_bytes(packed[:20] + b"\xff" * 20 + packed[40:])
        with pytest.raises(InputError, match="cannot be unpacked"):
            read(tmp_path / name)


@given(st.binary(max_size=200))
def test_nothing_but_an_input_error_comes_of_any_bytes(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("bytes") / "problem.txt"
    path.write_bytes(b"1 1 1\n" + data)
    with suppress(InputError):
        assert isinstance(read(path), Collection)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("photo_parameters", np.zeros((3, 8)), "must have the shape"),
        ("point_positions", np.full((4, 3), np.nan), "point_positions[0, 0]: must be a finite number"),
        ("image_sd", 0.0, "image_sd[0, 0]: must be positive"),
        ("photo_sd", -1.0, "photo_sd[0, 0]: must not be negative"),
        ("image_photos", np.full(len(SMALL.image_xy), 3), "must be an integer from 0 to 2"),
        ("image_points", np.zeros(len(SMALL.image_xy)), "whole numbers"),
    ],
)
def test_arrays_that_cannot_be_are_refused_by_name(name, value, message):
    with pytest.raises(InputError) as raised:
        SMALL.replace(**{name: value})
    assert message in str(raised.value)
