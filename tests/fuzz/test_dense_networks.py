"""Random networks of every camera, kind of observation and datum against equations written out once more."""

import numpy as np
import pytest

from fuzz.dense_network import compare, equations
from fuzz.equations import Dense
from fuzz.lenses import BACKWARD, FORWARD
from fuzz.networks import DATUMS, KINDS, MODELS, random_network
from photogram import adjust

SEED = 5
NUMBERS = range(len(MODELS) + 4)
"""Every camera once at least, every datum several times."""


@pytest.mark.parametrize("number", NUMBERS)
def test_a_network_agrees_with_the_dense_step(number):
    """Unknowns to 1e-7 of their standard deviations, variances and redundancy numbers to 1e-8."""
    found = compare(random_network(SEED, number))
    assert found.ending in ("agree", "too weak to compare"), found


def test_a_datum_is_reached_that_its_carriers_contradict():
    """Offsets of millimetres from a plane give the only scale, of the wrong sign.

    The carriers come nowhere near to their places, and each move takes them a few per cent of the way only.
    """
    network = random_network(7, 40, "brown_forward")
    found = compare(network)
    assert found.ending == "agree", found
    result = adjust(network.block, datum=network.datum)
    assert result.verdict.code == "undetermined"
    assert any("behind the camera" in str(each) for each in result.messages)


def test_these_networks_have_every_camera_kind_and_datum():
    networks = [random_network(SEED, number) for number in NUMBERS]
    assert {model for each in networks for model in each.models} == set(MODELS)
    assert {kind for each in networks for kind in each.kinds} == set(KINDS)
    assert {each.datum_name for each in networks} == set(DATUMS)
    assert set(MODELS) == set(FORWARD) | set(BACKWARD)
    assert {each.block.geographic for each in networks} == {True, False}
    assert {camera.weights for each in networks for camera in each.block.cameras} == {"corrected", "measured"}


def test_a_wrong_cofactor_is_found():
    """The comparison can fail: with an image that weighs twice, the dense step leads away."""
    network = random_network(SEED, 0)
    block = network.block
    sd = block.image_sd.copy()
    sd[0] *= 2
    result = adjust(block.replace(image_sd=sd), datum=network.datum, tolerance=1e-8)
    dense = Dense(block, result)
    design, right = equations(dense)
    free = dense.free(result)
    step, *_ = np.linalg.lstsq(design[:, free], right, rcond=None)
    normal = design[:, free].T @ design[:, free]
    assert np.sqrt(step @ normal @ step) > 1e-3
