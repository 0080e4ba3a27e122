"""The result: arrays, tables, the report, the JSON document."""

from __future__ import annotations

import json
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from photogram import Attitudes, Block, Result, Spheroid, adjust, simulate
from photogram.network import lengths_of_units, project
from photogram.show.forms import titled_lines, written
from photogram.words import Phrase

ARCSEC = 180 * 3600 / math.pi
SPACES: dict[str, dict[str, Any]] = {
    "rectangular": {},
    "geographic": {"spheroid": Spheroid.wgs84(), "origin": (-1.65, 0.52, 10.0), "photo_to_ground": True},
}


@pytest.fixture(scope="module", params=SPACES)
def result(request: pytest.FixtureRequest) -> Result:
    """Adjust a block of each space with a blunder, check points and a point that is left out."""
    block = simulate(
        strips=2,
        photos_per_strip=4,
        points_per_photo=25,
        control_spacing=2,
        check_points=4,
        blunders=1,
        blunder_size=0.5,
        seed=12,
        **SPACES[request.param],
    ).block
    single = Block(
        **{
            **{name: getattr(block, name) for name in Block.__dataclass_fields__},
            "title": "A BLOCK OF TWO STRIPS",
            "point_ids": [*block.point_ids, "SINGLE"],
            "point_positions": np.vstack([block.point_positions, np.full((1, 3), np.nan)]),
            "point_sd": np.vstack([block.point_sd, np.full((1, 3), np.inf)]),
            "point_check_sd": None,
            "image_photos": np.append(block.image_photos, 2),
            "image_points": np.append(block.image_points, len(block.point_ids)),
            "image_xy": np.vstack([block.image_xy, [[1.0, 2.0]]]),
            "image_sd": np.vstack([block.image_sd, [[0.01, 0.01]]]),
        }
    )
    return adjust(single)


def outward(result: Result, positions: Any) -> Any:
    """Longitudes and latitudes in degrees, as tables and the document have them."""
    scale = 180 / math.pi if result.block.geographic else 1.0
    return np.asarray(positions) * [scale, scale, 1.0]


# Arrays


def test_shapes(result):
    photos, points, images = (
        len(result.block.photo_ids), len(result.block.point_ids), len(result.block.image_xy)
    )  # fmt: skip
    for name, shape in {
        "photo_positions": (photos, 3),
        "photo_attitudes": (photos, 3),
        "photo_cofactors": (photos, 6, 6),
        "photo_covariances": (photos, 6, 6),
        "photo_rotation_covariances": (photos, 6, 6),
        "photo_redundancy": (photos, 6),
        "photo_sd": (photos, 6),
        "point_positions": (points, 3),
        "point_cofactors": (points, 3, 3),
        "point_covariances": (points, 3, 3),
        "point_redundancy": (points, 3),
        "point_sd": (points, 3),
        "point_differences": (points, 3),
        "point_kinds": (points,),
        "point_rays": (points,),
        "used_points": (points,),
        "residuals": (images, 2),
        "redundancy": (images, 2),
        "standardized": (images, 2),
        "used_images": (images,),
    }.items():
        assert getattr(result, name).shape == shape, name
    assert np.isfinite(result.residuals[:-1]).all()
    assert np.isnan(result.residuals[-1]).all()
    assert np.isnan(result.point_positions[-1]).all()


@pytest.mark.giant("4", "the local frame moves with the station during iteration")
@pytest.mark.giant("14", "19 residuals are observed minus computed")
def test_section_4_residuals_are_observed_minus_computed(result):
    block, used = result.block, result.used_images
    photos, points = block.image_photos[used], block.image_points[used]
    computed = project(
        result.point_positions[points],
        result.photo_positions[photos],
        result.photo_attitudes[photos],
        block.principal_distances[photos],
        spheroid=block.spheroid,
        photo_to_ground=block.photo_to_ground,
    )
    np.testing.assert_allclose(result.residuals[used], block.image_xy[used] - computed, rtol=0, atol=1e-9)


