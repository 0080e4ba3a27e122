"""Tables of trajectories: records, corrections, knots, coefficients; read and written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.plain.schema import AXES, BASES, FACTORS, OPK, SD_AXES, VELOCITY
from photogram.formats.plain.tables import (
    DEGREE,
    Tables,
    angles_of,
    check_complete,
    columns_of,
    columns_of_records,
    correlations,
    covariances_of,
    indices_of,
    made,
)
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.observations import Observation, Smoothness, all_trajectories
from photogram.network.observations.unknowns import smoothness_of
from photogram.network.trajectories import (
    Basis,
    Polynomial,
    Spline,
    Table,
    Trajectory,
)
from photogram.words import phrase

_OTHERS = (
    *("trajectory_positions", "trajectory_attitudes", "trajectory_knots", "trajectory_coefficients"),
    "body_rotations",
)
Place = tuple[str, str, int]  # Trajectory, position or rotation, and number of a coefficient
Groups = Mapping[tuple[str, ...], Indices]  # Rows of a table by subject


def read_trajectories(tables: Tables) -> dict[str, Trajectory]:
    """Read trajectories by name."""
    table = tables.read("trajectories")
    if table is None:
        if there := [each for each in _OTHERS if each in tables.settings.tables]:
            path = tables.settings.tables[there[0]]
            raise InputError(phrase("error.missing", name="trajectories.csv"), file=path)
        return {}
    names = table.names_once("trajectory")
    places = {name: row for row, name in enumerate(names)}
    records = _records(tables, table, places)
    bases = [_Bases(tables, table, of, places) for of in BASES]
    bodies = _turned(tables, "body_rotations", places, tables.flip)
    along = tables.words("trajectories", "position_axes")
    angles = tables.words("trajectories", "angles")
    found: dict[str, Trajectory] = {}
    for row, name in enumerate(names):
        own = records[row]
        position, rotation = (each.of(row, name, own) for each in bases)
        body = bodies.get(name)
        if body is not None:
            # The matrix of a body transforms from inertial axes, an attitude in the opposite direction.
            body = body[0], np.swapaxes(body[1], 1, 2)
        values = own, position, rotation, body, along[row], angles[row]
        found[name] = made(table, row, Trajectory, name, *values)
    return found


def rows_of(table: ColumnTable, column: str, places: Mapping[str, int], *, bases: bool = False) -> Groups:
    """Return the rows of each photo or trajectory or, if `bases`, of each correction of trajectories."""
    indices_of(table, column, places, column)
    words: Sequence[Sequence[str]] = [table.texts(column)]
    if bases:
        words = [*words, table.words("of", BASES, "")]
    found: dict[tuple[str, ...], list[int]] = {}
    for row, key in enumerate(zip(*words, strict=True)):
        found.setdefault(key, []).append(row)
    return {key: np.array(rows, dtype=np.int64) for key, rows in found.items()}


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


def _turned(
    tables: Tables, name: str, places: Mapping[str, int], flip: Floats | None = None
) -> dict[str, tuple[Floats, Floats]]:
    """Return (k,) times and (k, 3, 3) attitudes by trajectory."""
    table = tables.rows(name)
    groups = rows_of(table, "trajectory", places)
    times, matrices = increasing(table, groups), tables.matrices(table)
    tables.check_known(table, matrices)
    if flip is not None:
        matrices = matrices @ flip
    return {of: (times[rows], matrices[rows]) for (of,), rows in groups.items()}


def _records(tables: Tables, table: ColumnTable, places: Mapping[str, int]) -> list[Table]:
    """Return the sampled trajectory of each row."""
    own = tables.rows("trajectory_positions")
    groups = rows_of(own, "trajectory", places)
    times, values = increasing(own, groups), np.column_stack([own.given(AXES), own.vectors(VELOCITY)])
    check_complete(own, values[:, 3:], phrase("plain.all-or-none", columns=list(VELOCITY)))
    positions = {of: (times[rows], values[rows]) for (of,), rows in groups.items()}
    attitudes = _turned(tables, "trajectory_attitudes", places)
    kinds = [tables.words("trajectories", f"{of}interpolation") for of in ("", "attitude_")]
    found = []
    for name, row in places.items():
        for what, known in (("positions", positions), ("attitudes", attitudes)):
            if name not in known:
                raise table.error(row, phrase("plain.no-rows", name=name, table=f"trajectory_{what}"))
        times, values = positions[name]
        hermite = kinds[0][row] == "hermite"
        if hermite and np.isnan(values).any():
            raise table.cell_error(row, "interpolation", "plain.hermite")
        velocities = values[:, 3:] if hermite else None
        given = times, values[:, :3], *attitudes[name], velocities, kinds[0][row], kinds[1][row]
        found.append(made(table, row, Table, *given))
    return found


_COLUMNS = {
    "none": (),
    "polynomial": ("degree", "reference", "scale"),
    "spline": ("degree", "every", "smooth", "correlation"),
}
"""Columns of each basis."""
_ALL = tuple(dict.fromkeys(name for names in _COLUMNS.values() for name in names))


class _Bases:
    """Bases of position or rotation corrections (`kind`) by trajectory."""

    def __init__(self, tables: Tables, table: ColumnTable, kind: str, places: Mapping[str, int]) -> None:
        self.table, self.kind = table, kind
        self.unit = tables.radians if kind == "rotation" else 1.0
        self.cells = tables.records("trajectories")
        default = tables.settings.sd.get("trajectories", (math.inf,) * 2)[BASES.index(kind)]
        self.sd = table.numbers(f"sd_{kind}", default, infinite=True) * self.unit
        if (negative := self.sd < 0).any():
            row = int(np.argmax(negative))
            raise table.cell_error(row, f"sd_{kind}", "error.not-negative", value=float(self.sd[row]))
        own = tables.rows("trajectory_knots")
        groups = rows_of(own, "trajectory", places, bases=True)
        values = increasing(own, groups, "knot", multiple=True)
        self.knots = {name: values[rows] for (name, of), rows in groups.items() if of == kind}
        self.coefficients = tables.rows("trajectory_coefficients")
        self.rows = rows_of(self.coefficients, "trajectory", places, bases=True)
        self.words = tables.words("trajectories", kind)
        self.signs = np.ones((table.count, 3))  # Direction of the axes of coefficients
        if kind == "rotation":
            about_photo = [each != "zxz" for each in tables.words("trajectories", "angles")]
            self.signs[about_photo] = np.diag(tables.flip)

    def of(self, row: int, name: str, known: Table) -> Basis | None:
        """Return the basis of the trajectory of a row; None without corrections."""
        word = self.words[row]
        rows = self.rows.get((name, self.kind))
        self._check(row, name, word, rows)
        if word == "none":
            return None
        sd = float(self.sd[row])
        basis = made(self.table, row, lambda: self._basis(row, name, word).over(*known.span))
        if rows is None:
            return replace(basis, sd=sd)
        values, deviations = self._coefficients(rows, basis.count, sd)
        values = values * self.signs[row]
        return replace(basis, value=values, sd=deviations)

    def _check(self, row: int, name: str, word: str, rows: Indices | None) -> None:
        """Reject columns of other bases."""
        kind = self.kind
        there = [f"{kind}_{each}" for each in _ALL if self._number(row, each) is not None]
        others = [each for each in there if each.removeprefix(f"{kind}_") not in _COLUMNS[word]]
        others += ["trajectory_knots"] if name in self.knots and word != "spline" else []
        others += ["trajectory_coefficients"] if rows is not None and word == "none" else []
        if others:
            other = f"{kind} {word}"
            raise self.table.error(row, phrase("error.not-applicable", name=others[0], other=other))

    def _basis(self, row: int, name: str, word: str) -> Basis:
        degree = self._whole(row, "degree")
        if word == "polynomial":
            return Polynomial(degree or 0, self._number(row, "reference"), self._number(row, "scale"))
        found = Spline(self._number(row, "every"), self.knots.get(name))
        smooth = self._pair(row, "smooth")
        return replace(
            found,
            degree=found.degree if degree is None else degree,
            smooth=None if smooth is None else (self._whole(row, "smooth") or 0, smooth[1]),
            correlation=self._pair(row, "correlation"),
        )

    def _number(self, row: int, what: str) -> float | None:
        return self.cells[row].get(f"{self.kind}_{what}")

    def _whole(self, row: int, what: str) -> int | None:
        value = self._number(row, what)
        if value is not None and value != int(value):
            raise self.table.cell_error(row, f"{self.kind}_{what}", "error.whole", value=value)
        return None if value is None else int(value)

    def _pair(self, row: int, what: str) -> tuple[float, float] | None:
        """Return a number and its standard deviation; None without both."""
        column = f"{self.kind}_{what}"
        value, sd = self.cells[row].get(column), self.cells[row].get(f"sd_{column}")
        if value is None or sd is None:
            if value is not None or sd is not None:
                raise self.table.error(row, phrase("error.together", name=column, other=f"sd_{column}"))
            return None
        return value, sd * self.unit

    def _coefficients(self, rows: Indices, count: int, sd: float) -> tuple[Floats, Floats]:
        """Return (K, 3) coefficients and standard deviations, with defaults."""
        table = self.coefficients
        values, deviations = np.zeros((count, 3)), np.full((count, 3), sd)
        numbers = table.numbers("k")[rows]
        given, own = table.vectors(AXES, 0.0)[rows], table.vectors(SD_AXES, infinite=True)[rows]
        seen: set[int] = set()
        for row, number, value, each in zip(rows.tolist(), numbers.tolist(), given, own, strict=True):
            if number not in range(count):
                raise table.cell_error(row, "k", "error.whole-range", low=0, high=count - 1, value=number)
            if number in seen:
                raise table.error(row, phrase("error.repeated", kind="coefficient", name=f"{number:g}"))
            if (each < 0).any():
                k = int(np.argmax(each < 0))
                raise table.cell_error(row, SD_AXES[k], "error.not-negative", value=float(each[k]))
            seen.add(number)
            values[int(number)] = value * self.unit
            deviations[int(number)] = np.where(np.isnan(each), sd, each * self.unit)
        return values, deviations


def read_smoothness(tables: Tables, trajectories: Mapping[str, Trajectory]) -> list[Observation]:
    """Read sums of neighbouring coefficients."""
    table = tables.rows("smoothness")
    groups = rows_of(table, "trajectory", {name: row for row, name in enumerate(trajectories)}, bases=True)
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
    """Return the row of a trajectory."""
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
    """Return the columns of names and times."""
    names = [name for name, times in parts for _ in np.asarray(times)]
    return {"trajectory": names, "time": np.concatenate([times for _, times in parts])}


def _turns_written(parts: Sequence[tuple[str, Any, Any]], block: Block) -> dict[str, Any]:
    angles = angles_of(np.concatenate([matrices for *_, matrices in parts]), block)
    return _dated([part[:2] for part in parts]) | columns_of(OPK, angles)


def smoothness_table(block: Block) -> dict[str, Any]:
    """Return the table of sums of neighbouring coefficients."""
    own = [(each, place) for each, place in _beside(block) if place is not None]
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
