"""Conversion of image coordinates between files and cameras.

A missing image size is an :class:`photogram.InputError` if the conversion needs it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.plain.settings import Settings
from photogram.formats.project import Project, Size
from photogram.io.numbers import scaled
from photogram.io.places import Failing
from photogram.network.cameras import Camera
from photogram.network.equivalent_cameras import OpencvLens, opencv_lens
from photogram.network.geometry import rotation_fault
from photogram.words import phrase


def by_camera(xy: Floats, which: Indices, convert: Callable[[int, Floats], Floats]) -> Floats:
    """Convert (m, 2) image coordinates camera by camera.

    `xy`: (m, 2) image coordinates; `which`: (m,) row of the camera of each; coordinates with -1 are not
    changed.
    """
    found = xy.copy()
    for row in np.flatnonzero(np.bincount(which[which >= 0])).tolist():
        own = which == row
        found[own] = convert(row, xy[own])
    return found


def from_corner(camera: Camera, size: Size | None, corner: Floats) -> Floats:
    """Convert columns and rows (m, 2) to image coordinates of a camera, pixels.

    Models with y up count from the image centre.
    """
    if camera.image_y == "down":
        return corner
    width, height = known_size(camera, size)
    return np.asarray(np.column_stack([corner[:, 0] - width / 2, height / 2 - corner[:, 1]]))


def in_corner(camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Convert image coordinates in pixels to (m, 2) columns and rows."""
    if camera.image_y == "down":
        return xy
    width, height = known_size(camera, size)
    return np.column_stack([xy[:, 0] + width / 2, height / 2 - xy[:, 1]])


def to_corner(project: Project) -> Floats:
    """Return (m, 2) columns and rows from the upper-left corner, pixels."""
    block = project.block
    if block.image_unit != "px" or block.photo_cameras is None:
        raise InputError(phrase("format.pixels", unit=block.image_unit))
    which = block.photo_cameras[block.image_photos]
    return by_camera(
        block.image_xy, which, lambda row, own: in_corner(block.cameras[row], project.sizes[row], own)
    )


def pixel_rows(project: Project) -> Iterator[tuple[int, int, float, float]]:
    """Yield rows of photo and point, and column and row of image observations as :func:`to_corner`."""
    block, corner = project.block, to_corner(project)
    columns = (block.image_photos, block.image_points, corner[:, 0], corner[:, 1])
    return zip(*(column.tolist() for column in columns), strict=True)


def named_pixels(project: Project) -> Iterator[tuple[str, str, float, float]]:
    """Yield names of photo and point, column and row of image observations as :func:`to_corner`."""
    photos, points = project.block.photo_ids, project.block.point_ids
    return ((photos[photo], points[point], x, y) for photo, point, x, y in pixel_rows(project))


def known_size(camera: Camera, size: Size | None) -> Size:
    if size is None:
        raise InputError(phrase("format.image-size", camera=camera.title))
    return size


def sizes_of(project: Project) -> Sequence[Size]:
    return [known_size(each, size) for each, size in zip(project.block.cameras, project.sizes, strict=True)]


def in_unit(settings: Settings, xy: Floats, *, pixels: bool) -> Floats:
    """Return (m, 2) image coordinates in camera units, from the first corner.

    `pixels` is True for columns and rows, or samples and lines of scanners.
    """
    found = scaled(xy, 1e-3) if settings.image == "um" and not pixels else xy
    return found + 0.5 if pixels and settings.pixel_origin == "center" else found


