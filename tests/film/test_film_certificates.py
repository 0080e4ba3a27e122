"""Certificates and calibrations of scanners in projects: camera, marks and scanner with their covariances."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from golden_data import golden
from message_codes import coded, has_code
from photogram import InputError, _photocore, adjust
from photogram.comparator import Correction, Frame, Polynomial
from photogram.film import Certificate, interior_orientation
from photogram.film.distances import with_datum
from photogram.formats import Project, read, to_files
from photogram.network import Fiducial, Film, FilmPlacement, FilmSize, KnownTogether
from test_film import project

CERTIFICATE = """[certificate]
camera = "rc10"
date = "1983-05-11"
c = 152.387
autocollimation = [0.004, -0.012]
"""
RADIAL = """
[certificate.radial]
angle = [7.5, 15, 22.7, 30, 35, 40]
distortion = [-5, -11, -10, -7, 0, 6]
"""


def certified(folder: Path, text: str, camera: str = "camera,model\nrc10,brown_forward\n") -> Project:
    """Return the golden block with a certificate in the place of its camera and marks."""
    project(folder)
    (folder / "rc10.toml").write_text(text)
    (folder / "cameras.csv").write_text(camera)
    (folder / "fiducials.csv").unlink()
    lines = (folder / "covariances.csv").read_text().splitlines()
    (folder / "covariances.csv").write_text("\n".join(each for each in lines if "camera" not in each))
    with (folder / "project.toml").open("a") as settings:
        settings.write('\n[film]\ncertificate = "rc10.toml"\n')
    return read(folder)


def marks_of(folder: Path) -> dict[str, np.ndarray]:
    lines = [each.split(",") for each in (folder / "fiducials.csv").read_text().splitlines()[1:]]
    return {line[1]: np.array([float(line[2]), float(line[3])]) for line in lines}


def by_coordinates(folder: Path) -> str:
    project(folder)
    rows = [f"{name} = {place.tolist()}" for name, place in marks_of(folder).items()]
    return "\n".join([CERTIFICATE, "[certificate.fiducials]", *rows, RADIAL])


def by_distances(folder: Path) -> str:
    project(folder)
    marks = marks_of(folder)
    names = list(marks)
    rows = [
        f"{one}-{other} = {round(float(np.linalg.norm(marks[one] - marks[other])), 4)!r}"
        for k, one in enumerate(names)
        for other in names[:k]
    ]
    design = [f"{name} = [{x:.1f}, {y:.1f}]" for name, (x, y) in marks.items()]
    return "\n".join([CERTIFICATE, "[certificate.design]", *design, "[certificate.distances]", *rows, RADIAL])


def test_a_certificate_has_camera_and_marks(tmp_path: Path) -> None:
    own = certified(tmp_path, by_coordinates(tmp_path))
    wanted = Certificate.read(tmp_path / "rc10.toml").camera()
    (camera,) = own.block.cameras
    assert camera.name == "rc10"
    assert camera.parameters == wanted.parameters
    np.testing.assert_array_equal(camera.covariance[1], wanted.covariance[1])  # type: ignore[index]
    known = [each for each in own.block.observations if each.label == "certificate"]
    assert len(known) == 8
    np.testing.assert_allclose(known[0].precision, 4e-6 * np.eye(2))
    assert any("the certificate is of 1983-05-11" in str(each) for each in own.messages)
    result = adjust(own.block)
    assert result.sum_and_freedom[1] == 131
    assert result.sum_and_freedom[0] < 160
    again = written(own, tmp_path / "written")
    assert adjust(again.block).sum_and_freedom == pytest.approx(result.sum_and_freedom, rel=1e-8)


def written(own: Project, folder: Path) -> Project:
    folder.mkdir()
    for name, content in to_files(own, "plain").items():
        (folder / name).write_bytes(content)
    return read(folder)


def test_marks_by_distances_have_a_datum_that_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = by_distances(tmp_path)
    results = []
    for held in (1e-2, 1e-3):
        monkeypatch.setattr("photogram.film.distances.HELD", held)
        own = certified(tmp_path, text)
        results.append(adjust(own.block, tolerance=1e-9))
        project(tmp_path)
    (known,) = [
        each
        for each in own.block.observations
        if isinstance(each, KnownTogether) and each.title == "certificate"
    ]
    assert known.precision.shape == (16, 16)
    said = " ".join(map(str, own.messages))
    assert any(has_code(message, "films.uncertain-point", sd=0.02) for message in own.messages)
    assert "leave 3 movements free" in said
    one, other = results
    used = one.used_points
    sd = np.sqrt(np.diagonal(one.point_cofactors[used], axis1=1, axis2=2))
    assert np.abs((one.point_positions[used] - other.point_positions[used]) / sd).max() < 1e-4
    np.testing.assert_allclose(one.point_cofactors[used], other.point_cofactors[used], rtol=1e-4, atol=1e-8)
    assert one.sum_and_freedom == pytest.approx(other.sum_and_freedom, rel=1e-5)
    assert one.redundancies is not None
    assert one.redundancies.total == pytest.approx(131, abs=1e-4)
    camera = one.cameras[0]
    given = dict(zip(camera.given.covariance[0], np.sqrt(np.diag(camera.given.covariance[1])), strict=True))  # type: ignore[index]
    assert given["xp"] == 0.02


def test_a_datum_is_of_shifts_and_rotation_alone() -> None:
    expected = golden("film", "distances.json")
    free = expected["eight_marks_all_distances_one_typed_wrong"]
    covariance, places = np.array(free["covariance"]), np.array(free["coordinates"])
    found, movements = with_datum(places, covariance)
    assert movements == 3
    assert np.linalg.eigvalsh(found)[0] > 0
    # Distances have the variances that they had: what is added moves all marks alike.
    by = np.zeros(16)
    way = (places[1] - places[0]) / np.linalg.norm(places[1] - places[0])
    by[:2], by[2:4] = -way, way
    assert by @ found @ by == pytest.approx(by @ covariance @ by, rel=1e-9)
    with pytest.raises(InputError, check=coded("films.singular-marks")):
        with_datum(places, np.diag([0.0, *[4e-6] * 15]))
    assert with_datum(places, np.eye(16))[1] == 0


def test_certificates_that_cannot_be_are_refused(tmp_path: Path) -> None:
    text = by_coordinates(tmp_path)
    own = certified(tmp_path, text, "camera,model,c\nrc10,brown_forward,152.4\n")
    assert own.block.cameras[0].parameters["c"] == -152.4
    assert "plain.marks-only" in [each.code for each in own.messages]
    project(tmp_path)
    with pytest.raises(InputError, match=r"must be one of brown_forward, brown for a certificate"):
        certified(tmp_path, text, "camera,model\nrc10,ebner\n")
    with (tmp_path / "project.toml").open("a") as settings:
        settings.write('certificate = "none.toml"\n')
    (tmp_path / "project.toml").write_text(
        '[project]\nformat = 1\n[units]\nimage = "mm"\n[film]\ncertificate = "none.toml"\n'
    )
    with pytest.raises(InputError, match=r"the file 'none.toml' is unknown"):
        read(tmp_path)


def test_photos_name_the_certificate_of_their_camera(tmp_path: Path) -> None:
    text = by_coordinates(tmp_path)
    whole = certified(tmp_path, text)
    (tmp_path / "project.toml").write_text('[project]\nformat = 1\n[units]\nimage = "mm"\n')
    lines = (tmp_path / "photos.csv").read_text().splitlines()
    rows = [lines[0] + ",certificate", *(f"{line},rc10.toml" for line in lines[1:])]
    (tmp_path / "photos.csv").write_text("\n".join(rows) + "\n")
    own = read(tmp_path)
    assert own.block.cameras[0].parameters == whole.block.cameras[0].parameters
    (tmp_path / "photos.csv").write_text("\n".join([*rows[:-1], rows[-1].replace("rc10.toml", "other.toml")]))
    with pytest.raises(
        InputError, match=r"got another than 'rc10.toml' in a row above; define a camera for each"
    ):
        read(tmp_path)


def correction(*, singular: bool = False) -> Correction:
    """Return a correction with polynomials about a centre that is not the zero, and a full covariance."""
    rng = np.random.default_rng(7)
    coefficients = rng.normal(0.0, 2.0, (2, 9))
    unit = np.array([1e-6, 1e-6, 1e-6, *[0.3] * 18])
    root = rng.normal(size=(21, 21)) / 6 + np.eye(21)
    covariance = root @ root.T * unit * unit[:, np.newaxis]
    if singular:
        covariance[12:], covariance[:, 12:] = 0.0, 0.0
        covariance[4], covariance[:, 4] = 0.0, 0.0
    frame = Frame((40_000.0, -25_000.0), (115_000.0, 120_000.0))
    return Correction(1.00002, 0.99997, 3e-5, Polynomial(frame, coefficients, np.zeros((18, 18))), covariance)


def with_calibration(folder: Path, own: Correction) -> Project:
    project(folder)
    (folder / "calibration.json").write_bytes(own.to_json())
    (folder / "scanners.csv").write_text(
        "scanner,pitch_mm,origin_column,origin_row,calibration\nscan1,0.02,6000,6000,calibration.json\n"
    )
    lines = (folder / "covariances.csv").read_text().splitlines()
    (folder / "covariances.csv").write_text("\n".join(each for each in lines if "scanner" not in each))
    return read(folder)


def test_a_scanner_is_corrected_as_its_calibration_corrects(tmp_path: Path) -> None:
    """Readings become the places that the comparator's own correction makes of them, but for a shift."""
    given = correction()
    own = with_calibration(tmp_path, given)
    film = own.block.passages[0].film  # type: ignore[attr-defined]
    readings = np.random.default_rng(1).uniform(500.0, 11_500.0, (20, 2))
    mm = (readings - 6000.0) * 0.02 * [1.0, -1.0]
    wanted = given.apply(mm * 1e3) * 1e-3
    placed = FilmPlacement("p", 0.0), FilmSize("p", 0.0)
    flat = Film(*placed, film.scanner, film.readings, curves=film.curves)
    vectors = np.array([each.position for each in flat.unknowns])
    found = _photocore.film_places(flat.numbers(), vectors, readings)
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], atol=1e-9)
    (known_of,) = [each for each in own.block.observations if each.label == "scanner"]
    unit = np.array([1.0] * 3 + [1e-3] * 18)
    np.testing.assert_allclose(known_of.precision, given.covariance * unit * unit[:, np.newaxis], rtol=1e-12)


