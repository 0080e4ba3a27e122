"""The result of an absolute orientation: arrays, covariances, tables and plots."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from photogram import _photocore
from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.stations import Stations
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.results.parts import Iteration
from photogram.show.methods import Documented, Judged
from photogram.show.page import Document
from photogram.statistics.findings import Findings
from photogram.statistics.limits import GlobalTest, normal_limit, studentized_limit
from photogram.statistics.reliability import TESTABLE
from photogram.words import phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.sketch.plot import Plot


@dataclass(frozen=True, eq=False)
class Trace:
    """Intermediate results of one cycle: prints under sense switches.

    Coordinates are relative to the centres of both systems.
    """

    rotation: list[list[float]]  # (3, 3) A at the start of the cycle, after statement 8
    # The m equations, after 27: station (among the used ones) and component of each, and (m, 8) P-values:
    # omega, phi, kappa, s, three translations, constant
    equations: tuple[list[tuple[int, int]], Floats]
    normal: Floats  # (7, 8) C after 29 and D after 33
    auxiliary: Floats
    results: list[float]  # Seven results of the back solution, after 35
    # Seven corrected parameters, after 36: omega, phi, kappa in radians, s, b1, b2, b3
    parameters: list[float]


@dataclass(frozen=True, eq=False, repr=False)
class Orientation(Documented, Judged):
    """Result of an absolute orientation; arrays of n stations, NaN if not used.

    Covariances are cofactors times `covariance_scale`.

    Attributes
    ----------
    stations
        Input of the orientation.
    used
        (n, 3) True for used control coordinates.
    rejected
        Identifiers of the stations that were rejected by name.
    similarity, initial
        The parameters with their covariance, and the initial ones.
    started
        Source of the initial values: `restart`, `report` (first two stations) or `closed-form`.
    alternatives
        Other orientations that fit as well.
    method
        `rigorous`, `report` or `fill-in`.
    status
        `converged`, `not converged` or `diverged`.
    iterations
        Iterations of the rigorous method.
    cycles
        Largest angle correction (rad) in each cycle of the report's methods, otherwise None.
    residuals
        (n, 3) u = s X - A^T (x - B) of the used components, control axes, model units.
    model_residuals
        (n, 3) v = s A X + B - x with the adjusted X (TB 19, equation 5.1), model axes, model units.
    adjusted_control, control_covariances
        (n, 3) adjusted control coordinates in ground units, including unknown ones, and (n, 3, 3) their
        covariances.
    redundancy
        (n, 3) redundancy numbers of the residuals; they sum to the degrees of freedom.
    standardized
        (n, 3) residuals divided by their own standard deviations: a priori if standard deviations are given
        (Baarda's w), otherwise from sigma0. The latter never exceed the root of the degrees of freedom. NaN
        without redundancy.
    studentized
        (n, 3) residuals divided by their own standard deviations, with sigma0 of all others: Student with one
        degree of freedom less than the orientation, unbounded. NaN with less than two degrees of freedom.
    test
        The global test of given standard deviations; None without these or without degrees of freedom.
    unit_variance
        `estimated` or `unity`.
    weighted_sum_of_squares
        Weighted sum of squares of both systems; without standard deviations the sum of squared residuals.
    covariance_scale
        sigma0 squared, or 1; None if unknown.
    condition
        Condition number of the linearized residuals: rotations in radians, relative scale, translations in
        sizes of the model.
    messages
        Warnings that did not stop the orientation.
    grave
        Reasons for not using a converged orientation.
    traces
        Intermediate results of each cycle of the report's methods, if requested.
    scale_held
        True if the scale was fixed, with six unknowns.
    """

    stations: Stations
    used: Bools
    rejected: tuple[str, ...]
    similarity: Similarity
    initial: Similarity
    started: str
    alternatives: list[Similarity]
    method: str
    status: str
    iterations: list[Iteration]
    cycles: list[float] | None
    residuals: Floats
    model_residuals: Floats
    adjusted_control: Floats
    control_covariances: Floats
    redundancy: Floats
    standardized: Floats
    studentized: Floats
    test: GlobalTest | None
    unit_variance: str
    weighted_sum_of_squares: float
    covariance_scale: float | None
    condition: float
    messages: list[Message]
    grave: list[Message]
    traces: list[Trace]
    scale_held: bool = False

    @property
    def converged(self) -> bool:
        """Whether the convergence criterion was met."""
        return self.status == "converged"

    @property
    def usable(self) -> bool:
        """Whether the values can be used; `verdict` contains the reason."""
        return self.verdict.usable

    @property
    def decided_by_w(self) -> bool:
        """Whether standardized residuals are tested: the given standard deviations are reliable.

        Otherwise the unit weight is estimated, and studentized residuals are tested.
        """
        return self.weighted and self.unit_variance == "unity"

    @property
    def tested(self) -> Floats:
        """(n, 3) test values of the residuals; NaN if redundancy is too small."""
        values = self.standardized if self.decided_by_w else self.studentized
        tested: Floats = np.where(self.redundancy >= TESTABLE, values, np.nan)
        return tested

    @property
    def limit(self) -> float:
        """Critical value that good control exceeds in one of twenty orientations (Bonferroni)."""
        tests = int(np.isfinite(self.tested).sum())
        if self.decided_by_w:
            return normal_limit(tests)
        return studentized_limit(self.degrees_of_freedom, tests)

    @property
    def outliers(self) -> list[tuple[int, int]]:
        """Row and component of control beyond the limit, the largest first."""
        values = np.abs(np.nan_to_num(self.tested))
        beyond = np.argwhere(values > self.limit).tolist()
        return sorted(((row, axis) for row, axis in beyond), key=lambda place: -values[place])

    @property
    def problems(self) -> list[str]:
        """Reasons for not using the values, and warnings, in the order of severity."""
        found = [str(message) for message in self.messages]
        if not self.grave and (outliers := self._outliers_named()):
            found.insert(0, outliers)
        found[:0] = [str(phrase("orientation.grave", message=message)) for message in self.grave]
        if self.test is not None and (failed := self.test.problem()):
            found.insert(0, failed)
        if not self.converged:
            found.insert(0, str(phrase("orientation.status", status=self.status)))
        return found

    def _outliers_named(self) -> str:
        ground, unit = self.residuals_ground, self.stations.ground_unit
        fields = {"symbol": "w" if self.decided_by_w else "t", "unit": unit}
        named = [
            phrase(
                "orientation.outlier",
                station=self.stations.ids[row],
                axis="XYZ"[axis],
                value=float(self.tested[row, axis]),
                error=float(ground[row, axis] / self.redundancy[row, axis]),
                **fields,
            )
            for row, axis in self.outliers
        ]
        return str(phrase("orientation.outliers", limit=self.limit, names=named)) if named else ""

    @property
    def weighted(self) -> bool:
        """Whether standard deviations were given."""
        return self.stations.model_sd is not None

    @property
    def known(self) -> int:
        """Number n of used control coordinates."""
        return int(self.used.sum())

    @property
    def degrees_of_freedom(self) -> int:
        """Used control coordinates minus unknowns: seven, or six with a fixed scale."""
        return self.known - 7 + self.scale_held

    @property
    def rms(self) -> float:
        """Root of sum u^2 / n, model units (TB 19, equation 5.2)."""
        return math.sqrt(float(np.nansum(self.residuals**2)) / self.known)

    @property
    def sigma0(self) -> float | None:
        """Standard deviation of unit weight; of a model coordinate (model units) without given sd.

        None without degrees of freedom.
        """
        if self.degrees_of_freedom == 0:
            return None
        return math.sqrt(self.weighted_sum_of_squares / self.degrees_of_freedom)

    @property
    def residuals_ground(self) -> Floats:
        """(n, 3) u / s: given minus transformed control coordinates, ground units."""
        ground: Floats = self.residuals / self.similarity.scale
        return ground

    @property
    def differences(self) -> Floats:
        """(n, 3) given minus transformed coordinates of all control, ground units."""
        positions, _ = self.similarity.transform(self.stations.model)
        differences: Floats = self.stations.control - positions
        return differences

    @property
    def took_part(self) -> Bools:
        """(n,) whether any coordinate of a station was used."""
        part: Bools = np.any(self.used, axis=1)
        return part

    @property
    def points(self) -> Bools:
        """(n,) whether a station lacks control coordinates: a point to be transformed."""
        without: Bools = ~np.any(self.stations.given, axis=1)
        return without

    def transform_points(self) -> tuple[list[str], Floats, Floats]:
        """Transform station points: identifiers, (m, 3) positions, (m, 3, 3) covariances."""
        rows = np.flatnonzero(self.points)
        sd = 0.0 if self.stations.model_sd is None else self.stations.model_sd[rows]
        positions, covariances = self.similarity.transform(self.stations.model[rows], sd)
        return [self.stations.ids[row] for row in rows.tolist()], positions, covariances

    def control_table(self) -> pd.DataFrame:
        """Return stations as a data frame: residuals, redundancy numbers, tests."""
        from photogram.absolute_orientation.document import control

        return control(self).frame()

    def document(self) -> Document:
        """Return the document: parameters, control with tests, transformed points."""
        from photogram.absolute_orientation.document import orientation_document

        return orientation_document(self)

    def to_json(self) -> bytes:
        """Return the whole result as a JSON document (UTF-8), with the transformed points."""
        from photogram.absolute_orientation.document import to_json

        return to_json(self)

    def _findings(self) -> Findings:
        from photogram.absolute_orientation.document import orientation_findings

        return orientation_findings(self)

    def plot(self) -> Plot:
        """Plot the control residuals, given minus transformed: arrows in plan, bars for elevations."""
        from photogram.absolute_orientation.document import control_plot

        rows = np.flatnonzero(self.took_part)
        residuals, rms = self.residuals_ground[rows], self.rms / self.similarity.scale
        return control_plot(
            self.stations, rows, self.adjusted_control[rows, :2], residuals, self.used[rows], rms
        )


def trace_text(result: Orientation) -> str:
    """Return intermediate results with the names and statements of the bulletin."""
    rows = np.flatnonzero(result.took_part).tolist()
    names = [result.stations.ids[row] for row in rows]
    parts = [f"photogram {_photocore.__version__}  absolute orientation  prints under sense switches"]
    kappa, scale = float(result.initial.angles[2]), result.initial.scale
    for number, trace in enumerate(result.traces, 1):
        title = f"Iteration {number}"
        parts.append("\n".join([title, "-" * len(title), *_cycle(trace, names, kappa, scale)]))
        kappa, scale = trace.parameters[2], trace.parameters[3]
    return "\n\n".join(parts) + "\n"


def _cycle(trace: Trace, names: list[str], kappa: float, scale: float) -> list[str]:
    places, rows = trace.equations
    normal, auxiliary = trace.normal, trace.auxiliary
    omega, phi, kappa_after, *others = trace.parameters
    width = max([12, *(1 + len(names[station]) for station, _ in places)])
    return [
        *_print(1, "after statement 2", "tan K", [[math.tan(kappa)]]),
        *_print(2, "before 10", "sin K, S", [[math.sin(kappa), scale]]),
        *_print(3, "after 8", "rotation matrix A", trace.rotation),
        f"sense switch 4, after 27: the eight P-values of {len(places)} equations",
        *(
            f"  {names[station]:<{width}} {'123'[axis]}" + _numbers(row)
            for (station, axis), row in zip(places, rows.tolist(), strict=True)
        ),
        *_print(
            5,
            "after 29",
            "seven diagonal terms and last term of the normal equations",
            [[*np.diag(normal[:, :7]).tolist(), float(normal[6, 7])]],
        ),
        *_print(6, "after 33", "bottom row of the auxiliary table", [auxiliary[6].tolist()]),
        *_print(7, "after 35", "seven results of the back solution", [trace.results]),
        *_print(
            8,
            "after 36",
            "seven corrected parameters: omega, phi, K (rad), S, B",
            [[omega, phi, kappa_after, *others]],
        ),
    ]


def _print(switch: int, statement: str, what: str, rows: Iterable[Iterable[float]]) -> list[str]:
    return [f"sense switch {switch}, {statement}: {what}", *(f"  {'':<14}{_numbers(row)}" for row in rows)]


def _numbers(values: Iterable[float]) -> str:
    return "".join(f"{value:>18.9e}" for value in values)
