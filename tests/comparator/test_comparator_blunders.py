"""Blunders: they are named, and a correction that they spoil is not handed out."""

import json
from dataclasses import replace

import numpy as np
import pytest
from plates import QUICK, case_2_session, noisy

from message_codes import described, refusal
from photogram import InputError
from photogram.comparator import Correction, Grid, Options, calibrate, simulate_calibration, to_csv
from photogram.comparator.averages import Reduction
from photogram.comparator.outliers import far_pointings, pointing_tests, screen
from photogram.comparator.variance import CombinedPolynomial
from photogram.words import phrase


def refused(result, code=1):
    """Whether a command ended with an exit code of its own, not with a traceback."""
    return result.exit_code == code and isinstance(result.exception, SystemExit)


def changed(session, case, **fields):
    """Return the session with other arrays in one of its cases (index)."""
    cases = [replace(own, **fields) if k == case else own for k, own in enumerate(session.cases)]
    return replace(session, cases=tuple(cases))


def moved(session, case, point, by_um):
    """Return the session with all pointings on a point of a case moved."""
    xy = session.cases[case].xy_um.copy()
    xy[session.cases[case].points == point] += by_um
    return changed(session, case, xy_um=xy)


def exchanged_labels(session, case=2, first=7, second=8):
    points = session.cases[case].points.copy()
    points[session.cases[case].points == first] = second
    points[session.cases[case].points == second] = first
    return changed(session, case, points=points)


def phrases(calibration):
    return [message.phrase for message in calibration.messages]


def test_good_measurements_have_no_problems():
    calibration = calibrate(noisy(4))
    assert (calibration.messages, calibration.screening.outliers, calibration.usable) == ([], (), True)


def test_exchanged_labels_are_named_and_withhold_the_correction():
    calibration = calibrate(exchanged_labels(noisy(4)), QUICK)
    assert not calibration.usable
    first, *named = phrases(calibration)[:3]
    assert first.code == "comparators.harm"
    assert {each.code for each in named} == {"comparators.outlier-exchanged"}
    fields = [[each.fields[name] for name in ("case", "point", "instead")] for each in named]
    assert fields == [[3, 7, 8], [3, 8, 7]]
    for outlier in calibration.screening.outliers:
        assert outlier.distance_um == pytest.approx(50_000, abs=5)
    # Without them the measurements are as good as they were.
    assert calibration.screening.sigma_um == pytest.approx(
        calibrate(noisy(4), QUICK).nonlinear.sigma0_um, rel=0.05
    )


def test_a_blunder_is_named_with_its_place_and_size():
    calibration = calibrate(moved(noisy(4), 2, 9, [12.0, 0.0]), QUICK)
    (outlier,) = calibration.screening.outliers
    assert (outlier.case, outlier.point, outlier.instead) == (3, 9, None)
    assert outlier.distance_um == pytest.approx(12.0, abs=2.0)
    assert outlier.ratio > calibration.screening.limit
    # A twelfth of it is in the correction: less than a coordinate is uncertain.
    assert calibration.usable
    assert 0.05 < calibration.screening.change_um < calibration.screening.sigma_um
    first = phrases(calibration)[0]
    assert (first.code, first.fields["case"], first.fields["point"]) == ("comparators.outlier", 3, 9)


def test_several_blunders_do_not_hide_each_other():
    session = noisy(4)
    for case, point in ((0, 3), (0, 17), (1, 3), (3, 25), (3, 24)):
        session = moved(session, case, point, [0.0, 30.0 + point])
    found = {(outlier.case, outlier.point) for outlier in calibrate(session, QUICK).screening.outliers}
    assert found == {(1, 3), (1, 17), (2, 3), (4, 25), (4, 24)}


