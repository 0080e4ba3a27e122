"""Calibrations of splined lenses from end to end: priors, maps, projects, files of mrcal."""

import json
from functools import cache

import numpy as np
import pytest
from given_targets import golden
from test_splined_adjustment import lens

from golden_data import shared
from message_codes import refusal
from photogram import formats
from photogram.formats.targets import adjusted_project, calibration_of
from photogram.show.quantity import records
from photogram.targets import Board, Calibration, Corners, cross_validate, projection_uncertainty, read
from photogram.targets.mrcal import mrcal_models
from photogram.targets.output import rig_of
from photogram.targets.page import splines
from photogram.targets.regularisation import regularised, with_knot_sd
from photogram.targets.vision import composed


@cache
def given():
    """Return the simulated calibration with free knots that mrcal's priors hold."""
    data = golden("splined")["adjusted"]
    board, start = data["board"], data["start"]
    views, points, *xy = np.array(data["corners"]).T
    count = len(start["R"])
    return Calibration(
        board=Board(columns=board["columns"], rows=board["rows"], spacing=board["spacing"], shape="bend"),
        corners=Corners(
            pictures=[f"view{k:02d}" for k in range(count)],
            cameras=np.zeros(count, dtype=int),
            views=np.arange(count),
            camera_names=["own"],
            sizes=[tuple(data["image"])],
            picture=views.astype(int),
            point=points.astype(int),
            xy=np.column_stack(xy),
            sd=np.ones(len(views)),
        ),
        cameras=[lens().replace(knot_sd=np.full(2, np.inf))],
        poses=composed(np.array(start["R"]), np.array(start["t"])),
        regularise="mrcal",
    )


@cache
def adjusted():
    return given().adjust()


def test_priors_count_whole_boards():
    """2,240 of 2,400 corners lie in the picture; n is 2 x 2,400 all the same."""
    priors = regularised(given().cameras, given().corners.sizes, 4800)[0]
    scale = golden("splined")["adjusted"]["regularisation_scale"]
    np.testing.assert_allclose(priors.knot_sd[0, 0], [1 / scale, 0.1 / scale], rtol=1e-12)


def test_a_knot_in_the_very_middle_is_as_free_across_as_along():
    odd = lens().replace(
        parameters=lens().parameters | {"nx": 9, "ny": 7}, knots=None, knot_sd=np.full(2, np.inf)
    )
    sd = regularised([odd], [(1280, 960)], 4800)[0].knot_sd
    assert sd[3, 4, 0] == sd[3, 4, 1]
    assert sd[3, 3, 0] == pytest.approx(10 * sd[3, 3, 1])


def test_golden_cost_and_cofactors_of_knots():
    wanted, found = golden("splined")["adjusted"]["solution"], adjusted()
    assert found.sums_of_squares.total == pytest.approx(wanted["cost"], rel=1e-10)
    names, cofactors = found.cofactors(("cameras", "board"))
    rows = [k for k, name in enumerate(names) if name.split()[-1].startswith("d")]
    assert names[rows[2]] == "own dx_1_0"
    np.testing.assert_allclose(np.sqrt(np.diag(cofactors))[rows], wanted["sd_knots"], rtol=1e-6)


@pytest.mark.parametrize(("distance", "key"), [(np.inf, "infinity"), (1.0, "1 m")])
def test_golden_maps(distance, key):
    data = golden("splined")["adjusted"]["uncertainty"]
    for datum in ("corners", "mean-frames"):
        wanted = np.array(data[key][f"{datum.replace('-', '_')}_cofactors"])
        own = projection_uncertainty(adjusted(), 0, data["pixels"], distance, datum)
        cofactors = own / adjusted().covariance_scale
        assert np.abs(cofactors - wanted).max() < 1e-6 * np.abs(wanted).max()


def _knots(found):
    (own,) = records(splines(found))
    return own


