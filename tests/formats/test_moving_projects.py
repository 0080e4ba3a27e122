"""Photos on trajectories in the tables of the plain project."""

import numpy as np
import pytest
from moving import rolling, same, two_lines
from test_plain_project import written

import test_moving
from photogram import adjust, formats

GOLDEN = ("rolling_shutter", "pushbroom_strips", "jitter", "three_line", "planetary_pair")


def project_of(block, place, sizes=None, pixel_mm=None):
    """Return a project of a block that somebody has made."""
    count = len(block.cameras)
    return formats.Project(
        block=block,
        path=place,
        title="made",
        sizes=sizes or (None,) * count,
        pixel_mm=pixel_mm or (None,) * count,
        starts=block.point_positions,
    )


def again(block, place, **more):
    """Return a block that was written and read."""
    project = project_of(block, place, **more)
    assert formats.cannot_hold(project, "plain") == []
    read = formats.read(written(project, place))
    assert read.messages == ()
    return read.block


def golden_block(name, monkeypatch):
    """Return the block that a test of golden data adjusts."""

    class FoundError(Exception):
        pass

    def caught(block, **options):
        raise FoundError(block)

    monkeypatch.setattr(test_moving, "adjust", caught)
    with pytest.raises(FoundError) as found:
        getattr(test_moving, f"test_{name}")()
    return found.value.args[0]


def check_adjusted(one, two, tolerance=1e-7):
    """Assert that two blocks have the same answer."""
    first, second = (adjust(each, tolerance=1e-10) for each in (one, two))
    assert first.degrees_of_freedom == second.degrees_of_freedom
    assert second.sums_of_squares.total == pytest.approx(first.sums_of_squares.total, rel=1e-9)
    theirs = {(each.kind, each.name): each for each in second.unknowns}
    for each in first.unknowns:
        read = theirs.get((each.kind, each.name))
        assert read is not None or each.given.is_held
        if read is not None:
            sd = np.sqrt(np.diag(each.cofactors))
            apart = np.abs(read.position - each.position)[: len(sd)]
            assert (apart <= tolerance * sd[: len(apart)]).all()


@pytest.mark.parametrize("name", GOLDEN)
def test_golden_networks_come_back(name, monkeypatch, tmp_path):
    block = golden_block(name, monkeypatch)
    sizes = ((4000, 3000),) if name == "rolling_shutter" else None
    found = again(block, tmp_path / name, sizes=sizes)
    same(block, found)
    check_adjusted(block, found, 1e-5)


@pytest.mark.parametrize("unit", ["px", "mm"])
@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
def test_a_rolling_shutter_comes_back(unit, direction, tmp_path):
    block = rolling(unit, direction)
    pixel_mm = (None,) if unit == "px" else (0.004,)
    found = again(block, tmp_path / "there", sizes=((3000, 2000),), pixel_mm=pixel_mm)
    same(block, found)
    assert len({id(each.shutter) for each in found.timed}) == 1
    assert "readout_begin" not in (tmp_path / "there" / "cameras.csv").read_text()
    # Where the size is not known the edges stand there.
    found = again(block, tmp_path / "other")
    same(block, found)
    assert "readout_begin" in (tmp_path / "other" / "cameras.csv").read_text()
    check_adjusted(block, found)


def test_two_lines_on_one_trajectory_come_back(tmp_path):
    block = two_lines()
    found = again(block, tmp_path / "there")
    same(block, found)
    one, two = found.timed
    assert one.trajectory is two.trajectory
    assert one.rate is two.rate
    assert one.sensor is None
    assert {id(each.moment.trajectory) for each in found.observations if each.moment} == {id(one.trajectory)}
    check_adjusted(block, found)
