"""Names, missing values and repeated images: refused by name, in every array and table."""

from __future__ import annotations

import math
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from message_codes import raises
from photogram import Block, InputError, adjust, predict, simulate
from photogram.collection import Collection

NO_NAMES = {
    "NaN": (math.nan, "must have a name, got nan"),
    "None": (None, "must have a name, got None"),
    "masked": (np.ma.masked, "must be a name|must have a name"),
    "empty": ("", "must have a name, got '"),
    "blank": ("  ", "must have a name, got '"),
    "float": (1.0, r"must be a name .*, got 1.0"),
    "truth value": (True, "must be a name .*, got True"),
    "bytes": (b"A", "must be a name"),
    "list": (["A"], "must be a name"),
    "surrogate": ("\ud800", "must contain printable characters only"),
    "line end": ("A\nB", "must contain printable characters only"),
}


@pytest.mark.parametrize("case", NO_NAMES)
@pytest.mark.parametrize("argument", ["photo_ids", "point_ids"])
def test_what_is_no_name(case, argument, bad_block):
    value, message = NO_NAMES[case]
    bad_block[argument][2] = value
    with pytest.raises(InputError, match=rf"{argument}\[2\].*({message})"):
        Block(**bad_block)


@pytest.mark.parametrize("value", ["ABCDEF", b"ABCDEF", 6, Path("photos.csv")])
def test_what_is_no_list_of_names(value, bad_block):
    bad_block["photo_ids"] = value
    with pytest.raises(InputError, match="photo_ids: must be a list of names"):
        Block(**bad_block)


def test_whole_numbers_are_names(bad_block):
    for names in (range(1, 7), np.arange(1, 7), pd.Series(range(1, 7)), np.array(list("123456"))):
        made = Block(**{**bad_block, "photo_ids": names})
        assert made.photo_ids == ["1", "2", "3", "4", "5", "6"]
        assert {type(name) for name in made.photo_ids} == {str}


@pytest.fixture
def tables(small_block) -> dict[str, pd.DataFrame]:
    """Return the small block as data frames."""
    block = small_block
    angles = np.degrees(block.photo_attitudes)
    photos = pd.DataFrame({"photo": block.photo_ids})
    photos[["X", "Y", "Z"]] = block.photo_positions
    photos[["omega_deg", "phi_deg", "kappa_deg"]] = angles
    points = pd.DataFrame({"point": block.point_ids})
    points[["X", "Y", "Z"]], points[["sd_X", "sd_Y", "sd_Z"]] = block.point_positions, block.point_sd
    images = pd.DataFrame(
        {
            "photo": np.array(block.photo_ids, dtype=object)[block.image_photos],
            "point": np.array(block.point_ids, dtype=object)[block.image_points],
        }
    )
    images[["x_mm", "y_mm"]] = block.image_xy
    return {"photos": photos, "images": images, "points": points}


@pytest.mark.parametrize("value", [math.nan, None, "", 1.0])
@pytest.mark.parametrize(
    ("table", "column"), [("images", "point"), ("images", "photo"), ("photos", "photo"), ("points", "point")]
)
def test_names_that_are_missing_in_tables(tables, table, column, value):
    Block.from_tables(**tables, principal_distance=-152.74)
    names = tables[table][column].astype(object)
    names[3] = value
    tables[table][column] = names
    with pytest.raises(InputError, match=rf"{table}, column {column}\[3\]"):
        Block.from_tables(**tables, principal_distance=-152.74)


def test_a_column_of_numbers_with_one_missing(tables):
    """Which pandas makes floating-point numbers: 12 in one table would be 12.0 in the other."""
    tables["photos"]["photo"] = range(6)
    tables["images"]["photo"] = tables["images"]["photo"].map(
        dict(zip(["0101", "0102", "0103", "0201", "0202", "0203"], range(6), strict=True))
    )
    assert Block.from_tables(**tables, principal_distance=-152.74).photo_ids == list("012345")
    tables["images"]["photo"] = tables["images"]["photo"].astype(float)
    with pytest.raises(InputError, match=r"images, column photo\[0\]: must be a name .*, got 0.0"):
        Block.from_tables(**tables, principal_distance=-152.74)


# The same point on the same photo


def test_a_point_has_one_image_on_a_photo(bad_block):
    for name in ("image_photos", "image_points"):
        bad_block[name] = np.append(bad_block[name], bad_block[name][4])
    for name in ("image_xy", "image_sd"):
        bad_block[name] = np.vstack([bad_block[name], bad_block[name][4:5]])
    len(bad_block["image_xy"]) - 1
    bad_block["point_ids"][bad_block["image_points"][4]]
    with raises(InputError, "block.repeated-image"):
        Block(**bad_block)


