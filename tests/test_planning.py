"""Planning: predicted covariances against closed forms and Monte Carlo, and what a plan says of them."""

from __future__ import annotations

import inspect
import json
import math
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from message_codes import raises
from noise import measured
from photogram import (
    AdjustmentError,
    Block,
    InputError,
    PhotogramError,
    Plan,
    RankError,
    Refraction,
    Result,
    Spheroid,
    adjust,
    plan,
    predict,
    simulate,
)
from photogram.adjustment.prediction import at_adjusted
from photogram.cli.plan import plan as plan_command
from photogram.cli.plan import simulate as simulate_command
from photogram.planning import Pattern
from photogram.planning.networks import advice
from photogram.planning.pattern import locations
from photogram.statistics import largest_effect, minimal_detectable_error, noncentrality

DOCUMENT = Path(__file__).parents[1] / "docs" / "planning.md"
RECTANGULAR: dict[str, Any] = {"origin": (5e5, 4e6, 100.0)}
GEOGRAPHIC: dict[str, Any] = {"spheroid": Spheroid.wgs84(), "origin": (math.radians(7.75), 0.848, 140.0)}
SPACES = pytest.mark.parametrize("space", [RECTANGULAR, GEOGRAPHIC], ids=["rectangular", "geographic"])
# A right program fails a test of k comparisons with another seed with the probability k times this.
CHANCE = 1e-6


def network(**arguments: Any) -> Block:
    """Simulate a network: two strips of four photos unless told otherwise, no check points."""
    defaults: dict[str, Any] = {"strips": 2, "photos_per_strip": 4, "points_per_photo": 30, "check_points": 0}
    return simulate(**{**defaults, **arguments}).truth


# Prediction


@SPACES
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_a_prediction_is_one_linearization_at_the_given_positions(space, photo_to_ground):
    block = network(photo_to_ground=photo_to_ground, **space)
    result = predict(block)
    assert result.converged
    assert (result.formations, len(result.iterations)) == (1, 1)
    assert (result.unit_variance, result.covariance_scale) == ("unity", 1.0)
    assert np.nanmax(np.abs(result.point_differences) / result.point_sd) < 1e-6
    moved = np.hstack(
        [
            result.photo_positions - block.photo_positions,
            result.photo_attitudes - block.photo_attitudes,
        ]
    )
    assert np.abs(moved / result.photo_sd).max() < 1e-6
    assert "computed, not observed" in str(result.messages[0])


@SPACES
def test_a_prediction_bends_the_rays_of_a_block_with_refraction(space):
    block = network(refraction=Refraction("standard"), **space)
    result = predict(block)
    # Points start where straight rays meet, some tenths of a metre off, and come back.
    assert np.nanmax(np.abs(result.point_differences) / result.point_sd) < 1e-4
    straight = predict(block.replace(refraction=None))
    np.testing.assert_allclose(result.photo_sd, straight.photo_sd, rtol=1e-2)
    assert (result.photo_sd != straight.photo_sd).all()


@SPACES
def test_measurements_do_not_matter(space):
    simulation = simulate(strips=2, photos_per_strip=4, seed=1, **space)
    expected = predict(simulation.truth)
    measured = predict(simulation.truth.replace(image_xy=simulation.block.image_xy))
    for name in ("photo_cofactors", "point_cofactors", "redundancy", "point_redundancy"):
        np.testing.assert_array_equal(getattr(measured, name), getattr(expected, name))


def test_an_adjustment_of_measurements_has_nearly_the_predicted_covariances():
    simulation = simulate(strips=2, photos_per_strip=4, check_points=0, seed=1)
    adjusted = adjust(simulation.block, unit_variance="unity")
    at_truth, at_solution = predict(simulation.truth), predict(at_adjusted(adjusted))
    np.testing.assert_allclose(at_solution.point_sd, adjusted.point_sd, rtol=1e-6)
    np.testing.assert_allclose(at_truth.point_sd, adjusted.point_sd, rtol=0.01)
    np.testing.assert_allclose(at_truth.redundancy, adjusted.redundancy, atol=0.01)


