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

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import Card, cards, file_of, one_file
from photogram.formats.format import FORMATS
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.places import at_place
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.network.observations import Distance
from photogram.words import Phrase, phrase

IMAGES, CAMERAS, POSES, POINTS, BARS = ".phc", ".ior", ".eor", ".obc", ".scale"
_NOT_ORIENTED = 1


class _Reader(BlockBuilder):
    """A block, with the photos and points that are inactive in the files."""

    def __init__(self, path: Path, control_sd: tuple[float, ...] | None) -> None:
        super().__init__(path, FORMATS["aicon"].title)
        self.control_sd, self.inactive = control_sd, {"photos": set[str](), "points": set[str]()}


def read(path: Path, options: ReadOptions) -> Project:
    """Read photo coordinates and the other files; cameras are required."""
    images = file_of(path, IMAGES)
    folder = images.parent
    files = {
        suffix: each if (each := images.with_suffix(suffix)).is_file() else one_file(folder, suffix)
        for suffix in (CAMERAS, POSES, POINTS, BARS)
    }
    if files[CAMERAS] is None:
        raise InputError(phrase("format.files", name=f"*{CAMERAS}"), file=images)
    block, files[IMAGES] = _Reader(images, options.sd.get("control")), images
    readers = {CAMERAS: _cameras, POSES: _poses, POINTS: _points, IMAGES: _images, BARS: _bars}
    for suffix, take in readers.items():
        if (file := files[suffix]) is not None:
            take(file, block)
    for kind, names in block.inactive.items():
        if names:
            block.messages.append(Message.of("aicon.inactive", n=len(names), what=kind))
    sd = np.array(block.image_sd)
    block.images(*block.image_rows(), sd if (sd > 0).all() else None)
    if not block.controls:
        block.lacks.append(Phrase("read.free", {"option": Phrase("option.datum")}))
    return block.project(linear_unit="mm")


def _lines(path: Path) -> Iterator[Card]:
    return (each for each in cards(path) if each.words)


def _cameras(path: Path, block: _Reader) -> None:
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
        if min(*size, width, height) <= 0 or size != (columns, rows):
            sides = {"width": width, "height": height, "columns": columns, "rows": rows}
            raise head.place.error(phrase("aicon.camera", name=name, **sides))
        with at_place(head.place):
            camera = Camera("brown_forward", values, name=f"camera {name}")
        block.camera(camera, size, width / columns, key=name, place=head.place)
        remark = phrase("aicon.principal-distance", camera=name, value=c, distance=abs(c))
        block.messages.append(Message(remark, path))
    if not block.cameras:
        raise InputError(phrase("format.missing", what="a camera"), file=path)


def _poses(path: Path, block: _Reader) -> None:
    for card in _lines(path):
        name = card.words[0]
        order, active, state = card.numbers(8, "order active state").tolist()
        if not active:
            block.inactive["photos"].add(name)
            continue
        block.photo(name, card.words[1], card.place)
        if state == _NOT_ORIENTED:
            continue
        if order != 0:
            raise card.place.error(phrase("aicon.order", order=order))
        pose = card.numbers(2, "X Y Z omega phi kappa")
        block.pose(name, pose[:3], Attitudes.of("omega_phi_kappa", [pose[3:]]).matrices[0])


def _points(path: Path, block: _Reader) -> None:
    for card in _lines(path):
        name = card.words[0]
        if len(card.words) >= 9 and not card.number(8, "active"):
            block.inactive["points"].add(name)
            continue
        xyz = card.numbers(1, "X Y Z")
        block.start(name, xyz, card.place)
        if len(card.words) >= 10 and not card.number(9, "new"):
            sd = card.numbers(4, "sX sY sZ")
            if (sd < 0).any():
                raise card.place.error(phrase("format.negative"))
            block.control(name, xyz, block.control_sd or sd, card.place)


def _images(path: Path, block: _Reader) -> None:
    lost, only = 0, list(block.camera_rows)
    for card in _lines(path):
        x, y, *sd = card.numbers(2, "x y sx sy").tolist()
        active = len(card.words) < 10 or card.number(9, "active") > 0
        photo, point = card.words[0], card.words[1]
        if not active or photo in block.inactive["photos"] or point in block.inactive["points"]:
            lost += 1
            continue
        if photo not in block.photo_rows:
            if len(only) > 1:
                raise card.place.error(phrase("format.no-camera", photo=photo))
            block.photo(photo, only[0], card.place)
        block.image(photo, point, x, y, sd=sd)
    if not block.image_keys:
        raise InputError(phrase("format.missing", what="active image observations"), file=path)
    if lost:
        block.messages.append(Message(phrase("aicon.inactive", n=lost, what="image observations"), path))


def _bars(path: Path, block: _Reader) -> None:
    for card in _lines(path):
        # Names of bars may contain blanks: the columns follow the last quotation mark.
        own = Card(card.place)
        own.words = (card.place.text or "").rpartition('"')[2].split()
        length, sd = own.numbers(2, "length sd").tolist()
        if len(own.words) > 4 and not own.number(4, "active"):
            continue
        first, second = own.words[:2]
        if not {first, second} <= block.point_rows.keys():
            block.messages.append(Message(phrase("aicon.bar", first=first, second=second), path))
            continue
        if not (length > 0 and sd > 0) or first == second:
            raise card.place.error(phrase("aicon.length"))
        block.observations.append(Distance(first, second, length, sd))
