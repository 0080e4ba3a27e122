"""Readers of cards and tables, plates, legs, close-out, grouping; and what is wrong with the input."""

import math
from dataclasses import replace

import numpy as np
import pytest
from plates import PRINTED, QUICK, STRAIGHT, case_2, case_2_session, document, noisy, table

from message_codes import described, refusal
from photogram import InputError
from photogram.comparator import (
    Grid,
    Options,
    built_in_grid,
    calibrate,
    find_grid,
    read,
    read_cards,
    read_csv,
    read_grid,
    simulate_calibration,
    to_cards,
    to_csv,
)
from photogram.comparator.case import close_out, detect_orientation, intersect_legs, reduce_legs
from photogram.comparator.measurements import join_least_count
from photogram.comparator.readings import group, group_as_listed


def header(comparator=3, *, flags="10000", stage=" ", operators=(18,) * 4, master=1, date="7/17/72"):
    """Return a header card."""
    named = "".join(f"{operator:3d}" for operator in (*operators, *([0] * 20))[:20])
    return f"{flags}{comparator:2d}{stage} {named}  {date:8}{master}"


def deck(tmp_path, *cards, name="deck.txt"):
    path = tmp_path / name
    path.write_text("".join(f"{card}\n" for card in cards))
    return path


def standard(case, point, x, y, *, leg=0, plate=20):
    """Return a data card in format 122: hundredths of a micrometre."""
    return f"  {100 * plate + case:5d}{leg:1d}{point:2d} {x * 100:10d}{y * 100:10d}"


def circuit(make, points=None):
    """Return the cards of a small plate of 25 points, two readings each, closed on the first point."""
    grid = built_in_grid(1320)
    numbers = [*grid.points.tolist(), 1]
    places = (grid.xy_um[:, ::-1] + 125_000).round().astype(int)
    return [make(point, *places[point - 1].tolist()) for point in numbers for _ in range(2)]


# 1: cards and header


def test_feature_01_cards_of_case_2_are_read_as_they_are_printed(tmp_path):
    session = case_2_session()
    path = tmp_path / "deck.txt"
    path.write_bytes(to_cards(session))
    again = read_cards(path)[0]
    assert again.cases[0].points.tolist() == session.cases[0].points.tolist()
    assert again.cases[0].xy_um == pytest.approx(session.cases[0].xy_um, abs=1e-9)
    assert (again.comparator, again.left_handed, again.cases[0].operator) == (3, True, 18)
    assert again.cases[0].places[0].record == 2


def test_feature_01_typed_cards_of_figure_3(tmp_path):
    """Typed cards have six digits a coordinate; blanks behind them are zeros, as on the CDC 6600."""
    rows = [row for row in table("fig03_typewriter_case1.csv") if row["x_um"] and row["y_um"]]
    cards = [
        f"  2001 0{int(row['point']):2d}   {int(row['x_um']):06d}    {int(row['y_um']):06d}" for row in rows
    ]
    session = read_cards(deck(tmp_path, header(7, flags="00000"), *cards, ""), left_handed=False)[0]
    assert session.cases[0].number == 1
    expected = [[float(row["x_um"]), float(row["y_um"])] for row in rows]
    # Micrometres end in columns 19 and 29; the two columns behind them are hundredths.
    assert session.cases[0].xy_um == pytest.approx(np.array(expected))


FORMATS = {
    "146 right stage": (10, "00000", "R", lambda p, x, y: f"  20010 {p:2d}{'':21}{x * 100:10d}{y * 100:10d}"),
    "123 PSK left": (12, "00000", " ", lambda p, x, y: f"  10{p:2d}  20{'':9}{x:6d}    {y:6d}"),
    "124 PSK right": (13, "00000", " ", lambda p, x, y: f" 1320 10{p:2d}{'':29}{x:6d}    {y:6d}"),
    "143 special": (15, "00000", " ", lambda p, x, y: f"{standard(1, p, x, y)}{'':29}   125000"),
    "MICRON": (
        11,
        "00100",
        " ",
        lambda p, x, y: f"  {x % 10}{y % 10}  10{p:2d}{x - x % 10 + 4:9d}{y - y % 10 + 4:10d}",
    ),
}


