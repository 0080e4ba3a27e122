"""The pages of the sample printout (GIANT guide, section II.C): its figures through the page writers.

Expected lines are those of the guide as far as they are legible, with the digits that `tests/data/giant` has
secured. Blanks are compared as one: the scan has lost the columns.
"""

from __future__ import annotations

import csv
import difflib
import json
import re
from pathlib import Path

import numpy as np
import pytest

from photogram import Iteration
from photogram.giant import Common, ErrorWarning, GroundPoint, ImageFrame
from photogram.giant.fields import printed_order
from photogram.giant.printout.forms import Space, matrix_rows, printout
from photogram.giant.printout.listing import control_pages, frame_pages, options_page, warning_pages
from photogram.giant.printout.results import (
    correction_pages,
    iteration_pages,
    point_pages,
    propagated_point_pages,
    residual_pages,
    station_pages,
    statistics,
)
from photogram.results.parts import SumsByKind

DATA = Path(__file__).parents[1] / "data" / "giant"
SCAN = DATA / "scanned_pages.txt"
"""Pages 41 and 53 of the guide (public domain), as its scan was read, digits wrong where it was."""
SUMMARY = json.loads((DATA / "summary.json").read_text())
GEOGRAPHIC = Space(geographic=True)
ARCSEC = np.radians(1 / 3600)


def rows(name):
    with (DATA / name).open() as stream:
        return [
            {key: "nan" if value == "null" else value for key, value in row.items()}
            for row in csv.DictReader(stream)
        ]


def radians(dms):
    """Radians of degrees, minutes and seconds; NaN where they are not legible."""
    degrees, minutes, seconds = (abs(float(part)) for part in f"{dms} 0 0".split()[:3])
    value = np.radians(degrees + minutes / 60 + seconds / 3600)
    return -value if dms.startswith("-") else value


def squeezed(pages):
    """All lines of pages without double blanks."""
    return [" ".join(line.split()) for page in pages for line in page]


def contains(pages, *expected):
    """Whether lines follow each other somewhere."""
    lines = [line for line in squeezed(pages) if line]
    return any(tuple(lines[at : at + len(expected)]) == expected for at in range(len(lines)))


# Banner and page 0


@pytest.mark.giant("10", "every page: carriage control, banner, title, number from 0")
def test_section_10_the_banner_of_a_page_begins_with_carriage_control_and_ends_with_the_number():
    text = printout(SUMMARY["title_lines"]["case1"], [[], ["A LINE"]])
    first, second, line = text.splitlines()
    assert first.startswith(
        "1NOAA/NOS GIANT SYSTEM .... (4/85) : SAMPLE RUN FOR NOAA/NOS GIANT PROGRAM ......."
    )
    assert (first.split()[-2:], second.split()[-2:], line) == (["PAGE", "0"], ["PAGE", "1"], " A LINE")


CASE_1 = Common(geographic=True, strip="0", residual_limit=0.010)
CASE_2 = Common(geographic=True, strip="0", error_propagation=True)


@pytest.mark.giant("10", "page 0: options")
def test_section_10_options_of_the_first_case():
    assert [line for line in options_page(CASE_1, GEOGRAPHIC, None) if line] == SUMMARY["case1_options"]


@pytest.mark.giant("10", "page 0: options")
def test_section_10_options_of_the_second_case():
    lines = [line for line in options_page(CASE_2, GEOGRAPHIC, None) if line]
    expected = list(SUMMARY["case1_options"])
    propagation, unit_variance, residuals = SUMMARY["case2_options_changed"]
    expected[7 - 1] = residuals
    expected[4 - 1 : 4] = [propagation, unit_variance]
    assert lines == expected


# Pages 1, 21, 24


