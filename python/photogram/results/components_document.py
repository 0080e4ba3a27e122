"""The document of variance components."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from photogram.lazy_dataclasses import replace
from photogram.results.components_table import components_table, statement
from photogram.show.judgement import judged
from photogram.show.page import Document, Drawing, Part, Remarks, Section

if TYPE_CHECKING:
    from photogram import VarianceComponents

_INTRO = (
    "By which factors the standard deviations of groups of observations are wrong, as their residuals say."
    " The adjustment has the weights that were given."
)


def components_document(found: VarianceComponents) -> Document:
    """Return the document of variance components."""
    verdict = found.verdict
    judgement, sections = judged(verdict), [components_section(found)]
    return Document("Variance components", "", [judgement], verdict.next, [], sections)


def weighed_document(found: VarianceComponents, network: Document) -> Document:
    """Return the document of the network with the given weights, judged by the components."""
    own = components_document(found)
    sections = [*own.sections, *network.sections]
    return replace(network, judgements=own.judgements, advice=own.advice, sections=sections)


def components_section(found: VarianceComponents, title: str = "Variance components") -> Section:
    """Return the section: which standard deviations are wrong, factors with their intervals."""
    return Section("components", title, components_parts(found), _INTRO)


def components_parts(found: VarianceComponents) -> list[Part]:
    """Return the statement, the plot and the table of components, and messages."""
    caption = "Factors of the standard deviations with their intervals (95 percent); 1 is what was given."
    parts: list[Part] = [
        Remarks(sentences(statement(found))),
        Drawing("picture-components", "Variance components", caption, found.plot),
        components_table(found),
    ]
    if found.estimate.messages:
        parts.append(Remarks([*map(str, found.estimate.messages)]))
    return parts


def sentences(said: Sequence[str]) -> list[str]:
    """Return sentences with a capital letter and a full stop."""
    return [f"{each[:1].upper()}{each[1:]}." for each in said]
