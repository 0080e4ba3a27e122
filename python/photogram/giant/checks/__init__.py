"""The check of a project, part by part: one module for each thing that Appendix H of the guide looks at."""

from photogram.giant.checks.check import check
from photogram.giant.checks.findings import Check, Finding, Section

__all__ = ["Check", "Finding", "Section", "check"]
