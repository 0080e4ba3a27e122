"""Tables of trajectories: records, corrections, knots, coefficients; read and written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import by_key
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.plain.schema import AXES, BASES, FACTORS, OPK, SD_AXES, TABLES, VELOCITY
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    angles_of,
    check_complete,
    check_rows,
    columns_of,
    columns_of_records,
    correlations,
    covariances_of,
    made,
)
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.observations import Observation, Smoothness, all_trajectories
from photogram.network.observations.unknowns import smoothness_of
from photogram.network.trajectories import Basis, Polynomial, Spline, Table, Trajectory
from photogram.words import phrase

_OTHERS = (
    *("trajectory_positions", "trajectory_attitudes", "trajectory_knots", "trajectory_coefficients"),
    "body_rotations",
)
Place = tuple[str, str, int]  # Trajectory, position or rotation, and number of a coefficient
Groups = Mapping[tuple[str, ...], Indices]  # Rows of a table by subject


def read_trajectories(tables: Tables) -> dict[str, Trajectory]:
    table = tables.read("trajectories")
    if table is None:
        if there := [each for each in _OTHERS if each in tables.settings.tables]:
            path = tables.settings.tables[there[0]]
            raise InputError(phrase("error.missing", name="trajectories.csv"), file=path)
        return {}
    places, groups = tables.rows("trajectory_positions"), rows_of(tables, "trajectory_positions")
    times = increasing(places, groups)
    values = np.column_stack([places.given(AXES), places.vectors(VELOCITY)])
    check_complete(places, values[:, 3:], phrase("plain.all-or-none", columns=list(VELOCITY)))
    positions = {of: (times[rows], values[rows]) for (of,), rows in groups.items()}
    corrections = _Corrections(tables)
    attitudes = _attitudes(tables, "trajectory_attitudes")
    bodies = _attitudes(tables, "body_rotations", tables.flip)
    found: dict[str, Trajectory] = {}
    for row, cells in enumerate(tables.records("trajectories", defaults=True)):
        name = cells["trajectory"]
        for what, known in (("positions", positions), ("attitudes", attitudes)):
            if name not in known:
                raise table.error(row, phrase("plain.no-rows", name=name, table=f"trajectory_{what}"))
        times, values = positions[name]
        hermite = cells["interpolation"] == "hermite"
        if hermite and np.isnan(values).any():
            raise table.cell_error(row, "interpolation", "plain.hermite")
        velocities = values[:, 3:] if hermite else None
        kinds = cells["interpolation"], cells["attitude_interpolation"]
        own = made(table, row, Table, times, values[:, :3], *attitudes[name], velocities, *kinds)
        bases = [corrections.basis(row, cells, of, own.span) for of in BASES]
        # The matrix of a body transforms from inertial axes, an attitude in the opposite direction.
        body = (bodies[name][0], np.swapaxes(bodies[name][1], 1, 2)) if name in bodies else None
        axes = cells["position_axes"], cells["angles"]
        found[name] = made(table, row, Trajectory, name, own, *bases, body, *axes)
    return found


def rows_of(tables: Tables, name: str, *, bases: bool = False) -> Groups:
    """Return the rows of each photo or trajectory or, if `bases`, of each correction of trajectories."""
    words = [tables.column(name, column) for column in (TABLES[name].columns[0], *(["of"] if bases else []))]
    rows_by_key = by_key((key, row) for row, key in enumerate(zip(*words, strict=True)))
    return {key: np.array(rows, dtype=np.int64) for key, rows in rows_by_key.items()}


def increasing(table: ColumnTable, groups: Groups, column: str = "time", *, multiple: bool = False) -> Floats:
    """Return (rows,) times, increasing in each group (or equal if `multiple`)."""
    times = table.given((column,))[:, 0]
    for rows in groups.values():
        steps = np.diff(times[rows])
        back = steps < 0 if multiple else steps <= 0
        if back.any():
            last, row = (int(rows[int(np.argmax(back)) + k]) for k in (0, 1))
            raise table.cell_error(row, column, "plain.increase", before=times[last], value=times[row])
    return times


def _attitudes(tables: Tables, name: str, axes: Floats | None = None) -> dict[str, tuple[Floats, Floats]]:
    """Return (k,) times and (k, 3, 3) attitudes by trajectory."""
    table = tables.rows(name)
    groups = rows_of(tables, name)
    times, matrices = increasing(table, groups), tables.matrices(table)
    check_rows(table, np.isnan(matrices).any(axis=(1, 2)), phrase("plain.no-angles"))
    if axes is not None:
        matrices = matrices @ axes
    return {of: (times[rows], matrices[rows]) for (of,), rows in groups.items()}


_KINDS: Mapping[str, type[Basis]] = {"polynomial": Polynomial, "spline": Spline}
_PAIRS = ("smooth", "correlation")  # Numbers with a standard deviation
_COLUMNS = {
    "none": (),
    "polynomial": ("degree", "reference", "scale"),
    "spline": ("degree", "every", *_PAIRS),
}
"""Columns of each basis."""
_ALL = tuple(dict.fromkeys(name for names in _COLUMNS.values() for name in names))


class _Corrections:
    """Tables of the corrections of trajectories: knots and coefficients by trajectory and `of`."""

    def __init__(self, tables: Tables) -> None:
        self.tables, self.table = tables, tables.rows("trajectories")
        knots = tables.rows("trajectory_knots")
        groups = rows_of(tables, "trajectory_knots", bases=True)
        values = increasing(knots, groups, "knot", multiple=True)
        self.knots = {key: values[rows] for key, rows in groups.items()}
        self.rows = rows_of(tables, "trajectory_coefficients", bases=True)
        self.coefficients = tables.records("trajectory_coefficients", defaults=True)

    def basis(self, row: int, cells: Mapping[str, Any], of: str, span: tuple[float, float]) -> Basis | None:
        """Return the basis of positions or rotations of the trajectory of a row; None without corrections."""
        name, word = cells["trajectory"], cells[of]
        fields = {each: cells[f"{of}_{each}"] for each in _ALL if f"{of}_{each}" in cells}
        knots, rows = self.knots.get((name, of)), self.rows.get((name, of))
        others = [f"{of}_{each}" for each in fields if each not in _COLUMNS[word]]
        others += ["trajectory_knots"] if knots is not None and word != "spline" else []
        others += ["trajectory_coefficients"] if rows is not None and word == "none" else []
        if others:
            message = phrase("error.not-applicable", name=others[0], other=f"{of} {word}")
            raise self.table.error(row, message)
        if word == "none":
            return None
        for each in _PAIRS:
            column, sd = f"{of}_{each}", cells.get(f"sd_{of}_{each}")
            if (each in fields) != (sd is not None):
                raise self.table.error(row, phrase("error.together", name=column, other=f"sd_{column}"))
            fields |= {each: (fields[each], sd)} if each in fields else {}
        fields |= {} if knots is None else {"knots": knots}
        basis: Basis = made(self.table, row, lambda: _KINDS[word](**fields).over(*span))
        unit = self.tables.radians if of == "rotation" else 1.0
        default = self.tables.settings.sd.get("trajectories", (math.inf,) * 2)[BASES.index(of)]
        usual = cells.get(f"sd_{of}", default * unit)
        if rows is None:
            return replace(basis, sd=usual)
        values, deviations = np.zeros((basis.count, 3)), np.full((basis.count, 3), usual)
        axes = np.diag(self.tables.flip) if of == "rotation" and cells["angles"] != "zxz" else np.ones(3)
        seen = set[int]()
        table = self.tables.rows("trajectory_coefficients")
        for at in rows.tolist():
            own = self.coefficients[at]
            k = own["k"]
            if k not in range(basis.count):
                raise table.cell_error(at, "k", "error.whole-range", low=0, high=basis.count - 1, value=k)
            if k in seen:
                raise table.error(at, phrase("error.repeated", kind="coefficient", name=f"{k:g}"))
            seen.add(k)
            values[k] = np.array([own[axis] for axis in AXES]) * unit * axes
            deviations[k] = [own[sd] * unit if sd in own else usual for sd in SD_AXES]
        return replace(basis, value=values, sd=deviations)


def read_smoothness(tables: Tables, trajectories: Mapping[str, Trajectory]) -> list[Observation]:
    """Read sums of neighbouring coefficients."""
    table = tables.rows("smoothness")
    groups = rows_of(tables, "smoothness", bases=True)
    sd = tables.deviations(table, "smoothness", SD_AXES)
    table.check_given(sd, SD_AXES)
    observed, covariances = table.vectors(AXES, 0.0), covariances_of(sd, table)
    factors, first = table.vectors(FACTORS), table.numbers("k")
    found: dict[int, Observation] = {}
    for (name, of), rows in groups.items():
        own = trajectories[name].coefficients[BASES.index(of)]
        # Rotations are about photo axes, in the unit of angles.
        turn = tables.flip * tables.radians if of == "rotation" else np.eye(3)
        for row in rows.tolist():
            given = factors[row][~np.isnan(factors[row])]
            if np.isnan(factors[row][: len(given)]).any():
                raise table.error(row, phrase("plain.factors", columns=list(FACTORS)))
            if first[row] not in range(len(own) - len(given) + 1):
                raise table.cell_error(row, "k", "plain.no-coefficients", kind=of, name=name)
            k = int(first[row])
            precision = turn @ covariances[row] @ turn.T
            more = {"covariance": (precision + precision.T) / 2}
            terms = own[k : k + len(given)], given, turn @ observed[row]
            found[row] = made(table, row, Smoothness, *terms, **more)
    return [found[row] for row in sorted(found)]


def shared_trajectories(block: Block) -> list[Trajectory]:
    own = [each.trajectory for each in block.timed if each.trajectory is not None]
    found = all_trajectories(own, block.observations)
    names = [each.name for each in found]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(phrase("error.repeated", kind="trajectory", name=twice))
    return found


def trajectory_tables(block: Block) -> dict[str, dict[str, Any]]:
    own = shared_trajectories(block)
    if not own:
        return {}
    tables = [each.table for each in own]
    velocities = np.vstack(
        [each.positions * np.nan if each.velocities is None else each.velocities for each in tables]
    )
    bodies = [(each.name, each.body[0], np.swapaxes(each.body[1], 1, 2)) for each in own if each.body]
    bases = [
        (each, kind, basis)
        for each in own
        for kind, basis in zip(BASES, (each.position, each.rotation), strict=True)
        if basis is not None
    ]
    found = {
        "trajectories": columns_of_records(map(_cells, own)),
        "trajectory_positions": _dated([(each.name, each.table.times) for each in own])
        | columns_of(AXES, np.vstack([each.positions for each in tables]))
        | ({} if np.isnan(velocities).all() else columns_of(VELOCITY, velocities)),
        "trajectory_attitudes": _turns_written(
            [(each.name, each.table.attitude_times, each.table.attitudes) for each in own], block
        ),
        "body_rotations": _turns_written(bodies, block) if bodies else {},
        "trajectory_knots": columns_of_records(
            {"trajectory": each.name, "of": kind, "knot": float(knot)}
            for each, kind, basis in bases
            if isinstance(basis, Spline)
            for knot in np.asarray(basis.knots)
        ),
        "trajectory_coefficients": columns_of_records(
            {"trajectory": each.name, "of": kind, "k": k}
            | columns_of(AXES, one.position * _unit(kind))
            | columns_of(SD_AXES, one.deviations * _unit(kind))
            for each, kind, _ in bases
            if _common_sd(each, BASES.index(kind)) is None
            for k, one in enumerate(each.coefficients[BASES.index(kind)])
        ),
    }
    return {name: columns for name, columns in found.items() if columns}


def _unit(kind: str) -> float:
    """Return the table units per unit of coefficients."""
    return DEGREE if kind == "rotation" else 1.0


def _cells(own: Trajectory) -> dict[str, Any]:
    found: dict[str, Any] = {
        "trajectory": own.name,
        "interpolation": own.table.interpolation,
        "attitude_interpolation": own.table.attitude_interpolation,
        "position_axes": "" if own.position_axes == "table" else own.position_axes,
        "angles": "" if own.angles == "vector" else own.angles,
    }
    for k, (kind, basis) in enumerate(zip(BASES, (own.position, own.rotation), strict=True)):
        words = {Polynomial: "polynomial", Spline: "spline"}
        cells: dict[str, Any] = {"": "none" if basis is None else words[type(basis)]}
        cells |= {f"_{name}": getattr(basis, name, None) for name in _ALL[:3]}
        found |= {f"{kind}{name}": cell for name, cell in cells.items()}
        for name in _ALL[4:]:
            if (pair := getattr(basis, name, None)) is not None:
                found |= {f"{kind}_{name}": pair[0], f"sd_{kind}_{name}": float(pair[1]) * _unit(kind)}
        if (sd := _common_sd(own, k)) is not None:
            found[f"sd_{kind}"] = sd * _unit(kind)
    return found


def _common_sd(own: Trajectory, which: int) -> float | None:
    """Return the common standard deviation of coefficients of 0, else None."""
    coefficients = own.coefficients[which]
    sd = {value for each in coefficients for value in each.deviations.tolist()}
    alike = len(sd) == 1 and not any(each.position.any() for each in coefficients)
    return sd.pop() if alike else None


def _dated(parts: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    names = [name for name, times in parts for _ in np.asarray(times)]
    return {"trajectory": names, "time": np.concatenate([times for _, times in parts])}


def _turns_written(parts: Sequence[tuple[str, Any, Any]], block: Block) -> dict[str, Any]:
    angles = angles_of(np.concatenate([matrices for *_, matrices in parts]), block)
    return _dated([part[:2] for part in parts]) | columns_of(OPK, angles)


def smoothness_table(block: Block) -> dict[str, Any]:
    own = [(each, place) for each, place in smoothness_beside(block) if place is not None]
    if not own:
        return {}
    units = np.array([_unit(place[1]) for _, place in own])[:, np.newaxis]
    covariances = np.array([each.precision for each, _ in own]) * units[:, :, np.newaxis] ** 2
    sums = np.array([each.observed[:3] for each, _ in own]) * units
    sd = np.sqrt(np.einsum("nii->ni", covariances))
    rows = (
        dict(zip(("trajectory", "of", "k"), place, strict=True))
        | dict(zip(FACTORS, np.asarray(each.factors), strict=False))
        | columns_of((*AXES, *SD_AXES), np.concatenate(numbers))
        for (each, place), *numbers in zip(own, sums, sd, strict=True)
    )
    return columns_of_records(rows) | correlations(covariances, AXES)


def smoothness_beside(block: Block) -> list[tuple[Smoothness, Place | None]]:
    """Return sums not defined by splines, each with its first key; None if the table cannot contain it."""
    shared = shared_trajectories(block)
    places = {
        id(each): (trajectory.name, of, k)
        for trajectory in shared
        for of, own in zip(BASES, trajectory.coefficients, strict=True)
        for k, each in enumerate(own)
    }
    made_by_splines = {_content(each) for trajectory in shared for each in smoothness_of(trajectory)}
    found: list[tuple[Smoothness, Place | None]] = []
    for each in block.observations.of_type(Smoothness):
        if _content(each) in made_by_splines:
            continue
        keys = [places.get(id(one)) for one in each.coefficients]
        first = keys[0]
        expected = [] if first is None else [(*first[:2], first[2] + k) for k in range(len(keys))]
        found.append((each, first if keys == expected and len(keys) <= len(FACTORS) else None))
    return found


def _content(each: Observation) -> tuple[object, ...]:
    return (*map(id, each.unknowns), each.observed.tobytes(), each.precision.tobytes())
