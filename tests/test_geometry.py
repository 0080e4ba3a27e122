"""Public geometry: shapes, refusals, inverses, and the projections of the GIANT sample listing."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from photogram import InputError, Spheroid, network

GIANT = Path(__file__).parent / "data" / "giant"
GOLDEN: dict[str, Any] = json.loads((GIANT / "golden_cases.json").read_text())


def listed(file: str, key: str, name: str, columns: list[str]) -> list[float]:
    with (GIANT / file).open() as stream:
        row = next(row for row in csv.DictReader(stream) if row[key] == name)
    return [float(row[column]) for column in columns]


def station(frame: str) -> tuple[np.ndarray, np.ndarray]:
    with (GIANT / "stations_adjusted.csv").open() as stream:
        values = {
            row["parameter"]: float(row["value"]) for row in csv.DictReader(stream) if row["frame"] == frame
        }
    position = np.array([np.radians(values["lon"]), np.radians(values["lat"]), values["elev"]])
    return position, np.radians([values["omega"], values["phi"], values["kappa"]])


@pytest.mark.giant("15", "projections")
@pytest.mark.parametrize("case", GOLDEN["projection"], ids=lambda case: f"{case['frame']}-{case['point']}")
def test_section_15_projections_of_the_giant_sample(case):
    position, attitude = station(case["frame"])
    lon, lat, height = listed("ground_adjusted.csv", "point", case["point"], ["lon_deg", "lat_deg", "elev_m"])
    xy = network.project(
        [[np.radians(lon), np.radians(lat), height]],
        [position],
        [attitude],
        [-152.740],
        spheroid=Spheroid.clarke_1866(),
        photo_to_ground=True,
    )
    assert 1000 * np.abs(xy[0] - case["projected_mm"]).max() < case["tol_projected_um"]
    assert 1000 * np.abs(xy[0] - case["listed_mm"]).max() < case["tol_listed_um"]


def test_the_senses_of_the_angles_are_transposes():
    case = GOLDEN["angle_mode_equivalence"]
    matrix = network.rotation_matrix([np.radians(case["photo_to_ground_deg"])])
    angles = np.degrees(network.rotation_angles(matrix.transpose(0, 2, 1)))
    np.testing.assert_allclose(angles[0], case["ground_to_photo_deg"], rtol=0, atol=case["tol_deg"])


@pytest.mark.giant("5", "inverse: omega, phi, kappa from M")
@given(st.tuples(st.floats(-3.14, 3.14), st.floats(-1.5, 1.5), st.floats(-3.14, 3.14)))
def test_section_5_angles_come_back(angles):
    matrices = network.rotation_matrix([angles])
    np.testing.assert_allclose(matrices[0] @ matrices[0].T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(network.rotation_angles(matrices)[0], angles, rtol=0, atol=1e-13)


@given(st.floats(-180, 180), st.floats(-90, 90), st.floats(-1e4, 1e7))
def test_geographic_positions_come_back(lon, lat, height):
    spheroid = Spheroid.wgs84()
    xyz = network.geographic_to_geocentric([[np.radians(lon), np.radians(lat), height]], spheroid)
    again = network.geographic_to_geocentric(network.geocentric_to_geographic(xyz, spheroid), spheroid)
    np.testing.assert_allclose(again, xyz, rtol=1e-15, atol=4e-9)


@pytest.mark.giant("4", "rectangular: axes of the object space")
@pytest.mark.giant("5", "collinearity with signed principal distance")
@pytest.mark.giant("2.3", "principal distance negative in the positive plane, positive in the negative plane")
def test_section_4_rectangular_projection_written_out():
    # Straight down from 1000 m with 100 mm: 1 mm on the photo is 10 m on the ground; y follows north, x east.
    for c, sign in ((-100.0, 1), (100.0, -1)):
        xy = network.project([[510.0, 220.0, 0.0]], [[500.0, 200.0, 1000.0]], [[0.0, 0.0, 0.0]], [c])
        np.testing.assert_allclose(xy, [[sign * 1.0, sign * 2.0]], atol=1e-14)


def test_points_beside_the_camera_have_no_image():
    xy = network.project([[1.0, 2.0, 0.0]], [[0.0, 0.0, 0.0]], [[0.0, 0.0, 0.0]], [-100.0])
    assert not np.isfinite(xy).any()


def test_empty_and_strided_arrays():
    assert network.rotation_matrix(np.empty((0, 3))).shape == (0, 3, 3)
    angles = np.arange(12.0).reshape(3, 4).T
    np.testing.assert_array_equal(network.rotation_matrix(angles), network.rotation_matrix(angles.copy()))


@pytest.mark.parametrize(
    ("function", "arguments", "message"),
    [
        (network.rotation_matrix, ([1.0, 2.0, 3.0],), r"angles has the shape \(3\), not \(n, 3\)"),
        (network.rotation_matrix, (np.zeros((4, 2)),), r"angles has the shape \(4, 2\), not \(n, 3\)"),
        (network.rotation_angles, (np.zeros((4, 3)),), r"matrices has the shape \(4, 3\), not \(n, 3, 3\)"),
        (
            network.geographic_to_geocentric,
            (np.zeros(3), Spheroid.wgs84()),
            r"positions has the shape \(3\)",
        ),
        (
            network.geocentric_to_geographic,
            (np.zeros((1, 4)), Spheroid.wgs84()),
            r"xyz has the shape \(1, 4\)",
        ),
        (
            network.project,
            (np.zeros((2, 3)), np.zeros((1, 3)), np.zeros((2, 3)), np.zeros(2)),
            "positions has 1 rows, but points has 2",
        ),
        (
            network.project,
            (np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 3)), np.zeros((2, 1))),
            "principal_distances has the shape",
        ),
    ],
)
def test_shapes_are_checked(function, arguments, message):
    with pytest.raises(ValueError, match=message):
        function(*arguments)


@pytest.mark.parametrize(("a", "b"), [(1.0, 2.0), (1.0, 0.0), (np.nan, 1.0), (1.0, np.nan), (np.inf, 1.0)])
def test_spheroids_are_checked(a, b):
    with pytest.raises(InputError, match="0 < b <= a"):
        Spheroid(a, b)


def test_lengths_of_units_are_those_of_small_steps():
    spheroid = Spheroid.wgs84()
    positions = np.array([[0.1, 0.85, 500.0], [3.1, -0.2, 0.0]])
    for axis, step in enumerate((1e-6, 1e-6, 1.0)):
        moved = positions.copy()
        moved[:, axis] += step
        xyz, other = (network.geographic_to_geocentric(each, spheroid) for each in (positions, moved))
        lengths = np.linalg.norm(other - xyz, axis=1) / step
        np.testing.assert_allclose(network.lengths_of_units(positions, spheroid)[:, axis], lengths, rtol=1e-6)
    np.testing.assert_array_equal(network.lengths_of_units(positions, None), 1.0)


def test_local_frames_point_east_north_and_up():
    spheroid = Spheroid.wgs84()
    positions = np.array([[0.1, 0.85, 500.0], [3.1, -0.2, 0.0]])
    frames = network.local_frames(positions)
    for axis, step in enumerate((1e-6, 1e-6, 1.0)):
        moved = positions.copy()
        moved[:, axis] += step
        xyz, other = (network.geographic_to_geocentric(each, spheroid) for each in (positions, moved))
        directions = (other - xyz) / np.linalg.norm(other - xyz, axis=1)[:, None]
        np.testing.assert_allclose(frames[:, axis], directions, atol=1e-6)


@pytest.mark.parametrize("spheroid", [None, Spheroid.clarke_1866()], ids=["rectangular", "geographic"])
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_a_point_in_the_viewing_direction_is_at_the_principal_point(spheroid, photo_to_ground):
    space = {"spheroid": spheroid, "photo_to_ground": photo_to_ground}
    positions = np.array([[0.3, 0.7, 3000.0], [-2.0, -0.4, 1500.0]])
    attitudes = np.array([[0.1, -0.2, 2.0], [-0.3, 0.1, -1.0]])
    directions = network.viewing_directions(positions, attitudes, **space)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=1e-15)
    centres = positions if spheroid is None else network.geographic_to_geocentric(positions, spheroid)
    points = centres + 1000.0 * directions
    if spheroid is not None:
        points = network.geocentric_to_geographic(points, spheroid)
    xy = network.project(points, positions, attitudes, np.full(2, -150.0), **space)
    np.testing.assert_allclose(xy, 0.0, atol=1e-6)
    assert (points[:, 2] < positions[:, 2]).all()  # down, not up
