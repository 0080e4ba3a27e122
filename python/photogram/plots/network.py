"""The network in plan: photos, footprints, points, control, error ellipses."""

from __future__ import annotations

from typing import Any

import numpy as np

from photogram.arguments.arrays import one_of, sampled
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import replace
from photogram.plots.picture_data import Pictured, Plan
from photogram.show.sketch.letters import NOWHERE
from photogram.show.sketch.marks import (
    Arrows,
    Ellipses,
    Line,
    Mark,
    Markers,
    Names,
    Panel,
    Polygons,
    ScaleBar,
    Shades,
    ellipse_axes,
    hexadecimal,
    rgb,
)
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, INK, PURPLE, SKY, SOFT, VERMILION, round_length

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
    plan = drawn.plan
    seen = _plane(plan, plane)
    limits = _limits(plan, seen, drawn.footprints if seen[2] == 2 else None)
    marks, said = list[Mark](), list[str]()
    for part in (_footprints(drawn, seen), _points(plan, seen), _photos(plan, seen)):
        marks += part[0]
        said.append(part[1])
    arrows, ends = _vectors(plan, seen, limits, marks, said)
    bars = [*_ellipses(drawn, seen, limits, marks, said), *arrows]
    known = plan.points[np.isfinite(plan.points).all(axis=1)][:, list(seen[:2])]
    beyond = int((~((known >= limits[0]) & (known <= limits[1])).all(axis=1)).sum())
    said.append(f"{beyond} points lie beyond the picture" if beyond else "")
    panel = replace(
        _frame(plan, seen, limits),
        marks=[*marks, *_names(plan, seen, ends)],
        title=drawn.title or "Network",
        notes=said,
        bars=bars,
        legend="beside",
    )
    return Plot(*size_of(limits), [panel])


def view_of_plan(plan: Plan) -> tuple[Panel, tuple[int, int, int]]:
    """Return a panel of the plane with the largest extent of the points, and its axes."""
    seen = _plane(plan, None)
    return _frame(plan, seen, _limits(plan, seen)), seen


def _frame(plan: Plan, seen: tuple[int, int, int], limits: Floats) -> Panel:
    unit = f", {plan.unit}" if plan.unit else ""
    across, up = (f"{plan.axes[axis]}{unit}" for axis in seen[:2])
    return Panel(limits, across=across, up=up, equal=True)


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


def _limits(plan: Plan, seen: tuple[int, int, int], outlines: Floats | None = None) -> Floats:
    """Return (2, 2) lower and upper limits of stations, control and nearly all points.

    They include footprints, unless these are far larger than the network.
    """
    axes = list(seen[:2])
    points = plan.points[np.isfinite(plan.points).all(axis=1)][:, axes]
    parts = [plan.photos[:, axes]]
    if len(points):
        parts.append(np.quantile(points, [1 - CENTRAL, CENTRAL], axis=0) if len(points) > 500 else points)
        parts.append(points[(plan.kinds != "pass")[np.isfinite(plan.points).all(axis=1)]])
    stations = parts[0]
    if len(stations) > 500:
        parts[0] = np.quantile(stations, [1 - CENTRAL, CENTRAL], axis=0)
    every = np.concatenate(parts)
    low, high = every.min(axis=0), every.max(axis=0)
    shown = np.empty((0, 2)) if outlines is None else outlines[..., axes].reshape(-1, 2)
    shown = shown[np.isfinite(shown).all(axis=1)]
    if len(shown) and (np.ptp(shown, axis=0) < LARGE_FOOTPRINT * (high - low).max()).all():
        low, high = np.minimum(low, shown.min(axis=0)), np.maximum(high, shown.max(axis=0))
    margin = 0.05 * max(float((high - low).max()), 1e-9)
    return np.array([low - margin, high + margin])


def size_of(limits: Floats) -> tuple[float, float]:
    """Return width and height of a plot of a network with a legend beside it, inches."""
    width, height = limits[1] - limits[0]
    longer = 6.5
    across = longer * min(1.0, width / height)
    up = longer * min(1.0, height / width)
    return max(across, 2.5) + 3.3, max(up, 1.6) + 1.6


def thinned(what: str, rows: Indices, most: int) -> tuple[Indices, str]:
    """Return the rows to draw among many, and a remark."""
    remark = f"{most:,} of {len(rows):,} {what} are drawn, taken at random" if len(rows) > most else ""
    return sampled(rows, most), remark


