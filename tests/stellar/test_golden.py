"""Computed references written from the report's specification, at the tolerances of their README."""

from dataclasses import replace

import golden
import numpy as np
import pytest
from star_plates import columns

from photogram import _photocore
from photogram.stellar import ARCSEC, GRAD, INDEX, NAMES, Air, Site, calibrate, refraction
from photogram.stellar.curves import distortion_curves
from photogram.stellar.movement import common_attitudes, modify
from photogram.stellar.places import transformed_angles


@pytest.fixture(scope="module")
def noisy():
    document = golden.load("golden_adjustment_noisy")
    return document, calibrate(golden.problem(document, as_published=True))


def test_refraction():
    document = golden.load("golden_refraction")
    for row in document["rows"]:
        air, z = Air(row["T_K"], row["P_mmHg"]), np.radians(row["zd_deg"])
        for name, observed in (("observed", True), ("true", False)):
            expected = row[f"refraction_if_zd_is_{name}_arcsec"]
            if expected is not None:
                found = refraction(z, air, tau=document["tau"], observed=observed)[0] / ARCSEC
                assert found == pytest.approx(expected, abs=1e-9)


def test_forward():
    document = golden.load("golden_forward")
    parameters = golden.vector(document["parameters"])
    for sample in document["samples"]:
        one = {
            **document,
            "initial": document["parameters"],
            "results": {"input_m": None},
            "stars": [
                {
                    "nost": 1,
                    "alpha": sample["alpha"],
                    "delta": sample["delta"],
                    "P": [1.0, 1.0, 0.0],
                    "obs": [[101, *sample["measured"], sample["ST"], sample["orient"]]],
                }
            ],
        }
        problem = golden.problem(one)
        core = problem.core(parameters, problem.star_places, np.zeros(26, bool))
        found = core.published(refraction=1e-14, distortion=1e-12, passes=6)
        matrix = _photocore.pointing_matrix(parameters[3 * sample["orient"] :][:3])
        assert matrix == pytest.approx(np.array(sample["M"]), abs=1e-12)
        assert found["standard"][0] == pytest.approx([sample["xi"], sample["eta"]], abs=1e-12)
        assert found["undistorted"][0] == pytest.approx(sample["undistorted"], abs=1e-12)
        rows = columns(found, problem.image_groups)[0]
        expected = np.array([sample["B_orientation_row_x"], sample["B_orientation_row_y"]])
        assert rows == pytest.approx(expected, abs=1e-12)
        assert found["star"][0] == pytest.approx(np.array(sample["B_star"]), abs=1e-12)


def test_adjustment_without_error():
    document = golden.load("golden_adjustment_exact")
    result = calibrate(golden.problem(document, as_published=True))
    expected = document["results"]
    values = golden.vector(expected["parameters"])
    errors = np.array([result.mean_errors[name] for name in NAMES[:22]])
    given = [expected["mean_errors"][golden.TO_GOLDEN.get(name, name)] for name in NAMES[:22]]
    assert errors == pytest.approx(given, rel=1e-8)
    assert np.abs((result.solved.parameters - values)[:22] / errors).max() < 1e-8
    levels = list(result.levels)
    assert levels == pytest.approx(expected["levels_of_discrepancy"], rel=1e-6)


def test_strict_adjustment_without_error_comes_to_the_truth():
    document = golden.load("golden_adjustment_exact")
    result = calibrate(golden.problem(document))
    # Coordinates are rounded to 1e-8 m: a three-hundredth of the mean error that scales the mean errors.
    errors = np.array([result.mean_errors[name] for name in NAMES[:22]])
    off = (result.solved.parameters - golden.vector(document["true_parameters"]))[:22]
    assert result.converged
    assert np.abs(off / errors).max() < 0.01


