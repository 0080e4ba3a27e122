"""The document of an orientation; see `docs/absolute-orientation.md`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from photogram import _photocore
from photogram.absolute_orientation.tables import (
    control,
    cycles,
    model_residuals,
    parameters,
    points,
    rejected,
    rotation,
)
from photogram.arguments.types import Floats
from photogram.io import json
from photogram.show.forms import record
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Section, conventions, significant
from photogram.show.quantity import members
from photogram.statistics.findings import Findings, Tested
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Orientation

STARTS = {
    "restart": "a former result",
    "report": "the first two stations",
    "closed-form": "the closed form",
}


def orientation_document(result: Orientation) -> Document:
    """Return the document of an orientation."""
    stations, (size, quality) = result.stations, _facts(result)
    caption = "The control in plan with its residuals, given minus transformed, enlarged as the scale says."
    drawing = Drawing("picture-residuals", "Residuals of the control in plan", caption, result.plot)
    of_parameters, unit = parameters(result), f"{stations.model_unit} / {stations.ground_unit}"
    return verdict_document(
        result.verdict,
        "Absolute orientation of a model",
        "",
        highlights=[
            *quality[:2],
            Fact.of("Scale", result.similarity.scale, unit, figures=6),
            *size[3:],
            size[0],
        ],
        sections=[
            Section("residuals", "Residuals in plan", [drawing]),
            Section.of(of_parameters),
            Section.of(control(result)),
            Section.of(rejected(result)),
            Section("size", "Size and fit", [Facts("Size", size), Facts("Fit", quality)]),
            Section.of(verdict_table(result.verdict)),
            Section.of(points(result)),
            Section.of(cycles(result)),
            remarks_section(result.problems),
        ],
        details=[Section.of(rotation(result)), Section.of(model_residuals(result))],
        members=_members(result),
    )


def _facts(result: Orientation) -> tuple[list[Fact], list[Fact]]:
    """Return facts on size and on quality."""
    given, scale = result.used.sum(axis=0).tolist(), result.similarity.scale
    model, ground = result.stations.model_unit, result.stations.ground_unit
    done = len(result.iterations) if result.cycles is None else len(result.cycles)
    known = ", ".join(f"{count} {axis}" for count, axis in zip(given, "XYZ", strict=True))
    much = [
        Fact("Status", f"{result.status} after {done} iterations", note=f"method {result.method}"),
        Fact("Initial values", STARTS[result.started]),
        Fact("Stations that took part", f"{int(result.took_part.sum())} of {len(result.stations.ids)}"),
        Fact.of("Known coordinates", result.known, note=known),
        Fact.of("Degrees of freedom", result.degrees_of_freedom),
    ]
    in_model = f"{significant(result.rms, 6)} {model} in the model"
    sigma0, unit, note = "undefined", "", ""
    if result.sigma0 is not None:
        sigma0 = significant(result.sigma0, 6)
        if not result.weighted:
            unit, note = model, f"{significant(result.sigma0 / scale, 6)} {ground} on the ground"
    condition = "of the equations: rotations, relative scale, shifts"
    good = [
        Fact.of("rms of residuals on the ground", result.rms / scale, ground, in_model, figures=6),
        Fact("Standard deviation of unit weight", sigma0, unit, note),
        Fact.of("Condition number", result.condition, note=condition, decimals=1),
    ]
    return much, good


def _members(result: Orientation) -> dict[str, object]:
    test, similarity = result.test, result.similarity
    units = {"ground": result.stations.ground_unit, "model": result.stations.model_unit}
    return {
        "program": f"photogram {_photocore.__version__} absolute-orientation",
        "units": conventions("orientation-units", **units, sigma0="1" if result.weighted else units["model"]),
        "conventions": conventions("orientation"),
        **members(
            result,
            *("method", "status", "usable", "scale_held", "covariance_scale", "rms", "sigma0", "condition"),
            *("degrees_of_freedom", "weighted_sum_of_squares"),
            start="started",
            messages="problems",
            known_coordinates="known",
        ),
        **members(similarity, "scale", "rotation", "translation", "covariance", "deviation_factor"),
        "angles_rad": similarity.angles,
        "iterations": len(result.iterations) if result.cycles is None else len(result.cycles),
        "initial": members(result.initial, "scale", "translation", angles_rad="angles"),
        "global_test": test
        and members(
            test,
            *("limits", "probability", "rejected_high", "rejected_low"),
            variance_of_unit_weight="variance",
        ),
        "test": {
            "of": "standardized" if result.decided_by_w else "studentized",
            "limit": result.limit if math.isfinite(result.limit) else None,
            "outliers": [[result.stations.ids[row], "XYZ"[axis]] for row, axis in result.outliers],
        },
        "centres": members(similarity, control="control_centre", model="model_centre"),
    }


def to_json(result: Orientation) -> bytes:
    """Return the result as JSON (UTF-8); points are stations without control."""
    return without_points(result) + point_rows(*result.transform_points()) + json.CLOSED


def without_points(result: Orientation) -> bytes:
    """Return the document up to its first point, for any number of points."""
    return json.opened(record(result.document()), "points")


def point_rows(ids: Iterable[str], positions: Floats, covariances: Floats) -> bytes:
    """Return the members of points."""
    rows = zip(ids, positions.tolist(), covariances.tolist(), strict=True)
    return json.elements({"id": name, "position": place, "covariance": own} for name, place, own in rows)


def orientation_findings(result: Orientation) -> Findings:
    """Return the tests of an orientation: w with a priori sd, otherwise t."""

    def name(index: tuple[int, ...]) -> Phrase:
        station, axis = result.stations.ids[index[0]], "XYZ"[index[1]]
        return Phrase("named.coordinate", {"axis": axis, "station": station})

    control = Tested("control", result.tested, name, "w")
    if not result.decided_by_w:
        control = Tested("control", result.tested, name, "t", second=max(result.degrees_of_freedom - 1, 1))
    if_usable = []
    if not result.weighted and result.degrees_of_freedom:
        if_usable.append(Phrase("advice.give-sd"))
    if result.degrees_of_freedom == 0:
        if_usable.append(Phrase("advice.spare-coordinate"))
    if_usable += [
        Phrase("advice.alternative", {"scale": significant(each.scale, 6)})
        for each in result.alternatives[:1]
    ]
    return Findings(
        status=result.status,
        observations=[control],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested=Phrase("untested.sd" if not result.weighted else "untested.freedom"),
        scaled=result.unit_variance != "unity",
        hints=[message.phrase or str(message) for message in result.grave],
        take_out=Phrase("advice.leave-station-out"),
        if_usable=if_usable,
    )
