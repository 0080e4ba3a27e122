"""Mistakes in the data of a network: one module for each thing that is looked at."""

from photogram.diagnosis.findings import Diagnosis, Finding, Section

__all__ = ["Diagnosis", "Finding", "Section"]

WAYS = {"page_of": ("page",)}
"""The files that show a result, by the names of the ways: see `photogram.show.ways`."""
