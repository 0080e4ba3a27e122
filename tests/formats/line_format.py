"""Lines: cameras, photos, control points and image observations in a text file.

camera   NAME f cx cy WIDTH HEIGHT     principal distance, principal point and image size, pixels
photo    NAME CAMERA X Y Z o p k       projection centre; omega, phi, kappa in degrees
control  POINT X Y Z sd
image    PHOTO POINT COLUMN ROW        pixels from the upper-left corner
"""

import numpy as np

from photogram import Attitudes, Camera
from photogram.formats import Format
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import cards
from photogram.formats.format import later
from photogram.formats.images import lens_with, named_pixels, sizes_of
from photogram.io.places import image_size, one_word

TITLE, CONTENTS = "file of lines", frozenset({"names", "shared-cameras", "control"})


def read(path, options):
    """Read a file; errors of the builder name the line."""
    block = BlockBuilder(path, TITLE)
    for card in cards(path):
        kind, name, other, *_ = [*card.words, "", "", ""]
        if one_word(card.place, "line", kind, ("camera", "photo", "control", "image", "")) == "camera":
            f, cx, cy, *size = card.numbers(2, "f cx cy WIDTH HEIGHT").tolist()
            camera = Camera("simple_pinhole", {"f": f, "cx": cx, "cy": cy}, name=name)
            block.camera(camera, image_size(card.place, *size), place=card.place)
        elif kind == "photo":
            values = card.numbers(3, "X Y Z o p k")
            attitude = Attitudes.of("omega_phi_kappa", np.radians([values[3:]]))
            block.photo(name, other, card.place)
            block.pose(name, values[:3], attitude.matrices[0])
        elif kind == "control":
            block.control(name, card.numbers(2, "X Y Z"), card.number(5, "sd"), card.place)
        elif kind == "image":
            block.image(name, other, *card.numbers(3, "COLUMN ROW").tolist(), card.place)
    return block.project()


def write(project):
    """Return the file; image coordinates are in pixels already."""
    block, rows = project.block, []
    for camera, size in zip(block.cameras, sizes_of(project), strict=True):
        lens, _ = lens_with(camera, size, TITLE)
        rows.append(("camera", camera.name, lens.focal[0], *lens.centre, *size))
    poses = np.hstack([block.photo_positions, np.degrees(block.photo_attitudes)]).tolist()
    for name, row, pose in zip(block.photo_ids, block.photo_cameras, poses, strict=True):
        rows.append(("photo", name, block.camera_names[row], *pose))
    for name, xyz, sd in zip(block.point_ids, block.point_positions.tolist(), block.point_sd, strict=True):
        rows += [("control", name, *xyz, float(sd.max()))] if np.isfinite(sd).all() else []
    rows += [("image", *observed) for observed in named_pixels(project)]
    return {"block.lines": "".join(f"{' '.join(map(str, row))}\n" for row in rows).encode()}


FILES = ("block.lines", "*.lines")
RECOGNISES = later("recognition:has_suffix .lines")
FORMAT = Format("lines", TITLE, RECOGNISES, read, write, files=FILES, pixels=True, holds=CONTENTS)
