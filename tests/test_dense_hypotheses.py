"""Every hypothesis of the catalogue against a dense program: its errors, tests, biases and effects."""

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from dense_network import AXES, HEIGHT, MODELS, WIDTH, Dense, Survey, turned
from photogram import adjust

CLOSE = 1e-7  # Relative; redundancies are differences of large numbers


def places(dense, field, groups=("control",)):
    """Return an error of the places that control or positions observe: a field of (n, 3) places."""
    names = {"control": "point", "positions": "centre"}
    return {group: {names[group]: field(dense.rows[group][names[group]])} for group in groups}


def shifts(dense, group, share=1.0):
    return [
        places(dense, lambda own, e=e: np.multiply.outer(np.ones(len(own)) * share, e), [group]) for e in AXES
    ]


def camera(dense, parameters, photos=True):
    """Return an error of parameters of the camera, in the images of some photos."""
    own = np.broadcast_to(photos, len(dense.survey.poses))[dense.survey.photos]
    return {"images": {"camera": np.multiply.outer(own, np.array(parameters, dtype=float))}}


def pixels(dense, change):
    """Return an error of the images: (m, 2) of (m, 2) observed ones, relative to the principal point."""
    return {"images": {"shift": change(dense.block.image_xy - dense.survey.cameras[0, 1:3])}}


def read(dense, axis):
    """Return the motion of all photos during the readout of their rows (1) or columns (0)."""
    time = dense.block.image_xy[:, axis] / (WIDTH, HEIGHT)[axis] - 0.5
    return [{"images": {"centre": time[:, np.newaxis] * dense.survey.velocities[dense.survey.photos]}}]


def assigned(dense, step):
    """Return the error of positions that belong to the next photo (1), or to the one before (-1)."""
    ways = np.diff(dense.observed["positions"], axis=0)
    own = np.vstack([ways[:1], ways]) if step > 0 else -np.vstack([ways, ways[-1:]])
    return [{"positions": {"centre": own}}]


def bent(dense, groups):
    """Return the bending of heights, 1 at the edge of all control and positions."""
    centre = dense.survey.facts(dense.block)["centre"]
    every = np.vstack([dense.rows["positions"]["centre"], dense.rows["control"]["point"]]) - centre
    half = np.abs(every).max(axis=0)

    def height(axis):
        return lambda own: np.outer(((own - centre)[:, axis] / half[axis]) ** 2, AXES[2])

    return [places(dense, height(axis), groups) for axis in range(2)]


def away(dense, own):
    return own - np.array(dense.survey.facts(dense.block)["centre"])


