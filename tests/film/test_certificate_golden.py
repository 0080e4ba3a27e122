"""Certificates of public reports, distances and distortion: figures of an independent dense program."""

import csv
import math

import numpy as np
import pytest

from golden_data import DATA, golden
from photogram.film import Certificate, Crossing, MarkDistance, RadialTable, RightAngle, adjust_distances
from photogram.film.lens_table import backward, chosen, curves_of, fit_curve, forward

PAIRS = {"lr": ("ml", "mr"), "tb": ("mt", "mb"), "llur": ("ll", "ur"), "ullr": ("ul", "lr")}


@pytest.fixture(scope="module")
def reports():
    """Return the collected reports as certificates, figures as they were typed."""
    found = {}
    with open(DATA / "film" / "certificates.csv", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            marks = [mark for pair in PAIRS.values() for mark in pair if row[f"{mark}x"] and row[f"{mark}y"]]
            typed = {f"{mark}.{axis}": row[f"{mark}{axis}"] for mark in marks for axis in "xy"}
            pairs = {f"{a}-{b}": row[f"{key}_dist"] for key, (a, b) in PAIRS.items() if row[f"{key}_dist"]}
            found[row["report"]] = Certificate(
                name=row["report"],
                camera_type=row["camera"],
                places={mark: (float(row[f"{mark}x"]), float(row[f"{mark}y"])) for mark in marks},
                distances=tuple(
                    MarkDistance(*name.split("-"), float(text), 0.002) for name, text in pairs.items()
                ),
                typed=typed | pairs,
            )
    return found


def test_the_seven_and_no_other_differ_beyond_the_limit(reports):
    wanted = {
        each["certificate"]: each
        for each in golden("film", "certificates_expected.json")["differences_beyond_the_limit"]
    }
    assert len(reports) == 38
    beyond = {name: [d for d in one.check() if d.beyond] for name, one in reports.items()}
    assert {name for name, found in beyond.items() if found} == wanted.keys()
    assert sum(bool(one.check()) for one in reports.values()) == 32
    for name, each in wanted.items():
        (found,) = beyond[name]
        assert found.name == "-".join(PAIRS[each["pair"]])
        assert found.difference == pytest.approx(each["difference"], abs=1e-4)
        assert found.from_coordinates == pytest.approx(each["from_coordinates"], abs=1e-4)
        assert reports[name].verdict.exit == 4
        assert found.name in reports[name].verdict.headline
    assert all(one.verdict.exit == 0 for name, one in reports.items() if name not in wanted and one.places)


def test_single_changes_explain_what_they_are_said_to(reports):
    for each in golden("film", "certificates_expected.json")["differences_beyond_the_limit"]:
        (found,) = (d for d in reports[each["certificate"]].check() if d.beyond)
        mine = {(one.field.replace(".", ""), one.perhaps, one.how): one for one in found.explanations}
        assert len(mine) == each["number_of_explanations"]
        for one in each["single_changes_that_explain"]:
            field = one["field"].replace(f"{each['pair']}_dist", found.name)
            own = mine[field, one["perhaps"], one["how"]]
            assert own.typed == one["typed"]
            assert own.remaining == pytest.approx(one["remaining_mm"], abs=1e-9)


def test_usual_places_decide_between_changes_of_a_kind(reports):
    report = reports["Report_RT-R_216"]
    found = next(d for d in report.check() if d.beyond)
    *_, moved = report.document().table("explanations").columns
    assert moved.values[:2] == pytest.approx([0.004, 3.018])
    assert found.explanations[0].perhaps == "-109.996"
    assert found.explanations[0].from_usual == pytest.approx(0.004)
    assert found.explanations[1].from_usual == pytest.approx(3.018)


@pytest.mark.parametrize("case", ["four_distances_and_design", "four_distances_design_angle_crossing"])
def test_too_few_distances_go_with_design_places(case):
    compare(case, golden("film", "distances.json")[case])


@pytest.mark.parametrize(
    "case", ["four_marks_six_distances_free", "eight_marks_all_distances_one_typed_wrong"]
)
def test_enough_distances_are_adjusted_freely(case):
    wanted = golden("film", "distances.json")[case]
    found = compare(case, wanted)
    assert found.free == 3
    assert np.linalg.matrix_rank(found.covariance, tol=1e-12) == 2 * len(found.names) - 3


def compare(case, wanted):
    given = wanted["given"]
    marks = tuple(wanted["marks"])
    conditions = []
    if "crossing_mm" in given:
        lines = ("ml", "mr", "mb", "mt")
        angle, sd = given["angle_ml_mr_to_mb_mt_rad"]
        place, sd_place = given["crossing_mm"]
        conditions = [RightAngle(lines, sd, angle), Crossing(lines, sd_place, tuple(place))]
    found = adjust_distances(
        marks,
        np.array([given["design"][mark] for mark in marks], float),
        [MarkDistance(*each) for each in given["distances"]],
        design_sd=np.full(len(marks), given.get("design_sd_mm", 0.02)),
        conditions=conditions,
    )
    covariance = np.array(wanted["covariance"])
    rows = wanted["rows"]
    assert np.abs(found.xy - wanted["coordinates"]).max() < 1e-9
    assert np.abs(found.covariance - covariance).max() < 1e-8 * np.abs(covariance).max()
    assert found.degrees_of_freedom == wanted["dof"]
    assert found.test.weighted_sum_of_squares == pytest.approx(wanted["omega"], rel=1e-9)
    assert found.test.probability_above == pytest.approx(wanted["p_high"], rel=1e-6)
    assert np.abs(found.redundancy - [row["redundancy"] for row in rows]).max() < 1e-8
    assert np.abs(found.residuals - [row["residual"] for row in rows]).max() < 1e-9
    w = np.array([math.nan if row["w"] is None else row["w"] for row in rows])
    assert np.allclose(found.standardized, w, rtol=0, atol=1e-6, equal_nan=True)
    return found


def test_a_distance_typed_wrong_is_located():
    wanted = golden("film", "distances.json")["eight_marks_all_distances_one_typed_wrong"]
    found = compare("", wanted)
    worst = int(np.nanargmax(np.abs(found.standardized)))
    assert found.rows[worst] == wanted["typed_wrong"]["pair"]
    error = found.residuals[worst] / found.redundancy[worst]
    assert error == pytest.approx(wanted["estimated_error_of_it_mm"], abs=1e-6)


def table(given, correlation=0.0):
    return RadialTable(
        np.radians(given["angle_deg"]),
        1e-3 * np.array(given["distortion_um"]),
        1e-3 * given["sd_um"],
        correlation,
    )


@pytest.mark.parametrize(
    ("case", "terms", "correlation"),
    [("terms_1", 1, 0), ("terms_2", 2, 0), ("terms_3", 3, 0), ("terms_2_correlated_0.3", 2, 0.3)],
)
def test_curves_and_cameras_of_a_table(case, terms, correlation):
    every = golden("film", "distortion.json")
    given, wanted = every["given"], every[case]
    c0, sd_c0 = given["calibrated_focal_length_mm"], given["sd_focal_length_mm"]
    found = fit_curve(table(given, correlation), c0, sd_c0, terms)
    alike(
        found.coefficients,
        found.covariance,
        [wanted["k0"], *wanted["odd_terms"]],
        wanted["covariance_k0_odd_terms"],
    )
    assert found.omega == pytest.approx(wanted["omega"], rel=1e-9)
    assert found.test.probability_above == pytest.approx(wanted["p_high"], rel=1e-8)
    assert np.abs(1e3 * found.residuals - wanted["residual_um"]).max() < 1e-8
    assert np.abs(found.redundancy - wanted["redundancy"]).max() < 1e-8
    radius, value, sd = np.array(wanted["curve_um_at"]).T
    assert np.abs(1e3 * found.at(radius) - value).max() < 1e-8
    assert np.abs(1e3 * found.sd_at(radius) - sd).max() < 1e-8
    camera = forward(found)
    sign = np.diag([-1.0, *np.ones(terms)])
    alike(
        camera.values,
        sign @ camera.covariance @ sign,
        list(wanted["camera"].values()),
        wanted["covariance_camera_abs_c_A"],
    )


def alike(values, covariance, wanted, cofactors):
    sd = np.sqrt(np.diag(cofactors))
    assert (np.abs(np.array(values) - wanted) < 1e-7 * sd).all()
    assert (np.abs(np.array(covariance) - cofactors) < 1e-8 * np.outer(sd, sd)).all()


def test_the_choice_of_terms_and_the_mapping():
    every = golden("film", "distortion.json")
    given, choice = every["given"], every["choice"]
    curves = curves_of(table(given), given["calibrated_focal_length_mm"], given["sd_focal_length_mm"])
    assert [each.omega for each in curves] == pytest.approx(choice["omega"], rel=1e-9)
    own = chosen(curves)
    assert own.terms == 2
    certificate = Certificate(c=own.focal_length, radial=table(given))
    u = np.column_stack([own.radius / own.focal_length, 0 * own.radius, -np.ones(len(own.radius))])
    image = certificate.camera().project(u)[:, 0]
    assert np.abs(image - own.radius - own.at(own.radius)).max() < 1e-12
    at = np.array([[100 / own.focal_length, 0.0, -1.0]])
    assert certificate.camera().project(at)[0, 0] == pytest.approx(
        every["check_camera_reproduces_table"][0], abs=1e-10
    )
    back = certificate.camera("brown").project(u)[:, 0]
    assert np.abs(back - image).max() < 2 * backward(own).apart < 1e-5
