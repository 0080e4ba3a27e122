"""Column headings of coordinates, and words for control and check points.

`headings.csv` contains the words, without accents and marks (`hohe` is Höhe); all readers of points with
coordinates use it. Kinds of rows are `column` (without meaning: columns that an adjustment does not need),
`role` (`?`: control or check, depending on the program; the other role has another word), `accuracy` (of
several coordinates), `photo`, `pixel` and `filler`. A heading is known if it is one of the words, or if all
its words but fillers have one meaning (`X/Easting`, `Punkt-Nr.`).
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Collection, Mapping

from photogram.formats.declarations import declared

ROLE = "use"  # Column of the roles: control or check


def _declared() -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = {}
    for kind, meaning, _, words in declared(__file__, "headings.csv"):
        for word in words.split(", "):
            found.setdefault(kind, {}).setdefault(word, meaning)
    return found


WORDS = _declared()  # Meanings of words by kind
_KNOWN, _KNOWN_ROLES, _TOGETHER = (WORDS[kind] for kind in ("column", "role", "accuracy"))
_METRES: Mapping[float, str] = {
    1.0: "m, meter, metre, meters, metres",
    1000.0: "km",
    0.01: "cm",
    0.001: "mm",
    0.3048: "ft, feet, foot, ift",
    1e-6: "um, μm, micron, microns, micrometer, micrometre",
    1200 / 3937: "us-ft, usft, ftus, sft, us survey ft, us survey feet",
}
_RADIANS: Mapping[float, str] = {
    1.0: "rad",
    1e-3: "mrad",
    math.pi / 180: "deg, degree, degrees, °",
    math.pi / 10_800: "arcmin",
    math.pi / 648_000: "arcsec",
    math.pi / 200: "gon, grad, grads",
    math.pi / 200_000: "mgon",
}
UNITS: Mapping[str, float] = {word: size for size, words in _METRES.items() for word in words.split(", ")}
"""Units of length in headings, in metres."""
KINDS_OF_UNITS: Mapping[str, Mapping[str, float]] = {
    "length": UNITS,
    "angle": {word: size for size, words in _RADIANS.items() for word in words.split(", ")},
    "pixel": dict.fromkeys(("px", "pixel", "pixels"), 1.0),
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3},
}
"""Units in headings: metres, radians, pixels, seconds."""
ANGULAR: Mapping[str, str] = {"longitude": "x", "latitude": "y"}
_BRACKETS = re.compile(r"[(\[{]([^)\]}]*)[)\]}]")
_COVERAGE = re.compile(r"\bk\s*=\s*(\d+(?:[.,]\d*)?)")
_EXPANDED = re.compile(r"u(xyz|xy|[xyzenh])?")
"""U, the expanded uncertainty; the heading contains the coverage factor."""


def words_of(text: str) -> list[str]:
    """Return the words of a heading in small letters, without accents."""
    bare = unicodedata.normalize("NFKD", _BRACKETS.sub(" ", text).casefold().replace("σ", " sigma "))
    plain = "".join(each for each in bare if not unicodedata.combining(each))
    return re.sub(r"[^0-9a-z]+", " ", plain).split()


def _meaning(words: list[str]) -> str | None:
    """Return the common meaning of words, ignoring fillers."""
    if (whole := _KNOWN.get(" ".join(words))) is not None:
        return whole
    found = {
        _KNOWN.get(word)
        for word in words
        if word not in WORDS["filler"] and not re.fullmatch(r"utm\d*[ns]?", word)
    } or {_KNOWN[word] for word in words if word in _KNOWN}
    found = {ANGULAR.get(each or "", each) if len(found) > 1 else each for each in found}
    return found.pop() if len(found) == 1 else None


_GLUED = re.compile(r"(?:sigma|sd|std|s|m|rms)(xyz|xy|[xyzenh])")


def column_of(heading: str) -> str | None:
    """Return the column of a heading; empty if it is not needed, None if unknown."""
    words = words_of(_COVERAGE.sub(" ", heading.casefold()))
    if len(words) > 1 and words[-1] in UNITS:
        words.pop()
    if not words:
        return None
    if coverage_of(heading) is not None and (expanded := _EXPANDED.fullmatch(words[0])):
        words = ["sd", *([expanded[1]] if expanded[1] else []), *words[1:]]
    if (whole := _KNOWN.get(" ".join(words))) is not None:
        return whole
    if len(words) == 1 and (glued := _GLUED.fullmatch(words[0])):
        words = ["sd", glued[1]]
    if words[0] in ("lagegenauigkeit", "hohengenauigkeit", "hoehengenauigkeit", "hrms", "vrms"):
        return _TOGETHER[words[0]]
    for cut in range(1, len(words)):
        for deviation, rest in ((words[:cut], words[cut:]), (words[-cut:], words[:-cut])):
            if _KNOWN.get(" ".join(deviation)) == "sd":
                own = _TOGETHER.get(" ".join(rest)) or _meaning(rest)
                own = ANGULAR.get(own or "", own or "")
                if own.startswith("sd"):
                    return own
                if own in ("x", "y", "z"):
                    return f"sd_{own}"
    return _meaning(words)


def is_photo(heading: str) -> bool:
    return " ".join(words_of(heading)) in WORDS["photo"]


def is_angular(heading: str) -> bool:
    """Return whether a heading names a longitude or latitude."""
    return any(_KNOWN.get(word) in ANGULAR for word in words_of(heading))


def units_of(heading: str) -> list[str]:
    """Return the units in a heading: in brackets, otherwise at the end."""
    inside = [_COVERAGE.sub(" ", each) for each in _BRACKETS.findall(heading.casefold())]
    found = [" ".join(each.replace("_", " ").split()).strip(" ,;") for each in inside]
    words = re.sub(r"[^0-9a-zμ-]+", " ", heading.casefold()).split()
    return [each for each in found if each] or ([words[-1]] if len(words) > 1 and words[-1] in UNITS else [])


def coverage_of(heading: str) -> float | None:
    """Return the coverage factor in a heading such as k=2; None without."""
    match = _COVERAGE.search(heading.casefold())
    return None if match is None else float(match[1].replace(",", "."))


def bare_name(heading: str, known: Collection[str]) -> str | None:
    """Return the known column of a heading, ignoring unit and coverage factor."""
    if not all(any(word in units for units in KINDS_OF_UNITS.values()) for word in units_of(heading)):
        return None
    words = _COVERAGE.sub(" ", _BRACKETS.sub(" ", heading.casefold())).replace("_", " ").split()
    names = ["_".join(words)]
    if len(words) > 1 and words[-1] in UNITS:
        names.append("_".join(words[:-1]))
    return next((each for each in names if each in known), None)


def role_of(text: str) -> str | None:
    """Return `control`, `check`, `off` or `?` (ambiguous); None for other words."""
    return _KNOWN_ROLES.get(" ".join(words_of(text)))
