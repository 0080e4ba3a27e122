"""A camera with its covariance as it was calibrated on a day."""

from __future__ import annotations

import math
from datetime import date

from photogram.errors import InputError
from photogram.film.certificate import Certificate
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera

__all__ = ["DatedCamera"]


@dataclass(frozen=True)
class DatedCamera:
    """A calibrated camera.

    Attributes
    ----------
    day
        On which it was calibrated.
    camera
        With its covariance; its name says which one it is.
    angle
        rad from the axis up to which it was calibrated; None where that is not known.
    source
        What it is from.

    Raises
    ------
    InputError
        A camera without a covariance matrix, an angle beyond the front of the camera.
    """

    day: date
    camera: Camera
    angle: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if self.camera.covariance is None:
            raise InputError(f"the camera {self.camera.title} has no covariance matrix to compare by")
        if self.angle is not None and not 0 < self.angle < math.pi / 2:
            raise InputError(f"the angle from the axis is between 0 and 90 degrees, not {self.angle} rad")

    @classmethod
    def of(cls, certificate: Certificate, terms: int | None = None) -> DatedCamera:
        """Return the camera of a certificate; `terms` odd ones of its curve.

        Raises
        ------
        InputError
            It has no date, or no focal length.
        """
        if certificate.day is None:
            raise InputError(f"the certificate {certificate.name} has no date", file=certificate.file)
        angle = None if certificate.radial is None else float(certificate.radial.angle.max())
        source = certificate.file.stem if certificate.file else certificate.name
        return cls(certificate.day, certificate.camera(terms=terms), angle, source)
