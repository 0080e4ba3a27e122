"""All pictures of a calibration, in one HTML page or one PDF."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

from photogram import _photocore
from photogram.comparator.listing.joint import tests_page
from photogram.comparator.listing.summary import summary_page
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
from photogram.show.pictures import drawn, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.comparator.calibration import Calibration

__all__ = ["figures", "html_report", "pdf_report"]

STYLE = """
body { font-family: system-ui, sans-serif; color: #1b2733; }
body { max-width: 1150px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.1em; margin-top: 2em; }
figure { margin: 1.5em 0; } img { max-width: 100%; height: auto; }
pre { background: #f4f6f8; padding: 1em; overflow-x: auto; font-size: 0.78em; line-height: 1.35; }
"""


def figures(calibration: Calibration) -> Iterator[tuple[str, Figure]]:
    """Make the pictures one after the other, with short names.

    Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    for name, figure in _figures(calibration):
        # Panels of equal scales are laid out well only when their limits are known.
        figure.draw_without_rendering()
        yield name, figure


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


def _problems(calibration: Calibration) -> list[str]:
    return [line for message in calibration.messages for line in str(message).splitlines()] or ["none"]


def _made(run_date: str) -> str:
    """Who made the report and, where it is said, when."""
    return f"photogram {_photocore.__version__}" + (f", run on {run_date}" if run_date else "")


def html_report(calibration: Calibration, run_date: str = "") -> bytes:
    """Return one page with the summary, the tests, the problems and all pictures inside (UTF-8).

    Needs matplotlib (`pip install 'photogram[plots]'`).
    """
    parts = []
    for name, figure in figures(calibration):
        data = base64.b64encode(drawn(figure)).decode()
        parts.append(f'<figure id="{name}"><img alt="{name}" src="data:image/png;base64,{data}"></figure>')
    title = html.escape(_title(calibration))
    pages = [
        ("Problems", "\n".join(_problems(calibration))),
        ("Summary", "\n".join(summary_page(calibration)[2:])),
        ("Tests", "\n".join(tests_page(calibration)[2:])),
    ]
    texts = "".join(f"<h2>{head}</h2><pre>{html.escape(text)}</pre>" for head, text in pages)
    document = (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{STYLE}</style></head><body><h1>{title}</h1><p>{html.escape(_made(run_date))}</p>"
        f"{texts}<h2>Pictures</h2>{''.join(parts)}</body></html>\n"
    )
    return document.encode()


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
