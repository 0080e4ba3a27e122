"""Hints of the absolute orientation against the golden likelihood ratios of the specification."""

import re

import numpy as np
import pytest

from golden_data import golden as golden_file
from photogram import orient
from photogram.absolute_orientation import Stations, adjust
from photogram.statistics.likelihood import judged, likelihood

CASES = (
    "clean",
    "heights are feet",
    "X is in feet",
    "X and Y exchanged",
    "X and Y exchanged on station 3",
    "stations 2 and 6 exchanged",
    "station 5 in feet",
)
SAID = {
    "heights are feet": "the elevations of the control are in feet, but the plan is in metres",
    "heights are metres, the rest feet": "the elevations of the control are in metres, but the plan is",
    "X is in feet": "X of the control is in feet, but the rest is in metres",
    "X and Y exchanged": "the control is a mirror image of the model (X and Y exchanged,",
    "X mirrored": "the control is a mirror image of the model (X and Y exchanged,",
    "X and Y exchanged on station {}": "X and Y of station {} are exchanged",
    "stations {} and {} exchanged": "the coordinates of stations {} and {} are exchanged",
    "station {} in feet": "the coordinates of station {} are in feet, but the rest is in metres",
}


@pytest.fixture(scope="module")
def golden():
    return golden_file("statistics", "small_problems.json")["similarity_hints"]


def stations(golden, case):
    """Return the stations of a case: the control is exact, the model has standard deviations."""
    (found,) = [each for each in golden["cases"] if each["case"] == case]
    control = np.array(found["X"])
    sd = np.full(control.shape, golden["sd"])
    return found, Stations(range(len(control)), control, golden["Y"], control_sd=0.0 * sd, model_sd=sd)


def tried(given, monkeypatch):
    """Return the orientation and the trials of its hints, made even where it fits."""
    seen = []

    def kept(*arguments):
        seen.append(trials(*arguments))
        return seen[-1]

    trials = adjust.trials
    monkeypatch.setattr(adjust, "trials", kept)
    monkeypatch.setattr("photogram.absolute_orientation.adjust.SUSPICIOUS", 0.0)
    return orient(given), seen


def said_of(name):
    numbers = re.findall(r"\d+", name)
    return SAID[re.sub(r"\d+", "{}", name)].format(*numbers)


@pytest.mark.parametrize("case", CASES)
def test_the_golden_likelihood_ratios(case, golden, monkeypatch):
    found, given = stations(golden, case)
    result, seen = tried(given, monkeypatch)
    assert result.weighted_sum_of_squares == pytest.approx(found["omega_as_given"], rel=1e-6)
    assert result.degrees_of_freedom == golden["dof"]
    left = {str(text): squares for text, _, squares in seen[0]}
    assert len(left) >= golden["hypotheses_tried"]
    compared = 0
    for name, omega, ratio in found["best"]:
        if name == "as given":
            continue
        (own,) = [value for text, value in left.items() if text.startswith(said_of(name))]
        assert own == pytest.approx(omega, rel=1e-6)
        assert likelihood(found["omega_as_given"], own, golden["dof"]) == pytest.approx(
            ratio, rel=1e-6, abs=1e-6
        )
        compared += 1
    assert compared >= 3
    # Nothing is better than the best of the file.
    least = min(omega for _, omega, _ in found["best"])
    assert min([*left.values(), result.weighted_sum_of_squares]) == pytest.approx(least, rel=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_the_golden_mistakes_are_named(case, golden):
    _, given = stations(golden, case)
    result = orient(given)
    if case == "clean":
        assert result.usable
        assert not result.problems
        return
    (grave,) = result.grave
    assert str(grave).startswith(f"probably {said_of(case)}")
    assert not result.usable


def test_rivals_are_named_together():
    given = judged(1e6, [10.0, 11.0, 1e5], 17)
    assert given.best == (0, 1)
    assert not given.accepted
    assert judged(1e6, [10.0, 1e4, 1e5], 17).accepted
    assert judged(100.0, [10.0], 17) is None
    assert judged(1e6, [10.0, 1e5], 3).accepted is False
    # With a known unit weight a mistake may be smaller.
    assert judged(200.0, [14.0, 190.0], 17, known_weight=True).accepted


@pytest.mark.parametrize(("factor", "unit"), [(0.3048, "feet"), (1 / 0.3048, "metres")])
def test_a_scale_of_feet_is_remarked_on(factor, unit):
    rng = np.random.default_rng(3)
    ground = rng.uniform(0, 1000, (8, 3)) * [1, 1, 0.1]
    model = factor * ground + 0.01 * rng.standard_normal((8, 3))
    result = orient(Stations(range(8), ground, model))
    assert result.usable
    assert f"orientation.scale-in-{unit}" in [message.code for message in result.messages]
    other = orient(Stations(range(8), ground, 1.001 * model))
    assert not any(message.code.startswith("orientation.scale") for message in other.messages)
