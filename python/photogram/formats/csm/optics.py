"""The lens and the detector of support data in JSON."""

from __future__ import annotations

import re
from typing import cast

import numpy as np

from photogram.arguments.types import Floats
from photogram.formats.csm.isd import Detector, Pixels, Plane
from photogram.io.json import Tree, unknown
from photogram.network.lens import Lens, LensModel

__all__ = ["from_pixels", "instrument", "not_zero", "read_detector", "read_lens", "transformed"]

_MEMBERS = {
    "radial": ("coefficients",),
    "transverse": ("x", "y"),
    "lrolrocnac": ("coefficients",),
    "kaguyalism": ("boresight_x", "x", "boresight_y", "y"),
    "cahvor": ("coefficients",),
    "radtan": ("coefficients",),
}
"""Where the coefficients of each lens are; all of them may also stand in `coefficients`."""


def read_lens(tree: Tree, focal_length: float) -> Lens | None:
    """Return the lens of an ISD; None where it is perfect.

    Raises
    ------
    InputError
        None or several, one that is not known, coefficients that are none.
    """
    optics = tree["optical_distortion"]
    models = [name for name, _ in optics.items()]
    if len(models) != 1:
        raise optics.error(f"has {len(models)} models, not one")
    model = models[0]
    if model not in _MEMBERS:
        raise unknown(Tree(model, optics.file, optics.path), "the lens", _MEMBERS)
    own = optics[model]
    members = ("coefficients",) if "coefficients" in own else _MEMBERS[model]
    found = [value for name in members for value in _flat(own[name])]
    if not any(found) and model == "radial":
        return None
    try:
        return Lens(cast("LensModel", model), tuple(found), focal_length if model == "radtan" else 1.0)
    except ValueError as error:
        raise own.error(str(error)) from None


def _flat(tree: Tree) -> list[float]:
    """Return the numbers of a list, or a number that stands alone."""
    return [each.number() for each in tree] if isinstance(tree.value, list) else [tree.number()]


def read_detector(tree: Tree, keywords: Tree) -> Detector:
    """Return the detector of an ISD; ISIS has its own way from pixels to millimetres in the keywords of NAIF.

    Raises
    ------
    InputError
        A key that is missing or no number, an affine transformation that has no inverse.
    """

    def pair(form: str) -> Floats:
        return np.array([tree[form.format(axis)].number() for axis in ("sample", "line")])

    centre = tree["detector_center"]
    summing = pair("detector_{}_summing")
    if not (summing > 0).all():
        raise tree["detector_sample_summing"].error("is not positive, or that of lines is not")
    csm = from_pixels(tree["focal2pixel_samples"], tree["focal2pixel_lines"])
    planes: dict[Pixels, Plane] = {"csm": csm, "isis": csm}
    code = instrument(tree, keywords)
    if code is not None:
        planes["isis"] = transformed(keywords, code)
    return Detector(
        np.array([centre["sample"].number(), centre["line"].number()]),
        pair("starting_detector_{}"),
        summing,
        planes,
    )


def from_pixels(samples: Tree, lines: Tree) -> Plane:
    """Return the inverse of the affine transformation from millimetres to samples and lines of the detector.

    Raises
    ------
    InputError
        Coefficients that are not three numbers each, one without an inverse.
    """
    rows = _affine(samples, lines)
    inverse: Floats = np.asarray(np.linalg.inv(rows[:, 1:]), dtype=float)
    return Plane(-inverse @ rows[:, 0], inverse)


def _affine(first: Tree, second: Tree) -> Floats:
    rows = np.array([first.numbers(3), second.numbers(3)])
    if not 0 < abs(np.linalg.det(rows[:, 1:])) < np.inf:
        raise first.error(f"has no inverse, together with {second.path}")
    return rows


def instrument(tree: Tree, keywords: Tree) -> str | None:
    """Return the prefix of an instrument's keywords, as `INS-85600`; None where there are none.

    Raises
    ------
    InputError
        Several instruments, and none of them is that of the pointing.
    """
    codes = sorted({own[1] for name, _ in keywords.items() if (own := _TRANSX.fullmatch(name))})
    frames = tree["instrument_pointing"].get("time_dependent_frames", []).value
    named = [code for code in codes if isinstance(frames, list) and frames and code == f"INS{frames[0]}"]
    if len(codes) > 1 and not named:
        raise keywords.error(f"has several instruments, {', '.join(codes)}, none that of the pointing")
    return (named or [*codes, None])[0]


_TRANSX = re.compile(r"(INS-?\d+)_TRANSX")


def transformed(keywords: Tree, code: str) -> Plane:
    """Return the transformation of an instrument's keywords TRANSX, TRANSY.

    Raises
    ------
    InputError
        One that is missing, or has no inverse.
    """
    rows = _affine(keywords[f"{code}_TRANSX"], keywords[f"{code}_TRANSY"])
    return Plane(rows[:, 0], rows[:, 1:])


def not_zero(tree: Tree) -> float:
    """Return a number that is not zero.

    Raises
    ------
    InputError
        None, or zero.
    """
    found = tree.number()
    if not found:
        raise tree.error("is zero")
    return found