def test_rotation_covariances_follow_from_a_numerical_jacobian(result):
    block = result.block
    kind = "omega_phi_kappa_photo_to_ground" if block.photo_to_ground else "omega_phi_kappa"
    angles, step = result.photo_attitudes, 1e-6
    adjusted = Attitudes.of(kind, angles).matrices

    def rotation_vectors(changed: Any) -> Any:
        turn = adjusted.transpose(0, 2, 1) @ Attitudes.of(kind, changed).matrices
        return np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)

    jacobian = np.tile(np.eye(6), (len(angles), 1, 1))
    for k, axis in enumerate(np.eye(3)):
        apart = rotation_vectors(angles + step * axis) - rotation_vectors(angles - step * axis)
        jacobian[:, 3:, 3 + k] = apart / (2 * step)
    expected = jacobian @ result.photo_covariances @ jacobian.transpose(0, 2, 1)
    sd = np.sqrt(np.diagonal(expected, axis1=1, axis2=2))
    scale = sd[:, :, np.newaxis] * sd[:, np.newaxis]
    found = result.photo_rotation_covariances
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-8)
    np.testing.assert_array_equal(found[:, :3, :3], result.photo_covariances[:, :3, :3])
    again = pickle.loads(pickle.dumps(result))
    np.testing.assert_array_equal(again.photo_rotation_covariances, found)


def test_kinds_and_rays(result):
    kinds = dict(zip(result.block.point_ids, result.point_kinds, strict=True))
    letters = {"C": "control", "K": "check", "P": "pass", "S": "pass"}
    assert all(kind == letters[name[0]] for name, kind in kinds.items())
    rays = np.bincount(result.block.image_points, minlength=len(result.block.point_ids))
    rays[-1] = 0
    np.testing.assert_array_equal(result.point_rays, rays)
    assert dict(result.dropped) == {"SINGLE": "pass-point-on-one-photo"}


@pytest.mark.giant("14", "22 column 12 acts without propagation")
def test_section_14_without_covariance(result):
    bare = adjust(result.block, covariance=False)
    np.testing.assert_array_equal(bare.photo_positions, result.photo_positions)
    np.testing.assert_array_equal(bare.residuals, result.residuals)
    for name in ("photo_cofactors", "point_cofactors", "redundancy", "standardized", "photo_sd"):
        assert np.isnan(getattr(bare, name)).all(), name
    assert bare.variance_of_unit_weight == result.variance_of_unit_weight
    document = json.loads(bare.to_json())
    assert document["photos"][0]["covariance"] == [[None] * 6] * 6
    assert document["observations"][0]["redundancy"] == [None, None]
    assert "nan" not in bare.to_json().decode().lower()
    assert bare.document().sections[0].parts


# Tables


def test_photo_table(result):
    table = result.photo_table()
    axes = ["longitude_deg", "latitude_deg", "height"] if result.block.geographic else ["X", "Y", "Z"]
    names = [*axes, "omega_deg", "phi_deg", "kappa_deg"]
    assert list(table) == ["photo", *names, *(f"sd_{name}" for name in names)]
    assert table["photo"].tolist() == result.block.photo_ids
    np.testing.assert_allclose(table[axes], outward(result, result.photo_positions), rtol=1e-15)
    np.testing.assert_allclose(table[names[3:]], np.degrees(result.photo_attitudes), rtol=1e-15)
    deviations = table[[f"sd_{name}" for name in names]].to_numpy()
    np.testing.assert_allclose(deviations[:, :3], outward(result, result.photo_sd[:, :3]), rtol=1e-15)
    np.testing.assert_allclose(deviations[:, 3:], np.degrees(result.photo_sd[:, 3:]), rtol=1e-15)


def test_point_table(result):
    table = result.point_table()
    used = result.used_points
    assert len(table) == used.sum() == len(used) - 1
    assert "SINGLE" not in set(table["point"])
    assert table["kind"].tolist() == result.point_kinds[used].tolist()
    assert table["rays"].tolist() == result.point_rays[used].tolist()
    np.testing.assert_allclose(
        table.iloc[:, 3:6].to_numpy(), outward(result, result.point_positions[used]), rtol=1e-15
    )
    np.testing.assert_allclose(
        table.iloc[:, 6:].to_numpy(), outward(result, result.point_sd[used]), rtol=1e-15
    )
    assert list(table.columns[6:]) == [f"sd_{name}" for name in table.columns[3:6]]


