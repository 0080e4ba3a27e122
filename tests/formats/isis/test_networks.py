"""Control networks as projects: points by their types and weights, images, what is left out or refused."""

from dataclasses import replace

import numpy as np
import pytest

from message_codes import fields_of, refused
from photogram import adjust, formats
from photogram.formats import ReadOptions
from photogram.formats.isis import POINT_TYPES
from photogram.formats.isis.outcome import Outcome, contents_of
from photogram.network import geographic_to_geocentric


def xyz(project, result):
    return Outcome(contents_of(project.details), result).xyz


def test_a_pair_is_adjusted_to_its_truth(pair):
    project = pair.project()
    result = adjust(project.block)
    assert result.status == "converged"
    # 192 measures, 5 points and 24 coefficients weighted, 48 points and 24 coefficients unknown.
    assert result.degrees_of_freedom == 192 + 15 + 24 - 144 - 24
    errors = xyz(project, result) - pair.truth
    outcome = Outcome(contents_of(project.details), result)
    sd = np.sqrt(np.einsum("nkk->nk", outcome.covariances) / result.variance_of_unit_weight)
    assert (np.abs(errors) < 4 * sd).all()
    assert np.abs(errors).max() > 0.1


def test_rectangular_coordinates_give_the_same_points(pair):
    own = "camsolve=accelerations twist=yes camera_angles_sigma=0.05 camera_angular_velocity_sigma=0.01 "
    own += "camera_angular_acceleration_sigma=0.005 spsolve=position spacecraft_position_sigma=50 radius=yes"
    first, other = pair.project(own), pair.project(own + " control_point_coordinate_type_bundle=rectangular")
    assert other.block.spheroid is None
    results = [adjust(each.block, tolerance=1e-9) for each in (first, other)]
    outcomes = [
        Outcome(contents_of(each.details), result)
        for each, result in zip((first, other), results, strict=True)
    ]
    # Errors of control are along east, north and up of the given, and of the adjusted place.
    np.testing.assert_allclose(outcomes[0].xyz, outcomes[1].xyz, rtol=0, atol=1e-3)
    np.testing.assert_allclose(outcomes[0].covariances, outcomes[1].covariances, rtol=1e-3, atol=1e-2)
    assert results[0].sums_of_squares.total == pytest.approx(results[1].sums_of_squares.total, rel=1e-5)


def test_without_radius_free_points_keep_their_radius(pair):
    project = pair.project("camsolve=accelerations camera_angles_sigma=0.05")
    free = ~contents_of(project.details).network.points.is_constrained
    assert (project.block.point_sd[free, 2] == 0).all()
    result = adjust(project.block)
    radii = np.linalg.norm(xyz(project, result)[free], axis=1)
    np.testing.assert_allclose(radii, np.linalg.norm(project.details["control network"].starts[free], axis=1))
    # The sphere of the support data is the shape model: it has no hills.
    np.testing.assert_allclose(radii, 1737400.0, atol=1.0)


def test_weights_of_all_points_in_metres(pair):
    words = "radius=yes POINT_LATITUDE_SIGMA=200 POINT_LONGITUDE_SIGMA=300 POINT_RADIUS_SIGMA=400"
    project = pair.project(words)
    free = ~contents_of(project.details).network.points.is_constrained
    _, latitude, height = project.starts[free].T
    radius = height + project.block.spheroid.a
    expected = np.column_stack([300 / radius / np.cos(latitude), 200 / radius, np.full(len(radius), 400.0)])
    np.testing.assert_allclose(project.block.point_sd[free], expected, rtol=1e-12)
    np.testing.assert_allclose(project.block.point_positions[free], project.starts[free])
    words = "CONTROL_POINT_COORDINATE_TYPE_BUNDLE=rectangular POINT_X_SIGMA=20 POINT_Z_SIGMA=40"
    project = pair.project(words)
    np.testing.assert_array_equal(
        project.block.point_sd[free], np.tile([20.0, np.inf, 40.0], (free.sum(), 1))
    )


