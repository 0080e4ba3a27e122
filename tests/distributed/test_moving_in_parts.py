"""Photos on trajectories in parts: coefficients go up with the first photo of theirs."""

from dataclasses import replace

import numpy as np
import pytest
from test_blocks import agrees

import test_moving
from moving_blocks import rolling, scanned
from photogram import AdjustOptions, adjust, adjust_in_parts, simulate
from photogram.adjustment.adjustment import core_options
from photogram.distributed import Division
from photogram.distributed.adjust import fingerprint
from photogram.network import LineScanner, Polynomial, RollingShutter

SIZE = {"strips": 3, "photos_per_strip": 6, "points_per_photo": 20, "seed": 3}
ERRORS = {"position_error": 1.0, "attitude_error": 1e-3}
RECORDS = {"position_sd": 0.05, "attitude_sd": 1e-4}


def scenes():
    """Return images of a scanner with coefficients of their own, weighted, as a planetary network has."""
    motion = LineScanner(lines=1, scenes=True, position=Polynomial(0), rotation=Polynomial(2))
    size = {"strips": 4, "photos_per_strip": 5, "points_per_photo": 40, "side_overlap": 0.6}
    return simulate(motion=motion, **size, **ERRORS, seed=3).block


def shutters():
    """Return photos of a rolling shutter, each with its own uniform motion, and a readout time of all."""
    return simulate(motion=RollingShutter(readout=0.03), **SIZE, **ERRORS, **RECORDS).block


def strips():
    """Return strips of three lines each, on splines, with records between those of their tables."""
    return simulate(motion=LineScanner(lines=3, speed=70.0), **SIZE, **ERRORS, **RECORDS).block


def same_unknowns(found, whole, least):
    """Compare common unknowns with those of one process: values in standard deviations, and cofactors."""
    for one, other in zip(found.unknowns, whole.unknowns, strict=True):
        deviations = np.sqrt(np.diag(other.cofactors))
        at = np.outer(deviations, deviations)
        assert np.abs((one.cofactors - other.cofactors)[at > 0] / at[at > 0]).max(initial=0.0) < least
        apart = (one.values - other.values)[deviations > 0] / deviations[deviations > 0]
        assert np.abs(apart).max(initial=0.0) < least
        np.testing.assert_allclose(one.redundancy, other.redundancy, rtol=0, atol=least)
        assert one.observations == other.observations


@pytest.mark.parametrize(
    ("make", "parts"), [(scenes, 2), (scenes, 5), (shutters, 4), (strips, 2), (rolling, 3)]
)
def test_trajectories_in_parts_are_those_of_one_process(make, parts):
    block = make()
    whole, found = adjust(block), adjust_in_parts(block, Division(parts=parts))
    agrees(found, whole, 1e-9, tied=True)
    same_unknowns(found, whole, 1e-9)
    assert [str(each) for each in found.messages] == [str(each) for each in whole.messages]
    for name, own in whole.trajectories.items():
        other = found.trajectories[name]
        np.testing.assert_allclose(other.position_sd, own.position_sd, rtol=1e-9)
        np.testing.assert_allclose(other.rotation_sd, own.rotation_sd, rtol=1e-9)


@pytest.mark.parametrize("smooth", [False, True])
def test_records_frames_and_smoothness_are_at_home_once(smooth):
    """Records of clocks, lever arms and boresights, and frames on the trajectory of a scanner."""
    block = scanned(photos=True, smooth=smooth)
    whole, found = adjust(block), adjust_in_parts(block, Division(parts=2))
    agrees(found, whole, 1e-8, tied=True)
    same_unknowns(found, whole, 1e-8)
    for kind, other in whole.kinds.items():
        np.testing.assert_allclose(found.kinds[kind].residuals, other.residuals, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.kinds[kind].redundancy, other.redundancy, rtol=0, atol=1e-8)


def test_a_run_is_that_of_its_trajectories():
    """Digits that are not shown, and smoothness, tell one block from another."""
    block, options = scanned(), core_options(AdjustOptions())
    later = block.replace(timed=[replace(each, time=1e-9) for each in block.timed])
    blocks = [block, later, scanned(smooth=True), scanned(records=False)]
    assert len({fingerprint(each, options) for each in blocks}) == 4
    assert fingerprint(block, options) == fingerprint(scanned(), options)


def coefficients(result, trajectory, which):
    """Return (K, 3) adjusted coefficients, and the cofactors of each by itself, which is what parts keep."""
    found = {id(each.given): each for each in result.unknowns}
    own = [found[id(each)] for each in trajectory.coefficients[which]]
    q = np.full((len(own), 3, len(own), 3), np.nan)
    for k, each in enumerate(own):
        q[k, :, k] = each.cofactors
    return np.array([each.position for each in own]), q.reshape(3 * len(own), -1)


def solved(result, solution, name, trajectory, which, *, unknowns=1e-6, cofactors=1e-8):
    """Assert the coefficients of a trajectory and these cofactors."""
    truth, q = solution["unknowns_solved"][name], np.array(solution["cofactors"][name])
    value, sd = np.array(truth["value"]), np.array(truth["sd"])
    ours, own = coefficients(result, trajectory, which)
    assert (np.abs(ours - value) < unknowns * sd).all()
    kept, scale = np.isfinite(own), np.outer(sd.ravel(), sd.ravel())
    np.testing.assert_allclose((own / scale)[kept], (q / scale)[kept], rtol=0, atol=cofactors)


@pytest.mark.parametrize(
    "case", ["rolling_shutter", "pushbroom_strips", "jitter", "three_line", "planetary_pair"]
)
def test_golden_networks_in_parts(case, monkeypatch):
    """What one process has to give of them, to the same digits."""

    def adjusted(block, **options):
        return adjust_in_parts(block, Division(parts=2), **options)

    monkeypatch.setattr(test_moving, "adjust", adjusted)
    monkeypatch.setattr(test_moving, "coefficients", coefficients)
    monkeypatch.setattr(test_moving, "solved", solved)
    getattr(test_moving, f"test_{case}")()
