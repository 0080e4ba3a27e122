"""Bundle files of Bundler: read, recognised, written; what is damaged is named with file and line."""

import gzip
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from golden_data import DATA, golden
from photogram import InputError, _photocore
from photogram.collection import adjust, read, simulate, to_bytes
from photogram.collection.formats import FORMATS, recognised

RING = simulate(photos=5, points=12, seed=4)
TEXT = to_bytes(RING.collection, file_format="bundler").decode()
LINES = TEXT.splitlines()
FIRST_POINT = 2 + 5 * 5
"""Of the lines: header, counts, five for each camera."""


def written(tmp_path, text):
    path = tmp_path / "bundle.out"
    path.write_text(text)
    return path


def test_the_sample_is_what_its_truth_says():
    found, kind = recognised(DATA / "formats" / "bundler" / "bundle.out")
    truth = golden("formats", "truth.json")
    assert kind is FORMATS["bundler"]
    assert len(found.photo_parameters) == 6
    assert len(found.point_positions) == 40
    rotations = _photocore.vector_rotations(found.photo_parameters[:, :3])
    photos = truth["photos"].values()
    for photo, rotation, parameters in zip(photos, rotations, found.photo_parameters, strict=True):
        np.testing.assert_allclose(-rotation.T @ parameters[3:6], photo["centre"], atol=1e-10)
        np.testing.assert_allclose(rotation, photo["rotation"], atol=1e-12)
    # The observations of the sample are exact.
    np.testing.assert_allclose(found.computed_xy(), found.image_xy, atol=1e-9)


def test_what_is_written_reads_back(tmp_path):
    made = RING.collection
    again, kind = recognised(written(tmp_path, TEXT))
    assert kind.NAME == "bundler"
    np.testing.assert_array_equal(again.point_positions, made.point_positions)
    np.testing.assert_array_equal(again.photo_parameters[:, 3:], made.photo_parameters[:, 3:])
    np.testing.assert_allclose(again.photo_parameters[:, :3], made.photo_parameters[:, :3], atol=1e-15)
    order = np.argsort(made.image_points, kind="stable")
    for name in ("image_photos", "image_points", "image_xy"):
        np.testing.assert_array_equal(getattr(again, name), getattr(made, name)[order])
    # Rotation vectors are the only numbers that another form stands for.
    third = read(written(tmp_path, to_bytes(again, file_format="bundler").decode()))
    np.testing.assert_allclose(third.photo_parameters, again.photo_parameters, atol=1e-15)
    np.testing.assert_array_equal(third.image_xy, again.image_xy)


def test_both_formats_are_adjusted_alike(tmp_path):
    other = tmp_path / "ring.txt"
    other.write_bytes(to_bytes(RING.collection))
    one, two = (adjust(read(path)) for path in (other, written(tmp_path, TEXT)))
    assert two.degrees_of_freedom == one.degrees_of_freedom
    assert two.cost == pytest.approx(one.cost, rel=1e-9)


def test_packed_files_and_other_white_space(tmp_path):
    path = tmp_path / "packed"
    path.write_bytes(to_bytes(RING.collection, ".gz", "bundler"))
    assert gzip.decompress(path.read_bytes()).decode() == TEXT
    head, rest = TEXT.split("\n", 1)
    loose = written(tmp_path, head + "\r\n" + rest.replace(" ", "\t ").replace("\n", "\r\n"))
    np.testing.assert_array_equal(read(loose).image_xy, read(path).image_xy)


def test_a_camera_that_was_not_registered_keeps_its_place(tmp_path):
    zeros = ["0 0 0"] * 5
    lines = [LINES[0], "6 12", *LINES[2:FIRST_POINT], *zeros, *LINES[FIRST_POINT:]]
    path = written(tmp_path, "\n".join(lines) + "\n")
    collection = read(path)
    np.testing.assert_array_equal(collection.photo_parameters[5], 0.0)
    result = adjust(collection)
    assert result.photo_images[5] == 0
    assert result.cost == pytest.approx(adjust(read(written(tmp_path, TEXT))).cost, rel=1e-9)
    assert (
        to_bytes(collection, file_format="bundler").decode().splitlines()[FIRST_POINT : FIRST_POINT + 5]
        == ["0.0 0.0 0.0"] * 5
    )


