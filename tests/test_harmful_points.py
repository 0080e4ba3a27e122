"""Points that harm the whole: named, left out or kept with a warning; never why nothing is known."""

import json
import pickle
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from message_codes import has_code
from photogram import Block, adjust, diagnose, simulate, snoop
from photogram.diagnosis.sections import held_values
from photogram.network import project
from photogram.results import network_sections
from photogram.words import Phrase, phrase


def weakest_points(result):
    return [SimpleNamespace(**row) for row in network_sections.weakest_points(result).record()]


def weakest_photos(result):
    return [SimpleNamespace(**row) for row in network_sections.weakest_photos(result).record()]


@pytest.fixture(scope="module")
def made():
    return simulate(strips=2, photos_per_strip=4, seed=3)


def with_point(block: Block, images: dict[int, np.ndarray], position: np.ndarray | None = None) -> Block:
    """Return the block with a further pass point, X, and its images, by photo."""
    new, count = len(block.point_ids), len(images)
    place = np.full(3, np.nan) if position is None else position
    sd = np.broadcast_to(np.asarray(block.image_sd, dtype=float), block.image_xy.shape)
    return block.replace(
        point_ids=[*block.point_ids, "X"],
        point_positions=np.vstack([block.point_positions, place]),
        point_sd=np.vstack([block.point_sd, np.full((1, 3), np.inf)]),
        image_photos=np.concatenate([block.image_photos, list(images)]),
        image_points=np.concatenate([block.image_points, np.full(count, new)]),
        image_xy=np.vstack([block.image_xy, *images.values()]),
        image_sd=np.vstack([sd, sd[:count]]),
    )


def images_of(truth: Block, photos: list[int], position: np.ndarray) -> dict[int, np.ndarray]:
    """Return the true images of a position."""
    found = project(
        np.tile(position, (len(photos), 1)),
        truth.photo_positions[photos],
        truth.photo_attitudes[photos],
        np.full(len(photos), -152.74),
    )
    return dict(zip(photos, found, strict=True))


def same_as(result, other):
    """Compare the photos: they agree within their standard deviations, which are those of the others."""
    assert (np.abs(result.photo_positions - other.photo_positions) < other.photo_sd[:, :3]).all()
    np.testing.assert_allclose(result.photo_sd, other.photo_sd, rtol=0.1)


def test_a_point_on_nearly_parallel_rays_is_named_and_harms_nothing(made):
    far = made.truth.photo_positions[0] + 3e7 * np.array([0.1, 0.05, -1.0])
    result = adjust(with_point(made.block, images_of(made.truth, [0, 1], far)))
    assert result.converged
    [flat] = [each for each in result.messages if each.code == "adjust.points.flat"]
    assert flat.phrase.fields["points"] == ["X"]
    same_as(result, adjust(made.block))
    worst = weakest_points(result)
    assert worst[0].point == "X"
    assert worst[0].ratio > 1e4
    assert len(worst) == 10
    assert all(a.ratio >= b.ratio for a, b in pairwise(worst))
    # The same by hand, of an ordinary point.
    row = result.block.point_ids.index(worst[-1].point)
    values = np.linalg.eigvalsh(result.point_cofactors[row])
    assert worst[-1].ratio == pytest.approx(np.sqrt(values[-1] / values[0]))


def test_a_point_that_its_rays_do_not_determine_is_left_out(made):
    """Two photos at one place: its rays are one ray, whatever its distance."""
    block, twin = made.block, len(made.block.photo_ids)
    photo_fields = {
        name: np.concatenate([getattr(block, name), getattr(block, name)[:1]])
        for name in ("photo_positions", "photo_attitudes", "principal_distances")
    }
    sd = np.full((twin + 1, 3), np.inf)
    fixed = sd.copy()
    fixed[[0, twin]] = 0.0
    known = block.replace(
        **photo_fields,
        photo_ids=[*block.photo_ids, "TWIN"],
        photo_position_sd=fixed,
        photo_attitude_sd=fixed,
    )
    xy = np.array([10.0, 20.0])
    result = adjust(with_point(known, {0: xy, twin: xy}))
    assert result.converged
    assert result.dropped == {"X": "not-determined"}
    assert "left out, its rays do not determine it: X" in [str(each) for each in result.messages]
    assert np.isfinite(result.point_sd[:-1][result.point_rays[:-1] > 0]).all()


