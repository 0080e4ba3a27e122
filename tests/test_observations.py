"""Observations beside images in Python; the tests of the crate compare all kinds with dense algebra."""

import json
import time
from dataclasses import fields

import numpy as np
import pytest

from example_scripts import load
from message_codes import raises
from photogram import (
    Attitudes,
    Block,
    Distance,
    InputError,
    LeverArm,
    Position,
    Spheroid,
    adjust,
    predict,
    simulate,
)
from photogram.giant import Project
from photogram.network import (
    Attitude,
    Clock,
    Control,
    Difference,
    EqualHeight,
    Prior,
    Range,
    Relative,
    Shift,
    geographic_to_geocentric,
    local_frames,
    project,
    rotation_matrix,
)

KINDS = {
    "distance": 1,
    "equal height": 1,
    "difference": 3,
    "control": 3,
    "position": 3,
    "attitude": 3,
    "range": 1,
    "relative": 6,
}


@pytest.fixture(scope="module")
def example():
    return load("scale_bar")


def exact(spheroid):
    """Return the truth, and a block of free photos and points with all kinds of observation, exact."""
    simulation = simulate(
        strips=2, photos_per_strip=3, points_per_photo=15, check_points=0, spheroid=spheroid, seed=5
    )
    truth = simulation.truth
    rays = np.bincount(truth.image_points)
    p, q = np.flatnonzero(rays >= 4)[:2].tolist()
    points, photos = truth.point_ids, truth.photo_ids
    plane = truth.point_positions
    xyz = plane if spheroid is None else geographic_to_geocentric(plane, spheroid)
    stations = truth.photo_positions
    centres = stations if spheroid is None else geographic_to_geocentric(stations, spheroid)
    local = rotation_matrix(truth.photo_attitudes).transpose(0, 2, 1)
    frames = np.broadcast_to(np.eye(3), (len(photos), 3, 3)) if spheroid is None else local_frames(stations)
    turned = frames.transpose(0, 2, 1) @ local
    boresight = rotation_matrix([[0.01, -0.02, 1.5]])[0]
    shift = turned[0].T @ (centres[1] - centres[0])
    covariance = 0.01**2 * (np.eye(3) + 0.3)
    arm = np.array([0.5, -1.0, 2.0])
    ray = xyz[q] - centres[2] - turned[2] @ arm
    control = [point for point, sd in enumerate(truth.point_sd) if np.isfinite(sd).all()]
    observations = [
        Distance(points[p], points[q], float(np.linalg.norm(xyz[q] - xyz[p])), sd=0.01),
        EqualHeight(points[p], points[q], sd=0.01, difference=float(plane[q, 2] - plane[p, 2])),
        Difference(points[q], points[p], np.where([True, False, True], xyz[p] - xyz[q], np.nan), sd=0.01),
        *(Control(points[point], plane[point], covariance=covariance) for point in control),
        Range(photos[2], points[q], float(np.linalg.norm(ray)), sd=0.01, lever_arm=arm),
        Position(photos[0], stations[0], sd=[0.01, 0.01, 0.02]),
        Attitude(photos[1], local[1] @ boresight, sd=1e-4, boresight=boresight),
        Relative(photos[0], photos[1], shift, turned[0].T @ turned[1], sd=[0.01] * 3 + [1e-4] * 3),
    ]
    return truth, simulation.block.replace(
        image_xy=truth.image_xy, point_sd=np.inf, observations=observations
    )