def test_a_point_that_is_off_everywhere_is_one_of_the_grid():
    session = noisy(4)
    xy = session.grids[1].xy_um.copy()
    xy[12] += [20.0, 0.0]
    calibration = calibrate(replace(session, grids={1: replace(session.grids[1], xy_um=xy)}))
    of_point = [each.code for each in phrases(calibration) if each.fields.get("point") == 13]
    assert of_point == ["comparators.wrong-point"]


def test_labels_exchanged_in_every_case_are_exchanged_labels():
    session = noisy(4)
    for case in range(4):
        session = exchanged_labels(session, case, 12, 14)
    first, *named = phrases(calibrate(session, QUICK))[:3]
    assert first.code == "comparators.harm"
    assert [described(each) for each in named] == [
        "comparators.exchanged plate=1 point=12 instead=14",
        "comparators.exchanged plate=1 point=14 instead=12",
    ]


def test_a_pointing_ten_sigma_off_is_named_with_its_record(run, tmp_path):
    session = noisy(4)
    xy = session.cases[1].xy_um.copy()
    xy[37, 1] += 9.0
    path = tmp_path / "m.csv"
    path.write_bytes(to_csv(changed(session, 1, xy_um=xy)))
    (tmp_path / "1.csv").write_bytes(session.grids[1].to_csv())
    result = run("comparator", path, "--grid", tmp_path / "1.csv", "--no-plots")
    assert result.exit_code == 0
    point = session.cases[1].points[37]
    calibration = calibrate(changed(session, 1, xy_um=xy), QUICK)
    (message,) = (each for each in calibration.messages if each.code == "comparators.far-pointing")
    assert (message.phrase.fields["case"], message.phrase.fields["point"]) == (2, point)
    verdict = calibration.verdict
    assert verdict.code == "look-at"
    (test,) = (test for test in verdict.tests if test.name.startswith("pointings"))
    assert not test.accepted
    assert f"limit {test.limits[1]:.2f}" in result.output
    assert str(message.text) in result.output
    record = path.read_text().splitlines().index("plate,case,operator,leg,point,x_um,y_um") + 2 + 128 + 37
    listing = (tmp_path / "m-calibrated" / "listing.txt").read_text()
    assert f"m.csv, record {record}: {message.text}" in listing.split("PROBLEMS")[1]


def test_the_limit_of_pointings_holds_its_level():
    """Of 300 cases without blunders one in twenty has a pointing beyond the limit."""
    random = np.random.default_rng(5)
    case = noisy(4).cases[0]
    found = 0
    for _ in range(300):
        drawn = random.normal(0, 1.0, case.xy_um.shape)
        found += bool(far_pointings(pointing_tests([replace(case, xy_um=drawn)])))
    assert 4 <= found <= 28


def test_readings_without_error_have_no_outliers():
    calibration = calibrate(simulate_calibration(Grid.square()).session, QUICK)
    assert (calibration.screening.outliers, calibration.far_pointings) == ((), ())


def test_variances_are_the_diagonal_of_the_reduction():
    """Against the dense matrix of the stages: rigid and linear, polynomials, rigid again."""
    calibration = calibrate(noisy(4), QUICK)
    for stage in (calibration.linear, calibration.nonlinear):
        reduction = Reduction.of(stage)
        rows = 2 * len(reduction.left)
        left, right = (part.reshape(rows, -1) for part in (reduction.left, reduction.right))
        dense = np.eye(rows) - left @ right.T
        assert reduction.variances().ravel() == pytest.approx((dense**2).sum(axis=1), abs=1e-12)
        assert reduction.squares_of_units() == pytest.approx((dense**2).sum(), rel=1e-12)
        # What it leaves of the residuals of its own stage is all of them.
        residuals = np.vstack([fit.residuals.comparator_um for fit in stage.cases]).ravel()
        tolerance = 1e-3 if isinstance(stage, CombinedPolynomial) else 1e-4
        assert dense @ residuals == pytest.approx(residuals, abs=tolerance)


