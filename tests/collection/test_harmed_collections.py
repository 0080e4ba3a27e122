"""What harms a collection as a whole: points that run off, photos on a line, held values that are wrong."""

from __future__ import annotations

import json
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import photogram
from photogram import Message, _photocore, snoop
from photogram.collection import Collection, adjust, simulate
from photogram.collection.snooping import as_block
from photogram.results import network_sections

GIVEN = simulate(photos=8, points=60, coarseness=0.2, seed=4).collection
FREE = np.full((8, 9), np.inf)
FREE[0, :6] = FREE[4, 3] = 0
ADJUSTED = adjust(GIVEN.replace(photo_sd=FREE), tolerance=1e-12)
PHOTOS = ADJUSTED.photo_parameters
LINE = 3
"""The photo that sees nothing but points on a line."""


def weakest_points(result):
    return [SimpleNamespace(**row) for row in network_sections.weakest_points(result).record()]


def weakest_photos(result):
    return [SimpleNamespace(**row) for row in network_sections.weakest_photos(result).record()]


def sound(datum: bool) -> Collection:
    """Return the collection with a datum of its own, or without."""
    return GIVEN.replace(photo_sd=FREE) if datum else GIVEN


def rotation(w):
    """Rotation matrix of an angle-axis vector (Rodrigues)."""
    angle = np.linalg.norm(w)
    x, y, z = w / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def with_points(collection, places, photos, seed):
    """Add points with images of half a pixel's noise on some photos."""
    random = np.random.default_rng(seed)
    seen = [
        _photocore.collection_images("bal", PHOTOS[photos], np.tile(at, (len(photos), 1))) for at in places
    ]
    first, images = len(collection.point_positions), len(places) * len(photos)
    return collection.replace(
        point_positions=np.vstack([collection.point_positions, places]),
        point_sd=np.vstack([collection.point_sd, np.full((len(places), 3), np.inf)]),
        image_photos=np.append(collection.image_photos, np.tile(photos, len(places))),
        image_points=np.append(
            collection.image_points, first + np.repeat(np.arange(len(places)), len(photos))
        ),
        image_xy=np.vstack([collection.image_xy, *(xy + 0.5 * random.normal(size=xy.shape) for xy in seen)]),
        image_sd=np.vstack([collection.image_sd, np.full((images, 2), 0.5)]),
    )


def far_point(datum, distance, start=None):
    """Add a point far in front of two photos: its rays are parallel, or part by their noise."""
    axes = [rotation(PHOTOS[photo, :3]).T for photo in (0, 1)]
    station = -axes[0] @ PHOTOS[0, 3:6]
    along = -axes[0][:, 2] - axes[1][:, 2]
    along /= np.linalg.norm(along)
    made = with_points(sound(datum), [station + distance * along], [0, 1], 1)
    if start is None:
        return made
    points = made.point_positions.copy()
    points[-1] = station + start * along
    return made.replace(point_positions=points)


@pytest.mark.parametrize("start", [None, 10.0])
@pytest.mark.parametrize("distance", [1e3, 1e4, 1e6, 3e7])
@pytest.mark.parametrize("datum", [True, False])
def test_a_point_on_nearly_parallel_rays_is_named_and_harms_nothing(datum, distance, start):
    result = adjust(far_point(datum, distance, start))
    assert result.converged
    assert len(result.iterations) < 120
    codes = [
        each.code
        for each in result.messages
        if (each.code == "adjust.points.flat" and each.phrase.fields["points"] == ["60"])
        or each == Message.of("collection.points-not-determined", names=["60"])
    ]
    assert len(codes) == 1
    # It moves nothing else, and no message says so.
    assert not any("hardly determine a" in str(each) for each in result.messages)
    assert result.verdict.usable
    expected = adjust(sound(datum))
    np.testing.assert_allclose(result.photo_parameters[:, 6], expected.photo_parameters[:, 6], rtol=0.02)
    if datum:
        # Its direction may help; its distance must not harm.
        assert (result.photo_sd <= 1.05 * expected.photo_sd).all()


