"""Properties of the calibration: algebra, noise, unknown directions, refraction, weights, movement."""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import AdjustmentError, InputError
from photogram.angles import ARCSEC
from photogram.stellar import calibrate
from photogram.stellar.parameters import INDEX
from photogram.stellar.plain import read_plain
from photogram.stellar.published import DIVERGED, SETTLED, stop_reason
from photogram.stellar.reduction import columns, invert, reduce

EXAMPLE = Path(str(files("photogram") / "examples" / "stellar" / "plate.toml"))


@pytest.fixture(scope="module")
def plate():
    return read_plain(EXAMPLE)


@pytest.fixture(scope="module")
def truth(plate):
    """Return the example without errors: what the calibrated camera sees of the catalogue places."""
    solved = calibrate(plate).solved.parameters
    core = plate.core(solved, plate.star_places, np.ones(26, bool))
    exact = plate.image_xy - core.equations()["constant"]
    return replace(plate, image_xy=exact, initial=solved)


def noisy(truth, generator, plate_sd=3e-6, star_sd=0.2 * ARCSEC):
    shape = truth.star_places.shape
    stars = star_sd * generator.standard_normal(shape) / np.column_stack([np.ones(shape[0])] * 2)
    weights = np.broadcast_to(np.eye(2) * (plate_sd / star_sd) ** 2, (shape[0], 2, 2)).copy()
    xy = truth.image_xy + plate_sd * generator.standard_normal(truth.image_xy.shape)
    return replace(truth, star_places=truth.star_places + stars, star_weights=weights, image_xy=xy)


def test_a_dense_adjustment_of_everything_agrees(plate):
    result = calibrate(plate)
    core = plate.core(result.solved.parameters, result.solved.places, ~result.solved.free)
    equations = core.equations()
    rows = columns(plate, equations, plate.image_groups)[:, :, :22].reshape(-1, 22)
    count = len(plate.star_ids)
    dense = np.zeros((rows.shape[0] + 2 * count, 22 + 2 * count))
    dense[: rows.shape[0], :22] = rows
    for i, star in enumerate(plate.image_stars):
        dense[2 * i : 2 * i + 2, 22 + 2 * star : 24 + 2 * star] = equations["star"][i]
    weight = np.sqrt(plate.star_weights[0, 0, 0])
    dense[rows.shape[0] :, 22:] = weight * np.eye(2 * count)
    off = weight * (plate.star_places - result.solved.places).ravel()
    right = np.concatenate([equations["constant"].ravel(), off])
    scale = 1 / np.linalg.norm(dense, axis=0)
    inverse = np.linalg.inv((dense * scale).T @ (dense * scale)) * np.outer(scale, scale)
    step = inverse @ dense.T @ right
    sd = np.sqrt(np.diag(inverse))
    assert np.abs(step / sd).max() / result.mean_error < 1e-6
    q = result.solved.cofactors[:22, :22] / np.outer(sd[:22], sd[:22])
    expected = inverse[:22, :22] / np.outer(sd[:22], sd[:22])
    # The engine's cofactors hold before its last step, a ten-thousandth of a standard deviation away.
    assert q == pytest.approx(expected, abs=1e-5)
    reduced = reduce(plate, core, equations, result.solved.places)
    eliminated = invert(reduced.normal, result.solved.free)[:22, :22] / np.outer(sd[:22], sd[:22])
    assert eliminated == pytest.approx(expected, abs=1e-9)


def test_noise_gives_unbiased_parameters_and_right_covariances(truth):
    generator = np.random.default_rng(11)
    runs, off, unit, squares = 60, [], [], []
    for _ in range(runs):
        # A tenth of the plate's noise: the centre of a weak distortion is far from linear.
        result = calibrate(noisy(truth, generator, 3e-7, 0.02 * ARCSEC))
        assert result.converged
        cofactors = 9e-14 * result.solved.cofactors[:22, :22]
        sd = np.sqrt(np.diag(cofactors))
        off.append((result.solved.parameters - truth.initial)[:22] / sd)
        squares.append(off[-1] @ np.linalg.solve(cofactors / np.outer(sd, sd), off[-1]))
        unit.append(result.mean_error / 3e-7)
    off = np.array(off)
    assert np.abs(off.mean(axis=0)).max() * np.sqrt(runs) < 4
    # Chi-squared of 22 degrees of freedom, sixty times: its mean is good to 0.9.
    assert np.mean(squares) == pytest.approx(22.0, abs=3.0)
    assert np.mean(unit) == pytest.approx(1.0, abs=0.02)


