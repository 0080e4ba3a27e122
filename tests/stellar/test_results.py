"""What comes after the adjustment: determinants, ellipses, combination, comparator axes, camera files."""

import json
import math
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import golden
import numpy as np
import pytest

from message_codes import coded
from photogram import InputError
from photogram.stellar import (
    ARCSEC,
    INDEX,
    NAMES,
    Options,
    PlateCamera,
    SkyCamera,
    calibrate,
    camera_document,
    read_plain,
)
from photogram.stellar.curves import comparator_frame

EXAMPLE = Path(str(files("photogram") / "examples" / "stellar" / "plate.toml"))


@pytest.fixture(scope="module")
def plate():
    return read_plain(EXAMPLE)


@pytest.fixture(scope="module")
def unknown(plate):
    """Return the example with every fifth star as an unknown direction, one of them with a single image."""
    weights = plate.star_weights.copy()
    weights[::5] = 0
    drop = np.isin(np.arange(len(plate.image_points)), np.flatnonzero(plate.image_stars == 5)[1:])
    made = replace(plate, star_weights=weights).without(np.zeros(75, bool), drop)
    return calibrate(made)


@pytest.fixture(scope="module")
def still(plate):
    """Return the example with a camera that did not move: one attitude, and noise."""
    start = calibrate(plate).solved.parameters
    start[0:3] = start[3:6] = start[6:9]
    core = plate.core(start, plate.star_places, np.ones(26, bool))
    noise = 3e-6 * np.random.default_rng(21).standard_normal(plate.image_xy.shape)
    xy = plate.image_xy - core.equations()["constant"] + noise
    return replace(plate, image_xy=xy, initial=start, options=replace(plate.options, histogram=True))


def test_the_determinant_is_that_of_the_reference():
    document = golden.load("golden_adjustment_noisy")
    (stage,) = calibrate(golden.problem(document, as_published=True)).stages
    inverse = np.array(document["results"]["Ninv_22"])
    scale = np.sqrt(np.diag(inverse))
    sign, value = np.linalg.slogdet(inverse / np.outer(scale, scale))
    assert sign == 1
    assert stage.log_determinant == pytest.approx(-value - 2 * np.log(scale).sum(), abs=1e-6)


def test_the_document_has_the_determinant_of_every_solution(plate):
    stars = tuple(plate.star_ids[i] for i in (0, 4, 20, 36, 60, 74))
    groups = np.full_like(plate.image_groups, 2)
    solved = calibrate(plate).solved.parameters
    solved[0:6] = np.tile(solved[6:9], 2)
    core = replace(plate, image_groups=groups).core(solved, plate.star_places, np.ones(26, bool))
    xy = plate.image_xy - core.equations()["constant"]
    options = replace(plate.options, minimum_stars=stars, movement_factor=0.0)
    start = solved.copy()
    made = replace(plate, image_groups=groups, image_xy=xy, initial=start, options=options)
    result = calibrate(made)
    assert [stage.solution for stage in result.stages] == ["minimum", "maximum"]
    assert result.stages[0].counts.parameter_unknowns == 8
    document = json.loads(result.to_json())
    assert [row["solution"] for row in document["solutions"]] == ["minimum", "maximum"]
    expected = result.stages[1].log_determinant / math.log(10)
    assert document["solutions"][1]["log10_determinant"] == pytest.approx(expected)


def test_ellipses_of_unknown_directions(unknown):
    """Section 5.7, against its formulas instead of eigenvectors."""
    problem, solved = unknown.problem, unknown.solved
    directions = unknown.directions()
    for k, star in enumerate(directions.stars):
        images = problem.image_stars == star
        inverse = solved.star_inverse[star]
        q = solved.star_cofactors[star] - inverse
        own = unknown.mean_error
        if images.sum() > 1:
            own = math.sqrt((solved.residuals[images] ** 2).sum() / (2 * images.sum() - 2))
        assert directions.image_mean_errors[k] == pytest.approx(own, rel=1e-12)
        turn = np.diag([math.cos(directions.places[k, 1]), 1.0])
        for found, covariance in (
            (directions.orientation, unknown.mean_error**2 * q),
            (directions.published, unknown.mean_error**2 * q + own**2 * inverse),
            (directions.total, unknown.mean_error**2 * (q + inverse)),
        ):
            (q11, q12), (_, q22) = turn @ covariance @ turn
            theta = 0.5 * math.atan2(2 * q12, q11 - q22)
            spread = 2 * q12 / math.sin(2 * theta)
            major, minor, direction = found[k]
            assert major == pytest.approx(math.sqrt((q11 + q22 + spread) / 2), rel=1e-6)
            assert minor == pytest.approx(math.sqrt((q11 + q22 - spread) / 2), rel=1e-4)
            assert math.remainder(direction - theta, math.pi) == pytest.approx(0, abs=1e-6)
        assert directions.orientation[k, 0] < directions.total[k, 0]


