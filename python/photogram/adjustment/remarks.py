"""Notes and errors of an adjustment that name photos, points and cameras."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.undetermined import named_unknowns, weak_in_words, weak_parameters
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError, RankError, message_of
from photogram.messages import Message, Undetermined, listed
from photogram.network.block import Block, position_columns
from photogram.network.block_checks import ATTITUDE_COLUMNS
from photogram.network.motion import on_shared
from photogram.network.refraction import metres_per_unit
from photogram.network.trajectories import Coefficient
from photogram.results.parts import adjusted_cameras
from photogram.words import Phrase, phrase

NEAR = 1e-3  # Distance from a station relative to the median distance, below which a point coincides with it
NOTABLE_EXCESS = 1e-5  # Minimum reported excess of the sum of redundancy numbers
MOST_CORRELATIONS = 8  # Maximum number of correlations or weak parameters in a message
HIGHEST_GIANT = 9000.0  # Maximum flying height in metres of Appendix F of the GIANT guide


def undetermined(
    block: Block, solution: _photocore.BlockSolution, error: AdjustmentError | None
) -> list[Message]:
    """Report unknowns that the adjusted values leave undetermined (`error`) or nearly so."""
    messages: list[Message] = []
    if error is not None:
        what = error.what if isinstance(error, RankError) else str(error)
        messages.append(Undetermined(phrase("adjust.no-covariances", reason=message_of(error)), what=what))
    weak = _weak_unknowns(block, solution)
    if weak:
        causes = [weak_in_words(block, solution), *_weak_figures(block, solution)]
        messages.append(hardly_determined(solution.status, weak, [cause for cause in causes if cause]))
    return messages


def hardly_determined(status: str, weak: str, causes: Sequence[Phrase] = ()) -> Message:
    """Report weakly determined unknowns, `weak`, with causes and numbers."""
    details = phrase("adjust.weak.details", causes=list(causes)) if causes else ""
    code = f"adjust.weak.{'converged' if status == 'converged' else 'slow'}"
    return Undetermined(phrase(code, unknowns=weak, details=details), what=f"{weak}{details}")


def harmful(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    # Such cases are rare, and small blocks should not wait for this.
    seen = set(block.image_photos.tolist()) if solution.loose_photos else set()
    by_kind: dict[str, list[str]] = {"empty": [], "loose": []}
    for photo in solution.loose_photos:
        by_kind["loose" if photo in seen else "empty"].append(block.photo_ids[photo])
    messages = [Message(phrase(f"adjust.photos.{kind}", photos=own)) for kind, own in by_kind.items() if own]
    return messages + harmful_points(solution.weak_points, block.point_ids)


def harmful_points(weak: Sequence[tuple[int, float, float]], point_ids: Sequence[str]) -> list[Message]:
    """Report points that coincide with a station, and points with nearly parallel rays.

    `weak` contains points, the ratio of precision along and across their rays, and the relative distance from
    a station.
    """
    near = [(point, distance) for point, _, distance in weak if distance < NEAR]
    flat = [(point, ratio) for point, ratio, distance in weak if distance >= NEAR]
    messages = []
    if near:
        names, least = [point_ids[point] for point, _ in near], min(distance for _, distance in near)
        messages.append(Message(phrase("adjust.points.near", points=names, ratio=least, limit=NEAR)))
    if flat:
        names, most = [point_ids[point] for point, _ in flat], max(ratio for _, ratio in flat)
        messages.append(Message(phrase("adjust.points.flat", points=names, times=most)))
    return messages


def _weak_figures(block: Block, solution: _photocore.BlockSolution) -> list[Phrase]:
    """Return value, standard deviation and correlations of each weak camera parameter."""
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
        fields: dict[str, Any] = {"parameter": camera.names[k], "camera": camera.name, "unit": unit}
        fields |= {"value": float(camera.values[k]), "sd": float(camera.sd[k]), "correlations": ""}
        if others:
            correlations = others[:MOST_CORRELATIONS]
            fields["correlations"] = phrase("adjust.weak.correlations", correlations=correlations)
        found.append(phrase("adjust.weak.parameter", **fields))
    return found[:MOST_CORRELATIONS]


def _weak_unknowns(block: Block, solution: _photocore.BlockSolution) -> str:
    """Name photos with their unknowns (0 to 5), camera parameters and shared unknowns."""
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
    """Report cofactors with rounding errors, detected by the excess of redundancy."""
    if excess is None or abs(excess) <= NOTABLE_EXCESS:
        return []
    return [Message(phrase("adjust.rounding", excess=abs(excess)))]


def behind(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    images = solution.images_behind
    if not len(images):
        return []
    return hidden(len(images), **named_images(block, images))


def named_images(block: Block, images: Indices | Bools) -> dict[str, list[str]]:
    """Return the names of the points and photos of some images."""
    points, photos = np.unique(block.image_points[images]), np.unique(block.image_photos[images])
    return {"points": [block.point_ids[k] for k in points], "photos": [block.photo_ids[k] for k in photos]}


def folded(block: Block, solution: _photocore.BlockSolution) -> list[Message]:
    """Report images outside the one-to-one radius of a lens, which fit two directions.

    If the point is known, its ray shows that camera, pose or coordinates are grossly wrong: AdjustmentError.
    If the point is unknown, one image may be wrong, and its residual shows this: a note in the result.
    """
    images = np.asarray(solution.images_folded)
    if not len(images):
        return []
    given = np.asarray(np.isfinite(block.point_sd).any(axis=1))[block.image_points[images]]
    lens = _fold_of(block, solution, int(images[given.argmax()]))
    if given.any():
        rows = zip(block.image_points[images[given]], block.image_photos[images[given]], strict=True)
        names = [phrase("named.image", point=block.point_ids[k], photo=block.photo_ids[p]) for k, p in rows]
        raise AdjustmentError(phrase("adjust.folded.control", images=names, lens=lens))
    named = named_images(block, images)
    return [Message(phrase("adjust.folded.images", n=len(images), **named, lens=lens))]


def _fold_of(block: Block, solution: _photocore.BlockSolution, image: int) -> Phrase:
    """Return the radius at which the lens of an image folds, at adjusted parameters."""
    row = 0 if block.photo_cameras is None else int(block.photo_cameras[block.image_photos[image]])
    camera, name = block.cameras[row], block.camera_names[row]
    domain = _photocore.radial_domain(camera.model, np.array(solution.cameras[row][0]))
    if domain is None:
        return phrase("adjust.fold", camera=name)
    unit = str(camera.unit) if camera.direction == "backward" else phrase("adjust.principal-distances")
    return phrase("adjust.fold.radius", camera=name, radius=domain[0], end=domain[1], unit=unit)


def hidden(images: int, points: list[str], photos: list[str]) -> list[Message]:
    """Report image observations of points behind the camera; a single photo is not named."""
    if not images:
        return []
    on = phrase("adjust.behind.photos", photos=photos) if photos else ""
    return [Message(phrase("adjust.behind", n=images, points=points, photos=on))]


def too_coarse(photos: list[str], points: list[str]) -> AdjustmentError:
    """Return the error for photos and points with coordinates too large for double precision."""
    lists = {"photos": photos, "points": points}
    parts = [phrase(f"adjust.list.{kind}", names=names) for kind, names in lists.items() if names]
    return AdjustmentError(phrase("adjust.coarse", parts=parts))


def check_cameras(block: Block) -> None:
    """Reject photos taken from below the water."""
    refraction = block.refraction
    if refraction is None or refraction.water is None:
        return
    sunk = np.flatnonzero((block.photo_positions[:, 2] <= refraction.water_level) & ~on_shared(block))
    if sunk.size:
        photo = int(sunk[0])
        height = {"height": float(block.photo_positions[photo, 2]), "level": refraction.water_level}
        name = block.photo_ids[photo]
        raise InputError(phrase("adjust.below-water", photo=name, unit=block.linear_unit, **height))


def refraction_remarks(block: Block, photo_positions: Floats) -> list[Message]:
    """Report limits of the refraction models for (P, 3) adjusted stations."""
    refraction = block.refraction
    if refraction is None or (refraction.air is None and refraction.water is None):
        return []
    messages = []
    heights = metres_per_unit(block.linear_unit) * photo_positions[:, 2]
    high = [block.photo_ids[photo] for photo in np.flatnonzero(heights > HIGHEST_GIANT)]
    if refraction.air == "giant" and high:
        messages.append(Message(phrase("adjust.refraction.giant", limit=HIGHEST_GIANT, photos=high)))
    if not block.geographic:
        messages.append(Message(phrase("adjust.refraction.rectangular")))
    return messages
