"""Files of a run: written under another name and renamed into place, so that what is there is whole."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import orjson

from photogram.errors import AdjustmentError, InputError

__all__ = ["read_arrays", "read_json", "write_arrays", "write_file", "write_json"]


def write_file(path: Path, content: Callable[[BinaryIO], Any]) -> None:
    """Write a file whole or not at all.

    Two workers may write the same file at once, where a task was given to a second one: it has the same
    bytes, and each writes under a name of its own.

    Parameters
    ----------
    path
        Where it goes.
    content
        Writes to the open file.

    Raises
    ------
    AdjustmentError
        The disk is full, or the place cannot be written to.
    """
    under = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        try:
            with open(under, "wb") as file:
                content(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(under, path)
        except BaseException:
            under.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise AdjustmentError(
            f"{path}: cannot be written ({error.strerror or error}); what was finished before stays, and the"
            " run can be taken up again"
        ) from None


def write_json(path: Path, document: Any) -> None:
    """Write a document of JSON; errors as of :func:`write_file`."""
    write_file(path, lambda file: file.write(orjson.dumps(document, option=orjson.OPT_INDENT_2)))


def read_json(path: Path) -> Any:
    """Read a document of JSON.

    Raises
    ------
    InputError
        It is missing or damaged.
    """
    try:
        return orjson.loads(path.read_bytes())
    except (OSError, orjson.JSONDecodeError) as error:
        raise InputError(f"cannot be read ({error})", file=path) from None


def write_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write arrays by their names; errors as of :func:`write_file`."""
    write_file(path, lambda file: np.savez(file, allow_pickle=False, **arrays))


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read arrays that :func:`write_arrays` has written.

    Raises
    ------
    InputError
        The file is missing or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise InputError(f"cannot be read ({error})", file=path) from None
