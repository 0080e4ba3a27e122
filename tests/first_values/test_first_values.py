"""First values: whatever is known, the adjustment from them ends where it ends from good starts."""

import networks
import numpy as np
import pytest

import photogram
from example_scripts import load
from golden_data import shared
from message_codes import raises
from photogram import (
    AdjustmentError,
    Block,
    Camera,
    Distance,
    InputError,
    LeverArm,
    Position,
    adjust,
    first_values,
)
from photogram.giant import read_project
from photogram.network import Attitude, Boresight, rotation_matrix
from photogram.words import Phrase


def agree(found, good, *, datum=True):
    """Adjust from first values and from good ones, and compare what does not depend on the datum (or all)."""
    results = [adjust(block) for block in (found, good)]
    assert [result.status for result in results] == ["converged"] * 2
    sums = [result.sums_of_squares.total for result in results]
    assert sums[0] == pytest.approx(sums[1], rel=1e-6)
    if datum:
        tolerance = 1e-3 * results[1].photo_sd[:, :3]
        assert (np.abs(results[0].photo_positions - results[1].photo_positions) < tolerance).all()
    return results


def pairs_without(started, truth):
    """Return the truth with the same images."""
    return truth.replace(
        image_photos=started.block.image_photos[~started.set_aside],
        image_points=started.block.image_points[~started.set_aside],
        image_xy=started.block.image_xy[~started.set_aside],
        image_sd=started.block.image_sd[~started.set_aside],
    )


def whole(started):
    """All photos started, as the block without poses has them."""
    assert not started.missing
    assert len(started.sources) == len(started.block.photo_ids)
    return started


SCENES = {
    "strips, control on every photo": (networks.strips(1), range(0, 400, 4)),
    "strips, five control points": (networks.strips(2, strips=3), range(0, 600, 130)),
    "strips over a plane": (networks.strips(3, relief=0.0), range(0, 400, 60)),
    "ring with phi of 90 degrees": (networks.ring(4), range(6)),
}


@pytest.mark.parametrize("wrong", [0.0, 0.1])
@pytest.mark.parametrize("scene", SCENES)
def test_control(scene, wrong):
    (positions, angles, points), control = SCENES[scene]
    block, truth, bad = networks.network(positions, angles, points, seed=7, control=control, wrong=wrong)
    started = whole(first_values(block))
    assert started.first_photo is None
    assert started.set_aside[bad].mean() > 0.9 if wrong else not started.set_aside.any()
    agree(started.usable(), pairs_without(started, truth))


def test_images_alone():
    positions, angles, points = networks.ring(11)
    block, truth, _ = networks.network(positions, angles, points, seed=12)
    started = whole(first_values(block))
    assert started.first_photo == "F0"
    assert set(started.sources.values()) == {"oriented", "resected"}
    assert np.allclose(started.block.photo_positions[0], 0, atol=1e-12)
    assert np.linalg.norm(started.block.photo_positions[1]) == pytest.approx(1.0)
    agree(started.block, truth, datum=False)


def test_a_distance_gives_scale():
    positions, angles, points = networks.ring(21)
    block, truth, _ = networks.network(positions, angles, points, seed=22)
    length = float(np.linalg.norm(points[1] - points[0]))
    bar = [Distance("P0", "P1", length, sd=0.001)]
    started = first_values(block.replace(observations=bar))
    base = np.linalg.norm(positions[1] - positions[0])
    assert np.linalg.norm(started.block.photo_positions[1]) == pytest.approx(base, rel=1e-2)
    agree(started.block, truth.replace(observations=bar), datum=False)


def test_control_only_in_a_corner():
    positions, angles, points = networks.strips(31, strips=2, photos=6)
    corner = np.flatnonzero((points[:, 0] < -50) & (points[:, 1] < 100))[:5]
    block, truth, _ = networks.network(positions, angles, points, seed=32, control=corner)
    agree(whole(first_values(block)).block, truth)


def test_two_parts_that_do_not_hang_together():
    positions, angles, points = networks.strips(41)
    aside = np.array([10_000.0, 0.0, 0.0])
    both = np.concatenate([points, points + aside])
    block, _, _ = networks.network(
        np.concatenate([positions, positions + aside]),
        np.concatenate([angles] * 2),
        both,
        seed=42,
        control=range(0, 400, 60),
    )
    started = first_values(block)
    assert sorted(started.sources) == sorted(f"F{k}" for k in range(10))
    assert sorted(started.missing) == sorted(f"F{k}" for k in range(10, 20))
    few = Phrase("first.reason.few", {"photos": 10, "n": 0, "least": 3})
    assert set(started.missing.values()) == {str(few)}
    assert adjust(started.usable()).converged
    with raises(InputError, "block.poses-unknown"):
        adjust(started.block)


