"""The printout (unit 6): which pages a job has, page breaks, units, and the listing of the packaged example.

`test_listing_sample.py` compares the pages with those of the guide.
"""

from __future__ import annotations

import dataclasses
import math
import re
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import pytest

from photogram import AsPublished, Block, Refraction, Result, adjust, simulate
from photogram.giant import Common, ErrorWarning, GroundPoint, ImageFrame, Project, listing, read_project
from photogram.giant.printout.forms import Space, attitude, dms, exponential, fixed, paginate
from photogram.giant.printout.listing import control_pages, frame_pages, options_page, warning_pages
from photogram.giant.printout.results import (
    correction_pages,
    iteration_pages,
    propagated_point_pages,
    residual_pages,
    station_pages,
    statistics,
)

DATA = Path(__file__).parents[1] / "data" / "giant"
SNAPSHOT = DATA / "listing_galveston.txt"
"""Renewed by `photogram giant --example --listing tests/data/giant/listing_galveston.txt`."""
GEOGRAPHIC, RECTANGULAR = Space(geographic=True), Space(geographic=False)
TITLES = {
    "frames": "FRAME  ",
    "control": "GROUND CONTROL DATA",
    "warnings": "ERROR WARNINGS",
    "iterations": "CAMERA STATIONS CORRECTIONS",
    "residuals": "TRIANGULATED POINTS RESIDUALS",
    "stations": "TRIANGULATED CAMERA STATIONS",
    "points": "TRIANGULATED GROUND POINTS",
    "corrections": "CORRECTIONS APPLIED TO GROUND CONTROL",
}


@pytest.fixture(scope="module")
def example():
    with as_file(files("photogram") / "examples" / "galveston") as directory:
        return read_project(directory)


@pytest.fixture(scope="module")
def adjusted(example) -> tuple[Block, Result]:
    block = example.to_block()
    return block, adjust(block, unit_variance="free")


def changed(project, **switches):
    """Return the project with other switches in COMMON."""
    return Project(
        dataclasses.replace(project.common, **switches),
        project.cameras,
        project.frames,
        project.images,
        project.ground,
    )


def printed(project, result, **options):
    return listing(project, project.to_block(), result, **options)


def pages_of(text):
    return [page.splitlines() for page in text.removeprefix("1").split("\n1")]


def spaced(title):
    return "   ".join(" ".join(word) for word in title.split())


def kinds(text):
    """Name the kinds of pages in their order, once each."""
    headings = {
        kind: title if kind in ("frames", "warnings") else spaced(title) for kind, title in TITLES.items()
    }
    found = []
    for page in pages_of(text)[1:]:
        body = "\n".join(page[1:])
        (kind,) = (kind for kind, heading in headings.items() if heading in body)
        found.append(kind)
    return list(dict.fromkeys(found))


# Numbers


@pytest.mark.giant("10", "triangulated camera stations")
def test_section_10_numbers_are_those_of_fortran():
    cases = {
        3.77e-14: " 0.377E-13",
        -6.26e-15: "-0.626E-14",
        0.355: " 0.355E+00",
        0.99951: " 0.100E+01",
        12345.0: " 0.123E+05",
        0.0: " 0.000E+00",
        1.5e-120: " 0.150-119",
        math.nan: " " * 10,
    }
    assert {value: exponential(value) for value in cases} == cases
    assert [fixed(value, 10, 3) for value in (-0.0004, -0.0006, math.nan)] == [
        "     0.000",
        "    -0.001",
        " " * 10,
    ]
    assert fixed(-1234567.5, 8, 3) == "-1234567.500"


@pytest.mark.giant("10", "triangulated camera stations")
@pytest.mark.giant("14", "27 kappa 0 to 360, omega and phi -180 to 180 degrees")
def test_section_10_angles_are_rounded_as_a_whole_and_have_their_ranges():
    second = np.radians(1 / 3600)
    assert dms(-second * (95 * 3600 + 5 * 60 + 59.99996)) == "- 95  6  0.0000"
    assert dms(-second * 0.00004) == "   0  0  0.0000"
    assert dms(math.nan) == " " * 15
    omega, phi, kappa = attitude(np.radians([190.0, -190.0, -54.0]))
    assert [omega, phi, kappa] == ["-170  0  0.0000", " 170  0  0.0000", " 306  0  0.0000"]
    assert attitude([0.0, 0.0, -1e-14])[2] == "   0  0  0.0000"


