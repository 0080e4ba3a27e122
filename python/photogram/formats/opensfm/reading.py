"""From `reconstruction.json` and `tracks.csv` to a project."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.format import Wishes
from photogram.formats.project import Frame, Project, Size, assembled
from photogram.formats.rotations import Y_DOWN
from photogram.io.files import read_lines
from photogram.io.json import Tree, read_json, unknown
from photogram.io.numbers import finite_number
from photogram.io.places import Place, at_place
from photogram.messages import Message, quoted
from photogram.network.cameras import Camera
from photogram.network.observations import Observation, Position
from photogram.words import Phrase

TITLE = "OpenSfM reconstruction"
MODEL, TRACKS = "reconstruction.json", "tracks.csv"
UNKNOWN_DOP = 15.0
"""Metres: what the package takes where nothing is said."""
NO_HEIGHT = 1e4
"""Metres: standard deviation of heights that are no observations."""
_VERSIONS = {"OPENSFM_TRACKS_VERSION_v1": 9, "OPENSFM_TRACKS_VERSION_v2": 11}
_FIRST = 8
_NO_TRACKS = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.empty((0, 2))


def place_of(path: Path) -> Path | None:
    """Return the folder with the files: a path, or `opensfm` in it; of a file that it lies in."""
    if path.is_file():
        return path.parent if path.name == MODEL else None
    return next((each for each in (path, path / "opensfm") if (each / MODEL).is_file()), None)


def read(path: Path, wishes: Wishes) -> Project:
    """Read the largest model of a file, or the one that is asked for, with its tracks."""
    folder = place_of(path)
    if folder is None:
        raise InputError(f"holds no {MODEL}", file=path)
    messages: list[Message] = []
    model = _model(read_json(folder / MODEL), wishes.model, messages)
    cameras, sizes = _cameras(model["cameras"])
    camera_rows = {each.name: row for row, each in enumerate(cameras)}
    shots = dict(model["shots"].items())
    names = list(shots)
    for name, shot in shots.items():
        if not name.strip() or not name.isprintable():
            raise shot.error(f"{quoted(name)} is no name")
        if shot["camera"].text() not in camera_rows:
            raise shot["camera"].error(f"there is no camera {quoted(shot['camera'].text())}")
    of_photo = np.array([camera_rows[shot["camera"].value] for shot in shots.values()], dtype=np.int64)
    rotations, translations = _poses(shots)
    points = dict(model.get("points", {}).items())
    there = (folder / TRACKS).is_file()
    photos, tracks, xy = _tracks(folder / TRACKS, names, list(points), messages) if there else _NO_TRACKS
    colours = {
        name: [int(c) for c in each.get("color", [0, 0, 0]).numbers(3)] for name, each in points.items()
    }
    scales = np.array([max(size) for size in sizes], dtype=float)[of_photo[photos]]
    middles = np.array(sizes, dtype=float)[of_photo[photos]] / 2
    return assembled(
        path=folder / MODEL,
        title=TITLE,
        cameras=cameras,
        sizes=list[Size | None](sizes),
        photo_ids=names,
        photo_cameras=of_photo,
        centres=-np.einsum("nji,nj->ni", rotations, translations),
        matrices=(Y_DOWN @ rotations).transpose(0, 2, 1),
        point_ids=list(points),
        starts=np.array([each["coordinates"].numbers(3) for each in points.values()]).reshape(-1, 3),
        image_photos=photos,
        image_points=tracks,
        image_xy=middles + scales[:, np.newaxis] * xy,
        observations=_gps(shots, wishes, messages),
        frame=_frame(model),
        lacks=[] if there else [Phrase("read.tracks", {"file": TRACKS, "option": Phrase("option.images")})],
        messages=[*messages, *_beside(folder)],
        details={"colours": colours},
    ).replace(tracks=frozenset(points))


def _model(document: Tree, wanted: int | None, messages: list[Message]) -> Tree:
    models = list(document)
    if not models:
        raise document.error("holds no reconstruction")
    sizes = [sum(1 for _ in each["shots"].items()) for each in models]
    if wanted is not None and wanted >= len(models):
        raise document.error(f"has {len(models)} reconstructions; there is no model {wanted}")
    chosen = int(np.argmax(sizes)) if wanted is None else wanted
    if len(models) > 1:
        listed = ", ".join(f"{row} with {count} photos" for row, count in enumerate(sizes))
        messages.append(Message(f"{len(models)} reconstructions: {listed}; taken is {chosen} (--model N)"))
    if not sizes[chosen]:
        raise models[chosen].error("has no shots")
    return models[chosen]


def _cameras(cameras: Tree) -> tuple[list[Camera], list[Size]]:
    found, sizes = [], []
    for name, each in cameras.items():
        width, height = each["width"].whole(1), each["height"].whole(1)
        with at_place(each):
            found.append(_camera(name, each, width, height))
        sizes.append((width, height))
    return found, sizes


def _camera(name: str, each: Tree, width: int, height: int) -> Camera:
    kind = each.get("projection_type", "perspective")
    scale = float(max(width, height))
    middle = {"cx": width / 2, "cy": height / 2}

    def terms(*names: str) -> dict[str, float]:
        return {term: each.get(term, 0.0).number() for term in names}

    if kind.value in ("perspective", "fisheye"):
        model = "radial" if kind.value == "perspective" else "radial_fisheye"
        return Camera(model, {"f": scale * each["focal"].number(), **middle, **terms("k1", "k2")}, name=name)
    if kind.value in ("spherical", "equirectangular"):
        if width != 2 * height:
            raise each.error("a spherical camera whose pictures are not twice as wide as high")
        return Camera("equirectangular", {"w": float(width), "h": float(height)}, name=name)
    models = {
        "simple_radial": ("opencv", ("k1",)),
        "radial": ("opencv", ("k1", "k2")),
        "brown": ("full_opencv", ("k1", "k2", "k3", "p1", "p2")),
        "fisheye_opencv": ("opencv_fisheye", ("k1", "k2", "k3", "k4")),
    }
    if not isinstance(kind.value, str) or kind.value not in models:
        raise unknown(kind, "the projection type", {**models, "perspective": 0, "fisheye": 0, "spherical": 0})
    model, names = models[kind.value]
    fx = each["focal_x"].number()
    return Camera(
        model,
        {
            "fx": scale * fx,
            "fy": scale * each.get("focal_y", fx).number(),
            "cx": middle["cx"] + scale * each.get("c_x", 0.0).number(),
            "cy": middle["cy"] + scale * each.get("c_y", 0.0).number(),
            **terms(*names),
        },
        name=name,
    )


def _poses(shots: dict[str, Tree]) -> tuple[Floats, Floats]:
    """Return (n, 3, 3) rotations world to camera, and (n, 3) translations."""
    vectors = np.array([each["rotation"].numbers(3) for each in shots.values()])
    for shot, vector in zip(shots.values(), vectors, strict=True):
        if np.abs(vector).max() > 1e6:
            raise shot["rotation"].error("is no rotation vector in radians")
    translations = np.array([each.get("translation", [0, 0, 0]).numbers(3) for each in shots.values()])
    return _photocore.vector_rotations(vectors), translations


def _gps(shots: dict[str, Tree], wishes: Wishes, messages: list[Message]) -> list[Observation]:
    given = {name: each["gps_position"].numbers(3) for name, each in shots.items() if "gps_position" in each}
    if not given or not any(position.any() for position in given.values()):
        return []
    heights = np.array([position[2] for position in given.values()])
    level = len(given) > 1 and float(np.ptp(heights)) < 1e-6
    if level:
        messages.append(Message("all GPS heights are one: they are no observations"))
    found: list[Observation] = []
    for name, position in given.items():
        dop = shots[name].get("gps_dop", UNKNOWN_DOP)
        sd = np.broadcast_to(wishes.sd.get("gnss", (dop.number(),)), 3).copy()
        if not (sd > 0).all():
            raise dop.error("is no standard deviation")
        if level:
            sd[2] = NO_HEIGHT
        found.append(Position(name, position, sd=sd))
    text = f"{len(found)} GPS positions are observations, by their gps_dop or --sd gnss=..."
    messages.append(Message(text))
    return found


def _frame(model: Tree) -> Frame:
    if "reference_lla" not in model:
        return Frame()
    place = model["reference_lla"]
    latitude, longitude = place["latitude"].number(), place["longitude"].number()
    if abs(latitude) > 90 or abs(longitude) > 360:
        raise place.error("is no latitude and longitude in degrees")
    return Frame("topocentric", "EPSG:4979", (latitude, longitude, place.get("altitude", 0.0).number()))


def _tracks(
    path: Path, names: list[str], points: list[str], messages: list[Message]
) -> tuple[Indices, Indices, Floats]:
    """Return photo, point and (m, 2) normalised coordinates of the observations that the model has."""
    lines = read_lines(path)
    width = _VERSIONS.get(lines[0].strip(), 0) if lines else 0
    if lines and not width and lines[0].startswith("OPENSFM_TRACKS_VERSION"):
        raise Place(path, 1, lines[0]).error("is of a version that is not known; v0, v1 and v2 are")
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
            raise Place(path, record, line).error(f"has {len(cells)} fields between tabs, not {width}")
        photo, point = photo_rows.get(cells[0]), point_rows.get(cells[1])
        if photo is None or point is None:
            left += 1
            continue
        try:
            xy.append((finite_number(cells[3]), finite_number(cells[4])))
        except ValueError as error:
            raise Place(path, record, line).error(str(error)) from None
        photos.append(photo)
        tracks.append(point)
    if left:
        text = f"{left} observations are of photos or points that the reconstruction does not have"
        messages.append(Message(text))
    return np.array(photos, dtype=np.int64), np.array(tracks, dtype=np.int64), np.reshape(xy, (-1, 2))


def _beside(folder: Path) -> list[Message]:
    found = [name for name in ("gcp_list.txt", "ground_control_points.json") if (folder / name).is_file()]
    return [Message(f"{name} lies beside: --control {folder / name} adds it") for name in found]
