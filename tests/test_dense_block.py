"""Random blocks, ordinary and extreme, against an independent dense solution in extended precision.

Coordinates, standard deviations and origins run from 1e-300 to 1e300. Every block ends in agreement with the
dense solution or in words: an exception of the package, a status, or a remark.
"""

from __future__ import annotations

import numpy as np
import pytest

from photogram import PhotogramError, adjust, simulate

pytestmark = pytest.mark.skipif(
    np.finfo(np.longdouble).eps > 1e-18, reason="this machine has no extended precision"
)

REAL, COMPLEX = np.longdouble, np.clongdouble
STEP = REAL(1e-30)


def images(positions, attitudes, distances, points):
    """Compute image coordinates, row by row: M = M_kappa M_phi M_omega, x = c u1 / u3, y = c u2 / u3."""
    (so, sp, sk), (co, cp, ck) = np.sin(attitudes).T, np.cos(attitudes).T
    dx, dy, dz = (points - positions).T
    y1, z1 = co * dy + so * dz, co * dz - so * dy
    x2, z2 = cp * dx - sp * z1, sp * dx + cp * z1
    u1, u2 = ck * x2 + sk * y1, ck * y1 - sk * x2
    return np.stack([distances * u1 / z2, distances * u2 / z2], axis=1)


def equations(block, result):
    """Return coefficients and right-hand sides, weighted to one, at the adjusted values."""
    used = result.used_points
    index = np.cumsum(used) - 1
    photos, kept = len(block.photo_ids), result.used_images
    photo, point = block.image_photos[kept], index[block.image_points[kept]]
    station = np.hstack([result.photo_positions, result.photo_attitudes]).astype(REAL)
    ground = result.point_positions[used].astype(REAL)
    distances = block.principal_distances[photo].astype(REAL)
    xy, sd = block.image_xy[kept].astype(REAL), block.image_sd[kept].astype(REAL)
    count, unknowns = len(photo), 6 * photos + 3 * len(ground)
    rows = np.arange(count)
    a = np.zeros((count, 2, unknowns), REAL)
    for k in range(9):
        pose, at = station[photo].astype(COMPLEX), ground[point].astype(COMPLEX)
        scale = np.maximum(np.abs(pose[:, k] if k < 6 else at[:, k - 6]).astype(REAL), REAL(1e-4000))
        step = STEP * np.where(scale > 0, scale, 1)
        column = 6 * photo + k if k < 6 else 6 * photos + 3 * point + k - 6
        (pose if k < 6 else at)[:, k if k < 6 else k - 6] += 1j * step
        moved = images(pose[:, :3], pose[:, 3:], distances, at)
        a[rows, :, column] = moved.imag / step[:, np.newaxis]
    computed = images(station[photo, :3], station[photo, 3:], distances, ground[point])
    a, right = (a / sd[:, :, np.newaxis]).reshape(-1, unknowns), ((xy - computed) / sd).ravel()
    values = np.concatenate([station.ravel(), ground.ravel()])
    given = np.concatenate(
        [
            np.hstack([block.photo_positions_observed, block.photo_attitudes_observed]).ravel(),
            block.point_positions[used].ravel(),
        ]
    )
    sds = np.concatenate(
        [np.hstack([block.photo_position_sd, block.photo_attitude_sd]).ravel(), block.point_sd[used].ravel()]
    ).astype(REAL)
    weighted = np.flatnonzero((sds > 0) & np.isfinite(sds))
    own = np.zeros((len(weighted), unknowns), REAL)
    own[np.arange(len(weighted)), weighted] = 1 / sds[weighted]
    a, right = (
        np.vstack([a, own]),
        np.concatenate([right, (given[weighted] - values[weighted]) / sds[weighted]]),
    )
    return a, right, np.flatnonzero(sds != 0), values.astype(float)


def solve(a, right):
    """Return the least-squares solution and the roots of its cofactors: Gram and Schmidt, twice."""
    scale = np.sqrt((a * a).sum(axis=0))
    q, columns = a / scale, a.shape[1]
    r = np.zeros((columns, columns), REAL)
    for k in range(columns):
        for _ in range(2):
            share = q[:, :k].T @ q[:, k]
            q[:, k] -= q[:, :k] @ share
            r[:k, k] += share
        r[k, k] = np.sqrt(q[:, k] @ q[:, k])
        q[:, k] /= r[k, k]
    inverse = np.zeros_like(r)
    for k in range(columns):
        inverse[k, k] = 1 / r[k, k]
        inverse[:k, k] = -(inverse[:k, :k] @ r[:k, k]) / r[k, k]
    return (inverse @ (q.T @ right)) / scale, np.sqrt((inverse * inverse).sum(axis=1)) / scale


