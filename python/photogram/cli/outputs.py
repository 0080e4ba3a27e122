"""How commands write their results: whole or not at all, and never over what they were made from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

__all__ = ["write_results"]


def write_results(files: Mapping[Path, bytes], inputs: Iterable[Path]) -> None:
    """Write files, unless one of them is an input.

    Parameters
    ----------
    files
        Contents by path.
    inputs
        The files that the command has read.

    Raises
    ------
    InputError
        A file would replace an input; nothing is written.
    OSError
        A file cannot be written.
    """
    from photogram.files import spare, write_whole

    spare(files, inputs)
    write_whole(files)
