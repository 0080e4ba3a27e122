"""The listing of program W5344, item by item (report, Attachment D; specification, section 6).

Columns follow the FORMAT statements of the program's listing; those of the input table, which are lost, the
sample printout. The first character of a FORTRAN record was its carriage control and was not printed: a
record begins here with its second.
"""

from __future__ import annotations

from collections.abc import Sequence

import fortranformat
import numpy as np

from photogram.errors import RankError
from photogram.perspective_center.batch import Run, Stop
from photogram.perspective_center.grid import MINUTES_PER_RADIAN, Grid
from photogram.perspective_center.solution import INTERIOR, SINGULAR, PerspectiveCenter

NEW_PAGE = "\f"
NOT_CONVERGED = "SORRY - SOLUTION DOES NOT CONVERGE"
_MATRIX_ROW = fortranformat.FortranRecordWriter("(I3,3X,9D15.8)")
_INTERIOR = {"c": "PRINCIPAL DISTANCE (MM)", "xp": "PRINCIPAL POINT X (MM)", "yp": "PRINCIPAL POINT Y (MM)"}


def listing(run: Run) -> str:
    """Return the listing of a run: pages begin with a form feed, lines end with a newline.

    Where there is no redundancy, the items that divide by the degrees of freedom say so instead.
    """
    lines = []
    for result in run.results:
        lines += _head(result.grid.title, result.grid.number)
        lines += [*_input(result.grid), *_iteration(result), *_residuals(result), *_errors(result)]
    if run.stop is not None:
        lines += _stop(run.stop)
    return "".join(f"{line}\n" for line in lines)


def _head(title: str | None, number: int) -> list[str]:
    """Items 1 and 11: the title on the first set of a job, the number on the others."""
    if number > 1:
        return [f"{NEW_PAGE}DATA SET{number:3d}"]
    return [f"{NEW_PAGE}{'':44}PERSPECTIVE CENTER DETERMINATION", "", f"{'':4}{title or ''}"]


def _input(grid: Grid) -> list[str]:
    """Items 2 to 4, and line 0 of item 5."""
    lines = ["", f"{'':5}COORDINATOGRAPH ERRORS CORRECTED"] if grid.corrected else []
    lines += [
        "",
        f"{'':5}THE NUMBER OF POINTS USED ON THIS PLATE IS{len(grid.ids):4d}",
        f"{'':4}THE ASSUMED PRINCIPAL DISTANCE USED IN THESE COMPUTATIONS IS"
        f"{_f(grid.principal_distance, 15)}",
        "",
        f"{'':5}COORDINATES OF INPUT DATA",
        f"{'':8}NO. OF{'CALIBRATED GRID COORD':>27}{'PROJECTED GRID COORDINATES':>38}",
        "PT NO READINGS"
        f"{'X':>12}{'Y':>12}{'MEAN X':>12}{'X STD DEV':>11}{'MEAN Y':>12}{'Y STD DEV':>11}{'Z':>11}",
    ]
    rows = zip(grid.ids, grid.readings, grid.plate_xy, grid.model, grid.reading_sd, strict=True)
    for name, readings, (x, y), (mean_x, mean_y, z), (sd_x, sd_y) in rows:
        lines.append(
            f"{name!s:>5}{readings:9d}{_f(x, 12)}{_f(y, 12)}{_f(mean_x, 12)}{_f(sd_x, 11)}{_f(mean_y, 12)}"
            f"{_f(sd_y, 11)}{_f(z, 11)}"
        )
    heads = "".join(f"{name:>10}" for name in ("DX", "DY", "DZ", "OMEGA", "PHI", "KAPPA"))
    lines += ["", f"ITER{'X':>10}{'Y':>11}{'Z':>11}{heads}"]
    if grid.initial is not None:
        lines.append(
            f"  0{_f(grid.initial[:3], 11, 2)}{'':30}{_f(grid.initial[3:] * MINUTES_PER_RADIAN, 10, 4)}"
        )
    return lines


