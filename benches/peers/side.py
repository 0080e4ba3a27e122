"""One side of the comparison, alone in its process: python benches/peers/side.py SIDE STEM OUTPUT SECONDS.

SIDE is photogram (photogram:1 on one thread), gtsam or apex-solver (gtsam:SETTING for another than its
fastest), pycolmap (pycolmap:own-solver with the linear solver that it chooses) or symforce.
STEM.pickle holds the block with the initial points; what the side found is written to OUTPUT.json and
OUTPUT.npz. A process of its own makes the peak of its memory its own. SECONDS limit gtsam's marginals;
0 leaves the covariances of the peers out.
"""

from __future__ import annotations

import itertools
import json
import pickle
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from solution import Floats, Solution

import photogram

T = TypeVar("T")

SAMPLE = 20
"""Photographs and points whose covariances are compared."""


class Record:
    """What is written about a run: seconds of its steps, the highest memory after each of them."""

    def __init__(self) -> None:
        self.values: dict[str, Any] = {"seconds": {}, "peak": {}}

    def time(self, step: str, work: Callable[[], T]) -> T:
        """Do a step of the work."""
        start = time.perf_counter()
        done = work()
        self.values["seconds"][step] = time.perf_counter() - start
        self.values["peak"][step] = peak_bytes()
        return done


def peak_bytes() -> int:
    """Return the highest resident memory of this process so far.

    Not `getrusage`: there a child starts with the peak of the process that started it.
    """
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return 1024 * int(line.split()[1])
    raise OSError("/proc/self/status tells no VmHWM")


def sample(block: photogram.Block) -> tuple[list[int], list[int]]:
    """Photographs and points at random, the same for every side."""
    random = np.random.default_rng(0)
    photos = random.choice(len(block.photo_ids), min(SAMPLE, len(block.photo_ids)), replace=False)
    points = random.choice(np.unique(block.image_points), SAMPLE, replace=False)
    return photos.tolist(), points.tolist()


def run_photogram(block: photogram.Block, record: Record, threads: int | None) -> dict[str, Floats]:
    """Adjust with every covariance and redundancy number; the points are intersected within."""
    # What a first adjustment loads is loaded, as the libraries of the peers are.
    photogram.adjust(photogram.simulate(strips=2, photos_per_strip=3, seed=1).block)
    result = record.time("everything", lambda: photogram.adjust(block, threads=threads))
    rays = result.point_rays.astype(float)
    record.values |= {
        "ordering": result.ordering,
        "degrees_of_freedom": result.degrees_of_freedom,
        "phases": dict(result.seconds),
        "operations": dict(result.operations),
        "formations": result.formations,
        "rays": [float(rays.sum()), float((rays**2).sum())],
    }
    of_photos, of_points = sample(block)
    return _arrays(Solution.of(result), record) | {
        "photo_cofactors": result.photo_cofactors[of_photos],
        "point_cofactors": result.point_cofactors[of_points],
        "photo_sd": result.photo_sd,
        "point_sd": result.point_sd,
    }


def run_gtsam(
    block: photogram.Block, points: Floats, record: Record, limit: float, setting: str
) -> dict[str, Floats]:
    """Order and optimize; then the marginals of the sample and of as many others as there is time for."""
    import gtsam
    import gtsam_block

    optimizer = gtsam_block.SETTINGS[setting or gtsam_block.FASTEST]
    problem = record.time("building", lambda: gtsam_block.factor_graph(block, points))
    run, values = record.time("solution", lambda: gtsam_block.solve(problem, optimizer))
    arrays = _arrays(gtsam_block.read_out(block, problem, run, values), record)
    if not limit:
        return arrays

    marginals = record.time("factor of marginals", lambda: gtsam.Marginals(problem.graph, values))
    keys = _photo_by_photo(block)

    def compute() -> int:
        end = time.perf_counter() + limit
        for done, key in enumerate(keys):
            if done and time.perf_counter() > end:
                return done
            marginals.marginalCovariance(key)
        return len(keys)

    done = record.time("marginals", compute)
    record.values["marginals"] = [done, len(keys)]
    of_photos, of_points = sample(block)
    return arrays | {
        "photo_cofactors": gtsam_block.photo_cofactors(block, marginals, values, of_photos),
        "point_cofactors": gtsam_block.point_cofactors(marginals, of_points),
    }


