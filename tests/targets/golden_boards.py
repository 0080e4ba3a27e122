"""Golden data of calibration with targets, as boards and corners."""

from importlib.resources import files

import numpy as np
from given_targets import golden

from golden_data import shared
from photogram.targets import Board, Corners, read


def left():
    """Return 13 pictures of OpenCV: 9 x 6 corners, 25 mm."""
    given = golden("opencv_left")["corners"]["left"]
    pictures, points = len(given), 54
    corners = Corners(
        pictures=[f"left{int(name):02d}" for name in given],
        cameras=np.zeros(pictures, dtype=int),
        views=np.arange(pictures),
        camera_names=["left"],
        sizes=[(640, 480)],
        picture=np.repeat(np.arange(pictures), points),
        point=np.tile(np.arange(points), pictures),
        xy=np.concatenate([np.array(each) for each in given.values()]),
        sd=np.ones(pictures * points),
    )
    return Board(columns=9, rows=6, spacing=25.0, unit="mm"), corners


def packaged():
    """Return the packaged example: 20 pictures of 9 x 6 corners, 30 mm, those at the edges incomplete."""
    calibration = read(files("photogram") / "examples" / "board")
    corners = calibration.corners
    names = [name.removesuffix(".jpg") for name in corners.pictures]
    return calibration.board, corners.replace(pictures=names)


def rig():
    """Return the simulated rig of two cameras: 20 views of 9 x 7 corners."""
    view, camera, point, x, y, level = np.array(golden("rig_small")["corners"], dtype=float).T
    pictures, picture = np.unique(2 * view + camera, return_inverse=True)
    corners = Corners(
        pictures=[f"{'ab'[int(each) % 2]}{int(each) // 2:02d}" for each in pictures],
        cameras=(pictures % 2).astype(int),
        views=(pictures // 2).astype(int),
        camera_names=["a", "b"],
        sizes=[(1280, 960)] * 2,
        picture=picture,
        point=point.astype(int),
        xy=np.column_stack([x, y]),
        sd=2.0**level,
    )
    return Board(columns=9, rows=7, spacing=0.04), corners


def wide(step=1):
    """Return every so many of the 186 pictures of mrcal's lens of 150 degrees: 10 x 10 corners, 77 mm."""
    lines = shared("targets", "mrcal_corners.vnl").read_text().splitlines()
    rows = [line.split() for line in lines if not line.startswith("#")]
    names, picture = np.unique([row[0] for row in rows], return_inverse=True)
    use = np.array([row[3] != "-" for row in rows])
    corners = Corners(
        pictures=names.tolist(),
        cameras=np.zeros(len(names), dtype=int),
        views=np.arange(len(names)),
        camera_names=["wide"],
        sizes=[(6016, 4016)],
        picture=picture,
        point=np.tile(np.arange(100), len(names)),
        xy=np.array([[float(row[1]), float(row[2])] for row in rows]),
        sd=np.array([2.0 ** float(row[3]) if row[3] != "-" else 1.0 for row in rows]),
        use=use,
    )
    board = Board(columns=10, rows=10, spacing=0.077)
    return board, corners.of_pictures(np.arange(len(names)) % step == 0)
