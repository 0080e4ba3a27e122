"""`photogram perspective-center`: what is printed and written, exit codes, the example and the page."""

from __future__ import annotations

import json
import re
import runpy
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import InputError
from photogram.perspective_center import read_deck, run_deck
from photogram.perspective_center.document import run_sketch
from photogram.perspective_center.listing import listing

REPOSITORY = Path(__file__).parents[2]
EXAMPLE = files("photogram") / "examples" / "perspective_center" / "grid.deck"
SET = {
    "title", "data_set", "perspective_center", "attitude_minutes", "standard_errors", "sigma0_plate",
    "sigma0_model", "covariance", "converged", "iterations", "points",
    "test", "verdict", "interior", "interior_standard_errors",
}  # fmt: skip
POINT = {
    "id",
    "readings",
    "mean",
    "residual",
    "radial_distortion",
    "redundancy",
    "standardized",
    "studentized",
}


@pytest.fixture
def run(run):
    """Run the command in an empty directory."""
    return lambda *arguments: run("perspective-center", *arguments)


@pytest.fixture
def singular(tmp_path):
    """Two sets, the second of another job with two points."""
    lines = EXAMPLE.read_text().splitlines()
    lines[3] = lines[3].replace("    2", "    1", 1)
    end = lines.index("    0") + 1
    bad = ["TWO POINTS", *lines[1:3], "    2    1    0   150.000    0.0010", *lines[5:7]]
    bad += [
        "   0.0       0.0       0.0       250.0     250.0     300.0",
        "  101      90.0      90.0",
        "  102     170.0      90.0",
    ]
    (tmp_path / "deck").write_text("\n".join([*lines[:end], *bad, ""]))
    return tmp_path / "deck"


def test_the_example_is_what_its_script_makes():
    script = runpy.run_path(str(REPOSITORY / "examples" / "make_grid_deck.py"))
    assert "".join(f"{line}\n" for line in script["cards"]()) == EXAMPLE.read_text()
    truth = np.concatenate([script["ATTITUDE_MINUTES"], script["POSITION"]])
    for grid in read_deck(Path(str(EXAMPLE))):
        result = run_deck(Path(str(EXAMPLE))).results[grid.number - 1]
        errors = np.concatenate([result.attitude_minutes, result.position]) - truth
        sd = np.concatenate([result.standard_errors[3:], result.standard_errors[:3]])
        assert (np.abs(errors) < 3 * sd).all()


def test_everything_is_written(run, tmp_path):
    result = run("--example", "--json", "out.json", "--out", "o", "--plots")
    assert result.exit_code == 0, result.output
    assert "Set 2, Z = 60\n" in result.output
    assert "25 points, 60 readings, least squares" in result.output
    assert "written: out.json, o/listing.txt, o/residuals.png" in result.output
    document = json.loads(Path("out.json").read_text())
    assert document["error"] is None
    assert len(document["sets"]) == 2
    for each in document["sets"]:
        assert set(each) == SET
        assert set(each["standard_errors"]) == {
            "X",
            "Y",
            "Z",
            "omega_minutes",
            "phi_minutes",
            "kappa_minutes",
        }
        assert np.shape(each["covariance"]) == (6, 6)
        assert each["converged"] is True
        assert isinstance(each["iterations"], int)
        assert len(each["points"]) == 25
        for point in each["points"]:
            assert set(point) == POINT
            assert all(len(point[name]) == 2 for name in ("mean", "residual", "redundancy", "standardized"))
    assert Path("o/listing.txt").read_text() == listing(run_deck(Path(str(EXAMPLE))))
    assert Path("o/residuals.png").read_bytes().startswith(b"\x89PNG")
    assert {path.name for path in tmp_path.iterdir()} == {"out.json", "o"}


def test_the_default_directory_is_named_like_the_deck(run, tmp_path):
    (tmp_path / "grid.deck").write_text(EXAMPLE.read_text())
    assert run("grid.deck").exit_code == 0
    assert run("--example").exit_code == 0
    for folder in ("grid-resected", "example-resected"):
        assert {path.name for path in (tmp_path / folder).iterdir()} == {"listing.txt", "report.html"}
    listings = [
        (tmp_path / folder / "listing.txt").read_text() for folder in ("grid-resected", "example-resected")
    ]
    assert listings == [listing(run_deck(Path(str(EXAMPLE))))] * 2


def test_a_deck_without_a_solution_leaves_no_directory(run, tmp_path):
    (tmp_path / "bad.deck").write_text("\n".join(EXAMPLE.read_text().splitlines()[:12]))
    assert run("bad.deck").exit_code == 1
    assert {path.name for path in tmp_path.iterdir()} == {"bad.deck"}


def test_the_document_agrees_with_the_result():
    done = run_deck(Path(str(EXAMPLE)))
    document = json.loads(done.to_json())
    for each, result in zip(document["sets"], done.results, strict=True):
        assert each["perspective_center"] == result.position.tolist()
        errors = np.array(list(each["standard_errors"].values()))
        deviations = np.sqrt(np.diagonal(each["covariance"]))
        np.testing.assert_allclose(errors, [*deviations[3:], *(deviations[:3] * 3437.7468)])
        points = each["points"]
        freedom = 2 * len(points) - 6
        squares = np.sum(np.square([point["residual"] for point in points]))
        assert each["sigma0_model"] == pytest.approx(np.sqrt(squares / freedom))


