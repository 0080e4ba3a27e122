"""Maps of results for geographic information systems, and point clouds (docs/maps.md)."""

from photogram.formats.maps.files import map_files
from photogram.formats.maps.layers import Layer, map_layers
from photogram.formats.maps.ply import point_cloud

__all__ = ["Layer", "map_files", "map_layers", "point_cloud"]
