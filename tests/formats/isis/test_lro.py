"""A pair of the Lunar Reconnaissance Orbiter by the settings of jigsaw: golden figures of a dense program."""

import numpy as np
import pytest
from lro_pair import LRO, SERIAL, SIDES, WEIGHTED, answers, project, with_coordinates

from ephemeris_seconds import added_to_ephemeris_seconds
from golden_data import needs
from photogram import adjust
from photogram.formats.isis.outcome import Outcome, contents_of

pytestmark = needs("moving", "lro")


@pytest.fixture(scope="module")
def weighted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lro")
    own = project(with_coordinates(folder, answers()), folder, WEIGHTED)
    # Our own times of lines are exact; those of the figures are not.
    with added_to_ephemeris_seconds():
        result = adjust(own.block, tolerance=1e-10)
    return own, result, Outcome(contents_of(own.details), result)


def test_sigma0_and_degrees_of_freedom(weighted):
    _, result, _ = weighted
    truth = answers()["weighted"]["solution"]
    assert result.degrees_of_freedom == truth["degrees_of_freedom"] == 178
    assert np.sqrt(result.variance_of_unit_weight) == pytest.approx(truth["sigma0"], rel=1e-6)
    assert result.sums_of_squares.total == pytest.approx(truth["sum_of_squares"], rel=1e-6)


def test_points(weighted):
    _, result, outcome = weighted
    truth = answers()["weighted"]["solution"]
    sd, found = np.array(truth["sd_points"]), outcome.latitudes * [1, 1, 1e-3]
    apart = np.abs(found - truth["points"])
    assert (apart <= 1e-4 * sd + 1e-12).all(), (apart / sd).max()
    own = np.sqrt(np.einsum("nkk->nk", result.point_cofactors))[:, [1, 0, 2]] * [1, 1, 1e-3]
    np.testing.assert_allclose(own, sd, rtol=1e-5)


@pytest.mark.parametrize("side", SIDES)
def test_angles(weighted, side):
    own, result, _ = weighted
    truth = answers()["weighted"]["solution"]["angles"][side]
    adjusted = result.trajectories[f"{SERIAL}{side}"]
    image = contents_of(own.details).images[f"{SERIAL}{side}"]
    start = np.array([each.position for each in adjusted.given.coefficients[1]])
    found = image.solving.angles + (adjusted.rotation - start).T
    sd = np.array(truth["sd"])
    assert (np.abs(found - truth["value"]) < 1e-4 * sd).all(), np.abs((found - truth["value"]) / sd).max()
    np.testing.assert_allclose(
        adjusted.rotation_sd.T / np.sqrt(result.variance_of_unit_weight), sd, rtol=1e-5
    )


@pytest.mark.parametrize("side", SIDES)
def test_residuals_and_redundancy(weighted, side):
    _, result, outcome = weighted
    truth = answers()["weighted"]["solution"]
    serials = outcome.contents.network.measures.serials
    mine = outcome.image_serials == list(serials).index(f"{SERIAL}{side}")
    order = np.argsort(result.block.image_points[mine])
    # The line, then the sample, in 0.007 mm of the focal plane; the right camera is turned by 180 degrees.
    found = (outcome.residuals[mine][order][:, ::-1]) * (1.0 if side == "L" else -1.0)
    np.testing.assert_allclose(found, truth["residuals_px"][side], rtol=0, atol=1e-5)
    redundancy = result.redundancy[mine][order]
    np.testing.assert_allclose(redundancy, truth["kinds"][f"image_{side}"]["redundancy"], rtol=0, atol=1e-6)


def test_the_settings_of_the_published_test(tmp_path):
    # Its radii are from an elevation model that is not there; those of the sphere leave other residuals.
    words = "CAMSOLVE=all CKDEGREE=2 CKSOLVEDEGREE=3 TWIST=no RADIUS=no"
    own = project(LRO / "observationPair.net", tmp_path, words)
    assert [each.file.name for each in own.messages] == ["observationImageR.isd", "observationImageL.isd"]
    result = adjust(own.block)
    assert result.status == "converged"
    assert result.degrees_of_freedom == 2 * 92 - 2 * 44 - 2 * 2 * 4
    sizes = np.linalg.norm(Outcome(contents_of(own.details), result).residuals, axis=1)
    assert sizes.mean() < 2 * answers()["published"]["average_residual_px"]
    free = np.linalg.norm(Outcome(contents_of(own.details), result).xyz, axis=1)[1:5]
    np.testing.assert_allclose(free, 1737400.0, atol=1e-3)
