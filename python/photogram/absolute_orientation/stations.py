"""The stations of a model: model coordinates, and known control coordinates."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import names, numbers, shaped, text
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.summaries import Brief
from photogram.words import phrase

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "CONTROL_COLUMNS",
    "CONTROL_SD_COLUMNS",
    "MODEL_COLUMNS",
    "MODEL_SD_COLUMNS",
    "Stations",
    "numbers",
]


CONTROL_COLUMNS = ("X", "Y", "Z")
MODEL_COLUMNS = ("x", "y", "z")
CONTROL_SD_COLUMNS = ("sd_X", "sd_Y", "sd_Z")
MODEL_SD_COLUMNS = ("sd_x", "sd_y", "sd_z")


@dataclass(frozen=True, eq=False, repr=False)
class Stations(Brief):
    """Stations with model and control coordinates; arrays are copied and checked.

    A station without control coordinates is a point to be transformed. The arrays are read-only, so that
    results based on them cannot change.

    Attributes
    ----------
    ids
        (n,) unique identifiers.
    control
        (n, 3) control coordinates X, Y, Z in ground units; NaN if unknown. Each component is independent.
    model
        (n, 3) model coordinates x, y, z in model units.
    control_sd
        Standard deviations of the control in ground units, broadcast to (n, 3): 0 (default) is exact,
        infinite excludes a known coordinate.
    model_sd
        Standard deviations of the model coordinates in model units, broadcast to (n, 3); 0 is exact, if the
        control is not. None if they are equal but unknown; sigma0 is then their estimate.
    ground_unit, model_unit
        Names of the units, for reports.

    Raises
    ------
    InputError
        If shapes differ, a value is not a number, an identifier occurs twice, a model coordinate is not
        finite, a standard deviation is invalid, or a coordinate is exact in both systems.
    """

    ids: Sequence[str]
    control: Floats
    model: Floats
    control_sd: Floats
    model_sd: Floats | None
    ground_unit: str
    model_unit: str

    def __init__(
        self,
        ids: Iterable[object],
        control: ArrayLike,
        model: ArrayLike,
        *,
        control_sd: ArrayLike = 0.0,
        model_sd: ArrayLike | None = None,
        ground_unit: str = "ground unit",
        model_unit: str = "model unit",
    ) -> None:
        found = names("ids", ids)
        shape = len(found), 3
        put = object.__setattr__  # the dataclass is frozen
        put(self, "ids", tuple(found))
        put(self, "control", shaped("control", control, shape, missing=True, one_row=True))
        put(self, "model", shaped("model", model, shape, one_row=True))
        put(self, "control_sd", shaped("control_sd", control_sd, shape, one_row=True))
        if model_sd is not None:
            model_sd = shaped("model_sd", model_sd, shape, one_row=True)
        put(self, "model_sd", model_sd)
        put(self, "ground_unit", text("ground_unit", ground_unit))
        put(self, "model_unit", text("model_unit", model_unit))
        self._check()

    @classmethod
    def from_table(cls, table: pd.DataFrame, **units: str) -> Self:
        """Read a data frame with CSV columns: id, X, Y, Z, x, y, z, and sd_ of each.

        Parameters
        ----------
        table
            `id`, `X`, `Y`, `Z` (NaN if unknown), `x`, `y`, `z`; optionally `sd_X`, `sd_Y`, `sd_Z` (0 if
            missing) and `sd_x`, `sd_y`, `sd_z`.
        units
            `ground_unit`, `model_unit`.

        Raises
        ------
        InputError
            If a column is missing, or the class raises it.
        """
        missing = [name for name in ("id", *CONTROL_COLUMNS, *MODEL_COLUMNS) if name not in table]
        if missing:
            raise InputError(phrase("orientation.missing-columns", names=missing))
        control_sd = [
            table[name].fillna(0.0) if name in table else 0.0 * table["x"] for name in CONTROL_SD_COLUMNS
        ]
        weighted = all(name in table for name in MODEL_SD_COLUMNS)
        return cls(
            table["id"],
            table[list(CONTROL_COLUMNS)],
            table[list(MODEL_COLUMNS)],
            control_sd=np.column_stack(control_sd) if len(table) else 0.0,
            model_sd=table[list(MODEL_SD_COLUMNS)] if weighted else None,
            **units,
        )

    @property
    def given(self) -> Bools:
        """(n, 3) True for known control coordinates."""
        return np.isfinite(self.control)

    @property
    def held(self) -> Bools:
        """(n, 3) True for known control coordinates with finite standard deviations."""
        return self.given & np.isfinite(self.control_sd)

    def _check(self) -> None:
        repeated = [name for name, count in Counter(self.ids).items() if count > 1]
        if repeated:
            raise InputError(phrase("orientation.repeated", station=repeated[0]))
        self._refuse(self.model, ~np.isfinite(self.model), "model-coordinate")
        self._refuse(self.control, np.isinf(self.control), "control-coordinate")
        sd = np.where(self.given, self.control_sd, 0.0)
        self._refuse(sd, ~(sd >= 0), "control-sd")
        if self.model_sd is not None:
            positive = (self.model_sd >= 0) & np.isfinite(self.model_sd)
            self._refuse(self.model_sd, ~positive, "model-sd")
            exact = self.held & (sd == 0) & (self.model_sd == 0).all(axis=1, keepdims=True)
            self._refuse(sd, exact, "exact")
        elif (sd[self.held] > 0).any():
            raise InputError(phrase("orientation.no-model-sd"))

    def _refuse(self, values: Floats, faulty: Bools, code: str) -> None:
        for row, column in np.argwhere(faulty).tolist():
            fields = {"station": self.ids[row], "value": float(values[row, column])}
            raise InputError(phrase(f"orientation.{code}", **fields))