def _footprints(drawn: Pictured, seen: tuple[int, int, int]) -> tuple[list[Mark], str]:
    outlines = drawn.footprints if seen[2] == 2 else np.empty((0, 1, 3))
    good = np.flatnonzero(np.isfinite(outlines).all(axis=(1, 2)))
    if not len(good):
        return [], ""
    chosen, said = thinned("footprints", good, MAX_FOOTPRINTS)
    shown = outlines[chosen][:, :, list(seen[:2])]
    inside = float(np.clip(0.4 / len(shown), 0.003, 0.06))
    edge = float(np.clip(25.0 / len(shown), 0.5, 0.7))
    return [Polygons(shown, SKY, inside, "#738c9e", edge, 0.6, label="footprint of a photo")], said


def _photos(plan: Plan, seen: tuple[int, int, int]) -> tuple[list[Mark], str]:
    chosen, said = thinned("photos", np.arange(len(plan.photos)), MAX_PHOTOS)
    shown = plan.photos[chosen][:, list(seen[:2])]
    size = float(np.clip(60.0 / np.sqrt(len(shown)), 2.0, 7.0))
    colour, label = INK if len(shown) <= 300 else FAINT, f"photo ({len(plan.photos):,})"
    return [Markers(shown, "+", size, colour, edge=0.7, label=label, layer=3.0)], said


def _points(plan: Plan, seen: tuple[int, int, int]) -> tuple[list[Mark], str]:
    rows = np.flatnonzero((plan.kinds == "pass") & np.isfinite(plan.points).all(axis=1))
    if not len(rows):
        return [], ""
    every = np.searchsorted(MIN_RAYS_OF_CLASSES, plan.rays, side="right") - 1
    classes = every[rows]
    there = np.unique(classes).tolist()
    chosen, said = thinned("points", rows, MAX_POINTS)
    size = float(np.sqrt(np.clip(9000.0 / len(chosen), 2.0, 14.0)))
    colours = rgb(Shades(0.0, 1.0, ""), np.linspace(0.82 if len(there) > 1 else 0.0, 0.0, len(there)))
    marks = list[Mark]()
    for colour, number in zip(colours, there, strict=True):
        own = plan.points[chosen[every[chosen] == number]][:, list(seen[:2])]
        label = f"{_class(number, plan.rays[rows])} ({int((classes == number).sum()):,})"
        marks.append(Markers(own, "o", size, hexadecimal(colour), label=label))
    return marks, said


def _class(number: int, rays: Indices) -> str:
    low = MIN_RAYS_OF_CLASSES[number]
    if number + 1 == len(MIN_RAYS_OF_CLASSES):
        return f"{low} rays and more"
    high = min(MIN_RAYS_OF_CLASSES[number + 1] - 1, int(rays.max()))
    return f"{low} ray{'s' * (low > 1)}" if high <= low else f"{low} to {high} rays"


def _ellipses(
    drawn: Pictured, seen: tuple[int, int, int], limits: Floats, marks: list[Mark], said: list[str]
) -> list[ScaleBar]:
    """Add error ellipses of points, or medians by cell; return their scale."""
    plan, pair = drawn.plan, list(seen[:2])
    inside = ((plan.points[:, pair] >= limits[0]) & (plan.points[:, pair] <= limits[1])).all(axis=1)
    rows = np.flatnonzero(inside)
    covariances = drawn.covariances(rows)[:, pair][:, :, pair]
    good = np.isfinite(covariances).all(axis=(1, 2))
    rows, covariances = rows[good], covariances[good]
    axes_of, angles = ellipse_axes(covariances)
    axes_of *= np.sqrt(-2.0 * np.log(1.0 - CONFIDENCE))
    if not len(rows) or not axes_of[:, 0].any():
        return []
    extent = float((limits[1] - limits[0]).max())
    if len(rows) > MAX_ELLIPSES:
        chosen = _of_cells(plan.points[rows][:, pair], axes_of[:, 0], extent / 12.0)
        said.append(f"error ellipses: of {len(rows):,} points, the median one of each of {len(chosen)} cells")
    else:
        chosen = np.arange(len(rows))
    sizes = axes_of[chosen, 0]
    typical = float(np.median(sizes[sizes > 0])) if (sizes > 0).any() else 0.0
    if typical == 0:
        return []
    # The semi-axis of a typical ellipse is a fifth of the distance to its neighbour.
    spacing = extent / np.sqrt(max(len(chosen), 9))
    scale = round_length(0.22 * spacing / typical)
    shown = chosen[scale * axes_of[chosen, 0] < 0.2 * extent]
    if len(shown) < len(chosen):
        said.append(f"{len(chosen) - len(shown)} ellipses are too large to be drawn at this scale")
    places = plan.points[rows[shown]][:, pair]
    marks.append(Ellipses(places, scale * axes_of[shown], angles[shown], BLUE, 0.8, layer=4.0))
    worst = int(np.argmax(axes_of[:, 0]))
    unit = f" {plan.unit}" if plan.unit else ""
    said.append(
        f"largest semi-axis of an ellipse: {axes_of[worst, 0]:.3g}{unit}, point {plan.point_ids[rows[worst]]}"
    )
    bar = round_length(0.12 * extent / scale)
    return [
        (scale * bar, BLUE, f"{bar:g}{unit}: semi-axes of error ellipses, {CONFIDENCE:.0%} (× {scale:,g})")
    ]