@pytest.mark.parametrize("spheroid", [None, Spheroid.clarke_1866()], ids=["rectangular", "geographic"])
def test_what_is_computed_is_what_was_observed(spheroid):
    truth, block = exact(spheroid)
    result = adjust(block)
    assert result.converged
    assert set(result.kinds) == set(KINDS)
    for each in result.kinds.values():
        assert each.residuals.shape == (len(each.rows), KINDS[each.kind])
        assert len(each.components) == len(each.units) == KINDS[each.kind]
        assert np.nanmax(np.abs(each.residuals) / each.sd) < 1e-3, each.kind
        assert (each.weights == 1).all()
    difference = result.kinds["difference"]
    assert np.isnan(difference.residuals[0]).tolist() == [False, True, False]
    assert np.isnan(difference.sd[0, 1])
    used = result.used_points
    per_unit = [1e-6, 1e-6, 1.0] if spheroid else [1.0, 1.0, 1.0]
    errors = np.abs(result.point_positions - truth.point_positions)[used] / per_unit
    assert errors.max() < 1e-3
    names = ("east", "north", "up") if spheroid else ("X", "Y", "Z")
    assert result.kinds["control"].components == result.kinds["position"].components == names
    assert difference.components == ("X", "Y", "Z")


def test_redundancy_numbers_of_all_observations_sum_to_the_degrees_of_freedom(example):
    result = adjust(example.measured())
    kinds = result.kinds.values()
    total = result.redundancy.sum() + sum(each.redundancy.sum() for each in kinds)
    assert total == pytest.approx(result.degrees_of_freedom, abs=1e-8)
    assert result.degrees_of_freedom == 160 + 1 + 2 + 15 + 15 - 30 - 48
    for each in kinds:
        ratio = each.residuals / (each.sd * np.sqrt(each.redundancy))
        np.testing.assert_allclose(each.standardized, ratio, rtol=1e-6)
        np.testing.assert_allclose(each.squares, ((each.residuals / each.sd) ** 2).sum(axis=1))
    sums = result.sums_of_squares
    assert sum(each.sum_of_squares for each in kinds) == pytest.approx(sums.observations)
    assert sums.total == pytest.approx(sums.plates + sums.observations)
    with pytest.raises(ValueError, match="read-only"):
        result.kinds["distance"].residuals[0] = 0.0


def test_the_scale_bar_gives_the_scale(example, capsys):
    once = example.main()
    assert "distance P0 - P15" in capsys.readouterr().out
    block = once.block
    bar = block.observations[0]
    # Twice as long, and nothing else says so but GNSS to two centimetres.
    kept = [each for each in block.observations if each.KIND != "position"]
    longer = [Distance("P0", "P15", 2 * bar.length, sd=bar.sd), *kept[1:]]
    fixed = np.zeros((5, 3))
    fixed[1:] = np.inf
    free = {"photo_position_sd": fixed}
    one, two = (adjust(block.replace(observations=each, **free)) for each in (kept, longer))
    origin = block.photo_positions[0]
    heights = [result.point_positions - origin for result in (one, two)]
    np.testing.assert_allclose(heights[1], 2 * heights[0], atol=2e-3)


def test_the_report_the_table_and_the_document_tell_of_them(example):
    result = adjust(example.measured())
    document = result.document()
    assert "weighted sum of squares, position" in result.report()
    sd = {
        kind: document.table(f"observations-{kind}").columns[2].outward() for kind in ("distance", "attitude")
    }
    assert sd["distance"][0] == pytest.approx([2e-5])
    assert sd["attitude"].max() == pytest.approx(412.52961)  # 0.002 rad in seconds of arc
    table = result.observation_table()
    assert len(table) == 1 + 2 + 15 + 15
    assert table["unit"].tolist() == ["m"] * 18 + ["rad"] * 15
    lengths = [result.kinds[kind].standardized.ravel() for kind in ("distance", "equal height", "position")]
    np.testing.assert_array_equal(table["standardized"][:18].tolist(), np.concatenate(lengths))
    document = json.loads(result.to_json())
    assert document["weighted_sum_of_squares"]["observations"] == result.sums_of_squares.observations
    first = document["observations_beside_images"][0]
    assert (first["kind"], first["of"], first["units"]) == ("distance", ["P0", "P15"], ["m"])
    assert first["residual"] == result.kinds["distance"].residuals[0].tolist()
    assert len(document["observations_beside_images"]) == len(result.block.observations)


def test_an_outlier_is_named(example):
    block = example.measured()
    wrong = [Distance("P1", "P14", 1.1, sd=2e-5), *block.observations]
    problems = "\n".join(map(str, adjust(block.replace(observations=wrong)).report().splitlines()[:40]))
    assert "distance" in problems
    assert "P1 - P14" in problems or "P0 - P15" in problems


