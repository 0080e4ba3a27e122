"""Adjusted calibrations as arrays of a housing, against an independent program."""

import numpy as np
import pytest
from golden_calibrations import adjusted_rig, rig_small

from photogram.targets.housings import housing_of


def test_a_rig_has_the_arrays_of_the_golden_one():
    found, camera = housing_of(adjusted_rig(), 1)
    expected = rig_small()
    assert camera == 1
    sd = np.sqrt(np.diag(expected.cofactors))
    assert np.abs((found.cofactors - expected.cofactors) / np.outer(sd, sd)).max() < 1e-6
    assert found.weights == pytest.approx(expected.weights)
    assert found.points == pytest.approx(expected.points, abs=1e-10)
    assert found.poses == pytest.approx(expected.poses, abs=1e-9)
    assert found.seen.sd.sum() == pytest.approx(expected.seen.sd.sum())


def test_it_is_made_once():
    assert housing_of(adjusted_rig(), 0)[0] is housing_of(adjusted_rig(), 1)[0]