def test_a_photo_with_too_few_points_is_named():
    positions, angles, points = networks.strips(51)
    block, _, _ = networks.network(positions, angles, points, seed=52, control=range(0, 400, 10))
    shown = np.flatnonzero(block.image_photos == 3)
    kept = np.setdiff1d(np.arange(len(block.image_xy)), shown[3:])
    images = ("image_photos", "image_points", "image_xy", "image_sd")
    started = first_values(block.replace(**{name: getattr(block, name)[kept] for name in images}))
    assert list(started.missing) == ["F3"]
    assert "points in common with started photos and control, 4 required" in started.missing["F3"]
    assert started.messages[-1].code == "first.missing"


def test_mirrored_photos_do_not_fit_control():
    positions, angles, points = networks.strips(55, relief=300.0)
    mirrored = [
        block.replace(image_xy=block.image_xy * [-1, 1])
        for step in (4, 40)
        for block in [networks.network(positions, angles, points, seed=56, control=range(0, 400, step))[0]]
    ]
    with raises(AdjustmentError, "first.none"):
        first_values(mirrored[0])
    # Few points in space may still find a place, behind which most of them do not fit.
    assert first_values(mirrored[1]).messages[0].code == "first.mirrored"


def test_control_that_does_not_fit_is_said():
    positions, angles, points = networks.strips(57)
    control = range(0, 400, 40)
    block, _, _ = networks.network(positions, angles, points, seed=58, control=control)
    moved = block.point_positions.copy()
    moved[control[6:]] += np.random.default_rng(59).uniform(100, 200, (4, 3))
    assert first_values(block.replace(point_positions=moved)).messages[0].code == "first.control-images"


def test_wrong_control_does_not_stop_the_rest():
    """A photo resected from four points of which one is wrong gives way to the model of all others."""
    positions, angles, points = networks.ring(109, photos=7, points=57)
    block, truth, _ = networks.network(positions, angles, points, seed=9, control=range(4), wrong=0.3)
    started = whole(first_values(block))
    agree(started.usable(), pairs_without(started, truth))


def test_given_poses_stay():
    positions, angles, points = networks.strips(61)
    block, truth, _ = networks.network(positions, angles, points, seed=62)
    given = [0, 1, 6]
    half, turned = np.full((10, 3), np.nan), np.full((10, 3), np.nan)
    half[given], turned[given] = positions[given], angles[given]
    started = whole(first_values(block.replace(photo_positions=half, photo_attitudes=turned)))
    assert [started.sources[f"F{k}"] for k in given] == ["given"] * 3
    assert np.array_equal(started.block.photo_positions[given], positions[given])
    assert np.abs(started.block.photo_positions - positions).max() < 2.0
    agree(started.block, truth, datum=False)


def test_positions_alone_give_the_datum():
    positions, angles, points = networks.strips(71, strips=3)
    block, truth, _ = networks.network(positions, angles, points, seed=72)
    rng = np.random.default_rng(73)
    gnss = [
        Position(f"F{k}", each, sd=0.05) for k, each in enumerate(positions + rng.normal(0, 0.05, (15, 3)))
    ]
    agree(whole(first_values(block.replace(observations=gnss))).block, truth.replace(observations=gnss))


@pytest.mark.parametrize("unknown", [False, True])
def test_positions_and_attitudes_give_poses(unknown):
    """Of lever arms and boresights that are unknowns of the adjustment the given values count."""
    positions, angles, points = networks.strips(81, strips=1)
    block, truth, _ = networks.network(positions, angles, points, seed=82)
    rng = np.random.default_rng(83)
    attitudes = rotation_matrix(angles).transpose(0, 2, 1)
    boresight = rotation_matrix(np.array([[0.02, -0.01, 0.03]]))[0]
    lever = np.array([0.3, -0.2, 1.5])
    arm = LeverArm("arm", lever, sd=0.05) if unknown else lever
    mounting = Boresight("imu", boresight, sd=0.01) if unknown else boresight
    observed = [
        each
        for k in range(5)
        for each in (
            Position(
                f"F{k}",
                positions[k] + attitudes[k] @ lever + rng.normal(0, 0.05, 3),
                sd=0.05,
                lever_arm=arm,
            ),
            Attitude(f"F{k}", attitudes[k] @ boresight, sd=1e-4, boresight=mounting),
        )
    ]
    started = whole(first_values(block.replace(observations=observed)))
    assert set(started.sources.values()) == {"observed"}
    assert np.abs(started.block.photo_positions - positions).max() < 0.3
    if not unknown:
        agree(started.block, truth.replace(observations=observed))


def test_geographic_space(small_geographic):
    truth, block = small_geographic
    started = whole(first_values(block))
    agree(started.block, truth)


@pytest.fixture
def small_geographic():
    from photogram import Spheroid, simulate

    truth = simulate(strips=2, photos_per_strip=4, spheroid=Spheroid.wgs84(), seed=91).block
    free = {"photo_position_sd": np.inf, "photo_attitude_sd": np.inf}
    nothing = {"photo_positions_observed": None, "photo_attitudes_observed": None}
    unknown = {"photo_positions": np.nan, "photo_attitudes": np.nan}
    return truth.replace(**free, **nothing), truth.replace(**free, **nothing, **unknown)


