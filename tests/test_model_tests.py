"""Which terms of a lens are worth having: tests without and with another adjustment, models side by side."""

import numpy as np
import pytest

from example_scripts import load
from message_codes import raises
from photogram import InputError, adjust, compare, eliminate_terms, score_test, terms_test


@pytest.fixture(scope="module")
def block():
    return load("self_calibration").measured()


def with_terms(block, *names, **zero):
    camera = block.cameras[0]
    sd = dict.fromkeys(("c", "xp", "yp", *names), np.inf)
    return block.replace(cameras=[camera.replace(sd=sd, parameters={**camera.parameters, **zero})])


@pytest.fixture(scope="module")
def results(block):
    """Return adjustments with more and more terms."""
    models = {
        "K1": ("K1",),
        "K1 K2": ("K1", "K2"),
        "K1 K2 K3": ("K1", "K2", "K3"),
        "K1 K2 P": ("K1", "K2", "P1", "P2"),
        "all": ("K1", "K2", "K3", "P1", "P2"),
    }
    return {name: adjust(with_terms(block, *terms), tolerance=1e-9) for name, terms in models.items()}


def omega(result):
    return result.sums_of_squares.total


def test_wald_is_the_rise_without_the_terms(results):
    for small, large, names in (
        ("K1 K2", "K1 K2 K3", ["K3"]),
        ("K1 K2", "K1 K2 P", ["P1", "P2"]),
        ("K1 K2 P", "all", ["K3"]),
    ):
        found = terms_test(results[large], names)
        rise = omega(results[small]) - omega(results[large])
        assert found.statistic == pytest.approx(rise, rel=0.01)
        assert found.dimension == len(names)
    # The example's lens has P1, P2 and no K3.
    assert not terms_test(results["all"], ["K3"]).worth_keeping
    assert terms_test(results["all"], ["P1", "P2"]).worth_keeping


def test_the_score_is_the_fall_with_the_terms(results):
    for small, large, names in (
        ("K1 K2 P", "all", ["K3"]),
        ("K1 K2", "K1 K2 P", ["P1", "P2"]),
        ("K1 K2", "K1 K2 K3", ["K3"]),
        ("K1 K2", "all", ["K3", "P1", "P2"]),
    ):
        found = score_test(results[small], names)
        fall = omega(results[small]) - omega(results[large])
        assert found.statistic == pytest.approx(fall, rel=1e-3)
        nested = compare({small: results[small], large: results[large]}).nested
        assert [nested[0][2], nested[0][3]] == pytest.approx([fall, len(names)])
        assert nested[0][4] == pytest.approx(found.probability, rel=0.05)


def test_effects_of_ones_own_are_tested_by_their_partials(results):
    result = results["all"]
    xy = result.block.image_xy
    sheared = np.stack([np.stack([xy[:, 1], np.zeros(len(xy))], axis=1)])
    found = score_test(result, ["shear"], partials=sheared)
    assert found.probability > 0.001
    own = result.block.replace(image_xy=xy + 2e-4 * sheared[0])
    assert score_test(adjust(own), ["shear"], partials=sheared).probability < 1e-6
    # Of what attitudes do already, nothing can be told: a turn of the image about its principal point.
    symmetric = results["K1 K2"]
    camera = symmetric.cameras[0]
    u = camera.camera.rays(xy)
    x, y = (camera.value("c") * u[:, :2] / u[:, 2:] - symmetric.residuals).T
    with pytest.raises(InputError, check=lambda error: error.code == "models.inseparable"):
        score_test(symmetric, partials=np.stack([np.stack([-y, x], axis=1)]))
    with pytest.raises(InputError, check=lambda error: error.code == "models.estimated"):
        score_test(result, ["K1"])


def test_bic_finds_the_terms_that_are_there(results):
    found = compare(results)
    assert found.best.name == "K1 K2 P"
    differences = {each.name: each.bic - found.best.bic for each in found.models}
    assert differences["K1"] > 10
    assert differences["all"] > 0
    assert "K1 K2 P is better than" in found.statement() or "as good as each other" in found.statement()
    assert found.document().table("models").frame().equals(found.table())
    assert next(iter(found.table()["model"])) == "K1 K2 P"


def test_models_of_other_observations_are_not_compared(block, results):
    others = block.replace(image_sd=block.image_sd * 2)
    with pytest.raises(InputError, check=lambda error: error.code == "models.observations"):
        compare({"one": results["all"], "two": adjust(others)})
    with pytest.raises(InputError, check=lambda error: error.code == "models.few"):
        compare({"one": results["all"]})


def test_backward_elimination_leaves_the_terms_that_are_there(block):
    found = eliminate_terms(with_terms(block, "K1", "K2", "K3", "P1", "P2"))
    assert [each.names for each in found.removed] == [("K3",)]
    assert {name for each in found.kept for name in each.names} == {"K1", "K2", "P1", "P2"}
    assert found.log()[0].startswith("K3 of 24 mm lens: left out, ")
    camera = found.result.cameras[0]
    assert camera.value("K3") == 0.0
    with raises(InputError, "elimination.no-terms"):
        eliminate_terms(with_terms(block))


def test_a_term_that_is_not_there_is_kept_as_often_as_its_level(block):
    """Of the score test of K3, which the lens has not, with other errors."""
    base = with_terms(block, "K1", "K2", "P1", "P2")
    truth = adjust(base)
    computed = base.image_xy - truth.residuals
    random = np.random.default_rng(7)
    probabilities = []
    for _ in range(40):
        noise = random.normal(size=computed.shape) * base.image_sd
        result = adjust(base.replace(image_xy=computed + noise), unit_variance="unity")
        probabilities.append(score_test(result, ["K3"]).probability)
    probabilities = np.sort(probabilities)
    # Kolmogorov and Smirnov at 0.1 percent.
    assert np.abs(probabilities - (np.arange(40) + 0.5) / 40).max() < 1.95 / np.sqrt(40)


def test_the_report_says_which_terms_are_worth_keeping(results):
    report = " ".join(results["all"].report().split())
    assert "terms of the lens worth keeping by their tests at 1 percent: K2; K1; P1, P2" in report
    assert "terms of the lens not worth keeping: K3 (probability" in report
