"""The figures of the report from the readings of case 2, and the identities of its figures 29 and 30."""

import math

import numpy as np
import pytest
from plates import case_2, document, printed_correction, printed_polynomial, table

from photogram.comparator import built_in_grid
from photogram.comparator.averages import LocationAverages, PlateAverages, listed_grid_sigma
from photogram.comparator.case import exchanged
from photogram.comparator.fits import fit_rigid
from photogram.comparator.listing import table_nodes
from photogram.comparator.variance import AxisSigma, difference


@pytest.fixture(scope="module")
def chain():
    """Push case 2 through the printed parameters: flip, linear correction, polynomials, rigid fit."""
    placed = case_2().cases[0].placed
    corrected = printed_correction().apply(placed.means_um)
    return fit_rigid(placed.points, corrected, placed.grid_um, lost=9 / 4)


def test_feature_17_case_2_gives_figure_25(chain):
    figure = document("fig25_case2_final_residuals.json")
    residuals = chain.residuals
    for point, row in figure["points_available"].items():
        at = residuals.points.tolist().index(int(point))
        assert residuals.xy_um[at] == pytest.approx([row["x_adj"], row["y_adj"]], abs=0.01)
        assert residuals.comparator_um[at] == pytest.approx([row["vx_meas"], row["vy_meas"]], abs=0.005)
        assert residuals.grid_um[at] == pytest.approx([row["vx_grid"], row["vy_grid"]], abs=0.005)
    names = ("meas_x", "meas_y", "grid_x", "grid_y")
    assert residuals.squares_um2 == pytest.approx([figure["sum_vv"][n] for n in names], abs=0.06)
    assert residuals.sigma_um == pytest.approx([figure["sigma"][n] for n in names], abs=0.002)


def test_case_2_gives_the_derived_reference(chain):
    expected = document("derived_reference.json")["case2"]["with_fig30_all"]
    assert chain.residuals.squares_um2 == pytest.approx(tuple(expected["sum_vv_um2"].values()), rel=1e-6)
    assert math.degrees(chain.rotation_rad) == pytest.approx(expected["theta_deg"], rel=1e-6)
    order = np.argsort(chain.residuals.points)
    vectors = np.column_stack([expected["vx_um"], expected["vy_um"]])
    assert np.abs(chain.residuals.comparator_um[order] - vectors).max() < 5.1e-5
    linear = document("derived_reference.json")["case2"]["with_fig30_linear_only"]["sum_vv_um2"]
    placed = case_2().cases[0].placed
    fit = fit_rigid(placed.points, printed_correction().linear(placed.means_um), placed.grid_um)
    assert fit.residuals.squares_um2 == pytest.approx(tuple(linear.values()), rel=1e-6)


def test_without_the_flip_the_plate_does_not_fit():
    placed = case_2().cases[0].placed
    corrected = printed_correction().apply(placed.means_um)
    fit = fit_rigid(placed.points, corrected, exchanged(placed.grid_um, left_handed=True))
    assert np.abs(fit.residuals.grid_um).max() > 1000.0


def test_printed_signs_of_both_systems():
    """V = -R v: the rotation of case 2 takes printed comparator residuals to printed grid residuals."""
    c, s = math.cos(case_2().last_fits[0].rotation_rad), math.sin(case_2().last_fits[0].rotation_rad)
    for row in document("fig25_case2_final_residuals.json")["points_available"].values():
        turned = [-c * row["vx_meas"] - s * row["vy_meas"], s * row["vx_meas"] - c * row["vy_meas"]]
        assert turned == pytest.approx([row["vx_grid"], row["vy_grid"]], abs=0.001)


@pytest.fixture(scope="module")
def figure_29():
    """Return the averages of figure 29, with the sums of squares that its random errors stand for."""
    rows, summary = table("fig29_partial_grid_calibration.csv"), document("fig29_summary.json")
    columns = (
        "vx_meas_by_location_um",
        "vy_meas_by_location_um",
        "vx_grid_by_point_um",
        "vy_grid_by_point_um",
    )
    values = np.array([[float(row[column]) for column in columns] for row in rows])
    points = np.array([int(row["location_or_point"]) for row in rows])
    within = np.array([summary["random_errors_sigma"][axis] ** 2 for axis in "xy"]) * 25 * 4 * 3
    squares = within + 4 * (values[:, 2:] ** 2).sum(axis=0)
    xy = np.array([[float(row["x_adj_um"]), float(row["y_adj_um"])] for row in rows])
    cases = (1, 2, 3, 4)
    place = LocationAverages(cases, points, xy, values[:, :2])
    averages = PlateAverages(1320, True, cases, points, np.full(25, 4), values[:, 2:], squares, (place,), xy)
    return averages, summary


