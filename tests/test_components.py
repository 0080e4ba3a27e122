"""Variance components: published problems, the six-photo block, weights that are wrong."""

import json
from pathlib import Path

import numpy as np
import pytest

from golden_data import golden
from message_codes import raises
from photogram import (
    Block,
    InputError,
    adjust,
    clean,
    group_sums,
    simulate,
    variance_components,
    variance_function,
)
from photogram.collection import adjust as adjust_collection
from photogram.collection import simulate as simulate_collection
from photogram.results.components import statement
from photogram.results.grouping import Probing
from photogram.statistics.components import GroupsOf, Settings, balanced, estimate, helmert_step

PUBLISHED = Path(__file__).parent / "data" / "statistics" / "published_problems.json"
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
    settings = Settings(tolerance=1e-9, least_redundancy=1, **options)
    return estimate(lambda factors: OneWay(values, start * factors), groups, settings)


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
    assert (found.messages[0].code, found.messages[0].fields["name"]) == ("components.low", "batch")
    assert -0.1 < found.messages[0].fields["component"] < 0
    # Near the boundary, where all is residual.
    assert computed["components"][0] * residual.factor == pytest.approx(13.8063, rel=2e-3)


def six_photos():
    given = golden("statistics", "block6_components.json")
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


@pytest.fixture(scope="module")
def simulated():
    return simulate(
        strips=3, photos_per_strip=5, points_per_photo=40, position_sd=0.5, attitude_sd=1e-4, seed=3
    ).block


def test_image_weights_wrong_by_four_are_corrected(simulated):
    wrong = simulated.replace(image_sd=simulated.image_sd / 4)
    found = variance_components(wrong)
    assert found.estimate.converged
    images = found["images"]
    assert images.interval[0] < 16 < images.interval[1]
    assert images.worth_changing
    assert str(statement(found)[0]).startswith(
        "Standard deviations of images are too small by a factor of 4."
    )
    assert found.document().table("components").frame().equals(found.table())
    assert (found.verdict.code, found.verdict.exit) == ("weights-of-groups", 4)
    assert "Standard deviations are wrong: those of images by about 4." in found.verdict.headline
    # Whatever the given weights are, the solution is that of the estimated ones.
    other = variance_components(simulated)
    assert found.network.image_sd == pytest.approx(other.network.image_sd, rel=0.01)
    assert found.result.point_positions == pytest.approx(other.result.point_positions, abs=2e-3)


def test_what_cannot_be_estimated_is_merged_or_held_and_said_so(simulated):
    found = variance_components(simulated, "component", equality=False)
    names = {each.name: each for each in found.components}
    assert names["control"].members == ("control, plan", "control, height")
    assert "nothing checks it" in names["control"].held
    assert names["control"].factor == 1.0
    merged, held = found.estimate.messages
    assert (merged.code, merged.fields) == (
        "components.merged",
        {"names": ["control, plan", "control, height"], "name": "control"},
    )
    assert (held.code, held.fields["reason"].code) == ("components.held", "held.unchecked")
    every = adjust(found.network).degrees_of_freedom
    assert sum(each.redundancy for each in found.components) == pytest.approx(every, abs=1e-6)


def test_labels_of_ones_own(simulated):
    rng = np.random.default_rng(2)
    labels = rng.choice(["old", "new"], len(simulated.image_xy))
    factors = np.where(labels == "old", 2.0, 1.0)
    truth = adjust(simulated)
    noise = rng.normal(size=simulated.image_xy.shape) * 0.01 * factors[:, np.newaxis]
    block = simulated.replace(image_xy=simulated.image_xy - truth.residuals + noise)
    found = variance_components(block, {"images": labels}, held=["control", "positions", "attitudes"])
    assert found["old"].interval[0] < 4 < found["old"].interval[1]
    assert found["new"].interval[0] < 1 < found["new"].interval[1]
    assert found.estimate.equality[2] < 1e-6
    assert found["positions"].held == "as asked"
    with pytest.raises(InputError, check=lambda error: error.phrase.fields["message"].code == "error.shape"):
        variance_components(block, {"images": ["a", "b", "c"]})
    with raises(InputError, "weighting.unknown-group"):
        variance_components(block, {"images": labels}, held=["young"])