def test_image_table(result):
    table = result.image_table()
    assert list(table) == [
        "photo", "point", "residual_x_mm", "residual_y_mm", "redundancy_x", "redundancy_y", "standardized_x",
        "standardized_y",
    ]  # fmt: skip
    assert len(table) == result.used_images.sum() == len(result.block.image_xy) - 1
    np.testing.assert_array_equal(table[["residual_x_mm", "residual_y_mm"]], result.residuals[:-1])
    np.testing.assert_array_equal(table[["standardized_x", "standardized_y"]], result.standardized[:-1])
    row = table.iloc[17]
    assert row["photo"] == result.block.photo_ids[result.block.image_photos[17]]
    assert row["point"] == result.block.point_ids[result.block.image_points[17]]


@pytest.mark.giant("14", "9 code 7: check point")
def test_section_14_check_table(result):
    table = result.check_table()
    assert len(table) == 4
    check = result.point_kinds == "check"
    differences = outward(result, result.point_differences[check])
    np.testing.assert_allclose(table.iloc[:, 1:4].to_numpy(), differences, rtol=1e-12)
    np.testing.assert_allclose(
        table.iloc[:, 4:7].to_numpy(), outward(result, result.point_sd[check]), rtol=1e-15
    )
    assert all(name.startswith("d_") for name in table.columns[1:4])


def test_adjusted_tables_make_a_block_again(result):
    block = result.block
    images = result.image_table()
    images["x_mm"], images["y_mm"] = block.image_xy[result.used_images].T
    again = Block.from_tables(
        result.photo_table().filter(regex="^(?!sd_)"),
        images,
        principal_distance=-152.74,
        spheroid=block.spheroid,
        photo_to_ground=block.photo_to_ground,
    )
    np.testing.assert_allclose(again.photo_positions, result.photo_positions, rtol=1e-15)
    np.testing.assert_allclose(again.photo_attitudes, result.photo_attitudes, rtol=1e-15)
    assert again.image_xy.shape == block.image_xy[:-1].shape


# The report


def facts(result: Result, key: str) -> dict[str, str]:
    """Return the figures of a section by their names."""
    document = result.document()
    sections = [*document.sections, *document.details]
    parts = [part for section in sections if section.key == key for part in section.parts]
    return {fact.name: fact.value for part in parts for fact in getattr(part, "facts", ())}


def test_the_report_begins_with_verdict_and_remarks(result):
    titles = [title for title, _ in titled_lines(result.document())]
    assert titles[:4] == ["Verdict", "What to do next", "Key figures", "Remarks"]
    assert "A BLOCK OF TWO STRIPS" in result.report().split("\n")[0]
    (remarks,) = result.document().sections[0].parts
    assert any("left out, pass point on one photo: SINGLE" in line for line in remarks.sentences)


def test_the_remarks_begin_with_an_adjustment_that_failed(result):
    early = adjust(result.block, max_iterations=1)
    assert early.status == "not converged"
    (remarks,) = early.document().sections[0].parts
    assert remarks.sentences[0].startswith("the adjustment has not converged: do not use")
    clean = simulate(strips=2, photos_per_strip=3, seed=1).block
    (remarks,) = adjust(clean).document().sections[0].parts
    assert not remarks.sentences


@pytest.mark.giant("7", "degrees of freedom n - u; variance and its square root are printed")
def test_section_7_the_report_counts_and_weighs(result):
    figures = facts(result, "size")
    for name, value in {
        "Degrees of freedom": str(result.degrees_of_freedom),
        "Variance of unit weight": f"{result.variance_of_unit_weight:.6f}",
        "Weighted sum of squares, photos": f"{result.sums_of_squares.camera + 0.0:.6f}",
        "Weighted sum of squares, control": f"{result.sums_of_squares.ground:.6f}",
        "Weighted sum of squares, images": f"{result.sums_of_squares.plates:.6f}",
        "Weighted sum of squares, total": f"{result.sums_of_squares.total:.6f}",
        "Photos": "8",
        "Object space": "geographic" if result.block.geographic else "rectangular",
        "Rotation angles": "photo-to-ground" if result.block.photo_to_ground else "ground-to-photo",
    }.items():
        assert figures[name] == value, name
    assert facts(result, "iterations")["Status"] == "converged"


def test_every_quantity_of_the_report_has_a_unit(result):
    for key, count in {
        "check_points": 5,
        "control": 5,
        "photos-positions": 6,
        "photos-attitudes": 6,
        "differences": 3,
    }.items():
        columns = written(result.document().table(key)).columns
        units = [column for column in columns if column.unit or "Component" in column.head]
        assert len(units) >= (count if not result.block.geographic else 1), key


