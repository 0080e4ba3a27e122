"""Absolute orientation by least squares, and trials of mistakes in control that does not fit its model.

A hypothesis changes the control: a mirror image, elevations in another unit, coordinates exchanged at one
station. The model is oriented again for each. A hypothesis is accepted if the sum of squares decreases by far
more than chance and the number of trials allow (likelihood ratio f ln(Omega_0 / Omega_h)).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from itertools import combinations
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.absolute_orientation.orientation import Orientation, Trace
from photogram.absolute_orientation.similarity import Similarity
from photogram.absolute_orientation.stations import Stations
from photogram.arguments.arrays import names as names_of
from photogram.arguments.arrays import number, one_of, truth_value, whole_number
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError, RankError, failure_of_core
from photogram.messages import Message
from photogram.results.parts import Iteration
from photogram.statistics.likelihood import judged
from photogram.statistics.limits import externally_studentized, global_test
from photogram.words import Phrase, phrase

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
        hints = find_mistakes(
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


FOOT = 0.3048
STATIONS = 60  # Maximum number of stations that are tried one by one
WORK = 20_000
"""With many stations fewer are tried, at least FEW, so that the total work is limited."""
FEW = 6
PAIRS = 60
"""Maximum number of tried exchanges; pairs near each other's positions are preferred."""
MOST = 5  # Maximum number of successive hypotheses
AS_WELL = 4.0  # A mirror image fits as well if its sum of squares is at most this multiple
SAME_SCALE = 1e-3  # Relative difference from the ratio of feet and metres
SCALE_DEVIATIONS = 3.0
ROUNDING_OF_SCALE = 1e-5  # The same for coordinates of a few digits

UNITS = {FOOT: "feet", 1 / FOOT: "metres"}


Fit = tuple[float, float]
"""Of a trial orientation: its sum of squares, and a33, the cosine of its tilt."""
Orient = Callable[[Floats], Fit | None]
"""Orients the model with changed control; returns None on failure."""
Trial = tuple[Phrase, Floats, float]
"""A hypothesis, its control, and its sum of squares."""


def find_mistakes(
    names: list[str],
    control: Floats,
    placed: Floats,
    *,
    sum_of_squares: float,
    rounding: float,
    degrees_of_freedom: int,
    orient: Orient,
) -> list[tuple[Phrase, bool]]:
    """Try possible mistakes and return the ones that explain the residuals, and whether significantly.

    `control` (n, 3) is NaN if not used. `placed` are the control coordinates of the model by the given
    orientation, with its sum of squares and degrees of freedom. A sum of squares up to `rounding` is rounding
    only.
    """
    hints: list[tuple[Phrase, bool]] = []
    now = sum_of_squares
    while len(hints) < MOST:
        tried = trials(names, control, placed, rounding, orient)
        verdict = judged(now, [squares for *_, squares in tried], degrees_of_freedom)
        if verdict is None:
            break
        best = [tried[place] for place in verdict.best]
        kind = "probable" if verdict.accepted else "possible"
        causes = [text for text, *_ in best]
        text = phrase(f"orientation.{kind}", causes=causes, factor=float(verdict.fall))
        hints.append((text, verdict.accepted))
        if not verdict.accepted:
            break
        _, control, now = best[0]
    return hints


def trials(names: list[str], control: Floats, placed: Floats, rounding: float, orient: Orient) -> list[Trial]:
    """Orient the model by hypotheses, mistakes of the set first; see :func:`find_mistakes`."""
    return [
        (text, changed, max(fit[0], rounding))
        for text, changed in _hypotheses(names, control, placed)
        if (fit := orient(changed)) is not None
    ]


def _hypotheses(names: list[str], control: Floats, placed: Floats) -> Iterator[tuple[Phrase, Floats]]:
    yield phrase("orientation.mirror"), control * [1.0, 1.0, -1.0]
    for factor, unit in UNITS.items():
        yield phrase(f"orientation.elevations-in-{unit}"), control * [1.0, 1.0, factor]
    yield phrase("orientation.axis-in-feet", axis="X"), control * [FOOT, 1.0, 1.0]
    yield phrase("orientation.axis-in-feet", axis="Y"), control * [1.0, FOOT, 1.0]
    suspects = _suspects(control, control - placed)
    for row in suspects:
        changes = {"axes-exchanged": control[row, [1, 0, 2]]} if np.isfinite(control[row, :2]).all() else {}
        changes |= {f"station-in-{unit}": control[row] * factor for factor, unit in UNITS.items()}
        for code, changed in changes.items():
            whole = control.copy()
            whole[row] = changed
            yield phrase(f"orientation.{code}", station=names[row]), whole
    for one, other in _pairs(control, placed, suspects):
        whole = control.copy()
        whole[[one, other]] = control[[other, one]]
        yield phrase("orientation.stations-exchanged", first=names[one], second=names[other]), whole


def _pairs(control: Floats, placed: Floats, suspects: list[int]) -> list[tuple[int, int]]:
    """Return station pairs with equal known components, the closest first."""
    known = np.isfinite(control)
    pairs = [(one, other) for one, other in combinations(suspects, 2) if (known[one] == known[other]).all()]

    def apart(pair: tuple[int, int]) -> float:
        own, swapped = control[list(pair)], control[list(pair[::-1])]
        at = placed[list(pair)]
        return float(np.nansum((at - swapped) ** 2) - np.nansum((at - own) ** 2))

    return sorted(pairs, key=apart)[:PAIRS]


def _suspects(control: Floats, residuals: Floats) -> list[int]:
    """Return stations to be tried: all, or large residuals and distant ones.

    A distant station attracts the orientation, and its residual may be small.
    """
    count = len(control)
    tried = min(STATIONS, max(FEW, WORK // count))
    if count <= tried:
        return list(range(count))
    distance = np.nansum(np.abs(control - np.nanmedian(control, axis=0)), axis=1)
    size = np.nansum(np.abs(residuals), axis=1)
    worst = (np.argsort(-values)[: tried // 2].tolist() for values in (distance, size))
    return sorted({row for rows in worst for row in rows})


def unit_of(scale: float, sd: float) -> Phrase | None:
    """Return a message if a scale within its sd is the ratio of feet and metres."""
    for factor, unit in UNITS.items():
        near = abs(math.log(scale / factor))
        if near <= SAME_SCALE and not near > max(SCALE_DEVIATIONS * sd / scale, ROUNDING_OF_SCALE):
            return phrase(f"orientation.scale-in-{unit}", scale=scale)
    return None


def undecided(control: Floats, fit: Fit, rounding: float, orient: Orient) -> Phrase | None:
    """Return a message if a mirrored model fits as well, with control in a plane.

    `control` (n, 3) is NaN if it is not used; a sum of squares up to `rounding` is rounding only.
    """
    mirrored = orient(control * [1.0, 1.0, -1.0])
    if mirrored is None or mirrored[0] > AS_WELL * fit[0] + rounding:
        return None
    # In the mirror image, the third axis has the opposite direction.
    is_upside_down = fit[1] < 0 < -mirrored[1]
    return phrase("orientation.plane.upside-down" if is_upside_down else "orientation.plane")
