"""Messages on damaged files name file, record, element or option, and the value."""

import json
import shutil
from importlib.resources import files
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from message_codes import coded, fields_of, has_code
from photogram import InputError, formats
from photogram.absolute_orientation import read_csv, read_similarity
from photogram.absolute_orientation.stations import read_transformation
from photogram.arguments.arrays import matrix_fault, shaped
from photogram.comparator import Correction
from photogram.io.json import read_json
from photogram.io.numbers import whole_number
from photogram.io.parquet import read_sheet
from photogram.io.toml import read_toml
from photogram.network.geometry import rotation_fault
from photogram.perspective_center import run_deck
from photogram.targets.board import read_board

EXAMPLES = Path(str(files("photogram") / "examples"))
STATIONS = EXAMPLES / "absolute_orientation" / "stations.csv"


@pytest.fixture
def correction() -> dict[str, object]:
    plain = Correction(1.0, 1.0, 0.0, covariance=np.diag([1e-12] * 3 + [0.0] * 18))
    return json.loads(plain.to_json())


def refused(read, path: Path, content: str | bytes) -> InputError:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(InputError) as raised:
        read(path)
    assert raised.value.file == path
    return raised.value


@pytest.mark.parametrize(
    ("value", "name", "code"),
    [
        ([[1, 2], [1]], "values[1]", "error.count"),
        ([[1], [1, 2], [1, 2]], "values[0]", "error.count"),
        ([[1, 2], [1, "x"]], "values[1][1]", "error.number"),
        ([1, [2]], "values[1]", "error.number"),
        ([[1, 2], 3], "values[1]", "error.list"),
        (np.array([1, "x"], dtype=object), "values[1]", "error.number"),
        (np.array(["x"]), "values", "error.array"),
        ("x", "values", "error.array"),
    ],
)
def test_the_wrong_element_of_an_array_is_named(value, name, code):
    with pytest.raises(InputError) as raised:
        shaped("values", value, (None, 2))
    assert has_code(raised.value, "error.at", what=name, message=code)


@pytest.mark.parametrize(
    ("changes", "elements"),
    [
        ({(0, 1): 0.5}, (0, 1, [0.5, 0.0])),
        ({(2, 2): -3.0}, (2, 2, [-3.0])),
        ({(1, 2): 7.0, (2, 1): 7.0}, (1, 2, [7.0, 7.0])),
        ({(0, 2): np.inf, (2, 0): np.inf}, (0, 2, [np.inf, np.inf])),
        ({(1, 1): 0.0, (1, 2): 0.1, (2, 1): 0.1}, (1, 2, [0.1, 0.1])),
    ],
)
@pytest.mark.parametrize("singular", [False, True])
def test_the_wrong_elements_of_a_covariance_are_named(changes, elements, singular):
    matrix = np.eye(3)
    assert matrix_fault(matrix, singular=singular) is None
    for place, value in changes.items():
        matrix[place] = value
    fault = matrix_fault(matrix, singular=singular)
    row, column, values = elements
    assert has_code(fault, "error.covariance-singular" if singular else "error.covariance")
    assert has_code(fault, "error.elements", row=row, column=column, values=values)


def test_a_covariance_without_a_single_wrong_element():
    matrix = np.full((3, 3), -0.9) + 1.9 * np.eye(3)
    assert has_code(matrix_fault(matrix), "error.covariance", reason=[])


def test_the_wrong_row_of_a_rotation_is_named():
    matrix = np.eye(3)
    assert rotation_fault(matrix) is None
    assert has_code(rotation_fault(-matrix), "format.rotation.mirrored")
    for row in range(3):
        changed = matrix.copy()
        changed[row, row] = 1.1
        assert has_code(rotation_fault(changed), "format.rotation.row", row=row + 1)
    matrix[1, 1] = 1e300
    assert has_code(rotation_fault(matrix), "format.rotation.row", row=2)


def test_a_transformation_that_is_no_rotation(tmp_path):
    error = refused(read_transformation, tmp_path / "two.txt", "1 0 0 0 1 0 X\n0 0 2 1 0 0 0 X\n")
    assert has_code(error, "orientation.rotation")
    assert has_code(error, "format.rotation.row", row=3)


def test_the_line_of_wrong_syntax_in_a_correction(tmp_path, correction):
    lines = json.dumps(correction, indent=2).split("\n")
    error = refused(Correction.read, tmp_path / "c.json", "\n".join([*lines[:4], "a b", *lines[5:]]))
    assert (error.code, error.record, error.text) == ("error.parse", 5, "a b")


def test_the_wrong_elements_in_a_correction(tmp_path, correction):
    path = tmp_path / "c.json"
    correction["covariance"][3][5] = 0.25
    error = refused(Correction.read, path, json.dumps(correction))
    assert has_code(error, "error.elements", row=3, column=5, values=[0.25, 0.0])
    correction["covariance"][3][5] = "x"
    error = refused(Correction.read, path, json.dumps(correction))
    assert has_code(error, "error.at", what="covariance[3][5]", message="error.number")
    del correction["covariance"][7][0], correction["covariance"][3]
    error = refused(Correction.read, path, json.dumps(correction))
    assert has_code(error, "error.at", what="covariance[6]", message="error.count")


def test_the_line_of_a_byte_that_is_not_utf8(tmp_path):
    for name, read in (("a.json", read_json), ("a.toml", read_toml), ("b.json", read_similarity)):
        error = refused(read, tmp_path / name, b'{\n"x": "\xe4"}')
        assert (error.code, error.record) == ("error.encoding", 2)
        assert has_code(error, "error.encoding", byte=8)


