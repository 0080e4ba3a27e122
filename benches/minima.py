"""True minima of bundle adjustments, with what proves them: python benches/minima.py [PROBLEM ...] [options].

PROBLEM: files of "Bundle Adjustment in the Large" or of Bundler. Besides, rings of N photos are simulated.

photogram adjusts; what judges the result is none of its code: the image equation of the problems in NumPy,
its partials by complex steps, second derivatives by differences of these, and the whole Hessian, curvature of
the residuals included, reduced to the photos. Where the gradient vanishes, the 3 x 3 blocks of all points are
positive, and the reduced matrix has seven zeros (position, attitude and scale of the whole) and else positive
eigenvalues, there is a minimum (Haynsworth: the inertia of a matrix is that of a block and its complement).

--save FOLDER writes the minima in the format of the problems, with all digits; --check judges such files, of
whatever program, as they are: `python benches/minima.py --check minimum.txt`.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, coo_matrix, csr_matrix

from photogram import __version__, collection
from photogram.collection import Collection

sys.path.insert(0, str(Path(__file__).parent / "peers"))

from machine import processor
from rings import rings

PHOTO, POINT, GAUGE = 9, 3, 7
"""Unknowns of a photo, of a point, and directions in which no image moves."""
STEP = 1e-6
"""Of the differences, relative to the size of an unknown: second derivatives to about 1e-9."""
Reals = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Minimum:
    """What proves a minimum.

    `gradient` is the largest |g_i| / sqrt(H_ii): how far the unknown i would go by itself, in standard
    deviations that it would have if all others were known. `left` is g'H^-1 g / 2, what the cost would still
    fall by. Eigenvalues are of the reduced Hessian, scaled by the roots of the diagonal before: `gauge` the
    largest of the seven that must vanish, `least` the next. `points` is the least of a point's block.
    """

    cost: float
    gradient: float
    left: float
    gauge: float
    least: float
    points: float

    @property
    def proven(self) -> bool:
        """Whether the values are those of a minimum: what is left is below the rounding of the cost."""
        positive = self.points > 0 and self.least > 10 * abs(self.gauge)
        return positive and abs(self.left) < 1e-12 * self.cost


def images(photos: NDArray, points: NDArray) -> NDArray:
    """Return (2, n) images of points (3, n); photos (9, n): rotation vector, translation, f, k1, k2."""
    vector, translation, (f, k1, k2) = photos[:3], photos[3:6], photos[6:]
    angle = np.sqrt((vector**2).sum(axis=0))
    sine, cosine = np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2
    across = np.cross(vector, points, axis=0)
    x, y, z = points + sine * across + cosine * np.cross(vector, across, axis=0) + translation
    p = np.array([-x / z, -y / z])
    r2 = (p**2).sum(axis=0)
    return f * (1 + k1 * r2 + k2 * r2**2) * p


def gradients(unknowns: Reals, problem: Collection) -> Reals:
    """Return (12, n) the derivatives of half the square of each image's residual, by complex steps."""
    residuals = images(unknowns[:PHOTO], unknowns[PHOTO:]) - problem.image_xy.T
    found = np.empty_like(unknowns)
    for row in range(len(unknowns)):
        moved = unknowns.astype(complex)
        moved[row] += 1e-30j
        partials = images(moved[:PHOTO], moved[PHOTO:]).imag / 1e-30
        found[row] = (partials * residuals / problem.image_sd.T**2).sum(axis=0)
    return found


def hessians(unknowns: Reals, problem: Collection) -> Reals:
    """Return (12, 12, n) the second derivatives of the same."""
    found = np.empty((len(unknowns), *unknowns.shape))
    for row in range(len(unknowns)):
        step = STEP * np.maximum(np.abs(unknowns[row]), np.abs(unknowns[row]).mean())
        plus, minus = unknowns.copy(), unknowns.copy()
        plus[row] += step
        minus[row] -= step
        found[row] = (gradients(plus, problem) - gradients(minus, problem)) / (plus[row] - minus[row])
    return 0.5 * (found + found.transpose(1, 0, 2))


def summed(rows: Indices, values: Reals, count: int) -> Reals:
    """Return (count, ...) sums over the images of each photo or point of (..., n) values."""
    flat = values.reshape(-1, values.shape[-1])
    sums = [np.bincount(rows, weights=each, minlength=count) for each in flat]
    return np.array(sums).T.reshape(count, *values.shape[:-1])


