"""Recognition of formats by the name or the start of a file; readers are not imported."""

from __future__ import annotations

import re
from pathlib import Path

from photogram.errors import InputError
from photogram.formats.format import FORMATS
from photogram.formats.xml_stream import root_of
from photogram.io import files
from photogram.io.packed_numbers import pieces

_FIRST_OF_BAL = re.compile(
    rb"[ \t]*[0-9]+[ \t]+[0-9]+[ \t]+[0-9]+[ \t\r]*\n[ \t]*[0-9]+[ \t]+[0-9]+[ \t]+\S+[ \t]+\S+"
)
"""Start of a problem: three counts, and the first image."""
_HEAD = 1 << 16  # Bytes that identify a network


def plain(path: Path) -> bool:
    """Return whether a folder contains settings, or a file may be settings."""
    return (path / "project.toml").is_file() if path.is_dir() else path.suffix.lower() == ".toml"


def colmap(path: Path) -> Path | None:
    """Return the folder of a model: a path itself, or `sparse/0` or `sparse` in it."""
    for folder in (path, path / "sparse" / "0", path / "sparse"):
        for end in (".bin", ".txt"):
            if (folder / f"cameras{end}").is_file() and (folder / f"images{end}").is_file():
                return folder
    return None


def opensfm(path: Path) -> Path | None:
    """Return the folder of a path, of `opensfm` in it, or of a model file."""
    (model,) = FORMATS["opensfm"].files
    if path.is_file():
        return path.parent if path.name == model else None
    return next((each for each in (path, path / "opensfm") if (each / model).is_file()), None)


def blocks_exchange(path: Path) -> bool:
    return path.is_file() and root_of(path)[0] == "BlocksExchange"


def agisoft(path: Path) -> bool:
    """Return whether a file is a document of Metashape; DBAT has the same root element."""
    root, attributes = root_of(path) if path.is_file() else ("", {})
    return root == "document" and not any(name.startswith("dbat") for name in attributes)


def bundle_of(path: Path) -> Path:
    return path / FORMATS["bundler"].files[0] if path.is_dir() else path


def _begin(path: Path) -> bytes:
    """Return the unpacked start of a file; empty if it is not a readable file."""
    try:
        return next(pieces(path), b"") if path.is_file() else b""
    except InputError:
        return b""


def bundler(path: Path) -> bool:
    return _begin(bundle_of(path)).startswith(b"# Bundle file")


def bal(path: Path) -> bool:
    return _FIRST_OF_BAL.match(_begin(path)[:1000]) is not None


def pixels(path: Path) -> bool:
    if not path.is_file() or path.suffix.lower() not in (".csv", ".tsv", ".txt"):
        return False
    from photogram.formats.pixels import has_pixels

    return has_pixels(path)


def has_suffix(suffix: str, path: Path) -> bool:
    """Return whether a file, or a file in a folder, has a suffix in any case."""
    return any(each.suffix.lower() == suffix for each in (path.iterdir() if path.is_dir() else (path,)))


def bingo(path: Path) -> bool:
    """Return whether a folder contains an image file of BINGO, or a file is one."""
    (name,) = FORMATS["bingo"].files
    return (path / name).is_file() if path.is_dir() else path.name.lower() == name


def giant(path: Path) -> bool:
    """Return whether a folder contains cards; only GIANT projects have COMMON."""
    if not path.is_dir():
        return False
    from photogram.giant.files import present_files

    present = present_files(path)
    return bool(present["COMMON"] and present["IMAGES"])


def isis(path: Path) -> bool:
    if not path.is_file():
        return False
    from photogram.formats.isis.network import is_network

    with files.reading(path), path.open("rb") as file:
        return is_network(file.read(_HEAD))


def targets(path: Path) -> bool:
    if (path / "project.toml").exists():
        return False
    from photogram.targets.corner_files import holds_targets

    return holds_targets(path)


def results(path: Path) -> bool:
    from photogram.results.result_files import SUMMARY

    return path.is_dir() and (path / SUMMARY).is_file() and (path / "state.parquet").is_file()