def test_as_published_and_weights(run):
    text = run("--example", "--as-published").output
    assert "as published, 3 iterations" in text
    equal, weighted = run("--example").output, run("--example", "--weights", "readings").output
    assert equal != weighted
    assert run("--example", "--weights", "best").exit_code == 2


def test_usage(run):
    assert run().exit_code == 2
    assert run("deck", "--example").exit_code == 2
    missing = run("nowhere")
    assert missing.exit_code == 1
    assert "nowhere: the file must be readable" in missing.output


def test_no_convergence_is_an_exit_code(run, tmp_path):
    text = EXAMPLE.read_text().replace("    0.0010", "    0.0000", 1)
    (tmp_path / "deck").write_text(text)
    result = run("deck", "--as-published", "--out", "o")
    assert result.exit_code == 3
    assert Path("o/listing.txt").read_text().count("SORRY - SOLUTION DOES NOT CONVERGE") == 2
    assert run("deck").exit_code == 0


def test_a_set_that_cannot_be_solved_stops_the_run(run, singular):
    result = run(singular, "--json", "out.json", "--out", "o", "--plots")
    assert result.exit_code == 3
    assert "NORMAL EQUATIONS MATRIX IS SINGULAR: a pose requires at least three points" in result.output
    document = json.loads(Path("out.json").read_text())
    assert len(document["sets"]) == 1
    assert document["error"].startswith("NORMAL EQUATIONS MATRIX IS SINGULAR")
    pages = Path("o/listing.txt").read_text().split("\f")
    assert "TWO POINTS" in pages[-1]
    assert pages[-1].rstrip().endswith("NORMAL EQUATIONS MATRIX IS SINGULAR")


def test_plots_that_cannot_be_drawn(run, tmp_path):
    with pytest.raises(InputError, match="got 'xyz'"):
        run_sketch(run_deck(Path(str(EXAMPLE))).results).save(tmp_path / "out.xyz")
    result = run("--example", "--out", "o", "--plots", "--plot-format", "xyz", "--json", "out.json")
    assert result.exit_code == 2
    assert list(tmp_path.iterdir()) == []


# The listing, item by item


def test_the_listing_has_every_item_in_order():
    text = listing(run_deck(Path(str(EXAMPLE)), as_published=True))
    items = [
        "PERSPECTIVE CENTER DETERMINATION", "SIMULATED PROJECTOR", "COORDINATOGRAPH ERRORS CORRECTED",
        "THE NUMBER OF POINTS USED ON THIS PLATE IS  25",
        "THE ASSUMED PRINCIPAL DISTANCE USED IN THESE COMPUTATIONS IS        150.000",
        "COORDINATES OF INPUT DATA", "PT NO", "ITER", "  0     250.00     250.00     300.00",
        "WITH THIS ITERATION THE SQUARE ROOT OF DX2+DY2+DZ2 IS LESS THAN     0.001",
        "COORDINATES OF THE PERSPECTIVE CENTER", "\f", "STEREOPLOTTER CALIBRATION INFORMATION",
        "RESIDUAL AND DISTORTION VALUES", "STANDARD ERROR OF UNIT WEIGHT OF PLATE GRID COORDINATES =",
        "VARIANCE-COVARIANCE MATRIX", "STANDARD ERRORS OF THE PERSPECTIVE CENTER PARAMETERS",
        "X COORDINATE =", "Y COORDINATE =", "Z COORDINATE =", "OMEGA (MINUTES) =", "PHI (MINUTES) =",
        "KAPPA (MINUTES) =", "STANDARD ERROR OF PROJECTED COORDINATES IN THE MODEL SPACE =", "\fDATA SET  2",
        "COORDINATOGRAPH ERRORS CORRECTED",
    ]  # fmt: skip
    place = 0
    for item in items:
        place = text.index(item, place) + len(item)
    assert text.count("PERSPECTIVE CENTER DETERMINATION") == 1


def test_numbers_of_the_listing_are_written_as_ibm_fortran_did():
    text = listing(run_deck(Path(str(EXAMPLE)), as_published=True))
    assert re.search(r"^  103 +\d +0\.0 +-80\.000 ", text, re.MULTILINE)
    assert re.search(r"^  1    ( ?-?0\.\d{8}D-\d\d){6}$", text, re.MULTILINE)
    result = run_deck(Path(str(EXAMPLE)), as_published=True).results[0]
    row = next(line for line in text.splitlines() if line.startswith(" 101 ") and len(line.split()) == 8)
    printed = [float(value) for value in row.split()[1:]]
    values = [result.projected[0, 0], result.residual[0, 0], result.projected[0, 1], result.residual[0, 1]]
    values += [result.observed_radius[0], result.fixed_radius[0], result.radial_distortion[0]]
    np.testing.assert_allclose(printed, values, rtol=0, atol=5.01e-4)


def test_fields_that_overflow_are_stars(tmp_path):
    text = EXAMPLE.read_text().replace("   150.000    0.0010", "   150.000 1000000.0")
    (tmp_path / "deck").write_text(text)
    assert "IS LESS THAN**********" in listing(run_deck(tmp_path / "deck", as_published=True))


# The page


def test_the_worked_example_of_the_page_is_what_the_command_prints(run):
    page = (REPOSITORY / "docs" / "perspective-center.md").read_text()
    printed = run("--example").output.split("\n\nwritten: ")[0]
    assert f"```text\n{printed}\n```" in page
