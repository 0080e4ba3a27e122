"""The page of a comparison of calibrations."""

from __future__ import annotations

from photogram.comparator.years.comparison import Comparison
from photogram.comparator.years.tables import calibrations, operators, points
from photogram.show.cells import page_table
from photogram.show.history import charts_section, series_table, values_table
from photogram.show.judgement import judged, tests_section
from photogram.show.methods import page_of
from photogram.show.page import Fact, Page, Part, Section, significant

__all__ = ["comparison_page"]

UM = "µm"


@page_of.register(Comparison)
def comparison_page(comparison: Comparison) -> Page:
    """Return the report of a comparison for the browser."""
    histories = comparison.histories
    first, last = comparison.calibrations[0].day, comparison.calibrations[-1].day
    sections = [
        charts_section(histories),
        Section("changes", "What changed", [series_table(own, name) for name, own in histories.items()]),
        Section("calibrations", "Calibrations", [page_table("Calibrations", calibrations(comparison))]),
        Section("grids", "Grids", _grids(comparison), _GRIDS),
        Section("pointing", "Pointing of the operators, all calibrations", _operators(comparison)),
        Section("values", "All values", [values_table(own, name) for name, own in histories.items()]),
        tests_section(comparison.verdict),
    ]
    return Page(
        what="Calibrations of comparators over years",
        title=f"{len(comparison.calibrations)} calibrations, {first} to {last}",
        judgements=[judged(comparison.verdict)],
        advice=comparison.verdict.next,
        highlights=[
            Fact(
                f"Grid {plate}, a coordinate",
                significant(grid.sigma_um or 0.0, 3),
                UM,
                f"given {significant(comparison.together.grids[plate].sigma_um or 0.0, 3)} {UM}",
            )
            for plate, grid in comparison.grids.items()
        ],
        sections=sections,
    )


_GRIDS = (
    "Given coordinates and all readings of all calibrations in one adjustment, each calibration with a"
    " comparator of its own. Absolute scale and odd shapes that look alike in grid and comparator come from"
    " the given coordinates."
)


def _grids(comparison: Comparison) -> list[Part]:
    return [
        page_table(f"Grid {plate}, {grid.adopted}", points(comparison, plate))
        for plate, grid in comparison.grids.items()
    ]


def _operators(comparison: Comparison) -> list[Part]:
    return [page_table("Operators", operators(comparison))] if comparison.operators else []
