"""Warnings and fatal messages of the 1987 program: specification, section 11; limits: section 3."""

import pytest
from small_project import GROUND, IMAGES, ground_record, write_files

from photogram.errors import InputError
from photogram.giant import ErrorWarning, Limits, error_warnings, read_project


def image(name, x=1.0, y=2.0):
    return f"{name:10}{x:>10.3f}{y:>10.3f}"


def with_images(*, a=(), b=()):
    """IMAGES with further points on the frames A and B."""
    return [*IMAGES[:4], *map(image, a), *IMAGES[4:9], *map(image, b), IMAGES[9]]


def warnings_of(directory, limits=None, **changes):
    project = read_project(write_files(directory, **changes))
    return error_warnings(project, project.to_block(), limits)


def test_a_clean_project_has_no_warning(tmp_path):
    assert warnings_of(tmp_path, Limits(photos_per_point=2)) == []


@pytest.mark.giant("11", "CONTROL POINTS APPEARING ON ONE PHOTOGRAPH")
def test_section_11_control_points_on_one_photograph(tmp_path):
    # Types with one missing component at the most keep their control.
    records = [ground_record(f"C{code}", "1.", "2.", "3.", code=str(code)) for code in range(8)]
    images = with_images(b=[f"C{code}" for code in reversed(range(8))])
    (warning,) = warnings_of(tmp_path, IMAGES=images, GROUND=[*GROUND, *records])
    assert warning == ErrorWarning(
        "CONTROL POINTS APPEARING ON ONE PHOTOGRAPH", ["C7", "C6", "C5", "C3"], general=False
    )


@pytest.mark.giant("11", "PASS POINTS APPEARING ON ONE PHOTOGRAPH")
def test_section_11_pass_points_on_one_photograph(tmp_path):
    (warning,) = warnings_of(tmp_path, IMAGES=with_images(a=["Q", "P"], b=["A", "P"]))
    assert warning == ErrorWarning("PASS POINTS APPEARING ON ONE PHOTOGRAPH", ["Q", "A"], general=False)


@pytest.mark.giant("11", "PASS POINTS APPEARING ON MORE THAN n PHOTOGRAPHS")
def test_section_11_points_on_too_many_photographs(tmp_path):
    images = with_images(a=["Q"])
    warnings = warnings_of(tmp_path, Limits(photos_per_point=1), IMAGES=images)
    assert warnings == [
        ErrorWarning("PASS POINTS APPEARING ON ONE PHOTOGRAPH", ["Q"]),
        ErrorWarning("PASS POINTS APPEARING ON MORE THAN 1 PHOTOGRAPHS", ["1", "2", "3"]),
    ]


@pytest.mark.giant("11", "PASS POINTS APPEARING ON MORE THAN n PHOTOGRAPHS")
def test_section_11_a_point_twice_on_one_photograph_counts_once(tmp_path):
    assert warnings_of(tmp_path, Limits(photos_per_point=2), IMAGES=with_images(a=["1"])) == []


@pytest.mark.giant("11", "POINTS NOT PHOTOGRAPHED")
def test_section_11_points_not_photographed(tmp_path):
    records = [ground_record(name, "1.", "2.", "3.") for name in ("9", "8")]
    (warning,) = warnings_of(tmp_path, GROUND=[records[0], *GROUND, records[1]])
    assert warning == ErrorWarning("POINTS NOT PHOTOGRAPHED", ["9", "8"], general=True)


@pytest.mark.giant("11", "DUPLICATE CONTROL POINTS")
def test_section_11_duplicate_control_points(tmp_path):
    records = [ground_record(name, "7.", "7.", "7.") for name in ("2", "1", "2")]
    project = read_project(write_files(tmp_path, GROUND=[*GROUND, *records]))
    (warning,) = error_warnings(project, project.to_block())
    assert warning == ErrorWarning("DUPLICATE CONTROL POINTS", ["1", "2"], general=True)
    assert project.ground[0].position == (110, 210, 10)


@pytest.mark.giant("3", "limits N1 to N6")
@pytest.mark.parametrize("value", [0, -3, 2.5, "4"])
def test_section_3_limits_are_positive_whole_numbers(value):
    with pytest.raises(InputError, match="the limit of stations must be a positive whole number"):
        Limits(stations=value)
