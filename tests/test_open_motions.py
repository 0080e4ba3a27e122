"""What free networks leave open beside observations of every kind, against an independent dense design."""

import numpy as np
import pytest

import degenerate as of
from fuzz.networks import random_network
from photogram import Distance, InnerConstraints, LeverArm, Position, adjust
from photogram.network import (
    Attitude,
    Control,
    Difference,
    Drift,
    EqualHeight,
    Level,
    Line,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Plane,
    PlumbLine,
    Relative,
    Shift,
    rotation_matrix,
)

SD = 0.001
"""Of everything but images, in metres and radians."""
AXIS = np.array([0.6, 0.0, 0.8])
ACROSS = np.array([[0.8, 0.0, -0.6], [0.0, 1.0, 0.0], AXIS])
STEP = 1e-20


def places():
    """Return points: 0 to 2 are on a vertical, 3 to 5 on a line, 6 to 9 on a plane, 10 to 12 level."""
    points = of.cloud()
    points[:3] = points[0] + np.outer([0.0, 1.3, -1.1], [0.0, 0.0, 1.0])
    points[3:6] = points[3] + np.outer([0.0, 1.2, -0.9], AXIS)
    points[6:10] -= np.outer((points[6:10] - points[6]) @ ACROSS[0], ACROSS[0])
    points[10:13, 2] = points[10, 2]
    return points


POINTS, (CENTRES, ANGLES) = places(), of.around()
PHOTOS = len(CENTRES)
SHIFTED, DRIFTING, ARM = Shift("s"), Drift("d"), LeverArm("a")
PLUMB, LEVEL = PlumbLine("l", POINTS[0]), Level("h", POINTS[10, 2])
KNOWN = PlumbLine("k", POINTS[0], sd=SD)
LINE, PLANE = Line("g", AXIS, POINTS[3]), Plane("e", ACROSS[0], POINTS[6])


def names(*points):
    return [f"P{k}" for k in points]


def between(a, b):
    return Distance(*names(a, b), float(np.linalg.norm(POINTS[b] - POINTS[a])), sd=SD)


def position(photo, **more):
    return Position(f"p{photo}", CENTRES[photo], sd=SD, **more)


def attitude(photo):
    return Attitude(f"p{photo}", rotation_matrix(ANGLES[[photo]])[0].T, sd=SD)


def difference(a, b):
    return Difference(*names(a, b), POINTS[b] - POINTS[a], sd=SD)


KINDS = {
    "images": ([], 7),
    "distances": ([between(0, 7), between(3, 12), between(5, 15)], 6),
    "one control point": ([Control("P0", POINTS[0], sd=SD)], 4),
    "two control points": ([Control(f"P{k}", POINTS[k], sd=SD) for k in (3, 7)], 1),
    "control on a line": ([Control(f"P{k}", POINTS[k], sd=SD) for k in (3, 4, 5)], 1),
    "control": ([Control(f"P{k}", POINTS[k], sd=SD) for k in (3, 4, 7)], 0),
    "a difference": ([difference(3, 7)], 4),
    "differences alike": ([difference(0, 1), difference(0, 2), difference(1, 2)], 4),
    "differences": ([difference(0, 1), difference(3, 7)], 3),
    "equal heights": ([EqualHeight(*names(10, k), sd=SD) for k in (11, 12)], 5),
    "one equal height": ([EqualHeight(*names(10, 11), sd=SD)], 6),
    "a level": ([OnLevel(f"P{k}", LEVEL, SD) for k in (10, 11, 12)], 5),
    "a plane": ([OnPlane(f"P{k}", PLANE, SD) for k in range(6, 10)], 7),
    "a plumb line of two": ([OnPlumbLine(f"P{k}", PLUMB, SD) for k in (0, 1)], 5),
    "a plumb line": ([OnPlumbLine(f"P{k}", PLUMB, SD) for k in (0, 1, 2)], 5),
    "a plumb line, uneven": ([OnPlumbLine(f"P{k}", PLUMB, [SD, 2 * SD]) for k in (0, 1, 2)], 5),
    "a plumb line that is known": ([OnPlumbLine(f"P{k}", KNOWN, SD) for k in (0, 1, 2)], 3),
    "a line of two": ([OnLine(f"P{k}", LINE, SD) for k in (3, 4)], 7),
    "a line": ([OnLine(f"P{k}", LINE, SD) for k in (3, 4, 5)], 7),
    "a line, uneven": ([OnLine(f"P{k}", LINE, [SD, 2 * SD]) for k in (3, 4, 5)], 7),
    "one position": ([position(1)], 4),
    "positions": ([position(k) for k in (0, 2, 5)], 0),
    "positions, shifted": ([position(k, shift=SHIFTED) for k in (0, 2, 5)], 3),
    "positions, drifting": (
        [position(k, shift=SHIFTED, drift=DRIFTING, time=float(k)) for k in range(PHOTOS)],
        3,
    ),
    "antennas": ([position(k, lever_arm=ARM) for k in range(PHOTOS)], 0),
    "antennas, shifted": ([position(k, lever_arm=ARM, shift=SHIFTED) for k in range(PHOTOS)], 3),
    "attitudes": ([attitude(k) for k in (0, 3)], 4),
    "a relative pose": (
        [
            Relative(
                "p0",
                "p1",
                rotation_matrix(ANGLES[[0]])[0] @ (CENTRES[1] - CENTRES[0]),
                rotation_matrix(ANGLES[[0]])[0] @ rotation_matrix(ANGLES[[1]])[0].T,
                sd=SD,
            )
        ],
        6,
    ),
}

