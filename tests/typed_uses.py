"""What the pages show, for checkers of types: `./dev lint` checks this file, `test_notebook.py` runs it."""

from __future__ import annotations

import numpy as np
import pandas as pd

import photogram
from photogram import Block, Camera, Result, adjust


def block_of_lists() -> Block:
    """Give lists and single numbers where the fields are arrays, and no names: these are numbers."""
    return Block(
        photo_positions=[[0.0, 0.0, 1000.0], [500.0, 0.0, 1000.0]],
        photo_attitudes=np.zeros((2, 3)),
        principal_distances=-100.0,
        point_positions=[[250.0, 0.0, 0.0], [250.0, 100.0, 0.0], [300.0, -100.0, 10.0]],
        point_sd=0.1,
        image_photos=[0, 1, 0, 1, 0, 1],
        image_points=[0, 0, 1, 1, 2, 2],
        image_xy=[
            [25.0, 0.0],
            [-25.0, 0.0],
            [25.0, 10.0],
            [-25.0, 10.0],
            [30.303, -10.101],
            [-20.202, -10.101],
        ],
        image_sd=0.01,
    )


def block_of_data_frames() -> Block:
    """Give data frames, and dictionaries of columns."""
    photos = pd.DataFrame(
        {"X": [0.0, 500.0], "Y": 0.0, "Z": 1000.0, "omega_deg": 0.0, "phi_deg": 0.0, "kappa_deg": 0.0}
    )
    images = pd.DataFrame({"photo": [0, 1], "point": ["1", "1"], "x_mm": [25.0, -25.0], "y_mm": [0.0, 0.0]})
    points = {"point": ["1"], "X": [250.0], "Y": [0.0], "Z": [0.0], "sd_X": [0.1]}
    return Block.from_tables(photos, images, points, principal_distance=-100.0, image_sd=0.01)


def pictures(block: Block) -> list[str]:
    """Adjust, and draw into axes that a caller has."""
    from matplotlib.figure import Figure

    result: Result = adjust(block)
    axes = Figure().subplots()
    plot: photogram.plots.Plot = result.plot.network(plane="XZ")
    plot.on(axes)
    axes.set_title("a block")
    content: bytes = plot.render("svg")
    return [axes.get_title(), content[:4].decode(), *result.plot.available()]


def cameras() -> list[Camera]:
    """Give one standard deviation for all, some by name, or a covariance matrix of lists."""
    return [
        Camera("brown", {"c": -24.3}, sd=0.01),
        Camera("brown", {"c": -24.3}, sd={"c": float("inf"), "K1": 1e-5}, name="lens"),
        Camera(
            "opencv",
            {"fx": 800, "fy": 800, "cx": 400, "cy": 300},
            covariance=(["cx", "cy"], [[1, 0.1], [0.1, 1]]),
        ),
    ]


def collection() -> photogram.collection.Collection:
    """Reach a program after `import photogram`."""
    return photogram.collection.Collection(
        [[0.0] * 6 + [500.0, 0.0, 0.0]], [[0.0, 0.0, -5.0]], [0], [0], [[0.0, 0.0]], image_sd=0.5
    )


def refused() -> None:
    """Give what cannot be: checkers refuse it, too."""
    Block(photo_positions=[[0.0, 0.0, 0.0]])  # type: ignore[call-arg]
    Camera("brown", {"c": "long"})  # type: ignore[dict-item]
