"""Document of a plate calibration with stars."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import replace
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import (
    Document,
    Fact,
    Facts,
    Layers,
    Remarks,
    Section,
    about,
    conventions,
    significant,
)
from photogram.show.quantity import Table, members
from photogram.stellar import tables
from photogram.stellar.camera_tables import (
    UM_OF_M,
    correlated_members,
    matrix_table,
    plate_tests,
    worst_table,
)
from photogram.stellar.comparison import TERM_LEVEL, equal
from photogram.stellar.curves import (
    comparator_frame,
    distortion_curves,
    histogram,
    refraction_curves,
    residual_classes,
)
from photogram.stellar.parameters import GRAD, GROUPS, INDEX
from photogram.stellar.pictures import plate_drawings
from photogram.stellar.printout import descriptors, have_common_weight
from photogram.stellar.sky import Site

if TYPE_CHECKING:
    from photogram.stellar import Result


def plate_document(result: Result) -> Document:
    problem = result.problem
    size = [Facts("Size", _much(result)), Facts("Fit", _good(result))]
    of_solution = _solution_sections(result)
    sections = [
        Section("pictures", "Stars and residuals", [plate_drawings(result)]),
        Section("size", "Size and fit", size),
        of_solution.pop("parameters"),
        of_solution.pop("derived"),
        Section.of(worst_table(result.verdict, plate_tests(result)[0], result.solved.residuals, UM_OF_M)),
        Section.of(verdict_table(result.verdict)),
        of_solution.pop("directions"),
        of_solution.pop("distortion"),
        Section.of(tables.movement(result)),
        remarks_section(result.messages),
    ]
    options = problem.options
    histograms = tables.histograms(result) if options.histogram else []
    forms = [
        "SCALE AFTER DISTORTION" if options.distortion_first else "SCALE BEFORE DISTORTION",
        "ITERATION AS PUBLISHED" if options.as_published else "STRICT ITERATION",
    ]
    details = [
        Section("problem", "Problem", [Facts("Problem", _problem(result))]),
        Section("descriptors", "Problem descriptors", [Remarks([*descriptors(result), *forms])]),
        *map(Section.of, tables.stages(result)),
        Section("residuals", "Residuals", [Facts("Residuals", _residuals(result))]),
        *of_solution.values(),
        Section.of(tables.pre_run(result)),
        Section.of(tables.fictitious(result)),
        Section("histogram", "Histogram of residuals", [Layers("histogram-layers", histograms)]),
        *_combined(result),
    ]
    return verdict_document(
        result.verdict,
        "Calibration of a camera by a plate with stars",
        problem.labels.get("title", ""),
        highlights=_highlights(result),
        sections=sections,
        members=_members(result),
        details=details,
    )


def _solution_sections(result: Result) -> dict[str, Section]:
    """Return sections common to separate and combined attitudes, by key."""
    rows = [INDEX[name] for name in result.estimated]
    cofactors = result.solved.cofactors[np.ix_(rows, rows)]
    title = "Inverse of the reduced normal equations"
    found = [
        *tables.parameters(result),
        tables.transformed(result),
        tables.stars(result),
        tables.directions(result),
        tables.images(result),
        tables.means(result),
        tables.distortion(result),
        tables.refraction(result),
        matrix_table("cofactors", title, result.estimated, cofactors, figures=10),
    ]
    derived = Section("derived", "Derived values", [Facts("Derived values", _derived(result))])
    return {table.key: Section.of(table) for table in found} | {"derived": derived}


def _combined(result: Result) -> list[Section]:
    combined = result.combined
    if combined is None:
        return []
    names = sorted({name for pair in combined.pairs for name in pair}, key=GROUPS.index)
    intro = f"ORIENTATIONS FROM {', '.join(names).upper()} CONSTRAINED TO COMMON VALUES"
    good = [*_good(combined), *_residuals(combined)]
    size = [Facts("Size", _much(combined)), Facts("Fit", good)]
    sections = [Section("combined", "Combined solution", size, intro)]
    for key, section in _solution_sections(combined).items():
        title = f"Combined solution: {section.title}"
        parts = [replace(p, key=f"combined.{key}") if isinstance(p, Table) else p for p in section.parts]
        sections.append(replace(section, key=f"combined-{key}", title=title, parts=parts))
    return sections


def _members(result: Result) -> dict[str, Any]:
    options, pre_run = result.problem.options, result.pre_run
    classes = residual_classes(result) if options.histogram else {}
    return {
        "labels": result.problem.labels,
        "conventions": conventions("plate")
        | {"iteration": "as published" if options.as_published else "strict"},
        **_solution_members(result),
        "stop": result.solved.stop,
        "converged": result.converged,
        "messages": [*map(str, result.messages)],
        "correlated": correlated_members(result.correlated()),
        "significance": result.significance(),
        "pre_run": pre_run
        and {**members(pre_run, "points", "stars"), "residual_um": 1e6 * pre_run.residuals},
        "histogram": {axis: histogram(values) for axis, values in classes.items()} or None,
        "combined": result.combined
        and {"pairs": result.combined.pairs, **_solution_members(result.combined)},
    }


def _solution_members(result: Result) -> dict[str, Any]:
    estimated = [INDEX[name] for name in result.estimated]
    options, residual = result.problem.options, result.solved.axis_residual
    groups, angle = result.groups if options.refraction else (), options.comparator_angle
    return {
        **members(result, "degrees_of_freedom", "counts", m="mean_error", m_computed="computed_mean_error"),
        "m_unit": "m",
        "sums_of_squares": dict(zip(("plate", "stars", "parameters"), result.solved.sums, strict=True)),
        "covariance": {
            "order": result.estimated,
            "matrix": result.covariance[np.ix_(estimated, estimated)],
        },
        "axis_residual_um": None if residual is None else 1e6 * residual,
        "transformed": options.reference and result.transformed_attitudes(),
        "comparator_frame": None if angle is None else comparator_frame(result, angle),
        "distortion_curves": distortion_curves(result) if options.curves else None,
        "refraction_curves": {name: refraction_curves(result, name) for name in groups},
    }


_UNIT = "of a plate coordinate of weight 1"


def _highlights(result: Result) -> list[Fact]:
    x, y = np.sqrt((result.solved.residuals**2).mean(axis=0)) * 1e6
    known = int(result.problem.known.sum())
    stars = f"{known} known, {len(result.problem.image_stars)} images"
    return [
        Fact.of("Mean error of unit weight", 1e6 * result.mean_error, "µm", _UNIT, figures=4),
        Fact.of("rms of plate residuals, x", x, "µm", f"y {significant(float(y), 3)} µm", figures=3),
        Fact.of("Stars", len(result.problem.star_ids), note=stars),
        Fact.of("Degrees of freedom", result.degrees_of_freedom),
    ]


def _much(result: Result) -> list[Fact]:
    problem, counts = result.problem, result.counts
    known = int(problem.known.sum())
    of_known = problem.known[problem.image_stars]
    groups = [problem.image_groups == g for g in range(3)]
    points = ", ".join(f"{int((g & of_known).sum())} / {int((g & ~of_known).sum())}" for g in groups)
    observations = (
        f"{counts.plate_observations} of the plate, {counts.star_observations} of stars,"
        f" {counts.parameter_observations} of parameters, {counts.constraints} constraints"
    )
    unknowns = f"{counts.parameter_unknowns} parameters, {counts.star_unknowns} of stars"
    unique = "" if counts.degrees_of_freedom else "unique; 1 used"
    return [
        Fact("Stars", f"{known} known, {len(problem.star_ids) - known} unknown"),
        Fact.of("Images on the plate", len(problem.image_stars)),
        Fact("Images pre, post, event", points, note="of known / unknown stars"),
        Fact.of("Observations", counts.observations, note=observations),
        Fact.of("Unknowns", counts.unknowns, note=unknowns),
        Fact.of("Degrees of freedom", counts.degrees_of_freedom, note=unique),
        Fact("Stop", result.solved.stop.capitalize()),
    ]


def _good(result: Result) -> list[Fact]:
    sums = result.solved.sums
    squares = zip(("plate", "stars", "parameters", "total"), (*sums, sum(sums)), strict=True)
    pair, freedom, scales = [INDEX["cx"], INDEX["cy"]], result.degrees_of_freedom, about("scales.none")
    if result.solved.free[pair].all() and freedom:
        f, p = equal(result.solved.parameters[pair], result.covariance[np.ix_(pair, pair)], freedom)
        code = f"scales.{'refused' if p < TERM_LEVEL else 'kept'}"
        scales = about(code, f=f, freedom=freedom, p=p, level=TERM_LEVEL)
    return [
        Fact.of("Mean error of unit weight, computed", 1e6 * result.computed_mean_error, "µm", figures=9),
        Fact.of("Mean error of unit weight, in use", 1e6 * result.mean_error, "µm", _UNIT, figures=9),
        *(
            Fact.of(f"Weighted sum of squares, {name}", 1e12 * square, "µm²", figures=9)
            for name, square in squares
        ),
        Fact("Test of cx = cy", scales),
    ]


def _residuals(result: Result) -> list[Fact]:
    problem, residuals = result.problem, 1e6 * result.solved.residuals.T
    weights = problem.star_weights[problem.known & ~problem.held]
    return [
        _prior(result, "Common mean error of the plate", problem.image_weights, 1e-6, "µm"),
        _prior(result, "Common mean error of the stars", weights, ARCSEC, "arcsec"),
        *(
            Fact.of(
                f"Sums of {axis} residuals: +, -, both",
                (v[v > 0].sum(), v[v < 0].sum(), v.sum()),
                "µm",
                decimals=3,
            )
            for axis, v in zip("xy", residuals, strict=True)
        ),
    ]


def _prior(result: Result, name: str, weights: Floats, size: float, unit: str) -> Fact:
    if not len(weights) or not have_common_weight(weights):
        return Fact(name, "individual weights" if len(weights) else "-")
    return Fact.of(name, result.mean_error / np.sqrt(np.diag(weights[0])) / size, unit, decimals=4)


def _derived(result: Result) -> list[Fact]:
    options, given, residual = result.problem.options, result.problem.axis, result.solved.axis_residual
    facts = []
    for name, *terms in (("XS", "xp", "dx"), ("YS", "yp", "dy")):
        rows = [INDEX[term] for term in terms]
        error = np.sqrt(max(float(result.covariance[np.ix_(rows, rows)].sum()), 0.0))
        value, note = result.solved.parameters[rows].sum(), f"mean error {significant(error, 8)} m"
        facts.append(Fact.of(f"{name} = {terms[0]} + {terms[1]}", value, "m", note, figures=10))
    if options.curves:
        curves = distortion_curves(result)
        error = f"mean error {significant(1e6 * curves.calibrated_error, 4)} µm"
        facts += [
            Fact.of("Calibrated principal distance", curves.calibrated, "m", error, decimals=9),
            Fact.of("Crossover", 1e3 * options.crossover, "mm"),
        ]
    if options.comparator_angle is not None:
        frame = comparator_frame(result, options.comparator_angle)
        errors = np.divide(frame.mean_errors, [1, 1, GRAD])
        x, y, oblique = (about("mean-error", error=error) for error in errors)
        facts += [
            Fact.of("Comparator, angle x to y", options.comparator_angle / GRAD, "grads", decimals=9),
            Fact.of("Comparator, scale x", frame.scale_x, note=x, decimals=12),
            Fact.of("Comparator, scale y", frame.scale_y, note=y, decimals=12),
            Fact.of("Comparator, epsilon", frame.epsilon / GRAD, "grads", oblique, decimals=9),
        ]
    if given is not None and residual is not None:
        weight = given.weight
        south = "from south, positive west"
        facts += [
            Fact("Axis, orientation", GROUPS[given.group]),
            Fact("Axis, azimuth", tables.degrees(given.azimuth), note=south),
            Fact("Axis, elevation", tables.degrees(np.pi / 2 - given.zenith_distance)),
            Fact.of("Axis, plate x, y", 1e3 * given.xy, "mm", decimals=6),
            Fact.of("Axis, weights", (weight[0, 0], weight[1, 1], weight[0, 1])),
            Fact.of("Axis, residuals", 1e6 * residual, "µm", decimals=3),
        ]
    return facts


def _problem(result: Result) -> list[Fact]:
    site, o = result.problem.site, result.problem.options
    facts = [
        *(Fact(name, value) for name, value in result.problem.labels.items()),
        *_station("Station", site),
        Fact.of("Elevation", site.elevation, "m", decimals=4),
        Fact.of("Temperature", site.air.temperature, "K", decimals=2),
        Fact.of("Pressure", site.air.pressure, "mm of mercury", decimals=2),
        Fact.of("Diurnal aberration at the equator", site.aberration / ARCSEC, "arcsec", decimals=4),
        Fact.of("Tolerance of levels", o.tolerance, "m"),
        Fact.of("Tolerance of refraction", o.refraction_tolerance / ARCSEC, "arcsec"),
        Fact.of("Tolerance of distortion", o.distortion_tolerance, "m"),
        Fact.of("Crossover, interval, end of curves", (o.crossover, o.interval, o.extent), "m"),
        Fact.of("Factor k of the movement test", o.movement_factor),
        Fact("Time of the fictitious points", tables.hours(o.movement_time)),
    ]
    if o.reference is not None:
        facts += [
            *_station("Reference station", o.reference),
            Fact.of("Pole x, y", np.divide(o.pole, ARCSEC), "arcsec", decimals=4),
        ]
    return facts


def _station(name: str, site: Site) -> list[Fact]:
    return [
        Fact(name, f"{site.number} {site.name}".strip() or "-"),
        Fact(f"{name}, latitude", tables.degrees(site.latitude)),
        Fact(f"{name}, longitude west", tables.degrees(site.longitude_west)),
    ]
