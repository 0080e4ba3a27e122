"""Stations off the path of their strip (Appendix H: straight and level as far as possible, never exactly)."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.diagnosis.findings import Finding, Level, Section
from photogram.diagnosis.robust import MAD_TO_SD, fit
from photogram.lazy_dataclasses import dataclass
from photogram.network import geometry
from photogram.network.block import Block
from photogram.network.rays import local_axes
from photogram.network.strips import strips_of
from photogram.results.result import Result

__all__ = ["flown", "stations"]


LOOK, GRAVE = 8.0, 20.0
"""Departures from the path, in robust standard deviations of all departures of their kind."""
FEW = 4
"""So many free departures double what is allowed."""
MOVED = 10.0
"""The same for the change from the initial to the adjusted station."""
TINY = 1e-9
"""A spread below this is rounding: radians, or the linear unit."""
UPRIGHT = 0.8
"""Vertical component of the z axis of a photo that looks down, at least."""
FEWEST = 5
"""Photos of a strip whose path can be judged."""
CURVED = 15
"""Photos of a strip whose path may be curved."""
SMOOTH_POSITION, SMOOTH_ANGLE = 1e-3, 1e-3
"""Departures that are never remarked on: of the base, and radians."""
QUANTITIES = ("across the strip", "height", "omega", "phi", "kappa")
"""The angles are those between the photo and its strip, ground-to-photo."""


def stations(block: Block, result: Result | None, misleading: Collection[str] = ()) -> Section:
    """Compare every station with the smooth path of its strip, and with its initial values.

    Parameters
    ----------
    block
        The block with its initial stations.
    result
        Its adjustment, if there is one.
    misleading
        Photos on whose points good images looked wrong from the initial stations: if one of them has moved,
        its initial values are wrong beyond doubt.
    """
    section = Section(
        "Stations",
        "An aircraft flies straight and level as far as it can: a departure from its path wants a reason.",
    )
    which = "initial"
    if result is not None:
        _moved(result, misleading, section)
        block = result.block.replace(
            photo_positions=result.photo_positions, photo_attitudes=result.photo_attitudes
        )
        which = "adjusted"
    axes = local_axes(block)
    positions, cameras = axes.positions(block.photo_positions), axes.cameras()
    if not flown(block):
        section.parts.append("the photos do not look down, as those of an aircraft do: no paths")
        return section
    strips = strips_of(positions)
    heights = block.photo_positions[:, 2]
    paths = [
        _path(positions[strip], heights[strip], cameras[strip]) for strip in strips if len(strip) >= FEWEST
    ]
    section.parts.append(
        f"{len(strips)} strips; {len(paths)} of them long enough ({FEWEST} photos) to judge the {which} path"
    )
    if paths:
        _compare(block, [strip for strip in strips if len(strip) >= FEWEST], paths, which, section)
    return section


def flown(block: Block) -> bool:
    """Whether most photos look down, as from an aircraft: only then is there a path, and ground."""
    return float(np.median(local_axes(block).cameras()[:, 2, 2])) > UPRIGHT


@dataclass(frozen=True)
class _Path:
    """Departures (k, 5) of the photos of a strip from its path, and what its fit leaves free of their sizes.

    A robust fit passes through as many photos as it has coefficients; `free` are the other sizes (k - 2, 5),
    or (k - 3, 5) of a curved path.
    """

    departures: Floats
    free: Floats


def _path(positions: Floats, heights: Floats, cameras: Floats) -> _Path:
    half = len(positions) // 2
    along = np.median(positions[-half:], axis=0) - np.median(positions[:half], axis=0)
    along[2] = 0.0
    along /= np.linalg.norm(along)
    frame = np.array([along, np.cross([0.0, 0.0, 1.0], along), [0.0, 0.0, 1.0]])
    angles = geometry.rotation_angles(np.ascontiguousarray(cameras.transpose(0, 2, 1) @ frame.T))
    middle = np.angle(np.median(np.cos(angles), axis=0) + 1j * np.median(np.sin(angles), axis=0))
    angles = np.angle(np.exp(1j * (angles - middle)))
    place = positions @ frame.T
    values = np.column_stack([place[:, 1], heights, angles])
    t = (place[:, 0] - place[:, 0].mean()) / max(float(np.ptp(place[:, 0])), 1e-300)
    degree = 2 if len(t) >= CURVED else 1
    design = np.vander(t, degree + 1)
    # Each quantity by itself: a wrong height says nothing about kappa.
    columns = [values[:, [k]] - design @ fit(design, values[:, [k]]) for k in range(values.shape[1])]
    departures = np.hstack(columns)
    departures[:, 2:] = np.angle(np.exp(1j * departures[:, 2:]))
    return _Path(departures, np.sort(np.abs(departures), axis=0)[degree + 1 :])


def _spread(sizes: Floats) -> Floats:
    spread: Floats = MAD_TO_SD * np.median(sizes, axis=0)
    return spread


def _compare(block: Block, strips: list[Indices], paths: list[_Path], which: str, section: Section) -> None:
    """Name the photos that depart from the path far more than photos do on the whole."""
    free = np.vstack([path.free for path in paths])
    # The spread of few departures is itself uncertain.
    usual, doubt = _spread(free), 1 + FEW / len(free)
    base = _base(block)
    floor = np.array([SMOOTH_POSITION * base] * 2 + [SMOOTH_ANGLE] * 3)
    units = [block.linear_unit] * 2 + ["deg"] * 3
    factors = np.array([1.0, 1.0, *[np.degrees(1.0)] * 3])
    for name, spread, unit in zip(QUANTITIES, usual * factors, units, strict=True):
        section.figure(f"spread about the path, {name}", f"{spread:.4f} {unit}")
    for strip, path in zip(strips, paths, strict=True):
        scale = np.maximum(np.maximum(usual, _spread(path.free)), floor)
        for row, k in np.argwhere(np.abs(path.departures) > LOOK * doubt * scale).tolist():
            size = abs(path.departures[row, k]) / scale[k] / doubt
            departure, photo = float(path.departures[row, k] * factors[k]), block.photo_ids[strip[row]]
            text = (
                f"station {photo} is off the {which} path of its strip: {QUANTITIES[k]} by {departure:.3f}"
                f" {units[k]}, {size:.0f} times the usual"
            )
            level: Level = "grave" if size > GRAVE else "look"
            values = {"departure": departure, "times_usual": float(size)}
            section.findings.append(Finding("outlying-station", level, text, [photo], [], values))


def _moved(result: Result, misleading: Collection[str], section: Section) -> None:
    """Name the stations that the adjustment moved far more than the others."""
    block = result.block
    if len(block.photo_ids) - len(block.mounts) < FEWEST:
        return
    axes, base = local_axes(block), _base(block)
    shifts = axes.positions(result.photo_positions) - axes.positions(block.photo_positions)
    turns = result.photo_attitudes - block.photo_attitudes
    turns = np.angle(np.exp(1j * turns))
    unit = block.linear_unit
    # Photos on frames have no poses of their own.
    mounted = np.isin(block.photo_ids, [each.photo for each in block.mounts])
    for what, changes, shown, factor in (
        ("position", shifts, unit, 1.0),
        ("attitude", turns, "deg", float(np.degrees(1.0))),
    ):
        spread = MAD_TO_SD * np.median(np.abs(changes[~mounted]), axis=0)
        sizes = np.abs(changes) / np.maximum(spread, TINY)
        listed = ", ".join(f"{each * factor:.4f}" for each in spread)
        section.figure(f"usual change of {what} by the adjustment", f"{listed} {shown}")
        small = np.abs(changes).max(axis=1) < (SMOOTH_ANGLE if what == "attitude" else SMOOTH_POSITION * base)
        for photo in np.flatnonzero((sizes.max(axis=1) > MOVED) & ~small & ~mounted).tolist():
            k = int(sizes[photo].argmax())
            name = block.photo_ids[photo]
            wrong = name in misleading
            text = (
                f"station {name}: the adjustment changed its {what} by"
                f" {changes[photo, k] * factor:.3f} {shown}, {sizes[photo, k]:.0f} times the usual: "
            ) + (
                "its initial values are wrong, and made good images look wrong"
                if wrong
                else "are its initial values right?"
            )
            values = {"change": float(changes[photo, k] * factor), "times_usual": float(sizes[photo, k])}
            section.findings.append(
                Finding("moved-station", "grave" if wrong else "look", text, [name], [], values)
            )


def _base(block: Block) -> float:
    """Return the usual distance of a photo from the next; 0 for a single photo."""
    positions = local_axes(block).positions(block.photo_positions)
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    return float(np.median(steps)) if steps.size else 0.0
