"""Kinds, components, datum, frame, refraction, fixed values and features in the language of a statement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.network.frame import Frame
from photogram.network.refraction import Refraction
from photogram.results.datum import ResultDatum
from photogram.results.features import Feature
from photogram.results.result import Result
from photogram.results.statement.texts import Texts

SHOWN, LISTED = 4, 20
"""Points of a feature, and things that are held, that are told by name."""


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


def datum(texts: Texts, found: ResultDatum) -> str:
    """Return what gives the datum."""
    counts = (("points", found.points), ("photos", found.photos), ("attitudes", found.attitudes))
    over = [texts(f"datum.over.{name}", n=len(own)) for name, own in counts if own]
    unknowns = dict.fromkeys(unknown for _, unknown in found.held)
    lines = [
        texts(
            "datum.held",
            unknown=axis(texts, unknown),
            photos=texts.listed([photo for photo, other in found.held if other == unknown]),
        )
        for unknown in unknowns
    ]
    return texts(
        f"datum.{found.kind}{'.scale' if found.kind == 'inner constraints' and found.scale else ''}",
        held="; ".join(lines),
        over=texts("word.and").join(over),
        names=texts.listed([*found.photos, *found.points]),
    )


def frame(texts: Texts, found: Frame) -> str:
    """Return where the coordinates of a block are."""
    own = texts.word("frame", found.kind)
    if found.origin is not None:
        names = ("latitude", "longitude", "height")
        numbers = (texts.numeral(f"{each:.9g}") for each in found.origin)
        own = texts("frame.origin", frame=own, **dict(zip(names, numbers, strict=True)))
    return own + (f" ({found.crs})" if found.crs else "")


def refraction(texts: Texts, found: Refraction | None, unit: str) -> str:
    """Return what bends the rays."""
    parts = []
    if found is not None and found.air:
        parts.append(texts(f"refraction.air.{found.air}"))
    if found is not None and found.water:
        level = f"{texts.number(found.water_level, 3)} {unit}"
        index = texts.numeral(f"{found.refractive_index:g}")
        parts.append(texts(f"refraction.water.{found.water}", level=level, index=index))
    return "; ".join(parts) or texts("assume.no_refraction")


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


def feature(texts: Texts, found: Feature) -> str:
    """Return what a feature is, and which points it goes through."""
    if found.kind == "distance":
        return texts("feature.distance", first=found.points[0], last=found.points[1])
    own = texts(f"feature.{found.kind}")
    points = texts.listed(list(found.points), SHOWN)
    return texts("feature.through", feature=own, count=len(found.points), points=points)


def _one(texts: Texts, name: str) -> str:
    """Return what one of a kind of observations is called."""
    return ", ".join(texts.word("one", each) for each in name.split(", "))
