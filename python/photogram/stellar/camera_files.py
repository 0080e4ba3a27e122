"""What files of calibrated cameras have in common: parameters by name, and their covariance."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.files import read_bytes

__all__ = ["read_any", "read_camera", "read_document", "weight_of"]


def weight_of(covariance: Floats) -> Floats:
    """Return the weight matrix of a covariance whose rows differ by orders of magnitude.

    Raises
    ------
    InputError
        The covariance is not positive definite.
    """
    sd = np.sqrt(np.diag(covariance))
    try:
        lower = np.linalg.cholesky(covariance / np.outer(sd, sd))
    except np.linalg.LinAlgError:
        raise InputError("the covariance of the camera is not positive definite") from None
    root = np.linalg.solve(lower, np.diag(1.0 / sd))
    return np.asarray(root.T @ root, float)


def read_any(path: Path) -> dict[str, Any]:
    """Read a JSON document.

    Raises
    ------
    InputError
        The file cannot be read, or holds something else.
    """
    try:
        document = orjson.loads(read_bytes(path))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"is not a camera: {error}", file=path) from None
    if not isinstance(document, dict):
        raise InputError("is not a camera: no JSON object", file=path)
    return document


def read_document(path: Path, kinds: Sequence[str]) -> dict[str, Any]:
    """Read a JSON document of one of some kinds.

    Raises
    ------
    InputError
        The file cannot be read, or is another document.
    """
    document = read_any(path)
    if "kind" not in document:
        raise InputError("is not a camera: 'kind'", file=path)
    if document["kind"] not in kinds:
        raise InputError(f"is a {document['kind']}, not a {' or a '.join(kinds)}", file=path)
    return document


def read_camera(path: Path, document: dict[str, Any], names: Sequence[str]) -> tuple[Floats, Floats]:
    """Return the parameters of a document and their covariance: zero for what is not in its order.

    Raises
    ------
    InputError
        A parameter that is missing, what is not a number, a negative variance.
    """
    names = list(names)
    try:
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
    return found, covariance
