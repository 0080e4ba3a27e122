"""The check of a network: mistakes of sets, gross errors, single errors, remarks.

The order is the one of Appendix H of the guide (Elassal and Malhotra, NOAA 1987): first by intersection, then
by adjustment. Units, axes and angles are checked before, because one such mistake looks like a gross error in
every observation.
"""

from __future__ import annotations

import math
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.adjustment.adjustment import core_threads
from photogram.adjustment.first_values import FirstValues, first_values
from photogram.arguments.arrays import argument_error
from photogram.arguments.objects import kind_error
from photogram.diagnosis.after_adjustment import diagnosis_of, explained, remarks
from photogram.diagnosis.blunders import Edited, edit
from photogram.diagnosis.findings import (
    Diagnosis,
    Finding,
    Section,
    Words,
    note_all,
    note_verdict,
    section_of,
)
from photogram.diagnosis.gross import Suspects, gross
from photogram.diagnosis.lenses import half_pixel
from photogram.diagnosis.mistakes import Adjuster, View
from photogram.diagnosis.moving import counted_lines
from photogram.diagnosis.orientation import orientation
from photogram.diagnosis.registry import at, hints_at
from photogram.diagnosis.sections import (
    control,
    disagreeing,
    held_values,
    key_numbers,
    points_left_out,
    residuals,
    structure_section,
)
from photogram.diagnosis.stations import stations, two_ray_heights
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import replace
from photogram.messages import counted
from photogram.network.block import Block, flown_by
from photogram.network.film_reduction import as_seen
from photogram.network.motion import timed_photos
from photogram.network.rays import Rays
from photogram.results.result import Result
from photogram.results.snooping_result import Snooped
from photogram.statistics.findings import Findings

if TYPE_CHECKING:
    from photogram.diagnosis.findings import Words

FINAL_STATIONS = 5.0  # Median residual of adjusted stations (standard deviations)
HARDLY = 10.0  # Multiple of the usual residual that coarse stations can cause before the adjustment
MOST_SETS = 5  # Maximum number of successive corrections of sets


def diagnose(
    network: object, result: Result | Snooped | None = None, *, threads: int | None = None
) -> Diagnosis:
    """Find mistakes and gross errors in the data of a network.

    The check covers units, axes, signs, names, image observations, control points and stations. The data are
    not changed. Mistakes that an earlier step explains (feet for metres, a mirrored photo) are corrected in
    memory for the later steps. Observations that it rejects are excluded from them. So every error is
    reported separately and once.

    Parameters
    ----------
    network
        A block with any observations, a project of GIANT files, or a collection of photos. Photos without
        poses get initial values. A block with photos on trajectories is adjusted and tested by data snooping;
        conventions of moving photos are not tried.
    result
        An adjustment of the block to explain, or a result of data snooping. The block is not adjusted again
        in this case. If the result has not converged or fits badly, the check looks for mistakes in
        conventions, exchanged names and wrong standard deviations. The verdict of the returned `result`
        includes them.
    threads
        Number of threads of the adjustment; the findings do not depend on it. Default: all processors.

    Returns
    -------
    The findings by section, with a report and a JSON document. Grave findings make results wrong or
    impossible.

    Raises
    ------
    InputError
        If `network` is not a network, the block lacks image observations, or `result` is not the result of a
        block.

    Examples
    --------
    >>> from photogram import diagnose, simulate
    >>> block = simulate(strips=2, photos_per_strip=5).block
    >>> diagnose(block).grave
    []
    >>> feet = block.point_positions * [1, 1, 1 / 0.3048]
    >>> [finding.kind for finding in diagnose(block.replace(point_positions=feet)).grave]
    ['control-set']
    """
    core_threads(threads)
    if result is not None:
        adjusted = result.result if isinstance(result, Snooped) else result
        if not isinstance(adjusted, Result):
            raise kind_error("result", "the result of a block", result)
        return diagnosis_of(adjusted)
    if isinstance(network, Block):
        return Diagnosis(network.title, *check_block(as_seen(network), {"threads": threads}))
    if not hasattr(network, "_check"):
        raise kind_error("network", "a block, a project or a collection", network)
    found: Diagnosis = network._check(threads)
    return found


def check_block(
    block: Block, options: dict[str, Any], words: Words | None = None, intersect_only: str = ""
) -> tuple[list[Section], Any]:
    """Check a block with options of `photogram.adjust`; return the sections and the adjustment, if any.

    `intersect_only` is the reason for not adjusting stations; empty if they are adjusted.
    """
    given = Adjuster(options), words or Words(), intersect_only
    if not len(block.image_xy):
        raise argument_error("block", "no-images")
    # Absurd values overflow, and comparisons with them fail. Their effect is reported, not the overflow.
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if flown_by(block):
            return _flown_checked(block, given[1], given[0])
        if np.isfinite(block.photo_positions).all() and np.isfinite(block.photo_attitudes).all():
            return _checked(block, *given)
        started, section = _started(block)
        if started is None:
            return [section], None
        sections, result = _checked(started, *given)
        return [section, *sections], result


