"""Things of an adjusted block that have covariances, by their kinds and names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from photogram.arguments.arrays import names, shown
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.network.block import ATTITUDE_COLUMNS, Block, position_columns

__all__ = ["Adjusted", "Item", "Selected", "Selection", "photo_components", "point_components"]

Item = tuple[str, str | Sequence[str] | None]
"""A kind (`photo`, `step`, `point`, `camera`, `unknown`), and a name, names, or None for all of the kind."""

Selection = Item | Sequence[Item]
"""One or several of these."""

KINDS = ("photo", "step", "point", "camera", "unknown")


@dataclass(frozen=True, eq=False)
class Selected:
    """What a selection names.

    Attributes
    ----------
    rows
        Kind and index of each, as the core knows them.
    labels
        What each unknown is: kind, name, component.
    values, sd
        Adjusted values and standard deviations, one after the other.
    shapes
        Of each item: (k,) for one name, (n, k) for several.
    """

    rows: list[tuple[str, int]]
    labels: list[tuple[str, str, str]]
    values: Floats
    sd: Floats
    shapes: list[tuple[int, ...]]

    def arrays(self, values: Floats) -> list[Floats]:
        """Return values item by item."""
        parts, start = [], 0
        for shape in self.shapes:
            size = int(np.prod(shape))
            parts.append(values[start : start + size].reshape(shape))
            start += size
        return parts


@dataclass(frozen=True, eq=False)
class Adjusted:
    """Adjusted values and standard deviations of a block, by kind; names and values one for each thing."""

    block: Block
    ids: dict[str, list[str]]
    components: dict[str, list[tuple[str, ...]]]
    values: Mapping[str, Sequence[Floats] | Floats]
    sd: Mapping[str, Sequence[Floats] | Floats]

    def selected(self, selection: Selection) -> Selected:
        """Return what a selection names.

        Raises
        ------
        InputError
            A kind or name that is not there, or that is no name.
        """
        items = [selection] if isinstance(selection, tuple) and isinstance(selection[0], str) else selection
        rows: list[tuple[str, int]] = []
        labels: list[tuple[str, str, str]] = []
        values: list[Floats] = []
        deviations: list[Floats] = []
        shapes: list[tuple[int, ...]] = []
        for item in items:
            if not (isinstance(item, tuple) and len(item) == 2) or item[0] not in KINDS:
                raise InputError(
                    f"{shown(item)} is no kind ({', '.join(KINDS)}) with a name, several, or None for all"
                )
            kind, wanted = str(item[0]), item[1]
            chosen = self._indices(kind, wanted)
            rows += [(kind, index) for index in chosen]
            for index in chosen:
                components = self.components[kind][index]
                labels += [(kind, self.ids[kind][index], component) for component in components]
                values.append(np.asarray(self.values[kind][index], dtype=float))
                deviations.append(np.asarray(self.sd[kind][index], dtype=float))
            widths = {len(self.components[kind][index]) for index in chosen}
            if isinstance(wanted, str):
                shapes.append((len(self.components[kind][chosen[0]]),))
            elif len(widths) <= 1:
                shapes.append((len(chosen), *widths) if widths else (0,))
            else:
                shapes.append((sum(len(self.components[kind][index]) for index in chosen),))
        together = [np.concatenate(part) if part else np.empty(0) for part in (values, deviations)]
        return Selected(rows, labels, together[0], together[1], shapes)

    def _indices(self, kind: str, wanted: str | Sequence[str] | None) -> list[int]:
        ids = self.ids[kind]
        if wanted is None:
            used = ~np.isnan([each[0] if len(each) else 0.0 for each in self.values[kind]])
            return np.flatnonzero(used).tolist()
        index = {name: i for i, name in enumerate(ids)}
        asked = [wanted] if isinstance(wanted, str) else names(f"names of the kind {kind}", wanted)
        if missing := [name for name in asked if name not in index]:
            raise InputError(f"the block has no {kind.replace('step', 'photo')} {missing[0]!r}")
        return [index[name] for name in asked]


def photo_components(block: Block) -> tuple[str, ...]:
    """Name the six unknowns of a photo."""
    return tuple(name.removesuffix("_deg") for name in (*position_columns(block), *ATTITUDE_COLUMNS))


def point_components(block: Block) -> tuple[str, ...]:
    """Name the three coordinates of a point."""
    return tuple(name.removesuffix("_deg") for name in position_columns(block))