def test_the_report_counts_knots_that_hang_on_their_priors():
    own = _knots(adjusted())
    assert own["knots"] == 80
    assert 0 <= own["untouched"] <= own["from_prior"]
    assert json.loads(adjusted().to_json())["splines"] == [own]
    assert "Splined lenses" in adjusted().report()


def test_cross_validation_leaves_out_what_parts_have_from_their_priors():
    (test,) = cross_validate(adjusted()).tests[0]
    assert 100 < test.dof < 160
    assert test.chi2 / test.dof == pytest.approx(1.0, abs=4 * np.sqrt(2 / test.dof))


def test_a_narrow_spline_says_how_wide_it_should_be():
    camera = given().cameras[0]
    narrow = camera.replace(parameters=camera.parameters | {"fov_x_deg": 60.0}, knots=None)
    found = given().replace(cameras=[narrow]).adjust()
    assert 0 < _knots(found)["beyond"] < 1
    enough = _knots(found)["fov_x_deg"]
    wider = narrow.replace(parameters=narrow.parameters | {"fov_x_deg": 1.1 * enough})
    whole = _knots(given().replace(cameras=[wider]).adjust())
    assert whole["beyond"] == 0
    assert np.isnan(whole["fov_x_deg"])
    assert np.isnan(projection_uncertainty(found, 0, [[2.0, 2.0]])).all()
    assert np.isfinite(projection_uncertainty(found, 0, [[640.0, 480.0]])).all()


def test_a_project_has_the_knots(tmp_path):
    project = adjusted_project(adjusted())
    for name, content in formats.to_files(project, "plain").items():
        (tmp_path / name).write_bytes(content)
    again = calibration_of(formats.read(tmp_path))
    np.testing.assert_allclose(again.cameras[0].knots, adjusted().cameras[0].camera.knots, rtol=1e-12)
    assert "camera,i,j,dx,dy,sd_radial,sd_tangential" in (tmp_path / "knots.csv").read_text()


def test_mrcal_reads_what_is_written(tmp_path):
    files = mrcal_models(rig_of(adjusted()))
    ((name, content),) = files.items()
    (tmp_path / name).write_bytes(content)
    again = read(tmp_path / name)
    assert again.cameras[0].model == "splined_stereographic"
    np.testing.assert_array_equal(again.cameras[0].knots, adjusted().cameras[0].camera.knots)
    assert again.regularise == "mrcal"
    assert np.isinf(again.cameras[0].knot_sd).all()


def test_standard_deviations_of_knots_are_said_once():
    with refusal("error.exclusive first=knot_sd second=regularise"):
        with_knot_sd(given().cameras, (1.0, 0.1), "mrcal")
    with refusal("what=knot_sd message=error.positive-numbers count=2", "value=(0.0, 0.1)"):
        with_knot_sd(given().cameras, (0.0, 0.1), None)
    np.testing.assert_array_equal(with_knot_sd(given().cameras, None, None)[0].knot_sd[3, 3], [1.0, 0.1])


def test_the_splined_calibration_of_mrcal():
    found = read(shared("targets", "splined-0.cameramodel"))
    camera = found.cameras[0]
    assert camera.knots.shape == (20, 30, 2)
    assert not camera.deviations.any()
    assert found.regularise == "mrcal"
    weighted = (found.residuals() / found.corners.sd[:, np.newaxis])[found.corners.use]
    assert np.sqrt((weighted**2).mean()) < 0.5


def test_few_views_converge_though_most_knots_are_from_their_priors():
    """Sixteen of 186 views: Gauss-Newton goes along a valley that hardly anything but priors slopes."""
    whole = read(shared("targets", "splined-0.cameramodel"))
    some = np.arange(len(whole.corners.pictures)) % 12 == 3
    part = whole.replace(corners=whole.corners.of_pictures(some), poses=np.asarray(whole.poses)[some])
    found = part.adjust()
    assert found.converged
    assert found.sums_of_squares.total == pytest.approx(305.570709, abs=1e-4)
    assert _knots(found)["from_prior"] > 100
