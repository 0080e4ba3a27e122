"""Hypotheses: common errors of sets of observations, and errors of single ones.

Each has a test, an estimate, a minimal detectable bias (MDB), and the effect of an undetected error: internal
and external reliability (Baarda 1968). The core computes them (`photocore::network::hypotheses`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Set
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.results.network_trial import NamedSuspects
from photogram.show.forms import unit_written
from photogram.show.quantity import Axis, Quantity, Table, column, of_each, records
from photogram.statistics.findings import ALTERNATIVES, NEARLY, NEARLY_EXCHANGED
from photogram.words import Phrase, phrase

FEWEST = 2  # Smallest number of points that an undetected error moves
SHARE = 0.05  # Share of points that a notable undetected error moves in a plan
MARGIN = 0.75  # Standard deviations of an error beyond its estimate up to which the observations admit it
RARE = 0.1  # Plausible errors of a set that may remain undetected
OF_CAMERAS = frozenset(
    {
        *("camera-f", "camera-f-single", "camera-point", "camera-term", "readout-time"),
        "readout-time-columns",
        *("camera-affinity", "camera-radial", "camera-exchanged", "camera-size"),
    }
)
SHARES = ("gnss-next", "gnss-previous", "camera-exchanged")  # Their parameter is 0 or 1
DETECTED = 4.13  # Standard deviations of an error that a test detects: root of lambda0
WHOLE = 0.1  # Standard deviation of this parameter if it is 1
EXPLAINED = 0.15  # Least part of the excess of the sum of squares that a common error explains
ABSURD = 5.0  # Standard deviations of plausible sizes beyond which an error has no plausible size
ABSURD_PART, UNKNOWN_PART = 0.9, 0.7
"""Least parts of this excess that errors without a plausible size, or with an unknown one, explain."""
IMAGE_WIDTH = 10.0  # Plausible shifts of the images of a photo; no origin is farther away
LISTED = 10  # Rows of each table of documents
DIFFERS = 1.5  # Factor of standard deviations from which on a readout time differs between photos
SEPARABLE = 0.9  # Largest correlation of the tests of separable errors (Foerstner 1983)
NESTED = 1 - 1e-6  # Least correlation of an error with its special case
MAIN = 0.8  # Share of the square of an error above which one component stands for it
DETECTION = 0.001, 0.80  # Significance level and power of the MDB

DATUM = frozenset(
    {
        *("control-heights", "control-shift", "control-scale", "control-rotation", "control-set"),
        *("gnss-heights", "gnss-shift", "gnss-set", "gnss-half", "distance-scale", "scale"),
    }
)
"""Errors that only change the datum: assumptions, unless independent observations or check points test them.

