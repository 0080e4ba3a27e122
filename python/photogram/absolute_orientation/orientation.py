"""The result of an absolute orientation: arrays with their covariances, and the ways to show them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.stations import Stations
from photogram.arguments.types import Bools, Floats
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message, listed
from photogram.results.iteration import Iteration
from photogram.show.methods import Brief, Documented, Judged
from photogram.show.page import Document
from photogram.statistics.findings import Findings
from photogram.statistics.limits import GlobalTest, normal_limit, studentized_limit
from photogram.statistics.reliability import TESTABLE

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.sketch.plot import Plot

__all__ = ["Orientation", "Trace"]


@dataclass(frozen=True, eq=False)
class Trace:
    """What one cycle of the bulletin computed on its way: its prints under sense switches.

    Coordinates are counted from the centres of both systems.
    """

    rotation: list[list[float]]  # (3, 3) A as the cycle began, after statement 8
    # The m equations, after 27: station (among those that took part) and component of each, and (m, 8)
    # P-values: omega, phi, kappa, s, three translations, constant
    equations: tuple[list[tuple[int, int]], Floats]
    normal: Floats  # (7, 8) C after 29 and D after 33
    auxiliary: Floats
    results: list[float]  # Seven results of the back solution, after 35
    # Seven corrected parameters, after 36: omega, phi, kappa in radians, s, b1, b2, b3
    parameters: list[float]


@dataclass(frozen=True, eq=False, repr=False)
class Orientation(Documented, Judged, Brief):
    """An absolutely oriented model; arrays in the order of the n stations, NaN for what took no part.

    Covariances are cofactors times `covariance_scale`.

    Attributes
    ----------
    stations
        What was oriented.
    used
        (n, 3) which control coordinates took part.
    rejected
        Identifiers of the stations that were rejected by name.
    similarity, initial
        The parameters with their covariance, and the initial ones.
    started
        Where the initial values are from: `restart`, `report` (first two stations) or `closed-form`.
    alternatives
        Other orientations that fit as well.
    method
        `rigorous`, `report` or `fill-in`.
    status
        `converged`, `not converged` or `diverged`.
    iterations
        Of the rigorous method.
    cycles
        Largest correction of an angle (rad) in each cycle of the report's methods, else None.
    residuals
        (n, 3) u = s X - A^T (x - B) of the components that took part, control axes, model units.
    model_residuals
        (n, 3) v = s A X + B - x with the adjusted X (TB 19, equation 5.1), model axes, model units.
    adjusted_control, control_covariances
        (n, 3) adjusted control coordinates in ground units, unknown ones included, and (n, 3, 3) their
        covariances.
    redundancy
        (n, 3) redundancy numbers of the residuals; they sum to the degrees of freedom.
    standardized
        (n, 3) residuals divided by their own standard deviations: by the a priori ones with standard
        deviations given (Baarda's w), else by sigma0's; NaN where no other component checks them. The latter
        never exceed the root of the degrees of freedom.
    studentized
        (n, 3) residuals divided by their own standard deviations, sigma0 being that of all others: Student
        with one degree of freedom less than the orientation has, and without a bound. NaN with less than two.
    test
        The global test of the standard deviations, where they were given and there are degrees of freedom.
    unit_variance
        `estimated` or `unity`.
    weighted_sum_of_squares
        Of both systems; without standard deviations the sum of the squared residuals.
    covariance_scale
        sigma0 squared, or 1; None when it is unknown.
    condition
        Condition number of the linearized residuals: rotations in radians, relative scale, translations in
        sizes of the model.
    messages
        Remarks that did not stop the orientation.
    grave
        Why this is no orientation to be used, though it converged.
    traces
        What each cycle of the report's methods computed, where it was asked for.
    scale_held
        Whether the scale was given, and six unknowns were left.
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
        """Whether the criterion of convergence was met."""
        return self.status == "converged"

    @property
    def usable(self) -> bool:
        """Whether the values can be used: `verdict` says why not."""
        return self.verdict.usable

    @property
    def decided_by_w(self) -> bool:
        """Whether test values are the standardized residuals: standard deviations were given to be relied on.

        Otherwise unit weight is estimated, and they are the studentized ones.
        """
        return self.weighted and self.unit_variance == "unity"

    @property
    def tested(self) -> Floats:
        """(n, 3) test values of the residuals; NaN where a redundancy number is too small for a test."""
        values = self.standardized if self.decided_by_w else self.studentized
        tested: Floats = np.where(self.redundancy >= TESTABLE, values, np.nan)
        return tested

    @property
    def limit(self) -> float:
        """What test values of good control exceed in one of twenty orientations (Bonferroni)."""
        tests = int(np.isfinite(self.tested).sum())
        if self.decided_by_w:
            return normal_limit(tests)
        return studentized_limit(self.degrees_of_freedom, tests)

    @property
    def outliers(self) -> list[tuple[int, int]]:
        """Row and component of the control whose test values exceed the limit, the largest first."""
        values = np.abs(np.nan_to_num(self.tested))
        beyond = np.argwhere(values > self.limit).tolist()
        return sorted(((row, axis) for row, axis in beyond), key=lambda place: -values[place])

    @property
    def problems(self) -> list[str]:
        """What keeps a reader from using the values, or should make them careful: the gravest first."""
        found = [str(message) for message in self.messages]
        if not self.grave and (outliers := self._outliers_named()):
            found.insert(0, outliers)
        found[:0] = [f"{message}; do not use these values" for message in self.grave]
        if self.test is not None and (failed := self.test.problem()):
            found.insert(0, failed)
        if not self.converged:
            found.insert(0, f"the orientation has {self.status}: do not use these values")
        return found

    def _outliers_named(self) -> str:
        ground, unit = self.residuals_ground, self.stations.ground_unit
        symbol = "w" if self.decided_by_w else "t"
        named = [
            f"{self.stations.ids[row]} {'XYZ'[axis]} ({symbol} {self.tested[row, axis]:.3g},"
            f" wrong by about {ground[row, axis] / self.redundancy[row, axis]:.3g} {unit})"
            for row, axis in self.outliers
        ]
        return f"control beyond the limit {self.limit:.2f} of its test: {listed(named)}" if named else ""

    @property
    def weighted(self) -> bool:
        """Whether standard deviations were given."""
        return self.stations.model_sd is not None

    @property
    def known(self) -> int:
        """Number n of control coordinates that took part."""
        return int(self.used.sum())

    @property
    def degrees_of_freedom(self) -> int:
        """Control coordinates that took part, minus the unknowns: seven, or six with the scale held."""
        return self.known - 7 + self.scale_held

    @property
    def rms(self) -> float:
        """Root of sum u^2 / n, model units (TB 19, equation 5.2)."""
        return math.sqrt(float(np.nansum(self.residuals**2)) / self.known)

    @property
    def sigma0(self) -> float | None:
        """Standard deviation of unit weight, of a model coordinate (model units) when no others were given.

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
        """(n, 3) given minus transformed coordinates of all control, rejected too, ground units."""
        positions, _ = self.similarity.transform(self.stations.model)
        differences: Floats = self.stations.control - positions
        return differences

    @property
    def took_part(self) -> Bools:
        """(n,) whether a station took part with any coordinate."""
        part: Bools = np.any(self.used, axis=1)
        return part

    @property
    def points(self) -> Bools:
        """(n,) whether a station has no control coordinate at all: a point to be transformed."""
        without: Bools = ~np.any(self.stations.given, axis=1)
        return without

    def transform_points(self) -> tuple[list[str], Floats, Floats]:
        """Transform the points among the stations: identifiers, (m, 3) positions, (m, 3, 3) covariances."""
        rows = np.flatnonzero(self.points)
        sd = 0.0 if self.stations.model_sd is None else self.stations.model_sd[rows]
        positions, covariances = self.similarity.transform(self.stations.model[rows], sd)
        return [self.stations.ids[row] for row in rows.tolist()], positions, covariances

    def control_table(self) -> pd.DataFrame:
        """Return stations as a data frame: residuals in both units, redundancy numbers, test values."""
        from photogram.absolute_orientation.tables import control

        return control(self).frame()

    def document(self) -> Document:
        """Return the document of the orientation: parameters, control with tests, transformed points."""
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
        """Plot the residuals of the control, given minus transformed: arrows in plan, bars for elevations."""
        from photogram.absolute_orientation.plot import control_plot

        rows = np.flatnonzero(self.took_part)
        residuals, rms = self.residuals_ground[rows], self.rms / self.similarity.scale
        return control_plot(
            self.stations, rows, self.adjusted_control[rows, :2], residuals, self.used[rows], rms
        )
