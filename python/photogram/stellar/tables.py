"""The tables of a calibration's listing (NOAA TR NOS 55, section E; section 9 of its specification)."""

from __future__ import annotations

import math
import re

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.angles import ARCSEC, degrees_minutes_seconds
from photogram.show.lines import padded
from photogram.stellar.comparator_frame import comparator_frame
from photogram.stellar.curves import (
    distortion_curves,
    histogram,
    refraction_curves,
    residual_classes,
    star_means,
)
from photogram.stellar.movement import fictitious_points
from photogram.stellar.parameters import GRAD, GROUPS, INDEX, NAMES, UNITS
from photogram.stellar.pointing import transformed_angles
from photogram.stellar.result import Ellipse, Result, ellipse

_AZIMUTHS = "azimuth S: from south, positive west; elevation: above the horizon"


def _shown(name: str, value: float) -> float:
    return value / GRAD if UNITS[name] == "rad" else value


def parameters(result: Result) -> list[str]:
    """Weighted parameters have residuals and mean errors before, free ones corrections (section 5.9a)."""
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
            "before>14",
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
        before = f"{_shown(name, result.mean_error / math.sqrt(weight)):14.6G}" if weight else f"{'-':>14}"
        unit = "grads" if UNITS[name] == "rad" else UNITS[name]
        lines.append(f"{name:<12}{unit:<8}{''.join(cells)}{weight:14.6G}{moved}{before}{after}")
    for axis, centre, offset in (("XS", "xp", "dx"), ("YS", "yp", "dy")):
        row = np.zeros(len(NAMES))
        row[[INDEX[centre], INDEX[offset]]] = 1.0
        error = math.sqrt(max(float(row @ result.covariance @ row), 0.0))
        lines.append(
            f"{axis:<12}{'m':<8}{'':>20}{row @ result.solved.parameters:20.10G}{'':>64}{error:18.8G}"
        )
    return lines


def transformed(result: Result) -> list[str]:
    """Attitudes in the system of the reference station and the mean pole."""
    options = result.problem.options
    if options.reference is None:
        return []
    lines = [_head("<8", "alpha>16", "omega>16", "kappa>16")]
    for g in _groups(result):
        angles = result.solved.parameters[3 * g : 3 * g + 3]
        found = transformed_angles(angles, result.problem.site, options.reference, options.pole)
        lines.append(f"{GROUPS[g]:<8}" + "".join(f"{angle / GRAD:16.9f}" for angle in found))
    return lines


def comparator(result: Result) -> list[str]:
    """Scales and nonperpendicularity in the axes of the comparator (equation 42)."""
    angle = result.problem.options.comparator_angle
    if angle is None:
        return []
    found = comparator_frame(result, angle)
    x, y, oblique = found.mean_errors
    return [
        f"angle x to y      {angle / GRAD:16.9f} grads",
        f"scale x           {found.scale_x:16.12f}  mean error {x:.3E}",
        f"scale y           {found.scale_y:16.12f}  mean error {y:.3E}",
        f"epsilon           {found.epsilon / GRAD:16.9f} grads  mean error {oblique / GRAD:.3E}",
    ]


def axis(result: Result) -> list[str]:
    """Show the direction of the axis that was given, and its residuals."""
    given, residual = result.problem.axis, result.solved.axis_residual
    if given is None or residual is None:
        return []
    (x, y), (vx, vy), weight = 1e3 * given.xy, 1e6 * residual, given.weight
    return [
        f"attitude          {GROUPS[given.group]}",
        f"azimuth           {degrees(given.azimuth)} from south, positive west",
        f"elevation         {degrees(math.pi / 2 - given.zenith_distance)}",
        f"plate x, y        {x:.6f}, {y:.6f} mm",
        f"weights           {weight[0, 0]:.6G}, {weight[1, 1]:.6G}, {weight[0, 1]:.6G}",
        f"residuals         {vx:.3f}, {vy:.3f} um",
    ]


def inverse(result: Result) -> list[str]:
    """Write the cofactors of the estimated parameters, six to a line."""
    lines = []
    for i, name in enumerate(result.estimated):
        row = [result.solved.cofactors[INDEX[name], INDEX[other]] for other in result.estimated[: i + 1]]
        for start in range(0, len(row), 6):
            label = name if start == 0 else ""
            lines.append(f"{label:<12}" + "".join(f"{value:18.9E}" for value in row[start : start + 6]))
    return lines


