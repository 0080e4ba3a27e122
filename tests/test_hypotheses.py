"""Hypotheses against a dense program: tests, redundancy, estimates, detectable biases, effects on points."""

import gzip
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dense_network import Survey
from photogram import (
    Block,
    Camera,
    Distance,
    InputError,
    Position,
    adjust,
    read_result,
    score_test,
    simulate,
    snoop,
)
from photogram.network import Attitude, OnPlumbLine, PlumbLine, rotation_matrix
from photogram.results.findings import duplicates
from photogram.statistics.findings import IMAGES, Removed
from photogram.words import phrase

GOLDEN = json.loads(gzip.decompress((Path(__file__).parent / "data/hypotheses/golden.json.gz").read_bytes()))
SETS = {
    "control-heights": "control heights",
    "control-shift": "control shift",
    "gnss-shift": "gnss shift",
    "lever-arm": "lever arm",
    "camera-f": "f",
    "camera-point": "cx cy",
    "camera-term": "k1",
    "scale": "scale",
    "time-offset": "time offset",
    "readout-time": "readout time",
}


def block_of(case, photos=None, chosen=slice(None)):
    """Return the block of a golden case, at the adjusted values; on request of some photos and images."""
    golden, observed = GOLDEN, GOLDEN["cases"][case]["observations"]
    camera, sd = golden["camera"], golden["standard_deviations"]
    poses = np.array(golden["start"]["poses"])[:photos]
    count = len(golden["start"]["points"])
    names = [str(row) for row in range(count)]
    control, points, point_sd = (
        golden["control_points"],
        np.full((count, 3), np.nan),
        np.full((count, 3), np.inf),
    )
    point_sd[control] = sd["control"]
    points[control] = observed["control"]
    values = {"f": camera["f"], "cx": camera["cx"], "cy": camera["cy"], "k": camera["k1"]}
    return Block(
        photo_positions=poses[:, :3],
        photo_attitudes=poses[:, 3:],
        point_positions=points,
        point_ids=names,
        point_sd=point_sd,
        image_photos=np.array(golden["image_photo"])[chosen],
        image_points=np.array(golden["image_point"])[chosen],
        image_xy=np.array(observed["image"]).reshape(-1, 2)[chosen],
        image_sd=sd["image"],
        cameras=[Camera("simple_radial", values)],
        observations=[
            *(Position(str(row), each, sd["gnss"]) for row, each in enumerate(observed["gnss"][:photos])),
            Distance(
                *(str(row) for row in golden["distance_points"]),
                np.ravel(observed["distance"])[0],
                sd["distance"],
            ),
        ],
    )


@pytest.fixture(scope="module", params=list(GOLDEN["cases"]))
def case(request):
    """Return a golden case, and what the core finds of its hypotheses."""
    camera = GOLDEN["camera"]
    result = adjust(block_of(request.param))
    trial = result._trial()
    trial.stand()
    found = trial.core.hypotheses(
        velocities=np.array(GOLDEN["velocity"]),
        times=[],
        position_sets=[],
        control_sets=[],
        readouts=[[[0.0, 1 / camera["height"], -0.5]]],
        widths=[float(camera["width"])],
        checks=[],
        centre=[0.0, 0.0, 0.0],
        estimated=None,
        detection=(GOLDEN["alpha0"], GOLDEN["power"]),
        limit=GOLDEN["K"],
        effects=100,
    )
    return GOLDEN["cases"][request.param], rows_of(found), found["correlations"]


def rows_of(found):
    """Return the columns of the core as rows, vectors without missing values."""
    names = ["code", "index", "component", "statistic", "redundancy", "noncentrality", "bias_to_noise"]
    rows = [dict(zip(names, row, strict=True)) for row in zip(*(found[name] for name in names), strict=True)]
    for k, row in enumerate(rows):
        row["of_set"], row["effect"] = found["group"][k] < 0, found["effects"].get(k)
        row |= {name: found[name][k][~np.isnan(found[name][k])] for name in ("estimate", "mdb")}
    return rows


def golden_of(row, hypotheses):
    """Return the golden hypothesis of a row; None if there is none."""
    if row["of_set"]:
        return hypotheses.get(SETS.get(row["code"]))
    if row["code"] == "control-point":
        number = GOLDEN["control_points"].index(row["index"])
        part = "" if row["component"] < 0 else " " + "XYZ"[row["component"]]
        return hypotheses[f"control {number}{part}"]
    if row["code"] == "observation" and row["component"] < 0:
        positions = len(GOLDEN["velocity"])
        return hypotheses["distance" if row["index"] == positions else f"gnss {row['index']}"]
    return None