def _iteration(result: PerspectiveCenter) -> list[str]:
    """Items 5 and 6."""
    lines = [
        f"{number:3d}{_f(cycle.position, 11, 2)}{_f(cycle.correction, 10, 4)}"
        f"{_f(cycle.attitude_minutes, 10, 4)}"
        for number, cycle in enumerate(result.cycles, 1)
    ]
    if not result.converged:
        return [*lines, "", NOT_CONVERGED]
    if result.as_published:
        lines += [
            "",
            f"{'':5}WITH THIS ITERATION THE SQUARE ROOT OF DX2+DY2+DZ2 IS LESS THAN"
            f"{_f(result.grid.tolerance, 10)}",
        ]
    else:
        lines += ["", f"{'':5}THE CORRECTIONS ARE A NEGLIGIBLE PART OF THE STANDARD ERRORS"]
    return [
        *lines,
        "",
        f"{'':13}COORDINATES OF THE PERSPECTIVE CENTER",
        "",
        f"{'X':>11}{'Y':>11}{'Z':>11}",
        f"{'':3}{_f(result.position, 11, 2)}",
        f"{NEW_PAGE}{'':42}STEREOPLOTTER CALIBRATION INFORMATION",
    ]


def _residuals(result: PerspectiveCenter) -> list[str]:
    """Item 7."""
    lines = [
        "",
        f"{'':5}RESIDUAL AND DISTORTION VALUES",
        "",
        f"POINT{'PROJECTED':>11}{'PROJECTED':>21}{'OBSERVED':>25}{'FIXED':>13}{'RADIAL':>16}",
        f" NO.{'X':>8}{'VX':>12}{'Y':>9}{'VY':>12}{'RADIUS':>18}{'RADIUS':>14}{'DISTORTION':>18}",
    ]
    rows = zip(
        result.grid.ids,
        result.projected,
        result.residual,
        np.column_stack([result.observed_radius, result.fixed_radius, result.radial_distortion]),
        strict=True,
    )
    for name, (x, y), (vx, vy), radii in rows:
        on_plate = "".join(f"{_f(value, 9)}{'':5}" for value in radii).rstrip()
        lines.append(f"{name!s:>4}{_f(x, 12)}{_f(vx, 9)}{_f(y, 12)}{_f(vy, 9)}{'':5}{on_plate}")
    return lines


def _errors(result: PerspectiveCenter) -> list[str]:
    """Items 8 to 10."""
    covariance, errors = result.covariance, result.standard_errors
    if covariance is None or errors is None or result.sigma0_plate is None or result.sigma0_model is None:
        return ["", " NO REDUNDANCY - THERE ARE NO STANDARD ERRORS"]
    names = ["X COORDINATE", "Y COORDINATE", "Z COORDINATE"]
    names += ["OMEGA (MINUTES)", "PHI (MINUTES)", "KAPPA (MINUTES)"]
    names.append("STANDARD ERROR OF PROJECTED COORDINATES IN THE MODEL SPACE")
    return [
        "",
        f" STANDARD ERROR OF UNIT WEIGHT OF PLATE GRID COORDINATES ={_f(result.sigma0_plate, 8, 5)}",
        "",
        f"{'':5}VARIANCE-COVARIANCE MATRIX",
        *(_MATRIX_ROW.write([number, *row.tolist()]) for number, row in enumerate(covariance, 1)),
        "",
        " STANDARD ERRORS OF THE PERSPECTIVE CENTER PARAMETERS",
        "",
        *(
            f"{'':13}{name} ={_f(value, 8, 5)}"
            for name, value in zip(names, [*errors, result.sigma0_model], strict=True)
        ),
        *_interior(result),
    ]


def _interior(result: PerspectiveCenter) -> list[str]:
    """Say what of the interior, which the program holds, was unknown, with its standard errors."""
    if result.interior_errors is None or not result.unknown:
        return []
    values = dict(zip(INTERIOR, result.interior.tolist(), strict=True))
    return [
        "",
        " INTERIOR THAT WAS DETERMINED, AND ITS STANDARD ERRORS",
        "",
        *(
            f"{'':13}{_INTERIOR[name]} ={_f(values[name], 11, 5)}{_f(error, 11, 5)}"
            for name, error in zip(result.unknown, result.interior_errors.tolist(), strict=True)
        ),
    ]


def _stop(stop: Stop) -> list[str]:
    """Return what was printed before the program stopped, and its message."""
    error = stop.error
    text = SINGULAR if isinstance(error, RankError) else getattr(error, "message", str(error))
    lines = _head(stop.title, stop.number) if stop.title is not None else []
    return [*lines, *(_input(stop.grid) if stop.grid is not None else []), "", f"{'':5}{text}"]


def _f(values: float | np.floating | Sequence[float] | np.ndarray, width: int, decimals: int = 3) -> str:
    """Write numbers as IBM's Fw.d did: an exact zero is 0.0, a small negative number keeps its sign."""
    text = ""
    for value in np.atleast_1d(values):
        number = f"{'0.0' if value == 0 else f'{value:.{decimals}f}':>{width}}"
        text += number if len(number) == width else "*" * width
    return text