def changed(number, text):
    lines = list(LINES)
    lines[number - 1] = text
    return lines


DAMAGES = {
    "another version": (changed(1, "# Bundle file v0.4"), 1, "must be a Bundle file of version 0.3"),
    "no counts": (changed(2, "5 -1"), 2, "must contain the numbers of cameras and points"),
    "a word": (changed(5, "1.0 O.0 0.0"), 5, "must be a finite number"),
    "no rotation": (changed(4, "1.0 1.0 0.0"), 4, "must have orthonormal rows"),
    "mirrored": (
        [*LINES[:5], " ".join(str(-float(word)) for word in LINES[5].split()), *LINES[6:]],
        4,
        "is mirrored",
    ),
    "half a view": (changed(FIRST_POINT + 3, "2.5 0 0 1.0 1.0"), FIRST_POINT + 3, "got 2.5"),
    "no such camera": (changed(FIRST_POINT + 3, "1 7 0 1.0 1.0"), FIRST_POINT + 3, "got 7"),
    "more": ([*LINES, "1 2 3"], len(LINES) + 1, "must end after the 12 points"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_damaged_is_named_with_file_and_line(tmp_path, damage):
    lines, record, message = DAMAGES[damage]
    path = written(tmp_path, "\n".join(lines) + "\n")
    with pytest.raises(InputError, match=message) as refused:
        read(path)
    assert (refused.value.file, refused.value.record) == (path, record)
    assert refused.value.text == lines[record - 1]


@pytest.mark.parametrize("lines", [1, 2, 10, FIRST_POINT, FIRST_POINT + 1, len(LINES) - 1])
def test_a_file_that_ends_early_is_refused(tmp_path, lines):
    path = written(tmp_path, "\n".join(LINES[:lines]) + "\n")
    with pytest.raises(InputError, match="but ends before"):
        read(path)


def test_a_view_of_a_camera_that_was_not_registered_is_refused(tmp_path):
    lines = [*LINES[:2], *["0 0 0"] * 5, *LINES[7:]]
    path = written(tmp_path, "\n".join(lines) + "\n")
    with pytest.raises(InputError, match="camera 0 was not registered") as refused:
        read(path)
    assert refused.value.record > FIRST_POINT


def test_more_than_there_can_be_is_announced(tmp_path):
    with pytest.raises(InputError, match="ends before"):
        read(written(tmp_path, "# Bundle file v0.3\n0 900000000000\n"))


@given(st.data())
def test_nothing_but_an_input_error_comes_of_damaged_text(tmp_path_factory, data):
    text = bytearray(TEXT.encode())
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(text) - 1))
        text[place : place + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    path = tmp_path_factory.mktemp("damaged") / "bundle.out"
    path.write_bytes(bytes(text))
    with suppress(InputError):
        read(path)


def test_formats_and_cameras_that_cannot_be_are_refused():
    with pytest.raises(InputError, check=lambda error: error.code == "collection.format"):
        to_bytes(RING.collection, file_format="x")
    other = RING.collection.replace(
        photo_parameters=np.insert(RING.collection.photo_parameters, 7, [[0.0], [0.0]], axis=1),
        photo_sd=np.array(np.inf),
        camera="radial",
    )
    with pytest.raises(InputError, check=lambda error: error.code == "collection.model"):
        to_bytes(other)


def test_the_command_says_what_the_file_is_and_writes_the_same(run, tmp_path):
    path = written(tmp_path, TEXT)
    done = run("collection", path, "--out", tmp_path / "out")
    assert done.exit_code == 0
    assert "Bundle file (Bundler, version 0.3)" in " ".join(done.output.split())
    adjusted = read(tmp_path / "out" / "adjusted.out")
    assert adjusted.cost() < 0.1 * RING.collection.cost()
    other = tmp_path / "ring.txt"
    other.write_bytes(to_bytes(RING.collection))
    assert "Bundle Adjustment in the Large" in " ".join(run("collection", other).output.split())
