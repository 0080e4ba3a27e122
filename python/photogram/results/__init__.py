"""What an adjustment gives, as arrays, tables, text and JSON."""

import lazy_loader

WAYS = {
    "columns_of": ("tables",),
    "document_of": ("document",),
    "files_of": ("block_files",),
    "findings_of": ("findings",),
    "page_of": {
        "Result": ("page.block",),
        "Snooped": ("page.cleaning",),
        "VarianceComponents": ("page.cleaning",),
    },
    "pictured": ("picture_data",),
    "report_of": ("report",),
    "statement_of": ("statement.statement",),
    "terms_of": ("tables",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