def test_observations_of_points_that_are_left_out_are_left_out_too(example):
    block = example.measured()
    one = (block.image_points != 15) | (block.image_photos == 0)
    names = ("image_photos", "image_points", "image_xy", "image_sd")
    result = adjust(block.replace(**{name: getattr(block, name)[one] for name in names}))
    assert result.kinds["distance"].used == 0
    assert np.isnan(result.kinds["distance"].residuals).all()
    assert "left out with their points: distance P0 - P15" in [str(each) for each in result.messages]
    assert len(json.loads(result.to_json())["observations_beside_images"]) == len(block.observations) - 1
    assert "distance" not in result.observation_table()["kind"].tolist()


def test_where_observations_cannot_be_taken_it_is_said(example):
    block = example.measured()
    with raises(InputError, "block.unsupported.observations"):
        predict(block.replace(point_positions=np.zeros((16, 3))))
    with raises(InputError, "block.unsupported.observations"):
        Project.from_block(block)


ROTATION = np.eye(3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Distance("1", "1", 2.0, sd=0.1), "error.repeated"),
        (lambda: Distance("1", "2", 0.0, sd=0.1), "error.positive"),
        (lambda: Distance("1", "2", np.nan, sd=0.1), "error.finite"),
        (lambda: Distance("1", "2", 2.0, sd=0.0), "error.positive"),
        (lambda: EqualHeight("1", "2", sd=np.inf), "error.range"),
        (lambda: EqualHeight("1", "", sd=1.0), "equal height"),
        (lambda: Difference("1", "2", [np.nan] * 3, sd=1.0), "error.missing"),
        (lambda: Difference("1", "2", [np.inf, 0, 0], sd=1.0), "error.finite"),
        (lambda: Control("1", [0, 0, 0]), "error.exclusive"),
        (lambda: Control("1", [0, 0, 0], 1.0, np.eye(3)), "error.exclusive"),
        (lambda: Control("1", [0, 0, 0], covariance=-np.eye(3)), "error.covariance"),
        (
            lambda: Control("1", [0, 0, 0], covariance=np.ones((3, 3))),
            "error.covariance",
        ),
        (lambda: Control("1", [0, 0, 0], covariance=np.tri(3)), "error.covariance"),
        (lambda: Position("1", [0, 0], sd=1.0), "position of position 1"),
        (lambda: Position("1", [0, np.nan, 0], sd=1.0), "error.finite"),
        (lambda: Attitude("1", 2 * ROTATION, sd=1.0), "error.kind"),
        (lambda: Attitude("1", -ROTATION, sd=1.0), "error.kind"),
        (lambda: Relative("1", "1", [0, 0, 0], ROTATION, sd=1.0), "error.repeated"),
        (lambda: Relative("1", "2", [0, 0, 0], ROTATION, sd=[1.0] * 5), "sd of relative 1 - 2"),
    ],
)
def test_what_cannot_be_observed_is_refused(make, message):
    with raises(InputError, message):
        make()


def test_a_block_refuses_what_it_does_not_know(example):
    block = example.measured()
    with raises(InputError, "error.absent"):
        block.replace(observations=[Distance("P0", "P99", 1.0, sd=0.1)])
    with raises(InputError, "error.absent"):
        block.replace(observations=[Position("P1", [0, 0, 0], sd=0.1)])
    with raises(InputError, "error.kind"):
        block.replace(observations=["distance"])
    with raises(InputError, "error.list"):
        block.replace(observations=5)
    assert isinstance(block, Block)


