"""Every column of every file with its default: specification, 2.1 to 2.6."""

import dataclasses
import math
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from small_project import write_files

from photogram import InputError
from photogram.giant import Camera, Common, ImageFrame, Project, read_project
from photogram.giant.common import common_records, parse_common
from photogram.giant.contents import (
    frame_records,
    ground_records,
    parse_cameras,
    parse_frames,
    parse_ground,
    parse_images,
)
from photogram.giant.fields import parse_angle, parse_name, unpack_dms
from photogram.giant.records import Source

ARCSEC = math.radians(1 / 3600)
SPACES = pytest.mark.parametrize("geographic", [False, True], ids=["rectangular", "geographic"])


def source(*lines, strip=""):
    return Source(Path("FILE"), list(lines), strip=strip)


def at(column, text, name="A"):
    """Return a record of a name in columns 1-8 and a text that begins at a column."""
    return f"{name:{column - 1}}{text}" if column > 1 else text


@pytest.mark.giant("14", "1 columns 16 and 17: 1 applies refraction")
@pytest.mark.parametrize(
    ("columns", "media"), [("00", []), ("10", ["air"]), ("01", ["water"]), ("11", ["air", "water"])]
)
def test_section_14_refraction_that_columns_16_and_17_ask_for_is_remarked_on(columns, media):
    records = source("T", f"{'':15}{columns}{'':13}{'-2.5':>10}")
    parse_common(records)
    assert [
        f"refraction in {medium}" in str(message)
        for message, medium in zip(records.messages, media, strict=True)
    ] == [True] * len(media)
    for message in records.messages:
        assert "FILE, record 2: column 1" in str(message)
        assert ("below -2.5 m" in str(message)) == ("water" in str(message))


# Fields


@pytest.mark.giant("2.1", "DMS: decimal arithmetic")
def test_section_2_1_angles_are_split_in_decimal():
    assert unpack_dms(Decimal("-945904.761")) == (-1, 94, 59, Decimal("4.761"))
    # Split in binary the seconds would be 4.760999...
    assert parse_angle("-945904.761", 3)[0] == -(94 * 3600 + 59 * 60 + 4.761) * ARCSEC
    assert math.modf(945904.761)[0] != 0.761


@pytest.mark.giant("2.1", "DMS: standard deviations of angles")
def test_section_2_1_standard_deviations_of_angles_are_packed():
    records = source(f"{'A':44}{'1000.':>10}{'100.':>10}{'100.':>10}", f"{'A':44}{'900000.':>10}")
    (frame,) = parse_frames(records, geographic=True)
    assert frame.position_sd == pytest.approx((600 * ARCSEC, 60 * ARCSEC, 100))
    assert frame.attitude_sd[0] == pytest.approx(math.pi / 2)


@pytest.mark.giant("2.1", "unused columns are ignored")
def test_section_2_1_unused_columns_hold_anything(tmp_path):
    used = {
        "COMMON": [*range(1, 20), *range(31, 71)],
        "CAMERAS": [*range(1, 9), *range(11, 21)],
        "FRAMES": [*range(1, 75)],
        "GROUND": [*range(1, 75), 80],
    }
    project = read_project(write_files(tmp_path))
    for name, columns in used.items():
        first = 1 if name == "COMMON" else 0  # the title is all used
        path = tmp_path / name
        lines = path.read_text().splitlines()
        for row in range(first, len(lines)):
            padded = lines[row].ljust(90)
            lines[row] = "".join(padded[c - 1] if c in columns else "#" for c in range(1, 91))
        path.write_text("\n".join(lines))
    again = read_project(tmp_path)
    assert again.messages == []
    for name in ("common", "cameras", "frames", "ground"):
        assert getattr(again, name) == getattr(project, name)


@pytest.mark.giant("2.1", "2A4: names are compared exactly")
def test_section_2_1_names_differ_by_case_and_by_blanks_inside():
    names = ["a", "A", "A B", "AB", "A  B", "01", "1", "12345678"]
    points = parse_ground(source(*names), geographic=False)
    assert [point.name for point in points] == names
    assert parse_name("123456789"[:8]) == "12345678"


