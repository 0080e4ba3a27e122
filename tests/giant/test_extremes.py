"""Numbers and files that no project has: refused at their records, or adjusted; none is a traceback."""

import os
from pathlib import Path

import numpy as np
import pytest
from damage import FIELDS

from photogram import InputError, Spheroid, diagnose, simulate
from photogram.giant import Project, read_project
from photogram.giant.files import to_bytes

TEXTS = ["1E308", "-1E308", "1+300", "1E155", "1E20", "1E-300", "²", "1²", "٣", "1\x00", "nan", "-inf"]


@pytest.fixture(scope="module")
def sound():
    """Return the files of two small projects that are in order."""
    size = {"strips": 2, "photos_per_strip": 3, "points_per_photo": 12, "check_points": 3}
    rectangular = simulate(**size, seed=1).block
    geographic = simulate(
        **size, spheroid=Spheroid.clarke_1866(), origin=(-1.6, 0.5, 10.0), photo_to_ground=True, seed=2
    ).block
    return [
        {name: to_bytes(lines) for name, lines in Project.from_block(block).records().items()}
        for block in (rectangular, geographic)
    ]


def written(place, files):
    place.mkdir(exist_ok=True)
    for name, content in files.items():
        (place / name).write_bytes(content)
    return place


def outcome(place):
    """Return the block of a project, or None and why there is none."""
    try:
        return read_project(place).to_block(), ""
    except InputError as error:
        return None, str(error)


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("name", list(FIELDS))
def test_extreme_numbers_in_every_column_are_refused_at_their_record_or_adjusted(name, text, sound, tmp_path):
    fields = [(first, last) for first, last in FIELDS[name] if last - first + 1 >= len(text)]
    for number, (first, last) in enumerate(fields):
        files = dict(sound[number % 2])
        lines = files[name].decode().split("\n")
        row = 1 if name == "COMMON" or (name == "IMAGES" and number % 2) else 0
        before, after = f"{lines[row]:{last}}"[: first - 1], lines[row][last:]
        lines[row] = before + text.rjust(last - first + 1) + after
        files[name] = "\n".join(lines).encode()
        block, error = outcome(written(tmp_path, files))
        if block is None:
            assert name in error or "FRAMES" in error or "camera" in error, (first, text, error)
            continue
        for array in (block.image_xy, block.photo_positions, block.principal_distances):
            assert np.abs(array).max() < 1e12


def test_a_number_that_its_columns_could_not_hold_is_refused(sound, tmp_path):
    lines = sound[0]["IMAGES"].decode().split("\n")
    lines[3] = f"{lines[3][:10]}{'1.5+154':>10}{lines[3][20:]}"
    files = sound[0] | {"IMAGES": "\n".join(lines).encode()}
    with pytest.raises(InputError, match=r"columns 11-20: 1\.5e\+154 is out of range") as caught:
        read_project(written(tmp_path, files))
    assert (caught.value.record, caught.value.file.name) == (4, "IMAGES")


@pytest.mark.parametrize("size", [1e308, -1e200, 1e155, 1e20])
def test_a_check_of_absurd_values_ends(size):
    block = simulate(strips=2, photos_per_strip=5, points_per_photo=12, seed=1).block
    for name in ("photo_positions", "image_xy", "principal_distances", "point_positions"):
        values = getattr(block, name).copy()
        values.reshape(-1)[np.flatnonzero(np.isfinite(values))[0]] = size
        try:
            report = diagnose(Project.from_block(block.replace(**{name: values})), threads=1).report()
        except InputError:
            continue  # a block may refuse such values: as good
        assert report.endswith("\n")


# Files


def test_records_may_be_long_and_are_cut_after_column_80(sound, tmp_path):
    files = {
        name: content.replace(b"\n", b" " * 5000 + b"x" * 5000 + b"\n") for name, content in sound[0].items()
    }
    files["COMMON"] = b"\n".join(line[:80].rstrip() + b" " * 9000 for line in sound[0]["COMMON"].split(b"\n"))
    project = read_project(written(tmp_path, files))
    np.testing.assert_array_equal(
        project.to_block().image_xy, read_project(written(tmp_path, sound[0])).to_block().image_xy
    )


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("name", ["COMMON", "IMAGES"])
def test_text_of_two_bytes_a_character_is_read_with_and_without_its_mark(name, encoding, sound, tmp_path):
    files = sound[0] | {name: sound[0][name].decode().encode(encoding)}
    block = read_project(written(tmp_path / "wide", files)).to_block()
    plain = read_project(written(tmp_path / "plain", sound[0])).to_block()
    np.testing.assert_array_equal(block.image_xy, plain.image_xy)


@pytest.mark.parametrize("encoding", ["utf-32", "utf-32-le", "utf-32-be"])
@pytest.mark.parametrize("name", ["COMMON", "IMAGES"])
def test_other_encodings_are_named(name, encoding, sound, tmp_path):
    files = sound[0] | {name: sound[0][name].decode().encode(encoding)}
    with pytest.raises(InputError, match=r"UTF-32") as caught:
        read_project(written(tmp_path, files))
    assert caught.value.file.name == name


def test_zero_bytes_are_named(sound, tmp_path):
    content = sound[0]["FRAMES"]
    with pytest.raises(InputError, match=r"printable characters only, got '\\x00'") as caught:
        read_project(written(tmp_path, sound[0] | {"FRAMES": content[:100] + b"\0" + content[101:]}))
    assert caught.value.record is not None


@pytest.mark.parametrize("what", ["GROUND", "directory"])
def test_loops_of_links_are_named(what, sound, tmp_path):
    place = written(tmp_path / "project", sound[0])
    if what == "directory":
        place = tmp_path / "round"
        os.symlink(place, place)
    else:
        (place / what).unlink()
        os.symlink(place / what, place / what)
    with pytest.raises(InputError, match=r"cannot be read.*symbolic links") as caught:
        read_project(place)
    assert caught.value.file == (place / "GROUND" if what == "GROUND" else place)


def test_links_to_nothing_are_named(sound, tmp_path):
    place = written(tmp_path, sound[0])
    (place / "GROUND").unlink()
    os.symlink(place / "nowhere", place / "GROUND.DAT")
    with pytest.raises(InputError, match=r"GROUND\.DAT: the file must be readable, but cannot be read"):
        read_project(place)


def test_two_files_for_one_name_are_named(sound, tmp_path):
    place = written(tmp_path, sound[0])
    (place / "ground.txt").write_bytes(b"")
    with pytest.raises(
        InputError, match=r"GROUND, ground\.txt", check=lambda error: error.code == "giant.several"
    ):
        read_project(place)


@pytest.mark.parametrize("given", ["no such directory", "COMMON"])
def test_what_is_no_directory_is_named(given, sound, tmp_path):
    place = written(tmp_path, sound[0])
    with pytest.raises(InputError, check=lambda error: error.code == "giant.folder"):
        read_project(place / given)
    with pytest.raises(InputError, match="must be a path"):
        read_project(Path("a\0b"))
