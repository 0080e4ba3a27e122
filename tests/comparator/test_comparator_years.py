"""Calibrations over years: changes are named, grids adjusted together, what cannot be compared refused."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from plates import QUICK, bent

from message_codes import refusal
from photogram.comparator import (
    Grid,
    RecordedCalibration,
    calibrate,
    compare,
    read_grid,
    simulate_calibration,
)
from photogram.comparator.years.joint import adjust_together, day_of

GRID = Grid.square(number=7, sigma_um=0.3)
ERRORS = 0.3 * np.random.default_rng(1).standard_normal((25, 2))


@cache
def year(k, *, scale=0.0, comparator=3, temperature=None, left_handed=False, random_um=0.6):
    """Calibrate a comparator whose x scale differs, on a grid whose errors are always the same."""
    own = bent()
    grid = GRID if temperature is None else replace(GRID, temperature_c=20.0, expansion_per_k=8e-6)
    made = simulate_calibration(
        grid if temperature is None else replace(grid.at(temperature), temperature_c=20.0),
        replace(own, scale_x=own.scale_x + scale),
        pointing_um=0.9,
        random_um=random_um,
        grid_errors_um=ERRORS,
        rotation_rad=0.2 + 0.1 * k,
        left_handed=left_handed,
        date=f"{1970 + k}-0{1 + k}-15",
        comparator=comparator,
        seed=k,
    ).session
    return calibrate(replace(made, grids={7: grid}, temperature_c=temperature))


@pytest.mark.parametrize("left_handed", [False, True])
def test_one_calibration_adjusted_so_is_the_joint_adjustment(left_handed):
    """The engine has made it: parameters, covariances, grid and residuals agree."""
    own = year(1, left_handed=left_handed)
    record = RecordedCalibration.of(own, "own")
    found = adjust_together([record])
    correction, sd = own.joint.correction, np.sqrt(np.diag(own.joint.correction.covariance))
    known = sd > 0
    shift = found.parameters[0][3:] - correction.polynomial.scaled_um.ravel()
    assert np.abs(shift[known[3:]] / sd[3:][known[3:]]).max() < 2e-3
    difference = (found.covariance[0, :, 0, :] - correction.covariance)[np.ix_(known, known)]
    assert np.abs(difference / np.outer(sd[known], sd[known])).max() < 2e-3
    plate = own.joint.plates[7]
    assert found.corrections_um[7] == pytest.approx(plate.corrections_um, abs=1e-4)
    blocks = [found.covariance_um2[7][2 * k : 2 * k + 2, 2 * k : 2 * k + 2] for k in range(25)]
    assert np.array(blocks) == pytest.approx(plate.covariance_um2, abs=1e-5)
    assert found.test.variance == pytest.approx(own.joint.sigma0**2, rel=1e-6)
    assert found.test.degrees_of_freedom == own.joint.degrees_of_freedom
    for mine, case in zip(found.standardized[0], own.joint.cases, strict=True):
        assert np.abs(mine) == pytest.approx(np.abs(case.standardized) * own.joint.sigma0, abs=1e-3)


def test_nothing_is_named_where_nothing_changes():
    found = compare([year(k) for k in (3, 0, 4, 1, 2)])
    assert [each.day.year for each in found.calibrations] == [1970, 1971, 1972, 1973, 1974]
    own = found.histories["comparator 3"]
    assert not own.sentences
    assert found.verdict.code == "accepted"
    assert "comparator 3: nothing changed between 1970-01-15 and 1974-05-15" in str(found.verdict.lines)
    # Scales are those that were simulated, apart from what all share with the grid.
    frame = found.ranges["comparator 3"]
    assert frame.half_range_um[0] < 125_000
    true = GRID.xy_um + ERRORS
    off = found.grids[7].xy_um - true
    before = np.sqrt((ERRORS**2).mean())
    assert np.sqrt((off**2).mean()) < 0.6 * before
    assert np.sqrt((off**2).mean()) == pytest.approx(found.grids[7].sigma_um, rel=0.35)
    assert found.grids[7].adopted.startswith("1970-01-15 to 1974-05-15, 5 calibrations")


def test_a_planted_step_of_20_um_a_metre_is_named_with_its_time():
    found = compare([year(0), year(1), year(2), year(3, scale=20e-6), year(4, scale=20e-6)])
    own = found.histories["comparator 3"]
    (change,) = own.series[0].changes
    assert (own.series[0].name, change.kind, change.at) == ("scale x", "step", 3)
    assert abs(change.size - 20) < 4 * change.sd
    assert sum(len(each.changes) for each in own.series) == 1
    assert found.verdict.exit == 4
    assert found.verdict.headline.startswith("Changed: comparator 3: scale x steps by")
    assert "between 1972-03-15 and 1973-04-15" in found.verdict.headline
    # The grid does not care: each calibration has a comparator of its own.
    assert found.usable_grids
    drifting = compare([year(k, scale=8e-6 * k) for k in range(5)])
    kinds = {
        each.name: [change.kind for change in each.changes]
        for each in drifting.histories["comparator 3"].series
    }
    assert kinds["scale x"] == ["drift"]


def test_noise_that_grows_is_named():
    found = compare([year(0), year(1), year(2, random_um=2.4), year(3, random_um=2.4)])
    names = {each.name for each in found.histories["comparator 3"].series if each.changes}
    assert names == {"random comparator"}


def test_the_expansion_of_a_comparator_is_told_from_that_of_the_plate():
    """The plate is taken at its temperature; what is left is the comparator's own, and is named."""
    degrees = [20.0, 26.0, 22.0, 28.0, 21.0]
    plain = compare([year(k, temperature=t) for k, t in enumerate(degrees)])
    assert not plain.histories["comparator 3"].sentences
    assert plain.grids[7].temperature_c == 20.0
    assert plain.grids[7].xy_um == pytest.approx(GRID.xy_um, abs=2.0)
    warm = compare([year(k, temperature=t, scale=3e-6 * (t - 20)) for k, t in enumerate(degrees)])
    (change,) = warm.histories["comparator 3"].series[0].changes
    assert change.kind == "temperature"
    assert abs(change.size - 3) < 4 * change.sd
    assert "scale x changes with the temperature by" in warm.verdict.headline
    assert "um/m a kelvin" in warm.verdict.headline


