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

__all__ = ["CloudFile", "Crs", "MapFile", "check_maps", "drawn_maps"]

Crs = Annotated[
    str | None,
    typer.Option(
        metavar="CRS",
        help="Coordinate reference system of results: photos, points and control go to `in_crs/` of --out,"
        " with covariances in metres east, north, up, and maps are in it (EPSG:25832, ENU:lat,lon,h ...).",
        show_default=False,
    ),
]
MapFile = Annotated[
    Path | None,
    Writes.FILE,
    typer.Option(
        "--map",
        metavar="FILE",
        help="Write a map, .gpkg or .geojson: photos, footprints, points with error ellipses, residuals of"
        " control, suspicious observations.",
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
    cloud: Path | None,
    crs: str | None,
    sizes: Sequence[tuple[float, float] | None] = (),
    *,
    quiet: bool = False,
) -> dict[Path, bytes]:
    """Return the files of `--map FILE` and `--ply FILE`; none without them."""
    files: dict[Path, bytes] = {}
    if chart is not None:
        from photogram.formats.maps import map_files

        made, remarks = map_files(result, chart, crs, sizes=sizes)
        files |= made
        if not quiet:
            for each in remarks:
                print_remark(each)
    if cloud is not None:
        from photogram.formats.maps import point_cloud
        from photogram.formats.placing import placed

        files[cloud] = point_cloud(result, None if crs is None else placed(result, crs))
    return files
