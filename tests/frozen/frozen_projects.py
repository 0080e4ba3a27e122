"""Plain projects with all tables and keys, and summaries of the projects that their files contain.

`python tests/frozen/frozen_projects.py FOLDER...` writes `tests/data/frozen/projects.json.xz` with the
installed package. The file was written at commit ae1d3bec: its projects are outputs of the writer, and
projects of tests with all columns, units, axes and representations of attitudes. The file remains as it is.
"""

from __future__ import annotations

import hashlib
import json
import lzma
import math
import sys
from base64 import b64decode, b64encode
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from photogram import formats

TESTS = Path(__file__).parents[1]
FILE = TESTS / "data" / "frozen" / "projects.json.xz"
MORE = FILE.with_name("columns.json.xz")
"""Variants of the examples of commit ae1d3bec with the other keys, words and columns, read by its package."""
LISTED = 12
"""Longer lists of texts are stored as their length and a checksum."""
FIELDS = (
    *("photo_positions", "photo_attitudes", "principal_distances", "point_positions", "image_photos"),
    *("image_points", "image_xy", "image_sd", "photo_position_sd", "photo_attitude_sd", "point_sd"),
    *("photo_positions_observed", "photo_attitudes_observed", "photo_cameras", "point_check_sd"),
    *("photo_to_ground", "title", "linear_unit", "observations", "cameras", "mounts", "timed", "frame"),
)
"""Fields of blocks."""
OF_PROJECT = (
    *("sizes", "pixel_mm", "starts", "options", "features", "boards", "statement"),
    *("repeated", "unused"),
)

FORMER = {
    "AdjustOptions": ("Options", ("datum", "loss", "unit_variance", "max_iterations", "max_bias_ratio")),
}
"""Names and fields that classes had at commit ae1d3bec, if they have others now."""


def leaves(place: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the texts and numbers of an object with their places; elements of a list have one place."""
    if is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in fields(value) if field.init and not field.name.startswith("_")]
        kind, names = FORMER.get(type(value).__name__, (type(value).__name__, names))
        for name in names:
            yield from leaves(f"{place}.{kind}.{name}", getattr(value, name))
    elif isinstance(value, np.ndarray):
        yield place, value.astype(float).ravel().tolist()
    elif isinstance(value, dict):
        for name, member in value.items():
            yield from leaves(f"{place}[{name}]", member)
    elif isinstance(value, Sequence) and not isinstance(value, str):
        for member in value:
            yield from leaves(place, member)
    elif isinstance(value, bool | int | float | np.number):
        yield place, [float(value)]
    elif isinstance(value, str | Path):
        yield place, Path(value).name if isinstance(value, Path) else value


def summary(project: formats.Project) -> dict[str, Any]:
    """Return names, counts and sums of all values of a project."""
    block = project.block
    texts: dict[str, list[str]] = {"photos": list(block.photo_ids), "points": list(block.point_ids)}
    numbers: dict[str, list[float]] = {}
    for source, names in ((block, FIELDS), (project, OF_PROJECT)):
        for name in names:
            for place, value in leaves(name, getattr(source, name)):
                if isinstance(value, str):
                    texts.setdefault(place, []).append(value)
                else:
                    numbers.setdefault(place, []).extend(value)
    for place, words in texts.items():
        if len(words) > LISTED:
            digest = hashlib.sha256("\n".join(words).encode()).hexdigest()
            texts[place] = [str(len(words)), words[0], words[-1], digest[:12]]
    return {"texts": texts, "numbers": {place: sums(values) for place, values in numbers.items()}}


def sums(values: list[float]) -> list[float]:
    """Return the number of all, NaN and infinite values, and sums of the finite ones with four weights."""
    array = np.array(values)
    finite = np.where(np.isfinite(array), array, 0.0)
    rows = np.arange(1, len(array) + 1)
    counts = [len(array), int(np.isnan(array).sum()), int(np.isinf(array).sum())]
    weights = (np.sign(finite), np.ones(len(array)), np.cos(rows), np.sin(rows * math.sqrt(2)))
    return [*counts, *(float(finite @ weight) for weight in weights)]


def differences(before: dict[str, Any], after: dict[str, Any]) -> list[tuple[str, Any, Any]]:
    """Return the places where two summaries differ."""
    changed = [
        (place, before["texts"].get(place), after["texts"].get(place))
        for place in before["texts"] | after["texts"]
        if before["texts"].get(place) != after["texts"].get(place)
    ]
    for place in before["numbers"] | after["numbers"]:
        old, new = before["numbers"].get(place), after["numbers"].get(place)
        equal = old is not None and new is not None and old[:3] == new[:3]
        if not equal or not np.allclose(old[3:], new[3:], rtol=0, atol=1e-9 * max(old[3], 1e-3)):
            changed.append((place, old, new))
    return changed


def put(files: dict[str, str], folder: Path) -> Path:
    """Write the files of a project."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b64decode(content[7:]) if content[:7] == "base64:" else content.encode())
    return folder


def text_of(content: bytes) -> str:
    """Return a file as text."""
    try:
        return content.decode()
    except UnicodeDecodeError:
        return "base64:" + b64encode(content).decode()


def main() -> None:
    """Write the file of projects."""
    document = {}
    for folder in map(Path, sys.argv[1:]):
        files = {
            str(path.relative_to(folder)): text_of(path.read_bytes())
            for path in sorted(folder.rglob("*"))
            if path.is_file()
        }
        document[folder.name] = {"files": files, "summary": summary(formats.read(folder))}
    FILE.write_bytes(lzma.compress(json.dumps(document).encode(), preset=9 | lzma.PRESET_EXTREME))


if __name__ == "__main__":
    main()
