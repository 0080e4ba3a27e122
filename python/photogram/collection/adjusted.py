"""The adjusted collection and the ways to show it."""

from __future__ import annotations

from photogram.collection.document import to_json
from photogram.collection.report import report
from photogram.collection.solution import CollectionSolution

__all__ = ["AdjustedCollection"]


class AdjustedCollection(CollectionSolution):
    """An adjusted collection; the arrays are those of :class:`CollectionSolution`."""

    def report(self) -> str:
        """Return the report as text."""
        return report(self)

    def to_json(self) -> bytes:
        """Return the whole result as a JSON document (UTF-8); `docs/collection.md` lists its members."""
        return to_json(self)
