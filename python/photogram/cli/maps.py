"""What the commands that adjust blocks share about maps and point clouds: options and files."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import print_remark
from photogram.cli.job import Writes

if TYPE_CHECKING:
    from photogram import Result
    from photogram.results.network import AdjustedNetwork

__all__ = ["CloudFile", "CloudOrigin", "Crs", "MapFile", "check_maps", "drawn_maps", "point_clouds"]

Crs = Annotated[
    str | None,
    typer.Option(
        metavar="CRS",
        help="Coordinate reference system of results in `in_crs/` and of maps (EPSG:25832 ...).",
        show_default=False,
    ),
]
MapFile = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(
        "--map",
        metavar="FILE",
        help="Write a map, .gpkg or .geojson: photos, footprints, error ellipses, suspicious observations.",
        show_default=False,
    ),
]
CloudFile = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(
        "--ply",
        metavar="FILE",
        help="Write the points as a point cloud with standard deviations (PLY).",
        show_default=False,
    ),
]
CloudOrigin = Annotated[
    tuple[float, float, float] | None,
    typer.Option(
        "--ply-origin",
        metavar="X Y Z",
        help="Taken away from the coordinates of --ply: viewers want small ones.",
        show_default=False,
    ),
]


def check_maps(chart: Path | None) -> None:
    """Refuse, before anything is adjusted, a map that cannot be written."""
    if chart is None:
        return
    from photogram.formats.maps.files import check_map

    check_map(chart)
    for package in ("geopandas", "pyogrio"):
        if find_spec(package) is None:
            raise ModuleNotFoundError(f"No module named {package!r}", name=package)


def drawn_maps(
    result: Result,
    chart: Path | None,
    crs: str | None,
    sizes: Sequence[tuple[float, float] | None] = (),
    *,
    quiet: bool = False,
) -> dict[Path, bytes]:
    """Return the files of `--map FILE`; none without it."""
    if chart is None:
        return {}
    from photogram.formats.maps import map_files

    files, remarks = map_files(result, chart, crs, sizes=sizes)
    if not quiet:
        for each in remarks:
            print_remark(each)
    return files


def point_clouds(
    result: AdjustedNetwork,
    cloud: Path | None,
    origin: tuple[float, float, float] | None,
    crs: str | None = None,
) -> dict[Path, bytes]:
    """Return the file of `--ply FILE`; none without it."""
    if cloud is None:
        return {}
    from photogram import Result
    from photogram.formats.crs_results import placed
    from photogram.formats.maps import point_cloud

    found = placed(result, crs) if crs is not None and isinstance(result, Result) else None
    return {cloud: point_cloud(result, found, origin=origin or (0.0, 0.0, 0.0))}
