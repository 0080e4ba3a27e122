"""Observations of every kind: residual, redundancy number, test value in arrays, tables, report, document."""

import json
from fnmatch import fnmatchcase

import numpy as np
import pytest

import photogram
from photogram import Orientation, Result, collection
from photogram.collection import AdjustedCollection
from photogram.results.films import OnFilm
from photogram.results.network import AdjustedNetwork
from photogram.show.methods import Documented
from photogram.words import Phrase

KINDS = {
    "image": ("residuals", "redundancy", "standardized"),
    "control": ("point_residuals", "point_redundancy", "point_standardized"),
    "station": ("photo_residuals", "photo_redundancy", "photo_standardized"),
}
"""Table -> arrays of residuals, redundancy numbers, test values."""
MEMBERS = {"image": "observations", "control": "control", "station": "stations"}


def sign_of(kind, name):
    """Tables say adjusted minus given, with test values of this sign; arrays say the contrary."""
    return -1.0 if kind != "image" and name.endswith("standardized") else 1.0


def block():
    made = photogram.simulate(
        strips=2, photos_per_strip=4, points_per_photo=40, position_sd=0.1, attitude_sd=1e-4, seed=3
    )
    return photogram.adjust(made.block, unit_variance="constrained")


def ring():
    made = collection.simulate(photos=6, points=40, seed=2)
    photos, start = len(made.truth.photo_parameters), made.collection
    sd = np.full((photos, 9), np.inf)
    sd[:, 6:] = [50.0, 0.1, 0.05]
    sd[0, :6] = 0.0
    points = np.full(start.point_positions.shape, np.inf)
    points[:5] = 0.01
    positions = start.point_positions.copy()
    positions[:5] = made.truth.point_positions[:5] + np.random.default_rng(1).normal(0, 0.01, (5, 3))
    parameters = start.photo_parameters.copy()
    parameters[0, :6] = made.truth.photo_parameters[0, :6]
    return collection.adjust(
        start.replace(
            photo_parameters=parameters,
            photo_sd=sd,
            point_positions=positions,
            point_sd=points,
            image_sd=0.5,
        )
    )


@pytest.fixture(params=[block, ring], scope="module")
def result(request):
    return request.param()


def rows_of(result, kind):
    return {
        "image": np.flatnonzero(result.used_images),
        "control": result.control.rows,
        "station": result.stations.rows,
    }[kind]


def test_redundancy_numbers_of_all_kinds_sum_to_the_degrees_of_freedom(result):
    total = sum(np.nansum(getattr(result, KINDS[kind][1])) for kind in KINDS)
    assert total == pytest.approx(result.degrees_of_freedom, abs=1e-6)
    assert all(np.nansum(getattr(result, KINDS[kind][1])) > 0 for kind in KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_tables_and_document_say_of_a_kind_what_its_arrays_say(result, kind):
    rows = rows_of(result, kind)
    table = getattr(result, f"{kind}_table")()
    document = json.loads(result.to_json())[MEMBERS[kind]]
    assert len(table) == len(document) == len(rows) > 0
    for name in KINDS[kind][1:]:
        values = getattr(result, name)[rows] * sign_of(kind, name)
        prefix = name.rpartition("_")[2]
        columns = table[[column for column in table if column.startswith(f"{prefix}_")]].to_numpy()
        np.testing.assert_array_equal(columns, values)
        said = np.array([row[prefix] for row in document], dtype=float)
        np.testing.assert_array_equal(said, values)
    difference = ("residual_", "residual") if kind == "image" else ("d_", "difference")
    assert any(column.startswith(difference[0]) for column in table)
    assert all(any(difference[1] in member for member in row) for row in document)


@pytest.mark.parametrize("kind", KINDS)
def test_the_document_has_every_observation_of_a_kind(result, kind):
    keys = {"image": "observations", "control": "control", "station": "stations-*"}[kind]
    tables = [table for table in result.document().tables(layers=True) if fnmatchcase(table.key, keys)]
    _, redundancy, tests = (
        getattr(result, name)[rows_of(result, kind)] * sign_of(kind, name) for name in KINDS[kind]
    )
    for name, values in {"redundancy": redundancy, "standardized": tests}.items():
        columns = [column for table in tables for column in table.columns if column.name == name]
        np.testing.assert_array_equal(np.hstack([column.values for column in columns]), values)


def test_standardized_residuals_are_residuals_over_their_standard_deviations(result):
    for part in ("photo", "point"):
        residuals, sd = getattr(result, f"{part}_residuals"), getattr(result, f"{part}_given_sd")
        redundancy, standardized = (
            getattr(result, f"{part}_redundancy"),
            getattr(result, f"{part}_standardized"),
        )
        weighted = np.isfinite(standardized)
        assert weighted.any()
        assert (np.isfinite(sd) & (sd > 0))[weighted].all()
        np.testing.assert_allclose(
            standardized[weighted], residuals[weighted] / (sd[weighted] * np.sqrt(redundancy[weighted]))
        )
        assert np.isnan(residuals[~np.isfinite(sd)]).all()
        np.testing.assert_array_equal(residuals[sd == 0], 0.0)


def test_a_wrong_weighted_point_of_a_collection_is_named():
    result = ring()
    positions = result.collection.point_positions.copy()
    positions[3, 2] += 0.5
    wrong = collection.adjust(result.collection.replace(point_positions=positions))
    assert Phrase("named.control", {"point": "3"}) in [line.fields["name"] for line in wrong.verdict.outliers]
    assert not result.verdict.outliers


def test_a_result_is_one_class():
    assert AdjustedCollection.__bases__ == (AdjustedNetwork,)
    # What it says of films is a part of a block alone.
    assert Result.__bases__ == (OnFilm, AdjustedNetwork)
    assert Documented in Orientation.__bases__


def test_a_report_lists_no_more_than_can_be_read(monkeypatch):
    from photogram.results import network_sections

    monkeypatch.setattr(network_sections, "IMAGES", 3)
    result = ring()
    table = result.document().table("observations")
    largest = np.argsort(-np.abs(result.standardized[result.used_images]).max(axis=1))[:3]
    assert sorted(largest.tolist()) == table.shown.tolist()
    assert len(table.frame()) == np.count_nonzero(result.used_images)


def test_arrays_cannot_be_written(result):
    with pytest.raises(ValueError, match="read-only"):
        result.residuals[0] = 0.0
