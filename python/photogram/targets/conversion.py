"""Conversion of lenses: fit of another camera model to the images of a camera.

With the rays r(q) of source pixels q, the new camera f and a motion T of its axes minimise

    sum |f(T d r(q)) - q|^2 = min
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, is_covariance, number, truth_value, whole_number
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Section
from photogram.show.quantity import Axis, Quantity, Table, members
from photogram.summaries import Rows
from photogram.targets.calibration_difference import CameraDifference, motion_of
from photogram.targets.lens_fit import (
    GRID,
    KNOTS,
    NO_MOTION,
    Fitted,
    Moved,
    Points,
    fitted_in_stages,
    free_names,
    lens_of,
    shows,
    within,
)
from photogram.targets.output import Rig
from photogram.targets.uncertainty import at_distance, image_grid
from photogram.targets.vision import TURNED, names_of, points_at
from photogram.words import phrase

MIN_RELATIVE_VARIANCE = 1e-2  # added to each covariance to limit the weight of a pixel


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Conversion(Documented):
    """Camera converted to another lens model.

    Attributes
    ----------
    source, camera
        Original and converted camera. The latter is fixed, or has the covariance propagated from the source.
    difference
        Projections by the new camera minus pixels of the source, over 60 x 40 pixels, and the motion between
        their axes. `inside` marks the pixels of the fit.
    names, covariance
        (p,) fitted parameters, and (p, p) their covariance propagated from the source; None if the source has
        none. It does not contain the misfit of the models.
    """

    source: Camera
    camera: Camera
    difference: CameraDifference
    names: tuple[str, ...]
    covariance: Floats | None

    @property
    def rms(self) -> float:
        """Root mean square of the differences at pixels of the fit."""
        return self.difference.rms

    @property
    def largest(self) -> float:
        """Largest difference, pixels."""
        return self.difference.largest

    @property
    def where(self) -> tuple[float, float]:
        """Pixel of the largest difference: column, row."""
        lengths = np.nanmax(np.where(self.difference.inside, self.difference.lengths, -1.0), axis=0)
        row, column = np.unravel_index(np.argmax(lengths), lengths.shape)
        return float(self.difference.columns[column]), float(self.difference.rows[row])

    @property
    def unseen(self) -> float:
        """Fraction of the source image that the new camera cannot image."""
        return float(np.mean(~np.isfinite(self.difference.lengths).all(axis=0)))

    def within(self, tolerance: float) -> bool:
        """Return whether all differences are at most `tolerance` pixels."""
        return self.largest <= tolerance

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the conversion."""
        found = self.difference
        at = [at_distance(each, found.unit) for each in found.distances]
        turned = found.fitted.finite or np.any(found.fitted.motion != np.eye(4))
        column, row = self.where
        rows = [
            ("difference", str(phrase("conversion.sizes", rms=self.rms, largest=self.largest, at=at))),
            ("largest at", str(phrase("conversion.where", column=column, row=row))),
            ("motion of the axes", str(motion_of(found) if turned else phrase("conversion.unturned"))),
            *self.camera.brief()[1],
        ]
        if self.covariance is not None:
            rows.append(("covariance", str(phrase("conversion.covariance", source=self.source.title))))
        if self.unseen > 0:
            rows.append(("not shown", str(phrase("conversion.unseen", percent=100 * self.unseen))))
        models = {"source": self.source.model, "model": self.camera.model}
        return str(phrase("conversion.title", camera=self.source.title, **models)), rows

    def document(self) -> Document:
        """Return the document with results, differences over the image and new camera."""
        title, rows = self.brief()
        found, camera = self.difference, self.camera
        down, across = np.meshgrid(found.rows, found.columns, indexing="ij")
        times = len(found.distances)
        differences = [
            Quantity(np.repeat(found.distances, across.size), name="distance"),
            Quantity(np.tile(across.ravel(), times), name="column"),
            Quantity(np.tile(down.ravel(), times), name="row"),
            Quantity(found.vectors.reshape(-1, 2), (Axis("dx"), Axis("dy")), name=""),
        ]
        return Document(
            what="Lens conversion",
            title=title,
            highlights=[Fact(name, text) for name, text in rows],
            sections=[Section.of(Table("differences", "Differences", differences))],
            members={
                "kind": "lens conversion",
                "source": {"name": self.source.title, "model": self.source.model},
                "pixel_origin": "center",
                **members(camera, "model", "parameters", "knots"),
                **members(
                    found,
                    "size",
                    "distances",
                    "columns",
                    "rows",
                    motion="fitted.motion",
                    difference="vectors",
                ),
                **members(
                    self, "rms", "largest", "names", "covariance", largest_at="where", not_shown="unseen"
                ),
            },
        )

    def to_csv(self) -> bytes:
        """Return one row per distance and pixel: column, row, dx, dy; empty if not imaged."""
        return self.document().table("differences").csv()

    def rig(self) -> Rig:
        """Return the new camera for files of other programs."""
        own = self.camera.replace(name=self.source.title)
        return Rig(cameras=(own,), sizes=(self.difference.size,), sensors=np.eye(4)[np.newaxis])


