"""Writer of all results: sets of files that are written together, or not at all.

`docs/command-line.md` describes the behaviour for users.
"""

from photogram.io.writing.outputs import Content, OutputSet, write_whole
from photogram.io.writing.targets import check_outputs

__all__ = ["Content", "OutputSet", "check_outputs", "write_whole"]
