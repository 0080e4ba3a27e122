"""Layers of a map of a result, as data frames of geopandas, with error ellipses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby, starmap
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.formats.crs import GEOCENTRIC, amid, enu_origin, has_place, to_system, utm_zone, without_geoid
from photogram.formats.declarations import declared
from photogram.formats.project import frame_of
from photogram.formats.results import Placed, placed
from photogram.lazy_dataclasses import dataclass
from photogram.network.geometry import geocentric_to_geographic
from photogram.results.footprints import footprints
from photogram.results.result import Result
from photogram.results.tables import ComponentTests, Tests
from photogram.show.sketch.marks import ellipse_axes
from photogram.show.style import round_length
from photogram.statistics.limits import normal_limit

if TYPE_CHECKING:
    import geopandas

CONFIDENCE = 0.95  # Default probability of an ellipse
MOST_ELLIPSES = 20_000  # Default limit of error ellipses of points
SUSPICIOUS = 3.0  # Smallest test value on the map
_ANGLES = ("omega", "phi", "kappa")
_LOCAL = ("e", "n", "u")


class DrawnLayer(NamedTuple):
    """A row of `layers.csv`: a layer, or the symbol of a value of its attribute `kind`."""

    layer: str
    geometry: str
    value: str
    shape: str  # Of a marker, `fill` or `line`
    colour: str
    outline: str
    size: str  # Size of markers, width of lines: millimetres
    description: str


_ROWS = starmap(DrawnLayer, declared(__file__, "layers.csv"))
LAYERS = {name: list(rows) for name, rows in groupby(_ROWS, lambda row: row.layer)}
"""The declared layers of maps by name."""


@dataclass(frozen=True, eq=False)
class Layer:
    """A layer of a map.

    Attributes
    ----------
    name
        `photos`, `footprints`, `points`, `point_ellipses`, `control`, `control_residuals`, `check_residuals`
        or `suspicious`.
    title
        The name with the scale of its drawing, if any: `point_ellipses_x200`.
    description
        One sentence.
    table
        Geometries and attributes; its `crs` is the system of the map, None if the position on the earth is
        unknown.
    left_out
        Number of omitted features.
    """

    name: str
    title: str
    description: str
    table: geopandas.GeoDataFrame
    left_out: int = 0


def chosen_crs(result: Result) -> str:
    """Return the default system of a map: the system of the frame, or UTM (WGS 84).

    Empty if the position of the frame on the earth is unknown, or lengths are not metres.
    """
    block, frame = result.block, frame_of(result.block)
    if not has_place(frame) or block.linear_unit != "m":
        return ""
    if frame.kind == "cartesian":
        return frame.crs
    earth, _ = to_system(GEOCENTRIC, result.photo_positions, frame)
    return utm_zone(*amid(GEOCENTRIC, earth)[:2])


def map_layers(
    result: Result,
    crs: str | None = None,
    *,
    scale: float | None = None,
    confidence: float = CONFIDENCE,
    sizes: Sequence[tuple[float, float] | None] = (),
    most: int = MOST_ELLIPSES,
) -> list[Layer]:
    """Return the layers of a map.

    Parameters
    ----------
    result
        The result of a block.
    crs
        Coordinate reference system of the map. None: the system of the frame, or its zone of UTM (WGS 84). If
        the position of the frame on the earth is unknown, layers have the coordinates of the frame, without a
        system.
    scale
        Magnification of error ellipses and residuals. None: a round number at which they are visible.
    confidence
        Confidence level of the error ellipses.
    sizes
        Image width and height of each camera in the unit of image coordinates; without them footprints
        contain the image observations.
    most
        Largest number of error ellipses: of control and check points, and of every second, third ... other
        point. The description of the layer contains the number of points.

    Raises
    ------
    InputError
        If coordinates cannot be transformed into the system.
    ModuleNotFoundError
        If geopandas is not installed.
    """
    import geopandas
    import shapely

    found = placed(result, chosen_crs(result) if crs is None else crs)
    own = ellipses(found.point_covariances, confidence)
    drawn, known = _with_ellipses(found, most)
    few = f" {len(drawn):,} of {known:,}" if len(drawn) < known else ""
    if scale is None:
        # Sizes are in metres, positions in degrees: the scale follows from the spacing of stations in metres.
        spacing = found.points[:, :2]
        if found.names[0] == "longitude" and len(spacing):
            one = found.moved(found.points[:1], np.ones((1, 3))) - found.points[:1]
            spacing = spacing / one[:, :2]
        scale = fitting_scale(own, spacing)
    rows, given, steps = _given(found, found.control_differences())
    tests = np.abs(result.control.standardized)
    largest = np.where(np.isnan(tests), 0.0, tests).max(axis=1, initial=0.0)
    parts: dict[str, _Part] = {
        "photos": _photos(found),
        "footprints": _footprints(found, sizes),
        "points": (found.points, _points(found)),
        "point_ellipses": _ellipses(found, drawn, confidence, scale),
        "control": (given, {"point": _ids(found)[rows], **_along("d", steps), "largest_test": largest}),
        "control_residuals": _vectors(found, rows, given, steps, scale),
        "check_residuals": _vectors(found, *_given(found, found.differences()), scale),
        "suspicious": _suspicious(found),
    }
    fields = {"percent": 100 * confidence, "few": few, "scale": scale, "limit": SUSPICIOUS}
    system = None if not found.crs or enu_origin(found.crs) is not None else without_geoid(found.crs)
    shapes = {"Point": shapely.points, "LineString": shapely.linestrings, "Polygon": shapely.polygons}
    layers = []
    for name, (corners, columns) in parts.items():
        declared = LAYERS[name][0]
        geometries = shapes[declared.geometry.split()[0]](corners) if len(corners) else []
        title = f"{name}_x{scale:g}" if "{scale" in declared.description else name
        table = geopandas.GeoDataFrame(dict(columns), geometry=list(geometries), crs=system)
        left_out = known - len(drawn) if name == "point_ellipses" else 0
        layers.append(Layer(name, title, declared.description.format(**fields), table, left_out))
    return layers


_Part = tuple[Any, Mapping[str, Any]]  # Corners of geometries, and columns


def _photos(found: Placed) -> _Part:
    result, block = found.result, found.result.block
    angles, deviations = (np.degrees(each) for each in found.angles())
    own = block.image_photos[result.used_images]
    squares = np.sum(result.residuals[result.used_images] ** 2, axis=1)
    images = np.bincount(own, minlength=len(block.photo_ids))
    with np.errstate(invalid="ignore"):
        rms = np.sqrt(np.bincount(own, squares, len(block.photo_ids)) / (2 * images))
    cameras: dict[str, Any] = {}
    if block.photo_cameras is not None:
        cameras["camera"] = np.array(block.camera_names)[block.photo_cameras]
    return found.photos, {
        "photo": block.photo_ids,
        **cameras,
        **_deviations(found.photo_covariances),
        **dict(zip((f"{name}_deg" for name in _ANGLES), angles.T, strict=True)),
        **dict(zip((f"sd_{name}_deg" for name in _ANGLES), deviations.T, strict=True)),
        "images": images,
        f"rms_{block.image_unit}": rms,
    }


def _footprints(found: Placed, sizes: Sequence[tuple[float, float] | None]) -> _Part:
    import shapely

    block, shown = found.result.block, footprints(found.result, sizes)
    outlines = shown.positions()
    known: Bools = np.asarray(np.isfinite(outlines).all(axis=2))
    rows = np.flatnonzero(known.sum(axis=1) >= 4)
    places = found.carried(outlines[rows][known[rows]])
    of_rings = np.repeat(np.arange(len(rows)), known[rows].sum(axis=1))
    rings = shapely.linearrings(places, indices=of_rings) if len(rows) else []  # Closes open rings
    unit = block.linear_unit
    return rings, {
        "photo": np.array(block.photo_ids, dtype=object)[rows],
        f"{unit}_per_{block.image_unit}": shown.size[rows],
        "cut": shown.cut[rows],
    }


def _points(found: Placed) -> dict[str, Any]:
    kinds, rays = (column[found.rows] for column in (found.result.point_kinds, found.result.point_rays))
    columns = {"point": _ids(found)[found.rows], "kind": kinds, "rays": rays}
    return columns | _deviations(found.point_covariances)


def _with_ellipses(found: Placed, most: int) -> tuple[Indices, int]:
    """Return the points with an ellipse, and the number of candidates."""
    known = np.flatnonzero(np.isfinite(found.point_covariances).all(axis=(1, 2)))
    if len(known) <= most:
        return known, len(known)
    passes = found.result.point_kinds[found.rows[known]] == "pass"
    named, others = known[~passes], known[passes]
    step = -(-len(others) // max(most - len(named), 1))
    return np.sort(np.concatenate([named, others[::step]])), len(known)


def _ellipses(found: Placed, known: Indices, confidence: float, scale: float) -> _Part:
    own = ellipses(found.point_covariances[known], confidence)
    steps = own.outlines(scale)
    count = steps.shape[1]
    flat = np.column_stack([steps.reshape(-1, 2), np.zeros(steps.size // 2)])
    places = found.moved(np.repeat(found.points[known], count, axis=0), flat)
    return places[:, :2].reshape(-1, count, 2), {
        "point": _ids(found)[found.rows[known]],
        "a": own.major,
        "b": own.minor,
        "azimuth_deg": np.degrees(own.azimuth),
        "confidence": np.full(len(known), confidence),
        "scale": np.full(len(known), scale),
    }


def _given(found: Placed, differences: tuple[Indices, Floats]) -> tuple[Indices, Floats, Floats]:
    """Return rows of points, given positions, and (c, 3) differences."""
    rows, steps = differences
    places = {row: k for k, row in enumerate(found.rows.tolist())}
    adjusted = found.points[[places[row] for row in rows.tolist()]]
    return rows, found.moved(adjusted, -steps), steps


def _vectors(found: Placed, rows: Indices, given: Floats, steps: Floats, scale: float) -> _Part:
    ends = found.moved(given, scale * steps)
    return np.stack([given, ends], axis=1), {
        "point": _ids(found)[rows],
        **_along("d", steps),
        "length": np.linalg.norm(steps, axis=1),
        "scale": np.full(len(rows), scale),
    }


def _suspicious(found: Placed) -> _Part:
    """Return observations with large test values, the largest first."""
    tests = Tests(found.result).normal
    limit = normal_limit(max(sum(int(np.isfinite(each.values).sum()) for each in tests), 1))
    rows = sorted(_large_tests(found, tests), key=lambda each: -abs(each[1]["test"]))
    columns = {name: [own.get(name) for _, own in rows] for name in _SUSPECT}
    columns["beyond"] = [abs(own["test"]) > limit for _, own in rows]
    columns["limit"] = [limit] * len(rows)
    return np.array([at for at, _ in rows]), columns


def _large_tests(found: Placed, types: Sequence[ComponentTests]) -> Iterator[tuple[Floats, dict[str, Any]]]:
    """Yield position and attributes of suspicious components, at their first point or photo."""
    block, kinds = found.result.block, found.result.kinds
    places = np.full((len(block.point_ids), 3), np.nan)
    places[found.rows] = found.points
    point_places = dict(zip(block.point_ids, places, strict=True))
    photo_places = dict(zip(block.photo_ids, found.photos, strict=True))
    for tests in types:
        for row, k in np.argwhere(np.abs(tests.values) > SUSPICIOUS).tolist():
            axis, moment = tests.axes[k], None
            own: dict[str, Any] = {"what": f"{tests.type} {axis.name}"}
            if tests.points is not None or tests.photos is not None:
                point = None if tests.points is None else block.point_ids[tests.points[row]]
                photo = None if tests.photos is None else block.photo_ids[tests.photos[row]]
            else:
                kind = kinds[tests.type]
                own["what"] += f" of {kind.names[row]}"
                each = block.observations[int(kind.rows[row])]
                if not (each.points or each.photos):
                    continue
                point, photo = next(iter(each.points), None), next(iter(each.photos), None)
                moment, photo = each.moment, photo if each.moment is None else None
            if tests.type == "image":
                own |= zip("xy", block.image_xy[row].tolist(), strict=True)
            own |= {"photo": photo, "point": point, "unit": axis.unit}
            own |= {"residual": float(tests.residuals[row, k]), "test": float(tests.values[row, k])}
            if point is not None:
                yield point_places[point], own
            elif moment is not None:
                # The adjusted trajectory at a time.
                flown = found.result.trajectories[moment.trajectory.name]
                at, *_ = flown.given.flown(np.array([moment.time]), flown.position, flown.rotation)
                if block.spheroid is not None:
                    at = geocentric_to_geographic(at, block.spheroid)
                yield np.asarray(found.carried(at)[0]), own
            elif photo is not None:
                yield photo_places[photo], own


_SUSPECT = ("what", "photo", "point", "x", "y", "residual", "unit", "test")


def _deviations(covariances: Floats) -> dict[str, Floats]:
    return _along("sd", np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)))


def _along(what: str, values: Floats) -> dict[str, Floats]:
    """Return (n, 3) values along east, north and up as columns."""
    return {f"{what}_{axis}": column for axis, column in zip(_LOCAL, values.T, strict=True)}


def _ids(found: Placed) -> np.ndarray[Any, Any]:
    return np.array(found.result.block.point_ids, dtype=object)


VERTICES = 36
SHARE = 0.3  # Size of a typical drawn ellipse relative to the distance between neighbours


@dataclass(frozen=True, eq=False)
class Ellipses:
    major: Floats  # (n,) semi-axes in the unit of the positions
    minor: Floats
    azimuth: Floats  # (n,) of the major axis, clockwise from the second axis (north): radians, -pi/2 to pi/2

    def outlines(self, scale: float = 1.0) -> Floats:
        """Return (n, 37, 2) closed outlines about the origin, enlarged."""
        around = np.linspace(0.0, math.tau, VERTICES + 1)
        along = scale * np.outer(self.major, np.cos(around))
        across = scale * np.outer(self.minor, np.sin(around))
        sine, cosine = np.sin(self.azimuth)[:, np.newaxis], np.cos(self.azimuth)[:, np.newaxis]
        found = np.stack([along * sine + across * cosine, along * cosine - across * sine], axis=2)
        found[:, -1] = found[:, 0]
        return found


def ellipses(covariances: Floats, confidence: float | None = CONFIDENCE) -> Ellipses:
    """Return the error ellipses of (n, 2, 2) or larger covariances of east and north.

    The axes are the roots of the eigenvalues, times the root of the quantile of chi-square with two degrees
    of freedom, -2 ln(1 - confidence): 2.4477 for 95 %. They contain the true position with the probability
    `confidence`; None: standard ellipses (39 %). NaN if the covariance is NaN.
    """
    factor = 1.0 if confidence is None else math.sqrt(-2.0 * math.log1p(-confidence))
    semi_axes, angles = ellipse_axes(covariances[:, :2, :2])
    major, minor = factor * semi_axes.T
    return Ellipses(major, minor, np.radians(np.where(angles < 0, -90.0, 90.0) - angles))


def fitting_scale(found: Ellipses, places: Floats) -> float:
    """Return a round display scale (1, 2, 5, 10 ...) for ellipses at (n, 2) positions."""
    known = np.isfinite(found.major) & np.isfinite(places[:, :2]).all(axis=1)
    if not known.any():
        return 1.0
    typical, extent = float(np.median(found.major[known])), np.ptp(places[known, :2], axis=0)
    area = max(float(extent[0] * extent[1]), float(extent.max()) ** 2 / len(places))
    spacing = math.sqrt(area / known.sum())
    return max(round_length(SHARE * spacing / typical), 1.0) if typical > 0 else 1.0
