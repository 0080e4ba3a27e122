"""Groups of the observations of a network: by kind, camera, strip, photo, rays, or labels of the user."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import argument_error, by_occurrence, value_field
from photogram.arguments.types import Bools, Floats, Indices
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.motion import on_shared
from photogram.network.observations import moments
from photogram.network.rays import local_axes
from photogram.network.strips import strips_of
from photogram.network.unadjusted import Given
from photogram.results.datum import point_kinds
from photogram.results.network import AdjustedNetwork
from photogram.statistics.components import GroupsOf
from photogram.words import phrase

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


def grouped(of: Observables, groups: GroupsArgument) -> Grouping:
    """Return groups of observations by bases or labels of the user (docs/weights.md); refuse others.

    All bases except `kind` and `component` divide the images only; others are grouped by type. Several bases
    define a group for each combination. Observations without a label (None or an empty text) keep their
    weights.
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
    """Return names of groups of images, and the number of the group of each image."""
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


def _numbered(of: Observables, labels: dict[str, _Labels], parents: dict[str, str]) -> Grouping:
    """Assign numbers to the groups, first those of images."""
    numbers: dict[str, int] = {"": -1}

    def enter(names: Sequence[str], codes: Indices) -> None:
        for code in by_occurrence(codes.ravel()).tolist():
            numbers.setdefault(names[code], len(numbers) - 1)

    def number(part: str, used: Any = ...) -> Indices:
        names, codes = labels[part]
        enter(names, codes[used])
        found = np.full(codes.shape, -1, dtype=np.int64)
        found[used] = np.array([numbers.get(name, -1) for name in names], dtype=np.int64)[codes[used]]
        return found

    # In the order of the photos, independent of the order of the images.
    names, codes = labels["images"]
    enter(names, codes[np.argsort(of.given.image_photos, kind="stable")])
    images = number("images")
    of_images = len(numbers) - 1
    points, photos = number("points", of.point_observed), number("photos", of.photo_observed)
    observations = number("observations")
    known = tuple(name for name in numbers if name)
    groups = GroupsOf(
        known,
        tuple(parents.get(name, "") for name in known),
        tuple(number < of_images for number in range(len(known))),
    )
    return Grouping(
        groups, images, points, photos, observations, of.commons, len(of.camera_names), of.records
    )


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
    flown: dict[int, list[int]] = {}
    for row, name in enumerate(block.photo_ids):
        if name in own:
            flown.setdefault(id(own[name]), []).append(row)
    others = np.flatnonzero(~on_shared(block))
    found = strips_of(local_axes(block).positions(block.photo_positions)[others]) if len(others) else []
    return [*(others[strip] for strip in found), *(np.array(rows, dtype=np.int64) for rows in flown.values())]