def on_a_line(datum, seed, fixed_camera, count=8):
    """Leave a photo nothing but points on a line."""
    collection, random = sound(datum), np.random.default_rng(seed)
    if fixed_camera:
        sd = collection.photo_sd.copy()
        sd[:, 6:] = 0
        own = np.hstack([collection.photo_parameters[:, :6], PHOTOS[:, 6:]])
        collection = collection.replace(photo_sd=sd, photo_parameters=own)
    names = ("image_photos", "image_points", "image_xy", "image_sd")
    others = collection.image_photos != LINE
    collection = collection.replace(**{name: getattr(collection, name)[others] for name in names})
    direction = random.normal(size=3)
    direction /= np.linalg.norm(direction)
    middle = np.median(ADJUSTED.point_positions, axis=0)
    places = [middle + step * direction for step in np.linspace(-0.5, 0.5, count)]
    return with_points(collection, places, [1, 2, 3, 4, 5], seed)


@pytest.mark.parametrize(
    ("datum", "seed", "fixed_camera", "count"),
    [
        (True, 11, False, 5),
        (False, 19, False, 5),
        (False, 3, False, 8),
        (False, 14, False, 8),
        (True, 10, True, 3),
        (True, 14, True, 3),
    ],
)
def test_a_photo_on_points_of_a_line_ends_as_converged(datum, seed, fixed_camera, count):
    """Noise alone keeps it from turning about the line: these took two hundred steps, and did not end."""
    result = adjust(on_a_line(datum, seed, fixed_camera, count))
    assert result.converged
    assert len(result.iterations) < 120
    assert any(
        ("hardly determine a combination" in str(each) and f"photos {LINE}" in str(each))
        or (each.code == "collection.weak-photos" and each.phrase.fields["names"] == [str(LINE)])
        for each in result.messages
    ), result.messages
    # What is known of the others is known all the same, and the photo carries no datum.
    others = np.arange(8) != LINE
    assert np.isfinite(result.photo_sd[others]).all()
    assert LINE not in {photo for photo, _ in result.datum}


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
@pytest.mark.parametrize("seed", range(3))
def test_it_ends_with_a_robust_loss_too(loss, seed):
    """Steps creep along the same valley: some took two hundred, and did not end."""
    for datum, fixed_camera in ((False, True), (True, False), (False, False)):
        result = adjust(on_a_line(datum, seed, fixed_camera, 6), loss=loss, max_iterations=200)
        assert result.converged
        assert len(result.iterations) < 150
        assert weakest_photos(result)[0].photo == LINE


@pytest.mark.parametrize("datum", [True, False])
def test_nothing_is_said_of_a_clean_collection(datum):
    for tolerance in (None, 1e-12):
        result = adjust(sound(datum), tolerance=tolerance)
        said = " ".join(str(each) for each in result.messages)
        assert "hardly determine" not in said, said
        assert "parallel" not in said
        assert "left out" not in said


def held(what: str, wrong: bool) -> Collection:
    """Return the collection with something held, at a wrong value or at the adjusted one."""
    photos, points = PHOTOS.copy(), ADJUSTED.point_positions.copy()
    photo_sd, point_sd = FREE.copy(), GIVEN.point_sd.copy()
    if what == "translation":
        photo_sd[:, 3:6] = 0
        photos[2, 3] += 0.1 * wrong
    elif what == "camera":
        photo_sd[2, 6:] = 0
        photos[2, 6] *= 1 + 0.1 * wrong
    else:
        photo_sd[:] = np.inf
        point_sd[:12] = 0
        points[5, 0] += 0.2 * wrong
    return GIVEN.replace(
        photo_parameters=photos, point_positions=points, photo_sd=photo_sd, point_sd=point_sd
    )


