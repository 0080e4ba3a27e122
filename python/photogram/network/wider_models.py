"""Camera models with more lens terms: the same camera, whose further parameters are 0 and may be free."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np

from photogram import _photocore
from photogram.errors import InputError
from photogram.lazy_dataclasses import replace
from photogram.network.cameras import Camera

_RADIAL = {"k1", "k2"}
"""Terms of models that a calibration may change to."""
_DIRECTIONS = np.array([[0.2, 0.1, -1.0], [-0.3, 0.25, -1.0], [0.05, -0.35, -1.0]])
"""Directions with equal images in a model and in all models that contain it."""
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
    """Return a camera in its own model and in all that contain it, those with the fewest parameters first.

    Models with inverted formulas (Brown's) precede others of as many parameters.
    """
    if camera.covariance is not None:
        return [camera]
    models = sorted(_photocore.camera_models(), key=lambda each: (len(each[1][1]), each[1][3] == "forward"))
    wider = (_in_model(camera, name, facts[1]) for name, facts in models if name != camera.model)
    return [camera, *(each for each in wider if each is not None)]


def _in_model(camera: Camera, model: str, powers: Sequence[tuple[str, int]]) -> Camera | None:
    """Return a camera in another model with its images; None if that model does not contain its own."""
    names = [name for name, _ in powers]
    if not {name.lower() for name in names} >= _RADIAL:
        return None
    same: dict[str, tuple[str, ...]] = {name: (name,) for name in names}
    same["k"] = ("k1",)
    if "f" not in names:
        same["f"] = ("fx", "fy")
    if not all(set(same.get(name, ("",))) <= set(names) for name in camera.names):
        return None
    known = zip(camera.names, camera.deviations.tolist(), strict=True)
    deviations = {other: sd for name, sd in known for other in same[name]}
    values = {other: value for name, value in camera.parameters.items() for other in same[name]}
    try:
        wider = replace(camera, model=model, parameters=values, sd=deviations)
        equal = np.allclose(wider.project(_DIRECTIONS), camera.project(_DIRECTIONS), rtol=1e-9, atol=0.0)
    except InputError:  # A constant of the model, such as the size of the picture, is required.
        return None
    return wider if equal else None
