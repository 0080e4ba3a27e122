"""Golden cases of the GIANT guide: points in fixed photos, degrees of freedom, scaling of covariances."""

from __future__ import annotations

import csv
import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from photogram import Block, Result, Spheroid, adjust, simulate
from photogram.network import project
from test_geometry import GIANT, GOLDEN, station

ARCSEC = 180 * 3600 / math.pi
UNIT_VARIANCE = GOLDEN["sample_block"]["unit_variance"]


def radians(dms: str) -> float:
    degrees, minutes, seconds = (float(part.lstrip("-")) for part in dms.split())
    value = math.radians(degrees + minutes / 60 + seconds / 3600)
    return -value if dms.startswith("-") else value


def one_point(case: dict[str, Any], position: Any, sd: Any) -> Result:
    """Adjust the point of a golden case in the adjusted photos of the sample."""
    frames = list(case["images_mm"])
    positions, attitudes = zip(*(station(frame) for frame in frames), strict=True)
    block = Block(
        photo_ids=frames,
        photo_positions=np.array(positions),
        photo_attitudes=np.array(attitudes),
        principal_distances=np.array(-152.740),
        point_ids=[case["point"]],
        point_positions=np.array([position]),
        point_sd=np.array([sd]),
        image_photos=np.arange(len(frames)),
        image_points=np.zeros(len(frames), dtype=int),
        image_xy=np.array(list(case["images_mm"].values())),
        image_sd=np.array(0.010),
        spheroid=Spheroid.clarke_1866(),
        photo_to_ground=True,
    )
    result = adjust(block.with_fixed_photos())
    assert result.converged
    np.testing.assert_array_equal(result.photo_positions, block.photo_positions)
    np.testing.assert_array_equal(result.photo_attitudes, block.photo_attitudes)
    return result


@pytest.mark.giant("15", "126!: two-ray intersection")
def test_section_15_pass_point_on_two_photos():
    case = GOLDEN["two_ray_pass_point"]
    result = one_point(case, [np.nan] * 3, [np.inf] * 3)
    longitude, latitude, height = result.point_positions[0]
    printed, tolerance = case["printed"], case["tolerance"]
    assert abs(longitude - radians(printed["lon"])) * ARCSEC < tolerance["lon_arcsec"]
    assert abs(latitude - radians(printed["lat"])) * ARCSEC < tolerance["lat_arcsec"]
    assert abs(height - printed["elev_m"]) < tolerance["elev_m"]
    # What an independent program finds from the same printed stations, to its last digit.
    computed = case["computed_minus_printed"]
    assert (longitude - radians(printed["lon"])) * ARCSEC == pytest.approx(computed["lon_arcsec"], abs=1e-6)
    assert (latitude - radians(printed["lat"])) * ARCSEC == pytest.approx(computed["lat_arcsec"], abs=1e-6)
    assert height - printed["elev_m"] == pytest.approx(computed["elev_m"], abs=1e-5)
    assert (result.degrees_of_freedom, result.point_rays.tolist()) == (1, [2])


@pytest.mark.giant("15", "SH960801: held planimetry")
def test_section_15_planimetric_control_on_two_photos():
    case = GOLDEN["two_ray_planimetric_control"]
    control = case["control"]
    sd = control["sd_arcsec"] / ARCSEC
    held = [radians(control["lon"]), radians(control["lat"]), np.nan]
    result = one_point(case, held, [sd, sd, np.inf])
    longitude, latitude = result.point_differences[0, :2] * ARCSEC
    printed, tolerance = case["printed"], case["tolerance"]
    assert abs(longitude - printed["dlon_arcsec"]) < tolerance["dlon_arcsec"]
    assert abs(latitude - printed["dlat_arcsec"]) < tolerance["dlat_arcsec"]
    assert abs(result.point_positions[0, 2] - printed["elev_m"]) < tolerance["elev_m"]
    computed = case["computed"]
    assert longitude == pytest.approx(computed["dlon_arcsec"], abs=1e-6)
    assert latitude == pytest.approx(computed["dlat_arcsec"], abs=1e-6)
    assert result.point_positions[0, 2] == pytest.approx(computed["elev_m"], abs=1e-5)
    assert result.degrees_of_freedom == 4 + 2 - 3


