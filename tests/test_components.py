"""Variance components: published problems, the six-photo block, weights that are wrong."""

import json
from pathlib import Path

import numpy as np
import pytest

from photogram import Block, variance_components
from photogram.results.group_sums import Probing
from photogram.statistics.components import GroupsOf, balanced, estimate, helmert_step
from shared_data import SHARED

PUBLISHED = Path(__file__).parent / "data" / "statistics" / "published_problems.json"
BLOCK = SHARED / "statistics" / "block6_components.json"
EXACT = Probing(exact=10_000)


class OneWay:
    """The one-way layout: batch effects observed as zero with one variance, values with another."""

    def __init__(self, values, variances):
        values = np.array(values)
        batches, each = values.shape
        rows = np.zeros((batches * (1 + each), batches + 1))
        rows[:batches, 1:] = np.eye(batches)
        rows[batches:, 0] = 1.0
        rows[batches:, 1:] = np.repeat(np.eye(batches), each, axis=0)
        self.group = np.repeat([0, 1], [batches, batches * each])
        weights = 1 / np.sqrt(np.array(variances)[self.group])
        rows *= weights[:, np.newaxis]
        self.normal = rows.T @ rows
        self.r = np.eye(len(rows)) - rows @ np.linalg.solve(self.normal, rows.T)
        self.residuals = self.r @ (np.concatenate([np.zeros(batches), values.ravel()]) * weights)
        self.variances = np.array(variances)
        self.counts = np.bincount(self.group)
        self.squares = np.bincount(self.group, self.residuals**2)
        self.redundancy = np.bincount(self.group, np.diag(self.r))

    def matrix(self):
        """Return the Helmert matrix."""
        of = np.eye(2)[self.group]
        return of.T @ self.r**2 @ of

    def restricted_likelihood(self):
        """Twice its logarithm, up to a constant."""
        _, determinant = np.linalg.slogdet(self.normal)
        return -(self.counts @ np.log(self.variances) + determinant + self.squares.sum())


@pytest.fixture(scope="module")
def one_way():
    return json.loads(PUBLISHED.read_text())["components"]


def estimated(values, start, **options):
    groups = GroupsOf(("batch", "residual"))
    return estimate(
        lambda factors: OneWay(values, start * factors), groups, tolerance=1e-9, least_redundancy=1, **options
    )


def test_dyestuff(one_way):
    values, computed = one_way["data"]["dyestuff"], one_way["computed"]["dyestuff_helmert"]
    found = estimated(values, 2000.0)
    assert found.converged
    published = one_way["published"]["dyestuff"]
    variances = [2000 * each.factor for each in found.components]
    assert variances == pytest.approx([published["batch"], published["residual"]], rel=1e-8)
    assert found.matrix == pytest.approx(np.array(computed["H"]), rel=1e-8)
    sd = [2000 * each.sd for each in found.components]
    assert sd == pytest.approx(computed["sd_of_components"], rel=1e-8)
    least = [2000 * each.least_sd for each in found.components]
    assert least == pytest.approx(computed["naive_sd"], rel=1e-8)


def test_the_likelihood_ratio_is_that_of_the_restricted_likelihood(one_way):
    values = one_way["data"]["dyestuff"]
    ratio, freedom, probability = estimated(values, 2451.25).equality
    best = OneWay(values, [1764.05, 2451.25]).restricted_likelihood()
    equal = max(OneWay(values, [x, x]).restricted_likelihood() for x in np.linspace(2000, 2500, 5001))
    assert ratio == pytest.approx(best - equal, rel=1e-4)
    assert freedom == 1
    assert probability == pytest.approx(0.710, abs=1e-3)


def test_helmert_takes_one_step_from_equal_values(one_way):
    for name in ("dyestuff", "box_tiao"):
        first = one_way["computed"][f"{name}_helmert"]["first"][0]
        state = OneWay(one_way["data"][name], first["components"])
        assert state.squares == pytest.approx(first["q"], rel=1e-8)
        factors = helmert_step(state.matrix(), state.squares, [0, 1])
        assert factors == pytest.approx(first["factor"], rel=1e-8)


def test_a_negative_component_is_said_so_and_held(one_way):
    computed = one_way["computed"]["box_tiao_helmert"]
    found = estimated(one_way["data"]["box_tiao"], computed["components"][0])
    batch, residual = found.components
    assert batch.factor == 0.01
    assert batch.held
    assert (
        "residuals of batch are smaller than any positive variance explains (component -0.0"
        in found.messages[0]
    )
    # Near the boundary, where all is residual.
    assert computed["components"][0] * residual.factor == pytest.approx(13.8063, rel=2e-3)


