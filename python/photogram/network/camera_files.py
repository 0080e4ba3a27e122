"""Cameras that were calibrated elsewhere, and their files: weighted observations of blocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_bytes
from photogram.network.cameras import Camera

__all__ = ["BROWN", "PLATE", "brown_camera", "camera_from", "plate_camera", "read_calibrated"]

BROWN = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2")
"""Parameters of a calibration by digital exposures, pixels."""
PLATE = ("epsilon", "xp", "yp", "cx", "cy", "dx", "dy", "K1", "K2", "K3", "K4", "K5", "phi_T")
"""Interior parameters of a calibration by plates, radians and metres."""
KINDS = {"brown camera": BROWN, "stellar camera": PLATE}
"""What the files say they are."""

_IN_MODEL = {"cx": "c", "cy": "c_y"}
_METRE = 1000.0
"""In mm, which plates have in blocks."""
_POWERS = {"epsilon": 0, "phi_T": 0, "K1": -2, "K2": -4, "K3": -6, "K4": -1, "K5": -3}
"""Of the metre in the units of parameters; 1 for all others."""


def camera_from(path: Path | str, name: str = "", *, weighted: bool = True) -> Camera:
    """Return the camera of a file that `photogram stellar-camera` has written.

    Parameters
    ----------
    path
        `camera.json`, of plates or of digital exposures.
    name
        For reports.
    weighted
        Whether what was calibrated is observed, with its full covariance; otherwise it is known.

    Returns
    -------
    `plate` (mm) or `full_opencv` (columns and rows).

    Raises
    ------
    InputError
        The file cannot be read, or is no camera.
    """
    file = Path(path)
    document = _loaded(file)
    kind = document.get("kind") if isinstance(document, dict) else None
    if kind not in KINDS:
        raise InputError(_other(document, kind), file=file)
    document, values, covariance = read_calibrated(file, kind)
    if kind == "brown camera":
        return brown_camera(values, covariance, name, weighted=weighted)
    return plate_camera(
        values,
        covariance,
        name,
        weighted=weighted,
        common_scale=bool(document.get("common_scale")),
        distortion_first=float(document.get("reference_principal_distance") or 0.0),
    )


def _other(document: Any, kind: object) -> str:
    """Say what a document is that is no camera."""
    if isinstance(document, dict) and {"nonorthogonality_rad", "correction"} & document.keys():
        return (
            "holds the correction of a comparator: comparator.Correction.read(path).as_camera(camera) lays a"
            " camera on it"
        )
    return f"is no camera: its kind is {kind}, not {' or '.join(KINDS)}"


def brown_camera(values: Floats, covariance: Floats, name: str = "", *, weighted: bool = True) -> Camera:
    """Return a camera of digital exposures as blocks take it: `full_opencv`.

    Parameters
    ----------
    values, covariance
        (9,) and (9, 9) in the order of `BROWN`; variances of zero are those of what was held.
    name, weighted
        As for :func:`camera_from`.
    """
    return _calibrated("full_opencv", BROWN, values, covariance, {}, name, weighted)


def plate_camera(
    values: Floats,
    covariance: Floats,
    name: str = "",
    *,
    weighted: bool = True,
    common_scale: bool = False,
    distortion_first: float = 0.0,
) -> Camera:
    """Return a camera of star plates as blocks take it: `plate`, in mm.

    The model has the parameters of the calibration, so that values and covariance only change their units.

    Parameters
    ----------
    values, covariance
        (13,) and (13, 13) in the order of `PLATE`; variances of zero are those of what was held.
    name, weighted
        As for :func:`camera_from`.
    common_scale
        Whether cx is the principal distance of both axes.
    distortion_first
        Principal distance (metres) of the form with scale after distortion; 0 for scale before distortion.
    """
    scale = np.array([_METRE ** _POWERS.get(each, 1) for each in PLATE])
    values, covariance = values * scale, covariance * np.outer(scale, scale)
    if common_scale:
        values[PLATE.index("cy")] = 0.0
    names = tuple(_IN_MODEL.get(each, each) for each in PLATE)
    return _calibrated("plate", names, values, covariance, {"c0": _METRE * distortion_first}, name, weighted)


def _calibrated(
    model: str,
    names: tuple[str, ...],
    values: Floats,
    covariance: Floats,
    constants: dict[str, float],
    name: str,
    weighted: bool,
) -> Camera:
    """Return a camera whose parameters are observed where they have a variance."""
    parameters = dict(zip(names, values.tolist(), strict=True)) | constants
    known = np.flatnonzero(np.diag(covariance) > 0)
    if not (weighted and known.size):
        return Camera(model, parameters, name=name)
    observed = [names[row] for row in known], covariance[np.ix_(known, known)]
    return Camera(model, parameters, covariance=observed, name=name)


def read_calibrated(path: Path, kind: str) -> tuple[dict[str, Any], Floats, Floats]:
    """Read a document, its parameters and their covariance: zero for what is not in its order.

    Parameters
    ----------
    path
        The file.
    kind
        One of `KINDS`.

    Raises
    ------
    InputError
        The file cannot be read, or is another document.
    """
    names = KINDS[kind]
    document = _loaded(path)
    try:
        if document["kind"] != kind:
            raise InputError(f"is a {document['kind']}, not a {kind}", file=path)
        values = [document["parameters"][name] for name in names]
        order = [names.index(name) for name in document["covariance"]["order"]]
        matrix = np.array(document["covariance"]["matrix"], float).reshape(len(order), len(order))
        found = np.array([v["value"] if isinstance(v, dict) else v for v in values], float)
        # A null becomes NaN.
        if not (np.isfinite(found).all() and np.isfinite(matrix).all() and (np.diag(matrix) >= 0).all()):
            raise InputError("is not a camera: what is not a number, or a negative variance", file=path)
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"is not a camera: {error}", file=path) from None
    covariance = np.zeros((len(names), len(names)))
    covariance[np.ix_(order, order)] = matrix
    return document, found, covariance


def _loaded(path: Path) -> Any:
    try:
        return orjson.loads(read_bytes(path))
    except ValueError as error:
        raise InputError(f"is not a camera: {error}", file=path) from None


check_arguments(globals(), ["camera_from"])
