"""What the data say of fx = fy and of the terms of the lens."""

from dataclasses import replace

import numpy as np
import pytest
import star_plates as plates
from nights import MAKER

from message_codes import codes, fields_of
from photogram.stellar import INDEX, calibrate, calibrate_exposures, calibrate_night
from photogram.stellar.comparison import equal
from photogram.stellar.comparison import test_scale as scale_of
from photogram.stellar.comparison import test_terms as terms_of
from photogram.stellar.night_document import lens_tests

FRAME = (6000.0, 4000.0)


def adjusted(result, **options):
    night = result.night
    return calibrate_exposures(
        result.exposures,
        result.camera,
        night.site,
        night.catalogue,
        pixel_sd=night.pixel_sd,
        earth=night.earth,
        **options,
    )


def test_fx_may_be_fy(night, result):
    """The true ones are 9012 and 9009.5: the data refuse one of both."""
    assert result.scale_test.needed
    again = calibrate_night(replace(night, common_scale=True))
    assert again.camera.common_scale
    assert again.camera.values[0] == again.camera.values[1]
    assert again.calibration.degrees_of_freedom == result.calibration.degrees_of_freedom + 1
    assert again.scale_test.statistic == pytest.approx(result.scale_test.statistic, rel=0.05)
    assert "stars.scale" in codes(again.messages)
    parameters = again.document().table("parameters").record()
    assert parameters["fx"]["value"] == parameters["fy"]["value"]


def test_the_test_of_fx_and_fy_is_the_change_of_the_sum_of_squares(result):
    """F = (Omega_0 - Omega_1) / (Omega_1 / f)."""
    free, tied = adjusted(result), adjusted(result, common_scale=True)
    sums = [found.mean_error**2 * found.degrees_of_freedom for found in (free, tied)]
    expected = (sums[1] - sums[0]) / free.mean_error**2
    found = scale_of(free.camera, free.degrees_of_freedom, FRAME, 0.1)
    assert found.statistic == pytest.approx(expected, rel=1e-3)
    assert scale_of(tied.camera, tied.degrees_of_freedom, FRAME, 0.1) is None


def test_terms_are_left_out_by_the_change_of_the_sum_of_squares(result):
    """k3 is not shown; the F of every group is that of an adjustment without it."""
    free = adjusted(result)
    tests = terms_of(free.camera, free.degrees_of_freedom, FRAME, 0.1)
    assert [test.name for test in tests] == ["k3", "k2", "k1", "p1, p2"]
    assert [test.needed for test in tests] == [False, True, True, True]
    camera = replace(free.camera, values=np.where(np.arange(9) == 6, 0.0, free.camera.values))
    without = adjusted(replace(result, calibration=replace(free, camera=camera)), fixed=("k3",))
    change = without.mean_error**2 * without.degrees_of_freedom - free.mean_error**2 * free.degrees_of_freedom
    assert tests[0].statistic == pytest.approx(change / free.mean_error**2, rel=0.02)
    # Then the terms of p, k3 being zero.
    names = list(free.camera.names)
    p = [names.index("p1"), names.index("p2")]
    camera = replace(without.camera, values=np.where(np.isin(np.arange(9), p), 0.0, without.camera.values))
    none = adjusted(replace(result, calibration=replace(free, camera=camera)), fixed=("k3", "p1", "p2"))
    change = none.mean_error**2 * none.degrees_of_freedom - without.mean_error**2 * without.degrees_of_freedom
    assert tests[3].statistic == pytest.approx(change / 2 / free.mean_error**2, rel=0.02)


def test_effects_are_what_terms_move_in_the_frame(result):
    """p1 and p2 of the simulated night at the corners, to the third digit."""
    tests = {test.name: test for test in result.term_tests}
    f, p1, p2 = 9010.0, *MAKER["CAMERA"].values[7:]
    corners = (np.array([[0, 0], [6000, 0], [0, 4000], [6000, 4000]]) - [3018, 1987]) / f
    u, v = corners.T
    square = u**2 + v**2
    moved = np.hypot(2 * p1 * u * v + p2 * (square + 2 * u**2), p1 * (square + 2 * v**2) + 2 * p2 * u * v)
    assert tests["p1, p2"].effect == pytest.approx(f * moved.max(), rel=0.1)
    assert tests["p1, p2"].verdict == "needed"
    named = {term.fields["name"] for term in fields_of(result.messages, "stars.weak-terms")["terms"]}
    assert named == {name for name, test in tests.items() if not test.significant}
    names, *_, outcomes = (column.values for column in lens_tests(result).columns)
    assert dict(zip(names, outcomes, strict=True))["k3"] == "not shown by the data"


def scale_test(result):
    """Return the test of two principal distances."""
    (size,) = (section for section in result.document().sections if section.key == "size")
    return next(fact.value for facts in size.parts for fact in facts.facts if fact.name == "Test of cx = cy")


def test_the_document_of_a_plate_tests_its_two_scales(plate):
    """F is the square of the difference over its mean error; with one scale there is nothing to test."""
    result = calibrate(plate)
    pair = [INDEX["cx"], INDEX["cy"]]
    (xx, xy), (_, yy) = result.covariance[np.ix_(pair, pair)]
    f = (result.parameters["cx"] - result.parameters["cy"]) ** 2 / (xx + yy - 2 * xy)
    assert f > 100
    assert scale_test(result).startswith(f"F = {f:.2f} with 1 and 728 degrees of freedom, prob")
    assert scale_test(result).endswith(": refused at 0.01")
    common = calibrate(replace(plate, options=replace(plate.options, common_scale=True)))
    assert scale_test(common) == "not made: they are not estimated both"


def test_the_test_of_two_scales_is_the_change_of_the_sum_of_squares(plate):
    """Of a plate whose scales differ by three mean errors; distortion is not linear in its centre."""
    solved = calibrate(plate).solved.parameters.copy()
    solved[INDEX["cy"]] = solved[INDEX["cx"]] + 1.5e-5
    exact = plates.seen(plates.quiet(plate), solved)
    noise = 3e-6 * np.random.default_rng(8).standard_normal(exact.image_xy.shape)
    problem = replace(exact, image_xy=exact.image_xy + noise)
    result = calibrate(problem)
    common = calibrate(replace(problem, options=replace(problem.options, common_scale=True)))
    pair = [INDEX["cx"], INDEX["cy"]]
    f, _ = equal(result.solved.parameters[pair], result.covariance[np.ix_(pair, pair)], 728)
    omega = [sum(each.solved.sums) for each in (common, result)]
    assert 2 < f < 60
    assert (omega[0] - omega[1]) / result.mean_error**2 == pytest.approx(f, rel=0.25)