@pytest.mark.parametrize("name", FORMATS)
def test_feature_01_all_formats_of_data_cards(tmp_path, name):
    comparator, flags, stage, make = FORMATS[name]
    cards = circuit(make)
    session = read_cards(
        deck(tmp_path, header(comparator, flags=flags, stage=stage), *cards, ""), left_handed=True
    )[0]
    case = session.cases[0]
    grid = built_in_grid(1320)
    expected = (grid.xy_um[case.points - 1][:, ::-1] + 125_000).round()
    # Unit digits apart move the coarse reading by at most five.
    assert case.xy_um == pytest.approx(expected, abs=10 if name == "MICRON" else 1e-6)
    assert (case.number, case.plate, session.secondary) == (1, 1320, stage == "R")


def test_feature_01_unit_digits_carry():
    assert join_least_count(1239, 0) == 1240
    assert join_least_count(1240, 9) == 1239
    assert join_least_count(1234, 7) == 1237
    assert join_least_count(1234, 9) == 1239


def test_feature_01_header_options_and_passed_over_card(tmp_path):
    cards = circuit(lambda p, x, y: standard(1, p, x, y))
    path = deck(tmp_path, header(flags="11011"), "passed over", *cards, "")
    session = read_cards(path)[0]
    assert (session.left_handed, session.sorted_input, session.plot_each_case) == (True, True, True)
    assert (session.least_count_one_micrometre, session.date) == (True, "7/17/72")
    assert session.cases[0].operator == 18


def test_feature_01_tables_in_micrometres_and_millimetres(tmp_path):
    session = noisy(1)
    (tmp_path / "grid.csv").write_bytes(session.grids[1].to_csv())
    text = to_csv(session).decode().replace("# grid = 1", "# grid = grid.csv")
    (tmp_path / "um.csv").write_text(text)
    head, *rows = text.splitlines()[3:]
    cells = [row.split(",") for row in rows]
    mm = [",".join([*row[:5], f"{float(row[5]) / 1000:.6f}", f"{float(row[6]) / 1000:.6f}"]) for row in cells]
    lines = ["# grid = grid.csv", head.replace("_um", "_mm"), *mm, "", "1,4,1,0,25,,"]
    (tmp_path / "mm.csv").write_text("\n".join(lines))
    first, second = (read([tmp_path / name])[0] for name in ("um.csv", "mm.csv"))
    for one, other, given in zip(first.cases, second.cases, session.cases, strict=True):
        assert one.xy_um == pytest.approx(given.xy_um, abs=6e-4)
        assert one.xy_um == pytest.approx(other.xy_um, abs=1e-8)
    assert first.left_handed is False
    assert second.left_handed is None


# 2: plates


@pytest.mark.parametrize(
    ("number", "sigma", "points"), [(773, 0.220, 24), (1320, 0.249, 25), (778, 0.405, 24)]
)
def test_feature_02_built_in_grids(number, sigma, points):
    grid = built_in_grid(number)
    assert (grid.sigma_um, len(grid.points)) == (sigma, points)
    rows = {int(row["point"]): row for row in table(f"grid_master_{number}.csv")}
    for point, (x, y) in zip(grid.points.tolist(), grid.xy_um.tolist(), strict=True):
        assert (x, y) == (float(rows[point]["X_um"]), float(rows[point]["Y_um"]))
    missing = set(rows) - set(grid.points.tolist())
    assert all(not rows[point]["Y_um"] for point in missing)