def around(noise, **weights):
    """Return twelve photos around an object, two of which have a phi of 90 degrees, with some control."""
    turns = np.radians(np.arange(0, 360, 30))
    positions = np.column_stack([10 * np.cos(turns), 10 * np.sin(turns), 0.4 * np.sin(3 * turns)])
    z = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(12)])
    y = np.broadcast_to([0.0, 0.0, 1.0], z.shape)
    matrices = np.stack([np.cross(y, z), y, z], axis=2)
    angles = Attitudes(matrices).values("omega_phi_kappa")
    points = noise.uniform(-2, 2, (30, 3))
    photos, seen = np.repeat(np.arange(12), 30), np.tile(np.arange(30), 12)
    xy = project(points[seen], positions[photos], angles[photos], np.full(360, -50.0))
    step = Attitudes.of("rotation_vector", noise.normal(0, 0.05, (12, 3))).matrices
    known = (np.arange(30) < 6)[:, np.newaxis]
    block = Block(
        photo_ids=[f"photo {i}" for i in range(12)],
        photo_positions=positions + noise.normal(0, 0.05, (12, 3)),
        photo_attitudes=Attitudes(matrices @ step).values("omega_phi_kappa"),
        principal_distances=np.full(12, -50.0),
        point_ids=[f"P{i}" for i in range(30)],
        point_positions=np.where(known, points, np.nan),
        point_sd=np.where(known, 0.002, np.inf) * np.ones(3),
        image_photos=photos,
        image_points=seen,
        image_xy=xy + noise.normal(0, 0.002, xy.shape),
        image_sd=np.full(xy.shape, 0.002),
        **weights,
    )
    return block, matrices, points


@pytest.mark.parametrize("sd", [10.0, 1.0, 0.1, 0.01])
def test_observed_attitudes_have_no_singular_place(sd):
    noise = np.random.default_rng(4)
    block, matrices, points = around(noise)
    errors = Attitudes.of("rotation_vector", noise.normal(0, min(sd, 0.3), (12, 3))).matrices
    observed = zip(block.photo_ids, matrices @ errors, strict=True)
    result = adjust(block.replace(observations=[Attitude(photo, each, sd=sd) for photo, each in observed]))
    assert result.converged
    assert len(result.iterations) <= 6
    assert np.abs(result.point_positions - points).max() < 0.003


@pytest.mark.parametrize("sd", [10.0, 1.0, 0.1, 0.05])
def test_weighted_angles_have_no_singular_place(sd):
    """Two of the photos look along X: omega and kappa turn about one axis there."""
    block, _, points = around(np.random.default_rng(4), photo_attitude_sd=np.full((12, 3), sd))
    result = adjust(block)
    assert result.converged
    assert len(result.iterations) <= 6
    assert np.abs(result.point_positions - points).max() < 0.003
    assert result.photo_redundancy[:, 3:].sum() + result.redundancy.sum() + result.point_redundancy.sum() == (
        pytest.approx(result.degrees_of_freedom, abs=1e-6)
    )


ARRAYS = [
    (Position, {"photo": ["a", "b"], "position": np.eye(3)[:2], "sd": 0.1, "lever_arm": [1.0, 2.0, 3.0]}),
    (Position, {"photo": ["a", "b"], "position": np.eye(3)[:2], "covariance": [np.eye(3), 2 * np.eye(3)]}),
    (Position, {"photo": ["a", "b"], "position": np.eye(3)[:2], "sd": np.ones((2, 3)), "time": [1.0, 2.0]}),
    (Attitude, {"photo": ["a", "b"], "attitude": [np.eye(3), np.eye(3)], "sd": [1e-3, 1e-3, 2e-3]}),
    (Distance, {"first": ["a", "b"], "second": ["b", "c"], "length": [1.0, 2.0], "sd": [0.1, 0.2]}),
    (
        Difference,
        {"first": ["a", "b"], "second": ["b", "c"], "vector": [[1, np.nan, 2], [1, 2, 3]], "sd": 0.1},
    ),
    (EqualHeight, {"first": ["a", "b"], "second": ["b", "c"], "sd": 0.1, "difference": [0.0, 1.0]}),
    (
        Relative,
        {"first": ["a"], "second": ["b"], "translation": [[1, 2, 3]], "rotation": np.eye(3), "sd": 1.0},
    ),
    (Position, {"photo": ["a", "b"], "position": np.eye(3)[:2], "sd": 0.1, "lever_arm": LeverArm("antenna")}),
    (Position, {"photo": ["a", "b"], "position": np.eye(3)[:2], "sd": 0.1, "shift": [Shift("1"), None]}),
]


