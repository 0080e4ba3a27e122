"""Short summaries of objects, for terminals and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Sized
from dataclasses import fields
from textwrap import wrap

Rows = list[tuple[str, str]]  # Names and texts

WIDEST = 110  # Characters of a line
MOST = 20  # Lines of a `repr`
WHOLE = "verdict"  # This row is never truncated
NAMED = 6  # Maximum number of names of a list


class Brief:
    """Base class with a short summary, for data classes declared with `repr=False`."""

    def brief(self) -> tuple[str, Rows]:
        """Return a title and rows of a summary; by default all fields."""
        named = [each.name for each in fields(self)]  # type: ignore[arg-type]
        return type(self).__name__, [(name, told(getattr(self, name))) for name in named]

    def _lines(self) -> tuple[str, Rows]:
        title, rows = self.brief()
        if len(rows) > MOST:
            rows = [*rows[: MOST - 1], ("...", f"{len(rows) - MOST + 1} more")]
        return title, rows

    def __repr__(self) -> str:
        title, rows = self._lines()
        width, lines = max((len(name) for name, _ in rows), default=0), [title]
        for name, text in rows:
            parts = wrap(text, WIDEST - width - 4) if name == WHOLE else [text]
            lines += [f"  {'' if k else name:<{width}}  {part}" for k, part in enumerate(parts)]
        return "\n".join(line if len(line) <= WIDEST else f"{line[: WIDEST - 3]}..." for line in lines)

    def _repr_html_(self) -> str:
        from html import escape

        title, rows = self._lines()
        cells = "".join(
            f'<tr><th style="text-align: left">{escape(name)}</th>'
            f'<td style="text-align: left">{escape(told)}</td></tr>'
            for name, told in rows
        )
        return f"<div><p><strong>{escape(title)}</strong></p><table><tbody>{cells}</tbody></table></div>"


def few(names: Sequence[str]) -> str:
    """Return the number of names, and the first and last of them."""
    shown = list(names) if len(names) <= NAMED else [*names[: NAMED - 1], f"... {names[-1]}"]
    return f"{len(names):,}" + (f": {', '.join(shown)}" if shown else "")


def told(value: object) -> str:
    """Return a value in one line: numbers and text unchanged, others by type and size."""
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
