"""Absolute orientation by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.absolute_orientation.hints import Fit, find, undecided, unit_of
from photogram.absolute_orientation.orientation import Orientation, Trace
from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.stations import Stations
from photogram.arguments.arrays import names as names_of
from photogram.arguments.arrays import number, one_of, truth_value, whole_number
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError, RankError, failure_of_core
from photogram.messages import Message
from photogram.results.parts import Iteration
from photogram.statistics.limits import externally_studentized, global_test
from photogram.words import phrase

Method = Literal["rigorous", "report", "fill-in"]
Start = Literal["auto", "report", "closed-form"]
UnitVariance = Literal["estimated", "unity"]


MOST_ITERATIONS = 50
TRIAL_ITERATIONS = 15  # Fitting control needs four or five; a trial with more explains nothing
WEAK = 1e3  # Condition number above which control is weak
SUSPICIOUS = 1e-4
"""Root mean square residual, relative to the size of the model, above which the cause is searched.

The residuals of good control are a few parts in a hundred thousand."""
NO_FIT = 0.1  # The same for a failed orientation
IN_A_PLANE = 3.0  # Largest distance of points from a common plane (rms residuals)
ROUNDING = 1e-9  # Residuals below this fraction of the size of the model are rounding


def orient(
    stations: Stations,
    *,
    method: Method = "rigorous",
    start: Start | None = None,
    former: Similarity | Orientation | None = None,
    reject: Iterable[object] = (),
    unit_variance: UnitVariance = "estimated",
    max_iterations: int = MOST_ITERATIONS,
    tolerance: float = 1e-5,
    trace: bool = False,
    scale: float | None = None,
) -> Orientation:
    """Compute the absolute orientation of a model: s, A and B of x = s A X + B.

    Any mix of control coordinates is allowed. The weighted sum of squares of the residuals in both systems is
    minimised. Without standard deviations, it is the sum of squares of u = s X - A^T (x - B) over the known
    components (TB 19, corrected for partial control).

    Parameters
    ----------
    stations
        Model and control coordinates.
    method
        `rigorous` iterates until no unknown changes by more than `tolerance`. `report` is the bulletin's
        cycle on the same residuals (Gauss-Crout, until all angle corrections are at most 1e-5 rad). `fill-in`
        is the bulletin's cycle on its own equations, with missing coordinates taken from the last cycle. With
        partial control its result differs by about 1e-6 rad. The report's methods do not use standard
        deviations.
    start
        `report`: from the first two stations (omega = phi = 0, any kappa). `closed-form`: at any attitude, by
        Horn's quaternion for full control, otherwise the best minimum over all rotations. `auto`: the
        report's values, unless the closed form finds a better minimum. None means `auto`, or `report` with
        the report's methods.
    former
        A previous result used as initial values.
    reject
        Identifiers of stations whose control is not used; their differences are reported.
    unit_variance
        `estimated` scales covariances by sigma0 squared; `unity` does not (requires standard deviations).
    max_iterations
        Maximum number of iterations.
    tolerance
        Largest change of an unknown at convergence, as a fraction of its standard deviation.
    trace
        True to store intermediate results of the report's methods (`traces`).
    scale
        Known s, model units per ground unit, which is then fixed. Six unknowns remain, and one horizontal
        coordinate less is needed.

    Returns
    -------
    The orientation; `status` reports convergence, and `usable` whether the values can be used.

    Raises
    ------
    RankError
        If the control does not determine the unknowns. Required are seven components (six with a fixed
        scale), four horizontal ones (three) and three elevations. Stations or elevations in a straight line,
        or coincident horizontal stations, are not sufficient. `points` contains the stations.
    AdjustmentError
        If the scale becomes zero or negative (the model is a mirror image), or a value is not finite.
    InputError
        If an option is invalid, or the first two stations lack horizontal coordinates or coincide with
        `start="report"`.
    KeyboardInterrupt
        If interrupted by Ctrl-C.
    """
    truth_value("trace", trace)
    one_of("method", method, get_args(Method))
    one_of("unit_variance", unit_variance, get_args(UnitVariance))
    start = ("auto" if method == "rigorous" else "report") if start is None else start
    one_of("start", start, get_args(Start))
    whole_number("max_iterations", max_iterations)
    rejected = tuple(names_of("reject", reject))
    number("max_iterations", max_iterations, "positive")
    number("tolerance", tolerance, "positive")
    number("scale", 1.0 if scale is None else scale, "positive")
    if trace and method == "rigorous":
        raise InputError(phrase("orientation.trace"))
    if unknown := [name for name in rejected if name not in stations.ids]:
        raise InputError(phrase("orientation.no-station", station=unknown[0]))
    if stations.model_sd is not None and method != "rigorous":
        raise InputError(phrase("orientation.method-sd", method=method))
    if stations.model_sd is None and unit_variance == "unity":
        raise InputError(phrase("orientation.unity"))
    used = stations.held & ~np.isin(np.array(stations.ids, dtype=object), rejected)[:, np.newaxis]
    rows = np.flatnonzero(used.any(axis=1))
    control = np.where(used, stations.control, np.nan)[rows]

    common: dict[str, Any] = {"max_iterations": max_iterations, "tolerance": tolerance, "threads": 0}
    if scale is not None:
        common["scale"] = scale

    def solve(control: Floats, **options: Any) -> _photocore.SimilaritySolution:
        return _photocore.orient_model(
            control,
            np.where(used, stations.control_sd, np.inf)[rows],
            stations.model[rows],
            np.ones((len(rows), 3)) if stations.model_sd is None else stations.model_sd[rows],
            **{"former": None, "trace": False, **common, **options},
        )

    known = former.similarity if isinstance(former, Orientation) else former
    row = known and (known.scale, known.rotation.tolist(), known.translation.tolist())
    try:
        solution = solve(control, method=method, start=start, former=row, trace=trace)
    except _photocore.SimilarityError as error:
        raise _named(stations, used, rows, scale is not None, *error.args) from None
    if not np.isfinite(solution.sum_of_squares):
        raise AdjustmentError(phrase("orientation.overflow"))
    result = _orientation(stations, used, rejected, method, unit_variance, rows, solution, scale is not None)

    def fit(changed: Floats) -> Fit | None:
        try:
            found = solve(changed, method="rigorous", start="closed-form", max_iterations=TRIAL_ITERATIONS)
        except _photocore.SimilarityError:
            return None
        usable = found.status == "converged" and np.isfinite(found.sum_of_squares)
        return (found.sum_of_squares, found.similarity[1][2][2]) if usable else None

    messages, grave = _doubts(result, rows, control, solution, fit)
    return replace(result, messages=messages, grave=grave)


def _doubts(
    result: Orientation,
    rows: NDArray[np.intp],
    control: Floats,
    solution: _photocore.SimilaritySolution,
    fit: Callable[[Floats], Fit | None],
) -> tuple[list[Message], list[Message]]:
    """Find probable mistakes if the model fits badly, and ambiguities if it fits well."""
    model = result.stations.model[rows]
    size = math.sqrt(float(((model - model.mean(axis=0)) ** 2).sum() / len(rows)))
    # Rounding errors of a perfect fit, in the unit of the sum of squares.
    unit = result.weighted_sum_of_squares / result.rms**2 if result.rms > 0 else result.known
    rounding = unit * (ROUNDING * size) ** 2
    failed = result.test is not None and result.test.problem() is not None
    messages, grave = list(result.messages), list[Message]()
    if not result.converged or failed or result.rms > SUSPICIOUS * size or result.outliers:
        hints = find(
            [result.stations.ids[row] for row in rows.tolist()],
            control,
            result.similarity.transform(model)[0],
            sum_of_squares=solution.sum_of_squares,
            rounding=rounding,
            degrees_of_freedom=result.degrees_of_freedom,
            orient=fit,
        )
        grave = [Message(text) for text, accepted in hints if accepted]
        messages[:0] = [Message(text) for text, accepted in hints if not accepted]
    if not grave and result.rms > NO_FIT * size and (result.test is None or result.test.rejected_high):
        grave.append(Message.of("orientation.no-fit", percent=100 * result.rms / size))
    elif not grave and _in_a_plane(model[np.isfinite(control[:, 2])], result.rms, size):
        here = solution.sum_of_squares, float(result.similarity.rotation[2, 2])
        if open_question := undecided(control, here, rounding, fit):
            messages.append(Message(open_question))
    covariance = result.similarity.tangent_covariance
    deviation = math.nan if covariance is None else math.sqrt(float(covariance[3, 3]))
    if remark := unit_of(result.similarity.scale, deviation):
        messages.append(Message(remark))
    return messages, grave


def _in_a_plane(model: Floats, rms: float, size: float) -> bool:
    """Whether points are in a plane within the residuals."""
    off_plane = float(np.linalg.svd(model - model.mean(axis=0), compute_uv=False)[-1]) / math.sqrt(len(model))
    return len(model) <= 3 or off_plane <= IN_A_PLANE * rms + ROUNDING * size


def _orientation(
    stations: Stations,
    used: Bools,
    rejected: tuple[str, ...],
    method: str,
    unit_variance: str,
    rows: NDArray[np.intp],
    solution: _photocore.SimilaritySolution,
    held: bool,
) -> Orientation:
    weighted = stations.model_sd is not None
    freedom = int(used.sum()) - 7 + held
    squares = solution.sum_of_squares if weighted else float(np.nansum(solution.misclosures**2))
    variance = squares / freedom if freedom else None
    scale = 1.0 if weighted and (unit_variance == "unity" or variance is None) else variance
    count = len(stations.ids)

    def spread(values: Floats) -> Floats:
        full = np.full((count, *values.shape[1:]), np.nan)
        full[rows] = values
        return full

    known = np.nan if scale is None else scale
    similarity = Similarity.from_core(
        solution.similarity,
        None if scale is None else scale * solution.tangent_cofactors,
        math.sqrt(scale) if weighted and scale else 1.0,
    )
    return Orientation(
        stations=stations,
        used=used,
        rejected=rejected,
        similarity=similarity,
        initial=Similarity.from_core(solution.initial),
        started=solution.started,
        alternatives=[Similarity.from_core(row) for row in solution.alternatives],
        method=method,
        status=solution.status,
        iterations=[Iteration(*row) for row in solution.iterations],
        cycles=solution.cycles,
        residuals=spread(solution.misclosures),
        model_residuals=spread(solution.model_residuals),
        adjusted_control=spread(solution.adjusted_control),
        control_covariances=spread(known * solution.control_cofactors),
        redundancy=spread(solution.redundancy),
        standardized=spread(solution.standardized / (1.0 if weighted else (variance or np.nan) ** 0.5)),
        studentized=spread(externally_studentized(solution.standardized, squares, freedom)),
        test=global_test(squares, freedom) if weighted else None,
        unit_variance=unit_variance,
        traces=[Trace(*row) for row in solution.traces],
        grave=[],
        weighted_sum_of_squares=squares,
        covariance_scale=scale,
        condition=solution.condition,
        scale_held=held,
        messages=_messages(solution, [stations.ids[row] for row in rows.tolist()], scale, freedom),
    )


def _messages(
    solution: _photocore.SimilaritySolution, names: list[str], scale: float | None, freedom: int
) -> list[Message]:
    """Return warnings that did not stop the orientation, in the order of severity."""
    messages = []
    if solution.alternatives:
        angles = [np.degrees(Similarity.from_core(row).angles).tolist() for row in solution.alternatives]
        others = [
            phrase("orientation.angles", omega=omega, phi=phi, kappa=kappa) for omega, phi, kappa in angles
        ]
        kind = "report" if solution.started == "report" else "least"
        messages.append(Message.of(f"orientation.alternatives.{kind}", angles=others))
    if solution.weakness:
        kind, concerned = solution.weakness
        code = f"orientation.{kind.replace(' ', '-')}"
        messages.append(Message.of(code, names=[names[i] for i in concerned]))
    elif solution.condition > WEAK:
        messages.append(Message.of("orientation.weak", condition=solution.condition))
    if freedom == 0:
        covariances = "unknown" if scale is None else "unscaled"
        messages.append(Message.of(f"orientation.no-freedom.{covariances}"))
    return messages


def _named(
    stations: Stations,
    used: Bools,
    rows: NDArray[np.intp],
    held: bool,
    kind: str,
    message: str,
    concerned: list[int],
) -> AdjustmentError | InputError:
    """Return an error of the core with the names of its stations."""
    names = [stations.ids[rows[i]] for i in concerned if i < len(rows)]
    if kind == "insufficient":
        counts = dict(zip("xyz", map(int, used.sum(axis=0)), strict=True))
        text = phrase("orientation.insufficient", **counts, all=7 - held, horizontal=4 - held)
        return RankError(text, [], [stations.ids[row] for row in rows])
    if kind == "undetermined":
        return RankError(phrase("orientation.undetermined", message=message, names=names), [], names)
    if kind == "first stations":
        return InputError(phrase("orientation.first-stations", message=message, names=names))
    if kind == "scale":
        return AdjustmentError(phrase("orientation.scale"))
    return failure_of_core(kind, message)
