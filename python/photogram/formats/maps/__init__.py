"""Maps of results for GIS, and point clouds (docs/maps.md)."""

from photogram.formats.maps.files import map_files, point_cloud
from photogram.formats.maps.layers import Layer, map_layers

__all__ = ["Layer", "map_files", "map_layers", "point_cloud"]
