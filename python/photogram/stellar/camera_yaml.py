"""Cameras of digital exposures as YAML: the form of OpenCV's FileStorage and that of ROS (camera_info).

Only the YAML that these two write is read and written: mappings, lists of numbers, text. It needs no library.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_lines
from photogram.io.numbers import finite_number
from photogram.lazy_dataclasses import dataclass
from photogram.messages import quoted
from photogram.stellar.sky_cameras import BrownCamera, SkyCamera

YamlForm = Literal["opencv", "ros"]
"""What the file is for."""

_BROWN = ("k1", "k2", "p1", "p2", "k3")
_FISHEYE = ("k1", "k2", "k3", "k4")
_ROS = {"plumb_bob": _BROWN, "equidistant": _FISHEYE}
_LENSES = {"brown": ("plumb_bob", _BROWN), "kannala_brandt": ("equidistant", _FISHEYE)}
_LENSES["equidistant"] = _LENSES["kannala_brandt"]
WITH_YAML = frozenset(_LENSES)
"""Lenses that have a form in YAML."""
_DEEPEST = 3
_KEY = re.compile(r"( *)([A-Za-z_][\w.]*) *:(?: +(.*))?$")


def to_yaml(camera: SkyCamera, frame: tuple[float, float], form: YamlForm, name: str = "camera") -> bytes:
    """Return a camera as a YAML file: `brown`, `equidistant` and `kannala_brandt` have one.

    Parameters
    ----------
    camera
        The camera. Pixels stay as they are counted; in OpenCV and ROS the centre of the first one is (0, 0).
    frame
        Width and height, pixels.
    form
        `opencv`: camera_matrix, distortion_coefficients (of `cv2.fisheye` those four), image_width,
        image_height and the standard deviations; `ros`: camera_info with distortion_model plumb_bob or
        equidistant.
    name
        What ROS calls it.

    Raises
    ------
    InputError
        The lens has no such form.
    """
    if camera.lens not in _LENSES:
        raise InputError(
            f"a camera of the lens {camera.lens} has no YAML form; lenses that have are {', '.join(_LENSES)}"
        )
    model, terms = _LENSES[camera.lens]
    values = dict(zip(camera.names, camera.values.tolist(), strict=True))
    sd = np.sqrt(np.diag(camera.covariance))
    errors = dict(zip(camera.names, sd.tolist(), strict=True))
    if camera.common_scale:
        errors["fy"] = errors["fx"]
    matrix = np.array([[values["fx"], 0, values["cx"]], [0, values["fy"], values["cy"]], [0, 0, 1]], float)
    coefficients = np.array([[values.get(term, 0.0) for term in terms]])
    width, height = round(frame[0]), round(frame[1])
    if form == "ros":
        lines = [
            f"image_width: {width}",
            f"image_height: {height}",
            f"camera_name: {_word(name)}",
            *_ros_matrix("camera_matrix", matrix),
            f"distortion_model: {model}",
            *_ros_matrix("distortion_coefficients", coefficients),
            *_ros_matrix("rectification_matrix", np.eye(3)),
            *_ros_matrix("projection_matrix", np.column_stack([matrix, np.zeros(3)])),
        ]
    else:
        order = ("fx", "fy", "cx", "cy", *terms)
        deviations = np.array([[errors.get(each, 0.0) for each in order]])
        lines = [
            "%YAML:1.0",
            "---",
            f"image_width: {width}",
            f"image_height: {height}",
            f"fisheye_model: {int(model == 'equidistant')}",
            *_opencv_matrix("camera_matrix", matrix),
            *_opencv_matrix("distortion_coefficients", coefficients),
            f"# of {', '.join(order)}",
            *_opencv_matrix("standard_deviations", deviations),
        ]
    return ("\n".join(lines) + "\n").encode()


def _word(name: str) -> str:
    if not re.fullmatch(r"[\w.-]+", name):
        raise InputError(f"the name of a camera has letters, digits, dots and hyphens, not {quoted(name)}")
    return name


def _numbers(matrix: Floats) -> str:
    return ", ".join(repr(float(value)) for value in matrix.ravel())


def _ros_matrix(name: str, matrix: Floats) -> list[str]:
    rows, columns = matrix.shape
    return [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{_numbers(matrix)}]"]


def _opencv_matrix(name: str, matrix: Floats) -> list[str]:
    rows, columns = matrix.shape
    head = [f"{name}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {columns}", "   dt: d"]
    return [*head, f"   data: [ {_numbers(matrix)} ]"]


@dataclass(frozen=True)
class _Value:
    line: int
    text: str


def read_yaml(path: Path) -> tuple[SkyCamera, tuple[float, float]]:
    """Read a camera from a YAML file of OpenCV or ROS.

    Returns
    -------
    The camera, without covariance: YAML has no place for correlations; and width and height of the frame in
    pixels.

    Raises
    ------
    InputError
        The file cannot be read, is none of the two, or has a lens with terms that no camera here has.
    """
    values = _read(path)
    matrix = _matrix(path, values, ("camera_matrix", "Camera_Matrix", "K"), (3, 3))
    found = next((key for key in _DISTORTION if f"{key}.data" in values), "")
    if not found:
        raise InputError(f"has no {_DISTORTION[0]}", file=path)
    given = _list(path, values[f"{found}.data"])
    frame = _size(path, values, "width"), _size(path, values, "height")
    if matrix[0, 1] or not np.array_equal(matrix[[1, 2, 2, 2], [0, 0, 1, 2]], [0, 0, 0, 1]):
        raise _bad(path, _first(values, "camera_matrix"), "is no camera matrix without skew")
    fisheye = _fisheye(path, values)
    terms = _FISHEYE if fisheye else _BROWN
    if any(given[len(terms) :]):
        raise _bad(
            path,
            values[f"{found}.data"],
            f"has more terms than {', '.join(terms)}: `photogram.Camera` has rational and prism ones",
        )
    parameters = {"fx": matrix[0, 0], "fy": matrix[1, 1], "cx": matrix[0, 2], "cy": matrix[1, 2]}
    parameters |= dict(zip(terms, [*given, *[0.0] * len(terms)][: len(terms)], strict=True))
    of, lens = (SkyCamera, "kannala_brandt") if fisheye else (BrownCamera, "brown")
    empty = of.of_field(*frame, 1.0, lens)
    return of(np.array([parameters[name] for name in empty.names]), empty.covariance, lens), frame


_DISTORTION = ("distortion_coefficients", "Distortion_Coefficients", "dist_coeffs", "D")


def _fisheye(path: Path, values: dict[str, _Value]) -> bool:
    """Return whether terms are those of a fisheye: only when the file says so."""
    if "distortion_model" in values:
        model = values["distortion_model"]
        if model.text not in _ROS:
            raise _bad(path, model, f"is none of the models {', '.join(_ROS)}")
        return model.text == "equidistant"
    if "fisheye_model" in values:
        return values["fisheye_model"].text not in ("0", "false", "False")
    return False


def _size(path: Path, values: dict[str, _Value], what: str) -> float:
    for key in (f"image_{what}", f"image_{what.capitalize()}", f"{what}"):
        if key in values:
            size = _number(path, values[key], values[key].text)
            if size < 1:
                raise _bad(path, values[key], "is no size of an image")
            return size
    raise InputError(f"has no image_{what}", file=path)


def _matrix(path: Path, values: dict[str, _Value], keys: Sequence[str], shape: tuple[int, int]) -> Floats:
    for key in keys:
        if f"{key}.data" in values:
            found = _list(path, values[f"{key}.data"])
            if len(found) != math.prod(shape):
                raise _bad(path, values[f"{key}.data"], f"has {len(found)} numbers, not {math.prod(shape)}")
            return np.array(found).reshape(shape)
    raise InputError(f"has no {keys[0]}", file=path)


def _first(values: dict[str, _Value], key: str) -> _Value:
    return next(value for name, value in values.items() if name.lower().startswith(key) or name == "K.data")


def _bad(path: Path, value: _Value, what: str) -> InputError:
    return InputError(f"line {value.line}: {quoted(value.text)} {what}", file=path)


def _number(path: Path, value: _Value, text: str) -> float:
    try:
        return finite_number(text.strip())
    except ValueError as error:
        raise _bad(path, value, f"is no number: {error}") from None


def _list(path: Path, value: _Value) -> list[float]:
    if not (value.text.startswith("[") and value.text.endswith("]")):
        raise _bad(path, value, "is no list of numbers")
    inside = value.text[1:-1].strip()
    return [_number(path, value, each) for each in inside.split(",")] if inside else []


def _read(path: Path) -> dict[str, _Value]:
    """Return the values by their keys, those of nested mappings joined by dots."""
    found: dict[str, _Value] = {}
    above: list[tuple[int, str]] = []
    opened: tuple[str, int, str] | None = None
    for number, line in enumerate(read_lines(path), 1):
        text = line.split(" #")[0].rstrip()
        if opened is not None:
            # A list goes on over several lines.
            key, first, before = opened
            joined = f"{before} {text.strip()}"
            opened = None if joined.endswith("]") else (key, first, joined)
            found[key] = _Value(first, joined)
            continue
        if not text.strip() or text.lstrip().startswith(("#", "%", "---", "...")):
            continue
        match = _KEY.match(text)
        if match is None:
            what = "is no line of a YAML file of OpenCV or ROS"
            raise InputError(f"line {number}: {quoted(line)} {what}", file=path)
        depth, name, value = len(match[1]), match[2], (match[3] or "").strip()
        above = [each for each in above if each[0] < depth]
        if len(above) >= _DEEPEST:
            raise InputError(f"line {number}: {quoted(line)} is nested too deep", file=path)
        key = ".".join([*(each for _, each in above), name])
        if key in found:
            raise InputError(f"line {number}: {name} is there twice", file=path)
        if not value or value.startswith("!!"):
            above.append((depth, name))
        elif value.startswith("[") and not value.endswith("]"):
            opened = (key, number, value)
            found[key] = _Value(number, value)
        else:
            found[key] = _Value(number, value.strip("\"'"))
    return found
