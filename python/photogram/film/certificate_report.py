"""The report of a certificate as text."""

from __future__ import annotations

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
from photogram.network.cameras import Camera
from photogram.show.lines import fact_lines, field, table_lines
from photogram.show.lines import marks as marked
from photogram.show.methods import report_of
from photogram.show.sections import Section, composed, headline, verdict_sections

__all__ = ["certificate_report"]


@report_of.register(Certificate)
def certificate_report(certificate: Certificate) -> str:
    """Return the report of a certificate."""
    sections: list[Section] = [
        *verdict_sections(certificate.verdict),
        ("Certificate", fact_lines(facts(certificate))),
        ("Distances beside coordinates", _compared(certificate)),
        ("Explained by a single change", _explained(certificate)),
        *_marks(certificate),
        *_lens(certificate),
        *((f"Camera {each.model}", _camera(each)) for each in cameras(certificate)),
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
    lines = []
    for each in certificate.check():
        for one in each.explanations:
            far = "" if one.from_usual is None else f", {one.from_usual:+.3f} mm from its usual place"
            lines.append(f"{each.name:<14}{one}: leaves {round(1e3 * one.remaining, 1) + 0.0:+.1f} um{far}")
        if each.beyond and not each.explanations:
            lines.append(f"{each.name:<14}no single change of a figure")
    return lines


def _marks(certificate: Certificate) -> list[Section]:
    if not (certificate.places or certificate.distances):
        return []
    found = certificate.fiducials()
    names, xy, sd = marks(found)
    lines = table_lines(
        [
            *field(names, 8, head="mark"),
            *field(xy, 13, ".4f"),
            *field(sd, 11, ".1f", "sd {name} {unit}"),
        ]
    )
    sections: list[Section] = [("Marks", lines)]
    if found.adjusted is not None:
        names, value, sd_, residual, redundancy, w, error = observed(
            found.adjusted, limit_of(len(found.adjusted.rows))
        )
        lines = table_lines(
            [
                *field(names, 32, head="observed"),
                *field(value, 12, ".3f", "value"),
                *field(sd_, 9, ".2f", "sd"),
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


def _lens(certificate: Certificate) -> list[Section]:
    if certificate.radial is None:
        return []
    own = certificate.curve()
    angle, radius, given, residual, redundancy, w = distortion(certificate, own)
    table = [
        *field(angle, 12, ".2f", "angle {unit}"),
        *field(radius, 12, ".3f", "radius {unit}"),
        *field(given, 16, ".1f", "distortion {unit}"),
        *field(residual, 14, ".2f", "residual {unit}"),
        *field(redundancy, 11, ".3f", "redundancy", gap=" "),
        *field(w, 8, ".2f", "w"),
    ]
    count, omega, freedom, p, gain, said, *_ = terms(certificate.curves(), own.terms)
    fits = [
        *field(count, 6, ".0f", "terms"),
        *field(omega, 12, ".3f", "omega"),
        *field(freedom, 5, ".0f", "f"),
        *field(p, 10, ".3g", "p"),
        *field(gain, 10, ".2f", "gain"),
        *field(said, 0, gap="  "),
    ]
    at, value, sd = curve(own)
    along = [
        *field(at, 12, ".1f", "radius {unit}"),
        *field(value, 16, ".2f", "distortion {unit}"),
        *field(sd, 9, ".2f", "sd {unit}"),
    ]
    return [
        ("Radial distortion", table_lines(table)),
        ("Odd terms beside k0", table_lines(fits)),
        ("Curve, the last radius beyond the table", table_lines(along)),
    ]


def _camera(camera: Camera) -> list[str]:
    names, value, sd, unit = parameters(camera)
    return table_lines(
        [
            *field(names, 8),
            *field(value, 20, ".10g", "value"),
            *field(sd, 14, ".4g", "sd"),
            *field(unit, 0, gap="  "),
        ]
    )
