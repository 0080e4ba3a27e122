"""Readings that stand out are named, on plates of few points as well."""

import json

import numpy as np
import pytest

from photogram import InputError
from photogram.perspective_center import Grid, Run, determine
from photogram.perspective_center.document import set_document
from photogram.show.forms import titled_lines


@pytest.fixture
def eight(make_grid):
    """Return a plate of eight points with readings good to 0.01 in the model, one of them changed."""

    def make(*, error=0.0, seed=0):
        grid = make_grid(across=3, sd=0.01, seed=seed)
        keep = np.delete(np.arange(9), 4)
        model = grid.model[keep].copy()
        model[2, 1] += error
        return Grid([grid.ids[k] for k in keep], grid.plate_xy[keep], model, grid.principal_distance)

    return make


def test_a_blunder_on_a_plate_of_eight_points_is_named(eight):
    """The internally studentized residual cannot exceed root 10 = 3.16."""
    result = determine(eight(error=5.0))
    assert result.degrees_of_freedom == 10
    assert 3.15 < abs(result.standardized[2, 1]) <= np.sqrt(10)
    assert result.limit == pytest.approx(3.997, abs=0.001)
    assert result.outliers[0] == (2, 1)
    assert abs(result.studentized[2, 1]) > 50
    (message,) = result.messages
    assert message.code == "projector.outliers"
    assert (message.phrase.fields["set"], round(message.phrase.fields["limit"], 2)) == (1, 4.0)
    assert "point 3 Y (t " in str(message)
    (_, figures) = titled_lines(set_document(result), [])[-1]
    assert figures[-1].split() == ["readings", "beyond", "the", "limit", f"{len(result.outliers)}"]
    document = json.loads(Run([result], result.messages).to_json())
    (each,) = document["sets"]
    assert each["test"]["outliers"][0] == [3, "Y"]
    assert each["points"][2]["studentized"][1] == pytest.approx(result.studentized[2, 1])
    assert "point 3 Y" in document["messages"][0]


def test_good_readings_are_named_in_one_set_of_twenty(eight):
    named = [bool(determine(eight(seed=seed)).outliers) for seed in range(300)]
    assert 0.005 < np.mean(named) < 0.09


def test_without_redundancy_nothing_is_tested(make_grid):
    grid = make_grid(across=3, sd=0.01)
    rows = [0, 2, 7]
    result = determine(Grid([1, 2, 3], grid.plate_xy[rows], grid.model[rows], 150.0, initial=grid.initial))
    assert np.isnan(result.studentized).all()
    assert result.limit == np.inf
    assert not result.outliers
    assert json.loads(Run([result]).to_json())["sets"][0]["test"]["limit"] is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ids": 8}, "ids: must be a list of names, got 8"),
        ({"principal_distance": "150"}, "principal_distance: must be a number"),
        ({"principal_distance": np.nan}, "principal_distance: must be positive"),
        ({"principal_distance": None}, "principal_distance: must be a number"),
        ({"readings": np.nan}, "readings: .* whole number"),
        ({"readings": 2**64}, "readings: .* whole number"),
        ({"readings": 1.5}, "readings: .* whole number"),
        ({"plate_xy": np.ma.masked_all((8, 2))}, "plate_xy: must not have masked values"),
        ({"model": None}, "model: must be an array of numbers, got None"),
    ],
)
def test_grids_that_cannot_be(eight, change, message):
    grid = eight()
    given = {"ids": grid.ids, "plate_xy": grid.plate_xy, "model": grid.model, "principal_distance": 150.0}
    with pytest.raises(InputError, match=message):
        Grid(**{**given, **change})
