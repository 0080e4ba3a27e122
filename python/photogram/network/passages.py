"""Image transformations: boards that bend, and splines of cameras with knots on a stereographic grid."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import argument_error, elements, frozen, names, numbers, shaped
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.unknowns import Numbers, Unknown
from photogram.words import phrase


class Bend(Numbers):
    """Deflection w of a board, two lengths: at its centre along x and along y."""

    KIND = "bend"


@dataclass(frozen=True, eq=False)
class Passage:
    """Base class of image transformations."""

    KIND: ClassVar[str] = ""
    """Name of the type in the core."""

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        raise NotImplementedError

    def of(self, points: Mapping[str, int], photos: Mapping[str, int]) -> list[int]:
        """Return the rows of the points, photos or cameras concerned.

        Raises
        ------
        InputError
            If a point or photo is not in the block.
        """
        raise NotImplementedError

    def numbers(self) -> Floats:
        """Return the numbers for the core that are not unknowns."""
        return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Figure(Passage):
    """Points with given positions that are displaced by `w_1 e_1 + w_2 e_2`.

    Parameters
    ----------
    bend
        Unknown w, one object for all points.
    points
        n names. The given coordinates are fixed (`point_sd` 0) in rectangular space. The points are observed
        in images only.
    shifts
        (n, 2, 3) e_1 and e_2 of each point, in the axes of the block.
    """

    KIND = "figure"

    bend: Bend
    points: Sequence[str]
    shifts: ArrayLike

    def __post_init__(self) -> None:
        check_fields(self, "a figure")
        points = tuple(names("points of a figure", self.points))
        shifts = shaped(f"shifts of the {self.title}", self.shifts, (len(points), 2, 3), "finite")
        vars(self).update(points=points, shifts=shifts)

    @property
    def title(self) -> str:
        """Title in reports and messages."""
        return f"{self.KIND} {self.bend.name}"

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Unknowns of the transformation."""
        return (self.bend,)

    def of(self, points: Mapping[str, int], photos: Mapping[str, int]) -> list[int]:
        """Return the rows of the points."""
        if missing := [name for name in self.points if name not in points]:
            raise argument_error(f"figure {self.bend.name}", "absent", kind="point", name=missing[0])
        return [points[name] for name in self.points]

    def numbers(self) -> Floats:
        """Return the shifts, point by point."""
        return np.asarray(self.shifts, dtype=float).ravel()


def checked_passages(passages: object) -> tuple[Passage, ...]:
    checked = elements("passages", passages, Passage)
    for row, each in enumerate(checked):
        if not each.KIND:
            raise kind_error(f"passages[{row}]", "a Figure or a Scan", each)
    return checked


KNOTTED = "splined_stereographic"  # The only model with knots
MOST = 10_000  # Maximum number of knots along columns or rows


@dataclass(frozen=True, eq=False)
class Knot(Numbers):
    """Unknown displacements dx, dy at a camera knot, in units of the stereographic image.

    Standard deviations are 0 (fixed), or infinite (free or weighted by `covariance`).
    """

    KIND = "knot"

    covariance: Floats | None = None  # (2, 2) of the observation that both are 0; None without it


@dataclass(frozen=True, eq=False)
class Knots(Passage):
    """Image transformation by the spline of a camera; knots are ordered row by row."""

    KIND = "knots"

    camera: int
    knots: tuple[Knot, ...]

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        return self.knots

    def of(self, points: Mapping[str, int], photos: Mapping[str, int]) -> list[int]:
        return [self.camera]


def knot_unknowns(camera: str, knots: Floats | None, sd: Floats | None) -> tuple[Knot, ...]:
    """Return camera knots (ny, nx, 2) as unknowns, row by row; empty if all are fixed."""
    if knots is None or sd is None or not sd.any():
        return ()
    rows, columns, _ = knots.shape
    j, i = np.mgrid[:rows, :columns]
    away = np.stack([2 * i - columns + 1, 2 * j - rows + 1], axis=2).astype(float)
    away[(away == 0).all(axis=2)] = (1.0, 0.0)
    radial = away / np.linalg.norm(away, axis=2, keepdims=True)
    across = radial[..., ::-1] * [-1.0, 1.0]
    axes = np.stack([radial, across], axis=3)
    with np.errstate(invalid="ignore"):
        covariances = np.einsum("jiak,jik,jibk->jiab", axes, sd**2, axes)
    return tuple(
        Knot(
            f"{camera} {column}_{row}",
            knots[row, column],
            np.inf if own.any() else 0.0,
            covariances[row, column] if 0 < own[0] < np.inf else None,
        )
        for row in range(rows)
        for column, own in enumerate(sd[row])
    )


def checked_knots(
    title: str, model: str, parameters: Mapping[str, float], knots: ArrayLike | None
) -> Floats | None:
    """Return validated knots (ny, nx, 2); None for a model without knots."""
    where = f"knots of camera {title}"
    if model != KNOTTED:
        require(knots is None, where, "not-applicable", name="knots", other=model)
        return None
    order, fov = parameters["order"], parameters["fov_x_deg"]
    require(order in (2.0, 3.0), f"order of camera {title}", "whole-range", low=2, high=3, value=order)
    for name in ("nx", "ny"):
        count, least = parameters[name], int(order) + 1
        good = count.is_integer() and least <= count <= MOST
        require(good, f"{name} of camera {title}", "whole-range", low=least, high=MOST, value=count)
    require(0 < fov < 360, f"fov_x_deg of camera {title}", "range", low=0, high=360, value=fov)
    shape = (int(parameters["ny"]), int(parameters["nx"]), 2)
    return shaped(where, 0.0 if knots is None else knots, shape, "finite")


def checked_knot_sd(title: str, knots: Floats | None, given: ArrayLike) -> Floats | None:
    """Return radial and tangential sd of knots, (ny, nx, 2); None for a model without knots."""
    where = f"knot_sd of camera {title}"
    sd = numbers(where, given)
    if knots is None:
        require(not sd.any(), where, "requires", name="knot_sd", other="knots")
        return None
    sd = shaped(where, np.broadcast_to(sd, knots.shape) if sd.shape == (2,) else sd, knots.shape, "sd")
    kinds = np.sign(sd) + np.isinf(sd)
    if (mixed := kinds[..., 0] != kinds[..., 1]).any():
        raise InputError(phrase("block.knot-sd", camera=title, sd=sd[mixed][0].tolist()))
    return frozen(sd)


def knot_names(knots: Floats | None) -> tuple[str, ...]:
    """Return knot names `dx_i_j`, `dy_i_j`, row by row, i along columns; may be empty."""
    if knots is None:
        return ()
    rows, columns, _ = knots.shape
    return tuple(f"d{axis}_{i}_{j}" for j in range(rows) for i in range(columns) for axis in "xy")


def beyond_knots(parameters: Mapping[str, float], u: Floats) -> Bools:
    """Return whether (n, 3) directions are beyond the knots and therefore extrapolated."""
    order = parameters["order"]
    places = 2 * u[:, :2] * [1, -1] / (np.linalg.norm(u, axis=1) - u[:, 2])[:, np.newaxis]
    per_place = (parameters["nx"] - order) / (4 * math.tan(math.radians(parameters["fov_x_deg"]) / 4))
    reach = (np.array([parameters["nx"], parameters["ny"]]) - order) / 2 / per_place
    return np.asarray(~(np.abs(places) <= reach).all(axis=1))
