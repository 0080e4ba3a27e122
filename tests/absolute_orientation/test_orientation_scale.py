"""The scale held: six unknowns, against an adjustment of six unknowns of our own, in all methods."""

import numpy as np
import pytest
from orientation_golden import cases, stations
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from photogram import InputError, RankError, orient
from photogram.absolute_orientation import Stations


@pytest.fixture
def given():
    """Stations of a model with noise, at a scale of two, some of them known in part."""
    random = np.random.default_rng(7)
    control = np.array([500.0, 300.0, 20.0]) + random.uniform(-50, 50, (8, 3))
    turn = Rotation.from_euler("xyz", [0.05, -0.04, 0.7]).as_matrix()
    model = 2.0 * control @ turn.T + [7.0, -3.0, 5.0] + random.normal(0, 0.02, (8, 3))
    control[2, 2] = control[4, 0] = control[4, 1] = np.nan
    return Stations([str(k) for k in range(8)], control, model)


def dense(given, scale):
    """Return the six unknowns by another program: u = s X - A' (x - B), X of the known components."""
    centre = given.model.mean(axis=0)

    def misclosures(p):
        turn = Rotation.from_rotvec(p[:3]).as_matrix()
        u = scale * given.control - (given.model - centre - p[3:]) @ turn
        return u[np.isfinite(u)]

    first = orient(given).similarity
    start = Rotation.from_matrix(first.rotation).as_rotvec()
    shift = first.translation - centre
    found = least_squares(misclosures, [*start, *shift], jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    freedom = len(found.fun) - 6
    return found, 2 * found.cost, 2 * found.cost / freedom * np.linalg.inv(found.jac.T @ found.jac)


@pytest.mark.parametrize("method", ["rigorous", "report"])
@pytest.mark.parametrize("scale", [2.0, 1.999])
def test_six_unknowns_are_those_of_a_dense_adjustment(given, method, scale):
    result = orient(given, method=method, scale=scale)
    found, squares, covariance = dense(given, scale)
    assert (result.similarity.scale, result.scale_held) == (scale, True)
    assert result.degrees_of_freedom == result.known - 6
    assert result.weighted_sum_of_squares == pytest.approx(squares, rel=1e-7)
    turn = Rotation.from_rotvec(found.x[:3]).as_matrix()
    np.testing.assert_allclose(result.similarity.rotation, turn, atol=1e-6)
    own = result.similarity.covariance
    np.testing.assert_array_equal(own[3], 0.0)
    assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom, abs=1e-8)
    # The centre of the model: X = A' (x - B) / s, whose partials by rotation and shift are plain.
    mine = result.similarity.transform(given.model.mean(axis=0, keepdims=True))[1][0]

    def carried(p):
        return -p[3:] @ Rotation.from_rotvec(p[:3]).as_matrix() / scale

    steps = 1e-6 * np.eye(6)
    partials = np.array([(carried(found.x + e) - carried(found.x - e)) / 2e-6 for e in steps])
    np.testing.assert_allclose(mine, partials.T @ covariance @ partials, rtol=1e-4, atol=1e-11)


def test_the_closed_form_starts_from_anywhere(given):
    turned = Stations(
        given.ids, given.control, given.model @ Rotation.from_euler("xyz", [2.0, 1.0, 2.5]).as_matrix().T
    )
    one, other = orient(given, scale=2.0), orient(turned, scale=2.0)
    assert other.started == "closed-form"
    assert other.weighted_sum_of_squares == pytest.approx(one.weighted_sum_of_squares, rel=1e-9)
    again = orient(given, scale=2.0, former=orient(given))
    assert again.weighted_sum_of_squares == pytest.approx(one.weighted_sum_of_squares, rel=1e-9)


def test_six_coordinates_are_enough_and_five_are_not():
    rows = next(iter(cases("partial_min"))).values[0]["stations"]
    whole = stations(rows)
    scale = orient(whole).similarity.scale
    control = whole.control.copy()
    row, column = np.argwhere(np.isfinite(control[:, :2]))[-1]
    control[row, column] = np.nan
    fewer = Stations(whole.ids, control, whole.model)
    with pytest.raises(RankError, check=lambda error: error.phrase.fields["all"] == 7):
        orient(fewer)
    found = orient(fewer, scale=scale)
    assert found.degrees_of_freedom == 0
    control[np.flatnonzero(np.isfinite(control[:, 2]))[0], 2] = np.nan
    with pytest.raises(RankError, check=lambda error: error.phrase.fields["all"] == 6):
        orient(Stations(whole.ids, control, whole.model), scale=scale)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.inf, "a"])
def test_a_scale_that_cannot_be_is_refused(given, scale):
    with pytest.raises(InputError, match="scale"):
        orient(given, scale=scale)


def test_the_command_holds_it(given, run, tmp_path):
    rows = np.hstack([given.control, given.model])
    lines = ["id,X,Y,Z,x,y,z"]
    lines += [
        f"{k}," + ",".join("" if np.isnan(v) else repr(float(v)) for v in row) for k, row in enumerate(rows)
    ]
    (tmp_path / "stations.csv").write_text("\n".join(lines) + "\n")
    done = run("absolute-orientation", "stations.csv", "--scale", "2", "--out", "o")
    assert done.exit_code == 0, done.output
    assert " held " in (tmp_path / "o" / "report.txt").read_text()