def judged(problem: Collection) -> Minimum:
    """Return what the values of a problem are, at which every point has two images at least."""
    at_photos, at_points = problem.image_photos, problem.image_points
    unknowns = np.vstack([problem.photo_parameters[at_photos].T, problem.point_positions[at_points].T])
    residuals = (images(unknowns[:PHOTO], unknowns[PHOTO:]) - problem.image_xy.T) / problem.image_sd.T
    gradient, hessian = gradients(unknowns, problem), hessians(unknowns, problem)
    sides = [(at_photos, slice(None, PHOTO)), (at_points, slice(PHOTO, None))]
    counts = [len(problem.photo_parameters), len(problem.point_positions)]
    g = [summed(rows, gradient[own], count) for (rows, own), count in zip(sides, counts, strict=True)]
    h = [summed(rows, hessian[own, own], count) for (rows, own), count in zip(sides, counts, strict=True)]
    scales = [1 / np.sqrt(np.abs(np.diagonal(each, axis1=1, axis2=2))) for each in h]
    g = [each * scale for each, scale in zip(g, scales, strict=True)]
    h = [each * scale[:, :, None] * scale[:, None, :] for each, scale in zip(h, scales, strict=True)]
    cross = hessian[:PHOTO, PHOTO:] * scales[0][at_photos].T[:, None] * scales[1][at_points].T[None]
    inverse = np.linalg.inv(h[1])
    w = matrix(cross, at_photos, at_points, counts)
    half = w @ block_diag(list(inverse), format="csr")
    reduced = block_diag(list(h[0])).toarray() - (half @ w.T).toarray()
    values, vectors = np.linalg.eigh(reduced)
    order = np.argsort(np.abs(values))
    zeros, values = np.split(values[order], [GAUGE])
    along = vectors[:, order[GAUGE:]].T @ (g[0].ravel() - half @ g[1].ravel())
    return Minimum(
        cost=0.5 * float((residuals**2).sum()),
        gradient=float(max(np.abs(each).max() for each in g)),
        left=0.5 * float((along**2 / values).sum() + np.einsum("ni,nij,nj->", g[1], inverse, g[1])),
        gauge=float(np.abs(zeros).max()),
        least=float(values.min()),
        points=float(np.linalg.eigvalsh(h[1]).min()),
    )


def matrix(cross: Reals, photos: Indices, points: Indices, counts: list[int]) -> csr_matrix:
    """Return the sparse matrix of photos by points, of (9, 3, n) blocks, one for each image."""
    rows = PHOTO * photos + np.arange(PHOTO)[:, np.newaxis, np.newaxis]
    columns = POINT * points + np.arange(POINT)[:, np.newaxis]
    places = [np.broadcast_to(each, cross.shape).ravel() for each in (rows, columns)]
    return coo_matrix((cross.ravel(), places), (PHOTO * counts[0], POINT * counts[1])).tocsr()


def kept(problem: Collection, used: NDArray[np.bool_]) -> Collection:
    """Return a problem without points that are not used, and their images."""
    rows = used[problem.image_points]
    return Collection(
        photo_parameters=problem.photo_parameters,
        point_positions=problem.point_positions[used],
        image_photos=problem.image_photos[rows],
        image_points=(np.cumsum(used) - 1)[problem.image_points[rows]],
        image_xy=problem.image_xy[rows],
        image_sd=problem.image_sd[rows],
    )


COUNTED = ("problem", "photos", "points", "images")
FOUND = ("cost", "gradient", "left / cost", "seven", "least", "of points")
ADJUSTED = ("left out", "s", "s with covariances", "sd of a point")


def row(name: str, problem: Collection, save: Path | None) -> tuple[list[str], bool]:
    """Adjust a problem, and return what proves its minimum as a row, and whether it does."""
    start = time.perf_counter()
    collection.adjust(problem, tolerance=1e-15, covariance=False)
    seconds = time.perf_counter() - start
    start = time.perf_counter()
    result = collection.adjust(problem, tolerance=1e-15)
    with_covariances = time.perf_counter() - start
    minimum = kept(result.adjusted(), result.used_points)
    if save is not None:
        save.mkdir(parents=True, exist_ok=True)
        (save / f"{name.strip('`').replace(' ', '-')}.txt").write_bytes(collection.to_bytes(minimum, "bal"))
    cells, proven = cells_of(name, minimum)
    sd = np.median(result.point_sd[result.used_points])
    out = np.count_nonzero(~result.used_points)
    return [*cells, f"{out:,}", f"{seconds:.3g}", f"{with_covariances:.3g}", f"{sd:.3g}"], proven


def cells_of(name: str, problem: Collection) -> tuple[list[str], bool]:
    """Judge values, and return what they are as cells, and whether it is a minimum."""
    found = judged(problem)
    counts = [len(problem.photo_parameters), len(problem.point_positions), len(problem.image_xy)]
    told = [f"{found.cost:.12g}", f"{found.gradient:.1e}", f"{found.left / found.cost:.1e}"]
    told += [f"{found.gauge:.1e}", f"{found.least:.2e}", f"{found.points:.2e}"]
    return [name, *(f"{each:,}" for each in counts), *told], found.proven


def main() -> None:
    """Print a table; status 1 where something is no minimum."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("problems", nargs="*", type=Path, metavar="PROBLEM")
    parser.add_argument("--photos", nargs="*", type=int, default=[10, 50, 200], help="simulated rings")
    parser.add_argument("--save", type=Path, metavar="FOLDER")
    parser.add_argument("--check", action="store_true", help="judge the values of the files, adjust nothing")
    asked = parser.parse_args()
    head = [*COUNTED, *FOUND, *(() if asked.check else ADJUSTED)]
    simulated = [] if asked.check else [(f"ring of {count}", rings(count)) for count in asked.photos]
    print(f"On {processor()}; photogram {__version__}, numpy {np.__version__}.\n")
    print("| " + " | ".join(head) + " |\n| :--- |" + " ---: |" * (len(head) - 1))
    bad = []
    for name, problem in [
        *((f"`{each.stem}`", collection.read(each)) for each in asked.problems),
        *simulated,
    ]:
        cells, proven = cells_of(name, problem) if asked.check else row(name, problem, asked.save)
        print("| " + " | ".join(cells) + " |", flush=True)
        bad += [] if proven else [name]
    if bad:
        raise SystemExit(f"not proven to be minima: {', '.join(bad)}")


if __name__ == "__main__":
    main()
