"""Document and verdict of cameras over years (JSON members: docs/certificates.md)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.history.document import history_document, history_findings
from photogram.show.page import Document, Fact
from photogram.show.quantity import Axis, Quantity, Table
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.film.years import CameraComparison

ANGLE = (Axis.turned("", "deg"),)


def calibrations(comparison: CameraComparison) -> Table:
    """Return the calibrations with dates, cameras, models and largest angles."""
    found = comparison.calibrations
    angles = np.array([np.nan if each.angle is None else each.angle for each in found])
    columns = [
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        Quantity([each.camera.title for each in found], kind="name", member="camera", head="Camera"),
        Quantity([each.camera.model for each in found], kind="name", member="model", head="Model"),
        Quantity(angles, ANGLE, "value", member="angle_rad", head="Up to", decimals=1),
        Quantity([each.source for each in found], kind="name", member="source", head="From"),
    ]
    return Table("calibrations", "Calibrations", columns)


def comparison_findings(comparison: CameraComparison) -> Findings:
    """Return the tests for changes of the camera."""
    histories = comparison.histories
    # Values with a detected change are not tested again.
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
    return history_findings(
        histories,
        observations=[Tested("values beside those of the others", values, lambda at: places[at[0]], "w")],
        degrees_of_freedom=sum(own.constancy.degrees_of_freedom for own in histories.values()),
        untested=Phrase("untested.constancy"),
        remarks=comparison.remarks,
        if_withheld=[Phrase("advice.certificate-of-time")],
    )


def comparison_document(comparison: CameraComparison) -> Document:
    """Return the document of a comparison."""
    return history_document(
        "Calibrations of cameras over years",
        calibrations(comparison),
        comparison.histories,
        comparison.verdict,
        "cameras",
        {name: {"angle_rad": angle} for name, angle in comparison.angles.items()},
        about=FIGURES,
        highlights=[
            Fact.of(f"{name[:1].upper()}{name[1:]} compared up to", math.degrees(angle), "°", decimals=1)
            for name, angle in comparison.angles.items()
        ],
        members={"remarks": [*map(str, comparison.remarks)]},
    )


FIGURES = (
    "Images of directions are compared within the angle that all calibrations have in common: a shift, the"
    " principal distance that suits the whole field, radial shapes of third, fifth and seventh degree,"
    " decentring, affinity and shear, as they move an image at the edge."
)
