"""Budgets of uncertainty (GUM): the contributions of error sources to a variance.

With g the gradient of f and z = Q g, t_i = ~a_i z is the effect of one standard deviation of observation i,
and u^2(f) = s2 g' z = s2 sum of t_i^2 exactly, since Q N Q = Q. Weighted unknowns are also observations.
Correlated observations are decorrelated: only the sum over their group has a meaning. Squares t_i^2 are
summed by type, strip, camera, photo, point and parameter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import value_field
from photogram.arguments.objects import require_name
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import unknown_name
from photogram.network.block import Block
from photogram.network.rays import local_axes
from photogram.results import network_trial
from photogram.results.components import VarianceComponents
from photogram.results.covariance import Covariances, Item, adjusted, used_rows
from photogram.results.grouping import Grouping, Left, Probing, grouped, observables
from photogram.results.statement.request import invalid
from photogram.results.statement.texts import Texts
from photogram.show.page import decimals_of
from photogram.statistics.freedom import coverage_factor, joint_freedom, welch_satterthwaite
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Result

LARGEST = 5  # Listed single observations
EXACT = 5000  # Rows up to which degrees of freedom are computed without estimated components


@dataclass(frozen=True)
class Source:
    level: str  # `kind`, `strip`, `camera`, `photo`, `point`, `parameter` or `observation`
    # Its name; of parameters as a message, of observations a type, names and a component
    subject: str | Phrase | tuple[str, ...]
    number: int  # Number of rows
    # u_k^2 in the squared unit of the quantity, and its ratio to u^2
    contribution: float
    share: float
    # A priori standard deviation of an observation, and df/dl: units of the quantity for one of its unit
    sd: float = math.nan
    sensitivity: float = math.nan

    @property
    def name(self) -> str:
        """Its key; for a parameter its owner's name and its own name."""
        if not isinstance(self.subject, Phrase):
            return self.subject if isinstance(self.subject, str) else " ".join(self.subject)
        axis = self.subject.fields.get("axis", self.subject)
        return f"{self.subject.fields.get('name', '')} {axis.code.partition('.')[2]}".strip()

    @property
    def u(self) -> float:
        """u_k, in the unit of the quantity."""
        return math.sqrt(self.contribution)


@dataclass(frozen=True)
class Freedom:
    basis: str  # Basis of standard deviations: `given`, `unit variance`, `components`
    used: float  # Degrees of freedom for k; infinite for given weights
    common: float  # Degrees of freedom of the unit variance
    # nu_k = 2 / cov_kk of estimated components, by group
    of_kind: dict[str, float] = field(default_factory=dict)
    # 2 u^4 / (c' cov c), and u^4 / sum(u_k^4 / nu_k); NaN if not estimated
    joint: float = math.nan
    welch_satterthwaite: float = math.nan


@dataclass(frozen=True, eq=False)
class Budget:
    # Requested text, its phrase, unit of the value
    quantity: str
    subject: Phrase
    unit: str
    # The adjusted value and its standard deviation u
    value: float
    sd: float
    cofactor: float  # u^2 / s2
    sources: tuple[Source, ...]  # Groups of observations at all levels; those of the level `kind` sum to u^2
    largest: tuple[Source, ...]  # The five largest single observations
    freedom: Freedom  # Effective degrees of freedom
    k: float  # The coverage factor (Student, degrees of freedom cut to a whole number) and U = k u
    coverage: float  # The probability of U

    @property
    def expanded(self) -> float:
        """U = k u."""
        return self.k * self.sd

    def at(self, level: str) -> list[Source]:
        return [each for each in self.sources if each.level == level]


