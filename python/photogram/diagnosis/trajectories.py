"""The check of a block on trajectories: its adjustment and data snooping.

The other checks assume one pose per photo. Observations of a moving photo do not fit one pose, and any tried
unit, axis or angle would be blamed for it.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from photogram.diagnosis.after_adjustment import explained, remarks
from photogram.diagnosis.blunders import edit
from photogram.diagnosis.clocks import counted_lines
from photogram.diagnosis.findings import Section, note_all, note_verdict, section_of
from photogram.diagnosis.gross import Suspects
from photogram.diagnosis.mistakes import Adjuster
from photogram.diagnosis.registry import hints_at
from photogram.diagnosis.structure import structure_section
from photogram.errors import AdjustmentError, InputError
from photogram.messages import counted
from photogram.network.block import Block, flown_by
from photogram.network.motion import timed_photos
from photogram.results.result import Result

if TYPE_CHECKING:
    from photogram.diagnosis.findings import Words


def flown_checked(block: Block, words: Words, adjusted: Adjuster) -> tuple[list[Section], Result | None]:
    """Check a block with photos or records on trajectories."""
    structure = structure_section(block, None, words)
    timed = timed_photos(block)
    at_rest = {name for name, moves in zip(block.photo_ids, timed.tolist(), strict=True) if not moves}
    # Photos on a trajectory may be tied by other observations than points.
    structure.findings = [each for each in structure.findings if at_rest.issuperset(each.photos)]
    section = section_of("moving")
    section.remark(
        "check.remark.moving",
        flown=flown_by(block),
        photos=counted(len(timed), "photo"),
        timed=int(timed.sum()),
    )
    try:
        result = adjusted(block)
    except (AdjustmentError, InputError) as error:
        section.note("grave", "check.no-adjustment", reason=str(error))
        hints = hints_at("data", block) or hints_at("misfit", block, adjusted)
        note_all(section, "convention", "grave", hints)
        return [structure, section], None
    note_all(section, "convention", "grave", explained(result))
    note_all(section, "moving", "look", remarks(result))
    section.findings += counted_lines(block, adjusted)
    edited = edit(block, Suspects.none(block), adjusted)
    if edited.last is not None and (result.converged or edited.last.converged):
        section.findings += [*edited.gross, *edited.section.findings, *chain(*edited.control.values())]
    note_verdict(section, result.verdict)
    return [structure, section], result
