"""What an adjustment gives, as arrays, tables, text and JSON."""

WAYS = {
    "axes_of": ("components_picture",),
    "columns_of": ("tables",),
    "document_of": ("document",),
    "files_of": ("saved_block",),
    "findings_of": ("findings", "judged"),
    "page_of": {
        "Result": ("page.block",),
        "Snooped": ("page.removed",),
        "VarianceComponents": ("page.weights",),
    },
    "pictured": ("pictured",),
    "report_of": ("report",),
    "statement_of": ("statement.made",),
    "terms_of": ("tables",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.ways`."""
