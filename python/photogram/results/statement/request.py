"""The options of an accuracy statement."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from photogram.arguments.arrays import names, number, numbers, one_of, truth_value, value_field
from photogram.arguments.objects import require_kind, require_name
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.results.components import VarianceComponents
from photogram.words import phrase

STANDARDS = ("plain", "asprs-2023", "nssda", "vdi-2634", "iso-19157")
INDEPENDENT = ("yes", "same-base", "no")  # Independence of the survey of check points from the block
METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048}
METRES["us-ft"] = 1200 / 3937  # Metres of the units of length
_UNPAIRED = re.compile("[\ud800-\udfff]")
_LENGTH = re.compile(r"\s*([0-9.]+(?:[eE][+-]?\d+)?)\s*([A-Za-z-]*?)(2?)\s*")


POSITIVE = partial(number, rule="positive")


def invalid(name: str, code: str, value: object = None, /, **fields: Any) -> InputError:
    return InputError(phrase("error.at", what=name, message=phrase(code, value=value_field(value), **fields)))


def _text(name: str, value: object) -> str:
    if not isinstance(value, str) or "\0" in value or (not value.isascii() and _UNPAIRED.search(value)):
        raise invalid(name, "error.text", value)
    return value


def _several(name: str, value: Any) -> tuple[str, ...]:
    return tuple(names(name, [value] if isinstance(value, str) else value))


def _mapping(name: str, value: object) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        raise invalid(name, "error.table", value)
    return value


def _by_name(check: Callable[[str, Any], Any]) -> Callable[[str, Any], dict[str, Any]]:
    return lambda name, value: {
        _text(name, key): check(f"{name} {key}", own) for key, own in _mapping(name, value).items()
    }


def _sequence(name: str, value: Any) -> Sequence[Any]:
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise invalid(name, "error.list", value)
    return value


def _three(name: str, value: Any) -> tuple[float, ...]:
    """Return one number, or three, for east, north and up."""
    values = tuple(np.atleast_1d(numbers(name, value)).ravel().tolist())
    values = values * 3 if len(values) == 1 else values
    if len(values) != 3 or not all(each >= 0 and math.isfinite(each * each) for each in values):
        raise invalid(name, "request.deviations", value)
    return values


def _limit(name: str, value: Any) -> tuple[float, float, float]:
    values = np.atleast_1d(numbers(name, value)).ravel().tolist()
    if len(values) != 3 or not all(each >= 0 for each in values) or not math.isfinite(values[0] + values[1]):
        raise invalid(name, "request.limit", value)
    return values[0], values[1], values[2]


def _length(name: str, value: Any) -> dict[str, Any]:
    row = _mapping(name, value)
    for key in ("line", "from", "to", "length", "sd"):
        if key not in row:
            raise invalid(name, "error.missing", name=key)
    line, first, last = names(name, [row[key] for key in ("line", "from", "to")])
    figures = {key: number(f"{name} {key}", row[key], "not-negative") for key in ("length", "sd")}
    if row.get("temperature") is not None:
        figures["temperature"] = number(f"{name} temperature", row["temperature"])
    return {"line": line, "from": first, "to": last, **figures}


def _option(check: Callable[..., Any], **default: Any) -> Any:
    """Return the field of an option with the check of its value; without default it is None."""
    return field(metadata={"check": check}, **(default or {"default": None}))


@dataclass(frozen=True)
class Asked:
    """The options of a statement; lengths and areas in the block's linear unit.

    Attributes
    ----------
    standards
        Some of `plain`, `asprs-2023`, `nssda`, `vdi-2634`, `iso-19157`.
    classes
        Required accuracy classes: by `h` (horizontal), `v` (vertical), `3d`.
    area
        Area of the product; None: the hull of all adjusted points in plan.
    sd
        Standard deviations (east, north, up) of the survey of check points without their own; None: they are
        required.
    without
        Check points that additional figures exclude, with the reason of each.
    independent
        Whether the survey of check points is independent of the block: a declaration, `yes`, `same-base`,
        `no`.
    vegetated
        Check points in vegetation: their heights have separate figures (VVA).
    survey_common_sd
        Standard deviations of a common error of all check points, east, north, up (a base station, a
        levelling datum).
    survey_common_in_control
        Whether control has the same error: it then cancels in differences.
    language, text
        The language of the sentences, and sentences that replace those of the language.
    budgets
        Quantities with a budget of uncertainty, such as `point C08 z`; None: three are chosen.
    coverage
        Probability of expanded uncertainties.
    components
        The :class:`photogram.VarianceComponents` with this result, if weights were estimated.
    lengths
        Calibrated lengths: mappings of `line`, `from`, `to` (names of points), `length`, `sd`, `temperature`
        (deg C, optional).
    limit, expansion
        (A, K, B) of the limit A + K L <= B of their errors, and the thermal expansion of the object per
        kelvin for the reduction to 20 deg C.
    title, project, client, firm, surveyor, date
        The entries at the top of the page.
    """

    standards: tuple[str, ...] = _option(_several, default=("asprs-2023", "plain"))
    classes: Mapping[str, float] = _option(_by_name(POSITIVE), default_factory=dict)
    area: float | None = _option(POSITIVE)
    sd: tuple[float, ...] | None = _option(_three)
    without: Mapping[str, str] = _option(_by_name(_text), default_factory=dict)
    independent: str | None = None
    vegetated: frozenset[str] = _option(lambda *named: frozenset(_several(*named)), default=frozenset())
    survey_common_sd: tuple[float, ...] = _option(_three, default=(0.0, 0.0, 0.0))
    survey_common_in_control: bool = _option(truth_value, default=False)
    language: str = "en"
    text: Mapping[str, str] = _option(_by_name(_text), default_factory=dict)
    budgets: tuple[Any, ...] | None = _option(
        lambda name, value: (value,) if isinstance(value, str | Mapping) else tuple(_sequence(name, value))
    )
    coverage: float = _option(number, default=0.95)
    components: VarianceComponents | None = _option(partial(require_kind, kind=VarianceComponents))
    lengths: tuple[Mapping[str, Any], ...] = _option(
        lambda name, value: tuple(
            _length(f"{name}[{row}]", each) for row, each in enumerate(_sequence(name, value))
        ),
        default=(),
    )
    limit: tuple[float, float, float] | None = _option(_limit)
    expansion: float | None = _option(number)
    title: str = ""
    project: str = ""
    client: str = ""
    firm: str = ""
    surveyor: str = ""
    date: str = ""

    @classmethod
    def checked(cls, **options: Any) -> Asked:
        """Return the checked options; refuse unknown options and values that are not allowed."""
        known = {each.name: each for each in fields(cls)}
        for name in options:
            require_name("option of a statement", name, known)
        values = {name: value for name, value in options.items() if value is not None}
        checks = {name: known[name].metadata.get("check", _text) for name in values}
        asked = cls(**{name: checks[name](name, value) for name, value in values.items()})
        for standard in asked.standards:
            require_name("standard", standard, STANDARDS)
        for name in asked.classes:
            one_of("a class", name, ("h", "v", "3d"))
        if asked.independent is not None:
            one_of("independent", asked.independent, INDEPENDENT)
        if not 0 < asked.coverage < 1:
            raise invalid("coverage", "error.range", asked.coverage, low=0, high=1)
        if asked.expansion is not None and not math.isfinite(asked.expansion):
            raise invalid("expansion", "error.finite", asked.expansion)
        if "vdi-2634" in asked.standards and not asked.lengths:
            raise InputError(phrase("error.requires", name="vdi-2634", other=phrase("request.lengths")))
        for point, reason in asked.without.items():
            if not reason.strip():
                raise InputError(phrase("request.reason", point=point))
        return asked


def lengths_in(unit: str) -> float:
    """Return the length of a linear unit in metres; refuse unknown units."""
    require_name("unit of length", unit, METRES)
    return METRES[unit]


def length_of(given: str, unit: str, *, area: bool = False) -> float:
    """Return a length (`5cm`) or area (`12.5km2`) in the linear unit; refuse other texts."""
    found = _LENGTH.fullmatch(given)
    try:
        if found is None or not found[2] or bool(found[3]) != area:
            raise ValueError
        value = float(found[1])
    except ValueError:
        raise InputError(phrase("request.area" if area else "request.length", value=given)) from None
    factor = lengths_in(found[2]) / lengths_in(unit)
    return value * (factor**2 if area else factor)
