"""Document of a certificate and its findings (JSON members: `docs/certificates.md`)."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.film.certificate_check import difference_message
from photogram.film.certificate_tables import (
    compared,
    curve,
    distortion,
    explanations,
    marks,
    observed,
    parameters,
    terms,
)
from photogram.network.cameras import Camera
from photogram.show.judgement import verdict_document, verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Part, Section
from photogram.show.quantity import members
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, band, error_bars, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import AdjustedMarks, Certificate

CURVE = (
    "Readings with their standard deviation, the fitted curve with its own; beyond the table it is dashed."
)


def certificate_document(certificate: Certificate) -> Document:
    """Return the document of a certificate."""
    facts, verdict, cameras = _facts(certificate), certificate.verdict, _cameras(certificate)
    differences = certificate.check()
    distances = compared(differences)
    mark_parts, of_marks = _marks(certificate)
    lens_parts, of_lens = _lens(certificate)
    return verdict_document(
        verdict,
        "Certificate of a camera",
        certificate.name,
        highlights=facts[1:4],
        sections=[
            Section("distances", distances.title, [distances, explanations(differences)], distances.about),
            Section("marks", "Marks", mark_parts),
            Section("lens", "Lens", lens_parts),
            Section("camera", "Camera", [*map(parameters, cameras)]),
            Section.of(verdict_table(verdict)),
            Section("certificate", "Certificate", [Facts("Certificate", facts)]),
        ],
        members={
            "kind": "certificate",
            "camera": certificate.name,
            "type": certificate.camera_type or None,
            "date": certificate.day.isoformat() if certificate.day else None,
            "remarks": [*map(str, certificate.told())],
            "marks": of_marks,
            "lens": of_lens,
            "cameras": [_camera_members(each) for each in cameras],
        },
    )


def _marks(certificate: Certificate) -> tuple[list[Part], dict[str, Any] | None]:
    if not (certificate.places or certificate.distances):
        return [], None
    found = certificate.fiducials()
    parts: list[Part] = [marks(found)]
    order = [f"{name}.{axis}" for name in found.names for axis in "xy"]
    adjustment = None
    if found.adjusted is not None:
        test = found.adjusted.test
        tests = _distances(found.adjusted)
        parts.append(observed(found.adjusted, certificate.verdict.marks(tests.kind, tests.values.shape)))
        adjustment = {
            **members(found.adjusted, "degrees_of_freedom", free_movements="free"),
            "omega": test.weighted_sum_of_squares if test else None,
            "probability": test.probability_above if test else None,
        }
    return parts, {
        "covariance_mm2": {"order": order, "matrix": found.covariance},
        "adjustment": adjustment,
    }


def _lens(certificate: Certificate) -> tuple[list[Part], dict[str, Any] | None]:
    if certificate.radial is None:
        return [], None
    own = certificate.curve()
    drawing = Drawing("picture-distortion", "Radial distortion", CURVE, partial(_sketch, certificate))
    tables = [distortion(certificate.radial, own), terms(certificate.curves(), own.terms), curve(own)]
    return [drawing, *tables], {
        **members(own, "terms", focal_length_mm="focal_length", sd_focal_length_mm="sd_focal_length"),
        "brown_apart_mm": certificate.lens("brown").apart,
        "printed_coefficients_apart_mm": certificate.printed_coefficients(),
    }


def _camera_members(camera: Camera) -> dict[str, Any]:
    assert camera.covariance is not None
    names, matrix = camera.covariance
    return {
        **members(camera, "model", "unit"),
        "parameters": dict(camera.parameters),
        "covariance": {"order": [*names], "matrix": np.asarray(matrix)},
    }


def _cameras(certificate: Certificate) -> list[Camera]:
    """Return the forward camera and, without decentring, the backward one."""
    if certificate.c is None:
        return []
    if certificate.radial is None or certificate.tangential is not None:
        return [certificate.camera()]
    return [certificate.camera("brown_forward"), certificate.camera("brown")]


def _facts(certificate: Certificate) -> list[Fact]:
    (xp, yp), sd, what = certificate.principal_point
    facts = [
        Fact("Camera", certificate.name, note=certificate.camera_type),
        Fact("Date", certificate.day.isoformat() if certificate.day else "not given"),
    ]
    if certificate.c is not None:
        facts += [
            Fact.of("Calibrated focal length", certificate.c, "mm", decimals=3),
            Fact.of("Principal point", (xp, yp), "mm", f"{what}, sd {sd:g} mm", decimals=4),
        ]
    if certificate.radial is not None:
        apart = certificate.lens("brown").apart
        facts.append(Fact.of("Conversion to brown", 1e3 * apart, "um", "differs by at most", figures=2))
    return facts


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


def certificate_findings(certificate: Certificate) -> Findings:
    """Return the tests of a certificate: distances and coordinates, distances, lens."""
    compared = certificate.check()
    beyond = [difference_message(each) for each in compared if each.beyond]
    tests: list[Tested] = []
    fits: list[GlobalTest] = []
    if compared:
        tests.append(_compared(certificate))
    if not certificate.places and (certificate.distances or certificate.lines):
        adjusted = certificate.fiducials().adjusted
        assert adjusted is not None
        tests.append(_distances(adjusted))
        fits += [adjusted.test] if adjusted.test else []
    if certificate.radial is not None:
        curve, angles = certificate.curve(), np.degrees(certificate.radial.angle)
        kind = phrase("films.readings")
        tests.append(
            Tested(kind, curve.standardized, lambda at: phrase("films.reading", angle=float(angles[at[0]])))
        )
        fits += [curve.test] if curve.test else []
    freedom = sum(test.degrees_of_freedom for test in fits)
    squares = sum(test.weighted_sum_of_squares for test in fits)
    return Findings(
        status="converged",
        observations=tests,
        degrees_of_freedom=freedom + len(compared),
        global_test=global_test(squares, freedom) if freedom else None,
        untested=Phrase("untested.distances" if compared else "untested.redundant"),
        spoiled=phrase("films.contradictions", differences=beyond) if beyond else "",
        remarks=[*_agreement(certificate), *certificate.told()],
        scaled=False,
        check=Phrase("how.check.certificate"),
        take_out=Phrase("advice.certificate"),
        if_withheld=[Phrase("advice.printed-report")],
    )


def _distances(adjusted: AdjustedMarks) -> Tested:
    return Tested(phrase("films.distances"), adjusted.standardized, lambda at: adjusted.rows[at[0]])


def _compared(certificate: Certificate) -> Tested:
    marks, compared = certificate.fiducials(), certificate.check()
    of = {name: row for row, name in enumerate(marks.names)}
    cofactors = marks.covariance.reshape(len(of), 2, len(of), 2)
    w: list[float] = []
    for each in certificate.distances:
        if not {each.first, each.second} <= of.keys():
            continue
        i, j = of[each.first], of[each.second]
        along = (marks.xy[j] - marks.xy[i]) / np.hypot(*(marks.xy[j] - marks.xy[i]))
        both = cofactors[i, :, i] + cofactors[j, :, j] - cofactors[i, :, j] - cofactors[j, :, i]
        w.append(compared[len(w)].difference / math.sqrt(each.sd**2 + along @ both @ along))
    return Tested(phrase("films.compared"), np.array(w), lambda at: compared[at[0]].name)


def _agreement(certificate: Certificate) -> list[Phrase]:
    """Return the agreement of distances and coordinates, or the datum of distances."""
    compared = certificate.check()
    if compared and not any(each.beyond for each in compared):
        largest = max(abs(each.difference) for each in compared)
        return [Phrase("line.distances", {"n": len(compared), "largest": 1e3 * float(largest)})]
    if certificate.places or not certificate.distances:
        return []
    adjusted = certificate.fiducials().adjusted
    assert adjusted is not None
    return [Phrase("line.free-figure" if adjusted.free else "line.few-distances")]