def test_feature_20_identities_of_figure_29(figure_29):
    averages, summary = figure_29
    sums = [*(averages.location_um**2).sum(axis=0), *(averages.grid_um**2).sum(axis=0)]
    assert sums == pytest.approx(list(summary["sum_vv"].values()), abs=0.004)
    assert [math.sqrt(value / 24) for value in sums] == pytest.approx(
        list(summary["sigma"].values()), abs=3e-4
    )
    assert np.abs(averages.grid_um.sum(axis=0)).max() < 0.0025
    listed = listed_grid_sigma(averages)
    assert listed.mean_comparator_um == pytest.approx(summary["standard_deviation"]["meas"], abs=2e-4)
    assert listed.mean_grid_um == pytest.approx(summary["standard_deviation"]["grid"], abs=1e-4)
    assert listed.random_um == pytest.approx(list(summary["random_errors_sigma"].values()), abs=1e-9)
    assert listed.grid_um == pytest.approx(summary["unbiased_grid_standard_error"], abs=2e-4)


def test_feature_20_total_of_figure_29_is_the_sigma_of_figure_30(figure_29):
    averages, _ = figure_29
    total = math.sqrt(float(averages.squares_um2.sum()) / 182)
    figure = document("fig30_calibration_summary.json")["statistics_um"]
    assert total == pytest.approx(figure["after_linear_and_nonlinear"]["total"], abs=6e-4)


def test_figure_29_coordinates_lie_on_the_grid(figure_29):
    averages, _ = figure_29
    grid = built_in_grid(1320)
    fit = fit_rigid(averages.points, averages.xy_um, exchanged(grid.xy_um, left_handed=True))
    assert np.abs(fit.residuals.grid_um).max() < 2.5


def test_feature_21_identities_of_figure_30():
    figure = document("fig30_calibration_summary.json")
    lines, linear = figure["statistics_um"], figure["linear"]
    before = AxisSigma(lines["rms_before"]["x"], lines["rms_before"]["y"])
    assert before.total == pytest.approx(lines["rms_before"]["total"], abs=6e-4)
    pointing = AxisSigma(lines["mean_pointing"]["x"], lines["mean_pointing"]["y"])
    assert pointing.total == pytest.approx(lines["mean_pointing"]["total"], abs=6e-4)
    # The sigma after the linear stage follows from the variance of the scales: var = sigma^2 / (4 sum dX^2).
    placed = case_2().cases[0].placed
    centred = placed.grid_um - placed.grid_um.mean(axis=0)
    after_linear = math.sqrt(linear["varcov"]["xx"] * 4 * (centred[:, 0] ** 2).sum())
    assert after_linear == pytest.approx(1.2556, abs=1e-4)
    systematic, _ = difference(before.total, after_linear)
    assert systematic == pytest.approx(lines["systematic_linear"]["value"], abs=6e-4)
    after = lines["after_linear_and_nonlinear"]["total"]
    nonlinear, _ = difference(after_linear, after)
    # Printed .837: the listing cut its sigmas to whole nanometres before.
    assert nonlinear == pytest.approx(lines["systematic_nonlinear"]["value"], abs=1.1e-3)
    random, negative = difference(after, lines["a_priori_grid"], lines["mean_pointing"]["total"])
    assert (round(random, 3), negative) == (0.843, False)


def test_figure_30_variances_have_the_structure_of_ours():
    linear = document("fig30_calibration_summary.json")["linear"]
    varcov = linear["varcov"]
    assert math.sqrt(varcov["xx"]) == pytest.approx(linear["sigma_scaler_x"], rel=1e-7)
    assert math.sqrt(varcov["yy"]) == pytest.approx(linear["sigma_scaler_y"], rel=1e-7)
    ours = case_2().linear.covariance / case_2().linear.sigma0_um ** 2
    ratio = varcov["xx"] / ours[0, 0]
    assert varcov["yy"] == pytest.approx(ratio * ours[1, 1], rel=1e-4)
    assert varcov["aa"]["value"] == pytest.approx(ratio * ours[2, 2], rel=1e-4)
    # The covariances are of another size than their own product: X and Y of this plate are nearly
    # uncorrelated.
    assert varcov["aa"]["value"] == pytest.approx(varcov["xx"] + varcov["yy"], rel=1e-4)
    ppm = 1e6 * (linear["scaler_x"]["value"] / linear["scaler_y"]["value"] - 1)
    assert ppm == pytest.approx(linear["sx_over_sy"]["um_per_m"], abs=0.011)
    assert math.degrees(math.sqrt(varcov["aa"]["value"])) * 3600 == pytest.approx(
        linear["sigma_alpha_arcsec"], abs=5e-4
    )


def test_feature_18_correction_table_of_figure_23():
    nodes = np.vstack(table_nodes(125_000.0))
    expected = document("derived_reference.json")["plot_table_fig30_um"]
    assert nodes / 1e6 == pytest.approx(np.array([[row["x"], row["y"]] for row in expected]), abs=1e-9)
    values = printed_polynomial().evaluate(nodes)
    printed = np.array([[row["dx_um"], row["dy_um"]] for row in expected])
    assert np.abs(values - printed).max() < 5.1e-4
