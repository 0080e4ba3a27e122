"""Mistakes that the marks of films show before anything is adjusted."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import coded
from photogram import InputError
from photogram.cli import app
from photogram.errors import ContradictionError
from photogram.formats import ReadOptions, read
from photogram.formats.read_options import deviations
from photogram.network import Fiducial

ARCHIVE = files("photogram") / "examples" / "archive"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for each in ARCHIVE.iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    return tmp_path


def changed(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def said(folder: Path) -> list[str]:
    return [str(each) for each in read(folder).messages]


def test_a_good_project_is_told_nothing(folder: Path) -> None:
    assert said(folder) == []


@pytest.mark.parametrize(("pitch", "dpi"), [("0.0211667", 1270), ("0.02117", 1270), ("0.0254", 1270)])
def test_a_pitch_that_is_another_is_refused(folder: Path, pitch: str, dpi: int) -> None:
    changed(folder / "scanners.csv", "scanner,0.02,", f"scanner,{pitch},")
    with pytest.raises(ContradictionError, match=rf"which would be 0.0200\d+ \(about {dpi} dpi\), not"):
        read(folder)
    done = CliRunner().invoke(app, ["adjust", str(folder), "--out", str(folder / "out")])
    assert done.exit_code == 4


def test_rows_that_count_the_other_way_are_told(folder: Path) -> None:
    changed(folder / "scanners.csv", "scanner,pitch_mm", "scanner,rows_down,pitch_mm")
    changed(folder / "scanners.csv", "scanner,0.02", "scanner,false,0.02")
    with pytest.raises(ContradictionError, check=coded("films.mirrored")):
        read(folder)
    for word in ("true", "false"):
        changed(folder / "photos.csv", f"scanner,{word}", "scanner,")
    [told] = said(folder)
    assert "5 of 6 photos are mirrored: check" in told


def test_a_strip_on_top_is_told(folder: Path) -> None:
    """Films lie in other directions on the scanner, and one is mirrored: names tell alike on all."""
    changed(folder / "rc10-2345.toml", 'data_strip = "left"', 'data_strip = "top"')
    [told] = said(folder)
    assert "fit better if they are renamed by 90 degrees" in told


def test_the_other_way_round_is_told_alike(folder: Path) -> None:
    rounds = {"ll": "lr", "lr": "ur", "ur": "ul", "ul": "ll", "ml": "mb", "mb": "mr", "mr": "mt", "mt": "ml"}
    path = folder / "fiducial_images.csv"
    lines = [each.split(",") for each in path.read_text().splitlines()]
    path.write_text("\n".join(",".join([each[0], rounds.get(each[1], each[1]), *each[2:]]) for each in lines))
    assert any("fit better" in each for each in said(folder))


def test_resampled_scans_are_told(folder: Path) -> None:
    path = folder / "fiducial_images.csv"
    head, names, *rows = path.read_text().splitlines()
    first = {each.split(",")[1]: each.split(",")[2:] for each in rows if each.startswith("83-1")}
    rng = np.random.default_rng(1)
    lines = []
    for row in rows:
        photo, mark, *_ = row.split(",")
        column, line = (float(each) + rng.uniform(-0.1, 0.1) for each in first[mark])
        lines.append(f"{photo},{mark},{column:.2f},{line:.2f}")
    path.write_text("\n".join([head, names, *lines]) + "\n")
    changed(folder / "photos.csv", "scanner,true", "scanner,false")
    assert any("fiducials have equal pixels on all photos" in each for each in said(folder))


def test_deviations_of_marks_may_be_said_beside_a_plain_project(folder: Path) -> None:
    changed(folder / "project.toml", "fiducial_images = 0.2\n", "")
    with pytest.raises(InputError, match=r"or as fiducial_images to \[sd\]"):
        read(folder)
    options = ReadOptions(sd=deviations(["fiducial_images=0.3"]))
    observations = read(folder, options).block.observations
    found = {float(np.max(each.sd)) for each in observations if isinstance(each, Fiducial)}  # type: ignore[arg-type]
    assert found == {0.3}
    with pytest.raises(InputError, match="--sd fiducial_images requires a plain project"):
        read(Path(str(ARCHIVE)).parent / "galveston", options)
    with pytest.raises(InputError, match="one of photos, images, points, fiducials, fiducial_images"):
        deviations(["fiducial=0.3"])


def test_a_film_that_was_seen_from_the_other_side_is_told(folder: Path) -> None:
    changed(folder / "photos.csv", "scanner,true", "scanner,")
    [message] = said(folder)
    assert "the films of 83-6 are mirrored" in message
