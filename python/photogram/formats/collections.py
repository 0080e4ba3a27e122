"""Collections of photos, each with a camera f, k1, k2, as projects.

Bundler has `bundle.out`, and photo names in `list.txt` of the same folder. Problems of "Bundle Adjustment in
the Large" use numbers as names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.format import FORMATS
from photogram.formats.models import attitude_matrices, complete_positions, known_cameras
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.recognition import bundle_of
from photogram.io.files import read_lines
from photogram.io.packed_numbers import pieces
from photogram.messages import Message
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.rays import image_directions
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.collection.collection import Collection

FILE, LIST = "bundle.out", "list.txt"
PROBLEM = "problem.txt"


def read_bundler(path: Path, options: ReadOptions) -> Project:
    """Read a Bundle file of version 0.3, and the list of photos in its folder."""
    from photogram.collection.formats import bundler

    del options
    place = bundle_of(path)
    found = bundler.read(place, pieces(place))
    count = len(found.photo_parameters)
    names = [str(row) for row in range(count)]
    beside = place.parent / LIST
    if beside.is_file():
        lines = [line.rsplit(" 0 ", 1)[0].strip() for line in read_lines(beside) if line.strip()]
        if len(lines) != count:
            raise InputError(phrase("bundler.count", n=len(lines), file=place.name, count=count), file=beside)
        last = {line: row for row, line in enumerate(lines)}
        if bad := [line for row, line in enumerate(lines) if last[line] != row or not line.isprintable()]:
            raise InputError(phrase("bundler.names", name=bad[0]), file=beside)
        names = lines
    return project_of(found, place, FORMATS["bundler"].title, names)


def write_bundler(project: Project) -> Mapping[str, bytes]:
    """Return `bundle.out` and `list.txt`."""
    from photogram.collection.formats import bundler

    found, names = collection_of(project)
    return {FILE: bundler.to_bytes(found), LIST: "".join(f"{name}\n" for name in names).encode()}


def read_bal(path: Path, options: ReadOptions) -> Project:
    """Read a problem, optionally packed; photos and points have numbers."""
    from photogram.collection.formats import bal

    del options
    found = bal.read(path, pieces(path))
    return project_of(
        found, path, FORMATS["bal"].title, [str(row) for row in range(len(found.photo_parameters))]
    )


def write_bal(project: Project) -> Mapping[str, bytes]:
    """Return the problem."""
    from photogram.collection.formats import bal

    return {PROBLEM: bal.to_bytes(collection_of(project)[0])}


def project_of(found: Collection, path: Path, title: str, names: Sequence[str]) -> Project:
    """Return the project of a collection without unregistered photos (f is 0)."""
    registered = found.photo_parameters[:, 6] != 0
    rows = np.flatnonzero(registered)
    block = BlockBuilder(path, title)
    if len(rows) < len(registered):
        lost = [names[row] for row in np.flatnonzero(~registered).tolist()]
        block.messages.append(Message(phrase("format.unposed", n=len(lost), names=lost)))
    parameters = found.photo_parameters[rows]
    to_photo = _photocore.vector_rotations(np.ascontiguousarray(parameters[:, :3]))
    places = np.full(len(registered), -1, dtype=np.int64)
    places[rows] = np.arange(len(rows))
    block.messages.append(Message(phrase("bundler.cameras")))
    names = [names[row] for row in rows.tolist()]
    for name, (f, k1, k2) in zip(names, parameters[:, 6:].tolist(), strict=True):
        block.camera(Camera("bal", {"f": f, "k1": k1, "k2": k2}, name=name))
    centres = -np.einsum("nji,nj->ni", to_photo, parameters[:, 3:6])
    block.photos(names, np.arange(len(rows)), centres, to_photo.transpose(0, 2, 1))
    block.points(list(map(str, range(len(found.point_positions)))), np.array(found.point_positions))
    block.images(places[found.image_photos], found.image_points, np.array(found.image_xy))
    block.lacks.append(Phrase("read.placeless", {"option": Phrase("option.control")}))
    return block.project()


def cannot_hold(project: Project) -> list[Phrase]:
    """Return the parameters of cameras that a collection cannot contain."""
    cameras = zip(project.block.cameras, project.sizes, strict=True)
    moved = any(_reduced(camera, size) is None for camera, size in cameras)
    return [phrase("lost.moved-images")] if moved else []


def _reduced(camera: Camera, size: Size | None) -> tuple[float, float, float] | None:
    """Return f, k1, k2 of a camera without other parameters; None for all others."""
    values = camera.parameters
    if camera.model == "bal":
        return values["f"], values["k1"], values["k2"]
    if camera.model == "perspective":
        return -values["c"], 0.0, 0.0
    if (
        camera.model == "radial"
        and size is not None
        and (values["cx"], values["cy"]) == (size[0] / 2, size[1] / 2)
    ):
        return values["f"], values["k1"], values["k2"]
    return None


def collection_of(project: Project) -> tuple[Collection, list[str]]:
    """Return the collection of a project, and the names of its photos."""
    from photogram.collection.collection import Collection

    block = project.block
    cameras, photo_cameras = known_cameras(block)
    sizes = project.sizes
    positions = complete_positions(project)
    placed: Bools = np.asarray(np.isfinite(positions).all(axis=1))
    oriented = known_poses(block)
    rows = np.flatnonzero(oriented[block.image_photos] & placed[block.image_points])
    if not len(rows):
        raise InputError(phrase("format.no-images"))
    # Image coordinates from the centre, reduced to f, k1, k2
    xy, directions = block.image_xy.copy(), image_directions(block)
    for row, (camera, size) in enumerate(zip(cameras, sizes, strict=True)):
        own = np.asarray(photo_cameras)[block.image_photos] == row
        if _reduced(camera, size) is None:
            with np.errstate(divide="ignore", invalid="ignore"):
                xy[own] = -camera.scale * directions[own, :2] / directions[own, 2:]
        elif camera.model == "radial" and size is not None:
            xy[own] = np.column_stack([xy[own, 0] - size[0] / 2, size[1] / 2 - xy[own, 1]])
    rows = rows[np.isfinite(xy[rows]).all(axis=1)]
    photos, points = np.flatnonzero(oriented), np.flatnonzero(placed)
    of_photo, of_point = np.full(len(oriented), -1), np.full(len(placed), -1)
    of_photo[photos], of_point[points] = np.arange(len(photos)), np.arange(len(points))
    to_photo = attitude_matrices(block)[photos].transpose(0, 2, 1)
    lenses = [
        _reduced(each, size) or (each.scale, 0.0, 0.0) for each, size in zip(cameras, sizes, strict=True)
    ]
    parameters = np.hstack(
        [
            _photocore.rotation_vectors(np.ascontiguousarray(to_photo)),
            -np.einsum("nij,nj->ni", to_photo, block.photo_positions[photos]),
            np.array([lenses[photo_cameras[row]] for row in photos]).reshape(-1, 3),
        ]
    )
    found = Collection(
        photo_parameters=parameters,
        point_positions=positions[points],
        image_photos=of_photo[block.image_photos[rows]],
        image_points=of_point[block.image_points[rows]],
        image_xy=xy[rows],
    )
    return found, [block.photo_ids[row] for row in photos]
