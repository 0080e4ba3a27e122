"""Free networks with trajectories: what moves as a whole, minimum and inner constraints, what is not open."""

from __future__ import annotations

import numpy as np
import pytest

from moving_blocks import exponential, heading
from photogram import Block, Camera, InnerConstraints, MinimumConstraints, adjust
from photogram.network.moving_photos import Timed
from photogram.network.trajectories import Polynomial, Spline, Table, Trajectory

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
    k = 0 if bases == "polynomials" else 3
    assert {f"{axis} of pass 2 position {k}" for axis in "xyz"} < held
    inner = adjust(block, tolerance=FINE, datum=InnerConstraints())
    for other in (chosen, inner, minimum.in_datum(InnerConstraints()), chosen.in_datum(InnerConstraints())):
        np.testing.assert_allclose(other.residuals, minimum.residuals, atol=1e-8 * 1e-3)
        np.testing.assert_allclose(other.redundancy, minimum.redundancy, atol=1e-6)
        assert other.degrees_of_freedom == minimum.degrees_of_freedom
        if other is not chosen:
            np.testing.assert_allclose(other.point_positions, inner.point_positions, atol=1e-6)
            np.testing.assert_allclose(other.point_cofactors, inner.point_cofactors, rtol=1e-3, atol=1e-9)
            poses = [each.trajectories["pass 1"].poses([2.3]) for each in (other, inner)]
            np.testing.assert_allclose(poses[0].positions, poses[1].positions, atol=1e-6)
            np.testing.assert_allclose(poses[0].sd, poses[1].sd, rtol=1e-3)
