"""How an adjustment ended, and where a reader must be careful: remarks and errors with names."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.adjustment.undetermined import named_unknowns, weak_in_words, weak_parameters
from photogram.errors import AdjustmentError, InputError, RankError
from photogram.messages import Message, Undetermined, listed
from photogram.network.block import Block, position_columns
from photogram.network.motion import on_shared
from photogram.network.refraction import metres_per_unit
from photogram.network.tables import ATTITUDE_COLUMNS
from photogram.network.trajectories import Coefficient
from photogram.results.cameras import adjusted_cameras

NEAR = 1e-3  # A point nearer to a station than this part of the median of such distances is at its place
NOTABLE_EXCESS = 1e-5
"""Redundancy numbers whose sum is further off have fewer digits than are printed of them."""
MOST_CORRELATIONS = 8
"""Correlations, and weak parameters of cameras with their figures, that a message lists at most."""
HIGHEST_GIANT = 9000.0  # Metres: the flying height up to which Appendix F of the GIANT guide holds


def undetermined(
    block: Block, solution: _photocore.BlockSolution, error: AdjustmentError | None
) -> list[Message]:
    """Remark on what the adjusted values leave undetermined, `error`, or determine only weakly."""
    messages: list[Message] = []
    if error is not None:
        what = error.what if isinstance(error, RankError) else str(error)
        messages.append(Undetermined(f"there are no covariances: {error}", what=what))
    weak = _weak_unknowns(block, solution)
    if weak:
        words = [weak_in_words(block, solution), *_weak_figures(block, solution)]
        messages.append(hardly_determined(solution.status, weak, "; ".join(filter(None, words))))
    return messages


def hardly_determined(status: str, weak: str, words: str = "") -> Message:
    """Remark on unknowns, `weak`, that no step could follow to their end, and what that is in `words`."""
    ends = "stands still, but" if status == "converged" else "creeps:"
    return Undetermined(
        f"the sum of squares {ends} the observations hardly determine a combination of"
        f" unknowns that moves {weak}: other values along it fit as well" + (f" ({words})" if words else ""),
        what=weak + (f" ({words})" if words else ""),
    )


def harmful(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Remark on points and photos that hardly hold, and spoil what hangs on them."""
    messages = []
    # Hardly ever is there one: small blocks need not wait for this.
    seen = set(block.image_photos.tolist()) if solution.loose_photos else set()
    empty = [photo for photo in solution.loose_photos if photo not in seen]
    loose = [photo for photo in solution.loose_photos if photo in seen]
    if empty:
        names = listed([block.photo_ids[photo] for photo in empty])
        messages.append(Message(f"left out, photos without images: {names}; they stay where they were given"))
    if loose:
        names = listed([block.photo_ids[photo] for photo in loose])
        messages.append(
            Message(
                f"left out, photos that their images do not determine: {names}; their points are too few, or"
                " lie on a line: they stay where they were given, and their images do not take part"
            )
        )
    return messages + harmful_points(solution.weak_points, block.point_ids)


def harmful_points(weak: Sequence[tuple[int, float, float]], point_ids: Sequence[str]) -> list[Message]:
    """Remark on points at a station's own place, and on nearly parallel rays.

    Weak are points with how much worse they are along their rays than across, and their distance from a
    station.
    """
    near = [(point, distance) for point, _, distance in weak if distance < NEAR]
    flat = [(point, ratio) for point, ratio, distance in weak if distance >= NEAR]
    messages = []
    if near:
        names = listed([point_ids[point] for point, _ in near])
        messages.append(
            Message(
                f"at a station's own place, {min(distance for _, distance in near):.1g} of the distance of"
                f" the others and less than {NEAR:g}: points {names}; what their images say of the photos"
                " drowns what all others say: leave them out"
            )
        )
    if flat:
        names = listed([point_ids[point] for point, _ in flat])
        messages.append(
            Message(
                f"on nearly parallel rays: points {names}; their standard deviations along the rays are up to"
                f" {max(ratio for _, ratio in flat):.1g} times those across: they say nothing of the"
                " distance, and redundancy numbers of their images may have lost digits"
            )
        )
    return messages