@pytest.mark.giant("10", "page of a frame")
def test_section_10_page_of_a_frame():
    values = {row["parameter"]: float(row["value"]) for row in rows("stations_initial.csv")[:6]}
    given = [values[name] for name in ("lon", "lat", "elev", "omega", "phi", "kappa")]
    images = [row for row in rows("image_coordinates.csv") if row["frame"] == "SH9960"]
    pose = [
        [*np.radians(given[:2]), given[2]],
        np.radians(given[3:]),
        [600 * ARCSEC, 600 * ARCSEC, 60000.0],
        np.radians([90.0, 90.0, 90.0]),
    ]
    xy = np.array([[float(row["x_mm"]), float(row["y_mm"])] for row in images])
    frame = ImageFrame("SH9960", [row["point"] for row in images], xy)
    pages = frame_pages(GEOGRAPHIC, True, pose, -152.740, frame)
    assert len(pages) == 1
    assert contains(
        pages, "FRAME SH9960", "PRINCIPAL DISTANCE = -152.7400 ST. D. OF X = 0.0100 ST. D. OF Y = 0.0100"
    )
    assert contains(
        pages,
        "P O S I T I O N A T T I T U D E (PHOTO TO GROUND)",
        "LNG = - 94 59 4.7610 ST. D. = 0 10 0.0000 OMEGA = - 0 41 30.2260 ST. D. = 90 0 0.0000",
        "LAT = 29 39 17.7640 ST. D. = 0 10 0.0000 PHI = - 0 10 35.7050 ST. D. = 90 0 0.0000",
        "ELV = 4556.5900 ST. D. = 60000.0000 KAPPA = 236 45 4.6710 ST. D. = 90 0 0.0000",
    )
    # The last y of the first row is not legible.
    assert contains(
        pages,
        "ID X Y ID X Y ID X Y ID X Y",
        "60! 12.6600 107.8380 69! 21.7510 96.7880 SH960801 47.9600 49.0670 70! 39.9270",
    )


@pytest.mark.giant("10", "ground control data")
@pytest.mark.giant("10", "page lengths: 10 control points, 13 stations, 52 points or 13 with covariances")
def test_section_10_ground_control_data():
    ground = [
        GroundPoint(
            row["point"],
            (radians(row["lon_dms"]), radians(row["lat_dms"]), float(row["elev_m"])),
            (0.001 * ARCSEC, 0.001 * ARCSEC, 0.01),
            int(row["type_code"]),
        )
        for row in rows("ground_control_input.csv")
    ]
    pages = control_pages(GEOGRAPHIC, ground, (0.0, 0.0, 0.0))
    assert [sum("TYPE" in line for line in page) for page in pages] == [10, 4]
    assert contains(
        pages,
        "LNG = - 95 5 18.6140 ST. D. = 0 0 0.0010",
        "SH944802 LAT = 29 50 47.7270 ST. D. = 0 0 0.0010 TYPE = 4",
        "ELV = 2.1790 ST. D. = 0.0100",
    )


@pytest.mark.giant("10", "error warnings")
def test_section_10_error_warnings():
    warning = ErrorWarning("POINTS NOT PHOTOGRAPHED", SUMMARY["points_not_photographed"], general=True)
    pages = warning_pages([warning])
    assert contains(pages, "ERROR WARNINGS", "POINTS NOT PHOTOGRAPHED", "SH954202 SH968201")


# Pages 25 to 29


@pytest.mark.giant("10", "camera stations corrections")
@pytest.mark.giant("14", "8 units of the corrections are printed")
def test_section_10_camera_stations_corrections():
    listed = rows("iteration_corrections.csv")
    columns = ("pos1", "pos2", "pos3", "omega_rad", "phi_rad", "kappa_rad")
    corrections = np.array([[[float(row[column]) for column in columns] for row in listed]])
    iteration = Iteration(2, SUMMARY["iteration2_weighted_sum_of_squares"]["value"], 0.0, 0.0)
    pages = iteration_pages(GEOGRAPHIC, [row["frame"] for row in listed], [iteration], corrections, "")
    assert len(pages) == 1
    assert contains(
        pages,
        "C A M E R A S T A T I O N S C O R R E C T I O N S",
        "ITERATION 2",
        "POSITION (RADIANS, RADIANS, METERS), ATTITUDE (RADIANS)",
        # The third correction of the position is not legible in the sample.
        "SH9960 POSITION 0.000000000 0.000000000 ATTITUDE -0.000000137 0.000000284 -0.000000001",
        "SH9961 POSITION 0.000000000 0.000000000 ATTITUDE -0.000000123 0.000000213 0.000000013",
    )
    assert contains(pages, "PROVISIONAL WEIGHTED SUM OF SQUARES = 273.446")


