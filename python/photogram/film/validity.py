"""Choice of the certificate that is valid for a flight."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

from photogram.errors import ContradictionError, InputError
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film.certificate import Certificate

MAX_AGE_YEARS = 3.0  # Cameras are recalibrated after this time at the latest
_DAYS_OF_YEAR = 365.25


def valid_certificate(certificates: Sequence[Certificate], day: date | None) -> Certificate:
    """Return the certificate valid on a day: the last before, else the first after.

    InputError: if there are several certificates and no day of the flight, or one without a date.
    ContradictionError: if two certificates have the same date.
    """
    if len(certificates) == 1:
        return certificates[0]
    if day is None:
        raise InputError(phrase("films.several-certificates"))
    dated: dict[date, Certificate] = {}
    for certificate in certificates:
        if certificate.day is None:
            raise InputError(phrase("films.undated", certificate=certificate.name), file=certificate.file)
        if certificate.day in dated:
            other = getattr(dated[certificate.day].file, "name", certificate.name)
            message = phrase("films.same-date", day=str(certificate.day), other=other)
            raise ContradictionError(message, file=certificate.file)
        dated[certificate.day] = certificate
    return dated[max((each for each in dated if each <= day), default=min(dated))]


def age_remark(certificate: Certificate, day: date) -> str | Phrase:
    """Return a warning if a certificate is far older than a flight or later, else ""."""
    if certificate.day is None:
        return phrase("films.undated-flight", day=str(day))
    years = (day - certificate.day).days / _DAYS_OF_YEAR
    if 0 <= years <= MAX_AGE_YEARS:
        return ""
    code = "films.before-flight" if years > 0 else "films.after-flight"
    return phrase(code, certificate=str(certificate.day), years=abs(years), day=str(day))


def changed_remark(chosen: Certificate, several: Sequence[Certificate], day: date) -> str | Phrase:
    """Return a warning if a camera changed between its certificates around a flight."""
    from photogram.film.years import compare_cameras

    later = [each for each in several if each.day is not None and each.day > day and each is not chosen]
    if chosen.day is None or chosen.day > day or not later or chosen.c is None:
        return ""
    after = min(later, key=lambda each: each.day or day)
    if after.c is None or compare_cameras([chosen, after]).verdict.code != "changed":
        return ""
    return phrase("films.changed", before=str(chosen.day), after=str(after.day), day=str(day))