def residual_histogram(result: Result) -> list[str]:
    """Classes of the residuals of known stars, with as many as the normal curve puts there."""
    if not result.problem.options.histogram:
        return []
    lines = []
    for name, values in residual_classes(result).items():
        found = histogram(1e6 * values)
        lines += [
            f"residuals in {name}: mean {found.mean:.4f} um, standard deviation {found.sd:.4f} um",
            _head("from um>10", "to um>10", "number>8", "normal>9"),
        ]
        rows = zip(found.edges[:-1], found.edges[1:], found.counts, found.expected, strict=True)
        lines += [f"{low:10.3f}{high:10.3f}{count:8d}{expected:9.2f}" for low, high, count, expected in rows]
    return lines


def _groups(result: Result) -> list[int]:
    return [g for g in range(3) if result.solved.free[3 * g : 3 * g + 3].any()]


def stars(result: Result) -> list[str]:
    """Residuals of right ascension (seconds of time, of arc) and declination (of arc)."""
    problem = result.problem
    names = problem.star_names or problem.star_ids
    (star, *ids), (name, *own) = padded(["star", *problem.star_ids], 8), padded(["name", *names], 8)
    lines = [
        star
        + name
        + _head(
            "ra s>14",
            "ra arcsec>12",
            "dec arcsec>12",
            "r ra>8",
            "r dec>8",
            "w ra>8",
            "w dec>8",
            "before ra arcsec>18",
            "dec>9",
        )
    ]
    for i in np.flatnonzero(problem.known):
        ra, dec = result.star_residuals[i] / ARCSEC
        tests = (*result.solved.star_redundancy[i], *result.star_standardized[i])
        before = (
            "held"
            if problem.held[i]
            else "".join(f"{value:9.3f}" for value in _before(result, problem.star_weights[i], ARCSEC))
        )
        lines.append(
            f"{ids[i]}{own[i]}{ra / 15:14.6f}{ra:12.4f}{dec:12.4f}"
            + "".join(f"{value:8.2f}" for value in tests)
            + f"{before:>27}"
        )
    return lines if len(lines) > 1 else []


def directions(result: Result) -> list[str]:
    """Unknown directions; ellipses from the orientation alone, in total, and in total with m_i."""
    rows = result.directions()
    number, *ids = padded(["number", *(d.star for d in rows)], 8)
    head = number + _head(
        "right ascension>18",
        "declination>18",
        "azimuth S deg>15",
        "elevation deg>15",
        "m ra arcsec>13",
        "m dec>9",
        "m_i um>9",
    )
    kinds = [f"{kind + ' a, b, deg':>30}" for kind in ("orientation", "total", "with m_i")]
    lines = [head + "".join(kinds)]
    for star, d in zip(ids, rows, strict=True):
        ellipses = "".join(_ellipse(e) for e in (d.orientation, d.total, d.published))
        lines.append(
            f"{star}{hours(d.place[0] % math.tau):>18}{degrees(d.place[1]):>18}"
            f"{math.degrees(d.azimuth):15.5f}{math.degrees(d.elevation):15.5f}"
            f"{d.mean_errors[0] / ARCSEC:13.4f}{d.mean_errors[1] / ARCSEC:9.4f}"
            f"{1e6 * d.image_mean_error:9.3f}{ellipses}"
        )
    return [*lines, _AZIMUTHS] if rows else []


def _ellipse(e: Ellipse) -> str:
    return f"{e.major / ARCSEC:12.4f}{e.minor / ARCSEC:9.4f}{math.degrees(e.direction):9.2f}"


def fictitious(result: Result) -> list[str]:
    """Directions of plate points under every attitude, with ellipses from the orientation."""
    lines = [
        _head(
            "group<8",
            "x = y mm>9",
            "right ascension>18",
            "declination>18",
            "azimuth S deg>15",
            "elevation deg>15",
            "m ra arcsec>13",
            "m dec>9",
            "ellipse a, b, deg>30",
        )
    ]
    for p in fictitious_points(result):
        ra, dec = p.place
        sd = np.sqrt(np.diag(p.covariance)) / ARCSEC * [math.cos(dec), 1.0]
        lines.append(
            f"{p.group:<8}{1e3 * p.xy:9.0f}{hours(ra % math.tau):>18}{degrees(dec):>18}"
            f"{math.degrees(p.azimuth):15.5f}{math.degrees(p.elevation):15.5f}"
            f"{sd[0]:13.4f}{sd[1]:9.4f}{_ellipse(ellipse(p.covariance, dec))}"
        )
    return [*lines, _AZIMUTHS]


