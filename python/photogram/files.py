"""Writing files whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

__all__ = ["write_whole"]


def write_whole(files: Mapping[Path, bytes]) -> None:
    """Write files so that each is there whole or not at all.

    All are written beside their places first, then moved there.

    Raises
    ------
    OSError
        A file cannot be written; no file has changed unless the very moving of one failed.
    """
    begun: dict[Path, Path] = {}
    try:
        for path, content in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            begun[path] = path.with_name(f".{path.name}.{os.getpid()}.tmp")
            begun[path].write_bytes(content)
        for path, temporary in begun.items():
            temporary.replace(path)
    finally:
        for temporary in begun.values():
            temporary.unlink(missing_ok=True)
