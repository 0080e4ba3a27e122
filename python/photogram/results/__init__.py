"""What an adjustment gives, as arrays, tables, text and JSON."""

from photogram.results import (  # noqa: F401  (the ways to show a result)
    document,
    findings,
    judged,
    pictured,
    report,
    saved_block,
    tables,
)
