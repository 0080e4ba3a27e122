"""The table of sums of coefficients that were observed, beside what splines say themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.plain.common_unknowns import made
from photogram.formats.plain.schema import AXES, BASES, FACTORS, deviation_columns
from photogram.formats.plain.tables import DEGREE, Tables, correlations, covariances_of
from photogram.formats.plain.trajectories import trajectory_rows
from photogram.formats.plain.trajectories_written import shared_trajectories
from photogram.network.block import Block
from photogram.network.observations import Observation, Smoothness
from photogram.network.observations.unknowns import smoothness_of
from photogram.network.trajectories import Trajectory

__all__ = ["lost_smoothness", "read_smoothness", "smoothness_table"]

_SD = deviation_columns(AXES)


def read_smoothness(tables: Tables, trajectories: Mapping[str, Trajectory]) -> list[Observation]:
    """Read sums of neighbouring coefficients.

    Raises
    ------
    InputError
        Trajectories and coefficients that are not there, standard deviations that give no weight.
    """
    table = tables.read("smoothness")
    if table is None:
        return []
    groups = trajectory_rows(table, {name: row for row, name in enumerate(trajectories)}, bases=True)
    sd = tables.deviations(table, "smoothness", _SD)
    table.check_given(sd, _SD)
    observed, covariances = table.vectors(AXES, 0.0), covariances_of(sd, table)
    factors, first = table.vectors(FACTORS), table.numbers("k")
    found: dict[int, Observation] = {}
    for (name, of), rows in groups.items():
        own = trajectories[name].coefficients[BASES.index(of)]
        # Rotations are about the axes of photos, in the unit of angles.
        turn = tables.flip * tables.radians if of == "rotation" else np.eye(3)
        for row in rows.tolist():
            given = factors[row][~np.isnan(factors[row])]
            if np.isnan(factors[row][: len(given)]).any():
                raise table.error(row, f"{', '.join(FACTORS)}: there is one behind an empty cell")
            if first[row] not in range(len(own) - len(given) + 1):
                raise table.error(row, f"column k: the {of} of {name} has no such coefficients")
            k = int(first[row])
            own_sum, precision = turn @ observed[row], turn @ covariances[row] @ turn.T
            make = partial(
                Smoothness, own[k : k + len(given)], given, own_sum, covariance=(precision + precision.T) / 2
            )
            found[row] = made(table, row, make)
    return [found[row] for row in sorted(found)]


def smoothness_table(block: Block) -> dict[str, Any]:
    """Return the table of sums of neighbouring coefficients; none where splines say all themselves."""
    places = _places(block)
    own = [(each, place) for each, place in _beside(block, places) if place is not None]
    if not own:
        return {}
    units = np.array([DEGREE if place[1] == "rotation" else 1.0 for _, place in own])[:, np.newaxis]
    factors = np.full((len(own), len(FACTORS)), np.nan)
    for row, (each, _) in enumerate(own):
        factors[row, : len(each.coefficients)] = each.factors
    sums = np.array([each.observed[:3] for each, _ in own]) * units
    covariances = np.array([each.precision for each, _ in own]) * units[:, :, np.newaxis] ** 2
    sd: Floats = np.sqrt(np.einsum("nii->ni", covariances))
    found: dict[str, Any] = {
        name: [place[k] for _, place in own] for k, name in enumerate(("trajectory", "of", "k"))
    }
    for names, values in ((FACTORS, factors), (AXES, sums), (_SD, sd)):
        found |= {
            name: column for name, column in zip(names, values.T, strict=True) if not np.isnan(column).all()
        }
    return found | correlations(covariances, AXES)


def lost_smoothness(block: Block) -> int:
    """Return how many sums of coefficients the table has no place for: not of neighbours, or of too many."""
    return sum(place is None for _, place in _beside(block, _places(block)))


Place = tuple[str, str, int]
"""Trajectory, position or rotation, and the number of a coefficient."""


def _places(block: Block) -> dict[int, Place]:
    """Return where coefficients are, by their identity."""
    return {
        id(each): (trajectory.name, of, k)
        for trajectory in shared_trajectories(block)
        for of, own in zip(BASES, trajectory.coefficients, strict=True)
        for k, each in enumerate(own)
    }


def _beside(block: Block, places: Mapping[int, Place]) -> list[tuple[Smoothness, Place | None]]:
    """Return sums that no spline says itself, each with the place of its first coefficient, if it has one."""
    made_by_splines = {
        _content(each) for trajectory in shared_trajectories(block) for each in smoothness_of(trajectory)
    }
    own = [each for each in block.observations if isinstance(each, Smoothness)]
    return [
        (each, _first(each.coefficients, places)) for each in own if _content(each) not in made_by_splines
    ]


def _content(each: Observation) -> tuple[object, ...]:
    return (*map(id, each.unknowns), each.observed.tobytes(), each.precision.tobytes())


def _first(coefficients: Sequence[object], places: Mapping[int, Place]) -> Place | None:
    """Return the place of the first of neighbours; None of others."""
    found = [places.get(id(each)) for each in coefficients]
    first = found[0]
    if first is None or len(found) > len(FACTORS):
        return None
    expected = [(*first[:2], first[2] + k) for k in range(len(found))]
    return first if found == expected else None
