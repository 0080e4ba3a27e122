"""The observations of a block as sources of uncertainty: their groups and names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.messages import listed
from photogram.results.group_sums import observables
from photogram.results.grouping import Grouping
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    KINDS,
    OBSERVATION,
    POSITION,
)
from photogram.results.result import Result
from photogram.results.suspects import block_suspects, observations_of_core

__all__ = ["Rows", "held_names", "kind_of"]

PHOTOS = 100
"""Photos that are listed, those that contribute most."""
SHARED = 20
"""Names of what is held that are told."""
_PLURALS = {IMAGE: "images", CONTROL: "control", POSITION: "photo positions", ATTITUDE: "photo attitudes"}


class Rows:
    """All M observations: which groups they are in, and what they are called."""

    def __init__(self, result: Result, core: _photocore.NetworkTrial) -> None:
        self.block = result.block
        self.suspects, self.sd = block_suspects(result.block, core), core.deviations
        self.group = np.repeat(np.arange(len(self.suspects)), np.diff(self.suspects.row_starts))
        self.kind: Indices = self.suspects.kinds[self.group]
        self.subject: Indices = self.suspects.subjects[self.group]
        self.component: Indices = core.components.astype(np.int64)
        self._observed = observations_of_core(self.block)
        self._kinds, self._of_kind = self._labels()
        self._images = self.kind == IMAGE
        self._photo: Indices = self.suspects.photos[self.group[self._images]]
        seen = observables(result)
        self._cameras, self._camera_of_photo = list(seen.camera_names), seen.photo_cameras
        self._strips = np.full(len(self.block.photo_ids), -1)
        for number, photos in enumerate(seen.strips()):
            self._strips[photos] = number

    def __len__(self) -> int:
        return len(self.group)

    def _labels(self) -> tuple[list[str], Indices]:
        """Return the names of kinds, and (M,) which each row is of."""
        names = _PLURALS
        of_observation = [kind_of(each.label) for each in self._observed]
        of_unknown = [each.KIND for each in self.block.unknowns]
        found: dict[str, int] = {}
        number = np.zeros(len(self.group), dtype=np.int64)
        for kind in range(len(KINDS)):
            own = np.flatnonzero(self.kind == kind)
            if not len(own):
                continue
            if kind in names or KINDS[kind] == "camera":
                number[own] = found.setdefault(names.get(kind, "camera"), len(found))
                continue
            labels = of_observation if kind == OBSERVATION else of_unknown
            each = np.array([found.setdefault(label, len(found)) for label in labels], dtype=np.int64)
            number[own] = each[self.subject[own]]
        return list(found), number

    def sources(self, squares: Floats) -> Iterable[tuple[str, str, int, float]]:
        """Return level, name, number of rows and contribution of every group."""
        yield from _sums("kind", self._kinds, self._of_kind, squares)
        own = squares[self._images]
        photo = self._photo
        strips = [str(number + 1) for number in range(int(self._strips.max(initial=-1)) + 1)]
        yield from _sums("strip", strips, self._strips[photo], own)
        yield from _sums("camera", self._cameras, self._camera_of_photo[photo], own)
        yield from _sums("photo", self.block.photo_ids, photo, own, PHOTOS)
        control = self.kind == CONTROL
        points = self.suspects.points[self.group[control]]
        yield from _sums("point", self.block.point_ids, points, squares[control])
        yield from self._parameters(squares)

    def _parameters(self, squares: Floats) -> Iterable[tuple[str, str, int, float]]:
        """Return weighted parameters of cameras and components of common unknowns."""
        several = len(self.block.camera_names) > 1
        for row in np.flatnonzero(self.kind > OBSERVATION).tolist():
            kind, *of, component = self.named(row)
            name = component if kind == "camera" and not several else " ".join([*of, component])
            yield "parameter", name, 1, float(squares[row])

    def named(self, row: int) -> tuple[str, ...]:
        """Return the kind of a row, of what it is, and its component."""
        kind, subject, component = int(self.kind[row]), int(self.subject[row]), int(self.component[row])
        block = self.block
        if kind == IMAGE:
            axes = ("column", "row") if block.image_unit == "px" else ("x", "y")
            photo, point = block.image_photos[subject], block.image_points[subject]
            return "image", block.photo_ids[photo], block.point_ids[point], axes[component]
        if kind == CONTROL:
            return "control", block.point_ids[subject], "xyz"[component]
        if kind in (POSITION, ATTITUDE):
            own = ("x", "y", "z") if kind == POSITION else ("omega", "phi", "kappa")
            return KINDS[kind], block.photo_ids[subject], own[component]
        if kind == OBSERVATION:
            observation = self._observed[subject]
            names = observation.components(geographic=block.geographic)
            return kind_of(observation.label), *observation.of, names[component].lower()
        if KINDS[kind] == "camera":
            parameters = block.cameras[subject].names if block.cameras else ("c",)
            return "camera", block.camera_names[subject], parameters[component]
        unknown = block.unknowns[subject]
        return unknown.KIND, unknown.name, unknown.components[component]

    def groups(self, grouping: Grouping) -> Indices:
        """Return (M,) the group of each row in a grouping; -1 for none."""
        found = np.full(len(self.group), -1)
        for kind, table in (
            (IMAGE, grouping.images),
            (CONTROL, grouping.points),
            (POSITION, grouping.photos),
        ):
            own = self.kind == kind
            found[own] = table[self.subject[own], self.component[own]]
        own = self.kind == ATTITUDE
        found[own] = grouping.photos[self.subject[own], 3 + self.component[own]]
        own = self.kind == OBSERVATION
        if own.any():
            numbers = {id(each): row for row, each in enumerate(self.block.observations)}
            of = np.array([numbers[id(each)] for each in self._observed], dtype=np.int64)
            found[own] = grouping.observations[of[self.subject[own]]]
        return found


def kind_of(label: str) -> str:
    """Return what people call a kind of observations."""
    return {"position": "gnss"}.get(label, label)


def _sums(
    level: str, names: Sequence[str], of: Indices, squares: Floats, most: int | None = None
) -> Iterable[tuple[str, str, int, float]]:
    """Return the sums over groups that have rows, in their order; or the largest, and all others as one."""
    inside = slice(None) if of.min(initial=0) >= 0 else of >= 0
    numbers = np.bincount(of[inside], minlength=len(names))
    sums = np.bincount(of[inside], weights=squares[inside], minlength=len(names))
    there = np.flatnonzero(numbers)
    if most is not None and len(there) > most:
        order = there[np.argsort(-sums[there], kind="stable")]
        rest = order[most:]
        others = ("others", int(numbers[rest].sum()), math.fsum(sums[rest].tolist()))
        there = order[:most]
    else:
        others = None
    values = zip(there.tolist(), numbers[there].tolist(), sums[there].tolist(), strict=True)
    yield from ((level, names[k], number, total) for k, number, total in values)
    if others is not None:
        yield level, *others


def held_names(result: Result) -> str:
    """Name what was held, and is taken as errorless; empty where nothing was."""
    block, held = result.block, []
    fixed = np.flatnonzero((block.point_sd == 0).any(axis=1)).tolist()
    held += [f"point {block.point_ids[row]}" for row in fixed]
    photos = (block.photo_position_sd == 0).any(axis=1) | (block.photo_attitude_sd == 0).any(axis=1)
    held += [f"photo {block.photo_ids[row]}" for row in np.flatnonzero(photos).tolist()]
    for camera in result.cameras:
        own = [name for name, sd in zip(camera.names, camera.sd.tolist(), strict=True) if not sd > 0]
        if own:
            held.append(f"{', '.join(own)} of camera {camera.name}")
    return listed(held, SHARED) if held else ""
