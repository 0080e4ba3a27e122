"""What holds of poses as functions of time: degree 0, equal spaces, other clocks, numbers of threads."""

from dataclasses import replace

import numpy as np
import pytest

from moving_blocks import rolling, scanned
from photogram import Attitudes, adjust, simulate
from photogram.network import Lines, Polynomial, Shutter, Spline, Table, Timed, Trajectory


def agree(one, other, digits=1e-9):
    """Assert that two adjustments found the same, in standard deviations and redundancy numbers."""
    assert one.degrees_of_freedom == other.degrees_of_freedom
    assert one.sums_of_squares.total == pytest.approx(other.sums_of_squares.total, rel=digits)
    sd = np.sqrt(np.einsum("nkk->nk", one.point_cofactors))
    known = sd > 0
    assert (np.abs(one.point_positions - other.point_positions)[known] < digits * sd[known]).all()
    np.testing.assert_allclose(
        other.point_cofactors, one.point_cofactors, rtol=0, atol=digits * sd.max() ** 2
    )
    np.testing.assert_allclose(other.redundancy, one.redundancy, rtol=0, atol=digits)


@pytest.fixture(scope="module")
def frames():
    block = simulate(strips=2, photos_per_strip=4, seed=3).block
    return block, adjust(block, tolerance=1e-12)


def test_a_frame_is_the_case_of_degree_0_and_one_record(frames):
    block, still = frames
    attitudes = Attitudes.of("omega_phi_kappa", block.photo_attitudes).matrices
    assert np.isinf(block.photo_attitude_sd).all()
    observed = block.photo_positions_observed
    places = block.photo_positions if observed is None else observed
    timed = [
        Timed(
            name,
            Trajectory(
                name,
                Table([5.0], [place], [5.0], [attitude]),
                position=Polynomial(0, sd=sd[np.newaxis]),
                rotation=Polynomial(0),
            ),
            time=5.0,
        )
        for name, place, attitude, sd in zip(
            block.photo_ids, places, attitudes, block.photo_position_sd, strict=True
        )
    ]
    flown = adjust(block.replace(timed=timed), tolerance=1e-12)
    agree(still, flown)
    for row, name in enumerate(block.photo_ids):
        pose = flown.trajectories[name].poses([5.0])
        sd = still.photo_sd[row, :3]
        assert (np.abs(pose.positions[0] - still.photo_positions[row]) < 1e-8 * sd).all()
        np.testing.assert_allclose(pose.sd[0, :3], sd, rtol=1e-8)


def test_a_shutter_that_takes_no_time_is_a_frame(frames):
    block, still = frames
    shutter = Shutter(0.0, edges=(115.0, -115.0))
    timed = [Timed(name, shutter=shutter, sd_velocity=0.0, sd_rate=0.0) for name in block.photo_ids]
    agree(still, adjust(block.replace(timed=timed), tolerance=1e-12))


def flown_by(block, position, rotation):
    """Return a block whose trajectories have corrections by these bases."""
    own = {}
    for each in block.timed:
        given = each.trajectory
        if id(given) not in own:
            own[id(given)] = Trajectory(
                given.name, given.table, position=position(given), rotation=rotation(given)
            )
    timed = [replace(each, trajectory=own[id(each.trajectory)]) for each in block.timed]
    return block.replace(timed=timed, observations=[])


def test_a_cubic_is_a_spline_of_one_interval():
    block = scanned(records=False)

    def cubic(sd):
        return lambda given: Polynomial(3, sd=sd)

    def spline(given):
        first, last = given.table.span
        step = last - first
        return Spline(knots=first + step * np.arange(-3, 5))

    # Positions are known: where both are free, the track and the pitch are one.
    polynomial = adjust(flown_by(block, lambda _: None, cubic(np.inf)), tolerance=1e-12)
    of_spline = adjust(flown_by(block, lambda _: None, spline), tolerance=1e-12)
    agree(polynomial, of_spline, 1e-7)
    np.testing.assert_allclose(of_spline.residuals, polynomial.residuals, rtol=0, atol=1e-8 * 0.003)


def later(block, shift):
    """Return a block all of whose times are so much later."""
    own = {}
    for each in block.timed:
        given = each.trajectory
        if id(given) not in own:
            table = replace(
                given.table,
                times=given.table.times + shift,
                attitude_times=given.table.attitude_times + shift,
            )
            bases = {
                name: replace(basis, knots=np.asarray(basis.knots) + shift, every=None)
                for name, basis in (("position", given.position), ("rotation", given.rotation))
            }
            own[id(given)] = Trajectory(given.name, table, **bases)
    timed = []
    for each in block.timed:
        rows = np.array(each.lines.table)
        rows[:, 1] += shift
        timed.append(replace(each, trajectory=own[id(each.trajectory)], lines=Lines(rows)))
    observations = [
        replace(each, trajectory=own[id(each.moment.trajectory)], time=each.moment.time + shift)
        for each in block.observations
    ]
    return block.replace(timed=timed, observations=observations)


def on_a_grid(block):
    """Return a block with times that are multiples of 2^-20 s: sums with large numbers are exact."""
    return later(later(block, 2.0**32), -(2.0**32))


def test_another_origin_of_time_changes_nothing():
    block = on_a_grid(scanned())
    agree(adjust(block, tolerance=1e-12), adjust(later(block, 2.0**30), tolerance=1e-12))


@pytest.mark.parametrize("block", [rolling, scanned])
def test_threads_leave_the_bits_alone(block):
    one, two = (adjust(block(), threads=threads) for threads in (1, 2))
    for name in ("point_positions", "point_cofactors", "redundancy", "residuals"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
