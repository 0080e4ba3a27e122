"""The page of cameras over years."""

from __future__ import annotations

import math

from photogram.film.years.comparison import CameraComparison
from photogram.film.years.tables import calibrations
from photogram.show.cells import page_table
from photogram.show.history import charts_section, series_table, values_table
from photogram.show.judgement import judged, tests_section
from photogram.show.methods import page_of
from photogram.show.page import Fact, Page, Section

__all__ = ["comparison_page"]

_FIGURES = (
    "Images of directions are compared within the angle that all calibrations have in common: a shift, the"
    " principal distance that suits the whole field, radial shapes of third, fifth and seventh degree,"
    " decentring, affinity and shear, as they move an image at the edge."
)


@page_of.register(CameraComparison)
def comparison_page(comparison: CameraComparison) -> Page:
    """Return the report of a comparison for the browser."""
    found, named = comparison.calibrations, comparison.histories.items()
    sections = [
        charts_section(comparison.histories),
        Section("changes", "What changed", [series_table(own, name) for name, own in named], _FIGURES),
        Section("calibrations", "Calibrations", [page_table("Calibrations", calibrations(comparison))]),
        Section("values", "All values", [values_table(own, name) for name, own in named]),
        tests_section(comparison.verdict),
    ]
    return Page(
        what="Calibrations of cameras over years",
        title=f"{len(found)} calibrations, {found[0].day} to {found[-1].day}",
        judgements=[judged(comparison.verdict)],
        advice=comparison.verdict.next,
        highlights=[
            Fact(f"{name[:1].upper()}{name[1:]} compared up to", f"{math.degrees(angle):.1f}", "°")
            for name, angle in comparison.angles.items()
        ],
        sections=sections,
    )
