"""What the problems of an orientation name: outliers, a failed global test, control that does not fit."""

import json
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import pytest
from orientation_models import FULL, HEIGHT, HORIZONTAL, MIXED, simulate

from photogram import InputError, orient
from photogram.absolute_orientation import Stations, read_csv, read_similarity

NOISE = 0.004


@pytest.fixture(scope="module")
def example():
    with as_file(files("photogram") / "examples" / "absolute_orientation" / "stations.csv") as path:
        return read_csv(path, ground_unit="m", model_unit="mm")


def changed(given, name, change, **options):
    """Return stations with the control of one of them changed."""
    control = given.control.copy()
    row = given.ids.index(name)
    control[row] = change(control[row])
    return Stations(given.ids, control, given.model, ground_unit="m", model_unit="mm", **options)


# Outliers


def test_an_outlier_of_few_degrees_of_freedom_is_named(example):
    """Ten metres in a height: the internally studentized residual cannot exceed root 8 = 2.83."""
    result = orient(changed(example, "V203", lambda xyz: np.add(xyz, [0, 0, 10])))
    row = example.ids.index("V203")
    assert result.standardized[row, 2] == pytest.approx(np.sqrt(8), abs=2e-3)
    assert result.studentized[row, 2] > 100
    assert result.limit == pytest.approx(4.357, abs=0.01)
    assert result.outliers == [(row, 2)]
    (problem,) = result.problems
    assert "V203 Z (t 2" in problem
    assert "wrong by about 10.2 m" in problem
    assert problem in " ".join(result.report().split())
    (tested,) = [each for each in result.document().table("control").columns if each.marked is not None]
    names = np.array(example.ids)[result.took_part]
    assert names[tested.marked.any(axis=1)].tolist() == ["V203"]
    document = json.loads(result.to_json())
    assert document["usable"]
    assert document["test"]["outliers"] == [["V203", "Z"]]
    assert document["messages"] == [problem]
    station = next(each for each in document["control"] if each["id"] == "V203")
    assert station["studentized"][2] == pytest.approx(result.studentized[row, 2])


def test_good_control_is_named_in_one_of_twenty_orientations():
    generator = np.random.default_rng(64)
    model = simulate(generator, angles=(0.1, -0.05, 2.0))
    runs = 400
    named = [
        bool(orient(model.stations(model_error=NOISE * generator.standard_normal((8, 3)))).outliers)
        for _ in range(runs)
    ]
    # Bonferroni: at most 5 percent; three standard deviations of 400 runs above it are 8 percent.
    assert 0.01 < np.mean(named) < 0.08


def test_without_two_degrees_of_freedom_there_is_no_test():
    generator = np.random.default_rng(3)
    model = simulate(generator, (FULL, FULL, HORIZONTAL), angles=(0.02, 0.01, 1.0))
    control = np.where(model.known, model.ground, np.nan)
    control[2] = [np.nan, np.nan, model.ground[2, 2]]
    extended = np.vstack([control, [model.ground[0, 0] + 100, np.nan, np.nan]])
    exact = np.vstack([model.exact, model.truth.to_model([[model.ground[0, 0] + 100, 50, 20]])])
    result = orient(Stations(range(4), extended, exact + 1e-3 * generator.standard_normal((4, 3))))
    assert result.degrees_of_freedom == 1
    assert result.limit == np.inf
    assert not result.outliers
    assert not any(each.marked.any() for each in result.document().table("control").columns[6:7])
    assert json.loads(result.to_json())["test"]["limit"] is None


def test_standard_deviations_to_be_relied_on_decide_by_the_normal_distribution(example):
    options = {"control_sd": 0.03, "model_sd": 0.008}
    given = changed(example, "V203", lambda xyz: np.add(xyz, [0, 0, 1]), **options)
    known, estimated = (orient(given, unit_variance=how) for how in ("unity", "estimated"))
    row = example.ids.index("V203")
    assert known.tested[row, 2] == known.standardized[row, 2]
    assert estimated.tested[row, 2] == estimated.studentized[row, 2]
    assert known.limit == pytest.approx(2.935, abs=0.001)
    assert "V203 Z (w " in " ".join(known.problems)
    frame, names = known.control_table(), np.array(example.ids)[known.took_part]
    assert frame["id"].tolist() == names.tolist()
    np.testing.assert_array_equal(frame["standardized_Z"], known.standardized[known.took_part, 2])
    marked = [each.name for each in known.document().table("control").columns if each.marked is not None]
    assert marked == ["standardized"]


def test_a_failed_global_test_comes_first(example):
    given = Stations(example.ids, example.control, example.model, control_sd=0.001, model_sd=0.001)
    result = orient(given)
    assert result.test.rejected_high
    assert result.problems[0].startswith("the global test fails: residuals are ")
    assert result.document().sections[-1].parts[0].sentences[0] == result.problems[0]
    document = json.loads(result.to_json())
    assert document["global_test"]["rejected_high"]
    assert document["messages"][0] == result.problems[0]
    assert orient(example).test is None


# What is found by trying


def noisy(seed=5, kinds=MIXED):
    generator = np.random.default_rng(seed)
    model = simulate(generator, kinds, angles=(0.03, -0.02, 1.0))
    given = model.stations(model_error=NOISE * generator.standard_normal((len(kinds), 3)))
    return Stations(given.ids, np.add(given.control, [5e5, 3.2e6, 100]), given.model)


def with_control(given, control):
    return Stations(given.ids, control, given.model)


