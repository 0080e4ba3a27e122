"""The whole calibration: every stage of the report, and the joint adjustment behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.comparator.averages import (
    ListedGridSigma,
    PlateAverages,
    average_residuals,
    listed_grid_sigma,
    text_grid_sigma,
    unbiased_grid_sigma,
)
from photogram.comparator.case import PlacedCase, place_case
from photogram.comparator.closeout import Closeout, close_out
from photogram.comparator.combined_solution import (
    CombinedLinear,
    CombinedPolynomial,
    SinglePolynomial,
    combine_linear,
    combine_polynomial,
    single_polynomial,
)
from photogram.comparator.correction import Correction, Identity
from photogram.comparator.fits import AffineFit, Residuals, RigidFit, fit_affine, fit_rigid
from photogram.comparator.joint import LEAST_UM, JointFit, Weights, adjust_jointly
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
from photogram.comparator.pointing import Precision, pool_points
from photogram.comparator.readings import Session
from photogram.comparator.variance import (
    CaseVarianceTest,
    PolynomialTest,
    VarianceAnalysis,
    analyse_variance,
    compare_case_variances,
    polynomial_tests,
)
from photogram.errors import AdjustmentError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import require
from photogram.messages import Message
from photogram.show.methods import Documented, Judged
from photogram.show.page import Document
from photogram.show.summary import Brief
from photogram.statistics.findings import Findings

# Bytes that any calibration takes, and what each pointing adds, with listing and document
BASE, PER_POINTING = 64 << 20, 3500


@dataclass(frozen=True, eq=False)
class CaseResult:
    """One case through all stages.

    Attributes
    ----------
    placed
        Means, grid, orientation.
    closeouts
        Returns to the first point and, where there were, to the second.
    free, linear, polynomial
        Single-case adjustments: rigid, linear, and polynomials (None where there are too few points).
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
        For each operator: each point over his cases, and everything.
    points, total
        Each point over all cases, and everything.
    """

    operators: dict[int, tuple[dict[int, Precision], Precision]]
    points: dict[int, Precision]
    total: Precision


@dataclass(frozen=True, eq=False)
class PlateResult:
    """Average residuals of one plate and what follows for its grid, after one stage.

    Attributes
    ----------
    averages
        Average residuals.
    listed
        The figures of the listing.
    text_um, unbiased_um
        Standard deviation of a grid coordinate by equation 64, and without bias.
    """

    averages: PlateAverages
    listed: ListedGridSigma
    text_um: float
    unbiased_um: float


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Documented, Judged, Brief):
    """A calibrated comparator.

    Attributes
    ----------
    session, options
        What was measured, and how it was computed.
    cases
        The cases.
    pointing
        Pooled pointing precision.
    linear, nonlinear
        Combined adjustments; `nonlinear` is None without polynomials.
    averages
        For each stage (`case_linear`, `case_nonlinear`, `linear`, `nonlinear`) and each plate: average
        residuals and the grid.
    variance
        Analysis of variance.
    polynomial_tests, case_test
        Significance of the polynomials; equality of the variances of the cases (None for one case).
    joint
        The rigorous adjustment; None where it was not asked for.
    joint_check
        Largest difference between the report's weighted mean and a joint adjustment under its assumptions
        (grid without error, equal weights, no polynomials), in standard deviations.
    screening
        Measured points that do not agree with the adjustment of the others, and the harm they do.
    pointing_tests
        Tests of all pointings, case by case.
    far_pointings
        Single pointings that do not agree with the others of their case.
    messages
        Problems, the gravest first, and remarks.
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
        """Whether the correction may be used: `verdict` says why not."""
        return self.verdict.usable

    @property
    def correction(self) -> Correction:
        """The correction by the method of the report: linear parameters and polynomials of all cases."""
        found = self.nonlinear.correction if self.nonlinear else self.linear.correction
        return replace(found, identity=self.identity)

    @property
    def identity(self) -> Identity:
        """What was calibrated, when, and over which range of readings."""
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
        """Return the computed standard deviation of a grid coordinate, in the way that the options name."""
        return _chosen_sigma(self.plates[plate], self.options)

    def document(self) -> Document:
        """Return the document of the calibration: analysis of variance, parameters, tests, pictures."""
        from photogram.comparator.document import calibration_document

        return calibration_document(self)

    def _findings(self) -> Findings:
        from photogram.comparator.findings import comparator_findings

        return comparator_findings(self)


def _chosen_sigma(result: PlateResult, options: Options) -> float:
    of_choice = {
        "unbiased": result.unbiased_um,
        "text": result.text_um,
        "listing": result.listed.grid_um,
    }
    return of_choice[options.grid_sigma]


