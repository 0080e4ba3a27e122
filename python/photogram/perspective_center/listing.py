"""The listing of program W5344, item by item (report, Attachment D; section 6).

Columns follow the FORMAT statements of the program's listing. Columns of the input table, whose FORMAT is
lost, follow the sample printout. The first character of a FORTRAN record was its carriage control and was not
printed, so a record begins here with its second.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import fortranformat
import numpy as np

from photogram.errors import RankError
from photogram.perspective_center.deck import Run
from photogram.perspective_center.grid import MINUTES_PER_RADIAN, Grid
from photogram.perspective_center.solution import INTERIOR, NOT_CONVERGED, SINGULAR, PerspectiveCenter

_FIRST = "\f                                            PERSPECTIVE CENTER DETERMINATION\n\n    {}\n"
_FURTHER = "\fDATA SET{:3d}\n"
_CORRECTED = "\n     COORDINATOGRAPH ERRORS CORRECTED\n"
_INPUT = """
     THE NUMBER OF POINTS USED ON THIS PLATE IS{:4d}
    THE ASSUMED PRINCIPAL DISTANCE USED IN THESE COMPUTATIONS IS{:15.3}

     COORDINATES OF INPUT DATA
        NO. OF      CALIBRATED GRID COORD            PROJECTED GRID COORDINATES
PT NO READINGS           X           Y      MEAN X  X STD DEV      MEAN Y  Y STD DEV          Z
"""
_POINT = "{!s:>5}{:9d}{:12.3}{:12.3}{:12.3}{:11.3}{:12.3}{:11.3}{:11.3}\n"
_ITERATIONS = (
    "\nITER         X          Y          Z        DX        DY        DZ     OMEGA       PHI     KAPPA\n"
)
_CYCLE = "{:3d}{:11.2}{:11.2}{:11.2}" + 6 * "{:10.4}" + "\n"
_START = "  0{:11.2}{:11.2}{:11.2}" + 30 * " " + 3 * "{:10.4}" + "\n"
_SHORT = "\n     WITH THIS ITERATION THE SQUARE ROOT OF DX2+DY2+DZ2 IS LESS THAN{:10.3}\n"
_NEGLIGIBLE = "\n     THE CORRECTIONS ARE A NEGLIGIBLE PART OF THE STANDARD ERRORS\n"
_POSITION = """
             COORDINATES OF THE PERSPECTIVE CENTER

          X          Y          Z
   {:11.2}{:11.2}{:11.2}
\f                                          STEREOPLOTTER CALIBRATION INFORMATION
"""
_RESIDUALS = """
     RESIDUAL AND DISTORTION VALUES

POINT  PROJECTED            PROJECTED                 OBSERVED        FIXED          RADIAL
 NO.       X          VX        Y          VY            RADIUS        RADIUS        DISTORTION
"""
_RESIDUAL = "{!s:>4}{:12.3}{:9.3}{:12.3}{:9.3}     {:9.3}     {:9.3}     {:9.3}\n"
_UNIT_WEIGHT = """
 STANDARD ERROR OF UNIT WEIGHT OF PLATE GRID COORDINATES ={:8.5}

     VARIANCE-COVARIANCE MATRIX
"""
_MATRIX_ROW = fortranformat.FortranRecordWriter("(I3,3X,9D15.8)")
_ERRORS = """
 STANDARD ERRORS OF THE PERSPECTIVE CENTER PARAMETERS

             X COORDINATE ={:8.5}
             Y COORDINATE ={:8.5}
             Z COORDINATE ={:8.5}
             OMEGA (MINUTES) ={:8.5}
             PHI (MINUTES) ={:8.5}
             KAPPA (MINUTES) ={:8.5}
             STANDARD ERROR OF PROJECTED COORDINATES IN THE MODEL SPACE ={:8.5}
