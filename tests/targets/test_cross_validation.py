"""Cross-validation: differences of parts and their covariance, against an independent program."""

import numpy as np
import pytest
from given_targets import golden
from golden_calibrations import adjusted_rig

from message_codes import refusal
from photogram.targets import cross_validate
from photogram.targets.cross_validation import changes_between, parts_agree, splits


@pytest.fixture(scope="module")
def expected():
    return golden("rig_small")["cross_validation"]


@pytest.fixture(scope="module")
def found():
    return cross_validate(adjusted_rig())


def test_parts_are_the_golden_ones(found, expected):
    assert found.parts[0] == (tuple(range(0, 20, 2)), tuple(range(1, 20, 2)))
    for housing, half in zip(found.housings[0], expected["halves"], strict=True):
        for camera, values in zip(housing.cameras, half["cameras"], strict=True):
            assert camera.values == pytest.approx(values, rel=1e-6, abs=1e-7)
        cofactors = np.array(half["cofactors_camera_sensor"])
        sd = np.sqrt(np.diag(cofactors))
        assert np.abs((housing.cofactors[:22, :22] - cofactors) / np.outer(sd, sd)).max() < 1e-6


def test_the_difference_and_its_cofactors(found, expected):
    change, cofactors = changes_between(*found.housings[0])
    sd = np.sqrt(np.diag(np.array(expected["cofactors_of_difference"])))
    assert np.abs((change[:22] - expected["difference"]) / sd).max() < 1e-4
    assert np.abs((cofactors[:22, :22] - expected["cofactors_of_difference"]) / np.outer(sd, sd)).max() < 1e-5


def test_chi2(found, expected):
    tests = parts_agree(*found.housings[0], found.cameras)
    assert [each.dof for each in tests] == [8, 8, 22]
    assert [each.chi2 for each in tests] == pytest.approx(list(expected["chi2"].values()), rel=1e-4)
    assert found.explained
    assert "explained" in found.verdict
    pooled = [each.chi2 / own.chi2 for each, own in zip(tests, found.tests[0], strict=True)]
    assert pooled == pytest.approx([pooled[0]] * 3)
    assert 0.9 < pooled[0] < 1.1


@pytest.mark.parametrize("camera", [0, 1])
@pytest.mark.parametrize(("name", "distance"), [("infinity", np.inf), ("1 m", 1.0)])
def test_maps(found, expected, camera, name, distance):
    pixels = np.array(golden("rig_small")["uncertainty"]["pixels"])
    own = found.map(camera, pixels, distance)
    golden_map = expected["maps"][f"camera {camera}, {name}"]
    cofactors = np.array(golden_map["cofactors"])
    variance = found.whole.variance
    assert np.abs(own.covariances / variance - cofactors).max() < 1e-5 * cofactors.max()
    assert own.chi2 * variance == pytest.approx(golden_map["chi2_of_two"], rel=1e-3)
    assert np.abs(own.differences - golden_map["difference_linear"]).max() < 1e-3 * np.sqrt(cofactors.max())


def test_views_are_split_as_asked_for():
    assert splits(5, "odd") == [([0, 2, 4], [1, 3])]
    assert splits(5, "halves") == [([0, 1], [2, 3, 4])]
    assert splits(5, 2) == [([1, 3], [0, 2, 4]), ([0, 2, 4], [1, 3])]


def test_folds_and_what_is_refused():
    found = cross_validate(adjusted_rig(), 4)
    assert len(found.tests) == 4
    assert 0.5 < found.factor < 1.6
    with refusal("targets.few-views views=20 into=15 least=3"):
        cross_validate(adjusted_rig(), 15)
    with refusal("error.at what=into message=error.least low=2 value=1"):
        cross_validate(adjusted_rig(), 1)


def test_a_lens_that_is_too_stiff_is_told():
    """Cameras without distortion: parts differ by more than their residuals say."""
    whole = adjusted_rig().calibration
    held = {"k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}
    cameras = [
        each.replace(
            parameters={**each.parameters, **held}, sd=dict.fromkeys(("fx", "fy", "cx", "cy"), np.inf)
        )
        for each in whole.cameras
    ]
    found = cross_validate(whole.replace(cameras=cameras).adjust())
    print(found)
    assert not found.explained
    assert found.factor > 1.5
    assert "too small by about" in found.verdict
