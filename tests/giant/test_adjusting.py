"""What the adjustment does with a project: specification, sections 2, 4 to 7, 9 and 14."""

import math
import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from photogram import Spheroid, adjust, simulate
from photogram.cli import app
from photogram.giant import Common, Frame, Project, read_project, write_project
from photogram.network import geographic_to_geocentric, project, rotation_angles, rotation_matrix

SIZE = {"strips": 2, "photos_per_strip": 4, "points_per_photo": 25, "check_points": 4}
GEOGRAPHIC = {
    "spheroid": Spheroid.clarke_1866(),
    "origin": (math.radians(-95.0), math.radians(29.5), 10.0),
    "photo_to_ground": True,
}
SPACES = pytest.mark.parametrize("space", [{}, GEOGRAPHIC], ids=["rectangular", "geographic"])


def run(*arguments, code=0):
    """Run the command line and return what it prints."""
    result = CliRunner().invoke(app, ["giant", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result.output


def with_files(directory, new, **files):
    """Copy a project, with some files taken from elsewhere."""
    shutil.copytree(directory, new)
    for name, path in files.items():
        shutil.copy(path, new / name)
    return new


def changed(directory, new, column, digit):
    """Copy a project, with another digit in a column of COMMON."""
    shutil.copytree(directory, new)
    title, job, *rest = (directory / "COMMON").read_text().splitlines()
    job = job[: column - 1] + digit + job[column:]
    (new / "COMMON").write_text("\n".join([title, job, *rest]) + "\n")
    return new


def solution(directory):
    """Adjust a project to the end."""
    read = read_project(directory)
    block = read.to_block()
    return adjust(
        block.with_fixed_photos() if read.common.intersection_only else block, unit_variance="unity"
    )


def differences(one, other):
    """Return how far stations and points differ, in standard deviations of the first."""
    photos = np.hstack([one.photo_positions - other.photo_positions, turns(one, other)]) / one.photo_sd
    points = (one.point_positions - other.point_positions) / one.point_sd
    return np.abs(photos).max(), np.nanmax(np.abs(points))


def turns(one, other):
    """Return the differences of angles, within half a circle."""
    return np.remainder(one.photo_attitudes - other.photo_attitudes + math.pi, 2 * math.pi) - math.pi


@pytest.fixture(params=[{}, GEOGRAPHIC], ids=["rectangular", "geographic"])
def directory(request, tmp_path):
    """Write a project with the default, weak weights of its stations."""
    block = simulate(**SIZE, seed=5, **request.param).block
    write_project(Project.from_block(block, Common(max_iterations=2, convergence_percent=1)), tmp_path / "in")
    return tmp_path / "in"


# The files, section 2


@pytest.mark.giant("2", "restart from unit 20 gives the result of an uninterrupted run")
@pytest.mark.giant("2", "unit 20: updated FRAMES, always written")
@pytest.mark.giant("2", "units 8 and 20 are readable as unit 3")
def test_section_2_restart_from_unit_20(directory, tmp_path):
    # Two iterations are not enough: unit 20 only.
    run(directory, "--as-published", "--out", tmp_path / "out", code=3)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"RESTART", "report.html", "report.txt"}
    restart = with_files(directory, tmp_path / "again", FRAMES=tmp_path / "out" / "RESTART")
    frames, input_frames = read_project(restart).frames, read_project(directory).frames
    assert [frame.position_sd for frame in frames] == [frame.position_sd for frame in input_frames]
    assert [frame.position for frame in frames] != [frame.position for frame in input_frames]
    # The observed stations have moved with the file, against weights of 60000 m, 10 arcmin and 90 degrees.
    uninterrupted, restarted = solution(directory), solution(restart)
    assert max(differences(uninterrupted, restarted)) < 1e-4
    assert restarted.initial_weighted_sum_of_squares < uninterrupted.initial_weighted_sum_of_squares
    assert len(restarted.iterations) < len(uninterrupted.iterations)


@pytest.mark.giant("2", "restart from unit 20 gives the result of an uninterrupted run")
def test_section_2_restart_moves_the_observed_stations(tmp_path):
    # A real weight is felt: what FRAMES holds is the observed station, and RESTART holds the adjusted one.
    block = simulate(**SIZE, position_sd=2.0, position_error=2.0, control="corners", seed=5).block
    write_project(Project.from_block(block), tmp_path / "in")
    run(tmp_path / "in", "--as-published", "--out", tmp_path / "out")
    restart = with_files(tmp_path / "in", tmp_path / "again", FRAMES=tmp_path / "out" / "RESTART")
    uninterrupted, restarted = solution(tmp_path / "in"), solution(restart)
    assert 0.001 < max(differences(uninterrupted, restarted)) < 3
    assert restarted.sums_of_squares.camera < 0.5 * uninterrupted.sums_of_squares.camera


@pytest.mark.giant("2", "unit 9 is readable as unit 4")
@pytest.mark.giant(
    "2", "unit 9: adjusted GROUND of points on two or more photographs, only when the solution converges"
)
def test_section_2_unit_9_is_ground_again(directory, tmp_path):
    run(directory, "--out", tmp_path / "out")
    ground = with_files(directory, tmp_path / "again", GROUND=tmp_path / "out" / "GROUND")
    first, again = read_project(directory).to_block(), read_project(ground).to_block()
    result = adjust(first)
    # Control keeps its weights; the other points have values to compare with, and are not held.
    np.testing.assert_array_equal(again.point_sd, first.point_sd)
    two_rays = np.bincount(first.image_points) >= 2
    assert (np.isfinite(again.point_positions).all(axis=1) == two_rays).all()
    angle, length = math.radians(0.00006 / 3600), 0.00006
    tolerance = [angle, angle, length] if first.geographic else [length] * 3
    assert (np.abs(again.point_positions - result.point_positions)[two_rays] <= tolerance).all()
    refit = adjust(again)
    assert refit.converged
    # Control has moved to where the photographs want it.
    assert refit.sums_of_squares.total < result.sums_of_squares.total
    assert refit.degrees_of_freedom == result.degrees_of_freedom


# Coordinate systems and orientation, sections 4 and 5


@pytest.mark.giant("4", "geographic: longitude, latitude, height to geocentric XYZ with a, b")
def test_section_4_geocentric_coordinates():
    rng = np.random.default_rng(4)
    lon, lat, h = rng.uniform([-3, -1.5, -100], [3, 1.5, 9000], (20, 3)).T
    spheroid = Spheroid.clarke_1866()
    a, b = 6378206.4, 6356583.8
    e2 = 1 - (b / a) ** 2
    N = a / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    x, y = (N + h) * np.cos(lat) * np.cos(lon), (N + h) * np.cos(lat) * np.sin(lon)
    expected = np.column_stack([x, y, (N * (1 - e2) + h) * np.sin(lat)])
    xyz = geographic_to_geocentric(np.column_stack([lon, lat, h]), spheroid)
    np.testing.assert_allclose(xyz, expected, rtol=1e-14)


@pytest.mark.giant("4", "heights are used as given")
def test_section_4_heights_are_used_as_given(directory, tmp_path):
    read = read_project(directory)
    block = read.to_block()
    control = {point.name: point.position[2] for point in read.ground}
    rows = [block.point_ids.index(name) for name in control]
    assert block.point_positions[rows, 2].tolist() == list(control.values())
    assert block.photo_positions[:, 2].tolist() == [frame.position[2] for frame in read.frames]
    run(directory, "--out", tmp_path / "out")
    written = read_project(with_files(directory, tmp_path / "again", FRAMES=tmp_path / "out" / "FRAMES"))
    heights = [frame.position[2] for frame in written.frames]
    np.testing.assert_allclose(heights, adjust(block).photo_positions[:, 2], rtol=0, atol=0.0001)


UTM = {"origin": (500_000.0, 3_260_000.0, 0.0)}


@pytest.mark.giant("4", "rectangular: a map projection works, with a warning about curvature")
@pytest.mark.parametrize(
    ("flight", "micrometres"),
    [({}, (25, 45)), ({"flying_height": 500.0, "image_sd": 0.002}, (3, 5))],
    ids=["high", "low, precise images"],
)
def test_section_4_map_projections_are_remarked_on(tmp_path, flight, micrometres):
    write_project(Project.from_block(simulate(**SIZE, **UTM, **flight, seed=5).block), tmp_path / "map")
    read = read_project(tmp_path / "map")
    assert adjust(read.to_block()).converged
    (message,) = read.messages
    assert message.code == "giant.map-projection"
    # H r^3 / 2 R c^2 with c = 152.74 mm, at a radius of 120 to 140 mm.
    low, high = micrometres
    assert low <= int(message.text.partition("by up to ")[2].split()[0]) <= high


@pytest.mark.parametrize(
    "space",
    [{}, GEOGRAPHIC, {**UTM, "flying_height": 500.0}],
    ids=["local", "geographic", "a map, from too low for curvature to matter"],
)
def test_other_coordinates_are_not_remarked_on(space):
    local = Project.from_block(simulate(**SIZE, **space, seed=5).block)
    local.to_block()
    assert local.messages == []


def test_geocentric_coordinates_are_not_remarked_on():
    block = simulate(**SIZE, **UTM, seed=5).block
    geocentric = Project.from_block(
        block.replace(photo_positions=block.photo_positions * [1, 1, 0] + [0, 0, 5.4e6])
    )
    geocentric.to_block()
    assert geocentric.messages == []


@pytest.mark.giant("4", "local vertical frame at each camera station")
@pytest.mark.giant("5", "ground-to-photo: u = M d")
@pytest.mark.giant("5", "photo-to-ground: u = M^T d")
@pytest.mark.giant("5", "collinearity with signed principal distance")
@pytest.mark.parametrize("photo_to_ground", [False, True])
@pytest.mark.parametrize("c", [-152.74, 152.74])
def test_section_5_projection_written_out(photo_to_ground, c):
    spheroid = Spheroid.clarke_1866()
    ground, camera = np.radians([[-95.01, 29.52], [-95.0, 29.5]])
    angles = np.radians([1.5, -2.0, 40.0])
    points, cameras = np.array([[*ground, 30.0]]), np.array([[*camera, 4500.0]])
    lon, lat = camera
    R = np.array(
        [
            [-math.sin(lon), math.cos(lon), 0],
            [-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)],
            [math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)],
        ]
    )
    d = R @ (geographic_to_geocentric(points, spheroid) - geographic_to_geocentric(cameras, spheroid))[0]
    assert d[0] < 0 < d[1]  # the point lies north-west
    M = matrix(*angles)
    u = (M.T if photo_to_ground else M) @ d
    xy = project(points, cameras, [angles], [c], spheroid=spheroid, photo_to_ground=photo_to_ground)
    np.testing.assert_allclose(xy[0], c * u[:2] / u[2], rtol=1e-10)


