"""Single fields: GIANT guide, section II.B; specification 2.1."""

import json
import math
from decimal import Decimal
from pathlib import Path

import fortranformat
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from photogram.arguments.arrays import natural_order
from photogram.giant.fields import (
    format_angle,
    format_deviations,
    format_name,
    format_principal_distance,
    format_real,
    parse_angle,
    parse_name,
)
from photogram.io.records import parse_integer, parse_real

GOLDEN = json.loads((Path(__file__).parents[1] / "data" / "giant" / "golden_cases.json").read_text())


@pytest.mark.giant("2.1", "Fw.d without a decimal point: implied")
@pytest.mark.giant("15", "packed DMS and implied decimals")
@pytest.mark.parametrize("case", GOLDEN["implied_decimal"], ids=lambda case: case["field"])
def test_section_2_1_numbers_of_the_report(case):
    decimals = int(case["format"].split(".")[1])
    assert float(parse_real(case["field"], decimals)) == pytest.approx(case["value"], abs=1e-12)


@pytest.mark.giant("2.1", "DMS: sign, then DDDMMSS.sss from the left")
@pytest.mark.giant("2.1", "DMS: leading zeros may be omitted")
@pytest.mark.giant("15", "packed DMS and implied decimals")
@pytest.mark.parametrize("case", GOLDEN["dms_packed"], ids=lambda case: case["field"])
def test_section_2_1_angles_of_the_report(case):
    angle, doubtful = parse_angle(case["field"], 3)
    degrees, minutes, seconds = case["dms"].removeprefix("-").split()
    size = int(degrees) + int(minutes) / 60 + float(seconds) / 3600
    assert math.degrees(angle) == pytest.approx(math.copysign(size, case["deg"]), abs=1e-12)
    assert math.degrees(angle) == pytest.approx(case["deg"], abs=0.5000001e-6)  # printed to six decimals
    assert not doubtful
    text = format_angle(angle, 12)
    assert Decimal(text) == Decimal(case["field"])
    assert parse_angle(text, 3) == (angle, False)


@pytest.mark.giant("2.1", "Fw.d with a decimal point")
@pytest.mark.giant("2.1", "a blank field is zero")
@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("", 0),
        ("          ", 0),
        ("   12     ", "0.012"),
        (" - 1 2.5  ", "-12.5"),
        ("1.", 1),
        (".5", "0.5"),
        ("+.5", "0.5"),
        ("1.5E2", 150),
        ("15D3", 15),
        ("-0.000", 0),
    ],
)
def test_section_2_1_real(field, value):
    assert parse_real(field, 3) == Decimal(value)


@pytest.mark.parametrize(
    "field",
    [
        "nan",
        "NaN",
        "inf",
        "-Infinity",
        "1.2.3",
        "--1",
        "1-",
        "1,5",
        "12a",
        "1_000",
        ".",
        "-",
        "E5",
        "1.5E",
        "1.5+",
        "1.5E+-2",
        "1.5EE2",
        "1.5E2.",
        "1.5+2+3",
        "1.5E2D3",
        "+-1",
        "²",
        "1.5E²",
        "٣",
    ],
)
def test_illegal_numbers(field):
    with pytest.raises(ValueError, match="must be a number"):
        parse_real(field, 3)


# ANSI X3.9-1978, 13.5.9.2.1, with BLANK='NULL': field, d, value. A decimal point in the field overrides d;
# the exponent is a signed integer, or E or D, blanks, and an integer with or without a sign.
FORTRAN_77 = [
    ("-1.5274+2", 3, "-152.74"),
    ("-1.5274-2", 3, "-0.015274"),
    ("1.5+02", 3, "150"),
    ("-152740-1", 3, "-15.274"),
    ("15274+2", 3, "1527.4"),
    ("15274E2", 3, "1527.4"),
    ("15274D+2", 2, "15274"),
    ("15274d-2", 0, "152.74"),
    ("15274e0", 5, "0.15274"),
    ("+.5D1", 3, "5"),
    ("5.E1", 3, "50"),
    ("5.+1", 3, "50"),
    ("-.5-1", 3, "-0.05"),
    ("1.5E 2", 3, "150"),
    ("1.5 D + 2", 3, "150"),
    (" - 1 . 5 + 2 ", 3, "-150"),
    ("1.5E+002", 3, "150"),
    ("1.5+002", 3, "150"),
    ("1", 3, "0.001"),
    ("-1", 5, "-0.00001"),
    ("0+99999", 3, "0"),
    ("1.7E308", 3, "1.7E308"),
    ("1.0-300", 3, "1E-300"),
]


