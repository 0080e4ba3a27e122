"""Calibration inputs that are damaged or made to fail: rejected soon, with the file."""

import io
import time
import warnings
import zipfile

import numpy as np
import pytest

from photogram import InputError
from photogram.io.yaml_text import read_yaml_text
from photogram.targets import Board, read
from photogram.targets.board import read_board
from photogram.targets.mrcal import read_lens
from photogram.targets.opencv_corners import read_npz, read_storage
from photogram.targets.sightings import focal_lengths, homographies, ray_homographies

HUGE = "1" + "0" * 400
STORAGE = {
    "yml": 'image_points:\n  rows: 1\n  cols: 1\n  dt: "2f"\n  data: [ 1.0, NUMBER ]\n',
    "xml": "<opencv_storage><image_points><rows>1</rows><cols>1</cols><dt>2f</dt><data>1.0 NUMBER</data>"
    "</image_points></opencv_storage>",
}
KALIBR = "target_type: checkerboard\ntargetCols: 6\ntargetRows: ROWS\n"
KALIBR += "rowSpacingMeters: 0.1\ncolSpacingMeters: 0.1\n"


def refusal(read, path, *arguments):
    """Return the error for a file, which it must name within a second of processor time."""
    begin = time.process_time()
    with pytest.raises(InputError) as found:
        read(path, *arguments)
    assert time.process_time() - begin < 1
    assert found.value.file == path
    return found.value


@pytest.mark.parametrize("kind", [*STORAGE])
@pytest.mark.parametrize("number", [HUGE, "1e999"])
def test_numbers_beyond_double_precision_in_storage_of_opencv(tmp_path, kind, number):
    path = tmp_path / f"corners.{kind}"
    path.write_text(STORAGE[kind].replace("NUMBER", number))
    assert "/image_points/data/1" in refusal(read_storage, path, None).message


@pytest.mark.parametrize("number", [HUGE, "1e300", "1e-300"])
@pytest.mark.parametrize("key", ["spacing", "sd_plane"])
def test_lengths_of_a_board_whose_squares_are_no_numbers(tmp_path, key, number):
    path = tmp_path / "board.toml"
    lines = {"columns": "4", "rows": "3", "spacing": "0.1", key: number}
    path.write_text("".join(f"{name} = {value}\n" for name, value in lines.items()))
    refusal(read_board, path)


@pytest.mark.parametrize("rows", ["2147483647", "20000"])
def test_a_board_of_more_points_than_any_has(tmp_path, rows):
    path = tmp_path / "target.yaml"
    path.write_text(KALIBR.replace("ROWS", rows))
    assert "100000" in refusal(read_board, path).message


def test_corners_on_one_line_do_not_determine_a_focal_length():
    board = Board(columns=6, rows=7, spacing=0.1)
    plane = board.places[:, :2]
    tilts = [np.array([[1.0, 0.1, 0.0], [0.0, 0.9, 0.1], [own, 0.5 * own, 1.0]]) for own in (0.3, -0.4, 0.5)]
    there = [np.column_stack([plane, np.ones(len(plane))]) @ own.T for own in tilts]
    found = homographies(plane, np.array([800 * own[:, :2] / own[:, 2:] for own in there]))
    middle = np.zeros(2)
    line = np.diag([368.0, 0.0, 0.0])[np.newaxis]
    assert focal_lengths(np.concatenate([line, found]), middle) == focal_lengths(found, middle)
    assert np.isnan(focal_lengths(line, middle)).all()


def archive(path, content, name="imgpoints.npy"):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(name, content)
    return path


def array(values):
    buffer = io.BytesIO()
    np.save(buffer, values)
    return buffer.getvalue()


def test_an_archive_of_arrays_that_would_grow_without_end(tmp_path):
    path = archive(tmp_path / "bomb.npz", array(np.zeros((100, 50_000, 2))))
    assert path.stat().st_size < 100_000
    assert "80000128" in refusal(read_npz, path, None).message


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (b"(2, 3, 2), }", b"(9, 9, 9), }"),
        (b"(2, 3, 2), }", b"(-2, 3,-2),}"),
        (b"(2, 3, 2), }", b"(2, 3, 2     "),
        (b"'<f8'", b"'<q9'"),
        (b"'<f8'", b"f8+()"),
        (b"NUMPY\x01", b"NUMPY\x07"),
    ],
)
def test_an_array_with_a_header_that_is_wrong_is_named(tmp_path, before, after):
    content = array(np.zeros((2, 3, 2)))
    assert before in content
    path = archive(tmp_path / "corners.npz", content.replace(before, after))
    assert "imgpoints" in refusal(read_npz, path, None).message


@pytest.mark.parametrize(
    "text",
    [
        "a: 1\nb" + "\t" * 200_000 + "c\n",
        "a: 1\n-b" + " " * 200_000 + "c\n",
        "a: " + "[" * 20_000 + "]" * 20_000 + "\n",
        "a: " + "{b: " * 20_000 + "}" * 20_000 + "\n",
    ],
    ids=["tabs", "blanks", "lists", "mappings"],
)
def test_yaml_that_is_endless_is_refused_soon(tmp_path, text):
    path = tmp_path / "target.yaml"
    path.write_text(text)
    assert refusal(read_yaml_text, path).record


def test_time_of_a_list_in_yaml_grows_with_its_lines_alone(tmp_path):
    path = tmp_path / "long.yaml"
    path.write_text("a : [" + "1, 2,\n" * 20_000 + "3]\n'b' : 1\n")
    begin = time.process_time()
    assert read_yaml_text(path) == {"a": [1, 2] * 20_000 + [3], "b": 1}
    assert time.process_time() - begin < 2


def test_encodings_that_a_parser_of_xml_has_not(tmp_path):
    path = tmp_path / "corners.xml"
    path.write_text('<?xml version="1.0" encoding="utf-7"?>' + STORAGE["xml"])
    refusal(read_storage, path, None)


@pytest.mark.parametrize("text", ["{'lensmodel': __import__('os')}", "{'lensmodel': ", "[" * 500])
def test_a_model_of_mrcal_that_is_no_dictionary_shows_no_object_of_python(tmp_path, text):
    path = tmp_path / "x.cameramodel"
    path.write_text(text)
    error = refusal(read_lens, path)
    assert "object at" not in str(error)


def test_corners_that_determine_no_camera_name_the_file(tmp_path):
    board = Board(columns=4, rows=3, spacing=0.1)
    lines = [f"v{view},{k},{10 * k},5" for view in range(3) for k in range(12)]
    (tmp_path / "c.csv").write_text("image,point,x,y\n" + "\n".join(lines) + "\n")
    with pytest.raises(InputError) as found:
        read(tmp_path / "c.csv", board=board, size=(640, 480))
    assert found.value.file == tmp_path / "c.csv"


def test_a_picture_with_one_ray_has_no_homography():
    """A lens that is adjusted by other pictures may have a ray for one corner of a picture."""
    places = np.mgrid[:3, :5].reshape(2, -1).T * 0.06
    rays = np.concatenate([places - 0.1, np.ones((15, 1))], axis=1)
    rays = np.array([rays / np.linalg.norm(rays, axis=1)[:, np.newaxis]] * 2)
    whole = ray_homographies(places, rays[:1])
    rays[1, 1:] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = ray_homographies(places, rays)
    np.testing.assert_array_equal(found[0], whole[0])
    assert np.isnan(found[1]).all()
