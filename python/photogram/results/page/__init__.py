"""The report of an adjusted network for the browser, part by part."""

from photogram.results.page import block, removed, weights  # noqa: F401  (the ways to show a result)