BOTH = "positions", "control"
HALF = np.arange(12) >= 6
SETS = {
    "control-heights": lambda n, _: shifts(n, "control")[2:],
    "control-shift": lambda n, _: shifts(n, "control"),
    "control-set": lambda n, k: shifts(n, "control", np.arange(7) % 2 == k),
    "control-scale": lambda n, _: [places(n, lambda own: away(n, own))],
    "control-rotation": lambda n, _: [places(n, lambda own, e=e: np.cross(e, away(n, own))) for e in AXES],
    "gnss-heights": lambda n, _: shifts(n, "positions")[2:],
    "gnss-shift": lambda n, _: shifts(n, "positions"),
    "gnss-set": lambda n, k: shifts(n, "positions", n.survey.strips == k),
    "gnss-half": lambda n, k: shifts(n, "positions", k == HALF),
    "gnss-drift": lambda n, _: shifts(n, "positions", np.arange(12) / 11 - 0.5),
    "gnss-next": lambda n, _: assigned(n, 1),
    "gnss-previous": lambda n, _: assigned(n, -1),
    "time-offset": lambda n, _: [places(n, lambda own: n.survey.velocities, ["positions"])],
    "lever-arm": lambda n, _: [
        places(n, lambda own, k=k: turned(n.state["poses"][:, 3:])[:, k], ["positions"]) for k in range(3)
    ],
    "boresight": lambda n, _: [
        {group: {"turn": np.tile(e, (12, 1))} for group in {"attitudes", "angles"} & {*n.rows}} for e in AXES
    ],
    "camera-f": lambda n, _: [camera(n, [1, 0, 0, 0])],
    "camera-point": lambda n, _: [camera(n, [0, 1, 0, 0]), camera(n, [0, 0, 1, 0])],
    "camera-term": lambda n, _: [camera(n, [0, 0, 0, 1])],
    "camera-exchanged": lambda n, _: [
        camera(n, np.array([0, -1, 1, 0]) * np.subtract(*n.survey.cameras[0, 1:3]))
    ],
    "camera-size": lambda n, _: [camera(n, [*n.survey.cameras[0, :3], 0])],
    "camera-f-strip": lambda n, k: [camera(n, [1, 0, 0, 0], n.survey.strips == k)],
    "camera-f-half": lambda n, k: [camera(n, [1, 0, 0, 0], k == HALF)],
    "camera-f-single": lambda n, k: [camera(n, [1, 0, 0, 0], n.survey.of_camera == k)],
    "camera-affinity": lambda n, _: [
        pixels(n, lambda xy, k=k: np.outer(xy[:, k], AXES[0, :2])) for k in range(2)
    ],
    "camera-radial": lambda n, _: [
        pixels(n, lambda xy: xy * (xy**2).sum(axis=1, keepdims=True) / n.state["cameras"][0, 0] ** 2)
    ],
    "photo": lambda n, k: [
        pixels(n, lambda xy, e=e: np.outer(n.survey.photos == k, e)) for e in AXES[:2, :2]
    ],
    "readout-time": lambda n, _: read(n, 1),
    "readout-time-columns": lambda n, _: read(n, 0),
    "object-point": lambda n, k: [{"images": {"point": np.outer(n.survey.seen == k, e)}} for e in AXES],
    "distance-scale": lambda n, _: [{"distances": {"shift": MODELS["distances"](n.rows["distances"])}}],
    "scale": lambda n, _: [places(n, lambda own: away(n, own), BOTH)],
    "bending": lambda n, _: bent(n, BOTH),
    "control-bending": lambda n, _: bent(n, ["control"]),
}
"""Errors in common: what a unit of each parameter displaces, by the set, camera, photo or point."""

SINGLE = {
    "control-point": ("control", lambda n, k: n.survey.control.tolist().index(k)),
    "position": ("positions", lambda n, k: k),
    "attitude": ("angles", lambda n, k: k),
    "camera": ("cameras", lambda n, k: k),
}
"""Groups of observations with an error of their own, and their rows."""


def errors(dense, row):
    """Return the errors of the parameters of a hypothesis."""
    if row["code"] in SETS:
        return SETS[row["code"]](dense, row["index"])
    if row["code"] == "observation":
        kinds = [("positions", 12), ("attitudes", 12), ("distances", 3)][2 * dense.survey.weighted :]
        group, place = [(group, k) for group, count in kinds for k in range(count)][row["index"]]
    else:
        group, of = SINGLE[row["code"]]
        place = of(dense, row["index"])
    own = np.zeros(dense.observed[group].shape)
    components = range(own.shape[1]) if row["component"] < 0 else [row["component"]]
    changes = []
    for component in components:
        change = own.copy()
        change[place, component] = 1.0
        changes.append({group: {"shift": change}})
    return changes


@pytest.fixture(scope="module", params=[False, True], ids=["observed", "weighted"])
def case(request):
    """Return the dense program of a network, and the rows of the core."""
    survey = Survey(weighted=request.param)
    block = survey.block(np.random.default_rng(3))
    result = adjust(block)
    trial = result._trial()
    trial.stand()
    found = trial.core.hypotheses(**survey.facts(block, checks=list(range(30))))
    return Dense(survey, block, result), found, result


