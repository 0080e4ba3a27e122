"""What reports, documents and pictures say of films and marks: the packaged archive, and golden tests."""

import json
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from golden_data import DATA, golden
from message_codes import coded
from photogram import InputError, Result, adjust, formats, simulate
from photogram.network import Fiducial, Film, KnownTogether, Mark
from photogram.results.film_report import film_patterns, film_table, mark_residuals, mean_mark_residuals
from photogram.show.quantity import records
from photogram.show.sketch.marks import Names

ARCHIVE = files("photogram") / "examples" / "archive"


@cache
def archive() -> Result:
    return adjust(formats.read(Path(str(ARCHIVE))).block, unit_variance="unity")


def by_hand(values: np.ndarray, film: Film, scanner: np.ndarray) -> np.ndarray:
    """Return the (2, 2) linear part of the way from the camera to true places, and to readings."""
    _, _, theta, m, b1, b2 = values
    turn = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])
    side = np.diag([-1.0 if film.mirrored else 1.0, 1.0])
    true = turn @ side @ np.array([[1 + m + b1, b2], [b2, 1 + m - b1]])
    sx, sy, alpha = scanner
    correction = np.array([[sx, sy * np.sin(alpha)], [0.0, sy * np.cos(alpha)]])
    pitch = np.diag([1.0, -1.0 if film.readings.down else 1.0]) / film.readings.pitch
    return np.array([true, pitch @ np.linalg.solve(correction, true)])