def matrix(omega, phi, kappa):
    """M = M_kappa M_phi M_omega as the guide prints it."""
    so, co, sp, cp = math.sin(omega), math.cos(omega), math.sin(phi), math.cos(phi)
    sk, ck = math.sin(kappa), math.cos(kappa)
    return np.array(
        [
            [ck * cp, so * sp * ck + co * sk, -co * sp * ck + so * sk],
            [-sk * cp, -so * sp * sk + co * ck, co * sp * sk + so * ck],
            [sp, -so * cp, co * cp],
        ]
    )


@pytest.mark.giant("5", "M = M_kappa M_phi M_omega")
@pytest.mark.giant("5", "inverse: omega, phi, kappa from M")
def test_section_5_matrix_of_the_guide():
    rng = np.random.default_rng(5)
    angles = rng.uniform([-3, -1.5, -3], [3, 1.5, 3], (50, 3))
    expected = np.array([matrix(*each) for each in angles])
    np.testing.assert_allclose(rotation_matrix(angles), expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(rotation_angles(expected), angles, rtol=0, atol=1e-13)


@pytest.mark.giant("5", "omega about x, phi about y, kappa about z: senses")
@pytest.mark.parametrize(
    ("angle", "axis", "towards"),
    [(0, 1, 2), (1, 2, 0), (2, 0, 1)],
    ids=["omega turns y to z", "phi turns z to x", "kappa turns x to y"],
)
def test_section_5_senses(angle, axis, towards):
    angles = np.zeros((1, 3))
    angles[0, angle] = 0.1
    turned = rotation_matrix(angles)[0][axis]  # the row is the photo axis in the ground system
    expected = np.zeros(3)
    expected[axis], expected[towards] = math.cos(0.1), math.sin(0.1)
    np.testing.assert_allclose(turned, expected, atol=1e-15)


@pytest.mark.giant(
    "2.5",
    "kappa: from east to photo x, clockwise for photo-to-ground, else counter-clockwise",
)
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_section_2_5_kappa_is_the_direction_of_the_x_axis(photo_to_ground):
    # In the positive plane the image of a point lies on the side of the point.
    direction = math.radians(30.0)  # counter-clockwise from east
    point = [[1000 * math.cos(direction), 1000 * math.sin(direction), 0.0]]
    kappa = -direction if photo_to_ground else direction
    xy = project(point, [[0.0, 0.0, 1500.0]], [[0.0, 0.0, kappa]], [-150.0], photo_to_ground=photo_to_ground)
    np.testing.assert_allclose(xy, [[100.0, 0.0]], atol=1e-12)


@pytest.mark.giant("2.2", "column 2: rotations, input and output")
@pytest.mark.giant("5", "both modes give the same ground points")
def test_section_5_both_modes_give_the_same_points(directory, tmp_path):
    read = read_project(directory)
    matrices = rotation_matrix([frame.attitude for frame in read.frames]).transpose(0, 2, 1)
    other = [
        Frame(frame.name, frame.position, tuple(angles))
        for frame, angles in zip(read.frames, rotation_angles(matrices).tolist(), strict=True)
    ]
    common = Common(**{**vars(read.common), "photo_to_ground": not read.common.photo_to_ground})
    write_project(Project(common, read.cameras, other, read.images, read.ground), tmp_path / "other")
    one, two = solution(directory), solution(tmp_path / "other")
    points = np.abs(one.point_positions - two.point_positions) / one.point_sd
    assert np.nanmax(points) < 1e-3
    turned = rotation_matrix(two.photo_attitudes).transpose(0, 2, 1)
    np.testing.assert_allclose(rotation_matrix(one.photo_attitudes), turned, rtol=0, atol=1e-8)
    # The output has the sense of the input.
    run(tmp_path / "other", "--out", tmp_path / "out")
    written = read_project(
        with_files(tmp_path / "other", tmp_path / "again", FRAMES=tmp_path / "out" / "FRAMES")
    )
    attitudes = [frame.attitude for frame in written.frames]
    np.testing.assert_allclose(rotation_matrix(attitudes), rotation_matrix(two.photo_attitudes), atol=1e-8)
