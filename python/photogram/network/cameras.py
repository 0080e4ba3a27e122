"""Cameras: a model with fixed, weighted or free parameters, shared by photos."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import LARGEST_SD, argument_error, matrix_fault, number, one_of, shaped, text
from photogram.arguments.equality import Valued
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error, require
from photogram.arguments.types import NONE, ZERO, Floats, Indices, OptionalArray
from photogram.errors import InputError
from photogram.lazy_dataclasses import converting_dataclass, field, replace
from photogram.network.passages import Knot, checked_knot_sd, checked_knots, knot_names, knot_unknowns
from photogram.summaries import Brief, Rows
from photogram.words import phrase

Weights = Literal["corrected", "measured"]
"""Residual space of a backward camera: corrected or measured image coordinates."""

_MEASURED = "_measured"  # Suffix in the core for backward cameras with residuals in the measured image

ImageUnit = Literal["mm", "px"]  # Unit of image coordinates

CameraRow = tuple[str, list[float], list[float], list[float] | None, list[float] | None]
"""Core row of a camera: model, parameters, standard deviations, covariance matrix of the weighted parameters
row by row (None if uncorrelated), and knots (None without knots)."""

if TYPE_CHECKING:
    from photogram.arguments.types import Converted

    Deviations = Converted[Mapping[str, float] | float, Mapping[str, float]]
else:
    Deviations = Mapping[str, float]

_SPLINE = ("order", "nx", "ny", "fov_x_deg")
_GIVEN = frozenset({"c", "f", "fx", "fy", "cx", "cy", "w", "h", "b", "beta", "hx", "hy", *_SPLINE})
"""Required parameters; all others default to 0. With w and h, cx and cy are counted from the image centre and
may be missing."""


CameraFacts = tuple[str, list[tuple[str, int]], int, str, str]
"""Formula, names of parameters with powers of the image unit, number of constants, direction, image y."""


@cache
def _models() -> dict[str, CameraFacts]:
    return dict(_photocore.camera_models())


def camera_facts(model: str) -> CameraFacts:
    return _models()[model]


@cache
def _names() -> tuple[str, ...]:
    """Return the model names, without variants for weights."""
    return tuple(name for name in _photocore.CAMERAS if not name.endswith(_MEASURED))


def parameter_names(model: str) -> tuple[str, ...]:
    return tuple(name for name, _ in camera_facts(model)[1])


def _model(name: str, value: str) -> str:
    one_of(name, value, _names())
    return value


@converting_dataclass(frozen=True, eq=False, repr=False)
class Camera(Valued, Brief):
    """Camera model with parameters, shared by one photo or many.

    Parameters
    ----------
    model
        Name of the model (`docs/cameras.md`): `perspective`, `brown`, `opencv`, ...
    parameters
        Values by parameter name; missing lens terms, principal points `xp`, `yp` and `r0` are 0. Lengths are
        in the unit of image coordinates, other units depend on the model.
    sd
        Standard deviations by parameter name, or one for all parameters that may be unknown. Infinite: free,
        the value is the initial one. 0 or missing: fixed. Between: weighted, the value is an observation.
    name
        Name in reports; a block numbers cameras without a name.
    unit
        Unit of image coordinates, `mm` or `px`. None: `px` for models with a focal length `f` or `fx`, `mm`
        for models with a principal distance `c`.
    covariance
        Names of jointly observed parameters, e.g. from a separate calibration, and their (w, w) covariance
        matrix. The names may be missing in `sd`.
    weights
        Residual space of a backward model. `corrected`: standard deviations and residuals refer to corrected
        positions. `measured`: they refer to measured positions, and residuals are measured minus computed.
        Forward models are always `measured` and accept the default only.
    knots
        For `splined_stereographic`: (ny, nx, 2) displacements dx, dy at the knots, row by row, in units of
        the stereographic image; None for 0.
    knot_sd
        Standard deviations of the knots along and across the radius from the centre: one for all, (2,), or
        (ny, nx, 2) radial and tangential.

    Raises
    ------
    InputError
        If the model or a parameter does not exist, or a principal distance is missing or zero.
        If a value is not finite, a standard deviation is negative, or a constant of the model is not fixed.
        If a matrix is not symmetric positive definite or contradicts `sd`.
        If knots have another shape or do not belong to the model.
    """

    model: str = field(metadata={"check": _model})
    parameters: Mapping[str, float]
    sd: Deviations = field(default=ZERO)
    name: str = field(default="", metadata={"check": text})
    unit: ImageUnit | None = None
    covariance: tuple[Sequence[str], ArrayLike] | None = None
    weights: Weights = "corrected"
    knots: OptionalArray = field(default=NONE)
    knot_sd: OptionalArray = field(default=NONE)

    def __post_init__(self) -> None:
        check_fields(self)
        if self.unit is None:
            vars(self)["unit"] = "mm" if "c" in self.names else "px"
        forward = self.weights == "measured" and self.direction == "forward"
        require(not forward, f"camera {self.title}", "not-applicable", name="weights", other=self.model)
        own = vars(self)
        own["parameters"] = self._checked_parameters()
        own["covariance"] = self._checked_covariance()
        own["sd"] = self._checked_sd()
        own["knots"] = checked_knots(self.title, self.model, self.parameters, self.knots)
        given = 0.0 if self.knot_sd is None else self.knot_sd
        own["knot_sd"] = checked_knot_sd(self.title, self.knots, given)

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the camera, as shown by its `repr` and in notebooks."""
        title = f"Camera {self.name}: {self.model}" if self.name else f"Camera: {self.model}"
        rows = []
        for name, value, sd in zip(self.names, self.values, self.deviations, strict=True):
            if value != 0 or sd > 0 or name in _GIVEN:
                code = f"brief.parameter.{'fixed' if sd == 0 else 'free' if math.isinf(sd) else 'weighted'}"
                unit = f" {self.unit_of(name)}".rstrip()
                rows.append((name, str(phrase(code, value=float(value), unit=unit, sd=float(sd)))))
        if len(rows) < len(self.names):
            rows.append(("", str(phrase("brief.zero", n=len(self.names) - len(rows)))))
        if self.knots is not None:
            height, width, _ = self.knots.shape
            code = f"brief.knots.{'free' if np.any(self.knot_sd) else 'fixed'}"
            rows.append(("knots", str(phrase(code, width=width, height=height))))
        return f"{title}, {self.unit}", rows

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the k parameters, in the order of the model."""
        return parameter_names(self.model)

    @property
    def knot_names(self) -> tuple[str, ...]:
        """Names `dx_i_j`, `dy_i_j` of the knots, row by row, column i from 0; may be empty."""
        return knot_names(self.knots)

    @cached_property
    def knot_unknowns(self) -> tuple[Knot, ...]:
        """Knots as unknowns of a block, row by row; empty if they are fixed."""
        return knot_unknowns(self.title, self.knots, self.knot_sd)

    @property
    def powers(self) -> dict[str, int]:
        """Power of the unit of image coordinates in the unit of each parameter."""
        return dict(camera_facts(self.model)[1])

    @property
    def constants(self) -> frozenset[str]:
        """Parameters that are always fixed."""
        names, count = self.names, camera_facts(self.model)[2]
        return frozenset(names[len(names) - count :])

    @property
    def direction(self) -> str:
        """Argument of the lens terms: ideal coordinates (`forward`) or measured (`backward`)."""
        return camera_facts(self.model)[3]

    @property
    def image_y(self) -> str:
        """Direction in which image y increases: `down` as pixel rows, or `up`."""
        return camera_facts(self.model)[4]

    @property
    def values(self) -> Floats:
        """(k,) parameter values in the order of the model."""
        return np.array([self.parameters[name] for name in self.names])

    @property
    def deviations(self) -> Floats:
        """(k,) standard deviations in the order of the model: infinite is free, 0 is fixed."""
        return np.array([*self.sd.values()])

    @property
    def is_held(self) -> bool:
        """Whether all parameters and knots are fixed."""
        return not self.deviations.any() and not np.any(self.knot_sd)

    @property
    def scale(self) -> float:
        """Image scale near the axis: the absolute principal distance."""
        for name in ("c", "f", "fx"):
            if name in self.parameters:
                return abs(self.parameters[name])
        return abs(self.parameters["w"]) / math.tau

    def unit_of(self, name: str) -> str:
        """Return the unit of a parameter; empty for a dimensionless number."""
        power = self.powers[name]
        return "" if power == 0 else f"{self.unit}" if power == 1 else f"{self.unit}^{power}"

    @property
    def title(self) -> str:
        """Name of the camera in reports."""
        return self.name or self.model

    def replace(self, **changes: Any) -> Self:
        """Return a validated camera with some fields replaced."""
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
            rule = "not-zero" if name in _GIVEN - {"cx", "cy"} else "finite"
            number(f"{name} of camera {self.title}", value, rule)
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
                if not math.isclose(value := given[name], wanted := deviations[name], rel_tol=1e-9):
                    fields = {"parameter": name, "camera": self.title, "value": value, "wanted": wanted}
                    raise InputError(phrase("camera.sd-of-covariance", **fields))
            given |= deviations
        for name, value in given.items():
            where = f"sd of {name} of camera {self.title}"
            require(value >= 0, where, "not-negative", value=value)
            if LARGEST_SD < value < math.inf:
                raise InputError(phrase("camera.large-sd", parameter=name, camera=self.title, value=value))
            if value > 0 and name in self.constants:
                raise InputError(phrase("camera.constant", parameter=name, camera=self.title, value=value))
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
        if fault := matrix_fault(checked):
            raise InputError(phrase("error.at", what=where, message=fault))
        return names, checked

    @property
    def prior_covariance(self) -> Floats | None:
        """Covariance matrix of all weighted parameters, in order; None if uncorrelated."""
        if self.covariance is None:
            return None
        names, matrix = self.covariance
        weighted = [name for name, sd in self.sd.items() if 0 < sd < math.inf]
        whole = np.diag([self.sd[name] ** 2 for name in weighted])
        rows = [weighted.index(name) for name in names]
        own = np.asarray(matrix)
        whole[np.ix_(rows, rows)] = (own + own.T) / 2
        return whole

    def project(self, u: ArrayLike) -> Floats:
        """Project directions into the image.

        Parameters
        ----------
        u
            (n, 3) points or directions in the axes of the photo: x right, y up, z back towards the viewer;
            visible points have u3 < 0. Only the direction counts.

        Returns
        -------
        (n, 2) image coordinates in the unit of the camera; NaN or infinite if undefined.

        Raises
        ------
        InputError
            If the shape is wrong or a value is not a number.
        """
        given = shaped("u", u, (None, 3), missing=True)
        return _photocore.camera_images(self.model, self.values, given, self.knots)

    def rays(self, xy: ArrayLike) -> Floats:
        """Compute the directions of image positions.

        Parameters
        ----------
        xy
            (n, 2) image coordinates in the unit of the camera.

        Returns
        -------
        (n, 3) unit vectors in the axes of the photo, in front of it; NaN if no direction has the image.

        Raises
        ------
        InputError
            If the shape is wrong or a value is not a number.
        """
        given = shaped("xy", xy, (None, 2), missing=True)
        return _photocore.camera_rays(self.model, self.values, given, self.knots)

    def partials(self, u: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Project directions into the image, with partial derivatives.

        Parameters
        ----------
        u
            (n, 3) as for :meth:`project`.

        Returns
        -------
        (n, 2) images, (n, 2, 3) partial derivatives by u, and (n, 2, k) by the parameters and then the
        knots, in the order of `names` and `knot_names`. Undefined values are not finite. Derivatives by
        constants are 0 or meaningless.

        Raises
        ------
        InputError
            If the shape is wrong or a value is not a number.
        """
        given = shaped("u", u, (None, 3), missing=True)
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
    """Project (m, 3) directions, each with the camera of its row; (m, 2) as :meth:`Camera.project`."""
    images = np.full((len(directions), 2), np.nan)
    for row, camera in enumerate(cameras):
        own = which == row
        images[own] = camera.project(directions[own])
    return images


def camera_rows(cameras: Sequence[Camera]) -> list[CameraRow]:
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
    """Compute (n, 3) directions of image positions (n, 2), as :meth:`Camera.rays`."""
    model, parameters, _, _, knots = row
    return _photocore.camera_rays(model, np.array(parameters), xy, None if knots is None else np.array(knots))
