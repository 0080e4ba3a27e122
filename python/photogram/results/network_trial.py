"""The network of data snooping, with solutions without some observations, and facts for hypotheses."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.block import Block
from photogram.network.motion import Given, on_shared
from photogram.network.point_sets import strips_of
from photogram.network.rays import local_axes
from photogram.results.parts import kind_words, named_observation
from photogram.statistics.findings import Text
from photogram.statistics.groups import INVISIBLE
from photogram.statistics.reliability import TESTABLE
from photogram.words import Phrase, phrase

KINDS = ("image", "control", "position", "attitude", "observation", "camera", "unknown")
"""Items of the suspects of the core by number."""
IMAGE, CONTROL, POSITION, ATTITUDE, OBSERVATION = range(5)

MANY, MOST_OF_PHOTO = 4, 0.25  # Smallest number, and share, of removed images of a photo that is doubtful

_TESTS = ("active", "rank", "statistic", "least", "residual", "redundancy", "error", "error_sd")

T = TypeVar("T")


@dataclass(eq=False)
class Out:
    """Excluded observations."""

    rows: Bools  # (M,) excluded rows
    # Excluded points and photos, with all their observations
    points: set[int] = field(default_factory=set)
    photos: set[int] = field(default_factory=set)


@dataclass(frozen=True)
class Standing:
    """State of a network without the excluded observations."""

    status: str  # `converged`, or another end of the iteration
    # weighted_sum_of_squares, degrees_of_freedom: Omega and f of the included observations
    weighted_sum_of_squares: float
    degrees_of_freedom: int

    @property
    def sum_and_freedom(self) -> tuple[float, float]:
        return self.weighted_sum_of_squares, self.degrees_of_freedom


@dataclass(frozen=True, eq=False)
class Tests:
    """Tests of all groups; NaN if excluded."""

    active: Bools  # (G,) whether any row is included
    rank: Indices  # (G,) directions in which an error is visible
    statistic: Floats  # (G,) T, the decrease of Omega without the group
    least: Floats  # (G,) the smallest redundancy of a visible direction
    residual: Floats  # (M,) of unit weight
    redundancy: Floats  # (M,) redundancy numbers
    # error, error_sd: (M,) estimated error and its standard deviation, in the units of the rows
    error: Floats
    error_sd: Floats

    def testable(self, row_starts: Indices) -> Bools:
        """Return (G,) groups with a direction of notable errors in own residuals."""
        checked = np.logical_or.reduceat(self.redundancy > TESTABLE, row_starts[:-1])
        return np.asarray(self.active & (self.rank > 0) & checked)


class LostSupportError(Exception):
    """The exclusions make unknowns of these points and photos undetermined."""

    def __init__(self, points: Sequence[int], photos: Sequence[int]) -> None:
        super().__init__(f"undetermined: points {list(points)}, photos {list(photos)}")
        self.points = tuple(points)
        self.photos = tuple(photos)


@dataclass(eq=False)
class NetworkTrial:
    """A network that can be adjusted without some of its observations."""

    core: _photocore.NetworkTrial
    suspects: NamedSuspects
    supported: Bools  # (P,) whether the pose of a photo is determined without images
    rough: float
    exact: float
    control: str  # Parts that may be removed alone: `whole`, `plan and height`, `components`
    out: Out | None = None  # Observations that a robust loss removes

    def __post_init__(self) -> None:
        self.deviations: Floats = self.core.suspects.deviations
        self._tests: dict[str, np.ndarray] = {}

    def restart(self, core: _photocore.NetworkTrial) -> None:
        """Continue the same network from other initial values; its groups are unchanged."""
        self.core, self._tests = core, {}

    def asked(self, ask: Callable[..., T], *arguments: Any, **options: Any) -> T:
        """Call the core; undetermined unknowns are a LostSupportError."""
        try:
            return ask(*arguments, **options)
        except (_photocore.BlockError, _photocore.CollectionError) as error:
            kind, _, combinations, points, _ = error.args
            if kind == "undetermined points":
                raise LostSupportError(points, []) from error
            if kind == "not finite":
                raise LostSupportError([], []) from error
            if kind == "undetermined photos":
                photos = {photo for combination in combinations for photo in combination[0]}
                # In the core, times on trajectories follow the photos.
                own = sorted(photo for photo in photos if photo < len(self.supported))
                raise LostSupportError([], own) from error
            raise

    def stand(self) -> Standing:
        """Use the final state of the adjustment; with a loss, adjust without removed observations."""
        out, options = self.out, {"tolerance": self.exact, "progress": None}
        status, _, omega, freedom, collapsed = (
            self.core.stand()
            if out is None
            else self.asked(self.core.adjust, out.rows, sorted(out.points), sorted(out.photos), **options)
        )
        if collapsed:
            raise LostSupportError(collapsed, [])
        return Standing(status, omega, freedom)

    def correlation(self, first: int, second: int, between: Floats) -> float:
        """Return the largest canonical correlation of two groups by R `between` them."""
        halves = []
        for group in (first, second):
            values, vectors = np.linalg.eigh(self.own_block(group))
            seen = values > INVISIBLE
            halves.append(vectors[:, seen] / np.sqrt(values[seen]))
        product = halves[0].T @ between @ halves[1]
        return min(float(np.linalg.norm(product, 2)), 1.0) if product.size else 0.0

    def tests(self) -> Tests:
        found = self._tests = self.core.tests()
        return Tests(**{name: found[name] for name in _TESTS})

    @cached_property
    def _block_starts(self) -> Indices:
        return np.concatenate([[0], np.cumsum(np.diff(self.suspects.row_starts) ** 2)])

    def own_block(self, group: int) -> Floats:
        """Return R of a group."""
        start, end = self._block_starts[group : group + 2]
        size = math.isqrt(int(end - start))
        return np.asarray(self._tests["cofactors"][start:end].reshape(size, size))


def type_name(kind: int, label: str = "") -> Phrase:
    """Return the name of a type of groups, in the plural; `label` is the type of additional observations."""
    name = KINDS[kind]
    if label:
        return phrase("test.observations", kind=kind_words(label))
    return phrase("test.control" if name == "control" else f"test.{name}s")


class NamedSuspects(ABC):
    """G groups of observations of a network with M rows in all, and their names, without the core."""

    def __init__(
        self,
        given: Given,
        core: _photocore.NetworkSuspects,
        *,
        # Components of coordinates of points, positions and attitudes; units of the first two
        components: tuple[Sequence[str], Sequence[str], Sequence[str]],
        lengths: Sequence[str],
    ) -> None:
        kinds, subjects = (values.astype(np.int64, copy=False) for values in core.subjects)
        points, photos = np.full(len(kinds), -1), np.full(len(kinds), -1)
        # Groups are in the order of these types.
        starts = np.searchsorted(kinds, (IMAGE, CONTROL, POSITION, OBSERVATION)).tolist()
        image, control, station = map(slice, starts, starts[1:])
        points[image] = given.image_points[subjects[image]]
        photos[image] = given.image_photos[subjects[image]]
        points[control] = subjects[control]
        photos[station] = subjects[station]
        self.row_starts: Indices = core.row_starts  # (G + 1,) first row of each group
        self.kinds, self.kind_names = kinds, KINDS  # (G,) types by their numbers: `image`, `control`, ...
        self.subjects = subjects  # (G,) number of the image, point, observation, ... of a group
        self.points, self.photos = points, photos  # (G,) point and photo of a group, or -1
        self.given, self.components = given, core.components
        self._names = dict(zip((CONTROL, POSITION, ATTITUDE), components, strict=True)) | {IMAGE: "xy"}
        images, angles = (given.image_unit,) * 2, ("rad",) * 3
        self._units = {IMAGE: images, CONTROL: lengths, POSITION: lengths, ATTITUDE: angles}

    def __len__(self) -> int:
        return len(self.kinds)

    def kind(self, group: int) -> str:
        return self.kind_names[int(self.kinds[group])]

    def rows(self, group: int) -> Indices:
        return np.arange(self.row_starts[group], self.row_starts[group + 1])

    def touched(self, group: int) -> tuple[list[int], list[int]]:
        """Return the points and photos that a group observes."""
        points, photos = int(self.points[group]), int(self.photos[group])
        return [points] * (points >= 0), [photos] * (photos >= 0)

    def photo_name(self, photo: int) -> Phrase:
        return Phrase("named.photo", {"photo": str(self.given.photo_ids[photo])})

    def name(self, group: int) -> Phrase:
        kind, subject = int(self.kinds[group]), int(self.subjects[group])
        points, photos = self.given.point_ids, self.given.photo_ids
        if kind == IMAGE:
            point, photo = points[self.points[group]], photos[self.photos[group]]
            return Phrase("named.image", {"point": str(point), "photo": str(photo)})
        if kind == CONTROL:
            return Phrase("named.control", {"point": str(points[subject])})
        if kind in (POSITION, ATTITUDE):
            return Phrase(f"named.{KINDS[kind]}", {"photo": str(photos[subject])})
        return self.other_name(kind, subject)

    def counts(self, rows: Bools, used: Bools) -> dict[Text, tuple[int, int]]:
        """Return the numbers of groups with removed rows, and of all used groups, by type.

        A photo of which many images were removed is a type of its own.
        """
        removed = np.asarray(np.logical_or.reduceat(rows, self.row_starts[:-1]))
        found: dict[Text, tuple[int, int]] = {}
        for kind in np.unique(self.kinds[removed]).tolist():
            own = np.flatnonzero((self.kinds == kind) & (used | removed))
            types = np.array([self.type(kind, subject) for subject in self.subjects[own].tolist()])
            for each in dict.fromkeys(types[removed[own]].tolist()):
                same = types == each
                found[each] = (int(removed[own][same].sum()), int(same.sum()))
        images, count = (self.kinds == IMAGE) & (used | removed), len(self.given.photo_ids)
        every, lost = (np.bincount(self.photos[own], minlength=count) for own in (images, images & removed))
        for photo in np.flatnonzero((lost >= MANY) & (lost > MOST_OF_PHOTO * every) & (lost < every)):
            name = phrase("test.images_of", photo=str(self.given.photo_ids[photo]))
            found[name] = int(lost[photo]), int(every[photo])
        return found

    def of_images(self, images: Indices) -> Indices:
        """Return the groups of images; images without intersection have none."""
        return np.flatnonzero((self.kinds == IMAGE) & np.isin(self.subjects, images))

    def type(self, kind: int, subject: int) -> Phrase:
        """Return the name of the type of a group, in the plural."""
        return type_name(kind)

    def row_name(self, row: int) -> str:
        return self._row(row)[0]

    def unit(self, row: int) -> str:
        return self._row(row)[1]

    def _row(self, row: int) -> tuple[str, str]:
        group = int(np.searchsorted(self.row_starts, row, "right")) - 1
        component = int(self.components[row])
        kind = int(self.kinds[group])
        if kind in self._names:
            return self._names[kind][component], self._units[kind][component]
        return self.other_row(kind, int(self.subjects[group]), component)

    @abstractmethod
    def other_name(self, kind: int, subject: int) -> Phrase: ...

    @abstractmethod
    def other_row(self, kind: int, subject: int, component: int) -> tuple[str, str]: ...


ANGLES = ("omega", "phi", "kappa")


ROUGH = 2.0
"""Standard deviations: a round ends if the next step would not move any unknown by more. The following rounds
start there. The last round removes nothing, so its tests are practically exact."""
EXACT = 1e-7  # Value for R of all rows, and for hypotheses on sets
LOOSE = 0.1  # Largest standard deviation of positions for a firm datum, as a part of the extent of the block


def network_trial(
    block: Block, core: _photocore.NetworkTrial, *, control: str = "plan and height"
) -> NetworkTrial:
    deviations = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
    # If only weak weights of photos define the datum, standard deviations of unknowns are those of the datum.
    # A step may be small relative to them, and leave partials that contradict the cofactors by hundreds.
    position_sd = block.photo_position_sd[:, :2]
    extent = np.ptp(block.photo_positions[:, :2], axis=0).max(initial=0.0)
    firm = np.isfinite(block.point_sd).any() or (position_sd < LOOSE * extent).any()
    return NetworkTrial(
        core=core,
        suspects=BlockSuspects(block, core.suspects),
        # Photos with other observations do not need their images.
        supported=np.asarray(np.isfinite(deviations).all(axis=1) | on_shared(block)),
        rough=EXACT if np.isfinite(position_sd).any() and not firm else ROUGH,
        exact=EXACT,
        control=control,
    )


class BlockSuspects(NamedSuspects):
    """The observation groups of a block."""

    def __init__(self, block: Block, core: _photocore.NetworkSuspects) -> None:
        axes = ("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z")
        plan = "rad" if block.geographic else block.linear_unit
        lengths = (plan, plan, block.linear_unit)
        super().__init__(block, core, components=(axes, axes, ANGLES), lengths=lengths)
        self.block = block
        # The additional observations in the order of the core: by type
        self.observations = [each for own in block.observations.columns for each in own.objects]

    def touched(self, group: int) -> tuple[list[int], list[int]]:
        if self.kinds[group] != OBSERVATION:
            return super().touched(group)
        own, block = self.observations[int(self.subjects[group])], self.block
        return [*map(block.point_ids.index, own.points)], [*map(block.photo_ids.index, own.photos)]

    def type(self, kind: int, subject: int) -> Phrase:
        return type_name(kind, self.observations[subject].label if kind == OBSERVATION else "")

    def other_name(self, kind: int, subject: int) -> Phrase:
        if kind == OBSERVATION:
            observation = self.observations[subject]
            return named_observation(observation.KIND, " - ".join(observation.of))
        if KINDS[kind] == "camera":
            return Phrase("named.camera", {"camera": self.block.camera_names[subject]})
        return Phrase("named.unknown", {"unknown": self.block.unknowns[subject].name})

    def other_row(self, kind: int, subject: int, component: int) -> tuple[str, str]:
        if kind != OBSERVATION:
            return str(component), ""
        observation = self.observations[subject]
        names = observation.components(geographic=self.block.geographic)
        return names[component], observation.units(self.block.linear_unit)[component]


Facts = dict[str, Any]  # See `NetworkTrial.hypotheses`

MOST_SETS = 8  # Largest number of sets of positions or control that are all tested
MOST_STRIPS = 4  # Of more strips, this number is tested: those with the largest mean differences
NOTABLE = 20.0  # Least sum of squares of notable means, in medians; larger by 4 ln n for n means
MEDIAN = 0.4549  # Of chi-square with one degree of freedom

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


def notable(squares: Floats, most: int, least: int = 1) -> list[int]:
    """Return the rows of (n, k) squares of means that are larger than usual: `least` to `most`, or none.

    The unit of each column is its median. Standard deviations of means depend on the geometry: the limit is
    larger than the one of equal means.
    """
    usual = np.maximum(np.median(squares, axis=0), np.finfo(float).tiny)
    sums = MEDIAN * (squares / usual).sum(axis=1)
    count = np.count_nonzero(sums > NOTABLE + 4 * math.log(len(sums)))
    largest = np.argsort(-sums, kind="stable")[: min(max(count, least), most)]
    return sorted(largest.tolist()) if count else []


def suspected_strips(differences: Sequence[Floats]) -> list[int]:
    """Return those of many strips whose positions have notable means of (k, 3) differences."""
    squares = np.array([own.mean(axis=0) ** 2 * len(own) for own in differences])
    return notable(squares, MOST_STRIPS, 2) if np.isfinite(squares).all() else []


def block_facts(block: Block, places: Floats) -> Facts:
    """Return facts for hypotheses on a block with (P, 3) adjusted `places` of photos."""
    count = len(block.photo_ids)
    cameras = np.zeros(count, dtype=np.int64) if block.photo_cameras is None else block.photo_cameras
    facts: Facts = {"widths": [], "readouts": []}
    of_images = cameras[block.image_photos]
    low, high = (np.full((max(len(block.cameras), 1), 2), end) for end in (math.inf, -math.inf))
    runs = np.flatnonzero(np.diff(of_images, prepend=-1))  # of consecutive images of one camera
    for axis, xy in enumerate(block.image_xy.T.copy()):
        np.minimum.at(low[:, axis], of_images[runs], np.minimum.reduceat(xy, runs))
        np.maximum.at(high[:, axis], of_images[runs], np.maximum.reduceat(xy, runs))
    for (left, top), (width, height) in zip(low.tolist(), (high - low).tolist(), strict=True):
        facts["widths"].append(width if width > 0 else math.nan)
        lines = []
        if width > 0 and height > 0:
            lines = [[0.0, 1 / height, -top / height - 0.5], [1 / width, 0.0, -left / width - 0.5]]
        facts["readouts"].append(lines)
    seconds = np.full(count, math.nan)
    row = {name: k for k, name in enumerate(block.photo_ids)}
    weighted = np.isfinite(block.photo_position_sd) & (block.photo_position_sd > 0)
    given = (
        block.photo_positions if block.photo_positions_observed is None else block.photo_positions_observed
    )
    observed = np.where(weighted, given, math.nan)
    for columns in block.observations.columns:
        if columns.kind.KIND == "position":
            values = (columns.table[name] for name in ("photos", "time", "position"))
            for photos, time, position in zip(*values, strict=True):
                if photos and photos[0] in row:
                    seconds[row[photos[0]]], observed[row[photos[0]]] = time, position
    facts["observed"] = observed
    timed = bool(np.isfinite(seconds).all() and np.ptp(seconds) > 0)
    times = seconds if timed else np.arange(count, dtype=np.float64)
    velocities, sets = np.full((count, 3), math.nan), np.full(count, -1)
    axes = local_axes(block)
    strips = strips_of(axes.positions(places) if block.geographic else places) if count > 1 else []
    cartesian = axes.cartesian.positions(places)
    for number, strip in enumerate(strips):
        sets[strip] = number
        if len(strip) > 1 and (np.diff(times[strip]) > 0).all():
            velocities[strip] = np.gradient(cartesian[strip], times[strip], axis=0)
    facts["velocities"] = velocities
    if count > 1:
        # Without times, the order of the photos is used.
        facts |= {"times": times.tolist(), "timed": timed}
    chosen = [*range(len(strips))]
    if len(strips) > MOST_SETS:
        chosen = suspected_strips([observed[strip] - places[strip] for strip in strips])
    if len(chosen) > 1:
        consecutive = {strip: place for place, strip in enumerate(chosen)}
        facts |= {"position_sets": [consecutive.get(strip) for strip in sets.tolist()], "strips": chosen}
    held = np.isfinite(block.point_sd)
    control = np.flatnonzero(held.any(axis=1))
    # Coordinates without standard deviation may be unknown.
    coordinates = zip(held.T, block.point_positions.T, places.T, strict=True)
    if not block.geographic or np.ptp(places[:, 0]) < math.pi:  # Else both sides of the antimeridian
        facts["centre"] = [float((own[has] if has.any() else of).mean()) for has, own, of in coordinates]
    _, kinds, sizes = np.unique(block.point_sd[control], axis=0, return_inverse=True, return_counts=True)
    if 1 < len(sizes) <= MOST_SETS and (sizes > 1).all():
        control_sets: list[int | None] = [None] * len(block.point_sd)
        for point, kind in zip(control.tolist(), kinds.tolist(), strict=True):
            control_sets[point] = kind
        facts["control_sets"] = control_sets
    return facts