# Page 0


def line_of(space=GEOGRAPHIC, refraction=None, **switches):
    return options_page(Common(geographic=space.geographic, **switches), space, refraction)


@pytest.mark.giant("10", "page 0: options")
@pytest.mark.parametrize(
    ("switches", "line"),
    [
        ({}, "OBJECT SPACE REFERENCE SYSTEM IS GEOGRAPHIC"),
        ({"space": RECTANGULAR}, "OBJECT SPACE REFERENCE SYSTEM IS RECTANGULAR"),
        ({}, "ROTATION ANGLES ARE PHOTO-TO-GROUND"),
        ({"photo_to_ground": False}, "ROTATION ANGLES ARE GROUND-TO-PHOTO"),
        ({}, "COMPLETE TRIANGULATION PROCESS IS REQUESTED"),
        ({"intersection_only": True}, "INTERSECTION ONLY PROCESS IS REQUESTED"),
        ({}, "ERROR PROPAGATION IS NOT REQUESTED"),
        ({"error_propagation": True}, "ERROR PROPAGATION IS REQUESTED"),
        (
            {"error_propagation": True},
            "UNIT VARIANCE WILL BE BASED ON COMPLETELY FREE CAMERA PARAMETERS",
        ),
        (
            {"error_propagation": True, "unit_variance": "constrained"},
            "UNIT VARIANCE WILL BE BASED ON CONSTRAINED CAMERA PARAMETERS",
        ),
        ({"error_propagation": True, "unit_variance": "unity"}, "UNIT VARIANCE WILL BE SET TO UNITY"),
        ({}, "ATMOSPHERIC REFRACTION WILL NOT BE INCLUDED IN THE ADJUSTMENT"),
        ({"refraction": Refraction("standard")}, "ATMOSPHERIC REFRACTION WILL BE INCLUDED IN THE ADJUSTMENT"),
        ({}, "WATER REFRACTION WILL NOT BE INCLUDED IN THE ADJUSTMENT"),
        ({"refraction": Refraction(None, "giant")}, "WATER REFRACTION WILL BE INCLUDED IN THE ADJUSTMENT"),
        ({}, "ALL IMAGE RESIDUALS WILL BE LISTED"),
        ({"residual_limit": 0.010}, "IMAGE RESIDUALS GREATER THAN 0.010 (MM) WILL BE LISTED"),
        ({"residual_limit": -1.0}, "NO IMAGE RESIDUALS WILL BE LISTED"),
        ({"strip": "0"}, "LEADING '0' WILL BE ELIMINATED FROM ALL IDENTIFICATIONS"),
        ({}, "SEMI-MAJOR AXIS OF SPHEROID = 6378206.400 METERS"),
        ({"space": Space(True, "ft")}, "SEMI-MINOR AXIS OF SPHEROID = 6356583.800 FEET"),
        ({"space": RECTANGULAR}, "LINEAR UNIT OF OBJECT SPACE = METERS"),
        ({}, "TRIANGULATED GROUND COORDINATES WILL BE SAVED"),
        ({}, "ADJUSTED CAMERA STATION PARAMETERS WILL BE SAVED"),
    ],
)
def test_section_10_option_lines(switches, line):
    assert line in line_of(**switches)


@pytest.mark.giant("10", "page 0: options")
@pytest.mark.parametrize(
    ("switches", "word"),
    [
        ({"unit_variance": "unity"}, "UNIT VARIANCE"),
        ({}, "LEADING"),
        ({"save_points": False}, "GROUND COORDINATES WILL BE SAVED"),
        ({"save_stations": False}, "PARAMETERS WILL BE SAVED"),
        ({"space": RECTANGULAR}, "SPHEROID"),
    ],
)
def test_section_10_option_lines_that_are_left_out(switches, word):
    assert word not in "\n".join(line_of(**switches))


# Page breaks


@pytest.mark.giant("10", "page lengths: 10 control points, 13 stations, 52 points or 13 with covariances")
@pytest.mark.parametrize(("count", "expected"), [(0, [0]), (52, [52]), (53, [52, 1]), (105, [52, 52, 1])])
def test_section_10_pages_break_after_52_lines(count, expected):
    pages = paginate(["HEAD", ""], ([str(number)] for number in range(count)))
    assert [len(page) - 2 for page in pages] == expected
    assert all(page[:2] == ["HEAD", ""] for page in pages)