HYPOTHESES = {
    "X and Y of station 0 are exchanged": lambda c: np.vstack([c[:1, [1, 0, 2]], c[1:]]),
    "the control is a mirror image of the model": lambda c: c[:, [1, 0, 2]],
    "mirror": lambda c: c * [-1, 1, 1],
    "the elevations of the control are in feet": lambda c: c / [1, 1, 0.3048],
    "the elevations of the control are in metres, but the plan is in feet": lambda c: c / [0.3048, 0.3048, 1],
    "the coordinates of station 3 are in feet": lambda c: np.vstack([c[:3], c[3:4] / 0.3048, c[4:]]),
}


@pytest.mark.parametrize("text", HYPOTHESES)
def test_what_explains_the_residuals_is_found(text):
    good = noisy()
    result = orient(with_control(good, HYPOTHESES[text](good.control)))
    assert not result.usable
    (grave,) = result.grave
    assert f"probably {text}" in str(grave) or text == "mirror" in str(grave)
    assert result.problems[0].endswith("do not use these values")
    assert not any("beyond the limit" in problem for problem in result.problems)


def test_two_stations_exchanged_their_coordinates_by_themselves():
    good = noisy(kinds=(FULL,) * 8)
    control = good.control.copy()
    control[[1, 4]] = control[[1, 4]][:, [1, 0, 2]]
    result = orient(with_control(good, control))
    assert not result.usable


def test_good_models_are_not_accused():
    generator = np.random.default_rng(11)
    for _ in range(40):
        kinds = tuple(generator.choice([FULL, HORIZONTAL, HEIGHT], 9)) + (FULL,) * 3
        model = simulate(generator, kinds)
        # Errors a hundred times those of photogrammetry, so that causes are looked for.
        given = model.stations(model_error=100 * NOISE * generator.standard_normal((12, 3)))
        result = orient(given)
        assert result.rms > 1e-4 * np.std(model.exact)
        assert result.usable, result.problems


def test_control_in_a_plane_cannot_tell_a_mirror_image():
    generator = np.random.default_rng(7)
    ground = np.column_stack([generator.uniform(0, 1000, (6, 2)), np.full(6, 40.0)])
    model = 0.2 * ground + NOISE * generator.standard_normal((6, 3))
    upright = orient(Stations(range(6), ground, model))
    assert upright.usable
    assert "orientation.plane" in [message.code for message in upright.messages]
    mirrored = orient(Stations(range(6), ground, model * [1, -1, 1]))
    assert [message.code for message in mirrored.messages] == ["orientation.plane.upside-down"]
    relief = ground + np.column_stack([np.zeros((6, 2)), generator.uniform(0, 30, 6)])
    assert not orient(Stations(range(6), relief, 0.2 * relief)).problems


def test_a_model_that_is_not_that_of_its_control_is_no_orientation():
    generator = np.random.default_rng(17)
    given = Stations(range(9), generator.uniform(0, 1000, (9, 3)), generator.uniform(0, 200, (9, 3)))
    result = orient(given)
    assert result.converged
    assert not result.usable
    assert "the model does not fit its control: the residuals are" in result.problems[0]
    # Residuals as large are no fault where the control is no better.
    model = simulate(generator, (FULL,) * 12, angles=(0.1, 0.1, 1.0))
    error = 100 * generator.standard_normal((12, 3))
    assert not orient(model.stations(error)).usable
    assert orient(model.stations(error, control_sd=100.0, model_sd=NOISE)).usable


def test_no_file_is_taken_for_a_good_one(run, tmp_path):
    good = noisy()
    control = HYPOTHESES["X and Y of station 0 are exchanged"](good.control)
    lines = ["id,X,Y,Z,x,y,z"]
    for name, ground, model in zip(good.ids, control, good.model, strict=True):
        cells = ["" if np.isnan(value) else repr(float(value)) for value in ground]
        lines.append(",".join([name, *cells, *(repr(float(value)) for value in model)]))
    (tmp_path / "stations.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "points.csv").write_text("id,x,y,z\nP,1,2,3\n")
    result = run(
        *("absolute-orientation", "stations.csv", "--points", "points.csv"),
        *("--json", "result.json", "--out", "o"),
    )
    assert result.exit_code == 4
    verdict = json.loads(Path("result.json").read_bytes())["verdict"]
    assert verdict["headline"].startswith("Probably X and Y of station 0 are exchanged")
    assert "probably X and Y of station 0 are exchanged" in result.output
    assert "points were not transformed" in result.output
    assert {path.name for path in tmp_path.iterdir()} == {*("stations.csv", "points.csv", "result.json", "o")}
    document = json.loads((tmp_path / "result.json").read_text())
    assert document["usable"] is False
    assert "do not use these values" in document["messages"][0]
    assert document["points"] == []
    refused = run("absolute-orientation", "transform", "result.json", "points.csv", "out.csv")
    assert refused.exit_code == 1
    assert "adjust again: probably X and Y" in refused.output
    assert not (tmp_path / "out.csv").exists()
    with pytest.raises(InputError, check=lambda error: error.code == "orientation.unusable"):
        read_similarity(tmp_path / "result.json", usable=True)
    read_similarity(tmp_path / "result.json")  # to start from


def test_with_few_degrees_of_freedom_a_cause_is_possible_only():
    generator = np.random.default_rng(23)
    model = simulate(generator, (FULL,) * 3, angles=(0.03, -0.02, 1.0))
    ground = model.ground.copy()
    ground[0, :2] = [100.0, 130.0]
    exact = model.truth.to_model(ground) + NOISE * generator.standard_normal((3, 3))
    ground[0, :2] = [130.0, 100.0]
    result = orient(Stations(list("ABC"), ground, exact))
    assert result.degrees_of_freedom == 2
    assert result.usable
    assert result.problems[0].startswith("possibly X and Y of station A are exchanged: residuals would be ")
