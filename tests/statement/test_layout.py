"""The layout of check points in a block: golden figures, and blocks whose figures are plain."""

import math

import numpy as np
import pytest
from golden_statement import control, golden
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from photogram.network.point_sets import area, hull, outside
from photogram.results.statement.comparison import layout as layout_of

SQUARE = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 10.0], [100.0, 100.0, 20.0], [0.0, 100.0, 0.0]])


def layout(points, extent, control):
    """Return the layout of points that may be lists."""
    return layout_of(np.array(points, dtype=float), extent, control)


def test_the_layout_of_the_golden_block_is_that_of_the_golden_statement():
    expected, rows = golden("statement.json")["layout"], control()
    check, held = rows["check"][1], rows["control"][1]
    found = layout(check, np.vstack([check, held]), held)
    assert found.diagonal == pytest.approx(expected["diagonal_m"], rel=1e-12)
    assert found.share_in_quadrants == pytest.approx(expected["share_in_quadrants"], rel=1e-12)
    assert found.least_spacing_over_diagonal == pytest.approx(
        expected["least_spacing_over_diagonal"], rel=1e-9
    )
    assert (found.count, found.even, found.apart) == (30, True, False)
    assert found.share_of_area_far == 0.0
    assert 0 < found.outside_control < 30
    assert 0.5 < found.share_of_heights <= 1.0


def test_a_single_point_in_the_middle_leaves_the_corners_unchecked():
    found = layout([[50.0, 50.0, 5.0]], SQUARE, SQUARE)
    # A third of the diagonal is nearly the half of a side: a circle with four thin caps beyond the square.
    radius = math.hypot(100, 100) / 3
    assert radius < 50
    assert found.share_of_area_far == pytest.approx(1 - math.pi * radius**2 / 100**2, abs=2e-3)
    assert math.isnan(found.least_spacing_over_diagonal)
    assert (found.apart, found.even, found.outside_control, found.share_of_heights) == (True, False, 0, 0.0)
    # On both middle lines: low.
    assert found.share_in_quadrants == (1.0, 0.0, 0.0, 0.0)


def test_only_the_area_within_the_hull_of_a_block_counts():
    triangle = SQUARE[[0, 1, 3]]
    corner = [[0.0, 100.0, 0.0]]
    radius = math.hypot(100, 100) / 3
    assert area(hull(triangle[:, :2])) == pytest.approx(5000)
    within = math.pi * radius**2 / 8  # of the circle about a corner of 45 degrees
    assert layout(corner, triangle, triangle).share_of_area_far == pytest.approx(1 - within / 5000, abs=1e-2)


def test_points_outside_the_hull_of_control_are_counted():
    points = [[10.0, 10.0, 1.0], [90.0, 10.0, 1.0], [90.0, 90.0, 1.0]]
    assert layout(points, SQUARE, SQUARE[[0, 1, 3]]).outside_control == 1
    assert layout(points, SQUARE, SQUARE[[0, 2]]).outside_control == 1
    assert layout(points, SQUARE, SQUARE[:1]).outside_control == 3
    assert layout(points, SQUARE, np.zeros((0, 3))).outside_control == 3


def test_heights_that_are_not_known_do_not_count():
    points = [[10.0, 10.0, math.nan], [90.0, 10.0, 5.0], [90.0, 90.0, 15.0]]
    assert layout(points, SQUARE, SQUARE).share_of_heights == pytest.approx(0.5)
    level = np.where([True, True, False], SQUARE, 3.0)
    assert math.isnan(layout(points, level, SQUARE).share_of_heights)
    assert math.isnan(layout([[1.0, 1.0, math.nan]], SQUARE, SQUARE).share_of_heights)


def test_two_points_at_one_place_have_no_spacing():
    assert layout([[1.0, 1.0, 0.0]] * 2, SQUARE, SQUARE).least_spacing_over_diagonal == 0.0
    assert layout(
        [[0.0, 0.0, 0.0], [30.0, 40.0, 0.0], [60.0, 90.0, 0.0]], SQUARE, SQUARE
    ).least_spacing_over_diagonal == (pytest.approx(50 / math.hypot(100, 100)))


POINTS = st.lists(st.tuples(st.integers(-50, 50), st.integers(-50, 50)), min_size=3, max_size=30)


@given(POINTS)
def test_a_hull_has_the_area_of_that_of_another_program_and_holds_its_points(points):
    plan = np.array(points, dtype=float)
    corners = hull(plan)
    assert not outside(plan, corners).any()
    if np.linalg.matrix_rank(plan - plan[0]) == 2:
        assert area(corners) == pytest.approx(ConvexHull(plan).volume, rel=1e-12)
    else:
        assert area(corners) == pytest.approx(0, abs=1e-9)
    far = plan + np.array([101.0, 0.0])
    assert outside(far, corners).all()


def test_a_block_at_one_place_has_no_layout():
    assert layout(SQUARE, SQUARE[:1], SQUARE) is None


def test_the_hull_of_many_points_is_that_of_all():
    from photogram.network import point_sets as module

    random = np.random.default_rng(3)
    for points in (
        random.uniform(-5, 9, (5000, 2)),
        random.standard_normal((4000, 2)) * [3, 0.01],
        np.column_stack([np.arange(2000.0), np.zeros(2000)]),
        np.repeat(random.uniform(0, 1, (7, 2)), 400, axis=0),
    ):
        found = module.hull(points)
        assert not module.outside(points, found).any()
        assert {tuple(corner) for corner in found} <= {tuple(point) for point in points}
