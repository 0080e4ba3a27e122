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
        The files, or directories of files, that the command has read.

    Raises
    ------
    InputError
        A file would replace an input, by whatever name; nothing is written.
    OSError
        A file cannot be written.
    """
    from photogram.errors import InputError
    from photogram.files import write_whole

    given = [file for path in inputs for file in (path.iterdir() if path.is_dir() else [path])]
    for path in files:
        if path.exists() and any(file.exists() and path.samefile(file) for file in given):
            raise InputError("the results would be written over the input", file=path)
    write_whole(files)
