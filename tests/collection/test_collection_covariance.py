"""Covariances of anything in a collection with anything else, and of functions."""

from __future__ import annotations

import numpy as np
import pytest

from photogram import InputError, RankError
from photogram._photocore import collection_images
from photogram.collection import Collection, adjust, simulate

MADE = simulate(photos=6, points=40, coarseness=0.2, seed=1).collection


@pytest.fixture(scope="module")
def result():
    return adjust(MADE, tolerance=1e-12)


def test_blocks_on_the_diagonal_are_those_of_the_result(result):
    covariances = result.covariances()
    joint = covariances.covariance([("photo", [1, 4]), ("point", [3, 7])])
    assert joint.shape == (24, 24)
    np.testing.assert_array_equal(joint, joint.T)
    for at, expected in ((0, result.photo_covariances[1]), (9, result.photo_covariances[4])):
        sd = np.sqrt(np.diag(expected))
        scale = np.outer(sd, sd) + (expected == 0)
        np.testing.assert_allclose(joint[at : at + 9, at : at + 9] / scale, expected / scale, atol=1e-6)
    np.testing.assert_allclose(joint[18:21, 18:21], result.point_covariances[3], rtol=1e-5)
    # The parts of a photo, and one thing with all of a kind.
    parts = covariances.covariance([("pose", 4), ("camera", 4)])
    np.testing.assert_allclose(parts, joint[9:18, 9:18], rtol=1e-9)
    assert covariances.covariance(("camera", 4), ("point", None)).shape == (3, 3 * result.used_points.sum())
    labels = covariances.labels([("camera", 4), ("point", 7)])
    assert labels[0] == ("camera", "4", MADE.parameters[6])
    assert labels[-1] == ("point", "7", "Z")


def test_redundancy_numbers_follow_from_covariances_between_photo_and_point(result):
    covariances = result.covariances()
    for image in (0, 17, 101, len(MADE.image_xy) - 1):
        photo, point = int(MADE.image_photos[image]), int(MADE.image_points[image])

        def seen(parameters, position):
            return collection_images(MADE.camera, parameters[np.newaxis], position[np.newaxis])[0]

        found = covariances.propagate(seen, [("photo", photo), ("point", point)])
        shares = (found.standard_deviation / MADE.image_sd[image]) ** 2 / result.covariance_scale
        np.testing.assert_allclose(1 - shares, result.redundancy[image], atol=1e-6)


def test_a_ratio_of_distances_knows_of_no_datum(result):
    """Everything moved and held elsewhere: the photo with most images is another one."""
    fewer = np.flatnonzero(~((MADE.image_photos == result.datum[0][0]) & (MADE.image_points < 3)))
    some = {
        name: getattr(MADE, name)[fewer] for name in ("image_photos", "image_points", "image_xy", "image_sd")
    }
    made = MADE.replace(**some)
    found = []
    for held in (0, 5):
        sd = np.full(made.photo_sd.shape, np.inf)
        sd[held, :6] = 0.0
        sd[(held + 1) % 6, 3 + np.abs(made.photo_parameters[(held + 1) % 6, 3:6]).argmax()] = 0.0
        adjusted = adjust(made.replace(photo_sd=sd), tolerance=1e-13)

        def ratio(p):
            lengths = ((p[1:] - p[0]) ** 2).sum(axis=1)
            return np.sqrt(lengths[0] / lengths[1])

        found.append(adjusted.propagate(ratio, ("point", [3, 11, 29])))
    assert found[0].value == pytest.approx(found[1].value, abs=1e-3 * found[0].standard_deviation)
    assert found[0].standard_deviation == pytest.approx(found[1].standard_deviation, rel=1e-4)


def test_what_has_no_covariance_is_refused(result):
    covariances = result.covariances()
    for selection, message in (
        (("step", 1), "a selection must be a pair of a kind"),
        (("photo", 6), "the photo '6' is unknown"),
        (("point", -1), "the point '-1' is unknown"),
        (("point", 1.5), "names of the kind point"),
        (("point", True), "names of the kind point"),
    ):
        with pytest.raises(InputError, match=message):
            covariances.covariance(selection)
    twice = MADE.image_points != 7
    twice |= MADE.image_photos == MADE.image_photos[MADE.image_points == 7][0]
    names = ("image_photos", "image_points", "image_xy", "image_sd")
    fewer = adjust(MADE.replace(**{name: getattr(MADE, name)[twice] for name in names}))
    with pytest.raises(InputError, check=lambda error: error.code == "collection.point-excluded"):
        fewer.covariance(("point", 7))
    assert fewer.covariance(("point", None)).shape == (3 * 39, 3 * 39)


def test_two_collections_without_a_common_point_have_none():
    def two(name, shift=0):
        return np.concatenate([getattr(MADE, name), getattr(MADE, name) + shift])

    both = Collection(
        camera=MADE.camera,
        photo_parameters=two("photo_parameters"),
        point_positions=two("point_positions"),
        image_photos=two("image_photos", 6),
        image_points=two("image_points", 40),
        image_xy=two("image_xy"),
        image_sd=two("image_sd"),
        photo_sd=np.where(np.arange(12)[:, np.newaxis] == 0, 1.0, np.inf) * np.ones((12, 9)),
    )
    result = adjust(both)
    with pytest.raises(RankError):
        result.covariances()


def test_influences_on_chosen_unknowns_of_all_observations_make_up_their_cofactors(result):
    """Q A^T A Q = Q: the squares of what one standard deviation in each observation does sum to q."""
    reliability = result.reliability()
    labels, effects = reliability.influence(("camera", 2))
    assert [label[:2] for label in labels] == [("camera", "2")] * 3
    by_sd = effects / (reliability.detectable / reliability.sd)
    cofactors = np.diag(result.photo_cofactors[2])[6:]
    np.testing.assert_allclose((by_sd**2).sum(axis=1), cofactors, rtol=1e-5)