def test_unknown_directions_in_the_document(unknown):
    document = json.loads(unknown.to_json())
    assert len(unknown.document().table("directions").columns[0].values) == 15
    assert "Unknown directions" in unknown.report()
    stars = [star for star in document["stars"] if not star["known"]]
    assert len(stars) == 15
    assert {"correction", "m_i", "orientation_ellipse", "published_ellipse", "ellipse"} <= set(stars[0])
    # The single image of the second one is met exactly.
    assert stars[1]["correction"] == pytest.approx([0, 0], abs=1e-3)
    assert np.abs([star["correction"] for star in stars]).max() < 20


def test_the_combined_solution_is_that_of_one_attitude(still):
    combined = calibrate(still).combined
    assert combined is not None
    # All images with one attitude: the combined solution is iterated to the same.
    options = replace(still.options, movement_factor=0.0)
    one = calibrate(replace(still, image_groups=np.full_like(still.image_groups, 2), options=options))
    errors = np.array([one.mean_errors[name] for name in NAMES[6:22]])
    off = (combined.solved.parameters - one.solved.parameters)[6:22]
    assert np.abs(off / errors).max() < 1e-4
    again = np.array([combined.mean_errors[name] for name in NAMES[6:22]])
    assert again == pytest.approx(errors, rel=1e-5)
    assert combined.degrees_of_freedom == one.degrees_of_freedom == 734
    assert combined.mean_error == pytest.approx(one.mean_error, rel=1e-8)
    assert combined.solved.residuals == pytest.approx(one.solved.residuals, abs=1e-11)


def test_the_combined_solution_has_all_tables(still):
    result = calibrate(still)
    text, document = result.report(), json.loads(result.to_json())
    assert "ORIENTATIONS FROM PRE, POST, EVENT CONSTRAINED TO COMMON VALUES" in text
    for table in ("images", "stars", "transformed-angles", "parameters"):
        assert result.document().table(f"combined.{table}").visible
    combined = document["combined"]
    assert combined["pairs"] == [["pre", "post"], ["post", "event"], ["pre", "event"]]
    assert len(combined["images"]) == len(document["images"])
    assert combined["transformed"]["pre"] == pytest.approx(combined["transformed"]["event"], abs=1e-12)
    # Residuals of the two solutions differ, and each set belongs to its solution.
    assert combined["images"][0]["residual_um"] != document["images"][0]["residual_um"]
    as_published = calibrate(replace(still, options=replace(still.options, as_published=True))).combined
    assert as_published.mean_error == pytest.approx(result.combined.mean_error, rel=5e-3)


def test_fictitious_points_agree_with_the_movement_test(still):
    result = calibrate(still)
    found = result.movement
    assert found.places.shape == (3, 9, 2)
    for pair, differences in zip(found.pairs, found.differences, strict=True):
        first, second = (found.groups.index(name) for name in pair)
        rises = found.horizontal[second, :, 1] - found.horizontal[first, :, 1]
        assert rises == pytest.approx(differences[:, 3], abs=1e-12)
    # Each direction's own error is at least a part of their difference's.
    assert (np.linalg.eigvalsh(found.covariances)[..., 0] > 0).all()


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, -45.0])
def test_comparator_axes(plate, degrees):
    result, angle = calibrate(plate), math.radians(degrees)
    found = comparator_frame(result, angle)

    def turned(values):
        epsilon, cx, cy = values[[INDEX["epsilon"], INDEX["cx"], INDEX["cy"]]]
        c = 0.5 * (cx + cy)
        a = np.array([[cx / c, -epsilon], [0.0, cy / c]])
        r = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        a = r @ a @ r.T
        return np.array([a[0, 0], a[1, 1], -a[0, 1] - a[1, 0]])

    values = result.solved.parameters
    assert [found.scale_x, found.scale_y, found.epsilon] == pytest.approx(turned(values), abs=1e-14)
    jacobian = np.zeros((3, 26))
    for name in ("epsilon", "cx", "cy"):
        step = np.zeros(26)
        step[INDEX[name]] = 1e-6
        jacobian[:, INDEX[name]] = (turned(values + step) - turned(values - step)) / 2e-6
    expected = jacobian @ result.covariance @ jacobian.T
    assert found.covariance == pytest.approx(expected, rel=1e-5, abs=1e-6 * np.abs(expected).max())


