"""The text files of COLMAP."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.formats.cards import filled_lines
from photogram.formats.colmap import content
from photogram.formats.colmap.binary import tracks_of
from photogram.io.files import read_lines
from photogram.io.places import Place

_EMPTY = 2**64 - 1
_HEADS = {
    "cameras": "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]",
    "images": "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)",
    "points3D": "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)",
    "rigs": "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID,"
    " HAS_POSE, [QW, QX, QY, QZ, TX, TY, TZ])",
    "frames": "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as"
    " (SENSOR_TYPE, SENSOR_ID, DATA_ID)",
}


class _Words:
    """The words of a line, taken one after the other."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self.words = (place.text or "").split()
        self.at = 0

    def word(self, what: str) -> str:
        """Return the next word."""
        if self.at >= len(self.words):
            raise self.place.error(f"ends before {what}")
        self.at += 1
        return self.words[self.at - 1]

    def number(self, what: str) -> float:
        """Return the next word as a number."""
        return self.place.number(self.word(what), what)

    def whole(self, what: str, highest: int = 2**32 - 1) -> int:
        """Return the next word as a whole number."""
        return self.place.whole(self.word(what), what, highest)

    def pose(self) -> content.Pose:
        """Return a quaternion and a translation."""
        values = [self.number(name) for name in ("QW", "QX", "QY", "QZ", "TX", "TY", "TZ")]
        return content.Pose(tuple(values[:4]), tuple(values[4:]))

    def rest(self) -> list[str]:
        """Return all words that are left."""
        return self.words[self.at :]

    def end(self) -> None:
        """Refuse words that are left."""
        if self.rest():
            raise self.place.error(f"has more than it should: {' '.join(self.rest()[:4])}")


def read_text(folder: Path) -> content.Model:
    """Read a model."""
    rigs, frames = folder / "rigs.txt", folder / "frames.txt"
    return content.Model(
        folder,
        [_camera(_Words(place)) for place in filled_lines(folder / "cameras.txt")],
        _images(folder / "images.txt"),
        _points(folder / "points3D.txt"),
        [_rig(_Words(place)) for place in filled_lines(rigs)] if rigs.is_file() else [],
        [_frame(_Words(place)) for place in filled_lines(frames)] if frames.is_file() else [],
    )


def _camera(words: _Words) -> content.Camera:
    number, model = words.whole("CAMERA_ID"), words.word("MODEL")
    counts = dict(content.MODELS)
    if model not in counts:
        raise words.place.error(f"camera {number} has the model {model}, which is not known")
    width, height = words.whole("WIDTH"), words.whole("HEIGHT")
    parameters = tuple(words.number(f"parameter {k + 1} of {counts[model]}") for k in range(counts[model]))
    words.end()
    return content.Camera(number, model, width, height, parameters, words.place)


def _images(path: Path) -> content.Images:
    lines = read_lines(path)
    numbers, cameras, names, places = [], [], [], []
    poses: list[content.Pose] = []
    features: list[Floats] = []
    record = 0
    while record < len(lines):
        line = lines[record]
        record += 1
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        place = Place(path, record, line)
        words = _Words(place)
        numbers.append(words.whole("IMAGE_ID"))
        poses.append(words.pose())
        cameras.append(words.whole("CAMERA_ID"))
        words.word("NAME")
        # A name goes to the end of the line: some programs write names with blanks.
        names.append(line.split(None, 9)[9].rstrip())
        places.append(place)
        features.append(_features(Place(path, record + 1, lines[record] if record < len(lines) else "")))
        record += 1
    whole = np.concatenate(features) if features else np.zeros((0, 3))
    return content.Images(
        np.array(numbers, dtype=np.int64),
        np.array(cameras, dtype=np.int64),
        np.array([each.quaternion for each in poses], dtype=float).reshape(-1, 4),
        np.array([each.translation for each in poses], dtype=float).reshape(-1, 3),
        names,
        np.array([len(each) for each in features], dtype=np.int64),
        whole[:, :2],
        whole[:, 2].astype(np.int64),
        places,
    )


def _features(place: Place) -> Floats:
    """Return (m, 3) column, row and id of the point of a line."""
    text = place.text or ""
    if not text.isascii():
        raise place.error("X, Y, POINT3D_ID: a character that is no part of a number")
    values, good = _photocore.read_numbers(text.encode())
    if not good:
        word = text.split()[len(values)]
        raise place.error(f"feature {len(values) // 3 + 1}: {word[:40]!r} is no finite number")
    if len(values) % 3:
        raise place.error(f"has {len(values)} numbers: they come in threes, X, Y, POINT3D_ID")
    found = values.reshape(-1, 3).copy()
    # 2^64 - 1 is how the binary files say that there is no point.
    found[found[:, 2] == float(_EMPTY), 2] = content.NO_POINT
    bad = np.flatnonzero(
        (found[:, 2] != np.floor(found[:, 2])) | (found[:, 2] < content.NO_POINT) | (found[:, 2] >= 2**53)
    )
    if len(bad):
        raise place.error(f"feature {bad[0] + 1}: {found[bad[0], 2]:g} is no number of a point")
    return found


