"""Mistakes in the data of a network: one module for each thing that is looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.diagnosis.findings import Diagnosis, Finding, Section

__all__ = ["Diagnosis", "Finding", "Section"]

WAYS = {"page_of": ("page",)}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__ = on_demand(__name__, dict.fromkeys(__all__, "findings"))
