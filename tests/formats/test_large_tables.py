"""Large tables are read piece by piece: with the values of small ones, in memory of a few pieces."""

import subprocess
import sys

import numpy as np
import pytest

from message_codes import rejected
from peak import peak_of
from photogram import _photocore, formats
from photogram.io import delimited
from photogram.io.delimited import read_columns

ROWS = 60_000


def lines(count):
    return [f"photo{row // 100}, p{row % 977} ,{row / 8},{-row / 4}" for row in range(count)]


def written(path, rows, encoding="utf-8", end="\n"):
    path.write_bytes(end.join(["# measured", "photo,point,column,row", *rows, ""]).encode(encoding))
    return path


def read(path, known=("photo",)):
    return read_columns(path, known=known, numbers=("column", "row"))


def is_quick(table):
    """Return whether the extension module read a table."""
    return isinstance(table.cells["column"], np.ndarray)


def content(table):
    names = [table.names(each) for each in ("photo", "point")]
    numbers = [table.numbers(each).tolist() for each in ("column", "row")]
    return [(each.names, each.rows.tolist()) for each in names], numbers, list(table.records), table.headings


@pytest.fixture
def pieces(monkeypatch):
    monkeypatch.setattr(delimited, "LARGE", 1000)
    monkeypatch.setattr(delimited, "PIECE", 700)


@pytest.mark.parametrize(("encoding", "end"), [("utf-8", "\n"), ("utf-8-sig", "\r\n"), ("cp1252", "\r\n")])
def test_pieces_have_the_values_of_the_whole(tmp_path, monkeypatch, pieces, encoding, end):
    path = written(tmp_path / "images.csv", [*lines(500), "Süd,p1,,2.5"], encoding, end)
    fast = read(path)
    assert is_quick(fast)
    monkeypatch.setattr(delimited, "LARGE", 1 << 30)
    slow = read(path)
    assert not is_quick(slow)
    assert str(content(fast)) == str(content(slow))


@pytest.mark.parametrize(
    ("row", "text", "said"),
    [
        (400, "a,b,wide,1", "column column"),
        (400, "a,b,1", "cells"),
        (0, "a,b,1,2,3", "cells"),
        (77, "\0", "cells"),
    ],
)
def test_a_fault_in_any_piece_has_its_record(tmp_path, pieces, row, text, said):
    rows = lines(500)
    rows[row] = text
    path = written(tmp_path / "images.csv", rows)
    with rejected(said) as found:
        read(path).given(("column", "row"))
    assert (found.value.file, found.value.record) == (path, row + 3)


@pytest.mark.parametrize("extra", ["", "# later", "\n\n"])
def test_blank_lines_and_comments_keep_the_numbers_of_records(tmp_path, pieces, extra):
    path = written(tmp_path / "images.csv", [*lines(300), extra, *lines(10), "", ""])
    table = read(path)
    assert (table.count, table.records[-1]) == (310, 313 + extra.count("\n"))


WHOLE = [f"{7 * row % 997}" for row in range(300)]
LARGEST = [str(2**63 - 1), str(2**63), "-3", "18446744073709551616"]


@pytest.mark.parametrize(
    ("names", "count"),
    [
        (WHOLE, 300),
        ([*WHOLE, "point", *WHOLE, "7"], 301),
        ([*WHOLE, "007", *WHOLE], 301),
        (["007", *WHOLE, "7 ", " 7"], 301),
        ([*WHOLE, "+7", "-0", "00", "0", "-7"], 304),
        ([*WHOLE, "  7", "\t7", "7  ", '"7"', '" 7 "'], 300),
        ([*WHOLE, "7.0", "7e0", "1_4", "true", "Inf"], 305),
        ([*WHOLE, *LARGEST, *WHOLE], 304),
        (["point a", *WHOLE], 301),
    ],
)
@pytest.mark.parametrize(
    ("head", "row"), [("name,column,row", "{},1.5,-0.5"), ("column,row,name", "01,0,{}")]
)
def test_names_of_whole_numbers_are_texts(tmp_path, monkeypatch, pieces, names, count, head, row):
    path = tmp_path / "images.csv"
    path.write_text("\n".join([head, *map(row.format, names), ""]))
    fast = read(path, known=("name",))
    assert is_quick(fast)
    monkeypatch.setattr(delimited, "LARGE", 1 << 30)
    slow = read(path, known=("name",))
    assert not is_quick(slow)
    assert len(fast.names("name").names) == count
    assert fast.texts("name") == slow.texts("name")
    assert fast.names("name").names == slow.names("name").names
    assert fast.names("name").rows.tolist() == slow.names("name").rows.tolist()
    assert fast.numbers("row").tolist() == slow.numbers("row").tolist()


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("", "error.column point: error.no-name"),
        ("nan", "error.column point: error.no-name nan"),
        ("  ", "error.column point: error.no-name"),
    ],
)
def test_a_cell_without_a_name_below_whole_numbers_has_its_record(tmp_path, pieces, cell, said):
    path = written(tmp_path / "images.csv", [*(f"a,{name},1,2" for name in WHOLE), f"a,{cell},1,2"])
    with rejected(said) as found:
        read(path).names("point")
    assert (found.value.file, found.value.record) == (path, len(WHOLE) + 3)


