"""Bad input through the Python API: an exception that names what is wrong, or a message; never a panic."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pandas as pd
import pytest

from message_codes import raises
from photogram import (
    AdjustmentError,
    AsPublished,
    Block,
    InputError,
    Progress,
    RankError,
    Spheroid,
    adjust,
    simulate,
)
from photogram.network import project
from photogram.words import phrase

# Arrays


def set_at(name: str, index: Any, value: Any):
    def spoil(arrays: dict[str, Any]) -> None:
        arrays[name][index] = value

    return spoil


def replace(name: str, change: Any):
    def spoil(arrays: dict[str, Any]) -> None:
        arrays[name] = change(arrays[name])

    return spoil


SPOILT = {
    "photo positions too few": (
        replace("photo_positions", lambda a: a[1:]),
        r"photo_positions.*\(6, 3\), got \(5, 3\)",
    ),
    "photo positions flat": (replace("photo_positions", np.ravel), r"photo_positions: must .*, got \(18,\)"),
    "attitudes with two angles": (
        replace("photo_attitudes", lambda a: a[:, :2]),
        r"photo_attitudes: must have the shape",
    ),
    "distances too many": (
        replace("principal_distances", lambda a: np.append(a, 1.0)),
        r"principal_distances.*\(7,\)",
    ),
    "image coordinates too few": (replace("image_xy", lambda a: a[1:]), r"image_xy: must have the shape"),
    "image sd too few": (replace("image_sd", lambda a: a[1:]), r"image_sd: must have the shape"),
    "point sd too few": (replace("point_sd", lambda a: a[1:]), r"point_sd: must have the shape"),
    "words for numbers": (
        replace("image_xy", lambda a: [["one", "two"]] * len(a)),
        r"image_xy\[0\]\[0\]: must be a number",
    ),
    "ragged": (
        replace("photo_positions", lambda a: [[1.0, 2.0], [3.0]]),
        r"photo_positions\[1\]: must have 2 values, got 1",
    ),
    "photo at infinity": (
        set_at("photo_positions", (2, 1), math.inf),
        "block.value.not-infinite",
    ),
    "angle infinite": (
        set_at("photo_attitudes", (0, 0), math.inf),
        "block.value.angle",
    ),
    "distance NaN": (
        set_at("principal_distances", 1, math.nan),
        "block.value.not-zero",
    ),
    "distance zero": (set_at("principal_distances", 1, 0.0), "block.value.not-zero"),
    "image NaN": (
        set_at("image_xy", (3, 0), math.nan),
        "block.value.finite",
    ),
    "point infinite": (set_at("point_positions", (4, 2), math.inf), "block.value.not-infinite"),
    "sd negative": (
        set_at("photo_position_sd", (1, 0), -1.0),
        "block.value.sd",
    ),
    "sd NaN": (set_at("photo_attitude_sd", (1, 0), math.nan), "block.value.sd"),
    "point sd negative": (set_at("point_sd", (0, 0), -0.1), "block.value.sd"),
    "image sd zero": (
        set_at("image_sd", (0, 1), 0.0),
        "block.value.positive",
    ),
    "image sd infinite": (set_at("image_sd", (0, 1), math.inf), "block.value.positive"),
    "photo index too large": (set_at("image_photos", 5, 6), r"image_photos\[5\].* from 0 to 5, got 6"),
    "photo index negative": (set_at("image_photos", 5, -1), r"image_photos\[5\].* from 0 to 5, got -1"),
    "point index too large": (
        set_at("image_points", 0, 10**12),
        r"image_points\[0\]: must be an integer from 0 to [0-9]+, got 1000000000000",
    ),
    "indices with fractions": (
        replace("image_points", lambda a: a + 0.5),
        "image_points: must be an array of",
    ),
    "indices too few": (replace("image_points", lambda a: a[1:]), "image_points: must have the shape"),
    "photo twice": (set_at("photo_ids", 3, "0101"), "error.repeated"),
    "point twice": (replace("point_ids", lambda ids: [*ids[:-1], ids[0]]), "point_ids: .* more than once"),
    "names too few": (replace("photo_ids", lambda ids: ids[1:]), r"photo_positions: must have the shape"),
}


@pytest.mark.parametrize("case", SPOILT)
def test_arrays_that_cannot_be(case, bad_block):
    spoil, message = SPOILT[case]
    Block(**bad_block)
    spoil(bad_block)
    with raises(InputError, message):
        Block(**bad_block)


def test_a_held_component_needs_a_value(bad_block):
    row = int(np.flatnonzero(np.isnan(bad_block["point_positions"][:, 0]))[0])
    bad_block["point_sd"][row] = [0.1, np.inf, np.inf]
    with raises(InputError, "block.value.control-unknown"):
        Block(**bad_block)


# Tables


@pytest.fixture
def tables() -> dict[str, Any]:
    photos = {
        "photo": ["A", "B"], "X": [0.0, 500.0], "Y": [0.0, 0.0], "Z": [1000.0, 1000.0],
        "omega_deg": [0.0, 0.0], "phi_deg": [0.0, 0.0], "kappa_deg": [0.0, 0.0],
    }  # fmt: skip
    images = {"photo": ["A", "B"], "point": ["1", "1"], "x_mm": [25.0, -25.0], "y_mm": [0.0, 0.0]}
    points = {"point": ["1"], "X": [250.0], "Y": [0.0], "Z": [0.0], "sd_X": [0.1]}
    return {"photos": photos, "images": images, "points": points, "principal_distance": -100.0}


@pytest.mark.parametrize(
    ("table", "column"),
    [
        ("photos", "Y"),
        ("photos", "kappa_deg"),
        ("images", "photo"),
        ("images", "point"),
        ("images", "y_mm"),
        ("points", "point"),
        ("points", "Z"),
    ],
)
def test_columns_that_are_missing(tables, table, column):
    Block.from_tables(**tables)
    for form in (dict, pd.DataFrame):
        columns = {name: values for name, values in tables[table].items() if name != column}
        with raises(InputError, "error.absent"):
            Block.from_tables(**{**tables, table: form(columns)})


def test_photos_without_names_are_numbers_and_images_that_know_others_are_told(tables):
    photos = {name: values for name, values in tables["photos"].items() if name != "photo"}
    numbered = {**tables["images"], "photo": [0, 1]}
    assert Block.from_tables(**{**tables, "photos": photos, "images": numbered}).photo_ids == ["0", "1"]
    with raises(InputError, "error.unknown"):
        Block.from_tables(**{**tables, "photos": photos})


def test_tables_that_cannot_be(tables):
    def from_tables(**changes: Any) -> None:
        Block.from_tables(**{**tables, **changes})

    with raises(InputError, "error.unknown"):
        from_tables(images={**tables["images"], "photo": ["A", "C"]})
    with raises(InputError, "error.requires"):
        from_tables(principal_distance=None)
    with raises(InputError, "error.repeated"):
        from_tables(
            photos={**tables["photos"], "photo": ["A", "A"]}, images={**tables["images"], "photo": ["A", "A"]}
        )
    with raises(InputError, "error.repeated"):
        from_tables(points={name: values * 2 for name, values in tables["points"].items()})
    with pytest.raises(InputError, match="photos, column Z"):
        from_tables(photos={**tables["photos"], "Z": ["high", "low"]})
    with pytest.raises(InputError, match=r"photos, column Z: must have the shape \(2,\), got \(1,\)"):
        from_tables(photos={**tables["photos"], "Z": [1000.0]})
    with pytest.raises(InputError, match=r"images, column y_mm: must have the shape \(2,\), got \(3,\)"):
        from_tables(images={**tables["images"], "y_mm": [0.0, 0.0, 0.0]})
    with raises(InputError, "block.value.finite"):
        from_tables(images={**tables["images"], "y_mm": [0.0, math.nan]})
    with raises(InputError, "error.absent"):
        from_tables(spheroid=Spheroid.wgs84())


# Options


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"unit_variance": "two"},
            "unit_variance: must be one of free, constrained, unity, redundancy, got 'two'",
        ),
        (
            {"ordering": "random"},
            "ordering: must be one of auto, input, rcm, amd, dissection, graph-dissection, got 'random'",
        ),
        ({"max_iterations": 0}, "error.least"),
        ({"tolerance": AsPublished(5.0), "max_iterations": 0}, "error.least"),
        ({"tolerance": 0.0}, "must be positive"),
        ({"tolerance": math.nan}, "must be positive"),
        ({"tolerance": AsPublished(-1.0)}, "must be positive"),
        ({"threads": 0}, "error.least"),
    ],
)
def test_options_that_cannot_be(small_block, options, message):
    with raises(InputError, message):
        adjust(small_block, **options)


# Rank trouble


def keep(block: Block, images: Any) -> Block:
    """Keep some of the images."""
    return block.replace(
        **{
            name: getattr(block, name)[images]
            for name in ("image_photos", "image_points", "image_xy", "image_sd")
        }
    )


def test_photo_without_images(small_block):
    """It harms nothing: it is named, and stays where it was given."""
    result = adjust(keep(small_block, small_block.image_photos != 3))
    assert result.converged
    (empty,) = [each for each in result.messages if each.code == "adjust.photos.empty"]
    assert empty.phrase.fields["photos"] == ["0201"]
    assert np.isnan(result.photo_sd[3]).all()
    assert np.isfinite(result.photo_sd[[0, 1, 2, 4, 5]]).all()
    np.testing.assert_array_equal(result.photo_positions[3], small_block.photo_positions[3])


def test_photo_with_two_images(small_block):
    of_photo = np.flatnonzero(small_block.image_photos == 3)
    rays = np.bincount(small_block.image_points, minlength=len(small_block.point_ids))
    two = of_photo[rays[small_block.image_points[of_photo]] > 2][:2]
    images = np.union1d(np.flatnonzero(small_block.image_photos != 3), two)
    result = adjust(keep(small_block, images))
    assert result.converged
    (loose,) = [each for each in result.messages if each.code == "adjust.photos.loose"]
    assert loose.phrase.fields["photos"] == ["0201"]
    assert np.isnan(result.photo_sd[3]).all()
    assert np.isfinite(result.photo_sd[[0, 1, 2, 4, 5]]).all()
    # Weights for it make up for what is missing.
    sd = np.full((6, 3), np.inf)
    sd[3] = 1e-4
    assert adjust(keep(small_block.replace(photo_attitude_sd=sd), images)).converged


def test_no_control_and_no_weights(small_block):
    free = small_block.replace(point_sd=np.array(np.inf))
    controlled = adjust(small_block)
    for tolerance in (1e-5, AsPublished()):
        result = adjust(free, tolerance=tolerance)
        assert result.converged
        # The middle photo of the first strip sees most; that of the other strip at the other end is farthest.
        assert result.messages[0].code == "free.minimum"
        assert "phi of 0102" in str(result.messages[0])
        assert str(result.messages[0]) in " ".join(result.report().split("Size")[0].split())
        assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom, abs=1e-6)
    # Distances are those of the scale that was held; their ratios are those of the controlled block.
    ratio = [
        np.linalg.norm(np.subtract(*each.photo_positions[[0, 2]]))
        / np.linalg.norm(np.subtract(*each.photo_positions[[0, 5]]))
        for each in (adjust(free), controlled)
    ]
    assert ratio[0] == pytest.approx(ratio[1], rel=1e-3)


def test_no_control_but_weights(small_block):
    weighted = small_block.replace(
        point_sd=np.array(np.inf), photo_position_sd=np.array(30.0), photo_attitude_sd=np.array(0.01)
    )
    result = adjust(weighted)
    assert result.converged
    assert result.messages[0].code == "free.weights.photos"
    assert str(result.messages[0]) in " ".join(result.report().split("Size")[0].split())


def test_block_in_two_parts(small_block):
    # The strips share no point any more: each can turn about the line through its two control points.
    first_strip = small_block.image_photos < 3
    tied = np.unique(small_block.image_points[first_strip])
    images = first_strip | ~np.isin(small_block.image_points, tied)
    with pytest.raises(RankError, match="leave 2 combinations") as caught:
        adjust(keep(small_block, images))
    for strip in ("0101, 0102, 0103", "0201, 0202, 0203"):
        assert f"1: moving the photos {strip}, which determine the points" in str(caught.value)


def test_parallel_rays():
    # The same photo twice: the rays of each point are one.
    block = simulate(strips=1, photos_per_strip=2, points_per_photo=10).block
    same = np.array([0, 0])
    first = block.image_photos == 0
    xy = block.image_xy.copy()
    xy[~first] = xy[first]
    block = block.replace(
        photo_positions=block.photo_positions[same], photo_attitudes=block.photo_attitudes[same], image_xy=xy
    )
    with pytest.raises(RankError) as caught:
        adjust(block.with_fixed_photos())
    assert caught.value.points
    assert all(name in str(caught.value) for name in caught.value.points[:12])
    with pytest.raises(RankError, match="point"):
        adjust(block)


# Points that are left out


def one_more(block: Block, held: list[bool]) -> Block:
    """Add a point that stands on the first photo only, with some components held."""
    position = np.array([[100.0, 50.0, 10.0]])
    first = [0]
    xy = project(
        position, block.photo_positions[first], block.photo_attitudes[first], block.principal_distances[first]
    )
    return block.replace(
        point_ids=[*block.point_ids, "ONE"],
        point_positions=np.vstack([block.point_positions, np.where(held, position, np.nan)]),
        point_sd=np.vstack([block.point_sd, np.where(held, 0.05, np.inf)]),
        image_photos=np.append(block.image_photos, 0),
        image_points=np.append(block.image_points, len(block.point_ids)),
        image_xy=np.vstack([block.image_xy, xy]),
        image_sd=np.vstack([block.image_sd, block.image_sd[:1]]),
    )


@pytest.mark.giant("6", "pass points on one photograph are dropped")
@pytest.mark.giant(
    "6", "control on one photograph with more than one missing component loses its control data"
)
@pytest.mark.parametrize(
    ("held", "reason"),
    [
        ([False, False, False], "pass-point-on-one-photo"),
        ([False, False, True], "control-point-on-one-photo"),
        ([True, False, False], "control-point-on-one-photo"),
    ],
)
def test_section_6_points_on_one_photo_are_left_out(small_block, held, reason):
    result = adjust(one_more(small_block, held))
    assert result.converged
    assert result.dropped == {"ONE": reason}
    sentence = str(phrase(f"reason.{reason}"))
    assert f"left out, {sentence}: ONE" in [message.text for message in result.messages]
    assert np.isnan(result.point_positions[-1]).all()
    assert np.isnan(result.residuals[-1]).all()
    assert (result.point_rays[-1], result.used_images[-1]) == (0, False)
    alone = adjust(small_block)
    np.testing.assert_array_equal(result.photo_positions, alone.photo_positions)
    assert result.degrees_of_freedom == alone.degrees_of_freedom


@pytest.mark.giant("6", "control on one photograph with at most one missing component stays")
@pytest.mark.giant("14", "21 control on one photograph with at most one missing component keeps its data")
@pytest.mark.parametrize("held", [[True, True, False], [False, True, True], [True, True, True]])
def test_section_6_control_on_one_photo_with_one_component_missing_stays(small_block, held):
    result = adjust(one_more(small_block, held))
    assert result.converged
    assert not result.dropped
    assert np.isfinite(result.point_positions[-1]).all()
    assert result.point_rays[-1] == 1
    assert result.degrees_of_freedom == adjust(small_block).degrees_of_freedom + 2 + sum(held) - 3


def test_control_without_images_is_left_out(small_block):
    block = small_block.replace(
        point_ids=[*small_block.point_ids, "FAR"],
        point_positions=np.vstack([small_block.point_positions, [[1.0, 2.0, 3.0]]]),
        point_sd=np.vstack([small_block.point_sd, [[0.1, 0.1, 0.1]]]),
    )
    result = adjust(block)
    assert result.dropped == {"FAR": "not-photographed"}
    assert result.degrees_of_freedom == adjust(small_block).degrees_of_freedom


# Nothing to adjust


def empty_block(photos: int = 0) -> Block:
    return Block(
        photo_ids=[str(i) for i in range(photos)],
        photo_positions=np.zeros((photos, 3)),
        photo_attitudes=np.zeros((photos, 3)),
        principal_distances=np.full(photos, -150.0),
        point_ids=[],
        point_positions=np.empty((0, 3)),
        image_photos=np.empty(0, dtype=int),
        image_points=np.empty(0, dtype=int),
        image_xy=np.empty((0, 2)),
        image_sd=np.empty((0, 2)),
    )


@pytest.mark.parametrize("photos", [0, 3])
def test_empty_blocks(photos):
    with pytest.raises(AdjustmentError, match="no point is left to adjust"):
        adjust(empty_block(photos))


def test_everything_left_out(small_block):
    _, first = np.unique(small_block.image_points, return_index=True)
    with pytest.raises(AdjustmentError, match="no point is left to adjust"):
        adjust(keep(small_block.replace(point_sd=np.array(np.inf)), first))


def test_control_at_the_projection_centre(small_block):
    """No ray leads there: it is left out, and named."""
    sd = small_block.point_sd.copy()
    positions = small_block.point_positions.copy()
    point = int(small_block.image_points[0])
    positions[point], sd[point] = small_block.photo_positions[0], 0.0
    result = adjust(small_block.replace(point_positions=positions, point_sd=sd))
    assert result.converged
    assert result.dropped[small_block.point_ids[point]] == "at-station"


def test_absurd_values_do_not_panic(small_block):
    for scale in (1e-150, 1e150):
        for name in ("image_xy", "photo_positions", "photo_attitudes", "image_sd", "principal_distances"):
            values = getattr(small_block, name) * scale
            try:
                result = adjust(small_block.replace(**{name: values}), max_iterations=5)
            except (AdjustmentError, InputError):
                continue
            assert result.status in ("converged", "not converged", "diverged")


# Stopping


def test_what_progress_raises_stops_the_run(small_block):
    class EnoughError(Exception):
        pass

    heard: list[Progress] = []

    def stop(progress: Progress) -> None:
        heard.append(progress)
        if progress.iteration is not None and progress.iteration.number == 2:
            raise EnoughError

    with pytest.raises(EnoughError):
        adjust(small_block, progress=stop)
    assert [p.iteration.number for p in heard if p.iteration] == [1, 2]


def test_progress_tells_of_every_iteration(small_block):
    heard: list[Progress] = []
    result = adjust(small_block, progress=heard.append)
    assert [progress.iteration for progress in heard if progress.iteration] == result.iterations


LARGE = """
import signal
from photogram import adjust, simulate
# A shell that starts a job in the background makes it ignore SIGINT.
signal.signal(signal.SIGINT, signal.default_int_handler)
block = simulate(strips=30, photos_per_strip=50, points_per_photo=100, attitude_error=0.02).block
def tell(progress):
    if progress.phase == "form":
        print("now", flush=True)
adjust(block, progress=tell, tolerance=1e-9)
print("through", flush=True)
"""


@pytest.mark.skipif(os.name != "posix", reason="sends SIGINT")
def test_ctrl_c_ends_a_large_adjustment():
    run = subprocess.Popen(
        [sys.executable, "-c", LARGE],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    watchdog = threading.Timer(60, run.kill)
    watchdog.start()
    try:
        assert run.stdout is not None
        assert run.stdout.readline() == "now\n"
        run.send_signal(signal.SIGINT)
        out, err = run.communicate()
    finally:
        watchdog.cancel()
    assert "through" not in out
    assert err.rstrip().endswith("KeyboardInterrupt")
    assert run.returncode == -signal.SIGINT
