"""Results of blocks with trajectories that are saved and read again; blocks in parts, which have none."""

import dataclasses

import numpy as np
import pytest

from moving_blocks import rolling, scanned
from photogram import InputError, adjust, group_sums, read_result
from photogram.network import Lens, Smoothness, Spline

pytest.importorskip("pyarrow")


def jittered():
    """Return a block with smoothness that somebody has made of the coefficients of a trajectory."""
    block = scanned()
    first = block.trajectories[0].coefficients[1]
    own = [Smoothness(first[k : k + 3], [1.0, -2.0, 1.0], sd=1e-3) for k in range(len(first) - 2)]
    return block.replace(observations=[*block.observations, *own])


def curved():
    """Return a block of scanners whose lines of sensors are bent, and behind a lens that is known."""
    block = scanned()
    lens, bends = Lens("lrolrocnac", (1e-7,)), np.array([[0.0, 0.0, 1e-4], [3000.0, 1e-4, 0.0]])
    own = [dataclasses.replace(each.line_sensor, lens=lens, bends=bends) for each in block.timed]
    pairs = zip(block.timed, own, strict=True)
    return block.replace(timed=[dataclasses.replace(each, line_sensor=line) for each, line in pairs])


BLOCKS = {
    "rolling": rolling,
    "known readout": lambda: rolling(readout=0.03).replace(photo_position_sd=0.1),
    "scanned": lambda: scanned(photos=True, smooth=True),
    "jitter": jittered,
    "curved": curved,
}


@pytest.mark.parametrize("name", BLOCKS)
def test_a_result_is_read_as_it_was_saved(name, tmp_path):
    """It could be saved, and not be read: `'Timed' is no class that this version knows`."""
    result = adjust(BLOCKS[name]())
    result.to_parquet(tmp_path / "result")
    read = read_result(tmp_path / "result")
    assert read.report() == result.report()
    assert read.verdict.headline == result.verdict.headline
    for each in dataclasses.fields(result.block):
        if isinstance(getattr(result.block, each.name), np.ndarray):
            np.testing.assert_array_equal(getattr(read.block, each.name), getattr(result.block, each.name))
    known = [(each.kind, each.name, each.values.tolist(), each.sd.tolist()) for each in result.unknowns]
    assert [(each.kind, each.name, each.values.tolist(), each.sd.tolist()) for each in read.unknowns] == known
    assert all(each.given is own for each, own in zip(read.unknowns, read.block.unknowns, strict=True))
    some = [("unknown", result.unknowns[0].name), ("photo", result.block.photo_ids[-1])]
    np.testing.assert_array_equal(read.covariance(some), result.covariance(some))
    assert group_sums(read).report() == group_sums(result).report()
    for each, own in zip(read.block.timed, result.block.timed, strict=True):
        assert each.line_sensor == own.line_sensor
    again = adjust(read.block)
    assert again.sums_of_squares == result.sums_of_squares
    read.to_parquet(tmp_path / "again")
    second = read_result(tmp_path / "again")
    assert second.report() == read.report()


def test_what_is_shared_is_shared_again(tmp_path):
    result = adjust(scanned(photos=True, smooth=True))
    result.to_parquet(tmp_path / "result")
    block = read_result(tmp_path / "result").block
    assert block.timed[0].trajectory is block.timed[2].trajectory
    assert block.timed[0].trajectory is not block.timed[1].trajectory
    of_records = {id(each.moment.trajectory) for each in block.observations if each.moment}
    assert of_records == {id(each.trajectory) for each in block.timed}
    assert len([each for each in block.observations if isinstance(each, Smoothness)]) == 12
    assert len({id(each.clock) for each in block.observations if each.moment}) == 1


def test_columns_of_scanners_say_what_they_are(tmp_path):
    import pyarrow.parquet as parquet

    for block, unit in ((scanned(), b"1"), (scanned(photos=True), b"mm; 1 of scanners"), (rolling(), b"px")):
        folder = tmp_path / block.photo_ids[-1]
        adjust(block).to_parquet(folder)
        schema = parquet.read_schema(folder / "images.parquet")
        assert schema.field("x").metadata[b"unit"] == unit
        assert (b"sample" in schema.field("x").metadata[b"description"]) == (unit != b"px")
        assert schema.field("residual_x").metadata[b"unit"] == unit.split(b";")[0].replace(b"1", b"mm")


def test_damaged_coefficients_are_refused(tmp_path):
    own = scanned().trajectories[0]
    again = dataclasses.replace(own)
    assert again.coefficients[0][0] is not own.coefficients[0][0]
    assert again._with_coefficients(own.coefficients).coefficients == own.coefficients
    with pytest.raises(InputError, match="strip 1"):
        dataclasses.replace(own, position=Spline(1.0))._with_coefficients(own.coefficients)
