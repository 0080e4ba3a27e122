"""Calibrations of each camera over time: the valid certificate, and their comparison.

The comparison does not depend on camera model and balancing. Principal distance and radial terms are
correlated, and laboratories balance curves differently, so parameters cannot be compared. In the field common
to all calibrations, up to the angle alpha, the image coordinates of directions are decomposed into orthogonal
fields over a disc. The fields are a shift, a scale (principal distance of the whole field), the radial shapes
R_3, R_5, R_7 of Zernike, decentring, affinity and shear. With rho = tan(angle) / tan(alpha), each has the
length 1 at the edge, rho = 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import date
from itertools import combinations

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import ContradictionError, InputError
from photogram.film.certificate import Certificate
from photogram.film.lens_table import RadialTable
from photogram.history.changes import History, dates_of, history
from photogram.history.document import history_document, history_findings
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.show.methods import Documented, Judged
from photogram.show.page import Document, Fact
from photogram.show.quantity import Axis, Quantity, Table
from photogram.statistics.distributions import LEVEL
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase, phrase

MAX_AGE_YEARS = 3.0  # Cameras are recalibrated after this time at the latest
_DAYS_OF_YEAR = 365.25
NODES = 9  # radii, Gauss-Legendre nodes
AZIMUTHS = 12
STEP = 0.01  # of numerical differences, in standard deviations
UM = 1e3
LEAST = 1e-4  # Least standard deviation of an estimated value, relative to the largest one
ALONE = 1e-3  # Least independent part of the standard deviation of a value given the values before it

_RADIAL = ((0, 1), (-2, 3), (3, -12, 10), (-4, 30, -60, 35))
"""Coefficients of rho, rho^3, ...: R_1 = rho, R_3, R_5, R_7."""
_NAMES = (
    *("principal distance", "shift x", "shift y", "radial 3", "radial 5", "radial 7"),
    *("decentring x", "decentring y", "affinity", "shear"),
)


@dataclass(frozen=True, eq=False)
class CameraFigures:
    """Values (k, m) of k calibrations, their covariances (k, m, m), names and units."""

    values: Floats  # estimated by all calibrations
    covariances: Floats
    names: tuple[str, ...]
    units: tuple[str, ...]
    held: tuple[str, ...]  # Names of values that only some calibrations estimated, which are not comparable


def figures_of(cameras: Sequence[Camera], angle: float) -> CameraFigures:
    """Return comparable values of cameras within an angle (rad) from the axis.

    InputError: if cameras have different units, or if a camera does not reach the angle.
    """
    units = {each.unit for each in cameras}
    if len(units) > 1:
        raise InputError(phrase("films.two-units", camera=cameras[0].title))
    directions, apart = _apart(angle)
    metric, rest = cameras[0].unit == "mm", len(_NAMES) - 1
    factors = np.array([1 / np.tan(angle), *[UM if metric else 1.0] * rest])
    values, roots = [], []
    for each in cameras:
        value, root = _with_root(each, directions, apart)
        values.append(factors * value)
        roots.append(factors[:, np.newaxis] * root)
    estimated = np.array([_estimated(each / factors[:, np.newaxis]) for each in roots])
    common = estimated.all(axis=0)
    return CameraFigures(
        np.array(values)[:, common],
        np.array([each[common] @ each[common].T for each in roots]),
        tuple(np.array(_NAMES)[common].tolist()),
        tuple(np.array(["mm", *["um"] * rest] if metric else ["px"] * len(_NAMES))[common].tolist()),
        tuple(np.array(_NAMES)[estimated.any(axis=0) & ~common].tolist()),
    )


def _estimated(root: Floats) -> Bools:
    """Return which values are estimated. Values of fixed terms depend on others."""
    sd = np.linalg.norm(root, axis=1)
    found: Bools = sd > LEAST * sd.max()
    before = np.zeros((0, root.shape[1]))
    for row in np.flatnonzero(found).tolist():
        left = root[row] - before.T @ (before @ root[row])
        size = np.linalg.norm(left)
        found[row] = size > ALONE * sd[row]
        if found[row]:
            before = np.vstack([before, left / size])
    return found


def _apart(angle: float) -> tuple[Floats, Floats]:
    """Return directions (n, 3) and the decomposition (10, 2n) without a rotation."""
    rho = (np.polynomial.legendre.leggauss(NODES)[0] + 1) / 2
    azimuth = np.arange(AZIMUTHS) * 2 * np.pi / AZIMUTHS
    r, a = (each.ravel() for each in np.meshgrid(rho, azimuth))
    x, y = np.cos(a), np.sin(a)
    radial = [sum(c * r ** (2 * k + 1) for k, c in enumerate(each)) for each in _RADIAL[1:]]
    one, none = np.ones_like(r), np.zeros_like(r)
    fields = [
        *((r * x, r * y), (one, none), (none, one)),
        *((of * x, of * y) for of in radial),
        # The mean over the disc of r^2 + 2 x^2, 2 x y is a shift by 1.
        *((r**2 * (1 + 2 * x**2) - 1, 2 * r**2 * x * y), (2 * r**2 * x * y, r**2 * (1 + 2 * y**2) - 1)),
        *((r * x, -r * y), (r * y, r * x), (-r * y, r * x)),
    ]
    basis = np.array([np.column_stack(each).ravel() for each in fields]).T
    tangent = r * np.tan(angle)
    return np.column_stack([tangent * x, tangent * y, -one]), np.linalg.pinv(basis)[:-1]


def _with_root(camera: Camera, directions: Floats, apart: Floats) -> tuple[Floats, Floats]:
    """Return the values of a camera, and F of their covariance F F'."""

    def at(changes: dict[str, float]) -> Floats:
        changed = camera.replace(parameters={**camera.parameters, **changes}) if changes else camera
        images = changed.project(directions)
        if not np.isfinite(images).all():
            raise InputError(phrase("films.no-image", camera=camera.title))
        return apart @ (images * [1.0, -1.0 if camera.image_y == "down" else 1.0]).ravel()

    assert camera.covariance is not None
    names, matrix = camera.covariance
    sd = np.sqrt(np.diag(np.asarray(matrix)))
    columns = []
    for name, step in zip(names, (STEP * sd).tolist(), strict=True):
        value = camera.parameters[name]
        columns.append((at({name: value + step}) - at({name: value - step})) / (2 * STEP))
    return at({}), np.column_stack(columns) @ np.linalg.cholesky(np.asarray(matrix) / np.outer(sd, sd))


