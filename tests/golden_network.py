"""Golden networks as blocks."""

from __future__ import annotations

import numpy as np

from golden_data import golden
from photogram import Attitudes, Block, Distance


def free_network(*, bars: bool) -> Block:
    """Return the network of `free_network.json`, with its scale bars or without."""
    inputs = golden("network", "free_network.json")["inputs"]
    initial, observed = inputs["initial"], inputs["observations"]
    photo_ids = [name for name in initial if name.startswith("photo")]
    point_ids = [name for name in initial if name.startswith("point")]
    matrices = np.array([initial[name]["matrix_photo_to_object"] for name in photo_ids])
    images = observed["image"]
    image_sd = np.sqrt(images["covariance"]["all"][0][0])
    between = [
        (pair[1], pair[0]) if pair[0].startswith("point") else tuple(pair) for pair in images["between"]
    ]
    bar = observed["scale bar"]
    bar_sd = float(np.sqrt(bar["covariance"]["all"][0][0]))
    return Block(
        photo_ids=photo_ids,
        photo_positions=np.array([initial[name]["position"] for name in photo_ids]),
        photo_attitudes=Attitudes.of("matrix", matrices).values("omega_phi_kappa"),
        principal_distances=np.full(len(photo_ids), -35.0),
        point_ids=point_ids,
        point_positions=np.array([initial[name]["value"] for name in point_ids]),
        image_photos=np.array([photo_ids.index(photo) for photo, _ in between]),
        image_points=np.array([point_ids.index(point) for _, point in between]),
        image_xy=np.array(images["observed"]),
        image_sd=np.full((len(between), 2), image_sd),
        observations=[
            Distance(*ends, float(length[0]), sd=bar_sd)
            for ends, length in zip(bar["between"], bar["observed"], strict=True)
        ]
        if bars
        else [],
    )
