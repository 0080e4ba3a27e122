"""Files of a run: written under a temporary name and renamed, so that existing files are complete."""

from __future__ import annotations

import os
import platform
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.errors import AdjustmentError, InputError
from photogram.io.files import reading
from photogram.io.seals import SEAL, check_sealed, seal
from photogram.io.writing import Content, write_whole
from photogram.words import phrase

LOCK = "lock"


def _try_lock(descriptor: int) -> bool | None:
    """Lock a file; False if it is locked, None without support of locks."""
    try:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):
        return None
    return True


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Create and lock the folder of a run while this process works there.

    The lock ends with the process. File systems without locks are not protected. InputError if
    another process works there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LOCK
    with ExitStack() as stack:
        with reading(path):
            file = stack.enter_context(path.open("a+b", buffering=0))
        if _try_lock(file.fileno()) is False:
            file.seek(0)
            by = file.readline().decode("utf-8", "replace").strip()
            raise InputError(phrase("parts.busy", process=by), file=folder)
        # Only for the message of another process; failure on a full disk is harmless.
        with suppress(OSError):
            file.truncate(0)
            file.write(f"process {os.getpid()} on {platform.node()}\n".encode())
        yield


def write_file(path: Path, content: Content) -> None:
    """Write a file atomically; AdjustmentError if the disk is full or not writable.

    Two workers may write the same file if a task was repeated. The bytes are equal and temporary names
    differ.
    """
    try:
        write_whole({path: content})
    except OSError as error:
        raise AdjustmentError(
            phrase("parts.not-written", file=path, error=error.strerror or str(error))
        ) from None


def write_json(path: Path, document: Mapping[str, Any]) -> str:
    """Write a JSON file with a seal and return the seal; errors as in :func:`write_file`."""
    own = seal(document)
    sealed = {**document, SEAL: own}
    write_file(path, orjson.dumps(sealed, option=orjson.OPT_INDENT_2))
    return own


def read_json(path: Path) -> dict[str, Any]:
    """Read a file of :func:`write_json` without its seal; InputError if it was changed."""
    try:
        document = orjson.loads(path.read_bytes())
    except (OSError, orjson.JSONDecodeError) as error:
        reason = getattr(error, "strerror", None) or "damaged"
        raise InputError(phrase("parts.not-read", error=reason), file=path) from None
    if not isinstance(document, dict):
        raise InputError(phrase("parts.no-document"), file=path)
    check_sealed(document, path)
    del document[SEAL]
    return document


def write_arrays(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write arrays by name; errors as in :func:`write_file`."""
    write_file(path, lambda file: np.savez(file, allow_pickle=False, **arrays))


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read a file of :func:`write_arrays`; InputError if it is missing or damaged."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        reason = getattr(error, "strerror", None) or "damaged"
        raise InputError(phrase("parts.not-read", error=reason), file=path) from None
