"""Agisoft Metashape: camera XML with its markers."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.format import Format, later
from photogram.formats.xml_stream import root_of

__all__ = ["FILE", "FORMAT", "TITLE"]

FILE = "cameras.xml"
TITLE = "Agisoft camera XML"


def _recognises(path: Path) -> bool:
    root, attributes = root_of(path) if path.is_file() else ("", {})
    # Scripts and cameras of DBAT have the same root element.
    return root == "document" and not any(name.startswith("dbat") for name in attributes)


FORMAT = Format(
    name="agisoft",
    title=TITLE,
    recognises=_recognises,
    read=later(f"{__name__}.files", "read"),
    write=later(f"{__name__}.files", "write"),
    files=(FILE, "*.xml"),
    holds=frozenset({"names", "frame", "lenses", "shared-cameras", "control", "gnss"}),
    cannot_hold=later(f"{__name__}.files", "cannot_hold"),
    pixels=True,
)
