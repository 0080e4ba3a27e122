"""All pictures of a calibration, by name or as one PDF."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

from photogram import _photocore
from photogram.comparator.listing.parameters import summary_page, tests_page
from photogram.comparator.pictures.correction import correction_surface, distorted_grid
from photogram.comparator.pictures.ellipses import (
    operator_ellipses,
    pointing_ellipses,
    pooled_ellipses,
    total_ellipses,
)
from photogram.comparator.pictures.statistics import residual_histogram, variance_bars
from photogram.comparator.pictures.vectors import (
    average_vectors,
    comparator_vectors,
    grid_vectors,
    joint_grid,
)
from photogram.show.pictures import new_figure
from photogram.show.sketch.declared import Sketch
from photogram.show.sketch.on_axes import figure
from photogram.show.style import styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.comparator.calibration import Calibration


def sketches(calibration: Calibration) -> dict[str, Sketch]:
    """Return the pictures with short names."""
    made = {
        "variance": variance_bars(calibration),
        "comparator-residuals": comparator_vectors(calibration),
        "grid-residuals": grid_vectors(calibration),
    }
    for plate in calibration.plates:
        made[f"average-residuals-{plate}"] = average_vectors(calibration, plate)
        if calibration.joint and calibration.joint.plates[plate].sigma_um > 0:
            made[f"grid-corrections-{plate}"] = joint_grid(calibration, plate)
    made |= _corrections(calibration)
    made["pointing-ellipses"] = pointing_ellipses(calibration)
    for operator, sketch in operator_ellipses(calibration):
        made[f"pointing-ellipses-operator-{operator}"] = sketch
    made["pointing-ellipses-total"] = total_ellipses(calibration)
    made["pooled-ellipses"] = pooled_ellipses(calibration)
    made["residual-histogram"] = residual_histogram(calibration)
    return made


def figures(calibration: Calibration) -> Iterator[tuple[str, Figure]]:
    """Make the pictures one after the other, with short names, as figures that belong to no window.

    Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    for name, sketch in sketches(calibration).items():
        yield name, figure(sketch)


def _corrections(calibration: Calibration) -> dict[str, Sketch]:
    """Return the combined polynomials and, where they are wanted, those of every case."""
    made = {}
    if calibration.nonlinear:
        polynomial = calibration.nonlinear.polynomial
        made["correction"] = correction_surface(calibration, polynomial)
        made["distorted-grid"] = distorted_grid(calibration, polynomial)
    for case in calibration.cases if calibration.session.plot_each_case else ():
        if case.polynomial:
            polynomial, whose = case.polynomial.polynomial, f", case {case.number} alone"
            made[f"correction-case-{case.number}"] = correction_surface(calibration, polynomial, whose)
            made[f"distorted-grid-case-{case.number}"] = distorted_grid(calibration, polynomial, whose)
    return made


def _title(calibration: Calibration) -> str:
    session = calibration.session
    date = f", {session.date}" if session.date else ""
    return f"Calibration of comparator {session.comparator}, {len(calibration.cases)} cases{date}"


def _made(run_date: str) -> str:
    """Who made the report and, where it is said, when."""
    return f"photogram {_photocore.__version__}" + (f", run on {run_date}" if run_date else "")


def pdf_report(calibration: Calibration, run_date: str = "") -> bytes:
    """Return the summary and all pictures as a PDF.

    Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    # Without a date equal calibrations give equal files.
    with PdfPages(buffer, metadata={"Title": _title(calibration), "CreationDate": None}) as pdf:
        pdf.savefig(_text_page(calibration, run_date))
        for _, drawn in figures(calibration):
            with styled():
                pdf.savefig(drawn)
    return buffer.getvalue()


def _text_page(calibration: Calibration, run_date: str) -> Figure:
    lines = [
        _title(calibration),
        _made(run_date),
        "",
        *summary_page(calibration)[2:],
        "",
        *tests_page(calibration)[2:],
    ]
    page = new_figure(11.7, 8.3)
    page.text(0.04, 0.96, "\n".join(lines), family="monospace", fontsize=6.5, va="top")
    return page