def test_what_closes_a_listing_stands_together():
    entries = [[str(number)] for number in range(50)]
    assert len(paginate([], entries, closing=["A", "B"])) == 1
    assert paginate([], entries, closing=["A", "B", "C"])[1] == ["A", "B", "C"]


def plain_frame(points, **switches):
    frame = ImageFrame(
        "F", [f"P{number}" for number in range(points)], np.zeros((points, 2)), sd=(0.006, 0.0)
    )
    pose = [np.zeros(3), np.zeros(3), np.ones(3), np.ones(3)]
    return frame_pages(RECTANGULAR, False, pose, 152.0, frame, **switches)


@pytest.mark.giant("10", "page of a frame")
def test_section_10_a_frame_with_many_points_goes_on_overleaf():
    first, second = plain_frame(200)
    assert len(first) == len(plain_frame(1000)[1]) == 7 + 52
    assert [page[1] for page in (first, second)] == ["FRAME  F", "FRAME  F"]
    assert sum("KAPPA" in line for line in second) == 0
    assert len(re.findall(r"P\d+ ", "\n".join(first + second))) == 200
    assert "ST. D. OF X =    0.0060     ST. D. OF Y =    0.0100" in first[3]


@pytest.mark.giant("10", "page of a frame")
@pytest.mark.giant("2.2", "column 3: list input camera stations")
@pytest.mark.giant("2.2", "column 4: list input plate coordinates")
def test_section_10_a_frame_without_its_station_or_without_its_points():
    (plates,) = plain_frame(5, parameters=False)
    assert not any("OMEGA" in line for line in plates)
    assert any("P4" in line for line in plates)
    (parameters,) = plain_frame(500, plates=False)
    assert any("(GROUND TO PHOTO)" in line for line in parameters)
    assert not any("P L A T E" in line or "P4" in line for line in parameters)


def test_long_names_are_printed_whole():
    name = "A-NAME-OF-NO-8-CHARACTERS"
    ones, square = np.ones((1, 3)), np.ones((1, 6, 6))
    held = np.ones((1, 3), dtype=bool)
    for pages in (
        control_pages(RECTANGULAR, [GroundPoint(name, (1.0, 2.0, 3.0))], (1.0, 1.0, 1.0)),
        warning_pages([ErrorWarning("POINTS", [name] * 5)]),
        iteration_pages(RECTANGULAR, [name], [], np.zeros((0, 1, 6)), f"{name} FAILED"),
        residual_pages([(name, [name], np.zeros((1, 2)))], 0.0, []),
        station_pages(RECTANGULAR, True, [name], ones, ones, square),
        propagated_point_pages(RECTANGULAR, [name], ["*7*"], ones, square[:, :3, :3], held),
        correction_pages(RECTANGULAR, [name], ones, held, as_published=False),
    ):
        assert name in "\n".join(pages[0])


@pytest.mark.giant("10", "error warnings")
@pytest.mark.giant("11", "names are printed four to a line")
def test_section_10_warnings_have_four_names_on_a_line():
    names = [f"N{number}" for number in range(9)]
    (page,) = warning_pages([ErrorWarning("FIRST", names), ErrorWarning("SECOND", ["A"], general=True)])
    assert [line.split() for line in page if line] == [
        ["FIRST"],
        names[:4],
        names[4:8],
        names[8:],
        ["ERROR", "WARNINGS"],
        ["SECOND"],
        ["A"],
    ]
    assert warning_pages([]) == []
    assert len(warning_pages([ErrorWarning("MANY", [f"N{number}" for number in range(400)])])) == 2


@pytest.mark.giant("10", "triangulated points residuals")
def test_section_10_residuals_of_a_point_on_many_frames():
    frames = [f"F{number}" for number in range(25)]
    point = ("P", frames, np.full((25, 2), [0.0016, -0.0004]))
    (page,) = residual_pages([point], 0.0, [])
    lines = [line.split() for line in page if line][2:]
    assert lines[0] == ["P", *frames[:10]]
    assert lines[3] == frames[10:20]
    assert lines[6] == frames[20:]
    assert lines[1] == ["2"] * 10
    assert lines[2] == ["0"] * 10