def needed_memory(pointings: int) -> int:
    """Return the bytes that a calibration of so many pointings takes at the most, with some to spare."""
    return BASE + PER_POINTING * pointings


def calibrate(session: Session, options: Options | None = None) -> Calibration:
    """Calibrate a comparator.

    Parameters
    ----------
    session
        What was measured.
    options
        Choices; see :class:`Options`.

    Raises
    ------
    InputError
        Measurements that cannot be used; file, record number and record are named as far as they are known.
    AdjustmentError
        Too few points, or placements that do not determine the parameters.
    OutOfMemoryError
        There is less memory than so many pointings take.
    """
    options = options or Options()
    session.check()
    session = session.expanded()
    pointings = sum(len(case.points) for case in session.cases)
    require(needed_memory(pointings), f"a calibration of {pointings} pointings")
    messages = list(session.messages)
    cases = [_case(session, index, options, messages) for index in range(len(session.cases))]
    _check_handedness(session, cases)
    placed = [case.placed for case in cases]
    listed = options.free_residuals == "report"
    linear = combine_linear(placed, [case.linear for case in cases], as_listed=listed)
    nonlinear = None
    if options.polynomial:
        try:
            nonlinear = combine_polynomial(placed, linear, as_listed=listed)
        except AdjustmentError as error:
            messages.append(Message(f"no polynomials: {error}"))
    pointing = _pointing(cases, options)
    averages = _averages(session, cases, linear, nonlinear)
    variance = _variance(session, cases, pointing, linear, nonlinear, averages, options, messages)
    messages += plate_remarks(session, placed)
    joint = _joint(session, placed, linear, pointing, nonlinear is not None, options, messages)
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
        case_test=_case_test(cases),
        joint=joint,
        joint_check=_joint_check(session, placed, linear) if options.joint else None,
        screening=screening,
        pointing_tests=tuple(tests),
        far_pointings=tuple(far),
        messages=[*problems(session, placed, screening, far, joint), *messages],
    )


def _case(session: Session, index: int, options: Options, messages: list[Message]) -> CaseResult:
    """Take one case through the single-case stages."""
    case = session.cases[index]
    closeouts, remarks = close_out(case)
    placed, more = place_case(case, session.grid_of(case), as_listed=options.order == "listing")
    messages += remarks + more
    free = fit_rigid(
        placed.points, placed.means_um, placed.grid_um, as_listed=options.free_residuals == "report"
    )
    try:
        linear = fit_affine(placed.points, placed.means_um, placed.grid_um)
    except AdjustmentError as error:
        raise case.place.error(f"case {case.number}: {error}") from None
    polynomial = None
    if options.polynomial:
        try:
            polynomial = single_polynomial(
                placed, linear, as_listed=options.case_polynomial_residuals == "listing"
            )
        except AdjustmentError as error:
            messages.append(Message(f"case {case.number}: no polynomials of its own: {error}"))
    return CaseResult(placed, closeouts, free, linear, polynomial)


def _check_handedness(session: Session, cases: Sequence[CaseResult]) -> None:
    """Refuse a handedness that no case shares; where only some differ, the plate was turned over."""
    if session.left_handed is None:
        return
    if all(case.placed.orientation.left_handed != session.left_handed for case in cases):
        hands = ("right", "left")
        raise cases[0].placed.case.place.error(
            f"case {cases[0].number} was measured in a {hands[not session.left_handed]}-handed system,"
            f" but the input says {hands[session.left_handed]}-handed"
        )


def _pointing(cases: Sequence[CaseResult], options: Options) -> Pointing:
    listed = options.pointing_dof == "listing"
    by_operator: dict[int, list[CaseResult]] = {}
    for case in cases:
        by_operator.setdefault(case.placed.case.operator, []).append(case)
    points, total = pool_points([case.placed.readings for case in cases], as_listed=listed)
    return Pointing(
        {
            operator: pool_points([case.placed.readings for case in own], as_listed=listed)
            for operator, own in by_operator.items()
        },
        points,
        total,
    )


