"""Columns of many records at once say what the fields say one by one."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from photogram import InputError
from photogram.giant.fields import (
    Columns,
    angle_fields,
    format_angle,
    format_real,
    position_fields,
    real_fields,
    texts,
)
from photogram.giant.records import Source
from photogram.stellar import ARCSEC

FIELDS = st.lists(
    st.one_of(
        st.from_regex(r" {0,3}[+-]?[0-9]{0,7}\.?[0-9]{0,4} {0,2}", fullmatch=True),
        st.text(" 0123456789.+-EeD*x\u00e9", max_size=12),
    ).filter(lambda field: len(field) <= 12),
    min_size=1,
    max_size=20,
)
decimal_numbers = st.builds(
    lambda units, places: units / 10**places, st.integers(-(10**11), 10**11), st.integers(0, 12)
)
numbers = st.one_of(st.floats(-1e7, 1e7), st.floats(-2, 2), decimal_numbers, st.just(math.nan))
angles = st.one_of(
    st.floats(-2 * math.pi, 2 * math.pi),
    st.floats(-1e-3, 1e-3),
    st.integers(-(10**9), 10**9).map(lambda thousandths: thousandths / 1000 * ARCSEC),
    st.integers(-21599, 21600).map(lambda minutes: (60 * minutes - 1e-7) * ARCSEC),
    st.just(math.nan),
)


def sources(fields):
    return Source(Path("FILE"), [f"{field:12}" for field in fields])


@settings(max_examples=150, deadline=None)
@given(FIELDS)
def test_plain_numbers_are_read_as_one_by_one(fields):
    source, columns = sources(fields), Columns([f"{field:12}" for field in fields])
    values = columns.real(1, 12)
    for row in np.flatnonzero(columns.plain):
        assert values[row] == source.record(row + 1).real(1, 12)
        assert math.copysign(1, values[row]) == math.copysign(1, source.record(row + 1).real(1, 12))
    assert not source.messages  # what deserves a remark is not plain
    for row in np.flatnonzero(~columns.plain):
        try:
            source.record(row + 1).real(1, 12)
        except InputError:
            continue
        # An exponent may do without its letter, behind a digit or the point.
        assert source.messages or re.search(r"[eEdD]|[\d.] *[+-]", fields[row])


@settings(max_examples=150, deadline=None)
@given(FIELDS)
def test_plain_angles_are_read_as_one_by_one(fields):
    source, columns = sources(fields), Columns([f"{field:12}" for field in fields])
    values = columns.angle(1, 12)
    for row in np.flatnonzero(columns.plain):
        assert values[row] == source.record(row + 1).angle(1, 12)
    assert not source.messages


def test_blank_fields_and_short_records():
    columns = Columns(["A", "", f"{'B':8}{'1.5':>12}"])
    assert columns.real(9, 20).tolist() == [0, 0, 1.5]
    assert columns.blank(9, 20).tolist() == [True, True, False]
    assert columns.plain.all()
    assert columns.deviations(True, False, True).tolist() == [[0, 0, 0]] * 3
    assert Columns([]).position(True).shape == (0, 3)


def test_what_is_not_plain():
    rows = ["1.5", "- 1.5", "1.5E1", "1.2.3", "1-", "x", "-", ".", "4.", "+.5"]
    columns = Columns([f"{row:>12}" for row in rows])
    columns.real(1, 12)
    assert [row for row, plain in zip(rows, columns.plain, strict=True) if plain] == ["1.5", "4.", "+.5"]
    columns = Columns([f"{row:>12}" for row in ("6000.", "60.", "3610000.", "-1.", "3600000.")])
    columns.deviation(1, 12, angle=True)
    assert columns.plain.tolist() == [False, False, False, False, True]
    beyond = Columns([f"{'':20}{'900000.001':>12}", f"{'':20}{'-900000':>12}", f"{'':20}{'-900000.':>12}"])
    beyond.position(geographic=True)
    assert beyond.plain.tolist() == [False, True, True]


@settings(max_examples=150, deadline=None)
@given(st.lists(numbers, min_size=1, max_size=20), st.sampled_from([(10, 3), (12, 3), (10, 2)]))
def test_numbers_are_written_as_one_by_one(values, size):
    width, decimals = size
    assume(all(math.isnan(value) or abs(value) < 10 ** (width - 2) - 1 for value in values))
    together = texts(real_fields(np.array(values)[:, np.newaxis], width, decimals))
    assert together == [format_real(value, width, decimals) for value in values]


@settings(max_examples=150, deadline=None)
@given(st.lists(angles, min_size=1, max_size=20))
def test_angles_are_written_as_one_by_one(values):
    assert texts(angle_fields(np.array(values)[:, np.newaxis], 12)) == [
        format_angle(value, 12) for value in values
    ]


def test_many_numbers_are_written_as_one_by_one():
    rng = np.random.default_rng(11)
    values = rng.choice([-1, 1], 20_000) * 10 ** rng.uniform(-12, 7, 20_000)
    for rounded in (values, np.round(values, 3), np.round(values, 6), np.rint(values)):
        assert texts(real_fields(rounded[:, np.newaxis], 10, 3)) == [
            format_real(value, 10, 3) for value in rounded.tolist()
        ]
    turns = rng.uniform(-2 * math.pi, 2 * math.pi, 20_000)
    for rounded in (turns, np.round(turns / ARCSEC, 4) * ARCSEC):
        assert texts(angle_fields(rounded[:, np.newaxis], 12)) == [
            format_angle(value, 12) for value in rounded.tolist()
        ]


@pytest.mark.parametrize("value", [1e13, -1e12, math.inf, -math.inf])
def test_what_does_not_fit_is_refused(value):
    with pytest.raises(ValueError, match=r"must fit into|must be a finite number"):
        position_fields([[1.0, value, 2.0]], geographic=False)
    with pytest.raises(ValueError, match=r"360 degrees"):
        position_fields([[1.0, value, 2.0]], geographic=True)