def budgets(
    result: Result,
    wanted: Sequence[Wanted],
    covariances: Covariances,
    *,
    coverage: float = 0.95,
    components: VarianceComponents | None = None,
) -> list[Budget]:
    """Return the budgets of quantities: one solution each, and one pass over all rows."""
    if not wanted:
        return []
    rows = Rows(result, covariances.suspects())
    items = list(dict.fromkeys(item for each in wanted for item in each.items))
    places = [[items.index(item) for item in each.items] for each in wanted]

    def together(*arrays: Any) -> Any:
        pairs = zip(wanted, places, strict=True)
        return np.array([each.function(*(arrays[place] for place in own)) for each, own in pairs])

    values = covariances.propagate(together, items)
    _, effects = covariances.influences(items, together)
    freedom_of, found = _freedoms(result, rows, components), []
    for each, value, t in zip(wanted, values.value.tolist(), effects, strict=True):
        squares = result.covariance_scale * t**2
        variance = float(squares.sum())
        share = 1.0 / variance if variance > 0 else 0.0
        freedom = freedom_of(squares, variance)
        sources = tuple(Source(*source, source[-1] * share) for source in rows.sources(squares))
        most = np.sort(np.argpartition(-squares, min(LARGEST, len(squares)) - 1)[:LARGEST])
        most = most[np.argsort(-squares[most], kind="stable")]
        most = most[squares[most] > 0]
        own_sd = rows.sd[most]
        numbers = squares[most], squares[most] * share, own_sd, t[most] / own_sd
        largest = tuple(
            Source("observation", rows.named(row), 1, *own)
            for row, own in zip(most.tolist(), np.transpose(numbers).tolist(), strict=True)
        )
        k = coverage_factor(coverage, freedom.used)
        sizes = value, math.sqrt(variance), variance / result.covariance_scale
        names = each.name, each.subject, each.unit
        found.append(Budget(*names, *sizes, sources, largest, freedom, k, coverage))
    return found


def budget_fields(texts: Texts, found: Budget) -> dict[str, Any]:
    """Return the fields of the sentence of a budget: value, sd (two digits), expanded uncertainty."""
    factor, unit = (1.0, found.unit) if found.unit != "rad" else (math.degrees(1.0), "°")
    sd = found.sd * factor
    decimals = decimals_of(np.array([sd]), unknown=6)
    numbers = (texts.number(each * factor, decimals) for each in (found.value, found.sd, found.expanded))
    fields = dict(
        zip(("value", "u", "expanded"), (f"{each} {unit}".rstrip() for each in numbers), strict=True)
    )
    k, p = texts.number(found.k, 2), texts.percent(found.coverage)
    return {"quantity": found.subject, **fields, "k": k, "p": p}


def _freedoms(
    result: Result, rows: Rows, components: VarianceComponents | None
) -> Callable[[Floats, float], Freedom]:
    """Return the function of the degrees of freedom of a variance that is the sum of (M,) squares."""
    known = math.isinf(result.freedom_of_scale)
    basis = "components" if components is not None else "given" if known else "unit variance"
    names, groups = list[str](), np.full(len(rows.sd), -1)
    covariance: Floats = np.zeros((0, 0))
    if components is not None or len(rows.sd) <= EXACT:
        grouping = grouped(observables(result), "kind")
        matrix = Left(result, grouping, Probing(exact=min(len(rows.sd), EXACT))).matrix()
        estimated = np.flatnonzero(np.diag(matrix)[: grouping.count] > 0)
        names = [kind_of(grouping.groups.names[k]) for k in estimated.tolist()]
        place = np.full(grouping.count + 1, -1)
        place[estimated] = np.arange(len(estimated))
        groups = place[rows.groups(grouping)]
        inverse = np.linalg.pinv(matrix[np.ix_(estimated, estimated)], hermitian=True)
        covariance = np.asarray(2.0 * inverse, dtype=np.float64)
    own, nu = groups >= 0, 2.0 / np.diag(covariance)

    def freedom(squares: Floats, variance: float) -> Freedom:
        contributions = np.bincount(groups[own], weights=squares[own], minlength=len(names))
        joint = welch = math.nan
        if len(nu) and variance > 0:
            given = max(variance - float(contributions.sum()), 0.0)
            joint = joint_freedom(contributions, covariance, given)
            u = np.sqrt(np.append(contributions, given))
            welch = welch_satterthwaite(u, np.append(nu, math.inf))
        common = result.degrees_of_freedom
        used = {"given": math.inf, "unit variance": common, "components": joint}[basis]
        return Freedom(basis, used, common, dict(zip(names, nu.tolist(), strict=True)), joint, welch)

    return freedom


