"""Files of stations: CSV and cards; what is wrong is said with file, record and text."""

import numpy as np
import pandas as pd
import pytest
from orientation_golden import cards_of, cases, csv_of, stations
from orientation_models import simulate

from message_codes import coded
from photogram import AdjustmentError, InputError, RankError, orient
from photogram.absolute_orientation import Similarity, Stations, read_cards, read_csv
from photogram.absolute_orientation.stations import (
    read_transformation,
    restart_record,
    transformation_records,
)

HEADER = "id,X,Y,Z,x,y,z\n"
CARDS = """\
0 0 0 0 0 0 0 9
5 3 2 9
500 500 - 0.3 0.2 0.1 1
900 100 - 0.7 -0.2 0.1 2
- - 20 0.2 0.3 0.02 3
- - 30 0.8 0.2 0.03 4
- - 40 0.4 -0.6 0.04 5
"""


def write(tmp_path, text, name="stations.csv"):
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("case", cases("partial_mixed", "legit_zero_coordinate", "full_large_offset"))
def test_csv_and_cards_say_the_same(case, tmp_path):
    expected = stations(case["stations"])
    from_csv = read_csv(write(tmp_path, csv_of(case["stations"])))
    deck = read_cards(write(tmp_path, cards_of(case["stations"])))
    assert deck.former is None
    assert deck.identification == "7"
    for read in (from_csv, deck.stations):
        assert read.ids == expected.ids
        np.testing.assert_array_equal(read.control, expected.control)
        np.testing.assert_array_equal(read.model, expected.model)


@pytest.mark.parametrize("case", cases("partial_mixed", "legit_zero_coordinate"))
def test_zeros_are_values_unless_told(case, tmp_path):
    path = write(tmp_path, cards_of(case["stations"], zeros=True))
    if case["id"] == "partial_mixed":
        with pytest.raises(
            InputError, match="record 2: ", check=lambda error: error.code == "orientation.counts"
        ):
            read_cards(path)
        np.testing.assert_array_equal(
            read_cards(path, zero_missing=True).stations.control, stations(case["stations"]).control
        )
    else:
        assert read_cards(path).stations.given.all()
        with pytest.raises(
            InputError, match="record 2: ", check=lambda error: error.code == "orientation.counts"
        ):
            read_cards(path, zero_missing=True)


def test_csv_columns(tmp_path):
    text = (
        "# control of 1962\nx1,x2,x3,id,X3,X2,X1,sd_Z,sd_X,sd_Y,sd_x,sd_y,sd_z\n"
        '1,2,3,"A, old",6,5,4,0.1,,,.01,.02,1e-2\n\n4,5,6,B,7,,,inf,,,.01,.02,.03\n'
    )
    read = read_csv(write(tmp_path, text), ground_unit="ft", model_unit="um")
    assert read.ids == ("A, old", "B")
    np.testing.assert_array_equal(read.control, [[4, 5, 6], [np.nan, np.nan, 7]])
    np.testing.assert_array_equal(read.control_sd, [[0, 0, 0.1], [0, 0, np.inf]])
    np.testing.assert_array_equal(read.model_sd, [[0.01, 0.02, 0.01], [0.01, 0.02, 0.03]])
    assert (read.ground_unit, read.model_unit) == ("ft", "um")
    np.testing.assert_array_equal(read.held, [[1, 1, 1], [0, 0, 0]])


TABLE = pd.DataFrame(
    [
        ["A", 3.0, 2.0, 1.0, 4.0, 5.0, 6.0, 0.1, 0.01, 0.02, 0.01],
        ["B", 6.0, 5.0, 4.0, np.nan, np.nan, 7.0, np.nan, 0.01, 0.02, 0.03],
    ],
    columns=["id", *"zyxXYZ", "sd_Z", "sd_x", "sd_y", "sd_z"],
)


