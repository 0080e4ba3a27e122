"""What the verdict on a certificate rests on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.statistics.findings import Findings, Tested
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram.film import Certificate


def certificate_findings(certificate: Certificate) -> Findings:
    """Return the tests of a certificate: distances beside coordinates, distances alone, the lens."""
    compared = certificate.check()
    beyond = [each for each in compared if each.beyond]
    tested, tests = _tests(certificate)
    fits = sum(test.degrees_of_freedom for test in tests)
    squares = sum(test.weighted_sum_of_squares for test in tests)
    return Findings(
        status="converged",
        observations=tested,
        degrees_of_freedom=fits + len(compared),
        global_test=global_test(squares, fits) if fits else None,
        untested=Phrase("untested.distances" if compared else "untested.redundant"),
        spoiled="; ".join(map(str, beyond)),
        remarks=[*_agreement(certificate), *certificate.told()],
        scaled=False,
        check=Phrase("how.check.certificate"),
        take_out=Phrase("advice.certificate"),
        if_withheld=[Phrase("advice.printed-report")],
    )


def _tests(certificate: Certificate) -> tuple[list[Tested], list[GlobalTest]]:
    found: list[tuple[Tested, GlobalTest | None]] = []
    if certificate.check():
        found.append((_compared(certificate), None))
    if not certificate.places and (certificate.distances or certificate.lines):
        adjusted = certificate.fiducials().adjusted
        assert adjusted is not None
        names = adjusted.rows
        w = Tested("distances between marks", adjusted.standardized, lambda at: names[at[0]], "w")
        found.append((w, adjusted.test))
    if certificate.radial is not None:
        own, angles = certificate.curve(), np.degrees(certificate.radial.angle)
        w = Tested(
            "readings of distortion",
            own.standardized,
            lambda at: f"the distortion at {angles[at[0]]:.4g} degrees",
            "w",
        )
        found.append((w, own.test))
    return [tested for tested, _ in found], [test for _, test in found if test is not None]


def _compared(certificate: Certificate) -> Tested:
    """Return distances less those from coordinates, over the standard deviations of both."""
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
    return Tested("distances beside coordinates", np.array(w), lambda at: compared[at[0]].name, "w")


def _agreement(certificate: Certificate) -> list[Phrase]:
    """Say that distances agree with coordinates, or what holds a figure of distances alone."""
    compared = certificate.check()
    if compared and not any(each.beyond for each in compared):
        largest = max(abs(each.difference) for each in compared)
        return [Phrase("line.distances", {"n": len(compared), "largest": 1e3 * float(largest)})]
    if certificate.places or not certificate.distances:
        return []
    adjusted = certificate.fiducials().adjusted
    assert adjusted is not None
    if not adjusted.free:
        return [Phrase("line.few-distances")]
    return [Phrase("line.free-figure")]