PHOTOS = 100  # Listed photos with the largest contributions
UNKNOWN = network_trial.KINDS.index("unknown")
_PLURALS = dict(enumerate(("images", "control", "photo positions", "photo attitudes"))) | {5: "camera"}


class Rows(network_trial.BlockSuspects):
    """All M observations in G groups, images or control points, with names."""

    def __init__(self, result: Result, core: _photocore.NetworkSuspects) -> None:
        super().__init__(result.block, core)
        self.sd, self._sizes = core.deviations, np.diff(self.row_starts)
        block, seen, photo = result.block, observables(result), self.photos
        image, control = self.kinds == network_trial.IMAGE, self.kinds == network_trial.CONTROL
        strips, of_strip = seen.strips(), np.full(len(block.photo_ids), -1)
        for number, photos in enumerate(strips):
            of_strip[photos] = number
        names = [str(number + 1) for number in range(len(strips))]
        # Level, names, the name of each group or -1, number of listed names
        self._levels: list[tuple[str, Sequence[str], Indices, float]] = [
            ("kind", *self._types(), math.inf),
            *([("strip", names, np.where(image, of_strip[photo], -1), math.inf)] if len(names) > 1 else []),
            ("camera", list(seen.camera_names), np.where(image, seen.photo_cameras[photo], -1), math.inf),
            ("photo", block.photo_ids, np.where(image, photo, -1), PHOTOS),
            ("point", block.point_ids, np.where(control, self.points, -1), math.inf),
        ]

    def _types(self) -> tuple[list[str], Indices]:
        """Return the names of types, and the (G,) types of groups."""
        labels = {
            network_trial.OBSERVATION: [kind_of(each.label) for each in self.observations],
            UNKNOWN: [each.KIND for each in self.block.unknowns],
        }
        found: dict[str, int] = {}
        number = np.zeros(len(self), dtype=np.int64)
        for kind in np.unique(self.kinds).tolist():
            own, names = self.kinds == kind, labels.get(kind, _PLURALS.get(kind, ""))
            if isinstance(names, str):
                number[own] = found.setdefault(names, len(found))
            else:
                each = np.array([found.setdefault(name, len(found)) for name in names], dtype=np.int64)
                number[own] = each[self.subjects[own]]
        return list(found), number

    def sources(self, squares: Floats) -> Iterable[tuple[str, Phrase | str, int, float]]:
        """Return level, name, row number and contribution of sources, the smallest of long levels added."""
        sums = np.add.reduceat(squares, self.row_starts[:-1])
        for level, names, of, most in self._levels:
            own = of >= 0
            numbers = np.bincount(of[own], self._sizes[own], len(names)).astype(np.int64)
            totals = np.bincount(of[own], sums[own], len(names))
            there = np.flatnonzero(numbers)
            rest = there[:0]
            if len(there) > most:
                there, rest = np.split(there[np.argsort(-totals[there], kind="stable")], [int(most)])
            yield from ((level, names[k], int(numbers[k]), float(totals[k])) for k in there.tolist())
            if len(rest):
                yield level, "others", int(numbers[rest].sum()), math.fsum(totals[rest].tolist())
        several = len(self.block.camera_names) > 1
        for group in np.flatnonzero(self.kinds > network_trial.OBSERVATION).tolist():
            for row in self.rows(group).tolist():
                kind, *unknown, component = self.named(row)
                axis = Phrase(f"axis.{component}")
                alone = kind == "camera" and not several
                name = axis if alone else phrase("named.component", name=" ".join(unknown), axis=axis)
                yield "parameter", name, 1, float(squares[row])

    def named(self, row: int) -> tuple[str, ...]:
        """Return the type of a row, its items, and its component."""
        group = int(np.searchsorted(self.row_starts, row, "right")) - 1
        kind, subject = self.kind(group), int(self.subjects[group])
        block, component = self.block, int(self.components[row])
        if kind == "observation":
            observation = self.observations[subject]
            names = observation.components(geographic=block.geographic)
            return kind_of(observation.label), *observation.of, names[component].lower()
        if kind == "camera":
            parameters = block.cameras[subject].names if block.cameras else ("c",)
            return kind, block.camera_names[subject], parameters[component]
        if kind == "unknown":
            unknown = block.unknowns[subject]
            return unknown.KIND, unknown.name, unknown.components[component]
        images = ("column", "row") if block.image_unit == "px" else ("x", "y")
        axes: dict[str, Sequence[str]] = {"image": images, "attitude": network_trial.ANGLES}
        points, photos = self.touched(group)
        of = [*(block.photo_ids[row] for row in photos), *(block.point_ids[row] for row in points)]
        return kind, *of, axes.get(kind, ("x", "y", "z"))[component]

    def groups(self, grouping: Grouping) -> Indices:
        """Return (M,) the group of each row in a grouping; -1 for none."""
        kind, subject = (np.repeat(each, self._sizes) for each in (self.kinds, self.subjects))
        component = self.components.astype(np.int64)
        found = np.full(len(kind), -1)
        tables = {
            network_trial.IMAGE: grouping.images,
            network_trial.CONTROL: grouping.points,
            network_trial.POSITION: grouping.photos,
        }
        for own_kind, table in tables.items():
            own = kind == own_kind
            found[own] = table[subject[own], component[own]]
        own = kind == network_trial.ATTITUDE
        found[own] = grouping.photos[subject[own], 3 + component[own]]
        own = kind == network_trial.OBSERVATION
        of = np.array(self.block.observations.core_order, dtype=np.int64)
        found[own] = grouping.observations[of[subject[own]]]
        return found