def test_stations_of_a_data_frame():
    read = Stations.from_table(TABLE, ground_unit="ft", model_unit="um")
    assert read.ids == ("A", "B")
    np.testing.assert_array_equal(read.control, [[4, 5, 6], [np.nan, np.nan, 7]])
    np.testing.assert_array_equal(read.model, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(read.control_sd, [[0, 0, 0.1], [0, 0, 0]])
    np.testing.assert_array_equal(read.model_sd, [[0.01, 0.02, 0.01], [0.01, 0.02, 0.03]])
    assert (read.ground_unit, read.model_unit) == ("ft", "um")

    plain = Stations.from_table(TABLE[["id", *"XYZxyz"]].assign(id=[7, 8]))
    assert plain.ids == ("7", "8")
    assert not plain.control_sd.any()
    assert plain.model_sd is None
    assert (plain.ground_unit, plain.model_unit) == ("ground unit", "model unit")


def test_data_frames_and_csv_files_are_the_same(tmp_path):
    from_csv = read_csv(write(tmp_path, TABLE.to_csv(index=False)))
    from_table = Stations.from_table(TABLE)
    assert from_csv.ids == from_table.ids
    for name in ("control", "model", "control_sd", "model_sd"):
        np.testing.assert_array_equal(getattr(from_csv, name), getattr(from_table, name))


def test_errors_of_a_data_frame_name_column_and_station():
    with pytest.raises(InputError) as missing:
        Stations.from_table(TABLE.drop(columns=["Z", "y"]))
    assert missing.value.code == "orientation.missing-columns"
    assert missing.value.phrase.fields["names"] == ["Z", "y"]
    with pytest.raises(InputError) as incomplete:
        Stations.from_table(TABLE.drop(columns=["sd_y"]))
    assert incomplete.value.code == "orientation.incomplete-sd"
    assert incomplete.value.phrase.fields["names"] == ["sd_x", "sd_z"]

    for column, value, code in (
        ("y", np.inf, "orientation.model-coordinate"),
        ("Z", np.inf, "orientation.control-coordinate"),
        ("sd_Z", -0.1, "orientation.control-sd"),
        ("sd_y", np.inf, "orientation.model-sd"),
    ):
        with pytest.raises(InputError) as wrong:
            Stations.from_table(TABLE.assign(**{column: [1.0, value]}))
        assert wrong.value.code == code
        assert wrong.value.phrase.fields == {"station": "B", "value": value}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must contain a table"),
        (HEADER, "must contain stations"),
        ("id,X,Y,x,y,z\n", "record 1: the column Z is missing"),
        ("id,X,Y,Z,x,y,z,w\n", "record 1: the column 'w' is unknown"),
        ("id,X,Y,Z,x,y,z,x\n", "record 1: the column 'x' occurs more than once"),
        ("id,X,Y,Z,x,y,z,sd_x\nA,1,2,3,4,5,6,7\n", "sd_x, sd_y and sd_z are required together"),
        (HEADER + "A,1,2,3,4,5\n", "record 2: the record must have 7 cells, one for each column, got 6"),
        (HEADER + "A,1,2,3,4,5,six\n", "record 2: column z: must be a number, got 'six'"),
        (HEADER + "A,1,2,3,4,5,\n", "record 2: column z: must have a value"),
        (HEADER + "A,1,2,nan,4,5,6\n", "record 2: column Z: must be a number, got 'nan'"),
        (HEADER + "A,1,2,inf,4,5,6\n", "record 2: column Z: must be a number, got 'inf'"),
        (HEADER + "A,1,2,3,4,5,6\n\nA,1,2,3,4,5,6\n", "record 4: station A occurs twice"),
        (HEADER + ",1,2,3,4,5,6\n", "record 2: a station requires an id"),
        (
            HEADER + "9" * 140_000 + ",1,2,3,4,5,6\n",
            "record 2: the record must have at most 100000 characters",
        ),
        (
            HEADER[:-1] + "," * 420_000 + "\n1,2,3,4,5,6,7\n",
            "record 1: the record must have at most 100000 characters",
        ),
    ],
)
def test_faults_of_a_csv_file(text, message, tmp_path):
    path = write(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_csv(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))
    if "record" in message:
        assert caught.value.text == text.splitlines()[caught.value.record - 1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("5 3 2 9\n", "", "record 2: constants"),
        ("5 3 2 9", "6 3 2 9", "record 2: M must be the number of station records, 5, but is 6"),
        ("5 3 2 9", "5 2 2 9", "record 2: N must be the number of elevations, 3, but is 2"),
        ("5 3 2 9", "5 3 x 9", "record 2: MN: must be a count, got 'x'"),
        ("- - 20 0.2", "20 0.2", "record 5: station X1 X2 X3 x1 x2 x3 number: 7 words are required, got 5"),
        ("0.02 3", "0.0z 3", "record 5: x3: must be a number, got '0.0z'"),
        ("0.03 4", "0.03 3", "record 6: station 3 occurs twice"),
        ("0 0 0 0 0 0 0 9", "0 0 2 1 0 0 0 9", "record 1: sines must be"),
        ("0 0 0 0 0 0 0 9", "0 0 0.1 0 1 0 0 9", "record 1: s: must be positive"),
        ("0 0 0 0 0 0 0 9", "0 0 0", "record 1: parameters"),
        ("500 500 -", "500 - -", "pairs, 1, but is 2"),
        ("5 3 2 9", "² 3 2 9", "record 2: M: must be a count, got '²'"),
        ("5 3 2 9", "9" * 5000 + " 3 2 9", "record 2: M: must be a count, got '999"),
        ("500 500 -", "9" * 5000 + " 500 -", "record 3: X1: must be a number, got '999"),
    ],
)
def test_faults_of_cards(old, new, message, tmp_path):
    assert old in CARDS
    path = write(tmp_path, CARDS.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_cards(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_cards_with_commas(tmp_path):
    commas = CARDS.replace("- - 20 0.2 0.3 0.02 3", ",,2.0D1, 0.2,0.3,0.02, 3")
    plain, with_commas = (read_cards(write(tmp_path, text)).stations for text in (CARDS, commas))
    np.testing.assert_array_equal(plain.control, with_commas.control)


@pytest.mark.parametrize("kappa", [-3.0, -1.7, 0.4, 1.7, 3.0])
def test_the_restart_record_keeps_the_quadrant_of_kappa(kappa, tmp_path):
    model = simulate(np.random.default_rng(4), angles=(0.05, -0.08, kappa))
    first = orient(model.stations())
    given = first.stations
    rows = [
        " ".join(
            [*("-" if np.isnan(v) else repr(float(v)) for v in control), *map(repr, map(float, x)), name]
        )
        for control, x, name in zip(given.control, given.model, given.ids, strict=True)
    ]
    counts = f"{len(rows)} {given.given[:, 2].sum()} {given.given[:, 0].sum()} 1"
    text = "\n".join([restart_record(first.similarity, "1"), counts, *rows]) + "\n"
    deck = read_cards(write(tmp_path, text))
    np.testing.assert_allclose(deck.former.rotation, first.similarity.rotation, atol=1e-12)
    again = orient(deck.stations, former=deck.former, method="report")
    assert len(again.cycles) == 1
    assert again.started == "restart"
    assert not deck.messages


def test_without_horizontal_stations_in_front_the_quadrant_is_assumed(tmp_path):
    record = "0.01 0.02 0.5 0.001 0.1 0.2 0.3 9"
    lines = CARDS.splitlines()
    text = "\n".join([record, lines[1], *reversed(lines[2:])]) + "\n"
    deck = read_cards(write(tmp_path, text))
    assert abs(deck.former.angles[2]) < np.pi / 2
    assert deck.messages[0].code == "orientation.kappa"


def test_transformation_records(tmp_path):
    truth = simulate(np.random.default_rng(4)).truth
    text = "\n".join(transformation_records(truth, "5")) + "\n"
    again = read_transformation(write(tmp_path, text))
    np.testing.assert_array_equal(again.rotation, truth.rotation)
    np.testing.assert_array_equal(again.translation, truth.translation)
    with pytest.raises(InputError, check=lambda error: error.code == "orientation.rotation"):
        read_transformation(write(tmp_path, text.replace(text.split()[0], "0.1234", 1)))
    with pytest.raises(InputError, match="two records"):
        read_transformation(write(tmp_path, text.splitlines()[0]))


# Arrays


def full(count=6):
    return simulate(np.random.default_rng(1), ("XYZ",) * count).stations()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ids": ["1", "1", "2", "3", "4", "5"]}, "station 1 occurs twice"),
        ({"model": np.zeros((5, 3))}, "model: must have the shape (6, 3), got (5, 3)"),
        ({"model_sd": np.zeros(2)}, "must have the shape (6, 3)"),
        ({"model_sd": 0.0}, "got zero in both"),
        ({"control_sd": -1.0, "model_sd": 1.0}, "standard deviations of control must be"),
        ({"control_sd": 0.1}, "requires standard deviations of the model"),
        ({"model_sd": -1.0}, "standard deviations of the model must be finite"),
        ({"model": "text"}, "model: must be an array of numbers"),
        ({"control": None}, "control: must be an array"),
        ({"ids": 6}, "ids: must be a list of names"),
        ({"ids": ["\ud800", *"bcdef"]}, "must contain printable characters only"),
        (
            {"model": np.ma.masked_less(np.arange(18.0).reshape(6, 3), 2)},
            "model: must not have masked values",
        ),
        ({"model": 10**400}, "model"),
        ({"control": np.inf}, "control coordinates must be finite"),
        ({"model": np.nan}, "model coordinates must be finite"),
    ],
)
def test_arrays_that_cannot_be(change, message):
    given = full()
    arguments = {"ids": given.ids, "control": given.control, "model": given.model, **change}
    with pytest.raises(InputError) as caught:
        Stations(**arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"method": "fast"}, "error.choice"),
        ({"start": "best"}, "error.choice"),
        ({"reject": ["nobody"]}, "orientation.no-station"),
        ({"max_iterations": 0}, "error.positive"),
        ({"max_iterations": 2**64}, "error.kind"),
        ({"max_iterations": None}, "error.kind"),
        ({"reject": 5}, "error.kind"),
        ({"tolerance": np.nan}, "error.positive"),
        ({"tolerance": "1"}, "error.number"),
        ({"trace": True}, "orientation.trace"),
        ({"tolerance": 0.0}, "error.positive"),
        ({"unit_variance": "unity"}, "orientation.unity"),
    ],
)
def test_options_that_cannot_be(options, code):
    with pytest.raises(InputError, check=coded(code)):
        orient(full(), **options)


