"""Data snooping against golden logs, published problems and planted blunders."""

import json
from pathlib import Path

import numpy as np
import pytest

import photogram
from photogram import Block
from photogram.adjustment import network_trial
from photogram.adjustment.snooping import block_trial
from photogram.statistics import lambda0
from photogram.statistics.snooping.linear import LinearTrial
from photogram.statistics.snooping.snooping import Settings, snooped
from shared_data import SHARED

DATA = Path(__file__).parent / "data" / "statistics"


def golden():
    file = SHARED / "statistics" / "block6_blunders.json"
    if not file.is_file():
        pytest.skip("the golden block is not there (../shared/data/statistics)")
    return json.loads(file.read_text(encoding="utf-8"))


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
    data = golden()
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
    data = golden()
    block = golden_block(data["input"])
    result = photogram.adjust(block, tolerance=1e-9)
    trial = block_trial(result)
    trial.core.stand([])
    tests = trial.core.tests()
    suspects = trial.suspects
    number = {suspects.name(group): group for group in range(len(suspects))}
    blocks = np.concatenate([[0], np.cumsum(np.diff(suspects.row_starts) ** 2)])
    effects = trial.core.effects(list(range(len(suspects))))
    moved = trial.core.most_moved(list(range(len(suspects))))
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
            assert size * effects[row, :3] == pytest.approx(effect["own_point"], rel=1e-5, abs=1e-7)
            if "own_photo" in effect:
                assert size * effects[row, 3:] == pytest.approx(effect["own_photo"], rel=1e-5, abs=1e-7)
            assert size * moved[row][4] == pytest.approx(effect["largest_in_sd"], rel=1e-5)
            assert abs(size * moved[row][3]) == pytest.approx(abs(effect["effect"]), rel=1e-5)


def lambda0_of(dimension):
    return lambda0(0.001, 0.80, dimension)


def test_correlations_on_a_point():
    data = golden()
    block = golden_block(data["input"])
    trial = block_trial(photogram.adjust(block, tolerance=1e-9))
    trial.core.stand([])
    for given in data["adjustment"]["test_correlations_on_a_point"]:
        point = block.point_ids.index(given["point"])
        groups, _, r = trial.core.on_points([point])[0]
        names = [trial.suspects.name(group) for group in groups]
        order = [
            2 * names.index(called(["image", photo, given["point"]])) + "xy".index(axis)
            for photo, axis in given["rows"]
        ]
        r = r[np.ix_(order, order)]
        scale = np.sqrt(np.diagonal(r))
        assert r / np.outer(scale, scale) == pytest.approx(np.array(given["correlation"]), abs=1e-6)


def test_by_the_bound_as_exactly(monkeypatch):
    """The way for large networks finds the same in the golden block."""
    data = golden()
    block = golden_block(data["input"])
    exact = photogram.snoop(block, parts=False)
    monkeypatch.setattr(network_trial, "WHOLE", 0)
    bounded = photogram.snoop(block, parts=False)
    assert {entry.name for entry in bounded.removed} == {entry.name for entry in exact.removed}
    assert bounded.result.photo_positions == pytest.approx(exact.result.photo_positions, abs=1e-6)


def test_a_height_goes_alone():
    data = golden()
    found = photogram.snoop(golden_block(data["input"]))
    assert "Z of control point 033" in [entry.name for entry in found.removed]
    assert np.isinf(found.result.block.point_sd[found.result.block.point_ids.index("033")]).tolist() == [
        False,
        False,
        True,
    ]


def test_swamping():
    """A good observation between two bad ones goes first, and returns."""
    given = json.loads((DATA / "small_problems.json").read_text(encoding="utf-8"))["swamping"]
    partials = np.zeros((len(given["edges"]), 7))
    for row, (start, end) in enumerate(given["edges"]):
        partials[row, start], partials[row, end] = -1, 1
    trial = LinearTrial(partials[:, 1:], given["dh"], given["sd"])
    found = snooped(trial, Settings(level=0.05))
    assert [entry.group for entry in found.log] == [
        step["largest"] for step in given["forward"] if step["removed"]
    ]
    for entry, step in zip(found.log, given["forward"], strict=False):
        assert np.exp(entry.log_probability) == pytest.approx(step["p"], rel=1e-8)
    returned = [entry for entry in found.log if entry.returned is not None]
    assert [entry.group for entry in returned] == [own["observation"] for own in given["returned"]]
    assert np.exp(returned[0].prediction_log_probability) == pytest.approx(
        given["returned"][0]["p"], rel=1e-8
    )
    assert [entry.group for entry in found.log if entry.is_out] == given["finally_removed"]
    assert found.standing.weighted_sum_of_squares == pytest.approx(given["final"]["omega"], rel=1e-8)
    assert trial.unknowns == pytest.approx(given["final"]["heights"], rel=1e-8)


def test_three_outliers_that_mask_each_other():
    """Rosner (1983): the first two steps are not significant, the third is."""
    given = json.loads((DATA / "published_problems.json").read_text(encoding="utf-8"))["rosner"]
    values = np.array(given["values"])
    found = snooped(LinearTrial(np.ones((len(values), 1)), values, 1.0), Settings(known=False))
    assert len(found.log) == given["published_outliers"]
    for entry, step in zip(found.log, given["steps"], strict=False):
        assert values[entry.group] == step["removed"]
        assert np.sqrt(entry.fisher) == pytest.approx(step["t_external"], rel=1e-8)