def test_the_normal_case_has_its_textbook_standard_deviations():
    # Two fixed vertical photos over flat ground: sd of Z = (H / B) (H / c) sqrt(2) sd of x.
    block = network(
        strips=1, photos_per_strip=2, control="none", tilt=0.0, crab=0.0, relief=0.0, flying_height=1500.0
    ).replace(photo_position_sd=np.array(0.0), photo_attitude_sd=np.array(0.0))
    result = predict(block)
    base = np.linalg.norm(block.photo_positions[1] - block.photo_positions[0])
    scale = 1500.0 / 152.74
    np.testing.assert_allclose(result.point_sd[:, 2], 1500.0 / base * scale * math.sqrt(2) * 0.010, rtol=1e-9)
    # x-parallax is not checked, y-parallax is one condition on two coordinates.
    np.testing.assert_allclose(result.redundancy, np.tile([0.0, 0.5], (len(result.redundancy), 1)), atol=1e-9)
    pattern = Pattern("normal case", result)
    assert pattern.scale == pytest.approx(scale, rel=1e-12)
    assert pattern.unit == pytest.approx(scale * 0.010, rel=1e-12)


def test_standard_deviations_scale_with_those_of_the_observations():
    one, two = (predict(network(image_sd=0.005 * k, control_sd=0.02 * k)) for k in (1, 2))
    np.testing.assert_allclose(two.point_sd, 2 * one.point_sd, rtol=1e-9)
    np.testing.assert_allclose(two.redundancy, one.redundancy, atol=1e-9)


RUNS = 1000


@pytest.mark.giant("1", "accuracy is predicted before any photograph is taken")
@pytest.mark.parametrize(
    "kind", [RECTANGULAR, {**GEOGRAPHIC, "position_sd": 0.2, "control": "none"}], ids=["control", "GNSS"]
)
def test_section_1_errors_of_adjustments_scatter_as_predicted(kind):
    truth = network(photos_per_strip=3, points_per_photo=12, control_sd=0.1, **{"control": "corners", **kind})
    predicted = predict(truth)
    random = np.random.default_rng(2024)
    results = [adjust(measured(truth, random), covariance=False, threads=1) for _ in range(RUNS)]
    for name, sd in (
        ("point_positions", predicted.point_sd),
        ("photo_positions", predicted.photo_sd[:, :3]),
        ("photo_attitudes", predicted.photo_sd[:, 3:]),
    ):
        errors = np.array([getattr(result, name) for result in results]) - getattr(truth, name)
        squares = ((errors / sd) ** 2).sum(axis=0)
        low, high = stats.chi2(RUNS).ppf([CHANCE, 1 - CHANCE])
        assert (low < squares).all(), name
        assert (squares < high).all(), name


# What a prediction refuses


def test_points_without_positions_are_named():
    block = network()
    positions = block.point_positions.copy()
    positions[[3, 5], 2] = np.nan
    with pytest.raises(InputError, match=f"{block.point_ids[3]}, {block.point_ids[5]}$"):
        predict(block.replace(point_positions=positions))


@SPACES
@pytest.mark.parametrize("kind", ["pass", "control"])
def test_points_behind_a_photo_are_named(space, kind):
    block = network(**space)
    held = np.isfinite(block.point_sd).all(axis=1)
    point = int(np.flatnonzero(held == (kind == "control"))[0])
    positions = block.point_positions.copy()
    positions[point, 2] = 9000.0
    photos = np.unique(block.image_photos[block.image_points == point])
    with raises(InputError, "predict.behind") as caught:
        predict(block.replace(point_positions=positions))
    fields = caught.value.phrase.fields
    assert fields == {"points": [block.point_ids[point]], "photos": [block.photo_ids[p] for p in photos]}


def test_a_network_without_datum_is_named():
    with pytest.raises(RankError) as caught:
        plan({"corners": network(control="corners"), "no datum": network(control="none")})
    assert caught.value.phrase.fields["message"].code == "plan.datum"
    assert caught.value.phrase.fields["what"] == "no datum"
    assert len(caught.value.photos) == 8