def agrees(block, result):
    """Hold a result against the dense solution."""
    a, right, free, values = equations(block, result)
    total = result.sums_of_squares.total
    # Positions of large coordinates come back rounded.
    np.testing.assert_allclose(float(right @ right), total, rtol=1e-6, atol=1e-2 * len(right))
    alone = np.isnan(result.photo_sd).all(axis=1)
    for row in np.flatnonzero(alone):
        # Nothing is asked of it; what it was observed at, it stands at.
        said = [str(m) for m in result.messages if "photos that their images do not determine" in str(m)]
        assert block.photo_ids[row] in said[0]
    free = free[~np.isin(free // 6, np.flatnonzero(alone))]
    step, sd = solve(a[:, free], right)
    change = np.abs(step / sd).max()
    rounding = (np.spacing(np.abs(values))[free] / sd).max()
    assert change < 1e-3 + 3 * rounding, f"{change} standard deviations from the dense solution"
    if np.median(block.image_sd) > 1:
        # Standard deviations exceed the block, and so may be the last step: cofactors hold before it.
        return
    root = np.sqrt(REAL(result.covariance_scale))
    found = np.concatenate([result.photo_sd.ravel(), result.point_sd[result.used_points].ravel()])
    assert found.shape == values.shape
    # Cofactors are those before the last step, which is long where standard deviations are.
    np.testing.assert_allclose((found[free] / root / sd).astype(float), 1, rtol=2e-2)


ORDINARY = simulate(
    strips=2, photos_per_strip=3, points_per_photo=12, control="corners", check_points=0, position_sd=30.0,
    attitude_sd=0.02, seed=5,
).block  # fmt: skip


def test_an_ordinary_block_agrees():
    result = adjust(ORDINARY)
    assert result.converged
    agrees(ORDINARY, result)


def extreme(seed):
    """Return a block some of whose magnitudes are far from ordinary."""
    random = np.random.default_rng(seed)

    def power(most, share):
        return 10.0 ** random.uniform(-most, most) if random.random() < share else 1.0

    most = random.choice([3, 8, 16, 40, 300])
    length = power(most, 0.4)
    changes = {
        name: getattr(ORDINARY, name) * factor
        for name, factor in (
            ("photo_positions", length),
            ("point_positions", length),
            ("photo_position_sd", length * power(most, 0.4)),
            ("photo_attitude_sd", power(most, 0.4)),
            ("point_sd", length * power(most, 0.4)),
            ("image_sd", power(most, 0.4)),
        )
    }
    if random.random() < 0.4:
        offset = random.normal(0, 1, 3) * length * 1e3 * power(most, 1.0)
        changes["photo_positions"] = changes["photo_positions"] + offset
        changes["point_positions"] = changes["point_positions"] + offset
    for name in ("photo_positions", "photo_attitudes"):
        # What is observed stands at the initial values.
        changes.setdefault(name, getattr(ORDINARY, name))
    for name in ("photo_positions", "photo_attitudes", "photo_position_sd", "photo_attitude_sd", "image_sd"):
        if random.random() < 0.15:
            values = np.array(changes.get(name, getattr(ORDINARY, name)))
            row, column = random.integers(len(values)), random.integers(values.shape[1])
            values[row, column] *= 10.0 ** random.uniform(-most, most)
            changes[name] = values
    for name in ("photo_positions", "photo_attitudes"):
        changes[f"{name}_observed"] = changes[name]
    return changes


def steep(block, result):
    """Return whether an attitude ends far from where it is observed, which is near phi = 90 degrees.

    It is observed as one rotation there, not as three angles; nearby both are the same.
    """
    sd = block.photo_attitude_sd
    reach = np.maximum(3 * sd.max(axis=1), 0.087)
    near = np.abs(np.cos(block.photo_attitudes_observed[:, 1])) < reach
    far = np.abs(result.photo_attitudes - block.photo_attitudes_observed).max(axis=1) > 0.1
    return bool((near & far & np.isfinite(sd).all(axis=1) & (sd > 0).all(axis=1)).any())


def end(seed):
    """Return how an extreme block ends; refuses silence."""
    try:
        with np.errstate(all="ignore"):
            block = ORDINARY.replace(**extreme(seed))
        result = adjust(block, tolerance=1e-9, max_iterations=100)
    except PhotogramError:
        return "refused"
    if not result.converged:
        return result.status
    if any("there are no covariances" in str(m) or "stands still" in str(m) for m in result.messages):
        return "remarked"
    if steep(block, result):
        return "another model"
    agrees(block, result)
    return "agrees"


@pytest.mark.parametrize("part", range(4))
def test_no_extreme_block_is_wrong_without_a_word(part):
    ends = {seed: end(seed) for seed in range(50 * part, 50 * part + 50)}
    assert sum(one == "agrees" for one in ends.values()) >= 10, ends