# COMMON


@pytest.mark.parametrize(
    ("column", "text", "attribute", "value"),
    [
        pytest.param(1, "1", "geographic", True, marks=pytest.mark.giant("2.2", "column 1: object space")),
        pytest.param(
            2,
            "1",
            "photo_to_ground",
            False,
            marks=pytest.mark.giant("2.2", "column 2: rotations, input and output"),
        ),
        pytest.param(
            3,
            "1",
            "list_input_stations",
            False,
            marks=pytest.mark.giant("2.2", "column 3: list input camera stations"),
        ),
        pytest.param(
            4,
            "1",
            "list_input_images",
            False,
            marks=pytest.mark.giant("2.2", "column 4: list input plate coordinates"),
        ),
        pytest.param(
            5,
            "1",
            "list_input_control",
            False,
            marks=pytest.mark.giant("2.2", "column 5: list input ground control"),
        ),
        pytest.param(
            6,
            "1",
            "list_points",
            False,
            marks=pytest.mark.giant("2.2", "column 6: list triangulated ground points"),
        ),
        pytest.param(
            7,
            "1",
            "save_points",
            False,
            marks=pytest.mark.giant("2.2", "column 7: save triangulated ground points"),
        ),
        pytest.param(
            8,
            "1",
            "list_stations",
            False,
            marks=pytest.mark.giant("2.2", "column 8: list adjusted camera stations"),
        ),
        pytest.param(
            9, "1", "save_stations", False, marks=pytest.mark.giant("2.2", "column 9: save adjusted stations")
        ),
        pytest.param(
            10, "1", "intersection_only", True, marks=pytest.mark.giant("2.2", "column 10: process")
        ),
        pytest.param(
            11, "1", "error_propagation", True, marks=pytest.mark.giant("2.2", "column 11: error propagation")
        ),
        pytest.param(
            12,
            "1",
            "unit_variance",
            "constrained",
            marks=pytest.mark.giant("2.2", "column 12: unit variance"),
        ),
        pytest.param(
            12, "2", "unit_variance", "unity", marks=pytest.mark.giant("2.2", "column 12: unit variance")
        ),
        pytest.param(
            13, "1", "sort_points", False, marks=pytest.mark.giant("2.2", "column 13: sort ground points")
        ),
        pytest.param(
            14, "9", "max_iterations", 9, marks=pytest.mark.giant("2.2", "column 14: maximum iterations")
        ),
        pytest.param(
            15,
            "*",
            "strip",
            "*",
            marks=pytest.mark.giant("2.2", "column 15: leading character stripped from names"),
        ),
        pytest.param(
            16,
            "1",
            "air_refraction",
            True,
            marks=[
                pytest.mark.giant("2.2", "column 16: air refraction"),
                pytest.mark.giant("14", "1 columns 16 and 17: 1 applies refraction"),
            ],
        ),
        pytest.param(
            17,
            "1",
            "water_refraction",
            True,
            marks=[
                pytest.mark.giant("2.2", "column 17: water refraction"),
                pytest.mark.giant("14", "1 columns 16 and 17: 1 applies refraction"),
            ],
        ),
        pytest.param(
            18,
            "12",
            "convergence_percent",
            12,
            marks=pytest.mark.giant("2.2", "columns 18-19: convergence criterion"),
        ),
        pytest.param(
            31,
            "      -1.5",
            "water_level",
            -1.5,
            marks=pytest.mark.giant("2.2", "columns 31-40: water level"),
        ),
        pytest.param(
            31, "      1500", "water_level", 1.5, marks=pytest.mark.giant("2.2", "columns 31-40: water level")
        ),
        pytest.param(
            41,
            "     0.010",
            "residual_limit",
            0.01,
            marks=pytest.mark.giant("2.2", "columns 41-50: residual listing limit"),
        ),
        pytest.param(
            41,
            "        -1",
            "residual_limit",
            -0.001,
            marks=pytest.mark.giant("2.2", "columns 41-50: residual listing limit"),
        ),
        pytest.param(
            51,
            "6378137.00",
            "semi_major",
            6378137.0,
            marks=pytest.mark.giant("2.2", "columns 51-60: semi-major axis"),
        ),
        pytest.param(
            51,
            " 637813700",
            "semi_major",
            6378137.0,
            marks=pytest.mark.giant("2.2", "columns 51-60: semi-major axis"),
        ),
        pytest.param(
            61,
            "6356752.31",
            "semi_minor",
            6356752.31,
            marks=pytest.mark.giant("2.2", "columns 61-70: semi-minor axis"),
        ),
    ],
)
def test_section_2_2_columns_of_the_job(column, text, attribute, value):
    blank = parse_common(source("T", ""))
    assert blank == Common(title="T")  # the defaults
    job = f"{'':{column - 1}}{text}"
    common = parse_common(source("T", job))
    assert getattr(blank, attribute) != value
    assert common == dataclasses.replace(blank, **{attribute: value})
    assert parse_common(source(*common_records(common))) == common