def test_the_line_of_settings_that_end_early(tmp_path):
    error = refused(read_toml, tmp_path / "a.toml", "a = 1\nb")
    assert (error.code, error.record, error.text) == ("error.parse", 2, "b")


def test_a_key_is_named_once_and_with_its_line(tmp_path):
    board = 'kind = "chessboard"\ncolumns = 0\nrows = 3\nspacing = 0.1\n'
    error = refused(read_board, tmp_path / "board.toml", board)
    assert (error.record, error.text) == (2, "columns = 0")
    assert has_code(error, "error.at", what="columns", message="error.least")
    board = 'kind = "chessboard"\ncolumns = 5\nrows = 3\nspacing_x = 1e300\nspacing_y = 0.1\n'
    error = refused(read_board, tmp_path / "board.toml", board)
    assert has_code(error, "error.at", what="spacing", message="error.range")
    assert error.record is None  # No line has this key.
    shutil.copytree(EXAMPLES / "project", tmp_path / "project")
    settings = tmp_path / "project" / "project.toml"
    settings.write_text(settings.read_text() + '\n[check]\nindependent = "perhaps"\n')
    with pytest.raises(InputError) as raised:
        formats.read(settings.parent)
    assert raised.value.text == 'independent = "perhaps"'
    assert has_code(raised.value, "error.key", table="check", key="independent", message="error.choice")


def test_reasons_of_libraries_have_one_line(tmp_path):
    path, column = tmp_path / "a.parquet", pyarrow.array([1.0])
    schema = pyarrow.schema([("x", pyarrow.float64()), ("x", pyarrow.float64())])
    pyarrow.parquet.write_table(pyarrow.Table.from_arrays([column, column], schema=schema), path)
    with pytest.raises(InputError, check=coded("error.parse", format="Parquet")) as raised:
        read_sheet(path)
    assert "\n" not in fields_of([raised.value], "error.parse")["reason"]


@pytest.mark.parametrize(
    ("text", "code"), [("-1", "error.whole-range"), ("-0", "error.whole"), ("1.0", "error.whole")]
)
def test_a_negative_count_is_outside_the_range(text, code):
    with pytest.raises(InputError, check=coded(code, value=text)):
        whole_number(text)


@pytest.mark.parametrize("cell", ["1.2.3", "978..7", "1001.2.3481"])
def test_a_wrong_number_does_not_change_the_decimal_mark_of_the_others(tmp_path, cell):
    table = f"id,X,Y,Z,x,y,z\nA,1.25,2.5,3.75,4.25,5.25,6.25\nB,1.25,2.5,3.75,4.25,{cell},6.25\n"
    error = refused(read_csv, tmp_path / "stations.csv", table)
    assert error.record == 3
    assert has_code(error, "error.column", column="y", message="error.number")
    assert has_code(error, "error.number", value=cell)


def test_the_word_that_is_no_number_of_a_collection(tmp_path):
    lines = (EXAMPLES / "collection" / "ring.txt").read_text().splitlines()
    lines[2] += "x"
    error = refused(formats.read, tmp_path / "problem.txt", "\n".join(lines))
    assert (error.code, error.record) == ("collection.not-finite", 3)
    assert has_code(error, "collection.word", word=lines[2].split()[-1])


def test_a_name_that_cannot_be_printed(tmp_path):
    shutil.copytree(EXAMPLES / "project", folder := tmp_path / "project")
    for table in folder.glob("*.csv"):
        table.write_text(table.read_text().replace("t01", "t\x05"))
    with pytest.raises(InputError, check=coded("format.name", what="point", name="t\x05")):
        formats.read(folder)


def test_a_frame_names_an_empty_table_of_cameras(tmp_path):
    shutil.copytree(EXAMPLES / "galveston", folder := tmp_path / "galveston")
    (folder / "CAMERAS").write_text("\n")
    with pytest.raises(InputError, check=coded("giant.unknown-camera", names="part.none")) as raised:
        formats.read(folder)
    assert raised.value.file == folder / "IMAGES"


def test_readings_of_a_deck_that_cannot_be_computed_with(tmp_path):
    path = tmp_path / "grid.deck"
    text = (EXAMPLES / "perspective_center" / "grid.deck").read_text()
    path.write_text(text.replace("    90.368", "  1.8e+308", 1))
    assert path.read_text() != text
    assert run_deck(path).stop.error.file == path


def test_a_folder_instead_of_tracks(tmp_path):
    (tmp_path / "tracks.csv").mkdir()
    project = formats.read(EXAMPLES / "project")
    model = formats.to_files(project, "opensfm")["reconstruction.json"]
    (tmp_path / "reconstruction.json").write_bytes(model)
    with pytest.raises(InputError, check=coded("error.read")) as raised:
        formats.read(tmp_path / "reconstruction.json")
    assert raised.value.file == tmp_path / "tracks.csv"


@pytest.mark.parametrize(
    "options",
    [["--reject", "nobody"], ["--method", "report", "--unit-variance", "unity"]],
)
def test_options_that_the_stations_do_not_fit_name_the_file(run, tmp_path, options):
    done = run("absolute-orientation", STATIONS, *options, "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert f"{STATIONS}: " in done.output.replace("\n", "")


@pytest.mark.parametrize(
    ("command", "file", "options"),
    [
        ("adjust", EXAMPLES / "project", ["--self-calibrate", "nothing"]),
        ("adjust", EXAMPLES / "project", ["--crs", "EPSG:-1"]),
        ("absolute-orientation", STATIONS, ["--scale", "-1"]),
    ],
)
def test_a_wrong_option_is_named_instead_of_a_file(run, tmp_path, command, file, options):
    done = run(command, file, *options, "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert f"error: {options[0]}: " in done.output
