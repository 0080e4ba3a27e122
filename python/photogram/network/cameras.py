"""Cameras: a model with its parameters, known, weighted or unknown, shared by photos."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import (
    LARGEST_SD,
    argument_error,
    is_covariance,
    number,
    one_of,
    shaped,
    text,
)
from photogram.arguments.equality import Valued
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.knots import Knot, checked_knot_sd, checked_knots, knot_names, knot_unknowns
from photogram.show.methods import Brief, Rows
from photogram.words import phrase

Weights = Literal["corrected", "measured"]
"""Of a backward camera: what the standard deviations of images are those of."""

_MEASURED = "_measured"  # What the core calls backward cameras whose residuals lie in the measured image

ImageUnit = Literal["mm", "px"]  # What image coordinates are measured in

CameraRow = tuple[str, list[float], list[float], list[float] | None, list[float] | None]
"""Model, parameters, their standard deviations, the covariance matrix of those that are weighted, row by row,
where these are correlated, and the knots, where there are any: as the core takes a camera."""

_SPLINE = ("order", "nx", "ny", "fov_x_deg")
_GIVEN = frozenset({"c", "f", "fx", "fy", "cx", "cy", "w", "h", "b", "beta", "hx", "hy", *_SPLINE})
"""Parameters that no camera is without; all others are terms of its lens, or 0 in most cameras. Where w and h
are given, cx and cy are counted from the middle of the picture, and may be missing."""


@cache
def _models() -> dict[str, tuple[str, list[tuple[str, int]], int, str, str]]:
    return dict(_photocore.camera_models())


@cache
def _names() -> tuple[str, ...]:
    """Return the models; not those that are a model with weights of its own."""
    return tuple(name for name in _photocore.CAMERAS if not name.endswith(_MEASURED))


@dataclass(frozen=True, eq=False, repr=False)
class Camera(Valued, Brief):
    """A camera of one photo or of many.

    Parameters
    ----------
    model
        The name of its model (`docs/cameras.md`): `perspective`, `brown`, `opencv`, ...
    parameters
        Values by the model's names; lens terms, principal points `xp`, `yp` and `r0` that are missing are 0.
        Lengths are in the unit of image coordinates, the rest as the model says.
    sd
        Standard deviations by the same names, or one for all that may be unknown: infinite (free: the value
        is where the adjustment starts from), 0 (held; so are all that are missing) or between (weighted: the
        value is an observation).
    name
        For reports; a block numbers cameras without one.
    unit
        Of image coordinates, `mm` or `px`. None: `px` where the model has a focal length `f` or `fx`, `mm`
        where it has a principal distance `c`.
    covariance
        Names of parameters that were observed together, as by a calibration of its own, and their (w, w)
        covariance matrix; they need not stand in `sd`.
    weights
        Of a backward model. `corrected`: standard deviations of images are those of the corrected position,
        where residuals are. `measured`: they are those of what was measured, and residuals are what was
        measured less the image of the point. Forward models are `measured` by nature, and take the default.
    knots
        Of `splined_stereographic`: (ny, nx, 2) displacements dx, dy at the knots, rows by rows, in units of
        the stereographic image; None for 0.
    knot_sd
        Their standard deviations along and across the radius from the middle, as those of parameters: one
        for all, (2,), or (ny, nx, 2) radial and tangential.

    Raises
    ------
    InputError
        A model or a parameter that there is not, a principal distance that is missing or zero, values that
        are not finite, negative standard deviations, a constant of the model that is not held, a matrix
        that is not symmetric and positive definite or contradicts `sd`, knots of another shape or of a model
        without them.
    """

    model: str
    parameters: Mapping[str, float]
    sd: Mapping[str, float] | float = 0.0
    name: str = ""
    unit: ImageUnit | None = None
    covariance: tuple[Sequence[str], ArrayLike] | None = None
    weights: Weights = "corrected"
    knots: Floats | None = None
    knot_sd: Floats | None = None
    if TYPE_CHECKING:

        def __init__(
            self,
            model: str,
            parameters: Mapping[str, float],
            sd: Mapping[str, float] | float = 0.0,
            name: str = "",
            unit: ImageUnit | None = None,
            covariance: tuple[Sequence[str], ArrayLike] | None = None,
            weights: Weights = "corrected",
            knots: ArrayLike | None = None,
            knot_sd: ArrayLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        one_of("model", self.model, _names())
        text("name", self.name)
        if self.unit is None:
            self._set("unit", "mm" if "c" in self.names else "px")
        one_of("unit", self.unit, get_args(ImageUnit))
        one_of("weights", self.weights, get_args(Weights))
        forward = self.weights == "measured" and self.direction == "forward"
        require(not forward, f"camera {self.title}", "not-applicable", name="weights", other=self.model)
        self._set("parameters", self._checked_parameters())
        self._set("covariance", self._checked_covariance())
        self._set("sd", self._checked_sd())
        self._set("knots", checked_knots(self.title, self.model, self.parameters, self.knots))
        given = 0.0 if self.knot_sd is None else self.knot_sd
        self._set("knot_sd", checked_knot_sd(self.title, self.knots, given))

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def brief(self) -> tuple[str, Rows]:
        """Return what the camera is in a few lines, as its `repr` and notebooks show it."""
        title = f"Camera {self.name}: {self.model}" if self.name else f"Camera: {self.model}"
        rows = []
        for name, value, sd in zip(self.names, self.values, self.deviations, strict=True):
            if value != 0 or sd > 0 or name in _GIVEN:
                known = "" if sd == 0 else ", free" if math.isinf(sd) else f", sd {sd:.3g}"
                rows.append((name, f"{value:.8g} {self.unit_of(name)}".rstrip() + known))
        if len(rows) < len(self.names):
            rows.append(("", f"all {len(self.names) - len(rows)} others are 0 and held"))
        if self.knots is not None:
            height, width, _ = self.knots.shape
            rows.append(("knots", f"{width} x {height}" + ("" if np.any(self.knot_sd) else ", held")))
        return f"{title}, {self.unit}", rows

    @property
    def names(self) -> tuple[str, ...]:
        """The k parameters of the model, in their order."""
        return tuple(name for name, _ in self._facts[1])

    @property
    def knot_names(self) -> tuple[str, ...]:
        """`dx_i_j`, `dy_i_j` of each knot, row by row, i along columns from 0; none without knots."""
        return knot_names(self.knots)

    @cached_property
    def knot_unknowns(self) -> tuple[Knot, ...]:
        """The knots as unknowns of a block, row by row; none where they are held."""
        return knot_unknowns(self.title, self.knots, self.knot_sd)

    @property
    def powers(self) -> dict[str, int]:
        """Which power of the unit of image coordinates each parameter has."""
        return dict(self._facts[1])

    @property
    def constants(self) -> frozenset[str]:
        """Parameters that are never unknown."""
        names, count = self.names, self._facts[2]
        return frozenset(names[len(names) - count :])

    @property
    def direction(self) -> str:
        """What lens terms are functions of: `forward` ideal coordinates, `backward` measured ones."""
        return self._facts[3]

    @property
    def image_y(self) -> str:
        """Where image coordinates count to: `down` as rows of pixels, or `up`."""
        return self._facts[4]

    @property
    def _facts(self) -> tuple[str, list[tuple[str, int]], int, str, str]:
        return _models()[self.model]

    @property
    def values(self) -> Floats:
        """(k,) the parameters in the order of the model."""
        return np.array([self.parameters[name] for name in self.names])

    @property
    def deviations(self) -> Floats:
        """(k,) their standard deviations: infinite free, 0 held."""
        return np.array([self._sd[name] for name in self.names])

    @property
    def _sd(self) -> Mapping[str, float]:
        return self.sd if isinstance(self.sd, Mapping) else {}

    @property
    def is_held(self) -> bool:
        """Whether all parameters are known."""
        return not self.deviations.any() and not np.any(self.knot_sd)

    @property
    def scale(self) -> float:
        """What a small angle near the axis is multiplied by: the principal distance, without sign."""
        for name in ("c", "f", "fx"):
            if name in self.parameters:
                return abs(self.parameters[name])
        return abs(self.parameters["w"]) / math.tau

    def unit_of(self, name: str) -> str:
        """Return the unit of a parameter; nothing for a plain number."""
        power = dict(self._facts[1])[name]
        return "" if power == 0 else f"{self.unit}" if power == 1 else f"{self.unit}^{power}"

    @property
    def title(self) -> str:
        """What reports call it."""
        return self.name or self.model

    def replace(self, **changes: Any) -> Self:
        """Return the camera with some fields replaced, checked anew."""
        return replace(self, **changes)

    def _named(self, what: str, given: object) -> dict[str, float]:
        where = f"{what} of camera {self.title}"
        if not isinstance(given, Mapping):
            raise argument_error(where, "table", value=given)
        for name in given:
            known = name in self.names
            require(known, where, "unknown", kind="parameter", name=str(name), names=list(self.names))
        return {name: number(f"{name} of camera {self.title}", value) for name, value in given.items()}

    def _checked_parameters(self) -> dict[str, float]:
        given = self._named("parameters", self.parameters)
        needed = _GIVEN - ({"cx", "cy"} if "w" in self.names else set())
        missing = [name for name in self.names if name in needed and name not in given]
        require(not missing, f"parameters of camera {self.title}", "missing", name=", ".join(missing))
        for name, value in given.items():
            require(math.isfinite(value), f"{name} of camera {self.title}", "finite", value=value)
            if value == 0 and name in _GIVEN - {"cx", "cy"}:
                raise InputError(phrase("block.not-zero", name=f"{name} of camera {self.title}", value=value))
        return {name: given.get(name, 0.0) for name in self.names}

    def _checked_sd(self) -> dict[str, float]:
        if isinstance(self.sd, Mapping):
            given = self._named("sd", self.sd)
        else:
            own = number(f"sd of camera {self.title}", self.sd)
            given = {name: own for name in self.names if name not in self.constants}
        if self.covariance is not None:
            names, matrix = self.covariance
            deviations = dict(zip(names, np.sqrt(np.diag(np.asarray(matrix))).tolist(), strict=True))
            for name in given.keys() & deviations.keys() if isinstance(self.sd, Mapping) else ():
                if not math.isclose(given[name], deviations[name], rel_tol=1e-9):
                    raise InputError(phrase("camera.sd-of-covariance", parameter=name, camera=self.title))
            given |= deviations
        for name, value in given.items():
            where = f"sd of {name} of camera {self.title}"
            require(value >= 0, where, "not-negative", value=value)
            if LARGEST_SD < value < math.inf:
                raise InputError(phrase("camera.large-sd", parameter=name, camera=self.title, value=value))
            if value > 0 and name in self.constants:
                raise InputError(phrase("camera.constant", parameter=name, camera=self.title))
        return {name: given.get(name, 0.0) for name in self.names}

    def _checked_covariance(self) -> tuple[tuple[str, ...], Floats] | None:
        if self.covariance is None:
            return None
        where = f"covariance of camera {self.title}"
        try:
            of, matrix = self.covariance
            names = tuple(of)
        except (TypeError, ValueError):
            raise kind_error(where, "a pair of names and a matrix", self.covariance) from None
        self._named("covariance", dict.fromkeys(names, 0.0))
        different = names and len(set(names)) == len(names)
        require(different, where, "kind", kind="a pair of different names and a matrix", value=names)
        checked = shaped(where, matrix, (len(names), len(names)))
        require(is_covariance(checked), where, "covariance")
        return names, checked

    @property
    def prior_covariance(self) -> Floats | None:
        """Covariance matrix of all weighted parameters, in their order; None where none are correlated."""
        if self.covariance is None:
            return None
        names, matrix = self.covariance
        weighted = [name for name in self.names if 0 < self._sd[name] < math.inf]
        whole = np.diag([self._sd[name] ** 2 for name in weighted])
        rows = [weighted.index(name) for name in names]
        own = np.asarray(matrix)
        whole[np.ix_(rows, rows)] = (own + own.T) / 2
        return whole

    def project(self, u: ArrayLike) -> Floats:
        """Return the images of directions.

        Parameters
        ----------
        u
            (n, 3) points or directions in the axes of the photo: x right, y up, z back towards the viewer;
            what is visible has u3 < 0. Only the direction counts.

        Returns
        -------
        (n, 2) image coordinates in the unit of the camera; NaN or infinite where there are none.

        Raises
        ------
        InputError
            Another shape, or what is no number.
        """
        given = shaped("u", u, (len(np.atleast_1d(np.asarray(u))), 3), missing=True)
        return _photocore.camera_images(self.model, self.values, given, self.knots)

    def rays(self, xy: ArrayLike) -> Floats:
        """Return the directions of image positions.

        Parameters
        ----------
        xy
            (n, 2) image coordinates in the unit of the camera.

        Returns
        -------
        (n, 3) unit vectors in the axes of the photo, in front of it; NaN where no direction has the image.

        Raises
        ------
        InputError
            Another shape, or what is no number.
        """
        given = shaped("xy", xy, (len(np.atleast_1d(np.asarray(xy))), 2), missing=True)
        return _photocore.camera_rays(self.model, self.values, given, self.knots)

    def partials(self, u: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Return the images of directions with their partials.

        Parameters
        ----------
        u
            (n, 3) as for :meth:`project`.

        Returns
        -------
        (n, 2) images, (n, 2, 3) partials by u, and (n, 2, k) by the parameters, behind them those by the
        knots, in the order of `names` and `knot_names`; not finite where there are none. Those by constants
        are 0 or without meaning.

        Raises
        ------
        InputError
            Another shape, or what is no number.
        """
        given = shaped("u", u, (len(np.atleast_1d(np.asarray(u))), 3), missing=True)
        images, by_u, own = _photocore.camera_partials(self.model, self.values, given, self.knots)
        if self.knots is None:
            return images, by_u, own
        # d image / d knot = diag(fx, fy) times its weight.
        numbers, weights = _photocore.camera_patches(self.model, self.values, given)
        by_knots = np.zeros((len(given), 2, self.knots.size // 2, 2))
        for axis, scale in enumerate(self.values[:2].tolist()):
            np.put_along_axis(by_knots[:, axis, :, axis], numbers, scale * weights, axis=1)
        return images, by_u, np.concatenate([own, by_knots.reshape(len(given), 2, -1)], axis=2)


def images_of(cameras: Sequence[Camera], which: Indices, directions: Floats) -> Floats:
    """Return (m, 2) images of (m, 3) directions, as for :meth:`Camera.project`, each by its camera's row."""
    images = np.full((len(directions), 2), np.nan)
    for row, camera in enumerate(cameras):
        own = which == row
        images[own] = camera.project(directions[own])
    return images


def camera_rows(cameras: Sequence[Camera]) -> list[CameraRow]:
    """Return cameras as the core takes them."""
    return [
        (
            each.model + (_MEASURED if each.weights == "measured" else ""),
            each.values.tolist(),
            each.deviations.tolist(),
            None if each.prior_covariance is None else each.prior_covariance.ravel().tolist(),
            None if each.knots is None else each.knots.ravel().tolist(),
        )
        for each in cameras
    ]


def rays_of_row(row: CameraRow, xy: Floats) -> Floats:
    """Return (n, 3) the directions of image positions (n, 2), as :meth:`Camera.rays` has them."""
    model, parameters, _, _, knots = row
    return _photocore.camera_rays(model, np.array(parameters), xy, None if knots is None else np.array(knots))
