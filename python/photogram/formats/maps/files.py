"""Maps as files: GeoPackage with its styles, or GeoJSON with styles beside."""

from __future__ import annotations

import sqlite3
import tempfile
import warnings
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

from photogram.errors import InputError
from photogram.formats.maps.layers import Layer, chosen_crs, map_layers
from photogram.formats.maps.styles import style
from photogram.results.result import Result

__all__ = ["check_map", "map_files"]

GEOPACKAGE, GEOJSON = ".gpkg", (".geojson", ".json")
WGS84 = "EPSG:4979"
"""Of GeoJSON (RFC 7946): longitude, latitude, height above the ellipsoid."""
DECIMALS = 9
"""Of degrees: 0.1 mm."""
_STYLES = """
CREATE TABLE layer_styles (
    id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
    f_table_catalog TEXT(256), f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256),
    styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT, owner TEXT(30),
    ui TEXT(30), update_time DATETIME DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now'))
)
"""
_GEOMETRIES = {
    "photos": "Point Z",
    "footprints": "Polygon Z",
    "points": "Point Z",
    "point_ellipses": "Polygon",
    "control": "Point Z",
    "control_residuals": "LineString Z",
    "check_residuals": "LineString Z",
    "suspicious": "Point Z",
}


def map_files(
    result: Result,
    path: Path,
    crs: str | None = None,
    *,
    scale: float | None = None,
    sizes: Sequence[tuple[float, float] | None] = (),
) -> tuple[dict[Path, bytes], list[str]]:
    """Return the files of a map, and what is to be said about it.

    Parameters
    ----------
    result
        The result of a block.
    path
        `NAME.gpkg`: one file with all layers and their styles. `NAME.geojson`: a file for each layer that
        has something, `NAME-photos.geojson` ..., each with its style as `.qml` beside; always in WGS 84.
    crs, scale, sizes
        As of :func:`map_layers`.

    Raises
    ------
    InputError
        Another suffix, or a system that does not go.
    ModuleNotFoundError
        geopandas or pyogrio are not installed.
    """
    suffix = check_map(path)
    remarks = []
    if suffix in GEOJSON and chosen_crs(result):
        if crs not in (None, WGS84):
            remarks.append(f"GeoJSON is in WGS 84, not in {crs}: that is what it is defined to be")
        crs = WGS84
    layers = map_layers(result, crs, scale=scale, sizes=sizes)
    if layers[0].table.crs is None:
        remarks.append(
            f"the map {path.name} has no coordinate reference system: nothing says where on the earth the"
            " coordinates are"
        )
    remarks += [
        f"the map {path.name} has {each.description}; all standard deviations are in the layer of the points"
        for each in layers
        if each.left_out
    ]
    return (_geopackage(path, layers) if suffix == GEOPACKAGE else _geojson(path, layers)), remarks


def check_map(path: Path) -> str:
    """Return the ending of a file that can be a map."""
    suffix = path.suffix.lower()
    if suffix != GEOPACKAGE and suffix not in GEOJSON:
        raise InputError("maps are written as .gpkg or .geojson", file=path)
    return suffix


def _geopackage(path: Path, layers: Sequence[Layer]) -> dict[Path, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "map.gpkg"
        for each in layers:
            options = {"DESCRIPTION": each.description, "GEOMETRY_NAME": "geom"}
            _write(each, made, "GPKG", options, layer=each.title, append=made.exists())
        _add_styles(made, layers)
        return {path: made.read_bytes()}


def _add_styles(path: Path, layers: Sequence[Layer]) -> None:
    """Put styles where QGIS looks for them, so that the layers open with these."""
    with closing(sqlite3.connect(path)) as base, base:
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


def _geojson(path: Path, layers: Sequence[Layer]) -> dict[Path, bytes]:
    files = {}
    with tempfile.TemporaryDirectory() as folder:
        for each in layers:
            if not len(each.table):
                continue
            name = f"{path.stem}-{each.name}"
            made = Path(folder) / f"{name}.geojson"
            options = {
                "RFC7946": "NO" if each.table.crs is None else "YES",
                "COORDINATE_PRECISION": str(DECIMALS),
                "DESCRIPTION": each.description,
            }
            _write(each, made, "GeoJSON", options)
            files[path.with_name(made.name)] = made.read_bytes()
            files[path.with_name(f"{name}.qml")] = style(each.name).encode()
    return files


def _write(drawn: Layer, path: Path, driver: str, options: dict[str, str], **more: object) -> None:
    import pyogrio

    with warnings.catch_warnings():
        # That a map has no system is said once for all layers.
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        pyogrio.write_dataframe(
            drawn.table,
            path,
            driver=driver,
            geometry_type=_GEOMETRIES[drawn.name],
            layer_options=options,
            **more,
        )
