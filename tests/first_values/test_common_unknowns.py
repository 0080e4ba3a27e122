"""First values of planes, lines, levels, boresights and sensors, which nobody has given."""

import numpy as np
import pytest

from example_scripts import load
from message_codes import raises
from photogram import Block, InputError, Spheroid, adjust, simulate
from photogram.adjustment.first_features import started
from photogram.network import (
    Boresight,
    Level,
    Line,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Plane,
    PlumbLine,
    Sensor,
    with_inertial,
    with_rig,
)

CLARKE = Spheroid(6378206.4, 6356583.8)
BLANK = {
    Plane: {"normal": None, "through": None},
    Line: {"direction": None, "through": None},
    PlumbLine: {"through": None},
    Level: {"height": None},
    Boresight: {"value": None},
    Sensor: {"value": None, "matrix": None},
}


def blank(block: Block) -> Block:
    """Return a block whose unknowns have no values where they need none."""
    from dataclasses import replace

    new = {id(each): each.replace(**BLANK.get(type(each), {})) for each in block.unknowns}
    observations = [
        replace(
            each,
            **{
                name: new[id(own)]
                for (name, _), own in zip(each.UNKNOWNS, each.unknowns, strict=True)
                if own is not None
            },
        )
        for each in block.observations
    ]
    mounts = [replace(each, sensor=new[id(each.sensor)]) for each in block.mounts]
    return block.replace(observations=observations, mounts=mounts)


@pytest.mark.parametrize("name", ["facade", "stereo_rig", "direct_georeferencing"])
def test_examples_without_values_end_where_they_end_with_them(name):
    example = load(name)
    block = example.measured()
    without = blank(block)
    assert any(each.is_open for each in without.unknowns)
    given, found = adjust(block), adjust(without)
    assert found.converged
    np.testing.assert_allclose(found.point_positions, given.point_positions, atol=1e-7)
    assert found.variance_of_unit_weight == pytest.approx(given.variance_of_unit_weight, rel=1e-8)
    for one, other, unknown in zip(found.unknowns, given.unknowns, block.unknowns, strict=True):
        # Places of planes and lines are any along them.
        if not isinstance(unknown, Plane | Line):
            # So is the height of a plumb line.
            own = slice(2 if isinstance(unknown, PlumbLine) else 3)
            np.testing.assert_allclose(one.position[own], other.position[own], atol=1e-6)
            np.testing.assert_allclose(one.attitude, other.attitude, atol=1e-7)


def test_a_boresight_of_half_a_turn_is_found():
    """From the identity on, nothing would converge."""
    simulation = with_inertial(simulate(strips=3, seed=4), boresight=[0.01, -0.02, 3.0])
    block = blank(simulation.block)
    start = next(each for each in started(block).unknowns if isinstance(each, Boresight))
    truth = next(each for each in simulation.truth.unknowns if isinstance(each, Boresight))
    turn = start.attitude.T @ truth.attitude
    assert np.arccos((np.trace(turn) - 1) / 2) < 0.05
    assert adjust(block).converged


def test_in_geographic_space_directions_are_those_of_the_local_vertical():
    simulation = simulate(strips=2, photos_per_strip=4, seed=6, spheroid=CLARKE, relief=0.0)
    turned = np.array([0.02, -0.01, 0.3])
    simulation = with_rig(with_inertial(simulation, boresight=[0.0, 0.0, 2.0]), [[0.4, 0.1, 0.0]], [turned])
    names = simulation.block.point_ids[:40]
    observations = [OnPlane(name, Plane("ground"), 5.0) for name in names]
    shared = observations[0].plane
    observations = [OnPlane(name, shared, 5.0) for name in names]
    block = blank(simulation.block)
    block = block.replace(observations=[*block.observations, *observations])
    result = adjust(block)
    assert result.converged
    assert not any(each.is_open for each in result.block.unknowns)
    start = {type(each): each for each in result.block.unknowns}
    # Level ground a few kilometres wide is a plane across the local vertical.
    assert abs(start[Plane].attitude[2, 2]) > 0.9999
    truth = next(each for each in simulation.truth.unknowns if isinstance(each, Sensor))
    assert np.abs(start[Sensor].position - truth.position).max() < 100.0
    assert np.abs(start[Sensor].attitude - truth.attitude).max() < 0.05


def test_values_are_all_given_or_none_and_weights_need_them():
    for make, message in (
        (lambda: Plane("wall", normal=[0, 0, 1]), "block.unknown-value"),
        (lambda: Line("edge", through=[0, 0, 0]), "error.requires"),
        (lambda: Level("lake", sd=0.1), "block.unknown-value"),
        (lambda: Sensor("right", sd=[0, 0, 0, 1, 1, 1]), "block.unknown-value"),
    ):
        with raises(InputError, message):
            make()
    assert Boresight("unit", sd=0.01).attitude.tolist() == np.eye(3).tolist()


def test_what_points_do_not_give_is_named():
    example = load("facade")
    block = example.measured()
    names = block.point_ids
    for observations, message in (
        (
            [OnPlane(name, Plane("wall"), 0.01) for name in names[:1]],
            "first.unknown.points",
        ),
        ([OnLine(names[0], Line("edge"), 0.01)], "first.unknown.points"),
        ([OnPlumbLine("lost", PlumbLine("corner"), 0.01)], "got 0 of 1"),
        ([OnLevel("lost", Level("lake"), 0.01)], "requires a point with a height"),
    ):
        more = block.replace(
            point_ids=[*names, "lost"],
            point_positions=np.vstack([block.point_positions, np.full((1, 3), np.nan)]),
            point_sd=np.vstack([np.broadcast_to(block.point_sd, (len(names), 3)), np.full((1, 3), np.inf)]),
            observations=observations,
        )
        with raises(InputError, message):
            adjust(more)
