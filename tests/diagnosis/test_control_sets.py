"""Control as a whole against the free model: its Omega is what the control adds to that of the adjustment."""

import numpy as np
import pytest

from photogram import diagnose, simulate
from photogram.diagnosis.mistakes import Adjuster
from photogram.diagnosis.sets import doubtful, wrong_control

BLOCK = simulate(
    strips=3, photos_per_strip=6, points_per_photo=40, control_spacing=2, control_sd=0.05, seed=11
).block
ADJUSTER = Adjuster({"threads": 1})


def changed(factors):
    return BLOCK.replace(point_positions=BLOCK.point_positions * factors)


@pytest.mark.parametrize(
    ("factors", "kind"),
    [
        ([1, 1, 1 / 0.3048], "feet in heights"),
        ([1 / 0.3048, 1, 1], "feet in X"),
        ([1, 1 / 0.3048, 1], "feet in Y"),
        ([1 / 0.3048, 1 / 0.3048, 1], "feet in X and Y"),
    ],
)
def test_a_mistake_in_all_control_is_explained(factors, kind):
    block = changed(factors)
    assert doubtful(ADJUSTER.tried(block), "control")
    found = wrong_control(block, ADJUSTER)
    assert (found.best[0].name, found.is_certain) == (kind, True)
    np.testing.assert_allclose(
        found.best[0].change(block).point_positions[np.isfinite(block.point_sd).all(axis=1)],
        BLOCK.point_positions[np.isfinite(block.point_sd).all(axis=1)],
    )


@pytest.mark.parametrize(("axis", "size"), [(0, 30.0), (2, 30.0), (0, 300.0), (2, 300.0)])
def test_heights_in_feet_with_a_gross_error_beside(axis, size):
    """Both are named: the unit of all heights, and the point that is wrong besides."""
    positions = BLOCK.point_positions.copy()
    held = np.isfinite(BLOCK.point_sd)
    positions[held[:, 2], 2] /= 0.3048
    full = np.flatnonzero(held.all(axis=1))
    point = int(full[len(full) // 2])
    positions[point, axis] += size
    found = diagnose(BLOCK.replace(point_positions=positions), threads=1)
    assert [each.kind for each in found.grave] == ["control-set", "control-misfit"]
    assert "heights of the control are in feet" in found.grave[0].text
    assert found.grave[1].points == [BLOCK.point_ids[point]]
    assert found.verdict.code == "hint"


def test_good_control_is_neither_doubted_nor_explained():
    assert not doubtful(ADJUSTER.tried(BLOCK), "control")
    assert wrong_control(BLOCK, ADJUSTER) is None


@pytest.mark.parametrize("axis", range(3))
def test_single_wrong_points_are_no_mistake_of_all(axis):
    positions = BLOCK.point_positions.copy()
    point = int(np.flatnonzero(np.isfinite(BLOCK.point_sd).all(axis=1))[3])
    positions[point, axis] += 300.0
    assert wrong_control(BLOCK.replace(point_positions=positions), ADJUSTER) is None


def test_two_exchanged_points_are_exchanged_back():
    full = np.flatnonzero(np.isfinite(BLOCK.point_sd).all(axis=1))
    for one, other in ((0, -1), (1, 2)):
        positions = BLOCK.point_positions.copy()
        positions[full[[one, other]]] = positions[full[[other, one]]]
        found = wrong_control(BLOCK.replace(point_positions=positions), ADJUSTER)
        assert found.is_certain
        assert {*found.best[0].points} == {BLOCK.point_ids[point] for point in full[[one, other]]}


def test_a_blunder_beside_the_mistake_is_named_too():
    block = changed([1, 1, 1 / 0.3048])
    rays = np.bincount(block.image_points)
    row = int(np.flatnonzero(rays[block.image_points] >= 4)[9])
    xy = block.image_xy.copy()
    xy[row, 1] += 1.0
    found = diagnose(block.replace(image_xy=xy))
    kinds = {each.kind: each for each in found.grave}
    assert {*kinds} in ({"control-set", "blunder"}, {"control-set", "gross-error"})
    (other,) = {*kinds} - {"control-set"}
    assert kinds[other].points == [block.point_ids[block.image_points[row]]]
