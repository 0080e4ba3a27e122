"""The translations of a block for the peers: the same start, the same solution, the same covariances."""

import importlib
from typing import Any

import apex_block
import needs
import numpy as np
import pytest
import side
from agreement import Agreement
from runs import package
from start import intersections

import photogram
from photogram.network import geometry

GTSAM = ("gn-colamd", "gn-metis", "lm-colamd", "lm-schur")
SIDES = (
    *(f"gtsam:{setting}" for setting in GTSAM),
    "pycolmap",
    "symforce",
    *(f"apex-solver:{setting}" for setting in apex_block.SETTINGS),
)
WITH_COFACTORS = {"gtsam": (True, True), "pycolmap": (True, False)}
"""Whether a peer has cofactors of photographs and of points."""
TRANSLATIONS = {
    "gtsam": "gtsam_block.factor_graph",
    "pycolmap": "colmap_block.problem",
    "symforce": "symforce_block.problem",
    "apex-solver": "apex_block.numbers",
}


def require(name: str) -> None:
    """Skip a test of a side that cannot run here."""
    if what := needs.lacking(name):
        pytest.skip(f"{name} needs {what}")


def small_block(**options: Any) -> photogram.Block:
    """Simulate a block with full and height control."""
    block = photogram.simulate(strips=3, photos_per_strip=5, control_spacing=2, seed=3, **options).block
    assert set(np.isfinite(block.point_sd).sum(axis=1)) == {0, 1, 3}
    return block


@pytest.mark.parametrize("principal_distance", [-152.74, 152.74])
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_images(principal_distance: float, photo_to_ground: bool) -> None:
    """Initial photographs and points have the same images in gtsam's cameras, to 1e-9 mm."""
    gtsam, gtsam_block = pytest.importorskip("gtsam"), importlib.import_module("gtsam_block")
    block = small_block(principal_distance=principal_distance, photo_to_ground=photo_to_ground)
    points = intersections(block)
    expected = geometry.project(
        points[block.image_points],
        block.photo_positions[block.image_photos],
        block.photo_attitudes[block.image_photos],
        block.principal_distances[block.image_photos],
        photo_to_ground=photo_to_ground,
    )
    camera = gtsam_block.calibration(principal_distance)
    cameras = [gtsam.PinholeCameraCal3_S2(pose, camera) for pose in gtsam_block.poses(block)]
    images = zip(block.image_photos, block.image_points, strict=True)
    actual = [cameras[photo].project(points[point]) for photo, point in images]
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("principal_distance", [-152.74, 152.74])
@pytest.mark.parametrize("photo_to_ground", [False, True])
@pytest.mark.parametrize("name", SIDES)
def test_solutions_agree(name: str, photo_to_ground: bool, principal_distance: float) -> None:
    """Every side starts from and ends at the same sum of squares, with the same unknowns and cofactors."""
    require(name)
    block = small_block(photo_to_ground=photo_to_ground, principal_distance=principal_distance)
    ours, theirs = side.Record(), side.Record()
    arrays = side.run_photogram(block, ours, None)
    _, _, setting = name.partition(":")
    others = side.PEERS[package(name)](block, intersections(block), theirs, 60.0, setting)
    agreement = Agreement.of((ours.values, arrays), (theirs.values, others))
    assert agreement
    cofactors = agreement.photo_cofactors, agreement.point_cofactors
    assert tuple(each is not None for each in cofactors) == WITH_COFACTORS.get(package(name), (False, False))
    assert theirs.values["converged"]
    assert theirs.values["seconds"]["solution"] > 0
    assert theirs.values["peak"]["solution"] > 2**20


@pytest.mark.parametrize("name", list(TRANSLATIONS))
@pytest.mark.parametrize(
    "options",
    [
        {"position_sd": 1.0},
        {"attitude_sd": 0.01},
        {"control_sd": 0.0},
        {"spheroid": geometry.Spheroid.wgs84()},
    ],
)
def test_refuses_what_it_does_not_translate(options: dict[str, Any], name: str) -> None:
    """Blocks that a peer would solve differently are refused."""
    require(name)
    module, _, function = TRANSLATIONS[name].partition(".")
    block = small_block(**options)
    with pytest.raises(ValueError, match="wanted"):
        getattr(importlib.import_module(module), function)(block, np.zeros_like(block.point_positions))


def test_gtsam_is_tested_with_all_its_settings() -> None:
    """Their names stand here, so that the other sides are tested without gtsam."""
    pytest.importorskip("gtsam")
    assert set(importlib.import_module("gtsam_block").SETTINGS) == set(GTSAM)


def test_what_cannot_run_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """With one line that says why."""
    monkeypatch.setattr(needs, "MODULES", {"gtsam": ("json",), "symforce": ("json", "no_such_module")})
    monkeypatch.setenv("PATH", "")
    lines = needs.left_out(["photogram", "photogram:1", "gtsam:gn-metis", "symforce", "apex-solver"])
    assert lines == {
        "symforce": "* symforce is left out: no_such_module is not installed.",
        "apex-solver": "* apex-solver is left out: a cargo that can build it is not installed.",
    }


def test_another_solution_does_not_agree() -> None:
    """A solution of other measurements is noticed."""
    block = small_block()
    ours, theirs = side.Record(), side.Record()
    arrays = side.run_photogram(block, ours, None)
    moved = block.replace(image_xy=block.image_xy + np.array([0.001, 0.0]))
    others = side.run_photogram(moved, theirs, None)
    assert not Agreement.of((ours.values, arrays), (theirs.values, others))
