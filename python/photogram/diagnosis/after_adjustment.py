"""Explanations of an adjustment that failed or fits badly.

The explaining modules are imported on demand, because most adjustments fit.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from photogram.diagnosis.names import with_exchanges
from photogram.errors import AdjustmentError, OutOfMemoryError
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.film_reduction import as_seen
from photogram.results.fixed_tests import is_suspected
from photogram.results.result import Result

if TYPE_CHECKING:
    from photogram.adjustment.first_values import FirstValues
    from photogram.diagnosis.diagnosis import Diagnosis

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
        from photogram.diagnosis.shutters import readout_hints

        block = block if isinstance(block, Block) else block.usable()
        found = _of_block(block) or readout_hints(block, Adjuster({}, (block, error)))
        error.args = ("\n".join([str(error), *(f"  hint: {hint}" for hint in found)]), *error.args[1:])
        raise


def diagnosed(result: Result) -> Result:
    """Add hints and exchanged names to a result that has not converged or fits badly.

    Mistakes in conventions (`hints`) and exchanged names (`exchanged`) enter the verdict. Hints are also
    messages.
    """
    return with_exchanges(_with_hints(result))


def explained(result: Result) -> list[Message]:
    """Return mistakes in data conventions that explain a failed or bad adjustment."""
    if result.loss is not None:
        return []
    found = _of_block(result.block) if _bad(result) else []
    if result.WHOLE and not found and (not result.converged or is_suspected(result)):
        from photogram.diagnosis.mistakes import Adjuster
        from photogram.diagnosis.shutters import readout_hints, rolling_hints

        found = readout_hints(result.block, Adjuster({}, (result.block, result))) or rolling_hints(result)
    return found


def remarks(result: Result) -> list[Message]:
    """Return hints on a good result: readout directions, clock offsets, fiducial marks."""
    if not (result.converged and (result.unknowns or result.block.observations)):
        return []
    from photogram.diagnosis.clocks import known_offsets
    from photogram.diagnosis.film_lenses import lens_hints
    from photogram.diagnosis.film_marks import axis_hints, mark_hints
    from photogram.diagnosis.film_scans import line_hints, seam_hints
    from photogram.diagnosis.mistakes import Adjuster
    from photogram.diagnosis.shutters import backward_readouts

    # A film in two pieces, or one that has changed along one axis, also makes marks fail.
    adjusted = Adjuster({}, (result.block, result))
    films = seam_hints(result) or axis_hints(result, adjusted) or mark_hints(result)
    films += [*lens_hints(result, adjusted), *line_hints(result)]
    return [*backward_readouts(result), *known_offsets(result), *films]


def _of_block(block: Block) -> list[Message]:
    from photogram.diagnosis.conventions import hints
    from photogram.diagnosis.trajectory_hints import flown_hints

    return [*hints(as_seen(block)), *flown_hints(block)]


def _bad(result: Result) -> bool:
    variance = result.variance_of_unit_weight
    return not (result.converged and (variance is None or variance <= BAD**2))


def _with_hints(result: Result) -> Result:
    found, said = explained(result), remarks(result)
    if not (found or said):
        return result
    return replace(
        result,
        hints=tuple(map(str, found)),
        messages=[*found, *said, *result.messages],
    )


def diagnosis_of(result: Result) -> Diagnosis:
    """Return the diagnosis and verdict of an adjustment that failed or fits badly."""
    from photogram.diagnosis.diagnosis import Diagnosis
    from photogram.diagnosis.findings import Section, note_all, note_verdict

    found = diagnosed(result)
    section = Section("Adjustment", "One mistake in the data makes every observation look wrong.")
    hints = [each for each in found.messages if str(each) in found.hints]
    note_all(section, "convention", "grave", hints)
    note_all(section, "exchanged-points", "grave", found.exchanged)
    note_all(section, "moving", "look", remarks(found))
    note_verdict(section, found.verdict)
    return Diagnosis(result.block.title, [section], found, adjusted_before=True)
