"""A point that two rays pull into a station is left out and named; the others keep their digits."""

from __future__ import annotations

import numpy as np
import pytest

from photogram import Message, _photocore, snoop
from photogram.collection import adjust, simulate

# A datum of its own: standard deviations depend on it, and without it on where the iterations end.
FREE = np.full((8, 9), np.inf)
FREE[0, :6] = FREE[4, 3] = 0
SOUND = simulate(photos=8, points=60, coarseness=0.2, seed=4).collection.replace(photo_sd=FREE)
WRONG = 60
"""The number of the point that is added."""


def with_point():
    """Add a point on two photos one of which sees it at the station of the other: it is to go there."""
    collection = SOUND
    photos = adjust(collection, tolerance=1e-14).photo_parameters
    station = -rotation(photos[0, :3]).T @ photos[0, 3:6]
    seen = _photocore.collection_images("bal", photos[[4]], station[np.newaxis])
    return collection.replace(
        point_positions=np.vstack([collection.point_positions, station + np.array([0.0, 0.5, 0.0])]),
        point_sd=np.vstack([collection.point_sd, np.full((1, 3), np.inf)]),
        image_photos=np.append(collection.image_photos, [0, 4]),
        image_points=np.append(collection.image_points, [WRONG, WRONG]),
        image_xy=np.vstack([collection.image_xy, [[40.0, 30.0]], seen]),
        image_sd=np.vstack([collection.image_sd, np.full((2, 2), 0.5)]),
    )


def rotation(w):
    """Rotation matrix of an angle-axis vector (Rodrigues)."""
    angle = np.linalg.norm(w)
    x, y, z = w / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize(("tolerance", "digits"), [(1e-10, 1e-4), (1e-12, 1e-6)])
def test_the_others_are_as_if_the_point_were_not_there(tolerance, digits):
    expected = adjust(SOUND, tolerance=tolerance)
    result = adjust(with_point(), tolerance=tolerance)
    assert result.converged
    assert Message.of("collection.points-collapsed", names=[str(WRONG)]) in result.messages
    assert result.point_rays[WRONG] == 0
    assert np.isnan(result.point_positions[WRONG]).all()
    np.testing.assert_allclose(result.photo_sd, expected.photo_sd, rtol=digits)
    np.testing.assert_allclose(result.point_sd[:WRONG], expected.point_sd, rtol=digits)
    # It is found as soon as it is there, not after it has crept ten thousand times nearer than the others.
    assert len(result.iterations) <= len(expected.iterations) + 3
    assert result.degrees_of_freedom == expected.degrees_of_freedom
    numbers = [iteration.number for iteration in result.iterations]
    assert numbers == list(range(1, len(numbers) + 1))


def test_a_point_that_other_photos_tell_from_the_station_stays():
    """However near it is: one photo more sees it where it is."""
    collection = with_point()
    near = collection.point_positions[WRONG] - [0.0, 0.5, 0.0] + [0.03, 0.0, 0.04]
    photos = adjust(SOUND, tolerance=1e-14).photo_parameters
    extra = [0, 3, 4, 5]
    others = collection.image_points != WRONG
    known = collection.replace(
        point_positions=np.vstack([collection.point_positions[:WRONG], near + 0.01]),
        image_photos=np.append(collection.image_photos[others], extra),
        image_points=np.append(collection.image_points[others], [WRONG] * 4),
        image_xy=np.vstack(
            [
                collection.image_xy[others],
                _photocore.collection_images("bal", photos[extra], np.tile(near, (4, 1))),
            ]
        ),
        image_sd=np.vstack([collection.image_sd[others], np.full((4, 2), 0.5)]),
    )
    result = adjust(known, tolerance=1e-12)
    assert result.converged
    assert result.point_rays[WRONG] == 4
    assert np.linalg.norm(result.point_positions[WRONG] - near) < 0.05


@pytest.mark.parametrize("count", [2, 4])
def test_a_photo_with_too_few_points_is_left_out(count):
    """Four points are eight equations for nine unknowns: the others have their covariances without it."""
    own = np.flatnonzero(SOUND.image_photos == 3)
    alone, few = SOUND.image_photos != 3, np.isin(np.arange(len(SOUND.image_photos)), own[:count])

    def keep(images):
        names = ("image_photos", "image_points", "image_xy", "image_sd")
        return SOUND.replace(**{name: getattr(SOUND, name)[images] for name in names})

    result, expected = adjust(keep(alone | few)), adjust(keep(alone))
    assert result.converged
    assert Message.of("collection.photos-undetermined", names=["3"]) in result.messages
    others = np.arange(8) != 3
    np.testing.assert_allclose(result.photo_sd[others], expected.photo_sd[others], rtol=1e-5)
    assert np.isnan(result.photo_sd[3]).all()
    assert snoop(keep(alone | few), unit_weight="known").removed == []
