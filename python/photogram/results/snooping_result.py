"""The result of data snooping: network without gross errors, log, and exchanged names.

For a point with its rays, one of them suspected, T is the minimum of the sum of squared residuals in standard
deviations. Given coordinates are included, and photos are fixed at their adjustment by the other
observations. Images i and j of a photo are exchanged if T of both points with the given names is larger than

    T(exchanged) + 2 ln(k / 0.0001),    T(exchanged) < 3 max(1, s^2) chi2(0.999; m)

(:mod:`photogram.statistics.likelihood`). The factor 3 accounts for the uncertainty of photos.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.io import json
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.directions import seen_without_lenses
from photogram.network.rays import Rays, counts_of, meet, sums_of
from photogram.results.network import AdjustedNetwork
from photogram.results.network_trial import NamedSuspects, Standing
from photogram.results.snooping_log import Outcome, Removal, Rival, disputes
from photogram.results.snooping_options import SnoopOptions
from photogram.show.methods import Brief, Documented, Rows, few
from photogram.show.page import Document, Fact, Facts, Part, Remarks, Section, about
from photogram.show.quantity import Quantity, Table, members, members_of_each, of_each, records
from photogram.statistics.findings import Removed
from photogram.statistics.likelihood import are_exchanged
from photogram.statistics.limits import global_test
from photogram.words import Phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram.statistics.verdict import Verdict

MOST = 40  # Largest number of excluded images of a photo
UNCERTAIN = 3.0  # Factor of T for errors of photos, which are fixed here
STEPS = 4  # Gauss-Newton steps from the intersection of the rays
HELD = 1e-6  # Standard deviation of fixed coordinates, relative to an image at the distance of the object


@dataclass(frozen=True)
class Exchange:
    photos: tuple[str, ...]  # several if the images do not determine the photo
    points: tuple[str, str]
    # as_named, exchanged: T of both points with the given names, and with exchanged names on the first of the
    # photos
    as_named: float
    exchanged: float
    dimension: int  # degrees of freedom of both

    @property
    def sentence(self) -> Phrase:
        one, other = self.points
        photos = [Phrase("named.photo", {"photo": photo.removeprefix("photo ")}) for photo in self.photos]
        return Phrase("exchange", {"one": one, "other": other, "photos": photos})

    @property
    def probable(self) -> Phrase:
        """The sentence for a network that was not adjusted without it."""
        one, other = self.points
        return Phrase("exchange.probable", {"one": one, "other": other, "photos": list(self.photos)})

    @property
    def reason(self) -> Phrase:
        fields = {"named": self.as_named, "exchanged": self.exchanged, "dimension": self.dimension}
        return Phrase(f"exchange.reason{'' if math.isfinite(self.as_named) else '.apart'}", fields)


def exchanged_names(block: Block, used: Bools, variance: float = 1.0) -> list[Exchange]:
    """Find exchanged names among the images that a network with `variance` of unit weight does not use."""
    plain, seen = seen_without_lenses(block)
    mounted = {each.photo for each in block.mounts}
    on_frames = np.array([name in mounted for name in block.photo_ids])
    pairs = _pairs(plain, used[seen], on_frames)
    if not pairs:
        return []
    fit = _Fit(plain, used[seen])
    wanted = sorted({(i, k) for pair in pairs for i in pair for k in pair})
    found = dict(zip(wanted, fit.of(wanted), strict=True))
    passing: dict[tuple[int, int], list[tuple[float, float, int, int]]] = {}
    for i, j in pairs:
        as_named = found[i, i][0] + found[j, j][0]
        left = found[i, j][0] + found[j, i][0]
        dimension = found[i, j][1] + found[j, i][1]
        better = all(found[a, b][0] < found[a, a][0] for a, b in ((i, j), (j, i)))
        if better and are_exchanged(
            as_named, left, dimension, pairs=len(pairs), variance=max(variance, 1.0), uncertain=UNCERTAIN
        ):
            one, other = sorted((int(plain.image_points[i]), int(plain.image_points[j])))
            photo = int(plain.image_photos[i])
            passing.setdefault((one, other), []).append((left, as_named, dimension, photo))
    # The most certain pairs first; each point is in one pair only.
    exchanges, taken = list[Exchange](), set[int]()
    for points, ways in sorted(passing.items(), key=lambda each: min(each[1])[0] - min(each[1])[1]):
        if taken.isdisjoint(points):
            taken |= set(points)
            left, as_named, dimension, _ = min(ways)
            photos = [plain.photo_ids[photo] for *_, photo in sorted(ways)]
            names = plain.point_ids[points[0]], plain.point_ids[points[1]]
            exchanges.append(Exchange(tuple(photos), names, as_named, left, dimension))
    return exchanges


def _pairs(block: Block, used: Bools, on_frames: Bools) -> list[tuple[int, int]]:
    """Return pairs of excluded images on the same photo."""
    out = np.flatnonzero(~used & ~on_frames[block.image_photos])
    out = out[np.argsort(block.image_photos[out], kind="stable")]
    bounds = np.flatnonzero(np.diff(block.image_photos[out], prepend=-1, append=-1))
    return [
        pair
        for first, last in pairwise(bounds.tolist())
        if last - first <= MOST
        for pair in combinations(out[first:last].tolist(), 2)
        if block.image_points[pair[0]] != block.image_points[pair[1]]
    ]


class _Fit:
    def __init__(self, block: Block, used: Bools) -> None:
        self.block, self.used = block, used
        self.rays = Rays.of(block)
        self.order = np.argsort(block.image_points, kind="stable")
        counts = np.bincount(block.image_points, minlength=len(block.point_ids))
        self.start = np.concatenate([[0], np.cumsum(counts)])

    def of(self, wanted: list[tuple[int, int]]) -> list[tuple[float, int]]:
        """Return T and its dimension for points of images, each with the ray of another image."""
        of_images = [np.append(self._others(image), place) for image, place in wanted]
        sizes = [len(each) for each in of_images]
        problem, rows = np.repeat(np.arange(len(wanted)), sizes), np.concatenate(of_images)
        points = self.block.image_points[[image for image, _ in wanted]]
        squares = self._squares(problem, rows, points)
        held = np.isfinite(self._prior_sd(points)).sum(axis=1)
        dimensions = 2 * np.array(sizes) + held - 3
        return list(zip(squares.tolist(), dimensions.tolist(), strict=True))

    def _others(self, image: int) -> Indices:
        """Return the other images of a point, on other photos: used ones, if any."""
        block, point = self.block, self.block.image_points[image]
        own = self.order[self.start[point] : self.start[point + 1]]
        own = own[block.image_photos[own] != block.image_photos[image]]
        good = own[self.used[own]]
        found: Indices = good if len(good) else own
        return found

    def _prior_sd(self, points: Indices) -> Floats:
        """(n, 3) standard deviations of given coordinates; not used in geographic space."""
        sd = self.block.point_sd[points]
        if self.block.geographic:
            return np.full(sd.shape, np.inf)
        return np.where(np.isfinite(self.block.point_positions[points]), sd, np.inf)

    def _squares(self, own: Indices, rows: Indices, points: Indices) -> Floats:
        """(n,) minimum sums of squares of images `rows` of points `own`; infinite behind cameras."""
        block, rays, count = self.block, self.rays, len(points)
        sd = block.image_sd[rows]

        def total(values: Floats) -> Floats:
            return sums_of(own, values, count)

        across, right = rays.equations()
        position = meet(total(across[rows]), total(right[rows]), counts_of(own, count))
        # The axes are those of the block if priors are used, and a component may be unknown.
        given = block.point_positions[points] - self.rays.axes.origin
        prior_sd = self._prior_sd(points)
        held = np.isfinite(prior_sd)
        known = held.all(axis=1)
        position[known] = given[known]
        there = np.isfinite(position[own, 0])
        if not there.any():
            return np.full(count, np.inf)
        photos = block.image_photos[rows]
        reach = np.median(np.linalg.norm(position[own] - rays.centres[photos], axis=1)[there])
        distances = np.abs(block.known_distances("exchanged names")[photos])
        least = HELD * float(np.median(sd)) * reach / float(np.median(distances))
        weight = np.where(held, 1 / np.maximum(np.where(held, prior_sd, 1.0), least) ** 2, 0.0)
        squares = np.full(count, np.nan)
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                residuals, in_front = rays.residuals(position[own], rows)
                residuals = residuals / sd
                partials = rays.partials(position[own], rows) / sd[:, :, np.newaxis]
                apart = np.where(held, given - position, 0.0)
                squares = total((residuals**2).sum(axis=1, keepdims=True))[:, 0]
                squares = squares + (weight * apart**2).sum(axis=1)
                normal = total(np.einsum("mki,mkj->mij", partials, partials))
                normal[:, range(3), range(3)] += weight
                vector = total(np.einsum("mki,mk->mi", partials, residuals)) + weight * apart
                sound = np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(vector).all(axis=1)
                sound[sound] &= np.linalg.cond(normal[sound]) < 1e14
                position[sound] += np.linalg.solve(normal[sound], vector[sound, :, np.newaxis])[..., 0]
        behind = np.bincount(own, ~in_front, count) > 0
        return np.where(behind | ~np.isfinite(squares), np.inf, squares)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Snooped(Brief, Documented):
    """A network after data snooping.

    Attributes
    ----------
    result
        The adjusted network without the removed observations. Its standard deviations and its variance of
        unit weight are conditional on the selection: the largest residuals are removed.
    outcome
        The log with its data.
    suspects
        The groups of observations that were tested.
    options
        The options of data snooping.
    exchanged
        Names of points that are exchanged, among the excluded images.
    """

    result: AdjustedNetwork
    outcome: Outcome
    suspects: NamedSuspects
    options: SnoopOptions
    exchanged: tuple[Exchange, ...] = ()

    def brief(self) -> tuple[str, Rows]:
        """Return a summary of the removed observations."""
        title, rows = self.result.brief()
        own = [
            ("verdict", self.verdict.headline),
            ("tests", f"{self.outcome.tests:,}"),
            ("removed", few([entry.name for entry in self.removed])),
        ]
        return f"{title}, without gross errors", [*own, *(row for row in rows if row[0] != "verdict")]

    @property
    def verdict(self) -> Verdict:
        """The verdict of the result, which considers the removed observations."""
        return self.result.verdict

    @property
    def log(self) -> list[Removal]:
        """All removals in order, including reinstated and retained observations."""
        return self.outcome.log

    @property
    def removed(self) -> list[Removal]:
        """The removed observations at the end, in order."""
        return [entry for entry in self.outcome.log if entry.is_out]

    @property
    def rivals(self) -> list[Phrase]:
        """Messages on removed groups and their alternatives."""
        return [entry.sentence for entry in self.removed if entry.in_dispute]

    def share_removed(self, kind: str) -> float:
        """Return the share of the removed groups of a type, with dependent groups."""
        own = np.array(self.suspects.kind_names)[self.suspects.kinds] == kind
        return float(self.suspects.with_any(self.outcome.out.rows)[own].mean()) if own.any() else 0.0

    def table(self) -> pd.DataFrame:
        """Return the log as a data frame, a row for each removed component, with its unit."""
        import pandas as pd

        entries = zip(self.log, records(log_table(self.log).columns), strict=True)
        rows = [row for entry, member in entries for row in _rows(entry, member)]
        return pd.DataFrame(rows, columns=list(_COLUMNS))

    def members(self) -> dict[str, Any]:
        """Return the member `snooping` of JSON documents: settings, rounds and the log."""
        outcome, options = self.outcome, self.options
        return {
            **(
                {"family_level": options.level}
                if options.fdr is None
                else {"false_discovery_rate": options.fdr}
            ),
            "unit_weight": options.unit_weight,
            "distribution": "chi2" if options.is_known else "F",
            **members(outcome, "tests", robust_factors="factors"),
            "remarks": [*map(str, outcome.remarks)],
            "before": _standing(outcome.before),
            "after": _standing(outcome.standing),
            "rounds": [
                members(each, "number", *_STANDING, limit_p="limit") | members(each, "removed", "returned")
                for each in outcome.rounds
            ],
            "log": records(log_table(self.log).columns),
            "exchanged_names": [
                members(each, "photos", "points", T_as_named="as_named", T_exchanged="exchanged")
                | {"dimension": each.dimension}
                for each in self.exchanged
            ],
        }

    def to_json(self) -> bytes:
        """Return result, verdict and log (`snooping`) as one JSON document (UTF-8)."""
        return json.to_json({**self.result._members(), "snooping": self.members()})

    def document(self) -> Document:
        """Return the network's document without removed observations, with the log."""
        network, log, count = self.result.document(), self.log, len(self.removed)
        remarks = [
            *([] if log else ["Nothing was taken out."]),
            *map(str, self.outcome.remarks),
            *(f"{each.sentence}: {each.reason}" for each in self.exchanged),
            *(f"{each.name}: {line}" for each in log for line in each.consequences),
        ]
        parts: list[Part] = [Facts("Data snooping", self._facts())]
        parts += [log_table(log), _tests_table(log)] if log else []
        parts += [Remarks(remarks)] if remarks else []
        section = Section("removed", "What was taken out", parts, about("removed"))
        removed = Fact("Taken out", f"{count}", note=f"of {len(self.suspects)} groups of observations")
        highlights = [removed, *network.highlights]
        return replace(network, highlights=highlights, sections=[section, *network.sections])

    def _facts(self) -> list[Fact]:
        outcome, options = self.outcome, self.options
        returned = sum(entry.returned is not None for entry in self.log)
        suspect = sum(bool(entry.kept) for entry in self.log)
        name, level = (
            ("Family level", options.level) if options.fdr is None else ("False discovery rate", options.fdr)
        )
        tests = f"over {outcome.tests} tests, kept in all rounds"
        biased = f"holds after removal of {len(self.removed)} groups: it is biased low by little"
        taken_out = f"returned {returned}, suspect but kept {suspect}"
        return [
            Fact("Unit weight", "known: chi-square tests" if options.is_known else "unknown: F tests"),
            Fact(name, f"{level:g}", note=tests),
            Fact("Unit variance before", _said(outcome.before)),
            Fact("Unit variance after", _said(outcome.standing), note=biased if self.removed else ""),
            Fact("Rounds", f"{len(outcome.rounds)}"),
            Fact("Taken out", f"{len(self.removed)}", note=taken_out),
        ]