def test_adjustment_with_noise(noisy):
    document, result = noisy
    expected = document["results"]
    errors = np.array([expected["mean_errors"][golden.TO_GOLDEN.get(name, name)] for name in NAMES[:22]])
    off = (result.solved.parameters - golden.vector(expected["parameters"]))[:22]
    assert np.abs(off / errors).max() < 1e-6
    assert result.degrees_of_freedom == expected["dof"]
    assert result.mean_error == pytest.approx(expected["m_unit_weight"], rel=1e-9)
    assert result.solved.sums == pytest.approx(expected["pvv_plate_star_orient"], rel=1e-9)
    assert result.solved.cofactors[:22, :22] == pytest.approx(np.array(expected["Ninv_22"]), rel=1e-6)
    levels = list(result.levels)
    assert levels == pytest.approx(expected["levels_of_discrepancy"], rel=1e-9)
    stars = np.array(expected["star_residuals_arcsec"])
    assert result.star_residuals / ARCSEC == pytest.approx(stars, abs=1e-9)


def test_counts_are_those_of_the_printed_sample(plate):
    """The report's 75 stars with five images each and one weighted parameter: 729 degrees of freedom."""
    weights = np.zeros((26, 26))
    weights[INDEX["epsilon"], INDEX["epsilon"]] = 1.0
    counts = calibrate(replace(plate, parameter_weights=weights)).counts
    assert counts.parameter_observations == 1
    assert (counts.star_observations, counts.plate_observations) == (150, 750)
    assert (counts.observations, counts.unknowns, counts.degrees_of_freedom) == (901, 172, 729)


def test_strict_solution_is_near_the_published_one(noisy):
    document, published = noisy
    strict = calibrate(golden.problem(document))
    errors = np.array([published.mean_errors[name] for name in NAMES[:22]])
    off = (strict.solved.parameters - published.solved.parameters)[:22]
    assert np.abs(off / errors).max() < 0.03
    assert sum(strict.solved.sums) <= sum(published.solved.sums)


def test_combination():
    document = golden.load("golden_adjustment_noisy")
    expected = golden.load("golden_combine")
    spread, rows = common_attitudes((("pre", "event"), ("post", "event")))
    c = (np.eye(26) - spread)[rows, :22]
    assert c == pytest.approx(np.array(expected["C"]), abs=0)
    misclosure = -c @ golden.vector(document["results"]["parameters"])[:22]
    cofactors = np.array(document["results"]["Ninv_22"])
    step, combined = modify(cofactors, np.zeros(22), c, misclosure)
    scale = np.sqrt(np.diag(cofactors))
    given = np.array(expected["delta_o"]) / scale
    assert step / scale == pytest.approx(given, rel=0, abs=1e-10 * np.abs(given).max())
    given = np.array(expected["Ninv_combined_diag"])
    # Of what is left of cofactors a million times as large.
    assert np.diag(combined) / scale**2 == pytest.approx(given / scale**2, rel=0, abs=1e-10)


def test_transformation():
    for case in golden.load("golden_transform")["cases"]:
        station, reference = (Site(*np.radians(case[name])) for name in ("station", "reference"))
        x, y = (value * ARCSEC for value in case["pole_arcsec"])
        found = transformed_angles(np.array(case["in_grads"]) * GRAD, station, reference, (x, y)) / GRAD
        off = np.remainder(found - case["out_grads"] + 200, 400) - 200
        assert np.abs(off).max() < 1e-10


def test_curves():
    expected = golden.load("golden_curves")
    document = golden.load("golden_adjustment_exact")
    curves = distortion_curves(calibrate(golden.problem(document, as_published=True, crossover=0.065)))
    assert curves.scale == pytest.approx(expected["K0"], rel=1e-9)
    assert curves.calibrated == pytest.approx(expected["c_star"], rel=1e-9)
    assert curves.calibrated_error == pytest.approx(expected["m_c_star"], rel=1e-9)
    for row, *values in zip(
        expected["rows"],
        curves.radial,
        curves.radial_error,
        curves.transformed,
        curves.transformed_error,
        curves.decentering,
        curves.decentering_error,
        strict=True,
    ):
        names = ("radial", "m_radial", "transformed", "m_transformed", "decentering", "m_decentering")
        for name, value in zip(names, values, strict=True):
            assert 1e6 * value == pytest.approx(row[f"{name}_um"], rel=1e-9, abs=1e-12)
