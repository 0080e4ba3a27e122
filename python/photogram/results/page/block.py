"""The page of an adjusted block."""

from __future__ import annotations

import math

import numpy as np

from photogram.results.axes import image_axes, point_axes
from photogram.results.findings import tested_observations
from photogram.results.group_sums import observables, sums_of
from photogram.results.grouping import grouped
from photogram.results.page.cameras import cameras_section
from photogram.results.page.features import features_section
from photogram.results.page.observed import worst_images, worst_of
from photogram.results.page.parts import (
    images_facts,
    iterations_section,
    precision_table,
    tests_section,
    unit_weight,
    worst_section,
)
from photogram.results.page.pictures import drawings
from photogram.results.page.tables import (
    beside_section,
    check_section,
    control_section,
    photos_section,
    points_section,
    stations_section,
)
from photogram.results.report import problems_of
from photogram.results.result import Result
from photogram.results.tables import block_points, unknowns
from photogram.show.cells import page_table, unit_written
from photogram.show.judgement import judged, remarks_section
from photogram.show.page import Column, Drawing, Fact, Facts, Page, Part, Section, Table, significant
from photogram.statistics.findings import by_w
from photogram.statistics.reliability import TESTABLE

__all__ = ["block_page"]


@np.errstate(over="ignore", invalid="ignore")
def block_page(result: Result) -> Page:
    """Return the report of an adjusted block for the browser."""
    block = result.block
    pictures = drawings(result)
    groups = [by_w(each) for each in tested_observations(result)]
    found = worst_of(groups)
    worst = worst_images(found)
    photos, points = block.image_photos[worst].tolist(), block.image_points[worst].tolist()
    sections = [
        _network_section(result, pictures),
        features_section(result.features, pictures["features"]),
        _size_section(result),
        _residuals_section(pictures),
        _redundancy_section(result, pictures),
        tests_section(result, pictures.get("tests")),
        worst_section(result, groups, found),
        control_section(result),
        check_section(result),
        beside_section(result),
        stations_section(result),
        cameras_section(
            result, [pictures[name] for name in ("correlations", "distortion") if name in pictures]
        ),
        _unknowns_section(result),
        photos_section(result, photos, _datum(result)),
        points_section(result, block_points(result), points, _datum(result)),
        iterations_section(result),
        remarks_section(problems_of(result)),
    ]
    return Page(
        what="Adjustment of a block of photos",
        title=block.title,
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=_highlights(result),
        sections=sections,
        phases=result.seconds,
    )


def _highlights(result: Result) -> list[Fact]:
    used, axes, (image, _) = result.used_images, point_axes(result.block), image_axes(result.block.image_unit)
    factors = np.array([axis.factor for axis in axes])
    found = [
        unit_weight(result),
        Fact(
            "Photos",
            f"{len(result.block.photo_ids):,}",
            note=f"{np.count_nonzero(result.used_points):,} points, {np.count_nonzero(used):,} images",
        ),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:,.0f}"),
    ]
    residuals = result.residuals[used] * image.factor
    if residuals.size:
        rms = math.sqrt(float((residuals**2).mean()))
        found.append(Fact("rms of image residuals", significant(rms, 3), unit_written(image.small)))
    check = result.used_points & (result.point_kinds == "check")
    if check.any():
        worst = zip(axes, _rms_of(result.point_differences[check] * factors), strict=True)
        note = ", ".join(f"{axis.name} {significant(each, 2)}" for axis, each in worst if math.isfinite(each))
        unit = "" if result.geographic else f" {axes[2].small}"
        found.append(Fact("Check points", f"{np.count_nonzero(check)}", note=f"rms {note}{unit}"))
    height = result.point_sd[result.used_points]
    known = height[np.isfinite(height).all(axis=1)] * factors
    if len(known):
        x, y, z = (significant(float(each), 2) for each in np.median(known, axis=0))
        units = [unit_written(axis.small) for axis in axes]
        note = f"{axes[0].name} {x} {units[0]}, {axes[1].name} {y} {units[1]}"
        found.append(Fact(f"sd of points in {axes[2].name}, median", z, units[2], note))
    return found


def _rms_of(values: np.ndarray) -> list[float]:
    """Return the rms of the finite values of each column."""
    found = []
    for column in values.T:
        own = column[np.isfinite(column)]
        found.append(math.sqrt(float(np.mean(own**2))) if own.size else math.nan)
    return found


