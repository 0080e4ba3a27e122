"""The check of a block, part by part: one module for each thing that Appendix H of the guide looks at."""

from photogram.checks.findings import Check, Finding, Section

__all__ = ["Check", "Finding", "Section"]
