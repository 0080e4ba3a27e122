"""A block in COLMAP: the same unknowns, observations and weights as in photogram, solved by Ceres.

With u = M (P - C) the object vector in the photo's frame (z up, away from the ground), COLMAP's camera frame
(z forward) is p = D u, D = diag(1, -1, -1), a half turn about the x axis. With s the sign of -c the
collinearity equations become

    s x = |c| p1 / p3,    -s y = |c| p2 / p3:

a pinhole camera of the focal length |c| that sees (s x, -s y). COLMAP gives every image coordinate the
weight 1, so all lengths in the photo are counted in their standard deviation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyceres
import pycolmap
from covariances import Place, moved
from solution import HALF_TURN, Floats, Solution, check, to_object_space

from photogram import Block
from photogram.network.geometry import rotation_angles

_CAMERA = 1


@dataclass(frozen=True)
class Problem:
    """A block as a reconstruction, and the adjuster that will solve it."""

    reconstruction: pycolmap.Reconstruction
    adjuster: pycolmap.CeresBundleAdjuster
    images: list[int]  # of the photos
    points: list[int]  # of the points
    priors: list[pyceres.CostFunction]  # kept alive while the adjuster points to them


def problem(block: Block, points: Floats, *, own_solver: bool = False) -> Problem:
    """Translate a block whose points start from `points`, (n, 3).

    The linear solver is SPARSE_SCHUR, or with `own_solver` the one that COLMAP chooses: ITERATIVE_SCHUR from
    1,000 photographs on. Held components of control are priors of their standard deviations.

    Raises ValueError for what the translation does not cover: geographic space, weighted or fixed
    photographs, fixed control, several cameras or several standard deviations of image coordinates.
    """
    check(block)
    if len(np.unique(block.principal_distances)) > 1 or len(np.unique(block.image_sd)) > 1:
        raise ValueError("one camera and one standard deviation of image coordinates are wanted")
    reconstruction, images, tracks = _photographs(block)
    ids = [
        reconstruction.add_point3D(position, track) for position, track in zip(points, tracks, strict=True)
    ]
    options = pycolmap.BundleAdjustmentOptions(print_summary=False)
    options.refine_focal_length = options.refine_extra_params = False
    options.ceres.auto_select_solver_type = own_solver
    options.ceres.solver_options.linear_solver_type = pyceres.LinearSolverType.SPARSE_SCHUR
    config = pycolmap.BundleAdjustmentConfig()
    for image in images:
        config.add_image(image)
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction)
    held, priors = np.isfinite(block.point_sd), []
    for control in np.flatnonzero(held.any(axis=1)):
        position = reconstruction.point3D(ids[control]).xyz
        # A component that is not held has a standard deviation that takes its equation away, nearly.
        known = np.where(held[control], block.point_positions[control], points[control])
        variance = np.where(held[control], block.point_sd[control], _NOT_HELD) ** 2
        priors.append(pyceres.factors.NormalPrior(known, np.diag(variance)))
        adjuster.problem.add_residual_block(priors[-1], None, [position])
    return Problem(reconstruction, adjuster, images, ids, priors)


_NOT_HELD = 1e9


def _photographs(block: Block) -> tuple[pycolmap.Reconstruction, list[int], list[pycolmap.Track]]:
    """Return the photographs with their images, and the track of every point."""
    sign = -np.sign(block.principal_distances[0])
    sd = block.image_sd[0, 0]
    reconstruction = pycolmap.Reconstruction()
    focal = abs(block.principal_distances[0]) / sd
    camera = pycolmap.Camera(
        camera_id=_CAMERA, model="SIMPLE_PINHOLE", width=1, height=1, params=[focal, 0.0, 0.0]
    )
    reconstruction.add_camera_with_trivial_rig(camera)
    tracks = [pycolmap.Track() for _ in block.point_ids]
    order = np.argsort(block.image_photos, kind="stable")
    starts = np.searchsorted(block.image_photos[order], np.arange(len(block.photo_ids) + 1))
    to_camera = to_object_space(block).transpose(0, 2, 1)
    images = []
    for photo, (matrix, centre) in enumerate(zip(to_camera, block.photo_positions, strict=True)):
        own = order[starts[photo] : starts[photo + 1]]
        seen = block.image_xy[own] * [sign / sd, -sign / sd]
        image = pycolmap.Image(
            name=block.photo_ids[photo], keypoints=seen, camera_id=_CAMERA, image_id=photo + 1
        )
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(matrix), -matrix @ centre)
        reconstruction.add_image_with_trivial_frame(image, pose)
        images.append(photo + 1)
        for number, point in enumerate(block.image_points[own]):
            tracks[point].add_element(photo + 1, number)
    return reconstruction, images, tracks


def solve(problem: Problem) -> pycolmap.CeresBundleAdjustmentSummary:
    """Solve: what is timed."""
    return problem.adjuster.solve()


def covariance(problem: Problem) -> pycolmap.BACovariance:
    """Compute the covariances of poses, and of points with the poses constant: what is timed."""
    options = pycolmap.BACovarianceOptions()
    options.params = pycolmap.BACovarianceOptionsParams.POSES_AND_POINTS
    estimated = pycolmap.estimate_ba_covariance(options, problem.reconstruction, problem.adjuster)
    if estimated is None:
        raise ArithmeticError("COLMAP found no covariances")
    return estimated


def read_out(block: Block, problem: Problem, summary: pycolmap.CeresBundleAdjustmentSummary) -> Solution:
    """Arrays of what COLMAP found; the weighted sum of squares is twice Ceres' cost."""
    poses = [problem.reconstruction.image(image).cam_from_world() for image in problem.images]
    to_camera = np.array([pose.rotation.matrix() for pose in poses])
    translations = np.array([pose.translation for pose in poses])
    matrices = HALF_TURN @ to_camera
    if block.photo_to_ground:
        matrices = matrices.transpose(0, 2, 1)
    solved = summary.ceres_summary
    return Solution(
        converged=summary.termination_type == pycolmap.BundleAdjustmentTerminationType.CONVERGENCE,
        iterations=solved.num_successful_steps + solved.num_unsuccessful_steps,
        initial_weighted_sum_of_squares=2.0 * solved.initial_cost,
        weighted_sum_of_squares=2.0 * solved.final_cost,
        photo_positions=-np.einsum("pji,pj->pi", to_camera, translations),
        photo_attitudes=rotation_angles(matrices),
        point_positions=np.array([problem.reconstruction.point3D(point).xyz for point in problem.points]),
    )


def photo_cofactors(
    block: Block, problem: Problem, covariance: pycolmap.BACovariance, photos: list[int]
) -> Floats:
    """(k, 6, 6) cofactors of some photographs, position and attitude, as photogram states them."""
    found = []
    for photo in photos:
        pose = problem.reconstruction.image(problem.images[photo]).cam_from_world()
        rotation, translation = pose.rotation.matrix(), pose.translation

        def place(
            turn: Floats, shift: Floats, rotation: Floats = rotation, translation: Floats = translation
        ) -> Place:
            """Move the pose as Ceres' quaternions do: by half angles, in the frame of the camera."""
            to_camera = turn @ turn @ rotation
            return to_camera, -to_camera.T @ (translation + shift)

        found.append(moved(block, place, covariance.get_cam_cov_from_world(problem.images[photo])))
    return np.array(found)
