"""Plates with blunders, slow iterations, far attitudes: what is said, and what is found all the same."""

import shutil
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import codes, fields_of, has_code
from photogram.cli import app
from photogram.statistics.verdict import EXIT_NOT_USABLE
from photogram.stellar import INDEX, NAMES, calibrate
from photogram.stellar.movement import combine

EXAMPLE = Path(str(files("photogram") / "examples" / "stellar"))


@pytest.fixture(scope="module")
def plain(plate):
    """Return the example without its extras."""
    return replace(plate, options=replace(plate.options, movement_factor=0.0, curves=False, histogram=False))


@pytest.fixture(scope="module")
def solved(plain):
    return calibrate(plain)


def spoilt(problem, image, shift):
    xy = problem.image_xy.copy()
    xy[image, 0] += shift
    return replace(problem, image_xy=xy)


def test_a_good_plate_has_no_outliers(solved):
    assert "stars.outliers" not in codes(solved.messages)


def test_a_residual_of_ten_mean_errors_is_a_problem(plain):
    result = calibrate(spoilt(plain, 7, 30e-6))
    first = result.messages[0].phrase.fields
    assert (first["statistic"], first["limit"]) == ("t", pytest.approx(4.05, abs=0.005))
    assert has_code(first["names"][0], "stars.plate-coordinate", axis="x", point="103", star="2")
    assert first["names"][0].fields["value"] == pytest.approx(10.5, abs=0.5)


def test_with_a_given_mean_error_residuals_are_over_their_own(plain):
    given = replace(plain, options=replace(plain.options, mean_error=3e-6))
    first = calibrate(spoilt(given, 7, 30e-6)).messages[0].phrase
    assert (first.fields["statistic"], first.fields["limit"]) == ("w", pytest.approx(4.05, abs=0.05))
    assert has_code(first, "stars.plate-coordinate", axis="x", point="103", star="2")


def test_a_failed_global_test_comes_first(plain, solved):
    assert solved.test is None
    small = replace(plain, options=replace(plain.options, mean_error=1e-6))
    failed = calibrate(small)
    assert failed.test.factor == pytest.approx(3.02, abs=0.005)
    assert str(failed.messages[0]) == str(failed.test.problem())
    right = calibrate(replace(plain, options=replace(plain.options, mean_error=3e-6)))
    assert not right.test.rejected_high


def test_a_blunder_that_bends_the_camera_is_no_calibration(plain, solved):
    """5 mm on one image: m is 183 um, and the camera is another one; a residual of 30 um harms nobody."""
    assert not solved.spoiled
    result = calibrate(spoilt(plain, 100, 5e-3))
    assert result.converged
    assert result.verdict.exit == EXIT_NOT_USABLE
    name = solved.problem.image_points[100]
    assert has_code(result.verdict.message, "stars.harm")
    assert has_code(result.verdict.message, "stars.plate-coordinate", point=name)
    assert calibrate(spoilt(plain, 7, 30e-6)).verdict.exit == 0


@pytest.mark.parametrize("moved", ["x", "place"])
def test_harm_is_told_against_the_solution_without_outliers(plain, moved):
    """What outliers change, in standard deviations of the solution without them, is over one."""
    if moved == "x":
        wrong = spoilt(plain, 200, 5e-4)
        clean = plain.without(np.zeros(75, bool), np.arange(375) == 200)
    else:
        places = plain.star_places.copy()
        places[12, 1] += 1e-3
        wrong = replace(plain, star_places=places)
        clean = plain.without(np.arange(75) == 12, np.zeros(375, bool))
    result, right = calibrate(wrong), calibrate(clean)
    assert not right.spoiled
    errors = np.array([right.mean_errors[name] for name in NAMES[9:22]])
    change = np.abs(result.solved.parameters - right.solved.parameters)[9:22] / np.where(
        errors > 0, errors, 1
    )
    assert result.spoiled.fields["name"] == NAMES[9 + change.argmax()]
    assert result.spoiled.fields["change"] == pytest.approx(change.max(), rel=1e-6)


def test_a_wrong_place_of_a_star_is_a_problem(plain):
    places = plain.star_places.copy()
    places[30, 1] += 60e-6
    # With trails of five images the star can only be moved as a whole, and its weight says how far.
    found = calibrate(replace(plain, star_places=places)).messages
    assert has_code(found[0], "stars.place", star="31")


def test_the_star_that_spoils_the_iteration_is_named(plain):
    result = calibrate(spoilt(plain, 7, 5e-3))
    assert not result.converged
    assert result.messages[0].code == "stars.plate-not-converged"
    assert has_code(result.messages[1], "stars.plate-coordinate", point="103", star="2")
    assert fields_of(result.messages, "stars.culprit")["star"] == "2"


