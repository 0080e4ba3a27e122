"""Writing films, marks and scanners: what is written is read as it was."""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from message_codes import refused
from photogram import InputError, adjust
from photogram.formats import Project, read, to_files
from photogram.formats.results import adjusted
from photogram.network import Fiducial, KnownFilm
from test_film import project


def written(own: Project, folder: Path) -> Project:
    """Return a project as it is read again."""
    folder.mkdir()
    for name, content in to_files(own, "plain").items():
        (folder / name).write_bytes(content)
    return read(folder)


def edited(folder: Path, table: str, old: str, new: str) -> None:
    text = (folder / table).read_text()
    assert old in text
    (folder / table).write_text(text.replace(old, new))


GRID = "grid_x,grid_y,grid_dx,grid_dy,grid_columns,grid_rows"
MODEL = "project.toml", 'image = "mm"\n'
FORMS = {
    "as it is": (),
    "before": ((*MODEL, 'image = "mm"\n[film]\ninterior = "before"\n'),),
    "projective": ((*MODEL, 'image = "mm"\n[film]\nmodel = "projective"\n'),),
    "conformal": ((*MODEL, 'image = "mm"\n[film]\nmodel = "conformal"\n'),),
    "one size": (("films.csv", "0.0005,0.0001,", "0.0005,0,"),),
    "free": (("films.csv", "0.0005,0.0001,0.0001,0.0001", "0.0005,inf,inf,inf"),),
    "grid": (
        ("films.csv", "half_format_mm", GRID),
        ("films.csv", "w1 w2", "grid"),
        ("films.csv", "113.0", "-115,-115,115,115,3,3"),
    ),
}
TABLES = (
    "fiducials.csv",
    "fiducial_images.csv",
    "films.csv",
    "scanners.csv",
    "covariances.csv",
    "images.csv",
)


def check_alike(one: Project, other: Project) -> None:
    """Check that two projects have the same tables of films."""
    files = [to_files(each, "plain") for each in (one, other)]
    for name in (*TABLES, "project.toml"):
        assert files[0][name] == files[1][name]