@pytest.mark.parametrize(("kind", "arrays"), ARRAYS)
def test_observations_of_arrays_are_those_of_objects(kind, arrays):
    def value(name, row):
        shape = dict(kind.VALUES) | {"sd": (len(kind.COMPONENTS),), "covariance": (len(kind.COMPONENTS),) * 2}
        column = arrays[name]
        if name in (*kind.POINTS, *kind.PHOTOS) or (isinstance(column, list) and name == "shift"):
            return column[row]
        many = np.ndim(column) > len(shape.get(name, ())) or (shape.get(name) == (1,) and np.ndim(column))
        return column[row] if not isinstance(column, LeverArm) and many else column

    observed = kind.from_arrays(**arrays)
    assert len(observed) == len(arrays[(*kind.POINTS, *kind.PHOTOS)[0]])
    for row, own in enumerate(observed):
        single = kind(**{name: value(name, row) for name in arrays})
        assert (own.name, own.points, own.photos) == (single.name, single.points, single.photos)
        assert list(map(id, own.unknowns)) == list(map(id, single.unknowns))
        np.testing.assert_array_equal(own.observed, single.observed)
        np.testing.assert_array_equal(own.precision, single.precision)
        again = kind(**{each.name: getattr(own, each.name) for each in fields(kind) if each.init})
        np.testing.assert_array_equal(again.precision, single.precision)


def test_a_block_adjusts_columns_as_objects(example):
    block = example.measured()
    positions = block.observations.of_type(Position)
    columns = Position.from_arrays(
        photo=[each.photo for each in positions],
        position=np.array([each.position for each in positions]),
        sd=positions[0].sd,
        lever_arm=np.array([each.lever_arm for each in positions]),
    )
    others = [each for each in block.observations if not isinstance(each, Position)]
    mixed = block.replace(observations=[*others[:2], columns, *others[2:]])
    again = mixed.replace(observations=[mixed.observations, *positions[:1]])
    assert [type(each) for each in mixed.observations[:3]] == [*map(type, others[:2]), Position]
    assert len(again.observations.of_type(Position)) == len(positions) + 1
    one, other = adjust(block.replace(observations=[*others[:2], *positions, *others[2:]])), adjust(mixed)
    np.testing.assert_array_equal(one.point_positions, other.point_positions)
    assert one.block.observations == again.replace(observations=mixed.observations).observations
    assert one.observation_table().equals(other.observation_table())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position": np.zeros((3, 3))}, "error.shape"),
        ({"position": np.full((2, 3), np.nan)}, "error.finite"),
        ({"photo": ["a", ""]}, "error.no-name"),
        ({"sd": [[0.1] * 3, [0.1, 0.0, 0.1]]}, "position b"),
        ({"covariance": np.eye(3)}, "error.exclusive"),
        ({"lever": 1.0}, "error.unknown"),
        ({"shift": [None]}, "error.count"),
        ({"time": [0.0, np.inf]}, "error.finite"),
        ({"clock": Clock("receiver")}, "error.requires"),
    ],
)
def test_arrays_that_cannot_be_observed_are_refused(change, message):
    good = {"photo": ["a", "b"], "position": np.zeros((2, 3)), "sd": 0.1}
    with raises(InputError, message):
        Position.from_arrays(**good | change)


def test_types_without_columns_and_missing_arguments_are_refused():
    with raises(InputError, "error.kind"):
        Prior.from_arrays(unknown=Shift("1"), sd=1.0)
    with raises(InputError, "error.missing"):
        Position.from_arrays(photo=["a"], sd=1.0)


