"""What the report of a self-calibration says, against golden figures, propagation and drawn errors."""

import json

import numpy as np
import pytest

from example_scripts import load
from golden_data import golden as golden_file
from photogram import Block, Camera, InputError, adjust
from photogram.network import project
from photogram.results import calibrations, distortion_curve, lens_field
from photogram.show.page import about

FREE = np.inf
NAMES = ("c", "xp", "yp", "K1", "K2", "K3", "P1", "P2")


@pytest.fixture(scope="module")
def example():
    return load("self_calibration")


@pytest.fixture(scope="module")
def result(example):
    return adjust(example.measured())


@pytest.fixture(scope="module")
def golden():
    return golden_file("network", "selfcal.json")


@pytest.fixture(scope="module")
def selfcal(golden):
    """Return the golden network: twelve photos, sixty points, one camera of eight parameters with priors."""
    initial, observed = golden["inputs"]["initial"], golden["inputs"]["observations"]
    photos = [name for name in initial if name.startswith("photo")]
    points = [name for name in initial if name.startswith("point")]
    places, sd = np.full((len(points), 3), np.nan), np.full((len(points), 3), np.inf)
    control = observed["control"]
    for (name,), at in zip(control["between"], control["observed"], strict=True):
        places[points.index(name)] = at
        sd[points.index(name)] = np.sqrt(np.diag(control["covariance"]["all"]))
    images, prior = observed["image"], observed["camera prior"]
    priors = np.sqrt(np.diag(prior["covariance"]["all"])).tolist()
    camera = Camera(
        "brown",
        dict(zip(NAMES, prior["observed"][0], strict=True)),
        sd=dict(zip(NAMES, priors, strict=True)),
    )
    block = Block(
        photo_ids=photos,
        photo_positions=[initial[name]["position"] for name in photos],
        photo_attitudes=[initial[name]["omega_phi_kappa"] for name in photos],
        cameras=[camera],
        point_ids=points,
        point_positions=places,
        point_sd=sd,
        image_photos=[photos.index(photo) for photo, _, _ in images["between"]],
        image_points=[points.index(point) for _, point, _ in images["between"]],
        image_xy=images["observed"],
        image_sd=np.array(0.0008),
    )
    return adjust(block, tolerance=1e-9)


def test_the_golden_camera(golden, selfcal):
    solution, camera = golden["solution"], selfcal.cameras[0]
    assert selfcal.degrees_of_freedom == solution["degrees_of_freedom"]
    assert np.sqrt(selfcal.variance_of_unit_weight) == pytest.approx(solution["sigma0"], rel=1e-10)
    cofactors = np.array(solution["cofactors"]["camera"])
    scale = np.sqrt(np.outer(np.diag(cofactors), np.diag(cofactors)))
    assert (np.abs(camera.cofactors[:8, :8] - cofactors) < 1e-8 * scale).all()
    np.testing.assert_allclose(camera.correlations[:8, :8], golden["camera_correlations"], atol=1e-8)
    assert np.isnan(camera.correlations[8:]).all()
    redundancy = solution["kinds"]["camera prior"]["redundancy"][0]
    np.testing.assert_allclose(camera.redundancy[:8], redundancy, atol=1e-8)


def test_the_golden_tests_and_curve(golden, selfcal):
    [found] = calibrations(selfcal)
    sigma0 = golden["solution"]["sigma0"]
    lens = [each.test_value * sigma0 for each in found.parameters if each.is_lens]
    np.testing.assert_allclose(lens, golden["camera_test_values"][3:], rtol=1e-6)
    assert [(each.first, each.second) for each in found.correlations] == [("K2", "K3")]
    assert found.correlations[0].coefficient == pytest.approx(
        golden["correlations_above_0.85"][3][2], abs=1e-8
    )
    curve = golden["distortion_curve"]
    own = distortion_curve(selfcal, selfcal.cameras[0], np.array(curve["r_mm"]))
    np.testing.assert_allclose(own.values, curve["dr_mm"], rtol=1e-6)
    np.testing.assert_allclose(own.sd, np.array(curve["sd_mm"]) * sigma0, rtol=1e-6)