def _averages(
    session: Session,
    cases: Sequence[CaseResult],
    linear: CombinedLinear,
    nonlinear: CombinedPolynomial | None,
) -> dict[str, dict[int, PlateResult]]:
    """Average the residuals of every stage, plate by plate."""
    stages: dict[str, list[Residuals]] = {"case_linear": [case.linear.residuals for case in cases]}
    own = [case.polynomial.residuals for case in cases if case.polynomial]
    if len(own) == len(cases):
        stages["case_nonlinear"] = own
    combined: dict[str, CombinedLinear | CombinedPolynomial] = {"linear": linear}
    if nonlinear:
        combined["nonlinear"] = nonlinear
    for name, stage in combined.items():
        stages[name] = [fit.residuals for fit in stage.cases]
    placed = [case.placed for case in cases]
    rows = [session.grid_of(case.case).rows_of(case.points) for case in placed]
    result = {}
    for name, residuals in stages.items():
        # Of single-case stages the report prints the averages only.
        sigmas = unbiased_grid_sigma(rows, placed, combined[name])[0] if name in combined else {}
        result[name] = _plates(session, placed, residuals, sigmas)
    return result


def _plates(
    session: Session, placed: Sequence[PlacedCase], residuals: Sequence[Residuals], sigmas: dict[int, float]
) -> dict[int, PlateResult]:
    plates = {}
    for plate in dict.fromkeys(case.case.plate for case in placed):
        own = [k for k, case in enumerate(placed) if case.case.plate == plate]
        averages = average_residuals(
            session.grids[plate], [placed[k] for k in own], [residuals[k] for k in own]
        )
        plates[plate] = PlateResult(
            averages, listed_grid_sigma(averages), text_grid_sigma(averages), sigmas.get(plate, math.nan)
        )
    return plates


def _variance(
    session: Session,
    cases: Sequence[CaseResult],
    pointing: Pointing,
    linear: CombinedLinear,
    nonlinear: CombinedPolynomial | None,
    averages: dict[str, dict[int, PlateResult]],
    options: Options,
    messages: list[Message],
) -> VarianceAnalysis:
    squares, points = 0.0, 0
    for plate, result in averages["nonlinear" if nonlinear else "linear"].items():
        known = session.grids[plate].sigma_um
        sigma = (
            _chosen_sigma(result, options) if options.variance_grid == "computed" or known is None else known
        )
        squares += len(result.averages.points) * (0.0 if math.isnan(sigma) else sigma) ** 2
        points += len(result.averages.points)
    analysis = analyse_variance(
        [case.free for case in cases],
        linear,
        nonlinear,
        pointing.total,
        math.sqrt(squares / points),
        as_listed=options.nanometres == "truncated",
    )
    messages += [
        Message(f"the variance of the {name} component comes out negative; it is taken as 0")
        for name in analysis.negative
    ]
    return analysis


def _case_test(cases: Sequence[CaseResult]) -> CaseVarianceTest | None:
    """Compare the variances of unit weight of the linear adjustments of the cases."""
    dof = [2 * len(case.placed.points) - 6 for case in cases]
    if len(cases) < 2:
        return None
    return compare_case_variances([case.linear.residuals.comparator_um for case in cases], dof)


def _joint(
    session: Session,
    placed: Sequence[PlacedCase],
    linear: CombinedLinear,
    pointing: Pointing,
    polynomial: bool,
    options: Options,
    messages: list[Message],
) -> JointFit | None:
    if not options.joint:
        return None
    precision = pointing.total
    known = precision.sd_um if precision.degrees_of_freedom > 0 else (0.0, 0.0)
    grid = {plate: session.grids[plate].sigma_um for plate in dict.fromkeys(c.case.plate for c in placed)}
    for plate in grid:
        turns = {case.orientation.corner for case in placed if case.case.plate == plate}
        if options.estimate_grid and len(turns) > 1:
            grid[plate] = None
        elif grid[plate] is None and len(turns) < 2:
            messages.append(
                Message(f"plate {plate} has no known accuracy and lies one way only: it is held fixed")
            )
            grid[plate] = 0.0
    try:
        found = adjust_jointly(placed, session.grids, linear, Weights(grid, known), polynomial=polynomial)
        identity = Identity.of(session, [case.means_um for case in placed])
        return replace(found, correction=replace(found.correction, identity=identity))
    except AdjustmentError as error:
        messages.append(Message(str(error)))
        return None


def _joint_check(session: Session, placed: Sequence[PlacedCase], linear: CombinedLinear) -> float:
    """Compare the weighted mean with a joint adjustment under the same assumptions."""
    fixed = Weights(dict.fromkeys(session.grids, 0.0), random_um=max(linear.sigma0_um, LEAST_UM))
    joint = adjust_jointly(placed, session.grids, linear, fixed, polynomial=False).correction
    mean = linear.correction
    differences = [
        mean.scale_x - joint.scale_x,
        mean.scale_y - joint.scale_y,
        mean.nonorthogonality_rad - joint.nonorthogonality_rad,
    ]
    return float((np.abs(differences) / np.sqrt(np.diag(joint.covariance)[:3])).max())
