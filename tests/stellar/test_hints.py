"""Mistakes that are often made, and the hints that name them."""

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from message_codes import coded, has_code
from photogram import InputError
from photogram.stellar import SkyCamera, attitude_of, calibrate_night, read_night
from photogram.stellar.places import axis_of, roll_of

EXAMPLE = Path(str(files("photogram") / "examples" / "exposures" / "night.toml"))


@pytest.fixture(scope="module")
def night():
    """Return two exposures of the example."""
    night = read_night(EXAMPLE)
    return replace(night, exposures=night.exposures[:2], names=night.names[:2])


def flipped(night, axis):
    exposures = []
    for exposure in night.exposures:
        xy = exposure.xy.copy()
        xy[:, axis] = night.frame[axis] - xy[:, axis]
        exposures.append(replace(exposure, xy=xy))
    return replace(night, exposures=exposures)


def pointed(night, change):
    exposures = [
        replace(e, attitude=attitude_of(*change(*axis_of(e.attitude), roll_of(e.attitude))))
        for e in night.exposures
    ]
    return replace(night, exposures=exposures)


def widened(night, factor):
    field = np.radians(36.9 * factor)
    return replace(night, camera=SkyCamera.of_field(*night.frame, field))


@pytest.mark.parametrize(
    ("spoil", "hint", "fields"),
    [
        (lambda n: flipped(n, 0), "mirrored-x", {}),
        (lambda n: flipped(n, 1), "mirrored-y", {}),
        (
            lambda n: pointed(n, lambda a, e, r: (a + np.pi, e, r)),
            "azimuth-from-north",
            {},
        ),
        (lambda n: pointed(n, lambda a, e, r: (-a, e, r)), "azimuth-east", {}),
        (
            lambda n: pointed(n, lambda a, e, r: (a, e, r + np.pi / 2)),
            "roll",
            {"turn": -90},
        ),
        (
            lambda n: pointed(n, lambda a, e, r: (a, e, r - np.pi / 2)),
            "roll",
            {"turn": 90},
        ),
        (lambda n: widened(n, 1.3), "field-of-view", {"field": pytest.approx(36.9, rel=0.03)}),
        (lambda n: widened(n, 0.7), "field-of-view", {"field": pytest.approx(36.9, rel=0.03)}),
    ],
)
def test_each_mistake_gets_its_hint(night, spoil, hint, fields):
    check = coded("stars.cause", mistake=f"stars.hint.{hint}", names=("1", "2"))
    with pytest.raises(InputError, check=check) as raised:
        calibrate_night(spoil(night))
    assert has_code(raised.value, f"stars.hint.{hint}", **fields)


def test_one_mirrored_exposure_is_left_out_with_its_hint():
    night = read_night(EXAMPLE)
    first = flipped(night, 0).exposures[0]
    result = calibrate_night(replace(night, exposures=[first, *night.exposures[1:]]))
    assert has_code(result.messages[0], "stars.hint.mirrored-x")
    assert has_code(result.messages[1], "stars.rejected", name="1", reason="stars.by-chance")
    assert result.usable


def test_a_field_of_view_that_is_a_little_wrong_is_found_all_the_same():
    night = read_night(EXAMPLE)
    result = calibrate_night(widened(night, 1.03))
    assert result.names == night.names
    assert result.usable


@pytest.mark.parametrize("angles", [(12.0, 52.0, 0.5), (268.0, 5.0, -88.0), (181.0, 89.0, 179.0)])
def test_roll_comes_back(angles):
    attitude = attitude_of(*np.radians(angles))
    found = np.degrees([*axis_of(attitude), roll_of(attitude)])
    assert found == pytest.approx(angles, abs=1e-9)
