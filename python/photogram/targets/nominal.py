"""A camera of which only the data sheet is known: what pictures of a board are planned for."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.annotations import check_arguments
from photogram.arguments.arrays import number
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.targets.first_camera import FAMILIES, NARROW, usual_models
from photogram.targets.lens_fit import KNOTS, fitted, free_names, grid_of_pixels, lens_of
from photogram.targets.regularisation import WEAK

__all__ = ["nominal_camera", "weakly_known"]

WIDE = "fisheye"
"""The family of lenses beyond the fields of perspective ones: equidistant."""
SHARE = 0.1
"""Of the width of a picture: what a free parameter of a nominal camera may move an image by."""
RATIONAL = "k6"
"""A term in the denominator, of models that have one."""


def nominal_camera(
    size: tuple[int, int],
    model: str | None = None,
    *,
    field: float | None = None,
    focal: float | None = None,
    knots: tuple[int, int] = KNOTS,
) -> Camera:
    """Return a camera with a field of view or a focal length, and all that a calibration finds free.

    Its principal point is in the middle of the picture. Below 90 degrees of field it is a perspective lens
    without distortion, beyond an equidistant one, to which the terms of the model are fitted; so is a lens of
    any field with terms in a denominator, which without distortion do what those in the numerator do.

    Parameters
    ----------
    size
        Width and height of its pictures, pixels.
    model
        The lens, as of :func:`first_values`; None: the one that is usual at its field of view.
    field, focal
        Its horizontal field of view, degrees, or its focal length, pixels: one of both.
    knots
        Along columns and rows, of a splined lens.

    Raises
    ------
    InputError
        Neither field nor focal length, or both; values that no camera has; a model that there is not, or that
        shows nothing of such a picture.
    """
    if (field is None) == (focal is None):
        raise InputError(
            "a nominal camera has a field of view (field) or a focal length (focal): one of both"
        )
    angle = _field(size[0], focal) if field is None else math.radians(number("field", field))
    if not 0 < angle <= 2 * math.pi:
        raise InputError(f"field is a number of degrees up to 360, not {math.degrees(angle):g}")
    if focal is None:
        focal = size[0] * (1 / (2 * math.tan(angle / 2)) if angle < NARROW else FAMILIES[WIDE](angle))
    half = math.hypot(*size) / (2 * focal)
    wanted = model or usual_models(angle, math.atan(half) if angle < NARROW else half)[0]
    centre = {"cx": (size[0] - 1) / 2, "cy": (size[1] - 1) / 2}
    source = Camera(WIDE, {"fx": focal, "fy": focal, **centre}, unit="px", name="camera")
    lens = lens_of(wanted, source, size, knots)
    flat = angle < NARROW and RATIONAL not in free_names(lens)
    return fitted(source.replace(model="pinhole") if flat else source, wanted, size, knots=knots)


def weakly_known(camera: Camera, size: tuple[int, int]) -> Camera:
    """Return a camera whose free parameters have standard deviations: they move images by a tenth of a width.

    So much a data sheet says; it makes any number of views determine the camera, and next to nothing of what
    they determine well. Knots have their usual weights.
    """
    if camera.knots is not None:
        return camera.replace(knot_sd=WEAK) if camera.knot_unknowns else camera
    partials = camera.partials(camera.rays(grid_of_pixels(size)))[2]
    reach = np.nanmax(np.linalg.norm(partials, axis=1), axis=0)
    sd = {
        name: SHARE * size[0] / own if math.isinf(given) else given
        for name, own, given in zip(camera.names, reach.tolist(), camera.deviations.tolist(), strict=True)
    }
    return camera.replace(sd=sd)


def _field(width: int, focal: float | None) -> float:
    """Return the horizontal field of view (radians) of a focal length in pixels."""
    given = number("focal", focal)
    if not 0 < given < math.inf:
        raise InputError(f"focal is a positive number of pixels, not {given:g}")
    flat = 2 * math.atan(width / (2 * given))
    return flat if flat < NARROW else width / given


check_arguments(globals(), ["nominal_camera"])
