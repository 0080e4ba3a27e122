"""What is told of a certificate: text, JSON document (docs/certificates.md lists its members), page."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.film.certificate import Certificate
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
from photogram.io import json
from photogram.network.cameras import Camera
from photogram.show.cells import page_table
from photogram.show.judgement import judged, tests_section
from photogram.show.lines import fact_lines, field, padded, table_lines
from photogram.show.lines import marks as marked
from photogram.show.methods import document_of, page_of, report_of
from photogram.show.page import Document, Drawing, Facts, Part, Section
from photogram.show.quantity import Quantity, records
from photogram.show.sections import Section as Lines
from photogram.show.sections import composed, headline, verdict_sections
from photogram.show.sketch.declared import Panel, spread
from photogram.show.sketch.marks import Line, Mark, Markers, band, error_bars
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.distributions import LEVEL, bonferroni, critical_normal


@report_of.register(Certificate)
def certificate_report(certificate: Certificate) -> str:
    """Return the report of a certificate."""
    own = cameras(certificate)
    made = [(f"Camera {each.model}", _columns(parameters(each), *_PARAMETERS)) for each in own]
    sections: list[Lines] = [
        *verdict_sections(certificate.verdict),
        ("Certificate", fact_lines(facts(certificate))),
        ("Distances beside coordinates", _compared(certificate)),
        ("Explained by a single change", _explained(certificate)),
        *_marks(certificate),
        *_lens(certificate),
        *made,
    ]
    return composed(headline("certificate", certificate.name), sections)


def _compared(certificate: Certificate) -> list[str]:
    names, distance, computed, difference, *_ = compared(certificate)
    return table_lines(
        [
            *field(names, 14, head="distance"),
            *field(distance, 12, ".3f", "given {unit}"),
            *field(computed, 14, ".4f", "computed {unit}"),
            *field(difference, 16, ".1f", "difference {unit}"),
            marked(difference, "  <--"),
        ]
    )


def _explained(certificate: Certificate) -> list[str]:
    lines, checks = [], certificate.check()
    for name, each in zip(padded((each.name for each in checks), 14), checks, strict=True):
        for one in each.explanations:
            far = "" if one.from_usual is None else f", {one.from_usual:+.3f} mm from its usual place"
            lines.append(f"{name}{one}: leaves {round(1e3 * one.remaining, 1) + 0.0:+.1f} um{far}")
        if each.beyond and not each.explanations:
            lines.append(f"{name}no single change of a figure")
    return lines


def _marks(certificate: Certificate) -> list[Lines]:
    if not (certificate.places or certificate.distances):
        return []
    found = certificate.fiducials()
    lines = _columns(marks(found), (8, "", "mark"), (13, ".4f"), (11, ".1f", "sd {name} {unit}"))
    sections: list[Lines] = [("Marks", lines)]
    if found.adjusted is not None:
        names, value, sd, residual, redundancy, w, error = observed(
            found.adjusted, limit_of(len(found.adjusted.rows))
        )
        lines = table_lines(
            [
                *field(names, 32, head="observed"),
                *field(value, 12, ".3f", "value"),
                *field(sd, 9, ".2f", "sd"),
                *field(residual, 10, ".2f", "residual"),
                *field(redundancy, 11, ".3f", "redundancy", gap=" "),
                *field(w, 9, ".2f", "w"),
                *field(error, 12, ".1f", "error alone"),
                marked(w, "  <--"),
            ]
        )
        lines.append("lengths in mm, angles in degrees; the rest in um and seconds of arc")
        sections.append(("Adjustment of distances", lines))
    return sections


def _columns(table: list[Quantity], *columns: tuple[Any, ...]) -> list[str]:
    """Return the first quantities of a table as text: width, form, head and gap of each as of `field`."""
    pairs = zip(table, columns, strict=False)
    return table_lines([each for quantity, column in pairs for each in field(quantity, *column)])


_DISTORTION = (
    *((12, ".2f", "angle {unit}"), (12, ".3f", "radius {unit}"), (16, ".1f", "distortion {unit}")),
    *((14, ".2f", "residual {unit}"), (11, ".3f", "redundancy", " "), (8, ".2f", "w")),
)
_TERMS = (
    *((6, ".0f", "terms"), (12, ".3f", "omega"), (5, ".0f", "f"), (10, ".3g", "p"), (10, ".2f", "gain")),
    (0, "", "{name} {unit}", "  "),
)
_RADII = ((12, ".1f", "radius {unit}"), (16, ".2f", "distortion {unit}"), (9, ".2f", "sd {unit}"))
_PARAMETERS = ((8,), (20, ".10g", "value"), (14, ".4g", "sd"), (0, "", "{name} {unit}", "  "))


def _lens(certificate: Certificate) -> list[Lines]:
    if certificate.radial is None:
        return []
    own = certificate.curve()
    return [
        ("Radial distortion", _columns(distortion(certificate, own), *_DISTORTION)),
        ("Odd terms beside k0", _columns(terms(certificate.curves(), own.terms), *_TERMS)),
        ("Curve, the last radius beyond the table", _columns(curve(own), *_RADII)),
    ]


@document_of.register(Certificate)
def certificate_document(certificate: Certificate) -> bytes:
    """Return everything as JSON."""
    document: dict[str, Any] = {
        "program": f"photogram {_photocore.__version__}",
        "kind": "certificate",
        "camera": certificate.name,
        "type": certificate.camera_type or None,
        "date": certificate.day.isoformat() if certificate.day else None,
        "verdict": certificate.verdict.document(),
        "remarks": certificate.told(),
        "distances": records(compared(certificate)),
        "marks": None,
        "lens": None,
        "cameras": [_camera_members(each) for each in cameras(certificate)],
    }
    if certificate.places or certificate.distances:
        document["marks"] = _mark_members(certificate)
    if certificate.radial is not None:
        own = certificate.curve()
        document["lens"] = {
            "focal_length_mm": own.focal_length,
            "sd_focal_length_mm": own.sd_focal_length,
            "table": records(distortion(certificate, own)),
            "terms": own.terms,
            "fits": records(terms(certificate.curves(), own.terms)),
            "curve": records(curve(own)),
            "brown_apart_mm": certificate.lens("brown").apart,
            "printed_coefficients_apart_mm": certificate.printed_coefficients(),
        }
    return json.to_json(document)


def limit_of(count: int) -> float:
    """Return the |w| beyond which one of so many is named."""
    return critical_normal(bonferroni(LEVEL, max(count, 1)))


def _mark_members(certificate: Certificate) -> dict[str, Any]:
    found = certificate.fiducials()
    own: dict[str, Any] = {
        "places": records(marks(found)),
        "covariance_mm2": {
            "order": [f"{name}.{axis}" for name in found.names for axis in "xy"],
            "matrix": found.covariance,
        },
        "adjustment": None,
    }
    if found.adjusted is not None:
        test = found.adjusted.test
        own["adjustment"] = {
            "free_movements": found.adjusted.free,
            "degrees_of_freedom": found.adjusted.degrees_of_freedom,
            "omega": test.weighted_sum_of_squares if test else None,
            "probability": test.probability_above if test else None,
            "observed": records(observed(found.adjusted, limit_of(len(found.adjusted.rows)))),
        }
    return own


def _camera_members(camera: Camera) -> dict[str, Any]:
    assert camera.covariance is not None
    names, matrix = camera.covariance
    return {
        "model": camera.model,
        "unit": camera.unit,
        "parameters": dict(camera.parameters),
        "covariance": {"order": [*names], "matrix": np.asarray(matrix)},
    }


@page_of.register(Certificate)
def certificate_page(certificate: Certificate) -> Document:
    """Return the report of a certificate for the browser."""
    named = facts(certificate)
    sections = [
        Section(
            "distances",
            "Distances beside coordinates",
            [page_table("Distances", compared(certificate))] if certificate.check() else [],
            _COMPARED,
        ),
        Section("marks", "Marks", _mark_parts(certificate)),
        Section("lens", "Lens", _lens_parts(certificate)),
        Section(
            "camera", "Camera", [page_table(each.model, parameters(each)) for each in cameras(certificate)]
        ),
        tests_section(certificate.verdict),
        Section("certificate", "Certificate", [Facts("Certificate", named)]),
    ]
    return Document(
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


def _mark_parts(certificate: Certificate) -> list[Part]:
    if not (certificate.places or certificate.distances):
        return []
    found = certificate.fiducials()
    parts: list[Part] = [page_table("Places of the marks", marks(found))]
    if found.adjusted is not None:
        table = observed(found.adjusted, limit_of(len(found.adjusted.rows)))
        parts.append(page_table("Adjustment of distances", table))
    return parts


def _lens_parts(certificate: Certificate) -> list[Part]:
    if certificate.radial is None:
        return []
    own = certificate.curve()
    return [
        Drawing("picture-distortion", "Radial distortion", _CURVE, partial(_sketch, certificate)),
        page_table("Table of radial distortion", distortion(certificate, own)),
        page_table("Odd terms beside k0", terms(certificate.curves(), own.terms)),
        page_table("Curve, the last radius beyond the table", curve(own)),
    ]


_CURVE = (
    "Readings with their standard deviation, the fitted curve with its own; beyond the table it is dashed."
)


def _sketch(certificate: Certificate) -> Plot:
    assert certificate.radial is not None
    own, um, given = certificate.curve(), 1e3, certificate.radial
    edge = float(own.radius.max())
    drawn, ends = list[Mark](), list[Floats]()
    for radius, dash in ((np.linspace(0, edge, 200), ""), (np.linspace(edge, 1.1 * edge, 40), "--")):
        value, sd = um * own.at(radius), um * own.sd_at(radius)
        drawn.append(band(radius, value - sd, value + sd, FAINT, 0.4))
        drawn.append(Line(np.column_stack([radius, value]), INK, 1.2, dash))
        ends += [value - sd, value + sd]
    places = np.column_stack([own.radius, um * given.distortion])
    low, high = (um * (given.distortion + sign * given.sd) for sign in (-1, 1))
    drawn += [Line(error_bars(places, low, high), MARKED, 1.5), Markers(places, "o", 4.0, MARKED)]
    limits = np.column_stack([spread(0.0, 1.1 * edge), spread(low, high, *ends)])
    return Plot(6.4, 3.6, [Panel(limits, drawn, "", "radius, mm", "distortion, µm")])
