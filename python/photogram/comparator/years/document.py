"""The JSON document and the text of a comparison; docs/comparator.md lists the members."""

from __future__ import annotations

from photogram import _photocore
from photogram.comparator.years.comparison import Comparison
from photogram.comparator.years.tables import calibrations, operators
from photogram.io import json
from photogram.show.history import history_document, series_lines
from photogram.show.lines import field, table_lines
from photogram.show.methods import document_of, report_of
from photogram.show.quantity import Quantity, records

__all__ = ["comparison_document", "comparison_text"]


@document_of.register(Comparison)
def comparison_document(comparison: Comparison) -> bytes:
    """Return everything as JSON."""
    together = comparison.together
    corrections = [Quantity([each.document() for each in comparison.corrections()], member="correction")]
    document = {
        "program": f"photogram {_photocore.__version__}",
        "verdict": comparison.verdict.document(),
        "calibrations": records([*calibrations(comparison), *corrections]),
        "covariance": together.covariance,
        "comparators": {
            name: {
                "centre_um": comparison.ranges[name].centre_um,
                "half_range_um": comparison.ranges[name].half_range_um,
                **history_document(own),
            }
            for name, own in comparison.histories.items()
        },
        "sigma0": together.test.factor,
        "degrees_of_freedom": together.test.degrees_of_freedom,
        "grids": [
            {
                "plate": plate,
                "points": grid.points,
                "given_um": together.grids[plate].xy_um,
                "corrections_um": together.corrections_um[plate],
                "covariance_um2": together.covariance_um2[plate],
                "sigma_um": grid.sigma_um,
                "adopted": grid.adopted,
                "usable": comparison.usable_grids,
            }
            for plate, grid in comparison.grids.items()
        ],
        "operators": records(operators(comparison)),
    }
    return json.to_json(document)


@report_of.register(Comparison)
def comparison_text(comparison: Comparison) -> str:
    """Return what a reader wants first, as text."""
    names, days, of, _, cases, _, random, _, pointing, *_ = calibrations(comparison)
    lines = table_lines(
        [
            *field(names, max(18, *map(len, names.values)) + 2, head="calibration"),
            *field(days, 12, head="day"),
            *field(of, 16, head="of"),
            *field(cases, 6, ".0f", "cases"),
            *field(random, 9, ".3f", "random"),
            *field(pointing, 12, ".3f", "pointing {name}"),
        ]
    )
    for name, own in comparison.histories.items():
        lines += ["", name, *series_lines(own)]
    lines.append("")
    for plate, grid in comparison.grids.items():
        given = comparison.together.grids[plate].sigma_um or 0.0
        lines.append(f"grid {plate}: {given:.3f} um before, {grid.sigma_um:.3f} um after ({grid.adopted})")
    return "\n".join(lines) + "\n"