def _of_cells(places: Floats, sizes: Floats, side: float) -> Indices:
    """Return the point with the median size in each square cell."""
    cells = np.floor((places - places.min(axis=0)) / side).astype(np.int64)
    key = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    order = np.lexsort((sizes, key))
    _, starts, counts = np.unique(key[order], return_index=True, return_counts=True)
    return np.asarray(order[starts + counts // 2])


def _vectors(
    plan: Plan, seen: tuple[int, int, int], limits: Floats, marks: list[Mark], said: list[str]
) -> tuple[list[ScaleBar], Floats]:
    """Add control and check points with their coordinate differences.

    Returns scale bars, and (k, 2) positions on the arrows, which names should not cover.
    """
    pair = list(seen[:2])
    there = np.isfinite(plan.points).all(axis=1)
    drawn: list[Indices] = []
    for kind, marker in (("control", "^"), ("check", "s")):
        rows = np.flatnonzero((plan.kinds == kind) & there)
        if not len(rows):
            continue
        chosen, remark = thinned(f"{kind} points", rows, MAX_VECTORS)
        said.append(remark)
        size = float(np.clip(60.0 / np.sqrt(len(chosen)), 3.0, 7.0))
        label, places = f"{kind} point ({len(rows):,})", plan.points[chosen][:, pair]
        marks.append(Markers(places, marker, size, face="white", edge=0.9, label=label, layer=5.0))
        drawn.append(chosen)
    if not drawn:
        return [], NOWHERE
    # One scale for both types: the scale of the larger differences.
    size = max(usual(plan.differences[rows]) for rows in drawn)
    rows = np.concatenate(drawn)
    what = "difference", "differences of control and check points, adjusted less given"
    return vectors(plan, seen, limits, rows, plan.differences[rows], size, what, marks)


def vectors(
    plan: Plan,
    seen: tuple[int, int, int],
    limits: Floats,
    rows: Indices,
    differences: Floats,
    size: float,
    what: tuple[str, str],
    marks: list[Mark],
) -> tuple[list[ScaleBar], Floats]:
    """Add (k, 3) differences of points; return scale bars, and (k, 2) positions on the arrows.

    `size` is a usual length; `what` the name of one difference, and the meaning of the scale bar.
    """
    if not size:
        return [], NOWHERE
    across, out = differences[:, list(seen[:2])], differences[:, seen[2]]
    extent = float((limits[1] - limits[0]).max())
    scale = round_length(0.08 * extent / size)
    places, moved = plan.points[rows][:, list(seen[:2])], scale * np.nan_to_num(across)
    if (long := np.hypot(*moved.T) > 0).any():
        label = f"{what[0]} in plan"
        marks.append(Arrows(places[long], moved[long], VERMILION, 0.0035, label=label, layer=6.0))
    if (high := np.isfinite(out) & (out != 0)).any():
        tops = places[high] + np.column_stack([np.zeros(high.sum()), scale * out[high]])
        label = f"{what[0]} in height, + upwards"
        marks.append(Line(np.stack([places[high], tops], axis=1), PURPLE, 2.2, label=label, layer=5.5))
    unit = f" {plan.unit}" if plan.unit else ""
    bar = round_length(0.12 * extent / scale)
    between = np.concatenate([places + moved, places + 0.5 * moved])
    return [(scale * bar, VERMILION, f"{bar:g}{unit}: {what[1]} (× {scale:,g})")], between


def usual(differences: Floats) -> float:
    """Return a size above nine tenths of (k, 3) differences; 0 without any."""
    sizes = np.sqrt(np.nansum(differences**2, axis=1))
    return float(np.quantile(sizes[sizes > 0], 0.9)) if (sizes > 0).any() else 0.0


def _names(plan: Plan, seen: tuple[int, int, int], ends: Floats) -> list[Mark]:
    held = np.flatnonzero((plan.kinds != "pass") & np.isfinite(plan.points).all(axis=1))
    held = held if len(held) <= MAX_NAMES else held[:0]
    photos = np.arange(len(plan.photos) if len(plan.photos) <= MAX_NAMES else 0)
    places = np.concatenate([plan.points[held], plan.photos[photos]])[:, list(seen[:2])]
    texts = [plan.point_ids[row] for row in held.tolist()] + [plan.photo_ids[row] for row in photos.tolist()]
    colours = [INK] * len(held) + [SOFT] * len(photos)
    return [Names(places, texts, colours, ends)] if texts else []
