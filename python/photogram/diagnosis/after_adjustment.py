"""Explanations of an adjustment that failed or fits badly."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from photogram.diagnosis.names import with_exchanges
from photogram.diagnosis.registry import hints_at
from photogram.errors import AdjustmentError, OutOfMemoryError
from photogram.messages import Message
from photogram.network.block import Block
from photogram.results.fixed_tests import is_suspected
from photogram.results.result import Result

if TYPE_CHECKING:
    from photogram.adjustment.first_values import FirstValues
    from photogram.diagnosis.findings import Diagnosis

BAD = 5.0  # Sigma0 above which a converged adjustment is suspect


@contextmanager
def errors_explained(block: Block | FirstValues) -> Iterator[None]:
    """Append mistakes in the data that explain a failed adjustment to its error."""
    try:
        yield
    except OutOfMemoryError:
        raise
    except AdjustmentError as error:
        from photogram.diagnosis.mistakes import Adjuster

        block = block if isinstance(block, Block) else block.usable()
        found = hints_at("data", block) or hints_at("misfit", block, Adjuster({}, (block, error)))
        error.args = ("\n".join([str(error), *(f"  hint: {hint}" for hint in found)]), *error.args[1:])
        raise


def diagnosed(result: Result) -> Result:
    """Add hints and exchanged names to a result that has not converged or fits badly.

    Mistakes in conventions (`hints`) and exchanged names (`exchanged`) enter the verdict. Hints are also
    messages.
    """
    found, said = explained(result), remarks(result)
    if found or said:
        messages = [*found, *said, *result.messages]
        result = replace(result, hints=tuple(map(str, found)), messages=messages)
    return with_exchanges(result)


def explained(result: Result) -> list[Message]:
    """Return mistakes in data conventions that explain a failed or bad adjustment."""
    if result.loss is not None:
        return []
    variance = result.variance_of_unit_weight or 0.0
    is_bad = not result.converged or variance > BAD**2
    found = hints_at("data", result.block) if is_bad else []
    if result.WHOLE and not found and (not result.converged or is_suspected(result)):
        from photogram.diagnosis.mistakes import Adjuster

        found = hints_at("misfit", result.block, Adjuster.of(result))
    return found


def remarks(result: Result) -> list[Message]:
    """Return hints on a good result: readout directions, clock offsets, fiducial marks."""
    is_special = result.converged and bool(result.unknowns or result.block.observations)
    return hints_at("fit", result) if is_special else []


def diagnosis_of(result: Result) -> Diagnosis:
    """Return the diagnosis and verdict of an adjustment that failed or fits badly."""
    from photogram.diagnosis.findings import Diagnosis, note_all, note_verdict, section_of

    found = diagnosed(result)
    section = section_of("explained")
    hints = [each for each in found.messages if str(each) in found.hints]
    note_all(section, "convention", "grave", hints)
    note_all(section, "exchanged-points", "grave", found.exchanged)
    note_all(section, "moving", "look", remarks(found))
    note_verdict(section, found.verdict)
    return Diagnosis(result.block.title, [section], found, adjusted_before=True)
