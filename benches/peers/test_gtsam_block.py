"""The translation of a block for gtsam: the same images, the same start, the same solution."""

from typing import Any

import numpy as np
import pytest

gtsam = pytest.importorskip("gtsam")

import gtsam_block  # noqa: E402
from agreement import Agreement  # noqa: E402
from start import intersections  # noqa: E402

import photogram  # noqa: E402
from photogram import geometry  # noqa: E402


def small_block(**options: Any) -> photogram.Block:
    """Simulate a block with full and height control."""
    block = photogram.simulate(strips=3, photos_per_strip=5, control_spacing=2, seed=3, **options).block
    assert set(np.isfinite(block.point_sd).sum(axis=1)) == {0, 1, 3}
    return block


@pytest.mark.parametrize("principal_distance", [-152.74, 152.74])
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_images(principal_distance: float, photo_to_ground: bool) -> None:
    """Initial photographs and points have the same images on both sides, to 1e-9 mm."""
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


@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_solutions_agree(photo_to_ground: bool) -> None:
    """Every setting starts from and ends at the same sum of squares, with the same photographs and points."""
    block = small_block(photo_to_ground=photo_to_ground)
    problem = gtsam_block.factor_graph(block, intersections(block))
    result = photogram.adjust(block)
    for optimizer in gtsam_block.SETTINGS.values():
        solution = gtsam_block.read_out(block, *gtsam_block.solve(problem, optimizer))
        assert Agreement.of(result, problem, solution)


@pytest.mark.parametrize(
    "options",
    [
        {"position_sd": 1.0},
        {"attitude_sd": 0.01},
        {"control_sd": 0.0},
        {"spheroid": geometry.Spheroid.wgs84()},
    ],
)
def test_refuses_what_it_does_not_translate(options: dict[str, Any]) -> None:
    """Blocks that gtsam would solve differently are refused."""
    block = small_block(**options)
    with pytest.raises(ValueError, match="wanted"):
        gtsam_block.factor_graph(block, np.zeros_like(block.point_positions))
