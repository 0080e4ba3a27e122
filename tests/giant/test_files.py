"""The five files record by record: GIANT guide, section II.B; specification 2.2 to 2.6."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from small_project import FRAMES, GROUND, IMAGES, ground_record, replaced

from photogram import InputError
from photogram.giant import Common
from photogram.giant.common import common_records, parse_common
from photogram.giant.contents import (
    camera_records,
    frame_records,
    ground_records,
    image_records,
    parse_cameras,
    parse_frames,
    parse_ground,
    parse_images,
)
from photogram.giant.records import Source

SAMPLE = json.loads((Path(__file__).parents[1] / "data" / "giant" / "sample_records.json").read_text())
ARCSEC = math.radians(1 / 3600)


def source(*lines, strip=""):
    return Source(Path("FILE"), list(lines), strip=strip)


# The sample of the report


@pytest.mark.giant("2.2", "record 1: title")
def test_section_2_2_common_of_the_report():
    common = parse_common(source(*SAMPLE["COMMON"]))
    assert common.title.startswith("SAMPLE RUN FOR NOAA/NOS GIANT PROGRAM")
    assert common.geographic
    assert common.photo_to_ground
    assert (common.max_iterations, common.strip, common.convergence_percent) == (4, "0", 5)
    assert common.air_refraction
    assert common.water_refraction
    assert (common.semi_major, common.semi_minor) == (6378206.4, 6356583.8)
    assert common.control_sd == pytest.approx((0.001 * ARCSEC, 0.001 * ARCSEC, 0.01), rel=1e-15)
    assert parse_common(source(*common_records(common))) == common


@pytest.mark.giant("2.3", "columns 11-20: principal distance, signed")
def test_section_2_3_cameras_of_the_report():
    (camera,) = parse_cameras(source(*SAMPLE["CAMERAS"]))
    assert (camera.name, camera.principal_distance) == ("F1982", -152.74)


def test_frames_of_the_report():
    (frame,) = parse_frames(source(*SAMPLE["FRAMES"]), geographic=True)
    assert frame.name == "SH9960"
    assert frame.position == pytest.approx(
        (math.radians(-94.98465583333333), math.radians(29.65493444444444), 4556.59)
    )
    assert np.degrees(frame.attitude) == pytest.approx(
        [-0.69172944444, -0.17658472222, 236.7512975], abs=1e-11
    )
    assert frame.position_sd == frame.attitude_sd == (0, 0, 0)


@pytest.mark.giant("2.4", "terminator: **** in columns 1-4")
@pytest.mark.giant("2.4", "point, columns 1-8: name")
def test_section_2_4_images_of_the_report():
    (frame,) = parse_images(source(*SAMPLE["IMAGES"]))
    assert (frame.name, frame.camera, frame.principal_distance, frame.sd) == ("SH9961", "F1982", 0, (0, 0))
    assert frame.points == ["60!", "69!", "SH960801", "126!", "59!"]
    assert frame.xy.tolist() == [
        [-86.807, 106.916],
        [-77.273, 95.902],
        [-49.241, 48.405],
        [-46.485, 2.046],
        [-103.504, -75.317],
    ]


def test_ground_of_the_report():
    points = parse_ground(source(*SAMPLE["GROUND"]), geographic=True)
    assert [point.name for point in points] == ["SH944801", "SH968201", "SH968202"]
    assert [point.held for point in points] == [
        (True, True, False),
        (False, False, True),
        (False, False, True),
    ]
    assert math.degrees(points[0].position[0]) == pytest.approx(-(95 + 5 / 60 + 16.041 / 3600), abs=1e-12)
    assert points[1].position == (0, 0, 10.973)


# COMMON


def test_a_blank_job_record_is_all_defaults():
    assert parse_common(source("T", "")) == Common(title="T")
    assert Common().default_station_sd == (60000, 60000, 60000)
    assert Common().default_control_sd == (1, 1, 1)


def test_defaults_of_geographic_space():
    common = parse_common(source("T", "1", f"{'':10}{'0.5':>10}"))
    assert common.default_station_sd == pytest.approx((600 * ARCSEC, 600 * ARCSEC, 60000))
    assert common.default_control_sd == pytest.approx((0.01 * ARCSEC, 0.5 * ARCSEC, 1))


def test_every_column_of_the_job_record():
    job = f"11111111111113011{' 9'}{'':11}{'12.5':>10}{'-1':>10}{'637813700':>10}{'6356752.31':>10}"
    common = parse_common(source("T", job))
    assert common == Common(
        title="T",
        geographic=True,
        photo_to_ground=False,
        list_input_stations=False,
        list_input_images=False,
        list_input_control=False,
        list_points=False,
        save_points=False,
        list_stations=False,
        save_stations=False,
        intersection_only=True,
        error_propagation=True,
        unit_variance="constrained",
        sort_points=False,
        max_iterations=3,
        strip="0",
        air_refraction=True,
        water_refraction=True,
        convergence_percent=9,
        water_level=12.5,
        residual_limit=-0.001,
        semi_major=6378137.0,
        semi_minor=6356752.31,
    )
    assert parse_common(source(*common_records(common))) == common


@pytest.mark.parametrize(
    ("job", "why"),
    [
        ("2", "column 1: .* got 2"),
        ("x", r"columns 1-1 \(whole number\)"),
        ("000000000003", "column 12: .* got 3"),
        ("00000000000000 00-1", "columns 18-19"),
        (f"{'':50}{'1.0':>10}{'2.0':>10}", "semi-minor"),
        (f"{'':30}{'NaN':>10}", r"columns 31-40 \(F10.3\): must be a number, got '       NaN'"),
    ],
)
def test_bad_job_records(job, why):
    with pytest.raises(InputError, match=why) as caught:
        parse_common(source("T", job))
    assert (caught.value.file, caught.value.record, caught.value.text) == (Path("FILE"), 2, job)


@pytest.mark.giant("2.2", "record 3 is optional")
def test_section_2_2_common_is_too_short_or_too_long():
    with pytest.raises(InputError, check=lambda error: error.code == "giant.two-records"):
        parse_common(source("T"))
    long = source("T", "", "", "MORE")
    parse_common(long)
    assert [(message.record, message.record_text) for message in long.messages] == [(4, "MORE")]


# Names


@pytest.mark.giant("2.1", "names: the leading character of COMMON column 15 is removed in all files")
def test_section_2_1_leading_characters_are_stripped_in_every_file():
    (camera,) = parse_cameras(source("00CAM     -152740", strip="0"))
    images = parse_images(
        source(f"{'00A':40}00CAM", f"{'000126!':10}{'1.':>10}{'2.':>10}", "****", strip="0")
    )
    frames = parse_frames(source("00A", "00A", strip="0"), geographic=False)
    points = parse_ground(source("000126!", strip="0"), geographic=False)
    assert camera.name == images[0].camera == "CAM"
    assert images[0].name == frames[0].name == "A"
    assert images[0].points == [points[0].name] == ["126!"]


@pytest.mark.giant("14", "13 stripping: left-justified, one character is kept, collisions are errors")
@pytest.mark.parametrize("strip", ["0", ""])
def test_section_14_two_spellings_of_one_name_are_refused(strip):
    first, second = ("012", "12") if strip else (" 12", "12")
    header, end = ["A"], ["****"]
    image = "{:10}" + f"{'1.':>10}{'2.':>10}"
    for parse in (
        lambda: parse_ground(source(first, second, strip=strip), geographic=False),
        lambda: parse_cameras(source(f"{first:10}{'1.':>10}", f"{second:10}{'1.':>10}", strip=strip)),
        lambda: parse_frames(source(first, first, second, second, strip=strip), geographic=False),
        lambda: parse_images(source(first, *end, second, *end, strip=strip)),
        lambda: parse_images(
            source(*header, image.format(first), *end, "B", image.format(second), *end, strip=strip)
        ),
    ):
        with pytest.raises(InputError, match="both become '12'") as caught:
            parse()
        assert caught.value.text.startswith("12")


# CAMERAS


@pytest.mark.parametrize(
    ("records", "why"),
    [
        (["A         -152740", "A         -153000"], "already defined in record 1"),
        (["A         -152740", "B"], "requires a principal distance"),
        (["A         -152740", "B         -15O740"], r"columns 11-20 \(F10.3\)"),
    ],
)
def test_bad_cameras(records, why):
    with pytest.raises(InputError, match=why) as caught:
        parse_cameras(source(*records))
    assert (caught.value.record, caught.value.text) == (2, records[1])


@pytest.mark.giant("2.3", "columns 1-8: a single camera may be without a name")
def test_section_2_3_a_blank_camera_name_is_a_name():
    cameras = parse_cameras(source("", "           -123.9392"))
    assert [(camera.name, camera.principal_distance) for camera in cameras] == [("", -123.9392)]
    assert parse_cameras(source(*camera_records(cameras))) == cameras


# FRAMES


@pytest.mark.giant("2.5", "the order of the frames is kept")
def test_section_2_5_frames_keep_their_order_and_round_trip():
    frames = parse_frames(source(*FRAMES[2:], *FRAMES[:2]), geographic=False)
    assert [frame.name for frame in frames] == ["B", "A"]
    assert frames[0].position_sd == (5, 6, 0)
    assert frames[0].attitude_sd == pytest.approx((0, 0, 1800 * ARCSEC))
    assert parse_frames(source(*frame_records(frames, False)), geographic=False) == frames


@pytest.mark.parametrize(
    ("records", "number", "why"),
    [
        (replaced(FRAMES, 2, FRAMES[3]), 2, "second record .* of the frame 'A'"),
        (FRAMES[:3], 3, "second record .* of the frame 'B'"),
        ([*FRAMES, *FRAMES[:2]], 5, "'A' is already listed in record 1"),
        (["", FRAMES[0].replace("A", " ")], 2, "requires a name"),
        (replaced(FRAMES, 1, FRAMES[0].replace("100.000", "1OO.000")), 1, r"columns 9-20 \(F12.3\)"),
        (
            replaced(FRAMES, 2, FRAMES[1].replace("900000", "906100")),
            2,
            r"columns 33-44 \(DMS\): \*\*ILLEGAL DMS FIELD",
        ),
        (replaced(FRAMES, 3, FRAMES[2].replace("  5.000", " -5.000")), 3, "columns 45-54: .* negative"),
    ],
)
def test_bad_frames(records, number, why):
    with pytest.raises(InputError, match=why) as caught:
        parse_frames(source(*records), geographic=False)
    assert (caught.value.file, caught.value.record, caught.value.text) == (
        Path("FILE"),
        number,
        records[number - 1],
    )


def test_latitudes_end_at_the_poles():
    with pytest.raises(InputError, check=lambda error: error.code == "giant.latitude"):
        parse_frames(source(f"{'A':20}{'900000.001':>12}", "A"), geographic=True)
    (frame,) = parse_frames(source(f"{'A':20}{'-900000.000':>12}", "A"), geographic=True)
    assert frame.position[1] == pytest.approx(-math.pi / 2)


@pytest.mark.giant("14", "11 60 minutes or seconds pass with a warning")
def test_section_14_sixty_minutes_are_remarked_on():
    file = source("A", f"{'A':8}{'6000.':>12}")
    parse_frames(file, geographic=False)
    assert [(message.record, message.record_text) for message in file.messages] == [(2, file.lines[1])]
    assert "60 minutes or 60 seconds" in str(file.messages[0])


# IMAGES


def test_images_round_trip():
    frames = parse_images(source(*IMAGES))
    again = parse_images(source(*image_records(frames)))
    for one, other in zip(frames, again, strict=True):
        assert (one.name, one.points, one.sd, one.camera) == (
            other.name,
            other.points,
            other.sd,
            other.camera,
        )
        assert one.xy.tolist() == other.xy.tolist()
    assert frames[1].sd == (0.006, 0.008)
    assert frames[1].point_record(2).text == IMAGES[8]


def test_blank_records_are_no_records():
    spaced = [line for record in IMAGES for line in ("", record, "   ")]
    one, other = parse_images(source(*IMAGES)), parse_images(source(*spaced))
    assert [frame.points for frame in one] == [frame.points for frame in other]
    assert other[1].point_record(0).text == IMAGES[6]
    assert parse_images(source("", "  ")) == []


@pytest.mark.parametrize(
    ("field", "value"),
    [("1", 0.001), ("1 2", 0.012), ("1.5E1", 15), ("+.5", 0.5), ("-5.", -5), ("  -99999  ", -99.999)],
)
def test_odd_but_legal_coordinates(field, value):
    (frame,) = parse_images(source("A", f"{'P':10}{field:>10}{'1.0':>10}", "****"))
    assert frame.xy.tolist() == [[value, 1.0]]


@pytest.mark.giant("2.1", "blanks inside a number are ignored, with a remark")
def test_section_2_1_blanks_inside_numbers_are_remarked_on():
    file = source("A", f"{'P':10}{'- 1.5':>10}{'1.0':>10}", "****")
    (frame,) = parse_images(file)
    assert frame.xy.tolist() == [[-1.5, 1.0]]
    assert [(message.record, message.record_text) for message in file.messages] == [(2, file.lines[1])]


@pytest.mark.giant("2.1", "read errors name record number and record")
@pytest.mark.parametrize("field", ["nan", "-inf", "1.2.3", "1-", "--1", "1_0", "0x10", "1,5", "½", "-", "."])
def test_section_2_1_unreadable_coordinates_name_file_record_and_text(field):
    records = replaced(IMAGES, 7, f"{'3':10}{'1.0':>10}{field:>10}")
    with pytest.raises(InputError, match="must be a number") as caught:
        parse_images(source(*records))
    assert (caught.value.file, caught.value.record, caught.value.text) == (Path("FILE"), 7, records[6])
    assert str(caught.value).startswith("FILE, record 7: columns 21-30 (F10.3)")
    assert str(caught.value).endswith(f"|{records[6]}|")


@pytest.mark.parametrize(
    ("records", "number", "why"),
    [
        (IMAGES[:-1], 9, r"the frame 'B' \(record 6\) requires a terminator"),
        (IMAGES[:6], 6, r"the frame 'B' \(record 6\) requires a terminator"),
        ([*IMAGES[:4], *IMAGES[5:]], 5, r"must have coordinates.* terminator"),
        ([*IMAGES[:4], f"{'B':20}{'0.0060':>10}{'0.0080':>10}", *IMAGES[6:]], 5, "terminator"),
        (["****", *IMAGES], 1, "requires the header"),
        (replaced(IMAGES, 2, IMAGES[1].replace("1 ", "  ", 1)), 2, "the point requires a name"),
        (replaced(IMAGES, 6, IMAGES[5].replace("B", " ", 1)), 6, "the frame requires a name"),
        (replaced(IMAGES, 6, IMAGES[5].replace("0.0060", "-.0060")), 6, "negative"),
    ],
)
def test_bad_images(records, number, why):
    with pytest.raises(InputError, match=why) as caught:
        parse_images(source(*records))
    assert (caught.value.record, caught.value.text) == (number, records[number - 1])


# GROUND


def test_ground_round_trips():
    points = parse_ground(source(*GROUND), geographic=False)
    assert [point.type_code for point in points] == [0, 3, 7]
    assert points[1].sd == (0, 0, 0.04)
    assert parse_ground(source(*ground_records(points, False)), geographic=False) == points


@pytest.mark.giant("6", "duplicate control records keep the first")
def test_section_6_of_duplicate_control_the_first_is_kept():
    file = source(*GROUND, ground_record("1", "0.", "0.", "0."))
    points = parse_ground(file, geographic=False)
    assert [point.name for point in points] == ["1", "2", "3"]
    assert points[0].position == (110, 210, 10)
    (message,) = file.messages
    assert (message.file, message.record, message.record_text) == (Path("FILE"), 4, file.lines[3])
    assert message.code == "giant.control-repeated"


def test_a_blank_component_that_is_held_is_remarked_on():
    file = source(ground_record("1", "", "2.", "3."))
    (point,) = parse_ground(file, geographic=False)
    assert point.position == (0, 2, 3)
    assert file.messages[0].code == "giant.blank-component"


@pytest.mark.parametrize(
    ("record", "why"),
    [
        (ground_record("1", "1.", "2.", "3.", code="8"), "column 80: must be 0 to 7, got 8"),
        (ground_record("1", "1.", "2.", "3.", code="x"), "columns 80-80"),
        (ground_record("", "1.", "2.", "3."), "requires a name"),
        (ground_record("1", "1.", "2.", "nan"), r"columns 33-44 \(F12.3\)"),
        (ground_record("1", "1.", "2.", "3.", "", "-1."), "columns 55-64: .* negative"),
    ],
)
def test_bad_ground(record, why):
    with pytest.raises(InputError, match=why) as caught:
        parse_ground(source(GROUND[1], record), geographic=False)
    assert (caught.value.record, caught.value.text) == (2, record)


# Text files


@pytest.mark.giant("2.1", "fixed records of 80 columns, counted from 1")
def test_section_2_1_any_line_ends_and_the_columns_after_80(tmp_path):
    path = tmp_path / "GROUND"
    path.write_bytes(b"\xef\xbb\xbfA\r\nB\rC" + b" " * 79 + b"comment\n\x1a")
    assert Source.read(path).lines == ["A", "B", "C" + " " * 79]


def test_latin_letters_keep_their_columns(tmp_path):
    path = tmp_path / "CAMERAS"
    for encoding in ("utf-8", "latin-1"):
        path.write_bytes("Höhe      -152740\n".encode(encoding))
        (camera,) = parse_cameras(Source.read(path))
        assert (camera.name, camera.principal_distance) == ("Höhe", -152.74)


@pytest.mark.parametrize("character", ["\t", "\0", "\x0b", "\x7f"])
def test_control_characters_are_refused(tmp_path, character):
    path = tmp_path / "CAMERAS"
    path.write_text(f"A         -152740\nB{character}        -152740\n")
    with pytest.raises(InputError, match="printable characters only") as caught:
        Source.read(path)
    assert (caught.value.file, caught.value.record) == (path, 2)


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        Source.read(tmp_path / "nothing")
