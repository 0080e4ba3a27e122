"""Results in a coordinate reference system, and what a plane does to a block that is adjusted in it."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_plain_project import EXAMPLE, change

from message_codes import refused
from photogram import Attitudes, Spheroid, adjust, formats, simulate
from photogram.formats import Frame
from photogram.formats.crs import bend, plane_remarks
from photogram.giant import Project, write_project

pyproj = pytest.importorskip("pyproj", reason="pyproj is not installed")
crs = pytest.importorskip("photogram.formats.crs")
places = pytest.importorskip("photogram.formats.results")

FRAME = Frame("topocentric", "EPSG:4979", (47.38, 8.54, 450.0))
UTM = "EPSG:32632"


@pytest.fixture(scope="module")
def result():
    project = formats.read(EXAMPLE)
    return adjust(project.replace(frame=FRAME).block)


def test_positions_are_those_of_proj(result):
    found = places.placed(result, UTM)
    direct, _ = crs.from_frame(UTM, result.photo_positions, np.zeros((6, 3, 3)), FRAME)
    np.testing.assert_array_equal(found.photos, direct)
    assert found.names == ("easting", "northing", "height")
    geographic = places.placed(result, "EPSG:4979")
    assert np.abs(geographic.photos[:, :2] - [8.54, 47.38]).max() < 0.01
    back, _, _ = crs.to_frame("EPSG:4979", geographic.points, np.zeros((len(found.rows), 3, 3)), FRAME)
    np.testing.assert_allclose(back, result.point_positions[found.rows], atol=2e-8)


def test_covariances_are_those_of_differences_in_the_plane(result):
    # A step in the frame, carried into the plane by PROJ, is the turned step, but for the plane's scale.
    found = places.placed(result, UTM)
    scale = 0.99961
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1.0
        moved, _ = crs.from_frame(
            UTM, result.point_positions[found.rows] + step, np.zeros((len(found.rows), 3, 3)), FRAME
        )
        expected = (moved - found.points) / [scale, scale, 1.0]
        np.testing.assert_allclose(found.point_turns[:, :, axis], expected, atol=2e-4)
    np.testing.assert_allclose(
        np.trace(found.photo_covariances, axis1=1, axis2=2),
        np.trace(result.photo_covariances[:, :3, :3], axis1=1, axis2=2),
        rtol=1e-12,
    )


def test_attitudes_refer_to_the_grid(result):
    found = places.placed(result, UTM)
    angles, sd = found.angles()
    # gamma = atan(tan(lon - lon0) sin lat): -0.338 degrees at 0.46 degrees west of the central meridian.
    turned = np.degrees(angles[:, 2] - result.photo_attitudes[:, 2])
    np.testing.assert_allclose(turned, turned[0], atol=0.02)
    assert abs(turned[0]) == pytest.approx(0.3388, abs=5e-3)
    # Rotation about the camera's own axes is as well known in all systems.
    own = Attitudes.of("omega_phi_kappa", result.photo_attitudes, result.photo_covariances[:, 3:, 3:])
    np.testing.assert_allclose(found.attitudes.step_covariances, own.step_covariances)
    np.testing.assert_allclose(sd, result.photo_sd[:, 3:], rtol=0.03)


def test_what_a_frame_has_no_place_for_is_refused(result):
    free = replace(result, block=result.block.in_frame(Frame()))
    with refused("crs.results-place crs=EPSG:32632"):
        places.placed(free, UTM)
    with refused("crs.metres crs=EPSG:32632 unit=ft"):
        places.placed(replace(result, block=result.block.replace(linear_unit="ft")), UTM)
    with refused("crs.unknown crs=EPSG:1"):
        places.check_place(result.block, "EPSG:1")
    same = places.placed(free)
    np.testing.assert_array_equal(same.points, result.point_positions[same.rows])


def test_geographic_blocks_have_a_place():
    origin = (np.radians(8.54), np.radians(47.38), 450.0)
    common = {"strips": 2, "photos_per_strip": 4, "points_per_photo": 25, "seed": 12, "origin": origin}
    result = adjust(simulate(spheroid=Spheroid.wgs84(), **common).block)
    found = places.placed(result, "EPSG:4979")
    np.testing.assert_allclose(
        np.radians(found.points[:, 0]), result.point_positions[found.rows, 0], atol=1e-12
    )
    lengths = np.sqrt(np.diagonal(found.point_covariances, axis1=1, axis2=2))
    local = places.placed(result, "ENU:47.38,8.54,450")
    np.testing.assert_allclose(
        np.linalg.norm(lengths, axis=1),
        np.sqrt(np.trace(local.point_covariances, axis1=1, axis2=2)),
        rtol=1e-9,
    )
    # Axes of the ellipsoid at the point are those of the block itself.
    np.testing.assert_allclose(found.photo_turns, np.broadcast_to(np.eye(3), (8, 3, 3)), atol=1e-9)
    clarke = adjust(simulate(spheroid=Spheroid.clarke_1866(), **common).block)
    with refused("crs.ellipsoid crs=EPSG:4979"):
        places.placed(clarke, "EPSG:4979")
    # A system on their ellipsoid takes longitudes and latitudes as its own: no grid is asked for.
    own = places.placed(clarke, "EPSG:4267")
    expected = np.degrees(clarke.point_positions[own.rows, :2])
    np.testing.assert_array_equal(own.points[:, :2], expected)
    np.testing.assert_array_equal(own.photo_turns, np.broadcast_to(np.eye(3), (8, 3, 3)))
    np.testing.assert_array_equal(own.carried(clarke.photo_positions), own.photos)


@pytest.fixture
def quarry(tmp_path):
    """Return the example with a frame that has a place, and control in UTM."""
    place = shutil.copytree(EXAMPLE, tmp_path / "quarry")
    frame = '[frame]\nkind = "topocentric"\norigin = [47.38, 8.54, 450.0]'
    change(place / "project.toml", "[frame]", frame)
    return place


def test_the_command_writes_tables_in_the_system(run, quarry):
    done = run("adjust", quarry, "--crs", UTM, "--out", "out")
    assert done.exit_code == 0, done.output
    result = adjust(formats.read(quarry).block)
    found = places.placed(result, UTM)
    for name, ids, xyz in (
        ("photos", result.block.photo_ids, found.photos),
        ("points", [result.block.point_ids[row] for row in found.rows], found.points),
    ):
        lines = [line for line in Path(f"out/in_crs/{name}.csv").read_text().splitlines() if line[0] != "#"]
        header, *rows = (line.split(",") for line in lines)
        assert [row[0] for row in rows] == ids
        start = header.index("easting")
        values = np.array([row[start : start + 3] for row in rows], dtype=float)
        np.testing.assert_allclose(values, xyz, rtol=0, atol=1e-6)
        assert {"sd_east", "sd_north", "sd_up", "c_up_east"} <= set(header)
    control = Path("out/in_crs/control.csv").read_text()
    assert f"Control and check points in {UTM}" in Path("out/report.html").read_text()
    assert "metres along east, north and up of this system" in control
    assert "d_east" in control


def test_the_command_refuses_before_it_adjusts(run):
    done = run("adjust", EXAMPLE, "--crs", UTM, "--out", "out")
    assert done.exit_code == 1
    assert "the position of the frame on the earth, unknown for cartesian" in " ".join(done.output.split())
    assert not Path("out").exists()


# In a plane


def test_a_plane_bends_by_the_square_of_the_distance():
    square = np.array([[0.0, 0.0, 500.0], [5000.0, 5000.0, 500.0]])
    found = bend(square).fields
    assert found["extent"] == pytest.approx(2500 * np.sqrt(2))
    assert found["curvature"] == pytest.approx(0.98, abs=0.01)
    # 0.46 degrees from the central meridian of UTM: k = 0.9996 + 1.5e-5, over R / (R + h).
    named = bend(square + np.array([465000.0, 5247000.0, 0.0]), UTM).fields
    assert (named["least"], named["largest"]) == pytest.approx((-463, -463), abs=10)


def test_a_block_in_a_plane_is_told_by_how_much_it_bends(run, tmp_path):
    place = shutil.copytree(EXAMPLE, tmp_path / "plane")
    change(place / "project.toml", "[frame]", f'[frame]\nkind = "cartesian"\ncrs = "{UTM}"')
    shift_tables(place, [465000.0, 5247000.0, 0.0])
    project = formats.read(place)
    remark = next(each.text for each in project.messages if "cartesian" in each.text)
    assert remark.startswith(
        "positions in the plane of EPSG:32632 are adjusted as cartesian: heights bend by"
    )
    assert "ppm" in remark
    assert run("adjust", place, "--out", "out").exit_code == 0
    assert remark in " ".join(Path("out/report.txt").read_text().split())
    # Its results are in that system as they stand, and in others through it.
    result = adjust(project.block)
    np.testing.assert_array_equal(places.placed(result, UTM).photos, result.photo_positions)
    assert np.abs(places.placed(result, "EPSG:4979").photos[:, :2] - [8.54, 47.38]).max() < 0.02


def test_numbers_that_look_like_a_map_are_told_without_a_name(tmp_path):
    place = shutil.copytree(EXAMPLE, tmp_path / "plane")
    local = formats.read(place)
    assert plane_remarks(local.block, place, local.starts) == []
    shift_tables(place, [465000.0, 5247000.0, 0.0])
    remarks = [each for each in formats.read(place).messages if each.code == "planes.map"]
    assert len(remarks) == 1


def shift_tables(place, shift):
    """Move all positions of a project."""
    for name in ("photos", "control", "gnss"):
        path = place / f"{name}.csv"
        lines = path.read_text().splitlines()
        head = next(row for row, line in enumerate(lines) if not line.startswith("#"))
        columns = lines[head].split(",")
        for row in range(head + 1, len(lines)):
            cells = lines[row].split(",")
            for axis, step in zip("xyz", shift, strict=True):
                if axis in columns and cells[columns.index(axis)]:
                    own = columns.index(axis)
                    cells[own] = repr(float(cells[own]) + step)
            lines[row] = ",".join(cells)
        path.write_text("\n".join(lines) + "\n")


def test_control_of_a_map_without_a_name_is_told_too(run, tmp_path):
    place = shutil.copytree(EXAMPLE, tmp_path / "quarry")
    shutil.copytree(place, tmp_path / "moved")
    for name in ("gnss", "distances"):  # so that the model is free, and is carried onto control
        (place / f"{name}.csv").unlink()
    shift_tables(tmp_path / "moved", [465000.0, 5247000.0, 0.0])
    shutil.move(tmp_path / "moved" / "control.csv", tmp_path / "control.csv")
    (place / "control.csv").unlink()
    done = run("info", place, "--control", tmp_path / "control.csv", "--sd", "control=0.02")
    assert "coordinates are similar to coordinates of a map" in " ".join(done.output.split())


def test_giant_projects_in_a_plane_are_told_too(run):
    common = {"strips": 2, "photos_per_strip": 3, "points_per_photo": 20, "seed": 3}
    block = simulate(origin=(465000.0, 5247000.0, 300.0), **common).block
    write_project(Project.from_block(block), "plane")
    assert run("giant", "plane").exit_code == 0
    assert "coordinates are similar to coordinates of a map" in Path("plane-adjusted/report.txt").read_text()
    write_project(Project.from_block(simulate(**common).block), "local")
    assert run("giant", "local").exit_code == 0
    assert "of a map" not in Path("local-adjusted/report.txt").read_text()