def test_components_of_a_collection():
    collection = simulate_collection(photos=8, points=120, noise=0.5, seed=1).collection
    wrong = collection.replace(image_sd=collection.image_sd * [1.0, 3.0])
    found = variance_components(wrong, "component")
    x, y = found["images, x"], found["images, y"]
    assert x.interval[0] < 1 < x.interval[1]
    assert y.interval[0] < 1 / 9 < y.interval[1]
    assert [each.name for each in found.worth_changing] == ["images, y"]
    assert x.redundancy + y.redundancy == pytest.approx(found.result.degrees_of_freedom, abs=1e-6)


def test_three_components_are_recovered_within_their_deviations():
    """The figures of docs/weights.md in small: benches/variance_components.py has 500 runs."""
    ratios, inside = [], []
    for seed in range(12):
        block = simulate(
            strips=2, photos_per_strip=4, points_per_photo=30, position_sd=1.0, attitude_sd=3e-4, seed=seed
        ).block
        wrong = block.replace(
            image_sd=block.image_sd / 2,
            photo_position_sd=block.photo_position_sd * 2,
            photo_attitude_sd=block.photo_attitude_sd,
        )
        found = variance_components(wrong, held=["control"], equality=False)
        for name, true in (("images", 4.0), ("positions", 1 / 4), ("attitudes", 1.0)):
            each = found[name]
            inside.append(each.interval[0] < true < each.interval[1])
            ratios.append(np.log(each.factor / true) / (each.sd / each.factor))
    assert np.mean(inside) > 0.85
    assert abs(np.mean(ratios)) < 0.5
    assert 0.6 < np.std(ratios) < 1.4


def test_sums_over_groups_follow_their_distribution(simulated):
    result = adjust(simulated)
    sums = group_sums(result, "photo")
    assert sums.rejected == []
    assert len(sums.groups) == 15 + 3
    factored_sums = group_sums(result, "photo", probing=EXACT)
    for each, other in zip(sums.groups, factored_sums.groups, strict=True):
        assert each.spread == pytest.approx(other.spread, rel=0.25)
        assert each.spread <= each.redundancy
    total = sum(each.redundancy for each in sums.groups)
    assert total == pytest.approx(result.degrees_of_freedom, abs=1e-6)
    photo = int(simulated.image_photos[0])
    xy = simulated.image_xy.copy()
    of_photo = simulated.image_photos == photo
    xy[of_photo] += np.random.default_rng(4).normal(size=(int(of_photo.sum()), 2)) * 0.03
    found = group_sums(adjust(simulated.replace(image_xy=xy)), "photo").rejected
    assert f"images, photo {simulated.photo_ids[photo]}" in [each.name for each in found]


def test_sums_of_the_six_photo_block():
    given = golden("statistics", "block6_components.json")
    block, _ = six_photos()
    sums = group_sums(adjust(block, tolerance=1e-8), "strip", probing=EXACT)
    first = given["three_helmert"]["log"][0]
    assert [each.spread for each in sums.groups] == pytest.approx(first["s"], rel=1e-5)
    assert [each.squares for each in sums.groups] == pytest.approx(first["q"], rel=1e-5)


def test_the_redundancy_mode_does_not_depend_on_the_weights_of_stations():
    variances = {"free": [], "redundancy": []}
    for seed in range(20):
        block = simulate(
            strips=2, photos_per_strip=4, points_per_photo=20, position_sd=0.02, attitude_sd=1e-5, seed=seed
        ).block
        for mode, found in variances.items():
            result = adjust(block, unit_variance=mode)
            found.append(result.variance_of_unit_weight)
            assert result.global_test.variance == pytest.approx(
                result.sums_of_squares.measured / result.redundancies.measured
            )
        total = result.redundancies.total
        assert total == pytest.approx(adjust(block).degrees_of_freedom, abs=1e-6)
        assert result.degrees_of_freedom == pytest.approx(result.redundancies.measured, abs=1e-6)
    # Stations so well known determine unknowns that `free` subtracts: its variance is too large.
    assert np.mean(variances["free"]) > 1.15
    assert np.mean(variances["redundancy"]) == pytest.approx(1.0, abs=0.05)


def test_weak_stations_leave_the_redundancy_mode_as_it_is():
    block = simulate(strips=2, photos_per_strip=4, points_per_photo=20, position_sd=1e4, seed=1).block
    free, own = (adjust(block, unit_variance=mode) for mode in ("free", "redundancy"))
    assert own.variance_of_unit_weight == pytest.approx(free.variance_of_unit_weight, rel=1e-4)
    assert own.degrees_of_freedom == pytest.approx(free.degrees_of_freedom, rel=1e-3)
    with raises(InputError, "adjust.redundancy-numbers"):
        adjust(block, unit_variance="redundancy", covariance=False)


