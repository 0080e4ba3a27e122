"""The Strasbourg block: real measurements against the solutions of two independent programs.

The data stay outside the repository; its README says what a test may assert.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from photogram import AsPublished, Block, Result, adjust
from photogram.giant import read_project

PIXEL = 0.006
PRINCIPAL_POINT = (26.5770, 38.8110)


@pytest.fixture(scope="module")
def block(strasbourg: Path) -> Block:
    return read_project(strasbourg / "giant").to_block()


@pytest.fixture(scope="module")
def result(block: Block) -> Result:
    return adjust(block, unit_variance="free")


@pytest.fixture(scope="module")
def expected(strasbourg: Path) -> dict[str, Any]:
    return json.loads((strasbourg / "giant" / "expected.json").read_text())


# giant/expected.json, from the coarse initial orientations of FRAMES


def test_sums_of_squares_and_variance(result, expected):
    assert result.converged
    sums = expected["weighted_sum_of_squares"]
    assert result.sums_of_squares.plates == pytest.approx(sums["plates"], rel=1e-6)
    assert result.sums_of_squares.ground == pytest.approx(sums["ground"], rel=1e-6)
    assert result.degrees_of_freedom == expected["degrees_of_freedom"]
    assert result.variance_of_unit_weight == pytest.approx(expected["variance_of_unit_weight"], rel=1e-6)
    assert list(result.dropped) == expected["dropped_single_ray_pass_points"]


def test_orientations_and_their_deviations(result, expected):
    photos = [expected["frames"][name] for name in result.block.photo_ids]
    assert len(photos) == len(expected["frames"]) == 5
    positions = [[photo[axis] for axis in "XYZ"] for photo in photos]
    np.testing.assert_allclose(result.photo_positions, positions, rtol=0, atol=1e-5)
    angles = np.radians([[photo[f"{name}_deg"] for name in ("omega", "phi", "kappa")] for photo in photos])
    np.testing.assert_allclose(result.photo_attitudes, angles, rtol=0, atol=1e-8)
    names = ["X", "Y", "Z", "omega_rad", "phi_rad", "kappa_rad"]
    deviations = [[photo["sd"][name] for name in names] for photo in photos]
    np.testing.assert_allclose(result.photo_sd, deviations, rtol=1e-4)


def test_points_and_their_deviations(result, expected):
    rows = [result.block.point_ids.index(name) for name in expected["points"]]
    points = list(expected["points"].values())
    assert len(points) == 16
    positions = [point["xyz"] for point in points]
    np.testing.assert_allclose(result.point_positions[rows], positions, rtol=0, atol=1e-5)
    np.testing.assert_allclose(result.point_sd[rows], [point["sd"] for point in points], rtol=1e-4)


def test_check_points(result, expected):
    assert sorted(np.array(result.block.point_ids)[result.point_kinds == "check"]) == ["351", "410"]
    for name, difference in expected["check_points"].items():
        row = result.block.point_ids.index(name)
        np.testing.assert_allclose(result.point_differences[row], difference["dXYZ"], rtol=0, atol=1e-5)


def test_control_on_one_photo_stays(result):
    row = result.block.point_ids.index("403")
    assert (result.point_rays[row], result.point_kinds[row]) == (1, "control")


# expected_dbat.json, from the measurements in pixels with two standard deviations


@pytest.fixture(scope="module")
def dbat_block(strasbourg: Path, block: Block) -> Block:
    measured = []
    for file, pixels in (("markpts.txt", 0.5), ("smartpts.txt", 1.0)):
        table = pd.read_csv(
            strasbourg / file, comment="#", names=["point", "photo", "column", "row"], skipinitialspace=True
        )
        measured.append(table.assign(sd_x_mm=pixels * PIXEL, sd_y_mm=pixels * PIXEL))
    images = pd.concat(measured)
    images["x_mm"] = images["column"] * PIXEL - PRINCIPAL_POINT[0]
    images["y_mm"] = PRINCIPAL_POINT[1] - images["row"] * PIXEL
    names = ["point", "label", "X", "Y", "Z", "sd_X", "sd_Y", "sd_Z"]
    control = pd.read_csv(strasbourg / "control.txt", comment="#", names=names, skipinitialspace=True)
    control.loc[control["point"].isin([351, 410]), ["sd_X", "sd_Y", "sd_Z"]] = np.inf
    attitudes = np.degrees(block.photo_attitudes)
    photos = pd.DataFrame(np.hstack([block.photo_positions, attitudes]), index=range(1, 6))
    photos.columns = ["X", "Y", "Z", "omega_deg", "phi_deg", "kappa_deg"]
    photos["photo"] = photos.index
    return Block.from_tables(photos, images, control, principal_distance=-123.9392)


@pytest.fixture(scope="module")
def dbat(strasbourg: Path) -> dict[str, Any]:
    return json.loads((strasbourg / "expected_dbat.json").read_text())


@pytest.fixture(scope="module")
def dbat_result(dbat_block: Block) -> Result:
    # To the last of DBAT's digits.
    return adjust(dbat_block, tolerance=1e-9)


def test_counts_of_dbat(dbat_result, dbat):
    block = dbat_result.block
    held = np.isfinite(block.point_sd).sum()
    assert (block.image_xy.size, held) == (dbat["image_observations"], dbat["control_observations"])
    assert 6 * len(block.photo_ids) + 3 * dbat_result.used_points.sum() == dbat["unknowns"]
    assert dbat_result.degrees_of_freedom == dbat["redundancy"]
    assert dbat_result.redundancy.sum() + dbat_result.point_redundancy.sum() == pytest.approx(
        dbat["redundancy"], rel=1e-9
    )


def test_sigma0_of_dbat(dbat_result, dbat):
    assert dbat_result.converged
    assert np.sqrt(dbat_result.variance_of_unit_weight) == pytest.approx(dbat["sigma0"], abs=0.5e-4)


def test_orientations_of_dbat(dbat_result, dbat):
    # Positions have six decimals, less than a millionth of a standard deviation: DBAT itself has iterated to
    # that only, so a unit of the last digit is allowed. Angles agree to half a unit.
    table = dbat_result.photo_table().set_index("photo")
    for name, photo in dbat["photos"].items():
        for column in ("X", "Y", "Z", "omega_deg", "phi_deg", "kappa_deg"):
            tolerance = 0.5e-6 if column.endswith("deg") else 1e-6
            assert table.loc[name, column] == pytest.approx(photo[column], abs=tolerance), (name, column)
            # Three digits are printed.
            deviation = photo[f"sd_{column}"]
            half_a_unit = 0.5 * 10.0 ** (np.floor(np.log10(deviation)) - 2)
            assert table.loc[name, f"sd_{column}"] == pytest.approx(deviation, abs=half_a_unit), (
                name,
                column,
            )


# The iteration of the 1987 program


@pytest.mark.parametrize("percent", [5.0, 1.0, 1e-6])
def test_as_published_stops_by_the_percent_criterion(block, result, percent):
    published = adjust(block, unit_variance="free", tolerance=AsPublished(percent), max_iterations=9)
    assert published.status == "converged"
    sums = np.array([iteration.weighted_sum_of_squares for iteration in published.iterations])
    change = 100 * np.abs(np.diff(sums)) / sums[:-1]
    assert len(sums) >= 2
    assert change[-1] < percent
    assert (change[:-1] >= percent).all()
    assert all(iteration.damping == 0 for iteration in published.iterations)
    assert published.sums_of_squares.total == pytest.approx(sums[-1], rel=1e-12)
    assert published.sums_of_squares.total >= result.sums_of_squares.total * (1 - 1e-12)


def test_as_published_stops_at_the_limit(block):
    published = adjust(block, tolerance=AsPublished(1e-12), max_iterations=2)
    assert (published.status, len(published.iterations)) == ("not converged", 2)


def turned(block: Block, angle: int) -> Block:
    """Start with one of the angles of the second photo wrong by a radian."""
    attitudes = block.photo_attitudes.copy()
    attitudes[1, angle] += 1.0
    return block.replace(photo_attitudes=attitudes)


@pytest.mark.parametrize("angle", [0, 2], ids=["omega", "kappa"])
def test_as_published_knows_divergence(block, angle):
    published = adjust(turned(block, angle), tolerance=AsPublished(5.0), max_iterations=9)
    assert published.status == "diverged"
    sums = [iteration.weighted_sum_of_squares for iteration in published.iterations]
    assert sums[-1] > sums[-2] * 1.05


def test_step_control_converges_where_full_steps_diverge(block, result):
    controlled = adjust(turned(block, 0))
    assert controlled.converged
    assert max(iteration.damping for iteration in controlled.iterations) > 0
    sums = [iteration.weighted_sum_of_squares for iteration in controlled.iterations]
    assert (np.diff(sums) <= 1e-9 * np.array(sums[:-1])).all()
    # The wrong angle is an observation too, of 90 degrees standard deviation: it draws at the photo a little.
    assert controlled.sums_of_squares.plates == pytest.approx(result.sums_of_squares.plates, rel=1e-6)
    np.testing.assert_allclose(controlled.photo_attitudes, result.photo_attitudes, rtol=0, atol=1e-6)


# Invariance


ARRAYS = ["photo_positions", "photo_attitudes", "photo_cofactors", "point_positions", "point_cofactors"]
ARRAYS += ["residuals", "redundancy", "standardized", "photo_redundancy", "point_redundancy"]


def test_a_shift_of_the_origin_changes_nothing(block, result):
    shift = np.array([1e6, -1e6, 1e6])
    moved = adjust(
        block.replace(
            photo_positions=block.photo_positions + shift, point_positions=block.point_positions + shift
        ),
        unit_variance="free",
    )
    # Coordinates of 2e6 m have a spacing of 2.3e-10 m: control moves by half of it where the shift is added,
    # and again where results are stored. The network passes on less than ten times that.
    for name in ("photo_positions", "point_positions"):
        np.testing.assert_allclose(getattr(moved, name) - shift, getattr(result, name), rtol=0, atol=5e-9)
    np.testing.assert_allclose(moved.photo_attitudes, result.photo_attitudes, rtol=0, atol=5e-12)
    np.testing.assert_allclose(moved.residuals, result.residuals, rtol=0, atol=1e-10)
    np.testing.assert_allclose(moved.photo_sd, result.photo_sd, rtol=1e-9)
    np.testing.assert_allclose(moved.point_sd, result.point_sd, rtol=1e-9)
    assert moved.variance_of_unit_weight == pytest.approx(result.variance_of_unit_weight, rel=1e-9)


@pytest.mark.parametrize("threads", [2, 4])
def test_bits_do_not_depend_on_the_number_of_threads(block, threads):
    one, more = (adjust(block, threads=number) for number in (1, threads))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(one, name), getattr(more, name), err_msg=name)
    assert one.iterations == more.iterations


def test_the_order_of_photos_points_and_images_changes_nothing(block, result):
    random = np.random.default_rng(11)
    photos, points, images = (
        random.permutation(count)
        for count in (len(block.photo_ids), len(block.point_ids), len(block.image_xy))
    )
    shuffled = adjust(
        block.replace(
            **{name: getattr(block, name)[photos] for name in (
                "photo_positions", "photo_attitudes", "principal_distances", "photo_position_sd",
                "photo_attitude_sd",
            )},
            **{name: getattr(block, name)[points] for name in ("point_positions", "point_sd")},
            **{name: getattr(block, name)[images] for name in ("image_xy", "image_sd")},
            photo_ids=[block.photo_ids[photo] for photo in photos],
            point_ids=[block.point_ids[point] for point in points],
            image_photos=np.argsort(photos)[block.image_photos[images]],
            image_points=np.argsort(points)[block.image_points[images]],
        ),
        unit_variance="free",
    )  # fmt: skip
    order = {"photo": photos, "point": points}
    for name in ARRAYS:
        there, here = getattr(shuffled, name), getattr(result, name)[order.get(name.split("_")[0], images)]
        scale = 1.0 if "positions" not in name else 1e-3
        np.testing.assert_allclose(there, here, rtol=1e-8 * scale, atol=1e-9, err_msg=name)
