"""The golden data: fifteen models, a restart, degenerate control, Gauss-Crout; tolerances of their README."""

import numpy as np
import pytest
from orientation_golden import array, cases, load, stations

from photogram import RankError, _photocore, orient
from photogram.absolute_orientation import Similarity


def check_parameters(similarity, expected):
    translation = array(expected["B"])
    if "A" in expected:
        np.testing.assert_allclose(similarity.rotation, expected["A"], rtol=0, atol=2e-9)
    angles = [expected[f"{name}_rad"] for name in ("omega", "phi", "kappa")]
    turns = (similarity.angles - angles + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(turns, 0, atol=2e-9)
    assert similarity.scale == pytest.approx(expected["s"], rel=1e-10)
    atol = 1e-8 * max(1.0, np.abs(translation).max())
    np.testing.assert_allclose(similarity.translation, translation, rtol=0, atol=atol)


def check_statistics(result, expected):
    assert result.rms == pytest.approx(expected["rms_model_units"], rel=1e-5)
    assert result.sigma0 == pytest.approx(expected["sigma0_model_units"], rel=1e-5)
    covariance = array(expected["covariance"])
    sd = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        result.similarity.covariance / np.outer(sd, sd), covariance / np.outer(sd, sd), atol=1e-4
    )


@pytest.mark.parametrize("case", cases())
@pytest.mark.parametrize("start", ["auto", "report", "closed-form"])
def test_a_model_is_oriented(case, start):
    result = orient(stations(case["stations"]), start=start)
    expected = case["expected"]
    assert result.converged
    similarity = result.similarity
    if case["id"] == "partial_min" and start != "report":
        # Two orientations fit seven coordinates exactly; only the report's start says which.
        assert len(result.alternatives) == 1
        similarity = result.alternatives[0] if start == "closed-form" else similarity
    check_parameters(similarity, expected)
    counts = case["counts"]
    assert (result.known, result.degrees_of_freedom) == (counts["n_known"], counts["dof"])
    if expected["covariance"] is None:
        assert result.similarity.covariance is None
        assert result.sigma0 is None
        assert np.isnan(result.standardized).all()
        return
    check_statistics(result, expected)
    np.testing.assert_allclose(np.nansum(result.redundancy), counts["dof"], rtol=1e-9)
    size = expected["rms_model_units"]
    u = array(expected["residuals_control_axes_model_units"])
    np.testing.assert_allclose(result.residuals, u, rtol=0, atol=1e-5 * size)
    ground = array(expected["residuals_ground_units"])
    np.testing.assert_allclose(result.residuals_ground, ground, rtol=0, atol=1e-5 * size / expected["s"])
    if expected.get("residuals_model_axes"):
        v = array(expected["residuals_model_axes"])
        np.testing.assert_allclose(result.model_residuals, v, rtol=0, atol=1e-5 * size)


@pytest.mark.parametrize("case", cases())
def test_points_are_transformed(case):
    result = orient(stations(case["stations"]))
    positions, covariances = result.similarity.transform(case["part2"]["model"])
    np.testing.assert_allclose(positions, case["part2"]["ground"], rtol=1e-8, atol=1e-8)
    assert np.isfinite(covariances).all() == (case["counts"]["dof"] > 0)


@pytest.mark.parametrize("case", cases())
def test_the_cycle_of_the_report(case):
    result = orient(stations(case["stations"]), method="report")
    check_parameters(result.similarity, case["expected"])
    assert abs(len(result.cycles) - case["reference_iteration"]["cycles"]) <= 1
    assert result.cycles[-1] <= 1e-5 < result.cycles[-2]
    initial = case["initial_corrected"]
    angles = [initial[f"{name}_rad"] for name in ("omega", "phi", "kappa")]
    turns = (result.initial.angles - angles + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(turns, 0, atol=1e-9)
    assert result.initial.scale == pytest.approx(initial["s"], rel=1e-9)
    size = max(1.0, np.abs(initial["B"]).max())
    np.testing.assert_allclose(result.initial.translation, initial["B"], rtol=0, atol=1e-9 * size)


@pytest.mark.parametrize("case", cases())
def test_filling_in_ends_beside_the_minimum_with_partial_control_only(case):
    result = orient(stations(case["stations"]), method="fill-in")
    difference = np.abs(result.similarity.rotation - case["expected"]["A"]).max()
    assert result.converged
    if case["id"].startswith("full") or case["counts"]["dof"] == 0:
        assert difference < 2e-8
    else:
        assert difference < 1e-5
    if case["id"].startswith("partial_mixed"):
        assert difference > 1e-7


def test_a_restart_after_a_rejection():
    document = load("cases.json")
    rerun = document["reruns"][0]
    base = next(case for case in document["cases"] if case["id"] == rerun["base_case"])
    first = orient(stations(base["stations"]))
    worst = np.nanargmax(np.abs(first.standardized).max(axis=1))
    assert first.stations.ids[worst] == str(rerun["removed_station"])

    reject = [rerun["removed_station"]]
    second = orient(first.stations, former=first, reject=reject)
    check_parameters(second.similarity, rerun["expected"])
    check_statistics(second, rerun["expected"])
    assert second.started == "restart"
    assert np.isnan(second.residuals[worst]).all()
    # The blunder of 5 m shows in the rejected station, and nowhere else.
    assert 4.5 < np.abs(second.differences[worst]).max() < 5.5
    assert np.abs(np.delete(second.differences, worst, axis=0)).max() < 0.1

    cycles = orient(first.stations, former=first, reject=reject, method="report").cycles
    assert abs(len(cycles) - rerun["reference_iteration"]["cycles_from_restart"]) <= 1


def test_degenerate_control_is_refused_by_name():
    messages = {}
    for case in load("degenerate_cases.json"):
        for method in ("rigorous", "report"):
            with pytest.raises(RankError) as caught:
                orient(stations(case["stations"]), method=method)
            messages[case["id"]] = caught.value
            assert caught.value.points == [str(row["id"]) for row in case["stations"]]
    fields = messages["one_horizontal"].phrase.fields
    assert (fields["x"] + fields["y"], fields["z"], fields["all"]) == (2, 3, 7)
    assert "in a straight line" in str(messages["collinear_vertical"])


def test_gauss_crout():
    golden = load("gauss_crout.json")
    rows = array(golden["P"])
    normal = rows[:, :7].T @ rows
    np.testing.assert_allclose(normal, golden["C"], atol=1e-10)
    d, e = _photocore.gauss_crout(normal)
    np.testing.assert_allclose(d, golden["D"], rtol=0, atol=1e-10)
    np.testing.assert_allclose(e, golden["E"], rtol=0, atol=1e-11)
    normal[:, 3], normal[3] = normal[:, 2], normal[2]
    assert _photocore.gauss_crout(normal) is None


@pytest.mark.parametrize("case", cases("full_noise", "partial_mixed"))
def test_a_legacy_solution_is_the_same_similarity(case):
    result = orient(stations(case["stations"])).similarity
    again = Similarity.from_parameters(result.scale, result.rotation, result.translation, result.covariance)
    here, there = (each.transform(case["part2"]["model"]) for each in (result, again))
    np.testing.assert_allclose(here[0], there[0], rtol=1e-12)
    np.testing.assert_allclose(here[1], there[1], rtol=1e-6, atol=1e-12 * here[1].max())
