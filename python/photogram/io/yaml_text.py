"""YAML as in OpenCV, ROS and Kalibr, without anchors and block text.

Anchors, block text and several documents are rejected with their lines. Tags such as `!!opencv-matrix` are
ignored.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_lines
from photogram.io.numbers import number_or_text
from photogram.io.places import Place
from photogram.words import phrase

DEEPEST = 50  # Largest depth of brackets and indents
# Possessive: a run of blanks would be split in all possible ways.
_KEY = re.compile(
    r"""("(?:[^"\\]|\\.)*+"\s*+|'[^']*+'\s*+|[^\s#'"\[\]{},&*!|>%@`-][^#:]*+|-[^\s#:][^#:]*+):(?:\s+|$)"""
)
_TAG = re.compile(r"!\S*\s*")
_TOKEN = re.compile(
    r"""\s*(?:([\[\]{},])|("(?:[^"\\]|\\.)*"|'(?:[^']|'')*')|([^\s\[\]{},:][^\[\]{},:]*(?::[^\s\[\]{},][^\[\]{},:]*)*)|(:))"""
)
_COMMENT = re.compile(r"(^|\s)#.*$")
_WORDS: Mapping[str, Any] = {"": None, "~": None, "null": None, "true": True, "false": False}


class _Line:
    """A line with content: its indent, its text without comments, its number."""

    def __init__(self, place: Place, text: str) -> None:
        self.place = place
        self.text = text.strip()
        self.indent = len(text) - len(text.lstrip())


def read_yaml_text(path: Path) -> dict[str, Any]:
    """Return the mapping in a file."""
    lines = []
    for record, text in enumerate(read_lines(path), 1):
        place = Place(path, record, text)
        if text.startswith("%YAML") or text.rstrip() in ("---", "..."):
            continue
        if "\t" in text[: len(text) - len(text.lstrip())]:
            raise place.error(phrase("yaml.tabs"))
        bare = text if '"' in text or "'" in text else _COMMENT.sub("", text)
        if bare.strip() and not bare.lstrip().startswith("#"):
            lines.append(_Line(place, bare))
    if not lines:
        raise InputError(phrase("error.empty-file", content="data"), file=path)
    reader = _Reader(lines)
    found = reader.block(lines[0].indent, 0)
    if reader.at < len(lines):
        raise lines[reader.at].place.error(phrase("yaml.indent"))
    if not isinstance(found, dict):
        raise InputError(phrase("yaml.mapping"), file=path)
    return found


class _Reader:
    def __init__(self, lines: list[_Line]) -> None:
        self.lines, self.at = lines, 0

    def block(self, indent: int, depth: int) -> Any:
        """Return the mapping or sequence whose lines begin at an indent."""
        if depth > DEEPEST:
            raise self.lines[self.at].place.error(phrase("error.nested"))
        if self.lines[self.at].text.startswith(("- ", "-\n")) or self.lines[self.at].text == "-":
            return self._sequence(indent, depth)
        found: dict[str, Any] = {}
        while self.at < len(self.lines) and self.lines[self.at].indent == indent:
            line = self.lines[self.at]
            key = _KEY.match(line.text)
            if key is None:
                raise line.place.error(phrase("yaml.key"))
            name = _scalar_text(key[1].rstrip())
            if name in found:
                raise line.place.error(phrase("error.repeated", kind="key", name=name))
            found[name] = self._value(line.text[key.end() :], indent, depth)
        return found

    def _sequence(self, indent: int, depth: int) -> list[Any]:
        found = []
        while self.at < len(self.lines) and self.lines[self.at].indent == indent:
            line = self.lines[self.at]
            if not (line.text.startswith("- ") or line.text == "-"):
                break
            rest = line.text[1:]
            inner = rest.lstrip()
            if _KEY.match(inner) and not inner.startswith(("[", "{")):
                # A mapping that begins after the dash.
                line.indent, line.text = indent + len(line.text) - len(inner), inner
                found.append(self.block(line.indent, depth + 1))
            else:
                found.append(self._value(inner, indent, depth))
        return found

    def _value(self, text: str, indent: int, depth: int) -> Any:
        """Return the value after a key or dash, or in indented lines."""
        line = self.lines[self.at]
        text = _TAG.sub("", text, count=1) if text.startswith("!") else text
        if text[:1] in ("&", "*", "|", ">", "@", "`"):
            raise line.place.error(phrase("yaml.form", form=text[:1]))
        if text[:1] in ("[", "{"):
            return self._flow(text)
        self.at += 1
        if text:
            return _scalar(text)
        if self.at == len(self.lines):
            return None
        below = self.lines[self.at]
        dashed = below.text == "-" or below.text.startswith("- ")
        if below.indent > indent or (below.indent == indent and dashed):
            return self.block(below.indent, depth + 1)
        return None

    def _flow(self, text: str) -> Any:
        """Return a list or mapping in brackets, which may continue over several lines."""
        first = self.lines[self.at].place
        self.at += 1
        tokens = _tokens(text, first)
        missing = _opened(tokens, 0, first)
        while missing > 0:
            if self.at == len(self.lines):
                raise first.error(phrase("yaml.bracket"))
            more = _tokens(self.lines[self.at].text, self.lines[self.at].place)
            missing = _opened(more, missing, first)
            tokens += more
            self.at += 1
        value, end = _item(tokens, 0, first)
        if end < len(tokens):
            raise first.error(phrase("yaml.bracket"))
        return value


