"""Hypotheses: common errors of sets of observations, and errors of single ones.

Each has a test, an estimate, a minimal detectable bias (MDB), and the effect of an undetected error: internal
and external reliability (Baarda 1968). The core computes them (`photocore::network::hypotheses`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.strips import strips_of
from photogram.show.cells import unit_written
from photogram.show.quantity import Axis, Quantity, Table, records
from photogram.statistics.findings import Tested
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.network.block import Block
    from photogram.network.unadjusted import Given
    from photogram.results.network_trial import NamedSuspects, NetworkTrial
    from photogram.statistics.snooping.suspects import Tests

Facts = dict[str, Any]  # Additional facts for hypotheses; see `NetworkTrial.hypotheses`

LIMIT = 6.0  # Standard deviations from which on an undetected error of a point counts
SHARE = 0.05  # Share of points that an undetected error may move beyond the limit
FEWEST = 2  # Smallest number of other points that it moves
EFFECTS = 16  # Groups with computed effects: those of the largest bias-to-noise ratios
RARE = 0.1  # Plausible errors of a set that may remain undetected
DETECTED = 4.13  # Standard deviations of a check point from which on a change is detected: root of lambda0
ALTERNATIVES = 20.0  # Odds up to which less likely errors are alternatives
LENSES = frozenset(
    {"camera-term", "bending"}
)  # Errors that patterns of residuals reveal, or that have such a cause
LISTED = 10  # Rows of each table of documents
MAIN = 0.8  # Share of the square of an error above which one component stands for it
DETECTION = 0.001, 0.80  # Significance level and power of the MDB

DATUM = frozenset(
    {
        "control-heights",
        "control-shift",
        "control-scale",
        "control-rotation",
        "control-set",
        "gnss-heights",
        "gnss-shift",
        "gnss-set",
        "scale",
    }
)
"""Errors that only change the datum: assumptions, unless an independent source tests them."""

UNGRADED = frozenset({"attitude", "camera", "unknown", "bending"})
"""Undetected errors that are no reason for a reservation: of single photos, of weighted parameters; bending,
whose causes (terms of distortion) are hypotheses of their own."""

EXPLAINED = 0.15  # Least part of the excess of the sum of squares that a common error explains
MOST_SETS = 8  # Largest number of sets of positions or control that are tested


@dataclass(frozen=True)
class Effect:
    """Effects of an undetected error on points, by the most changed coordinates."""

    points: int  # beyond the limit
    others: int  # the same without the points that the error belongs to
    ratio: float  # largest change, standard deviations
    at: tuple[int, int] | None  # point and coordinate of this change
    change: float  # largest change in the linear unit
    checks: Sequence[tuple[float, float, float]] = ()  # Changes of check points


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An error of observations or fixed values: its test and its external reliability."""

    code: str
    group: int | None  # Type of a group of observations; None for a set
    index: int | None  # of the group, set or camera
    component: int | None  # None for all components
    parameters: Sequence[str]
    observations: int  # that depend on the parameters
    plausible: Sequence[float]  # Standard deviations before the data are used; empty if unknown
    rank: int
    statistic: float
    probability: float
    estimate: Sequence[float]
    cofactors: Sequence[float]
    redundancy: float
    noncentrality: float
    mdb: Sequence[float] | None
    error: Sequence[float] | None  # whose effect is reported: MDB or plausible size
    bias_to_noise: float
    effect: Effect | None
    log_odds: float  # against "no error"
    checked: bool  # Whether check points detect it

    @property
    def undetected(self) -> float:
        """Share of plausible errors that remain undetected; 1 without a plausible size."""
        if self.mdb is None or not self.plausible:
            return 1.0
        size = max(abs(d) / p for d, p in zip(self.mdb, self.plausible, strict=True))
        return math.erf(size / math.sqrt(2))

    def moves(self) -> bool:
        """Whether the estimated error moves a point beyond the limit."""
        if self.effect is None or self.error is None:
            return False
        share = float(np.linalg.norm(self.estimate) / np.linalg.norm(self.error))
        return share * self.effect.ratio > LIMIT

    def is_harmful(self, points: int) -> bool:
        """Whether an undetected error moves too many of a number of points."""
        if self.effect is None or self.checked or self.code in UNGRADED:
            return False
        if self.undetected < RARE or self.code in DATUM:
            return False
        return self.effect.others >= max(FEWEST, math.ceil(SHARE * points))


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All hypotheses of an adjusted network: errors of sets first."""

    every: Sequence[Hypothesis]
    suspects: NamedSuspects
    cameras: Sequence[str]  # names
    points: int  # number of adjusted points
    point_ids: Sequence[str]
    axes: Sequence[str]
    units: Mapping[str, str]  # Units of the errors of types without a length
    length: str  # Unit of all others
    single_odds: float  # Largest log odds of an error of a single observation, images among them
    excess: float  # of the weighted sum of squares over its degrees of freedom; 0 if the weight is estimated

    @cached_property
    def _group_of(self) -> dict[tuple[int, int], int]:
        kinds, subjects = self.suspects.kinds, self.suspects.subjects
        groups = np.flatnonzero(kinds != 0)
        return dict(
            zip(
                zip(kinds[groups].tolist(), subjects[groups].tolist(), strict=True),
                groups.tolist(),
                strict=True,
            )
        )

    def name(self, own: Hypothesis) -> Phrase:
        """Return the name of a hypothesis."""
        if own.group is None:
            fields: dict[str, Any] = {"set": (own.index or 0) + 1, "parameters": list(own.parameters)}
            if own.index is not None and own.code in (
                "camera-f",
                "camera-point",
                "camera-term",
                "readout-time",
            ):
                fields["camera"] = self.cameras[own.index] if own.index < len(self.cameras) else "1"
            return Phrase(f"hypothesis.{own.code}", fields)
        group = self._group_of[own.group, own.index or 0]
        named = self.suspects.name(group)
        if own.component is None:
            return named
        rows = self.suspects.rows(group).tolist()
        axes = [self.suspects.row_name(k) for k in rows if self.suspects.components[k] == own.component]
        return phrase("named.parts", axes=axes, named=named)

    def unit(self, code: str) -> str:
        """Return the unit of the errors of a type, behind a blank."""
        return self.units.get(code, self.length)

    @property
    def harmful(self) -> list[Hypothesis]:
        """Hypotheses whose undetected errors move too many points, the worst first."""
        found = [each for each in self.every if each.is_harmful(self.points)]
        return sorted(
            found, key=lambda each: (each.mdb is not None, -each.effect.ratio if each.effect else 0)
        )

    def unchecked(self) -> list[Phrase]:
        """Return messages on these errors, the worst first."""
        messages = []
        for each in self.harmful:
            effect = each.effect or Effect(0, 0, 0.0, None, 0.0)
            if each.mdb is None:
                messages.append(phrase("unchecked.any", named=self.name(each)))
                continue
            size, named = self._main_component(each, each.mdb)
            share = 100 * effect.points / self.points
            fields = {"size": size, "named": named, "percent": share, "ratio": effect.ratio}
            messages.append(Phrase("unchecked.mdb", fields))
        return messages

    def _main_component(self, own: Hypothesis, mdb: Sequence[float]) -> tuple[str, Phrase]:
        """Return the size of an error, and its name if one component is nearly all of it."""
        unit = self.unit(own.code)
        squares = np.square(mdb)
        parts = [each for each in self.every if each.component is not None]
        of_group = [each for each in parts if (each.group, each.index) == (own.group, own.index)]
        if len(of_group) == len(mdb) and squares.max() > MAIN * squares.sum():
            main = int(squares.argmax())
            return f"{abs(mdb[main]):.3g}{unit}", self.name(of_group[main])
        if len(mdb) == 1:
            return f"{abs(mdb[0]):.3g}{unit}", self.name(own)
        return f"{math.sqrt(squares.sum()):.3g}{unit}", self.name(own)

    @property
    def assumptions(self) -> list[Phrase]:
        """Names of untested observations that define the datum."""
        untested = {each.code for each in self.every if each.code in DATUM and each.undetected >= RARE}
        sources = [("control-heights", "control-shift"), ("gnss-heights", "gnss-shift")]
        codes = [codes[0] for codes in sources if untested.intersection(codes)]
        return [phrase(f"datum.{code}") for code in codes]

    def common(self, rivals: float = -math.inf) -> list[Hypothesis]:
        """Return detected errors of sets that explain more than any single value, the most likely first.

        `rivals` are the largest log odds of an error of a fixed value.
        """
        found = [
            each
            for each in self.every
            if each.group is None and each.code not in LENSES and each.probability < DETECTION[0]
        ]
        found.sort(key=lambda each: -each.log_odds)
        if not found or found[0].log_odds < max(self.single_odds, rivals):
            return []
        if found[0].statistic < EXPLAINED * self.excess:
            return []
        return [each for each in found if each.log_odds > found[0].log_odds - math.log(ALTERNATIVES)]

    def common_errors(self, rivals: float = -math.inf) -> list[Phrase]:
        """Return messages on these errors, the most likely first."""
        found = self.common(rivals)
        return [
            phrase(
                "common.error" if each is found[0] else "common.alternative",
                named=self.name(each),
                size=_size(each, self.unit(each.code)),
                odds=math.exp(found[0].log_odds - each.log_odds),
            )
            for each in found
        ]

    @property
    def common_is_harmful(self) -> bool:
        """Whether the most likely of these errors moves a point beyond the limit."""
        return any(each.moves() for each in self.common()[:1])

    @property
    def likely(self) -> Sequence[Hypothesis]:
        """The most likely hypotheses, for documents."""
        return sorted(self.every, key=lambda each: -each.log_odds)[:LISTED]

    @property
    def effective(self) -> Sequence[Hypothesis]:
        """The hypotheses with the largest effects of undetected errors, for documents."""
        return sorted(self.every, key=lambda each: -each.effect.ratio if each.effect else 0.0)[:LISTED]

    def tests(self, some: Sequence[Hypothesis]) -> Table:
        """Return the declared table of the tests of some hypotheses."""
        columns = [
            *self._names(some),
            _column("dimension", [each.rank for each in some], "Parameters", decimals=0),
            _column("statistic", [each.statistic for each in some], "T", decimals=2),
            _column("p", [each.probability for each in some], "p", figures=2),
            _column("log_odds", [each.log_odds for each in some], "Log odds", decimals=1),
            _column("estimate", [_written(each, each.estimate) for each in some], "Estimate", kind="name"),
        ]
        note = "Log odds compare an error of a plausible size with no error."
        return Table("hypotheses", "Tested hypotheses", columns, note)

    def external_reliability(self, some: Sequence[Hypothesis]) -> Table:
        """Return the declared table of undetected errors of some hypotheses, and of their effects."""
        effects = [each.effect or Effect(0, 0, math.nan, None, math.nan) for each in some]
        worst = [
            "" if each.at is None else f"{self.axes[each.at[1]]} of {self.point_ids[each.at[0]]}"
            for each in effects
        ]
        columns = [
            *self._names(some),
            _column("redundancy", [each.redundancy for each in some], "Redundancy", decimals=4),
            _column("mdb", [_written(each, each.mdb or ()) for each in some], "MDB", kind="name"),
            _column("bias_to_noise", [each.bias_to_noise for each in some], "Moves up to, sd", decimals=1),
            _column("points", [each.points for each in effects], "Points moved", decimals=0),
            _column("ratio", [each.ratio for each in effects], "Largest effect, sd", decimals=1),
            _column("change", [each.change for each in effects], "Largest effect", decimals=3),
            _column("at", worst, "At", kind="name"),
        ]
        note = (
            f"MDB: the error that tests of the level {DETECTION[0]:g} detect in {100 * DETECTION[1]:.0f} of"
            f" 100 cases. Otherwise, points moved change by more than {LIMIT:g} standard deviations."
        )
        return Table("external-reliability", "Undetected errors", columns, note)

    def document(self) -> list[dict[str, Any]]:
        """Return the rows of both tables of documents as JSON objects."""
        listed = {id(each) for each in (*self.likely, *self.effective)}
        some = [each for each in self.every if id(each) in listed]
        tables = self.tests(some), self.external_reliability(some)
        tests, effects = (records(table.columns) for table in tables)
        return [{**test, **effect} for test, effect in zip(tests, effects, strict=True)]

    def _names(self, some: Sequence[Hypothesis]) -> list[Quantity]:
        return [
            _column("code", [each.code for each in some], "", kind="name"),
            _column("hypothesis", [str(self.name(each)) for each in some], "Error", kind="name"),
        ]


def _column(name: str, values: Any, head: str, **more: Any) -> Quantity:
    return Quantity(
        np.array(values, dtype=object if more.get("kind") == "name" else float),
        name=name,
        member=name,
        head=head,
        **more,
    )


def _size(own: Hypothesis, unit: str) -> str:
    """Return an estimate with standard deviation; the largest of several."""
    k = int(np.argmax(np.abs(own.estimate)))
    sd = math.sqrt(max(own.cofactors[k * (len(own.estimate) + 1)], 0.0))
    axis = f"{own.parameters[k]} " if len(own.estimate) > 1 else ""
    return f"{axis}{own.estimate[k]:.4g}{unit} (sd {sd:.2g})"


def _written(own: Hypothesis, values: Sequence[float]) -> str:
    names = own.parameters or [""] * len(values)
    return ", ".join(f"{name} {value:.4g}".lstrip() for name, value in zip(names, values, strict=False))


def hypotheses(
    trial: NetworkTrial,
    tests: Tests,
    facts: Facts,
    given: Given,
    axes: Sequence[Axis],
    standing: tuple[float, float],
    *,
    known: bool,
) -> Hypotheses:
    """Return the hypotheses of an adjusted network with the `tests` of its observations.

    `axes` are those of its points, `standing` the sum of squares and the degrees of freedom. `known` is
    whether the unit weight is known.
    """
    suspects = trial.suspects
    estimated = None if known else standing
    core, check_sd = {**NO_FACTS, **facts}, facts.get("check_sd")
    core.pop("check_sd", None)
    timed = core.pop("timed", False)
    rows, _ = trial.core.hypotheses(
        **core, estimated=estimated, detection=DETECTION, limit=LIMIT, effects=EFFECTS
    )
    numbers = Counter((row["code"], row["component"] is None) for row in rows)
    every = []
    for row in rows:
        effect = None if row["effect"] is None else Effect(*row["effect"])
        absurd = sum((d / p) ** 2 for d, p in zip(row["estimate"], row["plausible"], strict=False))
        count = numbers[row["code"], row["component"] is None]
        k, statistic = max(len(row["estimate"]), 1), row["statistic"]
        if estimated is not None:
            omega, freedom = estimated
            statistic = -freedom * math.log(max(1 - statistic / omega, 1e-300))
        odds = float(_log_odds(statistic, k, max(row["observations"], k + 1), count)) - absurd / 2
        checked = _is_checked(effect, check_sd)
        every.append(Hypothesis(**{**row, "effect": effect}, log_odds=odds, checked=checked))
    length, image = unit_written(axes[2].small), given.image_unit
    units = {"camera-f": f" {image}", "camera-point": f" {image}"}
    units |= dict.fromkeys(("attitude", "boresight", "control-rotation"), " rad")
    units |= dict.fromkeys(("camera-term", "scale", "control-scale", "camera", "unknown", "observation"), "")
    units |= dict.fromkeys(("time-offset", "readout-time"), " s" if timed else " exposures")
    images = (suspects.kinds == 0) & tests.active
    largest = float(np.nanmax(tests.statistic[images], initial=0.0))
    of_images = float(_log_odds(largest, 2, 3, max(int(np.count_nonzero(images)), 1)))
    return Hypotheses(
        every,
        suspects=suspects,
        cameras=getattr(given, "camera_names", ()),
        points=len(np.unique(suspects.points[images])),
        point_ids=given.point_ids,
        axes=[axis.name for axis in axes],
        units=units,
        length=f" {length}",
        excess=max(standing[0] - standing[1], 0.0) if known else 0.0,
        single_odds=max([of_images, *(each.log_odds for each in every if each.group is not None)]),
    )


def _is_checked(effect: Effect | None, check_sd: Floats | None) -> bool:
    """Whether an error moves a check point by an amount that its test detects."""
    if effect is None or check_sd is None or not len(effect.checks):
        return False
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.abs(np.array(effect.checks)) / check_sd
    return bool((np.nan_to_num(ratios, posinf=0.0) > DETECTED).any())


def largest_odds(tests: Iterable[Tested]) -> float:
    """Return the largest log odds of an error that tests of single values have."""
    found = [-math.inf]
    for each in tests:
        values = np.square(each.values) if each.statistic == "w" else np.asarray(each.values)
        k = np.asarray(each.dimension, dtype=np.float64)
        odds = _log_odds(values, k, k + 1, max(int(np.count_nonzero(~np.isnan(values))), 1))
        found.append(float(np.nanmax(odds, initial=-math.inf)))
    return max(found)


def _log_odds(statistic: ArrayLike, k: ArrayLike, observations: ArrayLike, count: int) -> Floats:
    """Return T/2 - k/2 ln n_h - ln N_h: the log odds of an error of any size against no error."""
    half = np.asarray(k) / 2 * np.log(observations)
    return np.asarray(np.asarray(statistic) / 2 - half - math.log(count))


NO_FACTS: Facts = {
    "velocities": np.empty((0, 3)),
    "times": [],
    "position_sets": [],
    "control_sets": [],
    "readouts": [],
    "widths": [],
    "checks": [],
    "centre": None,
}


def block_facts(block: Block, places: Floats) -> Facts:
    """Return facts for hypotheses on a block: velocities, sets, sizes of images.

    `places` are the (P, 3) adjusted positions of photos.
    """
    count = len(block.photo_ids)
    cameras = np.zeros(count, dtype=np.int64) if block.photo_cameras is None else block.photo_cameras
    facts: Facts = {"widths": [], "readouts": []}
    of_images = cameras[block.image_photos]
    low, high = (np.full((max(len(block.cameras), 1), 2), end) for end in (math.inf, -math.inf))
    np.minimum.at(low, of_images, block.image_xy)
    np.maximum.at(high, of_images, block.image_xy)
    for camera, (width, height) in enumerate((high - low).tolist()):
        facts["widths"].append(width if width > 0 else math.nan)
        digital = bool(block.cameras) and block.cameras[camera].unit == "px" and height > 0
        middle = float(low[camera, 1] + high[camera, 1]) / 2
        facts["readouts"].append([0.0, 1 / height, -middle / height] if digital else None)
    if block.geographic:
        return facts
    seconds = np.full(count, math.nan)
    row = {name: k for k, name in enumerate(block.photo_ids)}
    for each in block.observations:
        if each.KIND == "position" and each.photos and each.photos[0] in row:
            seconds[row[each.photos[0]]] = each.time  # type: ignore[attr-defined]
    timed = bool(np.isfinite(seconds).all() and np.ptp(seconds) > 0)
    times = seconds if timed else np.arange(count, dtype=np.float64)
    velocities, sets = np.full((count, 3), math.nan), np.full(count, -1)
    strips = strips_of(places) if count > 1 else []
    for number, strip in enumerate(strips):
        sets[strip] = number
        if len(strip) > 1 and (np.diff(times[strip]) > 0).all():
            velocities[strip] = np.gradient(places[strip], times[strip], axis=0)
    facts["velocities"] = velocities
    if count > 1:
        # Without times, the order of the photos is used.
        facts |= {"times": times.tolist(), "timed": timed}
    if 1 < len(strips) <= MOST_SETS:
        facts["position_sets"] = sets.tolist()
    control = np.isfinite(block.point_sd).any(axis=1)
    _, kinds, sizes = np.unique(block.point_sd, axis=0, return_inverse=True, return_counts=True)
    own = np.unique(kinds[control])
    if 1 < len(own) <= MOST_SETS and (sizes[own] > 1).all():
        set_of = {int(kind): k for k, kind in enumerate(own)}
        facts["control_sets"] = [set_of.get(kind) for kind in kinds.tolist()]
    return facts
