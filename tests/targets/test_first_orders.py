"""What is said of pictures whose corners are listed otherwise, of rigs, and of what cannot be used."""

import numpy as np
import pytest
from golden_boards import packaged, rig
from relisted import relisted

from message_codes import described, refusal
from photogram.targets import Board, first_values
from photogram.targets.sightings import CORNER_ORDERS, Listings


def remarks(first):
    return [described(each) for each in first.remarks]


def test_corners_that_stand_column_by_column_are_named_and_numbered_anew():
    board, corners = packaged()
    first = first_values(board, relisted(board, corners, {0: 5, 4: 5}))
    (remark,) = [each for each in remarks(first) if each.startswith("targets.other-order")]
    assert "['middle01', 'middle05'] order=column by column" in remark
    others = ~np.isin(corners.picture, [0, 4])
    assert (first.corners.point[others] == corners.point[others]).all()
    turned = 53 - first.corners.point[~others]
    assert (turned == corners.point[~others]).all() or (53 - turned == corners.point[~others]).all()


def test_mirrored_corners_are_named_with_their_wrong_order():
    board, corners = packaged()
    first = first_values(board, relisted(board, corners, {2: 1}))
    (said,) = [each for each in remarks(first) if "mirrored" in each]
    assert "middle03" in said
    assert CORNER_ORDERS[1] in said
    assert (first.corners.point == corners.point).all()


def test_a_board_whose_columns_are_its_rows_is_told():
    _, corners = packaged()
    first = first_values(Board(columns=6, rows=9, spacing=0.03), corners)
    assert "targets.all-orders" in remarks(first)
    assert first.cameras[0].scale == pytest.approx(1312, abs=5)


def test_corners_that_are_no_board_are_named_and_do_no_harm():
    board, corners = packaged()
    xy = corners.xy.copy()
    own = np.isin(corners.picture, [1, 4])
    xy[own] = np.random.default_rng(3).uniform(0, 480, (int(own.sum()), 2))
    first = first_values(board, corners.replace(xy=xy))
    assert "targets.odd-orders names=['middle02', 'middle05'] factor=5.0" in remarks(first)
    assert first.cameras[0].scale == pytest.approx(1312, abs=13)


def test_pictures_without_enough_corners_have_no_pose():
    board, corners = packaged()
    kept = (corners.picture != 3) | (corners.point < 5)
    first = first_values(board, corners.replace(use=kept))
    assert list(first.without) == ["middle04"]
    assert np.isnan(first.poses[3]).all()
    assert np.isfinite(np.delete(first.poses, 3, axis=0)).all()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_pictures_are_enough_to_begin_with(count):
    board, corners = packaged()
    first = first_values(board, corners.of_pictures(np.arange(20) < count))
    assert first.cameras[0].scale == pytest.approx(1312, rel=0.03)


def test_cameras_without_a_view_in_common_are_named_and_have_references_of_their_own():
    board, corners = rig()
    apart = first_values(board, corners.of_pictures(corners.cameras == corners.views % 2))
    assert "targets.alone camera=b" in remarks(apart)
    assert apart.references.tolist() == [0, 1]
    assert np.isfinite(apart.poses).all()
    np.testing.assert_array_equal(apart.sensors[1], np.eye(4))


def test_frontal_views_are_named():
    board, corners = rig()
    found = remarks(first_values(board, corners))
    assert any(each.startswith("targets.frontal") for each in found)


def test_what_cannot_be_is_refused_by_name():
    board, corners = packaged()
    with refusal("targets.corner-beyond corner=corner 40 of middle01 count=40"):
        first_values(Board(columns=8, rows=5, spacing=0.03), corners)
    with refusal("error.unknown.close kind=lens model name=opencv_pinhol"):
        first_values(board, corners, "opencv_pinhol")
    with refusal("targets.no-lens model=brown"):
        first_values(board, corners, "brown")
    with refusal("targets.few-corners camera=camera pictures=", "middle01"):
        first_values(board, corners.replace(use=False))


@pytest.mark.parametrize(
    ("board", "shapes", "turns"),
    [
        (Board(columns=9, rows=6, spacing=1.0), (0, 4), [0, 3]),
        (Board(columns=10, rows=10, spacing=1.0), (0,), [0, 3, 5, 6]),
        (Board(columns=10, rows=10, spacing=(1.0, 1.1)), (0,), [0, 3]),
        (Board(kind="asymmetric_circles", columns=4, rows=11, spacing=1.0), (0, 2), [0]),
        (Board(kind="asymmetric_circles", columns=4, rows=10, spacing=1.0), (0, 1), [0, 3]),
        (Board(kind="aprilgrid", columns=4, rows=4, tag_size=1.0, tag_spacing=0.3), (0,), [0]),
    ],
)
def test_orders_of_boards_are_symmetries_or_seen(board, shapes, turns):
    listings = Listings.of(board)
    assert listings.shapes == shapes
    assert list(listings.turns) == turns
    assert (np.sort(listings.points, axis=1) == np.arange(len(board.places))).all()
    for order, turn in listings.turns.items():
        moved = board.places @ turn[:3, :3].T + turn[:3, 3]
        np.testing.assert_allclose(moved, board.places[listings.points[order]], atol=1e-12)