def test_the_band_of_the_mapping_is_that_of_rays(result):
    """Directions of image positions, with errors of all radial terms and the principal distance drawn."""
    camera = result.cameras[0]
    curve = distortion_curve(result, camera)
    keep = [camera.names.index(name) for name in ("c", "K1", "K2", "K3")]
    random = np.random.default_rng(3)
    root = np.linalg.cholesky(
        camera.covariance[np.ix_(keep, keep)] / np.outer(camera.sd[keep], camera.sd[keep])
    )
    bare = camera.camera.replace(parameters={camera.names[k]: camera.values[k] for k in keep}, sd=0.0)
    radii = np.array([3.0, 8.0, 12.0])
    tangents = []
    for _ in range(2000):
        drawn = camera.values[keep] + camera.sd[keep] * (root @ random.standard_normal(4))
        changed = bare.replace(
            parameters={camera.names[k]: value for k, value in zip(keep, drawn, strict=True)}
        )
        rays = changed.rays(np.column_stack([radii, np.zeros(3)]))
        tangents.append(rays[:, 0] / -rays[:, 2])
    spread = abs(camera.value("c")) * np.std(tangents, axis=0)
    expected = np.interp(radii, curve.radii, curve.sd_mapping)
    np.testing.assert_allclose(spread, expected, rtol=0.06)


def test_balanced_curves_vanish_where_they_should(example, result):
    curve = distortion_curve(result, result.cameras[0])
    assert np.interp(curve.balanced_at, curve.radii, curve.balanced) == pytest.approx(0.0, abs=2e-4)
    # An adjustment with balanced terms has the principal distance of that curve.
    start = example.START.replace(parameters={"c": -25.0, "r0": curve.balanced_at})
    balanced = adjust(example.measured().replace(cameras=[start]))
    # Weights are those of corrected coordinates, which are larger by the scale that c has taken over.
    scale = curve.balanced_distance / result.cameras[0].value("c")
    variance = result.variance_of_unit_weight * scale**2
    assert balanced.variance_of_unit_weight == pytest.approx(variance, rel=1e-3)
    assert balanced.cameras[0].value("c") == pytest.approx(curve.balanced_distance, abs=1e-3)
    own = distortion_curve(balanced, balanced.cameras[0], curve.radii)
    np.testing.assert_allclose(own.values[:40], curve.balanced[:40], rtol=0.03, atol=2e-3)


def test_forward_lenses_have_the_curve_of_ideal_radii(example):
    """Points on the axis of x, by the formula of the model."""
    block = example.measured()
    pixels = 1000 / 6
    camera = Camera("radial", {"f": 25 * pixels, "cx": 3000, "cy": 2000}, sd=FREE)
    xy = block.image_xy * [pixels, -pixels] + [3000, 2000]
    result = adjust(block.replace(cameras=[camera], image_xy=xy, image_sd=np.array(0.2)))
    found = result.cameras[0]
    f, k1, k2 = (found.value(name) for name in ("f", "k1", "k2"))
    curve = distortion_curve(result, found)
    t = curve.radii / f
    assert curve.direction == "forward"
    np.testing.assert_allclose(curve.values, f * (k1 * t**3 + k2 * t**5), rtol=1e-8, atol=1e-8)
    rows = [found.names.index(name) for name in ("k1", "k2")]
    partials = f * np.column_stack([t**3, t**5])
    sd = np.sqrt(np.einsum("ni,ij,nj->n", partials, found.covariance[np.ix_(rows, rows)], partials))
    np.testing.assert_allclose(curve.sd, sd, rtol=1e-6, atol=1e-12)
    assert curve.observed == pytest.approx(curve.radii[-1] / 1.25)


