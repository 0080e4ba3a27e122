"""The network of data snooping: solutions without some observations."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats, Indices
from photogram.network.block import Block
from photogram.network.observations import Observation, Smoothness
from photogram.network.trajectories import Trajectory
from photogram.network.unadjusted import Given
from photogram.results.observation_kinds import kind_words, named_observation
from photogram.statistics.findings import Text
from photogram.statistics.groups import INVISIBLE
from photogram.statistics.snooping.suspects import (
    LostSupportError,
    Out,
    Prediction,
    Standing,
    Suspects,
    Tests,
)
from photogram.words import Phrase, phrase

KINDS = ("image", "control", "position", "attitude", "observation", "camera", "unknown")
"""Items of the suspects of the core by number."""
IMAGE, CONTROL, POSITION, ATTITUDE, OBSERVATION = range(5)

WHOLE = 1500  # Largest number of rows for the complete R; an exact round has this number of solutions
SUPPORT = 3  # Smallest number of images of a photo with a free pose
HUBER, CAUCHY = 1.50, 2.55  # Scales of the losses of a robust start, in standard deviations of an image point
ROBUST_ITERATIONS = 20

_TESTS = ("active", "rank", "statistic", "least", "shared", "residual", "error", "error_sd")

T = TypeVar("T")


class NetworkTrial:
    """A network that can be adjusted without some of its observations."""

    def __init__(
        self,
        core: _photocore.NetworkTrial,
        suspects: NamedSuspects,
        supported: Bools,
        rough: float,
        exact: float,
    ) -> None:
        self.core, self.suspects, self.rough, self.exact = core, suspects, rough, exact
        self.deviations: Floats = core.suspects.deviations
        self._supported = supported  # (P,) whether the pose of a photo is determined without images
        self._is_image = np.asarray(core.suspects.subjects[0] == IMAGE)
        starts = suspects.row_starts
        sizes = np.diff(starts)
        self._block_starts = np.concatenate([[0], np.cumsum(sizes**2)])
        row = np.arange(starts[-1]) - np.repeat(starts[:-1], sizes)
        self._diagonal = np.repeat(self._block_starts[:-1], sizes) + row * (np.repeat(sizes, sizes) + 1)
        self._tests: dict[str, np.ndarray] = {}
        self.out: Out | None = None  # Observations that a robust loss removes

    def restart(self, core: _photocore.NetworkTrial) -> None:
        """Continue the same network from other initial values; its groups are unchanged."""
        self.core, self._tests = core, {}

    @property
    def whole(self) -> bool:
        """Whether the network is small enough for R of all rows."""
        return int(self.suspects.row_starts[-1]) <= WHOLE

    def adjust(self, out: Out, *, exact: bool = False) -> Standing:
        tolerance = self.exact if self.whole or exact else self.rough
        standing = self._asked(
            self.core.adjust,
            out.rows,
            sorted(out.points),
            sorted(out.photos),
            tolerance=tolerance,
            progress=None,
        )
        status, _, omega, freedom, collapsed = standing
        if collapsed:
            raise LostSupportError(collapsed, [])
        return Standing(status, omega, freedom)

    def _asked(self, ask: Callable[..., T], *arguments: Any, **options: Any) -> T:
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
                own = sorted(photo for photo in photos if photo < len(self._supported))
                raise LostSupportError([], own) from error
            raise

    def stand(self) -> Standing:
        """Use the final state of the adjustment; with a loss, adjust without removed observations."""
        if self.out is not None:
            return self.adjust(self.out, exact=True)
        status, _, omega, freedom, _ = self.core.stand()
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
        inside = ~np.isnan(found["residual"])
        redundancy = np.where(inside, found["cofactors"][self._diagonal], math.nan)
        return Tests(**{name: found[name] for name in _TESTS}, redundancy=redundancy)

    def predictions(self, groups: Sequence[int]) -> list[Prediction | None]:
        found = self.core.predictions(list(groups))
        return [
            None
            if own is None
            else Prediction(
                own[0],
                tuple(int(self.suspects.row_starts[group]) + row for row in own[1]),
                tuple(own[2]),
                tuple(own[3]),
            )
            for group, own in zip(groups, found, strict=True)
        ]

    def blocks(self, groups: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return, for the points of some groups, all their groups with residuals and R."""
        points = [int(self.suspects.points[group]) for group in groups]
        on_points = iter(self.core.on_points([point for point in points if point >= 0]))
        found = []
        for group, point in zip(groups, points, strict=True):
            own: tuple[list[int], Floats, Floats] = next(on_points) if point >= 0 else ([], None, None)  # type: ignore[assignment]
            if own[0]:
                of_point, values, response = own
                rows = np.concatenate([self.suspects.rows(each) for each in of_point])
                out = np.isnan(self._tests["residual"][rows])
                response[out] = 0.0
                response[:, out] = 0.0
                found.append((of_point, np.where(out, 0.0, values), response))
            else:
                residuals = np.nan_to_num(self._tests["residual"][self.suspects.rows(group)])
                found.append(([group], residuals, self.own_block(group)))
        return found

    def gone_blocks(self, points: Sequence[int]) -> list[tuple[list[int], Floats, Floats]]:
        """Return all groups of excluded points with residuals and R as if used.

        Empty for points with additional observations, and for those that their rays do not determine.
        """
        return self.core.on_points(list(points), gone=True)

    def own_block(self, group: int) -> Floats:
        """Return R of a group."""
        start, end = self._block_starts[group : group + 2]
        size = math.isqrt(int(end - start))
        return np.asarray(self._tests["cofactors"][start:end].reshape(size, size))

    def response(self) -> tuple[Floats, Floats]:
        """Return residuals of unit weight and R of all rows; zero for excluded ones."""
        residuals = self._tests["residual"]
        out = np.isnan(residuals)
        response = self.core.responses(list(range(len(self.suspects))))
        response[out] = 0.0
        response[:, out] = 0.0
        return np.where(out, 0.0, residuals), response

    def resist(self, scale: float) -> Floats | None:
        """Adjust by Huber's, then Cauchy's loss: (G,) lengths of residuals.

        None if either diverges; the next trial then begins at the last valid state.
        """
        weights: Floats | None = None
        for loss, limit in (("huber", HUBER), ("cauchy", CAUCHY)):
            weights = self._asked(
                self.core.resist, loss, limit * scale, iterations=ROBUST_ITERATIONS, progress=None
            )
            if weights is None:
                return None
        # The weight of Cauchy's loss is 1 / (1 + (size / scale)^2).
        least = np.maximum(np.asarray(weights), 1e-12)
        return np.asarray(CAUCHY * scale * np.sqrt(np.maximum(1.0 / least - 1.0, 0.0)))

    def consequences(self, out: Out, group: int) -> tuple[set[int], set[int]]:
        """Return points with few rays, and unsupported photos, without a group."""
        suspects = self.suspects
        point, photo = int(suspects.points[group]), int(suspects.photos[group])
        points: set[int] = set()
        photos = {photo} if photo >= 0 and self._is_image[group] else set()
        leaving: Indices = np.empty(0, dtype=np.int64)
        if point >= 0 and point not in out.points:
            own = suspects.on_point(point)
            images = own[self._is_image[own]]
            rays = images[self._are_in(out, images)]
            held = own[~self._is_image[own]]
            components = sum(int((~out.rows[suspects.rows(each)]).sum()) for each in held.tolist())
            if not rays.size or (rays.size == 1 and components <= 1):
                points, leaving = {point}, rays
                photos |= {int(suspects.photos[image]) for image in rays.tolist()}
        return points, {each for each in photos if self._falls(out, each, leaving)}

    def _are_in(self, out: Out, images: Indices) -> Bools:
        return np.asarray(~out.rows[self.suspects.row_starts[images]])

    def _falls(self, out: Out, photo: int, leaving: Indices) -> bool:
        """Whether a photo is left with too few images, excluding those of removed points."""
        if self._supported[photo] or photo in out.photos:
            return False
        own = self.suspects.on_photo(photo)
        images = own[self._is_image[own]]
        gone = np.isin(images, leaving).sum() if leaving.size else 0
        return int(self._are_in(out, images).sum() - gone) < SUPPORT


