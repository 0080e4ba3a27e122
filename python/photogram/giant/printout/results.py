"""The adjustment: corrections of stations, residuals (sample, pages 25-29)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.giant.printout.forms import (
    MATRIX,
    VALUE,
    Page,
    Space,
    Values,
    attitude,
    attitude_name,
    counts_and_rms,
    fixed,
    headed,
    matrix_rows,
    paginate,
)
from photogram.results.parts import Iteration, SumsByKind

CORRECTIONS = "CAMERA STATIONS CORRECTIONS"


def iteration_pages(
    space: Space,
    names: Sequence[str],
    iterations: Sequence[Iteration],
    corrections: Floats,
    notice: str,
    *,
    as_published: bool = False,
) -> list[Page]:
    """Return pages of k iterations with corrections (k, P, 6), radians.

    The notice is below the last one; the published form lacks the line with the units.
    """
    if not iterations:
        return [[*headed(CORRECTIONS), notice]]
    pages = []
    for iteration, values in zip(iterations, corrections.tolist(), strict=True):
        heading = headed(
            CORRECTIONS,
            f"ITERATION {iteration.number}",
            *([] if as_published else ["", f"POSITION ({space.units}), ATTITUDE (RADIANS)"]),
        )
        closing = [
            "",
            f"PROVISIONAL WEIGHTED SUM OF SQUARES ={fixed(iteration.weighted_sum_of_squares, 16, 3)}",
        ]
        if notice and iteration is iterations[-1]:
            closing += ["", notice]
        rows = [[_line(name, row)] for name, row in zip(names, values, strict=True)]
        pages += paginate(heading, rows, closing=closing)
    return pages


def _line(name: str, row: Sequence[float]) -> str:
    position, attitude = _numbers(row[:3]), _numbers(row[3:])
    return f"{name:<10}POSITION{position}     ATTITUDE{attitude}"


def _numbers(values: Values) -> str:
    return "".join(fixed(value, 16, 9) for value in values)


FRAMES_ACROSS = 10  # Frames per line


Residuals = tuple[str, Sequence[str], Floats]
"""A point, its k frames, and its residuals (k, 2), observed minus computed, mm."""


def residual_pages(
    points: Iterable[Residuals], limit: float, closing: Sequence[str], *, as_published: bool = False
) -> list[Page]:
    """Return the pages of residuals, with `closing` (:func:`statistics`) below.

    COMMON columns 41-50 are the limit: 0 selects all points, more those with a residual beyond it, less none.
    The published form lacks the definition of the residuals.
    """
    meaning = "OBSERVED MINUS COMPUTED, MICROMETERS; X ABOVE Y".center(132).rstrip()
    heading = headed("TRIANGULATED POINTS RESIDUALS", *([] if as_published else [meaning]))
    listed = (each for each in points if limit == 0 or (limit > 0 and (abs(each[2]) > limit).any()))
    return paginate(heading, (entry for each in listed for entry in _entries(*each)), closing=closing)


def _entries(name: str, frames: Sequence[str], residuals: Floats) -> Iterator[list[str]]:
    for row in range(0, len(frames), FRAMES_ACROSS):
        own = slice(row, row + FRAMES_ACROSS)
        values = ["".join(fixed(value, 12, 0) for value in axis) for axis in 1000 * residuals[own].T]
        names = "".join(f"{frame:>12}" for frame in frames[own])
        yield [f"{'' if row else name:<10}{names}", *(f"{'':10}{line}" for line in values), ""]


def statistics(sums: SumsByKind, degrees_of_freedom: float, variance: float | None) -> list[str]:
    """Return weighted sums of squares and estimates of unit weight."""
    parts = {"CAMERA": sums.camera, "GROUND": sums.ground, "PLATES": sums.plates, "TOTAL": sums.total}
    lines = [
        f"{f'WEIGHTED SUM OF SQUARES ({name})':<40} ={fixed(size, 16, 3)}" for name, size in parts.items()
    ]
    estimates = {"VARIANCE": variance, "ST. DEV.": None if variance is None else math.sqrt(variance)}
    return [
        "",
        *lines,
        f"{'DEGREES OF FREEDOM':.<40} ={degrees_of_freedom:>12.0f}",
        "",
        "A POSTERIORI ESTIMATES FOR UNIT WEIGHT",
        *(
            f"{name:>40} ={'UNDEFINED'.rjust(16) if value is None else fixed(value, 16, 3)}"
            for name, value in estimates.items()
        ),
    ]


POSITION, ATTITUDE = VALUE + 5, VALUE + 7  # Columns of `LNG =` and `OMEGA =` with their values


def station_pages(
    space: Space,
    photo_to_ground: bool,
    names: Sequence[str],
    positions: Floats,
    attitudes: Floats,
    covariances: Floats | None,
) -> list[Page]:
    """Return pages of P stations, with (P, 6, 6) covariances if available."""
    matrix = "" if covariances is None else f"{'COVARIANCE MATRIX':^{MATRIX}}"
    heading = headed(
        "TRIANGULATED CAMERA STATIONS",
        f"{'IDENT':<10}{'POSITION':^{POSITION}}{matrix}"
        f"   {f'ATT({attitude_name(photo_to_ground)})':^{ATTITUDE}}{matrix}".rstrip(),
    )
    entries = []
    for photo, name in enumerate(names):
        covariance = None if covariances is None else covariances[photo]
        rows = zip(
            ("", name, ""),
            space.names,
            space.values(positions[photo], 4),
            matrix_rows(None if covariance is None else covariance[:3, :3]),
            ("OMEGA", "PHI", "KAPPA"),
            attitude(attitudes[photo]),
            matrix_rows(None if covariance is None else covariance[3:, 3:]),
            strict=True,
        )
        lines = [
            f"{ident:<10}{axis} ={value}{matrix}   {angle:<5} ={turn}{turn_matrix}"
            for ident, axis, value, matrix, angle, turn, turn_matrix in rows
        ]
        entries.append([*lines, ""])
    return paginate(heading, entries)


TITLE = "TRIANGULATED GROUND POINTS"
IDENT = 18  # Columns of the name and the mark of control


def point_pages(space: Space, names: Sequence[str], marks: Sequence[str], positions: Floats) -> list[Page]:
    """Return pages of n points without error propagation, 52 per page.

    Marks are `*code*` for control, otherwise empty.
    """
    heading = headed(TITLE, f"{'IDENT':<{IDENT}}{'POSITION':^72}".rstrip())
    return paginate(
        heading,
        (
            [_ident(name, mark) + "   ".join(_labelled(space, space.values(position, 3)))]
            for name, mark, position in zip(names, marks, positions.tolist(), strict=True)
        ),
    )


def propagated_point_pages(
    space: Space,
    names: Sequence[str],
    marks: Sequence[str],
    positions: Floats,
    covariances: Floats,
    held: Bools,
) -> list[Page]:
    """Return pages of points with covariances (n, 3, 3), and a summary.

    The summary contains unheld components (n, 3) only.
    """
    heading = headed(
        TITLE,
        f"{'IDENT':<{IDENT}}{'POSITION':^{POSITION}}{'COVARIANCE MATRIX':^{MATRIX}}"
        f"   {'STANDARD DEV':^{VALUE}}".rstrip(),
    )
    deviations = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    entries = []
    points = zip(names, marks, positions.tolist(), covariances, deviations.tolist(), strict=True)
    for name, mark, position, covariance, point_sd in points:
        rows = zip(
            ("", _ident(name, mark), ""),
            _labelled(space, space.values(position, 4)),
            matrix_rows(covariance),
            space.values(point_sd, 4),
            strict=True,
        )
        lines = [f"{ident:<{IDENT}}{value}{matrix}   {sd}" for ident, value, matrix, sd in rows]
        entries.append([*lines, ""])
    return paginate(heading, entries, closing=_summary(space, deviations, ~held))


def _ident(name: str, mark: str) -> str:
    return f"{f'{name:<10}{mark}':<{IDENT}}"


def _labelled(space: Space, values: Iterable[str]) -> list[str]:
    return [f"{name} ={value}" for name, value in zip(space.names, values, strict=True)]


def _summary(space: Space, deviations: Floats, counted: Bools) -> list[str]:
    counts, rms = counts_and_rms(deviations, counted)
    rows = zip(counts, _labelled(space, space.values(rms, 4)), strict=True)
    return [
        "SUMMARY STATISTICS FOR GROUND POINTS",
        "RMS FOR STANDARD DEVIATIONS",
        "",
        *(f"COUNT ={count:>7d}     {value}" for count, value in rows),
    ]


POINTS_ACROSS = 4  # Points per line


def correction_pages(
    space: Space, names: Sequence[str], corrections: Floats, held: Bools, *, as_published: bool
) -> list[Page]:
    """Return pages of corrections (n, 3) with held components; NaN if missing.

    The published form has neither a definition of the corrections nor number and rms of unheld components.
    """
    meaning = "ADJUSTED MINUS INPUT; IN PARENTHESES: COMPONENT NOT HELD, ADJUSTED MINUS SUPPLIED VALUE"
    heading = headed("CORRECTIONS APPLIED TO GROUND CONTROL", *([] if as_published else [meaning]))
    cells = [_cells(space, *row) for row in zip(names, corrections.tolist(), held.tolist(), strict=True)]
    entries = [
        [*("".join(cell[line] for cell in cells[row : row + POINTS_ACROSS]) for line in range(3)), ""]
        for row in range(0, len(cells), POINTS_ACROSS)
    ]
    known = np.isfinite(corrections)
    closing = _of_components(space, corrections, known & held)
    if not as_published:
        closing += ["", "COMPONENTS NOT HELD", *_of_components(space, corrections, known & ~held)]
    return paginate(heading, entries, closing=closing)


def _cells(space: Space, name: str, values: Sequence[float], held: Sequence[bool]) -> list[str]:
    """Return three lines of 33 columns: name, label, value."""
    rows = zip(("", name, ""), space.names, space.values(values, 3), held, strict=True)
    return [
        f"{ident:<9}{axis}={f' {value} ' if is_held else f'({value})'}   "
        for ident, axis, value, is_held in rows
    ]


def _of_components(space: Space, corrections: Floats, counted: Bools) -> list[str]:
    counts, rms = counts_and_rms(corrections, counted)
    rows = zip(space.names, counts, space.values(rms, 3), strict=True)
    return [f"{axis}     NUMBER OF COMPONENTS ={count:>6d}     RMS ={value}" for axis, count, value in rows]
