"""Lenses of all-sky cameras: each comes back from its own exposures, and the data choose among them."""

from dataclasses import replace

import numpy as np
import pytest

from example_scripts import load
from message_codes import coded
from photogram import InputError, _photocore
from photogram.stellar import LENSES, SkyCamera, apparent_places, calibrate_night, project_sky, sidereal_time
from photogram.stellar.night_document import lenses as lens_table
from photogram.stellar.sky_calibration import partials

allsky = load("all_sky_camera")
FISHEYES = ("equidistant", "equisolid", "stereographic", "kannala_brandt")


def off(result, lens):
    """Return the camera minus the true one in mean errors, held parameters as zero."""
    sd = np.sqrt(np.diag(result.camera.covariance))
    return (result.camera.values - allsky.camera(lens).values) / np.where(sd > 0, sd, 1.0)


@pytest.mark.parametrize("lens", FISHEYES)
def test_a_fisheye_comes_back(lens):
    night, stars = allsky.night(lens, 7)
    result = calibrate_night(night)
    assert result.usable
    assert result.names == night.names
    assert np.abs(off(result, lens)).max() < 3.5
    assert result.calibration.mean_error == pytest.approx(1.0, abs=0.08)
    for exposure, right in zip(result.exposures, stars, strict=True):
        taken = exposure.stars >= 0
        assert (exposure.stars == right)[taken].mean() > 0.99
        assert taken[right >= 0].mean() > 0.97
    sd = np.sqrt(np.einsum("eii->ei", result.calibration.attitude_covariances))
    assert np.abs((result.calibration.attitudes - allsky.ATTITUDE) / sd).max() < 4
    total = result.calibration.redundancy.sum()
    assert total == pytest.approx(result.calibration.degrees_of_freedom, rel=1e-9)


@pytest.mark.parametrize("lens", LENSES)
def test_the_data_choose_the_lens(lens):
    """Among all of them, decisively; begun with another one than the true one."""
    start = SkyCamera.of_field(*allsky.FRAME, allsky.field_of(lens), "kannala_brandt")
    night, _ = allsky.night(lens, 8, start, lenses=tuple(LENSES))
    result = calibrate_night(night)
    assert result.camera.lens == lens
    assert np.abs(off(result, lens)).max() < 3.5
    first, second = result.lenses[:2]
    assert (first.lens, first.reason) == (lens, "")
    assert second.bic - first.bic > 10
    assert first.images == second.images
    assert [column.values[0] for column in lens_table(result).columns[:2]] == [lens, first.parameters]


def test_a_lens_that_does_not_see_so_much_says_so():
    with pytest.raises(
        InputError, check=coded("stars.field-of-view", field=208.5, lens="brown", widest=180.0)
    ):
        SkyCamera.of_field(*allsky.FRAME, np.radians(208.5))
    with pytest.raises(InputError, check=coded("error.unknown", kind="lens", name="fish")):
        SkyCamera.of_field(*allsky.FRAME, 1.0, "fish")
    with pytest.raises(InputError, check=coded("stars.parameters", lens="equidistant")):
        SkyCamera(np.zeros(9), np.zeros((9, 9)), "equidistant")


@pytest.mark.parametrize("lens", LENSES)
def test_an_ideal_lens_shows_the_edge_at_half_its_field(lens):
    camera = SkyCamera.of_field(3000.0, 2000.0, 2.0, lens)
    left, right, axis = camera.rays(np.array([[0.0, 1000.0], [3000.0, 1000.0], [1500.0, 1000.0]]))
    assert np.arccos([left[2], right[2]]) == pytest.approx([1.0, 1.0], abs=1e-12)
    assert right[0] > 0 > left[0]
    assert axis == pytest.approx([0, 0, 1], abs=1e-12)
    down = camera.rays(np.array([[1500.0, 2000.0]]))[0]
    assert down[1] > 0