def test_terms_that_are_not_there_are_rarely_significant(example):
    """K3 is zero in the truth: its test value is Student's, and what leaving it out costs is its gain."""
    values, gains = [], []
    for seed in range(40):
        block = example.measured(seed=100 + seed)
        result = adjust(block)
        [found] = calibrations(result)
        k3 = next(each for each in found.parameters if each.name == "K3")
        values.append(k3.test_value)
        assert k3.significant == (abs(k3.test_value) > 1.96 * 1.01) or abs(abs(k3.test_value) - 1.96) < 0.02
        if seed < 5:
            sd = {name: sd for name, sd in example.START.sd.items() if name != "K3"}
            fewer = adjust(block.replace(cameras=[example.START.replace(sd=sd)]))
            rise = fewer.sums_of_squares.total - result.sums_of_squares.total
            gains.append(rise - k3.gain)
    assert np.sum(np.square(values)) < 73.4  # chi-square of 40, 0.1 percent
    assert np.sum(np.square(values)) > 17.9
    assert np.abs(gains).max() < 0.1


def test_groups_may_be_significant_where_their_members_are_not(example):
    """Weights that correlate two terms: their F is that of the formula."""
    result = adjust(example.measured())
    [found] = calibrations(result)
    assert [each.names for each in found.groups] == [("K1", "K2", "K3"), ("P1", "P2"), ("K2", "K3")]
    camera = result.cameras[0]
    rows = [camera.names.index(name) for name in ("P1", "P2")]
    p, q = camera.values[rows], camera.cofactors[np.ix_(rows, rows)]
    expected = p @ np.linalg.inv(q) @ p / (2 * result.variance_of_unit_weight)
    assert found.groups[1].test_value == pytest.approx(expected, rel=1e-8)
    assert all(each.significant for each in found.groups)
    assert found.removable == "K3"
    multiple = found.parameters[0].multiple_correlation
    assert multiple == pytest.approx(np.sqrt(1 - 1 / (camera.information[0] * camera.cofactors[0, 0])))


def test_what_comes_from_a_prior_is_said(example):
    block = example.measured()
    camera = example.START.replace(sd={"c": 1e-4, "K1": FREE, "K2": 1e-3})
    [found] = calibrations(adjust(block.replace(cameras=[camera])))
    said = found.remarks()
    assert any(line.startswith("c is from its prior") for line in said)
    assert any("c has moved by" in line for line in said)
    assert not any(line.startswith("K2 is from its prior") for line in said)


def test_other_terms_have_a_field_of_vectors(example, result, tmp_path):
    from photogram.results import plot_lens_field

    camera = result.cameras[0]
    field = lens_field(result, camera)
    assert field.names == ("P1", "P2")
    x, y = (field.positions - [camera.value("xp"), camera.value("yp")]).T
    r2 = x**2 + y**2
    partials = np.array([[r2 + 2 * x**2, 2 * x * y], [2 * x * y, r2 + 2 * y**2]]).transpose(2, 0, 1)
    p = [camera.names.index(name) for name in field.names]
    np.testing.assert_allclose(field.vectors, partials @ camera.values[p], rtol=1e-8, atol=1e-14)
    covariances = partials @ camera.covariance[np.ix_(p, p)] @ partials.transpose(0, 2, 1)
    np.testing.assert_allclose(field.covariances, covariances, rtol=1e-6, atol=1e-16)
    plot_lens_field(result, camera).save(tmp_path / "field.png")
    assert (tmp_path / "field.png").read_bytes().startswith(b"\x89PNG")
    bare = adjust(example.measured().replace(cameras=[example.START.replace(sd={"c": FREE, "K1": FREE})]))
    assert lens_field(bare, bare.cameras[0]) is None
    with pytest.raises(InputError) as error:
        plot_lens_field(bare, bare.cameras[0])
    assert error.value.code == "plot.lens-field"