def test_residuals_beyond_all_integers_are_printed_as_they_are():
    (page,) = residual_pages([("P", ["F"], np.array([[1e17, np.nan]]))], 0.0, [])
    lines = [line.split() for line in page if line][2:]
    assert lines == [["P", "F"], ["1" + 20 * "0"], []]


@pytest.mark.giant("10", "triangulated points residuals")
@pytest.mark.giant("7", "degrees of freedom not positive: reported, undefined, scale 1")
def test_section_10_without_degrees_of_freedom_the_estimates_are_undefined():
    from photogram.results.parts import SumsByKind

    lines = statistics(SumsByKind(0.0, 0.0, 0.0), 0, None)
    assert [line.split()[-1] for line in lines[-2:]] == ["UNDEFINED", "UNDEFINED"]


# Whole listings


def stable(text):
    """Round heights among the corrections: from geocentric coordinates they are noise beyond 8 decimals."""
    pattern = re.compile(r"(POSITION +\S+ +\S+) +(-?\d+\.\d{9})")
    return pattern.sub(lambda match: f"{match[1]} {round(float(match[2]), 4) + 0.0:11.4f}", text)


def test_the_listing_of_the_example_is_the_snapshot(example, adjusted):
    assert stable(listing(example, *adjusted)) == stable(SNAPSHOT.read_text())


def test_rounding_errors_do_not_change_the_snapshot(example):
    generator = np.random.default_rng(5)
    expected = stable(SNAPSHOT.read_text())
    block = example.to_block()
    for _ in range(5):
        nudge = {
            name: getattr(block, name) * (1 + 1e-15 * generator.uniform(-1, 1, getattr(block, name).shape))
            for name in ("photo_positions", "photo_attitudes", "image_xy", "point_positions")
        }
        result = adjust(block.replace(**nudge), unit_variance="free")
        assert stable(listing(example, block, result)) == expected


@pytest.mark.giant("10", "order of the pages")
@pytest.mark.giant("10", "every page: carriage control, banner, title, number from 0")
def test_section_10_the_example_has_all_kinds_of_pages_in_their_order(example, adjusted):
    text = listing(example, *adjusted)
    assert kinds(text) == list(TITLES)
    lines = text.splitlines()
    assert max(map(len, lines)) <= 133
    assert {line[:1] for line in lines} == {"1", " ", ""}
    numbers = [line.split()[-1] for line in lines if line.startswith("1")]
    assert numbers == [str(number) for number in range(len(numbers))]
    assert all(example.title in line for line in lines if line.startswith("1"))
    # 132 + 12 longitudes and latitudes, 134 + 10 heights, as in the sample.
    assert re.findall(r"COUNT = +(\d+)", text) == ["132", "132", "134"]


@pytest.mark.giant("2.2", "column 3: list input camera stations")
@pytest.mark.giant("2.2", "column 4: list input plate coordinates")
@pytest.mark.giant("2.2", "column 5: list input ground control")
@pytest.mark.giant("2.2", "column 6: list triangulated ground points")
@pytest.mark.giant("2.2", "column 8: list adjusted camera stations")
@pytest.mark.parametrize(
    ("switches", "missing"),
    [
        ({"list_input_stations": False}, set()),
        ({"list_input_images": False}, set()),
        ({"list_input_stations": False, "list_input_images": False}, {"frames"}),
        ({"list_input_control": False}, {"control"}),
        ({"list_points": False}, {"points"}),
        ({"list_stations": False}, {"stations"}),
        ({"intersection_only": True}, {"iterations", "stations"}),
    ],
    ids=lambda value: str(
        value if isinstance(value, dict) else sorted(value)
    ),  # in one order for all workers
)
def test_section_2_2_switches_of_pages(example, adjusted, switches, missing):
    text = printed(changed(example, **switches), adjusted[1])
    assert set(TITLES) - set(kinds(text)) == missing
    assert (spaced("CAMERA STATION PARAMETERS") in text) == switches.get("list_input_stations", True)
    assert (spaced("PLATE COORDINATES") in text) == switches.get("list_input_images", True)


