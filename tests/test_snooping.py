"""Data snooping against golden logs, published problems and planted blunders."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import photogram
import photogram.collection
from golden_data import golden
from photogram import Block, Distance
from photogram.adjustment.snooping import block_trial
from photogram.cli import app
from photogram.results import snooping_log
from photogram.statistics import lambda0


def golden_block(given):
    photos, points = list(given["photos_initial"]), list(given["points_initial"])
    poses = np.array(list(given["photos_initial"].values()))
    positions = np.array(list(given["points_initial"].values()), dtype=float)
    sd = np.full(positions.shape, np.inf)
    for name, *xyz in given["control"]:
        positions[points.index(name)] = xyz
        sd[points.index(name)] = given["control_sd"]
    return Block(
        photo_ids=photos,
        photo_positions=poses[:, :3],
        photo_attitudes=poses[:, 3:],
        principal_distances=np.full(len(photos), given["principal_distance"]),
        point_ids=points,
        point_positions=positions,
        point_sd=sd,
        image_photos=np.array([photos.index(image[0]) for image in given["images"]]),
        image_points=np.array([points.index(image[1]) for image in given["images"]]),
        image_xy=np.array([image[2:] for image in given["images"]], dtype=float),
        image_sd=given["image_sd"],
    )


def called(observation):
    if observation[0] == "image":
        return f"image of point {observation[2]} on photo {observation[1]}"
    return f"control point {observation[1]}"


@pytest.mark.parametrize(("unit_weight", "log"), [("known", "snoop_chi2"), ("unknown", "snoop_F")])
def test_golden_logs(unit_weight, log):
    data = golden("statistics", "block6_blunders.json")
    expected = data[log]
    found = photogram.snoop(golden_block(data["input"]), unit_weight=unit_weight, parts=False)
    rounds = expected["log"]
    assert len(found.outcome.rounds) == len(rounds)
    assert found.outcome.tests == rounds[0]["tests"]
    for each, given in zip(found.outcome.rounds, rounds, strict=True):
        assert each.degrees_of_freedom == given["dof"]
        assert each.weighted_sum_of_squares == pytest.approx(given["omega"], rel=1e-6)
        assert each.limit == pytest.approx(given["limit_p"])
        assert [found.log[row].name for row in each.removed] == [
            called(own["observation"]) for own in given["removed"]
        ]
    for entry, given in zip(found.log, rounds[0]["removed"], strict=True):
        assert entry.dimension == given["dimension"]
        assert entry.statistic == pytest.approx(given["T"], rel=1e-4)
        assert entry.first_statistic == pytest.approx(given["first_T"], rel=1e-4)
        assert entry.fisher == pytest.approx(given["F"], rel=1e-4)
        assert np.exp(entry.log_probability) == pytest.approx(given["p"], rel=1e-3)
        assert entry.error == pytest.approx(given["estimated_error"], rel=1e-4)
        assert [rival.name for rival in entry.rivals] == [
            called(own["observation"]) for own in given["rivals"]
        ]
        for rival, own in zip(entry.rivals, given["rivals"], strict=True):
            assert rival.odds == pytest.approx(own["odds"], rel=1e-4)
    again = {called(own["observation"]): own for own in rounds[0]["readmission_tests"]}
    for entry in found.log:
        if entry.name in again:
            assert entry.prediction == pytest.approx(again[entry.name]["T"], rel=1e-4)
            assert entry.prediction_error == pytest.approx(again[entry.name]["predicted_error"], rel=1e-4)
        else:
            assert entry.prediction is None
    final = expected["final"]
    assert found.result.degrees_of_freedom == final["dof"]
    assert found.result.variance_of_unit_weight == pytest.approx(final["variance_of_unit_weight"], rel=1e-6)
    assert found.result.photo_positions == pytest.approx(
        np.array(list(final["photos"].values()))[:, :3], abs=1e-5
    )


def test_groups_of_the_golden_block():
    """R, T, dimensions, estimated errors and effects of every observation, straight from the core."""
    data = golden("statistics", "block6_blunders.json")
    block = golden_block(data["input"])
    result = photogram.adjust(block, tolerance=1e-9)
    trial = block_trial(block, result.state, result.options)
    trial.core.stand()
    tests = trial.core.tests()
    suspects = trial.suspects
    number = {str(suspects.name(group)): group for group in range(len(suspects))}
    blocks = np.concatenate([[0], np.cumsum(np.diff(suspects.row_starts) ** 2)])
    effects = trial.core.effects(list(range(len(suspects))))
    noncentrality = lambda0()
    for own in data["adjustment"]["observations"]:
        group, expected = number[called(own["observation"])], own["group"]
        rows, sd = suspects.rows(group), np.array(own["sd"])
        r = tests["cofactors"][blocks[group] : blocks[group + 1]].reshape(len(sd), len(sd))
        assert r * np.outer(sd, sd) == pytest.approx(np.array(own["qvv"]), abs=1e-7 * sd[0] ** 2)
        assert tests["residual"][rows] * sd == pytest.approx(own["residual"], abs=1e-6 * sd[0])
        assert tests["rank"][group] == expected["dimension"]
        assert tests["statistic"][group] == pytest.approx(expected["T"], rel=1e-5)
        assert tests["error"][rows] == pytest.approx(expected["estimated_error"], rel=1e-4, abs=1e-8)
        assert np.sqrt(lambda0_of(expected["dimension"]) / tests["least"][group]) == pytest.approx(
            expected["mdb_standardised_largest"], rel=1e-5
        )
        for row, r_row, effect in zip(rows, own["redundancy"], own["effect_of_mdb"], strict=True):
            if r_row < 0.01:
                continue
            size = np.sqrt(noncentrality / r_row)
            assert size * effects[row] == pytest.approx(effect["own_point"], rel=1e-5, abs=1e-7)


def lambda0_of(dimension):
    return lambda0(0.001, 0.80, dimension)


def test_correlations_on_a_point():
    data = golden("statistics", "block6_blunders.json")
    block = golden_block(data["input"])
    result = photogram.adjust(block, tolerance=1e-9)
    trial = block_trial(block, result.state, result.options)
    trial.core.stand()
    for given in data["adjustment"]["test_correlations_on_a_point"]:
        point = block.point_ids.index(given["point"])
        groups = np.flatnonzero(trial.suspects.points == point).tolist()
        number = {str(trial.suspects.name(group)): group for group in groups}
        rows = [
            trial.suspects.row_starts[number[called(["image", photo, given["point"]])]] + "xy".index(axis)
            for photo, axis in given["rows"]
        ]
        columns = np.concatenate([trial.suspects.rows(group) for group in groups])
        r = trial.core.responses(groups)[np.ix_(np.searchsorted(columns, rows), rows)]
        scale = np.sqrt(np.diagonal(r))
        assert r / np.outer(scale, scale) == pytest.approx(np.array(given["correlation"]), abs=1e-6)


def test_by_the_bound_as_exactly(monkeypatch):
    """The way for large networks finds the same in the golden block."""
    data = golden("statistics", "block6_blunders.json")
    block = golden_block(data["input"])
    exact = photogram.snoop(block, parts=False)
    monkeypatch.setattr(snooping_log, "MAX_ROWS", 0)
    bounded = photogram.snoop(block, parts=False)
    assert {entry.name for entry in bounded.removed} == {entry.name for entry in exact.removed}
    assert bounded.result.photo_positions == pytest.approx(exact.result.photo_positions, abs=1e-6)


def test_a_height_goes_alone():
    data = golden("statistics", "block6_blunders.json")
    found = photogram.snoop(golden_block(data["input"]))
    assert "Z of control point 033" in [entry.name for entry in found.removed]
    assert np.isinf(found.result.block.point_sd[found.result.block.point_ids.index("033")]).tolist() == [
        False,
        False,
        True,
    ]


def small(seed, **options):
    return photogram.simulate(
        **{"strips": 2, "photos_per_strip": 5, "points_per_photo": 30, "seed": seed, **options}
    )


def test_without_gross_errors_hardly_anything_goes():
    """Family level 0.05: of 25 blocks one loses an observation in the mean, five in one case of 140."""
    spoilt = sum(bool(photogram.snoop(small(seed).block).removed) for seed in range(40, 65))
    assert spoilt <= 4


def test_wrong_images_are_found_and_coordinates_restored():
    made = small(3, points_per_photo=60)
    block = made.block
    random = np.random.default_rng(1)
    rays = np.bincount(block.image_points)[block.image_points]
    bad = random.choice(np.flatnonzero(rays >= 3), 6, replace=False)
    xy = block.image_xy.copy()
    xy[bad] += random.choice([-1, 1], (6, 2)) * random.uniform(30, 100, (6, 2)) * block.image_sd[bad]
    found = photogram.snoop(block.replace(image_xy=xy))
    out = {entry.group for entry in found.removed if entry.kind == "image"}
    assert set(bad.tolist()) <= out
    assert found.result.global_test.probability > 0.01
    good = photogram.adjust(block)
    difference = (found.result.photo_positions - good.photo_positions) / good.photo_sd[:, :3]
    assert np.abs(difference).max() < 3


def test_stations_and_observations_beside_images():
    made = small(8, points_per_photo=40, position_sd=0.1)
    block = made.block
    observed = (
        block.photo_positions_observed
        if block.photo_positions_observed is not None
        else block.photo_positions
    ).copy()
    observed[4, 2] += 8.0
    truth = made.truth.point_positions
    points = np.flatnonzero(np.bincount(block.image_points, minlength=len(block.point_ids)) >= 3)[:2]
    length = float(np.linalg.norm(truth[points[0]] - truth[points[1]]))
    names = [block.point_ids[point] for point in points]
    wrong = block.replace(
        photo_positions_observed=observed,
        observations=[Distance(*names, length + 9.0, sd=0.3)],
    )
    found = photogram.snoop(wrong)
    removed = [entry.name for entry in found.removed]
    assert f"Z of position of photo {block.photo_ids[4]}" in removed
    assert any(name.startswith("distance") for name in removed)
    assert len(removed) == 2
    sizes = {entry.kind: entry.error for entry in found.removed}
    assert sizes["position"][0] == pytest.approx(8.0, abs=0.8)
    assert sizes["observation"][0] == pytest.approx(9.0, abs=1.0)
    assert not found.result.block.observations
    assert np.isinf(found.result.block.photo_position_sd[4]).tolist() == [False, False, True]


def test_a_robust_start_where_many_are_wrong():
    made = small(5, points_per_photo=60)
    block = made.block
    random = np.random.default_rng(2)
    bad = np.flatnonzero(random.random(len(block.image_xy)) < 0.12)
    xy = block.image_xy.copy()
    xy[bad] += (
        random.choice([-1, 1], (len(bad), 2)) * random.uniform(40, 100, (len(bad), 2)) * block.image_sd[bad]
    )
    found = photogram.snoop(block.replace(image_xy=xy))
    assert found.outcome.rounds[0].number == 0
    assert found.result.variance_of_unit_weight < 1.5
    left = set(bad.tolist()) - {
        int(group) for group in np.flatnonzero(found.outcome.out.rows[found.suspects.row_starts[:-1]])
    }
    assert len(left) < 0.1 * len(bad)


def test_standard_deviations_that_are_too_small_by_a_factor():
    block = small(11, points_per_photo=50).block
    found = photogram.snoop(block.replace(image_sd=block.image_sd / 5, point_sd=block.point_sd / 5))
    assert len(found.removed) <= 1
    assert found.outcome.factors["image"] == pytest.approx(5, rel=0.25)
    assert any("too small" in str(message) for message in found.result.messages)


def test_the_last_support_stays():
    """A photo with three points: none of its images goes, however wrong."""
    block = small(12, points_per_photo=40).block
    photo = 0
    own = np.flatnonzero(block.image_photos == photo)
    rays = np.bincount(block.image_points)
    kept = own[np.argsort(-rays[block.image_points[own]])[:3]]
    use = np.setdiff1d(np.arange(len(block.image_xy)), np.setdiff1d(own, kept))
    xy = block.image_xy.copy()
    xy[kept[0]] += 0.5
    cut = block.replace(
        image_photos=block.image_photos[use],
        image_points=block.image_points[use],
        image_xy=xy[use],
        image_sd=block.image_sd[use],
    )
    found = photogram.snoop(cut)
    assert np.isfinite(found.result.photo_positions).all()
    on_photo = found.result.block.image_photos == photo
    assert on_photo.sum() == 3


@pytest.mark.parametrize(("factor", "unit_weight"), [(1, "known"), (1, "unknown"), (10, "unknown")])
def test_a_common_error_is_named_with_any_unit_weight(factor, unit_weight):
    block = small(3, strips=3, photos_per_strip=6, points_per_photo=25, position_sd=0.05).block
    positions = block.point_positions.copy()
    positions[np.isfinite(block.point_sd).all(axis=1), 2] += 3.0 * factor
    sd = {name: factor * getattr(block, name) for name in ("image_sd", "point_sd", "photo_position_sd")}
    found = photogram.snoop(block.replace(point_positions=positions, **sd), unit_weight=unit_weight)
    assert not found.removed
    assert [remark.code for remark in found.outcome.remarks] == ["snooping.common"]


def test_collections():
    made = photogram.collection.simulate(seed=4)
    collection = made.collection
    random = np.random.default_rng(3)
    rays = np.bincount(collection.image_points)[collection.image_points]
    bad = random.choice(np.flatnonzero(rays >= 4), 4, replace=False)
    xy = collection.image_xy.copy()
    xy[bad] += random.choice([-1, 1], (4, 2)) * 40 * collection.image_sd[bad]
    found = photogram.snoop(collection.replace(image_xy=xy))
    out = {entry.group for entry in found.removed}
    assert set(bad.tolist()) <= out
    assert len(out) <= 6
    assert found.result.variance_of_unit_weight < 1.3
    assert json.loads(found.to_json())["snooping"]["tests"] > 0


def test_the_log_in_every_form():
    data = golden("statistics", "block6_blunders.json")
    found = photogram.snoop(golden_block(data["input"]))
    log = found.document().table("snooping.log")
    (names,) = [column.values for column in log.columns if column.head == "What"]
    assert list(names) == [entry.name for entry in found.log]
    table = found.table()
    assert set(table["unit"]) == {"mm", "m"}
    assert len(table) == sum(len(entry.rows) for entry in found.log)
    document = json.loads(found.to_json())["snooping"]
    assert [own["name"] for own in document["log"]] == [entry.name for entry in found.log]
    assert [*map(str, found.rivals)] == [
        "image of point 021 on photo S2P1 or image of point 021 on photo S2P2 (odds 1 : 1)"
    ]


@pytest.mark.parametrize(
    "options",
    [
        {"level": 0.0},
        {"fdr": 2.0},
        {"unit_weight": "perhaps"},
        {"max_rounds": 0},
        {"robust": 3},
        {"parts": 1},
        {"loss": "huber"},
    ],
)
def test_options_that_cannot_be(options):
    with pytest.raises(photogram.InputError):
        photogram.snoop(small(1).block, **options)


def test_reliability():
    data = golden("statistics", "block6_blunders.json")
    block = golden_block(data["input"])
    result = photogram.adjust(block, tolerance=1e-9)
    found = result.reliability()
    suspects = found.suspects
    number = {str(suspects.name(group)): group for group in range(len(suspects))}
    for own in data["adjustment"]["observations"]:
        group = number[called(own["observation"])]
        rows = suspects.rows(group)
        good = np.array(own["redundancy"]) > 0.01
        assert found.detectable[rows][good] == pytest.approx(np.array(own["mdb"])[good], rel=1e-5)
        assert found.external[rows][good] == pytest.approx(np.array(own["external"])[good], rel=1e-5)
        assert found.group_external[group] == pytest.approx(own["group"]["external_largest"], rel=1e-4)
    labels, moved = found.influence(("point", "028"))
    assert [label[2] for label in labels] == ["X", "Y", "Z"]
    group = number["image of point 028 on photo S1P2"]
    rows = suspects.rows(group)
    assert pytest.approx(found.own_point_effect[rows], rel=1e-6) == moved[:, rows].T
    height = found.influence_of(lambda a: a[2], ("point", "028"))
    assert height[0, rows] == pytest.approx(moved[2, rows], rel=1e-6)
    pairs = found.inseparable()
    two = [pair for pair in pairs if "021" in pair.first]
    assert len(two) == 1
    assert two[0].correlation == pytest.approx(1.0)
    assert np.isinf(two[0].factor)
    partners = found.partners(number["image of point 021 on photo S2P1"])
    assert partners[0].second == "image of point 021 on photo S2P2"
    on_photos = np.array([found.influence(("photo", photo))[1] for photo in block.photo_ids])
    on_points = np.array([found.influence(("point", point))[1] for point in block.point_ids])
    cofactors = (result.photo_cofactors, result.point_cofactors)
    sd = [np.sqrt(np.diagonal(own, axis1=1, axis2=2))[..., np.newaxis] for own in cofactors]
    in_sd = [np.abs(own / sd).max(axis=(0, 1)) for own, sd in zip((on_photos, on_points), sd, strict=True)]
    for own in data["adjustment"]["observations"]:
        rows = suspects.rows(number[called(own["observation"])])
        for row, r, effect in zip(rows, own["redundancy"], own["effect_of_mdb"], strict=True):
            if r < 0.01:
                continue
            assert max(on[row] for on in in_sd) == pytest.approx(effect["largest_in_sd"], rel=1e-5)
            if "own_photo" in effect:
                photo = block.photo_ids.index(own["observation"][1])
                assert on_photos[photo, :, row] == pytest.approx(effect["own_photo"], rel=1e-5, abs=1e-7)
    assert "image" in found.table()["kind"].tolist()
    assert len(found.table()) == len(found.redundancy)


def test_commands(tmp_path):
    """Both commands write the log, and the network without what is in it."""
    runner = CliRunner()
    document = tmp_path / "giant.json"
    done = runner.invoke(
        app, ["giant", "--example", "--snoop", "--out", str(tmp_path / "giant"), "--json", str(document)]
    )
    assert done.exit_code == 0, done.output
    assert "Data snooping" in (tmp_path / "giant" / "report.txt").read_text(encoding="utf-8")
    log = json.loads(document.read_text(encoding="utf-8"))["snooping"]
    assert log["distribution"] == "chi2"
    assert log["family_level"] == 0.05
    done = runner.invoke(
        app, ["collection", "--example", "--snoop", "--fdr", "0.1", "--json", str(tmp_path / "ring.json")]
    )
    assert done.exit_code == 0, done.output
    log = json.loads((tmp_path / "ring.json").read_text(encoding="utf-8"))["snooping"]
    assert log["false_discovery_rate"] == 0.1
    assert log["distribution"] == "F"


def test_check_points_are_compared_with_what_was_given_of_them():
    simulated = photogram.simulate(
        strips=2,
        photos_per_strip=5,
        points_per_photo=30,
        blunders=3,
        blunder_size=0.3,
        check_points=8,
        seed=4,
    )
    cleaned = photogram.snoop(simulated.block)
    assert len(cleaned.table()) > 0
    given = simulated.block.point_positions
    np.testing.assert_array_equal(cleaned.result.block.point_positions, given)
    table = cleaned.result.check_table()
    assert len(table) == 8
    # What tells how good the block is has errors, in the size of its standard deviations.
    ratio = table[["d_X", "d_Y", "d_Z"]].to_numpy() / table[["sd_X", "sd_Y", "sd_Z"]].to_numpy()
    assert 0.5 < np.sqrt((ratio**2).mean()) < 2.0


@pytest.mark.parametrize("unit_weight", ["known", "unknown"])
def test_loose_weights_of_photos_cost_no_good_image(unit_weight):
    # Their standard deviations are those of the datum: rounds that end early would rest on nothing.
    block = photogram.simulate(points_per_photo=40, seed=1).block
    rays = np.bincount(block.image_points)
    rows = np.flatnonzero(rays[block.image_points] >= 4)[[20, 120]]
    xy = block.image_xy.copy()
    xy[rows, 1] += [0.2, -0.3]
    loose = block.replace(
        image_xy=xy,
        point_positions=np.full_like(block.point_positions, np.nan),
        point_sd=np.array(np.inf),
        photo_position_sd=np.array(60000.0),
        photo_attitude_sd=np.array(np.pi / 2),
    )
    found = photogram.snoop(loose, unit_weight=unit_weight)
    names = {
        f"image of point {block.point_ids[block.image_points[row]]} on photo"
        f" {block.photo_ids[block.image_photos[row]]}"
        for row in rows.tolist()
    }
    assert {entry.name for entry in found.removed} == names


def test_what_cannot_be_tested_says_so_with_any_unit_variance():
    block = photogram.simulate(points_per_photo=40, seed=1).block
    xy = np.random.default_rng(2).uniform(-100, 100, block.image_xy.shape)
    with pytest.raises(photogram.AdjustmentError, match="tests require a block that can be adjusted"):
        photogram.snoop(block.replace(image_xy=xy), unit_variance="redundancy")


@pytest.mark.parametrize("size", [-1.0, -3.0])
def test_one_ray_of_three_in_a_row_is_never_named_alone(size):
    # All three explain the same; what tells them apart is what so large an error makes of linear equations.
    block = photogram.simulate(
        strips=4, photos_per_strip=6, points_per_photo=53, side_overlap=0.3, control_sd=0.5, seed=3001
    ).block
    photos, point = ["0403", "0404", "0405"], block.point_ids.index("P000241")
    rows = np.flatnonzero(block.image_points == point)
    assert [block.photo_ids[photo] for photo in block.image_photos[rows]] == photos
    xy = block.image_xy.copy()
    xy[rows[1], 0] += size
    removed, *_ = photogram.snoop(block.replace(image_xy=xy)).removed
    named = {removed.name, *(rival.name for rival in removed.in_dispute)}
    assert named == {f"image of point P000241 on photo {photo}" for photo in photos}
