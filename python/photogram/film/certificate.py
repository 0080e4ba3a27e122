"""Calibration certificates of film cameras: fiducial marks, distances, principal distance, lens."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import date
from functools import cached_property
from pathlib import Path
from typing import Literal, Self

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.certificate_file import REFERENCES, read_table, read_toml
from photogram.film.distances import (
    AdjustedMarks,
    Crossing,
    DistanceDifference,
    MarkDistance,
    RightAngle,
    adjust_distances,
    difference_of,
)
from photogram.film.lens_table import (
    Curve,
    LensParameters,
    RadialTable,
    Tangential,
    backward,
    chosen,
    curves_of,
    fit_curve,
    forward,
)
from photogram.film.marks import SD_PLACE, usual_places
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import listed
from photogram.network.cameras import Camera
from photogram.show.methods import Documented, Judged
from photogram.show.page import Document
from photogram.statistics.findings import Findings
from photogram.summaries import Rows
from photogram.words import Phrase, phrase

SD_DESIGN = 0.02
SD_C = 0.003
SD_PRINCIPAL_POINT = 0.003
SD_UNKNOWN_POINT = 0.02  # If the principal point is unknown, or distances alone determine the marks (mm)
APART = 3.0  # Significant distance of the points of symmetry and autocollimation, in standard deviations
PRINTED = 2e-3  # Largest difference of printed coefficients from the table of distortion, millimetres


@dataclass(frozen=True, eq=False)
class CalibratedMarks:
    """Coordinates of n fiducial marks.

    Attributes
    ----------
    names
        Names of the marks by side, data strip at the left.
    xy, covariance
        (n, 2) mm, and (2n, 2n) mm^2, ordered x, y per mark. Singular if the marks are a free network.
    adjusted
        The adjustment of distances that determined the marks; None if coordinates are given.
    """

    names: tuple[str, ...]
    xy: Floats
    covariance: Floats
    adjusted: AdjustedMarks | None = None


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Certificate(Documented, Judged):
    """Calibration certificate in mm, data strip at the left. :meth:`read` reads files.

    Parameters
    ----------
    name
        Name of the camera.
    camera_type
        Camera type, such as `Wild RC10`. It selects the usual coordinates of the marks.
    day
        Date of the calibration.
    c, sd_c
        Calibrated focal length and its standard deviation (0.003).
    reference
        Origin of the coordinates: `fiducial-centre`, `autocollimation` or `symmetry`.
    autocollimation, symmetry
        Coordinates of both points in the frame of the marks.
    sd_principal_point
        Standard deviation of the principal point (0.003).
    places
        Coordinates of the marks, by name.
    sd_places, covariance
        Standard deviation of a coordinate (0.002), or all coordinate names `ll.x` ... with their covariance
        matrix.
    distances
        Calibrated distances between marks.
    design, sd_design
        Nominal coordinates of the marks and their standard deviation (0.02), by default the usual ones of the
        type.
    lines
        Angles and intersections of the lines through marks.
    radial, tangential
        The distortion table that belongs to c, and the decentring distortion.
    radial_coefficients
        Printed coefficients K0, K1 ...: mm, with r in mm.
    typed
        Transcribed values by field: `ll.x`, `ml-mr`. Missing ones are generated.
    remarks
        Warnings of the reader.
    file
        File of the certificate.

    Raises
    ------
    InputError
        If the reference is unknown, or if the principal point is the origin but has other coordinates.
    """

    name: str = ""
    camera_type: str = ""
    day: date | None = None
    c: float | None = None
    sd_c: float | None = None
    reference: Literal["fiducial-centre", "autocollimation", "symmetry"] = "fiducial-centre"
    autocollimation: tuple[float, float] | None = None
    symmetry: tuple[float, float] | None = None
    sd_principal_point: float | None = None
    places: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sd_places: float | None = None
    covariance: Floats | None = None
    distances: tuple[MarkDistance, ...] = ()
    design: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    sd_design: float | None = None
    lines: tuple[RightAngle | Crossing, ...] = ()
    radial: RadialTable | None = None
    tangential: Tangential | None = None
    radial_coefficients: tuple[float, ...] = ()
    typed: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    file: Path | None = None

    def __post_init__(self) -> None:
        one_of("reference", self.reference, REFERENCES)
        origin = {"autocollimation": self.autocollimation, "symmetry": self.symmetry}.get(self.reference)
        if origin is not None and any(origin):
            raise self._error("films.origin", reference=self.reference, value=str(origin))

    @classmethod
    def read(cls, path: Path | str, camera: str | None = None) -> Self:
        """Read a certificate.

        Parameters
        ----------
        path
            TOML file, or a table `fiducials` (docs/certificates.md).
        camera
            Camera to read if a table contains several.

        Raises
        ------
        InputError
            If the file cannot be read, or has unknown or invalid content.
        """
        file = Path(path)
        if file.suffix.lower() == ".toml":
            if camera is not None:
                raise InputError(phrase("films.one-camera"), file=file)
            return cls(**read_toml(file))
        return cls(**read_table(file, camera))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the certificate."""
        rows = [
            ("marks", listed(list(self.places) or self._of_distances())),
            ("distances", str(phrase("brief.points", n=len(self.distances)))),
            ("verdict", self.verdict.headline),
        ]
        if self.c is not None:
            rows.insert(0, ("c", str(phrase("brief.c", c=self.c))))
        code = f"brief.certificate{'' if self.day else '.undated'}"
        return str(phrase(code, name=self.name, day=str(self.day or ""))), rows

    def check(self) -> tuple[DistanceDifference, ...]:
        """Compare distances with coordinates and explain differences beyond 0.010 mm."""
        figures = {
            f"{mark}.{axis}": repr(value)
            for mark, xy in self.places.items()
            for axis, value in zip("xy", xy, strict=True)
        }
        figures |= {each.name: repr(each.length) for each in self.distances} | dict(self.typed)
        return tuple(
            difference_of(each.first, each.second, figures, self._design)
            for each in self.distances
            if {each.first, each.second} <= self.places.keys()
        )

    @property
    def _design(self) -> dict[str, tuple[float, float]]:
        """Nominal coordinates of marks: as given, or the usual ones of the type."""
        return {**{mark: xy for mark, (xy, _) in usual_places(self.camera_type).items()}, **self.design}

    def fiducials(self) -> CalibratedMarks:
        """Return coordinates and covariance of the marks, as given or from distances.

        Raises
        ------
        InputError
            If both coordinates and distances are missing, or if a mark lacks design coordinates.
        AdjustmentError
            If the distances contradict the design coordinates.
        """
        return self._marks

    @cached_property
    def _marks(self) -> CalibratedMarks:
        if self.places:
            names, xy = tuple(self.places), np.array([*self.places.values()])
            variance = (SD_PLACE if self.sd_places is None else self.sd_places) ** 2
            given = self.covariance
            return CalibratedMarks(names, xy, variance * np.eye(xy.size) if given is None else given)
        marks, places = self._of_distances(), self._design
        if not marks:
            raise self._error("films.no-marks")
        if missing := [name for name in marks if name not in places]:
            raise self._error("films.no-design", marks=missing)
        usual = {mark: sd for mark, (_, sd) in usual_places(self.camera_type).items()}
        sd = dict.fromkeys(places, SD_DESIGN) | usual | dict.fromkeys(self.design, SD_DESIGN)
        sd |= {} if self.sd_design is None else dict.fromkeys(places, self.sd_design)
        adjusted = adjust_distances(
            marks,
            np.array([places[name] for name in marks]),
            self.distances,
            design_sd=np.array([sd[name] for name in marks]),
            conditions=self.lines,
        )
        return CalibratedMarks(adjusted.names, adjusted.xy, adjusted.covariance, adjusted)

    def _of_distances(self) -> list[str]:
        named = [mark for each in self.distances for mark in (each.first, each.second)]
        return list(dict.fromkeys([*named, *(mark for each in self.lines for mark in each.marks)]))

    def curves(self) -> tuple[Curve, ...]:
        """Return the fits of the distortion table with one, two and three odd terms.

        Raises
        ------
        InputError
            If the table is missing or too short.
        """
        return curves_of(*self._distortion)

    @property
    def _sd_c(self) -> float:
        return SD_C if self.sd_c is None else self.sd_c

    @property
    def _distortion(self) -> tuple[RadialTable, float, float]:
        if self.radial is None or self.c is None:
            raise self._error("films.no-distortion")
        return self.radial, self.c, self._sd_c

    def curve(self, terms: int | None = None) -> Curve:
        """Return the distortion curve with `terms` odd terms; None: chosen by tests.

        Raises
        ------
        InputError
            As :meth:`curves`, or if there are fewer angles than unknowns.
        """
        if terms is None:
            return chosen(self.curves())
        return fit_curve(*self._distortion, terms)

    @property
    def principal_point(self) -> tuple[tuple[float, float], float, str]:
        """Principal point in the frame of the marks (mm), its sd (mm) and its name."""
        given = {"autocollimation": self.autocollimation, "symmetry": self.symmetry}
        if self.reference in given:
            given[self.reference] = (0.0, 0.0)
        known = SD_PRINCIPAL_POINT if self.sd_principal_point is None else self.sd_principal_point
        for what, place in given.items():
            if place is not None:
                return place, known if self.places else max(known, SD_UNKNOWN_POINT), what
        return (0.0, 0.0), max(known, SD_UNKNOWN_POINT), "fiducial-centre"

    def lens(
        self, model: Literal["brown_forward", "brown"] = "brown_forward", terms: int | None = None
    ) -> LensParameters:
        """Return c and the radial terms with their covariance; without a table only c.

        Raises
        ------
        InputError
            If the focal length is missing, or as :meth:`curve`.
        """
        one_of("model", model, ("brown_forward", "brown"))
        if self.c is None:
            raise self._error("films.no-focal-length")
        if self.radial is None:
            return LensParameters(model, ("c",), np.array([-self.c]), np.array([[self._sd_c**2]]))
        return (forward if model == "brown_forward" else backward)(self.curve(terms))

    def camera(
        self, model: Literal["brown_forward", "brown"] = "brown_forward", terms: int | None = None
    ) -> Camera:
        """Return the camera with c, principal point and lens weighted by their covariance.

        Parameters
        ----------
        model
            `brown_forward`: the same mapping as the distortion curve. `brown`: converted to corrections.
        terms
            Odd terms of the curve. If None, tests choose their number.

        Raises
        ------
        InputError
            If the focal length is missing, if the table does not determine the terms, or if `brown` is used
            with decentring.
        """
        lens = self.lens(model, terms)
        (xp, yp), sd, _ = self.principal_point
        names, values = [*lens.names, "xp", "yp"], [*lens.values.tolist(), xp, yp]
        variances = [sd**2] * 2
        if self.tangential is not None:
            if model == "brown":
                raise self._error("films.decentring")
            names, values = [*names, "B1", "B2"], [*values, *self.tangential.terms]
            variances += [self.tangential.sd_j1**2] * 2
        n = len(lens.names)
        covariance = np.diag([*np.zeros(n), *variances])
        covariance[:n, :n] = lens.covariance
        return Camera(
            model,
            dict(zip(names, values, strict=True)),
            name=self.name,
            covariance=(names, covariance),
            unit="mm",
        )

    def printed_coefficients(self) -> float | None:
        """Return the largest deviation of printed K0, K1 ... from the table, mm, or None."""
        return self._printed(1.0)

    def _printed(self, sign: float) -> float | None:
        if not self.radial_coefficients or self.radial is None or self.c is None:
            return None
        radius = self.c * np.tan(self.radial.angle)
        powers = radius[:, np.newaxis] ** (2 * np.arange(len(self.radial_coefficients)) + 1)
        return float(np.abs(powers @ self.radial_coefficients - sign * self.radial.distortion).max())

    def document(self) -> Document:
        """Return the document with distances, marks, lens and camera."""
        from photogram.film.certificate_document import certificate_document

        return certificate_document(self)

    def _findings(self) -> Findings:
        from photogram.film.certificate_document import certificate_findings

        return certificate_findings(self)

    def told(self) -> list[str | Phrase]:
        """Return warnings in addition to the verdict."""
        remarks: list[str | Phrase] = [*self.remarks]
        difference = self.printed_coefficients()
        if difference is not None and difference > PRINTED:
            opposite = self._printed(-1.0)
            is_opposite = opposite is not None and opposite <= PRINTED
            code = "films.printed-other-sign" if is_opposite else "films.printed"
            remarks.append(phrase(code, difference=1e3 * difference))
        if self.radial_coefficients and self.radial is None:
            remarks.append(phrase("films.printed-alone"))
        if self.c is not None:
            _, sd, point = self.principal_point
            if point == "fiducial-centre":
                remarks.append(phrase("films.unknown-point", sd=sd))
            elif not self.places:
                remarks.append(phrase("films.uncertain-point", sd=sd))
            if self.autocollimation is not None and self.symmetry is not None:
                apart = math.dist(self.autocollimation, self.symmetry)
                if apart > APART * sd:
                    remarks.append(phrase("films.points-apart", distance=1e3 * apart))
        if self.places and (unused := [m for m in self._of_distances() if m not in self.places]):
            remarks.append(phrase("films.unused-marks", marks=unused))
        return remarks

    def _error(self, code: str, **fields: object) -> InputError:
        return InputError(Phrase(code, {"certificate": self.name, **fields}), file=self.file)