def test_the_order_of_images_does_not_matter(small_block):
    order = np.random.default_rng(1).permutation(len(small_block.image_xy))
    images = ("image_photos", "image_points", "image_xy", "image_sd")
    mixed = small_block.replace(**{name: getattr(small_block, name)[order] for name in images})
    np.testing.assert_allclose(
        adjust(mixed).photo_positions, adjust(small_block).photo_positions, rtol=0, atol=1e-6
    )


# Masks and types

ARRAYS = (
    "principal_distances", "image_xy", "image_sd", "photo_position_sd", "photo_attitude_sd", "point_sd",
    "image_photos", "image_points",
)  # fmt: skip


@pytest.mark.parametrize("name", ARRAYS)
def test_masks_are_not_ignored(name, bad_block):
    masked = np.ma.array(bad_block[name])
    Block(**{**bad_block, name: masked})
    masked[1] = np.ma.masked
    with pytest.raises(InputError, match=f"{name}: must not have masked values"):
        Block(**{**bad_block, name: masked})


def test_masked_coordinates_of_points_are_unknown(bad_block):
    positions = np.ma.masked_invalid(bad_block["point_positions"])
    made = Block(**{**bad_block, "point_positions": positions})
    np.testing.assert_array_equal(made.point_positions, bad_block["point_positions"])
    assert not np.ma.isMaskedArray(made.point_positions)


def test_masked_poses_are_unknown(bad_block):
    free = {**bad_block, "photo_position_sd": np.inf, "photo_attitude_sd": np.inf}
    for name in ("photo_positions", "photo_attitudes"):
        masked = np.ma.array(bad_block[name])
        masked[1] = np.ma.masked
        made = Block(**{**free, name: masked})
        assert np.isnan(getattr(made, name)).all(axis=1).tolist() == [False, True, False, False, False, False]


def test_masks_of_collections_are_not_ignored():
    arrays: dict[str, Any] = {
        "photo_parameters": np.ones((2, 9)), "point_positions": np.ones((3, 3)), "image_xy": np.ones((4, 2)),
        "image_photos": np.array([0, 0, 1, 1]), "image_points": np.array([0, 1, 0, 2]),
    }  # fmt: skip
    Collection(**arrays)
    for name, values in arrays.items():
        masked = np.ma.array(values)
        masked[1] = np.ma.masked
        with pytest.raises(InputError, match=f"{name}: must not have masked values"):
            Collection(**{**arrays, name: masked})


NO_NUMBERS = {
    "words": lambda a: a.astype(str),
    "complex": lambda a: a + 0j,
    "truth values": lambda a: a > 0,
    "times": lambda a: np.zeros(a.shape, dtype="datetime64[s]"),
    "spans": lambda a: np.zeros(a.shape, dtype="timedelta64[s]"),
    "objects": lambda a: np.full(a.shape, object()),
    "words as objects": lambda a: a.astype(str).astype(object),
    "None": lambda a: None,
    "a path": lambda a: Path("a.npy"),
    "a table": lambda a: {"X": 1.0},
    "huge": lambda a: np.full(a.shape, 10**400, dtype=object),
}


@pytest.mark.parametrize("case", NO_NUMBERS)
@pytest.mark.parametrize("name", [*ARRAYS, "point_positions"])
def test_what_is_no_array_of_numbers(name, case, bad_block):
    with pytest.raises(InputError, match=rf"{name}[\[\]0]*: must be an? "):
        Block(**{**bad_block, name: NO_NUMBERS[case](np.asarray(bad_block[name]))})


def test_real_numbers_of_every_kind_are_numbers(bad_block):
    expected = Block(**bad_block)
    for kind in (object, np.longdouble):
        made = Block(**{**bad_block, "image_xy": bad_block["image_xy"].astype(kind)})
        np.testing.assert_array_equal(made.image_xy, expected.image_xy)
    exact = np.array([[Fraction(1, 4), 2]] * len(bad_block["image_xy"]), dtype=object)
    assert Block(**{**bad_block, "image_xy": exact}).image_xy[0].tolist() == [0.25, 2.0]


@pytest.mark.parametrize("value", [2**63, 2**64 - 1, 2**64, -(2**70)])
def test_indices_beyond_64_bits(value, bad_block):
    indices = [int(index) for index in bad_block["image_points"]]
    indices[3] = value
    with pytest.raises(InputError, match=r"image_points(\[3\]|: must be an array of)"):
        Block(**{**bad_block, "image_points": indices})


@pytest.mark.parametrize(
    "change",
    [
        {"title": None}, {"title": "\ud800"}, {"linear_unit": 1}, {"photo_to_ground": "yes"},
        {"spheroid": (6378137.0, 6356752.3)}, {"refraction": "giant"}, {"no_field": 1},
    ],
)  # fmt: skip
def test_conventions_that_cannot_be(small_block, change):
    with pytest.raises(InputError, match=next(iter(change))):
        small_block.replace(**change)


@pytest.mark.parametrize("block", [None, "block", Path("block"), 1, {"photo_ids": []}])
@pytest.mark.parametrize("command", [adjust, predict])
def test_what_is_no_block(command, block):
    with raises(InputError, "error.kind"):
        command(block)


