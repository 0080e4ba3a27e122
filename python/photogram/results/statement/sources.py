"""The observations of a block as sources of uncertainty: their groups and names."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.results.group_sums import observables
from photogram.results.grouping import Grouping
from photogram.results.network_trial import ATTITUDE, CONTROL, IMAGE, KINDS, OBSERVATION, POSITION
from photogram.results.result import Result
from photogram.results.suspects import block_suspects, observations_of_core

PHOTOS = 100
"""Photos that are listed, those that contribute most."""
_PLURALS = {IMAGE: "images", CONTROL: "control", POSITION: "photo positions", ATTITUDE: "photo attitudes"}


class Rows:
    """All M observations in G groups, an image or a control point each: what they are of, and are called."""

    def __init__(self, result: Result, core: _photocore.NetworkSuspects) -> None:
        self.block = result.block
        self.suspects, self.sd = block_suspects(result.block, core), core.deviations
        self._starts: Indices = self.suspects.row_starts
        self._sizes: Indices = np.diff(self._starts)
        self._component = core.components
        self._observed = observations_of_core(self.block)
        self._kinds, self._of_kind = self._labels()
        # Images are the first groups.
        self._images = slice(0, int(np.count_nonzero(self.suspects.kinds == IMAGE)))
        seen = observables(result)
        self._cameras, self._camera_of_photo = list(seen.camera_names), seen.photo_cameras
        self._strips = np.full(len(self.block.photo_ids), -1)
        for number, photos in enumerate(seen.strips()):
            self._strips[photos] = number

    def __len__(self) -> int:
        return int(self._starts[-1])

    def _labels(self) -> tuple[list[str], Indices]:
        """Return the names of kinds, and (G,) which each group is of."""
        of_observation = [kind_of(each.label) for each in self._observed]
        of_unknown = [each.KIND for each in self.block.unknowns]
        found: dict[str, int] = {}
        number = np.zeros(len(self.suspects), dtype=np.int64)
        for kind in np.flatnonzero(np.bincount(self.suspects.kinds)).tolist():
            own = np.flatnonzero(self.suspects.kinds == kind)
            if kind in _PLURALS or KINDS[kind] == "camera":
                number[own] = found.setdefault(_PLURALS.get(kind, "camera"), len(found))
                continue
            labels = of_observation if kind == OBSERVATION else of_unknown
            each = np.array([found.setdefault(label, len(found)) for label in labels], dtype=np.int64)
            number[own] = each[self.suspects.subjects[own]]
        return list(found), number

    def sources(self, squares: Floats) -> Iterable[tuple[str, str, int, float]]:
        """Return level, name, number of rows and contribution of every source, of (M,) squares."""
        sums, sizes = np.add.reduceat(squares, self._starts[:-1]), self._sizes
        yield from _sums("kind", self._kinds, self._of_kind, sums, sizes)
        own, rows, photo = sums[self._images], sizes[self._images], self.suspects.photos[self._images]
        strips = [str(number + 1) for number in range(int(self._strips.max(initial=-1)) + 1)]
        if len(strips) > 1:
            yield from _sums("strip", strips, self._strips[photo], own, rows)
        yield from _sums("camera", self._cameras, self._camera_of_photo[photo], own, rows)
        yield from _sums("photo", self.block.photo_ids, photo, own, rows, PHOTOS)
        control = self.suspects.kinds == CONTROL
        points = self.suspects.points[control]
        yield from _sums("point", self.block.point_ids, points, sums[control], sizes[control])
        yield from self._parameters(squares)

    def _parameters(self, squares: Floats) -> Iterable[tuple[str, str, int, float]]:
        """Return weighted parameters of cameras and components of common unknowns."""
        several = len(self.block.camera_names) > 1
        for group in np.flatnonzero(self.suspects.kinds > OBSERVATION).tolist():
            for row in self.suspects.rows(group).tolist():
                kind, *of, component = self.named(row)
                name = component if kind == "camera" and not several else " ".join([*of, component])
                yield "parameter", name, 1, float(squares[row])

    def named(self, row: int) -> tuple[str, ...]:
        """Return the kind of a row, of what it is, and its component."""
        group = int(np.searchsorted(self._starts, row, "right")) - 1
        kind, subject = int(self.suspects.kinds[group]), int(self.suspects.subjects[group])
        component = int(self._component[row])
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
        kind, subject = (
            np.repeat(each, self._sizes) for each in (self.suspects.kinds, self.suspects.subjects)
        )
        component = self._component.astype(np.int64)
        found = np.full(len(self), -1)
        tables = {IMAGE: grouping.images, CONTROL: grouping.points, POSITION: grouping.photos}
        for own_kind, table in tables.items():
            own = kind == own_kind
            found[own] = table[subject[own], component[own]]
        own = kind == ATTITUDE
        found[own] = grouping.photos[subject[own], 3 + component[own]]
        own = kind == OBSERVATION
        if own.any():
            numbers = {id(each): row for row, each in enumerate(self.block.observations)}
            of = np.array([numbers[id(each)] for each in self._observed], dtype=np.int64)
            found[own] = grouping.observations[of[subject[own]]]
        return found


def kind_of(label: str) -> str:
    """Return what people call a kind of observations."""
    return {"position": "gnss"}.get(label, label)


def _sums(
    level: str, names: Sequence[str], of: Indices, sums: Floats, sizes: Indices, most: int | None = None
) -> Iterable[tuple[str, str, int, float]]:
    """Return the sums over groups that have rows, in their order; or the largest, and all others as one."""
    if of.min(initial=0) < 0:
        inside = of >= 0
        of, sums, sizes = of[inside], sums[inside], sizes[inside]
    numbers = np.bincount(of, weights=sizes, minlength=len(names)).astype(np.int64)
    totals = np.bincount(of, weights=sums, minlength=len(names))
    there = np.flatnonzero(numbers)
    if most is not None and len(there) > most:
        order = there[np.argsort(-totals[there], kind="stable")]
        rest = order[most:]
        others = ("others", int(numbers[rest].sum()), math.fsum(totals[rest].tolist()))
        there = order[:most]
    else:
        others = None
    values = zip(there.tolist(), numbers[there].tolist(), totals[there].tolist(), strict=True)
    yield from ((level, names[k], number, total) for k, number, total in values)
    if others is not None:
        yield level, *others
