"""Positions that files of photographs carry: RTK in XMP, a line of geo.txt, an adjustment with both.

The pictures are made here, tiny ones, for the six photos of the packaged example; one of them has no XMP, and
its position stands in geo.txt. Prints what the files say, and what the block makes of it. Needs
`photogram[photos,gis]`.
"""

from __future__ import annotations

import tempfile
from importlib.resources import files
from pathlib import Path

import numpy as np
from PIL import Image

from photogram import Result, adjust, formats
from photogram.formats import Frame, ReadOptions, from_frame, read_metadata

EXAMPLE = Path(str(files("photogram") / "examples" / "project"))
FRAME = Frame("topocentric", "EPSG:4979", (47.38, 8.54, 450.0))
SD = (0.012, 0.011, 0.025)
"""Of east, north and height, metres, as the receiver has it."""
XMP = (
    '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
    '<rdf:Description rdf:about="" xmlns:drone-dji="http://www.dji.com/drone-dji/1.0/" drone-dji:RtkFlag="50"'
    ' drone-dji:GpsLongitude="{:+.9f}" drone-dji:GpsLatitude="{:+.9f}" drone-dji:AbsoluteAltitude="{:+.3f}"'
    ' drone-dji:RtkStdLon="{}" drone-dji:RtkStdLat="{}" drone-dji:RtkStdHgt="{}"/></rdf:RDF></x:xmpmeta>'
)


def make(folder: Path) -> None:
    """Write tables without control or positions to a folder, and photographs with positions below it."""
    for name in ("cameras.csv", "photos.csv", "images.csv"):
        (folder / name).write_bytes((EXAMPLE / name).read_bytes())
    (folder / "project.toml").write_text("[project]\nformat = 1\n[sd]\nimages = 0.5\n")
    result = adjust(formats.read(EXAMPLE).block)
    count = len(result.photo_positions)
    moved = result.photo_positions + np.random.default_rng(7).normal(size=(count, 3)) * SD
    places = from_frame("EPSG:4979", moved, np.zeros((count, 3, 3)), FRAME)[0]
    photos = folder / "photos"
    photos.mkdir()
    for name, place in zip(result.block.photo_ids[1:], places[1:].tolist(), strict=True):
        Image.new("RGB", (40, 30)).save(photos / f"{name}.JPG", xmp=XMP.format(*place, *SD).encode())
    name, (longitude, latitude, height) = result.block.photo_ids[0], places[0].tolist()
    line = f"{name}.JPG {longitude:.9f} {latitude:.9f} {height:.3f} 0 0 0 0.020 0.040"
    (photos / "geo.txt").write_text(f"EPSG:4979\n{line}\n")


def main() -> Result:
    """Make the files, read them, adjust, and print what came out."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        make(folder)
        found = read_metadata(folder / "photos")
        for name, photo in found.photos.items():
            assert photo.position is not None
            assert photo.deviations is not None
            print(f"{name}  position: {photo.position.source:8}sd: {photo.deviations.sd}")
        print("standard deviations by source:", found.sources())
        project = formats.read(folder, ReadOptions(photos_dir=folder / "photos"))
    result = adjust(project.block, unit_variance="unity")
    sd = np.sqrt(np.diagonal(result.photo_covariances[:, :3, :3], axis1=1, axis2=2)).mean(axis=0)
    print("of adjusted positions, metres:", np.round(sd, 3))
    return result


if __name__ == "__main__":
    main()