def flat(example):
    """Return nearly vertical photos of a nearly flat field: they hardly tell c from the flying height."""
    random = np.random.default_rng(6)
    plane = np.array([[x, y, 0.0] for x in np.linspace(0, 8, 9) for y in np.linspace(0, 4, 5)])
    plane[:, 2] = random.uniform(-0.02, 0.02, len(plane))
    stations = np.array([[x, y, 6.0] for x in (2.0, 3.5, 5.0, 6.5) for y in (1.3, 2.7)])
    attitudes = random.uniform(-0.01, 0.01, stations.shape)
    photos, seen = (each.ravel() for each in np.indices((len(stations), len(plane))))
    ideal = project(plane[seen], stations[photos], attitudes[photos], np.full(len(photos), -1.0))
    xy = example.TRUTH.project(np.column_stack([ideal, np.full(len(ideal), -1.0)]))
    inside = (np.abs(xy) < [18.0, 12.0]).all(axis=1)
    return Block(
        photo_ids=[f"{i}" for i in range(1, 9)],
        photo_positions=stations,
        photo_attitudes=attitudes,
        cameras=[example.TRUTH.replace(sd={"c": FREE, "K1": FREE}, name="lens")],
        point_ids=[f"P{i}" for i in range(len(plane))],
        point_positions=plane,
        point_sd=np.where(np.arange(len(plane)) % 4 == 0, 0.001, np.inf)[:, np.newaxis] * np.ones(3),
        image_photos=photos[inside],
        image_points=seen[inside],
        image_xy=xy[inside] + random.normal(0, 0.001, xy[inside].shape),
        image_sd=0.001,
    )


def test_correlations_with_poses_name_parameter_component_and_photos(example):
    result = adjust(flat(example))
    [found] = calibrations(result)
    [heights] = [each for each in found.poses if (each.parameter, each.component) == ("c", "Z")]
    assert set(heights.photos) == set(result.block.photo_ids)
    # Against the joint covariance matrix of camera and photo.
    camera, photo = result.cameras[0], heights.photos[0]
    joint = result.covariance([("camera", "lens"), ("photo", photo)])
    c, z = camera.names.index("c"), len(camera.names) + 2
    expected = abs(joint[c, z]) / np.sqrt(joint[c, c] * joint[z, z])
    assert heights.coefficient == pytest.approx(expected, abs=1e-6)
    sentence = about("correlated.pose", **vars(heights))
    (section,) = (section for section in result.document().sections if section.key == "cameras")
    assert any(sentence in each for part in section.parts for each in getattr(part, "sentences", ()))
    [member] = json.loads(result.to_json())["calibrations"]
    said = [each for each in member["pose_correlations"] if each["component"] == "Z"]
    assert said[0]["photos"] == list(heights.photos)
    # Convergent photos tell them apart.
    [apart] = calibrations(adjust(example.measured()))
    assert not [each for each in apart.poses if each.parameter == "c"]


def test_report_document_and_picture(example, result, tmp_path, capsys):
    shown = example.main(tmp_path / "curve.svg")
    printed = capsys.readouterr().out
    assert printed.startswith("Cameras\n")
    assert "K3 may be left out" in printed
    assert "K2 and K3 are correlated by" in printed
    parameters = shown.document().table("parameters-24 mm lens")
    assert list(parameters.columns[0].values) == [test.name for test in calibrations(shown)[0].parameters]
    assert shown.document().table("distortion-24 mm lens").shown.size == 9
    report = shown.report()
    assert printed.strip() in report
    picture = (tmp_path / "curve.svg").read_text()
    assert "stroke-dasharray" in picture
    [member] = json.loads(result.to_json())["calibrations"]
    [found] = calibrations(result)
    assert [each["name"] for each in member["parameters"]] == [each.name for each in found.parameters]
    assert member["removable"] == "K3"
    assert len(member["distortion"]["radius"]) == len(member["distortion"]["sd_of_mapping"])
    assert member["remarks"] == found.remarks()


def test_without_covariances_there_is_nothing_to_say(example):
    result = adjust(example.measured(), covariance=False)
    assert calibrations(result) == []
    assert not any("parameters" in table.key for table in result.document().tables(layers=True))
    assert json.loads(result.to_json())["calibrations"] == []


def test_without_covariances_a_curve_has_no_band(example, result):
    bare = adjust(example.measured(), covariance=False)
    for camera, other in zip(bare.cameras, result.cameras, strict=True):
        found, expected = distortion_curve(bare, camera), distortion_curve(result, other)
        np.testing.assert_allclose(found.values, expected.values, rtol=1e-3, atol=1e-6)
        assert np.isnan(found.sd[1:]).all()
    assert b"Radial distortion with its standard deviations" in bare.to_html()
