"""Ranges of a rangefinder that moves with a photo, or on a trajectory: adjusted, in tables, refused."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from moving import edited, project_of, same, two_lines
from test_plain_project import EXAMPLE, written

from photogram import Distance, InputError, adjust, formats
from photogram.network import Instrument, Range
from photogram.network.motion import about

ARM = np.array([0.2, -0.4, 1.1])
TIMES = (202.25, 204.5, 206.75)


def laser(block, instrument=None, error=0.0):
    """Return ranges of a rangefinder beside the scanner of two lines, by an instrument with its constant."""
    strip = block.timed[0].trajectory
    clock = next(each.clock for each in block.observations if each.KIND == "position")
    made = []
    for k, time in enumerate(TIMES):
        centre, matrix = about(strip, time + float(clock.position[0]))
        point = k if k % 5 == 0 else 5 * k
        place = block.point_positions[point]
        length = float(np.linalg.norm(place - centre - matrix @ ARM)) + error
        of = {"trajectory": strip, "time": time, "clock": clock, "lever_arm": ARM}
        made.append(Range(None, block.point_ids[point], length, sd=0.1, instrument=instrument, **of))
    return made


def test_ranges_of_a_trajectory_take_part_in_its_adjustment():
    block = two_lines()
    ranges = laser(block)
    ranging = block.replace(observations=[*block.observations, *ranges])
    before, after = (adjust(each, unit_variance="unity") for each in (block, ranging))
    kind = after.kinds["range"]
    assert kind.components == ("length",)
    assert kind.units == ("m",)
    assert np.abs(kind.standardized).max() < 4
    assert (kind.redundancy > 0).all()
    assert after.degrees_of_freedom == before.degrees_of_freedom + len(ranges)
    assert "range" in after.report()
    poses = [next(iter(each.trajectories.values())).poses(TIMES).sd for each in (before, after)]
    assert (poses[1] <= poses[0] * (1 + 1e-9)).all()
    assert poses[1][:, 2].max() < poses[0][:, 2].max()


def test_the_constant_of_a_rangefinder_is_found():
    block = two_lines()
    gun = Instrument("gun", sd=[0.0, np.inf])
    ranges = laser(block, gun, 7.5)
    result = adjust(block.replace(observations=[*block.observations, *ranges]))
    own = next(each for each in result.unknowns if each.given is gun)
    assert own.position[1] == pytest.approx(7.5, abs=4 * own.sd[1])
    assert 0 < own.sd[1] < 1


def test_tables_of_ranges_come_back(tmp_path):
    """Of trajectories and of photos; the instrument is that of distances, too."""
    block = two_lines()
    gun = Instrument("gun", 1.001, sd=[1e-5, np.inf])
    tape = Distance("P0", "P1", 30.0, sd=0.01, instrument=gun)
    held = replace(block, observations=[*block.observations, *laser(block, gun), tape])
    project = project_of(held, tmp_path)
    assert formats.cannot_hold(project, "plain") == []
    place = written(project, tmp_path / "there")
    read = formats.read(place).block
    same(held, read)
    by_kind = {each.KIND: each for each in read.observations}
    assert by_kind["range"].instrument is by_kind["distance"].instrument
    assert list(pd.read_csv(place / "instruments.csv")["instrument"]) == ["gun"]
    assert "lever_x" in pd.read_csv(place / "ranges.csv")
    edited(place / "ranges.csv", lambda table: table.assign(time=["9999.0", *table["time"][1:]]))
    late = formats.read(place)
    assert sum(each.KIND == "range" for each in late.block.observations) == len(TIMES) - 1
    assert late.messages[0].code == "plain.outside-trajectory"


def test_ranges_of_photos_come_back(tmp_path):
    block = formats.read(EXAMPLE).block
    ranges = [Range(block.photo_ids[0], block.point_ids[0], 1000.0, sd=0.02)]
    place = written(project_of(replace(block, observations=ranges), tmp_path), tmp_path / "there")
    assert list(pd.read_csv(place / "ranges.csv")) == ["photo", "point", "range", "sd"]
    read = formats.read(place).block.observations
    assert [(each.photo, each.point, each.length, each.sd) for each in read] == [
        (block.photo_ids[0], block.point_ids[0], 1000.0, 0.02)
    ]
    edited(place / "ranges.csv", lambda table: table.assign(clock="watch"))
    with pytest.raises(InputError, match="a clock requires a record of a trajectory") as caught:
        formats.read(place)
    assert caught.value.record == 2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"length": 0.0}, "length of range P - A: must be positive, got 0"),
        ({"length": np.nan}, "length of range P - A: .*finite.* nan"),
        ({"sd": 0.0}, "sd of range"),
        ({"lever_arm": [0.0, np.inf, 0.0]}, "lever_arm of range"),
        ({"instrument": "gun"}, "instrument of range: .*Instrument.*'gun'"),
        ({"photo": "A", "point": ""}, "point|name|range"),
    ],
)
def test_what_is_no_range_is_refused(changes, said):
    good = {"photo": "A", "point": "P", "length": 12.0, "sd": 0.1}
    Range(**good)
    with pytest.raises(InputError, match=said):
        Range(**good | changes)