@pytest.mark.giant("10", "triangulated points residuals")
def test_section_10_residuals():
    listed = [row for row in rows("plate_residuals.csv") if row["point"] == "SH954201"]
    micrometres = np.array([[float(row["vx_um"]), float(row["vy_um"])] for row in listed])
    point = ("SH954201", [row["frame"] for row in listed], micrometres / 1000)
    closing = statistics(SumsByKind(0.0, 0.8, 273.6), 298, SUMMARY["unit_variance"]["value"])
    pages = residual_pages([point], 0.010, closing)
    assert contains(
        pages, "SH954201 SH9953 SH9954", "14 -14", "-3 3", "WEIGHTED SUM OF SQUARES (CAMERA) = 0.000"
    )
    assert contains(
        pages,
        "WEIGHTED SUM OF SQUARES (GROUND) = 0.800",
        "WEIGHTED SUM OF SQUARES (PLATES) = 273.600",
        "WEIGHTED SUM OF SQUARES (TOTAL) = 274.400",
        "DEGREES OF FREEDOM...................... = 298",
        "A POSTERIORI ESTIMATES FOR UNIT WEIGHT",
        "VARIANCE = 0.921",
        "ST. DEV. = 0.960",
    )
    # A point is listed with all its residuals when one exceeds the limit, and not at all when none does.
    assert not contains(residual_pages([point], 0.0145, closing), "14 -14")


# Pages 30 and 41


def sample_stations():
    names, values = [], {}
    for row in rows("stations_adjusted.csv"):
        values[row["frame"], row["parameter"]] = float(row["value"])
        names += [] if row["frame"] in names else [row["frame"]]
    position = np.array([[values[name, key] for key in ("lon", "lat", "elev")] for name in names])
    position[:, :2] = np.radians(position[:, :2])
    attitude = np.radians([[values[name, key] for key in ("omega", "phi", "kappa")] for name in names])
    covariances = np.full((len(names), 6, 6), np.nan)
    for row in rows("station_covariances.csv"):
        start = 3 * (row["block"] != "position")
        i, j = start + int(row["row"]) - 1, start + int(row["col"]) - 1
        at = names.index(row["frame"])
        covariances[at, i, j] = covariances[at, j, i] = float(row["value"])
    return names, position, attitude, covariances


@pytest.mark.giant("10", "triangulated camera stations")
@pytest.mark.giant("10", "page lengths: 10 control points, 13 stations, 52 points or 13 with covariances")
def test_section_10_camera_stations():
    names, position, attitude, _ = sample_stations()
    pages = station_pages(GEOGRAPHIC, True, names, position, attitude, None)
    assert len(pages) == 1
    assert contains(
        pages,
        "T R I A N G U L A T E D C A M E R A S T A T I O N S",
        "IDENT POSITION ATT(PHOTO TO GROUND)",
        "LNG =- 94 59 4.7584 OMEGA =- 0 41 24.3710",
        "SH9960 LAT = 29 39 17.7712 PHI =- 0 10 17.9138",
        "ELV = 4556.0633 KAPPA = 236 45 7.6484",
    )
    assert contains(
        pages,
        "LNG =- 95 3 2.3900 OMEGA =- 0 20 54.4774",
        "SH9964 LAT = 29 43 59.1374 PHI =- 0 0 31.0700",
    )
    twice = station_pages(
        GEOGRAPHIC, True, names + names[:7], np.tile(position, (2, 1)), np.tile(attitude, (2, 1)), None
    )
    assert [sum("LAT" in line for line in page) for page in twice] == [13, 7]


@pytest.mark.giant("10", "triangulated camera stations")
def test_section_10_camera_stations_with_covariances():
    pages = station_pages(GEOGRAPHIC, True, *sample_stations())
    assert contains(
        pages,
        "IDENT POSITION COVARIANCE MATRIX ATT(PHOTO TO GROUND) COVARIANCE MATRIX",
        "LNG =- 94 59 4.7584 0.377E-13 -0.626E-14 -0.296E-07"
        " OMEGA =- 0 41 24.3710 0.242E-07 -0.935E-08 0.567E-08",
        "SH9960 LAT = 29 39 17.7712 -0.626E-14 0.182E-13 0.631E-07"
        " PHI =- 0 10 17.9138 -0.935E-08 0.486E-07 -0.181E-08",
        "ELV = 4556.0633 -0.296E-07 0.631E-07 0.355E+00 KAPPA = 236 45 7.6484 0.567E-08 -0.181E-08 0.569E-08",
    )


