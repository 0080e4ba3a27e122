"""Points from two cameras, with errors of pixels and calibration, against an independent program."""

import numpy as np
import pytest
from given_targets import golden
from golden_calibrations import rig_small

from photogram.targets.housing import housing_rows
from photogram.targets.triangulation import triangulated

SD = 0.3


def _pixels(data):
    return np.array([[each["pixel_0"], each["pixel_1"]] for each in data])


def _close(found, expected, tolerance=1e-6):
    expected = np.array(expected)
    return np.abs(found - expected).max() < tolerance * np.abs(expected).max()


@pytest.mark.parametrize("datum", ["axes_of_camera_0", "corners"])
def test_points_and_both_parts_of_their_covariance(datum):
    data, housing = golden("rig_small")["triangulation"], rig_small()
    still = housing_rows(housing) if datum == "corners" else None
    found = triangulated(housing, (0, 1), _pixels(data), SD, still)
    for row, each in enumerate(data):
        own = slice(3 * row, 3 * row + 3)
        assert _close(found.points[row], each["point"], 1e-9)
        assert _close(found.by_pixels[row], each["covariance_of_pixels_sd_0_3"])
        assert _close(found.by_calibration[own, own], each[f"cofactors_of_calibration_{datum}"])
        if datum == "axes_of_camera_0":
            sd = each["sd_of_distance"]
            assert found.sd_of_distances[row] == pytest.approx([sd["pixels"], sd["calibration"]], rel=1e-6)
    assert _close(found.covariance[:3, 3:6], found.by_calibration[:3, 3:6])


def test_rays_that_do_not_meet_have_no_point():
    apart = [[20.0, 480.0], [1200.0, 480.0]]  # rays that intersect behind the cameras
    pixels = np.array([[[640.0, 480.0], [20.0, 900.0]], [[np.nan] * 2] * 2, apart])
    for found in (
        triangulated(rig_small(), (0, 1), pixels, SD),
        triangulated(rig_small(), (0, 1), pixels[1:], SD),
    ):
        assert np.isnan(found.points[-2:]).all()
        assert np.isnan(found.by_pixels[-2:]).all()