@pytest.mark.giant("2.2", "column 14: maximum iterations")
@pytest.mark.giant("2.2", "columns 18-19: convergence criterion")
@pytest.mark.giant("2.2", "column 12: unit variance")
@pytest.mark.giant("14", "3 E blank or 0: 5; nothing to compare in iteration 1")
def test_section_2_2_zero_is_the_default():
    zero = parse_common(source("T", "0" * 14 + " " + "0" * 4))
    assert (zero.max_iterations, zero.convergence_percent, zero.unit_variance) == (4, 5, "free")
    axes = parse_common(source("T", f"{'':50}{'0.00':>10}{'':10}"))
    assert (axes.semi_major, axes.semi_minor) == (6378206.4, 6356583.8)


@pytest.mark.parametrize("column", [*range(1, 14), 16, 17])
def test_digits_out_of_range_name_their_column(column):
    largest = 9 if column == 14 else 2 if column == 12 else 1
    for text in ("x", "-", str(largest + 1) if largest < 9 else "x"):
        with pytest.raises(InputError, match=f"columns? {column}") as caught:
            parse_common(source("T", f"{'':{column - 1}}{text}"))
        assert caught.value.record == 2


@pytest.mark.giant("2.2", "the axes fix the linear unit of the job")
def test_section_2_2_axes_in_feet(tmp_path):
    for a, b, unit in (("20925832.2", "20854892.0", "ft"), ("6378206.40", "6356583.80", "m")):
        job = f"1{'':49}{a:>10}{b:>10}"
        records = ["A       ", "A       "]
        project = read_project(write_files(tmp_path, COMMON=["T", job], FRAMES=records, GROUND=[]))
        block = project.to_block()
        assert (block.linear_unit, block.spheroid.a, block.spheroid.b) == (unit, float(a), float(b))


@pytest.mark.giant("2.2", "record 3, columns 1-10: standard deviation of X or longitude of control")
@pytest.mark.giant("2.2", "record 3, columns 11-20: standard deviation of Y or latitude of control")
@pytest.mark.giant("2.2", "record 3, columns 21-30: standard deviation of Z or height of control")
@pytest.mark.giant("2.6", "defaults of record 3 of COMMON override")
@SPACES
@pytest.mark.parametrize("component", range(3))
def test_section_2_2_record_3_replaces_defaults_of_control(component, geographic):
    job = str(int(geographic))
    common = parse_common(source("T", job, f"{'':{10 * component}}{'0.500':>10}"))
    angle = geographic and component < 2
    expected = [0.01 * ARCSEC, 0.01 * ARCSEC, 1.0] if geographic else [1.0, 1.0, 1.0]
    expected[component] = 0.5 * ARCSEC if angle else 0.5
    assert common.default_control_sd == pytest.approx(expected, rel=1e-15)
    point_sd = block_of(geographic, common=common, ground=["P"]).point_sd[0]
    assert point_sd == pytest.approx(expected, rel=1e-15)
    assert parse_common(source(*common_records(common))).control_sd == common.control_sd


