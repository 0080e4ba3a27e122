"""Lines: cameras, photos, control points and image observations in a text file.

camera   NAME f cx cy WIDTH HEIGHT     principal distance, principal point and image size, pixels
photo    NAME CAMERA X Y Z o p k       projection centre; omega, phi, kappa in degrees
control  POINT X Y Z sd
image    PHOTO POINT COLUMN ROW        pixels from the upper-left corner
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera
from photogram.formats import Format, Project, ReadOptions
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import cards
from photogram.formats.images import lens_with, named_pixels, sizes_of
from photogram.formats.recognition import has_suffix
from photogram.io.places import image_size, one_word

FILE, TITLE = "block.lines", "file of lines"


def read(path: Path, options: ReadOptions) -> Project:
    """Read a file; errors of the builder name the line."""
    block = BlockBuilder(path, TITLE)
    for card in cards(path):
        kind, name, other, *_ = [*card.words, "", "", ""]
        if one_word(card.place, "line", kind, ("camera", "photo", "control", "image", "")) == "camera":
            f, cx, cy, *size = card.numbers(2, "f cx cy WIDTH HEIGHT").tolist()
            camera = Camera("simple_pinhole", {"f": f, "cx": cx, "cy": cy}, name=name)
            block.camera(camera, image_size(card.place, *size), place=card.place)
        elif kind == "photo":
            block.photo(name, other, card.place)
            values = card.numbers(3, "X Y Z o p k")
            attitude = Attitudes.of("omega_phi_kappa", np.radians(values[np.newaxis, 3:]))
            block.pose(name, values[:3], attitude.matrices[0])
        elif kind == "control":
            block.control(name, card.numbers(2, "X Y Z"), card.number(5, "sd"), card.place)
        elif kind == "image":
            block.image(name, other, *card.numbers(3, "COLUMN ROW").tolist(), card.place)
    return block.project()


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file; image coordinates are in pixels already."""
    block, rows = project.block, list[tuple[object, ...]]()
    for camera, size in zip(block.cameras, sizes_of(project), strict=True):
        lens = lens_with(camera, size, TITLE)
        rows.append(("camera", camera.name, lens.fx, lens.cx, lens.cy, *size))
    poses = np.hstack([block.photo_positions, np.degrees(block.photo_attitudes)]).tolist()
    for name, row, pose in zip(block.photo_ids, block.photo_cameras, poses, strict=True):
        rows.append(("photo", name, block.camera_names[row], *pose))
    for name, xyz, sd in zip(block.point_ids, block.point_positions.tolist(), block.point_sd, strict=True):
        rows += [("control", name, *xyz, float(sd.max()))] if np.isfinite(sd).all() else []
    rows += [("image", *observed) for observed in named_pixels(project)]
    return {FILE: "".join(f"{' '.join(map(str, row))}\n" for row in rows).encode()}


FORMAT = Format(
    name="lines",
    title=TITLE,
    recognises=partial(has_suffix, ".lines"),
    read=read,
    write=write,
    files=(FILE, "*.lines"),
    holds=frozenset({"names", "shared-cameras", "control"}),
    pixels=True,
)