@pytest.mark.parametrize(
    "options",
    [
        {"unit_variance": None}, {"unit_variance": ["free"]}, {"ordering": np.array(["amd", "rcm"])},
        {"max_iterations": "50"}, {"max_iterations": 2**64}, {"max_iterations": 1.5}, {"tolerance": "1e-5"},
        {"tolerance": None}, {"tolerance": True}, {"loss": 1}, {"loss": ("huber", "2")},
        {"covariance": None}, {"covariance": np.zeros(3)}, {"covariance": "no"},
        {"threads": "2"}, {"threads": 2**64}, {"threads": True}, {"progress": 1},
    ],
)  # fmt: skip
def test_options_of_another_type(small_block, options):
    with pytest.raises(InputError):
        adjust(small_block, **options)


@pytest.mark.parametrize("value", ["4", None, 1j, [4], 10**400, object(), True])
@pytest.mark.parametrize(
    "argument",
    ["strips", "forward_overlap", "flying_height", "control_sd", "position_sd", "blunders", "spheroid",
     "seed", "refraction", "origin", "control"],
)  # fmt: skip
def test_arguments_of_a_simulation_of_another_type(argument, value):
    if value is None and argument in ("spheroid", "seed", "refraction"):
        return
    if argument == "seed" and value in (True, [4], 10**400):
        return
    with pytest.raises(InputError, match=argument):
        simulate(**{argument: value})


def test_simulations_that_are_too_large():
    with raises(InputError, "simulation.many-points"):
        simulate(forward_overlap=0.99999)
    with raises(InputError, "simulation.memory"):
        simulate(strips=10**6, photos_per_strip=10**6)
    with raises(InputError, "error.most"):
        simulate(principal_distance=-15274000.0, tilt=0.01)
    assert len(simulate(strips=1, photos_per_strip=12, forward_overlap=0.9).block.photo_ids) == 12


@pytest.mark.parametrize(
    "arguments",
    [
        {"principal_distance": math.inf}, {"principal_distance": 1e-3}, {"frame_size": 1e-320},
        {"frame_size": 2.0**64}, {"flying_height": 1e308}, {"flying_height": 1e-300},
        {"points_per_photo": 1e308}, {"control_sd": 1e308}, {"position_sd": 1e308}, {"position_sd": math.nan},
        {"attitude_sd": -1.0}, {"origin": (1e308, 0, 0)}, {"origin": (0, 0)}, {"photo_to_ground": None},
        {"blunder_size": 2**64},
    ],
)  # fmt: skip
def test_simulations_that_cannot_be(arguments):
    with pytest.raises(InputError, match=next(iter(arguments))):
        simulate(**arguments)


def test_angles_without_digits(bad_block):
    bad_block["photo_attitudes"][1, 2] = 1e16
    with raises(InputError, "block.value.angle"):
        Block(**bad_block)


def test_columns_that_are_no_lists(tables):
    for name, value in (("photo", (name for name in "ABCDEF")), ("photo", 6), ("photo", np.array("A"))):
        with raises(InputError, "not a list|must be a list"):
            Block.from_tables({**tables["photos"], name: value}, tables["images"], principal_distance=-152.74)
    for table in (None, "photos.csv", Path("photos.csv"), 1, [1]):
        with pytest.raises(InputError, match="photos"):
            Block.from_tables(table, tables["images"], principal_distance=-152.74)


# What was made stays as it is


def test_a_block_stays_as_it_is(bad_block):
    made = Block(**bad_block)
    before = {name: np.copy(getattr(made, name)) for name in ARRAYS}
    for name in ARRAYS:
        bad_block[name][:] = 0
        with pytest.raises(ValueError, match="read-only"):
            getattr(made, name)[0] = 0
    bad_block["photo_ids"][0] = "other"
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(made, name), before[name])
    assert made.photo_ids[0] == "0101"
    with pytest.raises(AttributeError):
        made.image_xy = before["image_xy"]


def test_a_read_only_view_is_not_trusted(bad_block):
    """Its owner can still write what it shows."""
    view = bad_block["image_xy"].view()
    view.flags.writeable = False
    made = Block(**{**bad_block, "image_xy": view})
    before = made.image_xy.copy()
    bad_block["image_xy"][:] = 0
    np.testing.assert_array_equal(made.image_xy, before)


def test_a_result_stays_as_it_is(small_block):
    block = small_block.replace()
    result = adjust(block)
    before = result.report(), result.to_json()
    block.photo_ids[0] = block.point_ids[0] = "another"
    assert (result.report(), result.to_json()) == before
    for name in ("photo_positions", "point_cofactors", "residuals", "point_rays"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(result, name)[0] = 0


def test_replacing_copies_only_what_is_new(small_block):
    other = small_block.replace(title="another")
    assert other.image_xy is small_block.image_xy
    assert other.photo_ids is not small_block.photo_ids