def test_feature_02_special_grid_of_a_deck(tmp_path):
    grid = built_in_grid(1320)
    places = (grid.xy_um * 100).round().astype(int)
    cards = [
        f"       0{point:2d} {x:10d}{y:10d}".ljust(79) + ("1" if point == 25 else " ")
        for point, (x, y) in zip(grid.points.tolist(), places.tolist(), strict=True)
    ]
    operators = (7,) + (0,) * 17 + (2, 345)
    data = circuit(lambda p, x, y: standard(1, p, x, y, plate=45))
    session = read_cards(deck(tmp_path, header(operators=operators, master=3), *cards, *data, ""))[0]
    assert session.grids[2345].xy_um == pytest.approx(grid.xy_um)
    assert session.grids[2345].sigma_um is None
    assert described(session.messages[0]) == "comparators.special-grid plate=2345"
    unmarked = [card[:79] for card in cards]
    with refusal("comparators.grid-end"):
        read_cards(deck(tmp_path, header(master=3), *unmarked))


def test_feature_02_plates_from_files(tmp_path):
    grid = Grid.square(4, 30_000.0, number=77, sigma_um=0.5)
    path = tmp_path / "plate.csv"
    path.write_bytes(grid.to_csv())
    again = find_grid(str(path))
    assert (again.number, again.sigma_um) == (77, 0.5)
    assert again.xy_um == pytest.approx(grid.xy_um)
    assert find_grid("778").number == 778
    path.write_text("point,x_um,y_um\n1,0,0\n1,5,5\n")
    with refusal("error.repeated kind=point name=1", record=3):
        read_grid(path)
    path.write_text("# sigma = 0.2\npoint,x_um,y_um\n1,0,0\n")
    with refusal("error.unknown.close kind=setting name=sigma close=sigma_um"):
        read_grid(path)


def test_plates_expand_with_their_temperature(tmp_path):
    """A warm plate is larger than its certificate says: the scale of the comparator is not to blame."""
    made = simulate_calibration(Grid.square(sigma_um=0.3), STRAIGHT, random_um=0.2, seed=3).session
    path = tmp_path / "plate.csv"
    path.write_bytes(replace(made.grids[1], temperature_c=20.0, expansion_per_k=8e-6).to_csv())
    cold = read_grid(path)
    session = replace(made, grids={1: cold}, temperature_c=24.0)
    (tmp_path / "readings.csv").write_bytes(to_csv(session))
    found = calibrate(read([tmp_path / "readings.csv"], [cold])[0], QUICK)
    plain = calibrate(made, QUICK)
    assert found.correction.scale_x / plain.correction.scale_x - 1 == pytest.approx(4 * 8e-6, rel=1e-3)
    assert found.correction.identity.temperature_c == 24.0
    assert found.corrected_grid(1).temperature_c == 24.0
    assert not [each for each in found.messages if each.code == "comparators.expansion"]
    unsaid = calibrate(replace(made, temperature_c=24.0), QUICK)
    assert described(unsaid.messages[0]).startswith("comparators.expansion plate=1 missing=its")
    with refusal("what=expansion_per_k message=error.range value=1.0"):
        replace(cold, expansion_per_k=1.0)


# 3: handedness


@pytest.mark.parametrize("left_handed", [False, True])
def test_feature_03_left_handed_data_exchange_the_grid(left_handed):
    session = simulate_calibration(Grid.square(), STRAIGHT, left_handed=left_handed).session
    calibration = calibrate(session, QUICK)
    assert all(case.placed.orientation.left_handed == left_handed for case in calibration.cases)
    assert calibration.linear.correction.scale_y == pytest.approx(1 - 22e-6, abs=1e-12)
    wrong = replace(session, left_handed=not left_handed)
    with refusal("comparators.hand case=1"):
        calibrate(wrong, QUICK)


def test_feature_03_a_plate_turned_over_on_the_way():
    up = noisy(5, left_handed=False, grid_um=0.0)
    down = noisy(6, left_handed=True, grid_um=0.0)
    renumbered = tuple(replace(case, number=case.number + 4) for case in down.cases)
    mixed = replace(up, cases=(*up.cases, *renumbered), left_handed=False)
    calibration = calibrate(mixed, QUICK)
    assert [case.placed.orientation.left_handed for case in calibration.cases] == [False] * 4 + [True] * 4
    assert calibration.nonlinear.sigma0_um < 1.0
    plate = calibration.plates[1].averages
    by_hand = [
        fit.residuals.grid_um[0][::-1] if k >= 4 else fit.residuals.grid_um[0]
        for k, fit in enumerate(calibration.last_fits)
    ]
    assert plate.grid_um[0] == pytest.approx(np.mean(by_hand, axis=0))