def test_a_diverged_adjustment_is_no_plan():
    block = simulate(strips=2, photos_per_strip=4).block
    result = adjust(block, max_iterations=1)
    assert not result.converged
    with raises(AdjustmentError, "predict.not-converged"):
        at_adjusted(result)


def test_blocks_that_cannot_stand_side_by_side():
    with pytest.raises(InputError) as error:
        plan({})
    assert error.value.code == "plan.spaces"
    for other in (network(**GEOGRAPHIC), network().replace(linear_unit="ft")):
        with pytest.raises(InputError, match="linear unit"):
            plan({"one": network(), "other": other})


# Reliability


def test_noncentrality():
    assert noncentrality() == pytest.approx(4.13, abs=0.005)  # Baarda's choice
    assert noncentrality(0.05, 0.80) == pytest.approx(2.80, abs=0.005)
    for wrong in ((0.0, 0.8), (1.0, 0.8), (0.01, 0.005), (0.01, 1.0)):
        with raises(InputError, "error.power"):
            noncentrality(*wrong)


def test_what_is_not_checked_and_what_is_no_observation():
    errors = minimal_detectable_error([0.01, 0.01, 0.01, np.inf, 0.0], [1.0, 0.25, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(errors, [0.0413215, 0.082643, np.inf, np.nan, np.nan], rtol=1e-5)
    np.testing.assert_allclose(largest_effect([1.0, 0.5, 0.0], delta0=4.0), [0.0, 4.0, np.inf])


@SPACES
def test_a_minimal_detectable_error_moves_its_test_value_by_the_noncentrality(space):
    block = network(**space)
    predicted = predict(block)
    errors = minimal_detectable_error(block.image_sd, predicted.redundancy)
    effects = largest_effect(predicted.redundancy)
    for image, axis in np.argwhere(predicted.redundancy > 0.1)[::60]:
        xy = predicted.block.image_xy.copy()
        xy[image, axis] += errors[image, axis]
        result = adjust(predicted.block.replace(image_xy=xy))
        assert result.standardized[image, axis] == pytest.approx(noncentrality(), rel=1e-3)
        assert np.abs(result.standardized).max() <= noncentrality() * 1.001
        assert 0.1 < largest_change(result, predicted) / effects[image, axis] < 1.001


def test_the_same_of_control():
    block = network(control_sd=0.5)
    predicted = predict(block)
    weighted = np.isfinite(block.point_sd)
    errors = minimal_detectable_error(block.point_sd, predicted.point_redundancy)
    effects = largest_effect(predicted.point_redundancy)
    for point, axis in np.argwhere(weighted & (predicted.point_redundancy > 0.01)):
        positions = block.point_positions.copy()
        positions[point, axis] += errors[point, axis]
        result = adjust(predicted.block.replace(point_positions=positions))
        test = -result.point_differences[point, axis] / 0.5
        test /= math.sqrt(predicted.point_redundancy[point, axis])
        assert test == pytest.approx(noncentrality(), rel=0.02)
        assert 0.1 < largest_change(result, predicted) / effects[point, axis] < 1.02


def largest_change(result: Result, before: Result) -> float:
    """Return by how many standard deviations the unknown that has changed most has done so."""
    points = (result.point_positions - before.point_positions) / before.point_sd
    photos = np.hstack(
        [
            result.photo_positions - before.photo_positions,
            result.photo_attitudes - before.photo_attitudes,
        ]
    )
    return float(max(np.abs(points).max(), np.abs(photos / before.photo_sd).max()))


# Plans


@pytest.fixture(scope="module")
def two_patterns() -> Plan:
    """Perimeter against corners, the block of the documentation."""
    return plan(
        {
            "perimeter": simulate(check_points=0).truth,
            "corners": simulate(control="corners", check_points=0).truth,
        }
    )


def group(made: Plan, pattern: int, name: str):
    return next(quality for quality in made.patterns[pattern].points if quality.group == name)


def test_what_textbooks_say_of_blocks(two_patterns):
    perimeter, corners = 0, 1
    for pattern in (perimeter, corners):
        rays = [group(two_patterns, pattern, f"{count} rays") for count in (2, 3, 4, 6)]
        heights = [quality.rms_sd[2] for quality in rays]
        assert heights[0] > max(heights[1:])
        redundancy = [quality.redundancy for quality in rays]
        assert redundancy == sorted(redundancy)
        # Of a point on two photos the coordinates along the base are not checked.
        assert rays[0].unchecked == pytest.approx(0.5, abs=0.01)
        assert [quality.unchecked for quality in rays[1:]] == [0.0, 0.0, 0.0]
        # Fewer rays, from one side, towards the border.
        places = [group(two_patterns, pattern, place).rms_sd for place in ("corner", "edge", "interior")]
        assert (np.diff(places, axis=0)[:, :2] < 0).all()
    # Chains of height control keep the middle of the block up.
    for name in ("interior", "edge", "6 rays", "all"):
        assert (
            group(two_patterns, perimeter, name).rms_sd[2]
            < 0.8 * group(two_patterns, corners, name).rms_sd[2]
        )
    heights = [pattern.control[2] for pattern in two_patterns.patterns]
    assert [quality.held for quality in heights] == [11, 4]
    assert heights[0].detectable < 0.5 * heights[1].detectable


def test_denser_control_and_observed_positions_help():
    sparse, dense, weighted = (
        Pattern("", predict(network(photos_per_strip=9, **arguments)))
        for arguments in (
            {"control_spacing": 8},
            {"control_spacing": 2},
            {"control": "none", "position_sd": 0.05},
        )
    )
    assert dense.points[-1].rms_sd[2] < 0.8 * sparse.points[-1].rms_sd[2]
    assert weighted.points[-1].rms_sd[2] < sparse.points[-1].rms_sd[2]
    # The geometry of the photos is the same; only the weights differ.
    np.testing.assert_allclose(weighted.point_plan, sparse.point_plan, atol=1e-6)
    assert [quality.held for quality in weighted.control] == [0, 0, 0]
    assert 0 < weighted.photos[0].redundancy < 1
    assert math.isnan(sparse.photos[0].redundancy)


def test_geographic_space_is_rectangular_space_but_for_the_curvature():
    flat, curved = (
        Pattern("", predict(network(strips=3, photos_per_strip=5, seed=2, **space)))
        for space in (RECTANGULAR, GEOGRAPHIC)
    )
    np.testing.assert_allclose(curved.points[-1].rms_sd, flat.points[-1].rms_sd, rtol=0.01)
    for one, other in zip(flat.photos, curved.photos, strict=True):
        assert other.rms_sd == pytest.approx(one.rms_sd, rel=0.01)
    for one, other in zip(flat.control, curved.control, strict=True):
        assert (other.held, other.sd) == (one.held, pytest.approx(0.05, rel=1e-9))
        assert other.detectable == pytest.approx(one.detectable, rel=0.02)
    assert curved.unit == pytest.approx(flat.unit, rel=1e-3)
    plans = (own.photo_plan - own.photo_plan.mean(axis=0) for own in (flat, curved))
    np.testing.assert_allclose(*plans, rtol=1e-3, atol=1.0)


def test_a_plan_does_not_mind_the_antimeridian():
    here, there = (
        Pattern("", predict(network(**{**GEOGRAPHIC, "origin": (longitude, 0.848, 140.0)})))
        for longitude in (0.1, math.pi)
    )
    np.testing.assert_allclose(there.point_plan, here.point_plan, atol=1e-3)
    assert there.point_locations.tolist() == here.point_locations.tolist()


def test_every_new_point_is_in_one_group_of_each_kind(two_patterns):
    for pattern in two_patterns.patterns:
        for grouping in ("rays", "location", "all"):
            groups = [quality for quality in pattern.points if quality.grouping == grouping]
            assert sum(quality.points for quality in groups) == pattern.new_points.sum()
            squares = [quality.points * np.square(quality.rms_sd) for quality in groups if quality.points]
            expected = np.square(pattern.point_sd[pattern.new_points]).sum(axis=0)
            np.testing.assert_allclose(np.sum(squares, axis=0), expected, rtol=1e-12)


def test_places_in_a_block_that_lies_askew():
    stations = np.stack(np.meshgrid(np.arange(6.0), np.arange(0.0, 4.0, 1.5), indexing="ij"), axis=-1)
    points = np.array([[2.0, 1.0], [-0.1, 1.0], [5.1, 2.9], [2.0, 3.1], [-0.1, -0.1], [6.0, 4.0]])
    expected = ["interior", "edge", "edge", "edge", "corner", "corner"]
    c, s = math.cos(0.4), math.sin(0.4)
    turn = np.array([[c, s], [-s, c]])
    shift = [5e5, 4e6]
    assert locations(points @ turn + shift, stations.reshape(-1, 2) @ turn + shift).tolist() == expected


def test_places_at_one_strip_and_one_station():
    strip = np.stack([np.arange(4.0), np.zeros(4)], axis=1)
    assert locations(np.array([[1.0, 0.3], [-1.0, 0.3]]), strip).tolist() == ["edge", "corner"]
    assert locations(np.array([[1.0, 0.3]]), strip[:1]).tolist() == ["corner"]


def test_the_table_has_a_row_for_each_pattern_and_group(two_patterns):
    table = two_patterns.table()
    assert table["group"].tolist() == 2 * [*(f"{n} rays" for n in range(2, 7)), *LOCATIONS, "all"]
    row = table[(table["pattern"] == "corners") & (table["group"] == "interior")].iloc[0]
    expected = group(two_patterns, 1, "interior")
    assert (row["rms_sd_Z"], row["max_sd_X"]) == (expected.rms_sd[2], expected.max_sd[0])
    assert row["detectable"] == expected.detectable


LOCATIONS = ["corner", "edge", "interior"]


def parts_of(made, key):
    """Return the visible parts of a section of the document, with the layers of the first."""
    (section,) = (section for section in made.document().sections if section.key == key)
    layers = [layer for part in section.parts for layer in getattr(part, "parts", [part])]
    return [layer for layer in layers if layer.visible]


def test_the_document_of_three_networks_and_of_one():
    overlaps = {f"{p:.0%} forward": network(forward_overlap=p) for p in (0.6, 0.8)}
    made = plan({**overlaps, "no control": network(control="none", position_sd=0.1)})
    assert [table.title for table in parts_of(made, "points")] == ["60% forward", "80% forward", "no control"]
    assert any("7 to 9 rays" in table.columns[1].values for table in parts_of(made, "points"))
    (comparison,) = parts_of(made, "comparison")
    names, *deviations, best, ratio = (np.asarray(column.values).tolist() for column in comparison.columns)
    row = names.index("rms Z")
    assert best[row] == "no control"
    heights = [own[row] for own in deviations]
    assert ratio[row] == pytest.approx(max(heights) / min(heights))
    assert [table.title for table in parts_of(made, "control")] == ["60% forward", "80% forward"]
    assert max(len(line) for line in made.report().splitlines()) < 140

    alone = plan({"alone": network(control="none", position_sd=0.1)})
    assert not parts_of(alone, "control")
    assert len(parts_of(alone, "comparison")[0].columns) == 4


def test_a_plan_names_errors_that_would_remain_undetected():
    patterns = {
        "positions": network(control="none", position_sd=0.05),
        "both": network(position_sd=0.5, control_spacing=1),
    }
    made = plan(patterns)
    positions, both = made.patterns
    codes = {pattern.name: set() for pattern in made.patterns}
    for sentence in advice(made.patterns):
        codes[sentence.fields["pattern"]].add(sentence.code)
    # A time offset moves all stations along the strips like a shift of the network.
    assert {"plan.undetected.strips", "plan.assumed"} <= codes["positions"]
    # A shift or rotation of all control within the accuracy of the positions would move other points.
    assert codes["both"] == {"plan.unchecked", "plan.control", "plan.undetected.points"}
    (time,) = np.flatnonzero(positions.hypotheses.code == "time-offset")
    assert np.isnan(positions.hypotheses.mdb[time]).all()
    tables = parts_of(made, "undetected")
    assert [len(table.columns[0].values) for table in tables] == [10, 10]
    rows = json.loads(made.to_json())["patterns"][1]["undetected"]
    assert {"code", "hypothesis", "mdb", "points", "ratio"} <= set(rows[0])

    # An adjustment of measurements finds the predicted biases and effects.
    result = adjust(measured(patterns["both"], np.random.default_rng(1)), unit_variance="unity")
    found = result._hypotheses()
    np.testing.assert_array_equal(found.code, both.hypotheses.code)
    np.testing.assert_allclose(found.redundancy, both.hypotheses.redundancy, rtol=0.02, atol=1e-9)
    for row, effect in both.hypotheses.effects.items():
        assert found.effects[row].ratio == pytest.approx(effect.ratio, rel=0.05, abs=0.05)


def test_equal_networks_do_not_differ():
    (comparison,) = parts_of(plan({"one": network(), "same": network()}), "comparison")
    assert comparison.columns[-2].values == 6 * ["no difference"]


# Command line


def test_plan_takes_the_options_of_simulate(run):
    ours, theirs = (inspect.signature(command).parameters for command in (plan_command, simulate_command))
    shared = set(ours) & set(theirs) - {"out"}
    assert {"strips", "control", "seed", "spheroid"} < shared
    assert all(ours[name].default == theirs[name].default for name in shared)
    assert set(theirs) - shared == {
        "out", "overwrite", "check_points", "blunders", "blunder_size",
    }  # fmt: skip
    assert "--against-position-sd" in run("plan", "--help").output


def documented() -> list[tuple[str, str]]:
    """Return the commands in the document that are said to print something, and what."""
    return re.findall(r"<!-- printed: (.*?) -->\n```text\n(.*?)```\n", DOCUMENT.read_text(), re.DOTALL)


@pytest.mark.parametrize(("command", "printed"), documented(), ids=[command for command, _ in documented()])
def test_the_document_shows_what_is_printed(run, command, printed):
    result = run(*shlex.split(command)[1:])
    assert result.exit_code == 0, result.output
    # The first line has the version of the program.
    assert result.stdout.split("\n")[1:] == printed.split("\n")[1:]


def test_the_python_of_the_document_runs():
    pytest.importorskip("matplotlib")
    parts = DOCUMENT.read_text().split("```python\n")[1:]
    assert parts
    for part in parts:
        exec(compile(part.split("```")[0], str(DOCUMENT), "exec"), {})


SMALL = ("--strips", "2", "--photos-per-strip", "3", "--points-per-photo", "15")


def test_plan_writes_a_document_and_a_picture(run, tmp_path):
    pytest.importorskip("matplotlib")
    result = run("plan", *SMALL, "--spheroid", "wgs84", "--json", "plan.json", "--out", "o", "--plots")
    assert result.exit_code == 0, result.output
    assert "rms h" in result.output
    document = json.loads((tmp_path / "plan.json").read_text())
    assert [pattern["name"] for pattern in document["patterns"]] == ["perimeter, 4 bases", "corners"]
    pattern = document["patterns"][1]
    assert pattern["axes"] == ["E", "N", "h"]
    everything = pattern["points"][-1]
    assert everything["group"] == "all"
    assert f"{everything['rms_sd'][2]:.3g}" in result.output
    assert document["noncentrality"] == noncentrality()
    assert (tmp_path / "o" / "plan.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "o" / "report.txt").read_text() in result.output


def test_the_picture_has_a_panel_for_each_pattern(two_patterns):
    figure = pytest.importorskip("matplotlib.figure").Figure()
    two_patterns.plot().on(figure)
    panels, bar = figure.axes[:2], figure.axes[2]
    assert [axes.get_title(loc="left").split("\n")[0] for axes in panels] == ["perimeter", "corners"]
    limits = {axes.collections[0].get_clim() for axes in panels}
    assert len(limits) == 1
    heights = [pattern.point_sd[pattern.new_points, 2] for pattern in two_patterns.patterns]
    assert limits == {(min(map(np.min, heights)), max(map(np.max, heights)))}
    for axes, pattern in zip(panels, two_patterns.patterns, strict=True):
        assert len(axes.collections[0].get_offsets()) == pattern.new_points.sum()
    assert bar.get_ylabel() == "expected standard deviation in height, m"
    assert [text.get_text() for text in panels[1].get_legend().texts] == [
        "photo",
        "full control",
        "height control",
    ]


def test_a_picture_of_control_only_is_refused():
    block = network()
    made = plan({"all held": block.replace(point_sd=np.array(0.1))})
    assert made.patterns[0].points[-1].points == 0
    with pytest.raises(PhotogramError) as error:
        made.plot()
    assert error.value.code == "plan.new-points"
    assert "New points: " not in made.report()
    assert "Comparison: " not in plan({"all held": made.patterns[0].block, "corners": block}).report()


def test_control_that_nothing_checks():
    # Three full control points on a photo: 15 observations, 15 unknowns.
    photo = Block(
        photo_ids=["1"],
        photo_positions=np.array([[0.0, 0.0, 1000.0]]),
        photo_attitudes=np.zeros((1, 3)),
        principal_distances=np.array([-150.0]),
        point_ids=["A", "B", "C"],
        point_positions=np.array([[100.0, 100.0, 0.0], [-300.0, 200.0, 0.0], [10.0, -300.0, 5.0]]),
        image_photos=np.zeros(3, dtype=np.int64),
        image_points=np.arange(3),
        image_xy=np.zeros((3, 2)),
        image_sd=np.array(0.01),
        point_sd=np.array(0.1),
    )
    made = plan({"one photo": photo})
    assert [(quality.held, quality.detectable) for quality in made.patterns[0].control] == 3 * [(3, math.inf)]
    (table,) = parts_of(made, "control")
    component, held, sd, redundancy, detectable, effect = (column.values[0] for column in table.columns)
    assert (component, held, sd) == ("X", 3, 0.1)
    assert redundancy == pytest.approx(0.0, abs=1e-9)
    assert [detectable, effect] == [math.inf, math.inf]


def test_a_second_pattern_by_spacing_and_by_positions(run):
    result = run("plan", *SMALL, "--against", "perimeter", "--against-spacing", "1")
    assert "perimeter, 1 base " in result.output
    result = run("plan", *SMALL, "--against", "none", "--against-position-sd", "0.05")
    assert "no control, positions 0.05 m" in result.output


def test_what_plan_refuses(run, tmp_path):
    assert run("simulate", "block", *SMALL).exit_code == 0
    for arguments, said in {
        ("--control", "corners"): "the patterns must differ, got corners twice",
        ("block", "--strips", "3"): "must not be combined with options of simulated",
        ("block", "--against-spacing", "3"): "must not be combined with options of simulated",
        ("block", "block"): "every project must be specified once",
    }.items():
        result = run("plan", *arguments)
        assert result.exit_code == 2, arguments
        assert said in result.stderr
    assert run("plan", *SMALL, "--strips", "0").exit_code == 2
    assert run("plan", "nothing").exit_code == 1
    result = run("plan", *SMALL, "--against", "none")
    assert result.exit_code == 3
    assert "no control: the observations must determine position and scale" in result.stderr


@pytest.mark.giant("1", "fictitious data generator: simulated projects")
def test_section_1_projects_are_planned_where_their_images_put_them(run, tmp_path):
    assert run("simulate", "a/block", *SMALL).exit_code == 0
    assert run("simulate", "b/block", *SMALL, "--control", "corners").exit_code == 0
    result = run("plan", "a/block", "b/block", "--json", "files.json")
    assert result.exit_code == 0, result.output
    assert run("plan", *SMALL, "--json", "simulated.json").exit_code == 0
    files, simulated = (
        json.loads((tmp_path / name).read_text())["patterns"] for name in ("files.json", "simulated.json")
    )
    assert [pattern["name"] for pattern in files] == [str(tmp_path / name / "block") for name in "ab"]
    for ours, theirs in zip(files, simulated, strict=True):
        np.testing.assert_allclose(ours["points"][-1]["rms_sd"], theirs["points"][-1]["rms_sd"], rtol=0.02)
        assert [each["held"] for each in ours["control"]] == [each["held"] for each in theirs["control"]]
