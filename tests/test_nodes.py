"""The engine of Helmert blocking: a block in the nodes of a tree against the same in one piece."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import photogram
from photogram import Camera, Distance, InputError, Position
from photogram.network.core_arrays import CoreOptions, block_network

OPTIONS = CoreOptions(
    criterion="fraction",
    limit=1e-10,
    max_iterations=100,
    covariance=True,
    loss=None,
    ordering="auto",
    unit_variance="constrained",
    minimum=None,
)
TWO = (1, None)
FOUR = (3, 3, 3, None)
SEVEN = (2, 2, 6, 5, 5, 6, None)


def packed(square):
    """Return the lower triangle of a symmetric matrix column by column."""
    return np.concatenate([square[j:, j] for j in range(len(square))]) if len(square) else np.zeros(0)


@dataclass
class Piece:
    """A node of a block: what is at home in it, and the rows of the whole block that it has."""

    node: object
    photos: np.ndarray
    own_photos: np.ndarray
    points: np.ndarray
    own_points: np.ndarray
    images: np.ndarray
    observations: list
    children: list
    cameras: list
    block: object


def above(parent, node):
    """Return a node and those above it."""
    found = [node]
    while parent[found[-1]] is not None:
        found.append(parent[found[-1]])
    return found


def cut(block, parent, photo_nodes, *, cameras=(), tied=(), options=OPTIONS):
    """Return the nodes of a block.

    Blocks of unknowns are (`photo`, row), (`camera`, row) and (`point`, row) of tied points.
    They go up until what they share stands on one way to the root.
    """
    root = len(parent) - 1
    homes = {("photo", row): int(node) for row, node in enumerate(photo_nodes)}
    homes |= {("camera", row): root for row in cameras}
    homes |= {("point", row): 0 for row in tied}
    photo_cameras = block.photo_cameras

    def of_photo(row):
        camera = () if photo_cameras is None else (("camera", int(photo_cameras[row])),)
        return [("photo", int(row)), *(each for each in camera if each in homes)]

    # What belongs together: ("point", row) with its blocks, ("image", row), ("observation", row).
    cliques = {}
    for image, (photo, point) in enumerate(zip(block.image_photos, block.image_points, strict=True)):
        if int(point) in tied:
            cliques["image", image] = {("point", int(point)), *of_photo(photo)}
        else:
            cliques.setdefault(("point", int(point)), set()).update(of_photo(photo))
    for row, each in enumerate(block.observations):
        ends = (each.first, each.second) if isinstance(each, Distance) else ()
        photos = (each.photo,) if isinstance(each, Position) else ()
        cliques["observation", row] = {
            *(("point", block.point_ids.index(name)) for name in ends),
            *(("photo", block.photo_ids.index(name)) for name in photos),
        }
    while True:
        before = dict(homes)
        for clique in cliques.values():
            for a in sorted(clique):
                for b in sorted(clique):
                    ways = above(parent, homes[a]), above(parent, homes[b])
                    if homes[a] not in ways[1] and homes[b] not in ways[0]:
                        homes[b] = next(node for node in ways[0] if node in ways[1])
        if homes == before:
            break
    at = {name: min(homes[each] for each in clique) for name, clique in cliques.items()}
    outer = [set() for _ in parent]
    for name, clique in cliques.items():
        outer[at[name]] |= clique
    for node, up in enumerate(parent):
        outer[node] = {each for each in outer[node] if homes[each] != node}
        if up is not None:
            outer[up] |= outer[node]
    # Every node has an order of its own.
    outer = [sorted(each, key=lambda name: (name[1] * 7919) % 1009) for each in outer]
    return [piece(block, node, parent, homes, at, outer, set(tied), options) for node in range(len(parent))]


def piece(block, node, parent, homes, at, outer, tied, options):
    """Return a node."""
    names = [name for name, home in homes.items() if home == node] + outer[node]
    photos = np.array(sorted(row for kind, row in names if kind == "photo"), dtype=np.int64)
    places = [
        at.get(("image", image), at.get(("point", int(point))))
        for image, point in enumerate(block.image_points)
    ]
    images = np.flatnonzero(np.array(places) == node)
    named = {row for kind, row in names if kind == "point"}
    points = np.array(sorted({int(each) for each in block.image_points[images]} | named), dtype=np.int64)
    rows = {"photo": list(photos), "point": list(points)}
    own = photos[[homes["photo", int(row)] == node for row in photos]] if len(photos) else photos
    own_points = [row for row in points if row not in tied or homes["point", int(row)] == node]
    observations = [row for row in range(len(block.observations)) if at["observation", row] == node]
    changes = {
        "photo_ids": [block.photo_ids[row] for row in photos],
        "photo_cameras": None if block.photo_cameras is None else block.photo_cameras[photos],
        "point_ids": [block.point_ids[row] for row in points],
        "image_photos": np.searchsorted(photos, block.image_photos[images]),
        "image_points": np.searchsorted(points, block.image_points[images]),
        "observations": [block.observations[row] for row in observations],
    }
    for name in ("photo_positions", "photo_attitudes", "photo_position_sd", "photo_attitude_sd"):
        changes[name] = getattr(block, name)[photos]
    for name in ("photo_positions_observed", "photo_attitudes_observed", "principal_distances"):
        values = getattr(block, name)
        changes[name] = None if values is None else values[photos]
    for name in ("point_positions", "point_sd", "point_check_sd"):
        changes[name] = getattr(block, name)[points]
    for name in ("image_xy", "image_sd"):
        changes[name] = getattr(block, name)[images]

    def local(blocks):
        return [(kind, row if kind == "camera" else rows[kind].index(row)) for kind, row in blocks]

    children = [child for child, up in enumerate(parent) if up == node]
    part = replace(block, **changes)
    middle = tuple(np.median(block.photo_positions, axis=0))
    core = block_network(part, options)
    made = core.node(
        local(outer[node]), [local(outer[child]) for child in children], middle=middle, threads=1
    )
    cameras = [row for (kind, row), home in homes.items() if kind == "camera" and home == node]
    return Piece(
        made,
        photos,
        own,
        points,
        np.array(own_points, dtype=np.int64),
        images,
        observations,
        children,
        cameras,
        part,
    )


def upward(pieces, states, *, threads=1, order=None, damping=0.0, curved=False):
    """Form all nodes, each after those below it, and return them."""
    formed, left = {}, {}
    for number in order or range(len(pieces)):
        own = pieces[number]
        given = [left.pop(child) for child in own.children]
        formed[number] = own.node.form(states[number], given, damping=damping, curved=False, threads=threads)
        left[number] = formed[number].contribution
        assert formed[number].undetermined is None
    return [formed[number] for number in range(len(pieces))]


def downward(pieces, each):
    """Visit all nodes, each before those below it, with what it is handed; return what is found of each."""
    handed, found = {len(pieces) - 1: np.zeros(0)}, {}
    for number in reversed(range(len(pieces))):
        found[number], below = each(number, handed[number])
        handed |= dict(zip(pieces[number].children, below, strict=True))
    return [found[number] for number in range(len(pieces))]


def objective(pieces, states):
    """Return the weighted sum of squares of all nodes."""
    return sum(own.node.objective(state, threads=1)[-1] for own, state in zip(pieces, states, strict=True))


def started(pieces):
    """Return the states to begin with: of outer unknowns those of the node above."""

    def start(number, outer):
        state = pieces[number].node.initial
        state[pieces[number].node.outer] = outer
        return state, [state[places] for places in pieces[number].node.children]

    return downward(pieces, start)


def adjusted(pieces, *, threads=1, order=None):
    """Adjust by full steps, with the rule of one process; return solutions, largest changes, states."""
    states = started(pieces)
    changes = []
    while True:
        formed = upward(pieces, states, threads=threads, order=order)
        change = np.sqrt(sum(each.decrease for each in formed))
        rate = change / changes[-1] if changes else 1.0
        changes.append(change)

        def solved(number, outer, formed=formed):
            step = formed[number].solve(outer, threads=threads)
            return step, [step[places] for places in pieces[number].node.children]

        steps = downward(pieces, solved)
        states = [own.node.advance(*pair) for own, *pair in zip(pieces, states, steps, strict=True)]
        if change > 30 * np.sqrt(sum(own.node.size - len(own.node.outer) for own in pieces)):
            moved = [
                own.node.relocate(state, threads=threads) for own, state in zip(pieces, states, strict=True)
            ]
            states = moved if objective(pieces, moved) < objective(pieces, states) else states
        limit = OPTIONS.limit
        if change <= limit or (change <= 1e-3 and rate < 1 and rate / (1 - rate) * change <= limit):
            break
        assert len(changes) < 20

    def inverted(number, outer):
        return formed[number].invert(outer, states[number], threads=threads)

    return downward(pieces, inverted), changes, states


def compare(block, pieces, solutions, options=OPTIONS, tolerance=1e-9):
    """Compare the solutions of all nodes with the result of one piece, in standard deviations."""
    core = block_network(block, options).adjust(datum=None, threads=1, progress=None)
    seen = [np.zeros(len(names), dtype=int) for names in (block.photo_ids, block.point_ids, block.image_xy)]
    sums, kinds, redundancies = np.zeros(3), np.zeros(4), np.zeros(4)
    for own, found in zip(pieces, solutions, strict=True):
        photos, rows = own.own_photos, np.searchsorted(own.photos, own.own_photos)
        sd = np.sqrt(np.diagonal(core.photo_cofactors[photos], axis1=1, axis2=2))
        exact = np.concatenate([core.photo_positions[photos], core.photo_attitudes[photos]], axis=1)
        values = np.concatenate([found.photo_positions[rows], found.photo_attitudes[rows]], axis=1)
        free = sd > 0
        assert np.abs((values - exact)[free] / sd[free]).max(initial=0) < tolerance
        outside(found.photo_cofactors[rows], core.photo_cofactors[photos], tolerance)
        np.testing.assert_allclose(
            found.photo_redundancy[rows], core.photo_redundancy[photos], atol=tolerance
        )
        seen[0][photos] += 1
        points, rows = own.own_points, np.searchsorted(own.points, own.own_points)
        sd = np.sqrt(np.diagonal(core.point_cofactors[points], axis1=1, axis2=2))
        with np.errstate(invalid="ignore", divide="ignore"):
            off = np.abs(found.point_positions[rows] - core.point_positions[points])
            # Points that are better determined than double precision holds a billionth of.
            off = np.maximum(off - 1e-14 * np.abs(core.point_positions[points]), 0.0) / sd
        assert np.nanmax(off[sd > 0], initial=0) < tolerance
        outside(found.point_cofactors[rows], core.point_cofactors[points], tolerance)
        np.testing.assert_allclose(
            found.point_redundancy[rows], core.point_redundancy[points], atol=tolerance
        )
        seen[1][points] += 1
        residuals = (found.residuals - core.residuals[own.images]) / block.image_sd[own.images]
        assert np.nanmax(np.abs(residuals), initial=0) < 10 * tolerance
        np.testing.assert_allclose(found.redundancy, core.redundancy[own.images], atol=tolerance)
        seen[2][own.images] += 1
        ends = np.concatenate([[0], np.cumsum(core.adjusted_observations[0])])
        exact = [core.adjusted_observations[1][:, ends[row] : ends[row + 1]] for row in own.observations]
        np.testing.assert_allclose(
            found.adjusted_observations[1], np.hstack([np.zeros((3, 0)), *exact]), rtol=1e-7, atol=tolerance
        )
        for row in own.cameras:
            exact, values = core.cameras[row], found.cameras[row]
            sd = np.sqrt(np.reshape(exact[1], (len(exact[0]), -1)).diagonal())
            assert (np.abs(np.subtract(values[0], exact[0])) <= tolerance * sd).all()
            square = (len(sd), len(sd))
            outside(np.reshape(values[1], (1, *square)), np.reshape(exact[1], (1, *square)), tolerance)
            np.testing.assert_allclose(values[2], exact[2], atol=tolerance)
            np.testing.assert_allclose(values[3], exact[3], rtol=1e-6)
        sums += found.counts
        kinds += found.sums_of_squares
        redundancies += found.redundancies
    assert all((counts == 1).all() for counts in seen), "everything is at home once"
    assert tuple(sums) == core.counts
    np.testing.assert_allclose(kinds, core.sums_of_squares, rtol=1e-9)
    np.testing.assert_allclose(redundancies, core.redundancies, rtol=1e-9, atol=1e-9)
    return core


def outside(found, exact, tolerance):
    """Compare cofactor matrices, each element in the root of the product of its diagonal elements."""
    with np.errstate(invalid="ignore"):
        diagonal = np.sqrt(np.diagonal(exact, axis1=1, axis2=2))
    scale = diagonal[:, :, np.newaxis] * diagonal[:, np.newaxis, :]
    off = np.abs(found - exact) - tolerance * scale
    assert (np.isnan(exact) == np.isnan(found)).all()
    assert np.nanmax(off, initial=-1.0) <= 0


def across(block, parts):
    """Return the part of each photo, by its place along the strips."""
    along = block.photo_positions[:, 0]
    ends = np.quantile(along, np.arange(1, parts) / parts)
    return np.searchsorted(ends, along, side="right")


@pytest.mark.parametrize(
    ("parent", "shape"), [(TWO, (3, 9)), (FOUR, (4, 14)), (SEVEN, (10, 20))], ids=["2", "4", "7"]
)
def test_a_block_in_nodes_is_that_of_one_piece(parent, shape):
    strips, length = shape
    block = photogram.simulate(strips=strips, photos_per_strip=length, points_per_photo=40, seed=4).block
    nodes = leaves_of(parent) if len(parent) > 2 else np.arange(2)
    pieces = cut(block, parent, nodes[across(block, len(nodes))])
    solutions, changes, _ = adjusted(pieces)
    core = compare(block, pieces, solutions)
    np.testing.assert_allclose(changes, [row[2] for row in core.iterations], rtol=1e-6, atol=1e-9)


def leaves_of(parent):
    """Return the nodes without children."""
    return np.array([node for node in range(len(parent)) if node not in parent])


def test_weighted_poses_ties_and_control_cross_the_cuts():
    random = np.random.default_rng(8)
    simulation = photogram.simulate(
        strips=3, photos_per_strip=10, points_per_photo=40, position_sd=0.2, attitude_sd=2e-4, seed=6
    )
    block = simulation.block
    truth, stations = simulation.truth.point_positions, simulation.truth.photo_positions
    # Lengths between points far apart, some across the cuts; and GNSS beside the weighted poses.
    pass_points = np.flatnonzero(~np.isfinite(block.point_sd).any(axis=1))
    ends = random.choice(pass_points, (5, 2), replace=False)
    lengths = [
        Distance(
            block.point_ids[a],
            block.point_ids[b],
            float(np.linalg.norm(truth[a] - truth[b]) + random.normal(0, 0.02)),
            sd=0.02,
        )
        for a, b in ends
    ]
    positions = [
        Position(block.photo_ids[row], stations[row] + random.normal(0, 0.05, 3), sd=0.05)
        for row in range(0, len(block.photo_ids), 3)
    ]
    # All points start from given places: nodes see some of the images of those that lengths touch only.
    given = replace(OPTIONS, points_given=True)
    places = np.where(np.isfinite(block.point_sd), block.point_positions, truth)
    fixed = block.photo_attitude_sd.copy()
    fixed[4] = 0.0
    attitudes = np.array(block.photo_attitudes)
    attitudes[4] = simulation.truth.photo_attitudes[4]
    observed = np.array(block.photo_attitudes_observed)
    observed[4] = attitudes[4]
    block = replace(
        block,
        observations=[*lengths, *positions],
        point_positions=places,
        photo_attitude_sd=fixed,
        photo_attitudes=attitudes,
        photo_attitudes_observed=observed,
    )
    pieces = cut(
        block,
        SEVEN,
        leaves_of(SEVEN)[across(block, 4)],
        tied=[int(row) for row in ends.ravel()],
        options=given,
    )
    solutions, _, _ = adjusted(pieces)
    compare(block, pieces, solutions, given)


def test_a_camera_of_all_photos_stays_outer_up_to_the_root():
    known = Camera("brown", {"c": -152.74, "xp": 0.01, "yp": -0.02, "K1": 1e-8})
    start = Camera("brown", {"c": -152.70}, {"c": np.inf, "xp": 0.05, "yp": np.inf, "K1": np.inf})
    simulation = photogram.simulate(
        strips=3,
        photos_per_strip=12,
        points_per_photo=40,
        position_sd=0.1,
        cameras=[known],
        start_cameras=[start],
        seed=9,
    )
    block = simulation.block
    pieces = cut(block, SEVEN, leaves_of(SEVEN)[across(block, 4)], cameras=[0])
    assert all(own.node.outer.size for own in pieces[:-1])
    solutions, changes, _ = adjusted(pieces)
    core = compare(block, pieces, solutions)
    assert len(changes) == len(core.iterations)


@pytest.fixture(scope="module")
def small():
    block = photogram.simulate(strips=3, photos_per_strip=10, points_per_photo=40, seed=2).block
    return block, cut(block, SEVEN, leaves_of(SEVEN)[across(block, 4)])


def test_bits_depend_neither_on_threads_nor_on_the_order_of_arrival(small):
    _, pieces = small
    first = adjusted(pieces)
    others = [adjusted(pieces, threads=2), adjusted(pieces, order=[4, 3, 5, 1, 0, 2, 6])]
    for solutions, changes, states in others:
        assert changes == first[1]
        assert all((a == b).all() for a, b in zip(states, first[2], strict=True))
        for a, b in zip(solutions, first[0], strict=True):
            np.testing.assert_array_equal(a.photo_cofactors, b.photo_cofactors)
            np.testing.assert_array_equal(a.redundancy, b.redundancy)


def test_sums_are_those_of_the_whole_block(small):
    block, pieces = small
    whole = cut(block, (None,), np.zeros(len(block.photo_ids), dtype=int))[0].node
    states = [own.node.initial for own in pieces]
    for damping in (0.0, 1e-3):
        one = whole.form(whole.initial, [], damping=damping, curved=False, threads=1)
        formed = upward(pieces, states, damping=damping, curved=False)
        np.testing.assert_allclose(sum(each.sum_of_squares for each in formed), one.sum_of_squares, rtol=1e-9)
        np.testing.assert_allclose(sum(each.decrease for each in formed), one.decrease, rtol=1e-9)
    objective = np.sum(
        [own.node.objective(state, threads=1) for own, state in zip(pieces, states, strict=True)], 0
    )
    np.testing.assert_allclose(objective[:4].sum(), one.sum_of_squares, rtol=1e-9)
    np.testing.assert_allclose(objective[4], one.sum_of_squares, rtol=1e-9)
    np.testing.assert_allclose(objective, whole.objective(whole.initial, threads=1), rtol=1e-9)
    moved = [own.node.relocate(state, threads=1) for own, state in zip(pieces, states, strict=True)]
    assert all((a == b).all() for a, b in zip(moved, states, strict=True)), "they start where their rays meet"


def test_what_a_node_takes_is_told_before(small):
    _, pieces = small
    for own in pieces:
        told, outer = own.node.prediction(1), len(own.node.outer)
        assert told["outer"] == outer
        assert told["points"] + told["interior"] + told["outer"] == own.node.size
        assert told["images"] == len(own.images)
        assert told["contribution_bytes"] == 8 * (outer * (outer + 1) / 2 + 2 * outer)
        assert told["cofactor_bytes"] == 8 * outer * (outer + 1) / 2
        assert told["step_bytes"] == 8 * outer
        assert told["memory_bytes"] > told["factor_bytes"] + told["contribution_bytes"]
    formed = upward(pieces, [own.node.initial for own in pieces])
    assert all(each.decrease >= 0 for each in formed)


def test_a_block_without_datum_is_told_at_the_root():
    simulation = photogram.simulate(strips=2, photos_per_strip=8, points_per_photo=40, control="none", seed=3)
    pieces = cut(simulation.block, TWO, across(simulation.block, 2))
    states = [own.node.initial for own in pieces]
    below = pieces[0].node.form(states[0], [], damping=0.0, curved=False, threads=1)
    assert below.undetermined is None
    root = pieces[1].node.form(states[1], [below.contribution], damping=0.0, curved=False, threads=1)
    kind, _, combinations, *_ = root.undetermined
    assert kind == "undetermined photos"
    assert len(combinations) == 7


def test_what_does_not_fit_is_refused(small):
    block, pieces = small
    core = block_network(block, OPTIONS)
    for outer, children in (
        ([("photo", len(block.photo_ids))], []),
        ([], [[("camera", 0)]]),
        ([("unknown", 0)], []),
    ):
        with pytest.raises(InputError):
            core.node(outer, children, middle=None, threads=1)
    with pytest.raises(ValueError, match="kind of block"):
        core.node([("point cloud", 0)], [], middle=None, threads=1)
    # What several photos on a trajectory stand for is named by each of them, and counts once.
    once, twice = (core.node([("photo", 0)] * n, [], middle=None, threads=1) for n in (1, 2))
    np.testing.assert_array_equal(once.outer, twice.outer)
    leaf, above = pieces[0].node, pieces[2].node
    formed = leaf.form(leaf.initial, [], damping=0.0, curved=False, threads=1)
    given = formed.contribution
    with pytest.raises(ValueError, match="taken before"):
        formed.contribution  # noqa: B018
    with pytest.raises(InputError):
        leaf.form(leaf.initial[1:], [], damping=0.0, curved=False, threads=1)
    with pytest.raises(InputError):
        above.form(above.initial, [given], damping=0.0, curved=False, threads=1)
    with pytest.raises(InputError):
        formed.solve(np.zeros(len(leaf.outer) - 1), threads=1)
    formed.invert(packed(np.eye(len(leaf.outer))), leaf.initial, threads=1)
    with pytest.raises(ValueError, match="taken before"):
        formed.solve(np.zeros(len(leaf.outer)), threads=1)
    damped = leaf.form(leaf.initial, [], damping=1e-3, curved=False, threads=1)
    with pytest.raises(InputError):
        damped.invert(packed(np.eye(len(leaf.outer))), leaf.initial, threads=1)
    robust = block_network(block, replace(OPTIONS, loss=("huber", 3.0))).node([], [], middle=None, threads=1)
    curved = robust.form(robust.initial, [], damping=0.0, curved=True, threads=1)
    with pytest.raises(InputError):
        curved.invert(np.zeros(0), robust.initial, threads=1)