@pytest.mark.parametrize(
    "rows",
    [
        ['"a",1.5,2', '"b, c" ,"2.5", 3', ' " d ",-0,+1e3'],
        ["a,1.,.5,", "b,1,2,  ", "c,0001,-1E-3"],
        ["a;1,5;2", "b;3;-2,25"],
        ["a;1.5;2", "b;3;-2.25"],
        ["a\t1,500\t2", " b \t\t3\t"],
        ["ä|1|2", "Ä |3|4", "\u00a0ä|5|6"],
        ["x1|1|2", "X2|3|4", "nano|5|6", "7|8|9"],
    ],
)
@pytest.mark.parametrize(("encoding", "end"), [("utf-8", "\n"), ("cp1252", "\r\n")])
def test_regular_lines_have_the_values_of_single_lines(tmp_path, monkeypatch, rows, encoding, end):
    path = tmp_path / "images.csv"
    delimiter = next(each for each in "\t;|," if each in rows[0])
    head = delimiter.join(["name", "column", "row"])
    path.write_bytes(end.join([head, *rows, *rows, ""]).encode(encoding))
    slow = read(path, known=("name",))
    monkeypatch.setattr(delimited, "LARGE", len(head) + 2)
    fast = read(path, known=("name",))
    assert (is_quick(slow), is_quick(fast)) == (False, True)
    assert fast.texts("name") == slow.texts("name")
    for each in ("column", "row"):
        np.testing.assert_array_equal(fast.numbers(each), slow.numbers(each))


@pytest.mark.parametrize(
    "row",
    [
        "a;1.5;2,5",
        "a;1.500,5;2",
        "a;1 000;2",
        "a;nan;2",
        "a;1e999;2",
        'a"b";1;2',
        'a;"1;2',
        "a;1;2;3",
        "a;1",
        "a\rb;1;2",
        "a;1;2\r\r",
        "\x1fa;1;2",
        f"a;{'0' * 1001};2",
        f"{'a' * 100_000};1;2",
    ],
)
def test_irregular_lines_are_read_one_by_one(row):
    reader = _photocore.TableReader(ord(";"), [False, True, True])
    assert reader.add(b"b;1.5;2\r\n")
    assert not reader.add(f"{row}\nb;1;2\n".encode())
    assert not reader.add(b"b;1;2\n")
    assert reader.columns() == []


def test_large_tables_are_read_without_a_data_frame(tmp_path):
    path = written(tmp_path / "images.csv", [f"photo{row},point{row},1,2" for row in range(ROWS)])
    program = (
        "import sys, pathlib; from photogram.io.delimited import read_columns\n"
        f"table = read_columns(pathlib.Path({str(path)!r}), numbers=('column', 'row'))\n"
        "print(table.count, isinstance(table.cells['column'], list), 'pandas' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert done.stdout.split() == [str(ROWS), "False", "False"]


def test_memory_is_less_than_twice_the_file(tmp_path, monkeypatch):
    monkeypatch.setattr(delimited, "LARGE", 1 << 16)
    monkeypatch.setattr(delimited, "PIECE", 1 << 16, raising=False)
    path = written(tmp_path / "images.csv", lines(ROWS))
    read(path)
    table, peak = peak_of(lambda: read(path))
    assert table.count == ROWS
    assert peak < 2 * path.stat().st_size


def test_images_of_a_project_are_shared_by_table_and_block(tmp_path):
    photos = 40
    rows = [
        f"photo{row % photos},p{row // photos},{row % 3900 + 1}.5,{row % 2900 + 1}.25" for row in range(ROWS)
    ]
    written(tmp_path / "images.csv", rows)
    (tmp_path / "cameras.csv").write_text(
        "camera,model,width,height,f,cx,cy\nc,opencv,4000,3000,3000,2000,1500\n"
    )
    poses = "".join(f"photo{k},c,{10 * k},0,100,0,0,0\n" for k in range(photos))
    (tmp_path / "photos.csv").write_text("photo,camera,x,y,z,omega,phi,kappa\n" + poses)
    (tmp_path / "project.toml").write_text("[project]\nformat = 1\n[sd]\nimages = 0.5\n")
    formats.read(tmp_path)
    block, peak = peak_of(lambda: formats.read(tmp_path).block)
    assert np.ptp(block.image_sd) == 0
    own = sum(
        each.nbytes for each in (block.image_xy, block.image_sd, block.image_photos, block.image_points)
    )
    assert peak < 3.5 * own


def test_a_project_has_no_dictionary_of_all_points(tmp_path):
    written(tmp_path / "images.csv", [f"photo1,point{row},{row % 3900}.5,{row / 64}" for row in range(ROWS)])
    (tmp_path / "cameras.csv").write_text(
        "camera,model,width,height,f,cx,cy\nc,opencv,4000,3000,3000,2000,1500\n"
    )
    (tmp_path / "photos.csv").write_text("photo,camera,x,y,z,omega,phi,kappa\nphoto1,c,0,0,100,0,0,0\n")
    (tmp_path / "control.csv").write_text(
        "point,x,y,z,sd_x,sd_y,sd_z\npoint7,-50,0,0,1,1,1\nnew,50,0,0,1,1,1\n"
    )
    (tmp_path / "project.toml").write_text("[project]\nformat = 1\n[sd]\nimages = 0.5\n")
    formats.read(tmp_path)
    block, peak = peak_of(lambda: formats.read(tmp_path).block)
    assert (block.point_ids[7], block.point_ids[-1]) == ("point7", "new")
    assert np.flatnonzero(np.isfinite(block.point_sd[:, 0])).tolist() == [7, ROWS]
    # A dictionary of all names needs 60 bytes more for each.
    assert peak < 345 * ROWS