def kind_of(label: str) -> str:
    return {"position": "gnss"}.get(label, label)


_AXES = {"x": 0, "y": 1, "z": 2, "e": 0, "n": 1, "h": 2, "east": 0, "north": 1, "height": 2}
"""Alternative names of coordinates, in addition to those of the block."""
PRINCIPAL = ("f", "fx", "c")  # Names of principal distances
TOGETHER = 256  # Number of points in a block of distances


@dataclass(frozen=True, eq=False)
class Wanted:
    name: str  # The requested name: `point C08 z`
    subject: Phrase  # Its name as a message
    items: tuple[Item, ...]  # Its arguments: see :class:`photogram.results.Covariances`
    function: Callable[..., Any]  # Its arguments are an array for each item, complex ones too
    unit: str  # Unit of its value; empty for plain numbers


def wanted(result: Result, asked: Any) -> Wanted:
    """Return a quantity by its words or by gradients of items; refuse unknown items and unused points."""
    if isinstance(asked, Mapping):
        return _linear(result, asked)
    words = asked.split() if isinstance(asked, str) else []
    if len(words) < 3:
        raise InputError(phrase("request.quantity", value=value_field(asked)))
    kind = words[0]
    if kind == "distance":
        return _distance(result, asked, _two(result.block, words[1:]))
    kinds = adjusted(result).things
    if kind not in kinds or kind == "step":
        raise InputError(unknown_name("kind of quantity", kind, kinds))
    name, component = " ".join(words[1:-1]), words[-1]
    things = kinds[kind]
    require_name(kind, name, things.ids)
    names = things.components[list(things.ids).index(name)]
    lower = [each.lower() for each in names]
    own = _AXES.get(component.lower()) if kind in ("point", "photo") and component not in names else None
    if own is None:
        if component.lower() not in lower:
            raise InputError(unknown_name(f"component of {kind} {name}", component, names))
        own = names.index(component) if component in names else lower.index(component.lower())
    if kind == "point":
        used_rows(result, [name])
    subject = Phrase(
        f"quantity.{kind}", {"of": phrase("named.component", name=name, axis=Phrase(f"axis.{component}"))}
    )
    return Wanted(asked, subject, ((kind, name),), lambda x: x[own], _unit(result, kind, name, own))


