"""Folder of a run: the tree, shared names, the parts, and the progress of iterations."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import named
from photogram.arguments.types import Floats, Indices
from photogram.distributed.cut import (
    Tree,
    alone_of,
    cut,
    homes,
    incidence_of,
    photos_of_unknowns,
    shared_cameras,
    vertices_of,
)
from photogram.distributed.files import read_json, write_json
from photogram.distributed.parts import Names, Part, names_above, part_of, read_part, write_part
from photogram.errors import AdjustmentError, InputError
from photogram.io.structure import Decoder, Encoder
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.block import Block, flown_by
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import DatumRow
from photogram.network.motion import timed_images, timed_photos
from photogram.network.observations import Observation
from photogram.network.observations.photos import with_epochs
from photogram.network.trajectories import Spline, Trajectory
from photogram.network.unknowns import Unknown
from photogram.results.parts import Iteration
from photogram.words import phrase

MANIFEST = "run.json"
PROGRESS = "progress.json"


@dataclass(frozen=True)
class Manifest:
    """Data shared by all nodes of a run.

    `version` is the version of the package, `source` the hash of the block, and `outer` the names that each
    node passes up. `middle` (3,) is the median position of all photos. `weighted`, `photos`, `points` and
    `images` count weighted unknowns, photos, points and images at home in each node; `seals` are the seals of
    the parts. `held` contains photos and indices of unknowns that are fixed if nothing defines a datum.
    `datum` is the final datum; None: no transformation.
    """

    version: str
    source: str
    tree: Tree
    outer: list[Names]
    middle: tuple[float, float, float]
    options: CoreOptions
    weighted: list[int]
    photos: list[int]
    points: list[int]
    images: list[int]
    seals: list[str]
    held: list[tuple[int, int]]
    datum: DatumRow | None = None


def part_folder(run: Path, number: int) -> Path:
    return run / "parts" / f"{number:05d}"


def result_folder(run: Path, number: int) -> Path:
    return run / "results" / f"{number:05d}"


def places_of(block: Block) -> Floats:
    """Return (P, 3) positions of photos in one unit of length, for cutting."""
    positions = np.array(block.photo_positions)
    if block.spheroid is not None:
        positions[:, 0] *= block.spheroid.a * np.cos(np.mean(positions[:, 1]))
        positions[:, 1] *= block.spheroid.a
    return positions


def partition(
    block: Block,
    run: Path,
    parts: int,
    options: CoreOptions,
    source: str,
    datum: DatumRow | None = None,
) -> Manifest:
    """Cut an oriented block into parts on disk, in a new folder.

    AdjustmentError if the folder is not writable, or a datum is specified for a block that is not free.
    Others as in :func:`photogram.adjust`, before its first iteration.
    """
    # An adjustment of the whole block fixes them if nothing else defines a datum.
    held: list[tuple[int, int]] = []
    if not np.isfinite(block.point_sd[np.unique(block.image_points)]).any():
        try:
            held = block_network(block, options).held_for_datum(threads=0)
        except _photocore.BlockError as error:
            raise named(block, *error.args) from None
    if datum is not None and not held:
        raise AdjustmentError(phrase("parts.not-free"))
    block = with_flights(block)
    # A node has only some observations of a drift.
    block = block.replace(observations=with_epochs(block.observations))
    incidence, edges, of_observations = incidence_of(block)
    images = np.bincount(vertices_of(block)[block.image_photos], minlength=len(block.photo_ids))
    found = cut(places_of(block), images.astype(float), lambda: [incidence], parts)
    # Observations of shared unknowns without photos or points are at home in the root.
    nodes = homes(found.owners, incidence, found.tree.root)
    of_points = nodes[edges]
    at_home = {"points": of_points, "images": of_points[block.image_points]}
    at_home["observations"] = nodes[of_observations]
    # A photo on a frame or trajectory belongs to the node of its representing photo.
    owners = found.owners[vertices_of(block)]
    return divided(
        block,
        run,
        found.tree,
        lambda node, below: part_of(block, owners, at_home, node, below),
        options,
        source,
        held,
        datum,
    )


def divided(
    block: Block,
    run: Path,
    tree: Tree,
    part_at: Callable[[int, Names], Part],
    options: CoreOptions,
    source: str,
    held: list[tuple[int, int]],
    datum: DatumRow | None = None,
) -> Manifest:
    """Write the parts of a block sequentially; `part_at` receives the names of nodes below.

    The block may exclude points and images. AdjustmentError if the folder is not writable.
    """
    shared, of_unknowns, alone = shared_cameras(block), photos_of_unknowns(block), alone_of(block)
    outer: list[Names] = []
    seals: list[str] = []
    counts: list[tuple[int, int, int, int]] = []
    for node in range(len(tree)):
        children = [outer[child] for child in tree.children[node]]
        below = Names(*(sorted({row for each in children for row in each[k]}) for k in range(3)))
        part, root = part_at(node, below), node == tree.root
        above = Names([], [], []) if root else names_above(part, below, shared, of_unknowns, alone)
        outer.append(above)
        folder = part_folder(run, node)
        folder.mkdir(parents=True, exist_ok=True)
        seals.append(write_part(folder, part))
        own = np.flatnonzero(part.owners == node)
        stations = _weighted(part.block, own, shared, alone, part.common if root else None)
        counts.append((stations, len(own), len(part.points), len(part.images)))
    x, y, z = np.median(block.photo_positions, axis=0).tolist()
    of_nodes: Any = map(list, zip(*counts, strict=True))
    names = ("weighted", "photos", "points", "images")
    facts = dict(zip(names, of_nodes, strict=True)) | {"seals": seals, "held": held, "datum": datum}
    manifest = Manifest(_photocore.__version__, source, tree, outer, (x, y, z), options, **facts)
    # This file completes a partition.
    write_json(run / MANIFEST, Encoder().fields(manifest))
    return manifest


def _weighted(
    block: Block,
    own: Indices,
    shared: Indices,
    alone: Mapping[int, str],
    common: Sequence[Unknown] | None,
) -> int:
    """Count the weighted unknowns of photos, cameras and shared unknowns in a node.

    `common` are the shared unknowns of the whole block for the root, None otherwise. Unknowns in `alone`
    belong to the node of their photo.
    """
    names = {block.photo_ids[row] for row in own.tolist()}
    sd = [np.hstack([block.photo_position_sd[own], block.photo_attitude_sd[own]]).ravel()]
    cameras = set() if block.photo_cameras is None else set(block.photo_cameras[own].tolist())
    cameras -= set(shared.tolist())
    if common is not None:
        cameras |= set(shared.tolist())
        sd += [each.deviations for each in common if id(each) not in alone]
    sd += [each.deviations for each in block.unknowns if alone.get(id(each)) in names]
    sd += [block.cameras[row].deviations for row in sorted(cameras)]
    return sum(int(np.count_nonzero(np.isfinite(each) & (each > 0))) for each in sd)


def read_manifest(run: Path) -> Manifest:
    """Read the data shared by all nodes; InputError if the version differs or the file is damaged."""
    document = read_json(run / MANIFEST)
    if (started := document.get("version")) != (version := _photocore.__version__):
        raise InputError(phrase("parts.other-version", version=version, started=started), file=run / MANIFEST)
    members = Decoder((CoreOptions, Tree), run / MANIFEST).fields(document)
    return Manifest(**members | {"outer": [Names(*rows) for rows in members["outer"]]})


def read_node(run: Path, manifest: Manifest, number: int) -> Part:
    """Read the part of a node; InputError if it is missing, damaged, or of another node or run."""
    return read_part(part_folder(run, number), manifest.seals[number])


def with_flights(block: Block) -> Block:
    """Return a block with explicit trajectories and times, which do not depend on its other data.

    A photo with its own motion has a given trajectory, a scanner has the mean time of all its images.
    Smoothness is represented by observations only, each at home in one node.
    """
    if not flown_by(block):
        return block
    told = {id(each): _unsmoothed(each) for each in block.all_trajectories}
    timed = [
        replace(own, trajectory=told[id(trajectory)], time=own.images(block.image_xy[rows])[0])
        for own, trajectory, _, rows in timed_images(block)
    ]
    on_trajectories = timed_photos(block)[:, np.newaxis]
    return block.replace(
        timed=timed,
        observations=[_told(each, told) for each in block.observations],
        photo_position_sd=np.where(on_trajectories, np.inf, block.photo_position_sd),
        photo_attitude_sd=np.where(on_trajectories, np.inf, block.photo_attitude_sd),
    )


def _told(observation: Observation, trajectories: dict[int, Trajectory]) -> Observation:
    moment = observation.moment
    if moment is None or trajectories[id(moment.trajectory)] is moment.trajectory:
        return observation
    changes: dict[str, Any] = {"trajectory": trajectories[id(moment.trajectory)]}
    return replace(observation, **changes)


def _unsmoothed(trajectory: Trajectory) -> Trajectory:
    """Return a trajectory with the same coefficients but without their joint observations."""
    changes: dict[str, Any] = {
        name: replace(basis, smooth=None, correlation=None)
        for name in ("position", "rotation")
        if isinstance(basis := getattr(trajectory, name), Spline) and basis.smoothed
    }
    changed = replace(trajectory, **changes)
    return changed._with_coefficients(trajectory.coefficients) if changes else trajectory


@dataclass
class Course:
    """Progress of the iterations.

    `curved`: the state includes the second-order term of a loss. `near`: later states will include it.
    `chord`: length of the chord after the last step, if any. `ending`, after the last iteration: the status,
    the state whose equations give cofactors, and the final state.
    """

    state: str = "0"
    before: str = "0"
    damping: float = 0.0
    curved: bool = False
    near: bool = False
    best: float = math.nan
    initial: float = math.nan
    refused: float | None = None
    chord: float | None = None
    ending: tuple[str, str, str] | None = None
    trials: int = 0
    formations: int = 0
    iterations: list[Iteration] = field(default_factory=list)

    def write(self, run: Path, source: str) -> None:
        """Write the progress to the folder of a run, with the hash of its block."""
        write_json(run / PROGRESS, Encoder().fields(self) | {"source": source})

    @classmethod
    def read(cls, run: Path, source: str) -> Course:
        """Read the progress of a run; the initial state without a file.

        InputError if the file is damaged or of another run.
        """
        if not (run / PROGRESS).is_file():
            return cls()
        document = read_json(run / PROGRESS)
        if document.pop("source", None) != source:
            raise InputError(phrase("parts.other-progress"), file=run / PROGRESS)
        return cls(**Decoder((Iteration,), run / PROGRESS).fields(document, cls))
