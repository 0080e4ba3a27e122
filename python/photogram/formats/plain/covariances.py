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
from photogram.lazy_dataclasses import dataclass
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


@dataclass(frozen=True)
class Covariances:
    """The table: rows, pairs of components and numbers by type and name of the object."""

    tables: Tables
    table: ColumnTable
    parts: Mapping[tuple[str, str], list[tuple[int, str, str, float]]]

    def names(self, kind: str, name: str) -> set[str]:
        """Return the component names in the matrix of an object."""
        return {word for _, *pair, _ in self.parts.get((kind, name), ()) for word in pair}

    def _matrix(self, kind: str, name: str, units: Mapping[str, float], what: str) -> Floats:
        """Return the matrix over the components that have units; missing covariances are 0."""
        places, found = {word: k for k, word in enumerate(units)}, np.zeros((len(units),) * 2)
        for row, first, second, value in self.parts[kind, name]:
            for word in (first, second):
                if word not in units:
                    raise self.table.error(row, unknown_name(what, word, units))
            i, j = places[first], places[second]
            found[i, j] = found[j, i] = units[first] * units[second] * value
        return found

    def cameras(self, cameras: Sequence[Camera]) -> list[Camera]:
        """Return cameras with their covariances."""
        known = {each.name for each in cameras}
        for (kind, name), own in self.parts.items():
            if kind == CAMERA and name not in known:
                raise self.table.unknown_error(own[0][0], "name", "camera", name, known)
        return [self._camera(each) if (CAMERA, each.name) in self.parts else each for each in cameras]

    def _camera(self, camera: Camera) -> Camera:
        scale = 1e-3 if self.tables.settings.image == "um" else 1.0
        signs = signs_in_files(camera.names).tolist()
        units = {
            name.lower(): sign * scale ** camera.powers[name]
            for name, sign in zip(camera.names, signs, strict=True)
        }
        whole = self._matrix(CAMERA, camera.name, units, f"parameter of the camera {camera.name}")
        words = self.names(CAMERA, camera.name)
        there = [row for row, name in enumerate(camera.names) if name.lower() in words]
        names = [camera.names[row] for row in there]
        # Parameters without standard deviation are fixed, except those in the matrix.
        sd = {
            name: own
            for name, own in zip(camera.names, camera.deviations.tolist(), strict=True)
            if own or name not in names
        }
        given = names, whole[np.ix_(there, there)]
        first = self.parts[CAMERA, camera.name][0][0]
        return made(self.table, first, lambda: camera.replace(sd=sd, covariance=given))

    def over(
        self, kind: str, name: str, components: Sequence[str], *, singular: bool = False
    ) -> Floats | None:
        """Return the matrix of films, scanners or marks; None if missing.

        If `singular` is True, the matrix may be singular.
        """
        own = self.parts.get((kind, name))
        if own is None:
            return None
        found = self._matrix(kind, name, dict.fromkeys(components, 1.0), f"component of {kind} {name}")
        variances = {first for _, first, second, _ in own if first == second}
        if missing := [word for word in components if word not in variances]:
            message = phrase("plain.no-covariance", kind=kind, name=name, component=missing[0])
            raise self.table.error(own[0][0], message)
        if not is_covariance(found, singular=singular):
            raise self.table.error(own[0][0], phrase("error.covariance-singular"))
        return found

    def priors(self, unknowns: Iterable[Unknown]) -> list[Observation]:
        """Return the joint priors of unknowns as observations."""
        known = {(each.KIND, each.name): each for each in unknowns}
        found: list[Observation] = []
        for (kind, name), own in self.parts.items():
            if kind in (CAMERA, *OF_FILMS):
                continue
            if (kind, name) not in known:
                raise self.table.error(own[0][0], unknown_name(kind, name, [title for _, title in known]))
            units = _units(known[kind, name], self.tables.radians, np.diag(self.tables.flip).tolist())
            covariance = self._matrix(kind, name, units, f"component of {kind}")
            found.append(made(self.table, own[0][0], Prior, known[kind, name], covariance=covariance))
        return found


def read_covariances(tables: Tables) -> Covariances:
    """Read the table of covariances; empty if it does not exist."""
    table, parts = tables.rows("covariances"), dict[tuple[str, str], list[tuple[int, str, str, float]]]()
    seen = set[tuple[str, ...]]()
    for row, cells in enumerate(tables.records("covariances")):
        kind, name = cells["kind"].lower().replace("_", " "), cells["name"]
        # Parameters of cameras have the names of their columns, components of others are words.
        first, second = (
            cells[word].lower() if kind == CAMERA else cells[word].lower().replace("_", " ")
            for word in ("first", "second")
        )
        if (kind, name, first, second) in seen:
            raise table.error(row, phrase("plain.covariance-twice", first=first, second=second))
        seen |= {(kind, name, first, second), (kind, name, second, first)}
        parts.setdefault((kind, name), []).append((row, first, second, cells["covariance"]))
    return Covariances(tables, table, parts)


def covariance_tables(
    block: Block,
    cameras: Sequence[Camera],
    rigs: Rigs,
    more: Iterable[tuple[str, str, Sequence[str], Floats]],
) -> dict[str, dict[str, Any]]:
    """Return the table of joint priors of cameras, of unknowns, and of `more`.

    `more` contains type, name, components and covariance matrix.
    """
    joined: list[tuple[str, str, Sequence[str], Floats]] = []
    for each in cameras:
        if each.covariance is not None:
            names, matrix = each.covariance
            signs = signs_in_files(names)
            joined.append((CAMERA, each.name, names, np.asarray(matrix) * signs * signs[:, np.newaxis]))
    for prior in block.observations.of_type(Prior):
        unknown = prior.unknown
        if isinstance(unknown, Knot):
            continue  # In the table of knots
        units = np.array(list(_units(unknown, DEGREE).values()))
        title = rigs.title(unknown) if isinstance(unknown, Sensor) else unknown.name
        title = word_of(unknown) if isinstance(unknown, Shift | Drift | GyroBias) else title
        matrix = prior.precision * units * units[:, np.newaxis]
        joined.append((unknown.KIND, title, unknown.components, matrix))
    rows = (
        {"kind": kind, "name": name, "first": components[i], "second": components[j]}
        | {"covariance": float(matrix[i, j])}
        for kind, name, components, matrix in (*joined, *more)
        for i in range(len(components))
        for j in range(i + 1)
        if i == j or matrix[i, j]
    )
    return {"covariances": columns_of_records(rows)}


def _units(unknown: Unknown, angle: float, signs: Sequence[float] = (1.0,) * 3) -> dict[str, float]:
    """Return unit and sign factors of the components of an unknown.

    Signs are the signs of photo and body axes in tables.
    """
    pairs = zip(unknown.components, unknown.units(""), strict=True)
    axes = dict(zip("xyz", signs, strict=True)) if unknown.KIND in _WITH_PHOTOS else {}
    return {name: (angle if unit == "rad" else 1.0) * axes.get(name[-1], 1.0) for name, unit in pairs}
