"""What a correction was calibrated on, when, and over which range of readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.comparator.polynomial import Frame
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.readings import Session

__all__ = ["Identity"]


@dataclass(frozen=True)
class Identity:
    """Whose a correction is.

    Attributes
    ----------
    comparator, secondary
        Number of the comparator; whether it is the right stage of a stereocomparator.
    date
        Of the measurement, as text.
    plates
        Numbers of the plates.
    cases
        How many cases there were.
    temperature_c
        Of the plates, degrees Celsius; None where it is not known.
    low_um, high_um
        Least and largest mean readings, x and y: within them the correction was calibrated.
    """

    comparator: int
    secondary: bool
    date: str
    plates: tuple[int, ...]
    cases: int
    temperature_c: float | None
    low_um: tuple[float, float]
    high_um: tuple[float, float]

    @classmethod
    def of(cls, session: Session, means_um: Sequence[Floats]) -> Identity:
        """Return that of a session and the mean readings (n, 2) of its cases."""
        readings = np.vstack(means_um)
        (low_x, low_y), (high_x, high_y) = readings.min(axis=0).tolist(), readings.max(axis=0).tolist()
        return cls(
            session.comparator,
            session.secondary,
            session.date,
            tuple(dict.fromkeys(case.plate for case in session.cases)),
            len(session.cases),
            session.temperature_c,
            (low_x, low_y),
            (high_x, high_y),
        )

    @property
    def frame(self) -> Frame:
        """The calibrated range: arguments of readings from -1 to 1 lie in it."""
        return Frame.of(np.array([self.low_um, self.high_um]))

    @property
    def range_text(self) -> str:
        """The calibrated range, as a reader is told."""
        (low_x, low_y), (high_x, high_y) = self.low_um, self.high_um
        return f"x {low_x:.0f} to {high_x:.0f}, y {low_y:.0f} to {high_y:.0f} um"

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Identity:
        """Return what the fields of a JSON document describe.

        Raises
        ------
        KeyError, TypeError, ValueError
            It is no such document.
        """
        numbers = np.array([document["low_um"], document["high_um"]], dtype=float)
        if numbers.shape != (2, 2) or not (numbers[0] < numbers[1]).all():
            raise InputError("low_um and high_um are no range of readings")
        low, high = ((float(x), float(y)) for x, y in numbers)
        temperature = document["temperature_c"]
        return cls(
            int(document["comparator"]),
            bool(document["secondary"]),
            str(document["date"]),
            tuple(int(plate) for plate in document["plates"]),
            int(document["cases"]),
            None if temperature is None else float(temperature),
            low,
            high,
        )
