"""Document of a plate calibration with stars."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.show.angles import ARCSEC
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.page import Document, Fact, Facts, Layers, Remarks, Section, significant
from photogram.show.quantity import Table, members
from photogram.stellar import tables
from photogram.stellar.camera_tables import correlated_members, matrix_table
from photogram.stellar.curves import (
    comparator_frame,
    distortion_curves,
    histogram,
    refraction_curves,
    residual_classes,
)
from photogram.stellar.lens_choice import LEVEL, equal
from photogram.stellar.night_document import pictures
from photogram.stellar.parameters import GRAD, GROUPS, INDEX
from photogram.stellar.plots import sketches
from photogram.stellar.printout import descriptors, have_common_weight
from photogram.stellar.sky import Site

if TYPE_CHECKING:
    from photogram.stellar import Result

MAX_WORST_COORDINATES = 25

CONVENTIONS = {
    "frame": "north, east, zenith (left-handed); azimuth from south, positive west",
    "longitude": "positive west",
    "residual": "computed minus measured; of stars adjusted minus catalogue",
    "standardized": "residual over its mean error",
    "covariance": "cofactors times m squared, in the units of the parameters",
}


def plate_document(result: Result) -> Document:
    """Return the document of a plate."""
    problem = result.problem
    size = [Facts("How much", _much(result)), Facts("How good", _good(result))]
    of_solution = _solution_sections(result)
    sections = [
        Section("pictures", "Stars and residuals", [pictures(sketches(result))]),
        Section("size", "How much, how good", size),
        of_solution.pop("parameters"),
        of_solution.pop("derived"),
        Section.of(tables.worst(result, MAX_WORST_COORDINATES)),
        tests_section(result.verdict),
        of_solution.pop("directions"),
        of_solution.pop("distortion"),
        Section.of(tables.movement(result)),
        remarks_section(result.messages),
    ]
    histograms = tables.histograms(result) if problem.options.histogram else []
    details = [
        Section("problem", "Problem", [Facts("Problem", _problem(result))]),
        Section("descriptors", "Problem descriptors", [Remarks([*descriptors(result), *_forms(result)])]),
        *map(Section.of, tables.stages(result)),
        Section("residuals", "Residuals", [Facts("Residuals", _residuals(result))]),
        *of_solution.values(),
        Section.of(tables.pre_run(result)),
        Section.of(tables.fictitious(result)),
        Section("histogram", "Histogram of residuals", [Layers("histogram-layers", histograms)]),
        *_combined(result),
    ]
    return Document(
        what="Calibration of a camera by a plate with stars",
        title=problem.labels.get("title", ""),
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
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
    size = [Facts("How much", _much(combined)), Facts("How good", good)]
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
        "conventions": CONVENTIONS | {"iteration": "as published" if options.as_published else "strict"},
        **_solution_members(result),
        "stop": result.solved.stop,
        "converged": result.converged,
        "verdict": result.verdict.document(),
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
    groups, angle = tables.solved_groups(result) if options.refraction else {}, options.comparator_angle
    return {
        **members(result, "degrees_of_freedom", "counts", m="mean_error", m_computed="computed_mean_error"),
        "m_unit": "m",
        "sums_of_squares": dict(zip(("plate", "stars", "parameters"), result.solved.sums, strict=True)),
        "covariance": {
            "order": result.estimated,
            "matrix": result.covariance[np.ix_(estimated, estimated)],
        },
        "axis_residual_um": None if residual is None else 1e6 * residual,
        "transformed": options.reference and tables.transformed_attitudes(result),
        "comparator_frame": None if angle is None else comparator_frame(result, angle),
        "distortion_curves": distortion_curves(result) if options.curves else None,
        "refraction_curves": {name: refraction_curves(result, g) for name, g in groups.items()},
    }


_UNIT = "of a plate coordinate of weight 1"


def _highlights(result: Result) -> list[Fact]:
    x, y = np.sqrt((result.solved.residuals**2).mean(axis=0)) * 1e6
    known = int(result.problem.known.sum())
    stars = f"{known} known, {len(result.problem.image_stars)} images"
    return [
        Fact("Mean error of unit weight", significant(1e6 * result.mean_error, 4), "µm", _UNIT),
        Fact("rms of plate residuals, x", significant(float(x), 3), "µm", f"y {significant(float(y), 3)} µm"),
        Fact("Stars", f"{len(result.problem.star_ids)}", note=stars),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom}"),
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
        Fact("Images on the plate", f"{len(problem.image_stars)}"),
        Fact("Images pre, post, event", points, note="of known / unknown stars"),
        Fact("Observations", f"{counts.observations}", note=observations),
        Fact("Unknowns", f"{counts.unknowns}", note=unknowns),
        Fact("Degrees of freedom", f"{counts.degrees_of_freedom}", note=unique),
        Fact("Stop", result.solved.stop.capitalize()),
    ]


def _good(result: Result) -> list[Fact]:
    sums = result.solved.sums
    squares = zip(("plate", "stars", "parameters", "total"), (*sums, sum(sums)), strict=True)
    return [
        Fact("Mean error of unit weight, computed", significant(1e6 * result.computed_mean_error, 9), "µm"),
        Fact("Mean error of unit weight, in use", significant(1e6 * result.mean_error, 9), "µm", _UNIT),
        *(
            Fact(f"Weighted sum of squares, {name}", significant(1e12 * float(square), 9), "µm²")
            for name, square in squares
        ),
        Fact("Test of cx = cy", _scale_test(result)),
    ]


def _residuals(result: Result) -> list[Fact]:
    problem, residuals = result.problem, 1e6 * result.solved.residuals.T
    weights = problem.star_weights[problem.known & ~problem.held]
    return [
        Fact("Common mean error of the plate", *_before(result, problem.image_weights, 1e-6, "µm")),
        Fact("Common mean error of the stars", *_before(result, weights, ARCSEC, "arcsec")),
        *(
            Fact(
                f"Sums of {axis} residuals: +, -, both",
                f"{v[v > 0].sum():.3f}, {v[v < 0].sum():.3f}, {v.sum():z.3f}",
                "µm",
            )
            for axis, v in zip("xy", residuals, strict=True)
        ),
    ]


def _before(result: Result, weights: Floats, unit: float, name: str) -> tuple[str, str]:
    """Return the text of the prior mean errors from a common weight."""
    if not len(weights) or not have_common_weight(weights):
        return "individual weights" if len(weights) else "-", ""
    x, y = result.mean_error / np.sqrt(np.diag(weights[0])) / unit
    return f"{x:.4f}, {y:.4f}", name


def _scale_test(result: Result) -> str:
    pair, freedom = [INDEX["cx"], INDEX["cy"]], result.degrees_of_freedom
    if not (result.solved.free[pair].all() and freedom):
        return "not made: they are not estimated both"
    f, probability = equal(result.solved.parameters[pair], result.covariance[np.ix_(pair, pair)], freedom)
    verdict = "refused" if probability < LEVEL else "not refused"
    degrees = f"1 and {freedom} degrees of freedom"
    return f"F = {f:.2f} with {degrees}, probability {probability:.2G}: {verdict} at {LEVEL:g}"


def _derived(result: Result) -> list[Fact]:
    options, given, residual = result.problem.options, result.problem.axis, result.solved.axis_residual
    facts = []
    for name, *terms in (("XS", "xp", "dx"), ("YS", "yp", "dy")):
        rows = [INDEX[term] for term in terms]
        error = np.sqrt(max(float(result.covariance[np.ix_(rows, rows)].sum()), 0.0))
        value = f"{result.solved.parameters[rows].sum():.10g}"
        facts.append(Fact(f"{name} = {terms[0]} + {terms[1]}", value, "m", f"mean error {error:.8g} m"))
    if options.curves:
        curves = distortion_curves(result)
        error = f"mean error {significant(1e6 * curves.calibrated_error, 4)} µm"
        facts += [
            Fact("Calibrated principal distance", f"{curves.calibrated:.9f}", "m", error),
            Fact("Crossover", f"{1e3 * options.crossover:g}", "mm"),
        ]
    if options.comparator_angle is not None:
        frame = comparator_frame(result, options.comparator_angle)
        x, y, oblique = (f"mean error {error:.3e}" for error in np.divide(frame.mean_errors, [1, 1, GRAD]))
        facts += [
            Fact("Comparator, angle x to y", f"{options.comparator_angle / GRAD:.9f}", "grads"),
            Fact("Comparator, scale x", f"{frame.scale_x:.12f}", note=x),
            Fact("Comparator, scale y", f"{frame.scale_y:.12f}", note=y),
            Fact("Comparator, epsilon", f"{frame.epsilon / GRAD:.9f}", "grads", oblique),
        ]
    if given is not None and residual is not None:
        (x, y), (vx, vy), weight = 1e3 * given.xy, 1e6 * residual, given.weight
        weights = ", ".join(f"{value:.6G}" for value in (weight[0, 0], weight[1, 1], weight[0, 1]))
        south = "from south, positive west"
        facts += [
            Fact("Axis, orientation", GROUPS[given.group]),
            Fact("Axis, azimuth", tables.degrees(given.azimuth), note=south),
            Fact("Axis, elevation", tables.degrees(np.pi / 2 - given.zenith_distance)),
            Fact("Axis, plate x, y", f"{x:.6f}, {y:.6f}", "mm"),
            Fact("Axis, weights", weights),
            Fact("Axis, residuals", f"{vx:.3f}, {vy:.3f}", "µm"),
        ]
    return facts


def _problem(result: Result) -> list[Fact]:
    site, o = result.problem.site, result.problem.options
    facts = [
        *(Fact(name, value) for name, value in result.problem.labels.items()),
        *_station("Station", site),
        Fact("Elevation", f"{site.elevation:.4f}", "m"),
        Fact("Temperature, pressure", f"{site.air.temperature:.2f} K, {site.air.pressure:.2f} mm of mercury"),
        Fact("Diurnal aberration at the equator", f"{site.aberration / ARCSEC:.4f}", "arcsec"),
        Fact("Tolerance of levels", f"{o.tolerance:.3E}", "m"),
        Fact("Tolerance of refraction", f"{o.refraction_tolerance / ARCSEC:.3E}", "arcsec"),
        Fact("Tolerance of distortion", f"{o.distortion_tolerance:.3E}", "m"),
        Fact("Crossover, interval, end of curves", f"{o.crossover:g}, {o.interval:g}, {o.extent:g}", "m"),
        Fact("Factor k of the movement test", f"{o.movement_factor:g}"),
        Fact("Time of the fictitious points", tables.hours(o.movement_time)),
    ]
    if o.reference is not None:
        x, y = (value / ARCSEC for value in o.pole)
        facts += [
            *_station("Reference station", o.reference),
            Fact("Pole x, y", f"{x:.4f}, {y:.4f}", "arcsec"),
        ]
    return facts


def _station(name: str, site: Site) -> list[Fact]:
    return [
        Fact(name, f"{site.number} {site.name}".strip() or "-"),
        Fact(f"{name}, latitude", tables.degrees(site.latitude)),
        Fact(f"{name}, longitude west", tables.degrees(site.longitude_west)),
    ]


def _forms(result: Result) -> list[str]:
    o = result.problem.options
    return [
        "SCALE AFTER DISTORTION" if o.distortion_first else "SCALE BEFORE DISTORTION",
        "ITERATION AS PUBLISHED" if o.as_published else "STRICT ITERATION",
    ]
