"""The page of an adjusted block."""

from __future__ import annotations

import math

import numpy as np

from photogram.results.axes import point_axes
from photogram.results.courses import POSES, courses_table, notable, notable_courses
from photogram.results.page.cameras import cameras_section
from photogram.results.page.features import features_section
from photogram.results.page.films import films_section
from photogram.results.page.parts import network_page, size_section
from photogram.results.page.pictures import drawings
from photogram.results.page.tables import beside_section, check_section, control_section, stations_section
from photogram.results.report import size_of
from photogram.results.result import Result
from photogram.results.tables import redundancy_by_kind, unknowns
from photogram.show.cells import page_table, unit_written
from photogram.show.methods import page_of
from photogram.show.page import Fact, Page, Section, Table, significant

__all__ = ["block_page"]


@page_of.register(Result)
@np.errstate(over="ignore", invalid="ignore")
def block_page(result: Result) -> Page:
    """Return the report of an adjusted block for the browser."""
    pictures = drawings(result)
    given = [
        control_section(result),
        check_section(result),
        beside_section(result),
        stations_section(result),
        cameras_section(result, [pictures[name] for name in ("correlations", "distortion")]),
        films_section(result, pictures["films"]),
        _unknowns_section(result),
    ]
    return network_page(
        result,
        "Adjustment of a block of photos",
        _size_section(result),
        given,
        photos=len(result.block.photo_ids),
        title=result.block.title,
        more=_accuracy(result),
        redundancy=_redundancy_tables(result),
        beside=[features_section(result.features, pictures["features"])],
        datum=_datum(result),
        poses=POSES if result.block.timed else "",
    )


def _accuracy(result: Result) -> list[Fact]:
    """Return what check points say, and standard deviations of points."""
    axes, found = point_axes(result.block), list[Fact]()
    factors = np.array([axis.factor for axis in axes])
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
    variance, more = result.variance_of_unit_weight, list[Fact]()
    if result.dropped:
        more.append(Fact("Points left out", f"{len(result.dropped)}", note=_reasons(result)))
    value = f"{variance:.6f}" if variance is not None else "undefined"
    good = [Fact("Variance of unit weight", value, note=_BASIS[result.unit_variance])]
    return size_section(result, size_of(result), more, good)


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


def _redundancy_tables(result: Result) -> list[Table]:
    note = (
        "The factor is the root of sum over redundancy: what standard deviations of the kind would have to be"
        " multiplied by to agree, if the others are right."
    )
    table = page_table("Redundancy by kind of observation", redundancy_by_kind(result), note)
    return [table] if table.rows else []


def _unknowns_section(result: Result) -> Section:
    if not result.unknowns:
        return Section("unknowns", "Common unknowns", [])
    intro = (
        "Lever arms, boresights, sensors, levels, planes and lines that several observations have in common;"
        " clocks, readout times and coefficients of trajectories."
    )
    (shown, note), (every, said) = notable(result.unknowns), notable_courses(result)
    tables = [page_table("Common unknowns", unknowns(shown), _sentence(note))] if shown else []
    if every:
        said = said or "The largest correction in the span of the table, and its time."
        tables.append(
            page_table("Trajectories", courses_table(every, result.block.linear_unit), _sentence(said))
        )
    return Section("unknowns", "Common unknowns", tables, intro)


def _sentence(said: str) -> str:
    return f"{said[:1].upper()}{said[1:].removesuffix('.')}." if said else ""


def _datum(result: Result) -> str:
    return (
        f"Coordinates and standard deviations refer to the datum that is {result.datum}."
        if not result.datum.is_chosen
        else f"Datum: {result.datum}."
    )
