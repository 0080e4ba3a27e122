"""Hypotheses in geographic space against those of the same network in rectangular space."""

from dataclasses import replace

import numpy as np
import pytest

from photogram import Position, Spheroid, adjust
from photogram.network import lengths_of_units, local_frames, rotation_angles, rotation_matrix
from photogram.network.geometry import Cartesian
from photogram.results.network_trial import block_facts
from test_hypotheses import GOLDEN, block_of, facts_of

SPHEROID, ORIGIN = Spheroid.wgs84(), np.array([[0.2, 0.8, 0.0]])


def geographic(block):
    """Return a rectangular block as a geographic one; its axes are east, north and up at the origin."""
    axes, (frame,) = Cartesian(SPHEROID), local_frames(ORIGIN)

    def moved(positions):
        return axes.from_cartesian(axes.positions(ORIGIN) + np.asarray(positions) @ frame)

    places = moved(block.photo_positions)
    attitudes = rotation_matrix(block.photo_attitudes) @ frame @ local_frames(places).transpose(0, 2, 1)
    known = np.isfinite(block.point_positions).all(axis=1)
    points, sd = np.full_like(block.point_positions, np.nan), np.full_like(block.point_sd, np.inf)
    points[known] = moved(block.point_positions[known])
    sd[known] = block.point_sd[known] / lengths_of_units(points[known], SPHEROID)
    observations = [
        replace(each, position=moved([each.position])[0]) if isinstance(each, Position) else each
        for each in block.observations
    ]
    return block.replace(
        spheroid=SPHEROID,
        photo_positions=places,
        photo_attitudes=rotation_angles(attitudes),
        point_positions=points,
        point_sd=sd,
        observations=observations,
    )


def statistics_of(block, velocities):
    result = adjust(block)
    trial = result._trial()
    trial.stand()
    facts = block_facts(block, result.photo_positions)
    strips = (np.arange(len(block.photo_ids)) // 4).tolist()
    control = [row % 2 for row in range(len(block.point_ids))]
    times, observed = np.arange(float(len(block.photo_ids))).tolist(), facts["observed"]
    changes = {"centre": facts["centre"], "times": times, "observed": observed, "readouts": facts["readouts"]}
    changes |= {"position_sets": strips, "control_sets": control, "velocities": velocities}
    found = trial.core.hypotheses(**facts_of(**changes))
    keys = [*zip(found["code"], found["index"].tolist(), strict=True)]
    return {key: (found["statistic"][row], found["redundancy"][row]) for row, key in enumerate(keys)}


def test_statistics_are_those_of_the_same_network_in_rectangular_space():
    """Axes of both spaces differ by the extent of the network over the radius of the earth, 1e-5."""
    block, velocities = block_of("lever arm (0.2, 0, 0) m"), np.array(GOLDEN["velocity"])
    (frame,) = local_frames(ORIGIN)
    expected = statistics_of(block, velocities)
    found = statistics_of(geographic(block), velocities @ frame)
    assert found.keys() == expected.keys()
    assert {"time-offset", "gnss-drift", "gnss-set", "lever-arm", "control-set"} <= {
        code for code, _ in found
    }
    for key, (statistic, redundancy) in expected.items():
        assert found[key][0] == pytest.approx(statistic, rel=2e-3, abs=2e-3), key
        assert found[key][1] == pytest.approx(redundancy, rel=2e-3, abs=1e-9), key


@pytest.mark.parametrize("code", ["time-offset", "gnss-next", "gnss-shift", "gnss-drift"])
def test_errors_of_positions_are_named(code):
    block = block_of("clean")
    *gnss, distance = block.observations
    places = np.array([each.position for each in gnss])
    moved = {
        "time-offset": places + 0.02 * np.array(GOLDEN["velocity"]),
        "gnss-next": np.vstack([places[1:], places[-1:]]),
        "gnss-shift": places + np.array([0.4, -0.5, 0.3]),
        "gnss-drift": places + np.linspace(-0.5, 0.5, len(places))[:, np.newaxis] * [1, -1, 1],
    }[code]
    gnss = [replace(each, position=place) for each, place in zip(gnss, moved, strict=True)]
    verdict = adjust(geographic(block.replace(observations=[*gnss, distance]))).verdict
    assert verdict.code == "common-error"
    named = [each.fields["named"].code for each in verdict.message.fields["errors"]]
    assert f"hypothesis.{code}" in named
