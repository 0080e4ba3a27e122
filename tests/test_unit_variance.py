"""One variance of unit weight at every entrance, whose expectation is 1; the rule of 1987 on demand."""

import json
import math

import numpy as np
import pytest

from photogram import adjust, formats, simulate
from photogram.giant import Project as GiantProject
from photogram.network import with_gnss

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


def test_the_global_test_holds_with_every_unit_variance(blocks):
    for rule in ("free", "unity", "redundancy"):
        tests = [adjust(block, unit_variance=rule).global_test for block in blocks]
        assert np.mean([each.variance for each in tests]) == pytest.approx(1.0, abs=0.06)
        assert sum(each.probability < 0.05 for each in tests) <= 5


def test_stations_that_nobody_observed_leave_the_variance_at_one():
    """The cards have no free stations: 60,000 units and 90 degrees, which would count as observations."""
    variances, tests = [], []
    for seed in range(CLEAN):
        block = simulate(strips=1, photos_per_strip=4, points_per_photo=30, seed=seed).block
        cards = GiantProject.from_block(block)
        result = adjust(cards.to_block(), unit_variance=cards.common.unbiased_variance)
        assert result.degrees_of_freedom == adjust(block).degrees_of_freedom
        variances.append(result.variance_of_unit_weight)
        tests.append(result.global_test.probability)
    freedom = result.degrees_of_freedom
    assert np.mean(variances) == pytest.approx(1.0, abs=3 * math.sqrt(2 / (CLEAN * freedom)))
    assert sum(each < 0.05 for each in tests) <= 5


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
    """Write a GIANT project with weighted stations, and the same as a plain project."""
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
    # A project that does not say: that of most users.
    toml = written / "plain" / "project.toml"
    toml.write_text(toml.read_text().replace('unit_variance = "constrained"\n', ""))
    assert "unit_variance" not in toml.read_text()
    parts = ("adjust", "plain", "--parts", "2")
    for command in (("adjust", "plain"), parts, ("adjust", "cards"), ("giant", "cards")):
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
    assert found["unit_variance"] == "redundancy"
    assert found["degrees_of_freedom"] == pytest.approx(ours.redundancies.measured, abs=1e-3)


def test_what_earlier_versions_wrote_without_being_asked_is_the_default_of_today(run, written):
    toml = written / "plain" / "project.toml"
    text = toml.read_text()
    assert 'unit_variance = "constrained"' in text
    toml.write_text(text.replace('"constrained"', '"free"'))
    assert formats.read(written / "plain").options.unit_variance == "constrained"
