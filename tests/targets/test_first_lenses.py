"""First values for lenses of all kinds, simulated: long ones, and such that see behind themselves."""

import numpy as np
import pytest
from relisted import relisted
from seen_boards import seen

from message_codes import described, refusal
from photogram import Camera
from photogram.targets import Board, Calibration, first_values
from photogram.targets import first_calibration as first_module
from photogram.words import phrase

BOARD = Board(columns=9, rows=7, spacing=0.04, shape="held")
LENSES = {
    "long": ("pinhole", {"fx": 6000, "fy": 6010, "cx": 960, "cy": 540}, (1920, 1080), "opencv_pinhole"),
    "barrel": (
        "opencv",
        {"fx": 1000, "fy": 1002, "cx": 650, "cy": 470, "k1": -0.3, "k2": 0.1},
        (1280, 960),
        "opencv_pinhole",
    ),
    "action": (
        "opencv_fisheye",
        {"fx": 900, "fy": 900, "cx": 970, "cy": 530, "k1": 0.05, "k2": 0.01},
        (1920, 1080),
        "opencv_fisheye",
    ),
    "180 degrees": (
        "equisolid",
        {"fx": 560, "fy": 560, "cx": 790, "cy": 610},
        (1600, 1200),
        "opencv_fisheye",
    ),
    "220 degrees": (
        "opencv_fisheye",
        {"fx": 420, "fy": 420, "cx": 805, "cy": 795, "k1": 0.01},
        (1600, 1600),
        "opencv_fisheye",
    ),
}


def lens(name):
    model, parameters, size, usual = LENSES[name]
    return Camera(model, parameters), size, usual


def apart(poses, truth):
    """Return the largest chord of attitudes, and the largest shift over the distance."""
    turns = np.linalg.norm(poses[:, :3, :3] - truth[:, :3, :3], axis=(1, 2)).max()
    shifts = np.linalg.norm(poses[:, :3, 3] - truth[:, :3, 3], axis=1)
    return turns, (shifts / np.linalg.norm(truth[:, :3, 3], axis=1)).max()


@pytest.mark.parametrize("views", [6, 20])
@pytest.mark.parametrize("name", LENSES)
def test_every_lens_converges_without_a_start(name, views):
    camera, size, usual = lens(name)
    corners, truth = seen(BOARD, camera, size, views=views)
    first = first_values(BOARD, corners)
    assert not first.without
    if views == 20:
        assert first.cameras[0].model == usual
        assert first.cameras[0].scale == pytest.approx(camera.scale, rel=5e-3)
    turns, shifts = apart(first.poses, truth)
    assert turns < 0.15
    assert shifts < 0.05
    found = Calibration(
        board=BOARD, corners=first.corners, cameras=first.cameras, poses=first.poses, sd0=0.3
    ).adjust()
    assert found.converged
    assert found.variance_of_unit_weight == pytest.approx(1.0, abs=0.15)


def test_views_behind_the_camera_have_their_order_found():
    camera, size, _ = lens("220 degrees")
    corners, truth = seen(BOARD, camera, size)
    first = first_values(BOARD, relisted(BOARD, corners, {3: 5, 4: 1, 7: 6}))
    np.testing.assert_array_equal(
        first.corners.point[corners.picture == 4], corners.point[corners.picture == 4]
    )
    told = " ".join(map(str, first.remarks))
    assert "view4 are mirrored" in told
    kept = np.delete(np.arange(12), [3, 7])
    assert apart(first.poses[kept], truth[kept])[0] < 0.05


def test_a_model_that_corners_hardly_determine_is_named():
    """Eight terms of a rational lens where six views of a lens of 120 degrees were taken."""
    camera, size, _ = lens("action")
    corners, _ = seen(BOARD, camera, size, views=6)
    weak = "targets.weak-lens camera=camera model=opencv8"
    asked = first_values(BOARD, corners, "opencv8")
    assert asked.cameras[0].model == "opencv_pinhole"
    assert described(asked.remarks[0]) == weak
    usual = first_values(BOARD, corners)
    assert usual.cameras[0].model == "opencv_fisheye"
    assert described(usual.remarks[0]) == weak


def test_a_model_that_is_too_stiff_is_named():
    camera, size, _ = lens("180 degrees")
    corners, _ = seen(BOARD, camera, size, views=15)
    inside = np.hypot(*(corners.xy - [790, 610]).T) < 700
    first = first_values(BOARD, corners.replace(use=inside), "opencv4")
    assert described(first.remarks[0]).startswith("targets.poor-lens camera=camera model=opencv4")


def test_pictures_that_the_lens_does_not_show_have_no_pose(monkeypatch):
    """A lens that folds where a picture has its corners."""
    camera, size, _ = lens("barrel")
    corners, _ = seen(BOARD, camera, size)
    folding = Camera("simple_radial", {"f": 1000, "cx": 650, "cy": 470, "k": -2.0}, np.inf)
    monkeypatch.setattr(first_module, "first_camera", lambda *_: (folding, []))
    first = first_values(BOARD, corners)
    assert first.without
    assert set(map(described, first.without.values())) == {"targets.hidden least=6"}
    gone = [name in first.without for name in corners.pictures]
    assert np.isnan(first.poses[gone]).all()
    assert np.isfinite(first.poses[~np.array(gone)]).all()


def test_a_model_that_cannot_show_what_is_seen_is_refused():
    camera, size, _ = lens("220 degrees")
    corners, _ = seen(BOARD, camera, size)
    with refusal("targets.wide camera=camera angle=119.3019232", "model=opencv8"):
        first_values(BOARD, corners, "opencv8")


@pytest.mark.parametrize("depth", [0.0, 0.03, 0.2, 1.0])
@pytest.mark.parametrize("name", ["barrel", "180 degrees"])
def test_points_that_lie_anywhere_have_first_values(name, depth):
    """A field of targets in axes of its own, flat or not."""
    rng = np.random.default_rng(5)
    places = rng.uniform(-0.2, 0.2, (60, 3)) * [1, 1, depth]
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned *= np.sign(np.linalg.det(turned))
    field = Board(kind="points", points=places @ turned.T + [3.0, 4.0, 5.0])
    camera, size, _ = lens(name)
    corners, truth = seen(field, camera, size, least=25)
    first = first_values(field, corners)
    turns, shifts = apart(first.poses, truth)
    assert turns < 0.05
    assert shifts < 0.05
    assert first.cameras[0].scale == pytest.approx(camera.scale, rel=5e-3)


def test_pictures_of_one_face_of_a_solid_are_named():
    """Points on two walls: one picture shows one of them."""
    rng = np.random.default_rng(5)
    walls = rng.uniform(-0.2, 0.2, (80, 3))
    walls[:40, 2] = walls[40:, 0] = -0.2
    field = Board(kind="points", points=walls)
    camera, size, _ = lens("barrel")
    corners, _ = seen(field, camera, size, least=60)
    first = first_values(field, corners.replace(use=(corners.picture != 2) | (corners.point < 40)))
    assert first.without == {"view2": phrase("targets.plane")}
    assert np.isnan(first.poses[2]).all()