@pytest.mark.parametrize("form", FORMS)
def test_a_project_of_films_is_read_as_it_was(tmp_path: Path, form: str) -> None:
    folder = tmp_path / "given"
    folder.mkdir()
    project(folder)
    for table, old, new in FORMS[form]:
        edited(folder, table, old, new)
    given = read(folder)
    again = written(given, tmp_path / "written")
    check_alike(again, given)
    one, other = adjust(given.block), adjust(again.block)
    assert other.sum_and_freedom == pytest.approx(one.sum_and_freedom, rel=1e-9)
    np.testing.assert_allclose(other.point_cofactors, one.point_cofactors, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(other.film, one.film, atol=1e-10)


def test_curves_of_scanners_without_a_covariance_are_written(tmp_path: Path) -> None:
    folder = tmp_path / "given"
    folder.mkdir()
    project(folder)
    lines = (folder / "covariances.csv").read_text().splitlines()
    (folder / "covariances.csv").write_text("\n".join(each for each in lines if "scanner" not in each))
    edited(folder, "scanners.csv", "alpha_rad", "alpha_rad,xC,sd_xC,hx,hy")
    edited(folder, "scanners.csv", "2e-05", "2e-05,0.002,0.001,115,115")
    given = read(folder)
    again = written(given, tmp_path / "written")
    films = [each.passages[0].film for each in (given.block, again.block)]  # type: ignore[attr-defined]
    np.testing.assert_array_equal(films[0].numbers(), films[1].numbers())
    for one, other in zip(*(each.curves for each in films), strict=True):
        np.testing.assert_array_equal(one.position, other.position)
        np.testing.assert_array_equal(one.deviations, other.deviations)
    assert films[0].curves[0].position[2] == 0.002


def test_covariances_of_films_and_marks_are_written(tmp_path: Path) -> None:
    folder = tmp_path / "given"
    folder.mkdir()
    own = project(folder)
    marks = dict.fromkeys(
        each.mark.name.split()[1] for each in own.block.observations if isinstance(each, Fiducial)
    )
    rows = [f"fiducials,rc10,{name}.{axis},{name}.{axis},4e-6" for name in marks for axis in "xy"]
    rows += ["fiducials,rc10,ll.x,ur.y,1e-6"]
    sd = {"t1": 0.1, "t2": 0.1, "theta": 1e-3, "m": 1e-4, "b1": 1e-4, "b2": 2e-4}
    rows += [f"film,p2,{name},{name},{value**2!r}" for name, value in sd.items()] + ["film,p2,b1,m,5e-9"]
    with (folder / "covariances.csv").open("a") as table:
        table.write("\n".join(["", *rows, ""]))
    given = read(folder)
    again = written(given, tmp_path / "written")
    check_alike(again, given)
    one, other = (
        next(each for each in block.observations if isinstance(each, KnownFilm) and each.photo == "p2")
        for block in (given.block, again.block)
    )
    np.testing.assert_array_equal(one.precision, other.precision)
    np.testing.assert_array_equal(one.observed, other.observed)
    assert adjust(again.block).sum_and_freedom == pytest.approx(adjust(given.block).sum_and_freedom, rel=1e-9)


def test_the_adjusted_project_is_written(tmp_path: Path) -> None:
    folder = tmp_path / "given"
    folder.mkdir()
    own = project(folder)
    result = adjust(own.block)
    again = written(adjusted(own, result), tmp_path / "written")
    np.testing.assert_allclose(again.block.photo_positions, result.photo_positions, atol=1e-9)
    assert adjust(again.block).sum_and_freedom == pytest.approx(result.sum_and_freedom, rel=1e-8)


def test_what_tables_have_no_place_for_is_refused(tmp_path: Path) -> None:
    own = project(tmp_path)
    others = [
        replace(each, values=[1e-4] * 3) if isinstance(each, KnownFilm) and each.photo == "p3" else each
        for each in own.block.observations
    ]
    with pytest.raises(InputError, match=r"film p3: m, b1, b2 must be 0"):
        to_files(own.replace(block=own.block.replace(observations=others)), "plain")
    with refused("format.film title=BINGO block photo=p1"):
        to_files(own, "bingo")


def test_plates_on_a_comparator_need_no_scanner(tmp_path: Path) -> None:
    """Readings in mm, y up, as a comparator has them that was calibrated before: photos share it."""
    archive = files("photogram") / "examples" / "archive"
    for each in archive.iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    for table, sd in (("images", "0.005"), ("fiducial_images", "0.004")):
        rows = [line.split(",") for line in (tmp_path / f"{table}.csv").read_text().splitlines()]
        rows = [[*row[:2], "x", "y", "sd"] if row[0] == "photo" else row for row in rows if row[0][0] != "#"]
        for row in rows[1:]:
            x, y = 0.02 * (float(row[2]) - 6000.0), 0.02 * (6000.0 - float(row[3]))
            row[2:] = [repr(1.00001 * x + 0.99998 * 2e-5 * y), repr(0.99998 * y), sd]
        (tmp_path / f"{table}.csv").write_text("\n".join(map(",".join, rows)) + "\n")
    photos = (
        (tmp_path / "photos.csv").read_text().replace(",scanner,", ",,").replace("film,,", "film,scanner,")
    )
    (tmp_path / "photos.csv").write_text(photos)
    for name in ("scanners.csv", "covariances.csv"):
        (tmp_path / name).unlink()
    block = read(tmp_path).block
    assert len({id(scan.film.scanner) for scan in block.passages}) == 1  # type: ignore[attr-defined]
    found, scanned = (adjust(each, unit_variance="unity") for each in (block, read(archive).block))
    assert block.image_unit == "mm"
    # The scanner's scales have standard deviations of four millionths, and this comparator none.
    assert found.sums_of_squares.total == pytest.approx(scanned.sums_of_squares.total, rel=1e-4)
    np.testing.assert_allclose(found.point_positions, scanned.point_positions, rtol=0, atol=1e-3)