def test_every_hypothesis_agrees_with_a_dense_program(case):
    golden, rows, _ = case
    compared = 0
    for row in rows:
        if (expected := golden_of(row, golden["hypotheses"])) is None:
            continue
        compared += 1
        k = expected["k"]
        name = (row["code"], row["index"], row["component"])
        assert row["statistic"] == pytest.approx(expected["T"], rel=1e-7, abs=1e-7), name
        assert row["redundancy"] == pytest.approx(expected["r"], rel=1e-7), name
        sd = np.sqrt(np.diag(np.reshape(expected["estimate_cofactors"], (k, k))))
        assert np.abs((row["estimate"] - expected["estimate"]) / sd).max() < 1e-7, name
        assert row["mdb"] == pytest.approx(expected["mdb"], rel=1e-6), name
        assert row["bias_to_noise"] == pytest.approx(expected["bias_to_noise"], rel=1e-7), name
        assert row["noncentrality"] == pytest.approx(expected["lambda0"], rel=1e-9)
        if row["effect"] is None:
            assert row["bias_to_noise"] <= GOLDEN["K"] or row["component"] >= 0
            continue
        points, others, ratio, _, change, _ = row["effect"]
        assert points == expected["points_beyond_4"], name
        if not row["code"].startswith("control") and row["code"] != "scale":  # Control points do not count
            assert (others > GOLDEN["K"]) == (expected["points_beyond_4_besides_own"] >= 2), name
        assert ratio == pytest.approx(expected["largest_sd"], rel=1e-6), name
        assert change == pytest.approx(expected["largest_m"], rel=1e-6), name
    assert compared == 6 * 4 + 1 + len(GOLDEN["velocity"]) + len(SETS)


def test_scores_are_correlated_as_a_dense_program_has_it(case):
    golden, rows, correlations = case
    sets = {SETS[row["code"]]: k for k, row in enumerate(rows[: len(correlations)]) if row["code"] in SETS}
    for first, others in golden["score_correlation"].items():
        for second, value in others.items():
            if first in sets and second in sets:
                assert correlations[sets[first], sets[second]] == pytest.approx(value, abs=1e-7)


@pytest.mark.parametrize(
    ("case", "verdict", "codes"),
    [
        # The MDB of a shift of control, 0.11 m, would move all points, but its estimate is small.
        ("clean", "accepted", []),
        ("control heights +0.3 m", "common-error", ["control-heights"]),
        ("lever arm (0.2, 0, 0) m", "common-error", ["time-offset", "lever-arm"]),
        ("f wrong by 0.3 %", "common-error", ["control-heights", "camera-f"]),
        ("control 4 Z +0.3 m", "gross-errors", []),
    ],
)
def test_the_verdict_names_the_errors_that_the_data_cannot_distinguish(case, verdict, codes):
    result = adjust(block_of(case))
    assert result.verdict.code == verdict
    every = result._hypotheses()
    found = [every.code[row] for row in every.common()]
    assert [code for code in codes if code in found] == codes
    assert bool(found) is bool(codes)


def test_errors_with_correlated_scores_are_named_in_a_line():
    result = adjust(block_of("f wrong by 0.3 %"))
    (line,) = [line for line in result.verdict.lines if line.code == "line.inseparable"]
    assert line.fields["named"].code == "hypothesis.control-heights"
    assert [other.code for other in line.fields["others"]] == ["hypothesis.lever-arm"]
    assert not any(line.code == "line.inseparable" for line in adjust(block_of("clean")).verdict.lines)


def twice(block, difference, rng):
    """Return a block with each photo twice; image coordinates of the second one have a `difference` in sd."""
    count = len(block.photo_ids)
    noise = rng.normal(size=block.image_xy.shape) * block.image_sd * difference
    return block.replace(
        photo_ids=[*block.photo_ids, *(f"again {name}" for name in block.photo_ids)],
        photo_positions=np.tile(block.photo_positions, (2, 1)),
        photo_attitudes=np.tile(block.photo_attitudes, (2, 1)),
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        photo_cameras=np.zeros(2 * count, dtype=np.int64),
        image_photos=np.concatenate([block.image_photos, block.image_photos + count]),
        image_points=np.tile(block.image_points, 2),
        image_xy=np.concatenate([block.image_xy, block.image_xy + noise]),
        image_sd=np.tile(block.image_sd, (2, 1)),
    )


@pytest.mark.parametrize("difference", [0.0, 0.05])
def test_photos_that_were_entered_twice_are_not_accepted(difference):
    verdict = adjust(twice(block_of("clean"), difference, np.random.default_rng(1))).verdict
    assert (verdict.code, verdict.exit) == ("duplicates", 4)
    assert verdict.message.fields["duplicates"][0].fields["n"] == len(GOLDEN["velocity"])