@pytest.mark.giant("2.1", "Fw.d with an exponent: E, D, or a sign without letter")
@pytest.mark.parametrize(("field", "decimals", "value"), FORTRAN_77)
def test_section_2_1_every_form_of_fortran_77(field, decimals, value):
    assert parse_real(field, decimals) == Decimal(value)


@pytest.mark.giant("2.1", "Fw.d with an exponent: E, D, or a sign without letter")
@given(
    sign=st.sampled_from(["", "+", "-"]),
    whole=st.text("0123456789", max_size=5),
    point=st.booleans(),
    fraction=st.text("0123456789", max_size=4),
    exponent=st.sampled_from(["", "+1", "-2", "E3", "e-4", "D+5", "d0", "E+06", "-07"]),
    decimals=st.integers(0, 5),
)
def test_section_2_1_the_package_fortranformat_reads_the_same(
    sign, whole, point, fraction, exponent, decimals
):
    assume(whole or (point and fraction))
    field = sign + whole + ("." + fraction if point else "") + exponent
    (other,) = fortranformat.FortranRecordReader(f"(BN,F{len(field)}.{decimals})").read(field)
    assert float(parse_real(field, decimals)) == pytest.approx(other, rel=1e-14)


@pytest.mark.parametrize("field", ["1E999", "-1.D309", "1.5+400", "1E-400", "1.-999", "1E99999999"])
def test_numbers_that_double_precision_does_not_have_are_refused(field):
    with pytest.raises(ValueError, match="within the range of floating"):
        parse_real(field, 3)


@pytest.mark.giant("2.1", "I1, I2: blank is zero")
def test_section_2_1_integers():
    assert [parse_integer(field) for field in ("", " ", "7", " 5", "5 ", "-1")] == [0, 0, 7, 5, 5, -1]
    for field in ("x", "1.", "²"):
        with pytest.raises(ValueError, match="must be an integer"):
            parse_integer(field)


@pytest.mark.giant("2.1", "DMS: more than 360 degrees, 60 minutes or 60 seconds is fatal")
@pytest.mark.parametrize(
    "field", ["3610000.000", "-3610000.", "16100.", "61.000", "-60.001", "3610000000", "1E99", "-1.E9"]
)
def test_section_2_1_illegal_angles(field):
    with pytest.raises(ValueError, match="ILLEGAL DMS FIELD"):
        parse_angle(field, 3)


@pytest.mark.giant("14", "11 60 minutes or seconds pass with a warning")
@pytest.mark.parametrize(
    ("field", "arcseconds", "doubtful"),
    [
        ("3600000.000", 1296000, False),
        ("6000.000", 3600, True),
        ("60.000", 60, True),
        ("10060.", 3660, True),
        ("-03000.000", -1800, False),
        ("-5930", -5.930, False),  # without a point F12.3 has three decimals
        ("100.0E1", 600, False),
    ],
)
def test_section_14_angles_at_the_limits(field, arcseconds, doubtful):
    angle, remark = parse_angle(field, 3)
    assert math.degrees(angle) == pytest.approx(arcseconds / 3600, abs=1e-12)
    assert remark is doubtful


@pytest.mark.giant("14", "13 stripping: left-justified, one character is kept, collisions are errors")
@pytest.mark.parametrize(
    ("field", "strip", "name"),
    [
        ("SH9960  ", "", "SH9960"),
        ("  12    ", "", "12"),
        ("000126! ", "0", "126!"),
        ("00000000", "0", "0"),
        ("0 12", "0", "12"),
        ("A00", "0", "A00"),
        ("        ", "0", ""),
        ("A B", "", "A B"),
    ],
)
def test_section_14_names(field, strip, name):
    assert parse_name(field, strip) == name


