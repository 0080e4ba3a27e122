"""Fiducial marks of cameras: the table, or certificates, and what is known of their places."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.plain.certificates import certificate_marks, definite
from photogram.formats.plain.covariances import Covariances
from photogram.formats.plain.tables import Tables
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.films import Mark
from photogram.network.observations import KnownTogether, Observation

if TYPE_CHECKING:
    from photogram.film import Certificate

__all__ = ["Fiducials", "read_fiducials"]

SD_MARK = 0.002
"""mm, of places in a certificate that does not say it: they are printed to 0.001."""


@dataclass(frozen=True)
class Fiducials:
    """Marks of cameras by the names of both.

    Attributes
    ----------
    places, sd
        (2,) mm; deviations of those that are known one by one.
    covariances
        (2n, 2n) of all marks of a camera, of certificates.
    """

    tables: Tables
    places: dict[str, dict[str, Floats]] = field(default_factory=dict)
    sd: dict[str, dict[str, Floats]] = field(default_factory=dict)
    covariances: dict[str, Floats] = field(default_factory=dict)

    def known(
        self,
        marks: Mapping[str, Mapping[str, Mark]],
        read: Collection[tuple[str, str]],
        covariances: Covariances,
    ) -> list[Observation]:
        """Return what is known of marks: of all of a camera together, or of each that was read by itself."""
        found: list[Observation] = []
        for camera, own in marks.items():
            words = [f"{name}.{axis}".lower().replace("_", " ") for name in own for axis in "xy"]
            covariance = self.covariances.get(camera)
            if (given := covariances.over("fiducials", camera, words, singular=True)) is not None:
                xy = np.array([mark.position[:2] for mark in own.values()])
                file = self.tables.settings.tables["covariances"]
                covariance = definite(self.tables, camera, xy, given, file)
            if covariance is not None:
                found.append(KnownTogether("certificate", list(own.values()), covariance=covariance))
                continue
            found += [
                KnownTogether("certificate", [mark], sd=self.sd[camera][name])
                for name, mark in own.items()
                if (camera, name) in read
            ]
        return found

    def take(self, certificates: Mapping[str, Certificate]) -> None:
        """Take the marks of certificates.

        Raises
        ------
        InputError
            A camera that has marks already.
        """
        for camera, own in certificates.items():
            if camera in self.places:
                raise InputError(
                    f"the camera {camera} has marks here, and others in its certificate",
                    file=self.tables.settings.tables["fiducials"],
                )
            self.places[camera], self.sd[camera], covariance = certificate_marks(self.tables, camera, own)
            if covariance is not None:
                self.covariances[camera] = covariance


def read_fiducials(
    tables: Tables, cameras: Collection[str], certificates: Mapping[str, Certificate]
) -> Fiducials:
    """Read the marks of cameras, of the table and of certificates.

    Raises
    ------
    InputError
        Cells that are no numbers, a mark that is there twice, marks in the table and in a certificate.
    """
    found, table = Fiducials(tables), tables.read("fiducials")
    if table is not None:
        xy = table.vectors(("x", "y"))
        table.check_given(xy, ("x", "y"))
        sd = tables.deviations(table, "fiducials", ("sd_x", "sd_y"), SD_MARK)
        use, texts = table.flags("use"), [table.texts(name) for name in ("camera", "fiducial")]
        for row, (camera, name) in enumerate(zip(*texts, strict=True)):
            if not use[row] or camera not in cameras:
                continue
            if name in found.places.setdefault(camera, {}):
                raise table.error(row, f"the camera {camera} has the fiducial {name} twice")
            found.places[camera][name] = xy[row]
            found.sd.setdefault(camera, {})[name] = sd[row]
    found.take(certificates)
    return found
