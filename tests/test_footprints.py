"""Footprints of photos, and error ellipses: where both lie, against the geometry that made them."""

import numpy as np
import pytest

from photogram import Camera, Spheroid, adjust, network, simulate
from photogram.formats.maps.layers import ellipses, fitting_scale
from photogram.results.footprints import footprints, grounds, metric_covariances, picture_frames

SPACES = {
    "rectangular": {},
    "geographic": {"spheroid": Spheroid.wgs84(), "origin": (-1.65, 0.52, 10.0), "photo_to_ground": True},
}


@pytest.fixture(scope="module", params=SPACES)
def result(request):
    block = simulate(
        strips=2, photos_per_strip=4, points_per_photo=25, seed=12, **SPACES[request.param]
    ).block
    return adjust(block)


def test_corners_of_a_footprint_are_seen_in_the_corners_of_the_picture(result):
    found, block = footprints(result, [(230.0, 230.0)]), result.block
    assert not found.cut.any()
    places = found.positions()[:, [0, 4, 8, 12]]
    corners = [[-115, -115], [115, -115], [115, 115], [-115, 115]]
    for photo in range(len(block.photo_ids)):
        seen = network.project(
            places[photo],
            np.tile(result.photo_positions[photo], (4, 1)),
            np.tile(result.photo_attitudes[photo], (4, 1)),
            np.full(4, block.principal_distances[photo]),
            spheroid=block.spheroid,
            photo_to_ground=block.photo_to_ground,
        )
        np.testing.assert_allclose(seen, corners, atol=1e-6)
    # A picture of 230 mm covers 230 times what a millimetre does, but for tilts and relief.
    sides = np.linalg.norm(np.diff(found.outlines[:, ::4], axis=1), axis=2)
    np.testing.assert_allclose(sides.mean(axis=1), 230 * found.size, rtol=1e-2)
    np.testing.assert_array_equal(found.outlines[:, 0], found.outlines[:, -1])


def test_a_footprint_lies_at_the_height_of_the_points_of_its_photo(result):
    block, heights = result.block, result.point_positions[:, 2]
    found = grounds(result, heights)
    for photo in range(len(block.photo_ids)):
        own = block.image_points[(block.image_photos == photo) & result.used_images]
        assert found[photo] == pytest.approx(np.median(heights[own]))


def test_pictures_without_a_size_reach_as_far_as_measurements(result):
    frame = picture_frames(result.block)[0]
    xy = result.block.image_xy
    np.testing.assert_array_equal(frame, [*xy.min(axis=0), *xy.max(axis=0)])


def test_what_is_beyond_the_horizon_is_cut_off(result):
    # A third of a turn about its x axis: the upper half of the picture shows the sky.
    attitudes = result.photo_attitudes.copy()
    attitudes[0] = network.rotation_angles(network.rotation_matrix(np.array([[np.radians(80.0), 0.0, 0.0]])))[
        0
    ]
    from dataclasses import replace

    found = footprints(replace(result, photo_attitudes=attitudes), [(230.0, 230.0)])
    assert found.cut.tolist() == [True] + [False] * (len(attitudes) - 1)
    assert np.isfinite(found.outlines).all()
    centre = found.axes.positions(result.photo_positions)[0]
    reach = np.linalg.norm(found.outlines[0, :, :2] - centre[:2], axis=1)
    assert reach.max() == pytest.approx((centre[2] - found.grounds[0]) * np.tan(np.radians(80.0)))


def test_pixels_of_a_camera_count_from_the_corner():
    camera = Camera("pinhole", {"fx": 6000.0, "fy": 6000.0, "cx": 4600.0, "cy": 4600.0}, unit="px")
    result = adjust(
        simulate(strips=1, photos_per_strip=3, points_per_photo=20, cameras=[camera], seed=4).block
    )
    np.testing.assert_array_equal(picture_frames(result.block, [(9200, 9200)])[0], [0, 0, 9200, 9200])
    found = footprints(result, [(9200, 9200)])
    middle = found.outlines[:, :-1, :2].mean(axis=1)
    # Nearly vertical: the middle of the picture is below the station, within its tilt.
    assert np.linalg.norm(middle - result.photo_positions[:, :2], axis=1).max() < 0.05 * 9200 * found.size[0]


def test_ellipses_are_where_the_quadratic_form_is_the_quantile():
    random = np.random.default_rng(5)
    root = random.normal(size=(20, 3, 3))
    covariances = root @ root.transpose(0, 2, 1)
    found = ellipses(covariances)
    outlines = found.outlines()
    forms = np.einsum("nvi,nij,nvj->nv", outlines, np.linalg.inv(covariances[:, :2, :2]), outlines)
    np.testing.assert_allclose(forms, 5.991464547107979)  # chi-square, two degrees of freedom, 95 %
    assert (found.major >= found.minor).all()
    np.testing.assert_array_equal(outlines[:, 0], outlines[:, -1])
    ends = found.outlines(scale=10.0)[:, 0]
    np.testing.assert_allclose(
        ends, 10 * found.major[:, None] * np.stack([np.sin(found.azimuth), np.cos(found.azimuth)], 1)
    )


def test_an_ellipse_that_points_to_the_north_has_no_azimuth():
    found = ellipses(
        np.array([[[1.0, 0.0], [0.0, 4.0]], [[4.0, 0.0], [0.0, 1.0]], [[2.0, 1.0], [1.0, 2.0]]]), None
    )
    np.testing.assert_allclose(found.major, [2, 2, np.sqrt(3)])
    np.testing.assert_allclose(np.degrees(found.azimuth), [0, 90, 45])


def test_covariances_are_lengths_in_both_spaces():
    one, two = (
        adjust(simulate(strips=2, photos_per_strip=4, points_per_photo=25, seed=12, **SPACES[space]).block)
        for space in SPACES
    )
    for photos in (False, True):
        np.testing.assert_allclose(
            np.sqrt(np.diagonal(metric_covariances(one, photos=photos), axis1=1, axis2=2)),
            np.sqrt(np.diagonal(metric_covariances(two, photos=photos), axis1=1, axis2=2)),
            rtol=5e-3,
        )


def test_the_scale_is_round_and_makes_ellipses_a_third_of_what_separates_them(result):
    found = ellipses(metric_covariances(result))
    places = footprints(result).axes.positions(result.point_positions)
    scale = fitting_scale(found, places)
    assert float(f"{scale:.0e}") == scale
    spacing = np.sqrt(np.prod(np.ptp(places[:, :2], axis=0)) / len(places))
    assert 0.1 < scale * np.median(found.major) / spacing <= 0.3
