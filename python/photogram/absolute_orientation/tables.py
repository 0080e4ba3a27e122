"""What is known of an orientation, quantity by quantity, and what the verdict on it rests on."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.absolute_orientation.orientation import Orientation
from photogram.arguments.types import Floats
from photogram.results.iteration_text import iteration_table
from photogram.show.methods import columns_of, findings_of
from photogram.show.page import Fact, significant
from photogram.show.quantity import Axis, Quantity, chosen, frame, long
from photogram.statistics.findings import Findings, Tested
from photogram.statistics.reliability import TESTABLE

_STARTS = {
    "restart": "a former result",
    "report": "the first two stations",
    "closed-form": "the closed form",
}


@columns_of.register(Orientation)
def _columns(result: Orientation, what: str) -> dict[str, Any]:
    """Return the columns of the stations that took part; there is no other table."""
    return frame(stations(result))


def stations(result: Orientation) -> list[Quantity]:
    """Return the stations that took part: residuals, redundancy numbers, test values, adjusted control."""
    ground, model = _axes("XYZ", result.stations.ground_unit), _axes("XYZ", result.stations.model_unit)
    test = "w" if result.decided_by_w else "t"
    decides = {
        "seen": result.redundancy >= TESTABLE,
        "marked": np.abs(result.tested) > result.limit,
        "head": f"Test value {test}",
        "decimals": 2,
    }
    table = [
        _names(result, "Station"),
        _residual(result.residuals, model, name="residual", member="residual", head="Residual"),
        _residual(
            result.residuals_ground,
            ground,
            name="residual_ground",
            member="residual_ground",
            head="Residual",
        ),
        _residual(result.model_residuals, _axes("xyz", result.stations.model_unit), member="residual_model"),
        _test("redundancy", result.redundancy, head="Redundancy", decimals=3),
        _test("standardized", result.standardized, **(decides if test == "w" else {})),
        _test("studentized", result.studentized, **(decides if test == "t" else {})),
        Quantity(result.adjusted_control, ground, "value", member="adjusted"),
        Quantity(result.control_covariances, member="covariance"),
    ]
    return chosen(table, np.flatnonzero(result.took_part))


def tested_control(result: Orientation) -> list[Quantity]:
    """Return the components of the control that took part, each in a row: residuals and test values."""
    own, of_model, of_ground, _, *tests, _, _ = stations(result)
    return long([own, of_model, of_ground, *tests], np.argwhere(result.used[result.took_part]))


def left_out(result: Orientation) -> list[Quantity]:
    """Return control that took no part: given minus transformed."""
    there = result.stations.given & ~result.used
    differences = np.where(there, result.differences, np.nan)
    axes = _axes("XYZ", result.stations.ground_unit)
    head = "Given - transformed"
    table = [
        _names(result, "Station"),
        _residual(differences, axes, name="d", member="residual_ground", head=head),
    ]
    return chosen(table, np.flatnonzero(there.any(axis=1)))


def parameters(result: Orientation) -> list[Quantity]:
    """Return the seven parameters with their standard deviations, each in a row."""
    similarity, stations = result.similarity, result.stations
    scale = f"{stations.model_unit} / {stations.ground_unit}"
    axes = (
        *(Axis.turned(name, "deg") for name in ("omega", "phi", "kappa")),
        Axis.of("s", scale),
        *_axes(("b1", "b2", "b3"), stations.model_unit),
    )
    of, covariance = np.arange(7), similarity.covariance
    sd = np.full(7, np.nan) if covariance is None else np.sqrt(np.diag(covariance))
    names, units = (np.array(texts, dtype=object) for texts in ([a.name for a in axes], _units(axes)))
    values = np.array([*similarity.angles, similarity.scale, *similarity.translation])
    held = {0.0: "held"} if result.scale_held else None
    return [
        Quantity(names, kind="name", head="Parameter"),
        Quantity(values, axes, "value", head="Value", figures=10, of=of),
        Quantity(sd, axes, "deviation", head="sd", words=held, of=of),
        Quantity(units, kind="name", head="Unit"),
    ]


def _units(axes: tuple[Axis, ...]) -> list[str]:
    return ["deg, sd arcsec" if axis.angle else axis.unit for axis in axes]


def rotation(result: Orientation) -> Quantity:
    """Return the rotation matrix A."""
    return Quantity(result.similarity.rotation, _axes("XYZ"), head="{}", decimals=10)


def points(result: Orientation) -> list[Quantity]:
    """Return the stations without control, transformed."""
    ids, positions, covariances = result.transform_points()
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    axes = _axes("XYZ", result.stations.ground_unit)
    return [
        Quantity(np.array(ids, dtype=object), kind="name", head="Point"),
        Quantity(positions, axes, "value", head="{}"),
        Quantity(sd, axes, "deviation", head="sd {}"),
    ]


def cycles(result: Orientation) -> list[Quantity]:
    """Return the iterations, or the cycles of the report's methods."""
    if result.cycles is None:
        return iteration_table(result.iterations)
    axis = Axis("", "rad", small="rad")
    head = "Largest correction of an angle"
    return [
        Quantity(np.arange(1, len(result.cycles) + 1), head="Cycle", decimals=0),
        Quantity(np.array(result.cycles)[:, np.newaxis], (axis,), "deviation", head=head),
    ]


