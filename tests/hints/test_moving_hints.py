"""Hints on what moves: each mistake made on purpose in a good block, and good blocks that get none."""

from dataclasses import replace

import numpy as np
import pytest

import test_moving
from message_codes import nested_codes
from moving_blocks import (
    HEIGHT,
    LINE,
    SAMPLES,
    WIDTH,
    course,
    exponential,
    flown_frames,
    place,
    rolling,
    scanned,
)
from photogram import AdjustmentError, Attitudes, adjust, diagnose
from photogram.diagnosis.after_adjustment import diagnosed, errors_explained, explained, remarks
from photogram.diagnosis.mistakes import Adjuster
from photogram.diagnosis.moving import counted_lines
from photogram.diagnosis.trajectory_hints import flown_hints
from photogram.network import Attitude, Boresight, Clock, Lines, Readout

SCANNED = ("pushbroom_strips", "three_line", "planetary_pair", "jitter")


# A rolling shutter taken for a global one


@pytest.mark.parametrize("millimetres", [False, True])
@pytest.mark.parametrize(
    ("direction", "code"),
    [("down", "readout-time"), ("up", "readout-time"), ("right", "readout-time-columns")],
)
def test_a_rolling_shutter(direction, code, millimetres):
    """What its residuals were blamed for was the lens."""
    block = flown_frames(direction=direction, millimetres=millimetres)
    verdict = adjust(block).verdict
    assert (verdict.code, verdict.exit) == ("common-error", 4)
    assert f"hypothesis.{code}" in nested_codes(verdict.message)
    (found,) = diagnose(block).grave
    assert found.kind == "common-error"
    assert f"hypothesis.{code}" in nested_codes(found)


# What is given of a shutter


def shuttered(block, **changes):
    return block.replace(
        timed=[replace(each, shutter=replace(each.shutter, **changes)) for each in block.timed]
    )


READOUTS = {"free": Readout("drone", 0.02), "weighted": Readout("drone", 0.03, sd=0.003), "known": 0.03}
MISTAKES = {
    "edge": ({"edges": (HEIGHT, 0.0), "direction": "up"}, "opposite"),
    "columns": ({"edges": (0.0, WIDTH), "direction": "right"}, "rows.first"),
}


@pytest.mark.parametrize("readout", READOUTS)
@pytest.mark.parametrize("mistake", MISTAKES)
def test_readouts_in_a_wrong_direction(readout, mistake):
    changes, cause = MISTAKES[mistake]
    result = adjust(shuttered(rolling(readout=READOUTS[readout]), **changes))
    hint = diagnosed(result).messages[0]
    assert nested_codes(hint)[:2] == ["mistake.likely", f"mistake.shutter.{cause}"]


@pytest.mark.parametrize("readout", [30.0, Readout("drone", 30.0, sd=3.0), Readout("drone", 30.0)])
def test_readout_times_in_milliseconds(readout):
    result = adjust(rolling(readout=readout))
    hint = diagnosed(result).messages[0]
    assert "mistake.shutter.milliseconds" in nested_codes(hint)


def test_a_readout_time_that_comes_out_negative():
    """It fits, and so it is no mistake that is tried: but the shutter reads the other way."""
    right = rolling(readout=Readout("drone", 0.0))
    result = adjust(shuttered(right, edges=(HEIGHT, 0.0)))
    found = diagnosed(result)
    assert found.hints == ()
    assert found.messages[0].code == "moving.backward-readout"
    assert found.messages[0].phrase.fields["value"] == pytest.approx(-0.03, abs=0.01)
    kinds = [each.kind for each in diagnose(result.block, result).findings]
    assert "moving" in kinds
    assert set(kinds) <= {"moving", "accepted-not-checked"}
    assert remarks(adjust(right)) == []


# Tables and times of trajectories


def on_tables(block, change):
    """Return a block whose trajectories have other tables."""
    known = {}

    def meant(given):
        return known.setdefault(id(given), replace(given, table=change(given.table)))

    return block.replace(
        timed=[replace(each, trajectory=meant(each.trajectory)) for each in block.timed],
        observations=[replace(each, trajectory=meant(each.trajectory)) for each in block.observations],
    )


def rolled(table):
    numbers = Attitudes(table.attitudes).values("quaternion")
    return replace(table, attitudes=Attitudes.of("quaternion", np.roll(numbers, 1, axis=1)).matrices)


TABLES = {
    "inverse": lambda table: replace(table, attitudes=np.swapaxes(table.attitudes, 1, 2)),
    "quaternions": rolled,
    "kilometres": lambda table: replace(table, positions=table.positions / 1000),
    "metres": lambda table: replace(table, positions=table.positions * 1000),
}


@pytest.mark.parametrize("photos", [False, True])
@pytest.mark.parametrize("cause", TABLES)
def test_tables_of_trajectories(cause, photos):
    (hint,) = flown_hints(on_tables(scanned(photos=photos), TABLES[cause]))
    assert f"mistake.table.{cause}" in nested_codes(hint)


def at_other_times(block, seconds):
    """Return a block whose images are dated that much later."""

    def later(own):
        lines = None if own.lines is None else Lines(own.lines.table + np.array([0.0, seconds, 0.0]))
        return replace(own, lines=lines, time=None if own.time is None else own.time + seconds)

    return block.replace(timed=[later(each) for each in block.timed])


def recorded_later(block, seconds):
    return block.replace(
        observations=[replace(each, time=each.time + seconds) for each in block.observations]
    )


