"""Figures by standard: ASPRS, NSSDA, VDI/VDE 2634, ISO 19157: golden figures, examples, verdicts."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from golden_statement import cofactors, control, differences, golden
from hypothesis import given
from hypothesis import strategies as st

import photogram
from message_codes import nested_codes
from photogram import InputError
from photogram.results.statement import standards
from photogram.results.statement.figures import Figures
from photogram.results.statement.request import Asked
from photogram.results.statement.standards import (
    accuracy,
    angle_to_diagonal,
    at_reference,
    length_test,
    measured_lengths,
    nssda,
    verdict,
)
from photogram.show.forms import written
from photogram.statistics import effective_freedom


def root_mean_square(rows):
    """Return the root of the mean square length of rows."""
    return math.sqrt(np.mean(np.sum(np.square(rows), axis=1)))


def without_survey(found, survey):
    """Return the figure of the product alone."""
    return Figures.without_survey(SimpleNamespace(rmse={"rmse_h1": found, "rmse_h2": survey}), "h")


@pytest.fixture(scope="module")
def figures():
    """Return horizontal, vertical and 3D figures of the golden block."""
    d, sd = differences(), control()["check"][2]
    joint = cofactors() + np.diag(sd.ravel() ** 2)
    found = []
    for components in ([0, 1], [2]):
        rows = (3 * np.arange(30)[:, np.newaxis] + components).ravel()
        freedom = effective_freedom(joint[np.ix_(rows, rows)])
        own = root_mean_square(d[:, components]), root_mean_square(sd[:, components])
        found.append(accuracy(*own, freedom, 30))
    both = (math.hypot(*(getattr(each, name) for each in found)) for name in ("found", "survey"))
    return (*found, accuracy(*both, effective_freedom(joint), 30))


def test_figures_of_the_asprs_are_those_of_the_golden_statement(figures):
    horizontal, vertical, space = figures
    expected, verdicts = golden("statement.json")["statement_unity"], golden("statement.json")["asprs"]
    for figure, axis in ((horizontal, "h"), (vertical, "v")):
        assert figure.found == pytest.approx(expected[f"rmse_{axis}1"], rel=1e-6)
        assert figure.survey == pytest.approx(expected[f"rmse_{axis}2"], rel=1e-6)
        assert figure.rmse == pytest.approx(expected[f"rmse_{axis}"], rel=1e-6)
        product = without_survey(figure.found, figure.survey)
        assert product == pytest.approx(expected["without_survey"][axis], rel=1e-6)
        assert figure.upper == pytest.approx(verdicts[f"upper_{axis}"], rel=1e-6)
    assert verdict(horizontal, 0.05) == verdicts["horizontal"]
    assert verdict(vertical, 0.05) == verdicts["vertical"]
    assert space.rmse == pytest.approx(expected["rmse_3d"], rel=1e-6)
    low, high = expected["prediction"]["all"]["rmse_interval_95"]
    assert low < space.found < high
    assert space.upper == pytest.approx(math.hypot(high, space.survey), rel=1e-6)


def test_points_asked_for_by_area_are_those_of_the_golden_statement():
    for area, count in golden("statement.json")["asprs"]["points_asked_for"].items():
        assert standards.points_asked_for(float(area.removesuffix(" km2"))) == count
    assert standards.points_asked_for(0.0) == standards.points_asked_for(1000.0) == 30
    assert (standards.points_asked_for(1000.1), standards.points_asked_for(9000.0)) == (40, 110)
    assert standards.points_asked_for(9000.1) == standards.points_asked_for(1e9) == 120


def test_the_survey_is_added_as_in_table_7_4_of_the_standard():
    assert accuracy(1.00, 2.0, 30, 30).rmse == pytest.approx(2.24, abs=0.005)
    assert accuracy(10.00, 2.0, 30, 30).rmse == pytest.approx(10.20, abs=0.005)


def test_a_product_below_the_accuracy_of_the_survey_has_no_figure_of_its_own():
    assert math.isnan(without_survey(0.01, 0.02))
    assert without_survey(0.05, 0.03) == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("limit", "with_thirty", "with_fewer"),
    [
        (0.050, "missed", "missed"),
        (0.051, "met", "not decided"),
        (0.065, "met", "not decided"),
        (0.070, "met with confidence", "produced to meet"),
    ],
)
def test_a_verdict_says_how_sure_a_class_is_met(limit, with_thirty, with_fewer):
    # RMSE 5.0 cm with the survey's 1 cm; the upper end with 30 degrees of freedom is 6.6 cm.
    found = math.sqrt(0.0501**2 - 0.01**2)
    assert accuracy(found, 0.01, 30, 30).upper == pytest.approx(0.0664, abs=5e-5)
    assert verdict(accuracy(found, 0.01, 30, 30), limit) == with_thirty
    assert verdict(accuracy(found, 0.01, 30, 29), limit) == with_fewer


def test_the_words_follow_the_number_of_check_points():
    assert [standards.wording(count) for count in (0, 1, 29, 30, 120)] == [
        "none",
        "produced",
        "produced",
        "tested",
        "tested",
    ]


SENTENCES = {
    "missed": "asprs.missed",
    "met": "asprs.tested",
    "met with confidence": "asprs.tested",
    "produced to meet": "asprs.produced",
    "not decided": "asprs.undecided",
    "not tested": "asprs.none",
}


@pytest.mark.parametrize("count", [0, 1, 18, 29, 30])
def test_page_and_document_have_one_verdict_for_each_class(result, count):
    block, names = result.block, [f"C{k:02}" for k in range(1, 31)]
    positions = block.point_positions.copy()
    positions[[block.point_ids.index(name) for name in names[count:]]] = np.nan
    fewer = photogram.adjust(block.replace(point_positions=positions), unit_variance="unity")
    seen = set()
    for size in (0.02, 0.035, 0.042, 0.047, 0.055, 0.1, 1.0):
        found = fewer.statement(classes=dict.fromkeys(("h", "v", "3d"), size), budgets=())
        member = json.loads(found.to_json())["asprs"]
        verdicts = {"h": member["horizontal"], "v": member["vertical"], "3d": member["three_d"]}
        keys = {each["key"] for each in found.sentences if each["key"].startswith("asprs.")}
        # Without check points the standard has no sentence for three dimensions.
        assert keys == {
            f"{SENTENCES[verdict]}.{name}" for name, verdict in verdicts.items() if count or name != "3d"
        }
        (section,) = [each for each in found.document().sections if each.key == "figures"]
        cells = {column.head: column.cells for column in written(section.parts[0]).columns} if count else {}
        names, verdicts_of = (
            cells.get(found.texts(f"column.{each}"), []) for each in ("component", "verdict")
        )
        shown = {name: each for name, each in zip(names, verdicts_of, strict=False) if each}
        of_page = {"plan": "h", "h": "v", "all": "3d"}
        assert shown == {
            found.texts(f"component.{part}"): found.texts(f"asprs.verdict.{verdicts[name]}")
            for part, name in of_page.items()
            if count
        }
        assert (found.exit == 4) == ("missed" in verdicts.values() or fewer.verdict.warning)
        assert ("not decided" in verdicts.values()) <= (found.headline != found.texts("headline.met"))
        seen |= set(verdicts.values())
    assert len(seen) >= (3 if count else 1)


def test_control_is_to_be_twice_as_accurate_as_the_class():
    # In height the horizontal class holds, unless heights are a product.
    assert standards.control_limits({"h": 0.05}) == {"h": 0.025, "v": 0.05}
    assert standards.control_limits({"h": 0.05, "v": 0.20}) == {"h": 0.025, "v": 0.10}
    assert standards.control_limits({"v": 0.20}) == {}


def test_means_and_differences_beyond_the_class_are_remarks():
    axis = 0.10 / math.sqrt(2)
    d = np.zeros((4, 3))
    d[:, 0] = 0.26 * axis
    d[2, 1] = -3.01 * axis
    d[:, 2] = [0.299, -0.299, math.nan, 0.0]
    found = standards.remarks(d, 0.10, 0.10)
    assert [(each.kind, each.component, each.point) for each in found] == [
        ("mean", "e", None),
        ("mean", "n", None),
        ("difference", "n", 2),
    ]
    assert found[0].value == pytest.approx(0.26 * axis)
    assert found[0].limit == pytest.approx(0.25 * axis)
    assert found[2].limit == pytest.approx(3 * axis)
    assert standards.remarks(d, 0.10) == found
    assert standards.remarks(d) == ()
    (height,) = standards.remarks(np.array([[math.nan, math.nan, 0.031], [0.0, 0.0, 0.03]]), class_v=0.10)
    assert (height.kind, height.component) == ("mean", "h")


def test_nssda_has_the_golden_figures():
    for row in golden("circles.json")["nssda"]:
        x, y = row["rmse_x"], row["rmse_y"]
        found = nssda(np.diag([x**2, y**2]), math.nan, 20)
        if row["accuracy_r"] is None:
            assert found.accuracy_r_unequal is None
        else:
            assert found.accuracy_r_unequal == pytest.approx(row["accuracy_r"], rel=1e-9)
        if "accuracy_r_from_radial" in row:
            assert found.accuracy_r_equal == pytest.approx(row["accuracy_r_from_radial"], rel=1e-9)
        else:
            assert found.ratio == pytest.approx(row["ratio"], rel=1e-9)
            assert found.ce95 == pytest.approx(row["exact_ce95_from_matrix"], rel=1e-8)
        assert found.accuracy_z is None


@pytest.mark.parametrize("which", ["statement_unity", "statement_free"])
def test_nssda_of_the_golden_block_is_that_of_the_golden_statement(which):
    d, expected = differences(), golden("statement.json")[which]["nssda"]
    found = nssda(d[:, :2].T @ d[:, :2] / 30, root_mean_square(d[:, 2:]), 30)
    assert found.ratio == pytest.approx(expected["ratio"], rel=1e-6)
    assert found.accuracy_r_equal == pytest.approx(expected["accuracy_r_equal"], rel=1e-6)
    assert found.accuracy_r_unequal == pytest.approx(expected["accuracy_r_unequal"], rel=1e-6)
    assert found.accuracy_z == pytest.approx(expected["accuracy_z"], rel=1e-6)


NOTHING = np.full((2, 2), math.nan)


def test_nssda_asks_for_twenty_points_and_compiles_without():
    assert nssda(NOTHING, 0.1, 19).enough is False
    assert nssda(NOTHING, 0.1, 20).enough is True
    assert nssda(NOTHING, 0.1, 20).wording == "tested"
    assert nssda(NOTHING, math.nan, 0).wording == "compiled"
    assert nssda(np.zeros((2, 2)), 0.0, 3).accuracy_r_unequal == 0.0


@pytest.fixture(scope="module")
def bar():
    """Return the golden lengths, measured and calibrated, in millimetres."""
    return golden("circles.json")["lengths"]


def of_bar(bar, **changed):
    """Return the test of the golden lengths."""
    rows = bar["lengths"]
    limit = bar["limit"]
    given_ = {
        "covariance": np.diag([row["sd_measured_mm"] ** 2 for row in rows]),
        "sd": np.array([row["sd_calibrated_mm"] for row in rows]),
        "lines": [row["line"] for row in rows],
        "limit": (limit["A_mm"], limit["K"], limit["B_mm"]),
    }
    measured, calibrated = (
        np.array([row[f"{name}_mm"] for row in rows]) for name in ("measured", "calibrated")
    )
    return length_test(measured, calibrated, **(given_ | changed))


def test_golden_lengths_have_their_errors_and_limits(bar):
    found, rows = of_bar(bar), bar["lengths"]
    assert found.errors == pytest.approx([row["error_mm"] for row in rows], abs=1e-9)
    assert found.limits == pytest.approx([row["limit_mm"] for row in rows], rel=1e-9)
    assert found.normalised == pytest.approx([row["normalised"] for row in rows], rel=1e-6, abs=1e-9)
    assert found.within.tolist() == [row["within"] for row in rows]
    assert found.within.sum() == bar["within"]
    assert found.met is bar["passed"] is False
    assert found.largest == pytest.approx(bar["largest"], rel=1e-6)
    assert found.rms == pytest.approx(bar["rms"], rel=1e-6)
    assert (found.lines, found.least, found.enough) == (bar["lines"], bar["per_line"], True)
    assert found.together.degrees_of_freedom == 35
    omega = np.sum(np.square([row["normalised"] for row in rows]))
    assert found.together.weighted_sum_of_squares == pytest.approx(omega, rel=1e-6)
    assert found.together.rejected_high


def test_too_few_lines_and_short_ones_are_said(bar):
    assert of_bar(bar, lines=["one"] * 35).enough is False
    assert of_bar(bar, lines=[*range(5)] * 7).enough is False
    assert of_bar(bar, diagonal=4000.0).long_enough is True
    assert of_bar(bar, diagonal=5000.0).long_enough is False
    assert of_bar(bar).long_enough is True  # not known
    assert of_bar(bar, limit=None).met is None
    assert of_bar(bar, limit=None).within is None


def test_errors_of_lengths_from_one_point_are_correlated():
    rng = np.random.default_rng(5)
    positions = rng.normal(size=(4, 3))
    root = 1e-4 * rng.normal(size=(12, 12))
    joint = root @ root.T
    pairs = np.array([[0, 1], [0, 2], [2, 3]])
    lengths, covariance = measured_lengths(positions, joint, pairs)
    drawn = positions.ravel() + rng.normal(size=(100_000, 12)) @ root.T
    places = drawn.reshape(-1, 4, 3)
    found = np.stack([np.linalg.norm(places[:, a] - places[:, b], axis=1) for a, b in pairs], axis=1)
    assert lengths == pytest.approx(found.mean(axis=0), rel=1e-5)
    scale = np.sqrt(np.diag(covariance))
    assert np.cov(found.T) / np.outer(scale, scale) == pytest.approx(
        covariance / np.outer(scale, scale), abs=0.02
    )
    known = lengths + rng.normal(size=3) @ np.linalg.cholesky(covariance).T
    test = length_test(lengths, known, covariance=covariance, sd=np.zeros(3), lines=["a", "a", "b"])
    e = lengths - known
    assert test.together.weighted_sum_of_squares == pytest.approx(
        e @ np.linalg.solve(covariance, e), rel=1e-6
    )


def test_lengths_without_any_error_have_no_normalised_ones():
    measured, calibrated, sd = np.array([1.0, 2.0]), np.array([1.0, 2.1]), np.array([0.0, 0.1])
    found = length_test(measured, calibrated, covariance=np.zeros((2, 2)), sd=sd, lines=["a", "a"])
    assert found.normalised == pytest.approx([math.nan, -1.0], nan_ok=True)
    assert found.together.degrees_of_freedom == 1


def test_a_warm_bar_is_longer_than_at_the_reference():
    found = at_reference(np.array([1000.0115, 1000.0]), np.array([21.0, 20.0]), 11.5e-6)
    assert found == pytest.approx([1000.0, 1000.0], rel=1e-12)


@given(st.floats(-40, 60), st.floats(0, 3e-5))
def test_a_bar_without_expansion_or_at_the_reference_keeps_its_length(temperature, expansion):
    assert at_reference(np.array([2.0]), np.array([temperature]), 0.0)[0] == 2.0
    assert at_reference(np.array([2.0]), np.array([20.0]), expansion)[0] == 2.0


def test_figures_have_the_numbers_of_the_measures_of_iso_19157(result):
    statement = result.statement(standards=["iso-19157"], date="2026-01-31", budgets=())
    found = json.loads(statement.to_json())["iso_19157"]
    assert [each["measure_id"] for each in found] == [128, 39, 47, 44, 45, 35, 36, 50]
    assert found[1]["value"] == pytest.approx(statement.of_all.parts["all"].rmse)
    assert {each["date"] for each in found} == {"2026-01-31"}
    assert set(found[0]) == {
        "element", "measure", "measure_id", "value", "unit", "evaluation", "date", "scope",
    }  # fmt: skip
    assert found[0]["element"] == standards.ABSOLUTE
    assert {each["evaluation"] for each in found} == {"direct external"}


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: measured_lengths(np.zeros((2, 3)), np.eye(6), np.array([[0, 1]])),
            "request.identical-positions",
        ),
        (lambda: at_reference(np.array([1.0]), np.array([-1e6]), 1e-5), "request.expansion"),
        (lambda: Asked.checked(lengths=[OF_BAR | {"length": -1.0}]), "error.not-negative"),
        (lambda: Asked.checked(lengths=[OF_BAR | {"sd": -0.1}]), "error.not-negative"),
        (lambda: Asked.checked(classes={"h": 0.0}), "error.positive"),
    ],
)
def test_lengths_and_classes_that_are_no_size_are_refused(call, said):
    with pytest.raises(InputError) as error:
        call()
    assert said in nested_codes(error.value)


OF_BAR = {"line": "a", "from": "1", "to": "2", "length": 1.0, "sd": 0.1}


def test_a_line_runs_along_one_of_the_four_diagonals_of_the_volume():
    extent = np.array([300.0, 200.0, 100.0])
    for signs in ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)):
        assert angle_to_diagonal(np.multiply(extent, signs)[np.newaxis] / 5, extent) == pytest.approx(
            0.0, abs=1e-7
        )
    edges = 250 * np.eye(3)
    assert angle_to_diagonal(edges, extent) == pytest.approx(math.acos(3 / math.sqrt(14)))
    assert angle_to_diagonal(np.vstack([edges, extent]), extent) == pytest.approx(0.0, abs=1e-7)


def test_volumes_whose_diagonals_have_no_line_get_a_remark(result):
    places = dict(zip(result.block.point_ids, result.point_positions, strict=True))

    def stated(first, last, language="en"):
        length = float(np.linalg.norm(places[first] - places[last]))
        own = {"line": "a", "from": first, "to": last, "length": length, "sd": 0.001}
        asked = {"standards": ("vdi-2634",), "lengths": [own], "budgets": (), "language": language}
        return result.statement(**asked)

    along, across = stated("G01", "G08"), stated("G04", "G05")
    assert math.degrees(along.standards.lengths.off_diagonal) < 15.0
    said = "No line runs along a diagonal of the measured volume: the nearest is"
    assert not any(each.startswith(said) for each in along.judged.remarks)
    assert any(each.startswith(said) for each in across.judged.remarks)
    assert any("entlang einer Raumdiagonale" in each for each in stated("G04", "G05", "de").judged.remarks)
    document = json.loads(across.to_json())["lengths"]
    assert document["angle_to_diagonal"] > math.radians(15.0)
    assert document["arrangement"] is False
    assert across.exit == 0
