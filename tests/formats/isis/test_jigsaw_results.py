"""What is written beside an adjusted control network: tables of jigsaw, the network, support data."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from photogram import adjust
from photogram.comparator import Place
from photogram.formats import FORMATS
from photogram.formats.csm import SupportedImage, read_support
from photogram.formats.csm.isd import angle_axes, of_angles, of_quaternions, to_angles, to_quaternions
from photogram.formats.isis import binary_network, read_network
from photogram.formats.isis.assembling import full_matrices
from photogram.formats.isis.network import is_binary
from photogram.formats.isis.outcome import Outcome, contents_of
from photogram.formats.results import adjusted
from photogram.network import geocentric_to_geographic

SETTINGS = (
    "CAMSOLVE=accelerations CAMERA_ANGLES_SIGMA=0.05 CAMERA_ANGULAR_VELOCITY_SIGMA=0.01"
    " CAMERA_ANGULAR_ACCELERATION_SIGMA=0.005 SPSOLVE=velocities SPACECRAFT_POSITION_SIGMA=50"
    " SPACECRAFT_VELOCITY_SIGMA=1 RADIUS=yes"
)
WAYS = ("", " OVEREXISTING=yes OVERHERMITE=yes")


def written(project):
    """Adjust a project, and return the result with the files beside it."""
    result = adjust(project.block)
    return result, FORMATS["isis"].results(adjusted(project, result), result)


@pytest.fixture(scope="module")
def ended(pair):
    project = pair.project(SETTINGS)
    result, files = written(project)
    return Outcome(contents_of(project.details), result), files


def rows(content, heads):
    """Return the header and the rows of a table."""
    found = list(csv.reader(io.StringIO(content.decode())))
    return found[:heads], found[heads:]


def test_residuals_are_in_pixels(ended):
    outcome, files = ended
    head, found = rows(files["residuals.csv"], 3)
    assert head[2][:3] == ["Label", "Filename", "Serial Number"]
    assert len(found) == 96
    numbers = np.array([each[3:10] for each in found], dtype=float)
    np.testing.assert_array_equal(numbers[:, 2], outcome.contents.network.measures.sample)
    np.testing.assert_allclose(numbers[:, 6], np.hypot(*numbers[:, 4:6].T))
    assert {each[10] for each in found} == {""}
    # What is measured less what is seen, where lines are square on the ground.
    result = outcome.result
    for row, own in enumerate(result.block.timed):
        mine = result.block.image_photos == row
        places = result.point_positions[result.block.image_points[mine]]
        apart = result.block.image_xy[mine] - result.project(own.photo, places)
        np.testing.assert_allclose(numbers[mine, 4], apart[:, 0], rtol=0, atol=0.02)


def test_points_in_the_units_of_jigsaw(ended, pair):
    outcome, files = ended
    head, found = rows(files["points.csv"], 3)
    assert head[2][5:14] == ["(dd)", "(dd)", "(km)"] + ["(m)"] * 6
    assert [each[1] for each in found].count("CONSTRAINED") == 5
    numbers = np.array([each[2:] for each in found], dtype=float)
    assert (numbers[:, :2] == [2, 0]).all()
    latitude, longitude, radius = np.deg2rad(numbers[:, 3]), np.deg2rad(numbers[:, 4]), numbers[:, 5]
    level = radius * np.cos(latitude)
    places = np.column_stack(
        [level * np.cos(longitude), level * np.sin(longitude), radius * np.sin(latitude)]
    )
    np.testing.assert_allclose(places, numbers[:, 12:15], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(1000 * places, outcome.xyz, rtol=0, atol=1e-5)
    # Both are roots of the same covariances, whose trace does not depend on axes.
    np.testing.assert_allclose((numbers[:, 6:9] ** 2).sum(1), (numbers[:, 15:18] ** 2).sum(1), rtol=1e-9)
    moved = np.linalg.norm(outcome.xyz - outcome.contents.starts, axis=1)
    np.testing.assert_allclose(np.linalg.norm(numbers[:, 9:12], axis=1), moved, rtol=1e-3)


def test_images_with_initial_and_final_coefficients(ended):
    outcome, files = ended
    head, found = rows(files["images.csv"], 2)
    assert head[0][4:9] == ["X(t0)"] * 5
    assert head[1][4:9] == ["initial", "correction", "final", "apriori sigma", "adj sigma"]
    names = head[0][4::5]
    assert names == [f"{axis}(t{k})" for axis in "XYZ" for k in (0, 1)] + [
        f"{axis}(t{k})" for axis in ("RA", "DEC", "TWIST") for k in (0, 1, 2)
    ]
    numbers = np.array([each[4:] for each in found], dtype=float).reshape(2, -1, 5)
    np.testing.assert_allclose(numbers[:, :, 0] + numbers[:, :, 1], numbers[:, :, 2], rtol=1e-12)
    np.testing.assert_allclose(numbers[0, :2, 3], [50.0, 1.0])
    np.testing.assert_allclose(numbers[0, 6:9, 3], [0.05, 0.01, 0.005])
    # Kilometres: sigmas a priori are metres.
    assert (numbers[:, :6, 4] < 0.06).all()
    place = outcome.result.trajectories["SIM/left"].poses([1001.28]).positions[0]
    assert np.hypot(*numbers[0, [0, 2], 2]) == pytest.approx(np.hypot(*place[:2]) / 1000, abs=1e-3)


def test_bundleout_counts_what_was_adjusted(ended):
    outcome, files = ended
    text = files["bundleout.txt"].decode()
    told = dict(line.strip().split(": ", 1) for line in text.splitlines() if ": " in line.strip())
    unknowns, freedom = int(told["Unknowns"]), float(told["Degrees of Freedom"])
    weighted = int(told["Constrained Point Parameters"]) + int(told["Constrained Image Parameters"])
    assert int(told["Good Observations"]) + weighted - unknowns == freedom
    assert freedom == outcome.result.degrees_of_freedom
    assert told["CAMSOLVE"] == "ACCELERATIONS"
    assert told["SPSOLVE"] == "VELOCITIES"
    assert sum(line.startswith("point_") for line in text.splitlines()) == 48


@pytest.mark.parametrize("binary", [False, True])
def test_the_network_has_what_was_found(pair, tmp_path, binary):
    network = replace(pair.network, user="somebody")
    rejected = np.array(network.measures.rejected)
    rejected[7] = True
    network = replace(network, measures=replace(network.measures, rejected=rejected))
    path = tmp_path / "own.net"
    project = pair.project(SETTINGS, network, path=path, **({"written": binary_network} if binary else {}))
    result, files = written(project)
    (tmp_path / "adjusted.net").write_bytes(files["own.net"])
    assert is_binary(tmp_path / "adjusted.net") == binary
    found, outcome = read_network(tmp_path / "adjusted.net"), Outcome(contents_of(project.details), result)
    np.testing.assert_allclose(found.points.adjusted, outcome.xyz, rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        full_matrices(found.points.adjusted_covariance), outcome.covariances, rtol=1e-6, atol=1e-6
    )
    np.testing.assert_allclose(found.measures.sample_residual, outcome.residuals[:, 0], atol=1e-9)
    np.testing.assert_allclose(found.measures.line_residual, outcome.residuals[:, 1], atol=1e-9)
    assert not found.measures.rejected.any()
    assert found.user == "somebody"
    np.testing.assert_array_equal(found.points.apriori, network.points.apriori)


def test_measures_that_were_taken_out_are_rejected(pair):
    project = pair.project(SETTINGS)
    block = project.block
    kept = np.arange(len(block.image_xy)) != 10
    images = {name: getattr(block, name)[kept] for name in ("image_photos", "image_points", "image_xy")}
    result = adjust(block.replace(**images, image_sd=block.image_sd[kept]))
    outcome = Outcome(contents_of(project.details), result)
    # A point with one ray left is none.
    assert np.flatnonzero(outcome.rejected).tolist() == [10, 11]
    files = FORMATS["isis"].results(adjusted(project, result), result)
    _, found = rows(files["residuals.csv"], 3)
    assert [each[10] for each in found] == [""] * 94 + ["*"] * 2
    assert found[-1][0] == "point_05"
    path = pair.folder / "rejected.net"
    path.write_bytes(files["pair.net"])
    found = read_network(path)
    assert np.flatnonzero(found.measures.rejected).tolist() == [10, 11]
    assert np.flatnonzero(found.points.rejected).tolist() == [5]
    assert np.isnan(found.points.adjusted[5]).all()
    assert np.isnan(found.measures.sample_residual[[10, 11]]).all()


@pytest.mark.parametrize("way", WAYS)
def test_support_data_see_what_the_adjusted_trajectory_sees(pair, tmp_path, way):
    project = pair.project(SETTINGS + way)
    result, files = written(project)
    random = np.random.default_rng(1)
    for side in ("left", "right"):
        path = tmp_path / f"{side}.json"
        path.write_bytes(files[f"support/{side}.json"])
        image = SupportedImage(read_support(path), side, "isis", "isis")
        lines, samples = random.uniform(1, [[8000], [4000]], (2, 1000))
        ground = image.to_ground(lines, samples, 300.0)
        places = geocentric_to_geographic(ground, project.block.spheroid)
        seen = result.project(f"SIM/{side}", places) + 0.5
        assert np.abs(seen - np.column_stack([samples, lines])).max() < 0.01
        before = SupportedImage(read_support(pair.folder / f"{side}.json"), side, "isis", "isis")
        assert np.abs(before.to_image(ground) - np.column_stack([lines, samples])).max() > 5


@pytest.mark.parametrize("way", WAYS)
def test_velocities_of_support_data_are_those_of_their_tables(pair, way):
    _, files = written(pair.project(SETTINGS + way))
    document = json.loads(files["support/right.json"])
    own = document["instrument_position"]
    times, places = np.array(own["ephemeris_times"]), np.array(own["positions"])
    slopes = (places[2:] - places[:-2]) / (times[2:] - times[:-2])[:, np.newaxis]
    np.testing.assert_allclose(np.array(own["velocities"])[1:-1], slopes, rtol=0, atol=2e-4)
    own = document["instrument_pointing"]
    times, turned = np.array(own["ephemeris_times"]), of_quaternions(Place(), np.array(own["quaternions"]))
    # M' = -[w]x M of the camera's axes: w along inertial axes.
    middle = turned[1:-1].transpose(0, 2, 1) @ (turned[2:] - turned[:-2])
    slopes = -middle / (times[2:] - times[:-2])[:, np.newaxis, np.newaxis]
    turning = np.stack([slopes[:, 2, 1], slopes[:, 0, 2], slopes[:, 1, 0]], axis=1)
    np.testing.assert_allclose(np.array(own["angular_velocities"])[1:-1], turning, rtol=0, atol=2e-7)


def test_all_else_of_support_data_stays(pair):
    _, files = written(pair.project("CAMSOLVE=angles CAMERA_ANGLES_SIGMA=0.05 RADIUS=yes"))
    before, after = (
        json.loads(each) for each in ((pair.folder / "left.json").read_bytes(), files["support/left.json"])
    )
    assert before.pop("instrument_pointing") != after.pop("instrument_pointing")
    assert before == after


def test_quaternions_and_angles_come_back():
    random = np.random.default_rng(2)
    angles = np.array([1.0, 1.2, -2.0]) + np.cumsum(random.normal(0, 0.05, (50, 3)), axis=0)
    matrices = of_angles(angles)
    np.testing.assert_allclose(to_angles(matrices), angles, atol=1e-12)
    found = to_quaternions(matrices)
    np.testing.assert_allclose(of_quaternions(Place(), found), matrices, atol=1e-12)
    assert (np.einsum("ni,ni->n", found[1:], found[:-1]) > 0).all()
    axes, step = angle_axes(angles), 1e-6
    for k in range(3):
        later = of_angles(angles + step * np.eye(3)[k])
        turn = -np.einsum("nji,njk->nik", matrices, later - matrices) / step
        found = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)
        np.testing.assert_allclose(found, axes[:, :, k], atol=1e-5)
