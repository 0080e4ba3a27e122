"""Tables of a calibrated plate (NOAA TR NOS 55, section E)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.numbers import ARCSEC, degrees_minutes_seconds
from photogram.lazy_dataclasses import fields
from photogram.show.page import about
from photogram.show.quantity import Axis, Quantity, Table, component, of_each
from photogram.stellar.camera_tables import (
    ARC_SECONDS,
    ARCSEC_OF_RAD,
    DEGREES,
    GRADS,
    MM,
    SECONDS,
    UM,
    UM_OF_M,
    column,
    names_column,
    parameter_table,
)
from photogram.stellar.curves import (
    distortion_curves,
    histogram,
    mean_error_ellipses,
    refraction_curves,
    residual_classes,
    star_means,
)
from photogram.stellar.movement import DIAGONAL
from photogram.stellar.parameters import GRAD, GROUPS, NAMES, UNITS
from photogram.stellar.problem import Counts

if TYPE_CHECKING:
    from photogram.stellar import Result

_NONE = np.zeros(0)


def parameters(result: Result) -> list[Table]:
    problem, count = result.problem, len(NAMES) if result.problem.options.refraction else 22
    names, free = NAMES[:count], result.solved.free[:count]
    weights = np.diag(problem.parameter_weights)[:count]
    with np.errstate(divide="ignore"):
        before = np.where(weights > 0, result.mean_error / np.sqrt(weights), np.where(free, np.inf, 0.0))
    axes = tuple(
        Axis(name, "rad", small="grads", factor=1 / GRAD)
        if UNITS[name] == "rad"
        else Axis.of(name, UNITS[name])
        for name in names
    )
    of, given = np.arange(count), problem.initial[:count]
    values = result.solved.parameters[:count]
    more = [
        Quantity(given, member="given"),
        Quantity(weights, name="weight", member="weight"),
        Quantity(free, name="estimated", member="estimated"),
    ]
    errors = np.sqrt(np.maximum(np.diag(result.covariance), 0))[:count]
    about = "Lengths in metres, angles in grads (400 to the circle)."
    changes = [
        component(axes, of)[0],
        Quantity(values - given, axes, "deviation", head="Change", figures=8, of=of),
        Quantity(weights, head="Weight", figures=6),
    ]
    return [
        parameter_table(
            axes, values, errors, np.array([given, before]), result.significance(), more, about=about
        ),
        Table("changes", "Changes of the parameters", changes),
    ]


def stages(result: Result) -> list[Table]:
    counts = {field.name: f"counts.{field.name}" for field in fields(Counts)}
    attributes = {
        "solution": "solution",
        **counts,
        "degrees_of_freedom": "counts.degrees_of_freedom",
        **{name: name for name in ("iterations", "stop", "converged", "log10_determinant")},
    }
    columns = [
        of_each(
            result.stages,
            attribute,
            kind="name" if name in ("solution", "stop", "converged") else "number",
            member=name,
            head=name.capitalize().replace("_", " "),
            figures=10,
        )
        for name, attribute in attributes.items()
    ]
    counts_of_levels = [len(stage.levels) for stage in result.stages]
    levels = [
        names_column(
            np.repeat([stage.solution for stage in result.stages], counts_of_levels), "Solution", "solution"
        ),
        Quantity(
            [k + 1 for count in counts_of_levels for k in range(count)], member="number", head="Iteration"
        ),
        Quantity(result.levels, member="level", head="Level of discrepancies", figures=9),
    ]
    note = "The determinant is of the reduced normal equations, in the units of the parameters."
    return [Table("solutions", "Solutions", columns, note), Table("iterations", "Iterations", levels)]


def transformed(result: Result) -> Table:
    attitudes = result.transformed_attitudes()
    columns = [
        names_column(attitudes, "Orientation"),
        column([*attitudes.values()], GRADS, "{}", 9, parts="alpha, omega, kappa"),
    ]
    return Table("transformed-angles", "Transformed angles", columns)


def stars(result: Result) -> Table:
    """Return the stars: residuals of known ones, and estimated unknown directions.

    Only known stars are printed; `directions` has the others.
    """
    problem, known = result.problem, result.problem.known
    residuals = np.where(known[:, None], result.star_residuals / ARCSEC, np.nan)
    before = _before(result, problem.star_weights)
    redundancy, standardized = (
        np.where(known[:, None], values, np.nan)
        for values in (result.solved.star_redundancy, result.star_standardized)
    )
    place = "ra, dec"
    columns = [
        names_column(problem.star_ids, "Star", "id"),
        names_column(problem.star_names or problem.star_ids, "Name", "name"),
        Quantity(known, name="known", member="known"),
        Quantity(result.solved.places, member="place_rad"),
        Quantity(_ellipse_members(result.ellipses()), member="ellipse"),
        column(residuals[:, 0] / 15, SECONDS, "Residual ra", 6),
        column(residuals, ARC_SECONDS, "Residual {}", 4, "residual", place),
        column(redundancy, None, "r {}", 2, "redundancy", place),
        column(standardized, None, "w {}", 2, "standardized", place),
        column(before, ARCSEC_OF_RAD, "Before {}", 3, parts=place, words={0.0: "fixed"}),
    ]
    if not known.all():
        columns += _unknown(result)
    about = "Adjusted minus catalogue; redundancy numbers r, standardized residuals w, mean errors before."
    return Table("stars", "Star data", columns, about=about, shown=np.flatnonzero(known))


def _unknown(result: Result) -> list[Quantity]:
    """Return members of the stars with unknown directions, absent for known stars."""
    found = result.directions()
    azimuth, elevation = found.horizontal.T.tolist()
    members: dict[str, Sequence[object]] = {
        "correction": (found.corrections / ARCSEC).tolist(),
        "azimuth_rad": azimuth,
        "elevation_rad": elevation,
        "m_i": found.image_mean_errors.tolist(),
        "orientation_ellipse": _ellipse_members(found.orientation),
        "published_ellipse": _ellipse_members(found.published),
    }
    columns = []
    for name, values in members.items():
        of_stars = dict(zip(found.stars.tolist(), values, strict=True))
        cells = np.fromiter(map(of_stars.get, range(len(result.problem.star_ids))), object)
        columns.append(Quantity(cells, member=name))
    return columns


def _ellipse_members(ellipses: Floats) -> list[dict[str, float]]:
    names = ("major_arcsec", "minor_arcsec", "direction_rad")
    rows = (ellipses / [ARCSEC, ARCSEC, 1.0]).tolist()
    return [dict(zip(names, row, strict=True)) for row in rows]


def _ellipses(ellipses: Floats, of: str) -> list[Quantity]:
    return [
        column(ellipses[:, :2], ARCSEC_OF_RAD, f"{{}}, {of}", 4, parts="a, b"),
        column(ellipses[:, 2], DEGREES, "Direction", 2),
    ]


def directions(result: Result) -> Table:
    found = result.directions()
    columns = [
        names_column((result.problem.star_ids[star] for star in found.stars), "Star"),
        *_places(found.places),
        column(found.horizontal[:, 0], DEGREES, "Azimuth S", 5),
        column(found.horizontal[:, 1], DEGREES, "Elevation", 5),
        column(found.mean_errors, ARCSEC_OF_RAD, "Mean error {}", 4, parts="ra, dec"),
        column(found.image_mean_errors, UM_OF_M, "m_i", 3),
        *_ellipses(found.orientation, "orientation"),
        *_ellipses(found.total, "total"),
        *_ellipses(found.published, "with m_i"),
    ]
    return Table("directions", "Unknown directions", columns, about=about("plate.directions"))


def _places(places: Floats) -> list[Quantity]:
    return [
        names_column((hours(ra % math.tau) for ra, _ in places.tolist()), "Right ascension"),
        names_column((degrees(dec) for _, dec in places.tolist()), "Declination"),
    ]


def fictitious(result: Result) -> Table:
    """Return directions of plate points for every attitude, with orientation ellipses."""
    groups: Sequence[str] = ()
    places, horizontal, covariances = np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 2))
    if (found := result.movement) is not None:
        groups = np.repeat(found.groups, len(DIAGONAL)).tolist()
        places, horizontal = found.places.reshape(-1, 2), found.horizontal.reshape(-1, 2)
        covariances = found.covariances.reshape(-1, 2, 2)
    deviations = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    deviations[:, 0] *= np.cos(places[:, 1])
    columns = [
        names_column(groups, "Orientation", "group"),
        column(np.resize(DIAGONAL, len(places)), MM, "x = y", 0, "xy"),
        Quantity(places, member="place"),
        *_places(places),
        column(horizontal[:, 0], DEGREES, "Azimuth S", 5, "azimuth"),
        column(horizontal[:, 1], DEGREES, "Elevation", 5, "elevation"),
        column(deviations, ARCSEC_OF_RAD, "Mean error {}", 4, parts="ra, dec"),
        *_ellipses(mean_error_ellipses(covariances, places[:, 1]), "orientation"),
        Quantity(covariances, member="covariance"),
    ]
    title = "Fictitious points on the diagonal"
    return Table("fictitious_points", title, columns, about=about("plate.azimuths"))


def images(result: Result) -> Table:
    problem, solved = result.problem, result.solved
    columns = [
        names_column(problem.image_points, "Point", "point"),
        names_column((problem.star_ids[star] for star in problem.image_stars), "Star", "star"),
        names_column((GROUPS[group] for group in problem.image_groups), "Orientation", "orientation"),
        column(problem.image_xy, MM, "{}", 5, "xy_m", "x, y"),
        names_column(map(hours, problem.image_times.tolist()), "Time"),
        column(_before(result, problem.image_weights), UM_OF_M, "Before {}", 3, parts="x, y"),
        column(1e6 * solved.residuals, UM, "Residual {}", 3, "residual_um", "x, y"),
        column(solved.redundancy, None, "r {}", 3, "redundancy", "x, y"),
        column(result.standardized, None, "w {}", 2, "standardized", "x, y"),
    ]
    about = "Computed minus measured; redundancy numbers r, standardized residuals w, mean errors before."
    return Table("images", "Plate data", columns, about=about)


def _before(result: Result, weights: Floats) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(result.mean_error / np.sqrt(np.diagonal(weights, axis1=1, axis2=2)), float)


def means(result: Result) -> Table:
    rows = list(star_means(result))
    columns = [
        names_column((star for star, *_ in rows), "Star", "star"),
        column([xy for _, xy, *_ in rows], MM, "{}", 5, "xy_m", "x, y"),
        column([1e6 * v for *_, v, _ in rows], UM, "Residual {}", 3, "residual_um", "x, y"),
        column([1e6 * radial for *_, (radial, _) in rows], UM, "Radial", 3, "radial_um"),
        column([1e6 * along for *_, (_, along) in rows], UM, "Tangential", 3, "tangential_um"),
    ]
    return Table("star_means", "Mean plate coordinates", columns)


def pre_run(result: Result) -> Table:
    found = result.pre_run
    columns = [
        names_column(found.stars if found else (), "Star"),
        names_column(found.points if found else (), "Point"),
        column(found.residuals if found else [], UM_OF_M, "Residual {}", 3, parts="x, y"),
    ]
    return Table("pre-run", "Images that took no part in the minimum solution", columns)


def movement(result: Result) -> Table:
    found = result.movement
    pairs = [pair for pair in found.pairs for _ in DIAGONAL] if found else []
    parts = "ra cos dec, declination, azimuth sin z, elevation"
    columns = [
        names_column((f"{second} - {first}" for first, second in pairs), "Pair"),
        names_column((first for first, _ in pairs), "", "first"),
        names_column((second for _, second in pairs), "", "second"),
        column(np.resize(DIAGONAL, len(pairs)), MM, "x = y", 0, "xy"),
        column(found.angles.ravel() if found else [], ARCSEC_OF_RAD, "Angle", 3, "angle"),
        column(found.mean_errors.ravel() if found else [], ARCSEC_OF_RAD, "Mean error", 3, "mean_error"),
        column(found.differences if found else [], ARCSEC_OF_RAD, "{}", 3, "differences", parts),
    ]
    about = "Angles between the directions of a point of the plate under two attitudes."
    return Table("movement", "Movement of the camera", columns, about=about)


def distortion(result: Result) -> Table:
    curves = distortion_curves(result) if result.problem.options.curves else None
    columns = [column(getattr(curves, "distance", _NONE), MM, "Distance", 1)]
    for name in ("radial", "transformed", "decentering"):
        columns += [
            column(getattr(curves, name, _NONE), UM_OF_M, name.capitalize(), 3),
            column(getattr(curves, f"{name}_error", _NONE), UM_OF_M, "Mean error", 3),
        ]
    return Table("distortion", "Distortion", columns, about=about("plate.distortion"))


def refraction(result: Result) -> Table:
    groups = result.groups if result.problem.options.refraction else ()
    curves = [refraction_curves(result, group) for group in groups]
    names = np.repeat(groups, [len(curve.zenith_distance) for curve in curves])
    columns = [names_column(names, "Orientation")]
    for name, head, unit, decimals in (
        ("zenith_distance", "Zenith distance", DEGREES, 3),
        ("given", "Given", ARCSEC_OF_RAD, 4),
        ("corrected", "Corrected", ARCSEC_OF_RAD, 4),
        ("error", "Mean error", ARCSEC_OF_RAD, 4),
    ):
        values = np.concatenate([_NONE, *(getattr(curve, name) for curve in curves)])
        columns.append(column(values, unit, head, decimals))
    return Table("refraction", "Refraction curves", columns)


def histograms(result: Result) -> list[Table]:
    tables = []
    for name, values in residual_classes(result).items():
        found = histogram(1e6 * values)
        columns = [
            column(found.edges[:-1], UM, "From", 3),
            column(found.edges[1:], UM, "To", 3),
            column(found.counts, None, "Number", 0),
            column(found.expected, None, "Normal", 2),
        ]
        note = about("histogram", mean=float(found.mean), sd=float(found.sd))
        tables.append(Table(f"histogram-{name}", f"Residuals in {name}", columns, note))
    return tables


def degrees(angle: float) -> str:
    return _sexagesimal(angle, "d")


def hours(angle: float) -> str:
    return _sexagesimal(angle / 15, "h")


def _sexagesimal(angle: float, unit: str) -> str:
    if not math.isfinite(angle):
        return "-"
    whole, minutes, seconds = degrees_minutes_seconds(angle, 4)
    return f"{'-' if angle < 0 else ''}{whole}{unit} {minutes:02d}m {seconds:07.4f}s"
