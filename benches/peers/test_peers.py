"""The translations of a block for the peers: the same start, the same solution, the same covariances."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

gtsam = pytest.importorskip("gtsam")
pytest.importorskip("pycolmap")
pytest.importorskip("pyceres")

import colmap_block  # noqa: E402
import gtsam_block  # noqa: E402
import side  # noqa: E402
from agreement import Agreement  # noqa: E402
from start import intersections  # noqa: E402

import photogram  # noqa: E402
from photogram.network import geometry  # noqa: E402

Arrays = dict[str, Any]
Run = Callable[[photogram.Block, side.Floats, side.Record], Arrays]

SIDES: dict[str, Run] = {
    **{
        setting: lambda block, points, record, setting=setting: side.run_gtsam(
            block, points, record, 60.0, setting
        )
        for setting in gtsam_block.SETTINGS
    },
    "pycolmap": lambda block, points, record: side.run_pycolmap(block, points, record, 60.0, ""),
}


def small_block(**options: Any) -> photogram.Block:
    """Simulate a block with full and height control."""
    block = photogram.simulate(strips=3, photos_per_strip=5, control_spacing=2, seed=3, **options).block
    assert set(np.isfinite(block.point_sd).sum(axis=1)) == {0, 1, 3}
    return block


@pytest.mark.parametrize("principal_distance", [-152.74, 152.74])
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_images(principal_distance: float, photo_to_ground: bool) -> None:
    """Initial photographs and points have the same images in gtsam's cameras, to 1e-9 mm."""
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
@pytest.mark.parametrize("name", list(SIDES))
def test_solutions_agree(name: str, photo_to_ground: bool, principal_distance: float) -> None:
    """Every side starts from and ends at the same sum of squares, with the same unknowns and cofactors."""
    block = small_block(photo_to_ground=photo_to_ground, principal_distance=principal_distance)
    ours, theirs = side.Record(), side.Record()
    arrays = side.run_photogram(block, ours, None)
    others = SIDES[name](block, intersections(block), theirs)
    agreement = Agreement.of((ours.values, arrays), (theirs.values, others))
    assert agreement
    assert agreement.photo_cofactors is not None
    assert (agreement.point_cofactors is None) == (name == "pycolmap")


@pytest.mark.parametrize("translate", [gtsam_block.factor_graph, colmap_block.problem])
@pytest.mark.parametrize(
    "options",
    [
        {"position_sd": 1.0},
        {"attitude_sd": 0.01},
        {"control_sd": 0.0},
        {"spheroid": geometry.Spheroid.wgs84()},
    ],
)
def test_refuses_what_it_does_not_translate(
    options: dict[str, Any], translate: Callable[[photogram.Block, side.Floats], object]
) -> None:
    """Blocks that a peer would solve differently are refused."""
    block = small_block(**options)
    with pytest.raises(ValueError, match="wanted"):
        translate(block, np.zeros_like(block.point_positions))


def test_another_solution_does_not_agree() -> None:
    """A solution of other measurements is noticed."""
    block = small_block()
    ours, theirs = side.Record(), side.Record()
    arrays = side.run_photogram(block, ours, None)
    moved = block.replace(image_xy=block.image_xy + np.array([0.001, 0.0]))
    others = side.run_photogram(moved, theirs, None)
    assert not Agreement.of((ours.values, arrays), (theirs.values, others))