# Pages 34 and 53


def sample_points():
    listed = rows("ground_adjusted.csv")
    position = []
    for row in listed:
        sign = -1 if row["lon_d"].startswith("-") else 1
        lon = sign * abs(float(row["lon_d"])) * 3600 + sign * (60 * float(row["lon_m"]) + float(row["lon_s"]))
        lat = float(row["lat_d"]) * 3600 + float(row["lat_m"]) * 60 + float(row["lat_s"])
        position.append([lon * ARCSEC, lat * ARCSEC, float(row["elev_m"])])
    marks = ["" if row["type_code"] == "0" else f"*{row['type_code']}*" for row in listed]
    return [row["point"] for row in listed], marks, np.array(position)


@pytest.mark.giant("10", "triangulated ground points")
@pytest.mark.giant("10", "page lengths: 10 control points, 13 stations, 52 points or 13 with covariances")
def test_section_10_ground_points():
    names, marks, position = sample_points()
    pages = point_pages(GEOGRAPHIC, names, marks, position)
    assert len(pages) == 1
    assert contains(pages, "T R I A N G U L A T E D G R O U N D P O I N T S", "IDENT POSITION")
    assert contains(pages, "126! LNG =- 94 59 38.7142 LAT = 29 39 54.7204 ELV = 3.374")
    assert contains(pages, "SH951201 *3* LNG =- 94 58 39.3565 LAT = 29 42 31.0064 ELV = 0.000")
    assert contains(pages, "SH964201 *3* LNG =- 95 4 26.3592 LAT = 29 43 24.7486 ELV = 9.754")
    names, marks = (3 * each + 2 * each[:12] for each in (names, marks))
    pages = point_pages(GEOGRAPHIC, names, marks, np.zeros((144, 3)))
    assert [sum("LAT" in line for line in page) for page in pages] == [52, 52, 40]


@pytest.mark.giant("10", "sort: ascending, right-justified names")
@pytest.mark.giant("14", "12 sorting of names")
def test_section_10_points_are_sorted_as_right_justified_names():
    names = [row["point"] for row in rows("ground_adjusted.csv")]
    # The one page of the sample that shows the order; names of two and three characters stood before it.
    assert sorted([*reversed(names), "126!", "9!", "75!"], key=printed_order) == [
        "9!",
        "75!",
        *sorted([*names, "126!"], key=names.index),
    ]


def sample_covariances():
    upper = ("c11_rad2", "c12_rad2", "c13_rad_m", "c22_rad2", "c23_rad_m", "c33_m2")
    covariances = []
    for row in rows("ground_covariances.csv"):
        half = np.zeros((3, 3))
        half[np.triu_indices(3)] = [float(row[name]) for name in upper]
        covariances.append(half + np.triu(half, 1).T)
    return np.array(covariances)


@pytest.mark.giant("10", "triangulated ground points")
@pytest.mark.giant("10", "page lengths: 10 control points, 13 stations, 52 points or 13 with covariances")
@pytest.mark.giant("9", "summary: count and rms of standard deviations, unheld components only")
def test_section_10_ground_points_with_covariances():
    names, marks, positions = sample_points()
    listed = rows("ground_covariances.csv")
    where = [names.index(row["point"]) for row in listed]
    held = np.array([[mark == "*4*"] * 2 + [mark == "*3*"] for mark in (marks[at] for at in where)])
    pages = propagated_point_pages(
        GEOGRAPHIC,
        [names[at] for at in where],
        [marks[at] for at in where],
        positions[where],
        sample_covariances(),
        held,
    )
    # Thirteen on page 53, one and the summary on page 54.
    assert [sum("LAT" in line and "COUNT" not in line for line in page) for page in pages] == [13, 1]
    assert contains(
        pages,
        "IDENT POSITION COVARIANCE MATRIX STANDARD DEV",
        "LNG =- 94 58 39.3565 0.485E-14 0.805E-15 -0.219E-11 0 0 0.0144",
        "SH951201 *3* LAT = 29 42 31.0064 0.805E-15 0.446E-14 -0.132E-11 0 0 0.0138",
        "ELV = 0.0000 -0.219E-11 -0.132E-11 0.921E-04 0.0096",
    )
    assert contains(
        pages[1:],
        "LNG =- 95 6 21.9926 0.215E-16 0.362E-19 -0.135E-10 0 0 0.0010",
        "SH968802 *4* LAT = 29 49 10.3719 0.362E-19 0.216E-16 -0.161E-09 0 0 0.0010",
        "ELV = 11.1726 -0.135E-10 -0.161E-09 0.454E+00 0.6738",
        "SUMMARY STATISTICS FOR GROUND POINTS",
        "RMS FOR STANDARD DEVIATIONS",
    )
    # Components that are not held: longitude and latitude of six points, height of eight.
    summary = [line for line in squeezed(pages) if line.startswith("COUNT")]
    assert [line.split("=")[1].split()[0] for line in summary] == ["6", "6", "8"]


