"""Collections with a camera for every photo, all unknown, beside Ceres (pycolmap's bundle adjuster).

python benches/peers/collections_ceres.py [PROBLEM.txt ...] [--photos N ...] [--repetitions N]

PROBLEM: files of "Bundle Adjustment in the Large". Besides, simulated ones of N photos (50 200 1000): rings,
where every photo sees every part, so that the reduced matrix is full; and streets, where it sees its
neighbours' only, so that it is sparse. photogram computes the adjustment with all covariances and redundancy
numbers, Ceres the bare solution by the fastest of its solvers for the problem; both start from the same
values, runs are interleaved. Costs are half the weighted sums of squares.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyceres
import pycolmap
from machine import processor
from rings import rings

from photogram import _photocore, collection
from photogram.collection import Collection

HALF_TURN = np.diag([1.0, -1.0, -1.0])
"""Photos of a collection look along -z with y up, those of COLMAP along +z with y down."""
SOLVERS = ("DENSE_SCHUR", "SPARSE_SCHUR")
SAME = 1e-4
"""Share of the cost up to which two solutions are the same; ours may be lower by more, which is said."""


def streets(photos: int) -> Collection:
    """Return photos that look across a street as they go along it: points are seen from the next few."""
    random = np.random.default_rng(1)
    parameters = np.zeros((photos, 9))
    parameters[:, :3] = random.normal(0, 0.05, (photos, 3))
    centres = random.normal(0, 0.2, (photos, 3))
    centres[:, 0] += np.arange(photos)
    parameters[:, 6] = random.uniform(800, 1200, photos)
    parameters[:, 7:] = random.uniform(-0.05, 0.05, (photos, 2))
    parameters[:, 3:6] = translations(parameters[:, :3], centres)
    count = 60 * photos
    along, across = random.uniform(-3, photos + 2, count), random.uniform(4, 15, count)
    points = np.column_stack([along, random.uniform(-0.4, 0.4, count) * across, -across])
    first = np.ceil(along - 0.5 * across).astype(int)
    seen = [
        np.arange(max(own, 0), min(own + int(w) + 1, photos)) for own, w in zip(first, across, strict=True)
    ]
    rays = np.array([len(own) for own in seen])
    kept = rays >= 3
    points, seen = points[kept], [own for own, keep in zip(seen, kept, strict=True) if keep]
    image_photos = np.concatenate(seen)
    image_points = np.repeat(np.arange(len(seen)), [len(own) for own in seen])
    xy = _photocore.collection_images("bal", parameters[image_photos], points[image_points])
    start = parameters.copy()
    start[:, :3] += random.normal(0, 0.005, (photos, 3))
    start[:, 3:6] = translations(start[:, :3], centres + random.normal(0, 0.1, (photos, 3)))
    start[:, 6] *= 1 + random.normal(0, 0.03, photos)
    start[:, 7:] = 0.0
    return Collection(
        photo_parameters=start,
        point_positions=points + random.normal(0, 0.1, points.shape),
        image_photos=image_photos,
        image_points=image_points,
        image_xy=xy + random.normal(0, 0.5, xy.shape),
        image_sd=0.5,
    )


def ceres(problem: Collection, solver: str) -> tuple[pycolmap.Reconstruction, pycolmap.CeresBundleAdjuster]:
    """Translate a collection: cameras RADIAL with a held principal point, coordinates in standard deviations.

    The adjuster points into the reconstruction.
    """
    [sd] = np.unique(problem.image_sd)
    reconstruction = pycolmap.Reconstruction()
    order = np.argsort(problem.image_photos, kind="stable")
    starts = np.searchsorted(problem.image_photos[order], np.arange(len(problem.photo_parameters) + 1))
    tracks, config = [pycolmap.Track() for _ in problem.point_positions], pycolmap.BundleAdjustmentConfig()
    for photo, (*pose, f, k1, k2) in enumerate(problem.photo_parameters):
        own, number = order[starts[photo] : starts[photo + 1]], photo + 1
        lengths = [f / sd, 0.0, 0.0, k1, k2]
        camera = pycolmap.Camera(camera_id=number, model="RADIAL", width=1, height=1, params=lengths)
        reconstruction.add_camera_with_trivial_rig(camera)
        seen = problem.image_xy[own] * [1 / sd, -1 / sd]
        image = pycolmap.Image(name=str(photo), keypoints=seen, camera_id=number, image_id=number)
        matrix = HALF_TURN @ rotation(np.array(pose[:3]))
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(matrix), HALF_TURN @ np.array(pose[3:]))
        reconstruction.add_image_with_trivial_frame(image, rigid)
        config.add_image(number)
        for place, point in enumerate(problem.image_points[own]):
            tracks[point].add_element(number, place)
    for position, track in zip(problem.point_positions, tracks, strict=True):
        reconstruction.add_point3D(position, track)
    options = pycolmap.BundleAdjustmentOptions(print_summary=False)
    options.refine_focal_length = options.refine_extra_params = True
    options.refine_principal_point = False
    options.ceres.auto_select_solver_type = False
    options.ceres.solver_options.linear_solver_type = getattr(pyceres.LinearSolverType, solver)
    options.ceres.solver_options.max_num_iterations = 200
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction)
    return reconstruction, adjuster


def translations(vectors: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """Return t = -R C of photos with these rotation vectors and projection centres."""
    return np.array([-rotation(vector) @ centre for vector, centre in zip(vectors, centres, strict=True)])


def rotation(vector: np.ndarray) -> np.ndarray:
    """Return the matrix of a rotation vector (Rodrigues)."""
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def problems(files: list[Path], photos: list[int]) -> Iterator[tuple[str, Collection]]:
    """Yield problems with their names."""
    for file in files:
        yield file.stem, collection.read(file)
    for count in photos:
        yield f"ring of {count:,}", rings(count)
        yield f"street of {count:,}", streets(count)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", nargs="*", type=Path)
    parser.add_argument("--photos", nargs="*", type=int, default=[50, 200, 1000])
    parser.add_argument("--repetitions", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{processor()}; seconds, the fastest of {arguments.repetitions}; numpy {np.__version__},")
    print(f"pycolmap {pycolmap.__version__}. Steps of Ceres: with those that failed.\n")
    head = ["problem", "images", "photogram", "steps", "cost", "Ceres, bare", "by", "steps", "cost", "ratio"]
    print("| " + " | ".join(head) + " |\n| :--- |" + " ---: |" * (len(head) - 1))
    for name, problem in problems(arguments.problems, arguments.photos):
        print(row(name, problem, arguments.repetitions), flush=True)


def row(name: str, problem: Collection, repetitions: int) -> str:
    """Adjust on both sides, and return a row of the table."""
    ours, best = np.inf, (np.inf, "", 0, np.inf)
    solvers = list(SOLVERS)
    for _ in range(repetitions):
        start = time.perf_counter()
        result = collection.adjust(problem)
        ours = min(ours, time.perf_counter() - start)
        seconds = {}
        for solver in solvers:
            reconstruction, adjuster = ceres(problem, solver)
            start = time.perf_counter()
            summary = adjuster.solve().ceres_summary
            seconds[solver] = time.perf_counter() - start
            del reconstruction
            steps = summary.num_successful_steps + summary.num_unsuccessful_steps
            best = min(best, (seconds[solver], solver, steps, float(summary.final_cost)))
        # The slower of its solvers runs once only.
        solvers = [min(seconds, key=seconds.__getitem__)]
    cost = result.weighted_sum_of_squares / 2
    theirs, solver, steps, their_cost = best
    if cost > their_cost * (1 + SAME):
        raise SystemExit(f"{name}: our cost {cost} is NOT as low as {their_cost} of Ceres")
    cells = [name, f"{len(problem.image_xy):,}", f"{ours:.3g}", f"{len(result.iterations)}", f"{cost:.6g}"]
    cells += [f"{theirs:.3g}", solver, f"{steps}", f"{their_cost:.6g}", f"{theirs / ours:.1f}"]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