def block_of(geographic, common=None, frames=("A", "A"), ground=()):
    """Return the block of one frame and one point P."""
    return Project(
        common=common or Common(geographic=geographic),
        cameras=[Camera("", -150.0)],
        frames=parse_frames(source(*frames), geographic),
        images=[ImageFrame("A", ["P"], np.array([[1.0, 2.0]]))],
        ground=parse_ground(source(*ground), geographic),
    ).to_block()


# CAMERAS and IMAGES


@pytest.mark.giant("2.3", "columns 1-8: name")
@pytest.mark.giant("2.3", "columns 11-20: principal distance, signed")
@pytest.mark.parametrize(
    ("text", "value"), [("   -152740", -152.74), (" 88.512   ", 88.512), ("-152.74056", -152.74056)]
)
def test_section_2_3_name_and_principal_distance(text, value):
    (camera,) = parse_cameras(source(f"12345678##{text}##"))
    assert (camera.name, camera.principal_distance) == ("12345678", value)


@pytest.mark.parametrize(
    ("column", "text", "attribute", "value"),
    [
        pytest.param(
            1,
            "12345678",
            "name",
            "12345678",
            marks=pytest.mark.giant("2.4", "header, columns 1-8: frame name"),
        ),
        pytest.param(
            11,
            "     88500",
            "principal_distance",
            88.5,
            marks=pytest.mark.giant("2.4", "header, columns 11-20: principal distance, blank: from CAMERAS"),
        ),
        pytest.param(
            21,
            "     0.006",
            "sd",
            (0.006, 0.0),
            marks=pytest.mark.giant(
                "2.4", "header, columns 21-30: standard deviation of x, default 0.010 mm"
            ),
        ),
        pytest.param(
            31,
            "         6",
            "sd",
            (0.0, 0.006),
            marks=pytest.mark.giant(
                "2.4", "header, columns 31-40: standard deviation of y, default 0.010 mm"
            ),
        ),
        pytest.param(
            41,
            "F1982  B",
            "camera",
            "F1982  B",
            marks=pytest.mark.giant("2.4", "header, columns 41-48: camera name"),
        ),
    ],
)
def test_section_2_4_columns_of_a_header(column, text, attribute, value):
    (blank,) = parse_images(source("A", "****"))
    (frame,) = parse_images(source(at(column, text), "****"))
    assert getattr(blank, attribute) != value
    assert getattr(frame, attribute) == value
    for other in {"name", "principal_distance", "sd", "camera"} - {attribute}:
        assert getattr(frame, other) == getattr(blank, other)


@pytest.mark.giant("2.4", "point, columns 1-8: name")
@pytest.mark.giant("2.4", "point, columns 11-20: x")
@pytest.mark.giant("2.4", "point, columns 21-30: y")
@pytest.mark.giant("2.4", "terminator: **** in columns 1-4")
def test_section_2_4_columns_of_a_point():
    (frame,) = parse_images(source("A", "12345678##    -86807  106.9160####", "****XX"))
    assert frame.points == ["12345678"]
    assert frame.xy.tolist() == [[-86.807, 106.916]]


# FRAMES