# Page 35


@pytest.mark.giant("10", "corrections applied to ground control")
def test_section_10_corrections_of_control():
    listed = rows("control_corrections.csv")
    columns = ("dlon_arcsec", "dlat_arcsec", "delev_m")
    corrections = np.nan_to_num([[float(row[name]) for name in columns] for row in listed])
    corrections[:, :2] *= ARCSEC
    held = np.array(
        [[name not in row["parenthesised_components"] for name in ("lon", "lat", "elev")] for row in listed]
    )
    names = [row["point"] for row in listed]
    pages = correction_pages(GEOGRAPHIC, names, corrections, held, as_published=True)
    assert len(pages) == 1
    assert contains(
        pages,
        "LNG= 0 0 0.0003 LNG= - 0 0 0.0002 LNG= 0 0 0.0002 LNG= - 0 0 0.0002",
        "SH954801 LAT= 0 0 0.0001 SH954802 LAT= - 0 0 0.0001"
        " SH960801 LAT= 0 0 0.0000 SH960802 LAT= 0 0 0.0001",
        "ELV=( 0.001) ELV=( 0.001) ELV=( 0.000) ELV=( 0.000)",
    )
    text = "\n".join(squeezed(pages))
    assert "LNG=( 0 0 0.0000)" in text
    counts = re.findall(r"NUMBER OF COMPONENTS = (\d+) RMS", text)
    expected = SUMMARY["control_correction_counts"]
    assert counts[:3] == [str(expected[name]) for name in ("lon", "lat", "elev")]
    assert counts[3:] == []
    ours = correction_pages(GEOGRAPHIC, names, corrections, held, as_published=False)
    counts = re.findall(r"NUMBER OF COMPONENTS = (\d+) RMS", "\n".join(squeezed(ours)))
    assert counts[3:] == ["10", "10", "12"]


# The scan


def scanned(page):
    """Lines of a page of the guide's printout as the scan has them, without blanks."""
    (text,) = re.findall(rf"^== page {page}\n(.*?)(?=^==|\Z)", SCAN.read_text(), re.MULTILINE | re.DOTALL)
    return [re.sub(r"\s", "", line) for line in text.splitlines()]


def likeness(lines, scan):
    """How much each line is like the scanned line most like it; 1 is equal."""
    squashed = [re.sub(r"\s", "", line) for line in lines]
    best = [
        max(difflib.SequenceMatcher(None, line, other, autojunk=False).ratio() for other in scan)
        for line in squashed
        if line
    ]
    return np.array(best)


def test_the_page_of_stations_is_like_the_scanned_one():
    (page,) = station_pages(GEOGRAPHIC, True, *sample_stations())
    like = likeness(page[3:], scanned(41))
    assert len(like) == 40
    assert np.median(like) > 0.9
    assert like.min() > 0.8


def test_the_matrices_of_points_are_like_the_scanned_ones():
    # The scan has page 53 column by column.
    lines = [row for covariance in sample_covariances()[:13] for row in matrix_rows(covariance)]
    like = likeness(lines, scanned(53))
    assert len(like) == 39
    assert np.median(like) > 0.9
    assert like.min() > 0.8
