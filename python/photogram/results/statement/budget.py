"""Budgets of uncertainty (GUM): the contributions of error sources to a variance.

With g the gradient of f and z = Q g, t_i = ~a_i z is the effect of one standard deviation of observation i,
and u^2(f) = s2 g' z = s2 sum of t_i^2 exactly, since Q N Q = Q. Weighted unknowns are also observations.
Correlated observations are decorrelated: only the sum over their group has a meaning. Squares t_i^2 are
summed by type, strip, camera, photo, point and parameter.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.results.components import VarianceComponents
from photogram.results.covariance import Covariances
from photogram.results.group_sums import Left, Probing, observables
from photogram.results.grouping import Grouping, grouped
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    IMAGE,
    KINDS,
    OBSERVATION,
    POSITION,
    BlockSuspects,
    observations_of_core,
)
from photogram.results.statement.quantities import Wanted, component_of
from photogram.results.statement.texts import Texts
from photogram.show.page import decimals_of
from photogram.statistics.freedom import coverage_factor, joint_freedom, welch_satterthwaite
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Result

LARGEST = 5  # Listed single observations
EXACT = 5000  # Rows up to which degrees of freedom are computed without estimated components


@dataclass(frozen=True)
class Source:
    level: str  # `kind`, `strip`, `camera`, `photo`, `point` or `parameter`
    subject: Phrase | str  # Its name; of parameters as a message
    number: int  # Number of rows
    # u_k^2 in the squared unit of the quantity, and its ratio to u^2
    contribution: float
    share: float

    @property
    def name(self) -> str:
        """Its key; for a parameter its owner's name and its own name."""
        if isinstance(self.subject, str):
            return self.subject
        axis = self.subject.fields.get("axis", self.subject)
        return f"{self.subject.fields.get('name', '')} {axis.code.partition('.')[2]}".strip()

    @property
    def u(self) -> float:
        """u_k, in the unit of the quantity."""
        return math.sqrt(self.contribution)


@dataclass(frozen=True)
class Single:
    observation: tuple[str, ...]  # Kind, names, component
    sd: float  # A priori, in its unit
    sensitivity: float  # df/dl: units of the quantity for one unit of the observation
    # As in `Source`
    contribution: float
    share: float


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
    largest: tuple[Single, ...]  # The five largest single observations
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
    """Return the budgets of quantities: one solution each, and one pass over all rows.

    `components` are the variance components of the result, if weights were estimated. For errors see
    :meth:`Result.covariances`.
    """
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
    freedoms, found = _Freedoms(result, rows, components), []
    for each, value, t in zip(wanted, values.value.tolist(), effects, strict=True):
        squares = result.covariance_scale * t**2
        variance = float(squares.sum())
        share = 1.0 / variance if variance > 0 else 0.0
        freedom = freedoms.of(squares, variance)
        budget = Budget(
            quantity=each.name,
            subject=each.subject,
            unit=each.unit,
            value=value,
            sd=math.sqrt(variance),
            cofactor=variance / result.covariance_scale,
            sources=tuple(Source(*source, source[-1] * share) for source in rows.sources(squares)),
            largest=tuple(_largest(rows, squares, t, share)),
            freedom=freedom,
            k=coverage_factor(coverage, freedom.used),
            coverage=coverage,
        )
        found.append(budget)
    return found


def _largest(rows: Rows, squares: Floats, t: Floats, share: float) -> Iterable[Single]:
    most = np.sort(np.argpartition(-squares, min(LARGEST, len(squares)) - 1)[:LARGEST])
    for row in most[np.argsort(-squares[most], kind="stable")].tolist():
        if (own := float(squares[row])) > 0:
            yield Single(rows.named(row), float(rows.sd[row]), float(t[row] / rows.sd[row]), own, own * share)


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


