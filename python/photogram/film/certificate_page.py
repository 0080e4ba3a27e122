"""The page of a certificate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.film.certificate import Certificate
from photogram.film.certificate_document import limit_of
from photogram.film.certificate_tables import (
    cameras,
    compared,
    curve,
    distortion,
    facts,
    marks,
    observed,
    parameters,
    terms,
)
from photogram.show.cells import page_table
from photogram.show.judgement import judged, tests_section
from photogram.show.methods import page_of
from photogram.show.page import Drawing, Facts, Page, Part, Section
from photogram.show.pictures import new_figure
from photogram.show.style import FAINT, INK, MARKED, in_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["certificate_page"]


@page_of.register(Certificate)
def certificate_page(certificate: Certificate) -> Page:
    """Return the report of a certificate for the browser."""
    named = facts(certificate)
    sections = [
        Section("distances", "Distances beside coordinates", _compared(certificate), _COMPARED),
        Section("marks", "Marks", _marks(certificate)),
        Section("lens", "Lens", _lens(certificate)),
        Section(
            "camera", "Camera", [page_table(each.model, parameters(each)) for each in cameras(certificate)]
        ),
        tests_section(certificate.verdict),
        Section("certificate", "Certificate", [Facts("Certificate", named)]),
    ]
    return Page(
        what="Certificate of a camera",
        title=certificate.name,
        judgements=[judged(certificate.verdict)],
        advice=certificate.verdict.next,
        highlights=named[1:4],
        sections=sections,
    )


_COMPARED = (
    "Beyond 0.010 mm a distance and its coordinates contradict each other. Single changes of a typed figure"
    " that would explain it are guesses: no figure was changed."
)


def _compared(certificate: Certificate) -> list[Part]:
    return [page_table("Distances", compared(certificate))] if certificate.check() else []


def _marks(certificate: Certificate) -> list[Part]:
    if not (certificate.places or certificate.distances):
        return []
    found = certificate.fiducials()
    parts: list[Part] = [page_table("Places of the marks", marks(found))]
    if found.adjusted is not None:
        table = observed(found.adjusted, limit_of(len(found.adjusted.rows)))
        parts.append(page_table("Adjustment of distances", table))
    return parts


def _lens(certificate: Certificate) -> list[Part]:
    if certificate.radial is None:
        return []
    own = certificate.curve()
    return [
        Drawing("picture-distortion", "Radial distortion", _CURVE, lambda: _drawn(certificate)),
        page_table("Table of radial distortion", distortion(certificate, own)),
        page_table("Odd terms beside k0", terms(certificate.curves(), own.terms)),
        page_table("Curve, the last radius beyond the table", curve(own)),
    ]


_CURVE = (
    "Readings with their standard deviation, the fitted curve with its own; beyond the table it is dashed."
)


@in_style
def _drawn(certificate: Certificate) -> Figure:
    assert certificate.radial is not None
    own, um = certificate.curve(), 1e3
    edge = float(own.radius.max())
    figure = new_figure(6.4, 3.6)
    panel = figure.subplots()
    for radius, line in ((np.linspace(0, edge, 200), "-"), (np.linspace(edge, 1.1 * edge, 40), "--")):
        value, sd = um * own.at(radius), um * own.sd_at(radius)
        panel.fill_between(radius, value - sd, value + sd, color=FAINT, alpha=0.4, linewidth=0)
        panel.plot(radius, value, line, color=INK, linewidth=1.2)
    given = certificate.radial
    panel.errorbar(own.radius, um * given.distortion, um * given.sd, fmt="o", color=MARKED, markersize=4)
    panel.set_xlabel("radius, mm")
    panel.set_ylabel("distortion, µm")
    return figure
