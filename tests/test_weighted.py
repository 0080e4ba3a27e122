"""Observed stations and control: drawn, weighted, and given back with residuals and test values."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from message_codes import raises
from photogram import Block, InputError, Result, Spheroid, adjust, predict, simulate
from photogram.giant import Project, read_project
from photogram.show.forms import written
from photogram.statistics import global_test

SPACES: dict[str, dict[str, Any]] = {
    "rectangular": {},
    "geographic": {"spheroid": Spheroid.wgs84(), "origin": (-1.65, 0.52, 10.0), "photo_to_ground": True},
}
SEEDS = range(20)
NETWORK: dict[str, Any] = {"strips": 2, "photos_per_strip": 4, "points_per_photo": 20, "control": "corners"}
WEIGHTS = {
    "positions": {"position_sd": 0.05},
    "attitudes": {"attitude_sd": 1e-4},
    "both": {"position_sd": 0.05, "attitude_sd": 1e-4},
}


def together(sums: list[tuple[float, int]]) -> tuple[float, float]:
    """Probabilities of a sum of squares of independent blocks as small, and as large."""
    test = global_test(sum(omega for omega, _ in sums), sum(freedom for _, freedom in sums))
    assert test is not None
    return test.probability_below, test.probability_above


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("weights", WEIGHTS)
def test_simulated_observations_agree_with_their_standard_deviations(space, weights):
    sums = []
    for seed in SEEDS:
        block = simulate(**NETWORK, **WEIGHTS[weights], **SPACES[space], seed=seed).block
        result = adjust(block)
        assert result.converged
        sums.append((result.sums_of_squares.total, result.degrees_of_freedom))
    assert min(together(sums)) > 0.001


@pytest.mark.parametrize("options", [[], ["--spheroid", "wgs84", "--origin", "-95", "29.7", "0"]])
@pytest.mark.parametrize("weights", WEIGHTS)
def test_simulated_projects_agree_with_their_standard_deviations(run, tmp_path, options, weights):
    sums = []
    named = [
        text for name, value in WEIGHTS[weights].items() for text in (f"--{name.replace('_', '-')}", value)
    ]
    network = [text for name, value in NETWORK.items() for text in (f"--{name.replace('_', '-')}", value)]
    for seed in SEEDS:
        out = tmp_path / str(seed)
        done = run("simulate", out, *network, *named, *options, "--seed", seed)
        assert done.exit_code == 0, done.output
        project = read_project(out)
        result = adjust(project.to_block(), unit_variance=project.common.unit_variance)
        assert result.converged
        sums.append((result.sums_of_squares.total, result.degrees_of_freedom))
    assert min(together(sums)) > 0.001


def test_observations_do_not_depend_on_the_start():
    weights = {"position_sd": 0.1, "attitude_sd": 1e-4}
    near, far = (
        simulate(**NETWORK, **weights, position_error=error, attitude_error=error / 3000, seed=4).block
        for error in (1.0, 30.0)
    )
    assert np.abs(near.photo_positions - far.photo_positions).max() > 10
    np.testing.assert_array_equal(near.photo_positions_observed, far.photo_positions_observed)
    np.testing.assert_array_equal(near.photo_attitudes_observed, far.photo_attitudes_observed)
    one, other = adjust(near), adjust(far)
    np.testing.assert_allclose(one.photo_positions, other.photo_positions, rtol=0, atol=1e-5)
    assert one.variance_of_unit_weight == pytest.approx(other.variance_of_unit_weight, rel=1e-9)


def test_nothing_is_observed_unless_it_is_weighted():
    simulation = simulate(**NETWORK, position_sd=0.1, seed=1)
    assert simulation.block.photo_attitudes_observed is None
    assert simulation.truth.photo_positions_observed is None
    assert simulate(**NETWORK).block.photo_positions_observed is None
    fixed = simulate(**NETWORK, position_sd=0.0, attitude_sd=0.0, seed=1)
    np.testing.assert_array_equal(fixed.block.photo_positions, fixed.truth.photo_positions)
    np.testing.assert_array_equal(fixed.block.photo_attitudes, fixed.truth.photo_attitudes)
    assert adjust(fixed.block).converged


# Block


@pytest.fixture
def weighted() -> Block:
    return simulate(**NETWORK, position_sd=0.05, attitude_sd=1e-4, seed=7).block


def test_initial_values_are_the_observed_ones_by_default(weighted):
    observed = weighted.photo_positions_observed, weighted.photo_attitudes_observed
    started = weighted.replace(photo_positions=observed[0], photo_attitudes=observed[1])
    default = started.replace(photo_positions_observed=None, photo_attitudes_observed=None)
    one, other = adjust(started), adjust(default)
    np.testing.assert_array_equal(one.photo_positions, other.photo_positions)
    np.testing.assert_array_equal(one.photo_residuals, other.photo_residuals)


@pytest.mark.parametrize("space", SPACES)
def test_whole_turns_of_observed_angles_do_not_matter(space):
    block = simulate(**NETWORK, **SPACES[space], position_sd=0.05, attitude_sd=1e-4, seed=7).block
    positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
    assert positions is not None
    assert attitudes is not None
    turned = block.replace(
        photo_attitudes_observed=attitudes + 2 * math.pi * np.array([1, -1, 2]),
        photo_positions_observed=positions + 2 * math.pi * np.array([block.geographic, 0, 0]),
    )
    one, other = adjust(block), adjust(turned)
    np.testing.assert_allclose(one.photo_attitudes, other.photo_attitudes, rtol=0, atol=1e-12)
    np.testing.assert_allclose(one.photo_residuals, other.photo_residuals, rtol=0, atol=1e-8)


def test_what_is_free_need_not_be_observed(weighted):
    observed, sd = weighted.photo_positions_observed.copy(), weighted.photo_position_sd.copy()
    sd[2], observed[2] = np.inf, np.nan
    one = adjust(weighted.replace(photo_position_sd=sd, photo_positions_observed=observed))
    other = adjust(weighted.replace(photo_position_sd=sd))
    np.testing.assert_array_equal(one.photo_positions, other.photo_positions)
    assert np.isnan(one.photo_residuals[2, :3]).all()
    masked = np.ma.masked_invalid(observed)
    again = weighted.replace(photo_position_sd=sd, photo_positions_observed=masked)
    np.testing.assert_array_equal(again.photo_positions_observed, observed)


def test_observed_values_that_cannot_be(weighted):
    observed = weighted.photo_positions_observed.copy()
    observed[1, 2] = np.nan
    with raises(InputError, "block.value.unknown"):
        weighted.replace(photo_positions_observed=observed)
    observed[1, 2] = np.inf
    with raises(InputError, "block.value.not-infinite"):
        weighted.replace(photo_positions_observed=observed)
    with pytest.raises(InputError, match=r"photo_attitudes_observed: must have the shape .*, got \(3, 3\)"):
        weighted.replace(photo_attitudes_observed=np.zeros((3, 3)))
    with raises(InputError, "block.value.fixed"):
        weighted.replace(photo_position_sd=0.0)


def test_observed_columns_of_tables(weighted):
    axes, angles = ["X", "Y", "Z"], ["omega_deg", "phi_deg", "kappa_deg"]
    photos = {"photo": weighted.photo_ids}
    for prefix, positions, attitudes in (
        ("", weighted.photo_positions, weighted.photo_attitudes),
        ("observed_", weighted.photo_positions_observed, weighted.photo_attitudes_observed),
        ("sd_", weighted.photo_position_sd, weighted.photo_attitude_sd),
    ):
        photos |= {prefix + name: column for name, column in zip(axes, positions.T, strict=True)}
        photos |= {prefix + name: np.degrees(c) for name, c in zip(angles, attitudes.T, strict=True)}
    images = {
        "photo": [weighted.photo_ids[photo] for photo in weighted.image_photos],
        "point": [weighted.point_ids[point] for point in weighted.image_points],
        "x_mm": weighted.image_xy[:, 0],
        "y_mm": weighted.image_xy[:, 1],
    }
    made = Block.from_tables(photos, images, principal_distance=-152.74)
    np.testing.assert_array_equal(made.photo_positions_observed, weighted.photo_positions_observed)
    np.testing.assert_allclose(made.photo_attitudes_observed, weighted.photo_attitudes_observed, rtol=1e-15)
    some = {name: column for name, column in photos.items() if not name.startswith("observed_")}
    assert Block.from_tables(some, images, principal_distance=-152.74).photo_positions_observed is None
    # One observed component: the others are observed at their initial values.
    height = Block.from_tables(
        {**some, "observed_Z": photos["observed_Z"]}, images, principal_distance=-152.74
    )
    np.testing.assert_array_equal(height.photo_positions_observed[:, :2], weighted.photo_positions[:, :2])
    np.testing.assert_array_equal(height.photo_positions_observed[:, 2], photos["observed_Z"])


def test_files_hold_the_observed_values(weighted):
    project = Project.from_block(weighted)
    assert any("observed values are written" in str(message) for message in project.messages)
    positions = [frame.position for frame in project.frames]
    np.testing.assert_array_equal(positions, weighted.photo_positions_observed)
    free = weighted.replace(photo_position_sd=np.inf, photo_attitude_sd=np.inf)
    project = Project.from_block(free)
    np.testing.assert_array_equal([frame.position for frame in project.frames], weighted.photo_positions)
    assert not project.messages


def test_a_prediction_is_made_at_the_given_positions():
    truth = simulate(**NETWORK, position_sd=0.05, seed=3).truth
    moved = truth.replace(photo_positions_observed=truth.photo_positions + 5.0)
    np.testing.assert_array_equal(predict(moved).photo_cofactors, predict(truth).photo_cofactors)


def test_photos_that_stay_do_not_mind_observations(weighted):
    result = adjust(weighted.with_fixed_photos())
    np.testing.assert_array_equal(result.photo_positions, weighted.photo_positions)


# Residuals and test values


@pytest.fixture(scope="module", params=SPACES)
def result(request: pytest.FixtureRequest) -> Result:
    """Adjust a block of each space with weighted, fixed and free components of stations and control."""
    block = simulate(
        **{**NETWORK, "control": "perimeter"},
        **SPACES[request.param],
        control_spacing=2,
        position_sd=0.05,
        attitude_sd=1e-4,
        seed=12,
    ).block
    position_sd, attitude_sd, point_sd = (
        block.photo_position_sd.copy(), block.photo_attitude_sd.copy(), block.point_sd.copy()
    )  # fmt: skip
    position_sd[0], attitude_sd[1] = 0.0, np.inf
    control = np.flatnonzero(np.isfinite(point_sd).all(axis=1))
    point_sd[control[0]] = 0.0
    positions = block.photo_positions.copy()
    positions[0] = block.photo_positions_observed[0]
    return adjust(
        block.replace(
            photo_positions=positions,
            photo_position_sd=position_sd,
            photo_attitude_sd=attitude_sd,
            point_sd=point_sd,
        )
    )


def test_every_observation_has_a_redundancy_number(result):
    block = result.block
    parts = [
        result.redundancy.sum(), result.photo_redundancy.sum(), np.nansum(result.point_redundancy)
    ]  # fmt: skip
    assert sum(parts) == pytest.approx(result.degrees_of_freedom, abs=1e-6)
    weighted = np.isfinite(result.photo_given_sd) & (result.photo_given_sd > 0)
    held = np.isfinite(block.point_sd) & (block.point_sd > 0)
    assert (result.photo_redundancy[~weighted] == 0).all()
    assert np.isfinite(result.photo_standardized[weighted]).all()
    assert np.isfinite(result.point_standardized[held]).all()
    assert np.isnan(result.photo_standardized[~weighted]).all()
    assert np.isnan(result.point_standardized[~held]).all()


def test_residuals_of_stations_and_control(result):
    block = result.block
    observed = np.hstack([block.photo_positions_observed, block.photo_attitudes_observed])
    adjusted = np.hstack([result.photo_positions, result.photo_attitudes])
    free = np.isinf(result.photo_given_sd)
    np.testing.assert_allclose(
        result.photo_residuals[~free], (observed - adjusted)[~free], rtol=0, atol=1e-12
    )
    assert np.isnan(result.photo_residuals[free]).all()
    assert (result.photo_residuals[0, :3] == 0).all()  # fixed
    weighted = ~free & (result.photo_given_sd > 0)
    squares = np.sum((result.photo_residuals[weighted] / result.photo_given_sd[weighted]) ** 2)
    assert squares == pytest.approx(result.sums_of_squares.camera, rel=1e-9)
    held = np.isfinite(block.point_sd) & (block.point_sd > 0)
    ground = np.sum((result.point_residuals[held] / block.point_sd[held]) ** 2)
    assert ground == pytest.approx(result.sums_of_squares.ground, rel=1e-6)
    fixed = block.point_sd == 0
    assert (result.point_residuals[fixed] == 0).all()
    assert np.isnan(result.point_residuals[np.isinf(block.point_sd)]).all()


def test_standardized_residuals_of_stations_and_control_are_standard_normal():
    squares = {"photo": [], "point": []}
    for seed in range(40):
        adjusted = adjust(simulate(**NETWORK, position_sd=0.05, attitude_sd=1e-4, seed=seed).block)
        for kind, values in squares.items():
            standardized = getattr(adjusted, f"{kind}_standardized")
            values.append(np.nanmean(standardized**2))
    for kind, values in squares.items():
        error = np.std(values) / math.sqrt(len(values))
        assert abs(np.mean(values) - 1) < 4 * error, kind
        assert error < 0.1


def test_tables_of_stations_and_control(result):
    stations, control = result.station_table(), result.control_table()
    assert stations["photo"].tolist() == result.block.photo_ids
    degrees = 180 / math.pi
    np.testing.assert_allclose(stations["d_kappa_deg"], -result.photo_residuals[:, 5] * degrees, rtol=1e-12)
    np.testing.assert_array_equal(stations["redundancy_kappa"], result.photo_redundancy[:, 5])
    np.testing.assert_array_equal(stations["standardized_kappa"], -result.photo_standardized[:, 5])
    axis = "height" if result.block.geographic else "Z"
    held = np.isfinite(result.block.point_sd).any(axis=1)
    assert control["point"].tolist() == np.array(result.block.point_ids)[held].tolist()
    np.testing.assert_array_equal(control[f"d_{axis}"], -result.point_residuals[held, 2])
    np.testing.assert_array_equal(control[f"sd_{axis}"], result.block.point_sd[held, 2])
    np.testing.assert_array_equal(control[f"standardized_{axis}"], -result.point_standardized[held, 2])


def test_document_of_stations_and_control(result):
    document = json.loads(result.to_json())
    stations, control = document["stations"], document["control"]
    assert [station["id"] for station in stations] == result.block.photo_ids
    for member, values in {
        "attitude_difference_rad": -result.photo_residuals[:, 3:],
        "redundancy": result.photo_redundancy,
        "standardized": -result.photo_standardized,
    }.items():
        found = np.array([station[member] for station in stations], dtype=float)
        np.testing.assert_array_equal(found, values)
    assert stations[0]["position_sd"] == [0.0, 0.0, 0.0]
    assert stations[1]["attitude_sd_rad"] == [None, None, None]
    scale = [180 / math.pi, 180 / math.pi, 1.0] if result.block.geographic else [1.0] * 3
    held = np.isfinite(result.block.point_sd).any(axis=1)
    found = np.array([point["position_difference"] for point in control], dtype=float)
    np.testing.assert_allclose(found, -result.point_residuals[held] * scale, rtol=1e-12)


def test_sections_of_stations_and_control(result):
    document = result.document()
    positions = {
        column.head: column.cells for column in written(document.table("stations-positions")).columns
    }
    rows = zip(positions["Photo"], positions["sd given"], strict=True)
    assert [sd for photo, sd in rows if photo == result.block.photo_ids[0]] == ["fixed"] * 3
    attitudes = document.table("stations-attitudes")
    tests = next(column for column in attitudes.columns if column.name == "standardized")
    np.testing.assert_array_equal(tests.values, -result.photo_standardized[:, 3:])
    assert result.block.photo_ids[1] not in written(attitudes).columns[0].cells
