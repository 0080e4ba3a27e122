"""BINGO: `image.dat` in millimetres, lines `ORIA`; principal distances come from a table of cameras."""

from __future__ import annotations

from pathlib import Path

from photogram.errors import InputError
from photogram.formats.cards import angle_unit, cards, to_radians
from photogram.formats.format import Format, Wishes
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.settings import bare_settings
from photogram.formats.plain.tables import Tables
from photogram.formats.project import Project
from photogram.formats.reduced import Reduced, project_of, with_fitting_rotations
from photogram.messages import Message, quoted
from photogram.network.attitudes import Attitudes

__all__ = ["FORMAT", "TITLE"]

TITLE = "BINGO block"
IMAGES, ORIENTATION = "image.dat", "orientation.dat"


def read(path: Path, wishes: Wishes) -> Project:
    """Read `image.dat`, and the orientation beside it; angles are in gon unless said otherwise.

    Raises
    ------
    InputError
        No table of cameras, lines that hold something else, rotations by which rays do not meet.
    """
    folder = path if path.is_dir() else path.parent
    images = folder / IMAGES if path.is_dir() else path
    if wishes.cameras is None:
        raise InputError(
            "has no principal distances: --camera FILE gives them, columns camera and c in mm", file=images
        )
    given = read_cameras(Tables(bare_settings(images, {"cameras": wishes.cameras}, image="mm"), []))
    known = {each.name: each for each in given.cameras}
    found = Reduced(cameras=known)
    photo: str | None = None
    for card in cards(images):
        if not card.words or card.ends:
            photo = None
        elif photo is None:
            photo, camera = card.words[0], card.words[1] if len(card.words) > 1 else ""
            if photo in found.photos:
                raise card.place.error(f"the photo {photo} is there twice")
            if camera not in known:
                raise card.place.error(f"there is no camera {quoted(camera)} in the table")
            found.photos[photo] = camera
        else:
            x, y = card.numbers(1, "x y").tolist()
            found.images.append((photo, card.words[0], x, y))
    if not found.images:
        raise InputError("has no images", file=images)
    used = set(found.photos.values())
    found.cameras = {name: each for name, each in known.items() if name in used}
    if (folder / ORIENTATION).is_file():
        _orientation(folder / ORIENTATION, found, wishes)
    first = found.images[0]
    message = Message(
        f"millimetres; first record: point {first[1]} on photo {first[0]}, x {first[2]:.4f}, y"
        f" {first[3]:.4f}",
        images,
    )
    return with_fitting_rotations(project_of(found, images, TITLE, wishes, [message]))


def _orientation(path: Path, found: Reduced, wishes: Wishes) -> None:
    unit = angle_unit(wishes.angles, "gon", path)
    for card in cards(path):
        if not card.words or card.ends:
            continue
        if card.words[0] != "ORIA":
            raise card.place.error(f"{quoted(card.words[0])} is no keyword that is read: ORIA is")
        if len(card.words) < 9:
            raise card.place.error("has not all of photo, camera, X, Y, Z, omega, phi, kappa")
        photo = card.words[1]
        if photo in found.poses:
            raise card.place.error(f"the photo {photo} is there twice")
        angles = to_radians(card.numbers(6, "omega phi kappa"), unit)
        if abs(angles).max() > 1e4:
            raise card.place.error("angles beyond all turns")
        found.poses[photo] = card.numbers(3, "X Y Z"), Attitudes.of("omega_phi_kappa", [angles]).matrices[0]


FORMAT = Format(
    name="bingo",
    title=TITLE,
    recognises=lambda path: (path / IMAGES).is_file() if path.is_dir() else path.name.lower() == IMAGES,
    read=read,
)