class _Freedoms:
    """Effective degrees of freedom of variances, by the basis of standard deviations."""

    def __init__(self, result: Result, rows: Rows, components: VarianceComponents | None) -> None:
        self._common = result.degrees_of_freedom
        known = math.isinf(result.freedom_of_scale)
        self._basis = "components" if components is not None else "given" if known else "unit variance"
        self._names: list[str] = []
        self._of: Indices = np.full(len(rows), -1)
        self._covariance = np.zeros((0, 0))
        if components is None and len(rows) > EXACT:
            return
        grouping = grouped(observables(result), "kind")
        self._of = rows.groups(grouping)
        matrix = Left(result, grouping, Probing(exact=min(len(rows), EXACT))).matrix()
        names = list(grouping.groups.names)
        estimated = [k for k in range(len(names)) if matrix[k, k] > 0]
        self._names = [kind_of(names[k]) for k in estimated]
        place = np.full(len(names) + 1, -1)
        place[estimated] = np.arange(len(estimated))
        self._of = place[self._of]
        inverse = np.linalg.pinv(matrix[np.ix_(estimated, estimated)], hermitian=True)
        self._covariance = np.asarray(2.0 * inverse, dtype=np.float64)

    def of(self, squares: Floats, variance: float) -> Freedom:
        """Return the degrees of freedom of a variance that is the sum of (M,) squares."""
        own = self._of >= 0
        contributions = np.bincount(self._of[own], weights=squares[own], minlength=len(self._names))
        nu = 2.0 / np.diag(self._covariance)
        joint = welch = math.nan
        if len(nu) and variance > 0:
            given = max(variance - float(contributions.sum()), 0.0)
            joint = joint_freedom(contributions, self._covariance, given)
            u = np.sqrt(np.append(contributions, given))
            welch = welch_satterthwaite(u, np.append(nu, math.inf))
        used = {"given": math.inf, "unit variance": self._common, "components": joint}[self._basis]
        names = dict(zip(self._names, nu.tolist(), strict=True))
        return Freedom(self._basis, used, self._common, names, joint, welch)


PHOTOS = 100  # Listed photos with the largest contributions
_PLURALS = {IMAGE: "images", CONTROL: "control", POSITION: "photo positions", ATTITUDE: "photo attitudes"}