# 4: legs


def test_feature_04_legs_meet_in_their_intersection():
    for angle in (0.0, 0.3, math.pi / 2, 2.0):
        c, s = math.cos(angle), math.sin(angle)
        cross = np.array([[c, s], [-s, c], [-3 * c, -3 * s], [2 * s, -2 * c]]) * 500 + [123_456.0, 98_765.0]
        assert intersect_legs(cross) == pytest.approx([123_456.0, 98_765.0], abs=1e-7)
    with refusal("comparators.parallel"):
        intersect_legs(np.array([[0.0, 0.0], [0.0, 5.0], [10.0, 0.0], [10.0, 5.0]]))


def legged(session, point, arms=4, parallel=False):
    """Replace the readings of a point in the first case by readings on its legs."""
    case = session.cases[0]
    rows = np.flatnonzero(case.points == point)
    middle = case.xy_um[rows[0]]
    arm = np.array([[400.0, 80.0], [-80.0, 400.0], [-400.0, -80.0], [80.0, -400.0]])
    if parallel:
        arm[1], arm[3] = arm[0] + [0.0, 5.0], arm[2] + [0.0, 5.0]
    legs = [leg for leg in range(1, arms + 1) for _ in range(2)]
    xy = np.array([middle + arm[leg - 1] for leg in legs])
    keep = np.setdiff1d(np.arange(len(case.points)), rows)
    order = np.argsort(np.concatenate([keep, np.full(len(legs), rows[0])]), kind="stable")
    changed = replace(
        case,
        points=np.concatenate([case.points[keep], np.full(len(legs), point)])[order],
        legs=np.concatenate([case.legs[keep], legs])[order],
        xy_um=np.vstack([case.xy_um[keep], xy])[order],
        places=(case.places[0],) * (len(keep) + len(legs)),
    )
    return replace(session, cases=(changed, *session.cases[1:])), middle


def test_feature_04_legs_replace_an_intersection_in_a_case():
    session, middle = legged(noisy(2), 13)
    reduced, messages = reduce_legs(session.cases[0])
    assert not reduced.legs.any()
    assert np.count_nonzero(reduced.points == 13) == 1
    assert reduced.xy_um[reduced.points == 13][0] == pytest.approx(middle)
    assert not messages
    calibration = calibrate(session, QUICK)
    assert 13 in calibration.cases[0].placed.points
    session, _ = legged(noisy(2), 13, arms=3)
    calibration = calibrate(session, QUICK)
    assert "comparators.legs point=13 present=3" in map(described, calibration.messages)
    assert 13 not in calibration.cases[0].placed.points


# 5: close-out


def test_feature_05_close_out_of_case_2():
    closeout = case_2().cases[0].closeouts[0]
    figure = document("fig05_title_page.json")["closeout_case2"]
    assert closeout.sequential_shifts_um[0] == pytest.approx(figure["sequential_shift"], abs=1e-6)
    assert closeout.total_shift_um == pytest.approx(figure["total_shift"], abs=1e-6)
    assert closeout.verdict == "good"


@pytest.mark.parametrize(
    ("shift", "verdict", "words"),
    [
        (1.9, "good", None),
        (2.5, "suspect", "comparators.shifted-first"),
        (4.0, "remeasure", "comparators.moved"),
    ],
)
def test_feature_05_the_rules_of_two_and_four_micrometres(shift, verdict, words):
    session = noisy(3, pointing_um=0.0, random_um=0.0)
    case = session.cases[0]
    xy = case.xy_um.copy()
    xy[-3:] += [shift, 0.0]
    closeouts, messages = close_out(replace(case, xy_um=xy))
    assert closeouts[0].verdict == verdict
    assert [message.code for message in messages] == ([words] if words else [])


