"""Nodes of a block in the core: creation from parts on disk, storage of results, and their datum."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np

from photogram import _photocore
from photogram.adjustment.adjustment import named
from photogram.arguments.types import Floats, Indices
from photogram.distributed.files import read_json, write_file, write_json
from photogram.distributed.parts import Names, Part
from photogram.distributed.run import Manifest, read_manifest, read_node, result_folder
from photogram.io.structure import Decoder, Encoder
from photogram.lazy_dataclasses import replace
from photogram.network.block import Block
from photogram.network.core_arrays import block_network
from photogram.network.datum import DatumRow
from photogram.results.block_files import block_files
from photogram.results.datum import datum_of, refused
from photogram.results.result import Result
from photogram.results.result_files import read_summary
from photogram.results.saved_block import read_block_result

if TYPE_CHECKING:
    from photogram._photocore import BlockSolution

OUTCOME = "outcome.json"


class CoreEngine:
    def node(self, run: Path, number: int) -> _photocore.Node:
        """Return a node; InputError for a damaged part, others as in :func:`photogram.adjust`."""
        manifest = read_manifest(run)
        part = read_node(run, manifest, number)
        own = len(part.block.unknowns)
        # Fixed unknowns are specified below.
        options = replace(manifest.options, minimum=None)
        network = block_network(part.block, options, part.common[own:])
        rows = [
            {row: place for place, row in enumerate(each)}
            for each in (part.photos.tolist(), range(len(part.block.cameras)), part.unknowns.tolist())
        ]

        def local(names: Names) -> list[tuple[str, int]]:
            kinds = zip(("photo", "camera", "unknown"), rows, names, strict=True)
            return [(kind, places[row]) for kind, places, each in kinds for row in each]

        places = rows[0]
        held = [(places[photo], number) for photo, number in manifest.held if photo in places]
        children = [local(manifest.outer[child]) for child in manifest.tree.children[number]]
        try:
            return network.node(
                local(manifest.outer[number]), children, middle=manifest.middle, threads=0, held=held
            )
        except _photocore.BlockError as error:
            raise named(part.block, *error.args, unknowns=part.common) from None

    def stations(self, run: Path, number: int) -> int:
        """Return the number of weighted unknowns of photos and cameras in a node."""
        return read_manifest(run).weighted[number]

    def failure(self, run: Path, number: int, undetermined: Any) -> Exception:
        """Convert undetermined unknowns of a node to an error with names."""
        part = read_node(run, read_manifest(run), number)
        return named(part.block, *undetermined, unknowns=part.common)

    def keep(self, run: Path, number: int, solution: BlockSolution, variance: float | None) -> None:
        """Write the result of a node to a folder for :func:`photogram.read_result`."""
        manifest = read_manifest(run)
        part = read_node(run, manifest, number)
        folder = result_folder(run, number)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / OUTCOME).unlink(missing_ok=True)
        scaled = cast("BlockSolution", _Scaled(part, solution, variance))
        row = None if manifest.datum is None else local_row(manifest.datum, part.photos, part.points)
        datum = datum_of(part.block, solution, row, held=manifest.held)
        freedom = solution.degrees_of_freedom
        _write(folder, _OfNode.from_solution(part.block, scaled, manifest.options, datum, [], freedom))
        # Data without a table; rows refer to the whole block.
        places = [int(part.observations[row]) for row in part.block.observations.core_order]
        counts, values, sums = solution.adjusted_observations
        of_rows = np.split(values, np.cumsum(counts)[:-1], axis=1) if places else []
        outcome = {
            "sums_of_squares": solution.sums_of_squares,
            "redundancies": solution.redundancies,
            "behind": part.images[solution.images_behind].tolist(),
            "folded": part.images[solution.images_folded].tolist(),
            "loose": part.photos[solution.loose_photos].tolist(),
            "weak_points": [(int(part.points[row]), *rest) for row, *rest in solution.weak_points],
            "dropped": [(int(part.points[row]), reason) for row, reason in solution.dropped],
            "cameras": solution.cameras,
            "unknowns": list(zip(part.unknowns.tolist(), solution.adjusted_unknowns, strict=True)),
            "observed": list(zip(places, of_rows, sums.T, strict=True)),
            "relative_error": solution.relative_error,
            "operations": solution.operations,
            "seconds": solution.seconds,
        }
        # This file is written last and marks the node as finished.
        write_json(folder / OUTCOME, Encoder().value(outcome))

    def unknowns(self, run: Path, number: int, node: _photocore.Node) -> Indices:
        """Return (N, 3) owners of the unknowns of a node, as rows of the whole block."""
        part, names = read_node(run, read_manifest(run), number), node.unknown_names
        cameras = np.arange(len(part.block.cameras))
        for kind, rows in enumerate((part.photos, cameras, part.unknowns, part.points)):
            own = names[:, 0] == kind
            names[own, 1] = rows[names[own, 1]]
        return names

    def redundancies(self, run: Path, number: int) -> tuple[float, float, float, float]:
        """Return the sums of redundancy numbers by type from the results of a node."""
        camera, ground, plates, others = read_outcome(result_folder(run, number))["redundancies"]
        return camera, ground, plates, others

    def settle(self, run: Path, number: int, variance: float | None) -> None:
        """Scale the results of a node by the variance of unit weight of the whole block."""
        folder = result_folder(run, number)
        found = read_block_result(folder, read_summary(folder))
        scale = 1.0 if variance is None else variance
        cameras = tuple(replace(each, covariance=scale * each.cofactors) for each in found.cameras)
        unknowns = tuple(replace(each, covariance=scale * each.cofactors) for each in found.unknowns)
        _write(folder, replace(found, variance_of_unit_weight=variance, cameras=cameras, unknowns=unknowns))


def _write(folder: Path, result: Result) -> None:
    for name, content in block_files(result).items():
        write_file(folder / name, content)


def read_outcome(folder: Path) -> dict[str, Any]:
    """Read the data of a node without a table; InputError if missing or damaged."""
    path = folder / OUTCOME
    found: dict[str, Any] = Decoder([], path).value(read_json(path))
    return found


class _OfNode(Result):
    """Result of a node; it cannot form the normal equations of the block."""

    WHOLE: ClassVar[bool] = False


class _Scaled:
    """Core solution of a node with the variance of unit weight of the whole block.

    It excludes the history of photos, and unknowns that the block of the node does not observe.
    """

    def __init__(self, part: Part, solution: BlockSolution, variance: float | None) -> None:
        self._solution = solution
        self.variance_of_unit_weight = variance
        self.photo_corrections = np.zeros((0, len(part.photos), 6))
        self.adjusted_unknowns = solution.adjusted_unknowns[: len(part.block.unknowns)]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._solution, name)


def nodes_in_datum(
    block: Block, manifest: Manifest, nodes: Sequence[tuple[Indices, Floats]]
) -> list[dict[str, np.ndarray]]:
    """Transform an adjusted block to inner constraints: values (N,) and names (N, 3) of its nodes.

    Names are of the unknowns in the whole block. Return for each node the new `values` (N,) and the columns
    `b` and `t` (d, N). Also return the `condition`, a measure of rounding errors, and the unknowns `staying`
    in the datum. InputError if points and photos do not define the datum; others as in
    :func:`photogram.adjust`.
    """
    assert manifest.datum is not None
    names, values = (np.concatenate(each) for each in zip(*nodes, strict=True))
    network, middle = block_network(block, manifest.options), manifest.middle
    try:
        moved, *columns, condition, exact = network.parts_in_datum(
            manifest.datum, manifest.held, middle=middle, names=names.ravel(), values=values, threads=0
        )
    except _photocore.BlockError as error:
        raise refused(block, network, None, error) from None
    b, t = (each.reshape(-1, len(values)) for each in columns)
    found, start = [], 0
    for _, own in nodes:
        rows = slice(start, start + len(own))
        start += len(own)
        staying = np.flatnonzero(b[:, rows].any(axis=0)) if exact else np.zeros(0, dtype=np.int64)
        arrays = {"values": moved[rows], "b": b[:, rows], "t": t[:, rows]}
        found.append({**arrays, "condition": np.array(condition), "staying": staying})
    return found


def local_row(row: DatumRow, photos: Indices, points: Indices) -> DatumRow:
    """Restrict a datum to the photos and points of a node."""
    name, of_points, of_photos, scale, attitudes, radius = row

    def own(rows: Indices, chosen: list[int]) -> list[int]:
        found: list[int] = np.flatnonzero(np.isin(rows, chosen)).tolist()
        return found

    return name, own(points, of_points), own(photos, of_photos), scale, own(photos, attitudes), radius