@pytest.mark.giant("2.2", "column 11: error propagation")
@pytest.mark.giant("13", "5 error propagation in the last run")
def test_section_2_2_without_error_propagation_there_are_no_covariances(example, adjusted):
    text = printed(changed(example, error_propagation=False), adjusted[1])
    assert "COVARIANCE" not in text
    assert "RMS FOR STANDARD DEVIATIONS" not in text
    points = [page for page in pages_of(text) if "T R I A N G U L A T E D   G R O U N D" in "".join(page)]
    assert [sum("LAT" in line for line in page) for page in points] == [52, 52, 40]


@pytest.mark.giant("9", "summary: count and rms of standard deviations, unheld components only")
@pytest.mark.giant("14", "20 rms and counts of unheld components only")
def test_section_9_rms_of_the_standard_deviations_of_what_is_not_held(example, adjusted):
    block, result = adjusted
    found = re.findall(r"COUNT = +(\d+) .*=(.*)", listing(example, block, result))
    arcsec = np.degrees(1) * 3600
    for axis, (count, printed_rms) in enumerate(found):
        unheld = ~np.isfinite(block.point_sd[:, axis])
        rms, all_of_them = (
            np.sqrt(np.mean(sd**2)) for sd in (result.point_sd[unheld, axis], result.point_sd[:, axis])
        )
        unit = 1.0 if axis == 2 else arcsec
        assert int(count) == unheld.sum()
        assert float(printed_rms.split()[-1]) == pytest.approx(rms * unit, abs=5.1e-5)
        assert all_of_them * unit < rms * unit - 1e-4
    assert len(found) == 3


@pytest.mark.giant("10", "triangulated points residuals")
@pytest.mark.giant("2.2", "columns 41-50: residual listing limit")
@pytest.mark.parametrize("limit", [0.0, 0.010, 0.030, -1.0])
def test_section_10_residual_limit(example, adjusted, limit):
    block, result = adjusted
    pages = pages_of(printed(changed(example, residual_limit=limit), result))
    body = [line for page in pages if "R E S I D U A L S" in "".join(page) for line in page[5:]]
    names = {line.split()[0] for line in body if "SH99" in line}
    largest = np.zeros(len(block.point_ids))
    np.maximum.at(largest, block.image_points, np.abs(result.residuals).max(axis=1))
    expected = {name for name, size in zip(block.point_ids, largest, strict=True) if size > limit >= 0}
    assert names == expected
    assert sum("DEGREES OF FREEDOM" in line for line in body) == 1


@pytest.mark.giant("10", "sort: ascending, right-justified names")
@pytest.mark.giant("2.2", "column 13: sort ground points")
@pytest.mark.giant("14", "12 sorting of names")
def test_section_10_points_in_processing_order_or_sorted(example, adjusted):
    block, result = adjusted
    order = {}
    for sort in (True, False):
        project = changed(example, sort_points=sort, error_propagation=False)
        lines = printed(project, result).splitlines()
        order[sort] = [line.split()[0] for line in lines if line.count("=") == 3 and "LAT" in line[20:]]
    assert order[False] == block.point_ids
    assert order[True] == sorted(block.point_ids, key=lambda name: name.rjust(8))
    assert order[True] != order[False]


@pytest.mark.giant("2.2", "column 13: sort ground points")
@pytest.mark.giant("14", "12 sorting of names")
def test_section_2_2_adjusted_ground_is_sorted_too(example, adjusted):
    from photogram.giant.export import adjusted_ground

    block, result = adjusted

    def names(sort, as_published):
        project, positions = changed(example, sort_points=sort), result.point_positions
        return [point.name for point in adjusted_ground(project, block, positions, as_published=as_published)]

    published, natural = names(True, True), names(True, False)
    assert published == sorted(block.point_ids, key=lambda name: name.rjust(8))
    assert natural[:3] == ["59!", "60!", "61!"]
    assert natural.index("126!") == natural.index("80!") + 1
    assert natural.index("126!") < natural.index("S001") < natural.index("SH944201")
    assert sorted(natural) == sorted(published)
    assert names(False, True) == names(False, False) == block.point_ids


