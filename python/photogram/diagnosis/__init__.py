"""Mistakes in the data of a network: one module for each thing that is looked at."""

from photogram.diagnosis.findings import Diagnosis, Finding, Section

__all__ = ["Diagnosis", "Finding", "Section"]
