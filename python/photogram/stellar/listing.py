"""The listing of a calibration as text (NOAA TR NOS 55, section E; section 9 of its specification)."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.angles import ARCSEC
from photogram.show.sections import Section, composed, headline, problems_or_none, verdict_sections
from photogram.stellar import tables
from photogram.stellar.lens_choice import LEVEL, equal
from photogram.stellar.parameters import GROUPS, INDEX
from photogram.stellar.result import SIGNIFICANT, Result, Stage


def listing(result: Result) -> str:
    """Return the listing of a calibration."""
    sections = [
        ("Problem", _labels(result)),
        ("Problem descriptors", [*descriptors(result), *_own(result)]),
        *summary(result),
        *((f"{stage.solution.capitalize()} solution", _stage(stage)) for stage in result.stages),
        *_solution(result),
        ("Images that took no part in the minimum solution", tables.pre_run(result)),
        ("Fictitious points on the diagonal", tables.fictitious(result) if result.movement else []),
        ("Direction differences on the diagonal", tables.movement(result)),
        ("Histogram of residuals", tables.residual_histogram(result)),
        *_combined(result),
    ]
    return composed(headline("stellar camera", result.problem.labels.get("title", "")), sections)


def summary(result: Result) -> list[Section]:
    """Return what a reader wants first: verdict, problems and figures."""
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(result.messages, result.verdict)),
        ("Adjustment", _adjustment(result)),
    ]


def _solution(result: Result) -> list[Section]:
    """Return what is printed of a solution with separate attitudes, and again of a combined one."""
    return [
        ("Camera orientation parameters", tables.parameters(result)),
        ("Transformed angles (grads)", tables.transformed(result)),
        ("Scales in the comparator's axes", tables.comparator(result)),
        ("Azimuth and elevation of the axis", tables.axis(result)),
        ("Star data", tables.stars(result)),
        ("Unknown directions", tables.directions(result)),
        ("Plate data", tables.images(result)),
        ("Mean plate coordinates", tables.means(result)),
        ("Distortion curves", tables.distortion(result)),
        ("Refraction curves", tables.refraction(result)),
        ("Inverse of the reduced normal equations, lower triangle", tables.inverse(result)),
    ]


def _combined(result: Result) -> list[Section]:
    combined = result.combined
    if combined is None:
        return []
    names = sorted({name for pair in combined.pairs for name in pair}, key=GROUPS.index)
    head = f"ORIENTATIONS FROM {', '.join(names).upper()} CONSTRAINED TO COMMON VALUES"
    sections = _solution(combined)
    return [
        ("Combined solution", [head, *_adjustment(combined)]),
        *((f"Combined solution: {title[0].lower()}{title[1:]}", lines) for title, lines in sections),
    ]


def plate_list(result: Result) -> bytes:
    """Return plate coordinates and residuals (m) as option 11 punched them: 4(1X,E14.8), I6, problem."""
    number = result.problem.labels.get("problem", "")
    rows = zip(result.problem.image_xy, result.solved.residuals, result.problem.image_points, strict=True)
    lines = [
        "".join(f" {value:14.7E}" for value in (*xy, *residual)) + f"{point:>6} {number}"
        for xy, residual, point in rows
    ]
    return ("\n".join(lines) + "\n").encode()


def _labels(result: Result) -> list[str]:
    site, o = result.problem.site, result.problem.options
    rows = [
        *result.problem.labels.items(),
        ("station", f"{site.number} {site.name}".strip() or "-"),
        ("latitude", tables.degrees(site.latitude)),
        ("longitude, west", tables.degrees(site.longitude_west)),
        ("elevation", f"{site.elevation:.4f} m"),
        ("temperature, pressure", f"{site.air.temperature:.2f} K, {site.air.pressure:.2f} mm of mercury"),
        ("diurnal aberration at the equator", f"{site.aberration / ARCSEC:.4f} arcsec"),
        ("tolerance of levels", f"{o.tolerance:.3E} m"),
        ("tolerance of refraction", f"{o.refraction_tolerance / ARCSEC:.3E} arcsec"),
        ("tolerance of distortion", f"{o.distortion_tolerance:.3E} m"),
        ("crossover, interval, end of curves", f"{o.crossover:g}, {o.interval:g}, {o.extent:g} m"),
        ("factor k of the movement test", f"{o.movement_factor:g}"),
        ("time of the fictitious points", tables.hours(o.movement_time)),
    ]
    if o.reference is not None:
        x, y = (value / ARCSEC for value in o.pole)
        rows += [
            ("reference station", f"{o.reference.number} {o.reference.name}".strip() or "-"),
            ("its latitude", tables.degrees(o.reference.latitude)),
            ("its longitude, west", tables.degrees(o.reference.longitude_west)),
            ("pole x, y", f"{x:.4f}, {y:.4f} arcsec"),
        ]
    return [f"{name:<36}{value}" for name, value in rows]


def descriptors(result: Result) -> list[str]:
    """Say of every option of the report in which state it is, in the words of figure 22 where it has them."""
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
            _common(problem.star_weights[problem.known]),
            "COMMON WEIGHT MATRIX FOR ALL KNOWN STARS",
            "INDIVIDUAL WEIGHT MATRICES FOR KNOWN STARS",
        ),
        (
            _common(problem.image_weights),
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


def _own(result: Result) -> list[str]:
    """Say of the options that the report does not have in which state they are."""
    o = result.problem.options
    return [
        "SCALE AFTER DISTORTION" if o.distortion_first else "SCALE BEFORE DISTORTION",
        "ITERATION AS PUBLISHED" if o.as_published else "STRICT ITERATION",
    ]


def _common(weights: Floats) -> bool:
    return bool((weights == weights[:1]).all())


def _adjustment(result: Result) -> list[str]:
    problem, sums = result.problem, result.solved.sums
    known = int(problem.known.sum())
    of_known = problem.known[problem.image_stars]
    groups = [problem.image_groups == g for g in range(3)]
    points = ", ".join(f"{int((g & of_known).sum())} / {int((g & ~of_known).sum())}" for g in groups)
    weights = problem.star_weights[problem.known & ~problem.held]
    rows = [
        ("stop", result.solved.stop),
        ("stars, known and unknown", f"{known}, {len(problem.star_ids) - known}"),
        ("plate points pre, post, event", f"{points} (of known / unknown stars)"),
        *_counts(result),
        ("weighted sum of squares, plate", f"{sums[0]:.8E}"),
        ("weighted sum of squares, stars", f"{sums[1]:.8E}"),
        ("weighted sum of squares, parameters", f"{sums[2]:.8E}"),
        ("weighted sum of squares, total", f"{sum(sums):.8E}"),
        ("mean error of unit weight, computed", f"{result.computed_mean_error:.8E}"),
        ("mean error of unit weight, in use", f"{result.mean_error:.8E}"),
        ("common mean error of the plate", _before(result, problem.image_weights, 1e-6, "um")),
        ("common mean error of the stars", _before(result, weights, ARCSEC, "arcsec")),
        *(
            (
                f"sums of {axis} residuals: +, -, both (um)",
                f"{1e6 * v[v > 0].sum():.3f}, {1e6 * v[v < 0].sum():.3f}, {1e6 * v.sum():z.3f}",
            )
            for axis, v in zip("xy", result.solved.residuals.T, strict=True)
        ),
        ("test of cx = cy", _scale_test(result)),
        (
            "distortion terms over mean errors",
            ", ".join(f"{n} {t:.1f}" for n, t in result.significance().items())
            + f" (significant from {SIGNIFICANT})",
        ),
    ]
    return [f"{name:<40}{value}" for name, value in rows]


def _scale_test(result: Result) -> str:
    """Say whether the data show that the two principal distances differ."""
    pair, freedom = [INDEX["cx"], INDEX["cy"]], result.degrees_of_freedom
    if not (result.solved.free[pair].all() and freedom):
        return "not made: they are not estimated both"
    statistic, probability = equal(
        result.solved.parameters[pair], result.covariance[np.ix_(pair, pair)], freedom
    )
    verdict = "refused" if probability < LEVEL else "not refused"
    return (
        f"F = {statistic:.2f} with 1 and {freedom} degrees of freedom, probability {probability:.2G}:"
        f" {verdict} at {LEVEL:g}"
    )


def _before(result: Result, weights: Floats, unit: float, name: str) -> str:
    """Write the mean errors before the adjustment that a common weight stands for."""
    if not len(weights) or not _common(weights):
        return "individual weights" if len(weights) else "-"
    x, y = result.mean_error / np.sqrt(np.diag(weights[0])) / unit
    return f"{x:.4f}, {y:.4f} {name}"


def _counts(result: Result | Stage) -> list[tuple[str, str]]:
    c = result.counts
    constraints = f", {c.constraints} constraints" if c.constraints else ""
    return [
        (
            "observations: plate, stars, parameters",
            f"{c.plate_observations}, {c.star_observations}, {c.parameter_observations}:"
            f" {c.observations}{constraints}",
        ),
        ("unknowns: parameters, stars", f"{c.parameter_unknowns}, {c.star_unknowns}: {c.unknowns}"),
        (
            "degrees of freedom",
            f"{c.degrees_of_freedom}" + (" (unique; 1 used)" if not c.degrees_of_freedom else ""),
        ),
    ]


def _stage(stage: Stage) -> list[str]:
    rows = [
        *_counts(stage),
        ("determinant of the normals", _power(stage.log_determinant)),
        ("stop", stage.stop),
    ]
    levels = [f"level of discrepancies{level.number:>4}  {level.level:.8E}" for level in stage.levels]
    return [*(f"{name:<40}{value}" for name, value in rows), *levels]


def _power(logarithm: float) -> str:
    """Write a number of which the natural logarithm is given: it may be beyond all exponents."""
    if math.isnan(logarithm):
        return "not positive"
    exponent = math.floor(logarithm / math.log(10))
    return f"{math.exp(logarithm - exponent * math.log(10)):.8f}E{exponent:+d}"
