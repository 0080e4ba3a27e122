"""The heads of pictures: size, EXIF and XMP of JPEG, TIFF and DNG, without decoding (extra `photos`)."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from photogram.errors import InputError
from photogram.formats.metadata.exif import said_by_tags
from photogram.formats.metadata.record import Said
from photogram.formats.metadata.xmp import said_by_packet
from photogram.io.files import reading
from photogram.io.places import Place

__all__ = ["ENDINGS", "said_by_picture"]

ENDINGS = (".jpg", ".jpeg", ".tif", ".tiff", ".dng")
GPS = 0x8825
"""The tag of EXIF that leads to those of GPS."""


def said_by_picture(path: Path) -> list[Said]:
    """Return what the head of a picture says: of its XMP, then of its EXIF; nothing where neither speaks.

    Raises
    ------
    InputError
        The file cannot be read, is no picture, or says what cannot be; pillow is not installed.
    """
    packet, tags = _head(path)
    found = [None if packet is None else said_by_packet(packet, path), said_by_tags(tags, Place(path))]
    return [each for each in found if each is not None]


def _head(path: Path) -> tuple[bytes | None, Mapping[int, Any]]:
    """Return the packet of XMP and the GPS tags of a picture.

    The class of the format is opened itself: Image.open refuses large pictures, which are not decoded here.
    """
    try:
        from PIL.JpegImagePlugin import JpegImageFile
        from PIL.TiffImagePlugin import TiffImageFile
    except ImportError:
        raise InputError(
            "heads of pictures need pillow: pip install 'photogram[photos]'", file=path
        ) from None
    kind = JpegImageFile if path.suffix.lower() in (".jpg", ".jpeg") else TiffImageFile
    with reading(path):
        file = path.open("rb")
    with file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of tags that are damaged and not asked for
        try:
            with kind(file) as picture:
                packet = picture.info.get("xmp")
                tags = dict(picture.getexif().get_ifd(GPS))
        except Exception as error:  # whatever a damaged file makes the library raise
            raise InputError(f"cannot be read as a picture: {error}", file=path) from None
    return (packet if isinstance(packet, bytes) else None), tags
