"""What an adjustment gives, as arrays, tables, text and JSON."""

from photogram.results import document, findings, html, judged, report, tables  # noqa: F401  (the ways to show a result)
