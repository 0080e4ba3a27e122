"""Documents: a table that is declared once, in all forms, and documents of several things in layers."""

import csv
import gc
import json
import re
import zlib
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import photogram
from photogram.io import json as json_files
from photogram.show import html, quantity
from photogram.show.forms import record, table_text, text, titled_lines, to_json, written
from photogram.show.methods import Documented
from photogram.show.page import (
    Column,
    Document,
    Drawing,
    Fact,
    Facts,
    Judgement,
    Layers,
    Remarks,
    Section,
    Table,
    Text,
    layered,
)
from photogram.show.quantity import Axis, Quantity, for_people, records
from photogram.words import words_of

AXES = (Axis.of("x", "m"), Axis.of("y", "m"))
VALUES = np.array([[1.25, -2.5], [3.0, 4.0]])
DEVIATIONS = np.array([[0.01, 0.02], [0.01, np.nan]])


def table(values=VALUES):
    """Return points with standard deviations and tests; that of the second point is marked."""
    columns = [
        Quantity(np.array(["P1", "P2"], dtype=object), (), "name", "id", "id", head="Point"),
        Quantity(values, AXES, "value", "position", "position", head="{}"),
        Quantity(DEVIATIONS, AXES, "deviation", "sd", "sd", head="sd {}"),
        Quantity(np.array([0.5, 9.0]), head="t", decimals=1, marked=np.array([False, True])),
    ]
    return quantity.Table("points", "Points", columns, "Two points.", "In metres.", DEVIATIONS)


def document(name="A", values=VALUES, tone="good"):
    return Document(
        "Survey",
        name,
        [Judgement("Usable", f"{name} can be used", (), tone)],
        ["Measure again.", f"Look at {name}."],
        [Fact("rms", "3", "µm")],
        [Section.of(table(values))],
        {"name": name, "values": values, "limit": np.inf},
    )


def test_a_table_is_declared_once_for_all_forms():
    declared = table()
    rows = records(declared.columns)
    assert rows[0] == {"id": "P1", "position": [1.25, -2.5], "sd": [0.01, 0.02]}
    frame = declared.frame()
    assert list(frame.columns) == ["id", "position_x", "position_y", "sd_x", "sd_y"]
    np.testing.assert_array_equal(frame[["position_x", "position_y"]], VALUES)
    comment, *lines = declared.csv().decode().splitlines()
    assert comment == "# unit of position_x, position_y, sd_x, sd_y: m"
    (_, second) = csv.DictReader(lines)
    assert second == {"id": "P2", "position_x": "3.0", "position_y": "4.0", "sd_x": "0.01", "sd_y": ""}


def test_only_json_creates_large_members():
    calls = []

    def members():
        calls.append(1)
        return {"name": "A", "log": {"level": 0.05}}

    log = replace(table(), key="log.points")
    hidden = replace(table(), key="hidden", columns=for_people(table().columns))
    whole = Document("Survey", "A", sections=[Section.of(log), Section.of(hidden)], members=members)
    whole = whole.with_members(lambda: {"more": [1]})
    assert "P1" in text(whole)
    assert "P1" in html.page_html(whole).decode()
    assert not calls
    written_members = json.loads(to_json(whole))
    assert len(calls) == 1
    assert list(written_members) == ["program", "name", "log", "more"]
    assert written_members["log"]["level"] == 0.05
    assert [row["id"] for row in written_members["log"]["points"]] == ["P1", "P2"]


def test_a_json_document_leaves_the_search_for_cycles_as_it_was():
    for enabled in (True, False):
        (gc.enable if enabled else gc.disable)()
        try:
            to_json(document())
            assert gc.isenabled() is enabled
        finally:
            gc.enable()


def test_text_and_page_write_the_same_cells():
    declared = table()
    cells = written(declared)
    heads, *rows = table_text(cells)
    assert heads.split() == ["Point", "x", "m", "y", "m", "sd", "x", "m", "sd", "y", "m", "t"]
    assert [row.split() for row in rows] == [
        ["P1", "1.250", "-2.500", "0.010", "0.020", "0.5"],
        ["P2", "3.000", "4.000", "0.010", "-", "9.0*"],
    ]
    by_hand = Document("Survey", "A", [], [], [], [Section("points", "Points", [cells], "In metres.")])
    by_key = Document("Survey", "A", [], [], [], [Section.of(declared)])
    assert html.page_html(by_hand) == html.page_html(by_key)


