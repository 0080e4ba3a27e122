"""YAML as OpenCV, ROS and Kalibr write it: numbers with all their digits, matrices in rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["figures", "matrix", "quoted", "ros_matrix"]


def figures(values: ArrayLike) -> str:
    """Return numbers between brackets, each with the digits that say it."""
    return "[" + ", ".join(repr(float(each)) for each in np.ravel(values)) + "]"


def quoted(text: str) -> str:
    """Return a text between quotation marks."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def matrix(name: str, values: ArrayLike) -> list[str]:
    """Return a matrix of OpenCV."""
    found = np.atleast_2d(np.asarray(values, dtype=float))
    rows, columns = found.shape
    shape = [f"   rows: {rows}", f"   cols: {columns}", "   dt: d"]
    return [f"{name}: !!opencv-matrix", *shape, f"   data: {figures(found)}"]


def ros_matrix(name: str, values: Sequence[Sequence[float]] | np.ndarray) -> list[str]:
    """Return a matrix of ROS."""
    found = np.atleast_2d(np.asarray(values, dtype=float))
    rows, columns = found.shape
    return [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: {figures(found)}"]