def from_tables(settings: Settings, camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Convert (m, 2) image coordinates of tables, in the unit of a camera, to the axes of the camera."""
    if settings.image == "px" and settings.image_y == "down":
        return from_corner(camera, size, xy)
    if settings.image == "px" and camera.image_y == "down":
        width, height = known_size(camera, size)
        return np.column_stack([width / 2 + xy[:, 0], height / 2 - xy[:, 1]])
    return xy if camera.image_y == settings.image_y else xy * [1.0, -1.0]


def to_tables(image_y: str, camera: Camera, size: Size | None, xy: Floats) -> Floats:
    """Convert (m, 2) image coordinates of a camera to the axes of tables."""
    if camera.unit == "px" and image_y == "down":
        return in_corner(camera, size, xy)
    return xy if camera.image_y == image_y else xy * [1.0, -1.0]


Y_DOWN: Floats = np.diag([1.0, -1.0, -1.0])
"""Transformation between axes x right, y up, z back and axes x right, y down, z forward."""


def checked_rotation(place: Failing, matrix: Floats, tolerance: float = 1e-6) -> Floats:
    """Return a rotation matrix of a file, orthonormalised; reject other matrices."""
    if reason := rotation_fault(matrix, tolerance):
        raise place.error(phrase("format.rotation", reason=reason))
    return np.asarray(matrix @ (3 * np.eye(3) - matrix.T @ matrix) / 2)


def scaled_camera(camera: Camera, factors: Mapping[str, float]) -> Camera:
    """Return a camera whose parameters are multiplied, with standard deviations and covariances."""
    covariance = camera.covariance
    if covariance is not None:
        names, matrix = covariance
        own = np.array([factors[name] for name in names])
        covariance = names, np.asarray(matrix) * np.outer(own, own)
    deviations = zip(camera.names, camera.deviations.tolist(), strict=True)
    return camera.replace(
        parameters={name: value * factors[name] for name, value in camera.parameters.items()},
        sd={name: sd * abs(factors[name]) for name, sd in deviations},
        covariance=covariance,
    )


def lens_of(camera: Camera, size: Size | None) -> OpencvLens | None:
    """Return an exactly equivalent lens in pixels; None without.

    A camera that counts from the image centre needs its size.
    """
    values, pixels = camera.parameters, camera.unit == "px"
    if camera.model == "agisoft_frame" and pixels and not (values["b2"] or values["k4"]):
        terms = {"k1": values["k1"], "k2": values["k2"], "p1": values["p2"], "p2": values["p1"]}
        centre = values["w"] / 2 + values["cx"], values["h"] / 2 + values["cy"]
        focal = values["f"] + values["b1"], values["f"]
        return OpencvLens(False, focal, centre, terms | {"k3": values["k3"]})
    if camera.model not in _FROM_CENTRE:
        return opencv_lens(camera) if pixels else None
    f = values["f"] if camera.model == "bal" else -values["c"]
    if size is None or not pixels or f < 0 or any(values[name] for name in _FROM_CENTRE[camera.model]):
        return None
    terms = {name: values[name] for name in ("k1", "k2") if name in values}
    if camera.model == "brown_forward":
        # If y is down, B2 has the other sign.
        terms = {"p1": -values["B2"] * f, "p2": values["B1"] * f}
        terms |= {f"k{n}": values[f"A{n}"] * f ** (2 * n) for n in (1, 2, 3)}
    centre = size[0] / 2 + values.get("xp", 0.0), size[1] / 2 - values.get("yp", 0.0)
    return OpencvLens(False, (f, f), centre, terms)


def lens_with(
    camera: Camera, size: Size | None, title: str, *terms: str, fisheye: Sequence[str] = ()
) -> tuple[OpencvLens, dict[str, float]]:
    """Return an exactly equivalent lens, and its terms of the format of a title; reject other cameras.

    `terms` are the terms of pinholes, `fisheye` those of fisheyes; empty: the format has no fisheyes.
    """
    if (lens := lens_of(camera, size)) is not None and (fisheye or not lens.fisheye):
        found = lens.named(*(fisheye if lens.fisheye else terms))
        if found is not None:
            return lens, found
    raise InputError(phrase("format.model", camera=camera.title, model=camera.model, title=title))


_FROM_CENTRE: Mapping[str, Sequence[str]] = {
    "bal": (),
    "perspective": (),
    "brown": ("K1", "K2", "K3", "P1", "P2", "b1", "b2"),
    "brown_forward": ("C1", "C2", "r0"),
}
"""Models that count from the image centre, y up, and their parameters without equivalents."""
