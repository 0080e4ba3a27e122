"""What a thing is in a few lines: its `repr` in a terminal, and a small table in a notebook."""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from collections.abc import Sequence

__all__ = ["Brief", "Rows", "few"]

Rows = list[tuple[str, str]]
"""What is told, and the telling, each in a line."""

WIDEST = 110
"""Characters of a line at most."""
MOST = 20
"""Lines at most, so that all is seen on one screen."""
NAMED = 6
"""Names that are listed of many."""


class Brief(ABC):
    """A thing that tells in a few lines what it is."""

    @abstractmethod
    def brief(self) -> tuple[str, Rows]:
        """Return what it is in a line, and what else is to be told, most important first."""

    def _lines(self) -> tuple[str, Rows]:
        title, rows = self.brief()
        if len(rows) > MOST:
            rows = [*rows[: MOST - 1], ("...", f"{len(rows) - MOST + 1} more")]
        return title, rows

    def __repr__(self) -> str:
        title, rows = self._lines()
        width = max((len(name) for name, _ in rows), default=0)
        lines = [title, *(f"  {name:<{width}}  {told}" for name, told in rows)]
        return "\n".join(line if len(line) <= WIDEST else f"{line[: WIDEST - 3]}..." for line in lines)

    def _repr_html_(self) -> str:
        """Return what notebooks show."""
        title, rows = self._lines()
        cells = "".join(
            f'<tr><th style="text-align: left">{html.escape(name)}</th>'
            f'<td style="text-align: left">{html.escape(told)}</td></tr>'
            for name, told in rows
        )
        return f"<div><p><strong>{html.escape(title)}</strong></p><table><tbody>{cells}</tbody></table></div>"


def few(names: Sequence[str]) -> str:
    """Return how many names there are, and the first and last of them."""
    shown = list(names) if len(names) <= NAMED else [*names[: NAMED - 1], f"... {names[-1]}"]
    return f"{len(names):,}" + (f": {', '.join(shown)}" if shown else "")
