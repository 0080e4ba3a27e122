"""Things of an adjusted network that have covariances, by their kinds and names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.arrays import names, value_field
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block, position_columns
from photogram.network.tables import ATTITUDE_COLUMNS
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

Wanted = str | int | Sequence[str] | Sequence[int] | None
"""A name, names, or None for all; the photos and points of collections are called by their numbers."""

Item = tuple[str, Wanted]  # Kind (`photo`, `step`, `point`, `camera`, `unknown`) and names

Selection = Item | Sequence[Item]  # One or several items


@dataclass(frozen=True, eq=False)
class Selected:
    """What a selection names."""

    rows: list[tuple[str, int]]  # Kind and index of each part, as the core knows them
    labels: list[tuple[str, str, str]]  # What each unknown is: kind, name, component
    values: Floats  # Adjusted values and standard deviations, one after the other
    sd: Floats
    shapes: list[tuple[int, ...]]  # Of each item: (k,) for one name, (n, k) for several

    def arrays(self, values: Floats) -> list[Floats]:
        """Return values item by item."""
        parts, start = [], 0
        for shape in self.shapes:
            size = int(np.prod(shape))
            parts.append(values[start : start + size].reshape(shape))
            start += size
        return parts


@dataclass(frozen=True, eq=False)
class Things:
    """Things of one kind, one after the other."""

    ids: Sequence[str]  # Of each its name, the names of its unknowns, their values and standard deviations
    components: Sequence[tuple[str, ...]]
    values: Sequence[Floats] | Floats
    sd: Sequence[Floats] | Floats
    # What the core calls the parts of such a thing; none where it is called as it is
    parts: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Adjusted:
    """Adjusted values and standard deviations of a network."""

    network: str  # What it is called: a block, or a collection
    things: Mapping[str, Things]  # By their kinds
    numbered: bool = False  # Whether they are called by their numbers

    def selected(self, selection: Selection) -> Selected:
        """Return what a selection names; refuse a kind or name that is not there, or that is no name."""
        items = [selection] if isinstance(selection, tuple) and isinstance(selection[0], str) else selection
        rows: list[tuple[str, int]] = []
        labels: list[tuple[str, str, str]] = []
        values: list[Floats] = []
        deviations: list[Floats] = []
        shapes: list[tuple[int, ...]] = []
        for item in items:
            if not (isinstance(item, tuple) and len(item) == 2) or item[0] not in self.things:
                raise InputError(
                    phrase("adjusted.selection", value=value_field(item), kinds=list(self.things))
                )
            kind, wanted = str(item[0]), item[1]
            own = self.things[kind]
            chosen = self._indices(kind, wanted)
            rows += [(part, index) for index in chosen for part in own.parts or (kind,)]
            for index in chosen:
                labels += [(kind, own.ids[index], component) for component in own.components[index]]
                values.append(np.asarray(own.values[index], dtype=float))
                deviations.append(np.asarray(own.sd[index], dtype=float))
            counts = [len(own.components[index]) for index in chosen]
            widths = set(counts)
            if self._is_one(wanted):
                shapes.append((counts[0],))
            elif len(widths) <= 1:
                shapes.append((len(chosen), *widths) if widths else (0,))
            else:
                shapes.append((sum(counts),))
        together = [np.concatenate(part) if part else np.empty(0) for part in (values, deviations)]
        return Selected(rows, labels, together[0], together[1], shapes)

    def _places(self, kind: str) -> dict[str, int]:
        known: dict[str, dict[str, int]] = self.__dict__.setdefault("_known_places", {})
        if kind not in known:
            known[kind] = {name: i for i, name in enumerate(self.things[kind].ids)}
        return known[kind]

    def _is_one(self, wanted: Wanted) -> bool:
        return isinstance(wanted, str) or (
            self.numbered and isinstance(wanted, Integral) and not isinstance(wanted, bool)
        )

    def _indices(self, kind: str, wanted: Wanted) -> list[int]:
        if wanted is None:
            used = ~np.isnan([each[0] if len(each) else 0.0 for each in self.things[kind].values])
            return np.flatnonzero(used).tolist()
        index = self._places(kind)
        several: Any = [wanted] if self._is_one(wanted) else wanted
        asked = names(f"names of the kind {kind}", several)
        if missing := [name for name in asked if name not in index]:
            what = kind.replace("step", "photo")
            raise InputError(phrase("error.absent", kind=what, name=missing[0]))
        return [index[name] for name in asked]


def photo_components(block: Block) -> tuple[str, ...]:
    """Name the six unknowns of a photo."""
    return tuple(name.removesuffix("_deg") for name in (*position_columns(block), *ATTITUDE_COLUMNS))


def point_components(block: Block) -> tuple[str, ...]:
    """Name the three coordinates of a point."""
    return tuple(name.removesuffix("_deg") for name in position_columns(block))


def adjusted(result: Result) -> Adjusted:
    """Return the adjusted values of a result by kinds and names."""
    block = result.block
    photos, sd = np.hstack([result.photo_positions, result.photo_attitudes]), result.photo_sd
    places, count = point_components(block), len(photos)
    steps = (*places, "rho x", "rho y", "rho z")
    points = [places] * len(block.point_ids)
    # Blocks with principal distances have a camera for each: they are known, and nobody asks for them.
    cameras, unknowns = result.cameras, result.unknowns
    return Adjusted(
        network="block",
        things={
            "photo": Things(block.photo_ids, [photo_components(block)] * count, photos, sd),
            "step": Things(block.photo_ids, [steps] * count, photos, sd),
            "point": Things(block.point_ids, points, result.point_positions, result.point_sd),
            "camera": Things(
                [each.name for each in cameras],
                [each.names for each in cameras],
                [each.values for each in cameras],
                [each.sd for each in cameras],
            ),
            "unknown": Things(
                [each.name for each in unknowns],
                [each.components for each in unknowns],
                [each.values for each in unknowns],
                [each.sd for each in unknowns],
            ),
        },
    )
