"""A block in gtsam: the same unknowns, observations and weights as in photogram.

With u = M (P - C) the object vector in the photo's frame (z up, away from the ground), gtsam's camera frame
(z forward) is p = D u, D = diag(1, -1, -1), a half turn about the x axis. The collinearity equations become

    x = c u1 / u3 = -c p1 / p3,    y = c u2 / u3 = c p2 / p3:

a pinhole camera with the focal lengths fx = -c, fy = c in millimetres, whatever the sign of c.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import gtsam
import numpy as np
from covariances import Place, moved
from gtsam.symbol_shorthand import L, X
from solution import HALF_TURN, Floats, Solution, check, to_object_space

from photogram import Block
from photogram.network.geometry import rotation_angles

Optimizer = Callable[[gtsam.NonlinearFactorGraph, gtsam.Values], gtsam.NonlinearOptimizer]


@dataclass(frozen=True)
class Problem:
    """A block as a factor graph, with its initial values."""

    graph: gtsam.NonlinearFactorGraph
    initial: gtsam.Values


def factor_graph(block: Block, points: Floats) -> Problem:
    """Translate a block whose points start from `points`, (n, 3).

    Held components of control are priors of their standard deviations; a component that is not held has the
    precision 0 and so no equation. Raises ValueError for what the translation does not cover: geographic
    space, weighted or fixed photographs, fixed control.
    """
    check(block)
    initial = gtsam.Values()
    for photo, pose in enumerate(poses(block)):
        initial.insert(X(photo), pose)
    for point, position in enumerate(points):
        initial.insertPoint3(L(point), position)

    graph = gtsam.NonlinearFactorGraph()
    noise = {tuple(sd): gtsam.noiseModel.Diagonal.Sigmas(sd) for sd in np.unique(block.image_sd, axis=0)}
    calibrations = {c: calibration(c) for c in np.unique(block.principal_distances)}
    images = zip(block.image_photos, block.image_points, block.image_xy, block.image_sd, strict=True)
    for photo, point, xy, sd in images:
        of_photo = calibrations[block.principal_distances[photo]]
        graph.add(gtsam.GenericProjectionFactorCal3_S2(xy, noise[tuple(sd)], X(photo), L(point), of_photo))
    held = np.isfinite(block.point_sd)
    # Precision 0 times a value that is not known must be 0, not NaN.
    known = np.where(held, block.point_positions, points)
    for control in np.flatnonzero(held.any(axis=1)):
        noise_of_control = gtsam.noiseModel.Diagonal.Precisions(block.point_sd[control] ** -2.0)
        graph.add(gtsam.PriorFactorPoint3(L(control), known[control], noise_of_control))
    return Problem(graph, initial)


def poses(block: Block) -> list[gtsam.Pose3]:
    """Camera poses of the initial photographs: rotation camera to object space, projection centre."""
    pairs = zip(to_object_space(block), block.photo_positions, strict=True)
    return [gtsam.Pose3(gtsam.Rot3(matrix), centre) for matrix, centre in pairs]


def calibration(principal_distance: float) -> gtsam.Cal3_S2:
    """Pinhole camera in millimetres for a signed principal distance."""
    return gtsam.Cal3_S2(-principal_distance, principal_distance, 0.0, 0.0, 0.0)


def solve(problem: Problem, optimizer: Optimizer) -> tuple[gtsam.NonlinearOptimizer, gtsam.Values]:
    """Order and optimize: what is timed."""
    run = optimizer(problem.graph, problem.initial)
    return run, run.optimize()


def read_out(
    block: Block, problem: Problem, optimizer: gtsam.NonlinearOptimizer, values: gtsam.Values
) -> Solution:
    """Arrays of what gtsam found; the weighted sum of squares is twice its error."""
    photos = gtsam.utilities.extractPose3(values)
    matrices = HALF_TURN @ photos[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
    if block.photo_to_ground:
        matrices = matrices.transpose(0, 2, 1)
    return Solution(
        converged=optimizer.iterations() < gtsam.GaussNewtonParams().getMaxIterations(),
        iterations=optimizer.iterations(),
        initial_weighted_sum_of_squares=2.0 * problem.graph.error(problem.initial),
        weighted_sum_of_squares=2.0 * optimizer.error(),
        photo_positions=photos[:, 9:],
        photo_attitudes=rotation_angles(matrices),
        point_positions=gtsam.utilities.extractPoint3(values),
    )


def photo_cofactors(
    block: Block, marginals: gtsam.Marginals, values: gtsam.Values, photos: list[int]
) -> Floats:
    """(k, 6, 6) cofactors of some photographs, position and attitude, as photogram states them."""
    found = []
    for photo in photos:
        pose = values.atPose3(X(photo))
        rotation, centre = pose.rotation().matrix(), pose.translation()

        def place(turn: Floats, shift: Floats, rotation: Floats = rotation, centre: Floats = centre) -> Place:
            """Move the pose in its own frame, as gtsam's tangent space does."""
            return (rotation @ turn).T, centre + rotation @ shift

        found.append(moved(block, place, marginals.marginalCovariance(X(photo))))
    return np.array(found)


def point_cofactors(marginals: gtsam.Marginals, points: list[int]) -> Floats:
    """(k, 3, 3) cofactors of some points."""
    return np.array([marginals.marginalCovariance(L(point)) for point in points])


def _gauss_newton(ordering: str) -> Optimizer:
    def optimizer(graph: gtsam.NonlinearFactorGraph, initial: gtsam.Values) -> gtsam.NonlinearOptimizer:
        parameters = gtsam.GaussNewtonParams()
        parameters.setLinearSolverType("MULTIFRONTAL_CHOLESKY")
        parameters.setOrderingType(ordering)
        return gtsam.GaussNewtonOptimizer(graph, initial, parameters)

    return optimizer


def _levenberg_marquardt(
    graph: gtsam.NonlinearFactorGraph, initial: gtsam.Values
) -> gtsam.NonlinearOptimizer:
    parameters = gtsam.LevenbergMarquardtParams.LegacyDefaults()
    parameters.setLinearSolverType("MULTIFRONTAL_CHOLESKY")
    parameters.setOrderingType("COLAMD")
    return gtsam.LevenbergMarquardtOptimizer(graph, initial, parameters)


def _schur(graph: gtsam.NonlinearFactorGraph, initial: gtsam.Values) -> gtsam.NonlinearOptimizer:
    parameters = gtsam.SfmLevenbergMarquardtParams.legacyDefaults()
    parameters.setLinearSolverType("MULTIFRONTAL_CHOLESKY")
    parameters.setEliminationMode(gtsam.SfmEliminationMode.Schur)
    return gtsam.SfmLevenbergMarquardtOptimizer(graph, initial, parameters)


# Each converges to the same solution within gtsam's own limits (1e-5 of the error). The first is the fastest
# on aerial blocks; the linear solver MULTIFRONTAL_SOLVER and the parameters CeresDefaults are slower in each.
SETTINGS: dict[str, Optimizer] = {
    "gn-colamd": _gauss_newton("COLAMD"),
    "gn-metis": _gauss_newton("METIS"),
    "lm-colamd": _levenberg_marquardt,
    "lm-schur": _schur,
}
FASTEST = "gn-colamd"
