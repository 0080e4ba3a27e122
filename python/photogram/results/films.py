"""Films of photos and their fiducial marks after an adjustment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import frozen
from photogram.arguments.types import Floats
from photogram.network.films import Film, Mark, Scan
from photogram.results.kinds import ObservedKind
from photogram.results.unknowns import AdjustedUnknown

if TYPE_CHECKING:
    from photogram.results.result import Result

__all__ = ["adjusted_marks", "film_cofactors", "film_values", "films_of", "readings_of"]


def films_of(result: Result) -> dict[int, Film]:
    """Return the films of a block by the rows of their photos."""
    rows = {name: row for row, name in enumerate(result.block.photo_ids)}
    return {rows[each.photo]: each.film for each in result.block.passages if isinstance(each, Scan)}


def _adjusted(result: Result) -> Mapping[int, AdjustedUnknown]:
    return {id(each.given): each for each in result.unknowns}


def film_values(result: Result) -> Floats:
    """Return (P, 6) t1, t2 (mm), theta (radians), m, b1, b2 of the photos; NaN of those that are no films."""
    found, own = np.full((len(result.block.photo_ids), 6), np.nan), _adjusted(result)
    for row, film in films_of(result).items():
        found[row] = [*own[id(film.placement)].position, *own[id(film.size)].position]
        if film.roll is not None:
            found[row, 3] += own[id(film.roll)].position[0]
    return frozen(found)


def film_cofactors(result: Result) -> Floats:
    """Return (P, 6, 6) cofactors of the same; of an m that is its roll's with the others NaN."""
    found, own = np.full((len(result.block.photo_ids), 6, 6), np.nan), _adjusted(result)
    for row, film in films_of(result).items():
        placement, size = own[id(film.placement)], own[id(film.size)]
        found[row, :3, :3], found[row, 3:, 3:] = placement.cofactors, size.cofactors
        mixed = size.with_former if size.with_former.size else np.zeros((3, 3))
        found[row, 3:, :3], found[row, :3, 3:] = mixed, mixed.T
        if film.roll is not None:
            found[row, 3], found[row, :, 3] = np.nan, np.nan
            found[row, 3, 3] = own[id(film.roll)].cofactors[0, 0]
    return frozen(found)


def adjusted_marks(result: Result) -> dict[str, AdjustedUnknown]:
    """Return the adjusted fiducial marks by name: camera and mark; held ones, too."""
    return {each.name: each for each in result.unknowns if isinstance(each.given, Mark)}


def readings_of(result: Result) -> ObservedKind | None:
    """Return what has become of the readings of marks; None without."""
    return result.kinds.get("fiducial")
