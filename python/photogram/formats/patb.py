"""PATB: image file in micrometres, orientation with matrices, control with codes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np

from photogram.errors import InputError
from photogram.formats.cards import (
    END,
    angle_unit,
    cards,
    has_suffix,
    names_beside,
    one_file,
    to_radians,
)
from photogram.formats.format import Format
from photogram.formats.images import checked_rotation
from photogram.formats.names import numbered
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.formats.reduced_coordinates import (
    HOLDS,
    ReducedBuilder,
    ReducedImages,
    by_photo,
    given_control,
    lost_of_reduced,
    reduced_images,
)
from photogram.io.csv_text import csv_text
from photogram.io.numbers import scaled
from photogram.network.attitudes import Attitudes
from photogram.words import Phrase, phrase

TITLE = "PATB block"
IMAGES, ORIENTATION, CONTROL, NAMES = ".im", ".ori", ".con", "names.csv"
MICROMETRES = 1e-3
DIGITS = 6  # Digits of principal distances in millimetres; files have three of micrometres


def read(path: Path, options: ReadOptions) -> Project:
    """Read the image file, and orientation, control and names if present."""
    folder = path if path.is_dir() else path.parent
    images = path if path.is_file() else one_file(folder, IMAGES)
    if images is None:
        raise InputError(phrase("format.files", name=f"*{IMAGES}"), file=path)
    names = names_beside(folder / NAMES)
    block = ReducedBuilder(images, TITLE, options.sd)
    _images(images, names, block)
    if (orientation := one_file(folder, ORIENTATION)) is not None:
        _orientation(orientation, names, block, options)
    if (control := one_file(folder, CONTROL)) is not None:
        _control(control, names, block)
    return block.reduced_project("um")


def _images(path: Path, names: dict[str, str], block: ReducedBuilder) -> None:
    photo: str | None = None
    for card in cards(path):
        if not card.words:
            continue
        if card.ends:
            photo = None
        elif photo is None:
            photo = names.get(card.words[0], card.words[0])
            c = card.number(1, "the principal distance") * MICROMETRES
            block.photo(photo, block.principal_distance(c, card.place), card.place)
        else:
            x, y = (scaled(card.numbers(1, "x y"), MICROMETRES)).tolist()
            block.image(photo, names.get(card.words[0], card.words[0]), x, y)


def _orientation(path: Path, names: dict[str, str], block: ReducedBuilder, options: ReadOptions) -> None:
    lines = [card for card in cards(path) if card.words and not card.ends]
    row = 0
    while row < len(lines):
        head = lines[row]
        row += 1
        photo = names.get(head.words[0], head.words[0])
        centre = head.numbers(1, "X Y Z")
        if len(head.words) >= 7:
            unit = angle_unit(options.angles, None, path)
            angles = to_radians(head.numbers(4, "omega phi kappa"), unit)
            matrix = Attitudes.of("omega_phi_kappa", [angles]).matrices[0]
        else:
            elements: list[float] = []
            while len(elements) < 9:
                if row >= len(lines):
                    raise head.place.error(phrase("format.end", name="the nine elements of the rotation"))
                elements += lines[row].numbers(0, " ".join(["element"] * len(lines[row].words))).tolist()
                row += 1
            if len(elements) != 9:
                raise head.place.error(phrase("format.count", n=len(elements), required=9))
            matrix = checked_rotation(head.place, np.array(elements).reshape(3, 3), 1e-4)
        block.pose(photo, centre, matrix, head.place)


def _control(path: Path, names: dict[str, str], block: ReducedBuilder) -> None:
    for card in cards(path):
        if not card.words or card.ends:
            continue
        name = names.get(card.words[0], card.words[0])
        position = card.numbers(1, "X Y Z")
        codes = [card.number(k, "a code") for k in range(4, min(len(card.words), 6))]
        # A single code applies to all coordinates, two to position and height.
        level, height = (code > 0 for code in (codes[0], codes[-1])) if codes else (False, False)
        block.known_point(name, position, np.array([level, level, height]), card.place)


def cannot_hold(project: Project) -> list[Phrase]:
    """Return parts of a project that the files cannot contain."""
    found = [*lost_of_reduced(project, reduced_images(project, DIGITS)), phrase("lost.patb-digits")]
    if any((held[0] != held[1]) for _, held in given_control(project).values()):
        found.append(phrase("lost.horizontal-control"))
    return found


def write(project: Project) -> Mapping[str, bytes]:
    """Return image file, orientation, control, and names if they are not numbers."""
    block, reduced = project.block, reduced_images(project, DIGITS)
    numbers = numbered([*block.photo_ids, *block.point_ids])
    images: list[str] = []
    distances = reduced.distances[reduced.cameras]
    for photo, c, own in zip(block.photo_ids, distances, by_photo(project, reduced), strict=True):
        images.append(f"{numbers[photo]:12d}{c / MICROMETRES:15.3f}")
        images += [
            f"{numbers[point]:12d}{x / MICROMETRES:16.4f}{y / MICROMETRES:16.4f}    0" for point, x, y in own
        ]
        images.append(f"{END:>12}")
    files = {f"block{IMAGES}": images, f"block{ORIENTATION}": _oriented(project, reduced, numbers)}
    control = [
        f"{numbers[name]:12d}{''.join(f'{0.0 if np.isnan(own) else own:17.5f}' for own in position)}"
        f"{int(held[:2].all()):5d}{int(held[2]):5d}"
        for name, (position, held) in given_control(project).items()
    ]
    files[f"block{CONTROL}"] = [*control, f"{END:>12}"] if control else []
    found = {name: ("\n".join(lines) + "\n").encode() for name, lines in files.items() if lines}
    if any(str(number) != name for name, number in numbers.items()):
        found[NAMES] = csv_text({"number": list(numbers.values()), "name": list(numbers)})
    return found


def _oriented(project: Project, reduced: ReducedImages, numbers: Mapping[str, int]) -> list[str]:
    lines = []
    for row in np.flatnonzero(reduced.posed).tolist():
        centre = "".join(f"{own:16.5f}" for own in project.block.photo_positions[row])
        elements = [f"{own:16.12f}" for own in reduced.matrices[row].ravel()]
        lines += [
            f"{numbers[project.block.photo_ids[row]]:16d}{'':16}{centre}",
            "".join(elements[:5]),
            "".join(elements[5:]),
        ]
    return lines


FORMAT = Format(
    name="patb",
    title=TITLE,
    recognises=partial(has_suffix, IMAGES),
    read=read,
    write=write,
    files=(f"block{IMAGES}", f"*{IMAGES}"),
    holds=HOLDS,
    cannot_hold=cannot_hold,
)
