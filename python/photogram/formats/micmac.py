"""Fiducial marks of MicMac: camera (mm), images (pixels), names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.interior import is_mirrored
from photogram.formats.models import known_cameras
from photogram.formats.plain.films import WrittenFilms
from photogram.formats.plain.tables import columns_of, columns_of_records
from photogram.formats.project import Project
from photogram.formats.xml_stream import Element, read_stream, root_of
from photogram.io.files import read_lines
from photogram.lazy_dataclasses import dataclass
from photogram.words import Phrase, phrase

SET, OF_IMAGE = "SetOfMesureAppuisFlottants", "MesureAppuiFlottant1Im"
SCANS, CAMERA, NAMES = "Ori-InterneScan", "MeasuresCamera.xml", "id_fiducial.txt"
_IMAGES = "MeasuresIm-*.xml"
AMID = 0.1  # Distance of the mean of marks from the origin, relative to the format, for a corner origin


@dataclass(frozen=True, eq=False)
class MicmacMarks:
    """Fiducial marks of a camera and their readings."""

    places: Mapping[str, Floats]  # (x, y) by mark, mm, y up, relative to their mean
    readings: Mapping[str, Mapping[str, Floats]]  # By photo and mark (column, row)
    turned: bool  # Whether y of the file counts down and was reversed
    remarks: tuple[Phrase, ...]  # Assumptions of the reader

    def tables(self, camera: str) -> dict[str, dict[str, Any]]:
        """Return the tables `fiducials` and `fiducial_images` of a camera."""
        rows = {
            "fiducials": (
                {"camera": camera, "fiducial": mark} | columns_of(("x", "y"), xy)
                for mark, xy in self.places.items()
            ),
            "fiducial_images": (
                {"photo": photo, "fiducial": mark} | columns_of(("column", "row"), xy)
                for photo, own in self.readings.items()
                for mark, xy in own.items()
            ),
        }
        return {name: columns_of_records(own) for name, own in rows.items()}


def has_marks(folder: Path) -> bool:
    return any(_scans(folder).glob(_IMAGES))


def _scans(folder: Path) -> Path:
    return folder / SCANS if (folder / SCANS).is_dir() else folder


def read_marks(folder: Path, camera: Path | None = None) -> MicmacMarks:
    """Read fiducial marks and their readings from a MicMac folder.

    `MeasuresCamera.xml` does not specify the direction of y. The direction in which most scans are not
    mirrored is used. Positions relative to a corner, which are usual, are reduced to the mean of the marks.
    `id_fiducial.txt` contains their names, if present. A remark reports marks without readings.

    Parameters
    ----------
    folder
        Folder that contains `Ori-InterneScan`, or this folder itself.
    camera
        The file of the camera; None: `MeasuresCamera.xml` in `Ori-InterneScan`, or in the folders around it.

    Raises
    ------
    InputError
        If a file is missing, unreadable or of another type. If a mark is repeated or missing in the camera,
        or the names in `id_fiducial.txt` differ from the marks of the camera.
    """
    scans = _scans(folder)
    if not (files := sorted(scans.glob(_IMAGES))):
        raise InputError(phrase("format.files", name=_IMAGES), file=scans)
    folders = (scans, folder, scans.parent)
    camera_file, names = (
        next((each / name for each in folders if (each / name).is_file()), None) for name in (CAMERA, NAMES)
    )
    path = camera or camera_file or scans / CAMERA
    places = _measures(path)
    if len(places) != 1:
        raise InputError(phrase("micmac.images", n=len(places)), file=path)
    (down,) = places.values()
    readings: dict[str, dict[str, Floats]] = {}
    for file in files:
        for photo, own in _measures(file).items():
            if strange := next((mark for mark in own if mark not in down), None):
                raise InputError(phrase("format.undefined", what="mark", name=strange), file=file)
            if photo in readings:
                raise InputError(phrase("format.repeated", what="photo", name=photo), file=file)
            readings[photo] = own
    read = {mark for own in readings.values() for mark in own}
    missing = [mark for mark in down if mark not in read]
    remarks = [phrase("micmac.unread", names=missing, n=len(missing))] if missing else []
    if names is not None:
        _check_names(names, path, down)
    turned, remark = _turned(down, readings)
    middle = np.mean([*down.values()], axis=0)
    if np.abs(middle).max() > AMID * np.ptp([*down.values()], axis=0).max():
        remarks.append(phrase("micmac.corner", x=float(middle[0]), y=float(middle[1])))
    else:
        middle = np.zeros(2)
    sign = np.array([1.0, -1.0 if turned else 1.0])
    amid = {mark: (xy - middle) * sign for mark, xy in down.items()}
    return MicmacMarks(amid, readings, turned, (remark, *remarks))


def _check_names(path: Path, camera: Path, places: Mapping[str, Floats]) -> None:
    """Reject names that differ from the marks of the camera."""
    given: set[str] = set()
    for record, line in enumerate(read_lines(path), 1):
        name = line.strip()
        if name and (name in given or name not in places):
            code = "format.repeated" if name in given else "format.undefined"
            raise InputError(phrase(code, what="mark", name=name), file=path, record=record, text=line)
        given.add(name)
    if unnamed := [mark for mark in places if mark not in given]:
        raise InputError(phrase("micmac.unnamed", names=unnamed, file=camera.name), file=path)


def _turned(
    places: Mapping[str, Floats], readings: Mapping[str, Mapping[str, Floats]]
) -> tuple[bool, Phrase]:
    """Return whether y counts down (as rows) in most photos, and a remark."""
    sides = [is_mirrored([places[mark] for mark in own], list(own.values())) for own in readings.values()]
    down, up = sides.count(False), sides.count(True)
    if not down and not up:
        return True, phrase("micmac.side-unknown")
    code = f"micmac.side-{'down' if down >= up else 'up'}"
    return down >= up, phrase(code, most=max(down, up), all=down + up, mirrored=min(down, up))


def _measures(path: Path) -> dict[str, dict[str, Floats]]:
    """Return coordinates by image and name; the root is a set, or one image."""
    found: dict[str, dict[str, Floats]] = {}

    def take(element: Element) -> None:
        own = found.setdefault(element.word("NameIm", path.stem), {})
        for each in element.all("OneMesureAF1I"):
            name = each.need("NamePt").text.strip()
            if not name or name in own:
                raise each.error(phrase("format.name", what="mark", name=name))
            own[name] = each.need("PtIm").numbers(2)

    root, _ = root_of(path)
    read_stream(path, {OF_IMAGE: take}, OF_IMAGE if root == OF_IMAGE else SET)
    return found


def write_marks(project: Project) -> dict[str, bytes]:
    """Return MicMac files of the marks of scanned films: pixels, and mm (y down).

    Raises
    ------
    InputError
        If readings in pixels are missing, or marks belong to several cameras.
    """
    cameras, which = known_cameras(project.block)
    films = WrittenFilms(project, [cameras[row].name for row in which])
    if not films.readings or not films.pixels:
        raise InputError(phrase("micmac.readings"))
    if len(films.certificates) != 1:
        raise InputError(phrase("micmac.cameras", names=list(films.certificates)))
    (certificate,) = films.certificates.values()
    places = {name: mark.position[:2] * [1.0, -1.0] for name, mark in certificate.marks.items()}
    photos: dict[str, dict[str, Floats]] = {}
    for each in films.readings:
        photos.setdefault(each.photo, {})[films.by_mark[each.mark]] = each.observed[:2]
    names = "".join(f"{name}\n" for name in places).encode()
    files = {NAMES: names, f"{SCANS}/{CAMERA}": _document("Glob", places, whole=False)}
    for photo, own in photos.items():
        files[f"{SCANS}/MeasuresIm-{photo}.xml"] = _document(photo, own, whole=True)
    return files


def _document(image: str, marks: Mapping[str, Floats], *, whole: bool) -> bytes:
    lines = [f"<{OF_IMAGE}>", f"<NameIm>{escape(image)}</NameIm>"]
    for name, xy in marks.items():
        x, y = xy.tolist()
        place = f"<NamePt>{escape(name)}</NamePt><PtIm>{x!r} {y!r}</PtIm>"
        lines.append(f"<OneMesureAF1I>{place}</OneMesureAF1I>")
    lines.append(f"</{OF_IMAGE}>")
    if whole:
        lines = [f"<{SET}>", *lines, f"</{SET}>"]
    return "\n".join(['<?xml version="1.0" ?>', *lines, ""]).encode()
