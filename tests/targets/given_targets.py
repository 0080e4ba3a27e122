"""Golden calibrations as inputs: boards, corners, values to start from."""

import gzip
import io
import json
from functools import cache

import numpy as np

from golden_data import DATA, shared
from golden_data import golden as golden_file
from photogram import Camera
from photogram.targets import Board, Calibration, Corners
from photogram.targets.vision import composed

NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")


@cache
def golden(name):
    """Return the content of a golden file; skip the test if it is absent."""
    if name in ("rig_small", "splined"):
        return golden_file("targets", f"{name}.json")
    return json.loads(shared("targets", f"{name}.json").read_text())


@cache
def rig_cofactors():
    """Return (331, 331) cofactors of the unknowns of the simulated rig."""
    packed = (DATA / "targets" / "rig_small_cofactors.npy.gz").read_bytes()
    return np.load(io.BytesIO(gzip.decompress(packed)))


def poses_of(found):
    """Return (n, 4, 4) poses of a file: lists of R and t."""
    return composed(np.array(found["R"]), np.array(found["t"]))


@cache
def rig_small(shape="points"):
    """Return the simulated rig with the values of its truth to start from."""
    data = golden("rig_small")
    rows = np.array(data["corners"])
    of_picture, picture = np.unique(rows[:, 0] * 2 + rows[:, 1], return_inverse=True)
    views, cameras = np.divmod(of_picture.astype(int), 2)
    x, _, z = data["board"]["point_sd"]
    board = data["board"]
    truth = data["truth"]
    return Calibration(
        board=Board(
            columns=board["columns"],
            rows=board["rows"],
            spacing=board["spacing"],
            shape=shape,
            sd_spacing=x,
            sd_plane=z,
        ),
        corners=Corners(
            pictures=[f"view{view:02d}-{camera}" for view, camera in zip(views, cameras, strict=True)],
            cameras=cameras,
            views=views,
            camera_names=["left", "right"],
            sizes=[tuple(data["image"])] * 2,
            picture=picture.reshape(-1),
            point=rows[:, 2].astype(int),
            xy=rows[:, 3:5],
            sd=2.0 ** rows[:, 5],
        ),
        cameras=[Camera("opencv", dict(zip(NAMES, row, strict=True)), sd=np.inf) for row in truth["cameras"]],
        poses=poses_of(truth),
        sensors=np.stack([np.eye(4), poses_of(truth["sensor1"])]),
        sd0=0.3,
    )


def left_table(folder):
    """Write the corners of OpenCV's 13 left pictures as a table, with a board; return the folder."""
    data = golden("opencv_left")
    board = data["board"]
    (folder / "board.toml").write_text(
        f"columns = {board['columns']}\nrows = {board['rows']}\nspacing = {board['spacing']}\nunit = 'mm'\n"
        f"shape = 'held'\npicture_size = {data['image']}\n"
    )
    lines = ["image,point,x,y"]
    for picture, corners in data["corners"]["left"].items():
        lines += [f"left{int(picture):02d}.jpg,{k},{x!r},{y!r}" for k, (x, y) in enumerate(corners)]
    (folder / "corners.csv").write_text("\n".join(lines) + "\n")
    return folder
