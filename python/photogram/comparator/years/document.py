"""The JSON document and the text of a comparison; docs/comparator.md lists the members."""

from __future__ import annotations

from photogram import _photocore
from photogram.comparator.years.comparison import Comparison
from photogram.io import json
from photogram.show.history import history_document
from photogram.show.page import decimals_of, fixed
from photogram.show.ways import document_of, report_of

__all__ = ["comparison_document", "comparison_text"]


@document_of.register(Comparison)
def comparison_document(comparison: Comparison) -> bytes:
    """Return everything as JSON."""
    together = comparison.together
    corrections = comparison.corrections()
    document = {
        "program": f"photogram {_photocore.__version__}",
        "verdict": comparison.verdict.document(),
        "calibrations": [
            {
                "name": record.name,
                "day": record.day.isoformat(),
                "random_um": record.random_um,
                "degrees_of_freedom": record.freedom,
                "pointing_um": record.pointing_um,
                "pointing_covariance_um2": record.pointing_covariance_um2,
                "pointing_degrees_of_freedom": record.pointing_freedom,
                "correction": corrections[k].document(),
            }
            for k, record in enumerate(comparison.calibrations)
        ],
        "covariance": together.covariance.tolist(),
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
                "covariance_um2": together.covariance_um2[plate].tolist(),
                "sigma_um": grid.sigma_um,
                "adopted": grid.adopted,
                "usable": comparison.usable_grids,
            }
            for plate, grid in comparison.grids.items()
        ],
        "operators": [
            {"operator": operator, "pointing_um": [x, y], "degrees_of_freedom": freedom}
            for operator, (x, y, freedom) in comparison.operators.items()
        ],
    }
    return json.to_json(document)


@report_of.register(Comparison)
def comparison_text(comparison: Comparison) -> str:
    """Return what a reader wants first, as text."""
    lines = [f"{'calibration':<20}{'day':<12}{'of':<16}{'cases':>6}{'random':>9}{'pointing':>17}"]
    for record in comparison.calibrations:
        x, y = record.pointing_um
        lines.append(
            f"{record.name[:19]:<20}{record.day.isoformat():<12}{record.comparator[:15]:<16}"
            f"{len(record.cases):6d}{record.random_um:9.3f}{x:9.3f}{y:8.3f}"
        )
    for name, own in comparison.histories.items():
        lines += ["", f"{name:<30}{'mean':>12}{'sd':>9}{'drift a year':>14}{'sd':>9}{'step t':>8}  found"]
        for each in own.series:
            decimals = decimals_of(each.sd)
            steps = max((t for t in each.steps.tolist() if t == t), key=abs, default=0.0)
            found = ", ".join(change.kind for change in each.changes) or "-"
            lines.append(
                f"  {each.name + ', ' + each.unit:<32}{fixed(each.mean, decimals):>8}"
                f"{fixed(each.mean_sd, decimals):>9}{fixed(each.drift, decimals):>14}"
                f"{fixed(each.drift_sd, decimals):>9}{steps:8.2f}  {found}"
            )
    lines.append("")
    for plate, grid in comparison.grids.items():
        given = comparison.together.grids[plate].sigma_um or 0.0
        lines.append(f"grid {plate}: {given:.3f} um before, {grid.sigma_um:.3f} um after ({grid.adopted})")
    return "\n".join(lines) + "\n"
