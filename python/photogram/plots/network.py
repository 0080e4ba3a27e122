"""The network in plan: photos, footprints, points, control, error ellipses, undetected errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.plots.picture_data import Plan
from photogram.plots.selection import thinned
from photogram.show.sketch import marks as shapes
from photogram.show.sketch.marks import Mark, Markers, Panel, ScaleBar, Shades
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, INK, PURPLE, SKY, SOFT, VERMILION, round_length
from photogram.words import phrase

MAX_POINTS, MAX_PHOTOS, MAX_FOOTPRINTS, MAX_ELLIPSES, MAX_VECTORS = 6000, 2000, 400, 150, 300
MAX_NAMES = 40  # Of photos, and of control and check points
CENTRAL = 0.995  # Part of the points that sets the limits if others are far away
LARGE_FOOTPRINT = 1.8  # Extent in networks beyond which footprints do not set the limits
MIN_AREA = 0.5  # Area of a plane over the largest area below which the plane hides too much
CONFIDENCE = 0.95
MIN_RAYS_OF_CLASSES = (1, 2, 3, 4, 5, 7, 10, 20)
# Axes to the right, upwards, and out of the plot
PLANES = {"XY": (0, 1, 2), "XZ": (0, 2, 1), "YZ": (1, 2, 0)}


def network(result: Any, *, plane: str | None = None) -> Plot:
    """Plot photos, footprints, points by rays, control, checks and error ellipses.

    The plot shows a part of a large network, and its notes state which part.

    Parameters
    ----------
    plane
        `XY`, `XZ` or `YZ`; if None, the plane in which the points spread most.

    Raises
    ------
    InputError
        If `plane` is another text.
    """
    drawn = result._plot_data()
    view = View(drawn.plan, _plane(drawn.plan, plane))
    footprints, notes = drawn.footprints if view.axes[2] == 2 else np.empty((0, 1, 3)), list[str]()
    view.include(footprints)
    marks = [*_footprints(view, footprints, notes), *_points(view, notes)]
    photos, note = thinned("photos", np.arange(len(view.photos)), MAX_PHOTOS)
    notes.append(note)
    size = float(np.clip(60.0 / np.sqrt(len(photos)), 2.0, 7.0))
    colour, label = INK if len(photos) <= 300 else FAINT, f"photo ({len(view.photos):,})"
    marks.append(Markers(view.photos[photos], "+", size, colour, edge=0.7, label=label, layer=3.0))
    control, arrows, ends = _control(view, notes)
    ellipses, bars = _ellipses(drawn, view, notes)
    beyond = np.count_nonzero(view.known & ~view.inside)
    notes.append(f"{beyond} points lie beyond the picture" if beyond else "")
    marks += [*ellipses, *control]
    plan, known = view.plan, np.flatnonzero((view.plan.kinds != "pass") & view.known)
    known = known if len(known) <= MAX_NAMES else known[:0]
    count = len(plan.photo_ids) if len(plan.photo_ids) <= MAX_NAMES else 0
    if texts := [*(plan.point_ids[row] for row in known.tolist()), *plan.photo_ids[:count]]:
        places = np.concatenate([view.points[known], view.photos[:count]])
        marks.append(shapes.Names(places, texts, [INK] * len(known) + [SOFT] * count, ends))
    return view.plot(marks, title=drawn.title or "Network", notes=notes, bars=[*bars, *arrows])


class View:
    """A network in a plane: `axes` to the right, upwards, and out of the plot."""

    def __init__(self, plan: Plan, axes: tuple[int, int, int] | None = None) -> None:
        self.plan, self.axes = plan, axes or _plane(plan, None)
        self.points, self.photos = self.flat(plan.points), self.flat(plan.photos)
        self.known = np.isfinite(plan.points).all(axis=1)
        self.unit = f" {plan.unit}" if plan.unit else ""
        points = self.points[self.known]
        parts = [_central(self.photos), points[plan.kinds[self.known] != "pass"]]
        every = np.concatenate([*parts, _central(points)])
        self.low, self.high = every.min(axis=0), every.max(axis=0)

    def include(self, outlines: Floats) -> None:
        """Extend the limits to outlines, unless these are far larger than the network."""
        shown = self.flat(outlines).reshape(-1, 2)
        shown = shown[np.isfinite(shown).all(axis=1)]
        largest = LARGE_FOOTPRINT * (self.high - self.low).max()
        if len(shown) and (np.ptp(shown, axis=0) < largest).all():
            self.low, self.high = (
                np.minimum(self.low, shown.min(axis=0)),
                np.maximum(self.high, shown.max(axis=0)),
            )

    def flat(self, places: Floats) -> Floats:
        """Return (..., 3) positions or vectors in the plane."""
        return places[..., list(self.axes[:2])]

    @property
    def limits(self) -> Floats:
        """(2, 2) limits of stations, control and nearly all points."""
        margin = 0.05 * max(float((self.high - self.low).max()), 1e-9)
        return np.array([self.low - margin, self.high + margin])

    @property
    def extent(self) -> float:
        return float(np.ptp(self.limits, axis=0).max())

    @property
    def inside(self) -> Bools:
        """(n,) points within the limits."""
        low, high = self.limits
        return np.asarray(((self.points >= low) & (self.points <= high)).all(axis=1))

    def bar(self, scale: float, colour: str, meaning: str) -> ScaleBar:
        length = round_length(0.12 * self.extent / scale)
        return scale * length, colour, f"{length:g}{self.unit}: {meaning} (× {scale:,g})"

    def panel(self, marks: Sequence[Mark], **more: Any) -> Panel:
        unit = f", {self.plan.unit}" if self.plan.unit else ""
        across, up = (f"{self.plan.axes[axis]}{unit}" for axis in self.axes[:2])
        return Panel(self.limits, marks, across=across, up=up, equal=True, **more)

    def plot(self, marks: Sequence[Mark], **more: Any) -> Plot:
        """Return a plot with a legend beside the network."""
        across, up = 6.5 * np.minimum(1.0, (self.limits[1] - self.limits[0]) / self.extent)
        panel = self.panel(marks, legend="beside", **more)
        return Plot(max(float(across), 2.5) + 3.3, max(float(up), 1.6) + 1.6, [panel])


def _central(places: Floats) -> Floats:
    """Return the limits of nearly all of many positions, or few positions unchanged."""
    return np.quantile(places, [1 - CENTRAL, CENTRAL], axis=0) if len(places) > 500 else places


def _plane(plan: Plan, plane: str | None) -> tuple[int, int, int]:
    """Return the axes to the right, upwards, and out of the plot."""
    if plane is not None:
        one_of("plane", plane, tuple(PLANES))
        return PLANES[plane]
    known = plan.points[np.isfinite(plan.points).all(axis=1)]
    if len(known) < 2:
        return PLANES["XY"]
    of_points, of_all = _areas(known), _areas(np.concatenate([known, plan.photos]))
    there = {name: of_all[name] for name in PLANES if of_points[name] >= MIN_AREA * max(of_points.values())}
    # In plan, unless this hides most.
    above = there.get("XY", 0.0) >= MIN_AREA * max(there.values())
    return PLANES["XY" if above else max(there, key=lambda name: there[name])]


def _areas(places: Floats) -> dict[str, float]:
    """Return the area of nearly all of (k, 3) points in each plane."""
    extent = np.ptp(np.quantile(places, [1 - CENTRAL, CENTRAL], axis=0), axis=0)
    return {name: float(extent[a] * extent[b]) for name, (a, b, _) in PLANES.items()}


def _footprints(view: View, outlines: Floats, notes: list[str]) -> list[Mark]:
    good = np.flatnonzero(np.isfinite(outlines).all(axis=(1, 2)))
    if not len(good):
        return []
    chosen, note = thinned("footprints", good, MAX_FOOTPRINTS)
    notes.append(note)
    inside = float(np.clip(0.4 / len(chosen), 0.003, 0.06))
    edge = float(np.clip(25.0 / len(chosen), 0.5, 0.7))
    shown = view.flat(outlines[chosen])
    return [shapes.Polygons(shown, SKY, inside, "#738c9e", edge, 0.6, label="footprint of a photo")]


def _points(view: View, notes: list[str]) -> list[Mark]:
    plan = view.plan
    rows = np.flatnonzero((plan.kinds == "pass") & view.known)
    if not len(rows):
        return []
    every = np.searchsorted(MIN_RAYS_OF_CLASSES, plan.rays, side="right") - 1
    classes = every[rows]
    there = np.unique(classes).tolist()
    chosen, note = thinned("points", rows, MAX_POINTS)
    notes.append(note)
    size = float(np.sqrt(np.clip(9000.0 / len(chosen), 2.0, 14.0)))
    shares = np.linspace(0.82 if len(there) > 1 else 0.0, 0.0, len(there))
    colours = shapes.rgb(shapes.Shades(0.0, 1.0, ""), shares)
    marks = list[Mark]()
    for colour, number in zip(colours, there, strict=True):
        own = view.points[chosen[every[chosen] == number]]
        low, *more = MIN_RAYS_OF_CLASSES[number : number + 2]
        high, name = min(more[0] - 1, int(plan.rays[rows].max())) if more else 0, f"{low} rays and more"
        if more:
            name = f"{low} ray{'s' * (low > 1)}" if high <= low else f"{low} to {high} rays"
        label = f"{name} ({int((classes == number).sum()):,})"
        marks.append(Markers(own, "o", size, shapes.hexadecimal(colour), label=label))
    return marks


def _ellipses(drawn: Any, view: View, notes: list[str]) -> tuple[list[Mark], list[ScaleBar]]:
    """Return error ellipses of points, or medians by cell, and their scale bar."""
    rows, pair, extent = np.flatnonzero(view.inside), list(view.axes[:2]), view.extent
    covariances = drawn.covariances(rows)[:, pair][:, :, pair]
    good = np.isfinite(covariances).all(axis=(1, 2))
    rows, covariances = rows[good], covariances[good]
    axes_of, angles = shapes.ellipse_axes(covariances)
    axes_of *= np.sqrt(-2.0 * np.log(1.0 - CONFIDENCE))
    if not len(rows) or not axes_of[:, 0].any():
        return [], []
    chosen = np.arange(len(rows))
    if len(rows) > MAX_ELLIPSES:
        chosen = _of_cells(view.points[rows], axes_of[:, 0], extent / 12.0)
        notes.append(
            f"error ellipses: of {len(rows):,} points, the median one of each of {len(chosen)} cells"
        )
    sizes = axes_of[chosen, 0]
    if not (sizes > 0).any():
        return [], []
    # The semi-axis of a typical ellipse is a fifth of the distance to its neighbour.
    spacing = extent / np.sqrt(max(len(chosen), 9))
    scale = round_length(0.22 * spacing / float(np.median(sizes[sizes > 0])))
    shown = chosen[scale * sizes < 0.2 * extent]
    if len(shown) < len(chosen):
        notes.append(f"{len(chosen) - len(shown)} ellipses are too large to be drawn at this scale")
    places, worst = view.points[rows[shown]], int(np.argmax(axes_of[:, 0]))
    largest = f"{axes_of[worst, 0]:.3g}{view.unit}, point {view.plan.point_ids[rows[worst]]}"
    notes.append(f"largest semi-axis of an ellipse: {largest}")
    marks: list[Mark] = [shapes.Ellipses(places, scale * axes_of[shown], angles[shown], BLUE, 0.8, layer=4.0)]
    return marks, [view.bar(scale, BLUE, f"semi-axes of error ellipses, {CONFIDENCE:.0%}")]


def _of_cells(places: Floats, sizes: Floats, side: float) -> Indices:
    """Return the point with the median size in each square cell."""
    cells = np.floor((places - places.min(axis=0)) / side).astype(np.int64)
    key = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    order = np.lexsort((sizes, key))
    _, starts, counts = np.unique(key[order], return_index=True, return_counts=True)
    return np.asarray(order[starts + counts // 2])


def _control(view: View, notes: list[str]) -> tuple[list[Mark], list[ScaleBar], Floats]:
    """Return control and check points, their differences, scale bars, and positions on the arrows."""
    plan, marks, drawn = view.plan, list[Mark](), list[Indices]()
    for kind, marker in (("control", "^"), ("check", "s")):
        rows = np.flatnonzero((plan.kinds == kind) & view.known)
        if not len(rows):
            continue
        chosen, note = thinned(f"{kind} points", rows, MAX_VECTORS)
        notes.append(note)
        size = float(np.clip(60.0 / np.sqrt(len(chosen)), 3.0, 7.0))
        label = f"{kind} point ({len(rows):,})"
        marks.append(
            Markers(view.points[chosen], marker, size, face="white", edge=0.9, label=label, layer=5.0)
        )
        drawn.append(chosen)
    # One scale for both types: the scale of the larger differences.
    size = max((usual(plan.differences[rows]) for rows in drawn), default=0.0)
    rows = np.concatenate([*drawn, np.empty(0, dtype=np.int64)])
    meaning = "differences of control and check points, adjusted less given"
    arrows, bars, ends = vectors(view, rows, plan.differences[rows], size, "difference", meaning)
    return [*marks, *arrows], bars, ends


def vectors(
    view: View, rows: Indices, differences: Floats, size: float, name: str, meaning: str
) -> tuple[list[Mark], list[ScaleBar], Floats]:
    """Return (k, 3) differences of points, scale bars, and positions on the arrows.

    `size` is a usual length, `name` of one difference; `meaning` is written at the scale bar.
    """
    if not size:
        return [], [], shapes.NOWHERE
    out, marks = differences[:, view.axes[2]], list[Mark]()
    scale = round_length(0.08 * view.extent / size)
    places, moved = view.points[rows], scale * np.nan_to_num(view.flat(differences))
    if (long := np.hypot(*moved.T) > 0).any():
        label = f"{name} in plan"
        marks.append(shapes.Arrows(places[long], moved[long], VERMILION, 0.0035, label=label, layer=6.0))
    if (high := np.isfinite(out) & (out != 0)).any():
        label, feet = f"{name} in height, + upwards", places[high]
        bars = shapes.error_bars(feet, feet[:, 1], feet[:, 1] + scale * out[high])
        marks.append(shapes.Line(bars, PURPLE, 2.2, label=label, layer=5.5))
    between = np.concatenate([places + moved, places + 0.5 * moved])
    return marks, [view.bar(scale, VERMILION, meaning)], between


def usual(differences: Floats) -> float:
    """Return a size above nine tenths of (k, 3) differences; 0 without any."""
    sizes = np.sqrt(np.nansum(differences**2, axis=1))
    return float(np.quantile(sizes[sizes > 0], 0.9)) if (sizes > 0).any() else 0.0


MAX_STATIONS = 300
CENTRAL_CHANGES = 0.9  # Part of the larger changes that defines the colours
LONGEST = 4.0  # Usual changes; larger ones are without arrows


def undetected(result: Any, *, error: int | None = None) -> Plot:
    """Plot what an undetected error would change: points in plan, and their changes.

    Points are coloured if a coordinate changes by more standard deviations than the verdict permits. Arrows
    are changes by an error of the size of the minimal detectable bias, or of a plausible size if an error of
    any size remains undetected. The points or photos of an erroneous observation are marked.

    Parameters
    ----------
    error
        Row of :meth:`~photogram.Result.external_reliability`; None: the error with the worst effect.

    Raises
    ------
    InputError
        If the effect of the error was not computed, because it is small, or the network is not tested.
    """
    drawn = result._plot_data()
    moved = drawn.moved(error)
    if moved is None:
        raise InputError(phrase("plot.undetected"))
    view = View(drawn.plan)
    photos, _ = thinned("photos", np.arange(len(view.photos)), MAX_STATIONS)
    far, places, shades = moved.ratios > moved.limit, view.points[moved.points], None
    label = f"change below {moved.limit:g} sd ({np.count_nonzero(~far):,})"
    marks: list[Mark] = [Markers(places[~far], "o", 2.5, FAINT, label=label, layer=6.2)]
    if far.any():
        # The point with the error often changes by far more than all others.
        ratios = moved.ratios[far]
        high = max(float(np.quantile(ratios, CENTRAL_CHANGES)), 2.0 * moved.limit)
        shades = Shades(moved.limit, high, "change, standard deviations", log=True)
        marks.append(Markers(places[far], "o", 5.5, values=ratios, shades=shades, rising=True, layer=6.5))
    marks.append(Markers(view.photos[photos], "+", 4.0, FAINT, edge=0.6, label="photo"))
    size = usual(moved.changes)
    short = np.linalg.norm(moved.changes, axis=1) <= LONGEST * size
    rows, changes = moved.points[short], moved.changes[short]
    arrows, bars, _ = vectors(view, rows, changes, size, "change", "changes of points by the error")
    marks += arrows
    control = view.points[drawn.plan.kinds == "control"]
    if len(control):
        marks.append(Markers(control, "^", 5.0, INK, "white", 0.8, label="control point", layer=5.0))
    if len(moved.suspects):
        at, label = view.flat(moved.suspects), "observation with the error"
        marks.append(Markers(at, "s", 11.0, PURPLE, "none", 1.6, label=label, layer=7.0))
    count, every = len(moved.points), moved.several
    notes = [
        moved.sentence,
        f"{count:,} of {every:,} points are drawn" if count < every else "",
        "" if short.all() else f"{np.count_nonzero(~short):,} larger changes are drawn without arrows",
    ]
    return view.plot(marks, title="Effect of an undetected error", notes=notes, bars=bars, shades=shades)
