"""Mistakes in conventions: units, axes and angles of images, photos and points, asked for before all else.

One such mistake makes every observation look wrong. So it is named once and put right for what follows.
"""

from __future__ import annotations

from photogram.adjustment.hints import distances_in_millimetres, hints, verdicts
from photogram.adjustment.hypotheses import TURNS
from photogram.diagnosis.findings import Finding, Section
from photogram.diagnosis.views import View

__all__ = ["conventions", "further"]

MOST = 5
"""Mistakes that are put right one upon the other, at the most."""


def conventions(view: View) -> tuple[Section, View, bool]:
    """Name the mistakes of whole sets that explain the images, and put them right.

    Signs, quarter turns and mirrored plates are left to the section on the sides of the cameras, which has
    words for groups of photos and single ones.

    Returns the section, the view of what was meant, and whether it is exactly that.
    """
    section = Section(
        "Units, axes and angles (images against their predictions)",
        "Another unit, axis or sense of angles makes every observation look wrong: it is looked for first.",
    )
    exact = True
    for _ in range(MOST):
        whole = [each for each in verdicts(view.seen) if not each.photos and not {*each.names} & {*TURNS}]
        if not whole:
            break
        best = whole[0]
        section.findings.append(Finding("convention", "grave", best.text))
        view, exact = view.changed(best.change), exact and best.exact
    bars = distances_in_millimetres(view.seen)
    if bars is not None:
        section.findings.append(Finding("convention", "grave", bars.text))
        view = view.changed(bars.change)
    if section.findings:
        section.parts.append("the sections below hold with this put right")
    if not exact:
        section.parts.append(
            "the size of a pixel and the origin are known only about: nothing below is called grave"
        )
    return section, view, exact


def further(section: Section, view: View) -> None:
    """Add the hints that the sides of the cameras have not explained, nor anything before."""
    section.findings += [Finding("convention", "grave", str(hint)) for hint in hints(view.block)]
