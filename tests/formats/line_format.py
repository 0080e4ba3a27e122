"""Lines: cameras, photos, control points and image observations in a text file.

camera   NAME f WIDTH HEIGHT           principal distance and image size, pixels
photo    NAME CAMERA X Y Z o p k       projection centre; omega, phi, kappa in degrees
control  POINT X Y Z sd
image    PHOTO POINT COLUMN ROW        pixels from the upper-left corner
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from photogram import Attitudes, Camera, InputError
from photogram.formats import Format, Project, ReadOptions
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import cards, has_suffix
from photogram.formats.images import lens_of, sizes_of, to_corner
from photogram.formats.plain.writing import known_cameras
from photogram.words import phrase

FILE, TITLE = "block.lines", "file of lines"


def read(path: Path, options: ReadOptions) -> Project:
    """Read a file; errors of the builder name the line."""
    block = BlockBuilder(path, TITLE)
    for card in cards(path):
        kind, name, *_ = [*card.words, "", ""]
        if kind == "camera":
            f, width, height = card.numbers(2, "f WIDTH HEIGHT").tolist()
            terms = {"f": f, "cx": width / 2, "cy": height / 2}
            block.camera(
                Camera("simple_pinhole", terms, name=name), (int(width), int(height)), place=card.place
            )
        elif kind == "photo":
            block.photo(name, [*card.words, ""][2], card.place)
            values = card.numbers(3, "X Y Z o p k")
            block.pose(
                name, values[:3], Attitudes.of("omega_phi_kappa", [np.radians(values[3:])]).matrices[0]
            )
        elif kind == "control":
            block.control(name, card.numbers(2, "X Y Z"), card.number(5, "sd"), card.place)
        elif kind == "image" and name in block.photo_rows:
            block.image(name, card.words[2], *card.numbers(3, "COLUMN ROW").tolist())
        elif kind:
            raise card.place.error(
                phrase("format.undefined", what="photo" if kind == "image" else "line", name=name)
            )
    return block.project()


def write(project: Project) -> Mapping[str, bytes]:
    """Return the file; image coordinates are in pixels already."""
    block, lines = project.block, list[str]()
    cameras, which = known_cameras(block)
    for camera, (width, height) in zip(cameras, sizes_of(project), strict=True):
        lens = lens_of(camera, (width, height))
        if lens is None or not lens.is_plain() or (lens.cx, lens.cy) != (width / 2, height / 2):
            raise InputError(phrase("format.model", camera=camera.title, model=camera.model, title=TITLE))
        lines.append(f"camera {camera.name} {lens.fx!r} {width} {height}")
    for name, row, pose in zip(
        block.photo_ids,
        which,
        np.hstack([block.photo_positions, np.degrees(block.photo_attitudes)]).tolist(),
        strict=True,
    ):
        lines.append(" ".join(["photo", name, cameras[row].name, *map(repr, pose)]))
    for name, xyz, sd in zip(block.point_ids, block.point_positions.tolist(), block.point_sd, strict=True):
        if np.isfinite(sd).all():
            lines.append(" ".join(["control", name, *map(repr, [*xyz, float(sd.max())])]))
    pixels = zip(block.image_photos, block.image_points, to_corner(project).tolist(), strict=True)
    for photo, point, (column, row) in pixels:
        lines.append(f"image {block.photo_ids[photo]} {block.point_ids[point]} {column!r} {row!r}")
    return {FILE: "".join(f"{line}\n" for line in lines).encode()}


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
