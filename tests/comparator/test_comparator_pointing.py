"""Pointing statistics: figure 7 to its last digit, pooling, error ellipses."""

import math

import numpy as np
import pytest
from plates import QUICK, case_2, document, noisy, table

from photogram.comparator import Options, calibrate
from photogram.comparator.readings import Ellipse, pool, pool_points, read_points

COLUMNS = {
    "n": (0, lambda own: own.count),
    "sd_x_um": (3, lambda own: own.precision.sd_um[0]),
    "sd_y_um": (3, lambda own: own.precision.sd_um[1]),
    "sd_point_um": (3, lambda own: own.precision.sd_point_um),
    "cov_xy_um2": (3, lambda own: own.precision.covariance_um2),
    "corr_pct": (2, lambda own: own.precision.listed_correlation_percent),
    "mean_x_um": (2, lambda own: own.mean_um[0]),
    "mean_y_um": (2, lambda own: own.mean_um[1]),
    "sdm_x_um": (3, lambda own: own.precision.mean_sd_um[0]),
    "sdm_y_um": (3, lambda own: own.precision.mean_sd_um[1]),
    "sdm_point_um": (3, lambda own: own.precision.mean_sd_point_um),
}


def test_feature_07_all_242_figures_of_figure_7():
    readings = {own.point: own for own in case_2().cases[0].placed.readings}
    compared = 0
    for row in table("fig07_case2_pointing_stats.csv"):
        for column, (decimals, value) in COLUMNS.items():
            if row[column]:
                found = value(readings[int(row["point"])])
                # Half a unit of the last digit, and rounding where the report cut a half.
                assert abs(found - float(row[column])) <= 0.5 * 10**-decimals + 1e-6, (row["point"], column)
                compared += 1
    assert compared == 242


def test_feature_07_pooled_statistics_of_case_2():
    pooled = document("derived_reference.json")["case2"]["pooled_um"]
    own = case_2().cases[0].placed.precision
    assert (own.readings, own.points) == (pooled["N"], pooled["L"])
    assert own.sd_um == pytest.approx((pooled["sx"], pooled["sy"]), rel=1e-6)
    assert own.mean_sd_um == pytest.approx((pooled["sxm"], pooled["sym"]), rel=1e-6)
    assert own.sd_point_um == pytest.approx(pooled["spt"], rel=1e-6)
    assert own.mean_sd_point_um == pytest.approx(pooled["sptm"], rel=1e-6)
    assert own.covariance_um2 == pytest.approx(pooled["cov"], rel=1e-6)
    assert own.listed_correlation_percent == pytest.approx(pooled["cor"], rel=1e-6)


def test_feature_07_single_and_identical_readings():
    points = np.array([1, 2, 2, 3, 3])
    xy = np.array([[1e5, 2e5], [3e5, 4e5], [3e5, 4e5], [5e5, 6e5], [5e5, 6.00001e5]])
    single, same, upright = read_points(points, xy)
    assert single.precision.sd_um == (0.0, 0.0)
    assert not single.identical
    assert same.identical
    assert same.precision.listed_correlation_percent == 0.0
    assert upright.precision.listed_correlation_percent == 100.0
    assert math.isnan(upright.precision.correlation)


def test_feature_08_pooling_over_operators_and_in_all():
    session = noisy(1, cases=8, operators=[3, 5], pointing_um=1.1)
    calibration = calibrate(session, QUICK)
    pointing = calibration.pointing
    assert list(pointing.operators) == [3, 5]
    readings = [own for case in calibration.cases for own in case.placed.readings]
    squares = sum(np.array(own.squares_um2) for own in readings)
    dof = sum(own.count - 1 for own in readings)
    assert pointing.total.degrees_of_freedom == dof == 8 * (128 - 25)
    assert pointing.total.variance_um2 == pytest.approx(squares / dof)
    first = [own for case in calibration.cases[:4] for own in case.placed.readings]
    by_point, total = pointing.operators[3]
    assert total.variance_um2 == pytest.approx(pool(first).variance_um2)
    of_seven = [own for own in first if own.point == 7]
    expected = sum(own.squares_um2[0] for own in of_seven) / sum(own.count - 1 for own in of_seven)
    assert by_point[7].variance_um2[0] == pytest.approx(expected)


def test_feature_08_degrees_of_freedom_of_the_listing():
    session = noisy(1, cases=4)
    text, listing = (
        calibrate(session, QUICK),
        calibrate(session, Options(joint=False, as_published=True)),
    )
    total = 4 * 128
    ratio = listing.pointing.total.variance_um2[0] / text.pointing.total.variance_um2[0]
    assert ratio == pytest.approx((total - 100) / (total - 25))
    of_seven = listing.pointing.points[7].degrees_of_freedom
    assert (of_seven, text.pointing.points[7].degrees_of_freedom) == (19, 16)


def test_feature_08_the_text_is_unbiased_and_the_listing_is_not():
    """Sums of squares over readings less means estimate the variance; over more they fall short."""
    rng = np.random.default_rng(8)
    text, listing = [], []
    for _ in range(300):
        cases = []
        for _ in range(4):
            points = np.repeat(np.arange(5), 3)
            cases.append(read_points(points, 1e5 + rng.standard_normal((15, 2))))
        text.append(pool_points(cases)[1].variance_um2[0])
        listing.append(pool_points(cases, as_published=True)[1].variance_um2[0])
    assert np.mean(text) == pytest.approx(1.0, abs=4 * np.std(text) / math.sqrt(300))
    assert np.mean(listing) == pytest.approx(40 / 55, abs=4 * np.std(listing) / math.sqrt(300))


def test_feature_09_ellipses_are_eigenvectors():
    rng = np.random.default_rng(9)
    for _ in range(50):
        a = rng.standard_normal((2, 2))
        matrix = a @ a.T
        ellipse = Ellipse.of(matrix[0, 0], matrix[1, 1], matrix[0, 1])
        values, vectors = np.linalg.eigh(matrix)
        assert (ellipse.minor_um, ellipse.major_um) == pytest.approx(np.sqrt(values))
        along = np.array([math.cos(ellipse.angle_rad), math.sin(ellipse.angle_rad)])
        assert abs(along @ vectors[:, 1]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("matrix", "angle"),
    [((2.0, 2.0, 0.5), 45.0), ((2.0, 2.0, -0.5), -45.0), ((3.0, 1.0, 0.0), 0.0), ((1.0, 3.0, 0.0), 90.0)],
)
def test_feature_09_directions_of_special_ellipses(matrix, angle):
    assert math.degrees(Ellipse.of(*matrix).angle_rad) == pytest.approx(angle)


def test_feature_09_confidence_factors():
    from photogram.comparator.readings import CONFIDENCE_FACTORS

    for percent, factor in CONFIDENCE_FACTORS.items():
        # P(chi squared with two degrees of freedom <= factor^2) = 1 - exp(-factor^2 / 2)
        assert 100 * (1 - math.exp(-(factor**2) / 2)) == pytest.approx(percent, abs=0.6)
