"""Cameras of a rig by the views that they have in common."""

import numpy as np
import pytest

from photogram import Attitudes
from photogram.targets import Board
from photogram.targets.first_calibration import connected, mean_pose
from photogram.targets.sightings import Listings
from photogram.targets.vision import composed, inverted, of_vectors

TURNS = Listings.of(Board(columns=5, rows=5, spacing=0.1)).turns


def random_poses(count, seed, size=(0.6, 1.0)):
    rng = np.random.default_rng(seed)
    return of_vectors(
        np.column_stack([rng.normal(0, size[0], (count, 3)), rng.normal(0, size[1], (count, 3))])
    )


@pytest.fixture
def chain():
    """Return a rig of 4 cameras: 0 and 1 have views in common, 1 and 2, but not 0 and 2; 3 has none."""
    sensors = random_poses(4, 1, (0.2, 0.3))
    sensors[0] = np.eye(4)
    boards = random_poses(20, 2)
    seen = [(v, k) for v in range(20) for k in ((0, 1) if v < 8 else (1, 2) if v < 14 else (3,))]
    views, cameras = np.array(seen).T
    return sensors, boards, cameras, views, sensors[cameras] @ boards[views]


def test_cameras_are_chained_by_common_views(chain):
    sensors, _, cameras, views, poses = chain
    rig = connected(poses, cameras, views, 4, TURNS)
    np.testing.assert_allclose(rig.sensors[:3], sensors[:3], atol=1e-12)
    np.testing.assert_array_equal(rig.sensors[3], np.eye(4))
    assert rig.references.tolist() == [0, 0, 0, 3]
    assert not rig.turned.any()
    assert not rig.apart.any()


def test_boards_that_were_turned_are_found_in_every_camera_of_the_chain(chain):
    sensors, _, cameras, views, poses = chain
    rows = {5: 3, 9: 5, 19: 6, 21: 3}
    assert (cameras[[*rows]] > 0).all()
    turned = poses.copy()
    for row, order in rows.items():
        turned[row] = poses[row] @ TURNS[order]
    rig = connected(turned, cameras, views, 4, TURNS)
    np.testing.assert_allclose(rig.sensors[:3], sensors[:3], atol=1e-12)
    assert {row: int(rig.turned[row]) for row in np.flatnonzero(rig.turned)} == rows


def test_a_picture_of_another_moment_is_named_and_counts_for_nothing(chain):
    sensors, _, cameras, views, poses = chain
    moved = poses.copy()
    moved[7] = random_poses(1, 7)[0]
    rig = connected(moved, cameras, views, 4, TURNS)
    np.testing.assert_allclose(rig.sensors[:3], sensors[:3], atol=1e-12)
    assert np.flatnonzero(rig.apart).tolist() == [7]


def test_pictures_without_a_pose_do_not_count(chain):
    sensors, _, cameras, views, poses = chain
    unknown = poses.copy()
    unknown[[3, 6]] = np.nan
    rig = connected(unknown, cameras, views, 4, TURNS)
    np.testing.assert_allclose(rig.sensors[:3], sensors[:3], atol=1e-12)


def test_a_mean_pose_is_the_middle():
    """Of attitudes about one axis the chordal mean is that by the mean angle, where they are symmetric."""
    vectors = np.array([[0, 0, angle] for angle in (0.1, 0.3, 0.5)])
    rotations = Attitudes.of("rotation_vector_to_vision", vectors).values("matrix_to_vision")
    found = mean_pose(composed(rotations, np.array([[0.0, 0, 1], [0, 5, 2], [9, 1, 3]])))
    np.testing.assert_allclose(found[:3, :3], rotations[1], atol=1e-12)
    np.testing.assert_array_equal(found[:3, 3], [0, 1, 2])
    np.testing.assert_allclose(inverted(found) @ found, np.eye(4), atol=1e-12)
