"""Collections with cameras of other models than "Bundle Adjustment in the Large" has."""

import json

import numpy as np
import pytest

from photogram import InputError, _photocore
from photogram.collection import Collection, adjust, simulate

MADE = simulate(photos=8, points=80, noise=0.3, seed=5)
PRINCIPAL_POINT = np.array([612.5, 388.25])


def radial(collection, cx=PRINCIPAL_POINT[0], cy=PRINCIPAL_POINT[1]):
    """Return the same photos counted from the upper-left corner."""
    parameters = collection.photo_parameters
    centre = np.tile([cx, cy], (len(parameters), 1))
    sd = np.full((len(parameters), 11), np.inf)
    sd[:, 7:9] = 0.0
    return collection.replace(
        camera="radial",
        photo_parameters=np.hstack([parameters[:, :7], centre, parameters[:, 7:]]),
        photo_sd=sd,
        image_xy=PRINCIPAL_POINT + collection.image_xy * [1.0, -1.0],
    )


def test_with_the_principal_point_held_it_is_the_same_adjustment():
    bal, other = adjust(MADE.collection), adjust(radial(MADE.collection))
    columns = [*range(7), 9, 10]
    assert other.converged
    assert other.cost == pytest.approx(bal.cost, rel=1e-9)
    np.testing.assert_allclose(other.photo_parameters[:, columns], bal.photo_parameters, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(other.photo_sd[:, columns], bal.photo_sd, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(other.redundancy, bal.redundancy, atol=1e-7)
    np.testing.assert_allclose(other.residuals, bal.residuals * [1.0, -1.0], atol=1e-5)
    np.testing.assert_array_equal(other.photo_sd[:, 7:9], 0.0)


def test_free_principal_points_scatter_as_their_covariances_say():
    squares = []
    for seed in range(100, 112):
        made = simulate(photos=8, points=80, noise=0.3, seed=seed)
        start = radial(made.collection, 600.0, 400.0)
        result = adjust(start.replace(photo_sd=np.array(np.inf), image_sd=0.3))
        assert result.converged
        assert np.nansum(result.redundancy) == pytest.approx(result.degrees_of_freedom, abs=1e-5)
        truth = np.insert(made.truth.photo_parameters[:, 6:], [1, 1], PRINCIPAL_POINT, axis=1)
        squares.append(
            (((result.photo_parameters[:, 6:] - truth) / result.photo_sd[:, 6:]) ** 2).mean(axis=0)
        )
    # The photos of a ring are wrong together: 12 rings are 12 samples, not 96.
    np.testing.assert_array_less(np.mean(squares, axis=0), 2.2)
    np.testing.assert_array_less(0.4, np.mean(squares, axis=0))


def test_a_weighted_principal_point_is_an_observation():
    sd = np.full((8, 11), np.inf)
    sd[:, 7:9] = 2.0
    result = adjust(radial(MADE.collection).replace(photo_sd=sd, image_sd=0.3))
    table = result.station_table()
    assert (table["redundancy_cx"] > 0.05).all()
    assert np.isfinite(table["standardized_cy"]).all()
    np.testing.assert_allclose(table["d_cx_px"], result.photo_parameters[:, 7] - PRINCIPAL_POINT[0])


def test_report_and_document_name_the_parameters_of_the_camera():
    result = adjust(radial(MADE.collection))
    assert "cx px" in result.report()
    document = json.loads(result.to_json())
    assert document["camera"] == "radial"
    assert document["parameters"][6:] == ["f", "cx", "cy", "k1", "k2"]
    assert document["units"]["f, cx, cy, residual_px"] == "pixel"
    assert "(cx, cy) + f (1 + k1 p^2" in document["conventions"]["camera"]
    assert {"sd_cx_px", "sd_k1"} <= set(result.photo_table())


def test_every_model_of_the_crate_can_be_named():
    models = dict(_photocore.camera_models())
    assert list(models) == _photocore.CAMERAS
    for name, (formula, parameters, constants, *_) in models.items():
        assert "image = " in formula
        if name == "splined_stereographic":
            with pytest.raises(InputError, check=lambda error: error.code == "collection.camera"):
                MADE.collection.replace(camera=name)
            continue
        # In front of the camera; lengths in the image are one, terms of lenses nothing.
        pose = [1.0, 1.0, 1.0, 1.0, 1.0, -5.0]
        values = np.array([pose + [float(power == 1) for _, power in parameters]])
        collection = Collection(values, np.ones((1, 3)), [0], [0], np.ones((1, 2)), camera=name)
        assert len(collection.units) == len(collection.parameters) == values.shape[1]
        assert np.isfinite(collection.computed_xy()).all()
        held = np.arange(values.shape[1]) >= values.shape[1] - constants
        np.testing.assert_array_equal(collection.photo_sd[0] == 0.0, held)


def test_models_that_cannot_be_are_refused_by_name():
    with pytest.raises(InputError, check=lambda error: error.code == "collection.camera"):
        MADE.collection.replace(camera="x")
    with pytest.raises(InputError, match=r"photo_parameters: must have the shape \(8, 11\), got \(8, 9\)"):
        MADE.collection.replace(camera="radial")
    with pytest.raises(ValueError, match="camera cannot be"):
        _photocore.radial_domain("x", np.zeros(1))
    with pytest.raises(InputError, match="the camera brown has 11 parameters, not 3"):
        _photocore.camera_partials("brown", np.ones(3), np.ones((1, 3)))


def random_cameras(rng):
    """Yield every model with parameters that could be, and directions in front of it."""
    for name, (_, parameters, *_) in _photocore.camera_models():
        values = []
        for parameter, power in parameters:
            if parameter in ("alpha", "beta", "omega"):
                values.append(rng.uniform(0.6, 0.9))
            elif parameter in ("c", "f", "fx", "fy", "w", "h", "b", "hx", "hy"):
                values.append(rng.uniform(900.0, 1400.0))
            elif name == "splined_stereographic" and power == 0:
                values.append({"order": 3.0, "fov_x_deg": 150.0}.get(parameter, 12.0))
            elif power == 1:
                values.append(rng.uniform(-5.0, 5.0))
            else:
                values.append(rng.uniform(-0.01, 0.01) * 1500.0**power)
        depth = rng.uniform(2.0, 9.0, (50, 1))
        u = depth * np.hstack([rng.uniform(-0.4, 0.4, (50, 2)), -np.ones((50, 1))])
        yield name, np.array(values), u


def test_images_rays_and_partials_of_every_model_belong_together():
    for name, values, u in random_cameras(np.random.default_rng(11)):
        xy, by_u, by_parameters = _photocore.camera_partials(name, values, u)
        assert by_u.shape == (50, 2, 3)
        assert by_parameters.shape == (50, 2, len(values))
        np.testing.assert_array_equal(xy, _photocore.camera_images(name, values, u))
        assert np.abs(np.einsum("nij,nj->ni", by_u, u)).max() < 1e-9
        rays = _photocore.camera_rays(name, values, xy)
        np.testing.assert_allclose(rays, u / np.linalg.norm(u, axis=1, keepdims=True), atol=1e-12)
        moved = u + 1e-6 * np.array([1.0, -2.0, 0.5])
        np.testing.assert_allclose(
            _photocore.camera_images(name, values, moved),
            xy + np.einsum("nij,nj->ni", by_u, moved - u),
            atol=1e-6,
        )


def test_where_a_lens_ends_there_is_no_ray():
    values = np.array([1000.0, 600.0, 400.0, -0.3])
    radius, distorted = _photocore.radial_domain("simple_radial", values)
    np.testing.assert_allclose([radius, distorted], [np.sqrt(1 / 0.9), 2 / 3 * np.sqrt(1 / 0.9)], rtol=1e-14)
    edges = 600.0 + 1000.0 * distorted * np.array([0.99, 1.01])
    rays = _photocore.camera_rays("simple_radial", values, np.column_stack([edges, [400.0, 400.0]]))
    assert np.isfinite(rays[0]).all()
    assert np.isnan(rays[1]).all()
    assert _photocore.radial_domain("pinhole", np.ones(4)) is None