def test_feature_05_cases_that_are_not_closed():
    case = noisy(3).cases[0]
    open_case = replace(
        case, points=case.points[:-3], legs=case.legs[:-3], xy_um=case.xy_um[:-3], places=case.places[:-3]
    )
    closeouts, messages = close_out(open_case)
    assert closeouts[0].verdict == "none"
    assert described(messages[0]) == "comparators.no-closeout case=1 point=1"
    few = replace(
        case, points=case.points[:9], legs=case.legs[:9], xy_um=case.xy_um[:9], places=case.places[:9]
    )
    with refusal("comparators.not-closed case=1 count=9 point=1"):
        close_out(few)


# 6: grouping


def test_feature_06_the_listing_groups_by_swapping():
    points = case_2_session().cases[0].points
    printed = [int(row["point"]) for row in table("fig07_case2_pointing_stats.csv")]
    order = group_as_listed(points)
    assert list(dict.fromkeys(points[order].tolist())) == printed
    assert sorted(order.tolist()) == list(range(len(points)))
    ours = group(points)
    assert list(dict.fromkeys(points[ours].tolist())) == list(dict.fromkeys(points.tolist()))


# What is wrong with the input


def small_deck(tmp_path, change=lambda cards: cards):
    cards = [header(), *circuit(lambda p, x, y: standard(1, p, x, y)), ""]
    return deck(tmp_path, *change(cards))


def swapped(number, card):
    def change(cards):
        return [card if n == number else old for n, old in enumerate(cards, 1)]

    return change


@pytest.mark.parametrize(
    ("change", "record", "words"),
    [
        (swapped(7, standard(1, 77, 25_000, 25_000)), 7, "comparators.no-point plate=1320 point=77"),
        (
            swapped(3, standard(1, 1, 95_000, 25_000)),
            3,
            "comparators.far-reading distance=69999.0 case=1 point=1",
        ),
        (swapped(7, standard(2, 3, 25_000, 25_000)), 8, "comparators.repeated-case case=1 record=2"),
        (
            swapped(7, standard(1, 3, 25_000, 25_000, plate=73)),
            7,
            "error.unknown kind=plate name=73 names=['1320']",
        ),
        (
            swapped(7, "  2001  X3      25000"),
            7,
            "error.columns first=9 last=10 message=error.whole value=X3",
        ),
        (
            swapped(7, standard(1, 3, 25_000, 25_000).replace("2500000", "25A0000")),
            7,
            "error.columns first=12 last=21 message=error.number",
        ),
        (
            swapped(7, standard(31, 3, 25_000, 25_000)),
            7,
            "error.at what=case message=error.range value=31 low=1 high=20",
        ),
        (
            swapped(7, standard(1, 3, 25_000, 25_000, leg=7)),
            7,
            "error.at what=leg message=error.range value=7 low=0 high=4",
        ),
        (swapped(1, header(19)), 1, "error.columns first=6 last=7 message=error.most high=15 value=19"),
        (swapped(1, header(master=5)), 1, "error.columns first=80 last=80 message=error.most high=3 value=5"),
        (lambda cards: [cards[0], ""], 1, "comparators.empty-deck"),
    ],
)
def test_bad_cards_name_file_record_and_text(tmp_path, change, record, words):
    path = small_deck(tmp_path, change)
    with refusal(words) as caught:
        read_cards(path)
    assert (caught.value.file, caught.value.record) == (path, record)
    assert caught.value.text == path.read_text().splitlines()[record - 1]


def test_zero_and_zero_is_missing_on_cards(tmp_path):
    session = read_cards(small_deck(tmp_path, swapped(7, standard(1, 3, 0, 0))))[0]
    assert len(session.cases[0].points) == 51
    assert described(session.messages[0]) == "comparators.zero-readings point=3"


def test_the_middle_of_the_range_stands_on_cards_of_comparator_15(tmp_path):
    """Format 143: TRANS in columns 61-69, metres with six decimals."""
    cards = [header(15), *circuit(lambda p, x, y: standard(1, p, x, y)), ""]
    session = read_cards(deck(tmp_path, *cards))[0]
    assert session.centre_um == 125_000.0
    cards[1:-1] = [f"{card:60}{300_000:9d}" for card in cards[1:-1]]
    assert read_cards(deck(tmp_path, *cards))[0].centre_um == 300_000.0


