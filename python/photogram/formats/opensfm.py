"""OpenSfM and OpenDroneMap: `reconstruction.json` with `tracks.csv`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError, message_of
from photogram.formats.builder import BlockBuilder
from photogram.formats.crs import GEOGRAPHIC, from_frame
from photogram.formats.format import FORMATS
from photogram.formats.images import Y_DOWN, lens_with, named_pixels, pixel_rows, sizes_of
from photogram.formats.models import (
    attitude_matrices,
    chosen_model,
    complete_positions,
    known_cameras,
    known_points,
)
from photogram.formats.project import Project, Size
from photogram.formats.read_options import ReadOptions
from photogram.formats.recognition import opensfm
from photogram.io.files import read_lines
from photogram.io.json import read_json, to_json
from photogram.io.numbers import finite_number
from photogram.io.places import Place, at_place, one_word, positive
from photogram.io.tree import Tree
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.geometry import Frame
from photogram.network.observations import Observations, Position
from photogram.words import Phrase, phrase

MODEL, TRACKS = "reconstruction.json", "tracks.csv"
UNKNOWN_DOP = 15.0  # Metres: default of OpenSfM
NO_HEIGHT = 1e4  # Metres: standard deviation of heights that are not observed
_VERSIONS = {"OPENSFM_TRACKS_VERSION_v1": 9, "OPENSFM_TRACKS_VERSION_v2": 11}
_FIRST = 8


def read(path: Path, options: ReadOptions) -> Project:
    """Read the largest or the requested model of a file, with its tracks."""
    folder = opensfm(path)
    if folder is None:
        raise InputError(phrase("format.files", name=MODEL), file=path)
    block = BlockBuilder(folder / MODEL, FORMATS["opensfm"].title)
    messages = block.messages
    model = _model(read_json(folder / MODEL), options.model, messages)
    block.frame = _frame(model)
    for name, each in model["cameras"].items():
        size = each["width"].whole(1), each["height"].whole(1)
        with at_place(each):
            block.camera(_camera(name, each, *size), size)
    shots = dict(model["shots"].items())
    vectors = np.array([each["rotation"].numbers(3) for each in shots.values()])
    for shot, vector in zip(shots.values(), vectors, strict=True):
        if (most := np.abs(vector).max()) > 1e6:
            raise shot["rotation"].error(phrase("format.angles", most=1e6, unit="rad", value=float(most)))
    translations = np.array([each.get("translation", [0, 0, 0]).numbers(3) for each in shots.values()])
    rotations = _photocore.vector_rotations(vectors)
    centres = -np.einsum("nji,nj->ni", rotations, translations)
    for (name, shot), centre, rotation in zip(shots.items(), centres, rotations, strict=True):
        block.photo(name, shot["camera"].text(), shot["camera"])
        block.pose(name, centre, (Y_DOWN @ rotation).T)
    points = dict(model.get("points", {}).items())
    starts = np.array([each["coordinates"].numbers(3) for each in points.values()]).reshape(-1, 3)
    block.points(list(points), starts)
    file = folder / TRACKS
    photos, tracks, xy = _tracks(file, list(shots), list(points), messages)
    if not file.is_file():
        block.lacks.append(Phrase("read.tracks", {"file": TRACKS, "option": Phrase("option.images")}))
    sizes = np.array(block.sizes, dtype=float)[np.array(block.photo_cameras)[photos]]
    block.images(photos, tracks, sizes / 2 + sizes.max(axis=1, keepdims=True) * xy)
    block.observations += _gps(shots, options, messages)
    for name in ("gcp_list.txt", "ground_control_points.json"):
        if (folder / name).is_file():
            messages.append(Message.of("opensfm.control", file=name, path=folder / name))
    given = {name: each.get("color", [0, 0, 0]).numbers(3) for name, each in points.items()}
    colours = {name: list(map(int, colour)) for name, colour in given.items()}
    return block.project(details={"colours": colours}).replace(tracks=frozenset(points))


def _model(document: Tree, wanted: int | None, messages: list[Message]) -> Tree:
    models = list(document)
    if not models:
        raise document.error(phrase("format.missing", what="a reconstruction"))
    sizes = [sum(1 for _ in each["shots"].items()) for each in models]
    names = [f"{size} photos" for size in sizes]
    chosen = chosen_model(document, names, wanted, int(np.argmax(sizes)), messages)
    if not sizes[chosen]:
        raise models[chosen].error(phrase("format.missing", what="shots"))
    return models[chosen]


_PROJECTIONS = {
    "perspective": ("radial", "k1 k2"),
    "fisheye": ("radial_fisheye", "k1 k2"),
    "simple_radial": ("opencv", "k1"),
    "radial": ("opencv", "k1 k2"),
    "brown": ("full_opencv", "k1 k2 p1 p2 k3"),
    "fisheye_opencv": ("opencv_fisheye", "k1 k2 k3 k4"),
    **dict.fromkeys(("spherical", "equirectangular"), ("equirectangular", "")),
}
"""Camera model of each type of projection, and its terms of distortion."""


def _camera(name: str, each: Tree, width: int, height: int) -> Camera:
    kind = each.get("projection_type", "perspective").known("projection type", _PROJECTIONS)
    model, terms = _PROJECTIONS[kind]
    if model == "equirectangular":
        if width != 2 * height:
            raise each.error(phrase("opensfm.spherical", width=width, height=height))
        return Camera(model, {"w": float(width), "h": float(height)}, name=name)
    scale = float(max(width, height))
    values = {term: each.get(term, 0.0).number() for term in terms.split()}
    values |= {"cx": width / 2, "cy": height / 2}
    if model.startswith("radial"):
        values["f"] = scale * each["focal"].number()
    else:
        fx = each["focal_x"].number()
        values |= {"fx": scale * fx, "fy": scale * each.get("focal_y", fx).number()}
        for axis in "xy":
            values[f"c{axis}"] += scale * each.get(f"c_{axis}", 0.0).number()
    return Camera(model, values, name=name)


def _gps(shots: dict[str, Tree], options: ReadOptions, messages: list[Message]) -> Observations[Position]:
    given = {name: each["gps_position"].numbers(3) for name, each in shots.items() if "gps_position" in each}
    if not given or not any(map(any, given.values())):
        return Observations()
    heights = np.array([position[2] for position in given.values()])
    level = len(given) > 1 and float(np.ptp(heights)) < 1e-6
    if level:
        messages.append(Message(phrase("opensfm.heights")))
    deviations = []
    for name in given:
        dop = shots[name].get("gps_dop", UNKNOWN_DOP)
        sd = np.broadcast_to(options.sd.get("gnss", (dop.number(),)), 3).copy()
        positive(dop, "the standard deviation", float(sd.min()))
        if level:
            sd[2] = NO_HEIGHT
        deviations.append(sd)
    messages.append(Message(phrase("opensfm.gnss", n=len(given))))
    positions = np.array(list(given.values()))
    return Position.from_arrays(photo=list(given), position=positions, sd=np.array(deviations))


def _frame(model: Tree) -> Frame:
    if "reference_lla" not in model:
        return Frame()
    place = model["reference_lla"]
    latitude, longitude = place["latitude"].number(), place["longitude"].number()
    if abs(latitude) > 90 or abs(longitude) > 360:
        raise place.error(phrase("photos.degrees", longitude=longitude, latitude=latitude))
    return Frame("topocentric", "EPSG:4979", (latitude, longitude, place.get("altitude", 0.0).number()))


def _tracks(
    path: Path, names: list[str], points: list[str], messages: list[Message]
) -> tuple[Indices, Indices, Floats]:
    """Return photo, point and (m, 2) normalised coordinates of observations; none without a file."""
    lines = read_lines(path) if path.exists() else []
    width = _VERSIONS.get(lines[0].strip(), 0) if lines else 0
    if lines and not width and lines[0].startswith("OPENSFM_TRACKS_VERSION"):
        one_word(Place(path, 1, lines[0]), "version", lines[0], _VERSIONS)
    first = 1 if width else 0
    width = width or _FIRST
    photo_rows = {name: row for row, name in enumerate(names)}
    point_rows = {name: row for row, name in enumerate(points)}
    photos, tracks, xy = [], [], []
    left = 0
    for record, line in enumerate(lines[first:], first + 1):
        if not line:
            continue
        cells = line.split("\t")
        if len(cells) != width:
            raise Place(path, record, line).error(phrase("format.count", n=len(cells), required=width))
        photo, point = photo_rows.get(cells[0]), point_rows.get(cells[1])
        if photo is None or point is None:
            left += 1
            continue
        try:
            xy.append((finite_number(cells[3]), finite_number(cells[4])))
        except InputError as error:
            raise Place(path, record, line).error(message_of(error)) from None
        photos.append(photo)
        tracks.append(point)
    if left:
        messages.append(Message(phrase("format.unknown-images", n=left)))
    return np.array(photos, dtype=np.int64), np.array(tracks, dtype=np.int64), np.reshape(xy, (-1, 2))


CONTROL = "gcp_list.txt"
VERSION = "OPENSFM_TRACKS_VERSION_v2"


def cannot_hold(project: Project) -> list[Phrase]:
    """Return the list of control, which is not part of the model."""
    return [phrase("lost.control-list")] if _control(project) else []


def write(project: Project) -> Mapping[str, bytes]:
    """Return the two files, and the list of control of a georeferenced block."""
    block = project.block
    cameras, which = known_cameras(block)
    sizes = sizes_of(project)
    rows = np.flatnonzero(known_poses(block))
    if not len(rows):
        raise InputError(phrase("format.poses"))
    attitudes = Attitudes(attitude_matrices(block)[rows])
    rotations = attitudes.values("rotation_vector_to_vision").tolist()
    translations = attitudes.translations(block.photo_positions[rows]).tolist()
    gps = {each.photo: each for each in block.observations.of_type(Position)}
    shots: dict[str, Any] = {}
    for row, rotation, translation in zip(rows.tolist(), rotations, translations, strict=True):
        name = block.photo_ids[row]
        shots[name] = {"rotation": rotation, "translation": translation}
        shots[name] |= {"camera": cameras[which[row]].name, "orientation": 1}
        if name in gps:
            shots[name]["gps_position"] = gps[name].observed[:3].tolist()
            shots[name]["gps_dop"] = float(np.sqrt(np.trace(gps[name].precision) / 3))
    positions, colours, points = complete_positions(project), project.details.get("colours", {}), {}
    for row in np.flatnonzero(np.isfinite(positions).all(axis=1)).tolist():
        colour = list(map(float, colours.get(name := block.point_ids[row], (0, 0, 0))))
        points[name] = {"color": colour, "coordinates": positions[row].tolist()}
    members = {each.name: _camera_member(each, size) for each, size in zip(cameras, sizes, strict=True)}
    model: dict[str, Any] = {"cameras": members, "shots": shots, "points": points}
    frame = project.frame
    if frame.kind == "topocentric" and frame.origin is not None:
        names = ("latitude", "longitude", "altitude")
        model["reference_lla"] = dict(zip(names, frame.origin, strict=True))
    files = {MODEL: to_json([model]), TRACKS: _tracks_file(project, sizes, which, set(rows.tolist()))}
    control = _control(project)
    return {**files, **({CONTROL: control} if control else {})}


def _control(project: Project) -> bytes:
    """Return the list of control with image observations; empty without georeference.

    Points with unknown coordinates are omitted.
    """
    known = known_points(project)
    own = np.flatnonzero(np.isfinite(known.positions).all(axis=1)).tolist()
    if not own or project.frame.kind != "topocentric" or project.frame.origin is None:
        return b""
    found, _ = from_frame(GEOGRAPHIC, known.positions[own], np.zeros((len(own), 3, 3)), project.frame)
    places = {project.block.point_ids[known.rows[k]]: xyz for k, xyz in zip(own, found.tolist(), strict=True)}
    lines = ["WGS84"]
    # OpenSfM counts pixels from the centre of the first one and ends names at blanks.
    for photo, point, column, row in named_pixels(project):
        if point in places:
            names = ("_".join(name.split()) for name in (photo, point))
            lines.append(" ".join([*map(repr, [*places[point], column - 0.5, row - 0.5]), *names]))
    return ("\n".join(lines) + "\n").encode() if len(lines) > 1 else b""


def _camera_member(camera: Camera, size: Size) -> dict[str, Any]:
    (width, height), scale = size, max(size)
    found: dict[str, Any] = {"width": width, "height": height}
    if camera.model == "equirectangular":
        return {**found, "projection_type": "spherical"}
    brown, fisheye = (_PROJECTIONS[kind][1].split() for kind in ("brown", "fisheye_opencv"))
    lens, terms = lens_with(camera, size, "OpenSfM", *brown, fisheye=fisheye)
    return {
        **found,
        "projection_type": "fisheye_opencv" if lens.fisheye else "brown",
        "focal_x": lens.focal[0] / scale,
        "focal_y": lens.focal[1] / scale,
        "c_x": (lens.centre[0] - width / 2) / scale,
        "c_y": (lens.centre[1] - height / 2) / scale,
        **terms,
    }


def _tracks_file(project: Project, sizes: Sequence[Size], which: list[int], shots: set[int]) -> bytes:
    block, counts, lines = project.block, dict[int, int](), [VERSION]
    for photo, point, column, row in pixel_rows(project):
        if photo not in shots:
            continue
        feature = counts[photo] = counts.get(photo, -1) + 1
        size = sizes[which[photo]]
        x, y = (column - size[0] / 2) / max(size), (row - size[1] / 2) / max(size)
        name = block.photo_ids[photo].replace("\t", " ")
        lines.append(f"{name}\t{block.point_ids[point]}\t{feature}\t{x!r}\t{y!r}\t0.0004\t0\t0\t0\t-1\t-1")
    return ("\n".join(lines) + "\n").encode()