def test_later_edits_change_no_result():
    control, model = np.array(full().control), np.array(full().model)
    given = Stations(range(6), control, model)
    result = orient(given)
    before = result.report()
    control[0] += 100
    model[0] += 100
    assert result.report() == before
    with pytest.raises(ValueError, match="read-only"):
        given.control[0] = 0


def test_the_methods_of_the_report_take_no_weights():
    given = full()
    weighted = Stations(given.ids, given.control, given.model, model_sd=1.0)
    with pytest.raises(InputError, check=lambda error: error.code == "orientation.method-sd"):
        orient(weighted, method="report")


# Control that does not do


def test_too_few_components_after_a_rejection():
    given = full(3)
    with pytest.raises(RankError, check=lambda error: error.code == "orientation.insufficient"):
        orient(given, reject=["0", "1"])


def degenerate(control, model=None):
    control = np.array(control, dtype=float)
    exact = 0.001 * np.nan_to_num(control)
    return Stations(range(len(control)), control, exact if model is None else model)


def test_reasons():
    nan = np.nan
    line = [[100.0 * k, 50.0 * k, 20.0 * k] for k in range(5)]
    with pytest.raises(RankError, match="stations are in a straight line"):
        orient(degenerate(line))
    plan = [(0, 0), (900, 50), (100, 100), (400, 400), (600, 600)]
    model = np.column_stack([0.001 * np.array(plan), [0.01, 0.02, 0.01, 0.02, 0.015]])
    control = [[0, 0, nan], [900, 50, nan], [nan, nan, 10], [nan, nan, 20], [nan, nan, 15]]
    # Only the relief of the horizontal stations, 10 m on 900, holds the tilt about the line of elevations.
    weak = orient(degenerate(control, model))
    assert any("add elevations off this line: 2, 3, 4" in str(m) for m in weak.messages)
    model[:, 2] = 0.01
    control = [[x, y, 10.0 if height > 0 else nan] for x, y, height in control]
    with pytest.raises(RankError, match="elevations are in a straight line in plan") as caught:
        orient(degenerate(control, model))
    assert caught.value.points == ["2", "3", "4"]
    same = [[100, 100, nan], [100, 100, nan], [nan, nan, 10], [nan, nan, 20], [nan, nan, 15]]
    model = np.column_stack([0.001 * np.array([(100, 100), (100, 100), *plan[2:]]), np.full(5, 0.01)])
    model[4, 1] += 0.3
    with pytest.raises(RankError, match="coincide in plan"):
        orient(degenerate(same, model))


