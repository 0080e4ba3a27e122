"""Labels in PVL."""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from golden_data import shared
from message_codes import rejected
from photogram import InputError
from photogram.io.pvl import Group, Quantity, label_text, parsed

FILE = Path("some.lbl")

LABEL = """
Object = IsisCube
  /* Where the core is,
     and how large. */
  Object = Core
    StartByte   = 65537
    Format      = Tile   # as tiles
    ^QUBE       = ("some file.img", 3)
    Bands       = {1, 2.5 <nm>,
                   x} <um>
    Rows = 007; Mask = 16#FF#
  End_Object = Core
  Group = Instrument
    SpacecraftClockStartCount = 1/269182000:51104
    StartTime = 2009-07-12T11:30:00.25
    Exposure  = -1.5e-3 <ms>
    Note      = "told over
                 two lines, or split like th-
                 is"
    Path      = $base/very/long/na-
                me
    Empty     = ""
    Key = 1
    key = '2'
  End_Group
End_Object
End
Not = looked at ]]]
"""


def test_a_label_is_read_with_all_that_it_says():
    label = parsed(LABEL, FILE)
    (cube,) = label.groups("isiscube")
    assert (cube.kind, cube.name, cube.line) == ("object", "IsisCube", 2)
    assert [each.name for each in cube.inside] == ["Core", "Instrument"]
    core, instrument = cube.inside
    assert core.items == [
        ("StartByte", 65537),
        ("Format", "Tile"),
        ("^QUBE", ["some file.img", 3]),
        ("Bands", Quantity([1, Quantity(2.5, "nm"), "x"], "um")),
        ("Rows", "007"),
        ("Mask", 255),
    ]
    assert instrument.get("SpacecraftClockStartCount") == "1/269182000:51104"
    assert instrument.get("starttime") == "2009-07-12T11:30:00.25"
    assert instrument.get("Exposure") == Quantity(-1.5e-3, "ms")
    assert instrument.get("Note") == "told over two lines, or split like this"
    assert instrument.get("Path") == "$base/very/long/name"
    assert instrument.get("Empty") == ""
    assert [value for key, value in instrument.items if key.lower() == "key"] == [1, "2"]
    assert instrument.get("absent") is None
    assert parsed("", FILE).items == []


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("A = 1\nB =\nC = 2\n", 2, "pvl.value B"),
        ("A = 1\nB\nC = 2\n", 2, "pvl.value B"),
        ("A = (1, 2\nB = 3", 1, "pvl.list A"),
        ("Group = A\n B = 1\nEnd_Object\n", 3, "pvl.end End_Object"),
        ("Group = A\n B = 1\nEnd_Group = C\n", 3, "pvl.open group A"),
        ("Group = A\n B = 1\nEnd\n", 3, "pvl.open group A"),
        ('A = 1\nB = "open\n', 2, 'pvl.text "open'),
        ("A = 1\n= 2\n", 1, "pvl.value A"),
        ("A = " + 40 * "(" + 40 * ")", 1, "error.nested"),
        ("A = 1 /* open\nB = 2", 1, "pvl.text /* open"),
    ],
)
def test_what_is_no_label_is_told_with_its_line(text, line, said):
    with rejected(said) as caught:
        parsed(text, FILE)
    assert (caught.value.record, caught.value.file) == (line, FILE)


@given(st.text("ab=(){}<>\"'#/*- \n1.;,\x00"))
def test_any_text_is_read_or_refused(text):
    with suppress(InputError):
        assert parsed(text, FILE).kind == "label"


def shape(group):
    """Return all that a group says, without its lines."""
    return group.name, group.kind, group.items, [shape(each) for each in group.inside]


def test_a_label_is_written_as_it_was_read():
    label = parsed(LABEL, FILE)
    written = label_text(label)
    assert shape(parsed(written, FILE)) == shape(label)
    assert label_text(parsed(written, FILE)) == written
    assert "    StartByte = 65537\n    Format    = Tile\n" in written
    words = dict(parsed("A = 1.50\nB = '2'\nC = (007, 8)\n", FILE, numbers=False).items)
    assert words == {"A": "1.50", "B": "2", "C": ["007", "8"]}


VALUES = st.one_of(
    st.integers(-(10**17), 10**17),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(codec="utf-8", exclude_characters='"\n\r', exclude_categories=["Cc", "Cs"])),
)


@example("{")
@example(["("])
@given(VALUES | st.lists(VALUES) | st.builds(Quantity, VALUES, st.just("km")))
def test_values_come_back(value):
    label = Group("", "label", items=[("key", value)])
    assert parsed(label_text(label), FILE).items == label.items


@pytest.mark.parametrize("text", ["two\nlines", "both ' and \""])
def test_a_text_that_no_marks_hold_is_refused(text):
    with rejected("pvl.text-written"):
        label_text(Group("", "label", items=[("key", text)]))


def test_a_published_network_is_a_label():
    text = shared("moving", "lro", "observationPair.net").read_text(encoding="utf-8")
    (network,) = parsed(text, FILE).groups("ControlNetwork")
    assert len(network.groups("ControlPoint")) == 46
    assert network.get("Version") == 5
    assert network.inside[0].get("AprioriX") == Quantity(1540508.4661565, "meters")
