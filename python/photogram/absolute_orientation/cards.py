"""Stations, results and transformations in the card order of TB 19, section 7.

The bulletin does not define the format of the cards. Here a record is a line of words, separated by blanks or
by commas. A missing control coordinate is a word `-`, or nothing between two commas.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.stations import Stations
from photogram.arguments.arrays import truth_value
from photogram.arguments.objects import path_of
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number, whole_number
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.geometry import rotation_matrix
from photogram.words import phrase

MISSING = ("", "-")


@dataclass(frozen=True, eq=False)
class Deck:
    stations: Stations  # The station records
    former: Similarity | None  # The approximate parameters of the first record; None if its words are zeros
    identification: str  # The last word of the constants
    messages: list[Message] = field(default_factory=list)  # Warnings on the records


class _Record(Place):
    def words(self, least: int, most: int, what: str) -> list[str]:
        """Split into words; words between two commas may be empty."""
        text = self.text or ""
        split = text.split(",") if "," in text else text.split()
        words = [word.strip() for word in split]
        if not least <= len(words) <= most:
            counts = sorted({least, most})
            raise self.error(phrase("orientation.words", subject=what, counts=counts, value=len(words)))
        return words

    def number_of(self, word: str, what: str) -> float:
        """Read a number with the exponent letter D or E."""
        try:
            return finite_number(word.upper().replace("D", "E"))
        except ValueError:
            raise self.error(phrase("orientation.number", subject=what, value=word)) from None

    def count_of(self, word: str, what: str) -> int:
        try:
            return whole_number(word)
        except ValueError:
            raise self.error(phrase("orientation.count", subject=what, value=word)) from None


def read_cards(
    path: Path,
    *,
    zero_missing: bool = False,
    ground_unit: str = "ground unit",
    model_unit: str = "model unit",
) -> Deck:
    """Read the cards of part I: approximate parameters, constants, stations.

    Record 1: sin omega, sin phi, sin kappa, s, b1, b2, b3, identification; all zeros without approximation.
    Record 2: M, N, MN, identification. Then M records X1 X2 X3 x1 x2 x3 number.

    Parameters
    ----------
    path
        The file.
    zero_missing
        True if a control coordinate of zero means a missing one, as in the bulletin.
    ground_unit, model_unit
        Names of the units.

    Raises
    ------
    InputError
        If the file cannot be read, a record has other words, or the counts M, N, MN differ from the stations.
        The message contains file, record and text.
    """
    truth_value("zero_missing", zero_missing)
    path = path_of("path", path)
    records = _records(path)
    if len(records) < 2:
        raise InputError(phrase("orientation.deck", count=len(records)), file=path)
    constants = records[1].words(3, 4, "constants M, N, MN and identification")
    m, n, mn = (records[1].count_of(w, name) for w, name in zip(constants, ("M", "N", "MN"), strict=False))
    if len(records) - 2 != m:
        raise records[1].error(phrase("orientation.m", m=m, n=len(records) - 2))
    stations = _stations(path, records[2:], zero_missing, ground_unit, model_unit)
    pairs, elevations = int(stations.given[:, :2].all(axis=1).sum()), int(stations.given[:, 2].sum())
    if (elevations, pairs) != (n, mn):
        raise records[1].error(phrase("orientation.counts", n=n, mn=mn, elevations=elevations, pairs=pairs))
    messages: list[Message] = []
    former = _former(records[0], stations, messages)
    identification = constants[3] if len(constants) > 3 else ""
    return Deck(stations, former, identification, messages)


def _records(path: Path) -> list[_Record]:
    lines = enumerate(read_lines(path), 1)
    return [_Record(path, number, text) for number, text in lines if text.strip()]


def _stations(
    path: Path, records: list[_Record], zero_missing: bool, ground_unit: str, model_unit: str
) -> Stations:
    control, model = [], []
    ids: dict[str, None] = {}
    for record in records:
        words = record.words(7, 7, "station X1 X2 X3 x1 x2 x3 number")
        row = [
            math.nan if word in MISSING else record.number_of(word, f"X{k}")
            for k, word in enumerate(words[:3], 1)
        ]
        control.append([math.nan if zero_missing and value == 0 else value for value in row])
        model.append([record.number_of(word, f"x{k}") for k, word in enumerate(words[3:6], 1)])
        if words[6] in ids:
            raise record.error(phrase("orientation.repeated", station=words[6]))
        ids[words[6]] = None
    with at_place(Place(path)):
        return Stations(
            ids,
            np.array(control).reshape(-1, 3),
            np.array(model).reshape(-1, 3),
            ground_unit=ground_unit,
            model_unit=model_unit,
        )


def read_restart(path: Path, stations: Stations, messages: list[Message]) -> Similarity | None:
    """Read a restart record (TB 19, step 12): eight words for a new solution."""
    records = _records(path)
    if len(records) != 1:
        raise InputError(phrase("orientation.restart", count=len(records)), file=path)
    return _former(records[0], stations, messages)


def _former(record: _Record, stations: Stations, messages: list[Message]) -> Similarity | None:
    """Read the parameters of a previous result; None if all are zero."""
    words = record.words(7, 8, "parameters sin omega, sin phi, sin kappa, s, b1, b2, b3, identification")
    values = np.array([record.number_of(word, "parameter") for word in words[:7]])
    if not values.any():
        return None
    if (largest := max(values[:3], key=abs)) ** 2 > 1:
        raise record.error(phrase("orientation.sine", value=float(largest)))
    if values[3] <= 0:
        raise record.error(phrase("error.at", what="s", message=phrase("error.positive", value=values[3])))
    angles = np.arcsin(values[:3])
    kappa = _kappa(stations)
    if kappa is None:
        messages.append(record.message(phrase("orientation.kappa")))
    elif math.cos(kappa) < 0:
        angles[2] = math.pi - angles[2]
    return Similarity.from_parameters(values[3], rotation_matrix(angles[np.newaxis])[0], values[4:])


def _kappa(stations: Stations) -> float | None:
    """Return kappa = theta_X - theta_x of two stations; None without plan."""
    if len(stations.ids) < 2 or not stations.given[:2, :2].all():
        return None
    ground, model = (array[1, :2] - array[0, :2] for array in (stations.control, stations.model))
    return math.atan2(ground[1] * model[0] - ground[0] * model[1], float(ground @ model))


def restart_record(similarity: Similarity, identification: str) -> str:
    """Return record 1 of part I for a new solution: sines, s, B, identification."""
    values = [*np.sin(similarity.angles), similarity.scale, *similarity.translation]
    return _record(values, identification)


def transformation_records(similarity: Similarity, identification: str) -> list[str]:
    """Return the two records of part II: a11 ... a23, then a31 a32 a33 s b1 b2 b3."""
    a = similarity.rotation.ravel()
    last = [*a[6:], similarity.scale, *similarity.translation]
    return [_record(a[:6], identification), _record(last, identification)]


def _record(values: list[float] | Floats, identification: str) -> str:
    if len(identification.replace(",", " ").split()) > 1:
        raise InputError(phrase("orientation.identification", value=identification))
    return " ".join([*(f"{value:.17g}" for value in values), identification or "0"])


def read_transformation(path: Path) -> Similarity:
    """Read the two records of part II; their covariance is unknown."""
    records = _records(path)
    if len(records) < 2:
        raise InputError(phrase("orientation.transformation", count=len(records)), file=path)
    first = records[0].words(6, 7, "a11 a12 a13 a21 a22 a23, identification")
    second = records[1].words(7, 8, "a31 a32 a33 s b1 b2 b3, identification")
    values = [
        *(records[0].number_of(word, "direction cosine") for word in first[:6]),
        *(records[1].number_of(word, "parameter") for word in second[:7]),
    ]
    with at_place(Place(path)):
        return Similarity.from_parameters(values[9], np.reshape(values[:9], (3, 3)), values[10:])