@pytest.mark.giant("10", "camera stations corrections")
@pytest.mark.giant("14", "28 pages of the iterations")
def test_section_10_corrections_of_stations_lead_to_the_adjusted_values(example, adjusted):
    block, result = adjusted
    listed = [
        [
            [float(value) for value in re.findall(r"-?\d+\.\d{9}", line)]
            for line in page
            if line[11:19] == "POSITION"
        ]
        for page in pages_of(listing(example, block, result))
        if any(line.startswith(" ITERATION") for line in page)
    ]
    assert np.array(listed).shape == (len(result.iterations), len(block.photo_ids), 6)
    total = np.sum(listed, axis=0)
    np.testing.assert_allclose(
        total[:, :3], result.photo_positions - block.photo_positions, rtol=0, atol=1e-8
    )
    np.testing.assert_allclose(
        total[:, 3:], result.photo_attitudes - block.photo_attitudes, rtol=0, atol=1e-8
    )


@pytest.mark.giant("10", "triangulated points residuals")
@pytest.mark.giant("2.2", "column 12: unit variance")
@pytest.mark.parametrize(("basis", "row"), [("free", 0), ("constrained", 1), ("unity", 0)])
def test_section_10_unit_variance_and_its_degrees_of_freedom(example, basis, row):
    block = example.to_block()
    text = listing(changed(example, unit_variance=basis), block, adjust(block, unit_variance=basis))
    images, unknowns, held = 2 * len(block.image_xy), 3 * 144 + 6 * 20, 34
    dof = images + held - unknowns + (120 if row else 0)
    assert f"DEGREES OF FREEDOM...................... ={dof:>12}" in text
    variance = float(re.search(r"VARIANCE = +(\S+)\n", text)[1])
    sums = [float(value) for value in re.findall(r"SQUARES \([A-Z]+\) +=\s+(\S+)", text)]
    total = sums[0] * row + sums[1] + sums[2]
    assert variance == pytest.approx(1.0 if basis == "unity" else total / dof, abs=6e-4)
    assert sum(sums[:3]) == pytest.approx(sums[3], abs=2e-3)


# Corrections of control


def control_block(text):
    """Return the page of corrections: values by name, with their parentheses."""
    page = pages_of(text)[-1]
    found = {}
    for start in range(5, len(page) - 3):
        names = re.findall(r"(\S+) +(?:LAT|Y  )=", page[start + 1])
        for at, name in enumerate(names):
            cells = [page[start + line].ljust(133)[1 + 33 * at :][13:30] for line in range(3)]
            found[name] = cells
    return page, found


@pytest.mark.giant("10", "corrections applied to ground control")
@pytest.mark.giant("14", "7 unheld components: adjusted minus supplied, own rms, only where supplied")
def test_section_10_corrections_of_unheld_components(example, adjusted):
    block, result = adjusted
    page, cells = control_block(listing(example, block, result))
    row = block.point_ids.index("SH954801")
    held, _, unheld = cells["SH954801"]
    assert (held[0], held[-1], unheld[0], unheld[-1]) == (" ", " ", "(", ")")
    assert float(unheld[1:-1]) == pytest.approx(result.point_differences[row, 2], abs=6e-4)
    # Without a supplied value there is nothing to compare with, and the rms does not count it.
    assert cells["SH951201"][0] == f"({' ' * 15})"
    assert [line.split()[5] for line in page if "NUMBER OF" in line] == ["12", "12", "10", "1", "1", "9"]
    assert any("ADJUSTED MINUS SUPPLIED VALUE" in line for line in page)
    known = np.isfinite(result.point_differences[:, 2]) & ~np.isfinite(block.point_sd[:, 2])
    rms = np.sqrt(np.mean(result.point_differences[known, 2] ** 2))
    assert float(page[-1].split()[-1]) == pytest.approx(rms, abs=6e-4)

    page, cells = control_block(listing(example, block, result, as_published=True))
    assert float(cells["SH954801"][2][1:-1]) == pytest.approx(result.point_last_corrections[row, 2], abs=6e-4)
    assert cells["SH951201"][0] == "(   0  0  0.0000)"
    # The sample ends with the components that are held.
    assert [line.split()[5] for line in page if "NUMBER OF" in line] == ["12", "12", "10"]


@pytest.fixture(scope="module")
def rectangular():
    block = simulate(strips=2, photos_per_strip=3, points_per_photo=15, check_points=5, seed=3).block
    project = Project.from_block(block)
    block = project.to_block()
    return project, block, adjust(block)


