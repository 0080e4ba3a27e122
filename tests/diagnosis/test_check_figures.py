"""Mistakes and errors planted in simulated networks by `benches/check.py`, as docs/check.md shows them."""

import runpy
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benches" / "check.py"
NETWORKS = 2
KINDS = [
    "nothing",
    "image, test value 10",
    "image 1 mm",
    "wrong name of an image",
    "exchanged names on a photo",
    "names of a photo scrambled",
    "mirrored photo, x",
    "mirrored photo, y",
    "x and y of a photo exchanged",
    "kappa of a photo 180 deg",
    "y of all images down",
    "pixels from the corner, y down",
    "degrees read as radians",
    "quaternions in another order",
    "stations in feet",
    "heights of stations in feet",
    "control in feet",
    "heights of control in feet",
    "X of control in feet",
    "X and Y of control exchanged",
    "control, test value 10",
    "exchanged control, image 1 mm",
    "observed position of a photo, test value 10",
    "observed positions above the ellipsoid",
    "observed positions in feet",
    "observed positions of 0.02 s later",
    "lever arm with the wrong sign",
    "observed distances in millimetres",
    "one name for two points",
    "radial terms with the wrong sign",
    "radial terms divided by the principal distance",
]


@pytest.fixture(scope="module")
def script():
    sys.path.insert(0, str(SCRIPT.parent))
    try:
        return runpy.run_path(str(SCRIPT))
    finally:
        sys.path.remove(str(SCRIPT.parent))


def test_every_kind_of_the_figures_is_tested(script):
    assert set(KINDS) == set(script["KINDS"])


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_planted_is_named_and_nothing_else(kind, script):
    # Networks other than those of the page.
    outcomes = [
        script["outcome"](script["KINDS"][kind], seed, False) for seed in range(8000, 8000 + NETWORKS)
    ]
    assert outcomes == [(True, 0)] * NETWORKS


def test_a_mistake_that_is_not_there_is_not_named(script):
    """The count can fail: a finding about nothing planted, and an error that is not named."""
    planted = script["KINDS"]["heights of control in feet"](8000, None)
    wrong = type(planted)(planted.block, [set()], [{"control-set"}], said="heights of the control are in gon")
    assert script["outcome"](lambda *_: wrong, 8000, False)[0] is False
    none = type(planted)(planted.block, [], [])
    assert script["outcome"](lambda *_: none, 8000, False)[1] >= 1


@pytest.mark.parametrize("seed", [9015, 9016, 9033])
def test_rays_of_two_points_that_meet_behind_the_cameras(seed, script):
    """All rays together miss by metres then, and by less without any one: no measure of what is wrong."""
    found = script["outcome"](script["KINDS"]["one name for two points"], seed, False)
    assert found == (True, 0)
