"""Result of a whole block, merged from the results of its nodes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, cast

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import messages_of
from photogram.arguments.types import Floats, Indices
from photogram.distributed.cut import shared_cameras
from photogram.distributed.driver import Outcome
from photogram.distributed.nodes import read_outcome
from photogram.distributed.run import Manifest, read_node, result_folder
from photogram.errors import AdjustmentError
from photogram.network.block import Block
from photogram.results.datum import datum_of
from photogram.results.result import Result
from photogram.results.result_files import read_summary
from photogram.results.saved_block import read_block_result
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram._photocore import BlockSolution
    from photogram.results.covariance import Covariances

_OF_PHOTOS = ("photo_positions", "photo_attitudes", "photo_cofactors", "photo_redundancy")
_OF_POINTS = (
    "point_positions",
    "point_cofactors",
    "point_redundancy",
    "point_rays",
    "point_last_corrections",
)
_OF_IMAGES = ("residuals", "redundancy", "standardized", "image_weights")


class InParts(Result):
    """Result of a partitioned adjustment.

    It has the attributes of :class:`Result`. Methods that need the normal equations of the whole block raise
    an error: covariances between arbitrary quantities, other datums, reliability beyond single observations.
    """

    WHOLE: ClassVar[bool] = False

    @property
    def reliability_summary(self) -> None:
        """None, because it requires a factor of all normal equations."""
        return

    def covariances(self) -> Covariances:
        """Raise an error; only covariances of single photos, points and unknowns are available."""
        self._refuse()

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise AdjustmentError(phrase("parts.one-process"))

    _trial = _in = _refuse


def merged(run: Path, manifest: Manifest, block: Block, outcome: Outcome) -> InParts:
    """Merge the results of the nodes in the order of photos, points and images of the block.

    InputError if the file of a node is missing or damaged.
    """
    counts = len(block.photo_ids), len(block.point_ids), len(block.image_xy)
    found: dict[str, np.ndarray] = {}
    orders: list[int] = []
    details: list[dict[str, Any]] = []
    owners = np.zeros(counts[0], dtype=np.int64)
    for node in range(len(manifest.tree)):
        folder = result_folder(run, node)
        details.append(read_outcome(folder))
        result = read_block_result(folder, read_summary(folder))
        part = read_node(run, manifest, node)
        own = np.flatnonzero(part.owners == node)
        for names, rows, chosen, count in (
            (_OF_PHOTOS, part.photos[own], own, counts[0]),
            (_OF_POINTS, part.points, slice(None), counts[1]),
            (_OF_IMAGES, part.images, slice(None), counts[2]),
        ):
            for name in names:
                values = getattr(result, name)
                if name not in found:
                    found[name] = np.zeros((count, *values.shape[1:]), dtype=values.dtype)
                found[name][rows] = values[chosen]
        owners[part.photos[own]] = node
        at_home = set(own.tolist())
        orders += [int(part.photos[row]) for row in result.photo_order.tolist() if row in at_home]
    rest = _rest(owners, block, outcome, orders, details) | {"datum": manifest.held}
    solution = cast("BlockSolution", SimpleNamespace(**found, **rest))
    datum = datum_of(block, solution, manifest.datum)
    options = manifest.options
    messages = messages_of(block, solution, options, datum)
    freedom = outcome.degrees_of_freedom
    return InParts.from_solution(block, solution, options, datum, messages, freedom)


def _rest(
    owners: Indices, block: Block, outcome: Outcome, order: list[int], details: list[dict[str, Any]]
) -> dict[str, Any]:
    """Return the attributes of a solution that are not arrays of photos, points and images."""
    redundancies = [each["redundancies"] for each in details]
    sums = None if None in redundancies else tuple(map(math.fsum, zip(*redundancies, strict=True)))
    observations, weighted, unknowns = outcome.counts
    excess = None if sums is None else math.fsum(sums) - (observations + weighted - unknowns)
    return {
        "status": outcome.status,
        "state": _photocore.BlockState([], [], [], [], "input", None, False),
        "initial_sum_of_squares": outcome.initial_sum_of_squares,
        "iterations": [tuple(vars(each).values()) for each in outcome.iterations],
        "photo_corrections": np.zeros((0, len(block.photo_ids), 6)),
        "photo_order": np.array(order, dtype=np.int64),
        "undetermined": None,
        "redundancy_excess": excess,
        "redundancies": sums,
        "variance_of_unit_weight": outcome.variance_of_unit_weight,
        "counts": outcome.counts,
        "ordering": "parts",
        "predictions": {},
        "operations": _added(each["operations"] for each in details),
        "formations": outcome.formations,
        "seconds": _added(each["seconds"] for each in details),
        "images_behind": np.array(sorted(_all(details, "behind")), dtype=np.int64),
        "images_folded": np.array(sorted(_all(details, "folded")), dtype=np.int64),
        "loose_photos": sorted(set(_all(details, "loose"))),
        "weak_points": sorted(map(tuple, _all(details, "weak_points"))),
        "weak": [],
        "weak_cameras": [],
        "weak_unknowns": [],
        "datum_unknowns": [],
        "relative_error": max(each["relative_error"] for each in details),
        "minimal_control": False,
        "adjusted_unknowns": _unknowns(block, details),
        "cameras": _cameras(block, owners, details),
        "dropped": sorted((int(row), str(reason)) for row, reason in _all(details, "dropped")),
        "sums_of_squares": outcome.sums_of_squares,
        # In the order of the observation groups of the whole block
        "adjusted_observations": _observed(block, details),
        "degrees_of_freedom": outcome.degrees_of_freedom,
    }


def _observed(block: Block, details: list[dict[str, Any]]) -> tuple[Indices, Floats, Floats]:
    """Return the adjusted observations in the order of the observation groups of the whole block."""
    of_rows = {row: (np.array(values, dtype=float), own) for row, values, own in _all(details, "observed")}
    found = [of_rows[row] for row in block.observations.core_order]
    values = [np.zeros((3, 0)), *(own for own, _ in found)]
    sums = np.array([own for _, own in found], dtype=float).reshape(-1, 2)
    return np.array([own.shape[1] for own in values[1:]], dtype=np.int64), np.hstack(values), sums.T


def _all(details: list[dict[str, Any]], name: str) -> Iterator[Any]:
    for each in details:
        yield from each[name]


def _added(tables: Iterable[dict[str, float]]) -> dict[str, float]:
    total: dict[str, float] = {}
    for each in tables:
        for name, value in each.items():
            total[name] = total.get(name, 0.0) + value
    return total


def _cameras(block: Block, owners: Indices, details: list[dict[str, Any]]) -> list[Any]:
    """Return the adjusted cameras, from the root if they have several photos, else from their node.

    Contributions to normal equations and image counts are added over the nodes.
    """
    if block.photo_cameras is None:
        return []
    photos = np.bincount(block.photo_cameras, minlength=len(block.cameras)).tolist()
    homes = np.full(len(block.cameras), len(details) - 1, dtype=np.int64)
    homes[block.photo_cameras] = owners
    homes[shared_cameras(block)] = len(details) - 1
    rows = []
    for camera, given in enumerate(block.cameras):
        each = [own["cameras"][camera] for own in details]
        covariance = given.prior_covariance
        values, cofactors, redundancy = _of_home(
            [row[:3] for row in each], int(homes[camera]), given.deviations, covariance
        )
        normal = np.sum([row[3] for row in each], axis=0).tolist()
        rows.append((values, cofactors, redundancy, normal, photos[camera], sum(row[5] for row in each)))
    return rows


def _unknowns(block: Block, details: list[dict[str, Any]]) -> list[Any]:
    """Return the adjusted shared unknowns, with the observations of all nodes."""
    found: list[Any] = []
    known: list[list[Any]] = [[] for _ in block.unknowns]
    for row, own in _all(details, "unknowns"):
        known[row].append(own)
    for given, each in zip(block.unknowns, known, strict=True):
        # The last node with an unknown is the root or, for a film, the node of its photo.
        change, cofactors, redundancy = _of_home(
            [(own[0], own[3], own[5]) for own in each], len(each) - 1, given.deviations, None
        )
        _, position, attitude, _, with_former, *_ = each[-1]
        observed = sum(own[6] for own in each)
        found.append((change, position, attitude, cofactors, with_former, redundancy, observed))
    return found


def _of_home(
    rows: list[Any], home: int, deviations: Floats, covariance: Floats | None
) -> tuple[list[float], list[float], list[float]]:
    """Return values, cofactors and redundancy numbers of an unknown of several nodes.

    A node without observations of it cannot provide cofactors. They are then taken from another node, and the
    redundancy numbers of weights are computed from R = I - Q P.
    """
    values, cofactors, redundancy = rows[home]
    if np.isfinite(np.array(cofactors, dtype=float)).all():
        return values, cofactors, redundancy
    shown = next((row[1] for row in rows if np.isfinite(np.array(row[1], dtype=float)).all()), cofactors)
    q = np.array(shown, dtype=float).reshape(len(deviations), len(deviations))
    weighted = np.flatnonzero((deviations > 0) & np.isfinite(deviations))
    prior = np.diag(deviations[weighted] ** 2) if covariance is None else covariance
    of_weights = 1.0 - np.diagonal(q[np.ix_(weighted, weighted)] @ np.linalg.inv(prior))
    found = np.zeros(len(deviations))
    found[weighted] = of_weights
    return values, shown, found.tolist()
