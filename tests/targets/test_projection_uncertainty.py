"""Uncertainty of projection in every datum against an independent program and mrcal."""

import numpy as np
import pytest
from given_targets import golden
from golden_calibrations import opencv8, rig_small

from photogram.targets.housing import datum_rows, projection_cofactors

DISTANCES = {"infinity": np.inf, "1 m": 1.0}


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize("datum", ["mean-frames", "corners"])
def test_maps_of_a_rig(camera, distance, datum):
    data, housing = golden("rig_small")["uncertainty"], rig_small()
    found = projection_cofactors(
        housing, camera, np.array(data["pixels"]), DISTANCES[distance], datum_rows(housing, camera, datum)
    )
    expected = np.array(data[f"camera {camera}, {distance}"][f"{datum.replace('-', '_')}_cofactors"])
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("datum", ["mean-frames", "corners"])
def test_maps_of_a_wide_lens(distance, datum):
    data, housing = golden("mrcal_opencv8")["uncertainty"], opencv8()
    rows, pixels = datum_rows(housing, 0, datum), np.array(data["pixels"])
    found = projection_cofactors(housing, 0, pixels, DISTANCES[distance], rows)
    expected = np.array(data[distance][f"{datum.replace('-', '_')}_cofactors"])
    print((np.abs(found - expected).max(axis=(1, 2)) / np.abs(expected).max(axis=(1, 2))).max())
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_cofactors_of_normal_equations():
    found = golden("mrcal_opencv8")["with_regularisation"]
    expected, housing = np.array(found["cofactors_common"]), opencv8()
    sd = np.sqrt(np.diag(expected))
    print(np.abs((housing.cofactors[:14, :14] - expected) / np.outer(sd, sd)).max())


@pytest.mark.parametrize("distance", DISTANCES)
def test_noise_only_is_what_mrcal_says(distance):
    data, housing = golden("mrcal_opencv8")["uncertainty"], opencv8().noise_only()
    rows, pixels = datum_rows(housing, 0, "mean-frames"), np.array(data["pixels"])
    found = housing.variance * projection_cofactors(housing, 0, pixels, DISTANCES[distance], rows)
    for source, tolerance in (("mrcal_2_2", 2e-6), ("own", 1e-6)):
        expected = np.array(data[distance][f"mean_frames_covariance_{source}"])
        largest = np.abs(expected).max(axis=(1, 2))
        print((np.abs(found - expected).max(axis=(1, 2)) / largest).max())
        assert (np.abs(found - expected).max(axis=(1, 2)) < tolerance * largest).all()
