"""Tables of declarations: CSV files beside modules."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path


def declared(module: str, name: str) -> Iterator[list[str]]:
    """Yield the rows of a table beside a module (its `__file__`), without the header."""
    text = Path(module).with_name(name).read_text(encoding="utf-8")
    rows = csv.reader(text.splitlines())
    next(rows)
    yield from rows
