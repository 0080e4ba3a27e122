"""Cameras of digital exposures with any lens and covariance, in pixels, and their files (JSON, YAML)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain
from pathlib import Path
from typing import Any, Literal, Self, get_args

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import argument_error, one_of, truth_value
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import path_of, require_name
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError
from photogram.io.json import read_json, to_json
from photogram.io.tree import Tree
from photogram.io.yaml_text import camera_info, matrix_lines, read_yaml_text
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.cameras import Camera, parameter_names
from photogram.network.equivalent_cameras import opencv_lens
from photogram.stellar.parameters import COMMON, INTERIOR
from photogram.stellar.sky import TAU
from photogram.words import phrase


@dataclass(frozen=True)
class Lens:
    model: str  # Camera model of `docs/cameras.md`
    # Parameters in the order of reports and files, fx, fy, cx, cy first; missing model parameters are zero
    names: tuple[str, ...]
    formula: str  # Distance from the principal point in principal distances, for reports
    widest: float = math.tau  # The field of view (radians) at and above which images are undefined
    # Groups of terms for tests, in the order of removal if insignificant
    groups: tuple[tuple[str, ...], ...] = ()

    @property
    def order(self) -> tuple[str, ...]:
        return parameter_names(self.model)

    @property
    def places(self) -> list[int]:
        return [self.order.index(name) for name in self.names]

    @property
    def held(self) -> tuple[str, ...]:
        """Terms that are zero unless a camera file sets them: without them the lens is the projection."""
        return tuple(name for name in self.names[4:] if name not in chain(*self.groups))


_SQUARE = ("fx", "fy", "cx", "cy")
_BROWN = ("k1", "k2", "p1", "p2", "k3")
_KANNALA_BRANDT = ("k1", "k2", "k3", "k4")

LENSES: dict[str, Lens] = {
    "brown": Lens(
        "full_opencv",
        (*_SQUARE, "k1", "k2", "k3", "p1", "p2"),
        "tan theta (1 + k1 r^2 + k2 r^4 + k3 r^6) and decentering",
        math.pi,
        (("k3",), ("k2",), ("k1",), ("p1", "p2")),
    ),
    "equidistant": Lens("opencv_fisheye", _SQUARE, "theta"),
    "equisolid": Lens("equisolid", (*_SQUARE, "k1", "k2"), "2 sin(theta/2)"),
    "stereographic": Lens("stereographic", (*_SQUARE, "k1", "k2"), "2 tan(theta/2)"),
    "kannala_brandt": Lens(
        "opencv_fisheye",
        (*_SQUARE, *_KANNALA_BRANDT),
        "theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)",
        groups=(("k4",), ("k3",), ("k2",), ("k1",)),
    ),
}
"""Lenses by name in files and reports."""


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


def camera_of_blocks(
    model: str, names: Sequence[str], values: Floats, covariance: Floats, name: str, weighted: bool
) -> Camera:
    """Return a camera with parameters weighted by their covariance; those with zero variance are fixed."""
    truth_value("weighted", weighted)
    rows = np.flatnonzero((np.diag(covariance) > 0) & weighted).tolist()
    observed = ([names[row] for row in rows], covariance[np.ix_(rows, rows)]) if rows else None
    return Camera(model, dict(zip(names, values.tolist(), strict=True)), covariance=observed, name=name)


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
        require_name("lens", self.lens, LENSES)
        count = len(self.names)
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
        require_name("lens", lens, LENSES)
        facts = LENSES[lens]
        if not 0 < field_of_view < facts.widest:
            field, widest = math.degrees(field_of_view), math.degrees(facts.widest)
            raise InputError(phrase("stars.field-of-view", field=field, lens=lens, widest=widest))
        values = np.zeros(len(facts.names))
        values[:2] = 1.0
        camera = cls(values, np.zeros((len(values), len(values))), lens)
        edge = camera.images(np.array([[math.sin(0.5 * field_of_view), 0.0, math.cos(0.5 * field_of_view)]]))
        f = 0.5 * width / float(edge[0, 0])
        return replace(camera, values=np.array([f, f, 0.5 * width, 0.5 * height, *values[4:]]))

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
        values[self.facts.places] = self.values
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
        return np.asarray(found[:, :, self.facts.places], float)

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
        matrix = self.covariance.copy()
        if self.common_scale and self.known[0]:
            matrix[1, :], matrix[:, 1] = matrix[0, :], matrix[:, 0]
            matrix[1, 1] = matrix[0, 0] + _EQUAL**2
        return camera_of_blocks(self.facts.model, self.names, self.values, matrix, name, weighted)

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
    def read(cls, path: Path) -> Self:
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
        return cls(values, covariance, lens, document.get("common_scale", False).value is True)


def _turned(rays: Floats) -> Floats:
    return np.ascontiguousarray(np.asarray(rays, float) * (1.0, -1.0, -1.0))


YamlForm = Literal["opencv", "ros"]  # Format of the file

_MODELS = {"plumb_bob": ("brown", _BROWN), "equidistant": ("kannala_brandt", _KANNALA_BRANDT)}
WITH_YAML = ("brown", "equidistant", "kannala_brandt")  # Lenses supported in YAML
_MATRIX = ("camera_matrix", "Camera_Matrix", "K")
_DISTORTION = ("distortion_coefficients", "Distortion_Coefficients", "dist_coeffs", "D")


def to_yaml(camera: SkyCamera, frame: tuple[float, float], form: YamlForm, name: str = "camera") -> bytes:
    """Return a camera as a YAML file.

    Parameters
    ----------
    camera
        Camera with a `brown`, `equidistant` or `kannala_brandt` lens. Pixel coordinates are not converted. In
        OpenCV and ROS the centre of the first pixel is (0, 0).
    frame
        Width and height, pixels.
    form
        `opencv`: camera_matrix, distortion_coefficients (four of `cv2.fisheye`), image_width, image_height
        and the standard deviations. `ros`: camera_info with distortion_model plumb_bob or equidistant.
    name
        Camera name in ROS.

    Raises
    ------
    InputError
        If the lens is not supported.
    """
    if camera.lens not in WITH_YAML:
        raise InputError(phrase("stars.no-yaml", lens=camera.lens, lenses=list(WITH_YAML)))
    one_of("form", form, get_args(YamlForm))
    known, (width, height) = camera.as_camera(), map(round, frame)
    lens = opencv_lens(known)
    assert lens is not None
    model, coefficients = lens.ros
    if form == "ros":
        return camera_info(name, (width, height), lens.matrix, lens.ros)
    order = (*_SQUARE, *_MODELS[model][1])
    sd = dict(zip(known.names, known.deviations.tolist(), strict=True))
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {width}",
        f"image_height: {height}",
        f"fisheye_model: {int(lens.fisheye)}",
        *matrix_lines("camera_matrix", lens.matrix, opencv=True),
        *matrix_lines("distortion_coefficients", [coefficients], opencv=True),
        f"# of {', '.join(order)}",
        *matrix_lines("standard_deviations", [[sd[name] for name in order]], opencv=True),
    ]
    return ("\n".join(lines) + "\n").encode()


def read_yaml(path: Path) -> tuple[SkyCamera, tuple[float, float]]:
    """Read a camera from a YAML file of OpenCV or ROS.

    Returns
    -------
    Camera without covariance, since YAML contains no correlations, and frame width and height in pixels.

    Raises
    ------
    InputError
        If the file cannot be read, has another format, or contains unsupported lens terms.
    """
    path = path_of("path", path)
    content = Tree(read_yaml_text(path), path)
    matrix = _member(content, *_MATRIX)
    values = np.reshape(matrix["data"].numbers(9), (3, 3))
    distortion = _member(content, *_DISTORTION)
    coefficients = distortion["data"].numbers()
    frame = (
        float(_member(content, "image_width", "image_Width", "width").whole(1)),
        float(_member(content, "image_height", "image_Height", "height").whole(1)),
    )
    if values[0, 1] or not np.array_equal(values[[1, 2, 2, 2], [0, 0, 1, 2]], [0, 0, 0, 1]):
        raise matrix.error(phrase("stars.camera-matrix", value=str(values.tolist())))
    # The distortion model that the file specifies
    model = "plumb_bob" if content.get("fisheye_model", 0).value in (0, False) else "equidistant"
    if "distortion_model" in content:
        model = content["distortion_model"].choice(_MODELS)
    lens, terms = _MODELS[model]
    if any(coefficients[len(terms) :]):
        raise distortion.error(phrase("stars.more-terms", terms=list(terms)))
    parameters = {"fx": values[0, 0], "fy": values[1, 1], "cx": values[0, 2], "cy": values[1, 2]}
    parameters |= dict(zip(terms, [*coefficients, *[0.0] * len(terms)], strict=False))
    found = np.array([parameters[name] for name in LENSES[lens].names])
    return SkyCamera(found, np.zeros((len(found), len(found))), lens), frame


def _member(content: Tree, *keys: str) -> Tree:
    return content[next((key for key in keys if key in content), keys[0])]