def test_unknown_directions_lie_in_their_ellipses(truth):
    generator = np.random.default_rng(12)
    inside = []
    for _ in range(15):
        made = noisy(truth, generator)
        weights = made.star_weights.copy()
        weights[::5] = 0
        result = calibrate(replace(made, star_weights=weights))
        for star in range(0, len(made.star_ids), 5):
            error = result.solved.places[star] - truth.star_places[star]
            q = error @ np.linalg.solve(result.star_covariances[star], error)
            inside.append(q < 5.991)
    # 95 % of 225, which are correlated within a run.
    assert np.mean(inside) == pytest.approx(0.95, abs=0.05)


@pytest.mark.parametrize("as_published", [False, True])
def test_refraction_comes_back(truth, as_published):
    wrong = truth.initial.copy()
    wrong[INDEX["tau1"]] += 40.0
    core = truth.core(wrong, truth.star_places, np.ones(26, bool))
    measured = truth.image_xy - core.equations()["constant"]
    weights = np.zeros((26, 26))
    weights[23:, 23:] = np.eye(3) * 1e6
    options = replace(truth.options, refraction=True, as_published=as_published, movement_factor=0.0)
    held = truth.fixed.copy()
    held[23:] = True
    held[:22] = np.isin(np.arange(22), range(9, 22))
    result = calibrate(replace(truth, image_xy=measured, options=options, fixed=held))
    assert result.parameters["tau1"] - truth.initial[INDEX["tau1"]] == pytest.approx(40.0, abs=0.5)


def test_a_huge_weight_freezes_a_parameter(plate):
    weights = np.zeros((26, 26))
    weights[INDEX["cx"], INDEX["cx"]] = 1e12
    frozen = calibrate(replace(plate, parameter_weights=weights))
    free = calibrate(plate)
    assert frozen.parameters["cx"] == pytest.approx(0.3, abs=1e-9)
    assert frozen.degrees_of_freedom == free.degrees_of_freedom + 1


def test_common_scale_counts_one_unknown_less(plate):
    result = calibrate(replace(plate, options=replace(plate.options, common_scale=True)))
    assert result.parameters["cx"] == result.parameters["cy"]
    assert result.counts.unknowns == 171


def test_what_the_stars_do_not_determine_is_named(plate):
    one = replace(plate, star_weights=np.zeros_like(plate.star_weights))
    with pytest.raises(AdjustmentError):
        calibrate(one)
    with pytest.raises(InputError, match="incorrect stars"):
        calibrate(replace(plate, options=replace(plate.options, minimum_stars=("1", "999"))))


def test_the_minimum_solution_is_unique_and_a_pre_run_shows_the_rest(truth):
    start = truth.initial.copy()
    start[14:22] = 0
    one_group = truth.image_groups == 2
    stars = [truth.star_ids[i] for i in np.unique(truth.image_stars[one_group])[[0, 12]]]
    options = replace(truth.options, minimum_stars=tuple(stars), pre_run=True, as_published=True)
    result = calibrate(replace(truth, initial=start, options=options))
    assert result.counts.parameter_unknowns == 8
    assert result.pre_run is not None
    assert len(result.pre_run.points) == len(truth.image_points) - 10


def test_attitudes_that_do_not_differ_are_combined(truth):
    one = truth.initial.copy()
    one[0:3] = one[3:6] = one[6:9]
    core = truth.core(one, truth.star_places, np.ones(26, bool))
    visible = truth.image_xy - core.equations()["constant"]
    made = noisy(replace(truth, image_xy=visible, initial=one), np.random.default_rng(13))
    result = calibrate(made)
    assert result.combined is not None
    values = result.combined.solved.parameters
    assert values[0:3] == pytest.approx(values[6:9], abs=1e-12)
    assert result.combined.mean_error == pytest.approx(3e-6, rel=0.15)


def test_stop_rules():
    assert stop_reason([1.0], 1e-3, 0) is None
    assert stop_reason([1.0, 1.0005], 1e-3, 0) == SETTLED
    assert stop_reason([1, 2, 1, 2, 1, 2, 1, 2], 1e-3, 0) == DIVERGED
    assert stop_reason([3.0, 2.0, 1.0], 1e-3, 2) == "2 ITERATIONS COMPLETED"
