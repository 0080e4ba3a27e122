"""Collections of photos, each with a camera f, k1, k2, as projects.

Bundler has `bundle.out`, and photo names in `list.txt` of the same folder. Problems of "Bundle Adjustment in
the Large" use numbers as names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools
from photogram.collection.collection import Collection
from photogram.collection.formats import bal, bundler
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

FILE, LIST = "bundle.out", "list.txt"
PROBLEM = "problem.txt"


def read_bundler(path: Path, options: ReadOptions) -> Project:
    """Read a Bundle file of version 0.3, and the list of photos in its folder."""
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
    found, names = collection_of(project)
    return {FILE: bundler.to_bytes(found), LIST: "".join(f"{name}\n" for name in names).encode()}


def read_bal(path: Path, options: ReadOptions) -> Project:
    """Read a problem, optionally packed; photos and points have numbers."""
    found = bal.read(path, pieces(path))
    return project_of(found, path, FORMATS["bal"].title, range(len(found.photo_parameters)))


def write_bal(project: Project) -> Mapping[str, bytes]:
    return {PROBLEM: bal.to_bytes(collection_of(project)[0])}


def project_of(found: Collection, path: Path, title: str, names: Sequence[str | int]) -> Project:
    """Return the project of a collection without unregistered photos (f is 0)."""
    registered = found.photo_parameters[:, 6] != 0
    block = BlockBuilder(path, title)
    if lost := [str(name) for name, there in zip(names, registered, strict=True) if not there]:
        block.messages.append(Message.of("format.unposed", n=len(lost), names=lost))
    parameters = found.photo_parameters[registered]
    to_photo = _photocore.vector_rotations(np.ascontiguousarray(parameters[:, :3]))
    block.messages.append(Message.of("bundler.cameras"))
    photos = [str(name) for name, there in zip(names, registered, strict=True) if there]
    for name, (f, k1, k2) in zip(photos, parameters[:, 6:].tolist(), strict=True):
        block.camera(Camera("bal", {"f": f, "k1": k1, "k2": k2}, name=name))
    centres = -np.einsum("nji,nj->ni", to_photo, parameters[:, 3:6])
    block.photos(photos, np.arange(len(photos)), centres, to_photo.transpose(0, 2, 1))
    block.points(list(map(str, range(len(found.point_positions)))), np.array(found.point_positions))
    rows = np.where(registered, np.cumsum(registered) - 1, -1)
    block.images(rows[found.image_photos], found.image_points, np.array(found.image_xy))
    block.lacks.append(Phrase("read.placeless", {"option": Phrase("option.control")}))
    return block.project()


def cannot_hold(project: Project) -> list[Phrase]:
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
    if camera.model == "radial" and size and (values["cx"], values["cy"]) == (size[0] / 2, size[1] / 2):
        return values["f"], values["k1"], values["k2"]
    return None


def collection_of(project: Project) -> tuple[Collection, list[str]]:
    block, positions, oriented = project.block, complete_positions(project), known_poses(project.block)
    cameras, photo_cameras = known_cameras(block)
    placed: Bools = np.asarray(np.isfinite(positions).all(axis=1))
    rows = np.flatnonzero(oriented[block.image_photos] & placed[block.image_points])
    if not len(rows):
        raise InputError(phrase("format.no-images"))
    # Image coordinates from the centre, reduced to f, k1, k2
    xy, directions = block.image_xy.copy(), image_directions(block)
    lenses = list[tuple[float, float, float]]()
    for row, (camera, size) in enumerate(zip(cameras, project.sizes, strict=True)):
        own, lens = np.asarray(photo_cameras)[block.image_photos] == row, _reduced(camera, size)
        lenses.append(lens or (camera.scale, 0.0, 0.0))
        if lens is None:
            with np.errstate(divide="ignore", invalid="ignore"):
                xy[own] = -camera.scale * directions[own, :2] / directions[own, 2:]
        elif camera.model == "radial" and size is not None:
            xy[own] = np.column_stack([xy[own, 0] - size[0] / 2, size[1] / 2 - xy[own, 1]])
    rows = rows[np.isfinite(xy[rows]).all(axis=1)]
    photos, of_photo, of_point = np.flatnonzero(oriented), np.cumsum(oriented) - 1, np.cumsum(placed) - 1
    to_photo = attitude_matrices(block)[photos].transpose(0, 2, 1)
    vectors = _photocore.rotation_vectors(np.ascontiguousarray(to_photo))
    translations = -np.einsum("nij,nj->ni", to_photo, block.photo_positions[photos])
    of_lenses = np.array([lenses[photo_cameras[row]] for row in photos]).reshape(-1, 3)
    found = Collection(
        photo_parameters=np.hstack([vectors, translations, of_lenses]),
        point_positions=positions[placed],
        image_photos=of_photo[block.image_photos[rows]],
        image_points=of_point[block.image_points[rows]],
        image_xy=xy[rows],
    )
    return found, [block.photo_ids[row] for row in photos]
