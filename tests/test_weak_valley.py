"""Blocks that hardly tell the principal distance from the flying height: few steps, or words."""

import numpy as np
import pytest

import photogram
from photogram import Camera, adjust

WORDS = "principal distance and flying height of all photos"


def block(relief, seed, start=-152.7, free=("c",)):
    """Return two strips of five vertical photos over flat ground, c to be found."""
    cameras = [
        Camera("brown", {"c": c}, sd, unit="mm", name="cam")
        for c, sd in ((-152.74, {}), (start, dict.fromkeys(free, np.inf)))
    ]
    made = photogram.simulate(
        strips=2,
        photos_per_strip=5,
        tilt=0.0,
        crab=0.0,
        relief=relief,
        seed=seed,
        cameras=cameras[:1],
        start_cameras=cameras[1:],
    )
    return made.block


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("relief", [1.0, 20.0, 80.0, 150.0])
def test_a_flat_block_converges_or_says_what_is_weak(relief, seed):
    result = adjust(block(relief, seed))
    assert result.converged
    assert len(result.iterations) <= 25
    weak = [str(each) for each in result.messages if "hardly determine" in str(each)]
    assert all(WORDS in each for each in weak)
    if not weak:
        # The stationary point: another start leads to the same.
        other = adjust(block(relief, seed, start=-150.0))
        c, sd = result.cameras[0].values[0], result.cameras[0].sd[0]
        assert other.cameras[0].values[0] == pytest.approx(c, abs=1e-3 * sd)


def test_what_is_weak_is_named_where_the_iterations_run_out():
    result = adjust(block(1.0, 1, free=("c", "xp", "yp")), max_iterations=12)
    assert result.converged or any("hardly determine" in str(each) for each in result.messages)
