"""What cameras over years show: tables, verdict, document (docs/certificates.md lists it), text and page."""

from __future__ import annotations

import math

import numpy as np

from photogram import _photocore
from photogram.film.years.comparison import CameraComparison
from photogram.io import json
from photogram.show.history import history_document, history_page, history_text
from photogram.show.lines import field
from photogram.show.methods import document_of, findings_of, page_of, report_of
from photogram.show.page import Document, Fact
from photogram.show.quantity import Axis, Quantity, records
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.history import changed_of, unchanged_of

ANGLE = (Axis.turned("", "deg"),)


def calibrations(comparison: CameraComparison) -> list[Quantity]:
    """Return the calibrations: days, cameras, models, up to which angle."""
    found = comparison.calibrations
    angles = np.array([np.nan if each.angle is None else each.angle for each in found])
    return [
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        Quantity([each.camera.title for each in found], kind="name", member="camera", head="Camera"),
        Quantity([each.camera.model for each in found], kind="name", member="model", head="Model"),
        Quantity(angles, ANGLE, "value", member="angle_rad", head="Up to", decimals=1),
        Quantity([each.source for each in found], kind="name", member="source", head="From"),
    ]


@findings_of.register(CameraComparison)
def comparison_findings(comparison: CameraComparison) -> Findings:
    """Return the tests of what should not have changed."""
    histories = comparison.histories
    # What changes explain is not tested once more.
    quiet = [
        (whose, history, own)
        for whose, history in histories.items()
        for own in history.series
        if not own.changes
    ]
    places = [
        f"{own.name} of {whose} on {occasion}"
        for whose, history, own in quiet
        for occasion in history.occasions
    ]
    values = np.concatenate([own.off / own.off_sd for *_, own in quiet] or [np.zeros(0)])
    return Findings(
        status="converged",
        observations=[Tested("values beside those of the others", values, lambda at: places[at[0]], "w")],
        degrees_of_freedom=sum(own.constancy.degrees_of_freedom for own in histories.values()),
        untested="each camera has a test of constancy of its own",
        changed=changed_of(histories),
        systematic=[own.systematic(whose) for whose, own in histories.items()],
        remarks=[*unchanged_of(histories), *comparison.remarks],
        if_withheld=[
            "Take each photo with the certificate of its time: what lies between must be found out."
        ],
    )


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
    columns = [
        *field(days, 12, head="day"),
        *field(names, max(12, *map(len, names.values)) + 2, head="camera"),
        *field(models, 16, head="model"),
        *field(angles, 10, ".1f", "up to deg"),
        *field(sources, 0, head="from", gap="  "),
    ]
    within = {
        f"{name}, up to {math.degrees(comparison.angles[name]):.1f} degrees": own
        for name, own in comparison.histories.items()
    }
    return "\n".join(history_text(columns, within)) + "\n"


@page_of.register(CameraComparison)
def comparison_page(comparison: CameraComparison) -> Document:
    """Return the report of a comparison for the browser."""
    return history_page(
        "Calibrations of cameras over years",
        calibrations(comparison),
        comparison.histories,
        comparison.verdict,
        [
            Fact(f"{name[:1].upper()}{name[1:]} compared up to", f"{math.degrees(angle):.1f}", "°")
            for name, angle in comparison.angles.items()
        ],
        intro=_FIGURES,
    )


_FIGURES = (
    "Images of directions are compared within the angle that all calibrations have in common: a shift, the"
    " principal distance that suits the whole field, radial shapes of third, fifth and seventh degree,"
    " decentring, affinity and shear, as they move an image at the edge."
)
