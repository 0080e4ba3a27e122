"""Conversion of lenses: what the new camera shows, misses, and how well it is known."""

import numpy as np
import pytest

from golden_data import shared
from message_codes import refusal
from photogram import Camera
from photogram.targets import convert_lens
from photogram.targets.mrcal import read_model

SIZE = (1280, 960)
GIVEN = {"fx": 900.0, "fy": 905.0, "cx": 640.0, "cy": 470.0, "k1": -0.2, "k2": 0.06, "p1": 1e-3, "p2": -5e-4}
FREE = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")


@pytest.fixture
def source():
    root = np.random.default_rng(2).normal(size=(8, 8)) * np.array(
        [0.3, 0.3, 0.4, 0.4, 1e-3, 3e-3, 2e-4, 2e-4]
    )
    return Camera("opencv", GIVEN, covariance=(FREE, root.T @ root / 8), name="left")


def test_the_same_lens_by_another_name_has_the_same_covariance(source):
    found = convert_lens(source, "full_opencv", SIZE, intrinsics_only=True)
    assert found.largest < 1e-7
    assert found.names[:8] == FREE
    np.testing.assert_allclose(found.camera.values[:8], source.values, rtol=1e-6, atol=1e-9)
    same = convert_lens(source, "opencv4", SIZE, intrinsics_only=True)
    np.testing.assert_allclose(same.covariance, source.covariance[1], rtol=1e-6, atol=1e-12)
    assert same.camera.covariance is not None


@pytest.mark.parametrize("distances", [(np.inf,), (2.0, 50.0)])
def test_the_covariance_is_that_of_fits_to_moved_sources(distances):
    """J of the implicit function against differences of whole fits: the misfit, which is small, bends it."""
    how = {"distances": distances, "radius": 300.0}
    names = ("fx", "fy", "cx", "cy", "k1", "k2")
    root = np.random.default_rng(2).normal(size=(6, 6)) * np.array([0.3, 0.3, 0.4, 0.4, 1e-3, 3e-3])
    values = {"fx": 900.0, "fy": 905.0, "cx": 640.0, "cy": 470.0, "k1": -0.02, "k2": 0.004}
    source = Camera("opencv_fisheye", values, covariance=(names, root.T @ root / 6))
    found = convert_lens(source, "opencv5", SIZE, **how)
    steps = 1e-3 * np.sqrt(np.diag(source.covariance[1]))
    # What a lens without tangential terms becomes has none.
    own = [k for k, name in enumerate(found.names) if name not in ("p1", "p2")]
    rows = [found.camera.names.index(found.names[k]) for k in own]
    columns = []
    for name, step in zip(names, steps, strict=True):
        ends = [
            convert_lens(
                source.replace(parameters={**source.parameters, name: source.parameters[name] + sign * step}),
                "opencv5",
                SIZE,
                **how,
            ).camera.values[rows]
            for sign in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2 * step))
    jacobian = np.column_stack(columns)
    expected = jacobian @ source.covariance[1] @ jacobian.T
    sd = np.sqrt(np.diag(expected))
    passed = found.covariance[np.ix_(own, own)]
    np.testing.assert_allclose(passed / np.outer(sd, sd), expected / np.outer(sd, sd), atol=1e-2)
    assert found.difference.fitted.finite == np.isfinite(distances[0])


def test_a_turned_camera_is_found_with_its_turn():
    """A lens whose terms cannot do what a rotation does."""
    source = Camera("pinhole", {"fx": 600.0, "fy": 600.0, "cx": 700.0, "cy": 480.0})
    stays = convert_lens(source, "simple_fisheye", SIZE, intrinsics_only=True)
    turns = convert_lens(source, "simple_fisheye", SIZE)
    assert turns.rms < stays.rms
    assert turns.difference.rotation > 0.01
    assert not turns.difference.fitted.finite
    assert stays.difference.rotation == 0
    motion = {fact.name: fact.value for fact in stays.document().highlights}["motion of the axes"]
    assert motion == "none"


def test_knots_show_any_lens():
    source = Camera("opencv", GIVEN)
    found = convert_lens(source, "splined_stereographic", SIZE, knots=(14, 11))
    assert found.camera.knots.shape == (11, 14, 2)
    assert found.largest < 0.05
    assert found.unseen == 0
    # A tenth more than what is seen.
    corner = np.abs(2 * source.rays([[0.0, 0.0]])[0, :2] / (1 - source.rays([[0.0, 0.0]])[0, 2]))
    half = 2 * np.tan(np.radians(found.camera.parameters["fov_x_deg"]) / 4)
    assert half > corner[0]
    back = convert_lens(found.camera, "opencv4", SIZE)
    np.testing.assert_allclose(back.camera.values[:4], source.values[:4], atol=0.1)


def test_a_radius_leaves_out_what_is_beyond_in_fit_and_figures():
    wide = Camera("stereographic", {"fx": 500.0, "fy": 500.0, "cx": 639.5, "cy": 479.5})
    whole, inner = (convert_lens(wide, "opencv5", SIZE, radius=reach) for reach in (np.inf, 300.0))
    assert inner.largest < 0.1 * whole.largest
    column, row = inner.where
    assert np.hypot(column - 639.5, row - 479.5) <= 300
    assert inner.within(inner.largest)
    assert not inner.within(0.9 * inner.largest)


def test_what_makes_no_sense_is_refused(source):
    for changes, message in (
        ({"distances": ()}, "error.at what=distances message=error.positive value=none"),
        ({"distances": (-1.0,)}, "error.at what=distances message=error.positive value=-1.0"),
        ({"distances": (1.0, np.inf)}, "targets.infinite"),
        ({"radius": 1.0}, "targets.shows-nothing model=opencv5 camera=left"),
        ({"covariance": (["f"], [[1.0]])}, "targets.no-parameters model=opencv names=['f']"),
        ({"covariance": (["fx"], [[-1.0]])}, "error.covariance-singular"),
    ):
        with refusal(message):
            convert_lens(source, "opencv5", SIZE, **changes)
    with refusal("targets.knots order=3.0 least=4.0"):
        convert_lens(source, "splined_stereographic", SIZE, knots=(3, 9))
    with refusal("targets.no-focal camera=perspective model=perspective"):
        convert_lens(Camera("perspective", {"c": -50.0}), "opencv5", SIZE)


def test_the_wide_lens_of_mrcal_as_a_leaner_one():
    calibration = read_model(shared("targets", "opencv8-0.cameramodel"))
    camera, size = calibration.cameras[0].replace(sd=0.0), calibration.corners.sizes[0]
    whole = convert_lens(camera, "opencv_fisheye", size)
    assert 1 < whole.rms < 10 < whole.largest
    assert whole.where[0] in (0.0, 6015.0)
    assert convert_lens(camera, "opencv5", size, radius=1500).largest < 0.1
