"""What is asked of an accuracy statement."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import names, number, numbers, shown, truth_value
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.messages import nearest
from photogram.results.components import VarianceComponents

__all__ = ["INDEPENDENT", "METRES", "STANDARDS", "Asked", "length_of", "lengths_in"]

STANDARDS = ("plain", "asprs-2023", "nssda", "vdi-2634", "iso-19157")
INDEPENDENT = ("yes", "same-base", "no")  # Of the survey of check points from the block
METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048}
METRES["us-ft"] = 1200 / 3937  # Metres of the units of length
_UNPAIRED = re.compile("[\ud800-\udfff]")
_LENGTH = re.compile(r"\s*([0-9.]+(?:[eE][+-]?\d+)?)\s*([A-Za-z-]*?)(2?)\s*")


@dataclass(frozen=True)
class Asked:
    """What is asked of a statement; lengths in the linear unit of the block, areas in its square.

    Attributes
    ----------
    standards
        Which of `plain`, `asprs-2023`, `nssda`, `vdi-2634`, `iso-19157`.
    classes
        Accuracy classes that are to be met: by `h` (horizontal), `v` (vertical), `3d`.
    area
        Of the product; None: the hull of all adjusted points in plan.
    sd
        Standard deviations (east, north, up) of the survey of check points that have none; None: that is
        refused.
    without
        Check points without which figures are given beside those of all, with the reason of each.
    independent
        Whether the survey of check points is independent of the block: a declaration, `yes`, `same-base`,
        `no`.
    vegetated
        Check points in vegetation: their heights are stated apart (VVA).
    survey_common_sd
        Of an error that all check points share, east, north, up (a base station, a levelling datum).
    survey_common_in_control
        Whether control has the same error: it then cancels in differences.
    language, text
        Of the sentences, and sentences that stand for those of the language.
    budgets
        Quantities whose uncertainty is taken apart, such as `point C08 z`; None: three are chosen.
    coverage
        Probability of expanded uncertainties.
    components
        The :class:`photogram.VarianceComponents` whose result it is, where weights were estimated.
    lengths
        Calibrated lengths: mappings of `line`, `from`, `to` (names of points), `length`, `sd`, `temperature`
        (deg C, may be left out).
    limit, expansion
        (A, K, B) of the limit A + K L <= B of their errors, and what takes measured lengths to 20 deg C: of
        the object, per kelvin.
    title, project, client, firm, surveyor, date
        What the head of the page says.
    """

    standards: tuple[str, ...] = ("asprs-2023", "plain")
    classes: Mapping[str, float] = field(default_factory=dict)
    area: float | None = None
    sd: tuple[float, ...] | None = None
    without: Mapping[str, str] = field(default_factory=dict)
    independent: str | None = None
    vegetated: frozenset[str] = frozenset()
    survey_common_sd: tuple[float, ...] = (0.0, 0.0, 0.0)
    survey_common_in_control: bool = False
    language: str = "en"
    text: Mapping[str, str] = field(default_factory=dict)
    budgets: tuple[Any, ...] | None = None
    coverage: float = 0.95
    components: VarianceComponents | None = None
    lengths: tuple[Mapping[str, Any], ...] = ()
    limit: tuple[float, float, float] | None = None
    expansion: float | None = None
    title: str = ""
    project: str = ""
    client: str = ""
    firm: str = ""
    surveyor: str = ""
    date: str = ""

    @classmethod
    def checked(cls, **given: Any) -> Asked:
        """Return what is asked, checked.

        Raises
        ------
        InputError
            What there is not, or cannot be.
        """
        known = [each.name for each in fields(cls)]
        for name in given:
            if name not in known:
                raise InputError(f"a statement has no {name}{nearest(name, known)}")
        own = {name: value for name, value in given.items() if value is not None}
        asked = cls(**{name: _CHECKS.get(name, _text)(name, value) for name, value in own.items()})
        asked._check()
        return asked

    def _check(self) -> None:
        for each in self.standards:
            if each not in STANDARDS:
                raise InputError(f"there is no standard {each!r}{nearest(each, STANDARDS)}")
        for name, size in self.classes.items():
            if name not in ("h", "v", "3d"):
                raise InputError(f"a class is horizontal (h), vertical (v) or 3d, not {name!r}")
            if not 0 < size < math.inf:
                raise InputError(f"the class {name} is a length, not {size}")
        if self.independent is not None and self.independent not in INDEPENDENT:
            raise InputError(f"independent is one of {', '.join(INDEPENDENT)}, not {self.independent!r}")
        if not 0 < self.coverage < 1:
            raise InputError(f"coverage is a probability between 0 and 1, not {self.coverage}")
        if self.expansion is not None and not math.isfinite(self.expansion):
            raise InputError(f"the thermal expansion is a number, not {self.expansion}")
        if "vdi-2634" in self.standards and not self.lengths:
            raise InputError("vdi-2634 is about calibrated lengths: a table of lengths lacks")
        if self.area is not None and not 0 < self.area < math.inf:
            raise InputError(f"the area is a positive number, not {self.area}")
        for point, reason in self.without.items():
            if not reason.strip():
                raise InputError(f'{point} is left out for a reason: --without {point}="target moved"')


def _text(name: str, value: object) -> str:
    if not isinstance(value, str) or "\0" in value or (not value.isascii() and _UNPAIRED.search(value)):
        raise InputError(f"{name} is no text: {shown(value)}")
    return value


def _several(name: str, value: Any) -> tuple[str, ...]:
    return tuple(names(name, [value] if isinstance(value, str) else value))


def _mapping(name: str, value: object) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        raise InputError(f"{name} is no mapping: {shown(value)}")
    return value


def _sizes(name: str, value: object) -> dict[str, float]:
    return {_text(name, own): number(f"{name} {own}", each) for own, each in _mapping(name, value).items()}


def _sentences(name: str, value: object) -> dict[str, str]:
    return {_text(name, own): _text(f"{name} {own}", each) for own, each in _mapping(name, value).items()}


def _three(name: str, given: Any) -> tuple[float, ...]:
    """Return one number, or three, for east, north and up."""
    values = tuple(np.atleast_1d(numbers(name, given)).ravel().tolist())
    values = values * 3 if len(values) == 1 else values
    if len(values) != 3 or not all(each >= 0 and math.isfinite(each * each) for each in values):
        raise InputError(f"{name} is one standard deviation, or three (east, north, up), not {shown(given)}")
    return values


def _limit(name: str, given: Any) -> tuple[float, float, float]:
    values = np.atleast_1d(numbers(name, given)).ravel().tolist()
    if len(values) != 3 or not all(each >= 0 for each in values) or not math.isfinite(values[0] + values[1]):
        raise InputError(f"the limit of lengths is A, K and B of A + K L <= B, not {shown(given)}")
    return values[0], values[1], values[2]


def _lengths(name: str, given: Any) -> tuple[Mapping[str, Any], ...]:
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(f"{name} is no list of lengths: {shown(given)}")
    return tuple(
        _length(f"{name}[{row}]", _mapping(f"{name}[{row}]", each)) for row, each in enumerate(given)
    )


def _length(name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    lacking = [key for key in ("line", "from", "to", "length", "sd") if key not in given]
    if lacking:
        raise InputError(f"{name} has no {lacking[0]}")
    line, first, last = names(name, [given[key] for key in ("line", "from", "to")])
    values = {key: number(f"{name} {key}", given[key]) for key in ("length", "sd")}
    if given.get("temperature") is not None:
        values["temperature"] = number(f"{name} temperature", given["temperature"])
    return {"line": line, "from": first, "to": last, **values}


def _quantities(name: str, given: Any) -> tuple[Any, ...]:
    if isinstance(given, str | Mapping):
        return (given,)
    if not isinstance(given, Sequence):
        raise InputError(f"{name} is no list of quantities: {shown(given)}")
    return tuple(given)


def _components(name: str, given: object) -> object:
    if not isinstance(given, VarianceComponents):
        raise InputError(f"{name} are no variance components: {shown(given)}")
    return given


_CHECKS: Mapping[str, Callable[[str, Any], Any]] = {
    "standards": _several,
    "classes": _sizes,
    "area": number,
    "sd": _three,
    "without": _sentences,
    "vegetated": lambda name, value: frozenset(_several(name, value)),
    "survey_common_sd": _three,
    "survey_common_in_control": truth_value,
    "text": _sentences,
    "budgets": _quantities,
    "coverage": number,
    "components": _components,
    "lengths": _lengths,
    "limit": _limit,
    "expansion": number,
}


def lengths_in(unit: str) -> float:
    """Return how many metres a linear unit has.

    Raises
    ------
    InputError
        A unit that nobody knows.
    """
    try:
        return METRES[unit]
    except KeyError:
        raise InputError(f"there is no unit of length {unit!r}{nearest(unit, METRES)}") from None


def length_of(given: str, unit: str, *, area: bool = False) -> float:
    """Return a length such as `5cm`, or an area such as `12.5km2`, in the linear unit or its square.

    Raises
    ------
    InputError
        No length, or one without its unit.
    """
    found = _LENGTH.fullmatch(given)
    what = "an area with its unit: 12.5km2" if area else "a length with its unit: 5cm"
    if found is None or not found[2] or bool(found[3]) != area:
        raise InputError(f"{given!r} is not {what}")
    try:
        value = float(found[1])
    except ValueError:
        raise InputError(f"{given!r} is not {what}") from None
    factor = lengths_in(found[2]) / lengths_in(unit)
    return value * (factor**2 if area else factor)
