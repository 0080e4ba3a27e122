"""The check of a block, part by part: one module for each thing that Appendix H of the guide looks at."""

from photogram.checks import html  # noqa: F401  (the way to show a check)
from photogram.checks.findings import Check, Finding, Section

__all__ = ["Check", "Finding", "Section"]
