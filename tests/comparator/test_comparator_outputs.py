"""Averages, analysis of variance, tests, joint adjustment, correction, listing, document, pictures."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from plates import PRINTED, QUICK, STRAIGHT, bent, case_2, case_2_session, noisy, printed_correction

from message_codes import coded, described
from photogram import AdjustmentError, InputError
from photogram.comparator import Correction, Grid, Options, calibrate, listing, simulate_calibration
from photogram.comparator.averages import listed_grid_sigma, text_grid_sigma
from photogram.comparator.case import exchanged
from photogram.comparator.correction import partials_of
from photogram.comparator.fits import rotation_matrix
from photogram.comparator.joint import adjust_jointly
from photogram.comparator.listing import correction_table, table_nodes
from photogram.comparator.tables import LINEAR
from photogram.comparator.variance import AxisSigma, _f_max_tail, compare_case_variances, difference
from photogram.show.sketch.marks import Ellipses
from photogram.words import phrase


@pytest.fixture(scope="module")
def full():
    """Return a left-handed calibration of eight cases by two operators."""
    session = noisy(
        42, cases=8, operators=[18, 21], left_handed=True, correction=printed_correction(), least_count_um=1.0
    )
    return calibrate(session)


# 18: correction table and plots


def test_feature_18_the_table_of_the_listing():
    rows = table_nodes(125_000.0)
    assert [len(row) for row in rows] == [9, 5, 9, 5, 9, 5, 9, 5, 9]
    assert rows[0][0].tolist() == [225_000.0, 225_000.0]
    assert rows[-1][-1].tolist() == [25_000.0, 25_000.0]
    values = [printed_correction().polynomial.evaluate(row) for row in rows]
    assert values[1][0] == pytest.approx(printed_correction().polynomial.evaluate(rows[1][:1])[0])


def test_feature_18_nodes_belong_to_the_comparator_not_to_the_measurement(full):
    """Two calibrations of one comparator, years apart, have the same nodes, wherever the plate lay."""
    session = noisy(31, correction=bent(), centre_um=(119_000.0, 131_000.0))
    pages = [correction_table(calibration) for calibration in (full, calibrate(session, QUICK))]
    heads = [[line[:11] for line in page if line.startswith(("X=", "Y="))] for page in pages]
    assert heads[0] == heads[1]
    assert heads[0][0] == "X= 0.2250 M"
    assert pages[0][-1] == "UPPER NUMBER IN X, LOWER NUMBER IN Y"


@pytest.mark.parametrize(
    ("fields", "centre_um"),
    [
        ({"comparator": 3}, 125_000.0),
        ({"comparator": 10}, 1_000_000.0),
        ({"comparator": 11}, 1_000_000.0),
        ({"comparator": 11, "least_count_one_micrometre": False}, 1_500_000.0),
        ({"comparator": 12}, 300_000.0),
        ({"comparator": 5, "secondary": True}, 1_000_000.0),
        ({"comparator": 99}, 125_000.0),
        ({"comparator": 3, "range_centre_um": 80_000.0}, 80_000.0),
    ],
)
def test_feature_18_the_middle_of_the_range(fields, centre_um):
    assert replace(noisy(1), **fields).centre_um == centre_um


def test_feature_18_nodes_beyond_the_measurement_are_marked():
    calibration = calibrate(replace(noisy(31, correction=bent()), range_centre_um=160_000.0), QUICK)
    page = correction_table(calibration)
    assert page[-1] == "* OUTSIDE THE RANGE MEASURED"
    first = next(line for line in page if line.startswith("X= 0.2600"))
    assert first.count("*") == 9
    low = next(line for line in page if line.startswith("X= 0.0600"))
    assert "*" in low[:30]
    assert "*" not in low[30:]


def test_feature_18_the_net_is_drawn_at_fixed_nodes_and_10_000_times():
    from photogram.comparator.pictures import distorted_grid

    calibration = calibrate(noisy(30, correction=bent()), QUICK)
    polynomial = calibration.nonlinear.polynomial
    (panel,) = distorted_grid(calibration, polynomial).panels
    nodes, *lines = panel.marks
    assert len(lines) == 10
    steps = np.array([75.0, 125.0, 175.0, 225.0, 25.0])
    assert set(np.round(nodes.places[:, 0], 9)) == set(steps)
    corner = polynomial.evaluate(np.array([[25_000.0, 25_000.0]]))[0]
    assert lines[0].places[0] == pytest.approx(25.0 + 10.0 * corner, abs=1e-9)


def test_feature_18_every_case_has_its_table_and_pictures_where_they_are_wanted(full):
    from photogram.comparator.pictures import sketches

    session = replace(noisy(30, correction=bent()), plot_each_case=True)
    calibration = calibrate(session, QUICK)
    names = sketches(calibration)
    for case in range(1, 5):
        assert {f"correction-case-{case}", f"distorted-grid-case-{case}"} <= set(names)
        assert f"NONLINEAR CORRECTIONS, CASE NUMBER {case} (MICRONS)" in listing(calibration)
    assert "NONLINEAR CORRECTIONS, CASE" not in listing(full)


def _widths(panel):
    """Return the major semi-axes of each of the groups of ellipses on a panel."""
    return [mark.semi_axes[:, 0] for mark in panel.marks if isinstance(mark, Ellipses)]


def test_feature_09_ellipses_of_operators_and_of_all_at_four_levels(full):
    from photogram.comparator.pictures import grid_ellipses, sketches

    made = sketches(full)
    operators = list(full.pointing.operators)
    assert len(operators) == 2
    assert all(f"pointing-ellipses-operator-{operator}" in made for operator in operators)
    levels = [1.00, 1.18, 2.45, 3.03]
    widths = _widths(grid_ellipses(full).panels[0])
    assert [own[0] / widths[0][0] for own in widths] == pytest.approx(levels)
    points = list(full.pointing.points)
    expected = [full.pointing.points[point].ellipse.major_um for point in points]
    assert widths[0] / widths[0][0] == pytest.approx(np.array(expected) / expected[0])
    panels = made["pooled-ellipses"].panels
    assert [panel.title.split(":")[0] for panel in panels] == [
        *(f"case {case.number}" for case in full.cases),
        *(f"operator {operator}" for operator in operators),
        "all",
    ]
    for panel in panels:
        sizes = [float(own[0]) for own in _widths(panel)]
        assert [size / sizes[0] for size in sizes] == pytest.approx(levels)


def test_feature_18_pictures(full):
    pytest.importorskip("matplotlib")
    from photogram.comparator.pictures import sketches

    made = sketches(full)
    assert {
        "variance",
        "comparator-residuals",
        "grid-residuals",
        "average-residuals-1",
        "grid-corrections-1",
        "correction",
        "distorted-grid",
        "pointing-ellipses",
        "pointing-ellipses-operator-18",
        "pointing-ellipses-operator-21",
        "pointing-ellipses-total",
        "pooled-ellipses",
        "residual-histogram",
    } == set(made)
    drawn = made["comparator-residuals"].panels[0].marks[1].vectors
    residuals = full.last_fits[0].residuals.comparator_um
    scale = drawn[0] / residuals[0]
    assert drawn == pytest.approx(residuals * scale[0], rel=1e-9)
    widths = _widths(made["pointing-ellipses"].panels[0])[0]
    expected = [readings.precision.ellipse.major_um for readings in full.cases[0].placed.readings]
    assert widths / widths[0] == pytest.approx(np.array(expected) / expected[0])
    page = full.to_html().decode()
    assert page.count("<figure") == len(made)
    assert "Systematic comparator, linear" in page
    assert "SYSTEMATIC COMPARATOR" not in page


def test_the_document_has_each_table_once(full):
    document, written = full.document(), json.loads(full.to_json())
    correction, covariance = full.linear.correction, full.linear.covariance
    _, values, sd, _ = document.table("linear").columns
    assert values.values[[0, 1, 3]] == pytest.approx([written["linear"][name] for name in LINEAR], rel=1e-15)
    assert sd.values[[0, 1, 3]] == pytest.approx(np.sqrt(np.diag(covariance))[:3])
    ratio = correction.scale_x / correction.scale_y
    assert values.values[2] == ratio
    totals = document.table("variance").columns[1].values[:, 2]
    assert totals[0] == full.variance.before.total
    assert totals[-1] == full.variance.random
    terms = written["polynomial"]["terms"]
    assert len(terms) == len(document.table("polynomial.terms").columns[0].values) == 12
    assert [case["case"] for case in written["cases"]] == [case.number for case in full.cases]
    assert written["far_pointings"] == [
        {name: getattr(each, name) for name in each.__dataclass_fields__} for each in full.far_pointings
    ]
    assert "Linear parameters" in full.report()


# 19: averages


def test_feature_19_averages_by_point_and_by_location(full):
    averages = full.plates[1].averages
    own = [
        fit.residuals.grid_um[case.placed.points.tolist().index(9)]
        for case, fit in zip(full.cases, full.last_fits, strict=True)
    ]
    assert averages.grid_um[8] == pytest.approx(np.mean(own, axis=0))
    assert averages.corrections_um[8] == pytest.approx(np.mean(own, axis=0)[::-1])
    # Location 1 is the corner nearest the comparator's zero, whatever point lies there.
    corner = [
        fit.residuals.comparator_um[case.placed.points.tolist().index(case.placed.orientation.nearest_point)]
        for case, fit in zip(full.cases, full.last_fits, strict=True)
    ]
    assert averages.location_um[0] == pytest.approx(np.mean(corner, axis=0))
    assert averages.counts.tolist() == [8] * 25
    assert np.abs(averages.grid_um.sum(axis=0)).max() < 1e-6


def test_feature_19_locations_show_what_belongs_to_the_comparator():
    """Averages by location see a fault of the comparator that turns with no plate."""
    simulation = simulate_calibration(Grid.square(), STRAIGHT)
    cases = []
    for case in simulation.session.cases:
        bump = np.exp(-((np.hypot(*(case.xy_um - [75_000, 130_000]).T) / 30_000) ** 2))
        cases.append(replace(case, xy_um=case.xy_um + np.column_stack([3 * bump, 0 * bump])))
    calibration = calibrate(
        replace(simulation.session, cases=tuple(cases)), Options(joint=False, polynomial=False)
    )
    averages = calibration.plates[1].averages
    assert np.abs(averages.location_um).max() > 2.0
    assert np.abs(averages.location_um).max() > 2.5 * np.abs(averages.grid_um).max()


def test_feature_19_places_far_apart_are_not_one_location():
    """Two sets in the two halves of a long comparator: location 1 of one is 195 mm from that of the other."""
    session = noisy(3)
    far = noisy(4, centre_um=(320_000.0, 130_000.0), grid=session.grids[1])
    cases = (*session.cases, *(replace(case, number=case.number + 4) for case in far.cases))
    calibration = calibrate(replace(session, cases=cases), Options(joint=False, polynomial=False))
    near, away = calibration.plates[1].averages.by_location
    assert (near.cases, away.cases) == ((1, 2, 3, 4), (5, 6, 7, 8))
    assert away.xy_um - near.xy_um == pytest.approx(np.tile([195_000.0, 0.0], (25, 1)), abs=20.0)
    for place, own in ((near, calibration.last_fits[:4]), (away, calibration.last_fits[4:])):
        corner = [
            fit.residuals.comparator_um[
                case.placed.points.tolist().index(case.placed.orientation.nearest_point)
            ]
            for case, fit in zip(
                [case for case in calibration.cases if case.number in place.cases], own, strict=True
            )
        ]
        assert place.residuals_um[0] == pytest.approx(np.mean(corner, axis=0))
    page = listing(calibration)
    assert "THE PLATE LAY AT ANOTHER PLACE IN CASES 5 6 7 8: THEIR LOCATIONS ARE AVERAGED APART" in page
    assert "  N = 50 LOCATIONS, 25 POINTS" in page
    assert calibration.plates[1].listed.mean_comparator_um == pytest.approx(
        math.sqrt(float((calibration.plates[1].averages.location_um ** 2).sum()) / 99)
    )


def test_feature_19_a_plate_turned_by_another_angle_lies_elsewhere():
    session, turned = noisy(3), noisy(4, rotation_rad=0.6)
    cases = (*session.cases, *(replace(case, number=case.number + 4) for case in turned.cases))
    calibration = calibrate(replace(session, cases=cases), Options(joint=False, polynomial=False))
    assert [place.cases for place in calibration.plates[1].averages.by_location] == [
        (1, 2, 3, 4),
        (5, 6, 7, 8),
    ]


# 20: grid calibration


def test_feature_20_equation_65_is_64_for_equal_numbers(full):
    averages = full.plates[1].averages
    points, cases = 25, 8
    between = float((averages.grid_um**2).sum()) / 2
    within = float(averages.squares_um2.sum()) / 2 - cases * between
    by_65 = between / (points - 1) - within / (points * cases * (cases - 1))
    assert text_grid_sigma(averages) == pytest.approx(math.sqrt(max(0.0, by_65)))
    listed = listed_grid_sigma(averages)
    assert listed.grid_um < full.plates[1].unbiased_um
    assert full.sigma_grid_um(1) == full.plates[1].unbiased_um


def test_feature_20_one_case_gives_no_grid_sigma():
    plate = case_2().plates[1320]
    assert plate.listed.grid_um == 0.0
    assert math.isnan(plate.text_um)
    assert math.isnan(plate.unbiased_um)
    assert any("GRID CALIBRATION CORRECTIONS ARE VALID ONLY" in str(m) for m in case_2().messages)


# 21: analysis of variance


def test_feature_21_components_add_up(full):
    parts = full.variance.components_um
    total = sum(parts[name] ** 2 for name in ("linear", "nonlinear", "grid", "pointing", "random"))
    assert math.sqrt(total) == pytest.approx(parts["total"])
    assert parts["grid"] == 0.3
    assert parts["linear"] == pytest.approx(2.2, abs=0.4)
    before = [case.free.residuals for case in full.cases]
    x = math.sqrt(sum(own.squares_um2[0] for own in before) / (8 * 23.5))
    assert full.variance.before.x == pytest.approx(x)
    squares = sum(sum(fit.residuals.squares_um2[:2]) for fit in full.linear.cases)
    after = math.sqrt(squares / full.linear.degrees_of_freedom)
    assert full.variance.after_linear.total == pytest.approx(after)


def test_feature_21_negative_differences_are_said():
    assert difference(1.0, 2.0) == (0.0, True)
    calibration = calibrate(noisy(1, grid=Grid.square(sigma_um=5.0)), QUICK)
    assert calibration.variance.negative == ("random",)
    assert calibration.variance.random == 0.0
    assert "comparators.negative name=random" in map(described, calibration.messages)


def test_feature_21_nanometres_of_the_listing():
    assert AxisSigma(0.9347, 1.2559).truncated() == AxisSigma(0.934, 1.255)
    session = noisy(21, correction=bent())
    exact, cut = (
        calibrate(session, Options(joint=False, as_published=way)).variance for way in (False, True)
    )
    assert cut.after_linear.x == math.floor(1000 * exact.after_linear.x) / 1000
    assert cut.after_linear.y == math.floor(1000 * exact.after_linear.y) / 1000
    # The listing still has the sigmas after the nonlinear fit: only SIGX and SIGY come back from its cards.
    assert cut.after_nonlinear.total == pytest.approx(exact.after_nonlinear.total)
    assert (cut.random, False) == difference(cut.after_nonlinear.total, cut.grid, cut.pointing.total)
    assert cut.nonlinear == pytest.approx(exact.nonlinear, abs=2e-3)
    assert cut.nonlinear != exact.nonlinear


def test_feature_21_a_grid_without_known_accuracy_is_computed():
    calibration = calibrate(noisy(3, grid=Grid.square()), QUICK)
    assert calibration.variance.grid == pytest.approx(calibration.sigma_grid_um(1))
    listed = calibrate(noisy(3, grid=Grid.square()), replace(QUICK, as_published=True))
    assert listed.variance.grid == pytest.approx(listed.plates[1].listed.grid_um)


# 22: export and correction


@pytest.mark.parametrize("correction", [STRAIGHT, bent(), printed_correction()])
def test_feature_22_apply_and_invert(correction):
    rng = np.random.default_rng(22)
    xy = rng.uniform(-50_000, 300_000, (200, 2))
    assert correction.invert(correction.apply(xy)) == pytest.approx(xy, abs=1e-8)
    s, c = math.sin(correction.nonorthogonality_rad), math.cos(correction.nonorthogonality_rad)
    x, y = xy.T
    expected = np.column_stack(
        [correction.scale_x * x + correction.scale_y * s * y, correction.scale_y * c * y]
    )
    assert correction.linear(xy) == pytest.approx(expected, abs=1e-9)


def test_feature_22_far_outside_there_is_no_inverse():
    with pytest.raises(InputError, match="must be near the calibrated range"):
        bent().invert(np.array([[3e8, -5e8]]))


def test_feature_22_covariance_of_corrected_coordinates_by_complex_steps():
    """Partials by every parameter and by the reading."""
    correction = replace(bent(), covariance=np.eye(21))
    polynomial = correction.polynomial
    xy = np.array([[60_000.0, 180_000.0]])
    by_parameters, by_reading = partials_of(correction, xy)

    def corrected(parameters, reading):
        sx, sy, lean = parameters[:3]
        x, y = sx * reading[0] + sy * np.sin(lean) * reading[1], sy * np.cos(lean) * reading[1]
        u, v = x / 1e6, y / 1e6
        basis = np.array([u**4, v**4, u**3, v**3, u**2, v**2, u, v, 1.0])
        return np.array([x + basis @ parameters[3:12], y + basis @ parameters[12:]])

    values = np.concatenate(
        [
            [correction.scale_x, correction.scale_y, correction.nonorthogonality_rad],
            polynomial.scaled_um.ravel(),
        ]
    )
    for k in range(21):
        stepped = values.astype(complex)
        stepped[k] += 1e-30j
        derivative = corrected(stepped, xy[0].astype(complex)).imag / 1e-30
        assert by_parameters[0, :, k] == pytest.approx(derivative, rel=1e-10, abs=1e-12)
    for k in range(2):
        reading = xy[0].astype(complex)
        reading[k] += 1e-30j
        derivative = corrected(values.astype(complex), reading).imag / 1e-30
        assert by_reading[0, :, k] == pytest.approx(derivative, rel=1e-10)
    own = correction.covariance_of(xy, np.diag([0.25, 0.49]))[0]
    expected = by_parameters[0] @ by_parameters[0].T + by_reading[0] @ np.diag([0.25, 0.49]) @ by_reading[0].T
    assert own == pytest.approx(expected)


def test_feature_22_documents_round_trip(tmp_path, full):
    path = tmp_path / "correction.json"
    for correction in (full.correction, full.joint.correction, full.linear.correction):
        path.write_bytes(correction.to_json())
        again = Correction.read(path)
        places = np.array([[20_000.0, 30_000.0], [200_000.0, 100_000.0]])
        assert (again.apply(places) == correction.apply(places)).all()
        assert (again.covariance_of(places) == correction.covariance_of(places)).all()
    path.write_bytes(full.to_json())
    assert Correction.read(path).scale_x == full.correction.scale_x
    for text in (b"{}", b"[]", b"nonsense", b'{"polynomial": {}}'):
        path.write_bytes(text)
        code = "error.parse" if text == b"nonsense" else "error.content"
        with pytest.raises(InputError, check=coded(code)):
            Correction.read(path)
    with pytest.raises(InputError, match="cannot be read"):
        Correction.read(tmp_path / "nowhere.json")


def test_feature_22_the_document_has_the_members_that_were_promised(full):
    document = json.loads(full.to_json())
    linear = document["linear"]
    assert linear["scale_x"] == full.linear.correction.scale_x
    assert np.array(linear["covariance"]).shape == (3, 3)
    assert {"scale_y", "nonorthogonality_rad", "sigma0_um"} <= set(linear)
    case = document["cases"][0]
    assert set(case["sigma0_um"]) == {"free", "linear", "nonlinear"}
    assert np.array(case["residuals_comparator_um"]).shape == (25, 2)
    assert np.array(case["residuals_grid_um"]).shape == (25, 2)
    means, corrected = np.array(case["means_um"]), np.array(case["corrected_um"])
    assert corrected == pytest.approx(full.correction.apply(means))
    turn = rotation_matrix(case["rotation_rad"])
    linearly = full.linear.correction.apply(means) @ turn.T + case["translation_um"]
    stage = np.array(case["stages"]["combined_linear"]["grid_um"])
    assert linearly - stage == pytest.approx(full.cases[0].placed.grid_um, abs=1e-6)
    assert len(document["polynomial_x"]) == len(document["polynomial_y"]) == 9
    x = means[0] @ full.linear.correction.matrix.T / 1e6
    powers = [x[0] ** 4, x[1] ** 4, x[0] ** 3, x[1] ** 3, x[0] ** 2, x[1] ** 2, x[0], x[1], 1.0]
    assert corrected[0][0] == pytest.approx(1e6 * (x[0] + np.dot(powers, document["polynomial_x"])), abs=1e-6)
    pointing = document["pointing"]
    assert (len(pointing["points"]), len(pointing["cases"]), len(pointing["operators"])) == (200, 8, 2)
    assert pointing["total"]["readings"] == 8 * 128
    assert set(document["variance_components_um"]) == {
        "linear",
        "nonlinear",
        "grid",
        "pointing",
        "random",
        "total",
    }
    grid = np.array(document["grid_corrections_um"])
    assert grid == pytest.approx(full.plates[1].averages.grid_um)
    assert document["sigma_grid_um"] == full.sigma_grid_um(1)
    plate = document["plates"][0]
    assert np.array(plate["corrections_plate_um"]) == pytest.approx(exchanged(grid, True))


# 23: listing, options of the program, limits


def test_feature_23_the_listing_follows_the_pages_of_the_report():
    text = listing(case_2())
    titles = [
        "COMPARATOR CALIBRATION",
        "INPUT DATA CASE ORDER NUMBER 2",
        "CHECKS AND CLOSEOUTS ON POINT NUMBER 1",
        "CASE NUMBER 2 POINTING PRECISION STATISTICS",
        "OPERATOR NUMBER 18 POINTING PRECISION STATISTICS",
        "TOTAL POINTING PRECISION STATISTICS",
        "CASE NUMBER 2 FREE ADJUSTMENT",
        "CASE NUMBER 2 LINEAR ADJUSTMENT",
        "CASE NUMBER 2 NONLINEAR ADJUSTMENT",
        "AVERAGE RESIDUALS AFTER INDIVIDUAL LINEAR ADJUSTMENTS",
        "COMBINED LINEAR ADJUSTMENT",
        "CASE NUMBER 2 WITH FINAL LINEAR CORRECTIONS",
        "COMBINED NONLINEAR ADJUSTMENT",
        "CASE NUMBER 2 WITH ALL FINAL CORRECTIONS",
        "AVERAGE RESIDUALS AFTER APPLICATION OF ALL FINAL CALIBRATION CORRECTIONS",
        "CALIBRATION SUMMARY",
        "Joint adjustment",
    ]
    places = [text.index(title) for title in titles]
    assert places == sorted(places)
    assert "GRID POINT 25 IS NEAREST THE COMPARATOR ORIGIN" in text
    row = "     18       5    0.000    0.447    0.316       0.000    100.00     75037.00    140877.80"
    assert row in text
    assert "TOTAL CLOSEOUT SHIFT" in text


def test_feature_23_plots_for_every_case_only_where_asked_for():
    session = noisy(5)
    assert "NONLINEAR CORRECTIONS, CASE NUMBER 1" not in listing(calibrate(session, QUICK))
    asked = listing(calibrate(replace(session, plot_each_case=True), QUICK))
    assert asked.count("NONLINEAR CORRECTIONS, CASE NUMBER") == 4


def test_feature_23_more_cases_than_the_program_took():
    calibration = calibrate(noisy(23, cases=24, operators=[1, 2, 3, 4, 5, 6]), QUICK)
    assert len(calibration.cases) == 24
    assert len(calibration.pointing.operators) == 6
    assert listing(calibration).count("LINEAR ADJUSTMENT") > 24


def test_feature_23_the_program_of_1971_by_name():
    calibration = calibrate(noisy(2, left_handed=True), Options(as_published=True))
    assert calibration.sigma_grid_um(1) == calibration.plates[1].listed.grid_um
    assert calibration.variance.after_linear.x == pytest.approx(
        round(calibration.variance.after_linear.x, 3), abs=1e-12
    )


def test_feature_23_published_pages_have_nothing_of_ours():
    """No problems, tests, joint adjustment, or paths: only what the program printed itself."""
    session = noisy(2, left_handed=True, cases=3)
    own = listing(calibrate(session))
    published = listing(calibrate(session, Options(as_published=True)))
    for words in ("PROBLEMS", "Terms and their tests", "Joint adjustment"):
        assert words in own
        assert words not in published
    assert "GRID CALIBRATION CORRECTIONS ARE VALID ONLY IF" in published
    assert "CALIBRATION SUMMARY" in published.rsplit("\f", 1)[-1]
    # The remark on one place of identical readings is the program's own; where we read it is not.
    assert str(PRINTED) in listing(case_2())
    printed = listing(calibrate(case_2_session(), Options(as_published=True)))
    assert str(PRINTED) not in printed
    title = printed.split("\f", 1)[0]
    assert ("ARE IDENTICAL" in title) == any("IDENTICAL" in each.text for each in case_2().messages)


# Joint adjustment and tests of significance


def test_the_joint_adjustment_under_the_assumptions_of_the_report_is_its_weighted_mean(full):
    assert full.joint_check < 1e-3
    placed = [case.placed for case in full.cases]
    joint = adjust_jointly(placed, full.session.grids, full.linear, {1: 0.0}, random_um=1.0, polynomial=False)
    sd = np.sqrt(np.diag(full.linear.covariance))
    assert (joint.covariance - full.linear.covariance) / np.outer(sd, sd) == pytest.approx(
        np.zeros((3, 3)), abs=1e-3
    )
    assert joint.sigma0 == pytest.approx(full.linear.sigma0_um, rel=1e-6)
    assert joint.degrees_of_freedom == full.linear.degrees_of_freedom
    for case, fit in zip(joint.cases, full.linear.cases, strict=True):
        assert case.translation_um == pytest.approx(fit.translation_um, abs=1e-3)
        assert case.residuals.comparator_um == pytest.approx(fit.residuals.comparator_um, abs=2e-3)


def test_unequal_pointings_weigh_unequally():
    """A case of two pointings a point weighs less than one of twenty, where pointings are what errs."""
    grid = Grid.square(sigma_um=0.0)
    few = simulate_calibration(
        grid, STRAIGHT, cases=1, sequence=[*np.repeat(np.arange(1, 26), 2), 1, 1, 1], pointing_um=2.0, seed=1
    )
    many = simulate_calibration(
        grid, STRAIGHT, cases=1, sequence=[*np.repeat(np.arange(1, 26), 20), 1, 1, 1], pointing_um=2.0, seed=2
    )
    second = replace(many.session.cases[0], number=2)
    session = replace(few.session, cases=(few.session.cases[0], second))
    joint = calibrate(session).joint
    alone = calibrate(replace(session, cases=(second,))).joint
    expected = 1 / math.sqrt(1 + 2 / 20)
    ratio = math.sqrt(joint.covariance[0, 0] / alone.covariance[0, 0]) * alone.sigma0 / joint.sigma0
    assert ratio == pytest.approx(expected, rel=0.05)


def test_several_plates():
    first, second = Grid.square(5, sigma_um=0.2, number=11), Grid.square(4, 60_000.0, sigma_um=0.3, number=12)
    one = noisy(1, grid=first, correction=bent(), grid_um=0.2)
    two = noisy(2, grid=second, correction=bent(), grid_um=0.3)
    moved = tuple(replace(case, number=case.number + 4) for case in two.cases)
    session = replace(one, cases=(*one.cases, *moved), grids={11: first, 12: second})
    calibration = calibrate(session)
    assert set(calibration.plates) == {11, 12}
    assert len(calibration.plates[12].averages.points) == 16
    assert calibration.joint.plates[12].sigma_um == 0.3
    assert calibration.linear.degrees_of_freedom == 2 * (4 * 25 + 4 * 16) - 27
    assert calibration.joint.sigma0 == pytest.approx(1.0, abs=0.05)
    assert all(math.isfinite(result.unbiased_um) for result in calibration.plates.values())


def test_missing_points():
    from test_comparator_input import without

    session = without(noisy(8), 2, lambda case: ~np.isin(case.points, [8, 14, 25]))
    calibration = calibrate(session)
    assert calibration.plates[1].averages.counts.tolist().count(3) == 3
    assert [case.placed.orientation.nearest_point for case in calibration.cases] == [1, 21, 25, 5]
    assert "comparators.missing case=3 n=3 count=25 plate=1" in map(described, calibration.messages)
    assert calibration.linear.degrees_of_freedom == 2 * 97 - 15


def test_a_plate_of_unknown_accuracy_that_lies_one_way_is_held_fixed():
    calibration = calibrate(noisy(3, grid=Grid.square(), cases=1))
    assert calibration.joint.plates[1].sigma_um == 0.0
    assert "comparators.fixed-grid plate=1" in map(described, calibration.messages)


def test_what_the_joint_adjustment_cannot_do_is_said(full, monkeypatch):
    from photogram.comparator import calibration as module

    def fail(*_arguments, **_options):
        raise AdjustmentError(phrase("comparators.not-converged"))

    session = noisy(3)
    real = module.adjust_jointly
    calls = iter([fail, real])
    monkeypatch.setattr(module, "adjust_jointly", lambda *a, **k: next(calls)(*a, **k))
    calibration = calibrate(session)
    assert calibration.joint is None
    assert "comparators.not-converged" in map(described, calibration.messages)


def test_measurements_without_any_error():
    """No deviation, no residual: everything is still said, and nothing divides by zero."""
    session = simulate_calibration(Grid.square(spacing_um=2.0**16), rotation_rad=0.0).session
    exact = tuple(replace(case, xy_um=np.round(case.xy_um)) for case in session.cases)
    calibration = calibrate(replace(session, cases=exact))
    assert calibration.linear.sigma0_um < 1e-9
    assert calibration.joint.random_um == pytest.approx(1e-3)
    assert "CALIBRATION SUMMARY" in listing(calibration)
    assert json.loads(calibration.to_json())["linear"]["scale_x"] == pytest.approx(1.0, abs=1e-14)


def test_terms_are_significant_where_there_are_terms():
    curved, straight = (
        calibrate(noisy(9, correction=correction), QUICK).polynomial_tests
        for correction in (bent(), STRAIGHT)
    )
    assert curved.probability < 1e-6
    assert straight.probability > 0.01
    quartic = next(term for term in curved.terms if (term.axis, term.term) == ("x", "x^4"))
    assert quartic.probability < 0.01
    assert abs(quartic.ratio) > 2.6
    assert len(curved.terms) == 12
    assert curved.degrees_of_freedom == (12, 173)


def test_probabilities_of_the_polynomial_test_are_uniform():
    values = [
        calibrate(noisy(seed, grid=Grid.square(), grid_um=0.0), QUICK).polynomial_tests.probability
        for seed in range(120)
    ]
    assert 0.40 < np.mean(values) < 0.60
    assert np.mean(np.array(values) < 0.1) < 0.22


def test_hartley_limits_are_those_of_the_tables():
    """Upper 5 percent points of F-max (Pearson and Hartley, Biometrika Tables, table 31)."""
    for groups, dof, limit in ((2, 10, 3.72), (4, 10, 5.67), (3, 20, 2.95), (4, 60, 1.96)):
        assert _f_max_tail(limit, groups, dof) == pytest.approx(0.05, abs=1.5e-3)


def test_cases_of_unequal_quality_are_found():
    rng = np.random.default_rng(4)
    equal = [rng.standard_normal((25, 2)) for _ in range(4)]
    unequal = [*equal[:3], 2.2 * equal[3]]
    test = compare_case_variances(equal)
    assert test.f_max < test.f_max_limit == pytest.approx(2.2, abs=0.05)
    assert min(test.f_max_probability, test.bartlett_probability, test.levene_probability) > 0.05
    test = compare_case_variances(unequal)
    assert test.f_max > test.f_max_limit
    assert max(test.f_max_probability, test.bartlett_probability, test.levene_probability) < 0.01