def test_nothing_to_start_from():
    block = networks.network(*networks.strips(1), seed=1)[0]
    lonely = block.replace(
        image_photos=[0, 1], image_points=[0, 1], image_xy=[[0.0, 0.0]] * 2, image_sd=1.0, observations=()
    )
    with raises(AdjustmentError, "first.none"):
        first_values(lonely)
    with raises(InputError, "error.kind"):
        first_values("block")


def test_other_entrances_refuse_photos_without_poses():
    block = networks.network(*networks.ring(1), seed=1)[0]
    for entrance in (adjust, photogram.predict):
        with raises(InputError, "block.poses-unknown"):
            entrance(block)
    with raises(InputError, "block.value.unknown"):
        block.replace(photo_position_sd=1.0)


def test_the_example(capsys):
    example = load("first_values")
    example.main()
    printed = capsys.readouterr().out
    assert "12 of 12 photos have a pose: 10 resected from known points, 2 oriented" in printed
    assert "phi of the photos from -90 to 90 degrees" in printed
    started, result = example.started_and_adjusted()
    assert result.converged
    assert result.variance_of_unit_weight == pytest.approx(1.0, abs=0.15)
    assert 25 < started.set_aside.sum() < 60


def test_strasbourg(strasbourg):
    """Real photos: what was given as a coarse start is left out."""
    given = read_project(strasbourg / "giant").to_block()
    given = given.replace(photo_position_sd=np.inf, photo_attitude_sd=np.inf)
    started = whole(first_values(given.replace(photo_positions=np.nan, photo_attitudes=np.nan)))
    agree(started.block, given)


def test_roma():
    """Sixty photos without control or poses: sigma0 of the fixed interior orientation without affinity."""
    frame, point, column, row = np.loadtxt(shared("roma", "markpts.txt"), delimiter=",", unpack=True)
    photos, image_photos = np.unique(frame, return_inverse=True)
    points, image_points = np.unique(point, return_inverse=True)
    pixel = 36.0 / 5616
    measured = np.column_stack([column * pixel - 18.1143, 12.0 - row * pixel])
    square = (measured**2).sum(axis=1, keepdims=True)
    block = Block(
        photo_ids=[f"{photo:.0f}" for photo in photos],
        photo_positions=np.nan,
        photo_attitudes=np.nan,
        principal_distances=-24.3581,
        point_ids=[f"{point:.0f}" for point in points],
        point_positions=np.nan,
        image_photos=image_photos,
        image_points=image_points,
        image_xy=measured * (1 + 2.174e-4 * square - 1.518e-7 * square**2),
        image_sd=pixel,
    )
    started = whole(first_values(block))
    result = adjust(started.block, covariance=False)
    assert result.converged
    assert result.degrees_of_freedom == 101_806
    assert np.sqrt(result.variance_of_unit_weight) == pytest.approx(0.612026, abs=5e-7)


def test_the_same_every_time():
    block = networks.network(*networks.ring(1), seed=1, wrong=0.1)[0]
    first, again = first_values(block), first_values(block)
    assert np.array_equal(first.block.photo_positions, again.block.photo_positions)


@pytest.mark.parametrize(
    ("seed", "own", "shared"), [(26, (15, 10, 16), (3, 1, 2)), (43, (12, 10, 16), (3, 2, 1))]
)
def test_a_model_takes_in_those_before_and_after_it(seed, own, shared):
    """Three pairs of photos, images alone; with the third one the second has enough for the first."""
    generator = np.random.default_rng(seed)
    west = {"A": -6.0, "B": 0.0, "C": 6.0}
    photos = [(pair, k) for pair in west for k in range(2)]
    centres = np.array([[west[pair] + 6 * k - 3, 6.0 * (pair == "B") + k, 30.0 + k] for pair, k in photos])
    seen = [*("A" * own[0] + "B" * own[1] + "C" * own[2])]
    seen += ["AB"] * shared[0] + ["AC"] * shared[1] + ["BC"] * shared[2]
    points = generator.uniform([-10, -10, -4], [10, 10, 4], (len(seen), 3))
    rows = np.array([(p, q) for q, by in enumerate(seen) for p, (pair, _) in enumerate(photos) if pair in by])
    camera = Camera("pinhole", {"fx": 1000.0, "fy": 1000.0, "cx": 0.0, "cy": 0.0}, name="cam")
    xy = np.vstack([camera.project([points[q] - centres[p]]) for p, q in rows])
    block = Block(
        photo_ids=[f"{pair}{k}" for pair, k in photos],
        photo_positions=np.full((6, 3), np.nan),
        photo_attitudes=np.full((6, 3), np.nan),
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        point_ids=[f"p{q}" for q in range(len(seen))],
        point_positions=np.full((len(seen), 3), np.nan),
        point_sd=np.inf,
        image_photos=rows[:, 0],
        image_points=rows[:, 1],
        image_xy=xy + generator.normal(0, 0.5, xy.shape),
        image_sd=1.0,
        cameras=[camera],
        photo_cameras=np.zeros(6, int),
    )
    assert first_values(block).block.photo_ids == block.photo_ids