def test_points_that_were_entered_twice_are_not_accepted():
    block = block_of("clean")
    count = len(block.point_ids)
    verdict = adjust(
        block.replace(
            point_ids=[*block.point_ids, *(f"again {name}" for name in block.point_ids)],
            point_positions=np.concatenate([block.point_positions, np.full((count, 3), np.nan)]),
            point_sd=np.concatenate([block.point_sd, np.full((count, 3), np.inf)]),
            point_check_sd=None,
            image_photos=np.tile(block.image_photos, 2),
            image_points=np.concatenate([block.image_points, block.image_points + count]),
            image_xy=np.concatenate([block.image_xy, block.image_xy + 0.05 * block.image_sd]),
            image_sd=np.tile(block.image_sd, (2, 1)),
        )
    ).verdict
    assert (verdict.code, verdict.exit) == ("duplicates", 4)


def test_observations_that_were_entered_twice_are_not_accepted():
    block = block_of("clean")
    verdict = adjust(block.replace(observations=[*block.observations, *block.observations[:3]])).verdict
    assert (verdict.code, verdict.exit) == ("duplicates", 4)
    assert verdict.message.fields["duplicates"][0].fields["n"] == 3
    again = adjust(block.replace(observations=[*block.observations, block.observations[-1]])).verdict
    assert "distance" in again.headline


def test_equal_readings_of_a_repeated_distance_are_not_duplicates():
    """The last digit of a rounded length is as large as its standard deviation."""
    block = block_of("clean")
    *gnss, distance = block.observations
    rounded = replace(distance, length=round(distance.length, 2), sd=0.01)
    assert not duplicates(block.replace(observations=[*gnss, rounded, rounded]))


def test_points_that_are_on_one_line_twice_are_named():
    """Their condition has no observed value."""
    block, line = block_of("clean"), PlumbLine("pole")
    a, b, c = (OnPlumbLine(name, line, sd=0.01) for name in block.point_ids[:3])
    (message,) = duplicates(block.replace(observations=[a, b, c, b]))
    assert (message.code, message.fields["n"]) == ("duplicates.observations", 1)
    assert b.point in message.fields["names"][0]
    assert not duplicates(block.replace(observations=[a, b, c]))


def test_repeated_exposures_from_one_station_are_not_duplicates():
    """Their measurements are independent: differences are 1.4 times the noise."""
    assert not duplicates(twice(block_of("clean"), np.sqrt(2), np.random.default_rng(2)))


def test_a_misalignment_of_attitudes_is_named_before_an_incomplete_lens():
    block, clean = block_of("clean"), adjust(block_of("clean"))
    misalignment = rotation_matrix([[0.003, -0.002, 0.004]])[0]
    attitudes = [
        Attitude(name, matrix.T @ misalignment, 1e-4)
        for name, matrix in zip(block.photo_ids, rotation_matrix(clean.photo_attitudes), strict=True)
    ]
    result = adjust(block.replace(observations=[*block.observations, *attitudes]))
    every = result._hypotheses()
    assert result.verdict.code == "common-error"
    assert "boresight" in [every.code[row] for row in every.common()]


def test_a_missing_term_of_distortion_is_named_before_gross_errors():
    block = block_of("clean")
    camera = block.cameras[0]
    k = camera.parameters["k"]
    wrong = Camera("simple_radial", {**camera.parameters, "k": k - 0.02})
    result = adjust(block.replace(cameras=[wrong]))
    every = result._hypotheses()
    assert result.verdict.code in ("common-error", "model")
    assert every.code[every.common()[0]] == "camera-term"
    assert every.estimate[every.common()[0], 0] == pytest.approx(0.02, rel=0.2)


def test_errors_of_absurd_sizes_are_not_named():
    """Control heights in feet are not in the catalogue; other errors explain a part of the residuals."""
    block = block_of("clean")
    heights = np.where(np.isfinite(block.point_sd[:, 2]), block.point_positions[:, 2] / 0.3048, np.nan)
    positions = np.column_stack([block.point_positions[:, :2], heights])
    every = adjust(block.replace(point_positions=positions))._hypotheses()
    plausible = [np.array(each["plausible"]) for each in every.sets]
    sizes = [np.abs(every.estimate[row, : len(size)]) / size for row, size in enumerate(plausible)]
    absurd = {row for row, size in enumerate(sizes) if (size > 5).any()}
    assert absurd
    assert not absurd & set(every.common())