def test_a_calibrated_scanner_is_adjusted_and_written(tmp_path: Path) -> None:
    for name, singular in (("full", False), ("part", True)):
        folder = tmp_path / name
        folder.mkdir()
        own = with_calibration(folder, correction(singular=singular))
        assert ("plain.singular-scanner" in [each.code for each in own.messages]) == singular
        result = adjust(own.block)
        assert result.redundancies is not None
        assert result.redundancies.total == pytest.approx(result.degrees_of_freedom, abs=1e-5)
        assert result.degrees_of_freedom == 131
        again = written(own, folder / "written")
        assert adjust(again.block).sum_and_freedom == pytest.approx(result.sum_and_freedom, rel=1e-8)
        assert to_files(again, "plain")["covariances.csv"] == to_files(own, "plain")["covariances.csv"]


def test_films_that_are_fitted_before_have_the_curves_of_their_scanner(tmp_path: Path) -> None:
    own = with_calibration(tmp_path, correction())
    with (tmp_path / "project.toml").open("a") as settings:
        settings.write('\n[film]\ninterior = "before"\n')
    before = read(tmp_path)
    marks = [each for each in own.block.observations if isinstance(each, Fiducial) and each.photo == "p1"]
    film = before.block.passages[0].film  # type: ignore[attr-defined]
    vectors = np.array([each.position for each in film.unknowns])
    places = np.array([each.mark.position[:2] for each in marks])
    computed, _ = _photocore.film_readings(film.numbers(), vectors, places)
    fit = interior_orientation(
        places,
        np.array([each.reading for each in marks]),
        sd=0.2,
        counted=film.readings,
        scanner=film.scanner,
        curves=film.curves,
    )
    left = np.array([each.reading for each in marks]) - computed
    np.testing.assert_allclose(left, fit.residuals, atol=1e-7)


def test_what_a_calibration_says_is_not_said_beside_it(tmp_path: Path) -> None:
    with_calibration(tmp_path, correction())
    text = (tmp_path / "scanners.csv").read_text()
    (tmp_path / "scanners.csv").write_text(
        text.replace("calibration\n", "calibration,Sx\n").replace("json\n", "json,1.0\n")
    )
    with pytest.raises(InputError, match=r"column sx: this value must be in the calibration of the scanner"):
        read(tmp_path)


def test_images_beyond_the_table_are_told_where_its_curve_is_worth_less(tmp_path: Path) -> None:
    """The example has images to 143 mm, and its curve is worth more there than one of them."""
    for each in (files("photogram") / "examples" / "archive").iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    assert not any(each.code == "plain.beyond-distortion" for each in read(tmp_path).messages)
    path = tmp_path / "rc10-2345.toml"
    short = path.read_text().replace("30, 35, 40]", "30]").replace("-7, -1, 7]", "-7]")
    path.write_text(short)
    [told] = [each for each in read(tmp_path).messages if each.code == "plain.beyond-distortion"]
    assert (round(told.phrase.fields["last"]), round(told.phrase.fields["farthest"])) == (88, 143)
