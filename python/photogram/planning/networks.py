"""Comparison of predicted networks: their plan, and its document with tables and plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.adjustment.adjustment import Progress
from photogram.adjustment.prediction import predict
from photogram.arguments.types import Floats
from photogram.errors import InputError, PhotogramError, RankError, message_of
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.motion import on_shared
from photogram.planning.pattern import Pattern, UnknownQuality, with_known_readout
from photogram.results.hypotheses import FEWEST
from photogram.show.judgement import remarks_section
from photogram.show.methods import Documented
from photogram.show.page import Document, Drawing, Fact, Judgement, Layers, Section, about, significant
from photogram.show.quantity import Axis, Quantity, Table, component, members, of_each
from photogram.show.sketch.marks import NOWHERE, Mark, Markers, Panel, Shades, around
from photogram.show.sketch.plot import Plot
from photogram.show.style import FAINT, VERMILION
from photogram.statistics.reliability import TESTABLE, noncentrality
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    import pandas as pd

ALIKE = 1.05  # largest ratio of standard deviations of patterns that count as equal
MIN_IMPROVEMENT = 1.1  # ratio of standard deviations from which a known readout time is recommended
MAX_UNCHECKED = 0.01  # share of image coordinates without a check from which more rays are recommended
MIN_REDUNDANCY = 0.2  # redundancy number of control below which more control is recommended
REMEDIES = {
    **dict.fromkeys(("time-offset", "lever-arm", "gnss-drift", "boresight", "camera-point"), "strips"),
    **dict.fromkeys(("camera-f", "camera-term", "readout-time", "readout-time-columns"), "heights"),
}
"""Observations that detect errors of these types; other types need points."""
SHARE = (Axis("", "", small="percent", factor=100.0),)
IMAGE = (Axis("", "mm", small="um", factor=1000.0),)
SMALL_UNITS = {"s": ("ms", 1e3), "rad/s": ("mrad/s", 1e3), "rad": ("arcsec", 1 / ARCSEC)}
PANEL = 6.0  # Longer side of a panel, inches
MAX_SIDE_BY_SIDE = 2.5  # Width over height of a block; panels of wider blocks are stacked


@dataclass(frozen=True)
class Plan(Documented):
    """Predicted patterns of a network for comparison.

    Attributes
    ----------
    patterns
        One or more, in the given order.
    """

    patterns: tuple[Pattern, ...]

    def table(self) -> pd.DataFrame:
        """Return the quality of new points, one row per pattern and group of points.

        Columns are the attributes of :class:`photogram.planning.PointQuality`, with one standard deviation
        per axis (`rms_sd_X`, `max_sd_X`, ...). Groups without points in any pattern are omitted.
        """
        import pandas as pd  # pandas takes long to import

        frames = {pattern.name: points_table(pattern).frame() for pattern in self.patterns}
        table = pd.concat(frames, names=["pattern"]).reset_index(level="pattern")
        present = table.groupby("group")["points"].transform("max") > 0
        return table[present].reset_index(drop=True)

    def document(self) -> Document:
        """Return the document of the plan."""
        patterns, title = self.patterns, "Expected standard deviation in height"
        new = [pattern.new_points.any() for pattern in patterns]
        drawing = Drawing("picture-plan", title, about("plan.caption"), self.plot)
        layers = partial(_layers, patterns)
        headline = _judgement(patterns) if all(new) else phrase("plan.compared.none")
        unit, facts = patterns[0].block.linear_unit, []
        for pattern in (each for each, own in zip(patterns, new, strict=True) if own):
            x, y, z = pattern.points[-1].rms_sd
            plane = f"{pattern.axes[0]} {significant(x, 2)}, {pattern.axes[1]} {significant(y, 2)} {unit}"
            name = f"rms in {pattern.axes[2]}, {pattern.name}"
            facts.append(Fact.of(name, z, unit, plane, figures=2))
        note = "standard deviation, mean of all"
        facts.append(Fact.of("An image error on the ground", patterns[0].unit, unit, note, figures=2))
        # Each message once, with the names of its patterns unless it concerns all
        messages: dict[str, list[str]] = {}
        for pattern in patterns:
            for message in pattern.result.messages:
                messages.setdefault(str(message), []).append(pattern.name)
        remarks = [
            text if len(concerned) == len(patterns) else f"{'; '.join(concerned)}: {text}"
            for text, concerned in messages.items()
        ]
        return Document(
            what="Prediction of a network before it is flown",
            title=patterns[0].block.title,
            judgements=[Judgement("Prediction", str(headline))],
            advice=advice(patterns),
            highlights=facts,
            sections=[
                Section("network", "Plan of the network", [drawing] if any(new) else []),
                Section("comparison", "Side by side", [_comparison(patterns)] if all(new) else []),
                Section("size", "Size", [_size(patterns)]),
                layers("points", "New points", points_table, about("plan.points")),
                layers("photos", "Photos", _photos),
                layers("motion", "Motion", _motion),
                layers("control", "Control", _control, about("plan.control")),
                layers("undetected", "Undetected errors", _undetected, about("plan.undetected")),
                remarks_section(remarks),
            ],
            details=[layers("multiples", "New points, in standard deviations of an image", _multiples)],
            members=_members(patterns),
        )

    def plot(self) -> Plot:
        """Plot patterns in plan, with expected height deviations as colours.

        Raises
        ------
        PhotogramError
            If the plan lacks new points.
        """
        patterns = self.patterns
        heights = np.concatenate([pattern.point_sd[pattern.new_points, 2] for pattern in patterns])
        if heights.size == 0:
            raise PhotogramError(phrase("plan.new-points"))
        places = [pattern.point_plan[pattern.result.used_points] for pattern in patterns]
        limits = around(np.vstack([*places, *(pattern.photo_plan for pattern in patterns)]), 0.05)
        label = f"expected standard deviation in height, {patterns[0].block.linear_unit}"
        shades = Shades(float(heights.min()), float(heights.max()), label)
        panels = [_panel(pattern, limits, shades) for pattern in patterns]
        # The legend beside the last panel names the control of all panels.
        every = [mark for panel in panels for mark in panel.labelled if isinstance(mark, Markers)]
        known = {mark.label for mark in panels[-1].labelled}
        labelled = {mark.label: replace(mark, places=NOWHERE) for mark in every if mark.label not in known}
        marks = [*panels[-1].marks, *labelled.values()]
        panels[-1] = replace(panels[-1], marks=marks, legend="beside", shades=shades)
        width, height = np.ptp(limits, axis=0).tolist()
        wide = width > MAX_SIDE_BY_SIDE * height
        columns, longer = (1, 2 * PANEL) if wide else (len(panels), PANEL)
        across, up = longer * np.array([width, height]) / max(width, height) + [0.5, 1.0]
        return Plot(columns * max(across, 4.0) + 3.0, len(panels) // columns * up + 0.4, panels, columns)


def plan(
    patterns: Mapping[str, Block],
    *,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Plan:
    """Predict several networks for comparison.

    Parameters
    ----------
    patterns
        Planned blocks by name, as for :func:`photogram.predict`, for example the same photos with different
        control, or different overlaps.
    threads, progress
        As in :func:`photogram.adjust`.

    Raises
    ------
    InputError
        If there is no block, units or axes of blocks differ, or :func:`photogram.predict` raises it.
    RankError
        If a pattern does not determine all unknowns; the message begins with the name of the pattern.
    """
    spaces = {(block.linear_unit, block.geographic): name for name, block in patterns.items()}
    if len(spaces) != 1:
        raise InputError(phrase("plan.spaces", n=len(spaces), blocks=list(spaces.values())))
    made = []
    for name, block in patterns.items():
        tied = np.isfinite(block.point_sd).any() or np.isfinite(block.photo_position_sd).any()
        other = with_known_readout(block)
        try:
            # For trajectories, their given values.
            if not (tied or on_shared(block).any()):
                raise RankError(phrase("plan.datum"), list(block.photo_ids), [])
            result = predict(block, threads=threads, progress=progress)
            known = None if other is None else predict(other, threads=threads, progress=progress)
            made.append(Pattern(name, result, known))
        except RankError as error:
            raise RankError(
                phrase("error.at", what=name, message=message_of(error)), error.photos, error.points
            ) from None
    return Plan(tuple(made))


def _members(patterns: Sequence[Pattern]) -> dict[str, object]:
    linear = patterns[0].block.linear_unit
    units = {
        "scale": f"{linear} on the ground for 1 mm in the photo",
        "unit": f"{linear}: the standard deviation of image coordinates on the ground",
        "points": f"standard deviations {linear}, detectable mm, effect standard deviations",
        "photos": "as each says",
        "motion": "as each says",
        "control": f"sd and detectable {linear}, effect standard deviations",
        "undetected": f"change {linear} or rad, bias_to_noise and ratio standard deviations",
    }
    return {
        "units": units,
        "noncentrality": noncentrality(),
        "unchecked_below": TESTABLE,
        "next": [str(sentence) for sentence in advice(patterns)],
        "patterns": [
            {
                **members(pattern, "name", "axes", "scale", "unit", title="block.title"),
                "messages": [*map(str, pattern.result.messages)],
                "photo_count": len(pattern.block.photo_ids),
                "image_count": int(pattern.result.used_images.sum()),
                "points": [vars(group) for group in pattern.points if group.points],
                "photos": [*map(vars, pattern.photos)],
                "control": _control(pattern).record(),
                "undetected": _undetected(pattern).record(),
                **({"motion": [*map(vars, pattern.motion)]} if pattern.motion else {}),
                **({"rms_sd_known_readout": known} if (known := pattern.known_rms_sd) else {}),
            }
            for pattern in patterns
        ],
    }


def points_table(pattern: Pattern) -> Table:
    """Return the quality of new points, one row per group; reports omit empty groups."""
    axes = tuple(Axis.of(axis, pattern.block.linear_unit) for axis in pattern.axes)
    groups = partial(of_each, pattern.points)
    columns = [
        groups("grouping", (), "name", name="grouping"),
        groups("group", (), "name", name="group", head="Group"),
        groups("points", name="points", head="Points"),
        groups("rms_sd", axes, "deviation", name="rms_sd", head="rms {}"),
        groups("max_sd", axes, "deviation", name="max_sd", head="max {}"),
        groups("redundancy", name="redundancy", head="Mean redundancy", decimals=3),
        groups("unchecked", SHARE, "deviation", name="unchecked", head="Unchecked", decimals=0),
        groups("detectable", IMAGE, "deviation", name="detectable", head="Detectable", decimals=1),
        groups("effect", name="effect", head="Effect in sd", decimals=1),
    ]
    return Table("", pattern.name, columns, shown=np.flatnonzero([group.points for group in pattern.points]))


def _multiples(pattern: Pattern) -> Table:
    table, axes = points_table(pattern), tuple(map(Axis, pattern.axes))
    _, group, _, *deviations = table.columns[:5]
    columns = [
        replace(quantity, values=quantity.values / pattern.unit, axes=axes, kind="number", decimals=2)
        for quantity in deviations
    ]
    return replace(table, columns=[group, *columns])


def _photos(pattern: Pattern) -> Table:
    redundancy = of_each(pattern.photos, "redundancy", head="Mean redundancy of weighted values", decimals=3)
    return _unknowns(pattern, pattern.photos, redundancy)


def _motion(pattern: Pattern) -> Table:
    linear, known = pattern.block.linear_unit, pattern.known_rms_sd or ()
    names = [f"{axis} of new points if the readout time is known" for axis in pattern.axes]
    points = [UnknownQuality(name, linear, sd, np.nan) for name, sd in zip(names, known, strict=False)]
    better = [*(None for _ in pattern.motion), *_improvements(pattern)]
    unknowns = [*pattern.motion, *points]
    return _unknowns(pattern, unknowns, Quantity(better, head="Times better", decimals=2))


def _unknowns(pattern: Pattern, unknowns: Sequence[UnknownQuality], more: Quantity) -> Table:
    units = [SMALL_UNITS.get(each.unit, (each.unit, 1.0)) for each in unknowns]
    axes = tuple(
        Axis(each.unknown, small=unit, factor=factor)
        for each, (unit, factor) in zip(unknowns, units, strict=True)
    )
    deviations, of = partial(of_each, unknowns, axes=axes, kind="deviation"), np.arange(len(axes))
    columns = [
        replace(component(axes, of)[0], head="Unknown"),
        deviations("rms_sd", head="rms sd", of=of),
        deviations("max_sd", head="Largest sd", of=of),
        more,
    ]
    return Table("", pattern.name, columns)


def _control(pattern: Pattern) -> Table:
    length = (Axis.of("", pattern.block.linear_unit),)
    components = partial(of_each, pattern.control)
    columns = [
        components("component", (), "name", head="Component"),
        components("held", head="Weighted or fixed"),
        components("sd", length, "deviation", head="sd a priori"),
        components("redundancy", head="Mean redundancy", decimals=3),
        components("detectable", length, "deviation", head="Detectable"),
        components("effect", head="Effect in sd", decimals=1),
    ]
    shown = np.flatnonzero([quality.held for quality in pattern.control])
    return Table("", pattern.name, columns, shown=shown)


def _undetected(pattern: Pattern) -> Table:
    found = pattern.hypotheses
    if found is None:
        return Table("", pattern.name, [Quantity([], kind="name", head="Error")])
    table, members_only = found.external_reliability(found.effective), ("redundancy", "bias_to_noise")
    columns = [replace(each, head="") if each.name in members_only else each for each in table.columns]
    return replace(table, key="", title=pattern.name, columns=columns)


def _layers(
    patterns: Sequence[Pattern], key: str, title: str, table: Callable[[Pattern], Table], intro: str = ""
) -> Section:
    return Section(key, title, [Layers(f"{key}-layers", [*map(table, patterns)])], intro)


def _judgement(patterns: Sequence[Pattern]) -> Phrase:
    heights = {pattern.name: pattern.points[-1].rms_sd[2] for pattern in patterns}
    best, worst = min(heights, key=heights.__getitem__), max(heights, key=heights.__getitem__)
    figures = {"rms": significant(heights[best], 3), "unit": patterns[0].block.linear_unit}
    if heights[worst] <= ALIKE * heights[best]:
        return phrase(f"plan.compared.{'alike' if len(patterns) > 1 else 'single'}", **figures)
    figures |= {"best": best, "worst": worst, "other": significant(heights[worst], 3)}
    return phrase("plan.compared.better", ratio=heights[worst] / heights[best], **figures)


def _comparison(patterns: Sequence[Pattern]) -> Table:
    unit, names = patterns[0].block.linear_unit, [pattern.name for pattern in patterns]
    groups = [pattern.points[-1] for pattern in patterns]
    sd = np.array([np.ravel([group.rms_sd, group.max_sd], order="F") for group in groups])
    least, most = sd.min(axis=0), sd.max(axis=0)
    best = np.where(most > 1.005 * least, np.array(names)[sd.argmin(axis=0)], "no difference").tolist()
    ratios = np.divide(most, least, where=least > 0, out=np.full(len(least), np.nan))
    rows = [f"{kind} {axis}" for axis in patterns[0].axes for kind in ("rms", "largest")]
    columns = [
        Quantity(rows, kind="name", head="Standard deviation"),
        *(Quantity(own, head=f"{name} {unit}") for name, own in zip(names, sd, strict=True)),
        Quantity(best, kind="name", head="Best"),
        Quantity(ratios, head="Largest over smallest", decimals=2),
    ]
    return Table("", "All new points", columns)


def _size(patterns: Sequence[Pattern]) -> Table:
    linear = patterns[0].block.linear_unit
    rows = {
        "Photos": [len(each.block.photo_ids) for each in patterns],
        "New points": [each.new_points.sum() for each in patterns],
        "Control points": [(each.result.used_points & ~each.new_points).sum() for each in patterns],
        "Points left out": [len(each.result.dropped) for each in patterns],
        "Image points": [each.result.used_images.sum() for each in patterns],
        f"1 mm in the photo on the ground, {linear}": [significant(each.scale) for each in patterns],
        f"sd of image coordinates on the ground, {linear}": [significant(each.unit, 3) for each in patterns],
    }
    values = np.array([*rows.values()], dtype=str).T
    columns = [Quantity(own, head=each.name) for each, own in zip(patterns, values, strict=True)]
    return Table("", "Size", [Quantity([*rows], kind="name", head=" "), *columns])


def advice(patterns: Sequence[Pattern]) -> list[Phrase]:
    """Return the next steps that would make the network check itself."""
    phrases = []
    for pattern in patterns:
        of_pattern = partial(phrase, pattern=pattern.name)
        if (unchecked := pattern.points[-1].unchecked) > MAX_UNCHECKED:  # NaN without new points
            phrases.append(of_pattern("plan.unchecked", percent=100 * unchecked))
        weak = [each.component for each in pattern.control if each.held and each.redundancy < MIN_REDUNDANCY]
        if weak:
            phrases.append(of_pattern("plan.control", components=weak))
        if found := pattern.hypotheses:
            worst: dict[str, int] = {}
            for row in found.harmful:
                worst.setdefault(REMEDIES.get(str(found.code[row]), "points"), row)
            phrases += [
                of_pattern(f"plan.undetected.{remedy}", error=found.sentence(row))
                for remedy, row in worst.items()
            ]
            if assumed := found.assumed(FEWEST):
                phrases.append(of_pattern("plan.assumed", errors=assumed))
        if (ratio := max(_improvements(pattern), default=1.0)) > MIN_IMPROVEMENT:
            sd = next(quality.rms_sd for quality in pattern.motion if quality.unit == "s")
            phrases.append(of_pattern("plan.readout", sd=1e3 * sd, ratio=ratio))
    return phrases


def _improvements(pattern: Pattern) -> list[float]:
    known = pattern.known_rms_sd or ()
    return [sd / better for sd, better in zip(pattern.points[-1].rms_sd, known, strict=False)]


def _panel(pattern: Pattern, limits: Floats, shades: Shades) -> Panel:
    new, unit, plan = pattern.new_points, pattern.block.linear_unit, pattern.point_plan
    sd = pattern.point_sd[new, 2]
    size = float(np.sqrt(np.clip(2e4 / max(1, len(sd)), 2, 30)))
    marks: list[Mark] = [
        # The worst points are drawn on top, because a planner looks for them.
        Markers(plan[new], "o", size, values=sd, shades=shades, rising=True, layer=1.0),
        Markers(pattern.photo_plan, "+", 4.0, FAINT, label="photo"),
    ]
    held = np.isfinite(pattern.block.point_sd) & pattern.result.used_points[:, np.newaxis]
    plane, height = held[:, :2].any(axis=1), held[:, 2]
    for name, shape, rows in (
        ("full control", "^", plane & height),
        ("height control", "o", height & ~plane),
        ("plane control", "s", plane & ~height),
    ):
        if rows.any():
            marks.append(Markers(plan[rows], shape, 7.7, VERMILION, "white", 1.6, label=name))
    quality = pattern.points[-1]
    figures = f"rms {quality.rms_sd[2]:#.3g} {unit}, largest {quality.max_sd[2]:#.3g} {unit}"
    across, up = (f"{axis}, {unit}" for axis in pattern.axes[:2])
    return Panel(limits, marks, f"{pattern.name}\n{figures}", across, up, equal=True)
