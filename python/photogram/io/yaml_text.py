"""YAML as in OpenCV, ROS and Kalibr: values without aliases.

Tags such as `!!opencv-matrix` are ignored. PyYAML is an extra (`pip install 'photogram[yaml]'`).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_lines
from photogram.io.numbers import number_or_text
from photogram.words import Phrase, phrase

DEEPEST = 50  # Largest depth of lists and mappings
_WORDS = {"": None, "~": None, "null": None, "true": True, "false": False}


def read_yaml_text(path: Path) -> dict[str, Any]:
    """Return the mapping in a file."""
    try:
        import yaml
    except ImportError:
        raise InputError(
            phrase("error.package", what="YAML", package="pyyaml", extra="yaml"), file=path
        ) from None
    # The first line of OpenCV, `%YAML:1.0`, is not YAML.
    lines = ["" if line.startswith("%YAML") else line for line in read_lines(path)]
    events = yaml.parse("\n".join(lines), Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))

    def error(mark: Any, message: Phrase) -> InputError:
        record = min(mark.line + 1, len(lines)) if mark else None
        return InputError(message, file=path, record=record, text=lines[record - 1] if record else None)

    def value(event: Any, depth: int) -> Any:
        if isinstance(event, yaml.AliasEvent):
            raise error(event.start_mark, phrase("yaml.form", form=f"*{event.anchor}"))
        if isinstance(event, yaml.ScalarEvent):
            word = event.value.lower()
            return event.value if event.style else _WORDS.get(word, number_or_text(event.value))
        if depth == DEEPEST:
            raise error(event.start_mark, phrase("error.nested"))
        if isinstance(event, yaml.SequenceStartEvent):
            items = []
            while not isinstance(item := next(events), yaml.SequenceEndEvent):
                items.append(value(item, depth + 1))
            return items
        members: dict[str, Any] = {}
        while not isinstance(key := next(events), yaml.MappingEndEvent):
            if not isinstance(key, yaml.ScalarEvent):
                raise error(key.start_mark, phrase("yaml.key"))
            if key.value in members:
                raise error(key.start_mark, phrase("error.repeated", kind="key", name=key.value))
            members[key.value] = value(next(events), depth + 1)
        return members

    try:
        first = next((event for event in events if isinstance(event, yaml.NodeEvent)), None)
        if first is None:
            raise InputError(phrase("error.empty-file", content="data"), file=path)
        if not isinstance(first, yaml.MappingStartEvent):
            raise InputError(phrase("yaml.mapping"), file=path)
        content: dict[str, Any] = value(first, 0)
        if more := next((event for event in events if isinstance(event, yaml.NodeEvent)), None):
            raise error(more.start_mark, phrase("yaml.form", form="---"))
    except yaml.YAMLError as fault:
        mark, reason = getattr(fault, "problem_mark", None), getattr(fault, "problem", None)
        message = phrase("error.parse", format="YAML", reason=str(reason or fault))
        raise error(mark, message) from None
    return content


def figures(values: ArrayLike) -> str:
    """Return a list of numbers with all their digits."""
    return "[" + ", ".join(repr(float(each)) for each in np.ravel(values)) + "]"


def camera_info(
    name: str,
    size: tuple[int, int],
    matrix: Floats,
    lens: tuple[str, Sequence[float]],
    turn: Floats | None = None,
    projection: Floats | None = None,
) -> bytes:
    """Return a camera in ROS format (`sensor_msgs/CameraInfo`).

    The lens is the distortion model with its coefficients.
    """
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    if projection is None:
        projection = np.column_stack([matrix, np.zeros(3)])
    lines = [
        f"image_width: {size[0]}",
        f"image_height: {size[1]}",
        f'camera_name: "{escaped}"',
        *matrix_lines("camera_matrix", matrix),
        f"distortion_model: {lens[0]}",
        *matrix_lines("distortion_coefficients", [lens[1]]),
        *matrix_lines("rectification_matrix", np.eye(3) if turn is None else turn),
        *matrix_lines("projection_matrix", projection),
    ]
    return "\n".join([*lines, ""]).encode()


def matrix_lines(name: str, values: ArrayLike, *, opencv: bool = False) -> list[str]:
    found = np.atleast_2d(np.asarray(values, dtype=float))
    rows, columns = found.shape
    tag, indent, kind = (" !!opencv-matrix", "   ", ["dt: d"]) if opencv else ("", "  ", [])
    lines = [f"rows: {rows}", f"cols: {columns}", *kind, f"data: {figures(found)}"]
    return [f"{name}:{tag}", *(indent + line for line in lines)]
