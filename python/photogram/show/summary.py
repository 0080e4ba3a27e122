"""What a thing is in a few lines: its `repr` in a terminal, and a small table in a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import fields
from textwrap import wrap

Rows = list[tuple[str, str]]  # Names and texts

WIDEST = 110  # Characters of a line
MOST = 20  # Lines of a `repr`
WHOLE = "verdict"  # This row is never truncated
NAMED = 6  # Of a list


class Brief:
    """A thing that tells in a few lines what it is: a data class, declared with `repr=False`."""

    def brief(self) -> tuple[str, Rows]:
        """Return what it is in a line, and what else is to be told, most important first: its fields."""
        named = [each.name for each in fields(self)]  # type: ignore[arg-type]
        return type(self).__name__, [(name, told(getattr(self, name))) for name in named]

    def _lines(self) -> tuple[str, Rows]:
        title, rows = self.brief()
        if len(rows) > MOST:
            rows = [*rows[: MOST - 1], ("...", f"{len(rows) - MOST + 1} more")]
        return title, rows

    def __repr__(self) -> str:
        title, rows = self._lines()
        width = max((len(name) for name, _ in rows), default=0)
        lines = [_cut(title)]
        for name, told in rows:
            if name == WHOLE:
                parts = wrap(told, WIDEST - width - 4)
                heads = [name, *[""] * len(parts)]
                lines += [f"  {head:<{width}}  {part}" for head, part in zip(heads, parts, strict=False)]
            else:
                lines.append(_cut(f"  {name:<{width}}  {told}"))
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from html import escape

        title, rows = self._lines()
        cells = "".join(
            f'<tr><th style="text-align: left">{escape(name)}</th>'
            f'<td style="text-align: left">{escape(told)}</td></tr>'
            for name, told in rows
        )
        return f"<div><p><strong>{escape(title)}</strong></p><table><tbody>{cells}</tbody></table></div>"


def _cut(line: str) -> str:
    return line if len(line) <= WIDEST else f"{line[: WIDEST - 3]}..."


def few(names: Sequence[str]) -> str:
    """Return how many names there are, and the first and last of them."""
    shown = list(names) if len(names) <= NAMED else [*names[: NAMED - 1], f"... {names[-1]}"]
    return f"{len(names):,}" + (f": {', '.join(shown)}" if shown else "")


def told(value: object) -> str:
    """Return a value in a line: numbers and words as they are, of others what they are and how many."""
    if isinstance(value, Brief):
        return value.brief()[0]
    if value is None or isinstance(value, bool | int | float | str):
        return str(value)
    if isinstance(value, Mapping):
        return few([str(key) for key in value])
    if hasattr(value, "shape"):
        return f"array {value.shape}"
    if isinstance(value, Sequence) and all(isinstance(each, str) for each in value):
        return few(list(value))
    if isinstance(value, Sized):
        return f"{len(value):,}"
    return type(value).__name__
