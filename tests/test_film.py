"""Films inside the adjustment: the golden block, read from its tables, and interior orientations."""

import json
import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from golden_data import DATA, golden
from message_codes import coded, raises
from photogram import Camera, InputError, Result, adjust, diagnose, first_values, read_result, simulate
from photogram.film import interior_orientation, which_mark
from photogram.formats import Project, read
from photogram.network import Film, FilmPlacement, FilmSize, Readings, Scan, Scanner

FOLDER = DATA / "film"
KINDS = {
    "fiducial readings": "fiducial",
    "film": "film",
    "certificate": "certificate",
    "scanner": "scanner",
}
"""What the golden data call a kind, and what results do."""


FILM: dict[str, Any] = golden("film", "film.json")


def project(folder: Path, settings: str = "") -> Project:
    """Return the golden block, read from copies of its tables."""
    for path in (FOLDER / "block").glob("*.csv"):
        shutil.copy(path, folder)
    (folder / "project.toml").write_text(f'[project]\nformat = 1\n\n[units]\nimage = "mm"\n{settings}')
    return read(folder)


@cache
def adjusted(settings: str = "") -> Result:
    with TemporaryDirectory() as folder:
        return adjust(project(Path(folder), settings).block, tolerance=1e-9)


def test_golden_sums() -> None:
    wanted, result = FILM["full"]["adjustment"], adjusted()
    assert result.sum_and_freedom == (pytest.approx(wanted["omega"], rel=1e-9), wanted["dof"])
    for name, own in KINDS.items():
        kind, sums = result.kinds[own], wanted["by_kind"][name]
        assert np.isfinite(kind.residuals).sum() == sums["number"]
        assert kind.redundancy.sum() == pytest.approx(sums["redundancy"], abs=1e-6)
        assert kind.sum_of_squares == pytest.approx(sums["sum_of_squares"], rel=1e-6, abs=1e-9)
    assert result.redundancies is not None
    assert result.redundancies.plates == pytest.approx(wanted["by_kind"]["images"]["redundancy"], abs=1e-6)
    weighted = {
        name: sum(each.redundancy.sum() for each in result.unknowns if each.kind == name)
        for name in ("roll", "pattern")
    }
    for name, found in weighted.items():
        assert found == pytest.approx(wanted["by_kind"][name]["redundancy"], abs=1e-6)


def test_golden_values_of_photos_and_films() -> None:
    wanted, result = FILM["full"]["photos"], adjusted()
    values, cofactors = result.film, result.film_cofactors
    for row, name in enumerate(result.block.photo_ids):
        own = wanted[name]
        sd = np.array(own["sd_film"])
        assert np.abs((values[row] - own["film"]) / sd).max() < 1e-6
        expected = np.array(own["cofactors_film"])
        scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
        assert np.abs((cofactors[row] - expected) / scale).max() < 1e-7
        off = (result.photo_positions[row] - own["position"]) / own["sd_position"]
        assert np.abs(off).max() < 1e-6


def test_golden_points_and_camera() -> None:
    wanted, result = FILM["full"], adjusted()
    for row, name in enumerate(result.block.point_ids):
        own = wanted["points"].get(name)
        if own is not None:
            assert np.abs((result.point_positions[row] - own["value"]) / own["sd"]).max() < 1e-6
    camera = result.cameras[0]
    values = [camera.camera.parameters[name] for name in ("c", "xp", "yp", "A1", "A2")]
    assert np.abs((np.array(values) - wanted["camera"]["value"]) / wanted["camera"]["sd"]).max() < 1e-6


def test_golden_marks_roll_pattern_and_scanner() -> None:
    wanted, result = FILM["full"], adjusted()
    own = {(each.kind, each.name): each for each in result.unknowns}
    for name, mark in wanted["fiducials"].items():
        found = own["fiducial", f"rc10 {name}"]
        assert np.abs((found.values - mark["value"]) / mark["sd"]).max() < 1e-6
        assert np.sqrt(np.diag(found.cofactors)) == pytest.approx(mark["sd"], rel=1e-7)
    roll, pattern, scanner = own["roll", "roll1"], own["pattern", "roll1"], own["scanner", "scan1"]
    assert abs(roll.values[0] - wanted["roll"]["m"]) < 1e-6 * wanted["roll"]["sd"]
    assert np.abs((pattern.values - wanted["pattern"]["w"]) / wanted["pattern"]["sd"]).max() < 1e-6
    assert np.abs((scanner.values - wanted["scanner"]["value"]) / wanted["scanner"]["sd"]).max() < 1e-6