def type_name(kind: int, label: str = "") -> Phrase:
    """Return the name of a type of groups, in the plural; `label` is the type of additional observations."""
    name = KINDS[kind]
    if label:
        return phrase("test.observations", kind=kind_words(label))
    return phrase("test.control" if name == "control" else f"test.{name}s")


class NamedSuspects(Suspects):
    """Observation groups of a network with their names.

    They contain arrays, not the core, so that names remain available after the tests. Subclasses return the
    parts of groups, and names of observations that are not images, control or poses.
    """

    def __init__(
        self,
        given: Given,
        core: _photocore.NetworkSuspects,
        *,
        apart: bool,  # Whether parts of a control point or of a station may be removed separately
        # Components of coordinates of points, positions and attitudes; units of the first two
        components: tuple[Sequence[str], Sequence[str], Sequence[str]],
        lengths: Sequence[str],
    ) -> None:
        kinds, subjects = (values.astype(np.int64) for values in core.subjects)
        points, photos = np.full(len(kinds), -1), np.full(len(kinds), -1)
        image, control = kinds == IMAGE, kinds == CONTROL
        points[image] = given.image_points[subjects[image]]
        photos[image] = given.image_photos[subjects[image]]
        points[control] = subjects[control]
        station = (kinds == POSITION) | (kinds == ATTITUDE)
        photos[station] = subjects[station]
        removable = np.asarray(kinds <= OBSERVATION)
        super().__init__(core.row_starts, kinds, KINDS, subjects, points, photos, removable)
        self.given, self.apart, self.components = given, apart, core.components
        self._names = dict(zip((CONTROL, POSITION, ATTITUDE), components, strict=True)) | {IMAGE: "xy"}
        images, angles = (given.image_unit,) * 2, ("rad",) * 3
        self._units = {IMAGE: images, CONTROL: lengths, POSITION: lengths, ATTITUDE: angles}

    def photos_of_point(self, point: int) -> Indices:
        groups = self.on_point(point)
        return np.asarray(self.photos[groups[self.kinds[groups] == IMAGE]])

    def loads(self, group: int) -> Indices:
        """Return the photos that a group affects."""
        kind, subject = int(self.kinds[group]), int(self.subjects[group])
        if kind == IMAGE:
            return self.photos_of_point(int(self.points[group]))
        if kind == CONTROL:
            return self.photos_of_point(subject)
        if kind in (POSITION, ATTITUDE):
            return np.array([subject])
        return self.other_loads(kind, subject)

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
        """Return the numbers of groups with removed rows, and of all used groups, by type."""
        removed = self.with_any(rows)
        found: dict[Text, tuple[int, int]] = {}
        for kind in np.unique(self.kinds[removed]).tolist():
            own = np.flatnonzero((self.kinds == kind) & (used | removed))
            types = np.array([self.type(kind, subject) for subject in self.subjects[own].tolist()])
            for each in dict.fromkeys(types[removed[own]].tolist()):
                same = types == each
                found[each] = (int(removed[own][same].sum()), int(same.sum()))
        return found

    def with_any(self, rows: Bools) -> Bools:
        """Return (G,) groups with any of some rows."""
        return np.asarray(np.logical_or.reduceat(rows, self.row_starts[:-1]))

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
    def other_loads(self, kind: int, subject: int) -> Indices: ...

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