def test_screening_does_not_empty_a_case():
    """Where half of a case is off, the search stops rather than leave it without points."""
    session = noisy(4)
    calibration = calibrate(session, QUICK)
    placed = [case.placed for case in calibration.cases]
    spoilt = replace(
        placed[0], means_um=placed[0].means_um + np.random.default_rng(1).normal(0, 500, (25, 2))
    )
    screening = screen([spoilt, *placed[1:]], calibration.linear, session.grids)
    assert np.isfinite(screening.sigma_um)


# The command


@pytest.fixture
def exchanged(tmp_path):
    session = exchanged_labels(noisy(4))
    path = tmp_path / "m.csv"
    path.write_bytes(to_csv(session))
    (tmp_path / "1.csv").write_bytes(session.grids[1].to_csv())
    return ["comparator", path, "--grid", tmp_path / "1.csv", "--no-plots"]


def test_the_command_withholds_what_outliers_spoil(run, tmp_path, exchanged):
    document = tmp_path / "all.json"
    out = tmp_path / "out"
    result = run(*exchanged, "--out", out, "--json", document)
    assert refused(result, 4)
    assert "the correction is withheld: Gross errors: outliers change corrected coordinates" in result.output
    assert [path.name for path in out.iterdir()] == ["listing.txt"]
    made = json.loads(document.read_bytes())
    assert (made["usable"], made["correction"], made["joint"]["correction"]) == (False, None, None)
    assert [outlier["point"] for outlier in made["screening"]["outliers"]] == [7, 8]
    table = tmp_path / "t.csv"
    table.write_text("x_um,y_um\n1,2\n")
    result = run("comparator", "correct", document, table)
    assert refused(result)
    assert str(phrase("comparators.withheld")) in result.output


def test_files_of_an_earlier_run_are_named(run, tmp_path, exchanged):
    out = tmp_path / "out"
    out.mkdir()
    (out / "correction.json").write_text("{}")
    result = run(*exchanged, "--out", out)
    assert "correction.json is from an earlier run" in result.output
    assert (out / "correction.json").read_text() == "{}"


# The standard deviation of the grid


def test_a_grid_that_is_worse_than_it_should_be_comes_first():
    calibration = calibrate(moved(noisy(4, grid_um=1.2), 2, 9, [15.0, 0.0]))
    test = calibration.joint.plates[1].test
    assert test.rejected_high
    first, second = phrases(calibration)[:2]
    assert (first.code, first.fields["plate"], first.fields["sd"]) == ("comparators.grid-test", 1, 0.3)
    assert (second.code, second.fields["point"]) == ("comparators.outlier", 9)
    assert json.loads(calibration.to_json())["joint"]["plates"][0]["test"]["probability_above"] < 1e-6


def test_the_test_of_the_grid_holds_its_level():
    """Sixty calibrations with a right standard deviation: few are rejected (5 percent expected, 3)."""
    rejected = 0
    for seed in range(60):
        session = noisy(seed, pointing_um=0.3)
        test = calibrate(session, Options(polynomial=False)).joint.plates[1].test
        rejected += test.rejected_high or test.rejected_low
    assert rejected <= 9


def test_no_test_where_the_grid_is_estimated_or_fixed():
    assert calibrate(noisy(4), Options(estimate_grid=True)).joint.plates[1].test is None
    assert calibrate(noisy(4, grid=Grid.square(sigma_um=0.0))).joint.plates[1].test is None


# Corrections that cannot be