def test_the_form_of_six_numbers_is_that_of_the_unknowns_with_deviations_by_propagation() -> None:
    result = archive()
    [machine] = [each for each in result.unknowns if each.kind == "scanner"]
    for (row, film), form in zip(result.films, result.film_forms.values(), strict=True):
        values = result.film[row]
        true, reading = by_hand(values, film, machine.values)
        np.testing.assert_allclose(form.matrix[:, 1:], reading, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose([form.scale_x, form.scale_y], np.hypot(*true), rtol=1e-12)
        cosine = true[:, 0] @ true[:, 1] / np.prod(np.hypot(*true))
        assert form.between_axes == pytest.approx(np.arccos(cosine) - np.pi / 2, abs=1e-12)

        def said(at: np.ndarray, film: Film = film) -> np.ndarray:
            own, read = by_hand(at, film, machine.values)
            return np.array([*np.hypot(*own), np.arctan2(own[1, 0], own[0, 0]), *read.ravel()])

        steps = 1e-6 * np.eye(6)
        partials = np.column_stack([(said(values + h) - said(values - h)) / 2e-6 for h in steps])
        sd = np.sqrt(np.diag(partials @ result.film_cofactors[row] @ partials.T))
        np.testing.assert_allclose(form.sd[[0, 1, 3]], sd[:3], rtol=1e-6)
        np.testing.assert_allclose(form.matrix_sd[:, 1:], sd[3:].reshape(2, 2), rtol=1e-6)
        assert form.matrix_sd[0, 0] == pytest.approx(result.film_sd[row, 0] / film.readings.pitch, rel=1e-4)


def test_lost_marks_are_named_and_the_largest_test_is_that_of_both_coordinates() -> None:
    result = archive()
    films = records(film_table(result))
    assert [each["marks"] for each in films] == [8, 8, 8, 7, 8, 8]
    assert [each["lost"] for each in films] == [[], [], [], ["ul"], [], []]
    kind, residuals = result.kinds["fiducial"], mark_residuals(result)
    w = np.abs(kind.standardized)
    assert (residuals.tests >= (w**2).max(axis=1) * (1 - 1e-9)).all()
    for row, each in enumerate(films):
        assert each["largest_T"] == residuals.tests[residuals.photos == row].max()


def test_golden_tests_of_readings(tmp_path: Path) -> None:
    for path in (DATA / "film" / "block").glob("*.csv"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "project.toml").write_text('[project]\nformat = 1\n\n[units]\nimage = "mm"\n')
    result = adjust(formats.read(tmp_path).block, tolerance=1e-9)
    found = mark_residuals(result)
    tests = {
        (result.block.photo_ids[photo], mark): test
        for photo, mark, test in zip(found.photos.tolist(), found.marks, found.tests.tolist(), strict=True)
    }
    wanted = golden("film", "film.json")["full"]["fiducial_readings"]
    assert len(wanted) == len(tests)
    for each in wanted:
        own = tests[each["photo"], f"rc10 {each['fiducial']}"]
        assert own == pytest.approx(each["T"], rel=1e-5)


def test_a_wrong_certificate_shows_alike_on_films_of_both_sides() -> None:
    block = archive().block
    read = [each.mark for each in block.observations if isinstance(each, Fiducial)]
    [wrong] = {mark for mark in read if mark.name.endswith("mr")}
    moved = Mark(wrong.name, wrong.position[:2] + np.array([0.03, 0.0]), np.inf)
    observations = []
    for each in block.observations:
        if isinstance(each, Fiducial) and each.mark is wrong:
            each = Fiducial(each.photo, moved, each.film, each.reading, sd=each.sd)
        elif isinstance(each, KnownTogether) and wrong in each.unknowns:
            each = KnownTogether("certificate", [moved], sd=1e-5)
        observations.append(each)
    result = adjust(block.replace(observations=observations), unit_variance="unity")
    found = mark_residuals(result)
    own = found.xy[[mark == wrong.name for mark in found.marks]]
    assert len(own) == 6
    assert any(film.mirrored for _, film in result.films)
    assert (own[:, 0] < -0.01).all()
    [camera] = mean_mark_residuals(result)
    np.testing.assert_allclose(camera.vectors[camera.labels.index("mr")], own.mean(axis=0))


def test_the_pattern_is_that_of_its_weights() -> None:
    [found] = film_patterns(archive())
    [weights] = [each for each in archive().unknowns if each.kind == "pattern"]
    (x, y), h = found.places.T, 113.0
    wanted = np.column_stack([weights.values[0] * x * y, weights.values[1] * (x**2 - y**2)]) / h**2
    np.testing.assert_allclose(found.vectors, wanted, atol=1e-13)


def test_documents_have_films_fiducials_and_scanners() -> None:
    document = json.loads(archive().to_json())
    assert [each["lost"] for each in document["films"]] == [[], [], [], ["ul"], [], []]
    assert np.shape(document["films"][0]["affine"]["matrix_sd"]) == (2, 3)
    assert len(document["fiducials"]) == 8
    for each in document["fiducials"]:
        assert len(each["readings"]) == (5 if each["fiducial"].endswith("ul") else 6)
        np.testing.assert_allclose(np.diag(each["covariance_mm2"]), np.square(each["sd_mm"]))
    [scanner] = document["scanners"]
    assert scanner["calibration"] == [1.00001, 0.99998, 2e-05]
    assert scanner["pitch_mm"] == 0.02
    [machine] = [each for each in archive().unknowns if each.kind == "scanner"]
    np.testing.assert_allclose(scanner["covariance"], machine.covariance)
    assert {"films", "fiducials", "scanners"}.isdisjoint(json.loads(adjust(simulate().block).to_json()))


def test_the_report_says_what_the_tables_say() -> None:
    names, photos, given, _, changes, *_ = archive().document().table("fiducials").columns
    row = names.values.index("rc10-2345 ul")
    mark = archive().fiducials["rc10-2345 ul"]
    assert photos.values[row] == 5
    np.testing.assert_array_equal(given.values[row], [-105.9940, 106.0020])
    np.testing.assert_array_equal(changes.values[row], mark.change)
    assert archive().document().table("films").columns[2].values.shape == (6, 6)
    assert "reading = a0 + a1 x + a2 y" in archive().report()


def test_marks_and_patterns_are_drawn_and_stand_on_the_page() -> None:
    panels = archive().plot.films().panels
    assert [panel.title for panel in panels if panel] == [
        "rc10-2345: residuals of marks, mean of 6 photos",
        "roll-7: pattern w1 w2",
    ]
    [names] = [mark for mark in panels[0].marks if isinstance(mark, Names)]
    assert {*names.texts} >= {"ll", "ur", "mt"}
    page = archive().to_html().decode()
    assert "picture-films" in page
    assert "The same as six numbers" in page
    with pytest.raises(InputError, check=coded("plot.films")):
        adjust(simulate().block).plot.films()
