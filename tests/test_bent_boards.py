"""Boards that bend: places of points that follow from two numbers, in a rig of two cameras."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from golden_data import golden as golden_file
from message_codes import raises
from photogram import Block, Camera, InputError, Result, adjust, adjust_in_parts, read_result
from photogram.distributed import Division
from photogram.network import Bend, Figure, Mount, Sensor, rotation_angles

NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
FLIP = np.diag([1.0, -1.0, -1.0])


@cache
def golden() -> dict[str, Any]:
    found: dict[str, Any] = golden_file("targets", "rig_small.json")
    return found


def shifts(columns: int, rows: int) -> np.ndarray:
    """Return (n, 2, 3) e_x and e_y of a chessboard whose corners stay (mrcal's two parabolas)."""
    y, x = np.mgrid[:rows, :columns]
    a, b = (x / (columns - 1)).ravel(), (y / (rows - 1)).ravel()
    found = np.zeros((len(a), 2, 3))
    found[:, 0, 2], found[:, 1, 2] = 4 * a * (1 - a), 4 * b * (1 - b)
    return found


def board() -> Block:
    """Return the block of the golden rig, a photo for each view and camera, from its truth on."""
    data = golden()
    columns, rows, spacing = (data["board"][name] for name in ("columns", "rows", "spacing"))
    y, x = np.mgrid[:rows, :columns] * spacing
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    turns, places = np.array(data["truth"]["R"]), np.array(data["truth"]["t"])
    between = data["truth"]["sensor1"]
    sensor = Sensor.from_colmap("right", between["R"], between["t"])
    views = range(len(turns))
    photos = [f"{view}_{camera}" for camera in (0, 1) for view in views]
    both = [(turns, places), (between["R"] @ turns, places @ np.transpose(between["R"]) + between["t"])]
    centres = [-np.einsum("vji,vj->vi", turn, place) for turn, place in both]
    attitudes = [rotation_angles(FLIP @ turn) for turn, _ in both]
    view, camera, corner, column, row, level = np.array(data["corners"]).T
    names = [f"{number}" for number in range(len(points))]
    return Block(
        photo_ids=photos,
        photo_positions=np.vstack(centres),
        photo_attitudes=np.vstack(attitudes),
        point_ids=names,
        point_positions=points,
        point_sd=0.0,
        image_photos=(view + camera * len(views)).astype(int),
        image_points=corner.astype(int),
        image_xy=np.column_stack([column, row]),
        image_sd=np.repeat(0.3 * 2.0**level, 2).reshape(-1, 2),
        cameras=[
            Camera("opencv", dict(zip(NAMES, own, strict=True)), np.inf, f"camera {number}")
            for number, own in enumerate(data["truth"]["cameras"])
        ],
        photo_cameras=np.repeat([0, 1], len(views)),
        mounts=[Mount(f"{view}_1", f"{view}_0", sensor) for view in views],
        passages=[Figure(Bend("board"), names, shifts(columns, rows))],
    )


@cache
def adjusted() -> Result:
    return adjust(board())


def test_golden_cost_and_bend() -> None:
    wanted, result = golden()["two_parabolas"], adjusted()
    assert result.sum_and_freedom == (pytest.approx(wanted["cost"], rel=1e-10), wanted["dof"])
    bend = next(each for each in result.unknowns if each.given.KIND == "bend")
    cofactors = np.array(wanted["cofactors_camera_sensor_bend"])
    sd = np.sqrt(np.diag(cofactors))
    np.testing.assert_allclose(bend.position[:2], wanted["bend"], atol=1e-6 * sd[-2:].min(), rtol=0)
    np.testing.assert_allclose(bend.cofactors, cofactors[-2:, -2:], rtol=1e-6)
    for number, own in enumerate(wanted["cameras"]):
        camera = result.cameras[number].camera
        values = [camera.parameters[name] for name in NAMES]
        off = np.abs(np.array(values) - own) / sd[8 * number : 8 * number + 8]
        assert off.max() < 1e-6


def test_places_of_points_follow_with_their_cofactors() -> None:
    result = adjusted()
    bend = next(each for each in result.unknowns if each.given.KIND == "bend")
    by = shifts(9, 7)
    places = result.block.point_positions + np.einsum("nki,k->ni", by, bend.position[:2])
    np.testing.assert_allclose(result.point_positions, places, atol=1e-12)
    cofactors = np.einsum("nki,kl,nlj->nij", by, bend.cofactors, by)
    np.testing.assert_allclose(result.point_cofactors, cofactors, atol=1e-18)


def test_redundancy_numbers_sum_to_the_degrees_of_freedom() -> None:
    result = adjusted()
    assert result.redundancy.sum() == pytest.approx(result.degrees_of_freedom, rel=1e-9)


def test_a_held_figure_is_a_board_of_that_shape() -> None:
    """Numbers that are known shift the points once and for all."""
    own = board()
    held = Figure(Bend("board", (3e-4, -1e-4), 0.0), own.point_ids, shifts(9, 7))
    moved = own.point_positions + np.einsum("nki,k->ni", shifts(9, 7), [3e-4, -1e-4])
    bent, plain = (
        adjust(own.replace(passages=[held])),
        adjust(own.replace(passages=[], point_positions=moved)),
    )
    assert bent.sum_and_freedom == (
        pytest.approx(plain.sum_and_freedom[0], rel=1e-12),
        plain.sum_and_freedom[1],
    )
    np.testing.assert_allclose(bent.point_positions, plain.point_positions, atol=1e-15)


def test_points_of_a_figure_are_fixed_and_there() -> None:
    own = board()
    with raises(InputError, "error.absent"):
        own.replace(passages=[Figure(Bend("board"), ["nowhere"], np.zeros((1, 2, 3)))])
    with raises(InputError, "block.figure-point"):
        own.replace(point_sd=1e-4)


def test_parts_and_other_frames_refuse_what_they_do_not_know() -> None:
    with raises(InputError, "block.unsupported.passage"):
        adjust_in_parts(board(), Division(parts=2))


def test_a_result_is_saved_and_read(tmp_path: Path) -> None:
    adjusted().to_parquet(tmp_path / "result")
    again = read_result(tmp_path / "result")
    np.testing.assert_array_equal(again.point_positions, adjusted().point_positions)
    assert isinstance(again.block.passages[0], Figure)