def test_golden_readings_have_residuals_redundancy_and_tests() -> None:
    wanted, kind = FILM["full"]["fiducial_readings"], adjusted().kinds["fiducial"]
    rows = {name: row for row, name in enumerate(kind.names)}
    for each in wanted:
        row = rows[f"{each['photo']} - rc10 {each['fiducial']}"]
        np.testing.assert_allclose(kind.residuals[row], each["residual_px"], atol=1e-6)
        np.testing.assert_allclose(kind.redundancy[row], each["redundancy"], atol=1e-7)
        np.testing.assert_allclose(kind.standardized[row], each["standardized"], rtol=1e-5)


def test_golden_two_steps() -> None:
    wanted, result = FILM["two_steps"], adjusted('[film]\ninterior = "before"\n')
    sums = wanted["adjustment"]
    assert result.sum_and_freedom == (pytest.approx(sums["omega"], rel=1e-9), sums["dof"])
    for row, name in enumerate(result.block.point_ids):
        if name in wanted["points"]:
            own = wanted["points"][name]
            assert np.abs((result.point_positions[row] - own["value"]) / own["sd"]).max() < 1e-6


@pytest.mark.parametrize("photo", [f"p{k}" for k in range(1, 7)])
def test_golden_interior_orientation(tmp_path: Path, photo: str) -> None:
    wanted = FILM["interior_orientation_alone"][photo]
    found = interior(project(tmp_path), photo)
    assert found.omega == pytest.approx(wanted["omega"], rel=1e-8)
    assert found.degrees_of_freedom == wanted["dof"]
    assert found.p == pytest.approx(wanted["p_high"], rel=1e-6)
    assert np.abs((found.film - wanted["film"]) / wanted["sd"]).max() < 1e-6
    np.testing.assert_allclose(found.sd, wanted["sd"], rtol=1e-7)
    np.testing.assert_allclose(found.residuals, wanted["residual_px"], atol=1e-7)
    np.testing.assert_allclose(found.redundancy, wanted["redundancy"], atol=1e-7)


def marks(own: Project, photo: str) -> tuple[np.ndarray, np.ndarray, Scan]:
    """Return places and readings of the marks of a photo, and its scan."""
    scan = next(each for each in own.block.passages if isinstance(each, Scan) and each.photo == photo)
    read_there = [each for each in own.block.observations if each.KIND == "fiducial" and each.of[0] == photo]
    places = np.array([each.mark.position[:2] for each in read_there])  # type: ignore[attr-defined]
    return places, np.array([each.reading for each in read_there]), scan  # type: ignore[attr-defined]


def interior(own: Project, photo: str) -> Any:
    places, readings, scan = marks(own, photo)
    return interior_orientation(
        places, readings, sd=0.2, counted=scan.film.readings, scanner=scan.film.scanner
    )


def test_a_mirrored_photo_is_found_and_refused_against_what_is_given(tmp_path: Path) -> None:
    own = project(tmp_path)
    assert interior(own, "p6").mirrored
    assert not interior(own, "p5").mirrored
    table = (tmp_path / "photos.csv").read_text()
    (tmp_path / "photos.csv").write_text(
        table.replace("p6,rc10,roll1,scan1,true", "p6,rc10,roll1,scan1,false")
    )
    with pytest.raises(
        InputError,
        check=coded("error.at", what="photo p6", message="films.mirrored"),
    ):
        read(tmp_path)
    (tmp_path / "photos.csv").write_text(table.replace("p6,rc10,roll1,scan1,true", "p6,rc10,roll1,scan1,"))
    assert next(each for each in read(tmp_path).block.passages if each.photo == "p6").film.mirrored  # type: ignore[attr-defined]


def test_a_film_starts_where_its_marks_have_it(tmp_path: Path) -> None:
    given = project(tmp_path)
    lines = [line.split(",") for line in (tmp_path / "photos.csv").read_text().splitlines()]
    (tmp_path / "photos.csv").write_text("\n".join(",".join(line[:-3]) for line in lines))
    found = read(tmp_path)
    for one, other in zip(given.block.passages, found.block.passages, strict=True):
        assert np.abs(one.film.placement.position - other.film.placement.position).max() < 0.03  # type: ignore[attr-defined]
    assert adjust(found.block).sum_and_freedom == pytest.approx(adjusted().sum_and_freedom, rel=1e-7)