@SPACES
@pytest.mark.parametrize(
    ("record", "column", "attribute", "component"),
    [
        pytest.param(
            0, 9, "position", 0, marks=pytest.mark.giant("2.5", "record 1, columns 9-20: X or longitude")
        ),
        pytest.param(
            0, 21, "position", 1, marks=pytest.mark.giant("2.5", "record 1, columns 21-32: Y or latitude")
        ),
        pytest.param(
            0,
            33,
            "position",
            2,
            marks=[
                pytest.mark.giant("2.5", "record 1, columns 33-44: Z or height"),
                pytest.mark.giant("14", "15 heights are linear"),
            ],
        ),
        pytest.param(
            0,
            45,
            "position_sd",
            0,
            marks=pytest.mark.giant(
                "2.5",
                "record 1, columns 45-54: standard deviation of X, 60000 units, or longitude, 10 arcmin",
            ),
        ),
        pytest.param(
            0,
            55,
            "position_sd",
            1,
            marks=pytest.mark.giant(
                "2.5", "record 1, columns 55-64: standard deviation of Y, 60000 units, or latitude, 10 arcmin"
            ),
        ),
        pytest.param(
            0,
            65,
            "position_sd",
            2,
            marks=pytest.mark.giant(
                "2.5", "record 1, columns 65-74: standard deviation of Z or height, 60000 units"
            ),
        ),
        pytest.param(1, 9, "attitude", 0, marks=pytest.mark.giant("2.5", "record 2, columns 9-20: omega")),
        pytest.param(1, 21, "attitude", 1, marks=pytest.mark.giant("2.5", "record 2, columns 21-32: phi")),
        pytest.param(1, 33, "attitude", 2, marks=pytest.mark.giant("2.5", "record 2, columns 33-44: kappa")),
        pytest.param(
            1,
            45,
            "attitude_sd",
            0,
            marks=pytest.mark.giant(
                "2.5", "record 2, columns 45-54: standard deviation of omega, 90 degrees"
            ),
        ),
        pytest.param(
            1,
            55,
            "attitude_sd",
            1,
            marks=pytest.mark.giant("2.5", "record 2, columns 55-64: standard deviation of phi, 90 degrees"),
        ),
        pytest.param(
            1,
            65,
            "attitude_sd",
            2,
            marks=[
                pytest.mark.giant("2.5", "record 2, columns 65-74: standard deviation of kappa, 90 degrees"),
                pytest.mark.giant("14", "10 default of the standard deviation of kappa: 90 degrees"),
            ],
        ),
    ],
)
def test_section_2_5_columns_of_a_station(record, column, attribute, component, geographic):
    width = 10 if attribute.endswith("_sd") else 12
    records = ["A", "A"]
    records[record] = at(column, "12345".rjust(width))  # three implied decimals: 12.345
    (frame,) = parse_frames(source(*records), geographic)
    angle = attribute.startswith("attitude") or (geographic and component < 2)
    assert getattr(frame, attribute)[component] == pytest.approx(12.345 * (ARCSEC if angle else 1), rel=1e-15)
    (blank,) = parse_frames(source("A", "A"), geographic)
    values = list(getattr(blank, attribute))
    values[component] = getattr(frame, attribute)[component]
    assert frame == dataclasses.replace(blank, **{attribute: tuple(values)})
    assert parse_frames(source(*frame_records([frame], geographic)), geographic) == [frame]
    if attribute.endswith("_sd"):
        default = {
            "position_sd": Common(geographic=geographic).default_station_sd,
            "attitude_sd": [math.pi / 2] * 3,
        }
        expected = list(default[attribute])
        assert getattr(block_of(geographic), f"photo_{attribute}")[0] == pytest.approx(expected, rel=1e-15)
        expected[component] = values[component]
        given = getattr(block_of(geographic, frames=records), f"photo_{attribute}")[0]
        assert given == pytest.approx(expected, rel=1e-15)


@pytest.mark.giant("2.5", "record 1, columns 1-8: frame name")
@pytest.mark.giant("2.5", "record 2, columns 1-8: frame name")
def test_section_2_5_both_records_have_the_name():
    frames = parse_frames(source(*["12345678"] * 2, *["SH 9960"] * 2), geographic=False)
    assert [frame.name for frame in frames] == ["12345678", "SH 9960"]
    with pytest.raises(InputError, match=r"second record \(attitude\) of the frame '12345678'"):
        parse_frames(source("12345678", "1234567"), geographic=False)


# GROUND


