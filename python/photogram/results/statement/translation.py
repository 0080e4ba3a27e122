"""Words of other modules in the language of a statement, by the same table as its sentences.

Kinds, axes and codes have a key each. What other modules hand over as English text (tests, observations, what
was assumed of files) is known again by the English sentence of a key, whose fields then stand in the sentence
of the language; what none fits stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from photogram.network.frame import Frame
from photogram.network.refraction import Refraction
from photogram.results.datum import ResultDatum
from photogram.results.features import Feature
from photogram.results.result import Result
from photogram.results.statement.texts import Texts
from photogram.statistics.verdict import Verdict

SHOWN, LISTED = 4, 20
"""Points of a feature, and things that are held, that are told by name."""
PLAIN = ("check points", "pattern by photo")
"""Tests that are named by a point or photo alone."""
LETTERS = ("x", "y", "z", "X", "Y", "Z", "omega", "phi", "kappa")
"""Components that are called alike in all languages."""
LINEAR = "linear function of "
"""Before the parts of a quantity that is given by its gradient."""


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


def parameter(texts: Texts, name: str) -> str:
    """Return what a weighted parameter is called: of what it is, if that has a name, and its component."""
    if texts.has(f"axis.{name}"):
        return axis(texts, name)
    words = name.split(" ")
    # `rotation x` precedes `x`, unless only the latter leaves a name of the block.
    ways = [(" ".join(words[:cut]), " ".join(words[cut:])) for cut in range(1, len(words))]
    for of, component in sorted(ways, key=lambda way: not texts.is_name(way[0])):
        if component in LETTERS or texts.has(f"axis.{component}"):
            return f"{of} {axis(texts, component)}"
    return name


def quantity(texts: Texts, name: str) -> str:
    """Return what a quantity is called whose uncertainty is taken apart: `point C08 z`."""
    if name.startswith(LINEAR):
        parts = name.removeprefix(LINEAR).split(", ")
        return texts("quantity.linear", quantities=", ".join(quantity(texts, each) for each in parts))
    what, _, of = name.partition(" ")
    key = f"quantity.{what}"
    if not texts.has(key):
        return name
    return texts(key, of=of if what == "distance" else parameter(texts, of))


def test(texts: Texts, name: str) -> str:
    """Return what a test of a verdict is called."""
    parts = name.split(": ")
    ways = [(": ".join(parts[:cut]), ": ".join(parts[cut:])) for cut in range(1, len(parts) + 1)]
    head, rest = next((way for way in ways if _recognised(texts, "test", way[0])), ways[0])
    own = rest if head in PLAIN else named(texts, rest)
    said = _turned(texts, "test", head) + (f": {own}" if own else "")
    return f"{said[:1].upper()}{said[1:]}"


def named(texts: Texts, said: str) -> str:
    """Return what other modules call an observation, or what else a test is of."""
    if _recognised(texts, "named", said):
        return _turned(texts, "named", said)
    words = said.split(" ")
    for cut in range(len(words) - 1, 0, -1):
        one = " ".join(words[:cut])
        if texts.has(f"one.{one}"):
            return " ".join([texts(f"one.{one}"), *words[cut:]])
    return said


def read(texts: Texts, said: str) -> str:
    """Return what was assumed when files were read."""
    return _turned(texts, "read", said)


def verdict(texts: Texts, found: Verdict) -> str:
    """Return the verdict of the adjustment: in English its own sentence, else what its code means."""
    key = f"verdict.{found.code}"
    return texts(key, said=found.headline) if texts.has(key) else found.headline


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


def _recognised(texts: Texts, family: str, said: str) -> tuple[str, dict[str, str]] | None:
    """Return key and fields of a sentence, preferably those in which every field is known as well."""

    def components(fields: Mapping[str, str]) -> bool:
        axes = fields["axes"].split(", ") if "axes" in fields else []
        return all(each in LETTERS or texts.has(f"axis.{each}") for each in axes)

    def whole(fields: Mapping[str, str]) -> bool:
        own = fields.get("named")
        return components(fields) and (own is None or _recognised(texts, "named", own) is not None)

    return texts.recognised(family, said, whole) or texts.recognised(family, said, components)


def _turned(texts: Texts, family: str, said: str) -> str:
    found = _recognised(texts, family, said)
    if found is None:
        return said
    key, fields = found
    turned = {name: _FIELDS[name](texts, own) for name, own in fields.items() if name in _FIELDS}
    return texts(key, **{**fields, **turned})


_FIELDS: Mapping[str, Callable[[Texts, str], str]] = {
    "kind": kind,
    "one": _one,
    "axes": lambda texts, said: ", ".join(axis(texts, each) for each in said.split(", ")),
    "named": named,
    "number": lambda texts, said: texts.numeral(said),
}
"""Fields of recognised sentences that are words themselves."""