def test_removed_images_of_one_photo_are_counted_if_they_are_many():
    suspects = adjust(block_of("clean"))._trial().suspects
    images = np.flatnonzero((suspects.kinds == 0) & (suspects.photos == 2))
    for count, excessive in (
        (3, []),
        (len(images) // 2, [phrase("test.images_of", photo="2")]),
        (len(images), []),
    ):
        removed = np.isin(np.arange(len(suspects)), images[:count])
        rows = np.repeat(removed, np.diff(suspects.row_starts))
        counts = suspects.counts(rows, np.ones(len(suspects), dtype=bool))
        found = Removed([], counts).excessive
        assert [kind for kind in found if kind != IMAGES] == excessive


def test_one_distance_alone_leaves_the_scale_unchecked():
    block = block_of("clean")
    distance = block.observations[-1]
    result = adjust(block.replace(observations=[distance], point_sd=np.full((50, 3), np.inf)))
    assert result.verdict.code == "accepted-not-checked"
    assert (result.verdict.exit_code(strict=False), result.verdict.exit_code(strict=True)) == (0, 4)
    effects = result.external_reliability()
    distances = effects[effects.code == "observation"]
    assert (distances.redundancy < 1e-6).all()
    assert (distances.points > 40).all()
    assert len(result.hypotheses()) == len(effects)


def test_the_limit_of_undetected_errors_decides_the_verdict():
    result = adjust(block_of("clean")).with_max_bias_ratio(18.0)
    assert result.verdict.code == "accepted"
    strict = result.with_max_bias_ratio(0.5)
    assert strict.verdict.code == "accepted-not-checked"
    assert strict.with_max_bias_ratio(100.0).verdict.code == "accepted"
    points = [each.external_reliability().points.sum() for each in (strict, result)]
    assert points[0] > points[1]
    for wrong in (0.0, np.inf, "six"):
        with pytest.raises(InputError):
            result.with_max_bias_ratio(wrong)


def test_an_accepted_error_is_reported_if_its_estimate_moves_points():
    """The error of all control heights is 2.5 standard deviations, which no test rejects."""
    block, limit = block_of("clean"), 3.0
    clean = adjust(block).with_max_bias_ratio(limit)
    assert clean.verdict.code == "accepted"
    errors = clean._hypotheses()
    row = errors.code.tolist().index("control-heights")
    assert errors.effects[row].ratio > limit  # of the MDB, but its estimate is small
    error = 2.5 * np.sqrt(errors.sets[row]["cofactors"][0]) - errors.estimate[row, 0]
    positions = block.point_positions.copy()
    positions[(block.point_sd > 0).any(axis=1), 2] += error
    found = adjust(block.replace(point_positions=positions)).with_max_bias_ratio(limit)
    assert found._hypotheses().deviates[row] == pytest.approx(2.5, abs=0.02)
    assert found.verdict.code == "accepted-not-checked"
    assert "control-shift" in {found._hypotheses().code[harmful] for harmful in found._hypotheses().harmful}


def test_special_cases_of_an_undetected_error_are_counted():
    """A shift of all control includes an error of all heights."""
    result = adjust(block_of("clean")).with_max_bias_ratio(0.1)
    found = result._hypotheses()
    codes = [found.code[row] for row in found.harmful]
    assert "control-shift" in codes
    assert "control-heights" not in codes
    assert "control-heights" in {found.code[row] for row in found.effects if found.moved(row) > 0.1}
    nested = {
        each.fields["error"].fields["named"].code: each.fields["n"]
        for each in result.verdict.message.fields["errors"]
        if each.code == "unchecked.nested"
    }
    assert nested["hypothesis.control-shift"] == nested["hypothesis.gnss-shift"] == 1
    named = [each for each in result.verdict.message.fields["errors"] if each.code != "unchecked.sd"]
    assert len(named) == len(found.harmful)


def test_the_limit_is_an_option_and_a_setting(run, tmp_path):
    for number, given in enumerate((["--max-bias-ratio", 0.5], ["--set", "adjust.max_bias_ratio=0.5"])):
        folder = tmp_path / str(number)
        found = run("adjust", "--example", *given, "--strict", "--out", folder, "--parquet", folder / "saved")
        assert found.exit_code == 4
        result = read_result(folder / "saved")
        assert (result.max_bias_ratio, result.verdict.code) == (0.5, "accepted-not-checked")
        settings = (folder / "adjusted/project.toml").read_text(encoding="utf-8")
        assert "max_bias_ratio = 0.5" in settings
    assert run("adjust", "--example", "--set", "adjust.max_bias_ratio=-1").exit_code == 1
    found = run("giant", "--example", "--max-bias-ratio", 1000, "--json", "verdict.json", "--strict")
    assert json.loads((tmp_path / "verdict.json").read_text())["verdict"]["code"] == "accepted"
    assert found.exit_code == 0


def test_the_plot_shows_what_an_undetected_error_changes():
    block = block_of("clean")
    result = adjust(block)
    found = result._hypotheses()
    row = next(row for row in found.effects if found.code[row] == "control-point")
    moved = result._plot_data().moved(row)
    point = found.suspects.points[found.group[row]]
    np.testing.assert_array_equal(moved.suspects, result.point_positions[[point]])
    assert moved.ratios.max() == pytest.approx(found.moved(row), rel=1e-6)
    moves = moved.ratios > moved.limit * found.admitted(row)  # by the MDB
    assert np.count_nonzero(moves) == found.effects[row].points

    positions = block.point_positions.copy()
    positions[point] += found.admitted(row) * found.mdb[row]
    wrong = adjust(block.replace(point_positions=positions))
    changes = wrong.point_positions[moved.points] - result.point_positions[moved.points]
    assert np.abs(changes - moved.changes).max() < 0.02 * np.abs(changes).max()

    plot = result.plot.undetected(error=row)
    labels = [mark.label for mark in plot.panels[0].labelled]
    assert {"observation with the error", "control point"} <= set(labels)
    assert str(found.sentence(row)) in plot.panels[0].notes
    small = next(row for row in range(len(found.code)) if row not in found.effects)
    for refused in (
        lambda: result.plot.undetected(error=small),
        adjust(block, covariance=False).plot.undetected,
    ):
        with pytest.raises(InputError) as error:
            refused()
        assert error.value.code == "plot.undetected"


def facts_of(**changes):
    """Return the facts of the golden network with other values."""
    facts = {name: [] for name in ("times", "position_sets", "control_sets", "readouts", "checks")}
    facts |= {"velocities": np.array(GOLDEN["velocity"]), "widths": [float(GOLDEN["camera"]["width"])]}
    facts |= {"centre": [0.0, 0.0, 0.0], "estimated": None, "detection": (0.001, 0.8), "limit": 4.0}
    return facts | {"effects": 0} | changes


def evaluated(result, **changes):
    trial = result._trial()
    trial.stand()
    found = trial.core.hypotheses(**facts_of(**changes))
    codes = list(zip(found["code"], found["index"].tolist(), strict=True))
    return {code: float(found["statistic"][row]) for row, code in enumerate(codes[: len(found["sets"])])}


def test_deformations_of_images_agree_with_tests_of_their_partials():
    result, camera = adjust(block_of("lever arm (0.2, 0, 0) m")), GOLDEN["camera"]
    x, y = (result.block.image_xy - [camera["cx"], camera["cy"]]).T
    nothing, strips = np.zeros_like(x), np.arange(len(GOLDEN["velocity"])) // 4
    found = evaluated(result, position_sets=strips.tolist())
    affinity = np.array([np.column_stack([x, nothing]), np.column_stack([y, nothing])])
    assert found["camera-affinity", 0] == pytest.approx(
        score_test(result, partials=affinity).statistic, rel=1e-7
    )
    # Partials by the principal distance, for the photos of a strip.
    partials = (result.block.image_xy - result.residuals - [camera["cx"], camera["cy"]]) / camera["f"]
    for strip in range(3):
        own = strips[result.block.image_photos] == strip
        expected = score_test(result, partials=[partials * own[:, np.newaxis]]).statistic
        assert found["camera-f-strip", strip] == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_a_missing_radial_distortion_agrees_with_the_test_of_its_partials():
    block = block_of("clean")
    camera = GOLDEN["camera"]
    plain = Camera("simple_pinhole", {name: camera[name] for name in ("f", "cx", "cy")})
    result = adjust(block.replace(cameras=[plain]))
    xy = block.image_xy - [camera["cx"], camera["cy"]]
    partials = xy * (xy**2).sum(axis=1, keepdims=True) / camera["f"] ** 2
    expected = score_test(result, partials=[partials]).statistic
    assert evaluated(result)["camera-radial", 0] == pytest.approx(expected, rel=1e-7)
    assert "camera-radial" not in {code for code, _ in evaluated(adjust(block))}


def test_errors_of_principal_distances_and_points_agree_with_tests_of_their_partials():
    result, camera = adjust(block_of("lever arm (0.2, 0, 0) m")), GOLDEN["camera"]
    block = result.block
    partials = (block.image_xy - result.residuals - [camera["cx"], camera["cy"]]) / camera["f"]
    found, count = evaluated(result), len(GOLDEN["velocity"])
    for half in range(2):
        own = (np.arange(count) >= count // 2)[block.image_photos] == half
        expected = score_test(result, partials=[partials * own[:, np.newaxis]]).statistic
        assert found["camera-f-half", half] == pytest.approx(expected, rel=1e-6, abs=1e-9)
    exchange = np.ones_like(partials) * [1.0, -1.0]
    expected = score_test(result, partials=[exchange]).statistic
    assert found["camera-exchanged", 0] == pytest.approx(expected, rel=1e-6)


def test_a_shift_of_the_images_of_a_photo_agrees_with_the_test_of_its_partials():
    result = adjust(block_of("lever arm (0.2, 0, 0) m"))
    found = evaluated(result, photos=[1, 4])
    for photo in (1, 4):
        own = (result.block.image_photos == photo)[:, np.newaxis]
        expected = score_test(result, partials=[own * [1.0, 0.0], own * [0.0, 1.0]]).statistic
        assert found["photo", photo] == pytest.approx(expected, rel=1e-7)
    assert [photo for code, photo in found if code == "photo"] == [1, 4]


def test_a_misplaced_target_agrees_with_the_test_of_its_partials():
    """Images of a point with control and a distance, changed by its coordinates."""
    block, camera = block_of("clean"), GOLDEN["camera"]
    *gnss, distance = block.observations
    control = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    ends = [block.point_ids[k] for k in control[:2]]
    length = float(np.linalg.norm(np.diff(block.point_positions[control[:2]], axis=0))) + 0.01
    bar = Distance(*ends, length, 0.01)
    result = adjust(block.replace(observations=[*gnss, distance, bar]))
    found = evaluated(result)
    targets = [index for code, index in found if code == "object-point"]
    assert targets == control[:2].tolist()
    own = (block.image_points == targets[0])[:, np.newaxis]
    of, points = block.image_photos, result.point_positions[block.image_points]

    def images(points):
        u = np.einsum(
            "nij,nj->ni", rotation_matrix(result.photo_attitudes)[of], points - result.photo_positions[of]
        )
        xy = -u[:, :2] / u[:, 2:] * [1.0, -1.0]
        return camera["f"] * xy * (1 + camera["k1"] * (xy**2).sum(axis=1, keepdims=True))

    steps = 1e-3 * np.eye(3)
    partials = [own * (images(points + step) - images(points - step)) / 2e-3 for step in steps]
    assert found["object-point", targets[0]] == pytest.approx(
        score_test(result, partials=partials).statistic, rel=1e-5
    )


def test_a_target_that_was_measured_on_a_neighbour_is_named():
    """The point is an end of three distances without control."""
    block = block_of("clean")
    *gnss, _ = block.observations
    places, control = adjust(block).point_positions, np.isfinite(block.point_sd).all(axis=1)
    point, *others = np.flatnonzero(np.isfinite(places).all(axis=1) & ~control)[[3, 10, 20, 30]].tolist()
    bars = [
        Distance(block.point_ids[point], block.point_ids[k], np.linalg.norm(places[point] - places[k]), 0.01)
        for k in others
    ]
    moved = [
        replace(bar, length=bar.length + error) for bar, error in zip(bars, (0.8, -0.6, 0.7), strict=True)
    ]
    first = adjust(block.replace(observations=[*gnss, *moved])).verdict.message.fields["errors"][0]
    assert first.fields["named"].code == "hypothesis.object-point"
    assert first.fields["named"].fields["point"] == block.point_ids[point]


def test_wrong_fixed_coordinates_of_a_point_with_distances_are_named():
    """All its observations show the error; T is the decrease of the sum of squares if they are free."""
    block = block_of("clean")
    *gnss, _ = block.observations
    places, sd = block.point_positions.copy(), block.point_sd.copy()
    adjusted = adjust(block).point_positions
    point, *others = np.flatnonzero(np.isfinite(adjusted).all(axis=1))[[3, 10, 20, 30]].tolist()
    lengths = np.linalg.norm(adjusted[others] - adjusted[point], axis=1)
    bars = [
        Distance(block.point_ids[point], block.point_ids[k], length, 0.01)
        for k, length in zip(others, lengths, strict=True)
    ]
    places[point], sd[point] = adjusted[point] + [0.3, 0.1, 0.0], 0.0
    fixed = block.replace(point_positions=places, point_sd=sd, observations=[*gnss, *bars])
    sd = sd.copy()
    sd[point] = np.inf
    result, free = adjust(fixed), adjust(fixed.replace(point_sd=sd))
    decrease = result.sum_and_freedom[0] - free.sum_and_freedom[0]
    assert evaluated(result)["fixed-point", point] == pytest.approx(decrease, rel=0.01)
    first = result.verdict.message.fields["errors"][0].fields["named"]
    assert first.code == "hypothesis.fixed-point"
    assert first.fields["point"] == block.point_ids[point]


@pytest.mark.parametrize("size", [0.98, 1.1])
def test_images_of_another_size_are_named(size):
    """The principal distance and the principal point change by one factor; poses are observed."""
    block = Survey(weighted=False, points=100).block(np.random.default_rng(1))
    values = {**block.cameras[0].parameters}
    values |= {name: size * values[name] for name in ("f", "cx", "cy")}
    result = adjust(block.replace(cameras=[Camera("simple_radial", values)] * 2))
    first = result.verdict.message.fields["errors"][0]
    assert first.fields["named"].code == "hypothesis.camera-size"


@pytest.mark.parametrize("strips", [1, 4])
@pytest.mark.parametrize(("share", "position_sd"), [(0.005, 0.05), (0.1, np.inf)])
def test_another_origin_of_the_images_of_a_photo_is_named(strips, share, position_sd):
    """Of few photos all are tested, of many those with large mean residuals."""
    block = simulate(strips=strips, photos_per_strip=8, position_sd=position_sd, seed=4).block
    xy = block.image_xy.copy()
    xy[block.image_photos == 3] += share * np.ptp(xy, axis=0)
    first = adjust(block.replace(image_xy=xy)).verdict.message.fields["errors"][0].fields["named"]
    assert first.code == "hypothesis.photo"
    assert first.fields["photo"] == block.photo_ids[3]


def test_a_strip_of_many_is_named():
    """Of more than eight strips those with notable differences of their positions are tested."""
    block = simulate(strips=10, photos_per_strip=5, position_sd=0.05, seed=4).block
    observed = block.photo_positions_observed.copy()
    observed[15:20] += [0.4, -0.3, 0.3]  # The fourth strip
    clean, wrong = adjust(block), adjust(block.replace(photo_positions_observed=observed))
    assert "gnss-set" not in clean._hypotheses().code
    first = wrong.verdict.message.fields["errors"][0].fields["named"]
    assert (first.code, first.fields["set"]) == ("hypothesis.gnss-set", 4)


def test_a_scale_of_one_of_two_distances_is_an_error_of_this_distance():
    """With one precise and one imprecise distance, the scale of both is the error of the precise one."""
    block = block_of("clean")
    *gnss, distance = block.observations
    pair = [block.point_ids[k] for k in np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[:2]]
    other = Distance(*pair, 1000.0, 1e6)
    result = adjust(block.replace(observations=[*gnss, distance, other]))
    trial = result._trial()
    trial.stand()
    found = trial.core.hypotheses(**facts_of())
    rows = [k for k, code in enumerate(found["code"]) if code == "observation" and found["component"][k] < 0]
    statistics = dict(zip(found["index"][rows].tolist(), found["statistic"][rows], strict=True))
    assert evaluated(result)["distance-scale", -1] == pytest.approx(statistics[len(gnss)], rel=1e-5)


def test_a_scale_of_all_distances_is_named():
    block = block_of("clean")
    *gnss, _ = block.observations
    control = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[:4]
    places = adjust(block).point_positions
    pairs = [(i, j) for i in control for j in control if i < j]
    lengths = [1.003 * np.linalg.norm(places[i] - places[j]) for i, j in pairs]
    distances = [
        Distance(block.point_ids[i], block.point_ids[j], length, 0.002)
        for (i, j), length in zip(pairs, lengths, strict=True)
    ]
    verdict = adjust(block.replace(observations=[*gnss, *distances])).verdict
    first = verdict.message.fields["errors"][0].fields["named"]
    assert (verdict.code, first.code) == ("common-error", "hypothesis.distance-scale")


def test_snooping_names_the_scale_of_all_distances_although_control_is_fixed():
    """Errors of fixed points resemble errors in common, but explain less."""
    block = block_of("clean")
    *gnss, _ = block.observations
    places, control = adjust(block).point_positions, np.isfinite(block.point_sd).all(axis=1)
    others = np.flatnonzero(np.isfinite(places).all(axis=1) & ~control)[:12].reshape(-1, 2)
    distances = [
        Distance(block.point_ids[i], block.point_ids[j], 1.01 * np.linalg.norm(places[i] - places[j]), 0.01)
        for i, j in others
    ]
    fixed = block.replace(
        observations=[*gnss, *distances],
        point_positions=np.where(control[:, np.newaxis], places, np.nan),
        point_sd=np.where(control[:, np.newaxis], 0.0, [np.inf] * 3),
    )
    found = snoop(fixed)
    assert not found.removed
    first = found.result.verdict.message.fields["errors"][0].fields["named"]
    assert first.code == "hypothesis.distance-scale"


def test_an_exchanged_principal_point_is_named():
    camera = GOLDEN["camera"]
    values = {"f": camera["f"], "cx": camera["cy"], "cy": camera["cx"], "k": camera["k1"]}
    wrong = block_of("clean").replace(cameras=[Camera("simple_radial", values)])
    named = adjust(wrong).verdict.message.fields["errors"][0].fields["named"]
    assert named.code == "hypothesis.camera-exchanged"


def test_an_exchanged_principal_point_is_named_in_close_range():
    """Second-order terms of 500 pixels are large, and a lens explains them too."""
    rng = np.random.default_rng(11)
    points, angles = rng.uniform(-0.7, 0.7, (60, 3)), np.linspace(0, 2 * np.pi, 12, endpoint=False)
    poses, xy = [], []
    for angle, height in zip(angles, [1.2, 2.2] * 6, strict=True):
        centre = np.array([3 * np.cos(angle), 3 * np.sin(angle), height])
        back, right = centre / np.linalg.norm(centre), np.array([-np.sin(angle), np.cos(angle), 0.0])
        m = np.array([right, np.cross(back, right), back])
        u = (points - centre) @ m.T
        xy.append([2000, 1500] + 3600 * u[:, :2] / u[:, 2:] * [-1, 1] + rng.normal(size=(60, 2)) * 0.5)
        turned = np.arctan2(-m[2, 1], m[2, 2]), np.arcsin(m[2, 0]), np.arctan2(-m[1, 0], m[0, 0])
        poses.append([*centre, *turned])
    known = np.arange(60) < 8
    block = Block(
        photo_ids=[f"i{row}" for row in range(12)],
        photo_positions=np.array(poses)[:, :3],
        photo_attitudes=np.array(poses)[:, 3:],
        point_ids=[f"p{row}" for row in range(60)],
        point_positions=np.where(known[:, np.newaxis], points, np.nan),
        point_sd=np.where(known, 2e-4, np.inf)[:, np.newaxis] * [1, 1, 1],
        image_photos=np.repeat(np.arange(12), 60),
        image_points=np.tile(np.arange(60), 12),
        image_xy=np.vstack(xy),
        image_sd=0.5,
        cameras=[Camera("simple_pinhole", {"f": 3600, "cx": 1500, "cy": 2000})],
    )
    verdict = adjust(block).verdict
    assert verdict.code == "common-error"
    named = verdict.message.fields["errors"][0].fields["named"]
    assert named.code == "hypothesis.camera-exchanged"


def test_bent_control_is_named_if_positions_contradict_it():
    block = block_of("clean")
    control, places = np.isfinite(block.point_sd).all(axis=1), block.point_positions.copy()
    plan = places[control, :2] - places[control, :2].mean(axis=0)
    places[control, 2] += 2.0 * (plan[:, 0] / np.abs(plan[:, 0]).max()) ** 2
    verdict = adjust(block.replace(point_positions=places)).verdict
    named = verdict.message.fields["errors"][0].fields["named"]
    assert named.code == "hypothesis.control-bending"


def test_the_next_photo_is_a_time_offset_by_the_way_to_it():
    result = adjust(block_of("clean"))
    ways = np.diff(result.photo_positions, axis=0)
    for code, ways_of in (("gnss-next", [ways[0], *ways]), ("gnss-previous", [*-ways, -ways[-1]])):
        found = evaluated(result, velocities=np.array(ways_of))
        assert found[code, -1] == pytest.approx(found["time-offset", -1], rel=1e-9)


@pytest.mark.parametrize(("code", "way"), [("gnss-next", 1), ("gnss-previous", -1)])
def test_positions_of_other_photos_are_named(code, way):
    block = block_of("clean")
    *gnss, distance = block.observations
    places = [each.position for each in gnss][::way]
    gnss = gnss[::way]
    moved = [replace(own, position=place) for own, place in zip(gnss, [*places[1:], places[-1]], strict=True)]
    first = adjust(block.replace(observations=[*moved, distance])).verdict.message.fields["errors"][0]
    assert first.fields["named"].code == f"hypothesis.{code}"


def test_check_points_name_the_control_point_that_residuals_do_not_show():
    """Of three control points, one wrong height tilts the block, and no residual shows it."""
    block = simulate(strips=2, photos_per_strip=6, control_sd=0.02, check_points=6, seed=3).block
    control = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    plan = block.point_positions[control, :2]
    chosen = control[[plan.sum(axis=1).argmin(), plan.sum(axis=1).argmax(), (plan @ [1, -1]).argmax()]]
    sd, positions = block.point_sd.copy(), block.point_positions.copy()
    left = np.setdiff1d(control, chosen)
    sd[left], positions[left] = np.inf, np.nan
    positions[chosen[2], 2] += 5.0
    found = adjust(block.replace(point_sd=sd, point_positions=positions)).verdict
    assert (found.code, found.exit) == ("check-points", 4)
    height = found.message.fields["errors"][0].fields["named"]
    assert height.fields["named"].fields["point"] == block.point_ids[chosen[2]]
    assert block.point_ids[chosen[2]] in found.headline


@pytest.mark.parametrize("loss", [None, "huber", "cauchy"])
def test_too_small_standard_deviations_of_positions_are_named_before_single_positions(loss):
    block = block_of("clean")
    *gnss, distance = block.observations
    gnss = [replace(each, sd=np.asarray(each.sd) / 10) for each in gnss]
    found = adjust(block.replace(observations=[*gnss, distance]), loss=loss).verdict
    assert (found.code, found.exit) == ("weights-of-types", 4)
    (wrong,) = found.message.fields["types"]
    assert wrong.fields["factor"] == pytest.approx(10, rel=0.4)
