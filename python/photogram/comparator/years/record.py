"""Calibration record of a comparison, read from its JSON document."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.arguments.fields import Checked
from photogram.arguments.types import Floats, Indices
from photogram.comparator.calibration import Calibration
from photogram.comparator.correction import Correction
from photogram.comparator.grid import Grid
from photogram.errors import InputError
from photogram.io import json
from photogram.io.files import read_bytes
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase

ISO = re.compile(r"(\d{4})-(\d{1,2})-(\d{1,2})$")
OF_THE_REPORT = re.compile(r"(\d{1,2})/(\d{1,2})/(\d{2}|\d{4})$")
_WHAT = "calibration of a comparator"
FIRST_YEAR = 50  # Two-digit years from this one on are in the 20th century, earlier ones in the 21st


@dataclass(frozen=True, eq=False)
class RecordedCase(Checked):
    """Mean readings of a case, and the plate orientation.

    Attributes
    ----------
    number, operator, plate, left_handed
        Numbers and handedness of the case.
    points, counts
        (n,) grid points, and number of readings of each.
    means_um
        (n, 2) mean readings.
    rotation_rad, translation_um
        grid = M(rotation) corrected + translation, from the joint adjustment.
    """

    number: int
    operator: int
    plate: int
    left_handed: bool
    points: Indices
    counts: Indices
    means_um: Floats
    rotation_rad: float
    translation_um: Floats

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.means_um.shape != (len(self.points), 2):
            name = phrase("comparators.case", case=self.number)
            shape = str(self.means_um.shape)
            wrong = phrase("comparators.grid-shape", count=len(self.points), shape=shape)
            raise InputError(phrase("error.at", what=name, message=wrong))


@dataclass(frozen=True, eq=False)
class RecordedCalibration(Checked):
    """Calibration record with measurements and joint correction.

    Attributes
    ----------
    name
        Name of its file, or its index among the calibrations.
    day
        Date of the measurement.
    correction
        Correction of the joint adjustment, with its identity.
    random_um, freedom
        Standard deviation of the comparator, degrees of freedom of the joint adjustment.
    pointing_um, pointing_covariance_um2, pointing_freedom
        Standard deviations of a pointing in x and y, their covariance, degrees of freedom.
    operators
        For each operator: variances of a pointing in x and y (um^2), and their degrees of freedom.
    cases
        The cases.
    grids
        Plates with given coordinates of measured points.
    """

    name: str
    day: date
    correction: Correction
    random_um: float = field(metadata={"low": 0, "open": True})
    freedom: int = field(metadata={"low": 1, "open": False})
    pointing_um: tuple[float, float]
    pointing_covariance_um2: float
    pointing_freedom: int
    operators: Mapping[int, tuple[float, float, int]]
    cases: tuple[RecordedCase, ...]
    grids: Mapping[int, Grid]

    @property
    def comparator(self) -> str:
        """Name of the comparator."""
        identity = self.correction.identity
        assert identity is not None
        return f"comparator {identity.comparator}{', second stage' if identity.secondary else ''}"

    @property
    def temperature_c(self) -> float | None:
        """Temperature of the plates."""
        return self.correction.identity.temperature_c if self.correction.identity else None

    @classmethod
    def read(cls, path: Path) -> list[RecordedCalibration]:
        """Read one or several calibrations from a file of `photogram comparator --json`.

        Raises
        ------
        InputError
            If the file cannot be read or does not contain a calibration. If a calibration was withheld, or if
            it has neither joint adjustment nor date.
        """
        with json.holding(_WHAT, path):
            found = orjson.loads(read_bytes(path))
            many = found if isinstance(found, list) else [found]
            names = [path.stem] if len(many) == 1 else [f"{path.stem}-{k + 1}" for k in range(len(many))]
            return [_from_document(each, name) for each, name in zip(many, names, strict=True)]

    @classmethod
    def of(cls, calibration: Calibration, name: str) -> RecordedCalibration:
        """Return the record of a calibration."""
        with json.holding(_WHAT):
            return _from_document(orjson.loads(calibration.to_json()), name)


def day_of(text: str) -> date:
    """Return the date of a text: 1972-07-17, or 7/17/72 as in the report."""
    year = month = day = 0
    if match := ISO.match(text.strip()):
        year, month, day = map(int, match.groups())
    elif match := OF_THE_REPORT.match(text.strip()):
        month, day, year = map(int, match.groups())
        if len(match[3]) == 2:
            year += 1900 if year >= FIRST_YEAR else 2000
    try:
        return date(year, month, day)
    except ValueError:
        raise InputError(phrase("comparators.date", date=text)) from None


def _from_document(document: Any, name: str) -> RecordedCalibration:
    if document.get("usable") is False:
        raise InputError(phrase("comparators.withheld"))
    joint = document["joint"]
    if joint is None or joint["correction"] is None:
        raise InputError(phrase("comparators.no-joint"))
    correction = Correction.from_document(joint["correction"])
    if correction.identity is None:
        raise InputError(phrase("comparators.no-identity"))
    counts = {(each["case"], each["point"]): each["readings"] for each in document["pointing"]["points"]}
    total = document["pointing"]["total"]
    freedom = total["degrees_of_freedom"]
    placed = {each["case"]: each for each in joint["cases"]}
    grids = {
        plate["plate"]: _grid(plate, own)
        for plate, own in zip(document["plates"], joint["plates"], strict=True)
    }
    cases = tuple(
        RecordedCase(
            number=each["case"],
            **{name: each[name] for name in ("operator", "plate", "left_handed", "points", "means_um")},
            counts=np.array([counts[each["case"], point] for point in each["points"]], dtype=np.int64),
            rotation_rad=placed[each["case"]]["rotation_rad"],
            translation_um=placed[each["case"]]["translation_um"],
        )
        for each in document["cases"]
    )
    for case in cases:
        if (missing := np.setdiff1d(case.points, grids[case.plate].points)).size:
            raise InputError(phrase("comparators.no-point", plate=case.plate, point=int(missing[0])))
    operators = {}
    for each in document["pointing"]["operators"]:
        if (own := each["degrees_of_freedom"]) > 0:
            x, y = each["sd_um"]
            operators[int(each["operator"])] = (x**2, y**2, own)
    return RecordedCalibration(
        name=name,
        day=day_of(str(document["date"])),
        correction=correction,
        random_um=joint["sigma_random_um"],
        freedom=joint["degrees_of_freedom"],
        pointing_um=total["sd_um"] if freedom > 0 else (0.0, 0.0),
        pointing_covariance_um2=total["covariance_um2"] or 0.0,
        pointing_freedom=freedom,
        operators=operators,
        cases=cases,
        grids=grids,
    )


def _grid(plate: Any, own: Any) -> Grid:
    """Return a plate as given: corrected coordinates minus corrections."""
    given = np.array(plate["corrected_plate_um"]) - np.array(plate["corrections_plate_um"])
    sigma = plate["sigma_um"]["a_priori"]
    return Grid(
        number=int(plate["plate"]),
        points=np.array(plate["points"], dtype=np.int64),
        xy_um=given,
        sigma_um=float(own["sigma_um"] if sigma is None else sigma),
        adopted=str(plate["adopted"]),
        temperature_c=plate["temperature_c"],
        expansion_per_k=plate["expansion_per_k"],
    )
