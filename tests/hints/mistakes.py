"""Networks with start values, and what may go wrong with them."""

import numpy as np

from golden_data import golden
from photogram import Attitudes, Block
from photogram.network import rotation_angles, rotation_matrix

PITCH = 0.006
HALF = {"aerial": [115.0, 115.0], "selfcal": [18.0, 12.0]}


def golden_block(name):
    """Return the block of start values of a golden network."""
    given = golden("network", f"{name}.json")["inputs"]
    blocks, images = given["initial"], given["observations"]["image"]
    photos = [block for block in blocks if block.startswith("photo")]
    points = [block for block in blocks if block.startswith("point")]
    to_object = np.array([blocks[photo]["matrix_photo_to_object"] for photo in photos])
    return Block(
        photo_ids=photos,
        photo_positions=[blocks[photo]["position"] for photo in photos],
        photo_attitudes=rotation_angles(to_object.transpose(0, 2, 1)),
        principal_distances=images["c"][0] if "c" in images else blocks["camera"]["value"][0],
        point_ids=points,
        point_positions=[blocks[point]["value"] for point in points],
        image_photos=[photos.index(between[0]) for between in images["between"]],
        image_points=[points.index(between[1]) for between in images["between"]],
        image_xy=images["observed"],
        image_sd=0.005,
    )


def mistakes(block, half):
    """Return a block with each mistake, by its name."""
    xy, angles, places = block.image_xy, block.photo_attitudes, block.photo_positions
    to_photo = rotation_matrix(angles)
    quarter = np.array([0.0, 0.0, np.pi / 2])
    to_object = to_photo.transpose(0, 2, 1)
    vision = np.diag([1.0, -1.0, -1.0]) @ to_photo
    changed = {
        "none": {},
        "pixels": {"image_xy": (xy * [1, -1] + half) / PITCH},
        "corner": {"image_xy": xy * [1, -1] + half},
        "y down": {"image_xy": xy * [1, -1]},
        "sign of c": {"principal_distances": -block.principal_distances},
        "mirrored": {"image_xy": xy * [-1, 1]},
        "x, y exchanged": {"image_xy": xy[:, [1, 0]]},
        "kappa + 90": {"photo_attitudes": angles + quarter},
        "kappa - 90": {"photo_attitudes": angles - quarter},
        "degrees as radians": {"photo_attitudes": np.degrees(angles)},
        "radians as degrees": {"photo_attitudes": np.radians(angles)},
        "gon": {"photo_attitudes": angles / 0.9},
        "photo-to-ground": {"photo_attitudes": rotation_angles(to_object)},
        "sign of phi": {"photo_attitudes": angles * [1, -1, 1]},
        "phi-omega-kappa": {
            "photo_attitudes": Attitudes(to_object).values("phi_omega_kappa")[:, [1, 0, 2]],
        },
        "feet": {"photo_positions": places / 0.3048},
        "feet in heights": {"photo_positions": places / [1, 1, 0.3048]},
        "t": {"photo_positions": -np.einsum("pij,pj->pi", vision, places)},
        "t in photo axes": {"photo_positions": -np.einsum("pij,pj->pi", to_photo, places)},
        "X, Y exchanged": {"photo_positions": places[:, [1, 0, 2]]},
        "principal distance": {"principal_distances": 1.5 * block.principal_distances},
        "control in feet": {"point_positions": block.point_positions / 0.3048},
        "control, X and Y": {"point_positions": block.point_positions[:, [1, 0, 2]]},
    }
    return {name: block.replace(**own) for name, own in changed.items()}
