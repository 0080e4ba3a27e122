"""The page of an adjusted block."""

from __future__ import annotations

import math

import numpy as np

from photogram.results.findings import axes, tested_observations
from photogram.results.group_sums import observables, sums_of
from photogram.results.grouping import grouped
from photogram.results.page.cameras import cameras_section
from photogram.results.page.features import features_section
from photogram.results.page.frame import block_frame, degrees
from photogram.results.page.observed import Images, worst_images, worst_of
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
from photogram.results.report import image_unit, problems_of
from photogram.results.result import Result
from photogram.results.unknowns import unknown_lines
from photogram.show.judgement import judged, remarks_section
from photogram.show.page import Column, Drawing, Fact, Facts, Page, Part, Section, Table, significant
from photogram.statistics.findings import by_w
from photogram.statistics.reliability import TESTABLE

__all__ = ["block_images", "block_page"]


@np.errstate(over="ignore", invalid="ignore")
def block_page(result: Result) -> Page:
    """Return the report of an adjusted block for the browser."""
    block, images = result.block, block_images(result)
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
        worst_section(result, images, groups, found),
        control_section(result),
        check_section(result),
        beside_section(result),
        stations_section(result),
        cameras_section(
            result, [pictures[name] for name in ("correlations", "distortion") if name in pictures]
        ),
        _unknowns_section(result),
        photos_section(result, photos),
        points_section(result, points),
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


def block_images(result: Result) -> Images:
    """Return what the images of a block are called and measured in."""
    block = result.block
    unit, factor = image_unit(result)
    return Images(
        block.image_photos, block.photo_ids, block.point_ids, unit.replace("um", "µm"), factor, block.image_xy
    )


def _highlights(result: Result) -> list[Fact]:
    used, frame = result.used_images, block_frame(result)
    unit, factor = image_unit(result)
    found = [
        unit_weight(result),
        Fact(
            "Photos",
            f"{len(result.block.photo_ids):,}",
            note=f"{np.count_nonzero(result.used_points):,} points, {np.count_nonzero(used):,} images",
        ),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom:,.0f}"),
    ]
    residuals = result.residuals[used] * factor
    if residuals.size:
        rms = math.sqrt(float((residuals**2).mean()))
        found.append(Fact("rms of image residuals", significant(rms, 3), unit.replace("um", "µm")))
    check = result.used_points & (result.point_kinds == "check")
    if check.any():
        values = result.point_differences[check] * frame.factors
        worst = _rms_of(values)
        note = ", ".join(
            f"{name} {significant(each, 2)}"
            for name, each in zip(frame.names, worst, strict=True)
            if math.isfinite(each)
        )
        found.append(
            Fact(
                "Check points",
                f"{np.count_nonzero(check)}",
                note=f"rms {note} {frame.units[2]}" if len(set(frame.units)) == 1 else f"rms {note}",
            )
        )
    height = result.point_sd[result.used_points]
    known = height[np.isfinite(height).all(axis=1)] * frame.factors
    if len(known):
        middle = np.median(known, axis=0)
        note = ", ".join(
            f"{name} {significant(float(each), 2)} {u}"
            for name, each, u in zip(frame.names[:2], middle, frame.units, strict=False)
        )
        found.append(
            Fact(
                f"sd of points in {frame.names[2]}, median",
                significant(float(middle[2]), 2),
                frame.units[2],
                note,
            )
        )
    return found


def _rms_of(values: np.ndarray) -> list[float]:
    """Return the rms of the finite values of each column."""
    found = []
    for column in values.T:
        own = column[np.isfinite(column)]
        found.append(math.sqrt(float(np.mean(own**2))) if own.size else math.nan)
    return found


def _size_section(result: Result) -> Section:
    block, frame = result.block, block_frame(result)
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
            ", ".join(f"{axis} {count}" for axis, count in zip(axes(result), held, strict=True)),
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
        *images_facts(result, image_unit(result)[0].replace("um", "µm"), image_unit(result)[1]),
    ]
    turn, sd = degrees(), result.photo_sd
    precision = precision_table(
        [
            ("points", frame.names, frame.units, result.point_sd[result.used_points] * frame.factors),
            ("photos", frame.names, frame.units, sd[:, :3] * frame.factors),
            ("photos", turn.names, turn.units, sd[:, 3:] * turn.factors),
        ]
    )
    parts: list[Part] = [
        Facts("How much", facts),
        Facts("How good", good),
        *([precision] if precision else []),
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
    if not unknown_lines(result.unknowns):
        return Section("unknowns", "Common unknowns", [])
    from photogram.results.tables import table

    found = table(result, "unknown")
    count = len(found["unknown"])
    names = (
        "kind",
        "unknown",
        "component",
        "unit",
        "sd_given",
        "value",
        "change",
        "sd",
        "redundancy",
        "standardized",
    )
    rows = [[_plain(found[name][k]) for name in names] for k in range(count)]
    columns = (
        Column("Kind", text=True),
        Column("Name", text=True),
        Column("Component", text=True),
        Column("Unit", text=True),
        Column("sd given", figures=3),
        Column("Adjusted", figures=7),
        Column("Change", figures=3),
        Column("sd adjusted", figures=3),
        Column("Redundancy", decimals=3),
        Column("Test value w", decimals=2),
    )
    intro = (
        "Lever arms, boresights, sensors, levels, planes and lines that several observations have in common."
    )
    return Section("unknowns", "Common unknowns", [Table("Common unknowns", columns, rows)], intro)


def _plain(value: object) -> str | float | None:
    if value is None or isinstance(value, str):
        return value
    return float(value)  # type: ignore[arg-type]