@pytest.mark.giant("10", "triangulated camera stations")
@pytest.mark.giant("10", "triangulated ground points")
@pytest.mark.giant("10", "corrections applied to ground control")
@pytest.mark.giant("2.2", "column 1: object space")
def test_section_10_rectangular_jobs_have_lengths(rectangular):
    project, block, result = rectangular
    text = listing(project, block, result)
    assert "LNG" not in text
    assert "POSITION (METERS, METERS, METERS), ATTITUDE (RADIANS)" in text
    x, y, z = (f"{value:15.4f}" for value in result.photo_positions[0])
    assert f"X   ={x}" in text
    assert f"{block.photo_ids[0]:<10}Y   ={y}" in text
    assert f"Z   ={z}" in text
    assert "ATT(GROUND TO PHOTO)" in text
    _, cells = control_block(text)
    check = block.point_ids[int(np.flatnonzero(result.point_kinds == "check")[0])]
    differences = result.point_differences[block.point_ids.index(check)]
    assert cells[check] == [f"({fixed(value, 15, 3)})" for value in differences]
    assert f"{check:<10}*7*" in text


@pytest.mark.giant("10", "page 0: options")
@pytest.mark.giant("2.2", "the axes fix the linear unit of the job")
@pytest.mark.giant("14", "8 units of the corrections are printed")
def test_section_10_jobs_in_feet_print_feet(example, adjusted):
    foot = 0.3048
    common = dataclasses.replace(
        example.common,
        semi_major=example.common.semi_major / foot,
        semi_minor=example.common.semi_minor / foot,
        control_sd=(*example.common.control_sd[:2], example.common.control_sd[2] / foot),
    )

    def lifted(each):
        return dataclasses.replace(each, position=(*each.position[:2], each.position[2] / foot))

    project = Project(
        common,
        example.cameras,
        [*map(lifted, example.frames)],
        example.images,
        [*map(lifted, example.ground)],
    )
    text = printed(project, adjust(project.to_block(), unit_variance="free"))
    assert "SEMI-MAJOR AXIS OF SPHEROID = 20925874.016 FEET" in text
    assert "POSITION (RADIANS, RADIANS, FEET), ATTITUDE (RADIANS)" in text
    height = adjusted[1].photo_positions[0, 2] / foot
    assert f"ELV ={height:15.4f}" in text


@pytest.mark.giant("6", "intersection only: residuals and ground coordinates are printed")
@pytest.mark.giant("14", "30 degrees of freedom of intersection")
def test_section_6_intersection_only_lists_residuals_and_points(example):
    project = changed(example, intersection_only=True)
    block = project.to_block()
    result = adjust(block.with_fixed_photos(), unit_variance="free")
    text = listing(project, block, result)
    assert kinds(text) == ["frames", "control", "warnings", "residuals", "points", "corrections"]
    # The stations are listed with the weights that they were given, though they take no part.
    assert "ST. D. =      60000.0000" in text
    # n = 2 images + held components, u = 3 points.
    assert f"DEGREES OF FREEDOM...................... ={2 * 483 + 34 - 3 * 144:>12}" in text


def test_what_there_is_of_an_adjustment_that_failed_is_printed_and_says_so(example):
    block = example.to_block()
    result = adjust(block, tolerance=AsPublished(), max_iterations=1)
    assert result.status == "not converged"
    published = listing(example, block, result, as_published=True)
    text = listing(example, block, result)
    assert kinds(text) == kinds(published) == list(TITLES)
    # The report says it; the printout of 1987 had no line for it.
    assert "SOLUTION" not in published
    for page in pages_of(text):
        body = "\n".join(page)
        late = "ITERATION 1" in body or "T R I A N G" in body or "A P P L I E D" in body
        assert ("SOLUTION HAS NOT CONVERGED" in body) == late
    lost = dataclasses.replace(
        result,
        status="diverged",
        iterations=[],
        photo_corrections=np.zeros((0, 20, 6)),
        photo_cofactors=np.full((20, 6, 6), np.nan),
        point_cofactors=np.full((144, 3, 3), np.nan),
    )
    text = listing(example, block, lost)
    assert kinds(text) == list(TITLES)
    assert "SOLUTION HAS DIVERGED" in text
    assert "COVARIANCE" not in text


WORDS_OF_THE_SAMPLE = {*(DATA / "words_of_the_sample.txt").read_text().split()}
"""The words of the printouts in the guide (section II.C, both runs), and no others."""