NAMES = {
    "translation": "translation of photo 2",
    "camera": "camera of photo 2",
    "point": "control point 5",
}


@pytest.mark.parametrize("what", NAMES)
def test_what_is_held_at_a_wrong_value_is_named_first(what):
    collection = held(what, wrong=True)
    verdict = adjust(collection).verdict
    assert verdict.headline.startswith(f"Gross errors likely: 1) {NAMES[what]} (fixed)")
    assert "give it a standard deviation" in verdict.headline
    remarks = [each for each in snoop(collection).result.messages if each.code == "line.held"]
    assert any(str(each).startswith(f"{NAMES[what]} (fixed)") for each in remarks)


@pytest.mark.parametrize("what", NAMES)
def test_nothing_is_said_of_what_is_held_rightly(what):
    result = adjust(held(what, wrong=False))
    assert result.verdict.code == "accepted"
    assert not any(test.name.startswith("held values") for test in result.verdict.tests)


def test_the_report_the_page_and_the_document_have_the_worst():
    result = adjust(far_point(True, 1e6))
    points, photos = weakest_points(result), weakest_photos(result)
    assert points[0].point == 60
    assert points[0].ratio > 1e6
    assert all(a.condition >= b.condition for a, b in pairwise(photos))
    # The photo whose pose is held has none.
    assert sorted(each.photo for each in photos) == list(range(1, 8))
    table = result.document().table("weakest.photos")
    assert table.columns[1].values.tolist() == [each.condition for each in photos]
    document = json.loads(result.to_json())["weakest"]
    assert [each["point"] for each in document["points"]] == [each.point for each in points]
    assert [each["condition"] for each in document["photos"]] == [each.condition for each in photos]
    page = result.to_html().decode()
    assert "Condition of the covariance matrix" in page
    assert "Largest over smallest sd" in page
    assert weakest_points(adjust(GIVEN, covariance=False)) == []


def test_conditions_are_those_of_the_same_photos_as_a_block():
    """Stations and attitudes, whatever unknowns they come from and wherever the origin is."""
    held = GIVEN.point_sd.copy()
    held[::6] = 0.01
    fixed = np.full((8, 9), np.inf)
    fixed[:, 6:] = 0
    given = ADJUSTED.adjusted().replace(point_sd=held, photo_sd=fixed)
    result, block = adjust(given, tolerance=1e-12), photogram.adjust(as_block(given))
    images = {other.photo: other.images for other in weakest_photos(block)}
    assert {f"photo {found.photo}": found.images for found in weakest_photos(result)} == images
    for found, other in zip(weakest_points(result), weakest_points(block), strict=True):
        assert f"point {found.point}" == other.point
        assert found.ratio == pytest.approx(other.ratio, rel=1e-3)
        assert found.distance == pytest.approx(other.distance, rel=1e-3)
    # By hand, from the covariance of the station and of a small turn about the axes of the photo.
    photo = weakest_photos(result)[0].photo
    w, t = result.photo_parameters[photo, :3], result.photo_parameters[photo, 3:6]
    partials, step = np.zeros((6, 6)), 1e-6
    for k in range(6):
        ends = []
        for sign in (-1, 1):
            moved = np.concatenate([w, t])
            moved[k] += sign * step
            turn = rotation(moved[:3]).T
            between = rotation(w) @ turn
            small = [
                between[2, 1] - between[1, 2],
                between[0, 2] - between[2, 0],
                between[1, 0] - between[0, 1],
            ]
            ends.append(np.concatenate([-turn @ moved[3:], 0.5 * np.array(small)]))
        partials[:, k] = (ends[1] - ends[0]) / (2 * step)
    covariance = partials @ result.photo_cofactors[photo, :6, :6] @ partials.T
    sd = np.sqrt(np.diag(covariance))
    by_hand = np.linalg.cond(covariance / np.outer(sd, sd))
    assert weakest_photos(result)[0].condition == pytest.approx(by_hand, rel=1e-6)