def test_marks_without_names_are_told_or_not() -> None:
    """Marks that are not symmetric tell how a film lies; those of a modern camera do not."""
    uneven = np.array([[-106.0, -105.0], [106.3, 104.0], [-103.0, 106.0], [107.0, -101.0], [0.0, 113.0]])
    lain = np.array([2.0, -3.0]) + (uneven * [-1.0, 1.0]) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    order = np.array([3, 0, 4, 2, 1])
    found = which_mark(uneven, lain[order])
    assert found.decided
    assert (found.mirrored, found.quarter_turns) == (True, 1)
    np.testing.assert_array_equal(found.marks, order)
    even = np.array([[-106.0, -106.0], [106.0, 106.0], [-106.0, 106.0], [106.0, -106.0]])
    alike = which_mark(even, even + 0.001)
    assert not alike.decided
    assert len(alike.alike) > 1


def test_conformal_affine_and_projective_films_come_back() -> None:
    rng = np.random.default_rng(38)
    places = rng.uniform(-110, 110, (12, 2))
    scanner, counted = Scanner("s", (1.0002, 0.9998, 1e-4), 0.0), Readings(0.02, (6000.0, 6000.0), down=True)
    for model, film, bend in (
        ("conformal", [0.3, -0.2, 1.2, 1e-4, 0.0, 0.0], [0.0, 0.0]),
        ("affine", [0.3, -0.2, -2.2, 1e-4, 2e-4, -1e-4], [0.0, 0.0]),
        ("bilinear", [0.3, -0.2, 0.1, 1e-4, 2e-4, -1e-4], [4e-7, -3e-7]),
        ("projective", [0.3, -0.2, 3.1, 1e-4, 2e-4, -1e-4], [2e-7, 1e-7]),
    ):
        readings = _readings(places, film, bend, model, scanner, counted)
        found = interior_orientation(places, readings, model, counted=counted, scanner=scanner)  # type: ignore[arg-type]
        np.testing.assert_allclose(found.film, film, atol=1e-11)
        np.testing.assert_allclose(found.bend, bend, atol=1e-14)
        if found.affine is not None:
            assert found.affine.rotation == pytest.approx(
                film[2] + np.arctan2(film[5], 1 + film[3] + film[4]), abs=1e-9
            )
            at = found.affine.matrix @ np.column_stack([np.ones(12), places]).T
            np.testing.assert_allclose(at.T, readings, atol=1e-8)


def _readings(
    places: np.ndarray, film: list[float], bend: list[float], model: str, scanner: Scanner, counted: Readings
) -> np.ndarray:
    """Return readings by the equations of docs/film.md, written out."""
    t1, t2, theta, m, b1, b2 = film
    x, y = places.T
    e = np.column_stack([x + (m + b1) * x + b2 * y, y + b2 * x + (m - b1) * y])
    if model == "bilinear":
        e = e + np.outer(x * y, bend)
    if model == "projective":
        e = e / (1 + places @ bend)[:, np.newaxis]
    cos, sin = np.cos(theta), np.sin(theta)
    p = e @ np.array([[cos, sin], [-sin, cos]]) + [t1, t2]
    sx, sy, alpha = np.asarray(scanner.value)
    plain = np.linalg.solve([[sx, sy * np.sin(alpha)], [0.0, sy * np.cos(alpha)]], p.T).T
    return np.asarray(counted.origin) + plain / counted.pitch * [1.0, -1.0]