def _started(block: Block) -> tuple[Block | None, Section]:
    section = section_of("initial-values")
    try:
        found: FirstValues = first_values(block)
        usable = found.usable()
    except (AdjustmentError, InputError) as error:
        section.note("grave", "check.no-first-values.all", reason=str(error))
        return None, section
    section.remark("check.remark.started", n=len(found.sources), count=len(block.photo_ids))
    for photo, why in found.missing.items():
        section.note("grave", "check.no-first-values.photo", [photo], photo=photo, reason=why)
    aside = found.set_aside
    if aside.any():
        points = sorted({block.point_ids[point] for point in block.image_points[aside]})
        photos = sorted({block.photo_ids[photo] for photo in block.image_photos[aside]})
        fields = {"n": int(aside.sum()), "points": points, "photos": photos}
        section.note("look", "check.set-aside", photos, points, **fields)
    return usable, section


def _checked(
    block: Block, adjusted: Adjuster, words: Words, intersect_only: str
) -> tuple[list[Section], Any]:
    lens: list[Finding] = []
    given = block
    for mistake in at("lens"):
        if (terms := mistake(given, adjusted)) is not None:
            lens.append(terms.finding(mistake.kind))
            given = terms.best[0].change(given)
    view = View.of(given)
    sets, sides, oriented, exact = orientation(view, words)
    sets.findings[:0] = lens
    errors, suspects = gross(oriented.seen, oriented.block.image_unit)
    if not intersect_only:
        start = oriented
        oriented = _sets(sets, oriented, suspects, adjusted)
        if oriented is not start:
            errors, suspects = gross(oriented.seen, oriented.block.image_unit)
    edited = _edited(oriented, suspects, intersect_only, adjusted)
    errors.findings = _judged(errors.findings, edited)
    if edited.first is not None and edited.last is not None:
        named = {point for each in [*errors.findings, *edited.section.findings] for point in each.points}
        edited.section.findings[:0] = held_values(edited.first) + points_left_out(edited.last, named)
    sections = [
        structure_section(block, edited.first, words),
        sets,
        sides(suspects.photos),
        errors,
        edited.section,
    ]
    found = edited.last._findings() if edited.last is not None and edited.last.converged else None
    sections += _after_adjustment(oriented, edited, found, words)
    if edited.last is not None and found is not None:
        sets.findings += half_pixel(edited.last)
        if not any(each.level == "grave" for section in sections for each in section.findings):
            different = disagreeing(found)
            # Control of which one of several points is wrong may be the reason.
            if any(len(each.points) > 1 for own in edited.control.values() for each in own):
                different = [replace(each, level="look") for each in different]
            edited.section.findings += different
    if not exact:
        for section in sections:
            if section is not sets:
                section.findings = [replace(each, level="look") for each in section.findings]
    return sections, edited.last


def _judged(findings: list[Finding], edited: Edited) -> list[Finding]:
    """Return the findings of intersection, as far as the adjustment has not explained or disproved them."""
    if edited.last is None or not edited.is_settled:
        return [*findings, *edited.gross]
    known, fitting = {*edited.control}, {*edited.last.block.photo_ids}
    found = []
    for each in findings:
        if each.kind == "control-difference" and not known & {*each.points}:
            continue
        # Photos that fit after the adjustment had wrong initial values.
        is_small = each.values.get("times_usual", math.inf) < HARDLY
        if each.kind == "bad-photo" and is_small and fitting.issuperset(each.photos):
            each = replace(each, level="look")
        found.append(each)
    return [*found, *edited.gross]


def _sets(section: Section, view: View, suspects: Suspects, adjusted: Adjuster) -> View:
    """Return the view with corrected mistakes in control, or in observed positions of photos, as a whole."""
    for _ in range(MOST_SETS):
        good = suspects.excluded_from(view.block)
        mistakes = ((each, each(good, adjusted)) for each in at("set"))
        mistake, found = next((pair for pair in mistakes if pair[1] is not None), (None, None))
        if mistake is None or found is None:
            break
        section.findings.append(found.finding(mistake.kind, mistake.of))
        if not found.judged.explained:
            break
        view = view.changed(found.best[0].change)
    return view


def _edited(view: View, suspects: Suspects, intersect_only: str, adjusted: Adjuster) -> Edited:
    """Adjust the block, or only intersect it if its stations are good enough."""
    if not intersect_only:
        return edit(view.block, suspects, adjusted)
    met = Rays.of(view.seen).intersect()
    ratio = met.sizes / view.seen.image_sd.mean(axis=1)
    if np.isfinite(ratio).any() and np.nanmedian(ratio) < FINAL_STATIONS:
        return edit(view.block.with_fixed_photos(), suspects, adjusted)
    reason = f"{intersect_only}, and the stations are not adjusted ones"
    return Edited(section_of("blunders"), reason=reason, asked=False)


def _after_adjustment(view: View, edited: Edited, found: Findings | None, words: Words) -> list[Section]:
    result = edited.last
    if result is None or found is None:
        return [stations(view.block, None), key_numbers(edited, words)]
    return [
        control(edited, words),
        stations(view.block, result),
        residuals(result, found.systematic),
        two_ray_heights(result),
        key_numbers(edited, words),
    ]


def _flown_checked(block: Block, words: Words, adjusted: Adjuster) -> tuple[list[Section], Result | None]:
    """Check a block with photos or records on trajectories by its adjustment and data snooping.

    The other checks assume one pose per photo: any tried unit, axis or angle would be blamed for the motion.
    """
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
