"""The first values of one camera: a family of lenses that fits, adjusted, and the wanted model from it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.messages import Message
from photogram.network.cameras import Camera
from photogram.network.knots import KNOTTED
from photogram.targets.families import POOR, Trial, adjusted_family, misfits, rays_of, trials
from photogram.targets.homographies import poses, ray_homographies
from photogram.targets.lens_fit import KNOTS, fitted, is_perspective, lens_of
from photogram.targets.sightings import Sightings
from photogram.targets.small_block import Adjusted, adjusted_views

__all__ = ["NARROW", "WIDEST", "first_camera", "from_axis", "picture_size", "usual_models"]

MANY = 62
"""Pictures that first values of a camera are adjusted by, at the most: the others would say the same."""
NARROW, WIDEST = math.radians(90.0), math.radians(88.0)
"""The horizontal field below which `opencv5` is usual, and how far from the axis `opencv8` may see."""
TOLERANCE = 1e-5
"""Of a standard deviation: where steps of an adjustment end that shows what corners determine."""
TOO_STIFF = 4.0
"""A lens whose variance is that of its family so many times, which has fewer terms, is not of this kind."""
NO_WORSE = 1.5
"""What a misfit may grow when one more view takes part."""
MARGIN = 1.05
"""Of the farthest corner from the middle of the picture: how far out the wanted lens is fitted."""


def picture_size(seen: Sightings, given: tuple[int, int] | None) -> tuple[int, int]:
    """Return width and height of the pictures: given, or such that corners lie evenly about their middle."""
    if given is not None:
        return given
    low, high = np.nanmin(seen.xy, axis=(0, 1)), np.nanmax(seen.xy, axis=(0, 1))
    width, height = (max(math.ceil(a + b), math.ceil(b)) + 1 for a, b in zip(low, high, strict=True))
    return width, height


def first_camera(
    seen: Sightings, size: tuple[int, int], name: str, model: str | None, knots: tuple[int, int] = KNOTS
) -> tuple[Camera, list[Message]]:
    """Return a camera with the wanted model, free, and remarks.

    Parameters
    ----------
    seen
        The pictures of the camera.
    size, name
        Width and height of them in pixels, and what the camera is called.
    model
        The wanted model; None for what is usual at its field of view. The knots of a splined one are fitted
        to the usual one: many of them are where no corner is.
    knots
        Along columns and rows, of a splined one.

    Raises
    ------
    InputError
        A model that there is not, or one that cannot show corners that the camera sees.
    """
    used = seen.of(np.arange(0, len(seen.xy), math.ceil(len(seen.xy) / MANY)))
    trial, adjusted = adjusted_family(used, trials(used, size))
    family = (trial.camera if adjusted is None else adjusted.camera).replace(name=name)
    remarks = []
    if adjusted is None:
        remarks.append(Message(f"camera {name}: no trial lens could be adjusted; the first values are rough"))
    reach = MARGIN * float(np.nanmax(np.linalg.norm(seen.xy - (np.array(size) - 1) / 2, axis=2)))
    own = used.listed(trial.orders)
    splined = model == KNOTTED
    for wanted in _wanted(family, seen, size, None if splined else model):
        camera = fitted(family, wanted, size, radius=reach)
        done = _adjusted(own, trial, family, camera)
        if done is not None and adjusted is not None and done.variance > TOO_STIFF * adjusted.variance:
            times = math.sqrt(done.variance / adjusted.variance)
            why = f"{wanted} fits its corners {times:.0f} times worse than a plain {family.model} lens does"
            remarks.append(Message(f"camera {name}: {why}: another lens is needed"))
        if done is not None and done.is_whole:
            break
        why = f"its corners alone hardly determine the terms of {wanted}"
        remarks.append(Message(f"camera {name}: {why}: priors, or another lens, would help"))
    found = camera if done is None else done.camera
    return (fitted(found, KNOTTED, size, knots=knots) if splined else found), remarks


def _adjusted(seen: Sightings, trial: Trial, family: Camera, camera: Camera) -> Adjusted | None:
    """Return a camera adjusted by the views that fit the family, and by those that then fit it, too.

    A family of two parameters fits badly where a lens is unlike it, in the corners of the picture: a view
    there belongs to the others if the lens, adjusted with it, fits it, and these no worse than before.
    """
    start = poses(ray_homographies(seen.coordinates, rays_of(family, seen.xy)))
    fits = trial.misfits <= POOR * trial.angle
    done = adjusted_views(camera, seen.of(fits), start[fits], TOLERANCE)
    if done is None:
        return None
    for row in np.argsort(trial.misfits)[np.count_nonzero(fits) :].tolist():
        before = float(np.median(misfits(seen.of(fits), rays_of(done.camera, seen.of(fits).xy))))
        more = fits | (np.arange(len(fits)) == row)
        wider = adjusted_views(done.camera, seen.of(more), start[more], TOLERANCE)
        if wider is None:
            break
        after = misfits(seen, rays_of(wider.camera, seen.xy))
        if not (after[row] <= POOR * before and float(np.median(after[fits])) <= NO_WORSE * before):
            break
        fits, done = more, wider
    return done


def _wanted(family: Camera, seen: Sightings, size: tuple[int, int], model: str | None) -> Sequence[str]:
    """Return the model that was asked for, if it can show all corners; else the usual ones, in order."""
    farthest = from_axis(family, seen.xy.reshape(-1, 2))
    if model is None:
        ends = np.array([[0.0, (size[1] - 1) / 2], [size[0] - 1.0, (size[1] - 1) / 2]])
        return usual_models(
            float(np.arccos(np.clip(np.prod(family.rays(ends), axis=0).sum(), -1, 1))), farthest
        )
    if farthest >= math.pi / 2 and is_perspective(lens_of(model, family, size)):
        raise InputError(
            f"camera {family.name}: it sees corners {math.degrees(farthest):.0f} degrees off its axis, which"
            f" {model} cannot show; opencv_fisheye can"
        )
    return [model]


def usual_models(field: float, farthest: float) -> list[str]:
    """Return the models that are usual at a horizontal field of view, in order.

    Parameters
    ----------
    field, farthest
        Radians; the latter is how far from the axis anything is seen.
    """
    if farthest >= WIDEST:
        return ["opencv_fisheye"]
    return ["opencv5"] if field < NARROW else ["opencv8", "opencv_fisheye"]


def from_axis(camera: Camera, xy: Floats) -> float:
    """Return the largest angle (rad) of pixels from the axis of a camera; NaN are left out."""
    rays = camera.rays(xy)
    return float(np.nanmax(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), -rays[:, 2])))