def six_photos():
    given = json.loads(BLOCK.read_text())
    own = given["input"]
    photos, points = list(own["photos_initial"]), list(own["points_initial"])
    poses = np.array([own["photos_initial"][photo] for photo in photos])
    positions, sd = np.full((len(points), 3), np.nan), np.full((len(points), 3), np.inf)
    for name, *place in own["control"]:
        positions[points.index(name)], sd[points.index(name)] = place, own["control_sd"]
    images = own["images"]
    block = Block(
        photo_ids=photos,
        photo_positions=poses[:, :3],
        photo_attitudes=poses[:, 3:],
        photo_position_sd=np.full((6, 3), np.inf),
        photo_attitude_sd=np.full((6, 3), np.inf),
        principal_distances=np.full(6, own["principal_distance"]),
        point_ids=points,
        point_positions=positions,
        point_sd=sd,
        image_photos=np.array([photos.index(each[0]) for each in images]),
        image_points=np.array([points.index(each[1]) for each in images]),
        image_xy=np.array([each[2:] for each in images]),
        image_sd=np.full((len(images), 2), own["image_sd"]),
    )
    return block, given


@pytest.mark.skipif(not BLOCK.exists(), reason="needs shared/data/statistics")
@pytest.mark.parametrize("which", ["two_helmert", "three_foerstner"])
def test_six_photo_block(which):
    block, given = six_photos()
    expected = given[which]
    held = ["control"] if which.startswith("two") else []
    found = variance_components(block, "strip", held=held, tolerance=1e-9, probing=EXACT)
    components = found.components
    assert [each.name for each in components] == ["images, strip 1", "images, strip 2", "control"]
    assert [each.factor for each in components] == pytest.approx(expected["components"], rel=1e-5)
    assert [each.redundancy for each in components] == pytest.approx(expected["r"], rel=1e-5)
    assert [each.squares for each in components] == pytest.approx(expected["q"], rel=1e-5)
    assert found.estimate.matrix == pytest.approx(np.array(expected["H"]), rel=1e-5)
    for each, sd, least, z in zip(
        components,
        expected["sd_of_components"],
        expected["naive_sd"],
        expected["test_against_1_log"],
        strict=True,
    ):
        if each.held:
            continue
        assert each.sd == pytest.approx(sd, rel=1e-5)
        assert each.least_sd == pytest.approx(least, rel=1e-5)
        assert each.test_value == pytest.approx(z, rel=1e-5)
    assert [each.name for each in found.worth_changing] == ["images, strip 1", "images, strip 2"]
    _, squares, redundancy = found.estimate.steps[0]
    assert squares[:3] == pytest.approx(expected["log"][0]["q"], rel=1e-5)
    assert redundancy[:3] == pytest.approx(expected["log"][0]["r"], rel=1e-5)


@pytest.mark.skipif(not BLOCK.exists(), reason="needs shared/data/statistics")
def test_random_signs_are_near_the_exact_matrix_and_the_same_again():
    block, given = six_photos()
    signs = Probing(exact=30, vectors=64)
    found = [
        variance_components(block, "strip", probing=signs, equality=False, threads=threads)
        for threads in (1, 2)
    ]
    assert found[0].estimate.matrix.tobytes() == found[1].estimate.matrix.tobytes()
    exact = given["three_helmert"]
    redundancy = [each.redundancy for each in found[0].components]
    assert found[0].estimate.matrix.sum(axis=1) == pytest.approx(redundancy, rel=1e-6)
    assert redundancy == pytest.approx(exact["r"], rel=0.01)
    assert found[0].estimate.matrix == pytest.approx(np.array(exact["H"]), rel=0.2)
    sd = [each.sd for each in found[0].components]
    assert sd == pytest.approx(exact["sd_of_components"], rel=0.1)


def test_a_balanced_matrix_is_symmetric_and_sums_to_the_redundancy():
    rng = np.random.default_rng(5)
    matrix = np.diag([30.0, 20.0, 10.0]) + rng.uniform(1, 3, (3, 3))
    redundancy = np.array([37.0, 26.0, 15.0])
    found = balanced(matrix, redundancy, [False, False, False])
    assert found == pytest.approx(found.T)
    assert found.sum(axis=1) == pytest.approx(redundancy, rel=1e-9)
    partly = balanced(matrix, redundancy, [False, False, True])
    assert partly[:, 2] == pytest.approx(matrix[:, 2])
    assert partly[:2].sum(axis=1) == pytest.approx(redundancy[:2], rel=1e-9)