TABLE = "# grid = 1320\ncase,point,x_um,y_um\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# grid = 1320\ncase,point,x_um,y_mm\n1,1,2,3\n", "comparators.units"),
        ("# grid = 1320\ncase,point,x_um,y_um,x_mm,y_mm\n1,1,2,3,4,5\n", "comparators.units"),
        ("# grid = 1320\ncase,point,x,y\n1,1,2,3\n", "comparators.units"),
        ("# grid = 1320\npoint,x_um,y_um\n1,2,3\n", "case"),
        ("case,point,x_um,y_um\n1,1,2,3\n", "comparators.no-grid"),
        (f"{TABLE}1,1,2\n", "3"),
        (f"{TABLE}1,1,2,\n", "comparators.coordinate"),
        (f"{TABLE}1,1,2,abc\n", "abc"),
        (f"{TABLE}1,one,2,3\n", "one"),
        (f"{TABLE}1,77,2,3\n", "comparators.no-point plate=1320 point=77"),
        (f"{TABLE}1,1,2,3\n2,1,2,3\n1,2,2,3\n", "comparators.repeated-case case=1 record=3"),
        (
            "# grid = 99\ncase,point,x_um,y_um\n1,1,2,3\n",
            "error.unknown kind=built-in grid name=99 names=['773', '1320',",
        ),
        (
            "# grid = 1320\n# left_handed = perhaps\ncase,point,x_um,y_um\n1,1,2,3\n",
            "error.at what=left_handed message=error.choice value=perhaps",
        ),
        (
            "# grid = 1320\nplate,case,point,x_um,y_um\n778,1,1,2,3\n",
            "error.unknown kind=plate name=778 names=['1320']",
        ),
        ("# nothing\n", ""),
        (
            f"{TABLE}1,{'9' * 5000},2,3\n",
            "9999",
        ),
        (f"{TABLE}1,9223372036854775808,2,3\n", "9223372036854775808"),
        (f"{TABLE}1,²,2,3\n", "²"),
        (f"{TABLE}1,1,{'9' * 140_000},3\n", "1400"),
        (f"# grid = 1320\ncase,point,x_um,y_um{',' * 420_000}\n1,1,2,3\n", "4200"),
        (f"{TABLE}1,1,1_0,3\n", "1_0"),
        (f"{TABLE}1,1,1e300,3\n", "error.at what=comparators.point case=1 point=1"),
        ("# grid = 1320\ncase,point,x_um,y_um,point\n1,1,2,3,4\n", "point"),
        (TABLE, "error.empty-file content=measurements"),
    ],
)
def test_bad_tables_name_what_is_wrong(tmp_path, text, words):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with refusal(words) as caught:
        read_csv([path])
    assert caught.value.file == path or caught.value.file is None


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read([tmp_path / "nowhere.csv"])
    with pytest.raises(InputError, match="cannot be read"):
        read([tmp_path / "nowhere.txt"])
    (tmp_path / "a.csv").write_text(TABLE)
    with pytest.raises(InputError, match="all tables or all decks"):
        read([tmp_path / "a.csv", tmp_path / "b.txt"])
    with refusal("comparators.files"):
        read([])


def without(session, case, keep):
    """Return the session with only some readings of one case."""
    own = session.cases[case]
    rows = np.flatnonzero(keep(own))
    reduced = replace(
        own,
        points=own.points[rows],
        legs=own.legs[rows],
        xy_um=own.xy_um[rows],
        places=tuple(own.places[row] for row in rows),
    )
    cases = [reduced if k == case else other for k, other in enumerate(session.cases)]
    return replace(session, cases=tuple(cases))