@pytest.mark.parametrize(
    ("seconds", "scale", "table"),
    [
        (-18.0, "UTC", "GPS"),
        (37.0, "TAI", "UTC"),
        (69.184, "ET", "UTC"),
        (-51.184, "GPS", "ET"),
        (-19.0, "GPS", "TAI"),
    ],
)
def test_scales_of_time(seconds, scale, table):
    fields = {"scale": scale, "table": table, "seconds": pytest.approx(-seconds)}

    for photos in (False, True):
        moved = at_other_times(scanned(photos=photos), seconds)
        (hint,) = flown_hints(moved)
        (cause,) = hint.phrase.fields["causes"]
        assert (cause.code, cause.fields) == ("mistake.times.images", fields)
    (hint,) = flown_hints(recorded_later(scanned(), seconds))
    (record,) = hint.phrase.fields["causes"]
    assert (record.code, record.fields) == ("mistake.times.records", fields)
    with pytest.raises(AdjustmentError) as raised, errors_explained(moved):
        adjust(moved)
    assert raised.value.code.startswith("adjust.beyond-trajectory")
    assert f"hint: probably {cause}" in str(raised.value)


def test_another_shift_is_no_scale_of_time():
    assert flown_hints(at_other_times(scanned(), 23.5)) == []


def test_an_offset_of_a_clock_that_is_a_difference_of_scales():
    block = scanned()
    clock = Clock("receiver", value=17.9, sd=1.0)
    late = recorded_later(block, -18.0 + 0.004)
    late = late.replace(observations=[replace(each, clock=clock) for each in late.observations])
    result = adjust(late)
    assert result.converged
    (remark,) = remarks(result)
    assert remark.code == "moving.clock-offset"
    assert remark.phrase.fields["offset"] == pytest.approx(18.0, abs=0.01)
    assert [str(scale) for scale in remark.phrase.fields["scales"]] == ["GPS - UTC (+18 s)"]
    assert remarks(adjust(block)) == []


# How lines are counted


def scanned_lines(block, change):
    """Return a block with other samples and lines of its scanners."""
    xy, own = block.image_xy.copy(), np.isin(block.image_photos, [0, 1])
    xy[own] = change(xy[own])
    return block.replace(image_xy=xy)


LAST = 8 / LINE
COUNTED = {
    "reversed": lambda xy: np.abs([0.0, LAST] - xy),
    "turned": lambda xy: [SAMPLES, LAST] - xy,
    "mirrored samples": lambda xy: np.abs([SAMPLES, 0.0] - xy),
}


@pytest.mark.parametrize("cause", COUNTED)
def test_scans_that_are_turned(cause):
    (hint,) = flown_hints(scanned_lines(scanned(), COUNTED[cause]))
    # Of sensors along x the sign of the principal distance does the same.
    assert f"mistake.scanner.{cause}" in nested_codes(hint)
    assert (
        ("mistake.sign of c" in nested_codes(hint))
        == (hint.code == "convention.one-of")
        == (cause == "mirrored samples")
    )


def of_a_better_unit(block):
    """Return a block with a known clock and boresight and good attitudes.

    Without them these take up where lines are along the track.
    """
    clock = Clock("receiver", value=0.004, sd=1e-6)
    turn = exponential(np.array([0.01, -0.02, 0.015]))
    boresight = Boresight("imu", turn, sd=0.0)

    def better(each):
        if each.KIND == "rate":
            return replace(each, clock=clock, boresight=boresight)
        if each.KIND != "attitude":
            return replace(each, clock=clock)
        strip = int(each.trajectory.name == "strip 2")
        _, true = place(strip, each.time + 0.004 - course(strip)[0] - 4.0)
        return Attitude(
            None,
            true @ turn,
            sd=1e-5,
            boresight=boresight,
            trajectory=each.trajectory,
            time=each.time,
            clock=clock,
        )

    return block.replace(observations=[better(each) for each in block.observations])


@pytest.mark.parametrize("off", [0.5, -0.5, 1.0])
def test_lines_that_are_counted_otherwise(off):
    block = of_a_better_unit(scanned())
    assert counted_lines(block, Adjuster({})) == []
    (found,) = counted_lines(scanned_lines(block, lambda xy: xy - [0.0, off]), Adjuster({}))
    assert found.level == "look"
    assert found.values["lines"] == pytest.approx(off, abs=0.1)
    assert found.kind == "line-count"
    assert found.photos == ["S1", "S2"]


def test_the_check_names_what_is_wrong_with_a_scan():
    turned = scanned_lines(scanned(), COUNTED["reversed"])
    found = diagnose(turned)
    assert found.grave[0].kind in ("convention", "not-converged")
    assert any("mistake.scanner.reversed" in nested_codes(each) for each in found.grave)


# Good blocks


def golden(case, monkeypatch):
    """Return the result of a golden network that moves."""
    found = {}

    def keep(result, *_, **__):
        found["result"] = result
        raise InterruptedError

    monkeypatch.setattr(test_moving, "agree", keep)
    with pytest.raises(InterruptedError):
        getattr(test_moving, f"test_{case}")()
    return found["result"]


@pytest.mark.parametrize("case", ["rolling_shutter", *SCANNED])
def test_golden_blocks_get_no_hints(case, monkeypatch):
    result = golden(case, monkeypatch)
    assert flown_hints(result.block) == []
    assert explained(result) == remarks(result) == []
    assert counted_lines(result.block, Adjuster({})) == []


@pytest.mark.parametrize("seed", range(4))
def test_good_blocks_get_no_hints(seed):
    for block in (
        rolling(),
        flown_frames(readout=0.0, seed=seed),
        scanned(seed=seed),
        scanned(photos=True, seed=seed),
        scanned(records=False, seed=seed),
    ):
        assert flown_hints(block) == []
        result = adjust(block)
        assert explained(result) == remarks(result) == []
        assert diagnosed(result) is result
