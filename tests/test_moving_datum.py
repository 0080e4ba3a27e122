"""Free networks with trajectories: what moves as a whole, minimum and inner constraints, what is not open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from message_codes import raises
from moving_blocks import READOUT, exponential, heading, rolling
from photogram import (
    AdjustmentError,
    Block,
    Camera,
    InnerConstraints,
    InputError,
    MinimumConstraints,
    Position,
    adjust,
)
from photogram.network import Attitude, Polynomial, Spline, Table, Timed, Trajectory

C = -0.1
"""Of the camera, in metres as everything else: images are in the unit of the object space."""
FINE = 1e-9
BASES = {
    "polynomials": {"position": Polynomial(2), "rotation": Polynomial(1)},
    "splines": {"position": Spline(every=2.0), "rotation": Spline(every=3.0, degree=2)},
}


def passes(bases: str = "splines", *, bent: float = 0.0) -> Block:
    """Return two crossing passes of eleven frames each over points without control.

    Their tables are straight, of one attitude each, or `bent` in it by so many radians.
    """
    random = np.random.default_rng(4)
    points = np.column_stack([random.uniform(-60, 60, (40, 2)), random.uniform(-8, 8, 40)])
    times = np.arange(0.0, 6.1, 0.5)
    timed, photos, seen, xy = [], [], [], []
    for strip, turn in enumerate((0.0, np.pi / 2)):
        attitude = heading(turn) @ exponential(np.array([0.02, -0.01, 0.03]))
        places = np.column_stack([18.0 * (times - 3), np.zeros(13), np.full(13, 90.0)]) @ heading(turn).T
        waves = [exponential(bent * np.array([np.sin(3 * t), np.cos(2 * t), 0.0])) for t in times]
        table = Table(times, places, times, np.array([attitude @ each for each in waves]))
        own = Trajectory(f"pass {strip + 1}", table, **BASES[bases])
        for k, time in enumerate(times[1:-1].tolist()):
            name = f"{strip + 1}.{k}"
            timed.append(Timed(name, own, time))
            c = places[k + 1] + 0.3 * np.array([np.sin(0.4 * time), np.cos(0.3 * time), 0.2 * time])
            a = attitude @ waves[k + 1] @ exponential(np.array([0.001, 0.002, -0.001]) * time)
            u = (points - c) @ a
            photos += [len(timed) - 1] * len(points)
            seen += range(len(points))
            xy.append(C * u[:, :2] / u[:, 2:])
    count = len(timed)
    return Block(
        photo_ids=[each.photo for each in timed],
        photo_positions=np.tile([0.0, 0.0, 90.0], (count, 1)),
        photo_attitudes=np.zeros((count, 3)),
        cameras=[Camera("perspective", {"c": C})],
        photo_cameras=[0] * count,
        point_ids=[f"P{k}" for k in range(len(points))],
        point_positions=np.full(points.shape, np.nan),
        point_sd=np.inf,
        image_photos=photos,
        image_points=seen,
        image_xy=np.concatenate(xy) + random.normal(0, 1e-5, (len(photos), 2)),
        image_sd=1e-5,
        timed=timed,
    )


def names_of(block: Block) -> list[str]:
    """Return the names of all coefficients, trajectory by trajectory."""
    return [each.name for own in block.all_trajectories for part in own.coefficients for each in part]


def design(result) -> np.ndarray:
    """Return the weighted partials of all images by coefficients and points, as adjusted."""
    block = result.block
    every = block.all_trajectories
    names = names_of(block)
    rows = np.zeros((len(block.image_xy), 2, 3 * len(names) + 3 * len(block.point_ids)))
    for photo, own in enumerate(block.timed):
        adjusted = result.trajectories[own.trajectory.name]
        found = own.trajectory.flown(np.array([own.time]), adjusted.position, adjusted.rotation)
        places, turned, axes, jacobians, of_position, of_rotation = found
        a = turned.reshape(3, 3)
        first = 3 * sum(
            len(p) + len(r) for p, r in (t.coefficients for t in every[: every.index(own.trajectory)])
        )
        count = 3 * len(own.trajectory.coefficients[0])
        for image in np.flatnonzero(block.image_photos == photo):
            point = block.image_points[image]
            u = (result.point_positions[point] - places[0]) @ a
            by_u = C / u[2] * np.array([[1, 0, -u[0] / u[2]], [0, 1, -u[1] / u[2]]])
            by_rho = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
            start = first
            for active, by in (
                (of_position[0], -a.T @ axes.reshape(3, 3)),
                (of_rotation[0], by_rho @ jacobians.reshape(3, 3)),
            ):
                for k, value in enumerate(active[1]):
                    column = start + 3 * (active[0] + k)
                    rows[image, :, column : column + 3] = value * by_u @ by
                start += count
            column = 3 * (len(names) + point)
            rows[image, :, column : column + 3] = by_u @ a.T
    return rows.reshape(-1, rows.shape[2]) / 1e-5


@pytest.mark.parametrize("bases", list(BASES))
def test_inner_constraints_are_those_of_the_singular_values(bases):
    block = passes(bases)
    result = adjust(block, datum=InnerConstraints(), tolerance=FINE)
    assert result.converged
    assert str(result.datum) == "inner constraints over 40 points, scale included"
    a = design(result)
    *_, s, vt = np.linalg.svd(a, full_matrices=False)
    assert s[-8] > 1e3 * s[-7]
    g = vt[-7:].T
    b = g.copy()
    b[: -3 * len(block.point_ids)] = 0.0
    to = np.eye(len(g)) - g @ np.linalg.solve(b.T @ g, b.T)
    q = to @ (vt[:-7].T / s[:-7] ** 2) @ vt[:-7] @ to.T
    scale = result.covariance_scale
    found = result.covariance([("unknown", names_of(block)), ("point", None)]) / scale
    sd = np.sqrt(np.diag(q))
    np.testing.assert_allclose(found / np.outer(sd, sd), q / np.outer(sd, sd), atol=2e-5)
    for k in (0, 17):
        own = slice(3 * (len(names_of(block)) + k), 3 * (len(names_of(block)) + k) + 3)
        np.testing.assert_allclose(
            result.point_cofactors[k], q[own, own], rtol=1e-4, atol=1e-4 * q[own, own].max()
        )
    hat = 1 - np.einsum("ij,jk,ik->i", a, q, a)
    np.testing.assert_allclose(result.redundancy.ravel(), hat, atol=1e-6)
    assert result.redundancy.sum() == pytest.approx(result.degrees_of_freedom, abs=1e-6)
    assert result.degrees_of_freedom == len(a) - a.shape[1] + 7


@pytest.mark.parametrize("bases", list(BASES))
def test_observations_know_of_no_datum(bases):
    block = passes(bases)
    minimum = adjust(block, tolerance=FINE)
    assert minimum.datum.kind == "minimum constraints"
    assert len(minimum.datum.held) == 7
    assert minimum.datum.has_chosen_scale
    chosen = adjust(block, tolerance=FINE, datum=MinimumConstraints("2.5", ("1.0", "X")))
    held = {f"{unknown} of {name}" for name, unknown in chosen.datum.held}
    first, second = (own.position for own in block.all_trajectories)
    # Both passes cross in the middle, so that the first coefficient of the other polynomial is no scale.
    about, other = (0, 1) if bases == "polynomials" else (_nearest(second, 3.0), _nearest(first, 0.5))
    assert {f"{axis} of pass 2 position {about}" for axis in "xyz"} < held
    assert f"x of pass 1 position {other}" in held
    inner = adjust(block, tolerance=FINE, datum=InnerConstraints())
    for other in (chosen, inner, minimum.in_datum(InnerConstraints()), chosen.in_datum(InnerConstraints())):
        # In standard deviations: a turn of the whole is followed to the square of the corrections.
        np.testing.assert_allclose(other.residuals / 1e-5, minimum.residuals / 1e-5, atol=1e-3)
        np.testing.assert_allclose(other.redundancy, minimum.redundancy, atol=1e-5)
        assert other.degrees_of_freedom == minimum.degrees_of_freedom
        assert other.redundancy.sum() == pytest.approx(other.degrees_of_freedom, abs=1e-5)
        if other is not chosen:
            np.testing.assert_allclose(other.point_positions, inner.point_positions, atol=2e-3 * 1e-2)
            np.testing.assert_allclose(other.point_sd, inner.point_sd, rtol=1e-3)
            poses = [each.trajectories["pass 1"].poses([2.3]) for each in (other, inner)]
            np.testing.assert_allclose(poses[0].sd, poses[1].sd, rtol=1e-3)
            assert (np.abs(poses[0].positions - poses[1].positions) < 1e-2 * poses[1].sd[:, :3]).all()


def _nearest(basis: Spline, time: float) -> int:
    knots, p = np.asarray(basis.knots), basis.degree
    return int(np.argmin([abs(knots[k + 1 : k + p + 1].mean() - time) for k in range(basis.count)]))


def test_bends_of_a_table_tell_turns():
    """A turn of the whole would turn them as the basis cannot follow; shifts and scale stay open."""
    result = adjust(passes(bent=0.03))
    assert result.converged
    assert len(result.datum.held) == 4
    assert {unknown for _, unknown in result.datum.held} == {"x", "y", "z"}
    inner = result.in_datum(InnerConstraints())
    assert inner.redundancy.sum() == pytest.approx(inner.degrees_of_freedom, abs=1e-5)


def test_uniform_motions_of_photos_move_as_a_whole():
    block = rolling(readout=READOUT)
    free = [replace(each, sd_velocity=np.inf, sd_rate=np.inf) for each in block.timed]
    block = block.replace(timed=free, point_sd=np.inf)
    result = adjust(block, datum=InnerConstraints())
    assert result.datum.scale
    assert len(result.datum.held) == 7
    assert result.redundancy.sum() == pytest.approx(result.degrees_of_freedom, abs=1e-5)
    assert "undetermined" not in " ".join(map(str, result.messages))


def test_known_velocities_turn_and_scale():
    result = adjust(rolling(readout=READOUT).replace(point_sd=np.inf))
    held = {f"{unknown} of {name}" for name, unknown in result.datum.held}
    assert held == {f"{axis} of IMG_2 position 0" for axis in "xyz"}
    assert not result.datum.has_chosen_scale


def test_records_give_what_they_tell():
    block = passes()
    first, second = block.all_trajectories
    times = np.arange(0.5, 6.0, 0.5).tolist()
    attitude = first.table.attitudes[0]
    turned = [Attitude(None, attitude, sd=1e-4, trajectory=first, time=time) for time in times]
    levelled = adjust(block.replace(observations=turned))
    assert len(levelled.datum.held) == 4
    places = [
        Position(None, own.flown(np.array([time]), *_nothing(own))[0][0], sd=0.05, trajectory=own, time=time)
        for own in (first, second)
        for time in times
    ]
    placed = adjust(block.replace(observations=places))
    assert placed.datum.kind == "observations"
    with pytest.raises(AdjustmentError, match="requires a free block"):
        placed.in_datum(InnerConstraints())


def _nothing(own: Trajectory) -> list[np.ndarray]:
    return [np.zeros((len(each), 3)) for each in own.coefficients]


def test_coordinates_are_those_of_the_table():
    block = passes()
    known: dict[int, Trajectory] = {}
    others = [
        replace(each, trajectory=known.setdefault(id(own), replace(own, position_axes="flight")))
        for each, own in zip(block.timed, block.trajectories, strict=True)
    ]
    with raises(InputError, "block.datum.axes"):
        adjust(block.replace(timed=others), datum=MinimumConstraints("2.5", ("1.0", "X")))
    result = adjust(block.replace(timed=others), datum=InnerConstraints())
    assert result.converged
    assert result.redundancy.sum() == pytest.approx(result.degrees_of_freedom, abs=1e-5)


def controlled(bases: str) -> Block:
    block = passes(bases)
    places = adjust(block).point_positions
    sd = np.where(np.arange(len(places)) < 8, 1e-3, np.inf)[:, np.newaxis] * np.ones(3)
    return block.replace(point_positions=places, point_sd=sd)


def turned(block: Block, turn: list[float], **bases: object) -> Block:
    """Return a block whose tables are turned about the axes of the photos."""
    known: dict[int, Trajectory] = {}

    def far(own: Trajectory) -> Trajectory:
        table = replace(own.table, attitudes=own.table.attitudes @ exponential(np.array(turn)))
        return known.setdefault(id(own), replace(own, table=table, **bases))

    return block.replace(timed=[replace(each, trajectory=far(each.trajectory)) for each in block.timed])


@pytest.mark.parametrize("bases", list(BASES))
@pytest.mark.parametrize("turn", [[0.0, 0.0, 1.2], [0.3, 0.0, 0.9]])
def test_a_table_takes_over_what_is_far(bases, turn):
    block = controlled(bases)
    good, bad = adjust(block, tolerance=FINE), adjust(turned(block, turn), tolerance=FINE)
    assert bad.messages[0].code == "adjust.rotations.tables"
    assert all(each.code != "adjust.rotations.tables" for each in good.messages)
    assert bad.sums_of_squares.total == pytest.approx(good.sums_of_squares.total, abs=0.01)
    assert (np.abs(bad.point_positions - good.point_positions) < 1e-3 * good.point_sd).all()
    np.testing.assert_allclose(bad.point_sd, good.point_sd, rtol=1e-4)
    own, other = bad.trajectories["pass 1"], good.trajectories["pass 1"]
    assert np.abs(own.corrections([0.6, 3.0, 5.4])[1]).max() < 0.03
    a, b = own.poses([1.7]), other.poses([1.7])
    assert (np.abs(a.positions - b.positions) < 1e-2 * b.sd[:, :3]).all()
    np.testing.assert_allclose(a.attitudes, b.attitudes, atol=0.05 * b.sd[0, 3:].max())
    np.testing.assert_allclose(a.sd, b.sd, rtol=1e-3)
    assert bad.block.all_trajectories[0] is own.given


def test_what_is_weighted_stays_in_its_table():
    """A turn of the whole is no sum: the given values would be others."""
    block = controlled("polynomials")
    far = turned(block, [0.0, 0.0, 0.8], rotation=Polynomial(1, sd=1.0))
    result = adjust(far)
    assert result.messages[0].code == "adjust.rotations.large"
    assert result.block.all_trajectories[0].table is far.all_trajectories[0].table


def test_the_attitude_of_a_photo_that_moves_is_taken_over_by_the_photo():
    block = rolling(readout=READOUT)
    # About the vertical, kappa alone.
    far = block.photo_attitudes + np.array([0.0, 0.0, 0.7])
    good, bad = adjust(block), adjust(block.replace(photo_attitudes=far))
    assert bad.messages[0].code == "adjust.rotations.tables"
    assert bad.sums_of_squares.total == pytest.approx(good.sums_of_squares.total, rel=1e-4)
    np.testing.assert_allclose(bad.photo_attitudes, good.photo_attitudes, atol=1e-5)
