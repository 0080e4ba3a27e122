"""Which certificate of a camera is that of a flight, by their dates."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

from photogram.errors import ContradictionError, InputError

if TYPE_CHECKING:
    from photogram.film.certificate import Certificate

YEARS = 3.0
"""A camera is calibrated anew after as many at the latest: what is farther from a flight is told."""
_YEAR = 365.25
"""Days."""


def valid_certificate(certificates: Sequence[Certificate], day: date | None) -> Certificate:
    """Return the certificate of a camera that is valid on a day: the last before, else the first after.

    InputError: several certificates, and no day of the flight; one of them without a date.
    ContradictionError: two certificates of one date.
    """
    if len(certificates) == 1:
        return certificates[0]
    if day is None:
        raise InputError(
            "has several certificates, and nothing says when was flown: [film] flown, or column flown"
        )
    dated: dict[date, Certificate] = {}
    for own in certificates:
        if own.day is None:
            raise InputError("has no date, and is one of several certificates of its camera", file=own.file)
        if own.day in dated:
            name = getattr(dated[own.day].file, "name", "another")
            raise ContradictionError(f"is of {own.day}, as {name} is: which one is valid?", file=own.file)
        dated[own.day] = own
    return dated[max((each for each in dated if each <= day), default=min(dated))]


def age_remark(certificate: Certificate, day: date) -> str:
    """Return a sentence where a certificate is far from a flight, or of later; nothing else."""
    if certificate.day is None:
        return f"its certificate has no date, and was flown {day}: nothing says that it is of this flight"
    years = (day - certificate.day).days / _YEAR
    if 0 <= years <= YEARS:
        return ""
    way = "before" if years > 0 else "after"
    said = f"its certificate is of {certificate.day}, {abs(years):.1f} years {way} the flight of {day}"
    return f"{said}: was the camera changed or repaired between?"


def changed_remark(chosen: Certificate, several: Sequence[Certificate], day: date) -> str:
    """Return a sentence where a camera has changed between its certificates before and after a flight."""
    from photogram.film.years import compare_cameras

    later = [each for each in several if each.day is not None and each.day > day and each is not chosen]
    if chosen.day is None or chosen.day > day or not later or chosen.c is None:
        return ""
    after = min(later, key=lambda each: each.day or day)
    if after.c is None or compare_cameras([chosen, after]).verdict.code != "changed":
        return ""
    return (
        f"it has changed between {chosen.day} and {after.day}, and nothing says whether before the flight of"
        f" {day}: `photogram camera compare` has the figures"
    )
