"""The one writer of all results: sets of files that are put in place together, or not at all.

How it looks from outside stands in `docs/command-line.md`.
"""

from photogram.io.writing.outputs import Content, OutputSet, write_whole
from photogram.io.writing.targets import check_outputs

__all__ = ["Content", "OutputSet", "check_outputs", "write_whole"]