@dataclass(frozen=True)
class DatedCamera:
    """Camera calibration with its date.

    Attributes
    ----------
    day
        Date of the calibration.
    camera
        Camera with its covariance; its name identifies the camera.
    angle
        Largest calibrated angle from the axis, rad; None if unknown.
    source
        Source of the calibration.

    Raises
    ------
    InputError
        If the camera lacks a covariance matrix, or if the angle is beyond the front of the camera.
    """

    day: date
    camera: Camera
    angle: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        if self.camera.covariance is None:
            raise InputError(phrase("films.no-covariance", camera=self.camera.title))
        if self.angle is not None and not 0 < self.angle < math.pi / 2:
            limits = phrase("error.range", low="0", high="pi/2", value=self.angle)
            raise InputError(phrase("error.at", what="angle", message=limits))

    @classmethod
    def of(cls, certificate: Certificate, terms: int | None = None) -> DatedCamera:
        """Return the dated camera of a certificate; `terms` is the number of odd terms.

        Raises
        ------
        InputError
            If the date or the focal length is missing.
        """
        if certificate.day is None:
            raise InputError(phrase("films.undated", certificate=certificate.name), file=certificate.file)
        angle = None if certificate.radial is None else float(certificate.radial.angle.max())
        source = certificate.file.stem if certificate.file else certificate.name
        return cls(certificate.day, certificate.camera(terms=terms), angle, source)


@dataclass(frozen=True, eq=False, repr=False)
class CameraComparison(Documented, Judged):
    """Comparison of camera calibrations over years.

    Attributes
    ----------
    calibrations
        Calibrations in order of date.
    histories
        History of every camera with at least two calibrations, by name: `camera rc10-2345`.
    angles
        Largest compared angle of each camera from the axis, rad.
    remarks
        Warnings on values that could not be compared.
    """

    calibrations: tuple[DatedCamera, ...]
    histories: Mapping[str, History]
    angles: Mapping[str, float]
    remarks: tuple[Phrase, ...]

    def document(self) -> Document:
        """Return the document with changes, control charts, calibrations and all values."""
        return history_document(
            "Calibrations of cameras over years",
            _calibrations(self.calibrations),
            self.histories,
            self.verdict,
            "cameras",
            {name: {"angle_rad": angle} for name, angle in self.angles.items()},
            about=FIGURES,
            highlights=[
                Fact.of(f"{name[:1].upper()}{name[1:]} compared up to", math.degrees(angle), "°", decimals=1)
                for name, angle in self.angles.items()
            ],
            members={"remarks": [*map(str, self.remarks)]},
        )

    def _findings(self) -> Findings:
        # Values with a detected change are not tested again.
        quiet = [
            (whose, history, own)
            for whose, history in self.histories.items()
            for own in history.series
            if not own.changes
        ]
        places = [
            f"{own.name} of {whose} on {occasion}"
            for whose, history, own in quiet
            for occasion in history.occasions
        ]
        values = np.concatenate([own.off / own.off_sd for *_, own in quiet] or [np.zeros(0)])
        return history_findings(
            self.histories,
            observations=[Tested("values beside those of the others", values, lambda at: places[at[0]], "w")],
            degrees_of_freedom=sum(own.constancy.degrees_of_freedom for own in self.histories.values()),
            untested=Phrase("untested.constancy"),
            remarks=self.remarks,
            if_withheld=[Phrase("advice.certificate-of-time")],
        )


