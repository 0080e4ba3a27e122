"""What is computed of an adjusted calibration, as users ask for it."""

import io
from functools import cache

import given_targets
import numpy as np
import pytest
from given_targets import golden
from golden_calibrations import adjusted_rig

from golden_data import shared
from message_codes import refusal
from photogram import Camera, variance_components
from photogram.targets import (
    difference,
    distance_uncertainty,
    plot_uncertainty_curve,
    projection_uncertainty,
    read,
    suggest_views,
    triangulate,
    uncertainty_against_distance,
    uncertainty_map,
)
from photogram.targets.drawing import steps_of_125
from photogram.targets.housing import datum_rows, housing_of
from photogram.targets.new_views import candidate_views
from photogram.targets.vision import imaged, rays

PIXELS = [[40.0, 40.0], [640.0, 480.0]]


@pytest.fixture(scope="module")
def calibrated():
    golden("rig_small")
    return adjusted_rig()


def test_covariances_at_pixels_are_the_golden_ones(calibrated):
    expected = golden("rig_small")["uncertainty"]
    found = projection_uncertainty(calibrated, "right", expected["pixels"], 1.0, "mean-frames")
    cofactors = np.array(expected["camera 1, 1 m"]["mean_frames_cofactors"])
    scale = calibrated.covariance_scale
    assert np.abs(found / scale - cofactors).max() < 1e-6 * cofactors.max()


def test_a_datum_of_the_image_moves_its_rays_least(calibrated):
    """Along its own motion the sum of squares over the picture is least, so smaller than in any other."""

    def total(datum):
        pixels = np.stack(np.meshgrid(np.linspace(0, 1279, 60), np.linspace(0, 959, 40)), axis=-1)
        found = projection_uncertainty(calibrated, 0, pixels.reshape(-1, 2), 1.0, datum)
        return np.trace(found, axis1=1, axis2=2).sum()

    assert total("image") < min(map(total, ("corners", "mean-frames", "axes")))


def test_axes_of_the_camera_are_its_parameters_alone(calibrated):
    housing, camera = housing_of(calibrated, 0)
    own = housing.parameters(camera)
    partials = imaged(housing.cameras[camera], rays(housing.cameras[camera], np.array(PIXELS))).by_parameters
    expected = housing.variance * partials @ housing.cofactors[own, own] @ partials.transpose(0, 2, 1)
    assert projection_uncertainty(calibrated, 0, PIXELS, datum="axes") == pytest.approx(expected)
    assert not datum_rows(housing, camera, "axes").any()


def test_noise_alone_is_less(calibrated):
    whole = projection_uncertainty(calibrated, 0, PIXELS)
    noise = projection_uncertainty(calibrated, 0, PIXELS, noise_only=True)
    assert (np.linalg.eigvalsh(whole - noise) > 0).all()


def test_maps_are_arrays_and_files(calibrated):
    found = uncertainty_map(calibrated, "left", 1.0, (12, 8))
    assert found.sd.shape == (8, 12)
    assert found.pixels[-1, -1].tolist() == [1279, 959]
    assert np.nanmin(found.sd) < found.largest <= np.nanmax(found.sd)
    assert not found.inside[-1, 0]
    assert found.title == "left: standard deviation of projection at 1 m (datum corners), px"
    arrays = np.load(io.BytesIO(found.to_npz()))
    assert (arrays["sd"] == found.sd).all()
    lines = found.to_csv().decode().splitlines()
    assert lines[0] == "column,row,sd,variance_column,covariance,variance_row"
    assert len(lines) == 97


def test_uncertainty_is_smallest_about_where_boards_were(calibrated):
    found = uncertainty_against_distance(calibrated, 0, (40, 40), [*np.geomspace(0.05, 50, 40), np.inf])
    away = np.linalg.norm(calibrated.poses[:, :3, 3], axis=1)
    assert away.min() < found.minimum[0] < 2 * away.max()
    assert found.sd[-1] == pytest.approx(found.sd[-2], rel=0.02)
    line, across, least = plot_uncertainty_curve(found).panels[0].marks
    assert (np.diff(line.places[:, 0]) > 0).all()
    assert len(line.places) == 40
    assert across.places[0, 1] == found.sd[-1]
    assert tuple(least.places[0]) == found.minimum


def test_two_calibrations_of_the_same_corners_are_not_independent(calibrated):
    found = difference(calibrated, calibrated, grid=(6, 4))
    assert found.shared == 1
    assert found.test is None
    assert found.largest < 1e-6
    assert "lower bound" in " ".join(found.remarks)


def test_a_known_difference_is_found(calibrated):
    """A camera that has turned, and whose lens has changed in nothing else, does not differ."""
    camera = calibrated.cameras[0].camera
    other = camera.replace(parameters={**camera.parameters, "cx": camera.parameters["cx"] + 1.0})
    found = difference(camera, other, (0.5, 5.0), size=(1280, 960), grid=(30, 20))
    assert found.rotation == pytest.approx(np.degrees(1 / camera.parameters["fx"]), rel=0.05)
    assert found.rms < 0.2
    assert "without covariances" in " ".join(found.remarks)
    one = difference(camera, other, 1.0, size=(1280, 960), grid=(30, 20))
    assert "a near and a far one" in " ".join(one.remarks)


