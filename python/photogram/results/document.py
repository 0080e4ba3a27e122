"""Text report, HTML page and JSON document (`docs/json.md`) of a block."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.network.structuring import structure
from photogram.plots.accessor import drawings
from photogram.results import network_document as of_network
from photogram.results import network_sections as sections
from photogram.results import tables as declared
from photogram.results.calibration import calibration_member, cameras_section
from photogram.results.datum import observed_control
from photogram.results.features import features_members, features_section
from photogram.results.film_report import films_section
from photogram.results.network_tables import control, plan_deviations, point_axes
from photogram.results.trajectories import notable, trajectories_table
from photogram.show.page import Document, Fact, Section, about, conventions
from photogram.show.quantity import Quantity, Table, chosen, for_people, members, named, records
from photogram.statistics.freedom import root_mean
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Result


@np.errstate(over="ignore", invalid="ignore")  # values too large for their unit are infinite
def block_document(result: Result) -> Document:
    pictures, (head, figures) = drawings(result), bandwidths(result)
    shown, note = notable(result.unknowns)
    tables = [
        Table("common-unknowns", "Common unknowns", for_people(declared.unknowns(shown)), note),
        trajectories_table(result),
    ]
    given = [
        sections.control_section(result, declared.unheld(result)),
        sections.check_section(result),
        sections.beside_section(result),
        sections.stations_section(result),
        cameras_section(result, [pictures[name] for name in ("correlations", "distortion")]),
        films_section(result, pictures["films"]),
        Section("unknowns", "Common unknowns", tables, about("unknowns")),
    ]
    title, columns = "Redundancy by kind of observation", declared.redundancy_by_kind(result)
    redundancy, datum = Table("redundancy-by-kind", title, columns, about("redundancy-by-kind")), result.datum
    return of_network.network_document(
        result,
        "Adjustment of a block of photos",
        _size_section(result),
        given,
        photos=len(result.block.photo_ids),
        title=result.block.title,
        more=_accuracy(result),
        redundancy=[redundancy],
        beside=[features_section(result.features, pictures["features"])],
        datum=about(f"datum.{'chosen' if datum.is_chosen else 'given'}", datum=datum.phrase),
        poses=about("poses") if result.block.timed else "",
        work=[Fact(f"Bandwidth {name}", value, note=head) for name, value in figures],
        members=partial(_members, result),
    )


def _accuracy(result: Result) -> list[Fact]:
    axes, found = point_axes(result.block), list[Fact]()
    factors, names = np.array([axis.factor for axis in axes]), ", ".join(axis.name for axis in axes)
    unit = "" if result.geographic else axes[2].small
    check = result.used_points & (result.point_kinds == "check")
    if check.any():
        note = about("check-points.used", n=int(check.sum()))
        rms = [root_mean(column**2) for column in (result.point_differences[check] * factors).T]
        found.append(Fact.of(f"rms of check points in {names}", rms, unit, note, figures=2))
    known = result.point_sd[result.used_points]
    if len(known := known[np.isfinite(known).all(axis=1)]):
        median = np.median(known * factors, axis=0)
        found.append(Fact.of(f"sd of points in {names}, median", median, unit, figures=2))
    return found


def _size_section(result: Result) -> Section:
    variance, more = result.variance_of_unit_weight, list[Fact]()
    if result.dropped:
        reasons = Counter(result.dropped.values()).items()
        note = ", ".join(
            about("dropped", n=count, reason=Phrase(f"reason.{reason}")) for reason, count in reasons
        )
        more.append(Fact.of("Points left out", len(result.dropped), note=note))
    note = about(f"unit-variance.{result.unit_variance}")
    good = [Fact.of("Variance of unit weight", variance, note=note, decimals=6)]
    sums = result.sums_of_squares
    groups = {"photos": sums.camera, "control": sums.ground, "images": sums.plates}
    groups |= {kind: observed.sum_of_squares for kind, observed in result.kinds.items()}
    groups["total"] = sums.total
    good += [
        Fact.of(f"Weighted sum of squares, {name}", square, decimals=6) for name, square in groups.items()
    ]
    kinds: dict[str, Callable[[Result], list[Quantity]]] = {
        "control points": control,
        "unheld components": declared.unheld,
        "check points": declared.check_points,
    }
    found = {
        kind: [root_mean(column**2) for column in named(table(result), "d").values.T]
        for kind, table in kinds.items()
    }
    known = {kind: values for kind, values in found.items() if np.isfinite(values).any()}
    values = np.reshape([*known.values()], (-1, 3))
    columns = [
        Quantity([*known], kind="name", head="rms of"),
        Quantity(values, point_axes(result.block), "difference", head="{}", figures=5),
        *(replace(each, head="{}") for each in plan_deviations(result._terms, values)),
    ]
    differences = Table("differences", "Adjusted minus given coordinates", columns)
    return of_network.size_section(result, [*_size(result), *more], good, [differences])


def _size(result: Result) -> list[Fact]:
    block = result.block
    kinds = result.point_kinds[result.used_points].tolist()
    held = np.isfinite(block.point_sd)
    held[observed_control(block)] = True
    held &= result.used_points[:, np.newaxis]
    counts = zip(point_axes(block), held.sum(axis=0), strict=True)
    return [
        Fact.of("Photos", len(block.photo_ids)),
        *([Fact.of("Cameras", len(block.cameras))] if block.cameras else []),
        Fact("Points", ", ".join(f"{kinds.count(kind)} {kind}" for kind in ("pass", "control", "check"))),
        Fact("Held components of control", ", ".join(f"{axis.name} {count}" for axis, count in counts)),
        of_network.used_fact("Image points", result.used_images),
        *(
            of_network.used_fact(f"Observations, {each.kind}", np.isfinite(each.squares))
            for each in result.kinds.values()
        ),
        Fact("Object space", "geographic" if block.geographic else "rectangular"),
        Fact("Rotation angles", "photo-to-ground" if block.photo_to_ground else "ground-to-photo"),
        Fact("Datum", str(result.datum)),
        Fact("Refraction", block.refraction.describe(block.linear_unit) if block.refraction else "none"),
    ]


def bandwidths(result: Result) -> tuple[str, list[tuple[str, str]]]:
    """Return a sentence, and the bandwidths of the 1987 program in input order and in chosen order."""
    images = result.block.image_photos, result.block.image_points
    figures = []
    for name, order in (("of the input", None), ("chosen", result.photo_order)):
        found = structure(*images, order)
        sizes = {"effective": found.effective_bandwidth, "naive": found.naive_bandwidth}
        figures.append((f"in the order {name}", about("bandwidth.sizes", **sizes)))
    return about("bandwidth"), figures


def _members(result: Result) -> dict[str, Any]:
    covariances, place, turn = result.photo_covariances, slice(0, 3), slice(3, 6)
    test = result.global_test
    side = None if test is None else "high" if test.rejected_high else "low" if test.rejected_low else None
    of_photos = (
        Quantity(covariances[:, place, place], member="position_covariance"),
        Quantity(covariances[:, turn, turn], member="attitude_covariance"),
    )
    of_camera = ("name", "photos", "images", "covariance")
    of_unknown = ("kind", "name", "position", "observations", "components", "units", "change", "sd")
    of_weight = ("redundancy", "standardized", "covariance")
    found: dict[str, Any] = {}
    if result.cameras:
        found["cameras"] = [
            members(each, *of_camera, model="camera.model", image_unit="camera.unit")
            | {"parameters": records(declared.camera_parameters([each]))}
            for each in result.cameras
        ]
        found["calibrations"] = [calibration_member(result, each) for each in result._calibrations]
    if result.unknowns:
        found["unknowns"] = [
            members(each, *of_unknown, *of_weight, matrix="attitude", sd_given="given.deviations")
            | members(each, value="values")
            for each in result.unknowns
        ]
    return found | {
        **of_network.network_members(result, of_photos),
        "title": result.block.title,
        "units": _units(result),
        "conventions": {
            "object_space": "geographic" if result.block.geographic else "rectangular",
            "rotation": "photo-to-ground" if result.block.photo_to_ground else "ground-to-photo",
            **conventions("block"),
        },
        "datum": result.datum.document(),
        "refraction": asdict(result.block.refraction) if result.block.refraction else None,
        "problems": of_network.problems_of(result),
        "initial_weighted_sum_of_squares": result.initial_weighted_sum_of_squares,
        "weighted_sum_of_squares": members(result.sums_of_squares, *_SUMS),
        "redundancy": result.redundancies and members(result.redundancies, *_SUMS),
        "unit_variance": result.unit_variance,
        "global_test": test
        and members(test, "variance", "limits", "level", "probability") | {"rejected": side},
        **({} if result.features is None else {"features": features_members(result.features)}),
        "observations_beside_images": _beside_images(result),
        "dropped_points": [
            {"id": name, "code": code, "reason": str(phrase(f"reason.{code}"))}
            for name, code in result.dropped.items()
        ],
    }


_SUMS = ("camera", "ground", "plates", "observations", "total")


def _units(result: Result) -> dict[str, str]:
    linear, image = result.block.linear_unit, result.block.image_unit
    position, square = linear, f"{linear}^2"
    if result.block.geographic:
        position = f"longitude deg, latitude deg, height {linear}"
        square = f"longitude rad, latitude rad, height {linear}; products"
    own = conventions("block-units", linear=linear, position=position, square=square)
    return own | {f"residual_{image}": image}


def _beside_images(result: Result) -> list[dict[str, Any]]:
    found = []
    for each in result.kinds.values():
        rows = np.flatnonzero(np.isfinite(each.squares))
        own = [
            Quantity([list(result.block.observations[row].of) for row in each.rows[rows]], member="of"),
            Quantity([each.components] * len(rows), member="components"),
            Quantity([each.units] * len(rows), member="units"),
            *([Quantity(each.weights[rows], member="weight_factor")] if result.loss else []),
        ]
        found += records([*chosen(declared.observations(each), rows), *own])
    return found