def test_the_report_names_the_blunder(result):
    worst = {column.head: column.values for column in result.document().table("worst").columns}
    image, axis = np.unravel_index(np.nanargmax(np.abs(result.standardized)), result.standardized.shape)
    assert worst["Photo"][0] == result.block.photo_ids[result.block.image_photos[image]]
    assert worst["Point"][0] == result.block.point_ids[result.block.image_points[image]]
    assert worst["Observation"][0] == f"image {'xy'[axis]}"
    assert abs(result.standardized[image, axis]) > 10


def test_values_of_the_report_are_those_of_the_arrays(result):
    document = result.document()
    *_, values, sd = document.table("photos-attitudes").columns
    np.testing.assert_array_equal(values.values, result.photo_attitudes)
    np.testing.assert_allclose(sd.outward(), result.photo_sd[:, 3:] * ARCSEC, rtol=1e-12)
    line = next(line for line in result.report().split("\nAttitudes\n")[1].split("\n")[1:2])
    assert line.split()[0] == result.block.photo_ids[0]
    angles = [float(value) for value in line.split()[1:4]]
    np.testing.assert_allclose(angles, np.degrees(result.photo_attitudes[0]), rtol=0, atol=1e-3)


# The JSON document


@pytest.fixture(scope="module")
def document(result: Result) -> dict[str, Any]:
    return json.loads(result.to_json())


def test_members_of_the_document(result, document):
    assert set(document) == {
        "program", "title", "units", "conventions", "status", "messages", "loss",
        "initial_weighted_sum_of_squares", "iterations", "weighted_sum_of_squares", "degrees_of_freedom",
        "unit_variance", "variance_of_unit_weight", "covariance_scale", "photos", "points", "observations",
        "observations_beside_images",
        "control", "stations", "problems", "global_test", "verdict",
        "check_points", "dropped_points", "ordering", "predictions", "operations", "refraction", "seconds",
        "datum", "redundancy", "weakest", "reliability",
    }  # fmt: skip
    assert document["status"] == "converged"
    assert document["title"] == "A BLOCK OF TWO STRIPS"
    assert document["degrees_of_freedom"] == result.degrees_of_freedom
    assert document["variance_of_unit_weight"] == result.variance_of_unit_weight
    assert document["covariance_scale"] == result.variance_of_unit_weight
    assert document["unit_variance"] == "constrained"
    sums = result.sums_of_squares
    assert document["weighted_sum_of_squares"] == {
        "camera": sums.camera, "ground": sums.ground, "plates": sums.plates, "observations": 0.0,
        "total": sums.total
    }  # fmt: skip
    assert document["dropped_points"] == [
        {"id": "SINGLE", "code": "pass-point-on-one-photo", "reason": "pass point on one photo"}
    ]
    assert [iteration["number"] for iteration in document["iterations"]] == [
        iteration.number for iteration in result.iterations
    ]
    assert document["iterations"][-1]["weighted_sum_of_squares"] == pytest.approx(sums.total, rel=1e-12)
    assert set(document["operations"]) == {"reduction", "factor", "inverse"}
    assert set(document["seconds"]) == {"form", "factor", "solve", "invert", "cofactors"}


def test_units_and_conventions_of_the_document(result, document):
    units, conventions = document["units"], document["conventions"]
    assert set(units) == {
        "position", "position_covariance", "attitude", "attitude_covariance", "covariance", "residual_mm",
        "difference", "operations", "seconds", "water_level", "position_difference", "position_sd",
        "attitude_difference_rad", "attitude_sd_rad",
    }  # fmt: skip
    assert units["residual_mm"] == "mm"
    assert units["attitude"] == "rad"
    assert ("longitude deg, latitude deg" in units["position"]) == result.block.geographic
    assert conventions["object_space"] == ("geographic" if result.block.geographic else "rectangular")
    assert conventions["rotation"].startswith("photo" if result.block.photo_to_ground else "ground")
    assert "covariance_scale" in conventions["covariance"]


def test_an_ordering_that_failed_is_reported(result):
    failed = replace(result, predictions={**result.predictions, "amd": math.nan})
    work = facts(failed, "work")
    assert work["Multiply-adds if eliminated by minimum degree"] == "too large for this ordering"
    assert json.loads(failed.to_json())["predictions"]["amd"] is None


