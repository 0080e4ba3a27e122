"""The printed pages of the 1967 program, beside what figure 22 of the report still shows."""

from dataclasses import replace

import pytest

from golden_data import golden
from photogram.stellar import calibrate
from photogram.stellar.printout import exponential, printout


@pytest.fixture(scope="module")
def pages(plate):
    return printout(calibrate(replace(plate, options=replace(plate.options, as_published=True)))).split("\f")


def test_numbers_are_those_of_the_figure():
    """Page 1: pressure, crossover, last level of discrepancies; page 2: weights, residuals of star 1."""
    for value, printed in (
        (760.0, " .76000000E+03"),
        (0.065, " .65000000E-01"),
        (5.8427052e-09, " .58427052E-08"),
        (1000.0, " .10000000E+04"),
        (0.0, " .00000000E 00"),
        (-9.5054395e-08, "-.95054395E-07"),
        (-1.4258159e-06, "-.14258159E-05"),
    ):
        assert exponential(value) == printed
    assert exponential(1.0, 3) == " .100E+01"


def test_pages_have_the_lines_of_the_figure(pages, plate):
    first, second = (page.splitlines() for page in pages)
    assert max(len(line) for line in first + second) <= 132
    for line in (
        "TOTAL NUMBER OF STARS AND PLATE POINTS IN PROBLEM",
        "MAXIMUM SOLUTION",
        "DEGREES OF FREEDOM 728",
        "LEVEL OF DISCREPANCIES",
    ):
        assert line in first
    assert second[0].strip() == "STAR AND PLATE COORDINATE DATA"
    # A block a star: its head, its images, their means.
    assert sum(line.startswith("STAR    NORMALIZED STAR WEIGHTS") for line in second) == 75
    assert sum(" PRE " in line or " POST " in line or " EVENT " in line for line in second) == 375
    assert sum(line.startswith("STAR     MEAN PLATE COORDINATES") for line in second) == 75
    number, right, declination, *_ = second[4].split()
    assert number == plate.star_ids[0]
    assert float(right) == pytest.approx(plate.star_weights[0, 0, 0], rel=1e-7)
    assert float(declination) == pytest.approx(plate.star_weights[0, 1, 1], rel=1e-7)


def test_options_have_the_words_of_the_figure_and_none_of_ours(pages):
    first = pages[0].splitlines()
    # The plate of the tests has the options of the figure.
    assert set(golden("stellar", "sample_page1.json")["options_printed"]) <= set(first)
    assert not [line for line in first if "AS PUBLISHED" in line or "BEFORE DISTORTION" in line]
