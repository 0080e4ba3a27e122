"""Labels in PVL (parameter value language) of planetary images.

This reader is short; the package `pvl` would be an additional dependency of every installation.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple, TypeAlias

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase


class Quantity(NamedTuple):
    """A value with its unit, which follows in angle brackets."""

    value: Value
    unit: str


Value: TypeAlias = str | int | float | list["Value"] | Quantity


@dataclass
class Group:
    """A group or an object of a label."""

    name: str  # Empty for the label itself
    kind: str  # `group`, `object`, or `label`
    line: int = field(default=1, compare=False)  # First line, from 1
    items: list[tuple[str, Value]] = field(
        default_factory=list
    )  # In the order of the file, including repeated keys
    inside: list[Group] = field(default_factory=list)  # Groups and objects, in the order of the file

    def get(self, key: str) -> Value | None:
        """Return the first value of a key, ignoring case; None if it is missing."""
        return next((value for own, value in self.items if own.lower() == key.lower()), None)

    def groups(self, name: str) -> list[Group]:
        """Return the groups and objects of a name directly in it, ignoring case."""
        return [each for each in self.inside if each.name.lower() == name.lower()]

    def need(self, name: str, path: Path) -> Group:
        """Return the first group or object of a name, which the file must contain."""
        if not (found := self.groups(name)):
            raise InputError(phrase("format.member", name=name), file=path, record=self.line)
        return found[0]


_TOKEN = re.compile(
    r"""(?P<space>(?:\s+|\#[^\n]*|/\*(?s:.*?)\*/)+)
    |"(?P<double>[^"]*)"|'(?P<single>[^']*)'
    |<(?P<unit>[^<>\n]*)>
    |(?P<sign>[=(){},;])
    |(?P<word>(?:[^\s=(){},;"'<>/-]|/(?!\*)|-(?:\r?\n\s*)?)+)
    |(?P<end>\Z)|(?P<bad>(?s:.)+)""",
    re.VERBOSE,
)
_CONTINUED = re.compile(r"-\r?\n\s*")  # A hyphen at the end of a line: the text continues without it
_FOLDED = re.compile(r"\s*\n\s*")
_WHOLE = re.compile(r"[-+]?(?:0|[1-9]\d{0,17})")  # Leading zeros are part of a name
_DECIMAL = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_BASED = re.compile(r"(2|8|16)#([-+]?[0-9A-Fa-f]{1,16})#")
_PLAIN = re.compile(r"[^\s=(){},;\"'<>#/-](?:[^\s=(){},;\"'<>#/-]|/(?!\*)|-(?!$))*")
_DEEPEST = 32
_OPENING = {"(": ")", "{": "}"}
_BEGINS = {"group": "group", "begin_group": "group", "object": "object", "begin_object": "object"}
_ENDS = {"end_group": "group", "endgroup": "group", "end_object": "object", "endobject": "object"}


class _Reader:
    """A reader of consecutive tokens of a label."""

    def __init__(self, text: str, file: Path, numbers: bool) -> None:
        self.text, self.file, self.numbers = text, file, numbers
        self.tokens = (each for each in _TOKEN.finditer(text) if each.lastgroup != "space")
        self.known = 0, 1
        self.take()

    def take(self) -> None:
        """Move to the next token."""
        token = next(self.tokens)
        self.kind, self.word, self.start = str(token.lastgroup), token[str(token.lastgroup)], token.start()
        if self.kind == "bad":
            raise self.error("pvl.text", text=self.word)

    def line(self, at: int) -> int:
        """Return the number of a line; counting continues from the previous request."""
        known, line = self.known if self.known[0] <= at else (0, 1)
        self.known = at, line + self.text.count("\n", known, at)
        return self.known[1]

    def error(self, code: str, at: int | None = None, **fields: str) -> InputError:
        record = self.line(self.start if at is None else at)
        return InputError(phrase(code, **fields), file=self.file, record=record)

    def skip(self, sign: str) -> bool:
        """Move past a sign if it is next; return whether it was."""
        if there := self.kind == "sign" and self.word == sign:
            self.take()
        return there


def parsed(text: str, file: Path, *, numbers: bool = True) -> Group:
    """Return the groups of a label, up to its `End` or the end of the text.

    If `numbers` is False, numeric words remain text.
    """
    reader = _Reader(text, file, numbers)
    open_groups = [Group("", "label")]
    while reader.kind == "word" and reader.word.lower() != "end":
        start, key = reader.start, reader.word
        reader.take()
        if (ended := _ENDS.get(key.lower())) is not None:
            if len(open_groups) == 1 or open_groups[-1].kind != ended:
                raise reader.error("pvl.end", start, key=key)
            name = open_groups.pop().name
            if reader.skip("=") and str(_scalar(reader, key)).lower() != name.lower():
                raise reader.error("pvl.open", start, kind=ended, name=name)
            reader.skip(";")
            continue
        if not reader.skip("="):
            raise reader.error("pvl.value", start, key=key)
        if (kind := _BEGINS.get(key.lower())) is None:
            open_groups[-1].items.append((key, _value(reader, key)))
        else:
            begun = Group(str(_scalar(reader, key)), kind, reader.line(start))
            open_groups[-1].inside.append(begun)
            open_groups.append(begun)
        reader.skip(";")
        if reader.skip("="):
            raise reader.error("pvl.value", start, key=key)
    if reader.kind not in ("word", "end"):
        raise reader.error("pvl.text", text=reader.word)
    if len(open_groups) > 1:
        raise reader.error("pvl.open", kind=open_groups[-1].kind, name=open_groups[-1].name)
    return open_groups[0]


def _value(reader: _Reader, key: str, depth: int = 0) -> Value:
    value: Value
    if closing := _OPENING.get(reader.word) if reader.kind == "sign" else None:
        if depth == _DEEPEST:
            raise reader.error("error.nested")
        start, value = reader.start, []
        reader.take()
        while not reader.skip(closing):
            if value and not reader.skip(","):
                raise reader.error("pvl.list", start, key=key)
            value.append(_value(reader, key, depth + 1))
    else:
        value = _scalar(reader, key)
    if reader.kind == "unit":
        value = Quantity(value, reader.word.strip())
        reader.take()
    return value


def _scalar(reader: _Reader, key: str) -> str | int | float:
    kind, text = reader.kind, _CONTINUED.sub("", reader.word)
    if kind not in ("word", "double", "single"):
        raise reader.error("pvl.value", key=key)
    reader.take()
    if kind != "word":
        return _FOLDED.sub(" ", text)
    return _number(text) if reader.numbers else text


def _number(word: str) -> str | int | float:
    """Return the finite number in a word, otherwise the word."""
    if _WHOLE.fullmatch(word):
        return int(word)
    if (based := _BASED.fullmatch(word)) is not None:
        try:
            return int(based[2], int(based[1]))
        except ValueError:
            return word
    if _DECIMAL.fullmatch(word) and not word.isdigit() and math.isfinite(float(word)):
        return float(word)
    return word


def label_text(label: Group) -> str:
    """Return a label as text that :func:`parsed` reads without changes."""
    return "\n".join([*_lines(label, ""), "End", ""])


def _lines(group: Group, indent: str) -> list[str]:
    width = max((len(key) for key, _ in group.items), default=0)
    lines = [f"{indent}{key:{width}} = {_value_text(value)}" for key, value in group.items]
    for each in group.inside:
        kind = each.kind.capitalize()
        lines += [
            f"{indent}{kind} = {_value_text(each.name)}",
            *_lines(each, f"{indent}  "),
            f"{indent}End_{kind}",
        ]
    return lines


def _value_text(value: Value) -> str:
    if isinstance(value, Quantity):
        return f"{_value_text(value.value)} <{value.unit}>"
    if isinstance(value, list):
        return f"({', '.join(map(_value_text, value))})"
    if not isinstance(value, str):
        return repr(value)
    if _PLAIN.fullmatch(value) and value == _number(value):
        return value
    mark = "'" if '"' in value else '"'
    if mark in value or "\n" in value:
        raise InputError(phrase("pvl.text-written", value=value))
    return f"{mark}{value}{mark}"
