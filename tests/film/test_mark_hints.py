"""Which marks are to be looked at first: of the certificate, of a photo, or one reading."""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from golden_data import golden
from message_codes import coded
from photogram import InputError, Result, adjust
from photogram.diagnosis.after_adjustment import diagnosed
from photogram.diagnosis.films import mark_hints, seam_hints
from photogram.film import compare_steps
from photogram.formats import read
from test_film import project

ARCHIVE = files("photogram") / "examples" / "archive"


def adjusted(folder: Path, table: str, change: dict[tuple[str, str], dict[int, float]]) -> Result:
    """Return the golden block adjusted, numbers of some rows changed by the columns of a table."""
    project(folder)
    lines = [line.split(",") for line in (folder / table).read_text().splitlines()]
    for line in lines:
        for column, by in change.get((line[0], line[1]), {}).items():
            line[column] = repr(float(line[column]) + by)
    (folder / table).write_text("\n".join(map(",".join, lines)) + "\n")
    return adjust(read(folder).block)


def test_two_steps_have_smaller_standard_deviations(tmp_path: Path) -> None:
    inside = adjusted(tmp_path, "fiducials.csv", {})
    with (tmp_path / "project.toml").open("a") as settings:
        settings.write('\n[film]\ninterior = "before"\n')
    before = adjust(read(tmp_path).block)
    expected = golden("film", "film.json")
    sd = [
        np.array([expected[which]["points"][name]["sd"] for name in expected["full"]["points"]])
        for which in ("full", "two_steps")
    ]
    ratio = 100.0 * (np.median(sd[1] / sd[0], axis=0) - 1.0)
    found = compare_steps(inside, before)
    np.testing.assert_allclose(found.percent, ratio, rtol=0, atol=1e-5)
    assert (
        f"standard deviations of points by {ratio[0]:+.1f} % in X, {ratio[1]:+.1f} % in Y" in found.sentence
    )
    assert ratio[1] < 0
    document = json.loads(found.to_json())
    assert document["sums"]["inside"]["degrees_of_freedom"] == 131
    assert document["sums"]["before"]["degrees_of_freedom"] == 59
    assert [each["axis"] for each in document["axes"]] == [*"XYZ"]
    with pytest.raises(InputError, check=coded("films.other-interior", interior="inside")):
        compare_steps(before, inside)
    other = before.block.replace(point_ids=[f"q{k}" for k in before.block.point_ids])
    with pytest.raises(InputError, check=coded("films.different-points")):
        compare_steps(inside, adjust(other))


def test_good_marks_have_no_hint(tmp_path: Path) -> None:
    assert mark_hints(adjusted(tmp_path, "fiducials.csv", {})) == []


def test_a_mark_that_fails_on_all_photos_is_wrong_in_its_certificate(tmp_path: Path) -> None:
    result = adjusted(tmp_path, "fiducials.csv", {("rc10", "ur"): {2: 0.1}})
    (hint,) = mark_hints(result)
    assert hint.code == "film-check.marks.certificate"
    mark = hint.phrase.fields["marks"][0].fields
    assert (mark["mark"], mark["n"]) == ("rc10 ur", 6)
    assert hint in diagnosed(result).messages


def test_a_single_reading_is_of_the_wrong_place(tmp_path: Path) -> None:
    (hint,) = mark_hints(adjusted(tmp_path, "fiducial_images.csv", {("p3", "mr"): {3: 6.0}}))
    assert hint.code == "film-check.marks.readings"
    reading = hint.phrase.fields["readings"][0].fields
    assert (reading["mark"], reading["photo"]) == ("rc10 mr", "p3")


def test_all_marks_of_a_photo_are_of_another_camera(tmp_path: Path) -> None:
    """Corners farther out by 0.4 mm, and middles where they are: a cone of another camera."""
    out = {"ll": (-20.0, 20.0), "ul": (-20.0, -20.0), "ur": (20.0, -20.0), "lr": (20.0, 20.0)}
    change = {("p2", mark): {2: by[0], 3: by[1]} for mark, by in out.items()}
    (hint,) = mark_hints(adjusted(tmp_path, "fiducial_images.csv", change))
    assert (hint.code, hint.phrase.fields) == ("film-check.marks.all", {"photos": ["p2"]})


@pytest.mark.parametrize(("axis", "where"), [(0, "column"), (1, "row")])
def test_halves_of_a_scan_that_are_shifted_are_named(tmp_path: Path, axis: int, where: str) -> None:
    """Images and marks of one half of a photo lie 3 pixels lower, across the base."""
    for each in ARCHIVE.iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    for table in ("images.csv", "fiducial_images.csv"):
        lines = [line.split(",") for line in (tmp_path / table).read_text().splitlines()]
        for line in lines:
            if line[0] == "83-2" and float(line[2 + axis]) > 6000.0:
                line[3] = repr(float(line[3]) + 3.0)
        (tmp_path / table).write_text("\n".join(map(",".join, lines)) + "\n")
    result = diagnosed(adjust(read(tmp_path).block))
    [hint] = seam_hints(result)
    assert (hint.code, hint.phrase.fields["photo"]) == (f"film-check.seam.{where}", "83-2")
    assert hint in result.messages
    assert not any(each.code.startswith("film-check.marks") for each in result.messages)


def test_whole_scans_have_no_seam(tmp_path: Path) -> None:
    assert seam_hints(adjusted(tmp_path, "fiducials.csv", {("rc10", "ur"): {2: 0.1}})) == []
    assert seam_hints(adjusted(tmp_path, "fiducial_images.csv", {("p3", "mr"): {3: 6.0}})) == []