def test_the_report_has_every_part_of_a_document():
    parts = [
        Facts("Size", [Fact("Photos", "15"), Fact("Length", "3", "µm", "of a pixel")]),
        Layers("layers", [table()]),
        Text("A paragraph. " * 20),
        Remarks(["First remark.", "Second remark."]),
    ]
    lines = text(
        document().with_sections(Section("more", "More", parts), Section("empty", "Nothing", []))
    ).splitlines()
    assert lines[0].split() == ["photogram", photogram.__version__, "Survey", "A"]
    heads = [line for line, below in pairwise(lines) if below and set(below) == {"-"}]
    assert heads == ["Verdict", "What to do next", "Key figures", "Points", "More"]
    for expected in (
        "Measure again.",
        "rms 3 um",
        "length 3 um (of a pixel)",
        "Two points.",
        "Second remark.",
    ):
        assert expected in (" ".join(line.split()) for line in lines)
    (rows,) = {tuple(table_text(written(table())))}
    assert [line for line in lines if line in rows] == [*rows, *rows]
    assert max(map(len, lines)) <= 100


def test_people_see_the_chosen_rows_and_components():
    whole = table()
    some = written(replace(whole, shown=np.array([1])))
    assert [*some.columns[0].cells] == ["P2"]
    components = written(replace(whole, shown=np.array([[0, 1], [1, 0]])))
    cells = {column.head: [*column.cells] for column in components.columns}
    assert (cells["Point"], cells["Component"]) == (["P1", "P2"], ["y", "x"])
    assert len(records(replace(whole, shown=np.array([1])).columns)) == 2


def test_a_pdf_document_has_declared_tables():
    pytest.importorskip("typst")
    from photogram.show.pdf import page_pdf

    declared = table()
    by_hand = Document(
        "Survey", "A", [], [], [], [Section("points", "Points", [written(declared)], "In metres.")]
    )
    by_key = Document("Survey", "A", [], [], [], [Section.of(declared)])
    assert page_pdf(by_hand) == page_pdf(by_key)


def test_a_pdf_document_is_tagged_and_contains_its_fonts():
    pytest.importorskip("typst")
    from photogram.show.pdf import FONTS, page_pdf

    whole = layered(
        "Surveys", "both", [document("A"), document("B", 2 * VALUES, "bad")], words=words_of("de")
    )
    content = page_pdf(whole, author="Survey Office")
    assert content == page_pdf(whole, author="Survey Office")
    entries = (r"/Lang\s?\(de\)", r"/Title\s?\(both\)", r"/Author\s?\(Survey Office\)", "/StructTreeRoot")
    for entry in entries:
        assert re.search(entry.encode(), content), entry
    assert b"/CreationDate" not in content
    fonts = re.findall(rb"/FontDescriptor\s*/FontName\s?/[A-Z]{6}[+](\w+)-", content)
    assert {name.decode() for name in fonts} == {FONTS[0].replace(" ", "")}
    assert content.count(b"/FontFile3") == len(fonts)


def test_a_pdf_document_repeats_heads_of_tables_and_begins_annexes_on_pages():
    pytest.importorskip("typst")
    from photogram.show.pdf import page_pdf

    names = [f"P{k}" for k in range(150)]
    long = Table("Points", [Column("Point", names, text=True), Column("x", ["1.000"] * 150, "m")])
    parts = [Section("note", "", [Text("One line.")]), Section("points", "Points", [long], annex=True)]
    pages = drawn_pages(page_pdf(Document("Survey", "A", [], [], [], parts)))
    # The rule below a head is the only line of this width.
    assert [b"0.8 w" in page for page in pages] == [False, *[True] * (len(pages) - 1)]
    assert len(pages) > 3