def test_other_comparators_measure_the_same_grid():
    found = compare([year(0), year(1), year(2, comparator=5)])
    assert list(found.histories) == ["comparator 3"]
    assert "3 calibrations" in found.grids[7].adopted
    assert found.grids[7].sigma_um < compare([year(0), year(1)]).grids[7].sigma_um
    assert found.operators[1][2] == sum(each.pointing_freedom for each in found.calibrations)


def test_the_command_names_a_step_and_writes_the_grid(run, tmp_path):
    paths = []
    for k in range(4):
        paths.append(tmp_path / f"year-{k}.json")
        paths[-1].write_bytes(year(k, scale=20e-6 if k > 1 else 0.0).to_json())
    result = run("comparator", "compare", *paths, "--out", "out", "--json", "all.json")
    assert result.exit_code == 4, result.output
    assert "scale x steps by" in result.stdout
    assert "between 1971-02-15 and 1972-03-15" in result.stdout
    assert read_grid(Path("out/grid-7.csv")).sigma_um < 0.25
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert "Control charts" in page
    assert "Not to be used as it is" in page
    document = json.loads(Path("all.json").read_bytes())
    (change,) = document["comparators"]["comparator 3"]["series"][0]["changes"]
    assert change["kind"] == "step"
    assert change["occasion"] == "1972-03-15"
    assert np.array(document["covariance"]).shape == (4, 21, 4, 21)
    assert np.array(document["grids"][0]["covariance_um2"]).shape == (50, 50)
    result = run("comparator", "compare", paths[0], "--out", "one")
    assert result.exit_code == 1
    assert "at least two calibrations" in result.stderr


def test_what_cannot_be_compared_is_refused(tmp_path):
    first, second = year(0), year(1)
    with refusal("comparators.same first=calibration 1 second=calibration 2"):
        compare([first, first])
    quick = calibrate(first.session, QUICK)
    with refusal("comparators.no-joint"):
        compare([first, quick])
    undated = calibrate(replace(second.session, date="last spring"))
    with refusal("comparators.date date=last spring"):
        compare([first, undated])
    moved = replace(GRID, xy_um=GRID.xy_um + np.array([0.01, 0.0]))
    other = calibrate(replace(second.session, grids={7: moved}))
    with refusal("comparators.other-grid name=calibration 2 plate=7"):
        compare([first, other])
    for text in ("{}", "[1]", "nonsense", '{"joint": {"correction": 1}}'):
        (tmp_path / "bad.json").write_text(text)
        with refusal("error.parse" if text == "nonsense" else "error.content"):
            compare([tmp_path / "bad.json", first])


def test_dates_are_those_of_the_report_or_of_today():
    assert day_of("7/17/72").isoformat() == "1972-07-17"
    assert day_of("1/2/2024").isoformat() == "2024-01-02"
    assert day_of(" 2024-02-29 ").isoformat() == "2024-02-29"
    for text in ("", "17.7.1972", "2023-02-29", "13/1/72"):
        with refusal("comparators.date", text):
            day_of(text)


def test_damaged_documents_are_refused_with_what_is_wrong(tmp_path):
    good = json.loads(year(0).to_json())
    for member, value, words in (
        (("joint", "sigma_random_um"), 0.0, "what=random_um message=error.positive"),
        (("cases", 0, "points", 3), 99, "99"),
        (("joint", "cases", 0, "rotation_rad"), "north", ""),
        (("plates", 0, "corrected_plate_um", 0), [1.0], ""),
    ):
        bad = json.loads(json.dumps(good))
        place = bad
        for name in member[:-1]:
            place = place[name]
        place[member[-1]] = value
        (tmp_path / "bad.json").write_text(json.dumps(bad))
        with refusal(words):
            RecordedCalibration.read(tmp_path / "bad.json")
