"""AICON: photo and object coordinates, orientation and scale bars as text.

Columns as in the open reader of such files (applied-geodesy/bundle-adjustment, JAiCov): words between
blanks, one record per line, `#` before comments; millimetres and radians.

    .phc    photo, point, x, y, their standard deviations, residuals, method, active, -
    .ior    camera, -, -c, xh, yh, A1, A2, R0; then lines A3; B1 B2; C1 C2; width, height (mm), pixels of both
    .eor    photo, camera, X, Y, Z, omega, phi, kappa, order of rotations (0), active, 1: without orientation
    .obc    point, X, Y, Z, their standard deviations, rays, active, 0: control, datum
    .scale  number, "name", point, point, length, standard deviation, active
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.cards import Card, cards, has_suffix, one_file
from photogram.formats.format import Format, Wishes
from photogram.formats.project import Project, Size, assembled
from photogram.io.places import at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.network.observations import Distance
from photogram.words import Phrase, phrase

TITLE = "AICON block"
IMAGES, CAMERAS, POSES, POINTS, BARS = ".phc", ".ior", ".eor", ".obc", ".scale"
_NOT_ORIENTED = 1


@dataclass
class _Found:
    """The contents of the files, by names of photos and points."""

    cameras: dict[str, Camera] = field(default_factory=dict)
    sizes: dict[str, tuple[Size, float]] = field(default_factory=dict)
    photos: dict[str, str] = field(default_factory=dict)
    poses: dict[str, Floats] = field(default_factory=dict)
    points: dict[str, Floats] = field(default_factory=dict)
    held: dict[str, Floats] = field(default_factory=dict)
    images: list[tuple[str, str]] = field(default_factory=list)
    values: list[Floats] = field(default_factory=list)
    bars: list[Distance] = field(default_factory=list)
    left: dict[str, set[str]] = field(default_factory=lambda: {"photos": set(), "points": set()})
    messages: list[Message] = field(default_factory=list)


def read(path: Path, wishes: Wishes) -> Project:
    """Read photo coordinates and the other files; cameras are required."""
    folder = path if path.is_dir() else path.parent
    images = one_file(folder, IMAGES) if path.is_dir() else path
    if images is None:
        raise InputError(phrase("format.files", name=f"*{IMAGES}"), file=folder)
    beside = {
        suffix: each if (each := images.with_suffix(suffix)).is_file() else one_file(folder, suffix)
        for suffix in (CAMERAS, POSES, POINTS, BARS)
    }
    if beside[CAMERAS] is None:
        raise InputError(phrase("format.files", name=f"*{CAMERAS}"), file=images)
    found = _Found()
    beside[IMAGES] = images
    readers = {CAMERAS: _cameras, POSES: _poses, POINTS: _points, IMAGES: _images, BARS: _bars}
    for suffix, reader in readers.items():
        if (file := beside[suffix]) is not None:
            reader(file, found)
    return _project(images, found, wishes)


def _lines(path: Path) -> Iterator[Card]:
    return (each for each in cards(path) if each.words)


def _cameras(path: Path, found: _Found) -> None:
    lines = _lines(path)
    for head in lines:
        name = head.words[0]
        c, xp, yp, a1, a2, r0 = head.numbers(2, "c xh yh A1 A2 R0").tolist()
        values = {"c": -abs(c), "xp": xp, "yp": yp, "A1": a1, "A2": a2, "r0": r0}
        for names in ("A3", "B1 B2", "C1 C2", "width height columns rows"):
            card = next(lines, None)
            if card is None:
                raise head.place.error(phrase("format.end", name=names))
            values |= zip(names.split(), card.numbers(0, names).tolist(), strict=True)
        width, height, columns, rows = (values.pop(each) for each in names.split())
        size = int(columns), int(rows)
        if name in found.cameras or min(*size, width, height) <= 0 or size != (columns, rows):
            sides = {"width": width, "height": height, "columns": columns, "rows": rows}
            raise head.place.error(phrase("aicon.camera", name=name, **sides))
        with at_place(head.place):
            found.cameras[name] = Camera("brown_forward", values, name=f"camera {name}")
        found.sizes[name] = size, width / columns
        found.messages.append(
            Message(phrase("aicon.principal-distance", camera=name, value=c, distance=abs(c)), path)
        )
    if not found.cameras:
        raise InputError(phrase("format.missing", what="a camera"), file=path)


def _once(card: Card, names: Collection[str], what: str) -> str:
    """Return the first word of a line, a name that must be unique."""
    name = card.words[0]
    if name in names:
        raise card.place.error(phrase("format.repeated", what=what, name=name))
    return name


def _poses(path: Path, found: _Found) -> None:
    for card in _lines(path):
        name = _once(card, found.photos, "photo")
        order, active, state = card.numbers(8, "order active state").tolist()
        if not active:
            found.left["photos"].add(name)
            continue
        camera = card.words[1]
        if camera not in found.cameras:
            raise card.place.error(phrase("format.undefined", what="camera", name=camera))
        found.photos[name] = camera
        if state == _NOT_ORIENTED:
            continue
        if order != 0:
            raise card.place.error(phrase("aicon.order", order=order))
        found.poses[name] = card.numbers(2, "X Y Z omega phi kappa")


def _points(path: Path, found: _Found) -> None:
    for card in _lines(path):
        name = _once(card, found.points, "point")
        if len(card.words) >= 9 and not card.number(8, "active"):
            found.left["points"].add(name)
            continue
        found.points[name] = card.numbers(1, "X Y Z")
        if len(card.words) >= 10 and not card.number(9, "new"):
            found.held[name] = card.numbers(4, "sX sY sZ")
            if (found.held[name] < 0).any():
                raise card.place.error(phrase("format.negative"))


def _images(path: Path, found: _Found) -> None:
    lost = 0
    only = next(iter(found.cameras)) if len(found.cameras) == 1 else None
    for card in _lines(path):
        values = card.numbers(2, "x y sx sy")
        active = len(card.words) < 10 or card.number(9, "active") > 0
        photo, point = card.words[0], card.words[1]
        if not active or photo in found.left["photos"] or point in found.left["points"]:
            lost += 1
            continue
        if photo not in found.photos:
            if only is None:
                raise card.place.error(phrase("format.no-camera", photo=photo))
            found.photos[photo] = only
        found.images.append((photo, point))
        values[2:] = np.where(values[2:] > 0, values[2:], np.nan)
        found.values.append(values)
    if not found.images:
        raise InputError(phrase("format.missing", what="active image observations"), file=path)
    if lost:
        found.messages.append(Message(phrase("aicon.inactive", n=lost, what="image observations"), path))


def _bars(path: Path, found: _Found) -> None:
    seen = {point for _, point in found.images}
    for card in _lines(path):
        # Names of bars may contain blanks: the columns follow the last quotation mark.
        own = Card(card.place)
        own.words = (card.place.text or "").rpartition('"')[2].split()
        length, sd = own.numbers(2, "length sd").tolist()
        if len(own.words) > 4 and not own.number(4, "active"):
            continue
        first, second = own.words[:2]
        if not {first, second} <= seen:
            found.messages.append(Message(phrase("aicon.bar", first=first, second=second), path))
            continue
        if not (length > 0 and sd > 0) or first == second:
            raise card.place.error(phrase("aicon.length"))
        found.bars.append(Distance(first, second, length, sd))


def _project(path: Path, found: _Found, wishes: Wishes) -> Project:
    photos, order = list(found.photos), {name: row for row, name in enumerate(found.cameras)}
    points = list(dict.fromkeys([*(point for _, point in found.images), *found.held]))
    rows, places = ({name: row for row, name in enumerate(each)} for each in (photos, points))
    none = np.full(6, np.nan)
    poses = np.array([found.poses.get(name, none) for name in photos])
    matrices = np.full((len(photos), 3, 3), np.nan)
    posed = np.isfinite(poses).all(axis=1)
    if posed.any():
        matrices[posed] = Attitudes.of("omega_phi_kappa", poses[posed, 3:]).matrices
    starts = np.array([found.points.get(name, none[:3]) for name in points])
    held = np.array([name in found.held for name in points])[:, np.newaxis]
    sd = np.array([found.held.get(name, np.full(3, np.inf)) for name in points])
    if held.any() and "control" in wishes.sd:
        sd = np.where(held, wishes.sd["control"], np.inf)
    values = np.array(found.values)
    for kind, names in found.left.items():
        if names:
            found.messages.append(Message(phrase("aicon.inactive", n=len(names), what=kind)))
    return assembled(
        path=path,
        title=TITLE,
        cameras=list(found.cameras.values()),
        sizes=[size for size, _ in found.sizes.values()],
        pixel_mm=[pixel for _, pixel in found.sizes.values()],
        photo_ids=photos,
        photo_cameras=[order[camera] for camera in found.photos.values()],
        centres=poses[:, :3],
        matrices=matrices,
        point_ids=points,
        starts=starts,
        point_positions=np.where(held, starts, np.nan),
        point_sd=sd,
        image_photos=np.array([rows[photo] for photo, _ in found.images], dtype=np.int64),
        image_points=np.array([places[point] for _, point in found.images], dtype=np.int64),
        image_xy=values[:, :2],
        image_sd=values[:, 2:] if np.isfinite(values[:, 2:]).all() else None,
        observations=found.bars,
        lacks=[] if held.any() else [Phrase("read.free", {"option": Phrase("option.datum")})],
        messages=found.messages,
        linear_unit="mm",
    )


FORMAT = Format(name="aicon", title=TITLE, recognises=partial(has_suffix, IMAGES), read=read)
