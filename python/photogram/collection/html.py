"""The report of an adjusted collection for the browser; what makes it is loaded when one is asked for."""

from __future__ import annotations

from photogram.collection.adjusted import AdjustedCollection
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["page"]


@page_of.register(AdjustedCollection)
def page(result: AdjustedCollection) -> Page:
    """Return the page of an adjusted collection."""
    from photogram.collection.page import collection_page

    return collection_page(result)