def _photo_by_photo(block: photogram.Block) -> list[int]:
    """Return gtsam's keys of every photograph, each with the points that no earlier one shows.

    gtsam keeps what it has computed on the way to a marginal for those nearby: in this order the cost of a
    part can be extrapolated to the whole.
    """
    from gtsam.symbol_shorthand import L, X

    first = np.full(len(block.point_ids), len(block.photo_ids))
    np.minimum.at(first, block.image_points, block.image_photos)
    order = np.argsort(first, kind="stable")
    starts = np.searchsorted(first[order], np.arange(len(block.photo_ids) + 1))
    keys = []
    for photo, (start, end) in enumerate(itertools.pairwise(starts)):
        keys += [X(photo), *(L(point) for point in order[start:end])]
    return keys


def run_pycolmap(
    block: photogram.Block, points: Floats, record: Record, limit: float, setting: str
) -> dict[str, Floats]:
    """Solve; then the covariances of poses, and of points with fixed poses."""
    import colmap_block

    own = setting == "own-solver"
    problem = record.time("building", lambda: colmap_block.problem(block, points, own_solver=own))
    summary = record.time("solution", lambda: colmap_block.solve(problem))
    arrays = _arrays(colmap_block.read_out(block, problem, summary), record)
    if not limit:
        return arrays
    covariance = record.time("covariances", lambda: colmap_block.covariance(problem))
    of_photos, _ = sample(block)
    return arrays | {"photo_cofactors": colmap_block.photo_cofactors(block, problem, covariance, of_photos)}


def run_symforce(
    block: photogram.Block, points: Floats, record: Record, _limit: float, _setting: str
) -> dict[str, Floats]:
    """Order and optimize: symforce's covariances are those of a dense inverse, for small problems."""
    import symforce_block

    problem = record.time("building", lambda: symforce_block.problem(block, points))
    statistics = record.time("solution", lambda: symforce_block.solve(problem))
    return _arrays(symforce_block.read_out(block, problem, statistics), record)


def run_apex_solver(
    block: photogram.Block, points: Floats, record: Record, _limit: float, setting: str
) -> dict[str, Floats]:
    """Let the program in Rust optimize, in a process of its own, which takes time and memory itself."""
    import apex_block

    problem = record.time("building", lambda: apex_block.numbers(block, points))
    found = apex_block.solve(block, problem, setting or apex_block.FASTEST)
    record.values["version"] = apex_block.version()
    record.values["seconds"]["solution"], record.values["peak"]["solution"] = found.seconds, found.peak
    return _arrays(found.solution, record)


PEERS: dict[str, Callable[[photogram.Block, Floats, Record, float, str], dict[str, Floats]]] = {
    "gtsam": run_gtsam,
    "pycolmap": run_pycolmap,
    "symforce": run_symforce,
    "apex-solver": run_apex_solver,
}
"""What runs a peer, with the seconds of its covariances and a setting."""


def _arrays(solution: Solution, record: Record) -> dict[str, Floats]:
    """Share a solution out: numbers to the record, arrays to the caller."""
    values = asdict(solution)
    arrays = {name: values.pop(name) for name, value in asdict(solution).items() if np.ndim(value)}
    record.values |= values
    return arrays


def main() -> None:
    """Run one side once."""
    side, stem, output, limit = sys.argv[1:]
    package, _, setting = side.partition(":")
    with Path(stem).with_suffix(".pickle").open("rb") as file:
        block, points = pickle.load(file)
    record = Record()
    if package == "photogram":
        arrays = run_photogram(block, record, int(setting) if setting else None)
    else:
        arrays = PEERS[package](block, points, record, float(limit), setting)
    if "version" not in record.values:
        record.values["version"] = version(package)
    np.savez(Path(output).with_suffix(".npz"), **arrays)
    Path(output).with_suffix(".json").write_text(json.dumps(record.values, default=float))


if __name__ == "__main__":
    main()
