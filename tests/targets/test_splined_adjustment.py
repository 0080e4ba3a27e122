"""A lens of knots, a board that bends: the golden adjustment of mrcal's splined camera."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from golden_data import golden as golden_file
from message_codes import raises
from photogram import Block, Camera, InputError, Result, adjust, adjust_in_parts
from photogram.distributed import Division
from photogram.network import Bend, Figure, rotation_angles, rotation_matrix

FLIP = np.diag([1.0, -1.0, -1.0])
ACROSS = 10.0
"""mrcal holds knots so much tighter across the radius than along it."""


@cache
def golden() -> dict[str, Any]:
    found: dict[str, Any] = golden_file("targets", "splined.json")["adjusted"]
    return found


def lens() -> Camera:
    """Return the camera with mrcal's regularisation, knots zero."""
    model, scale = golden()["model"], golden()["regularisation_scale"]
    rows, columns = model["ny"], model["nx"]
    sd = np.broadcast_to([1 / scale, 1 / (ACROSS * scale)], (rows, columns, 2)).copy()
    core = dict(zip(("fx", "fy", "cx", "cy"), golden()["core_held"], strict=True))
    return Camera("splined_stereographic", core | model, name="own", knot_sd=sd)


def board() -> Block:
    data = golden()
    columns, rows, spacing = (data["board"][name] for name in ("columns", "rows", "spacing"))
    y, x = (each.ravel() for each in np.mgrid[:rows, :columns])
    a, b = x / (columns - 1), y / (rows - 1)
    shifts = np.zeros((len(a), 2, 3))
    shifts[:, 0, 2], shifts[:, 1, 2] = 4 * a * (1 - a), 4 * b * (1 - b)
    turns, places = (np.array(data["start"][name]) for name in ("R", "t"))
    view, corner, *xy = np.array(data["corners"]).T
    names = [f"{number}" for number in range(len(a))]
    return Block(
        photo_positions=-np.einsum("vji,vj->vi", turns, places),
        photo_attitudes=rotation_angles(FLIP @ turns),
        point_ids=names,
        point_positions=spacing * np.column_stack([x, y, np.zeros(len(x))]),
        point_sd=0.0,
        image_photos=view.astype(int),
        image_points=corner.astype(int),
        image_xy=np.column_stack(xy),
        image_sd=1.0,
        cameras=[lens()],
        photo_cameras=np.zeros(len(turns), dtype=int),
        passages=[Figure(Bend("board"), names, shifts)],
    )


@cache
def adjusted() -> Result:
    return adjust(board(), tolerance=1e-9)


def test_golden_cost_and_redundancy() -> None:
    wanted, result = golden()["solution"], adjusted()
    assert result.sum_and_freedom[0] == pytest.approx(wanted["cost"], rel=1e-10)
    assert result.redundancy.sum() == pytest.approx(wanted["redundancy_images"], rel=1e-8)
    of_knots = sum(kind.redundancy.sum() for kind in result.kinds.values())
    assert of_knots == pytest.approx(wanted["redundancy_regularisation"], rel=1e-7)


def test_golden_knots_with_their_deviations() -> None:
    wanted, result = golden()["solution"], adjusted()
    own = [each for each in result.unknowns if each.given.KIND == "knot"]
    values = np.concatenate([each.position[:2] for each in own])
    sd = np.sqrt(np.concatenate([np.diag(each.cofactors) for each in own]))
    np.testing.assert_allclose(sd, wanted["sd_knots"], rtol=1e-6)
    assert (np.abs(values - wanted["knots"]) / sd).max() < 1e-6
    np.testing.assert_array_equal(result.cameras[0].camera.knots.ravel(), values)


def test_golden_poses_and_bend() -> None:
    wanted, result = golden()["solution"], adjusted()
    bend = next(each for each in result.unknowns if each.given.KIND == "bend")
    sd = np.sqrt(np.diag(bend.cofactors))
    assert (np.abs(bend.position[:2] - wanted["bend"]) / sd).max() < 1e-6
    turns = FLIP @ rotation_matrix(result.photo_attitudes)
    np.testing.assert_allclose(turns, wanted["R"], atol=1e-8)


def test_a_start_far_away_ends_in_the_same_place() -> None:
    """Images then move on to other knots than those that they began with."""
    block = board()
    knots = np.zeros((8, 10, 2))
    knots[..., 0] = 0.02 * np.sin(np.arange(10))
    moved = block.replace(cameras=[lens().replace(knots=knots)])
    again = adjust(moved)
    assert again.converged
    assert again.sum_and_freedom[0] == pytest.approx(golden()["solution"]["cost"], rel=1e-9)


def test_chords_lead_to_the_solution_where_steps_creep() -> None:
    """A loss that leaves everything as it is takes plain steps, each a fifth of the one before."""
    plain, result = adjust(board(), loss=("huber", 1e6)), adjusted()
    assert [result.formations, plain.formations] == [3, 8]
    assert result.iterations[-1].largest_change < 1e-8
    sd = np.sqrt(np.diagonal(plain.photo_cofactors, axis1=1, axis2=2))
    assert (np.abs(result.photo_attitudes - plain.photo_attitudes) / sd[:, 3:]).max() < 1e-4


def test_parts_refuse_unknown_knots() -> None:
    with raises(InputError, "block.unsupported.passage") as raised:
        adjust_in_parts(board().replace(passages=[]), Division(parts=2))
    assert "knots" in str(raised.value)
