"""One variance of unit weight at every entrance, whose expectation is 1; the rule of 1987 where it is asked for."""

import json
import math

import numpy as np
import pytest

from photogram import adjust, formats, simulate
from photogram.network.simulated_observations import with_gnss

STATIONS = {"position_sd": 0.05, "attitude_sd": math.radians(0.003)}
BLOCK = {"strips": 2, "photos_per_strip": 4, "points_per_photo": 20}
CLEAN = 30


@pytest.fixture(scope="module")
def blocks():
    return [simulate(**BLOCK, **STATIONS, seed=seed).block for seed in range(CLEAN)]


def test_strong_stations_leave_the_variance_at_one(blocks):
    results = [adjust(block) for block in blocks]
    freedom = results[0].degrees_of_freedom
    mean = np.mean([result.variance_of_unit_weight for result in results])
    assert mean == pytest.approx(1.0, abs=3 * math.sqrt(2 / (CLEAN * freedom)))
    # 6 or more of 30 by chance: three times in a thousand.
    assert sum(result.global_test.probability < 0.05 for result in results) <= 5


@pytest.mark.parametrize("rule", ["free", "unity", "redundancy"])
def test_the_global_test_is_that_of_all_observations_whatever_scales_covariances(blocks, rule):
    test, expected = adjust(blocks[0], unit_variance=rule).global_test, adjust(blocks[0]).global_test
    assert test.degrees_of_freedom == expected.degrees_of_freedom
    assert test.weighted_sum_of_squares == pytest.approx(expected.weighted_sum_of_squares, rel=1e-12)


@pytest.mark.parametrize("rule", ["constrained", "unity"])
def test_weighted_lever_arms_and_cameras_count_among_the_degrees_of_freedom(rule):
    made = with_gnss(simulate(**BLOCK, seed=1), lever_arm=[0.2, -0.4, 1.1], lever_arm_sd=0.02, seed=1)
    weighted = made.block.replace(
        cameras=[camera.replace(sd={"c": 0.01}) for camera in made.block.cameras]
    )  # fmt: skip
    assert len(weighted.unknowns) == 1
    result = adjust(weighted, unit_variance=rule)
    assert result.unknowns[0].redundancy.sum() > 0.01
    assert result.redundancies.total == pytest.approx(result.degrees_of_freedom, abs=1e-6)


@pytest.fixture
def written(run, tmp_path):
    """A GIANT project with weighted stations, and the same as a plain project."""
    options = ("--strips", 2, "--photos-per-strip", 4, "--points-per-photo", 20, "--seed", 1)
    stations = ("--position-sd", STATIONS["position_sd"], "--attitude-sd", STATIONS["attitude_sd"])
    assert run("simulate", "cards", *options, *stations).exit_code == 0
    assert run("convert", "cards", "plain", "--to", "plain", "-q").exit_code == 0
    return tmp_path


def adjusted(run, folder, *command):
    found = run(*command, "--json", "found.json", "--out", "-".join(command), "--no-html")
    assert found.exit_code == 0, found.output
    return json.loads((folder / "found.json").read_text())


def test_all_entrances_have_one_unit_variance(run, written):
    block = formats.read(written / "plain").block
    whole = adjust(block)
    for command in (("adjust", "plain"), ("adjust", "cards"), ("giant", "cards")):
        found = adjusted(run, written, *command)
        assert found["unit_variance"] == "constrained"
        assert found["degrees_of_freedom"] == whole.degrees_of_freedom
        assert found["covariance_scale"] == pytest.approx(whole.variance_of_unit_weight, rel=1e-6)


def test_the_rule_of_1987_is_that_of_as_published(run, written):
    cards = written / "cards" / "COMMON"
    lines = cards.read_text().splitlines()
    lines[1] = lines[1][:11] + "0" + lines[1][12:]  # column 12: cameras free
    cards.write_text("\n".join(lines) + "\n")
    block = formats.read(written / "cards").block
    free, ours = adjust(block, unit_variance="free"), adjust(block)
    assert free.degrees_of_freedom == ours.degrees_of_freedom - block.photo_positions.size * 2
    published = adjusted(run, written, "giant", "cards", "--as-published")
    assert (published["unit_variance"], published["degrees_of_freedom"]) == ("free", free.degrees_of_freedom)
    assert published["covariance_scale"] == pytest.approx(free.variance_of_unit_weight, rel=1e-6)
    found = adjusted(run, written, "giant", "cards")
    assert (found["unit_variance"], found["degrees_of_freedom"]) == ("constrained", ours.degrees_of_freedom)


def test_what_earlier_versions_wrote_without_being_asked_is_the_default_of_today(run, written):
    toml = written / "plain" / "project.toml"
    text = toml.read_text()
    assert 'unit_variance = "constrained"' in text
    toml.write_text(text.replace('"constrained"', '"free"'))
    assert formats.read(written / "plain").options.unit_variance == "constrained"