def test_a_variance_that_grows_with_the_radius():
    simulation = simulate(strips=3, photos_per_strip=5, points_per_photo=100, seed=3)
    radius = np.linalg.norm(simulation.truth.image_xy, axis=1)
    sd = 0.01 * np.sqrt(0.25 + 1.75 * (radius / radius.max()) ** 2)
    noise = np.random.default_rng(1).normal(size=(len(sd), 2)) * sd[:, np.newaxis]
    block = simulation.block.replace(image_xy=simulation.truth.image_xy + noise)
    found = variance_function(block)
    estimate = found.estimate
    assert estimate.converged
    assert np.abs(estimate.coefficients - [0.25, 1.75]) == pytest.approx(0, abs=2.5 * estimate.sd.max())
    assert (np.abs(estimate.coefficients - [0.25, 1.75]) < 2.5 * estimate.sd).all()
    # The first regression alone takes the errors of neighbours for those of an image.
    assert estimate.first[0] > 0.4
    assert found.test_value > 5
    halves = np.where(radius > np.median(radius), "outer", "inner")
    parts = variance_components(block, {"images": halves}, held=["control"])
    assert parts["outer"].factor > parts["inner"].factor
    assert parts.estimate.equality[2] < 1e-4
    assert all(each.interval[0] < found.factor(each.value) < each.interval[1] for each in found.bins)
    assert found.document().table("bins").frame().equals(found.table())


def contaminated(factor):
    """Return a block of image sds too small by a factor, with eight gross errors of 25 true sds."""
    block = simulate(strips=3, photos_per_strip=5, points_per_photo=40, position_sd=0.5, seed=6).block
    random = np.random.default_rng(8)
    rays = np.bincount(block.image_points)
    many = np.flatnonzero(rays[block.image_points] >= 4)
    bad = random.choice(many, 8, replace=False)
    xy = block.image_xy.copy()
    xy[bad] += 0.25 * random.choice([-1, 1], (8, 2))
    return block.replace(image_xy=xy, image_sd=block.image_sd / factor), bad


def test_gross_errors_and_weights_are_found_together():
    block, bad = contaminated(3.0)
    found = clean(block)
    assert found.settled
    assert 1 <= found.rounds <= 3
    by_group = dict(zip(found.groups, found.factors.tolist(), strict=True))
    assert by_group["images"] == pytest.approx(9, rel=0.25)
    assert by_group["positions"] == 1.0
    seen = found.result.block
    left = set(zip(seen.image_photos.tolist(), seen.image_points.tolist(), strict=True))
    given = zip(block.image_photos.tolist(), block.image_points.tolist(), strict=True)
    out = {row for row, each in enumerate(given) if each not in left}
    assert set(bad.tolist()) <= out
    assert len(out) <= len(bad) + 1
    assert found.components["images"].interval[0] < 1 < found.components["images"].interval[1]
    assert "standard deviations of images: multiplied by 2.88" in " ".join(found.changes)


def test_weights_that_are_right_stay_when_gross_errors_are_out():
    block, bad = contaminated(1.0)
    found = clean(block)
    assert found.rounds == 0
    assert found.components is None
    assert (found.factors == 1).all()
    assert len(found.snooped.removed) in (len(bad), len(bad) + 1)


def test_what_errors_leave_is_a_projection():
    """Test that of images alone R is symmetric and idempotent, with the degrees of freedom as its trace."""
    collection = simulate_collection(photos=4, points=25, noise=0.5, seed=2).collection
    result = adjust_collection(collection)
    core = result._factor()
    m = len(collection.image_xy)
    r = core.project_images(np.eye(2 * m).reshape(-1, m, 2), threads=1, progress=None).reshape(2 * m, 2 * m)
    assert r == pytest.approx(r.T, abs=1e-8)
    assert r @ r == pytest.approx(r, abs=1e-8)
    assert np.trace(r) == pytest.approx(result.degrees_of_freedom, abs=1e-6)
    assert np.diag(r) == pytest.approx(result.redundancy.ravel(), abs=1e-7)
    standardized = (result.residuals / collection.image_sd).ravel()
    # The residuals lie in its range, but for what is not linear.
    assert r @ standardized == pytest.approx(standardized, abs=1e-2)
