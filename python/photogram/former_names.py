"""Modules under the names that they had before they lay in folders.

`import photogram.geometry` gives the module `photogram.network.geometry` itself, not a copy: classes, caches
and pickles are the same under both names. New code, and what checks types without running it, takes the name
of today.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

__all__ = ["TODAY", "found_under_former_names", "today"]

TODAY = {
    "adjusted": "results.result",
    "angles": "show.angles",
    "arrays": "arguments.arrays",
    "absolute_orientation.oriented": "absolute_orientation.orientation",
    "block": "network.block",
    "collection.bal": "collection.formats",
    "collection.solution": "collection.adjusted",
    "document": "results.document",
    "ends": "adjustment.ends",
    "files": "io.files",
    "geometry": "network.geometry",
    "neighbours": "network.neighbours",
    "numbers": "io.numbers",
    "outliers": "statistics.outliers",
    "pictures": "show.pictures",
    "places": "io.places",
    "prediction": "adjustment.prediction",
    "records": "io.records",
    "refracted": "network.refracted",
    "refraction": "network.refraction",
    "reliability": "statistics.reliability",
    "report": "results.report",
    "resection": "adjustment.resection",
    "result": "results.result",
    "results.adjusted": "results.result",
    "robust": "adjustment.robust",
    "rows": "io.rows",
    "sections": "show.sections",
    "simulation": "network.simulation",
    "structuring": "network.structuring",
    "tables": "results.tables",
    "writing": "io.writing",
}
"""Former name -> name of today, both inside the package; what lay in a folder that moved moved with it."""

PACKAGE = "photogram"


def today(name: str) -> str | None:
    """Return the name of today of a module; None where it has no other than it had."""
    top, _, inside = name.partition(".")
    parts = inside.split(".")
    if top != PACKAGE:
        return None
    for length in range(len(parts), 0, -1):
        home = TODAY.get(".".join(parts[:length]))
        if home is not None:
            return ".".join([PACKAGE, home, *parts[length:]])
    return None


class _FormerNames:
    """Finder and loader of the import system: a former name loads the module of today and stands for it."""

    @staticmethod
    def find_spec(
        name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if today(name) is None:
            return None
        from importlib.machinery import ModuleSpec

        return ModuleSpec(name, _FormerNames())  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to the import system; the module is exchanged as soon as it is executed."""

    def exec_module(self, module: ModuleType) -> None:
        home = today(module.__name__)
        assert home is not None
        sys.modules[module.__name__] = import_module(home)


def found_under_former_names() -> None:
    """Let the import system ask here first: a folder of today would load its files once more."""
    sys.meta_path.insert(0, _FormerNames)