def _weak_figures(block: Block, solution: _photocore.BlockSolution) -> list[str]:
    """Return value, standard deviation and correlations of each weak parameter of cameras."""
    found = []
    cameras = adjusted_cameras(block, solution, solution.variance_of_unit_weight or 1.0)
    for row, k in dict.fromkeys(weak_parameters(block, solution)):
        camera = cameras[row]
        if not (math.isfinite(camera.sd[k]) and camera.sd[k] > 0):
            continue
        unit = f" {camera.camera.unit_of(camera.names[k])}".rstrip()
        others = [
            f"{camera.correlations[k, j]:+.2f} with {camera.names[j]}" for j in camera.estimated if j != k
        ]
        correlated = f", correlation {listed(others, MOST_CORRELATIONS)}" if others else ""
        found.append(
            f"{camera.names[k]} of {camera.name} is {camera.values[k]:.6g}{unit}"
            f" (standard deviation {camera.sd[k]:.3g}{unit}{correlated})"
        )
    return found[:MOST_CORRELATIONS]


def _weak_unknowns(block: Block, solution: _photocore.BlockSolution) -> str:
    """Name photos and their unknowns (0 to 5), parameters of cameras, common unknowns."""
    of_photos, of_others = solution.weak, solution.weak_unknowns
    names = [*position_columns(block), *ATTITUDE_COLUMNS]
    parts = [
        f"{names[unknown].removesuffix('_deg')} of"
        f" {listed([block.photo_ids[photo] for photo, other in of_photos if other == unknown])}"
        for unknown in sorted({unknown for _, unknown in of_photos if unknown < len(names)})
    ]
    parts += [
        f"{block.cameras[camera].names[k]} of {block.camera_names[camera]}"
        for camera, k in weak_parameters(block, solution)
    ]
    common = block.unknowns if of_others else []
    parts += [
        f"{common[row].components[k]} of {common[row].title}"
        for row, k in of_others
        if not isinstance(common[row], Coefficient)
    ]
    moved = [common[row] for row, _ in of_others if isinstance(common[row], Coefficient)]
    return "; ".join([*parts, *named_unknowns(block, moved)])


def rounded(excess: float | None) -> list[Message]:
    """Remark on cofactors that rounding has reached: redundancy numbers sum up to so much in excess."""
    if excess is None or abs(excess) <= NOTABLE_EXCESS:
        return []
    return [
        Message(
            f"the redundancy numbers sum to the degrees of freedom only within {abs(excess):.1g}: the network"
            " holds together so weakly that standard deviations and test values lose digits to rounding, and"
            " are about as wrong"
        )
    ]


