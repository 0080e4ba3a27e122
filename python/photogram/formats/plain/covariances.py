"""The table of covariances: joint priors of cameras, lever arms, sensors ..."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import is_covariance
from photogram.arguments.types import Floats
from photogram.formats.plain.rigs import Rigs
from photogram.formats.plain.tables import DEGREE, Tables, columns_of_records, made, signs_in_files, word_of
from photogram.io.column_table import ColumnTable
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import unknown_name
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.knots import Knot
from photogram.network.observations import Observation, Prior
from photogram.network.trajectories import GyroBias, RotationCoefficient
from photogram.network.unknowns import Boresight, Drift, LeverArm, Sensor, Shift, Unknown
from photogram.words import phrase

CAMERA = "camera"
OF_FILMS = ("scanner", "fiducials", "film")
"""Types of objects whose readers request covariances by name."""
_WITH_PHOTOS = {each.KIND for each in (LeverArm, Boresight, Sensor, GyroBias, RotationCoefficient)}
"""Unknowns along, or about, the axes of photos or of bodies."""


@dataclass
class _Matrix:
    """The covariances of one object: its rows, and numbers by pairs of components."""

    rows: list[int] = field(default_factory=list)
    values: dict[tuple[str, str], float] = field(default_factory=dict)

    def over(self, components: Sequence[str], units: Mapping[str, float]) -> Floats:
        """Return the matrix; missing covariances are 0."""
        found = np.zeros((len(components),) * 2)
        for (first, second), value in self.values.items():
            i, j = components.index(first), components.index(second)
            found[i, j] = found[j, i] = units[first] * units[second] * value
        return found


@dataclass(frozen=True)
class Covariances:
    """The table, by type and name of the object."""

    tables: Tables
    table: ColumnTable
    matrices: Mapping[tuple[str, str], _Matrix]

    def cameras(self, cameras: Sequence[Camera]) -> list[Camera]:
        """Return cameras with their covariances."""
        own = {name: each for (kind, name), each in self.matrices.items() if kind == CAMERA}
        if not own:
            return list(cameras)
        known = {each.name for each in cameras}
        for name, matrix in own.items():
            if name not in known:
                raise self.table.unknown_error(matrix.rows[0], "name", "camera", name, known)
        return [self._camera(each, own[each.name]) if each.name in own else each for each in cameras]

    def _camera(self, camera: Camera, matrix: _Matrix) -> Camera:
        table = self.table
        by_word = {name.lower(): name for name in camera.names}
        spelled = _Matrix(matrix.rows)
        for row, ((first, second), value) in zip(matrix.rows, matrix.values.items(), strict=True):
            for word in (first, second):
                if word not in by_word:
                    raise table.error(
                        row, unknown_name(f"parameter of the camera {camera.name}", word, by_word)
                    )
            spelled.values[by_word[first], by_word[second]] = value
        names = [name for name in camera.names if any(name in pair for pair in spelled.values)]
        scale = 1e-3 if self.tables.settings.image == "um" else 1.0
        signs = signs_in_files(names).tolist()
        units = {name: sign * scale ** camera.powers[name] for name, sign in zip(names, signs, strict=True)}
        found = spelled.over(names, units)
        # Parameters without standard deviation are fixed, except those in the matrix.
        sd = {
            name: own
            for name, own in zip(camera.names, camera.deviations.tolist(), strict=True)
            if own or name not in names
        }
        return made(table, matrix.rows[0], lambda: camera.replace(sd=sd, covariance=(names, found)))

    def names(self, kind: str, name: str) -> set[str]:
        """Return the component names in the matrix of an object."""
        own = self.matrices.get((kind, name), _Matrix())
        return {word for pair in own.values for word in pair}

    def over(
        self, kind: str, name: str, components: Sequence[str], *, singular: bool = False
    ) -> Floats | None:
        """Return the matrix of films, scanners or marks; None if missing.

        If `singular` is True, the matrix may be singular.
        """
        own = self.matrices.get((kind, name))
        if own is None:
            return None
        words = self.names(kind, name)
        if strange := sorted(words - set(components)):
            message = unknown_name(f"component of {kind} {name}", strange[0], components)
            raise self.table.error(own.rows[0], message)
        if missing := [word for word in components if (word, word) not in own.values]:
            message = phrase("plain.no-covariance", kind=kind, name=name, component=missing[0])
            raise self.table.error(own.rows[0], message)
        found = own.over(components, dict.fromkeys(components, 1.0))
        if not is_covariance(found, singular=singular):
            raise self.table.error(own.rows[0], phrase("error.covariance-singular"))
        return found

    def priors(self, unknowns: Iterable[Unknown]) -> list[Observation]:
        """Return the joint priors of unknowns as observations."""
        known = {(each.KIND, each.name): each for each in unknowns}
        found: list[Observation] = []
        for (kind, name), matrix in self.matrices.items():
            if kind in (CAMERA, *OF_FILMS):
                continue
            table = self.table
            if (kind, name) not in known:
                raise table.error(matrix.rows[0], unknown_name(kind, name, [title for _, title in known]))
            unknown = known[kind, name]
            for row, pair in zip(matrix.rows, matrix.values, strict=True):
                for word in pair:
                    if word not in unknown.components:
                        raise table.error(row, unknown_name(f"component of {kind}", word, unknown.components))
            units = _units(unknown, self.tables.radians, np.diag(self.tables.flip).tolist())
            covariance = matrix.over(unknown.components, units)
            found.append(made(table, matrix.rows[0], Prior, unknown, covariance=covariance))
        return found


def read_covariances(tables: Tables) -> Covariances:
    """Read the table of covariances; empty if it does not exist."""
    table, matrices = tables.rows("covariances"), dict[tuple[str, str], _Matrix]()
    values = table.given(("covariance",))[:, 0]
    kinds = [text.lower().replace("_", " ") for text in table.texts("kind")]
    columns = (table.texts("name"), table.texts("first"), table.texts("second"))
    for row, (kind, name, *pair) in enumerate(zip(kinds, *columns, strict=True)):
        # Parameters of cameras have the names of their columns, components of others are words.
        first, second = (word.lower() if kind == CAMERA else word.lower().replace("_", " ") for word in pair)
        matrix = matrices.setdefault((kind, name), _Matrix())
        if (first, second) in matrix.values or (second, first) in matrix.values:
            raise table.error(row, phrase("plain.covariance-twice", first=first, second=second))
        matrix.rows.append(row)
        matrix.values[first, second] = float(values[row])
    return Covariances(tables, table, matrices)


def covariance_tables(
    block: Block,
    cameras: Sequence[Camera],
    rigs: Rigs,
    more: Iterable[tuple[str, str, Sequence[str], Floats]],
) -> dict[str, dict[str, Any]]:
    """Return the table of joint priors of cameras, of unknowns, and of `more`.

    `more` contains type, name, components and covariance matrix.
    """
    rows: list[tuple[str, str, str, str, float]] = []
    for each in cameras:
        if each.covariance is not None:
            names, matrix = each.covariance
            signs = signs_in_files(names)
            rows += _pairs(CAMERA, each.name, names, np.asarray(matrix) * signs * signs[:, np.newaxis])
    for prior in (each for each in block.observations if isinstance(each, Prior)):
        unknown = prior.unknown
        if isinstance(unknown, Knot):
            continue  # In the table of knots
        units = np.array(list(_units(unknown, DEGREE).values()))
        matrix = prior.precision * units * units[:, np.newaxis]
        rows += _pairs(unknown.KIND, _name(unknown, rigs), unknown.components, matrix)
    for kind, name, components, matrix in more:
        rows += _pairs(kind, name, components, matrix)
    names = ("kind", "name", "first", "second", "covariance")
    return {"covariances": columns_of_records(dict(zip(names, row, strict=True)) for row in rows)}


def _units(unknown: Unknown, angle: float, signs: Sequence[float] = (1.0,) * 3) -> dict[str, float]:
    """Return unit and sign factors of the components of an unknown.

    Signs are the signs of photo and body axes in tables.
    """
    pairs = zip(unknown.components, unknown.units(""), strict=True)
    axes = dict(zip("xyz", signs, strict=True)) if unknown.KIND in _WITH_PHOTOS else {}
    return {name: (angle if unit == "rad" else 1.0) * axes.get(name[-1], 1.0) for name, unit in pairs}


def _name(unknown: Unknown, rigs: Rigs) -> str:
    if isinstance(unknown, Sensor):
        return rigs.title(unknown)
    return word_of(unknown) if isinstance(unknown, Shift | Drift | GyroBias) else unknown.name


def _pairs(
    kind: str, name: str, components: Sequence[str], matrix: Floats
) -> list[tuple[str, str, str, str, float]]:
    return [
        (kind, name, components[i], components[j], float(matrix[i, j]))
        for i in range(len(components))
        for j in range(i + 1)
        if i == j or matrix[i, j]
    ]
