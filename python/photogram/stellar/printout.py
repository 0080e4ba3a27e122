"""Printed pages of the 1967 program (NOAA TR NOS 55, figure 22): 132 columns, numbers as E14.8.

Two of the six pages of the figure are available, the second in part. Columns of unknown width are as wide as
their headings. `listing.txt` has the content of pages 3 to 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.numbers import ARCSEC, degrees_minutes_seconds
from photogram.stellar.curves import star_means
from photogram.stellar.parameters import GROUPS
from photogram.stellar.sky import Site

if TYPE_CHECKING:
    from photogram.stellar import Result
    from photogram.stellar.iteration import Solved

WIDTH = 132


def printout(result: Result) -> str:
    pages = [_problem(result), _coordinates(result)]
    return "\f".join("".join(f"{line[:WIDTH].rstrip()}\n" for line in page) for page in pages)


def exponential(value: float, digits: int = 8) -> str:
    """Write a number as the program did, `.60000000E-01`: E14.8, or fewer digits."""
    mantissa, _, tens = f"{abs(value) + 0.0:.{digits - 1}e}".partition("e")
    exponent = int(tens) + 1 if value else 0
    sign = "-" if value < 0 else " "
    power = "+" if exponent > 0 else "-" if exponent < 0 else " "
    return f"{sign}.{mantissa.replace('.', '')}E{power}{abs(exponent):02d}"


def _problem(result: Result) -> Iterator[str]:
    problem, o = result.problem, result.problem.options
    labels, site = problem.labels, problem.site
    yield labels.get("title", "").upper().center(WIDTH)
    yield ""
    yield _columns("STATION NUMBER", "STATION NAME", "LATITUDE", "LONGITUDE", "ELEVATION")
    yield _station(site)
    yield ""
    yield from (f"{name.upper()} {value}" for name, value in labels.items() if name != "title")
    yield ""
    constants = {
        "PROBLEM TOLERANCE": o.tolerance,
        "REFRACTION TOLERANCE (SEC ARC)": o.refraction_tolerance / ARCSEC,
        "DISTORTION TOLERANCE": o.distortion_tolerance,
        "STATION TEMPERATURE (DEGREES KELVIN)": site.air.temperature,
        "STATION PRESSURE (MM MERCURY)": site.air.pressure,
        "DISTORTION CURVE CROSSOVER DISTANCE": o.crossover,
        "DISTORTION CURVE INTERVAL": o.interval,
        "DISTORTION CURVE MAXIMUM DISTANCE": o.extent,
    }
    yield from (f"{name:<48}{exponential(value)}" for name, value in constants.items())
    yield ""
    yield from descriptors(result)
    if o.reference is not None:
        yield ""
        yield _columns("STATION NUMBER", "REFERENCE STATION NAME", "LATITUDE", "LONGITUDE", "ELEVATION")
        yield _station(o.reference)
        x, y = (value / ARCSEC for value in o.pole)
        yield f"X-CORRECTION ANGLE (SEC) = {x:9.4f}     Y-CORRECTION ANGLE (SEC) = {y:9.4f}"
    yield ""
    yield "TOTAL NUMBER OF STARS AND PLATE POINTS IN PROBLEM"
    known = int(problem.known.sum())
    yield (
        f"KNOWN STARS {known:6d}     UNKNOWN STARS {len(problem.star_ids) - known:6d}"
        f"     PLATE POINTS {len(problem.image_points):6d}"
    )
    for stage in result.stages:
        yield from _stage(stage)


def descriptors(result: Result) -> list[str]:
    """Return the states of all report options, in the words of figure 22 if possible."""
    o, problem = result.problem.options, result.given
    states = [
        (
            o.common_scale,
            "COMMON SCALAR COMPUTED FOR X AND Y (CX EQUALS CY)",
            "INDIVIDUAL SCALAR COMPONENTS COMPUTED FOR X AND Y (CX DOES NOT EQUAL CY)",
        ),
        (
            problem.axis is not None,
            "AZIMUTH AND ELEVATION OF THE CAMERA GIVEN",
            "NO AZIMUTH AND ELEVATION GIVEN",
        ),
        (
            have_common_weight(problem.star_weights[problem.known]),
            "COMMON WEIGHT MATRIX FOR ALL KNOWN STARS",
            "INDIVIDUAL WEIGHT MATRICES FOR KNOWN STARS",
        ),
        (
            have_common_weight(problem.image_weights),
            "COMMON WEIGHT MATRIX FOR ALL PLATE POINTS",
            "INDIVIDUAL WEIGHT MATRICES FOR PLATE POINTS",
        ),
        (
            o.refraction,
            "REFRACTION COEFFICIENT CORRECTIONS COMPUTED",
            "NO REFRACTION COEFFICIENT CORRECTIONS COMPUTED",
        ),
        (
            bool(o.minimum_stars),
            f"MINIMUM SOLUTION COMPUTED WITH {len(o.minimum_stars)} STARS",
            "NO MINIMUM SOLUTION COMPUTED",
        ),
        (o.pre_run, "PRE-RUN RESIDUALS COMPUTED", "NO PRE-RUN"),
        (o.curves, "RADIAL AND TANGENTIAL LENS DISTORTION CURVES COMPUTED", "NO DISTORTION CURVES COMPUTED"),
        (
            o.reference is not None,
            "FINAL CAMERA ORIENTATION ANGLES TRANSFORMED TO A REFERENCE STATION SYSTEM",
            "NO TRANSFORMATION TO A REFERENCE STATION",
        ),
        (bool(problem.weighted.any()), "PARAMETERS WEIGHTED", "NO PARAMETERS WEIGHTED"),
        (o.plate_list, "PLATE COORDINATES AND RESIDUALS PUNCHED", "NO PLATE COORDINATES PUNCHED"),
        (
            bool(o.max_iterations_minimum),
            f"MINIMUM SOLUTION LIMITED TO {o.max_iterations_minimum} ITERATIONS",
            "MINIMUM SOLUTION LIMITED BY TOLERANCE",
        ),
        (
            bool(o.max_iterations),
            f"MAXIMUM SOLUTION LIMITED TO {o.max_iterations} ITERATIONS",
            "MAXIMUM SOLUTION LIMITED BY TOLERANCE",
        ),
        (
            bool(o.mean_error),
            f"INPUT MEAN ERROR OF UNIT WEIGHT {o.mean_error:.8E}",
            "COMPUTED MEAN ERROR OF UNIT WEIGHT",
        ),
        (o.histogram, "HISTOGRAM OF RESIDUALS COMPUTED", "NO HISTOGRAM OF RESIDUALS"),
    ]
    return [yes if state else no for state, yes, no in states]


def have_common_weight(weights: Floats) -> bool:
    return bool((weights == weights[:1]).all())


def _station(site: Site) -> str:
    latitude, longitude = (
        "{:4d} {:2d} {:7.4f}".format(*degrees_minutes_seconds(angle, 4))
        for angle in (site.latitude, site.longitude_west)
    )
    return _columns(site.number, site.name, latitude, longitude, f"{site.elevation:.4f}")


def _columns(*cells: str) -> str:
    return "".join(f"{cell:<26}" for cell in cells)


def _stage(stage: Solved) -> Iterator[str]:
    counts = stage.counts
    yield ""
    yield f"{stage.solution.upper()} SOLUTION"
    yield _columns("", "OBSERVATIONS", "UNKNOWNS")
    rows = {
        "ORIENTATION PARAMETERS": (counts.parameter_observations, counts.parameter_unknowns),
        "STAR COORDINATES": (counts.star_observations, counts.star_unknowns),
        "PLATE COORDINATES": (counts.plate_observations, 0),
        "TOTALS": (counts.observations, counts.unknowns),
    }
    yield from (_columns(name, *map(str, numbers)) for name, numbers in rows.items())
    yield f"DEGREES OF FREEDOM {counts.degrees_of_freedom}"
    yield "LEVEL OF DISCREPANCIES"
    yield from map(exponential, stage.levels)
    yield stage.stop


def _coordinates(result: Result) -> Iterator[str]:
    """Yield a block per known star: weight and residuals, images, means."""
    problem = result.problem
    names = problem.star_names or problem.star_ids
    means = {star: (mean, residual, parts) for star, mean, residual, parts in star_means(result)}
    yield "STAR AND PLATE COORDINATE DATA".center(WIDTH)
    for star in np.flatnonzero(problem.known).tolist():
        weight, residual = problem.star_weights[star], result.star_residuals[star] / ARCSEC
        shown = [weight[0, 0], weight[1, 1], weight[0, 1]] if np.isfinite(weight).all() else [0.0, 0.0, 0.0]
        yield ""
        yield f"{'STAR':<8}{'NORMALIZED STAR WEIGHTS':<51}{'CATALOG NO.':<13}STAR RESIDUALS"
        yield (
            f"{'NUMBER':<8}{'RIGHT ASCENSION':<17}{'DECLINATION':<17}{'CORRELATION':<17}{'':<13}"
            f"{'R A (SEC. TIME)':<19}{'R A (SEC. ARC)':<19}DECL (SEC. ARC)"
        )
        yield (
            f"{problem.star_ids[star]:<8}{_row(shown, 17)}{names[star]:<13}"
            f"{_row([residual[0] / 15, *residual], 19)}"
        )
        yield (
            f"{'POINT':<9}{'ORIENT-':<9}{'PLATE COORDINATES (MM)':<24}{'NORMALIZED PLATE WEIGHTS':<36}"
            f"{'SIDEREAL TIME':<20}PLATE RESIDUALS (MICRONS)"
        )
        yield (
            f"{'NUMBER':<9}{'ATION':<9}" + 2 * f"{'LX':<12}{'LY':<12}" + f"{'CORR.':<12}{'':<20}{'LX':<12}LY"
        )
        yield from (_image(result, image) for image in np.flatnonzero(problem.image_stars == star).tolist())
        if (mean := means.get(problem.star_ids[star])) is not None:
            heads = f"{'MEAN PLATE COORDINATES':<38}{'MEAN RESIDUALS (MICRONS)':<36}RADIAL AND TANGENTIAL"
            yield f"{'STAR':<9}{heads}"
            yield f"{'NUMBER':<9}{'LX':<19}{'LY':<19}{'LX':<18}{'LY':<18}"
            micrometres = "".join(f"{1e6 * value:<18.3f}" for value in (*mean[1], *mean[2]))
            yield f"{problem.star_ids[star]:<9}{_row(mean[0], 19)}{micrometres}"


def _image(result: Result, image: int) -> str:
    problem = result.problem
    (x, y), weight = 1e3 * problem.image_xy[image], problem.image_weights[image]
    hours, minutes, seconds = degrees_minutes_seconds(problem.image_times[image] / 15, 4)
    vx, vy = 1e6 * result.solved.residuals[image]
    weights = "".join(f"{exponential(v, 3):<12}" for v in (weight[0, 0], weight[1, 1], weight[0, 1]))
    return (
        f"{problem.image_points[image]:<9}{GROUPS[problem.image_groups[image]].upper():<9}"
        f"{x:<12.5f}{y:<12.5f}{weights}{hours:3d} {minutes:2d} {seconds:7.4f}     {vx:<12.3f}{vy:.3f}"
    )


def _row(values: Sequence[float] | Floats, width: int) -> str:
    return "".join(f"{exponential(float(value)):<{width}}" for value in values)


def plate_list(result: Result) -> bytes:
    """Return plate coordinates and residuals (m) in the format of option 11: 4(1X,E14.8), I6, problem."""
    number = result.problem.labels.get("problem", "")
    rows = zip(result.problem.image_xy, result.solved.residuals, result.problem.image_points, strict=True)
    lines = [
        "".join(f" {value:14.7E}" for value in (*xy, *residual)) + f"{point:>6} {number}"
        for xy, residual, point in rows
    ]
    return ("\n".join(lines) + "\n").encode()
