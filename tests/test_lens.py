"""Lenses that are known: their formulas, their inverses, lines of sensors behind them."""

import numpy as np
import pytest

from message_codes import raises
from photogram import InputError
from photogram.network import Lens, LineSensor

TRANSVERSE = (
    *(0.01, 1.001, 2e-3, 1e-5, -2e-5, 3e-5, 1e-7, 2e-7, -1e-7, 3e-8),
    *(-0.02, 1e-3, 0.999, 2e-5, 1e-5, -1e-5, 2e-7, -1e-7, 3e-8, 1e-7),
)
KAGUYA = (
    0.0725,
    -0.0009649900,
    0.00098441,
    8.5773e-06,
    -3.7438e-06,
    0.0214,
    -0.0013796,
    1.3502e-05,
    2.7251e-06,
)
LENSES = [
    Lens("radial", (1e-3, 2e-5, -3e-8)),
    Lens("transverse", TRANSVERSE),
    Lens("lrolrocnac", (1.81e-5,)),
    Lens("kaguyalism", (*KAGUYA, -6.193e-06)),
    Lens("cahvor", (1e-3, 2e-5, -3e-8, 0.3, -0.2)),
    Lens("radtan", (-0.1, 0.05, 1e-3, -2e-3, 0.01), 50.0),
]
PLACES = np.array([[0.1, 0.2], [-3.0, 4.0], [12.0, -9.0], [0.0, 17.7], [-15.0, -15.0]])


@pytest.mark.parametrize("lens", LENSES, ids=lambda lens: lens.model)
def test_both_ways_lead_to_each_other(lens):
    np.testing.assert_allclose(lens.distorted(lens.corrected(PLACES)), PLACES, rtol=0, atol=1e-12)
    np.testing.assert_allclose(lens.corrected(lens.distorted(PLACES)), PLACES, rtol=0, atol=1e-12)
    assert np.abs(lens.corrected(PLACES) - PLACES).max() > 1e-3


@pytest.mark.parametrize(
    ("lens", "way", "place", "expected"),
    [
        # By hand, with y down: (3, -4) of ours is (3, 4), r = 5.
        (Lens("radial", (0.01, 1e-3, 1e-5)), "corrected", (3, -4), (3 * 0.95875, -4 * 0.95875)),
        (Lens("lrolrocnac", (0.01,)), "corrected", (3, -4), (3, -4 / 1.16)),
        (
            Lens("kaguyalism", (0.1, 1, 2, 3, 4, 0.2, 5, 6, 7, 8)),
            "corrected",
            (3, -4),
            (3 + 0.1 + 1 + 10 + 75 + 500, -(4 + 0.2 + 5 + 30 + 175 + 1000)),
        ),
        # About (1, 2): (2, 2), r^2 = 8.
        (Lens("cahvor", (0.01, 1e-3, 0, 1, 2)), "corrected", (3, -4), (2 * 0.982 + 1, -(2 * 0.982 + 2))),
        (
            Lens("transverse", (0, 1, 0, 0, 0.1, 0, 0, 0, 0, 0.01, 0.5, 0, 1, 0, 0, 0.2, 0.03, 0, 0, 0)),
            "distorted",
            (3, -4),
            (3 + 1.2 + 0.64, -(0.5 + 4 + 3.2 + 0.81)),
        ),
        # x, y = 0.3, 0.4, r^2 = 0.25: radial 1 + 0.025, tangential 0.24 p1 + (0.25 + 0.18) p2 and so on.
        (
            Lens("radtan", (0.1, 0, 0.01, 0.02, 0), 10.0),
            "distorted",
            (3, -4),
            (10 * (0.3 * 1.025 + 0.0024 + 0.0086), -10 * (0.4 * 1.025 + 0.0057 + 0.0048)),
        ),
    ],
    ids=lambda value: getattr(value, "model", None),
)
def test_formulas_by_hand(lens, way, place, expected):
    np.testing.assert_allclose(getattr(lens, way)(np.array([place], float))[0], expected, rtol=1e-13)


@pytest.mark.parametrize(
    ("model", "coefficients", "said"),
    [
        ("barrel", (1.0,), "must be one of radial, transverse, .*'barrel'"),
        ("radial", (1.0,), "error.numbers"),
        ("lrolrocnac", (np.nan,), "error.numbers"),
    ],
)
def test_what_is_no_lens_is_refused(model, coefficients, said):
    with raises(InputError, said):
        Lens(model, coefficients)


@pytest.mark.parametrize("pitch", [(0.007, 0.0), (0.0, -0.007), (0.005, 0.004)])
def test_a_curved_line_has_a_sample_abreast_of_every_place(pitch):
    line = LineSensor(pitch, 2532.0, 0.3, -0.2, Lens("cahvor", (1e-3, 2e-5, -3e-8, 0.3, -0.2)))
    samples = np.array([0.5, 100.0, 2532.0, 5000.25])
    places = line.places(samples)
    straight = LineSensor(pitch, 2532.0, 0.3, -0.2).places(samples)
    assert np.abs(places - straight).max() > 1e-3
    found, apart = line.abreast(places)
    np.testing.assert_allclose(found, samples, rtol=0, atol=1e-8)
    np.testing.assert_allclose(apart, 0.0, atol=1e-12)
    # A place beside the line, square to its pitch.
    along = np.array(pitch) / np.hypot(*pitch)
    found, apart = line.abreast(places + 0.25 * np.array([-along[1], along[0]]))
    np.testing.assert_allclose(found, samples, rtol=0, atol=1e-8)
    np.testing.assert_allclose(apart, 0.25, atol=1e-12)


def test_a_line_of_sensors_may_be_told_by_a_table():
    table = np.array([[0.5, -3.0, 0.1], [200.5, -1.0, 0.12], [400.5, 1.01, 0.09], [600.5, 3.0, 0.1]])
    line = LineSensor.of_table(table)
    np.testing.assert_allclose(line.places(table[:, 0]), table[:, 1:], atol=1e-15)
    np.testing.assert_allclose(line.places(np.array([300.5])), [[0.005, 0.105]], atol=1e-15)
    samples = np.array([100.0, 300.0, 599.0])
    found, apart = line.abreast(line.places(samples) + np.array([0.0, 0.2]))
    np.testing.assert_allclose(found, samples, rtol=0, atol=1e-8)
    np.testing.assert_allclose(apart, 0.2, atol=1e-12)
    assert line == LineSensor.of_table(table)
    assert line != LineSensor.of_table(table + [0.0, 0.0, 1e-3] * np.eye(4)[:, :1])
    with raises(InputError, "error.kind"):
        LineSensor.of_table(table[::-1])
    with pytest.raises(InputError, match="ascending"):
        LineSensor.of_table(table[[0, 2, 1, 3]])
    lensed = LineSensor.of_table(table, Lens("lrolrocnac", (0.05,)))
    np.testing.assert_allclose(lensed.places(table[:1, 0]), [[-3.0, 0.1 / 1.0005]], rtol=1e-12)


def test_a_line_of_sensors_has_a_pitch_and_a_lens():
    with pytest.raises(InputError, match="pitch"):
        LineSensor((0.0, 0.0), 10.0)
    with raises(InputError, "error.kind"):
        LineSensor((0.01, 0.0), 10.0, lens="radial")
