"""A measured projected grid: means of readings, corrected for the coordinatograph."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.arrays import names, number
from photogram.arguments.fields import Checked, array, check_arrays, check_fields
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.summaries import Brief
from photogram.words import phrase

MINUTES_PER_RADIAN = 3437.7468  # CONV of the program, too large by 8.5e-9


def single(values: Floats) -> Floats:
    """Return numbers as REAL*4 words of the System/360: six hex digits, truncated."""
    _, binary = np.frexp(values)
    step = 2.0 ** (4.0 * np.ceil(binary / 4.0) - 24.0)
    found: Floats = np.trunc(values / step) * step
    return found


@dataclass(frozen=True)
class Coordinatograph(Checked):
    """Correction factors of a coordinatograph.

    Attributes
    ----------
    x_scale, y_scale
        Scales of X and Y (XSCAL, YSCAL).
    sine
        Rotation of X from the perpendicular to Y, per unit of Y (SINALP).
    """

    x_scale: float
    y_scale: float
    sine: float

    def correct(self, xy: Floats) -> Floats:
        """Correct the (n, 2) means of a set (specification, 5.3).

        They are relative to the smallest absolute values of X and Y in the set, as in the program. For
        positive coordinates, this is the corner of the grid. X uses the uncorrected Y.
        """
        anchor = np.abs(xy).min(axis=0)
        x, y = (xy - anchor).T
        corrected = np.column_stack([self.x_scale * (x + y * self.sine), y * self.y_scale])
        result: Floats = corrected + anchor
        return result


@dataclass(frozen=True, eq=False, repr=False)
class Grid(Brief):
    """A projected grid of n points: one set of readings.

    Attributes
    ----------
    ids
        n point numbers or names.
    plate_xy
        (n, 2) calibrated coordinates on the plate in millimetres, from the principal point.
    model
        (n, 3) mean coordinates in the model, corrected. The points need not be at one height.
    principal_distance
        Millimetres, positive.
    initial
        (6,) approximations: position in the unit of the model, then omega, phi, kappa in radians; None if
        missing.
    tolerance
        Limit of the iteration as published (GDIF), in the unit of the model.
    readings
        (n,) number of readings of each point; 1 by default.
    reading_sd
        (n, 2) standard deviations of the readings of each point in X and Y; 0 for a single reading.
    corrected
        True if corrected for the coordinatograph.
    title, number
        Title of the job, and number of the set in the job.

    Raises
    ------
    InputError
        If an array has a wrong shape, or a value is not finite.
    """

    ids: Sequence[int | str]
    plate_xy: Floats = field(metadata=array("points", 2, rule="finite"))
    model: Floats = field(metadata=array("points", 3, rule="finite"))
    principal_distance: float
    initial: Floats | None = field(default=None, metadata=array(6, rule="finite"))
    tolerance: float = 0.001
    readings: Indices = field(default_factory=lambda: np.array(1), metadata=array("points"))
    reading_sd: Floats = field(
        default_factory=lambda: np.array(0.0), metadata=array("points", 2, rule="finite")
    )
    corrected: bool = False
    title: str = ""
    number: int = 1

    def __post_init__(self) -> None:
        check_fields(self)
        check_arrays(self, points=len(names("ids", self.ids)))
        readings = self.readings
        good = (readings >= 1) & (readings < 2**53) & (readings == np.trunc(readings))
        if not good.all():
            raise InputError(phrase("projector.readings", value=readings[~good].tolist()[0]))
        object.__setattr__(self, "readings", readings.astype(np.int64))
        number("principal_distance", self.principal_distance, "positive")


def joined(grids: Sequence[Grid]) -> Grid:
    """Join sets of one projector at several heights; names include the set number.

    Raises
    ------
    InputError
        If there is no set, or the principal distances differ.
    """
    if not grids or len({each.principal_distance for each in grids}) != 1:
        raise InputError(phrase("projector.joined"))
    return replace(
        grids[0],
        ids=[f"{name}/{each.number}" for each in grids for name in each.ids],
        plate_xy=np.vstack([each.plate_xy for each in grids]),
        model=np.vstack([each.model for each in grids]),
        readings=np.concatenate([each.readings for each in grids]),
        reading_sd=np.vstack([each.reading_sd for each in grids]),
        corrected=any(each.corrected for each in grids),
        number=1,
    )


@np.errstate(over="ignore", invalid="ignore")
def reduce(
    readings: Sequence[Floats],
    *,
    ids: Sequence[int | str],
    plate_xy: Floats,
    principal_distance: float,
    coordinatograph: Coordinatograph | None = None,
    initial: Floats | None = None,
    tolerance: float = 0.001,
    title: str = "",
    number: int = 1,
) -> Grid:
    """Reduce readings to a grid: means, standard deviations (divisor k - 1), corrections.

    Parameters
    ----------
    readings
        (k, 3) X, Y, Z of the k readings of each point.
    coordinatograph
        Correction factors; None for uncorrected means. Standard deviations always refer to raw readings.
    ids, plate_xy, principal_distance, initial, tolerance, title, number
        As in :class:`Grid`.

    Raises
    ------
    InputError
        If readings have another shape.
    """
    for each in readings:
        if each.ndim != 2 or each.shape[1] != 3 or not len(each):
            raise InputError(phrase("projector.shape", actual=str(each.shape)))
    means = np.array([np.mean(each, axis=0) for each in readings])
    sd = [np.std(each[:, :2], axis=0, ddof=1) if len(each) > 1 else np.zeros(2) for each in readings]
    if coordinatograph is not None:
        means = np.column_stack([coordinatograph.correct(means[:, :2]), means[:, 2]])
    return Grid(
        ids=ids,
        plate_xy=plate_xy,
        model=means,
        principal_distance=principal_distance,
        initial=initial,
        tolerance=tolerance,
        readings=np.array([len(each) for each in readings]),
        reading_sd=np.array(sd),
        corrected=coordinatograph is not None,
        title=title,
        number=number,
    )
