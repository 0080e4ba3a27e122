"""Calibration of a projector: principal distance and principal point, from sets at several heights."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import photogram
from photogram import Block, Camera, InputError, RankError
from photogram.perspective_center import determine, joined, run_deck

EXAMPLE = Path(photogram.__file__).parent / "examples" / "perspective_center" / "grid.deck"
INTERIOR = np.array([150.21, 0.06, -0.04])


def nominal(grid):
    """Return a grid whose plate was taken to have another principal point and distance than it has."""
    return replace(grid, plate_xy=grid.plate_xy + INTERIOR[1:], principal_distance=INTERIOR[0])


@pytest.fixture
def calibrated(make_grid):
    """Return a projector of 150 mm that is said to have another interior, its points in relief."""
    return lambda **options: nominal(make_grid(relief=60.0, **options))


def test_exact_readings_give_the_interior_back(calibrated):
    result = determine(calibrated(), unknown=("c", "xp", "yp"))
    np.testing.assert_allclose(result.interior, [150.0, *INTERIOR[1:]], rtol=0, atol=1e-8)
    np.testing.assert_allclose(result.position, [250.4, 249.7, 310.25], rtol=0, atol=1e-7)
    assert np.abs(result.radial_distortion).max() < 1e-8


@pytest.mark.parametrize("unknown", [("c",), ("c", "xp", "yp")])
def test_values_and_covariances_are_those_of_a_block_of_one_photo(calibrated, unknown):
    grid = calibrated(sd=0.02, seed=4)
    result = determine(grid, unknown=unknown)
    count = len(grid.ids)
    given = {"c": -grid.principal_distance, "xp": 0.0, "yp": 0.0}
    camera = Camera("brown", given, sd=dict.fromkeys(unknown, np.inf))
    block = Block(
        photo_ids=["projector"], photo_positions=result.position[np.newaxis] + 1.0,
        photo_attitudes=result.attitude[np.newaxis] + 1e-3, photo_position_sd=np.inf,
        photo_attitude_sd=np.inf, point_ids=[str(each) for each in grid.ids],
        point_positions=grid.model, point_sd=0.0, image_photos=np.zeros(count, dtype=int),
        image_points=np.arange(count), image_xy=grid.plate_xy, image_sd=1.0, cameras=[camera],
        photo_cameras=[0],
    )  # fmt: skip
    other = photogram.adjust(block, tolerance=1e-10)
    adjusted = other.cameras[0]
    found = dict(zip(adjusted.names, adjusted.values, strict=True))
    expected = [-found["c"], found["xp"], found["yp"]]
    np.testing.assert_allclose(result.interior, expected, rtol=0, atol=1e-6)
    np.testing.assert_allclose(result.position, other.photo_positions[0], rtol=0, atol=1e-6)
    assert result.degrees_of_freedom == other.degrees_of_freedom
    assert result.sigma0_plate == pytest.approx(np.sqrt(other.variance_of_unit_weight), rel=1e-6)
    errors = result.standard_errors[:3]
    np.testing.assert_allclose(errors, other.photo_sd[0, :3], rtol=1e-5)
    rows = [adjusted.names.index(name) for name in unknown]
    np.testing.assert_allclose(result.interior_errors, adjusted.sd[rows], rtol=1e-5)
    assert result.redundancy.sum() == pytest.approx(result.degrees_of_freedom, rel=1e-3)


def test_one_height_does_not_determine_the_interior(make_grid):
    with pytest.raises(RankError) as refused:
        determine(make_grid(sd=0.01), unknown=("c", "xp", "yp"))
    assert refused.value.phrase.fields["error"].code == "projector.undetermined"
    with pytest.raises(InputError, match="unknown"):
        determine(make_grid(), unknown=("f",))
    with pytest.raises(InputError, check=lambda error: error.code == "projector.published-interior"):
        determine(make_grid(), unknown=("c",), as_published=True)


def test_sets_at_several_heights_in_one_solution():
    apart = run_deck(EXAMPLE).results
    (together,) = run_deck(EXAMPLE, together=True).results
    assert together.grid.ids[:2] == ["101/1", "102/1"]
    assert together.degrees_of_freedom == sum(each.degrees_of_freedom for each in apart) + 6
    assert together.position == pytest.approx([251.3, 248.6, 305.4], abs=0.03)
    assert (together.standard_errors < np.min([each.standard_errors for each in apart], axis=0)).all()
    with pytest.raises(InputError, check=lambda error: error.code == "projector.joined"):
        joined([apart[0].grid, replace(apart[1].grid, principal_distance=151.0)])
    with pytest.raises(InputError, check=lambda error: error.code == "projector.published-sets"):
        run_deck(EXAMPLE, together=True, as_published=True)


def test_the_command_calibrates(run, tmp_path):
    done = run("perspective-center", EXAMPLE, "--calibrate", "c,xp,yp", "--json", "out.json", "--out", "out")
    assert done.exit_code == 0, done.output
    assert re.search(r"^  c, mm +150\.0\d+ +0\.0\d+$", done.output, re.MULTILINE)
    (found,) = json.loads((tmp_path / "out.json").read_text())["sets"]
    errors = found["interior_standard_errors"]
    assert found["interior"]["c"] == pytest.approx(150.0, abs=3 * errors["c"])
    assert found["interior"]["xp"] == pytest.approx(0.0, abs=3 * errors["xp"])
    assert "c, mm" in (tmp_path / "out" / "report.html").read_text()
    listing = (tmp_path / "out" / "listing.txt").read_text()
    assert "VARIANCE-COVARIANCE" in listing
    (line,) = [each for each in listing.splitlines() if "PRINCIPAL DISTANCE (MM) =" in each]
    value, error = map(float, line.partition("=")[2].split())
    assert value == pytest.approx(found["interior"]["c"], abs=6e-6)
    assert error == pytest.approx(errors["c"], abs=6e-6)
