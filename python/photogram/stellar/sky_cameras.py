"""Calibrated cameras of digital exposures with covariance, of any lens, in pixels, and their files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import argument_error, truth_value
from photogram.arguments.fields import check_fields
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.json import read_json, to_json
from photogram.io.tree import Tree
from photogram.lazy_dataclasses import dataclass
from photogram.network.cameras import Camera
from photogram.stellar.lenses import LENSES, Lens, lens_named
from photogram.stellar.parameters import COMMON, INTERIOR
from photogram.stellar.sky import TAU
from photogram.words import phrase


def weight_of(covariance: Floats) -> Floats:
    """Return the weight matrix of a covariance with rows of different magnitude.

    InputError: if the covariance is not positive definite.
    """
    sd = np.sqrt(np.diag(covariance))
    try:
        lower = np.linalg.cholesky(covariance / np.outer(sd, sd))
    except np.linalg.LinAlgError:
        raise argument_error("covariance", "covariance") from None
    root = np.linalg.solve(lower, np.diag(1.0 / sd))
    return np.asarray(root.T @ root, float)


def read_camera(document: Tree, names: Sequence[str]) -> tuple[Floats, Floats]:
    """Return camera parameters and their covariance, zero for unlisted parameters.

    InputError: if a parameter is missing or unknown, a number is invalid, or a variance is negative.
    """
    members = [document["parameters"][name] for name in names]
    values = [member["value"] if isinstance(member.value, dict) else member for member in members]
    order, matrix = document["covariance"]["order"], document["covariance"]["matrix"]
    rows = [names.index(name.choice(names)) for name in order]
    block = np.array([row.numbers(len(rows)) for row in matrix]).reshape(-1, len(rows))
    if len(block) != len(rows) or not (np.diag(block) >= 0).all():
        raise matrix.error(phrase("error.covariance"))
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(rows, rows)] = block
    return np.array([value.number() for value in values]), covariance


_EQUAL = 1e-4  # Allowed difference of fy and fx in blocks, pixels, if the two were one parameter
_KINDS = ("brown camera", "sky camera")


@dataclass(frozen=True, eq=False)
class SkyCamera:
    """Camera of digital exposures: x counts right, y down.

    Attributes
    ----------
    values
        (k,) parameters in the order of `names`; principal distances and principal point in pixels.
    covariance
        (k, k); zero for fixed parameters, and for fy with a `common_scale`.
    lens
        Name of the lens (`photogram.stellar.LENSES`).
    common_scale
        Whether fx is the principal distance of both axes.

    Raises
    ------
    InputError
        If the lens is unknown, or has another number of parameters.
    """

    values: Floats
    covariance: Floats
    lens: str = "brown"
    common_scale: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        count = len(lens_named(self.lens).names)
        if np.shape(self.values) != (count,) or np.shape(self.covariance) != (count, count):
            shapes = {"values": np.shape(self.values), "covariance": np.shape(self.covariance)}
            fields = {name: str(shape) for name, shape in shapes.items()}
            raise InputError(phrase("stars.parameters", lens=self.lens, names=self.names, **fields))

    @classmethod
    def of_field(cls, width: float, height: float, field_of_view: float, lens: str = "brown") -> Self:
        """Return an ideal camera from frame size (pixels) and horizontal field (radians).

        Raises
        ------
        InputError
            If the lens is unknown, or does not reach the field of view.
        """
        facts = lens_named(lens)
        if not 0 < field_of_view < facts.widest:
            field, widest = math.degrees(field_of_view), math.degrees(facts.widest)
            raise InputError(phrase("stars.field-of-view", field=field, lens=lens, widest=widest))
        f = 0.5 * width / facts.radius(0.5 * field_of_view)
        values = np.zeros(len(facts.names))
        values[:4] = f, f, 0.5 * width, 0.5 * height
        return cls(values, np.zeros((len(values), len(values))), lens)

    @property
    def facts(self) -> Lens:
        """Lens of the camera."""
        return LENSES[self.lens]

    @property
    def names(self) -> tuple[str, ...]:
        """(k,) names of the parameters."""
        return LENSES[self.lens].names

    @property
    def kind(self) -> tuple[str, bool]:
        """Camera type of the core."""
        return self.facts.model, self.common_scale

    @property
    def model_values(self) -> Floats:
        """The parameters of the model of `docs/cameras.md`, in its order."""
        values = np.zeros(len(self.facts.order))
        values[list(self.facts.places)] = self.values
        return values

    @property
    def common(self) -> Floats:
        """(17,) core parameters: model parameters, zeros, refraction coefficients."""
        common = np.zeros(len(COMMON))
        common[: len(self.facts.order)] = self.model_values
        common[len(INTERIOR) :] = TAU
        return common

    @property
    def known(self) -> Bools:
        """(k,) whether parameters have a mean error."""
        return np.asarray(np.diag(self.covariance) > 0)

    def rays(self, xy: Floats) -> Floats:
        """Return unit directions (n, 3) of images (n, 2), NaN if undefined.

        Axes are x right, y down, z along the axis.
        """
        rays = _photocore.camera_rays(self.facts.model, self.model_values, np.asarray(xy, float))
        return np.asarray(rays * (1.0, -1.0, -1.0), float)

    def images(self, rays: Floats) -> Floats:
        """Return images (n, 2), pixels, of directions as in `rays`."""
        return _photocore.camera_images(self.facts.model, self.model_values, _turned(rays))

    def partials(self, rays: Floats) -> Floats:
        """Return partials (n, 2, k), pixels, of images of directions by the parameters."""
        _, _, found = _photocore.camera_partials(self.facts.model, self.model_values, _turned(rays))
        return np.asarray(found[:, :, list(self.facts.places)], float)

    def largest_angle(self, frame: tuple[float, float]) -> float:
        """Return the largest axis angle (rad) in a frame; pi if undefined for a part."""
        x, y = (np.linspace(0, size, 9) for size in frame)
        rim = [(a, b) for a in x for b in (0.0, frame[1])] + [(a, b) for a in (0.0, frame[0]) for b in y]
        cosine = self.rays(np.array(rim))[:, 2]
        return math.acos(max(-1.0, min(1.0, float(cosine.min())))) if np.isfinite(cosine).all() else math.pi

    def as_camera(self, name: str = "", *, weighted: bool = True) -> Camera:
        """Return the camera of blocks with the model of its lens: columns, rows, y down.

        Parameters
        ----------
        name
            Name in reports.
        weighted
            Whether parameters are weighted by their full covariance; otherwise they are fixed. Fixed
            parameters remain fixed. With a common scale, fy equals fx within a ten-thousandth of a pixel.
        """
        truth_value("weighted", weighted)
        names, model = self.names, self.facts.model
        values = dict(zip(names, self.values.tolist(), strict=True))
        if not (weighted and self.known.any()):
            return Camera(model, values, name=name)
        matrix, known = self.covariance.copy(), self.known
        if self.common_scale and known[0]:
            matrix[1, :], matrix[:, 1] = matrix[0, :], matrix[:, 0]
            matrix[1, 1] = matrix[0, 0] + _EQUAL**2
            known = known | (np.arange(len(names)) == 1)
        rows = np.flatnonzero(known)
        covariance = [names[i] for i in rows], matrix[np.ix_(rows, rows)]
        return Camera(model, values, covariance=covariance, name=name)

    def document(self) -> dict[str, Any]:
        """Return the members of the JSON document."""
        brown = self.lens == "brown"
        return {
            "program": f"photogram {_photocore.__version__}",
            "kind": _KINDS[0 if brown else 1],
            **({} if brown else {"lens": self.lens, "model": self.facts.model}),
            "unit": "pixel",
            "common_scale": self.common_scale,
            "parameters": dict(zip(self.names, self.values.tolist(), strict=True)),
            "covariance": {"order": self.names, "matrix": self.covariance},
        }

    def to_json(self) -> bytes:
        """Return the camera as a JSON document: a weighted prior of later adjustments."""
        return to_json(self.document())

    @classmethod
    def read(cls, path: Path) -> SkyCamera:
        """Read a camera file of `to_json`.

        Raises
        ------
        InputError
            If the file cannot be read, or is another document.
        """
        document = read_json(path)
        document["kind"].choice(_KINDS)
        lens = document.get("lens", "brown").choice(LENSES)
        values, covariance = read_camera(document, LENSES[lens].names)
        of = BrownCamera if lens == "brown" else SkyCamera
        return of(values, covariance, lens, document.get("common_scale", False).value is True)


def _turned(rays: Floats) -> Floats:
    return np.ascontiguousarray(np.asarray(rays, float) * (1.0, -1.0, -1.0))


class BrownCamera(SkyCamera):
    """Pinhole camera with Brown's distortion: `SkyCamera` of the lens `brown`.

    With (u, v) = (X, Y) / Z and r^2 = u^2 + v^2,

        x = fx (u (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 u v + p2 (r^2 + 2 u^2)) + cx.

    The formula of y has fy, cy, and p1, p2 exchanged. `values` are fx, fy, cx, cy, k1, k2, k3, p1, p2.
    """

    NAMES = LENSES["brown"].names
