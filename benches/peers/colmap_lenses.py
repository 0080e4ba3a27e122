"""A block that calibrates its cameras, in COLMAP: OPENCV cameras that photos share, solved by Ceres.

COLMAP's camera OPENCV is ours by name and order of parameters. Every image coordinate has the weight 1 there,
so lengths in the image are counted in their standard deviation, one for each camera. Control has priors of
its standard deviations.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyceres
import pycolmap
from solution import to_object_space
from start import intersections

from photogram import Block
from photogram.network.rays import seen_without_lenses

NOT_HELD = 1e9


def colmap_solution(block: Block) -> Callable[[], float]:
    """Return what solves a block by COLMAP and gives the weighted sum of squares; once only."""
    points = intersections(seen_without_lenses(block)[0])
    reconstruction, deviations = pycolmap.Reconstruction(), []
    for number, camera in enumerate(block.cameras):
        [sd] = np.unique(block.image_sd[block.photo_cameras[block.image_photos] == number])
        deviations.append(sd)
        lengths, terms = camera.values[:4] / sd, camera.values[4:]
        own = pycolmap.Camera(
            camera_id=number + 1, model="OPENCV", width=1, height=1, params=[*lengths, *terms]
        )
        reconstruction.add_camera_with_trivial_rig(own)
    order = np.argsort(block.image_photos, kind="stable")
    starts = np.searchsorted(block.image_photos[order], np.arange(len(block.photo_ids) + 1))
    tracks, config = [pycolmap.Track() for _ in block.point_ids], pycolmap.BundleAdjustmentConfig()
    to_camera = to_object_space(block).transpose(0, 2, 1)
    for photo, (matrix, centre) in enumerate(zip(to_camera, block.photo_positions, strict=True)):
        own = order[starts[photo] : starts[photo + 1]]
        image = pycolmap.Image(
            name=block.photo_ids[photo],
            keypoints=block.image_xy[own] / deviations[block.photo_cameras[photo]],
            camera_id=int(block.photo_cameras[photo]) + 1,
            image_id=photo + 1,
        )
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(matrix), -matrix @ centre)
        reconstruction.add_image_with_trivial_frame(image, pose)
        config.add_image(photo + 1)
        for number, point in enumerate(block.image_points[own]):
            tracks[point].add_element(photo + 1, number)
    ids = [
        reconstruction.add_point3D(position, track) for position, track in zip(points, tracks, strict=True)
    ]
    options = pycolmap.BundleAdjustmentOptions(print_summary=False)
    options.refine_focal_length = options.refine_principal_point = options.refine_extra_params = True
    options.ceres.auto_select_solver_type = False
    options.ceres.solver_options.linear_solver_type = pyceres.LinearSolverType.SPARSE_SCHUR
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction)
    priors, held = [], np.isfinite(block.point_sd)
    for control in np.flatnonzero(held.any(axis=1)):
        known = np.where(held[control], block.point_positions[control], points[control])
        variance = np.where(held[control], block.point_sd[control], NOT_HELD) ** 2
        priors.append(pyceres.factors.NormalPrior(known, np.diag(variance)))
        adjuster.problem.add_residual_block(priors[-1], None, [reconstruction.point3D(ids[control]).xyz])

    alive = reconstruction, priors

    def solve() -> float:
        # The adjuster points into these.
        assert alive
        return 2.0 * float(adjuster.solve().ceres_summary.final_cost)

    return solve
