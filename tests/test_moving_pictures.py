"""Pictures, footprints and weakest points of blocks with photos on trajectories."""

import numpy as np
import pytest

from moving_blocks import rolling, scanned
from photogram import adjust
from photogram.results.footprints import footprints
from photogram.results.network_sections import weakest_points


@pytest.fixture(scope="module")
def drone():
    return adjust(rolling())


@pytest.fixture(scope="module")
def strips():
    return adjust(scanned())


@pytest.fixture(scope="module")
def both():
    return adjust(scanned(photos=True))


def test_samples_and_lines_are_no_place_in_the_frame(strips, both):
    """They were drawn as x and y in millimetres, those of frames of the same camera among them."""
    [panel] = strips.plot.residuals().panels
    assert (panel.across, panel.up) == ("sample", "line")
    low, high = panel.limits[:, 1]
    assert low < high
    assert panel.title.startswith("camera 1, scanned: ")
    frames, lines = both.plot.residuals().panels
    assert (frames.across, frames.up) == ("x, mm", "y, mm")
    assert np.abs(frames.limits[:, 0]).max() < 40
    assert (lines.across, lines.up) == ("sample", "line")
    frame, _ = both.plot.redundancy().panels
    assert frame.across == "x, mm"
    assert np.abs(frame.limits[:, 0]).max() < 40
    assert strips.plot.redundancy().panels[0].across == "sample"


def test_a_rolling_shutter_has_a_frame(drone):
    [panel] = drone.plot.residuals().panels
    assert panel.across == "x, px"
    first, last = panel.limits[:, 1]
    assert first > last
    assert not drone._plot_data().scanned.any()


def test_all_pictures_can_be_drawn(drone, strips, both):
    for result in (drone, strips, both):
        for name in ("network", "residuals", "redundancy", "tests"):
            assert getattr(result.plot, name)().render()
        assert result.to_html()


def test_footprints_are_of_pictures(drone, both):
    """A strip of a scanner had the outline of a picture of 6,000 by 4,000 millimetres."""
    found = footprints(both)
    assert np.isnan(found.outlines[:2]).all()
    assert np.isnan(found.size[:2]).all()
    assert np.isfinite(found.outlines[2:]).all()
    assert np.ptp(found.outlines[2:, :, 0], axis=1).max() < 1000
    assert found.size[2:] == pytest.approx(600 / 60, rel=0.05)
    whole = footprints(both, [(60.0, 40.0)])
    assert np.isnan(whole.outlines[:2]).all()
    assert np.ptp(whole.outlines[2], axis=0)[:2].max() == pytest.approx(600, rel=0.05)
    assert np.isfinite(footprints(drone, [(4000.0, 3000.0)]).outlines).all()


def test_distances_from_stations_that_are_none(strips, both, drone):
    """The place of a scanner at one time is not where it saw its points from."""
    assert np.isnan([each["distance"] for each in weakest_points(strips).record()]).all()
    assert np.isfinite([each["distance"] for each in weakest_points(both).record()]).all()
    assert np.isfinite([each["distance"] for each in weakest_points(drone).record()]).all()


def test_patterns_over_the_frame_are_in_the_focal_plane(both):
    """Lines of two scanners would have been the pattern of a lens."""
    named = [each.name for each in both.verdict.tests if "over the frame" in each.name]
    for each in both.verdict.tests:
        assert "4e+03" not in each.name
    assert len(named) <= 1
