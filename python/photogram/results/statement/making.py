"""Making a statement of an adjusted block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.errors import AdjustmentError
from photogram.results.result import Result
from photogram.results.statement.budget import budgets
from photogram.results.statement.comparison import Compared, compared, control_places
from photogram.results.statement.figures import figures
from photogram.results.statement.given_coordinates import System, surveyed
from photogram.results.statement.judgement import judged
from photogram.results.statement.layout import Layout, layout
from photogram.results.statement.leave_one_out import leave_one_out
from photogram.results.statement.quantities import chosen, wanted
from photogram.results.statement.request import Asked
from photogram.results.statement.standards import standards
from photogram.results.statement.statement import Statement
from photogram.results.statement.texts import Texts
from photogram.show.methods import statement_of
from photogram.show.run import InputFile

__all__ = ["statement"]


@statement_of.register(Result)
def statement(
    result: Result,
    *,
    strict: bool = False,
    assumed: Sequence[str] = (),
    removed: Sequence[str] = (),
    system: System | None = None,
    inputs: Sequence[InputFile] = (),
    command: str = "",
    **asked: Any,
) -> Statement:
    """Return the accuracy statement of an adjusted block (docs/statement.md).

    Parameters
    ----------
    result
        The adjusted block, with covariances.
    strict
        Whether what is a remark otherwise has the exit code 4.
    assumed
        What was assumed when the files were read, in sentences.
    removed
        Observations that were taken out before, by their names.
    system
        In which coordinates are shown; None: the axes of the block.
    inputs, command
        What it was made of, for annex G.
    asked
        `standards`, `classes`, `area`, `sd`, `without`, `independent`, `language`, `text`, `budgets`,
        `coverage`, `client` ...: see :class:`photogram.results.statement.request.Asked`.

    Raises
    ------
    InputError
        Options that cannot be; check points without standard deviations of their survey, or that are control;
        quantities that there are not.
    AdjustmentError
        The adjustment has not converged, or has no covariances.
    OutOfMemoryError, KeyboardInterrupt
        As :meth:`photogram.Result.covariances`.
    """
    options = Asked.checked(**asked)
    if not result.converged:
        raise AdjustmentError(
            f"there is no statement of an adjustment that has not converged: {result.status}"
        )
    if (
        not result.WHOLE
        or not np.isfinite(result.point_cofactors[np.flatnonzero(result.used_points)[:1]]).all()
    ):
        raise AdjustmentError(
            "there is no statement without covariances: adjust with covariance=True, not in parts"
        )
    texts = Texts(options.language, options.text, result.block.linear_unit)
    covariances = result.covariances()
    found = compared(result, options, covariances)
    rest = found.without(list(options.without)) if options.without else None
    of_all = figures(found, options.coverage)
    of_vegetated = figures(found.in_vegetation(), options.coverage)
    left_out = leave_one_out(result)
    quantities = (
        chosen(result, found.names)
        if options.budgets is None
        else [wanted(result, each) for each in options.budgets]
    )
    taken_apart = budgets(
        result, quantities, covariances, coverage=options.coverage, components=options.components
    )
    said = standards(result, options, found, of_all, of_vegetated, left_out)
    lie = _layout(result, found)
    return Statement(
        result=result,
        asked=options,
        texts=texts,
        compared=found,
        of_all=of_all,
        of_rest=None if rest is None else figures(rest, options.coverage),
        of_vegetated=of_vegetated,
        left_out=tuple(left_out),
        taken_apart=tuple(taken_apart),
        standards=said,
        layout=lie,
        judged=judged(
            result,
            options,
            texts,
            found,
            of_all,
            of_vegetated,
            left_out,
            taken_apart,
            said,
            lie,
            assumed=assumed,
            removed=removed,
            strict=strict,
        ),
        removed=tuple(removed),
        survey=surveyed(result, found, system),
        inputs=tuple(inputs),
        command=command,
    )


def _layout(result: Result, found: Compared) -> Layout | None:
    """Return how the check points lie in the box of control and check points as they were given."""
    whole = np.isfinite(found.given[:, :2]).all(axis=1)
    if not whole.any():
        return None
    checks, control = found.given_places[whole], control_places(result.block)
    every = np.concatenate([checks, control]) if len(control) else checks
    if not np.ptp(every[:, :2], axis=0).any():
        return None
    return layout(checks, every, control)


check_arguments(globals(), ["statement"])
