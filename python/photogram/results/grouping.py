"""Groups of the observations of a network by kind, camera, strip, photo, rays or own labels, and their tests.

q_g, the weighted sum of squares of a group, is a mixture of chi-square variables. Its expectation r_g is the
sum of its redundancy numbers, its variance is 2 s_g, and s_g is the sum of R_ij^2 within the group. With c =
s_g / r_g, q_g / c is approximately chi-square with r_g^2 / s_g degrees of freedom (Satterthwaite 1946). A
chi-square test of q_g with r_g degrees of freedom is conservative for small redundancy.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import argument_error, by_key, by_occurrence, value_field
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.messages import by_name
from photogram.network.block import Block
from photogram.network.motion import Given, on_shared
from photogram.network.observations import moments
from photogram.network.point_sets import strips_of
from photogram.network.rays import local_axes
from photogram.results.datum import point_kinds
from photogram.results.network import AdjustedNetwork
from photogram.show.methods import Tabular
from photogram.show.page import Document, Section, about
from photogram.show.quantity import Quantity, Table, column, of_each
from photogram.statistics.components import Component, GroupsOf, balanced
from photogram.statistics.distributions import bonferroni
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

GroupsArgument = str | Sequence[str] | Mapping[str, Any]
"""A basis, several of them (every combination is a group), or labels by part of the network."""

BASES = ("kind", "camera", "strip", "photo", "point class", "component", "rays")  # Bases of groups
PARTS = ("images", "control", "stations", "observations")  # Parts with labels of the user
MANY_RAYS = 5  # Smallest number of rays of the last group

_Labels = tuple[list[str], Indices]  # Names, and the number of the name of each observation


@dataclass(frozen=True, eq=False)
class Observables:
    """Possible groups of a network of P photos, n points and m images."""

    given: Given  # The network
    photo_cameras: Indices  # (P,) the camera of each photo, and their names
    camera_names: Sequence[str]
    strips: Callable[[], list[Indices]]  # Returns the strips of the photos
    point_classes: NDArray[np.str_]  # (n,) `control`, `check` or `pass`
    photo_observed: Bools  # (P, k) whether an unknown of a photo is observed
    stations: tuple[str, ...]  # (k,) names of the unknowns of a photo as observations
    commons: int  # Number of common unknowns
    # Number of observed times on trajectories: the core has them after the photos, with a camera
    records: int = 0

    @property
    def point_observed(self) -> Bools:
        """(n, 3) whether a coordinate is weighted."""
        return (self.given.point_sd > 0) & np.isfinite(self.given.point_sd)


@dataclass(frozen=True, eq=False)
class Grouping:
    """Groups of observations, a number for each observation; -1 for none."""

    groups: GroupsOf  # Their names
    images: Indices  # (m, 2), (n, 3), (P, k)
    points: Indices
    photos: Indices
    observations: Indices  # (o,) of additional observations
    commons: int = 0  # Number of common unknowns, which are in no group
    cameras: int = 0
    records: int = 0

    @property
    def count(self) -> int:
        return len(self.groups.names)

    def core(self) -> tuple[int, Indices, Indices, Indices, list[int], list[int], list[int]]:
        photos = np.ascontiguousarray(np.vstack([self.photos[:, :6], np.full((self.records, 6), -1)]))
        cameras, commons = [-1] * (self.cameras + (self.records > 0)), [-1] * self.commons
        observations: list[int] = self.observations.tolist()
        return self.count, self.images, self.points, photos, cameras, commons, observations

    def factors(self, factors: Floats, labels: Indices) -> Floats:
        """Return factors of labelled observations from (G,) factors; 1 without group."""
        return np.append(factors, 1.0)[labels]

    def summed(self, parts: Mapping[str, Floats]) -> Floats:
        """Return (G,) sums of values of observations, given in the shapes of the labels."""
        total = np.zeros(self.count + 1)
        for name, values in parts.items():
            labels = getattr(self, name)
            good = np.isfinite(values)
            total += np.bincount(labels[good] % (self.count + 1), values[good], self.count + 1)
        return total[:-1]


def grouped(of: Observables, groups: GroupsArgument | Grouping) -> Grouping:
    """Return groups of observations by bases or labels of the user (docs/weights.md); refuse others.

    All bases except `kind` and `component` divide the images only; others are grouped by type. Several bases
    define a group for each combination. Observations without a label (None or an empty text) keep their
    weights.
    """
    if isinstance(groups, Grouping):
        return groups
    if isinstance(groups, Mapping):
        labels, parents = _own(of, groups)
    else:
        bases = tuple(groups) if isinstance(groups, list | tuple) else (groups,)
        for basis in bases or (None,):
            if not isinstance(basis, str) or basis not in BASES:
                raise argument_error("groups", "choice", names=[*BASES], value=value_field(basis))
        labels, parents = _by(of, bases)
    # Numbers of the groups, first those of images
    numbers, found, counts = {"": -1}, dict[str, Indices](), list[int]()
    for part, (names, codes) in labels.items():
        used: Any = {"points": of.point_observed, "photos": of.photo_observed}.get(part, ...)
        # In the order of the photos, independent of the order of the images.
        order = np.argsort(of.given.image_photos, kind="stable") if part == "images" else used
        for code in by_occurrence(codes[order].ravel()).tolist():
            numbers.setdefault(names[code], len(numbers) - 1)
        found[part] = np.full(codes.shape, -1, dtype=np.int64)
        found[part][used] = np.array([numbers.get(name, -1) for name in names], np.int64)[codes[used]]
        counts.append(len(numbers) - 1)
    known = tuple(name for name in numbers if name)
    larger = tuple(parents.get(name, "") for name in known)
    named = GroupsOf(known, larger, tuple(number < counts[0] for number in range(len(known))))
    return Grouping(named, **found, commons=of.commons, cameras=len(of.camera_names), records=of.records)


_Labelled = tuple[dict[str, _Labels], dict[str, str]]
"""Labels of images, points, photos and observations, and the larger group of each label."""


def _by(of: Observables, bases: Sequence[str]) -> _Labelled:
    names, codes = ["images"], np.zeros(len(of.given.image_photos), dtype=np.int64)
    parents: dict[str, str] = {}
    for basis in bases:
        if basis not in ("kind", "component"):
            more, own = _images_by(of, basis)
            pairs, codes = np.unique(codes * len(more) + own, return_inverse=True)
            names = [f"{names[pair // len(more)]}, {more[pair % len(more)]}" for pair in pairs.tolist()]
            parents = dict.fromkeys(names, "other images")
    images: _Labels = names, np.stack([codes, codes], axis=1)
    points: _Labels = ["control"], np.zeros(of.point_observed.shape, dtype=np.int64)
    if "component" in bases:
        along = [[f"{name}, {axis}" for name in names] for axis in "xy"]
        parents |= {each: name for part in along for each, name in zip(part, names, strict=True)}
        images = [*along[0], *along[1]], np.stack([codes, codes + len(names)], axis=1)
        points = ["control, plan", "control, height"], points[1] + np.array([0, 0, 1])
        parents |= dict.fromkeys(points[0], "control")
    photos = [*of.stations], np.broadcast_to(np.arange(len(of.stations)), of.photo_observed.shape)
    parents |= dict.fromkeys(of.stations, "stations")
    observations = [each.label for each in of.given.observations]
    others: _Labels = observations, np.arange(len(observations))
    return {"images": images, "points": points, "photos": photos, "observations": others}, parents


def _images_by(of: Observables, basis: str) -> tuple[list[str], Indices]:
    photos, seen = of.given.image_photos, of.given.image_points
    if basis == "photo":
        return [f"photo {name}" for name in of.given.photo_ids], photos
    if basis == "camera":
        return [f"camera {name}" for name in of.camera_names], of.photo_cameras[photos]
    if basis == "strip":
        number, strips = np.empty(len(of.photo_cameras), dtype=np.int64), of.strips()
        for strip, members in enumerate(strips):
            number[members] = strip
        return [f"strip {strip}" for strip in range(1, len(strips) + 1)], number[photos]
    if basis == "point class":
        classes, codes = np.unique(of.point_classes, return_inverse=True)
        return [f"{each} points" for each in classes.tolist()], codes[seen]
    rays = np.minimum(np.bincount(seen), MANY_RAYS)[seen]
    return [*(f"{number} rays" for number in range(MANY_RAYS)), f"{MANY_RAYS} rays and more"], rays


def _own(of: Observables, given: Mapping[str, Any]) -> _Labelled:
    if unknown := set(given) - set(PARTS):
        raise argument_error("labels", "choice", names=[*PARTS], value=min(map(str, unknown)))
    labels, parents = _by(of, ["kind"])
    for name, part in zip(PARTS, labels, strict=True):
        if name in given:
            default, own = labels[part][1], np.asarray(given[name], dtype=object)
            if own.shape == default.shape[:1] and default.ndim == 2:
                own = np.repeat(own[:, np.newaxis], default.shape[1], axis=1)
            if own.shape != default.shape:
                shapes = f"{default.shape[:1]} or {default.shape}"
                raise argument_error(f"labels of {name}", "shape", shape=shapes, actual=own.shape)
            # None and NaN are missing labels.
            texts = ["" if label is None or label != label else str(label) for label in own.ravel().tolist()]
            codes = {text: code for code, text in enumerate(dict.fromkeys(texts))}
            labels[part] = [*codes], np.array([codes[text] for text in texts], np.int64).reshape(own.shape)
    return labels, parents


def observables(network: object) -> Observables:
    """Return the observations of a block, a collection or an adjusted one."""
    given = network.given if isinstance(network, AdjustedNetwork) else network
    if hasattr(given, "_observables"):
        found: Observables = given._observables()
        return found
    if not isinstance(given, Block):
        raise argument_error("network", "kind", kind=phrase("groups.network"), value=value_field(network))
    block = given
    sd = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
    observed = (sd > 0) & np.isfinite(sd)
    # Observations of a photo with its own trajectory are observations of common unknowns.
    mounted = {each.photo for each in block.mounts} | {each.photo for each in block.timed}
    observed[[row for row, name in enumerate(block.photo_ids) if name in mounted]] = False
    cameras, photo_cameras = block.core_cameras()
    names = block.camera_names if block.cameras else [str(number) for number in range(len(cameras))]
    return Observables(
        given=block,
        photo_cameras=photo_cameras,
        camera_names=names,
        strips=lambda: _strips(block),
        point_classes=point_kinds(block),
        photo_observed=observed,
        stations=("positions",) * 3 + ("attitudes",) * 3,
        commons=len(block.unknowns),
        records=len(moments(block.observations)),
    )


def _strips(block: Block) -> list[Indices]:
    """Return the photos of each strip: by trajectory, or by position."""
    own = {each.photo: each.trajectory for each in block.timed if each.trajectory is not None}
    flown = by_key((id(own[name]), row) for row, name in enumerate(block.photo_ids) if name in own)
    others = np.flatnonzero(~on_shared(block))
    found = strips_of(local_axes(block).positions(block.photo_positions)[others]) if len(others) else []
    return [*(others[strip] for strip in found), *(np.array(rows, dtype=np.int64) for rows in flown.values())]


TESTABLE = 0.5  # Smallest redundancy of a tested group
LEVEL = 0.05
SMALL = 1000  # Largest number of observations with exact sums
TOGETHER = 32  # Largest number of groups with separate columns


@dataclass(frozen=True)
class Probing:
    """Settings for the computation of sums over R."""

    # Largest number of observations of groups computed by column; None: 64, and all groups of a network of
    # 1,000 observations
    exact: int | None = None
    # Vectors of random signs for larger groups: 16 give a sum to about 15 percent, 64 to half of that error
    vectors: int = 32
    seed: int = 1  # equal seeds give identical results

    def options(self, observations: int) -> dict[str, Any]:
        """Return the options of the core for a number of observations."""
        exact = (observations if observations <= SMALL else 64) if self.exact is None else self.exact
        return {"exact": exact, "vectors": self.vectors, "seed": self.seed, "threads": 0, "progress": None}


@dataclass(frozen=True)
class GroupSum:
    """A group of observations after the adjustment."""

    name: str
    # count, squares, redundancy: Observations, their weighted sum of squares q, the sum r of their redundancy
    # numbers
    count: int
    squares: float
    redundancy: float
    spread: float  # s: the variance of q is 2 s if the standard deviations are right
    # Of q / c with its degrees of freedom (Satterthwaite); None with a redundancy below 0.5
    test: GlobalTest | None

    @property
    def freedom(self) -> float:
        """Degrees of freedom of q / c, r^2 / s."""
        return self.redundancy**2 / self.spread if self.spread > 0 else math.nan

    @property
    def factor(self) -> float:
        """Ratio of residuals to their expectation by standard deviations; NaN without redundancy."""
        return math.sqrt(self.squares / self.redundancy) if self.redundancy > 0 else math.nan


@dataclass(frozen=True, eq=False, repr=False)
class GroupSums(Tabular):
    """Groups of the observations of an adjusted network, with their tests.

    A group should be tested after the removal of gross errors, and jointly with the others by variance
    components. Its sum contains the errors of the others.

    Attributes
    ----------
    groups
        The groups.
    level
        The level of all tests together, divided by their number (Bonferroni), half on each side.
    """

    groups: tuple[GroupSum, ...]
    level: float

    @property
    def rejected(self) -> list[GroupSum]:
        """Groups with residuals too large or too small for their standard deviations."""
        return [
            each for each in self.groups if each.test and (each.test.rejected_high or each.test.rejected_low)
        ]

    def __getitem__(self, name: str) -> GroupSum:
        found: GroupSum = by_name(self.groups, name, "group")
        return found

    def document(self) -> Document:
        """Return the document: sums, factors of standard deviations, probabilities of sums."""
        groups, tests = self.groups, [each.test for each in self.groups]
        sides = [
            (math.nan, math.nan) if test is None else (test.probability_below, test.probability_above)
            for test in tests
        ]
        low, high = np.reshape(sides, (-1, 2)).T
        columns = [
            *sum_columns(groups),
            of_each(groups, "spread", name="spread"),
            of_each(groups, "freedom", name="degrees_of_freedom"),
            of_each(groups, "factor", name="factor", head="Factor of sd", decimals=3),
            column("probability_below", low, "p low", figures=2),
            column("probability_above", high, "p high", figures=2),
        ]
        tested = sum(test is not None for test in tests)
        names = [each.name for each in self.rejected] or ["none"]
        note = about("groups", n=tested, percent=100 * self.level, names=names)
        title = "Groups of observations"
        return Document(title, "", sections=[Section.of(Table("groups", title, columns, note))])


def sum_columns(groups: Sequence[GroupSum | Component]) -> list[Quantity]:
    """Return the names of groups, their numbers of observations, redundancy and sums of squares."""
    return [
        of_each(groups, "name", kind="name", name="group", head="Group"),
        of_each(groups, "count", name="observations", head="Number", decimals=0),
        of_each(groups, "redundancy", name="redundancy", head="Redundancy", decimals=2),
        of_each(groups, "squares", name="sum_of_squares", head="Weighted sum of squares", decimals=2),
    ]


class Left:
    """Residual statistics of groups, and of all others as another group."""

    def __init__(self, result: AdjustedNetwork, grouping: Grouping, probing: Probing) -> None:
        self.result, self.grouping, self._probing = result, grouping, probing
        total, freedom = result.sum_and_freedom
        counts, squares, redundancy = sums_of(result, grouping)
        self.counts: Indices = np.append(counts, 0)
        self.squares: Floats = np.append(squares, max(total - squares.sum(), 0.0))
        self.redundancy: Floats = np.append(redundancy, max(freedom - redundancy.sum(), 0.0))

    def matrix(self) -> Floats:
        """Return the (G + 1, G + 1) Helmert matrix."""
        options = self._probing.options(int(self.counts.sum()))
        g = self.grouping.count
        _, found, exact = self.result._factor().group_squares(self.grouping.core(), classes=None, **options)
        columns, r = found.reshape(g + 1, g), self.redundancy
        sums = columns.sum(axis=0)
        columns = columns * np.divide(r[:g], sums, out=np.ones(g), where=(sums > 0) & ~np.array(exact, bool))
        matrix = np.zeros((g + 1, g + 1))
        matrix[g, :g] = matrix[:g, g] = columns[g]
        matrix[:g, :g] = balanced(columns[:g], r[:g] - columns[g], exact)
        matrix[g, g] = max(r[g] - columns[g].sum(), 0.0)
        return matrix


def sums_of(result: AdjustedNetwork, grouping: Grouping) -> tuple[Indices, Floats, Floats]:
    """Return (G,) observation numbers, sums of squares and sums of redundancy."""

    def weighted(residuals: Floats, sd: Floats) -> Floats:
        return np.where((sd > 0) & np.isfinite(sd), (residuals / sd) ** 2, np.nan)

    kinds = [*result._terms.kinds]
    size = sum(len(kind.rows) for kind in kinds)
    of_observations, shares, components = np.full(size, np.nan), np.full(size, np.nan), np.ones(size)
    for kind in kinds:
        of_observations[kind.rows] = kind.squares
        shares[kind.rows] = np.nansum(np.where(np.isfinite(kind.sd), kind.redundancy, 0.0), axis=1)
        components[kind.rows] = np.isfinite(kind.residuals).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        images = (result.residuals / result.image_given_sd) ** 2 * result.image_weights[:, np.newaxis]
        points = weighted(result.point_residuals, result.point_given_sd)
        photos = weighted(result.photo_residuals, result.photo_given_sd)
    squares = {"images": images, "points": points, "photos": photos, "observations": of_observations}
    parts = (result.redundancy, result.point_redundancy, result.photo_redundancy, shares)
    redundancy = {
        name: np.where(np.isfinite(squares[name]) | (name == "images"), part, np.nan)
        for name, part in zip(squares, parts, strict=True)
    }
    ones = {name: np.where(np.isfinite(values), 1.0, np.nan) for name, values in redundancy.items()}
    ones["observations"] *= components
    counts = np.round(grouping.summed(ones)).astype(np.int64)
    return counts, grouping.summed(squares), grouping.summed(redundancy)


def sums_by_kind(result: Result) -> dict[str, tuple[int, float, float]]:
    """Return number, redundancy and sum of squares of each type of observation, with weighted parameters."""
    grouping = grouped(observables(result), "kind")
    counts, squares, redundancy = sums_of(result, grouping)
    columns = counts.tolist(), redundancy.tolist(), squares.tolist()
    found = dict(zip(grouping.groups.names, zip(*columns, strict=True), strict=True))
    more: list[tuple[str, Any, Floats]] = [(each.kind, each, each.change) for each in result.unknowns]
    more += [("camera", each, each.values - each.given.values) for each in result.cameras]
    for kind, each, change in more:
        sd = each.given.deviations
        if (weighted := (sd > 0) & np.isfinite(sd)).any():
            count, r, q = found.get(kind, (0, 0.0, 0.0))
            q += float(((change[weighted] / sd[weighted]) ** 2).sum())
            found[kind] = count + int(weighted.sum()), r + float(each.redundancy[weighted].sum()), q
    return found


def group_sums(
    result: AdjustedNetwork,
    groups: GroupsArgument = "kind",
    *,
    level: float = LEVEL,
    probing: Probing | None = None,
) -> GroupSums:
    """Test groups of the observations of an adjusted network.

    Parameters
    ----------
    result
        The adjusted block or collection, with covariances.
    groups
        `kind`, `camera`, `strip`, `photo`, `point class`, `rays`, `component`, several of these, or own
        labels (docs/weights.md).
    level
        Probability of rejecting any of the groups if all standard deviations are right.
    probing
        Settings for the computation of sums over R.

    Raises
    ------
    InputError
        If the argument is not an adjusted network with covariances, or the groups do not exist.
    """
    if not isinstance(result, AdjustedNetwork):
        raise argument_error("result", "kind", kind=phrase("groups.result"), value=value_field(result))
    if not np.isfinite(result.redundancy[result.used_images]).all():
        raise InputError(phrase("groups.no-redundancy"))
    grouping = grouped(observables(result), groups)
    counts, squares, redundancy = sums_of(result, grouping)
    # The other groups share columns.
    classes = TOGETHER if grouping.count > TOGETHER else None
    options = (probing or Probing()).options(int(counts.sum()))
    _, spread, _ = result._factor().group_squares(grouping.core(), classes=classes, **options)
    if classes is None:
        spread = np.diag(spread.reshape(-1, grouping.count))
    spread = np.clip(spread, 0.0, redundancy)
    testable = redundancy >= TESTABLE
    own = bonferroni(level, int(testable.sum()))
    found = []
    for g, name in enumerate(grouping.groups.names):
        q, r, s = float(squares[g]), float(redundancy[g]), float(spread[g])
        test = global_test(q * r / s, r * r / s, own) if testable[g] and s > 0 else None
        found.append(GroupSum(name, int(counts[g]), q, r, s, test))
    return GroupSums(tuple(found), level)
