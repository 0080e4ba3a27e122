"""An accuracy statement: what a surveyor hands to a client about an adjusted block and its check points."""

WAYS = {"document_of": ("document",), "page_of": ("page",)}
"""The files that show a statement, by the names of the ways: see `photogram.show.methods`."""
