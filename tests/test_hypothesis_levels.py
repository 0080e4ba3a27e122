"""Levels of all hypotheses without an error, by Monte Carlo: their p-values have a uniform distribution."""

import gzip
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest

from photogram import Block, Camera, Distance, Position, adjust

GOLDEN = json.loads(gzip.decompress((Path(__file__).parent / "data/hypotheses/golden.json.gz").read_bytes()))
RUNS = 150


def surveyed(rng, photos, points):
    """Yield blocks of the first photos and points of the golden network, with other noise."""
    camera, sd = GOLDEN["camera"], GOLDEN["standard_deviations"]
    case = next(iter(GOLDEN["cases"].values()))["observations"]
    poses, count = np.array(GOLDEN["start"]["poses"])[:photos], len(GOLDEN["start"]["points"])
    control = np.array(GOLDEN["control_points"])
    of_photos, of_points = np.array(GOLDEN["image_photo"]), np.array(GOLDEN["image_point"])
    chosen = (of_photos < photos) & ((of_points < points) | np.isin(of_points, control))
    chosen &= np.bincount(of_points[chosen], minlength=count)[of_points] > 1
    xy = np.array(case["image"]).reshape(-1, 2)[chosen]
    names = [str(row) for row in range(count)]
    control = control[np.isin(control, of_points[chosen])]
    place, point_sd = np.full((count, 3), np.nan), np.full((count, 3), np.inf)
    point_sd[control] = sd["control"]
    place[control] = np.array(case["control"])[np.isin(GOLDEN["control_points"], control)]
    values = {"f": camera["f"], "cx": camera["cx"], "cy": camera["cy"], "k": camera["k1"]}
    gnss = np.array(case["gnss"])[:photos]
    pair = [row for row in GOLDEN["distance_points"] if row in of_points[chosen]]

    def block(xy, place, gnss, length):
        distances = [Distance(*map(str, pair), length, sd["distance"])] if len(pair) == 2 else []
        return Block(
            photo_positions=poses[:, :3],
            photo_attitudes=poses[:, 3:],
            point_positions=place,
            point_ids=names,
            point_sd=point_sd,
            image_photos=of_photos[chosen],
            image_points=of_points[chosen],
            image_xy=xy,
            image_sd=sd["image"],
            cameras=[Camera("simple_radial", values)],
            observations=[
                *(Position(str(row), each, sd["gnss"]) for row, each in enumerate(gnss)),
                *distances,
            ],
        )

    length = float(np.ravel(case["distance"])[0])
    found = adjust(block(xy, place, gnss, length))
    # Observations without errors: the adjusted ones.
    xy = xy - found.residuals
    place = np.where(np.isfinite(place), found.point_positions, np.nan)
    gnss = found.photo_positions
    if len(pair) == 2:
        length = float(np.linalg.norm(np.diff(found.point_positions[pair], axis=0)))
    for _ in range(RUNS):
        yield block(
            xy + rng.normal(size=xy.shape) * sd["image"],
            place + rng.normal(size=place.shape) * sd["control"],
            gnss + rng.normal(size=gnss.shape) * sd["gnss"],
            length + rng.normal() * sd["distance"],
        )


@pytest.mark.parametrize(("photos", "points", "known"), [(99, 999, True), (99, 999, False), (4, 8, False)])
def test_p_values_are_uniform_without_an_error(photos, points, known):
    found = defaultdict(list)
    for block in surveyed(np.random.default_rng(2), photos, points):
        result = adjust(block)
        omega, freedom = result.sum_and_freedom
        trial = result._trial()
        trial.stand()
        facts = {name: [] for name in ("times", "position_sets", "control_sets", "checks")}
        rows, _ = trial.core.hypotheses(
            **facts,
            velocities=np.array(GOLDEN["velocity"])[:photos],
            readouts=[[0.0, 1 / GOLDEN["camera"]["height"], -0.5]],
            widths=[float(GOLDEN["camera"]["width"])],
            centre=[0.0, 0.0, 0.0],
            estimated=None if known else (omega, freedom),
            detection=(0.001, 0.8),
            limit=6.0,
            effects=0,
        )
        for place, row in enumerate(rows):
            if row["rank"] and row["redundancy"] > 1e-6:
                found[row["code"], place].append(row["probability"])
    assert len({code for code, _ in found}) > 10
    assert (freedom < 50) is (photos < 10)
    least = min(kstest(values, "uniform").pvalue for values in found.values())
    assert least > 0.01 / len(found), (least, len(found))