@pytest.mark.parametrize(
    "name", ["#panic() $x$ *b* <l> @r \\", "\x00\x07", "caf\udce9", "写真", "0123456789abcdef" * 40, ""]
)
def test_a_pdf_document_has_any_name(name):
    pytest.importorskip("typst")
    from photogram.show.pdf import page_pdf

    empty, columns = [Column(name, [], text=True)] * 80, [Column(name, [name] * 2, text=True)] * 80
    parts = [Table(name, []), Table(name, empty), Table("", columns, name)]
    parts += [Facts(name, [Fact(name, name, name, name)]), Text(name), Remarks([name]), Layers("l", [*parts])]
    judgement = Judgement(name, name, [name], "bad", name)
    whole = Document(name, name, [judgement], [name], [Fact(name, name)], [Section("s", name, parts, name)])
    assert page_pdf(whole, author=name).startswith(b"%PDF")


def drawn_pages(content):
    """Return the drawing commands of the pages of a PDF document, in their order."""
    pages = re.findall(rb"/Type\s?/Page\b.*?/Contents (\d+) 0 R", content, re.DOTALL)
    found = []
    for number in pages:
        stream = re.search(rb"\n%s 0 obj\s<<.*?>>\s?stream\n(.*?)\nendstream" % number, content, re.DOTALL)
        found.append(zlib.decompress(stream[1]))
    return found


def test_a_json_document_has_members_and_tables():
    made = json.loads(to_json(document()))
    assert set(made) == {"program", "name", "values", "limit", "points"}
    assert made["limit"] is None
    assert made["points"] == json.loads(json_files.to_json(records(table().columns)))


def test_a_summary_has_judgement_advice_tables_by_key_and_highlights():
    verdict, advice, figures, (title, lines) = titled_lines(document(), ["points"])
    assert verdict == ("Verdict", ["A can be used."])
    assert advice == ("What to do next", ["Measure again.", "Look at A."])
    assert [line.split() for line in figures[1]] == [["rms", "3", "um"]]
    assert (title, lines[-1]) == ("Points", "Two points.")
    assert titled_lines(document(), []) == [verdict, advice, figures]


def test_documents_of_several_things_are_layers_of_one():
    parts = [document("A"), document("B", 2 * VALUES, "bad")]
    whole = layered("Surveys", "both", parts, members={"all": [record(each) for each in parts]})
    (section,) = whole.sections
    (layers,) = section.parts
    assert isinstance(layers, Layers)
    assert (section.key, section.intro) == ("points", "In metres.")
    assert [layer.title for layer in layers.parts] == ["A", "B"]
    assert [(each.on, each.tone) for each in whole.judgements] == [("A", "good"), ("B", "bad")]
    assert whole.advice == ["Measure again.", "Look at A.", "Look at B."]
    assert [fact.name for fact in whole.highlights] == ["rms, A", "rms, B"]
    assert [each["points"][1]["position"] for each in record(whole)["all"]] == [[3.0, 4.0], [6.0, 8.0]]
    assert not whole.tables()
    assert not layered("Surveys", "none", []).sections


def test_a_result_with_a_document_needs_no_other_definition():
    class Survey(Documented):
        """A result outside the package."""

        def document(self):
            return document()

    assert Survey().document().sections[0].key == "points"
    assert json.loads(Survey().to_json())["name"] == "A"
    assert b"Points" in Survey().to_html()


def test_details_are_in_the_report_and_in_json_but_not_on_the_page():
    declared = replace(table(), key="details", title="All points", keyed=True)
    made = replace(document(), details=[Section.of(declared)])
    assert record(made)["details"]["P1"] == {"position": [1.25, -2.5], "sd": [0.01, 0.02]}
    assert made.table("details") is declared
    assert "All points" in text(made)
    assert b"All points" not in html.page_html(made)


def test_a_section_of_plots_only_is_not_in_the_text():
    plots = [Drawing(f"plot-{k}", "", "", lambda: None) for k in range(2)]
    section = Section("pictures", "Pictures", [Layers("layers", plots)])
    assert titled_lines(Document("Survey", "", sections=[section])) == []