@pytest.mark.parametrize(
    ("member", "value", "words"),
    [
        ("scale_x", 0, "error.at what=scale_x message=error.positive value=0.0"),
        ("scale_y", -1, "error.at what=scale_y message=error.positive value=-1.0"),
        ("scale_x", None, "error.at what=scale_x message=error.number"),
        ("scale_x", "1", "error.at what=scale_x message=error.number value=1"),
        ("scale_x", True, "error.at what=scale_x message=error.number"),
        ("scale_x", [1, 2], "error.at what=scale_x message=error.number"),
        ("nonorthogonality_rad", 2, "error.at what=nonorthogonality_rad message=error.range"),
        ("covariance", [[0]], "error.at what=covariance message=error.shape shape=(21, 21) actual=(1, 1)"),
        ("covariance", [[-1.0] * 21] * 21, "error.covariance-singular"),
        ("polynomial", {}, "error.content"),
        ("polynomial", 5, "error.content"),
    ],
)
def test_correction_files_are_checked(run, tmp_path, member, value, words):
    document = json.loads(calibrate(noisy(4), QUICK).correction.to_json())
    path = tmp_path / "c.json"
    path.write_text(json.dumps(document))
    assert Correction.read(path).to_json() == calibrate(noisy(4), QUICK).correction.to_json()
    document[member] = value
    path.write_text(json.dumps(document))
    with refusal(words) as caught:
        Correction.read(path)
    assert caught.value.file == path
    table = tmp_path / "t.csv"
    table.write_text("x_um,y_um\n1,2\n")
    for option in ([], ["--invert"]):
        assert refused(run("comparator", "correct", path, table, *option))


def test_missing_members_and_other_documents(tmp_path):
    path = tmp_path / "c.json"
    document = json.loads(calibrate(noisy(4), QUICK).correction.to_json())
    del document["scale_x"]
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match="'scale_x' is missing"):
        Correction.read(path)
    for text in ("", "[]", "3", '{"scale_x": NaN}', '{"correction": 5}', "[" * 100_000):
        path.write_text(text)
        with pytest.raises(InputError) as raised:
            Correction.read(path)
        valid = text in ("[]", "3", '{"correction": 5}')
        assert raised.value.code == ("error.content" if valid else "error.parse")
        assert (raised.value.file, raised.value.record) == (path, None if valid else 1)


@pytest.mark.parametrize("member", ["coefficients_x_um", "half_range_um"])
def test_polynomials_of_a_correction_are_checked(run, tmp_path, member):
    document = json.loads(calibrate(noisy(4), QUICK).correction.to_json())
    path, table = tmp_path / "c.json", tmp_path / "t.csv"
    table.write_text("x_um,y_um\n1000,2000\n")
    count = len(document["polynomial"][member])
    for value in (0.0, 1e300, -1e300, 1e-300):
        document["polynomial"][member] = [value] * count
        path.write_text(json.dumps(document))
        for option in ([], ["--invert"]):
            result = run("comparator", "correct", path, table, *option)
            assert result.exit_code == 0 or refused(result)
            assert "nan" not in result.output


def test_coordinates_beyond_every_comparator(run, tmp_path):
    path, table = tmp_path / "c.json", tmp_path / "t.csv"
    path.write_bytes(calibrate(noisy(4), QUICK).correction.to_json())
    table.write_text("x_um,y_um\n1,2\n1e300,2\n")
    result = run("comparator", "correct", path, table)
    assert refused(result)
    assert "record 3: x, y: " in result.output
    session = noisy(4)
    xy = session.cases[0].xy_um * 1e200
    with refusal("case=1 point=1 message=error.most"):
        calibrate(changed(session, 0, xy_um=xy))


def test_columns_without_names_stay_where_they_are(run, tmp_path):
    path, table = tmp_path / "c.json", tmp_path / "t.csv"
    path.write_bytes(calibrate(noisy(4), QUICK).correction.to_json())
    table.write_text("x_um,,y_um,,\n1000,a,2000,b,c\n")
    result = run("comparator", "correct", path, table)
    assert result.stdout.splitlines()[1].startswith("1000,a,2000,b,c,")


def test_case_2_of_the_report_has_one_point_with_two_pointings_apart():
    found = far_pointings(pointing_tests(case_2_session().cases))
    assert [(far.point, round(abs(far.deviation_um), 1)) for far in found] == [(8, 3.5), (8, 3.5)]