class Rows:
    """All M observations in G groups, images or control points, with names."""

    def __init__(self, result: Result, core: _photocore.NetworkSuspects) -> None:
        self.block = result.block
        self.suspects, self.sd = BlockSuspects(result.block, core), core.deviations
        self._starts: Indices = self.suspects.row_starts
        self._sizes: Indices = np.diff(self._starts)
        self._component = core.components
        self._observed = observations_of_core(self.block)
        self._kinds, self._of_kind = self._labels()
        # Images are the first groups.
        self._images = slice(0, int(np.count_nonzero(self.suspects.kinds == IMAGE)))
        seen = observables(result)
        self._cameras, self._camera_of_photo = list(seen.camera_names), seen.photo_cameras
        self._strips = np.full(len(self.block.photo_ids), -1)
        for number, photos in enumerate(seen.strips()):
            self._strips[photos] = number

    def __len__(self) -> int:
        return int(self._starts[-1])

    def _labels(self) -> tuple[list[str], Indices]:
        """Return the names of types, and the (G,) types of groups."""
        of_observation = [kind_of(each.label) for each in self._observed]
        of_unknown = [each.KIND for each in self.block.unknowns]
        found: dict[str, int] = {}
        number = np.zeros(len(self.suspects), dtype=np.int64)
        for kind in np.flatnonzero(np.bincount(self.suspects.kinds)).tolist():
            own = np.flatnonzero(self.suspects.kinds == kind)
            if kind in _PLURALS or KINDS[kind] == "camera":
                number[own] = found.setdefault(_PLURALS.get(kind, "camera"), len(found))
                continue
            labels = of_observation if kind == OBSERVATION else of_unknown
            each = np.array([found.setdefault(label, len(found)) for label in labels], dtype=np.int64)
            number[own] = each[self.suspects.subjects[own]]
        return list(found), number

    def sources(self, squares: Floats) -> Iterable[tuple[str, Phrase | str, int, float]]:
        """Return level, name, row number and contribution of sources, from (M,) squares."""
        sums, sizes = np.add.reduceat(squares, self._starts[:-1]), self._sizes
        yield from _sums("kind", self._kinds, self._of_kind, sums, sizes)
        own, rows, photo = sums[self._images], sizes[self._images], self.suspects.photos[self._images]
        strips = [str(number + 1) for number in range(int(self._strips.max(initial=-1)) + 1)]
        if len(strips) > 1:
            yield from _sums("strip", strips, self._strips[photo], own, rows)
        yield from _sums("camera", self._cameras, self._camera_of_photo[photo], own, rows)
        yield from _sums("photo", self.block.photo_ids, photo, own, rows, PHOTOS)
        control = self.suspects.kinds == CONTROL
        points = self.suspects.points[control]
        yield from _sums("point", self.block.point_ids, points, sums[control], sizes[control])
        yield from self._parameters(squares)

    def _parameters(self, squares: Floats) -> Iterable[tuple[str, Phrase | str, int, float]]:
        several = len(self.block.camera_names) > 1
        for group in np.flatnonzero(self.suspects.kinds > OBSERVATION).tolist():
            for row in self.suspects.rows(group).tolist():
                kind, *of, component = self.named(row)
                axis = Phrase(f"axis.{component}")
                alone = kind == "camera" and not several
                own = axis if alone else component_of(" ".join(of), axis)
                yield "parameter", own, 1, float(squares[row])

    def named(self, row: int) -> tuple[str, ...]:
        """Return the type of a row, its items, and its component."""
        group = int(np.searchsorted(self._starts, row, "right")) - 1
        kind, subject = int(self.suspects.kinds[group]), int(self.suspects.subjects[group])
        component = int(self._component[row])
        block = self.block
        if kind == IMAGE:
            axes = ("column", "row") if block.image_unit == "px" else ("x", "y")
            photo, point = block.image_photos[subject], block.image_points[subject]
            return "image", block.photo_ids[photo], block.point_ids[point], axes[component]
        if kind == CONTROL:
            return "control", block.point_ids[subject], "xyz"[component]
        if kind in (POSITION, ATTITUDE):
            own = ("x", "y", "z") if kind == POSITION else ("omega", "phi", "kappa")
            return KINDS[kind], block.photo_ids[subject], own[component]
        if kind == OBSERVATION:
            observation = self._observed[subject]
            names = observation.components(geographic=block.geographic)
            return kind_of(observation.label), *observation.of, names[component].lower()
        if KINDS[kind] == "camera":
            parameters = block.cameras[subject].names if block.cameras else ("c",)
            return "camera", block.camera_names[subject], parameters[component]
        unknown = block.unknowns[subject]
        return unknown.KIND, unknown.name, unknown.components[component]

    def groups(self, grouping: Grouping) -> Indices:
        """Return (M,) the group of each row in a grouping; -1 for none."""
        kind, subject = (
            np.repeat(each, self._sizes) for each in (self.suspects.kinds, self.suspects.subjects)
        )
        component = self._component.astype(np.int64)
        found = np.full(len(self), -1)
        tables = {IMAGE: grouping.images, CONTROL: grouping.points, POSITION: grouping.photos}
        for own_kind, table in tables.items():
            own = kind == own_kind
            found[own] = table[subject[own], component[own]]
        own = kind == ATTITUDE
        found[own] = grouping.photos[subject[own], 3 + component[own]]
        own = kind == OBSERVATION
        if own.any():
            numbers = {id(each): row for row, each in enumerate(self.block.observations)}
            of = np.array([numbers[id(each)] for each in self._observed], dtype=np.int64)
            found[own] = grouping.observations[of[subject[own]]]
        return found


def kind_of(label: str) -> str:
    return {"position": "gnss"}.get(label, label)


def _sums(
    level: str, names: Sequence[str], of: Indices, sums: Floats, sizes: Indices, most: int | None = None
) -> Iterable[tuple[str, Phrase | str, int, float]]:
    """Return sums over non-empty groups in order; or the largest, and the rest."""
    if of.min(initial=0) < 0:
        inside = of >= 0
        of, sums, sizes = of[inside], sums[inside], sizes[inside]
    numbers = np.bincount(of, weights=sizes, minlength=len(names)).astype(np.int64)
    totals = np.bincount(of, weights=sums, minlength=len(names))
    there = np.flatnonzero(numbers)
    if most is not None and len(there) > most:
        order = there[np.argsort(-totals[there], kind="stable")]
        rest = order[most:]
        others = ("others", int(numbers[rest].sum()), math.fsum(totals[rest].tolist()))
        there = order[:most]
    else:
        others = None
    values = zip(there.tolist(), numbers[there].tolist(), totals[there].tolist(), strict=True)
    yield from ((level, names[k], number, total) for k, number, total in values)
    if others is not None:
        yield level, *others
