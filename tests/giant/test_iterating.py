"""Iteration, intersection, degrees of freedom and covariances: specification, sections 6, 7, 9, 13 and 14."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest
from test_adjusting import GEOGRAPHIC, SIZE, changed, differences, run, solution, with_files

from photogram import AsPublished, adjust, network, simulate
from photogram.giant import Common, ImageFrame, Project, read_project, write_project
from photogram.show.quantity import named

SPACES = pytest.mark.parametrize("space", [{}, GEOGRAPHIC], ids=["rectangular", "geographic"])


@pytest.fixture(params=[{}, GEOGRAPHIC], ids=["rectangular", "geographic"])
def block(request):
    return simulate(**SIZE, seed=6, **request.param).block


@pytest.fixture
def directory(block, tmp_path):
    write_project(Project.from_block(block), tmp_path / "in")
    return tmp_path / "in"


def sums(result):
    """Return the weighted sums of squares of the start and of every iteration."""
    return [
        result.initial_weighted_sum_of_squares,
        *(each.weighted_sum_of_squares for each in result.iterations),
    ]


# Iteration, section 6


@pytest.mark.giant("6", "position increments in longitude, latitude, height; attitude in radians")
@pytest.mark.parametrize("component", range(6))
def test_section_6_unknowns_are_those_of_the_files(component):
    # Fixing one component of a station holds that one alone: the unknowns are longitude, latitude and height.
    block = simulate(**SIZE, seed=6, **GEOGRAPHIC).block
    sd = np.full((len(block.photo_ids), 6), np.inf)
    sd[3, component] = 0.0
    result = adjust(block.replace(photo_position_sd=sd[:, :3], photo_attitude_sd=sd[:, 3:]))
    given = np.hstack([block.photo_positions, block.photo_attitudes])
    moved = np.hstack([result.photo_positions, result.photo_attitudes]) != given
    expected = np.ones_like(moved)
    expected[3, component] = False
    np.testing.assert_array_equal(moved, expected)


@pytest.mark.giant("6", "iteration limit: column 14, default 4")
@pytest.mark.giant("6", "each iteration: provisional weighted sum of squares")
@pytest.mark.parametrize("limit", [1, 2])
def test_section_6_limit_of_iterations(directory, tmp_path, limit):
    short = changed(directory, tmp_path / "short", 14, str(limit))
    run(short, "--as-published", "--out", tmp_path / "out", code=3)
    report = (tmp_path / "out" / "report.txt").read_text()
    _, _, iterations = report.partition("Iterations\n----------\n")
    heading, *rows = iterations.split("\n")[: limit + 1]
    assert heading.split()[:5] == ["Iteration", "Weighted", "sum", "of", "squares"]
    assert [int(row.split()[0]) for row in rows] == list(range(1, limit + 1))
    first = re.search(r"weighted sum of squares at first +(\S+)", iterations)[1]
    values = [float(first), *(float(row.split()[1]) for row in rows)]
    result = adjust(
        read_project(short).to_block(), unit_variance="free", tolerance=AsPublished(5), max_iterations=limit
    )
    assert values == pytest.approx(sums(result), rel=1e-6)


@pytest.mark.giant("6", "convergence: change of the sum below E percent, so at least two iterations")
@pytest.mark.giant("14", "3 E blank or 0: 5; nothing to compare in iteration 1")
@pytest.mark.parametrize("percent", [1, 5, 99])
def test_section_6_convergence_by_percent(block, percent):
    result = adjust(block, tolerance=AsPublished(percent), max_iterations=9)
    assert result.converged
    of_iterations = sums(result)[1:]  # S of iteration 1 has no predecessor
    changes = [abs(new - old) < percent / 100 * old for old, new in pairwise(of_iterations)]
    assert len(of_iterations) >= 2
    assert changes[-1]
    assert not any(changes[:-1])


@pytest.mark.giant("14", "4 a rise by less than E percent converges")
@pytest.mark.parametrize(("percent", "status"), [(5, "diverged"), (20, "converged")])
def test_section_14_rises_up_to_the_criterion_converge(percent, status):
    start = {"attitude_error": math.radians(20), "position_error": 200.0}
    block = simulate(strips=2, photos_per_strip=4, points_per_photo=30, **start, seed=5).block
    result = adjust(block, tolerance=AsPublished(percent), max_iterations=9)
    *_, before, last = sums(result)
    assert 1.05 < last / before < 1.2
    assert result.status == status
    (rise,) = (message.phrase.fields for message in result.messages if message.code == "adjust.rise")
    assert rise["percent"] == pytest.approx(100 * (last / before - 1))
    assert rise["iteration"] == len(result.iterations)


@pytest.mark.giant("6", "divergence: the sum increased; units 8 and 9 not written, unit 20 is")
@pytest.mark.giant("2", "unit 8: updated FRAMES, only when the solution converges")
def test_section_6_divergence_writes_unit_20_only(tmp_path):
    start = {"attitude_error": math.radians(20), "position_error": 200.0}
    block = simulate(strips=2, photos_per_strip=4, points_per_photo=30, **start, seed=5).block
    write_project(Project.from_block(block, Common(max_iterations=9)), tmp_path / "in")
    result = adjust(read_project(tmp_path / "in").to_block(), tolerance=AsPublished(5), max_iterations=9)
    assert result.status == "diverged"
    assert sums(result)[-1] > sums(result)[-2]
    printed = run(tmp_path / "in", "--as-published", "--out", tmp_path / "out", code=3)
    assert "diverged" in printed
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"RESTART", "report.html", "report.txt"}


@pytest.mark.giant("6", "initial ground coordinates: rays intersected from the initial stations")
def test_section_6_points_start_from_their_rays():
    truth = simulate(**SIZE, seed=6).truth
    unknown = truth.replace(
        point_positions=np.full_like(truth.point_positions, np.nan), point_sd=np.array(np.inf)
    )
    result = adjust(unknown.with_fixed_photos())
    # Without errors the rays meet in the points.
    assert result.initial_weighted_sum_of_squares == pytest.approx(0, abs=1e-12)
    used = result.used_points
    np.testing.assert_allclose(result.point_positions[used], truth.point_positions[used], atol=1e-6)


@pytest.mark.giant("6", "initial ground coordinates: control takes its held components")
def test_section_6_control_starts_from_its_held_components():
    truth = simulate(**SIZE, seed=6).truth
    point = int(np.bincount(truth.image_points).argmax())
    positions, sd = np.full_like(truth.point_positions, np.nan), np.full_like(truth.point_positions, np.inf)
    positions[point], sd[point] = truth.point_positions[point] + [0, 0, 1], [np.inf, np.inf, 0.01]
    result = adjust(truth.replace(point_positions=positions, point_sd=sd).with_fixed_photos())
    # The point starts a metre too high where its control is: no residual there, but in the photographs.
    rows = truth.image_points == point
    assert result.initial_weighted_sum_of_squares > 10
    assert result.point_positions[point, 2] - truth.point_positions[point, 2] > 0.9
    assert np.abs(result.residuals[~rows]).max() < 1e-9


@pytest.mark.giant("6", "intersection only: stations fixed, every point alone")
def test_section_6_intersection_is_point_by_point(directory, tmp_path):
    only = changed(directory, tmp_path / "only", 10, "1")
    everything = solution(only)
    read = read_project(only)
    np.testing.assert_array_equal(everything.photo_positions, [frame.position for frame in read.frames])
    some = set(everything.block.point_ids[::3])
    read.images = [
        ImageFrame(
            each.name,
            [name for name in each.points if name in some],
            each.xy[[name in some for name in each.points]],
            sd=each.sd,
            camera=each.camera,
        )
        for each in read.images
    ]
    alone = adjust(read.to_block().with_fixed_photos(), unit_variance="unity")
    rows = [everything.block.point_ids.index(name) for name in alone.block.point_ids]
    differences = (alone.point_positions - everything.point_positions[rows]) / alone.point_sd
    assert np.nanmax(np.abs(differences)) < 1e-4


@pytest.mark.giant("13", "5 error propagation in the last run")
@pytest.mark.giant("6", "intersection only: later points from saved stations")
def test_section_6_later_points_from_saved_stations(directory, tmp_path):
    run(directory, "--out", tmp_path / "out")
    full = solution(directory)
    only = changed(directory, tmp_path / "only", 10, "1")
    saved = with_files(only, tmp_path / "saved", FRAMES=tmp_path / "out" / "FRAMES")
    later = solution(saved)
    # The minimum of the whole is the minimum of each point given the stations: the same coordinates.
    differences = (later.point_positions - full.point_positions) / full.point_sd
    assert np.nanmax(np.abs(differences)) < 0.01
    run(saved, "--out", tmp_path / "later")
    assert (tmp_path / "later" / "FRAMES").read_bytes() == (tmp_path / "out" / "FRAMES").read_bytes()


@pytest.mark.giant("13", "3 clean-up")
@pytest.mark.giant("13", "4 fit the control: bootstrap")
def test_section_13_clean_up_without_control_then_fit_the_control(directory, tmp_path):
    # Loose stations, no control: the block hangs together, wherever it is.
    read = read_project(directory)
    write_project(Project(read.common, read.cameras, read.frames, read.images, []), tmp_path / "loose")
    run(tmp_path / "loose", "--out", tmp_path / "clean")
    direct = solution(directory)
    loose = solution(tmp_path / "loose")
    assert loose.sums_of_squares.ground == 0
    assert loose.sums_of_squares.plates < direct.sums_of_squares.plates
    assert np.abs(loose.photo_positions - direct.photo_positions)[:, 2].max() > 1
    # Its stations are the start of the run that has the control; their standard deviations are the old ones.
    fit = with_files(directory, tmp_path / "fit", FRAMES=tmp_path / "clean" / "FRAMES")
    for before, after in zip(read.frames, read_project(fit).frames, strict=True):
        assert (before.position_sd, before.attitude_sd) == (after.position_sd, after.attitude_sd)
    fitted = solution(fit)
    assert fitted.initial_weighted_sum_of_squares < 0.1 * direct.initial_weighted_sum_of_squares
    assert max(differences(direct, fitted)) < 1e-4


# Degrees of freedom and covariances, sections 7 and 9


@pytest.mark.giant("7", "intersection: n = 2 images + c, u = 3 points")
@pytest.mark.giant("14", "30 degrees of freedom of intersection")
@pytest.mark.parametrize("digit", ["0", "1", "2"])
def test_section_7_intersection(directory, tmp_path, digit):
    only = changed(changed(directory, tmp_path / "a", 10, "1"), tmp_path / "b", 12, digit)
    read = read_project(only)
    result = adjust(read.to_block().with_fixed_photos(), unit_variance=read.common.unit_variance)
    held = np.isfinite(result.block.point_sd)[result.used_points].sum()
    assert result.degrees_of_freedom == 2 * result.used_images.sum() + held - 3 * result.used_points.sum()
    total = result.sums_of_squares.plates + result.sums_of_squares.ground
    assert result.sums_of_squares.camera == 0
    expected = total / result.degrees_of_freedom if digit != "2" else 1.0
    assert result.variance_of_unit_weight == pytest.approx(expected, rel=1e-12)
    # Of stations that are guesses: the verdict says so.
    run(only, "--out", tmp_path / "out", code=4)
    report = (tmp_path / "out" / "report.txt").read_text()
    assert f"degrees of freedom                  {result.degrees_of_freedom}\n" in report


@pytest.mark.giant("7", "0 free: n = m + c, u = s + p, plates and ground")
@pytest.mark.giant("7", "1 constrained: n = m + c + s, u = s + p, plates, ground and camera")
@pytest.mark.giant("7", "2: unit variance 1")
@pytest.mark.giant("14", "32 mode 2 prints the degrees of freedom of mode 0")
@pytest.mark.parametrize("digit", ["0", "1", "2"])
def test_section_7_unit_variance_of_triangulation(directory, tmp_path, digit):
    project = changed(directory, tmp_path / "mode", 12, digit)
    read = read_project(project)
    result = adjust(read.to_block(), unit_variance=read.common.unit_variance)
    m, c = 2 * result.used_images.sum(), np.isfinite(result.block.point_sd)[result.used_points].sum()
    s, p = 6 * len(result.block.photo_ids), 3 * result.used_points.sum()
    # The printout of mode 2 has the degrees of freedom of mode 0 (test_listing.py).
    assert result.degrees_of_freedom == (m + c if digit == "0" else m + c + s) - (s + p)
    weighted = result.sums_of_squares
    total = weighted.plates + weighted.ground + (weighted.camera if digit == "1" else 0)
    expected = 1.0 if digit == "2" else total / result.degrees_of_freedom
    assert result.variance_of_unit_weight == pytest.approx(expected, rel=1e-12)
    run(project, "--out", tmp_path / "out", "--as-published")
    report = (tmp_path / "out" / "report.txt").read_text()
    assert re.search(rf"variance of unit weight +{expected:.6f} ", report)


@pytest.mark.giant("9", "station: 3x3 covariance of position and of attitude")
@pytest.mark.giant("9", "ground point: 3x3 covariance with standard deviations")
@pytest.mark.giant("9", "units: radians and linear units")
def test_section_9_covariances_and_their_units():
    flat, globe = (simulate(**SIZE, seed=6, **space).block for space in ({}, GEOGRAPHIC))
    plane, geographic = adjust(flat, unit_variance="unity"), adjust(globe, unit_variance="unity")
    assert geographic.photo_covariances.shape == (8, 6, 6)
    assert geographic.point_covariances.shape == (len(globe.point_ids), 3, 3)
    for each in (*geographic.photo_covariances, *geographic.point_covariances[geographic.used_points]):
        np.testing.assert_allclose(each, each.T, rtol=0, atol=0)
        assert (np.linalg.eigvalsh(each / np.sqrt(np.outer(np.diag(each), np.diag(each)))) > 0).all()
    # A radian of latitude is 6.35e6 m, one of longitude shorter by the cosine; heights and angles stay.
    radius = 6.35e6 * np.array([math.cos(math.radians(29.5)), 1, 1 / 6.35e6])
    np.testing.assert_allclose(geographic.photo_sd[:, :3] * radius, plane.photo_sd[:, :3], rtol=0.1)
    np.testing.assert_allclose(
        np.diagonal(geographic.point_covariances, axis1=1, axis2=2), geographic.point_sd**2
    )


@pytest.mark.giant("2.6", "unheld components are estimated and do not count in the degrees of freedom")
@pytest.mark.giant("14", "7 unheld components: adjusted minus supplied, own rms, only where supplied")
@pytest.mark.giant("14", "9 code 7: check point")
def test_section_2_6_unheld_components_are_checks(directory, tmp_path):
    read = read_project(directory)
    before = adjust(read.to_block())
    control = next(point for point in read.ground if point.type_code == 0)
    control.type_code = 4  # planimetric: the height becomes a check
    result = adjust(read.to_block())
    row = result.block.point_ids.index(control.name)
    assert result.degrees_of_freedom == before.degrees_of_freedom - 1
    height = result.point_positions[row, 2]
    assert result.point_differences[row, 2] == pytest.approx(height - control.position[2], abs=1e-9)
    table = result.document().table("unheld")
    (name,) = table.columns[0].values
    (values,) = named(table.columns, "d").values
    assert (name, np.isnan(values[:2]).all()) == (control.name, True)
    assert values[2] == pytest.approx(result.point_differences[row, 2])
    kinds, values, *_ = result.document().table("differences").columns
    rms = values.values[list(kinds.values).index("unheld components")]
    assert rms[2] == pytest.approx(abs(result.point_differences[row, 2]))
    check = [each for each in read.ground if each.type_code == 7]
    assert len(check) == 4
    assert (result.point_kinds[[result.block.point_ids.index(each.name) for each in check]] == "check").all()
    # Where no value was supplied there is none to compare with.
    check[0].position = (*check[0].position[:2], 0.0)
    again = adjust(read.to_block())
    assert np.isnan(again.point_differences[again.block.point_ids.index(check[0].name), 2])
    differences = again.point_differences[again.point_kinds == "check"]
    kinds, values, *lengths = again.document().table("differences").columns
    row = list(kinds.values).index("check points")
    scale = np.array([180 / math.pi * 3600] * 2 + [1]) if again.block.geographic else 1.0
    root = np.sqrt(np.nanmean(differences**2, axis=0))
    assert values.outward()[row] == pytest.approx(root * scale)
    # In geographic space the lengths are in further columns.
    middle = again.block.photo_positions.mean(axis=0, keepdims=True)
    metres = root * network.lengths_of_units(middle, again.block.spheroid)[0]
    assert [own.values[row].tolist() for own in lengths] == [
        pytest.approx(metres[:2], abs=1e-4) for _ in range(again.block.geographic)
    ]


@pytest.mark.giant("13", "10 weights as a diagnostic tool")
@pytest.mark.giant("2.6", "held components are held only to the extent of their weight")
def test_section_2_6_control_yields_to_its_weight():
    block = simulate(**SIZE, seed=6).block
    row = int(np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))[0])
    positions = block.point_positions.copy()
    positions[row, 2] += 3.0
    off = []
    for sd in (1e-4, 0.05, 100.0, np.inf):
        weights = block.point_sd.copy()
        weights[row, 2] = sd
        result = adjust(block.replace(point_sd=weights, point_positions=positions))
        off.append(abs(result.point_differences[row, 2]))
    assert 0 < off[0] < 1e-3 < off[1] < off[2]
    assert off[2] == pytest.approx(off[3], rel=0.01)  # a weight so small leaves it to the photographs
    assert off[3] > 1
