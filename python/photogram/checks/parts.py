"""What a section of a check consists of: sentences, figures, small tables, lists of names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

__all__ = ["Figure", "Listing", "Names", "Part"]

NAMES_ON_A_LINE = 4


@dataclass(frozen=True)
class Figure:
    """A figure with its name.

    Attributes
    ----------
    name, value
        The value with its unit.
    """

    name: str
    value: str

    def lines(self) -> list[str]:
        """Return it as text."""
        return [f"{self.name:<50}{self.value}"]


@dataclass(frozen=True)
class Listing:
    """A small table.

    Attributes
    ----------
    columns
        Heads with their units, and how values stand in text, as for `format`: `>12.2f`.
    rows
        The values.
    """

    columns: Sequence[tuple[str, str]]
    rows: Sequence[Sequence[str | float]]

    def lines(self) -> list[str]:
        """Return it as text."""
        heads = "".join(format(head, re.sub(r"\.\d+f", "", layout)) for head, layout in self.columns)
        layouts = [layout for _, layout in self.columns]
        return [heads, *("".join(map(format, row, layouts)) for row in self.rows)]


@dataclass(frozen=True)
class Names:
    """Names below a heading of the 1987 program.

    Attributes
    ----------
    heading
        In capital letters, as it was printed.
    names
        Of photos or points.
    above
        What was printed above the first of them.
    """

    heading: str
    names: Sequence[str]
    above: str = ""

    def lines(self) -> list[str]:
        """Return them as text."""
        cells = [f"{name:<10}" for name in self.names]
        return [
            *([self.above] if self.above else []),
            self.heading,
            *(
                "  " + "".join(cells[first : first + NAMES_ON_A_LINE]).rstrip()
                for first in range(0, len(cells), NAMES_ON_A_LINE)
            ),
        ]


Part: TypeAlias = str | Figure | Listing | Names