def test_too_few_points_are_errors():
    session = noisy(4)
    with refusal("case=2", "comparators.few-points count=2"):
        calibrate(without(session, 1, lambda case: case.points <= 2), QUICK)
    with refusal("case=2", "comparators.few-points count=3"):
        calibrate(without(session, 1, lambda case: np.isin(case.points, [1, 5, 21])), QUICK)
    with refusal("case=2", "comparators.collinear"):
        calibrate(without(session, 1, lambda case: case.points <= 5), QUICK)
    eight = without(session, 1, lambda case: np.isin(case.points, [1, 3, 5, 11, 15, 21, 23, 25]))
    calibration = calibrate(eight, QUICK)
    assert calibration.cases[1].polynomial is None
    assert any("few-points count=8 least=10" in described(message) for message in calibration.messages)


def test_identical_readings_are_remarked_on_or_refused():
    session = noisy(4)
    case = session.cases[0]
    same = case.xy_um.copy()
    same[case.points == 7] = same[case.points == 7][0]
    copied = replace(session, cases=(replace(case, xy_um=same), *session.cases[1:]))
    messages = map(described, calibrate(copied, QUICK).messages)
    assert "comparators.identical case=1 points=7" in messages
    same[case.points == 8] = same[case.points == 7][0]
    copied = replace(session, cases=(replace(case, xy_um=same), *session.cases[1:]))
    with pytest.raises(InputError, match="must have different readings, unlike 7 and 8"):
        calibrate(copied, QUICK)


def test_parallel_legs_and_doubly_measured_points_are_errors():
    session, _ = legged(noisy(2), 13, parallel=True)
    with refusal("case=1 point=13", "comparators.parallel"):
        calibrate(session, QUICK)
    session, _ = legged(noisy(2), 1)
    doubled = replace(
        session.cases[0], legs=np.where(np.arange(len(session.cases[0].legs)) < 1, 0, session.cases[0].legs)
    )
    with refusal("comparators.legs-mixed point=1"):
        reduce_legs(doubled)


def test_a_case_in_another_unit_is_an_error():
    session = noisy(4)
    other = replace(session.cases[0], xy_um=session.cases[0].xy_um / 1000)
    with refusal("comparators.scale case=1 scale=999.99"):
        calibrate(replace(session, cases=(other, *session.cases[1:])), QUICK)


def test_a_case_measured_twice_is_an_error_for_arrays_too():
    session = noisy(4)
    with refusal("error.repeated kind=case name=1"):
        calibrate(replace(session, cases=(session.cases[0], session.cases[0])), QUICK)


def test_arrays_are_checked():
    session = noisy(4)
    case = session.cases[0]
    xy = case.xy_um.copy()
    xy[7, 1] = np.nan
    for wrong, words in (
        (replace(case, xy_um=xy), "error.at what=comparators.point case=1 point=2"),
        (replace(case, points=case.points[:-1]), "comparators.lengths case=1"),
        (replace(case, plate=9), "error.unknown kind=plate name=9 names=['1']"),
    ):
        with refusal(words):
            calibrate(replace(session, cases=(wrong, *session.cases[1:])), QUICK)
    with refusal("error.empty-file content=measurements"):
        calibrate(replace(session, cases=()), QUICK)
    with refusal("what=sigma_um message=error.not-negative value=-1.0"):
        Grid.square(sigma_um=-1.0)


def test_a_blunder_is_remarked_on():
    session = noisy(4)
    case = session.cases[2]
    xy = case.xy_um.copy()
    xy[case.points == 9] += [12.0, 0.0]
    spoilt = replace(session, cases=(*session.cases[:2], replace(case, xy_um=xy), session.cases[3]))
    (message,) = calibrate(spoilt, Options(joint=False)).messages
    assert (message.code, message.phrase.fields["point"]) == ("comparators.outlier", 9)


def test_the_printed_data_are_complete():
    assert len(table("fig06_case2_readings.csv")) == 146
    assert (PRINTED / "README.md").exists()


def test_coordinates_without_squares_are_refused():
    points = np.arange(1, 5)
    grid = Grid(1, points, np.array([[0.0, 0.0], [1e300, 0.0], [0.0, 1e300], [1e300, 1e300]]), None)
    with refusal("error.at what=x, y message=error.less value=1e+300 high=1e+150"):
        detect_orientation(grid, points, np.zeros((4, 2)))
