"""Cameras of digital exposures as YAML in the formats of OpenCV's FileStorage and ROS (camera_info)."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.objects import path_of
from photogram.errors import InputError
from photogram.io.tree import Tree
from photogram.io.yaml_text import camera_info, matrix_lines, read_yaml_text
from photogram.stellar.sky_cameras import BrownCamera, SkyCamera
from photogram.words import phrase

YamlForm = Literal["opencv", "ros"]  # Format of the file

_BROWN = ("k1", "k2", "p1", "p2", "k3")
_FISHEYE = ("k1", "k2", "k3", "k4")
_ROS = {"plumb_bob": _BROWN, "equidistant": _FISHEYE}
_LENSES = {"brown": ("plumb_bob", _BROWN), "kannala_brandt": ("equidistant", _FISHEYE)}
_LENSES["equidistant"] = _LENSES["kannala_brandt"]
WITH_YAML = frozenset(_LENSES)  # Lenses supported in YAML
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
    if camera.lens not in _LENSES:
        raise InputError(phrase("stars.no-yaml", lens=camera.lens, lenses=list(_LENSES)))
    model, terms = _LENSES[camera.lens]
    values = dict(zip(camera.names, camera.values.tolist(), strict=True))
    sd = np.sqrt(np.diag(camera.covariance))
    errors = dict(zip(camera.names, sd.tolist(), strict=True))
    if camera.common_scale:
        errors["fy"] = errors["fx"]
    matrix = np.array([[values["fx"], 0, values["cx"]], [0, values["fy"], values["cy"]], [0, 0, 1]], float)
    coefficients = [values.get(term, 0.0) for term in terms]
    width, height = round(frame[0]), round(frame[1])
    one_of("form", form, get_args(YamlForm))
    if form == "ros":
        return camera_info(name, (width, height), matrix, (model, coefficients))
    order = ("fx", "fy", "cx", "cy", *terms)
    lines = [
        "%YAML:1.0",
        "---",
        f"image_width: {width}",
        f"image_height: {height}",
        f"fisheye_model: {int(model == 'equidistant')}",
        *matrix_lines("camera_matrix", matrix, opencv=True),
        *matrix_lines("distortion_coefficients", [coefficients], opencv=True),
        f"# of {', '.join(order)}",
        *matrix_lines("standard_deviations", [[errors.get(term, 0.0) for term in order]], opencv=True),
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
    fisheye = _is_fisheye(content)
    terms = _FISHEYE if fisheye else _BROWN
    if any(coefficients[len(terms) :]):
        raise distortion.error(phrase("stars.more-terms", terms=list(terms)))
    parameters = {"fx": values[0, 0], "fy": values[1, 1], "cx": values[0, 2], "cy": values[1, 2]}
    parameters |= dict(zip(terms, [*coefficients, *[0.0] * len(terms)], strict=False))
    of, lens = (SkyCamera, "kannala_brandt") if fisheye else (BrownCamera, "brown")
    empty = of.of_field(*frame, 1.0, lens)
    return of(np.array([parameters[name] for name in empty.names]), empty.covariance, lens), frame


def _member(content: Tree, *keys: str) -> Tree:
    return content[next((key for key in keys if key in content), keys[0])]


def _is_fisheye(content: Tree) -> bool:
    """Return whether the file specifies a fisheye model."""
    if "distortion_model" in content:
        return content["distortion_model"].choice(_ROS) == "equidistant"
    return content.get("fisheye_model", 0).value not in (0, False)