def _points(path: Path) -> content.Points:
    numbers, tracks, places = [], [], []
    positions: list[list[float]] = []
    colours: list[list[int]] = []
    for place in filled_lines(path):
        words = _Words(place)
        numbers.append(words.whole("POINT3D_ID", 2**53))
        positions.append([words.number(name) for name in "XYZ"])
        colours.append([words.whole(name, 255) for name in "RGB"])
        words.number("ERROR")
        rest = words.rest()
        if len(rest) % 2:
            raise place.error(f"the track has {len(rest)} numbers: they come in twos, IMAGE_ID, POINT2D_IDX")
        tracks.append(len(rest) // 2)
        places.append(place)
    return content.Points(
        np.array(numbers, dtype=np.int64),
        np.array(positions, dtype=float).reshape(-1, 3),
        np.array(colours, dtype=np.int64).reshape(-1, 3),
        np.array(tracks, dtype=np.int64),
        places,
    )


def _rig(words: _Words) -> content.Rig:
    number, sensors = words.whole("RIG_ID"), words.whole("NUM_SENSORS", 10_000)
    if not sensors:
        words.end()
        return content.Rig(number, None, (), words.place)
    reference = words.word("REF_SENSOR_TYPE"), words.whole("REF_SENSOR_ID")
    others = []
    for _ in range(sensors - 1):
        kind, own = words.word("SENSOR_TYPE"), words.whole("SENSOR_ID")
        others.append((kind, own, words.pose() if words.whole("HAS_POSE", 1) else None))
    words.end()
    return content.Rig(number, reference, tuple(others), words.place)


def _frame(words: _Words) -> content.Frame:
    number, rig, pose = words.whole("FRAME_ID"), words.whole("RIG_ID"), words.pose()
    data = [
        (words.word("SENSOR_TYPE"), words.whole("SENSOR_ID"), words.whole("DATA_ID", 2**53))
        for _ in range(words.whole("NUM_DATA_IDS", 100_000))
    ]
    words.end()
    return content.Frame(number, rig, pose, tuple(data), words.place)


def text_files(model: content.Model) -> dict[str, bytes]:
    """Return the files of a model; names have underscores for blanks, at which COLMAP ends them."""
    images, points = model.images, model.points
    ends = np.cumsum(images.counts)
    image_lines = []
    for row, name in enumerate(images.names):
        own = slice(int(ends[row] - images.counts[row]), int(ends[row]))
        head = [images.numbers[row], *images.quaternions[row].tolist(), *images.translations[row].tolist()]
        image_lines.append(_line([*head, images.cameras[row], "_".join(name.split())]))
        features = zip(images.xy[own].tolist(), images.points[own].tolist(), strict=True)
        image_lines.append(" ".join(f"{x!r} {y!r} {point}" for (x, y), point in features))
    point_lines = [
        _line([number, *position, *colour, -1, *track.ravel().tolist()])
        for number, position, colour, track in zip(
            points.numbers.tolist(),
            points.positions.tolist(),
            points.colours.tolist(),
            tracks_of(model),
            strict=True,
        )
    ]
    lines = {
        "cameras": [_line([c.number, c.model, c.width, c.height, *c.parameters]) for c in model.cameras],
        "images": image_lines,
        "points3D": point_lines,
        "rigs": [_rig_line(each) for each in model.rigs],
        "frames": [
            _line(
                [f.number, f.rig, *_numbers(f.pose), len(f.data), *(word for each in f.data for word in each)]
            )
            for f in model.frames
        ],
    }
    return {f"{name}.txt": "\n".join([_HEADS[name], *own, ""]).encode() for name, own in lines.items()}


def _numbers(pose: content.Pose) -> tuple[float, ...]:
    return *pose.quaternion, *pose.translation


def _rig_line(rig: content.Rig) -> str:
    if rig.reference is None:
        return _line([rig.number, 0])
    words: list[object] = [rig.number, 1 + len(rig.sensors), *rig.reference]
    for kind, number, pose in rig.sensors:
        words += [kind, number, 0 if pose is None else 1, *(() if pose is None else _numbers(pose))]
    return _line(words)


def _line(words: Sequence[object]) -> str:
    return " ".join(repr(float(each)) if isinstance(each, float) else str(each) for each in words)