def test_comparator_axes_of_a_common_scale(plate):
    options = replace(plate.options, common_scale=True, comparator_angle=0.3)
    result = calibrate(replace(plate, options=options))
    found = comparator_frame(result, 0.3)
    oblique = math.sin(0.6) / 2 * result.parameters["epsilon"]
    assert found.scale_x == pytest.approx(1 - oblique, abs=1e-15)
    assert json.loads(result.to_json())["comparator_frame"]["scale_x"] == found.scale_x


def test_a_plate_camera_comes_back_from_its_file(plate, tmp_path):
    result = calibrate(plate)
    (tmp_path / "camera.json").write_bytes(camera_document(result))
    camera, given = PlateCamera.read(tmp_path / "camera.json"), PlateCamera.of(result)
    assert (camera.values == given.values).all()
    assert (camera.covariance == given.covariance).all()
    assert (camera.mean_error, camera.degrees_of_freedom) == (given.mean_error, 728)
    document = json.loads(camera_document(result))
    assert set(document["orientation"]["station"]) == {"pre", "post", "event"}
    assert len(document["full_covariance"]["order"]) == 22
    with pytest.raises(InputError, check=coded("error.choice", value="stellar camera")):
        SkyCamera.read(tmp_path / "camera.json")
    with pytest.raises(InputError, match="cannot be read"):
        PlateCamera.read(tmp_path / "nowhere.json")


def test_a_camera_as_prior_adds_its_information(plate, tmp_path):
    """A plate after a plate: the normal equations of both add up."""
    first = calibrate(plate)
    camera = PlateCamera.of(first)
    second = calibrate(camera.as_prior(plate, first.mean_error))
    assert second.degrees_of_freedom == 728 + 13
    # The same plate twice: half the covariance of the camera, the same camera.
    ratio = np.diag(second.solved.cofactors)[9:22] / np.diag(first.solved.cofactors)[9:22]
    assert ratio == pytest.approx(np.full(13, 0.5), rel=1e-3)
    errors = np.sqrt(np.diag(camera.covariance))
    assert np.abs((second.solved.parameters[9:22] - camera.values) / errors).max() < 1e-3
    with pytest.raises(InputError, check=coded("stars.other-form")):
        camera.as_prior(replace(plate, options=Options(common_scale=True)))
    # The same in plain form.
    for file in EXAMPLE.parent.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "camera.json").write_bytes(camera.to_json())
    plain = tmp_path / "plate.toml"
    plain.write_text(plain.read_text().replace("[camera]", '[camera]\nprior = "camera.json"'))
    read = read_plain(plain)
    assert read.weighted.sum() == 13
    assert read.initial[9:22] == pytest.approx(camera.values)


def test_what_the_prior_held_is_held(plate):
    fixed = plate.fixed.copy()
    fixed[INDEX["K3"]] = True
    camera = PlateCamera.of(calibrate(replace(plate, fixed=fixed)))
    made = camera.as_prior(plate)
    assert made.fixed[INDEX["K3"]]
    assert made.weighted.sum() == 12


def test_residuals_of_directions_are_of_the_size_of_the_catalogue(plate):
    document = json.loads(calibrate(plate).to_json())
    residuals = np.array([star["residual"] for star in document["stars"]])
    assert np.abs(residuals).max() < 5 * 0.2
    assert document["stars"][0]["ellipse"]["major_arcsec"] * ARCSEC < 1e-6