def network_trial(block: Block, core: _photocore.NetworkTrial, *, parts: bool = True) -> NetworkTrial:
    deviations = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
    # Photos with other observations do not need their images.
    shared = {each.photo for each in block.timed if each.trajectory is not None}
    on_shared = np.array([name in shared for name in block.photo_ids], dtype=bool)
    return NetworkTrial(
        core=core,
        suspects=BlockSuspects(block, core.suspects, parts),
        supported=np.asarray(np.isfinite(deviations).all(axis=1) | on_shared),
        rough=EXACT if _datum_is_loose(block) else ROUGH,
        exact=EXACT,
    )


def _datum_is_loose(block: Block) -> bool:
    """Whether only weak weights of photos define the datum of a block.

    The standard deviations of its unknowns are then those of the datum. A step may be small relative to them
    and leave partials that contradict the cofactors by hundreds.
    """
    position_sd = block.photo_position_sd[:, :2]
    extent = np.ptp(block.photo_positions[:, :2], axis=0).max(initial=0.0)
    firm = np.isfinite(block.point_sd).any() or (position_sd < LOOSE * extent).any()
    return bool(np.isfinite(position_sd).any() and not firm)


def observations_of_core(block: Block) -> list[Observation]:
    """Return the additional observations in the order of the core: by type."""
    return [each for own in block.observations.columns for each in own.objects]


