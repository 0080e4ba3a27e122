"""The simulator: what was asked for comes out, and the truth is true."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

import photogram
from message_codes import raises
from photogram import Block, Camera, InputError, Spheroid, network, simulate

GALVESTON = (math.radians(-95.0), math.radians(29.7), 0.0)
SPACES = {
    "rectangular": {"origin": (5e5, 4e6, 100.0)},
    "geographic": {"spheroid": Spheroid.clarke_1866(), "origin": GALVESTON},
    "geographic, photo-to-ground": {
        "spheroid": Spheroid.clarke_1866(),
        "origin": GALVESTON,
        "photo_to_ground": True,
    },
}


def project(block: Block) -> np.ndarray:
    return network.project(
        block.point_positions[block.image_points],
        block.photo_positions[block.image_photos],
        block.photo_attitudes[block.image_photos],
        block.principal_distances[block.image_photos],
        spheroid=block.spheroid,
        photo_to_ground=block.photo_to_ground,
    )


def sees(block: Block) -> np.ndarray:
    """Which photo sees which point."""
    table = np.zeros((len(block.photo_ids), len(block.point_ids)), dtype=bool)
    table[block.image_photos, block.image_points] = True
    return table


@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES.keys())
def test_the_truth_projects_onto_its_images(space):
    simulation = simulate(strips=2, photos_per_strip=4, **space)
    np.testing.assert_array_equal(project(simulation.truth), simulation.truth.image_xy)
    assert np.abs(simulation.truth.image_xy).max() <= 115.0


@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES.keys())
def test_no_image_is_missing(space):
    truth = simulate(strips=3, photos_per_strip=4, crab=0.3, tilt=0.09, relief=1500.0, **space).truth
    photos, points = (index.ravel() for index in np.indices((len(truth.photo_ids), len(truth.point_ids))))
    everything = truth.replace(
        image_photos=photos, image_points=points, image_xy=np.zeros((len(photos), 2)), image_sd=np.array(0.01)
    )
    inside = (np.abs(project(everything)) <= 115.0).all(axis=1)
    np.testing.assert_array_equal(sees(truth).ravel(), inside)


@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES.keys())
@pytest.mark.parametrize(("forward", "side"), [(0.6, 0.3), (0.8, 0.6)])
def test_overlaps_come_out(space, forward, side):
    truth = simulate(
        strips=3,
        photos_per_strip=5,
        forward_overlap=forward,
        side_overlap=side,
        tilt=0.0,
        crab=0.0,
        relief=0.0,
        **space,
    ).truth
    seen = sees(truth)
    # All that photo 7, in the middle, sees is in the block: shares of its points are shares of its frame.
    middle = seen[7].sum()
    assert (seen[7] & seen[8]).sum() / middle == pytest.approx(forward, abs=0.06)
    assert (seen[7] & seen[12]).sum() / middle == pytest.approx(side, abs=0.06)


@pytest.mark.parametrize("points_per_photo", [9, 100, 400])
@pytest.mark.parametrize(("forward", "side"), [(0.6, 0.3), (0.8, 0.6)])
def test_neighbours_are_tied(points_per_photo, forward, side):
    strips, photos = 3, 6
    truth = simulate(
        strips=strips,
        photos_per_strip=photos,
        points_per_photo=points_per_photo,
        forward_overlap=forward,
        side_overlap=side,
        seed=3,
    ).truth
    seen = sees(truth).reshape(strips, photos, -1)
    assert (seen[:, :-1] & seen[:, 1:]).sum(axis=-1).min() >= 4
    assert (seen[:, :-2] & seen[:, 1:-1] & seen[:, 2:]).sum(axis=-1).min() >= 2
    assert (seen[:-1] & seen[1:]).sum(axis=-1).min() >= 2
    assert sees(truth).sum(axis=0).min() >= 2


@pytest.mark.parametrize("strips", [1, 4])
@pytest.mark.parametrize("points_per_photo", [60, 100, 300])
def test_the_mean_number_of_image_points(strips, points_per_photo):
    block = simulate(strips=strips, photos_per_strip=12, points_per_photo=points_per_photo).block
    assert len(block.image_xy) / len(block.photo_ids) == pytest.approx(points_per_photo, rel=0.1)


def test_a_thousand_photographs():
    block = simulate(strips=20, photos_per_strip=50).block
    assert len(block.photo_ids) == 1000
    assert 95_000 < len(block.image_xy) < 105_000


@pytest.mark.speed
def test_a_thousand_photographs_take_seconds():
    start = time.perf_counter()
    simulate(strips=20, photos_per_strip=50)
    assert time.perf_counter() - start < 5


def test_names_and_order():
    block = simulate(strips=2, photos_per_strip=3, seed=1).block
    assert block.photo_ids == ["0101", "0102", "0103", "0201", "0202", "0203"]
    assert all(len(name) <= 8 for name in block.point_ids)
    order = np.lexsort((block.image_points, block.image_photos))
    np.testing.assert_array_equal(order, np.arange(len(order)))
    assert np.unique(block.image_points).tolist() == list(range(len(block.point_ids)))


def test_neighbouring_strips_are_flown_in_opposite_directions():
    kappa = simulate(strips=2, photos_per_strip=3, crab=0.02).truth.photo_attitudes[:, 2]
    assert (np.abs(kappa[:3]) <= 0.02).all()
    assert (math.pi - np.abs(kappa[3:]) <= 0.02).all()


def test_equal_seeds_give_equal_blocks():
    one, same, other = (simulate(strips=2, photos_per_strip=4, blunders=3, seed=seed) for seed in (5, 5, 6))
    for name in ("photo_positions", "photo_attitudes", "point_positions", "image_xy", "point_sd"):
        np.testing.assert_array_equal(getattr(one.block, name), getattr(same.block, name))
    np.testing.assert_array_equal(one.blunders.images, same.blunders.images)
    assert one.block.photo_positions[0, 0] != other.block.photo_positions[0, 0]
    again = simulate(strips=2, photos_per_strip=4, blunders=3, seed=np.random.default_rng(5))
    np.testing.assert_array_equal(one.block.image_xy, again.block.image_xy)


def test_the_origin_moves_the_block_only():
    here, there = (simulate(strips=2, photos_per_strip=4, origin=(x, 0.0, 0.0)) for x in (0.0, 1e6))
    np.testing.assert_allclose(
        there.truth.point_positions - [1e6, 0, 0], here.truth.point_positions, atol=1e-9
    )
    np.testing.assert_allclose(there.truth.image_xy, here.truth.image_xy, atol=1e-9)


@pytest.mark.giant("4", "geographic: the curvature of the earth is inherent")
def test_section_4_geographic_space_is_rectangular_space_but_for_the_curvature():
    plane, globe = (
        simulate(strips=2, photos_per_strip=3, seed=2, **SPACES[name]).truth
        for name in ("rectangular", "geographic, photo-to-ground")
    )
    images = {
        (globe.photo_ids[photo], globe.point_ids[point]): xy
        for photo, point, xy in zip(globe.image_photos, globe.image_points, globe.image_xy, strict=True)
    }
    pairs = [
        (xy, images[plane.photo_ids[photo], plane.point_ids[point]])
        for photo, point, xy in zip(plane.image_photos, plane.image_points, plane.image_xy, strict=True)
        if (plane.photo_ids[photo], plane.point_ids[point]) in images
    ]
    assert len(pairs) > 0.98 * len(plane.image_xy)
    flat, curved = np.array(pairs).transpose(1, 0, 2)
    # At the distance r from the nadir the spheroid has fallen r^2/2R below the plane: 0.06 mm in the corners.
    radius, height, c = 6.37e6, 4500.0, 152.74
    r = height / c * np.hypot(*flat.T)[:, None]
    np.testing.assert_allclose(curved - flat, -flat * r**2 / (2 * radius * height), rtol=0, atol=0.004)
    heights = globe.photo_positions[:, 2]
    np.testing.assert_allclose(heights, 4500.0, atol=1e-6)


def test_vertical_photographs_stay_vertical_far_from_the_centre():
    truth = simulate(strips=1, photos_per_strip=60, tilt=0.0, crab=0.0, **SPACES["geographic"]).truth
    np.testing.assert_allclose(truth.photo_attitudes[:, :2], 0.0, atol=1e-12)
    # The strip keeps its heading in the plan: kappa takes up the convergence of meridians, dlon sin(lat).
    longitude, latitude = truth.photo_positions[:, :2].T
    np.testing.assert_allclose(
        truth.photo_attitudes[:, 2], -(longitude - GALVESTON[0]) * np.sin(latitude), rtol=0.01
    )


def test_noise_has_its_standard_deviation():
    simulation = simulate(
        strips=6, photos_per_strip=10, image_sd=0.007, position_error=20.0, attitude_error=0.004
    )
    block, truth = simulation.block, simulation.truth
    noise = block.image_xy - truth.image_xy
    assert noise.std() == pytest.approx(0.007, rel=0.03)
    assert abs(noise.mean()) < 4 * 0.007 / math.sqrt(noise.size)
    assert (block.image_sd == 0.007).all()
    assert (block.photo_positions - truth.photo_positions).std() == pytest.approx(20.0, rel=0.2)
    assert (block.photo_attitudes - truth.photo_attitudes).std() == pytest.approx(0.004, rel=0.2)
    assert np.isinf(block.photo_position_sd).all()
    assert np.isinf(block.photo_attitude_sd).all()


def test_geographic_errors_are_in_metres():
    simulation = simulate(
        strips=6,
        photos_per_strip=10,
        position_error=10.0,
        position_sd=10.0,
        attitude_sd=0.01,
        **SPACES["geographic"],
    )
    block, truth = simulation.block, simulation.truth
    assert block.spheroid is not None
    errors = network.geographic_to_geocentric(block.photo_positions, block.spheroid)
    errors -= network.geographic_to_geocentric(truth.photo_positions, block.spheroid)
    assert errors.std() == pytest.approx(10.0, rel=0.2)
    standardized = (block.photo_positions - truth.photo_positions) / block.photo_position_sd
    np.testing.assert_allclose(standardized.std(axis=0), 1.0, rtol=0.3)
    assert (block.photo_attitude_sd == 0.01).all()


def test_blunders_are_recorded():
    clean, faulty = (
        simulate(strips=2, photos_per_strip=5, blunders=count, blunder_size=0.3) for count in (0, 7)
    )
    assert len(clean.blunders.images) == 0
    difference = faulty.block.image_xy - clean.block.image_xy
    rows = np.flatnonzero(difference.any(axis=1))
    np.testing.assert_array_equal(rows, faulty.blunders.images)
    np.testing.assert_allclose(difference[rows], faulty.blunders.amounts, atol=1e-12)
    np.testing.assert_allclose(np.abs(faulty.blunders.amounts).max(axis=1), 0.3)
    np.testing.assert_array_equal(faulty.truth.image_xy, clean.truth.image_xy)


def test_control_around_the_block_and_chains_of_heights():
    simulation = simulate(strips=4, photos_per_strip=13, control_spacing=4, control_sd=0.1, check_points=15)
    block, truth = simulation.block, simulation.truth
    held = np.isfinite(block.point_sd)
    full, height = held.all(axis=1), held[:, 2] & ~held[:, 0]
    assert height.sum() == 2 * 3
    assert full.sum() == 2 * 4 + 2 * 1
    x, y, _ = np.abs(truth.point_positions[full]).T
    assert ((x > 0.9 * x.max()) | (y > 0.9 * y.max())).all()
    assert np.isnan(block.point_positions[height][:, :2]).all()
    assert (block.point_sd[held] == 0.1).all()
    errors = (block.point_positions - truth.point_positions)[held]
    assert errors.std() == pytest.approx(0.1, rel=0.4)
    kinds = np.array([name[0] for name in block.point_ids])
    np.testing.assert_array_equal(kinds == "C", held.any(axis=1))
    checks = kinds == "K"
    assert checks.sum() == 15
    np.testing.assert_array_equal(block.point_positions[checks], truth.point_positions[checks])
    assert np.isnan(block.point_positions[kinds == "P"]).all()


def test_control_of_a_block_of_many_short_strips_is_nearest_to_its_places():
    simulation = simulate(strips=40, photos_per_strip=3, control_spacing=4, points_per_photo=9, seed=5)
    places = simulation.truth.point_positions
    full = np.isfinite(simulation.block.point_sd).all(axis=1)
    x, y, _ = np.abs(places[full]).T
    assert full.sum() > 10
    assert ((x > 0.5 * x.max()) | (y > 0.9 * y.max())).all()


def test_other_control_patterns():
    corners = simulate(control="corners", control_sd=0.0).block
    assert np.isfinite(corners.point_sd).sum() == 12
    assert (corners.point_sd[np.isfinite(corners.point_sd)] == 0).all()
    assert np.isinf(simulate(control="none").block.point_sd).all()


@pytest.mark.parametrize(
    "argument",
    [
        {"strips": 0},
        {"photos_per_strip": 1},
        {"forward_overlap": 0.5},
        {"side_overlap": 0.0},
        {"principal_distance": 0.0},
        {"flying_height": -1.0},
        {"relief": 5000.0},
        {"points_per_photo": 1},
        {"tilt": 0.2},
        {"control": "everywhere"},
        {"image_sd": 0.0},
        {"image_sd": math.nan},
        {"blunders": -1},
        {"position_error": math.inf},
    ],
)
def test_arguments_out_of_range(argument):
    with pytest.raises(InputError, match=next(iter(argument))):
        simulate(**argument)


def test_cameras_take_the_photos_in_turn():
    """Errors are as large in angle as without; an adjustment finds the cameras within their deviations."""
    terms = {"k1": -1e-2, "k2": 2e-3, "p1": 1e-4, "p2": -2e-4}
    true = [
        Camera("opencv", {"fx": 8000.0, "fy": 8000.0, "cx": 6010.0, "cy": 5990.0, **terms}, name="left"),
        Camera("opencv", {"fx": 8020.0, "fy": 8020.0, "cx": 5980.0, "cy": 6020.0, "k1": 5e-3}, name="right"),
    ]
    free = dict.fromkeys(true[0].names, np.inf)
    known = {"fx": 8000.0, "fy": 8000.0, "cx": 6000.0, "cy": 6000.0}
    start = [Camera("opencv", known, free, name=each.name) for each in true]
    plain = simulate(seed=3)
    made = simulate(seed=3, cameras=true, start_cameras=start)
    assert [made.block.cameras[camera].name for camera in made.block.photo_cameras[:3]] == [
        "left",
        "right",
        "left",
    ]
    first = made.block.photo_cameras[made.block.image_photos] == 0
    ratio = 8000.0 / 152.74
    np.testing.assert_allclose(
        (made.block.image_xy - made.truth.image_xy)[first],
        ratio * (plain.block.image_xy - plain.truth.image_xy)[first],
        atol=1e-9,
    )
    result = photogram.adjust(made.block)
    assert result.converged
    assert result.variance_of_unit_weight == pytest.approx(1.0, abs=0.05)
    for camera, truth in zip(result.cameras, true, strict=True):
        assert (np.abs(camera.values - truth.values) < 4 * camera.sd).all()
    with raises(InputError, "simulation.start-cameras"):
        simulate(cameras=true, start_cameras=start[:1])
