"""Lists of control as people send them: read as delivered, or with the option that the message names."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from message_codes import rejected
from photogram import InputError, formats
from photogram.formats.column_words import column_of, role_of, units_of
from photogram.formats.columns import columns_given, degrees
from photogram.formats.supplements import with_control
from photogram.io.numbers import marks_of

LISTS = Path(__file__).parents[1] / "data" / "control_lists"
CHECKS = {"102", "103", "105"}
PLANE = [
    "german_bom",
    "german_latin1",
    "thousands",
    "swiss",
    "excel_utf16",
    "french",
    "pnezd",
    "wider",
    "dbat",
]
OPTIONS = {
    "german_bom.csv": ["--sd", "control=0.01"],
    "german_latin1.csv": ["--sd", "control=0.01"],
    "excel_utf16.txt": ["--sd", "control=0.01"],
    "pnezd.txt": ["--columns", "PNEZD", "--sd", "control=0.01"],
    "lat_lon.csv": ["--control-crs", "EPSG:4979"],
    "degrees_minutes.csv": ["--control-crs", "EPSG:4979"],
}
"""What the message names; all other lists go as delivered."""
WITHOUT_ROLES = {"german_bom.csv", "german_latin1.csv", "dbat.txt", "wider.txt"}


def lists():
    return sorted(each.name for each in LISTS.iterdir() if each.suffix in (".csv", ".txt"))


def block():
    return formats.read(LISTS / "block")


def given(path, text, **kinds):
    """Return the block with a list, and what was said of it."""
    path.write_text(text)
    columns = columns_given(kinds.pop("columns", None), kinds.pop("roles", None))
    return with_control(block(), path, kinds.pop("sd", {"control": (0.01,)}), kinds.pop("crs", None), columns)


def test_there_are_eleven():
    assert len(lists()) == 11


@pytest.mark.parametrize("name", lists())
def test_a_list_is_adjusted_as_delivered_or_with_the_option_that_the_message_names(run, tmp_path, name):
    if "control-crs" in str(OPTIONS.get(name)):
        pytest.importorskip("pyproj")
    words = ["adjust", LISTS / "block", "--control", LISTS / name, "--out", "out", "--no-html"]
    options = OPTIONS.get(name, [])
    if options:
        refused = run(*words)
        assert refused.exit_code == 1
        for option in options:
            assert option in refused.stderr.replace("\n", " ")
    done = run(*words, *options)
    assert done.exit_code == 0, done.output
    assert "Accepted" in done.output
    points = pd.read_csv(tmp_path / "out" / "points.csv", comment="#", dtype={"point": str}).set_index(
        "point"
    )
    found = set(points.index[points["kind"] == "check"])
    assert found == (set() if name in WITHOUT_ROLES else CHECKS)
    assert (points["kind"] == "control").sum() == 7 - len(found)
    known = pd.read_csv(LISTS / "german_bom.csv", sep=";", decimal=",", dtype={"Punkt": str}).set_index(
        "Punkt"
    )
    own = points.loc[known.index, ["X", "Y", "Z"]].to_numpy()
    lengths, truth = (np.linalg.norm(each - each[0], axis=1) for each in (own, known.to_numpy()))
    np.testing.assert_allclose(lengths, truth, atol=0.03)


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("name", ["excel_utf16.txt", "german_bom.csv"])
def test_two_bytes_a_character_are_read_without_a_mark(name, encoding, tmp_path):
    """Zeros stand in alternate places: between them are the bytes of the text, umlauts among them."""
    delivered = LISTS / name
    text = delivered.read_bytes().decode("utf-16" if "utf16" in name else "utf-8-sig")
    (tmp_path / name).write_bytes(text.encode(encoding))
    sd = {"control": (0.01,)}
    expected, found = (with_control(block(), each, sd, None) for each in (delivered, tmp_path / name))
    assert found.block.point_ids == expected.block.point_ids
    for each in ("point_positions", "point_sd"):
        np.testing.assert_array_equal(getattr(found.block, each), getattr(expected.block, each))


@pytest.mark.parametrize(
    ("heading", "column"),
    [
        *((each, "point") for each in ("Punkt-Nr.", "PtNr", "Nom", "Point ID", "GCP Name", "Numéro")),
        *(
            (each, "x")
            for each in ("Rechtswert [m]", "Easting (m)", "X/Easting", "Est", "UTM32 Easting", "east_ft")
        ),
        *((each, "y") for each in ("Hochwert", "northing", "Nord", "Norte")),
        *(
            (each, "z")
            for each in ("Höhe", "Hoehe", "Höhe ü. NN", "Altitude", "Cota", "Elevation (US survey ft)")
        ),
        *((each, "sd_x") for each in ("sigmaX", "Accuracy_X/Easting (m)", "sx", "Écart-type X")),
        *((each, "sd_z") for each in ("Vertical accuracy", "VRMS", "Std. Dev. Z", "Höhengenauigkeit")),
        *((each, "sd_xy") for each in ("Lagegenauigkeit", "Horizontal accuracy", "HRMS")),
        *((each, "use") for each in ("Type", "Punktart", "Rôle")),
        ("lat", "latitude"),
        ("Länge", "longitude"),
        ("PDOP", ""),
        ("X_error_(m)", ""),
        ("Kjempe", None),
    ],
)
def test_headings(heading, column):
    assert column_of(heading) == column


def test_roles_and_units():
    assert [role_of(each) for each in ("GCP", "Passpunkt", "KP", "Prüfpunkt", "CP", "Contrôle", "nail")] == [
        *("control", "control", "check", "check", "?", "?"),
        None,
    ]
    assert [units_of(each) for each in ("X (ft)", "Elev_us-ft", "Easting [m]", "Höhe", "U (k=2) [mm]")] == [
        ["ft"],
        ["us-ft"],
        ["m"],
        [],
        ["mm"],
    ]


HEAD = "point,x,y,z,"
ROWS = [
    ("101", -77.5239, -120.5302, 2.9130),
    ("102", 2.7190, -83.4570, 6.0874),
    ("103", 38.9226, -90.3168, 5.1614),
]


def table(head, cells):
    """Return a list of three points with a further column."""
    return "\n".join(
        [HEAD + head, *(f"{','.join(map(str, row))},{own}" for row, own in zip(ROWS, cells, strict=True))]
    )


@pytest.mark.parametrize(
    ("head", "cells", "checks"),
    [
        ("Type", ["GCP", "Check", "GCP"], ["102"]),
        ("Bemerkung", ["", "Kontrollpunkt", ""], ["102"]),
        ("Typ", ["GCP", "CP", "GCP"], ["102"]),
        ("Art", ["Check", "CP", "Check"], ["101", "103"]),
        ("Enable", ["1", "0", "1"], ["102"]),
        ("Check", ["", "x", ""], ["102"]),
        ("Type", ["nail", "bolt", "nail"], []),
    ],
)
def test_a_column_of_roles_is_read_whatever_it_is_called(tmp_path, head, cells, checks):
    project = given(tmp_path / "list.csv", table(head, cells))
    assert [project.block.point_ids[row] for row in project.checks] == checks
    assert bool(checks) == any(each.code == "columns.roles-read" for each in project.messages)


@pytest.mark.parametrize(
    ("head", "cells", "option"),
    [
        ("Type", ["CP", "CP", "CP"], '--roles "CP=check"'),
        ("Type", ["GCP", "Check", "PB"], '--roles "PB=check"'),
        ("role", ["one", "two", "one"], '--roles "one=check"'),
        (
            "Quality",
            ["0.01", "0.02", "0.01"],
            "--columns sd_x=quality (a guess), or ignore them (--columns -=quality)",
        ),
        (
            "Easting",
            ["1", "2", "3"],
            "one column must provide 'x', got x, easting; choose one with --columns x=x",
        ),
    ],
)
def test_what_looks_like_a_role_or_a_number_and_is_not_read_stops(tmp_path, head, cells, option):
    with pytest.raises(InputError) as caught:
        given(tmp_path / "list.csv", table(head, cells))
    assert option in str(caught.value)


def test_options_say_what_columns_and_words_are(tmp_path):
    path = tmp_path / "list.csv"
    project = given(path, table("Type", ["PB", "ZZ", "PB"]), columns="use=Type", roles="PB=control,ZZ=check")
    assert [project.block.point_ids[row] for row in project.checks] == ["102"]
    project = given(path, table("Quality", ["0.01", "0.02", "0.03"]), columns="-=Quality")
    assert len(project.checks) == 0
    project = given(path, table("Quality", ["0.01", "0.02", "0.03"]), columns="sd=Quality", sd={})
    np.testing.assert_array_equal(project.block.point_sd[project.block.point_ids.index("102")], 0.02)
    turned = table("d", ["a", "b", "c"]).replace("x,y,z", "Osten,Sueden,Hoch")
    project = given(path, turned, columns="x=Osten[ft],y=-Sueden,z=Hoch")
    place = project.block.point_ids.index("103")
    np.testing.assert_allclose(project.block.point_positions[place], [38.9226 * 0.3048, 90.3168, 5.1614])
    for bad, say in (
        ("point=Nummer", "format.unknown heading in --columns Nummer"),
        ("east=x", "east"),
        ("point,x,y=Y", "columns.order"),
    ):
        with rejected(say):
            given(path, turned, columns=bad)


def test_two_columns_that_may_be_heights_are_settled_by_the_option_of_the_message(tmp_path):
    # H is Hochwert beside R, and a height elsewhere.
    path, text = tmp_path / "list.csv", table("d", ["a", "b", "c"]).replace("point,x,y,z", "Nr,R,H,Z")
    with rejected("cells.same-columns z h,z h"):
        given(path, text)
    with rejected("columns.numbers r,h --columns x=r,y=h (a guess)"):
        given(path, text, columns="z=z")
    project = given(path, text, columns="z=z,x=r,y=h")
    place = project.block.point_ids.index("103")
    np.testing.assert_array_equal(project.block.point_positions[place], ROWS[2][1:])


def test_deviations_of_position_and_height(tmp_path):
    rows = ["101;1;2;3;0.01;20", "102;2;3;4;;30"]
    for head in (
        "Lagegenauigkeit;Höhengenauigkeit [mm]",
        "sxy;sz (mm)",
        "Horizontal accuracy;Vertical accuracy (mm)",
    ):
        text = "\n".join([f"Name;Ost;Nord;Höhe;{head}", *rows])
        project = given(tmp_path / "list.csv", text, sd={"control": (0.05,)})
        rows_of = [project.block.point_ids.index(name) for name in ("101", "102")]
        np.testing.assert_allclose(project.block.point_sd[rows_of], [[0.01, 0.01, 0.02], [0.05, 0.05, 0.03]])


def test_units_in_headings_count(tmp_path):
    text = table("d", ["a", "b", "c"]).replace("x,y,z", "x (ft),y (ft),z (ft)")
    project = given(tmp_path / "list.csv", text)
    place = project.block.point_ids.index("103")
    np.testing.assert_allclose(project.block.point_positions[place], 0.3048 * np.array(ROWS[2][1:]))


def test_what_is_not_understood_ends_with_the_guess(tmp_path):
    path = tmp_path / "list.csv"
    for text, say in (
        ("Sted;Bredde;Lengde\nA;1,5;2,5\nB;3,5;4,5\n", "--columns point=Sted,x=Bredde,y=Lengde"),
        ("Sted;x;y\nA;1,5;2,5\nB;3,5;4,5\n", "--columns point=sted (a guess)"),
        ("A 1.0 2.0 3.0\n", "--columns PNEZ "),
    ):
        with pytest.raises(InputError) as caught:
            given(path, text)
        assert say in str(caught.value)


def test_columns_of_a_plain_project_are_said_in_its_settings(tmp_path):
    for each in (LISTS / "block").iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    (tmp_path / "control.csv").write_text(table("Q", ["ZZ", "PB", "PB"]).replace("point,", "Sted,"))
    settings = (tmp_path / "project.toml").read_text()
    with rejected("columns point=sted"):
        formats.read(tmp_path)
    own = '[control]\ncolumns = "point=Sted,use=Q"\nroles = "ZZ=check,PB=control"\n[sd]\ncontrol = 0.01\n'
    (tmp_path / "project.toml").write_text(settings + own)
    project = formats.read(tmp_path)
    assert [project.block.point_ids[row] for row in project.checks] == ["101"]


@pytest.mark.parametrize(
    ("cells", "delimiter", "numbers"),
    [
        (["4.567.890,12", "1.234,5"], ";", ["4567890.12", "1234.5"]),
        (["4'567'890.12", "3"], ",", ["4567890.12", "3"]),
        (["4 567 890,12"], ";", ["4567890.12"]),
        (["4,567,890.12", "4,567"], "\t", ["4567890.12", "4567"]),
        (["1,234", "2,5"], ";", ["1.234", "2.5"]),
        (["4.567"], ";", ["4.567"]),
    ],
)
def test_marks_of_decimals_and_thousands(cells, delimiter, numbers):
    marks = marks_of(cells, delimiter)
    assert [marks.plain(cell) for cell in cells] == numbers


@pytest.mark.parametrize("cells", [["4.567", "1,25"], ["4,567", "1.25"], ["1,234", "1.234"]])
def test_a_mark_that_may_divide_decimals_or_thousands_is_refused(cells):
    with rejected("cells.marks"):
        [marks_of(cells, ";").plain(cell) for cell in cells]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("47.5", 47.5),
        ("47 30 00", 47.5),
        ("47°30'00\" N", 47.5),
        ("S 47:30:00", -47.5),
        ("8°30,0'W", -8.5),
        ("-0 30 0", -0.5),
        ("47d30m", 47.5),
    ],
)
def test_degrees_and_minutes(text, value):
    assert degrees(text) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize("text", ["47 60 0", "47.5 30", "N 47 N", "8 30 O", "abc", ""])
def test_other_angles_are_refused(text):
    with pytest.raises(ValueError, match=r"degrees|minutes"):
        degrees(text)


def test_an_excel_sheet_is_a_table(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Name", "Easting (m)", "Northing (m)", "Height (m)", "Type"])
    for (name, *xyz), role in zip(ROWS, ("GCP", "Check", "GCP"), strict=True):
        book.active.append([int(name), *xyz, role])
    book.save(tmp_path / "list.xlsx")
    project = with_control(block(), tmp_path / "list.xlsx", {"control": (0.01,)}, None)
    assert [project.block.point_ids[row] for row in project.checks] == ["102"]
    np.testing.assert_array_equal(
        project.block.point_positions[project.block.point_ids.index("103")], ROWS[2][1:]
    )
    (tmp_path / "damaged.xlsx").write_bytes((tmp_path / "list.xlsx").read_bytes()[:200])
    with rejected("file.workbook BadZipFile: File is not a zip file"):
        with_control(block(), tmp_path / "damaged.xlsx", {}, None)


def test_results_are_a_workbook_whose_text_is_never_a_formula(run, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    assert run("new", "own").exit_code == 0
    for name in ("images", "points", "control"):
        path = tmp_path / "own" / f"{name}.csv"
        if path.exists():
            path.write_text(path.read_text().replace("t01", "=1+1"))
    done = run("adjust", "own", "--xlsx", "result.xlsx", "-q")
    assert done.exit_code == 0, done.output
    book = openpyxl.load_workbook(tmp_path / "result.xlsx")
    rows = list(book["points"].iter_rows())
    assert [cell.value for cell in rows[0]][:2] == ["point", "kind"]
    table = pd.read_csv(tmp_path / "own-adjusted" / "points.csv", comment="#")
    assert len(rows) == len(table) + 1
    named = next(row[0] for row in rows if row[0].value == "=1+1")
    assert named.data_type != "f"
    assert any("unit" in str(row[1].value) for row in book["notes"].iter_rows())


def test_photos_of_a_table_gnss_may_stand_under_label(tmp_path):
    from photogram.formats.plain.settings import Settings
    from photogram.formats.plain.tables import Tables

    path = tmp_path / "gnss.csv"
    path.write_text("Label,X/Easting,Y/Northing,Z/Altitude,Accuracy_X/Y/Z_(m)\na.jpg,1,2,3,0.5\n")
    table = Tables(Settings(path, tables={"gnss": path}), []).read("gnss")
    assert table.texts("photo") == ["a.jpg"]
    assert table.numbers("sd").tolist() == [0.5]