def behind(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Remark on image points whose point stands behind the camera."""
    images = solution.images_behind
    if not len(images):
        return []
    points = [block.point_ids[point] for point in np.unique(block.image_points[images])]
    photos = [block.photo_ids[photo] for photo in np.unique(block.image_photos[images])]
    return hidden(len(images), points, photos)


def folded(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Remark on images beyond where the radial terms of a lens are one-to-one: they fit two directions.

    Points that are known give the ray, so that camera, pose or coordinates are wrong by more than an error of
    measurement: that is an AdjustmentError. Where the point itself is unknown, one image may be a mistake,
    which its residual shows: that is a remark, and the result is there to look for it.
    """
    images = np.asarray(solution.images_folded)
    if not len(images):
        return []
    given = np.asarray(np.isfinite(block.point_sd).any(axis=1))[block.image_points[images]]
    ends = _fold_of(block, solution, int(images[given.argmax()]))
    if given.any():
        own = zip(block.image_points[images[given]], block.image_photos[images[given]], strict=True)
        where = [f"point {block.point_ids[point]} on photo {block.photo_ids[photo]}" for point, photo in own]
        raise AdjustmentError(
            f"control lies beyond where the lens of its camera is one-to-one: {listed(where)}; {ends}:"
            " coordinates, pose or lens are wrong"
        )
    points = listed([block.point_ids[point] for point in np.unique(block.image_points[images])])
    photos = listed([block.photo_ids[photo] for photo in np.unique(block.image_photos[images])])
    count = "1 image point lies" if len(images) == 1 else f"{len(images)} image points lie"
    return [
        Message(
            f"{count} beyond where the lens of the camera is one-to-one: its radial terms fold back there,"
            f" and the result is not to be trusted: points {points} on photos {photos}; {ends}"
        )
    ]


def _fold_of(block: Block, solution: _photocore.BlockSolution, image: int) -> str:
    """Say where the lens of an image's camera ends, at its adjusted parameters."""
    row = 0 if block.photo_cameras is None else int(block.photo_cameras[block.image_photos[image]])
    camera = block.cameras[row]
    domain = _photocore.radial_domain(camera.model, np.array(solution.cameras[row][0]))
    if domain is None:
        return f"the lens of {block.camera_names[row]}"
    radius, end = domain
    unit = f" {camera.unit}" if camera.direction == "backward" else " principal distances"
    at = f"{radius:.4g}{unit}, which becomes {end:.4g}"
    return f"the lens of {block.camera_names[row]} folds at a radius of {at}"


def hidden(images: int, points: list[str], photos: list[str]) -> list[Message]:
    """Remark on images, so many, whose point stands behind the camera: no ray can have made them.

    No photos are named where there is one only.
    """
    if not images:
        return []
    count = "1 image point has its" if images == 1 else f"{images} image points have their"
    on = f" on photos {listed(photos)}" if photos else ""
    return [Message(f"{count} point behind the camera: points {listed(points)}{on}")]


def too_coarse(photos: list[str], points: list[str]) -> AdjustmentError:
    """Name photos and points whose values double precision rounds too coarsely."""
    parts = [f"{kind} {listed(names)}" for kind, names in (("photos", photos), ("points", points)) if names]
    return AdjustmentError(
        f"coordinates or angles of the {' and the '.join(parts)} are so large that double precision rounds"
        " them by more than their standard deviations, or than image coordinates show: count from an origin"
        " nearby (a standard deviation of 0 fixes a value)"
    )


def check_cameras(block: Block) -> None:
    """Refuse photos taken from below the water."""
    refraction = block.refraction
    if refraction is None or refraction.water is None:
        return
    sunk = np.flatnonzero((block.photo_positions[:, 2] <= refraction.water_level) & ~on_shared(block))
    if sunk.size:
        photo = int(sunk[0])
        height, unit = block.photo_positions[photo, 2], block.linear_unit
        raise InputError(
            f"photo {block.photo_ids[photo]} is not above the water: its height is {height:.3f} {unit},"
            f" the water level {refraction.water_level:.3f} {unit}"
        )


def refraction_remarks(block: Block, photo_positions: NDArray[np.float64]) -> list[Message]:
    """Say where the models in force do not quite hold, for (P, 3) adjusted stations."""
    refraction = block.refraction
    if refraction is None or (refraction.air is None and refraction.water is None):
        return []
    messages = []
    heights = metres_per_unit(block.linear_unit) * photo_positions[:, 2]
    high = [block.photo_ids[photo] for photo in np.flatnonzero(heights > HIGHEST_GIANT)]
    if refraction.air == "giant" and high:
        messages.append(
            Message(
                f"the air refraction of GIANT holds up to {HIGHEST_GIANT:g} m, below the photos"
                f' {listed(high)}: the model "standard" has no such limit'
            )
        )
    if not block.geographic:
        messages.append(Message("refraction in rectangular space takes Z as the height and the vertical"))
    return messages