WITHOUT_SCALE = {
    "images",
    "one control point",
    "equal heights",
    "one equal height",
    "a level",
    "a plane",
    "a plumb line of two",
    "a plumb line",
    "a plumb line, uneven",
    "a plumb line that is known",
    "a line of two",
    "a line",
    "a line, uneven",
    "one position",
    "attitudes",
}
"""Whose networks leave the scale open."""


def measured(kind, scaled, seed):
    """Return the free network with errors of images and points, and how many motions are open."""
    random = np.random.default_rng(seed)
    observations, count = KINDS[kind]
    block = of.block(CENTRES, ANGLES, POINTS, c=-100.0)
    off = np.zeros(POINTS.shape)
    # What is on a surface, level or vertical is off it by its error: so it was photographed.
    off[:13] = SD * random.standard_normal((13, 3))
    moved = of.block(CENTRES, ANGLES, POINTS + off)
    if scaled:
        observations = [*observations, between(13, 17)]
    block = block.replace(
        image_xy=moved.image_xy + of.SD * random.standard_normal(block.image_xy.shape),
        photo_positions=CENTRES + 0.01 * random.standard_normal(CENTRES.shape),
        point_positions=np.full(POINTS.shape, np.nan),
        observations=observations,
    )
    return block, count


def cross(vector):
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def of_priors(unknown, step):
    """Return what is observed of an unknown itself, to unit weight."""
    deviations = np.broadcast_to(unknown.given.deviations, step.shape)
    return [own / sd for own, sd in zip(step, deviations, strict=True) if np.isfinite(sd)]


def design(block, result):
    """Return the partials of all observations, to unit weight, by points, photos, common unknowns.

    Complex steps; photos and axes turn about their own axes, which is exact for first derivatives.
    """
    n, unknowns = len(POINTS), result.unknowns
    widths = [each.cofactors.shape[0] for each in unknowns]
    first = np.cumsum([3 * n + 6 * PHOTOS, *widths])
    turns = rotation_matrix(result.photo_attitudes)
    times = np.mean([each.time for each in block.observations if isinstance(each, Position)] or [0.0])

    def computed(step):
        points = result.point_positions + step[: 3 * n].reshape(n, 3)
        poses = step[3 * n : 3 * n + 6 * PHOTOS].reshape(PHOTOS, 6)
        centres = result.photo_positions + poses[:, :3]
        to_photo = [(np.eye(3) - cross(poses[k, 3:])) @ turns[k] for k in range(PHOTOS)]
        to_all = np.array(to_photo)[block.image_photos]
        u = np.einsum("mij,mj->mi", to_all, points[block.image_points] - centres[block.image_photos])
        rows = [
            own for k, each in enumerate(unknowns) for own in of_priors(each, step[first[k] : first[k + 1]])
        ]
        rows += list((of.C * u[:, :2] / u[:, 2:] / block.image_sd).ravel())
        for each in block.observations:
            row = [block.point_ids.index(name) for name in each.points]
            photo = [block.photo_ids.index(name) for name in each.photos]
            at = [
                k
                for k, own in enumerate(unknowns)
                if own.name in [named.name for named in each.unknowns if named]
            ]
            steps = [step[first[k] : first[k + 1]] for k in at]
            match each:
                case Distance():
                    apart = points[row[1]] - points[row[0]]
                    value = [np.sqrt((apart * apart).sum())]
                case Difference():
                    value = points[row[1]] - points[row[0]]
                case EqualHeight():
                    value = [points[row[1], 2] - points[row[0], 2]]
                case OnLevel():
                    value = [points[row[0], 2] - steps[0][0]]
                case OnPlumbLine():
                    value = points[row[0], :2] - steps[0]
                case OnPlane() | OnLine():
                    own = unknowns[at[0]]
                    kept = slice(2, 3) if isinstance(each, OnPlane) else slice(0, 2)
                    turn = np.array([*steps[0][-2:], 0.0])
                    axes = (np.eye(3) - cross(turn)) @ own.attitude.T
                    value = (axes @ (points[row[0]] - own.position))[kept] - steps[0][:-2]
                case Control():
                    value = points[row[0]]
                case Position():
                    value = np.array(centres[photo[0]])
                    for k, moved in zip(at, steps, strict=True):
                        match unknowns[k].given:
                            case LeverArm():
                                value = value + to_photo[photo[0]].T @ (unknowns[k].position + moved)
                            case Drift():
                                value = value + (each.time - times) * moved
                            case _:
                                value = value + moved
                case Attitude():
                    value = poses[photo[0], 3:]
                case Relative():
                    base = to_photo[photo[0]] @ (centres[photo[1]] - centres[photo[0]])
                    to_first = turns[photo[1]] @ turns[photo[0]].T
                    value = [*base, *(poses[photo[1], 3:] - to_first @ poses[photo[0], 3:])]
            rows += list(np.array(value) / np.broadcast_to(each.sd, len(value)))
        return np.array(rows)

    count = int(first[-1])
    return np.column_stack([computed(STEP * 1j * unit).imag / STEP for unit in np.eye(count)])


