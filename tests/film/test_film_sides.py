"""How films lie: sides against what is given, and photos whose marks have no names."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import coded
from photogram import InputError, adjust
from photogram.cli import app
from photogram.errors import ContradictionError
from photogram.film import interior_orientation
from photogram.formats import read
from test_film import project


def rewritten(path: Path, change: dict[str, str]) -> None:
    """Put words in the place of columns of a table."""
    head, *rows = [line.split(",") for line in path.read_text().splitlines()]
    for row in rows:
        for column, word in change.items():
            row[head.index(column)] = word
    path.write_text("\n".join(",".join(each) for each in [head, *rows]) + "\n")


def without_starts(folder: Path) -> None:
    rewritten(folder / "photos.csv", {"mirrored": "", "start_t1": "", "start_t2": "", "start_theta": ""})


def test_a_mirrored_photo_ends_with_both_readings_and_code_4(tmp_path: Path) -> None:
    project(tmp_path)
    text = (tmp_path / "photos.csv").read_text()
    (tmp_path / "photos.csv").write_text(text.replace("scan1,true", "scan1,false"))
    with pytest.raises(ContradictionError) as caught:
        read(tmp_path)
    assert caught.value.file == tmp_path / "photos.csv"
    ended = CliRunner().invoke(app, ["adjust", str(tmp_path), "--out", str(tmp_path / "out")])
    assert ended.exit_code == 4
    assert not (tmp_path / "out").exists()


def test_an_interior_orientation_says_both_readings() -> None:
    places = np.array([[-106.0, -106.0], [106.0, 106.0], [-106.0, 106.0], [106.0, -106.0]])
    with pytest.raises(ContradictionError, check=coded("films.mirrored")):
        interior_orientation(places, places * [-1.0, 1.0], mirrored=False)
    with pytest.raises(ContradictionError, check=coded("films.not-mirrored")):
        interior_orientation(places, places, mirrored=True)


def test_poses_tell_how_films_lie_whose_marks_have_no_names(tmp_path: Path) -> None:
    """Marks are symmetric to 0.01 mm: eight ways are alike, and images of known points choose."""
    named = project(tmp_path)
    without_starts(tmp_path)
    rewritten(tmp_path / "fiducial_images.csv", {"fiducial": ""})
    found = read(tmp_path)
    scans = zip(named.block.passages, found.block.passages, strict=True)
    for one, other in scans:
        assert one.film.mirrored == other.film.mirrored  # type: ignore[attr-defined]
        away = one.film.placement.position - other.film.placement.position  # type: ignore[attr-defined]
        assert np.abs(away).max() < 0.03
    wanted, own = adjust(named.block), adjust(found.block)
    assert own.sum_and_freedom == pytest.approx(wanted.sum_and_freedom, rel=1e-7)
    assert sum(each.code == "plain.film-lies" and "turned by" in str(each) for each in found.messages) == 6


def test_without_poses_names_are_asked_for(tmp_path: Path) -> None:
    project(tmp_path)
    without_starts(tmp_path)
    rewritten(tmp_path / "fiducial_images.csv", {"fiducial": ""})
    rewritten(tmp_path / "photos.csv", {"omega": "", "phi": "", "kappa": ""})
    with pytest.raises(InputError, match=r"photo p\d: .* the marks do not determine.* add the names"):
        read(tmp_path)


@pytest.mark.parametrize("kept", [("ll", "ur"), ("ml", "mr")])
def test_poses_tell_the_side_of_two_marks(tmp_path: Path, kept: tuple[str, str]) -> None:
    project(tmp_path)
    without_starts(tmp_path)
    path = tmp_path / "fiducial_images.csv"
    lines = path.read_text().splitlines()
    path.write_text(
        "\n".join(each for each in lines if not each.startswith("p6,") or each.split(",")[1] in kept)
    )
    found = read(tmp_path)
    assert [each.film.mirrored for each in found.block.passages] == [False] * 5 + [True]  # type: ignore[attr-defined]


def keep_marks(folder: Path, photo: str, kept: tuple[str, ...]) -> None:
    path = folder / "fiducial_images.csv"
    lines = path.read_text().splitlines()
    path.write_text(
        "\n".join(each for each in lines if not each.startswith(f"{photo},") or each.split(",")[1] in kept)
    )


@pytest.mark.parametrize("posed", [True, False])
def test_tie_points_tell_the_side_of_two_marks(tmp_path: Path, posed: bool) -> None:
    """No point has coordinates: a neighbour whose marks tell shows how its images lie."""
    project(tmp_path)
    without_starts(tmp_path)
    keep_marks(tmp_path, "p6", ("ml", "mr"))
    (tmp_path / "points.csv").unlink()
    (tmp_path / "control.csv").unlink()
    if not posed:
        rewritten(tmp_path / "photos.csv", {"omega": "", "phi": "", "kappa": ""})
    found = read(tmp_path)
    assert [each.film.mirrored for each in found.block.passages] == [False] * 5 + [True]  # type: ignore[attr-defined]


def test_tie_points_tell_how_a_film_lies_whose_marks_have_no_names(tmp_path: Path) -> None:
    """With poses a quarter turn shows, too: one after the other, from the photo whose marks have names."""
    named = project(tmp_path)
    without_starts(tmp_path)
    (tmp_path / "points.csv").unlink()
    (tmp_path / "control.csv").unlink()
    path = tmp_path / "fiducial_images.csv"
    head, *rows = path.read_text().splitlines()
    rows = [each if each.startswith("p4,") else ",".join(["", *each.split(",")]) for each in rows]
    rows = [
        each if each[0] == "p" else ",".join([each.split(",")[1], "", *each.split(",")[3:]]) for each in rows
    ]
    path.write_text("\n".join([head, *rows]) + "\n")
    found = read(tmp_path)
    for one, other in zip(named.block.passages, found.block.passages, strict=True):
        assert one.film.mirrored == other.film.mirrored  # type: ignore[attr-defined]
        away = one.film.placement.position - other.film.placement.position  # type: ignore[attr-defined]
        assert np.abs(away).max() < 0.03


def test_a_photo_without_marks_is_told_to_be_taken_as_not_mirrored(tmp_path: Path) -> None:
    project(tmp_path)
    without_starts(tmp_path)
    keep_marks(tmp_path, "p3", ())
    found = read(tmp_path)
    assert any("photo p3: its fiducials do not determine the side" in str(each) for each in found.messages)
