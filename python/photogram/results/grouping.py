"""Groups of observations: by type, camera, strip, photo ..., or user labels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import argument_error, value_field
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.unadjusted import Given
from photogram.statistics.components import GroupsOf

GroupsArgument = str | Sequence[str] | Mapping[str, Any]
"""A basis, several of them (every combination is a group), or labels by part of the network."""

BASES = ("kind", "camera", "strip", "photo", "point class", "component", "rays")  # Bases of groups
PARTS = ("images", "control", "stations", "observations")  # Parts with labels of the user
MANY_RAYS = 5  # Smallest number of rays of the last group

_Labels = NDArray[np.object_]


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
        photos = np.vstack([self.photos[:, :6], np.full((self.records, 6), -1)])
        none = [-1] * (self.cameras + (self.records > 0))
        return (
            self.count,
            self.images,
            self.points,
            np.ascontiguousarray(photos),
            none,
            [-1] * self.commons,
            self.observations.tolist(),
        )

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


def grouped(of: Observables, groups: GroupsArgument) -> Grouping:
    """Return groups of observations; refuse other bases and invalid labels.

    Groups are by `kind`, `camera`, `strip`, `photo`, `point class`, `rays` (of the point; five and more
    together), or `component` (x and y, plan and height of control, positions and attitudes of stations). All
    except `kind` and `component` divide the images only; others are grouped by type. Several bases define a
    group for each combination. Alternatively, user labels: a mapping with arrays of `images` (m,) or (m, 2),
    `control` (n,) or (n, 3), `stations` (P,) or (P, k), `observations` (o,). Observations without a label
    (None or an empty text) keep their weights. Parts without labels are grouped by type.
    """
    if isinstance(groups, Mapping):
        labels = _own(of, groups)
    else:
        bases = tuple(groups) if isinstance(groups, list | tuple) else (groups,)
        for basis in bases or (None,):
            if not isinstance(basis, str) or basis not in BASES:
                raise argument_error("groups", "choice", names=[*BASES], value=value_field(basis))
        labels = _by(of, bases)
    return _numbered(of, *labels)


_Labelled = tuple[dict[str, _Labels], dict[str, str]]
"""Labels of images, points, photos and observations, and the larger group of each label."""


def _by(of: Observables, bases: Sequence[str]) -> _Labelled:
    components = "component" in bases
    of_images = [_images_by(of, basis) for basis in bases if basis not in ("kind", "component")]
    named = np.full(len(of.given.image_photos), "images", dtype=object)
    if of_images:
        named[:] = [", ".join(("images", *parts)) for parts in zip(*of_images, strict=True)]
    images = np.stack([named, named], axis=1)
    parents: dict[str, str] = {}
    if of_images:
        parents |= dict.fromkeys(named.tolist(), "other images")
    if components:
        for axis in (0, 1):
            images[:, axis] = [f"{each}, {'xy'[axis]}" for each in named.tolist()]
            parents |= dict(zip(images[:, axis].tolist(), named.tolist(), strict=True))
    points = np.full(of.point_observed.shape, "control", dtype=object)
    if components:
        points[:] = ["control, plan", "control, plan", "control, height"]
        parents |= dict.fromkeys(("control, plan", "control, height"), "control")
    photos = np.empty(of.photo_observed.shape, dtype=object)
    photos[:] = of.stations
    parents |= dict.fromkeys(of.stations, "stations")
    observations = np.array([each.label for each in of.given.observations], dtype=object)
    labels = {"images": images, "points": points, "photos": photos, "observations": observations}
    return labels, parents


def _images_by(of: Observables, basis: str) -> list[str]:
    photos, seen = of.given.image_photos.tolist(), of.given.image_points
    if basis == "photo":
        return [f"photo {of.given.photo_ids[photo]}" for photo in photos]
    if basis == "camera":
        return [f"camera {of.camera_names[of.photo_cameras[photo]]}" for photo in photos]
    if basis == "strip":
        number = np.empty(len(of.photo_cameras), dtype=np.int64)
        for strip, members in enumerate(of.strips(), 1):
            number[members] = strip
        return [f"strip {number[photo]}" for photo in photos]
    if basis == "point class":
        return [f"{each} points" for each in of.point_classes[seen].tolist()]
    rays = np.bincount(seen, minlength=len(of.point_classes))[seen]
    return [f"{each} rays" if each < MANY_RAYS else f"{MANY_RAYS} rays and more" for each in rays.tolist()]


def _own(of: Observables, given: Mapping[str, Any]) -> _Labelled:
    unknown = set(given) - set(PARTS)
    if unknown:
        raise argument_error("labels", "choice", names=[*PARTS], value=min(map(str, unknown)))
    labels, parents = _by(of, ["kind"])
    for name, part in zip(PARTS, labels, strict=True):
        if name in given:
            default, own = labels[part], np.asarray(given[name], dtype=object)
            if own.shape == default.shape[:1] and default.ndim == 2:
                own = np.repeat(own[:, np.newaxis], default.shape[1], axis=1)
            if own.shape != default.shape:
                shapes = f"{default.shape[:1]} or {default.shape}"
                raise argument_error(f"labels of {name}", "shape", shape=shapes, actual=own.shape)
            labels[part] = np.vectorize(_text, otypes=[object])(own) if own.size else own
    return labels, parents


def _text(label: object) -> str:
    missing = label is None or (isinstance(label, float) and np.isnan(label))
    return "" if missing else str(label)


def _numbered(of: Observables, labels: dict[str, _Labels], parents: dict[str, str]) -> Grouping:
    """Assign numbers to the groups, first those of images."""
    numbers: dict[str, int] = {"": -1}

    def enter(found: list[str]) -> None:
        for label in dict.fromkeys(found):
            numbers.setdefault(label, len(numbers) - 1)

    def number(part: _Labels, used: Any = ...) -> Indices:
        found, flat = np.full(part.shape, -1, dtype=np.int64), part[used].ravel().tolist()
        enter(flat)
        found[used] = np.fromiter(map(numbers.__getitem__, flat), np.int64).reshape(part[used].shape)
        return found

    # In the order of the photos, independent of the order of the images.
    enter(labels["images"][np.argsort(of.given.image_photos, kind="stable")].ravel().tolist())
    images = number(labels["images"])
    of_images = len(numbers) - 1
    points, photos = number(labels["points"], of.point_observed), number(labels["photos"], of.photo_observed)
    observations = number(labels["observations"])
    names = tuple(name for name in numbers if name)
    groups = GroupsOf(
        names,
        tuple(parents.get(name, "") for name in names),
        tuple(number < of_images for number in range(len(names))),
    )
    counts = of.commons, len(of.camera_names), of.records
    return Grouping(groups, images, points, photos, observations, *counts)
