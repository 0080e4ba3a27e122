"""Marks of MicMac: written, read as they were, and the side of y found."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from message_codes import refused
from photogram import InputError
from photogram.formats import Project, ReadOptions, read, read_marks, write_marks
from photogram.io.csv_text import csv_text
from photogram.network import Fiducial
from photogram.words import phrase
from test_film import project, project_again


def written(own: Project, folder: Path) -> Path:
    (folder / "Ori-InterneScan").mkdir(parents=True)
    for name, content in write_marks(own).items():
        (folder / name).write_bytes(content)
    return folder


def test_marks_are_read_as_they_were(tmp_path: Path) -> None:
    own = project(tmp_path)
    found = read_marks(written(own, tmp_path / "micmac"))
    assert found.turned
    assert found.remarks[0] == phrase("micmac.side-down", most=5, all=6, mirrored=1)
    for each in own.block.observations:
        if isinstance(each, Fiducial):
            name = each.mark.name.split()[1]
            np.testing.assert_array_equal(found.readings[each.photo][name], each.reading)
            np.testing.assert_array_equal(found.places[name], each.mark.position[:2])


def test_tables_of_a_project_come_of_them(tmp_path: Path) -> None:
    own = project(tmp_path)
    tables = read_marks(written(own, tmp_path / "micmac")).tables("rc10")
    for name, columns in tables.items():
        (tmp_path / f"{name}.csv").write_bytes(csv_text(columns))
    with pytest.raises(InputError, match=r"or as fiducial_images to \[sd\]"):
        project_again(tmp_path)
    tables["fiducial_images"]["sd"] = [0.2] * len(tables["fiducial_images"]["photo"])
    (tmp_path / "fiducial_images.csv").write_bytes(csv_text(tables["fiducial_images"]))
    again = project_again(tmp_path)
    assert len(again.block.observations) == len(own.block.observations)


def test_y_of_a_camera_that_counts_up_is_left(tmp_path: Path) -> None:
    folder = written(project(tmp_path), tmp_path / "micmac")
    path = folder / "Ori-InterneScan" / "MeasuresCamera.xml"
    lines = []
    for line in path.read_text().splitlines():
        if "<PtIm>" in line:
            before, _, rest = line.partition("<PtIm>")
            x, y = rest.partition("<")[0].split()
            line = f"{before}<PtIm>{x} {-float(y)!r}</PtIm></OneMesureAF1I>"
        lines.append(line)
    path.write_text("\n".join(lines))
    found = read_marks(folder)
    assert not found.turned
    np.testing.assert_array_equal(found.places["ur"], [105.9914, 105.9903])


def test_places_that_count_from_a_corner_are_brought_amid_the_marks(tmp_path: Path) -> None:
    folder = written(project(tmp_path), tmp_path / "micmac")
    given = read_marks(folder)
    path = folder / "Ori-InterneScan" / "MeasuresCamera.xml"

    def moved(found: re.Match[str]) -> str:
        x, y = found[1].split()
        return f"<PtIm>{float(x) + 113.0!r} {float(y) + 113.0!r}</PtIm>"

    path.write_text(re.sub("<PtIm>(.*)</PtIm>", moved, path.read_text()))
    found = read_marks(folder)
    (corner,) = [each for each in found.remarks if each.code == "micmac.corner"]
    assert corner.fields["x"] == pytest.approx(113.0, abs=3.0)
    middle = np.mean([*given.places.values()], axis=0)
    assert np.abs(middle).max() < 0.01
    for name, xy in given.places.items():
        np.testing.assert_allclose(found.places[name], xy - middle, atol=1e-9)


def test_a_list_of_names_is_that_of_the_camera(tmp_path: Path) -> None:
    folder = written(project(tmp_path), tmp_path / "micmac")
    path = folder / "id_fiducial.txt"
    text = path.read_text()
    assert sorted(text.split()) == sorted(read_marks(folder).places)
    path.write_text(f"\n{text}\n")
    assert len(read_marks(folder).remarks) == 1
    for changed, message in (
        (
            text.replace("ll\n", "nn\n"),
            "format.undefined what=mark name=nn",
        ),
        (f"{text}ll\n", "format.repeated what=mark name=ll"),
        (text.replace("ll\n", ""), "micmac.unnamed names=['ll'] file=MeasuresCamera.xml"),
    ):
        path.write_text(changed)
        with refused(message):
            read_marks(folder)


def test_marks_that_no_scan_shows_are_told(tmp_path: Path) -> None:
    folder = written(project(tmp_path), tmp_path / "micmac")
    for path in (folder / "Ori-InterneScan").glob("MeasuresIm-*.xml"):
        lines = path.read_text().splitlines()
        path.write_text("\n".join(each for each in lines if ">mr<" not in each))
    assert read_marks(folder).remarks[1] == phrase("micmac.unread", names=["mr"], n=1)


def test_files_at_fault_are_refused(tmp_path: Path) -> None:
    folder = written(project(tmp_path), tmp_path / "micmac")
    path = folder / "Ori-InterneScan" / "MeasuresIm-p2.xml"
    text = path.read_text()
    path.write_text(text.replace("<NamePt>ur<", "<NamePt>nn<"))
    with refused("format.undefined what=mark name=nn"):
        read_marks(folder)
    path.write_text(text.replace("<NamePt>ur<", "<NamePt>ll<"))
    with refused("format.name what=mark name=ll"):
        read_marks(folder)
    (folder / "Ori-InterneScan" / "MeasuresCamera.xml").unlink()
    with pytest.raises(InputError, match=r"MeasuresCamera.xml"):
        read_marks(folder)
    with refused("format.files name=MeasuresIm-*.xml"):
        read_marks(tmp_path)


def test_the_command_takes_marks_both_ways(tmp_path: Path, run: Callable[..., Any]) -> None:
    own = project(tmp_path)
    done = run("film", "marks", tmp_path, "--out", tmp_path / "micmac")
    assert done.exit_code == 0, done.output
    assert {path.name for path in (tmp_path / "micmac").iterdir()} == {"Ori-InterneScan", "id_fiducial.txt"}
    done = run("film", "marks", tmp_path / "micmac", "--name", "rc10", "--out", tmp_path / "tables")
    assert done.exit_code == 0, done.output
    assert "y of the camera is assumed to count down" in done.output
    for table in ("fiducials", "fiducial_images"):
        content = (tmp_path / "tables" / f"{table}.csv").read_text()
        assert content.startswith("# y of the camera is assumed to count down")
        (tmp_path / f"{table}.csv").write_text(content)
    assert "sd" not in (tmp_path / "fiducial_images.csv").read_text().splitlines()[-1]
    again = read(tmp_path, ReadOptions(settings=["sd.fiducial_images=0.2"]))
    assert len(again.block.observations) == len(own.block.observations)