class BlockSuspects(NamedSuspects):
    """The observation groups of a block; `parts` may be removed separately."""

    def __init__(self, block: Block, core: _photocore.NetworkSuspects, parts: bool = True) -> None:
        axes = ("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z")
        plan = "rad" if block.geographic else block.linear_unit
        super().__init__(
            block, core, apart=parts, components=(axes, axes, ANGLES), lengths=(plan, plan, block.linear_unit)
        )
        self.block = block
        self.observations = observations_of_core(block)

    @cached_property
    def point_row(self) -> dict[str, int]:
        """The row of each point; computed on demand because blocks may be large."""
        return {name: row for row, name in enumerate(self.block.point_ids)}

    @cached_property
    def photo_row(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.block.photo_ids)}

    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        """Return separately removable parts of control points and stations."""
        if not self.apart:
            return None
        kind = int(self.kinds[group])
        components = self.components[self.row_starts[group] : self.row_starts[group + 1]].tolist()
        if kind == CONTROL and len(components) == 3:
            return [(0, 1, 2), (2,), (0, 1)]
        if kind in (CONTROL, POSITION, ATTITUDE) and len(components) > 1:
            return [(row,) for row in range(len(components))]
        return None

    def touched(self, group: int) -> tuple[list[int], list[int]]:
        if self.kinds[group] != OBSERVATION:
            return super().touched(group)
        own = self.observations[int(self.subjects[group])]
        return [self.point_row[name] for name in own.points], [self.photo_row[name] for name in own.photos]

    def other_loads(self, kind: int, subject: int) -> Indices:
        """Return the photos that an additional observation affects; all if common."""
        if kind != OBSERVATION:
            return np.arange(len(self.block.photo_ids))
        observation = self.observations[subject]
        if observation.moment is not None:
            return self._flown(observation.moment.trajectory)
        if isinstance(observation, Smoothness):
            smoothed = self._of_coefficients.get(id(observation.unknowns[0]))
            return np.zeros(0, dtype=np.int64) if smoothed is None else self._flown(smoothed)
        seen = [self.photos_of_point(self.point_row[name]) for name in observation.points]
        own = np.array([self.photo_row[name] for name in observation.photos], dtype=np.int64)
        return np.unique(np.concatenate([own, *seen]))

    def _flown(self, trajectory: Trajectory) -> Indices:
        return self._on_trajectories.get(id(trajectory), np.zeros(0, dtype=np.int64))

    @cached_property
    def _on_trajectories(self) -> dict[int, Indices]:
        found: dict[int, list[int]] = {}
        for each, own in zip(self.block.timed, self.block.trajectories, strict=True):
            found.setdefault(id(own), []).append(self.photo_row[each.photo])
        return {key: np.array(sorted(rows), dtype=np.int64) for key, rows in found.items()}

    @cached_property
    def _of_coefficients(self) -> dict[int, Trajectory]:
        every = {id(each): each for each in self.block.trajectories}.values()
        return {id(one): each for each in every for all_ in each.coefficients for one in all_}

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
