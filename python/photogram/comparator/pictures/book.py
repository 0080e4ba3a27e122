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
from photogram.show.style import styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.comparator.calibration import Calibration


def figures(calibration: Calibration) -> Iterator[tuple[str, Figure]]:
    """Make the pictures one after the other, with short names.

    Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    made = _figures(calibration)
    while True:
        # Who takes the figures has a style of their own in between.
        with styled():
            found = next(made, None)
            if found is None:
                return
            # Panels of equal scales are laid out well only when their limits are known.
            found[1].draw_without_rendering()
        yield found


def _figures(calibration: Calibration) -> Iterator[tuple[str, Figure]]:
    yield "variance", variance_bars(calibration)
    yield "comparator-residuals", comparator_vectors(calibration)
    yield "grid-residuals", grid_vectors(calibration)
    for plate in calibration.plates:
        yield f"average-residuals-{plate}", average_vectors(calibration, plate)
        if calibration.joint and calibration.joint.plates[plate].sigma_um > 0:
            yield f"grid-corrections-{plate}", joint_grid(calibration, plate)
    yield from _corrections(calibration)
    yield "pointing-ellipses", pointing_ellipses(calibration)
    for operator, figure in operator_ellipses(calibration):
        yield f"pointing-ellipses-operator-{operator}", figure
    yield "pointing-ellipses-total", total_ellipses(calibration)
    yield "pooled-ellipses", pooled_ellipses(calibration)
    yield "residual-histogram", residual_histogram(calibration)


def _corrections(calibration: Calibration) -> Iterator[tuple[str, Figure]]:
    """Draw the combined polynomials and, where they are wanted, those of every case."""
    if calibration.nonlinear:
        polynomial = calibration.nonlinear.polynomial
        yield "correction", correction_surface(calibration, polynomial)
        yield "distorted-grid", distorted_grid(calibration, polynomial)
    for case in calibration.cases if calibration.session.plot_each_case else ():
        if case.polynomial:
            polynomial, whose = case.polynomial.polynomial, f", case {case.number} alone"
            yield f"correction-case-{case.number}", correction_surface(calibration, polynomial, whose)
            yield f"distorted-grid-case-{case.number}", distorted_grid(calibration, polynomial, whose)


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
        for _, figure in figures(calibration):
            pdf.savefig(figure)
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
    figure = new_figure(11.7, 8.3)
    figure.text(0.04, 0.96, "\n".join(lines), family="monospace", fontsize=6.5, va="top")
    return figure
