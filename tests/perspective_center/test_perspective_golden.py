"""Golden decks of program W5344 at the tolerances of their README."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from photogram import InputError, RankError
from photogram.perspective_center import Coordinatograph, determine, read_deck, reduce, run_deck, solution
from photogram.perspective_center.listing import listing

ORDER = ["omega_min", "phi_min", "kappa_min"]


@pytest.fixture
def double(monkeypatch):
    """Let what is iterated as published keep all digits: the expected values of the data are in double."""
    monkeypatch.setattr(solution, "single", lambda values: values)


def compare(result, double, *, length=1e-7, minutes=1e-6, relative=1e-7):
    """Compare a set with the expected values of the listing in double precision."""
    last = double["iterations"][-1]
    np.testing.assert_allclose(result.position, [last[k] for k in "XYZ"], rtol=0, atol=length)
    np.testing.assert_allclose(result.attitude_minutes, [last[k] for k in ORDER], rtol=0, atol=minutes)
    assert result.sigma0_plate == pytest.approx(double["std"], rel=relative)
    errors = [double["standard_errors"][k] for k in [*"XYZ", *ORDER]]
    np.testing.assert_allclose(result.standard_errors, errors, rtol=relative)


def compare_exactly(result, double):
    """Compare everything that the listing prints of a set."""
    compare(result, double)
    assert result.converged == double["converged"]
    assert result.sigma0_model == pytest.approx(double["stdm"], rel=1e-7)
    for cycle, printed in zip(result.cycles, double["iterations"], strict=True):
        np.testing.assert_allclose(cycle.position, [printed[k] for k in "XYZ"], rtol=0, atol=1e-7)
        np.testing.assert_allclose(cycle.correction, [printed[f"d{k}"] for k in "XYZ"], rtol=0, atol=1e-7)
        np.testing.assert_allclose(cycle.attitude_minutes, [printed[k] for k in ORDER], rtol=0, atol=1e-6)
    deviations = np.sqrt(np.diagonal(result.covariance))
    np.testing.assert_allclose(
        result.covariance / np.outer(deviations, deviations),
        np.array(double["variance_covariance"]) / np.outer(deviations, deviations),
        rtol=0,
        atol=1e-6,
    )
    points = double["points"]
    assert list(result.grid.ids) == [point["point"] for point in points]
    pairs = [("x_projected", result.projected[:, 0]), ("y_projected", result.projected[:, 1])]
    pairs += [("vx", result.residual[:, 0]), ("vy", result.residual[:, 1])]
    pairs += [("observed_radius", result.observed_radius), ("fixed_radius", result.fixed_radius)]
    pairs += [("radial_distortion", result.radial_distortion)]
    for name, values in pairs:
        np.testing.assert_allclose(values, [point[name] for point in points], rtol=0, atol=1e-7, err_msg=name)


# Sets as published


@pytest.mark.usefixtures("double")
def test_multiple_readings_and_coordinatograph(golden, expected):
    wanted = expected("synthetic_multi_reading")
    (grid,) = read_deck(golden / "decks" / "synthetic_multi_reading.txt")
    inputs = wanted["inputs"]
    assert grid.readings.tolist() == [each["n"] for each in inputs]
    for axis, name in enumerate("xy"):
        corrected = [each[f"{name}_corrected"] for each in inputs]
        np.testing.assert_allclose(grid.model[:, axis], corrected, rtol=0, atol=1e-9)
        deviations = [each[f"std_{name}"] for each in inputs]
        np.testing.assert_allclose(grid.reading_sd[:, axis], deviations, rtol=0, atol=1e-9)
    compare_exactly(determine(grid, as_published=True), wanted["listing_double"])


@pytest.mark.usefixtures("double")
def test_two_sets_on_one_grid(golden, expected):
    sets = expected("synthetic_two_sets")["sets"]
    run = run_deck(golden / "decks" / "synthetic_two_sets.txt", as_published=True)
    assert [result.grid.number for result in run.results] == [1, 2]
    for result, each in zip(run.results, sets, strict=True):
        assert (result.grid.model[:, 2] == each["z_level"]).all()
        compare_exactly(result, each["listing_double"])


@pytest.mark.usefixtures("double")
def test_two_jobs_in_one_run(golden, expected):
    run = run_deck(golden / "decks" / "synthetic_batch.txt", as_published=True)
    wanted = [
        expected("synthetic_two_sets")["sets"][0]["listing_double"],
        expected("synthetic_multi_reading")["listing_double"],
    ]
    for result, double in zip(run.results, wanted, strict=True):
        compare_exactly(result, double)
    pages = listing(run).split("\f")
    assert sum("PERSPECTIVE CENTER DETERMINATION" in page for page in pages) == 2
    assert all(result.grid.title in listing(run) for result in run.results)


@pytest.mark.usefixtures("double")
def test_no_convergence_goes_on_with_the_last_values(golden, expected):
    wanted = expected("synthetic_no_convergence")
    run = run_deck(golden / "decks" / "synthetic_no_convergence.txt", as_published=True)
    (result,) = run.results
    assert (result.converged, len(result.cycles), run.stop) == (False, wanted["cycles"], None)
    compare_exactly(result, wanted["listing_double"])
    text = listing(run)
    assert wanted["message"] in text
    for missing in (
        "WITH THIS ITERATION",
        "COORDINATES OF THE PERSPECTIVE CENTER",
        "STEREOPLOTTER CALIBRATION",
    ):
        assert missing not in text
    assert "RESIDUAL AND DISTORTION VALUES" in text
    assert "STANDARD ERRORS OF THE PERSPECTIVE CENTER PARAMETERS" in text


# Faults


def test_cards_out_of_order(golden, expected):
    wanted = expected("synthetic_out_of_order")
    deck = golden / "decks" / "synthetic_out_of_order.txt"
    with pytest.raises(InputError) as caught:
        read_deck(deck)
    assert caught.value.message.startswith(wanted["message"])
    assert (caught.value.record, caught.value.text.split()[0]) == (18, "5")
    run = run_deck(deck, as_published=True)
    assert run.results == []
    assert " ".join(listing(run).split()).endswith(wanted["message"])


@pytest.mark.parametrize("as_published", [True, False])
def test_singular_normal_equations(golden, expected, as_published):
    wanted = expected("synthetic_singular")
    deck = golden / "decks" / "synthetic_singular.txt"
    (grid,) = read_deck(deck)
    with pytest.raises(RankError, match=f"{wanted['message']}: a pose requires at least three points"):
        determine(grid, as_published=as_published)
    run = run_deck(deck, as_published=as_published)
    assert run.results == []
    text = listing(run)
    assert text.rstrip().endswith(wanted["message"])
    assert "COORDINATES OF INPUT DATA" in text


# The sample of the report


@pytest.fixture
def sample(golden):
    return json.loads((golden / "sample_solution.json").read_text())


@pytest.mark.usefixtures("double")
@pytest.mark.parametrize("name", ["sample_reconstructed", "sample_identity_correction"])
def test_sample_as_published(golden, sample, name):
    (result,) = run_deck(golden / "decks" / f"{name}.txt", as_published=True).results
    compare(result, sample["reproduction_listing_double"])


def test_sample_by_least_squares(golden, sample):
    (result,) = run_deck(golden / "decks" / "sample_reconstructed.txt").results
    exact = sample["exact_least_squares_reconstructed"]
    np.testing.assert_allclose(result.position, [exact[k] for k in "XYZ"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.attitude_minutes, [exact[k] for k in ORDER], rtol=0, atol=1e-6)
    assert result.sigma0_plate == pytest.approx(exact["std"], rel=1e-9)
    compare(result, sample["reproduction_listing_double"], length=5e-6, minutes=5e-5, relative=2e-5)


@pytest.mark.parametrize("as_published", [True, False])
def test_sample_against_the_printout(golden, sample, as_published):
    (result,) = run_deck(golden / "decks" / "sample_reconstructed.txt", as_published=as_published).results
    printed = sample["printed_iterations"]
    last = printed[-1]
    if as_published:
        # The corrections of the last cycle are what single precision had cut off in the one before.
        for cycle, row in zip(result.cycles, printed[1:], strict=True):
            assert [f"{each:.4f}" for each in cycle.correction] == [f"{row[f'd{k}']:.4f}" for k in "XYZ"]
            assert [f"{each:.4f}" for each in cycle.attitude_minutes] == [f"{row[k]:.4f}" for k in ORDER]
        assert len(result.cycles) == 2
    np.testing.assert_allclose(result.position, [last[k] for k in "XYZ"], rtol=0, atol=0.0051)
    assert result.sigma0_plate == pytest.approx(sample["printed_std_unit_weight_mm"], abs=5.1e-6)
    assert result.sigma0_model == pytest.approx(sample["printed_stdm_mm"], abs=5.1e-6)
    errors = [sample["printed_standard_errors"][k] for k in [*"XYZ", *ORDER]]
    np.testing.assert_allclose(result.standard_errors, errors, rtol=0, atol=5.1e-6)
    with (golden / "sample_points.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    columns = {
        "vx": (result.residual[:, 0], 6e-4),
        "vy": (result.residual[:, 1], 6e-4),
        "x_projected": (result.projected[:, 0], 8e-4),
        "y_projected": (result.projected[:, 1], 8e-4),
        "observed_radius": (result.observed_radius, 8e-4),
        "fixed_radius": (result.fixed_radius, 8e-4),
        "radial_distortion": (result.radial_distortion, 8e-4),
    }
    for name, (values, tolerance) in columns.items():
        printed_values = [float(row[name]) for row in rows]
        np.testing.assert_allclose(values, printed_values, rtol=0, atol=tolerance, err_msg=name)
    if as_published:
        matrix = np.array(sample["printed_vcv"])
        checked = [(i, i) for i in range(6)] + [(0, 4), (1, 3)]
        for place in checked:
            assert result.covariance[place] == pytest.approx(matrix[place], rel=1e-5)


def test_sample_with_printed_coordinates(golden, sample):
    (result,) = run_deck(golden / "decks" / "sample_printed.txt").results
    last = sample["reproduction_listing_double"]["iterations"][-1]
    np.testing.assert_allclose(result.position, [last[k] for k in "XYZ"], rtol=0, atol=0.0005)
    np.testing.assert_allclose(result.attitude_minutes, [last[k] for k in ORDER], rtol=0, atol=0.003)
    assert result.sigma0_plate == pytest.approx(sample["printed_std_unit_weight_mm"], rel=0.01)
    errors = [sample["printed_standard_errors"][k] for k in [*"XYZ", *ORDER]]
    np.testing.assert_allclose(result.standard_errors, errors, rtol=0.01)


# Reduction


def test_means_and_deviations(expected):
    for case in expected("rmse_cases"):
        readings = np.array([[*reading, 0.0] for reading in case["readings"]])
        grid = reduce([readings], ids=[1], plate_xy=np.zeros((1, 2)), principal_distance=150.0)
        np.testing.assert_allclose(grid.model[0, :2], case["mean"], rtol=1e-12)
        np.testing.assert_allclose(grid.reading_sd[0], case["std"], rtol=1e-9, atol=1e-12)


def test_coordinatograph(expected):
    for case in expected("coordinatograph_cases"):
        factors = Coordinatograph(case["xscal"], case["yscal"], case["sinalp"])
        corrected = factors.correct(np.column_stack([case["x"], case["y"]]))
        wanted = np.column_stack([case["x_corrected"], case["y_corrected"]])
        np.testing.assert_allclose(corrected, wanted, rtol=0, atol=1e-9, err_msg=case["description"])