@pytest.mark.parametrize("propagation", [False, True])
def test_as_published_no_line_of_the_listing_is_ours(example, adjusted, propagation):
    block, result = adjusted
    project = changed(example, error_propagation=propagation)

    def words(text):
        """Return the words of pages: letter-spaced ones put together, without names, titles and banners."""
        lines = [line for page in pages_of(text.replace(block.title, "")) for line in page]
        known = {*block.point_ids, *block.photo_ids, *(point.name for point in project.ground)}
        joined = [re.sub(r"\b([A-Z]) (?=[A-Z]\b)", r"\1", line) for line in lines]
        shown = " ".join(" ".join(word for word in line.split() if word not in known) for line in joined)
        return set(re.findall(r"(?<![\dA-Z.])[A-Z]+(?![A-Z\d+-]*\d)", shown))

    assert words(listing(project, block, result, as_published=True)) <= WORDS_OF_THE_SAMPLE
    assert {"OBSERVED", "MINUS", "SUPPLIED", "RADIANS"} <= words(listing(project, block, result))


# What the core keeps


@pytest.mark.parametrize("options", [{}, {"tolerance": AsPublished(), "max_iterations": 9}])
def test_corrections_lead_from_the_initial_to_the_adjusted_values(rectangular, options):
    _, block, _ = rectangular
    result = adjust(block, **options)
    assert result.photo_corrections.shape == (len(result.iterations), len(block.photo_ids), 6)
    total = result.photo_corrections.sum(axis=0)
    np.testing.assert_allclose(block.photo_positions + total[:, :3], result.photo_positions, rtol=1e-12)
    np.testing.assert_allclose(block.photo_attitudes + total[:, 3:], result.photo_attitudes, atol=1e-12)
    assert np.isnan(result.point_last_corrections[~result.used_points]).all()
    fewer = len(result.iterations) - 1
    before = adjust(block, **options | {"max_iterations": fewer})
    np.testing.assert_allclose(
        before.point_positions + result.point_last_corrections, result.point_positions, rtol=0, atol=1e-8
    )


# The command


@pytest.mark.giant("2", "unit 6: printout")
def test_section_2_the_command_writes_the_listing(run, tmp_path):
    result = run("giant", "--example", "--quiet", "--listing", "print/unit6.txt")
    assert (result.exit_code, result.output) == (0, "")
    text = (tmp_path / "print" / "unit6.txt").read_text()
    # Where stations are as good as free, both have the same figures.
    as_in_1987 = text.replace("REDUNDANCY NUMBERS", "COMPLETELY FREE CAMERA PARAMETERS")
    assert stable(as_in_1987) == stable(SNAPSHOT.read_text())


def test_the_listing_of_the_command_is_written_without_convergence(run, rectangular, tmp_path):
    from photogram.giant import write_project

    project = changed(rectangular[0], max_iterations=1)
    write_project(project, tmp_path / "block")
    result = run("giant", "block", "--quiet", "--as-published", "--listing", "unit6.txt")
    assert result.exit_code == 3
    text = (tmp_path / "unit6.txt").read_text()
    assert "SOLUTION HAS NOT CONVERGED" not in text
    assert "not converged" in (tmp_path / "block-adjusted" / "report.txt").read_text()
    assert run("giant", "block", "--quiet", "--out", "o", "--listing", "ours.txt").exit_code == 0
    assert "ADJUSTED MINUS SUPPLIED VALUE" in (tmp_path / "ours.txt").read_text()


def test_documents_go_over_no_other_file(run, rectangular, tmp_path):
    from photogram.giant import write_project

    write_project(rectangular[0], tmp_path / "block")
    before = (tmp_path / "block" / "FRAMES").read_bytes()
    for arguments, reason in (
        (("block", "--listing", "block/FRAMES"), "over the input"),
        (("block", "--json", "block/FRAMES"), "over the input"),
        (("check", "block", "--json", "block/FRAMES"), "over the input"),
        (("block", "--listing", "block-adjusted/report.txt"), "another result"),
        (("block", "--listing", "same", "--json", "same"), "another result"),
    ):
        result = run("giant", *arguments)
        assert result.exit_code == 1
        assert reason in " ".join(result.stderr.split())
    assert (tmp_path / "block" / "FRAMES").read_bytes() == before
    assert not (tmp_path / "block-adjusted").exists()
    assert not (tmp_path / "same").exists()
