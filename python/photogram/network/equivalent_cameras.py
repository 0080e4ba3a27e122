"""Equivalent cameras of other models: with more lens terms, and with the terms of OpenCV."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from functools import cache

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.cameras import Camera

# Of a pinhole in the order of OpenCV (p1 of r^2 + 2 y^2 in y); k4, k5, k6 are in the denominator
TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
_PINHOLES = frozenset(
    {"simple_pinhole", "pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_pinhole"}
)
_FISHEYES = frozenset(
    {"simple_fisheye", "fisheye", "simple_radial_fisheye", "radial_fisheye", "opencv_fisheye"}
)


@dataclass(frozen=True)
class OpencvLens:
    """A camera with a lens of OpenCV, y down, in the unit of the camera."""

    fisheye: bool  # Whether it is equidistant
    focal: tuple[float, float]  # fx, fy and cx, cy
    centre: tuple[float, float]
    terms: Mapping[str, float]  # By name; missing terms are 0

    @property
    def matrix(self) -> Floats:
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def named(self, *names: str) -> dict[str, float] | None:
        """Return some terms by name; None if others are not 0."""
        if any(value for name, value in self.terms.items() if name not in names):
            return None
        return {name: self.terms.get(name, 0.0) for name in names}

    def first(self, count: int) -> list[float] | None:
        """Return the first terms in OpenCV order; None if others are not 0."""
        order = FISHEYE_TERMS if self.fisheye else TERMS
        found = self.named(*order[:count])
        return None if found is None else [*found.values()] + [0.0] * (count - len(order))

    def fewest(self, counts: tuple[int, ...]) -> list[float] | None:
        """Return the terms for the first sufficient count; None if all are too small."""
        return next((found for each in counts if (found := self.first(each)) is not None), None)

    @property
    def ros(self) -> tuple[str, list[float]]:
        """Distortion model of ROS and its coefficients, which are empty if it has more terms."""
        if self.fisheye:
            return "equidistant", self.first(4) or []
        if (terms := self.first(5)) is not None:
            return "plumb_bob", terms
        return "rational_polynomial", self.first(8) or []


def opencv_lens(camera: Camera) -> OpencvLens | None:
    """Return a camera as an exactly equivalent lens; None if impossible."""
    if camera.model not in _PINHOLES | _FISHEYES:
        return None
    values = camera.parameters
    focal = (values["f"], values["f"]) if "f" in values else (values["fx"], values["fy"])
    core = {"f", "fx", "fy", "cx", "cy"}
    terms = {"k1" if name == "k" else name: value for name, value in values.items() if name not in core}
    return OpencvLens(camera.model in _FISHEYES, focal, (values["cx"], values["cy"]), terms)


_RADIAL = {"k1", "k2"}  # Terms of models that a calibration may change to
_DIRECTIONS = np.array([[0.2, 0.1, -1.0], [-0.3, 0.25, -1.0], [0.05, -0.35, -1.0]])
"""Directions with equal images in a model and in all models that contain it."""
_DISTANCES = frozenset({"f", "fx", "fy", "c"})
_INTERIOR = ("f", "fx", "fy", "c", "cx", "cy", "xp", "yp")
_LENS = ("k", "k1", "k2", "p1", "p2", "a1", "a2")
"""Principal distance and point, two radial and two tangential terms, under the names of all models."""


def matching_word(name: str, words: Collection[str]) -> str:
    """Return the word that selects a parameter, `f` for `fx` and `fy`; empty if none does."""
    lower = name.lower()
    if lower in words:
        return lower
    return "f" if lower in ("fx", "fy") and "f" in words else ""


def with_parameters(camera: Camera, words: Collection[str]) -> Camera:
    """Return an equivalent camera in the smallest model with most of the named parameters."""

    def count(model: Camera) -> int:
        return len({matching_word(name, words) for name in model.names} - {""})

    return max(_models(camera), key=count)


def freed(camera: Camera, words: Collection[str]) -> Camera:
    """Return a camera whose named parameters are free; standard deviations of others are unchanged."""
    sd = {
        name: math.inf if matching_word(name, words) and name not in camera.constants else value
        for name, value in camera.sd.items()
    }
    covariance = camera.covariance
    if covariance is not None:
        names, matrix = covariance
        rows = [row for row, name in enumerate(names) if math.isfinite(sd[name])]
        covariance = ([names[row] for row in rows], np.asarray(matrix)[np.ix_(rows, rows)]) if rows else None
    return replace(camera, sd=sd, covariance=covariance)


def calibration_words(camera: Camera) -> list[str]:
    """Return the parameters that a calibration frees; empty if all of them are free already.

    The parameters are principal distance and point and the first lens terms, in the smallest model with a
    fixed lens term if there is one.
    """
    models = _models(camera)
    model = next(
        (each for each in models if any(name.lower() in _LENS for name in _with_sd(each, 0))), camera
    )
    if not _with_sd(model, 0):
        return []
    names = _with_sd(model, 0, math.inf)
    return list(dict.fromkeys("f" if name in ("fx", "fy") else name for name in names))


def _with_sd(camera: Camera, *deviations: float) -> list[str]:
    """Return parameters of the interior orientation with one of some standard deviations."""
    known = {name for name in camera.names if name.lower() in (*_INTERIOR, *_LENS)} - camera.constants
    return [name for name, sd in camera.sd.items() if name in known and sd in deviations]


def calibrated(camera: Camera) -> Camera:
    """Return a camera whose :func:`calibration_words` are free."""
    words = [word.lower() for word in calibration_words(camera)]
    return freed(with_parameters(camera, words), words) if words else camera


def with_one_focal_length(camera: Camera, size: tuple[float, float] | None = None) -> Camera:
    """Return an equivalent camera with one focal length f in the smallest model; fx = fy required.

    The camera is unchanged if fx differs from fy, or if no model contains its values and unknowns. It is also
    unchanged if that model requires the missing `size` of the image (width and height in pixels).
    """
    sd, values = camera.sd, camera.parameters
    if "fx" not in values or values["fx"] != values["fy"] or sd["fx"] != sd["fy"]:
        return camera
    if camera.covariance is not None:
        return camera
    used = tuple(name for name in camera.names if values[name] or sd[name])
    single = (
        model
        for name, names in _names_by_model()
        if "f" in names and (model := _in_model(camera, name, used, size)) is not None
    )
    return next(single, camera)


def focal_length_message(camera: Camera, single: Camera) -> str:
    """Return a sentence on the unknown f of a camera and of its :func:`with_one_focal_length`."""
    if single is camera:
        return f"f is two unknowns of the model {camera.model}, fx and fy"
    changes = []
    if any(single.parameters.get(name) != camera.parameters.get(name) for name in ("p1", "p2")):
        changes.append("its p1 and p2 are p2 and p1")
    if "w" in single.names:
        changes.append("cx and cy count from the middle of the picture")
    return "; ".join([f"{single.model} is {camera.model} with one unknown f", *changes])


def _models(camera: Camera) -> list[Camera]:
    """Return equivalent cameras in all models that contain it, by number of parameters.

    Models with inverted formulas (Brown's) precede others of as many parameters.
    """
    if camera.covariance is not None:
        return [camera]
    wider = (
        _in_model(camera, name, camera.names)
        for name, names in _names_by_model()
        if name != camera.model and {each.lower() for each in names} >= _RADIAL | ({"fx"} & set(camera.names))
    )
    return [camera, *(each for each in wider if each is not None)]


@cache
def _names_by_model() -> list[tuple[str, tuple[str, ...]]]:
    """Return models and their parameters, by number of parameters."""
    models = sorted(_photocore.camera_models(), key=lambda each: (len(each[1][1]), each[1][3] == "forward"))
    return [(name, tuple(parameter for parameter, _ in facts[1])) for name, facts in models]


def _in_model(
    camera: Camera, model: str, used: tuple[str, ...], size: tuple[float, float] | None = None
) -> Camera | None:
    """Return an equivalent camera in another model; None if the model lacks a used parameter."""
    same = _same_parameters(camera.model, model, used)
    if same is None:
        return None
    deviations = {other: camera.sd[name] for name, others in same.items() for other in others}
    try:
        values = _renamed(camera.parameters, same, model, size)
        return replace(camera, model=model, parameters=values, sd=deviations)
    except InputError:  # A constant of the model, such as the image size, is required.
        return None


@cache
def _same_parameters(model: str, other: str, used: tuple[str, ...]) -> dict[str, tuple[str, ...]] | None:
    """Return corresponding parameters of two models; None if their images differ."""
    names = dict(_names_by_model())[other]
    same: dict[str, tuple[str, ...]] = {name: (name,) for name in names}
    if "k" not in names:
        same["k"] = ("k1",)
    if "f" in names:
        same |= {"fx": ("f",), "fy": ("f",)}
    else:
        same["f"] = ("fx", "fy")
    values = {name: 0.01 * row for row, name in enumerate(used, 1)}
    values |= {name: -1.0 if name == "c" else 1.0 for name in _DISTANCES.intersection(used)}
    for exchange in ({}, {"p1": ("p2",), "p2": ("p1",)}):
        by_name = same | exchange
        if not all(set(by_name.get(name, ("",))) <= set(names) for name in used):
            continue
        own = {name: by_name[name] for name in used}
        try:
            images = Camera(model, values).project(_DIRECTIONS)
            renamed = Camera(other, _renamed(values, own, other, (2.0, 2.0))).project(_DIRECTIONS)
        except InputError:  # A parameter without a general value, such as the order of splines.
            continue
        if np.allclose(renamed, images, rtol=1e-9, atol=0.0):
            return own
    return None


def _renamed(
    values: Mapping[str, float],
    same: Mapping[str, tuple[str, ...]],
    model: str,
    size: tuple[float, float] | None,
) -> dict[str, float]:
    """Return values under the names of another model, which may count from the image centre."""
    renamed = {other: values[name] for name, others in same.items() for other in others}
    if size is not None and "w" not in values and "w" in dict(_names_by_model())[model]:
        middle = {"cx": size[0] / 2, "cy": size[1] / 2}
        renamed |= {name: values.get(name, 0.0) - value for name, value in middle.items()}
        renamed |= {"w": size[0], "h": size[1]}
    return renamed