@pytest.mark.parametrize("model", ["brown", "brown_forward"])
def test_a_film_that_does_nothing_changes_nothing(model: str) -> None:
    """Readings in mm of films as they were: the block of the same images, residuals as measured."""
    block = simulate(strips=2, photos_per_strip=3, seed=1).block
    c = float(block.known_distances("the test")[0])
    radial = {"K1": 3e-8, "P1": 2e-7} if model == "brown" else {"A1": -3e-8, "B1": 2e-7}
    camera = Camera(
        model,
        {"c": c, "xp": 0.02, "yp": -0.01, **radial},
        {"c": 0.01, "xp": 0.01, "yp": 0.01, next(iter(radial)): 1e-8},
        unit="mm",
        weights="measured" if model == "brown" else "corrected",
    )
    plain = block.replace(
        cameras=[camera], photo_cameras=[0] * len(block.photo_ids), principal_distances=None
    )
    scanner, counted = Scanner("none", sd=0.0), Readings()
    scans = [
        Scan(name, Film(FilmPlacement(name, 0.0, 0.0), FilmSize(name, 0.0, 0.0), scanner, counted))
        for name in block.photo_ids
    ]
    one, other = adjust(plain), adjust(plain.replace(passages=scans))
    assert other.sum_and_freedom == pytest.approx(one.sum_and_freedom, rel=1e-9)
    np.testing.assert_allclose(other.point_positions, one.point_positions, atol=1e-6)
    np.testing.assert_allclose(other.photo_cofactors, one.photo_cofactors, rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(other.residuals, one.residuals, atol=1e-8)


def test_cameras_that_films_cannot_have_are_refused(tmp_path: Path) -> None:
    block = project(tmp_path).block
    for change, message in (
        ({"unit": "px"}, "block.scan.unit"),
        (
            {"model": "brown", "parameters": {"c": -152.4}, "sd": 0.0, "covariance": None},
            "block.scan.weights",
        ),
    ):
        camera = block.cameras[0].replace(**change)
        with raises(InputError, message):
            block.replace(cameras=[camera])
    with raises(InputError, "error.repeated"):
        block.replace(passages=[*block.passages, block.passages[0]])


def test_a_bilinear_film_and_a_grid_are_adjusted(tmp_path: Path) -> None:
    """More unknowns that are known beforehand: as many more rows, and a smaller sum."""
    own = project(tmp_path, '[film]\nmodel = "bilinear"\n')
    films = (tmp_path / "films.csv").read_text().splitlines()
    bilinear = adjust(own.block)
    assert bilinear.degrees_of_freedom == FILM["full"]["adjustment"]["dof"]
    assert bilinear.sum_and_freedom[0] < FILM["full"]["adjustment"]["omega"]
    head = films[0].replace("half_format_mm", "grid_x,grid_y,grid_dx,grid_dy,grid_columns,grid_rows")
    row = films[1].replace("w1 w2", "grid").replace("113.0", "-115,-115,115,115,3,3")
    (tmp_path / "films.csv").write_text(f"{head}\n{row}\n")
    grid = adjust(project_again(tmp_path).block)
    assert grid.redundancies is not None
    assert grid.redundancies.total == pytest.approx(grid.degrees_of_freedom, abs=1e-6)
    nodes = [each for each in grid.unknowns if each.kind == "pattern"]
    assert len(nodes) == 9
    assert all(np.isfinite(each.sd).all() for each in nodes)


def project_again(folder: Path) -> Project:
    (folder / "project.toml").write_text('[project]\nformat = 1\n\n[units]\nimage = "mm"\n')
    return read(folder)


def test_a_result_is_saved_and_read_and_told(tmp_path: Path) -> None:
    result = adjusted()
    result.to_parquet(tmp_path / "result")
    again = read_result(tmp_path / "result")
    np.testing.assert_array_equal(again.film, result.film)
    np.testing.assert_array_equal(again.film_cofactors, result.film_cofactors)
    residuals = (each.kinds["fiducial"].residuals for each in (again, result))
    np.testing.assert_array_equal(*residuals)
    assert isinstance(again.block.passages[0], Scan)
    document = json.loads(result.to_json())
    assert [each["photo"] for each in document["films"]] == result.block.photo_ids
    np.testing.assert_array_equal([each["film"] for each in document["films"]], result.film)
    assert "Film and fiducials" in result.report()
    assert result.block.image_unit == "px"


def test_films_leave_first_values_and_checks_to_the_images_of_cameras(tmp_path: Path) -> None:
    """Photos without poses are started from readings that are brought back to the camera."""
    block = project(tmp_path).block
    unknown = block.replace(photo_positions=np.nan, photo_attitudes=np.nan)
    started = first_values(unknown)
    assert not started.missing
    assert adjust(started.block).sum_and_freedom == pytest.approx(adjusted().sum_and_freedom, rel=1e-6)
    assert not diagnose(block).grave