def _size_section(result: Result) -> Section:
    block = result.block
    kinds = result.point_kinds[result.used_points].tolist()
    held = (np.isfinite(block.point_sd) & result.used_points[:, np.newaxis]).sum(axis=0)
    facts = [
        Fact("Photos", f"{len(block.photo_ids)}"),
        *([Fact("Cameras", f"{len(block.cameras)}")] if block.cameras else []),
        Fact(
            "Points",
            f"{len(kinds)}",
            note=", ".join(
                f"{kinds.count(kind)} {name}"
                for kind, name in (("pass", "tie"), ("control", "control"), ("check", "check"))
            ),
        ),
        Fact(
            "Held components of control",
            ", ".join(f"{axis.name} {count}" for axis, count in zip(point_axes(block), held, strict=True)),
        ),
        Fact("Image points", f"{int(result.used_images.sum())} used of {len(block.image_xy)}"),
        *(
            Fact(f"Observations: {each.kind}", f"{each.used} used of {len(each.rows)}")
            for each in result.kinds.values()
        ),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:.8g}"),
        Fact("Object space", "geographic" if block.geographic else "rectangular"),
        Fact("Rotation angles", "photo to ground" if block.photo_to_ground else "ground to photo"),
        Fact("Datum", str(result.datum)),
        Fact("Refraction", block.refraction.describe(block.linear_unit) if block.refraction else "none"),
    ]
    if result.dropped:
        facts.append(Fact("Points left out", f"{len(result.dropped)}", note=_reasons(result)))
    variance = result.variance_of_unit_weight
    good = [
        Fact(
            "Variance of unit weight",
            f"{variance:.6f}" if variance is not None else "undefined",
            note=_BASIS[result.unit_variance],
        ),
        *images_facts(result),
    ]
    parts: list[Part] = [
        Facts("How much", facts),
        Facts("How good", good),
        *precision_table(result),
    ]
    return Section("size", "How much, how good", parts)


_BASIS = {
    "free": "rule of 1987: the weights of photos and cameras do not count",
    "constrained": "of all weighted values, those of photos and cameras among them",
    "unity": "set to 1",
    "redundancy": "based on redundancy numbers",
}


def _reasons(result: Result) -> str:
    reasons: dict[str, int] = {}
    for reason in result.dropped.values():
        reasons[reason] = reasons.get(reason, 0) + 1
    return ", ".join(f"{count}: {reason}" for reason, count in reasons.items())


def _network_section(result: Result, pictures: dict[str, Drawing]) -> Section:
    return Section("network", "Plan of the network", [pictures["network"]] if "network" in pictures else [])


def _residuals_section(pictures: dict[str, Drawing]) -> Section:
    return Section("residuals", "Image residuals", [pictures["residuals"]] if "residuals" in pictures else [])


def _redundancy_section(result: Result, pictures: dict[str, Drawing]) -> Section:
    parts: list[Part] = [pictures["redundancy"]] if "redundancy" in pictures else []
    if table := _redundancy_table(result):
        parts.append(table)
    intro = (
        "The redundancy number of an observation is the share of its error that shows in its own"
        " residual; the rest"
        " goes into the unknowns. Their sum is the number of observations beyond what is needed."
    )
    return Section("redundancy", "Redundancy", parts, intro)


def _redundancy_table(result: Result) -> Table | None:
    if result.redundancies is None or result.loss is not None:
        return None
    grouping = grouped(observables(result), "kind")
    counts, squares, redundancy = sums_of(result, grouping)
    rows: list[list[str | float | None]] = [
        [name, int(count), float(r), float(square), math.sqrt(square / r) if r > TESTABLE else None]
        for name, count, square, r in zip(grouping.groups.names, counts, squares, redundancy, strict=True)
    ]
    others = result.redundancies.total - float(redundancy.sum())
    if abs(others) > TESTABLE:
        rows.append(["cameras and common unknowns", None, others, None, None])
    rows.append(["all", None, result.redundancies.total, result.sums_of_squares.total, None])
    columns = (
        Column("Kind of observation", text=True),
        Column("Number", decimals=0),
        Column("Redundancy", decimals=2),
        Column("Weighted sum of squares", decimals=2),
        Column("Factor of sd", decimals=3),
    )
    note = (
        "The factor is the root of sum over redundancy: what standard deviations of the kind would have to be"
        " multiplied by to agree, if the others are right."
    )
    return Table("Redundancy by kind of observation", columns, rows, note)


def _unknowns_section(result: Result) -> Section:
    if not result.unknowns:
        return Section("unknowns", "Common unknowns", [])
    intro = (
        "Lever arms, boresights, sensors, levels, planes and lines that several observations have in common."
    )
    table = page_table("Common unknowns", unknowns(result.unknowns))
    return Section("unknowns", "Common unknowns", [table], intro)


def _datum(result: Result) -> str:
    return (
        f"Coordinates and standard deviations refer to the datum that is {result.datum}."
        if not result.datum.is_chosen
        else f"Datum: {result.datum}."
    )
