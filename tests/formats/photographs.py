"""Small pictures with EXIF and XMP, as cameras write them, and the packaged example with such pictures."""

from __future__ import annotations

import shutil
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from photogram import adjust, formats

EXAMPLE = Path(str(files("photogram") / "examples" / "project"))
ORIGIN = (47.38, 8.54, 450.0)
DJI = "http://www.dji.com/drone-dji/1.0/"
GPS, XMP = 0x8825, 700


def packet(attributes, *, space=DJI, nested=False):
    """Return a packet of XMP with properties as attributes, or as nested elements."""
    inside = "".join(f"<d:{name}>{value}</d:{name}>" for name, value in attributes.items()) if nested else ""
    outside = "" if nested else "".join(f' d:{name}="{value}"' for name, value in attributes.items())
    text = (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'<rdf:Description rdf:about="" xmlns:d="{space}"{outside}>{inside}</rdf:Description>'
        "</rdf:RDF></x:xmpmeta>"
    )
    return text.encode()


def dji(longitude, latitude, height, sd=(0.012, 0.011, 0.025), flag=50):
    """Return the properties of DJI."""
    found = {"RtkFlag": flag} if flag is not None else {}
    found |= {"GpsLatitude": f"{latitude:+.9f}", "GpsLongitude": f"{longitude:+.9f}"}
    found |= {"AbsoluteAltitude": f"{height:+.4f}"}
    return found | dict(zip(("RtkStdLon", "RtkStdLat", "RtkStdHgt"), sd or (), strict=False))


def tags(longitude, latitude, height, **others):
    """Return GPS tags of EXIF by their numbers; `others` as `tag_31=0.03`."""

    def parts(value):
        degrees, rest = divmod(abs(value) * 60, 60)
        return float(degrees), float(int(rest)), round((rest - int(rest)) * 60, 5)

    found = {
        1: "S" if latitude < 0 else "N",
        2: parts(latitude),
        3: "W" if longitude < 0 else "E",
        4: parts(longitude),
        5: b"\1" if height < 0 else b"\0",
        6: abs(height),
    }
    return found | {int(name.removeprefix("tag_")): value for name, value in others.items()}


def picture(path, *, xmp=None, gps=None):
    """Write a picture of a few pixels, JPEG or TIFF by its name."""
    image = pytest.importorskip("PIL.Image")
    path.parent.mkdir(parents=True, exist_ok=True)
    pixels = image.new("RGB", (16, 12))
    if path.suffix == ".tif":
        from PIL.TiffImagePlugin import ImageFileDirectory_v2

        info = ImageFileDirectory_v2()
        info.tagtype[XMP] = 1
        info.update({XMP: xmp} if xmp else {})
        info.update({GPS: gps} if gps else {})
        pixels.save(path, tiffinfo=info)
        return path
    exif = image.Exif()
    if gps:
        exif.get_ifd(GPS).update(gps)
    pixels.save(path, exif=exif, **({} if xmp is None else {"xmp": xmp}))
    return path


def block_with_pictures(folder, *, errors=(0.012, 0.011, 0.025), write=None):
    """Write images, cameras and poses of the example to a folder, its photographs below; return the truth.

    Parameters
    ----------
    folder
        Where; the tables have no position of a photo or point but those of photos as first values.
    errors
        Standard deviations of the errors that positions get: east, north, height.
    write
        Writes the picture of a path from its longitude, latitude and height; default: RTK in XMP.
    """
    pytest.importorskip("pyproj")
    from photogram.formats import Frame, from_frame

    folder.mkdir(parents=True, exist_ok=True)
    for name in ("cameras.csv", "photos.csv", "images.csv"):
        shutil.copy(EXAMPLE / name, folder)
    (folder / "project.toml").write_text("[project]\nformat = 1\n[sd]\nimages = 0.5\n")
    result = adjust(formats.read(EXAMPLE).block)
    frame = Frame("topocentric", "EPSG:4979", ORIGIN)
    count = len(result.photo_positions)
    moved = result.photo_positions + np.random.default_rng(5).normal(size=(count, 3)) * errors
    places, _ = from_frame("EPSG:4979", moved, np.zeros((count, 3, 3)), frame)
    for name, place in zip(result.block.photo_ids, places.tolist(), strict=True):
        path = folder / "photos" / f"{name}.JPG"
        if write is None:
            picture(path, xmp=packet(dji(*place)))
        else:
            write(path, *place)
    return result, dict(zip(result.block.photo_ids, places.tolist(), strict=True))
