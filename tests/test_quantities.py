"""Quantities that are declared once, as text, on a page and in a document."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from photogram import InputError, adjust, formats
from photogram.cli.console import SHOWN, print_document
from photogram.formats.results import excel_file, table_files
from photogram.io import json
from photogram.results.statement.texts import Texts
from photogram.results.tables import TABLES
from photogram.show.forms import fact_lines, record, text, titled_lines, written
from photogram.show.html import page_html
from photogram.show.page import Document, Fact, Layers, Section, probability_written
from photogram.show.quantity import (
    Axis,
    Quantity,
    Table,
    component,
    members_of_each,
    of_each,
    records,
    unit_comments,
)

EXAMPLE = Path(formats.__file__).parents[1] / "examples" / "project"
AXES = (Axis.turned("omega", "deg"), Axis.of("s", "mm / m"), Axis.of("b1", "mm"))
OF = np.arange(3)
VALUES = Quantity(np.array([0.5, 0.25, 292719.3]), AXES, "value", head="Value", figures=6, of=OF)
SD = Quantity(np.array([1e-5, 0.0, 17.1]), AXES, "deviation", head="sd", words={0.0: "held"}, of=OF)


def test_components_of_different_units_share_a_column_each_with_its_own_decimals():
    table = written(Table("", "", [component(AXES, OF)[0], VALUES, SD], deviations=SD.values))
    rows = [[*row] for row in zip(*(column.cells for column in table.columns), strict=True)]
    # Two figures of 2.1 seconds of arc, of degrees four more; significant figures where nothing is known.
    assert rows[0] == ["omega, ″", "28.64789", "2.06"]
    assert rows[1] == ["s, mm / m", "0.250000", "held"]
    assert rows[2] == ["b1, mm", "292719", "17.1"]


def test_what_is_to_be_looked_at_is_marked():
    marked = np.array([False, True])
    tests = Quantity(np.array([1.0, -6.6]), head="t", decimals=2, marked=marked)
    (column,) = written(Table("", "", [tests])).columns
    assert column.toned == [("1.00", ""), ("-6.60", "look")]


def test_facts_are_lines():
    facts = [Fact("Status", "converged", note="method rigorous"), Fact("rms of residuals", "0.5", "mm")]
    expected = [("status", "converged (method rigorous)"), ("rms of residuals", "0.5 mm")]
    assert fact_lines(facts) == [f"{name:<36}{text}" for name, text in expected]


@dataclass
class Term:
    """A thing with attributes."""

    name: str
    sd_um: float
    probability: float | None


def test_an_attribute_of_many_things_is_a_quantity():
    things = [Term("x^2", 0.5, None), Term("y^2", 0.25, 0.05)]
    um = (Axis.of("", "um"),)
    table = [
        of_each(things, "name", kind="name", head="Term"),
        of_each(things, "sd_um", um, "deviation", head="sd", decimals=3),
        of_each(things, "probability", member="p", head="p", decimals=2),
    ]
    assert records(table)[1] == {"name": "y^2", "sd_um": 0.25, "p": 0.05}
    page = written(Table("", "", table))
    assert [(column.head, column.unit) for column in page.columns] == [("Term", ""), ("sd", "µm"), ("p", "")]
    assert [column.cells for column in page.columns] == [["x^2", "y^2"], ["0.500", "0.250"], ["", "0.05"]]


def test_documents_take_arrays_however_they_lie_and_data_classes():
    document = {"across": np.arange(6.0).reshape(2, 3)[:, :2].T, "term": Term("x", np.nan, None)}
    text = json.to_json(document).decode()
    assert "".join(text.split()) == (
        '{"across":[[0.0,3.0],[1.0,4.0]],"term":{"name":"x","sd_um":null,"probability":null}}'
    )
    with pytest.raises(TypeError):
        json.to_json({"path": object()})


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (KeyError("scale"), "the document must describe a camera, but 'scale' is missing"),
        (TypeError("not so"), "the document must describe a camera, but a member has a wrong type"),
        (InputError("is withheld"), "is withheld"),
    ],
)
def test_a_document_that_is_another_is_named(error, said):
    with pytest.raises(InputError, match=f"a.json: {said}") as caught, json.holding("camera", Path("a.json")):
        raise error
    assert caught.value.file == Path("a.json")


def test_only_columns_with_a_dimension_have_a_unit():
    result = adjust(formats.read(EXAMPLE).block)
    pairs = {"d_X", "d_Y", "d_Z", "sd_X", "sd_Y", "sd_Z"}
    first = table_files(result)["control.csv"].decode().splitlines()[0]
    assert set(first.removeprefix("# unit of ").removesuffix(": m").split(", ")) == pairs
    openpyxl = pytest.importorskip("openpyxl")
    notes = openpyxl.load_workbook(io.BytesIO(excel_file(result)))["notes"]
    assert ("control", first.removeprefix("# ")) in list(notes.iter_rows(values_only=True))
    for what, table in TABLES.items():
        numbers = {each.name for each in table(result) if each.kind == "number" and each.name}
        comments = [line.removeprefix("unit of ") for line in unit_comments(table(result))]
        named = [name for line in comments for name in line.rpartition(": ")[0].split(", ")]
        assert not [name for name in named if name.split("_")[0] in numbers], what


@pytest.mark.parametrize(
    ("p", "text"), [(1.0, "1"), (0.0312, "0.031"), (1.24e-61, "1.2e-61"), (0.0, "< 1e-99")]
)
def test_probabilities_are_written_by_one_rule(p, text):
    assert probability_written(p) == text
    assert Texts("en").probability(p) == text
    assert Texts("de").probability(p) == text.replace(".", ",")


def test_a_table_may_be_a_part_of_a_member_and_one_without_rows_is_only_in_json():
    numbers = [Quantity(np.arange(2), member="number", head="Number")]
    nothing = Table("fit.terms", "Absent terms", [Quantity(np.zeros(0), member="term", head="Term")])
    sections = [Section.of(Table("numbers", "Numbers", numbers)), Section.of(nothing)]
    document = Document("", "", [], [], [], sections, {"fit": {"sigma0": 1.0}})
    assert record(document) == {
        "fit": {"sigma0": 1.0, "terms": []},
        "numbers": [{"number": 0}, {"number": 1}],
    }
    assert document.members == {"fit": {"sigma0": 1.0}}
    assert document.table("fit.terms") is nothing
    assert "Absent" not in text(document)
    assert b"Absent" not in page_html(document)


def test_parts_of_many_things_are_columns_of_json():
    rows = members_of_each([VALUES, SD], "kind", size="values.size")
    assert records(rows) == [{"kind": "value", "size": 3}, {"kind": "deviation", "size": 3}]
    assert records(members_of_each([], "kind")) == []


def test_a_command_prints_the_first_rows_of_its_tables_also_of_those_in_layers(capsys):
    table = Table("rows", "Rows", [Quantity(np.arange(SHOWN + 1), head="Row")])
    parts = [Layers("layers", [table]), Table("others", "Others", table.columns)]
    document = Document("What", "", [], [], [], [Section("section", "Rows", parts)])
    assert len(titled_lines(document, ["section"])[0][1]) > 2 * SHOWN
    print_document(document, "report.txt", "rows")
    first, _, title, head, *rows = capsys.readouterr().out.splitlines()
    assert (first, title, head.strip()) == ("What", "Rows", "Row")
    assert [line.strip() for line in rows[-2:]] == [str(SHOWN - 2), "and 2 more lines in report.txt"]
    assert table not in document.tables()
    assert document.table("rows") is table