@SPACES
@pytest.mark.parametrize(
    ("column", "attribute", "component"),
    [
        pytest.param(9, "position", 0, marks=pytest.mark.giant("2.6", "columns 9-20: X or longitude")),
        pytest.param(21, "position", 1, marks=pytest.mark.giant("2.6", "columns 21-32: Y or latitude")),
        pytest.param(
            33,
            "position",
            2,
            marks=[
                pytest.mark.giant("2.6", "columns 33-44: Z or height"),
                pytest.mark.giant("14", "15 heights are linear"),
            ],
        ),
        pytest.param(
            45,
            "sd",
            0,
            marks=pytest.mark.giant(
                "2.6", "columns 45-54: standard deviation of X, 1.0 unit, or longitude, 0.01 arcsec"
            ),
        ),
        pytest.param(
            55,
            "sd",
            1,
            marks=pytest.mark.giant(
                "2.6", "columns 55-64: standard deviation of Y, 1.0 unit, or latitude, 0.01 arcsec"
            ),
        ),
        pytest.param(
            65,
            "sd",
            2,
            marks=pytest.mark.giant("2.6", "columns 65-74: standard deviation of Z or height, 1.0 unit"),
        ),
    ],
)
def test_section_2_6_columns_of_a_point(column, attribute, component, geographic):
    record = at(column, "12345".rjust(12 if attribute == "position" else 10), name="P")
    (point,) = parse_ground(source(record), geographic)
    value = 12.345 * (ARCSEC if geographic and component < 2 else 1)
    expected = [0.0, 0.0, 0.0]
    expected[component] = value
    assert getattr(point, attribute) == pytest.approx(expected, rel=1e-15)
    assert parse_ground(source(*ground_records([point], geographic)), geographic) == [point]
    defaults = [0.01 * ARCSEC, 0.01 * ARCSEC, 1.0] if geographic else [1.0] * 3
    assert block_of(geographic, ground=["P"]).point_sd[0] == pytest.approx(defaults, rel=1e-15)
    if attribute == "sd":
        defaults[component] = value
        assert block_of(geographic, ground=[record]).point_sd[0] == pytest.approx(defaults, rel=1e-15)


@pytest.mark.giant("2.6", "columns 1-8: name")
def test_section_2_6_names():
    points = parse_ground(source("12345678", "SH 9448", " 126!"), geographic=False)
    assert [point.name for point in points] == ["12345678", "SH 9448", "126!"]


@pytest.mark.giant("2.6", "column 80: missing-component code")
@pytest.mark.parametrize(
    ("code", "held"),
    [
        pytest.param(0, (True, True, True), marks=pytest.mark.giant("2.6", "code 0: full control")),
        pytest.param(
            1, (False, True, True), marks=pytest.mark.giant("2.6", "code 1: primary component ignored")
        ),
        pytest.param(
            2, (True, False, True), marks=pytest.mark.giant("2.6", "code 2: secondary component ignored")
        ),
        pytest.param(3, (False, False, True), marks=pytest.mark.giant("2.6", "code 3: vertical control")),
        pytest.param(4, (True, True, False), marks=pytest.mark.giant("2.6", "code 4: planimetric control")),
        pytest.param(
            5, (False, True, False), marks=pytest.mark.giant("2.6", "code 5: secondary component only")
        ),
        pytest.param(
            6, (True, False, False), marks=pytest.mark.giant("2.6", "code 6: primary component only")
        ),
        pytest.param(7, (False, False, False), marks=pytest.mark.giant("2.6", "code 7: pure check point")),
    ],
)
def test_section_2_6_type_codes(code, held):
    record = f"{'P':8}{'1.':>12}{'2.':>12}{'3.':>12}".ljust(79) + str(code)
    (point,) = parse_ground(source(record), geographic=False)
    assert (point.type_code, point.held) == (code, held)
    block = block_of(geographic=False, ground=[record])
    assert np.isfinite(block.point_sd[0]).tolist() == list(held)
    # Values of components that are not held are kept for comparison.
    assert block.point_positions[0].tolist() == [1, 2, 3]
    assert parse_ground(source(*ground_records([point], False)), geographic=False) == [point]