def convert_lens(
    source: Camera,
    model: str,
    size: tuple[int, int],
    *,
    radius: float = math.inf,
    distances: Sequence[float] = (math.inf,),
    intrinsics_only: bool = False,
    knots: tuple[int, int] = KNOTS,
    covariance: tuple[Sequence[str], ArrayLike] | None = None,
) -> Conversion:
    """Fit another lens model to the projections of a camera.

    Parameters
    ----------
    source
        Camera; pixels count from 0 at the centre of the first pixel.
    model
        Model name from `docs/cameras.md`, or `opencv4`, `opencv5`, `opencv8`, `opencv12`.
    size
        Image width and height, pixels.
    radius
        Largest distance of used pixels from the image centre.
    distances
        Distances of comparison from the source centre. At infinity a rotation of the axes is fitted, at
        finite distances a translation as well.
    intrinsics_only
        Whether to fix the axes. They are always fixed for splined lenses, whose knots can represent a
        rotation.
    knots
        Number of knots along columns and rows, for a splined model.
    covariance
        Names of parameters and knots of the source, and their (p, p) covariance. None: the source covariance,
        if it is weighted. Image points are then weighted by their inverse covariance, and the new camera has
        a covariance.

    Raises
    ------
    InputError
        If the model is unknown or cannot image the source rays, or if the radius leaves too few pixels. If
        distances are not positive, or mix finite and infinite ones.
    """
    truth_value("intrinsics_only", intrinsics_only)
    size = (whole_number("size", size[0]), whole_number("size", size[1]))
    apart = tuple(number("distance", each) for each in distances)
    if not apart or not all(each > 0 for each in apart):
        raise argument_error("distances", "positive", value=", ".join(map(str, apart)) or "none")
    if len({math.isfinite(each) for each in apart}) > 1:
        raise InputError(phrase("targets.infinite"))
    start = lens_of(model, source, size, knots)
    columns, rows, pixels = image_grid(size, GRID)
    known = _known(source, covariance)
    points, places = points_at(source, pixels, apart), np.tile(pixels, (len(apart), 1))
    near: Bools = np.tile(within(pixels, size, number("radius", radius)), len(apart))
    near &= shows(start, points)
    free = free_names(start)
    if (2 * np.count_nonzero(near) < len(free) and start.knots is None) or not near.any():
        raise InputError(phrase("targets.shows-nothing", model=model, camera=source.title))
    finite = math.isfinite(apart[0])
    roots = None  # of the inverse covariances of projected points
    if known is not None:
        partials = source.partials(points[near] * TURNED)[2][..., known[0]]
        covariances = partials @ known[1] @ partials.transpose(0, 2, 1)
        mean = float(np.trace(covariances, axis1=1, axis2=2).mean()) / 2
        added = (MIN_RELATIVE_VARIANCE * mean or 1.0) * np.eye(2)
        roots = np.linalg.inv(np.linalg.cholesky(covariances + added))
    shown = Points(points[near], places[near], finite, roots)
    moving = NO_MOTION if intrinsics_only or start.knots is not None else slice(0 if finite else 3, 6)
    found = fitted_in_stages(Moved(start), shown, free, moving)
    images = Points(points, places, finite).imaged(found)[0]
    images[~shows(start, points)] = np.nan
    shape = (len(apart), len(rows), len(columns))
    passed = None if known is None else _passed_on(source, known, shown, found, free, moving)
    # Knots and singular covariances cannot be weighted: such a camera is fixed
    can = passed is not None and start.knots is None and is_covariance(passed)
    return Conversion(
        source=source,
        camera=found.camera.replace(sd=0.0, knot_sd=None, covariance=(free, passed) if can else None),
        difference=CameraDifference(
            cameras=(source.title, found.camera.model),
            size=size,
            unit="m",
            criterion="pixels",
            fitted=Fitted(found.motion, finite and moving != NO_MOTION),
            columns=columns,
            rows=rows,
            distances=apart,
            vectors=(images - places).reshape(*shape, 2),
            covariances=None,
            inside=np.asarray(near.reshape(shape).all(axis=0)),
            shared=0.0,
            test=None,
        ),
        names=tuple(free),
        covariance=passed,
    )


def _known(source: Camera, given: tuple[Sequence[str], ArrayLike] | None) -> tuple[list[int], Floats] | None:
    names = names_of(source)
    if given is not None:
        own, matrix = list(given[0]), np.asarray(given[1], dtype=float)
        if unknown := [name for name in own if name not in names]:
            raise InputError(phrase("targets.no-parameters", model=source.model, names=unknown))
        if matrix.shape != (len(own), len(own)) or not is_covariance(matrix, singular=True):
            raise InputError(phrase("error.covariance-singular"))
        return [names.index(name) for name in own], matrix
    weighted = [k for k, sd in enumerate(source.deviations.tolist()) if 0 < sd < math.inf]
    if not weighted:
        return None
    joint = source.prior_covariance
    return weighted, np.diag(source.deviations[weighted] ** 2) if joint is None else joint


def _passed_on(
    source: Camera,
    known: tuple[list[int], Floats],
    shown: Points,
    found: Moved,
    free: Sequence[str],
    moving: slice,
) -> Floats:
    """Return the covariance of fitted parameters: J S J' with J = -(A'A)^-1 A'B.

    A contains the partials of image points by fitted parameters, B by source parameters. At a fixed pixel,
    the ray moves by dr = -Pi^+ K ds.
    """
    rows, matrix = known
    names = names_of(found.camera)
    _, fitted, _ = shown.linearized(found, [names.index(name) for name in free], moving)
    _, by_u, by_values = source.partials(shown.points * TURNED)
    by_ray = by_u * TURNED
    moved = -np.linalg.pinv(by_ray) @ by_values[..., rows]
    by_source = shown.imaged(found)[1] @ found.motion[:3, :3] @ moved
    if shown.roots is not None:
        by_source = shown.roots @ by_source
    scale = np.linalg.norm(fitted, axis=0)
    scale[scale == 0] = 1.0
    solved = np.linalg.lstsq(fitted / scale, by_source.reshape(len(fitted), -1), rcond=None)[0]
    jacobian = (solved / scale[:, np.newaxis])[: len(free)]
    passed: Floats = jacobian @ matrix @ jacobian.T
    return (passed + passed.T) / 2