def test_triangulated_points_are_the_golden_ones(calibrated):
    expected = golden("rig_small")["triangulation"]
    pixels = [[each["pixel_0"], each["pixel_1"]] for each in expected]
    found = triangulate(calibrated, ("left", "right"), pixels, 0.3)
    assert found.points == pytest.approx(np.array([each["point"] for each in expected]), rel=1e-6, abs=1e-7)
    turned = triangulate(calibrated, ("right", "left"), np.array(pixels)[:, ::-1], 0.3)
    assert turned.points == pytest.approx(found.points, abs=1e-9)
    seen, over = distance_uncertainty(calibrated, ("left", "right"), 1.0, 0.3)
    assert len(seen) == len(over.points) > 300
    assert over.points[:, 2] == pytest.approx(1.0)
    assert (over.sd_of_distances > 0).all()


def test_views_to_take_next(calibrated):
    housing, camera = housing_of(calibrated, 0)
    every = candidate_views(housing, camera, (1280, 960), calibrated.calibration.board)
    # Its pictures show the whole board, and so do views of it.
    assert 300 < len(every) < 600
    assert every[0].name.startswith("upper left corner, 0.")
    names = {each.name.partition(", 0.")[0] for each in every}
    assert {"left edge, above the middle", "lower edge", "below the middle and right of the middle"} <= names
    found = suggest_views(calibrated, candidates=every[::40], views=2)
    assert len(found.views) == 2
    assert found.before.max() > found.views[0].largest > found.views[1].largest
    assert found.sentences[0].endswith(f"-> {found.views[0].largest:.3g} px")


def test_what_is_refused(calibrated):
    for refused, words in (
        (
            lambda: projection_uncertainty(calibrated, 2, PIXELS),
            "error.unknown kind=camera name=2 names=['left', 'right']",
        ),
        (
            lambda: projection_uncertainty(calibrated, "up", PIXELS),
            "error.unknown kind=camera name=up names=['left', 'right']",
        ),
        (
            lambda: projection_uncertainty(calibrated, 0, PIXELS, -1.0),
            "error.at what=distance message=error.positive value=-1.0",
        ),
        (lambda: projection_uncertainty(calibrated, 0, PIXELS, datum="board"), "datum"),
        (lambda: projection_uncertainty(calibrated, 0, [1.0, 2.0]), "pixels"),
        (lambda: triangulate(calibrated, (0, 0), [PIXELS], 0.3), "targets.two-cameras-once"),
        (
            lambda: triangulate(calibrated, (0, 1), [PIXELS], 0.0),
            "error.at what=pixel_sd message=error.positive value=0.0",
        ),
        (
            lambda: difference(Camera("pinhole", {"fx": 1, "fy": 1, "cx": 0, "cy": 0}), calibrated),
            "error.at what=size message=error.empty",
        ),
        (lambda: difference(calibrated, 3), "b"),
        (lambda: difference(calibrated, calibrated, []), "error.at what=distance message=error.empty"),
    ):
        with refusal(words):
            refused()


@pytest.mark.parametrize("distance", ["infinity", "1 m"])
@pytest.mark.parametrize("camera", [0, 1])
def test_maps_with_a_board_of_two_parabolas(camera, distance):
    expected = golden("rig_small")["uncertainty_two_parabolas_mean_frames"][f"camera {camera}, {distance}"]
    found = bent_rig()
    pixels = golden("rig_small")["uncertainty"]["pixels"]
    away = np.inf if distance == "infinity" else 1.0
    own = projection_uncertainty(found, camera, pixels, away, "mean-frames") / found.covariance_scale
    cofactors = np.array(expected["cofactors"])
    largest = np.abs(cofactors).max(axis=(1, 2))
    assert (np.abs(own - cofactors).max(axis=(1, 2)) < 1e-6 * largest).all()


@cache
def bent_rig():
    return given_targets.rig_small("bend").adjust()


def test_the_file_of_mrcal_gives_its_map():
    """Corners, board, start and priors of a `.cameramodel`: the uncertainty that mrcal computes of it."""
    data = golden("mrcal_opencv8")["uncertainty"]
    found = read(shared("targets", "opencv8-0.cameramodel")).adjust()
    scale = found.covariance_scale
    for name, distance in (("infinity", np.inf), ("1 m", 1.0)):
        own = projection_uncertainty(found, 0, data["pixels"], distance, "mean-frames", noise_only=True)
        expected = np.array(data[name]["mean_frames_covariance_mrcal_2_2"]) / data["sigma"] ** 2
        largest = np.abs(expected).max(axis=(1, 2))
        assert (np.abs(own / scale - expected).max(axis=(1, 2)) < 2e-6 * largest).all()
        own = projection_uncertainty(found, 0, data["pixels"], distance)
        expected = np.array(data[name]["corners_cofactors"])
        assert np.abs(own / scale - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("low", "high", "steps"),
    [(0.06, 0.3, [0.05, 0.1, 0.2, 0.5]), (1.0, 1.0, [1.0, 2.0]), (3.0, 12.0, [2.0, 5.0, 10.0, 20.0])],
)
def test_contours_enclose_what_they_show(low, high, steps):
    assert steps_of_125(low, high) == pytest.approx(steps)


def test_cameras_and_levels_have_variance_components(calibrated):
    """Corners of the golden data are drawn with 0.3 px times 2^level."""
    block = calibrated.calibration.block()
    levels = [f"level {level:.0f}" for level in np.log2(block.image_sd[:, 0] / block.image_sd.min())]
    for groups, count in (("camera", 2), ({"images": levels}, len(set(levels)))):
        found = variance_components(block, groups).estimate
        assert found.converged
        assert len(found.factors) >= count
        assert all(each.held or 0.7 < each.factor < 1.4 for each in found.components)