def test_a_point_with_a_single_constrained_coordinate(pair):
    network = pair.network
    constrained = np.array(network.points.constrained)
    row = int(np.flatnonzero(network.points.is_constrained)[0])
    constrained[row] = [False, False, True]
    project = pair.project("radius=yes", pair.with_points(constrained=constrained))
    assert len(project.block.observations) == 4
    np.testing.assert_allclose(project.block.point_sd[row], [np.inf, np.inf, 5.0], rtol=1e-9)
    assert fields_of(project.messages, "isis.single-coordinates")["n"] == 1


def test_fixed_points_stay_where_they_are(pair):
    types = np.array(pair.network.points.types)
    types[pair.network.points.is_constrained] = POINT_TYPES.index("Fixed")
    project = pair.project("radius=yes", pair.with_points(types=types))
    fixed = types == POINT_TYPES.index("Fixed")
    assert not project.block.observations
    assert (project.block.point_sd[fixed] == 0).all()
    given = geographic_to_geocentric(project.block.point_positions[fixed], project.block.spheroid)
    np.testing.assert_allclose(given, pair.network.points.apriori[fixed], atol=1e-6)


def test_ignored_points_and_measures_do_not_count(pair):
    network = pair.network
    points, measures = np.zeros(len(network.points), bool), np.zeros(len(network.measures), bool)
    points[3], measures[20] = True, True
    network = replace(
        network,
        points=replace(network.points, ignore=points),
        measures=replace(network.measures, ignore=measures),
    )
    project = pair.project("radius=yes", network)
    assert len(project.block.image_xy) == 96 - 3
    assert "point_03" not in project.block.point_ids
    assert [(each.code, each.phrase.fields["n"]) for each in project.messages][:2] == [
        ("isis.ignored-points", 1),
        ("isis.ignored-measures", 3),
    ]


def test_held_images_are_known(pair):
    (pair.folder / "held.lis").write_text("# one\nleft.json\n")
    project = pair.project(f"CAMSOLVE=all SPSOLVE=position HELDLIST={pair.folder / 'held.lis'}")
    left, right = (each.trajectory for each in project.block.timed)
    assert (left.position, left.rotation) == (None, None)
    assert np.isinf(right.coefficients[1][0].deviations).all()
    (pair.folder / "held.lis").write_text("elsewhere.json\n")
    with refused("isis.held"):
        pair.project(f"HELDLIST={pair.folder / 'held.lis'}")


def test_twist_and_degrees(pair):
    own = pair.project("CAMSOLVE=all CKDEGREE=1 CKSOLVEDEGREE=3 TWIST=no").block.timed[0].trajectory
    sd = np.array([each.deviations for each in own.coefficients[1]])
    assert np.isinf(sd[:, :2]).all()
    assert (sd[:, 2] == 0).all()
    assert len(sd) == 4
    values = np.array([each.position for each in own.coefficients[1]])
    assert values[1].any()
    assert not values[2:].any()
    # Angles are the polynomials: nothing but their middle is left of the table.
    assert len(own.table.attitude_times) == 1
    over = pair.project("CAMSOLVE=all OVEREXISTING=yes").block.timed[0].trajectory
    assert len(over.table.attitude_times) == 60


def test_images_of_one_camera_share_it(pair):
    block = pair.project("").block
    assert len(block.cameras) == 1
    np.testing.assert_allclose(block.image_sd, 1.4 * 0.007)


def test_what_is_missing_is_named(pair):
    path = pair.folder / "pair.net"
    with refused("isis.cubes"):
        formats.read(path)
    other = pair.folder / "one.lis"
    other.write_text("SIM/left, left.json\n")
    with refused("isis.image name=SIM/right"):
        formats.read(path, ReadOptions(cubes=other))
    network = pair.network
    with refused("format.missing what=measures that are not ignored"):
        pair.project("", pair.with_points(ignore=np.ones(len(network.points), bool)))
    sample = np.array(network.measures.sample)
    sample[4] = np.nan
    with refused("isis.measure point=point_02"):
        pair.project("", pair.with_measures(sample=sample))
    types = np.full(len(network.points), POINT_TYPES.index("Fixed"), dtype=np.int8)
    with refused("isis.coordinates point=point_01"):
        pair.project("", pair.with_points(types=types))
    covariance = np.array(network.points.apriori_covariance)
    covariance[0, 1] = 1e6
    with refused("isis.covariance point=point_00"):
        pair.project("", pair.with_points(apriori_covariance=covariance))