def facts(result: Orientation) -> tuple[list[Fact], list[Fact]]:
    """Return how much there is, and how good it is."""
    given, scale = result.used.sum(axis=0).tolist(), result.similarity.scale
    model, ground = result.stations.model_unit, result.stations.ground_unit
    done = len(result.iterations) if result.cycles is None else len(result.cycles)
    known = ", ".join(f"{count} {axis}" for count, axis in zip(given, "XYZ", strict=True))
    much = [
        Fact("Status", f"{result.status} after {done} iterations", note=f"method {result.method}"),
        Fact("Initial values", _STARTS[result.started]),
        Fact("Stations that took part", f"{int(result.took_part.sum())} of {len(result.stations.ids)}"),
        Fact("Known coordinates", f"{result.known}", note=known),
        Fact("Degrees of freedom", f"{result.degrees_of_freedom}"),
    ]
    in_model = f"{significant(result.rms, 6)} {model} in the model"
    sigma0, unit, note = "undefined", "", ""
    if result.sigma0 is not None:
        sigma0 = significant(result.sigma0, 6)
        if not result.weighted:
            unit, note = model, f"{significant(result.sigma0 / scale, 6)} {ground} on the ground"
    condition = "of the equations: rotations, relative scale, shifts"
    good = [
        Fact("rms of residuals on the ground", significant(result.rms / scale, 6), ground, in_model),
        Fact("Standard deviation of unit weight", sigma0, unit, note),
        Fact("Condition number", f"{result.condition:.1f}", note=condition),
    ]
    return much, good


def _names(result: Orientation, head: str) -> Quantity:
    ids = np.array(result.stations.ids, dtype=object)
    return Quantity(ids, kind="name", name="id", member="id", head=head)


def _axes(names: str | tuple[str, ...], unit: str = "") -> tuple[Axis, ...]:
    return tuple(Axis.of(name, unit) for name in names)


def _residual(values: Floats, axes: tuple[Axis, ...], **more: Any) -> Quantity:
    return Quantity(values, axes, "deviation", figures=4, **more)


def _test(name: str, values: Floats, **more: Any) -> Quantity:
    return Quantity(values, _axes("XYZ"), name=name, member=name, **more)


@findings_of.register(Orientation)
def orientation_findings(result: Orientation) -> Findings:
    """Return the tests of an orientation: w with standard deviations to be relied on, else t."""

    def name(index: tuple[int, ...]) -> str:
        return f"{'XYZ'[index[1]]} of {result.stations.ids[index[0]]}"

    control = Tested("control", result.tested, name, "w")
    if not result.decided_by_w:
        control = Tested("control", result.tested, name, "t", second=max(result.degrees_of_freedom - 1, 1))
    if_usable = []
    if not result.weighted and result.degrees_of_freedom:
        if_usable.append(
            "Give standard deviations where they are known: the residuals are tested as a whole then."
        )
    if result.degrees_of_freedom == 0:
        if_usable.append("Seven known coordinates are just enough: one more makes errors visible.")
    if_usable += [
        f"Another orientation fits as well, with the scale {significant(each.scale, 6)}: only you know which"
        " is meant."
        for each in result.alternatives[:1]
    ]
    return Findings(
        status=result.status,
        observations=[control],
        degrees_of_freedom=result.degrees_of_freedom,
        global_test=result.test,
        untested="no standard deviations are given" if not result.weighted else "no degrees of freedom",
        scaled=result.unit_variance != "unity",
        hints=[str(message) for message in result.grave],
        take_out="`--reject ID` leaves the control of a station out; compare what it does to the others.",
        if_usable=if_usable,
    )
