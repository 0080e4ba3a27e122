"""Point clouds as PLY, with standard deviations as scalars."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.crs_results import Placed
from photogram.network.rays import local_axes
from photogram.results.ellipses import metric_covariances
from photogram.results.network import AdjustedNetwork
from photogram.results.result import Result
from photogram.words import phrase

__all__ = ["point_cloud"]

_VERTEX = np.dtype(
    [
        *((name, "<f8") for name in ("x", "y", "z")),
        *((name, "<f4") for name in ("sd_x", "sd_y", "sd_z", "sd_max")),
        ("rays", "<u2"),
    ]
)
_TYPES = {"<f8": "double", "<f4": "float", "<u2": "ushort"}


def point_cloud(
    result: AdjustedNetwork,
    found: Placed | None = None,
    *,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> bytes:
    """Return the adjusted points as PLY (binary, little endian).

    A vertex has `x`, `y`, `z` in double precision, the standard deviations of these as `sd_x`, `sd_y`,
    `sd_z`, `sd_max` (the major axis of the standard ellipsoid), and `rays`. Viewers show the further
    properties as scalar fields.

    Parameters
    ----------
    result
        The result of a block or a collection.
    found
        The same in a coordinate reference system in metres. None: the axes of the block, of a geographic one
        east, north and up amid its stations.
    origin
        Taken away from the coordinates, and told in a comment: viewers that calculate in single precision
        need small numbers.

    Raises
    ------
    InputError
        A system in degrees.
    """
    if found is None:
        rows, places, covariances, what = _own(result)
    elif found.units[0] == "deg":
        raise InputError(phrase("maps.degrees", crs=found.crs))
    else:
        rows, places, covariances, what = found.rows, found.points, found.point_covariances, found.crs
    vertices = np.zeros(len(rows), dtype=_VERTEX)
    for axis, name in enumerate("xyz"):
        vertices[name] = places[:, axis] - origin[axis]
        vertices[f"sd_{name}"] = np.sqrt(covariances[:, axis, axis])
    vertices["sd_max"] = _largest(covariances)
    vertices["rays"] = np.minimum(result.point_rays[rows], 65535)
    unit = result.block.linear_unit if isinstance(result, Result) else ""
    return _header(len(rows), what, unit, origin) + vertices.tobytes()


def _own(result: AdjustedNetwork) -> tuple[Indices, Floats, Floats, str]:
    """Return the points that took part, in metric axes, with covariances and the name of the axes."""
    rows = np.flatnonzero(result.used_points)
    places, covariances = result.point_positions[rows], result.point_covariances[rows]
    if not isinstance(result, Result):
        return rows, places, covariances, "that of the collection"
    if result.block.geographic:
        local = local_axes(result.block).positions(places)
        return rows, local, metric_covariances(result)[rows], "east, north, up amid the stations"
    return rows, places, covariances, str(result.block.frame)


def _largest(covariances: Floats) -> Floats:
    known = np.isfinite(covariances).all(axis=(1, 2))
    found = np.full(len(covariances), np.nan)
    found[known] = np.sqrt(np.linalg.eigvalsh(covariances[known])[:, -1])
    return found


def _header(count: int, what: str, unit: str, origin: tuple[float, float, float]) -> bytes:
    printed = "".join(each if each.isascii() and each.isprintable() else "?" for each in what)
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment frame {printed}; unit {unit or 'not known'}",
        f"comment origin {' '.join(repr(float(each)) for each in origin)} was taken away",
        f"element vertex {count}",
        *(f"property {_TYPES[_VERTEX[name].str]} {name}" for name in _VERTEX.names or ()),
        "end_header",
    ]
    return ("\n".join(lines) + "\n").encode("ascii")