"""
_VALUE = "             {} ={:11.5}{:11.5}\n"
_DETERMINED = "\n INTERIOR THAT WAS DETERMINED, AND ITS STANDARD ERRORS\n\n"
_INTERIOR = {"c": "PRINCIPAL DISTANCE (MM)", "xp": "PRINCIPAL POINT X (MM)", "yp": "PRINCIPAL POINT Y (MM)"}


def listing(run: Run) -> str:
    """Return the listing of a run; pages begin with form feeds, lines with newlines.

    Without redundancy, a sentence replaces the items that divide by the degrees of freedom.
    """
    text = "".join(
        _head(each.grid.title, each.grid.number) + _input(each.grid) + _solution(each) for each in run.results
    )
    if (stop := run.stop) is None:
        return text
    text += "" if stop.title is None else _head(stop.title, stop.number)
    text += "" if stop.grid is None else _input(stop.grid)
    message = getattr(stop.error, "message", str(stop.error))
    error = SINGULAR if isinstance(stop.error, RankError) else message.partition("; ")[0]  # No remedy
    return f"{text}\n     {error}\n"


def _head(title: str | None, number: int) -> str:
    """Items 1 and 11: the title on the first set of a job, the number on the others."""
    return _FURTHER.format(number) if number > 1 else _FIRST.format(title or "")


def _input(grid: Grid) -> str:
    """Items 2 to 4, and line 0 of item 5."""
    (x, y, z), (sd_x, sd_y) = grid.model.T, grid.reading_sd.T
    text = (_CORRECTED if grid.corrected else "") + _written(_INPUT, len(grid.ids), grid.principal_distance)
    text += _rows(_POINT, grid.ids, grid.readings, grid.plate_xy, x, sd_x, y, sd_y, z) + _ITERATIONS
    if grid.initial is None:
        return text
    return text + _written(_START, grid.initial[:3], grid.initial[3:] * MINUTES_PER_RADIAN)


def _solution(result: PerspectiveCenter) -> str:
    """Items 5 to 10."""
    cycles = enumerate(result.cycles, 1)
    text = "".join(
        _written(_CYCLE, k, each.position, each.correction, each.attitude_minutes) for k, each in cycles
    )
    if not result.converged:
        text += f"\n{NOT_CONVERGED}\n"
    else:
        text += _written(_SHORT, result.grid.tolerance) if result.as_published else _NEGLIGIBLE
        text += _written(_POSITION, result.position)
    (x, y), (vx, vy) = result.projected.T, result.residual.T
    radii = result.observed_radius, result.fixed_radius, result.radial_distortion
    text += _RESIDUALS + _rows(_RESIDUAL, result.grid.ids, x, vx, y, vy, *radii)
    covariance, errors = result.covariance, result.interior_errors
    if covariance is None or errors is None:
        return f"{text}\n NO REDUNDANCY - THERE ARE NO STANDARD ERRORS\n"
    text += _written(_UNIT_WEIGHT, result.sigma0_plate)
    text += "".join(f"{_MATRIX_ROW.write([k, *row.tolist()])}\n" for k, row in enumerate(covariance, 1))
    text += _written(_ERRORS, result.standard_errors, result.sigma0_model)
    names = [_INTERIOR[name] for name in result.unknown]
    values = result.interior[[INTERIOR.index(name) for name in result.unknown]]
    return text + (_DETERMINED if names else "") + _rows(_VALUE, names, values, errors)


def _rows(form: str, *columns: Iterable[Any]) -> str:
    return "".join(_written(form, *row) for row in zip(*columns, strict=True))


def _written(form: str, *values: Any) -> str:
    """Fill a form with numbers, arrays and names."""
    flat = [one for each in values for one in (each.tolist() if isinstance(each, np.ndarray) else [each])]
    return form.format(*(_Fixed(one) if isinstance(one, float) else one for one in flat))


class _Fixed(float):
    """A number in IBM's Fw.d: 0.0 for an exact zero, asterisks for overflow."""

    def __format__(self, form: str) -> str:
        width, decimals = map(int, form.split("."))
        text = "0.0" if not self else f"{float(self):.{decimals}f}"
        return f"{text:>{width}}" if len(text) <= width else "*" * width