def test_the_first_two_stations_of_the_report():
    given = simulate(np.random.default_rng(2), ("Z", "XYZ", "XYZ", "XYZ")).stations()
    with pytest.raises(InputError, match=r"first two stations have no horizontal coordinates \(0, 1\)"):
        orient(given, start="report")
    assert orient(given).started == "closed-form"
    control = given.control.copy()
    control[0] = control[1]
    with pytest.raises(InputError, match="first two stations coincide in plan"):
        orient(Stations(given.ids, control, given.model), start="report")


def test_a_mirror_image_fits_badly():
    given = full()
    result = orient(Stations(given.ids, given.control, given.model * [1, 1, -1]))
    assert result.rms > 0.02 * np.ptp(given.model)


@pytest.mark.parametrize("method", ["rigorous", "report"])
def test_a_scale_that_is_not_positive_is_refused(method):
    """Values half a turn away lead to a mirror image (specification, section 8, fault 3)."""
    model = simulate(np.random.default_rng(2), angles=(0.02, 0.01, 0.5))
    turned = np.diag([-1.0, -1.0, 1.0]) @ model.truth.rotation
    former = Similarity.from_parameters(model.truth.scale, turned, model.truth.translation)
    with pytest.raises(AdjustmentError, match="became zero or negative"):
        orient(model.stations(), former=former, method=method)


def test_iterations_may_run_out():
    given = simulate(np.random.default_rng(2), angles=(0.2, 0.2, 1)).stations()
    for method in ("rigorous", "report"):
        result = orient(given, max_iterations=1, method=method, start="report")
        assert not result.converged
        assert "do not use these values" in result.report()