def chosen(result: Result, checks: Sequence[str]) -> list[Wanted]:
    """Return three quantities for the first page.

    The check point, or tie point, with the median standard deviation of height; the longest distance between
    these points; the principal distance if it was estimated.
    """
    block = result.block
    own = set(checks)
    rows = np.flatnonzero([name in own for name in block.point_ids])
    if not len(rows):
        rows = np.flatnonzero(result.used_points & (result.point_kinds == "pass"))
    found = []
    if len(rows):
        order = rows[np.argsort(result.point_sd[rows, 2], kind="stable")]
        found.append(wanted(result, f"point {block.point_ids[order[(len(order) - 1) // 2]]} z"))
    if len(rows) > 1:
        places, best, ends = local_axes(block).positions(result.point_positions[rows]), -1.0, (0, 0)
        for first in range(0, len(rows), TOGETHER):
            squares = ((places[first : first + TOGETHER, np.newaxis] - places) ** 2).sum(axis=2)
            row, column = np.unravel_index(int(np.argmax(squares)), squares.shape)
            if squares[row, column] > best:
                best, ends = float(squares[row, column]), (first + int(row), int(column))
        one, other = (block.point_ids[rows[end]] for end in sorted(ends))
        found.append(_distance(result, f"distance {one} {other}", (one, other)))
    for camera in result.cameras:
        free = [name for name, sd in zip(camera.names, camera.sd.tolist(), strict=True) if sd > 0]
        for name in PRINCIPAL:
            if name in free:
                return [*found, wanted(result, f"camera {camera.name} {name}")]
    return found


def _two(block: Block, words: Sequence[str]) -> tuple[str, str]:
    """Return the names of two points; names may contain blanks."""
    known = set(block.point_ids)
    for cut in range(1, len(words)):
        names = " ".join(words[:cut]), " ".join(words[cut:])
        if known.issuperset(names):
            return names
    lacking = next((word for word in words if word not in known), words[0])
    raise InputError(unknown_name("point", lacking, block.point_ids))


def _distance(result: Result, name: str, ends: tuple[str, str]) -> Wanted:
    used_rows(result, ends)
    if ends[0] == ends[1]:
        raise InputError(phrase("request.distance", point=ends[0]))
    spheroid = result.block.spheroid

    def between(x: Any, y: Any) -> Any:
        return (((geocentric(x) - geocentric(y)) ** 2).sum()) ** 0.5

    def geocentric(x: Any) -> Any:  # Also of complex numbers
        if spheroid is None:
            return x
        a, b = spheroid.a, spheroid.b
        sp, cp = np.sin(x[1]), np.cos(x[1])
        across = a / (1 - (1 - (b / a) ** 2) * sp**2) ** 0.5
        level = (across + x[2]) * cp
        return np.array([level * np.cos(x[0]), level * np.sin(x[0]), ((b / a) ** 2 * across + x[2]) * sp])

    items = tuple(("point", each) for each in ends)
    subject = Phrase("quantity.distance", {"of": " ".join(ends)})
    return Wanted(name, subject, items, between, result.block.linear_unit)


def _linear(result: Result, gradients: Mapping[Any, Any]) -> Wanted:
    items, parts = [], []
    for item, gradient in gradients.items():
        values = np.asarray(gradient, dtype=float)
        if not (isinstance(item, tuple) and len(item) == 2) or not np.isfinite(values).all():
            raise InputError(phrase("request.gradient", value=value_field((item, gradient))))
        width = len(adjusted(result).selected(item).values)
        if item[0] == "point":
            used_rows(result, [str(item[1])])
        if values.shape != (width,):
            raise invalid(f"gradient of {item[0]} {item[1]}", "error.count", count=width, actual=values.size)
        items.append(item)
        parts.append(values)
    if not items:
        raise InputError(phrase("request.gradient", value=value_field(gradients)))
    parts_of = [Phrase(f"quantity.{kind}", {"of": own}) for kind, own in items]
    subject = Phrase("quantity.linear", {"quantities": parts_of})
    return Wanted(
        str(subject), subject, tuple(items), lambda *x: sum(g @ v for g, v in zip(parts, x, strict=True)), ""
    )


def _unit(result: Result, kind: str, name: str, component: int) -> str:
    block = result.block
    if kind in ("point", "photo"):
        angle = component >= 3 or (block.geographic and component < 2)
        return "rad" if angle else block.linear_unit
    if kind == "camera":
        camera = next(each.camera for each in result.cameras if each.name == name)
        return camera.unit_of(camera.names[component])
    return next(each.units[component] for each in result.unknowns if each.name == name)