def in_inner_datum(a, count):
    """Return singular values of the scaled design, and cofactors of points in the datum that these carry."""
    scale = 1 / np.linalg.norm(a, axis=0)
    _, values, vectors = np.linalg.svd(a * scale, full_matrices=True)
    values = np.pad(values, (0, a.shape[1] - len(values)))
    kept = len(values) - count
    inverse = (vectors[:kept].T / values[:kept] ** 2) @ vectors[:kept] * np.outer(scale, scale)
    g = vectors[kept:].T * scale[:, None]
    b = np.where(np.arange(len(g))[:, None] < 3 * len(POINTS), g, 0.0)
    s = np.eye(len(g)) - g @ np.linalg.solve(b.T @ g, b.T) if count else np.eye(len(g))
    return values, (s @ inverse @ s.T)[: 3 * len(POINTS), : 3 * len(POINTS)]


@pytest.mark.parametrize("scaled", [False, True], ids=["", "and a distance"])
@pytest.mark.parametrize("kind", KINDS)
def test_open_motions_are_those_of_singular_values(kind, scaled):
    block, count = measured(kind, scaled, seed=2)
    count -= scaled and kind in WITHOUT_SCALE
    result = adjust(block)
    assert result.converged
    assert len(result.datum.held) == count
    a = design(block, result)
    assert result.degrees_of_freedom == a.shape[0] - a.shape[1] + count
    free = adjust(block, datum=InnerConstraints()) if count else result
    values, cofactors = in_inner_datum(design(block, free), count)
    kept = len(values) - count
    assert values[kept - 1] > 1e-4
    # Residuals that turn with the network change by their own size, though their squares do not.
    assert (values[kept:] < 0.01 * values[kept - 1]).all()
    expected = np.sqrt(free.variance_of_unit_weight * np.diag(cofactors)).reshape(-1, 3)
    np.testing.assert_allclose(free.point_sd, expected, rtol=1e-4)
    assert free.point_sd.max() < 0.02
    assert free.redundancy.sum() + sum(
        each.redundancy.sum() for each in free.kinds.values()
    ) == pytest.approx(free.degrees_of_freedom, abs=1e-4)


def test_a_line_far_from_where_it_started_has_the_covariance_of_one_that_starts_there():
    """Its axes turn with it, and so do its offsets."""
    axis = ACROSS.T @ [np.sin(0.035), 0.02, np.cos(0.035)]
    points, distance = (3, 4, 5), between(13, 17)
    block, _ = measured("a line", scaled=False, seed=2)

    def line_of(start):
        observations = [distance, *(OnLine(f"P{k}", start, SD) for k in points)]
        return adjust(block.replace(observations=observations)).unknowns[0]

    far = line_of(Line("g", axis, POINTS[3] + [0.02, -0.03, 0.01]))
    assert np.linalg.norm(np.cross(far.attitude[:, 2], axis)) > 0.03
    near = line_of(Line("g", far.attitude[:, 2], far.position))
    # The two others of its axes are any.
    turn = np.kron(np.eye(2), (near.attitude.T @ far.attitude)[:2, :2])
    expected = turn.T @ near.covariance @ turn
    scale = np.sqrt(np.outer(*[np.diag(expected)] * 2))
    assert np.abs((far.covariance - expected) / scale).max() < 1e-6


@pytest.mark.parametrize(("seed", "number"), [(3, 148), (2, 652), (115, 40), (166, 76)])
def test_verticals_of_an_ellipsoid_do_not_say_where_a_network_is(seed, number):
    """Attitudes and differences together tell its place to kilometres: rounding takes that."""
    network = random_network(seed, number, "brown_forward")
    assert network.block.geographic
    assert {"attitude", "difference"} <= set(network.kinds)
    result = adjust(network.block)
    assert result.converged
    assert [name for _, name in result.datum.held] == ["longitude", "latitude", "height"]


@pytest.mark.parametrize(("given", "open_still"), [([np.inf, 0.1], "longitude"), ([0.1, np.inf], "latitude")])
@pytest.mark.parametrize("point", [0, 5])
def test_a_network_is_held_by_what_moves_well(point, given, open_still):
    """Up at a plumb line is north or east, too, by a millionth, at photos that are metres away."""
    block = random_network(3, 148, "brown_forward").block
    line = PlumbLine("edge", block.point_positions[point], sd=given)
    result = adjust(
        block.replace(observations=[*block.observations, OnPlumbLine(f"point {point}", line, SD)])
    )
    assert result.converged
    assert [name for _, name in result.datum.held] == [open_still, "height"]
    assert np.nanmax(result.point_sd[:, 2]) < 0.1