def test_a_photo_that_its_images_do_not_determine_is_left_out():
    """Two images are four equations for six unknowns."""
    block = simulate(strips=2, photos_per_strip=6, seed=3).block
    own = np.flatnonzero(block.image_photos == 3)
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    two = own[np.argsort(-rays[block.image_points[own]], kind="stable")[:2]]
    kept = (block.image_photos != 3) | np.isin(np.arange(len(block.image_photos)), two)
    few = block.replace(
        image_photos=block.image_photos[kept],
        image_points=block.image_points[kept],
        image_xy=block.image_xy[kept],
        image_sd=np.broadcast_to(np.asarray(block.image_sd, dtype=float), block.image_xy.shape)[kept],
    )
    result = adjust(few)
    assert result.converged
    [said] = [
        str(each) for each in result.messages if "photos that their images do not determine" in str(each)
    ]
    assert block.photo_ids[3] in said
    others = np.arange(len(block.photo_ids)) != 3
    assert np.isfinite(result.photo_sd[others]).all()
    assert np.isnan(result.photo_sd[3]).all()
    np.testing.assert_array_equal(result.photo_positions[3], block.photo_positions[3])
    assert not result.used_images[few.image_photos == 3].any()
    # It is as if it had no images; its state goes to other processes.
    again = pickle.loads(pickle.dumps(result))
    photo = block.photo_ids[0]
    joint = again.covariance([("photo", photo)])
    np.testing.assert_allclose(np.diag(joint)[:3], result.photo_sd[0, :3] ** 2, rtol=1e-6)


@pytest.mark.parametrize("metres", [1.0, 0.01])
def test_a_point_at_a_station_is_left_out_or_named(made, metres):
    """It is given, and seen, beside a station; another photo has an image of it that is any point's."""
    at = made.truth.photo_positions[1] + metres * np.array([0.3, 0.1, -1.0])
    images = images_of(made.truth, [1], at) | {0: np.array([40.0, 50.0])}
    result = adjust(with_point(made.block, images, at))
    assert any("X" in str(each) for each in result.messages), result.messages
    assert np.isfinite(result.photo_sd).all()
    if result.converged:
        same_as(result, adjust(made.block))


@pytest.mark.parametrize("given", [False, True])
@pytest.mark.parametrize("metres", [1.0, 0.01])
def test_a_point_whose_rays_part_is_left_out(made, metres, given):
    """Its place is at infinity: the adjustment creeps there, and turns the photos, until it is left out."""
    at = made.truth.photo_positions[1] + metres * np.array([0.3, 0.1, -1.0])
    images = {0: np.array([40.0, 50.0])} | images_of(made.truth, [1], at)
    block = with_point(made.block, images, at if given else None)
    result = diagnose(block, adjust(block)).result
    assert result.converged
    assert result.dropped == {"X": "ran-off"}
    assert "left out, its rays do not meet: it ran off: X" in [str(each) for each in result.messages]
    assert not result.hints
    other = adjust(made.block)
    np.testing.assert_allclose(result.photo_sd, other.photo_sd, rtol=1e-9)
    same_as(result, other)


def test_rays_that_part_a_little_lead_nowhere_and_the_point_is_left_out(made):
    far = images_of(made.truth, [0, 1], made.truth.photo_positions[0] + 3e7 * np.array([0.1, 0.05, -1.0]))
    block = with_point(made.block, far | {1: far[1] + [2.0, 0.0]})
    result = adjust(block)
    assert result.converged
    assert list(result.dropped) == ["X"]
    same_as(result, adjust(made.block))
    # Nor does it spoil the others where gross errors are looked for.
    snooped = snoop(block)
    assert {entry.name.split(" on ")[0] for entry in snooped.removed} <= {"image of point X"}
    same_as(snooped.result, adjust(made.block))


def test_control_given_at_the_place_of_a_station_is_left_out(made):
    at = made.block.photo_positions[1].copy()
    block = with_point(made.block, {1: np.array([3.0, 4.0]), 0: np.array([40.0, 50.0])}, at)
    sd = block.point_sd.copy()
    sd[-1] = 0.05
    result = adjust(block.replace(point_sd=sd))
    assert result.converged
    assert result.dropped == {"X": "at-station"}
    np.testing.assert_allclose(result.photo_sd, adjust(made.block).photo_sd, rtol=1e-9)