@pytest.mark.giant("15", "SH960202: held height")
@pytest.mark.giant("15", "covariances scaled by the unit variance 0.921")
def test_section_15_vertical_control_on_three_photos():
    case = GOLDEN["three_ray_vertical_control"]
    held = [np.nan, np.nan, case["height_held_at_m"]]
    result = one_point(case, held, [np.inf, np.inf, case["sd_height_m"]])
    longitude, latitude, height = result.point_positions[0]
    assert abs(height - case["computed_height_correction_m"]) < case["tolerance_m"]
    assert abs(height - case["printed"]["elev_m"]) < case["tolerance_m"]
    assert abs(longitude - radians(case["printed"]["lon"])) * ARCSEC < 0.0003
    assert abs(latitude - radians(case["printed"]["lat"])) * ARCSEC < 0.0003
    # Held much better than the rays can tell: the cofactor is all but the square of its standard deviation.
    # The listing prints 0.921e-4 for that times the unit variance 0.921, both rounded to three digits.
    assert result.point_cofactors[0, 2, 2] * UNIT_VARIANCE == pytest.approx(0.921e-4, abs=0.001e-4)


def table_e1_block() -> Block:
    """Three photos with 6, 10 and 7 images of ten points, two full and one height control (Appendix E)."""
    seen = [range(6), range(10), range(3, 10)]
    grid = np.array([[x, y] for y in (-600.0, 600.0) for x in (-800.0, -400.0, 0.0, 400.0, 800.0)])
    order = np.argsort(grid[:, 0], kind="stable")
    truth = np.column_stack([grid[order], 40.0 * np.sin(np.arange(10))])
    positions = np.array([[-600.0, 0.0, 1500.0], [0.0, 20.0, 1510.0], [600.0, -10.0, 1490.0]])
    attitudes = np.array([[0.01, 0.0, 0.02], [0.0, -0.01, 0.0], [-0.01, 0.01, -0.02]])
    photos = np.repeat(np.arange(3), [len(points) for points in seen])
    points = np.concatenate([np.array(each) for each in seen])
    xy = project(truth[points], positions[photos], attitudes[photos], np.full(23, -150.0))
    random = np.random.default_rng(7)
    held = np.zeros((10, 3), dtype=bool)
    held[[0, 8]] = True
    held[5, 2] = True
    return Block(
        photo_ids=["1", "2", "3"],
        photo_positions=positions,
        photo_attitudes=attitudes,
        principal_distances=np.array(-150.0),
        point_ids=[str(point) for point in range(10)],
        point_positions=np.where(held, truth, np.nan),
        point_sd=np.where(held, 0.1, np.inf),
        image_photos=photos,
        image_points=points,
        image_xy=xy + 0.005 * random.standard_normal(xy.shape),
        image_sd=np.array(0.005),
        photo_position_sd=np.array(5.0),
        photo_attitude_sd=np.array(0.01),
    )


@pytest.mark.giant("7", "0 free: n = m + c, u = s + p, plates and ground")
@pytest.mark.giant("7", "1 constrained: n = m + c + s, u = s + p, plates, ground and camera")
@pytest.mark.giant("7", "2: unit variance 1")
@pytest.mark.giant("7", "table E.1")
@pytest.mark.giant("14", "32 mode 2 prints the degrees of freedom of mode 0")
@pytest.mark.giant("15", "table E.1")
def test_section_7_degrees_of_freedom_of_table_e1():
    table = GOLDEN["unit_variance_table_E1"]
    block = table_e1_block()
    assert np.bincount(block.image_photos).tolist() == table["images_per_photo"]
    assert len(block.point_ids) == table["points"]
    assert np.isfinite(block.point_sd).sum() == table["control_components"]
    free, constrained, unity = (
        adjust(block, unit_variance=mode) for mode in ("free", "constrained", "unity")
    )

    assert free.degrees_of_freedom == table["case1_free"]["dof"] == 5
    sums = free.sums_of_squares
    assert sums.camera > 0
    assert free.variance_of_unit_weight == pytest.approx((sums.plates + sums.ground) / 5, rel=1e-15)

    assert constrained.degrees_of_freedom == table["case2_constrained"]["dof"] == 23
    assert constrained.variance_of_unit_weight == pytest.approx(
        (sums.plates + sums.ground + sums.camera) / 23, rel=1e-15
    )
    assert unity.variance_of_unit_weight == 1.0
    # Only the scale differs: the weights of the cameras are in force in all three.
    for other in (constrained, unity):
        np.testing.assert_array_equal(free.photo_positions, other.photo_positions)
        np.testing.assert_array_equal(free.point_cofactors, other.point_cofactors)


