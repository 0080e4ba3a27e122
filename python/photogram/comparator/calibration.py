"""Complete calibration: every stage of the report, and the joint adjustment."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property

import numpy as np

from photogram.comparator.averages import (
    GridSigma,
    ListedGridSigma,
    PlateAverages,
    average_residuals,
    listed_grid_sigma,
    text_grid_sigma,
)
from photogram.comparator.case import Closeout, PlacedCase, close_out, place_case
from photogram.comparator.correction import Correction, Identity, parameters_of
from photogram.comparator.fits import AffineFit, Residuals, RigidFit, fit_affine, fit_rigid
from photogram.comparator.grid import Grid, with_corrections
from photogram.comparator.joint import LEAST_UM, JointFit, adjust_jointly
from photogram.comparator.options import Options
from photogram.comparator.outliers import (
    FarPointing,
    PointingTests,
    Screening,
    far_pointings,
    plate_remarks,
    pointing_tests,
    problems,
    screen,
)
from photogram.comparator.readings import Case, Precision, Session, pool_points
from photogram.comparator.variance import (
    CaseVarianceTest,
    CombinedLinear,
    CombinedPolynomial,
    PolynomialTest,
    SinglePolynomial,
    VarianceAnalysis,
    analyse_variance,
    combine_linear,
    combine_polynomial,
    compare_case_variances,
    polynomial_tests,
    single_polynomial,
)
from photogram.errors import AdjustmentError, message_of
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import require
from photogram.messages import Message
from photogram.show.methods import Documented, Judged
from photogram.show.page import Document
from photogram.statistics.findings import Findings
from photogram.words import phrase

# Bytes of any calibration, and bytes per pointing, with listing and document
BASE, PER_POINTING = 64 << 20, 3500


@dataclass(frozen=True, eq=False)
class CaseResult:
    """Results of one case in all stages.

    Attributes
    ----------
    placed
        Means, grid and orientation.
    closeouts
        Returns to the first point and, if any, to the second.
    free, linear, polynomial
        Single-case adjustments: rigid, linear, and polynomials (None for too few points).
    """

    placed: PlacedCase
    closeouts: list[Closeout]
    free: RigidFit
    linear: AffineFit
    polynomial: SinglePolynomial | None

    @property
    def number(self) -> int:
        """Number of the case."""
        return self.placed.number


@dataclass(frozen=True, eq=False)
class Pointing:
    """Pooled pointing precision.

    Attributes
    ----------
    operators
        For each operator: precision of each point over his cases, and in total.
    points, total
        Precision of each point over all cases, and in total.
    """

    operators: dict[int, tuple[dict[int, Precision], Precision]]
    points: dict[int, Precision]
    total: Precision


@dataclass(frozen=True, eq=False)
class PlateResult:
    """Average residuals of one plate and the resulting grid precision after a stage.

    Attributes
    ----------
    averages
        Average residuals.
    listed
        Standard deviations of the listing.
    text_um, unbiased_um
        Standard deviation of a grid coordinate by equation 64, and the unbiased one.
    """

    averages: PlateAverages
    listed: ListedGridSigma
    text_um: float
    unbiased_um: float

    def sigma_um(self, *, as_published: bool) -> float:
        """Return the standard deviation of a grid coordinate: unbiased, or of the listing."""
        return self.listed.grid_um if as_published else self.unbiased_um


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Documented, Judged):
    """Result of a comparator calibration.

    Attributes
    ----------
    session, options
        Measurements and options of the calibration.
    cases
        Results of the cases.
    pointing
        Pooled pointing precision.
    linear, nonlinear
        Combined adjustments; without polynomials, `nonlinear` is None.
    averages
        For each stage (`case_linear`, `case_nonlinear`, `linear`, `nonlinear`) and each plate: average
        residuals and the grid.
    variance
        Analysis of variance.
    polynomial_tests, case_test
        Significance of the polynomials; equality of the variances of the cases (None for one case).
    joint
        Rigorous adjustment; None if it was not requested.
    joint_check
        Largest difference between the weighted mean of the report and a joint adjustment with its
        assumptions, in standard deviations. The assumptions are a fixed grid, equal weights, and no
        polynomials.
    screening
        Measured points inconsistent with the adjustment of the others, and their effect.
    pointing_tests
        Tests of all pointings, case by case.
    far_pointings
        Single pointings inconsistent with the others of their case.
    messages
        Problems, most serious first, and warnings.
    """

    session: Session
    options: Options
    cases: tuple[CaseResult, ...]
    pointing: Pointing
    linear: CombinedLinear
    nonlinear: CombinedPolynomial | None
    averages: dict[str, dict[int, PlateResult]]
    variance: VarianceAnalysis
    polynomial_tests: PolynomialTest | None
    case_test: CaseVarianceTest | None
    joint: JointFit | None
    joint_check: float | None
    screening: Screening
    pointing_tests: tuple[PointingTests, ...]
    far_pointings: tuple[FarPointing, ...]
    messages: list[Message]

    @property
    def usable(self) -> bool:
        """Whether the correction may be used; `verdict` gives the reasons."""
        return self.verdict.usable

    @property
    def correction(self) -> Correction:
        """Correction by the method of the report: linear parameters and polynomials."""
        found = self.nonlinear.correction if self.nonlinear else self.linear.correction
        return replace(found, identity=self.identity)

    @property
    def identity(self) -> Identity:
        """Comparator, date, and calibrated range of readings."""
        return Identity.of(self.session, [case.placed.means_um for case in self.cases])

    @property
    def last_stage(self) -> str:
        """`nonlinear`, or `linear` without polynomials."""
        return "nonlinear" if self.nonlinear else "linear"

    @property
    def last_fits(self) -> tuple[RigidFit, ...]:
        """Rigid fit of each case after all corrections."""
        return (self.nonlinear or self.linear).cases

    @property
    def plates(self) -> dict[int, PlateResult]:
        """Average residuals and grid of each plate after all corrections."""
        return self.averages[self.last_stage]

    def sigma_grid_um(self, plate: int) -> float:
        """Return the standard deviation of a grid coordinate: unbiased, or as published."""
        return self.plates[plate].sigma_um(as_published=self.options.as_published)

    def corrected_grid(self, plate: int) -> Grid:
        """Return a plate corrected by its final average residuals at measured points."""
        session, averages = self.session, self.plates[plate].averages
        placed = [case.placed for case in self.cases]
        known = {number: grid.sigma_um for number, grid in session.grids.items()}
        stage = self.nonlinear or self.linear
        sigma = GridSigma(session.grids, placed, stage).corrected(plate, known)
        corrections = averages.points, averages.corrections_um
        return with_corrections(session.grids[plate], *corrections, sigma, _occasion(session))

    def adjusted_grid(self, plate: int) -> Grid:
        """Return a plate of the joint adjustment of given coordinates and measurements."""
        assert self.joint is not None
        session, joint = self.session, self.joint.plates[plate]
        sigma = math.sqrt(float((joint.sd_um**2).mean()))
        corrections = joint.points, joint.corrections_um
        return with_corrections(session.grids[plate], *corrections, sigma, _occasion(session))

    @cached_property
    def _document(self) -> Document:
        from photogram.comparator.document import calibration_document

        return calibration_document(self)

    def document(self) -> Document:
        """Return the document with analysis of variance, parameters, tests and plots."""
        return self._document  # Listing, summary and JSON of a command share it

    def _findings(self) -> Findings:
        from photogram.comparator.document import comparator_findings

        return comparator_findings(self)


def needed_memory(pointings: int) -> int:
    """Return the maximum memory (bytes) of a calibration for a number of pointings."""
    return BASE + PER_POINTING * pointings


def calibrate(session: Session, options: Options | None = None) -> Calibration:
    """Calibrate a comparator.

    Parameters
    ----------
    session
        Measurements of the calibration.
    options
        Options; see :class:`Options`.

    Raises
    ------
    InputError
        If measurements are invalid. The message names file, record number and record, if known.
    AdjustmentError
        If there are too few points, or if placements do not determine the parameters.
    OutOfMemoryError
        If the pointings require more memory than available.
    """
    options = options or Options()
    session.check()
    session = session.expanded()
    pointings = sum(len(case.points) for case in session.cases)
    require(needed_memory(pointings), f"a calibration of {pointings} pointings")
    messages = list(session.messages)
    cases = [_case(case, session.grids[case.plate], options, messages) for case in session.cases]
    _check_handedness(session, cases)
    placed = [case.placed for case in cases]
    linear = combine_linear(placed, [case.linear for case in cases])
    nonlinear = None
    if options.polynomial:
        try:
            nonlinear = combine_polynomial(placed, linear)
        except AdjustmentError as error:
            what = phrase("comparators.combined")
            messages.append(Message(phrase("comparators.no-polynomials", what=what, reason=error.phrase)))
    pointing = _pointing(cases, options)
    averages = _averages(session, cases, linear, nonlinear)
    grid_um = _grid_sigma(session, averages["nonlinear" if nonlinear else "linear"], options)
    free, published = [case.free for case in cases], options.as_published
    variance = analyse_variance(free, linear, nonlinear, pointing.total, grid_um, as_published=published)
    messages += [Message(phrase("comparators.negative", name=name)) for name in variance.negative]
    messages += plate_remarks(session, placed)
    joint = None
    if options.joint:
        joint = _joint(session, placed, linear, pointing.total, nonlinear is not None, options, messages)
    tests = pointing_tests(session.cases)
    readings = 2 * sum(len(case.points) for case in placed)
    screening = screen(placed, nonlinear or linear, session.grids, sum(each.ratios.size for each in tests))
    far = far_pointings(tests, readings)
    return Calibration(
        session=session,
        options=options,
        cases=tuple(cases),
        pointing=pointing,
        linear=linear,
        nonlinear=nonlinear,
        averages=averages,
        variance=variance,
        polynomial_tests=polynomial_tests(linear, nonlinear) if nonlinear else None,
        case_test=compare_case_variances([case.linear.residuals.comparator_um for case in cases]),
        joint=joint,
        joint_check=_joint_check(session, placed, linear) if options.joint else None,
        screening=screening,
        pointing_tests=tuple(tests),
        far_pointings=tuple(far),
        messages=[*problems(session, placed, screening, far, joint), *messages],
    )


def _case(case: Case, grid: Grid, options: Options, messages: list[Message]) -> CaseResult:
    closeouts, remarks = close_out(case)
    placed, more = place_case(case, grid, as_published=options.as_published)
    messages += remarks + more
    points = placed.points, placed.means_um, placed.grid_um
    free = fit_rigid(*points)
    name, polynomial = phrase("comparators.case", case=case.number), None
    try:
        linear = fit_affine(*points)
    except AdjustmentError as error:
        raise case.place.error(phrase("error.at", what=name, message=error.phrase)) from None
    if options.polynomial:
        try:
            polynomial = single_polynomial(placed, linear, as_published=options.as_published)
        except AdjustmentError as error:
            messages.append(Message(phrase("comparators.no-polynomials", what=name, reason=error.phrase)))
    return CaseResult(placed, closeouts, free, linear, polynomial)


def _check_handedness(session: Session, cases: Sequence[CaseResult]) -> None:
    """Reject a handedness that contradicts all cases.

    If it contradicts only some cases, the plate was turned over.
    """
    hands, specified = ("right", "left"), session.left_handed
    if specified is None or any(case.placed.orientation.left_handed == specified for case in cases):
        return
    fields = {"case": cases[0].number, "measured": hands[not specified], "specified": hands[specified]}
    raise cases[0].placed.case.place.error(phrase("comparators.hand", **fields))


def _pointing(cases: Sequence[CaseResult], options: Options) -> Pointing:
    def pooled(some: Iterable[CaseResult]) -> tuple[dict[int, Precision], Precision]:
        return pool_points([case.placed.readings for case in some], as_published=options.as_published)

    operators = dict.fromkeys(case.placed.case.operator for case in cases)
    by_operator = {
        operator: pooled(case for case in cases if case.placed.case.operator == operator)
        for operator in operators
    }
    return Pointing(by_operator, *pooled(cases))


def _averages(
    session: Session,
    cases: Sequence[CaseResult],
    linear: CombinedLinear,
    nonlinear: CombinedPolynomial | None,
) -> dict[str, dict[int, PlateResult]]:
    stages: dict[str, list[Residuals]] = {"case_linear": [case.linear.residuals for case in cases]}
    polynomials = [case.polynomial.residuals for case in cases if case.polynomial]
    if len(polynomials) == len(cases):
        stages["case_nonlinear"] = polynomials
    combined: dict[str, CombinedLinear | CombinedPolynomial] = {"linear": linear}
    if nonlinear:
        combined["nonlinear"] = nonlinear
    stages |= {name: [fit.residuals for fit in stage.cases] for name, stage in combined.items()}
    placed = [case.placed for case in cases]
    result: dict[str, dict[int, PlateResult]] = {}
    for name, residuals in stages.items():
        # The report prints only averages for single-case stages.
        sigmas = GridSigma(session.grids, placed, combined[name]).by_plate if name in combined else {}
        result[name] = {}
        for plate in dict.fromkeys(case.case.plate for case in placed):
            rows = [k for k, case in enumerate(placed) if case.case.plate == plate]
            averages = average_residuals(
                session.grids[plate], [placed[k] for k in rows], [residuals[k] for k in rows]
            )
            sigma = sigmas.get(plate, math.nan)
            figures = listed_grid_sigma(averages), text_grid_sigma(averages), sigma
            result[name][plate] = PlateResult(averages, *figures)
    return result


def _grid_sigma(session: Session, plates: Mapping[int, PlateResult], options: Options) -> float:
    """Return the grid standard deviation of all plates for the analysis of variance."""
    variances = []
    for plate, result in plates.items():
        sigma = session.grids[plate].sigma_um
        if sigma is None:
            sigma = np.nan_to_num(result.sigma_um(as_published=options.as_published))
        variances.append(sigma**2)
    points = [len(result.averages.points) for result in plates.values()]
    return math.sqrt(np.average(variances, weights=points))


def _joint(
    session: Session,
    placed: Sequence[PlacedCase],
    linear: CombinedLinear,
    precision: Precision,
    polynomial: bool,
    options: Options,
    messages: list[Message],
) -> JointFit | None:
    known = precision.sd_um if precision.degrees_of_freedom > 0 else (0.0, 0.0)
    grid = {plate: session.grids[plate].sigma_um for plate in dict.fromkeys(c.case.plate for c in placed)}
    for plate in grid:
        turns = {case.orientation.corner for case in placed if case.case.plate == plate}
        if options.estimate_grid and len(turns) > 1:
            grid[plate] = None
        elif grid[plate] is None and len(turns) < 2:
            messages.append(Message(phrase("comparators.fixed-grid", plate=plate)))
            grid[plate] = 0.0
    try:
        joint = adjust_jointly(placed, session.grids, linear, grid, pointing_um=known, polynomial=polynomial)
    except AdjustmentError as error:
        messages.append(Message(message_of(error)))
        return None
    identity = Identity.of(session, [case.means_um for case in placed])
    return replace(joint, correction=replace(joint.correction, identity=identity))


def _joint_check(session: Session, placed: Sequence[PlacedCase], linear: CombinedLinear) -> float:
    """Return the largest difference of weighted mean and joint adjustment, in sd."""
    fixed, random = dict.fromkeys(session.grids, 0.0), max(linear.sigma0_um, LEAST_UM)
    joint = adjust_jointly(
        placed, session.grids, linear, fixed, random_um=random, polynomial=False
    ).correction
    differences = np.abs(parameters_of(linear.correction) - parameters_of(joint))[:3]
    return float((differences / np.sqrt(np.diag(joint.covariance)[:3])).max())


def _occasion(session: Session) -> str:
    return f"{session.date or 'undated'} by comparator {session.comparator}"
