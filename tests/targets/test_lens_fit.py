"""Lenses fitted to what other lenses show."""

import numpy as np
import pytest

from message_codes import refusal
from photogram import Camera
from photogram.targets.lens_fit import fitted, grid_of_pixels, is_perspective

SIZE = (6016, 4016)
STEREOGRAPHIC = Camera("stereographic", {"fx": 1965, "fy": 1965, "cx": 3005, "cy": 2000}, name="wide")


def largest(source, found, size=SIZE):
    xy = grid_of_pixels(size)
    rays = source.rays(xy)
    return np.nanmax(np.linalg.norm(found.project(rays) - xy, axis=1))


@pytest.mark.parametrize(
    ("model", "pixels"),
    [
        ("eucm", 1e-9),
        ("opencv_fisheye", 0.02),
        ("opencv8", 4.0),
        ("agisoft_fisheye", 0.02),
        ("division", 1e-9),
    ],
)
def test_a_wide_lens_is_shown_by_others(model, pixels):
    found = fitted(STEREOGRAPHIC, model, SIZE)
    assert largest(STEREOGRAPHIC, found) < pixels
    assert found.name == "wide"


@pytest.mark.parametrize("model", ["opencv5", "opencv8", "full_opencv", "agisoft_frame"])
def test_the_same_lens_by_another_name_is_the_same(model):
    given = {"fx": 900, "fy": 905, "cx": 640, "cy": 470, "k1": -0.2, "k2": 0.06, "p1": 1e-3, "p2": -5e-4}
    source = Camera("opencv", given)
    assert largest(source, fitted(source, model, (1280, 960)), (1280, 960)) < 1e-6


def test_opencv_names_say_how_many_terms_are_free():
    for count in (4, 5, 8, 12):
        found = fitted(STEREOGRAPHIC, f"opencv{count}", (2000, 1500))
        assert found.model == "opencv_pinhole"
        assert np.isinf(found.deviations).tolist() == [True] * (4 + count) + [False] * (12 - count)


def test_a_radius_leaves_out_what_is_beyond():
    middle = grid_of_pixels(SIZE, 1000.0)
    assert len(middle) == 300
    assert np.hypot(*(middle - [3007.5, 2007.5]).T).max() <= 1000
    found = fitted(STEREOGRAPHIC, "opencv5", SIZE, radius=1500.0)
    xy = grid_of_pixels(SIZE, 1500.0)
    assert np.linalg.norm(found.project(STEREOGRAPHIC.rays(xy)) - xy, axis=1).max() < 1.5


def test_what_sees_behind_is_known_from_what_does_not():
    wide = {"opencv_fisheye", "stereographic", "equisolid", "fisheye"}
    for model in ("pinhole", "opencv", "opencv_pinhole", "fov", *wide):
        camera = Camera(
            model, {"fx": 500, "fy": 500, "cx": 320, "cy": 240} | ({"omega": 0.5} if model == "fov" else {})
        )
        assert is_perspective(camera) == (model not in wide)


def test_what_cannot_be_fitted_is_refused():
    with refusal("error.unknown.close kind=lens model name=opencv9"):
        fitted(STEREOGRAPHIC, "opencv9", SIZE)
