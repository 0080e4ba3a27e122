"""Projects in the files that people have: read, write, convert (docs/formats.md)."""

from photogram.formats.format import Format, Wishes
from photogram.formats.placing import Placed, placed
from photogram.formats.project import Frame, Options, Project
from photogram.formats.registry import FORMATS, cannot_hold, read, recognised, target, to_files

__all__ = [
    "FORMATS",
    "Format",
    "Frame",
    "Options",
    "Placed",
    "Project",
    "Wishes",
    "cannot_hold",
    "placed",
    "read",
    "recognised",
    "target",
    "to_files",
]