def test_photos_of_the_document(result, document):
    photos = document["photos"]
    assert [photo["id"] for photo in photos] == result.block.photo_ids
    np.testing.assert_allclose(
        [photo["position"] for photo in photos], outward(result, result.photo_positions), rtol=1e-15
    )
    np.testing.assert_array_equal([photo["attitude_rad"] for photo in photos], result.photo_attitudes)
    covariances = np.array([photo["covariance"] for photo in photos])
    np.testing.assert_array_equal(covariances, result.photo_covariances)
    positions = np.array([photo["position_covariance"] for photo in photos])
    np.testing.assert_array_equal(positions, covariances[:, :3, :3])
    attitudes = np.array([photo["attitude_covariance"] for photo in photos])
    np.testing.assert_array_equal(attitudes, covariances[:, 3:, 3:])


def test_points_of_the_document(result, document):
    points, used = document["points"], result.used_points
    assert [point["id"] for point in points] == [
        name for name, use in zip(result.block.point_ids, used, strict=True) if use
    ]
    np.testing.assert_allclose(
        [point["position"] for point in points], outward(result, result.point_positions[used]), rtol=1e-15
    )
    np.testing.assert_array_equal([point["covariance"] for point in points], result.point_covariances[used])
    assert [point["rays"] for point in points] == result.point_rays[used].tolist()
    assert {point["kind"] for point in points} == {"pass", "control", "check"}


def test_observations_of_the_document(result, document):
    observations = document["observations"]
    assert len(observations) == result.used_images.sum()
    assert set(observations[0]) == {"photo", "point", "residual_mm", "redundancy", "standardized"}
    for member, values in {
        "residual_mm": result.residuals, "redundancy": result.redundancy, "standardized": result.standardized
    }.items():  # fmt: skip
        found = np.array([each[member] for each in observations], dtype=float)
        np.testing.assert_array_equal(found, values[result.used_images])


def test_check_points_of_the_document(result, document):
    check = result.point_kinds == "check"
    assert len(document["check_points"]) == check.sum() == 4
    np.testing.assert_allclose(
        [point["difference"] for point in document["check_points"]],
        outward(result, result.point_differences[check]),
        rtol=1e-12,
    )


def test_what_is_no_number_is_null():
    # Without redundancy there is no variance of unit weight, and no test value.
    block = simulate(
        strips=1, photos_per_strip=2, points_per_photo=6, control="none", position_sd=30.0, attitude_sd=0.01,
        check_points=1, seed=3,
    ).block  # fmt: skip
    positions = block.point_positions.copy()
    positions[np.isfinite(positions[:, 0]), 2] = np.nan
    result = adjust(block.replace(point_positions=positions), unit_variance="free")
    document = json.loads(result.to_json())
    assert document["variance_of_unit_weight"] is None
    assert document["covariance_scale"] == 1.0
    assert document["check_points"][0]["difference"][2] is None
    assert document["check_points"][0]["difference"][0] is not None
    assert str(Phrase("free.weights.photos")) in document["messages"]
    assert facts(result, "size")["Variance of unit weight"] == "undefined"
    assert "covariances are scaled by 1" in result.report()


def test_report_and_document_name_the_linear_unit(small_block):
    result = adjust(small_block.replace(linear_unit="ft"))
    assert "X ft" in result.report()
    assert " m\n" not in result.report()
    assert json.loads(result.to_json())["units"]["position"] == "ft"


def test_reports_of_geographic_blocks_have_lengths_beside_seconds_of_arc():
    origin = (-1.65, 0.52, 10.0)
    block = simulate(strips=2, photos_per_strip=3, spheroid=Spheroid.wgs84(), origin=origin, seed=1).block
    result = adjust(block)
    columns = result.document().table("photos-positions").columns
    lengths = columns[-1]
    assert [axis.name for axis in lengths.axes] == ["east", "north"]
    east, north = lengths.outward()[0]
    sd = result.photo_sd[0]
    assert east == pytest.approx(sd[0] * 6.37e6 * np.cos(0.52), rel=0.01)
    assert north == pytest.approx(sd[1] * 6.37e6, rel=0.01)
    names, angles, lengths = result.document().table("differences").columns
    assert names.values[0] == "control points"
    scale = lengths_of_units(result.photo_positions.mean(axis=0, keepdims=True), block.spheroid)[0]
    np.testing.assert_allclose(lengths.values, angles.values[:, :2] * scale[:2])
