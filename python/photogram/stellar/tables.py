"""Tables of a calibrated plate (NOAA TR NOS 55, section E; section 9 of its specification)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.show.angles import ARCSEC, degrees_minutes_seconds
from photogram.show.quantity import Axis, Quantity, Table, of_each
from photogram.stellar.camera_tables import parameter_table
from photogram.stellar.curves import (
    distortion_curves,
    histogram,
    refraction_curves,
    residual_classes,
    star_means,
)
from photogram.stellar.movement import fictitious_points
from photogram.stellar.outliers import studentized
from photogram.stellar.parameters import GRAD, GROUPS, NAMES, UNITS
from photogram.stellar.pointing import transformed_angles
from photogram.stellar.result import Ellipse, Result, ellipse

_AZIMUTHS = "Azimuths from south, positive west; elevations above the horizon."
_UM = (Axis.of("x", "um"), Axis.of("y", "um"))
_MM = tuple(Axis(name, "m", small="mm", factor=1e3) for name in "xy")
_PLACE = (Axis.of("ra", "arcsec"), Axis.of("dec", "arcsec"))


def _axis(unit: str, small: str, factor: float, *names: str) -> tuple[Axis, ...]:
    return tuple(Axis(name, unit, small=small, factor=factor) for name in names or ("",))


def _angles(*names: str) -> tuple[Axis, ...]:
    return _axis("rad", "arcsec", 1 / ARCSEC, *names)


def _degrees(*names: str) -> tuple[Axis, ...]:
    return _axis("rad", "deg", math.degrees(1), *names)


_UM_OF_M = _axis("m", "um", 1e6)
_NONE = np.zeros(0)
_ATTITUDE = ("alpha", "omega", "kappa")


def _named(
    values: Sequence[Any] | np.ndarray, name: str, head: str = "", member: str | None = None
) -> Quantity:
    texts = np.array(values, dtype=object)
    return Quantity(texts, (), "name", name or None, name if member is None else member, head=head)


def parameters(result: Result) -> Table:
    """Return the parameters: given, adjusted, and the change (section 5.9a)."""
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
        Quantity(weights, name="weight", member="weight", head="Weight" * bool(weights.any()), figures=6),
        Quantity(values - given, axes, "deviation", head="Change", figures=6, of=of),
        Quantity(free, name="estimated", member="estimated"),
    ]
    errors = np.sqrt(np.maximum(np.diag(result.covariance), 0))[:count]
    about = "Lengths in metres, angles in grads (400 to the circle)."
    return parameter_table(
        axes, values, errors, np.array([given, before]), result.significance(), more, about=about
    )


def stages(result: Result) -> list[Table]:
    """Return the solutions of the run, and the levels of discrepancies of all iterations."""
    rows = [
        {
            "solution": stage.solution,
            **asdict(stage.counts),
            "degrees_of_freedom": stage.counts.degrees_of_freedom,
            "iterations": len(stage.levels) - 1,
            "stop": stage.stop,
            "converged": stage.converged,
            "log10_determinant": stage.log_determinant / math.log(10),
        }
        for stage in result.stages
    ]
    heads = {"log10_determinant": "Log10 of the determinant"}
    columns = [
        Quantity(
            [row[name] for row in rows],
            (),
            "name" if name in ("solution", "stop", "converged") else "number",
            member=name,
            head=heads.get(name, name.capitalize().replace("_", " ")),
            figures=10,
        )
        for name in rows[0]
    ]
    levels = [
        of_each(result.levels, "solution", kind="name", head="Solution"),
        of_each(result.levels, "number", head="Iteration"),
        of_each(result.levels, "level", head="Level of discrepancies", figures=9),
    ]
    note = "The determinant is of the reduced normal equations, in the units of the parameters."
    return [Table("solutions", "Solutions", columns, note), Table("iterations", "Iterations", levels)]


def transformed_attitudes(result: Result) -> dict[str, Floats]:
    """Return attitudes in the system of the reference station and the mean pole; none without a station."""
    options, site = result.problem.options, result.problem.site
    if options.reference is None:
        return {}
    angles = result.solved.parameters[:9].reshape(3, 3)
    return {
        name: transformed_angles(angles[g], site, options.reference, options.pole)
        for name, g in solved_groups(result).items()
    }


def transformed(result: Result) -> Table:
    """Return the transformed attitudes."""
    attitudes, grads = transformed_attitudes(result), _axis("rad", "grads", 1 / GRAD, *_ATTITUDE)
    angles = np.reshape([*attitudes.values()], (-1, 3))
    columns = [
        _named([*attitudes], "", "Orientation"),
        Quantity(angles, grads, "deviation", head="{}", decimals=9),
    ]
    return Table("transformed-angles", "Transformed angles", columns)


def solved_groups(result: Result) -> dict[str, int]:
    """Return the orientations whose attitude was estimated, by name."""
    free = result.solved.free[:9].reshape(3, 3)
    return {name: g for g, name in enumerate(GROUPS) if free[g].any()}


def stars(result: Result) -> Table:
    """Return the stars: residuals of known ones, corrections and ellipses of unknown directions.

    People see the known ones; `directions` has the others.
    """
    problem, known = result.problem, result.problem.known
    residuals = np.where(known[:, None], result.star_residuals / ARCSEC, np.nan)
    before = _before(result, problem.star_weights)
    columns = [
        _named(problem.star_ids, "id", "Star"),
        _named(problem.star_names or problem.star_ids, "name", "Name"),
        Quantity(known, name="known", member="known"),
        Quantity(result.solved.places, _degrees("ra", "dec"), member="place_rad"),
        Quantity([*map(_ellipse, result.ellipses())], member="ellipse"),
        Quantity(residuals[:, 0] / 15, _axis("s", "s", 1.0), "deviation", head="Residual ra", decimals=6),
        Quantity(residuals, _PLACE, "deviation", "residual", "residual", head="Residual {}", decimals=4),
        _known(known, result.solved.star_redundancy, "redundancy", "r {}"),
        _known(known, result.star_standardized, "standardized", "w {}"),
        Quantity(
            before, _angles("ra", "dec"), "deviation", head="Before {}", decimals=3, words={0.0: "fixed"}
        ),
    ]
    if not known.all():
        columns += _unknown(result)
    about = "Adjusted minus catalogue; redundancy numbers r, standardized residuals w, mean errors before."
    return Table("stars", "Star data", columns, about=about, shown=np.flatnonzero(known))


def _known(known: Bools, values: Floats, name: str, head: str) -> Quantity:
    values = np.where(known[:, None], values, np.nan)
    return Quantity(values, _PLACE, "number", name, name, head=head, decimals=2)


def _unknown(result: Result) -> list[Quantity]:
    """Return members of the stars with unknown directions, absent for known stars."""
    rows = {
        direction.star: {
            "correction": [value / ARCSEC for value in direction.correction],
            "azimuth_rad": direction.azimuth,
            "elevation_rad": direction.elevation,
            "m_i": direction.image_mean_error,
            "orientation_ellipse": _ellipse(direction.orientation),
            "published_ellipse": _ellipse(direction.published),
        }
        for direction in result.directions()
    }
    names = next(iter(rows.values()))
    of_stars = [rows.get(star, {}) for star in result.problem.star_ids]
    columns = {name: np.fromiter((row.get(name) for row in of_stars), object) for name in names}
    return [Quantity(values, member=name) for name, values in columns.items()]


def _ellipse(e: Ellipse) -> dict[str, float]:
    return {
        "major_arcsec": e.major / ARCSEC,
        "minor_arcsec": e.minor / ARCSEC,
        "direction_rad": e.direction,
    }


def _ellipses(ellipses: Sequence[Ellipse], of: str) -> list[Quantity]:
    values = np.reshape([(e.major, e.minor, e.direction) for e in ellipses], (-1, 3))
    return [
        Quantity(values[:, :2], _angles("a", "b"), "deviation", head=f"{{}}, {of}", decimals=4),
        Quantity(values[:, 2], _degrees(), "deviation", head="Direction", decimals=2),
    ]


def directions(result: Result) -> Table:
    """Return unknown directions; ellipses from the orientation alone, in total, and in total with m_i."""
    found = result.directions()
    places = np.reshape([d.place for d in found], (-1, 2))
    columns = [
        _named([d.star for d in found], "", "Star"),
        *_places(places),
        *_horizontal([d.azimuth for d in found], [d.elevation for d in found]),
        Quantity(
            np.reshape([d.mean_errors for d in found], (-1, 2)),
            _angles("ra", "dec"),
            "deviation",
            head="Mean error {}",
            decimals=4,
        ),
        Quantity(
            np.array([d.image_mean_error for d in found]), _UM_OF_M, "deviation", head="m_i", decimals=3
        ),
        *_ellipses([d.orientation for d in found], "orientation"),
        *_ellipses([d.total for d in found], "total"),
        *_ellipses([d.published for d in found], "with m_i"),
    ]
    about = (
        "Stars with estimated places, mean errors, and semi-axes and directions of their ellipses: from the"
        " orientation alone, in total, and in total with m_i, the mean error of their own images."
        f" {_AZIMUTHS}"
    )
    return Table("directions", "Unknown directions", columns, about=about)


def _places(places: Floats) -> list[Quantity]:
    return [
        _named([hours(ra % math.tau) for ra in places[:, 0].tolist()], "", "Right ascension"),
        _named([degrees(dec) for dec in places[:, 1].tolist()], "", "Declination"),
    ]


def _horizontal(azimuths: Sequence[float], elevations: Sequence[float], **member: str) -> list[Quantity]:
    return [
        Quantity(np.array(values), _degrees(), "deviation", member=name, head=head, decimals=5)
        for values, name, head in (
            (azimuths, member.get("azimuth", ""), "Azimuth S"),
            (elevations, member.get("elevation", ""), "Elevation"),
        )
    ]


def fictitious(result: Result) -> Table:
    """Return directions of plate points under every attitude, with ellipses from the orientation."""
    points = fictitious_points(result) if result.movement else ()
    places = np.reshape([p.place for p in points], (-1, 2))
    covariances = np.reshape([p.covariance for p in points], (-1, 2, 2))
    errors = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    errors = errors * np.column_stack([np.cos(places[:, 1]), np.ones(len(places))])
    columns = [
        _named([p.group for p in points], "group", "Orientation"),
        Quantity(
            np.array([p.xy for p in points]), _MM[:1], "deviation", member="xy", head="x = y", decimals=0
        ),
        Quantity(places, member="place"),
        *_places(places),
        *_horizontal(
            [p.azimuth for p in points],
            [p.elevation for p in points],
            azimuth="azimuth",
            elevation="elevation",
        ),
        Quantity(errors, _angles("ra", "dec"), "deviation", head="Mean error {}", decimals=4),
        *_ellipses([ellipse(p.covariance, p.place[1]) for p in points], "orientation"),
        Quantity(covariances, member="covariance"),
    ]
    return Table("fictitious_points", "Fictitious points on the diagonal", columns, about=_AZIMUTHS)


def images(result: Result) -> Table:
    """Return plate coordinates with residuals, redundancy numbers r and standardized residuals w."""
    problem, solved = result.problem, result.solved
    columns = [
        *_images_of(result),
        Quantity(problem.image_xy, _MM, "deviation", "", "xy_m", head="{}", decimals=5),
        _named([hours(time) for time in problem.image_times.tolist()], "", "Time"),
        Quantity(
            _before(result, problem.image_weights),
            _axis("m", "um", 1e6, "x", "y"),
            "deviation",
            head="Before {}",
            decimals=3,
        ),
        Quantity(
            1e6 * solved.residuals,
            _UM,
            "deviation",
            "residual_um",
            "residual_um",
            head="Residual {}",
            decimals=3,
        ),
        Quantity(solved.redundancy, _UM, "number", "redundancy", "redundancy", head="r {}", decimals=3),
        Quantity(result.standardized, _UM, "number", "standardized", "standardized", head="w {}", decimals=2),
    ]
    about = "Computed minus measured; redundancy numbers r, standardized residuals w, mean errors before."
    return Table("images", "Plate data", columns, about=about)


def _images_of(result: Result) -> list[Quantity]:
    problem = result.problem
    return [
        _named(problem.image_points, "point", "Point"),
        _named([problem.star_ids[star] for star in problem.image_stars], "star", "Star"),
        _named([GROUPS[group] for group in problem.image_groups], "orientation", "Orientation"),
    ]


def worst(result: Result, most: int) -> Table:
    """Return the plate coordinates with the largest test values."""
    tests = studentized(result)
    sizes = np.nan_to_num(np.abs(tests.images))
    order: Indices = np.argsort(-sizes, axis=None, kind="stable")[:most]
    point, star, _ = (replace(column, member="") for column in _images_of(result))
    columns = [
        point,
        star,
        Quantity(1e6 * result.solved.residuals, _UM, "deviation", head="Residual", decimals=2),
        Quantity(tests.images, _UM, head=f"Test value {'w' if tests.known else 't'}", decimals=2),
    ]
    note = f"The {len(order)} plate coordinates of the largest test values."
    places = np.column_stack(np.unravel_index(order, sizes.shape))
    return Table("worst", "Worst observations", columns, note, shown=places)


def _before(result: Result, weights: Floats) -> Floats:
    """Return the (n, 2) mean errors before the adjustment."""
    with np.errstate(divide="ignore"):
        return np.asarray(result.mean_error / np.sqrt(np.diagonal(weights, axis1=1, axis2=2)), float)


def means(result: Result) -> Table:
    """Return means of stars with two images at least, and radial and tangential parts of their residuals."""
    rows = list(star_means(result))
    values = np.reshape([[*xy, *v, *parts] for _, xy, v, parts in rows], (-1, 6))
    um: Any = {"kind": "deviation", "decimals": 3}
    columns = [
        _named([star for star, *_ in rows], "star", "Star"),
        Quantity(values[:, :2], _MM, "deviation", member="xy_m", head="{}", decimals=5),
        Quantity(1e6 * values[:, 2:4], _UM, member="residual_um", head="Residual {}", **um),
        Quantity(1e6 * values[:, 4], _UM[:1], member="radial_um", head="Radial", **um),
        Quantity(1e6 * values[:, 5], _UM[:1], member="tangential_um", head="Tangential", **um),
    ]
    return Table("star_means", "Mean plate coordinates", columns)


def pre_run(result: Result) -> Table:
    """Return residuals of the images without a part in the minimum solution."""
    found = result.pre_run
    residuals = np.zeros((0, 2)) if found is None else found.residuals
    columns = [
        _named(found.stars if found else [], "", "Star"),
        _named(found.points if found else [], "", "Point"),
        Quantity(residuals, _axis("m", "um", 1e6, "x", "y"), "deviation", head="Residual {}", decimals=3),
    ]
    return Table("pre-run", "Images that took no part in the minimum solution", columns)


def movement(result: Result) -> Table:
    """Return angles between the directions of a point under two attitudes."""
    found = result.movement
    names = ("ra cos dec", "declination", "azimuth sin z", "elevation")
    differences = np.reshape([m.differences for m in found], (-1, 4))
    columns = [
        _named([f"{m.second} - {m.first}" for m in found], "", "Pair"),
        of_each(found, "first"),
        of_each(found, "second"),
        of_each(found, "xy", _MM[:1], "deviation", head="x = y", decimals=0),
        of_each(found, "angle", _angles(), "deviation", head="Angle", decimals=3),
        of_each(found, "mean_error", _angles(), "deviation", head="Mean error", decimals=3),
        Quantity(differences, _angles(*names), "deviation", member="differences", head="{}", decimals=3),
    ]
    about = "Angles between the directions of a point of the plate under two attitudes."
    return Table("movement", "Movement of the camera", columns, about=about)


def distortion(result: Result) -> Table:
    """Return distortion and its mean errors over the distance from its centre."""
    curves = distortion_curves(result) if result.problem.options.curves else None
    columns = [
        Quantity(getattr(curves, name, _NONE), axes, "deviation", head=head, decimals=decimals)
        for name, head, axes, decimals in (
            ("distance", "Distance", _MM[:1], 1),
            ("radial", "Radial", _UM_OF_M, 3),
            ("radial_error", "Mean error", _UM_OF_M, 3),
            ("transformed", "Transformed", _UM_OF_M, 3),
            ("transformed_error", "Mean error", _UM_OF_M, 3),
            ("decentering", "Decentering", _UM_OF_M, 3),
            ("decentering_error", "Mean error", _UM_OF_M, 3),
        )
    ]
    about = (
        "Over the distance from its centre, with mean errors. Transformed: for the calibrated principal"
        " distance, with which it is zero at the crossover."
    )
    return Table("distortion", "Distortion", columns, about=about)


def refraction(result: Result) -> Table:
    """Return refraction around the axes with the given and the corrected coefficients."""
    groups = solved_groups(result) if result.problem.options.refraction else {}
    curves = [refraction_curves(result, group) for group in groups.values()]
    names = np.repeat([*groups], [len(curve.zenith_distance) for curve in curves])
    columns = [
        _named(names, "", "Orientation"),
        *(
            Quantity(
                np.concatenate([_NONE, *(getattr(curve, name) for curve in curves)]),
                axes,
                "deviation",
                head=head,
                decimals=decimals,
            )
            for name, head, axes, decimals in (
                ("zenith_distance", "Zenith distance", _degrees(), 3),
                ("given", "Given", _angles(), 4),
                ("corrected", "Corrected", _angles(), 4),
                ("error", "Mean error", _angles(), 4),
            )
        ),
    ]
    return Table("refraction", "Refraction curves", columns)


def histograms(result: Result) -> list[Table]:
    """Return classes of the residuals of known stars, with the numbers of the normal curve."""
    tables = []
    for name, values in residual_classes(result).items():
        found = histogram(1e6 * values)
        columns = [
            Quantity(found.edges[:-1], _UM[:1], "deviation", head="From", decimals=3),
            Quantity(found.edges[1:], _UM[:1], "deviation", head="To", decimals=3),
            Quantity(found.counts, head="Number"),
            Quantity(found.expected, head="Normal", decimals=2),
        ]
        note = f"mean {found.mean:.4f} µm, standard deviation {found.sd:.4f} µm"
        tables.append(Table(f"histogram-{name}", f"Residuals in {name}", columns, note))
    return tables


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
