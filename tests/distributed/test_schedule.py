"""Counted work and the schedule over a tree."""

import numpy as np
import pytest

from photogram.distributed.cut import Incidence, counted_work, cut, outer_vertices, tree_of
from photogram.distributed.plan import scheduled


def grid(rows, columns):
    """Return photos on a grid, each point on three along and two across."""
    across, along = (each.ravel() for each in np.mgrid[:rows, :columns])
    edges = [
        (row * columns + column, (row + i) * columns + column + j)
        for row in range(rows - 1)
        for column in range(columns - 2)
        for i in (0, 1)
        for j in (0, 1, 2)
    ]
    edge, vertex = np.array(edges).T
    places = np.column_stack([3.0 * along, 7.0 * across, 0.0 * along])
    return places, Incidence(vertex, edge, rows * columns)


def test_one_part_counts_what_many_do_together():
    places, incidence = grid(16, 16)
    images = np.full(256, 100.0)
    _, one = counted_work(places, images, lambda: [incidence], 1)
    tree, four = counted_work(places, images, lambda: [incidence], 4)
    assert four.photos.sum() == one.photos.sum() == 256
    assert four.images.sum() == pytest.approx(one.images.sum(), abs=7)
    assert four.factor.sum() == pytest.approx(one.factor.sum())
    assert four.formation.sum() == pytest.approx(one.formation.sum())
    assert four.outer[tree.root] == 0
    assert (four.outer[:-1] > 0).all()
    # Dense elimination in any order: no less than the diagonal, no more than the full matrix.
    assert 256 * 6**3 / 6 < one.factor[0] < (256 * 6) ** 3 / 6


def test_outer_vertices_are_those_of_an_elimination():
    places, incidence = grid(8, 8)
    found = cut(places, np.ones(64), lambda: [incidence], 4)
    outer = outer_vertices(found.tree, found.owners, [incidence])
    tied = np.zeros((64, 64), dtype=bool)
    for edge in range(64):
        vertices = incidence.vertices[incidence.edges == edge]
        tied[np.ix_(vertices, vertices)] = True
    for node in range(len(found.tree)):
        own = np.flatnonzero(found.owners == node)
        near = np.flatnonzero(tied[own].any(axis=0))
        for each in own:
            others = np.flatnonzero(tied[each])
            tied[np.ix_(others, others)] = True
        assert set(near[found.owners[near] > node].tolist()) <= set(outer[node].tolist())
        assert (found.owners[outer[node]] > node).all()


def test_a_schedule_keeps_workers_and_ways():
    tree = tree_of(8)
    seconds, sizes = np.ones(len(tree)), np.full(len(tree), 10.0)
    traffic = sizes, sizes, sizes
    one = scheduled(tree, seconds, seconds, seconds, traffic, 1, 1e9)
    assert (one.up, one.down, one.inversion) == (15.0, 15.0, 15.0)
    assert one.moved_up == one.moved_down == 0.0
    many = scheduled(tree, seconds, seconds, seconds, traffic, 8, 1e9)
    # The height of the tree is as fast as it gets.
    assert many.up == pytest.approx(4.0, abs=1e-6)
    assert many.down == pytest.approx(4.0, abs=1e-6)
    # One of two children stays where it is.
    assert many.moved_up == many.moved_inversion == 70.0
    two = scheduled(tree, seconds, seconds, seconds, traffic, 2, 1e9)
    assert 15.0 / 2 <= two.up <= 9.0
    slow = scheduled(tree, seconds, seconds, seconds, traffic, 8, 10.0)
    assert slow.up == pytest.approx(7.0)
    assert many.whole(4) == pytest.approx(4 * 8.0 + 4.0, abs=1e-5)
