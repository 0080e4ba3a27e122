"""Models of pairs of photos, joined to strips, before their absolute orientation."""

import re

import numpy as np
import pytest

from photogram import InputError, MinimumConstraints, RankError, adjust, orient, simulate
from photogram.absolute_orientation import Stations, read_csv, relative_model, strip_of

PHOTOS = ["0101", "0102", "0103", "0104"]


def simulated(image_sd):
    return simulate(strips=2, photos_per_strip=4, points_per_photo=60, image_sd=image_sd, seed=3)


def against_truth(strip, truth):
    """Orient a strip on all points and projection centres as they are."""
    known = dict(zip(truth.point_ids, truth.point_positions, strict=True))
    known |= {f"[{name}]": at for name, at in zip(truth.photo_ids, truth.photo_positions, strict=True)}
    return orient(Stations(strip.ids, np.array([known[each] for each in strip.ids]), strip.positions))


def test_a_strip_without_errors_is_similar_to_the_ground():
    made = simulated(1e-7)
    strip = strip_of(made.block, PHOTOS)
    assert len(strip.models) == 3
    assert strip.converged
    assert not strip.unchecked
    assert max(strip.rms) < 1e-7
    assert [f"[{name}]" in strip.ids for name in PHOTOS] == [True] * 4
    assert against_truth(strip, made.truth).rms < 1e-7


def test_a_model_is_the_network_of_its_two_photos():
    block = simulated(0.01).block
    model = relative_model(block, "0102", "0103")
    result = model.result
    # Two equations less than unknowns by photos, one left of each point: y-parallaxes.
    assert result.degrees_of_freedom == len(model.ids) - 2 - 5
    free = result.block.replace(
        photo_positions=result.photo_positions, photo_attitudes=result.photo_attitudes
    )
    again = adjust(free, datum=MinimumConstraints())
    assert again.sums_of_squares.total == pytest.approx(result.sums_of_squares.total, rel=1e-6)
    places = dict(zip(model.ids, model.positions, strict=True))
    np.testing.assert_array_equal(places["[0102]"], 0.0)
    assert np.linalg.norm(places["[0103]"]) == pytest.approx(1.0)


def test_a_strip_with_errors_is_oriented_within_them():
    made = simulated(0.01)
    found = against_truth(strip_of(made.block, PHOTOS), made.truth)
    # Ground units: 0.01 mm at 1:29,500 are 0.3 m in plan; a strip of four photos bends by a few of these.
    assert found.rms / found.similarity.scale < 3.0


def test_what_makes_no_strip_is_refused():
    block = simulated(0.01).block
    with pytest.raises(InputError, check=lambda error: error.code == "orientation.strip"):
        strip_of(block, ["0101"])
    with pytest.raises(InputError, match="9999"):
        strip_of(block, ["0101", "9999"])
    with pytest.raises(RankError, check=lambda error: error.code == "orientation.common-points"):
        relative_model(block, "0101", "0104")


def test_the_command_writes_stations_with_the_control_of_the_project(run, tmp_path):
    done = run(
        "absolute-orientation",
        "relative",
        "--example",
        "strip.csv",
        "--photos",
        "DJI_0101,DJI_0102, DJI_0103",
    )
    assert done.exit_code == 0, done.output
    assert re.search(r"DJI_0101 DJI_0102 +20 +converged", done.output)
    stations = read_csv(tmp_path / "strip.csv")
    names = {stations.ids[row] for row in np.flatnonzero(stations.given.all(axis=1))}
    assert {"south-1", "south-2"} <= names <= {"south-1", "south-2", "north-1", "north-2"}
    # Five points leave nothing to check a model by.
    weak = run("absolute-orientation", "relative", "--example", "all.csv")
    assert weak.exit_code == 4
    assert "nothing checks the models DJI_0105 DJI_0106" in weak.output
