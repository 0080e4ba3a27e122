"""Maps as GeoPackage or GeoJSON with styles, and point clouds as PLY."""

from __future__ import annotations

import sqlite3
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.maps.layers import LAYERS, DrawnLayer, Layer, chosen_crs, map_layers
from photogram.formats.results import Placed
from photogram.network.rays import local_axes
from photogram.results.footprints import metric_covariances
from photogram.results.network import AdjustedNetwork
from photogram.results.result import Result
from photogram.words import Phrase, phrase

GEOPACKAGE, GEOJSON = ".gpkg", (".geojson", ".json")
WGS84 = "EPSG:4979"  # System of GeoJSON (RFC 7946): longitude, latitude, height above the ellipsoid
DECIMALS = 9  # Decimals of degrees: 0.1 mm
_STYLES = """
CREATE TABLE layer_styles (
    id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
    f_table_catalog TEXT(256), f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256),
    styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT, owner TEXT(30),
    ui TEXT(30), update_time DATETIME DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now'))
)
"""


def map_files(
    result: Result,
    path: Path,
    crs: str | None = None,
    *,
    scale: float | None = None,
    sizes: Sequence[tuple[float, float] | None] = (),
) -> tuple[dict[Path, bytes], list[Phrase]]:
    """Return the files of a map, and remarks.

    Parameters
    ----------
    result
        The result of a block.
    path
        `NAME.gpkg`: one file with all layers and their styles. `NAME.geojson`: one file per layer with
        features, `NAME-photos.geojson` ..., each with its style in a `.qml` file; always in WGS 84.
    crs, scale, sizes
        As in :func:`map_layers`.

    Raises
    ------
    InputError
        If the suffix is unknown, or coordinates cannot be transformed into the system.
    ModuleNotFoundError
        If geopandas or pyogrio are not installed.
    """
    suffix = check_map(path)
    remarks: list[Phrase] = []
    if suffix in GEOJSON and chosen_crs(result):
        if crs not in (None, WGS84):
            remarks.append(phrase("maps.geojson", crs=crs))
        crs = WGS84
    layers = map_layers(result, crs, scale=scale, sizes=sizes)
    if layers[0].table.crs is None:
        remarks.append(phrase("maps.no-crs", name=path.name))
    remarks += [
        phrase("maps.left-out", name=path.name, content=each.description) for each in layers if each.left_out
    ]
    return (_geopackage(path, layers) if suffix == GEOPACKAGE else _geojson(path, layers)), remarks


def check_map(path: Path) -> str:
    """Return the suffix of a map file; reject other suffixes."""
    suffix = path.suffix.lower()
    if suffix != GEOPACKAGE and suffix not in GEOJSON:
        raise InputError(phrase("maps.suffix", value=suffix), file=path)
    return suffix


