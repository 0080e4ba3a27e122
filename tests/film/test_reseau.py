"""A reseau of each photo: shifts of the nodes of a grid, weighted and smooth."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from message_codes import raises
from photogram import InputError, _photocore, adjust
from photogram.film import interior_orientation
from photogram.formats import Project, ReadOptions, read, to_files
from photogram.network import Film, FilmPlacement, FilmSize, Readings, Reseau, Scanner

ARCHIVE = files("photogram") / "examples" / "archive"
GRID = (-100.0, -100.0, 50.0, 50.0, 5.0, 5.0)
COUNTED = Readings(pitch=0.02, origin=(6000.0, 6000.0), down=True)
LOCAL = "pattern,sd_w1,sd_w2,sd_smooth,grid_x,grid_y,grid_dx,grid_dy,grid_columns,grid_rows"


def crosses(count: int) -> np.ndarray:
    side = np.linspace(-100.0, 100.0, count)
    return np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)


def readings(places: np.ndarray, shifts: np.ndarray, *, mirrored: bool) -> np.ndarray:
    """Return what a scanner reads of a film that is shifted between the nodes of a grid."""
    film = Film(
        FilmPlacement("p", (0.3, -0.2, 0.4)),
        FilmSize("p", (3e-4, -1e-4, 5e-5)),
        Scanner("s"),
        COUNTED,
        pattern=Reseau("p", GRID, (0.01, 0.01)).with_shifts(shifts),
        mirrored=mirrored,
    )
    vectors = np.array([each.position for each in film.unknowns])
    return _photocore.film_readings(film.numbers(), vectors, places)[0]


@pytest.mark.parametrize("mirrored", [False, True])
def test_shifts_between_crosses_are_found(mirrored: bool) -> None:
    rng = np.random.default_rng(3)
    reseau = Reseau("p", GRID, (0.01, 0.01), 0.01)
    shifts = (np.linalg.cholesky(reseau.covariance) @ rng.normal(size=50)).reshape(-1, 2)
    places = crosses(9)
    noise = rng.normal(0.0, 0.02, places.shape)
    read_ = readings(places, shifts, mirrored=mirrored) + noise
    own = {"sd": 0.02, "counted": COUNTED, "mirrored": mirrored}
    without = interior_orientation(places, read_, **own)
    fit = interior_orientation(places, read_, reseau=reseau, **own)
    assert np.abs(without.residuals).max() > 0.2
    assert np.sqrt(np.mean(fit.residuals**2)) < 0.02
    assert fit.degrees_of_freedom == without.degrees_of_freedom == 156
    assert 110 < fit.omega < 210
    # Between the crosses, too, a film is where it was: 0.02 px are 0.4 um.
    between = rng.uniform(-95.0, 95.0, (200, 2))
    film = Film(
        *(FilmPlacement("p", fit.film[:3]), FilmSize("p", fit.film[3:]), Scanner("s"), COUNTED),
        pattern=reseau.with_shifts(fit.shifts),
        mirrored=mirrored,
    )
    vectors = np.array([each.position for each in film.unknowns])
    found = _photocore.film_readings(film.numbers(), vectors, between)[0]
    away = (found - readings(between, shifts, mirrored=mirrored)) * 0.02
    assert np.sqrt(np.mean(away**2)) < 0.0005


def test_the_covariance_is_that_of_shifts_and_second_differences() -> None:
    loose = Reseau("p", GRID, (0.01, 0.02)).covariance
    np.testing.assert_allclose(np.diag(loose), [1e-4, 4e-4] * 25)
    stiff = Reseau("p", GRID, (0.01, 0.02), 1e-6).covariance
    second = np.zeros(50)
    second[[0, 2, 4]] = 1.0, -2.0, 1.0
    assert np.sqrt(second @ stiff @ second) < 1.1e-6
    across = np.zeros(50)
    across[[1, 11, 21]] = 1.0, -2.0, 1.0
    assert np.sqrt(across @ stiff @ across) < 1.1e-6
    shift = np.zeros(50)
    shift[::2] = 1 / 25
    assert np.sqrt(shift @ stiff @ shift) == pytest.approx(0.01 / 5)


def test_a_reseau_that_cannot_be_is_refused() -> None:
    with raises(InputError, "error.most"):
        Reseau("p", (0, 0, 1, 1, 11, 11), (0.01, 0.01))
    good = (0.01, 0.01)
    for sd, smooth in (((0.0, 0.01), 1.0), ((0.01, np.inf), 1.0), (good, 0.0), (good, np.nan)):
        with raises(InputError, "error.positive"):
            Reseau("p", GRID, sd, smooth)


def archive(folder: Path, cells: str, *said: str) -> Project:
    for each in ARCHIVE.iterdir():
        (folder / each.name).write_bytes(each.read_bytes())
    (folder / "films.csv").write_text(f"film,sd_m,sd_photo_m,sd_b1,sd_b2,{LOCAL}\nroll-7,5e-4,{cells}\n")
    return read(folder, ReadOptions(settings=said))


WHOLE = "1e-4,1e-4,1e-4,local,0.006,0.006,0.004,-115,-115,46,46,6,6"


def test_each_photo_has_a_reseau_of_its_own(tmp_path: Path) -> None:
    own = archive(tmp_path, WHOLE)
    result = adjust(own.block, unit_variance="unity")
    nodes = [each for each in result.unknowns if each.kind == "pattern"]
    assert len(nodes) == 6 * 36
    assert result.degrees_of_freedom == 186
    assert result.redundancies is not None
    assert result.redundancies.total == pytest.approx(186, abs=1e-5)
    kind = result.kinds["reseau"]
    assert kind.sum_of_squares < 6 * 72
    again = tmp_path / "again"
    again.mkdir()
    for name, content in to_files(own, "plain").items():
        (again / name).write_bytes(content)
    assert adjust(read(again).block, unit_variance="unity").sum_and_freedom == pytest.approx(
        result.sum_and_freedom, rel=1e-8
    )


def test_one_step_and_two_are_the_same_where_marks_alone_tell(tmp_path: Path) -> None:
    """Marks without error, images without weight, films of which nothing is known beforehand."""
    cells = WHOLE.replace("1e-4", "inf")
    text = (ARCHIVE / "rc10-2345.toml").read_text()
    said = ("sd.images=1e4", "film.certificate=sure.toml")
    sure = text.replace("[certificate]\n", "[certificate]\nsd_fiducials = 1e-7\n", 1)
    (tmp_path / "sure.toml").write_text(sure)
    archive(tmp_path, cells, *said)
    (tmp_path / "covariances.csv").unlink()
    (tmp_path / "scanners.csv").write_text(
        "scanner,pitch_mm,origin_column,origin_row,Sx,Sy,alpha_rad\nscanner,0.02,6000,6000,1.00001,0.99998,2e-5\n"
    )
    project = read(tmp_path, ReadOptions(settings=said))
    inside = adjust(project.block, unit_variance="unity", tolerance=1e-9)
    before = adjust(
        read(tmp_path, ReadOptions(settings=[*said, "film.interior=before"])).block, unit_variance="unity"
    )
    assert (np.abs(inside.film - before.film) < 1e-3 * inside.film_sd).all()
    shifts = {each.name: each.position for each in inside.unknowns if each.kind == "pattern"}
    (scan, *_) = before.block.passages
    for node in scan.film.pattern.weights:  # type: ignore[attr-defined]
        np.testing.assert_allclose(shifts[node.name], node.position, atol=2e-6)


def test_a_local_reseau_needs_its_grid(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"films.csv, record 2: .*must be at most 200"):
        archive(tmp_path, WHOLE.removesuffix("6,6") + "11,11")
    with pytest.raises(InputError, match=r"column grid_rows: the pattern local requires values"):
        archive(tmp_path, WHOLE.removesuffix("6"))
    with pytest.raises(InputError, match=r"column sd_w1: the pattern local requires values"):
        archive(tmp_path, WHOLE.replace("local,0.006", "local,"))