def beside_station(seed: int, metres: float, wrong: bool) -> tuple[Block, Block]:
    """Return a block of 2 x 5 photos, and the same with control below a station, on its photo and another."""
    made, random = simulate(strips=2, photos_per_strip=5, seed=seed), np.random.default_rng(seed)
    down = random.normal(size=3)
    down[2] = -abs(down[2]) - 1
    at = made.truth.photo_positions[2] + metres * down / np.linalg.norm(down)
    images = images_of(made.truth, [2], at)
    if wrong:
        images[3] = random.uniform(-80, 80, 2)
    block = with_point(made.block, images, at)
    sd = block.point_sd.copy()
    sd[-1] = 0.05
    return made.block, block.replace(point_sd=sd)


@pytest.mark.parametrize("metres", [0.01, 0.1, 1.0])
def test_control_beside_a_station_with_a_wrong_image_is_left_out(metres):
    """It turns photos as no other point can: these blocks did not converge, or ended bent."""
    for seed in range(6):
        without, block = beside_station(seed, metres, wrong=True)
        result = adjust(block)
        assert result.converged
        reason = "near-station"
        assert result.dropped == {"X": reason}
        sentence = str(phrase(f"reason.{reason}"))
        assert f"left out, {sentence}: X" in [str(each) for each in result.messages]
        np.testing.assert_allclose(result.photo_positions, adjust(without).photo_positions, atol=1e-3)
        lines = {(each.code, each.fields.get("point")) for each in result.verdict.lines}
        assert ("line.point-left-out", "X") in lines


def test_control_beside_a_station_stays_where_another_error_is_the_reason():
    without, block = beside_station(1, 1.0, wrong=False)
    assert adjust(block).dropped == {}
    for given in (without, block):
        xy = given.image_xy.copy()
        xy[100] += 40.0
        result = adjust(given.replace(image_xy=xy))
        assert result.verdict.code == "gross-errors"
        assert "X" not in result.dropped


def test_one_point_far_off_is_no_matter_of_units(made):
    """Heights in feet would bring it nearer, and leave the other control where it is."""
    at = made.truth.photo_positions[1].copy()
    images = {0: np.array([40.0, 50.0]), 1: np.array([3.0, 4.0])}
    block = with_point(made.block, images, at)
    result = diagnose(block, adjust(block)).result
    assert result.hints == ()
    assert result.verdict.code == "gross-errors"
    assert result.verdict.headline.startswith("Gross errors likely: 1) image of point X")


def test_a_photo_on_points_of_a_line_ends_as_converged_and_is_named():
    """Only the noise of the points keeps it from turning about the line: no step follows that to its end."""
    made = simulate(strips=2, photos_per_strip=6, seed=3)
    block, truth = made.block, made.truth
    # Numbers with which it crept for fifty steps.
    noise = np.random.default_rng(1).normal(size=(2, 5, 9))[1, :, 3:].reshape(5, 3, 2)
    others = block.image_photos != 3
    sd = np.broadcast_to(np.asarray(block.image_sd, dtype=float), block.image_xy.shape)
    line = block.replace(
        image_photos=block.image_photos[others],
        image_points=block.image_points[others],
        image_xy=block.image_xy[others],
        image_sd=sd[others],
    )
    foot = truth.photo_positions[3] - [0, 0, 4500.0]
    for k in range(5):
        images = images_of(truth, [2, 3, 4], foot + np.array([0, (k - 2) * 500.0, 0]))
        noisy = {photo: xy + 0.01 * own for (photo, xy), own in zip(images.items(), noise[k], strict=True)}
        line = with_point(line, noisy)
        line = line.replace(point_ids=[*line.point_ids[:-1], f"L{k}"])
    result = adjust(line)
    assert result.converged
    assert len(result.iterations) < 30
    name = block.photo_ids[3]
    assert any("hardly determine" in str(each) and name in str(each) for each in result.messages)
    assert weakest_photos(result)[0].photo == name
    alone = adjust(line.replace(**without(line, 3)))
    own = np.arange(len(block.photo_ids)) != 3
    np.testing.assert_allclose(result.photo_sd[own], alone.photo_sd[own], rtol=0.05)


def without(block: Block, photo: int) -> dict[str, np.ndarray]:
    """Return the images of a block without those of a photo."""
    names = ("image_photos", "image_points", "image_xy", "image_sd")
    return {name: getattr(block, name)[block.image_photos != photo] for name in names}


