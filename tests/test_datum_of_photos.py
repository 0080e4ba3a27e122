"""Attitudes that carry a datum, and control that is exactly minimal."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from message_codes import as_check
from photogram import AdjustmentError, InnerConstraints, InputError, MinimumConstraints, adjust, simulate
from photogram.network import rotation_matrix


@pytest.fixture(scope="module")
def block():
    """Return a small block without control, its photos given to some metres and degrees."""
    own = simulate(strips=2, photos_per_strip=4, points_per_photo=12, seed=11).block
    return own.replace(
        point_sd=np.inf,
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_positions_observed=None,
        photo_attitudes_observed=None,
    )


@pytest.fixture(scope="module")
def minimum(block):
    return adjust(block)


def steps(result):
    """Return cofactors of all photos, by their steps, and of all points."""
    selection = [("step", None), ("point", None)]
    return result.covariances().covariance(selection) / result.covariance_scale


def null_vectors(result):
    """Return the shifts, rotations and the scale of photos, by their steps, and of points: (u, 7)."""
    attitudes = rotation_matrix(result.photo_attitudes).transpose(0, 2, 1)
    columns = []
    for k in range(7):

        def moved(place, k=k):
            if k < 3:
                return np.eye(3)[k]
            return np.cross(np.eye(3)[k - 3], place) if k < 6 else place

        turn = np.eye(3)[k - 3] if 3 <= k < 6 else np.zeros(3)
        photos = [
            np.concatenate([moved(place), attitude.T @ turn])
            for place, attitude in zip(result.photo_positions, attitudes, strict=True)
        ]
        columns.append(np.concatenate([*photos, *(moved(place) for place in result.point_positions)]))
    return np.column_stack(columns)


@pytest.mark.parametrize(
    "datum",
    [
        InnerConstraints(points=None, photos=None, attitudes=None),
        InnerConstraints(
            points=[], photos=["0101", "0204"], attitudes=["0101", "0103", "0204"], radius=500.0
        ),
    ],
)
def test_attitudes_carry_the_datum_as_the_dense_transformation_has_it(block, minimum, datum):
    free = minimum.in_datum(datum)
    photos, points = len(block.photo_ids), len(block.point_ids)
    radius = datum.radius
    if radius is None:
        places = np.vstack([block.photo_positions, adjust(block, max_iterations=1).point_positions])
        radius = np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean())
    weights = np.zeros((photos, 6))
    rows = [block.photo_ids.index(name) for name in datum.photos or block.photo_ids]
    weights[rows, :3] = 1.0
    rows = [block.photo_ids.index(name) for name in datum.attitudes or block.photo_ids]
    weights[rows, 3:] = radius**2
    d = np.concatenate([weights.ravel(), np.full(3 * points, float(datum.points is None))])
    # The start of points is where their rays meet; its radius is known to about a thousandth here.
    near = 1e-8 if datum.radius else 1e-2
    q, g = steps(free), null_vectors(free)
    s = np.eye(len(d)) - g @ np.linalg.solve(g.T @ (d[:, None] * g), g.T * d)
    sd = np.sqrt(np.diag(q))
    np.testing.assert_allclose(s @ q @ s.T / np.outer(sd, sd), q / np.outer(sd, sd), atol=near)
    # The condition B'(x - x0) = 0, x - x0 of an attitude being a rotation vector about the photo's axes.
    given = rotation_matrix(block.photo_attitudes).transpose(0, 2, 1)
    found = rotation_matrix(free.photo_attitudes).transpose(0, 2, 1)
    turns = Rotation.from_matrix(found.transpose(0, 2, 1) @ given).as_rotvec()
    if datum.points is not None:
        apart = np.hstack([block.photo_positions - free.photo_positions, turns]).ravel()
        amounts = (g.T * d)[:, : 6 * photos] @ apart
        scale = np.sqrt(((g**2).T * d).sum(axis=1) * (d[: 6 * photos] * apart**2).sum())
        assert np.abs(amounts / scale).max() < 1e-9
    np.testing.assert_allclose(free.redundancy, minimum.redundancy, atol=1e-9)
    np.testing.assert_allclose(free.residuals, minimum.residuals, atol=1e-9)
    assert "attitudes" in str(free.datum)


def test_attitudes_alone_leave_the_rest_as_it_was_refused(minimum):
    with pytest.raises(InputError, check=lambda error: error.code == "free.few"):
        minimum.in_datum(InnerConstraints(points=[], attitudes=None))
    with pytest.raises(InputError, check=as_check("error.at radius: error.positive 0.0")):
        InnerConstraints(attitudes=None, radius=0.0)


def controlled(block, sd):
    """Return the block with two points held, and the height of a third."""
    truth = simulate(strips=2, photos_per_strip=4, points_per_photo=12, seed=11).truth
    seen = np.bincount(block.image_points, minlength=len(block.point_ids))
    rows = np.argsort(-seen, kind="stable")[:40]
    places = truth.point_positions[rows]
    first, second = np.argmin(places[:, 0]), np.argmax(places[:, 0])
    third = np.argmax(np.abs(places[:, 1] - places[first, 1]))
    positions, deviations = block.point_positions.copy(), np.full((len(block.point_ids), 3), np.inf)
    for row, components in ((first, 3), (second, 3), (third, 1)):
        positions[rows[row]] = truth.point_positions[rows[row]]
        deviations[rows[row], 3 - components :] = sd
    return block.replace(point_positions=positions, point_sd=deviations)


@pytest.mark.parametrize("sd", [0.0, 0.01])
def test_control_that_is_exactly_minimal_is_said_to_be_so_and_goes_to_another_datum(block, minimum, sd):
    result = adjust(controlled(block, sd))
    assert result.datum.kind == "minimal control"
    assert "free.minimal-control" in [message.code for message in result.messages]
    assert result.degrees_of_freedom == minimum.degrees_of_freedom
    datum = InnerConstraints()
    found = result.in_datum(datum)
    np.testing.assert_allclose(found.redundancy, result.redundancy, atol=1e-8)
    np.testing.assert_allclose(found.redundancy, minimum.redundancy, atol=1e-8)
    np.testing.assert_allclose(found.residuals, result.residuals, atol=1e-8)
    # Cofactors are those of the network that never had control, where it stands now.
    same = minimum.in_datum(datum)
    size = np.sqrt(found.covariance_scale)
    spread = lambda result: result.point_positions - result.point_positions.mean(axis=0)  # noqa: E731
    ratio = np.linalg.norm(spread(found)) / np.linalg.norm(spread(same))
    np.testing.assert_allclose(
        np.trace(found.point_covariances, axis1=1, axis2=2).sum(),
        ratio**2 * np.trace(same.point_covariances, axis1=1, axis2=2).sum(),
        rtol=1e-6,
    )
    assert size > 0
    # Covariances of the result in its new datum, and a third datum from there.
    again = found.in_datum(InnerConstraints(photos=None))
    first = block.point_ids[0]
    np.testing.assert_allclose(
        found.covariances().covariance(("point", first)), found.point_covariances[0], rtol=1e-7, atol=1e-14
    )
    np.testing.assert_allclose(again.redundancy, found.redundancy, atol=1e-8)


def test_one_number_more_is_no_longer_minimal(block):
    own = controlled(block, 0.01)
    deviations = own.point_sd.copy()
    row = int(np.flatnonzero(np.isfinite(deviations[:, 2]) & np.isinf(deviations[:, 0]))[0])
    deviations[row] = 0.01
    positions = own.point_positions.copy()
    positions[row] = np.where(np.isnan(positions[row]), 0.0, positions[row])
    result = adjust(own.replace(point_sd=deviations))
    assert result.datum.kind == "observations"
    with pytest.raises(AdjustmentError, check=lambda error: error.code == "free.not-free"):
        result.in_datum(InnerConstraints())


def test_what_is_held_is_no_minimal_control(minimum, block):
    assert minimum.datum.kind == "minimum constraints"
    held = adjust(block, datum=MinimumConstraints(photo="0102"))
    assert held.datum.kind == "minimum constraints"
