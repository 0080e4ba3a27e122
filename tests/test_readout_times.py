"""The standard deviation of a readout time by Monte Carlo, also of photos that rotate during the readout."""

import numpy as np
import pytest

from photogram import adjust, simulate
from photogram.network import project
from photogram.results.network_trial import block_facts

RUNS = 60
READOUT = 0.05  # Exposures
ROTATION = 3e-3  # Radians during the readout, standard deviation between photos


@pytest.fixture(scope="module")
def survey():
    """Return a block, its image coordinates without noise, and the time of each within the readout."""
    block = simulate(strips=3, photos_per_strip=8, points_per_photo=30.0, image_sd=0.01, seed=5).block
    found = adjust(block)
    ((lines, _),) = block_facts(block, found.photo_positions)["readouts"]
    times = block.image_xy @ lines[:2] + lines[2]
    return block, found, block.image_xy - found.residuals, times


def readout(result):
    """Return the readout time and its sd: for equal photos, for different ones, and the written one."""
    every = result._hypotheses()
    row = every.code.tolist().index("readout-time")
    own = every.sets[row]
    written = every._size(row)
    sd = float(written.partition("(sd ")[2].rstrip(")"))
    return own["estimate"][0], np.sqrt(own["cofactors"][0]), own["sd_between_photos"], sd


def moved(survey):
    """Return changes of the images if photos move with the velocity of the flight during the readout."""
    block, found, _, times = survey
    of, velocities = block.image_photos, block_facts(block, found.photo_positions)["velocities"]
    places = found.photo_positions[of]
    at_lines = places + READOUT * times[:, np.newaxis] * velocities[of]
    points, attitudes = found.point_positions[block.image_points], found.photo_attitudes[of]
    distances = block.principal_distances[of]
    return project(points, at_lines, attitudes, distances) - project(points, places, attitudes, distances)


def rotated(survey, rng):
    """Return changes of the images if each photo rotates about its y axis on its own."""
    block, _, _, times = survey
    rates = ROTATION * rng.normal(size=len(block.photo_ids))
    return np.outer(block.principal_distances[0] * times * rates[block.image_photos], [1.0, 0.0])


@pytest.mark.parametrize("rotates", [False, True])
def test_the_standard_deviation_is_that_of_repeated_surveys(survey, rotates):
    block, _, exact, _ = survey
    rng, rows = np.random.default_rng(7), []
    for _ in range(RUNS):
        change = rotated(survey, rng) if rotates else moved(survey)
        xy = exact + change + 0.01 * rng.normal(size=exact.shape)
        rows.append(readout(adjust(block.replace(image_xy=xy))))
    estimates, of_noise, between, written = (np.array(each, dtype=float) for each in zip(*rows, strict=True))
    spread = estimates.std()
    # The spread of photos is only computed for significant readout times.
    significant = np.isfinite(between)
    assert significant.mean() > (0.5 if rotates else 0.99)
    assert estimates.mean() == pytest.approx(0.0 if rotates else READOUT, abs=4 * spread / np.sqrt(RUNS))
    assert np.sqrt((written[significant] ** 2).mean()) == pytest.approx(spread, rel=0.25)
    ratio = spread / of_noise.mean()
    assert ratio > 3 if rotates else ratio == pytest.approx(1.0, abs=0.25)