def _geopackage(path: Path, layers: Sequence[Layer]) -> dict[Path, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "map.gpkg"
        for each in layers:
            options = {"DESCRIPTION": each.description, "GEOMETRY_NAME": "geom"}
            _write(each, made, "GPKG", options, layer=each.title, append=made.exists())
        # QGIS opens layers with the styles of this table.
        with closing(sqlite3.connect(made)) as base, base:
            base.execute(_STYLES)
            base.executemany(
                "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column,"
                " styleName, styleQML, styleSLD, useAsDefault, description, owner)"
                " VALUES ('', '', ?, 'geom', ?, ?, '', 1, ?, '')",
                [(each.title, each.name, style(each.name), each.description) for each in layers],
            )
            base.execute(
                "INSERT INTO gpkg_contents (table_name, data_type, identifier, description)"
                " VALUES ('layer_styles', 'attributes', 'layer_styles', 'styles of the layers, for QGIS')"
            )
        return {path: made.read_bytes()}


def _geojson(path: Path, layers: Sequence[Layer]) -> dict[Path, bytes]:
    files = {}
    with tempfile.TemporaryDirectory() as folder:
        for each in layers:
            if not len(each.table):
                continue
            name = f"{path.stem}-{each.name}"
            made = Path(folder) / f"{name}.geojson"
            standard = "NO" if each.table.crs is None else "YES"
            options = {"RFC7946": standard, "COORDINATE_PRECISION": str(DECIMALS)}
            _write(each, made, "GeoJSON", options | {"DESCRIPTION": each.description})
            files[path.with_name(made.name)] = made.read_bytes()
            files[path.with_name(f"{name}.qml")] = style(each.name).encode()
    return files


def _write(drawn: Layer, path: Path, driver: str, options: dict[str, str], **more: object) -> None:
    import pyogrio

    with warnings.catch_warnings():
        # One remark reports a missing system for all layers.
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        kind = LAYERS[drawn.name][0].geometry
        more |= {"driver": driver, "geometry_type": kind, "layer_options": options}
        pyogrio.write_dataframe(drawn.table, path, **more)


def _symbol(row: DrawnLayer) -> tuple[str, str, Mapping[str, str]]:
    """Return the symbol type of a row, the class of its only layer, and its properties."""
    if row.shape == "line":
        own = {"line_color": row.colour, "line_style": "solid"}
        return "line", "SimpleLine", own | {"line_width": row.size, "line_width_unit": "MM"}
    if row.shape == "fill":
        own = {"color": row.colour or "0,0,0,0", "style": "solid" if row.colour else "no"}
        own |= {"outline_color": row.outline, "outline_style": "solid"}
        return "fill", "SimpleFill", own | {"outline_width": row.size, "outline_width_unit": "MM"}
    outline = {"outline_color": "255,255,255,255", "outline_width": "0.1", "outline_width_unit": "MM"}
    own = {"name": row.shape, "color": row.colour, **outline, "size": row.size, "size_unit": "MM"}
    return "marker", "SimpleMarker", own


def style(name: str) -> str:
    rows = LAYERS[name]
    attribute = "kind" if rows[0].value else ""
    root = Element("qgis", version="3.22.0", styleCategories="Symbology")
    kind = "categorizedSymbol" if attribute else "singleSymbol"
    attributes = {"type": kind, "enableorderby": "0", "forceraster": "0", "symbollevels": "0"}
    renderer = SubElement(root, "renderer-v2", attributes)
    if attribute:
        renderer.set("attr", attribute)
        categories = SubElement(renderer, "categories")
        for row, each in enumerate(rows):
            own = {"value": each.value, "label": each.value, "symbol": str(row)}
            SubElement(categories, "category", own | {"render": "true", "type": "string"})
    drawn = SubElement(renderer, "symbols")
    for row, (form, layer, properties) in enumerate(map(_symbol, rows)):
        symbol = SubElement(drawn, "symbol", type=form, name=str(row), alpha="1", clip_to_extent="1")
        inside = SubElement(symbol, "layer", {"class": layer, "enabled": "1", "locked": "0", "pass": "0"})
        # QGIS from version 3.26 reads the options, before 3.18 the properties.
        options = SubElement(inside, "Option", type="Map")
        for key, value in properties.items():
            SubElement(options, "Option", name=key, type="QString", value=value)
            SubElement(inside, "prop", k=key, v=value)
    indent(root)
    declared = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
    return declared + tostring(root, encoding="unicode") + "\n"


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

    A vertex has `x`, `y`, `z` in double precision, their standard deviations `sd_x`, `sd_y`,
    `sd_z`, `sd_max` (the major axis of the standard ellipsoid), and `rays`. Viewers show the further
    properties as scalar fields.

    Parameters
    ----------
    result
        The result of a block or a collection.
    found
        The result in a coordinate reference system in metres. None: the axes of the block, or of a
        geographic one east, north and up at the mean of its stations.
    origin
        Origin subtracted from the coordinates, for viewers with single precision; a comment contains it.

    Raises
    ------
    InputError
        If the system is in degrees.
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
    known = np.isfinite(covariances).all(axis=(1, 2))
    vertices["sd_max"] = np.nan
    vertices["sd_max"][known] = np.sqrt(np.linalg.eigvalsh(covariances[known])[:, -1])
    vertices["rays"] = np.minimum(result.point_rays[rows], 65535)
    unit = result.block.linear_unit if isinstance(result, Result) else ""
    printed = "".join(each if each.isascii() and each.isprintable() else "?" for each in what)
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment frame {printed}; unit {unit or 'not known'}",
        f"comment origin {' '.join(repr(float(each)) for each in origin)} was taken away",
        f"element vertex {len(rows)}",
        *(f"property {_TYPES[_VERTEX[name].str]} {name}" for name in _VERTEX.names or ()),
        "end_header\n",
    ]
    return "\n".join(lines).encode("ascii") + vertices.tobytes()


def _own(result: AdjustedNetwork) -> tuple[Indices, Floats, Floats, str]:
    """Return used points in metric axes, with covariances and the name of the axes."""
    rows = np.flatnonzero(result.used_points)
    places, covariances = result.point_positions[rows], result.point_covariances[rows]
    if not isinstance(result, Result):
        return rows, places, covariances, "that of the collection"
    if result.block.geographic:
        local = local_axes(result.block).positions(places)
        return rows, local, metric_covariances(result)[rows], "east, north, up amid the stations"
    return rows, places, covariances, str(result.block.frame)