@pytest.mark.parametrize(
    ("value", "field"),
    [
        (-152.74, "  -152.740"),
        (0.0, "     0.000"),
        (-0.0, "     0.000"),
        (0.1 + 0.2, "     0.300"),
        (-13.627512345678, "-13.627512"),
        (-0.123456789, "-.12345679"),
        (-123456.789, "-123456789"),  # an implied point where the explicit one would cost a digit
        (1e-8, "0.00000001"),
        (99.999999999, "   100.000"),
        (999999.99999, "1000000.00"),
        (123456789.0, "123456789."),
        (math.nan, "          "),
    ],
)
def test_writing_numbers(value, field):
    assert format_real(value, 10, 3) == field


@pytest.mark.parametrize("value", [1e10, -1e9, math.inf, -math.inf, 1e300])
def test_numbers_that_do_not_fit(value):
    with pytest.raises(ValueError, match=r"must fit|must be a finite number"):
        format_real(value, 10, 3)


@given(st.from_regex(r" {0,4}[+-]?[0-9]{1,8}(\.[0-9]{0,6})?|[+-]?\.[0-9]{1,8}", fullmatch=True))
def test_any_number_that_was_read_is_written_and_read_as_the_same(field):
    assume(len(field) <= 12)
    value = float(parse_real(field, 3))
    assert float(parse_real(format_real(value, 12, 3), 3)) == value


@given(st.floats(-1e8, 1e8))
def test_any_number_is_written_as_closely_as_the_columns_allow(value):
    text = format_real(value, 12, 3)
    assert len(text) == 12
    whole = len(str(int(value))) + (value < 0)
    assert float(parse_real(text, 3)) == pytest.approx(value, abs=0.51 * 10.0 ** -max(3, 12 - whole - 2))


@given(
    st.sampled_from([1, -1]),
    st.integers(0, 360),
    st.integers(0, 59),
    st.decimals(0, 59, places=4, allow_nan=False),
)
def test_any_angle_that_was_read_is_written_and_read_as_the_same(sign, degrees, minutes, seconds):
    assume(degrees < 360 or minutes == seconds == 0)
    field = f"{sign * (10000 * degrees + 100 * minutes + seconds):f}"[:12]
    angle, _ = parse_angle(field, 3)
    assert parse_angle(format_angle(angle, 12), 3)[0] == angle


@given(st.floats(-2 * math.pi, 2 * math.pi))
def test_any_angle_is_written_to_four_decimals_of_the_second(angle):
    text = format_angle(angle, 12)
    assert len(text) == 12
    error = parse_angle(text, 3)[0] - angle
    assert math.remainder(error, 2 * math.pi) == pytest.approx(0, abs=math.radians(0.000051 / 3600))


def test_seconds_round_up_into_minutes_and_degrees():
    assert format_angle(math.radians(29 + 59 / 60 + 59.9999999 / 3600), 12) == " 300000.0000"


@pytest.mark.parametrize("angle", [6.301, -6.301, math.inf])
def test_angles_beyond_the_circle_are_refused(angle):
    with pytest.raises(ValueError, match="360 degrees"):
        format_angle(angle, 12)


def test_deviations():
    arcsec = math.radians(1 / 3600)
    assert (
        format_deviations((0.0, 600 * arcsec, 0.04), (True, True, False)) == "            1000.000     0.040"
    )
    for value in (-0.1, 1e-12, 1e12, math.nan):
        with pytest.raises(ValueError, match=r"must fit|must be"):
            format_deviations((value,), (False,))


def test_principal_distances():
    assert format_principal_distance(0.0) == " " * 10
    assert format_principal_distance(-152.74) == "  -152.740"
    for value in (1e-12, -1e-12, math.nan, 1e12):
        with pytest.raises(ValueError, match=r"must fit|must be"):
            format_principal_distance(value)


def test_names_are_written_as_they_are_read():
    assert format_name("SH9960") == "SH9960  "
    for name in ("123456789", " A", "A ", "A\tB", "****", "****1"):
        with pytest.raises(ValueError, match="name"):
            format_name(name)


def test_natural_order_takes_digits_as_numbers():
    names = ["P", "9", "P10", "P2a", "10", "P9", "!3"]
    assert sorted(names, key=natural_order) == ["9", "10", "!3", "P", "P2a", "P9", "P10"]