@pytest.mark.giant("6", "weighted sum of squares of plates, held ground components and camera components")
@pytest.mark.giant("14", "6 the sum is the total, listed in three parts")
@pytest.mark.parametrize("mode", ["free", "constrained"])
def test_section_6_sums_of_squares_are_those_of_the_residuals(mode):
    block = table_e1_block()
    result = adjust(block, unit_variance=mode)
    sums = result.sums_of_squares
    assert sums.plates == pytest.approx(((result.residuals / block.image_sd) ** 2).sum(), rel=1e-12)
    ground = np.nansum((result.point_differences / block.point_sd) ** 2)
    assert sums.ground == pytest.approx(ground, rel=1e-9)
    camera = (((result.photo_positions - block.photo_positions) / block.photo_position_sd) ** 2).sum()
    camera += (((result.photo_attitudes - block.photo_attitudes) / block.photo_attitude_sd) ** 2).sum()
    assert sums.camera == pytest.approx(camera, rel=1e-9)
    assert sums.total == sums.camera + sums.ground + sums.plates


@pytest.mark.giant("9", "blocks of the inverse normals times the unit variance")
@pytest.mark.parametrize("mode", ["free", "constrained", "unity"])
def test_section_9_covariances_are_cofactors_times_the_variance_of_unit_weight(mode):
    result = adjust(table_e1_block(), unit_variance=mode)
    assert result.variance_of_unit_weight == result.covariance_scale
    np.testing.assert_array_equal(
        result.photo_covariances, result.photo_cofactors * result.variance_of_unit_weight
    )
    np.testing.assert_array_equal(
        result.point_covariances, result.point_cofactors * result.variance_of_unit_weight
    )
    diagonal = np.diagonal(result.photo_covariances, axis1=1, axis2=2)
    np.testing.assert_array_equal(result.photo_sd, np.sqrt(diagonal))


@pytest.mark.giant("7", "degrees of freedom not positive: reported, undefined, scale 1")
def test_section_7_without_degrees_of_freedom_covariances_are_cofactors():
    # Two photos without control: the weights of the photos determine them, but do not count.
    block = simulate(
        strips=1, photos_per_strip=2, points_per_photo=6, control="none", position_sd=30.0, attitude_sd=0.01
    ).block
    images, points = len(block.image_xy), len(block.point_ids)
    result = adjust(block, unit_variance="free")
    assert result.degrees_of_freedom == 2 * images - 12 - 3 * points
    assert result.degrees_of_freedom <= 0
    assert result.variance_of_unit_weight is None
    assert result.covariance_scale == 1.0
    np.testing.assert_array_equal(result.photo_covariances, result.photo_cofactors)


def listed_covariances() -> list[dict[str, str]]:
    with (GIANT / "ground_covariances.csv").open() as stream:
        return list(csv.DictReader(stream))


@pytest.mark.giant("15", "standard deviations from covariances")
@pytest.mark.giant("9", "ground point: 3x3 covariance with standard deviations")
def test_section_15_standard_deviations_of_the_listing_follow_from_its_covariances():
    rows = listed_covariances()
    assert len(rows) == 14
    covariances = np.zeros((14, 3, 3))
    for matrix, row in zip(covariances, rows, strict=True):
        for i, j, name in [
            (0, 0, "c11_rad2"), (0, 1, "c12_rad2"), (0, 2, "c13_rad_m"),
            (1, 1, "c22_rad2"), (1, 2, "c23_rad_m"), (2, 2, "c33_m2"),
        ]:  # fmt: skip
            matrix[i, j] = matrix[j, i] = float(row[name])
    result = one_point(GOLDEN["two_ray_pass_point"], [np.nan] * 3, [np.inf] * 3)
    listed = dataclasses.replace(
        result, point_cofactors=covariances / UNIT_VARIANCE, variance_of_unit_weight=UNIT_VARIANCE
    )
    deviations = listed.point_sd * [ARCSEC, ARCSEC, 1.0]
    printed = np.array(
        [[float(row[f"sd_{axis}"]) for axis in ("lon_arcsec", "lat_arcsec", "elev_m")] for row in rows]
    )
    # Half a unit of the fourth decimal, and half a unit of the third digit of the variance.
    assert (np.abs(deviations - printed) <= 0.00005 + 0.0025 * printed).all()
