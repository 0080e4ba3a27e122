"""Absolute orientation of simulated models by photogram and by its peers; prints one Markdown table.

python benches/peers/compare_similarity.py --stations 10 1000 100000

The peers are Umeyama's closed form in NumPy and, where it is installed, that of scikit-image. They take full
control only.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray
from umeyama import umeyama

from photogram import orient
from photogram.absolute_orientation import Similarity, Stations
from photogram.network.geometry import rotation_matrix

Floats = NDArray[np.float64]
Parameters = tuple[float, Floats, Floats]
Solver = Callable[[Floats, Floats], Parameters]

AGREE = 1e-9
"""Largest relative difference of s, and absolute one of the elements of A."""


def main() -> int:
    """Run the comparison; the exit status is 1 when the solutions differ."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--stations", type=int, nargs="+", default=[10, 1000, 100_000])
    parser.add_argument("--repetitions", type=int, default=7)
    parser.add_argument("--seed", type=int, default=1962)
    arguments = parser.parse_args()
    solvers: dict[str, Solver] = {"photogram": photogram_solver, "Umeyama, NumPy": umeyama}
    if find_spec("skimage"):
        solvers["scikit-image"] = skimage_solver
    print("| stations | solver | best ms | median ms | difference of s, A | covariances, redundancy, tests |")
    print("| ---: | --- | ---: | ---: | ---: | --- |")
    agree = True
    for count in arguments.stations:
        control, model = simulate(count, arguments.seed)
        reference = umeyama(control, model)
        for name, solver in solvers.items():
            solution, milliseconds = timed(solver, control, model, arguments.repetitions)
            difference = differ(solution, reference)
            agree &= difference < AGREE
            extra = f"7 x 7, {3 * count} + {3 * count}" if name == "photogram" else "none"
            best, median = min(milliseconds), statistics.median(milliseconds)
            print(f"| {count} | {name} | {best:.2f} | {median:.2f} | {difference:.1e} | {extra} |")
    return 0 if agree else 1


def simulate(count: int, seed: int) -> tuple[Floats, Floats]:
    """Simulate full control at a large tilt, with noise of 1e-5 of the size of the model."""
    generator = np.random.default_rng(seed)
    control = generator.uniform(-500, 500, (count, 3)) * [1.0, 0.8, 0.2]
    rotation = rotation_matrix([[0.9, -0.7, 2.5]])[0]
    truth = Similarity.from_parameters(0.2, rotation, [10.0, -20.0, 30.0])
    return control, truth.to_model(control) + 0.002 * generator.standard_normal((count, 3))


def photogram_solver(control: Floats, model: Floats) -> Parameters:
    """Solve with every covariance, redundancy number and test value."""
    found = orient(Stations(range(len(control)), control, model)).similarity
    return found.scale, found.rotation, found.translation


def skimage_solver(control: Floats, model: Floats) -> Parameters:
    """Solve by scikit-image."""
    from skimage.transform import SimilarityTransform

    found = SimilarityTransform.from_estimate(control, model)
    matrix = np.asarray(found.params)
    scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
    return scale, matrix[:3, :3] / scale, matrix[:3, 3]


def timed(solver: Solver, control: Floats, model: Floats, repetitions: int) -> tuple[Parameters, list[float]]:
    """Solve some times; milliseconds of each."""
    milliseconds = []
    for _ in range(repetitions):
        start = time.perf_counter()
        solution = solver(control, model)
        milliseconds.append(1000 * (time.perf_counter() - start))
    return solution, milliseconds


def differ(solution: Parameters, reference: Parameters) -> float:
    """Return the larger of the differences of s (relative) and A."""
    return max(abs(solution[0] / reference[0] - 1), float(np.abs(solution[1] - reference[1]).max()))


if __name__ == "__main__":
    sys.exit(main())
