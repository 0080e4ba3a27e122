"""The listing of a calibration as text (NOAA TR NOS 55, section E; section 9 of its specification)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from photogram import _photocore
from photogram.angles import ARCSEC, degrees_minutes_seconds
from photogram.stellar.curves import distortion_curves, refraction_curves
from photogram.stellar.parameters import GRAD, GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.result import SIGNIFICANT, Result
from photogram.stellar.transformation import transformed_angles

__all__ = ["listing", "plate_list", "summary"]

Section = tuple[str, list[str]]


def listing(result: Result) -> str:
    """Return the listing of a calibration."""
    sections = [
        ("Problem", _labels(result)),
        ("Problem descriptors", _descriptors(result)),
        *summary(result),
        ("Levels of discrepancies", _levels(result)),
        ("Camera orientation parameters", _parameters(result)),
        ("Transformed angles (grads)", _transformed(result)),
        ("Star data", _stars(result)),
        ("Unknown directions", _directions(result)),
        ("Plate data", _images(result)),
        ("Mean plate coordinates", _means(result)),
        ("Images that took no part in the minimum solution", _pre_run(result)),
        ("Direction differences on the diagonal", _movement(result)),
        ("Combined solution", _combined(result)),
        ("Distortion curves", _distortion(result)),
        ("Refraction curves", _refraction(result)),
    ]
    title = result.problem.labels.get("title", "")
    head = f"photogram {_photocore.__version__}  stellar camera  {title}".rstrip()
    parts = [f"{title}\n{'-' * len(title)}\n" + "\n".join(lines) for title, lines in sections if lines]
    return "\n\n".join([head, *parts]) + "\n"


def summary(result: Result) -> list[Section]:
    """Return what a reader wants first: problems and figures."""
    return [
        ("Problems", [str(message) for message in result.messages] or ["none"]),
        ("Adjustment", _adjustment(result)),
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
    site = result.problem.site
    rows = [
        *result.problem.labels.items(),
        ("station", f"{site.number} {site.name}".strip() or "-"),
        ("latitude", _degrees(site.latitude)),
        ("longitude, west", _degrees(site.longitude_west)),
        ("elevation", f"{site.elevation:.4f} m"),
        ("temperature, pressure", f"{site.air.temperature:.2f} K, {site.air.pressure:.2f} mm of mercury"),
    ]
    return [f"{name:<34}{value}" for name, value in rows]


def _descriptors(result: Result) -> list[str]:
    o = result.problem.options
    states = [
        (
            o.common_scale,
            "COMMON SCALAR FOR X AND Y (CX EQUALS CY)",
            "INDIVIDUAL SCALAR COMPONENTS FOR X AND Y (CX DOES NOT EQUAL CY)",
        ),
        (
            result.problem.axis is not None,
            "AZIMUTH AND ELEVATION OF THE CAMERA GIVEN",
            "NO AZIMUTH AND ELEVATION GIVEN",
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
            "ORIENTATION ANGLES TRANSFORMED TO A REFERENCE STATION SYSTEM",
            "NO TRANSFORMATION TO A REFERENCE STATION",
        ),
        (bool(result.problem.weighted.any()), "PARAMETERS WEIGHTED", "NO PARAMETERS WEIGHTED"),
        (
            bool(o.mean_error),
            f"INPUT MEAN ERROR OF UNIT WEIGHT {o.mean_error:.8E}",
            "COMPUTED MEAN ERROR OF UNIT WEIGHT",
        ),
        (bool(o.distortion_first), "SCALE AFTER DISTORTION", "SCALE BEFORE DISTORTION"),
        (o.as_published, "ITERATION AS PUBLISHED", "STRICT ITERATION"),
    ]
    return [yes if state else no for state, yes, no in states]


def _adjustment(result: Result) -> list[str]:
    counts, problem, sums = result.counts, result.problem, result.solved.sums
    known = int(problem.known.sum())
    groups = [int((problem.image_groups == g).sum()) for g in range(3)]
    rows = [
        ("stop", result.solved.stop),
        ("stars, known and unknown", f"{known}, {len(problem.star_ids) - known}"),
        ("plate points, pre, post, event", ", ".join(map(str, groups))),
        (
            "observations: plate, stars, parameters",
            f"{counts.plate_observations}, {counts.star_observations}, {counts.parameter_observations}:"
            f" {counts.observations}",
        ),
        (
            "unknowns: parameters, stars",
            f"{counts.parameter_unknowns}, {counts.star_unknowns}: {counts.unknowns}",
        ),
        (
            "degrees of freedom",
            f"{counts.degrees_of_freedom}" + (" (unique; 1 used)" if not counts.degrees_of_freedom else ""),
        ),
        ("weighted sum of squares, plate", f"{sums[0]:.8E}"),
        ("weighted sum of squares, stars", f"{sums[1]:.8E}"),
        ("weighted sum of squares, parameters", f"{sums[2]:.8E}"),
        ("weighted sum of squares, total", f"{sum(sums):.8E}"),
        ("mean error of unit weight, computed", f"{result.computed_mean_error:.8E}"),
        ("mean error of unit weight, in use", f"{result.mean_error:.8E}"),
        *(
            (
                f"sums of {axis} residuals, + and - (um)",
                f"{1e6 * v[v > 0].sum():.3f}, {1e6 * v[v < 0].sum():.3f}",
            )
            for axis, v in zip("xy", result.solved.residuals.T, strict=True)
        ),
        (
            "distortion terms over mean errors",
            ", ".join(f"{n} {t:.1f}" for n, t in result.significance().items())
            + f" (significant from {SIGNIFICANT})",
        ),
    ]
    return [f"{name:<40}{value}" for name, value in rows]


def _levels(result: Result) -> list[str]:
    return [f"{level.solution:<12}{level.number:>3}  {level.level:.8E}" for level in result.levels]


def _shown(name: str, value: float) -> float:
    return value / GRAD if UNITS[name] == "rad" else value


def _parameters(result: Result) -> list[str]:
    """Weighted parameters have residuals, free ones corrections (section 5.9a)."""
    problem, errors = result.problem, result.mean_errors
    lines = [
        _head(
            "<12",
            "unit<8",
            "given>20",
            "computed>20",
            "weight>14",
            "residual>18",
            "correction>18",
            "mean error>18",
        )
    ]
    for name in NAMES:
        i = INDEX[name]
        if name not in result.estimated and name in NAMES[22:]:
            continue
        weight, change = problem.parameter_weights[i, i], result.solved.parameters[i] - problem.initial[i]
        cells = [f"{_shown(name, v):20.10G}" for v in (problem.initial[i], result.parameters[name])]
        residual, correction = (change, 0.0) if weight else (0.0, change)
        moved = "".join(f"{_shown(name, v):18.8G}" for v in (residual, correction))
        after = f"{_shown(name, errors[name]):18.8G}" if name in result.estimated else f"{'held':>18}"
        unit = "grads" if UNITS[name] == "rad" else UNITS[name]
        lines.append(f"{name:<12}{unit:<8}{''.join(cells)}{weight:14.6G}{moved}{after}")
    for axis, centre, offset in (("XS", "xp", "dx"), ("YS", "yp", "dy")):
        row = np.zeros(len(NAMES))
        row[[INDEX[centre], INDEX[offset]]] = 1.0
        error = math.sqrt(max(float(row @ result.covariance @ row), 0.0))
        lines.append(
            f"{axis:<12}{'m':<8}{'':>20}{row @ result.solved.parameters:20.10G}{'':>50}{error:18.8G}"
        )
    return lines


def _transformed(result: Result) -> list[str]:
    options = result.problem.options
    if options.reference is None:
        return []
    lines = [_head("<8", "alpha>16", "omega>16", "kappa>16")]
    for g in _groups(result):
        angles = result.solved.parameters[3 * g : 3 * g + 3]
        found = transformed_angles(angles, result.problem.site, options.reference, options.pole)
        lines.append(f"{GROUPS[g]:<8}" + "".join(f"{angle / GRAD:16.9f}" for angle in found))
    return lines


def _groups(result: Result) -> list[int]:
    return [g for g in range(3) if result.solved.free[3 * g : 3 * g + 3].any()]


def _stars(result: Result) -> list[str]:
    """Residuals of right ascension (seconds of time, of arc) and declination (of arc)."""
    problem = result.problem
    lines = [
        _head(
            "star<8",
            "name<8",
            "ra s>14",
            "ra arcsec>12",
            "dec arcsec>12",
            "r ra>8",
            "r dec>8",
            "w ra>8",
            "w dec>8",
            "mean error arcsec>20",
        )
    ]
    names = problem.star_names or problem.star_ids
    for i in np.flatnonzero(problem.known):
        ra, dec = result.star_residuals[i] / ARCSEC
        tests = (*result.solved.star_redundancy[i], *result.star_standardized[i])
        before = (
            "held"
            if problem.held[i]
            else f"{result.mean_error / math.sqrt(problem.star_weights[i, 0, 0]) / ARCSEC:.3f}"
        )
        lines.append(
            f"{problem.star_ids[i]:<8}{names[i]:<8}{ra / 15:14.6f}{ra:12.4f}{dec:12.4f}"
            + "".join(f"{value:8.2f}" for value in tests)
            + f"{before:>20}"
        )
    return lines if len(lines) > 1 else []


def _directions(result: Result) -> list[str]:
    unknown = np.flatnonzero(~result.problem.known)
    if not unknown.size:
        return []
    lines = [
        _head(
            "number<8",
            "right ascension>18",
            "declination>18",
            "m ra arcsec>13",
            "m dec>9",
            "major>9",
            "minor>9",
            "direction deg>15",
        )
    ]
    ellipses = result.ellipses()
    for i in unknown:
        ra, dec = result.solved.places[i]
        sd = np.sqrt(np.diag(result.star_covariances[i])) / ARCSEC * [math.cos(dec), 1.0]
        e = ellipses[i]
        lines.append(
            f"{result.problem.star_ids[i]:<8}{_hours(ra % math.tau):>18}"
            f"{_degrees(dec):>18}"
            f"{sd[0]:13.4f}{sd[1]:9.4f}{e.major / ARCSEC:9.4f}{e.minor / ARCSEC:9.4f}"
            f"{math.degrees(e.direction):15.2f}"
        )
    return lines


def _images(result: Result) -> list[str]:
    problem = result.problem
    lines = [
        _head(
            "star<8",
            "point<8",
            "group<7",
            "x mm>13",
            "y mm>13",
            "time>18",
            "vx um>9",
            "vy um>9",
            "r x>7",
            "r y>7",
            "w x>8",
            "w y>8",
        )
    ]
    for i, point in enumerate(problem.image_points):
        x, y = problem.image_xy[i] * 1e3
        vx, vy = result.solved.residuals[i] * 1e6
        time = _hours(problem.image_times[i])
        lines.append(
            f"{problem.star_ids[problem.image_stars[i]]:<8}{point:<8}{GROUPS[problem.image_groups[i]]:<7}{x:13.5f}{y:13.5f}{time:>18}"
            f"{vx:9.3f}{vy:9.3f}"
            + "".join(f"{value:7.3f}" for value in result.solved.redundancy[i])
            + "".join(f"{value:8.2f}" for value in result.standardized[i])
        )
    return lines


def _means(result: Result) -> list[str]:
    """Means of stars with two images at least, and the radial and tangential parts of their residuals."""
    lines = [_head("star<8", "x mm>13", "y mm>13", "vx um>9", "vy um>9", "radial>9", "tangential>12")]
    for star, (x, y), (vx, vy), (radial, tangential) in star_means(result):
        lines.append(
            f"{star:<8}{1e3 * x:13.5f}{1e3 * y:13.5f}{1e6 * vx:9.3f}{1e6 * vy:9.3f}"
            f"{1e6 * radial:9.3f}{1e6 * tangential:12.3f}"
        )
    return lines if len(lines) > 1 else []


def star_means(result: Result) -> Iterator[tuple[str, np.ndarray, np.ndarray, tuple[float, float]]]:
    """Yield star, mean plate coordinates, mean residual, and its radial and tangential parts; metres."""
    for i, star in enumerate(result.problem.star_ids):
        chosen = result.problem.image_stars == i
        if chosen.sum() > 1:
            mean, v = (
                result.problem.image_xy[chosen].mean(axis=0),
                result.solved.residuals[chosen].mean(axis=0),
            )
            cos, sin = mean / max(float(np.hypot(*mean)), 1e-300)
            yield star, mean, v, (float(v[0] * cos + v[1] * sin), float(-v[0] * sin + v[1] * cos))


def _pre_run(result: Result) -> list[str]:
    if result.pre_run is None:
        return []
    rows = zip(result.pre_run.stars, result.pre_run.points, 1e6 * result.pre_run.residuals, strict=True)
    head = _head("star<8", "point<8", "vx um>12", "vy um>12")
    return [head, *(f"{star:<8}{point:<8}{vx:12.3f}{vy:12.3f}" for star, point, (vx, vy) in rows)]


def _movement(result: Result) -> list[str]:
    if not result.movement:
        return []
    lines = [
        _head(
            "pair<14",
            "x = y mm>9",
            "angle arcsec>14",
            "mean error>12",
            "ra cos dec>12",
            "dec>12",
            "az sin z>12",
            "elevation>12",
        )
    ]
    for m in result.movement:
        values = "".join(f"{value / ARCSEC:12.3f}" for value in m.differences)
        lines.append(
            f"{m.second + ' - ' + m.first:<14}{m.xy * 1e3:9.0f}"
            f"{m.angle / ARCSEC:14.3f}{m.mean_error / ARCSEC:12.3f}{values}"
        )
    return lines


def _combined(result: Result) -> list[str]:
    combined = result.combined
    if combined is None:
        return []
    names = sorted({name for pair in combined.pairs for name in pair}, key=GROUPS.index)
    lines = [f"ORIENTATIONS FROM {', '.join(names).upper()} CONSTRAINED TO COMMON VALUES"]
    lines.append(f"mean error of unit weight {combined.mean_error:.8E}, {combined.constraints} constraints")
    errors = combined.mean_error * np.sqrt(np.maximum(np.diag(combined.solved.cofactors), 0))
    for name, value, error in zip(NAMES, combined.solved.parameters, errors, strict=True):
        if name in result.estimated:
            lines.append(f"{name:<12}{_shown(name, value):20.10G}{_shown(name, error):18.8G}")
    return lines


def _distortion(result: Result) -> list[str]:
    options = result.problem.options
    if not options.curves:
        return []
    curves = distortion_curves(result)
    lines = [
        f"calibrated principal distance {curves.calibrated:.9f} m, "
        f"mean error {curves.calibrated_error:.3E} m; crossover {options.crossover} m",
        _head("d mm>8", "radial um>12", "m>9", "transformed>13", "m>9", "decentering>13", "m>9"),
    ]
    table = np.column_stack(
        [
            curves.radial,
            curves.radial_error,
            curves.transformed,
            curves.transformed_error,
            curves.decentering,
            curves.decentering_error,
        ]
    )
    for d, row in zip(curves.distance, 1e6 * table, strict=True):
        a, b, c, e, f, g = row
        lines.append(f"{1e3 * d:8.1f}{a:12.3f}{b:9.3f}{c:13.3f}{e:9.3f}{f:13.3f}{g:9.3f}")
    return lines


def _refraction(result: Result) -> list[str]:
    if not result.problem.options.refraction:
        return []
    lines = [_head("group<8", "z deg>9", "given>12", "corrected>12", "mean error>12")]
    for g in _groups(result):
        curves = refraction_curves(result, g)
        rows = zip(curves.zenith_distance, curves.given, curves.corrected, curves.error, strict=True)
        lines += [
            f"{GROUPS[g]:<8}{math.degrees(z):9.3f}{a / ARCSEC:12.4f}{b / ARCSEC:12.4f}{m / ARCSEC:12.4f}"
            for z, a, b, m in rows
        ]
    return lines


def _head(*cells: str) -> str:
    """Write the head of a table: each cell is its name with its format, as in `ra s>14`."""
    named = (re.fullmatch(r"(.*)([<>]\d+)", cell) for cell in cells)
    return "".join(format(cell[1], cell[2]) for cell in named if cell)


def _degrees(angle: float) -> str:
    """Write radians as degrees, minutes and seconds."""
    return _sexagesimal(angle, "d")


def _hours(angle: float) -> str:
    """Write radians as hours, minutes and seconds of time."""
    return _sexagesimal(angle / 15, "h")


def _sexagesimal(angle: float, unit: str) -> str:
    whole, minutes, seconds = degrees_minutes_seconds(angle, 4)
    return f"{'-' if angle < 0 else ''}{whole}{unit} {minutes:02d}m {seconds:07.4f}s"
