"""Marks from distances: properties that hold whatever the figures are."""

import math

import numpy as np
import pytest

from message_codes import coded
from photogram import AdjustmentError
from photogram.film import Crossing, MarkDistance, RightAngle, adjust_distances
from photogram.film.distances import _linearized, _observed

DESIGN = {"ll": (-106, -106), "ur": (106, 106), "ul": (-106, 106), "lr": (106, -106)}
DESIGN |= {"ml": (-110, 0), "mr": (110, 0), "mt": (0, 110), "mb": (0, -110)}
MARKS = tuple(DESIGN)
LINES = ("ml", "mr", "mb", "mt")


def place(seed, sd=0.02):
    return np.array([*DESIGN.values()], float) + np.random.default_rng(seed).normal(0, sd, (8, 2))


def distances(xy, pairs, sd=0.003, seed=None):
    noise = np.zeros(len(pairs)) if seed is None else np.random.default_rng(seed).normal(0, sd, len(pairs))
    return [
        MarkDistance(MARKS[i], MARKS[j], float(np.hypot(*(xy[j] - xy[i]))) + e, sd)
        for (i, j), e in zip(pairs, noise, strict=True)
    ]


ALL = [(i, j) for i in range(8) for j in range(i)]


def test_partials_are_those_of_differences():
    xy, step = place(1, 3.0), 1e-5
    distance = MarkDistance("ll", "mt", 1.0, 1.0)
    rows = _observed(MARKS, [distance], [RightAngle(LINES, 1.0), Crossing(LINES, 1.0)])
    values, partials = _linearized(rows, xy)
    assert values == pytest.approx([float(row.at(xy).real) for row in rows])
    for k in range(16):
        moved = np.zeros(16)
        moved[k] = step
        both = [np.array([row.at(xy + sign * moved.reshape(8, 2)) for row in rows]) for sign in (1, -1)]
        assert partials[:, k] == pytest.approx((both[0].real - both[1].real) / (2 * step), abs=1e-8)


def test_a_free_figure_is_the_true_one_as_near_to_the_design_as_it_comes():
    true, design = place(2), np.array([*DESIGN.values()], float)
    found = adjust_distances(MARKS, design, distances(true, ALL), design_sd=np.full(8, 0.02))
    assert found.free == 3
    # The best rigid fit of the true figure to the design (Procrustes).
    a, b = true - true.mean(axis=0), design - design.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    assert np.abs(a @ u @ v + design.mean(axis=0) - found.xy).max() < 1e-9


def test_lines_move_the_figure_to_the_minimum_of_all_squares():
    true, design = place(3), np.array([*DESIGN.values()], float)
    lines = [RightAngle(LINES, 1.5e-4, math.radians(90.01)), Crossing(LINES, 0.01, (0.03, -0.05))]
    few = [(MARKS.index("ml"), MARKS.index("mr")), (MARKS.index("ll"), MARKS.index("ur"))]
    found = adjust_distances(
        MARKS, design, distances(true, few, seed=1), design_sd=np.full(8, 0.02), conditions=lines
    )
    rows = _observed(MARKS, distances(true, few, seed=1), lines)

    def squares(xy):
        own = sum(((each.observed - each.at(xy).real) / each.sd) ** 2 for each in rows)
        return own + float((((design - xy) / 0.02) ** 2).sum())

    least = squares(found.xy)
    assert least == pytest.approx(found.test.weighted_sum_of_squares)
    rng = np.random.default_rng(0)
    assert all(squares(found.xy + rng.normal(0, 1e-4, (8, 2))) > least for _ in range(50))
    assert found.redundancy.sum() == pytest.approx(found.degrees_of_freedom)


def test_a_crossing_leaves_a_turn_alone_open():
    true = place(4)
    found = adjust_distances(
        MARKS,
        true,
        distances(true, ALL, seed=2),
        design_sd=np.full(8, 0.02),
        conditions=[Crossing(LINES, 0.01)],
    )
    assert found.free == 1
    assert found.degrees_of_freedom == 28 + 2 - 16 + 1
    assert found.redundancy.sum() == pytest.approx(found.degrees_of_freedom)


def test_as_many_distances_that_leave_a_mark_loose_go_with_the_design():
    true = place(5)
    pairs = [*[pair for pair in ALL if 7 not in pair][:13], (7, 6)]
    found = adjust_distances(MARKS, true, distances(true, pairs), design_sd=np.full(8, 0.02))
    assert found.free == 0


def test_standard_deviations_are_those_of_repeated_measurements():
    true = place(6)
    rows = []
    for seed in range(400):
        found = adjust_distances(MARKS, true, distances(true, ALL, seed=seed), design_sd=np.full(8, 0.02))
        rows.append((found.xy - true).ravel())
    scatter = np.array(rows).std(axis=0)
    assert scatter == pytest.approx(np.sqrt(np.diag(found.covariance)), rel=0.15)


def test_distances_that_no_figure_has():
    apart = [MarkDistance("ll", "ur", 1.0, 1e-9), MarkDistance("ur", "ul", 1e9, 1e-9)]
    with pytest.raises(AdjustmentError, check=coded("films.distances-not-converged")):
        adjust_distances(MARKS[:3], place(7)[:3], apart, design_sd=np.full(3, 1e-9))
