"""A block in symforce: the same unknowns, observations and weights as in photogram.

Poses and camera are those of `gtsam_block`, x = -c p1 / p3, y = c p2 / p3, in standard deviations of the
image coordinates. The collinearity equations are stated as symbols; symforce differentiates them and writes
them as Python, which NumPy evaluates for all image points at once. To symforce's optimizer in C++ the block
is one factor with a sparse matrix of derivatives: each factor in Python is handed a copy of all unknowns, so
that one for every image point would take time with the square of their number.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

import numpy as np
import sym
import symforce
from scipy.sparse import csc_matrix
from solution import HALF_TURN, Floats, Solution, check, in_standard_deviations, to_object_space

# What symforce tells of itself would stand in the page.
symforce.set_log_level("WARNING")
symforce.set_epsilon_to_number()

import symforce.symbolic as sf  # noqa: E402
from symforce import cc_sym  # noqa: E402
from symforce.codegen import Codegen, PythonConfig, codegen_util  # noqa: E402
from symforce.opt.optimizer import Optimizer  # noqa: E402
from symforce.values import Values  # noqa: E402

from photogram import Block  # noqa: E402
from photogram.network.geometry import rotation_angles  # noqa: E402


@dataclass(frozen=True)
class Problem:
    """A block as an optimizer, with its initial values, which `solve` overwrites."""

    optimizer: cc_sym.Optimizer
    values: cc_sym.Values


def problem(block: Block, points: Floats) -> Problem:
    """Translate a block whose points start from `points`, (n, 3).

    Held components of control are priors of their standard deviations; a component that is not held has no
    equation. Raises ValueError for what the translation does not cover: geographic space, weighted or fixed
    photographs, fixed control.
    """
    check(block)
    values = cc_sym.Values()
    keys = [cc_sym.Key("x", photo) for photo in range(len(block.photo_ids))]
    keys += [cc_sym.Key("l", point) for point in range(len(block.point_ids))]
    poses = zip(to_object_space(block), block.photo_positions, strict=True)
    starts = (sym.Pose3(R=sym.Rot3.from_rotation_matrix(rotation), t=centre) for rotation, centre in poses)
    for key, start in zip(keys, chain(starts, points), strict=True):
        values.set(key, start)
    factor = cc_sym.Factor.jacobian(_linearization(block), keys, sparse=True)
    # Without damping the steps are those of Gauss-Newton.
    parameters = Optimizer.Params(verbose=False, initial_lambda=0.0)
    return Problem(cc_sym.Optimizer(parameters.to_lcm(), [factor]), values)


def _linearization(block: Block) -> Callable[[cc_sym.Values, object], tuple[Floats, csc_matrix]]:
    """Return the residuals of a block and their derivatives as a function of the unknowns."""
    constants = in_standard_deviations(block).T
    controls, components = np.nonzero(np.isfinite(block.point_sd))
    known, roots = (each[controls, components] for each in (block.point_positions, 1.0 / block.point_sd))
    of_images = _of_images()
    images, photos = len(block.image_photos), len(block.photo_ids)

    # Columns are the unknowns: six of each photograph, three of each point.
    of_image = [6 * block.image_photos + k for k in range(6)]
    of_image += [6 * photos + 3 * block.image_points + k for k in range(3)]
    columns = np.concatenate([*of_image, *of_image, 6 * photos + 3 * controls + components])
    rows = np.concatenate(
        [*[np.arange(images)] * 9, *[images + np.arange(images)] * 9, 2 * images + np.arange(len(controls))]
    )
    order = np.lexsort([rows, columns])
    shape = (2 * images + len(controls), 6 * photos + 3 * len(block.point_ids))
    indices, starts = rows[order], np.searchsorted(columns[order], np.arange(shape[1] + 1))

    def linearize(values: cc_sym.Values, _: object) -> tuple[Floats, csc_matrix]:
        poses, points = _arrays(values, photos)
        unknowns = np.vstack([poses[block.image_photos].T, points[block.image_points].T])
        x, y, *derivatives = of_images(*unknowns, *constants)
        residuals = np.concatenate([x, y, (points[controls, components] - known) * roots])
        entries = np.concatenate([*derivatives, roots])[order]
        return residuals, csc_matrix((entries, indices, starts), shape)

    return linearize


def _of_images() -> Callable[..., tuple[Floats, ...]]:
    """Return residuals and derivatives of image points as a function that symforce writes.

    From seven numbers of the pose, three of the point, two focal lengths and two coordinates to two residuals
    and the derivatives of each by turns and shifts of the pose and by coordinates of the point.
    """
    symbols = [sf.Symbol(f"n{number}") for number in range(14)]
    pose, point = sf.Pose3.from_storage(symbols[:7]), sf.V3(*symbols[7:10])
    fx, fy, x, y = symbols[10:]
    p = pose.inverse() * point
    residuals = sf.V2(fx * p[0] / p[2] - x, fy * p[1] / p[2] - y)
    derivatives = residuals.jacobian(pose).row_join(residuals.jacobian(point))
    outputs = Values({f"out{number}": each for number, each in enumerate([*residuals, *derivatives])})
    stated = Codegen(Values({str(each): each for each in symbols}), outputs, PythonConfig(), name="of_images")
    with tempfile.TemporaryDirectory() as directory:
        written = stated.generate_function(directory)
        function: Callable[..., tuple[Floats, ...]] = codegen_util.load_generated_function(
            stated.name, written.function_dir
        )
    return function


def _arrays(values: cc_sym.Values, photos: int) -> tuple[Floats, Floats]:
    """Return what is stored of the poses, (P, 7), a quaternion and the centre, and the points, (n, 3)."""
    poses, points = np.split(np.array(values.data()), [7 * photos])
    return poses.reshape(-1, 7), points.reshape(-1, 3)


def solve(problem: Problem) -> cc_sym.OptimizationStats:
    """Order and optimize: what is timed."""
    return problem.optimizer.optimize(problem.values)


def read_out(block: Block, problem: Problem, statistics: cc_sym.OptimizationStats) -> Solution:
    """Arrays of what symforce found; the weighted sum of squares is twice its error."""
    poses, points = _arrays(problem.values, len(block.photo_ids))
    matrices = HALF_TURN @ np.array([sym.Rot3(pose[:4]).to_rotation_matrix().T for pose in poses.tolist()])
    if block.photo_to_ground:
        matrices = matrices.transpose(0, 2, 1)
    steps = statistics.iterations
    return Solution(
        converged=statistics.status == Optimizer.Status.SUCCESS,
        iterations=len(steps) - 1,
        initial_weighted_sum_of_squares=2.0 * steps[0].new_error,
        weighted_sum_of_squares=2.0 * steps[statistics.best_index].new_error,
        photo_positions=poses[:, 4:],
        photo_attitudes=rotation_angles(matrices),
        point_positions=points,
    )
