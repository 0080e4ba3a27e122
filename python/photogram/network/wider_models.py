"""Camera models with more lens terms: the same camera, whose further parameters are 0 and may be free."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from photogram.lazy_dataclasses import replace
from photogram.network.cameras import Camera

_WIDER = {
    "perspective": ("brown",),
    "simple_pinhole": ("radial", "opencv", "full_opencv"),
    "simple_radial": ("radial", "opencv", "full_opencv"),
    "radial": ("opencv", "full_opencv"),
    "pinhole": ("opencv", "full_opencv"),
    "opencv": ("full_opencv",),
    "simple_fisheye": ("radial_fisheye", "opencv_fisheye"),
    "simple_radial_fisheye": ("radial_fisheye", "opencv_fisheye"),
    "radial_fisheye": ("opencv_fisheye",),
    "fisheye": ("opencv_fisheye",),
}
"""Models that contain a model, the narrowest first."""
_INTERIOR = ("f", "fx", "fy", "c", "cx", "cy", "xp", "yp")
_LENS = ("k", "k1", "k2", "p1", "p2", "a1", "a2")
"""Principal distance and point, two radial and two tangential terms, under the names of all models."""


def matching_word(name: str, words: Collection[str]) -> str:
    """Return the word that selects a parameter, `f` for `fx` and `fy`; nothing if none does."""
    lower = name.lower()
    if lower in words:
        return lower
    return "f" if lower in ("fx", "fy") and "f" in words else ""


def with_parameters(camera: Camera, words: Collection[str]) -> Camera:
    """Return a camera of the narrowest model that contains its own and has most of the named parameters."""

    def count(model: Camera) -> int:
        return len({matching_word(name, words) for name in model.names} - {""})

    return max(_models(camera), key=count)


def freed(camera: Camera, words: Collection[str]) -> Camera:
    """Return a camera whose named parameters are free; other values are known as well as before."""
    known = zip(camera.names, camera.deviations.tolist(), strict=True)
    sd = {
        name: math.inf if matching_word(name, words) and name not in camera.constants else value
        for name, value in known
    }
    covariance = camera.covariance
    if covariance is not None:
        names, matrix = covariance
        rows = [row for row, name in enumerate(names) if math.isfinite(sd[name])]
        covariance = ([names[row] for row in rows], np.asarray(matrix)[np.ix_(rows, rows)]) if rows else None
    return replace(camera, sd=sd, covariance=covariance)


def calibration_words(camera: Camera) -> list[str]:
    """Return the parameters that a calibration of a camera frees; nothing if all of these are free.

    These are principal distance and point and the first lens terms: in the narrowest model with a fixed lens
    term if there is one.
    """
    models = _models(camera)
    model = next((each for each in models if any(name.lower() in _LENS for name in _fixed(each))), camera)
    if not _fixed(model):
        return []
    values = zip(model.names, model.deviations.tolist(), strict=True)
    return list(
        dict.fromkeys(
            "f" if name in ("fx", "fy") else name
            for name, sd in values
            if name.lower() in (*_INTERIOR, *_LENS) and name not in model.constants and sd in (0, math.inf)
        )
    )


def _fixed(camera: Camera) -> list[str]:
    """Return the parameters that a calibration frees and that are fixed."""
    return [
        name
        for name, sd in zip(camera.names, camera.deviations.tolist(), strict=True)
        if name.lower() in (*_INTERIOR, *_LENS) and name not in camera.constants and sd == 0
    ]


def calibrated(camera: Camera) -> Camera:
    """Return a camera whose :func:`calibration_words` are free."""
    words = [word.lower() for word in calibration_words(camera)]
    return freed(with_parameters(camera, words), words) if words else camera


def _models(camera: Camera) -> list[Camera]:
    """Return a camera in its own model and in all that contain it."""
    if camera.covariance is not None:
        return [camera]
    return [camera, *(_in_model(camera, model) for model in _WIDER.get(camera.model, ()))]


def _in_model(camera: Camera, model: str) -> Camera:
    """Return a camera in a model that contains its own."""
    has_two = model in ("opencv", "full_opencv", "opencv_fisheye")
    names = {"k": ("k1",), "f": ("fx", "fy") if has_two else ("f",)}
    known = zip(camera.names, camera.deviations.tolist(), strict=True)
    deviations = {other: sd for name, sd in known for other in names.get(name, (name,))}
    values = {other: value for name, value in camera.parameters.items() for other in names.get(name, (name,))}
    return replace(camera, model=model, parameters=values, sd=deviations)
