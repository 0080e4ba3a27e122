"""Kinds, components and fixed values in the language of a statement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.results.statement.texts import Texts

if TYPE_CHECKING:
    from photogram import Result

LISTED = 20
"""Fixed values that are named at most."""


def kind(texts: Texts, name: str) -> str:
    """Return what a kind is called, in the plural: `images`, `prior, lever arm`, `.., 4 coefficients`."""
    found = []
    for each in name.split(", "):
        count, blank, rest = each.partition(" ")
        counted = f"{count} {texts.word('kind', rest)}" if blank and count.isdigit() else ""
        found.append(counted or texts.word("kind", each))
    return ", ".join(found)


def axis(texts: Texts, name: str) -> str:
    """Return what a component is called; parameters of cameras and letters stay as they are."""
    return texts.word("axis", name)


def observation(texts: Texts, of: Sequence[str]) -> str:
    """Return what a single observation is called: its kind, of what it is, its component."""
    one, *what, component = of
    return " ".join([_one(texts, one), *what, axis(texts, component)])


def held(texts: Texts, result: Result) -> str:
    """Name what was held, and is taken as errorless; empty where nothing was."""
    block = result.block
    points = np.flatnonzero((block.point_sd == 0).any(axis=1)).tolist()
    photos = np.flatnonzero(
        (block.photo_position_sd == 0).any(axis=1) | (block.photo_attitude_sd == 0).any(axis=1)
    ).tolist()
    found = [texts("held.point", name=block.point_ids[row]) for row in points]
    found += [texts("held.photo", name=block.photo_ids[row]) for row in photos]
    for camera in result.cameras:
        own = [name for name, sd in zip(camera.names, camera.sd.tolist(), strict=True) if not sd > 0]
        if own:
            found.append(texts("held.camera", parameters=", ".join(own), name=camera.name))
    return texts.listed(found, LISTED) if found else ""


def _one(texts: Texts, name: str) -> str:
    """Return what one of a kind of observations is called."""
    return ", ".join(texts.word("one", each) for each in name.split(", "))