def recorded(found: Snooped) -> Snooped:
    """Return a copy with the removed observations in its result."""
    record = Removed(
        [
            record | {"subject": entry.subject}
            for record, entry in zip(records(log_table(found.removed).columns), found.removed, strict=True)
        ],
        found.suspects.counts(found.outcome.out.rows, found.outcome.active),
        rivals=found.rivals,
        exchanged=[each.sentence for each in found.exchanged],
        kept=[
            Phrase("line.kept", {"name": entry.subject, "reason": entry.kept})
            for entry in found.log
            if entry.kept
        ],
        disputed=disputes(found.log),
    )
    return replace(found, result=replace(found.result, snooped=record))


_COLUMNS = (
    *("round", "kind", "name", "component", "unit", "error", "error_sd"),
    *("dimension", "first_T", "T", "F", "log10_p", "limit_p", "redundancy"),
    *("rivals", "consequences", "predicted_error", "prediction_T", "prediction_log10_p", "returned", "kept"),
)


def _rows(entry: Removal, member: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return a row for each component: the member of the document with its own values."""
    common = {
        **{name: math.nan if value is None else value for name, value in member.items()},
        "rivals": rivals_of(entry.rivals, 3),
        "consequences": "; ".join(member["consequences"]),
        "returned": entry.returned,
        "kept": str(entry.kept),
    }
    names = ("component", "unit", "error", "error_sd", "predicted_error")
    predicted = entry.prediction_error or (math.nan,) * len(entry.rows)
    rows = zip(entry.components, entry.units, entry.error, entry.error_sd, predicted, strict=True)
    return [common | dict(zip(names, row, strict=True)) for row in rows]


def log_table(log: Sequence[Removal]) -> Table:
    rivals = [
        [members(one, "name", T="statistic") | members(one, "dimension", "odds") for one in each.rivals]
        for each in log
    ]
    states = ["out" if each.returned is None else f"back in round {each.returned}" for each in log]
    states = [f"kept: {each.kept}" if each.kept else state for each, state in zip(log, states, strict=True)]
    columns = [
        of_each(log, "round", head="Round", decimals=0),
        of_each(log, "kind", kind="name"),
        of_each(log, "name", kind="name", head="What"),
        Quantity([*map(estimated_errors, log)], kind="name", head="Estimated error"),
        *members_of_each(log, "components", "units", estimated_error="error", estimated_error_sd="error_sd"),
        *members_of_each(log, prediction_T="prediction", predicted_error="prediction_error"),
        Quantity([[*map(str, each.consequences)] for each in log], member="consequences"),
        *members_of_each(log, "dimension", first_T="first_statistic", T="statistic", F="fisher"),
        Quantity(np.exp([each.log_probability for each in log]), member="p"),
        of_each(log, "log10_p"),
        of_each(log, "limit", member="limit_p"),
        of_each(log, "redundancy", head="Redundancy", decimals=3),
        Quantity(rivals, member="rivals"),
        of_each(log, "prediction_log10_p"),
        of_each(log, "returned"),
        Quantity([str(each.kept) or None for each in log], member="kept"),
        Quantity([rivals_of(each.rivals[:3], 2) for each in log], kind="name", head="Or instead"),
        Quantity(states, kind="name", head="Now"),
    ]
    return Table("log", "In order", columns)


def _tests_table(log: Sequence[Removal]) -> Table:
    columns = [
        of_each(log, "name", kind="name", head="What"),
        of_each(log, "first_statistic", head="T at first", decimals=2),
        of_each(log, "statistic", head="T", decimals=2),
        of_each(log, "dimension", head="Dimension", decimals=0),
        of_each(log, "fisher", head="F", decimals=2),
        of_each(log, "log10_p", head="log10 p", decimals=1),
        Quantity([math.log10(each.limit) for each in log], head="Limit", decimals=1),
        of_each(log, "prediction", head="T against the rest", decimals=2),
        of_each(log, "prediction_log10_p", head="log10 p", decimals=1),
    ]
    return Table("removed-tests", "Tests", columns)


_STANDING = ("status", "weighted_sum_of_squares", "degrees_of_freedom")


def _standing(standing: Standing) -> dict[str, Any]:
    f = standing.degrees_of_freedom
    variance = standing.weighted_sum_of_squares / f if f > 0 else None
    return members(standing, *_STANDING) | {"variance_of_unit_weight": variance}


def _said(standing: Standing) -> str:
    test = global_test(*standing.sum_and_freedom)
    if test is None:
        return "undefined: no degrees of freedom"
    said = "too high" if test.rejected_high else "too low" if test.rejected_low else "as expected"
    expected = f"{test.limits[0]:.3f} to {test.limits[1]:.3f}"
    freedom = standing.degrees_of_freedom
    return f"{test.variance:.4f} with {freedom} degrees of freedom, expected {expected}: {said}"


def rivals_of(rivals: Iterable[Rival], figures: int) -> str:
    """Return alternatives to a removed group, with significant figures of their odds."""
    return "; ".join(f"{rival.name} ({rival.odds:.{figures}g} : 1)" for rival in rivals)


def estimated_errors(entry: Removal) -> str:
    """Return the estimated errors of the components of a removed group."""
    rows = zip(entry.components, entry.error, entry.units, entry.error_sd, strict=True)
    return ", ".join(
        f"{component} {error:.4g} {unit} (sd {sd:.2g})".replace("  ", " ")
        for component, error, unit, sd in rows
    )