def single(plain, solved, group, factor, seed):
    """Return a plate of one group whose distortion is so small that its centre is hardly known."""
    generator = np.random.default_rng(seed)
    images = plain.image_groups == group
    made = replace(plain, image_groups=np.full_like(plain.image_groups, 2))
    made = made.without(np.zeros(len(plain.star_ids), bool), ~images)
    start = solved.solved.parameters.copy()
    start[6:9] = start[3 * group : 3 * group + 3]
    start[16:21] *= factor
    seen = made.core(start, made.star_places, np.ones(26, bool)).equations()["constant"]
    xy = made.image_xy - seen + 3e-6 * generator.standard_normal(made.image_xy.shape)
    initial = start.copy()
    initial[6:9] += generator.normal(0, 0.005, 3)
    initial[9:12] = initial[14:21] = 0
    initial[12:14] = 0.3
    return replace(made, image_xy=xy, initial=initial)


@pytest.mark.parametrize(("group", "seed"), [(0, 0), (0, 3)])
def test_a_plate_of_one_orientation_ends_when_the_sum_stands_still(plain, solved, group, seed):
    result = calibrate(single(plain, solved, group, 0.3, seed))
    assert result.converged
    # Which of the two comes first is a matter of rounding.
    assert result.solved.stop.startswith(("THE SUM OF SQUARES STANDS STILL", "NO UNKNOWN CHANGES BY MORE"))
    levels = list(result.levels)
    assert min(levels) == pytest.approx(levels[-1], rel=1e-8)


def test_the_combined_solution_does_not_depend_on_the_separate_one(plain, solved):
    """Two groups together, and weights on both attitudes: the same as one attitude with their sum."""
    start = solved.solved.parameters.copy()
    start[0:3] = start[6:9]
    core = plain.core(start, plain.star_places, np.ones(26, bool))
    noise = 3e-6 * np.random.default_rng(8).standard_normal(plain.image_xy.shape)
    weights = np.zeros((26, 26))
    # As if each angle had been measured with 1e-5 rad.
    weights[[0, 1, 2, 6, 7, 8], [0, 1, 2, 6, 7, 8]] = (3e-6 / 1e-5) ** 2
    initial = start.copy()
    initial[0:3] += 2e-5
    xy = plain.image_xy - core.equations()["constant"] + noise
    made = replace(plain, image_xy=xy, parameter_weights=weights, initial=initial)
    combined = combine(calibrate(made), (("pre", "event"),))
    assert combined.converged
    values = combined.solved.parameters
    assert values[0:3] == pytest.approx(values[6:9], abs=1e-15)
    groups = np.where(made.image_groups == 0, 2, made.image_groups)
    once = np.zeros((26, 26))
    once[[6, 7, 8], [6, 7, 8]] = 2 * (3e-6 / 1e-5) ** 2
    middle = initial.copy()
    middle[6:9] = 0.5 * (initial[0:3] + initial[6:9])
    one = calibrate(replace(made, image_groups=groups, parameter_weights=once, initial=middle))
    errors = np.array([one.mean_errors[name] for name in NAMES[3:22]])
    assert np.abs((values - one.solved.parameters)[3:22] / errors).max() < 1e-4
    # The pairs of given angles differ by 2e-5: their sum of squares is in the combined solution only.
    apart = 3 * (3e-6 / 1e-5) ** 2 * 2 * 1e-5**2
    assert sum(combined.solved.sums) == pytest.approx(sum(one.solved.sums) + apart, rel=1e-9)


def test_as_published_from_the_attitude_of_the_event(plain, solved):
    """A deck starts all groups with one attitude; undamped steps do not find the others from there."""
    initial = solved.solved.parameters.copy()
    initial[0:3] = initial[3:6] = initial[6:9]
    options = replace(plain.options, as_published=True)
    far = calibrate(replace(plain, initial=initial, options=options))
    near = calibrate(replace(plain, options=options))
    assert far.converged
    assert "stars.far-attitudes" in codes(far.messages)
    assert far.computed_mean_error == pytest.approx(near.computed_mean_error, rel=1e-6)
    errors = np.array([near.mean_errors[name] for name in NAMES[:22]])
    off = (far.solved.parameters - near.solved.parameters)[:22]
    off[[2, 5, 8, INDEX["phi_T"]]] = np.remainder(off[[2, 5, 8, INDEX["phi_T"]]] + np.pi, 2 * np.pi) - np.pi
    assert np.abs(off / errors).max() < 0.01


def test_a_camera_that_must_not_be_used_is_withheld(tmp_path, monkeypatch):
    """Listing and report are written; camera.json of an earlier run is named, not left as if it were new."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(EXAMPLE, "plate")
    command = ["stellar-camera", "plate/plate.toml", "--out", "out", "--no-html"]
    assert CliRunner().invoke(app, command).exit_code == 0
    before = Path("out/camera.json").read_bytes()
    lines = Path("plate/images.csv").read_text().splitlines()
    star, point, x, y, time = lines[101].split(",")
    lines[101] = ",".join([star, point, x, f"{float(y) + 5e-3:.8f}", time])
    Path("plate/images.csv").write_text("\n".join(lines) + "\n")
    run = CliRunner().invoke(app, command)
    assert run.exit_code == EXIT_NOT_USABLE
    assert "camera.json withheld" in run.stderr
    assert "out/camera.json is from an earlier run" in run.stderr
    assert "out/camera.json" not in run.stdout
    assert Path("out/camera.json").read_bytes() == before
