"""Cutting a block: every observation in one node, what it touches there or above, and parts on disk."""

from itertools import combinations

import numpy as np
import pytest

import photogram
from photogram import Camera, Distance, LeverArm, Position
from photogram.distributed.cut import Incidence, cut, homes, joined, tree_of
from photogram.distributed.run import partition, read_manifest, read_node
from photogram.network import Level, OnLevel, Relative, rotation_matrix
from photogram.network.core_arrays import CoreOptions

OPTIONS = CoreOptions("fraction", 1e-5, 50, True, None, "auto", "constrained", None)


def tied_block():
    """Return a block with two cameras and ties of all kinds, some from end to end."""
    cameras = [Camera("brown", {"c": -152.74}, sd={"c": 0.1}, name=name) for name in ("first", "second")]
    simulated = photogram.simulate(
        strips=5, photos_per_strip=12, cameras=cameras[:1], points_per_photo=30, seed=2, position_error=2.0
    )
    block, places = simulated.block, simulated.truth.point_positions
    names, photos = block.point_ids, block.photo_ids
    level, arm = (
        Level("lake", height=float(places[3, 2]), sd=10.0),
        LeverArm("antenna", [0.0, 0.0, 0.0], sd=0.1),
    )

    def distance(one, other):
        apart = float(np.linalg.norm(places[one] - places[other]))
        return Distance(names[one], names[other], apart, sd=0.01)

    observations = [
        distance(0, len(names) - 1),
        distance(len(names) - 1, 40),
        distance(100, 103),
        *(OnLevel(names[row], level, 0.5, float(places[row, 2] - places[3, 2])) for row in (3, 50, 100)),
        *(
            Position(photos[row], each, sd=0.1, lever_arm=arm)
            for row, each in enumerate(simulated.truth.photo_positions)
        ),
        Relative(photos[0], photos[-1], *relative(simulated.truth, 0, -1), sd=[0.1] * 3 + [0.001] * 3),
    ]
    return block.replace(observations=observations, cameras=cameras, photo_cameras=np.arange(len(photos)) % 2)


def relative(block, first, second):
    """Return the pose of a photo in the axes of another."""
    turns = rotation_matrix(block.photo_attitudes[[first, second]])
    apart = block.photo_positions[second] - block.photo_positions[first]
    return turns[0] @ apart, turns[0] @ turns[1].T


def test_trees_number_children_before_parents():
    for parts in (1, 2, 3, 7, 16):
        tree = tree_of(parts)
        assert len(tree) == 2 * parts - 1
        assert tree.parents[tree.root] == -1
        assert (tree.parents[:-1] > np.arange(len(tree) - 1)).all()
        for node, children in enumerate(tree.children):
            assert all(tree.parents[child] == node for child in children)


def test_joined_sets_are_named_by_their_least_member():
    assert joined(7, [(5, 2), (6, 5), (0, 1)]).tolist() == [0, 0, 2, 3, 4, 2, 2]


@pytest.mark.parametrize("parts", [2, 3, 16])
def test_what_an_edge_touches_lies_on_one_way_to_the_root(parts):
    rng = np.random.default_rng(parts)
    places = np.column_stack([rng.uniform(0, 30, 400), rng.uniform(0, 10, 400), np.zeros(400)])
    middles = np.column_stack([rng.uniform(0, 30, 3000), rng.uniform(0, 10, 3000)])
    near = np.abs(places[np.newaxis, :, :2] - middles[:, np.newaxis]).max(axis=2) < 0.9
    edges, vertices = np.nonzero(near)
    # In several batches, as from disk, and with edges that reach far.
    half = edges < 1500
    whole = Incidence(vertices, edges, 3000)
    batches = [
        Incidence(vertices[half], edges[half], 1500),
        Incidence(vertices[~half], edges[~half] - 1500, 1500),
    ]
    weights = np.bincount(vertices, minlength=400).astype(float)
    found = cut(places, weights, lambda: batches, parts)
    assert (found.owners == cut(places, weights, lambda: [whole], parts).owners).all()
    home = homes(found.owners, whole, found.tree.root)
    for edge, vertex in zip(edges.tolist(), vertices.tolist(), strict=True):
        owner = int(found.owners[vertex])
        assert owner == home[edge] or owner in found.tree.above(int(home[edge]))
    leaves = np.bincount(found.owners, minlength=len(found.tree))
    assert min(count for count, below in zip(leaves, found.tree.children, strict=True) if not below) > 0
    # Separators are much smaller than parts.
    assert leaves[[bool(below) for below in found.tree.children]].sum() < 200


@pytest.mark.parametrize("parts", [1, 4, 9])
def test_every_observation_is_in_one_part(tmp_path, parts):
    block = tied_block()
    manifest = partition(block, tmp_path, parts, OPTIONS, "here")
    assert read_manifest(tmp_path) == manifest
    tree = manifest.tree
    found = [read_node(tmp_path, manifest, node) for node in range(len(tree))]
    for name, count in (
        ("images", len(block.image_xy)),
        ("points", len(block.point_ids)),
        ("observations", len(block.observations)),
    ):
        rows = np.concatenate([getattr(each, name) for each in found])
        assert sorted(rows.tolist()) == list(range(count))
    for node, part in enumerate(found):
        assert part.node == node
        own = part.block
        assert own.photo_ids == [block.photo_ids[row] for row in part.photos]
        np.testing.assert_array_equal(own.image_xy, block.image_xy[part.images])
        assert [own.point_ids[row] for row in own.image_points] == [
            block.point_ids[row] for row in block.image_points[part.images]
        ]
        assert [own.photo_ids[row] for row in own.image_photos] == [
            block.photo_ids[row] for row in block.image_photos[part.images]
        ]
        assert all(int(owner) in (node, *tree.above(node)) for owner in part.owners)
        outer = manifest.outer[node]
        assert outer.photos == part.photos[part.owners != node].tolist()
        assert len(part.photos) == 0 or bool(outer.cameras and outer.unknowns) == (node != tree.root)
        for child in tree.children[node]:
            assert set(manifest.outer[child].photos) <= set(part.photos.tolist())
            assert set(manifest.outer[child].unknowns) <= set(part.unknowns.tolist())
        # The same objects, by which observations know what they have in common.
        assert all(one is other for one, other in zip(own.unknowns, part.common, strict=False))
        assert [type(each) for each in part.common] == [type(block.unknowns[row]) for row in part.unknowns]
    owned = [set(part.photos[part.owners == node].tolist()) for node, part in enumerate(found)]
    assert all(not one & other for one, other in combinations(owned, 2))
    assert set().union(*owned) == set(range(len(block.photo_ids)))
    tied = [node for node, part in enumerate(found) for row in part.observations if row < 2]
    assert len(set(tied)) == 1