def rows_of(found):
    names = [
        "code",
        "index",
        "component",
        "rank",
        "statistic",
        "redundancy",
        "noncentrality",
        "bias_to_noise",
    ]
    names += ["observations", "probability"]
    rows = [dict(zip(names, row, strict=True)) for row in zip(*(found[name] for name in names), strict=True)]
    for k, row in enumerate(rows):
        row["effect"] = found["effects"].get(k)
        row["set"] = found["sets"][k] if k < len(found["sets"]) else None
        row |= {name: found[name][k][~np.isnan(found[name][k])] for name in ("estimate", "mdb")}
    return rows


def test_the_dense_program_is_at_the_adjusted_values(case):
    dense, _, result = case
    assert np.abs(dense.step).max() < 1e-5
    assert dense.v @ dense.v == pytest.approx(result.sum_and_freedom[0], rel=1e-9)


def test_every_code_is_compared():
    codes = set()
    for weighted in (False, True):
        survey = Survey(weighted=weighted)
        block = survey.block(np.random.default_rng(3))
        trial = adjust(block)._trial()
        trial.stand()
        codes |= set(trial.core.hypotheses(**survey.facts(block))["code"])
    assert codes == {*SETS, *SINGLE, "observation"}


def test_every_hypothesis_agrees_with_the_dense_program(case):
    dense, found, _ = case
    for row in rows_of(found):
        name = (row["code"], row["index"], row["component"])
        own = dense.tested(errors(dense, row))
        sd, k = np.sqrt(np.diag(own["cofactors"])), len(row["estimate"])
        assert row["rank"] == own["rank"], name
        assert row["statistic"] == pytest.approx(own["T"], rel=CLOSE, abs=CLOSE), name
        assert np.abs((row["estimate"] - own["estimate"]) / sd).max() < CLOSE, name
        assert row["redundancy"] == pytest.approx(own["r"], rel=CLOSE, abs=CLOSE), name
        assert row["probability"] == pytest.approx(chi2.sf(own["T"], own["rank"]), rel=1e-6), name
        # lambda0 has the power 0.8 at the level 0.001.
        power = ncx2.sf(chi2.isf(0.001, k), k, row["noncentrality"])
        assert power == pytest.approx(0.8, abs=1e-9), name
        if own["direction"] is None:
            assert not len(row["mdb"]), name
        else:
            mdb = own["direction"] * np.sqrt(row["noncentrality"])
            assert row["mdb"] == pytest.approx(mdb, rel=1e-5, abs=1e-5 * np.abs(mdb).max()), name
        if row["set"]:
            cofactors, scale = np.reshape(row["set"]["cofactors"], (k, k)), np.outer(sd, sd)
            assert np.abs((cofactors - own["cofactors"]) / scale).max() < CLOSE, name


def test_the_effects_of_undetected_errors_agree_with_the_dense_program(case):
    dense, found, _ = case
    compared = set()
    for row in rows_of(found):
        name = (row["code"], row["index"], row["component"])
        own = dense.tested(errors(dense, row))
        if own["direction"] is None:
            continue
        changes, ratio = dense.effect(own["c"] @ row["mdb"])
        assert row["bias_to_noise"] == pytest.approx(ratio, rel=CLOSE), name
        if row["effect"] is None:
            assert ratio <= 4.0 or row["component"] >= 0, name
            continue
        compared.add(row["code"])
        points, _, largest, _, _, moved = row["effect"]
        relative = np.abs(changes) / dense.point_sd
        assert np.nan_to_num(moved) == pytest.approx(changes, rel=1e-5, abs=1e-6 * np.abs(changes).max()), (
            name
        )
        assert largest == pytest.approx(relative.max(), rel=1e-6), name
        assert points == np.count_nonzero((relative > 4.0).any(axis=1)), name
    assert compared >= {*SETS} & {row["code"] for row in rows_of(found)}
