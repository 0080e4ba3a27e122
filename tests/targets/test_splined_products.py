"""Uncertainty and differences of splined lenses, against mrcal and an independent program."""

from functools import cache

import numpy as np
import pytest
from given_targets import golden
from golden_calibrations import stored

from photogram import Camera
from photogram.targets import Board, Calibration, Corners, projection_uncertainty
from photogram.targets.calibration_difference import differences_at
from photogram.targets.lens_fit import fitted_motion
from photogram.targets.uncertainty import image_grid
from photogram.targets.vision import composed, imaged, touched

ACROSS = 10.0
"""mrcal holds knots so much tighter across the radius than along it."""


@cache
def splined():
    """Return the golden splined lens, adjusted from knots that are 0 with the priors of mrcal."""
    data = golden("splined")["adjusted"]
    view, point, *xy = np.array(data["corners"]).T
    model, scale = data["model"], data["regularisation_scale"]
    core = dict(zip(("fx", "fy", "cx", "cy"), data["core_held"], strict=True))
    knot_sd = np.broadcast_to([1 / scale, 1 / (ACROSS * scale)], (model["ny"], model["nx"], 2))
    start, board = data["start"], data["board"]
    views = len(start["t"])
    return Calibration(
        board=Board(columns=board["columns"], rows=board["rows"], spacing=board["spacing"], shape="bend"),
        corners=Corners(
            pictures=[f"view{number}" for number in range(views)],
            cameras=np.zeros(views, dtype=int),
            views=np.arange(views),
            camera_names=["own"],
            sizes=[tuple(data["image"])],
            picture=view.astype(int),
            point=point.astype(int),
            xy=np.column_stack(xy),
            sd=np.ones(len(view)),
        ),
        cameras=[Camera("splined_stereographic", core | model, name="own", knot_sd=knot_sd)],
        poses=composed(np.array(start["R"]), np.array(start["t"])),
    ).adjust()


@pytest.mark.parametrize(("name", "distance"), [("infinity", np.inf), ("1 m", 1.0)])
@pytest.mark.parametrize(
    ("datum", "noise_only", "key"),
    [
        ("mean-frames", False, "mean_frames_cofactors"),
        ("mean-frames", True, "mean_frames_cofactors_noise_only"),
        ("corners", False, "corners_cofactors"),
    ],
)
def test_maps(name, distance, datum, noise_only, key):
    data, found = golden("splined")["adjusted"]["uncertainty"], splined()
    own = projection_uncertainty(found, 0, data["pixels"], distance, datum, noise_only)
    own = own / found.covariance_scale
    expected = np.array(data[name][key])
    largest = np.abs(expected).max(axis=(1, 2))
    assert (np.abs(own - expected).max(axis=(1, 2)) < 1e-6 * largest).all()


@cache
def of_mrcal(name):
    """Return the camera of a file of mrcal as it was stored."""
    given = stored(name)
    values = given["intrinsics"][0].tolist()
    if name == "opencv8-0":
        names = list(golden("mrcal_opencv8")["with_regularisation"]["intrinsics"])
        return Camera("opencv_pinhole", dict(zip(names, values, strict=True)))
    core = dict(zip(("fx", "fy", "cx", "cy"), values[:4], strict=True))
    model = {"order": 3, "nx": 30, "ny": 20, "fov_x_deg": 170}
    return Camera("splined_stereographic", core | model, knots=np.reshape(values[4:], (20, 30, 2)))


EQUAL = "equal weights, radius 1000"


@pytest.mark.parametrize(
    ("name", "distances", "tolerance"),
    [
        (f"infinity, {EQUAL}", {"infinity": np.inf}, 1e-3),
        (f"1 m, {EQUAL}", {"1 m": 1.0}, 0.3),
        (f"1 m and 1000 m, {EQUAL}", {"1 m": 1.0, "1000 m": 1000.0}, 3e-3),
        (f"infinity, {EQUAL}, splined-0 to opencv8-0", {"infinity": np.inf}, 1e-3),
    ],
)
def test_differences(name, distances, tolerance):
    data = golden("mrcal_difference")
    a, b = of_mrcal("opencv8-0"), of_mrcal("splined-0")
    if name.endswith("to opencv8-0"):
        a, b = b, a
    pixels = image_grid((6016, 4016), (60, 40))[2]
    near = pixels[np.hypot(*(pixels - [3007.5, 2007.5]).T) < 1000]
    assert len(near) == 300
    for criterion, key, within in (
        ("mrcal", "mrcal_2_2", tolerance),
        ("pixels", "own_least_squares_of_pixels", 1e-5),
    ):
        fitted = fitted_motion(a, b, near, list(distances.values()), criterion)
        for label, distance in distances.items():
            expected = np.array(data["differences"][name][key]["difference"][label])
            found = differences_at(a, b, fitted, np.array(data["pixels"]), [distance])
            compared = np.hypot(*expected.T) < 50
            assert compared.sum() >= 19
            assert np.abs(found - expected)[compared].max() < within


@pytest.mark.parametrize("order", [2, 3])
def test_partials_without_zeros_are_those_with_them(order):
    """Of unknown knots alone, and of parameters that are unknown beside them."""
    sd = np.full((8, 11, 2), 0.1)
    sd[2:5, 3:6] = 0.0
    camera = Camera(
        "splined_stereographic",
        {"fx": 700.0, "fy": 705.0, "cx": 640.0, "cy": 480.0}
        | {"order": order, "nx": 11, "ny": 8, "fov_x_deg": 120.0},
        sd={"fx": 1.0, "cy": 1.0},
        knots=np.random.default_rng(5).normal(0.0, 0.02, (8, 11, 2)),
        knot_sd=sd,
    )
    points = np.random.default_rng(6).normal([0.0, 0.0, 1.5], 0.4, (50, 3))
    expected, found = imaged(camera, points), touched(camera, points)
    np.testing.assert_array_equal(found.xy, expected.xy)
    np.testing.assert_array_equal(found.by_point, expected.by_point)
    assert found.columns.shape == (50, 2 + 2 * (order + 1) ** 2)
    spread = np.zeros_like(expected.by_parameters)
    for k, columns in enumerate(found.columns.T):
        spread[np.arange(50), :, columns] += found.by_parameters[:, :, k]
    np.testing.assert_array_equal(spread, expected.by_parameters)
