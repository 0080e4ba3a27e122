"""Variance components on the command line, and what the variance of unit weight is based on."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.console import ON_TOP
from photogram.cli.job import Job

if TYPE_CHECKING:
    from photogram.adjustment.cleaning import Cleaned
    from photogram.results.components import VarianceComponents
    from photogram.show.page import Page
    from photogram.show.sections import Section

__all__ = [
    "COMPONENTS",
    "Components",
    "UnitVarianceName",
    "cleaned",
    "estimated",
    "with_components",
    "with_components_page",
    "with_weights",
]

COMPONENTS = "components.txt"
"""What goes to the output directory where variance components are asked for."""


class UnitVarianceName(StrEnum):
    """What the variance of unit weight is based on."""

    CONSTRAINED = "constrained"
    UNITY = "unity"
    REDUNDANCY = "redundancy"


class Basis(StrEnum):
    """What groups of observations are made by."""

    KIND = "kind"
    CAMERA = "camera"
    STRIP = "strip"
    PHOTO = "photo"
    POINT_CLASS = "point-class"
    COMPONENT = "component"
    RAYS = "rays"


Components = Annotated[
    list[Basis] | None,
    typer.Option(
        "--components",
        help="Estimate variance components of groups of observations: by which factors their standard"
        " deviations are wrong. Given more than once: of all combinations. The results stay those of the"
        " given weights; with --snoop those of the weights that what is left bears out.",
        show_default=False,
    ),
]


def estimated(
    job: Job, network: object, bases: list[Basis] | None, threads: int | None
) -> VarianceComponents | None:
    """Estimate the components that are asked for, if any."""
    if not bases:
        return None
    from photogram.adjustment.components import variance_components

    groups = [basis.value.replace("-", " ") for basis in bases]
    with job.status("variance components") as status:

        def tell(number: int, _: object) -> None:
            if status is not None:
                status.update(f"variance components, adjustment {number + 1}")

        return variance_components(network, groups, threads=threads, progress=tell)


def with_components_page(page: Page, found: VarianceComponents | None, made: Cleaned | None) -> Page:
    """Return the report for the browser with what components say, if any were estimated."""
    from photogram.results.page.weights import reweighed_page, weighed_page

    if made is not None:
        return reweighed_page(made.changes, made.components, page)
    return page if found is None else weighed_page(found, page)


def cleaned(network: object, bases: list[Basis], threads: int | None, options: Mapping[str, Any]) -> Cleaned:
    """Take gross errors out and estimate weights in turn, with options of snooping."""
    from photogram.adjustment.cleaning import clean

    return clean(network, [basis.value.replace("-", " ") for basis in bases], threads=threads, **options)


def with_weights(sections: list[Section], made: Cleaned | None) -> list[Section]:
    """Return the sections of snooping, with what became of the weights below its verdict."""
    if made is None:
        return sections
    return [*sections[:ON_TOP], ("Weights", made.report().splitlines()), *sections[ON_TOP:]]


def with_components(sections: list[Section], found: VarianceComponents | None) -> list[Section]:
    """Return a summary, on top of which the verdict stands, with what components say in its place."""
    if found is None:
        return sections
    from photogram.results.components import component_sections

    return [*component_sections(found), *sections[ON_TOP:]]