@pytest.mark.parametrize("every", [False, True])
def test_a_station_that_is_held_at_a_wrong_place_is_named_first(made, every):
    positions = made.truth.photo_positions.copy()
    positions[2, 0] += 30.0
    sd = np.full(made.block.photo_position_sd.shape, 0.0 if every else np.inf)
    sd[2] = 0.0
    held = made.block.replace(photo_positions=positions, photo_position_sd=sd)
    verdict = adjust(held).verdict
    named = Phrase("named.held", {"named": Phrase("named.position", {"photo": made.block.photo_ids[2]})})
    assert verdict.headline.startswith(f"Gross errors likely: 1) {named}")
    assert str(Phrase("part.fixed")) in verdict.headline
    # By so much the sum of squares falls where it is free.
    [test] = [each for each in verdict.tests if each.name.startswith(str(Phrase("test.held")))]
    sd[2] = np.inf
    free = adjust(held.replace(photo_position_sd=sd))
    fall = adjust(held).sums_of_squares.total - free.sums_of_squares.total
    assert test.value == pytest.approx(fall, rel=0.01)
    assert any(has_code(each, "line.held", name=named) for each in snoop(held).result.messages)


def test_nothing_is_said_of_what_is_held_rightly(made):
    sd = np.zeros(made.block.photo_position_sd.shape)
    held = made.block.replace(photo_positions=made.truth.photo_positions, photo_position_sd=sd)
    verdict = adjust(held).verdict
    assert verdict.code == "accepted"
    assert not any(each.name.startswith(str(Phrase("test.held"))) for each in verdict.tests)


def test_fixed_control_at_a_wrong_place_is_named_first(made):
    control = np.flatnonzero(np.isfinite(made.block.point_sd).all(axis=1))
    positions = made.block.point_positions.copy()
    positions[control[1]] += [0.0, 40.0, 0.0]
    sd = np.where(np.isfinite(made.block.point_sd), 0.0, np.inf)
    verdict = adjust(made.block.replace(point_positions=positions, point_sd=sd)).verdict
    named = Phrase(
        "named.held", {"named": Phrase("named.control", {"point": made.block.point_ids[control[1]]})}
    )
    assert verdict.headline.startswith(f"Gross errors likely: 1) {named}")


@pytest.mark.parametrize("name", ["hall 3, photo", "A on photo B", "7, which is held", "the photo of P"])
def test_check_names_a_held_station_or_point_in_full(made, name):
    photos, points = list(made.block.photo_ids), list(made.block.point_ids)
    control = int(np.flatnonzero(np.isfinite(made.block.point_sd).all(axis=1))[1])
    photos[2] = points[control] = name
    named = made.block.replace(photo_ids=photos, point_ids=points)
    positions, sd = named.photo_positions.copy(), named.photo_position_sd.copy()
    positions[2, 0] += 30.0
    sd[2] = 0.0
    (station,) = held_values(adjust(named.replace(photo_positions=positions, photo_position_sd=sd)))
    assert (station.photos, station.points) == ([name], [])
    positions, sd = named.point_positions.copy(), np.where(np.isfinite(named.point_sd), 0.0, np.inf)
    positions[control] += [0.0, 40.0, 0.0]
    (point,) = held_values(adjust(named.replace(point_positions=positions, point_sd=sd)))
    assert (point.photos, point.points) == ([], [name])


def test_the_report_and_the_document_have_the_worst(made):
    result = adjust(made.block)
    assert not [each for each in result.messages if "parallel" in str(each) or "station's" in str(each)]
    points, photos = weakest_points(result), weakest_photos(result)
    assert len(photos) == len(result.block.photo_ids)
    table = result.document().table("weakest.photos")
    assert table.columns[1].values.tolist() == [each.condition for each in photos]
    document = json.loads(result.to_json())["weakest"]
    assert [each["point"] for each in document["points"]] == [each.point for each in points]
    assert [each["condition"] for each in document["photos"]] == [each.condition for each in photos]
    # A photo's condition by hand.
    row = result.block.photo_ids.index(photos[0].photo)
    sd = np.sqrt(np.diag(result.photo_cofactors[row]))
    assert photos[0].condition == pytest.approx(
        np.linalg.cond(result.photo_cofactors[row] / np.outer(sd, sd))
    )
    assert weakest_points(adjust(made.block, covariance=False)) == []
