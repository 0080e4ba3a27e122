"""BlocksExchange XML: Metashape, ContextCapture and iTwin, Pix4D, RealityCapture."""

from __future__ import annotations

from photogram.formats.format import Format, later
from photogram.formats.xml_stream import root_of

__all__ = ["FILE", "FORMAT", "TITLE"]

FILE = "block.xml"
TITLE = "BlocksExchange"


FORMAT = Format(
    name="blocks_exchange",
    title=TITLE,
    recognises=lambda path: path.is_file() and root_of(path)[0] == "BlocksExchange",
    read=later(f"{__name__}.files", "read"),
    write=later(f"{__name__}.files", "write"),
    files=(FILE, "*.xml"),
    holds=frozenset({"names", "points", "frame", "lenses", "shared-cameras", "control", "gnss", "unposed"}),
    cannot_hold=later(f"{__name__}.files", "cannot_hold"),
    pixels=True,
)