def test_cameras_of_lenses_come_back_from_their_files_and_in_blocks(tmp_path):
    night, _ = allsky.night("kannala_brandt", 9, common_scale=True)
    camera = calibrate_night(replace(night, exposures=night.exposures[:2], names=night.names[:2])).camera
    file = tmp_path / "camera.json"
    file.write_bytes(camera.to_json())
    again = SkyCamera.read(file)
    assert (again.lens, again.common_scale) == ("kannala_brandt", True)
    assert again.values.tolist() == camera.values.tolist()
    assert again.covariance.tolist() == camera.covariance.tolist()
    assert camera.values[0] == camera.values[1]
    assert camera.covariance[1].tolist() == [0.0] * 8
    of_blocks = again.as_camera("sky")
    assert of_blocks.model == "opencv_fisheye"
    names, matrix = of_blocks.covariance
    assert names[:2] == ("fx", "fy")
    assert matrix[0, 1] == pytest.approx(camera.covariance[0, 0])
    # With the lens as prior the same images give half the covariance.
    both = calibrate_night(replace(night, camera=again, prior=again))
    assert both.camera.covariance[0, 0] < 0.75 * camera.covariance[0, 0]
    with pytest.raises(InputError, check=coded("stars.prior-lens")):
        calibrate_night(replace(night, camera=again, prior=again, common_scale=False))
    file.write_bytes(SkyCamera.of_field(10, 10, 1.0).to_json().replace(b"brown camera", b"red camera"))
    with pytest.raises(
        InputError, check=coded("error.choice", value="red camera", names=["brown camera", "sky camera"])
    ):
        SkyCamera.read(file)


@pytest.mark.parametrize("model", ["equisolid", "stereographic"])
def test_projections_and_their_ways_back(model):
    """Theta goes to 2 sin(theta/2) and 2 tan(theta/2); partials against differences."""
    theta, turn = np.linspace(0.0, 2.6, 40), np.linspace(0.0, 6.0, 40)
    sine = np.sin(theta)
    u = np.column_stack([sine * np.cos(turn), -sine * np.sin(turn), -np.cos(theta)])
    values = np.array([1.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    radius = {"equisolid": 2 * np.sin(theta / 2), "stereographic": 2 * np.tan(theta / 2)}[model]
    seen = _photocore.camera_images(model, values, u)
    assert seen == pytest.approx(radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]), abs=1e-12)
    assert _photocore.camera_rays(model, values, seen) == pytest.approx(u, abs=1e-9)
    values = np.array([900.0, 905.0, 500.0, 400.0, -0.02, 0.003])
    scale = 1 + 0.3 * np.cos(turn)[:, None]
    xy, by_u, by_parameters = _photocore.camera_partials(model, values, u * scale)
    assert xy == pytest.approx(_photocore.camera_images(model, values, u), abs=1e-9)
    for k in range(3):
        step = np.eye(3)[k] * 1e-6
        ends = [_photocore.camera_images(model, values, u * scale + sign * step) for sign in (1, -1)]
        assert by_u[:, :, k] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-3)
    for k in range(6):
        step = np.eye(6)[k] * 1e-6
        ends = [_photocore.camera_images(model, values + sign * step, u) for sign in (1, -1)]
        assert by_parameters[:, :, k] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("common_scale", [False, True])
@pytest.mark.parametrize("lens", LENSES)
def test_partials_of_every_lens_are_those_of_its_images(lens, common_scale):
    """By attitude and camera, against differences of projected stars."""
    truth = replace(allsky.camera(lens), common_scale=common_scale)
    exposures, stars, bright = allsky.exposures(lens, np.random.default_rng(1), count=1)
    exposure = replace(exposures[0], stars=stars[0])
    by_attitude, by_camera = partials([exposure], truth, allsky.SITE, bright)
    places = apparent_places(bright, exposure.utc)[stars[0][stars[0] >= 0]]
    time = sidereal_time(allsky.SITE, exposure.utc)

    def seen(camera, attitude):
        return project_sky(camera, attitude, allsky.SITE, places, time)

    for k in range(3):
        step = np.eye(3)[k] * 1e-6
        ends = [seen(truth, exposure.attitude + sign * step) for sign in (1, -1)]
        assert by_attitude[:, :, k] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-3)
    for k in range(len(truth.values)):
        size = 1e-3 if k < 4 else 1e-6
        step = np.eye(len(truth.values))[k] * size
        ends = [
            seen(replace(truth, values=truth.values + sign * step), exposure.attitude) for sign in (1, -1)
        ]
        expected = (ends[0] - ends[1]) / (2 * size)
        if common_scale and k == 1:
            assert not expected.any()
        assert by_camera[:, :, k] == pytest.approx(expected, rel=1e-5, abs=1e-4)


def test_distortion_of_a_fisheye():
    """The curve over the angle is the effect of the terms; a lens without terms has none."""
    night, _ = allsky.night("kannala_brandt", 7)
    (found,) = calibrate_night(night)._plot_data().distortion
    theta = found.radii / 950
    change = 950 * theta * (0.03 * theta**2 - 0.01 * theta**4 + 0.004 * theta**6 - 6e-4 * theta**8)
    inside = found.radii <= found.observed
    assert found.curves[0].values[inside] == pytest.approx(change[inside], abs=0.5)
    night, _ = allsky.night("equisolid", 7)
    assert calibrate_night(night)._plot_data().distortion == []
