"""Reports of adjusted networks for the browser; what makes them is loaded when one is asked for."""

from __future__ import annotations

from photogram.results.components import VarianceComponents
from photogram.results.result import Result
from photogram.results.snooped import Snooped
from photogram.show.page import Page
from photogram.show.ways import page_of

__all__ = ["block", "components", "snooped"]


@page_of.register(Result)
def block(result: Result) -> Page:
    """Return the page of an adjusted block."""
    from photogram.results.page.block import block_page

    return block_page(result)


@page_of.register(Snooped)
def snooped(found: Snooped) -> Page:
    """Return the page of a network without what snooping took out."""
    from photogram.results.page.removed import snooped_page

    return snooped_page(found)


@page_of.register(VarianceComponents)
def components(found: VarianceComponents) -> Page:
    """Return the page of the adjustment with the given weights, and what is wrong about these."""
    from photogram.results.page.weights import weighed_page

    return weighed_page(found, page_of(found.first))
