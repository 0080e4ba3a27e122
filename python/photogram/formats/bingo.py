"""BINGO: `image.dat` in millimetres, with lines `ORIA`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from photogram.errors import InputError
from photogram.formats.cards import END, angle_unit, cards, to_radians
from photogram.formats.format import Format
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables
from photogram.formats.plain.writing import control_table
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.formats.reduced_coordinates import (
    HOLDS,
    ReducedBuilder,
    by_photo,
    given_control,
    lost_of_reduced,
    reduced_images,
)
from photogram.io.csv_text import csv_text
from photogram.io.places import one_word
from photogram.network.attitudes import Attitudes
from photogram.words import Phrase, phrase

TITLE = "BINGO block"
IMAGES, ORIENTATION, CAMERAS = "image.dat", "orientation.dat", "cameras.csv"


def read(path: Path, options: ReadOptions) -> Project:
    """Read `image.dat` and the orientation; the default angle unit is gon."""
    folder = path if path.is_dir() else path.parent
    images = folder / IMAGES if path.is_dir() else path
    table = options.cameras or folder / CAMERAS
    if options.cameras is None and not table.is_file():
        raise InputError(phrase("format.cameras"), file=images)
    given = read_cameras(Tables(Settings(images, tables={"cameras": table}, image="mm"), []))
    known = {each.name: each for each in given.cameras}
    block = ReducedBuilder(images, TITLE, options.sd)
    photo: str | None = None
    for card in cards(images):
        if not card.words or card.ends:
            photo = None
        elif photo is None:
            photo, camera = card.words[0], card.words[1] if len(card.words) > 1 else ""
            if camera in known and camera not in block.camera_rows:
                block.camera(known[camera])
            block.photo(photo, camera, card.place)
        else:
            x, y = card.numbers(1, "x y").tolist()
            block.image(photo, card.words[0], x, y)
    if (folder / ORIENTATION).is_file():
        _orientation(folder / ORIENTATION, block, options)
    return block.reduced_project("mm")


def _orientation(path: Path, block: ReducedBuilder, options: ReadOptions) -> None:
    unit = angle_unit(options.angles, "gon", path)
    for card in cards(path):
        if not card.words or card.ends:
            continue
        one_word(card.place, "keyword", card.words[0], ["ORIA"])
        if len(card.words) < 9:
            raise card.place.error(phrase("format.member", name="photo, camera, X, Y, Z, omega, phi, kappa"))
        angles = to_radians(card.numbers(6, "omega phi kappa"), unit)
        if abs(angles).max() > 1e4:
            raise card.place.error(phrase("format.angles"))
        matrix = Attitudes.of("omega_phi_kappa", [angles]).matrices[0]
        block.pose(card.words[1], card.numbers(3, "X Y Z"), matrix, card.place)


def cannot_hold(project: Project) -> list[Phrase]:
    """Return parts of a project that the files cannot contain."""
    found = lost_of_reduced(project, reduced_images(project))
    if any(name != word for name, word in _words(project).items()):
        found.append(phrase("lost.blanks"))
    if given_control(project):
        found.append(phrase("lost.control-table"))
    return found


def _words(project: Project) -> dict[str, str]:
    """Return names as words of the files."""
    found: dict[str, str] = {}
    cameras = reduced_images(project).names
    for names in (project.block.photo_ids, project.block.point_ids, cameras):
        own = {name: "_".join(name.split()) for name in names}
        last = {word: name for name, word in own.items()}
        if same := [[name, last[word]] for name, word in own.items() if last[word] != name]:
            raise InputError(phrase("bingo.blanks", names=same[0]))
        found |= own
    if bad := [name for name, word in found.items() if word in (END, "C", "#")]:
        raise InputError(phrase("bingo.reserved", name=bad[0]))
    return found


def write(project: Project) -> Mapping[str, bytes]:
    """Return images, orientation, and tables of cameras and of control."""
    block, reduced, words = project.block, reduced_images(project), _words(project)
    lines: list[str] = []
    owners = [words[reduced.names[row]] for row in reduced.cameras.tolist()]
    for photo, camera, own in zip(block.photo_ids, owners, by_photo(project, reduced), strict=True):
        lines.append(f"{words[photo]} {camera}")
        lines += [f"{words[point]} {x!r} {y!r}" for point, x, y in own]
        lines.append(END)
    files = {IMAGES: ("\n".join(lines) + "\n").encode()}
    if len(rows := np.flatnonzero(reduced.posed)):
        angles = Attitudes(reduced.matrices[rows]).values("omega_phi_kappa") * (200 / np.pi)
        lines = []
        for row, own in zip(rows.tolist(), angles.tolist(), strict=True):
            numbers = " ".join(map(repr, [*block.photo_positions[row].tolist(), *own]))
            lines.append(f"ORIA {words[block.photo_ids[row]]} {owners[row]} {numbers}\n")
        files[ORIENTATION] = "".join(lines).encode()
    files[CAMERAS] = csv_text({"camera": [words[name] for name in reduced.names], "c": reduced.distances})
    if table := control_table(project):
        files["control.csv"] = csv_text({**table, "point": [words[name] for name in table["point"]]})
    return files


FORMAT = Format(
    name="bingo",
    title=TITLE,
    recognises=lambda path: (path / IMAGES).is_file() if path.is_dir() else path.name.lower() == IMAGES,
    read=read,
    write=write,
    files=(IMAGES,),
    holds=HOLDS,
    cannot_hold=cannot_hold,
)
