"""The packaged example: built by its script, as printed where it is printed."""

from __future__ import annotations

from importlib.resources import as_file, files
from types import ModuleType

import numpy as np
import pytest

from example_scripts import load
from photogram.giant import Project, read_project


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return load("make_galveston")


@pytest.fixture(scope="module")
def project() -> Project:
    with as_file(files("photogram") / "examples" / "galveston") as directory:
        return read_project(directory)


def test_the_script_builds_the_packaged_files(script):
    for name, records in script.build().records().items():
        text = (files("photogram") / "examples" / "galveston" / name).read_text()
        assert text.splitlines() == records


def test_it_is_the_block_that_its_readme_describes(project):
    block = project.to_block()
    assert (len(block.photo_ids), len(block.point_ids), len(block.image_xy)) == (20, 144, 483)
    np.testing.assert_array_equal(np.isfinite(block.point_sd).sum(axis=0), [12, 12, 10])
    assert np.bincount(block.image_points).min() == 2
    assert (block.photo_to_ground, block.spheroid.a, block.spheroid.b) == (True, 6378206.4, 6356583.8)
    assert (block.principal_distances == -152.740).all()
    assert project.common.error_propagation
    assert not project.common.air_refraction
    unseen = [message.text for message in project.messages]
    assert len(unseen) == 2
    assert all("not photographed" in text for text in unseen)


def test_printed_figures_stand_in_it(script, project):
    images = {
        (frame.name, point): xy
        for frame in project.images
        for point, xy in zip(frame.points, frame.xy.tolist(), strict=True)
    }
    printed = script.printed_images()
    assert len(printed) == 21
    assert all(images[key] == xy.tolist() for key, xy in printed.items())
    initial = {frame.name: (*frame.position, *frame.attitude) for frame in project.frames}
    stations = script.printed_stations("stations_initial.csv")
    assert len(stations) == 5
    for name, values in stations.items():
        expected = np.concatenate(values)
        legible = np.isfinite(expected)
        assert legible.sum() >= 5
        np.testing.assert_allclose(np.array(initial[name])[legible], expected[legible], rtol=0, atol=1e-12)
