"""Hostile values for all that blocks with trajectories are made of: errors of our own, never others."""

import inspect

import numpy as np
import pytest

from moving_blocks import rolling
from photogram import AdjustOptions, PhotogramError, Position
from photogram.adjustment.adjustment import core_options
from photogram.network import (
    Attitude,
    Clock,
    GyroBias,
    Lines,
    LineSensor,
    Polynomial,
    Range,
    Rate,
    Readout,
    Shutter,
    Smoothness,
    Spline,
    Table,
    Timed,
    Trajectory,
    Velocity,
)
from photogram.network.core_arrays import block_network
from test_arguments import HOSTILE

TABLE = Table([0.0, 1.0], np.zeros((2, 3)), [0.0, 1.0], [np.eye(3)] * 2)
BLOCK = rolling()
PASS = Trajectory("pass", TABLE, position=Polynomial(1))
RECORD = {"photo": None, "sd": 1.0, "trajectory": PASS, "time": 0.5}
GOOD = {
    Table: {
        "times": [0.0, 1.0],
        "positions": np.zeros((2, 3)),
        "attitude_times": [0.0, 1.0],
        "attitudes": [np.eye(3)] * 2,
    },
    Trajectory: {
        "name": "t",
        "table": TABLE,
        "position": Polynomial(1),
        "rotation": Spline(0.5),
        "body": ([0.0, 1.0], [np.eye(3)] * 2),
    },
    Polynomial: {"degree": 1},
    Spline: {"every": 0.5},
    Clock: {"name": "c"},
    Readout: {"name": "r"},
    GyroBias: {"name": "g"},
    Shutter: {"readout": 0.03, "edges": (0.0, 3000.0)},
    Lines: {"table": [[0, 0.0, 0.001]]},
    LineSensor: {"pitch": (0.01, 0.0), "s0": 3000.0},
    Timed: {"photo": "IMG_1", "trajectory": PASS},
    Position: RECORD | {"position": [0, 0, 0]},
    Attitude: RECORD | {"attitude": np.eye(3)},
    Velocity: RECORD | {"velocity": [0, 0, 0]},
    Rate: RECORD | {"rate": [0, 0, 0]},
    Range: RECORD | {"point": BLOCK.point_ids[0], "length": 1.0},
    Smoothness: {"coefficients": PASS.coefficients[0], "factors": [1.0, -1.0], "sd": 1.0},
}
CASES = [
    (kind, name, hostile)
    for kind in GOOD
    for name in inspect.signature(kind).parameters
    for hostile in HOSTILE
]


def used(made):
    """Adjust a block with what was made in it."""
    block = BLOCK
    if isinstance(made, Polynomial | Spline):
        made = Trajectory("t", TABLE, position=made)
    if isinstance(made, Table):
        made = Trajectory("t", made, position=Polynomial(1))
    if isinstance(made, Trajectory):
        made = Timed("IMG_1", made, time=0.5)
    if isinstance(made, Clock):
        made = Timed("IMG_1", PASS, offset=made, time=0.5)
    if isinstance(made, Readout):
        made = Shutter(made, (0.0, 3000.0))
    if isinstance(made, GyroBias):
        made = Rate(None, [0, 0, 0], sd=1.0, trajectory=PASS, bias=made, time=0.5)
    if isinstance(made, Shutter):
        made = Timed("IMG_1", shutter=made)
    if isinstance(made, Lines):
        made = Timed("IMG_1", PASS, lines=made, line_sensor=LineSensor((0.01, 0.0), 3000.0))
    if isinstance(made, LineSensor):
        made = Timed("IMG_1", PASS, lines=Lines([[0, 0.0, 0.0001]]), line_sensor=made)
    if isinstance(made, Timed):
        return block.replace(timed=[made, *block.timed[1:]])
    return block.replace(observations=[made])


@pytest.mark.parametrize(("kind", "name"), dict.fromkeys((kind, name) for kind, name, _ in CASES))
def test_hostile_values_are_refused(kind, name):
    for hostile, make in HOSTILE.items():
        try:
            with np.errstate(all="ignore"):
                block_network(used(kind(**GOOD[kind] | {name: make()})), core_options(AdjustOptions()))
        except PhotogramError:
            continue
        except Exception as error:
            raise AssertionError(f"{kind.__name__} with {name} = {hostile}: {error!r}") from error
