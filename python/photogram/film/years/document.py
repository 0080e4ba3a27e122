"""The JSON document and the text of cameras over years; docs/certificates.md lists the members."""

from __future__ import annotations

import math

from photogram import _photocore
from photogram.film.years.comparison import CameraComparison
from photogram.film.years.tables import calibrations
from photogram.io import json
from photogram.show.history import history_document, series_lines
from photogram.show.lines import field, table_lines
from photogram.show.methods import document_of, report_of
from photogram.show.quantity import records

__all__ = ["comparison_document", "comparison_text"]


@document_of.register(CameraComparison)
def comparison_document(comparison: CameraComparison) -> bytes:
    """Return everything as JSON."""
    document = {
        "program": f"photogram {_photocore.__version__}",
        "verdict": comparison.verdict.document(),
        "calibrations": records(calibrations(comparison)),
        "cameras": {
            name: {"angle_rad": comparison.angles[name], **history_document(own)}
            for name, own in comparison.histories.items()
        },
        "remarks": list(comparison.remarks),
    }
    return json.to_json(document)


@report_of.register(CameraComparison)
def comparison_text(comparison: CameraComparison) -> str:
    """Return what a reader wants first, as text."""
    days, names, models, angles, sources = calibrations(comparison)
    lines = table_lines(
        [
            *field(days, 12, head="day"),
            *field(names, max(12, *map(len, names.values)) + 2, head="camera"),
            *field(models, 16, head="model"),
            *field(angles, 10, ".1f", "up to deg"),
            *field(sources, 0, head="from", gap="  "),
        ]
    )
    for name, own in comparison.histories.items():
        lines += [
            "",
            f"{name}, up to {math.degrees(comparison.angles[name]):.1f} degrees",
            *series_lines(own),
        ]
    return "\n".join(lines) + "\n"
