"""Lists of images with support data: cubes, ISDs, and what control networks call them."""

from __future__ import annotations

from pathlib import Path

from photogram.errors import InputError
from photogram.formats.cards import filled_lines
from photogram.formats.csm.cubes import is_cube, read_cube, read_label, serial_number
from photogram.formats.csm.isd import Isd
from photogram.formats.csm.reading import read_isd


def read_support(path: Path) -> Isd:
    """Read the support data of an image, of a cube or an ISD.

    Raises
    ------
    InputError
        As :func:`read_cube` and :func:`read_isd` have it.
    """
    return read_cube(path) if is_cube(path) else read_isd(path)


def read_list(path: Path) -> dict[str, Path]:
    """Return the files of a list of images by the serial numbers of these.

    Parameters
    ----------
    path
        A line an image: a path, or its serial number, a comma and a path; relative ones are within the
        folder of the list. Empty lines and those that begin with # do not count.

    Raises
    ------
    InputError
        Files that are not there; ISDs without a serial number; one that stands there twice; an empty list.
    """
    found: dict[str, Path] = {}
    for place in filled_lines(path):
        try:
            serial, file = _of_line((place.text or "").strip(), path.parent)
        except InputError as error:
            where = "" if error.file is None else f"{error.file}: "
            raise place.error(f"{where}{error.message}") from None
        if serial in found:
            raise place.error(f"{serial} stands there twice")
        found[serial] = file
    if not found:
        raise InputError("names no images", file=path)
    return found


def _of_line(text: str, folder: Path) -> tuple[str, Path]:
    """Return serial number and file of a line."""
    serial, comma, rest = text.partition(",")
    alone = folder / text
    if comma and not alone.is_file():
        file = folder / rest.strip()
        if not file.is_file():
            raise InputError(f"there is no file {rest.strip()}")
        return serial.strip(), file
    if not alone.is_file():
        raise InputError(f"there is no file {text}")
    if not is_cube(alone):
        raise InputError("an ISD does not say its serial number: write it before, with a comma")
    return serial_number(read_label(alone), alone), alone
