"""BlocksExchange XML: Metashape, ContextCapture and iTwin, Pix4D, RealityCapture."""

from __future__ import annotations

from pathlib import Path

from photogram.formats.blocks_exchange.reading import TITLE, read
from photogram.formats.blocks_exchange.writing import FILE, cannot_hold, write
from photogram.formats.format import Format
from photogram.formats.xml_stream import root_of

__all__ = ["FORMAT"]


def _recognises(path: Path) -> bool:
    return path.is_file() and root_of(path)[0] == "BlocksExchange"


FORMAT = Format(
    name="blocks_exchange",
    title=TITLE,
    recognises=_recognises,
    read=read,
    write=write,
    files=(FILE, "*.xml"),
    cannot_hold=cannot_hold,
    pixels=True,
)
