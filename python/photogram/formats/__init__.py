"""Projects in the files that people have: read, write, convert (docs/formats.md)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.formats import csm as csm
    from photogram.formats import isis as isis
    from photogram.formats import maps as maps
    from photogram.formats.crs import from_frame, to_frame
    from photogram.formats.crs_results import Placed, placed
    from photogram.formats.format import Format, PhotoFiles, Wishes
    from photogram.formats.metadata.merged import Metadata, PhotoRecord, read_metadata
    from photogram.formats.metadata.record import Said
    from photogram.formats.micmac import read_marks, write_marks
    from photogram.formats.project import Frame, Options, Project
    from photogram.formats.registry import (
        FORMATS,
        adjusting,
        cannot_hold,
        read,
        recognised,
        target,
        to_files,
    )

__all__ = [
    "FORMATS",
    "Format",
    "Frame",
    "Metadata",
    "Options",
    "PhotoFiles",
    "PhotoRecord",
    "Placed",
    "Project",
    "Said",
    "Wishes",
    "adjusting",
    "cannot_hold",
    "from_frame",
    "placed",
    "read",
    "read_marks",
    "read_metadata",
    "recognised",
    "target",
    "to_files",
    "to_frame",
    "write_marks",
]

_HOMES = {
    "Format": "format",
    "PhotoFiles": "format",
    "Wishes": "format",
    "Metadata": "metadata.merged",
    "PhotoRecord": "metadata.merged",
    "Said": "metadata.record",
    "read_metadata": "metadata.merged",
    "read_marks": "micmac",
    "write_marks": "micmac",
    "from_frame": "crs",
    "to_frame": "crs",
    "Placed": "crs_results",
    "placed": "crs_results",
    "Frame": "project",
    "Options": "project",
    "Project": "project",
    **dict.fromkeys(
        ("FORMATS", "adjusting", "cannot_hold", "read", "recognised", "target", "to_files"), "registry"
    ),
}
"""The module of each name, loaded when it is first asked for.

Who needs one file of this folder, as the commands of GIANT do, does not wait for the readers of all formats.
"""

MODULES = ("csm", "isis", "maps")
"""The packages that users know by name: loaded when they are first asked for, too."""

__getattr__, __dir__ = on_demand(__name__, {**_HOMES, **dict.fromkeys(MODULES, "")})
