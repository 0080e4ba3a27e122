"""Images of films brought back to the frame of the camera, for programs that know no films."""

import shutil
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram import Attitudes, Result, adjust, diagnose
from photogram.cli import app
from photogram.formats import ReadOptions, read, to_files
from photogram.formats.results import table_files
from photogram.network.film_reduction import as_seen, camera_images

ARCHIVE = files("photogram") / "examples" / "archive"
PHOTOS = ("photo", "x", "y", "z", "omega", "phi", "kappa")


def archive(folder: Path, *said: str) -> Result:
    for each in ARCHIVE.iterdir():
        (folder / each.name).write_bytes(each.read_bytes())
    return adjust(read(folder, ReadOptions(settings=said)).block, unit_variance="unity", tolerance=1e-9)


def without_films(folder: Path, refined: bytes) -> Path:
    """Return a project of refined images, whose camera is as the certificate has it, without films."""
    found = folder / "refined"
    found.mkdir()
    (found / "images.csv").write_bytes(refined)
    shutil.copy(folder / "control.csv", found)
    rows = [each.split(",") for each in (folder / "photos.csv").read_text().splitlines() if each[0] != "#"]
    kept = [rows[0].index(name) for name in PHOTOS]
    (found / "photos.csv").write_text("\n".join(",".join(row[k] for k in kept) for row in rows) + "\n")
    own = read(folder)
    for name, content in to_files(own, "plain").items():
        if name in ("cameras.csv", "covariances.csv"):
            lines = [
                each for each in content.decode().splitlines() if not each.startswith(("scanner,", "film,"))
            ]
            (found / name).write_text("\n".join(each for each in lines if "fiducials" not in each) + "\n")
    (found / "project.toml").write_text('[project]\nformat = 1\n[units]\nimage = "mm"\n')
    return found


def test_refined_images_are_what_two_steps_adjust(tmp_path: Path) -> None:
    """Films that are errorless can be taken out of the images beforehand: the results are the same."""
    two = archive(tmp_path, "film.interior=before")
    refined = table_files(two)["refined.csv"]
    one = adjust(read(without_films(tmp_path, refined)).block, unit_variance="unity", tolerance=1e-9)
    assert one.block.image_unit == "mm"
    assert len(one.block.image_xy) == len(two.block.image_xy)
    sums = [each.kinds["image"].sum_of_squares for each in (one, two)] if "image" in one.kinds else []
    assert not sums or sums[0] == pytest.approx(sums[1], rel=1e-3)
    assert one.sum_and_freedom == (pytest.approx(two.sum_and_freedom[0], rel=1e-3), two.sum_and_freedom[1])
    rows = [two.block.point_ids.index(name) for name in one.block.point_ids]
    used = one.used_points
    sd = np.sqrt(np.diagonal(two.point_cofactors, axis1=1, axis2=2))[rows]
    assert (np.abs(one.point_positions - two.point_positions[rows])[used] / sd[used]).max() < 0.01
    # Turned films have the deviations of columns and rows by their angle.
    np.testing.assert_allclose(two.refined[1], 0.25 * 0.02, rtol=1e-3)


def test_refined_images_are_those_of_the_adjusted_films(tmp_path: Path) -> None:
    own = archive(tmp_path)
    xy, _ = own.refined
    before = archive(tmp_path, "film.interior=before").refined[0]
    apart = np.abs(xy - before).max()
    assert 1e-4 < apart < 0.03
    # What a camera sees of a point is where its refined image is, but for its residual of the reading.
    block, row = own.block, 3
    photo, point = block.image_photos[row], block.image_points[row]
    [camera] = own.cameras
    axes = Attitudes.of("omega_phi_kappa", own.photo_attitudes).matrices[photo]
    turned = (own.point_positions[point] - own.photo_positions[photo]) @ axes
    seen = camera.camera.project(turned[np.newaxis])[0]
    np.testing.assert_allclose(xy[row] - seen, own.residuals[row] * [0.02, -0.02], atol=2e-5)


def test_refined_images_are_written_and_formats_without_films_name_them(tmp_path: Path) -> None:
    archive(tmp_path)
    done = CliRunner().invoke(app, ["adjust", str(tmp_path), "--no-html", "--out", str(tmp_path / "out")])
    assert done.exit_code == 0
    head = (tmp_path / "out" / "refined.csv").read_text().splitlines()[:3]
    assert head[0].startswith("# mm in the frame of the marks")
    assert head[2] == "photo,point,x,y,sd_x,sd_y"
    refused = CliRunner().invoke(app, ["convert", str(tmp_path), str(tmp_path / "b.im"), "--to", "bingo"])
    assert refused.exit_code != 0
    assert "refined.csv" in refused.output


def test_checks_see_films_as_their_marks_have_them(tmp_path: Path) -> None:
    """What looks at rays alone has images of films that have changed as their marks say."""
    two = archive(tmp_path, "film.interior=before")
    block = read(tmp_path).block
    seen = as_seen(block)
    assert np.abs(camera_images(block) - two.refined[0]).max() > 0.04
    assert np.abs(seen.image_xy - two.refined[0]).max() < 0.001
    numbers = diagnose(block).sections[-1]
    assert numbers.title == "Key numbers"
    assert numbers.findings == []


def test_marks_that_are_wrong_move_no_images(tmp_path: Path) -> None:
    archive(tmp_path)
    table = tmp_path / "fiducial_images.csv"
    own = next(line for line in table.read_text().splitlines() if line.startswith("83-1,ur,"))
    table.write_text(table.read_text().replace(own, "83-1,ur,11290.0,741.22"))
    block = read(tmp_path).block
    of_photo = block.image_photos == block.photo_ids.index("83-1")
    np.testing.assert_array_equal(as_seen(block).image_xy[of_photo], camera_images(block)[of_photo])
