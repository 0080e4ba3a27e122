"""Files of corners, boards and models at a path: how they are known, and whether a board was shown there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from photogram.io.files import read_beginning, reading
from photogram.lazy_dataclasses import dataclass
from photogram.targets.board import Board
from photogram.targets.board_files import is_board
from photogram.targets.corner_tables import is_headless, is_table, is_vnl, read_headless, read_table, read_vnl
from photogram.targets.corner_views import Measured
from photogram.targets.opencv_corners import BEGIN, is_npz, is_storage, read_npz, read_storage

__all__ = ["KEY", "Form", "files_at", "holds_targets", "is_picture", "sorted_files"]

MODEL = ".cameramodel"
KEY = "optimization_inputs"
"""Of a model of mrcal that keeps its corners."""
PICTURES = frozenset({".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".tif", ".tiff", ".webp"})
ENDINGS = frozenset(
    {*(".vnl", ".csv", ".tsv", ".txt", ".yml", ".yaml", ".xml", ".json", ".npz", ".toml"), MODEL}
)
MOST = 2000
"""Files of a folder that are looked at."""


@dataclass(frozen=True)
class Form:
    """A format of corners: how its files are known, and read; `clear` where nothing else looks like it."""

    title: str
    knows: Callable[[Path], bool]
    read: Callable[[Path, Board | None], Measured]
    clear: bool = True


_FORMS = (
    Form("corners of mrcal", is_vnl, read_vnl),
    Form("storage of OpenCV", is_storage, read_storage),
    Form("table of corners", is_table, read_table, clear=False),
    Form("rows of corners", is_headless, read_headless, clear=False),
    Form("arrays of OpenCV", is_npz, read_npz, clear=False),
)


def is_picture(path: Path) -> bool:
    """Return whether a file is a picture, by its name."""
    return path.suffix.lower() in PICTURES


def files_at(path: Path) -> list[Path]:
    """Return the files at a path: itself, or those of a folder and of the folders in it."""
    with reading(path):
        if not path.is_dir():
            path.stat()
            return [path]
        inside = sorted(path.iterdir())[:MOST]
        below = [file for each in inside if each.is_dir() for file in sorted(each.iterdir())[:MOST]]
        return [each for each in [*inside, *below] if each.is_file()]


def sorted_files(path: Path) -> tuple[list[Path], list[Path], dict[Form, list[Path]]]:
    """Return models of mrcal, descriptions of boards, and files of corners by their formats."""
    models, boards = [], []
    corners: dict[Form, list[Path]] = {}
    for each in files_at(path):
        if each.suffix.lower() not in ENDINGS:
            continue
        if is_board(each):
            boards.append(each)
        elif each.suffix == MODEL or (each.suffix == ".txt" and KEY in read_beginning(each, BEGIN)):
            models.append(each)
        elif (form := next((own for own in _FORMS if own.knows(each)), None)) is not None:
            corners.setdefault(form, []).append(each)
    return models, boards, corners


def holds_targets(path: Path) -> bool:
    """Return whether corners of a board lie at a path, beside a board or in a format that only they have."""
    with reading(path):
        if path.is_dir() and (path / "project.toml").exists():
            return False
        models, boards, corners = sorted_files(path)
    if boards and not path.is_dir():
        return False
    seen = corners or (boards and any(map(is_picture, files_at(path))))
    return bool(models or (boards and seen) or any(form.clear for form in corners))