Then sizes that these do not detect are graded, whatever their plausible size."""

SCALES = frozenset({"control-scale", "distance-scale", "scale"})

UNGRADED = frozenset({"bending", "control-bending"})
"""Undetected errors that are no reason for a reservation: terms of distortion, which bend a network, have
hypotheses of their own."""

RARE_ERRORS = frozenset(
    {
        *("attitude", "photo", "object-point", "camera", "unknown", "fixed-point"),
        *("camera-f-strip", "camera-f-half", "camera-size", "readout-time-columns"),
    }
)
"""Errors that are no reason for a reservation if nothing tests them, or before the observation: of single
photos and targets, of weighted parameters, principal distances of a strip or a flight, resized images, and a
readout by columns."""


@dataclass(frozen=True, eq=False)
class Effect:
    """Effects of an undetected error on points, by the most changed coordinates."""

    changes: Floats  # (d, 3) changes of the `drawn` points
    points: int  # beyond the limit
    others: float  # second largest change of points that the error does not belong to, standard deviations
    ratio: float  # largest change, standard deviations
    at: tuple[int, int] | None  # point and coordinate of this change
    change: float  # largest change in the linear unit


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """All h hypotheses of an adjusted network as columns: errors of s sets first.

    Rows with k columns have a NaN for each parameter that a hypothesis does not have.
    """

    code: NDArray[np.str_]
    index: Indices  # Set or camera; -1 for neither
    group: Indices  # Group of `suspects`; -1 for a set
    component: Indices  # -1 for all components
    rank: Floats
    statistic: Floats
    probability: Floats
    log_odds: Floats  # against "no error"
    by_checks: Floats  # Part of the log odds from check points
    estimate: Floats  # (h, k)
    redundancy: Floats
    mdb: Floats  # (h, k); NaN if an error of any size remains undetected
    bias_to_noise: Floats
    sets: Sequence[Mapping[str, Any]]  # Other facts of the s sets; see `NetworkTrial.hypotheses`
    correlations: Floats  # (s, s) of the scores of sets: largest canonical ones; 1 if one includes the other
    effects: Mapping[int, Effect]  # of some rows
    deviates: Mapping[int, float]  # Estimates of these errors in standard deviations, check points included
    sizes: Mapping[int, float]  # Errors with these effects in standard deviations; 0 if nothing tests them
    errors: Mapping[int, Floats]  # with these effects: the MDB, or the plausible size
    drawn: Indices  # (d,) points whose changes effects contain
    limit: float  # Standard deviations from which on an undetected error of a point counts
    suspects: NamedSuspects
    points: int  # number of adjusted points
    axes: Sequence[Axis]  # of the points
    times: str  # Unit of errors of times
    relative: Set[int]  # Rows of errors that only check points test
    single_odds: float  # Largest log odds of an error of a single observation, images among them
    excess: float  # of the weighted sum of squares over its degrees of freedom; 0 if the weight is estimated
    planned: bool = False  # Whether the observations are planned

    def undetected(self, row: int) -> float:
        """Return the share of plausible errors that remain undetected; 1 without a plausible size."""
        plausible = self.sets[row]["plausible"] if row < len(self.sets) else ()
        if np.isnan(self.mdb[row, 0]) or not plausible:
            return 1.0
        return math.erf(float(np.nanmax(np.abs(self.mdb[row, : len(plausible)]) / plausible)) / math.sqrt(2))

    def admitted(self, row: int) -> float:
        """Return the largest error that the observations admit, in units of the error with known effects.

        This is the estimate and `MARGIN` standard deviations; the plausible size if nothing tests the error,
        and the MDB before the observation.
        """
        size = 0.0 if self.planned else self.sizes[row]
        return (self.deviates[row] + MARGIN) / size if size else 1.0

    def moved(self, row: int) -> float:
        """Return the largest change that this error causes, in standard deviations."""
        return self.admitted(row) * self.effects[row].ratio

    def margin(self, row: int) -> float:
        """Return the margin from which on an error moves two other points beyond the limit.

        These are standard deviations beyond its estimate. Infinite if it is no reason for a reservation;
        negative infinity if nothing tests it.
        """
        code, others, size = self.code[row], self.effects[row].others, self.sizes[row]
        if code in UNGRADED or (code in DATUM and not size) or (code in SHARES and self.mdb[row, 0] < 1.0):
            return math.inf
        if self.planned or not size:
            is_notable = not self.planned or self.effects[row].points >= SHARE * self.points
            is_reason = is_notable and others > self.limit and code not in RARE_ERRORS
            return -math.inf if is_reason else math.inf
        return self.limit * size / others - self.deviates[row] if others else math.inf

    def is_harmful(self, row: int) -> bool:
        """Whether the largest error that the observations admit moves two other points beyond the limit."""
        return self.margin(row) < MARGIN

    def name(self, row: int) -> Phrase:
        """Return the name of a hypothesis."""
        code, index, group = str(self.code[row]), int(self.index[row]), int(self.group[row])
        if group < 0:
            fields: dict[str, Any] = {"set": max(index, 0) + 1, "parameters": self.sets[row]["parameters"]}
            if code == "photo":
                fields["photo"] = str(self.suspects.given.photo_ids[index])
            if code in ("object-point", "fixed-point"):
                fields["point"] = str(self.suspects.given.point_ids[index])
            if index >= 0 and code in OF_CAMERAS:
                cameras = getattr(self.suspects.given, "camera_names", ())
                other = phrase("hypothesis.camera", number=index + 1)
                fields["camera"] = cameras[index] if index < len(cameras) else other
            return Phrase(f"hypothesis.{code}", fields)
        named, component = self.suspects.name(group), int(self.component[row])
        if component < 0:
            return named
        rows = self.suspects.rows(group).tolist()
        axes = [self.suspects.row_name(k) for k in rows if self.suspects.components[k] == component]
        return phrase("named.parts", axes=axes, named=named)

    def _unit(self, row: int) -> str:
        """Return the unit of an error, behind a blank."""
        if self.code[row] == "observation":
            return f" {self.suspects.unit(int(self.suspects.row_starts[self.group[row]]))}".rstrip()
        units = {
            **dict.fromkeys(
                ("camera-f", "camera-f-strip", "camera-f-half", "camera-f-single", "camera-point", "photo"),
                self.suspects.given.image_unit,
            ),
            **dict.fromkeys(("attitude", "boresight", "control-rotation"), "rad"),
            **dict.fromkeys(("camera-term", "scale", "control-scale", "camera", "unknown"), ""),
            **dict.fromkeys(
                ("camera-affinity", "camera-radial", "camera-size", "distance-scale", *SHARES), ""
            ),
            **dict.fromkeys(("time-offset", "readout-time", "readout-time-columns"), self.times),
        }
        return f" {units.get(str(self.code[row]), unit_written(self.axes[2].small))}".rstrip()

    @property
    def harmful(self) -> list[int]:
        """Rows whose undetected errors move points too far, the worst first, without special cases."""
        rows = [row for row in self.effects if self.is_harmful(row)]
        rows.sort(key=lambda row: (self.sizes[row] > 0, -_rank(self.moved(row))))
        special = {other for row in rows for other in self._special_cases(row)}
        return [row for row in rows if row not in special]

    def _special_cases(self, row: int) -> list[int]:
        """Return rows of harmful errors of one parameter that an error of the same observations includes.

        Of equal errors, the first one includes the others. Tests of other observations may be equal although
        their effects differ.
        """
        if row >= len(self.sets):
            return []
        count = [len(own["parameters"]) for own in self.sets]
        source = [
            SCALES if code in SCALES else code.partition("-")[0] for code in self.code[: len(count)].tolist()
        ]
        nested = np.flatnonzero(self.correlations[row] >= NESTED).tolist()
        return [
            other
            for other in nested
            if source[other] == source[row] and count[other] == 1 and (count[row] > 1 or other > row)
            if other in self.effects and self.is_harmful(other)
        ]

    @property
    def worst(self) -> int | None:
        """The first of these rows, else the row with the largest effect, errors of the datum last."""
        rows = sorted(self.effects, key=lambda row: (self.code[row] in DATUM, -_rank(self.moved(row))))
        return next(iter([*self.harmful, *rows]), None)

    def unchecked(self) -> list[Phrase]:
        return [self.sentence(row) for row in self.harmful]

    def sentence(self, row: int) -> Phrase:
        """Return the message on an undetected error with a known effect, and on its special cases."""
        if not self.sizes[row]:
            error = phrase("unchecked.any", named=self.name(row))
        else:
            size, named = self._main_component(row)
            code = "unchecked.planned" if self.planned else "unchecked.size"
            percent = 100 * self.effects[row].points / self.points
            error = phrase(code, size=size, named=named, percent=percent, ratio=self.moved(row))
        special = len(self._special_cases(row))
        return phrase("unchecked.nested", error=error, n=special) if special else error

    def _main_component(self, row: int) -> tuple[str, Phrase]:
        """Return the size of the largest admitted error, and its name or that of its main component."""
        unit, error = self._unit(row), self.admitted(row) * self.errors[row]
        squares = np.square(error)
        parts = np.flatnonzero((self.group == self.group[row]) & (self.component >= 0))
        if len(parts) == len(error) and squares.max() > MAIN * squares.sum():
            main = int(squares.argmax())
            return f"{abs(error[main]):.3g}{unit}", self.name(int(parts[main]))
        return f"{math.sqrt(squares.sum()):.3g}{unit}", self.name(row)

    def assumed(self, least: int = 0) -> list[Phrase]:
        """Return untested observations that define the datum, or whose errors move `least` points or more."""
        untested = {
            str(self.code[row])
            for row in range(len(self.sets))
            if self.code[row] in DATUM
            and self.undetected(row) >= RARE
            and (not least or (row in self.effects and self.effects[row].points >= least))
        }
        # If other observations test them weakly, the undetected errors are named.
        graded = {str(self.code[row]) for row in self.harmful}
        sources = [("control-heights", "control-shift"), ("gnss-heights", "gnss-shift"), ("distance-scale",)]
        codes = [own[0] for own in sources if untested.intersection(own) and not graded.intersection(own)]
        return [self._assumption(code) for code in codes]

    def _assumption(self, code: str) -> Phrase:
        """Return the source of the datum, with the error of its heights that check points detect."""
        row = next((row for row in np.flatnonzero(self.code == code).tolist() if row in self.relative), None)
        if row is None:  # Also of control without heights
            return phrase(f"datum.{code}")
        size = DETECTED * math.sqrt(self.sets[row]["cofactors"][0])
        return phrase(f"datum.{code}.checks", size=f"{size:.2g}{self._unit(row)}")

    def common(self, rivals: float = -math.inf) -> list[int]:
        """Return rows of common errors that explain more than single values, the likeliest first."""
        odds, sets = self.log_odds, range(len(self.sets))
        found = [row for row in sets if self._is_significant(row)]
        found.sort(key=lambda row: -odds[row])
        # Tests of rivals do not include check points.
        if not found or odds[found[0]] < max(self.single_odds, rivals + self.by_checks[found[0]]):
            return []
        if self.statistic[found[0]] < EXPLAINED * self.excess:
            return []
        # Second-order terms of a large error exceed the odds between this error and its special case.
        special = [row for row in found if self.code[row] in SHARES and self._is_whole(row, found[0])]
        return special[:1] or [row for row in found if odds[row] > odds[found[0]] - math.log(ALTERNATIVES)]

    def inseparable(self, rivals: float = -math.inf) -> list[Phrase]:
        """Return a message on errors of sets whose tests hardly differ from that of the likeliest one."""
        found = self.common(rivals)
        if not found:
            return []
        own = self.correlations[found[0]]
        rows = np.flatnonzero(
            (own > SEPARABLE) & (own < NESTED) & (self.probability[: len(own)] < DETECTION[0])
        )
        others = [row for row in rows.tolist() if row not in found]
        others.sort(key=lambda row: -self.log_odds[row])
        names = [self.name(row) for row in others]
        fields = {"named": self.name(found[0]), "others": names, "correlation": SEPARABLE}
        return [Phrase("line.inseparable", fields)] if names else []

    def _is_whole(self, row: int, first: int) -> bool:
        """Whether a share is 1 and explains as much as the likeliest error."""
        is_one = abs(self.estimate[row, 0] - 1.0) < 3 * WHOLE
        nearly = NEARLY_EXCHANGED if self.code[row] == "camera-exchanged" else NEARLY
        return bool(is_one and self.statistic[row] > nearly * self.statistic[first])

    def _is_significant(self, row: int) -> bool:
        """Whether the test of a set rejects, and its error has a plausible size or explains nearly all.

        Errors without a plausible size (terms of distortion, targets) have a level together, as photos have.
        """
        plausible, level = self.sets[row]["plausible"], DETECTION[0]
        sizes = np.abs(self.estimate[row, : len(plausible)]) / plausible
        least = ABSURD_PART if (sizes > ABSURD).any() else 0.0
        if not plausible:
            level, least = level / sum(not each["plausible"] for each in self.sets), UNKNOWN_PART
        if self.code[row] == "photo":
            # Its pose nearly absorbs the shift: a large one explains gross errors of several images, too.
            level, least = level / len(self.suspects.given.photo_ids), ABSURD_PART
            if (sizes > IMAGE_WIDTH).any():
                return False
        return bool(self.probability[row] < level and self.statistic[row] >= least * self.excess)

    def odds(self, rivals: float = -math.inf) -> float:
        """Return the largest log odds of these errors, and of single ones."""
        return float(max(self.single_odds, rivals, *self.log_odds[self.common(rivals)[:1]]))

    def common_errors(self, rivals: float = -math.inf) -> list[Phrase]:
        """Return messages on these errors, the most likely first, then single errors that are as likely."""
        found, level = self.common(rivals), DETECTION[0]
        likely = self._likely(found[0]) if found else []
        singles = [row for row in likely if row >= len(self.sets) and self.probability[row] < level]
        return [self._common_error(row, found[0]) for row in (*found, *singles)]

    def _common_error(self, row: int, first: int) -> Phrase:
        named, odds = self.name(row), math.exp(self.log_odds[first] - self.log_odds[row])
        if row >= len(self.sets):
            return phrase("common.single", named=named, odds=odds)
        code = f"common.{'error' if row == first else 'alternative'}{'.checks' * (row in self.relative)}"
        return phrase(code, named=named, size=self._size(row), odds=odds)

    def _likely(self, first: int) -> list[int]:
        """Return rows of errors that are as likely as this one, the most likely first, one of each group."""
        odds = np.nan_to_num(self.log_odds, nan=-math.inf)
        likely = np.flatnonzero(odds > odds[first] - math.log(ALTERNATIVES))
        likely = likely[np.argsort(-odds[likely], kind="stable")]
        groups = np.where(self.group < 0, -1 - np.arange(len(odds)), self.group)[likely]
        once = np.sort(np.unique(groups, return_index=True)[1])
        return [int(row) for row in likely[once]]

    def _size(self, row: int) -> str:
        """Return the estimate of a set with its standard deviation; the largest of several.

        The readout time of a moving photo differs between photos that also rotate.
        """
        estimate, parameters = self.sets[row]["estimate"], self.sets[row]["parameters"]
        k = int(np.argmax(np.abs(estimate)))
        sd = math.sqrt(max(self.sets[row]["cofactors"][k * (len(estimate) + 1)], 0.0))
        between = self.sets[row]["sd_between_photos"] or 0.0
        sd = between if between > DIFFERS * sd else sd
        axis = f"{parameters[k]} " if len(estimate) > 1 else ""
        return f"{axis}{estimate[k]:.4g}{self._unit(row)} (sd {sd:.2g})"

    def of_checks(self) -> list[Phrase]:
        """Return single errors that explain differences of check points best, the most likely first."""
        first = int(np.nan_to_num(self.log_odds, nan=-math.inf).argmax()) if len(self.log_odds) else -1
        if first < len(self.sets) or self.probability[first] > DETECTION[0]:
            return []
        if not self.by_checks[first] > math.log(ALTERNATIVES):
            return []
        return [self._estimated(row) for row in self._likely(first)]

    def _estimated(self, row: int) -> Phrase:
        """Return the name of an error, with the estimate of a single component."""
        if np.count_nonzero(~np.isnan(self.estimate[row])) > 1:
            return self.name(row)
        size = f"{self.estimate[row, 0]:.3g}{self._unit(row)}"
        return phrase("common.error", named=self.name(row), size=size)

    @property
    def common_is_harmful(self) -> bool:
        """Whether the most likely of these errors moves a point beyond the limit."""
        row = next(iter(self.common()), None)
        if row is None or row not in self.effects:
            return False
        share = float(np.linalg.norm(self.sets[row]["estimate"]) / np.linalg.norm(self.errors[row]))
        return share * self.effects[row].ratio > self.limit

    @property
    def likely(self) -> Indices:
        """Rows of the most likely hypotheses, for documents."""
        return np.argsort(-self.log_odds, kind="stable")[:LISTED]

    @property
    def effective(self) -> Indices:
        """Rows of the largest effects of undetected errors, for documents."""
        ranks = np.zeros(len(self.code))
        ranks[[*self.effects]] = [_rank(effect.ratio) for effect in self.effects.values()]
        return np.argsort(-ranks, kind="stable")[:LISTED]

    def tests(self, rows: Indices | None = None) -> Table:
        """Return the declared table of the tests of all hypotheses, or of some."""
        rows = np.arange(len(self.code)) if rows is None else rows
        columns = [
            *self._names(rows),
            column("dimension", self.rank[rows], "Parameters", decimals=0),
            column("statistic", self.statistic[rows], "T", decimals=2),
            column("p", self.probability[rows], "p", figures=2),
            column("log_odds", self.log_odds[rows], "Log odds", decimals=1),
            self._written("estimate", rows, "Estimate"),
        ]
        note = "Log odds compare an error of a plausible size with no error."
        return Table("hypotheses", "Tested hypotheses", columns, note)

    def external_reliability(self, rows: Indices | None = None) -> Table:
        """Return the declared table of undetected errors and their effects, of all hypotheses or of some."""
        rows = np.arange(len(self.code)) if rows is None else rows
        none = Effect(np.empty((0, 3)), 0, 0, math.nan, None, math.nan)
        effects = [self.effects.get(row, none) for row in rows.tolist()]
        ids = self.suspects.given.point_ids
        at = [each.at and f"{self.axes[each.at[1]].name} of {ids[each.at[0]]}" for each in effects]
        columns = [
            *self._names(rows),
            column("redundancy", self.redundancy[rows], "Redundancy", decimals=4),
            self._written("mdb", rows, "MDB"),
            column("bias_to_noise", self.bias_to_noise[rows], "Moves up to, sd", decimals=1),
            of_each(effects, "points", name="points", head="Points moved", decimals=0),
            of_each(effects, "ratio", name="ratio", head="Largest effect, sd", decimals=1),
            of_each(effects, "change", name="change", head="Largest effect", figures=3),
            column("at", np.array([each or "" for each in at], dtype=object), "At", kind="name"),
        ]
        note = (
            f"MDB: the error that tests of the level {DETECTION[0]:g} detect in {100 * DETECTION[1]:.0f} of"
            f" 100 cases. Otherwise, points moved change by more than {self.limit:g} standard deviations."
        )
        if not self.planned:
            note += f" The verdict judges the estimate of an error and {MARGIN:g} standard deviations of it."
        return Table("external-reliability", "Undetected errors", columns, note)

    def document(self) -> list[dict[str, Any]]:
        """Return the rows of both tables of documents as JSON objects."""
        rows = np.union1d(self.likely, self.effective)
        tests, effects = (records(own(rows).columns) for own in (self.tests, self.external_reliability))
        return [{**test, **effect} for test, effect in zip(tests, effects, strict=True)]

    def _names(self, rows: Indices) -> list[Quantity]:
        names = [str(self.name(row)) for row in rows.tolist()]
        return [
            column("code", self.code[rows].astype(object), kind="name"),
            column("hypothesis", np.array(names, dtype=object), "Error", kind="name"),
        ]

    def _written(self, name: str, rows: Indices, head: str) -> Quantity:
        """Return a column of errors as texts with the names of parameters."""
        texts = []
        for row, values in zip(rows.tolist(), getattr(self, name)[rows].tolist(), strict=True):
            names = self.sets[row]["parameters"] if row < len(self.sets) else [""] * len(values)
            pairs = [pair for pair in zip(names, values, strict=False) if not math.isnan(pair[1])]
            texts.append(", ".join(f"{name} {value:.4g}".lstrip() for name, value in pairs))
        return column(name, np.array(texts, dtype=object), head, kind="name")


def _rank(ratio: float) -> float:
    """Return a size for sorting: rounding does not define an order of equal effects."""
    return round(math.log1p(ratio), 7)
