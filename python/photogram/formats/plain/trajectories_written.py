"""The tables of trajectories of a block, and of observed sums of coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.schema import (
    AXES,
    BASES,
    FACTORS,
    OPK,
    SD_AXES,
    VELOCITY,
)
from photogram.formats.plain.tables import DEGREE, angles_of, columns_of, columns_of_rows, correlations
from photogram.network.block import Block
from photogram.network.observations import Observation, Smoothness, all_trajectories
from photogram.network.observations.unknowns import smoothness_of
from photogram.network.trajectories import Basis, Polynomial, Spline, Trajectory
from photogram.words import phrase

Place = tuple[str, str, int]  # Trajectory, position or rotation, and number of a coefficient


def shared_trajectories(block: Block) -> list[Trajectory]:
    """Return trajectories of a block, except trajectories of single photos."""
    own = [each.trajectory for each in block.timed if each.trajectory is not None]
    found = all_trajectories(own, block.observations)
    names = [each.name for each in found]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(phrase("error.repeated", kind="trajectory", name=twice))
    return found


def trajectory_tables(block: Block) -> dict[str, dict[str, Any]]:
    """Return the tables of the trajectories of a block."""
    own = shared_trajectories(block)
    if not own:
        return {}
    tables = [each.table for each in own]
    columns: dict[str, Any] = {
        "trajectory": [each.name for each in own],
        "interpolation": [each.interpolation for each in tables],
        "attitude_interpolation": [each.attitude_interpolation for each in tables],
    }
    for name, usual in (("position_axes", "table"), ("angles", "vector")):
        words = [getattr(each, name) for each in own]
        columns[name] = words if set(words) != {usual} else [""] * len(own)
    coefficients: list[tuple[Trajectory, int]] = []
    for k, kind in enumerate(BASES):
        bases = [each.position if k == 0 else each.rotation for each in own]
        columns |= _basis_columns(kind, bases)
        sd = [_common_sd(each, k) for each in own]
        columns[f"sd_{kind}"] = np.array([math.nan if each is None else each for each in sd]) * _unit(kind)
        parts = zip(own, sd, bases, strict=True)
        coefficients += [(each, k) for each, common, basis in parts if common is None and basis is not None]
    found = {"trajectories": {name: each for name, each in columns.items() if not _is_empty(each)}}
    found["trajectory_positions"] = _position_records(own)
    attitudes = [(each.name, each.table.attitude_times, each.table.attitudes) for each in own]
    found["trajectory_attitudes"] = _turned_records(attitudes, block)
    if bodies := [(each.name, *each.body) for each in own if each.body is not None]:
        turned = [(name, times, np.swapaxes(matrices, 1, 2)) for name, times, matrices in bodies]
        found["body_rotations"] = _turned_records(turned, block)
    if knots := _knots(own):
        found["trajectory_knots"] = knots
    if coefficients:
        found["trajectory_coefficients"] = _coefficient_rows(coefficients)
    return found


def _unit(kind: str) -> float:
    """Return the table units per unit of coefficients."""
    return DEGREE if kind == "rotation" else 1.0


def _is_empty(column: Any) -> bool:
    if isinstance(column, np.ndarray):
        return bool(np.isnan(column).all())
    return all(each is None or each == "" for each in column)


def _basis_columns(kind: str, bases: Sequence[Basis | None]) -> dict[str, Any]:
    """Return the columns of bases; knots have a separate table."""
    words = {Polynomial: "polynomial", Spline: "spline"}
    polynomials = [each if isinstance(each, Polynomial) else None for each in bases]
    splines = [each if isinstance(each, Spline) else None for each in bases]
    found: dict[str, Any] = {
        kind: ["none" if each is None else words[type(each)] for each in bases],
        f"{kind}_degree": [None if each is None else each.degree for each in bases],
        f"{kind}_reference": [None if each is None else each.reference for each in polynomials],
        f"{kind}_scale": [None if each is None else each.scale for each in polynomials],
    }
    for what in ("smooth", "correlation"):
        pairs = [None if each is None else getattr(each, what) for each in splines]
        found[f"{kind}_{what}"] = [None if each is None else each[0] for each in pairs]
        found[f"sd_{kind}_{what}"] = [
            None if each is None else float(each[1]) * _unit(kind) for each in pairs
        ]
    return found


def _common_sd(own: Trajectory, which: int) -> float | None:
    """Return the common standard deviation of coefficients of 0, else None."""
    coefficients = own.coefficients[which]
    sd = {value for each in coefficients for value in each.deviations.tolist()}
    alike = len(sd) == 1 and not any(each.position.any() for each in coefficients)
    return sd.pop() if alike else None


def _coefficient_rows(parts: Sequence[tuple[Trajectory, int]]) -> dict[str, Any]:
    """Return the coefficient table of positions (0) or rotations (1)."""
    rows = [(own.name, which, each) for own, which in parts for each in own.coefficients[which]]
    units = np.array([_unit(BASES[which]) for _, which, _ in rows])[:, np.newaxis]
    return {
        "trajectory": [name for name, _, _ in rows],
        "of": [BASES[which] for _, which, _ in rows],
        "k": np.concatenate([np.arange(len(own.coefficients[which])) for own, which in parts]),
        **columns_of(AXES, np.array([each.position for *_, each in rows]) * units),
        **columns_of(SD_AXES, np.array([each.deviations for *_, each in rows]) * units),
    }


def _position_records(own: Sequence[Trajectory]) -> dict[str, Any]:
    tables = [each.table for each in own]
    velocities = np.vstack(
        [each.positions * np.nan if each.velocities is None else each.velocities for each in tables]
    )
    return {
        "trajectory": [each.name for each in own for _ in each.table.times],
        "time": np.concatenate([each.times for each in tables]),
        **columns_of(AXES, np.vstack([each.positions for each in tables])),
        **({} if np.isnan(velocities).all() else columns_of(VELOCITY, velocities)),
    }


def _turned_records(records: Sequence[tuple[str, Any, Any]], block: Block) -> dict[str, Any]:
    return {
        "trajectory": [name for name, times, _ in records for _ in np.asarray(times)],
        "time": np.concatenate([times for _, times, _ in records]),
        **columns_of(OPK, angles_of(np.concatenate([matrices for *_, matrices in records]), block)),
    }


def _knots(own: Sequence[Trajectory]) -> dict[str, Any]:
    rows = [
        (each.name, kind, float(knot))
        for each in own
        for kind, basis in zip(BASES, (each.position, each.rotation), strict=True)
        if isinstance(basis, Spline)
        for knot in np.asarray(basis.knots)
    ]
    return columns_of_rows(("trajectory", "of", "knot"), rows)


def smoothness_table(block: Block) -> dict[str, Any]:
    """Return the table of sums of neighbouring coefficients."""
    own = [(each, place) for each, place in _beside(block) if place is not None]
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
    numbers = columns_of((*FACTORS, *AXES, *SD_AXES), np.hstack([factors, sums, sd]))
    found |= {name: column for name, column in numbers.items() if not _is_empty(column)}
    return found | correlations(covariances, AXES)


def lost_smoothness(block: Block) -> int:
    """Return the number of sums that the table cannot contain."""
    return sum(place is None for _, place in _beside(block))


def _beside(block: Block) -> list[tuple[Smoothness, Place | None]]:
    """Return sums not defined by splines, each with its first key."""
    shared = shared_trajectories(block)
    places = {
        id(each): (trajectory.name, of, k)
        for trajectory in shared
        for of, own in zip(BASES, trajectory.coefficients, strict=True)
        for k, each in enumerate(own)
    }
    made_by_splines = {_content(each) for trajectory in shared for each in smoothness_of(trajectory)}
    own = [each for each in block.observations if isinstance(each, Smoothness)]
    return [
        (each, _first(each.coefficients, places)) for each in own if _content(each) not in made_by_splines
    ]


def _content(each: Observation) -> tuple[object, ...]:
    return (*map(id, each.unknowns), each.observed.tobytes(), each.precision.tobytes())


def _first(coefficients: Sequence[object], places: Mapping[int, Place]) -> Place | None:
    """Return the key of the first of neighbouring coefficients; None for others."""
    found = [places.get(id(each)) for each in coefficients]
    first = found[0]
    if first is None or len(found) > len(FACTORS):
        return None
    expected = [(*first[:2], first[2] + k) for k in range(len(found))]
    return first if found == expected else None