def images(result: Result) -> list[str]:
    """Plate coordinates with residuals, redundancy numbers r and standardized residuals w."""
    problem = result.problem
    star, *stars_ = padded(["star", *(problem.star_ids[k] for k in problem.image_stars)], 8)
    head, *points = padded(["point", *problem.image_points], 8)
    lines = [
        star
        + head
        + _head(
            "group<7",
            "x mm>13",
            "y mm>13",
            "time>18",
            "before x>10",
            "y um>8",
            "vx um>9",
            "vy um>9",
            "r x>7",
            "r y>7",
            "w x>8",
            "w y>8",
        )
    ]
    for i, point in enumerate(points):
        x, y = problem.image_xy[i] * 1e3
        vx, vy = result.solved.residuals[i] * 1e6
        time = hours(problem.image_times[i])
        before = _before(result, problem.image_weights[i], 1e-6)
        lines.append(
            f"{stars_[i]}{point}{GROUPS[problem.image_groups[i]]:<7}{x:13.5f}{y:13.5f}{time:>18}"
            f"{before[0]:10.3f}{before[1]:8.3f}{vx:9.3f}{vy:9.3f}"
            + "".join(f"{value:7.3f}" for value in result.solved.redundancy[i])
            + "".join(f"{value:8.2f}" for value in result.standardized[i])
        )
    return lines


def _before(result: Result, weight: Floats, unit: float) -> Floats:
    """Return mean errors before the adjustment in a unit."""
    return np.asarray(result.mean_error / np.sqrt(np.diag(weight)) / unit, float)


def means(result: Result) -> list[str]:
    """Means of stars with two images at least, and the radial and tangential parts of their residuals."""
    rows = list(star_means(result))
    head, *names = padded(["star", *(star for star, *_ in rows)], 8)
    lines = [head + _head("x mm>13", "y mm>13", "vx um>9", "vy um>9", "radial>9", "tangential>12")]
    for star, (_, (x, y), (vx, vy), (radial, tangential)) in zip(names, rows, strict=True):
        lines.append(
            f"{star}{1e3 * x:13.5f}{1e3 * y:13.5f}{1e6 * vx:9.3f}{1e6 * vy:9.3f}"
            f"{1e6 * radial:9.3f}{1e6 * tangential:12.3f}"
        )
    return lines if len(lines) > 1 else []


def pre_run(result: Result) -> list[str]:
    """Residuals of the images that took no part in the minimum solution."""
    if result.pre_run is None:
        return []
    star, *stars_ = padded(["star", *result.pre_run.stars], 8)
    head, *points = padded(["point", *result.pre_run.points], 8)
    rows = zip(stars_, points, 1e6 * result.pre_run.residuals, strict=True)
    lines = [f"{own}{point}{vx:12.3f}{vy:12.3f}" for own, point, (vx, vy) in rows]
    return [star + head + _head("vx um>12", "vy um>12"), *lines]


def movement(result: Result) -> list[str]:
    """Angles between the directions of a point under two attitudes."""
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


def distortion(result: Result) -> list[str]:
    """Distortion and its mean errors (um) over the distance from its centre."""
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


def refraction(result: Result) -> list[str]:
    """Refraction around the axes with the given and the corrected coefficients, seconds of arc."""
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


def degrees(angle: float) -> str:
    """Write radians as degrees, minutes and seconds."""
    return _sexagesimal(angle, "d")


def hours(angle: float) -> str:
    """Write radians as hours, minutes and seconds of time."""
    return _sexagesimal(angle / 15, "h")


def _sexagesimal(angle: float, unit: str) -> str:
    if not math.isfinite(angle):
        return "-"
    whole, minutes, seconds = degrees_minutes_seconds(angle, 4)
    return f"{'-' if angle < 0 else ''}{whole}{unit} {minutes:02d}m {seconds:07.4f}s"
