"""What mrcal makes of its lens LENSMODEL_CAHVOR, for `test_cahvor.py`; run where mrcal 2.2 is.

python3 cahvor_of_mrcal.py ../../../shared/data/targets/opencv_left.json
"""

import json
import sys
from pathlib import Path

import mrcal
import numpy as np

LENS = "LENSMODEL_CAHVOR"
CAMERA = np.array([520.0, 521.0, 318.0, 236.0, 0.05, -0.04, 0.01, -0.2, 0.05])
POINTS = np.array([[0.3, -0.2, 1.0], [-0.5, 0.4, 1.2], [0.0, 0.0, 1.0], [0.7, 0.6, 1.0]])


def projected():
    """Print images, and their partials by points and by parameters."""
    for each in mrcal.project(POINTS, LENS, CAMERA, get_gradients=True):
        print(json.dumps(each.tolist()))


def optimized(corners):
    """Print the cost and the camera of 13 pictures of a board that is plane, with the priors of mrcal."""
    observed = np.ones((len(corners), 6, 9, 3))
    observed[..., :2] = np.reshape(corners, (len(corners), 6, 9, 2))
    counted = np.arange(len(corners), dtype=np.int32)
    camera = np.array([540.0, 540.0, 320.0, 240.0, 0, 0, 0, -0.1, 0.01])
    poses = mrcal.estimate_monocular_calobject_poses_Rt_tocam(
        np.column_stack([counted, 0 * counted]), observed, 0.025, [("LENSMODEL_PINHOLE", camera[:4])]
    )
    given = {
        "lensmodel": LENS,
        "intrinsics": camera[np.newaxis],
        "imagersizes": np.array([[640, 480]], dtype=np.int32),
        "frames_rt_toref": mrcal.rt_from_Rt(poses),
        "extrinsics_rt_fromref": np.zeros((0, 6)),
        "points": None,
        "observations_board": observed,
        "indices_frame_camintrinsics_camextrinsics": np.column_stack(
            [counted, 0 * counted, 0 * counted - 1]
        ).astype(np.int32),
        "observations_point": None,
        "indices_point_camintrinsics_camextrinsics": None,
        "calibration_object_spacing": 0.025,
        "calobject_warp": np.zeros(2),
        "do_optimize_calobject_warp": False,
        "do_apply_outlier_rejection": False,
        "do_apply_regularization": True,
    }
    for _ in range(5):
        found = mrcal.optimize(**given)
    print(json.dumps([float(found["x"] @ found["x"]), *given["intrinsics"][0].tolist()]))


if __name__ == "__main__":
    projected()
    optimized(list(json.loads(Path(sys.argv[1]).read_text())["corners"]["left"].values()))
