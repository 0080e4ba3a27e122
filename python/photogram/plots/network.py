"""The network in plan: photos and what they show, points, control and check points, error ellipses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.plots.panels import NOWHERE, Where, labels, note, panels, scale_bars
from photogram.plots.picture_data import Pictured, Plan, pictured
from photogram.show.pictures import round_length
from photogram.show.style import BLUE, FAINT, INK, ORDERED, PURPLE, SOFT, VERMILION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS, PHOTOS, FOOTPRINTS, ELLIPSES, VECTORS = 6000, 2000, 400, 150, 300
"""How many of each are drawn at most."""
NAMED = 40
"""Photos, and control and check points, that are named at most."""
WITHIN = 0.995
"""Part of the points that sets the limits of the picture, where others are far away."""
LARGER = 1.8
"""Footprints that reach further than so many times the network do not set the limits."""
HIDES = 0.5
"""A plane in which a network covers less than this part of what it covers in another hides too much."""
CONFIDENCE = 0.95
RAYS = (1, 2, 3, 4, 5, 7, 10, 20)
"""Least numbers of rays of the classes of points."""
PLANES = {"XY": (0, 1, 2), "XZ": (0, 2, 1), "YZ": (1, 2, 0)}
"""Axes to the right and up, and the one that is not seen."""


def network(result: object, ax: Where = None, *, plane: str | None = None) -> Axes:
    """Draw photos, footprints, points by number of rays, control and check points, and error ellipses.

    Of a large network parts are drawn; the picture says which.

    Parameters
    ----------
    result
        An adjusted block or collection.
    ax
        Axes, or a figure to put them in; a new figure when None.
    plane
        `XY`, `XZ` or `YZ`: what is seen; that in which the points spread most when None.

    Returns
    -------
    The axes.

    Raises
    ------
    InputError
        Another plane.
    ModuleNotFoundError
        matplotlib is absent (`pip install 'photogram[plots]'`).
    TypeError
        A result without photos and points.
    """
    drawn = pictured(result)
    plan = drawn.plan
    seen = _plane(plan, plane)
    limits = _limits(plan, seen, drawn.footprints if seen[2] == 2 else None)
    width, height = _size(limits)
    with panels(ax, 1, 1, width, height) as [axes]:
        from matplotlib.collections import PathCollection

        _frame(axes, plan, seen, limits)
        said = [_footprints(axes, drawn, seen), _points(axes, plan, seen), _photos(axes, plan, seen)]
        arrows, ends = _vectors(axes, plan, seen, limits, said)
        bars = [*_ellipses(axes, drawn, seen, limits, said), *arrows]
        beyond = _beyond(plan, seen, limits)
        said.append(f"{beyond} points lie beyond the picture" if beyond else "")
        legend = axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
        for handle in legend.legend_handles:
            if isinstance(handle, PathCollection):
                handle.set_sizes([16.0])
        scale_bars(axes, bars, drawn.title or "Network")
        note(axes, said)
        _names(axes, plan, seen, ends)
    return axes


def view_of_plan(axes: Axes, plan: Plan) -> tuple[int, int, int]:
    """Give axes the limits and labels of the plane in which the points spread most; return its axes."""
    seen = _plane(plan, None)
    _frame(axes, plan, seen, _limits(plan, seen))
    return seen


def _frame(axes: Axes, plan: Plan, seen: tuple[int, int, int], limits: Floats) -> None:
    axes.set_aspect("equal", anchor="NW")
    axes.set_xlim(*limits[:, 0])
    axes.set_ylim(*limits[:, 1])
    unit = f", {plan.unit}" if plan.unit else ""
    axes.set_xlabel(f"{plan.axes[seen[0]]}{unit}")
    axes.set_ylabel(f"{plan.axes[seen[1]]}{unit}")
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.locator_params(nbins=6)


def _plane(plan: Plan, plane: str | None) -> tuple[int, int, int]:
    """Return the axes to the right, up, and out of the picture."""
    if plane is not None:
        if plane not in PLANES:
            raise InputError(f"plane is one of {', '.join(PLANES)}, not {plane!r}")
        return PLANES[plane]
    known = plan.points[np.isfinite(plan.points).all(axis=1)]
    if len(known) < 2:
        return PLANES["XY"]
    of_points, of_all = _areas(known), _areas(np.concatenate([known, plan.photos]))
    there = {name: of_all[name] for name in PLANES if of_points[name] >= HIDES * max(of_points.values())}
    # From above, unless that hides most.
    above = there.get("XY", 0.0) >= HIDES * max(there.values())
    return PLANES["XY" if above else max(there, key=lambda name: there[name])]


def _areas(places: Floats) -> dict[str, float]:
    """Return what nearly all of (k, 3) places cover in each plane."""
    extent = np.ptp(np.quantile(places, [1 - WITHIN, WITHIN], axis=0), axis=0)
    return {name: float(extent[a] * extent[b]) for name, (a, b, _) in PLANES.items()}


def _limits(plan: Plan, seen: tuple[int, int, int], outlines: Floats | None = None) -> Floats:
    """Return (2, 2) lower and upper limits of the picture: all stations and control, and nearly all points.

    Footprints are within them, too, unless they are far larger than the network.
    """
    axes = list(seen[:2])
    points = plan.points[np.isfinite(plan.points).all(axis=1)][:, axes]
    parts = [plan.photos[:, axes]]
    if len(points):
        parts.append(np.quantile(points, [1 - WITHIN, WITHIN], axis=0) if len(points) > 500 else points)
        parts.append(points[(plan.kinds != "pass")[np.isfinite(plan.points).all(axis=1)]])
    stations = parts[0]
    if len(stations) > 500:
        parts[0] = np.quantile(stations, [1 - WITHIN, WITHIN], axis=0)
    every = np.concatenate(parts)
    low, high = every.min(axis=0), every.max(axis=0)
    shown = np.empty((0, 2)) if outlines is None else outlines[..., axes].reshape(-1, 2)
    shown = shown[np.isfinite(shown).all(axis=1)]
    if len(shown) and (np.ptp(shown, axis=0) < LARGER * (high - low).max()).all():
        low, high = np.minimum(low, shown.min(axis=0)), np.maximum(high, shown.max(axis=0))
    margin = 0.05 * max(float((high - low).max()), 1e-9)
    return np.array([low - margin, high + margin])


def _size(limits: Floats) -> tuple[float, float]:
    """Return width and height of a figure in inches, with room for legend, scales and remarks."""
    width, height = limits[1] - limits[0]
    longer = 6.5
    across = longer * min(1.0, width / height)
    up = longer * min(1.0, height / width)
    return max(across, 2.5) + 3.3, max(up, 1.6) + 1.6


def thinned(what: str, rows: Indices, most: int) -> tuple[Indices, str]:
    """Return which of many things are drawn, and what the picture says of it.

    They are taken at random, and always the same: of regular networks every n-th would make patterns.
    """
    if len(rows) <= most:
        return rows, ""
    chosen = np.sort(np.random.default_rng(0).choice(len(rows), most, replace=False))
    return rows[chosen], f"{most:,} of {len(rows):,} {what} are drawn, taken at random"


def _footprints(axes: Axes, drawn: Pictured, seen: tuple[int, int, int]) -> str:
    from matplotlib.collections import PolyCollection

    outlines = drawn.footprints
    if seen[2] != 2 or not len(outlines):
        return ""
    good = np.flatnonzero(np.isfinite(outlines).all(axis=(1, 2)))
    if not len(good):
        return ""
    chosen, said = thinned("footprints", good, FOOTPRINTS)
    shown = outlines[chosen][:, :, list(seen[:2])]
    axes.add_collection(
        PolyCollection(
            list(shown),
            facecolors=(0.34, 0.71, 0.91, float(np.clip(0.4 / len(shown), 0.003, 0.06))),
            edgecolors=(0.45, 0.55, 0.62, float(np.clip(25.0 / len(shown), 0.5, 0.7))),
            linewidths=0.6,
            zorder=1.0,
            label="footprint of a photo",
            rasterized=len(shown) > 100,
        ),
        autolim=False,
    )
    return said


def _photos(axes: Axes, plan: Plan, seen: tuple[int, int, int]) -> str:
    chosen, said = thinned("photos", np.arange(len(plan.photos)), PHOTOS)
    shown = plan.photos[chosen][:, list(seen[:2])]
    size = float(np.clip(60.0 / np.sqrt(len(shown)), 2.0, 7.0))
    axes.plot(
        *shown.T,
        "+",
        color=INK if len(shown) <= 300 else FAINT,
        markersize=size,
        markeredgewidth=0.7,
        label=f"photo ({len(plan.photos):,})",
        zorder=3.0,
        rasterized=len(shown) > 500,
    )
    return said


def _points(axes: Axes, plan: Plan, seen: tuple[int, int, int]) -> str:
    from matplotlib import colormaps

    rows = np.flatnonzero((plan.kinds == "pass") & np.isfinite(plan.points).all(axis=1))
    if not len(rows):
        return ""
    every = np.searchsorted(RAYS, plan.rays, side="right") - 1
    classes = every[rows]
    there = np.unique(classes).tolist()
    chosen, said = thinned("points", rows, POINTS)
    size = float(np.clip(9000.0 / len(chosen), 2.0, 14.0))
    colours = colormaps[ORDERED](np.linspace(0.82 if len(there) > 1 else 0.0, 0.0, len(there)))
    for colour, number in zip(colours, there, strict=True):
        own = chosen[every[chosen] == number]
        axes.scatter(
            plan.points[own, seen[0]],
            plan.points[own, seen[1]],
            s=size,
            color=colour,
            linewidths=0,
            label=f"{_class(number, plan.rays[rows])} ({int((classes == number).sum()):,})",
            zorder=2.0,
            rasterized=len(chosen) > 1500,
        )
    return said


def _class(number: int, rays: Indices) -> str:
    low = RAYS[number]
    if number + 1 == len(RAYS):
        return f"{low} rays and more"
    high = min(RAYS[number + 1] - 1, int(rays.max()))
    return f"{low} ray{'s' * (low > 1)}" if high <= low else f"{low} to {high} rays"


def _ellipses(
    axes: Axes, drawn: Pictured, seen: tuple[int, int, int], limits: Floats, said: list[str]
) -> list[tuple[float, str, str]]:
    """Draw error ellipses of points, the median one of each cell where they are many."""
    from matplotlib.collections import EllipseCollection

    plan, pair = drawn.plan, list(seen[:2])
    inside = ((plan.points[:, pair] >= limits[0]) & (plan.points[:, pair] <= limits[1])).all(axis=1)
    rows = np.flatnonzero(inside)
    covariances = drawn.covariances(rows)[:, pair][:, :, pair]
    good = np.isfinite(covariances).all(axis=(1, 2))
    rows, covariances = rows[good], covariances[good]
    variances, turns = np.linalg.eigh(covariances)
    axes_of = np.sqrt(np.maximum(variances, 0.0)) * np.sqrt(-2.0 * np.log(1.0 - CONFIDENCE))
    if not len(rows) or not axes_of[:, 1].any():
        return []
    extent = float((limits[1] - limits[0]).max())
    if len(rows) > ELLIPSES:
        chosen = _of_cells(plan.points[rows][:, pair], axes_of[:, 1], extent / 12.0)
        said.append(f"error ellipses: of {len(rows):,} points, the median one of each of {len(chosen)} cells")
    else:
        chosen = np.arange(len(rows))
    sizes = axes_of[chosen, 1]
    typical = float(np.median(sizes[sizes > 0])) if (sizes > 0).any() else 0.0
    if typical == 0:
        return []
    # The semi-axis of a typical ellipse is a fifth of the distance to its neighbour.
    spacing = extent / np.sqrt(max(len(chosen), 9))
    scale = round_length(0.22 * spacing / typical)
    shown = chosen[scale * axes_of[chosen, 1] < 0.2 * extent]
    if len(shown) < len(chosen):
        said.append(f"{len(chosen) - len(shown)} ellipses are too large to be drawn at this scale")
    angles = np.degrees(np.arctan2(turns[shown, 1, 1], turns[shown, 0, 1]))
    axes.add_collection(
        EllipseCollection(
            2 * scale * axes_of[shown, 1],
            2 * scale * axes_of[shown, 0],
            angles,
            units="xy",
            offsets=plan.points[rows[shown]][:, pair],
            transOffset=axes.transData,
            facecolors="none",
            edgecolors=BLUE,
            linewidths=0.8,
            zorder=4.0,
        ),
        autolim=False,
    )
    worst = int(np.argmax(axes_of[:, 1]))
    unit = f" {plan.unit}" if plan.unit else ""
    said.append(
        f"largest semi-axis of an ellipse: {axes_of[worst, 1]:.3g}{unit}, point {plan.point_ids[rows[worst]]}"
    )
    bar = round_length(0.12 * extent / scale)
    return [
        (scale * bar, BLUE, f"{bar:g}{unit}: semi-axes of error ellipses, {CONFIDENCE:.0%} (× {scale:,g})")
    ]


def _of_cells(places: Floats, sizes: Floats, side: float) -> Indices:
    """Return of each square cell the place whose size is the median."""
    cells = np.floor((places - places.min(axis=0)) / side).astype(np.int64)
    key = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    order = np.lexsort((sizes, key))
    _, starts, counts = np.unique(key[order], return_index=True, return_counts=True)
    return np.asarray(order[starts + counts // 2])


def _vectors(
    axes: Axes, plan: Plan, seen: tuple[int, int, int], limits: Floats, said: list[str]
) -> tuple[list[tuple[float, str, str]], Floats]:
    """Draw control and check points with the differences of their coordinates.

    Returns
    -------
    Scale bars, and (k, 2) places on the arrows, which names should not cover.
    """
    pair = list(seen[:2])
    there = np.isfinite(plan.points).all(axis=1)
    drawn: list[Indices] = []
    for kind, marker in (("control", "^"), ("check", "s")):
        rows = np.flatnonzero((plan.kinds == kind) & there)
        if not len(rows):
            continue
        chosen, remark = thinned(f"{kind} points", rows, VECTORS)
        said.append(remark)
        size = float(np.clip(60.0 / np.sqrt(len(chosen)), 3.0, 7.0))
        axes.plot(
            *plan.points[chosen][:, pair].T,
            marker,
            markersize=size,
            markerfacecolor="white",
            markeredgecolor=INK,
            markeredgewidth=0.9,
            label=f"{kind} point ({len(rows):,})",
            zorder=5.0,
        )
        drawn.append(chosen)
    if not drawn:
        return [], NOWHERE
    # One scale for both kinds: that of the larger differences.
    size = max(_usual(plan.differences[rows]) for rows in drawn)
    if size == 0:
        return [], NOWHERE
    rows = np.concatenate(drawn)
    across, out = plan.differences[rows][:, pair], plan.differences[rows, seen[2]]
    extent = float((limits[1] - limits[0]).max())
    scale = round_length(0.08 * extent / size)
    _arrows(axes, plan.points[rows][:, pair], np.nan_to_num(across), scale, VERMILION)
    flat = np.column_stack([np.zeros(len(rows)), np.nan_to_num(out)])
    _sticks(axes, plan.points[rows][:, pair], flat, scale, np.isfinite(out))
    unit = f" {plan.unit}" if plan.unit else ""
    bar = round_length(0.12 * extent / scale)
    what = f"differences of control and check points, adjusted less given (× {scale:,g})"
    ends = plan.points[rows][:, pair] + scale * np.nan_to_num(across)
    middles = 0.5 * (ends + plan.points[rows][:, pair])
    return [(scale * bar, VERMILION, f"{bar:g}{unit}: {what}")], np.concatenate([ends, middles])


def _usual(differences: Floats) -> float:
    """Return a size that nine tenths of (k, 3) differences do not exceed; 0 where there are none."""
    sizes = np.sqrt(np.nansum(differences**2, axis=1))
    return float(np.quantile(sizes[sizes > 0], 0.9)) if (sizes > 0).any() else 0.0


def _arrows(axes: Axes, places: Floats, vectors: Floats, scale: float, colour: str) -> None:
    long = np.hypot(*vectors.T) > 0
    if long.any():
        axes.quiver(
            *places[long].T,
            *(scale * vectors[long]).T,
            angles="xy",
            scale_units="xy",
            scale=1.0,
            color=colour,
            width=0.0035,
            headwidth=3.5,
            headlength=4.5,
            headaxislength=4.0,
            zorder=6.0,
            label="difference in plan",
        )


def _sticks(axes: Axes, places: Floats, vectors: Floats, scale: float, known: Bools) -> None:
    """Draw differences across the plane as bars: upwards where they are positive."""
    from matplotlib.collections import LineCollection

    chosen = known & (vectors[:, 1] != 0)
    if chosen.any():
        ends = places[chosen] + scale * vectors[chosen]
        lines: Any = np.stack([places[chosen], ends], axis=1)
        axes.add_collection(
            LineCollection(
                list(lines),
                colors=PURPLE,
                linewidths=2.2,
                zorder=5.5,
                label="difference in height, + upwards",
            ),
            autolim=False,
        )


def _beyond(plan: Plan, seen: tuple[int, int, int], limits: Floats) -> int:
    known = plan.points[np.isfinite(plan.points).all(axis=1)][:, list(seen[:2])]
    return int((~((known >= limits[0]) & (known <= limits[1])).all(axis=1)).sum())


def _names(axes: Axes, plan: Plan, seen: tuple[int, int, int], ends: Floats) -> None:
    """Name control and check points, and photos, where these are few."""
    pair = list(seen[:2])
    held = np.flatnonzero((plan.kinds != "pass") & np.isfinite(plan.points).all(axis=1))
    held = held if len(held) <= NAMED else held[:0]
    photos = np.arange(len(plan.photos) if len(plan.photos) <= NAMED else 0)
    if len(held) + len(photos):
        labels(
            axes,
            np.concatenate([plan.points[held], plan.photos[photos]])[:, pair],
            [
                *(plan.point_ids[row] for row in held.tolist()),
                *(plan.photo_ids[row] for row in photos.tolist()),
            ],
            [INK] * len(held) + [SOFT] * len(photos),
            avoid=ends,
        )
