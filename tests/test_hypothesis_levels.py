"""Levels of all hypotheses without an error, by Monte Carlo: their p-values have a uniform distribution."""

import dataclasses
from collections import defaultdict

import numpy as np
import pytest
from scipy.stats import kstest

from photogram import Distance, adjust
from photogram.network import Attitude, rotation_matrix
from test_hypotheses import GOLDEN, block_of

RUNS = 150
ATTITUDE_SD = 1e-4  # Radians, of observed attitudes
CATALOGUE = frozenset(
    {
        *("control-point", "control-heights", "control-shift", "control-set", "control-scale"),
        *("control-rotation", "gnss-heights", "gnss-shift", "gnss-set", "gnss-drift", "time-offset"),
        *("lever-arm", "boresight", "camera-f", "camera-point", "camera-term", "readout-time", "scale"),
        *("bending", "observation", "gnss-next", "gnss-previous", "camera-affinity", "camera-f-strip"),
        *("camera-f-half", "camera-exchanged", "control-bending", "readout-time-columns", "photo"),
        *("gnss-half", "object-point", "distance-scale"),
    }
)
"""Codes of all hypotheses that the golden network with observed attitudes permits."""


def surveyed(rng, photos, points):
    """Yield blocks of the first photos and points of the golden network, with other noise."""
    sd, pair = GOLDEN["standard_deviations"], GOLDEN["distance_points"]
    of_photos, of_points = np.array(GOLDEN["image_photo"]), np.array(GOLDEN["image_point"])
    chosen = (of_photos < photos) & ((of_points < points) | np.isin(of_points, GOLDEN["control_points"]))
    chosen &= np.bincount(of_points[chosen], minlength=of_points.max() + 1)[of_points] > 1
    block = block_of("clean", photos, chosen)
    seen = np.isin(np.arange(len(block.point_ids)), of_points[chosen])
    block = block.replace(point_sd=np.where(seen[:, np.newaxis], block.point_sd, np.inf))
    if not np.isin(pair, of_points[chosen]).all():
        block = block.replace(observations=block.observations[:-1])
    # Observations without errors: the adjusted ones.
    found = adjust(block)
    xy, gnss, places = block.image_xy - found.residuals, found.photo_positions, found.point_positions
    control = np.where(np.isfinite(block.point_positions), places, np.nan)
    attitudes = rotation_matrix(found.photo_attitudes)
    length = float(np.linalg.norm(np.diff(places[pair], axis=0)))
    # A second distance from the same target.
    ends = [pair[0], GOLDEN["control_points"][0]]
    second = [ends] if np.isin([*pair, *ends], of_points[chosen]).all() else []

    def noise(of, kind):
        return rng.normal(size=np.shape(of)) * sd[kind]

    for _ in range(RUNS):
        values = [*(gnss + noise(gnss, "gnss")), length + noise(length, "distance")]
        turns = rotation_matrix(ATTITUDE_SD * rng.normal(size=(len(attitudes), 3)))
        yield block.replace(
            image_xy=xy + noise(xy, "image"),
            point_positions=control + noise(control, "control"),
            observations=[
                *(
                    dataclasses.replace(each, **{"position" if each.photos else "length": value})
                    for each, value in zip(block.observations, values, strict=False)
                ),
                *(
                    Attitude(name, matrix.T @ turn, ATTITUDE_SD)
                    for name, matrix, turn in zip(block.photo_ids, attitudes, turns, strict=True)
                ),
                *(
                    Distance(
                        *(block.point_ids[end] for end in own),
                        np.linalg.norm(places[own[0]] - places[own[1]]) + noise(0.0, "distance"),
                        sd["distance"],
                    )
                    for own in second
                ),
            ],
        )


@pytest.mark.parametrize(("photos", "points", "known"), [(99, 999, True), (99, 999, False), (4, 8, False)])
def test_p_values_are_uniform_without_an_error(photos, points, known):
    found = defaultdict(list)
    for block in surveyed(np.random.default_rng(2), photos, points):
        result = adjust(block)
        omega, freedom = result.sum_and_freedom
        trial = result._trial()
        trial.stand()
        count = len(block.photo_ids)
        tested = trial.core.hypotheses(
            times=np.arange(float(count)).tolist(),
            position_sets=(3 * np.arange(count) // count).tolist(),
            control_sets=[row % 2 for row in range(len(block.point_ids))],
            checks=[],
            velocities=np.array(GOLDEN["velocity"])[:photos],
            readouts=[
                [[0.0, 1 / GOLDEN["camera"]["height"], -0.5], [1 / GOLDEN["camera"]["width"], 0.0, -0.5]]
            ],
            widths=[float(GOLDEN["camera"]["width"])],
            centre=[0.0, 0.0, 0.0],
            estimated=None if known else (omega, freedom),
            detection=(0.001, 0.8),
            photos=[0, 2],
            limit=6.0,
            effects=0,
        )
        for place in np.flatnonzero((tested["rank"] > 0) & (tested["redundancy"] > 1e-6)).tolist():
            found[tested["code"][place], place].append(tested["probability"][place])
    codes = {code for code, _ in found}
    assert codes <= CATALOGUE
    assert len(codes) >= (len(CATALOGUE) if photos > 10 else 19), CATALOGUE - codes
    assert (freedom < 50) is (photos < 10)
    least = min(kstest(values, "uniform").pvalue for values in found.values())
    assert least > 0.01 / len(found), (least, len(found))
