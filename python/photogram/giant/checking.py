"""The check of a project, with remarks on its files."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools
from photogram.diagnosis.diagnose import check_block
from photogram.diagnosis.findings import Diagnosis, Finding, Section, Words
from photogram.giant.limits import Limits, error_warnings
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.giant import Project

CODES = np.array([1, 2, 4])  # Types of control: the sum of the codes of its components


class _GuideWords(Words):
    sense = "COMMON column 2"
    order = "FRAMES"
    usual_um = (5.0, 15.0)
    bandwidth = True
    iterations = True

    def remedy(self, kept: Bools) -> Phrase:
        return phrase("check.remedy.type", type=_type_code(kept))

    def values(self, kept: Bools) -> dict[str, float]:
        return {"type_code": float(_type_code(kept))}


def _type_code(kept: Bools) -> int:
    return int(CODES[~kept].sum())


def check(project: Project, *, limits: Limits | None = None, threads: int | None = None) -> Diagnosis:
    """Check a project as in Appendix H of the guide.

    Nothing is changed or written. Later steps use the corrections of earlier ones (a wrong sign, a rotated
    photo) and omit invalid data, so that every error is reported separately.

    Parameters
    ----------
    project
        The project.
    limits
        Limits of the 1987 program; by default none.
    threads
        Threads of the adjustment; the findings do not depend on it. Default: all processors.

    Returns
    -------
    The findings, section by section.
    """
    block = project.to_block(limits)
    common = project.common
    why = "COMMON column 10 asks for intersection only" if common.intersection_only else ""
    options = {"unit_variance": common.unbiased_variance, "threads": threads}
    sections, result = check_block(block, options, _GuideWords(), why)
    files = Section("Input", "Remarks on the files, and the warnings of the 1987 program.")
    counts = {"photos": len(block.photo_ids), "points": len(block.point_ids), "images": len(block.image_xy)}
    files.remark("giant.counts", **counts)
    files.findings += [Finding("remark", "look", str(message)) for message in project.messages]
    for warning in error_warnings(project, block, limits):
        files.figure(warning.heading.capitalize(), ", ".join(warning.names))
        text = f"{warning.heading.lower()}: {len(warning.names)}"
        files.findings.append(Finding("warning", "look", text, [], warning.names))
    return Diagnosis(project.title, [files, *sections], result)