_Tokens = list[tuple[str, str]]  # Type (a bracket, `,`, `:`, or `text`), and text of each token


def _tokens(text: str, place: Place) -> _Tokens:
    found: _Tokens = []
    at, end = 0, len(text.rstrip())
    while at < end:
        match = _TOKEN.match(text, at)
        if match is None:
            raise place.error(phrase("yaml.form", form=text[at:].strip()))
        mark, quoted, plain, colon = match.groups()
        found.append((mark or colon, mark or colon) if mark or colon else ("text", quoted or plain.strip()))
        at = match.end()
    return found


def _opened(tokens: _Tokens, depth: int, place: Place) -> int:
    """Return the number of open brackets after some tokens, from `depth` before them."""
    for kind, _ in tokens:
        depth += (kind in "[{") - (kind in "]}")
        if depth < 0:
            raise place.error(phrase("yaml.bracket"))
        if depth > DEEPEST:
            raise place.error(phrase("error.nested"))
    return depth


def _item(tokens: _Tokens, at: int, place: Place) -> tuple[Any, int]:
    kind, text = tokens[at] if at < len(tokens) else ("", "")
    if kind == "text":
        return _scalar(text), at + 1
    if kind not in ("[", "{"):
        raise place.error(phrase("yaml.bracket"))
    close = "]" if kind == "[" else "}"
    items: list[Any] = []
    pairs: dict[str, Any] = {}
    at += 1
    while at < len(tokens) and tokens[at][0] != close:
        value, at = _item(tokens, at, place)
        if close == "}":
            if at >= len(tokens) or tokens[at][0] != ":":
                raise place.error(phrase("yaml.value", key=str(value)))
            pairs[str(value)], at = _item(tokens, at + 1, place)
        else:
            items.append(value)
        if at < len(tokens) and tokens[at][0] == ",":
            at += 1
        elif at < len(tokens) and tokens[at][0] != close:
            raise place.error(phrase("yaml.bracket"))
    if at >= len(tokens):
        raise place.error(phrase("yaml.bracket"))
    return (items if close == "]" else pairs), at + 1


def _scalar_text(text: str) -> str:
    if text[:1] == '"':
        return re.sub(r"\\(.)", r"\1", text[1:-1])
    return text[1:-1].replace("''", "'") if text[:1] == "'" else text


def _scalar(text: str) -> Any:
    """Return a value: text in quotes, a number, true, false, nothing, or plain text."""
    if text[:1] in ("'", '"'):
        return _scalar_text(re.sub(r"""(["'])\s+#.*$""", r"\1", text))
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    return number_or_text(text)


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
    """Return a matrix in the format of ROS or OpenCV."""
    found = np.atleast_2d(np.asarray(values, dtype=float))
    rows, columns = found.shape
    tag, indent, kind = (" !!opencv-matrix", "   ", ["dt: d"]) if opencv else ("", "  ", [])
    lines = [f"rows: {rows}", f"cols: {columns}", *kind, f"data: {figures(found)}"]
    return [f"{name}:{tag}", *(indent + line for line in lines)]
