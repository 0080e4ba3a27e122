"""Document of a certificate and its findings (JSON members: `docs/certificates.md`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.film.distances import LIMIT, AdjustedMarks, DistanceDifference, Explanation, difference_message
from photogram.film.lens_table import Curve
from photogram.lazy_dataclasses import replace
from photogram.network.cameras import Camera
from photogram.show.judgement import verdict_document, verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Part, Section
from photogram.show.quantity import Axis, Kind, Quantity, Table, members, of_each
from photogram.show.sketch.marks import Line, Mark, Markers, Panel, band, error_bars, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, INK, MARKED
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import Certificate

CURVE = (
    "Readings with their standard deviation, the fitted curve with its own; beyond the table it is dashed."
)


MM = (Axis("", "mm", small="um", factor=1e3),)
XY = tuple(Axis(name, "mm", small="um", factor=1e3) for name in "xy")
OBSERVED = (Axis("length", "mm", small="um", factor=1e3), Axis.turned("angle", "deg"))
ANGLE = (Axis.turned("", "deg"),)
RADII = 8  # points of the printed distortion curve


def certificate_document(certificate: Certificate) -> Document:
    facts, verdict, cameras = _facts(certificate), certificate.verdict, list[Camera]()
    if certificate.c is not None:
        # The forward camera and, without decentring, the backward one
        both = certificate.radial is not None and certificate.tangential is None
        cameras = [certificate.camera(), *([certificate.camera("brown")] if both else [])]
    differences = certificate.check()
    distances = compared(differences)
    mark_parts, of_marks = _marks(certificate)
    of_cameras, parameters = [], list[Part]()
    for camera in cameras:
        assert camera.covariance is not None
        names, matrix = camera.covariance
        covariance = {"order": [*names], "matrix": np.asarray(matrix)}
        own = {"parameters": dict(camera.parameters), "covariance": covariance}
        of_cameras.append({**members(camera, "model", "unit"), **own})
        columns = [
            Quantity([*names], kind="name", head="Parameter"),
            Quantity(np.array([camera.parameters[name] for name in names]), head="Value", figures=8),
            Quantity(np.sqrt(np.diag(np.asarray(matrix))), head="sd", figures=3),
            Quantity([camera.unit_of(name) or "1" for name in names], kind="name", head="Unit"),
        ]
        parameters.append(Table(f"parameters_{camera.model}", f"Camera {camera.model}", columns))
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
            Section("camera", "Camera", parameters),
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
            "cameras": of_cameras,
        },
    )


def _marks(certificate: Certificate) -> tuple[list[Part], dict[str, Any] | None]:
    if not (certificate.places or certificate.distances):
        return [], None
    found = certificate.fiducials()
    sd = np.sqrt(np.diag(found.covariance)).reshape(-1, 2)
    columns = [
        Quantity([*found.names], kind="name", member="mark", head="Mark"),
        Quantity(found.xy, XY, "value", member="xy_mm", head="{}", decimals=4),
        Quantity(sd, XY, "deviation", member="sd_mm", head="sd {}", decimals=1),
    ]
    parts: list[Part] = [Table("marks.places", "Places of the marks", columns)]
    order = [f"{name}.{axis}" for name in found.names for axis in "xy"]
    own = {"covariance_mm2": {"order": order, "matrix": found.covariance}, "adjustment": None}
    if (adjusted := found.adjusted) is not None:
        test, tests = adjusted.test, _distances(adjusted)
        parts.append(observed(adjusted, certificate.verdict.marks(tests.kind, tests.values.shape)))
        own["adjustment"] = {
            **members(adjusted, "degrees_of_freedom", free_movements="free"),
            "omega": test.weighted_sum_of_squares if test else None,
            "probability": test.probability_above if test else None,
        }
    return parts, own


def _lens(certificate: Certificate) -> tuple[list[Part], dict[str, Any] | None]:
    if (table := certificate.radial) is None:
        return [], None
    own = certificate.curve()
    drawing = Drawing("picture-distortion", "Radial distortion", CURVE, partial(_sketch, certificate))
    distortion = [
        Quantity(table.angle, ANGLE, "value", member="angle_rad", head="Angle", decimals=2),
        _mm(own.radius, "value", "radius", "Radius", 3),
        _mm(table.distortion, "deviation", "distortion", "Distortion", 1),
        _mm(own.residuals, "deviation", "residual", "Residual", 2),
        Quantity(own.redundancy, member="redundancy", head="Redundancy", decimals=3),
        Quantity(own.standardized, member="w", head="w", decimals=2),
    ]
    radius = np.linspace(0.0, float(own.radius.max()), RADII + 1)[1:]
    radius = np.append(radius, radius[-1] + radius[0])
    curve = [
        _mm(radius, "value", "radius", "Radius", 1),
        _mm(own.at(radius), "deviation", "distortion", "Distortion", 2),
        _mm(own.sd_at(radius), "deviation", "sd", "sd", 2),
    ]
    tables = [
        Table("lens.table", "Table of radial distortion", distortion),
        terms(certificate.curves(), own.terms),
        Table("lens.curve", "Curve, the last radius beyond the table", curve),
    ]
    return [drawing, *tables], {
        **members(own, "terms", focal_length_mm="focal_length", sd_focal_length_mm="sd_focal_length"),
        "brown_apart_mm": certificate.lens("brown").apart,
        "printed_coefficients_apart_mm": certificate.printed_coefficients(),
    }


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
    tests = [_compared(certificate)] if compared else list[Tested]()
    fits, agreement = list[GlobalTest | None](), list[Phrase]()
    if compared and not beyond:
        largest = max(abs(each.difference) for each in compared)
        agreement = [Phrase("line.distances", {"n": len(compared), "largest": 1e3 * float(largest)})]
    if not certificate.places and (certificate.distances or certificate.lines):
        adjusted = certificate.fiducials().adjusted
        assert adjusted is not None
        tests.append(_distances(adjusted))
        fits.append(adjusted.test)
        if certificate.distances:
            agreement = [Phrase("line.free-figure" if adjusted.free else "line.few-distances")]
    if certificate.radial is not None:
        curve, angles = certificate.curve(), np.degrees(certificate.radial.angle).tolist()
        kind = phrase("films.readings")
        tests.append(
            Tested(kind, curve.standardized, lambda at: phrase("films.reading", angle=angles[at[0]]))
        )
        fits.append(curve.test)
    freedom = sum(test.degrees_of_freedom for test in fits if test)
    squares = sum(test.weighted_sum_of_squares for test in fits if test)
    return Findings(
        status="converged",
        observations=tests,
        degrees_of_freedom=freedom + len(compared),
        global_test=global_test(squares, freedom) if freedom else None,
        untested=Phrase("untested.distances" if compared else "untested.redundant"),
        spoiled=phrase("films.contradictions", differences=beyond) if beyond else "",
        remarks=[*agreement, *certificate.told()],
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


def compared(differences: Sequence[DistanceDifference]) -> Table:
    lengths = partial(of_each, differences, axes=MM, kind="value")
    apart = np.array([each.difference for each in differences])
    columns = [
        of_each(differences, "name", kind="name", member="distance", head="Distance"),
        lengths("distance", member="distance_mm", head="Given", decimals=3),
        lengths("from_coordinates", member="from_coordinates_mm", head="From coordinates", decimals=4),
        replace(_mm(apart, "deviation", "difference", "Difference", 1), marked=np.abs(apart) > LIMIT),
        of_each(differences, "beyond"),
        Quantity([[vars(one) for one in each.explanations] for each in differences], member="explanations"),
    ]
    about = (
        "Beyond 0.010 mm a distance and its coordinates contradict each other. Single changes of a typed"
        " figure that would explain it are guesses: no figure was changed."
    )
    return Table("distances", "Distances beside coordinates", columns, "", about)


def explanations(differences: Sequence[DistanceDifference]) -> Table:
    pairs: list[tuple[str, Explanation | None]] = [
        (each.name, one)
        for each in differences
        for one in each.explanations or ((None,) if each.beyond else ())
    ]
    remaining = np.array([one and one.remaining for _, one in pairs], dtype=float)
    moved = np.array([one and one.from_usual for _, one in pairs], dtype=float)
    columns = [
        Quantity([name for name, _ in pairs], kind="name", head="Distance"),
        Quantity([str(one or "none") for _, one in pairs], kind="name", head="Single change of a figure"),
        Quantity(remaining, MM, "deviation", head="Leaves", decimals=1),
        Quantity(moved, MM, "value", head="From its usual place", decimals=3),
    ]
    return Table("explanations", "Explained by a single change", columns)


def _mm(values: Floats, kind: Kind, member: str, head: str, decimals: int) -> Quantity:
    return Quantity(values, MM, kind, member=f"{member}_mm", head=head, decimals=decimals)


def observed(found: AdjustedMarks, marked: Bools) -> Table:
    of = np.array([int(name.startswith("angle ")) for name in found.rows])
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(np.isnan(found.standardized), math.nan, found.residuals / found.redundancy)
    columns = [
        Quantity([*found.rows], kind="name", member="observed", head="Observed"),
        Quantity(found.observed, OBSERVED, "value", member="value", head="Value", decimals=3, of=of),
        Quantity(found.sd, OBSERVED, "deviation", member="sd", head="sd", figures=2, of=of),
        Quantity(found.residuals, OBSERVED, "deviation", member="residual", head="Residual", of=of),
        Quantity(found.redundancy, member="redundancy", head="Redundancy", decimals=3),
        Quantity(found.standardized, member="w", head="w", decimals=2, marked=marked),
        Quantity(error, OBSERVED, "deviation", member="estimated_error", head="Error if it alone is", of=of),
    ]
    return Table("marks.adjustment.observed", "Adjustment of distances", columns)


def terms(curves: tuple[Curve, ...], taken: int) -> Table:
    """Return the fits with one to three odd terms; `taken` is the chosen number."""
    omega = [each.omega for each in curves]
    p = [each.test.probability_above if each.test else None for each in curves]
    freedom = [len(each.radius) - each.terms - 1 for each in curves]
    choice = ["chosen" if each.terms == taken else "" for each in curves]
    gain = np.array([math.nan, *-np.diff(omega)])
    columns = [
        of_each(curves, "terms", head="Odd terms"),
        Quantity(omega, member="omega", head="Omega", decimals=3),
        Quantity(freedom, member="degrees_of_freedom", head="f"),
        Quantity(p, member="probability", head="p", figures=2),
        Quantity(gain, member="gain", head="Gain", decimals=2),
        Quantity(choice, kind="name", head="Taken"),
        Quantity([each.coefficients for each in curves], member="coefficients"),
        Quantity([each.covariance for each in curves], member="covariance"),
    ]
    return Table("lens.fits", "Odd terms beside k0", columns)