def test_many_positions_are_added_fast():
    count = 50_000
    names = [str(row) for row in range(count)]
    block = Block(
        photo_ids=names,
        photo_positions=np.zeros((count, 3)),
        photo_attitudes=0.0,
        principal_distances=-150.0,
        point_positions=np.zeros((1, 3)),
        image_photos=[0],
        image_points=[0],
        image_xy=[[0.0, 0.0]],
        image_sd=0.01,
    )
    start = time.process_time()
    block = block.replace(
        observations=Position.from_arrays(photo=names, position=np.zeros((count, 3)), sd=0.1)
    )
    assert time.process_time() - start < 1.0  # 0.1 s on a free machine
    kind, _, photos, *_ = block.observation_groups[0]
    assert (kind, len(photos), photos[-1, 0]) == ("position", count, count - 1)


def test_a_block_checks_the_changed_fields(example):
    block = example.measured()
    groups = block.observation_groups
    assert block.replace(title="again", image_sd=0.02).observation_groups is groups
    assert block.replace(photo_position_sd=1.0).observation_groups is not groups
    fewer = {name: getattr(block, name)[1:] for name in ("image_photos", "image_points", "image_xy")}
    for change, code in (
        ({"image_points": np.zeros(len(block.image_xy), dtype=int)}, "block.repeated-image"),
        (fewer, "error.shape"),
        ({"photo_cameras": [0]}, "error.requires"),
        ({"point_sd": -1.0}, "block.value.sd"),
        ({"title": 1}, "error.text"),
        ({"frame": None}, "error.kind"),
        ({"observations": [Distance("P0", "unknown", 1.0, sd=1.0)]}, "error.absent"),
    ):
        with raises(InputError, code):
            block.replace(**change)
    assert block.replace(**fewer, image_sd=block.image_sd[1:]).observation_groups[0][0] == groups[0][0]


def test_observations_of_single_points_are_eliminated_with_them_without_another_result():
    simulation = simulate(strips=2, photos_per_strip=3, seed=4)
    block, rng = simulation.block, np.random.default_rng(4)
    positions = adjust(block).point_positions
    free = np.flatnonzero(np.isinf(block.point_sd).all(axis=1) & np.isfinite(positions).all(axis=1))[:60]
    roots = 0.2 * (np.eye(3) + np.tril(rng.uniform(-0.5, 0.5, (60, 3, 3)), -1))
    names = [block.point_ids[point] for point in free]
    control = Control.from_arrays(
        point=names,
        position=positions[free] + np.einsum("nij,nj->ni", roots, rng.normal(size=(60, 3))),
        covariance=roots @ roots.transpose(0, 2, 1),
    )
    # Distances of almost no weight connect the points: then they are not eliminated first.
    weak = Distance.from_arrays(first=names[:-1], second=names[1:], length=100.0, sd=1e9)
    alone = adjust(block.replace(observations=[control]))
    connected = adjust(block.replace(observations=[control, weak]))
    assert alone.degrees_of_freedom + len(weak) == connected.degrees_of_freedom
    for name, scale in {
        "photo_positions": connected.photo_sd[:, :3],
        "point_positions": connected.point_sd,
        "photo_cofactors": None,
        "point_cofactors": None,
        "residuals": block.image_sd,
        "redundancy": 1.0,
        "standardized": 1.0,
    }.items():
        found, expected = getattr(alone, name), getattr(connected, name)
        off = np.abs(found - expected) / (np.nanmax(np.abs(expected)) if scale is None else scale)
        assert np.nanmax(off) < 1e-6, name
    for name in ("sd", "residuals", "redundancy", "standardized", "squares", "weights"):
        found, expected = (getattr(each.kinds["control"], name) for each in (alone, connected))
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8, err_msg=name)
    assert alone.kinds["control"].names == names
    first, second = (each.reliability() for each in (alone, connected))
    groups = len(first.tests.statistic)
    assert groups + len(weak) == len(second.tests.statistic)
    for name in ("statistic", "least"):
        found, expected = (getattr(each.tests, name)[:groups] for each in (first, second))
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6, err_msg=name)
    once, twice = (adjust(alone.block, threads=count) for count in (1, 2))
    assert np.array_equal(once.point_cofactors, twice.point_cofactors)
    assert np.array_equal(once.kinds["control"].redundancy, twice.kinds["control"].redundancy)