def compare_cameras(
    calibrations: Sequence[Certificate | DatedCamera], *, angle: float | None = None, level: float = LEVEL
) -> CameraComparison:
    """Compare calibrations of one camera or of several over time.

    Parameters
    ----------
    calibrations
        Certificates with a date, or dated cameras, in any order. All certificates of a camera use the largest
        number of odd terms that one of them requires.
    angle
        Largest compared angle from the axis, rad. If None, the least calibrated angle of a camera.
    level
        Probability of a false detection of a change per camera.

    Raises
    ------
    InputError
        If a camera has fewer than two calibrations, one without date or covariance, or the same one twice. If
        cameras have several units, or if the angle is unknown.
    """
    terms: dict[str, int] = {}
    for each in calibrations:
        if isinstance(each, Certificate) and each.radial is not None:
            terms[each.name] = max(terms.get(each.name, 1), each.curve().terms)
    dated = [
        DatedCamera.of(each, None if each.radial is None else terms[each.name])
        if isinstance(each, Certificate)
        else each
        for each in calibrations
    ]
    records, remarks = sorted(dated, key=lambda each: each.day), list[Phrase]()
    histories, angles = {}, {}
    for title in dict.fromkeys(each.camera.title for each in records):
        name, own = f"camera {title}", [each for each in records if each.camera.title == title]
        if len(own) < 2:
            remarks.append(phrase("films.single-calibration", camera=name))
            continue
        for first, second in combinations(own, 2):
            if first.day == second.day and first.camera.parameters == second.camera.parameters:
                raise InputError(phrase("films.repeated", first=first.source, second=second.source))
        known = [each.angle for each in own if each.angle is not None] if angle is None else [angle]
        if not known:
            raise InputError(phrase("films.unknown-angle", camera=name))
        angles[name] = min(known)
        found = figures_of([each.camera for each in own], angles[name])
        dates = dates_of([each.day for each in own], [each.source for each in own])
        histories[name] = history(
            found.values,
            found.covariances,
            times=np.array(dates.years),
            occasions=dates.names,
            names=found.names,
            units=found.units,
            unit_of_time="year",
            level=level,
        )
        if found.held:
            remarks.append(phrase("films.not-compared", camera=name, figures=found.held))
    if not histories:
        raise InputError(phrase("films.two-calibrations"))
    return CameraComparison(tuple(records), histories, angles, tuple(remarks))


ANGLE = (Axis.turned("", "deg"),)


def _calibrations(found: Sequence[DatedCamera]) -> Table:
    angles = np.array([np.nan if each.angle is None else each.angle for each in found])
    columns = [
        Quantity([each.day.isoformat() for each in found], kind="name", member="day", head="Day"),
        Quantity([each.camera.title for each in found], kind="name", member="camera", head="Camera"),
        Quantity([each.camera.model for each in found], kind="name", member="model", head="Model"),
        Quantity(angles, ANGLE, "value", member="angle_rad", head="Up to", decimals=1),
        Quantity([each.source for each in found], kind="name", member="source", head="From"),
    ]
    return Table("calibrations", "Calibrations", columns)


FIGURES = (
    "Images of directions are compared within the angle that all calibrations have in common: a shift, the"
    " principal distance that suits the whole field, radial shapes of third, fifth and seventh degree,"
    " decentring, affinity and shear, as they move an image at the edge."
)


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
    later = [each for each in several if each.day is not None and each.day > day and each is not chosen]
    if chosen.day is None or chosen.day > day or not later or chosen.c is None:
        return ""
    after = min(later, key=lambda each: each.day or day)
    if after.c is None or compare_cameras([chosen, after]).verdict.code != "changed":
        return ""
    return phrase("films.changed", before=str(chosen.day), after=str(after.day), day=str(day))


DAYS = ("1974-03-12", "1977-05-03", "1980-02-27", "1983-05-11", "1986-04-08", "1989-06-20")
ANGLES = (7.5, 15.0, 22.7, 30.0, 35.0, 40.0)
FOCAL_LENGTH, REPAIR = 152.375, 0.015  # Millimetres; a repair before the fourth certificate causes the step
CURVE = (-3.1e-4, 3.8e-8, -1.0e-12)
POINT = (0.004, -0.012)
SD_READING, SD_FOCAL_LENGTH, SD_POINT = 1.5e-3, 0.003, 0.003


def simulated_certificates() -> list[Certificate]:
    """Simulate six calibrations of a camera over fifteen years; readings are printed to a micrometre."""
    rng = np.random.default_rng(1974)
    angle = np.radians(ANGLES)
    found = []
    for k, day in enumerate(DAYS):
        true = FOCAL_LENGTH + (REPAIR if k >= 3 else 0.0)
        # The focal length has its own error; the table refers to the printed value.
        printed = round(rng.normal(true, SD_FOCAL_LENGTH), 3)
        curve = (printed * np.tan(angle))[:, np.newaxis] ** [1, 3, 5] @ np.array(CURVE)
        distortion = rng.normal(curve, SD_READING)
        x, y = np.round(rng.normal(POINT, SD_POINT), 3).tolist()
        found.append(
            Certificate(
                name="rc10-2345",
                camera_type="Wild RC10",
                day=date.fromisoformat(day),
                c=printed,
                autocollimation=(x, y),
                places={"ml": (-110.0, 0.0), "mr": (110.0, 0.0)},
                radial=RadialTable(angle, np.round(distortion, 3), SD_READING),
            )
        )
    return found
